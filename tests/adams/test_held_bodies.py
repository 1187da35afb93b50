"""PART with PLANAR and POINT_MASS against bodies in closed form."""

from __future__ import annotations

import re

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck
from tests.says import says

HEAD = "held\nUNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND\nPART/1, GROUND\nMARKER/1, PART=1\n"
PLATE = """PART/2, MASS=2, CM=20, IP=0.3,0.4,0.5, QG=1,2,0.7{extra}
MARKER/20, PART=2
SFORCE/1, TRANSLATIONAL, I=20, J=1, FUNCTION=-3*DM(20,1)
VTORQUE/1, I=20, JFLOAT=9, RM=1, TX=4\\TY=-5\\TZ=0.25
MARKER/9, PART=1, FLOATING
"""


def run(text, **more):
    return run_deck(parse_deck(HEAD + text + "END\n"), end=1.0, steps=20, tol=1e-10, **more)


def test_a_planar_part_moves_in_its_plane():
    """Pulled to the origin by 3 DM, which is 3 x and 3 y in the plane, and turned about z by 0.25 of 0.5."""
    found = run(PLATE.format(extra=", PLANAR, VX=0.4, VZ=9, WX=3, WZ=0.2"))
    assert found.segments[0].solution.system.report.degrees_of_freedom == 3
    part, t = found.part(2), found.t
    rate = np.sqrt(3.0 / 2.0)
    x = np.cos(rate * t) + 0.4 / rate * np.sin(rate * t)
    np.testing.assert_allclose(part[:, 0], x, atol=1e-8)
    np.testing.assert_allclose(part[:, 1], 2.0 * np.cos(rate * t), atol=1e-8)
    np.testing.assert_allclose(part[:, 2], 0.7, atol=1e-10)
    # PSI, THETA, PHI of a turn about z: their sum is the angle
    np.testing.assert_allclose(part[:, 3] + part[:, 5], 0.2 * t + 0.25 * t**2, atol=1e-8)
    np.testing.assert_allclose(part[:, 4], 0.0, atol=1e-9)


def test_a_planar_pendulum_needs_no_more_than_a_point():
    """A pin between planar parts leaves them one freedom, its rows out of the plane are redundant."""
    text = """PART/2, MASS=2, CM=20, IP=0.3,0.4,0.5, QG=1,0,0, REULER=20D,0,0, PLANAR
MARKER/20, PART=2
MARKER/21, PART=2, QP=-1,0,0
MARKER/2, PART=1, QP=0.0603073792,-0.3420201433,0
JOINT/1, REVOLUTE, I=21, J=2
ACCGRAV/JGRAV=-9.81
"""
    found, free = run(text), run(text.replace(", PLANAR", ""))
    report = found.segments[0].solution.system.report
    assert report.degrees_of_freedom == 1
    assert len(report.redundant) == 3
    np.testing.assert_allclose(found.part(2), free.part(2), atol=1e-6)


POINT = """POINT_MASS/1, MASS=2, CM=20, QG=1,0,0, REULER=30D,0,0, VY=0.5
MARKER/20, POINT_MASS=1
SPRINGDAMPER/1, TRANSLATIONAL, I=20, J=1, K=8, C=0, LENGTH=0
PART/2, MASS=1, CM=30, IP=1,1,1, QG=0,0,5, VZ=1
MARKER/30, PART=2
"""


def test_a_point_mass_on_a_spring():
    found = run(POINT)
    assert found.segments[0].solution.system.report.degrees_of_freedom == 9
    rows, t = found.point_mass(1), found.t
    np.testing.assert_allclose(rows[:, 0], np.cos(2 * t), atol=1e-8)
    np.testing.assert_allclose(rows[:, 1], 0.25 * np.sin(2 * t), atol=1e-8)
    np.testing.assert_allclose(rows[:, 6], -4 * np.cos(2 * t), atol=1e-6)
    assert found.to_dataset().point_mass_1.shape == (21, 9)


