"""``njit`` as this package uses it: declared signatures, compiled or loaded when first called, cached by content.

numba's own ``njit`` with a signature compiles or loads at decoration, so that importing a module costs as much as using
all of it; it compiles every helper as if Python called it; and its cache sees only the file a function stands in. A
`Kernel` is a dispatcher that differs in these seven points:

* A declared signature is looked at when the kernel is first called or first compiled into a caller.
* A kernel that Python calls is an *entry*: machine code with a wrapper for Python. A kernel that kernels call is a
  *part*: LLVM code without wrappers that is optimised inside its callers only. One function may be both.
* Entries and parts are kept in `gearmbs.kernels.cache` under a digest of all they are made of: their own code, the code
  of the kernels they call, and the constants they name. What has not changed is never compiled again, and nothing
  that has changed is ever found.
* A kernel may be *late*: its callers find it when they first call it; see `gearmbs.kernels.late`.
* An index that is computed counts from the start of an array; see `CountedIndices`.
* References are counted of arrays that a kernel makes, not of those that it is handed; see `Lowering`.
* What a kernel is compiled with is in its own decorator: numba would hand the options of whoever asks first down to it.

The decorator is used like numba's. Literal integers among the arguments count as plain integers, so that a helper
without a signature is compiled once and not once a literal.
"""

from __future__ import annotations

import collections
import contextlib
import threading
from collections.abc import Callable
from typing import Any

import numba
from numba import types
from numba.core import bytecode, cgutils, compiler, config, errors, ir, lowering, sigutils, typing
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.cpu_options import FastMathOptions
from numba.core.ir_utils import get_definition, guard
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering, NopythonTypeInference
from numba.core.untyped_passes import ExtractByteCode
from numba.extending import _Intrinsic

from gearmbs.kernels import cache
from gearmbs.kernels.ahead import compile_missing
from gearmbs.kernels.late import late_part
from gearmbs.kernels.library import EntryLibrary, PartLibrary
from gearmbs.kernels.straight import straight as straight_line

CompilationError = errors.NumbaError
"""What numba raises where a function cannot be compiled."""

# Indices of arrays that count from the start: compiled code without the wrap-around of negative ones.
#
# numba takes every signed index for one that may be negative and adds the length of the axis if it is. In kernels whose
# indices come out of tables that is a comparison, a selection and an addition for each number that is read: as many
# instructions as the arithmetic takes. Here an index is unsigned as soon as types are known, so that it is used as it
# is. A negative literal still counts from the end; an index that is computed must not be negative.


