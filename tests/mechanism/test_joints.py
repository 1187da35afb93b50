"""Every joint between two flying bodies, by formulation and integrator, against independently written equations.

The reference knows a joint by its definition only: a function of two frames that must vanish. Its Jacobian and the
second derivative along the motion are differences of that function; Newton's and Euler's equations with multipliers
are then integrated as an ordinary differential equation.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gearmbs.mechanism import Mechanism, harmonic

MASSES = (2.0, 3.0)
INERTIAS = (np.diag([0.11, 0.22, 0.27]), np.diag([0.35, 0.15, 0.42]))
GRAVITY = np.array([0.5, -1.0, -9.81])
END = 0.4
PITCH = 0.3
X, Y, Z = np.eye(3)

Frame = tuple[np.ndarray, np.ndarray]


def point(i: Frame, j: Frame) -> list[float]:
    return list(i[0] - j[0])


def parallel(i: Frame, j: Frame) -> list[float]:
    """z axes along one line: the components of z_I across z_J."""
    z = j[1].T @ i[1][:, 2]
    return [z[0], z[1]]


def no_turn(i: Frame, j: Frame) -> list[float]:
    return [float(Rotation.from_matrix(j[1].T @ i[1]).as_rotvec()[k]) for k in range(3)]


def offset(i: Frame, j: Frame) -> np.ndarray:
    """The origin of I in the frame of J."""
    return j[1].T @ (i[0] - j[0])


def crossed(i: Frame, j: Frame) -> list[float]:
    return [float(i[1][:, 2] @ j[1][:, 2])]


def turn(i: Frame, j: Frame) -> float:
    c = j[1].T @ i[1][:, 0]
    return float(np.arctan2(c[1], c[0]))


DEFINITIONS: dict[str, Callable[[Frame, Frame, float], list[float]]] = {
    "fixed": lambda i, j, t: [*point(i, j), *no_turn(i, j)],
    "revolute": lambda i, j, t: [*point(i, j), *parallel(i, j)],
    "spherical": lambda i, j, t: point(i, j),
    "self_aligning": lambda i, j, t: point(i, j),
    "cylindrical": lambda i, j, t: [*offset(i, j)[:2], *parallel(i, j)],
    "translational": lambda i, j, t: [*offset(i, j)[:2], *no_turn(i, j)],
    "universal": lambda i, j, t: [*point(i, j), *crossed(i, j)],
    "planar": lambda i, j, t: [offset(i, j)[2], *parallel(i, j)],
    # equal turns of both shafts about their own axes: x_I . y_J = x_J . y_I
    "pin_slot": lambda i, j, t: [*offset(i, j)[1:], *parallel(i, j)],
    "constant_velocity": lambda i, j, t: [*point(i, j), i[1][:, 0] @ j[1][:, 1] - j[1][:, 0] @ i[1][:, 1]],
    "at_point": lambda i, j, t: point(i, j),
    "inline": lambda i, j, t: list(offset(i, j)[:2]),
    "inplane": lambda i, j, t: [offset(i, j)[2]],
    "orientation": lambda i, j, t: no_turn(i, j),
    "parallel_axes": lambda i, j, t: parallel(i, j),
    "perpendicular": lambda i, j, t: crossed(i, j),
    "screw": lambda i, j, t: [*offset(i, j)[:2], *parallel(i, j), offset(i, j)[2] - PITCH * turn(i, j) / (2 * np.pi)],
    "distance": lambda i, j, t: [np.linalg.norm(i[0] - j[0]) - 1.2],
    "rotation": lambda i, j, t: [*point(i, j), *parallel(i, j), turn(i, j) - 0.3 * np.sin(4.0 * t)],
    "translation": lambda i, j, t: [*offset(i, j)[:2], *no_turn(i, j), offset(i, j)[2] - 0.1 * np.sin(5.0 * t)],
}


@cache
def assembled(kind: str):
    """The mechanism, its system after assembly, and the markers' places in the bodies."""
    rng = np.random.default_rng(11)
    m = Mechanism(kind, gravity=GRAVITY)
    tilt = Rotation.from_rotvec([0.4, -0.3, 0.7]).as_matrix()
    at = np.array([0.3, -0.2, 0.5])
    bodies = []
    for name, mass, inertia, place in (
        ("one", MASSES[0], INERTIAS[0], (0, 0, 0)),
        ("two", MASSES[1], INERTIAS[1], (0.7, 0.1, 0.9)),
    ):
        bodies.append(
            m.body(name, mass, inertia, position=place, orientation=Rotation.random(random_state=rng).as_matrix(),
                   velocity=rng.standard_normal(3), angular_velocity=rng.standard_normal(3))
        )  # fmt: skip
    one, two = bodies
    # parallel axes where the joint wants them, else axes at an angle
    other = (
        tilt
        if kind not in ("universal", "constant_velocity", "perpendicular")
        else tilt @ Rotation.from_rotvec([1.4, 0, 0]).as_matrix()
    )
    if kind in ("universal", "perpendicular"):
        other = tilt @ Rotation.from_rotvec([np.pi / 2, 0, 0]).as_matrix()
    if kind == "constant_velocity":
        other = tilt @ Rotation.from_rotvec([0.5, 0, 0]).as_matrix()
    i, j = one.marker_at(at, tilt, name="i"), two.marker_at(at, other, name="j")
    if kind == "distance":
        m.distance("joint", i, two.marker_at(at + 1.2 * Z, tilt, name="k"))
        j = two.markers[-1]
    elif kind == "screw":
        m.screw("joint", i, j, pitch=PITCH)
    elif kind == "rotation":
        m.rotation("motion", m.joint("revolute", "joint", i, j), harmonic(0.3, 4.0))
    elif kind == "translation":
        m.translation("motion", m.joint("translational", "joint", i, j), harmonic(0.1, 5.0))
    else:
        m.joint(kind, "joint", i, j)
    system = m.compile()
    system.initialise()
    return m, system.pose.copy(), [(k.position.copy(), k.orientation.copy()) for k in (i, j)]


