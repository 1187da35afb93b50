"""MATLAB .mat files: versions 5 to 7 through SciPy, version 7.3 (HDF5 with MATLAB's conventions) through h5py.

Written files hold `data` (samples x channels), `sampling_rate`, `t0`, cell arrays `channels` and `units`, and where
known `speed`, `teeth` and `attrs` (JSON text).
"""

from __future__ import annotations

import io
import json
import math
import struct
import warnings
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.files import json_value
from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.named_arrays import assemble
from gearmbs.signals.files.table import Content, Format, begins_with
from gearmbs.signals.signal.record import Record
from gearmbs.signals.signal.signal import check_teeth

if TYPE_CHECKING:
    import h5py

# Whether a MATLAB 5 file is whole: the tags of its elements fit into each other, its arrays hold what they promise.
#
# The library that reads these files trusts them, and may take minutes, or the whole program with it, where one is
# damaged inside.


MATRIX, COMPRESSED_ELEMENT = 14, 15
SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
"""Bytes of a number by its type."""
CELL, STRUCT, OBJECT, CHAR, SPARSE = 1, 2, 3, 4, 5
NUMERIC = range(6, 16)
WHOLE = (5, 6)
"""Types of dimensions; some programs write them without a sign."""
LARGEST = 1 << 28
"""Larger files are not checked: it takes their size in memory."""
DEEPEST = 32


def check_mat5(data: bytes) -> None:
    """Raise a ValueError if the elements of a file of version 5 do not fit together.

    Parameters
    ----------
    data : bytes
        The whole file, its header of 128 bytes included.
    """
    if len(data) > LARGEST:
        return
    order = "<" if data[126:128] == b"IM" else ">"
    at = 128
    while at < len(data):
        kind, body, at = _element(data, at, order)
        if kind == COMPRESSED_ELEMENT:
            try:
                body = zlib.decompress(body)
            except zlib.error as exc:
                raise ValueError(f"a compressed variable is damaged ({exc})") from exc
            kind, body, _ = _element(body, 0, order)
        if kind == MATRIX:
            _matrix(body, order, 0)


def _element(data: bytes, at: int, order: str) -> tuple[int, bytes, int]:
    """Type and content of the element at a place, and where the next begins."""
    if at + 8 > len(data):
        raise ValueError("an element is cut off")
    first, size = struct.unpack(f"{order}II", data[at : at + 8])
    if first >> 16:
        size, kind = first >> 16, first & 0xFFFF
        if size > 4:
            raise ValueError("a small element is too long")
        return kind, data[at + 4 : at + 4 + size], at + 8
    if at + 8 + size > len(data):
        raise ValueError("an element is longer than what holds it")
    end = at + 8 + size
    return first, data[at + 8 : end], end if first == COMPRESSED_ELEMENT else end + (-size) % 8


def _matrix(data: bytes, order: str, depth: int) -> None:
    """Check the parts of a matrix: flags, dimensions, name, and what its class holds."""
    if not data:
        return
    if depth > DEEPEST:
        raise ValueError("variables are nested too deeply")
    kind, flags, at = _element(data, 0, order)
    if kind != 6 or len(flags) != 8:
        raise ValueError("a variable has no flags")
    word = struct.unpack(f"{order}I", flags[:4])[0]
    held, is_complex = word & 0xFF, bool(word & 0x800)
    if held not in range(1, 18):
        raise ValueError(f"a variable is of the unknown class {held}")
    if held > 15:
        return
    kind, raw, at = _element(data, at, order)
    if kind not in WHOLE or len(raw) % 4 or len(raw) < 8:
        raise ValueError("a variable has no dimensions")
    shape = struct.unpack(f"{order}{len(raw) // 4}i", raw)
    count = math.prod(shape)
    if min(shape) < 0:
        raise ValueError(f"a variable has the dimensions {shape}")
    kind, _, at = _element(data, at, order)
    if kind not in (1, 2, 16):
        raise ValueError("a variable has no name")
    if held in (CELL, STRUCT, OBJECT):
        _nested(data, at, order, depth, held, count)
    elif held in NUMERIC:
        for _ in range(2 if is_complex else 1):
            kind, raw, at = _element(data, at, order)
            if kind not in SIZES or len(raw) != count * SIZES[kind]:
                raise ValueError(f"an array of {count} numbers has {len(raw)} bytes")
    elif held in (CHAR, SPARSE):
        for _ in range(1 if held == CHAR else 3):
            kind, _, at = _element(data, at, order)
            if kind not in SIZES:
                raise ValueError(f"an array is of the unknown type {kind}")


