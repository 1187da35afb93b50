"""Entries of a matrix that count: the others, negligible in all matrices so far, stay out of a plan.

Mechanisms that move in a plane, or wheels on axes that hardly tilt, leave many entries of a pattern made for motions in
space at zero but for rounding. Second derivatives of constraints and loads by modal coordinates are far below the
stiffness of the modes; the iteration of a corrector, which only needs to converge, may do without them.
"""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64, types, uint32

from gearmbs._jit import njit
from gearmbs.dae.linalg.pivoting import equilibrate

NEGLIGIBLE = 1e-13
"""Size up to which an entry of the equilibrated matrix may stay left out of a plan: it is rounding."""
NEGLIGIBLE_IN_NEWTON = 1e-4
"""The same of a Newton matrix with many small entries, if the corrector converges without them, see `RATE_ALLOWED`."""
WHEN_PLANNED = 0.01
"""Share of that size from which on an entry counts when a plan is made."""
RATE_ALLOWED = 0.02
"""Largest part of an error that a correction may leave for lack of these entries: the corrector expects no less."""
WORTH_LEAVING = 0.8
"""Largest share of entries that count with which the others are left out: fewer would not pay for looking at them."""
FEWEST_ENTRIES = 200
"""Of a matrix from which some are left out: a smaller one is factored as fast as they are looked at."""
LEAVING_PLANS = 12
"""Plans that may leave entries out; a run that needs more of them, and often, is taken to need all entries."""
STEPS_A_PLAN = 1000
"""Steps of a run for each further such plan: making one takes as long as some fifty steps."""

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]
_MASK = boolean[::1]


@njit(types.Tuple((_VEC, _VEC, _VEC))(_IVEC, _IVEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def scaled_entries(indptr, indices, vals, scale):
    """Return the scales of rows and columns, and the values with them."""
    n = indptr.shape[0] - 1
    row_scale = np.ones(n)
    col_scale = scale.copy()
    equilibrate(indptr, indices, vals, row_scale, col_scale)
    scaled = np.empty(indices.shape[0])
    for j in range(n):
        for p in range(indptr[j], indptr[j + 1]):
            scaled[p] = vals[p] * row_scale[indices[p]] * col_scale[j]
    return row_scale, col_scale, scaled


@njit(types.Tuple((_UVEC, _UVEC))(_VEC, _MASK, float64), cache=True, nogil=True, error_model="numpy")
def part_entries(scaled, counted, small):
    """Mark entries larger than ``small`` as counted; return the indices of those to plan for, and of those left out."""
    total = 0
    for p in range(scaled.shape[0]):
        if not abs(scaled[p]) <= small:
            counted[p] = True
        if counted[p]:
            total += 1
    if total > WORTH_LEAVING * scaled.shape[0]:
        counted[:] = True
        total = scaled.shape[0]
    taken, left = np.empty(total, dtype=np.uint32), np.empty(scaled.shape[0] - total, dtype=np.uint32)
    k = 0
    for p in range(scaled.shape[0]):
        if counted[p]:
            taken[k] = p
            k += 1
        else:
            left[p - k] = p
    return taken, left


@njit(types.Tuple((_IVEC, _IVEC, _VEC))(_IVEC, _IVEC, _VEC, _UVEC), cache=True, nogil=True, error_model="numpy")
def taken_pattern(indptr, indices, scaled, taken):
    """Return the CSC form of the entries ``taken`` of a matrix."""
    part_ptr = np.zeros_like(indptr)
    part, values = np.empty(taken.shape[0], dtype=np.int64), np.empty(taken.shape[0])
    e = 0
    for j in range(indptr.shape[0] - 1):
        while e < taken.shape[0] and taken[e] < indptr[j + 1]:
            part[e], values[e] = indices[taken[e]], scaled[taken[e]]
            e += 1
        part_ptr[j + 1] = e
    return part_ptr, part, values


@njit(_VEC(_IVEC, _IVEC, _UVEC, _VEC, _VEC, float64), cache=True, nogil=True, error_model="numpy")
def limits(indptr, indices, left, row_scale, col_scale, negligible):
    """Return the absolute values up to which the entries ``left`` are negligible in the equilibrated matrix."""
    limits = np.empty(left.shape[0])
    e = 0
    for j in range(indptr.shape[0] - 1):
        while e < left.shape[0] and left[e] < indptr[j + 1]:
            limits[e] = negligible / (row_scale[indices[left[e]]] * col_scale[j])
            e += 1
    return limits
