"""How `gearmbs.kernels.views` is compiled: members of structs, parts of tables, records.

What is seen is neither counted nor owned: whoever looks answers for the memory to be there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed, lower_getattr_generic, lower_setattr_generic
from numba.core.typing.templates import AttributeTemplate
from numba.extending import NativeValue, infer_getattr, intrinsic, models, register_model, unbox
from numba.np.arrayobj import make_array, populate_array

from gearmbs.kernels.kinds import numba_of

# Numba's type of a `gearmbs.kernels.structs.Struct`: how compiled code reads and writes its members.


_WORD = 8


class StructType(types.Type):
    """Numba's type of a `Struct`.

    Parameters
    ----------
    name : str
        Name of the class.
    scalars : tuple of (str, str)
        Names and numpy kinds.
    arrays : tuple of (str, str, int)
        Names, numpy kinds and numbers of dimensions.
    """

    def __init__(self, name: str, scalars: tuple, arrays: tuple) -> None:
        self.layout = np.dtype(
            [*scalars, *((f"{a}:", "i8", (1 + dimensions,)) for a, _, dimensions in arrays)], align=True
        )
        self.members: dict[str, types.Type] = {field: from_dtype(np.dtype(kind)) for field, kind in scalars}
        for field, kind, dimensions in arrays:
            self.members[field] = types.Array(from_dtype(np.dtype(kind)), dimensions, "C")
        super().__init__(name=f"{name}({scalars}, {arrays})")

    def offset(self, member: str) -> int:
        """Return the place of a scalar, or of an array's address and shape, in bytes."""
        assert self.layout.fields is not None
        key = member if member in self.layout.fields else f"{member}:"
        return self.layout.fields[key][1]


register_model(StructType)(models.OpaqueModel)


@unbox(StructType)
def _unbox(typ, value, c):
    address = c.pyapi.object_getattr_string(value, "_address")
    pointer = c.builder.inttoptr(c.pyapi.long_as_longlong(address), cgutils.voidptr_t)
    c.pyapi.decref(address)
    return NativeValue(pointer)


@infer_getattr
class _Members(AttributeTemplate):
    key = StructType

    def generic_resolve(self, typ, attribute):
        return typ.members.get(attribute)


def _place(builder, value, offset, pointee):
    byte = ir.IntType(8)
    place = builder.gep(value, [ir.Constant(ir.IntType(64), offset)], inbounds=True, source_etype=byte)
    return builder.bitcast(place, pointee.as_pointer())


@lower_getattr_generic(StructType)
def _get(context, builder, typ, value, attribute):
    member = typ.members[attribute]
    offset = typ.offset(attribute)
    if not isinstance(member, types.Array):
        return context.unpack_value(builder, member, _place(builder, value, offset, context.get_data_type(member)))
    word = ir.IntType(64)

    def fixed(index):
        # arrays are not replaced while compiled code runs
        load = builder.load(_place(builder, value, offset + _WORD * index, word))
        load.set_metadata("invariant.load", builder.module.add_metadata([]))
        return load

    out = make_array(member)(context, builder)
    item = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(member.dtype)))
    shape = [fixed(1 + d) for d in range(member.ndim)]
    strides = [item]
    for size in shape[:0:-1]:
        strides.insert(0, builder.mul(strides[0], size))
    data = builder.inttoptr(fixed(0), context.get_data_type(member.dtype).as_pointer())
    populate_array(out, data=data, shape=shape, strides=strides, itemsize=item, meminfo=None)
    return out._getvalue()


@lower_setattr_generic(StructType)
def _set(context, builder, signature, args, attribute):
    typ, member = signature.args
    if isinstance(member, types.Array):
        raise NotImplementedError(f"arrays of {typ} are replaced in Python only")
    place = _place(builder, args[0], typ.offset(attribute), context.get_data_type(member))
    context.pack_value(builder, member, args[1], place)


# Views into flat arrays for compiled code, without the price of a slice.
#
# A slice of numba's normalises its bounds and counts a reference, a reshape calls a C function: some 40 ns each, which
# a residual of a few microseconds that unpacks two dozen tables cannot afford. These views know that they lie inside,
# and live no longer than the array they look into.


def _view(dimensions: int):
    def typing(array, *places):
        if not isinstance(array, types.Array) or array.layout != "C":
            return None
        if not all(isinstance(place, types.Integer) for place in places):
            return None
        return types.Array(array.dtype, dimensions, "C")(array, *[types.intp] * len(places))

    def codegen(context, builder, signature, args):
        source = make_array(signature.args[0])(context, builder, args[0])
        out = make_array(signature.return_type)(context, builder)
        size = context.get_abi_sizeof(context.get_data_type(signature.return_type.dtype))
        itemsize = context.get_constant(types.intp, size)
        first, *shape = args[1:]
        strides = [itemsize] if dimensions == 1 else [builder.mul(shape[1], itemsize), itemsize]
        populate_array(
            out,
            data=cgutils.gep(builder, source.data, first),
            shape=shape,
            strides=strides,
            itemsize=itemsize,
            meminfo=None,
        )
        return impl_ret_borrowed(context, builder, signature.return_type, out._getvalue())

    return typing, codegen


_VECTOR, _MATRIX = _view(1), _view(2)


@intrinsic
def vector_at(typingctx, array, first, size):
    """Return ``array.ravel()[first : first + size]``."""
    signature = _VECTOR[0](array, first, size)
    return (signature, _VECTOR[1]) if signature is not None else None


@intrinsic
def matrix_at(typingctx, array, first, rows, columns):
    """Return ``array.ravel()[first : first + rows * columns].reshape(rows, columns)``."""
    signature = _MATRIX[0](array, first, rows, columns)
    return (signature, _MATRIX[1]) if signature is not None else None


# Flat arrays seen as records: named fields at fixed places.


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
    result = types.Array(numba_of(scalar), 1, "C")

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
