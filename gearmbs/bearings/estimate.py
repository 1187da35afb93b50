"""Inner geometry of bearings that makers do not publish, estimated from boundary dimensions and ratings.

Number and size of the elements are standardised nowhere. What is usual follows the section of the bearing: elements of
a share of (D - d) on the mean diameter, which fill a share of the circle of their centres. Where a rating is known, the
size is moved so that ISO 281 gives it, or rollers get the length that does; what is moved stays within `ROOM`.

Of the ten deep groove bearings whose elements are known (`gearmbs.bearings.catalogue.ELEMENTS`) the number of balls is
right and their diameter within 1 % of eight, 3 and 7 % of the others. Others may have one element more or less, which
moves the lines of the races by 1/Z and the radial stiffness, which goes with Z^(2/3) d^(1/3), by two thirds of that.
The life goes with C, which is the maker's where it is known.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from gearmbs.bearings.kinds import KINDS

Rating = Callable[[dict[str, Any]], float]
"""From fields of a bearing to its rating C by ISO 281, N."""

TAPERED_ANGLES = {"0": math.radians(15.5), "2": math.radians(15.5), "3": math.radians(12.95)}
"""Contact angle that ISO 355 gives most sizes of tapered roller bearings, by their diameter series."""

ROOM = 0.12
"""Share by which a diameter may be moved from the usual one for the sake of a rating: known bearings differ by 7 %."""

FEWEST = 7
"""Least number of elements: with fewer the rings would be carried by two of them."""


def estimated(kind: str, found: dict[str, Any], missing: list[str], rating: Rating) -> dict[str, Any]:
    """Return what is missing of the elements of a bearing.

    Parameters
    ----------
    kind : str
    found : dict
        Fields that are known: boundary dimensions, and whatever else is.
    missing : list of str
        Among ``elements``, ``element_diameter`` and ``roller_length``.
    rating : callable
    """
    usual = KINDS[kind].usual
    bore, outside = found["bore"], found["outside_diameter"]
    pitch = found.get("pitch_diameter") or 0.5 * (bore + outside)
    out = {"pitch_diameter": pitch}
    size = found.get("element_diameter") or usual.size * (outside - bore)
    out["element_diameter"] = size
    # the number that fits beside each other is never exceeded
    most = math.floor(math.pi / math.asin(size / pitch))
    out["elements"] = found.get("elements") or max(FEWEST, min(round(usual.fill * math.pi * pitch / size), most))
    if usual.length:
        out["roller_length"] = found.get("roller_length") or usual.length * found["width"]
    wanted = found.get("dynamic_rating")
    if wanted is None:
        return {key: value for key, value in out.items() if key in (*missing, "pitch_diameter")}
    # rollers' C goes with their length to the 7/9, balls' with their diameter to 1.8, or 1.4 of large ones
    for _ in range(4):
        ratio = wanted / rating({**found, **out})
        if "roller_length" in missing:
            out["roller_length"] *= ratio ** (9.0 / 7.0)
        elif "element_diameter" in missing:
            moved = out["element_diameter"] * ratio ** (1.0 / 1.8)
            out["element_diameter"] = min(max(moved, (1.0 - ROOM) * size), (1.0 + ROOM) * size)
    return {key: value for key, value in out.items() if key in (*missing, "pitch_diameter")}
