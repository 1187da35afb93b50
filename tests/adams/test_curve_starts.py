"""PTCV and CVCV that start with velocities, stop and go on: a bead on a ring, two cams that drive each other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from gearmbs.adams import parse_deck, parse_script, run_deck

HEAD = "curves\nUNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH={}, TIME=SECOND\nPART/1, GROUND\nMARKER/1, PART=1\n"
TURN = 2.0 * np.pi * np.arange(180) / 180


def matrix(number, a, b):
    points = np.column_stack([a * np.cos(TURN), b * np.sin(TURN), 0.0 * TURN])
    values = "\n, ".join(",".join(f"{v:.15g}" for v in row) for row in points)
    return f"MATRIX/{number}, FULL=RORDER, ROWS={len(points)}, COLUMNS=3, VALUES=\n, {values}\n"


BEAD = """PART/2, MASS=2, CM=20, IP=1,1,1, QG={r},0,0{moves}
MARKER/20, PART=2
CURVE/1, CLOSED, MATRIX=1
PTCV/1, I=20, CURVE=1, RM=1{more}
REQUEST/1, F2=DX(20,1)\\F3=DY(20,1)\\F4=VM(20,1)\\F6=PTCV(1,0,1,1)
{sensor}
"""
ONCE = "m\no\nSIMULATE/DYNAMICS, END=1.5, STEPS=15\n"
THRICE = "m\no\n" + "".join(f"SIMULATE/DYNAMICS, END={t}, STEPS=5\n" for t in (0.5, 1.0, 1.5))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("moves", "more", "sensor", "script"),
    [
        (", VY={v}", "", "", ONCE),
        (", VY={v}", "", "", THRICE),
        (", VY={v}", "", "SENSOR/1, GE, VALUE=0.7, ERROR=1E-6, FUNCTION=TIME, RESTART", ONCE),
        ("", ", VEL={v}", "", THRICE),
        (", VY={v}", ", VEL={v}, DISP={r},0,0", "", ONCE),
    ],
    ids=["velocity of the part", "three analyses", "sensor", "VEL", "both"],
)
def test_a_bead_keeps_its_speed(moves, more, sensor, script):
    r, v = 1000.0, 2000.0
    text = BEAD.format(r=r, moves=moves, more=more, sensor=sensor).format(r=r, v=v)
    deck = parse_deck(HEAD.format("MILLIMETER") + matrix(1, r, r) + text + "END\n")
    result = run_deck(deck, parse_script(script), tol=1e-9)
    assert result.success
    x, y, speed, force = result.request(1)[:, [1, 2, 3, 5]].T
    # the spline of the ring has its curvature within 1e-4
    np.testing.assert_allclose(speed, v, rtol=1e-6)
    np.testing.assert_allclose(np.unwrap(np.arctan2(y, x)), v / r * result.t, atol=1e-5)
    np.testing.assert_allclose(force, 2.0 * v**2 / r * 1e-3, rtol=1e-3)


A, B, C, D, E, F = 1.0, 0.7, 1.2, 0.9, 0.8, 1.7
OFF, TWIST = np.array([0.15, 0.1]), math.radians(20.0)


def turned(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def overlap(theta, phi, distance):
    """Overlap of both ellipses along their common normal, which is returned, too: by their support functions."""

    def along(psi):
        n = np.array([np.cos(psi), np.sin(psi)])
        one, other = turned(theta + TWIST).T @ n, turned(phi).T @ n
        first = turned(theta) @ OFF @ n + np.hypot(A * one[0], B * one[1])
        return first - distance * n[0] + np.hypot(C * other[0], D * other[1])

    found = minimize_scalar(along, bounds=(-1.2, 1.2), method="bounded", options={"xatol": 1e-11})
    return found.fun, np.array([np.cos(found.x), np.sin(found.x)])


def arm(theta, n):
    """Place of the contact on the first ellipse, from its pivot."""
    m = turned(theta + TWIST).T @ n
    place = np.array([A**2 * m[0], B**2 * m[1]]) / np.hypot(A * m[0], B * m[1])
    return turned(theta) @ OFF + turned(theta + TWIST) @ place


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


@pytest.mark.slow
def test_two_cams_drive_each_other():
    """Energy, the geometry and the normal force on both, from a start with velocities, over two analyses."""
    lowest, highest = 1.5, 3.0
    for _ in range(60):
        distance = 0.5 * (lowest + highest)
        lowest, highest = (distance, highest) if overlap(0.0, 0.0, distance)[0] > 0.0 else (lowest, distance)
    n = overlap(0.0, 0.0, distance)[1]
    p = arm(0.0, n)
    w = 1.3, 1.3 * cross(p, n) / cross(p - [distance, 0.0], n)
    deck = HEAD.format("METER") + matrix(1, A, B) + matrix(2, C, D)
    deck += f"""PART/2, MASS=2, CM=20, IP=1,1,{E}, WZ={w[0]:.16g}
