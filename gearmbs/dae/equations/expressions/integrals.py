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
from gearmbs.dae.equations.expressions.spline_value import spline_value
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
LEAST_PANELS, MOST_PANELS = 1 << 9, 1 << 15
"""With the least, no two of a panel's nodes are further apart than 1/2700 of the span: pulses of a thousandth of it are
seen."""
MOST_HALVINGS, MOST_ROUGH = 50, 4096
"""Halvings of a panel in which the function jumps: as many as a double has digits. And how many panels are halved at a
time: of a function that is rough everywhere nothing more is gained."""


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

    The panels are halved until the quadrature no longer changes, or until there are ``MOST_PANELS`` of them. Then those
    that change still are halved by themselves: the function jumps in them, or has a corner. One nearer to the end of a
    panel than its last node, 1/50 of it, is not seen there, and costs as much of its jump.
    """
    panels, previous = LEAST_PANELS, np.empty(0)
    while True:
        edges = np.linspace(start, end, panels + 1)
        sums = _sums(function, edges[:-1], edges[1:])
        allowed = TOLERANCE * max(1.0, float(np.abs(sums).sum()))
        # of each panel: the whole may be the same by chance
        change = np.abs(sums.reshape(-1, 2).sum(axis=1) - previous) if previous.size else np.inf
        if np.sum(change) <= allowed:
            break
        if panels >= MOST_PANELS:
            rough = np.repeat(change > allowed / panels, 2)
            sums[rough] = _halved(function, edges[:-1][rough], edges[1:][rough], sums[rough], allowed / panels)
            break
        panels, previous = 2 * panels, sums
    return np.concatenate([[panels, start, edges[1] - edges[0], 0.0], np.cumsum(sums)])


def _sums(function: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the integrals over panels from ``low`` to ``high`` by one quadrature each."""
    half = 0.5 * (high - low)
    nodes = (0.5 * (low + high))[:, None] + half[:, None] * _NODES
    return half * (function(nodes.ravel()).reshape(nodes.shape) @ _WEIGHTS)


def _halved(
    function: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray, sums: np.ndarray, allowed: float
) -> np.ndarray:
    """Return the integrals over panels, of which those that change by more than ``allowed`` are halved again."""
    found = sums.copy()
    owner = np.arange(len(low))
    for _ in range(MOST_HALVINGS):
        if not 0 < len(owner) <= MOST_ROUGH:
            break
        middle = 0.5 * (low + high)
        first, second = _sums(function, low, middle), _sums(function, middle, high)
        change = first + second - sums
        np.add.at(found, owner, change)
        rough = np.abs(change) > allowed
        low, high = np.concatenate([low[rough], middle[rough]]), np.concatenate([middle[rough], high[rough]])
        sums, owner = np.concatenate([first[rough], second[rough]]), np.tile(owner[rough], 2)
    return found
