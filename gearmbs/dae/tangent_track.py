"""What is known of the sensitivities along a run while they are followed."""

from __future__ import annotations

from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import IntVector, Matrix, Struct, Vector

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
    s : ndarray, shape (HISTORY * p, n)
        Sensitivities there, of all parameters slot after slot: each point stays in its slot until it is the oldest.
    place, weight : ndarray
        Places in the table of numbers that parameters change, and the change by one of the parameter.
    first : ndarray of int64, shape (p + 1,)
        Where the places of each parameter begin.
    scale, differential : ndarray, shape (n,)
        Typical magnitude of each unknown; 1 for those whose derivative appears.
    vals : ndarray
        CSC values of the matrix.
    plus, minus, yp_moved, rate, found : ndarray, shape (n,)
        Scratch.
    value, slope, nodes : ndarray, shape (HISTORY + 1,)
        Coefficients.
    kept : ndarray
        Table of numbers while a parameter is moved.
    before : ndarray, shape (HISTORY, n)
        History before a change of coordinates.
    rows : ndarray, shape (HISTORY * (1 + 2 p), n)
        Points of the history, each followed by those moved along its sensitivities.
    old : ndarray of int64
        The integer table before the last change.
    table : ndarray of int64
        Scratch of the same size.
    error, largest, local : ndarray, shape (p, n)
        Largest local error and largest value of each sensitivity, and its local error in the last step tried.
    tested : ndarray, shape (n,)
        1 over the typical magnitude of unknowns under error control, 0 of others.
    allowed : ndarray, shape (p,)
        Local error of a step that is allowed, in typical magnitudes.
    most_rate, watched : ndarray, shape (n,)
        Largest rate of each unknown so far; 1 for those whose rates are looked at for jumps, else 0.
    between, first_seen, seen_between, last_seen : ndarray, shape (n,)
        Scratch of looking for jumps.
    sides, solved : ndarray, shape (SIDES, n) and (n SIDES,)
        Right-hand sides of some parameters, then what they gave, and scratch of solving for them at once.
    lost : ndarray, shape (p, n)
        Largest jump of each sensitivity that has not been followed.
    lost_at : ndarray, shape (p,)
        When the last of them was, s.
    """

    parameters: int
    n_past: int
    newest: int  # slot of the newest point
    seen: int  # outputs written
    has_hook: bool
    nonlinear_rates: bool
    jumps: bool  # are looked for
    unseen: int  # steps that were not yet looked at
    growth_limit: float
    gamma: float  # of the matrix that is factored
    looked: float  # time at which it was, s
    over: float  # largest local error of the last step tried, as part of what is allowed
    times: Vector
    y: Matrix
    s: Matrix
    place: IntVector
    weight: Vector
    first: IntVector
    scale: Vector
    differential: Vector
    vals: Vector
    plus: Vector
    minus: Vector
    yp_moved: Vector
    rate: Vector
    found: Vector
    value: Vector
    slope: Vector
    nodes: Vector
    kept: Vector
    before: Matrix
    rows: Matrix
    old: IntVector
    table: IntVector
    error: Matrix
    largest: Matrix
    local: Matrix
    tested: Vector
    allowed: Vector
    most_rate: Vector
    watched: Vector
    between: Vector
    first_seen: Vector
    seen_between: Vector
    last_seen: Vector
    sides: Matrix
    solved: Vector
    lost: Matrix
    lost_at: Vector


TRACK_TYPE = Track.numba_type


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def slot_of(tr, j):
    """Return the slot of the j-th point of the history, the newest being 0."""
    slot = tr.newest + j
    return slot - HISTORY if slot >= HISTORY else slot


@njit(cache=True, nogil=True, error_model="numpy")
def size_of_move(tr, s, row):
    """Return by how much of a unit a parameter is moved whose sensitivities are a row of ``s``."""
    largest = 0.0
    for i in range(tr.scale.shape[0]):
        largest = max(largest, abs(s[row, i]) / tr.scale[i])
    return min(MOST, MOVED / largest) if largest > 0.0 else MOST
