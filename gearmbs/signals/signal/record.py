"""What a file says about a signal, before it becomes one: the meeting point of all readers and writers."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import xarray as xr

from gearmbs.files import json_value
from gearmbs.signals.errors import MissingMetadataError, SignalError, SignalFileError
from gearmbs.signals.signal.labels import RPM_UNITS, key_of, may_be_times, rises_evenly
from gearmbs.signals.signal.shapes import is_missing
from gearmbs.signals.signal.signal import (
    ROUNDED_TIMES,
    SHAFT,
    check_teeth,
    make_signal,
    rate_of,
    shaft_coords,
    uniform_rate,
    units_of,
)
from gearmbs.signals.signal.times import SECONDS as OF_TIMES
from gearmbs.signals.signal.times import seconds_of
from gearmbs.signals.signal.units import detected_unit

# What headers say, by the names that real files use: sampling rates and speeds, and which to believe.


RATE_NAMES = frozenset(
    (
        "samplingrate samplerate samplingfrequency samplefrequency samplingfreq samplefreq sampfreq samprate fs fsamp "
        "fsample fsampling sr sf scanrate acquisitionrate daqrate samplespersecond samplespersec sps abtastrate "
        "abtastfrequenz frequencysampling samplehz samplerateinhz ratehz hz messrate vzorkovacifrekvence vzorkovani "
        "frequencedechantillonnage frequencedechant fech tauxdechantillonnage"
    ).split()
)
WEAK_RATE_NAMES = frozenset({"rate"})
"""Names that mean the sampling rate in some files and the shaft's in others: a better name beside them wins."""
STEP_NAMES = frozenset(
    (
        "xinc xincrement xincr xdelta dx deltax dt deltat deltatime tinterval timestep timeincrement timeinterval "
        "wfincrement "
        "sampleinterval samplinginterval sampleperiod samplingperiod samplingtime tsample tsamp abtastintervall "
        "abtastzeit abtastschritt zeitschritt periodavzorkovani vzorkovaciperioda periodedechantillonnage pasdetemps"
    ).split()
)
SPEED_NAMES = frozenset(
    (
        "speed rpm shaftspeed rotationalspeed rotationspeed rotatingspeed motorspeed inputspeed drehzahl n shaftrpm "
        "wellendrehzahl motordrehzahl otacky otackymotoru otackyhridele vitesse vitessederotation vitessearbre"
    ).split()
)
SHAFT_FREQUENCIES = frozenset(
    "shaftrate shaftfrequency rotationfrequency rotationalfrequency rotfreq fr shafthz".split()
)
PER_SECOND = {
    "": 1.0, "hz": 1.0, "khz": 1e3, "mhz": 1e6, "1/s": 1.0, "s/s": 1.0, "ks/s": 1e3, "samples/s": 1.0, "sa/s": 1.0,
    "samples/sec": 1.0, "samples/second": 1.0, "sps": 1.0, "ksps": 1e3, "s^-1": 1.0,
}  # fmt: skip
SECONDS = {"": 1.0} | {word: factor for word, factor in OF_TIMES.items() if factor <= 1.0}
NUMBER = re.compile(r"^\s*([-+]?\d+(?:[.,]\d*)?(?:[eE][-+]?\d+)?)\s*[\[(]?\s*([A-Za-zµ/^\-0-9.]*)")
AGREE = 1e-3
"""Relative difference up to which two rates or speeds in a file are one: headers round to three or four digits."""
PLAUSIBLE_RPM = (1.0, 200_000.0)
STEM = re.compile(r"[_.\s-]*(header|data|info|signal|values|samples|properties)$", re.IGNORECASE)


@dataclass(frozen=True)
class RateCandidate:
    """A sampling rate that a file may mean: the name it stands under, Hz, and whether the name may mean another."""

    name: str
    rate: float
    weak: bool = False

    def __str__(self) -> str:
        return f"{self.name} = {self.rate:g} Hz"


