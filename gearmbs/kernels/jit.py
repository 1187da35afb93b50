"""``njit`` as this package uses it: declared signatures, compiled or loaded when first called, cached by content.

numba's own ``njit`` with a signature compiles or loads at decoration, so that importing a module costs as much as using
all of it; it compiles every helper as if Python called it; and its cache sees only the file a function stands in. A
`Kernel` differs from a dispatcher of numba's in these eight points:

* A declared signature is looked at when the kernel is first called or first compiled into a caller.
* A kernel that Python calls is an *entry*: machine code with a wrapper for Python. A kernel that kernels call is a
  *part*: LLVM code without wrappers that is optimised inside its callers only. One function may be both.
* Entries and parts are kept in `gearmbs.kernels.cache` under a digest of all they are made of: their own code, the code
  of the kernels they call, and the constants they name. What has not changed is never compiled again, and nothing
  that has changed is ever found.
* An entry that is kept is called without numba, see `gearmbs.kernels.entries`; numba is imported where something is
  compiled, and by functions of a user's that it compiles.
* A kernel may be *late*: its callers find it when they first call it; see `gearmbs.kernels.own.late`.
* An index that is computed counts from the start of an array; see `gearmbs.kernels.own.jit`.
* References are counted of arrays that a kernel makes, not of those that it is handed; see
  `gearmbs.kernels.own.references`.
* What a kernel is compiled with is in its own decorator: numba would hand the options of whoever asks first down to it.

The decorator is used like numba's. Literal integers among the arguments count as plain integers, so that a helper
without a signature is compiled once and not once a literal.
"""

from __future__ import annotations

import functools
import importlib
import os
import sys
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from gearmbs.kernels import cache, entries, kinds

SWITCHED_OFF = "NUMBA_DISABLE_JIT"
"""Variable of the environment, of numba's, that leaves all functions to Python."""


def njit(
    signature_or_function: Any = None,
    *,
    cache: bool = False,
    late: bool = False,
    straight: bool = False,
    **options: Any,
) -> Any:
    """Compile a function for use from Python and from other kernels.

    Parameters
    ----------
    signature_or_function : function, signature or str, optional
        As of `numba.njit`: the function, or one signature, by type (`gearmbs.kernels.kinds`, or numba's) or as text.
    cache : bool
        Without it this is numba's own decorator: compiled at once and for this process only.
    late : bool
        Whether compiled callers look for the kernel when they first call it; see `gearmbs.kernels.own.late`. It needs a
        signature.
    straight : bool
        Whether the kernel has no branches, so that it may be compiled by `gearmbs.kernels.own.straight`.
    **options
        Further options of `numba.njit`: ``nogil``, ``error_model``, ``fastmath``, ``forceinline``.

    Returns
    -------
    Kernel, or a decorator that returns one
    """
    if not cache or _is_switched_off():
        import numba

        arguments = () if signature_or_function is None else (kinds.numba_of(signature_or_function),)
        return numba.njit(*arguments, **options)
    if isinstance(signature_or_function, type(_is_switched_off)):
        return Kernel(signature_or_function, None, options)
    return lambda function: Kernel(function, signature_or_function, options, late, straight)


def _is_switched_off() -> bool:
    if "numba" not in sys.modules and SWITCHED_OFF not in os.environ:
        return False
    from numba.core import config

    return bool(config.DISABLE_JIT)


def is_compiled(function: Any) -> bool:
    """Return whether a function is a kernel, or one that numba compiles."""
    if isinstance(function, Kernel):
        return True
    if "numba" not in sys.modules:
        return False
    from numba.extending import is_jitted

    return bool(is_jitted(function))


def compilation_error() -> type[Exception]:
    """Return what numba raises where a function cannot be compiled."""
    found: type[Exception] = importlib.import_module("numba").core.errors.NumbaError
    return found


_opening = threading.RLock()


