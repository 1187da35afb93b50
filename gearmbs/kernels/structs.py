"""Structs of named scalars and arrays, the same object in Python and in compiled code.

A tuple of arrays is costly in compiled code: each function that takes it counts a reference of each array, tens of
atomic operations a call, and the compiler works through all of them. A `Struct` crosses over as one pointer to a record
that holds the scalars, and address and shape of each array. ``st.order`` and ``st.y[i]`` read the same in Python and in
compiled code, ``st.order = 2`` too; an array can be replaced in Python only. The Python object owns the arrays and has
to outlive the call.
"""

from __future__ import annotations

import ctypes
import inspect
import math
import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Generic, Self, TypeAlias, TypeVar

import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed, lower_getattr_generic, lower_setattr_generic
from numba.core.typing.templates import AttributeTemplate
from numba.extending import NativeValue, infer_getattr, intrinsic, models, register_model, typeof_impl, unbox
from numba.np.arrayobj import make_array, populate_array

from gearmbs.kernels.jit import njit

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


Vector: TypeAlias = np.ndarray
"""Annotation of a member: doubles with one dimension."""
Matrix: TypeAlias = np.ndarray
"""Doubles with two dimensions."""
IntVector: TypeAlias = np.ndarray
"""64-bit integers."""
IndexVector: TypeAlias = np.ndarray
"""Unsigned 32-bit integers."""

SCALARS = {"float": "f8", "int": "i8", "bool": "?"}
ARRAYS = {"Vector": ("f8", 1), "Matrix": ("f8", 2), "IntVector": ("i8", 1), "IndexVector": ("u4", 1)}
_C_TYPES = {"f8": ctypes.c_double, "i8": ctypes.c_int64, "?": ctypes.c_bool}
_CASTS = {"f8": float, "i8": int, "?": bool}
_byte_of: Callable[[Any], ctypes.c_char] = ctypes.c_char.from_buffer
_address_of = ctypes.addressof
_NO_BLOCK: tuple[None, int, dict] = None, 0, {}
LINE = 64
"""Bytes of a line of the processor's cache."""
KEPT_LAYOUTS = 64
"""Sets of sizes for which a kind of struct keeps its layout."""


