"""Calls through addresses: kernels compiled apart meet at run time.

Numba compiles everything a function calls into the function's own code. The kernels of force elements and of
expressions are large and are called from several of the equations' kernels, which would make each of them large too,
would recompile all of them when one changes, and would load them all for a mechanism that uses none. So the equations
call them through addresses that stand in the rows of the tables, put there when the tables are packed in this process.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

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
