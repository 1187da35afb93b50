"""From the text of a command file to its commands: lines joined, comments taken out, arguments apart.

A line ends with ``&`` where the command goes on. An exclamation mark opens a comment unless it stands in quotes or in
brackets, where it negates. A command is some words and arguments ``name = value, value ...``; a value is a text in
quotes, an expression in brackets, or a bare word.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass

TEXT, EXPRESSION, BARE = "text", "expression", "bare"
LONGEST = 2_000_000
"""Characters of one command; a longer one is no command."""

_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_NAMED = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)\s*=(?!=)")
_LINES = re.compile(r"\r\n|\r|\n")
_EXTENDED = re.compile(r"""\.\\?"([A-Za-z0-9][\w $#()+-]*)\\?"(?=[.\s,)&"'\]]|\Z)""")
_CLOSING = {"(": ")", "{": "}", "[": "]"}


class ViewError(ValueError):
    """What is wrong with a command; ``line`` is its place, 0 if only the command is known."""

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(message)
        self.line = line


@dataclass(frozen=True)
class Value:
    """One value of an argument as it was written.

    Attributes
    ----------
    kind : {"text", "expression", "bare"}
    text : str
        Without quotes; with the brackets of an expression.
    line : int
    """

    kind: str
    text: str
    line: int = 0


@dataclass(frozen=True)
class Command:
    """A command as it was written: words, arguments by name with their values, and its line.

    Arguments are pairs, since one that is given twice is an error that only the vocabulary can name.
    """

    words: tuple[str, ...]
    arguments: tuple[tuple[str, tuple[Value, ...]], ...]
    line: int


def plain_name(name: str) -> str:
    """Return the name of an object with ``_`` for what stands in quotes in names: blanks and signs."""
    return re.sub(r"[^\w.$*|]", "_", name.replace('"', "").strip())


def split_line(line: str, depth: int, quote: str) -> tuple[str, bool, int, str]:
    """Return a line without its comment, whether it is continued, and the brackets and the quotation left open."""
    k, n = 0, len(line)
    while k < n:
        c = line[k]
        if quote:
            if c == "\\":
                k += 1
            elif c == quote:
                quote = ""
        elif c in "\"'":
            quote = c
        elif c in "([{":
            depth += 1
        elif c in ")]}":
            depth = max(0, depth - 1)
        elif c == "!" and depth == 0:
            line = line[:k]
            break
        k += 1
    if quote:
        return line, True, depth, quote
    body = line.rstrip()
    return (body[:-1].rstrip(), True, depth, "") if body.endswith("&") else (body, False, 0, "")


def logical_lines(text: str) -> Iterator[tuple[str, tuple[int, ...], tuple[int, ...]]]:
    """Yield each command's text, with the offsets at which its lines begin and the numbers of these lines.

    A text in quotes goes over the ends of lines as it is.
    """
    lines = _LINES.split(text)
    number = 0
    while number < len(lines):
        pieces: list[str] = []
        starts: list[int] = []
        numbers: list[int] = []
        length = depth = opened = 0
        quote = ""
        more = True
        while more and number < len(lines):
            line = lines[number]
            number += 1
            if not quote and (not line.strip() or line.lstrip()[0] in "!#"):
                more = bool(pieces)
                continue
            before = quote
            body, more, depth, quote = split_line(line, depth, quote)
            opened = opened if quote and before else number
            piece = body + "\n" if quote else (body if before else body.strip()) + " "
            starts.append(length)
            numbers.append(number)
            pieces.append(piece)
            length += len(piece)
        if quote:
            # never closed: the command ends with its line, and those after it are read as they are
            keep = numbers.index(opened) + 1
            pieces, starts, numbers, number = pieces[:keep], starts[:keep], numbers[:keep], opened
        if pieces:
            yield "".join(pieces), tuple(starts), tuple(numbers)


