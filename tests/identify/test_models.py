"""Models that differ in kind are told apart by how well each fits."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from gearmbs.identify import CaseProblem, Free, compare_models
from tests.identify.levels import CASES, run_stored

FRICTION = Free("friction.dynamic", 0.05, 0.01, 0.2, also={"friction.static": 2.0})


@pytest.mark.slow
@pytest.mark.parametrize("planted", ["skew", "inclination"])
def test_the_plane_of_a_misalignment_is_chosen(planted, monkeypatch):
    """From six noisy numbers of one recording of a sensor of unknown gain, with friction unknown, too."""
    monkeypatch.setattr("gearmbs.studies.run.simulation.plain_record", run_stored)
    planes = {p: CASES[p] for p in ("skew", "inclination")}
    secret = planes[planted].changed(friction={"static": 0.12, "dynamic": 0.06})
    levels = run_stored(secret)["gmf_rms"].sel(way="orders")
    generator = np.random.default_rng(5)
    rows = [
        ("tilted", c, k, 3.0 * float(levels.sel(component=c, harmonic=k)) * np.exp(0.02 * generator.normal()), 0.02)
        for c in ("line_of_action", "line_of_centres")
        for k in (1, 2, 3)
    ]
    measured = pd.DataFrame(rows, columns=["case", "channel", "harmonic", "value", "sigma"])
    found = compare_models(
        {
            p: CaseProblem(measured, {"tilted": case}, [FRICTION], gains="one", way="orders")
            for p, case in planes.items()
        }
    )
    assert found.index[0] == planted
    assert found.delta_aic.iloc[1] > 10.0
    assert found.weight.sum() == pytest.approx(1.0)
    assert found.attrs["fits"][planted]["friction.dynamic"] == pytest.approx(0.06, rel=0.3)
