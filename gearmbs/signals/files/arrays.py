"""Files of named arrays: .npy and .npz of numpy, NetCDF and HDF5.

NetCDF and HDF5 files written here are NetCDF-4, which is HDF5, with one variable per channel over a time axis: the same
bytes serve `.nc` and `.h5`. Other layouts are read array by array.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gearmbs.files import json_value
from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.named_arrays import assemble
from gearmbs.signals.files.scales import CHECK, FACTORS
from gearmbs.signals.files.table import Asked, Content, Format, begins_with
from gearmbs.signals.signal.labels import is_clock
from gearmbs.signals.signal.record import (
    Record,
    metadata_json,
    rate_candidates,
    rate_from_times,
    record_from_json,
)
from gearmbs.signals.signal.signal import UNKNOWN_UNITS, check_teeth

OWN = "gearmbs_signal"
LAYOUT = "gearmbs signal"
BLOCK = 1 << 17
MAGIC = b"\x89HDF\r\n\x1a\n"
NAMELESS = frozenset(("data", "value", "values", "samples", "signal", "y"))
"""Datasets of one channel that are named by their groups."""
SCALED = frozenset(("scale_factor", "add_offset"))
COLUMN_NAMES = frozenset("channels channel_names channelnames names columns column_names labels".split())
USER_BLOCK = 512
"""Bytes that MATLAB 7.3 puts before the HDF5 data."""


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


def write_netcdf(record: Record, path: Path) -> None:
    """Write a NetCDF-4 file with one variable per channel (its name, if not allowed, kept as `channel`)."""
    variables = {}
    for i, (name, unit) in enumerate(zip(record.names, record.units)):
        safe = "".join(c if c.isalnum() or c in "_-. " else "_" for c in name).strip() or "channel"
        key = safe if safe not in variables and safe != "time" else f"{safe}_{i + 1}"
        variables[key] = ("time", record.values[:, i], {"units": unit, "channel": name, "channel_index": i})
    attrs: dict[str, Any] = {
        "layout": LAYOUT,
        "sampling_rate": record.rate,
        "t0": record.t0,
        "attrs": json.dumps(json_value(record.attrs)),
    }
    if record.speed is not None:
        attrs["speed"] = record.speed
    if record.teeth is not None:
        attrs["teeth"] = np.asarray(record.teeth)
    times = record.t0 + np.arange(record.values.shape[0]) / float(record.rate or 1.0)
    dataset = xr.Dataset(variables, coords={"time": ("time", times, {"units": "s", "axis": "T"})}, attrs=attrs)
    # "units: s" is a plain number of seconds here, not a date.
    # in memory first: the format's library ends the program where the disk is full
    Path(path).write_bytes(dataset.to_netcdf(engine="h5netcdf"))


def read_hdf(path: Path, channels: Sequence[str] | None, rate: float | None = None) -> Record:
    """Read NetCDF-4 or any HDF5 file with numeric arrays.

    Raises
    ------
    SignalFileError
        If the file is damaged, or holds no record, or several of different lengths.
    """
    import h5py

    arrays: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    labels: dict[str, str] = {}
    order: dict[str, int] = {}
    homes: dict[str, str] = {}
    scalars: dict[str, Any] = {}
    notes: list[str] = []
    try:
        with h5py.File(path, "r") as file:
            scalars.update({k: _value(v) for k, v in file.attrs.items()})

            def visit(name: str, item: Any) -> None:
                if not isinstance(item, h5py.Dataset):
                    for attr, value in item.attrs.items():
                        scalars[f"{name.replace('/', '.')}.{attr}"] = _value(value)
                    return
                *above, short = name.rsplit("/", 2)[-2:]
                if above and short.lower() in NAMELESS:
                    short = above[0]
                key = short if short not in arrays else name.replace("/", ".")
                if item.dtype.names:
                    arrays.update(_fields(item[...]))
                    return
                for attr, value in item.attrs.items():
                    if rate_candidates({attr: _value(value)}):
                        scalars[f"{key}.{attr}"] = _value(value)
                if item.dtype.kind not in "fiu" or (item.attrs.get("CLASS") == b"DIMENSION_SCALE" and short != "time"):
                    return
                if item.size == 1:
                    scalars.setdefault(key, item[()].item() if item.shape == () else item[...].ravel()[0].item())
                    return
                arrays[key] = _scaled(item, notes)
                homes[key] = name.rpartition("/")[0].replace("/", ".")
                for owner in (item.parent, item):
                    for attr, value in owner.attrs.items():
                        if attr.lower() in ("units", "unit"):
                            units.update(_units_of(key, _value(value)))
                names = _names_of(item)
                if names is not None:
                    table = arrays.pop(key)
                    columns = table if table.shape[0] == len(names) else table.T
                    homes.update(dict.fromkeys(names, homes[key]))
                    for attr in [a for a in item.attrs if f"{key}.{a}" in scalars]:
                        # what a matrix says of its rate is said of each of its columns
                        told = scalars.pop(f"{key}.{attr}")
                        scalars.update({f"{n}.{attr}": told for n in names})
                    arrays.update(zip(names, columns, strict=True))
                    units.update(
                        {n: units.get(f"{key}_{i + 1}", units.get(key, UNKNOWN_UNITS)) for i, n in enumerate(names)}
                    )
                    return
                labels[key] = str(_value(item.attrs.get("channel", key)))
                order[key] = int(_value(item.attrs.get("channel_index", len(order))))

            file.visititems(visit)
    except SignalFileError:
        raise
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as HDF5: it is damaged or cut short ({exc})") from exc
    if scalars.get("layout") == LAYOUT:
        arrays = {key: arrays[key] for key in sorted(arrays, key=lambda key: order[key])}
        return _own(path, arrays, units, labels, scalars)
    record = assemble(path, arrays, scalars, units, channels, rate, homes)
    record.notes += notes
    return record


def _scaled(item: Any, notes: list[str]) -> np.ndarray:
    """Return the values of a dataset as the conventions of NetCDF scale them; remark on other factors of counts."""
    values = item[...]
    attrs = {name.lower(): _value(value) for name, value in item.attrs.items()}
    if SCALED & set(attrs):
        fill = attrs.get("_fillvalue")
        plain = values.astype(float)
        plain[values == fill] = np.nan
        return plain * _factor(item, attrs, "scale_factor", 1.0) + _factor(item, attrs, "add_offset", 0.0)
    factors = sorted(name for name in attrs if name in FACTORS and not np.isin(attrs[name], (0, 1)).all())
    if factors and values.dtype.kind in "iu":
        listed = ", ".join(f"{name} = {attrs[name]}" for name in factors)
        notes.append(
            f"{CHECK}{item.name} holds whole numbers and the attributes {listed}, which are not applied, for "
            "nothing says how; write scale_factor and add_offset, as NetCDF has them, or scale the samples yourself."
        )
    return values


def _factor(item: Any, attrs: dict[str, Any], name: str, otherwise: float) -> float:
    """Return the number of an attribute by which a dataset is scaled."""
    value = attrs.get(name, otherwise)
    if isinstance(value, (int, float)):
        return float(value)
    raise SignalFileError(
        Path(item.file.filename), f"{item.name} has {name} = {value!r}; write one number there, without a unit"
    )


def _texts(value: Any) -> list[str]:
    """Return a list of texts in an attribute; of anything else none."""
    listed = value.ravel().tolist() if isinstance(value, np.ndarray) and value.dtype.kind in "OSU" else []
    return [str(_value(each)) for each in listed]


def _units_of(key: str, value: Any) -> dict[str, str]:
    """Return the unit of a dataset, or that of each of its columns."""
    each = _texts(value)
    return {f"{key}_{i + 1}": unit for i, unit in enumerate(each)} if each else {key: str(value)}


def _names_of(item: Any) -> list[str] | None:
    """Return the names of the columns of a matrix that an attribute lists, or None."""
    for attr, value in item.attrs.items():
        names = _texts(_value(value)) if attr.lower() in COLUMN_NAMES else []
        if item.ndim == 2 and len(names) == min(item.shape) and len(set(names)) == len(names) > 1:
            return names
    return None


def _fields(table: np.ndarray) -> dict[str, np.ndarray]:
    """Return the columns of a table with named fields; where one numbers the channel of each row, those of each."""
    columns = {name: table[name] for name in table.dtype.names or () if table.dtype[name].kind in "fiu"}
    place = next((name for name in columns if name.lower() == "channel"), None)
    if place is None:
        return columns
    numbers = columns.pop(place)
    rows = {number: numbers == number for number in np.unique(numbers)}
    first = next(iter(rows.values()))
    clocks = {name: column[first] for name, column in columns.items() if is_clock(name)}
    return clocks | {
        f"{name}_{number}": column[mask]
        for name, column in columns.items()
        if name not in clocks
        for number, mask in rows.items()
    }


def hdf_pieces(path: Path) -> Iterator[tuple[Record, float]] | None:
    """Read a file of this package's layout block by block, or return None for any other.

    Raises
    ------
    SignalFileError
        If the file is damaged, or its channels differ in length.
    """
    import h5py

    try:
        with h5py.File(path, "r") as file:
            if _value(file.attrs.get("layout")) != LAYOUT or "sampling_rate" not in file.attrs:
                return None
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as HDF5: it is damaged or cut short ({exc})") from exc
    return _slices(path)


def _slices(path: Path) -> Iterator[tuple[Record, float]]:
    import h5py

    try:
        with h5py.File(path, "r") as file:
            columns = [v for k, v in file.items() if k != "time" and "channel_index" in v.attrs]
            columns.sort(key=lambda column: int(_value(column.attrs["channel_index"])))
            counts = {column.shape for column in columns}
            if len(counts) != 1 or len(next(iter(counts))) != 1:
                raise SignalFileError(path, f"its channels have the shapes {sorted(counts)}; they must be equal")
            scalars = {k: _value(v) for k, v in file.attrs.items()}
            teeth = scalars.get("teeth")
            count = columns[0].shape[0]
            for start in range(0, count, BLOCK):
                stop = min(start + BLOCK, count)
                yield (
                    Record(
                        np.stack([np.asarray(column[start:stop], dtype=float) for column in columns], axis=1),
                        [str(_value(column.attrs["channel"])) for column in columns],
                        [str(_value(column.attrs.get("units", UNKNOWN_UNITS))) for column in columns],
                        float(scalars["sampling_rate"]),
                        float(scalars.get("t0", 0.0)),
                        scalars.get("speed"),
                        None if teeth is None else check_teeth(teeth),
                        json.loads(scalars.get("attrs", "{}")),
                    ),
                    stop / count,
                )
    except SignalFileError:
        raise
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as HDF5: it is damaged or cut short ({exc})") from exc


def read_netcdf3(path: Path, channels: Sequence[str] | None, rate: float | None = None) -> Record:
    """Read a classic NetCDF file, array by array."""
    try:
        with xr.open_dataset(path, engine="scipy", decode_times=False) as file:
            arrays = {str(k): np.asarray(v.values) for k, v in file.variables.items() if v.dtype.kind in "fiu"}
            units = {str(k): str(v.attrs["units"]) for k, v in file.variables.items() if "units" in v.attrs}
            scalars = {str(k): _value(v) for k, v in file.attrs.items()}
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as NetCDF: it is damaged or cut short ({exc})") from exc
    return assemble(path, arrays, scalars, units, channels, rate)


def _own(path: Path, arrays: dict, units: dict, labels: dict, scalars: dict) -> Record:
    times = arrays.pop("time", None)
    if not arrays:
        # A record of one sample is a scalar to HDF5 readers.
        arrays = {k: np.atleast_1d(v) for k, v in scalars.items() if k not in ("sampling_rate", "t0", "speed", "teeth")}
        arrays = {k: v for k, v in arrays.items() if v.dtype.kind == "f"}
    rate = scalars.get("sampling_rate")
    if not arrays or rate is None:
        raise SignalFileError(path, "holds no samples or no sampling rate although it is laid out as a signal")
    if times is not None and times.size > 1:
        measured = rate_from_times(times, path)
        if abs(measured - rate) > 1e-3 * rate:
            raise SignalFileError(path, f"its time axis runs at {measured:g} Hz, its sampling_rate says {rate:g} Hz")
    teeth = scalars.get("teeth")
    return Record(
        np.stack([np.asarray(a, dtype=float) for a in arrays.values()], axis=1),
        [labels.get(k, k) for k in arrays],
        [units.get(k, UNKNOWN_UNITS) for k in arrays],
        float(rate),
        float(scalars.get("t0", 0.0)),
        scalars.get("speed"),
        None if teeth is None else check_teeth(teeth),
        json.loads(scalars.get("attrs", "{}")),
    )


def _value(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode("utf-8", errors="replace")
    if isinstance(value, np.ndarray):
        return value.item() if value.size == 1 else value
    if isinstance(value, np.generic):
        return value.item()
    return value


def _begins_as_hdf5(head: bytes) -> bool:
    # a header of MATLAB 7.3 in front of nothing is a file cut off, still one of this kind
    return head.startswith((MAGIC, b"MATLAB 7.3")) or head[USER_BLOCK : USER_BLOCK + len(MAGIC)] == MAGIC


def _read(path: Path, asked: Asked) -> Record:
    read = read_netcdf3 if asked.content == "netcdf3" else read_hdf
    return read(path, asked.channels, asked.rate)


def _format(contents: dict[str, Content], also: tuple[str, ...] = ()) -> Format:
    return Format(
        read=_read,
        write=lambda record, path, progress: write_netcdf(record, path),
        pieces=lambda path, asked: hdf_pieces(path) if asked.content == "hdf5" else None,
        contents=contents,
        also=also,
        through="xarray, h5py",
    )


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
    ),
    # NetCDF-4 is HDF5
    "netcdf": _format(
        {"netcdf3": Content("classic NetCDF", begins_with(b"CDF\x01", b"CDF\x02", b"CDF\x05"))}, ("hdf5",)
    ),
    "hdf5": _format({"hdf5": Content("HDF5", _begins_as_hdf5)}),
}
