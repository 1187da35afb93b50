"""Shaft angle over time: from a constant speed, from tacho pulses, or from a gear mesh line when there is no tacho.

Pulses that are missing or too many are told from the intervals beside them.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple, Unpack

import numpy as np
import scipy.fft
import scipy.interpolate
import scipy.signal as ss
import xarray as xr

from gearmbs.signals.errors import SignalError
from gearmbs.signals.filters import ATTENUATION_DB, BLOCK, apply_zero_phase, kaiser_taps
from gearmbs.signals.rotation.recurring import doubtful_turns, sudden_jump
from gearmbs.signals.rotation.tacho_edges import edge_scatter, smoothed_edges, sure_ends
from gearmbs.signals.rotation.uneven_marks import uneven_faults
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.given import speed_curve
from gearmbs.signals.signal.signal import rate_of
from gearmbs.signals.signal.units import Given
from gearmbs.wording import warn

LINE_ATTENUATION_DB = 60.0
"""Attenuation of all beside the line that is followed: a thousandth of a neighbour as large moves its phase by a
milliradian."""
PULSE_HYSTERESIS = 0.2
"""Part of its range by which a tacho's signal must have fallen below the threshold before the next pulse counts."""
SIDE = 3
"""Intervals on each side that say how long those between them should be."""
FEWEST_BESIDE = 4
"""Lines of both sides together, each with at least one: two would follow any course of the speed."""
UNLIKE = math.log(1.4)
"""An interval that differs more than this from the median around it is looked at; half of a doubled one is log 2."""
MEDIAN_REACH, SCATTER_REACH = 4, 12
CLEAR_OF_SIDES, CLEAR_OF_SCATTER = 3.0, 5.0
"""How often an interval's excess must be the largest of the neighbours' residuals, and the scatter around: a speed that
fluctuates so much from pulse to pulse explains the interval itself."""
WHOLE = 0.2
"""How far from a whole number of the neighbours' intervals the length may be, in intervals."""
UNCLEAR = math.log(1.45)
"""An interval of no whole number is named from here on; the first turn after a sudden load may take less."""
MOST_MISSING = 8
"""Pulses that may be missing in one gap; a longer one may as well be a standstill."""
SAME_WHEEL = math.log(1.25)
"""Intervals one revolution apart that differ less are the wheel's own pitch error, not a fault of the pulses."""
RECURRING = 2
"""Revolutions of the four nearest in which an interval must recur to be the wheel's own."""
LISTED = 5


@takes_data()
def phase_from_speed(signal: Any, speed: Any, **_data: Unpack[DataKeywords]) -> xr.DataArray:
    """Angle of a shaft whose speed is known, zero at the first sample.

    Parameters
    ----------
    signal : xarray.DataArray
        The record whose times are meant.
    speed : float, str, or curve
        As for `speed_curve`: a number in rad/s, "1500 rpm", points over time, a function. Rest is allowed.

    Returns
    -------
    xarray.DataArray
        rad, dimension (time,): the integral of the speed, over the samples that the curve covers, with its `notes`.

    Raises
    ------
    SignalError
        If the speed cannot be read, or its curve covers less than two samples of the record.
    """
    times = np.asarray(signal["time"].values, dtype=float)
    curve = speed_curve(speed, span=(float(times[0]), float(times[-1])))
    if curve.times.size == 1:
        return _phase(times, curve.angle(times), "constant speed")
    half = 0.5 / rate_of(signal)
    inside = (times >= curve.times[0] - half) & (times <= curve.times[-1] + half)
    if inside.sum() < 2:
        raise SignalError(
            f"speed: the curve spans {curve.times[0]:g} to {curve.times[-1]:g} s, "
            f"the record {times[0]:g} to {times[-1]:g} s"
        )
    result = _phase(times[inside], curve.angle(times[inside]), "speed curve")
    notes = getattr(speed, "attrs", {}).get("notes")
    return result.assign_attrs(notes=notes) if notes else result


