"""Messages that lead to the mistake: mistyped words, what is absent, defaults that matter."""

import re

import pytest

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck
from gearmbs.adams.results.remarks import Assembly
from gearmbs.adams.support import REFUSED, function_rows
from tests.says import says

PENDULUM = """a pendulum
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH={length}, TIME=SECOND
PART/1, GROUND
MARKER/11, PART=1, REULER=0D,90D,0D
PART/2, MASS=1, CM=22, IP=0.1,0.1,0.1, QG=0.5,0,0
MARKER/21, PART=2, QP=-0.5,0,0, REULER=0D,90D,0D
MARKER/22, PART=2
JOINT/1, REVOLUTE, I=21, J=11
{lines}
END
"""


def deck(lines, length="METER"):
    return parse_deck(PENDULUM.format(lines=lines, length=length))


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        (
            "SENSOR/1, FUNCTION=TIME, GE, VALUE=1, HALTT",
            says("SENSOR/1", "HALTT", "HALT"),
        ),
        ("MATRIX/1, FULL, ROWS=1, COLUMNS=1, VALUES=1", "FULL needs a value: FULL = RORDER or CORDER"),
        ("REQUEST/1, F2=SENVAL(1)", says("REQUEST/1", "F2", "SENSOR/1", "SENVAL")),
        ("REQUEST/1, F2=CURVE(0,0,1,7)", says("REQUEST/1", "F2", "CURVE/7")),
    ],
)
def test_what_is_mistyped_or_absent_is_named(lines, told):
    with pytest.raises(DeckError, match=told):
        run_deck(deck(lines), end=0.1)


@pytest.mark.parametrize("line", ["UNITS/FORCE=NEWTON", "GRAPHICS/1, BOX"])
def test_statements_of_the_deck_are_told_to_stand_there(line):
    with pytest.raises(DeckError, match=says(line.split("/")[0], "deck")):
        parse_script(f"a\nb\n{line}\n")


@pytest.mark.parametrize(
    ("length", "more", "remarked"),
    [("METER", "", True), ("METER", ", MAX_STICTION_DEFORMATION=1E-5", False), ("MILLIMETER", "", False)],
)
def test_a_default_that_lets_joints_yield_is_remarked(length, more, remarked):
    friction = f"FRICTION/1, JOINT=1, MU_STATIC=0.9, MU_DYNAMIC=0.9, PIN_RADIUS=0.6{more}"
    told = [d.message for d in deck(friction, length).diagnostics]
    assert any("0.01 units of length, here 10 mm" in message for message in told) is remarked


@pytest.mark.parametrize(
    ("part", "told"),
    [
        ("MASS=1, CM=22, IP=0.1,0.2,0.9", r"PART/2: .*moments \[0.1 0.2 0.9\] kg m\^2; the largest exceeds the sum"),
        ("MASS=1, CM=22, IP=0.1,0.2,0.3", None),
    ],
)
def test_inertia_that_no_body_has_is_remarked(part, told):
    """A flat body is the limit: its largest moment is the sum of the others."""
    read = parse_deck(PENDULUM.format(lines="", length="METER").replace("MASS=1, CM=22, IP=0.1,0.1,0.1", part))
    remarks = [str(d) for d in read.diagnostics]
    read.to_mechanism()
    later = [str(d) for d in read.diagnostics if str(d) not in remarks]
    assert len(later) == (told is not None)
    assert told is None or re.search(f":5: warning: {told}", later[0])


@pytest.mark.parametrize(
    ("part", "told"),
    [
        ("MASS=-1, CM=22, IP=0.1,0.1,0.1", says("PART/2", "MASS = -1.0")),
        (
            "MASS=1, CM=22, IP=0.1,-0.1,0.1",
            says("PART/2", "-0.1"),
        ),
        ("MASS=1, CM=22, IP=0.1,0.1,0.1,0.5", says("PART/2", "correct the moments")),
        ("MASS=1, CM=22, IM=21, IP=0.1,0.1,0.1", says("PART/2", "point")),
    ],
)
def test_inertia_that_nothing_has_is_refused(part, told):
    """Negative mass or moments, products too large, moments about a point that leave too little at the centre."""
    with pytest.raises(DeckError, match=told):
        parse_deck(
            PENDULUM.format(lines="", length="METER").replace("MASS=1, CM=22, IP=0.1,0.1,0.1", part)
        ).to_mechanism()


def test_rounding_is_no_rotation():
    moved = Assembly(distance=100.0, angle=1.6e-16, farthest="PART/2", most_turned="PART/3", far=True)
    assert moved.remark(0.0, "mm").endswith("were moved: PART/2 by 100 mm")


def test_the_table_tells_functions_that_decks_read():
    refused = {name for name, how, _ in function_rows() if how == REFUSED}
    assert not refused & {"MODE", "SENVAL", "CURVE", "USER"}
    assert "DELAY" in refused
