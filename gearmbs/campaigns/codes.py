"""The codes that the results of a campaign come from: noted in its folder, compared before anything is worked on."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

from gearmbs.campaigns.folder import Folder, sealed, unsealed
from gearmbs.campaigns.settings import CampaignError
from gearmbs.files import write_whole
from gearmbs.studies.run.code import Code

FIRST = "first"


class OtherCode(CampaignError):
    """The code that works is not the one that the results so far come from."""


def plan_modules(folder: Folder) -> list[str]:
    """Return the modules that a plan names: those of what it simulates and of what it keeps."""
    kept = [item.partition(":")[0] for item in folder.plan.keep if ":" in item and not item.startswith("signal:")]
    return [*folder.plan.subject.modules(), *kept]


def folder_code(folder: Folder, look: Callable[[list[str]], Code]) -> Code:
    """Return the code by which this process would work on a campaign, with the files that its cases read.

    Parameters
    ----------
    look : callable
        `code_of` or `running_code`.
    """
    code, files = look(plan_modules(folder)), folder.plan.subject.files()
    return replace(code, files=files) if files else code


def _file(folder: Folder, name: str) -> Path:
    return folder.path / "codes" / f"{name}.json"


def known_code(folder: Folder, digest: str) -> Code | None:
    """Return the code with a digest, or None if it was not noted or the note is damaged."""
    try:
        code = Code(**unsealed(_file(folder, digest)))
    except (OSError, ValueError, TypeError):
        return None
    return code if code.digest == digest else None


def first_code(folder: Folder) -> str | None:
    """Return the digest of the campaign's code, None if nobody has worked on it yet."""
    try:
        return str(unsealed(_file(folder, FIRST))["code"])
    except (OSError, ValueError, KeyError):
        counts = code_counts(folder)
    # not written yet, or lost: then it is what most of the ledgers say
    return max(counts, key=lambda digest: counts[digest]) if counts else None


def code_counts(folder: Folder) -> Counter[str]:
    """Return of how many units that are done each code is; those whose ledger is damaged are left out."""
    found: Counter[str] = Counter()
    for unit in folder.done():
        try:
            found[folder.entry(unit)["code"]] += 1
        except CampaignError:
            continue
    return found


def admit(folder: Folder, code: Code, *, mix: bool = False, again: bool = False) -> None:
    """Let a code work on a campaign: note it, or refuse it if results so far come from another one.

    Parameters
    ----------
    mix : bool
        Let another one work, too.
    again : bool
        Make it the campaign's code.

    Raises
    ------
    OtherCode
        Naming what differs.
    """
    if known_code(folder, code.digest) is None:
        write_whole(_file(folder, code.digest), sealed(asdict(code)), durable=folder.path)
    place, note = _file(folder, FIRST), sealed({"code": code.digest})
    if again:
        write_whole(place, note, durable=folder.path)
    elif first_code(folder) is None:
        # what is there all the same is damaged
        place.unlink(missing_ok=True)
        _write_first(place, note)
    first = first_code(folder)
    if first != code.digest and not mix:
        theirs = known_code(folder, first or "")
        raise OtherCode(
            f"{folder.path}: what is done comes from another code than this one: {code.differences(theirs)}. Take that "
            "code; or do its units again (--other-code again); or go on all the same (--other-code mix), which status "
            "and reports then say"
        )


def _write_first(place: Path, note: str) -> None:
    """Write a note unless another process has written one: whoever comes second finds the first one's."""
    part = place.with_name(f".{os.getpid()}.{place.name}")
    part.write_text(note)
    try:
        os.link(part, place)
    except FileExistsError:
        pass
    except OSError:
        # no links on this file system
        os.replace(part, place)
    finally:
        part.unlink(missing_ok=True)
