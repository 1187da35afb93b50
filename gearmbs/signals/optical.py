"""Records of instruments that do not touch: drop-outs of lasers bridged and told, tracks of cameras as motion.

A vibrometer loses its signal where speckles go dark: for a few samples it shows its range, a spike or its last value.
What lies between is bridged by linear prediction from both sides. What recurs with each turn of the shaft, because the
same speckles pass the beam again, cannot be told from vibration at whole orders by one record; `turn_floor` says how
large it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Unpack

import numpy as np
import scipy.linalg
import scipy.ndimage
import scipy.signal as ss
import xarray as xr

from gearmbs.progress import waiting
from gearmbs.signals.encoders.estimate import amplitude_interval
from gearmbs.signals.errors import SignalError
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.shapes import alone_far_off
from gearmbs.signals.signal.signal import like, rate_of, units_of
from gearmbs.signals.signal.units import DIMENSIONS, unit_dimension
from gearmbs.units import Quantity, to_si

FEWEST_BLOWS = 8
"""Spikes among which some are looked for that recur."""
UNEVEN, SKIPPED = 0.015, 3
"""Part by which the time between blows may differ (swings of the speed, slip of bearings), and how many others, of a
second defect or of light that fails, may stand between."""
SHORTEST = 16
"""Samples after which spikes may recur, at least: pieces of one drop-out are nearer to each other."""
MEMORY = 100
"""Samples from which the next is predicted: three periods of a mesh line at 30 samples each."""
ROUNDS = 3
"""Predictions from the bridged record: after the third the bridges change by less than a thousandth."""
MOST_LOST = 0.2
"""Share of a record that may be bridged: above, the prediction has too little to learn from."""
SPIKE = 10.0
"""Robust standard deviations of the prediction's error from which a sample is a spike: of noise one in 1e23 is. Shocks
of bearings and of broken teeth ring, so that only their first samples come near."""
SUSPECT = 0.3
"""Robust standard deviations of the record itself by which a spike must surprise, too: in records without noise all
that is not a tone does."""
CLEAR_OF_VIBRATION = 3.0
"""Robust standard deviations of the record by which a spike must be off the bridge: peaks of vibration are two or
three."""
ABRUPT = 0.3
"""Share of a spike's largest deviation that there is at its end: a shock rings down."""
RING = 2
"""Samples to either side of a lost one that are bridged with it: filters behind the demodulator smear it."""
PASSES = 6
"""Searches for spikes, each in the record with those before bridged."""
HELD = 8
"""Equal samples in a row that are a value held, where the record otherwise changes from sample to sample."""
HELD_SURPRISES = 2
"""Equal neighbours among samples that neither side predicts, which are no chance."""
FLAT, FLAT_TOPS = 3, 3
"""Equal samples in a row at the end of a range, and stretches of them, that are no chance."""
SAME = 1e-9
"""Part of a record's range within which samples are equal: a sixtieth of a converter's step at 24 bits."""
FLAT_SHARE = 6.0
"""How many times as many samples are at the highest value as a step below, or at any other: of a sine in steps it is
2.4. So seven samples tell of a range, where no other value recurs."""
COARSE = 64
"""Values of a record below which it may stand at one because vibration is flat within a step: at the end of a range it
is cut off at some slope."""
ISLAND = 3
"""Half the samples between two lost ones that are bridged with them: a bridge that has to lead through one wrong sample
follows it."""
AT_RANGE = 0.98
"""Share of the range from which a sample is over it."""
FAR_BELOW = 0.5
"""Part of the range below which all else stays where a record shows its range in drop-outs alone."""
REGULARISED = 1e-9
"""White noise by the record's power with which prediction is learnt: a pure tone would leave it open."""
BESIDE = 2
"""Shaft orders next to a mesh order that are left out of the floor: modulation by the shaft is there."""
FEWEST_ORDERS = 8
"""Orders beside a mesh order whose median says something of chance."""


