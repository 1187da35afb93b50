"""Big-endian numbers of a file, read with the block and byte in every complaint, and written."""

from __future__ import annotations

import struct
from typing import Any, NoReturn

import numpy as np

from gearmbs.flexible.material import FlexibleError

LARGEST = 10_000_000
"""A greater number of nodes, modes or entries is none: what is read there is something else."""


class Reader:
    """Reads numbers from bytes, one block after the other.

    Parameters
    ----------
    data : bytes
    label : str
        Of the file, for messages.
    """

    def __init__(self, data: bytes, label: str) -> None:
        self.data = data
        self.label = label
        self.at = 0

    def wrong(self, block: str, what: str, back: int = 0) -> NoReturn:
        """Raise the error of a block; ``back`` is how many bytes ago it began."""
        raise FlexibleError(f"{self.label}: byte {self.at - back}, block of {block}: {what}")

    def take(self, size: int, block: str) -> bytes:
        """Return the next bytes."""
        if self.at + size > len(self.data):
            self.wrong(block, f"the file ends after {len(self.data)} bytes, {size} more are needed here; it is cut off")
        part = self.data[self.at : self.at + size]
        self.at += size
        return part

    def ints(self, count: int, block: str) -> tuple[int, ...]:
        """Return whole numbers."""
        return struct.unpack(f">{count}i", self.take(4 * count, block))

    def count(self, number: int, block: str, none: bool = False) -> int:
        """Return a number of things that was just read, if it can be one."""
        if not (0 if none else 1) <= number <= LARGEST:
            self.wrong(block, f"{number} is no number of them; another byte order, or a block before it is longer", 4)
        return number

    def records(self, fields: list[tuple], count: int, block: str) -> np.ndarray:
        """Return rows of named fields; floats must be finite."""
        kind = np.dtype(fields)
        rows = np.frombuffer(self.take(kind.itemsize * count, block), kind)
        for name in kind.names or ():
            if kind[name].base.kind == "f" and not np.all(np.isfinite(rows[name])):
                self.wrong(block, "it has numbers that are not finite", kind.itemsize * count)
        return rows

    def floats(self, count: int, block: str) -> np.ndarray:
        """Return finite floats."""
        return self.records([("v", ">f8")], count, block)["v"].astype(float)

    def text(self, length: int, block: str) -> str:
        """Return a text of so many characters, 4 bytes each, without what fills it up."""
        codes = self.ints(length, block)
        return "".join(chr(c) for c in codes if 32 <= c < 127).strip()


def ints_bytes(*numbers: int) -> bytes:
    """Return whole numbers as bytes."""
    return np.array([int(k) for k in numbers], dtype=">i4").tobytes()


def floats_bytes(*parts: Any) -> bytes:
    """Return floats as bytes."""
    return b"".join(np.asarray(part, dtype=">f8").tobytes() for part in parts)


def record_bytes(fields: list[tuple], columns: Any) -> bytes:
    """Return rows of named fields as bytes."""
    kind = np.dtype(fields)
    rows = np.zeros(len(columns[0]), kind)
    for name, column in zip(kind.names or (), columns):
        rows[name] = column
    return rows.tobytes()


def text_bytes(text: str, length: int) -> bytes:
    """Return a text as so many characters of 4 bytes each, filled up with zeros."""
    return ints_bytes(*[ord(c) for c in text[:length]], *[0] * (length - min(len(text), length)))
