"""Names of a package that are imported when they are first used, so that importing the package compiles nothing."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import Any


def late(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package for names that live elsewhere.

    Parameters
    ----------
    package : str
        Its ``__name__``.
    homes : mapping
        Module by name; ``"module:other"`` where the name is another there.
    """

    def get(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, _, other = homes[name].partition(":")
        value = getattr(importlib.import_module(module), other or name)
        setattr(sys.modules[package], name, value)
        return value

    return get
