"""The pulses of one meeting, repeated, have the harmonics of the motion, and are known as the formula says."""

import math
from fractions import Fraction

import numpy as np
import pytest

from benchmarks.instruments import Box
from benchmarks.long_records import Steady
from tests.signals.encoders.bench import coupled


@pytest.mark.slow
@pytest.mark.parametrize("gearing", [
    {"teeth": (7, 10)}, {"ratio": Fraction(9, 2), "mesh_order": Fraction(56, 3)},
])  # fmt: skip
def test_repeated_meetings_have_the_harmonics_of_the_motion(gearing):
    amplitudes, phases = np.array([2e-6, 5e-7]), (0.4, -1.0)
    teeth = gearing.get("teeth")
    mesh = float(teeth[0] if teeth else gearing["mesh_order"])
    ratio = teeth[1] / teeth[0] if teeth else float(gearing["ratio"])

    def lag(turned):
        cycle = math.tau * mesh * turned
        return sum(a * np.cos((k + 1) * cycle + p) for k, (a, p) in enumerate(zip(amplitudes, phases)))

    angles = coupled(lag, (1.0, ratio), 0.02, turns=12, rate=40e3)
    steady = Steady.of_box(Box("made", angles, 0.02, gearing, ratio, mesh))
    assert np.allclose(steady.exact(2), amplitudes, rtol=2e-3)
    assert np.allclose(steady.curve(np.arange(9) / 9), lag(np.arange(9) / 9 / mesh), atol=2e-3 * 2e-6)
    found = steady.measured(3.0, 1).harmonics()[:2]
    known = steady.encoders().uncertainty(3.0)
    assert np.all(np.abs(found["amplitude"] - steady.exact(2)) < 4 * known)
    assert np.mean(found["high"] - found["low"]) == pytest.approx(4 * known, rel=0.1)
