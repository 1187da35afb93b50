"""The GMF table of the six cases against the stored one, which names the command that wrote it."""

import json
from pathlib import Path

import numpy as np
import pytest

from gearmbs.studies.presets.paper import gmf_levels

STORED = json.loads((Path(__file__).parent / "gmf_levels.json").read_text())


@pytest.fixture(
    scope="module",
    params=[pytest.param(False, id="all bodies", marks=pytest.mark.slow), pytest.param(True, id="angles alone")],
)
def levels(request):
    return gmf_levels(workers=2, lump=request.param)


@pytest.mark.parametrize("case", list(STORED["levels"]))
@pytest.mark.slow
def test_gmf_levels(levels, case):
    for component, values in STORED["levels"][case].items():
        np.testing.assert_allclose(levels[case][component], values, rtol=1e-3, err_msg=f"{case}, {component}")
