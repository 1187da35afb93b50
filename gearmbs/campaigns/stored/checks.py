"""Whether what is stored is what was computed."""

from __future__ import annotations

import hashlib
import shutil
import time
from collections.abc import Iterable, Set
from contextlib import suppress
from pathlib import Path

from gearmbs.campaigns.folder import FOLDERS, Folder, is_record, sound_plan, write_cases, write_plan
from gearmbs.campaigns.settings import CampaignError
from gearmbs.campaigns.signals import check_store, shard, write_store
from gearmbs.studies.run.claims import owner

LITTER_AFTER = 60.0
"""Seconds after which a temporary file belongs to nobody at work."""


def check_folder(folder: Folder, units: Iterable[int] | None = None, *, sweep: bool = False) -> list[str]:
    """Return what is wrong with what is stored, and put it right if that is wanted; see `Campaign.check`.

    Parameters
    ----------
    units : iterable of int, optional
        Look at these of the units that are done; default all.
    sweep : bool
        Write the plan, its cases and the arrays' descriptions again as they were, and take units whose results are
        damaged out of the ledger, so that `run` does them again.
    """
    found = _check_plan(folder, sweep)
    wanted = None if units is None else set(units)
    partial = _partial(folder)
    for unit in folder.done():
        if wanted is not None and unit not in wanted:
            continue
        wrong = check_unit(folder, unit, partial)
        if wrong:
            found.append(f"unit {unit}: {wrong}")
            if sweep:
                folder.ledger(unit).unlink(missing_ok=True)
    return found


def _check_plan(folder: Folder, sweep: bool) -> list[str]:
    """Return what is wrong with plan, cases and the descriptions of arrays."""
    found, path, unit = [], folder.path, folder.unit_size
    places = [path / "cases", path / FOLDERS[-1], *(folder.store / name for name in FOLDERS[:-1])]
    gone = [place for place in dict.fromkeys(places) if not place.is_dir()]
    if gone:
        found.append(f"{', '.join(str(place.relative_to(path)) for place in gone)}: missing")
        for place in gone if sweep else ():
            place.mkdir(parents=True)
    contents = [sound_plan(place) for place in (path / "plan.json", path / "cases" / "plan.json")]
    if any(wrong for _, wrong in contents) or contents[0][0] != contents[1][0]:
        found.append("plan.json or its copy: missing, damaged or not the same")
        if sweep:
            write_plan(path, {name: value for name, value in folder.tree.items() if name != "digests"})
    for number, extent in enumerate(folder.extents):
        names = [name for name in folder.tree["cases"] if name.startswith(f"{number:03d}-")]
        wrong = [name for name in names if file_digest(folder.store / "cases" / name) != folder.tree["cases"][name]]
        if wrong:
            found.append(f"cases/{', cases/'.join(wrong)}: missing, edited or damaged; made again from the plan by run")
            if sweep:
                before = folder.extents[:number]
                _, digests = write_cases(folder.store, folder.plan, unit, extent.points, before)
                if any(digests.get(name) != folder.tree["cases"][name] for name in names):
                    raise CampaignError(
                        f"{path}: {wrong[0]} cannot be made again, since the plan gives other cases with this version; "
                        "take up the campaign with the version that made it"
                    )
    try:
        check_store(folder.signals, folder.specs, unit, folder.unit_count)
    except CampaignError as error:
        found.append(str(error))
        if sweep:
            write_store(folder.signals, folder.specs, unit, folder.unit_count, path)
    return found


def check_unit(folder: Folder, unit: int, partial: Set[str] = frozenset()) -> str:
    """Return what is wrong with the files of a unit, nothing if they are as the ledger says.

    No record may have one of the digests ``partial``: those of what failed attempts had computed.
    """
    try:
        entry = folder.entry(unit)
    except CampaignError:
        return "the ledger is damaged"
    places = {name: shard(folder.signals, name, unit) for name in entry["digests"]} | {"table": folder.table(unit)}
    wrong = [name for name, digest in entry["digests"].items() if file_digest(places[name]) != digest]
    wrong += [name for name, digest in entry["files"].items() if file_digest(folder.path / name) != digest]
    if broken := [name for name, digest in entry["files"].items() if is_record(name) and digest in partial]:
        return f"{', '.join(broken)} is what a failed attempt had computed"
    return f"{', '.join(wrong)} not as the ledger says" if wrong else ""


def _partial(folder: Folder) -> set[str]:
    """Return the digests of what failed attempts had computed, here and in the campaigns whose results may be here."""
    if "record" not in folder.plan.keep or not folder.plan.reuse:
        return set()
    found = set()
    for path in [str(folder.path), *folder.plan.reuse]:
        with suppress(CampaignError):
            source = Folder(path)
            for unit in source.done():
                with suppress(CampaignError):
                    files = source.entry(unit)["files"]
                    found |= {digest for name, digest in files.items() if not is_record(name)}
    return found


def file_digest(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


def litter(folder: Folder, *, sweep: bool = False) -> list[str]:
    """Return what killed workers have left, and remove it if that is wanted."""
    found = [f"litter: {path.relative_to(folder.path)}" for path in outdated(folder)]
    if sweep:
        remove_outdated(folder)
    files = [p for p in folder.path.rglob(".*") if p.is_file()]
    files += [p for p in (folder.store / "units").glob("*.claim") if owner(p) is None]
    for path in files:
        # what is younger may belong to somebody at work
        if path.suffix == ".claim" or time.time() - path.stat().st_mtime > LITTER_AFTER:
            found.append(f"litter: {path.relative_to(folder.path)}")
            # the claims of what is not done count its attempts
            if sweep and (path.suffix != ".claim" or path.with_suffix(".json").exists()):
                path.unlink(missing_ok=True)
    return found


def outdated(folder: Folder) -> list[Path]:
    """Return the stores of a campaign that was packed, or was to be, in which its results do not stand."""
    packed = [place for place in folder.path.glob("packed-*") if place != folder.store]
    if folder.store == folder.path:
        return sorted(packed)
    loose = [folder.path / name for name in ("units", "table", "signals.zarr")]
    loose += (folder.path / "cases").glob("*.parquet")
    return sorted(place for place in [*packed, *loose] if place.exists())


def remove_outdated(folder: Folder) -> None:
    """Remove them."""
    for place in outdated(folder):
        if place.is_dir():
            shutil.rmtree(place, ignore_errors=True)
        else:
            place.unlink(missing_ok=True)
