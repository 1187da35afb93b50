"""Universal file format, dataset 58 (time histories), through pyuff.

Written files are binary doubles, one dataset per channel: name in ID line 1, exact rate and start as JSON in ID line 2
(the format's own fields have six digits), speed and teeth in ID line 4, the unit as ordinate label. Other attributes
are not kept.
"""

from __future__ import annotations

import json
import os
import re
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.own_clocks import interpolated, leading, same_length
from gearmbs.signals.files.table import Content, Format
from gearmbs.signals.signal.record import SECONDS, Record, same_rate, same_start
from gearmbs.signals.signal.signal import UNKNOWN_UNITS, check_teeth, nice_rate

START = re.compile(rb"^\s*-1[ \t]*\r?\n[ \t]*\d+[a-z]?\b")
BINARY = re.compile(rb"^\s*58b", re.MULTILINE | re.IGNORECASE)
HEADER_ROWS = 12
UNIT_WIDTH = 20
LINE_WIDTH = 80
# A count of samples over which a step of six digits is good to a twentieth of a sample.
SIX_DIGITS = 5000
TIME_RESPONSE = 1
DATA_TYPES = {"m": 8, "m/s": 11, "m/s^2": 12, "N": 13}
NOT_TIME = (18, 19, 20)
"""Kinds of abscissas that are none of time: frequency, turns a minute, orders."""
LENGTHS = {1: "m", 2: "ft", 3: "m", 4: "ft", 5: "mm", 6: "cm", 7: "in", 8: "mm", 10: "mm"}
"""Unit of length of the systems of units that dataset 164 names; 9 is the user's own."""
SI_UNITS = {8: "m", 11: "m/s", 12: "m/s^2", 13: "N"}


def read_uff(path: Path, channels: Sequence[str] | None) -> Record:
    """Read the time histories (datasets 58) of a UFF file.

    Raises
    ------
    SignalFileError
        If pyuff is not installed, the file is cut short, holds no time history, or its histories differ in length
        or rate.
    """
    pyuff = _library(path)
    with open(path, "rb") as file:
        file.seek(max(0, path.stat().st_size - 400))
        tail = file.read().split()
    if not tail or tail[-1] != b"-1":
        raise SignalFileError(path, "is cut short: its last dataset has no end mark (-1)")
    with _in_full_lines(path) as full:
        try:
            file58 = pyuff.UFF(str(full))
            kinds = [int(k) for k in file58.get_set_types()]
            sets = [file58.read_sets(i) for i, kind in enumerate(kinds) if kind == 58]
            systems = {int(file58.read_sets(i)["units_code"]) for i, kind in enumerate(kinds) if kind == 164}
        except Exception as exc:
            raise SignalFileError(path, f"cannot be read as UFF ({exc})") from exc
    histories = [
        s for s in sets if s["func_type"] in (0, TIME_RESPONSE) and not np.iscomplexobj(s["data"]) and _is_over_time(s)
    ]
    if not histories:
        raise SignalFileError(path, f"holds no time history (dataset 58, function type 1); its datasets are {kinds}")
    notes = []
    for index, s in enumerate(histories, 1):
        if len(s["data"]) < s["num_pts"]:
            notes.append(f"History {index} promises {s['num_pts']} samples, {len(s['data'])} are there and used.")
        s["data"] = s["data"][: s["num_pts"]]
        if not len(s["data"]):
            raise SignalFileError(path, f"history {index} holds no samples")
        if not _json(s["id2"]) and not float(s["abscissa_inc"] or 0.0) > 0.0 and s["abscissa_spacing"]:
            raise SignalFileError(
                path, f"history {index} has the step {s['abscissa_inc']:g} between samples; write the true one"
            )
        if not s["abscissa_spacing"]:
            raise SignalFileError(path, f"history {index} is unevenly sampled; resample it first")
    names = _names(histories)
    kept = [(n, s) for n, s in zip(names, histories) if channels is None or n in channels]
    if not kept:
        raise SignalFileError(path, f"has no channel {list(channels or [])}; it holds {names}")
    names, units = [n for n, _ in kept], [_unit(s, systems) for _, s in kept]
    rate, t0, columns, said = _on_one_clock(path, [s for _, s in kept], names, units)
    notes += said
    extra = _json(kept[0][1]["id4"])
    return Record(
        np.stack(columns, axis=1),
        names,
        units,
        rate,
        t0,
        extra.get("speed"),
        None if extra.get("teeth") is None else check_teeth(extra["teeth"]),
        notes=notes,
    )


def _on_one_clock(
    path: Path, histories: Sequence[dict], names: Sequence[str], units: Sequence[str]
) -> tuple[float, float, list[np.ndarray], list[str]]:
    """Return rate (Hz), start (s) and columns of histories at the times of vibration, and what is said of others."""
    columns = [np.asarray(s["data"], dtype=float) for s in histories]
    clocks = [_clock(s) for s in histories]
    fast = leading(names, units, [column.size for column in columns])
    rates = {names[i]: clocks[i][0] for i in fast}
    same_rate(path, rates)
    rate, t0 = clocks[fast[0]]
    same_start(path, {names[i]: clocks[i][1] for i in fast}, rate)
    same_length(path, {names[i]: columns[i].size for i in fast})
    base, said = t0 + np.arange(columns[fast[0]].size) / rate, []
    for i, (own, begin) in enumerate(clocks):
        if i in fast or (columns[i].size == base.size and (own, begin) == (rate, t0)):
            continue
        times = begin + np.arange(columns[i].size) / own
        columns[i], words = interpolated(path, names[i], base, times, columns[i])
        said.append(words)
    return rate, t0, columns, said