@register_pass(mutates_CFG=False, analysis_only=False)
class CountedIndices(FunctionPass):
    """Compiler pass that makes the integer indices of arrays unsigned."""

    _name = "gearmbs_counted_indices"

    def __init__(self) -> None:
        FunctionPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Change the signatures of the reads and writes of array elements."""
        for block in state.func_ir.blocks.values():
            for statement in block.body:
                access = statement.value if isinstance(statement, ir.Assign) else statement
                if isinstance(access, ir.SetItem) or (isinstance(access, ir.Expr) and access.op == "getitem"):
                    signature = state.calltypes.get(access)
                    if signature is None or not isinstance(signature.args[0], types.Array):
                        continue
                    array, index, *value = signature.args
                    counted = _counted(index, access.index, state.func_ir)
                    del state.calltypes[access]
                    state.calltypes[access] = signature.replace(args=(array, counted, *value))
        return True


def _counted(index: Any, variable: ir.Var, func_ir: Any) -> Any:
    """Return the type of an index with its integers unsigned, but for negative literals."""
    if isinstance(index, types.Integer):
        return index if _is_negative(variable, func_ir) else _unsigned(index)
    if isinstance(index, types.BaseTuple):
        made = guard(get_definition, func_ir, variable)
        items = made.items if isinstance(made, ir.Expr) and made.op == "build_tuple" else None
        if items is None:
            return index
        parts = [part if _is_negative(item, func_ir) else _unsigned(part) for part, item in zip(index, items)]
        return types.Tuple(parts)
    return index


def _unsigned(index: Any) -> Any:
    return types.uintp if isinstance(index, types.Integer) and index.signed else index


def _is_negative(variable: ir.Var, func_ir: Any) -> bool:
    made = guard(get_definition, func_ir, variable)
    return isinstance(made, (ir.Const, ir.Global, ir.FreeVar)) and isinstance(made.value, int) and made.value < 0


# References of arrays: counted for what a kernel makes, and for nothing else.
#
# numba counts the references of each array by each of its names: a call of a function that nothing is moved across, on
# entry and on exit, in each kernel that is inlined. But whoever calls a kernel keeps what it hands over until it
# returns, so that an argument may be seen as `gearmbs.kernels.views` see a part of one: by a pointer to its counts that
# is null. Numba's counting of such an array is no counting, and LLVM leaves it out; and where nothing in a kernel is
# made or handed back by what may have made it, no counting is written. What a kernel returns of its arguments stays
# counted: its caller may have made it, and may keep the result alone. Nothing of this is said by a decorator, so that
# no kernel can be called by one that disagrees.

_MADE, _HANDED = "made", "handed"
"""Where an array that is counted may come from: a kernel or what it calls, or its arguments. Views are of neither."""

UNKNOWN = frozenset((_MADE, _HANDED))
"""Origins of what is returned by a kernel that nothing is known of."""

_PASSING = frozenset("build_tuple cast exhaust_iter getattr getiter iternext pair_first phi typed_getitem".split())
"""Operations whose result is, or is part of, what they are given: numba counts them for its sake."""

_PLACES = (types.Integer, types.SliceType, types.EllipsisType, types.NoneType)
"""Types of indices that see a part of an array; others make a copy."""


class _Origins:
    """Where the arrays of a typed function come from.

    Parameters
    ----------
    state : numba.core.compiler.StateDict
        Of a compilation, after types were found.
    """

    def __init__(self, state: Any) -> None:
        self._typemap, self._calltypes = state.typemap, state.calltypes
        self._models = state.targetctx.data_model_manager
        self._of: dict[str, frozenset] = {}
        statements = [s for block in state.func_ir.blocks.values() for s in block.body]
        assigned = [s for s in statements if isinstance(s, ir.Assign) and self._counted(s.target.name)]
        before = None
        while before != self._of:
            # variables of loops come from each other
            before = dict(self._of)
            for one in assigned:
                self._of[one.target.name] = self._of.get(one.target.name, frozenset()) | self._value(one.value)
        self.returned = self._together(s.value for s in statements if isinstance(s, ir.Return))
        """Origins of the result."""
        self.makes = any(_MADE in origins for origins in self._of.values())
        """Whether arrays may be in the function that only it keeps."""

    def _counted(self, name: str) -> bool:
        kind = self._typemap[name]
        return not isinstance(kind, types.Omitted) and self._models[kind].contains_nrt_meminfo()

    def _together(self, variables: Any) -> frozenset:
        return frozenset().union(*(self._of.get(variable.name, frozenset()) for variable in variables))

    def _value(self, value: Any) -> frozenset:
        if isinstance(value, ir.Arg):
            return frozenset((_HANDED,))
        if isinstance(value, ir.Var):
            return self._together((value,))
        if isinstance(value, (ir.Const, ir.Global, ir.FreeVar)):
            # constants of numba's have no counts
            return frozenset()
        if not isinstance(value, ir.Expr):
            return UNKNOWN
        found = self._together(value.list_vars())
        if value.op in _PASSING or (value.op in ("getitem", "static_getitem") and self._is_part(value)):
            return found
        if value.op == "call":
            return self._call(value, found)
        return found | {_MADE}

    def _is_part(self, access: ir.Expr) -> bool:
        """Return whether an index takes a part of an array or tuple, and not a copy as an index array does."""
        index = getattr(access, "index_var", None) if access.op == "static_getitem" else access.index
        kind = self._typemap[index.name] if index is not None else types.intp
        parts = kind.types if isinstance(kind, types.BaseTuple) else (kind,)
        return all(isinstance(part, _PLACES) for part in parts)

    def _call(self, call: ir.Expr, found: frozenset) -> frozenset:
        callee = self._typemap[call.func.name]
        if isinstance(callee, types.NamedTupleClass):
            return found
        if isinstance(callee, types.Function) and isinstance(callee.typing_key, _Intrinsic):
            # those of this package see what others keep
            inside = callee.typing_key._defn.__module__.startswith(f"{__package__}.")
            return frozenset() if inside else found | {_MADE}
        kernel = callee.dispatcher if isinstance(callee, types.Dispatcher) else None
        if isinstance(kernel, Kernel):
            origins = UNKNOWN if kernel.late else kernel.part(self._calltypes[call].args).origins
            passed = found if _HANDED in origins else frozenset()
            return passed | {_MADE} if origins else frozenset()
        return found | {_MADE}


@register_pass(mutates_CFG=True, analysis_only=False)
class Lowering(NativeLowering):
    """Numba's lowering, but that no argument is counted, nor anything where all arrays are views of others'."""

    _name = "gearmbs_lowering"

    @property
    def lowering_class(self) -> Any:
        """Return what writes LLVM code."""
        return _Lower

    def run_pass(self, state: Any) -> bool:
        """Write the code of a function."""
        origins = state.metadata["origins"] = _Origins(state)
        try:
            return NativeLowering.run_pass(self, state)
        except errors.NumbaError:
            if origins.makes:
                raise
            # what numba puts in the place of a call may make an array that has no name
            origins.makes = True
            return NativeLowering.run_pass(self, state)


class _Lower(lowering.Lower):
    """Writes LLVM code of a function."""

    context: Any

    def lower(self) -> None:
        """Write the function; its wrappers, which are written later, are numba's own."""
        origins, whole = self.metadata["origins"], self.context
        if not origins.makes and _HANDED not in origins.returned:
            self.context = whole.subtarget(enable_nrt=False)
        super().lower()
        self.context = whole

    def extract_function_arguments(self) -> Any:
        """Return the arguments; as views unless they may be returned."""
        arguments = super().extract_function_arguments()
        if _HANDED not in self.metadata["origins"].returned:
            arguments = tuple(self._seen(*one) for one in zip(self.fndesc.argtypes, arguments, strict=True))
        self.fnargs = arguments
        return arguments

    def _seen(self, kind: Any, value: Any) -> Any:
        """Return an array, or a tuple of some, without a pointer to its counts."""
        if isinstance(kind, types.Array):
            model = self.context.data_model_manager[kind]
            return model.set(self.builder, value, cgutils.voidptr_t(None), "meminfo")
        if isinstance(kind, types.BaseTuple):
            for k, part in enumerate(kind):
                inner = self._seen(part, self.builder.extract_value(value, k))
                value = self.builder.insert_value(value, inner, k)
        return value


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
        As of `numba.njit`: the function, or one signature, by type or as text.
    cache : bool
        Without it this is numba's own decorator: compiled at once and for this process only.
    late : bool
        Whether compiled callers look for the kernel when they first call it; see `gearmbs.kernels.late`. It needs a
        signature.
    straight : bool
        Whether the kernel has no branches, so that it may be compiled by `gearmbs.kernels.straight`.
    **options
        Further options of `numba.njit`: ``nogil``, ``error_model``, ``fastmath``, ``forceinline``.

    Returns
    -------
    Kernel, or a decorator that returns one
    """
    if not cache or config.DISABLE_JIT:
        arguments = () if signature_or_function is None else (signature_or_function,)
        return numba.njit(*arguments, **options)
    if callable(signature_or_function) and not sigutils.is_signature(signature_or_function):
        return _Unasked(signature_or_function, None, options)
    return lambda function: _Unasked(function, signature_or_function, options, late, straight)


class _Overloads(collections.OrderedDict):
    """Compiled overloads by argument types; the declared one is compiled when it is asked for."""

    def __init__(self, kernel: Kernel) -> None:
        super().__init__()
        self.kernel = kernel

    def __missing__(self, args: tuple) -> Any:
        if self.kernel.declared is None or self.kernel.declared_types()[0] != tuple(args) or len(self):
            raise KeyError(args)
        self.kernel.ready()
        return self[args]


def _target_options(options: dict[str, Any]) -> dict[str, Any]:
    """Return what numba compiles a kernel with."""
    return {"boundscheck": None, **options, "nopython": True}


class Kernel(CPUDispatcher):
    """A dispatcher that compiles or loads what is called, when it is called.

    Parameters
    ----------
    function : function
    declared : signature or str, optional
        The only signature; without it the types of the arguments decide.
    options : dict
        Options of `numba.njit`.
    late, straight : bool
        See `njit`.
    """

    def __init__(
        self, function: Callable, declared: Any, options: dict[str, Any], late: bool = False, straight: bool = False
    ) -> None:
        self.declared = declared
        self.late, self.straight = late, straight
        self.options = options
        self._normalised: tuple | None = None
        self._parts: dict[tuple, Any] = {}
        super().__init__(py_func=function, targetoptions=_target_options(options))
        self.overloads = _Overloads(self)

    def declared_types(self) -> tuple[tuple, Any]:
        """Return the types of the declared signature: arguments and result."""
        if self._normalised is None:
            args, result = sigutils.normalize_signature(self.declared)
            self._normalised = tuple(args), result
        return self._normalised

    def ready(self) -> Kernel:
        """Compile or load the entry of the declared signature, unless it is there."""
        if self._can_compile and self.declared is not None:
            with global_compiler_lock:
                if not len(self.overloads):
                    self.compile(self.declared)
                self.disable_compile()
        return self

    # from Python

    def _compile_for_args(self, *args: Any, **kws: Any) -> Any:
        if self.declared is None:
            return super()._compile_for_args(*args, **kws)
        return self.ready()  # to be called anew, now that the signature is known

    def get_compile_result(self, sig: Any) -> Any:
        """Return the entry of a signature; compile it if needed."""
        return super(Kernel, self.ready()).get_compile_result(sig)

    def compile(self, sig: Any) -> Any:
        """Compile or load the entry of a signature; return the function for Python."""
        with global_compiler_lock, self._compiling_counter:
            args, result = sigutils.normalize_signature(sig)
            args = tuple(args)
            if args in self.overloads:
                return collections.OrderedDict.__getitem__(self.overloads, args).entry_point
            if self.declared is not None:
                args, result = self.declared_types()
            entry = cache.load(self, "entry", args, EntryLibrary.rebuild)
            if entry is None and self.declared is not None and compile_missing(self):
                entry = cache.load(self, "entry", args, EntryLibrary.rebuild)
            if entry is None:
                with cache.compiling(self, "entry", args) as slot:
                    entry = slot.load(EntryLibrary.rebuild)
                    if entry is None:
                        entry = self._compile(EntryLibrary, args, result, slot.name)
                        slot.save(EntryLibrary.reduce(entry))
            self.add_overload(entry)
            return entry.entry_point

    # from other kernels

    def get_call_template(self, args: tuple, kws: dict) -> Any:
        """Return what types a call in compiled code, after making sure that the part is there."""
        pysig, args = self._compiler.fold_argument_types(args, kws)
        args = tuple(numba.types.unliteral(a) for a in args)
        self.part(self.declared_types()[0] if self.declared is not None else args)
        name = self.py_func.__name__
        signatures = [part.signature for part in self._parts.values()]
        template = typing.make_concrete_template(f"CallTemplate({name})", key=name, signatures=signatures)
        return template, pysig, args, {}

    def get_overload(self, sig: Any) -> Any:
        """Return the key under which the part of a signature is known to the compiler."""
        args, _ = sigutils.normalize_signature(sig)
        return self.part(tuple(args)).key

    @property
    def nopython_signatures(self) -> list:
        """Signatures that there is an entry or a part for."""
        return list(dict.fromkeys(found.signature for found in (*self.overloads.values(), *self._parts.values())))

    def part(self, args: tuple) -> Any:
        """Return the part for some types of arguments; compile or load it if needed."""
        with global_compiler_lock:
            found = self._parts.get(args)
            if found is None:
                with self._compiling_counter:
                    found = self._parts[args] = late_part(self) if self.late else self._part(args)
                self.targetctx.insert_user_function(found.key, found.fndesc, [found.library])
            return found

    def _part(self, args: tuple) -> Any:
        result = self.declared_types()[1] if self.declared is not None else None
        part = cache.load(self, "part", args, PartLibrary.rebuild)
        if part is None:
            with cache.compiling(self, "part", args) as slot:
                part = slot.load(PartLibrary.rebuild)
                if part is None:
                    compiled = self._compile(PartLibrary, args, result, slot.name)
                    part = PartLibrary.made(compiled, slot.file)
                    slot.keep(part)
                    slot.save(PartLibrary.reduce(part))
        return part

    def _text(self) -> Callable:
        """Return the function that numba is to compile: a straight one has its instructions ready."""
        fastmath = self.options.get("fastmath", ())
        if self.straight:
            with contextlib.suppress(OSError):
                # without its source numba takes the long way to the same instructions
                return straight_line(self.py_func, ("fast",) if fastmath is True else fastmath or ())
        return self.py_func

    def _compile(self, library: Any, args: tuple, result: Any, name: str) -> Any:
        flags = _Flags()
        self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
        library.customise(flags)
        code = library(self.targetctx.codegen(), self.py_func.__qualname__)
        code.enable_object_caching()
        pipeline = type("Pipeline", (_Pipeline,), {"name": name})
        compiled = compiler.compile_extra(
            self.typingctx, self.targetctx, self._text(), args, result, flags, {}, code, pipeline
        )
        if compiled.typing_error is not None:
            raise compiled.typing_error
        return compiled


_opening = threading.RLock()


class _Unasked(Kernel):
    """A kernel that nobody has asked for anything but what its digest is made of.

    Numba's part of a kernel takes 40 us to make, and a run of a pair of gears uses 28 kernels of 670. It is made when
    something else is asked of the kernel, which is an ordinary one from then on.

    Parameters
    ----------
    function, declared, options, late, straight
        As of `Kernel`.
    """

    KNOWN = frozenset(
        "__class__ __dict__ __module__ __name__ __qualname__ _normalised _opener declared declared_types late options "
        "py_func straight targetoptions".split()
    )
    """What is there without numba's part."""

    def __init__(
        self, function: Callable, declared: Any, options: dict[str, Any], late: bool = False, straight: bool = False
    ) -> None:
        self.__module__ = function.__module__
        self.__name__, self.__qualname__ = function.__name__, function.__qualname__
        self.py_func = function
        self.declared, self.options, self.late, self.straight = declared, options, late, straight
        self.targetoptions = _target_options(options)
        self._normalised = None
        self._opener = 0

    def __getattribute__(self, name: str) -> Any:
        if name in _Unasked.KNOWN or self._opener == threading.get_ident():
            return super().__getattribute__(name)
        return getattr(_opened(self), name)

    def __call__(self, *args: Any, **kws: Any) -> Any:
        return _opened(self)(*args, **kws)


