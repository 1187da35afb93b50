"""What functions call the values that they make, for comments in kernels that are written from them."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import FrameType
from typing import Any


@contextmanager
def names_in(file: str, kind: type) -> Iterator[tuple[dict[Any, str], dict[Any, str]]]:
    """Yield two mappings that fill with the names of local variables, while functions of a file are called.

    The first holds those of values, the second those of items of lists, with their number behind the name. A value that
    has several keeps the first: that in the function that has made it.

    Parameters
    ----------
    file : str
        In which the functions are.
    kind : type
        Of the values, which are looked up by what they are.
    """
    single: dict[Any, str] = {}
    items: dict[Any, str] = {}

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event != "return" or code.co_filename != file or code.co_name[0] == "<":
            return
        for name, value in frame.f_locals.items():
            if isinstance(value, kind):
                single.setdefault(value, name)
            elif isinstance(value, (list, tuple)) and name not in code.co_varnames[: code.co_argcount]:
                for k, item in enumerate(value):
                    if isinstance(item, kind):
                        items.setdefault(item, f"{name}[{k}]")

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        yield single, items
    finally:
        sys.setprofile(before)


def told_names(
    single: Mapping[Any, str], items: Mapping[Any, str], slopes: Mapping[tuple[Any, Any], Any]
) -> dict[Any, str]:
    """Return what is said of values: their names, or ``d a / d b`` of derivatives of one by another.

    Parameters
    ----------
    single, items : mapping of value to str
        Of `names_in`.
    slopes : mapping of (value, value) to value
        Derivatives by whose and by what they are, those by an argument of a kernel alone are told.
    """
    told = dict(single)
    for known in (single, {**items, **single}):
        told = {**known, **told}
        for (value, by), slope in slopes.items():
            if by.name and value in told:
                of = f"({told[value]})" if told[value].startswith("d ") else told[value]
                told.setdefault(slope, f"d {of} / d {by.name}")
    return told
