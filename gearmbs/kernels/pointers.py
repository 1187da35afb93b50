"""Calls through addresses: kernels compiled apart meet at run time.

Numba compiles everything a function calls into the function's own code. The kernels of force elements and of
expressions are large and are called from several of the equations' kernels, which would make each of them large too,
would recompile all of them when one changes, and would load them all for a mechanism that uses none. So the equations
call them through addresses that stand in the rows of the tables, put there when the tables are packed in this process.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from gearmbs.kernels.bound import (
    F8,
    FUNCTIONS_TYPE,
    I8,
    IMAT,
    IVEC,
    MAT,
    VEC,
    PythonCallback,
    bind,
    named,
    no_events,
    no_hook,
)  # fmt: skip

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
    "bind",
    "call_address",
    "caller",
    "direct",
    "no_events",
    "no_hook",
]


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
    return named(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name), dispatcher)


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
