"""Which kernels there are, what each calls, and which of them Python calls: read from the code itself.

A kernel is an entry if code that is not compiled names it, or if it has a declared signature and no kernel calls it.
"""

from __future__ import annotations

import contextlib
import dis
import importlib.util
import pkgutil
import re
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from gearmbs.kernels import PLAIN
from gearmbs.kernels.jit import Kernel
from gearmbs.kernels.kinds import Kind, float32, float64, int16, int64

MAKES_KERNELS = re.compile(
    r"^(?:from (?:[\w.]*jit|gearmbs\.contact\.records) import|import numba|from numba import .*\bnjit\b)", re.M
)
MAKERS = {f"kernels/{name}.py" for name in ("jit", "cache", "calls", "library", "own/jit", "own/late")}
"""Modules that make kernels and hold none."""
OTHER_MODE = tuple(
    f"gearmbs.kernels.{name}" for name in (("cache", "entries", "library", "objects", "own") if PLAIN else ("plain",))
)
"""Where the modules are, or their names begin, that are not imported in this mode."""

NAMED = {"LOAD_NAME", "LOAD_GLOBAL", "LOAD_ATTR", "LOAD_METHOD", "LOAD_DEREF"}


def kernel_modules(package: str = "gearmbs") -> list[str]:
    """Return the modules of a package that compile, by what they import."""
    root = Path(importlib.import_module(package).__file__ or "").parent
    found = []
    for path in sorted(root.rglob("*.py")):
        name = ".".join((package, *path.relative_to(root).with_suffix("").parts))
        if path.relative_to(root).as_posix() in MAKERS or name.startswith(OTHER_MODE):
            continue
        if MAKES_KERNELS.search(path.read_text("utf-8")):
            found.append(name)
    return found


def import_all(package: str = "gearmbs") -> None:
    """Import all modules of a package, but those that need what is not installed."""
    root = importlib.import_module(package)
    for info in pkgutil.walk_packages(root.__path__, f"{package}."):
        if not info.name.endswith("__main__") and not info.name.startswith(OTHER_MODE):
            with contextlib.suppress(ImportError):
                importlib.import_module(info.name)


def kernels(modules: Iterable[str]) -> list[Kernel]:
    """Return the kernels defined in some modules, which are imported."""
    found: dict[str, Kernel] = {}
    for name in sorted(set(modules)):
        for own in list(vars(importlib.import_module(name))):
            one = find(name, own)
            if one is not None and one.__module__ == name and one is find(name, one.__name__):
                found[address(one)] = one
    return [found[key] for key in sorted(found)]


def find(module: str, name: str) -> Kernel | None:
    """Return a kernel by its module and name; None if the module holds it under no such name."""
    found = getattr(importlib.import_module(module), name, None)
    return found if isinstance(found, Kernel) else None


def address(kernel: Kernel) -> str:
    """Return the module and name of a kernel as text."""
    return f"{kernel.__module__}:{kernel.__name__}"


@cache
def callees(kernel: Kernel) -> tuple[Kernel, ...]:
    """Return the kernels that a kernel names and is compiled with."""
    plain = kernel.py_func
    return tuple(k for k in _kernels_of(set(_names(plain.__code__)), plain.__globals__) if not k.late)


def below(kernel: Kernel) -> set[Kernel]:
    """Return all kernels that a kernel calls, directly or through others."""
    found: set[Kernel] = set()
    waiting = [kernel]
    while waiting:
        for callee in callees(waiting.pop()):
            if callee not in found:
                found.add(callee)
                waiting.append(callee)
    return found


def size(kernel: Kernel) -> int:
    """Return the length of a kernel's byte code, to compare the time it takes to compile."""
    return len(kernel.py_func.__code__.co_code)


def entries(found: list[Kernel], modules: Iterable[str] | None = None) -> list[Kernel]:
    """Return those of some kernels with a declared signature that Python calls, or that nothing else calls.

    Parameters
    ----------
    found : list of Kernel
    modules : iterable of str, optional
        Where to look for calls; by default, all imported modules of the kernels' package.
    """
    packages = {kernel.__module__.partition(".")[0] for kernel in found}
    if modules is None:
        modules = [name for name in list(sys.modules) if name.partition(".")[0] in packages]
    own = {(k.__code__.co_filename, k.__code__.co_firstlineno) for k in found}
    called = {callee for kernel in found for callee in callees(kernel)}
    used: set[Kernel] = set()
    for name in modules:
        used |= _named_by_python(sys.modules[name], own)
    return [k for k in found if k.declared is not None and (k in used or k not in called)]


