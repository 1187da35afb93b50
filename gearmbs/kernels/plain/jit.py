"""``njit`` of the plain mode: numba's own compiler and cache behind the decorator of `gearmbs.kernels.jit`.

A `Kernel` compiles nothing until it is called, or named by what is being compiled, and then for its declared
signature, if it has one. It is no subclass of numba's: compiled code takes it for the dispatcher that it holds, by
``numba.extending.typeof_impl``. A late kernel stands in its callers as a call through an address; see `_late`.

Numba's cache looks at the file of a function only, and not at those of the functions it calls. So the cache of this
mode stands in a folder named after a digest of all sources of the kernel's package: whoever edits one compiles anew.
"""

from __future__ import annotations

import contextlib
import ctypes
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

import llvmlite.binding as llvm
import numba
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, typeof_impl

CompilationError = numba.NumbaError
"""What numba raises where a function cannot be compiled."""

OWN_OPTIONS = {"forceinline"}
"""Options of kernels that numba does not document; all that they change is time."""

FINDER = "gearmbs_plain_find_late_kernel"
"""Symbol of what compiled code calls to find a late kernel."""

TELLER = "gearmbs_plain_tell_of_exception"
"""Symbol of what a C function calls when the function behind it raises."""

_POINTER = ir.IntType(8).as_pointer()
_folder_lock = threading.RLock()


def njit(signature_or_function: Any = None, *, cache: bool = False, late: bool = False, **options: Any) -> Any:
    """Compile a function for use from Python and from other kernels; arguments are those of `gearmbs.kernels.jit`."""
    if not cache or numba.config.DISABLE_JIT:
        arguments = () if signature_or_function is None else (signature_or_function,)
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
        self.declared = declared
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
            if self.late:
                c_function(self, self.signature)
            else:
                self.dispatcher.compile(self.signature)
                self.dispatcher.disable_compile()
            self._is_ready = True
        return self

    def compile(self, signature: Any) -> None:
        """Compile or load what is to be called with some types."""
        self.dispatcher.compile(signature)

    def __call__(self, *args: Any, **kws: Any) -> Any:
        """Call the compiled function."""
        return checked(self.compiled)(*args, **kws)

    @functools.cached_property
    def caller(self) -> Any:
        """What stands for a late kernel in those that call it."""
        return _late(self)


def _found(module: str, name: str) -> Any:
    return getattr(importlib.import_module(module), name)


@typeof_impl.register(Kernel)
def _typeof(value: Kernel, context: Any) -> Any:
    return types.Dispatcher(value.caller if value.late else value.ready().dispatcher)


# where numba keeps what it compiles


@contextlib.contextmanager
def keeping(module: str, inner: str = "") -> Iterator[None]:
    """Have numba choose, for what is decorated meanwhile, the folder of a module's package, or one inside it."""
    with _folder_lock:
        before = numba.config.CACHE_DIR
        place = folder(module.partition(".")[0], before)
        if not place.exists():
            _say_once("compiling numerical kernels in the plain mode, which takes some minutes; they are kept")
        numba.config.CACHE_DIR = str(place / inner)
        try:
            yield
        finally:
            numba.config.CACHE_DIR = before


@functools.cache
def _say_once(line: str) -> None:
    print(f"gearmbs: {line}", file=sys.stderr, flush=True)


@functools.cache
def folder(package: str, chosen: str) -> Path:
    """Return where numba keeps the kernels of a package: a new place after each edit of it.

    Parameters
    ----------
    package : str
    chosen : str
        ``NUMBA_CACHE_DIR``; without it they are beside the package, or in the user's cache folder.
    """
    file = getattr(sys.modules.get(package), "__file__", None)
    digest = hashlib.sha256(f"{numba.__version__} {sys.version}".encode())
    root = Path(file).parent if file is not None and Path(file).name == "__init__.py" else None
    if root is not None:
        for path in sorted(root.rglob("*.py")):
            digest.update(f"{path.relative_to(root)}\0".encode() + path.read_bytes())
    name = f"plain-{digest.hexdigest()[:16]}"
    if chosen:
        return Path(chosen) / package / name
    if root is not None and os.access(root, os.W_OK):
        return root / "__pycache__" / name
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gearmbs" / package / name


# C functions


_functions: dict[Any, Any] = {}


