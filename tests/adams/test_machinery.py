"""Gear forces of ADAMS/Machinery as pairs: ratio, direction, play and mean force of a pair and a planetary set."""

from __future__ import annotations

import re

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.adams import DeckError, load_routines, parse_deck, parse_script, run_deck
from tests.says import says

HEAD = """wheels
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
"""
SUN, PLANET, RING = gm.GearSpec(20, "2 mm"), gm.GearSpec(20, "2 mm"), gm.GearSpec.ring(60, "2 mm", addendum="1.8 mm")
OUTER = gm.GearPair(gm.GearSpec(20, "2 mm"), gm.GearSpec(30, "2 mm"), backlash="0.1 mm")
MESHES = {
    "GFORCE/1": gm.GearPair(SUN, PLANET, backlash="0.1 mm"),
    "GFORCE/2": gm.GearPair(PLANET, RING, backlash="0.1 mm"),
}


def wheel(number: int, x: float, on: int = 1) -> str:
    """Return a wheel about z at x mm that turns in a part; its marker for gear forces is off the axis, at 5 mm."""
    n = 100 * number
    return (
        f"PART/{number}, MASS=1, CM={n}, IP=1E3,1E3,1E3, QG={x},0,0\nMARKER/{n}, PART={number}\n"
        f"MARKER/{n + 1}, PART={number}, QP=7,3,5\nMARKER/{n + 2}, PART={number}, FLOATING\n"
        f"MARKER/{n + 3}, PART={on}, QP={x},0,0\nJOINT/{number}, REVOLUTE, I={n}, J={n + 3}\n"
    )


def gears(number: int, i: int, j: int, name: str = "GFO_SPUR_mesh") -> str:
    """Return a gear force between two wheels."""
    call = "USER(91, 92, 93)"
    return (
        f"!            adams_view_name='{name}_{number}'\n"
        f"GFORCE/{number}, I={100 * i + 1}, JFLOAT={100 * j + 2}, RM=1, FUNCTION={call}\\ROUTINE=amachinery::gfosub\n"
    )


def torque(number: int, on: int, text: str) -> str:
    return f"SFORCE/{number}, ROTATIONAL, ACTIONONLY, I={100 * on}, J=1, FUNCTION={text}\n"


PAIR = HEAD + wheel(2, 0.0) + wheel(3, 50.0) + gears(1, 2, 3)
SPEEDS = "REQUEST/1, F2=WZ(200)\\F3=WZ(300)\\F4=AZ(300)\n"
SCRIPT = "m\no\nSIMULATE/DYNAMICS, END={end}, STEPS={steps}\n"


def run(text: str, routines, end: float, steps: int, **more):
    return run_deck(
        parse_deck(text + "END\n"), parse_script(SCRIPT.format(end=end, steps=steps)), routines=routines, **more
    )


@pytest.mark.slow
@pytest.mark.parametrize("torque_in", [40.0, -40.0])
def test_a_pair_turns_by_its_ratio_the_other_way_with_the_force_of_its_torque(torque_in):
    """Both flanks: -z1/z2 in the mean, and the mean force of the mesh is the load over the base radius."""
    load = -1.5 * torque_in
    drive = torque(5, 2, f"{1e3 * torque_in} - 200*WZ(200)") + torque(6, 3, f"{-1e3 * load}")
    result = run(PAIR + drive + SPEEDS, {"GFORCE/1": OUTER}, 0.1, 400)
    assert result.success
    asked = result.request(1)[200:]
    assert asked[:, 2].mean() / asked[:, 1].mean() == pytest.approx(-20.0 / 30.0, rel=2e-3)
    force = result.force("gforce", 1)[200:]
    across = np.hypot(force[:, 0], force[:, 1]).mean()
    assert across == pytest.approx(abs(load) / OUTER.driven.base_radius, rel=0.02)


@pytest.mark.slow
def test_the_play_of_a_pair_is_its_backlash():
    """The driven wheel is turned against a held driver, one way and the other; at the start it is in the middle."""
    held = "MOTION/1, JOINT=2, ROTATIONAL, FUNCTION=0\n"
    push = torque(6, 3, "1E2*(STEP(TIME,0,0,0.01,1) - 2*STEP(TIME,0.2,0,0.21,1)) - 200*WZ(300)")
    angle = run(PAIR + held + push + SPEEDS, {"GFORCE/1": OUTER}, 0.4, 40).request(1)[:, 3]
    play = OUTER.normal_backlash / OUTER.driven.base_radius
    assert angle[19] == pytest.approx(0.5 * play, rel=0.02), "the side to which it is pushed first"
    assert angle[-1] == pytest.approx(-0.5 * play, rel=0.02)


