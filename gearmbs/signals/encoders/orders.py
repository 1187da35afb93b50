"""Two shafts over one angle: from numbered pulses to lines at orders, turn by turn for their scatter.

The common angle phi is that of the first shaft, smoothed over one turn of it: the mean time of the pulses of a turn
knows nothing of the marks. Each encoder gives, at its own pulses, how far its shaft is ahead of phi,

    d(phi_n) = s (2 pi n/L - zero) - phi(t_n),     s = 1 for the first shaft, omega_1/omega_2 for the second,

and lines are sums over the pulses where they came, with their distances as weights: nothing is interpolated between
marks, so that an order just below half the lines is as right as a low one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import scipy.interpolate

from gearmbs.signals.encoders.pulses import TURN, PulseTrain
from gearmbs.signals.errors import SignalError

SAMPLED_TURN = 32
"""Points of a turn at which the smooth angle is taken: it has nothing above a few orders."""
SMOOTHINGS = 2
"""Courses of means over a turn, the second upon the first; each takes half a turn at either end."""
FEWEST_TURNS = 4
"""Turns of the slower shaft within the smooth angle: a window of as many parts orders that lie one apart."""
BRIDGINGS = 3
"""Times that missing pulses are bridged: each leaves the part of the error that one pulse has in the known lines."""
APART = 1.99
"""Lines of the Hann window's spectrum from which two orders do not see each other."""
HANN_NOISE = 1.5
"""Variance of a line with the Hann window by that without any, for noise."""
WHOLE = 1e-9
"""Difference from a whole number up to which an order is one: of ratios written as decimals."""


class Gearing(NamedTuple):
    """How two shafts turn: omega_1/omega_2, and the mesh order by turns of the first."""

    ratio: Fraction
    mesh: Fraction

    def on_second(self, order: Fraction) -> Fraction:
        """Return an order of the first shaft as one of the second."""
        return order * self.ratio


class Course(NamedTuple):
    """The common angle, rad, over time, and where it is known (s)."""

    angle: scipy.interpolate.CubicSpline
    begin: float
    end: float


def smooth_angle(train: PulseTrain) -> Course:
    """Return the angle of a shaft without anything that recurs with its turn: means over one turn at a time.

    The mean time of the marks of a turn belongs to their mean angle where the speed is constant; where it changes by
    a, it is off by pi^2 a/(6 omega^2). The mean distance of the marks from the first course makes up for that.
    """
    numbers, times, _ = train.every()
    angle = TURN / train.lines * numbers
    mean, middle = _turn_means(train.lines, times), _turn_means(train.lines, angle)
    for _ in range(SMOOTHINGS):
        if mean.size < SAMPLED_TURN // 4:
            raise SignalError(
                f"times: {train.name!r} covers {train.turns:.3g} turns, of which the smooth angle takes two; record "
                "longer"
            )
        course = Course(scipy.interpolate.CubicSpline(mean, middle), float(mean[0]), float(mean[-1]))
        inside = (times >= course.begin) & (times <= course.end)
        times, angle = times[inside], angle[inside]
        mean = _turn_means(train.lines, times)
        middle = course.angle(mean) + _turn_means(train.lines, angle - course.angle(times))
    return course


