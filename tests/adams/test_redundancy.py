"""Redundant rows: those that ADAMS is known to remove, the same motion whatever goes, and the words for them."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import parse_deck, run_deck
from gearmbs.adams.results.result import message_text
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism
from tests.says import says

HEAD = """door
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
PART/2, MASS=3, CM=20, IP=0.1,0.2,0.3, QG=0.3,0,0
MARKER/20, PART=2
ACCGRAV/KGRAV=-9.81
"""
DOOR = (
    HEAD
    + """MARKER/10, PART=1, REULER=90D,90D,0D
MARKER/11, PART=1, QP=1,0,0, REULER=90D,90D,0D
MARKER/21, PART=2, QP=-0.3,0,0, REULER=90D,90D,0D
MARKER/22, PART=2, QP=0.7,0,0, REULER=90D,90D,0D
JOINT/1, REVOLUTE, I=21, J=10
JOINT/2, REVOLUTE, I=22, J=11
MOTION/1, JOINT=1, ROTATION, FUNCTION=TIME
MOTION/2, JOINT=2, ROTATION, FUNCTION=TIME
END
"""
)
"""The door of a published report of ADAMS's model verification: two pins along x, each driven."""


def removed(deck, redundancy="adams"):
    result = run_deck(parse_deck(deck), end=0.1, steps=2, redundancy=redundancy)
    text = message_text(result)
    return [line.split("equation  ")[1] for line in text.splitlines() if "deactivating" in line]


def test_a_door_loses_what_adams_removes():
    assert removed(DOOR) == [
        "JOINT/1 JOINT_1 (Revolute Joint)    Rotation Between Zi & Xj",
        "JOINT/1 JOINT_1 (Revolute Joint)    Rotation Between Zi & Yj",
        "JOINT/2 JOINT_2 (Revolute Joint)    Translation of I Marker Along Xg",
        "JOINT/2 JOINT_2 (Revolute Joint)    Rotation Between Zi & Xj",
        "JOINT/2 JOINT_2 (Revolute Joint)    Rotation Between Zi & Yj",
        "MOTION/1 MOTION_1 (Motion)    Rotation About Zj",
    ]


def test_the_other_order_is_there():
    rows = removed(DOOR, "declared")
    assert len(rows) == 6
    assert not any("JOINT/1" in row or "MOTION/1" in row for row in rows)


PARALLEL = (
    HEAD
    + """MARKER/10, PART=1, REULER=90D,90D,0D
MARKER/11, PART=1
MARKER/21, PART=2, QP=-0.3,0,0, REULER=90D,90D,0D
MARKER/22, PART=2, QP=-0.3,0,0
JOINT/1, PLANAR, I=22, J=11
JOINT/2, CYLINDRICAL, I=21, J=10
END
"""
)
"""The planar joint, which stands first, is level; the cylindrical joint lies along x in its plane."""


def test_orientations_of_planar_joints_go_before_those_of_cylindrical_ones():
    rows = removed(PARALLEL)
    assert rows
    assert all("Planar" in row or "Translation" in row for row in rows)
    assert any("Planar" in row and "Rotation" in row for row in rows)
    assert any("Cylindrical" in row for row in removed(PARALLEL, "declared"))


def test_the_motion_does_not_depend_on_the_choice():
    deck = DOOR.replace("MOTION/1, JOINT=1, ROTATION, FUNCTION=TIME\nMOTION/2, JOINT=2, ROTATION, FUNCTION=TIME\n", "")
    deck = deck.replace("ACCGRAV/KGRAV=-9.81", "ACCGRAV/JGRAV=-5, KGRAV=-9.81\nREQUEST/1, F2=AZ(21,10)")
    deck = deck.replace("MARKER/20, PART=2", "MARKER/20, PART=2, QP=0,0.2,0")
    runs = [run_deck(parse_deck(deck), end=0.5, steps=10, redundancy=r) for r in ("adams", "declared")]
    first, second = (r.request(1)[:, 1] for r in runs)
    assert np.allclose(first, second, atol=1e-6)
    assert np.ptp(first) > 0.5
    # together, both joints carry the same
    total = [r.force("joint", 1) + r.force("joint", 2) for r in runs]
    assert np.allclose(total[0][:, :3], total[1][:, :3], atol=1e-5)


def test_an_order_that_is_not_known():
    m = Mechanism("m")
    m.body("b", 1.0, (1, 1, 1))
    m.redundancy = "best"
    with pytest.raises(ModelError, match=says("'best'", "choose", "declared", "adams")):
        m.simulate(0.1)
