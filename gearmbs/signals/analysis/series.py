"""Many files as one series, as of a run to failure or of loads: each analysed on its own, all in one table."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal, Unpack

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs.files import keep
from gearmbs.progress import bars
from gearmbs.signals.analysis.analysis import AnalysisKeywords, AnalysisOptions, analyse
from gearmbs.signals.analysis.report import By, feature_rows, rows_to_frame
from gearmbs.signals.analysis.sections import ReadingKeywords, sections
from gearmbs.signals.errors import SignalError, SignalFileError
from gearmbs.signals.files.simulated import read_any
from gearmbs.signals.files.table import known_endings
from gearmbs.signals.signal.signal import UNKNOWN_UNITS, like, units_of
from gearmbs.signals.signal.units import unit_dimension
from gearmbs.system import rename_over
from gearmbs.wording import warn

Progress = Callable[[str, float], None]
Files = str | Path | Iterable[str | Path] | Mapping[Any, str | Path]
READING = ("rate", "units", "channels", "gaps", "format")


class SeriesKeywords(ReadingKeywords, AnalysisKeywords, total=False):
    """How the files of a `series` are read and analysed, for type checkers."""

    planetary: Any


def series(
    files: Files,
    *,
    teeth: int | Sequence[int] | None = None,
    store: str | Path | None = None,
    section: float | str | None = None,
    by: By = "record",
    errors: Literal["keep", "raise"] = "keep",
    progress: bool | Progress | None = None,
    **settings: Unpack[SeriesKeywords],
) -> pd.DataFrame:
    """Analyse many files one after the other, and put their features into one table.

    One record is in memory at a time. With `store` every finished file is noted at once in a journal beside it
    (``NAME.rows.jsonl``); a call that was interrupted, by whatever, takes up what is there and ends with the same
    table. Files that come later are analysed by calling again.

    Parameters
    ----------
    files : path, sequence of paths, or mapping
        A folder (all files in it whose names end as those of known formats do, or all if none does), a pattern such as
        ``"run/*.csv"``, a list, or a mapping of labels (a load, a date) to files. Names are sorted as people count: 2
        before 10.
    teeth : int or sequence, optional
        As for `analyse`.
    store : path-like, optional
        CSV or Parquet file for the table; it appears when all files are done.
    section : float or str, optional
        Cut each file into sections of this length (s, or "10 s"), a row for each.
    by : {"record", "channel"}
        As for `features`.
    errors : {"keep", "raise"}
        Whether a file that cannot be read or analysed becomes a row whose `notes` say why, or ends the call.
    progress : bool or callable, optional
        As everywhere in the package (`gearmbs.progress`): a bar where somebody watches and it takes longer than two
        seconds. A callable is told (name of the file, fraction of all).
    **settings
        `rate`, `units`, `channels`, `gaps` and `format` as for `read_signal`, and the settings of `analyse`.

    Returns
    -------
    DataFrame
        `file`, `label` if there are labels, `start_s` of sections, then as `features`, and `units`: those of the first
        file, into which the others are converted with a remark. Where that cannot be, a remark says CHECK THE UNITS.

    Raises
    ------
    SignalError
        If there are no files, or `store` was begun with other settings.
    """
    if errors not in ("keep", "raise"):
        raise SignalError(f"errors: must be 'keep' or 'raise', got {errors!r}")
    analysing: dict[str, Any] = {k: v for k, v in settings.items() if k not in READING}
    AnalysisOptions(**analysing)
    paths, labels = _files(files)
    journal = None
    if store is not None:
        journal = Journal(Path(store), _digest({"teeth": teeth, "section": section, "by": by, **settings}))
    rows: list[dict[str, Any]] = []
    first: list[str] = []
    wanted: dict[str, str] = {}
    name = "series"
    own = progress if callable(progress) else None
    with bars(None if own is not None else progress, [name]) as move:  # type: ignore[arg-type]
        for i, path in enumerate(paths):
            kept = None if journal is None else journal.rows_of(path)
            if kept is None:
                kept = _rows(path, teeth, section, by, errors, settings, wanted)
                if journal is not None:
                    journal.add(path, kept)
            wanted = wanted or next((row["units"] for row in kept if isinstance(row.get("units"), dict)), {})
            head: dict[str, Any] = {"file": path.name} | ({} if labels is None else {"label": labels[i]})
            first = first or _channels(kept)
            rows += [{**head, **_with_units(_renamed(row, first))} for row in kept]
            if own is not None:
                own(path.name, (i + 1) / len(paths))
            elif move is not None:
                move(name, (i + 1) / len(paths))
    table = rows_to_frame(rows)
    if store is not None:
        _write(table, Path(store))
    return table


def finished_files(files: Files, store: str | Path) -> tuple[int, int]:
    """Return how many files of a series its journal holds already, and how many there are."""
    paths, _ = _files(files)
    journal = _journal_path(Path(store))
    try:
        entries = [_entry(line) for line in journal.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]
    except OSError:
        return 0, len(paths)
    keys = {entry["key"] for entry in entries if entry is not None and "key" in entry}
    return sum(_key(path) in keys for path in paths), len(paths)


def _journal_path(store: Path) -> Path:
    return store.with_name(f"{store.stem}.rows.jsonl")


class StoreWarning(UserWarning):
    """The journal of a series cannot be written any more; the series itself goes on."""


class Journal:
    """What is finished of a series, one line a file, so that it outlives the process.

    Parameters
    ----------
    store : Path
        The table's file; the journal lies beside it.
    digest : str
        Of the settings.

    Raises
    ------
    SignalError
        If the journal was begun with other settings, or cannot be written.
    """

    def __init__(self, store: Path, digest: str) -> None:
        self.path = _journal_path(store)
        self.broken = False
        self.done: dict[str, list[dict[str, Any]]] = {}
        try:
            store.parent.mkdir(parents=True, exist_ok=True)
            lines = self.path.read_bytes().splitlines(keepends=True) if self.path.exists() else []
            # a line that was being written when the process ended is not whole
            whole = [line for line in lines if line.endswith(b"\n")]
            if len(whole) < len(lines):
                os.truncate(self.path, sum(map(len, whole)))
            if not whole:
                self.path.write_text(json.dumps({"settings": digest}) + "\n", encoding="utf-8")
        except OSError as exc:
            raise SignalError(f"store: {self.path} cannot be written ({exc.strerror}); choose another place") from exc
        entries = [_entry(line) for line in whole]
        if entries and (entries[0] or {}).get("settings") != digest:
            raise SignalError(
                f"store: {self.path} was begun with other settings; take another store, or delete it to begin again"
            )
        for entry in entries[1:]:
            if entry is not None and "key" in entry:
                self.done[entry["key"]] = entry["rows"]

    def rows_of(self, path: Path) -> list[dict[str, Any]] | None:
        """The rows of a file that is finished and has not changed since, else None."""
        return self.done.get(_key(path))

    def add(self, path: Path, rows: list[dict[str, Any]]) -> None:
        """Note the rows of a finished file."""
        if self.broken:
            return
        line = json.dumps({"key": _key(path), "rows": rows}) + "\n"
        try:
            with open(self.path, "a", encoding="utf-8") as file:
                file.write(line)
        except OSError as error:
            # the work goes on; what is half written of the line is left out by the next call
            self.broken = True
            warn(
                f"store: {self.path} cannot be written ({error.strerror or error}); files after {path.name} would have "
                "to be analysed again if this is interrupted",
                StoreWarning,
            )


def _channels(rows: list[dict[str, Any]]) -> list[str]:
    """The channels that rows speak of."""
    named = [row["channel"] for row in rows if "channel" in row]
    return list(dict.fromkeys(named or [key[: -len(".rms")] for row in rows for key in row if key.endswith(".rms")]))


def _renamed(row: dict[str, Any], first: list[str]) -> dict[str, Any]:
    """A row whose channels are called as those of the first file, where a file's number is part of their names."""
    own = _channels([row])
    if not first or len(own) != len(first) or set(own) & set(first):
        return row
    names = {f"{name}.": f"{other}." for name, other in zip(own, first)}
    out = {}
    for key, value in row.items():
        prefix = next((name for name in names if key.startswith(name)), None)
        out[key if prefix is None else names[prefix] + key[len(prefix) :]] = value
    out["notes"] = "; ".join([*filter(None, [row.get("notes")]), f"its channels are called {', '.join(own)}"])
    return out


