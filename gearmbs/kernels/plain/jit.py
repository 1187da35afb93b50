"""``njit`` of the plain mode: numba's own compiler and cache behind the decorator of `gearmbs.kernels.jit`.

A `Kernel` compiles nothing until it is called, or named by what is being compiled, and then for its declared
signature, if it has one. It is no subclass of numba's: compiled code takes it for the dispatcher that it holds, by
``numba.extending.typeof_impl``. A late kernel stands in its callers as a call through an address; see `_late`.

Numba's cache looks at the file of a function only, and not at those of the functions it calls. So the cache of this
mode stands in a folder named after a digest of all sources of the kernel's package: whoever edits one compiles anew.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import math
import os
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
from numba import types
from numba.extending import intrinsic, is_jitted, typeof_impl

from gearmbs.kernels import locks
from gearmbs.kernels.kinds import numba_of
from gearmbs.logs import tell


def compilation_error() -> type[Exception]:
    """Return what numba raises where a function cannot be compiled."""
    found: type[Exception] = numba.NumbaError
    return found


OWN_OPTIONS = {"forceinline", "straight"}
"""Options of kernels that numba does not document, or has not; all that they change is time."""

CHOSEN = numba.config.CACHE_DIR
"""``NUMBA_CACHE_DIR``."""

_compiling = threading.RLock()
"""Taken before numba's lock on its compiler, by whatever may compile: threads that take the two in turn would stop."""
_packages_held: list[str] = []


def njit(signature_or_function: Any = None, *, cache: bool = False, late: bool = False, **options: Any) -> Any:
    """Compile a function for use from Python and from other kernels; arguments are those of `gearmbs.kernels.jit`."""
    if not cache or numba.config.DISABLE_JIT:
        arguments = () if signature_or_function is None else (numba_of(signature_or_function),)
        return numba.njit(*arguments, **{k: v for k, v in options.items() if k not in OWN_OPTIONS})
    if callable(signature_or_function) and not hasattr(signature_or_function, "return_type"):
        return Kernel(signature_or_function, None, options)
    return lambda function: Kernel(function, signature_or_function, options, late)


class Kernel:
    """A function that numba compiles, or loads from its cache, when it is called.

    Parameters
    ----------
    function : function
    declared : signature or str, optional
        The only signature; without it the types of the arguments decide.
    options : dict
        Options of `numba.njit`.
    late : bool
        Whether callers find it when they first call it.
    """

    def __init__(self, function: Callable, declared: Any, options: dict[str, Any], late: bool = False) -> None:
        self.py_func = function
        self.declared = numba_of(declared)
        self.late = late
        self.options = {k: v for k, v in options.items() if k not in OWN_OPTIONS}
        functools.update_wrapper(self, function)
        self.__code__ = function.__code__
        self._is_ready = False

    def __repr__(self) -> str:
        return f"Kernel({self.__module__}.{self.py_func.__qualname__})"

    def __reduce__(self) -> tuple:
        return _found, (self.__module__, self.py_func.__qualname__)

    @functools.cached_property
    def dispatcher(self) -> Any:
        """Numba's dispatcher of the function."""
        with keeping(self.__module__):
            return numba.njit(cache=True, **self.options)(self.py_func)

    @property
    def compiled(self) -> Any:
        """Numba's dispatcher with the declared signature there; of a late kernel it compiles when it is called."""
        return (self if self.late else self.ready()).dispatcher

    @functools.cached_property
    def signature(self) -> Any:
        """The declared signature as numba's type, None if there is none."""
        if self.declared is None:
            return None
        return eval(self.declared, vars(types)) if isinstance(self.declared, str) else self.declared

    @property
    def overloads(self) -> Any:
        """What is compiled so far, by the types of arguments."""
        return self.dispatcher.overloads

    def ready(self) -> Kernel:
        """Compile or load the declared signature, unless it is there; there will be no other."""
        if self.signature is not None and not self._is_ready:
            with alone(self.__module__):
                if self.late:
                    self.as_c_function()
                elif not self._is_ready:
                    self.dispatcher.compile(self.signature)
                    self.dispatcher.disable_compile()
                self._is_ready = True
        return self

    @property
    def is_c_function(self) -> bool:
        """Whether kernels of its signature are called through addresses, by what is imported so far."""
        return self.signature in _called_by_address

    def as_c_function(self) -> Any:
        """Compile or load the C function of the declared signature."""
        return c_function(self, self.signature)

    def compile(self, signature: Any) -> None:
        """Compile or load what is to be called with some types."""
        with alone(self.__module__):
            self.dispatcher.compile(numba_of(signature))

    def __call__(self, *args: Any, **kws: Any) -> Any:
        """Call the compiled function."""
        # without a signature it may be compiled for these arguments
        with contextlib.nullcontext() if self.declared is not None else alone(self.__module__):
            return checked(self.compiled)(*args, **kws)

    @functools.cached_property
    def caller(self) -> Any:
        """What stands for a late kernel in those that call it."""
        return _late(self)


