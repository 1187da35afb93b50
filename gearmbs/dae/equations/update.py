"""From y to the kinematics table and the marker frames."""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.dae.compiled.lanes import LANES
from gearmbs.dae.compiled.sines import put_turns
from gearmbs.dae.compiled.views import vector_at
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations import time_functions
from gearmbs.dae.equations.constraint_terms import dot3
from gearmbs.dae.equations.counted_angles import predict_element_angles
from gearmbs.dae.equations.elastic_frames import update_frame
from gearmbs.dae.equations.expression_loads import TIME, time_at
from gearmbs.dae.equations.modal_inertia import add_momentum, update_inertia
from gearmbs.dae.equations.rotation import (
    KIN_A,
    KIN_AXES,
    KIN_H,
    KIN_R,
    KIN_V,
    KIN_W,
    axes_of,
    matrix_of,
)

TURNS_OF_TWO = 2 * LANES
"""Places for sines and cosines of the angles of two bodies."""


@njit(cache=True, error_model="numpy", forceinline=True)
def inertia_times(kin_row, body_row, v, i, out, k, s):
    """Write J_global v to ``out[k:k+3]``; ``s`` has three scratch places."""
    for c in range(3):
        s[c] = kin_row[KIN_A + c] * v[i] + kin_row[KIN_A + 3 + c] * v[i + 1] + kin_row[KIN_A + 6 + c] * v[i + 2]
    q = T.BODY_INERTIA
    x = dot3(body_row, q, s, 0)
    y = dot3(body_row, q + 3, s, 0)
    z = dot3(body_row, q + 6, s, 0)
    for c in range(3):
        a = KIN_A + 3 * c
        out[k + c] = kin_row[a] * x + kin_row[a + 1] * y + kin_row[a + 2] * z


@njit(cache=True, error_model="numpy", forceinline=True)
def update_ground(kin):
    """Set the ground's row: the global frame at rest, with no Euler axes."""
    row = kin[0]
    for c in range(row.size):
        row[c] = 0.0
    row[KIN_A] = row[KIN_A + 4] = row[KIN_A + 8] = 1.0


@njit(cache=True, error_model="numpy", forceinline=True)
def update_bodies(y, at, code, body, modal, kin, partial, scratch, derivatives):
    """Fill the kinematics table from the positions and velocities in y.

    Parameters
    ----------
    y
        Unknowns.
    at, code, body : ndarray
        Places of the unknowns, Euler references, masses and inertias.
    modal, partial : ndarray
        Integrals and shapes of modal bodies, partial derivatives of their frames.
    kin : ndarray
        Kinematics table.
    scratch : ndarray
        52 places.
    derivatives : bool
        Whether the velocities' derivatives and the accelerations of elastic frames are wanted.
    """
    update_ground(kin)
    moment = vector_at(scratch, TURNS_OF_TWO, 3)
    for b in range(1, code.size):
        if at[b, T.AT_MODES] > 0:
            update_inertia(y, at[b], modal, partial, body[b])
        place = 3 * ((b - 1) % 2)
        if place == 0:
            put_turns(y, at[b, T.AT_THETA], at[min(b + 1, code.size - 1), T.AT_THETA], scratch)
        u, e, r = at[b, T.AT_U], at[b, T.AT_EPS], at[b, T.AT_R]
        row = kin[b]
        for c in range(3):
            row[KIN_R + c] = y[r + c]
            row[KIN_V + c] = y[u + c]
        turn_1 = scratch[LANES + place], scratch[place]
        turn_2 = scratch[LANES + place + 1], scratch[place + 1]
        turn_3 = scratch[LANES + place + 2], scratch[place + 2]
        matrix_of(turn_1, turn_2, turn_3, code[b], row, KIN_A)
        axes_of(turn_1, turn_2, y[e], y[e + 1], y[e + 2], row)
        inertia_times(row, body[b], row, KIN_W, row, KIN_H, moment)
        if at[b, T.AT_MODES] > 0:
            add_momentum(y, at[b], partial, row)
    for f in range(code.size, at.shape[0]):
        update_frame(f, y, at, modal, kin, partial, scratch, derivatives)


