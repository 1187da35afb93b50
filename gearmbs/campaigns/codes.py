"""The codes that the results of a campaign come from: noted in its folder, compared before anything is worked on."""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import sys
import sysconfig
from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, replace
from pathlib import Path

from gearmbs.campaigns.folder import Folder, sealed, unsealed
from gearmbs.campaigns.settings import CampaignError
from gearmbs.files import write_whole
from gearmbs.studies.run.code import Code, CodeChanged, is_installed, what_counts
from gearmbs.studies.run.loaded import as_loaded
from gearmbs.system import rename_over

FIRST = "first"


class OtherCode(CampaignError):
    """The code that works is not the one that the results so far come from."""


def plan_modules(folder: Folder) -> list[str]:
    """Return the modules that a plan names: those of what it simulates and of what it keeps."""
    kept = [item.partition(":")[0] for item in folder.plan.keep if ":" in item and not item.startswith("signal:")]
    return [*folder.plan.subject.modules(), *kept]


def folder_code(folder: Folder, look: Callable[[list[str]], Code]) -> Code:
    """Return the code by which this process would work on a campaign, with the files that its cases read or load.

    Parameters
    ----------
    look : callable
        `code_of` or `running_code`.
    """
    code, files = look(plan_modules(folder)), {**folder.plan.subject.files(), **late_files(folder)}
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
    """Return of how many units that are done each code is; those whose ledger is damaged are left out.

    A code that has grown by modules that some cases alone load is one with what it was before.
    """
    found: Counter[str] = Counter()
    for unit in folder.done():
        try:
            found[folder.entry(unit)["code"]] += 1
        except CampaignError:
            continue
    return Counter({digest: sum(found[one] for one in alike) for digest, alike in one_code(folder, found).items()})


def one_code(folder: Folder, digests: Collection[str]) -> dict[str, list[str]]:
    """Return codes by their digests, each with those that it has grown from."""
    known = {digest: known_code(folder, digest) for digest in digests} if len(digests) > 1 else {}
    found = {digest: [digest] for digest in digests}
    for digest in known:
        for other, code in known.items():
            if other in found and other != digest and code is not None and has_grown(folder, code, known[digest]):
                found[other] += found.pop(digest)
                break
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
    if first != code.digest and has_grown(folder, code, known_code(folder, first or "")):
        write_whole(place, note, durable=folder.path)
        first = code.digest
    if first != code.digest and not mix:
        theirs = known_code(folder, first or "")
        raise OtherCode(
            f"{folder.path}: what is done comes from another code than this one: {code.differences(theirs)}. Take that "
            "code; or do its units again (--other-code again); or go on all the same (--other-code mix), which status "
            "and reports then say"
        )


def has_grown(folder: Folder, code: Code, former: Code | None) -> bool:
    """Return whether a code is a former one with nothing but modules more that cases have loaded since."""
    if former is None or (code.sources, code.setting) != (former.sources, former.setting):
        return False
    more = code.files.keys() - former.files.keys()
    return code.files.items() >= former.files.items() and more <= noted(folder).keys()


def _write_first(place: Path, note: str) -> None:
    """Write a note unless another process has written one: whoever comes second finds the first one's."""
    part = place.with_name(f".{os.getpid()}.{place.name}")
    part.write_text(note, encoding="utf-8")
    try:
        os.link(part, place)
    except FileExistsError:
        pass
    except OSError:
        # no links on this file system
        rename_over(part, place)
    finally:
        part.unlink(missing_ok=True)


# Modules that cases load while they run, under names that no source shows. What sources import, wherever in a file it
# is written, is known beforehand; what a case loads by a name that it puts together is known from its first loading
# on: it is noted in the folder, and from then on the code of the campaign holds its digest, as of a file that is read.


NOTE = "late-"
"""How the notes of such modules begin, in the folder of the codes."""


def loaded_since(before: Collection[str]) -> dict[str, str]:
    """Return the modules of users that this process has loaded since it had some others, with their files."""
    found = {}
    for name in [name for name in sys.modules if name not in before]:
        file = getattr(sys.modules.get(name), "__file__", None)
        if file is None or name.startswith(("__", "gearmbs.")):
            continue
        path = Path(file)
        if not is_installed(path) and not path.is_relative_to(sysconfig.get_path("stdlib")):
            found[name] = file
    return found


def note(folder: Folder, loaded: Mapping[str, str], counted: Collection[str]) -> None:
    """Note the modules that cases have loaded and that do not count yet.

    Parameters
    ----------
    folder : Folder
    loaded : mapping of str to str
        Files of the modules by their names.
    counted : collection of str
        Names of those that count.

    Raises
    ------
    CodeChanged
        If one was edited after it was loaded.
    """
    known = noted(folder)
    for name, file in loaded.items():
        if name in counted or name in known:
            continue
        about = Path(file).stat()
        if not as_loaded(name, Path(file), (about.st_mtime_ns, about.st_ctime_ns, about.st_size)):
            raise CodeChanged(f"{name} was edited after a case had loaded it; start the program again")
        place = folder.path / "codes" / f"{NOTE}{hashlib.sha256(name.encode()).hexdigest()[:16]}.json"
        write_whole(place, sealed({"module": name, "file": file}), durable=folder.path)


def noted(folder: Folder) -> dict[str, str]:
    """Return the modules that cases have loaded, with their files; a damaged note is as none."""
    found = {}
    for place in sorted((folder.path / "codes").glob(f"{NOTE}*.json")):
        try:
            tree = unsealed(place)
            found[str(tree["module"])] = str(tree["file"])
        except (OSError, ValueError, KeyError):
            continue
    return found


def late_files(folder: Folder) -> dict[str, str]:
    """Return the digests of the modules that cases have loaded, by name, as they are here and now."""
    return {name: _digest(_module_file(name, file)) for name, file in noted(folder).items()}


def _module_file(name: str, file: str) -> Path:
    """Return where a module is on this machine: by its name, else where it was when it was noted."""
    try:
        spec = importlib.util.find_spec(name)
    except (ImportError, AttributeError, ValueError):
        spec = None
    return Path(file if spec is None or spec.origin is None else spec.origin)


def _digest(path: Path) -> str:
    try:
        about = path.stat()
    except OSError:
        return "missing"
    return _digest_of(path, (about.st_mtime_ns, about.st_ctime_ns, about.st_size))


@functools.lru_cache(maxsize=256)
def _digest_of(path: Path, stamp: tuple[int, int, int]) -> str:
    """Return the digest of a file that looks so; of Python without what cannot change a number."""
    content = path.read_bytes()
    try:
        return what_counts(content) if path.suffix == ".py" else hashlib.sha256(content).hexdigest()[:32]
    except SyntaxError:
        return hashlib.sha256(content).hexdigest()[:32]
