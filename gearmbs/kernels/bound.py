"""What compiled code calls back, the same in both modes: Python functions, and the four functions of a DAE."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from typing import Any
from uuid import uuid4

import numpy as np

from gearmbs.dae.problem import EVENTS_SIG, HOOK_SIG, JACOBIAN_SIG, RESIDUAL_SIG
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.structs import Struct

VEC = types.float64[::1]
MAT = types.float64[:, ::1]
IVEC = types.int64[::1]
IMAT = types.int64[:, ::1]
F8 = types.float64
I8 = types.int64

_C_CALLBACK = ctypes.CFUNCTYPE(
    None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p
)

NAMES: dict[int, str] = {}
"""What stands behind each address in the tables of this process: the same name elsewhere is the same function."""
_PROCESS = uuid4().hex
_numbers = count()


def named(address: int, function: Any = None) -> int:
    """Return an address, noted with a name of its function in `NAMES`.

    The kernels of this package go by the places of their definitions, in all processes; other functions, which may be
    others under one name, and those of Python by numbers that are given once.
    """
    function = getattr(function, "py_func", function)
    name = f"{getattr(function, '__module__', '')}.{getattr(function, '__qualname__', '')}"
    of_package = name.startswith("gearmbs.") and "<" not in name
    NAMES[address] = name if of_package else f"{_PROCESS} {os.getpid()} {next(_numbers)}"
    return address


_trying: list[None] = []


@contextmanager
def trying() -> Iterator[None]:
    """Let Python functions fail inside, where they are asked about places that no solution may reach."""
    _trying.append(None)
    try:
        yield
    finally:
        _trying.pop()


class PythonCallback:
    """A Python function behind a C function pointer, safe to call from the compiled loop.

    Parameters
    ----------
    function : callable
        Called as ``function(t, y, yp, extra, out)`` with arrays over the integrator's memory.
    n, n_out : int
        Lengths of ``y`` and of ``out``.
    errors : list
        Exceptions are appended here, and ``out`` becomes NaN, so that the integrator stops.
    """

    def __init__(self, function: Callable, n: int, n_out: int, errors: list[BaseException]):
        views: dict[tuple[int, int], np.ndarray] = {}

        def view(address: int, length: int) -> np.ndarray:
            array = views.get((address, length))
            if array is None:
                array = np.ctypeslib.as_array((ctypes.c_double * length).from_address(address))
                views[address, length] = array
            return array

        def call(t, y, yp, extra, out):
            target = view(out, n_out)
            if errors:
                target[:] = np.nan
                return
            try:
                function(t, view(y, n), view(yp, n), extra, target)
            except BaseException as error:
                if not (_trying and isinstance(error, Exception)):
                    errors.append(error)
                target[:] = np.nan

        self._callback = _C_CALLBACK(call)
        self.address = named(ctypes.cast(self._callback, ctypes.c_void_p).value or 0)


# The four functions of a DAE bound together, so that handing them to compiled code costs next to nothing.
#
# Handing a compiled function to another as a typed pointer looks its address up anew each time, tens of microseconds
# in Python. A short run is over in less; so the addresses are looked up once for each problem.


class Functions(Struct):
    """Addresses of residual, Jacobian, hook and events, with the signatures of `gearmbs.dae.problem`."""

    residual: int
    jacobian: int
    hook: int
    events: int


SIGNATURES = {"residual": RESIDUAL_SIG, "jacobian": JACOBIAN_SIG, "hook": HOOK_SIG, "events": EVENTS_SIG}
FUNCTIONS_TYPE = Functions.struct_kind


@njit(HOOK_SIG, cache=True, nogil=True, error_model="numpy")
def no_hook(t, hist, npast, idata, rdata, work):
    """Stand in for a problem without a hook."""
    return 0


@njit(EVENTS_SIG, cache=True, nogil=True, error_model="numpy")
def no_events(t, y, yp, out, idata, rdata, work):
    """Stand in for a problem without events."""
