"""The folder of a campaign: which file holds what, how far it is, and whether what is stored is what was computed.

::

    plan.json            the plan, what has been drawn so far, the arrays of signals; written last when made or extended
    cases/000-00000.parquet   the table of the design, so many units a file
    units/00042.json     the ledger of a unit; the unit is done if and only if it is there
    units/00042.claim    who is at work on it; saves work, decides nothing
    table/00042.parquet  numbers of its cases
    signals.zarr/        one array a signal, a shard a unit
    records/, failed/    whole records, and what failed cases computed, as NetCDF
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import platform
import shutil
import socket
import time
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.campaigns.plan import FORMAT, Plan
from gearmbs.campaigns.settings import CampaignError, whole
from gearmbs.campaigns.subjects.base import SignalSpec
from gearmbs.files import whole_file, write_whole
from gearmbs.studies.run.engine import owner

UNITS_A_FILE = 64
"""Units whose cases stand in one file."""

REMEDY = "gearmbs campaign check --sweep takes out what is damaged, and run does it again"

RECENT = 20
"""Units by whose pace the remaining time is judged."""


@dataclass(frozen=True)
class Extent:
    """What was drawn at one go: points [first_point, points) of the design, which gave cases [first, last)."""

    points: int
    first_point: int
    first: int
    last: int
    first_unit: int

    def units(self, size: int) -> int:
        """Return how many units it has."""
        return -(-(self.last - self.first) // size)


class Folder:
    """Paths and plan of a campaign's folder.

    Parameters
    ----------
    path : path-like

    Raises
    ------
    CampaignError
        If there is no campaign.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        try:
            tree = json.loads((self.path / "plan.json").read_text(encoding="utf-8"))
        except OSError as error:
            raise CampaignError(f"{self.path}: no campaign here (plan.json: {error.strerror})") from None
        except ValueError as error:
            raise CampaignError(f"{self.path}: plan.json is damaged ({error}); plan again in another folder") from None
        if not isinstance(tree, dict) or tree.get("format") != FORMAT:
            found = tree.get("format") if isinstance(tree, dict) else None
            raise CampaignError(f"{self.path}: format {found} is unknown; this version reads {FORMAT}")
        self.tree = tree
        self.extents = [Extent(**e) for e in tree["extents"]]
        self.plan = Plan.from_dict(tree["plan"], self.extents[-1].points)
        self.specs = [
            SignalSpec(s["name"], tuple(s["channels"]), s["samples"], s["rate"], s["units"]) for s in tree["signals"]
        ]

    @property
    def unit_count(self) -> int:
        """Number of units."""
        last = self.extents[-1]
        return last.first_unit + last.units(self.plan.unit)

    @property
    def case_count(self) -> int:
        """Number of cases."""
        return self.extents[-1].last

    def ledger(self, unit: int) -> Path:
        """Return the path of a unit's ledger."""
        return self.path / "units" / f"{unit:05d}.json"

    def result(self, unit: int) -> bool | None:
        """Return True for a unit that is done, else None."""
        return True if self.ledger(unit).exists() else None

    def claim(self, unit: int) -> Path:
        """Return the path of a unit's claim."""
        return self.path / "units" / f"{unit:05d}.claim"

    def table(self, unit: int) -> Path:
        """Return the path of a unit's table."""
        return self.path / "table" / f"{unit:05d}.parquet"

    @property
    def signals(self) -> Path:
        """Return the path of the signals."""
        return self.path / "signals.zarr"

    def done(self) -> list[int]:
        """Return the numbers of the units that are done."""
        return sorted(int(p.stem) for p in (self.path / "units").glob("*.json") if p.stem.isdigit())

    def size(self, unit: int) -> int:
        """Return the number of cases of a unit."""
        extent = self._extent(unit)
        start = extent.first + (unit - extent.first_unit) * self.plan.unit
        return min(self.plan.unit, extent.last - start)

    def _extent(self, unit: int) -> Extent:
        return max((e for e in self.extents if e.first_unit <= unit), key=lambda e: e.first_unit)

    def cases(self, unit: int) -> list[dict[str, Any]]:
        """Return the rows of the cases of a unit."""
        import pyarrow.parquet as pq

        extent = self._extent(unit)
        block, place = divmod(unit - extent.first_unit, UNITS_A_FILE)
        table = pq.ParquetFile(self._block(self.extents.index(extent), block)).read()
        return table.slice(place * self.plan.unit, self.plan.unit).to_pylist()

    def _block(self, extent: int, block: int) -> Path:
        return self.path / "cases" / f"{extent:03d}-{block:05d}.parquet"


