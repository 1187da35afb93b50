"""Results of a campaign that is done in fewer, larger units.

A unit is some files: ledger, table, a shard of each signal. Many small ones spare work when something is killed, and
cost readers time and file servers room once all is done. Packing writes the same results in larger units beside the
former ones, reads them back, and lets the plan's file, which is replaced in one piece, say where they stand; the former
ones go last. At any moment a kill leaves one of both whole, and litter that the next packing removes.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from gearmbs.campaigns.codes import code_counts
from gearmbs.campaigns.folder import (
    MOST_BYTES,
    MOST_CASES,
    PACKED,
    Extent,
    Folder,
    alone,
    sealed,
    write_cases,
    write_plan,
)
from gearmbs.campaigns.settings import CampaignError, whole
from gearmbs.campaigns.signals import write_signals, write_store
from gearmbs.campaigns.status import read_status
from gearmbs.campaigns.stored.checks import check_folder, check_unit, file_digest, remove_outdated
from gearmbs.campaigns.subjects.base import SignalSpec
from gearmbs.files import to_disk, whole_file, write_whole

SUMS = ("cases", "failed", "reused", "not_numbers", "simulation_seconds", "processor_seconds", "wall_seconds")
"""What ledgers count."""


def pack_folder(folder: Folder, unit: int | None = None) -> Folder:
    """Store the results of a campaign in larger units; return its folder.

    Parameters
    ----------
    folder : Folder
    unit : int, optional
        Cases of a unit; default as many as a unit may have at most where a plan does not say.

    Raises
    ------
    CampaignError
        If not every unit is done, something stored is damaged, results come from several codes, or units are as large
        already.
    """
    with alone(folder, "pack"):
        folder = Folder(folder.path)
        remove_outdated(folder)
        size = _size(folder, unit)
        tree = _written(folder, size)
        packed = Folder(folder.path, tree)
        _verify(folder, packed)
        write_plan(folder.path, tree)
        remove_outdated(packed)
    return Folder(folder.path)


def _size(folder: Folder, unit: int | None) -> int:
    """Return the cases of the units to come, if the campaign can be packed."""
    status, path = read_status(folder), folder.path
    if not status.complete:
        raise CampaignError(f"pack: {path}: {status.units - status.units_done} units are not done; run it to its end")
    wrong = check_folder(folder)
    if wrong:
        raise CampaignError(f"pack: {path}: {wrong[0]}; gearmbs campaign run {path} puts it right")
    if len(code_counts(folder)) > 1:
        raise CampaignError(
            f"pack: {path}: results come from {status.codes} codes, which ledgers of units tell apart; do those of the "
            "others again (--other-code again), or leave it as it is"
        )
    now = folder.unit_size
    signals = 4 * sum(len(spec.channels) * spec.samples for spec in folder.specs)
    most = min(MOST_CASES, int(MOST_BYTES / signals)) if signals else MOST_CASES
    size = most // now * now if unit is None else whole(unit, "pack: unit", 1)
    if size <= now or size % now or folder.unit_count == len(folder.extents):
        raise CampaignError(
            f"pack: {path}: {folder.unit_count} units have {now} cases each, {size} are asked for; give a multiple of "
            f"{now}, or leave it as it is"
        )
    return size


def _written(folder: Folder, size: int) -> dict[str, Any]:
    """Write the results in units of a size to a store of their own; return what the plan's file will hold."""
    number = 1 + int(folder.store.name.partition("-")[2]) if folder.store != folder.path else 1
    store = folder.path / f"packed-{number}"
    for name in ("units", "table", "cases"):
        (store / name).mkdir(parents=True)
    extents: list[Extent] = []
    digests: dict[str, str] = {}
    for former in folder.extents:
        extent, new = write_cases(store, folder.plan, size, former.points, extents)
        extents.append(extent)
        digests |= new
    tree = {name: value for name, value in folder.tree.items() if name != "digests"}
    tree |= {"format": PACKED, "store": store.name, "unit": size, "extents": [asdict(e) for e in extents]}
    tree["cases"] = digests
    packed = Folder(folder.path, tree)
    write_store(packed.signals, packed.specs, size, packed.unit_count, store)
    for unit in range(packed.unit_count):
        _write_unit(folder, packed, unit)
    to_disk(folder.path)
    return tree


