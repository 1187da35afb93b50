"""The folder of a campaign: which file holds what, and whether what is stored is what was computed.

::

    plan.json            the plan, what has been drawn so far, the arrays of signals; written last when made or extended
    cases/000-00000.parquet   the table of the design, so many units a file
    cases/plan.json      a copy of the plan
    codes/               what the results were computed by; first.json names the code of the campaign
    units/00042.json     the ledger of a unit; the unit is done if and only if it is there
    units/00042.claim    who is at work on it; saves work, decides nothing
    table/00042.parquet  numbers of its cases
    signals.zarr/        one array a signal, a shard a unit
    records/, failed/    whole records, and what failed cases computed, as NetCDF
    packed-1/            units, table, cases and signals.zarr of larger units, by `gearmbs.campaigns.stored.packing`;
                         plan.json says whether they stand there, or here

Everything that is read is held against a digest: ledgers and the plan against their own, tables of the design against
that in the plan, results against those in the ledger. All but claims is written in an order in which a power cut at any
moment leaves nothing that is taken for what it is not: see `gearmbs.files.whole_file`; data come before their ledger.
"""

from __future__ import annotations

import errno
import hashlib
import json
import shutil
import uuid
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.campaigns.plans.plan import ALONG, FORMAT, TAKEN, Plan
from gearmbs.campaigns.settings import CampaignError, CampaignWarning, local, whole
from gearmbs.campaigns.signals import Signals, write_store
from gearmbs.campaigns.subjects.base import SignalSpec
from gearmbs.files import arrow_column, to_disk, whole_file, write_whole
from gearmbs.studies.run.claims import owner, take, told

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq

UNITS_A_FILE = 64
"""Units whose cases stand in one file."""

UNITS, MOST_CASES, MOST_BYTES = 128, 1024, 64e6
"""Units that cases are divided into where the plan does not say, so that as many workers are busy; but no unit has more
cases than the second, which a kill would cost, nor more bytes of signals than the third."""

FOLDERS = ("units", "table", "cases", "codes")
"""The last stands in the campaign's folder, wherever the others do."""

PACKED = 3
"""Format of a campaign whose units were packed, which others would take for one without results."""