@takes_data()
def phase_from_tacho(
    signal: Any,
    channel: str | None = None,
    *,
    pulses_per_rev: float = 1.0,
    threshold: float | None = None,
    faults: Literal["mend", "refuse", "keep"] = "mend",
    smooth: bool = False,
    **_data: Unpack[DataKeywords],
) -> xr.DataArray:
    """Angle (rad) of the shaft from a tacho channel's rising pulse edges.

    Edges are placed between samples by linear interpolation at the threshold; the signal must fall below the threshold
    by a fifth of its swing before the next edge counts. A cubic spline through the edges gives the angle between them;
    where that would turn back, as beside a standstill, a monotone piecewise cubic does.

    Missing and extra pulses, which would put the angle wrong by whole pitches from there on, are told from the
    intervals beside them where the speed is even enough from pulse to pulse (`gearmbs.signals.rotation.phase`), and
    mended with a warning: an interval of k of its neighbours' counts as k pitches, two that add to one as one. At the
    ends of the record, where one side alone tells, pulses that do not fit are left out with a warning.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    channel : str, optional
        The tacho's channel; may be left out if there is only one.
    pulses_per_rev : float
        Pulses per revolution.
    threshold : float, optional
        Level of the edges; default the middle between the 1st and the 99th percentile.
    faults : {"mend", "refuse", "keep"}
        What to do about missing and extra pulses: "keep" counts every pulse as it comes, as of a shaft that does jump
        so, "refuse" raises.
    smooth : bool
        Whether to take the smoothest course of the angle that the scatter of the edges allows, instead of one through
        each edge: of noisy or slow edges, not of a shaft whose speed jumps from turn to turn.

    Returns
    -------
    xarray.DataArray
        Dimension (time,), only the samples between the first and the last pulse; attributes `scatter`, by how much
        edges scatter about a smooth course of the angle, or what is left of that, in rad, and `notes`, where there was
        something to mend.

    Warns
    -----
    UserWarning
        Where pulses are missing or too many, with times and numbers, and where an interval fits no whole number.

    Raises
    ------
    SignalError
        If the channel is unknown or fewer than three pulses are found.
    """
    if faults not in ("mend", "refuse", "keep"):
        raise SignalError(f"faults: must be 'mend', 'refuse' or 'keep', got {faults!r}")
    if isinstance(pulses_per_rev, bool) or not (math.isfinite(pulses_per_rev) and pulses_per_rev > 0.0):
        raise SignalError(f"pulses_per_rev: must be positive, got {pulses_per_rev!r}")
    edges, name, level = pulse_edges(signal, channel, threshold)
    if edges.size < 3:
        raise SignalError(
            f"channel: {edges.size} pulses cross the threshold {level:g} in {name!r}, "
            "at least 3 are needed; check the channel or pass threshold=..."
        )
    times = signal["time"].values
    places = [] if faults == "keep" else pulse_faults(edges, pulses_per_rev)
    notes = [f"Tacho {name!r}: {words}" for words in described(edges, places)]
    if notes and faults == "refuse":
        raise SignalError(f"faults: {' '.join(notes)} Mend them with faults='mend', or take them with faults='keep'")
    kept_edges, numbers = mended_count(edges.size, places)
    if faults != "keep":
        begin, end = sure_ends(edges[kept_edges], numbers)
        ends = _ends_said(edges[kept_edges], begin, end)
        if ends and faults == "refuse":
            raise SignalError(f"faults: Tacho {name!r}: {ends} Mend with faults='mend', or take it with faults='keep'")
        notes += [f"Tacho {name!r}: {ends}"] * bool(ends)
        kept_edges, numbers = kept_edges[begin : kept_edges.size - end], numbers[begin : numbers.size - end]
    if faults != "keep" and pulses_per_rev >= 2 and float(pulses_per_rev).is_integer():
        shifted, unlike, *_ = doubtful_turns(numbers, edges[kept_edges], int(pulses_per_rev))
        if shifted or unlike:
            notes.append(
                f"Tacho {name!r}: CHECK THE COUNT: {shifted} turns and {unlike} intervals are unlike those of the same "
                "marks in other turns, so that turns and speed may be wrong; raise the level of weak marks "
                "(threshold=...), or use one mark a turn."
            )
    if faults != "keep" and (jump := sudden_jump(numbers, edges[kept_edges], max(1, round(pulses_per_rev)))):
        notes.append(
            f"Tacho {name!r}: CHECK THE COUNT: {jump}. The speed is that of the pulses as they come; raise the level "
            "of weak marks (threshold=...), or take the time before or behind alone."
        )
    for note in notes:
        warn(note, UserWarning)
    edges = edges[kept_edges]
    scatter = edge_scatter(edges, numbers, pulses_per_rev)
    if smooth and scatter > 0.0:
        edges, scatter = smoothed_edges(edges, numbers, pulses_per_rev, scatter)
        numbers = numbers[0] + np.arange(edges.size)
    angles = 2.0 * np.pi / pulses_per_rev * numbers
    inside = (times >= edges[0]) & (times <= edges[-1])
    phase = scipy.interpolate.CubicSpline(edges, angles)(times[inside])
    if np.any(np.diff(phase) <= 0.0):
        # its kernel loads the compiler
        from gearmbs.signals.resampling import monotone_cubic

        phase = monotone_cubic(edges, angles, times[inside])
    result = _phase(times[inside], phase, "tacho")
    result.attrs["scatter"] = scatter
    if notes:
        result.attrs["notes"] = notes
    return result


