"""Every load on a flying body, by formulation and integrator, against independently written equations."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gearmbs.mechanism import Mechanism, ModelError
from tests.says import says

MASS, INERTIA = 2.0, np.diag([0.11, 0.22, 0.27])
GRAVITY = np.array([0.5, -1.0, -9.81])
END = 0.5
ARM = np.array([0.1, -0.2, 0.15])
"""Marker I in the body; marker J stands in the ground at POST, turned by POST_AXES."""
POST = np.array([0.4, 0.3, -0.5])
POST_AXES = Rotation.from_rotvec([0.2, -0.4, 0.3]).as_matrix()
START = Rotation.from_rotvec([0.3, 0.1, -0.2]).as_matrix()
VELOCITY, SPIN = np.array([0.4, -0.3, 0.8]), np.array([0.5, -0.7, 0.4])
RNG = np.random.default_rng(3)
STIFFNESS = (lambda a: a @ a.T + 20 * np.eye(6))(RNG.standard_normal((6, 6)))
DAMPING = 0.02 * STIFFNESS + 0.1 * RNG.standard_normal((6, 6))


def measures(r, a, v, w):
    """Displacement, angles AX AY AZ, velocity and angular velocity of I in J, in J's axes."""
    c = POST_AXES.T @ a
    shift = POST_AXES.T @ (r + a @ ARM - POST)
    turn = np.array([np.arctan2(-c[1, 2], c[2, 2]), np.arctan2(c[0, 2], c[2, 2]), np.arctan2(c[1, 0], c[0, 0])])
    return shift, turn, POST_AXES.T @ (v + np.cross(w, a @ ARM)), POST_AXES.T @ w


def line(force: float, shift) -> np.ndarray:
    return np.concatenate([force * shift / np.linalg.norm(shift), np.zeros(3)])


def stop(p: float, rate: float) -> float:
    """IMPACT's force at penetration p: 500 p^1.5 and damping 5, full at 1 cm."""
    if p <= 0.0:
        return 0.0
    x = min(p / 0.01, 1.0)
    return max(0.0, 500 * p**1.5 + 5.0 * rate * x * x * (3 - 2 * x))


def spring(m, i, j):
    m.spring_damper("load", i, j, stiffness=60.0, damping=1.5, length=0.7, preload=2.0)


def torsion(m, i, j):
    m.torsion_spring("load", i, j, stiffness=3.0, damping=0.2, angle=0.1, preload=0.3)


def bushing(m, i, j):
    m.bushing(
        "load",
        i,
        j,
        stiffness=(60, 70, 80),
        damping=(1, 2, 3),
        torsional_stiffness=(4, 5, 6),
        torsional_damping=(0.1, 0.2, 0.3),
    )


def field(m, i, j):
    m.field(
        "load", i, j, stiffness=STIFFNESS, damping=DAMPING, free=(0.1, 0, 0, 0, 0.2, 0), preload=(1, 0, 0, 0, 0, 0.5)
    )


def bistop(m, i, j):
    m.axis_force("load", i, j, "BISTOP(DZ(i,j,j), VZ(i,j,j,j), 0.2, 0.5, 500, 1.5, 5, 0.01)")


def general(m, i, j):
    m.load("load", i, j, fx="3*STEP(TIME,0.1,0,0.3,1)", fy="-2*VY(i,j,j,j)", tz="-0.5*WZ(i,j,j)", tx="0.2*DX(i,j,j)**2")


def impact(m, i, j):
    m.line_force("load", i, j, "IMPACT(DM(i,j), VR(i,j), 0.8, 500, 1.5, 5, 0.01)")


def smooth(t: float) -> float:
    x = np.clip((t - 0.1) / 0.2, 0, 1)
    return float(x * x * (3 - 2 * x))


def of_spring(t, d, a, v, w):
    length = np.linalg.norm(d)
    return line(2.0 - 60.0 * (length - 0.7) - 1.5 * (d @ v) / length, d)


def of_torsion(t, d, a, v, w):
    return np.array([0, 0, 0, 0, 0, 0.3 - 3.0 * (a[2] - 0.1) - 0.2 * w[2]])


def of_bushing(t, d, a, v, w):
    force = np.array([60, 70, 80]) * d + np.array([1, 2, 3]) * v
    return -np.concatenate([force, np.array([4, 5, 6]) * a + np.array([0.1, 0.2, 0.3]) * w])