REMEDY = "gearmbs campaign run puts it right"


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
    tree : dict, optional
        What plan.json holds, or will hold; default read from there.

    Attributes
    ----------
    store : Path
        Where units, table, cases and signals stand.

    Raises
    ------
    CampaignError
        If there is no campaign, or its plan was edited.
    """

    def __init__(self, path: str | Path, tree: dict[str, Any] | None = None) -> None:
        self.path = local(path)
        self._stamp = _stamp(self.path)
        self.tree = _plan_tree(self.path) if tree is None else tree
        self.store = self.path / self.tree.get("store", "")
        self.extents = [Extent(**e) for e in self.tree["extents"]]
        plan = Plan.from_dict(self.tree["plan"], self.extents[-1].points)
        self.plan: Plan = replace(plan, unit=self.tree["unit"])
        self.unit_size: int = self.tree["unit"]
        self._plan = digest_of(self.tree["plan"])
        self.specs = [
            SignalSpec(s["name"], tuple(s["channels"]), s["samples"], s["rate"], s["units"])
            for s in self.tree["signals"]
        ]

    @property
    def changed(self) -> bool:
        """Whether the plan's file is another one than was read, as after `extend` and `pack` by whomever."""
        now = _stamp(self.path)
        return now is not None and now != self._stamp

    @property
    def unit_count(self) -> int:
        """Number of units."""
        last = self.extents[-1]
        return last.first_unit + last.units(self.unit_size)

    @property
    def case_count(self) -> int:
        """Number of cases."""
        return self.extents[-1].last

    def ledger(self, unit: int) -> Path:
        """Return the path of a unit's ledger."""
        return self.store / "units" / f"{unit:05d}.json"

    def result(self, unit: int) -> bool | None:
        """Return True for a unit that is done, else None."""
        return True if self.ledger(unit).exists() else None

    def claim(self, unit: int) -> Path:
        """Return the path of a unit's claim."""
        return self.store / "units" / f"{unit:05d}.claim"

    def table(self, unit: int) -> Path:
        """Return the path of a unit's table."""
        return self.store / "table" / f"{unit:05d}.parquet"

    @property
    def signals(self) -> Path:
        """Return the path of the signals."""
        return self.store / "signals.zarr"

    def done(self) -> list[int]:
        """Return the numbers of the units that are done."""
        found = (int(p.stem) for p in (self.store / "units").glob("*.json") if p.stem.isdigit())
        return sorted(unit for unit in found if unit < self.unit_count)

    def entry(self, unit: int) -> dict[str, Any]:
        """Return the ledger of a unit that is done.

        Raises
        ------
        CampaignError
            If it is damaged, or not there.
        """
        entry = read_ledger(self.ledger(unit))
        mine = self.identity(unit)
        if entry is None or entry["unit"] != unit or entry.get("plan", mine) != mine:
            raise self.damaged(unit, "its ledger is missing, or that of another unit or campaign")
        return entry

    def identity(self, unit: int) -> str:
        """Return a digest of what was planned for a unit, which its ledger holds: the plan, and the table of cases."""
        name, _ = self._planned(unit)
        return digest_of([self._plan, self.tree["cases"].get(name)])

    def unit_table(self, unit: int, columns: Iterable[str] | None = None) -> pa.Table:
        """Return the table of a unit that is done, or those of some columns that it has.

        Raises
        ------
        CampaignError
            If it is missing or not what the ledger says.
        """
        file = self._unit_file(unit)
        known = None if columns is None else [name for name in columns if name in file.schema_arrow.names]
        return file.read(known)

    def unit_columns(self, unit: int) -> list[str]:
        """Return the names of the columns of a unit that is done; see `unit_table`."""
        return list(self._unit_file(unit).schema_arrow.names)

    def _unit_file(self, unit: int) -> pq.ParquetFile:
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            content = self.table(unit).read_bytes()
        except OSError as error:
            raise self.damaged(unit, f"{self.table(unit)}: {error.strerror}") from None
        if hashlib.sha256(content).hexdigest() != self.entry(unit)["digests"]["table"]:
            raise self.damaged(unit, f"{self.table(unit)}: is not as its ledger says")
        return pq.ParquetFile(pa.BufferReader(content))

    def record(self, unit: int, index: int) -> bytes:
        """Return the content of the file of a case's record, or of what a failed one had computed.

        Raises
        ------
        CampaignError
            If there is none, or it is not what the ledger says.
        """
        entry = self.entry(unit) if self.result(unit) else {"files": {}}
        # a case that was done at its second attempt may have left a file of the first, which is none of its record
        for name in sorted(entry["files"], key=is_record, reverse=True):
            if not name.endswith(f"/{index:07d}.nc"):
                continue
            try:
                content = (self.path / name).read_bytes()
            except OSError as error:
                raise self.damaged(unit, f"{name}: {error.strerror}") from None
            if hashlib.sha256(content).hexdigest() != entry["files"][name]:
                raise self.damaged(unit, f"{name}: is not as its ledger says")
            return content
        raise CampaignError(
            f'case {index}: no record is kept; it is not done yet, or the plan keeps none (keep "record")'
        )

    @cached_property
    def taken(self) -> frozenset[str]:
        """The names whose place no number may take: those of the plan's columns, of what is known of cases, of signals
        and their axes. A number of such a name has ``result.`` before it."""
        signals = {spec.name + ending for spec in self.specs for ending in ("", *ALONG)}
        return frozenset({*self.cases(0)[0], *TAKEN, *signals})

    def stored_signals(self, spec: SignalSpec, slots: np.ndarray) -> Signals:
        """Return the signals of some slots, which are read when they are asked for."""
        return Signals(self.signals, spec, self.unit_size, slots, self.damaged)

    def damaged(self, unit: int, what: str) -> CampaignError:
        """Return the error of a unit whose files are not what they were."""
        if self.changed:
            return CampaignError(
                f"unit {unit}: {self.path} was extended, packed or put right since it was opened; open it again"
            )
        return CampaignError(f"unit {unit} is damaged: {what}; gearmbs campaign run {self.path} does it again")

    def size(self, unit: int) -> int:
        """Return the number of cases of a unit."""
        extent = self._extent(unit)
        start = extent.first + (unit - extent.first_unit) * self.unit_size
        return min(self.unit_size, extent.last - start)

    def _extent(self, unit: int) -> Extent:
        return max((e for e in self.extents if e.first_unit <= unit), key=lambda e: e.first_unit)

    def cases(self, unit: int) -> list[dict[str, Any]]:
        """Return the rows of the cases of a unit.

        Raises
        ------
        CampaignError
            If they are not those that were planned.
        """
        name, place = self._planned(unit)
        path = self.store / "cases" / name
        try:
            about = path.stat()
            table = _planned(path, self.tree["cases"][name], about.st_mtime_ns, about.st_ino)
        except OSError as error:
            raise CampaignError(f"{path}: {error.strerror}; {REMEDY}") from None
        return table.slice(place * self.unit_size, self.unit_size).to_pylist()

    def _planned(self, unit: int) -> tuple[str, int]:
        """Return the file that holds the cases of a unit, and which of its units that is."""
        extent = self._extent(unit)
        block, place = divmod(unit - extent.first_unit, UNITS_A_FILE)
        return _block_name(self.extents.index(extent), block), place


