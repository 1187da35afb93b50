"""The one way kernels of this package are compiled: cached, without Python's division checks, one version each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gearmbs._jit import njit


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function for use inside other kernels."""
    return njit(cache=True, error_model="numpy")(function)
