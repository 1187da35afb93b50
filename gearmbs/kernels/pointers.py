"""Calls through addresses: kernels compiled apart meet at run time.

Numba compiles everything a function calls into the function's own code. The kernels of force elements and of
expressions are large and are called from several of the equations' kernels, which would make each of them large too,
would recompile all of them when one changes, and would load them all for a mechanism that uses none. So the equations
call them through addresses that stand in the rows of the tables, put there when the tables are packed in this process.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from gearmbs.kernels.bound import (
    F8,
    FUNCTIONS_TYPE,
    I8,
    IMAT,
    IVEC,
    MAT,
    VEC,
    PythonCallback,
    named,
    no_events,
    no_hook,
)  # fmt: skip
from gearmbs.kernels.jit import Kernel
from gearmbs.kernels.kinds import deferred, numba_of

__all__ = [
    "F8",
    "FUNCTIONS_TYPE",
    "I8",
    "IMAT",
    "IVEC",
    "MAT",
    "VEC",
    "PythonCallback",
    "address",
    "call_address",
    "caller",
    "direct",
    "no_events",
    "no_hook",
]


def caller(signature: Any) -> Any:
    """Return what turns an address, in compiled code, into a function of ``signature`` that can be called."""
    return deferred("own.pointers", "caller", signature)


call_address = deferred("own.pointers", "call_address")
"""``call_address(address, t, y, yp, extra, out)``: call the C function ``void f(double t, double *y, double *yp, double
extra, double *out)``, a Python function behind a C function pointer."""


@cache
def address(dispatcher: Any, signature: Any) -> int:
    """Return the address of a compiled function in this process; the function is kept alive.

    Raises
    ------
    KeyError
        If it was not compiled for ``signature``.
    """
    if isinstance(dispatcher, Kernel):
        return named(dispatcher.entry().address, dispatcher)
    compiled = dispatcher.overloads[numba_of(signature).args]
    return named(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name), dispatcher)


# Calls of kernels from Python without a look at the types of their arguments.
#
# Numba finds out the types of what a kernel is called with each time; of a struct only Python can tell, in some
# microseconds. A kernel with a declared signature has one entry, and whoever knows the types can call that.


@cache
def direct(kernel: Any) -> Callable:
    """Return the entry of a kernel with a declared signature, compiled or loaded if needed.

    The caller answers for the types of the arguments.
    """
    # what is no kernel is a plain function, where numba is switched off
    call: Callable = kernel.entry().call if isinstance(kernel, Kernel) else kernel
    return call