@takes_data()
@waiting("bridging drop-outs")
def repair_vibrometer(
    signal: Any,
    *,
    full_scale: Quantity | None = None,
    level: str | None = None,
    least_level: float | None = None,
    spikes: float | None = SPIKE,
    **_data: Unpack[DataKeywords],
) -> xr.DataArray:
    """Bridge the drop-outs of a laser vibrometer, and say how many there were.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    full_scale : float or str, optional
        Range of the instrument, in the signal's unit or with one: samples at it are lost. Default: the value at which a
        record stands as no vibration does, where all else stays below half of it and spikes are looked for.
    level : str, optional
        Channel with the strength of the light, which is left out of the result; samples at which it is below
        `least_level`, by default a fifth of its median, are lost.
    least_level : float, optional
    spikes : float, optional
        Robust standard deviations of the error of linear prediction from which a sample is a spike; None for none, as
        in records of shocks.

    Returns
    -------
    xarray.DataArray
        The channels but `level`; attribute ``lost``, the share of samples bridged by channel, and a line of ``notes``.

    Raises
    ------
    SignalError
        If more than a fifth of a channel is lost, or beyond `full_scale`.
    """
    names = [str(c) for c in signal["channel"].values]
    if level is not None and (level not in names or len(names) < 2):
        raise SignalError(f"level: there is no channel {level!r} beside others, only {names}")
    kept = [name for name in names if name != level]
    dark = np.zeros(signal.sizes["time"], dtype=bool)
    if level is not None:
        strength = signal.values[:, names.index(level)]
        dark = strength < (0.2 * float(np.median(strength)) if least_level is None else least_level)
    rate, notes, shares = rate_of(signal), list(signal.attrs.get("notes", ())), []
    columns = []
    for name in kept:
        column = signal.values[:, names.index(name)]
        bound = None if full_scale is None else _in_unit(full_scale, units_of(signal)[names.index(name)])
        lost, found, again = _lost(column, dark, bound, spikes)
        notes += [_recurring_said(name, one, rate) for one in again]
        share = float(lost.mean())
        over = float(found["over the range"].mean())
        if over > MOST_LOST:
            unit = units_of(signal)[names.index(name)]
            raise SignalError(
                f"full_scale: {100 * over:.3g} % of {name!r} is at or beyond {full_scale!r}, its largest value is "
                f"{float(np.abs(column).max()):.4g} {unit}; give the range of the instrument at its setting, with its "
                "unit, or leave full_scale out"
            )
        if share > MOST_LOST:
            raise SignalError(
                f"signal: {100 * share:.3g} % of {name!r} is lost, more than {100 * MOST_LOST:g} % can be bridged; "
                "focus the laser, use reflecting tape or a larger range"
            )
        if bound is None and (top := flat_top(column[~lost])) is not None:
            limit, count = top
            unit = units_of(signal)[names.index(name)]
            notes.append(
                f"CLIPPED: {name} stands at {limit:.6g} {unit} in {count} samples that are not bridged, as where a "
                f"range is exceeded; its levels are wrong. Give full_scale='{abs(limit):.6g} {unit}' to bridge them, "
                "or take a larger range."
            )
        shares.append(share)
        columns.append(_bridged(column, lost))
        if lost.any():
            notes.append(f"{name}: {_told(lost, found, rate)}, bridged by linear prediction.")
    at = [names.index(name) for name in kept]
    result = like(
        signal, np.stack(columns, axis=1), channels=kept, units=[units_of(signal)[k] for k in at], lost=shares
    )
    return result.assign_attrs(notes=notes) if notes else result


def _lost(
    column: np.ndarray, dark: np.ndarray, bound: float | None, spikes: float | None
) -> tuple[np.ndarray, dict[str, np.ndarray], list[_Recurring]]:
    """Return which samples of a channel are lost with their neighbours, which were found by what, and what recurs."""
    if bound is None and spikes is not None:
        bound = _shown_range(column)
    found = {
        "dark": dark,
        "over the range": np.zeros_like(dark) if bound is None else np.abs(column) >= AT_RANGE * bound,
        "held": _held(column),
    }
    told = np.any(list(found.values()), axis=0)
    lost = _widened(told)
    known = _widened(lost)
    found["spikes"] = np.zeros_like(dark)
    for _ in range(PASSES):
        if spikes is None or lost.mean() > MOST_LOST:
            break
        more = _spikes(_bridged(column, lost), lost, known, spikes) & ~lost
        if not more.any():
            break
        found["spikes"] |= more
        told |= more
        lost = _widened(told)
    again, spared = _recurring(column, found["spikes"], lost)
    if again:
        found["spikes"] &= ~spared
        lost = _widened(np.any(list(found.values()), axis=0))
    return lost, found, again


