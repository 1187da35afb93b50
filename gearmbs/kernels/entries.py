"""Compiled kernels of files, called without numba: machine code is loaded, linked and wrapped by what is here.

A kernel on disk is an object file for the linker, as LLVM has written it, with the wrapper that numba gives each
function for Python. Its code refers to addresses alone: of functions of Python, of the C library, and some 200 that
numba has in modules of C, which need none of its Python. So it takes a copy into memory, the addresses written where
the object asks for them, and a function object of numba's around the wrapper. That is what numba does through LLVM; but
importing the two takes as long as a short run.

This is for Linux on x86-64, whose objects hold 64-bit addresses and nothing else to be filled in. Elsewhere, and for
objects that ask for more, numba loads kernels.
"""

from __future__ import annotations

import ctypes
import importlib
import importlib.util
import mmap
import os
import pickle
import sys
import sysconfig
import traceback
from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from gearmbs.system import is_linux_on_x86_64

FINDER = "gearmbs_find_late_kernel"
"""Symbol of what compiled code calls to find a late kernel; see `gearmbs.kernels.own.late`."""

HERE = is_linux_on_x86_64()
"""Whether objects are loaded here."""


class Entry(NamedTuple):
    """A kernel in memory.

    Attributes
    ----------
    call : builtin function
        For Python; it answers for no types.
    address : int
        Of the function that other compiled code calls.
    """

    call: Any
    address: int


class Kept(NamedTuple):
    """What an entry is loaded from.

    Attributes
    ----------
    code : bytes
        Object file.
    function, wrapper : str
        Symbols of the function and of its wrapper for Python.
    name : str
        Of the kernel.
    own : str
        Symbol of the environment of the kernel itself.
    environments : list of (str, list, str)
        Module, constants and symbol of each environment that the code takes exceptions from.
    plain : bool
        Whether nothing of numba's has to be started for it.
    rest : bytes
        What numba itself needs to know of it, pickled.
    """

    code: bytes
    function: str
    wrapper: str
    name: str
    own: str
    environments: list[tuple[str, list, str]]
    plain: bool
    rest: bytes


def loaded(kept: Kept, module: str) -> Entry | None:
    """Return an entry from what was kept of it; None if numba has to load it.

    Parameters
    ----------
    kept : Kept
    module : str
        That the kernel is of.
    """
    if not (HERE and kept.plain):
        return None
    parts = _numba_parts()
    image = None if parts is None else _Image.of(kept.code)
    if parts is None or image is None:
        return None
    own = None
    for home, constants, symbol in kept.environments:
        environment = _environment(parts.functions, home, tuple(constants), symbol)
        image.write(symbol, id(environment))
        own = environment if symbol == kept.own else own
    image.close()
    if own is None:
        return None
    place = sys.modules.get(module) or ModuleType(module)
    told = f"compiled wrapper for {kept.name!r}"
    call = parts.functions.make_function(place, kept.name, told, image.address(kept.wrapper), own, (image,))
    return Entry(call, image.address(kept.function))


def rebuild(package: str, file: str, payload: tuple) -> Entry | None:
    """Return an entry from a file of a package's kernels, as `loaded`; ``rebuild`` of `gearmbs.kernels.cache.load`."""
    module = file.rpartition("-")[0].rpartition(".")[0]
    return loaded(Kept(*payload), f"{package}.{module}" if module else package)


_environments: dict[str, Any] = {}


def _environment(functions: Any, module: str, constants: tuple, symbol: str) -> Any:
    """Return what compiled code takes constants from, of a symbol always the same: nobody counts its references."""
    found = _environments.get(symbol)
    if found is None:
        made = functions.Environment({"__name__": module})
        made.consts[:] = constants
        # another thread may have come first
        found = _environments.setdefault(symbol, made)
    return found


# what code refers to


class _Parts(NamedTuple):
    functions: Any
    addresses: dict[str, int]