def _stamp(path: Path) -> tuple[int, int] | None:
    """Return by what a plan's file is known from others, None where it is not there."""
    try:
        about = (path / "plan.json").stat()
    except OSError:
        return None
    return about.st_mtime_ns, about.st_ino


@lru_cache(maxsize=2)
def _planned(path: Path, digest: str, _written: int, _inode: int) -> pa.Table:
    """Return the cases of a file if they are those that were planned."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    content = path.read_bytes()
    if hashlib.sha256(content).hexdigest() != digest:
        raise CampaignError(f"{path}: is edited or damaged, its cases are not those that were planned; {REMEDY}")
    return pq.ParquetFile(pa.BufferReader(content)).read()


def is_record(name: str) -> bool:
    """Whether a file of a campaign is the record of a case that is done, not what a failed one had computed."""
    return name.startswith("records/")


def _block_name(extent: int, block: int) -> str:
    return f"{extent:03d}-{block:05d}.parquet"


# Files under a digest of their own.


def digest_of(tree: Any) -> str:
    """Return the digest of a tree of dictionaries, lists, numbers and texts."""
    return hashlib.sha256(json.dumps(tree, sort_keys=True).encode()).hexdigest()


def sealed(tree: dict[str, Any]) -> str:
    """Return a tree as JSON with its digest."""
    return json.dumps({**tree, "digest": digest_of(tree)})


def unsealed(path: Path) -> dict[str, Any]:
    """Return the tree of a file that `sealed` made.

    Raises
    ------
    OSError
        If it cannot be read.
    ValueError
        If it is not what was written.
    """
    tree = json.loads(path.read_bytes())
    if not isinstance(tree, dict) or tree.pop("digest", None) != digest_of(tree):
        raise ValueError("its digest is another one")
    return tree


def read_ledger(path: Path) -> dict[str, Any] | None:
    """Return a ledger, or None if it is not there.

    Raises
    ------
    CampaignError
        If it is damaged.
    """
    try:
        return unsealed(path)
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise CampaignError(f"{path}: this ledger is damaged or edited ({reason}); {REMEDY}") from None


# The plan, under a digest of each of its entries, and its copy.


def write_plan(path: Path, tree: dict[str, Any]) -> None:
    """Write the plan; the copy comes first, so that there is always one that holds."""
    text = json.dumps({**tree, "digests": _entries(tree)}, indent=1)
    for place in (path / "cases" / "plan.json", path / "plan.json"):
        write_whole(place, text, durable=path)


def _entries(tree: dict[str, Any]) -> dict[str, str]:
    """Return the digest of each entry of a plan's file."""
    inner = tree.get("plan") if isinstance(tree.get("plan"), dict) else {}
    entries = {f"plan: {name}": value for name, value in (inner or {}).items()}
    entries |= {name: value for name, value in tree.items() if name not in ("plan", "digests")}
    return {name: digest_of(value) for name, value in entries.items()}


