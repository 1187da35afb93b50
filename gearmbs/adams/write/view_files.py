"""Writes the deck of a command file and its simulations: whole, over nothing of others, and saying what is left out."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from gearmbs.adams.errors import ERROR, DeckError, Diagnostic
from gearmbs.adams.parse.commands import Script
from gearmbs.files import write_whole

_SIGNED = re.compile(r"^! written by gearmbs, ([0-9a-f]{16})\n", re.MULTILINE)
"""A line that says by which lines around it a file was written: whoever changed these has made it his own."""


def texts_of(
    path: Path,
    text: str,
    scripts: Mapping[str, Script],
    models: Mapping[str, str],
    left_out: Mapping[str, Sequence[Diagnostic]],
) -> dict[Path, str]:
    """Return the deck and its simulations as they are written, by their files.

    Parameters
    ----------
    path : Path
        Of the deck.
    text : str
        Its statements.
    scripts : mapping of str to Script
    models : mapping of str to str
        The statements of those simulations that have a deck of their own.
    left_out : mapping of str to sequence of Diagnostic
        What these decks lack, under "" what the first one does, which comments behind their titles say.
    """
    found = {path: _deck(text, left_out.get("", ()))}
    for name, script in scripts.items():
        stem, k = re.sub(r"\W+", "_", name), 1
        file = path.with_name(f"{path.stem}_{stem}.acf")
        # names that differ by signs alone are files of their own
        while file in found or file.with_suffix(".adm") in found:
            k += 1
            file = path.with_name(f"{path.stem}_{stem}_{k}.acf")
        model = path.stem
        if name in models:
            model = file.stem
            found[file.with_suffix(".adm")] = _deck(models[name], left_out.get(name, ()))
        commands = [*(command.text for command in script), "STOP"]
        found[file] = _signed([model, file.stem], "\n".join(commands) + "\n")
    return found


def _deck(text: str, left_out: Sequence[Diagnostic]) -> str:
    title, _, statements = text.partition("\n")
    return _signed([title, *(f"! LEFT OUT: {' '.join(str(one).split())}" for one in left_out)], statements)


def write_new(texts: Mapping[Path, str], source: str, overwrite: bool = False) -> list[Path]:
    """Write files, all or none.

    Parameters
    ----------
    texts : mapping of Path to str
    source : str
        The command file, which stays whatever is asked for.
    overwrite : bool
        Whether files may be replaced that were not written here, or have been changed since.

    Returns
    -------
    list of Path

    Raises
    ------
    DeckError
        Naming each file that would be lost.
    """
    lost = []
    for path in texts:
        if not path.exists():
            continue
        if Path(source).exists() and path.samefile(source):
            lost.append(f"{path} is the command file itself; give the deck another name")
        elif not path.is_file():
            lost.append(f"{path} is no file; give the deck another name")
        elif not overwrite and not _is_ours(path):
            lost.append(
                f"{path} is there, and was not written by --to-deck, or changed since; give the deck another name, or "
                "--overwrite (in Python overwrite=True)"
            )
    if lost:
        raise DeckError([Diagnostic(ERROR, one, "", 0) for one in lost])
    return [write_whole(path, text) for path, text in texts.items()]


def _signed(head: Sequence[str], rest: str) -> str:
    first = "".join(f"{line}\n" for line in head)
    return f"{first}! written by gearmbs, {_digest(first + rest)}\n{rest}"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _is_ours(path: Path) -> bool:
    text = path.read_bytes().decode(errors="replace")
    found = _SIGNED.search(text)
    return found is not None and _digest(text[: found.start()] + text[found.end() :]) == found.group(1)
