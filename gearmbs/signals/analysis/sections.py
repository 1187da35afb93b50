"""Long files piece by piece: sections of a given length, so that memory does not grow with the file.

Files of formats that have `pieces`, as texts and this package's own NetCDF have, are read as far as a section needs;
other files are read at once and then cut.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs.progress import staged
from gearmbs.signals.analysis.analysis import analyse
from gearmbs.signals.analysis.indicators import INDICATORS
from gearmbs.signals.analysis.report import AnalysisReport
from gearmbs.signals.analysis.vibration import VibrationReport
from gearmbs.signals.errors import SignalError, SignalFileError
from gearmbs.signals.files.formats import checked_format, read_signal
from gearmbs.signals.files.table import Asked, format_of
from gearmbs.signals.signal.arguments import DataKeywords
from gearmbs.signals.signal.given import given_rate, given_speed, is_curve, with_speed
from gearmbs.signals.signal.inputs import to_signal
from gearmbs.signals.signal.record import Record, checked_gaps, columns_asked, record_of, signal_from
from gearmbs.signals.signal.signal import rate_of
from gearmbs.signals.signal.units import check_units
from gearmbs.units import to_si

Progress = Callable[[float, str], None]
Pieces = Iterator[tuple[Record, float]]
LEAST_PART = 0.5
"""Part of a section that the rest at the end of a record must reach to be one itself."""


def sections(
    path: Any,
    seconds: float | str,
    *,
    rate: float | str | None = None,
    units: str | Sequence[str] | Mapping[str, str] | None = None,
    speed: Any = None,
    teeth: int | Sequence[int] | None = None,
    channels: Sequence[str] | None = None,
    gaps: str | None = None,
    format: str | None = None,
    progress: Progress | None = None,
) -> Iterator[xr.DataArray]:
    """Read a file section by section, or cut any other data into sections.

    Parameters
    ----------
    path : path-like, or data
        A file as for `read_signal`, or data of any shape as for `to_signal`.
    seconds : float or str
        Length of a section, s or text such as "1 min". What is left at the end is a section of its own if it is half as
        long or more, and left out otherwise.
    rate, units, speed, teeth, channels, gaps, format
        As for `read_signal`. Of files that are read piece by piece, gaps="longest" is not possible.
    progress : callable, optional
        Called as progress(fraction, "reading") after each section.

    Yields
    ------
    xarray.DataArray
        Dimensions (time, channel); time goes on from section to section.

    Raises
    ------
    SignalFileError, MissingMetadataError
        As `read_signal`; damage is found when the section that has it is read.
    SignalError
        If `seconds` is not positive.
    """
    seconds = _length(seconds)
    hertz, constant = given_rate(rate), given_speed(speed)
    check_units(units)
    settings: dict[str, Any] = {"rate": hertz, "units": units, "speed": constant, "teeth": teeth, "channels": channels}
    if not isinstance(path, (str, Path)):
        whole = to_signal(path, rate=rate, units=units, speed=speed, teeth=teeth, channels=channels, gaps=gaps)
        yield from _cut(whole, seconds, progress)
        return
    if checked_gaps(gaps) == "longest":
        whole = read_signal(path, format=format, gaps=gaps, **{**settings, "speed": speed})
        yield from _cut(whole, seconds, progress)
        return
    for section in _of_file(Path(path), seconds, format, {**settings, "gaps": gaps}, progress):
        yield with_speed(section, speed) if is_curve(speed) else section


def _length(seconds: float | str) -> float:
    try:
        value = to_si(seconds, "time", "seconds")
    except (TypeError, ValueError) as error:
        raise SignalError(str(error)) from error
    if not (math.isfinite(value) and value > 0.0):
        raise SignalError(f"seconds: must be a positive length of a section, got {seconds!r}")
    return value


def _cut(signal: xr.DataArray, seconds: float, progress: Progress | None) -> Iterator[xr.DataArray]:
    """A signal in memory, section by section."""
    length = max(1, round(seconds * rate_of(signal)))
    total = signal.sizes["time"]
    for start in range(0, total, length):
        if start and total - start < LEAST_PART * length:
            break
        yield signal.isel(time=slice(start, start + length))
        if progress is not None:
            progress(min(1.0, (start + length) / total), "reading")


def _of_file(
    path: Path, seconds: float, format: str | None, settings: dict[str, Any], progress: Progress | None
) -> Iterator[xr.DataArray]:
    """A file, section by section, in memory for one section where its format allows."""
    rate = settings["rate"]
    pieces = _pieces(path, format, settings)
    waiting: list[np.ndarray] = []
    held, used, known, done = 0, 0, None, 0.0
    first: Record | None = None
    for piece, done in pieces:
        if known is None:
            first = piece
            known = piece.rate if piece.rate is not None else rate
            length = 0 if known is None else max(1, round(seconds * known))
        waiting.append(piece.values)
        held += len(piece.values)
        # Without a rate there is nothing to count by: signal_from asks for it by name.
        while first is not None and (known is None or held >= length):
            table = np.concatenate(waiting)
            cut = len(table) if known is None else length
            yield _signal(first, table[:cut], used, known, path, settings)
            waiting, held, used = [table[cut:]], held - cut, used + cut
            if progress is not None:
                progress(min(1.0, done), "reading")
    if first is None:
        raise SignalFileError(path, "holds no samples")
    if held and (held >= LEAST_PART * length or not used):
        yield _signal(first, np.concatenate(waiting), used, known, path, settings)
    if progress is not None:
        progress(1.0, "reading")


class ReadingKeywords(DataKeywords, total=False):
    """How a record is read: keywords of `gearmbs.signals.read_signal` but for speed and teeth, for type checkers."""

    format: str | None


@staged("following")
def trend(
    path: Any,
    seconds: float | str,
    *,
    teeth: int | Sequence[int] | None = None,
    speed: Any = None,
    speed_range: tuple[float, float] | None = None,
    speed_channel: str | None = None,
    harmonics: int = 3,
    progress: Progress | None = None,
    **reading: Unpack[ReadingKeywords],
) -> xr.Dataset:
    """Features of a long record over time: each section analysed on its own, in memory for one section.

    Parameters
    ----------
    path, seconds
        As for `sections`: a file, or data of any shape. Many files are one `series`.
    teeth, speed, speed_range, speed_channel, harmonics
        As for `analyse`. Without teeth the features are those of plain vibration.
    progress : callable, optional
        Called as progress(fraction, stage); without it a bar is shown where somebody watches, see `gearmbs.progress`.
    **reading
        `rate`, `units`, `channels`, `gaps`, `format` as for `read_signal`.

    Returns
    -------
    xarray.Dataset
        With teeth `band` and `orders` of dimensions (section, harmonic, channel); the level (`level`) and every
        condition indicator of dimensions (section, channel); `gmf` (Hz) and `speed` (rad/s) of dimension (section,),
        NaN with all features where no mesh line was found. Without teeth, all features of `VibrationReport.to_frame`,
        of dimensions (section, channel). Coordinate `start` (s) and, along section, `note` (why).

    Raises
    ------
    SignalFileError, MissingMetadataError
        As `read_signal` and `analyse`.
    SignalError
        If no section could be analysed; with the last reason.
    """
    if isinstance(path, (list, tuple)) and path and isinstance(path[0], (str, Path)):
        raise SignalError("path: give one record; series(files, ...) follows many files")
    kept = reading.get("channels")
    if speed_channel is not None and kept is not None:
        reading["channels"] = [*kept, speed_channel]
    rows: list[xr.Dataset | None] = []
    starts, notes = [], []
    done = [0.0]
    for section in sections(path, seconds, teeth=teeth, progress=lambda f, _: done.__setitem__(0, f), **reading):
        starts.append(float(section["time"].values[0]))
        try:
            report = analyse(
                section,
                channels=kept,
                speed=speed,
                speed_range=speed_range,
                speed_channel=speed_channel,
                harmonics=harmonics,
                lines=1,
            )
        except SignalError as error:
            rows.append(None)
            notes.append(str(error))
        else:
            rows.append(_row(report))
            reasons = [f"{name}: {why}" for name, why in report.missing.items() if name != "estimate"]
            notes.append("; ".join([*report.notes, *reasons]))
        if progress is not None:
            progress(done[0], f"section {len(starts)}")
    found = next((row for row in rows if row is not None), None)
    if found is None:
        raise SignalError(f"{_name(path)}: no section could be analysed; the last says: {notes[-1]}")
    empty = xr.full_like(found, np.nan)
    table = xr.concat([empty if row is None else row for row in rows], "section", join="outer")
    return table.assign_coords(start=("section", starts, {"units": "s"}), note=("section", notes))


def _name(path: Any) -> str:
    return str(path) if isinstance(path, (str, Path)) else "record"


def trend_table(data: xr.Dataset) -> pd.DataFrame:
    """A trend as a table, one row for each section and channel: start, GMF, harmonics, level, indicators."""
    rows = []
    for i in range(data.sizes["section"]):
        for channel in data["channel"].values:
            here = data.isel(section=i).sel(channel=channel)
            row: dict[str, Any] = {"start_s": float(here["start"]), "channel": str(channel)}
            if "band" in data:
                row = {"start_s": row["start_s"], "gmf_hz": float(here["gmf"]), "channel": str(channel)}
                for k in data["harmonic"].values:
                    row[f"band_{k}"] = float(here["band"].sel(harmonic=k))
                row |= {name: float(here[name]) for name in ("level", *INDICATORS)}
            else:
                row |= {str(name): float(here[name]) for name in data.data_vars}
            rows.append({**row, "note": str(here["note"].item())})
    return pd.DataFrame(rows)


def _row(report: AnalysisReport | VibrationReport) -> xr.Dataset:
    if isinstance(report, VibrationReport):
        row = report.channel_features()
        row["speed"] = ((), math.nan if report.speed is None else report.speed, {"units": "rad/s"})
        row.attrs = {}
        return row
    row = report.harmonics[["band", "orders"]].drop_vars(["frequency", "channel_units"])
    row["level"] = report.levels["rms"]
    for name in INDICATORS:
        if report.indicators is not None:
            row[name] = report.indicators[name]
        else:
            row[name] = ("channel", np.full(row.sizes["channel"], np.nan))
    row["gmf"] = ((), report.gmf, {"units": "Hz"})
    row["speed"] = ((), report.speed, {"units": "rad/s"})
    row.attrs = {}
    return row


def _pieces(path: Path, format: str | None, settings: Mapping[str, Any]) -> Pieces:
    """Records in the order of the file, each with the fraction of the file that is read then."""
    kind, content = checked_format(path, format)
    known = format_of(kind)
    columns = columns_asked(settings["channels"])
    asked = Asked(content=content, channels=columns, rate=settings["rate"], gaps=settings["gaps"])
    streamed = None if known.pieces is None else known.pieces(path, asked)
    if streamed is not None:
        yield from streamed
        return
    yield record_of(read_signal(path, format=format, **settings)), 1.0


def _signal(
    first: Record, values: np.ndarray, used: int, rate: float | None, path: Path, settings: Mapping[str, Any]
) -> xr.DataArray:
    t0 = first.t0 + (used / rate if rate else 0.0)
    record = replace(first, values=values, names=list(first.names), units=list(first.units), t0=t0)
    return signal_from(record, path, **settings)
