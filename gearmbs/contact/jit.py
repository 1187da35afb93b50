"""How this package compiles: cached, without Python's division checks; products may be contracted with sums."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gearmbs._jit import njit

CONTRACT = {"contract": True}
REASSOCIATE = {"contract": True, "reassoc": True}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function for use inside other kernels."""
    return njit(cache=True, error_model="numpy", fastmath=CONTRACT)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a small function that disappears in its callers, so that their loops over sections become vectors."""
    return njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)(function)


def summing(function: Callable[..., Any]) -> Any:
    """Compile a function whose sums over sections may be added up in any order, lane by lane."""
    return njit(cache=True, error_model="numpy", fastmath=REASSOCIATE)(function)
