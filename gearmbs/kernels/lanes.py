"""Eight numbers at a time: values that hold the same quantity of eight neighbours, which the processor treats as one.

A table in lanes has `LANES` numbers where a table has one. What `lanes_at` reads of it is added and multiplied like a
number, in compiled code only, and `put_lanes` writes it. Compilers do not find this by themselves in code whose indices
come out of tables.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model
from numba.np.arrayobj import make_array

from gearmbs.kernels.jit import njit

LANES = 8
"""Numbers in a value; processors with narrower registers take several for it."""

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_PLACES = ir.VectorType(ir.IntType(32), LANES)


class LanesType(types.Type):
    """Numba's type of eight doubles."""

    def __init__(self) -> None:
        super().__init__(name=f"lanes of {LANES}")


LANES_TYPE = LanesType()


@register_model(LanesType)
class LanesModel(models.PrimitiveModel):
    """Stored as a vector of LLVM's."""

    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, _VECTOR)


def _spread(builder: Any, value: Any) -> Any:
    """Return a vector with the same number in all places."""
    nothing = ir.Constant(_VECTOR, ir.Undefined)
    one = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(one, nothing, ir.Constant(_PLACES, [0] * LANES))


def _define(operation: Callable, instruction: str) -> None:
    """Let an operation take lanes on both sides, or a number on one."""

    class Template(AbstractTemplate):
        def generic(self, args: tuple, kws: dict) -> Any:
            if len(args) == 2 and LANES_TYPE in args and all(a in (LANES_TYPE, types.float64) for a in args):
                return signature(LANES_TYPE, *args)
            return None

    infer_global(operation)(Template)
    for kinds in ((LANES_TYPE, LANES_TYPE), (LANES_TYPE, types.float64), (types.float64, LANES_TYPE)):

        @lower_builtin(operation, *kinds)
        def lower(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
            both = (a if kind == LANES_TYPE else _spread(builder, a) for a, kind in zip(args, sig.args))
            return getattr(builder, instruction)(*both)


for _name, _instruction in {"add": "fadd", "sub": "fsub", "mul": "fmul", "truediv": "fdiv"}.items():
    for _operation in (getattr(operator, _name), getattr(operator, f"i{_name}")):
        _define(_operation, _instruction)


@infer_global(operator.neg)
class _Negative(AbstractTemplate):
    def generic(self, args: tuple, kws: dict) -> Any:
        return signature(LANES_TYPE, LANES_TYPE) if args == (LANES_TYPE,) else None


@lower_builtin(operator.neg, LANES_TYPE)
def _lower_negative(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
    return builder.fneg(args[0])


def _address(context: Any, builder: Any, array: Any, value: Any, place: Any) -> Any:
    data = make_array(array)(context, builder, value).data
    first = builder.mul(place, ir.Constant(place.type, LANES))
    return builder.bitcast(cgutils.gep(builder, data, first), _VECTOR.as_pointer())


@intrinsic
def lanes_at(typingctx, array, place):
    """Return the lanes in the given place of a flat table: ``array[LANES * place : LANES * (place + 1)]``."""

    def codegen(context, builder, sig, args):
        return builder.load(_address(context, builder, array, *args), align=8)

    return LANES_TYPE(array, types.intp), codegen


@intrinsic
def put_lanes(typingctx, array, place, value):
    """Write lanes to the given place of a flat table."""

    def codegen(context, builder, sig, args):
        builder.store(args[2], _address(context, builder, array, *args[:2]), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, LANES_TYPE), codegen


@intrinsic
def all_lanes(typingctx, number):
    """Return lanes that all hold the same number."""

    def codegen(context, builder, sig, args):
        return _spread(builder, args[0])

    return LANES_TYPE(types.float64), codegen


@intrinsic
def lanes_of(typingctx, a, b, c, d, e, f, g, h):
    """Return lanes that hold eight numbers in turn."""

    def codegen(context, builder, sig, args):
        lanes = ir.Constant(_VECTOR, ir.Undefined)
        for k, number in enumerate(args):
            lanes = builder.insert_element(lanes, number, ir.Constant(ir.IntType(32), k))
        return lanes

    return LANES_TYPE(*[types.float64] * LANES), codegen


def _call(builder: Any, name: str, args: tuple) -> Any:
    """Return what a function of LLVM's makes of vectors."""
    kind = ir.FunctionType(_VECTOR, [_VECTOR] * len(args))
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64"), args)


@intrinsic
def magnitude(typingctx, lanes):
    """Return the absolute value in each lane."""

    def codegen(context, builder, sig, args):
        return _call(builder, "fabs", args)

    return LANES_TYPE(LANES_TYPE), codegen


@intrinsic
def larger_number(typingctx, first, second):
    """Return the larger number in each lane, the second where one is none: one instruction, ``maximum`` takes seven."""

    def codegen(context, builder, sig, args):
        return builder.select(builder.fcmp_ordered(">", *args), *args)

    return LANES_TYPE(LANES_TYPE, LANES_TYPE), codegen


# Magnitudes compared as integers, so that the compiler vectorises a maximum and no NaN is lost in it.
#
# The bit pattern of a non-negative double, read as an integer, orders as the number does, with infinity above all
# numbers and NaN above infinity. A maximum over patterns therefore needs no licence to reorder, costs one instruction a
# lane, and comes out as infinity or NaN as soon as one entry is not finite.


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


# Sines and cosines of eight angles at a time, which a library computes one after the other.
#
# An angle x is n quarter turns and a rest of at most an eighth of a turn. n pi/2 is taken off in two parts, the first
# of which times n is exact; sine and cosine of the rest are polynomials, and quarter turns exchange the two and their
# signs. Errors are at most an ulp of one.
#
# References
# ----------
# .. [1] S. Gal, B. Bachelis, "An accurate elementary mathematical library for the IEEE floating point standard",
#        ACM Trans. Math. Software 17 (1991) 26-45.
# .. [2] W. J. Cody, W. Waite, Software Manual for the Elementary Functions, Prentice-Hall, 1980.


FARTHEST_ANGLE = 1e5
"""Angle, rad, up to which the rest is exact to an ulp of one; the library takes larger ones."""

INTEGER = 6755399441055744.0
"""1.5 2^52: added to a number, it leaves no digits for a fraction."""

QUARTERS = 2.0 / np.pi
HALF_PI = 1.5707963267341256
"""First 33 bits of pi/2: times an n below 2^20 it has no rounding."""
HALF_PI_REST = 6.077100506506192e-11
"""What is left of pi/2, to a double: `pio2_1t` of fdlibm, as `HALF_PI` is its `pio2_1`."""

SINE = (-1.0 / 6.0, 0.008333333333330936, -0.00019841269836740532, 2.7557316093198404e-06,
        -2.5051129896450185e-08, 1.5917988979397432e-10)  # fmt: skip
"""(sin x - x)/x^3 in powers of x^2, interpolated at the Chebyshev points of |x| up to pi/4."""
COSINE = (1.0 / 24.0, -0.0013888888888887389, 2.48015872987544e-05, -2.755731726587808e-07,
          2.087614504941318e-09, -1.138254464534925e-11)  # fmt: skip
"""(cos x - 1 + x^2/2)/x^4 likewise."""


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"contract"})
def sines_and_cosines(angles):
    """Return sines and cosines of angles in lanes, each at most `FARTHEST_ANGLE` in size."""
    turns = (angles * QUARTERS + INTEGER) - INTEGER
    near = angles - turns * HALF_PI
    x = near - turns * HALF_PI_REST
    # what x has lost by rounding
    rest = (near - x) - turns * HALF_PI_REST
    z = x * x
    zz = z * z
    sine = SINE[1] + z * SINE[2] + zz * (SINE[3] + z * SINE[4] + zz * SINE[5])
    sine = x + (z * x * (SINE[0] + z * sine) + rest)
    cosine = z * (COSINE[0] + z * COSINE[1] + zz * (COSINE[2] + z * COSINE[3] + zz * (COSINE[4] + z * COSINE[5])))
    half = 0.5 * z
    most = 1.0 - half
    cosine = most + (((1.0 - most) - half) + (z * cosine - x * rest))
    # the turns modulo four, from -2 to 2, and the cosine and sine of so many
    turns = turns - 4.0 * ((0.25 * turns + INTEGER) - INTEGER)
    size = magnitude(turns)
    along, across = 1.0 - size, turns * (2.0 - size)
    return along * sine + across * cosine, along * cosine - across * sine


@njit(cache=True, error_model="numpy", forceinline=True)
def put_turns(y, first, second, out):
    """Write sines and cosines of two times three angles to lanes 0 and 1 of ``out``, six of the eight of each.

    Parameters
    ----------
    y : ndarray
    first, second : int
        Where in ``y`` the angles, rad, begin.
    out : ndarray
        16 places.
    """
    a, b, c, d, e, f = y[first], y[first + 1], y[first + 2], y[second], y[second + 1], y[second + 2]
    if abs(a) + abs(b) + abs(c) + abs(d) + abs(e) + abs(f) <= FARTHEST_ANGLE:
        sine, cosine = sines_and_cosines(lanes_of(a, b, c, d, e, f, 0.0, 0.0))
        put_lanes(out, 0, sine)
        put_lanes(out, 1, cosine)
        return
    for k in range(3):
        out[k], out[LANES + k] = np.sin(y[first + k]), np.cos(y[first + k])
        out[3 + k], out[LANES + 3 + k] = np.sin(y[second + k]), np.cos(y[second + k])
