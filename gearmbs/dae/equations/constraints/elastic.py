"""Constraint rows between frames of which one at least is elastic: entries of the Jacobian and of the accelerations."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.frames import (
    BIAS,
    DP,
    DV,
    DX,
    FORCE,
    POSITION,
    VELOCITY,
    coordinates,
    curvature,
    direction,
    is_elastic,
    is_idle,
    partials,
    place,
    tail_of,
)
from gearmbs.dae.equations.constraints.terms import cross3, dot3
from gearmbs.dae.equations.rotation import KIN_R
from gearmbs.dae.equations.unknowns import put, put_pair
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.pointers import F8, I8, IMAT, IVEC, MAT, VEC
from gearmbs.kernels.structs import uncounted, uncounted_rows


@njit(cache=True, error_model="numpy", forceinline=True)
def has_second(i, j, same, linear, side):
    """Return whether a row has a second derivative by coordinates i and j of its sides.

    Of a side that is linear in the displacement only angles, with angles or modes, have some. A row whose sides are all
    linear is their sum; see `put_row`. ``same`` says whether both coordinates are of the frame on ``side``.
    """
    if same and (linear >> side) & 1:
        return min(i, j) >= 3 and min(i, j) < 6
    return same or linear != 3


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
        As of `gearmbs.dae.equations.unknowns.put`.
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
    slot, vals, y, partial, at = uncounted(slot), uncounted(vals), uncounted(y), uncounted(partial), uncounted_rows(at)
    g, g_t, hess = uncounted(g), uncounted(g_t), uncounted(hess)
    total = 0
    for a in range(n_frames):
        total += coordinates(frames[a], at)
    side, own = np.empty(total, dtype=np.int64), np.empty(total, dtype=np.int64)
    along, left, rates = np.empty((total, 6)), np.empty((total, 6 * n_frames)), np.empty(total)
    count = 0
    for a in range(n_frames):
        b = frames[a]
        if linear == 3 and is_elastic(b, at):
            k = put_linear_side(
                mode, slot, vals, k, b, g, g_t, 6 * a, coef, row[0], row[1], lam, mu, factor, rate_rows, at, partial
            )  # fmt: skip
            continue
        for i in range(coordinates(b, at)):
            # the gradient of a sum of linear sides is constant
            if is_idle(b, i, (linear >> a) & 1 == 1, at, partial) or (linear == 3 and i < 3 and g[6 * a + i] == 0.0):
                continue
            side[count], own[count] = a, i
            direction(b, i, at, partial, along[count], 0)
            times_hessian(along[count], hess, width, 6 * a, left[count])
            rates[count] = coef * dot6(g_t, 6 * a, along[count], 0)
            count += 1
    k = put_seconds(
        mode, slot, vals, k, frames, linear, g, coef, lam, mu, rate_rows, y, at, partial, side[:count], own, along,
        left, rates,
    )  # fmt: skip
    for p in range(count):
        b, i = frames[side[p]], own[p]
        slope = coef * dot6(g, 6 * side[p], along[p], 0)
        position = place(b, i, POSITION, at)
        k = put(mode, slot, vals, k, row[0], position, slope)
        k = put(mode, slot, vals, k, place(b, i, FORCE, at), row[0], factor * slope)
        if rate_rows:
            k = put(mode, slot, vals, k, position, row[1], -factor * slope)
            k = put(mode, slot, vals, k, row[1], place(b, i, VELOCITY, at), slope)
            k = put(mode, slot, vals, k, row[1], position, rates[p])
    return k


@njit(cache=True, error_model="numpy")
def put_seconds(
    mode, slot, vals, k, frames, linear, g, coef, lam, mu, rate_rows, y, at, partial, side, own, along, left, rates,
):  # fmt: skip
    """Hand over the second derivatives of a row, once for both orders, and add them to its rate's derivatives.

    Parameters
    ----------
    mode, slot, vals, k, frames, linear, g, coef, lam, mu, rate_rows, y, at, partial
        As of `put_row`.
    side, own : ndarray of int, shape (m,)
        Which frame, and which coordinate of it, each of the row's coordinates is.
    along, left : ndarray, shape (m, 6), (m, 6 frames)
        Directions T, and T times the Hessian.
    rates : ndarray, shape (m,)
        Derivatives of the row's rate by the coordinates; changed.
    """
    slot, vals, y, partial, at = uncounted(slot), uncounted(vals), uncounted(y), uncounted(partial), uncounted_rows(at)
    g, side, own, rates = uncounted(g), uncounted(side), uncounted(own), uncounted(rates)
    along, left, s = uncounted_rows(along), uncounted_rows(left), np.empty(3)
    for p in range(side.size):
        b, i = frames[side[p]], own[p]
        force, position, speed = place(b, i, FORCE, at), place(b, i, POSITION, at), y[place(b, i, VELOCITY, at)]
        elastic = is_elastic(b, at)
        for q in range(p, side.size):
            same = side[q] == side[p]
            b2, j = frames[side[q]], own[q]
            if not has_second(i, j, same, linear, side[p]):
                continue
            value = dot6(left[p], 6 * side[q], along[q], 0)
            if same and elastic:
                value += curvature(b, i, j, g, 6 * side[p], at, partial, s)
            value *= coef
            other_force, other = place(b2, j, FORCE, at), place(b2, j, POSITION, at)
            rates[p] += value * y[place(b2, j, VELOCITY, at)]
            k = put(mode, slot, vals, k, force, other, lam * value)
            if rate_rows:
                k = put(mode, slot, vals, k, position, other, -mu * value)
            if q == p:
                continue
            rates[q] += value * speed
            k = put(mode, slot, vals, k, other_force, position, lam * value)
            if rate_rows:
                k = put(mode, slot, vals, k, other, position, -mu * value)
    return k


@njit(
    I8(I8, IVEC, VEC, I8, I8, VEC, VEC, I8, F8, I8, I8, F8, F8, F8, types.boolean, IMAT, VEC),
    cache=True,
    late=True,
    error_model="numpy",
)
def put_linear_side(
    mode, slot, vals, k, b, g, g_t, first, coef, row_lam, row_mu, lam, mu, factor, rate_rows, at, partial
):
    """Hand over what elastic frame b gives to a row that is a sum of sides linear in displacements; see `put_row`.

    With g the constant gradient, the second derivatives are g . (X_lo x P_hi) = X_lo . (P_hi x g), of angles with
    angles or modes, and the derivatives of the rate are g . dV.

    Parameters
    ----------
    b : int
        The frame.
    first : int
        Where its part of the gradients ``g`` and ``g_t`` begins.
    row_lam, row_mu : int
        Places of lambda and mu in y.
    """
    slot, vals, partial, at = uncounted(slot), uncounted(vals), uncounted(partial), uncounted_rows(at)
    d = partials(b, at, partial)
    gx, gy, gz = g[first], g[first + 1], g[first + 2]
    for i in range(coordinates(b, at)):
        # the gradient is constant
        if is_idle(b, i, True, at, partial) or (i < 3 and g[first + i] == 0.0):
            continue
        force, position = place(b, i, FORCE, at), place(b, i, POSITION, at)
        slope, rate = g[first + i] if i < 3 else dot3(g, first, d[i - 3], DP), 0.0
        if i < 3:
            rate = g_t[first + i]
        else:
            rate = dot3(g, first, d[i - 3], DV) + dot6(g_t, first, d[i - 3], DP)
        slope, rate = coef * slope, coef * rate
        k = put(mode, slot, vals, k, row_lam, position, slope)
        k = put(mode, slot, vals, k, force, row_lam, factor * slope)
        if rate_rows:
            k = put(mode, slot, vals, k, position, row_mu, -factor * slope)
            k = put(mode, slot, vals, k, row_mu, place(b, i, VELOCITY, at), slope)
            k = put(mode, slot, vals, k, row_mu, position, rate)
        if i < 3:
            continue
        # P x g
        p = d[i - 3]
        x, y_, z = p[DP + 1] * gz - p[DP + 2] * gy, p[DP + 2] * gx - p[DP] * gz, p[DP] * gy - p[DP + 1] * gx
        for j in range(3, min(i + 1, 6)):
            a = d[j - 3]
            value = coef * (a[DX] * x + a[DX + 1] * y_ + a[DX + 2] * z)
            other_force, other = place(b, j, FORCE, at), place(b, j, POSITION, at)
            k = put(mode, slot, vals, k, other_force, position, lam * value)
            if rate_rows:
                k = put(mode, slot, vals, k, other, position, -mu * value)
            if j != i:
                k = put(mode, slot, vals, k, force, other, lam * value)
                if rate_rows:
                    k = put(mode, slot, vals, k, position, other, -mu * value)
    return k


@njit(I8(I8, IVEC, VEC, I8, I8, I8, VEC, I8, F8, IMAT, MAT, VEC), cache=True, late=True, error_model="numpy")
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
        if at[f, T.AT_ANGLES] > 0:
            k = put_pair(mode, slot, vals, k, row, v + 3 + c, coef * (s[3 + c] + g[h + 3 + c]))
    d = partials(f, at, partial)
    for m in range(at[f, T.AT_MODES]):
        slope = dot3(d[3 + m], DP, g, h) + dot3(d[3 + m], DX, g, h + 3)
        k = put_pair(mode, slot, vals, k, row, at[f, T.AT_V_MODES] + m, coef * slope)
    return k


@njit(F8(I8, VEC, I8, IMAT, VEC), cache=True, late=True, error_model="numpy")
def bias_rate(f, g, h, at, partial):
    """Return what a frame's acceleration without those of the coordinates adds to the second rate of a constraint."""
    first = tail_of(f, at) + BIAS
    return dot3(g, h, partial, first) + dot3(g, h + 3, partial, first + 3)
