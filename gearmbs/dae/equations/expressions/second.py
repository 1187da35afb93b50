"""Value, gradient and Hessian of an expression of positions and time, for constraint rows.

The Hessian adds, for every instruction, its second partials times the gradients of its operands, weighted with its
adjoint:  H = sum_k adj_k sum_jl f_jl grad_j grad_l^T.
"""

from __future__ import annotations

import math

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.evaluate import STATE, TABLES, backward, forward, selected
from gearmbs.dae.equations.expressions.integrals import external, integral
from gearmbs.dae.equations.expressions.measure_hessians import leaf_gradient, leaf_hessian
from gearmbs.dae.equations.expressions.scalar import binary, unary
from gearmbs.dae.equations.expressions.spline_value import spline_value
from gearmbs.kernels.jit import njit


@njit(
    "void(int64[::1], int64, int64, int64, float64[::1], float64[:, ::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _combine_rows(ints, at, k, n, work, rows):
    """Write the forward gradient of a scalar instruction from those of its operands."""
    columns = rows.shape[1]
    count = ints[op.HEAD_COUNT]
    if ints[at] == op.SELECT:
        s = selected(ints, at, work)
        for q in range(columns):
            rows[k, q] = rows[s, q]
        return
    if ints[at] == op.EXTERNAL:
        partials = work.size - ints[op.HEAD_EXTERNAL] + ints[at + 3] + ints[at + 2] + 1
        rows[k, :] = 0.0
        for i in range(ints[at + 2]):
            operand = ints[ints[at + 1] + i]
            for q in range(columns):
                if rows[operand, q] != 0.0:
                    rows[k, q] += work[partials + i] * rows[operand, q]
        return
    a = ints[at + 1]
    if ints[at] == op.INTEGRAL:
        for q in range(columns):
            rows[k, q] = 0.0
        # an integral over time has its integrand for its rate, and no other derivative
        rows[k, columns - 1] = work[a]
        return
    # chain rule: grad f = f_a grad a + f_b grad b
    pa = work[count + k]
    for q in range(columns):
        rows[k, q] = pa * rows[a, q] if rows[a, q] != 0.0 else 0.0
    if ints[at] >= op.FIRST_BINARY:
        b = ints[at + 2]
        pb = work[2 * count + k]
        for q in range(columns):
            if rows[b, q] != 0.0:
                rows[k, q] += pb * rows[b, q]


@njit("void(int64[::1], int64, float64, float64[::1], float64[:, ::1], float64[:, ::1])", cache=True, nogil=True)
def _external_curvature(ints, at, weight, work, rows, hess):
    """Add the second partials of a function of the user, times its operands' gradients, to the Hessian."""
    n = ints[at + 2]
    second = work.size - ints[op.HEAD_EXTERNAL] + ints[at + 3] + 2 * n + 1
    for i in range(n):
        a = ints[ints[at + 1] + i]
        for j in range(n):
            b = ints[ints[at + 1] + j]
            curvature = weight * work[second + n * i + j]
            if curvature == 0.0:
                continue
            for p in range(rows.shape[1]):
                if rows[a, p] == 0.0:
                    continue
                for q in range(rows.shape[1]):
                    hess[p, q] += curvature * rows[a, p] * rows[b, q]


@njit("void(int64[::1], int64, int64, float64, float64[::1], float64[:, ::1], float64[:, ::1])", cache=True, nogil=True)
def _curvature(ints, at, k, weight, work, rows, hess):
    """Add the second partials of a scalar instruction, times its operands' gradients, to the Hessian."""
    count = ints[op.HEAD_COUNT]
    if ints[at] == op.EXTERNAL:
        _external_curvature(ints, at, weight, work, rows, hess)
        return
    # f_aa grad a grad a^T + f_bb grad b grad b^T + f_ab (grad a grad b^T + grad b grad a^T)
    aa, ab, bb = work[3 * count + k], work[4 * count + k], work[5 * count + k]
    if ints[at] == op.INTEGRAL:
        last = rows.shape[1] - 1
        hess[last, last] += weight * rows[ints[at + 1], last]
        return
    if ints[at] == op.SELECT or (aa == 0.0 and ab == 0.0 and bb == 0.0):
        return
    a = ints[at + 1]
    b = ints[at + 2] if ints[at] >= op.FIRST_BINARY else a
    for p in range(rows.shape[1]):
        ap, bp = rows[a, p], rows[b, p]
        if ap == 0.0 and bp == 0.0:
            continue
        for q in range(rows.shape[1]):
            aq, bq = rows[a, q], rows[b, q]
            s = 0.0
            if ap != 0.0 and aq != 0.0:
                s += aa * ap * aq
            if bp != 0.0 and bq != 0.0:
                s += bb * bp * bq
            if ab != 0.0:
                s += ab * (ap * bq + bp * aq)
            hess[p, q] += weight * s


@njit(f"float64({TABLES}, float64, {STATE}, float64[::1], float64[::1], float64[::1])", cache=True, nogil=True)
def eval_second(ints, floats, t, kin, marker_body, marker_frame, y, ref, grad, hess, work):
    """Return the value with gradient and Hessian in generalized coordinates and time.

    With n = 6 n_bodies + 1, ``grad[0:n]`` and ``hess[0:n*n]`` (row-major) are ordered
    [R(3), theta(3)] body by body, then t.  ``kin`` must hold the Euler axes (``KIN_AXES``).  Only
    position-level leaves are allowed; the parser checks that (``Tape.level``).

    Parameters
    ----------
    ints, floats, t, kin, marker_body, marker_frame, y, ref, work
        As of `eval_value`.
    grad : ndarray
        Receives the gradient over R and theta of the bodies of the tape, and time.
    hess : ndarray
        Receives the Hessian over R and theta of the bodies of the tape, and time, row by row.
    """
    count = ints[op.HEAD_COUNT]
    columns = 6 * ints[op.HEAD_BODIES] + 1
    forward(ints, floats, t, kin, kin, marker_body, marker_frame, y, ref, work, 2)
    adjoint = 6 * count
    backward(ints, work, adjoint, ints[op.HEAD_RESULT])
    rows = work[7 * count : 7 * count + count * columns].reshape((count, columns))
    leaf = work[7 * count + count * columns :]
    h = hess[: columns * columns].reshape((columns, columns))
    h[:, :] = 0.0
    at = ints[op.HEAD_CODE]
    for k in range(count):
        code = ints[at]
        if code == op.DISPLACEMENT or code == op.COSINE:
            leaf_gradient(ints, at, kin, marker_body, marker_frame, leaf, rows, k)
        elif code <= op.LAST_LEAF:
            for q in range(columns):
                rows[k, q] = 0.0
            if code == op.TIME:
                rows[k, columns - 1] = 1.0
            elif code != op.CONST:
                for q in range(columns):
                    rows[k, q] = math.nan
        else:
            _combine_rows(ints, at, k, count, work, rows)
        at += op.WIDTH
    at = ints[op.HEAD_CODE]
    for k in range(count):
        weight = work[adjoint + k]
        if weight != 0.0:
            code = ints[at]
            if code == op.DISPLACEMENT or code == op.COSINE:
                leaf_hessian(ints, at, weight, kin, marker_body, marker_frame, leaf, h)
            elif code > op.LAST_LEAF:
                _curvature(ints, at, k, weight, work, rows, h)
        at += op.WIDTH
    r = ints[op.HEAD_RESULT]
    for q in range(columns):
        grad[q] = rows[r, q]
    return work[r]


# An expression of TIME alone, with its first and second derivative: a Taylor series carried through the tape.


@njit(f"void({TABLES}, float64, float64[::1], float64[::1])", cache=True, nogil=True, error_model="numpy")
def eval_time(ints, floats, t, out, work):
    """Write f, f', f'' of an expression of TIME alone to ``out[0:3]``."""
    n = ints[op.HEAD_COUNT]
    at = ints[op.HEAD_CODE]
    for k in range(n):
        code = ints[at]
        f, f1, f2 = math.nan, math.nan, math.nan
        if code == op.CONST:
            f, f1, f2 = floats[ints[at + 1]], 0.0, 0.0
        elif code == op.TIME:
            f, f1, f2 = t, 1.0, 0.0
        elif op.FIRST_UNARY <= code <= op.LAST_UNARY:
            a = ints[at + 1]
            d = (0.0, 0.0, 0.0) if code == op.INTEGRAL else unary(code, work[a], float(ints[at + 2]))
            f = d[0]
            f1 = f2 = 0.0
            if code == op.INTEGRAL:
                f = integral(ints, floats, t, a, ints[at + 2], work[work.size - ints[op.HEAD_EXTERNAL] - n :])
                f1, f2 = work[a], work[n + a]
            elif work[n + a] != 0.0 or work[2 * n + a] != 0.0:
                f1 = d[1] * work[n + a]
                f2 = d[2] * work[n + a] ** 2 + d[1] * work[2 * n + a]
        elif op.FIRST_BINARY <= code <= op.LAST_BINARY:
            a, b = ints[at + 1], ints[at + 2]
            if code == op.SPLINE:
                e = spline_value(floats, ints[at + 3], ints[at + 4], work[a], work[b])
            else:
                e = binary(code, work[a], work[b])
            a1, a2, b1, b2 = work[n + a], work[2 * n + a], work[n + b], work[2 * n + b]
            f = e[0]
            f1 = f2 = 0.0
            if a1 != 0.0 or a2 != 0.0:
                f1 += e[1] * a1
                f2 += e[3] * a1 * a1 + e[1] * a2
            if b1 != 0.0 or b2 != 0.0:
                f1 += e[2] * b1
                f2 += e[5] * b1 * b1 + e[2] * b2
            if a1 != 0.0 and b1 != 0.0:
                f2 += 2.0 * e[4] * a1 * b1
        elif code == op.EXTERNAL:
            # of time alone, its first argument
            f = external(ints, at, t, op.FIRST_SECOND, work)
            a = ints[ints[at + 1]]
            first = work.size - ints[op.HEAD_EXTERNAL] + ints[at + 3] + ints[at + 2] + 1
            f1 = work[first] * work[n + a]
            f2 = work[first + 1] * work[n + a] ** 2 + work[first] * work[2 * n + a]
        elif code == op.SELECT:
            s = selected(ints, at, work)
            f, f1, f2 = work[s], work[n + s], work[2 * n + s]
        work[k], work[n + k], work[2 * n + k] = f, f1, f2
        at += op.WIDTH
    r = ints[op.HEAD_RESULT]
    out[0], out[1], out[2] = work[r], work[n + r], work[2 * n + r]
