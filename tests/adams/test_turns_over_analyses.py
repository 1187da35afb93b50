"""Full turns of angles over several analyses: what is counted must not hang on couplers, sensors and requests."""

import numpy as np
import pytest

from gearmbs.adams import parse_deck, parse_script, run_deck

HEAD = """t
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
PART/2, MASS=2, CM=20, IP=1,1,1, WZ=10
MARKER/20, PART=2
MARKER/10, PART=1
JOINT/1, REVOLUTE, I=20, J=10
"""
SECOND = """PART/3, MASS=2, CM=30, IP=1,1,1, QG=1,0,0, WZ=-10
MARKER/30, PART=3
MARKER/13, PART=1, QP=1,0,0
JOINT/2, REVOLUTE, I=30, J=13
SFORCE/5, ROTATIONAL, I=30, J=13, FUNCTION=-0.5*AZ(30,13)
REQUEST/1, F2=AZ(20,10)\\F3=WZ(20)
"""
COUPLER = "COUPLER/1, JOINTS=1,2, SCALES=1,1\n"
SIMULATE = "SIMULATE/DYNAMICS, END=%d, STEPS=40\n"
PRINTS = "SENSOR/1, FUNCTION=TIME, GE, VALUE=1, PRINT\nSENSOR/2, FUNCTION=TIME, GE, VALUE=2, PRINT\n"


def ran(deck, script):
    found = run_deck(parse_deck(deck + "END\n"), parse_script("a\nb\n" + script))
    assert found.success
    return found


@pytest.mark.parametrize(
    ("extra", "script"),
    [("", SIMULATE % 3), ("", SIMULATE % 1 + SIMULATE % 2 + SIMULATE % 3), (PRINTS, SIMULATE % 3)],
    ids=["one command", "three commands", "sensors that print"],
)
def test_coupled_shafts_keep_their_turns(extra, script):
    """Two shafts of J = 1, coupled one to one, with a torsion spring: 2 AZ'' = -AZ/2, so that AZ = 20 sin(t/2)."""
    found = ran(HEAD + SECOND + COUPLER + extra, script)
    t, rows = np.asarray(found.t), found.request(1)
    assert np.abs(rows[:, 1] - 20.0 * np.sin(0.5 * t)).max() < 1e-4
    assert np.abs(rows[:, 2] - 10.0 * np.cos(0.5 * t)).max() < 1e-4


SPRING = "SPRINGDAMPER/1, ROTATION, I=20, J=10, KT=0.25\n"
LATER = f"DEACTIVATE/SPRINGDAMPER, ID=1\n{SIMULATE % 2}ACTIVATE/SPRINGDAMPER, ID=1\n{SIMULATE % 3}"
TORQUE = "SFORCE/1, ROTATIONAL, I=20, J=10, FUNCTION=0\n"
CHANGED = f"{SIMULATE % 2}SFORCE/1, FUNCTION=-0.25*AZ(20,10)\n{SIMULATE % 3}"


@pytest.mark.parametrize("asked", ["", "\\F3=AZ(20,10)"], ids=["not asked for", "asked for"])
@pytest.mark.parametrize(
    ("element", "script"), [(SPRING, LATER), (TORQUE, CHANGED)], ids=["spring switched on", "function changed"]
)
def test_a_request_does_not_change_the_motion(element, script, asked):
    """A free rotor turns by 20 rad; then a torsion spring acts, 0.25 per rad on J = 1."""
    found = ran(f"{HEAD}{element}REQUEST/1, F2=WZ(20){asked}\n", script)
    assert found.request(1)[-1, 1] == pytest.approx(10.0 * (np.cos(0.5) - np.sin(0.5)), abs=1e-4)


def test_a_screw_counts_from_its_displacement_as_before():
    """Two analyses of a screw with a spring about its axis, as one."""
    deck = HEAD.replace("JOINT/1, REVOLUTE, I=20, J=10", "JOINT/1, SCREW, I=20, J=10, PITCH=0.1") + (
        "JOINT/9, CYLINDRICAL, I=20, J=10\nSFORCE/5, ROTATIONAL, I=20, J=10, FUNCTION=-0.25*AZ(20,10)\n"
        "REQUEST/1, F2=AZ(20,10)\\F3=DZ(20,10)\n"
    )
    one, two = ran(deck, SIMULATE % 3), ran(deck, SIMULATE % 2 + SIMULATE % 3)
    assert two.request(1)[-1, 1] == pytest.approx(one.request(1)[-1, 1], abs=1e-4)
    assert one.request(1)[-1, 2] == pytest.approx(0.1 / (2.0 * np.pi) * one.request(1)[-1, 1], rel=1e-6)
