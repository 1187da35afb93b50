"""Text as instruments write it: with byte-order marks, in UTF-8, UTF-16 or Windows' own code."""

from __future__ import annotations

import codecs

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
FALLBACK = "cp1252"


def encoding_of(head: bytes) -> str:
    """The encoding of a text from its first bytes: by its mark, UTF-8 if it is valid, else Windows' Western code."""
    for mark, name in MARKS:
        if head.startswith(mark):
            return name
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return FALLBACK
    return "utf-8"


def decoded(data: bytes) -> str:
    """The text of some bytes; what cannot be decoded becomes the replacement character."""
    return data.decode(encoding_of(data[: 1 << 16]), errors="replace")
