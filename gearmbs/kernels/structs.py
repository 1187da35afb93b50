"""Structs of named scalars and arrays, the same object in Python and in compiled code.

A tuple of arrays is costly in compiled code: each function that takes it counts a reference of each array, tens of
atomic operations a call, and the compiler works through all of them. A `Struct` crosses over as one pointer to a record
that holds the scalars, and address and shape of each array. ``st.order`` and ``st.y[i]`` read the same in Python and in
compiled code, ``st.order = 2`` too; an array can be replaced in Python only. The Python object owns the arrays and has
to outlive the call.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeAlias, TypeVar

import numpy as np

from gearmbs.kernels import kinds
from gearmbs.kernels.views import matrix_at, uncounted, uncounted_rows, vector_at

if TYPE_CHECKING:
    from _ctypes import _PyCStructType as RecordType
else:
    RecordType = type(ctypes.Structure)

__all__ = [
    "ARRAYS",
    "KEPT_LAYOUTS",
    "LINE",
    "SCALARS",
    "BlockLayout",
    "IndexVector",
    "IntVector",
    "Matrix",
    "Struct",
    "Vector",
    "matrix_at",
    "uncounted",
    "uncounted_rows",
    "vector_at",
]

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
_byte_of: Callable[[Any], ctypes.c_char] = ctypes.c_char.from_buffer
_address_of = ctypes.addressof
LINE = 64
"""Bytes of a line of the processor's cache."""
KEPT_LAYOUTS = 64
"""Sets of sizes for which a kind of struct keeps its layout."""


class _Members(RecordType):
    """Class of structs: a record of C whose fields are the annotated scalars, then address and shape of each array.

    So scalars are set and read without a call of Python, in a fifth of the time that a record of numpy needs. Arrays
    are kept in slots: an attribute that is no member cannot be set.
    """

    def __new__(cls, name: str, bases: tuple[type, ...], space: dict[str, Any]) -> Any:
        if bases == (ctypes.Structure,):
            return super().__new__(cls, name, bases, space)
        kinds = space.get("__annotations__", {})
        if not all(isinstance(kind, str) for kind in kinds.values()):
            raise TypeError(f"{name}: annotations are read as text; import annotations from __future__")
        scalars = {member: SCALARS[kind] for member, kind in kinds.items() if kind in SCALARS}
        arrays = {member: ARRAYS[kind] for member, kind in kinds.items() if kind not in SCALARS}
        fields = [(member, _C_TYPES[kind]) for member, kind in scalars.items()]
        words = ctypes.c_int64 * sum(1 + dimensions for _, dimensions in arrays.values())
        own = {"scalar_members": scalars, "array_members": arrays, "_fields_": [*fields, ("words:", words)]}
        return super().__new__(cls, name, bases, {**space, **own, "__slots__": [*arrays]})

    def __init__(cls: Any, name: str, bases: tuple[type, ...], space: dict[str, Any]) -> None:
        # newer Pythons lay the record out here
        RecordType.__init__(cls, name, bases, space)
        if bases == (ctypes.Structure,):
            return
        places, words = {}, 0
        for member, (kind, dimensions) in cls.array_members.items():
            places[member] = np.dtype(kind), dimensions, words
            words += 1 + dimensions
        cls._arrays = places
        cls._slots = {member: vars(cls)[member] for member in places}
        for member, slot in cls._slots.items():
            setattr(cls, member, property(slot.__get__, _setter(member, slot, *places[member])))
        arrays = tuple((member, *kind) for member, kind in cls.array_members.items())
        cls.struct_kind = kinds.struct(name, tuple(cls.scalar_members.items()), arrays)

    @property
    def numba_type(cls: Any) -> Any:
        """The type as numba knows it, for signatures of functions of `numba.njit`."""
        return cls.struct_kind.numba


def _setter(name: str, slot: Any, kind: np.dtype, dimensions: int, place: int) -> Callable[[Any, Any], None]:
    """Return what replaces an array."""

    def put(struct: Any, value: np.ndarray) -> None:
        getattr(struct, "words:")[place : place + 1 + dimensions] = _words_of(name, value, kind, dimensions)
        slot.__set__(struct, value)

    return put


class Struct(ctypes.Structure, metaclass=_Members):
    """Base of structs; a subclass annotates its members with float, int, bool, or an array of this module.

    Scalars start at zero unless they are given; arrays have to be given.

    Attributes
    ----------
    scalar_members, array_members : mapping
        Numpy kind of each scalar; kind and number of dimensions of each array.
    struct_kind : Kind
        For signatures of kernels; ``numba_type`` for those of `numba.njit`.
    """

    __slots__ = ("__weakref__",)

    scalar_members: ClassVar[Mapping[str, str]]
    array_members: ClassVar[Mapping[str, tuple[str, int]]]
    struct_kind: ClassVar[kinds.Kind]
    _arrays: ClassVar[Mapping[str, tuple[np.dtype, int, int]]]
    _slots: ClassVar[Mapping[str, Any]]

    _address = property(ctypes.addressof)
    __hash__ = object.__hash__

    def __init__(self, **members: Any) -> None:
        missing = self.array_members.keys() - members.keys()
        if missing:
            raise TypeError(f"{type(self).__name__} is missing {', '.join(sorted(missing))}")
        words: list[int] = []
        for name, (kind, dimensions, _) in self._arrays.items():
            value = members.pop(name)
            words += _words_of(name, value, kind, dimensions)
            self._slots[name].__set__(self, value)
        getattr(self, "words:")[:] = words
        for name, value in members.items():
            setattr(self, name, value)

    def with_members(self, **members: Any) -> Self:
        """Return a struct with other values of some members, that shares all other arrays with this one."""
        other = type(self).from_buffer_copy(self)
        for name, slot in self._slots.items():
            if name not in members:
                slot.__set__(other, slot.__get__(self))
        for name, value in members.items():
            setattr(other, name, value)
        return other

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"{type(self).__name__} has no member {name!r}")

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
        self.places: list[tuple[Any, np.dtype, tuple[int, ...], int]] = []
        self.size = 0
        words = getattr(kind, "words:").offset // 8
        self.image = np.zeros(-(-ctypes.sizeof(kind) // 8), dtype=np.int64)
        self.is_address = np.zeros_like(self.image)
        for name, size in shapes.items():
            item, dimensions, place = kind._arrays[name]
            shape = (size,) if isinstance(size, int) else size
            before = on_line.get(name, 0) * item.itemsize
            offset = -(-(self.size + before) // LINE) * LINE - before
            self.places.append((kind._slots[name], item, shape, offset))
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
        image: Any = self.image + (address + first) * self.is_address
        struct = self.kind.from_buffer(image)
        for slot, kind, shape, offset in self.places:
            slot.__set__(struct, np.ndarray(shape, kind, room, first + offset))
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


@cache
def let_numba_know() -> None:
    """Let numba know the types of structs, whose memory it would look at otherwise."""
    from numba.extending import typeof_impl

    typeof_impl.register(Struct)(lambda struct, context: type(struct).struct_kind.numba)
