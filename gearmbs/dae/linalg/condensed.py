"""Static condensation of modes: what stands apart of a matrix is eliminated in closed form, ahead of a sparse LU.

Of each modal coordinate a matrix has three equations and unknowns, momentum p, velocity v and coordinate q:

    a_pp p + a_pv v + a_pq q + b_p z = r_p,    a_vp p + a_vv v + a_vq q + b_v z = r_v,    a_qv v + a_qq q + b_q z = r_q

with all other unknowns z, whose equations are D z + sum (c_v v + c_q q) = r. Where no mode enters the equations of
another one, with f = a_pp / a_vp and g = (a_pv - f a_vv) / a_qv,

    d = a_pq - f a_vq - g a_qq,    b = b_p - f b_v - g b_q,    q = (r_p - f r_v - g r_q - b z) / d
    S = D - sum (c'_v b_q + c'_q b),    c'_v = c_v / a_qv,    c'_q = (c_q - a_qq c'_v) / d

The modes of a body share the unknowns z that they meet, so that S takes a product of two full matrices from a block of
each body. Rows of these stand in lanes, and modes in lanes in the columns; both are filled up with zeros.
"""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types, uint32
from gearmbs.kernels.lanes import LANES, all_lanes, lanes_at, put_lanes
from gearmbs.kernels.structs import vector_at

MODES, ROWS, COLUMNS, MOVED, RATED, PUSHED, NUMBERS, MODE_AT, ROW_AT, COLUMN_AT, SCHUR_AT = range(11)
"""Of a body, integers in a row: modes; rows and columns of its block; rows up to `MOVED` are entered by v, columns
up to `RATED` meet b_q, those from `PUSHED` on b_v; where its numbers begin, and in their lists its modes, rows, columns
and the places of its block."""
GROUP = 11
"""Integers a body."""