MARKER/20, PART=2
MARKER/22, PART=2, QP={OFF[0]},{OFF[1]},0, REULER=20D,0,0
PART/3, MASS=3, CM=30, IP=1,1,{F}, QG={distance:.16g},0,0, WZ={w[1]:.16g}
MARKER/30, PART=3
MARKER/32, PART=1, QP={distance:.16g},0,0
JOINT/1, REVOLUTE, I=20, J=1
JOINT/2, REVOLUTE, I=30, J=32
CURVE/1, CLOSED, MATRIX=1
CURVE/2, CLOSED, MATRIX=2
CVCV/1, IRM=22, JRM=30, ICURVE=1, JCURVE=2
REQUEST/1, F2=AZ(20,1)\\F3=WZ(20,1)\\F4=AZ(30,32)\\F6=WZ(30,32)\\F7=WDTZ(20,1)\\F8=WDTZ(30,32)
REQUEST/2, F2=CVCV(1,0,2,1)\\F3=CVCV(1,0,3,1)\\F4=CVCV(1,0,8,1)\\F6=CVCV(1,1,2,1)\\F7=CVCV(1,1,3,1)\\F8=CVCV(1,1,8,1)
END
"""
    script = parse_script("m\no\nSIMULATE/DYNAMICS, END=1, STEPS=10\nSIMULATE/DYNAMICS, END=2, STEPS=10\n")
    result = run_deck(parse_deck(deck), script, tol=1e-9)
    assert result.success
    theta, speed, phi, other, alpha, beta = result.request(1)[:, [1, 2, 3, 5, 6, 7]].T
    assert (speed[0], other[0]) == pytest.approx(w, rel=2e-5)
    energy = 0.5 * (E * speed**2 + F * other**2)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-6)
    assert np.ptp(theta) > 0.8
    for k, (fx, fy, tz, gx, gy, uz) in enumerate(result.request(2)[:, [1, 2, 3, 5, 6, 7]]):
        deep, n = overlap(theta[k], phi[k], distance)
        assert deep == pytest.approx(0.0, abs=1e-6)
        p = arm(theta[k], n)
        q = p - [distance, 0.0]
        force = E * alpha[k] / cross(p, n)
        # the same force carries both; splines bend by 1e-5 otherwise than ellipses
        assert force == pytest.approx(-F * beta[k] / cross(q, n), rel=1e-4)
        np.testing.assert_allclose((fx, fy), force * n, atol=1e-4 * abs(force))
        np.testing.assert_allclose((gx, gy), (-fx, -fy), atol=1e-9 * abs(force))
        # of I about its marker, of J about its own
        assert tz == pytest.approx(force * cross(p - turned(theta[k]) @ OFF, n), abs=1e-4 * abs(force))
        assert uz == pytest.approx(-force * cross(q, n), abs=1e-4 * abs(force))


@pytest.mark.slow
def test_a_point_on_a_ring_that_turns_freely():
    """Momentum and energy, of a ring about a point beside its middle, over three analyses."""
    text = """PART/2, MASS=2, CM=20, IP=1,1,1.5, WZ=3
MARKER/20, PART=2
MARKER/23, PART=2, QP=0.3,0,0, REULER=30D,0,0
JOINT/1, REVOLUTE, I=20, J=1
PART/3, MASS=0.7, CM=30, IP=0.1,0.1,0.1, QG=1.3,0,0, VY=4.5
MARKER/30, PART=3
CURVE/1, CLOSED, MATRIX=1
PTCV/1, I=30, CURVE=1, RM=23
REQUEST/1, F2=DX(30,1)\\F3=DY(30,1)\\F4=VX(30,1)\\F6=VY(30,1)\\F7=WZ(20,1)\\F8=AZ(20,1)
END
"""
    deck = parse_deck(HEAD.format("METER") + matrix(1, 1.0, 1.0) + text)
    result = run_deck(deck, parse_script(THRICE), tol=1e-9)
    x, y, vx, vy, w, a = result.request(1)[:, [1, 2, 3, 5, 6, 7]].T
    np.testing.assert_allclose(0.7 * (x * vy - y * vx) + 1.5 * w, 0.7 * 1.3 * 4.5 + 4.5, rtol=1e-7)
    np.testing.assert_allclose(0.35 * (vx**2 + vy**2) + 0.75 * w**2, 0.35 * 4.5**2 + 6.75, rtol=1e-7)
    np.testing.assert_allclose(np.hypot(x - 0.3 * np.cos(a), y - 0.3 * np.sin(a)), 1.0, atol=1e-7)


def test_a_point_that_runs_off_an_open_curve_is_remarked():
    points = np.column_stack([np.linspace(0.0, 1.0, 11), np.zeros(11), np.zeros(11)])
    values = ",".join(f"{v:g}" for v in points.ravel())
    text = f"""MATRIX/1, FULL=RORDER, ROWS=11, COLUMNS=3, VALUES={values}
