"""Numba's type of a `gearmbs.dae.compiled.structs.Struct`: how compiled code reads and writes its members."""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic, lower_setattr_generic
from numba.core.typing.templates import AttributeTemplate
from numba.extending import NativeValue, infer_getattr, models, register_model, unbox
from numba.np.arrayobj import make_array, populate_array

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
