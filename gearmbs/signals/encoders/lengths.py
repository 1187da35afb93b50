"""How long a record must be for a line of the transmission error to be known, and what a record of a length shows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from scipy import optimize, special

from gearmbs.signals.encoders.pulses import TURN
from gearmbs.signals.errors import SignalError
from gearmbs.units import Quantity, to_si

ACCURACY = 0.02
"""Share of a line's height that it is to be known to, where nothing else is asked: 0.17 dB."""
SMOOTHED = 2.0
"""Turns of a shaft that its smooth angle takes."""
FADED = 3.0
"""Turns of the slower shaft that the flanks of the window cost: both have four, which count for a quarter."""
LONGEST = 1e12
"""s, up to which lengths are looked for: thirty thousand years."""


class RecordLength(NamedTuple):
    """A record that is long enough: seconds and turns of the driver in mesh, seconds of each shaft running free."""

    seconds: float
    turns: float
    free_seconds: float


@dataclass(frozen=True)
class EncoderPair:
    """Two encoders on shafts that are to be measured: what their pulses leave open, before anything is measured.

    Attributes
    ----------
    base_radius : float or str
        Of the driver, m.
    speed : float or str
        Of the driver, rad/s.
    lines : int or (int, int)
        Marks of a turn.
    jitter, clock : float or str
        RMS of the random error of each time, and step of the counter's clock, s.
    ratio : float
        Speed of the driver by that of the driven shaft.
    mark_error : float or (float, float), optional
        RMS of the errors of the marks as a share of their pitch. Needed without free runs, of which they are no part.
    free : float
        Seconds of each shaft running free, at its speed in mesh, by those in mesh; 0 without free runs.

    Raises
    ------
    SignalError
        If a value is out of range, or neither marks nor free runs are told.
    """

    base_radius: Quantity
    speed: Quantity
    lines: int | Sequence[int]
    jitter: Quantity = 0.0
    clock: Quantity = 0.0
    ratio: Fraction | float = 1.0
    mark_error: float | Sequence[float] | None = None
    free: float = 1.0

    def __post_init__(self) -> None:
        for name, dimension in (
            ("base_radius", "length"), ("speed", "angular speed"), ("jitter", "time"), ("clock", "time")
        ):  # fmt: skip
            object.__setattr__(self, name, to_si(getattr(self, name), dimension, name))
        counts = tuple(int(n) for n in np.broadcast_to(np.asarray(self.lines), (2,)))
        object.__setattr__(self, "lines", counts)
        for name, value, least in (
            ("base_radius", self.base_radius, True), ("speed", self.speed, True), ("ratio", float(self.ratio), True),
            ("lines", min(counts), True), ("jitter", self.jitter, False), ("clock", self.clock, False),
            ("free", self.free, False),
        ):  # fmt: skip
            if not (math.isfinite(value) and value >= 0.0 and (value > 0.0 or not least)):
                raise SignalError(f"{name}: must be {'positive' if least else 'zero or more'}, got {value:g}")
        if self.mark_error is None:
            if not self.free:
                raise SignalError(
                    "mark_error: without free runs the errors of the marks stay in the result; give their RMS as a "
                    "share of the pitch, such as 0.01, or free=1 for runs of each shaft alone"
                )
        elif not np.all(np.asarray(self.mark_error) >= 0.0):
            raise SignalError(
                f"mark_error: must be one or two shares of the pitch, zero or more, got {self.mark_error!r}"
            )

    @property
    def _edge(self) -> float:
        """RMS error of a pulse's time, s: jitter, and a clock that cuts evenly."""
        return math.hypot(self.jitter, self.clock / math.sqrt(12.0))

    @property
    def _shortest(self) -> float:
        """Seconds that ends of records take, at least."""
        turn, ratio = TURN / self.speed, float(self.ratio)
        ends = [(SMOOTHED + FADED * max(1.0, ratio)) * turn]
        if self.free:
            ends.append((SMOOTHED + FADED) * turn * max(1.0, ratio) / self.free)
        return max(ends)

    def floor(self) -> float:
        """Standard deviation of a line's amplitude that no length of record takes away, m: that of unknown marks."""
        if self.free:
            return 0.0
        shares = np.broadcast_to(np.asarray(self.mark_error, dtype=float), (2,))
        # a line of L independent errors of variance s^2 has 2 s^2/L in each part
        total = sum(
            scale**2 * 2.0 * (share * TURN / lines) ** 2 / lines
            for scale, share, lines in zip((1.0, float(self.ratio)), shares, self.lines, strict=True)  # type: ignore[arg-type]
        )
        return self.base_radius * math.sqrt(total)

    def uncertainty(self, seconds: Quantity) -> float:
        """Standard deviation of a line's amplitude, m, after some seconds in mesh; infinite if these are too few.

        Of the pulses of N turns of L lines each, whose times have independent errors sigma, a line of either shaft has
        the variance 2 (omega sigma)^2/(L N) in each part, as an angle of that shaft; the driven one counts by the
        ratio, and free runs, from which the marks are known, once more (`docs/theory/angle_measurement.md`).

        Parameters
        ----------
        seconds : float or str
            In mesh.
        """
        length = to_si(seconds, "time", "seconds")
        if not length > self._shortest:
            return math.inf
        first, second = self.lines  # type: ignore[misc]
        turn, ratio = TURN / self.speed, float(self.ratio)
        shares = [(1.0 / first + ratio / second) / (length - (SMOOTHED + FADED * max(1.0, ratio)) * turn)]
        if self.free:
            shares += [
                1.0 / first / (self.free * length - (SMOOTHED + FADED) * turn),
                ratio / second / (self.free * length - (SMOOTHED + FADED) * turn * ratio),
            ]
        # of the pulses alone
        counted = 2.0 * TURN * self.speed * self._edge**2 * sum(shares)
        return math.sqrt(self.base_radius**2 * counted + self.floor() ** 2)

    def resolves(self, seconds: Quantity, accuracy: float = ACCURACY, probability: float = 0.95) -> float:
        """Amplitude from which lines are known to a share of themselves after some seconds in mesh, m.

        Parameters
        ----------
        seconds : float or str
            In mesh.
        accuracy : float
            Half the interval by the amplitude.
        probability : float
            Of the interval.
        """
        return _reach(probability) * self.uncertainty(seconds) / _share(accuracy)

    def needs(self, amplitude: Quantity, accuracy: float = ACCURACY, probability: float = 0.95) -> RecordLength:
        """Record by which a line of some amplitude is known to a share of itself.

        Parameters
        ----------
        amplitude : float or str
            Peak amplitude of the line, m.
        accuracy, probability : float
            As for `resolves`.

        Returns
        -------
        RecordLength
            Infinite where unknown marks leave more, however long the record is.
        """
        height = to_si(amplitude, "length", "amplitude")
        if not (math.isfinite(height) and height > 0.0):
            raise SignalError(f"amplitude: must be positive, got {amplitude!r}")
        wanted = _share(accuracy) * height / _reach(probability)
        shortest = self._shortest
        if self.floor() >= wanted:
            return RecordLength(math.inf, math.inf, 0.0)

        def beyond(log_more: float) -> float:
            return math.log(self.uncertainty(shortest * (1.0 + math.exp(log_more))) / wanted)

        # from a record that is hardly longer than its ends
        low, high = math.log(1e-3), math.log(LONGEST / shortest)
        if not self._edge or beyond(low) <= 0.0:
            seconds = shortest
        elif beyond(high) > 0.0:
            seconds = math.inf
        else:
            seconds = shortest * (1.0 + math.exp(optimize.brentq(beyond, low, high, xtol=1e-9)))
        return RecordLength(seconds, seconds * self.speed / TURN, self.free * seconds)


def _share(accuracy: float) -> float:
    if not 0.0 < accuracy < 1.0:
        raise SignalError(f"accuracy: must be a share of the amplitude between 0 and 1, such as 0.02, got {accuracy!r}")
    return accuracy


def _reach(probability: float) -> float:
    """Return half the width of an interval by the standard deviation."""
    if not 0.0 < probability < 1.0:
        raise SignalError(f"probability: must lie between 0 and 1, got {probability!r}")
    return float(special.ndtri(0.5 + 0.5 * probability))