class Kernel:
    """A function that is compiled or loaded when it is called.

    Parameters
    ----------
    function : function
    declared : signature or str, optional
        The only signature; without it the types of the arguments decide.
    options : dict
        Options of `numba.njit`.
    late, straight : bool
        See `njit`.

    Attributes
    ----------
    py_func : function
        The function itself, for Python.
    """

    def __init__(
        self, function: Callable, declared: Any, options: dict[str, Any], late: bool = False, straight: bool = False
    ) -> None:
        self.__module__, self.__doc__ = function.__module__, function.__doc__
        self.__name__, self.__qualname__ = function.__name__, function.__qualname__
        self.py_func = self.__wrapped__ = function
        self.__code__ = function.__code__
        self.declared, self.options, self.late, self.straight = declared, options, late, straight
        self.targetoptions = {"boundscheck": None, **options, "nopython": True}
        self._signature: Any = None
        self._entry: entries.Entry | None = None
        self._fits: Callable[..., bool] | None = None

    def __repr__(self) -> str:
        return f"Kernel({self.__module__}.{self.__qualname__})"

    def __reduce__(self) -> tuple:
        return _found, (self.__module__, self.__qualname__)

    @property
    def signature(self) -> Any:
        """The declared signature, its types told here or numba's; None if there is none."""
        if self._signature is None and self.declared is not None:
            told = self.declared
            if isinstance(told, str) and not isinstance(told, kinds.Signature):
                told = kinds.read(told) or _numba_signature(told)
            self._signature = told if hasattr(told, "return_type") else kinds.Signature(None, tuple(told))
        return self._signature

    def declared_types(self) -> tuple[tuple, Any]:
        """Return the types of the declared signature: arguments and result."""
        signature = self.signature
        return tuple(signature.args), signature.return_type

    # from Python

    def __call__(self, *args: Any, **kws: Any) -> Any:
        """Call the entry; where arguments do not fit as they are, numba converts or refuses them."""
        if self._fits is None:
            self._fits = _fits_of(self.signature) if self.declared is not None else _fits_never
        if not kws and len(args) == self.__code__.co_argcount and self._fits(*args):
            return (self._entry or self.entry()).call(*args)
        return self.dispatcher(*args, **kws)

    def entry(self) -> entries.Entry:
        """Return the entry of the declared signature; compile or load it if needed."""
        if self._entry is None:
            self.compile(self.declared)
        assert self._entry is not None
        return self._entry

    def ready(self) -> Kernel:
        """Compile or load the entry of the declared signature, unless it is there."""
        if self.declared is not None:
            self.entry()
        return self

    def compile(self, sig: Any) -> Any:
        """Compile or load the entry of a signature; return the function for Python."""
        if self.declared is None:
            return self.dispatcher.compile(kinds.numba_of(sig))
        if self._entry is None:
            found = self._kept()
            if found is None:
                numbas = self.dispatcher.entry()
                # what was compiled is taken as from the disk, as everywhere else
                found = self._kept() or numbas
            with _opening:
                # of threads that have come this far at once the first counts: others may have its address
                self._entry = self._entry or found
        return self._entry.call

    def _kept(self) -> entries.Entry | None:
        """Return the entry from disk, None if it is not there or numba has to load it."""
        return cache.load(self, "entry", self.declared_types()[0], entries.rebuild) if entries.HERE else None

    @property
    def overloads(self) -> Any:
        """What is compiled so far for Python, by the types of arguments."""
        if self.declared is None:
            return self.dispatcher.overloads
        return {} if self._entry is None else {self.declared_types()[0]: self._entry}

    # for the compiler

    @property
    def dispatcher(self) -> Any:
        """Numba's part of the kernel."""
        found = self.__dict__.get("_dispatcher")
        if found is None:
            make = importlib.import_module("gearmbs.kernels.own.jit").Dispatcher
            importlib.import_module("gearmbs.kernels.structs").let_numba_know()
            with _opening:
                found = self.__dict__.get("_dispatcher")
                if found is None:
                    found = self.__dict__["_dispatcher"] = make(self)
        return found

    @property
    def _numba_type_(self) -> Any:
        """Numba's type of the kernel where compiled code names it, or is handed it."""
        return self.dispatcher._numba_type_

    def __wrapper_address__(self) -> int:
        """Return the address that numba calls where it is handed the kernel as a function of a declared type."""
        found = self.dispatcher.get_compile_result(kinds.numba_of(self.signature))
        return found.library.get_pointer_to_function(found.fndesc.llvm_cfunc_wrapper_name)

    def part(self, args: tuple) -> Any:
        """Return the part for some types of arguments; compile or load it if needed."""
        return self.dispatcher.part(kinds.numba_of(tuple(args)))

    def _compile(self, library: Any, args: tuple, result: Any, name: str) -> Any:
        return self.dispatcher.compiled(library, kinds.numba_of(args), kinds.numba_of(result), name)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(f"{type(self).__name__} object has no attribute {name!r}")
        return getattr(self.dispatcher, name)


def _found(module: str, name: str) -> Any:
    found: Any = importlib.import_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    return found


def _numba_signature(text: str) -> Any:
    """Return a signature of types that only numba knows."""
    from numba.core import sigutils

    args, result = sigutils.normalize_signature(text)
    return kinds.Signature(result, tuple(args))


# Whether arguments fit as they are.
#
# A wrapper of numba's takes an array for one of its type as soon as the size of an item and the number of dimensions
# fit, and cuts what is no integer to one. Numba's dispatcher looks at types first; so does this.


def _fits_never(*args: Any) -> bool:
    return False


@functools.cache
def _fits_of(signature: Any) -> Callable[..., bool]:
    """Return what tells whether arguments fit; numba's own types never do."""
    names = [f"a{k}" for k in range(len(signature.args))]
    space: dict[str, Any] = {"ndarray": np.ndarray}
    tests = [_test(kind, name, space) for kind, name in zip(signature.args, names)]
    made: Callable[..., bool] = eval(f"lambda {', '.join(names)}: {' and '.join(tests) or True}", space)
    return made


_CLASSES = {"f": (float, int, np.floating, np.integer), "i": (int, np.integer), "b": (bool, np.bool_)}
"""Numbers that are taken for real ones, integers and truth values."""


def _test(kind: Any, name: str, space: dict[str, Any]) -> str:
    """Return the text of a test of one argument; what it names is added to a space."""
    if not isinstance(kind, kinds.Kind):
        return "False"
    own = f"of_{name.replace('[', '_').replace(']', '')}"
    if kind.form == "array":
        item, dimensions, layout = kind.parts
        space[own] = np.dtype(item.text)
        # numpy's names for arrays that are aligned and may be written, of the first also contiguous
        flag = "carray" if layout == "C" else "behaved"
        return (
            f"type({name}) is ndarray and {name}.dtype == {own} and {name}.ndim == {dimensions} and {name}.flags.{flag}"
        )
    if kind.form == "number" and kind != kinds.void:
        letter = np.dtype(kind.text).kind
        space[own] = _CLASSES["i" if letter == "u" else letter]
        return f"isinstance({name}, {own})"
    if kind.form in ("tuple", "named"):
        space[own] = kind.parts[-1] if kind.form == "named" else tuple
        inner = [_test(part, f"{name}[{k}]", space) for k, part in enumerate(kind.parts[0])]
        return " and ".join([f"type({name}) is {own} and len({name}) == {len(inner)}", *inner])
    if kind.form == "struct":
        space[own] = kind
        return f"getattr(type({name}), 'struct_kind', None) == {own}"
    return "False"
