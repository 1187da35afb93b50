"""Signals of a campaign: one Zarr array a signal, a chunk a case, a shard a unit.

Two writers in one shard would lose data without a word, so that a unit is a shard and is written in one piece. The axis
of cases is one of *slots*: unit u has slots [u size, (u + 1) size), of which the last unit of an extent may leave some
empty.

Each chunk and each shard's index has a checksum (CRC-32C), which every reader of Zarr looks at. Here it is also looked
at whether the shard of a unit is there at all, which others take for NaN.

What an array is described by is written by zarr. The shards are put together here, of the same codecs: through zarr's
arrays and their event loop one of 16 cases takes ten times as long. A test holds that both write the same bytes.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.campaigns.settings import CampaignError
from gearmbs.campaigns.subjects.base import SignalSpec, check_real
from gearmbs.files import write_whole


def _in_memory(spec: SignalSpec, unit: int, units: int) -> tuple[Any, Any]:
    """Return an array (slot, channel, time) in float32, filled with NaN, and the memory that holds its files."""
    import zarr
    from zarr.codecs import Crc32cCodec, ZstdCodec
    from zarr.storage import MemoryStore

    memory = MemoryStore()
    array = zarr.create_array(
        memory,
        name=spec.name,
        shape=(unit * units, len(spec.channels), spec.samples),
        chunks=(1, len(spec.channels), spec.samples),
        shards=(unit, len(spec.channels), spec.samples),
        dtype="float32",
        fill_value=float("nan"),
        compressors=[ZstdCodec(), Crc32cCodec()],
        dimension_names=("slot", f"{spec.name}_channel", f"{spec.name}_time"),
        attributes={"units": spec.units, "sampling_rate": spec.rate, "channels": list(spec.channels)},
        # a unit whose cases all failed has a shard, too, so that none means a loss
        config={"write_empty_chunks": True},
    )
    return array, memory._store_dict


def encoded(block: np.ndarray) -> bytes:
    """Return the file of a shard with a chunk a case, as the arrays' description says.

    Parameters
    ----------
    block : ndarray of float32, shape (cases, channels, samples)

    Notes
    -----
    Each chunk is compressed and followed by its checksum. After the last stands the index, offset and length of each
    chunk as integers of 64 bits, with a checksum of its own (Zarr v3 specification, codec ``sharding_indexed``).
    """
    from numcodecs.checksum32 import CRC32C
    from numcodecs.zstd import Zstd

    compress, check = Zstd(level=0, checksum=False), CRC32C(location="end")
    chunks = [bytes(check.encode(compress.encode(case))) for case in block.astype("<f4", copy=False)]
    lengths = np.array([len(chunk) for chunk in chunks], dtype="<u8")
    index = np.column_stack([np.cumsum(lengths, dtype="<u8") - lengths, lengths])
    return b"".join([*chunks, bytes(check.encode(index))])


def write_store(path: Path, specs: Sequence[SignalSpec], unit: int, units: int, durable: Path) -> None:
    """Write what the arrays are, without any signals, for so many units; what is there already stays."""
    for spec in specs:
        _, files = _in_memory(spec, unit, units)
        write_whole(path / spec.name / "zarr.json", files[f"{spec.name}/zarr.json"].to_bytes(), durable=durable)
    if specs:
        write_whole(path / "zarr.json", files["zarr.json"].to_bytes(), durable=durable)


def check_store(path: Path, specs: Sequence[SignalSpec], unit: int, units: int) -> None:
    """Refuse a description of an array that is not the plan's: read by it, signals would be others.

    Raises
    ------
    CampaignError
    """
    import zarr

    for spec in specs:
        try:
            found = _described(zarr.open_array(path / spec.name, mode="r", zarr_format=3))
        except (OSError, ValueError, TypeError, KeyError) as error:
            found = str(error)
        if found != _described(_in_memory(spec, unit, units)[0]):
            raise CampaignError(f"{path / spec.name / 'zarr.json'}: is missing, damaged or edited")


def _described(array: Any) -> str:
    return json.dumps(array.metadata.to_dict(), sort_keys=True, default=str)


def check_signals(specs: Sequence[SignalSpec], signals: Mapping[str, np.ndarray]) -> None:
    """Refuse the signals of a case that have no room in the arrays.

    Raises
    ------
    CampaignError
    """
    for spec in specs:
        if spec.name not in signals:
            continue
        check_real(signals[spec.name], f"signal {spec.name!r}")
        shape = signals[spec.name].shape
        if len(shape) != 2 or shape[0] != len(spec.channels):
            raise CampaignError(f"signal {spec.name!r}: shape {shape}, planned for {len(spec.channels)} channels")
        if shape[1] > spec.samples:
            raise CampaignError(
                f"signal {spec.name!r}: {shape[1]} samples, planned for {spec.samples} from the corners; make a plan "
                "whose longest record is at a corner"
            )


def shard(path: Path, name: str, unit: int) -> Path:
    """Return the path of the signals of a unit."""
    return path / name / "c" / str(unit) / "0" / "0"


def write_signals(
    path: Path, specs: Sequence[SignalSpec], unit: int, number: int, signals: Sequence[Mapping[str, np.ndarray]],
    durable: Path,
) -> dict[str, str]:  # fmt: skip
    """Write the signals of the cases of a unit; return the digest of each array's shard.

    Parameters
    ----------
    unit, number : int
        Cases of a unit, and the unit's number.
    signals : sequence of mapping
        Of each case its signals, shape (channels, samples); nothing for a case that failed. See `check_signals`.
    """
    digests = {}
    for spec in specs:
        block = np.full((unit, len(spec.channels), spec.samples), np.nan, dtype=np.float32)
        for k, case in enumerate(signals):
            if spec.name in case:
                values = case[spec.name]
                # what single precision does not hold is infinite, and counted as no number
                with np.errstate(over="ignore"):
                    block[k, :, : values.shape[1]] = values
        content = encoded(block)
        write_whole(shard(path, spec.name, number), content, durable=durable)
        digests[spec.name] = hashlib.sha256(content).hexdigest()
    return digests


class Signals:
    """Signals of some slots, read when they are asked for, with a look whether they are there and whole.

    Parameters
    ----------
    path : Path
        Of the arrays.
    spec : SignalSpec
    unit : int
        Cases of a unit.
    slots : ndarray of int
        Of the cases, in their order.
    damaged : callable
        Returns the error of a unit, from its number and what is wrong with it.
    """

    def __init__(
        self, path: Path, spec: SignalSpec, unit: int, slots: np.ndarray, damaged: Callable[[int, str], Exception]
    ) -> None:
        import zarr

        self.path, self.spec, self.unit, self.slots, self.damaged = path, spec, unit, slots, damaged
        self.shape = (len(slots), len(spec.channels), spec.samples)
        self.dtype = np.dtype("float32")
        self._array: Any = zarr.open_array(path / spec.name, mode="r", zarr_format=3)

    def read(self, key: tuple[Any, ...]) -> np.ndarray:
        """Return what numbers, slices and lists of places take of the cases, channels and samples."""
        wanted = np.atleast_1d(self.slots[key[0]])
        found = np.empty((len(wanted), *self.shape[1:]), dtype=self.dtype)
        units = wanted // self.unit
        for unit in np.unique(units):
            place = shard(self.path, self.spec.name, int(unit))
            rows = np.flatnonzero(units == unit)
            try:
                place.stat()
                found[rows] = self._array.oindex[wanted[rows]]
            except (OSError, ValueError, RuntimeError, KeyError) as error:
                raise self.damaged(int(unit), f"{self.spec.name}, {place}: {error}") from None
        numbers = tuple(axis for axis, k in enumerate(key) if not isinstance(k, slice) and np.ndim(k) == 0)
        for axis in (1, 2):
            part = [key[axis]] if axis in numbers else key[axis]
            found = found[(*[slice(None)] * axis, part)]
        return found.squeeze(axis=numbers)
