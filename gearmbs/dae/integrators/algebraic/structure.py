"""Which unknowns of a DAE are algebraic, and which equations determine them: the graph of both, and its matching."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from gearmbs.dae.integrators.differences import colour_columns
from gearmbs.dae.problem import DAEProblem
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types
from gearmbs.kernels.placed import bind, unbound
from gearmbs.kernels.pointers import FUNCTIONS_TYPE, direct, no_events, no_hook

KNOWN = 64
"""Structures kept."""
MOST_TOGETHER = 300
"""Equations that are solved together at an instant: their full matrix is factored in some 10 ms."""
MOST_RANKED = 200
"""Unknowns up to which the rank of dG/dx' is looked at, in some milliseconds."""
RANK = 1e-8
"""Singular value of the equilibrated dG/dx' below which it counts as zero, as rounding."""
PROBE = 1e-6
"""Part of an unknown by which it is moved to see in which equations it stands. Any change tells: it only has to be far
above rounding, and to leave the unknown where its equations are defined."""
PROBE_OF_RATE = 1e-3
"""The same of a rate, and of one where the rate is smaller, as most are zero at a start. Equations are linear in their
rates as a rule: a larger move then has less rounding and no error of its own."""
GENERIC = (1e-2, 1e-8)
"""Values, of their scales, that unknowns get in turn where they are zero at the start. Moved by `PROBE`, a product of
two of the first changes by 1e-10, far above rounding of a weight it is added to; where equations are not defined that
far from zero the second serves."""
_VEC = float64[::1]
_IVEC = int64[::1]
_BOOLS = types.boolean[::1]


@njit(
    types.boolean(
        FUNCTIONS_TYPE, float64, _VEC, _VEC, _VEC, _IVEC, _IVEC, _IVEC, _IVEC, _BOOLS, _BOOLS, _IVEC, _VEC, _VEC
    ),
    cache=True,
)
def _probe(bound, t, y, yp, sizes, indptr, indices, columns, groups, by_y, by_rate, idata, rdata, work):
    """Mark which rows each unknown and each rate changes at one point, those moved together that share no row.

    Parameters
    ----------
    bound : Functions
    t : float
    y, yp : ndarray, shape (n,)
        The point.
    sizes : ndarray, shape (n,)
        Least sizes that unknowns are changed by a part of.
    indptr, indices : ndarray of int64
        CSC pattern of the matrix.
    columns, groups : ndarray of int64
        Unknowns that are moved together, one group after the other, and where these begin and end.
    by_y, by_rate : ndarray of bool
        Entry by entry: marked where the row changes with the unknown, or rate; marks that are there stay.
    idata, rdata, work : ndarray
        Tables and scratch of the problem.

    Returns
    -------
    defined : bool
        Whether the equations are finite there.
    """
    n, functions = y.shape[0], unbound(bound)
    base, moved = np.empty(n), np.empty(n)
    functions.residual(t, y, yp, base, idata, rdata, work)
    if not np.isfinite(base).all():
        return False
    y_moved, yp_moved = y.copy(), yp.copy()
    for g in range(groups.shape[0] - 1):
        together = columns[groups[g] : groups[g + 1]]
        for j in together:
            y_moved[j] = y[j] + PROBE * max(abs(y[j]), sizes[j])
        functions.residual(t, y_moved, yp, moved, idata, rdata, work)
        for j in together:
            y_moved[j] = y[j]
            for p in range(indptr[j], indptr[j + 1]):
                i = indices[p]
                by_y[p] |= moved[i] != base[i] and np.isfinite(moved[i])
            yp_moved[j] = yp[j] + PROBE_OF_RATE * max(1.0, abs(yp[j]))
        functions.residual(t, y, yp_moved, moved, idata, rdata, work)
        for j in together:
            yp_moved[j] = yp[j]
            for p in range(indptr[j], indptr[j + 1]):
                i = indices[p]
                by_rate[p] |= moved[i] != base[i] and np.isfinite(moved[i])
    return True


