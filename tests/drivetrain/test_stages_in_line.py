"""Many stages in line: they run, and the cost grows about as their number."""

import time
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.trains import stages_in_line
from gearmbs.drivetrain import ElasticBearing, RunSettings
from gearmbs.mechanism import simulate
from gearmbs.mechanism.lumping import lumped
from gearmbs.studies import trains


def test_ten_stages_run():
    train = stages_in_line(10)
    assert train.speeds["s10"] == pytest.approx(1000 * np.pi / 30)
    solution = train.build().simulate(0.01, rate=1000, tol=1e-6, rate_scale=train.rate_scale)
    assert solution.success
    for k in range(10):
        assert solution.contact(f"m{k}")["pairs_drive"][-1] > 0


def test_stages_on_fixed_axes_are_integrated_by_their_angles():
    """Two unknowns a shaft but the driven one instead of 31, and the same forces."""
    train = stages_in_line(3)
    lump, full = (train.build().simulate(0.02, rate=5000, tol=1e-9, lump=on) for on in (True, False))
    assert lump.problem.n == 6
    assert full.problem.n > 100
    for k in range(3):
        ours, theirs = (one.contact(f"m{k}") for one in (lump, full))
        assert set(ours) == set(theirs)
        for name in set(theirs) - {"pairs_drive", "pairs_back"}:
            # numbers of teeth change at other steps
            np.testing.assert_allclose(ours[name], theirs[name], atol=1e-3 * np.abs(theirs[name]).max())
    for name in ("of 0", "of 3", "drive"):
        for ours, theirs in zip(lump.reaction(name), full.reaction(name), strict=True):
            np.testing.assert_allclose(ours, theirs, atol=2e-3 * (np.abs(theirs).max() + 1e-9))


@pytest.mark.slow
def test_records_of_trains_on_joints_follow_angles_alone(monkeypatch):
    """By themselves; a mechanism that is handed in does as it says."""
    solved = []

    def noted(*args, **settings):
        solved.append(simulate(*args, **settings))
        return solved[-1]

    monkeypatch.setattr(trains, "simulate", noted)
    train, run = stages_in_line(2), RunSettings(duration=0.05)
    alone, full = trains.run_train(train, run), trains.run_train(train, run, mechanism=train.build())
    assert [one.problem.n for one in solved] == [4, len(solved[1].system.unknowns())]
    for name in ("normal_force", "bearing_force", "mesh_rms"):
        np.testing.assert_allclose(alone[name], full[name], atol=2e-3 * float(abs(full[name]).max()))


def test_shafts_in_elastic_bearings_keep_six_coordinates():
    train = stages_in_line(1)
    assert lumped(train.build()) is not None
    stiff = {"station": 0.05, "tilting": (1e5, 1e5)}
    elastic = [ElasticBearing(name=one.name, shaft=one.shaft, **stiff) for one in train.bearings]
    assert lumped(replace(train, bearings=elastic).build()) is None


@pytest.mark.slow
def test_cost_grows_about_linearly():
    spent = []
    for count in (1, 2, 5, 10):
        train = stages_in_line(count)
        m = train.build()
        best = np.inf
        for _ in range(3):
            start = time.process_time()
            assert m.simulate(0.05, rate=1000, tol=1e-7, rate_scale=train.rate_scale).success
            best = min(best, time.process_time() - start)
        spent.append(best)
    exponent = np.polyfit(np.log([1, 2, 5, 10]), np.log(spent), 1)[0]
    assert exponent < 1.15
