"""COUPLER of a cylindrical joint's translation against the equations of motion of its few coordinates."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import parse_deck, parse_script, run_deck

DECK = """coupled
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1, GROUND
MARKER/11, PART=1
MARKER/12, PART=1, QP=500,0,0, REULER=0,90D,0
MARKER/13, PART=1, QP=0,700,0
PART/2, MASS=2, CM=20, IP=1E5,1E5,6E5, QG=0,0,30
MARKER/20, PART=2
JOINT/1, CYLINDRICAL, I=20, J=11
PART/3, MASS=1, CM=30, IP=1E5,1E5,5E5, QG=500,0,0, REULER=0,90D,0
MARKER/30, PART=3
JOINT/2, REVOLUTE, I=30, J=12
PART/4, MASS=1, CM=40, IP=1E5,1E5,1E5, QG=0,700,0
MARKER/40, PART=4
JOINT/3, TRANSLATIONAL, I=40, J=13
SFORCE/1, ROTATIONAL, I=20, J=11, ACTIONONLY, FUNCTION=300
ACCGRAV/KGRAV=-10000
REQUEST/1, F2=DZ(20,11,11)\\F3=AZ(30,12)\\F4=DZ(40,13,13)\\F6=AZ(20,11)
COUPLER/1, {coupler}
END
"""
MASSES, LOADS = np.array([2.0, 0.5, 1.0]), np.array([-20.0, 0.0, -10.0])
"""Of z of part 2, the angle of part 3, z of part 4; SI."""


@pytest.mark.parametrize(
    "script", ["SIM/DYN, END=1, STEPS=20\n", "SIM/DYN, END=0.45, STEPS=9\nSIM/DYN, END=1, STEPS=11\n"]
)
@pytest.mark.parametrize(
    ("coupler", "row"),
    [
        ("JOINTS=1,2, TYPE=T:R, SCALES=1,-250", [1.0, -0.25, 0.0]),
        ("JOINTS=2,1, TYPE=R:T, SCALES=-4E-3", [1.0, -250.0e-3, 0.0]),
        ("JOINTS=1,2,3, TYPE=T:R:T, SCALES=1,-250,2", [1.0, -0.25, 2.0]),
    ],
)
def test_the_translation_of_a_cylindrical_joint(script, coupler, row):
    result = run_deck(parse_deck(DECK.format(coupler=coupler)), parse_script("m\no\n" + script), tol=1e-9)
    assert result.success
    rows, t = result.request(1), result.t
    row = np.array(row)
    multiplier = (row / MASSES) @ LOADS / ((row / MASSES) @ row)
    rates = (LOADS - multiplier * row) / MASSES
    expected = 0.5 * rates[:, None] * t**2 * np.array([1e3, 1.0, 1e3])[:, None]
    np.testing.assert_allclose(rows[:, 1] - 30.0, expected[0], atol=1e-4)
    np.testing.assert_allclose(rows[:, 2], expected[1], atol=1e-7)
    np.testing.assert_allclose(rows[:, 3], expected[2], atol=1e-4)
    # it turns freely: 0.3 N m on 0.6 kg m^2
    np.testing.assert_allclose(rows[:, 5], 0.25 * t**2, atol=1e-7)