@cache
def _numba_parts() -> _Parts | None:
    """Return the modules of C that numba's wrappers call, without its package; None if they are elsewhere."""
    found = importlib.util.find_spec("numba")
    if found is None or found.origin is None:
        return None
    folder, ending = os.path.dirname(found.origin), sysconfig.get_config_var("EXT_SUFFIX")
    modules = []
    for name in ("_dynfunc", "_helperlib", "core.runtime._nrt_python"):
        full = f"numba.{name}"
        if full in sys.modules:
            modules.append(sys.modules[full])
            continue
        file = os.path.join(folder, *name.split(".")) + ending
        spec = importlib.util.spec_from_file_location(full, file)
        if spec is None or spec.loader is None or not os.path.isfile(file):
            return None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        # numba finds it anew, and binds it to its package
        sys.modules.pop(full, None)
        modules.append(module)
    functions, helpers, runtime = modules
    addresses = {f"numba_{name}": where for name, where in helpers.c_helpers.items()}
    for name, where in runtime.c_helpers.items():
        addresses[name if name.startswith("_") else f"NRT_{name}"] = where
    # numba's own asks its package for the same
    for symbol, function in ((FINDER, find_late), ("numba_unpickle", _unpickled)):
        addresses[symbol] = ctypes.cast(function, ctypes.c_void_p).value or 0
    return _Parts(functions, addresses)


@cache
def _library(name: str | None) -> Any:
    return ctypes.CDLL(name)


@cache
def _address(symbol: str) -> int:
    """Return the address of what code refers to; 0 if there is none."""
    parts = _numba_parts()
    assert parts is not None
    where = parts.addresses.get(symbol, 0)
    for library in () if where else (None, "libm.so.6"):
        try:
            return ctypes.addressof(ctypes.c_char.in_dll(_library(library), symbol))
        except (OSError, ValueError):
            continue
    return where


@ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p)
def find_late(slot: int, address: bytes) -> int | None:
    """Compile or load a late kernel, write its address to a slot and return it; return None if this fails."""
    module, _, name = address.decode().partition(":")
    try:
        found = getattr(importlib.import_module(module), name).entry().address
        ctypes.c_void_p.from_address(slot).value = found
        return found
    except BaseException:
        # there is nobody to raise it to but compiled code, which raises an error of its own
        traceback.print_exc(file=sys.stderr)
        return None


_objects: dict[tuple[int, bytes], Any] = {}


@ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)
def _unpickled(data: int, size: int, digest: int) -> Any:
    """Return an object that code holds pickled, as the class of an array: each once, by its place and digest."""
    # numba's digests are of SHA-1
    key = data, ctypes.string_at(digest, 20)
    if key not in _objects:
        _objects[key] = pickle.loads(ctypes.string_at(data, size))
    return _objects[key]


# object files, as in the generic and the x86-64 supplement of the System V ABI (ELF)

_SECTION = np.dtype(
    [("name", "<u4"), ("type", "<u4"), ("flags", "<u8"), ("address", "<u8"), ("offset", "<u8"), ("size", "<u8"),
     ("link", "<u4"), ("info", "<u4"), ("align", "<u8"), ("entry", "<u8")]
)  # fmt: skip
_SYMBOL = np.dtype(
    [("name", "<u4"), ("info", "u1"), ("other", "u1"), ("section", "<u2"), ("value", "<u8"), ("size", "<u8")]
)
_RELOCATION = np.dtype([("offset", "<u8"), ("info", "<u8"), ("addend", "<i8")])

_SYMBOLS, _RELOCATIONS, _NO_BITS, _UNWIND = 2, 4, 8, 0x70000001
"""Types of sections; tables for unwinding are left out: no exception of C++ goes through kernels."""
_IN_MEMORY, _CODE = 2, 4
"""Flags of sections."""
_UNDEFINED, _COMMON = 0, 0xFFF2
"""Numbers of sections that are none."""
_ADDRESS = 1
"""Kind of relocation: a symbol's address and a number, in 64 bits."""