def frames(pose: np.ndarray, local) -> list[Frame]:
    return [(r + a @ p, a @ o) for (r, a), (p, o) in zip(pose, local)]


def displaced(pose, step: np.ndarray):
    step = step.reshape(2, 6)
    return [(r + d[:3], Rotation.from_rotvec(d[3:]).as_matrix() @ a) for (r, a), d in zip(pose, step)]


@cache
def reference(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Positions of both bodies and orientations at the end."""
    _, start, local = assembled(kind)
    define = DEFINITIONS[kind]

    def phi(pose, t: float) -> np.ndarray:
        return np.array(define(*frames(pose, local), t))

    def accelerations(t: float, pose, speed: np.ndarray) -> np.ndarray:
        h = 1e-5
        jacobian = np.array(
            [(phi(displaced(pose, h * e), t) - phi(displaced(pose, -h * e), t)) / (2 * h) for e in np.eye(12)]
        ).T
        k = 2e-3

        def along(s: float) -> np.ndarray:
            return phi(displaced(pose, s * k * speed), t + s * k)

        second = (-along(2) + 16 * along(1) - 30 * along(0) + 16 * along(-1) - along(-2)) / (12 * k * k)
        mass, force = np.zeros((12, 12)), np.zeros(12)
        for b, (_, a) in enumerate(pose):
            w = speed[6 * b + 3 : 6 * b + 6]
            inertia = a @ INERTIAS[b] @ a.T
            mass[6 * b : 6 * b + 3, 6 * b : 6 * b + 3] = MASSES[b] * np.eye(3)
            mass[6 * b + 3 : 6 * b + 6, 6 * b + 3 : 6 * b + 6] = inertia
            force[6 * b : 6 * b + 3] = MASSES[b] * GRAVITY
            force[6 * b + 3 : 6 * b + 6] = -np.cross(w, inertia @ w)
        rows = jacobian.shape[0]
        matrix = np.block([[mass, jacobian.T], [jacobian, np.zeros((rows, rows))]])
        # the displacement along a turning body is a rotation vector, so its second derivative is that of phi itself
        return np.linalg.solve(matrix, np.concatenate([force, -second]))[:12]

    def unpack(y: np.ndarray):
        return [(y[7 * b : 7 * b + 3], Rotation.from_quat(y[7 * b + 3 : 7 * b + 7]).as_matrix()) for b in range(2)]

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        pose, speed = unpack(y), y[14:]
        out = np.zeros(26)
        for b in range(2):
            x, yy, z, s = y[7 * b + 3 : 7 * b + 7]
            w = speed[6 * b + 3 : 6 * b + 6]
            out[7 * b : 7 * b + 3] = speed[6 * b : 6 * b + 3]
            vector = np.array([x, yy, z])
            out[7 * b + 3 : 7 * b + 6] = 0.5 * (s * w + np.cross(w, vector))
            out[7 * b + 6] = -0.5 * w @ vector
        out[14:] = accelerations(t, pose, speed)
        return out

    y0 = np.zeros(26)
    for b, row in enumerate(start):
        y0[7 * b : 7 * b + 3] = row[:3]
        y0[7 * b + 3 : 7 * b + 7] = Rotation.from_matrix(row[3:12].reshape(3, 3)).as_quat()
        y0[14 + 6 * b : 17 + 6 * b], y0[17 + 6 * b : 20 + 6 * b] = row[12:15], row[15:18]
    y = solve_ivp(rates, (0, END), y0, method="DOP853", rtol=1e-8, atol=1e-9).y[:, -1]
    pose = unpack(y)
    return np.array([p for p, _ in pose]), np.array([a for _, a in pose])


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
@pytest.mark.parametrize("kind", list(DEFINITIONS))
def test_joint_against_its_definition(kind, formulation, integrator):
    m, _, local = assembled(kind)
    solution = m.simulate(END, rate=50, formulation=formulation, integrator=integrator, tol=1e-8)
    assert solution.success, solution.message
    places, axes = reference(kind)
    # index 3 controls positions only
    bound = 1e-4 if formulation == "I3" else 2e-6
    for b, name in enumerate(("one", "two")):
        np.testing.assert_allclose(solution.com_position(name)[-1], places[b], atol=bound)
        np.testing.assert_allclose(solution.orientation(name)[-1], axes[b], atol=bound)
    pose = [(solution.com_position(n)[-1], solution.orientation(n)[-1]) for n in ("one", "two")]
    # the definition itself, with its own signs and axes, holds on our solution
    assert np.abs(DEFINITIONS[kind](*frames(pose, local), END)).max() < 1e-8


@pytest.mark.parametrize("kind", list(DEFINITIONS))
def test_loads_by_a_joints_reaction_hold_at_the_start(kind):
    """y0 and yp0 satisfy the equations with a load that answers to the reaction, which depends on the load in turn."""
    m, _, _ = assembled.__wrapped__(kind)
    on, off = m.bodies["one"].marker((0.1, 0, 0), name="on"), m.ground.marker(name="off")
    read = "MOTION(motion" if kind in ("rotation", "translation") else "JOINT(joint"
    fx, fy, tx = (f"0.02*{read},0,{c},off)" for c in (2, 3, 6))
    m.load("answer", on, off, fx=fx, fy=fy, fz="5.0", tx=tx)
    system = m.compile()
    system.initialise()
    for formulation in ("SI2", "I3"):
        p = system.problem(formulation)
        out = np.zeros(p.n)
        p.residual(p.t0, p.y0, p.yp0, out, p.idata, p.rdata, np.zeros(p.work_size))
        # forces of some ten newtons and the loads among them agree to what passes leave, 1e-13 of them
        assert np.abs(out).max() < 1e-9
