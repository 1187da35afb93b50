"""The tape's evaluators: value, reverse-mode gradient, Taylor series in time, second derivatives.

The gradient runs the tape backwards (adjoints), so its cost does not grow with the number of
bodies; the Hessian adds, for every instruction, its second partials times the gradients of its
operands, weighted with its adjoint:  H = sum_k adj_k sum_jl f_jl grad_j grad_l^T.
"""

from __future__ import annotations

import math

from gearmbs._jit import njit
from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.integrals import integral
from gearmbs.dae.equations.expressions.marker_motion import KIN_V, KIN_W
from gearmbs.dae.equations.expressions.measure_gradients import (
    cosine_gradient,
    euler_parameter_gradient,
    force_gradient,
    radial_gradient,
    vector_gradient,
)
from gearmbs.dae.equations.expressions.measure_hessians import leaf_gradient, leaf_hessian, leaf_jacobians
from gearmbs.dae.equations.expressions.measures import (
    AXIS,
    LEAF_WORK,
    VECTOR,
    euler_parameter,
    marker_axis,
    radial_velocity,
    relative_vector,
    resolve,
)
from gearmbs.dae.equations.expressions.scalar import binary, unary, unwrap_angle
from gearmbs.dae.equations.expressions.splines import spline_value

JACOBIAN_AT = LEAF_WORK + 6
"""Where a leaf's Jacobian blocks stand in its scratch."""

TABLES = "int64[::1], float64[::1]"
STATE = "float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[::1]"


