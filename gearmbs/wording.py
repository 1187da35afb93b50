"""Parts of messages that all of the package says alike: lists of names, and what an unknown name may have meant."""

from __future__ import annotations

import difflib
import re
import sys
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path

ALIKE = 0.6
"""Least likeness, 0 to 1, of a name that may be meant: difflib's default; one wrong letter of five leaves 0.8."""

OF_ADAMS = {
    ".cmd": "a command file of ADAMS View: `gearmbs adams {name}` runs it",
    ".adm": "a deck of ADAMS: `gearmbs adams {name}` runs it",
    ".acf": "commands of the solver of ADAMS: `gearmbs adams DECK.adm {name}` carries them out",
}
"""What files of ADAMS are, by their endings."""

BETWEEN = ("gearmbs", "contextlib", "dataclasses", "functools")
"""Modules whose lines no warning is about: the package, and what stands between two of its functions."""


def warn(message: str, category: type[Warning] = UserWarning) -> None:
    """Warn of what was asked for, at the line outside of the package that asked for it."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] in BETWEEN:
        level, frame = level + 1, frame.f_back
    warnings.warn(message, category, level)


def of_adams(path: str | Path) -> str:
    """Return the end of a message about a file that is none of what is wanted: what it is, if it is one of ADAMS."""
    told = OF_ADAMS.get(Path(path).suffix.lower())
    return "" if told is None else f"; by its name it is {told.format(name=Path(path).name)}"


def closest(name: object, known: Iterable[str], count: int = 1, alike: float = ALIKE) -> list[str]:
    """Return up to ``count`` known names that are most like another, the most alike first."""
    return difflib.get_close_matches(str(name), list(known), count, alike)


def attribute_meant(name: str, known: Iterable[str], count: int = 4) -> str:
    """Return the end of a message about a guessed name of a program: names that share words with it, or are alike.

    Examples
    --------
    >>> attribute_meant("spring", ["body", "spring_damper", "torsion_spring"])
    '; did you mean spring_damper or torsion_spring?'
    >>> attribute_meant("velocty", ["position", "velocity"])
    '; did you mean velocity?'
    """
    known = list(known)
    shared = {one: len(_words(name) & _words(one)) for one in known}
    best = max(shared.values(), default=0)
    sharing = [one for one in known if best and shared[one] == best]
    # one wrong letter of seven leaves 0.86
    near = closest(name, known, alike=0.85) or sharing[:count] or closest(name, known)
    return f"; did you mean {any_of(near)}?" if near else ""


def _words(name: str) -> set[str]:
    """Return the words of a name in small letters, as gear and pair of GearPair and gear_pair."""
    return {word.lower() for word in re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])", name)}


def did_you_mean(
    name: object,
    known: Iterable[str],
    *,
    before: str = "",
    otherwise: str = "",
    count: int = 1,
    alike: float = ALIKE,
    shown: Callable[[str], str] = str,
) -> str:
    """Return the end of a message about an unknown name.

    Parameters
    ----------
    name : object
        What was given.
    known : iterable of str
        Names that there are.
    before : str
        What goes before the question.
    otherwise : str
        What is said instead where no name is alike.
    count, alike
        See `closest`.
    shown : callable
        How names are written, such as ``repr``.

    Examples
    --------
    >>> did_you_mean("sped", ["speed", "torque"], before="; ")
    '; did you mean speed?'
    >>> did_you_mean("x", ["speed", "torque"], otherwise="known ones are speed and torque")
    'known ones are speed and torque'
    """
    near = closest(name, known, count, alike)
    return f"{before}did you mean {' or '.join(shown(one) for one in near)}?" if near else otherwise


def any_of(names: Iterable[str]) -> str:
    """Return names as messages list them: "A, B or C"."""
    *others, last = names
    return f"{', '.join(others)} or {last}" if others else last
