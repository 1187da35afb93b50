"""Calls through addresses in the plain mode, of C functions made by `numba.cfunc`; the rest is as in the own mode.

The own stages take the address of numba's internal entry and put it into numba's value of a function type, whose
members change from version to version. An exception leaves such an entry; of C functions see `plain.jit.c_function`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any

from gearmbs.kernels import pointers
from gearmbs.kernels.plain.jit import Kernel, c_function, caller, checked

__all__ = ["address", "bind", "caller", "direct"]


def __getattr__(name: str) -> Any:
    return getattr(pointers, name)


@cache
def address(function: Any, signature: Any) -> int:
    """Return the address of a kernel, or of what `numba.njit` made, as a C function; it is kept alive."""
    return c_function(function, signature).address


@cache
def direct(kernel: Any) -> Callable:
    """Return what calls a kernel with a declared signature, compiled or loaded if needed."""
    return checked(kernel.compiled) if isinstance(kernel, Kernel) else kernel


@lru_cache(maxsize=pointers.BOUND)
def bind(residual, jacobian, hook, events):
    """Return the four compiled functions bound together, the same object for the same functions."""
    functions = (residual, jacobian, hook, events)
    return pointers.bind(*(f.compiled if isinstance(f, Kernel) else f for f in functions))
