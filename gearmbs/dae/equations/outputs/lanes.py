"""The acceleration system of `gearmbs.dae.equations.outputs.accelerations` at eight outputs side by side, of rigid
bodies.

Inertia, POINT and DOT1 terms, which most rows are made of, are computed in lanes; terms of other kinds, the bodies'
motion and the applied loads are taken from the tables of one output after the other (`take_bodies`, `take_terms`).
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.constraints.terms import (
    OFFSET,
    QUADRATIC,
    RATE,
    RELATIVE,
    point_motion,
    product_motion,
    scalar_product,
    vector_product,
)
from gearmbs.dae.equations.kinematics.rotation import KIN_A, KIN_AXES, KIN_H, KIN_R, KIN_V, KIN_W
from gearmbs.dae.equations.outputs.accelerations import ROW_PARTIAL, ROW_PHI, ROW_RATE, ROW_RECORD, packed
from gearmbs.dae.equations.residual import S_GRADIENT, S_GRADIENT_T, S_TERM
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES, all_lanes, lanes_at, put_lanes
from gearmbs.kernels.structs import IntVector, Matrix, Struct, Vector, vector_at

BODY_H = KIN_AXES
"""Of a body in lanes: columns up to ``KIN_AXES`` as in the kinematics table, then the angular momentum."""
BODY_COLUMNS = BODY_H + 3

TERM_GRADIENT = 0
"""Of a term of another kind in lanes: gradient (12), Phi, rate, partial time derivative, second rate."""
TERM_PHI, TERM_RATE, TERM_PARTIAL, TERM_GAMMA = range(12, 16)
TERM_VALUES = 16

SCRATCH = 15
"""Places of the scratch: what `lane_relative_motion` writes, or an inertia `packed` and nine of its products."""


class LaneTables(Struct):
    """Tables in lanes of eight neighbouring outputs.

    Attributes
    ----------
    body, frame, function : ndarray
        Bodies (`BODY_COLUMNS` each), markers as in the scratch marker table, functions of time.
    terms, other : ndarray of int, ndarray
        Numbers of the terms that are neither POINT nor DOT1, and their values, `TERM_VALUES` each.
    vals, rhs, solution, phi : ndarray
        Matrix by slots, right-hand side, its solution, violations, as of
        `gearmbs.dae.equations.outputs.accelerations.saddle`.
    force, moment : ndarray
        Reactions, 3 of each row.
    scratch : ndarray
    applied : ndarray
        Generalised forces of the applied loads, by coordinates.
    y, own : ndarray, shapes (LANES, unknowns) and (coordinates,)
        The unknowns of each output, and the applied loads of one.
    """

    body: Vector
    frame: Vector
    function: Vector
    terms: IntVector
    other: Vector
    vals: Vector
    rhs: Vector
    solution: Vector
    phi: Vector
    force: Vector
    moment: Vector
    scratch: Vector
    applied: Vector
    y: Matrix
    own: Vector


def new_lane_tables(idata: np.ndarray, nnz: int) -> LaneTables:
    """Return empty tables for a model whose matrix has ``nnz`` entries."""
    bodies, rows, unknowns = (int(idata[k]) for k in (T.H_BODIES, T.H_ROWS, T.H_UNKNOWNS))
    coordinates = int(idata[T.H_COORDINATES])
    n = coordinates + rows
    kinds = T.rows_in(idata, int(idata[T.H_I_TERM]), int(idata[T.H_TERMS]), T.TERM_COLUMNS)[:, T.TERM_TYPE]
    others = np.flatnonzero((kinds != terms.POINT) & (kinds != terms.DOT1))
    sizes = {
        "body": bodies * BODY_COLUMNS,
        "frame": int(idata[T.H_MARKERS]) * T.MK_COLUMNS,
        "function": int(idata[T.H_FUNCTIONS]) * T.FUNCTION_VALUES,
        "other": others.size * TERM_VALUES,
        "vals": nnz,
        "rhs": n,
        "solution": n,
        "phi": ROW_RECORD * rows,
        "force": 3 * rows,
        "moment": 3 * rows,
        "scratch": SCRATCH,
        "applied": coordinates,
    }
    tables = {name: np.zeros(LANES * size) for name, size in sizes.items()}
    for axis in range(3):
        first = LANES * (KIN_A + 4 * axis)
        tables["body"][first : first + LANES] = 1.0
    return LaneTables(**tables, terms=others.astype(np.int64), y=np.zeros((LANES, unknowns)), own=np.zeros(coordinates))


# --- from the tables of one output ----------------------------------------------------------------------


@njit(cache=True, error_model="numpy", forceinline=True)
def take_bodies(lane, tab, lanes):
    """Take bodies and functions of time of one output from up-to-date tables."""
    body, function = lanes.body, lanes.function
    for b in range(1, tab.code.size):
        row, first = tab.kin[b], b * BODY_COLUMNS
        for c in range(KIN_AXES):
            body[LANES * (first + c) + lane] = row[c]
        for c in range(3):
            body[LANES * (first + BODY_H + c) + lane] = row[KIN_H + c]
    for k in range(tab.function.shape[0]):
        for c in range(T.FUNCTION_VALUES):
            function[LANES * (T.FUNCTION_VALUES * k + c) + lane] = tab.fval[k, c]


@njit(cache=True, error_model="numpy", forceinline=True)
def take_terms(lane, tab, lanes):
    """Take the terms that are neither POINT nor DOT1 of one output from up-to-date tables."""
    g = vector_at(tab.scratch, S_GRADIENT, 12)
    gt = vector_at(tab.scratch, S_GRADIENT_T, 12)
    s = vector_at(tab.scratch, S_TERM, 100)
    other = lanes.other
    for o in range(lanes.terms.size):
        j = lanes.terms[o]
        first = TERM_VALUES * o
        phi, partial = terms.gradient(
            j, tab.term, tab.fval, tab.reference, tab.marker_body, tab.kin, tab.frame, s, g, gt
        )
        rate = partial
        for side in range(2):
            kin = tab.kin[tab.marker_body[tab.term[j, T.TERM_I + side]]]
            rate += terms.dot3(g, 6 * side, kin, KIN_V) + terms.dot3(g, 6 * side + 3, kin, KIN_W)
        for c in range(12):
            other[LANES * (first + c) + lane] = g[c]
        other[LANES * (first + TERM_PHI) + lane] = phi
        other[LANES * (first + TERM_RATE) + lane] = rate
        other[LANES * (first + TERM_PARTIAL) + lane] = partial
        other[LANES * (first + TERM_GAMMA) + lane] = terms.quadratic_part(
            j, tab.term, tab.fval, tab.marker_body, tab.kin, tab.frame, s
        )


# --- in lanes -------------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy", forceinline=True)
def three(a, i):
    """Return the components of a vector in lanes that begins at place i."""
    return lanes_at(a, i), lanes_at(a, i + 1), lanes_at(a, i + 2)


@njit(cache=True, error_model="numpy", forceinline=True)
def add_three(out, place, factor, v):
    """Add a multiple of a vector in lanes to the one that begins at a place."""
    put_lanes(out, place, lanes_at(out, place) + factor * v[0])
    put_lanes(out, place + 1, lanes_at(out, place + 1) + factor * v[1])
    put_lanes(out, place + 2, lanes_at(out, place + 2) + factor * v[2])


@njit(cache=True, error_model="numpy", forceinline=True)
def dot(a, i, b, j):
    """Return a . b of vectors in lanes that begin at places i and j."""
    return scalar_product(three(a, i), three(b, j))


@njit(cache=True, error_model="numpy", forceinline=True)
def cross(a, i, b, j):
    """Return the components of a x b of vectors in lanes that begin at places i and j."""
    return vector_product(three(a, i), three(b, j))


@njit(cache=True, error_model="numpy", forceinline=True)
def add_entry(slot, vals, k, value):
    """Add entry k of the walk through the matrix to its place; return the number of the next."""
    put_lanes(vals, slot[k], lanes_at(vals, slot[k]) + value)
    return k + 1


@njit(cache=True, error_model="numpy", forceinline=True)
def add_pair(slot, vals, k, value):
    """Add an entry of Phi_q and its mirror image; return the number of the next."""
    return add_entry(slot, vals, add_entry(slot, vals, k, value), value)


@njit(cache=True, error_model="numpy", forceinline=True)
def update_lane_markers(marker_body, marker, lanes):
    """Fill the marker table in lanes: arms and axes in global components."""
    body, frame = lanes.body, lanes.frame
    for m in range(marker_body.size):
        first, to = marker_body[m] * BODY_COLUMNS + KIN_A, T.MK_COLUMNS * m
        for c in range(3):
            x, y, z = (
                lanes_at(body, first + 3 * c),
                lanes_at(body, first + 3 * c + 1),
                lanes_at(body, first + 3 * c + 2),
            )
            put_lanes(frame, to + T.MK_ARM + c, x * marker[m, 0] + y * marker[m, 1] + z * marker[m, 2])
            for axis in range(3):
                along = x * marker[m, 3 + axis] + y * marker[m, 6 + axis] + z * marker[m, 9 + axis]
                put_lanes(frame, to + T.MK_AXES + 3 * axis + c, along)


@njit(cache=True, error_model="numpy", forceinline=True)
def put_lane_bodies(slot, tab, lanes):
    """Add the mass matrices; write weights and gyroscopic moments to ``rhs``; return the number of the next entry."""
    body, scratch, vals, rhs = lanes.body, lanes.scratch, lanes.vals, lanes.rhs
    k = np.int64(0)
    for b in range(1, tab.code.size):
        first, i, mass = b * BODY_COLUMNS, tab.at[b, T.AT_V], tab.body[b, T.BODY_MASS]
        for c in range(3):
            x, y, z = three(body, first + KIN_A + 3 * c)
            for d in range(3):
                q = T.BODY_INERTIA + d
                turned = x * tab.body[b, q] + y * tab.body[b, q + 3] + z * tab.body[b, q + 6]
                put_lanes(scratch, 6 + 3 * c + d, turned)
        for c in range(3):
            for d in range(c, 3):
                put_lanes(scratch, packed(c, d), dot(scratch, 6 + 3 * c, body, first + KIN_A + 3 * d))
        for c in range(3):
            k = add_entry(slot, vals, k, all_lanes(mass))
            for d in range(3):
                k = add_entry(slot, vals, k, lanes_at(scratch, packed(min(c, d), max(c, d))))
            put_lanes(rhs, i + c, all_lanes(mass * tab.gravity[c]))
        x, y, z = cross(body, first + BODY_H, body, first + KIN_W)
        put_lanes(rhs, i + 3, x)
        put_lanes(rhs, i + 4, y)
        put_lanes(rhs, i + 5, z)
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def lane_relative_motion(i, j, marker_body, lanes):
    """Write offset, rate and second rate of marker i from marker j to the scratch; see `simple_terms`."""
    body, frame, out = lanes.body, lanes.frame, lanes.scratch
    for c in range(RELATIVE):
        put_lanes(out, c, all_lanes(0.0))
    for side in range(2):
        marker = i if side == 0 else j
        sign = 1.0 - 2.0 * side
        first, arm = marker_body[marker] * BODY_COLUMNS, T.MK_COLUMNS * marker + T.MK_ARM
        rate, bent = point_motion(three(body, first + KIN_V), three(body, first + KIN_W), three(frame, arm))
        add_three(out, OFFSET, sign, three(body, first + KIN_R))
        add_three(out, OFFSET, sign, three(frame, arm))
        add_three(out, RATE, sign, rate)
        add_three(out, QUADRATIC, sign, bent)


@njit(cache=True, error_model="numpy", forceinline=True)
def put_lane_point(slot, k, coef, term, marker_body, lanes):
    """Add the gradient of a POINT term; return the number of the next entry."""
    frame, vals = lanes.frame, lanes.vals
    c = term[T.TERM_AXES]
    c1, c2 = c + 1 if c < 2 else 0, c - 1 if c > 0 else 2
    for side in range(2):
        marker = term[T.TERM_I + side]
        if marker_body[marker] == 0:
            continue
        sign = coef if side == 0 else -coef
        k = add_pair(slot, vals, k, all_lanes(sign))
        k = add_pair(slot, vals, k, sign * lanes_at(frame, T.MK_COLUMNS * marker + T.MK_ARM + c2))
        k = add_pair(slot, vals, k, -sign * lanes_at(frame, T.MK_COLUMNS * marker + T.MK_ARM + c1))
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def put_lane_dot(slot, k, coef, term, marker_body, lanes):
    """Add the gradient of a DOT1 term; return the number of the next entry, Phi, its rate and its second rate.

    The second rate is without the terms in accelerations; all are those of the term without its coefficient.
    """
    body, frame, vals = lanes.body, lanes.frame, lanes.vals
    i, j = term[T.TERM_I], term[T.TERM_J]
    a = T.MK_COLUMNS * i + T.MK_AXES + 3 * (term[T.TERM_AXES] // 3)
    b = T.MK_COLUMNS * j + T.MK_AXES + 3 * (term[T.TERM_AXES] % 3)
    wi, wj = marker_body[i] * BODY_COLUMNS + KIN_W, marker_body[j] * BODY_COLUMNS + KIN_W
    phi, rate, bent, (x, y, z) = product_motion(three(frame, a), three(frame, b), three(body, wi), three(body, wj))
    for side in range(2):
        if marker_body[term[T.TERM_I + side]] == 0:
            continue
        sign = coef if side == 0 else -coef
        k = add_pair(slot, vals, k, sign * x)
        k = add_pair(slot, vals, k, sign * y)
        k = add_pair(slot, vals, k, sign * z)
    return k, phi, rate, bent


@njit(cache=True, error_model="numpy", forceinline=True)
def put_lane_other(slot, k, coef, term, place, marker_body, lanes):
    """Add the gradient of a term taken by `take_terms`, whose values begin at ``place``; return the next number."""
    for side in range(2):
        if marker_body[term[T.TERM_I + side]] == 0:
            continue
        for c in range(6):
            k = add_pair(slot, lanes.vals, k, coef * lanes_at(lanes.other, place + TERM_GRADIENT + 6 * side + c))
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def put_lane_rows(slot, k, base, tab, lanes):
    """Add the gradients of the constraint rows, fill ``phi``, and write -gamma to ``rhs`` from place ``base`` on.

    ``k`` is the number of the first entry.
    """
    apart, function, other, phi = lanes.scratch, lanes.function, lanes.other, lanes.phi
    last_i = last_j = np.int64(-1)
    others = np.int64(0)
    for r in range(tab.row.shape[0] - 1):
        value, rate, partial, gamma = all_lanes(0.0), all_lanes(0.0), all_lanes(0.0), all_lanes(0.0)
        fun = tab.row[r, T.ROW_FUNCTION]
        if fun >= 0:
            value, partial = -lanes_at(function, 3 * fun), -lanes_at(function, 3 * fun + 1)
            rate, gamma = partial, -lanes_at(function, 3 * fun + 2)
        for j in range(tab.row[r, T.ROW_FIRST], tab.row[r + 1, T.ROW_FIRST]):
            coef, kind, term = tab.coef[j], tab.term[j, T.TERM_TYPE], tab.term[j]
            if kind == terms.POINT:
                # the rows of a joint share their markers
                if term[T.TERM_I] != last_i or term[T.TERM_J] != last_j:
                    last_i, last_j = term[T.TERM_I], term[T.TERM_J]
                    lane_relative_motion(last_i, last_j, tab.marker_body, lanes)
                c = term[T.TERM_AXES]
                p, d, q2 = lanes_at(apart, OFFSET + c), lanes_at(apart, RATE + c), lanes_at(apart, QUADRATIC + c)
                k = put_lane_point(slot, k, coef, term, tab.marker_body, lanes)
            elif kind == terms.DOT1:
                k, p, d, q2 = put_lane_dot(slot, k, coef, term, tab.marker_body, lanes)
            else:
                first = TERM_VALUES * others
                others += 1
                p, d, q2 = (lanes_at(other, first + TERM_PHI), lanes_at(other, first + TERM_RATE),
                            lanes_at(other, first + TERM_GAMMA))  # fmt: skip
                partial += coef * lanes_at(other, first + TERM_PARTIAL)
                k = put_lane_other(slot, k, coef, term, first, tab.marker_body, lanes)
            value, rate, gamma = value + coef * p, rate + coef * d, gamma + coef * q2
        put_lanes(lanes.rhs, base + r, -gamma)
        put_lanes(phi, ROW_RECORD * r + ROW_PHI, value)
        put_lanes(phi, ROW_RECORD * r + ROW_RATE, rate)
        put_lanes(phi, ROW_RECORD * r + ROW_PARTIAL, partial)


@njit(cache=True, error_model="numpy")
def lane_saddle(slot, idata, rdata, work, lanes):
    """Assemble matrix, right-hand side without the applied loads, and ``phi``, from what was taken of each output.

    ``slot`` has the place of each entry of the matrix among its values.
    """
    tab = T.unpack(idata, rdata, work)
    base = idata[T.H_COORDINATES]
    for p in range(lanes.vals.size // LANES):
        put_lanes(lanes.vals, p, all_lanes(0.0))
    update_lane_markers(tab.marker_body, tab.marker, lanes)
    k = put_lane_bodies(slot, tab, lanes)
    put_lane_rows(slot, k, base, tab, lanes)


@njit(cache=True, error_model="numpy")
def lane_reactions(idata, rdata, work, lanes):
    """Write the reactions of `gearmbs.dae.equations.outputs.accelerations.loads_of_rows` of the solution, in lanes."""
    tab = T.unpack(idata, rdata, work)
    base = idata[T.H_COORDINATES]
    force, moment, frame, other = lanes.force, lanes.moment, lanes.frame, lanes.other
    others = np.int64(0)
    for p in range(force.size // LANES):
        put_lanes(force, p, all_lanes(0.0))
        put_lanes(moment, p, all_lanes(0.0))
    for r in range(tab.row.shape[0] - 1):
        lam = lanes_at(lanes.solution, base + r)
        first = tab.row[r, T.ROW_FIRST]
        for j in range(first, tab.row[r + 1, T.ROW_FIRST]):
            kind, i, axes = tab.term[j, T.TERM_TYPE], tab.term[j, T.TERM_I], tab.term[j, T.TERM_AXES]
            place = TERM_VALUES * others
            others += 1 if kind != terms.POINT and kind != terms.DOT1 else 0
            if i != tab.term[first, T.TERM_I]:
                continue
            factor = -tab.coef[j] * lam
            if kind == terms.POINT:
                put_lanes(force, 3 * r + axes, lanes_at(force, 3 * r + axes) + factor)
                continue
            if kind == terms.DOT1:
                at_j = T.MK_COLUMNS * tab.term[j, T.TERM_J] + T.MK_AXES + 3 * (axes % 3)
                x, y, z = cross(frame, T.MK_COLUMNS * i + T.MK_AXES + 3 * (axes // 3), frame, at_j)
                x, y, z = factor * x, factor * y, factor * z
            else:
                for c in range(3):
                    put_lanes(force, 3 * r + c, lanes_at(force, 3 * r + c) + factor * lanes_at(other, place + c))
                ax, ay, az = cross(frame, T.MK_COLUMNS * i + T.MK_ARM, other, place)
                x, y, z = (factor * (lanes_at(other, place + 3) - ax), factor * (lanes_at(other, place + 4) - ay),
                           factor * (lanes_at(other, place + 5) - az))  # fmt: skip
            put_lanes(moment, 3 * r, lanes_at(moment, 3 * r) + x)
            put_lanes(moment, 3 * r + 1, lanes_at(moment, 3 * r + 1) + y)
            put_lanes(moment, 3 * r + 2, lanes_at(moment, 3 * r + 2) + z)
