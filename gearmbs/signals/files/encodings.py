"""Text as instruments write it: with byte-order marks or none, in UTF-8, UTF-16 or Windows' own code."""

from __future__ import annotations

import codecs
import re

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
FEWEST_BYTES = 16
LATIN = 0.9
"""Share of the characters of a table that are Latin letters, digits and signs, whose upper byte is zero in UTF-16."""
FALLBACK, CENTRAL = "cp1252", "cp1250"
CENTRAL_VOWELS, CENTRAL_CONSONANTS = frozenset(b"\xe1\xed\xfd"), frozenset(b"\xe8\xec\xf8\xf9")
"""Czech a, i, y with an acute, which Western languages at home in 1252 hardly have, and beside them c, e, r, u."""
CENTRAL_CAPITAL = re.compile(rb"\xc8[a-z]")
"""A Czech C at the begin of a word."""


def encoding_of(head: bytes) -> str:
    """The encoding of a text from its first bytes: by its mark, UTF-8 if it is valid, else Windows' Western code, or
    its Central European one where letters of Czech stand."""
    for mark, name in MARKS:
        if head.startswith(mark):
            return name
    if (unmarked := utf16_without_mark(head)) is not None:
        return unmarked
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        central = not CENTRAL_VOWELS.isdisjoint(head) and not CENTRAL_CONSONANTS.isdisjoint(head)
        return CENTRAL if central or CENTRAL_CAPITAL.search(head) else FALLBACK
    return "utf-8"


def utf16_without_mark(head: bytes) -> str | None:
    """Return the name of UTF-16 without a mark, by zeros in each second byte of a text with lines; None of all else."""
    even = head[: len(head) // 2 * 2]
    if len(even) < FEWEST_BYTES:
        return None
    for name, zeros, others in (("utf-16-le", even[1::2], even[::2]), ("utf-16-be", even[::2], even[1::2])):
        if zeros.count(0) < LATIN * len(zeros) or b"\x00" in others:
            continue
        text = even.decode(name, errors="replace")
        if "\n" in text or "\r" in text:
            return None if any(ord(c) < 32 and c not in "\t\r\n\f" for c in text) else name
    return None


def decoded(data: bytes) -> str:
    """The text of some bytes; what cannot be decoded becomes the replacement character."""
    return data.decode(encoding_of(data[: 1 << 16]), errors="replace")
