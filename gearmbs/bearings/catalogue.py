"""Bearings by designation, and those of public recordings.

Boundary dimensions of the common series follow from the designation. Number and size of the elements are standardised
nowhere; those below are the ones found in the bearings named, and agree with the ratings that makers print. Of any
other bearing the catalogue gives the boundary dimensions and asks for the elements.
"""

from __future__ import annotations

import math
import re
from typing import Any

from gearmbs.bearings.boundary import RATINGS, boundary
from gearmbs.bearings.estimate import TAPERED_ANGLES, Rating, estimated
from gearmbs.bearings.kinds import KINDS, BearingError, Known, known_of
from gearmbs.wording import warn


def dimension_series(designation: str) -> tuple[str, str, str] | None:
    """Return dimension series, bore code and suffixes of a designation; None if it has no series of a kind."""
    for kind in KINDS.values():
        if kind.designation is not None and (found := kind.designation.match(designation)):
            return kind.series[found[1]], found[2], designation[found.end() :]
    return None


INCH = 25.4e-3
"""Metres."""

DEEP_GROOVE = {"60": "10", "62": "02", "63": "03", "64": "04"}
"""Dimension series of deep groove bearings by the first two digits of their designations."""

ELEMENTS = {
    "6203": (8, 6.746, 28.5),
    "6204": (8, 7.938, 33.5),
    "6205": (9, 7.94, 39.04),
    "6206": (9, 9.525, 46.0),
    "6207": (9, 11.112, 53.5),
    "6208": (9, 11.906, 60.0),
    "6308": (8, 15.081, 65.0),
    "6309": (8, 17.462, 72.5),
    "6310": (8, 19.05, 80.0),
    "6010": (14, 8.73, 65.0),
}
"""Number of balls, their diameter and pitch diameter, mm."""

RECORDINGS: dict[str, dict[str, Any]] = {
    "CWRU drive end": {"designation": "6205-2RS", "elements": 9, "element_diameter": 0.3126 * INCH,
                       "pitch_diameter": 1.537 * INCH},
    "CWRU fan end": {"designation": "6203-2RS", "elements": 8, "element_diameter": 0.2656 * INCH,
                     "pitch_diameter": 1.122 * INCH},
    "MFPT": {"designation": "NICE", "elements": 8, "element_diameter": 0.235 * INCH, "pitch_diameter": 1.245 * INCH},
    "PHM09": {"designation": "MB ER-10K", "elements": 8, "element_diameter": 0.3125 * INCH,
              "pitch_diameter": 1.319 * INCH},
    "SpectraQuest": {"designation": "ER-16K", "elements": 9, "element_diameter": 0.3125 * INCH,
                     "pitch_diameter": 1.516 * INCH},
    "IMS": {"designation": "ZA-2115", "elements": 16, "element_diameter": 0.331 * INCH, "pitch_diameter": 2.815 * INCH,
            "contact_angle": math.radians(15.17), "kind": "angular contact"},
    "XJTU": {"designation": "UER204", "elements": 8, "element_diameter": 7.92e-3, "pitch_diameter": 34.55e-3},
}  # fmt: skip
"""Bearings of public recordings. That of IMS has two rows: its kinematics hold, its contact does not."""

