"""How `gearmbs.kernels.lanes` is compiled: eight numbers as one value of LLVM's, with operators and functions."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model
from numba.np.arrayobj import make_array

from gearmbs.kernels.lanes import LANES

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


def _broadcast(builder: Any, value: Any) -> Any:
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
            both = (a if kind == LANES_TYPE else _broadcast(builder, a) for a, kind in zip(args, sig.args))
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
        return _broadcast(builder, args[0])

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
