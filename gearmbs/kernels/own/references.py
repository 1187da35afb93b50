"""References of arrays: counted for what a kernel makes, and for nothing else.

numba counts the references of each array by each of its names: a call of a function that nothing is moved across, on
entry and on exit, in each kernel that is inlined. But whoever calls a kernel keeps what it hands over until it
returns, so that an argument may be seen as `gearmbs.kernels.views` see a part of one: by a pointer to its counts that
is null. Numba's counting of such an array is no counting, and LLVM leaves it out; and where nothing in a kernel is
made or handed back by what may have made it, no counting is written. What a kernel returns of its arguments stays
counted: its caller may have made it, and may keep the result alone. So do all arrays of a kernel with a list, or
whatever else arrays are put into. Nothing of this is said by a decorator, so that no kernel can be called by one that
disagrees.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils, errors, ir, lowering
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering
from numba.extending import _Intrinsic

_MADE, _HANDED = "made", "handed"
"""Where an array that is counted may come from: a kernel or what it calls, or its arguments. Views are of neither."""

UNKNOWN = frozenset((_MADE, _HANDED))
"""Origins of what is returned by a kernel that nothing is known of."""

_PASSING = frozenset("build_tuple cast exhaust_iter getattr getiter iternext pair_first phi typed_getitem".split())
"""Operations whose result is, or is part of, what they are given: numba counts them for its sake."""

_FOLLOWED = (types.Array, types.IteratorType, types.UnicodeType)
"""Types of values that hold what they were made of and no more: into a list, say, arrays may come later."""

_PLACES = (types.Integer, types.SliceType, types.EllipsisType, types.NoneType)
"""Types of indices that see a part of an array; others make a copy."""


class Origins:
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
        # what is put into something is assigned to nothing
        followed = all(self._followed(self._typemap[s.target.name]) for s in assigned)
        if not followed or state.func_ir.is_generator:
            self.returned, self.makes = UNKNOWN, True
            return
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

    def _followed(self, kind: Any) -> bool:
        """Return whether it is known for good what a value of a type was made of."""
        if isinstance(kind, types.BaseTuple):
            return all(self._followed(part) for part in kind.types if self._models[part].contains_nrt_meminfo())
        if isinstance(kind, types.Optional):
            return self._followed(kind.type)
        return isinstance(kind, _FOLLOWED) and not isinstance(kind, types.Generator)

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
            inside = callee.typing_key._defn.__module__.startswith("gearmbs.kernels.")
            return frozenset() if inside else found | {_MADE}
        kernel: Any = callee.dispatcher if isinstance(callee, types.Dispatcher) else None
        # numba's own dispatchers have no parts
        if hasattr(kernel, "part"):
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
        origins = state.metadata["origins"] = Origins(state)
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
