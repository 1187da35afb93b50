"""A slider crank whose crank is as long as its rod passes a position in which it can branch; others do not."""

from __future__ import annotations

import math

import pytest

from gearmbs.adams import parse_deck, run_deck

DECK = """crank
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
MARKER/11, PART=1, REULER=90D,90D,0D
PART/2, MASS=1, CM=20, IP=0.1,0.1,0.1, QG={x},{y},0
MARKER/20, PART=2
MARKER/21, PART=2, QP=-{x},-{y},0
PART/3, MASS=1, CM=30, IP=0.1,0.1,0.1, QG={end},0,0
MARKER/30, PART=3
MARKER/31, PART=3, REULER=90D,90D,0D
JOINT/1, REVOLUTE, I=21, J=10
JOINT/2, TRANSLATIONAL, I=31, J=11
GCON/1, FUNCTION=DM(20,30) - {rod}
MOTION/1, JOINT=2, TRANSLATION, FUNCTION={start} - {stroke}*TIME
END
"""


def remarks(stroke):
    """A crank of 1 m at 36.87 degrees and a rod of 1 m; the slider is drawn in, to where one lies on the other."""
    text = DECK.format(x=0.8, y=0.6, end=1.6, rod=1.0, start=1.6, stroke=stroke)
    result = run_deck(parse_deck(text), end=1.0, steps=50, tol=1e-4)
    return [m for m in result.messages if "locks or can branch" in m]


@pytest.mark.parametrize(("stroke", "passes"), [(1.0, False), (1.599, True)])
def test_a_passage_is_remarked(stroke, passes):
    assert bool(remarks(stroke)) == passes


PARALLELOGRAM = """two arms of 1 m, hinged to the ground and to a rod that stays level
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
MARKER/2, PART=1, QP=2,0,0
PART/2, MASS=1, CM=20, IP=0.1,0.1,0.1, QG=0,0.5,0
MARKER/20, PART=2
MARKER/21, PART=2, QP=0,-0.5,0
MARKER/22, PART=2, QP=0,0.5,0
PART/3, MASS=1, CM=30, IP=0.1,0.1,0.1, QG=2,0.5,0
MARKER/30, PART=3
MARKER/31, PART=3, QP=0,-0.5,0
MARKER/32, PART=3, QP=0,0.5,0
PART/4, MASS=1, CM=40, IP=0.1,0.1,0.1, QG=1,1,0
MARKER/40, PART=4
MARKER/41, PART=4, QP=-1,0,0
MARKER/42, PART=4, QP=1,0,0
JOINT/1, REVOLUTE, I=21, J=1
JOINT/2, REVOLUTE, I=31, J=2
JOINT/3, REVOLUTE, I=22, J=41
JOINT/4, REVOLUTE, I=32, J=42
SFORCE/1, ROTATIONAL, I=21, J=1, FUNCTION=-3
INTEGRATOR/ERROR=1E-3
END
"""


@pytest.mark.parametrize(("end", "steps", "passes"), [(1.2, 12, False), (2.0, 20, True), (2.0, 133, True)])
def test_a_passage_between_two_outputs_is_remarked_with_its_time(end, steps, passes):
    result = run_deck(parse_deck(PARALLELOGRAM), end=end, steps=steps)
    found = [segment.passage for segment in result.segments if segment.passage]
    assert bool(found) == passes
    if passes:
        # a moment of 3 N m turns 2 (1/4 + 0.1) + 1 = 1.7 kg m2 by a quarter of a turn
        assert found[0][0] == pytest.approx((math.pi * 1.7 / 3.0) ** 0.5, abs=5e-3)
