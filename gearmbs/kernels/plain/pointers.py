"""Calls through addresses in the plain mode, of C functions made by `numba.cfunc`.

The own stages take the address of numba's internal entry and put it into numba's value of a function type, whose
members change from version to version. An exception leaves such an entry; of C functions see `plain.jit.c_function`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from numba import types

from gearmbs.kernels.bound import (
    F8,
    FUNCTIONS_TYPE,
    I8,
    IMAT,
    IVEC,
    MAT,
    VEC,
    PythonCallback,
    named,
    no_events,
    no_hook,
)  # fmt: skip
from gearmbs.kernels.plain.jit import Kernel, c_function, caller, checked, njit

__all__ = [
    "F8",
    "FUNCTIONS_TYPE",
    "I8",
    "IMAT",
    "IVEC",
    "MAT",
    "VEC",
    "PythonCallback",
    "address",
    "call_address",
    "caller",
    "direct",
    "no_events",
    "no_hook",
]


@cache
def address(function: Any, signature: Any) -> int:
    """Return the address of a kernel, or of what `numba.njit` made, as a C function; it is kept alive."""
    return named(c_function(function, signature).address, function)


@cache
def direct(kernel: Any) -> Callable:
    """Return what calls a kernel with a declared signature, compiled or loaded if needed."""
    return checked(kernel.compiled) if isinstance(kernel, Kernel) else kernel


_c_function_at = caller(types.void(F8, types.intp, types.intp, F8, types.intp))


@njit(cache=True, error_model="numpy")
def call_address(address, t, y, yp, extra, out):
    """Call the C function ``void f(double t, double *y, double *yp, double extra, double *out)`` at ``address``."""
    _c_function_at(address)(t, y.ctypes.data, yp.ctypes.data, extra, out.ctypes.data)
