"""Indices of arrays that count from the start: compiled code without the wrap-around of negative ones.

numba takes every signed index for one that may be negative and adds the length of the axis if it is. In kernels whose
indices come out of tables that is a comparison, a selection and an addition for each number that is read: as many
instructions as the arithmetic takes. Here an index is unsigned as soon as types are known, so that it is used as it is.
A negative literal still counts from the end; an index that is computed must not be negative.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import ir
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import get_definition, guard


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
