"""Two shafts over one angle: from numbered pulses to lines at orders, turn by turn for their scatter.

The common angle phi is that of the first shaft, smoothed over one turn of it: the mean time of the pulses of a turn
knows nothing of the marks. Each encoder gives, at its own pulses, how far its shaft is ahead of phi,

    d(phi_n) = s (2 pi n/L - zero) - phi(t_n),     s = 1 for the first shaft, omega_1/omega_2 for the second,

and lines are sums over the pulses where they came, with their distances as weights: nothing is interpolated between
marks, so that an order just below half the lines is as right as a low one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
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
FINE = 12
"""Parts of a turn over which the common angle is smoothed, twice: of a swing of order 1 a part in 1900 is left beside
it, of order 4 a tenth, of order 12 all; of teeth nothing is let through."""
KNOTS, FEWEST_PIECES = 4.0, 3
"""Turns between the knots of a shaft's slow turning, and its pieces at least: a quarter of an order and more is left
beside it to 3 % in 60 turns, half to 1 %, of a tenth a thirtieth."""
FEWEST_TURNS = 4
"""Turns of the slower shaft within the smooth angle: a window of as many parts orders that lie one apart."""
BRIDGINGS = 3
"""Times that missing pulses are bridged: each leaves the part of the error that one pulse has in the known lines."""
APART = 0.99
"""Distance of two orders, by the reciprocal of the window's turns, from which they do not see each other."""
FLANK = 4.0
"""Turns of the slower shaft in which the window rises and falls, if the record has twice as many: what is half an order
beside a line and no line itself is let through to 1/15 of what it would be by flanks of no length."""
MOST_SCATTER = 128
"""Turns, spread over the record, by which the scatter of a line is told, at most: its square is then known to 6 %."""
CLEAR_OF_LEAKS = 2.0
"""Times what others leak, RMS, from which a line is one: leaks alone are so in one of fifty."""
WHOLE = 1e-9
"""Difference from a whole number up to which an order is one: of ratios written as decimals."""


class Gearing(NamedTuple):
    """How two shafts turn: omega_1/omega_2, and the mesh order by turns of the first."""

    ratio: Fraction
    mesh: Fraction

    def on_second(self, order: Fraction) -> Fraction:
        """Return an order of the first shaft as one of the second."""
        return order * self.ratio


