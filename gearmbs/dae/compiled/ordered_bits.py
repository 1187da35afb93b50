"""Magnitudes compared as integers, so that the compiler vectorises a maximum and no NaN is lost in it.

The bit pattern of a non-negative double, read as an integer, orders as the number does, with infinity above all numbers
and NaN above infinity. A maximum over patterns therefore needs no licence to reorder, costs one instruction a lane, and
comes out as infinity or NaN as soon as one entry is not finite.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


def _bitcast(result: types.Type, lowered: ir.Type):
    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], lowered)

    return lambda argument: (result(argument), codegen)


_TO_BITS = _bitcast(types.int64, ir.IntType(64))
_FROM_BITS = _bitcast(types.float64, ir.DoubleType())


@intrinsic
def bits_of(typingctx, value):
    """Return the bit pattern of a double; of magnitudes it orders as they do."""
    return _TO_BITS(types.float64)


@intrinsic
def double_of(typingctx, bits):
    """Return the double with this bit pattern."""
    return _FROM_BITS(types.int64)
