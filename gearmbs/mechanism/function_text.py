"""Functions of time of a mechanism in ADAMS's function language."""

from __future__ import annotations

import math

from gearmbs.dae.equations import time_functions as tf
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.functions import TimeFunction, expression

SPAN = 10.0
"""Seconds over which the integral of a motion's rate is tabulated beforehand."""


def function_text(function: TimeFunction, time: float, value: float) -> str:
    """Return a function of time as an expression.

    Parameters
    ----------
    function : TimeFunction
        Of seconds, with SI values.
    time, value : float
        SI values of the units of time and of the function's value the text is for.

    Raises
    ------
    ModelError
        For a kind without such an expression.
    """
    if function.is_expression:
        # already written in the units of its mechanism; its value is SI
        return function.text if value == 1.0 else f"({function.text})/{value!r}"
    p = function.parameters
    if function.kind == tf.CONSTANT:
        return repr(p[0] / value)
    if function.kind in (tf.STEP, tf.STEP5):
        name = "STEP5" if function.kind == tf.STEP5 else "STEP"
        return f"{name}(TIME, {p[0] / time!r}, {p[1] / value!r}, {p[2] / time!r}, {p[3] / value!r})"
    if function.kind == tf.HARMONIC:
        amplitude, omega, phase, offset = p
        return f"{offset / value!r} + ({amplitude / value!r})*SIN({omega * time!r}*TIME + ({phase!r}))"
    if function.kind == tf.POLYNOMIAL:
        coefficients = [c * time**k / value for k, c in enumerate(p[1:])]
        return f"POLY(TIME, 0, {', '.join(repr(c) for c in coefficients)})"
    if function.kind in (tf.STEP_INTEGRAL, tf.STEP5_INTEGRAL):
        return _step_integral(function, time, value)
    if function.kind == tf.PIECEWISE:
        return _pieces(function, time, value)
    raise ModelError(f"function {function.text}: it has no form in ADAMS's function language")


def _pieces(function: TimeFunction, time: float, value: float) -> str:
    """Nested IFs about the middle one of the times between pieces, so that few of them enclose each polynomial."""
    p = function.parameters
    count = int(p[0])
    borders, table = p[1:count], p[count:]

    def text(low: int, high: int) -> str:
        if low == high:
            origin, *coefficients = table[tf.PIECE_SIZE * low : tf.PIECE_SIZE * (low + 1)]
            while len(coefficients) > 1 and coefficients[-1] == 0.0:
                coefficients.pop()
            scaled = ", ".join(repr(c * time**k / value) for k, c in enumerate(coefficients))
            return f"POLY(TIME, {origin / time!r}, {scaled})"
        middle = (low + high) // 2
        after = text(middle + 1, high)
        return f"IF(TIME - ({borders[middle] / time!r}): {text(low, middle)}, {after}, {after})"

    return text(0, count - 1)


def _step_integral(function: TimeFunction, time: float, value: float) -> str:
    """The integral of STEP or STEP5: in u = (t - t0)/w, clipped to 0..1, a polynomial, beyond it u - 1/2."""
    t0, f0, t1, f1, start = function.parameters
    width = t1 - t0
    if not math.isfinite(width) or width <= 0.0:
        raise ModelError(f"function {function.text}: its end must be later than its start")
    x = f"((TIME - ({t0 / time!r}))/{width / time!r})"
    u = f"MAX(0, MIN({x}, 1))"
    if function.kind == tf.STEP5_INTEGRAL:
        inside = f"{u}**4*(2.5 - 3*{u} + {u}**2)"
    else:
        inside = f"{u}**3*(1 - 0.5*{u})"
    rise = (f1 - f0) * width / value
    slope = f0 * time / value
    return (
        f"{start / value!r} + ({slope!r})*(TIME - ({t0 / time!r})) + "
        f"({rise!r})*({inside} + MAX(0, {x} - 1))"
    )  # fmt: skip


def integrated(function: TimeFunction, start: float, rate: float | None = None) -> TimeFunction:
    """Return start + int f, or with a rate start + rate t + int int f, from time 0.

    Expressions are tabulated over the first ten seconds; later times take longer to evaluate.
    """
    f = function_text(function, 1.0, 1.0)
    once = f"INTEGRAL({f}, 0, {SPAN!r})"
    if rate is None:
        return expression(f"({start!r}) + {once}")
    # the second integral of f is t int f - int t f
    twice = f"TIME*{once} - INTEGRAL(TIME*({f}), 0, {SPAN!r})"
    return expression(f"({start!r}) + ({rate!r})*TIME + {twice}")