def _nested(data: bytes, at: int, order: str, depth: int, held: int, count: int) -> None:
    """Check the variables within a cell array or struct."""
    if held == OBJECT:
        _, _, at = _element(data, at, order)
    if held != CELL:
        kind, raw, at = _element(data, at, order)
        width = struct.unpack(f"{order}i", raw)[0] if kind in WHOLE and len(raw) == 4 else 0
        kind, names, at = _element(data, at, order)
        if width < 1 or len(names) % width or kind not in (1, 2):
            raise ValueError("a struct has no names")
        count *= len(names) // width
    if count > len(data) // 8:
        raise ValueError(f"{count} variables do not fit into what holds them")
    for _ in range(count):
        kind, body, at = _element(data, at, order)
        if kind != MATRIX:
            raise ValueError("what a struct or cell array holds is no variable")
        _matrix(body, order, depth + 1)


USER_BLOCK = 512
COMPRESSED = 15
HEADER_TEXT = b"MATLAB 7.3 MAT-file, Platform: any, Created by: gearmbs HDF5 schema 1.00 ."
VERSION_AND_ENDIAN = b"\x00\x02IM"


def read_mat(path: Path, channels: Sequence[str] | None, rate: float | None = None) -> Record:
    """Read a MATLAB file of version 5 to 7.3, written here or elsewhere.

    Structs are searched too (names joined by dots). Without this package's layout, numeric arrays of equal length
    become channels and a scalar such as fs gives the rate. Blocks of one name, which MATLAB itself never writes but
    instruments do, are all kept, numbered.

    Raises
    ------
    SignalFileError
        If the file is damaged or holds no record, or several of different lengths.
    """
    import h5py

    notes: list[str] = []
    try:
        if h5py.is_hdf5(path):
            with h5py.File(path, "r") as file:
                tree = {k: _from_hdf(v, file) for k, v in file.items() if not k.startswith("#")}
        else:
            tree = _load(path, notes)
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as a MATLAB file: it is damaged or cut short ({exc})") from exc
    flat = _flatten(tree)
    if {"data", "sampling_rate", "channels", "units", "t0"} <= set(flat):
        return _own(flat, path)
    arrays = {k: v for k, v in flat.items() if isinstance(v, np.ndarray) and v.dtype.kind in "fiu" and v.size > 1}
    scalars = {k: _scalar(v) for k, v in flat.items() if k not in arrays}
    record = assemble(path, arrays, scalars, _units(scalars, arrays), channels, rate)
    record.notes = notes + record.notes
    return record


def _units(scalars: Mapping[str, Any], arrays: Mapping[str, Any]) -> dict[str, str]:
    """Units that stand beside the arrays of a struct, as text under unit or units."""
    found = {}
    for name in arrays:
        beside = name.rpartition(".")[0]
        for key in ("units", "unit", "Units", "Unit"):
            text = scalars.get(f"{beside}.{key}" if beside else key)
            if isinstance(text, str) and text.strip():
                found[name] = text.strip()
    return found