def write_uff(record: Record, path: Path) -> None:
    """Write one binary dataset 58 per channel."""
    pyuff = _library(path)
    clock = json.dumps({"rate": record.rate, "t0": record.t0})
    extra = json.dumps({"speed": record.speed, "teeth": record.teeth})
    for name, unit in zip(record.names, record.units):
        if len(unit) > UNIT_WIDTH or len(name) > LINE_WIDTH or len(extra) > LINE_WIDTH:
            raise SignalFileError(
                path, f"UFF cannot hold the name {name!r}, unit {unit!r} or teeth: too long for its fields"
            )
    times = record.t0 + np.arange(max(2, record.values.shape[0])) / float(record.rate or 1.0)
    sets = []
    for index, (name, unit) in enumerate(zip(record.names, record.units), 1):
        sets.append(
            {
                "type": 58,
                "binary": 1,
                "id1": name,
                "id2": clock,
                "id4": extra,
                "func_type": TIME_RESPONSE,
                "rsp_node": index,
                "rsp_dir": 0,
                "ref_node": 0,
                "ref_dir": 0,
                "data": np.ascontiguousarray(record.values[:, index - 1]),
                "x": times,
                "abscissa_spacing": 1,
                "abscissa_spec_data_type": 17,
                "abscissa_axis_lab": "Time",
                "abscissa_axis_units_lab": "s",
                "ordinate_spec_data_type": DATA_TYPES.get(unit, 0),
                "ordinate_axis_lab": name[:UNIT_WIDTH],
                "ordinate_axis_units_lab": unit,
                "orddenom_spec_data_type": 0,
                "z_axis_spec_data_type": 0,
            }
        )
    # pyuff's own "overwrite" loses the header of binary sets; an empty file to add to does not.
    path.write_bytes(b"")
    with warnings.catch_warnings():
        # behind binary data pyuff leaves its file to the interpreter to close
        warnings.simplefilter("ignore", ResourceWarning)
        pyuff.UFF(str(path)).write_sets(sets, mode="add")


@contextmanager
def _in_full_lines(path: Path) -> Iterator[Path]:
    """The path of a text UFF with lines as pyuff expects them; the file itself where it is so, or is binary.

    Programs write marks (-1) padded by any number of blanks, headers cut off behind the last letter, and last rows of
    which not all columns are filled.
    """
    data = path.read_bytes()
    if BINARY.search(data):
        yield path
        return
    lines, inside, row = [], False, 0
    for line in data.removeprefix(b"\xef\xbb\xbf").splitlines():
        if line.strip() == b"-1" and len(line.rstrip()) <= 6:
            inside, row = not inside, 0
            lines.append(b"    -1")
        elif inside:
            row += 1
            lines.append(line[:80].ljust(80) if 1 < row <= HEADER_ROWS else line.rstrip())
    full = b"\n".join(lines) + b"\n"
    handle, name = tempfile.mkstemp(suffix=".uff")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(full)
        yield Path(name)
    finally:
        Path(name).unlink(missing_ok=True)


def _names(histories: list[dict]) -> list[str]:
    raw = []
    for index, s in enumerate(histories, 1):
        text = str(s["id1"]).strip()
        raw.append(text if text and text.upper() != "NONE" else f"ch{index}")
    return [n if raw.count(n) == 1 else f"{n}_{raw[:i].count(n) + 1}" for i, n in enumerate(raw)]


def _is_over_time(s: dict) -> bool:
    """Return whether a set is over time, and not over frequency, speed or orders."""
    return int(s.get("abscissa_spec_data_type", 0)) not in NOT_TIME and _abscissa_unit(s) not in ("hz", "khz", "rpm")


def _abscissa_unit(s: dict) -> str:
    label = str(s.get("abscissa_axis_units_lab", "")).strip().lower()
    return "" if label == "none" else label


def _clock(s: dict) -> tuple[float, float]:
    exact = _json(s["id2"])
    if "rate" in exact:
        return float(exact["rate"]), float(exact["t0"])
    second = SECONDS.get(_abscissa_unit(s), 1.0)
    step = float(s["abscissa_inc"])
    return nice_rate(1.0 / (second * step), second * step, SIX_DIGITS), second * float(s["abscissa_min"])


def _unit(s: dict, systems: set[int]) -> str:
    """Return the unit of the samples: its label's, or that of the quantity in the system of units of the file."""
    label = str(s.get("ordinate_axis_units_lab", "")).strip()
    if label and label.upper() != "NONE":
        return label
    unit = SI_UNITS.get(int(s.get("ordinate_spec_data_type", 0)), UNKNOWN_UNITS)
    if not systems or systems == {1}:
        return unit
    (length,) = {LENGTHS.get(system) for system in systems} if len(systems) == 1 else {None}
    return length + unit[1:] if length is not None and unit in ("m", "m/s", "m/s^2") else UNKNOWN_UNITS


def _json(text: Any) -> dict:
    try:
        found = json.loads(str(text))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _library(path: Path) -> Any:
    try:
        import pyuff
    except ImportError as exc:
        raise SignalFileError(path, "UFF files need pyuff; install it with: pip install 'gearmbs[formats]'") from exc
    return pyuff


FORMATS = {
    "uff58": Format(
        read=lambda path, asked: read_uff(path, asked.channels),
        write=lambda record, path, progress: write_uff(record, path),
        contents={
            "uff58": Content(
                "a universal file", lambda head: START.match(head.removeprefix(b"\xef\xbb\xbf")) is not None
            )
        },
        through="pyuff (extra `formats`), binary doubles",
        keeps_attributes=False,
    )
}