def _shown_range(column: np.ndarray) -> float | None:
    """Return the range that a record stands at in drop-outs, where these are far off all else, or None.

    A vibration that exceeds the range comes near it from below.
    """
    top = flat_top(column)
    if top is None:
        return None
    at = np.abs(column) >= AT_RANGE * abs(top[0])
    middle = float(np.median(column[~at])) if not at.all() else 0.0
    rest = np.abs(column[~_widened(at)] - middle)
    far = rest.size > 0 and float(rest.max()) < FAR_BELOW * abs(top[0] - middle) and at.mean() <= MOST_LOST
    return abs(top[0]) if far else None


class _Recurring(NamedTuple):
    """Spikes that recur: how many, after how many samples, and how high."""

    number: int
    period: float
    height: float


def _recurring(column: np.ndarray, spikes: np.ndarray, lost: np.ndarray) -> tuple[list[_Recurring], np.ndarray]:
    """Return families of spikes that recur, as blows do and light that fails by chance does not, and their samples."""
    families: list[_Recurring] = []
    spared = np.zeros_like(spikes)
    places = _stretches(spikes)
    if len(places) < FEWEST_BLOWS:
        return families, spared
    off = column - _bridged(column, lost)
    at = np.array([a + int(np.argmax(np.abs(off[a:b]))) for a, b in places])
    rest = np.arange(at.size)
    while rest.size >= FEWEST_BLOWS:
        own, period = _family(at[rest])
        # of chance 2 x 3 lags x 2 x UNEVEN = 0.18 n have another one there, with a scatter of some roots of n
        if own.sum() < 0.3 * rest.size + 1.5 * math.sqrt(rest.size):
            break
        families.append(_Recurring(int(own.sum()), period, float(np.mean(off[at[rest[own]]]))))
        for k in rest[own]:
            spared[slice(*places[k])] = True
        rest = rest[~own]
    return families, spared


def _family(at: np.ndarray) -> tuple[np.ndarray, float]:
    """Return which spikes have another one a period before or behind, and the period by which most do, in samples.

    The period is the same for the whole record, or that of two intervals one behind the other, as in run-ups.
    """
    n = at.size
    pairs = [(k, np.arange(n - k), at[k:] - at[:-k]) for k in range(1, SKIPPED + 1)]
    lags = np.sort(np.concatenate([lag for *_, lag in pairs]))
    lags = lags[lags > SHORTEST]
    if not lags.size:
        return np.zeros(n, dtype=bool), math.nan
    many = np.searchsorted(lags, lags * (1.0 + UNEVEN), side="right") - np.searchsorted(lags, lags * (1.0 - UNEVEN))
    period = float(lags[int(np.argmax(many))])
    own = np.zeros(n, dtype=bool)
    for k, first, lag in pairs:
        near = first[np.abs(lag - period) <= max(UNEVEN * period, 1.0)]
        own[near] = own[near + k] = True
    between = np.diff(at)
    alike = np.abs(np.diff(between)) <= np.maximum(UNEVEN * between[1:], 1.0)
    even = np.flatnonzero(alike & (between[1:] > SHORTEST))
    running = np.zeros(n, dtype=bool)
    for k in range(3):
        running[even + k] = True
    return (running, float(np.median(between))) if running.sum() > own.sum() else (own, period)


def _recurring_said(name: Any, again: _Recurring, rate: float) -> str:
    return (
        f"{name}: {again.number} spikes recur every {again.period / rate:.6g} s, {again.height:.3g} high "
        "on average: blows do, and dark places of a turning shaft; they are left as they are. Of the latter a "
        "full_scale below them (--full-scale) bridges them."
    )


def _told(lost: np.ndarray, found: dict[str, np.ndarray], rate: float) -> str:
    """Return how many drop-outs there are, in words."""
    longest = max(b - a for a, b in _stretches(lost)) / rate
    kinds = ", ".join(f"{len(_stretches(where))} {kind}" for kind, where in found.items() if where.any())
    return (
        f"{len(_stretches(lost))} drop-outs ({kinds}), {100 * float(lost.mean()):.3g} % of the record, the longest "
        f"{1e3 * longest:.3g} ms"
    )