def c_function(kernel: Any, signature: Any) -> Any:
    """Return a kernel, or a function compiled by `numba.njit`, as a C function; it is kept alive.

    An exception cannot leave a C function. Kernels that are called so raise none; of other people's functions see
    `_guarded`.
    """
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
    """Return a plain function that calls another one and spoils all its numbers if it raises, so that a run fails."""
    name = function.py_func.__qualname__

    @intrinsic
    def tell(typingctx):
        def codegen(context, builder, sig, values):
            module = builder.module
            told = ir.Function(module, ir.FunctionType(ir.VoidType(), (_POINTER,)), TELLER)
            builder.call(told, (builder.bitcast(_text(module, name), _POINTER),))
            return context.get_dummy_value()

        return types.void(), codegen

    names = [f"a{k}" for k in range(len(signature.args))]
    arguments = ", ".join(names)
    spoiled = "".join(
        f"        {name}[...] = nan\n"
        for name, kind in zip(names, signature.args)
        if isinstance(kind, types.Array) and isinstance(kind.dtype, types.Float)
    )
    space = {"function": function, "tell": tell, "nan": math.nan}
    call = (
        f"def guarded({arguments}):\n    found = {'None' if signature.return_type == types.void else 'nan'}\n"
        f"    try:\n        {'' if signature.return_type == types.void else 'found = '}function({arguments})\n"
        f"    except Exception:\n        tell()\n{spoiled}    return found\n"
    )
    exec(call, space)
    return space["guarded"]


@ctypes.CFUNCTYPE(None, ctypes.c_char_p)
def _tell(name: bytes) -> None:
    print(f"gearmbs: function {name.decode()} raised an exception; its numbers become NaN", file=sys.stderr, flush=True)


llvm.add_symbol(TELLER, ctypes.cast(_tell, ctypes.c_void_p).value)


def _text(module: ir.Module, text: str) -> Any:
    """Return a constant that holds a text."""
    room = bytearray(text.encode() + b"\0")
    told = ir.GlobalVariable(module, ir.ArrayType(ir.IntType(8), len(room)), module.get_unique_name("text"))
    told.linkage, told.global_constant = "internal", True
    told.initializer = ir.Constant(told.value_type, room)
    return told


def caller(signature: Any) -> Any:
    """Return what turns an address, in compiled code, into a function of ``signature`` that can be called."""
    function = types.ExternalFunctionPointer(signature, None)

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
    """Return a compiled function that takes kernels as arguments, and that raises if a late kernel is missing.

    C functions on the way hide the exception of a missing kernel.
    """

    @functools.wraps(function)
    def call(*args: Any, **kws: Any) -> Any:
        out = function(*(arg.compiled if isinstance(arg, Kernel) else arg for arg in args), **kws)
        if _failures:
            raise RuntimeError(_failures[0])
        return out

    return call


def _late(kernel: Kernel) -> Any:
    """Return a compiled function that calls a late kernel through its address, and finds that when it is first called.

    So what most models never need is not compiled for them.
    """
    signature = kernel.signature
    name = f"{kernel.__module__}:{kernel.py_func.__name__}"

    @intrinsic
    def find(typingctx):
        return types.int64(), lambda context, builder, sig, values: _found_address(builder, name)

    arguments = ", ".join(f"a{k}" for k in range(len(signature.args)))
    message = f"{name} could not be compiled; what went wrong was printed"
    space = {"find": find, "function_at": caller(signature), "message": message}
    exec(
        f"def late({arguments}):\n    place = find()\n    if place == 0:\n        raise RuntimeError(message)\n"
        f"    return function_at(place)({arguments})\n",
        space,
    )
    call = numba.njit(space["late"])
    call.compile(signature)
    call.disable_compile()
    return call


def _found_address(builder: Any, name: str) -> Any:
    """Write instructions that look an address up the first time and remember it; it is zero if there is none."""
    module = builder.module
    word = ir.IntType(64)
    slot = ir.GlobalVariable(module, word, module.get_unique_name("slot"))
    slot.linkage, slot.initializer = "internal", ir.Constant(word, 0)
    finder = ir.Function(module, ir.FunctionType(ir.VoidType(), (word.as_pointer(), _POINTER)), FINDER)
    first = builder.icmp_signed("==", builder.load(slot), ir.Constant(word, 0))
    with builder.if_then(first, likely=False):
        builder.call(finder, (slot, builder.bitcast(_text(module, name), _POINTER)))
    return builder.load(slot)


@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p)
def _find(slot: int, name: bytes) -> None:
    """Compile or load a late kernel and write its address to a slot."""
    try:
        kernel = _found(*name.decode().split(":"))
        ctypes.c_int64.from_address(slot).value = c_function(kernel, kernel.signature).address
    except BaseException:
        # there is nobody to raise it to but compiled code, which raises an error of its own
        traceback.print_exc(file=sys.stderr)
        _failures.append(f"{name.decode()} could not be compiled; what went wrong was printed")


llvm.add_symbol(FINDER, ctypes.cast(_find, ctypes.c_void_p).value)
