"""Flat arrays seen as records in compiled code: named fields at fixed places, without the price of a slice."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numba.core.imputils import impl_ret_borrowed
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

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


INT = ir.IntType(64)


def _const(value: int) -> ir.Constant:
    return ir.Constant(INT, value)


def header(dtype: np.dtype, alignment: int = 1) -> Any:
    """Return an intrinsic that sees the beginning of an array as a record, from the next multiple of some bytes on."""
    kind, mask = from_dtype(dtype), -alignment

    @intrinsic
    def at(typingctx, array):
        def codegen(context, builder, signature, args):
            source = make_array(signature.args[0])(context, builder, args[0])
            address = builder.ptrtoint(source.data, INT)
            if mask != -1:
                address = builder.and_(builder.add(address, _const(~mask)), _const(mask))
            return builder.inttoptr(address, context.get_value_type(kind))

        return kind(array), codegen

    return at


def numbers(scalar: Any) -> Any:
    """Return an intrinsic that sees all numbers of a table from its header on; they are not counted."""
    result = types.Array(scalar, 1, "C")

    @intrinsic
    def of(typingctx, header):
        def codegen(context, builder, signature, args):
            out = make_array(result)(context, builder)
            data = builder.bitcast(args[0], out.data.type)
            populate_array(out, data=data, shape=[_const(2**60)], strides=[_const(8)], itemsize=_const(8), meminfo=None)
            return out._getvalue()

        return result(header), codegen

    return of


def behind(dtype: np.dtype, first: np.dtype) -> Any:
    """Return an intrinsic that finds record ``k`` of those that follow a first record."""
    kind = from_dtype(dtype)

    @intrinsic
    def at(typingctx, record, k):
        def codegen(context, builder, signature, args):
            base = builder.ptrtoint(args[0], INT)
            offset = builder.add(builder.mul(args[1], _const(dtype.itemsize)), _const(first.itemsize))
            return builder.inttoptr(builder.add(base, offset), context.get_value_type(kind))

        return kind(record, types.intp), codegen

    return at


def rows(dtype: np.dtype, lanes: int) -> Any:
    """Return an intrinsic that sees a record of numbers as an array, (rows, lanes)."""
    result = types.Array(types.float64, 2, "C")
    count = dtype.itemsize // (8 * lanes)

    @intrinsic
    def of(typingctx, record):
        def codegen(context, builder, signature, args):
            out = make_array(result)(context, builder)
            populate_array(
                out,
                data=builder.bitcast(args[0], out.data.type),
                shape=[_const(count), _const(lanes)],
                strides=[_const(8 * lanes), _const(8)],
                itemsize=_const(8),
                meminfo=None,
            )
            return out._getvalue()

        return result(record), codegen

    return of


@intrinsic
def before(typingctx, array):
    """Return an array of the same size that begins one number earlier."""

    def codegen(context, builder, signature, args):
        source = make_array(array)(context, builder, args[0])
        out = make_array(array)(context, builder)
        populate_array(
            out,
            data=builder.gep(source.data, [_const(-1)]),
            shape=source.shape,
            strides=source.strides,
            itemsize=source.itemsize,
            meminfo=None,
        )
        return impl_ret_borrowed(context, builder, array, out._getvalue())

    return array(array), codegen
