"""Whether a process runs what stands in the files of its modules.

Python notes nothing of that. What a module has is held against what its source makes of it: what functions do, their
defaults, constants of modules and of classes, what is imported. Of other statements it cannot be seen; then the
bytecode tells that the import has left, where it has.
"""

from __future__ import annotations

import ast
import bisect
import dis
import importlib.util
import inspect
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

from gearmbs.system import began

MESSAGES_FROM = ("warn", "warn_explicit")
"""Functions whose texts are read by people only."""

CLOCK_TICKS = 0.02
"""Seconds to which the beginning of a process is known; an interpreter takes longer until it imports anything."""


BEGAN = began()
"""When this process began, or the one that it was forked from: what that had loaded, it has."""


def as_loaded(name: str, path: Path, stamp: tuple[int, int, int]) -> bool:
    """Return whether a module is not loaded, or is what its source makes of it; false where that cannot be told.

    Parameters
    ----------
    stamp : tuple of int
        Times of the source's last change of content and of anything about it (ns), and its size.
    """
    module = sys.modules.get(name)
    if module is None or path.suffix != ".py" or stamp[1] / 1e9 < BEGAN + CLOCK_TICKS:
        return True
    same = _same(module, path.read_bytes(), str(path))
    return _compiled(module, stamp) if same is None else same


def _compiled(module: ModuleType, stamp: tuple[int, int, int]) -> bool:
    """Return whether the bytecode that a module's import has left is of a source as it is now.

    Its second to fourth word are flags, 0 where the source is known by its time, this time in seconds and its size.
    """
    try:
        head = Path(getattr(module, "__cached__", None) or "").read_bytes()[4:16]
    except OSError:
        return False
    flags, seconds, size = (int.from_bytes(head[k : k + 4], "little") for k in (0, 4, 8))
    # words of 32 bits
    now = stamp[0] // 10**9 % 2**32, stamp[2] % 2**32
    return flags == 0 and (seconds, size) == now


def _same(module: ModuleType, source: bytes, path: str) -> bool | None:
    """Return whether a module is what a source makes of it; None where that cannot be seen."""
    tree = ast.parse(source)
    codes = {c.co_qualname: _doing(c) for c in _inner(compile(source, path, "exec", dont_inherit=True))}
    for value in vars(module).values():
        functions = vars(value).values() if isinstance(value, type) else [value]
        for function in functions:
            function = inspect.unwrap(getattr(function, "py_func", getattr(function, "__func__", function)))
            if not isinstance(function, FunctionType) or function.__module__ != module.__name__:
                continue
            if "<locals>" not in function.__qualname__ and codes.get(function.__qualname__) != _doing(
                function.__code__
            ):
                return False
    return _all_of(_same_statement(module, node, module) for node in tree.body)


def _all_of(found: Iterable[bool | None]) -> bool | None:
    """Return False if one of them is, else None if one of them is, else True."""
    seen = set(found)
    return False if False in seen else None if None in seen else True


def _same_statement(module: ModuleType, node: ast.stmt, owner: ModuleType | type) -> bool | None:
    """Return whether a statement of a module or of a class in it gave what this has; None where it cannot be seen."""
    if isinstance(node, ast.Pass) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
        return True
    if isinstance(node, (ast.Import, ast.ImportFrom)) and owner is module:
        return _all_of(_same_import(module, node, alias) for alias in node.names)
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
        made = vars(owner).get(node.name)
        return None if node.decorator_list or not isinstance(made, FunctionType) else _same_defaults(made, node.args)
    if isinstance(node, ast.ClassDef):
        made = vars(owner).get(node.name)
        if node.decorator_list or node.keywords or not isinstance(made, type):
            return None
        return _all_of(_same_statement(module, inner, made) for inner in node.body)
    if isinstance(node, ast.AnnAssign) and node.value is None:
        return True
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    if not targets or not all(isinstance(target, ast.Name) for target in targets):
        return None
    return _all_of(_same_value(vars(owner).get(target.id, node), node.value) for target in targets)  # type: ignore[attr-defined]


