"""Calls through addresses: kernels compiled apart meet at run time.

Numba compiles everything a function calls into the function's own code. The kernels of force elements and of
expressions are large and are called from several of the equations' kernels, which would make each of them large too,
would recompile all of them when one changes, and would load them all for a mechanism that uses none. So the equations
call them through addresses that stand in the rows of the tables, put there when the tables are packed in this process.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.experimental import structref
from numba.extending import intrinsic

from gearmbs.dae.problem import EVENTS_SIG, HOOK_SIG, JACOBIAN_SIG, RESIDUAL_SIG
from gearmbs.kernels.jit import njit

VEC = types.float64[::1]
MAT = types.float64[:, ::1]
IVEC = types.int64[::1]
IMAT = types.int64[:, ::1]
F8 = types.float64
I8 = types.int64


def caller(signature: Any) -> Any:
    """Return what turns an address, in compiled code, into a function of ``signature`` that can be called."""
    function = types.FunctionType(signature)

    @intrinsic
    def function_at(typingctx, address):
        def codegen(context, builder, sig, args):
            value = cgutils.create_struct_proxy(function)(context, builder)
            null = cgutils.get_null_value(cgutils.voidptr_t)
            value.c_addr = null
            value.py_addr = null
            value.jit_addr = builder.inttoptr(args[0], cgutils.voidptr_t)
            return value._getvalue()

        return function(types.int64), codegen

    return function_at


@cache
def address(dispatcher: Any, signature: Any) -> int:
    """Return the address of a compiled function in this process; the function is kept alive.

    Raises
    ------
    KeyError
        If it was not compiled for ``signature``.
    """
    compiled = dispatcher.overloads[signature.args]
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


# Calls of kernels from Python without a look at the types of their arguments.
#
# Numba finds out the types of what a kernel is called with each time; of a struct only Python can tell, in some
# microseconds. A kernel with a declared signature has one entry, and whoever knows the types can call that.


@cache
def direct(kernel: Any) -> Callable:
    """Return the entry of a kernel with a declared signature, compiled or loaded if needed.

    The caller answers for the types of the arguments.
    """
    if not hasattr(kernel, "ready"):
        # numba is switched off
        return kernel
    (entry,) = kernel.ready().overloads.values()
    return entry.entry_point


# Python functions behind C function pointers, called from compiled code.


@intrinsic
def call_address(typingctx, address, t, y, yp, extra, out):
    """Call the C function ``void f(double t, double *y, double *yp, double extra, double *out)`` at ``address``."""
    signature = types.void(types.int64, types.float64, y, yp, types.float64, out)

    def codegen(context, builder, sig, args):
        ll_double = context.get_value_type(types.float64)
        ll_pointer = ll_double.as_pointer()
        function_type = ir.FunctionType(ir.VoidType(), [ll_double, ll_pointer, ll_pointer, ll_double, ll_pointer])
        function = builder.inttoptr(args[0], function_type.as_pointer())
        pointers = [
            context.make_array(ty)(context, builder, value).data
            for ty, value in ((sig.args[2], args[2]), (sig.args[3], args[3]), (sig.args[5], args[5]))
        ]
        builder.call(function, [args[1], pointers[0], pointers[1], args[4], pointers[2]])
        return context.get_dummy_value()

    return signature, codegen


_C_CALLBACK = ctypes.CFUNCTYPE(
    None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p
)


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
                errors.append(error)
                target[:] = np.nan

        self._callback = _C_CALLBACK(call)
        self.address = ctypes.cast(self._callback, ctypes.c_void_p).value


# The four functions of a DAE bound together, so that handing them to compiled code costs next to nothing.
#
# Handing a compiled function to another as a typed pointer looks its address up anew each time, tens of microseconds
# in Python. A short run is over in less; so the addresses are looked up once for each problem.


BOUND = 64
"""Sets of functions kept bound."""


@structref.register
class FunctionsType(types.StructRef):
    """Numba's type of `Functions`."""


class Functions(structref.StructRefProxy):
    """Residual, Jacobian, hook and events, with the signatures of `gearmbs.dae.problem`."""

    def __new__(cls, residual, jacobian, hook, events):
        """Return the bound functions."""
        return structref.StructRefProxy.__new__(cls, residual, jacobian, hook, events)


FIELDS = {
    "residual": types.FunctionType(RESIDUAL_SIG),
    "jacobian": types.FunctionType(JACOBIAN_SIG),
    "hook": types.FunctionType(HOOK_SIG),
    "events": types.FunctionType(EVENTS_SIG),
}
structref.define_proxy(Functions, FunctionsType, list(FIELDS))
FUNCTIONS_TYPE = FunctionsType(list(FIELDS.items()))


@njit(FUNCTIONS_TYPE(*FIELDS.values()), cache=True)
def _bind(residual, jacobian, hook, events):
    return Functions(residual, jacobian, hook, events)


@lru_cache(maxsize=BOUND)
def bind(residual, jacobian, hook, events):
    """Return the four compiled functions bound together, the same object for the same functions."""
    return _bind(residual, jacobian, hook, events)


@njit(HOOK_SIG, cache=True, nogil=True, error_model="numpy")
def no_hook(t, hist, npast, idata, rdata, work):
    """Stand in for a problem without a hook."""
    return 0


@njit(EVENTS_SIG, cache=True, nogil=True, error_model="numpy")
def no_events(t, y, yp, out, idata, rdata, work):
    """Stand in for a problem without events."""
