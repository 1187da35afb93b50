"""What is known of the sensitivities along a run while they are followed."""

from __future__ import annotations

from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES
from gearmbs.kernels.structs import IntVector, Matrix, Struct, Vector

BY = 1e-8
"""Part of a parameter's own scale, and of the rates along the past, by which the residual is moved: where it is not
linear in both together this leaves 1e-8, and the rounding 1e-16/1e-8, of the terms."""
MOST = 1e-4
"""Part of a parameter's own scale by which models are made beside each other: central differences of their tables are
off by 1e-8, and by the rounding of 1e-16/1e-4."""
MOVED = 1e-6
"""Largest part of their typical magnitude by which unknowns are moved along their sensitivities: from 1e-7 to 1e-5 the
derivative of a mesh force is the same in four digits, below rounding shows."""


class Track(Struct):
    """Sensitivities along a run: their history, where parameters stand, and scratch.

    Attributes
    ----------
    times : ndarray, shape (HISTORY,)
        Of the points of the history, newest first.
    y : ndarray, shape (HISTORY, n)
        The run there, in the coordinates that are valid now.
    before : ndarray, shape (HISTORY, n)
        The same slot by slot, until the coordinates have changed.
    s : ndarray, shape (HISTORY * g n LANES,)
        Sensitivities there: slot by slot, in each group by group, in each of these the `LANES` parameters of one
        unknown after another. Each point stays in its slot until it is the oldest.
    place, weight : ndarray
        Places in the table of numbers that parameters change, and the change by one of the parameter.
    first : ndarray of int64, shape (p + 1,)
        Where the places of each parameter begin.
    owner, equation : ndarray of int64
        Elements that the numbers of parameters belong to, and the equations of these.
    first_owner, first_equation : ndarray of int64, shape (p + 1,)
        Where those of each parameter begin; one whose numbers enter others, too, has no owner, and all equations.
    two_sided : ndarray of int64, shape (p,)
        Point up to which each is moved to both sides, for the residual bends with it.
    scale, differential : ndarray, shape (n,)
        Typical magnitude of each unknown; 1 for those whose derivative appears.
    slope_row, slope_col, slope_value : ndarray
        Entries of dG/dy', where it is constant.
    indptr, indices, vals : ndarray
        The matrix in CSC form.
    terms : ndarray, shape (n,)
        Sum of the sizes of the terms of each equation.
    row_scale : ndarray, shape (n,)
        Factors of the equations by which those of the plan are alike.
    plus, minus, other, yp_moved, between, found : ndarray, shape (n,)
        Scratch.
    rate, solved : ndarray, shape (n LANES,)
        Rates of a group along the past; scratch.
    value, slope, nodes : ndarray, shape (HISTORY + 1,)
        Coefficients.
    kept : ndarray
        Table of numbers while a parameter is moved.
    rows : ndarray, shape (HISTORY * (1 + 2 p), n)
        Points of the history, each followed by those moved along its sensitivities.
    old : ndarray of int64
        The integer table before the last change.
    table : ndarray of int64
        Scratch of the same size.
    sides, error, largest : ndarray, shape (g n LANES,)
        Right-hand sides, then what they gave; largest local error and largest value of each sensitivity.
    tested : ndarray, shape (n,)
        1 over the typical magnitude of unknowns under error control, 0 of others.
    allowed : ndarray, shape (p,)
        Local error of a step that is allowed, in typical magnitudes.
    most_rate, watched : ndarray, shape (n,)
        Largest rate of each unknown so far; 1 for those whose rates are looked at for jumps, else 0.
    left, rates : ndarray, shape (HISTORY, n)
        Slot by slot, residual and rates at points of which these are known.
    stack : ndarray, shape (3 DEEP, n)
        Residuals at ends and middle of intervals that are still to be looked at.
    looked_at : ndarray, shape (5, n)
        Residuals at the points of an interval.
    first_seen, seen_between, last_seen : ndarray, shape (n,)
        Scratch of looking for jumps.
    lost : ndarray, shape (p, n)
        Largest jump of each sensitivity that has not been followed.
    lost_at : ndarray, shape (p,)
        When the last of them was, or that was crossed, s.
    changes : ndarray, shape (m, 2)
        Between which times, s, the equations jump, or change within a part of a step, and that moves sensitivities.
    """

    parameters: int
    points: int  # tried so far
    n_past: int
    newest: int  # slot of the newest point
    seen: int  # outputs written
    has_hook: bool
    nonlinear_rates: bool
    constant_slopes: bool
    by_lanes: bool  # whether the plan can be gone through for several sides at once
    limited: bool  # whether local errors may be too large
    jumps: bool  # are looked for
    unseen: int  # steps that were not yet looked at
    changed: int  # rows of the table of changes
    known: int  # newest points of which residual and rates are known
    owner_place: int  # where the number of an element stands in the table of integers
    owner_rest: int  # what stands there otherwise
    owner_sums: int  # number of an element from which on it adds to equations
    growth_limit: float
    gamma: float  # of the matrix that is factored
    looked: float  # time at which it was, s
    over: float  # largest local error of the last step tried, as part of what is allowed
    times: Vector
    y: Matrix
    before: Matrix
    s: Vector
    place: IntVector
    weight: Vector
    first: IntVector
    owner: IntVector
    equation: IntVector
    first_owner: IntVector
    first_equation: IntVector
    two_sided: IntVector
    scale: Vector
    differential: Vector
    slope_row: IntVector
    slope_col: IntVector
    slope_value: Vector
    indptr: IntVector
    indices: IntVector
    vals: Vector
    plus: Vector
    minus: Vector
    other: Vector
    terms: Vector
    row_scale: Vector
    yp_moved: Vector
    between: Vector
    found: Vector
    rate: Vector
    solved: Vector
    value: Vector
    slope: Vector
    nodes: Vector
    kept: Vector
    rows: Matrix
    old: IntVector
    table: IntVector
    sides: Vector
    error: Vector
    largest: Vector
    tested: Vector
    allowed: Vector
    most_rate: Vector
    watched: Vector
    left: Matrix
    rates: Matrix
    stack: Matrix
    looked_at: Matrix
    first_seen: Vector
    seen_between: Vector
    last_seen: Vector
    lost: Matrix
    lost_at: Vector
    changes: Matrix


TRACK_TYPE = Track.numba_type


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def slot_of(tr, j):
    """Return the slot of the j-th point of the history, the newest being 0."""
    slot = tr.newest + j
    return slot - HISTORY if slot >= HISTORY else slot


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def groups(tr):
    """Return the number of groups of parameters."""
    return (tr.parameters + LANES - 1) // LANES


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def group_at(tr, j, g):
    """Return the place of a group's first lanes at the j-th point of the history."""
    return (slot_of(tr, j) * groups(tr) + g) * tr.scale.shape[0]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def lane_of(tr, j, p, i):
    """Return the place of unknown i's sensitivity to parameter p at the j-th point of the history."""
    return LANES * (group_at(tr, j, p // LANES) + i) + p % LANES


@njit(cache=True, nogil=True, error_model="numpy")
def size_of_move(tr, j, p):
    """Return by how much of a unit parameter p is moved along its sensitivities at the j-th point of the history."""
    largest = 0.0
    for i in range(tr.scale.shape[0]):
        largest = max(largest, abs(tr.s[lane_of(tr, j, p, i)]) / tr.scale[i])
    return min(MOST, MOVED / largest) if largest > 0.0 else MOST