@njit(cache=True, error_model="numpy", forceinline=True)
def update_marker(m, marker_body, marker, kin, frame):
    """Fill one row of the marker table: arm and axes in global components."""
    row, own, out = kin[marker_body[m]], marker[m], frame[m]
    # copied out, or the compiler reads them anew after each number that is written
    xx, xy, xz = row[KIN_A], row[KIN_A + 1], row[KIN_A + 2]
    yx, yy, yz = row[KIN_A + 3], row[KIN_A + 4], row[KIN_A + 5]
    zx, zy, zz = row[KIN_A + 6], row[KIN_A + 7], row[KIN_A + 8]
    for v in range(4):
        # the arm, then the columns of a row-major matrix
        at, step = (0, 1) if v == 0 else (2 + v, 3)
        a, b, c = own[at], own[at + step], own[at + 2 * step]
        k = T.MK_ARM + 3 * v
        out[k] = xx * a + xy * b + xz * c
        out[k + 1] = yx * a + yy * b + yz * c
        out[k + 2] = zx * a + zy * b + zz * c


@njit(cache=True, error_model="numpy", forceinline=True)
def update_markers(marker_body, marker, kin, frame):
    """Fill the marker table."""
    for m in range(marker_body.size):
        update_marker(m, marker_body, marker, kin, frame)


@njit(cache=True, error_model="numpy", forceinline=True)
def update_functions(t, tab):
    """Evaluate every function of time with two derivatives into the function table."""
    for k in range(tab.function.shape[0]):
        kind, at = tab.function[k, T.FUNCTION_KIND], tab.function[k, T.FUNCTION_OFFSET]
        if kind == time_functions.TAPE:
            row = tab.tape[at]
            i, r = row[T.TAPE_I], row[T.TAPE_R]
            time_at(row[TIME])(
                vector_at(tab.extra_i, i, row[T.TAPE_I_SIZE]),
                vector_at(tab.extra_r, r, row[T.TAPE_R_SIZE]),
                t,
                tab.fval[k],
                tab.tape_work,
            )
        else:
            f, f1, f2 = time_functions.evaluate(kind, tab.function_r, at, t)
            tab.fval[k, 0], tab.fval[k, 1], tab.fval[k, 2] = f, f1, f2


@njit(cache=True, error_model="numpy", forceinline=True)
def predict_angles(t, tab):
    """Set the references of all counted angles to what their last values and rates let expect at time t."""
    n = tab.reference.size
    past = t - tab.winding[0]
    for k in range(n):
        tab.reference[k] = tab.winding[1 + k] + past * tab.winding[1 + n + k]
    for k in range(tab.tape.shape[0]):
        m = tab.tape[k, T.TAPE_REFERENCE_SIZE]
        first = tab.tape[k, T.TAPE_REFERENCE]
        for a in range(first, first + m):
            tab.extra_r[a] = tab.extra_r[a + m] + past * tab.extra_r[a + 2 * m]
    predict_element_angles(past, tab.angle, tab.extra_r)


@njit(cache=True, error_model="numpy", forceinline=True)
def update_tables(t, y, tab, derivatives):
    """Bring bodies, markers, functions of time and expected angles up to date with t and y; see `update_bodies`."""
    update_bodies(y, tab.at, tab.code, tab.body, tab.modal, tab.kin, tab.partial, tab.scratch, derivatives)
    update_markers(tab.marker_body, tab.marker, tab.kin, tab.frame)
    update_functions(t, tab)
    predict_angles(t, tab)


@njit("float64(float64[::1], int64, float64[::1], int64)", cache=True, error_model="numpy")
def euler_component(kin_row, m, v, k):
    """Return a_m . v, the component of a spatial rotation gradient along Euler angle m."""
    return dot3(kin_row, KIN_AXES + 3 * m, v, k)
