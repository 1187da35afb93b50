"""The piece of a bending rim from its definition, against complex steps of the formulas along frames and states."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.contact.ring import derived as D
from gearmbs.contact.ring.kernel import PHASE, ROWS, SUMS, UNIT, WAVES, shapes, sum_up

STEP = 1e-30
RADIUS = 0.12
MODES = 4


def arrangement(seed):
    """Return frames of planet and ring, states, the modes' table and a wrench."""
    rng = np.random.default_rng(seed)
    rows = np.zeros((2, 18))
    rows[:, 3:12] = Rotation.random(2, random_state=seed).as_matrix().reshape(2, 9)
    rows[:, :3], rows[:, 12:] = rng.normal(scale=0.1, size=(2, 3)), rng.normal(size=(2, 6))
    table = np.ones((ROWS, MODES))
    table[WAVES], table[PHASE], table[UNIT] = [2, 2, 3, 3], [0, 1, 0, 1], 1e-3
    return rows, rng.normal(size=2 * MODES), table, rng.normal(size=6)


def varied(rows, change):
    """Return both frames after a complex step along their 24 variations."""
    moved = rows.astype(complex)
    for row, part in zip(moved, change.reshape(2, 4, 3)):
        row[:3] += 1j * STEP * part[0]
        row[3:12] += 1j * STEP * np.cross(part[1], row[3:12].reshape(3, 3), axisb=0, axisc=0).ravel()
        row[12:18] += 1j * STEP * part[2:].ravel()
    return moved


def by_formulas(rows, states, table, load):
    """Return theta, the piece's origin, velocity and angular velocity, the planet's wrench and its parts, complex."""
    planet, ring = rows
    axes, arm = ring[3:12].reshape(3, 3).T, planet[:3] - ring[:3]
    # the angle of a complex number, as a function of complex numbers
    x, y = axes[0] @ arm, axes[1] @ arm
    theta = np.arctan(y / x) + (np.pi if x.real < 0.0 else 0.0)
    phi, shape, pose, acting = (np.zeros(n, dtype=complex) for n in ((MODES, 4), SUMS, 18, 6))
    shapes.py_func(theta, table, phi)
    sum_up.py_func(states, table, RADIUS, phi, shape)
    D.piece.py_func(planet, ring, shape, pose)
    parts = D.handed_on.py_func(planet, ring, shape, load, acting)
    return np.array([theta, *pose[:3], *pose[12:], *acting, *parts]), pose[3:12].reshape(3, 3)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_derivatives_along_frames_states_and_load(seed):
    rows, states, table, load = arrangement(seed)
    phi, shape, d_shape = (np.zeros(n) for n in ((MODES, 4), SUMS, SUMS))
    shapes(D.place(*rows), table, phi)
    sum_up(states, table, RADIUS, phi, shape)
    piece, handed = np.zeros((13, 24 + SUMS)), np.zeros((9, 30 + SUMS))
    D.slopes(*rows, shape, load, piece, handed)
    rng = np.random.default_rng(100 + seed)
    for _ in range(4):
        dx, d_load = rng.normal(size=24 + 2 * MODES), rng.normal(size=6)
        sum_up(dx[24:], table, RADIUS, phi, d_shape)
        moved_piece = piece @ [*dx[:24], *d_shape]
        moved = varied(rows, dx[:24]), states + 1j * STEP * dx[24:]
        value, axes = by_formulas(*moved, table, load + 1j * STEP * d_load)
        exact = value.imag / STEP
        found = np.array([*moved_piece[:4], *moved_piece[7:], *(handed @ [*dx[:24], *d_shape, *d_load])])
        assert found == pytest.approx(exact, rel=1e-10, abs=1e-12 * np.abs(exact).max())
        # dA A^T is the skew matrix of the turn
        spin = (axes.imag / STEP) @ axes.real.T
        turned = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        assert moved_piece[4:7] == pytest.approx(turned, rel=1e-10, abs=1e-12)
