"""Eight numbers at a time in the plain mode: a named tuple of numbers, which numba knows; see `gearmbs.kernels.lanes`.

The processor treats them one by one, unless LLVM finds that they can be one vector.
"""

from __future__ import annotations

import operator
from collections import namedtuple
from collections.abc import Callable
from typing import Any

from numba import types
from numba.extending import intrinsic, lower_builtin, type_callable

from gearmbs.kernels.plain.jit import njit
from gearmbs.kernels.plain.views import vector_at

LANES = 8
"""Numbers in a value."""

Lanes = namedtuple("Lanes", "a b c d e f g h")
LANES_TYPE = types.NamedUniTuple(types.float64, LANES, Lanes)


def _define(operation: Callable, instruction: str) -> None:
    """Let an operation take lanes on both sides, or a number on one."""

    @type_callable(operation)
    def choose(context):
        def typer(first, second):
            both = first, second
            return LANES_TYPE if LANES_TYPE in both and all(a in (LANES_TYPE, types.float64) for a in both) else None

        return typer

    for kinds in ((LANES_TYPE, LANES_TYPE), (LANES_TYPE, types.float64), (types.float64, LANES_TYPE)):

        @lower_builtin(operation, *kinds)
        def lower(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
            return _lane_by_lane(builder, instruction, sig, args)


def _lane_by_lane(builder: Any, instruction: str, sig: Any, args: tuple) -> Any:
    """Return what an instruction makes of numbers of the same lane."""
    out = args[sig.args.index(LANES_TYPE)]
    for k in range(LANES):
        numbers = (builder.extract_value(a, k) if kind == LANES_TYPE else a for a, kind in zip(args, sig.args))
        out = builder.insert_value(out, getattr(builder, instruction)(*numbers), k)
    return out


for _name, _instruction in {"add": "fadd", "sub": "fsub", "mul": "fmul", "truediv": "fdiv"}.items():
    for _operation in (getattr(operator, _name), getattr(operator, f"i{_name}")):
        _define(_operation, _instruction)


@type_callable(operator.neg)
def _type_of_negative(context):
    return lambda lanes: LANES_TYPE if lanes == LANES_TYPE else None


@lower_builtin(operator.neg, LANES_TYPE)
def _lower_negative(context: Any, builder: Any, sig: Any, args: tuple) -> Any:
    return _lane_by_lane(builder, "fneg", sig, args)


@njit(cache=True, error_model="numpy")
def lanes_of(a, b, c, d, e, f, g, h):
    """Return lanes that hold eight numbers in turn.

    Parameters
    ----------
    a, b, c, d, e, f, g, h : float
    """
    return Lanes(a, b, c, d, e, f, g, h)


@njit(cache=True, error_model="numpy")
def all_lanes(number):
    """Return lanes that all hold the same number."""
    return Lanes(number, number, number, number, number, number, number, number)


@njit(cache=True, error_model="numpy")
def lanes_at(array, place):
    """Return the lanes in the given place of a flat table: ``array[LANES * place : LANES * (place + 1)]``."""
    v = vector_at(array, LANES * place, LANES)
    return Lanes(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7])


@njit(cache=True, error_model="numpy")
def put_lanes(array, place, value):
    """Write lanes to the given place of a flat table."""
    v = vector_at(array, LANES * place, LANES)
    v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7] = value


@njit(cache=True, error_model="numpy")
def magnitude(lanes):
    """Return the absolute value in each lane."""
    a, b, c, d, e, f, g, h = lanes
    return Lanes(abs(a), abs(b), abs(c), abs(d), abs(e), abs(f), abs(g), abs(h))


@njit(cache=True, error_model="numpy")
def larger_number(first, second):
    """Return the larger number in each lane, the second where one is none."""
    a, b, c, d, e, f, g, h = first
    i, j, k, l, m, n, o, p = second
    return Lanes(
        a if a > i else i, b if b > j else j, c if c > k else k, d if d > l else l,
        e if e > m else m, f if f > n else n, g if g > o else o, h if h > p else p,
    )  # fmt: skip


@intrinsic
def bits_of(typingctx, value):
    """Return the bit pattern of a double; of magnitudes it orders as they do."""
    return types.int64(types.float64), _same_bits


@intrinsic
def double_of(typingctx, bits):
    """Return the double with this bit pattern."""
    return types.float64(types.int64), _same_bits


def _same_bits(context: Any, builder: Any, signature: Any, args: tuple) -> Any:
    return builder.bitcast(args[0], context.get_value_type(signature.return_type))
