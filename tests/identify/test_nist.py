"""The 27 nonlinear reference problems of NIST, from both starts."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.identify import Free, fit
from tests.identify.nist import DATA, MODELS, observations

COARSE = {"Lanczos1"}
"""Data without noise: standard errors come from the rounding of the data alone, and have three digits."""


def digits(found, certified):
    return -np.log10(np.max(np.abs(np.asarray(found) - certified) / np.abs(certified)) + 1e-15)


@pytest.mark.parametrize("start", ["start_1", "start_2"])
@pytest.mark.parametrize("name", sorted(MODELS))
def test_certified_values(name, start):
    x, y = observations(name)
    free = [Free(f"b{k + 1}", value, log=False) for k, value in enumerate(DATA[name][start])]
    found = fit(lambda b: MODELS[name](b, x), y, free, most_runs=20000, tolerance=1e-15)
    assert digits(found.values, np.array(DATA[name]["certified"])) >= 6.0
    assert digits(found.errors, np.array(DATA[name]["deviation"])) >= (2.5 if name in COARSE else 4.0)
    if name not in COARSE:
        assert found.cost == pytest.approx(DATA[name]["rss"], rel=1e-6)
