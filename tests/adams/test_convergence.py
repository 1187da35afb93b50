"""Motions that depend on the ERROR asked for are remarked: a pendulum that stands on its head."""

from __future__ import annotations

import pytest

from gearmbs.adams import parse_deck, run_deck
from gearmbs.adams.results import remarks as convergence

DECK = """pendulum
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
PART/2, MASS=1, CM=20, IP=100,100,100, QG=0,{y},0
MARKER/20, PART=2
MARKER/21, PART=2, QP=0,{back},0
JOINT/1, REVOLUTE, I=21, J=10
SFORCE/1, ROTATION, I=21, J=10, ACTIONONLY, FUNCTION={torque}*SIN(3*TIME)
ACCGRAV/JGRAV=-9806.65
INTEGRATOR/GSTIFF, ERROR={error}
END
"""


def remarks(y, error, torque=1e-6, **options):
    """100 mm long; within 3 s what is small upright grows by exp(29)."""
    text = DECK.format(y=y, back=-y, error=error, torque=torque)
    result = run_deck(parse_deck(text), end=3.0, steps=300, **options)
    assert result.success
    return [m for m in result.messages if "a hundredth of ERROR" in m]


def test_a_motion_that_depends_on_the_error_is_remarked():
    found = remarks(100, 1e-2)
    assert len(found) == 1
    assert "PART/2" in found[0]
    assert "mm elsewhere" in found[0]


@pytest.mark.parametrize("error", [1e-4, 1e-8])
def test_one_that_hangs_and_swings_is_not(error):
    assert not remarks(-100, error, torque=500)


def test_one_that_only_turns_where_it_is_is_not():
    text = DECK.partition("UNITS")[0] + (
        "UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND\nPART/1, GROUND\nMARKER/1, PART=1\n"
        "PART/2, MASS=1, CM=2, IP=1,2,3, WX=1, WY=2\nMARKER/2, PART=2\nJOINT/1, SPHERICAL, I=2, J=1\nEND\n"
    )
    result = run_deck(parse_deck(text), end=1.0, steps=2, tol=1e-9, check=True)
    assert result.success
    assert not [m for m in result.messages if "a hundredth of ERROR" in m]


def test_it_can_be_left_away():
    assert not remarks(100, 1e-2, check=False)


def test_it_is_left_away_where_it_takes_long_and_is_not_asked_for(monkeypatch):
    monkeypatch.setattr(convergence, "CHEAP", 1000)
    assert not remarks(100, 1e-2)
    assert remarks(100, 1e-2, check=True)