def _turn_means(count: int, values: np.ndarray) -> np.ndarray:
    """Return means over `count` values, `SAMPLED_TURN` times a turn."""
    sums = np.concatenate(([0.0], np.cumsum(values - values[0])))
    first = np.arange(0, values.size - count + 1, max(1, count // SAMPLED_TURN))
    return values[0] + (sums[first + count] - sums[first]) / count


@dataclass(frozen=True, eq=False)
class Deviations:
    """What the pulses of one encoder say within a window of whole turns.

    Attributes
    ----------
    phi : ndarray of shape (n,)
        Common angle at its pulses, rad.
    values : ndarray of shape (n,)
        How far its shaft is ahead of it there, as an angle of the first shaft, rad, the mean removed.
    mean : float
        The mean, rad.
    spacing : ndarray of shape (n,)
        Part of the angle that each pulse stands for, rad.
    numbers : ndarray of int, shape (n,)
    there : ndarray of bool, shape (n,)
        Whether the pulse was measured.
    """

    phi: np.ndarray
    values: np.ndarray
    mean: float
    spacing: np.ndarray
    numbers: np.ndarray
    there: np.ndarray

    def window(self, begin: float, turns: float) -> np.ndarray:
        """Return the weights of the pulses, normalised so that the sum with a line's exponential is its amplitude."""
        part = (self.phi - begin) / (TURN * turns)
        weights = self.spacing * np.where((part >= 0.0) & (part < 1.0), 1.0 - np.cos(TURN * part), 0.0)
        return 2.0 / weights.sum() * weights


def deviations(
    train: PulseTrain,
    course: Course,
    begin: float,
    end: float,
    scale: float,
    known: Sequence[float] = (),
    errors: np.ndarray | None = None,
) -> Deviations:
    """Return how far a shaft is ahead of the common angle at its pulses, whose marks have errors (rad) or none.

    Pulses that are missing are bridged: by a straight line through what is left when the lines at the `known` orders of
    the common angle are taken out, which a line of pulses two marks apart would not follow.
    """
    numbers, times, there = train.every()
    inside = (times >= course.begin) & (times <= course.end)
    numbers, there, phi = numbers[inside], there[inside], course.angle(times[inside])
    angle = TURN / train.lines * numbers
    ahead = scale * (angle if errors is None else angle + errors[numbers % train.lines]) - phi
    # the trapezoidal rule for uneven points; at the ends the window is zero
    spacing = np.gradient(phi)
    kept = (phi >= begin) & (phi <= end)
    phi, ahead, there, spacing, numbers = (v[kept] for v in (phi, ahead, there, spacing, numbers))
    mean = float(ahead[there].mean())
    found = Deviations(phi, ahead - mean, mean, spacing, numbers, there)
    if there.all():
        return found
    holes, values = ~there, found.values.copy()
    values[holes] = np.interp(phi[holes], phi[there], values[there])
    weights = found.window(begin, (end - begin) / TURN)
    for _ in range(BRIDGINGS if known else 0):
        model = np.zeros_like(phi)
        for order in known:
            rotating = np.exp(1j * order * phi)
            model += np.real(((weights * values) @ rotating.conj()) * rotating)
        values[holes] = model[holes] + np.interp(phi[holes], phi[there], (values - model)[there])
    return replace(found, values=values)


class Line(NamedTuple):
    """Amplitude of an order (rad), and the variance of its real part, which is that of the imaginary one."""

    value: complex
    variance: float


def lines(
    found: Sequence[Deviations],
    orders: Sequence[Fraction],
    steps: Sequence[Fraction],
    begin: float,
    turns: float,
    signs: Sequence[float],
    mesh: Fraction | None = None,
) -> dict[Fraction, Line]:
    """Return lines of the sum of several encoders' deviations, with variances by the scatter from turn to turn.

    Parameters
    ----------
    found : sequence of Deviations
    orders : sequence of Fraction
        Of the common angle.
    steps : sequence of Fraction
        Orders of which these are multiples, such as 1 and omega_2/omega_1 of the two shafts: one after the other each
        takes its multiples, and scatter is that from one of its turns to the next.
    begin, turns : float
        Window of the common angle, rad and turns.
    signs : sequence of float
        Factors of the encoders.
    mesh : Fraction, optional
        Order of whose multiples among `orders` the lines are taken out first, as the largest.
    """
    wanted: dict[Fraction, dict[int, Fraction]] = {step: {} for step in steps}
    for order in orders:
        step = next(step for step in steps if (order / step).denominator == 1)
        wanted[step][int(order / step)] = order
    # uneven marks leak a part of each line into all others: the lines of what is left make up for it
    apart = float(min(np.diff([float(o) for o in sorted(orders)]), default=1.0)) * turns > APART
    stages = [wanted, wanted] if apart else [wanted]
    if mesh is not None:
        large = {mesh: {int(order / mesh): order for order in orders if (order / mesh).denominator == 1}}
        stages = [large, large, *stages]
    values = dict.fromkeys(orders, 0.0j)
    variances = dict.fromkeys(orders, 0.0)
    for one, sign in zip(found, signs):
        weights = one.window(begin, turns)
        # what is left beside all lines is noise: those of one shaft would scatter over turns of the other
        left = one.values.copy()
        for stage in stages:
            rest = weights * left
            for step, places in stage.items():
                for order, rotating in _rotating(one.phi, step, places):
                    value = complex(rest @ rotating)
                    values[order] += sign * value
                    left -= np.real(value * rotating.conj())
        for step, places in wanted.items():
            length = TURN / float(step)
            whole = math.floor(turns * float(step) + WHOLE)
            edges = np.searchsorted(one.phi, begin + length * np.arange(whole + 1))
            if whole < 2 or np.any(np.diff(edges) < 1):
                continue
            plain = (2.0 / length) * one.spacing * left
            for order, rotating in _rotating(one.phi, step, places):
                by_turn = np.add.reduceat((plain * rotating)[: edges[-1]], edges[:-1])
                variances[order] += HANN_NOISE * 0.5 * float(np.var(by_turn, ddof=1)) / whole
    return {order: Line(values[order], variances[order]) for order in orders}


def _rotating(phi: np.ndarray, step: Fraction, places: dict[int, Fraction]) -> Iterator[tuple[Fraction, np.ndarray]]:
    """Yield exp(-i order phi) of multiples of an order, each from the one before."""
    turn, rotating = np.exp(-1j * float(step) * phi), np.ones(phi.size, dtype=complex)
    for k in range(1, max(places, default=0) + 1):
        rotating *= turn
        if k in places:
            yield places[k], rotating


def whole_number(value: Fraction | float) -> int | None:
    """Return the whole number that an order is, or None."""
    near = round(value)
    return near if abs(float(value) - near) < WHOLE * max(1.0, abs(near)) else None


def folding(mesh_order: float, lines_of_turn: int, harmonics: int) -> Iterator[tuple[int, float]]:
    """Yield the mesh harmonics that are not below half the lines, with the orders that they are seen at."""
    for k in range(1, harmonics + 1):
        if k * mesh_order >= 0.5 * lines_of_turn - WHOLE:
            yield k, folded(k * mesh_order, lines_of_turn)


def folded(order: float, lines_of_turn: int) -> float:
    """Return the order below half the lines that an order is seen at."""
    return abs((order + 0.5 * lines_of_turn) % lines_of_turn - 0.5 * lines_of_turn)


def beside(values: np.ndarray, turns: int, order: float, high: bool) -> np.ndarray:
    """Return what of a curve, closed over some turns, lies at an order and above, or below it."""
    spectrum = np.fft.rfft(values)
    above = np.arange(spectrum.size) >= order * turns
    spectrum[~above if high else above] = 0.0
    return np.fft.irfft(spectrum, values.size)
