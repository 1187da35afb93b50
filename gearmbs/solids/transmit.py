"""Nodes of a Parasolid text transmit file (.x_t, .xmt_txt).

Source: Siemens, Parasolid XT Format Reference, chapters 2 and 3. Line ends mean nothing; a number is followed by one
space, a character by none. The first node of a type says how its fields differ from those of schema 13006.
"""

from __future__ import annotations

import bisect
import re
from pathlib import Path
from typing import Any

from gearmbs.dae.problem import ModelError
from gearmbs.solids.layouts import BASE, Field

BASE_SCHEMA = "13006"
END_OF_HEADER = b"**END_OF_HEADER"
UNCHANGED = 255
"""What stands for a list of fields that is that of the base schema."""
TERMINATOR = 1
WIDTH = {"f": 1, "v": 3, "h": 3, "b": 6, "i": 2}
"""Real numbers in a value."""
INTEGERS = "dpnuwt"
LARGEST = 10_000_000
"""Values in one field; more is a damaged file."""
NUMBER = re.compile(r"[-+]?[0-9.][-+0-9.eE]* ?|\? ?")
RESAVE = "save the solid again from a program with Parasolid 14 or later, or as .stl"


class Node:
    """A node: its number, the name of its type, and its fields as attributes."""

    __slots__ = ("__dict__", "index", "kind")

    def __init__(self, index: int, kind: str, fields: dict[str, Any]) -> None:
        self.index = index
        self.kind = kind
        self.__dict__.update(fields)

    def __getattr__(self, name: str) -> Any:
        raise ModelError(f"its {self.kind} {self.index} has no field '{name}'; {RESAVE}")


class Nodes(dict[int, Node]):
    """Nodes by their numbers."""

    def __missing__(self, number: int) -> Node:
        raise ModelError(f"its node {number} is not there; {RESAVE}")


class Text:
    """The text after the header, read value by value."""

    def __init__(self, text: str, start_of_line: list[int]) -> None:
        self.text = text
        self.at = 0
        self._lines = start_of_line

    def line(self) -> int:
        """Return the line of the file that holds the next value."""
        return bisect.bisect_right(self._lines, self.at)

    def number(self) -> str:
        """Return the next number as text; '?' if it is not set."""
        match = NUMBER.match(self.text, self.at)
        if match is None:
            found = self.text[self.at : self.at + 10]
            raise ValueError(f"a number is expected, not {found!r}" if found else "it ends")
        self.at = match.end()
        return match.group().rstrip(" ")

    def integer(self) -> int:
        """Return the next integer; 0 if it is not set."""
        word = self.number()
        return 0 if word == "?" else int(word)

    def count(self) -> int:
        """Return the next integer, a number of things."""
        value = self.integer()
        if not 0 <= value <= LARGEST:
            raise ValueError(f"{value} values cannot be in one field")
        return value

    def reals(self, width: int) -> tuple[float, ...]:
        """Return so many real numbers, NaN where they are not set, which is said once for all."""
        first = self.number()
        if first == "?":
            return (float("nan"),) * width
        return (float(first), *(float(self.number()) for _ in range(width - 1)))

    def characters(self, count: int) -> str:
        """Return the next characters; a backslash and a character stand for one, or for nine spaces."""
        text, out = self.text, []
        for _ in range(count):
            c = text[self.at : self.at + 1]
            if not c:
                raise ValueError("it ends")
            if c == "\\":
                c = {"0": "\0", "n": "\n", "r": "\r", "\\": "\\", "9": "\t"}.get(text[self.at + 1 : self.at + 2], "?")
                self.at += 1
            self.at += 1
            out.append(c)
        return "".join(out)

    def string(self) -> str:
        """Return a short string: its length, then its characters."""
        return self.characters(self.count())