def number_of(value: Any) -> tuple[float, str] | None:
    """A header's value as a number and its unit; None for what is no number."""
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, (int, float, np.number)):
        return float(value), ""
    if isinstance(value, np.ndarray):
        return number_of(value.reshape(-1)[0].item()) if value.size == 1 and value.dtype.kind in "fiuSU" else None
    if isinstance(value, bytes):
        value = value.decode("utf-8", errors="replace")
    if not isinstance(value, str):
        return None
    found = NUMBER.match(value.strip(" \t\"',;:="))
    if found is None:
        return None
    digits = found.group(1)
    if re.fullmatch(r"[-+]?\d{1,3}(,\d{3})+", value.strip(" \t\"';:=").split(" ")[0]):
        digits = value.strip(" \t\"';:=").split(" ")[0].replace(",", "")
    return float(digits.replace(",", ".")), found.group(2)


def rate_candidates(header: Mapping[str, Any]) -> list[RateCandidate]:
    """The sampling rates that a header may mean, better names first."""
    found = []
    for name, value in header.items():
        key, unit = key_of(str(name))
        number = number_of(value)
        if number is None or not math.isfinite(number[0]) or number[0] <= 0.0:
            continue
        unit = (number[1] or unit).lower()
        if key in RATE_NAMES or key in WEAK_RATE_NAMES:
            if unit in PER_SECOND:
                found.append(RateCandidate(str(name), number[0] * PER_SECOND[unit], key in WEAK_RATE_NAMES))
            elif unit in SECONDS:
                found.append(RateCandidate(str(name), 1.0 / (number[0] * SECONDS[unit]), True))
        elif key in STEP_NAMES and unit in SECONDS:
            found.append(RateCandidate(str(name), 1.0 / (number[0] * SECONDS[unit])))
    return sorted(found, key=lambda candidate: candidate.weak)


def chosen_rate(
    path: Path, candidates: Sequence[RateCandidate], given: float | None = None
) -> tuple[float | None, list[str]]:
    """The sampling rate that a file means, and what is to be said about it.

    Raises
    ------
    SignalFileError
        If the file names two that disagree and the caller (`given`, Hz) none of them.
    """
    if not candidates:
        return None, []
    sure = [candidate for candidate in candidates if not candidate.weak] or list(candidates)
    distinct: list[RateCandidate] = []
    for candidate in sure:
        if all(abs(candidate.rate / other.rate - 1.0) > AGREE for other in distinct):
            distinct.append(candidate)
    if len(distinct) > 1:
        listed = " and ".join(str(candidate) for candidate in distinct[:4])
        if given is None:
            raise SignalFileError(
                path, f"names two sampling rates that disagree, {listed}; say which: rate=... (--rate)"
            )
        return given, [f"The file names {listed}; the rate given, {given:g} Hz, is used."]
    first = distinct[0]
    if given is not None and first.weak and abs(given / first.rate - 1.0) > AGREE:
        return given, [
            f"The file's {first.name} = {first.rate:g} is not taken for the sampling rate; {given:g} Hz is given."
        ]
    others = [c for c in candidates if c.weak and c not in sure and abs(c.rate / first.rate - 1.0) > AGREE]
    notes = [
        f"The sampling rate is {first}; {other.name} = {other.rate:g} is something else. If it is the shaft's speed in "
        f"Hz, say so: speed='{other.rate:g} Hz' (--speed \"{other.rate:g} Hz\")."
        for other in others
    ]
    return first.rate, notes


def own_header(header: Mapping[str, Any], channel: str) -> dict[str, Any]:
    """The part of a header that speaks of a channel: what stands beside it or above it, or else all of it."""
    beside = {k: v for k, v in header.items() if k.rpartition(".")[0] == channel}
    if rate_candidates(beside):
        return beside
    prefix = channel.rpartition(".")[0]
    above = {k: v for k, v in header.items() if prefix == k.rpartition(".")[0] or not k.rpartition(".")[0]}
    if rate_candidates(above):
        return above
    above = {k: v for k, v in header.items() if prefix.startswith(k.rpartition(".")[0])}
    if rate_candidates(above):
        return above
    stem = STEM.sub("", channel)
    beside = {k: v for k, v in header.items() if STEM.sub("", k.rpartition(".")[0]) == stem}
    return beside if rate_candidates(beside) else dict(header)