class Struct:
    """Base of structs; a subclass annotates its members with float, int, bool, or an array of this module.

    Scalars start at zero unless they are given; arrays have to be given.

    Attributes
    ----------
    scalar_members, array_members : mapping
        Numpy kind of each scalar; kind and number of dimensions of each array.
    numba_type : StructType
        For signatures of compiled functions.
    """

    scalar_members: ClassVar[Mapping[str, str]]
    array_members: ClassVar[Mapping[str, tuple[str, int]]]
    numba_type: ClassVar[StructType]
    _record_type: ClassVar[type[ctypes.Structure]]
    _casts: ClassVar[Mapping[str, Callable[[Any], Any]]]
    _arrays: ClassVar[Mapping[str, tuple[np.dtype, int, int]]]

    def __init_subclass__(cls) -> None:
        kinds = inspect.get_annotations(cls)
        if not all(isinstance(kind, str) for kind in kinds.values()):
            raise TypeError(f"{cls.__name__}: annotations are read as text; import annotations from __future__")
        cls.scalar_members = {name: SCALARS[kind] for name, kind in kinds.items() if kind in SCALARS}
        cls.array_members = {name: ARRAYS[kind] for name, kind in kinds.items() if kind not in SCALARS}
        cls.numba_type = StructType(
            cls.__name__,
            tuple(cls.scalar_members.items()),
            tuple((name, *kind) for name, kind in cls.array_members.items()),
        )
        arrays, words = {}, 0
        for name, (kind, dimensions) in cls.array_members.items():
            arrays[name] = np.dtype(kind), dimensions, words
            words += 1 + dimensions
        cls._arrays = arrays
        # a record of ctypes gives and takes a scalar in a fifth of the time that one of numpy needs
        fields = [(name, _C_TYPES[kind]) for name, kind in cls.scalar_members.items()]
        record = type("Record", (ctypes.Structure,), {"_fields_": [*fields, ("words:", ctypes.c_int64 * words)]})
        assert ctypes.sizeof(record) == cls.numba_type.layout.itemsize
        cls._record_type = record
        cls._casts = {name: _CASTS[kind] for name, kind in cls.scalar_members.items()}
        for name in cls.scalar_members:
            setattr(cls, name, property(operator.attrgetter(f"_record.{name}")))

    def __init__(self, **members: Any) -> None:
        missing = self.array_members.keys() - members.keys()
        if missing:
            raise TypeError(f"{type(self).__name__} is missing {', '.join(sorted(missing))}")
        self._stand_in(self._record_type())
        own = self.__dict__
        words: list[int] = []
        for name, (kind, dimensions, _) in self._arrays.items():
            own[name] = value = members.pop(name)
            words += _words_of(name, value, kind, dimensions)
        getattr(own["_record"], "words:")[:] = words
        for name, value in members.items():
            setattr(self, name, value)

    def _stand_in(self, record: ctypes.Structure) -> None:
        """Keep scalars, addresses and shapes in a record."""
        self.__dict__["_record"] = record
        self.__dict__["_address"] = _address_of(record)

    def with_members(self, **members: Any) -> Self:
        """Return a struct with other values of some members, that shares all other arrays with this one."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other._stand_in(self._record_type.from_buffer_copy(self._record))
        for name, value in members.items():
            setattr(other, name, value)
        return other

    def __getattr__(self, name: str) -> Any:
        room, first, places = self.__dict__.get("_block", _NO_BLOCK)
        if name not in places:
            raise AttributeError(f"{type(self).__name__} has no member {name!r}")
        kind, shape, offset = places[name]
        # made when Python first looks at it: compiled code goes by its address
        array = self.__dict__[name] = np.ndarray(shape, kind, room, first + offset)
        return array

    def __setattr__(self, name: str, value: Any) -> None:
        cast = self._casts.get(name)
        if cast is not None:
            setattr(self._record, name, cast(value))
            return
        if name not in self._arrays:
            raise AttributeError(f"{type(self).__name__} has no member {name!r}")
        kind, dimensions, place = self._arrays[name]
        getattr(self._record, "words:")[place : place + 1 + dimensions] = _words_of(name, value, kind, dimensions)
        self.__dict__[name] = value

    def __reduce__(self) -> tuple:
        # addresses do not travel
        return _rebuild, (
            type(self),
            {name: getattr(self, name) for name in (*self.array_members, *self.scalar_members)},
        )


S = TypeVar("S", bound=Struct)


class BlockLayout(Generic[S]):
    """Places of arrays in one block of memory, found once for some sizes; then a struct takes one allocation.

    A short run is over in less time than Python needs to make fifty arrays one by one.

    Parameters
    ----------
    kind : type of Struct
    shapes : mapping of str to int or tuple of int
        Arrays in the block, each from the start of a line of the cache on. All others are given to `new`.
    on_line : mapping of str to int, optional
        Of an array the item that stands at the start of a line, instead of the first.
    """

    def __init__(
        self,
        kind: type[S],
        shapes: Mapping[str, int | tuple[int, ...]],
        on_line: Mapping[str, int] = MappingProxyType({}),
    ) -> None:
        self.kind = kind
        self.given = kind.array_members.keys() - shapes.keys()
        self.places: dict[str, tuple[np.dtype, tuple[int, ...], int]] = {}
        self.size = 0
        record = kind._record_type
        words = getattr(record, "words:").offset // 8
        self.image = np.zeros(-(-ctypes.sizeof(record) // 8), dtype=np.int64)
        self.is_address = np.zeros_like(self.image)
        for name, size in shapes.items():
            item, dimensions, place = kind._arrays[name]
            shape = (size,) if isinstance(size, int) else size
            before = on_line.get(name, 0) * item.itemsize
            offset = -(-(self.size + before) // LINE) * LINE - before
            self.places[name] = item, shape, offset
            self.size = offset + item.itemsize * math.prod(shape)
            first = words + place
            self.image[first : first + 1 + dimensions] = offset, *shape
            self.is_address[first] = 1

    def new(self, **members: Any) -> S:
        """Return a struct of zeros but for the members given: those arrays that are not in the block, and scalars."""
        missing = self.given - members.keys()
        if missing:
            raise TypeError(f"{self.kind.__name__} is missing {', '.join(sorted(missing))}")
        room = np.zeros(self.size + LINE, dtype=np.uint8)
        address = _address_of(_byte_of(room))
        first = -address % LINE
        struct = object.__new__(self.kind)
        image: Any = self.image + (address + first) * self.is_address
        struct._stand_in(self.kind._record_type.from_buffer(image))
        struct.__dict__["_block"] = room, first, self.places
        for name, value in members.items():
            setattr(struct, name, value)
        return struct


def _words_of(name: str, value: np.ndarray, kind: np.dtype, dimensions: int) -> tuple[int, ...]:
    """Return address and shape of an array that becomes a member."""
    # numba's arrays have data types that equal numpy's, but are not the same objects
    if value.dtype == kind and value.ndim == dimensions and value.size:
        try:
            # a fifth of the time that numpy takes to tell
            return _address_of(_byte_of(value)), *value.shape
        except (TypeError, BufferError):
            # not contiguous, or not to be written
            pass
    flags, shape = value.flags, value.shape
    if value.dtype != kind or len(shape) != dimensions or not flags.c_contiguous:
        raise TypeError(
            f"{name} must be a contiguous array of type {kind.str[1:]} with {dimensions} dimensions, "
            f"is one of {value.dtype} of shape {shape}"
        )
    # an empty array stands nowhere
    return value.__array_interface__["data"][0] if value.size else 0, *shape


def _rebuild(cls: type[Struct], members: dict[str, Any]) -> Struct:
    return cls(**members)


@typeof_impl.register(Struct)
def _typeof(value, context):
    return value.numba_type


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


@njit(cache=True, error_model="numpy", forceinline=True)
def uncounted(array):
    """Return a view of a whole vector without its reference count.

    Every inlined call that is handed a counted array counts up and down, some 12 ns each: a third of a residual. The
    view must not outlive the array.
    """
    return vector_at(array, 0, array.size)


@njit(cache=True, error_model="numpy", forceinline=True)
def uncounted_rows(table):
    """Return a view of a whole matrix without its reference count, as `uncounted` of a vector."""
    return matrix_at(table, 0, table.shape[0], table.shape[1])