def is_compiled(function: Any) -> bool:
    """Return whether a function is a kernel, or one that numba compiles."""
    return isinstance(function, Kernel) or bool(is_jitted(function))


def _found(module: str, name: str) -> Any:
    return getattr(importlib.import_module(module), name)


@typeof_impl.register(Kernel)
def _typeof(value: Kernel, context: Any) -> Any:
    return types.Dispatcher(value.caller if value.late else value.ready().dispatcher)


# where numba keeps what it compiles


@contextlib.contextmanager
def alone(module: str) -> Iterator[Path]:
    """Compile, or load, kernels of a module's package while no other thread or process does; yield their folder.

    Numba's cache takes one kernel for another where two processes write of the same function.
    """
    package = module.partition(".")[0]
    with _compiling, contextlib.ExitStack() as held:
        place = folder(package)
        if package not in _packages_held:
            if not place.exists():
                _say_once("compiling numerical kernels in the plain mode, which takes some minutes; they are kept")
            held.enter_context(locks.held(place / "lock"))
            _packages_held.append(package)
            held.callback(_packages_held.remove, package)
        yield place


@contextlib.contextmanager
def keeping(module: str, inner: str = "") -> Iterator[None]:
    """Have numba choose, for what is decorated meanwhile, the folder of a module's package, or one inside it."""
    with alone(module) as place:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(place / inner)
        try:
            yield
        finally:
            numba.config.CACHE_DIR = before


def _say(line: str) -> None:
    tell("kernels", line)


_say_once = functools.cache(_say)


@functools.cache
def folder(package: str) -> Path:
    """Return where numba keeps the kernels of a package, a new place after each edit of it.

    It is in `CHOSEN`; without that, in the user's cache folder, or, where that cannot be written, beside the package.
    """
    file = getattr(sys.modules.get(package), "__file__", None)
    digest = hashlib.sha256(f"{numba.__version__} {sys.version}".encode())
    root = Path(file).parent if file is not None and Path(file).name == "__init__.py" else None
    if root is not None:
        for path in sorted(root.rglob("*.py")):
            digest.update(f"{path.relative_to(root)}\0".encode() + path.read_bytes())
    name = f"plain-{digest.hexdigest()[:16]}"
    if CHOSEN:
        return Path(CHOSEN) / package / name
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gearmbs" / package
    try:
        user.mkdir(parents=True, exist_ok=True)
    except OSError:
        written = False
    else:
        written = os.access(user, os.W_OK)
    return user / name if written or root is None else root / "__pycache__" / name


# C functions


_functions: dict[Any, Any] = {}
_called_by_address: set[Any] = set()


def c_function(kernel: Any, signature: Any) -> Any:
    """Return a kernel, or a function compiled by `numba.njit`, as a C function; it is kept alive.

    An exception cannot leave a C function. Kernels that are called so raise none; those of other people's functions
    are raised by `checked`, see `_guarded`.
    """
    signature = numba_of(signature)
    with alone(getattr(kernel, "__module__", __name__)):
        found = _functions.get((kernel, signature))
        if found is None:
            if isinstance(kernel, Kernel):
                # numba would take a C function of the same signature, which has no wrapper for Python, for the kernel
                with keeping(kernel.__module__, "c"):
                    found = numba.cfunc(signature, cache=True, **kernel.options)(kernel.py_func)
            else:
                found = numba.cfunc(signature)(_guarded(kernel, signature))
            _functions[kernel, signature] = found
    return found


