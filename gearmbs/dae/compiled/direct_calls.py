"""Calls of kernels from Python without a look at the types of their arguments.

Numba finds out the types of what a kernel is called with each time; of a struct only Python can tell, in some
microseconds. A kernel with a declared signature has one entry, and whoever knows the types can call that.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any


@cache
def direct(kernel: Any) -> Callable:
    """Return the entry of a kernel with a declared signature, compiled or loaded if needed.

    The caller answers for the types of the arguments.
    """
    if not hasattr(kernel, "ready"):
        # numba is switched off
        return kernel
    (entry,) = kernel.ready().overloads.values()
    return entry.entry_point