def _plan_tree(path: Path) -> dict[str, Any]:
    """Return what a plan's file holds, or its copy, where the file is missing or damaged and the copy is whole."""
    place = path / "plan.json"
    content, wrong = sound_plan(place)
    if not wrong:
        return json.loads(content)
    copy, unsound = sound_plan(path / "cases" / "plan.json")
    if unsound:
        told = wrong if isinstance(wrong, str) else f"plan.json was edited or damaged ({', '.join(wrong)})"
        raise CampaignError(f"{path}: {told}; make the plan again in another folder")
    # what an editor leaves is neither of the same length nor the beginning of what it was
    if isinstance(wrong, list) or (len(content) != len(copy) and not copy.startswith(content)):
        told = wrong if isinstance(wrong, str) else ", ".join(wrong)
        raise CampaignError(
            f"{place}: was edited ({told}), and what is done was done by the plan as it was made; remove the file, "
            "which run then writes as it was, or plan another campaign in another folder"
        )
    warnings.warn(f"{path}: {wrong}; its copy cases/plan.json is taken, and {REMEDY}", CampaignWarning, stacklevel=4)
    return json.loads(copy)


def sound_plan(place: Path) -> tuple[bytes, str | list[str]]:
    """Return the content of a plan's file, and what is wrong with it: why it cannot be read, or which entries."""
    try:
        content = place.read_bytes()
        tree = json.loads(content)
    except OSError as error:
        return b"", f"no campaign here (plan.json: {error.strerror})"
    except ValueError as error:
        return content, f"plan.json is damaged ({error})"
    if not isinstance(tree, dict) or "digests" not in tree:
        found = tree.get("format") if isinstance(tree, dict) else None
        return content, f"format {found} is unknown; this version reads {FORMAT}"
    noted, now = tree["digests"], _entries(tree)
    if not isinstance(noted, dict):
        return content, "plan.json is damaged (digests)"
    wrong = sorted(name for name in {*noted, *now} if noted.get(name) != now.get(name))
    if not wrong and tree["format"] not in (FORMAT, PACKED):
        return content, f"format {tree['format']} is unknown; this version reads {FORMAT} and {PACKED}"
    return content, wrong


# Making, taking up, extending.


def make_folder(path: str | Path, plan: Plan) -> Folder:
    """Write a plan and the table of its cases to a new folder; plan.json comes last.

    Raises
    ------
    CampaignError
        If a corner is impossible, or the folder holds another campaign. The same plan is taken up again.
    """
    path = local(path)
    if _planned_here(path):
        return _taken_up(path, plan)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and (not path.is_dir() or any(path.iterdir())):
            if _planned_here(path):  # another maker's, moved here since the first look
                return _taken_up(path, plan)
            raise CampaignError(f"{path}: holds something else than a campaign; choose another folder")
        # made aside and moved in one piece: whoever makes the same campaign at this moment finds it whole or not at all
        aside = path.resolve().parent / f".{path.resolve().name}.{uuid.uuid4().hex[:8]}.partial"
        try:
            _fill(aside, plan)
            aside.rename(path.resolve())
            to_disk(path.resolve().parent)
        finally:
            shutil.rmtree(aside, ignore_errors=True)
    except OSError as error:
        if _planned_here(path):
            return _taken_up(path, plan)
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise CampaignError(f"{path}: cannot be made ({error.strerror or error}); choose another folder") from error
    return Folder(path)


def _planned_here(path: Path) -> bool:
    return (path / "plan.json").exists() or (path / "cases" / "plan.json").exists()


def _taken_up(path: Path, plan: Plan) -> Folder:
    """Return the campaign that is there, if it is the plan's."""
    folder, wanted = Folder(path), json.loads(json.dumps(plan.as_dict()))
    # by their digests: numbers that are none are not equal to themselves
    other = [name for name in wanted if digest_of(folder.tree["plan"].get(name)) != digest_of(wanted[name])]
    if other:
        raise CampaignError(
            f"{path}: holds another campaign, with other {' and '.join(other)}; choose another folder, or take up "
            "that one without a plan"
        )
    drawn = [extent.points for extent in folder.extents]
    if plan.has_n and plan.n not in drawn:
        up = f"and extend it to {plan.n}" if plan.extends and plan.n > drawn[-1] else "as it is"
        raise CampaignError(
            f"{path}: holds {drawn[-1]} points, the plan has n = {plan.n}; take the campaign up without a plan {up}, "
            "or choose another folder"
        )
    if plan.has_n and plan.n != drawn[-1]:
        warnings.warn(
            f"{path}: was extended from the plan's n = {plan.n} to {drawn[-1]} points, all of which it has",
            CampaignWarning,
            stacklevel=4,
        )
    return folder


