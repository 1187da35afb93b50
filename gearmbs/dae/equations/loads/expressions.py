"""Expressions inside the equations: applied loads, general constraints and user-defined states."""

from __future__ import annotations

from gearmbs.dae.equations import layout as T
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.pointers import F8, I8, IVEC, MAT, VEC, address, caller
from gearmbs.kernels.structs import vector_at

_TABLES = (IVEC, VEC)
_STATE = (F8, MAT, IVEC, MAT, VEC, VEC)
KERNELS = {
    "eval_value": F8(*_TABLES, *_STATE, VEC),
    "eval_gradient": F8(*_TABLES, *_STATE, VEC, VEC),
    "eval_second": F8(*_TABLES, *_STATE, VEC, VEC, VEC),
    "eval_time": types.void(*_TABLES, F8, VEC, VEC),
    "update_angles": types.void(*_TABLES, *_STATE, VEC),
    "angle_rates": types.void(*_TABLES, *_STATE, VEC, VEC, VEC),
}
"""Kernels of `gearmbs.dae.equations.expressions` that the equations call, with their signatures."""
VALUE, GRADIENT, SECOND, TIME, ANGLES, ANGLE_RATES = range(T.TAPE_ADDRESS, T.TAPE_ADDRESS + T.TAPE_KERNELS)
value_at, gradient_at, second_at, time_at, angles_at, angle_rates_at = (caller(s) for s in KERNELS.values())


def addresses() -> list[int]:
    """Return the addresses of the kernels in this process, which loads them."""
    from gearmbs.dae.equations import expressions

    return [address(getattr(expressions, name), signature) for name, signature in KERNELS.items()]


LINE = 0
"""Force f along the line from J to I."""
AXIS_FORCE = 1
"""Force f along the z axis of marker RM."""
AXIS_TORQUE = 2
"""Torque f about the z axis of marker RM."""
COMPONENTS = 3
"""Force and torque components in the frame of marker RM."""

LOAD_MODE = 0
LOAD_TAPES = 1
"""Six tape numbers or -1, after the mode."""


@njit(cache=True, error_model="numpy")
def parts(k, tab):
    """Return the integers, the reals and the angle references of tape k."""
    row = tab.tape[k]
    i, r, a = row[T.TAPE_I], row[T.TAPE_R], row[T.TAPE_REFERENCE]
    return (
        vector_at(tab.extra_i, i, row[T.TAPE_I_SIZE]),
        vector_at(tab.extra_r, r, row[T.TAPE_R_SIZE]),
        vector_at(tab.extra_r, a, row[T.TAPE_REFERENCE_SIZE]),
    )


@njit(cache=True, error_model="numpy")
def value(k, t, y, tab):
    """Return the value of tape k."""
    ints, floats, ref = parts(k, tab)
    evaluate = value_at(tab.tape[k, VALUE])
    return evaluate(ints, floats, t, tab.kin, tab.marker_body, tab.marker, y, ref, tab.tape_work)


@njit(cache=True, error_model="numpy")
def gradient(k, t, y, tab, grad):
    """Return the value of tape k; write its spatial gradient to ``grad``."""
    ints, floats, ref = parts(k, tab)
    evaluate = gradient_at(tab.tape[k, GRADIENT])
    return evaluate(ints, floats, t, tab.kin, tab.marker_body, tab.marker, y, ref, grad, tab.tape_work)


@njit(cache=True, error_model="numpy")
def second(k, t, y, tab, grad, hess):
    """Return the value of tape k with gradient and Hessian over [R, theta] of its bodies and time."""
    ints, floats, ref = parts(k, tab)
    evaluate = second_at(tab.tape[k, SECOND])
    # functions of the user keep their derivatives at its end, where callers have gradient and Hessian
    work = vector_at(tab.tape_work, 0, tab.tape_work.size - grad.size - hess.size)
    return evaluate(ints, floats, t, tab.kin, tab.marker_body, tab.marker, y, ref, grad, hess, work)


@njit(cache=True, error_model="numpy")
def gradient_size(row):
    return 12 * row[T.TAPE_N_BODIES] + row[T.TAPE_N_UNKNOWNS]


@njit(cache=True, error_model="numpy")
def tail(tab, size):
    """Return ``size`` floats at the end of the tapes' scratch, which the evaluators leave alone."""
    return vector_at(tab.tape_work, tab.tape_work.size - size, size)