ALIASES = {
    "NICE": "MFPT", "ER10K": "PHM09", "MBER10K": "PHM09", "ER16K": "SpectraQuest", "ZA2115": "IMS", "UER204": "XJTU",
    "LDKUER204": "XJTU", "CWRUDRIVEEND": "CWRU drive end", "CWRUFANEND": "CWRU fan end", "MFPT": "MFPT",
    "PHM09": "PHM09", "IMS": "IMS", "XJTU": "XJTU", "SPECTRAQUEST": "SpectraQuest", "REXNORDZA2115": "IMS",
}  # fmt: skip
CLASSES = re.compile(r"C(?P<name>N|M|\d+)(?:(?P<half>[HL])(?![A-Z0-9]))?|P[456](?P<short>[0-9])(?![0-9])")
"""Class of radial clearance among the suffixes: written apart or onto others, "/C3", "ZZC3", with its upper or lower
half, "C3H", or in short with the class of precision, "P63" for P6 and C3."""
TABULATED = ("C2", "CN", "C3", "C4", "C5")
CLEARANCES = (
    (10, (0, 7), (2, 13), (8, 23), (14, 29), (20, 37)), (18, (0, 9), (3, 18), (11, 25), (18, 33), (25, 45)),
    (24, (0, 10), (5, 20), (13, 28), (20, 36), (28, 48)), (30, (1, 11), (5, 20), (13, 28), (23, 41), (30, 53)),
    (40, (1, 11), (6, 20), (15, 33), (28, 46), (40, 64)), (50, (1, 11), (6, 23), (18, 36), (30, 51), (45, 73)),
    (65, (1, 15), (8, 28), (23, 43), (38, 61), (55, 90)), (80, (1, 15), (10, 30), (25, 51), (46, 71), (65, 105)),
    (100, (1, 18), (12, 36), (30, 58), (53, 84), (75, 120)), (120, (2, 20), (15, 41), (36, 66), (61, 97), (90, 140)),
    (140, (2, 23), (18, 48), (41, 81), (71, 114), (105, 160)),
    (160, (2, 23), (18, 53), (46, 91), (81, 130), (120, 180)),
    (180, (2, 25), (20, 61), (53, 102), (91, 147), (135, 200)),
    (200, (2, 30), (25, 71), (63, 117), (107, 163), (150, 230)),
)  # fmt: skip
"""Clearances of deep groove bearings up to a bore, mm: least and largest radial clearance of the classes C2, CN, C3,
C4, C5 by ISO 5753-1, um."""
ROLLER_CLEARANCES = (
    (24, (0, 25), (20, 45), (35, 60), (50, 75), (65, 90)), (30, (0, 25), (20, 45), (35, 60), (50, 75), (70, 95)),
    (40, (5, 30), (25, 50), (45, 70), (60, 85), (80, 105)), (50, (5, 35), (30, 60), (50, 80), (70, 100), (95, 125)),
    (65, (10, 40), (40, 70), (60, 90), (80, 110), (110, 140)),
    (80, (10, 45), (40, 75), (65, 100), (90, 125), (130, 165)),
    (100, (15, 50), (50, 85), (75, 110), (105, 140), (155, 190)),
    (120, (15, 55), (50, 90), (85, 125), (125, 165), (180, 220)),
    (140, (15, 60), (60, 105), (100, 145), (145, 190), (200, 245)),
    (160, (20, 70), (70, 120), (115, 165), (165, 215), (225, 275)),
    (180, (25, 75), (75, 125), (120, 170), (170, 220), (250, 300)),
    (200, (35, 90), (90, 145), (140, 195), (195, 250), (275, 330)),
)  # fmt: skip
"""The same of cylindrical roller bearings with a cylindrical bore."""
SUFFIX = re.compile(
    r"(?:N|E|ET|A|B|K|M|MA|J|T|TN9|ETN9|TVH|TVP2?|2?Z|ZZ|2?RS[1HLR]?|2?RSR|2?RZ|LL[BUH]|L[BUH]|DDU?|DU|VV|EE|NR|ZNR|2?ZNR"
    r"|P[456])+"
)
"""Suffixes that makers write onto the digits, which say nothing of the clearance: seals and shields, cages, snap rings,
precision."""
APART = re.compile(r"[CE]|2?HRS|MT\d+|GJN|WT|LHT\d+|V[LAT]\d+|TN|S[0-4]|X?\dK|[25]K|2AS|NS7S?|Q\d+|L\d+|P[456]|")
"""The same of those written apart only: design, grease, heat treatment, quality."""
HYBRID = re.compile(r"(?<![A-Z0-9])HC(?=\d|P|[^A-Z0-9]|$)\d?")
"""Elements of ceramics, with a number for which, that is no class of clearance: "/HC5", "/HC5C3"."""
MAKERS = re.compile(r"^(?:SKF|FAG|NSK|NTN|INA|KOYO)\s*")


