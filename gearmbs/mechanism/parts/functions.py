"""Functions of time that drive motions and torques."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearmbs.dae.equations.loads import time_functions as tf
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.quantities import any_quantity, expression_text, quantity
from gearmbs.units import QuantityLike

RATES = ("angular speed", "speed", "rad/s^2", "acceleration", "dimensionless")
"""Dimensions that the rate of a ramp may have."""

ROUNDING = 0.02
"""Share of a line that its corners take: no acceleration of an angle jumps, and a speed leaves the line by 0.6 %."""


@dataclass(frozen=True)
class TimeFunction:
    """A function of time in one of the closed forms of :mod:`gearmbs.dae.equations.loads.time_functions`.

    Make one with :func:`constant`, :func:`step`, :func:`ramp`, :func:`harmonic`, :func:`polynomial`, :func:`curve`,
    :func:`curve_integral`, :func:`polyline` or :func:`polyline_integral`.
    """

    kind: int
    parameters: tuple[float, ...]
    text: str

    def __post_init__(self) -> None:
        if not np.all(np.isfinite(self.parameters)):
            raise ModelError(f"function {self.text}: its parameters must be finite")

    def check_unit(self, unit: str, field: str) -> None:
        """Raise a ModelError if what it gives has another unit; most functions are of numbers, without one."""

    def integral(self, start: float, rate: float | None = None) -> TimeFunction:
        """Return start + int f, or with a rate start + rate t + int int f, from time 0.

        Expressions are tabulated over the first ten seconds; later times take longer to evaluate.
        """
        f = function_text(self, 1.0, 1.0)
        once = f"INTEGRAL({f}, 0, {SPAN!r})"
        if rate is None:
            return expression(f"({start!r}) + {once}")
        # the second integral of f is t int f - int t f
        twice = f"TIME*{once} - INTEGRAL(TIME*({f}), 0, {SPAN!r})"
        return expression(f"({start!r}) + ({rate!r})*TIME + {twice}")

    @property
    def is_expression(self) -> bool:
        """Whether the function is given by a text that is compiled with the mechanism."""
        return self.kind == tf.TAPE

    def __call__(self, t: float) -> float:
        """Return f(t)."""
        return tf.evaluate(self.kind, np.array(self.parameters), 0, float(t))[0]

    def derivatives(self, t: float) -> tuple[float, float, float]:
        """Return f, f' and f'' at t."""
        return tf.evaluate(self.kind, np.array(self.parameters), 0, float(t))

    def __repr__(self) -> str:
        return self.text


def constant(value: QuantityLike) -> TimeFunction:
    """Return the constant function."""
    value = any_quantity(value, "constant")
    return TimeFunction(tf.CONSTANT, (value,), f"{value:g}")


def step(t0: QuantityLike, f0: QuantityLike, t1: QuantityLike, f1: QuantityLike, quintic: bool = False) -> TimeFunction:
    """Return ADAMS's STEP (cubic) or STEP5 (quintic) from f0 before t0 to f1 after t1."""
    t0, t1 = quantity(t0, "time", "step: t0"), quantity(t1, "time", "step: t1")
    f0, f1 = any_quantity(f0, "step: f0"), any_quantity(f1, "step: f1")
    if not t1 > t0:
        raise ModelError(f"step: its end {t1} s must be later than its start {t0} s")
    name = "STEP5" if quintic else "STEP"
    kind = tf.STEP5 if quintic else tf.STEP
    return TimeFunction(kind, (t0, f0, t1, f1), f"{name}(TIME, {t0:g}, {f0:g}, {t1:g}, {f1:g})")


def ramp(
    rate: QuantityLike, over: QuantityLike = 0.0, start: QuantityLike = 0.0, quintic: bool = False
) -> TimeFunction:
    """Return the angle (or displacement) whose rate rises smoothly from 0 to ``rate`` during ``over`` seconds.

    The rate is STEP(TIME, 0, 0, over, rate), so the function is its integral, in closed form.
    """
    rate, over = any_quantity(rate, "ramp: rate", RATES), quantity(over, "time", "ramp: over")
    start = any_quantity(start, "ramp: start")
    if over < 0.0:
        raise ModelError(f"ramp: over = {over} s; the run-up time cannot be negative")
    if over == 0.0:
        return polynomial([start, rate])
    kind = tf.STEP5_INTEGRAL if quintic else tf.STEP_INTEGRAL
    text = f"integral of STEP{5 if quintic else ''}(TIME, 0, 0, {over:g}, {rate:g})"
    return TimeFunction(kind, (0.0, 0.0, over, rate, start), text)


def harmonic(
    amplitude: QuantityLike, omega: QuantityLike, phase: QuantityLike = 0.0, offset: QuantityLike = 0.0
) -> TimeFunction:
    """Return offset + amplitude sin(omega t + phase)."""
    amplitude, offset = any_quantity(amplitude, "harmonic: amplitude"), any_quantity(offset, "harmonic: offset")
    omega, phase = quantity(omega, "angular speed", "harmonic: omega"), quantity(phase, "angle", "harmonic: phase")
    parameters = (amplitude, omega, phase, offset)
    return TimeFunction(tf.HARMONIC, parameters, f"{offset:g} + {amplitude:g} SIN({omega:g} TIME + {phase:g})")


