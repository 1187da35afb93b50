"""The text of a function, for whoever compiles or derives from it."""

from __future__ import annotations

import ast
import functools
import inspect
import linecache
from collections.abc import Callable


@functools.lru_cache(maxsize=64)
def _functions_of(file: str, text: str) -> dict[str, ast.FunctionDef]:
    return {node.name: node for node in ast.parse(text, file).body if isinstance(node, ast.FunctionDef)}


def text_of(function: Callable) -> ast.FunctionDef:
    """Return a function of a module as the tree of its text.

    Raises
    ------
    OSError
        If there is no source, or it has been edited since Python read it.
    """
    own = function.__code__
    file = inspect.getsourcefile(function) or own.co_filename
    found = _functions_of(file, "".join(linecache.getlines(file))).get(function.__name__)
    if found is None:
        raise OSError(f"{function.__qualname__}: no source in {file}")
    bare = ast.FunctionDef(**{**dict(ast.iter_fields(found)), "decorator_list": []})
    module = compile(ast.fix_missing_locations(ast.Module([bare], [])), file, "exec")
    read = next(code for code in module.co_consts if hasattr(code, "co_code"))
    if (read.co_code, read.co_consts, read.co_names) != (own.co_code, own.co_consts, own.co_names):
        raise OSError(f"{function.__qualname__}: {file} is not what was imported")
    return found