def speed_of(header: Mapping[str, Any]) -> tuple[float | None, list[str]]:
    """The shaft's speed (rad/s) that a header names with its unit, and what is to be said about it."""
    found: list[tuple[str, float]] = []
    unclear = []
    for name, value in header.items():
        key, unit = key_of(str(name))
        number = number_of(value)
        if number is None or not math.isfinite(number[0]) or number[0] <= 0.0:
            continue
        unit = (number[1] or unit).lower()
        if key in SHAFT_FREQUENCIES and unit in ("", "hz", "1/s"):
            found.append((str(name), number[0] * math.tau))
        elif key.endswith("rpm") or (key in SPEED_NAMES and unit in RPM_UNITS):
            found.append((str(name), number[0] * math.pi / 30.0))
        elif key in SPEED_NAMES and unit in ("hz", "1/s"):
            found.append((str(name), number[0] * math.tau))
        elif key in SPEED_NAMES and unit == "rad/s":
            found.append((str(name), number[0]))
        elif key in SPEED_NAMES and key != "n" and str(name) != "speed":
            unclear.append(f"{name} = {number[0]:g} has no unit; pass speed='{number[0]:g} rpm' if it is in rpm.")
    found = [(n, s) for n, s in found if PLAUSIBLE_RPM[0] <= s * 30.0 / math.pi <= PLAUSIBLE_RPM[1]]
    if not found:
        return None, unclear
    name, speed = found[0]
    if any(abs(other / speed - 1.0) > AGREE for _, other in found):
        listed = ", ".join(f"{n} ({s * 30 / math.pi:g} rpm)" for n, s in found)
        return None, [f"The file names several speeds: {listed}; say which with speed=... (--speed)."]
    return speed, [f"The speed, {speed * 30.0 / math.pi:.6g} rpm, is the file's {name}."]


def same_rate(path: Path, rates: Mapping[str, float | None]) -> float | None:
    """The one rate of all channels; SignalFileError that lists them where they differ."""
    known: Iterable[float] = {rate for rate in rates.values() if rate is not None}
    distinct: list[float] = []
    for rate in known:
        if all(abs(rate / other - 1.0) > AGREE for other in distinct):
            distinct.append(rate)
    if len(distinct) > 1:
        listed = ", ".join(f"{name} {rate:g} Hz" for name, rate in rates.items() if rate is not None)
        raise SignalFileError(
            path, f"its channels have different sampling rates: {listed}; choose with channels=[...] (--channel)"
        )
    return next((rate for rate in rates.values() if rate is not None), None)


FASTEST = 2e7
"""Sampling rate in Hz of no vibration: its steps in s are those of days of slower records."""
DAYS = (3e4, 9e5)
"""Days since 1900 of spreadsheets, and since the year 0 of MATLAB, in our times."""
SAME_START = 0.5
"""Samples by which channels of one record may begin at other times."""


def same_start(path: Path, starts: Mapping[str, float], rate: float | None) -> None:
    """Refuse channels that begin at different times (s): row by row their samples are not of one instant."""
    first, last = min(starts.values(), default=0.0), max(starts.values(), default=0.0)
    if rate is not None and (last - first) * rate > SAME_START:
        listed = ", ".join(f"{name} at {start - first:g} s" for name, start in starts.items())
        raise SignalFileError(
            path, f"its channels begin at different times: {listed}; choose with channels=[...] (--channel)"
        )


# Samples that are missing or not finite: refused, interpolated, or cut out, and said.


Gaps = Literal["refuse", "interpolate", "longest"]
CHOICES = get_args(Gaps)
REMEDY = "pass gaps='interpolate' or gaps='longest' (--gaps), or cut or repair the record first"


def checked_gaps(gaps: str | None) -> str:
    """`gaps` as one of the choices; SignalError for any other."""
    if gaps is None:
        return "refuse"
    if gaps not in CHOICES:
        raise SignalError(f"gaps: must be one of {', '.join(CHOICES)}, got {gaps!r}")
    return gaps


