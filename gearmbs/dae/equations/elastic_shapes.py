"""Shapes of the modes at a marker: their table, and where they move and turn it in its body."""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.compiled.lanes import LANES, all_lanes, lanes_at, put_lanes
from gearmbs.dae.compiled.views import matrix_at, vector_at
from gearmbs.dae.equations import layout as T

SMALL_TURN = 1e-3
"""Angle below which the series of cosine and sine, three terms each, are exact to rounding."""


def shape_table(position: np.ndarray, phi: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """Return the numbers of an elastic frame as the kernels read them.

    They are s0, then x, y and z of phi_k and psi_k, an entry for each mode, and once more by modes in lanes: s0, then
    phi_k and psi_k.

    Parameters
    ----------
    position : ndarray, shape (3,)
        s0.
    phi, psi : ndarray, shape (n, 3)
        Displacement and rotation shapes.
    """
    both = np.hstack([phi, psi])
    lanes = np.zeros((1 + len(both), LANES))
    lanes[0, :3], lanes[1:, :6] = position, both
    return np.concatenate([position, both.T.ravel(), lanes.ravel()])


@njit(cache=True, error_model="numpy", forceinline=True)
def shapes_of(f, at, modal):
    """Return phi_k and psi_k of elastic frame f: x, y and z of both, six rows with an entry for each mode."""
    return matrix_at(modal, at[f, T.AT_SHAPE] + 3, 6, at[f, T.AT_MODES])


@njit(cache=True, error_model="numpy", forceinline=True)
def sine_and_cosine(angle):
    """Return sine and cosine, of small angles by their series."""
    if abs(angle) >= SMALL_TURN:
        return np.sin(angle), np.cos(angle)
    square = angle * angle
    return angle * (1.0 - square * (1.0 / 6.0 - square / 120.0)), 1.0 - square * (0.5 - square / 24.0)


@njit(cache=True, error_model="numpy")
def deform(f, y, at, modal, axes, partial, s):
    """Write where a marker has moved and turned in its body, and the axes of its rotation.

    Parameters
    ----------
    f : int
        Row of the frame.
    y
        Unknowns.
    at, modal : ndarray
        Places, and the table with the marker's shapes.
    axes, partial : int, ndarray
        Place of the axes Y_c, and the table of partial derivatives.
    s : ndarray
        Written: arm in ``s[0:3]``, its rate in ``s[3:6]``, the rates of the angles in ``s[6:9]``, R_x R_y R_z by
        rows in ``s[9:18]``; body components. Then scratch of two lanes.
    """
    n = at[f, T.AT_MODES]
    shape = vector_at(modal, at[f, T.AT_SHAPE] + 3 + 6 * n, LANES * (1 + n))
    amounts, rates = vector_at(y, at[f, T.AT_QF], n), vector_at(y, at[f, T.AT_VF], n)
    moved, moving = lanes_at(shape, 0), all_lanes(0.0)
    for k in range(n):
        of_mode = lanes_at(shape, 1 + k)
        moved = moved + of_mode * amounts[k]
        moving = moving + of_mode * rates[k]
    both = vector_at(s, 18, 2 * LANES)
    put_lanes(both, 0, moved)
    put_lanes(both, 1, moving)
    for c in range(3):
        s[c], s[3 + c], s[6 + c] = both[c], both[LANES + c], both[LANES + 3 + c]
    sx, cx = sine_and_cosine(both[3])
    sy, cy = sine_and_cosine(both[4])
    sz, cz = sine_and_cosine(both[5])
    partial[axes], partial[axes + 1], partial[axes + 2] = 1.0, 0.0, 0.0
    partial[axes + 3], partial[axes + 4], partial[axes + 5] = 0.0, cx, sx
    partial[axes + 6], partial[axes + 7], partial[axes + 8] = sy, -sx * cy, cx * cy
    s[9], s[10], s[11] = cy * cz, -cy * sz, sy
    s[12], s[13], s[14] = cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -sx * cy
    s[15], s[16], s[17] = sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy
