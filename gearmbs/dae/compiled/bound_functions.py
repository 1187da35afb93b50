"""The four functions of a DAE bound together, so that handing them to compiled code costs next to nothing.

Handing a compiled function to another as a typed pointer looks its address up anew each time, tens of microseconds
in Python. A short run is over in less; so the addresses are looked up once for each problem.
"""

from __future__ import annotations

from functools import lru_cache

from numba import types
from numba.experimental import structref

from gearmbs._jit import njit
from gearmbs.dae.problem import EVENTS_SIG, HOOK_SIG, JACOBIAN_SIG, RESIDUAL_SIG

BOUND = 64
"""Sets of functions kept bound."""


@structref.register
class FunctionsType(types.StructRef):
    """Numba's type of `Functions`."""


class Functions(structref.StructRefProxy):
    """Residual, Jacobian, hook and events, with the signatures of `gearmbs.dae.problem`."""

    def __new__(cls, residual, jacobian, hook, events):
        """Return the bound functions."""
        return structref.StructRefProxy.__new__(cls, residual, jacobian, hook, events)


FIELDS = {
    "residual": types.FunctionType(RESIDUAL_SIG),
    "jacobian": types.FunctionType(JACOBIAN_SIG),
    "hook": types.FunctionType(HOOK_SIG),
    "events": types.FunctionType(EVENTS_SIG),
}
structref.define_proxy(Functions, FunctionsType, list(FIELDS))
FUNCTIONS_TYPE = FunctionsType(list(FIELDS.items()))


@njit(FUNCTIONS_TYPE(*FIELDS.values()), cache=True)
def _bind(residual, jacobian, hook, events):
    return Functions(residual, jacobian, hook, events)


@lru_cache(maxsize=BOUND)
def bind(residual, jacobian, hook, events):
    """Return the four compiled functions bound together, the same object for the same functions."""
    return _bind(residual, jacobian, hook, events)


@njit(HOOK_SIG, cache=True, nogil=True, error_model="numpy")
def no_hook(t, hist, npast, idata, rdata, work):
    """Stand in for a problem without a hook."""
    return 0


@njit(EVENTS_SIG, cache=True, nogil=True, error_model="numpy")
def no_events(t, y, yp, out, idata, rdata, work):
    """Stand in for a problem without events."""
