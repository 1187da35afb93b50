"""Chain rule from an elastic frame's own six coordinates to those of its body: angles, displacement and modes.

The derivatives are T_c and what the Hessian has beyond T_c H T_d, both of `gearmbs.dae.equations.elastic_frames`.
"""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import cross3, dot3
from gearmbs.dae.equations.elastic_frames import DP, DX, PAIRS, PSI, is_elastic, partials, tail_of

POSITION, VELOCITY, FORCE = 0, 1, 2


@njit(cache=True, error_model="numpy")
def coordinates(b, at):
    """Return the number of coordinates that a frame's position depends on: none of the ground."""
    if b == 0:
        return 0
    return 6 + at[b, T.AT_MODES] if is_elastic(b, at) else 6


@njit(cache=True, error_model="numpy")
def place(b, i, which, at):
    """Return where the position, the velocity or the force row of coordinate i of a frame is in y."""
    if i < 3:
        return (at[b, T.AT_R] if which == POSITION else at[b, T.AT_U]) + i
    if i < 6:
        column = T.AT_THETA if which == POSITION else T.AT_EPS if which == VELOCITY else T.AT_P
        return at[b, column] + i - 3
    column = T.AT_QF if which == POSITION else T.AT_VF if which == VELOCITY else T.AT_PF
    return at[b, column] + i - 6


@njit(cache=True, error_model="numpy")
def direction(b, i, at, partial, out, k):
    """Write T_i, the derivative of a frame's own coordinates by coordinate i of its body, to ``out[k:k+6]``.

    A rigid body's own coordinates are R and theta, so T_i is a unit vector.
    """
    for c in range(6):
        out[k + c] = 0.0
    if i < 3 or not is_elastic(b, at):
        out[k + i] = 1.0
        return
    row = partials(b, at, partial)[i - 3]
    for c in range(6):
        out[k + c] = row[DP + c]


@njit(cache=True, error_model="numpy")
def curvature(b, i, j, g, k, at, partial, s):
    """Return what the Hessian by coordinates i, j of an elastic frame's body has beyond T_i H T_j.

    Parameters
    ----------
    b : int
        The frame.
    i, j : int
        Coordinates, 3 or more: a displacement has none.
    g : ndarray
        ``g[k:k+6]`` is the gradient by the frame's own coordinates.
    s : ndarray
        Scratch, 3 places.
    """
    if i < 3 or j < 3:
        return 0.0
    d = partials(b, at, partial)
    lo, hi = min(i, j) - 3, max(i, j) - 3
    total = 0.0
    if lo < 3:
        cross3(d[lo], DX, d[hi], DP, s, 0)
        total += dot3(g, k, s, 0)
    x, y = d[lo], d[hi]
    if lo < 3:
        cross3(x, DX, y, DX, s, 0)
    else:
        turned_twice(b, x, y, at, partial, s)
    s[0] -= x[DX + 1] * y[DX + 2] + x[DX + 2] * y[DX + 1]
    s[1] += x[DX] * y[DX + 2] + x[DX + 2] * y[DX]
    s[2] -= x[DX] * y[DX + 1] + x[DX + 1] * y[DX]
    return total + 0.5 * dot3(g, k + 3, s, 0)


@njit(cache=True, error_model="numpy", forceinline=True)
def turned_twice(b, x, y, at, partial, s):
    """Write sum_mn psi_k,m psi_l,n Y_min x Y_max to ``s[0:3]``, given the rows of modes k and l."""
    pairs = tail_of(b, at) + PAIRS
    xy = x[PSI] * y[PSI + 1] + x[PSI + 1] * y[PSI]
    xz = x[PSI] * y[PSI + 2] + x[PSI + 2] * y[PSI]
    yz = x[PSI + 1] * y[PSI + 2] + x[PSI + 2] * y[PSI + 1]
    for c in range(3):
        s[c] = xy * partial[pairs + c] + xz * partial[pairs + 3 + c] + yz * partial[pairs + 6 + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def turns(d):
    """Return whether a mode turns a frame, given its row of the partial derivatives."""
    return d[PSI] != 0.0 or d[PSI + 1] != 0.0 or d[PSI + 2] != 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def is_idle(b, i, blind, at, partial):
    """Return whether coordinate i of a frame's body is a mode that does not move the frame, and if not blind turns it.

    Shapes that are zero stay so in all positions.
    """
    if i < 6:
        return False
    d = partials(b, at, partial)[i - 3]
    if d[DP] != 0.0 or d[DP + 1] != 0.0 or d[DP + 2] != 0.0:
        return False
    return blind or not turns(d)
