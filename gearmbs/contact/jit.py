"""The one way this room compiles: cached, without Python's division checks, one version of each kernel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gearmbs._jit import njit


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function for use inside other kernels."""
    return njit(cache=True, error_model="numpy")(function)
