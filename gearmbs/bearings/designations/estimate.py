"""Inner geometry of bearings that makers do not publish, estimated from boundary dimensions and ratings.

Number and size of the elements are standardised nowhere. What is usual follows the section of the bearing: elements of
a share of (D - d) on the mean diameter, which fill a share of the circle of their centres. Where a rating is known, the
size is moved so that ISO 281 gives it, or rollers get the length that does; what is moved stays within `ROOM`.

Of the ten deep groove bearings whose elements are known (``ELEMENTS`` of the catalogue) the number of balls is right
and their diameter within 1 % of eight, 3 and 7 % of the others. Others may have one element more or less, which
moves the lines of the races by 1/Z and the radial stiffness, which goes with Z^(2/3) d^(1/3), by two thirds of that.
The life goes with C, which is the maker's where it is known.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from gearmbs.bearings.designations.boundary import Size
from gearmbs.bearings.kinds import KINDS, Usual
from gearmbs.units import to_si

Rating = Callable[[dict[str, Any]], float]
"""From fields of a bearing to its rating C by ISO 281, N."""

LIMIT_BY_TANGENT = 1.5
"""e by tan(a) in ISO 281 of bearings with a contact angle of rollers, and of self-aligning ball bearings."""

ROOM = 0.12
"""Share by which a diameter may be moved from the usual one for the sake of a rating: known bearings differ by 7 %."""

MEASURED = {
    "bore": "length", "outside_diameter": "length", "width": "length", "pitch_diameter": "length",
    "element_diameter": "length", "roller_length": "length", "row_distance": "length", "dynamic_rating": "force",
}  # fmt: skip
"""Fields that elements follow from, and their dimensions: they may be given as texts."""

FEWEST = 7
"""Least number of elements: with fewer the rings would be carried by two of them."""


def usual_angle(kind: str, size: Size | None) -> float:
    """Return the contact angle by the limit e = 1.5 tan(a) that a maker prints for a size, or that of the kind, rad."""
    if size is None or size.limit is None:
        return KINDS[kind].usual.angle
    return math.atan(size.limit / LIMIT_BY_TANGENT)


def estimated(
    kind: str,
    found: dict[str, Any],
    missing: list[str],
    rating: Rating,
    usual: Usual | None = None,
    raceway: float | None = None,
) -> dict[str, Any]:
    """Return what is missing of the elements of a bearing.

    Parameters
    ----------
    kind : str
    found : dict
        Fields that are known: boundary dimensions, and whatever else is.
    missing : list of str
        Among ``elements``, ``element_diameter``, ``roller_length`` and ``row_distance``.
    rating : callable
    usual : Usual, optional
        What is usual of the series, if not what is of the kind.
    raceway : float, optional
        Diameter of the inner raceway, m: elements roll on it, and their size is a share of what is outside of it.
    """
    found = {
        name: to_si(value, MEASURED[name], name) if isinstance(value, str) and name in MEASURED else value
        for name, value in found.items()
    }
    usual = KINDS[kind].usual if usual is None else usual
    bore, outside = found["bore"] if raceway is None else raceway, found["outside_diameter"]
    size = found.get("element_diameter") or usual.size * (outside - bore)
    pitch = found.get("pitch_diameter") or (0.5 * (bore + outside) if raceway is None else raceway + size)
    out = {"pitch_diameter": pitch}
    out["element_diameter"] = size
    # the number that fits beside each other is never exceeded
    most = math.floor(math.pi / math.asin(size / pitch))
    out["elements"] = found.get("elements") or max(FEWEST, min(round(usual.fill * math.pi * pitch / size), most))
    if usual.length:
        out["roller_length"] = found.get("roller_length") or usual.length * found["width"]
    if usual.apart:
        out["row_distance"] = found.get("row_distance") or usual.apart * found["width"]
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
