"""The tape's evaluators: value and reverse-mode gradient.

The gradient runs the tape backwards (adjoints), so its cost does not grow with the number of bodies. Derivatives in
time are in `evaluate_time`, Hessians in `evaluate_second`.
"""

from __future__ import annotations

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.integrals import external, integral
from gearmbs.dae.equations.expressions.measure_gradients import (
    cosine_gradient,
    euler_parameter_gradient,
    force_gradient,
    radial_gradient,
    vector_gradient,
)
from gearmbs.dae.equations.expressions.measures import (
    AXIS,
    VECTOR,
    euler_parameter,
    marker_axis,
    radial_velocity,
    relative_vector,
    resolve,
)
from gearmbs.dae.equations.expressions.opcodes import KIN_V, KIN_W
from gearmbs.dae.equations.expressions.scalar import binary, unary, unwrap_angle
from gearmbs.dae.equations.expressions.spline_value import spline_value
from gearmbs.kernels.jit import njit

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
        # cosine of the angle between two axes
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
def selected(ints, at, work):
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
def forward(ints, floats, t, kin, acc, marker_body, marker_frame, y, ref, work, order):
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
    # behind values, and first and second partials of each instruction by its one or two operands
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
                scratch = work[work.size - ints[op.HEAD_EXTERNAL] - n :]
                d = (integral(ints, floats, t, ints[at + 1], ints[at + 2], scratch), 0.0, 0.0)
            else:
                d = unary(code, a, float(ints[at + 2]))
            # f(a): value, f_a, f_aa; of a second operand there is nothing
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
            # f(a, b): value, f_a, f_b, f_aa, f_ab, f_bb
            work[k] = e[0]
            if order > 0:
                work[n + k] = e[1]
                work[2 * n + k] = e[2]
                if order > 1:
                    work[3 * n + k] = e[3]
                    work[4 * n + k] = e[4]
                    work[5 * n + k] = e[5]
        elif code == op.EXTERNAL:
            work[k] = external(ints, at, t, order if order < 2 else op.ALL_SECOND, work)
        else:
            work[k] = work[selected(ints, at, work)]
        at += op.WIDTH


@njit("void(int64[::1], float64[::1], int64, int64)", cache=True, nogil=True, error_model="numpy")
def backward(ints, work, adjoint, result):
    """Write the adjoint of every register to ``work[adjoint:]``."""
    n = ints[op.HEAD_COUNT]
    for k in range(n):
        work[adjoint + k] = 0.0
    work[adjoint + result] = 1.0
    for k in range(n - 1, -1, -1):
        # adjoint of k: derivative of the result by it, complete as all that use it come later on the tape
        g = work[adjoint + k]
        if g == 0.0:
            continue
        at = ints[op.HEAD_CODE] + op.WIDTH * k
        code = ints[at]
        if code <= op.LAST_LEAF:
            continue
        if code == op.SELECT:
            work[adjoint + selected(ints, at, work)] += g
            continue
        if code == op.EXTERNAL:
            # behind the value of a function of the user stand its partials
            partials = work.size - ints[op.HEAD_EXTERNAL] + ints[at + 3] + ints[at + 2] + 1
            for i in range(ints[at + 2]):
                work[adjoint + ints[ints[at + 1] + i]] += g * work[partials + i]
            continue
        # an operand's adjoint gains that of the instruction times f_a; infinite partials of what does not count are
        # left out
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
    forward(ints, floats, t, kin, kin, marker_body, marker_frame, y, ref, work, 0)
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
    ints, floats, t, kin, marker_body, marker_frame, y, ref, work
        As of `eval_value`.
    acc : ndarray, shape (bodies, 6)
        Accelerations a and alpha of the bodies; not used where none are asked for.
    """
    forward(ints, floats, t, kin, acc, marker_body, marker_frame, y, ref, work, 0)
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
    # variations of the bodies come first, then unknowns
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
    ints, floats, t, kin, marker_body, marker_frame, y, ref, work
        As of `eval_value`.
    grad : ndarray
        Receives the gradient: 12 spatial variations of each body of the tape, then its unknowns.
    """
    forward(ints, floats, t, kin, kin, marker_body, marker_frame, y, ref, work, 1)
    backward(ints, work, 3 * ints[op.HEAD_COUNT], ints[op.HEAD_RESULT])
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
    ints, floats, t, kin, marker_body, marker_frame, y, ref, work
        As of `eval_value`.
    rates : ndarray
        Receives the rates, rad/s.
    grad : ndarray
        Scratch of the size of the gradient.
    """
    if ints[op.HEAD_ANGLES] == 0:
        return
    n = ints[op.HEAD_COUNT]
    forward(ints, floats, t, kin, kin, marker_body, marker_frame, y, ref, work, 1)
    for k in range(n):
        at = ints[op.HEAD_CODE] + op.WIDTH * k
        if ints[at] != op.UNWRAP:
            continue
        backward(ints, work, 3 * n, k)
        _scatter(ints, kin, marker_body, marker_frame, y, grad, work)
        rate = 0.0
        for p in range(ints[op.HEAD_BODIES]):
            b = ints[ints[op.HEAD_BODY_LIST] + p]
            for c in range(3):
                rate += grad[12 * p + c] * kin[b, KIN_V + c] + grad[12 * p + 3 + c] * kin[b, KIN_W + c]
        rates[ints[at + 2]] = rate


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
    ints, floats, t, kin, marker_body, marker_frame, y, ref, work
        As of `eval_value`.
    """
    if ints[op.HEAD_ANGLES] == 0:
        return
    forward(ints, floats, t, kin, kin, marker_body, marker_frame, y, ref, work, 0)
    at = ints[op.HEAD_CODE]
    for k in range(ints[op.HEAD_COUNT]):
        if ints[at] == op.UNWRAP:
            ref[ints[at + 2]] = work[k]
        at += op.WIDTH
