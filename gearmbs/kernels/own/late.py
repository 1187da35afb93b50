"""Kernels that compiled code finds when it first calls them: what most models never need is not compiled for them.

A caller of a late kernel holds, instead of its code, a few instructions that look for its address and remember it.
The first call enters Python, which compiles or loads the kernel as an entry of its own. So a caller neither waits for
the compilation of late kernels nor grows by them; a call takes some nanoseconds more than that of a part.
"""

from __future__ import annotations

import ctypes
from types import SimpleNamespace
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import funcdesc, typing

from gearmbs.kernels.entries import FINDER, find_late

_POINTER = ir.IntType(8).as_pointer()


class _Code:
    """LLVM code that calls a late kernel, to be linked into its callers as numba's own functions are."""

    def __init__(self, module: Any) -> None:
        self._module = module
        self._reload_init: set = set()

    def _ensure_finalized(self) -> None:
        """Do nothing: it is."""

    def _get_module_for_linking(self) -> Any:
        return self._module


def late_part(kernel: Any) -> SimpleNamespace:
    """Return what callers of a late kernel are compiled with, in the place of its part."""
    args, result = kernel.declared_types()
    context = kernel.targetctx
    name = f"{kernel.__module__}.{kernel.py_func.__qualname__}"
    symbol = funcdesc.default_mangler(f"{name}.late", args)
    described = funcdesc.ExternalFunctionDescriptor(symbol, result, args)
    module = context.codegen()._create_empty_module(symbol)
    _call(module, context, described, f"{kernel.__module__}:{kernel.__name__}")
    code = llvm.parse_assembly(str(module))
    code.verify()
    return SimpleNamespace(
        key=object(), library=_Code(code), fndesc=described, signature=typing.signature(result, *args)
    )


def _call(module: ir.Module, context: Any, described: Any, address: str) -> None:
    """Write a function that calls a late kernel with its own arguments, and finds it first."""
    kind = context.call_conv.get_function_type(described.restype, described.argtypes)
    function = ir.Function(module, kind, described.mangled_name)
    function.linkage = "linkonce_odr"
    slot = ir.GlobalVariable(module, _POINTER, f"{described.mangled_name}.slot")
    slot.linkage, slot.initializer = "internal", ir.Constant(_POINTER, None)
    text = bytearray(address.encode() + b"\0")
    told = ir.GlobalVariable(module, ir.ArrayType(ir.IntType(8), len(text)), f"{described.mangled_name}.name")
    told.linkage, told.global_constant = "internal", True
    told.initializer = ir.Constant(told.value_type, text)
    finder = ir.Function(module, ir.FunctionType(_POINTER, (_POINTER.as_pointer(), _POINTER)), FINDER)

    builder = ir.IRBuilder(function.append_basic_block("entry"))
    known = builder.load(slot)
    first = builder.icmp_unsigned("==", known, ir.Constant(_POINTER, None))
    with builder.if_then(first, likely=False):
        sought = builder.call(finder, (slot, builder.bitcast(told, _POINTER)))
        with builder.if_then(builder.icmp_unsigned("==", sought, ir.Constant(_POINTER, None)), likely=False):
            message = f"{address} could not be compiled; what went wrong was printed"
            context.call_conv.return_user_exc(builder, RuntimeError, (message,))
    found = builder.bitcast(builder.load(slot), kind.as_pointer())
    builder.ret(builder.call(found, function.args, tail=True))


llvm.add_symbol(FINDER, ctypes.cast(find_late, ctypes.c_void_p).value)