def _same_import(module: ModuleType, node: ast.Import | ast.ImportFrom, alias: ast.alias) -> bool | None:
    """Return whether a name that a module has imported is what the statement imports."""
    if isinstance(node, ast.Import):
        wanted = alias.name if alias.asname else alias.name.partition(".")[0]
        return vars(module).get(alias.asname or wanted) is sys.modules.get(wanted, node)
    if alias.name == "*":
        return None
    package = module.__package__ or ""
    home = "." * node.level + (node.module or "")
    try:
        source = sys.modules[importlib.util.resolve_name(home, package)]
        wanted = getattr(source, alias.name)
    except (KeyError, ImportError, AttributeError):
        return False
    return vars(module).get(alias.asname or alias.name) is wanted


def _same_defaults(function: FunctionType, given: ast.arguments) -> bool | None:
    """Return whether the defaults of a function's arguments are those of a source."""
    by_name = function.__kwdefaults__ or {}
    wanted = {arg.arg: node for arg, node in zip(given.kwonlyargs, given.kw_defaults) if node is not None}
    places = function.__defaults__ or ()
    if len(places) != len(given.defaults) or by_name.keys() != wanted.keys():
        return False
    pairs = [*zip(places, given.defaults), *((by_name[name], node) for name, node in wanted.items())]
    return _all_of(_same_value(value, node) for value, node in pairs)


def _same_value(value: Any, node: ast.expr) -> bool | None:
    """Return whether a value is that of a literal; None for another expression, and what something has replaced."""
    try:
        wanted = ast.literal_eval(node)
    except ValueError:
        return None
    return value == wanted if type(value) is type(wanted) else None


def _inner(code: CodeType) -> Iterator[CodeType]:
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield constant
            yield from _inner(constant)


def _doing(code: CodeType) -> tuple:
    """Return what a function does, without its lines, and in messages without texts of several words and formatted
    ones."""
    whole = list(dis.get_instructions(code))
    messages = _in_messages(whole)
    formatted = [i for i in messages if i.opname.startswith(("BUILD_STRING", "FORMAT_", "CONVERT_"))]
    words = [i for i in messages if i.opname == "LOAD_CONST" and isinstance(i.argval, str) and " " in i.argval]
    muted = {i.offset for i in words} | {i.offset for i in messages if any(_inside(i, text) for text in formatted)}
    kept = [i for i in whole if i.offset not in muted]
    places = [i.offset for i in kept]

    def argument(i: dis.Instruction) -> Any:
        if i.opcode in (*dis.hasjrel, *dis.hasjabs):
            # over how many bytes depends on messages
            return bisect.bisect_left(places, i.argval)
        return _doing(i.argval) if isinstance(i.argval, CodeType) else repr(i.argval)

    return [(i.opname, argument(i)) for i in kept], code.co_varnames, code.co_flags


def _in_messages(code: list[dis.Instruction]) -> list[dis.Instruction]:
    """Return the instructions of what is raised, told by an assertion or warned of."""
    spans, found, asserted = [], set[int](), False
    for i in code:
        if asserted:
            # the condition stands before
            found.add(i.offset)
            asserted = i.opname != "RAISE_VARARGS"
        elif i.opname == "LOAD_ASSERTION_ERROR":
            asserted = True
        elif i.opname == "RAISE_VARARGS":
            spans.append(i)
        elif i.argval in MESSAGES_FROM and i.positions is not None:
            spans += [c for c in code if c.opname.startswith("CALL") and _begin(c) == _begin(i) != (None, None)]
    return [i for i in code if i.offset in found or any(_inside(i, span) for span in spans)]


def _begin(i: dis.Instruction) -> tuple[int | None, int | None]:
    """Return line and column in which what an instruction is of begins."""
    return (None, None) if i.positions is None else (i.positions.lineno, i.positions.col_offset)


def _inside(i: dis.Instruction, other: dis.Instruction) -> bool:
    """Whether what an instruction is of stands, in the source, inside of what another one is of."""
    if i.positions is None or other.positions is None or None in (*i.positions, *other.positions):
        return False
    (first, last, left, right), (start, end, begin, stop) = i.positions, other.positions
    return (start, begin) <= (first, left) and (last, right) <= (end, stop)
