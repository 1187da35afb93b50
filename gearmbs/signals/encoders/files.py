"""Pulses in and out of files of any format: a column of times, or of counts of a clock, for each encoder.

Columns may differ in length; the shorter ones end with empty cells. A column `name index` holds the pulses once a turn,
also where only one of both names says that it holds times, as `driver index` beside `t_driver`.
Where a column holds neither times nor counts, it is the sampled voltage of an encoder, and its edges are taken.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from gearmbs.progress import staged
from gearmbs.signals.encoders.positions import COUNTS, positions_of, train_of_positions
from gearmbs.signals.encoders.pulses import PulseTrain, TrainKeywords, pulse_train, pulses_of_channel
from gearmbs.signals.errors import MissingMetadataError, SignalError, SignalFileError
from gearmbs.signals.files.formats import checked_format, damage_named, format_to_write, read_signal, write_record
from gearmbs.signals.files.table import Asked, format_of
from gearmbs.signals.signal.labels import CLOCK_NAMES
from gearmbs.signals.signal.record import SECONDS, Record
from gearmbs.signals.signal.words import words_of
from gearmbs.units import QuantityLike, to_si

INDEX = " index"
"""End of the name of a column with the pulses once a turn."""
COUNTER_BITS = (16, 24, 32)
"""Widths of counters, which begin anew after as many bits."""
LONGEST_FIT = 10.0
"""Usual steps up to which the one across an overflow may be: missing pulses are told and mended later."""
RISING = 0.9
"""Share of the steps of times and counts that rise, also of a counter that begins anew; of a voltage half do."""
KNOWN = "encoders"
"""Attribute of a file that says how many lines the encoders have, and which teeth are at mark 0."""


def write_pulses(trains: Mapping[str, PulseTrain] | Sequence[PulseTrain], path: str | Path) -> Path:
    """Write trains of pulses as columns of times, as `read_pulses` reads them.

    Parameters
    ----------
    trains : mapping of str to PulseTrain, or sequence
        By the names of their columns, or under their own names. Of those whose mark 0 is known it is told by a column
        of index pulses, unless the disc itself tells.
    path : path-like
        The ending says as what (`gearmbs.write_signal`).

    Raises
    ------
    SignalFileError
        If the format keeps no attributes, among them the count of lines.
    """
    path = Path(path)
    written_as = format_of(format_to_write(path))
    if not written_as.keeps_attributes:
        raise SignalFileError(
            path, "holds samples, and not how many lines an encoder has; write pulses as .csv, .npz, .mat or .nc"
        )
    named = dict(trains) if isinstance(trains, Mapping) else {train.name: train for train in trains}
    if not named or (not isinstance(trains, Mapping) and len(named) < len(trains)):
        raise SignalError("trains: give at least one, and each another name")
    columns: dict[str, np.ndarray] = {}
    known: dict[str, Any] = {}
    for name, train in named.items():
        columns[name] = train.times
        known[name] = {"lines": train.lines}
        if train.tooth_at_zero is not None:
            known[name]["tooth_at_zero"] = list(train.tooth_at_zero)
        marks = train.numbers % train.lines
        if train.referenced and np.any(marks == 0):
            before = train.numbers[(marks == 0) & (train.numbers > train.numbers[0])] - 0.5
            columns[name + INDEX] = np.interp(before, train.numbers, train.times)
    count = max(column.size for column in columns.values())
    values = np.full((count, len(columns)), np.nan)
    for k, column in enumerate(columns.values()):
        values[: column.size, k] = column
    record = Record(values, list(columns), ["s"] * len(columns), rate=1.0, attrs={KNOWN: known})
    return write_record(record, path)


@staged("reading")
def read_pulses(
    path: str | Path,
    lines: int | Mapping[str, int] | None = None,
    *,
    clock: QuantityLike | None = None,
    unit: str | None = None,
    rate: float | str | None = None,
    progress: Callable[[float, str], None] | None = None,
    **known: Unpack[TrainKeywords],
) -> dict[str, PulseTrain]:
    """Read the pulses of encoders and tachos, or positions over time, counts or angles, as the times of their marks.

    Parameters
    ----------
    path : path-like
        A file of any format that `gearmbs.read_signal` reads.
    lines : int or mapping of str to int, optional
        Marks of a turn, of all or by column; not needed of files that say it, as those of `write_pulses` do. Of a
        mapping only its columns are read.
    clock : float or str, optional
        Frequency of the clock, Hz or "20 MHz", of columns that count its ticks.
    unit : {"s", "ms", "us", "ns"}, optional
        Of times in columns that name none.
    rate : float, optional
        Sampling rate of sampled voltages and positions, Hz, where the file does not say it.
    **known
        Further arguments of `pulse_train`.

    Returns
    -------
    dict of str to PulseTrain

    Raises
    ------
    MissingMetadataError
        If the lines of a column are not known, the clock of counts, or what a column without a unit that rises
        throughout holds.
    SignalFileError
        If a column is not there.
    """
    path = Path(path)
    format, content = checked_format(path, None)
    with damage_named(path, format):
        # empty cells end columns that are shorter: they are kept here
        asked = Asked(content=content, rate=1.0, gaps="longest", progress=progress, pulses=True)
        record = format_of(format).read(path, asked)
    table = dict(zip(record.names, record.values.T))
    units = dict(zip(record.names, record.units))
    told: dict[str, dict[str, Any]] = record.attrs.get(KNOWN, {})
    marked = _index_columns(list(table), lines if isinstance(lines, Mapping) else (), path)
    wanted = list(lines) if isinstance(lines, Mapping) else list(told) or [n for n in table if n not in marked.values()]
    missing = [name for name in wanted if name not in table]
    if missing:
        raise SignalFileError(path, f"has no column {missing[0]!r}; it holds {record.names}")
    found = {}
    begin = None
    given = None if rate is None else to_si(rate, "frequency", "rate")
    own = record.rate if record.rate is not None and record.rate != asked.rate else given
    for name in wanted:
        about = told.get(name, {})
        count = lines[name] if isinstance(lines, Mapping) else lines or about.get("lines")
        places = positions_of(path, name, _present(table[name]), units[name], own, record.t0, clock is not None)
        if places is not None and unit is None:
            found[name] = train_of_positions(
                places, count, name, {**known, "tooth_at_zero": about.get("tooth_at_zero")}
            )
            continue
        if count is None:
            raise MissingMetadataError(
                "lines", f"the pulses in {path.name}", f"pass lines={{{name!r}: ...}}, the marks of a turn"
            )
        more: dict[str, Any] = {"name": name, "tooth_at_zero": about.get("tooth_at_zero"), **known}
        factor = _factor(units[name], clock, unit, path)
        once = marked.get(name)
        if factor is not None:
            begin = _unwrapped(table, name, once, count, begin, factor, path)
        if factor is None:
            _asked_for_unit(name, _present(table[name]), path)
        if factor is None:
            signal = read_signal(path, rate=rate, channels=[name, once] if once else [name])
            found[name] = pulses_of_channel(signal, count, name, index=once, **more)
        else:
            index = None if once is None else factor * _present(table[once])
            found[name] = pulse_train(factor * _present(table[name]), count, index=index, **more)
    return found


def _index_columns(names: Sequence[str], asked: Collection[str], path: Path) -> dict[str, str]:
    """Return the columns with the pulses once a turn by those of the encoders that they are of.

    Raises
    ------
    SignalFileError
        If one is of no encoder in the file, or of several.
    """
    found, lost = {}, []
    pulses = [name for name in names if name in asked or not name.lower().endswith(INDEX)]
    for name in names:
        if name in pulses:
            continue
        stem = name[: -len(INDEX)]
        alike = [stem] if stem in pulses else [each for each in pulses if _stem(each) == _stem(stem)]
        if len(alike) == 1:
            found[alike[0]] = name
        else:
            lost.append(name)
    if lost and pulses:
        raise SignalFileError(
            path, f"its columns {lost} are called as those of pulses once a turn, and belong to none of {pulses}; call "
            f"them as their encoder with {INDEX!r} behind it, for instance {pulses[0] + INDEX!r}"
        )  # fmt: skip
    return found


def _stem(name: str) -> list[str]:
    """Return the words of a name but those that say that it holds times."""
    return [word for word in words_of(name) if word not in CLOCK_NAMES]


def _asked_for_unit(name: str, column: np.ndarray, path: Path) -> None:
    """Ask for the clock of counts or the unit of times in a column without one that rises as these do."""
    rising = float(np.mean(np.diff(column) > 0.0)) if column.size > 1 else 0.0
    if rising < RISING:
        return
    how = "throughout" if rising == 1.0 else f"in {100.0 * rising:.4g} % of its steps"
    if np.array_equal(column, np.rint(column)):
        raise MissingMetadataError(
            "clock",
            f"{name!r} in {path.name} (whole numbers that rise {how}, as counts do)",
            "pass clock='20 MHz' of the counter (--clock), or unit='us' of times (--unit)",
        )
    raise MissingMetadataError(
        "unit",
        f"{name!r} in {path.name} (it rises {how})",
        "pass unit='s' of times (--unit), or clock='20 MHz' of counts (--clock)",
    )


def _unwrapped(
    table: dict[str, np.ndarray],
    name: str,
    once: str | None,
    lines: int,
    begin: float | None,
    factor: float,
    path: Path,
) -> float | None:
    """Add the periods of a counter that overflows to a column and its index pulses, in place.

    A column falls where its counter begins anew. The fewest bits that hold all its counts are taken where they put the
    next pulse among those beside it, the first pulse next to that of the first train (`begin`, in counts by factor).

    Returns
    -------
    float
        Time of the first pulse of all trains, s.
    """
    column = _present(table[name])
    steps = np.diff(column)
    falls = np.flatnonzero(steps < 0.0)
    usual = float(np.median(steps))
    period = next((2.0**bits for bits in COUNTER_BITS if 0.0 <= column.min() and column.max() < 2.0**bits), 0.0)
    if begin is None:
        begin = factor * float(column[0])
    if not falls.size or usual <= 0.0:
        return begin
    wrapped = np.unwrap(column, period=period) if period else column
    fits = np.diff(wrapped)[falls]
    if not (np.all(np.diff(wrapped) > 0.0) and np.all((fits > 0.3 * usual) & (fits < LONGEST_FIT * usual))):
        return begin
    wrapped += period * round((begin / factor - wrapped[0]) / period)
    table[name] = wrapped
    if once is not None:
        turn, marks = lines * usual, _present(table[once])
        if turn > 0.5 * period:
            raise SignalFileError(
                path, f"{name!r} overflows faster than twice a turn, so that nothing tells the turns of {once!r}; "
                "leave that column out, or unwrap both"
            )  # fmt: skip
        marks = np.unwrap(marks, period=period)
        table[once] = marks + period * round((wrapped[0] + 0.5 * turn - marks[0]) / period)
    return begin


def _present(column: np.ndarray) -> np.ndarray:
    return column[np.isfinite(column)]


def _factor(unit: str, clock: QuantityLike | None, given: str | None, path: Path) -> float | None:
    """Return the seconds of a unit of a column, or None of a sampled voltage."""
    key = unit.strip().lower()
    if given is not None and clock is not None:
        raise SignalError(f"unit: {given!r} is one of times, clock={clock!r} one of counts; give one of them")
    if given is not None and key in ("", "unknown"):
        if given not in SECONDS:
            raise SignalError(f"unit: must be one of s, ms, us and ns, got {given!r}")
        key = given
    if key in SECONDS and key:
        return SECONDS[key]
    if key in COUNTS or (clock is not None and key in ("", "unknown")):
        if clock is None:
            raise MissingMetadataError("clock", f"the counts in {path.name}", "pass clock='20 MHz' of the counter")
        return 1.0 / to_si(clock, "frequency", "clock")
    return None