def known() -> list[str]:
    """Return the designations that are known with their elements, and the names of recordings."""
    return [*ELEMENTS, *RECORDINGS]


def look_up(
    designation: str, changes: dict[str, Any], names: list[str], rating: Rating | None = None
) -> dict[str, Any]:
    """Return the fields of a designation's bearing; ``names`` are those there are, see `Bearing.from_designation`.

    Of rollers without a length ``dynamic_rating`` is among them, from which it follows. What the designation leaves
    open is estimated where ``rating`` tells how C of ISO 281 follows from fields.
    """
    if not isinstance(designation, str) or not designation.strip():
        raise BearingError(f"designation is {designation!r}; give a text such as '6205'")
    designation, own_fields = _with_fields(designation, names)
    changes = {**own_fields, **changes}
    if not designation:
        missing = {"elements", "element_diameter", "pitch_diameter"} - changes.keys()
        if missing:
            raise BearingError(f"a bearing without a designation needs {', '.join(f'{m}=' for m in sorted(missing))}")
        return changes
    bare = re.sub(r"[^A-Z0-9]", "", designation.upper())
    if bare in ALIASES:
        return {**RECORDINGS[ALIASES[bare]], **changes}
    bare = MAKERS.sub("", designation.upper().strip())
    group = dimension_series(bare)
    if group is not None:
        fixed = known_of(bare, boundary(group[0], int(group[1])))
        if fixed is not None:
            return _asked(designation, fixed, changes, _named_class(designation, group[2], changes), rating)
    digits = re.match(r"^(\d{4,5})", bare)
    series = digits[1] if digits else ""
    named = None
    if digits:
        suffixes = bare[digits.end() :]
        named = _named_class(designation, suffixes, changes)
        _check_suffix(designation, suffixes, changes)
    if series in ELEMENTS:
        z, d, pitch = ELEMENTS[series]
        found = {"elements": z, "element_diameter": 1e-3 * d, "pitch_diameter": 1e-3 * pitch}
        found |= _clearance(named, _boundary(series))
        return {**found, **_boundary(series), "designation": designation.strip(), **changes}
    sizes_of = _boundary(series)
    if sizes_of:
        own = {**sizes_of, "designation": designation.strip(), **_clearance(named, sizes_of), **changes}
        open_ones = [name for name in ("elements", "element_diameter") if own.get(name) is None]
        if not open_ones:
            return {"pitch_diameter": 0.5 * (sizes_of["bore"] + sizes_of["outside_diameter"]), **own}
        if rating is not None:
            own = {**_ratings(series[:2], sizes_of["bore"]), **own}
            return _estimated(designation, series, own, open_ones, rating)
        sizes = ", ".join(f"{key.replace('_', ' ')} {1e3 * value:g} mm" for key, value in sizes_of.items())
        raise BearingError(
            f"designation {designation!r}: {sizes}, but how many balls it has, and of which diameter, differs between "
            "makers; count them and give elements= and element_diameter= (and pitch_diameter= if it is not the mean), "
            "or estimate=True for what is usual"
        )
    if {"elements", "element_diameter", "pitch_diameter"} <= changes.keys():
        if named is not None and "clearance" not in changes:
            raise BearingError(
                f"designation {designation!r}: its bore is not in the catalogue, so that {named} says no clearance; "
                "give clearance= (diametral)"
            )
        return {"designation": designation.strip(), **changes}
    raise BearingError(
        f"designation {designation!r} is not in the catalogue ({', '.join(known())}); give elements=, element_diameter="
        " and pitch_diameter=, and contact_angle= if it is not 0"
    )


