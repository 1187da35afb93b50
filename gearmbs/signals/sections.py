"""Long files piece by piece: sections of a given length, so that memory does not grow with the file.

Text, WAV, TDMS and this package's own NetCDF and HDF5 files are read as far as a section needs; other files are read
at once and then cut.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from .analysis import analyse
from .errors import SignalError, SignalFileError
from .indicators import INDICATORS
from .io import checked_format, read_signal
from .io_csv import csv_pieces
from .io_hdf import hdf_pieces
from .io_tdms import tdms_pieces
from .io_wav import wav_pieces
from .record import Record, signal_from
from .signal import require

Progress = Callable[[float, str], None]
Pieces = Iterator[tuple[Record, float]]
LEAST_PART = 0.5


def sections(
    path: str | Path,
    seconds: float,
    *,
    rate: float | None = None,
    units: str | Sequence[str] | Mapping[str, str] | None = None,
    speed: float | None = None,
    teeth: int | Sequence[int] | None = None,
    channels: Sequence[str] | None = None,
    format: str | None = None,
    progress: Progress | None = None,
) -> Iterator[xr.DataArray]:
    """Read a file section by section.

    Parameters
    ----------
    path : path-like
        As for `read_signal`.
    seconds : float
        Length of a section in s. What is left at the end is a section of its own if it is half as long or more, and
        left out otherwise.
    rate, units, speed, teeth, channels, format
        As for `read_signal`.
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
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise SignalError(f"seconds: must be a positive length of a section, got {seconds!r}")
    path = Path(path)
    settings: dict[str, Any] = {"rate": rate, "units": units, "speed": speed, "teeth": teeth, "channels": channels}
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


def trend(
    path: str | Path,
    seconds: float,
    *,
    teeth: int | Sequence[int] | None = None,
    speed: float | None = None,
    speed_range: tuple[float, float] | None = None,
    harmonics: int = 3,
    progress: Progress | None = None,
    **reading: Any,
) -> xr.Dataset:
    """Features of a long file over time: each section analysed on its own, in memory for one section.

    Parameters
    ----------
    path, seconds
        As for `sections`.
    teeth, speed, speed_range, harmonics
        As for `analyse`.
    progress : callable, optional
        Called as progress(fraction, stage).
    **reading
        `rate`, `units`, `channels`, `format` as for `read_signal`.

    Returns
    -------
    xarray.Dataset
        `band` and `orders` of dimensions (section, harmonic, channel); the level (`level`) and every condition
        indicator of dimensions (section, channel); `gmf` (Hz) and `speed` (rad/s) of dimension (section,), NaN with
        all features where no mesh line was found; coordinate `start` (s) and, along section, `note` (why).

    Raises
    ------
    SignalFileError, MissingMetadataError
        As `read_signal` and `analyse`.
    SignalError
        If no section could be analysed; with the last reason.
    """
    rows: list[xr.Dataset | None] = []
    starts, notes = [], []
    done = [0.0]
    for section in sections(path, seconds, teeth=teeth, progress=lambda f, _: done.__setitem__(0, f), **reading):
        starts.append(float(section["time"].values[0]))
        require(section, "teeth", needed_for="the gear mesh frequency")
        try:
            report = analyse(section, speed=speed, speed_range=speed_range, harmonics=harmonics, lines=1)
        except SignalError as error:
            rows.append(None)
            notes.append(str(error))
        else:
            rows.append(_row(report))
            notes.append("; ".join(report.notes))
        if progress is not None:
            progress(done[0], f"section {len(starts)}")
    found = next((row for row in rows if row is not None), None)
    if found is None:
        raise SignalError(f"{path}: no section could be analysed; the last says: {notes[-1]}")
    empty = xr.full_like(found, np.nan)
    table = xr.concat([empty if row is None else row for row in rows], "section", join="outer")
    return table.assign_coords(start=("section", starts, {"units": "s"}), note=("section", notes))


def trend_table(data: xr.Dataset) -> pd.DataFrame:
    """A trend as a table, one row for each section and channel: start, GMF, harmonics, level, indicators."""
    rows = []
    for i in range(data.sizes["section"]):
        for channel in data["channel"].values:
            here = data.isel(section=i).sel(channel=channel)
            row = {"start_s": float(here["start"]), "gmf_hz": float(here["gmf"]), "channel": str(channel)}
            for k in data["harmonic"].values:
                row[f"band_{k}"] = float(here["band"].sel(harmonic=k))
            row |= {name: float(here[name]) for name in ("level", *INDICATORS)}
            rows.append({**row, "note": str(here["note"].item())})
    return pd.DataFrame(rows)


def _row(report: Any) -> xr.Dataset:
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
    streamed: Pieces | None = None
    if kind in ("csv", "csv.gz"):
        streamed = csv_pieces(path, kind == "csv.gz", settings["rate"])
    elif kind == "wav":
        streamed = wav_pieces(path)
    elif kind == "tdms":
        streamed = tdms_pieces(path, settings["channels"])
    elif content == "hdf5" and kind in ("netcdf", "hdf5"):
        streamed = hdf_pieces(path)
    if streamed is not None:
        yield from streamed
        return
    whole = read_signal(path, format=format, **settings)
    record = Record(
        whole.values,
        [str(c) for c in whole["channel"].values],
        [str(u) for u in whole["units"].values],
        float(whole.attrs["sampling_rate"]),
        float(whole["time"].values[0]),
        whole.attrs.get("speed"),
        whole.attrs.get("teeth"),
    )
    yield record, 1.0


def _signal(
    first: Record, values: np.ndarray, used: int, rate: float | None, path: Path, settings: Mapping[str, Any]
) -> xr.DataArray:
    t0 = first.t0 + (used / rate if rate else 0.0)
    record = replace(first, values=values, names=list(first.names), units=list(first.units), t0=t0)
    return signal_from(record, path, **settings)
