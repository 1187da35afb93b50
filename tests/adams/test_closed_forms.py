"""Decks against closed forms: a ball that bounces with spin and comes to roll, a box on an incline."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from gearmbs.adams import parse_deck, run_deck

G = 9.81
FRICTION = (
    "COULOMB_FRICTION=ON, MU_STATIC={static}, MU_DYNAMIC={dynamic}, STICTION_TRANSITION_VELOCITY={stick}, "
    "FRICTION_TRANSITION_VELOCITY={slip}"
)
DECK = """closed forms
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
PART/2, MASS=1, CM=20, IP={inertia}, QG=0,0,{height}{start}
MARKER/20, PART=2
GRAPHICS/1, PLANE, RM=10
{solid}
CONTACT/1, IGEOM=2, JGEOM=1, {law}, {friction}
ACCGRAV/IGRAV={along}, KGRAV={down}
REQUEST/1, F2=DX(20)\\F3=DZ(20)\\F4=VX(20)\\F6=VZ(20)\\F7=WY(20)\\F8=PITCH(20)
END
"""
RADIUS, INERTIA = 0.02, 1.6e-4
BALL = f"GRAPHICS/2, ELLIPSOID, CM=20, XS={2 * RADIUS}, YS={2 * RADIUS}, ZS={2 * RADIUS}"


def ball(height, law, mu, start, slope=0.0):
    friction = FRICTION.format(static=mu, dynamic=mu, stick=1e-4, slip=2e-4)
    return DECK.format(
        inertia=f"{INERTIA},{INERTIA},{INERTIA}", height=RADIUS + height, start=start, solid=BALL, law=law,
        friction=friction, along=G * np.sin(slope), down=-G * np.cos(slope),
    )  # fmt: skip


@pytest.mark.parametrize("restitution", [0.8, 0.4])
def test_a_ball_bounces_with_spin(restitution):
    """It slips all through the impact: m dv_x = -mu m dv_z, I dw = mu m dv_z R, and dv_z = (1 + r) of the speed."""
    mu, drop, v0 = 0.1, 0.2, 3.0
    law = f"POISSON, PENALTY=1E8, RESTITUTION_COEFFICIENT={restitution}"
    result = run_deck(parse_deck(ball(drop, law, mu, f", VX={v0}")), end=0.25, steps=2500, tol=1e-10)
    z, vx, vz, w = result.request(1)[:, [2, 3, 5, 6]].T
    landed = np.flatnonzero(z < RADIUS + 1e-6)[-1] + 5
    speed = np.sqrt(2 * G * drop)
    assert vz[landed - 20] == pytest.approx(-np.sqrt(2 * G * (drop + RADIUS - z[landed - 20])), rel=1e-6)
    up = vz[landed] + G * (result.t[landed] - result.t[landed - 5])
    assert up == pytest.approx(restitution * speed, rel=1e-2)
    # whatever the normal impulse is, that of friction is mu of it
    pushed = up + speed
    assert v0 - vx[landed] == pytest.approx(mu * pushed, rel=2e-3)
    # it rubs at half the depth, whose mean over the impulse of a half sine is pi/8 of the largest
    lever = RADIUS - np.pi / 8 * speed * np.sqrt(1.0 / 1e8)
    assert w[landed] * INERTIA == pytest.approx((v0 - vx[landed]) * lever, rel=1e-4)
    assert vx[landed] - RADIUS * w[landed] > 0.5


@pytest.mark.parametrize("slope", [0.2, 0.8], ids=["rolls", "slips"])
def test_a_ball_on_an_incline(slope):
    mu, ratio = 0.15, INERTIA / RADIUS**2
    sunk = G * np.cos(slope) / 1e6
    law = "IMPACT, STIFFNESS=1E6, EXPONENT=1, DAMPING=1E3, DMAX=1E-6"
    result = run_deck(parse_deck(ball(-sunk, law, mu, "", slope)), end=0.3, steps=100)
    rolls = np.tan(slope) <= mu * (1 + 1 / ratio)
    assert rolls == (slope == 0.2)
    a = G * np.sin(slope) / (1 + ratio) if rolls else G * (np.sin(slope) - mu * np.cos(slope))
    spin = a / RADIUS if rolls else mu * G * np.cos(slope) * RADIUS / INERTIA
    assert result.request(1)[:, 1] == pytest.approx(0.5 * a * result.t**2, abs=2e-4)
    assert result.request(1)[-1, 6] == pytest.approx(spin * 0.3, rel=2e-3)
    slip = result.tracks(1)[-1, 0, 24:27]
    assert np.linalg.norm(slip) == pytest.approx(0.0 if rolls else (a - spin * RADIUS) * 0.3, abs=1e-3)


def box(slope, static, dynamic, base=0.1, height=0.1):
    corner = f"MARKER/21, PART=2, QP={-base / 2},-0.05,{-height / 2}"
    solid = f"{corner}\nGRAPHICS/2, BOX, CORNER=21, X={base}, Y=0.1, Z={height}"
    ip = ",".join(repr(v / 12.0) for v in (0.01 + height**2, base**2 + height**2, base**2 + 0.01))
    return DECK.format(
        inertia=ip, height=0.5 * height - G * np.cos(slope) / 1e6, start="", solid=solid,
        law="IMPACT, STIFFNESS=1E6, EXPONENT=1, DAMPING=2E3, DMAX=1E-6",
        friction=FRICTION.format(static=static, dynamic=dynamic, stick=1e-3, slip=1.5e-3),
        along=G * np.sin(slope), down=-G * np.cos(slope),
    )  # fmt: skip


def test_a_box_sticks_and_creeps_as_the_law_says():
    """mu_s STEP(v, -v_s, -1, v_s, 1) = tan(slope)."""
    slope = 0.2
    result = run_deck(parse_deck(box(slope, 0.3, 0.25)), end=0.4, steps=40)
    x = brentq(lambda q: 0.3 * (1.5 * q - 0.5 * q**3) - np.tan(slope), 0.0, 1.0)
    assert result.request(1)[-1, 3] == pytest.approx(1e-3 * x, rel=1e-3)


def test_a_box_slips():
    slope = 0.5
    result = run_deck(parse_deck(box(slope, 0.3, 0.25)), end=0.4, steps=40)
    a = G * (np.sin(slope) - 0.25 * np.cos(slope))
    assert result.request(1)[:, 1] == pytest.approx(0.5 * a * result.t**2, abs=1e-4)


@pytest.mark.parametrize(("height", "tips"), [(0.095, False), (0.105, True)])
def test_a_box_tips_where_its_weight_leaves_the_base(height, tips):
    """At tan(slope) = 1/2, with a base of 0.05 m: from a height of 0.1 m on."""
    result = run_deck(parse_deck(box(np.arctan(0.5), 0.9, 0.9, 0.05, height)), end=0.25, steps=25, tol=1e-7)
    tilt = abs(result.request(1)[-1, 7])
    assert tilt > 0.05 if tips else tilt < 1e-2


TURNED = """angles
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/11, PART=1
MARKER/12, PART=1, REULER=90D,90D,0
PART/2, MASS=1, CM=20, IP=1,1,1, WZ=1
MARKER/20, PART=2
JOINT/1, REVOLUTE, I=20, J=11
SFORCE/1, ROTATIONAL, I=20, J=11, FUNCTION=-4*{angle}
REQUEST/1, D, I=20, J=11
{requests}END
"""
SYSTEMS = ("123", "231", "312", "132", "213", "321", "121", "131", "212", "232", "313", "323")


@pytest.mark.parametrize("angle", ["PSI(20,11)", "ORIENT(12,1,20,11)"])
def test_angles_where_the_first_and_the_third_axis_are_parallel(angle):
    """All of a turn is the first angle then, in results and in a torque that swings; any angles give the axes."""
    requests = "".join(
        f"REQUEST/{k + 2}, F2=ORIENT({k + 1},1,20,11)\\F3=ORIENT({k + 1},2,20,11)\\F4=ORIENT({k + 1},3,20,11)\n"
        for k in range(12)
    )
    requests += requests.replace("20,11", "11,12").replace("REQUEST/", "REQUEST/5")
    found = run_deck(parse_deck(TURNED.format(angle=angle, requests=requests)), end=1.0, steps=4, tol=1e-10)
    turned = 0.5 * np.sin(2.0 * found.t)
    np.testing.assert_allclose(found.request(1)[:, 5], turned, atol=1e-7)
    np.testing.assert_allclose(found.request(1)[:, 6:8], 0.0, atol=1e-12)
    about_z = Rotation.from_rotvec(np.column_stack([0.0 * turned, 0.0 * turned, turned])).as_matrix()
    tilted = Rotation.from_euler("ZXZ", [90.0, 90.0, 0.0], degrees=True).as_matrix().T
    for k, system in enumerate(SYSTEMS):
        for number, axes in ((k + 2, about_z), (int(f"5{k + 2}"), tilted)):
            angles = found.request(number)[:, 1:4]
            made = Rotation.from_euler(system.translate(str.maketrans("123", "XYZ")), angles).as_matrix()
            np.testing.assert_allclose(made, np.broadcast_to(axes, made.shape), atol=1e-7)
