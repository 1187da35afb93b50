"""Whether a MATLAB 5 file is whole: the tags of its elements fit into each other, its arrays hold what they promise.

The library that reads these files trusts them, and may take minutes, or the whole program with it, where one is
damaged inside.
"""

from __future__ import annotations

import math
import struct
import zlib

MATRIX, COMPRESSED = 14, 15
SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
"""Bytes of a number by its type."""
CELL, STRUCT, OBJECT, CHAR, SPARSE = 1, 2, 3, 4, 5
NUMERIC = range(6, 16)
WHOLE = (5, 6)
"""Types of dimensions; some programs write them without a sign."""
LARGEST = 1 << 28
"""Larger files are not checked: it takes their size in memory."""
DEEPEST = 32


def check_mat5(data: bytes) -> None:
    """Raise a ValueError if the elements of a file of version 5 do not fit together.

    Parameters
    ----------
    data : bytes
        The whole file, its header of 128 bytes included.
    """
    if len(data) > LARGEST:
        return
    order = "<" if data[126:128] == b"IM" else ">"
    at = 128
    while at < len(data):
        kind, body, at = _element(data, at, order)
        if kind == COMPRESSED:
            try:
                body = zlib.decompress(body)
            except zlib.error as exc:
                raise ValueError(f"a compressed variable is damaged ({exc})") from exc
            kind, body, _ = _element(body, 0, order)
        if kind == MATRIX:
            _matrix(body, order, 0)


def _element(data: bytes, at: int, order: str) -> tuple[int, bytes, int]:
    """Type and content of the element at a place, and where the next begins."""
    if at + 8 > len(data):
        raise ValueError("an element is cut off")
    first, size = struct.unpack(f"{order}II", data[at : at + 8])
    if first >> 16:
        size, kind = first >> 16, first & 0xFFFF
        if size > 4:
            raise ValueError("a small element is too long")
        return kind, data[at + 4 : at + 4 + size], at + 8
    if at + 8 + size > len(data):
        raise ValueError("an element is longer than what holds it")
    end = at + 8 + size
    return first, data[at + 8 : end], end if first == COMPRESSED else end + (-size) % 8


def _matrix(data: bytes, order: str, depth: int) -> None:
    """Check the parts of a matrix: flags, dimensions, name, and what its class holds."""
    if not data:
        return
    if depth > DEEPEST:
        raise ValueError("variables are nested too deeply")
    kind, flags, at = _element(data, 0, order)
    if kind != 6 or len(flags) != 8:
        raise ValueError("a variable has no flags")
    word = struct.unpack(f"{order}I", flags[:4])[0]
    held, is_complex = word & 0xFF, bool(word & 0x800)
    if held not in range(1, 18):
        raise ValueError(f"a variable is of the unknown class {held}")
    if held > 15:
        return
    kind, raw, at = _element(data, at, order)
    if kind not in WHOLE or len(raw) % 4 or len(raw) < 8:
        raise ValueError("a variable has no dimensions")
    shape = struct.unpack(f"{order}{len(raw) // 4}i", raw)
    count = math.prod(shape)
    if min(shape) < 0:
        raise ValueError(f"a variable has the dimensions {shape}")
    kind, _, at = _element(data, at, order)
    if kind not in (1, 2, 16):
        raise ValueError("a variable has no name")
    if held in (CELL, STRUCT, OBJECT):
        _nested(data, at, order, depth, held, count)
    elif held in NUMERIC:
        for _ in range(2 if is_complex else 1):
            kind, raw, at = _element(data, at, order)
            if kind not in SIZES or len(raw) != count * SIZES[kind]:
                raise ValueError(f"an array of {count} numbers has {len(raw)} bytes")
    elif held in (CHAR, SPARSE):
        for _ in range(1 if held == CHAR else 3):
            kind, _, at = _element(data, at, order)
            if kind not in SIZES:
                raise ValueError(f"an array is of the unknown type {kind}")


def _nested(data: bytes, at: int, order: str, depth: int, held: int, count: int) -> None:
    """Check the variables within a cell array or struct."""
    if held == OBJECT:
        _, _, at = _element(data, at, order)
    if held != CELL:
        kind, raw, at = _element(data, at, order)
        width = struct.unpack(f"{order}i", raw)[0] if kind in WHOLE and len(raw) == 4 else 0
        kind, names, at = _element(data, at, order)
        if width < 1 or len(names) % width or kind not in (1, 2):
            raise ValueError("a struct has no names")
        count *= len(names) // width
    if count > len(data) // 8:
        raise ValueError(f"{count} variables do not fit into what holds them")
    for _ in range(count):
        kind, body, at = _element(data, at, order)
        if kind != MATRIX:
            raise ValueError("what a struct or cell array holds is no variable")
        _matrix(body, order, depth + 1)
