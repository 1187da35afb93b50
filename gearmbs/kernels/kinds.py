"""Types of numbers, arrays and structs as signatures name them, known without numba.

``float64[:, ::1]``, ``types.Tuple(...)`` and ``int64(float64[::1], STATE_TYPE)`` are written as with numba's types, but
numba is imported by whoever compiles: a program whose kernels are on disk needs the text of a type alone, which is
what numba calls it. Where compiled code names a type, as in ``int64(0)``, numba takes it for its own.

`Deferred` stands for what numba makes of a function that writes LLVM's instructions, an intrinsic, likewise.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np

from gearmbs import kernels


class Signature(str):
    """Types of a function, as the text that ``numba.njit`` takes for them where numba has all of the types.

    Parameters
    ----------
    return_type : Kind
    args : tuple of Kind
    """

    return_type: Any
    args: tuple

    def __new__(cls, return_type: Any, args: tuple) -> Signature:
        """Return the signature with its types."""
        made = super().__new__(cls, f"{_spelled(return_type)}({', '.join(map(_spelled, args))})")
        made.return_type, made.args = return_type, args
        return made

    def __getnewargs__(self) -> tuple:
        return self.return_type, self.args

    @property
    def numba(self) -> Any:
        """The same as numba knows it."""
        return numba_of(self.return_type)(*map(numba_of, self.args))


class Kind:
    """A type.

    Parameters
    ----------
    text : str
        What numba calls it.
    form : str
        A number's ``"number"``, or the name of numba's function in `_MAKERS` that makes it.
    parts : tuple
        What that is given.
    """

    __slots__ = ("__dict__", "form", "parts", "text")

    def __init__(self, text: str, form: str, parts: tuple) -> None:
        self.text, self.form, self.parts = text, form, parts

    def __getitem__(self, axes: Any) -> Kind:
        """Return arrays of the type: ``[::1]`` and ``[:, ::1]`` of contiguous ones, ``[:]`` of any."""
        axes = axes if isinstance(axes, tuple) else (axes,)
        layout = "C" if axes[-1].step == 1 else "A"
        return Kind(f"array({self.text}, {len(axes)}d, {layout})", "array", (self, len(axes), layout))

    def __call__(self, *args: Any) -> Any:
        """Return the signature of functions with this result, or a number of this type."""
        if len(args) == 1 and self.form == "number" and isinstance(args[0], (bool, int, float, np.generic)):
            return np.dtype(self.text if self.text != "bool" else "?").type(args[0]).item()
        return Signature(self, args)

    def __str__(self) -> str:
        return self.text

    __repr__ = __str__

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Kind) and (self.form, self.text, self.parts) == (other.form, other.text, other.parts)

    def __hash__(self) -> int:
        return hash(self.text)

    def __reduce__(self) -> tuple:
        return Kind, (self.text, self.form, self.parts)

    @cached_property
    def told(self) -> str:
        """A text that differs where what is compiled differs: with the fields of named tuples."""
        inner = " ".join(part.told for part in _inside(self.parts))
        return f"{self.text} {getattr(self.parts[-1], '_fields', '') if self.form == 'named' else ''} [{inner}]"

    @property
    def structs(self) -> bool:
        """Whether a struct is part of it: with that goes code that reads and writes members."""
        return self.form == "struct" or any(part.structs for part in _inside(self.parts))

    @cached_property
    def numba(self) -> Any:
        """The same as numba knows it."""
        return _MAKERS[self.form](*self.parts)

    @property
    def _numba_type_(self) -> Any:
        """Numba's type of the type itself, where compiled code names it."""
        import numba

        return numba.typeof(self.numba)


def _inside(parts: Iterable) -> list[Any]:
    """Return the types among what a type is made of."""
    found: list[Any] = []
    for part in parts:
        if isinstance(part, Kind):
            found.append(part)
        elif isinstance(part, tuple) and not isinstance(part, str):
            found += _inside(part)
    return found


def numba_of(kind: Any) -> Any:
    """Return numba's type of a type, or signature, told here, by numba, or by a text."""
    if isinstance(kind, (Kind, Signature)):
        return kind.numba
    if isinstance(kind, str):
        found = read(kind)
        return kind if found is None else found.numba
    if isinstance(kind, tuple):
        return tuple(map(numba_of, kind))
    args = getattr(kind, "args", ())
    if hasattr(kind, "return_type") and any(isinstance(one, Kind) for one in (kind.return_type, *args)):
        return numba_of(kind.return_type)(*map(numba_of, args))
    return kind


def _spelled(kind: Any) -> str:
    """Return a type as programs write it."""
    if not isinstance(kind, Kind):
        return str(kind)
    if kind.form == "array":
        item, dimensions, layout = kind.parts
        axes = [":"] * (dimensions - 1) + ["::1" if layout == "C" else ":"]
        return f"{_spelled(item)}[{', '.join(axes)}]"
    if kind.form == "tuple":
        return f"Tuple(({''.join(f'{_spelled(part)}, ' for part in kind.parts[0])}))"
    return {"none": "void", "bool": "boolean"}.get(kind.text, kind.text)