def commands(text: str) -> Iterator[Command | ViewError]:
    """Yield the commands of a file in their order; one that has no form as an error with its line.

    Names with parts in quotes, ``."my model"."part 1"``, are made plain ones.
    """
    text = _EXTENDED.sub(lambda match: f".{plain_name(match.group(1))}", text)
    for body, starts, numbers in logical_lines(text):
        try:
            yield _Reader(body, starts, numbers).command()
        except ViewError as error:
            yield error


def closed(text: str, at: int) -> int:
    """Return the place behind the bracket that closes the one at a place.

    Raises
    ------
    ViewError
        If none does.
    """
    reader = _Reader(text, (0,), (0,))
    reader.at = at
    reader.balanced()
    return reader.at


class _Reader:
    """Takes one command apart."""

    def __init__(self, text: str, starts: tuple[int, ...], numbers: tuple[int, ...]) -> None:
        self.text, self.starts, self.numbers, self.at = text, starts, numbers, 0
        if len(text) > LONGEST:
            raise self.error(f"a command of {len(text)} characters; at most {LONGEST} can be read")

    def line(self, at: int | None = None) -> int:
        return self.numbers[max(0, bisect_right(self.starts, self.at if at is None else at) - 1)]

    def error(self, message: str) -> ViewError:
        return ViewError(message, self.line() if self.numbers else 0)

    def command(self) -> Command:
        words: list[str] = []
        while (match := _WORD.match(self.text, self._skip())) is not None and not _NAMED.match(self.text, self.at):
            words.append(match.group().lower())
            self.at = match.end()
        arguments = []
        while self._skip() < len(self.text):
            named = _NAMED.match(self.text, self.at)
            if named is None:
                raise self.error(f"expected 'name = value', found {self.text[self.at : self.at + 40].strip()!r}")
            self.at = named.end()
            arguments.append((named.group(1).lower(), self._values(named.group(1))))
        if not words:
            raise self.error("a command begins with a word such as 'marker create'")
        return Command(tuple(words), tuple(arguments), self.numbers[0])

    def _skip(self) -> int:
        while self.at < len(self.text) and self.text[self.at] in " \t\n":
            self.at += 1
        return self.at

    def _values(self, name: str) -> tuple[Value, ...]:
        values: list[Value] = []
        while True:
            if self._skip() >= len(self.text):
                if values:
                    return tuple(values)
                raise self.error(f"{name} = has no value")
            values.append(self._value())
            if self._skip() < len(self.text) and self.text[self.at] == ",":
                self.at += 1
                continue
            return tuple(values)

    def _value(self) -> Value:
        start, c = self.at, self.text[self.at]
        line = self.line(start)
        if c in "\"'":
            return Value(TEXT, self._quoted(c), line)
        if c == "(":
            self.balanced()
            return Value(EXPRESSION, self.text[start : self.at], line)
        while self.at < len(self.text) and self.text[self.at] not in " \t,":
            if self.text[self.at] in "\"'":
                self._quoted(self.text[self.at])
            elif self.text[self.at] in _CLOSING:
                self.balanced()
            else:
                self.at += 1
        if self.at == start:
            raise self.error("a value is missing before the comma")
        return Value(BARE, self.text[start : self.at], line)

    def _quoted(self, quote: str) -> str:
        out = []
        k = self.at + 1
        while k < len(self.text) and self.text[k] != quote:
            if self.text[k] == "\\" and k + 1 < len(self.text) and self.text[k + 1] in "\"'\\":
                k += 1
            out.append(self.text[k])
            k += 1
        if k >= len(self.text):
            raise self.error("a text is not closed by its quotation mark")
        self.at = k + 1
        return "".join(out)

    def balanced(self) -> None:
        """Go behind a bracket and what it closes."""
        open_: list[str] = []
        while self.at < len(self.text):
            c = self.text[self.at]
            if c in "\"'":
                self._quoted(c)
                continue
            if c in _CLOSING:
                open_.append(_CLOSING[c])
            elif open_ and c == open_[-1]:
                open_.pop()
            self.at += 1
            if not open_:
                return
        raise self.error("a bracket is not closed")
