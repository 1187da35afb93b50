"""What a designation fixes of cylindrical and tapered roller, angular contact and four-point bearings.

Boundary dimensions are those of the dimension series (ISO 15, ISO 355). Of cylindrical roller bearings the raceways F
on the inner ring (types NU, NJ, NUP) and E on the outer ring (type N) are standardised, too, since their rings are
interchangeable (DIN 5412-1): so the rollers' diameter is (E - F)/2 and their pitch diameter (E + F)/2. Of tapered
roller bearings the contact angle is (ISO 355), of the others it is part of the designation. Number and length of
rollers, number and diameter of balls are the maker's.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

RACEWAYS = {
    "2": {20: (26.5, 41.5), 25: (31.5, 46.5), 30: (37.5, 55.5), 35: (44.0, 64.0), 40: (49.5, 71.5), 45: (54.5, 76.5),
          50: (59.5, 81.5)},
    "3": {20: (27.5, 45.5), 25: (34.0, 54.0), 30: (40.5, 62.5), 35: (46.2, 70.2), 40: (52.0, 80.0), 45: (58.5, 88.5),
          50: (65.0, 97.0)},
}  # fmt: skip
"""F and E of cylindrical roller bearings by bore, mm, dimension series 02 and 03."""
TAPERS = {
    "2": {20: (15.25, 12, 57, 10), 25: (16.25, 14, 2, 10), 30: (17.25, 14, 2, 10), 35: (18.25, 14, 2, 10),
          40: (19.75, 14, 2, 10), 45: (20.75, 15, 6, 34), 50: (21.75, 15, 38, 32)},
    "3": {20: (16.25, 11, 18, 36), 25: (18.25, 11, 18, 36), 30: (20.75, 11, 51, 35), 35: (22.75, 11, 51, 35),
          40: (25.25, 12, 57, 10), 45: (27.25, 12, 57, 10), 50: (29.25, 12, 57, 10)},
}  # fmt: skip
"""Width T in mm and contact angle in degrees, minutes and seconds of tapered roller bearings by bore, mm."""
ANGLES = {"C": 15.0, "AC": 25.0, "A": 30.0, "B": 40.0}
"""Contact angle of angular contact bearings by the letter behind the digits, degrees."""
FOUR_POINTS = 35.0
CYLINDRICAL = re.compile(r"^(?:NU|NJ|NUP|N)\s*([23])(\d\d)(?!\d)")
TAPERED = re.compile(r"^30([23])(\d\d)(?!\d)")
ANGULAR = re.compile(r"^7([23])(\d\d)\s*-?\s*(AC|[ABC])(?![A-Z])")
FOUR_POINT = re.compile(r"^QJ\s*([23])(\d\d)(?!\d)")


@dataclass(frozen=True)
class Known:
    """Fields of a bearing that its designation fixes, and the names of those that must be counted or measured."""

    fields: dict[str, Any]
    asked: tuple[str, ...]


def known_of(designation: str, boundary: dict[str, float]) -> Known | None:
    """Return what a designation fixes, None if it is of another kind.

    Parameters
    ----------
    designation : str
        In capitals, without a maker's name.
    boundary : dict
        Bore, outside diameter and width by its dimension series, m; empty if there is none.
    """
    if not boundary:
        return None
    bore = round(1e3 * boundary["bore"])
    middle = 0.5 * (boundary["bore"] + boundary["outside_diameter"])
    if found := CYLINDRICAL.match(designation):
        fields = {"kind": "cylindrical roller", **boundary}
        raceways = RACEWAYS[found[1]].get(bore)
        if raceways is None:
            return Known({**fields, "pitch_diameter": middle}, ("elements", "element_diameter", "roller_length"))
        inner, outer = (1e-3 * value for value in raceways)
        own = {"element_diameter": 0.5 * (outer - inner), "pitch_diameter": 0.5 * (outer + inner)}
        return Known({**fields, **own}, ("elements", "roller_length"))
    if found := TAPERED.match(designation):
        fields = {"kind": "tapered roller", **boundary, "pitch_diameter": middle}
        asked: tuple[str, ...] = ("elements", "element_diameter", "roller_length")
        taper = TAPERS[found[1]].get(bore)
        if taper is None:
            return Known(fields, (*asked, "contact_angle"))
        width, degrees, minutes, seconds = taper
        angle = math.radians(degrees + minutes / 60.0 + seconds / 3600.0)
        return Known({**fields, "width": 1e-3 * width, "contact_angle": angle}, asked)
    if found := ANGULAR.match(designation):
        angle = math.radians(ANGLES[found[3]])
        fields = {"kind": "angular contact", **boundary, "pitch_diameter": middle, "contact_angle": angle}
        return Known(fields, ("elements", "element_diameter"))
    if FOUR_POINT.match(designation):
        angle = math.radians(FOUR_POINTS)
        fields = {"kind": "four point", **boundary, "pitch_diameter": middle, "contact_angle": angle}
        return Known(fields, ("elements", "element_diameter"))
    return None


def dimension_series(designation: str) -> tuple[str, str, str] | None:
    """Return dimension series, "62" or "63", bore code and suffixes of a designation; None if it has no series."""
    for pattern in (CYLINDRICAL, TAPERED, ANGULAR, FOUR_POINT):
        if found := pattern.match(designation):
            return f"6{found[1]}", found[2], designation[found.end() :]
    return None