def without_gaps(values: np.ndarray, gaps: str | None, rate: float | None = None) -> tuple[np.ndarray, int, list[str]]:
    """Samples without gaps, the index of the first that is kept, and what was done in words.

    Parameters
    ----------
    values : ndarray of shape (n, channels)
    gaps : {"refuse", "interpolate", "longest"} or None
        "refuse" (None): an error. "interpolate": straight lines across each gap, ends without a sample on one side cut
        off. "longest": the longest stretch in which no channel has a gap.
    rate : float, optional
        Sampling rate in Hz, for the words.

    Raises
    ------
    SignalError
        If there are gaps and `gaps` is "refuse", or nothing is left.
    """
    how = checked_gaps(gaps)
    bad = is_missing(values)
    if not bad.any():
        return values, 0, []
    row, column = (int(i) for i in np.argwhere(bad)[0])
    count = int(bad.any(axis=1).sum())
    if how == "refuse":
        raise SignalError(
            f"data: {int(bad.sum())} samples are not finite, or 9.9E+37 as instruments write it, the first at row "
            f"{row}, channel {column}; {REMEDY}"
        )
    if bad.all(axis=0).any():
        raise SignalError(f"gaps: channel {int(np.argmax(bad.all(axis=0)))} holds no sample at all; leave it out")
    if how == "longest":
        good = np.concatenate(([False], ~bad.any(axis=1), [False]))
        turns = np.flatnonzero(np.diff(good.astype(int)))
        if not turns.size:
            raise SignalError("gaps: no row has a sample in every channel; choose channels")
        starts, stops = turns[::2], turns[1::2]
        k = int(np.argmax(stops - starts))
        first, last = int(starts[k]), int(stops[k])
        words = f"Only the longest stretch without gaps is used: samples {first} to {last - 1} of {len(values)}."
        return values[first:last], first, [words]
    filled = values.copy()
    first = int(max(np.argmin(bad[:, c]) for c in range(values.shape[1])))
    last = int(min(len(values) - np.argmin(bad[::-1, c]) for c in range(values.shape[1])))
    if last <= first:
        raise SignalError("gaps: no time at which every channel has samples; choose channels")
    at = np.arange(len(values))
    longest = 0
    for c in range(values.shape[1]):
        good = ~bad[:, c]
        filled[:, c] = np.interp(at, at[good], values[good, c])
        edges = np.flatnonzero(np.diff(np.concatenate(([0], bad[first:last, c].astype(int), [0]))))
        longest = max(longest, int((edges[1::2] - edges[::2]).max(initial=0)))
    span = "" if rate is None else f" ({longest / rate:.3g} s)"
    words = (
        f"{count} of {len(values)} rows had gaps, filled by straight lines; the longest gap is {longest} samples{span}."
    )
    return filled[first:last], first, [words]


Progress = Callable[[float, str], None]
RESERVED_ATTRS = ("sampling_rate", "speed", "teeth", "units")
SHAFT_COLUMNS = {f"{name} over time": name for name in SHAFT}
"""Names under which files hold the coordinates of a signal that tell how the shaft turns, beside its channels."""


@dataclass
class Record:
    """Samples and metadata read from a file.

    Attributes
    ----------
    values : ndarray of shape (n, channels)
    names : list of str
    units : list of str
        One per channel, "unknown" where the file is silent.
    rate : float or None
        Sampling rate in Hz.
    t0 : float
        Time of the first sample in s.
    speed : float or None
        rad/s.
    teeth : tuple of int or None
    attrs : dict
        Anything else, JSON-like.
    notes : list of str
        What a reader should know: choices made, things left out.
    """

    values: np.ndarray
    names: list[str]
    units: list[str]
    rate: float | None = None
    t0: float = 0.0
    speed: float | None = None
    teeth: tuple[int, ...] | None = None
    attrs: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def record_of(signal: xr.DataArray) -> Record:
    """The record that a writer puts into a file; `speed` and `angle` over time become columns, see `SHAFT_COLUMNS`.

    Raises
    ------
    SignalError
        If a channel would be read back as one of these.
    """
    teeth, turning = signal.attrs.get("teeth"), shaft_coords(signal)
    columns = {column: turning[name] for column, name in SHAFT_COLUMNS.items() if name in turning}
    names, units = [str(c) for c in signal["channel"].values], units_of(signal)
    wrong = [name for name in _shaft_columns(names, units) if columns or len(names) > 1]
    if wrong:
        raise SignalError(
            f"channels: {wrong[0]!r} would be read back as the {SHAFT_COLUMNS[wrong[0]]} of the shaft, which files "
            "hold under this name; give the channel another one"
        )
    values = np.asarray(signal.values, dtype=float)
    return Record(
        values=np.column_stack([values, *(own.values for own in columns.values())]) if columns else values,
        names=[*names, *columns],
        units=[*units, *(SHAFT[SHAFT_COLUMNS[column]] for column in columns)],
        rate=rate_of(signal),
        t0=float(signal["time"].values[0]),
        speed=None if signal.attrs.get("speed") is None else float(signal.attrs["speed"]),
        teeth=None if teeth is None else check_teeth(teeth),
        attrs={k: v for k, v in signal.attrs.items() if k not in RESERVED_ATTRS},
    )