def read_transmit(path: Path) -> Nodes:
    """Read the nodes of a text transmit file, by their numbers; that of 1 is the root.

    Raises
    ------
    ModelError
        If the file cannot be read, is no text transmit file, has no embedded schema, or is damaged.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ModelError(f"{path}: cannot be read: {error.strerror or error}") from None
    text = _body(path, data)
    try:
        return _nodes(text)
    except (ValueError, OverflowError) as error:
        raise ModelError(f"{path}:{text.line()}: it is not a whole transmit file: {error}") from None


def _body(path: Path, data: bytes) -> Text:
    at = data.find(END_OF_HEADER)
    if at < 0:
        raise ModelError(f"{path}: it is no Parasolid transmit file: its header has no line **END_OF_HEADER")
    end = data.find(b"\n", at)
    end = len(data) if end < 0 else end + 1
    if data[end : end + 2] == b"PS" or data[end : end + 1] == b"B":
        raise ModelError(f"{path}: it is a binary transmit file; save the solid as text (.x_t) or as .stl")
    if data[end : end + 1] != b"T":
        raise ModelError(f"{path}: after its header stands no transmit data in text; save the solid again as .x_t")
    first_line = data.count(b"\n", 0, end)
    lines = [line.rstrip(b"\r ") for line in data[end:].split(b"\n")]
    starts, total = [-1] * first_line, 0
    for line in lines:
        starts.append(total)
        total += len(line)
    text = Text(b"".join(lines).decode("latin-1"), starts)
    return text


def _nodes(text: Text) -> Nodes:
    text.at = 1
    text.string()
    schema = text.string()
    if not schema.endswith("_" + BASE_SCHEMA):
        raise ValueError(f"its schema {schema} is not given with it; {RESAVE}")
    text.integer()
    user_fields = text.count()
    layouts: dict[int, tuple[str, tuple[Field, ...]]] = {}
    nodes = Nodes()
    while True:
        number = text.integer()
        if number == TERMINATOR:
            break
        if number not in layouts:
            layouts[number] = _layout(text, number)
        name, fields = layouts[number]
        length = text.count() if fields and fields[-1].size == 1 else 0
        index = text.integer()
        nodes[index] = Node(index, name, {f.name: _value(text, f, length) for f in fields})
        if user_fields and name in VISIBLE:
            for _ in range(user_fields):
                text.integer()
    if 1 not in nodes:
        raise ValueError("it has no root, node 1")
    return nodes


VISIBLE = frozenset(name for name, fields in BASE.values() if fields[0].name in ("node_id", "highest_node_id"))


def _layout(text: Text, number: int) -> tuple[str, tuple[Field, ...]]:
    """Return name and fields of a type of node as its first node gives them."""
    count = text.count()
    known = BASE.get(number)
    if count == UNCHANGED:
        if known is None:
            raise ValueError(f"nodes of type {number} are not known; save the solid as .stl")
        return known
    if text.text[text.at : text.at + 1].isdigit():
        name = text.string()
        text.string()
        return name, tuple(_new_field(text) for _ in range(count))
    if known is None:
        raise ValueError(f"nodes of type {number} are not known; save the solid as .stl")
    name, base = known
    fields: list[Field] = []
    at = 0
    while True:
        step = text.characters(1)
        if step == "Z":
            break
        if step in "CD" and at >= len(base):
            raise ValueError(f"{name} is said to have more fields than it has")
        if step == "C":
            fields.append(base[at])
        elif step in "IA":
            fields.append(_new_field(text))
        elif step != "D":
            raise ValueError(f"{step!r} is no change of a schema")
        at += step in "CD"
    if len(fields) != count:
        raise ValueError(f"{name} is said to have {count} fields, but {len(fields)} are given")
    return name, tuple(fields)


def _new_field(text: Text) -> Field:
    name, pointer, count = text.string(), text.integer(), text.count()
    kind = "p" if pointer else text.string()
    if kind not in INTEGERS and kind not in WIDTH and kind not in "cl":
        raise ValueError(f"a field of type {kind!r} is not known")
    if count == 1:
        text.characters(1)
    return Field(name, kind, count)


def _value(text: Text, field: Field, length: int) -> Any:
    kind, count = field.type, length if field.size == 1 else field.size or 1
    if kind in INTEGERS:
        values: Any = [text.integer() for _ in range(count)]
    elif kind in WIDTH:
        values = [text.reals(WIDTH[kind]) for _ in range(count)]
        if kind == "f":
            values = [v[0] for v in values]
    elif kind == "c" and count > 1:
        return text.characters(count)
    else:
        values = [text.characters(1) for _ in range(count)]
    return values if field.size else values[0]
