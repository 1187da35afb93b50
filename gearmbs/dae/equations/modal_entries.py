"""Newton-matrix entries of a body with modal coordinates: inertia, stiffness and damping of its modes."""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.dae.compiled.pointers import F8, I8, IVEC, VEC
from gearmbs.dae.compiled.views import uncounted
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import dot3
from gearmbs.dae.equations.entries import put
from gearmbs.dae.equations.modal_inertia import inertia_change, to_body
from gearmbs.dae.equations.modal_integrals import HEAVY, SPUN, STIFF, TURNED, integrals, present
from gearmbs.dae.equations.rotation import KIN_ADOT, KIN_AXES, KIN_W


@njit(I8(I8, F8, VEC, IVEC, VEC, VEC, VEC, VEC, IVEC, VEC, I8), cache=True, late=True, error_model="numpy")
def modal_body_entries(mode, cj, y, at, modal, partial, kin_row, s, slot, vals, k):
    """Hand over the entries of a body's modal inertia, stiffness and damping; return the number of the next entry.

    Entries whose integrals are all zero, and stay so, are left out.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`.
    cj : float
        Factor of y'.
    at, modal, partial, kin_row
        The body's places, the table of all integrals, the present state, its row of the kinematics table.
    s : ndarray
        Scratch, 30 places.
    """
    slot, vals, s = uncounted(slot), uncounted(vals), uncounted(s)
    at, modal, partial, kin_row = uncounted(at), uncounted(modal), uncounted(partial), uncounted(kin_row)
    n, p, e, th = at[T.AT_MODES], at[T.AT_P], at[T.AT_EPS], at[T.AT_THETA]
    pf, vf, qf = at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    change, h, gyro = present(partial, at[T.AT_PARTIAL], n)
    to_body(kin_row, kin_row, KIN_W, s, 0)
    for c in range(3):
        to_body(kin_row, kin_row, KIN_AXES + 3 * c, s, 12 + 3 * c)
        to_body(kin_row, kin_row, KIN_ADOT + 3 * c, s, 21 + 3 * c)
    for i in range(n):
        inertia_change(change, i, s, 0, s, 3)
        for c in range(3):
            s[3 + c] += gyro[c, i]
            s[6 + c] = h[c, i]
        k = put(mode, slot, vals, k, pf + i, pf + i, cj)
        k = put(mode, slot, vals, k, vf + i, pf + i, 1.0)
        k = put(mode, slot, vals, k, qf + i, vf + i, 1.0)
        k = put(mode, slot, vals, k, qf + i, qf + i, -cj)
        for c in range(3):
            axis, rate = 12 + 3 * c, 21 + 3 * c
            # dh/dq_i in s[3:6], dh/dv_i = H_i in s[6:9]
            along, about = dot3(s, axis, s, 3), dot3(s, axis, s, 6)
            along_rate, about_rate = dot3(s, rate, s, 3), dot3(s, rate, s, 6)
            k = put(mode, slot, vals, k, p + c, qf + i, -along_rate)
            k = put(mode, slot, vals, k, p + c, vf + i, -about_rate)
            k = put(mode, slot, vals, k, e + c, qf + i, -along)
            k = put(mode, slot, vals, k, e + c, vf + i, -about)
            k = put(mode, slot, vals, k, pf + i, e + c, -along)
            k = put(mode, slot, vals, k, pf + i, th + c, -along_rate)
            k = put(mode, slot, vals, k, vf + i, e + c, -about)
            k = put(mode, slot, vals, k, vf + i, th + c, -about_rate)
        k = pair_entries(mode, i, at, modal, s, slot, vals, k)
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def pair_entries(mode, i, at, modal, s, slot, vals, k):
    """Hand over the entries of mode i with all modes; return the number of the next entry.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`.
    i : int
        Mode.
    at, modal : ndarray
        The body's places, the table of all integrals.
    s : ndarray
        Angular velocity in body components in ``s[0:3]``.
    """
    n, pf, vf, qf = at[T.AT_MODES], at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    second, turned, mass, stiffness, damping, pairs = integrals(modal, at[T.AT_MODAL], n)
    x, y, z = s[0], s[1], s[2]
    for l in range(n):
        common = int(pairs[i, l])
        if common == 0:
            continue
        row, other = second[l], turned[l]
        if common & STIFF:
            centrifugal = 0.5 * (row[i] * x * x + row[3 * n + i] * y * y + row[5 * n + i] * z * z)
            centrifugal += row[n + i] * x * y + row[2 * n + i] * x * z + row[4 * n + i] * y * z
            k = put(mode, slot, vals, k, pf + i, qf + l, stiffness[i, l] - centrifugal)
        if common & TURNED:
            gyro = x * other[i] + y * other[n + i] + z * other[2 * n + i]
            k = put(mode, slot, vals, k, pf + i, vf + l, damping[i, l] - gyro)
        if common & SPUN:
            mixed = x * row[6 * n + i] + y * row[7 * n + i] + z * row[8 * n + i]
            k = put(mode, slot, vals, k, vf + i, qf + l, -mixed)
        if common & HEAVY:
            k = put(mode, slot, vals, k, vf + i, vf + l, -mass[i, l])
    return k
