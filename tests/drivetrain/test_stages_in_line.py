"""Many stages in line: they run, and the cost grows about as their number."""

import time

import numpy as np
import pytest

from benchmarks.trains import stages_in_line


def test_ten_stages_run():
    train = stages_in_line(10)
    assert train.speeds["s10"] == pytest.approx(1000 * np.pi / 30)
    solution = train.build().simulate(0.01, rate=1000, tol=1e-6, rate_scale=train.rate_scale)
    assert solution.success
    for k in range(10):
        assert solution.contact(f"m{k}")["pairs_drive"][-1] > 0


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