def _opened(kernel: Kernel) -> Kernel:
    """Make numba's part of a kernel, unless another thread has; return the kernel."""
    with _opening:
        if type(kernel) is _Unasked:
            # its maker alone sees what is half made
            kernel._opener = threading.get_ident()
            Kernel.__init__(kernel, kernel.py_func, kernel.declared, kernel.options, kernel.late, kernel.straight)
            kernel.__class__ = Kernel
    return kernel


class _Flags(compiler.Flags):
    """Numba's flags, of the kernel alone, and compared in less time: it looks up its own functions by all of them."""

    __slots__ = ()

    def __hash__(self) -> int:
        return _HASH_OF_FLAGS

    def inherit_if_not_set(self, name: str, default: Any = None) -> None:
        """Take numba's own default for what a decorator leaves open, and not what is being compiled at the moment."""
        if default is not None and not self.is_set(name):
            setattr(self, name, default)

    def __eq__(self, other: object) -> bool:
        return (isinstance(other, _Flags) and self._values == other._values) or super().__eq__(other)

    def summary(self) -> str:
        """Return what symbols are named by, alike in all processes: flags of fastmath are a set, in no order."""
        args = [
            f"{key}=FastMathOptions({sorted(value.flags)})" if isinstance(value, FastMathOptions) else f"{key}={value}"
            for key, value in self._summary_args()
        ]
        return f"{type(self).__name__}({', '.join(args)})"


_HASH_OF_FLAGS = hash(compiler.Flags())


class _Pipeline(compiler.Compiler):
    """Numba's pipeline with indices counted from the start, and symbols named after the content, in every process."""

    name = ""

    def define_pipelines(self) -> list:
        """Return numba's passes with `CountedIndices` before the lowering, and `Lowering` as that."""
        (pipeline,) = super().define_pipelines()
        pipeline.add_pass_after(CountedIndices, NopythonTypeInference)
        pipeline.passes = [(Lowering if one is NativeLowering else one, told) for one, told in pipeline.passes]
        pipeline.finalize()
        return [pipeline]

    def compile_extra(self, func: Callable) -> Any:
        """Compile a function; as of numba, but for the name of its symbol."""
        identity = bytecode.FunctionIdentity.from_function(func)
        identity.unique_id = self.name
        identity.unique_name = f"{identity.func_qualname}${self.name}"
        self.state.func_id = identity
        ExtractByteCode().run_pass(self.state)
        self.state.lifted = ()
        self.state.lifted_from = None
        return self._compile_bytecode()
