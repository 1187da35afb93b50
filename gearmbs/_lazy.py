"""Names of a package that are imported when they are first used, so that importing the package loads nothing heavy."""

from __future__ import annotations

import atexit
import contextlib
import gc
import importlib
import sys
from collections.abc import Iterator, Mapping
from types import ModuleType
from typing import Any

# the interpreter looks for cycles among all modules once more while it ends, which takes as long as importing them
atexit.register(gc.freeze)


@contextlib.contextmanager
def uncollected() -> Iterator[None]:
    """Pause the garbage collector, for what makes many objects that stay: it would go through them in vain."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


class _LatePackage(ModuleType):
    """A package whose public names are found when asked for.

    A public name may be that of the module it lives in, as `gearmbs.signals.envelope`: the name is then what the
    package says it is, whether or not the module has been imported.
    """

    _homes: Mapping[str, str]

    def __getattr__(self, name: str) -> Any:
        home = self._homes.get(name)
        if home is None:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        module, colon, other = home.partition(":")
        with uncollected():
            value = importlib.import_module(module, self.__name__)
        if other or not colon:
            value = getattr(value, other or name)
        ModuleType.__setattr__(self, name, value)
        return value

    def __setattr__(self, name: str, value: Any) -> None:
        # the import system binds each submodule to its name
        if not (isinstance(value, ModuleType) and not self._homes.get(name, ":").endswith(":")):
            ModuleType.__setattr__(self, name, value)

    def __dir__(self) -> list[str]:
        return sorted({*self.__dict__, *self._homes} - {"_homes"})


def late(package: str, homes: Mapping[str, str]) -> None:
    """Have names of a package imported from elsewhere at their first use.

    Parameters
    ----------
    package : str
        Its ``__name__``.
    homes : mapping
        Module by name, ``".module"`` for one of the package; ``"module:other"`` where the name is another there,
        ``"module:"`` for the module itself.
    """
    module = sys.modules[package]
    module.__dict__["_homes"] = dict(homes)
    module.__class__ = _LatePackage
