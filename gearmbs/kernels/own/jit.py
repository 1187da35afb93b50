"""Numba's part of a kernel: how it is compiled, and what stands for it where compiled code names it.

A `Dispatcher` differs from numba's in what `gearmbs.kernels.jit` tells of kernels. It is made when something is
compiled, or when a call's arguments do not fit, which numba tells best.
"""

from __future__ import annotations

import collections
import contextlib
from collections.abc import Callable
from typing import Any

import numba
from numba import types
from numba.core import bytecode, compiler, ir, sigutils, typing
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.cpu_options import FastMathOptions
from numba.core.ir_utils import get_definition, guard
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.typed_passes import NativeLowering, NopythonTypeInference
from numba.core.untyped_passes import ExtractByteCode

from gearmbs.kernels import cache
from gearmbs.kernels.ahead import compile_missing
from gearmbs.kernels.entries import Entry
from gearmbs.kernels.kinds import numba_of
from gearmbs.kernels.library import EntryLibrary, PartLibrary
from gearmbs.kernels.own.late import late_part
from gearmbs.kernels.own.references import Lowering
from gearmbs.kernels.own.straight import straight as straight_line

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


class _Overloads(collections.OrderedDict):
    """Compiled overloads by argument types; the declared one is compiled when it is asked for."""

    def __init__(self, dispatcher: Dispatcher) -> None:
        super().__init__()
        self.dispatcher = dispatcher

    def __missing__(self, args: tuple) -> Any:
        if self.dispatcher.declared is None or self.dispatcher.declared_types()[0] != tuple(args) or len(self):
            raise KeyError(args)
        self.dispatcher.ready()
        return self[args]


class Dispatcher(CPUDispatcher):
    """A dispatcher that compiles or loads what is called, when it is called.

    Parameters
    ----------
    kernel : gearmbs.kernels.jit.Kernel
        What it is the dispatcher of.
    """

    def __init__(self, kernel: Any) -> None:
        self.kernel = kernel
        self.declared, self.options = kernel.declared, kernel.options
        self.late, self.straight = kernel.late, kernel.straight
        self._normalised: tuple | None = None
        self._parts: dict[tuple, Any] = {}
        super().__init__(py_func=kernel.py_func, targetoptions=kernel.targetoptions)
        self.overloads = _Overloads(self)

    def declared_types(self) -> tuple[tuple, Any]:
        """Return the types of the declared signature: arguments and result."""
        if self._normalised is None:
            args, result = sigutils.normalize_signature(numba_of(self.declared))
            self._normalised = tuple(args), result
        return self._normalised

    def ready(self) -> Dispatcher:
        """Compile or load the entry of the declared signature, unless it is there."""
        if self._can_compile and self.declared is not None:
            with global_compiler_lock:
                if not len(self.overloads):
                    self.compile(self.declared)
                self.disable_compile()
        return self

    def entry(self) -> Entry:
        """Return the only entry, as numba has loaded it."""
        (found,) = self.ready().overloads.values()
        return Entry(found.entry_point, found.library.get_pointer_to_function(found.fndesc.llvm_func_name))

    # from Python

    def _compile_for_args(self, *args: Any, **kws: Any) -> Any:
        if self.declared is None:
            return super()._compile_for_args(*args, **kws)
        return self.ready()  # to be called anew, now that the signature is known

    def get_compile_result(self, sig: Any) -> Any:
        """Return the entry of a signature; compile it if needed."""
        return super(Dispatcher, self.ready()).get_compile_result(sig)

    def compile(self, sig: Any) -> Any:
        """Compile or load the entry of a signature; return the function for Python."""
        with global_compiler_lock, self._compiling_counter:
            args, result = sigutils.normalize_signature(numba_of(sig))
            args = tuple(args)
            if args in self.overloads:
                return collections.OrderedDict.__getitem__(self.overloads, args).entry_point
            if self.declared is not None:
                args, result = self.declared_types()
            entry = cache.load(self.kernel, "entry", args, EntryLibrary.rebuild)
            if entry is None and self.declared is not None and compile_missing(self.kernel):
                entry = cache.load(self.kernel, "entry", args, EntryLibrary.rebuild)
            if entry is None:
                with cache.compiling(self.kernel, "entry", args) as slot:
                    entry = slot.load(EntryLibrary.rebuild)
                    if entry is None:
                        entry = self.kernel._compile(EntryLibrary, args, result, slot.name)
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
        args, _ = sigutils.normalize_signature(numba_of(sig))
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
        part = cache.load(self.kernel, "part", args, PartLibrary.rebuild)
        if part is None:
            with cache.compiling(self.kernel, "part", args) as slot:
                part = slot.load(PartLibrary.rebuild)
                if part is None:
                    compiled = self.kernel._compile(PartLibrary, args, result, slot.name)
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

    def compiled(self, library: Any, args: tuple, result: Any, name: str) -> Any:
        """Return what numba's pipeline makes of the function, in a library of some kind."""
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


def type_of(made: Any) -> Any:
    """Return numba's type of an intrinsic, or kernel, that may have just been made."""
    context = cpu_target.typing_context
    # what is registered is known once that has been looked through
    context.refresh()
    return context.resolve_value_type(made)


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
