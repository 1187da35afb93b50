"""The cost of drivetrains: what its table says."""

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