@njit(cache=True, error_model="numpy")
def update_references(t, y, tab, moving):
    """Keep the present value of every counted angle, and its rate if ``moving``; the tables must be up to date."""
    for k in range(tab.tape.shape[0]):
        if tab.tape[k, T.TAPE_REFERENCE_SIZE] > 0:
            ints, floats, ref = parts(k, tab)
            update = angles_at(tab.tape[k, ANGLES])
            update(ints, floats, t, tab.kin, tab.marker_body, tab.marker, y, ref, tab.tape_work)
            m = ref.size
            a = tab.tape[k, T.TAPE_REFERENCE] + m
            rates = vector_at(tab.extra_r, a + m, m)
            # one by one: setting a slice compiles how numba tells of shapes that differ, which takes 2 s
            for c in range(m):
                tab.extra_r[a + c], rates[c] = ref[c], 0.0
            if moving:
                grad = tail(tab, gradient_size(tab.tape[k]))
                find = angle_rates_at(tab.tape[k, ANGLE_RATES])
                find(ints, floats, t, tab.kin, tab.marker_body, tab.marker, y, ref, rates, grad, tab.tape_work)


@njit(cache=True, error_model="numpy")
def slot_of(tab, depends, body):
    """Return the place of a body in an element's dependency list."""
    for q in range(tab.extra_i[depends]):
        if tab.extra_i[depends + 1 + q] == body:
            return q
    return -1


@njit(cache=True, error_model="numpy")
def add_component(row, k, ex, ey, ez, first, t, y, tab, wrench, jac, want_jac):
    """Add tape k times the unit vector e to ``wrench[first:first+3]`` and e times its gradient to ``jac``; return f.

    Parameters
    ----------
    row : ndarray of int, shape (FORCE_COLUMNS,)
        The element's row of the force table.
    k : int
        Tape, whose value is f in N or N m.
    ex, ey, ez : float
        e, global components.
    first : int
        0 for a force, 3 for a torque.
    t, y : float, ndarray
        Time, s, and the unknowns.
    tab : Tables
    wrench : ndarray, shape (6,)
        F and N.
    jac : ndarray, shape (6, FORCE_WIDTH)
        Derivatives, columns as in `load`; left alone if ``want_jac`` is zero.
    want_jac : int
    """
    if want_jac == 0:
        f = value(k, t, y, tab)
    else:
        tape = tab.tape[k]
        grad = tail(tab, gradient_size(tape))
        f = gradient(k, t, y, tab, grad)
        depends = row[T.FORCE_DEPENDS]
        bodies = tab.extra_i[depends]
        for p in range(tape[T.TAPE_N_BODIES]):
            q = slot_of(tab, depends, tab.extra_i[tape[T.TAPE_BODIES] + p])
            for c in range(12):
                jac[first, 12 * q + c] += ex * grad[12 * p + c]
                jac[first + 1, 12 * q + c] += ey * grad[12 * p + c]
                jac[first + 2, 12 * q + c] += ez * grad[12 * p + c]
        own = 12 * tape[T.TAPE_N_BODIES]
        for p in range(tape[T.TAPE_N_UNKNOWNS]):
            unknown = tab.extra_i[tape[T.TAPE_BODIES] + tape[T.TAPE_N_BODIES] + p]
            for q in range(tab.extra_i[depends + 1 + bodies]):
                if tab.extra_i[depends + 2 + bodies + q] == unknown:
                    jac[first, 12 * bodies + q] += ex * grad[own + p]
                    jac[first + 1, 12 * bodies + q] += ey * grad[own + p]
                    jac[first + 2, 12 * bodies + q] += ez * grad[own + p]
    wrench[first] += f * ex
    wrench[first + 1] += f * ey
    wrench[first + 2] += f * ez
    return f


@njit(cache=True, error_model="numpy")
def turn_columns(jac, first, q, fx, fy, fz):
    """Add d(f e) = dpi x (f e) of a direction fixed in the body of block q."""
    c = 12 * q + 3
    jac[first, c + 1] += fz
    jac[first, c + 2] -= fy
    jac[first + 1, c] -= fz
    jac[first + 1, c + 2] += fx
    jac[first + 2, c] += fy
    jac[first + 2, c + 1] -= fx


