"""Reading decks: what is read, and messages with the line of what is wrong."""

from __future__ import annotations

import math
import re

import pytest

from gearmbs.adams import DeckError, parse_deck
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import FORCE, LENGTH, MASS, deck_units
from gearmbs.adams.parse.grammar import CONTINUED, joined_expression
from tests.says import says

from .decks import EVERYTHING, PENDULUM

HEAD = "t\nUNITS/SYSTEM=MKS\nPART/1,GROUND\nPART/2,MASS=1,CM=20,IP=1,1,1\nMARKER/10,PART=1\nMARKER/20,PART=2\n"


def test_pendulum():
    deck = parse_deck(PENDULUM)
    assert deck.title == "A pendulum, its pivot along y"
    assert deck.of(st.Part)[2].ip == (0.04, 0.1, 0.1)
    marker = deck.of(st.Marker)[102]
    assert marker.reuler == pytest.approx((math.pi, math.pi / 2, math.pi))
    assert (marker.name, marker.line) == ("pivot on ground", 7)
    joint = deck.of(st.Joint)[1]
    assert (joint.type, joint.i, joint.j, joint.name) == ("REVOLUTE", 102, 202, "pin")
    assert deck.only(st.Accgrav).kgrav == -9.80665
    request = deck.of(st.Request)[5]
    assert request.f4 == "JOINT(1,0,4,0)"
    assert request.f8 == "JOINT(1,0,8,0)"
    assert request.comment == "Reaction"
    assert deck.of(st.Request)[1].comment == "DISPLACEMENT: X Y Z"
    assert not deck.diagnostics


def test_everything_is_read():
    deck = parse_deck(EVERYTHING)
    assert {st.KEYWORD_OF[kind] for kind in deck.items} == set(st.STATEMENTS)
    assert deck.of(st.Joint)[1].ic == pytest.approx((math.radians(10), 3))
    assert deck.of(st.Coupler)[1].type == ("ROTATIONAL", "TRANSLATIONAL")
    assert deck.of(st.Motion)[1].function == "STEP(TIME, 0, 0, 0.1, 360D*TIME)"
    assert deck.of(st.Sforce)[1].function == "-5*(DM(20,30) - 100) - 0.1*VR(20,30) + IF(TIME-1:0,0,2)"
    assert deck.of(st.Vtorque)[1].ty == "SIN(TIME)"
    assert deck.of(st.Gforce)[1].tz == "6"
    assert len(deck.of(st.Field)[1].kmatrix) == 36
    assert deck.of(st.Spline)[2].y == ((10, 0, 1, 4, 9), (20, 0, 2, 8, 18))
    assert deck.of(st.Request)[1].title == tuple("abcdefgh")
    assert deck.of(st.Request)[2].cnames == ("", "angle", "force")
    assert deck.only(st.Integrator).method == "WSTIFF"
    assert deck.units.length == 1e-3
    kinds = [(d.severity, d.message.split()[0]) for d in deck.diagnostics]
    assert ("unsupported", "TIRE/1") in kinds
    assert sum(severity == "ignored" for severity, _ in kinds) == 2


@pytest.mark.parametrize(
    ("lines", "line", "message"),
    [
        ("JOINT/1, REVOLUTE, I = 10, J = 99", 7, "there is no MARKER/99 for J"),
        ("JOINT/1, REVOLUTE\n, I = 10\n, J = 99", 9, "there is no MARKER/99 for J"),
        ("JOINT/1, REVOLUT, I = 10, J = 20\nMARKER/20,PART=2", 8, "stands first in line 6"),
        ("JOINT/1, S, I = 10, J = 20", 7, "S is ambiguous: it could be SCREW, SPHERICAL"),
        ("JOINT/1, I = 10, J = 20", 7, "its type \\(CONVEL, .* is missing"),
        ("JOINT/1, REV, SPH, I = 10, J = 20", 7, "both REVOLUTE and SPHERICAL"),
        ("JOINT/1, REV, I = 10, J = 10", 7, "I and J are both on PART/1"),
        (
            "CONTACT/1, IGEOM=1, JGEOM=2, IMPACT, STIFFNESS=1e5, DMAX=1, COULOMB_FRICTION, MU_STATIC=0.3",
            7,
            "COULOMB_FRICTION needs a value",
        ),
        ("JOINT/1, REV, I = 1.5, J = 10", 7, "I: '1.5' is not an integer"),
        ("JOINT, REV, I = 10, J = 20", 7, "JOINT needs a slash"),
        ("JOINT/, REV, I = 10, J = 20", 7, "an id is missing"),
        ("JOINT/1, SCREW, I = 10, J = 20", 7, "needs PITCH"),
        ("JIONT/1, REV, I = 10, J = 20", 7, "unknown statement 'JIONT'; did you mean JOINT\\?"),
        ("MARKER/30, PART = 2, QP = 1, 2", 7, "QP: 3 values are expected, got 2"),
        ("MARKER/30, PART = 2, QP = 1, x, 3", 7, "QP: 'x' is not a number"),
        ("MARKER/30, PART = 7", 7, "there is no PART/7"),
        ("MARKER/30, PRT = 7", 7, "unknown argument PRT"),
        ("MARKER/30", 7, "PART is missing"),
        ("MARKER/30, PART = 2, PART = 2", 7, "PART is given twice"),
        ("PART/3, GROUND", 7, "PART/1 is the GROUND already"),
        ("PART/3, MASS = 1", 7, "CM is missing"),
        ("PART/3, MASS = -1, CM = 20", 7, "it cannot be negative"),
        ("PART/3, MASS = 1, CM = 10", 7, "MARKER/10 is on PART/1"),
        ("SFORCE/1, TRANS, I=10, J=20, FUNCTION = 3*(DM(10,20)", 7, "expected '\\)' to close the bracket"),
        ("SFORCE/1, TRANS, I=10, J=20\n, FUNCTION = 3*STP(1)+", 8, "found the end at column"),
        ("UNITS/SYSTEM=CGS", 7, "UNITS is given twice"),
        ("ACCGRAV/1, KGRAV = 1", 7, "ACCGRAV has no id"),
        ("SPLINE/1, X = 0, 1, 2, 3, Y = 1, 2, 3, 4, 5, 6", 7, "its z value and 4 y values"),
        ("SPLINE/1, X = 0, 1, 1, 3, Y = 1, 2, 3, 4", 7, "x values must increase"),
        ("REQUEST/1, COMMENT = nothing", 7, "F1 to F8"),
        ("COUPLER/1, JOINTS = 1, 2, SCALES = 1, 2, 3", 7, "there is no JOINT/1"),
        ("MOTION/1, ROTATION, FUNCTION = TIME", 7, "give JOINT, or I, J"),
        ("INTEGRATOR/ERROR", 7, "ERROR is ambiguous|ERROR needs a value"),
        ("MARKER/30,PART=1,FLOATING\nVARIABLE/1, FUNCTION = VX(20,30)", 8, "MARKER/30 is FLOATING"),
        ("stray words", 7, "unknown statement 'STRAY'"),
        ("123", 7, "expected a statement"),
    ],
)
def test_errors_name_the_line(lines, line, message):
    with pytest.raises(DeckError) as caught:
        parse_deck(HEAD + lines + "\nEND\n", "model.adm")
    shown = str(caught.value)
    assert re.search(message, shown)
    assert f"model.adm:{line}: error:" in shown


