"""Entries of a matrix that count: the others, zero but for rounding in all matrices so far, stay out of a plan.

Mechanisms that move in a plane, or wheels on axes that hardly tilt, leave many entries of a pattern made for motions in
space at zero but for rounding.
"""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64, types, uint32

from gearmbs._jit import njit
from gearmbs.dae.linalg.pivoting import equilibrate

ROUNDING = 1e-15
"""Size of an entry of the equilibrated matrix up to which it is rounding when a plan is made."""
NEGLIGIBLE = 1e-13
"""Size up to which it may stay left out of the plan."""
WORTH_LEAVING = 0.8
"""Largest share of entries that count with which the others are left out: fewer would not pay for looking at them."""
FEWEST_ENTRIES = 200
"""Of a matrix from which some are left out: a smaller one is factored as fast as they are looked at."""
LEAVING_PLANS = 12
"""Plans of a run that may leave entries out; after so many it is taken to need them all."""

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


@njit(types.Tuple((_UVEC, _UVEC))(_VEC, _MASK), cache=True, nogil=True, error_model="numpy")
def part_entries(scaled, counted):
    """Mark the entries that count in ``counted``; return the indices of those to plan for, and of those left out."""
    total = 0
    for p in range(scaled.shape[0]):
        if not abs(scaled[p]) <= ROUNDING:
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


@njit(_VEC(_IVEC, _IVEC, _UVEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def limits(indptr, indices, left, row_scale, col_scale):
    """Return the absolute values up to which the entries ``left`` are negligible."""
    limits = np.empty(left.shape[0])
    e = 0
    for j in range(indptr.shape[0] - 1):
        while e < left.shape[0] and left[e] < indptr[j + 1]:
            limits[e] = NEGLIGIBLE / (row_scale[indices[left[e]]] * col_scale[j])
            e += 1
    return limits