def _fill(path: Path, plan: Plan) -> None:
    """Write the files of a new campaign."""
    specs = plan.check()
    for name in FOLDERS:
        (path / name).mkdir(parents=True, exist_ok=True)
    unit = plan.unit or _unit_size(plan, specs)
    extent, digests = write_cases(path, plan, unit, plan.n, [])
    write_store(path / "signals.zarr", specs, unit, extent.units(unit), path)
    tree = {
        "format": FORMAT,
        "plan": json.loads(json.dumps(plan.as_dict())),
        "unit": unit,
        "extents": [asdict(extent)],
        "signals": [asdict(s) for s in specs],
        "cases": digests,
    }
    write_plan(path, tree)


def _unit_size(plan: Plan, specs: Iterable[SignalSpec]) -> int:
    """Return how many cases a unit has where the plan does not say."""
    size = 4 * sum(len(spec.channels) * spec.samples for spec in specs)
    most = MOST_CASES if not size else int(MOST_BYTES / size)
    return max(1, min(-(-plan.size // UNITS), MOST_CASES, most))


@contextmanager
def alone(folder: Folder, what: str) -> Iterator[None]:
    """Change the plan's file while nobody else does.

    Raises
    ------
    CampaignError
        If somebody is at it.
    """
    place = folder.path / "cases" / "plan.claim"
    claim = take(place)
    if claim is None:
        who = owner(place)
        raise CampaignError(
            f"{what}: {folder.path} is being extended or packed by {told(who) if who else 'somebody else'}; try again "
            "later"
        )
    try:
        yield
    finally:
        claim.release()


def extend_folder(folder: Folder, n: int) -> Folder:
    """Draw further points of a plan's design, up to n; what is there stays.

    Raises
    ------
    CampaignError
        If the design cannot go on, n is not above what there is, or somebody else extends it at this moment.
    """
    n = whole(n, "extend: n", 1)
    with alone(folder, "extend"):
        folder = Folder(folder.path)
        plan, last, unit = folder.plan, folder.extents[-1], folder.unit_size
        if not plan.extends:
            raise CampaignError(f"extend: a {plan.design} design cannot go on where it stopped; a Sobol' sequence can")
        if n <= last.points:
            raise CampaignError(f"extend: n = {n}, but {last.points} points have been drawn; give more")
        extent, digests = write_cases(folder.store, plan, unit, n, folder.extents)
        write_store(folder.signals, folder.specs, unit, extent.first_unit + extent.units(unit), folder.path)
        tree = {name: value for name, value in folder.tree.items() if name != "digests"}
        tree["extents"] = [*tree["extents"], asdict(extent)]
        tree["cases"] = {**tree["cases"], **digests}
        write_plan(folder.path, tree)
    return Folder(folder.path)


def write_cases(store: Path, plan: Plan, unit: int, n: int, before: list[Extent]) -> tuple[Extent, dict[str, str]]:
    """Write the cases of the points that are new; return their extent and the digests of the files."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    first_point = first = first_unit = 0
    if before:
        last = before[-1]
        first_point, first = last.points * plan.points_a_base, last.last
        first_unit = last.first_unit + last.units(unit)
    step = unit * UNITS_A_FILE
    waiting: dict[str, np.ndarray] = {}
    count, digests = 0, dict[str, str]()

    def write(columns: dict[str, np.ndarray]) -> None:
        nonlocal count
        size = len(columns["point"])
        index = np.arange(first + count, first + count + size)
        units = first_unit + (count + np.arange(size)) // unit
        name = _block_name(len(before), len(digests))
        with whole_file(store / "cases" / name, durable=store) as part:
            columns = {"index": index, "unit": units, **columns}
            table = pa.table({name: arrow_column(values) for name, values in columns.items()})
            pq.write_table(table, part, compression="zstd", write_page_checksum=True)
            digests[name] = hashlib.sha256(part.read_bytes()).hexdigest()
        count += size

    for start, points in plan.blocks(n, first_point, max(1, step // plan.variants)):
        columns = plan.columns(points, start)
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
    return Extent(n, first_point, first, first + count, first_unit), digests
