"""The cost of drivetrains: what its table says."""

from types import SimpleNamespace

import pytest

from benchmarks import trains


def test_shares_of_a_step_and_the_exponent():
    rows = [
        {"model": f"{n} stages in line", "meshes": n, "bodies": n + 1, "steps": 1000, "seconds": 0.1 * n**1.1,
         "ratio": 1.0, "cycles": 50.0 * n}
        for n in (1, 2, 5, 10)
    ]  # fmt: skip
    rows += [{**row, "model": row["model"] + trains.ALONE, "seconds": 0.01 * row["meshes"] ** 1.3} for row in rows]
    assert trains.exponent(rows, "in line") == pytest.approx(1.1)
    assert trains.exponent(rows, trains.ALONE) == pytest.approx(1.3)
    text = trains.render(rows, 0.1)
    assert "| 1 stages in line | 1 | 2 | 1 | 1 | 10000 | 100 | 100 | 50 | 2 |" in text
    assert "grows with the power 1.10 of them, with angles alone 1.30" in text


@pytest.mark.slow
def test_every_model_is_measured():
    rows = trains.measure(1, 0.002, report=lambda text: None)
    assert [row["model"] for row in rows][:3] == ["healthy pair", "bench, joints", "bench, elastic bearings"]
    assert rows[0]["ratio"] == 1.0
    assert [row["meshes"] for row in rows if row["model"].endswith(trains.ALONE)] == list(trains.TURNING)


def test_cost_at_one_error_lies_between_tolerances(monkeypatch):
    """Errors as tol / n^0.5 and times as n tol^-0.2: at the error of one stage n take n^0.9 of its time."""

    def harmonics(m, count, scale, tol, span):
        off = 0.0 if tol == trains.EXACT else 1e3 * tol / count**0.5
        return (1.0 + off) * trains.np.ones((count, 3)), count * tol**-0.2

    monkeypatch.setattr(trains, "harmonics_of", harmonics)
    train = SimpleNamespace(rate_scale=1.0, build=SimpleNamespace)
    monkeypatch.setattr(trains, "stages_in_line", lambda count: train)
    rows = trains.equally_accurate(1, report=lambda text: None, counts=(1, 10, 12))
    assert [row["tol"] for row in rows] == pytest.approx([1e-7, 10**0.5 * 1e-7, 12**0.5 * 1e-7])
    assert rows[1]["equal"] == pytest.approx(10.0**0.9 * rows[0]["equal"])
    assert "From ten on: power 1.00 at one tolerance, 0.90 at one error." in trains.render_equally(rows)


@pytest.mark.slow
def test_lines_of_stages_are_compared_at_one_error():
    (row,) = trains.equally_accurate(1, 0.11, report=lambda text: None, counts=(1,))
    assert 1e-5 < row["error"] < 5e-3
    assert row["tol"] > 0.999 * trains.USUAL