def test_a_point_mass_slides_down_a_plane(tmp_path):
    """By g sin 30 along it, pressed by m g cos 30."""
    text = """POINT_MASS/7, MASS=3, CM=70, REULER=0,80D,0
MARKER/70, POINT_MASS=7
MARKER/2, PART=1, REULER=0,30D,0
JPRIM/1, INPLANE, I=70, J=2
ACCGRAV/KGRAV=-10
"""
    found = run(text, out=tmp_path / "r")
    assert found.segments[0].solution.system.report.degrees_of_freedom == 2
    along, up = np.array([0.0, -np.cos(np.pi / 6), -0.5]), np.array([0.0, -0.5, np.cos(np.pi / 6)])
    np.testing.assert_allclose(found.point_mass(7)[:, :3], np.outer(2.5 * found.t**2, along), atol=1e-8)
    pressed = np.tile(30 * np.cos(np.pi / 6) * up, (21, 1))
    np.testing.assert_allclose(found.force("jprim", 1)[:, :3], pressed, atol=1e-6)
    assert 'entType="Point_Mass"' in (tmp_path / "r.res").read_text()


def test_after_an_analysis_they_go_on_from_where_they_are():
    plate = PLATE.format(extra=", PLANAR, WZ=1").replace("PART/2", "PART/3").replace("PART=2", "PART=3")
    deck = parse_deck(HEAD + POINT + plate.replace("20", "40") + "END\n")
    whole = run_deck(deck, parse_script("m\no\nSIM/DYN, END=1, STEPS=2\n"), tol=1e-10)
    halves = run_deck(deck, parse_script("m\no\nSIM/DYN, END=0.5, STEPS=1\nSIM/DYN, END=1, STEPS=1\n"), tol=1e-10)
    np.testing.assert_allclose(halves.point_mass(1)[-1], whole.point_mass(1)[-1], atol=1e-7)
    np.testing.assert_allclose(halves.part(3)[-1], whole.part(3)[-1], atol=1e-7)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("POINT_MASS/1, MASS=0\n", says("POINT_MASS/1", "MASS = 0.0")),
        ("MARKER/5, POINT_MASS=3\n", "MARKER/5: there is no POINT_MASS/3"),
        ("POINT_MASS/1, MASS=1, CM=1\n", "POINT_MASS/1: CM = 1, but MARKER/1 is on PART/1"),
    ],
)
def test_what_is_wrong_with_a_point_mass(given, message):
    with pytest.raises(DeckError, match=message):
        parse_deck(HEAD + given + "END\n")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("JOINT/1, REVOLUTE, I=20, J=1\n", says("JOINT/1", "'POINT_MASS_1'", "spherical", "7")),
        ("VTORQUE/1, I=20, JFLOAT=9, RM=1, TX=4\\TY=0\\TZ=0\nMARKER/9, PART=1, FLOATING\n",
         says("VTORQUE/1", "'POINT_MASS_1'", "torque")),
    ],
)  # fmt: skip
def test_what_turns_a_point_mass_is_refused_at_its_line(given, message):
    point = "POINT_MASS/1, MASS=2, CM=20\nMARKER/20, POINT_MASS=1\n"
    with pytest.raises(DeckError, match=message):
        parse_deck(HEAD + point + given + "END\n").to_mechanism()
    # the same with nothing that turns it
    run(point + given.replace("REVOLUTE", "SPHERICAL").replace("TX=4", "TX=0"))


@pytest.mark.parametrize(
    ("extra", "acts"),
    [
        ("", False),
        ("MARKER/31, PART=3\nREQUEST/1, D, I=31, J=1\nGRAPHICS/1, ELLIPSOID, CM=31, XS=1, YS=1, ZS=1\n", False),
        ("MARKER/31, PART=3\nGCON/1, I=20, FUNCTION=DX(20)-DX(31)\n", True),
        ("MARKER/31, PART=3\nSFORCE/2, TRANSLATIONAL, I=31, J=20, FUNCTION=1\n", True),
    ],
)
@pytest.mark.slow
def test_an_empty_part_rests_unless_something_acts_on_it(extra, acts):
    text = PLATE.format(extra="") + "PART/3, QG=1,2,3\n" + extra
    if acts:
        with pytest.raises(DeckError, match=says("PART_3", "inertia")):
            run(text)
        return
    found = run(text)
    np.testing.assert_allclose(found.part(3)[:, :3], np.tile([1.0, 2.0, 3.0], (21, 1)), atol=1e-12)
    np.testing.assert_allclose(found.part(2), run(PLATE.format(extra="")).part(2), atol=1e-8)
    assert any(re.search(says("PART/3", "rests"), str(message)) for message in found.messages)
