"""Sequences of equilibria that sensors watch: where they end."""

from __future__ import annotations

import numpy as np

from gearmbs.adams.builders.model import AdamsModel
from gearmbs.adams.builders.scopes import sensor_state
from gearmbs.adams.parse import statements as st
from gearmbs.adams.results.requests import RequestEvaluator
from gearmbs.adams.run.sensors import SAME, Watch, up_to
from gearmbs.dae.analyses.quasi_static import quasi_static
from gearmbs.dae.results.solution import Solution


def equilibria_to_passage(
    watch: Watch, model: AdamsModel, times: np.ndarray, solution: Solution, tol: float
) -> tuple[Solution, list[st.Sensor]]:
    """Return a sequence of equilibria that ends where sensors fire, and these; the given one if none does.

    Parameters
    ----------
    watch : Watch
    model : AdamsModel
    times : ndarray
        Of the sequence, s.
    solution : Solution
        The whole sequence.
    tol : float
        As in :func:`quasi_static`.
    """
    from scipy.optimize import brentq

    found = RequestEvaluator(model, solution)
    after = next((k for k in range(1, times.size) if watch.crossing(found, k)), None)
    if after is None:
        return solution, []
    low, high = float(times[after - 1]), float(times[after])

    def sequence(until: np.ndarray) -> Solution:
        return quasi_static(model.mechanism.compile(float(times[0])), until, tol=tol)

    def when(sensor: st.Sensor) -> float:
        def off(t: float) -> float:
            if t == low or t == high:
                return float(found.state(sensor_state(sensor.id))[after - (t == low)]) - sensor.value
            there = RequestEvaluator(model, sequence(np.array([low, t])))
            return float(there.state(sensor_state(sensor.id))[-1]) - sensor.value

        return float(brentq(off, low, high, xtol=SAME * (high - low)))

    passages = [(when(sensor), sensor) for sensor in watch.crossing(found, after)]
    end = min(time for time, _ in passages)
    fired = [sensor for time, sensor in passages if time - end <= SAME * (high - low)]
    return sequence(up_to(times, end)), fired
