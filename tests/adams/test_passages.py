"""A slider crank whose crank is as long as its rod passes a position in which it can branch; others do not."""

from __future__ import annotations

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
