"""What two encoders said of a pair: orders with intervals, curves, single-flank values, teeth; tables and words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from gearmbs._display import Shown
from gearmbs.signals.encoders.cycle import fall, missing_beyond, noise_within, unseen, unseen_mesh
from gearmbs.signals.encoders.estimate import Found, amplitude_interval
from gearmbs.signals.encoders.lengths import ACCURACY
from gearmbs.signals.encoders.orders import Gearing, beside
from gearmbs.signals.encoders.pulses import TURN
from gearmbs.signals.encoders.report import SHAFTS, markdown_of, verdict_of
from gearmbs.signals.errors import SignalError
from gearmbs.units import Quantity, to_si

MESH_POINTS = 64
"""Points of a mesh cycle in curves."""
MOST_POINTS = 1 << 21
"""Points of a curve over all that two wheels do before they meet again, at most: 16 MB."""
OUTSTANDING = 5.0
"""Robust standard deviations by which a tooth stands out: of 100 teeth of chance one does in 20,000 wheels."""
RUN_OUT = 2
"""Orders of a wheel that are its run-out: eccentricity is the first, a wheel pressed oval the second."""
TEETH_OF_ORDER = 6
"""Teeth for each order of run-out: fewer would be fitted by it, errors and all."""
REWEIGHTED = 30
"""Rounds of least squares with new weights: each halves what is left, or more, down to single precision."""
LEAST_REST = 1e-6
"""Part of the largest residual below which they weigh the same: far below the twentieth that teeth scatter by."""
ENDS = 8
"""Turns of the slower shaft that a record must have beside those of the window: two at either end for the smooth angle,
four for its flank."""


class OrderLine(NamedTuple):
    """What is known of one order; the first four as in `gearmbs.signals.encoders.visible.Order`."""

    order: Fraction
    first: int | None
    second: int | None
    harmonic: int | None
    found: Found
    freedom: float
    calibrated: bool


@dataclass(frozen=True, eq=False)
class MeasuredTransmissionError(Shown):
    """Transmission error from the pulses of two shafts: lag of the driven one on the driver's base circle, m.

    Attributes
    ----------
    gearing : Gearing
        Ratio of the speeds, and mesh order of the driver.
    radius : float
        Of the driver's base circle, m.
    lines : list of OrderLine
        Whole orders of either shaft.
    loads : tuple of str
    refused : list of str
        Orders that the encoders cannot show, and why.
    notes : list of str
    probability : float
        Of the intervals.
    teeth : tuple of int or None
    tooth_at_zero : tuple
        Of each shaft: tooth in mesh at mark 0, and step; None where it is not known.
    referenced : tuple of bool
        Of each shaft: whether mark 0 is a known one.
    speed : float
        Mean speed of the driver in the first run, rad/s.
    places : dict of str to float
        Angle of the driven disc as mark 0 of the driver passes, rad, by load.
    lines_of : tuple of int
    turns : float
        Of the driver, in the shortest run's window.
    doubt : str or None
        Why the told teeth or lines seem to be wrong (`gearmbs.signals.encoders.plausible`).
    accuracy : float
        Share of themselves that mesh harmonics are wanted to.
    recorded : dict of str to float
        Seconds in mesh, by load.
    freed : dict of str to float
        Seconds of each shaft running free.
    """

    gearing: Gearing
    radius: float
    lines: list[OrderLine]
    loads: tuple[str, ...]
    refused: list[str]
    notes: list[str]
    probability: float
    teeth: tuple[int, ...] | None
    tooth_at_zero: tuple[tuple[float, float] | None, ...]
    referenced: tuple[bool, ...]
    speed: float
    places: Mapping[str, float]
    lines_of: tuple[int, int]
    turns: float
    doubt: str | None = None
    source: str = field(default="pulses")
    accuracy: float = ACCURACY
    recorded: Mapping[str, float] = field(default_factory=dict)
    freed: Mapping[str, float] = field(default_factory=dict)

    def _load(self, load: str | None) -> str:
        if load is None:
            return self.loads[0]
        if load not in self.loads:
            raise SignalError(f"load: there is no {load!r}; the runs are of {', '.join(self.loads)}")
        return load

    def lines_with_intervals(self, factors: Mapping[str, float], lines: Iterable[OrderLine]) -> pd.DataFrame:
        """Return a combination of the loads' errors at some orders, with the intervals of the peak amplitudes, m.

        Parameters
        ----------
        factors : mapping of str to float
            Of loads: ``{"high": 1, "low": -1}`` is a difference.
        lines : iterable of OrderLine
        """
        names = {f"T {self._load(load)}": complex(factor) for load, factor in factors.items()}
        cancels = abs(sum(factors.values())) < 1e-12
        rows = []
        for one in lines:
            value, variance = one.found.of(names)
            freedom = math.inf if cancels and not one.calibrated else one.freedom
            low, high = amplitude_interval(abs(value), variance, freedom, self.probability)
            rows.append((
                one.harmonic or 0, float(one.order), float(self.gearing.on_second(one.order)), self.radius * abs(value),
                self.radius * low, self.radius * high, float(np.angle(value)), one.calibrated or cancels,
            ))  # fmt: skip
        columns = ["harmonic", "order_driver", "order_driven", "amplitude", "low", "high", "phase", "calibrated"]
        table = pd.DataFrame(rows, columns=columns)
        # a peak, as of spectra with this scaling
        table.attrs |= {"units": "m", "scaling": "amplitude"}
        return table

    def harmonics(self, load: str | None = None) -> pd.DataFrame:
        """Mesh harmonics of a load: peak amplitude with its interval (m), phase (rad) at mark 0 of the driver.

        Of a set whose mesh orders are no whole ones of the driver, but of the driven shaft, at mark 0 of that.
        """
        return self.lines_with_intervals({self._load(load): 1.0}, [o for o in self.lines if o.harmonic])

    def difference(self, load: str, other: str) -> pd.DataFrame:
        """Mesh harmonics of the difference of two loads' errors, of which the marks are no part."""
        return self.lines_with_intervals({load: 1.0, other: -1.0}, [o for o in self.lines if o.harmonic])

    def shaft_orders(self, load: str | None = None) -> pd.DataFrame:
        """Orders of the shafts that are no mesh orders, as `harmonics`."""
        return self.lines_with_intervals({self._load(load): 1.0}, [o for o in self.lines if not o.harmonic])

    def record_lengths(self, accuracy: float | None = None, load: str | None = None) -> pd.DataFrame:
        """Which mesh harmonics are known to what was asked, and how long a record the others take.

        What pulses leave open falls as the root of the record's length, what unknown marks leave does not.

        Parameters
        ----------
        accuracy : float, optional
            Half the interval by the amplitude; default: as the result was asked for.
        load : str, optional
            Default: the first.

        Returns
        -------
        DataFrame
            ``harmonic``, ``amplitude`` (m), ``reach`` half the interval by it, ``seen`` whether the line is clear of
            zero, ``known``; ``times`` as long in mesh and free it takes, infinite where marks are unknown, and the
            ``seconds`` in mesh, ``free_driver`` and ``free_driven`` that these are. Of a line that is not seen, for one
            of the measured height, which chance has made.
        """
        load, share = self._load(load), self.accuracy if accuracy is None else accuracy
        if not 0.0 < share < 1.0:
            raise SignalError(
                f"accuracy: must be a share of the amplitude between 0 and 1, such as 0.02, got {share!r}"
            )
        rows = []
        intervals = self.harmonics(load)
        for one, seen in zip((o for o in self.lines if o.harmonic), intervals["low"] > 0.0, strict=True):
            value, variance = self.of_load(one, load)
            size = abs(value)
            half = float(stats.t.ppf(0.5 + 0.5 * self.probability, one.freedom)) * math.sqrt(variance)
            reach = half / size if size else math.inf
            known = reach <= share
            times = 1.0 if known else (reach / share) ** 2 if one.calibrated else math.inf
            lengths = (self.recorded.get(load, math.nan), *(self.freed.get(shaft, 0.0) for shaft in SHAFTS))
            needed = [times * length if length else 0.0 for length in lengths]
            rows.append((one.harmonic, size, reach, bool(seen), known, times, *needed))
        columns = ["harmonic", "amplitude", "reach", "seen", "known", "times", "seconds", "free_driver", "free_driven"]
        return pd.DataFrame(rows, columns=columns)

    def of_load(self, one: OrderLine, load: str) -> tuple[complex, float]:
        """Return an order's complex amplitude at a load, m, and the variance of each of its parts, m^2."""
        value, variance = one.found.of({f"T {load}": 1.0 + 0.0j})
        return self.radius * value, self.radius**2 * variance

    def _closed(
        self, load: str, shaft: int | None, with_mesh: bool = True, clear: bool = True
    ) -> tuple[np.ndarray, int, float]:
        """Return a closed curve (m), how many turns of its shaft it covers, and the variance of its points.

        Of a shaft its whole orders, over one turn of it; of none all orders, until the wheels meet again. With `clear`
        only lines that chance would not give at one of all orders: hundreds of lines of noise add to a range of their
        own.
        """
        turns = 1 if shaft is not None else self.gearing.ratio.numerator
        mesh = self.gearing.mesh if shaft != 1 else self.gearing.on_second(self.gearing.mesh)
        top = max((max(o.order, self.gearing.on_second(o.order)) for o in self.lines), default=Fraction(1))
        count = 2 * math.ceil(max(float(mesh) * MESH_POINTS, 4.0 * float(top)) * turns / 2.0)
        if count > MOST_POINTS:
            raise SignalError(
                f"ratio: the wheels meet again after {turns} turns, a curve of {count} points; ask for those of the "
                "shafts"
            )
        spectrum, total = np.zeros(count // 2 + 1, dtype=complex), 0.0
        # the square of a line of chance exceeds x times the variance of each part with the probability exp(-x/2)
        bound = 2.0 * math.log(len(self.lines) / (1.0 - self.probability))
        for one in self.lines:
            whole = (one.first, one.second)[shaft] if shaft is not None else int(one.order * turns)
            if whole is None or (one.harmonic and not with_mesh):
                continue
            value, variance = self.of_load(one, load)
            if clear and abs(value) ** 2 < bound * variance:
                continue
            by_second = one.first is None and one.second is not None
            if one.second is not None and (shaft == 1) != by_second:
                value *= np.exp((1j if by_second else -1j) * one.second * self.places[load])
            spectrum[whole] += 0.5 * count * value
            total += variance
        return np.fft.irfft(spectrum, count), turns, total

    def curve(self, load: str | None = None, shaft: str | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Error over the angle.

        Parameters
        ----------
        load : str, optional
            Default: the first.
        shaft : {"driver", "driven"}, optional
            What recurs with each turn of a shaft, its mesh orders included; default all, over the turns of the driver
            after which the wheels meet again.

        Returns
        -------
        angle : ndarray of shape (n,)
            Turns of the shaft from its mark 0.
        error : ndarray of shape (n,)
            m, without its mean, which encoders do not know.
        """
        values, turns, _ = self._closed(self._load(load), None if shaft is None else _shaft(shaft))
        return turns * np.arange(values.size) / values.size, values

    def mesh_cycle(
        self, load: str | None = None, points: int = 400, harmonics: int | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Error over one mesh cycle from its harmonics: phase, 0 up to 1 from mark 0 of the driver, and error, m.

        Where a turn of the driver has no whole number of meshes, from mark 0 in the first of its turns.

        Parameters
        ----------
        load : str, optional
            Default: the first.
        points : int
        harmonics : int, optional
            The highest that is taken; `curve_accuracy` says what more or fewer of them do. Default: all.
        """
        phase, load = np.arange(points) / points, self._load(load)
        error = np.zeros(points)
        for one in self.lines:
            if one.harmonic and (harmonics is None or one.harmonic <= harmonics):
                value = self.of_load(one, load)[0]
                if one.first is None and one.second is not None:
                    value *= np.exp(1j * one.second * self.places[load])
                error += np.real(value * np.exp(1j * TURN * one.harmonic * phase))
        return phase, error

    def curve_accuracy(self, load: str | None = None, within: Quantity | None = None) -> pd.DataFrame:
        """How near `mesh_cycle` is to the true curve, by how many harmonics are taken.

        More harmonics have more noise, fewer lack what corners of the curve are made of; longer records have less of
        the one and allow for more of the other (`gearmbs.signals.encoders.cycle`).

        Parameters
        ----------
        load : str, optional
            Default: the first.
        within : float or str, optional
            m, to which the curve is wanted.

        Returns
        -------
        DataFrame
            ``harmonics``, the highest taken; ``noise`` (m), below which their noise stays all over the cycle with the
            result's probability; ``missing`` (m), what those that are not taken add up to at a corner, as the highest
            octave that stands clear of noise foretells (a ramp of whose length its harmonics are hides there, and steps
            shorter than the highest are not known of); and ``within``, the sum of both. With `within`, the ``seconds``
            in mesh (and as many times as long free)
            by which the sum is as small; infinite where harmonics are missing or marks unknown.

        Raises
        ------
        SignalError
            If the result has no mesh harmonics.
        """
        load = self._load(load)
        wanted = None if within is None else to_si(within, "length", "within")
        mesh = [one for one in self.lines if one.harmonic]
        if not mesh:
            raise SignalError("harmonics: none are seen, so that there is no curve over a mesh cycle")
        numbers = np.array([one.harmonic for one in mesh])
        found = [self.of_load(one, load) for one in mesh]
        values, variances = (np.array(part) for part in zip(*found, strict=True))
        turned = [
            np.exp(1j * one.second * self.places[load]) if one.first is None and one.second is not None else 1.0
            for one in mesh
        ]
        a = fall(numbers, values * turned, variances)
        unseen = np.setdiff1d(np.arange(1, numbers.max() + 1), numbers)
        sure = all(one.calibrated for one in mesh)
        rows = []
        for count in range(1, numbers.size + 1):
            noise = noise_within(numbers[:count], variances[:count], self.probability)
            missing = missing_beyond(a, int(numbers[count - 1]), unseen)
            row = {"harmonics": int(numbers[count - 1]), "noise": noise, "missing": missing, "within": noise + missing}
            if wanted is not None:
                left = wanted - missing
                far = left <= 0.0 or (noise > left and not sure)
                row["seconds"] = math.inf if far else self.recorded[load] * max(1.0, (noise / left) ** 2)
            rows.append(row)
        return pd.DataFrame(rows)

    def single_flank(self, load: str | None = None) -> pd.DataFrame:
        """The values of single-flank testing, m: of the pair, and of what recurs with each shaft.

        Returns
        -------
        DataFrame
            ``F_i`` total range, ``f_i`` largest range within one pitch, ``f_l`` range of the long waves, orders below
            half the mesh order, ``f_k`` range of the short waves, all others, nan where no mesh harmonic is seen;
            ``within`` what F_i is known to, with what orders may add that are not seen
            (`gearmbs.signals.encoders.cycle`).
        """
        rows, load = [], self._load(load)
        lacking, mesh_seen = [unseen(self, load, at) for at in (0, 1)], any(one.harmonic for one in self.lines)
        for name, shaft in (("pair", None), ("driver", 0), ("driven", 1)):
            values, turns, variance = self._closed(load, shaft)
            mesh = float(self.gearing.mesh if shaft != 1 else self.gearing.on_second(self.gearing.mesh))
            long, short = (beside(values, turns, 0.5 * mesh, high) for high in (False, True))
            width = max(2, round(values.size / (turns * mesh)))
            steps = np.lib.stride_tricks.sliding_window_view(np.concatenate((values, values[: width - 1])), width)
            reach = float(stats.norm.ppf(0.5 + 0.5 * self.probability)) * math.sqrt(2.0 * variance)
            own = lacking if shaft is None else [lacking[shaft]]
            if not mesh_seen:
                reach += sum(part.long for part in own)
                rows.append((name, math.nan, math.nan, np.ptp(long), math.nan, reach))
                continue
            reach += sum(part.whole for part in own) - 2.0 * unseen_mesh(self, load) * (len(own) - 1)
            rows.append((name, np.ptp(values), np.ptp(steps, axis=1).max(), np.ptp(long), np.ptp(short), reach))
        return pd.DataFrame(rows, columns=["of", "F_i", "f_i", "f_l", "f_k", "within"])

    def tooth_errors(self, shaft: str = "driver", load: str | None = None) -> pd.DataFrame:
        """Errors of a wheel tooth by tooth.

        Parameters
        ----------
        shaft : {"driver", "driven"}
        load : str, optional

        Returns
        -------
        DataFrame
            ``tooth``, as the train's `tooth_at_zero` numbers them, else from the one in mesh at mark 0; ``error``, what
            the wheel's orders beside the mesh orders come to over the tooth's pitch, on average, m; ``deviation`` of it
            from the run-out of the others, m; ``within`` what these are known to, with what the teeth of the other
            wheel may add if the record ends before the wheels meet again, and orders that are not seen; ``f_i`` the
            range over this pitch, mesh orders included, m; and whether it stands out.

        Raises
        ------
        SignalError
            If the teeth are not known.
        """
        at, load = _shaft(shaft), self._load(load)
        if self.teeth is None:
            raise SignalError("teeth: not known; give teeth=(z1, z2) for tooth-by-tooth errors")
        count = self.teeth[at]
        whole, _, _ = self._closed(load, at)
        error, inside = self._by_tooth(load, at)
        variance = 0.0
        for one in self.lines:
            order = (one.first, one.second)[at]
            if order is not None and not one.harmonic:
                variance += self.of_load(one, load)[1] * np.sinc(order / count) ** 2
        within = float(stats.norm.ppf(0.5 + 0.5 * self.probability)) * math.sqrt(variance) + self._leak(load, at)
        within += unseen(self, load, at).of_a_tooth()
        off = _beside_run_out(error)
        scale = 1.4826 * float(np.median(np.abs(off)))
        out = np.abs(off) > max(OUTSTANDING * scale, within)
        ranges = [float(np.ptp(np.roll(whole, whole.size // 2)[np.roll(k, k.size // 2)])) for k in inside]
        return pd.DataFrame(
            {
                "tooth": np.arange(count), "error": error, "deviation": off, "within": within, "f_i": ranges,
                "stands_out": out,
            }
        )  # fmt: skip

    def _by_tooth(self, load: str, at: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return the mean errors over the pitches of a wheel's teeth, m, and which points of its turn each has."""
        assert self.teeth is not None
        count = self.teeth[at]
        own, _, _ = self._closed(load, at, with_mesh=False, clear=False)
        number, step = self.tooth_at_zero[at] or (0.0, 1.0)
        # tooth m is in mesh, half a pitch to either side, at the angle (m - number) step pitches
        slot = np.mod(np.round(number + step * count * np.arange(own.size) / own.size), count).astype(int)
        inside = [slot == m for m in range(count)]
        return np.array([own[k].mean() for k in inside]), inside

    def _leak(self, load: str, at: int) -> float:
        """Return what the other wheel's teeth may add to a tooth's mean over its turns, m.

        Until the wheels meet again a tooth meets another one of the other wheel in each of its turns, so that their
        mean is not zero: at most that of the largest, as many as there are turns. Over whole meetings it is.
        """
        if self.turns % self.gearing.ratio.numerator == 0:
            return 0.0
        met = max(1, math.floor(self.turns / (1.0 if at == 0 else float(self.gearing.ratio))))
        other = np.sort(np.abs(self._by_tooth(load, 1 - at)[0]))[::-1]
        return float(other[:met].sum()) / met

    @property
    def short(self) -> str | None:
        """How long a record must be to tell the wheels' teeth apart, if it is shorter."""
        meeting = self.gearing.ratio.numerator
        if self.turns % meeting == 0:
            return None
        return (
            f"The wheels meet again after {meeting} turns of the driver, of which the record holds {self.turns:.3g}, "
            "less those at its ends that windows take: until then errors of teeth of one wheel are seen in part as "
            "such of the other. Record "
            f"{math.ceil(meeting + ENDS * max(1.0, float(self.gearing.ratio)))} turns or more."
        )

    def tables(self) -> dict[str, pd.DataFrame]:
        """All numbers as tables.

        mesh_harmonics, shaft_orders, single_flank, record_lengths and, with teeth, driver_teeth and driven_teeth; of
        several loads mesh_differences from the first.
        """
        found = {
            name: pd.concat([make(load).assign(load=load) for load in self.loads], ignore_index=True)
            for name, make in (
                ("mesh_harmonics", self.harmonics), ("shaft_orders", self.shaft_orders),
                ("single_flank", self.single_flank), ("record_lengths", lambda load: self.record_lengths(load=load)),
            )
        }  # fmt: skip
        first = self.loads[0]
        if len(self.loads) > 1:
            found["mesh_differences"] = pd.concat(
                [self.difference(load, first).assign(load=f"{load} - {first}") for load in self.loads[1:]],
                ignore_index=True,
            )
        for shaft in SHAFTS if self.teeth is not None else ():
            found[f"{shaft}_teeth"] = pd.concat(
                [self.tooth_errors(shaft, load).assign(load=load) for load in self.loads], ignore_index=True
            )
        return found

    @property
    def verdict(self) -> str:
        """What is sure, in a sentence."""
        return verdict_of(self)

    def to_markdown(self) -> str:
        """The report as Markdown text, lengths in micrometres."""
        return markdown_of(self)

    def __str__(self) -> str:
        return self.to_markdown()


def _beside_run_out(error: np.ndarray) -> np.ndarray:
    """Return how far teeth are beside the mean and the first orders of their wheel, which few teeth do not move.

    The sum of absolute residuals is least, by least squares with weights of 1/|residual|.
    """
    turn = TURN * np.arange(error.size) / error.size
    orders = range(1, 1 + min(RUN_OUT, error.size // TEETH_OF_ORDER))
    terms = np.stack([np.ones(error.size), *(f(k * turn) for k in orders for f in (np.cos, np.sin))], axis=1)
    rest = error - np.median(error)
    for _ in range(REWEIGHTED):
        weight = 1.0 / np.sqrt(np.maximum(np.abs(rest), LEAST_REST * np.abs(rest).max() + np.finfo(float).tiny))
        rest = error - terms @ np.linalg.lstsq(weight[:, None] * terms, weight * error, rcond=None)[0]
    return rest


def _shaft(name: str) -> int:
    if name not in SHAFTS:
        raise SignalError(f"shaft: must be 'driver' or 'driven', got {name!r}")
    return SHAFTS.index(name)
