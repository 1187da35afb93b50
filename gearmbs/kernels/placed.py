"""Structs that compiled code finds by their addresses.

Handing a struct over takes numba some 0.2 us: it asks the object for its address by name. A number takes a tenth of
that, so a kernel that is called at each communication point is handed the address of one struct that knows all others.
Public parts of numba alone, so that both modes have it. What numba counts, as the functions of a DAE, goes by the
address of what is counted.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import intrinsic


def struct_at(kind: Any) -> Any:
    """Return an intrinsic that sees what stands at an address as a struct of a kind; its owner has to outlive that."""

    @intrinsic
    def at(typingctx, address):
        def codegen(context, builder, signature, args):
            return builder.inttoptr(args[0], context.get_value_type(kind))

        return kind(types.int64), codegen

    return at


def counted_at(kind: Any) -> Any:
    """Return an intrinsic that sees what is counted at an address as a structref; its owner has to outlive that."""

    @intrinsic
    def at(typingctx, address):
        def codegen(context, builder, signature, args):
            value = context.make_helper(builder, kind)
            value.meminfo = builder.inttoptr(args[0], value.meminfo.type)
            found = value._getvalue()
            context.nrt.incref(builder, kind, found)
            return found

        return kind(types.int64), codegen

    return at


@intrinsic
def place_of(typingctx, counted):
    """Return the address at which a structref is counted."""

    def codegen(context, builder, signature, args):
        value = context.make_helper(builder, signature.args[0], value=args[0])
        return builder.ptrtoint(value.meminfo, context.get_value_type(types.int64))

    return types.int64(counted), codegen
