"""The commands that are carried out, by the table `commands.txt`; words and arguments may be shortened as in View."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from gearmbs.adams.view.lexer import ViewError
from gearmbs.wording import did_you_mean

_FILE = Path(__file__).with_name("commands.txt")


@dataclass(frozen=True)
class Row:
    """One command: its words, the kind of object it makes or changes, and its arguments.

    Attributes
    ----------
    words : tuple of str
    verb : {"create", "modify", "set", ...}
    kind : str
        "" of commands that make no object.
    naming : str
        The argument with the object's name, "" if there is none.
    arguments : dict of str to bool
        Whether each has an effect.
    """

    words: tuple[str, ...]
    verb: str
    kind: str
    naming: str
    arguments: dict[str, bool]


@dataclass
class _Node:
    """A word of the commands, what may follow, and the command that ends here."""

    follow: dict[str, _Node] = field(default_factory=dict)
    row: Row | None = None
    ignored: bool = False


COMMON = ("adams_id", "-comments")


def _tree() -> _Node:
    """Return the tree of all words, from the table of commands."""
    root = _Node()
    macros: dict[str, str] = {}
    for given in _FILE.read_text(encoding="utf-8").splitlines():
        line = re.sub(r"@([A-Z_]+)\b(?! =)", lambda match: macros[match.group(1)], given)
        if line.startswith("@"):
            name, _, words = line[1:].partition(" = ")
            macros[name] = words
        elif line.startswith("- "):
            _at(root, tuple(line[2:].split())).ignored = True
        elif line and not line.startswith("!"):
            _enter(root, line)
    return root


def _enter(root: _Node, line: str) -> None:
    words, kind, naming, arguments = (part.strip() for part in line.split("|"))
    named = [*arguments.split(), *(COMMON if kind else ())]
    known = {word.lstrip("-"): not word.startswith("-") for word in named}
    if naming:
        known[naming] = True
    if kind:
        known[f"new_{naming}"] = True
    attributes = "attributes" in words.split()
    for verb in ("create", "modify") if "*" in words else (words.split()[-1] if not kind else words.split()[1],):
        path = tuple(verb if word == "*" else word for word in words.split())
        _at(root, path).row = Row(path, "attributes" if attributes else verb, kind, naming, known)


def _at(root: _Node, path: tuple[str, ...]) -> _Node:
    for word in path:
        root = root.follow.setdefault(word, _Node())
    return root


ROOT = _tree()
ROWS = [node.row for node in (lambda walk: walk(walk, ROOT))(
    lambda walk, node: [node, *(one for child in node.follow.values() for one in walk(walk, child))]
) if node.row is not None]  # fmt: skip
"""All rows."""


CLASSES = {"body": {"part", "point_mass", "flexible_body"}, "all": {row.kind for row in ROWS}} | {
    word: {row.kind for row in ROWS if row.kind and word in row.words[::2]}
    for word in "constraint joint primitive_joint force geometry measure data_element rigid_body".split()
}
"""Kinds of objects by what types of View are called that are no kinds themselves."""
UNSEEN = frozenset("analysis dialog_box library toolbar window button color view page plot plot_curve file".split())
"""Types of objects of the interface, and of results: there is none."""


def kinds_of(word: str, line: int = 0) -> set[str]:
    """Return the kinds of objects that are of a type of View.

    Raises
    ------
    ViewError
        If none is known by this name: what is done with all of a type would be done with none.
    """
    name = word.strip().lower()
    known = {row.kind for row in ROWS if row.kind}
    if name in CLASSES or name in known or name in UNSEEN:
        return CLASSES.get(name, {name})
    named = did_you_mean(name[:40], sorted(known | CLASSES.keys()), before="; ")
    raise ViewError(f"type = {word[:40]} is not known here{named}; give part, marker, joint, force or another", line)


def resolve(words: tuple[str, ...], line: int) -> Row | None:
    """Return the row of a command whose words may be shortened, None of one that is ignored.

    Raises
    ------
    ViewError
        If a word is unknown or ambiguous.
    """
    node: _Node = ROOT
    path: list[str] = []
    for word in words:
        if node.ignored:
            return None
        match = _match(node, word)
        if match is None:
            raise ViewError(_unknown(node, path, word), line)
        path.append(match)
        node = node.follow[match]
    if node.row is not None:
        return node.row
    if node.ignored:
        return None
    raise ViewError(f"the command '{' '.join(path)}' is not whole; it goes on with {', '.join(node.follow)}", line)


def _match(node: _Node, word: str) -> str | None:
    if word in node.follow:
        return word
    found = [w for w in node.follow if w.startswith(word)]
    return found[0] if len(found) == 1 else None


def _unknown(node: _Node, path: list[str], word: str) -> str:
    found = [w for w in node.follow if w.startswith(word)]
    said = " ".join([*path, word])[:80]
    if found:
        return f"the command '{said}' is ambiguous: {', '.join(found)}"
    return f"the command '{said}' is not known here{did_you_mean(word[:40], node.follow, before='; ')}"


def argument_of(row: Row, word: str, line: int) -> str:
    """Return the full name of an argument.

    Raises
    ------
    ViewError
        If it is unknown or ambiguous.
    """
    if word in row.arguments:
        return word
    found = [w for w in row.arguments if w.startswith(word) and not w.startswith("new_")] or [
        w for w in row.arguments if w.startswith(word)
    ]
    if len(found) == 1:
        return found[0]
    if row.verb == "attributes":
        return word
    command = " ".join(row.words)
    if found:
        raise ViewError(f"{command}: {word} is ambiguous: {', '.join(found)}", line)
    raise ViewError(
        f"{command}: it has no argument {word[:40]}{did_you_mean(word[:40], row.arguments, before='; ')}", line
    )
