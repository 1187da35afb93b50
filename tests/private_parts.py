"""What the plain mode does without: modules of numba and llvmlite that their references do not name."""

import ast
import builtins
from pathlib import Path

PRIVATE = ("numba.core", "numba.np", "numba.cpython", "llvmlite")


def _is_private(module: str) -> bool:
    return any(module == name or module.startswith(f"{name}.") for name in PRIVATE)


def refuse(packages=("gearmbs",)):
    """Raise ImportError in this process from now on where a module of some packages imports a private part."""
    real = builtins.__import__

    def guarded(name, space=None, places=None, fromlist=(), level=0):
        # compiled modules of numba's import in the name of whoever called them, with a list
        asking = "" if isinstance(fromlist, list) else (space or {}).get("__name__", "")
        if asking.partition(".")[0] in packages:
            for module in (name, *(f"{name}.{item}" for item in fromlist or ())):
                if _is_private(module):
                    raise ImportError(f"{asking} imports {module}, a private part of numba")
        return real(name, space, places, fromlist, level)

    builtins.__import__ = guarded


def named_by(path: Path) -> set[str]:
    """Return the private parts that the source of a module names."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found |= {node.module or "", *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            found.add(f"{node.value.id}.{node.attr}")
    return {name for name in found if _is_private(name)}
