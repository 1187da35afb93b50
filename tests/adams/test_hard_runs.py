"""Runs that need another accuracy or other steps than the usual ones, and what is said of them."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck
from tests.says import says

FAR = """a mass that is driven far away
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1, REULER=90D,90D,0
PART/2, MASS=2, CM=20, IP=1000,1000,1000
MARKER/20, PART=2
SFORCE/1, TRANSLATIONAL, I=20, J=1, ACTIONONLY, FUNCTION=20
REQUEST/1, F2=DX(20)
{}
END
"""


def run(deck, *commands, **more):
    return run_deck(parse_deck(deck), parse_script("\n".join(("a", "b", *commands)) + "\n"), **more)


def test_a_mass_is_driven_as_far_as_its_digits_reach():
    """5 mm/s^2 t^2 over 100 s are 50 km, of which the usual error is less than the last digit."""
    result = run(FAR.format(""), "SIMULATE/DYNAMICS, END=100, STEPS=4")
    times = np.array([0, 25, 50, 75, 100])
    assert result.success
    assert np.allclose(result.request(1)[:, 1], 5000 * times**2, rtol=1e-12, atol=1e-6)
    (message,) = [str(one) for one in result.messages]
    assert "ERROR = 1e-06" in message


def test_an_error_that_is_asked_for_is_kept():
    result = run(FAR.format("INTEGRATOR/ERROR=1E-8"), "SIMULATE/DYNAMICS, END=100, STEPS=4")
    assert not result.success
    assert not run(FAR.format(""), "SIMULATE/DYNAMICS, END=100, STEPS=4", tol=1e-8).success
    near = run(FAR.format(""), "SIMULATE/DYNAMICS, END=1, STEPS=4")
    assert near.success
    assert not near.messages


BALL = """a ball at rest on what bears it
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
MARKER/3, PART=1, QP=-50,-50,-1
PART/2, MASS=2, CM=20, IP=0.008,0.008,0.008, QG=0,0,{height}
MARKER/20, PART=2
GRAPHICS/1, ELLIPSOID, CM=20, XSCALE=0.2, YSCALE=0.2, ZSCALE=0.2
GRAPHICS/2, {ground}
ACCGRAV/KGRAV={gravity}
CONTACT/1, IGEOM=1, JGEOM=2, IMPACT, STIFFNESS=1E6, EXPONENT={exponent}, DAMPING=100, DMAX=1E-4
REQUEST/1, F2=DZ(20)
END
"""


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
@pytest.mark.parametrize("ground", ["PLANE, RM=1", "BOX, CORNER=3, X=100, Y=100, Z=1"])
@pytest.mark.parametrize("height", [0.1, 0.1000000001, 0.11, 0.09999])
def test_a_ball_that_touches_or_is_near_sinks_in_until_it_is_borne(height, ground, exponent):
    result = run(BALL.format(height=height, ground=ground, gravity=-10, exponent=exponent), "SIMULATE/STATICS")
    depth = 0.1 - result.request(1)[-1, 1]
    assert np.isclose(depth, (20.0 / 1e6) ** (1.0 / exponent), rtol=1e-8)


@pytest.mark.slow
def test_a_ball_that_nothing_bears_has_no_equilibrium():
    box = "BOX, CORNER=3, X=100, Y=100, Z=1"
    with pytest.raises(DeckError, match=says("PART_2", "free to move")):
        run(BALL.format(height=0.2, ground=box, gravity=10, exponent=1.5), "SIMULATE/STATICS")


@pytest.mark.parametrize(
    ("plants", "words"),
    [
        ("", ("PINPUT", "add")),
        ("VARIABLE/1, FUNCTION=0\nPINPUT/1, VARIABLES=1", ("POUTPUT", "add")),
        ("VARIABLE/1, FUNCTION=0\nPINPUT/1, VARIABLES=1\nPINPUT/2, VARIABLES=1", ("PINPUT", "several")),
    ],
)
def test_a_linear_plant_without_inputs_is_refused_before_anything_is_run(plants, words):
    with pytest.raises(DeckError, match=says("STATEMAT", *words)) as caught:
        run(FAR.format(plants), "SIMULATE/DYNAMICS, END=1, STEPS=1", "LINEAR/STATEMAT, FILE=zz")
    assert not caught.value.result.segments
    whole = "VARIABLE/1, FUNCTION=0\nPINPUT/1, VARIABLES=1\nVARIABLE/2, FUNCTION=DX(20)\nPOUTPUT/1, VARIABLES=2"
    assert run(FAR.format(whole), "SIMULATE/DYNAMICS, END=1, STEPS=1", "LINEAR/STATEMAT").plants


def test_a_word_that_a_statement_does_not_know_is_named():
    with pytest.raises(DeckError, match=says("VARIABLE/2", "IC", "IMPLICIT")):
        parse_deck(FAR.format("VARIABLE/2, IC=2, IMPLICIT, FUNCTION=1"))
    with pytest.raises(DeckError, match=says("VARIABLE/2", "IC", "2")):
        parse_deck(FAR.format("VARIABLE/2, IC=2, 3, FUNCTION=1"))
    parse_deck(FAR.format("DIFF/2, IC=2, IMPLICIT, FUNCTION=DIF1(2)"))
