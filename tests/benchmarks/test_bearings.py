"""What rolling bearings cost: the rows of the benchmark and what its tables say."""

import math

import pytest

from benchmarks import bearings


@pytest.mark.slow
def test_every_kind_is_measured():
    rows = bearings.measure_whole(1, 0.1, report=lambda text: None)
    assert [row["kind"] for row in rows] == list(bearings.KINDS)
    assert rows[0]["ratio"] == 1.0
    assert rows[0]["more"] == 0.0
    assert all(row["residual"] > 0.0 for row in rows)
    text = bearings.render(rows, [])
    assert all(f"\n| {kind} |" in text for kind in bearings.KINDS)


def test_steps_beyond_those_on_springs_are_shared_by_the_changes_of_load():
    row = {"tol": 1e-6, "scale": 1.0, "kind": "6206/CN", "joints": 1000, "steps": 1300, "changes": 50, "springs": 1200}
    text = bearings.render([], [row, {**row, "springs": math.nan}])
    assert "| 1e-06, 1 | 6206/CN | 1000 | 1300 | +30.0 | +20.0 | 50 | 2 |" in text
    assert "| +30.0 | - | 50 | - |" in text


def test_springs_are_as_stiff_as_the_bearings():
    from gearmbs.studies import Case

    case = Case(operation={"duration": 0.05})
    solution = bearings.mechanism(case, "6206/CN").simulate(0.15, rate=2000, tol=1e-5, rate_scale=3000.0)
    springs = bearings.on_springs(case, "6206/CN", solution)
    assert set(bearings.ENDS) <= set(springs.elements)
    assert not {"bearing 1", "bearing 2"} & set(springs.joints)
    on_springs = springs.simulate(0.15, rate=2000, tol=1e-5, rate_scale=3000.0)
    settled = solution.t > 0.1
    for name in bearings.ENDS:
        loads = [one.load(name)[0][settled].mean(axis=0)[:2] for one in (solution, on_springs)]
        assert loads[1] == pytest.approx(loads[0], rel=0.02, abs=10.0)
    assert bearings.changes_of_load(solution) > 0
