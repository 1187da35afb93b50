"""Bores and couplings from definitions, against complex steps of the same laws along variations of two frames."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.bearings import derived as B
from gearmbs.bearings.clearance import ClearanceForce
from gearmbs.dae.problem import ModelError
from gearmbs.drivetrain.couplings import derived as C
from gearmbs.drivetrain.couplings import even_twist as coupling
from gearmbs.mechanism import Mechanism
from tests.mechanism.test_spring_definitions import STEP, frames, varied
from tests.says import says

BORE = np.array([0.4, 1e4, 1.4, 30.0, 0.5])
"""A clearance that the frames at random exceed, and a depth of full damping near theirs."""
COUPLING = np.array([40.0, 3.0, 7.0, 0.5])


def loads(name, pair, numbers):
    """Return the load of complex frames by the formulas as they are written."""
    wrench = np.zeros((1, 6), dtype=complex)
    if name == "bore":
        B.bore_load.py_func(*pair, numbers, wrench)
    else:
        (a, b), (c, d) = ((row[3:12:3], row[4:12:3]) for row in pair)
        # atan2(s, c) of a positive c, as a function of complex numbers
        twist = np.arctan((a @ d - b @ c) / (a @ c + b @ d))
        C.even_load.py_func(*pair, numbers, twist, wrench)
    return wrench[0]


def cases():
    """Return states in which the bore presses, beyond the depth of full damping too, and the coupling is bent."""
    for seed in (3, 4, 7):
        pair = frames(seed)
        for deep in (0.5, 20.0):
            yield "bore", pair, np.array([*BORE[:4], deep])
        near = frames(seed)
        turn = np.linalg.qr(near[0][3:12].real.reshape(3, 3) + 4.0 * near[1][3:12].real.reshape(3, 3))[0]
        near[0][3:12] = (turn * np.sign(np.diag(turn.T @ near[1][3:12].real.reshape(3, 3)))).ravel()
        yield "even", near, COUPLING


def element(name):
    m = Mechanism("held")
    i, j = m.body("b", mass=1.0, inertia=(1, 1, 1)).marker(), m.ground.marker()
    if name == "bore":
        return ClearanceForce("bore", i, j, tuple(BORE))
    return coupling.EvenTwist("coupling", i, j, COUPLING)


@pytest.mark.parametrize(("name", "pair", "numbers"), list(cases()))
def test_derivatives_by_complex_steps(name, pair, numbers):
    real, slopes = [frame.real.copy() for frame in pair], np.zeros((6, 24))
    if name == "bore":
        assert B.bore_depth(*real, numbers) > 0.0
        B.bore_slopes(*real, numbers, slopes)
    else:
        C.even_slopes(*real, numbers, C.twist(*real), slopes)
    exact = np.array([loads(name, varied(pair, column), numbers).imag / STEP for column in range(24)]).T
    assert np.abs(exact).max() > 1.0
    assert slopes == pytest.approx(exact, rel=1e-10, abs=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("name", ["bore", "even"])
def test_loads_by_their_numbers(name):
    made = element(name)
    names = {"clearance": 0, "stiffness": 1, "damping": 3} if name == "bore" else dict(zip(coupling.NUMBERS, range(4)))
    for kind, pair, numbers in cases():
        if kind != name or (name == "bore" and numbers[4] != BORE[4]):
            continue
        rows = np.array([frame.real for frame in pair])
        for number, at in names.items():
            moved = numbers.astype(complex)
            moved[at] += 1j * STEP
            exact = loads(name, pair, moved).imag / STEP
            assert made.by_parameter(number, rows) == pytest.approx(exact, rel=1e-10, abs=1e-12)
    with pytest.raises(ModelError, match=says("mass", *names)):
        made.by_parameter("mass", rows)
    with pytest.raises(ModelError, match=says("shapes", "(2, 18)")):
        made.by_parameter("stiffness", rows[:1])
