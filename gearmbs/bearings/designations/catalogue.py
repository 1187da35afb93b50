"""Bearings by designation, and those of public recordings.

Boundary dimensions of the common series follow from the designation. Number and size of the elements are standardised
nowhere; those below are the ones found in the bearings named, and agree with the ratings that makers print. Of any
other bearing the catalogue gives the boundary dimensions and asks for the elements.
"""

from __future__ import annotations

import math
import re
from typing import Any

from gearmbs.bearings.designations.boundary import Size, size_of
from gearmbs.bearings.designations.classes import CLASSES, HYBRID, mean_clearance, named_class
from gearmbs.bearings.designations.estimate import Rating, estimated, usual_angle
from gearmbs.bearings.designations.others import told_of
from gearmbs.bearings.kinds import KINDS, BearingError, Known, known_of
from gearmbs.wording import warn


def series_of(designation: str) -> tuple[str, str, str] | None:
    """Return series, bore code and suffixes of a designation; None if it has no series of a kind."""
    for kind in KINDS.values():
        if kind.designation is not None and (found := kind.designation.match(designation)):
            return kind.series[found[1]], found[2], designation[found.end() :]
    return None


INCH = 25.4e-3
"""Metres."""

DEEP_GROOVE = re.compile(r"^(618|619|160|161|622|623|60|62|63|64)(\d\d(?!\d)|/\d{1,2}(?!\d))|^(6[0-3])(\d)(?!\d)")
"""Designations of deep groove bearings: series, and code of the bore; below 10 mm the bore itself."""

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
SUFFIX = re.compile(
    r"(?:N|E|ET|A|B|K|M|MA|J|T|TN9|ETN9|TVH|TVP2?|2?Z|ZZ|2?RS[1HLR]?|2?RSR|2?RZ|LL[BUH]|L[BUH]|DDU?|DU|VV|EE|NR|ZNR|2?ZNR"
    r"|P[456])+"
)
"""Suffixes that makers write onto the digits, which say nothing of the clearance: seals and shields, cages, snap rings,
precision."""
APART = re.compile(r"[CE]|2?HRS|MT\d+|GJN|WT|LHT\d+|V[LAT]\d+|TN|S[0-4]|X?\dK|[25]K|2AS|NS7S?|Q\d+|L\d+|P[456]|")
"""The same of those written apart only: design, grease, heat treatment, quality."""
TAPERED_BORE = re.compile(r"(?:^|[^A-Z0-9]|[A-JL-Z]|RS\d?|Z)K(?!\d{3})")
"""Among the suffixes: a tapered bore, K, alone, "K/C3", behind other letters, "CCK", or before them, "KTN9"."""
SETS = re.compile(
    r"(?:(?<![A-Z])|(?<=[^A-Z][ABC])|(?<=AC)|(?<=P[2456]A))Q?(?P<set>D[BFTR]|TBT|TFT|TT|Q(?:BC|FC|BT|FT|T))[ABC]?(?![A-Z])"
)
"""Suffixes of matched sets: pairs back to back, face to face, in tandem and of cylindrical roller bearings, and sets of
three and four; Q before those of tapered ones."""
STANDING = {"DB": "a pair back to back", "DF": "a pair face to face", "DT": "a pair in tandem", "DR": "a pair"}
REINFORCED = re.compile(r"^6\d{2,4}(?:/\d\d)?[^A-Z]*E(?:TN9|TVP\d?)?(?![A-Z])|^7\d{3}[^A-Z]*[ABC]{1,2}E")
"""Deep groove and angular contact bearings with larger balls or more of them than those of the basic design."""
MAKERS = re.compile(r"^(SKF|FAG|NSK|NTN|INA|KOYO|TIMKEN|NACHI|NKE|ZVL|ZKL|KINEX|SNR|URB|RHP)\s*")


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
    bare = designation.upper().strip()
    named_maker = MAKERS.match(bare)
    maker, bare = ("", bare) if named_maker is None else (named_maker[1], bare[named_maker.end() :])
    bare = re.sub(r"^([A-Z]+(?:18(?=\s+\d))?)\s+(?=\d)", r"\1", re.sub(r"^SL\s+18", "SL18", bare))
    _check_single(designation, bare)
    if rating is not None and "dynamic_rating" not in changes and REINFORCED.search(bare):
        warn(
            f"designation {designation!r}: E is a reinforced design, of larger balls or more of them; balls and C are "
            "taken as those of the basic one, where makers print more, 17.8 kN of a 6205 ETN9 instead of 14.0: give "
            "dynamic_rating= and static_rating= of the catalogue",
        )
    group = series_of(bare)
    if group is not None:
        other = re.match(r"\s*/\s*(\d+(?:\.\d+)?)(?![A-Z0-9])", group[2])
        if other is not None and "bore" not in changes:
            raise BearingError(
                f"designation {designation!r}: {other[1]} behind its size names another bore or raceway, which is not "
                "tabulated; leave it away and give bore="
            )
        size = size_of(*group[:2], maker)
        fixed = known_of(bare, {} if size is None else size.boundary)
        if fixed is not None:
            rated = size_of(fixed.rated, group[1], maker) if fixed.rated else size
            named = named_class(designation, group[2], changes)
            return _asked(designation, fixed, changes, named, group[2], rating, rated)
    digits = DEEP_GROOVE.match(bare) or re.match(r"^(\d{4,5})", bare)
    series = digits[0] if digits else ""
    size = None
    if digits and digits.re is DEEP_GROOVE:
        first, code = (part for part in digits.groups() if part)
        size = size_of(first, code, maker)
    named = None
    if digits:
        suffixes = bare[digits.end() :]
        named = named_class(designation, suffixes, changes)
        _check_suffix(designation, suffixes, changes)
    if series in ELEMENTS:
        z, d, pitch = ELEMENTS[series]
        found = {"elements": z, "element_diameter": 1e-3 * d, "pitch_diameter": 1e-3 * pitch}
        known_size = size if size is not None else size_of(series[:2], series[2:], maker)
        assert known_size is not None
        own = {**known_size.boundary, **_clearance(named, known_size), "designation": designation.strip()}
        return {**found, **own, **(known_size.ratings if rating is not None else {}), **changes}
    if size is not None:
        sizes_of = size.boundary
        own = {**sizes_of, "designation": designation.strip(), **_clearance(named, size), **changes}
        open_ones = [name for name in ("elements", "element_diameter") if own.get(name) is None]
        if not open_ones:
            return {"pitch_diameter": 0.5 * (sizes_of["bore"] + sizes_of["outside_diameter"]), **own}
        if rating is not None:
            return _estimated(designation, {**_ratings(size, own), **own}, open_ones, rating)
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
    told = told_of(re.sub(r"\s", "", bare))
    if told:
        raise BearingError(f"designation {designation!r} {told}")
    raise BearingError(
        f"designation {designation!r} is not in the catalogue ({', '.join(known())}); give elements=, element_diameter="
        " and pitch_diameter=, and contact_angle= if it is not 0"
    )


