"""A bearing's kernel called as a function of two frames, and its derivatives by differences."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from gearmbs.bearings import Bearing, RollingBearing
from gearmbs.bearings.kernel import bearing_force
from gearmbs.bearings.layout import scratch
from gearmbs.dae.equations.loads.forces import DERIVATIVES, DIAGNOSTICS
from gearmbs.mechanism import Mechanism


class Probe:
    """Frames of both rings, states, and the kernel over them."""

    def __init__(self, bearing: Bearing, **settings) -> None:
        m = Mechanism()
        self.element = RollingBearing("b", m.ground.marker(), m.ground.marker(), bearing, **settings)
        self.tables = self.element.tables
        self.states = np.array([s.start for s in self.element.states])
        self.frames = np.zeros((2, 18))
        self.frames[:, 3:12] = np.eye(3).ravel()
        self.work = np.zeros(scratch(len(self.tables.spinning)))

    def __call__(self, frames=None, states=None, want=DERIVATIVES | DIAGNOSTICS):
        frames = self.frames if frames is None else frames
        states = self.states if states is None else states
        n = states.size
        wrench, rates = np.zeros((1, 6)), np.zeros(n)
        jac, told = np.zeros((6 + n, 24 + n)), np.zeros(7)
        self.work[:] = np.nan
        bearing_force(
            self.tables.integers, self.tables.reals, 0.0, frames, states, np.zeros(0), want, self.work, wrench, rates,
            jac, told,
        )  # fmt: skip
        return np.concatenate([wrench[0], rates]), jac, told

    def shaken(self, rng: np.random.Generator, way: float, tilt: float, speed: float) -> None:
        """Put both frames somewhere, turned and moving, the rings a little apart."""
        base = Rotation.random(random_state=rng)
        for k in range(2):
            lean = rng.normal(size=3) * tilt * (k == 0)
            turn = Rotation.from_rotvec(lean) * Rotation.from_rotvec([0, 0, rng.uniform(0, 6.28)])
            self.frames[k, 3:12] = (base * turn).as_matrix().ravel()
        self.frames[1, :3] = 0.01 * rng.normal(size=3)
        self.frames[0, :3] = self.frames[1, :3] + base.apply(way * rng.normal(size=3))
        common = rng.normal(size=6) * np.repeat([1.0, 3.0], 3)
        arm = self.frames[0, :3] - self.frames[1, :3]
        for k in range(2):
            self.frames[k, 12:] = common
        self.frames[0, 12:15] += np.cross(common[3:], arm) + 1e-2 * rng.normal(size=3)
        self.frames[0, 15:] += base.apply([0.1 * rng.normal(), 0.1 * rng.normal(), speed])
        self.states[:] = rng.uniform(0.0, 6.28, self.states.size)

    def varied(self, column: int, h: float):
        """Return frames and states with one variation of size h."""
        frames, states = self.frames.copy(), self.states.copy()
        if column >= 24:
            states[column - 24] += h
            return frames, states
        k, c = divmod(column, 12)
        if c < 3:
            frames[k, c] += h
        elif c < 6:
            turn = Rotation.from_rotvec(h * np.eye(3)[c - 3]).as_matrix()
            frames[k, 3:12] = (turn @ frames[k, 3:12].reshape(3, 3)).ravel()
        else:
            frames[k, c + 6] += h
        return frames, states

    def differences(self, steps=(1e-8, 1e-7, 1e-4, 1e-3), state_step=1e-7) -> np.ndarray:
        """Return the derivatives by central differences of fourth order."""
        n = self.states.size
        out = np.zeros((6 + n, 24 + n))
        for column in range(24 + n):
            h = state_step if column >= 24 else steps[column % 12 // 3]
            for shift, weight in ((1, 8.0), (-1, -8.0), (2, -1.0), (-2, 1.0)):
                out[:, column] += weight * self(*self.varied(column, shift * h), want=0)[0]
            out[:, column] /= 12.0 * h
        return out
