"""MATLAB .mat files: versions 5 to 7 through SciPy, version 7.3 (HDF5 with MATLAB's conventions) through h5py.

Written files hold `data` (samples x channels), `sampling_rate`, `t0`, cell arrays `channels` and `units`, and where
known `speed`, `teeth` and `attrs` (JSON text).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.io

from .errors import SignalFileError
from .record import Record, assemble, plain
from .signal import check_teeth

USER_BLOCK = 512
HEADER_TEXT = b"MATLAB 7.3 MAT-file, Platform: any, Created by: gearmbs HDF5 schema 1.00 ."
VERSION_AND_ENDIAN = b"\x00\x02IM"


def read_mat(path: Path, channels: Sequence[str] | None) -> Record:
    """Read a MATLAB file of version 5 to 7.3, written here or elsewhere.

    Structs are searched too (names joined by dots). Without this package's layout, numeric arrays of equal length
    become channels and a scalar such as fs gives the rate.

    Raises
    ------
    SignalFileError
        If the file is damaged or holds no record, or several of different lengths.
    """
    try:
        if h5py.is_hdf5(path):
            with h5py.File(path, "r") as file:
                tree = {k: _from_hdf(v, file) for k, v in file.items() if not k.startswith("#")}
        else:
            loaded = scipy.io.loadmat(path, simplify_cells=True)
            tree = {k: v for k, v in loaded.items() if not k.startswith("__")}
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as a MATLAB file: it is damaged or cut short ({exc})") from exc
    flat = _flatten(tree)
    if {"data", "sampling_rate", "channels", "units", "t0"} <= set(flat):
        return _own(flat, path)
    arrays = {k: v for k, v in flat.items() if isinstance(v, np.ndarray) and v.dtype.kind in "fiu" and v.size > 1}
    scalars = {k.rsplit(".", 1)[-1]: _scalar(v) for k, v in flat.items() if k not in arrays}
    return assemble(path, arrays, scalars, {}, channels)


def write_mat(record: Record, path: Path, version: str) -> None:
    """Write a MATLAB file, `version` "mat5" or "mat7.3"."""
    contents: dict[str, Any] = {
        "data": record.values,
        "sampling_rate": float(record.rate or 0.0),
        "t0": record.t0,
        "channels": record.names,
        "units": record.units,
        "attrs": json.dumps(plain(record.attrs)),
    }
    if record.speed is not None:
        contents["speed"] = record.speed
    if record.teeth is not None:
        contents["teeth"] = np.asarray(record.teeth, dtype=float)
    if version == "mat5":
        if record.values.nbytes >= 2**31:
            raise SignalFileError(path, "is too large for MATLAB's version 5 (2 GiB an array); use format='mat7.3'")
        cells = {k: np.array(v, dtype=object) if isinstance(v, list) else v for k, v in contents.items()}
        scipy.io.savemat(path, cells, do_compression=True)
        return
    with h5py.File(path, "w", userblock_size=USER_BLOCK) as file:
        for name, value in contents.items():
            _to_hdf(file, name, value)
    with open(path, "r+b") as raw:
        raw.write(HEADER_TEXT.ljust(124) + VERSION_AND_ENDIAN)


def _own(flat: Mapping[str, Any], path: Path) -> Record:
    names = [str(n) for n in np.atleast_1d(flat["channels"])]
    values = np.asarray(flat["data"], dtype=float)
    values = values.reshape(-1, len(names))
    units = [str(u) for u in np.atleast_1d(flat["units"])]
    if len(units) != len(names):
        raise SignalFileError(path, f"names {len(names)} channels but {len(units)} units")
    speed, teeth = flat.get("speed"), flat.get("teeth")
    attrs = str(flat.get("attrs", "{}"))
    return Record(
        values,
        names,
        units,
        float(flat["sampling_rate"]),
        float(flat["t0"]),
        None if speed is None else float(speed),
        None if teeth is None else check_teeth(teeth),
        json.loads(attrs or "{}"),
    )


def _flatten(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in tree.items():
        if isinstance(value, Mapping):
            flat.update(_flatten(value, f"{prefix}{key}."))
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def _scalar(value: Any) -> Any:
    if isinstance(value, np.ndarray) and value.size == 1:
        return value.item()
    return value


def _from_hdf(item: Any, file: h5py.File) -> Any:
    if isinstance(item, h5py.Group):
        return {k: _from_hdf(v, file) for k, v in item.items()}
    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode() if isinstance(kind, bytes) else str(kind)
    if item.attrs.get("MATLAB_empty"):
        return "" if kind == "char" else np.empty(0)
    value = item[()]
    if kind == "char":
        return "".join(chr(c) for c in np.asarray(value).T.ravel())
    if item.dtype == h5py.ref_dtype:
        cells = [_from_hdf(file[ref], file) for ref in np.asarray(value).T.ravel()]
        return np.array(cells, dtype=object) if all(isinstance(c, str) for c in cells) else cells
    array = np.asarray(value)
    # MATLAB stores by columns, HDF5 by rows: dimensions come out reversed.
    array = array.T
    return array.item() if array.size == 1 and kind != "cell" else array


def _to_hdf(parent: h5py.Group, name: str, value: Any) -> h5py.Dataset:
    if isinstance(value, str):
        codes = np.frombuffer(value.encode("utf-16-le"), dtype="<u2").reshape(-1, 1)
        dataset = parent.create_dataset(name, data=codes if codes.size else np.zeros(2, dtype="<u8"))
        dataset.attrs["MATLAB_class"] = np.bytes_("char")
        dataset.attrs["MATLAB_int_decode"] = np.int32(2)
        if not codes.size:
            dataset.attrs["MATLAB_empty"] = np.uint8(1)
        return dataset
    if isinstance(value, list):
        store = parent.require_group("#refs#")
        refs = [_to_hdf(store, f"{name}_{i}", text).ref for i, text in enumerate(value)]
        dataset = parent.create_dataset(name, (len(refs), 1), dtype=h5py.ref_dtype)
        for i, ref in enumerate(refs):
            dataset[i, 0] = ref
        dataset.attrs["MATLAB_class"] = np.bytes_("cell")
        return dataset
    array = np.atleast_2d(np.asarray(value, dtype=float))
    chunks = {"chunks": True, "compression": "gzip"} if array.size > 1000 else {}
    dataset = parent.create_dataset(name, data=np.ascontiguousarray(array.T), **chunks)
    dataset.attrs["MATLAB_class"] = np.bytes_("double")
    return dataset