class Window(NamedTuple):
    """Whole periods of the common angle, whose beginning fades in as what follows them fades out.

    Copies of it a window apart add to one, so that lines of the periods do not see each other; what is none is damped
    by the flanks. With flanks as long as the window it is Hann's, of twice the turns.

    Attributes
    ----------
    begin : float
        rad.
    turns, flank : float
        Turns from the middle of one flank to that of the other, and of each flank; without flanks the window is closed,
        its end followed by its beginning.
    """

    begin: float
    turns: float
    flank: float

    @classmethod
    def of(cls, begin: float, end: float, periods: Sequence[float]) -> Window:
        """Return the window of a stretch (rad): whole ones of the first of some periods (turns) that fits."""
        whole = (end - begin) / TURN
        shortest = periods[-1]
        flank = min(FLANK * shortest, 0.5 * whole)
        period = next((p for p in periods if whole - flank >= p), shortest)
        turns = max(1.0, (whole - flank) // period) * period
        return cls(begin, turns, min(whole - turns, turns))

    @property
    def length(self) -> float:
        """Turns from its first point to its last."""
        return self.turns + self.flank

    @property
    def noise(self) -> float:
        """Variance of a line of noise, by that of as many turns without flanks."""
        return 1.0 - 0.25 * self.flank / self.turns

    def weights(self, phi: np.ndarray, spacing: np.ndarray) -> np.ndarray:
        """Return weights of points, normalised so that the sum with a line's exponential is its amplitude."""
        weights = spacing * self.fade(phi)
        return 2.0 / weights.sum() * weights

    def fade(self, phi: np.ndarray) -> np.ndarray:
        """Return what the window lets through of points, 0 to 1."""
        if not self.flank:
            return np.ones(phi.size)
        turned = (phi - self.begin) / TURN
        inside = np.minimum(turned, self.length - turned) / self.flank
        return 0.5 - 0.5 * np.cos(math.pi * np.clip(inside, 0.0, 1.0))


class Course(NamedTuple):
    """The common angle, rad, over time, and where it is known (s)."""

    angle: Callable[[np.ndarray | float], np.ndarray]
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


def common_angle(train: PulseTrain, errors: np.ndarray | None = None) -> Course:
    """Return the angle of a shaft with what swings of it a few times a turn: means over a part of a turn at a time.

    Lines of a mesh are lines over the angle that its wheels turn by. Over an angle that lacks a swing b cos(o phi) of
    the shaft, the line of the order k has J0(k b) of its height, and the rest is beside it.

    Parameters
    ----------
    train : PulseTrain
    errors : ndarray of shape (lines,), optional
        Of its marks, rad. Unknown ones are taken for swing of the shaft, which the difference of two encoders lacks.
    """
    course = smooth_angle(train)
    numbers, times, there = train.every()
    angle = TURN / train.lines * numbers
    if errors is not None:
        angle += errors[numbers % train.lines]
    span = max(1, train.lines // FINE)
    for _ in range(SMOOTHINGS):
        inside = (times >= course.begin) & (times <= course.end)
        times, angle, there = times[inside], angle[inside], there[inside]
        ahead = angle - course.angle(times)
        ahead[~there] = np.interp(times[~there], times[there], ahead[there])
        mean, middle = (_means(span, 1, _means(span, 1, values)) for values in (times, ahead))
        mean, middle = (values[:: max(1, train.lines // SAMPLED_TURN)] for values in (mean, middle))
        course = Course(
            scipy.interpolate.CubicSpline(mean, course.angle(mean) + middle), float(mean[0]), float(mean[-1])
        )
    return course


def slow_angle(train: PulseTrain, errors: np.ndarray | None = None) -> Course:
    """Return the angle of a shaft without what swings of it a few times a turn or once in a few: cubic splines.

    Parameters
    ----------
    train : PulseTrain
    errors : ndarray of shape (lines,), optional
        Of its marks, rad; those of a few marks would bend the splines.
    """
    numbers, times = train.numbers, train.times
    parts = max(FEWEST_PIECES, math.floor(train.turns / KNOTS))
    knots = np.interp(np.linspace(numbers[0], numbers[-1], parts + 1)[1:-1], numbers, times)
    angle = TURN / train.lines * numbers
    if errors is not None:
        angle = angle + errors[numbers % train.lines]
    # about the mean, so that no digits are lost
    middle, straight = 0.5 * (times[0] + times[-1]), train.mean_speed
    at = times - middle
    spline = scipy.interpolate.make_lsq_spline(
        at, angle - straight * at, np.r_[(at[0],) * 4, knots - middle, (at[-1],) * 4], k=3
    )
    return Course(lambda t: spline(t - middle) + straight * (t - middle), float(times[0]), float(times[-1]))


def _turn_means(count: int, values: np.ndarray) -> np.ndarray:
    """Return means over `count` values, `SAMPLED_TURN` times a turn."""
    return _means(count, max(1, count // SAMPLED_TURN), values)


def _means(count: int, step: int, values: np.ndarray) -> np.ndarray:
    """Return means over `count` values, one each `step`."""
    sums = np.concatenate(([0.0], np.cumsum(values - values[0])))
    first = np.arange(0, values.size - count + 1, step)
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

    @property
    def drift(self) -> float:
        """By how much the shaft comes ahead from the first pulse to the last, rad: twice that of the halves' means."""
        half = self.values.size // 2
        return 2.0 * float(self.values[half:].mean() - self.values[:half].mean())


def deviations(
    train: PulseTrain,
    course: Course,
    begin: float,
    end: float,
    scale: float,
    errors: np.ndarray | None = None,
    known: Sequence[float] = (),
    window: Window | None = None,
) -> Deviations:
    """Return how far a shaft is ahead of the common angle at its pulses, whose marks have errors (rad) or none.

    Pulses that are missing are bridged: by a straight line through what is left when the lines at the `known` orders of
    the common angle are taken out, as a window shows them, which a line of pulses two marks apart would not follow.
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
    return bridged(Deviations(phi, ahead - mean, mean, spacing, numbers, there), known, window)


def bridged(found: Deviations, known: Sequence[float] = (), window: Window | None = None) -> Deviations:
    """Return deviations with those of missing pulses filled in, as `deviations` says."""
    phi, there = found.phi, found.there
    if there.all():
        return found
    holes, values = ~there, found.values.copy()
    values[holes] = np.interp(phi[holes], phi[there], values[there])
    if window is not None:
        weights = window.weights(phi, found.spacing)
        for _ in range(BRIDGINGS):
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
    window: Window,
    signs: Sequence[float],
    mesh: Fraction | None = None,
    hidden: Sequence[Sequence[Fraction]] = (),
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
    window : Window
    signs : sequence of float
        Factors of the encoders.
    mesh : Fraction, optional
        Order of whose multiples among `orders` the lines are taken out first, as the largest.
    hidden : sequence of sequence of Fraction
        Further multiples of it that each encoder has, to be taken out with these and not returned.
    """
    wanted = multiples(orders, steps)
    values = dict.fromkeys(orders, 0.0j)
    turns: dict[Fraction, np.ndarray] = {}
    for one, sign, beyond in zip(found, signs, hidden or [()] * len(found)):
        own, left = taken_out(one, orders, wanted, window, mesh, beyond)
        for order, by_turn in turn_by_turn(one, left, wanted, window).items():
            turns[order] = turns.get(order, 0.0) + sign * by_turn
        for order, value in own.items():
            values[order] += sign * value
    variances = scatter(turns, wanted, window)
    return {order: Line(values[order], variances.get(order, 0.0)) for order in orders}


Multiples = dict[Fraction, dict[int, Fraction]]
"""Of each step its multiples, and the orders that these are."""


def multiples(orders: Sequence[Fraction], steps: Sequence[Fraction]) -> Multiples:
    """Return which orders are multiples of which step, each of the first that it is one of."""
    wanted: Multiples = {step: {} for step in steps}
    for order in orders:
        step = next(step for step in steps if (order / step).denominator == 1)
        wanted[step][int(order / step)] = order
    return wanted


def taken_out(
    one: Deviations,
    orders: Sequence[Fraction],
    wanted: Multiples,
    window: Window,
    mesh: Fraction | None,
    hidden: Sequence[Fraction] = (),
) -> tuple[dict[Fraction, complex], np.ndarray]:
    """Return the lines of an encoder, and what its deviations are without them and without hidden multiples of `mesh`.

    What marks fold is at its own order in the pulses, which are where the uneven marks are: as a line of the order that
    it is folded to it would leave a part in all others.
    """
    weights = window.weights(one.phi, one.spacing)
    # uneven marks leak a part of each line into all others: the lines of what is left make up for it
    apart = float(min(np.diff([float(o) for o in sorted(orders)]), default=1.0)) * window.turns > APART
    stages = [wanted, wanted] if apart else [wanted]
    if mesh is not None:
        own = {int(order / mesh): order for order in orders if (order / mesh).denominator == 1}
        beyond = _clear_of_leaks(one, weights, mesh, own, {int(order / mesh): order for order in hidden})
        large = {mesh: own | beyond}
        stages = [large, large, *([large] if beyond else []), *stages]
    values = dict.fromkeys((*orders, *hidden), 0.0j)
    # what is left beside all lines is noise: those of one shaft would scatter over turns of the other
    left = one.values.copy()
    for stage in stages:
        rest = weights * left
        for step, places in stage.items():
            for order, rotating in _rotating(one.phi, step, places):
                value = complex(rest @ rotating)
                values[order] += value
                left -= np.real(value * rotating.conj())
    return {order: values[order] for order in orders}, left


def _clear_of_leaks(
    one: Deviations, weights: np.ndarray, mesh: Fraction, own: dict[int, Fraction], hidden: dict[int, Fraction]
) -> dict[int, Fraction]:
    """Return those of the hidden multiples of `mesh` that are more than what other lines leak onto them.

    A line a of the order o' leaves (o - o') eps a/sqrt(2 L) in each part at the order o, with eps the uneven marks' and
    L their number. A line that is nothing but leaks would put back its own.
    """
    if not hidden:
        return {}
    every = dict(sorted((own | hidden).items()))
    rest = weights * one.values
    size = np.array([abs(rest @ rotating) for _, rotating in _rotating(one.phi, mesh, every)])
    number = np.array(list(every), dtype=float)
    line = np.polynomial.Polynomial.fit(one.numbers, one.phi, 1)
    uneven = float(np.std(one.phi - line(one.numbers)))
    count = TURN / float(np.median(one.spacing))
    apart = float(mesh) * (number[:, None] - number)
    leaks = uneven * np.sqrt(apart**2 @ size**2 / count)
    clear = size > CLEAR_OF_LEAKS * leaks
    return {k: order for k, order in hidden.items() if clear[int(np.searchsorted(number, k))]}


def turn_by_turn(one: Deviations, left: np.ndarray, wanted: Multiples, window: Window) -> dict[Fraction, np.ndarray]:
    """Return the lines of each turn, or of `MOST_SCATTER` of them, in what is left beside the lines of the record."""
    found = {}
    for step, places in wanted.items():
        length = TURN / float(step)
        whole = math.floor(window.length * float(step) + WHOLE)
        chosen = np.arange(whole)
        if whole > MOST_SCATTER:
            chosen = np.round(np.linspace(0, whole - 1, MOST_SCATTER)).astype(int)
        first, last = (np.searchsorted(one.phi, window.begin + length * k) for k in (chosen, chosen + 1))
        if whole < 2 or np.any(first == last):
            continue
        picked = np.concatenate([np.arange(a, b) for a, b in zip(first, last)])
        begins = np.concatenate(([0], np.cumsum(last - first)[:-1]))
        plain = ((2.0 / length) * one.spacing * left)[picked]
        for order, rotating in _rotating(one.phi[picked], step, places):
            found[order] = np.add.reduceat(plain * rotating, begins)
    return found


def scatter(turns: dict[Fraction, np.ndarray], wanted: Multiples, window: Window) -> dict[Fraction, float]:
    """Return the variances of lines by how those of the turns scatter."""
    variances = {}
    for step, places in wanted.items():
        share = 0.5 * window.noise / (window.turns * float(step))
        for order in places.values():
            if order in turns:
                variances[order] = share * float(np.var(turns[order], ddof=1))
    return variances


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