PP, PV, PQ, VP, VV, VQ, QV, QQ = range(8)
"""Entries of a mode among its own equations and unknowns, in the order in which they stand."""
OWN = 8
F, G, PIVOT, BY_VP, BY_QV, RHS_P, RHS_V, RHS_Q = range(8)
"""What follows of them: f, g, 1/d, 1/a_vp and 1/a_qv; then the sides of a substitution, r_p - f r_v - g r_q, r_v and
r_q."""
MADE = 8
TILE = 4
"""Columns of a product that are summed at a time: with the lanes of the rows they fill the registers."""

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def in_lanes(count):
    """Return in how many lanes so many numbers stand."""
    return (count + LANES - 1) // LANES


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def in_tiles(columns):
    """Return a number of columns filled up to whole tiles."""
    return (columns + TILE - 1) // TILE * TILE


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def places_in_group(modes, rows, columns):
    """Return where the parts of a body's numbers begin, and how many there are.

    Returns
    -------
    by_v, by_q, b_p, b_v, b_q, filled : int
        c_v and c_q, a row of lanes a mode; b_p, b_v and b_q, lanes of modes a column; the end of what is filled from
        the matrix.
    made, after_v, after_q, b, product, gathered, size : int
        Lists of what is made of each mode; c'_v and c'_q; b; the block taken off; lanes of rows or columns.
    """
    wide, high, columns = LANES * in_lanes(modes), LANES * in_lanes(rows), in_tiles(columns)
    by_v = OWN * wide
    by_q = by_v + wide * high
    b_p = by_q + wide * high
    b_v = b_p + wide * columns
    b_q = b_v + wide * columns
    filled = b_q + wide * columns
    after_v = filled + MADE * wide
    after_q = after_v + wide * high
    b = after_q + wide * high
    product = b + wide * columns
    gathered = product + high * columns
    size = gathered + high + LANES * in_lanes(columns)
    return by_v, by_q, b_p, b_v, b_q, filled, filled, after_v, after_q, b, product, gathered, size


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _make_rows(wide, high, moved, made, numbers, by_v, by_q, after_v, after_q):
    """Write c'_v and c'_q of the modes of a body.

    Parameters
    ----------
    wide, high : int
        Modes and rows of the body's block, filled up to whole lanes.
    moved : int
        Lanes of rows that are entered by v.
    made, by_v, by_q, after_v, after_q : int
        Where these parts of its numbers begin, see `places_in_group`.
    numbers : ndarray
        Of the body.
    """
    rows = high // LANES
    by_qv, pivot, own_qq = made + BY_QV * wide, made + PIVOT * wide, QQ * wide
    for k in range(wide):
        u, d, q = numbers[by_qv + k], numbers[pivot + k], numbers[own_qq + k]
        for b in range(moved):
            at = k * rows + b
            one = lanes_at(numbers, by_v // LANES + at) * u
            put_lanes(numbers, after_v // LANES + at, one)
            put_lanes(numbers, after_q // LANES + at, (lanes_at(numbers, by_q // LANES + at) - one * q) * d)
        for b in range(moved, rows):
            at = k * rows + b
            put_lanes(numbers, after_q // LANES + at, lanes_at(numbers, by_q // LANES + at) * d)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _make_columns(wide, columns, rated, pushed, made, numbers, b_p, b_v, b_q, b):
    """Write b of the modes of a body.

    Parameters
    ----------
    wide, made, numbers
        As of `_make_rows`.
    columns : int
        Of the body's block, filled up to whole tiles.
    rated, pushed : int
        How many columns meet b_q, and the first one that meets b_v.
    b_p, b_v, b_q, b : int
        Where these parts of its numbers begin.
    """
    for m in range(wide // LANES):
        f, g = lanes_at(numbers, (made + F * wide) // LANES + m), lanes_at(numbers, (made + G * wide) // LANES + m)
        for j in range(columns):
            at = m * columns + j
            row = lanes_at(numbers, b_p // LANES + at)
            if j < rated:
                row = row - g * lanes_at(numbers, b_q // LANES + at)
            if j >= pushed:
                row = row - f * lanes_at(numbers, b_v // LANES + at)
            put_lanes(numbers, b // LANES + at, row)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _four_sums(sums, numbers, wide, rows, row, columns, column, after, b):
    """Return four sums over modes of a lane of rows times one column each, added to ``sums``.

    Parameters
    ----------
    sums : four lanes
    numbers, wide : ndarray, int
        As of `_make_rows`.
    rows, row : int
        Lanes of rows, and which of them.
    columns, column : int
        Columns, and the first of the four.
    after, b : int
        Where the factors of the products begin: c'_v or c'_q, and b_q or b.
    """
    one, two, three, four = sums
    at = after // LANES + row
    for m in range(wide // LANES):
        first = b + LANES * (m * columns + column)
        for k in range(LANES):
            of_rows = lanes_at(numbers, at)
            at += rows
            place = first + k
            one = one + of_rows * numbers[place]
            two = two + of_rows * numbers[place + LANES]
            three = three + of_rows * numbers[place + 2 * LANES]
            four = four + of_rows * numbers[place + 3 * LANES]
    return one, two, three, four


@njit(
    types.void(int64, int64, int64, int64, int64, _VEC, int64, int64, int64, int64, int64),
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"contract"},
)
def _multiply(wide, high, columns, moved, rated, numbers, after_v, after_q, b_q, b, product):
    """Write c'_v b_q + c'_q b, summed over the modes of a body, to its block.

    Parameters
    ----------
    wide, high, moved, numbers
        As of `_make_rows`.
    columns, rated
        As of `_make_columns`.
    after_v, after_q, b_q, b, product : int
        Where these parts of its numbers begin.
    """
    rows = high // LANES
    for column in range(0, columns, TILE):
        for row in range(rows):
            sums = all_lanes(0.0), all_lanes(0.0), all_lanes(0.0), all_lanes(0.0)
            sums = _four_sums(sums, numbers, wide, rows, row, columns, column, after_q, b)
            if column < rated and row < moved:
                sums = _four_sums(sums, numbers, wide, rows, row, columns, column, after_v, b_q)
            at = product // LANES + column * rows + row
            put_lanes(numbers, at, sums[0])
            put_lanes(numbers, at + rows, sums[1])
            put_lanes(numbers, at + 2 * rows, sums[2])
            put_lanes(numbers, at + 3 * rows, sums[3])


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _make_pivots(modes, wide, made, numbers):
    """Write what follows of the own entries of the modes of a body; return how far a pivot has cancelled at most."""
    cancelled = 0.0
    for k in range(wide):
        if k >= modes:
            for c in range(MADE):
                numbers[made + c * wide + k] = 0.0
            continue
        by_vp, by_qv = 1.0 / numbers[VP * wide + k], 1.0 / numbers[QV * wide + k]
        f = numbers[PP * wide + k] * by_vp
        g = (numbers[PV * wide + k] - f * numbers[VV * wide + k]) * by_qv
        one, two, three = numbers[PQ * wide + k], f * numbers[VQ * wide + k], g * numbers[QQ * wide + k]
        pivot = 1.0 / (one - two - three)
        numbers[made + F * wide + k], numbers[made + G * wide + k] = f, g
        numbers[made + PIVOT * wide + k] = pivot
        numbers[made + BY_VP * wide + k], numbers[made + BY_QV * wide + k] = by_vp, by_qv
        lost = (abs(one) + abs(two) + abs(three)) * abs(pivot)
        # NaN is kept
        cancelled = lost if not lost <= cancelled else cancelled
    return cancelled


@njit(
    float64(_IVEC, int64, _VEC, _UVEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"contract"},
)
def _condense_group(groups, group, every, schur_at, schur_scale, reduced):
    """Eliminate the modes of a body whose numbers are filled; return how far a pivot has cancelled at most.

    Parameters
    ----------
    groups, every, schur_at, schur_scale, reduced
        As of `condense`.
    group : int
        Which body.
    """
    one = vector_at(groups, GROUP * group, GROUP)
    modes, rows, columns = one[MODES], one[ROWS], one[COLUMNS]
    by_v, by_q, b_p, b_v, b_q, _, made, after_v, after_q, b, product, _, size = places_in_group(modes, rows, columns)
    numbers = vector_at(every, one[NUMBERS], size)
    wide, high, tiled = LANES * in_lanes(modes), LANES * in_lanes(rows), in_tiles(columns)
    moved, rated = in_lanes(one[MOVED]), one[RATED]
    cancelled = _make_pivots(modes, wide, made, numbers)
    _make_rows(wide, high, moved, made, numbers, by_v, by_q, after_v, after_q)
    _make_columns(wide, tiled, rated, one[PUSHED], made, numbers, b_p, b_v, b_q, b)
    _multiply(wide, high, tiled, moved, rated, numbers, after_v, after_q, b_q, b, product)
    e = one[SCHUR_AT]
    for j in range(columns):
        first = product + high * j
        for i in range(rows):
            reduced[schur_at[e]] -= numbers[first + i] * schur_scale[e]
            e += 1
    return cancelled


@njit(
    float64(_IVEC, _UVEC, _VEC, _VEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def condense(groups, schur_at, schur_scale, every, rest, reduced):
    """Eliminate all modes that stand apart; return how far a pivot of theirs has cancelled at most.

    Parameters
    ----------
    groups, schur_at, schur_scale
        Of a `gearmbs.dae.linalg.lu_plan.LUPlan`.
    every, rest : ndarray
        Numbers of all bodies, filled by `fill`, and the scaled entries that are left.
    reduced : ndarray
        Values of the scaled matrix that is left; written but for its last one.
    """
    for e in range(rest.shape[0]):
        reduced[e] = rest[e]
    for e in range(rest.shape[0], reduced.shape[0] - 1):
        reduced[e] = 0.0
    cancelled = 0.0
    for group in range(groups.shape[0] // GROUP):
        lost = _condense_group(groups, group, every, schur_at, schur_scale, reduced)
        cancelled = lost if not lost <= cancelled else cancelled
    return cancelled


@njit(types.void(_UVEC, _UVEC, _UVEC, _VEC, _VEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def fill(fill_at, fill_src, rest_src, rest_scale, vals, every, rest):
    """Write the entries of a matrix to the numbers of the bodies and to the scaled entries that are left.

    Parameters
    ----------
    fill_at, fill_src, rest_src, rest_scale
        Of a `gearmbs.dae.linalg.lu_plan.LUPlan`.
    vals : ndarray
        Values of the matrix.
    every, rest
        As of `condense`; written.
    """
    for e in range(fill_at.shape[0]):
        every[fill_at[e]] = vals[fill_src[e]]
    for e in range(rest_src.shape[0]):
        rest[e] = vals[rest_src[e]] * rest_scale[e]


@njit(cache=True, nogil=True, error_model="numpy")
def note_moving(fill_src, rest_src, slope, moving):
    """Note which entries of `fill` have a slope: how many of those of bodies and of the others, then their numbers."""
    e = 2
    for k in range(fill_src.shape[0]):
        if slope[fill_src[k]] != 0.0:
            moving[e] = k
            e += 1
    moving[0] = e - 2
    for k in range(rest_src.shape[0]):
        if slope[rest_src[k]] != 0.0:
            moving[e] = k
            e += 1
    moving[1] = e - 2 - moving[0]


@njit(cache=True, nogil=True, error_model="numpy")
def fill_moving(fill_at, fill_src, rest_src, rest_scale, vals, every, rest, moving):
    """Write the entries that `note_moving` has noted as `fill` does, all others being what they were.

    Parameters
    ----------
    fill_at, fill_src, rest_src, rest_scale, vals, every, rest
        As of `fill`.
    moving : ndarray
        Of `note_moving`.
    """
    first = 2 + np.int64(moving[0])
    for m in range(2, first):
        k = np.int64(moving[m])
        every[fill_at[k]] = vals[fill_src[k]]
    for m in range(first, first + np.int64(moving[1])):
        k = np.int64(moving[m])
        rest[k] = vals[rest_src[k]] * rest_scale[k]


@njit(
    types.void(_IVEC, _UVEC, _UVEC, _VEC, _VEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"contract"},
)
def without_modes(groups, mode_at, row_at, row_scale, side, every, x):
    """Take what the modes give off the scaled right-hand side of all other equations, and keep their own.

    Parameters
    ----------
    groups, mode_at, row_at, row_scale
        Of a `gearmbs.dae.linalg.lu_plan.LUPlan`.
    side : ndarray
        Right-hand side of the whole matrix.
    every : ndarray
        As of `condense`, from there.
    x : ndarray
        The same in the order of pivots, scaled; changed.
    """
    for group in range(groups.shape[0] // GROUP):
        one = vector_at(groups, GROUP * group, GROUP)
        modes, rows = one[MODES], one[ROWS]
        _, _, _, _, _, _, made, after_v, after_q, _, _, gathered, size = places_in_group(modes, rows, one[COLUMNS])
        numbers = vector_at(every, one[NUMBERS], size)
        wide, high, moved = LANES * in_lanes(modes), in_lanes(rows), in_lanes(one[MOVED])
        first, rhs = one[MODE_AT], made + RHS_P * wide
        for k in range(modes):
            at = first + 3 * k
            r_v, r_q = side[mode_at[at + 1]], side[mode_at[at + 2]]
            left = side[mode_at[at]] - numbers[made + k] * r_v - numbers[made + wide + k] * r_q
            numbers[rhs + k], numbers[rhs + wide + k], numbers[rhs + 2 * wide + k] = left, r_v, r_q
        for b in range(high):
            even, odd = all_lanes(0.0), all_lanes(0.0)
            by_v, by_q = after_v // LANES + b, after_q // LANES + b
            for k in range(0, wide, 2):
                even = even + lanes_at(numbers, by_q + k * high) * numbers[rhs + k]
                odd = odd + lanes_at(numbers, by_q + (k + 1) * high) * numbers[rhs + k + 1]
            for k in range(0, wide if b < moved else 0, 2):
                even = even + lanes_at(numbers, by_v + k * high) * numbers[rhs + 2 * wide + k]
                odd = odd + lanes_at(numbers, by_v + (k + 1) * high) * numbers[rhs + 2 * wide + k + 1]
            put_lanes(numbers, gathered // LANES + b, even + odd)
        first = one[ROW_AT]
        for i in range(rows):
            place = np.int64(row_at[first + i])
            x[place] -= numbers[gathered + i] * row_scale[place]


@njit(
    types.void(_IVEC, _UVEC, _UVEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"contract"},
)
def modes_after(groups, mode_at, column_at, every, out):
    """Write the modes' unknowns to ``out``, in which all others stand; after `without_modes`.

    Parameters
    ----------
    groups, mode_at, column_at
        Of a `gearmbs.dae.linalg.lu_plan.LUPlan`.
    every : ndarray
        As of `without_modes`.
    out : ndarray
        Unknowns of the whole matrix.
    """
    for group in range(groups.shape[0] // GROUP):
        one = vector_at(groups, GROUP * group, GROUP)
        modes, columns, rated, pushed = one[MODES], one[COLUMNS], one[RATED], one[PUSHED]
        _, _, _, b_v, b_q, _, made, _, _, b, _, gathered, size = places_in_group(modes, one[ROWS], columns)
        numbers = vector_at(every, one[NUMBERS], size)
        lanes, tiled = in_lanes(modes), in_tiles(columns)
        first = one[COLUMN_AT]
        for j in range(columns):
            numbers[gathered + j] = out[column_at[first + j]]
        m = made // LANES
        for k in range(lanes):
            at = b // LANES + k * tiled
            even, odd = all_lanes(0.0), all_lanes(0.0)
            for j in range(0, columns - 1, 2):
                even = even + lanes_at(numbers, at + j) * numbers[gathered + j]
                odd = odd + lanes_at(numbers, at + j + 1) * numbers[gathered + j + 1]
            if columns % 2:
                even = even + lanes_at(numbers, at + columns - 1) * numbers[gathered + columns - 1]
            rate, push = all_lanes(0.0), all_lanes(0.0)
            for j in range(rated):
                rate = rate + lanes_at(numbers, b_q // LANES + k * tiled + j) * numbers[gathered + j]
            for j in range(pushed, columns):
                push = push + lanes_at(numbers, b_v // LANES + k * tiled + j) * numbers[gathered + j]
            q = (lanes_at(numbers, m + RHS_P * lanes + k) - (even + odd)) * lanes_at(numbers, m + PIVOT * lanes + k)
            v = lanes_at(numbers, m + RHS_Q * lanes + k) - rate - lanes_at(numbers, QQ * lanes + k) * q
            v = v * lanes_at(numbers, m + BY_QV * lanes + k)
            p = lanes_at(numbers, m + RHS_V * lanes + k) - push - lanes_at(numbers, VQ * lanes + k) * q
            p = (p - lanes_at(numbers, VV * lanes + k) * v) * lanes_at(numbers, m + BY_VP * lanes + k)
            put_lanes(numbers, m + RHS_P * lanes + k, p)
            put_lanes(numbers, m + RHS_V * lanes + k, v)
            put_lanes(numbers, m + RHS_Q * lanes + k, q)
        first, wide = one[MODE_AT], LANES * lanes
        for k in range(modes):
            for c in range(3):
                out[mode_at[first + 3 * k + c]] = numbers[made + (RHS_P + c) * wide + k]


@njit(cache=True, nogil=True, error_model="numpy")
def put_pivots(groups, every, pivot_inv):
    """Write the inverse pivots of all modes, three each, ahead of those of the other unknowns."""
    e = 0
    for group in range(groups.shape[0] // GROUP):
        one = vector_at(groups, GROUP * group, GROUP)
        made = places_in_group(one[MODES], one[ROWS], one[COLUMNS])[6] + one[NUMBERS]
        wide = LANES * in_lanes(one[MODES])
        for k in range(one[MODES]):
            for c in (PIVOT, BY_VP, BY_QV):
                pivot_inv[e] = every[made + c * wide + k]
                e += 1
