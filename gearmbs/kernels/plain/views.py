"""Memory as compiled code sees it, in the plain mode: addresses become pointers for `numba.carray`, or records.

The own mode writes numba's arrays member by member. Here numba does, and the members of structs are compiled functions
(`numba.extending.overload_attribute`).
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import carray, from_dtype, types
from numba.extending import (
    NativeValue,
    intrinsic,
    lower_setattr_generic,
    models,
    overload_attribute,
    register_model,
    unbox,
)

from gearmbs.kernels.kinds import numba_of
from gearmbs.kernels.plain.jit import njit


@cache
def placed(kind: Any) -> Any:
    """Return an intrinsic that takes an address for a pointer, or a record, of a type."""

    @intrinsic
    def at(typingctx, place):
        def codegen(context, builder, signature, args):
            return builder.inttoptr(args[0], context.get_value_type(kind))

        return kind(types.intp), codegen

    return at


@intrinsic
def _item(typingctx, array, place):
    """Return a pointer to what an array holds, at an address."""
    pointer = types.CPointer(array.dtype)

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[1], context.get_value_type(pointer))

    return pointer(array, types.intp), codegen


@intrinsic
def address_of(typingctx, seen):
    """Return the address of a record or a struct."""

    def codegen(context, builder, signature, args):
        return builder.ptrtoint(args[0], context.get_value_type(types.intp))

    return types.intp(seen), codegen


# Structs


class StructType(types.Type):
    """Numba's type of a `gearmbs.kernels.structs.Struct`; parameters are those of the own mode's."""

    def __init__(self, name: str, scalars: tuple, arrays: tuple) -> None:
        words = [(f"{a}:{k}", "i8") for a, _, dimensions in arrays for k in range(1 + dimensions)]
        self.layout = np.dtype([*scalars, *words], align=True)
        self.members: dict[str, types.Type] = {field: from_dtype(np.dtype(kind)) for field, kind in scalars}
        for field, kind, dimensions in arrays:
            self.members[field] = types.Array(from_dtype(np.dtype(kind)), dimensions, "C")
        for member in self.members:
            _declare(member)
        super().__init__(name=f"{name}({scalars}, {arrays})")


register_model(StructType)(models.OpaqueModel)


@unbox(StructType)
def _unbox(typ, value, c):
    held = c.pyapi.object_getattr_string(value, "_address")
    address = c.unbox(types.intp, held)
    c.pyapi.decref(held)
    return NativeValue(c.builder.inttoptr(address.value, c.context.get_value_type(typ)), is_error=address.is_error)


@cache
def _declare(member: str) -> None:
    """Let compiled code read a member of that name, of each struct that has one."""

    @overload_attribute(StructType, member, jit_options={"error_model": "numpy"})
    def choose(struct):
        kind = struct.members.get(member)
        if kind is None:
            return None
        record = placed(from_dtype(struct.layout))
        if not isinstance(kind, types.Array):
            return lambda struct: record(address_of(struct))[member]
        pointer = placed(types.CPointer(kind.dtype))
        data, first, second = (f"{member}:{k}" for k in range(3))
        if kind.ndim == 1:
            return lambda struct: carray(
                pointer(record(address_of(struct))[data]), (record(address_of(struct))[first],)
            )
        return lambda struct: carray(
            pointer(record(address_of(struct))[data]),
            (record(address_of(struct))[first], record(address_of(struct))[second]),
        )


@lower_setattr_generic(StructType)
def _set(context, builder, signature, args, member):
    struct, kind = signature.args
    if isinstance(kind, types.Array):
        raise NotImplementedError(f"arrays of {struct} are replaced in Python only")
    record = placed(from_dtype(struct.layout))

    def put(struct, value):
        record(address_of(struct))[member] = value

    return context.compile_internal(builder, put, signature, args)


# Views into flat arrays


@njit(cache=True, error_model="numpy")
def vector_at(array, first, size):
    """Return ``array.ravel()[first : first + size]``."""
    return carray(_item(array, array.ctypes.data + first * array.itemsize), (size,))


@njit(cache=True, error_model="numpy")
def matrix_at(array, first, rows, columns):
    """Return ``array.ravel()[first : first + rows * columns].reshape(rows, columns)``."""
    return carray(_item(array, array.ctypes.data + first * array.itemsize), (rows, columns))


@njit(cache=True, error_model="numpy")
def uncounted(array):
    """Return a view of a whole vector without its reference count."""
    return carray(_item(array, array.ctypes.data), (array.size,))


@njit(cache=True, error_model="numpy")
def uncounted_rows(table):
    """Return a view of a whole matrix without its reference count."""
    return carray(_item(table, table.ctypes.data), table.shape)


@njit(cache=True, error_model="numpy")
def before(array):
    """Return an array of the same size that begins one number earlier."""
    return carray(_item(array, array.ctypes.data - array.itemsize), array.shape)


# Flat arrays seen as records: named fields at fixed places


def header(dtype: np.dtype, alignment: int = 1) -> Any:
    """Return what sees the beginning of an array as a record, from the next multiple of some bytes on."""
    record, rest = placed(from_dtype(dtype)), alignment - 1

    @njit(error_model="numpy")
    def at(array):
        return record((array.ctypes.data + rest) & ~rest)

    return at


def numbers(scalar: Any) -> Any:
    """Return what sees all numbers of a table from its header on; they are not counted."""
    pointer = placed(types.CPointer(numba_of(scalar)))

    @njit(error_model="numpy")
    def of(header):
        return carray(pointer(address_of(header)), (2**60,))

    return of


def behind(dtype: np.dtype, first: np.dtype) -> Any:
    """Return what finds record ``k`` of those that follow a first record."""
    record, size, start = placed(from_dtype(dtype)), dtype.itemsize, first.itemsize

    @njit(error_model="numpy")
    def at(header, k):
        return record(address_of(header) + start + k * size)

    return at


def rows(dtype: np.dtype, lanes: int) -> Any:
    """Return what sees a record of numbers as an array, (rows, lanes)."""
    pointer, shape = placed(types.CPointer(types.float64)), (dtype.itemsize // (8 * lanes), lanes)

    @njit(error_model="numpy")
    def of(record):
        return carray(pointer(address_of(record)), shape)

    return of