def of_field(t, d, a, v, w):
    q = np.concatenate([d, a]) - [0.1, 0, 0, 0, 0.2, 0]
    return np.array([1, 0, 0, 0, 0, 0.5]) - STIFFNESS @ q - DAMPING @ np.concatenate([v, w])


def of_bistop(t, d, a, v, w):
    return np.array([0, 0, stop(0.2 - d[2], -v[2]) - stop(d[2] - 0.5, v[2]), 0, 0, 0])


def of_general(t, d, a, v, w):
    return np.array([3 * smooth(t), -2 * v[1], 0, 0.2 * d[0] ** 2, 0, -0.5 * w[2]])


def of_impact(t, d, a, v, w):
    length = np.linalg.norm(d)
    return line(stop(0.8 - length, -(d @ v) / length), d)


LOADS = {
    "spring": (spring, of_spring),
    "torsion": (torsion, of_torsion),
    "bushing": (bushing, of_bushing),
    "field": (field, of_field),
    "bistop": (bistop, of_bistop),
    "general": (general, of_general),
    "impact": (impact, of_impact),
}


@cache
def reference(kind: str):
    law = LOADS[kind][1]

    def rates(t, y):
        x, yy, z, s = y[3:7]
        v, w = y[7:10], y[10:13]
        a = Rotation.from_quat(y[3:7]).as_matrix()
        wrench = law(t, *measures(y[:3], a, v, w))
        force, torque = POST_AXES @ wrench[:3], POST_AXES @ wrench[3:]
        inertia = a @ INERTIA @ a.T
        vector = np.array([x, yy, z])
        turn = np.concatenate([0.5 * (s * w + np.cross(w, vector)), [-0.5 * w @ vector]])
        moment = torque + np.cross(a @ ARM, force) - np.cross(w, inertia @ w)
        return np.concatenate([v, turn, force / MASS + GRAVITY, np.linalg.solve(inertia, moment)])

    y0 = np.concatenate([np.zeros(3), Rotation.from_matrix(START).as_quat(), VELOCITY, SPIN])
    y = solve_ivp(rates, (0, END), y0, method="DOP853", rtol=1e-10, atol=1e-11).y[:, -1]
    return y[:3], Rotation.from_quat(y[3:7]).as_matrix()


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
@pytest.mark.parametrize("kind", list(LOADS))
def test_load_against_its_law(kind, formulation, integrator):
    m = Mechanism(kind, gravity=GRAVITY)
    body = m.body("b", MASS, INERTIA, orientation=START, velocity=VELOCITY, angular_velocity=SPIN)
    i, j = body.marker(ARM, name="i"), m.ground.marker(POST, POST_AXES, name="j")
    LOADS[kind][0](m, i, j)
    solution = m.simulate(END, rate=50, formulation=formulation, integrator=integrator, tol=1e-9)
    assert solution.success, solution.message
    place, axes = reference(kind)
    # index 3 controls positions only; a stop that is hit costs it 2e-5
    bound = 5e-5 if formulation == "I3" else 2e-6
    np.testing.assert_allclose(solution.com_position("b")[-1], place, atol=bound)
    np.testing.assert_allclose(solution.orientation("b")[-1], axes, atol=bound)


def test_beam_is_the_field_of_its_stiffness():
    """Tip of a cantilever: u = F L^3/(3 E I), slope F L^2/(2 E I)."""
    from gearmbs.mechanism import static_equilibrium

    m = Mechanism("cantilever")
    tip = m.body("tip", 1.0, (1, 1, 1), position=(1, 0, 0))
    i, j = tip.marker(name="i"), m.ground.marker(name="j")
    m.beam("beam", i, j, length=1.0, area=1e-4, second_moments=(2e-8, 1e-8, 3e-8), modulus=2e11, shear_modulus=8e10)
    m.load("weight", i, m.ground.marker(name="base"), fy="0.6")
    rest = static_equilibrium(m)
    np.testing.assert_allclose(rest.com_position("tip")[1], 0.6 / 18000, rtol=1e-4)
    np.testing.assert_allclose(rest.orientation("tip")[1, 0], 0.6 / 12000, rtol=1e-4)
    with pytest.raises(ModelError, match=says("length = 0.0")):
        m.beam("b", i, j, length=0.0, area=1, second_moments=(1, 1, 1), modulus=1, shear_modulus=1)
    with pytest.raises(ModelError, match="stiffness and damping are 6x6"):
        m.field("f", i, j, stiffness=np.eye(3))


