"""Lists of a static condensation: which modes stand apart, the matrix that is left, and where all numbers stand."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.linalg.condensed import (
    COLUMN_AT,
    COLUMNS,
    GROUP,
    MODE_AT,
    MODES,
    MOVED,
    NUMBERS,
    OWN,
    PP,
    PQ,
    PUSHED,
    PV,
    QQ,
    QV,
    RATED,
    ROW_AT,
    ROWS,
    SCHUR_AT,
    VP,
    VQ,
    VV,
    condense,
    fill,
    in_lanes,
    in_tiles,
    places_in_group,
)
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types, uint32
from gearmbs.kernels.lanes import LANES

FEWEST = 4
"""Modes that are worth a condensation: its loops over lanes of eight take as long for one."""
CANCELLED = 1e-3
"""Share of its terms below which a mode's pivot d has cancelled: the mode is then eliminated with all other unknowns.
Of a mode with positive mass and stiffness nothing cancels."""
PLACES = 4
"""Integers a mode: the places of its p, v and q, whose equations stand in the same, and its body."""

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]


@njit(_IVEC(int64, _IVEC), cache=True, nogil=True, error_model="numpy")
def modes_by_place(n, modes):
    """Return for each unknown 3 k + c, where it is p, v or q (c = 0, 1, 2) of mode k, and -1 for all others."""
    own = np.full(n, -1, dtype=np.int64)
    for k in range(modes.shape[0] // PLACES):
        for c in range(3):
            own[modes[PLACES * k + c]] = 3 * k + c
    return own


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def own_entry(row, column):
    """Return which of a mode's own entries one in equation ``row`` by unknown ``column`` is, -1 for one of p in q's."""
    if row == 0:
        return PP if column == 0 else PV if column == 1 else PQ
    if row == 1:
        return VP if column == 0 else VV if column == 1 else VQ
    return -1 if column == 0 else QV if column == 1 else QQ


@njit(_IVEC(_IVEC, _IVEC, _VEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def modes_apart(indptr, indices, vals, modes):
    """Return those of the modes that enter no other mode's equations, and whose pivots do not cancel; none if few.

    Parameters
    ----------
    indptr, indices, vals : ndarray
        Matrix in CSC form.
    modes : ndarray of int64
        `PLACES` of each mode, body by body.
    """
    n, count = indptr.shape[0] - 1, modes.shape[0] // PLACES
    own, apart, numbers = modes_by_place(n, modes), np.ones(count, dtype=np.bool_), np.zeros((count, OWN))
    for j in range(n if count > 0 else 0):
        for p in range(indptr[j], indptr[j + 1]):
            row, column = own[indices[p]], own[j]
            if column < 0:
                continue
            k = column // 3
            if row < 0:
                # p enters no other equations
                apart[k] &= column % 3 > 0
            elif row // 3 != k:
                apart[k] = apart[row // 3] = False
            else:
                entry = own_entry(row % 3, column % 3)
                if entry < 0:
                    apart[k] = False
                else:
                    numbers[k, entry] = vals[p]
    left = 0
    for k in range(count):
        if numbers[k, VP] == 0.0 or numbers[k, QV] == 0.0:
            apart[k] = False
        if apart[k]:
            f = numbers[k, PP] / numbers[k, VP]
            g = (numbers[k, PV] - f * numbers[k, VV]) / numbers[k, QV]
            one, two, three = numbers[k, PQ], f * numbers[k, VQ], g * numbers[k, QQ]
            apart[k] = abs(one - two - three) > CANCELLED * (abs(one) + abs(two) + abs(three))
        left += apart[k]
    if left < FEWEST:
        left = 0
    found, e = np.empty(PLACES * left, dtype=np.int64), 0
    for k in range(count if left > 0 else 0):
        if apart[k]:
            found[e : e + PLACES] = modes[PLACES * k : PLACES * (k + 1)]
            e += PLACES
    return found


@njit(types.Tuple((_IVEC, _UVEC, _UVEC, _UVEC))(_IVEC, _IVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def groups_of(indptr, indices, apart):
    """Return the bodies of modes and what each of them meets: fields of a `gearmbs.dae.linalg.lu_plan.LUPlan`.

    Parameters
    ----------
    indptr, indices : ndarray of int64
        Pattern.
    apart : ndarray of int64
        Of `modes_apart`.

    Returns
    -------
    groups : ndarray of int64
        `GROUP` integers a body.
    mode_at, rows, columns : ndarray of uint32
        Places of p, v and q; equations and unknowns of the blocks.
    """
    n, count = indptr.shape[0] - 1, apart.shape[0] // PLACES
    own, bodies = modes_by_place(n, apart), 0
    group_of = np.empty(count, dtype=np.int64)
    for k in range(count):
        bodies += k == 0 or apart[PLACES * k + 3] != apart[PLACES * k - 1]
        group_of[k] = bodies - 1
    groups, mode_at = np.zeros(GROUP * bodies, dtype=np.int64), np.empty(3 * count, dtype=np.uint32)
    meets, entered = np.zeros((bodies, n), dtype=np.int64), np.zeros((bodies, n), dtype=np.int64)
    for k in range(count):
        for c in range(3):
            mode_at[3 * k + c] = apart[PLACES * k + c]
        if k == 0 or group_of[k] != group_of[k - 1]:
            groups[GROUP * group_of[k] + MODE_AT] = 3 * k
        groups[GROUP * group_of[k] + MODES] += 1
    for j in range(n):
        for p in range(indptr[j], indptr[j + 1]):
            row, column = own[indices[p]], own[j]
            if row >= 0 and column < 0:
                # 1 by b_p, 2 by b_v, 4 by b_q
                meets[group_of[row // 3], j] |= 1 << (row % 3)
            elif row < 0 and column >= 0:
                entered[group_of[column // 3], indices[p]] |= column % 3
    rows, columns = np.empty(bodies * n, dtype=np.uint32), np.empty(bodies * n, dtype=np.uint32)
    a, b, size, block = 0, 0, 0, 0
    for group in range(bodies):
        one = groups[GROUP * group : GROUP * (group + 1)]
        one[ROW_AT], one[COLUMN_AT], one[NUMBERS], one[SCHUR_AT] = a, b, size, block
        # those entered by v first
        for turn in range(2):
            for i in range(n):
                if entered[group, i] > 0 and entered[group, i] & 1 == 1 - turn:
                    rows[a] = i
                    a += 1
            if turn == 0:
                one[MOVED] = a - one[ROW_AT]
        one[PUSHED] = n
        # those that meet b_q first, those that meet b_v alone last
        for turn in range(3):
            for j in range(n):
                kinds = meets[group, j]
                if kinds > 0 and turn == (0 if kinds & 4 else 2 if kinds & 2 else 1):
                    columns[b] = j
                    if kinds & 4:
                        one[RATED] = b + 1 - one[COLUMN_AT]
                    if kinds & 2:
                        one[PUSHED] = min(one[PUSHED], b - one[COLUMN_AT])
                    b += 1
        one[ROWS], one[COLUMNS] = a - one[ROW_AT], b - one[COLUMN_AT]
        one[PUSHED] = min(one[PUSHED], one[COLUMNS])
        block += one[ROWS] * one[COLUMNS]
        size += places_in_group(one[MODES], one[ROWS], one[COLUMNS])[12]
    return groups, mode_at, rows[:a].copy(), columns[:b].copy()


@njit(int64(_IVEC), cache=True, nogil=True, error_model="numpy")
def numbers_of(groups):
    """Return how many numbers all bodies take."""
    if groups.shape[0] == 0:
        return 0
    last = groups[groups.shape[0] - GROUP :]
    return last[NUMBERS] + places_in_group(last[MODES], last[ROWS], last[COLUMNS])[12]


@njit(
    types.Tuple((_UVEC, _UVEC))(_IVEC, _IVEC, _IVEC, _IVEC, _UVEC, _UVEC), cache=True, nogil=True, error_model="numpy"
)
def filled(indptr, indices, apart, groups, rows, columns):
    """Return where the entries of the modes' equations and unknowns stand among the numbers, and which these are.

    Parameters
    ----------
    indptr, indices, apart
        As of `groups_of`.
    groups, rows, columns
        From there.
    """
    n = indptr.shape[0] - 1
    own = modes_by_place(n, apart)
    at, src = np.empty(indices.shape[0], dtype=np.uint32), np.empty(indices.shape[0], dtype=np.uint32)
    row_place, column_place = np.full(n, -1, dtype=np.int64), np.full(n, -1, dtype=np.int64)
    e = 0
    for group in range(groups.shape[0] // GROUP):
        one = groups[GROUP * group : GROUP * (group + 1)]
        by_v, by_q, b_p, b_v, b_q, _, _, _, _, _, _, _, _ = places_in_group(one[MODES], one[ROWS], one[COLUMNS])
        wide, high, tiled = LANES * in_lanes(one[MODES]), LANES * in_lanes(one[ROWS]), in_tiles(one[COLUMNS])
        first = one[MODE_AT] // 3
        row_place[:], column_place[:] = -1, -1
        for i in range(one[ROWS]):
            row_place[rows[one[ROW_AT] + i]] = i
        for j in range(one[COLUMNS]):
            column_place[columns[one[COLUMN_AT] + j]] = j
        for j in range(n):
            for p in range(indptr[j], indptr[j + 1]):
                i = indices[p]
                row, column = own[i], own[j]
                # of another body
                if not (row >= 0 and 0 <= row // 3 - first < one[MODES]):
                    row = -1
                if not (column >= 0 and 0 <= column // 3 - first < one[MODES]):
                    column = -1
                if row < 0 and column < 0:
                    continue
                if row >= 0 and column >= 0:
                    place = own_entry(row % 3, column % 3) * wide + row // 3 - first
                elif column >= 0:
                    k = column // 3 - first
                    place = (by_v if column % 3 == 1 else by_q) + k * high + row_place[i]
                else:
                    k, kind = row // 3 - first, row % 3
                    start = b_p if kind == 0 else b_v if kind == 1 else b_q
                    place = start + LANES * (k // LANES * tiled + column_place[j]) + k % LANES
                at[e], src[e] = one[NUMBERS] + place, p
                e += 1
    return at[:e].copy(), src[:e].copy()


@njit(
    types.Tuple((_IVEC, _IVEC, _UVEC, _UVEC, _UVEC))(_IVEC, _IVEC, _IVEC, _IVEC, _UVEC, _UVEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def reduced_pattern(indptr, indices, apart, groups, rows, columns):
    """Return the pattern of the matrix that is left, with ones on the diagonal for the modes.

    Its values stand in another order: those from the whole matrix, what fills in, and one for all ones.

    Parameters
    ----------
    indptr, indices, apart, groups, rows, columns
        As of `filled`.

    Returns
    -------
    part_ptr, part_indices : ndarray of int64
        CSC form.
    slots : ndarray of uint32
        Where the value of each entry stands.
    rest_src : ndarray of uint32
        Entries of the whole matrix that are left.
    schur_at : ndarray of uint32
        Where the blocks of all bodies stand among the values, column by column.
    """
    n = indptr.shape[0] - 1
    own, bodies = modes_by_place(n, apart), groups.shape[0] // GROUP
    rest = 0
    for j in range(n):
        for p in range(indptr[j], indptr[j + 1]):
            rest += own[j] < 0 and own[indices[p]] < 0
    schur = 0
    place = np.full((bodies, n), -1, dtype=np.int64)
    for group in range(bodies):
        one = groups[GROUP * group : GROUP * (group + 1)]
        schur += one[ROWS] * one[COLUMNS]
        for j in range(one[COLUMNS]):
            place[group, columns[one[COLUMN_AT] + j]] = j
    part_ptr, room = np.zeros(n + 1, dtype=np.int64), rest + schur + n
    part, slots = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.uint32)
    rest_src, schur_at = np.empty(rest, dtype=np.uint32), np.empty(schur, dtype=np.uint32)
    slot_of = np.full(n, -1, dtype=np.int64)
    e, kept, fills = 0, 0, rest
    for j in range(n):
        first = e
        if own[j] >= 0:
            part[e] = j
            slot_of[j] = -2
            e += 1
        else:
            for p in range(indptr[j], indptr[j + 1]):
                i = indices[p]
                if own[i] < 0:
                    part[e], slot_of[i], rest_src[kept] = i, kept, p
                    e += 1
                    kept += 1
            for group in range(bodies):
                if place[group, j] < 0:
                    continue
                one = groups[GROUP * group : GROUP * (group + 1)]
                at = one[SCHUR_AT] + place[group, j] * one[ROWS]
                for k in range(one[ROWS]):
                    i = np.int64(rows[one[ROW_AT] + k])
                    if slot_of[i] < 0:
                        part[e], slot_of[i] = i, fills
                        e += 1
                        fills += 1
                    schur_at[at + k] = slot_of[i]
        for p in range(first + 1, e):
            # a library has no sorting of numpy's
            i, q = part[p], p
            while q > first and part[q - 1] > i:
                part[q] = part[q - 1]
                q -= 1
            part[q] = i
        for p in range(first, e):
            # the ones are marked, since their place is known at the end alone
            slots[p] = 0 if slot_of[part[p]] == -2 else slot_of[part[p]] + 1
            slot_of[part[p]] = -1
        part_ptr[j + 1] = e
    for p in range(e):
        slots[p] = fills if slots[p] == 0 else slots[p] - 1
    return part_ptr, part[:e].copy(), slots[:e].copy(), rest_src, schur_at


@njit(
    types.Tuple((_IVEC, _IVEC, _VEC))(_IVEC, _IVEC, _VEC, _IVEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def condensed_matrix(indptr, indices, scaled, apart):
    """Return the CSC form of a matrix without the modes that stand apart, which have ones on the diagonal."""
    if apart.shape[0] == 0:
        return indptr, indices, scaled
    groups, _, rows, columns = groups_of(indptr, indices, apart)
    fill_at, fill_src = filled(indptr, indices, apart, groups, rows, columns)
    part_ptr, part, slots, rest_src, schur_at = reduced_pattern(indptr, indices, apart, groups, rows, columns)
    every, rest, values = np.zeros(numbers_of(groups)), np.empty(rest_src.shape[0]), np.empty(max(slots) + 1)
    values[values.shape[0] - 1] = 1.0
    ones = np.ones(max(rest_src.shape[0], schur_at.shape[0]))
    fill(fill_at, fill_src, rest_src, ones, scaled, every, rest)
    condense(groups, schur_at, ones, every, rest, values)
    vals = np.empty(slots.shape[0])
    for p in range(slots.shape[0]):
        vals[p] = values[slots[p]]
    return part_ptr, part, vals


@njit(
    types.Tuple((_IVEC, _IVEC, _IVEC, _IVEC))(int64, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def modes_first(n, apart, rows, cols, l_ptr, u_ptr):
    """Return pivots with those of the condensed modes, which have no other entries, ahead of all others.

    Parameters
    ----------
    n : int
    apart, rows, cols, l_ptr, u_ptr
        Of `modes_apart` and `gearmbs.dae.linalg.pivoting.choose_pivots`.

    Returns
    -------
    rows, cols, l_ptr, u_ptr : ndarray
    """
    if apart.shape[0] == 0:
        return rows, cols, l_ptr, u_ptr
    own = modes_by_place(n, apart)
    by_row, by_col = np.empty_like(rows), np.empty_like(cols)
    below, right = np.zeros_like(l_ptr), np.zeros_like(u_ptr)
    e = 0
    for turn in range(2):
        for k in range(n):
            if (own[cols[k]] < 0) == (turn == 1):
                by_row[e], by_col[e] = rows[k], cols[k]
                below[e + 1] = below[e] + l_ptr[k + 1] - l_ptr[k]
                right[e + 1] = right[e] + u_ptr[k + 1] - u_ptr[k]
                e += 1
    return by_row, by_col, below, right