def _number(text: str) -> Kind:
    return Kind(text, "number", (text,))


def tuple_of(kinds: Iterable) -> Kind:
    """Return the type of tuples, named as by numba: members that are alike are counted."""
    kinds = tuple(kinds)
    alike = len(set(kinds)) == 1
    text = f"UniTuple({kinds[0]} x {len(kinds)})" if alike else f"Tuple({', '.join(map(str, kinds))})"
    return Kind(text, "tuple", (kinds,))


def uniform_tuple(kind: Any, count: int) -> Kind:
    """Return the type of tuples of one type."""
    return tuple_of((kind,) * count)


def named_tuple(kinds: Iterable, cls: type) -> Kind:
    """Return the type of named tuples of a class."""
    kinds = tuple(kinds)
    return Kind(f"{cls.__name__}({', '.join(map(str, kinds))})", "named", (kinds, cls))


def function(signature: Signature) -> Kind:
    """Return the type of functions that are handed over."""
    told = f"FunctionType[{signature.return_type}({', '.join(map(str, signature.args))})]"
    return Kind(told, "function", (signature,))


def struct(name: str, scalars: tuple, arrays: tuple) -> Kind:
    """Return the type of a `gearmbs.kernels.structs.Struct`; see `gearmbs.kernels.own.views.StructType`."""
    return Kind(f"{name}({scalars}, {arrays})", "struct", (name, scalars, arrays))


def _numba_number(text: str) -> Any:
    from numba import types

    return getattr(types, {"bool": "boolean"}.get(text, text))


def _numba_array(kind: Kind, dimensions: int, layout: str) -> Any:
    from numba import types

    return types.Array(kind.numba, dimensions, layout)


def _numba_tuple(kinds: tuple) -> Any:
    from numba import types

    return types.Tuple(numba_of(kinds))


def _numba_named(kinds: tuple, cls: type) -> Any:
    from numba import types

    return types.NamedTuple(numba_of(kinds), cls)


def _numba_function(signature: Signature) -> Any:
    from numba import types

    return types.FunctionType(signature.numba)


def _numba_struct(name: str, scalars: tuple, arrays: tuple) -> Any:
    home = "gearmbs.kernels.plain.views" if kernels.PLAIN else "gearmbs.kernels.own.views"
    importlib.import_module("gearmbs.kernels.structs").let_numba_know()
    return importlib.import_module(home).StructType(name, scalars, arrays)


_MAKERS: dict[str, Any] = {
    "number": _numba_number,
    "array": _numba_array,
    "tuple": _numba_tuple,
    "named": _numba_named,
    "function": _numba_function,
    "struct": _numba_struct,
}

void = _number("none")
boolean = _number("bool")
int16, int32, int64 = map(_number, ("int16", "int32", "int64"))
uint32, uint64 = map(_number, ("uint32", "uint64"))
float32, float64 = map(_number, ("float32", "float64"))
intp = int64

types = SimpleNamespace(
    void=void, none=void, boolean=boolean, bool_=boolean, int16=int16, int32=int32, int64=int64, uint32=uint32,
    uint64=uint64, float32=float32, float64=float64, intp=intp, i8=int64, u4=uint32, f8=float64, f4=float32, b1=boolean,
    Tuple=tuple_of, UniTuple=uniform_tuple, NamedTuple=named_tuple, FunctionType=function,
)  # fmt: skip
"""As ``numba.types``, with what this package names of it."""


def read(text: str) -> Signature | None:
    """Return the signature that a text tells, None if it names what is not here."""
    try:
        found = eval(text, {"__builtins__": {}}, vars(types))
    except (NameError, AttributeError):
        return None
    return found if isinstance(found, Signature) else None


# What compiled code names and numba makes of it.


class Deferred:
    """An intrinsic, or a kernel, that is made when something is compiled that names it.

    Parameters
    ----------
    module, name : str
        Where it is, or the function that makes it.
    *given
        Arguments of that function.
    """

    def __init__(self, module: str, name: str, *given: Any) -> None:
        self.module, self.name, self.given = module, name, given

    @cached_property
    def made(self) -> Any:
        """What numba knows."""
        found = getattr(importlib.import_module(self.module), self.name)
        return found(*self.given) if self.given else found

    @cached_property
    def _numba_type_(self) -> Any:
        """Numba's type of it."""
        return importlib.import_module("gearmbs.kernels.own.jit").type_of(self.made)

    def __repr__(self) -> str:
        return f"{self.module}.{self.name}"


def deferred(module: str, name: str, *given: Any) -> Any:
    """Return a `Deferred`; in the plain mode, which has its own modules, what it stands for."""
    made = Deferred(f"{__package__}.{module}", name, *given)
    return made.made if kernels.PLAIN else made
