"""Compiled force elements inside the equations: their kernels are called, their derivatives handed on.

What a kernel is given and gives is written in `gearmbs.dae.equations.force_elements`.
"""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.dae.compiled.pointers import caller
from gearmbs.dae.compiled.views import matrix_at, vector_at
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import cross3
from gearmbs.dae.equations.force_elements import (
    DERIVATIVES,
    FORCE_SIG,
    FRAME_A,
    FRAME_COLUMNS,
    FRAME_P,
    FRAME_V,
    FRAME_W,
)
from gearmbs.dae.equations.rotation import KIN_R, KIN_V, KIN_W

force_at = caller(FORCE_SIG)


@njit(cache=True, error_model="numpy", forceinline=True)
def marker_pose(m, marker_body, kin, frame, out, k):
    """Write the frame of marker m, columns ``FRAME_*``, to ``out[k:]``."""
    row = kin[marker_body[m]]
    cross3(row, KIN_W, frame[m], T.MK_ARM, out, k + FRAME_V)
    for c in range(3):
        out[k + FRAME_P + c] = row[KIN_R + c] + frame[m, T.MK_ARM + c]
        for axis in range(3):
            out[k + FRAME_A + 3 * c + axis] = frame[m, T.MK_AXES + 3 * axis + c]
        out[k + FRAME_V + c] += row[KIN_V + c]
        out[k + FRAME_W + c] = row[KIN_W + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def fill_inputs(row, y, extra_i, extra_r, angle, fval, sees, out, k):
    """Write the inputs that an element declares to ``out[k:]``; return the place after the last.

    Parameters
    ----------
    row : ndarray of int, shape (FORCE_COLUMNS,)
        The element's row of the force table.
    y : ndarray, shape (unknowns,)
        Its further unknowns come first.
    extra_i, extra_r : ndarray of int, ndarray
        Tables of extra integers and reals.
    angle : ndarray of int, shape (angles, ANGLE_COLUMNS)
        Counted angles, whose references come last.
    fval : ndarray, shape (functions, FUNCTION_VALUES)
        Functions of time, whose values come second.
    sees : int
        Place in ``extra_i`` of the number of functions, behind the list of markers.
    out, k : ndarray, int
        Where to write, and the first place.
    """
    at = row[T.FORCE_DEPENDS]
    at += 1 + extra_i[at]
    for q in range(at + 1 + row[T.FORCE_STATES], at + 1 + extra_i[at]):
        out[k] = y[extra_i[q]]
        k += 1
    for q in range(sees + 1, sees + 1 + extra_i[sees]):
        out[k] = fval[extra_i[q], 0]
        k += 1
    sees += 1 + extra_i[sees]
    for q in range(sees + 1, sees + 1 + extra_i[sees]):
        out[k] = extra_r[angle[extra_i[q], T.ANGLE_AT]]
        k += 1
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def evaluate_element(row, t, y, tab, want):
    """Call the kernel of a compiled element; ``row`` is that of its first wrench.

    Wrenches, rates and diagnostics are left one after the other in the scratch from ``row[FORCE_WORK]`` on, the
    derivatives, if wanted, at ``SCRATCH_FIXED``: columns of the bodies' variations, then of the unknowns.
    """
    scratch, extra_i = tab.scratch, tab.extra_i
    rates = row[T.FORCE_WORK] + 6 * row[T.FORCE_WRENCHES]
    diagnostics = rates + row[T.FORCE_STATES]
    poses = diagnostics + row[T.FORCE_DIAGNOSTICS]
    for k in range(row[T.FORCE_WORK], poses):
        scratch[k] = 0.0
    sees = row[T.FORCE_SEES]
    frames = extra_i[sees]
    for k in range(frames):
        marker_pose(extra_i[sees + 1 + k], tab.marker_body, tab.kin, tab.frame, scratch, poses + FRAME_COLUMNS * k)
    inputs = poses + FRAME_COLUMNS * frames
    end = fill_inputs(row, y, extra_i, tab.extra_r, tab.angle, tab.fval, sees + 1 + frames, scratch, inputs)
    rows = 6 * row[T.FORCE_WRENCHES] + row[T.FORCE_STATES]
    width = row[T.FORCE_WIDTH]
    jac = matrix_at(scratch, T.SCRATCH_FIXED, rows, width)
    if want & DERIVATIVES:
        for k in range(T.SCRATCH_FIXED, T.SCRATCH_FIXED + rows * width):
            scratch[k] = 0.0
    at = row[T.FORCE_IEXTRA]
    force_at(row[T.FORCE_ADDRESS])(
        vector_at(extra_i, at + 2, extra_i[at]),
        vector_at(tab.extra_r, row[T.FORCE_REXTRA], extra_i[at + 1]),
        t,
        matrix_at(scratch, poses, frames, FRAME_COLUMNS),
        vector_at(y, row[T.FORCE_Z], row[T.FORCE_STATES]),
        vector_at(scratch, inputs, end - inputs),
        want,
        vector_at(scratch, end, scratch.size - end),
        matrix_at(scratch, row[T.FORCE_WORK], row[T.FORCE_WRENCHES], 6),
        vector_at(scratch, rates, row[T.FORCE_STATES]),
        jac,
        vector_at(scratch, diagnostics, row[T.FORCE_DIAGNOSTICS]),
    )
    if want & DERIVATIVES:
        for k in range(frames):
            shift_to_body(extra_i[sees + 1 + k], tab.marker_body, tab.kin, tab.frame, jac, 12 * k)


@njit(cache=True, error_model="numpy")
def shift_to_body(m, marker_body, kin, frame, jac, first):
    """Turn columns of marker m's variations ``jac[:, first:first+12]`` into those of its body's frame.

    With arm s: dP = dR + dpi x s and d(v_P) = dv + dw x s + w x (dpi x s).
    """
    sx, sy, sz = frame[m, 0], frame[m, 1], frame[m, 2]
    if sx == 0.0 and sy == 0.0 and sz == 0.0:
        return
    row = kin[marker_body[m]]
    wx, wy, wz = row[KIN_W], row[KIN_W + 1], row[KIN_W + 2]
    for r in range(jac.shape[0]):
        px, py, pz = jac[r, first], jac[r, first + 1], jac[r, first + 2]
        vx, vy, vz = jac[r, first + 6], jac[r, first + 7], jac[r, first + 8]
        # g . (dpi x s) = dpi . (s x g), with g = dF/dP + (dF/dv) x w
        gx, gy, gz = px + vy * wz - vz * wy, py + vz * wx - vx * wz, pz + vx * wy - vy * wx
        jac[r, first + 3] += sy * gz - sz * gy
        jac[r, first + 4] += sz * gx - sx * gz
        jac[r, first + 5] += sx * gy - sy * gx
        jac[r, first + 9] += sy * vz - sz * vy
        jac[r, first + 10] += sz * vx - sx * vz
        jac[r, first + 11] += sx * vy - sy * vx