def _shaft_columns(names: Sequence[str], units: Sequence[str]) -> dict[str, int]:
    """Return the places of those columns that hold a coordinate over time."""
    return {n: i for i, n in enumerate(names) if n in SHAFT_COLUMNS and units[i] == SHAFT[SHAFT_COLUMNS[n]]}


def columns_asked(channels: Sequence[str] | None) -> list[str] | None:
    """Return the columns of a file that hold the channels asked for, and what belongs to any of them."""
    return None if channels is None else [*channels, *SHAFT_COLUMNS]


def _picked(record: Record, kept: Sequence[int]) -> None:
    record.values = record.values[:, kept]
    record.names = [record.names[i] for i in kept]
    record.units = [record.units[i] for i in kept]


def signal_from(
    record: Record,
    path: Path,
    *,
    rate: float | None,
    units: str | Sequence[str] | Mapping[str, str] | None,
    speed: float | None,
    teeth: int | Sequence[int] | None,
    channels: Sequence[str] | None,
    gaps: str | None = None,
) -> xr.DataArray:
    """Join what the file and the caller say into a signal; errors name the file."""
    turning, found_at = {}, _shaft_columns(record.names, record.units)
    if len(found_at) < len(record.names):
        turning = {SHAFT_COLUMNS[column]: record.values[:, at] for column, at in found_at.items()}
        _picked(record, [i for i in range(len(record.names)) if i not in found_at.values()])
    if channels is not None:
        missing = [c for c in channels if c not in record.names]
        if missing:
            raise SignalFileError(path, f"has no channel {missing}; it holds {record.names}")
        _picked(record, [record.names.index(c) for c in channels])
    if rate is not None and record.rate is not None and abs(rate - record.rate) > 1e-3 * record.rate:
        raise SignalFileError(
            path,
            f"says its sampling rate is {record.rate:g} Hz, the call says rate={rate:g}; leave rate out, or relabel "
            "the samples with make_signal(signal.values, rate) if the file is wrong",
        )
    found = record.rate if record.rate is not None else rate
    if found is None:
        raise MissingMetadataError(
            "rate", str(path), f"the file does not hold it, its columns are {record.names[:8]}; pass rate=... in Hz"
        )
    _times_checked(record, found, path)
    if record.speed is not None and speed is not None:
        record.notes = [note for note in record.notes if not note.startswith("The speed, ")]
    try:
        values, first, said = without_gaps(record.values, gaps, found)
        notes = [*record.notes, *said, *_levels_told(record, units)]
        signal = make_signal(
            values,
            found,
            units=_units_said(units, record),
            channels=record.names,
            t0=record.t0 + first / found,
            speed=record.speed if speed is None else speed,
            teeth=record.teeth if teeth is None else teeth,
            attrs={**record.attrs, "source": path.name, **({"notes": notes} if notes else {})},
        )
        # a constant speed that the caller gives wins
        kept = {} if speed is not None else turning
        rows = slice(first, first + len(values))
        return signal.assign_coords({name: ("time", own[rows], {"units": SHAFT[name]}) for name, own in kept.items()})
    except MissingMetadataError:
        raise
    except SignalError as exc:
        raise SignalFileError(path, str(exc)) from exc


def _times_checked(record: Record, rate: float, path: Path) -> None:
    """Refuse a rate (Hz) that a column of times among the channels contradicts."""
    for name, unit, values in zip(record.names, record.units, record.values.T, strict=True):
        if not (may_be_times(name, unit) and rises_evenly(values)):
            continue
        told = seconds_of(unit, name)
        own = (values.size - 1) / float(values[-1] - values[0])
        # without a unit it may hold ms or us, too
        possible = [own / told] if told not in (None, 1.0) or unit.lower() in OF_TIMES else [own, 1e3 * own, 1e6 * own]
        if all(abs(each / rate - 1.0) > ROUNDED_TIMES for each in possible):
            raise SignalFileError(
                path, f"the times in its column {name!r} have a rate of {possible[0]:g} Hz, of the record it is "
                f"{rate:g} Hz; say the true one with rate=... (--rate), or choose channels=[...] (--channel) without it"
            )  # fmt: skip


