"""Former names that still work for a while and say what to write instead."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import Any


def former_name(old: str, method: Callable[..., Any], remedy: str) -> Callable[..., Any]:
    """Return a method that warns and calls the one that took its place.

    Parameters
    ----------
    old : str
        The former name.
    method : callable
        The method of today.
    remedy : str
        What to write instead, after "is deprecated: ".
    """

    @functools.wraps(method)
    def call(self: Any, *args: Any, **kwargs: Any) -> Any:
        warnings.warn(f"{type(self).__name__}.{old} is deprecated: {remedy}", DeprecationWarning, stacklevel=2)
        return method(self, *args, **kwargs)

    call.__name__, call.__doc__ = old, f"Deprecated: {remedy}."
    return call