def _sources(folder: Folder, packed: Folder, unit: int) -> range:
    """Return the former units of a new one."""
    number = max(k for k, extent in enumerate(packed.extents) if extent.first_unit <= unit)
    extent, several = folder.extents[number], packed.unit_size // folder.unit_size
    first = extent.first_unit + (unit - packed.extents[number].first_unit) * several
    return range(first, min(first + several, extent.first_unit + extent.units(folder.unit_size)))


def _table(folder: Folder, packed: Folder, unit: int) -> Any:
    """Return the rows of a new unit out of the former tables."""
    import pyarrow as pa

    parts = [folder.unit_table(former) for former in _sources(folder, packed, unit)]
    table = pa.concat_tables(parts, promote_options="permissive")
    slots = unit * packed.unit_size + np.arange(len(table))
    for name, values in (("unit", np.full(len(table), unit)), ("slot", slots)):
        place = table.column_names.index(name)
        table = table.set_column(place, name, pa.array(values, type=table.schema.field(name).type))
    return table


def _signals(folder: Folder, spec: SignalSpec, units: range) -> np.ndarray:
    """Return the signals of the cases of some former units, (cases, channels, samples), NaN where there are none."""
    slots = [unit * folder.unit_size + row for unit in units for row in range(folder.size(unit))]
    everything = (slice(None), slice(None), slice(None))
    return folder.stored_signals(spec, np.array(slots)).read(everything)


def _write_unit(folder: Folder, packed: Folder, unit: int) -> None:
    """Write a new unit: signals, table, then the ledger."""
    import pyarrow.parquet as pq

    units, store = _sources(folder, packed, unit), packed.store
    signals: list[dict[str, np.ndarray]] = [{} for _ in range(packed.size(unit))]
    for spec in folder.specs:
        for case, values in zip(signals, _signals(folder, spec, units), strict=True):
            case[spec.name] = values
    digests = write_signals(packed.signals, packed.specs, packed.unit_size, unit, signals, store)
    with whole_file(packed.table(unit), durable=store) as part:
        pq.write_table(_table(folder, packed, unit), part, compression="zstd", write_page_checksum=True)
        digests["table"] = file_digest(part)
    parts = [folder.entry(former) for former in units]
    entry = parts[-1] | {name: sum(part[name] for part in parts) for name in SUMS}
    entry |= {
        "unit": unit,
        "plan": packed.identity(unit),
        "index": [parts[0]["index"][0], parts[-1]["index"][1]],
        "status": {case: status for part in parts for case, status in part["status"].items()},
        "seconds": [seconds for part in parts for seconds in part["seconds"]],
        "files": {name: digest for part in parts for name, digest in part["files"].items()},
        "started": min(part["started"] for part in parts),
        "digests": digests,
    }
    # ledgers of earlier versions do not say it, and then nobody knows it of all
    if all("tightened" in part for part in parts):
        entry["tightened"] = [index for part in parts for index in part["tightened"]]
    else:
        entry.pop("tightened", None)
    write_whole(packed.ledger(unit), sealed(entry), durable=store)


def _verify(folder: Folder, packed: Folder) -> None:
    """Read back what was written, and hold it against its digests and against what is there.

    Raises
    ------
    CampaignError
        If anything differs.
    """
    for unit in range(packed.unit_count):
        units = _sources(folder, packed, unit)
        wrong = check_unit(packed, unit)
        planned = [row for former in units for row in folder.cases(former)]
        if not wrong and _told(packed.cases(unit)) != _told(planned):
            wrong = "the plan gives other cases with this version"
        if not wrong and not packed.unit_table(unit).to_pandas().equals(_table(folder, packed, unit).to_pandas()):
            wrong = "the table differs"
        for spec in folder.specs if not wrong else ():
            here = packed.stored_signals(spec, unit * packed.unit_size + np.arange(packed.size(unit)))
            there = _signals(folder, spec, units)
            if here.read((slice(None), slice(None), slice(None))).tobytes() != there.tobytes():
                wrong = f"{spec.name} differs"
        if wrong:
            raise CampaignError(
                f"pack: {packed.store}: unit {unit}: {wrong} when it is read back; the former units stand as they are, "
                "pack again where the disk is sound"
            )


def _told(rows: list[dict[str, Any]]) -> list[str]:
    """Return rows as texts that tell all but their units: what an option has no range for is NaN, which equals none."""
    return [repr(row | {"unit": 0}) for row in rows]
