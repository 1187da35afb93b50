"""Force elements: the forces F and torques N of eq. (5) as functions of positions, velocities and time.

An element acts with force F at the origin of its marker I and torque N on I's body, and with -F at the
same point and -N on J's body.  F and N are unknowns of eq. (9); their rows are F - F(q, q', t) = 0.
"""

from __future__ import annotations

from numba import njit

from gearmbs.dae.compiled import pointers
from gearmbs.dae.compiled.pointers import contact_at
from gearmbs.dae.compiled.views import matrix_at, vector_at
from gearmbs.dae.equations import expression_loads
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import cross3
from gearmbs.dae.equations.rotation import KIN_R, KIN_V, KIN_W

TORQUE = 0
"""Torque f(t) about the z axis of marker RM."""
GEAR_CONTACT = 1
EXPRESSION = 2
"""Components given by expressions, along a line or in the frame of marker RM."""

DIAGNOSTICS = 8
"""Length of the diagnostics record of a gear contact (see `gearmbs.contact`)."""


@njit(cache=True, error_model="numpy", forceinline=True)
def marker_pose(m, marker_body, kin, frame, out):
    """Write position (3), orientation (3x3 row-major), velocity (3), angular velocity (3) of marker m."""
    row = kin[marker_body[m]]
    cross3(row, KIN_W, frame[m], T.MK_ARM, out, 12)
    for c in range(3):
        out[c] = row[KIN_R + c] + frame[m, T.MK_ARM + c]
        for axis in range(3):
            out[3 + 3 * c + axis] = frame[m, T.MK_AXES + 3 * axis + c]
        out[12 + c] += row[KIN_V + c]
        out[15 + c] = row[KIN_W + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def torque(row, fval, frame, wrench):
    """Write the torque f(t) z_RM to ``wrench[3:6]``."""
    f, axis = fval[row[T.FORCE_FUNCTION], 0], frame[row[T.FORCE_RM]]
    for c in range(3):
        wrench[3 + c] = f * axis[T.MK_AXES + 6 + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def contact_wrench(row, tab, wrench, jac, diag, want_jac):
    """Evaluate a gear contact on the frames of its two markers; columns of ``jac`` are the markers' variations."""
    i, j = row[T.FORCE_I], row[T.FORCE_J]
    work = row[T.FORCE_WORK]
    first, second = vector_at(tab.scratch, work, 18), vector_at(tab.scratch, work + 18, 18)
    marker_pose(i, tab.marker_body, tab.kin, tab.frame, first)
    marker_pose(j, tab.marker_body, tab.kin, tab.frame, second)
    gi0, gr0 = row[T.FORCE_IEXTRA], row[T.FORCE_REXTRA]
    ni, nr = tab.extra_i[gi0], tab.extra_i[gi0 + 1]
    contact_at(tab.address[pointers.CONTACT])(
        vector_at(tab.extra_i, gi0 + 2, ni),
        vector_at(tab.extra_r, gr0, nr),
        vector_at(first, 0, 3),
        matrix_at(first, 3, 3, 3),
        vector_at(first, 12, 3),
        vector_at(first, 15, 3),
        vector_at(second, 0, 3),
        matrix_at(second, 3, 3, 3),
        vector_at(second, 12, 3),
        vector_at(second, 15, 3),
        wrench,
        jac,
        diag,
        want_jac,
        vector_at(tab.scratch, work + 36, tab.scratch.size - work - 36),
    )


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


@njit(cache=True, error_model="numpy", forceinline=True)
def element_wrench(row, t, y, tab, wrench, jac, diag, want_jac):
    """Fill F in ``wrench[0:3]`` and N in ``wrench[3:6]`` and, if wanted, their derivatives in ``jac``.

    The columns of ``jac`` are the 12 variations of each body the element depends on, in the order of its
    dependency list, then the unknowns it depends on directly.
    """
    kind = row[T.FORCE_KIND]
    for c in range(6):
        wrench[c] = 0.0
    if want_jac != 0:
        for r in range(6):
            for c in range(jac.shape[1]):
                jac[r, c] = 0.0
    if kind == TORQUE:
        torque(row, tab.fval, tab.frame, wrench)
        if want_jac != 0:
            # d(f z) = f dpi x z
            zx, zy, zz = wrench[3], wrench[4], wrench[5]
            jac[3, 4], jac[3, 5] = zz, -zy
            jac[4, 3], jac[4, 5] = -zz, zx
            jac[5, 3], jac[5, 4] = zy, -zx
    elif kind == GEAR_CONTACT:
        contact_wrench(row, tab, wrench, jac, diag, want_jac)
        if want_jac != 0:
            shift_to_body(row[T.FORCE_I], tab.marker_body, tab.kin, tab.frame, jac, 0)
            shift_to_body(row[T.FORCE_J], tab.marker_body, tab.kin, tab.frame, jac, 12)
    else:
        expression_loads.load(row, t, y, tab, wrench, jac, want_jac)