def _with_fields(text: str, names: list[str]) -> tuple[str, dict[str, Any]]:
    """Return a designation and the fields written behind it, "6305, elements=7, element_diameter=13.49 mm"."""
    head, *parts = [part.strip() for part in text.split(",")]
    if "=" in head:
        head, parts = "", [head, *parts]
    found: dict[str, Any] = {}
    for part in parts:
        name, _, value = (piece.strip() for piece in part.partition("="))
        if name not in names or not value:
            raise BearingError(
                f"designation {text!r}: {part!r} is no field of a bearing; write name=value, such as 'elements=9', "
                f"with one of {', '.join(names)}"
            )
        try:
            found[name] = int(value) if name == "elements" else float(value)
        except ValueError:
            found[name] = value
    return head, found


def _named_class(designation: str, suffixes: str, changes: dict[str, Any]) -> str | None:
    """Return the class of clearance among the suffixes, "C3" or its half "C3H", None without one.

    Raises
    ------
    BearingError
        For a class that is not tabulated, and for two, unless the clearance is given.
    """
    if HYBRID.search(suffixes) and not {"youngs_modulus", "density"} <= changes.keys():
        warn(
            f"designation {designation!r}: its elements are ceramic by HC, and are taken as steel; give density= (3200 "
            "kg/m^3) and a youngs_modulus= for elements and rings (of silicon nitride on steel 2.46e11 Pa)",
        )
    bare = HYBRID.sub("", suffixes)
    found = {f"C{one['name'] or one['short']}{one['half'] or ''}" for one in CLASSES.finditer(bare)}
    if "clearance" in changes or not found:
        return None
    if len(found) > 1:
        raise BearingError(f"designation {designation!r} names {' and '.join(sorted(found))}; give one class")
    (named,) = found
    if named == "CM":
        warn(
            f"designation {designation!r}: CM is a maker's own class for electric motors, which is not "
            "tabulated here; give clearance= (diametral), it is taken as not given",
        )
        return None
    if named.rstrip("HL") not in TABULATED:
        raise BearingError(
            f"designation {designation!r}: {named} is no class of clearance of the standard; choose "
            f"{', '.join(TABULATED)}, or give clearance= (diametral)"
        )
    return named


def _check_suffix(designation: str, suffixes: str, changes: dict[str, Any]) -> None:
    """Refuse letters written onto the digits that no maker uses: they are a slip, or mean another bearing.

    Warns
    -----
    UserWarning
        Of suffixes written apart that are not known, unless the clearance is given.
    """
    onto, *apart = re.split(r"[^A-Z0-9]+", HYBRID.sub("", suffixes).rstrip())
    letters = CLASSES.sub("", onto)
    if letters and SUFFIX.fullmatch(letters) is None:
        raise BearingError(
            f"designation {designation!r}: {onto!r} right after the digits is no suffix that is known; leave it "
            f"out, or write it apart, '{designation.strip()[: -len(suffixes.rstrip())]}-{onto}', if your maker uses it"
        )
    words = [CLASSES.sub("", word) for word in apart]
    unknown = [word for word in words if word and SUFFIX.fullmatch(word) is None and APART.fullmatch(word) is None]
    if unknown and "clearance" not in changes:
        warn(
            f"designation {designation!r}: what {', '.join(unknown)} means is not known, and is taken to say nothing "
            "of the clearance; give clearance= (diametral) if it does",
        )


