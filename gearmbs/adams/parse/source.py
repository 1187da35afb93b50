"""From the lines of a deck to logical statements: comments, continuations, several on a line.

A line that begins with a comma continues the statement before it, and so does the line after a
final ampersand.  The comma of a continuation is kept as ``CONTINUED``: between arguments it
separates them, inside a function expression it only marks the new line.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from gearmbs.adams.errors import ERROR, DeckError, Diagnostic

CONTINUED = "\x01"
_VIEW_NAME = re.compile(r"(?:adams_)?view_name\s*=\s*['\"]([^'\"]*)['\"]", re.IGNORECASE)
_PAIR = re.compile(r"\s*gearmbs pair:(.*)")
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")


@dataclass(frozen=True)
class RawStatement:
    """The text of one statement and where its parts stand.

    Attributes
    ----------
    text : str
        Joined lines; continuation commas are ``CONTINUED``.
    starts : tuple of int
        Offset in ``text`` where each source line begins.
    lines : tuple of int
        The source line numbers.
    view_name : str or None
        Name from an ``adams_view_name`` comment in front.
    pair : str
        What comments in front say of a gear pair.
    """

    text: str
    starts: tuple[int, ...]
    lines: tuple[int, ...]
    view_name: str | None = None
    pair: str = ""

    @property
    def line(self) -> int:
        """First source line."""
        return self.lines[0]

    def line_at(self, offset: int) -> int:
        """Return the source line of a place in the text."""
        return self.lines[max(0, bisect_right(self.starts, offset) - 1)]


def read_file(path: Path) -> str:
    """Return the text of a file.

    Raises
    ------
    DeckError
        When it cannot be read.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DeckError([Diagnostic(ERROR, f"cannot be read: {error.strerror or error}", str(path), 0)]) from error
    return read_text(data)


def read_text(data: bytes) -> str:
    """Decode a file: UTF-8 where it is valid, else Latin-1."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _without_comment(line: str) -> tuple[str, str]:
    """Split a line at its comment sign."""
    at = line.find("!")
    return (line, "") if at < 0 else (line[:at], line[at + 1 :])


def statements(text: str, first_line: int = 1, skip: int = 0) -> Iterator[RawStatement]:
    """Yield the statements of a deck or commands of a script.

    Parameters
    ----------
    text : str
    first_line : int
        Number of the first line of ``text``.
    skip : int
        Lines to leave out at the start (the title).
    """
    pieces: list[str] = []
    starts: list[int] = []
    lines: list[int] = []
    length = 0
    name: str | None = None
    pending: str | None = None
    pair = pending_pair = ""
    open_end = False

    def flush() -> Iterator[RawStatement]:
        nonlocal pieces, starts, lines, length, name, pair
        if pieces and "".join(pieces).strip(" \t," + CONTINUED):
            yield RawStatement("".join(pieces), tuple(starts), tuple(lines), name, pair)
        pieces, starts, lines, length, name, pair = [], [], [], 0, None, ""

    def add(piece: str, number: int) -> None:
        nonlocal length
        starts.append(length)
        lines.append(number)
        pieces.append(piece)
        length += len(piece)

    for offset, line in enumerate(re.split(r"\r\n|\r|\n", text)):
        if offset < skip:
            continue
        number = first_line + offset
        body, comment = _without_comment(line)
        found = _VIEW_NAME.search(comment) if comment else None
        if found:
            pending = found.group(1)
        more = _PAIR.match(comment) if comment else None
        if more:
            pending_pair += more.group(1).strip()
        body = _CONTROL.sub(" ", body).replace("\t", " ").rstrip()
        stripped = body.lstrip()
        if not stripped:
            continue
        if stripped[0] == "," and pieces:
            add(" " + CONTINUED + stripped[1:], number)
        elif open_end and pieces:
            add(" " + stripped, number)
        else:
            yield from flush()
            name, pending, pair, pending_pair = pending, None, pending_pair, ""
            add(stripped, number)
        open_end = pieces[-1].endswith("&")
        if open_end:
            pieces[-1] = pieces[-1][:-1]
            length -= 1
        while ";" in pieces[-1]:
            head, _, rest = pieces[-1].partition(";")
            length -= len(pieces[-1]) - len(head)
            pieces[-1] = head
            yield from flush()
            if not rest.strip():
                break
            add(rest.lstrip(), number)
    yield from flush()