def test_all_errors_are_reported_at_once():
    with pytest.raises(DeckError) as caught:
        parse_deck(HEAD + "JOINT/1, S\nMARKER/31, PRT=1\nFOO/2\nEND")
    assert [d.line for d in caught.value.diagnostics] == [7, 8, 9]


def test_missing_end_title_and_units_are_remarked():
    deck = parse_deck("PART/1,GROUND\n")
    messages = " ".join(str(d) for d in deck.diagnostics)
    assert "END is missing" in messages
    assert "the first line is the deck's title" in messages
    assert "UNITS is missing" in messages


def test_text_after_end_is_not_read():
    assert not parse_deck(HEAD + "END\nthis is : not / a deck ((").diagnostics


def test_line_ends_ampersands_semicolons_and_case():
    text = HEAD.replace("\n", "\r\n") + "joint/1, rev, & \r\n i = 10, j = 20; accgrav/kgrav=-1\r\nend\r\n"
    deck = parse_deck(text)
    assert deck.of(st.Joint)[1].type == "REVOLUTE"
    assert deck.only(st.Accgrav).kgrav == -1


@pytest.mark.parametrize(
    ("parts", "joined"),
    [
        (["2*(DX(1,2) +", " DX(2,3))"], "2*(DX(1,2) + DX(2,3))"),
        (["STEP(TIME, 0, 0", " 1, 2)"], "STEP(TIME, 0, 0, 1, 2)"),
        (["STEP(TIME, 0, 0,", " 1, 2)"], "STEP(TIME, 0, 0, 1, 2)"),
        (["3", " - 2"], "3 - 2"),
        (["3", " + 2", " * 4"], "3 + 2 * 4"),
    ],
)
def test_continued_expressions(parts, joined):
    assert joined_expression(CONTINUED.join(parts)) == joined


def test_units():
    # SLINCH = lbf s^2/in = 175.1268... kg; 1 slug = 14.593903 kg (NIST SP 811)
    assert MASS["SLINCH"] == pytest.approx(175.126836, rel=1e-8)
    assert MASS["SLUG"] == pytest.approx(14.593903, rel=1e-7)
    assert FORCE["POUND_FORCE"] == pytest.approx(4.4482216152605, rel=1e-14)
    assert LENGTH["MILE"] == pytest.approx(5280 * 0.3048)
    si = deck_units(st.Units(system="IPS"))
    assert (si.length, si.mass) == (0.0254, 0.45359237)
    # with only a factor, kg-m-s numbers: force x 1000 = mass x acceleration, so a unit of force is 1000 N
    assert deck_units(st.Units(ucf=1000.0)).force == 1000.0
    mm = deck_units(st.Units(force="NEWTON", mass="KILOGRAM", length="MILLIMETER", time="SECOND"))
    assert mm.factor("inertia") == pytest.approx(1e-6)
    assert mm.factor("stiffness") == pytest.approx(1e3)
    for bad, word in (
        (st.Units(force="NEWTON"), says("MASS", "LENGTH", "TIME", "missing")),
        (st.Units(force="X", mass="KILO", length="METER", time="SEC"), says("FORCE", "X", "choose", "NEWTON")),
        (st.Units(ucf=0), says("UCF", "0", "positive")),
    ):
        with pytest.raises(ValueError, match=word):
            deck_units(bad)