def _levels_told(record: Record, units: Any) -> list[str]:
    """Say which units are those of levels, where the caller gives no others."""
    said = _units_said(units, record)
    texts = (
        said if isinstance(said, list) else [said.get(n, "") for n in record.names] if isinstance(said, dict) else []
    )
    found = {name: text for name, text in zip(record.names, texts) if detected_unit(text) is not None}
    return [
        f"CHECK THE UNIT: {name!r} is in {text!r}, that of a level; if it holds the samples of a waveform, say "
        f"units={{{name!r}: {detected_unit(text)!r}}} (--units '{name}={detected_unit(text)}')."
        for name, text in found.items()
    ]


def _units_said(units: str | Sequence[str] | Mapping[str, str] | None, record: Record) -> Any:
    """Return the units of the channels: of a mapping its own, of the other channels the file's."""
    known = dict(zip(record.names, record.units))
    return known | dict(units) if isinstance(units, Mapping) else record.units if units is None else units


def metadata_json(record: Record) -> str:
    """Everything but the samples, as one line of JSON."""
    return json.dumps(
        {
            "sampling_rate": record.rate,
            "t0": record.t0,
            "channels": record.names,
            "units": record.units,
            "speed": record.speed,
            "teeth": record.teeth,
            "attrs": json_value(record.attrs),
        }
    )


def record_from_json(values: np.ndarray, text: str, path: Path) -> Record:
    """Inverse of `metadata_json`; SignalFileError if the text does not fit the samples."""
    try:
        meta = json.loads(text)
        names, units = [str(c) for c in meta["channels"]], [str(u) for u in meta["units"]]
        record = Record(
            values,
            names,
            units,
            float(meta["sampling_rate"]),
            float(meta["t0"]),
            meta["speed"],
            None if meta["teeth"] is None else check_teeth(meta["teeth"]),
            dict(meta["attrs"]),
        )
    except (ValueError, KeyError, TypeError) as exc:
        raise SignalFileError(path, f"its metadata cannot be read ({exc})") from exc
    if len(names) != values.shape[1] or len(units) != len(names):
        raise SignalFileError(path, f"its metadata names {len(names)} channels, its samples have {values.shape[1]}")
    return record


def mean_rate(times: np.ndarray) -> float:
    """Sampling rate in Hz of times in s, the mean one where they are not even; nan of times that do not rise."""
    try:
        return uniform_rate(times)
    except SignalError:
        span = float(times[-1] - times[0]) if times.size > 1 else 0.0
        return (times.size - 1) / span if span > 0.0 and bool(np.all(np.diff(times) >= 0.0)) else math.nan


def rate_by_times(times: np.ndarray, path: Path, given: float | None, others: bool = False) -> float | None:
    """Sampling rate in Hz of the times in a file; where they are only rounded the given one.

    Parameters
    ----------
    times : ndarray of shape (n,)
        s.
    path : Path
    given : float, optional
        Hz, by the caller.
    others : bool
        Whether the file tells a rate elsewhere: then times that are not even tell none.

    Raises
    ------
    SignalFileError
        If they are not even and nothing else tells the rate, or contradict the given one.
    """
    try:
        return rate_from_times(times, path)
    except SignalFileError:
        mean = mean_rate(np.asarray(times, dtype=float))
        if given is not None and math.isfinite(mean):
            if abs(mean - given) <= ROUNDED_TIMES * given:
                return given
            raise SignalFileError(
                path, f"time: is not uniform, its mean rate is {mean:g} Hz, the call says rate={given:g}; "
                "leave rate out and resample the record, or leave the times out of the file"
            ) from None  # fmt: skip
        if others and math.isfinite(mean):
            return None
        raise


def rate_from_times(times: np.ndarray, path: Path) -> float:
    """Sampling rate in Hz of the times in a file; the error names the file."""
    times = np.asarray(times, dtype=float)
    try:
        rate = uniform_rate(times)
        if rate > FASTEST and DAYS[0] < times[0] < DAYS[1]:
            raise SignalError(
                f"time: rises from {times[0]:.9g} in steps of {1.0 / rate:.3g}, as days do (MATLAB's datenum, dates of "
                "spreadsheets); name the unit, as Time [d] or TimeUnit = 'd', or write the times in s"
            )
        return rate
    except SignalError as exc:
        raise SignalFileError(path, str(exc)) from exc