def _asked(
    designation: str, fixed: Known, changes: dict[str, Any], named: str | None, rating: Rating | None
) -> dict[str, Any]:
    """Return the fields of a bearing whose designation fixes some; rollers may be without a length if rated."""
    own = {**fixed.fields, **_class_of(designation, fixed, named), "designation": designation.strip(), **changes}
    missing = [name for name in fixed.asked if own.get(name) is None]
    if not missing or (missing == ["roller_length"] and own.get("dynamic_rating") is not None):
        return own
    if rating is not None:
        own = {**_ratings(fixed.rated, own["bore"]), **own}
        return _estimated(designation, fixed.rated, own, missing, rating)
    sizes = ", ".join(
        f"{key.replace('_', ' ')} {1e3 * value:.4g} mm"
        if key != "contact_angle"
        else f"contact angle {math.degrees(value):.4g} deg"
        for key, value in fixed.fields.items()
        if key != "kind"
    )
    hint = (
        " (or dynamic_rating= of the maker's catalogue, which gives the length)" if "roller_length" in missing else ""
    )
    raise BearingError(
        f"designation {designation!r}: {fixed.fields['kind']} bearing, {sizes}; the rest differs between makers: give "
        f"{', '.join(f'{name}=' for name in missing)}{hint}, or estimate=True for what is usual"
    )


def _class_of(designation: str, fixed: Known, named: str | None) -> dict[str, float]:
    """Return the mean clearance of a class that is named; refuse it of bearings that have no radial classes."""
    kind = fixed.fields["kind"]
    if not KINDS[kind].unclassed:
        return _clearance(named, fixed.fields, ROLLER_CLEARANCES if KINDS[kind].rollers else CLEARANCES)
    if named is not None:
        raise BearingError(
            f"designation {designation!r}: {named} says nothing of the radial clearance of {kind} bearings, "
            f"{KINDS[kind].unclassed}; "
            "give clearance= (diametral)"
        )
    return {}


def _clearance(named: str | None, boundary: dict[str, Any], classes: tuple = CLEARANCES) -> dict[str, float]:
    """Return the mean clearance of a class, or of its upper or lower half; empty without one."""
    if named is None or not boundary:
        return {}
    bore = 1e3 * boundary["bore"]
    share = {"H": 0.75, "L": 0.25}.get(named[-1], 0.5)
    for top, *limits in classes:
        if bore <= top + 1e-6:
            low, high = limits[TABULATED.index(named.rstrip("HL"))]
            return {"clearance": 1e-6 * (low + share * (high - low))}
    return {}


def _boundary(series: str) -> dict[str, float]:
    """Return bore, outside diameter and width of a deep groove bearing by its digits, empty if unknown."""
    if len(series) != 4 or series[:2] not in DEEP_GROOVE:
        return {}
    return boundary(DEEP_GROOVE[series[:2]], int(series[2:]))


def _ratings(series: str, bore: float) -> dict[str, float]:
    """Return C and C_0 of a series of `RATINGS` and a bore, N; empty if they are not tabulated."""
    found = RATINGS.get(series, {}).get(round(1e3 * bore))
    return {} if found is None else {"dynamic_rating": 1e3 * found[0], "static_rating": 1e3 * found[1]}


def _estimated(
    designation: str, series: str, own: dict[str, Any], missing: list[str], rating: Rating
) -> dict[str, Any]:
    """Return the fields of a bearing with those that its designation leaves open as they usually are.

    Warns
    -----
    UserWarning
        With what was taken, and how far it may be from the bearing at hand.
    """
    kind = own.get("kind", next(iter(KINDS)))
    found = estimated(kind, own, [name for name in missing if name != "contact_angle"], rating)
    if "contact_angle" in missing:
        found["contact_angle"] = TAPERED_ANGLES[series[-1]]
    count = int(found.get("elements") or own["elements"])
    told = f"{count} elements"
    if "element_diameter" in found:
        told += f" of {1e3 * found['element_diameter']:.4g} mm"
    rated = "its C is that of a maker's catalogue" if "dynamic_rating" in own else "its C is estimated from them, too"
    warn(
        f"designation {designation!r}: {told} are estimated, for makers do not publish them: one element more or less "
        f"moves the lines of its races by {100.0 / count:.2g} %, and its radial "
        f"stiffness is known to some 10 %; {rated}. Count the elements and give elements= and element_diameter= where "
        "that matters",
    )
    return {**own, **{key: value for key, value in found.items() if own.get(key) is None}, "estimated": tuple(missing)}
