"""Python functions behind C function pointers, called from compiled code."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic


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