def dependences(problem: DAEProblem) -> tuple[np.ndarray, np.ndarray]:
    """Return for each entry of the pattern whether its row depends on its unknown, and on the rate of that.

    They are tried at the start, and where all that is zero there is not: products of zeros hide a dependence.
    """
    n, entries = problem.n, len(problem.indices)
    by_y, by_rate = np.zeros(entries, dtype=bool), np.zeros(entries, dtype=bool)
    idata, rdata, work = problem.idata.copy(), problem.rdata.copy(), np.zeros(problem.work_size)
    sizes = np.minimum(np.abs(problem.scale), problem.atol_scale / PROBE)
    generic = 1.0 + np.arange(n) / (2.0 * n)
    y, yp = problem.y0.astype(float), problem.yp0.astype(float)
    away = np.where(yp == 0.0, PROBE_OF_RATE * generic, yp)
    functions = bind(problem.residual, problem.jacobian, no_hook, no_events)
    pattern = np.asarray(problem.indptr, dtype=np.int64), np.asarray(problem.indices, dtype=np.int64)
    colours = np.empty(n, dtype=np.int64)
    count = colour_columns(*pattern, colours)
    columns = np.argsort(colours, kind="stable").astype(np.int64)
    groups = np.searchsorted(colours[columns], np.arange(count + 1)).astype(np.int64)
    places = [(y, yp)] + [(np.where(y == 0.0, part * np.abs(problem.scale) * generic, y), away) for part in GENERIC]
    for k, place in enumerate(places):
        found = direct(_probe)(
            functions, float(problem.t0), *place, sizes, *pattern, columns, groups, by_y, by_rate, idata, rdata, work
        )
        if k > 0 and found:
            break
    return by_y, by_rate


def _determined(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return for each column its matched row, -1 without one, and whether the rows determine it.

    Parameters
    ----------
    edges : ndarray of bool, shape (rows, columns)
    """
    match = np.full(edges.shape[1], -1)
    if edges.any():
        # takes longer to load than many a run, which has no algebraic unknowns
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import maximum_bipartite_matching

        match = maximum_bipartite_matching(csr_array(edges.astype(np.int8)), perm_type="row")
    column_of = {int(row): c for c, row in enumerate(match) if row >= 0}
    open_ones = [int(c) for c in np.flatnonzero(match < 0)]
    free = set(open_ones)
    while open_ones:
        for row in np.flatnonzero(edges[:, open_ones.pop()]):
            c = column_of.get(int(row))
            if c is not None and c not in free:
                free.add(c)
                open_ones.append(c)
    determined = np.ones(edges.shape[1], dtype=bool)
    determined[list(free)] = False
    return match, determined


def _needed(edges: np.ndarray, match: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the columns that the matched rows of ``wanted`` hold, those that theirs hold, and so on.

    Returns
    -------
    needed : ndarray of int
    coupled : ndarray of int
        Those of ``wanted`` that would need more than `MOST_TOGETHER`, and are left.
    """
    needed: set[int] = set()
    coupled: set[int] = set()
    for first in wanted.tolist():
        found, open_ones = {first}, [first]
        while open_ones and len(found | needed) <= MOST_TOGETHER and not found & coupled:
            for c in np.flatnonzero(edges[match[open_ones.pop()]]).tolist():
                if c not in found and c not in needed:
                    found.add(c)
                    open_ones.append(c)
        if open_ones:
            coupled.add(first)
        else:
            needed |= found
    return np.array(sorted(needed), dtype=np.int64), np.array(sorted(coupled), dtype=np.int64)


class Graph:
    """Which unknowns and rates stand in which equations, and what is asked: all that a structure follows from.

    Parameters
    ----------
    *lists : ndarray
        Dependences on unknowns and on rates, entry by entry; wanted, solved for and differential unknowns, and those
        that are taken as they are, without being exact; pattern of the matrix.
    """

    def __init__(self, *lists: np.ndarray) -> None:
        self.lists = lists
        self._content = tuple((np.packbits(items) if items.dtype == bool else items).tobytes() for items in lists)

    def __hash__(self) -> int:
        return hash(self._content)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Graph) and self._content == other._content


class Structure(NamedTuple):
    """Unknowns left, unknowns that depend on too many others; equations, unknowns and entries of an `AlgebraicPart`."""

    left: np.ndarray
    coupled: np.ndarray
    rows: np.ndarray
    cols: np.ndarray
    lifted: np.ndarray
    rates: np.ndarray
    entries: np.ndarray