def polynomial(coefficients: list[float]) -> TimeFunction:
    """Return c0 + c1 t + c2 t^2 + ..."""
    if not len(coefficients):
        raise ModelError("polynomial: give at least one coefficient")
    text = " + ".join(f"{c:g} t^{k}" for k, c in enumerate(coefficients))
    return TimeFunction(tf.POLYNOMIAL, (len(coefficients) - 1, *map(float, coefficients)), text)


def curve(times: Sequence[float], values: Sequence[float]) -> TimeFunction:
    """Return the smooth curve through points: a monotone cubic, constant before the first and after the last of them.

    The slope is continuous and zero at both ends, so two points make a STEP. Between neighbouring points the curve
    stays between their values [1]_.

    Parameters
    ----------
    times : sequence of float, shape (n,)
        Increasing, s or texts with units.
    values : sequence of float, shape (n,)
        SI or texts with units.

    Raises
    ------
    ModelError
        For fewer than two points, times that do not increase, or values that are not finite.

    References
    ----------
    .. [1] Fritsch, F. N., Butland, J.: A method for constructing local monotone piecewise cubic interpolants. SIAM J.
       Sci. Stat. Comput. 5 (1984) 300-304.
    """
    t, pieces = _curve_pieces(times, values)
    return _piecewise(t, pieces, f"curve of {t.size} points from {t[0]:g} to {t[-1]:g} s")


def curve_integral(times: Sequence[float], values: Sequence[float], start: float = 0.0) -> TimeFunction:
    """Return the angle or displacement whose rate is the `curve` through points, in closed form.

    Parameters
    ----------
    times, values
        As of :func:`curve`; the values are rates.
    start : float or str
        Value at the first of the times.
    """
    t, rate = _curve_pieces(times, values)
    pieces = _integral(t, rate, any_quantity(start, "curve_integral: start"))
    return _piecewise(t, pieces, f"integral of the curve of {t.size} points from {t[0]:g} to {t[-1]:g} s")


def polyline(
    times: Sequence[float], values: Sequence[float], rounding: float = ROUNDING, soft_start: bool = False
) -> TimeFunction:
    """Return the straight lines through points, constant before the first and after the last of them.

    At a corner the slope changes evenly while ``rounding`` of the shorter line passes before and after it, which leaves
    the corner by a quarter of that time times the change of slope. Where a line begins or ends at rest it does so
    within twice ``rounding`` of its own time, by x (2 u - u^2), u = x/L, and is at most 4/27 L of its slope late: with
    the default 0.6 % of the change along the line. Everywhere else the function is exactly the line.

    Parameters
    ----------
    times, values
        As of :func:`curve`.
    rounding : float
        Share of a line, 0 to 0.25; 0 leaves the corners sharp.
    soft_start : bool
        Whether the first line is a STEP instead, as of a run-up from rest.

    Raises
    ------
    ModelError
        As of :func:`curve`, and for another rounding.
    """
    t, pieces, points = _line_pieces(times, values, rounding, soft_start)
    return _piecewise(t, pieces, f"lines through {points.size} points from {points[0]:g} to {points[-1]:g} s")


def polyline_integral(
    times: Sequence[float], values: Sequence[float], start: float = 0.0, rounding: float = ROUNDING,
    soft_start: bool = False,
) -> TimeFunction:  # fmt: skip
    """Return the angle or displacement whose rate is the `polyline` through points, in closed form.

    Parameters
    ----------
    times, values, rounding, soft_start
        As of :func:`polyline`; the values are rates.
    start : float or str
        Value at the first of the times.
    """
    t, rate, points = _line_pieces(times, values, rounding, soft_start)
    text = f"integral of lines through {points.size} points from {points[0]:g} to {points[-1]:g} s"
    return _piecewise(t, _integral(t, rate, any_quantity(start, "polyline_integral: start")), text)


