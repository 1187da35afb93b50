"""A gear pair's contact as a plain function of the state, and derivatives of it by differences."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import gear_contact
from gearmbs.gears import GearPair
from gearmbs.gears.transmission import StaticMesh

STEPS = {0: 2e-8, 1: 4e-7, 2: 4e-5, 3: 4e-4}  # by kind of variation: m, rad, m/s, rad/s


def rotation(vector: np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector."""
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


class Contact:
    """The kernel bound to the tables of one pair. A state is [R1, A1, v1, w1, R2, A2, v2, w2]."""

    def __init__(self, pair: GearPair, slices: int | None = None) -> None:
        self.pair = pair
        self.mesh = StaticMesh(pair, slices)
        self.gi, self.gr, size = pair.contact_tables(slices)
        self.work = np.zeros(size)
        self.jac = np.zeros((6, 24))
        self.diag = np.zeros(8)

    def __call__(self, state: list[np.ndarray], want: int = 0) -> np.ndarray:
        wrench = np.zeros(6)
        args = [np.ascontiguousarray(a) for a in state]
        gear_contact(self.gi, self.gr, *args, wrench, self.jac, self.diag, want, self.work)
        return wrench

    def energy(self, state: list[np.ndarray]) -> float:
        self(state)
        return float(self.diag[0])

    def state(self, driver_angle: float, depth: float, speed: float = 0.0) -> list[np.ndarray]:
        """Wheels on their axes, turned ``depth`` (m at the base circle) beyond touching, at a driver speed."""
        pair = self.pair
        turn = pair.sign * pair.rotation * depth / pair.driven.base_radius
        place = pair.frames(driver_angle, self.mesh.touching_angle(driver_angle) + turn)
        spin = pair.rotation * speed
        w1 = spin * place.axes_1[:, 2]
        w2 = -pair.sign * spin / pair.ratio * place.axes_2[:, 2]
        zero = np.zeros(3)
        return [place.origin_1, place.axes_1, zero, w1, place.origin_2, place.axes_2, zero, w2]


def shaken(state: list[np.ndarray], rng: np.random.Generator, shift=1e-5, turn=1e-4, speed=2e-3, spin=0.05):
    """The state with random small changes of poses and velocities, seen from a random frame."""
    new = [a.copy() for a in state]
    for b in (0, 4):
        new[b] += rng.normal(size=3) * shift
        new[b + 1] = rotation(rng.normal(size=3) * turn) @ new[b + 1]
        new[b + 2] = new[b + 2] + rng.normal(size=3) * speed
        new[b + 3] = new[b + 3] + rng.normal(size=3) * spin
    return moved(new, rotation(rng.normal(size=3)), rng.normal(size=3) * 0.1)


def moved(state: list[np.ndarray], turn: np.ndarray, shift: np.ndarray) -> list[np.ndarray]:
    """The state seen from a rotated and shifted frame."""
    return [turn @ a + shift if k in (0, 4) else turn @ a for k, a in enumerate(state)]


def varied(state: list[np.ndarray], column: int, step: float) -> list[np.ndarray]:
    """The state after one of the 24 spatial variations."""
    new = [a.copy() for a in state]
    block = 4 * (column // 12)
    kind, axis = divmod(column % 12, 3)
    change = np.zeros(3)
    change[axis] = step
    k = block + kind
    new[k] = rotation(change) @ new[k] if kind == 1 else new[k] + change
    return new


def differences(function, state: list[np.ndarray], share: float = 1.0) -> np.ndarray:
    """Derivatives by the 24 spatial variations, central differences of sixth order with a share of the usual step."""
    columns = []
    for j in range(24):
        h = share * STEPS[(j % 12) // 3]
        f = [function(varied(state, j, m * h)) for m in (1, -1, 2, -2, 3, -3)]
        columns.append((45 * (f[0] - f[1]) - 9 * (f[2] - f[3]) + (f[4] - f[5])) / (60 * h))
    return np.array(columns).T