def make_folder(path: str | Path, plan: Plan) -> Folder:
    """Write a plan and the table of its cases to a new folder; plan.json comes last.

    Raises
    ------
    CampaignError
        If a corner is impossible, or the folder holds another campaign. The same plan is taken up again.
    """
    path = Path(path)
    if (path / "plan.json").exists():
        return _taken_up(path, plan)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and (not path.is_dir() or any(path.iterdir())):
            if (path / "plan.json").exists():  # another maker's, moved here since the first look
                return _taken_up(path, plan)
            raise CampaignError(f"{path}: holds something else than a campaign; choose another folder")
        # made aside and moved in one piece: whoever makes the same campaign at this moment finds it whole or not at all
        aside = path.resolve().parent / f".{path.resolve().name}.{uuid.uuid4().hex[:8]}.partial"
        try:
            _fill(aside, plan)
            aside.rename(path.resolve())
        finally:
            shutil.rmtree(aside, ignore_errors=True)
    except OSError as error:
        if (path / "plan.json").exists():
            return _taken_up(path, plan)
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise CampaignError(f"{path}: cannot be made ({error.strerror or error}); choose another folder") from error
    return Folder(path)


def _taken_up(path: Path, plan: Plan) -> Folder:
    """Return the campaign that is there, if it is the plan's."""
    folder, wanted = Folder(path), json.loads(json.dumps(plan.as_dict()))
    other = [name for name in wanted if folder.tree["plan"].get(name) != wanted[name]]
    if other:
        raise CampaignError(
            f"{path}: holds another campaign, with other {' and '.join(other)}; choose another folder, or take up "
            "that one without a plan"
        )
    drawn = folder.extents[-1].points
    if plan.extends and plan.n > drawn:
        raise CampaignError(
            f"{path}: {drawn} points have been drawn, the plan has n = {plan.n}; take the campaign up without a plan "
            f"and extend it to {plan.n}"
        )
    return folder


def _fill(path: Path, plan: Plan) -> None:
    """Write the files of a new campaign."""
    specs = plan.check()
    for name in ("units", "table", "cases"):
        (path / name).mkdir(parents=True, exist_ok=True)
    extent = _write_cases(path, plan, plan.n, [])
    if specs:
        make_store(path / "signals.zarr", specs, plan.unit, extent.units(plan.unit))
    tree = {
        "format": FORMAT,
        "plan": plan.as_dict(),
        "extents": [asdict(extent)],
        "signals": [asdict(s) for s in specs],
    }
    write_whole(path / "plan.json", json.dumps(tree, indent=1))


def extend_folder(folder: Folder, n: int) -> Folder:
    """Draw further points of a plan's design, up to n; what is there stays.

    Raises
    ------
    CampaignError
        If the design cannot go on, or n is not above what there is.
    """
    plan, last = folder.plan, folder.extents[-1]
    n = whole(n, "extend: n", 1)
    if not plan.extends:
        raise CampaignError(f"extend: a {plan.design} design cannot go on where it stopped; a Sobol' sequence can")
    if n <= last.points:
        raise CampaignError(f"extend: n = {n}, but {last.points} points have been drawn; give more")
    extent = _write_cases(folder.path, plan, n, folder.extents)
    if folder.specs:
        grow_store(folder.signals, folder.specs, plan.unit * (extent.first_unit + extent.units(plan.unit)))
    tree = {**folder.tree, "extents": [*folder.tree["extents"], asdict(extent)]}
    write_whole(folder.path / "plan.json", json.dumps(tree, indent=1))
    return Folder(folder.path)