def _line_pieces(
    times: Sequence[float], values: Sequence[float], rounding: float, soft_start: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where pieces begin, their coefficients as of `_curve_pieces`, and the times of the points."""
    if not 0.0 <= rounding <= 0.25:
        raise ModelError(f"polyline: rounding is {rounding}; give a share of a line from 0 to 0.25")
    points, f = _points(times, values)
    width = np.diff(points)
    slope = np.concatenate([[0.0], np.diff(f) / width, [0.0]])
    width = np.concatenate([[np.inf], width, [np.inf]])
    if soft_start:
        # the first line leaves and comes with slope zero
        slope[1] = 0.0
    found: list[tuple[float, float, float, float, float]] = [(points[0], f[0], 0.0, 0.0, 0.0)]
    for k in range(points.size):
        before, after = slope[k], slope[k + 1]
        t, value = float(points[k]), float(f[k])
        if k == 0 and soft_start:
            rise = f[1] - value
            found.append((t, value, 0.0, 3.0 * rise / width[1] ** 2, -2.0 * rise / width[1] ** 3))
            continue
        r = rounding * min(width[k], width[k + 1])
        if rounding == 0.0 or before == after:
            found.append((t, value, after, 0.0, 0.0))
        elif before == 0.0 or after == 0.0:
            long = 2.0 * rounding * (width[k + 1] if before == 0.0 else width[k])
            if before == 0.0:
                found += [(t, value, 0.0, 2.0 * after / long, -after / long**2),
                          (t + long, value + after * long, after, 0.0, 0.0)]  # fmt: skip
            else:
                # the same backwards: with y = long - x, value - before (2 y^2/long - y^3/long^2)
                found += [(t - long, value - before * long, before, before / long, -before / long**2),
                          (t, value, 0.0, 0.0, 0.0)]  # fmt: skip
        else:
            bend = (after - before) / (4.0 * r)
            found += [(t - r, value - before * r, before, bend, 0.0), (t + r, value + after * r, after, 0.0, 0.0)]
    table = np.array(found)
    pieces = np.column_stack([table[:, 1:], np.zeros(len(table))])
    return table[1:, 0], pieces, points


def _integral(t: np.ndarray, rate: np.ndarray, start: float) -> np.ndarray:
    """Return the coefficients of the integral of pieces, continuous, with a value at the first of the times."""
    pieces = np.zeros((t.size + 1, 5))
    pieces[:, 1:] = rate[:, :4] / np.arange(1, 5)
    pieces[0, 0] = pieces[1, 0] = start
    gain = np.diff(t) * np.polynomial.polynomial.polyval(np.diff(t), (rate[1:-1, :4] / np.arange(1, 5)).T, tensor=False)
    pieces[2:, 0] = pieces[1, 0] + np.cumsum(gain)
    return pieces


def _points(times: Sequence[float], values: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return times and values of points, refused where they do not make a curve."""
    t = np.array([quantity(time, "time", "curve: times") for time in times], dtype=float)
    f = np.array([any_quantity(value, "curve: values") for value in values], dtype=float)
    if t.size != f.size or t.size < 2:
        raise ModelError(f"curve: {t.size} times and {f.size} values; give two points or more, a value for each time")
    if not (np.all(np.isfinite(t)) and np.all(np.isfinite(f))):
        raise ModelError("curve: times and values must be finite")
    grows = np.diff(t) > 0.0
    if not np.all(grows):
        late = int(np.argmin(grows))
        raise ModelError(f"curve: its times must increase; {t[late + 1]:g} s follows {t[late]:g} s")
    return t, f


def _curve_pieces(times: Sequence[float], values: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the points' times and the coefficients of all pieces, those before and after them included, (n + 1, 5)."""
    t, f = _points(times, values)
    width = np.diff(t)
    secant = np.diff(f) / width
    slope = np.zeros(t.size)
    left, right = secant[:-1], secant[1:]
    same = left * right > 0.0
    a, b = 2.0 * width[1:] + width[:-1], width[1:] + 2.0 * width[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        slope[1:-1] = np.where(same, (a + b) / (a / left + b / right), 0.0)
    pieces = np.zeros((t.size + 1, 5))
    pieces[0, 0] = f[0]
    pieces[1:, 0] = f
    pieces[1:-1, 1] = slope[:-1]
    pieces[1:-1, 2] = (3.0 * secant - 2.0 * slope[:-1] - slope[1:]) / width
    pieces[1:-1, 3] = (slope[:-1] + slope[1:] - 2.0 * secant) / width**2
    return t, pieces


def _piecewise(t: np.ndarray, pieces: np.ndarray, text: str) -> TimeFunction:
    origins = np.concatenate([t[:1], t])
    table = np.column_stack([origins, pieces]).ravel()
    return TimeFunction(tf.PIECEWISE, (float(t.size + 1), *map(float, t), *map(float, table)), text)


def expression(text: str) -> TimeFunction:
    """Return a function of TIME in the ADAMS function language; it is read when the mechanism is compiled."""
    return TimeFunction(tf.TAPE, (), text)


def as_function(
    value: QuantityLike | TimeFunction, unit: str = "dimensionless", field: str = "function"
) -> TimeFunction:
    """Return ``value`` as a function of time.

    A number or a text with a unit becomes a constant, another text an expression of TIME.

    Raises
    ------
    ModelError
        If it is none of these.
    """
    if isinstance(value, TimeFunction):
        value.check_unit(unit, field)
        return value
    if isinstance(value, str):
        return expression(expression_text(value, unit, field))
    if callable(value):
        raise ModelError(
            f"{field}: a function of Python is not compiled as it is; give it a name, m.function('F', function), and "
            "the text 'F(TIME)', or give a number, an expression such as '0.1*SIN(5*TIME)', or one of step, ramp, "
            "harmonic, polynomial"
        )
    return constant(quantity(value, unit, field))


# Functions of time of a mechanism in ADAMS's function language.


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
