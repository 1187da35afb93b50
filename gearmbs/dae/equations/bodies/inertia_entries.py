"""Newton-matrix entries of a body with modal coordinates: inertia, stiffness and damping of its modes."""

from __future__ import annotations

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.inertia import (
    HEAD,
    LISTED,
    PAIRED,
    PRESENT,
    has_diagonals,
    inertia_change,
    integrals,
    places_in,
    present,
    stride,
    to_body,
)
from gearmbs.dae.equations.constraints.terms import dot3
from gearmbs.dae.equations.rotation import KIN_ADOT, KIN_AXES, KIN_W
from gearmbs.dae.equations.unknowns import put
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES
from gearmbs.kernels.pointers import F8, I8, IVEC, VEC
from gearmbs.kernels.structs import uncounted, vector_at


@njit(I8(I8, F8, VEC, IVEC, VEC, VEC, VEC, VEC, IVEC, VEC, I8), cache=True, late=True, error_model="numpy")
def modal_body_entries(mode, cj, y, at, modal, partial, kin_row, s, slot, vals, k):
    """Hand over the entries of a body's modal inertia, stiffness and damping; return the number of the next entry.

    Entries whose integrals are all zero, and stay so, are left out.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`.
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
    places = places_in(modal, at[T.AT_MODAL], n)
    to_body(kin_row, kin_row, KIN_W, s, 0)
    for c in range(3):
        to_body(kin_row, kin_row, KIN_AXES + 3 * c, s, 12 + 3 * c)
        to_body(kin_row, kin_row, KIN_ADOT + 3 * c, s, 21 + 3 * c)
    for i in range(n):
        j = int(places[i])
        inertia_change(change, j, s, 0, s, 3)
        for c in range(3):
            s[3 + c] += gyro[c, j]
            s[6 + c] = h[c, j]
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
    return pair_entries(mode, at, modal, s, slot, vals, k)


@njit(cache=True, error_model="numpy", forceinline=True)
def listed_pairs(modal, at, n, kind):
    """Return the entries of a kind, see `PAIRED`, between two modes: mode l and mode k of each."""
    head, lanes = vector_at(modal, at, HEAD), stride(n) // LANES
    first = at + HEAD + 12 * LANES * lanes + 15 * n * n + PRESENT * lanes + (1 + LANES) * int(head[LISTED]) + n
    for before in range(kind):
        first += 2 * int(head[PAIRED + before])
    count = int(head[PAIRED + kind])
    return vector_at(modal, first, count), vector_at(modal, first + count, count)


@njit(cache=True, error_model="numpy", forceinline=True)
def pair_entries(mode, at, modal, s, slot, vals, k):
    """Hand over the entries between modes, kind by kind and without a look at those that vanish; return as `put` does.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`.
    at, modal : ndarray
        The body's places, the table of all integrals.
    s : ndarray
        Angular velocity in body components in ``s[0:3]``.
    """
    n, pf, vf, qf = at[T.AT_MODES], at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    place = at[T.AT_MODAL]
    second, turned, mass, stiffness, damping = integrals(modal, place, n)
    x, y, z = s[0], s[1], s[2]
    apart = has_diagonals(modal, at)
    by, of = listed_pairs(modal, place, n, 0)
    for e in range(by.size):
        l, i = int(by[e]), int(of[e])
        centrifugal = 0.5 * (second[l, i] * x * x + second[l, 3 * n + i] * y * y + second[l, 5 * n + i] * z * z)
        centrifugal += second[l, n + i] * x * y + second[l, 2 * n + i] * x * z + second[l, 4 * n + i] * y * z
        own = stiffness[i, l] if i == l or not apart else 0.0
        k = put(mode, slot, vals, k, pf + i, qf + l, own - centrifugal)
    by, of = listed_pairs(modal, place, n, 1)
    for e in range(by.size):
        l, i = int(by[e]), int(of[e])
        gyro = x * turned[l, i] + y * turned[l, n + i] + z * turned[l, 2 * n + i]
        own = damping[i, l] if i == l or not apart else 0.0
        k = put(mode, slot, vals, k, pf + i, vf + l, own - gyro)
    by, of = listed_pairs(modal, place, n, 2)
    for e in range(by.size):
        l, i = int(by[e]), int(of[e])
        mixed = x * second[l, 6 * n + i] + y * second[l, 7 * n + i] + z * second[l, 8 * n + i]
        k = put(mode, slot, vals, k, vf + i, qf + l, -mixed)
    by, of = listed_pairs(modal, place, n, 3)
    for e in range(by.size):
        l, i = int(by[e]), int(of[e])
        k = put(mode, slot, vals, k, vf + i, vf + l, -mass[i, l])
    return k
