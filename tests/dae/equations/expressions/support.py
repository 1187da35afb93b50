"""A small random mechanism as tables, and calls to the evaluators with fresh arrays."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from gearmbs.dae.equations.expressions import eval_gradient, eval_request, eval_second, eval_time, eval_value
from gearmbs.dae.equations.expressions.opcodes import KIN_A, KIN_AXES, KIN_R, KIN_V, KIN_W
from gearmbs.mechanism.language.library import compile_expression
from gearmbs.mechanism.language.syntax import Scope

MARKERS = {1: 0, 2: 1, 3: 2, 4: 3, 10: 4, "CM": 1}
MARKER_BODY = np.array([1, 2, 3, 2, 0], dtype=np.int64)
Y = np.array([0.3, -1.2, 2.5, 0.7, -0.4, 1.9, 0.6])


def euler_axes(theta: np.ndarray) -> np.ndarray:
    """Return the axes of the rotations psi, theta, phi (3-1-3), one a row, in global components."""
    first = Rotation.from_euler("Z", theta[0])
    second = first * Rotation.from_euler("X", theta[1])
    return np.array([[0, 0, 1], first.apply([1, 0, 0]), second.apply([0, 0, 1])], dtype=float)


def kin_row(R, theta, v=(0, 0, 0), w=(0, 0, 0)) -> np.ndarray:
    """Return a row of the kinematics table from a position and 3-1-3 angles."""
    row = np.zeros(KIN_AXES + 9)
    row[KIN_R : KIN_R + 3] = R
    row[KIN_V : KIN_V + 3] = v
    row[KIN_A : KIN_A + 9] = Rotation.from_euler("ZXZ", theta).as_matrix().ravel()
    row[KIN_W : KIN_W + 3] = w
    row[KIN_AXES : KIN_AXES + 9] = euler_axes(np.asarray(theta)).ravel()
    return row


class World:
    """Three moving bodies and five markers at random places."""

    def __init__(self, seed: int = 1) -> None:
        rng = np.random.default_rng(seed)
        self.coordinates = rng.uniform(-1, 1, (4, 6))
        self.coordinates[0] = 0.0
        self.rates = rng.uniform(-1, 1, (4, 6))
        self.rates[0] = 0.0
        self.acc = rng.uniform(-1, 1, (4, 6))
        self.acc[0] = 0.0
        self.frames = np.zeros((5, 12))
        for row in self.frames:
            row[:3] = rng.uniform(-0.5, 0.5, 3)
            row[3:] = Rotation.random(random_state=rng.integers(1 << 30)).as_matrix().ravel()
        self.kin = self.table()

    def table(self) -> np.ndarray:
        rows = [kin_row(q[:3], q[3:], u[:3], u[3:]) for q, u in zip(self.coordinates, self.rates)]
        return np.array(rows)

    def scope(self, **more) -> Scope:
        return Scope(markers=MARKERS, marker_body=MARKER_BODY, **more)

    def compile(self, text: str, accelerations: bool = False, **more):
        return compile_expression(text, self.scope(**more), accelerations=accelerations)

    # independent kinematics of the markers

    def rotation(self, body: int) -> np.ndarray:
        return self.kin[body, KIN_A : KIN_A + 9].reshape(3, 3)

    def position(self, marker: int) -> np.ndarray:
        b = MARKER_BODY[marker]
        return self.kin[b, :3] + self.rotation(b) @ self.frames[marker, :3]

    def axes(self, marker: int) -> np.ndarray:
        b = MARKER_BODY[marker]
        return self.rotation(b) @ self.frames[marker, 3:].reshape(3, 3)

    def omega(self, marker: int) -> np.ndarray:
        return self.kin[MARKER_BODY[marker], KIN_W : KIN_W + 3]

    def velocity(self, marker: int) -> np.ndarray:
        b = MARKER_BODY[marker]
        return self.kin[b, KIN_V : KIN_V + 3] + np.cross(self.omega(marker), self.position(marker) - self.kin[b, :3])

    def alpha(self, marker: int) -> np.ndarray:
        return self.acc[MARKER_BODY[marker], 3:]

    def acceleration(self, marker: int) -> np.ndarray:
        b = MARKER_BODY[marker]
        s = self.position(marker) - self.kin[b, :3]
        w = self.omega(marker)
        return self.acc[b, :3] + np.cross(self.alpha(marker), s) + np.cross(w, np.cross(w, s))

    # evaluators

    def value(self, tape, t=0.4, kin=None, y=Y, ref=None) -> float:
        kin = self.kin if kin is None else kin
        ref = np.zeros(max(1, tape.n_angles)) if ref is None else ref
        return eval_value(
            tape.ints, tape.floats, t, kin, MARKER_BODY, self.frames, y, ref, np.full(tape.work_size, np.nan)
        )

    def request(self, tape, t=0.4) -> float:
        work, ref = np.full(tape.work_size, np.nan), np.zeros(max(1, tape.n_angles))
        return eval_request(tape.ints, tape.floats, t, self.kin, self.acc, MARKER_BODY, self.frames, Y, ref, work)

    def gradient(self, tape, t=0.4, y=Y, ref=None) -> tuple[float, np.ndarray]:
        grad = np.full(tape.gradient_size, np.nan)
        ref = np.zeros(max(1, tape.n_angles)) if ref is None else ref
        work = np.full(tape.work_size, np.nan)
        f = eval_gradient(tape.ints, tape.floats, t, self.kin, MARKER_BODY, self.frames, y, ref, grad, work)
        return f, grad

    def second(self, tape, t=0.4) -> tuple[float, np.ndarray, np.ndarray]:
        n = tape.second_size
        grad, hess = np.full(n, np.nan), np.full(n * n, np.nan)
        work, ref = np.full(tape.work_size, np.nan), np.zeros(max(1, tape.n_angles))
        f = eval_second(tape.ints, tape.floats, t, self.kin, MARKER_BODY, self.frames, Y, ref, grad, hess, work)
        return f, grad, hess.reshape(n, n)

    def varied(self, body: int, k: int, h: float) -> np.ndarray:
        """Return the kinematics table with the k-th spatial variation [dR, dpi, dv, dw] of a body set to h."""
        kin = self.kin.copy()
        if k < 3:
            kin[body, KIN_R + k] += h
        elif k < 6:
            turn = np.zeros(3)
            turn[k - 3] = h
            kin[body, KIN_A : KIN_A + 9] = (Rotation.from_rotvec(turn).as_matrix() @ self.rotation(body)).ravel()
        elif k < 9:
            kin[body, KIN_V + k - 6] += h
        else:
            kin[body, KIN_W + k - 9] += h
        return kin

    def gradient_by_differences(self, tape, t=0.4, h=1e-6) -> np.ndarray:
        out = []
        for body in tape.bodies:
            for k in range(12):
                high, low = (self.value(tape, t, self.varied(body, k, s)) for s in (h, -h))
                out.append((high - low) / (2 * h))
        for q in range(len(tape.algebraic)):
            index = tape.ints[tape.ints[5] + q]
            step = np.zeros_like(Y)
            step[index] = h
            out.append((self.value(tape, t, y=Y + step) - self.value(tape, t, y=Y - step)) / (2 * h))
        return np.array(out)


def time_series(tape, t: float) -> np.ndarray:
    """Return f, f', f'' of a tape of TIME."""
    out = np.full(3, np.nan)
    eval_time(tape.ints, tape.floats, t, out, np.full(tape.work_size, np.nan))
    return out