@pytest.mark.slow
def test_a_planetary_set_turns_by_its_ratio():
    """The ring is held by the ground, without a joint to turn in: Willis, and equal forces on sun and ring."""
    held = "PART/4, MASS=1, CM=400, IP=1E3,1E3,1E3\nMARKER/400, PART=4\nMARKER/402, PART=4, FLOATING\n"
    held += "JOINT/4, FIXED, I=400, J=1\n"
    text = (
        HEAD + wheel(2, 0.0) + wheel(5, 0.0) + wheel(3, 40.0, on=5) + held + gears(1, 2, 3) + gears(2, 3, 4, "GFO_int")
    )
    drive = torque(5, 2, "2E4 - 10*WZ(200)") + torque(6, 5, "-2000*WZ(500)")
    result = run(text + drive + "REQUEST/1, F2=WZ(200)\\F3=WZ(500)\n", MESHES, 0.1, 400)
    asked = result.request(1)[200:]
    assert asked[:, 2].mean() / asked[:, 1].mean() == pytest.approx(20.0 / (20.0 + 60.0), rel=3e-3)
    forces = [np.hypot(*result.force("gforce", n)[200:, :2].T).mean() for n in (1, 2)]
    torque_in = 20.0 - 0.01 * asked[:, 1].mean()
    # damping of the teeth takes 1 to 2 % of the power
    assert forces == pytest.approx([torque_in / MESHES["GFORCE/1"].driver.base_radius] * 2, rel=0.04)


def test_without_a_pair_the_message_says_what_to_give():
    with pytest.raises(DeckError, match=says("GFORCE/1", "Machinery", "GearPair")):
        run(PAIR, None, 0.1, 1)
    result = run(PAIR, None, 1e-3, 1, allow_unsupported=True)
    assert result.success
    assert any("GFORCE/1" in str(m) for m in result.messages)


def test_another_force_by_a_routine_is_not_taken_for_one():
    with pytest.raises(DeckError) as caught:
        run(PAIR.replace("GFO_SPUR_mesh_1", "mesh").replace("amachinery", "own"), None, 0.1, 1)
    assert "Machinery" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("QG=50.0,0,0", "QG=51.0,0,0", says("51", "50", "mm", "JOINT")),
        ("REVOLUTE", "SPHERICAL", says("PART/2", "PART/3", "JOINT")),
        ("MARKER/300, PART=3", "MARKER/300, PART=3, REULER=0,5D,0", says("5 deg", "parallel")),
        ("JFLOAT=302", "JFLOAT=2", says("GFORCE/1", "JFLOAT")),
    ],
)
def test_wheels_elsewhere_than_those_of_the_pair_are_refused(old, new, message):
    text = (
        PAIR.replace(old, new)
        + "POINT_MASS/9, MASS=1, CM=9\nMARKER/9, POINT_MASS=9\nMARKER/2, POINT_MASS=9, FLOATING\n"
    )
    with pytest.raises(DeckError, match=message):
        run(text, {"GFORCE/1": OUTER}, 0.1, 1)


@pytest.mark.parametrize("far", ["1E16", "1E27"])
def test_wheels_where_no_digits_are_left_for_teeth_are_refused(far):
    """Any number of teeth is near there by rounding: it was searched for without end."""
    deck = re.sub(r"(Q[GP])=(0\.0|50\.0),0,0", rf"\1=\2,0,{far}", PAIR)
    assert deck.count(far) == 4
    with pytest.raises(DeckError, match=says("GFORCE/1", "digits", "origin")):
        run(deck, {"GFORCE/1": OUTER}, 1e-4, 1)


def test_a_file_of_routines_may_define_pairs(tmp_path):
    path = tmp_path / "own.py"
    path.write_text(
        "import gearmbs as gm\nw = gm.GearSpec(20, '2 mm')\nGFORCE_1 = gm.GearPair(w, gm.GearSpec(30, '2 mm'))\n"
    )
    result = run(PAIR, load_routines(path), 1e-4, 1)
    assert result.success
    assert any("20 teeth on PART/2, 30 on PART/3" in str(m) for m in result.messages)
