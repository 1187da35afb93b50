"""Structs that compiled code finds by their addresses.

Handing a struct over takes numba some 0.2 us: it asks the object for its address by name. A number takes a tenth of
that, so a kernel that is called at each communication point is handed the address of one struct that knows all others.
Public parts of numba alone, so that both modes have it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

from gearmbs.dae.problem import EVENTS_SIG, HOOK_SIG, JACOBIAN_SIG, RESIDUAL_SIG
from gearmbs.kernels.bound import SIGNATURES, Functions
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import deferred, numba_of
from gearmbs.kernels.pointers import address, caller


def struct_at(kind: Any) -> Any:
    """Return an intrinsic that sees what stands at an address as a struct of a kind; its owner has to outlive that."""
    return deferred("placed", seen_at.__name__, kind)


def seen_at(kind: Any) -> Any:
    """Make the intrinsic of `struct_at`."""
    from numba import types
    from numba.extending import intrinsic

    kind = numba_of(kind)

    @intrinsic
    def at(typingctx, address):
        def codegen(context, builder, signature, args):
            return builder.inttoptr(args[0], context.get_value_type(kind))

        return kind(types.int64), codegen

    return at


BOUND = 64
"""Sets of functions kept bound."""


class FourFunctions(NamedTuple):
    """The functions themselves."""

    residual: Any
    jacobian: Any
    hook: Any
    events: Any


_residual_at, _jacobian_at = caller(RESIDUAL_SIG), caller(JACOBIAN_SIG)
_hook_at, _events_at = caller(HOOK_SIG), caller(EVENTS_SIG)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def unbound(functions):
    """Return the four functions of `Functions`; what has compiled them must outlive them."""
    return FourFunctions(
        _residual_at(functions.residual),
        _jacobian_at(functions.jacobian),
        _hook_at(functions.hook),
        _events_at(functions.events),
    )


@lru_cache(maxsize=BOUND)
def bind(residual, jacobian, hook, events):
    """Return the four compiled functions bound together, the same object for the same functions."""
    given = {"residual": residual, "jacobian": jacobian, "hook": hook, "events": events}
    return Functions(**{name: address(function, SIGNATURES[name]) for name, function in given.items()})
