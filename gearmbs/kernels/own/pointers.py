"""How calls through addresses are compiled; see `gearmbs.kernels.pointers`."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from gearmbs.kernels.kinds import numba_of


def caller(signature: Any) -> Any:
    """Return what turns an address, in compiled code, into a function of ``signature`` that can be called."""
    function = types.FunctionType(numba_of(signature))

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
