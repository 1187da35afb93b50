"""Integrals of functions of time inside a tape: the displacement of a motion given by its velocity.

A table holds the integral at equally spaced times; between them the operand is integrated from the
nearest earlier time by Gauss-Legendre quadrature, and beyond the table panel by panel.  The derivative
of the result is the operand itself, so positions, velocities and accelerations belong together.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.scalar import binary, unary
from gearmbs.dae.equations.expressions.splines import spline_value
from gearmbs.kernels.jit import njit
from gearmbs.kernels.pointers import call_address

# Functions of the user in a tape: calls of Python from compiled code.


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


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
TABLE_HEAD = 3
"""Number of panels, start, panel width; the integrals at the panels' ends follow."""
TOLERANCE = 1e-13
"""Change of an integral with twice as many panels, as part of its size, at which it is exact to rounding: each sum has
some hundreds of terms."""
MOST_PANELS = 1 << 15


@njit("float64(int64[::1], float64[::1], float64, int64, float64[::1])", cache=True, nogil=True, error_model="numpy")
def time_value(ints, floats, t, register, w):
    """Return a register of a tape at time t; what does not depend on time alone is NaN.

    Scratch of functions of the user is at the end of ``w``, as in the evaluators.
    """
    at = ints[op.HEAD_CODE]
    for k in range(register + 1):
        code = ints[at]
        if code == op.CONST:
            w[k] = floats[ints[at + 1]]
        elif code == op.TIME:
            w[k] = t
        elif code <= op.LAST_LEAF or code == op.UNWRAP or code == op.INTEGRAL:
            w[k] = np.nan
        elif code <= op.LAST_UNARY:
            w[k] = unary(code, w[ints[at + 1]], float(ints[at + 2]))[0]
        elif code == op.SPLINE:
            w[k] = spline_value(floats, ints[at + 3], ints[at + 4], w[ints[at + 1]], w[ints[at + 2]])[0]
        elif code <= op.LAST_BINARY:
            w[k] = binary(code, w[ints[at + 1]], w[ints[at + 2]])[0]
        elif code == op.EXTERNAL:
            known = True
            for i in range(ints[at + 2]):
                known = known and not np.isnan(w[ints[ints[at + 1] + i]])
            w[k] = external(ints, at, t, 0, w) if known else np.nan
        else:
            c = w[ints[at + 1]]
            w[k] = w[ints[at + 2]] if c < 0.0 else (w[ints[at + 4]] if c > 0.0 else w[ints[at + 3]])
        at += op.WIDTH
    return w[register]


@njit(
    "float64(int64[::1], float64[::1], float64, float64, int64, float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _panel(ints, floats, low, high, register, w):
    """Return the integral of a register over one panel."""
    half, middle = 0.5 * (high - low), 0.5 * (high + low)
    total = 0.0
    for q in range(_NODES.size):
        total += _WEIGHTS[q] * time_value(ints, floats, middle + half * _NODES[q], register, w)
    return half * total


@njit(
    "float64(int64[::1], float64[::1], float64, int64, int64, float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def integral(ints, floats, t, register, table, w):
    """Return the integral of a register from the table's start to t."""
    n, start, width = int(floats[table]), floats[table + 1], floats[table + 2]
    if not np.isfinite(t):
        return np.nan
    k = int(min(max(np.floor((t - start) / width), 0.0), float(n)))
    total = floats[table + TABLE_HEAD + k]
    low = start + k * width
    panels = max(1, int(np.ceil(abs(t - low) / width - 1e-9)))
    for p in range(panels):
        total += _panel(ints, floats, low + (t - low) * p / panels, low + (t - low) * (p + 1) / panels, register, w)
    return total


def integral_table(function: Callable[[np.ndarray], np.ndarray], start: float, end: float) -> np.ndarray:
    """Return the table of the integral of a function from ``start`` to ``end``.

    The panels are halved until the quadrature no longer changes, or until there are ``MOST_PANELS`` of them (at
    jumps of the function).
    """
    panels, previous = 64, np.inf
    while True:
        edges = np.linspace(start, end, panels + 1)
        half = 0.5 * (edges[1] - edges[0])
        nodes = (0.5 * (edges[1:] + edges[:-1]))[:, None] + half * _NODES
        sums = half * function(nodes.ravel()).reshape(panels, -1) @ _WEIGHTS
        total = np.concatenate([[0.0], np.cumsum(sums)])
        change = abs(total[-1] - previous)
        if change <= TOLERANCE * max(1.0, float(np.abs(total).max())) or panels >= MOST_PANELS:
            return np.concatenate([[panels, start, edges[1] - edges[0]], total])
        panels, previous = 2 * panels, total[-1]
