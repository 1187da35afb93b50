"""Arrays of numpy: .npy with one, .npz with several and their names."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.format import Content, Format, begins_with
from gearmbs.signals.signal.record import Record, assemble, metadata_json, record_from_json

OWN = "gearmbs_signal"


def read_npy(path: Path, channels: Sequence[str] | None, rate: float | None = None) -> Record:
    """Read an array (samples by columns or rows, or with named fields), or the arrays of an .npz file.

    Raises
    ------
    SignalFileError
        If the file is damaged, holds Python objects, or no record.
    """
    try:
        with open(path, "rb") as file:
            loaded = np.load(file, allow_pickle=False)
            arrays = {name: loaded[name] for name in loaded.files} if hasattr(loaded, "files") else {path.stem: loaded}
    except Exception as exc:
        raise SignalFileError(
            path, f"cannot be read as an array of numpy: it is damaged, cut short or holds Python objects ({exc})"
        ) from exc
    if OWN in arrays and "data" in arrays:
        return record_from_json(np.atleast_2d(arrays["data"]), str(arrays[OWN].item()), path)
    named: dict[str, np.ndarray] = {}
    for name, array in arrays.items():
        if array.dtype.names:
            named |= {field: array[field] for field in array.dtype.names}
        else:
            named[name] = array
    numbers = {k: v for k, v in named.items() if v.dtype.kind in "fiu" and v.size > 1}
    scalars = {k: _scalar(v) for k, v in named.items() if k not in numbers}
    if list(named) == [path.stem]:
        array = np.squeeze(next(iter(named.values())))
        table = np.atleast_2d(array)
        table = table if table.shape[0] >= table.shape[-1] else table.T
        if table.ndim == 2:
            numbers = {f"ch{i + 1}": table[:, i] for i in range(table.shape[1])}
    return assemble(path, numbers, scalars, {}, channels, rate)


def write_npy(record: Record, path: Path) -> None:
    """Write an .npz archive: `data` (samples x channels) and all metadata as JSON text."""
    with open(path, "wb") as file:
        np.savez(file, data=record.values, gearmbs_signal=np.array(metadata_json(record)))


def _scalar(value: np.ndarray) -> Any:
    if value.size != 1:
        return value
    item = value.reshape(-1)[0].item()
    if isinstance(item, str):
        try:
            return json.loads(item)
        except ValueError:
            return item
    return item


FORMATS = {
    "npy": Format(
        read=lambda path, asked: read_npy(path, asked.channels, asked.rate),
        write=lambda record, path, progress: write_npy(record, path),
        contents={
            "npy": Content("an array of numpy", begins_with(b"\x93NUMPY")),
            "zip": Content("a zip archive, as .npz files are", begins_with(b"PK\x03\x04"), tells=False),
        },
        not_written={".npy": "an .npy file holds one array without rate and units; write .npz, which holds all"},
        through="numpy",
    )
}
