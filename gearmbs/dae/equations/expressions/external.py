"""Functions of the user in a tape: calls of Python from compiled code."""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.dae.compiled.python_callback import call_address
from gearmbs.dae.equations.expressions import opcodes as op


@njit("float64(int64[::1], int64, float64, int64, float64[::1])", cache=True, nogil=True)
def external(ints, at, t, order, work):
    """Call a function of the user with its arguments; value and derivatives stay in its scratch at the end of work."""
    count = ints[at + 2]
    begin = work.size - ints[op.HEAD_EXTERNAL] + ints[at + 3]
    given, found = work[begin : begin + count], work[begin + count :]
    for i in range(count):
        given[i] = work[ints[ints[at + 1] + i]]
    call_address(ints[at + 4], t, given, given, float(order), found)
    return found[0]
