"""The one way this room compiles: cached, without Python's division checks, one version of each kernel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit, types

import gearmbs._announce  # noqa: F401


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function for use inside other kernels.

    Numba would compile it anew for each literal integer it is called with; here literals arrive as plain int64.
    """
    dispatcher: Any = njit(cache=True, error_model="numpy")(function)
    resolve = dispatcher.get_call_template

    def resolve_plain(args: tuple, kws: dict) -> Any:
        return resolve(tuple(types.unliteral(a) for a in args), {k: types.unliteral(v) for k, v in kws.items()})

    dispatcher.get_call_template = resolve_plain
    return dispatcher
