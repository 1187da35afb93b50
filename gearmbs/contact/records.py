"""Flat arrays seen as records in compiled code: named fields at fixed places, without the price of a slice."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numba.core.imputils import impl_ret_borrowed
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from gearmbs.contact import layout as L

INT = ir.IntType(64)


def _const(value: int) -> ir.Constant:
    return ir.Constant(INT, value)


def _header(dtype: np.dtype, mask: int = -1) -> Any:
    """Return an intrinsic that sees the beginning of an array as a record, aligned by a mask of address bits."""
    kind = from_dtype(dtype)

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


options_at = _header(L.OPTIONS)
"""``options_at(gi)``: the header of a pair's integers."""
pair_at = _header(L.PAIR)
"""``pair_at(gr)``: the header of its reals."""
scratch_at = _header(L.SCRATCH, -L.CACHE_LINE)
"""``scratch_at(work)``: the scratch record; strips follow."""


def _numbers(scalar: Any) -> Any:
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


integers_of = _numbers(types.int64)
"""``integers_of(options)``: all of ``gi``."""
reals_of = _numbers(types.float64)
"""``reals_of(wheels)``: all of ``gr``."""

_STRIP = from_dtype(L.STRIP)


@intrinsic
def strip_at(typingctx, scratch, k):
    """Return strip ``k`` behind the scratch record."""

    def codegen(context, builder, signature, args):
        base = builder.ptrtoint(args[0], INT)
        offset = builder.add(builder.mul(args[1], _const(L.STRIP.itemsize)), _const(L.SCRATCH.itemsize))
        return builder.inttoptr(builder.add(base, offset), context.get_value_type(_STRIP))

    return _STRIP(scratch, types.intp), codegen


@intrinsic
def rows_of(typingctx, strip):
    """Return all rows of a strip as an array, (rows, LANES)."""
    result = types.Array(types.float64, 2, "C")

    def codegen(context, builder, signature, args):
        out = make_array(result)(context, builder)
        data = builder.bitcast(args[0], out.data.type)
        rows = L.STRIP.itemsize // (8 * L.LANES)
        populate_array(
            out,
            data=data,
            shape=[_const(rows), _const(L.LANES)],
            strides=[_const(8 * L.LANES), _const(8)],
            itemsize=_const(8),
            meminfo=None,
        )
        return out._getvalue()

    return result(strip), codegen


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