def _load(path: Path, notes: list[str]) -> dict[str, Any]:
    """The variables of a file of version 4 to 7; several of one name as name, name_2 ..."""
    import scipy.io

    if path.stat().st_size <= LARGEST:
        data = path.read_bytes()
        if data.startswith(b"MATLAB 5.0"):
            check_mat5(data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        names = [name for name, _, _ in scipy.io.whosmat(path)]
        if len(set(names)) == len(names):
            loaded = scipy.io.loadmat(path, simplify_cells=True)
            return {k: v for k, v in loaded.items() if not k.startswith("__")}
        tree: dict[str, Any] = {}
        for single in _elements(path.read_bytes()):
            try:
                loaded = scipy.io.loadmat(io.BytesIO(single), simplify_cells=True)
            except Exception:
                notes.append("A variable of the file cannot be read and is left out.")
                continue
            for name, value in loaded.items():
                if not name.startswith("__"):
                    count = sum(key == name or key.startswith(f"{name}_block") for key in tree)
                    tree[name if not count else f"{name}_block{count + 1}"] = value
    for name in sorted({n for n in names if names.count(n) > 1}):
        notes.append(f"The file holds {names.count(name)} blocks named {name}; the further ones are {name}_block2 ...")
    return tree


def _elements(data: bytes) -> Iterator[bytes]:
    """Each variable of a version 5 file as a file of its own: header, and one element by its tag."""
    order = "<" if data[126:128] == b"IM" else ">"
    head = data[:116] + b" " * 8 + data[124:128]
    at = 128
    while at + 8 <= len(data):
        kind, size = struct.unpack(f"{order}II", data[at : at + 8])
        end = at + 8 + size
        if kind == 0 or end > len(data):
            break
        yield head + data[at:end]
        at = end if kind == COMPRESSED else end + (-size) % 8


def write_mat(record: Record, path: Path, version: str) -> None:
    """Write a MATLAB file, `version` "mat5" or "mat7.3"."""
    contents: dict[str, Any] = {
        "data": record.values,
        "sampling_rate": float(record.rate or 0.0),
        "t0": record.t0,
        "channels": record.names,
        "units": record.units,
        "attrs": json.dumps(json_value(record.attrs)),
    }
    if record.speed is not None:
        contents["speed"] = record.speed
    if record.teeth is not None:
        contents["teeth"] = np.asarray(record.teeth, dtype=float)
    if version == "mat5":
        import scipy.io

        if record.values.nbytes >= 2**31:
            raise SignalFileError(path, "is too large for MATLAB's version 5 (2 GiB an array); use format='mat7.3'")
        cells = {k: np.array(v, dtype=object) if isinstance(v, list) else v for k, v in contents.items()}
        scipy.io.savemat(path, cells, do_compression=True)
        return
    import h5py

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
        elif isinstance(value, (list, np.ndarray)) and len(value) and all(isinstance(v, Mapping) for v in _few(value)):
            for i, one in enumerate(value, 1):
                flat.update(_flatten(one, f"{prefix}{key}{i}."))
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def _few(value: Any) -> Any:
    """The entries of a list or array of structs; something that is no struct for any other array."""
    return value if isinstance(value, list) or (value.dtype.kind == "O" and value.ndim == 1) else (None,)


def _scalar(value: Any) -> Any:
    if isinstance(value, np.ndarray) and value.size == 1:
        return value.item()
    return value


def _from_hdf(item: Any, file: h5py.File) -> Any:
    import h5py

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
    import h5py

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


def _begins_as_mat4(head: bytes) -> bool:
    """Return whether bytes are a MATLAB 4 matrix: type, rows, columns, imaginary flag and length of the name."""
    if len(head) < 21:
        return False
    for order in ("<", ">"):
        kind, rows, columns, imaginary, letters = struct.unpack(f"{order}5i", head[:20])
        sane = 0 <= kind < 5000 and kind % 10 <= 2 and (kind // 10) % 10 <= 5 and imaginary in (0, 1)
        if sane and 0 < rows < 1 << 30 and 0 < columns < 1 << 30 and 1 < letters < 64:
            name = head[20 : 20 + letters - 1]
            if name[:1].isalpha() and name.replace(b"_", b"").isalnum():
                return True
    return False


FORMATS = {
    "mat5": Format(
        read=lambda path, asked: read_mat(path, asked.channels, asked.rate),
        write=lambda record, path, progress: write_mat(record, path, "mat5"),
        contents={
            "mat5": Content("a MATLAB 5 file", begins_with(b"MATLAB 5.0")),
            "mat4": Content("a MATLAB 4 file", _begins_as_mat4, tells=False),
        },
        also=("hdf5",),
        through="SciPy, for files of version 7.3 h5py",
    ),
    "mat7.3": Format(
        read=lambda path, asked: read_mat(path, asked.channels, asked.rate),
        write=lambda record, path, progress: write_mat(record, path, "mat7.3"),
        also=("hdf5",),
        through="h5py",
    ),
}