def _named_by_python(module: ModuleType, own: set) -> set[Kernel]:
    path = getattr(module, "__file__", None)
    if path is None or not path.endswith(".py"):
        return set()
    used: set[Kernel] = set()
    names = set(_names(compile(Path(path).read_bytes(), path, "exec"), own, used))
    return used | set(_kernels_of(names, vars(module)))


def _names(code: CodeType, own: Iterable = (), imported: set | None = None) -> Iterator[str]:
    """Yield the names that code loads, also in what is defined inside it, but for the functions of ``own``."""
    source = ""
    for step in dis.get_instructions(code):
        if step.opname in NAMED:
            yield step.argval
        elif step.opname == "IMPORT_NAME":
            source = step.argval
        elif step.opname == "IMPORT_FROM" and imported is not None and code.co_name != "<module>":
            value = _if_loaded(source, step.argval)
            if isinstance(value, Kernel):
                imported.add(value)
    for inner in code.co_consts:
        if isinstance(inner, CodeType) and (inner.co_filename, inner.co_firstlineno) not in own:
            yield from _names(inner, own, imported)


def _if_loaded(module: str, name: str) -> Any:
    """Return what a module calls by a name, None if it is still to be imported; see `gearmbs._lazy.late`."""
    space = vars(sys.modules.get(module, object))
    home = space.get("_homes", {}).get(name)
    if home and name not in space:
        space = vars(sys.modules.get(importlib.util.resolve_name(home, module), object))
    return space.get(name)


def _kernels_of(names: set[str], space: dict) -> Iterator[Kernel]:
    for name in sorted(names):
        value = space.get(name)
        if isinstance(value, Kernel):
            yield value
        elif isinstance(value, ModuleType) and value.__name__.partition(".")[0] not in ("numpy", "numba"):
            yield from (vars(value)[n] for n in sorted(names) if isinstance(vars(value).get(n), Kernel))


# Kernels of which the code does not tell that Python calls them, or with what types: a list, compiled ahead. Beside the
# entries there are some without a declared signature, which would do with any types, and some that are looked up by
# their names. The documentation's build holds that its pages call no others.

_WORDS, _REALS, _ROWS = int64[::1], float64[::1], float64[:, ::1]
_DEPTHS, _FACING, _OWNERS, _IMAGE = float64[:, ::1], float32[:, :, ::1], int16[:, ::1], float64[:, :, ::1]

ASKED = {
    "gearmbs.bearings.layout:variations": (int64,),
    "gearmbs.contact.laws:damping_of_share": (int64, float64, float64),
    "gearmbs.contact.laws:normal_law": (int64, *[float64] * 6),
    "gearmbs.dae.equations.layout:unpack": (_WORDS, _REALS, _REALS),
    "gearmbs.view.mesh:_corner_normals": (int64[:, ::1], _ROWS, _REALS, _WORDS, _WORDS),
    "gearmbs.view.render:_fill": (_IMAGE, _IMAGE, int64, _DEPTHS, _FACING, _OWNERS),
    "gearmbs.view.render:_shade": (_DEPTHS, _FACING, _OWNERS, _ROWS, float64, _IMAGE),
}
"""Types of the arguments of each, by its module and name."""

LOOKED_UP = tuple(
    f"gearmbs.dae.equations.expressions.evaluate:{name}" for name in ("eval_gradient", "update_angles", "angle_rates")
)
"""Kernels with a declared signature that kernels call, and Python by an address that is looked up by their names."""

LINKED = ("gearmbs.dae.integrators.differences:difference_matrix",)
"""Kernels that functions of a user's are compiled with, and no others: parts."""


def asked() -> Iterator[tuple[Any, tuple[Kind, ...]]]:
    """Yield the kernels that Python calls, each with the types of its arguments."""
    for name, told in ASKED.items():
        yield _kernel(name), told
    for name in LOOKED_UP:
        kernel = _kernel(name)
        yield kernel, kernel.declared_types()[0]


def linked() -> Iterator[Any]:
    """Yield the kernels that functions of a user's are compiled with, and no others."""
    return map(_kernel, LINKED)


def _kernel(address: str) -> Any:
    module, _, name = address.partition(":")
    return getattr(import_module(module), name)


def texts() -> set[tuple[str, str]]:
    """Return module and name of each kernel that Python calls, and its types as numba tells them."""
    return {(f"{k.__module__}:{k.__name__}", ", ".join(map(str, args))) for k, args in asked()}