@lru_cache(maxsize=KNOWN)
def structure(graph: Graph) -> Structure:
    """Return what is solved for and by which equations; runs of alike problems find it once.

    Equations with unknowns that are taken as they are, such as multipliers, serve only for what the others leave open.
    """
    marked_y, marked_rate, wanted, solved, differential, taken, indptr, indices = graph.lists
    n = len(wanted)
    columns = np.repeat(np.arange(n), np.diff(indptr))
    by_y, by_rate = np.zeros((n, n), dtype=bool), np.zeros((n, n), dtype=bool)
    by_y[indices[marked_y], columns[marked_y]] = True
    by_rate[indices[marked_rate], columns[marked_rate]] = True
    unknown = np.concatenate((solved & by_y.any(axis=0), by_rate.any(axis=0) & differential))
    edges = np.concatenate((by_y, by_rate), axis=1) & unknown
    constraints = ~edges.any(axis=1) & ~by_y[:, ~differential].any(axis=1)
    edges[constraints, n:] = by_y[constraints] & unknown[n:]
    exact = np.asarray(~by_y[:, taken].any(axis=1))
    match, determined = _determined(edges & exact[:, None])
    determined &= unknown
    if not determined[wanted.nonzero()].all():
        rest = edges & ~determined
        rest[match[determined]] = False
        others, more = _determined(rest)
        match, determined = np.where(determined, match, others), determined | (more & unknown)
    asked = np.flatnonzero(wanted)
    found, coupled = _needed(edges, match, asked[determined[asked]])
    rows, cols, rates = match[found].astype(np.int64), found % n, found >= n
    lifted = constraints[rows]
    place = {int(row): k for k, row in enumerate(rows)}
    entries: list[tuple[int, int, int, int]] = []
    for c, (j, is_rate) in enumerate(zip(cols, rates)):
        for p in range(int(indptr[j]), int(indptr[j + 1])):
            k = place.get(int(indices[p]))
            if k is not None and (by_rate if is_rate and not lifted[k] else by_y)[rows[k], j]:
                entries.append((k, c, p, int(is_rate and not lifted[k])))
    table = np.array(entries, dtype=np.int64).reshape(-1, 4)
    return Structure(asked[~determined[asked]], coupled, rows, cols, lifted, rates, table)


def chosen(problem: DAEProblem) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return which unknowns are wanted at outputs, solved for if an equation needs them, and taken as they are."""
    algebraic = ~np.asarray(problem.differential, dtype=bool)
    free = algebraic & ~np.asarray(problem.error_mask, dtype=bool)
    if problem.solved_at_outputs is None:
        return free, algebraic, np.zeros_like(free)
    wanted = algebraic & problem.solved_at_outputs
    solved = wanted if problem.solved_if_needed is None else wanted | problem.solved_if_needed
    return wanted, solved, free & ~solved


def has_hidden_constraints(problem: DAEProblem) -> bool:
    """Return whether the rates of the differential unknowns depend on each other at the start: dG/dx' has a null space.

    Sums of equations are free of rates then, as in circuits of capacities without a path to the ground.
    """
    y, yp = problem.y0.astype(float), problem.yp0.astype(float)
    tables = problem.idata.copy(), problem.rdata.copy(), np.zeros(problem.work_size)
    base, moved = np.empty(problem.n), np.empty(problem.n)
    problem.residual(float(problem.t0), y, yp, base, *tables)
    columns = []
    for j in np.flatnonzero(problem.differential):
        d = PROBE_OF_RATE * max(1.0, abs(yp[j]))
        kept, yp[j] = yp[j], yp[j] + d
        problem.residual(float(problem.t0), y, yp, moved, *tables)
        yp[j] = kept
        columns.append((moved - base) / d)
    if not columns:
        return False
    matrix = np.array(columns).T
    if not np.isfinite(matrix).all():
        return True
    for axis in (1, 0):
        largest = np.abs(matrix).max(axis=axis, keepdims=True)
        matrix = matrix / np.where(largest > 0.0, largest, 1.0)
    return bool(np.linalg.matrix_rank(matrix, RANK) < matrix.shape[1])
