"""How kernels of contact are compiled; the records that they see are those of `gearmbs.kernels.views`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gearmbs.kernels.jit import njit

# How kernels of contact compile: cached, without Python's division checks; products may be contracted with sums.
#
# A quotient may become a product with the reciprocal, which is one unit in the last place less exact: loops over
# sections divide by what all of them share, and a division costs as much as ten products.


CONTRACT = {"contract": True, "arcp": True}
REASSOCIATE = {**CONTRACT, "reassoc": True}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function for use inside other kernels."""
    return njit(cache=True, error_model="numpy", fastmath=CONTRACT)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a small function that disappears in its callers, so that their loops over sections become vectors."""
    return njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)(function)


def summing(function: Callable[..., Any]) -> Any:
    """Compile a function whose sums over sections may be added up in any order, lane by lane."""
    return njit(cache=True, error_model="numpy", fastmath=REASSOCIATE)(function)
