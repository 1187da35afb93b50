"""Functions of time that drive motions and torques."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearmbs.dae.equations import time_functions as tf
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.quantities import any_quantity, expression_text, quantity

RATES = ("angular speed", "speed", "rad/s^2", "acceleration", "dimensionless")
"""What the rate of a ramp may be."""


@dataclass(frozen=True)
class TimeFunction:
    """A function of time in one of the closed forms of :mod:`gearmbs.dae.equations.time_functions`.

    Make one with :func:`constant`, :func:`step`, :func:`ramp`, :func:`harmonic`, :func:`polynomial`, :func:`curve` or
    :func:`curve_integral`.
    """

    kind: int
    parameters: tuple[float, ...]
    text: str

    def __post_init__(self) -> None:
        if not np.all(np.isfinite(self.parameters)):
            raise ModelError(f"function {self.text}: its parameters must be finite")

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


def constant(value: float) -> TimeFunction:
    """Return the constant function."""
    value = any_quantity(value, "constant")
    return TimeFunction(tf.CONSTANT, (value,), f"{value:g}")


def step(t0: float, f0: float, t1: float, f1: float, quintic: bool = False) -> TimeFunction:
    """Return ADAMS's STEP (cubic) or STEP5 (quintic) from f0 before t0 to f1 after t1."""
    t0, t1 = quantity(t0, "time", "step: t0"), quantity(t1, "time", "step: t1")
    f0, f1 = any_quantity(f0, "step: f0"), any_quantity(f1, "step: f1")
    if not t1 > t0:
        raise ModelError(f"step: its end {t1} s must be later than its start {t0} s")
    name = "STEP5" if quintic else "STEP"
    kind = tf.STEP5 if quintic else tf.STEP
    return TimeFunction(kind, (t0, f0, t1, f1), f"{name}(TIME, {t0:g}, {f0:g}, {t1:g}, {f1:g})")


def ramp(rate: float, over: float = 0.0, start: float = 0.0, quintic: bool = False) -> TimeFunction:
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


def harmonic(amplitude: float, omega: float, phase: float = 0.0, offset: float = 0.0) -> TimeFunction:
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
    pieces = np.zeros((t.size + 1, 5))
    pieces[:, 1:] = rate[:, :4] / np.arange(1, 5)
    pieces[0, 0] = pieces[1, 0] = any_quantity(start, "curve_integral: start")
    gain = np.diff(t) * np.polynomial.polynomial.polyval(np.diff(t), (rate[1:-1, :4] / np.arange(1, 5)).T, tensor=False)
    pieces[2:, 0] = pieces[1, 0] + np.cumsum(gain)
    return _piecewise(t, pieces, f"integral of the curve of {t.size} points from {t[0]:g} to {t[-1]:g} s")


def _curve_pieces(times: Sequence[float], values: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the points' times and the coefficients of all pieces, those before and after them included, (n + 1, 5)."""
    t = np.array([quantity(time, "time", "curve: times") for time in times], dtype=float)
    f = np.array([any_quantity(value, "curve: values") for value in values], dtype=float)
    if t.size != f.size or t.size < 2:
        raise ModelError(f"curve: {t.size} times and {f.size} values; give two points or more, a value for each time")
    if not (np.all(np.isfinite(t)) and np.all(np.isfinite(f))):
        raise ModelError("curve: times and values must be finite")
    width = np.diff(t)
    if not np.all(width > 0.0):
        late = int(np.argmin(width > 0.0))
        raise ModelError(f"curve: its times must increase; {t[late + 1]:g} s follows {t[late]:g} s")
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
    value: float | str | TimeFunction, unit: str = "dimensionless", field: str = "function"
) -> TimeFunction:
    """Return ``value`` as a function of time.

    A number or a text with a unit becomes a constant, another text an expression of TIME.

    Raises
    ------
    ModelError
        If it is none of these.
    """
    if isinstance(value, TimeFunction):
        return value
    if isinstance(value, str):
        return expression(expression_text(value, unit, field))
    if callable(value):
        raise ModelError(
            f"{field}: a function of Python cannot be compiled; give a number, an expression such as '0.1*SIN(5*TIME)' "
            "or one of step, ramp, harmonic, polynomial"
        )
    return constant(quantity(value, unit, field))