def instrument_faults(signal: xr.DataArray, beside: Sequence[str] = ()) -> list[str]:
    """Return remarks on what instruments did to a record that nobody has mended: its tops cut off, drop-outs left.

    Drop-outs are looked for in velocities, as of lasers, that `repair_vibrometer` has not seen. A record that ends at
    exactly zero on one side, as a contact force does, is not taken for cut off. Channels `beside` hold no vibration.
    """
    remarks = []
    seen = "lost" in signal.attrs
    for name, unit, column in zip(signal["channel"].values, units_of(signal), signal.values.T, strict=True):
        if str(name) in beside:
            continue
        if (odd := alone_far_off(column)) is not None:
            at, count, times = odd
            remarks.append(
                f"CHECK THE RECORD: {name} is {column[at]:g} {unit} at {float(signal['time'].values[at]):.6g} s "
                f"(sample {at + 1}), {times:.2g} times as far from the rest as that scatters"
                + (f", and {count - 1} more are so" if count > 1 else "")
                + ", as where a logger writes a value for one that is missing: its levels are wrong by it. Leave it "
                "empty in the file and pass gaps='interpolate' (--gaps interpolate)."
            )
        fast = _known_unit(unit) and unit_dimension(unit)[0] == "velocity"
        drops = fast and not seen and _shown_range(column) is not None
        if not drops and (top := flat_top(column)) is not None and top[0] != 0.0:
            limit, count = top
            remarks.append(
                f"CLIPPED: {name} stands at {limit:.6g} {unit} in {count} samples, as where a range is exceeded: its "
                "levels are wrong, and its harmonics not only its own. Measure with a larger range."
            )
        if seen or not fast or np.ptp(column) == 0.0:
            continue
        lost, found, again = _lost(column, np.zeros(column.size, dtype=bool), None, SPIKE)
        remarks += [_recurring_said(name, one, rate_of(signal)) for one in again]
        if lost.any():
            remarks.append(
                f"DROP-OUTS: {name} has {_told(lost, found, rate_of(signal))}, as lasers have; all levels are wrong by "
                "them. Bridge them with repair_vibrometer (--repair), unless they are blows."
            )
    return remarks


def flat_top(column: np.ndarray) -> tuple[float, int] | None:
    """Return the highest or lowest value and its count, where a record stands at it as no vibration does, or None.

    Far more samples must be there than at any other value of the upper half: of a vibration that repeats itself each
    value recurs. If there are several stretches of equal samples, far more than a step below do, too: vibration cut to
    coarse steps has stretches at its peaks, but nearly as many samples one step below.
    """
    near = SAME * float(np.ptp(column))
    if near == 0.0 or max(np.sum(column >= column.max() - near), np.sum(column <= column.min() + near)) <= FLAT_SHARE:
        return None
    whole = np.round(column / near)
    for sign in (1.0, -1.0):
        x = sign * whole
        top = float(x.max())
        at = x == top
        values, counts = np.unique(x[~at], return_counts=True)
        if not values.size:
            continue
        upper = counts[values > 0.5 * (top + float(np.median(x)))]
        others = int(upper.max(initial=1))
        if sum(b - a >= FLAT for a, b in _stretches(at)) >= FLAT_TOPS:
            step = min(top - values[-1], float(np.diff(values).min(initial=np.inf)))
            others = int(counts[values >= top - 1.5 * step].sum())
        if np.count_nonzero(at) > FLAT_SHARE * others and not _crept_up(x, at, values, top):
            return float(column[at][0]), int(np.count_nonzero(at))
    return None


def _crept_up(x: np.ndarray, at: np.ndarray, values: np.ndarray, top: float) -> bool:
    """Return whether a record of few values comes to its highest by the next one below: flat within one step of it."""
    if values.size >= COARSE:
        return False
    before = np.flatnonzero(at[1:] & ~at[:-1])
    after = np.flatnonzero(at[:-1] & ~at[1:]) + 1
    beside = np.concatenate((x[before], x[after]))
    return bool(beside.size) and float(np.mean(beside == values[-1])) > 0.5 and top - values[-1] <= 1.5 * float(
        np.diff(values).min(initial=np.inf)
    )  # fmt: skip


def _known_unit(unit: str) -> bool:
    """Return whether a unit is one of motion or force."""
    try:
        return bool(unit_dimension(unit)[0])
    except SignalError:
        return False


def _in_unit(bound: Quantity, unit: str) -> float:
    """Return a bound in a channel's unit."""
    if not isinstance(bound, str):
        return float(bound)
    dimension, factor = unit_dimension(unit)
    return to_si(bound, DIMENSIONS[dimension], "full_scale") / factor


