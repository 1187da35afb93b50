"""Records of files that hold named arrays, whatever program wrote them: MATLAB, numpy, NetCDF and HDF5."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.signals.errors import SignalError, SignalFileError
from gearmbs.signals.files.own_clocks import SLOW_SAID, checked_same, interpolated, same_length, times_by_count
from gearmbs.signals.files.scales import named_factors, scale_told
from gearmbs.signals.signal.labels import (
    CLOCK_NAMES,
    is_clock,
    key_of,
    may_be_slow,
    may_be_times,
    rises_evenly,
    tells_time,
)
from gearmbs.signals.signal.record import (
    AGREE,
    SAME_START,
    RateCandidate,
    Record,
    chosen_rate,
    mean_rate,
    number_of,
    own_header,
    rate_by_times,
    rate_candidates,
    same_rate,
    speed_of,
)
from gearmbs.signals.signal.signal import UNKNOWN_UNITS, check_teeth
from gearmbs.signals.signal.times import in_seconds, seconds_of
from gearmbs.signals.signal.words import words_of

OF_TIMES = ("timeunit", "timeunits", "unittime", "unitoftime", "tunit", "tunits", "xunit", "xunits", "zeiteinheit")
"""Names of texts that tell the unit of times beside them."""


def assemble(
    path: Path,
    arrays: Mapping[str, np.ndarray],
    scalars: Mapping[str, Any],
    units: Mapping[str, str],
    channels: Sequence[str] | None,
    given: float | None = None,
    homes: Mapping[str, str] | None = None,
) -> Record:
    """Make a record of the named arrays of a file that is not laid out by this package.

    The arrays of the common length become channels, matrices one channel per column; an array called time gives the
    rate, as does a scalar with a name such as fs, sr or XInc (`gearmbs.signals.signal.record`), beside the channel,
    above it or, if there is none, anywhere. With `channels`, only the arrays they name (or whose columns they name)
    count. A rate that the caller has `given` (Hz) decides where the file names two. `homes` are the groups of the
    arrays, by default what stands before the last dot of their names: times beside an array are its own.
    """
    homes = {} if homes is None else homes
    units = _units_of_times(arrays, scalars, units, homes)
    told = {k: units.get(k, UNKNOWN_UNITS) for k in arrays}
    clocks = _clocks(arrays, told, homes, channels)
    columns: dict[str, np.ndarray] = {}
    column_units: dict[str, str] = {}
    owner: dict[str, str] = {}
    notes: list[str] = []
    abscissas: dict[str, np.ndarray] = {}
    for key, array in arrays.items():
        if key in clocks or array.size < 2:
            continue
        flat = np.squeeze(array)
        if flat.ndim > 2:
            continue
        table = flat[:, None] if flat.ndim == 1 else (flat if flat.shape[0] >= flat.shape[1] else flat.T)
        names = [key] if table.shape[1] == 1 else [f"{key}_{i + 1}" for i in range(table.shape[1])]
        first = table[:, 0]
        counts_rows = table.shape[1] > 1 and (channels is None or names[0] not in channels) and rises_evenly(first)
        if counts_rows:
            numbered = bool(np.all(np.diff(first) == 1.0))
            abscissas |= {} if numbered or clocks else {key: first}
            said_of = "numbers the rows and is left out" if numbered else "rises evenly; it is taken for the time in s"
            notes.append(f"The first column of {key} {said_of}.")
        for i, name in enumerate(names):
            if (channels is None or name in channels) and not (counts_rows and i == 0):
                columns[name] = table[:, i]
                column_units[name] = units.get(name, units.get(key, UNKNOWN_UNITS))
                owner[name] = key
    if not columns:
        raise SignalFileError(path, f"holds no numeric record{_among(arrays, channels)}")
    own: dict[str, np.ndarray] = {}
    for name, key in owner.items():
        times = _clock_of(path, name, _own_times(key, columns[name].size, clocks, homes), given)
        times = abscissas.get(key) if times is None else times
        if times is not None and times.dtype.kind in "fiu":
            own[name] = times
    for name, key in owner.items():
        factors = named_factors(_beside(scalars, key, homes), words_of(_bare(key, homes)))
        scaled = scale_told(name, column_units[name], columns[name], factors)
        notes += [] if scaled is None else [scaled]
    slow, said = _slow_ones_stretched(path, columns, column_units, own, _rates_beside(scalars, owner))
    notes += said
    lengths = {name: column.size for name, column in columns.items()}
    sizes = {n: size for n, size in lengths.items() if n not in slow}
    vibration = {n: size for n, size in sizes.items() if not may_be_slow(n, column_units[n])} or sizes
    same_length(path, vibration, {n: r for n, r in _rates_beside(scalars, owner).items() if n in vibration})
    same_length(path, lengths)
    rates: dict[str, float | None] = {}
    for name, key in owner.items():
        if name in slow:
            continue
        rates[name], said = chosen_rate(path, rate_candidates(own_header(scalars, key)), given)
        notes += [note for note in said if note not in notes]
    rate = same_rate(path, rates)
    fast = {name: own[name] for name in columns if name in own and name not in slow}
    checked_same(path, fast)
    t0 = 0.0
    times = next(iter(fast.values()), next(iter(abscissas.values()), None))
    if times is not None and times.size == next(iter(lengths.values())) and times.dtype.kind in "fiu":
        t0 = float(times[0])
        rate, said = _rate_beside_times(path, rate, times, given)
        notes += said
    known = {k: v for k, v in scalars.items() if not isinstance(v, (list, dict))}
    speed, said = speed_of(known)
    plain = number_of(scalars.get("speed"))
    if speed is None and plain is not None and not plain[1]:
        speed = plain[0]
    counts = scalars.get("teeth")
    if isinstance(counts, str):
        counts = None if number_of(counts) is None else number_of(counts)[0]  # type: ignore[index]
    try:
        checked = None if counts is None else check_teeth(counts)
    except (SignalError, TypeError, ValueError):
        checked = None
        notes.append(f"teeth = {counts!r} in the file is no tooth count and left out.")
    return Record(
        np.stack([np.asarray(c, dtype=float) for c in columns.values()], axis=1),
        list(columns),
        [column_units[name] for name in columns],
        rate,
        t0,
        speed,
        checked,
        notes=notes + said,
    )


def _clocks(
    arrays: Mapping[str, np.ndarray], units: Mapping[str, str], homes: Mapping[str, str], channels: Sequence[str] | None
) -> dict[str, np.ndarray]:
    """Return the arrays that hold times, in s: those called as times are, and those with such a word that rise."""
    flat = {key: np.asarray(array).ravel() for key, array in arrays.items() if array.size > 1}
    last = {key: _bare(key, homes) for key in flat}
    named = {key for key in flat if tells_time(last[key], units[key])}
    named |= {
        key
        for key, times in flat.items()
        if key not in named and key not in (channels or ()) and may_be_times(last[key], units[key])
        if np.squeeze(arrays[key]).ndim == 1 and times.dtype.kind in "fiu" and bool(np.all(np.diff(times) > 0))
    }
    begin: dict[str, float] = {}
    # those of a file that holds times since 1970 begin together
    for key in sorted(named):
        begin[units[key]] = min(begin.get(units[key], np.inf), float(flat[key][0]))
    return {key: in_seconds(flat[key], units[key], last[key], begin[units[key]]) for key in flat if key in named}


def _beside(scalars: Mapping[str, Any], key: str, homes: Mapping[str, str]) -> dict[str, Any]:
    """Return what stands beside an array or above it."""
    home = f"{homes.get(key, key.rpartition('.')[0])}."
    return {
        name: value
        for name, value in scalars.items()
        if home.startswith(f"{name.rpartition('.')[0]}.") or "." not in name
    }


def _units_of_times(
    arrays: Mapping[str, np.ndarray], scalars: Mapping[str, Any], units: Mapping[str, str], homes: Mapping[str, str]
) -> dict[str, str]:
    """Return the units of arrays; those of times as TimeUnit beside them says, and none that is of no time."""
    found = dict(units)
    for key in arrays:
        if not is_clock(_bare(key, homes)):
            continue
        beside = {key_of(name)[0]: str(value) for name, value in _beside(scalars, key, homes).items()}
        named = next((beside[name] for name in OF_TIMES if name in beside), None)
        if named is not None and seconds_of(named) is not None:
            found[key] = named
        elif seconds_of(found.get(key, "")) is None and any(found.get(k) == found[key] for k in arrays if k != key):
            # that of its group, which means the samples
            found[key] = UNKNOWN_UNITS
    return found


def _bare(key: str, homes: Mapping[str, str]) -> str:
    """Return the name of an array within its group."""
    home = homes.get(key, key.rpartition(".")[0])
    return key.removeprefix(f"{home}.") if home else key


def _own_times(
    key: str, size: int, clocks: Mapping[str, np.ndarray], homes: Mapping[str, str]
) -> dict[str, np.ndarray]:
    """Return the times that an array may have: those beside it or above it, or else any; the ones called alike."""
    home = homes.get(key, key.rpartition(".")[0])
    found: dict[str, np.ndarray] = {}
    fitting = {name: times for name, times in clocks.items() if times.size == size}
    while not found:
        found = {name: times for name, times in fitting.items() if homes.get(name, name.rpartition(".")[0]) == home}
        if not home:
            break
        home = home.rpartition(".")[0]
    found = found or fitting
    own = set(words_of(_bare(key, homes)))
    rest = {name: [w for w in words_of(_bare(name, homes)) if w not in CLOCK_NAMES] for name in found}
    most = max((len(words) for words in rest.values() if own.issuperset(words)), default=0)
    alike = {name: times for name, times in found.items() if len(rest[name]) == most and own.issuperset(rest[name])}
    return alike or found


def _clock_of(path: Path, name: str, possible: Mapping[str, np.ndarray], given: float | None) -> np.ndarray | None:
    """Return the times of a channel, if the possible ones are of one rate and start, or one is of the given rate."""
    distinct: dict[str, np.ndarray] = {}
    for clock, times in possible.items():
        if all(not _same(times, other) for other in distinct.values()):
            distinct[clock] = times
    if len(distinct) < 2:
        return next(iter(distinct.values()), None)
    rates = {clock: mean_rate(times) for clock, times in distinct.items()}
    told = [clock for clock, rate in rates.items() if given is not None and abs(rate / given - 1.0) <= AGREE]
    if len(told) == 1:
        return distinct[told[0]]
    listed = ", ".join(f"{clock} ({rates[clock]:g} Hz from {times[0]:g} s)" for clock, times in distinct.items())
    raise SignalFileError(
        path,
        f"holds several times that may be those of {name}: {listed}; say which with rate=... (--rate), or name them "
        "alike, as t_a beside a",
    )


def _same(times: np.ndarray, other: np.ndarray) -> bool:
    step = abs(float(other[-1] - other[0])) / max(1, other.size - 1)
    return bool(np.allclose(times[[0, -1]], other[[0, -1]], rtol=0.0, atol=SAME_START * step))


def _rate_beside_times(
    path: Path, rate: float | None, times: np.ndarray, given: float | None
) -> tuple[float | None, list[str]]:
    """Return the rate of a file that holds times and perhaps names a rate; where they disagree the given one."""
    by_times = rate_by_times(times, path, given, others=rate is not None)
    if rate is None or by_times is None:
        return by_times if rate is None else rate, []
    both = [RateCandidate("the sampling rate that it names", rate), RateCandidate("its column of times", by_times)]
    chosen, said = chosen_rate(path, both, given)
    return rate if chosen is None else chosen, said


def _rates_beside(scalars: Mapping[str, Any], owner: Mapping[str, str]) -> dict[str, float]:
    """Return the rates (Hz) that stand beside channels themselves."""
    found = {}
    for name, key in owner.items():
        beside = {k: v for k, v in scalars.items() if k.rpartition(".")[0] == key}
        sure = [candidate.rate for candidate in rate_candidates(beside) if not candidate.weak]
        if sure:
            found[name] = sure[0]
    return found


def _slow_ones_stretched(
    path: Path,
    columns: dict[str, np.ndarray],
    units: Mapping[str, str],
    clocks: Mapping[str, np.ndarray],
    rates: Mapping[str, float],
) -> tuple[list[str], list[str]]:
    """Bring speeds and temperatures of other times to those of all others in place; which, and what to say."""
    slow = {name for name in columns if may_be_slow(name, units[name])}
    sizes = {column.size for name, column in columns.items() if name not in slow}
    if len(sizes) != 1:
        return [], []
    (size,) = sizes
    base = next((clocks[name] for name in columns if name not in slow and name in clocks), None)
    rate = next((rates[name] for name in columns if name not in slow and name in rates), None)
    stretched, notes = [], []
    for name in columns:
        own = np.asarray(columns[name], dtype=float)
        if name not in slow or own.size < 2:
            continue
        times = clocks.get(name)
        if base is not None and times is not None:
            if own.size == size and _same(times, base):
                continue
            columns[name], words = interpolated(path, name, base, times, own)
        elif rate is not None and name in rates:
            if own.size == size and abs(rates[name] / rate - 1.0) <= AGREE:
                continue
            begin = 0.0 if base is None else float(base[0])
            at = np.arange(size) / rate if base is None else base
            columns[name], words = interpolated(path, name, at, begin + np.arange(own.size) / rates[name], own)
        elif own.size < size:
            times, how = times_by_count(own.size, size)
            words = SLOW_SAID.format(name=name, size=size, how=how)
            columns[name] = np.interp(np.arange(size), times, own)
        else:
            continue
        stretched.append(name)
        notes.append(words)
    return stretched, notes


def _among(arrays: Mapping[str, np.ndarray], channels: Sequence[str] | None) -> str:
    listed = ", ".join(f"{k} {np.shape(v)}" for k, v in arrays.items()) or "nothing numeric"
    return f" named {list(channels)}; it holds {listed}" if channels is not None else f"; it holds {listed}"