PART/2, MASS=2, CM=20, IP=1,1,1, QG=0.5,0,0, VX=1
MARKER/20, PART=2
CURVE/1, OPEN, MATRIX=1
PTCV/1, I=20, CURVE=1, RM=1
END
"""
    script = "m\no\nSIMULATE/DYNAMICS, END=0.4, STEPS=4\nSIMULATE/DYNAMICS, END=0.8, STEPS=4\n"
    result = run_deck(parse_deck(HEAD.format("METER") + text), parse_script(script))
    assert result.success
    (told,) = result.messages
    assert told.startswith("PTCV/1: at TIME = 0.6 it is off the end of its curve")


CAM = """PART/2, MASS=1, CM=20, IP=1,1,1
MARKER/20, PART=2
JOINT/1, REVOLUTE, I=20, J=1{ic}
{drive}
PART/3, MASS=1, CM=30, IP=1,1,1, QG=0,0.9539392014169456,0
MARKER/30, PART=3
MARKER/31, PART=3, REULER=0,90D,0
MARKER/15, PART=1, REULER=0,90D,0
MARKER/23, PART=2, QP=0.3,0,0
JOINT/2, TRANSLATIONAL, I=31, J=15
CURVE/1, CLOSED, MATRIX=1
PTCV/1, I=30, CURVE=1, RM=23{vel}
REQUEST/1, F2=DY(30,1)\\F3=VY(30,1)\\F4=WZ(20,1)
END
"""


def cam(**given):
    text = CAM.format(**({"ic": "", "drive": "", "vel": ""} | given))
    return run_deck(parse_deck(HEAD.format("METER") + matrix(1, 1.0, 1.0) + text), end=0.5, steps=10, tol=1e-9)


@pytest.mark.slow
def test_a_speed_that_contradicts_what_drives_the_cam_is_left_out():
    drive = "MOTION/1, JOINT=1, FUNCTION=3*TIME"
    expected, found = cam(drive=drive), cam(drive=drive, vel=", VEL=0")
    assert not expected.messages
    (told,) = found.messages
    assert "PTCV/1: VEL is left out" in told
    np.testing.assert_allclose(found.request(1), expected.request(1), atol=1e-8)
    # over the cam the point runs back as fast as the cam turns
    alone = cam(ic=", IC=0,3")
    assert alone.request(1)[0, 1:4] == pytest.approx([math.sqrt(0.91), 0.9, 3.0], abs=1e-4)
    free = cam(vel=", VEL=-3")
    assert free.request(1)[0, 3] == pytest.approx(3.0, abs=2e-3)


def test_the_message_file_says_how_given_velocities_were_changed(tmp_path):
    """Two shafts of 1 and 2 kg m^2, the second to turn back half as fast: 2 rad/s of the first do not fit."""
    text = """PART/2, MASS=2, CM=20, IP=1,1,1, WZ=2
MARKER/20, PART=2
JOINT/1, REVOLUTE, I=20, J=1
PART/3, MASS=1, CM=30, IP=2,2,2, QG=1,0,0
MARKER/30, PART=3
MARKER/31, PART=1, QP=1,0,0
JOINT/2, REVOLUTE, I=30, J=31
COUPLER/1, JOINTS=1,2, SCALES=1,2
END
"""
    told = []
    for spin in ("", ", WZ=-1"):
        changed = text.replace("QG=1,0,0\n", f"QG=1,0,0{spin}\n", 1)
        run_deck(parse_deck(HEAD.format("METER") + changed), end=0.1, steps=1, out=tmp_path / "shafts")
        told.append((tmp_path / "shafts.msg").read_text())
    assert "which did not fit the constraints: 4.000E-01 rad/sec (PART/2)." in told[0]
    assert "changes of given velocities" not in told[1]