@njit(
    "float64(int64[::1], int64, float64[:, ::1], float64[:, ::1], int64[::1], float64[:, ::1], float64[::1],"
    " float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _leaf_value(ints, at, kin, acc, marker_body, marker_frame, y, w):
    """Return the value of a leaf that depends on bodies or on algebraic unknowns.

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    at : int
        Offset of the leaf in ``ints``.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    acc : ndarray, shape (bodies, 6)
        Accelerations a and alpha of the bodies; not used where none are asked for.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    y : ndarray
        Unknowns, for states and for loads asked for by name.
    w : ndarray
        Scratch of a leaf, its vectors of three at the offsets of `measures`.
    """
    code = ints[at]
    if code == op.ALGEBRAIC:
        return y[ints[ints[op.HEAD_ALGEBRAIC_LIST] + ints[at + 1]]]
    if code == op.COSINE:
        marker_axis(ints[at + 1], ints[at + 2], kin, marker_body, marker_frame, w, AXIS)
        marker_axis(ints[at + 3], ints[at + 4], kin, marker_body, marker_frame, w, VECTOR)
        return w[AXIS] * w[VECTOR] + w[AXIS + 1] * w[VECTOR + 1] + w[AXIS + 2] * w[VECTOR + 2]
    if code == op.RADIAL_VELOCITY:
        return radial_velocity(ints[at + 1], ints[at + 2], kin, marker_body, marker_frame, w)
    if code == op.EULER_PARAMETER:
        return euler_parameter(ints[at + 1], ints[at + 2], ints[at + 3], kin, marker_body, marker_frame, w)
    if code == op.FORCE:
        first = ints[op.HEAD_ALGEBRAIC_LIST] + ints[at + 1]
        for c in range(3):
            w[VECTOR + c] = y[ints[first + c]]
    else:
        relative_vector(code, ints[at + 1], ints[at + 2], ints[at + 3], kin, acc, marker_body, marker_frame, w)
    return resolve(ints[at + 4], ints[at + 5], kin, marker_body, marker_frame, w)


@njit("int64(int64[::1], int64, float64[::1])", cache=True, nogil=True)
def _selected(ints, at, work):
    """Return the register an IF takes its value from."""
    c = work[ints[at + 1]]
    if c < 0.0:
        return ints[at + 2]
    if c > 0.0:
        return ints[at + 4]
    return ints[at + 3]


@njit(
    "void(int64[::1], float64[::1], float64, float64[:, ::1], float64[:, ::1], int64[::1], float64[:, ::1],"
    " float64[::1], float64[::1], float64[::1], int64)",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _forward(ints, floats, t, kin, acc, marker_body, marker_frame, y, ref, work, order):
    """Run the tape: values to work[0:n]; first partials behind them for order 1, second for order 2.

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    floats : ndarray
        Real table of the expression (`Tape.floats`).
    t : float
        Time, s.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    acc : ndarray, shape (bodies, 6)
        Accelerations a and alpha of the bodies; not used where none are asked for.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    y : ndarray
        Unknowns, for states and for loads asked for by name.
    ref : ndarray
        References of the counted angles.
    work : ndarray
        Scratch, `Tape.work_size` entries.
    order : int
        Highest order of the derivatives, 0 to 2.
    """
    n = ints[op.HEAD_COUNT]
    at = ints[op.HEAD_CODE]
    leaf = work[n * (1 if order == 0 else (3 if order == 1 else 6)) :]
    for k in range(n):
        code = ints[at]
        if code == op.CONST:
            work[k] = floats[ints[at + 1]]
        elif code == op.TIME:
            work[k] = t
        elif code <= op.LAST_LEAF:
            work[k] = _leaf_value(ints, at, kin, acc, marker_body, marker_frame, y, leaf)
        elif code <= op.LAST_UNARY:
            a = work[ints[at + 1]]
            if code == op.UNWRAP:
                d = (unwrap_angle(a, ref[ints[at + 2]]), 1.0, 0.0)
            elif code == op.INTEGRAL:
                d = (integral(ints, floats, t, ints[at + 1], ints[at + 2], work[work.size - n :]), 0.0, 0.0)
            else:
                d = unary(code, a, float(ints[at + 2]))
            work[k] = d[0]
            if order > 0:
                work[n + k] = d[1]
                work[2 * n + k] = 0.0
                if order > 1:
                    work[3 * n + k] = d[2]
                    work[4 * n + k] = 0.0
                    work[5 * n + k] = 0.0
        elif code <= op.LAST_BINARY:
            a, b = work[ints[at + 1]], work[ints[at + 2]]
            if code == op.SPLINE:
                e = spline_value(floats, ints[at + 3], ints[at + 4], a, b)
            else:
                e = binary(code, a, b)
            work[k] = e[0]
            if order > 0:
                work[n + k] = e[1]
                work[2 * n + k] = e[2]
                if order > 1:
                    work[3 * n + k] = e[3]
                    work[4 * n + k] = e[4]
                    work[5 * n + k] = e[5]
        else:
            work[k] = work[_selected(ints, at, work)]
        at += op.WIDTH


@njit("void(int64[::1], float64[::1], int64, int64)", cache=True, nogil=True, error_model="numpy")
def _backward(ints, work, adjoint, result):
    """Write the adjoint of every register to ``work[adjoint:]``."""
    n = ints[op.HEAD_COUNT]
    for k in range(n):
        work[adjoint + k] = 0.0
    work[adjoint + result] = 1.0
    for k in range(n - 1, -1, -1):
        g = work[adjoint + k]
        if g == 0.0:
            continue
        at = ints[op.HEAD_CODE] + op.WIDTH * k
        code = ints[at]
        if code <= op.LAST_LEAF:
            continue
        if code == op.SELECT:
            work[adjoint + _selected(ints, at, work)] += g
            continue
        if work[n + k] != 0.0:
            work[adjoint + ints[at + 1]] += g * work[n + k]
        if code >= op.FIRST_BINARY and work[2 * n + k] != 0.0:
            work[adjoint + ints[at + 2]] += g * work[2 * n + k]


@njit(f"float64({TABLES}, float64, {STATE}, float64[::1])", cache=True, nogil=True, error_model="numpy")
def eval_value(ints, floats, t, kin, marker_body, marker_frame, y, ref, work):
    """Return the expression's value; accelerations are not available here (see ``eval_request``).

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    floats : ndarray
        Real table of the expression (`Tape.floats`).
    t : float
        Time, s.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    y : ndarray
        Unknowns, for states and for loads asked for by name.
    ref : ndarray
        References of the counted angles.
    work : ndarray
        Scratch, `Tape.work_size` entries.
    """
    _forward(ints, floats, t, kin, kin, marker_body, marker_frame, y, ref, work, 0)
    return work[ints[op.HEAD_RESULT]]


@njit(
    "float64(int64[::1], float64[::1], float64, float64[:, ::1], float64[:, ::1], int64[::1], float64[:, ::1],"
    " float64[::1], float64[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def eval_request(ints, floats, t, kin, acc, marker_body, marker_frame, y, ref, work):
    """Return the expression's value with the accelerations ``acc`` (one row a body: a, alpha).

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    floats : ndarray
        Real table of the expression (`Tape.floats`).
    t : float
        Time, s.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    acc : ndarray, shape (bodies, 6)
        Accelerations a and alpha of the bodies; not used where none are asked for.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    y : ndarray
        Unknowns, for states and for loads asked for by name.
    ref : ndarray
        References of the counted angles.
    work : ndarray
        Scratch, `Tape.work_size` entries.
    """
    _forward(ints, floats, t, kin, acc, marker_body, marker_frame, y, ref, work, 0)
    return work[ints[op.HEAD_RESULT]]


@njit(
    "void(int64[::1], float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _scatter(ints, kin, marker_body, marker_frame, y, grad, work):
    """Write the gradient from the leaves' adjoints, which stand at work[3 n:]."""
    n = ints[op.HEAD_COUNT]
    first = 12 * ints[op.HEAD_BODIES]
    for c in range(first + ints[op.HEAD_ALGEBRAIC]):
        grad[c] = 0.0
    leaf = work[4 * n :]
    at = ints[op.HEAD_CODE]
    for k in range(n):
        code = ints[at]
        g = work[3 * n + k]
        if g != 0.0 and op.ALGEBRAIC <= code <= op.LAST_LEAF:
            if code == op.ALGEBRAIC:
                grad[first + ints[at + 1]] += g
            elif code == op.COSINE:
                cosine_gradient(ints, at, g, kin, marker_body, marker_frame, leaf, grad)
            elif code == op.RADIAL_VELOCITY:
                radial_gradient(ints, at, g, kin, marker_body, marker_frame, leaf, grad)
            elif code == op.EULER_PARAMETER:
                euler_parameter_gradient(ints, at, g, kin, marker_body, marker_frame, leaf, grad)
            elif code == op.FORCE:
                list_at = ints[op.HEAD_ALGEBRAIC_LIST] + ints[at + 1]
                for c in range(3):
                    leaf[VECTOR + c] = y[ints[list_at + c]]
                force_gradient(ints, at, g, kin, marker_body, marker_frame, leaf, grad, first)
            elif code <= op.ANGULAR_VELOCITY:
                vector_gradient(ints, at, g, kin, marker_body, marker_frame, leaf, grad)
        at += op.WIDTH


@njit(f"float64({TABLES}, float64, {STATE}, float64[::1], float64[::1])", cache=True, nogil=True, error_model="numpy")
def eval_gradient(ints, floats, t, kin, marker_body, marker_frame, y, ref, grad, work):
    """Return the value and write its gradient.

    ``grad[12 p + 0:12]`` holds the derivatives by [dR, dpi, dv, dw] of the p-th body of the tape's
    list, ``grad[12 n_bodies + q]`` the derivative by its q-th algebraic unknown.

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    floats : ndarray
        Real table of the expression (`Tape.floats`).
    t : float
        Time, s.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    y : ndarray
        Unknowns, for states and for loads asked for by name.
    ref : ndarray
        References of the counted angles.
    grad : ndarray
        Receives the gradient: 12 spatial variations of each body of the tape, then its unknowns.
    work : ndarray
        Scratch, `Tape.work_size` entries.
    """
    _forward(ints, floats, t, kin, kin, marker_body, marker_frame, y, ref, work, 1)
    _backward(ints, work, 3 * ints[op.HEAD_COUNT], ints[op.HEAD_RESULT])
    _scatter(ints, kin, marker_body, marker_frame, y, grad, work)
    return work[ints[op.HEAD_RESULT]]


@njit(
    f"void({TABLES}, float64, {STATE}, float64[::1], float64[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def angle_rates(ints, floats, t, kin, marker_body, marker_frame, y, ref, rates, grad, work):
    """Write the time rates of the tape's counted angles to ``rates``; ``grad`` is scratch of the gradient's size.

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    floats : ndarray
        Real table of the expression (`Tape.floats`).
    t : float
        Time, s.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    y : ndarray
        Unknowns, for states and for loads asked for by name.
    ref : ndarray
        References of the counted angles.
    rates : ndarray
        Receives the rates, rad/s.
    grad : ndarray
        Scratch of the size of the gradient.
    work : ndarray
        Scratch, `Tape.work_size` entries.
    """
    if ints[op.HEAD_ANGLES] == 0:
        return
    n = ints[op.HEAD_COUNT]
    _forward(ints, floats, t, kin, kin, marker_body, marker_frame, y, ref, work, 1)
    for k in range(n):
        at = ints[op.HEAD_CODE] + op.WIDTH * k
        if ints[at] != op.UNWRAP:
            continue
        _backward(ints, work, 3 * n, k)
        _scatter(ints, kin, marker_body, marker_frame, y, grad, work)
        rate = 0.0
        for p in range(ints[op.HEAD_BODIES]):
            b = ints[ints[op.HEAD_BODY_LIST] + p]
            for c in range(3):
                rate += grad[12 * p + c] * kin[b, KIN_V + c] + grad[12 * p + 3 + c] * kin[b, KIN_W + c]
        rates[ints[at + 2]] = rate


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
                f = integral(ints, floats, t, a, ints[at + 2], work[work.size - n :])
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
        elif code == op.SELECT:
            s = _selected(ints, at, work)
            f, f1, f2 = work[s], work[n + s], work[2 * n + s]
        work[k], work[n + k], work[2 * n + k] = f, f1, f2
        at += op.WIDTH
    r = ints[op.HEAD_RESULT]
    out[0], out[1], out[2] = work[r], work[n + r], work[2 * n + r]


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
        s = _selected(ints, at, work)
        for q in range(columns):
            rows[k, q] = rows[s, q]
        return
    a = ints[at + 1]
    if ints[at] == op.INTEGRAL:
        for q in range(columns):
            rows[k, q] = 0.0
        rows[k, columns - 1] = work[a]
        return
    pa = work[count + k]
    for q in range(columns):
        rows[k, q] = pa * rows[a, q] if rows[a, q] != 0.0 else 0.0
    if ints[at] >= op.FIRST_BINARY:
        b = ints[at + 2]
        pb = work[2 * count + k]
        for q in range(columns):
            if rows[b, q] != 0.0:
                rows[k, q] += pb * rows[b, q]


@njit("void(int64[::1], int64, int64, float64, float64[::1], float64[:, ::1], float64[:, ::1])", cache=True, nogil=True)
def _curvature(ints, at, k, weight, work, rows, hess):
    """Add the second partials of a scalar instruction, times its operands' gradients, to the Hessian."""
    count = ints[op.HEAD_COUNT]
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
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    floats : ndarray
        Real table of the expression (`Tape.floats`).
    t : float
        Time, s.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    y : ndarray
        Unknowns, for states and for loads asked for by name.
    ref : ndarray
        References of the counted angles.
    grad : ndarray
        Receives the gradient over R and theta of the bodies of the tape, and time.
    hess : ndarray
        Receives the Hessian over R and theta of the bodies of the tape, and time, row by row.
    work : ndarray
        Scratch, `Tape.work_size` entries.
    """
    count = ints[op.HEAD_COUNT]
    columns = 6 * ints[op.HEAD_BODIES] + 1
    _forward(ints, floats, t, kin, kin, marker_body, marker_frame, y, ref, work, 2)
    adjoint = 6 * count
    _backward(ints, work, adjoint, ints[op.HEAD_RESULT])
    rows = work[7 * count : 7 * count + count * columns].reshape((count, columns))
    leaf = work[7 * count + count * columns :]
    h = hess[: columns * columns].reshape((columns, columns))
    h[:, :] = 0.0
    at = ints[op.HEAD_CODE]
    for k in range(count):
        code = ints[at]
        if code == op.DISPLACEMENT or code == op.COSINE:
            leaf_jacobians(ints, at, kin, marker_body, marker_frame, leaf, JACOBIAN_AT, columns)
            leaf_gradient(ints, at, kin, marker_body, marker_frame, leaf, JACOBIAN_AT, columns, rows, k)
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
                leaf_hessian(ints, at, weight, kin, marker_body, marker_frame, leaf, JACOBIAN_AT, columns, rows, k, h)
            elif code > op.LAST_LEAF:
                _curvature(ints, at, k, weight, work, rows, h)
        at += op.WIDTH
    r = ints[op.HEAD_RESULT]
    for q in range(columns):
        grad[q] = rows[r, q]
    return work[r]


@njit(
    f"void({TABLES}, float64, {STATE}, float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def update_angles(ints, floats, t, kin, marker_body, marker_frame, y, ref, work):
    """Move the reference of every wound angle to its present value; call it after an accepted step.

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    floats : ndarray
        Real table of the expression (`Tape.floats`).
    t : float
        Time, s.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    y : ndarray
        Unknowns, for states and for loads asked for by name.
    ref : ndarray
        References of the counted angles.
    work : ndarray
        Scratch, `Tape.work_size` entries.
    """
    if ints[op.HEAD_ANGLES] == 0:
        return
    _forward(ints, floats, t, kin, kin, marker_body, marker_frame, y, ref, work, 0)
    at = ints[op.HEAD_CODE]
    for k in range(ints[op.HEAD_COUNT]):
        if ints[at] == op.UNWRAP:
            ref[ints[at + 2]] = work[k]
        at += op.WIDTH