class _Image:
    """An object in memory.

    Attributes
    ----------
    first : int
        Address of its memory.
    """

    def __init__(self, memory: mmap.mmap, code_size: int, symbols: dict[str, int]) -> None:
        self._memory, self._code_size, self._symbols = memory, code_size, symbols
        self.first = ctypes.addressof(ctypes.c_char.from_buffer(memory))

    @classmethod
    def of(cls, code: bytes) -> _Image | None:
        """Return an object with all addresses filled in; None if it asks for something else."""
        (at,), (count,) = np.frombuffer(code, "<u8", 1, 40), np.frombuffer(code, "<u2", 1, 60)
        sections = np.frombuffer(code, _SECTION, count, at)
        table = sections[sections["type"] == _SYMBOLS]
        placed = (sections["flags"] & _IN_MEMORY > 0) & (sections["type"] != _UNWIND)
        fills = sections[sections["type"] == _RELOCATIONS]
        fills = fills[placed[fills["info"]]]
        if table.size != 1:
            return None
        symbols = np.frombuffer(code, _SYMBOL, int(table["size"][0]) // _SYMBOL.itemsize, int(table["offset"][0]))
        names = _names(code, sections[table["link"][0]], symbols)

        # code first, on pages of its own
        starts, end = np.zeros(count, dtype=np.int64), 0
        is_code = sections["flags"] & _CODE > 0
        for number in [*np.flatnonzero(placed & is_code), None, *np.flatnonzero(placed & ~is_code)]:
            if number is None:
                end = code_size = -(-end // mmap.PAGESIZE) * mmap.PAGESIZE
                continue
            align = max(int(sections["align"][number]), 1)
            starts[number] = -(-end // align) * align
            end = int(starts[number] + sections["size"][number])
        common = symbols["section"] == _COMMON
        shared = -(-end // 64) * 64 + np.concatenate([[0], np.cumsum(-(-symbols["size"][common] // 64) * 64)])
        # not shared with a fork: each process notes addresses of late kernels that are its own
        memory = mmap.mmap(-1, max(int(shared[-1]), 1), flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        for number in np.flatnonzero(placed & (sections["type"] != _NO_BITS)):
            start, size, offset = (
                int(x) for x in (starts[number], sections["size"][number], sections["offset"][number])
            )
            memory[start : start + size] = code[offset : offset + size]

        image = cls(memory, code_size, {})
        section = np.minimum(symbols["section"], count - 1)
        values = image.first + starts[section] + symbols["value"].astype(np.int64)
        values[common] = image.first + shared[:-1]
        for number in np.flatnonzero(symbols["section"] == _UNDEFINED)[1:]:
            values[number] = _address(names[number])
            if not values[number]:
                return None
        image._symbols = dict(zip(names, values.tolist()))
        return image if image._fill(code, fills, starts, values) else None

    def _fill(self, code: bytes, fills: np.ndarray, starts: np.ndarray, values: np.ndarray) -> bool:
        """Write addresses where the object asks for them; return False if it asks for others."""
        view = np.frombuffer(self._memory, np.uint8)
        byte = np.arange(8)
        for fill in fills:
            asked = np.frombuffer(code, _RELOCATION, int(fill["size"]) // _RELOCATION.itemsize, int(fill["offset"]))
            if np.any(asked["info"] & 0xFFFFFFFF != _ADDRESS):
                return False
            told = values[(asked["info"] >> 32).astype(np.int64)] + asked["addend"]
            places = starts[fill["info"]] + asked["offset"].astype(np.int64)
            view[places[:, None] + byte] = told.view(np.uint8).reshape(-1, 8)
        return True

    def write(self, symbol: str, word: int) -> None:
        """Write a word to the place of a symbol, if there is one."""
        if symbol in self._symbols:
            ctypes.c_int64.from_address(self._symbols[symbol]).value = word

    def close(self) -> None:
        """Let the code be run, and no longer be written.

        Raises
        ------
        OSError
            If the system forbids it.
        """
        protect = _library(None).mprotect
        size = ctypes.c_size_t(self._code_size)
        if self._code_size and protect(ctypes.c_void_p(self.first), size, mmap.PROT_READ | mmap.PROT_EXEC):
            raise OSError("memory with code cannot be made executable")

    def address(self, symbol: str) -> int:
        """Return the address of a symbol."""
        return self._symbols[symbol]


def _names(code: bytes, strings: Any, symbols: np.ndarray) -> list[str]:
    first = int(strings["offset"])
    text = code[first : first + int(strings["size"])]
    return [text[at : text.index(b"\0", at)].decode() for at in symbols["name"].tolist()]
