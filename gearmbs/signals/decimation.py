"""The kernel of filters that lower the rate: only the samples that are kept are computed."""

from __future__ import annotations

from numba import float64, int64, void

from gearmbs._jit import njit

_VEC = float64[::1]


@njit(
    void(_VEC, _VEC, int64, _VEC),
    cache=True,
    error_model="numpy",
    fastmath={"contract": True, "reassoc": True},
    nogil=True,
)
def products(values, weights, every, out):
    """Write the products of ``weights`` with the values from each ``every``-th one on."""
    for k in range(out.size):
        first = every * k
        total = 0.0
        for i in range(weights.size):
            total += weights[i] * values[first + i]
        out[k] = total
