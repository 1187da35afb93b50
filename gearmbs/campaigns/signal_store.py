"""Signals of a campaign: one Zarr array a signal, a chunk a case, a shard a unit.

Two writers in one shard lose data without a word, so that a unit is a shard and is written in one piece. The axis of
cases is one of *slots*: unit u has slots [u size, (u + 1) size), of which the last unit of an extent may leave some
empty.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.campaigns.errors import CampaignError
from gearmbs.campaigns.subjects.base import SignalSpec


def make_store(path: Path, specs: Sequence[SignalSpec], unit: int, units: int) -> None:
    """Make empty arrays (slot, channel, time) in float32, filled with NaN."""
    import zarr

    group = zarr.open_group(path, mode="w", zarr_format=3)
    for spec in specs:
        array = group.create_array(
            spec.name,
            shape=(unit * units, len(spec.channels), spec.samples),
            chunks=(1, len(spec.channels), spec.samples),
            shards=(unit, len(spec.channels), spec.samples),
            dtype="float32",
            fill_value=float("nan"),
            dimension_names=("slot", f"{spec.name}_channel", f"{spec.name}_time"),
        )
        array.attrs.update({"units": spec.units, "sampling_rate": spec.rate, "channels": list(spec.channels)})


def grow_store(path: Path, specs: Sequence[SignalSpec], slots: int) -> None:
    """Give the arrays more slots."""
    import zarr

    group = zarr.open_group(path, mode="r+")
    for spec in specs:
        array: Any = group[spec.name]
        array.resize((slots, *array.shape[1:]))


def check_signals(specs: Sequence[SignalSpec], signals: Mapping[str, np.ndarray]) -> None:
    """Refuse the signals of a case that have no room in the arrays.

    Raises
    ------
    CampaignError
    """
    for spec in specs:
        if spec.name not in signals:
            continue
        shape = signals[spec.name].shape
        if len(shape) != 2 or shape[0] != len(spec.channels):
            raise CampaignError(f"signal {spec.name!r}: shape {shape}, planned for {len(spec.channels)} channels")
        if shape[1] > spec.samples:
            raise CampaignError(
                f"signal {spec.name!r}: {shape[1]} samples, planned for {spec.samples} from the corners; make a plan "
                "whose longest record is at a corner"
            )


def write_signals(
    path: Path, specs: Sequence[SignalSpec], unit: int, number: int, signals: Sequence[dict[str, np.ndarray]]
) -> dict[str, str]:
    """Write the signals of the cases of a unit; return the digest of each array's block.

    Parameters
    ----------
    signals : sequence of dict
        Of each case its signals, shape (channels, samples); nothing for a case that failed. See `check_signals`.
    """
    import zarr

    group = zarr.open_group(path, mode="r+") if specs else None
    digests = {}
    for spec in specs:
        block = np.full((unit, len(spec.channels), spec.samples), np.nan, dtype=np.float32)
        for k, case in enumerate(signals):
            if spec.name not in case:
                continue
            values = case[spec.name]
            block[k, :, : values.shape[1]] = values
        assert group is not None
        array: Any = group[spec.name]
        array[number * unit : (number + 1) * unit] = block
        digests[spec.name] = hashlib.sha256(block.tobytes()).hexdigest()
    return digests


def stored_digest(path: Path, name: str, unit: int, number: int) -> str:
    """Return the digest of what is stored of a unit."""
    import zarr

    array: Any = zarr.open_group(path, mode="r")[name]
    return hashlib.sha256(np.asarray(array[number * unit : (number + 1) * unit]).tobytes()).hexdigest()