def _check_single(designation: str, bare: str) -> None:
    """Refuse suffixes of matched sets: a set is two bearings or more, of twice the width and more than one's C."""
    digits = re.match(r"[A-Z]*\d+", bare)
    found = SETS.search(bare, digits.end()) if digits else None
    if found is not None:
        what = STANDING.get(found["set"], "a set of three or four bearings")
        senses = ", with sense 1 and -1 as they stand" if found["set"] in ("DB", "DF") else ""
        raise BearingError(
            f"designation {designation!r}: {found['set']} is {what}, with a width and a C of its own; give each of its "
            f"bearings at its own station, without {found['set']}{senses}"
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
    designation: str,
    fixed: Known,
    changes: dict[str, Any],
    named: str | None,
    suffixes: str,
    rating: Rating | None,
    size: Size | None,
) -> dict[str, Any]:
    """Return the fields of a bearing whose designation fixes some; rollers may be without a length if rated."""
    own = {
        **fixed.fields,
        **_class_of(designation, fixed, named, suffixes),
        "designation": designation.strip(),
        **changes,
    }
    missing = [name for name in fixed.asked if own.get(name) is None]
    if not missing or (missing == ["roller_length"] and own.get("dynamic_rating") is not None):
        return own
    if rating is not None:
        return _estimated(designation, {**_ratings(size, own), **own}, missing, rating, fixed, size)
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


def _class_of(designation: str, fixed: Known, named: str | None, suffixes: str) -> dict[str, float]:
    """Return the mean clearance of a class that is named; refuse it of bearings that have no radial classes."""
    kind = fixed.fields["kind"]
    if named is not None and KINDS[kind].tapers and TAPERED_BORE.search(suffixes):
        raise BearingError(
            f"designation {designation!r}: {named} of a tapered bore, K, has limits of its own, which mounting closes; "
            "give clearance= (diametral) as it is mounted"
        )
    if not KINDS[kind].unclassed:
        return mean_clearance(named, fixed.fields.get("bore"), KINDS[kind].classes)
    if named is not None:
        raise BearingError(
            f"designation {designation!r}: {named} says nothing of the radial clearance of {kind} bearings, "
            f"{KINDS[kind].unclassed}; "
            "give clearance= (diametral)"
        )
    return {}


def _clearance(named: str | None, size: Size) -> dict[str, float]:
    """Return the mean clearance of a class of a deep groove bearing; empty without one."""
    return mean_clearance(named, size.bore, "balls")


def _ratings(size: Size | None, own: dict[str, Any]) -> dict[str, float | str]:
    """Return C and C_0 of a size, unless one of them is given; empty if they are not tabulated."""
    return {} if size is None or "dynamic_rating" in own or "static_rating" in own else size.ratings


def _estimated(
    designation: str,
    own: dict[str, Any],
    missing: list[str],
    rating: Rating,
    fixed: Known | None = None,
    size: Size | None = None,
) -> dict[str, Any]:
    """Return the fields of a bearing with those that its designation leaves open as they usually are.

    Warns
    -----
    UserWarning
        With what was taken, and how far it may be from the bearing at hand.
    """
    kind = own.get("kind", next(iter(KINDS)))
    if "contact_angle" in missing:
        own = {**own, "contact_angle": usual_angle(kind, size)}
    asked = [name for name in missing if name != "contact_angle"]
    found = estimated(kind, own, asked, rating, fixed.usual if fixed else None, fixed.raceway if fixed else None)
    count = int(found.get("elements") or own["elements"])
    told = f"{count} elements"
    if "element_diameter" in found:
        told += f" of {1e3 * found['element_diameter']:.4g} mm"
    rated = "its C is estimated from them, too"
    if "dynamic_rating" in own:
        maker, meant = own.get("rating_source"), MAKERS.match(designation.upper().strip())
        rated = f"its C is that of a maker's catalogue ({maker})" if maker else "its C is the one given"
        if maker and meant and not maker.startswith(meant[1]):
            rated += f", as that of {meant[1]} is not tabulated"
    warn(
        f"designation {designation!r}: {told} are estimated, for makers do not publish them: one element more or less "
        f"moves the lines of its races by {100.0 / count:.2g} %, and its radial "
        f"stiffness is known to some 10 %; {rated}. Count the elements and give elements= and element_diameter= where "
        "that matters",
    )
    return {**own, **{key: value for key, value in found.items() if own.get(key) is None}, "estimated": tuple(missing)}