def _ends_said(edges: np.ndarray, begin: int, end: int) -> str:
    """Say which pulses at the ends of a record are left out; empty if none is."""
    parts = [f"the first {begin} up to {edges[begin - 1]:.6g} s"] * bool(begin)
    parts += [f"the last {end} from {edges[-end]:.6g} s on"] * bool(end)
    if not parts:
        return ""
    return (
        f"{' and '.join(parts)} of its pulses come in intervals unlike those beside them, as where one is missing or "
        "too many at the end of a record; it is cut there."
    )


def pulse_edges(
    signal: xr.DataArray, channel: str | None = None, threshold: float | None = None
) -> tuple[np.ndarray, str, float]:
    """Return the times of a channel's rising edges (s) between its samples, the channel's name, and the threshold.

    Raises
    ------
    SignalError
        If the channel is unknown, or not named and one of several.
    """
    names = [str(c) for c in signal["channel"].values]
    if channel is None and len(names) > 1:
        raise SignalError(f"channel: name the tacho channel, one of {names}")
    if channel is not None and channel not in names:
        raise SignalError(f"channel: there is no {channel!r}, only {names}")
    name = names[0] if channel is None else channel
    pulses = signal.values[:, names.index(name)]
    low, high = np.percentile(pulses, [1.0, 99.0])
    if high <= low:
        low, high = float(pulses.min()), float(pulses.max())
    level = 0.5 * (low + high) if threshold is None else float(threshold)
    crossings = np.flatnonzero((pulses[:-1] < level) & (pulses[1:] >= level))
    floor = level - PULSE_HYSTERESIS * (high - low)
    kept: list[int] = []
    previous = 0
    for index in crossings.tolist():
        if pulses[previous : index + 1].min() < floor:
            kept.append(index)
            previous = index + 1
    at = np.asarray(kept, dtype=int)
    rise = (level - pulses[at]) / (pulses[at + 1] - pulses[at])
    return signal["time"].values[at] + rise / rate_of(signal), name, float(level)


@takes_data(frequency="frequency", half_bandwidth="frequency")
def phase_from_line(
    signal: Any,
    frequency: Given,
    order: float,
    *,
    half_bandwidth: Given | None = None,
    **_data: Unpack[DataKeywords],
) -> xr.DataArray:
    """Angle (rad) of the shaft from the phase of one line, such as a gear mesh harmonic.

    Each channel is shifted down by `frequency`, low-passed (zero-phase FIR, flat to half_bandwidth, 60 dB down at twice
    that) and its phase unwrapped; the channel whose line holds up best over time (fifth percentile of the envelope over
    its RMS) is used.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    frequency : float or str
        Mean frequency of the line, Hz or text.
    order : float
        Line frequency over shaft frequency, e.g. the tooth count times the harmonic.
    half_bandwidth : float or str, optional
        Largest deviation to follow, Hz or text; default 0.15 shaft frequencies, which keeps out sidebands of the
        shaft and of most mating shafts.

    Returns
    -------
    xarray.DataArray
        Dimension (time,), the samples for which the filter, 3.9 / half_bandwidth seconds long, lies inside the record;
        attributes `channel`, `quality` (0 to 1) and `mean_speed` in rad/s.

    Raises
    ------
    SignalError
        If the record is too short for the filter, or a parameter is out of range.
    """
    rate, frequency = rate_of(signal), float(frequency)
    if not 0.0 < frequency < rate / 2 or not order > 0.0:
        raise SignalError(
            f"frequency, order: must be positive and below {rate / 2:g} Hz, got {frequency!r} and {order!r}"
        )
    half = 0.15 * frequency / order if half_bandwidth is None else float(half_bandwidth)
    if not 0.0 < half < frequency / 2:
        raise SignalError(f"half_bandwidth: must lie between 0 and half the line's frequency, got {half!r} Hz")
    line_filter = _LineFilter(rate, half)
    step, first = line_filter.step, line_filter.reach
    n = signal.sizes["time"]
    times = signal["time"].values
    if n < 2 * first + 1:
        raise SignalError(
            f"signal: has {n} samples, following the line needs at least {2 * first + 1}; "
            f"widen half_bandwidth ({half:g} Hz)"
        )
    best: tuple[float, int, np.ndarray] | None = None
    for channel, column in enumerate(signal.values.T):
        line = line_filter(column, frequency / rate)
        size = np.abs(line)
        level = float(np.sqrt(np.mean(size**2)))
        quality = float(np.percentile(size, 5.0)) / level if level > 0.0 else 0.0
        if best is None or quality > best[0]:
            best = (quality, channel, line)
    assert best is not None
    quality, channel, line = best
    slow = np.unwrap(np.angle(line))
    at = (first + step * np.arange(slow.size)) / rate
    if at.size < 4:
        raise SignalError(f"signal: {n / rate:g} s are too short to follow a line within {half:g} Hz")
    track = scipy.interpolate.CubicSpline(at, slow)
    last = first + step * (slow.size - 1)
    angle = np.empty(last + 1 - first)
    for start in range(0, angle.size, BLOCK):
        t = np.arange(first + start, first + min(start + BLOCK, angle.size)) / rate
        angle[start : start + t.size] = (2.0 * np.pi * frequency * t + track(t)) / order
    angle -= angle[0]
    if np.diff(angle).min() <= 0.0:
        raise SignalError("frequency: the line at this frequency is too weak to follow; give a tacho or the speed")
    result = _phase(times[first : last + 1], angle, "line")
    span = at[-1] - at[0]
    mean = float((2.0 * np.pi * frequency + ((slow[-1] - slow[0]) / span if span > 0.0 else 0.0)) / order)
    result.attrs.update(channel=str(signal["channel"].values[channel]), quality=quality, mean_speed=mean)
    return result