def _guarded(function: Any, signature: Any) -> Callable:
    """Return a plain function that calls another one, and notes what that raises and spoils its numbers.

    So no step is taken with them, and the compiled code soon comes to its end, behind which the exception is raised.
    """
    names = [f"a{k}" for k in range(len(signature.args))]
    arguments = ", ".join(names)
    spoiled = "".join(
        f"        {name}[...] = nan\n"
        for name, kind in zip(names, signature.args)
        if isinstance(kind, types.Array) and isinstance(kind.dtype, types.Float)
    )
    space = {"function": function, "note": _note, "nan": math.nan, "number": len(_guarded_ones)}
    _guarded_ones.append(function)
    call = (
        f"def guarded({arguments}):\n    found = {'None' if signature.return_type == types.void else 'nan'}\n"
        f"    raised = False\n"
        f"    try:\n        {'' if signature.return_type == types.void else 'found = '}function({arguments})\n"
        f"    except Exception:\n        raised = True\n"
        f"    if raised:\n        note(number, ({arguments},))\n{spoiled}    return found\n"
    )
    exec(call, space)
    return space["guarded"]


class _Raised(threading.local):
    """What functions have raised inside the compiled code that a thread runs."""

    def __init__(self) -> None:
        self.errors: list[Exception] = []


_raised = _Raised()
_guarded_ones: list[Any] = []


@numba.njit
def _note(number, arguments):
    with numba.objmode():
        _call_again(number, arguments)


def _call_again(number: int, arguments: tuple) -> None:
    """Note what a function raises, of which compiled code knows no more than that it has."""
    if not _raised.errors:
        try:
            _guarded_ones[number](*arguments)
        except Exception as error:
            _raised.errors.append(error)


def caller(signature: Any) -> Any:
    """Return what turns an address, in compiled code, into a function of ``signature`` that can be called."""
    signature = numba_of(signature)
    function = types.ExternalFunctionPointer(signature, None)
    _called_by_address.add(signature)

    @intrinsic
    def function_at(typingctx, address):
        def codegen(context, builder, sig, args):
            return builder.inttoptr(args[0], context.get_value_type(function))

        return function(types.int64), codegen

    return function_at


# late kernels


_failures: list[str] = []
"""Why late kernels could not be compiled; whatever is computed from then on is not to be believed."""


def checked(function: Callable) -> Callable:
    """Return a compiled function that takes kernels as arguments, and that raises what C functions on the way hide.

    That is what functions of others raise, and that a late kernel is missing.
    """

    @functools.wraps(function)
    def call(*args: Any, **kws: Any) -> Any:
        out = function(*(arg.compiled if isinstance(arg, Kernel) else arg for arg in args), **kws)
        if _raised.errors:
            raise _raised.errors.pop()
        if _failures:
            raise RuntimeError(_failures[0])
        return out

    return call


def _late(kernel: Kernel) -> Any:
    """Return a compiled function that calls a late kernel through its address, for which it asks Python at each call.

    So what most models never need is not compiled for them.
    """
    signature = kernel.signature
    name = f"{kernel.__module__}:{kernel.py_func.__name__}"
    arguments = ", ".join(f"a{k}" for k in range(len(signature.args)))
    message = f"{name} could not be compiled; what went wrong was printed"
    space = {"place_of": _place_of, "name": name, "function_at": caller(signature), "message": message}
    exec(
        f"def late({arguments}):\n    place = place_of(name)\n    if place == 0:\n"
        f"        raise RuntimeError(message)\n    return function_at(place)({arguments})\n",
        space,
    )
    call = numba.njit(space["late"])
    call.compile(signature)
    call.disable_compile()
    return call


@numba.njit
def _place_of(name):
    with numba.objmode(place="intp"):
        place = _late_address(name)
    return place


@functools.cache
def _late_address(name: str) -> int:
    """Compile or load a late kernel and return its address, 0 if there is none."""
    try:
        kernel = _found(*name.split(":"))
        return kernel.as_c_function().address
    except BaseException:
        # C functions on the way to Python hide an exception
        traceback.print_exc(file=sys.stderr)
        _failures.append(f"{name} could not be compiled; what went wrong was printed")
        return 0