@njit(cache=True, error_model="numpy")
def add_projector_columns(jac, q, factor, ex, ey, ez, frame, marker):
    """Add ``factor`` (1 - e e^T) dP to the force rows, P the origin of a marker on the body of block q.

    Parameters
    ----------
    jac : ndarray, shape (6, FORCE_WIDTH)
        Derivatives of F and N, 12 columns a block.
    q : int
        Place of the body in the dependency list.
    factor : float
        Force over length, N/m.
    ex, ey, ez : float
        Unit vector e, global components.
    frame : ndarray, shape (markers, MK_COLUMNS)
        Table of markers, up to date.
    marker : int
    """
    sx, sy, sz = frame[marker, 0], frame[marker, 1], frame[marker, 2]
    for r in range(3):
        er = ex if r == 0 else (ey if r == 1 else ez)
        px = factor * ((1.0 if r == 0 else 0.0) - er * ex)
        py = factor * ((1.0 if r == 1 else 0.0) - er * ey)
        pz = factor * ((1.0 if r == 2 else 0.0) - er * ez)
        c = 12 * q
        jac[r, c] += px
        jac[r, c + 1] += py
        jac[r, c + 2] += pz
        # p . (dpi x s) = dpi . (s x p)
        jac[r, c + 3] += sy * pz - sz * py
        jac[r, c + 4] += sz * px - sx * pz
        jac[r, c + 5] += sx * py - sy * px


@njit(cache=True, error_model="numpy")
def line_direction_columns(row, f, ex, ey, ez, length, tab, jac):
    """Add f d(e) for e = (P_I - P_J)/|P_I - P_J|: f/length times the projector normal to e.

    Parameters
    ----------
    row : ndarray of int, shape (FORCE_COLUMNS,)
        The element's row of the force table.
    f : float
        Force along e, N.
    ex, ey, ez : float
        e, global components.
    length : float
        |P_I - P_J|, m, not zero.
    tab : Tables
    jac : ndarray, shape (6, FORCE_WIDTH)
        Derivatives, columns as in `load`.
    """
    for side in range(2):
        marker = row[T.FORCE_I + side]
        body = tab.marker_body[marker]
        if body > 0:
            q = slot_of(tab, row[T.FORCE_DEPENDS], body)
            factor = (f if side == 0 else -f) / length
            add_projector_columns(jac, q, factor, ex, ey, ez, tab.frame, marker)


@njit(types.void(IVEC, F8, VEC, T.TABLES, VEC, MAT, I8), cache=True, late=True, error_model="numpy")
def load(row, t, y, tab, wrench, jac, want_jac):
    """Fill F and N of an expression element and, if wanted, their derivatives.

    The columns of ``jac`` are the 12 variations of each body of the dependency list, then its unknowns.
    """
    for c in range(6):
        wrench[c] = 0.0
    if want_jac != 0:
        for r in range(6):
            for c in range(jac.shape[1]):
                jac[r, c] = 0.0
    at = row[T.FORCE_IEXTRA] + 2
    mode = tab.extra_i[at + LOAD_MODE]
    if mode == LINE:
        i, j = row[T.FORCE_I], row[T.FORCE_J]
        ki, kj = tab.kin[tab.marker_body[i]], tab.kin[tab.marker_body[j]]
        ex = ki[0] + tab.frame[i, 0] - kj[0] - tab.frame[j, 0]
        ey = ki[1] + tab.frame[i, 1] - kj[1] - tab.frame[j, 1]
        ez = ki[2] + tab.frame[i, 2] - kj[2] - tab.frame[j, 2]
        length = (ex * ex + ey * ey + ez * ez) ** 0.5
        if length == 0.0:
            return
        ex, ey, ez = ex / length, ey / length, ez / length
        f = add_component(row, tab.extra_i[at + LOAD_TAPES], ex, ey, ez, 0, t, y, tab, wrench, jac, want_jac)
        if want_jac != 0:
            line_direction_columns(row, f, ex, ey, ez, length, tab, jac)
        return
    rm = row[T.FORCE_RM]
    body = tab.marker_body[rm]
    q = slot_of(tab, row[T.FORCE_DEPENDS], body)
    for c in range(6):
        k = tab.extra_i[at + LOAD_TAPES + c]
        if k < 0:
            continue
        axis = T.MK_AXES + 3 * (c % 3 if mode == COMPONENTS else 2)
        ex, ey, ez = tab.frame[rm, axis], tab.frame[rm, axis + 1], tab.frame[rm, axis + 2]
        first = 3 * (c // 3) if mode == COMPONENTS else (3 if mode == AXIS_TORQUE else 0)
        f = add_component(row, k, ex, ey, ez, first, t, y, tab, wrench, jac, want_jac)
        if want_jac != 0 and body > 0:
            turn_columns(jac, first, q, f * ex, f * ey, f * ez)