def _write_cases(path: Path, plan: Plan, n: int, before: list[Extent]) -> Extent:
    """Write the cases of the points that are new and return their extent."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    first_point = first = first_unit = 0
    if before:
        last = before[-1]
        per_n = len(plan.points(1)) if plan.design in ("saltelli", "morris") else 1
        first_point, first = last.points * per_n, last.last
        first_unit = last.first_unit + last.units(plan.unit)
    points = plan.points(n)
    step = plan.unit * UNITS_A_FILE
    waiting: dict[str, np.ndarray] = {}
    count, block = 0, 0

    def write(columns: dict[str, np.ndarray]) -> None:
        nonlocal block, count
        size = len(columns["point"])
        index = np.arange(first + count, first + count + size)
        unit = first_unit + (count + np.arange(size)) // plan.unit
        with whole_file(path / "cases" / f"{len(before):03d}-{block:05d}.parquet") as part:
            pq.write_table(pa.table({"index": index, "unit": unit, **columns}), part, compression="zstd")
        block, count = block + 1, count + size

    for start in range(first_point, len(points), max(1, step // plan.variants)):
        some = points[start : start + max(1, step // plan.variants)]
        columns = plan.columns(some, start)
        good = plan.allowed(columns)
        columns = {name: values[good] for name, values in columns.items()}
        waiting = {k: np.concatenate([waiting[k], v]) for k, v in columns.items()} if waiting else columns
        while len(waiting["point"]) >= step:
            write({k: v[:step] for k, v in waiting.items()})
            waiting = {k: v[step:] for k, v in waiting.items()}
    if waiting and len(waiting["point"]):
        write(waiting)
    if count == 0:
        raise CampaignError("plan: not one of the points satisfies the constraints; widen them or the ranges")
    return Extent(n, first_point, first, first + count, first_unit)


def surroundings() -> dict[str, str]:
    """Return versions and machine, which decide the last bits of a result."""
    found = {"host": socket.gethostname(), "machine": platform.machine(), "python": platform.python_version()}
    found["processor"] = _processor()
    for name in ("gearmbs", "numpy", "scipy", "numba"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "unknown")


# Signals of a campaign: one Zarr array a signal, a chunk a case, a shard a unit.
#
# Two writers in one shard lose data without a word, so that a unit is a shard and is written in one piece. The axis of
# cases is one of *slots*: unit u has slots [u size, (u + 1) size), of which the last unit of an extent may leave some
# empty.


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


# How far a campaign is, read from its files by anybody.


@dataclass(frozen=True)
class CampaignStatus:
    """How far a campaign is.

    Attributes
    ----------
    cases, done, failed, reused, running : int
        Cases: all, finished (with those that failed), failed, taken over from others, in units at work.
    units, units_done : int
    processor_seconds, simulation_seconds : float
        Spent on finished units, and of that inside simulations.
    eta : float or None
        Seconds until the end at the pace of the last units; None if there is none yet.
    """

    cases: int
    done: int
    failed: int
    reused: int
    running: int
    units: int
    units_done: int
    processor_seconds: float
    simulation_seconds: float
    eta: float | None

    @property
    def fraction(self) -> float:
        """Part of the cases that is finished."""
        return self.done / self.cases if self.cases else 1.0

    @property
    def complete(self) -> bool:
        """Whether every unit is done."""
        return self.units_done == self.units

    @property
    def overhead(self) -> float:
        """Part of the processor time that was spent outside simulations and their evaluation."""
        spent = self.processor_seconds
        return 1.0 - self.simulation_seconds / spent if spent else 0.0

    def __str__(self) -> str:
        parts = [f"{self.done} of {self.cases} cases done"]
        for count, word in ((self.failed, "failed"), (self.reused, "taken over"), (self.running, "in work")):
            if count:
                parts.append(f"{count} {word}")
        if self.eta is not None and not self.complete:
            parts.append(f"about {_duration(self.eta)} left")
        return ", ".join(parts)

    def _repr_html_(self) -> str:
        """Return the bar and the words, for notebooks."""
        return f"<progress value='{self.fraction:.4f}' max='1'></progress> {self}"


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


@lru_cache(maxsize=200_000)
def _counts(path: str, written: int) -> tuple[int, int, int, float, float, float, float] | None:
    """Return what is counted of a ledger that was written at a time; a ledger may be taken away and written again."""
    entry = read_ledger(Path(path))
    if entry is None:
        return None
    names = ("cases", "failed", "reused", "processor_seconds", "simulation_seconds", "started", "finished")
    return tuple(entry[name] for name in names)  # type: ignore[return-value]


def read_ledger(path: Path) -> dict[str, Any] | None:
    """Return a ledger, or None if it is not there.

    Raises
    ------
    CampaignError
        If it is damaged.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError:
        return None
    except ValueError:
        raise CampaignError(f"{path}: this ledger is damaged; {REMEDY}") from None