def test_gear_and_rack_by_name():
    """A motor turns a wheel; a second goes half as fast the other way and drives a rack at its radius."""
    m = Mechanism("train")
    one, two = m.body("one", 1, (1, 1, 0.1)), m.body("two", 1, (1, 1, 0.2), position=(1, 0, 0))
    rack = m.body("rack", 3.0, (1, 1, 1), position=(1, -0.1, 0))
    pins = [m.revolute(b.name, b, m.ground, at=b.position) for b in (one, two)]
    rail = m.translational("rail", rack, m.ground, at=(1, -0.1, 0), axis=(1, 0, 0))
    m.gear("mesh", pins[0], pins[1], -0.5)
    m.rack_pinion("drive", pins[1], rail, 0.1)
    m.torque("motor", one, 0.5)
    solution = m.simulate(2.0, tol=1e-9)
    # 0.1 + 0.2/4 + 3 (0.05)^2 kg m^2 at the motor
    rate = 0.5 / (0.1 + 0.05 + 3 * 0.05**2) * solution.t
    np.testing.assert_allclose(solution.angular_velocity("one")[:, 2], rate, atol=1e-6)
    np.testing.assert_allclose(solution.angular_velocity("two")[:, 2], -0.5 * rate, atol=1e-6)
    np.testing.assert_allclose(solution.com_velocity("rack")[:, 0], -0.05 * rate, atol=1e-6)
    with pytest.raises(ModelError, match="it must be translational"):
        m.rack_pinion("bad", pins[0], pins[1], 0.1)


@pytest.mark.parametrize(("level", "function"), [("velocity", "3*COS(2*TIME)"), ("acceleration", "-6*SIN(2*TIME)")])
def test_motion_by_its_rate(level, function):
    """a = a0 + 1.5 sin 2t, from the angle the body starts at."""
    m = Mechanism("drive")
    wheel = m.body("w", 1.0, (1, 1, 1), orientation=Rotation.from_rotvec([0, 0, 0.4]).as_matrix())
    pin = m.joint("revolute", "pin", wheel.marker(name="i"), m.ground.marker(name="j"))
    m.rotation("motion", pin, function, level=level, rate=3.0)
    solution = m.simulate(3.0, tol=1e-9)
    axes = solution.orientation("w")
    angle = np.unwrap(np.arctan2(axes[:, 1, 0], axes[:, 0, 0]))
    np.testing.assert_allclose(angle, 0.4 + 1.5 * np.sin(2 * solution.t), atol=1e-8)
    with pytest.raises(ModelError, match="level 'jerk'; choose displacement"):
        m.rotation("other", pin, 1.0, level="jerk")


def test_arrays_in_expressions():
    m = Mechanism("array")
    body = m.body("b", 2.0, (1, 1, 1))
    m.array("forces", [1.0, 4.0])
    m.axis_force("push", body.marker(name="i"), m.ground.marker(name="j"), "ARYVAL(forces, 2)")
    assert m.simulate(1.0, tol=1e-9).com_velocity("b")[-1, 2] == pytest.approx(2.0, abs=1e-8)


@pytest.mark.parametrize("tol", [1e-7, 1e-9])
@pytest.mark.parametrize(("formulation", "integrator"), [("SI2", "WSTIFF"), ("SI1", "GSTIFF"), ("SI2", "IDA")])
@pytest.mark.parametrize("jump", [0.0, 0.5])
def test_a_load_that_grows_from_nothing(tol, formulation, integrator, jump):
    """w = a (t - t_j)^2 / 2 I: the first step's error is the speed's alone, which follows from the momentum."""
    m = Mechanism("from rest")
    disc = m.body("disc", 1.0, (2, 2, 2))
    m.revolute("hinge", m.ground, disc)
    m.torque("load", disc, f"IF(TIME-{jump}: 0, 0, 239.9*(TIME-{jump}))")
    places = [jump] if jump else ()
    run = m.simulate(1.0, rate=500.0, tol=tol, formulation=formulation, integrator=integrator, breakpoints=places)
    exact = 239.9 * np.clip(run.t - jump, 0.0, None) ** 2 / 4
    # steps add up what each may leave
    assert np.abs(run.angular_velocity("disc")[:, 2] - exact).max() < 10 * tol * max(1.0, exact.max())
    assert np.all(np.abs(run.angular_velocity("disc")[:, 2] - exact) < 10 * tol * np.maximum(1.0, exact))
