"""Names that are looked after when they are used: late ones, which load nothing heavy before, and former ones."""

from __future__ import annotations

import atexit
import contextlib
import functools
import gc
import importlib
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

# the interpreter looks for cycles among all modules once more while it ends, which takes as long as importing them
atexit.register(gc.freeze)


@contextlib.contextmanager
def uncollected() -> Iterator[None]:
    """Pause the garbage collector, for what makes many objects that stay: it would go through them in vain.

    Where modules were imported, all there is becomes old, which no collection but a full one looks at: the next of the
    young would go through each object of the modules otherwise, a tenth of the time
    of a fresh process that runs a case.
    """
    enabled, known = gc.isenabled(), len(sys.modules)
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            if len(sys.modules) > known and not gc.get_freeze_count():
                # from there to the oldest generation, unlooked at; what somebody else froze stays where it is
                gc.freeze()
                gc.unfreeze()
            gc.enable()


OTHER_WORDS: dict[str, dict[str, str]] = {
    "gearmbs": {
        "read": "read_signal(path), read_deck(path) or read_pulses(path)",
        "load": "load_case(path) or read_signal(path)",
        "run": "run_case(case), run_train(train) or run_deck(deck)",
        "solve": "simulate(mechanism, t_end) or solve_dae(problem, ...)",
        "reduce": "reduce_model(model, ...), or Shaft(...).modal_model(...)",
        "modes": "linear_modes(mechanism)",
        "plot": "the plot() of an object",
    },
}
"""What to write for names of packages that other programs use."""


class NoAttribute(AttributeError):
    """A name that is none, told with what it may have meant.

    Most of those who ask for an attribute in vain are programs that never read the message, which is made when it is.

    Parameters
    ----------
    owner : str
        What has no such attribute, as messages name it.
    name : str
        The name.
    known : callable
        Returns the names that there are.
    others : mapping of str to str
        What to write for names that other programs use.
    """

    def __init__(self, owner: str, name: str, known: Callable[[], Iterable[str]], others: Mapping[str, str]) -> None:
        super().__init__(owner, name)
        # the interpreter adds a guess of its own to errors that know neither a name nor an object
        self.name = name
        self._known = known
        self._others = others

    def __str__(self) -> str:
        from gearmbs.wording import attribute_meant

        owner, name = self.args
        said = f"{owner} has no attribute {name!r}"
        if name in self._others:
            return f"{said}; write {self._others[name]}"
        return said + attribute_meant(name, [one for one in self._known() if one[0] != "_"])

    def __reduce__(self) -> tuple[type, tuple[str]]:
        return AttributeError, (str(self),)


class Guessed:
    """What objects share that tell what an unknown attribute may have meant."""

    other_words: ClassVar[Mapping[str, str]] = {}
    """What to write for names that other programs use."""

    if not TYPE_CHECKING:  # type checkers would take any name for one that there is

        def __getattr__(self, name: str) -> object:
            kind = type(self)
            raise NoAttribute(f"{kind.__name__} object", name, lambda: dir(self), kind.other_words)


class _LatePackage(ModuleType):
    """A package whose public names are found when asked for.

    A public name may be that of a module, as `gearmbs.identify.fit`: the name is then what the package says it is,
    whether or not the module has been imported.
    """

    _homes: Mapping[str, str]

    def __getattr__(self, name: str) -> object:
        home = self._homes.get(name)
        if home is None:
            raise NoAttribute(
                f"module {self.__name__!r}", name, lambda: self._homes, OTHER_WORDS.get(self.__name__, {})
            )
        with uncollected():
            if home == ".":
                value: object = importlib.import_module(f".{name}", self.__name__)
            else:
                value = getattr(importlib.import_module(home, self.__name__), name)
        ModuleType.__setattr__(self, name, value)
        return value

    def __setattr__(self, name: str, value: object) -> None:
        # the import system binds each submodule to its name
        if not (isinstance(value, ModuleType) and self._homes.get(name, ".") != "."):
            ModuleType.__setattr__(self, name, value)

    def __dir__(self) -> list[str]:
        return sorted({*self.__dict__, *self._homes} - {"_homes"})


def late(package: str) -> list[str]:
    """Have the public names of a package imported from elsewhere at their first use.

    They are listed once, in the stub beside the package's ``__init__.py``, which type checkers and editors read too:
    lines ``from .module import name as name``, and ``from . import name as name`` for a module itself.
    ``lazy_loader.attach_stub`` reads such stubs as well, but refuses names of other packages, lets a module take the
    place of a function of its name that lives elsewhere, and takes the time to parse them as Python.

    Parameters
    ----------
    package : str
        Its ``__name__``.

    Returns
    -------
    list of str
        The names, for ``__all__``.
    """
    module = sys.modules[package]
    # by the loader, which may read from an archive
    text = module.__loader__.get_data(os.path.join(module.__path__[0], "__init__.pyi")).decode()  # type: ignore[union-attr]
    words = [line.split() for line in text.splitlines() if line.startswith("from ")]
    homes = {name: home for _, home, _, name, _, _ in words}
    module.__dict__["_homes"] = homes
    module.__class__ = _LatePackage
    return sorted(homes)


def former_name(old: str, method: Callable[..., Any], remedy: str) -> Callable[..., Any]:
    """Return a method that warns and calls the one that took its place.

    Parameters
    ----------
    old : str
        The former name.
    method : callable
        The method of today.
    remedy : str
        What to write instead, after "is deprecated: ".
    """

    @functools.wraps(method)
    def call(self: Any, *args: Any, **kwargs: Any) -> Any:
        warnings.warn(f"{type(self).__name__}.{old} is deprecated: {remedy}", DeprecationWarning, stacklevel=2)
        return method(self, *args, **kwargs)

    call.__name__, call.__doc__ = old, f"Deprecated: {remedy}."
    return call


ASKED_FOR = ("dask", "pint", "cupy", "sparse", "cubed")
"""Libraries of arrays by which xarray tells them apart."""


@functools.cache
def spare_duck_arrays() -> None:
    """Let xarray look for arrays of a library only once that has been imported.

    To ask whether an array is one of dask's or pint's, it imports them where they are installed: a fifth of what a
    fresh process spends on a pair. An array of theirs can only be there once they have been imported. An xarray that
    looks for them in another way stays as it is.
    """
    from packaging.version import Version
    from xarray.namedarray import pycompat, utils

    look_up: Any = getattr(pycompat, "_get_cached_duck_array_module", None)
    is_of_dask: Any = getattr(utils, "is_dask_collection", None)
    if look_up is None or is_of_dask is None:
        return
    nothing = SimpleNamespace(module=None, version=Version("0.0.0"), type=(), available=False)

    def known(name: str) -> Any:
        return nothing if name in ASKED_FOR and name not in sys.modules else look_up(name)

    def is_dask_collection(x: object) -> bool:
        return "dask" in sys.modules and is_of_dask(x)

    vars(pycompat)["_get_cached_duck_array_module"] = known
    vars(utils)["is_dask_collection"] = is_dask_collection