class _LineFilter:
    """Complex envelope of a line: shifted down to zero, low-passed without delay in two stages, and thinned out.

    The first stage, short, lowers the rate to some 64 times the half bandwidth, the second does the narrow work there.
    """

    def __init__(self, rate: float, half: float) -> None:
        self.coarse = max(1, int(rate / (64.0 * half)))
        slow = rate / self.coarse
        self.wide = (
            kaiser_taps(slow / 2, slow - 4.0 * half, rate, "lowpass", ATTENUATION_DB) if self.coarse > 1 else None
        )
        self.narrow = kaiser_taps(1.5 * half, half, slow, "lowpass", LINE_ATTENUATION_DB)
        self.fine = max(1, int(slow / (16.0 * half)))
        self.step = self.coarse * self.fine
        """Samples of the record between samples of the envelope."""
        lead = 0 if self.wide is None else self.wide.size // 2
        self.reach = lead + self.coarse * (self.narrow.size // 2)
        """Index in the record of the envelope's first sample, and as many samples as are lost at the end."""

    def __call__(self, column: np.ndarray, cycles: float) -> np.ndarray:
        """Envelope of the line at `cycles` per sample, complex; its phase counts from the first sample."""
        mean = column.mean()
        lead = 0 if self.wide is None else self.wide.size // 2
        count = column.size - 2 * lead
        block = max(1, BLOCK // self.coarse) * self.coarse
        pieces = []
        for start in range(0, count, block):
            stop = min(start + block, count) + 2 * lead
            shifted = (column[start:stop] - mean) * np.exp(-2j * np.pi * cycles * np.arange(start, stop))
            pieces.append(shifted if self.wide is None else _thinned(shifted, self.wide, self.coarse))
        return _thinned(np.concatenate(pieces), self.narrow, self.fine)


def _thinned(line: np.ndarray, taps: np.ndarray, step: int) -> np.ndarray:
    parts, _ = apply_zero_phase(np.stack((line.real, line.imag), axis=1), taps, "trim", step)
    return parts[:, 0] + 1j * parts[:, 1]


def instantaneous_speed(phase: xr.DataArray) -> xr.DataArray:
    """Speed (rad/s) over time, the derivative of the angle."""
    values = np.gradient(phase.values, phase["time"].values)
    return xr.DataArray(
        values, dims=("time",), coords={"time": phase["time"]}, attrs={"units": "rad/s", "long_name": "speed"}
    )


def analytic(column: np.ndarray) -> np.ndarray:
    """Analytic signal of a column (SciPy's Hilbert transform, at a fast length)."""
    return ss.hilbert(column, scipy.fft.next_fast_len(column.size))[: column.size]


def _phase(times: np.ndarray, angle: np.ndarray, origin: str) -> xr.DataArray:
    return xr.DataArray(
        angle,
        dims=("time",),
        coords={"time": ("time", times, {"units": "s"})},
        name="angle",
        attrs={"units": "rad", "origin": origin},
    )


# Pulses that are missing or too many.


class PulseFault(NamedTuple):
    """A place where pulses are missing or too many, from edge `first` to edge `last` (indices)."""

    first: int
    last: int
    spaces: int | None
    """Pitches between the two edges; None where their number cannot be told."""
    length: float
    """The same, as measured by the intervals on both sides."""

    @property
    def missing(self) -> int:
        """Pulses that are missing; negative for those too many."""
        return 0 if self.spaces is None else self.spaces - (self.last - self.first)


def pulse_faults(edges: np.ndarray, pulses_per_rev: float) -> list[PulseFault]:
    """Find where a train of pulses lacks some or has some too many.

    Intervals that differ from the median around them are compared with the straight line through the logarithms of up
    to three intervals on each side, which follows a run-up. Together they should take as many of those as there are of
    them; if it is another whole number, clearly beyond how the neighbours themselves scatter, pulses are missing or too
    many. What recurs with the wheel's revolution is its own pitch; of a wheel with uneven marks intervals are compared
    with those a turn away (`gearmbs.signals.rotation.uneven_marks`).

    Parameters
    ----------
    edges : ndarray, shape (n,)
        Times of the pulses, s.
    pulses_per_rev : float

    Returns
    -------
    list of PulseFault
        In order of time.
    """
    intervals = np.diff(edges)
    if intervals.size < FEWEST_BESIDE + 1:
        return []
    if pulses_per_rev == round(pulses_per_rev):
        uneven = uneven_faults(edges, int(pulses_per_rev))
        if uneven is not None:
            return [PulseFault(*place) for place in uneven]
    logs = np.log(np.maximum(intervals, 1e-300))
    deviation = logs - _median(logs, MEDIAN_REACH)
    odd = np.abs(deviation) > UNLIKE
    if pulses_per_rev == round(pulses_per_rev) and pulses_per_rev > 1:
        odd &= ~_own_pitch(deviation, int(pulses_per_rev))
    if not odd.any():
        return []
    bent = np.zeros_like(logs)
    bent[1:-1] = np.abs(logs[1:-1] - 0.5 * (logs[:-2] + logs[2:])) / math.sqrt(1.5)
    bent[0], bent[-1] = bent[1], bent[-2]
    found: list[PulseFault] = []
    for first, last in _runs(odd):
        # an extra pulse close to a right one leaves one short interval and one of nearly the full length
        options = [(first, last)]
        if intervals[first:last].sum() < math.exp(float(np.mean(logs[first:last] - deviation[first:last]))) * 0.7:
            options = [(first - 1, last), (first, last + 1)]
        judged = [j for a, b in options if (j := _judged(intervals, logs, bent, odd, a, b)) is not None]
        best = min(judged, key=lambda j: abs(j.length - round(j.length)), default=None)
        if best is not None and best.spaces != best.last - best.first and not (found and best.first < found[-1].last):
            found.append(best)
    return found


def mended_count(count: int, faults: list[PulseFault]) -> tuple[np.ndarray, np.ndarray]:
    """Return which of `count` pulses to keep, and their numbers in units of the pitch."""
    keep = np.ones(count, dtype=bool)
    step = np.ones(count - 1)
    for fault in faults:
        if fault.spaces is not None:
            keep[fault.first + 1 : fault.last] = False
            step[fault.first : fault.last] = 0.0
            step[fault.last - 1] = fault.spaces
    at = np.flatnonzero(keep)
    return at, np.r_[0.0, np.cumsum(step)][at]


def described(edges: np.ndarray, faults: list[PulseFault]) -> list[str]:
    """Say in words how many pulses are missing or too many and when, one sentence for each kind."""
    sentences = []
    missing, extra = [f for f in faults if f.missing > 0], [f for f in faults if f.missing < 0]
    for what, some in (("missing", missing), ("too many", extra)):
        if some:
            places = [f"{abs(f.missing)} between {edges[f.first]:.6g} and {edges[f.last]:.6g} s" for f in some]
            total = sum(abs(f.missing) for f in some)
            sentences.append(f"{total} pulse{'s are' if total > 1 else ' is'} {what}: {_listed(places)}. Mended.")
    unclear = [f for f in faults if f.spaces is None]
    if unclear:
        places = [f"from {edges[f.first]:.6g} to {edges[f.last]:.6g} s, {f.length:.3g} pitches" for f in unclear]
        sentences.append(
            f"{len(unclear)} interval{'s' * (len(unclear) > 1)} between pulses fit neither the pulses beside nor a "
            f"sure number of missing or extra ones: {_listed(places)}. Left as found; the angle may be whole pitches "
            "off from there on."
        )
    return sentences


def _listed(places: list[str]) -> str:
    more = f" and at {len(places) - LISTED} more places" if len(places) > LISTED else ""
    return ", ".join(places[:LISTED]) + more


def _judged(
    intervals: np.ndarray, logs: np.ndarray, bent: np.ndarray, odd: np.ndarray, first: int, last: int
) -> PulseFault | None:
    """Compare intervals `first` to `last` (exclusive) with those beside them; None if these cannot tell."""
    if first < 0 or last > intervals.size:
        return None
    left = [i for i in range(max(0, first - SIDE), first) if not odd[i]]
    right = [i for i in range(last, min(intervals.size, last + SIDE)) if not odd[i]]
    if not left or not right or len(left) + len(right) < FEWEST_BESIDE:
        return None
    beside = np.array(left + right)
    line = np.polynomial.Polynomial.fit(beside, logs[beside], 1)
    residual = float(np.abs(logs[beside] - line(beside)).max())
    inside = np.arange(first, last)
    # a course with a turning point between both sides needs the parabola, whose residuals say less of six points
    course = np.polynomial.Polynomial.fit(beside, logs[beside], 2) if min(len(left), len(right)) == SIDE else line
    pitch = float(np.exp(course(inside)).mean())
    length = float(intervals[first:last].sum()) / pitch
    near = slice(max(0, first - SCATTER_REACH), last + SCATTER_REACH)
    scatter = 1.4826 * float(np.median(bent[near]))
    excess = abs(math.log(length / inside.size))
    if excess < CLEAR_OF_SIDES * residual or excess < CLEAR_OF_SCATTER * scatter:
        return None
    spaces: int | None = round(length)
    whole = abs(length - round(length)) <= WHOLE and spaces
    missing = round(length) - inside.size
    # what the neighbours leave open of one pitch adds up over those of a gap
    if not whole or (missing + 1) * residual > 2.0 * WHOLE or missing > MOST_MISSING:
        if excess < UNCLEAR:
            return None
        spaces = None
    return PulseFault(first, last, spaces, length)


def _own_pitch(deviation: np.ndarray, teeth: int) -> np.ndarray:
    """Return which intervals recur in the revolutions beside them, as those of an uneven wheel do.

    By chance a lost pulse is one revolution apart from another one, or from a mark that is not there; of a wheel at
    least two of the four nearest revolutions are alike, even where a fault shifts the count of those beyond it.
    """
    alike, beside = np.zeros(deviation.size, dtype=int), np.zeros(deviation.size, dtype=int)
    for apart in (teeth, 2 * teeth):
        if deviation.size > apart:
            same = np.abs(deviation[apart:] - deviation[:-apart]) < SAME_WHEEL
            for there in (slice(apart, None), slice(None, -apart)):
                alike[there] += same
                beside[there] += 1
    return (beside > 0) & (alike >= np.minimum(beside, RECURRING))


def _median(values: np.ndarray, reach: int) -> np.ndarray:
    """Return the median over `reach` values on each side, of fewer where the record ends, as many on both sides."""
    n = values.size
    wide = min(reach, (n - 1) // 2)
    out = values.copy()
    if wide:
        windows = np.lib.stride_tricks.sliding_window_view(values, 2 * wide + 1)
        out[wide : n - wide] = np.median(windows, axis=1)
    for k in range(wide):
        # towards an end the last full window has to do; beside it a fault cannot be told from a change of speed
        out[k], out[n - 1 - k] = np.median(values[: k + wide + 1]), np.median(values[n - 1 - k - wide :])
    return out


def _runs(odd: np.ndarray) -> list[tuple[int, int]]:
    """Return the stretches of odd values, those with one value between them as one, ends exclusive."""
    at = np.flatnonzero(odd)
    breaks = np.flatnonzero(np.diff(at) > 2)
    return [(int(a), int(b) + 1) for a, b in zip(at[np.r_[0, breaks + 1]], at[np.r_[breaks, at.size - 1]])]