def _entry(line: bytes) -> dict[str, Any] | None:
    try:
        found = json.loads(line)
    except ValueError:
        return None
    return found if isinstance(found, dict) else None


def _key(path: Path) -> str:
    """Name, size and time of change of a file."""
    try:
        about = path.stat()
    except OSError:
        return f"{path.resolve()}|missing"
    return f"{path.resolve()}|{about.st_size}|{about.st_mtime_ns}"


def _with_units(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row with the units of its channels in words."""
    units = row.get("units")
    if not isinstance(units, dict):
        return row
    if "channel" in row:
        return {**row, "units": units.get(row["channel"], UNKNOWN_UNITS)}
    alike = len(set(units.values())) == 1
    return {**row, "units": next(iter(units.values())) if alike else "; ".join(f"{n}: {u}" for n, u in units.items())}


def _in_units(signal: xr.DataArray, wanted: Mapping[str, str]) -> xr.DataArray:
    """Return a signal in the units of the first file, as far as they are known and of one kind, and say so."""
    names, units = [str(c) for c in signal["channel"].values], units_of(signal)
    if not wanted:
        return signal
    by_place = len(wanted) == len(names) and not set(wanted) & set(names)
    told = list(wanted.values()) if by_place else [wanted.get(name) for name in names]
    factors, new, notes = np.ones(len(names)), list(units), []
    for i, (name, unit, first) in enumerate(zip(names, units, told)):
        if first is None or unit == first:
            continue
        kinds = []
        for one in (unit, first):
            try:
                kinds.append(unit_dimension(one))
            except SignalError:
                kinds.append(("", 1.0))
        (kind, factor), (other, reference) = kinds
        if kind and kind == other:
            factors[i], new[i] = factor / reference, first
            notes.append(f"{name!r} is in {unit} here, and converted to {first}, the unit of the first file.")
        else:
            notes.append(f"CHECK THE UNITS: {name!r} is in {unit} here, in {first} in the first file.")
    if not notes:
        return signal
    kept = signal if new == units else like(signal, signal.values * factors, units=new)
    return kept.assign_attrs(notes=[*signal.attrs.get("notes", ()), *notes])


def _units_told(signal: xr.DataArray, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return rows with the units of the channels that they speak of."""
    known = dict(zip(map(str, signal["channel"].values), units_of(signal)))
    units = {name: known[name] for name in _channels(rows) if name in known}
    return [row | ({"units": units} if units else {}) for row in rows]


def _rows(
    path: Path,
    teeth: Any,
    section: float | str | None,
    by: By,
    errors: str,
    settings: Mapping[str, Any],
    wanted: Mapping[str, str],
) -> list[dict[str, Any]]:
    """Rows of plain values of one file, one row with the reason if it cannot be analysed."""
    reading = {key: settings[key] for key in READING if settings.get(key) is not None}
    analysing = {key: value for key, value in settings.items() if key not in READING}
    helpers = [analysing[key] for key in ("tacho", "speed_channel") if analysing.get(key) is not None]
    asked = {}
    if reading.get("channels") is not None:
        asked = {"channels": reading["channels"]}
        reading["channels"] = list(dict.fromkeys([*reading["channels"], *helpers]))
    try:
        if section is None:
            signal = _in_units(read_any(path, **reading), wanted)
            return _units_told(signal, feature_rows(analyse(signal, teeth, **asked, **analysing), by))
        rows = []
        for whole in sections(path, section, **reading):
            part = _in_units(whole, wanted)
            start = float(part["time"].values[0])
            found = _part_rows(part, teeth, by, errors, asked | analysing)
            rows += [{"start_s": start, **row} for row in _units_told(part, found)]
        return rows
    except SignalError as error:
        if errors == "raise":
            raise
        return [{"source": path.name, "notes": str(error)}]


def _part_rows(
    part: xr.DataArray, teeth: Any, by: By, errors: str, analysing: Mapping[str, Any]
) -> list[dict[str, Any]]:
    try:
        return feature_rows(analyse(part, teeth, **analysing), by)
    except SignalError as error:
        if errors == "raise":
            raise
        return [{"source": str(part.attrs.get("source", "signal")), "notes": str(error)}]


def _files(files: Files) -> tuple[list[Path], list[Any] | None]:
    """The files of a series in their order, and their labels."""
    if isinstance(files, Mapping):
        return _paths(files.values()), list(files)
    if isinstance(files, (str, Path)):
        folder = Path(files)
        if folder.is_dir():
            found = [path for path in folder.iterdir() if path.is_file() and not path.name.startswith(".")]
            known = [path for path in found if any(path.name.lower().endswith(suffix) for suffix in known_endings())]
            paths = sorted(known or found, key=_counted)
        elif any(sign in str(files) for sign in "*?["):
            base = Path(folder.anchor) if folder.is_absolute() else Path()
            pattern = str(folder.relative_to(folder.anchor)) if folder.is_absolute() else str(folder)
            paths = sorted((path for path in base.glob(pattern) if path.is_file()), key=_counted)
        else:
            paths = [folder]
    else:
        paths = _paths(files)
    if not paths:
        raise SignalError(f"files: {files} names no file")
    if len(paths) == 1 and not paths[0].exists():
        raise SignalFileError(paths[0], "cannot be opened (No such file or directory)")
    return paths, None


def _paths(files: Iterable[str | Path]) -> list[Path]:
    """The files of a list or mapping as paths."""
    try:
        return [Path(path) for path in files]
    except TypeError:
        raise SignalError(
            "files: must be paths, a folder or a pattern; samples in memory go into analyse one by one, "
            "and their reports into features"
        ) from None


def _counted(path: Path) -> list[tuple[int, float, str]]:
    """Key of a name that sorts its numbers as numbers."""
    parts = re.split(r"(\d+)", path.name)
    return [(0, float(part), "") if part.isdigit() else (1, 0.0, part) for part in parts if part]


def _digest(value: Any) -> str:
    """A text that tells settings apart."""
    found = hashlib.sha256()

    def feed(item: Any) -> None:
        if isinstance(item, Mapping):
            for key in sorted(item, key=str):
                if item[key] is not None:
                    feed(str(key))
                    feed(item[key])
        elif isinstance(item, (list, tuple)):
            found.update(b"[")
            for one in item:
                feed(one)
        elif isinstance(item, (np.ndarray, xr.DataArray, pd.Series)):
            found.update(np.ascontiguousarray(np.asarray(item)).tobytes())
        elif callable(item):
            found.update(getattr(item, "__qualname__", type(item).__name__).encode())
        else:
            found.update(repr(item).encode() + b"|")

    feed(value)
    return found.hexdigest()[:16]


def _write(table: pd.DataFrame, store: Path) -> None:
    """Write the table, and if that is impossible somewhere else where it is possible.

    Raises
    ------
    SignalError
        If it could not be written where it was wanted; the message says where it is instead, if anywhere.
    """
    try:
        keep(lambda place: _write_whole(table, place), store)
    except (OSError, ImportError) as exc:
        raise SignalError(f"store: {exc}") from exc


def _write_whole(table: pd.DataFrame, store: Path) -> None:
    """Write the table; it appears under its name when it is whole."""
    part = store.with_name(f".{store.name}.part")
    store.parent.mkdir(parents=True, exist_ok=True)
    try:
        if store.suffix.lower() in (".parquet", ".pq"):
            table.to_parquet(part)
        else:
            table.to_csv(part, index=False, float_format=_shortest)
        rename_over(part, store)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def _shortest(value: float) -> str:
    return "" if math.isnan(value) else repr(float(value))