def read_status(folder: Folder) -> CampaignStatus:
    """Return how far a campaign is."""
    rows, done, claims = [], set(), []
    with os.scandir(folder.path / "units") as files:
        for file in files:
            stem, _, kind = file.name.partition(".")
            if not stem.isdigit():
                continue
            if kind == "claim":
                claims.append(int(stem))
            elif kind == "json":
                try:
                    row = _counts(file.path, file.stat().st_mtime_ns)
                except OSError:
                    # taken away at this moment
                    continue
                if row is not None:
                    done.add(int(stem))
                    rows.append(row)
    at_work = [u for u in claims if u not in done and owner(folder.claim(u))]
    finished = sum(row[0] for row in rows)
    return CampaignStatus(
        cases=folder.case_count,
        done=finished,
        failed=sum(row[1] for row in rows),
        reused=sum(row[2] for row in rows),
        running=sum(folder.size(u) for u in at_work),
        units=folder.unit_count,
        units_done=len(rows),
        processor_seconds=sum(row[3] for row in rows),
        simulation_seconds=sum(row[4] for row in rows),
        eta=_eta(rows, folder.case_count - finished),
    )


def _eta(rows: list[tuple], left: int) -> float | None:
    """Return the remaining time at the pace of the last units."""
    last = sorted(rows, key=lambda row: row[6])[-RECENT:]
    if not last or left == 0:
        return None if not last else 0.0
    span = max(row[6] for row in last) - min(row[5] for row in last)
    return left * span / max(1, sum(row[0] for row in last))


def check_folder(folder: Folder, *, sweep: bool = False) -> list[str]:
    """Return what is wrong with what is stored and what was left by killed workers; see `Campaign.check`."""
    from gearmbs.campaigns.folder import stored_digest

    found = []
    for unit in folder.done():
        try:
            entry = read_ledger(folder.ledger(unit)) or {"digests": {}}
        except CampaignError:
            found.append(f"unit {unit}: the ledger is damaged")
            if sweep:
                folder.ledger(unit).unlink(missing_ok=True)
            continue
        wrong = []
        for name, digest in entry["digests"].items():
            try:
                now = (
                    hashlib.sha256(folder.table(unit).read_bytes()).hexdigest()
                    if name == "table"
                    else stored_digest(folder.signals, name, folder.plan.unit, unit)
                )
            except (OSError, KeyError) as error:
                now = f"missing ({error})"
            if now != digest:
                wrong.append(name)
        if wrong:
            found.append(f"unit {unit}: {', '.join(wrong)} not as the ledger says")
            if sweep:
                folder.ledger(unit).unlink(missing_ok=True)
    if sweep and folder.specs and not folder.signals.exists():
        from gearmbs.campaigns.folder import make_store

        make_store(folder.signals, folder.specs, folder.plan.unit, folder.unit_count)
    litter = [p for p in folder.path.rglob(".*") if p.is_file()]
    litter += [p for p in folder.path.rglob("*.partial*") if p.is_file()]
    litter += [p for p in (folder.path / "units").glob("*.claim") if owner(p) is None]
    for path in litter:
        # what is younger may belong to somebody at work
        if time.time() - path.stat().st_mtime > 60.0 or path.suffix == ".claim":
            found.append(f"litter: {path.relative_to(folder.path)}")
            # the claims of what is not done count its attempts
            if sweep and (path.suffix != ".claim" or path.with_suffix(".json").exists()):
                path.unlink(missing_ok=True)
    return found
