"""Constraint rows between frames of which one at least is elastic: entries of the Jacobian and of the accelerations."""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import cross3, dot3
from gearmbs.dae.equations.elastic_coordinates import (
    FORCE,
    POSITION,
    VELOCITY,
    coordinates,
    curvature,
    direction,
    is_idle,
    place,
)
from gearmbs.dae.equations.elastic_frames import BIAS, DP, DX, is_elastic, partials, tail_of
from gearmbs.dae.equations.entries import put, put_pair
from gearmbs.dae.equations.rotation import KIN_R


@njit(cache=True, error_model="numpy", forceinline=True)
def seconds_with(i, same, linear, side, count):
    """Return first and last, plus one, of the coordinates by which, and by coordinate i, a row has second derivatives.

    Of a side that is linear in the displacement only angles, with angles or modes, have some. A row whose sides are all
    linear is their sum; see `put_row`. ``count`` is the number of coordinates of the other side.
    """
    if same and (linear >> side) & 1:
        return 3, 3 if i < 3 else count if i < 6 else 6
    return 0, count if same or linear != 3 else 0


@njit(cache=True, error_model="numpy", forceinline=True)
def dot6(a, i, b, j):
    """Return the product of ``a[i:i+6]`` and ``b[j:j+6]``."""
    total = 0.0
    for c in range(6):
        total += a[i + c] * b[j + c]
    return total


@njit(cache=True, error_model="numpy", forceinline=True)
def times_hessian(t, hess, width, first, out):
    """Write direction ``t[0:6]`` times the six rows of a Hessian from ``first`` on."""
    for c in range(out.size):
        out[c] = 0.0
        for m in range(6):
            out[c] += t[m] * hess[width * (first + m) + c]


@njit(cache=True, error_model="numpy")
def put_row(
    mode, slot, vals, k, frames, n_frames, linear, g, g_t, hess, width, coef, row, lam, mu, factor, rate_rows, y, at,
    partial,
):  # fmt: skip
    """Hand over the entries of a constraint row, its rate and its multipliers' forces; return the next entry's number.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`.
    frames, n_frames : ndarray of int, int
        The frames the row depends on.
    linear : int
        Sum of 1 << frame of those whose displacement alone, to first order, enters: modes have no second derivatives.
    g, g_t : ndarray
        Gradients of the row and of its partial time derivative by the frames' own coordinates, six each.
    hess, width : ndarray, int
        Hessian, and the length of its rows.
    coef : float
        Factor of ``g``, ``g_t`` and ``hess``.
    row : ndarray of int, shape (2,)
        Places of lambda and mu in y.
    lam, mu, factor : float
        Multipliers, and their derivative by the unknowns they are made from.
    rate_rows : bool
        Whether the formulation has mu and the rates of the constraints.
    y, at, partial : ndarray
        Unknowns, their places, the frames' partial derivatives.
    """
    t, s = np.empty(12), np.empty(3)
    left = np.empty(6 * n_frames)
    for a in range(n_frames):
        b = frames[a]
        blind = (linear >> a) & 1 == 1
        for i in range(coordinates(b, at)):
            # the gradient of a sum of linear sides is a unit vector for good
            if is_idle(b, i, blind, at, partial) or (linear == 3 and i < 3 and g[6 * a + i] == 0.0):
                continue
            direction(b, i, at, partial, t, 0)
            slope, rate = coef * dot6(g, 6 * a, t, 0), coef * dot6(g_t, 6 * a, t, 0)
            # a side that is linear has no Hessian by the coordinates of its frame, a sum of such sides none at all
            curved = linear != 3 or not is_elastic(b, at)
            if curved:
                times_hessian(t, hess, width, 6 * a, left)
            force, position = place(b, i, FORCE, at), place(b, i, POSITION, at)
            k = put(mode, slot, vals, k, row[0], position, slope)
            k = put(mode, slot, vals, k, force, row[0], factor * slope)
            for a2 in range(n_frames):
                b2 = frames[a2]
                begin, end = seconds_with(i, a == a2, linear, a, coordinates(b2, at))
                for j in range(begin, end):
                    if is_idle(b2, j, (linear >> a2) & 1 == 1, at, partial):
                        continue
                    value = 0.0
                    if curved:
                        direction(b2, j, at, partial, t, 6)
                        value += dot6(left, 6 * a2, t, 6)
                    if a == a2 and is_elastic(b, at):
                        value += curvature(b, i, j, g, 6 * a, at, partial, s)
                    value *= coef
                    rate += value * y[place(b2, j, VELOCITY, at)]
                    other = place(b2, j, POSITION, at)
                    k = put(mode, slot, vals, k, force, other, lam * value)
                    if rate_rows:
                        k = put(mode, slot, vals, k, position, other, -mu * value)
            if rate_rows:
                k = put(mode, slot, vals, k, position, row[1], -factor * slope)
                k = put(mode, slot, vals, k, row[1], place(b, i, VELOCITY, at), slope)
                k = put(mode, slot, vals, k, row[1], position, rate)
    return k


@njit(cache=True, error_model="numpy")
def put_spatial(mode, slot, vals, k, row, f, g, h, coef, at, kin, partial):
    """Hand over Phi_q of one elastic frame in the acceleration system, and its mirror image.

    Parameters
    ----------
    row : int
        Row of the constraint.
    g, h : ndarray, int
        ``g[h:h+6]`` is the gradient by displacement and rotation of the frame, ``coef`` its factor.
    """
    s = np.empty(9)
    body = at[f, T.AT_BODY]
    for c in range(3):
        s[c] = kin[f, KIN_R + c] - kin[body, KIN_R + c]
    cross3(s, 0, g, h, s, 3)
    v = at[f, T.AT_V]
    for c in range(3):
        k = put_pair(mode, slot, vals, k, row, v + c, coef * g[h + c])
        k = put_pair(mode, slot, vals, k, row, v + 3 + c, coef * (s[3 + c] + g[h + 3 + c]))
    d = partials(f, at, partial)
    for m in range(at[f, T.AT_MODES]):
        slope = dot3(d[3 + m], DP, g, h) + dot3(d[3 + m], DX, g, h + 3)
        k = put_pair(mode, slot, vals, k, row, at[f, T.AT_V_MODES] + m, coef * slope)
    return k


@njit(cache=True, error_model="numpy")
def bias_rate(f, g, h, at, partial):
    """Return what a frame's acceleration without those of the coordinates adds to the second rate of a constraint."""
    first = tail_of(f, at) + BIAS
    return dot3(g, h, partial, first) + dot3(g, h + 3, partial, first + 3)