def _held(column: np.ndarray) -> np.ndarray:
    """Return which samples repeat the one before, `HELD` and more in a row."""
    same = np.concatenate(([False], np.diff(column) == 0.0))
    if same.mean() > MOST_LOST:
        return np.zeros(column.size, dtype=bool)
    out = np.zeros(column.size, dtype=bool)
    for first, last in _stretches(same):
        if last - first >= HELD - 1:
            out[first:last] = True
    return out


def _widened(lost: np.ndarray) -> np.ndarray:
    """Return what is lost with its neighbours, and what few samples lie between two of them."""
    wide = scipy.ndimage.binary_dilation(lost, iterations=RING)
    return wide | scipy.ndimage.binary_closing(wide, iterations=ISLAND)


def _stretches(flags: np.ndarray) -> list[tuple[int, int]]:
    """Return first and last (exclusive) of the stretches that are set."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2])]


def _prediction(column: np.ndarray) -> np.ndarray:
    """Return the filter that leaves of a column what its past does not tell, by the Yule-Walker equations."""
    x = column - column.mean()
    memory = min(MEMORY, x.size // 4)
    spectrum = np.abs(np.fft.rfft(x, 2 * x.size)) ** 2
    correlation = np.fft.irfft(spectrum)[: memory + 1] / x.size
    if correlation[0] == 0.0:
        return np.ones(1)
    correlation[0] *= 1.0 + REGULARISED
    return np.concatenate(([1.0], -scipy.linalg.solve_toeplitz(correlation[:-1], correlation[1:])))


def _spikes(column: np.ndarray, lost: np.ndarray, told: np.ndarray, bound: float) -> np.ndarray:
    """Return samples that are spikes: predicted from neither side, and far from where a bridge over them leads.

    Those beside what is lost are told from one side: from the other a bridge leads up to them. A step of the
    vibration itself, the onset of a shock, surprises one side only; a kink surprises both, but a bridge comes near
    it. Values held for less than `HELD` samples are taken for spikes if they surprise.
    """
    taps = _prediction(np.clip(column, *np.percentile(column, [0.1, 99.9])))
    x = column - column.mean()
    errors = []
    for forth in (True, False):
        error = np.abs(ss.lfilter(taps, [1.0], x if forth else x[::-1]))
        error[: taps.size] = np.nan
        errors.append(error if forth else error[::-1])
    both, beside = np.fmin(*errors), _widened(_widened(lost))
    own = 1.4826 * float(np.median(np.abs(x - np.median(x))))
    least = max(bound * 1.4826 * float(np.median(both)), SUSPECT * own)
    suspect = (both > least) | ((np.fmax(*errors) > least) & beside)
    wide = _widened(suspect) | lost
    if wide.mean() > MOST_LOST:
        # vibration that stands still between its bursts is predicted too well there
        return both > CLEAR_OF_VIBRATION * own
    off, same = np.abs(column - _bridged(column, wide)), np.diff(column, prepend=np.nan) == 0.0
    for first, last in _stretches(wide):
        part, held = off[first:last], np.count_nonzero(same[first:last]) >= HELD_SURPRISES
        end = part[part > own][-RING - 1 :].max(initial=0.0)
        rings = end < ABRUPT * part.max() and last < x.size and not told[first:last].any()
        if not held and (part.max() < CLEAR_OF_VIBRATION * own or rings):
            suspect[first:last] = False
    return suspect


def _bridged(column: np.ndarray, lost: np.ndarray) -> np.ndarray:
    """Return a column with lost samples such that the error of linear prediction is least.

    References
    ----------
    .. [1] A. Janssen, R. Veldhuis, L. Vries, Adaptive interpolation of discrete-time signals that can be modeled as
       autoregressive processes, IEEE Trans. Acoustics, Speech, and Signal Processing 34 (1986) 317-330.
    """
    if not lost.any():
        return column
    mean = float(column[~lost].mean())
    at, known = np.flatnonzero(lost), np.flatnonzero(~lost)
    x = column - mean
    x[at] = np.interp(at, known, x[known])
    for _ in range(ROUNDS):
        taps = _prediction(x)
        memory = taps.size - 1
        b = np.correlate(taps, taps, mode="full")
        rest = np.where(lost, 0.0, x)
        pull = ss.oaconvolve(rest, b, mode="same")[at]
        # gaps farther apart than the memory do not know of each other
        groups = np.split(np.arange(at.size), np.flatnonzero(np.diff(at) > memory) + 1)
        for group in groups:
            place = at[group]
            # of sorted places those within the memory are a band, so that long groups cost by their length
            width = int((np.searchsorted(place, place + memory, side="right") - 1 - np.arange(place.size)).max())
            band = np.zeros((width + 1, place.size))
            for k in range(width + 1):
                apart = place[k:] - place[: place.size - k]
                band[width - k, k:] = np.where(apart <= memory, b[np.minimum(apart, memory) + memory], 0.0)
            x[place] = scipy.linalg.solveh_banded(band, -pull[group])
    return x + mean


# What recurs with each turn, and tracks of points.


def turn_floor(
    average: xr.DataArray, teeth: int, harmonics: int = 3, probability: float = 0.95
) -> dict[str, np.ndarray]:
    """RMS of mesh harmonics in an average over one turn, with the interval that the orders beside them leave.

    Speckle, marks and whatever else recurs with the shaft is at mesh orders as large as beside them, by chance with or
    against the vibration.

    Parameters
    ----------
    average : xarray.DataArray
        Over one turn (`time_synchronous_average`), dimensions (angle, channel).
    teeth : int
    harmonics : int
    probability : float

    Returns
    -------
    dict
        "rms", "low", "high", "floor" (RMS of a line beside), each of shape (harmonics, channels); NaN where the average
        has too few orders.
    """
    count = average.sizes["angle"]
    lines = 2.0 * np.abs(np.fft.rfft(average.values, axis=0)) / count
    shape = (harmonics, average.sizes["channel"])
    out = {name: np.full(shape, np.nan) for name in ("rms", "low", "high", "floor")}
    for h in range(1, harmonics + 1):
        mesh = h * teeth
        beside = np.arange(math.ceil((h - 0.5) * teeth), math.floor((h + 0.5) * teeth) + 1)
        beside = beside[(np.abs(beside - mesh) > BESIDE) & (beside < 0.4 * count) & (beside > BESIDE)]
        if beside.size < FEWEST_ORDERS or mesh >= 0.4 * count:
            continue
        for c in range(shape[1]):
            # squares of lines of chance have the median 2 ln 2 times the variance of each part
            variance = float(np.median(lines[beside, c] ** 2)) / (2.0 * math.log(2.0))
            size = float(lines[mesh, c])
            low, high = amplitude_interval(size, variance, float(beside.size), probability)
            values = (size, low, high, math.sqrt(2.0 * variance))
            for name, value in zip(out, values):
                out[name][h - 1, c] = value / math.sqrt(2.0)
    return out


PIXELS = ("px", "pix", "pixel", "pixels")
"""As programs that follow points write the unit of their tracks."""


@takes_data()
def point_track(
    signal: Any,
    scale: Quantity,
    *,
    direction: Sequence[float] | None = None,
    name: str = "camera",
    **_data: Unpack[DataKeywords],
) -> xr.DataArray:
    """Displacement of a point that a camera has followed.

    Parameters
    ----------
    signal : xarray.DataArray
        Places in pixels, dimensions (time, channel), a frame each.
    scale : float or str
        Length of a pixel in the plane of the point, m.
    direction : sequence of float, optional
        Components along the channels of the direction that is wanted; default: all channels as they are.
    name : str
        Of the channel along it.

    Returns
    -------
    xarray.DataArray
        m, without the mean. Frames are taken at instants: what moves faster than half their rate is folded down, which
        a light exposure does not prevent.
    """
    length = to_si(scale, "length", "scale")
    if not 0.0 < length < math.inf:
        raise SignalError(f"scale: must be the positive length of a pixel in m, got {scale!r}")
    others = (unit for unit in units_of(signal) if unit.lower() not in PIXELS and _known_unit(unit))
    if (unit := next(others, None)) is not None:
        raise SignalError(
            f"units: the track is in {unit}, not in pixels; leave point_track (--pixel) out, or set its unit to 'pixel'"
        )
    values = length * (signal.values - signal.values.mean(axis=0))
    if direction is None:
        return like(signal, values, units="m")
    along = np.asarray(direction, dtype=float)
    size = float(np.linalg.norm(along)) if along.shape == (values.shape[1],) else 0.0
    if not (math.isfinite(size) and size > 0.0):
        raise SignalError(f"direction: must have a component for each of {values.shape[1]} channels, got {direction!r}")
    return like(signal, (values @ along / size)[:, None], channels=[name], units="m")
