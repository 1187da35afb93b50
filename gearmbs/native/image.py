"""The memory of a run as it is exported: structs and arrays in one block, with the places that hold addresses.

An instance is a copy of the block to whose addresses its own is added. What a run changes stands first, so that a
state is the beginning of the block; then what never changes, and last scratch, which begins as zeros.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from gearmbs.kernels.structs import LINE, Struct

STATE, CONSTANT, SCRATCH = range(3)
"""What a part of the memory is: changed by a run, never changed, of no use from one call to the next."""


class _Part(NamedTuple):
    """Bytes of a part, and what its address leaves when divided by the size of a line of the cache."""

    data: np.ndarray
    offset_in_line: int


class Image:
    """Memory that is being laid out.

    Attributes
    ----------
    places : dict of int to int
        Of each part, by its number, the offset in the block; known after :meth:`lay_out`.
    """

    def __init__(self) -> None:
        self._parts: list[_Part] = []
        self._kinds: list[int] = []
        self._known: dict[tuple[int, int], int] = {}
        self._inside: list[tuple[int, int, int, int]] = []
        self._functions: list[tuple[int, int, int]] = []
        self._kept: list[np.ndarray] = []
        self.places: dict[int, int] = {}

    def array(self, array: np.ndarray, kind: int) -> int:
        """Take in an array, the same one once; return the number of its part, -1 for an empty one."""
        if array.size == 0:
            return -1
        if not array.flags.c_contiguous:
            raise ValueError("an array of a struct is contiguous")
        address = array.__array_interface__["data"][0]
        key = address, array.nbytes
        if key not in self._known:
            data = np.frombuffer(array.tobytes(), dtype=np.uint8).copy()
            self._known[key] = self._add(data, address % LINE, kind)
            # another array must not take its address
            self._kept.append(array)
        return self._known[key]

    def _add(self, data: np.ndarray, offset_in_line: int, kind: int) -> int:
        self._parts.append(_Part(data, offset_in_line))
        self._kinds.append(kind)
        return len(self._parts) - 1

    def struct(self, struct: Struct, kind: int, kinds: Mapping[str, int] | None = None) -> int:
        """Take in a struct with all its arrays; ``kinds`` are of those that are another kind of memory."""
        number = self.record(struct, kind)
        for name in type(struct).array_members:
            part = self.array(getattr(struct, name), (kinds or {}).get(name, kind))
            self.address_of(number, word_of(struct, name), part)
        return number

    def record(self, struct: Struct, kind: int) -> int:
        """Take in a struct without its arrays, whose addresses are to be told."""
        return self._add(np.frombuffer(bytes(struct), dtype=np.uint8).copy(), 0, kind)

    def address_of(self, number: int, at: int, part: int, inside: int = 0) -> None:
        """Let ``at`` bytes into a part stand the address of a place in another one; 0 for part -1."""
        if part < 0:
            self._word(number, at, 0)
        else:
            self._inside.append((number, at, part, inside))

    def function_at(self, number: int, at: int, function: int) -> None:
        """Let ``at`` bytes into a part stand the address of a function by its number."""
        self._functions.append((number, at, function))

    def _word(self, number: int, at: int, value: int) -> None:
        self._parts[number].data[at : at + 8] = np.frombuffer(np.int64(value).tobytes(), dtype=np.uint8)

    def lay_out(self) -> Layout:
        """Place all parts and return the block."""
        end, ends = 0, []
        for kind in (STATE, CONSTANT, SCRATCH):
            for number, part in enumerate(self._parts):
                if self._kinds[number] != kind:
                    continue
                end += (part.offset_in_line - end) % LINE
                self.places[number] = end
                end += part.data.size
            end += -end % LINE
            ends.append(end)
        for number, at, other, inside in self._inside:
            self._word(number, at, self.places[other] + inside)
        for number, at, function in self._functions:
            self._word(number, at, function)
        block = np.zeros(ends[1], dtype=np.uint8)
        scratch = []
        for number, part in enumerate(self._parts):
            first = self.places[number]
            if self._kinds[number] != SCRATCH:
                block[first : first + part.data.size] = part.data
            elif part.data.any():
                scratch.append(number)
        if scratch:
            raise ValueError(f"parts {scratch} are scratch but hold numbers")
        addresses = np.array(sorted(self.places[number] + at for number, at, *_ in self._inside), dtype=np.int64)
        functions = np.array(
            sorted((self.places[number] + at, function) for number, at, function in self._functions), dtype=np.int64
        ).reshape(-1, 2)
        return Layout(block, ends[0], ends[2], addresses, functions)


class Layout(NamedTuple):
    """The block of memory.

    Attributes
    ----------
    block : ndarray of uint8
        What is not scratch; offsets stand in the place of addresses, numbers in that of functions.
    state : int
        Bytes of the state.
    size : int
        Bytes of an instance.
    inside : ndarray of int64
        Where addresses in the block stand.
    functions : ndarray of int64, shape (f, 2)
        Where addresses of functions stand, and their numbers.
    """

    block: np.ndarray
    state: int
    size: int
    inside: np.ndarray
    functions: np.ndarray


def member_of(kind: Any, name: str) -> int:
    """Return how many bytes into structs of a kind a scalar stands."""
    return getattr(kind, name).offset


def word_of(struct: Struct, name: str) -> int:
    """Return how many bytes into a struct the address of an array stands."""
    kind = type(struct)
    return getattr(kind, "words:").offset + 8 * kind._arrays[name][2]
