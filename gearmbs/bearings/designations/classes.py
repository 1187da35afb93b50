"""Classes of radial clearance among the suffixes of designations, and the clearances they stand for by ISO 5753-1."""

from __future__ import annotations

import re

from gearmbs.bearings.kinds import BearingError
from gearmbs.wording import warn

CLASSES = re.compile(
    r"C(?P<name>N|(?<!EC)M(?![A-Z])|\d+)(?:(?P<half>[HL])(?![A-Z0-9]))?|P[456](?P<short>[0-9])(?![0-9])"
)
"""Class of radial clearance among the suffixes: written apart or onto others, "/C3", "ZZC3", with its upper or lower
half, "C3H", or in short with the class of precision, "P63" for P6 and C3. EC before M is a design with a brass cage."""
TABULATED = ("C2", "CN", "C3", "C4", "C5")
HYBRID = re.compile(r"(?<![A-Z0-9])HC(?=\d|P|[^A-Z0-9]|$)\d?")
"""Elements of ceramics, with a number for which, that is no class of clearance: "/HC5", "/HC5C3"."""
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
SPHERICAL = (
    (18, (10, 20), (20, 35), (35, 45), (45, 60), (60, 75)), (24, (10, 20), (20, 35), (35, 45), (45, 60), (60, 75)),
    (30, (15, 25), (25, 40), (40, 55), (55, 75), (75, 95)), (40, (15, 30), (30, 45), (45, 60), (60, 80), (80, 100)),
    (50, (20, 35), (35, 55), (55, 75), (75, 100), (100, 125)),
    (65, (20, 40), (40, 65), (65, 90), (90, 120), (120, 150)),
    (80, (30, 50), (50, 80), (80, 110), (110, 145), (145, 180)),
    (100, (35, 60), (60, 100), (100, 135), (135, 180), (180, 225)),
    (120, (40, 75), (75, 120), (120, 160), (160, 210), (210, 260)),
    (140, (50, 95), (95, 145), (145, 190), (190, 240), (240, 300)),
    (160, (60, 110), (110, 170), (170, 220), (220, 280), (280, 350)),
    (180, (65, 120), (120, 180), (180, 240), (240, 310), (310, 390)),
    (200, (70, 130), (130, 200), (200, 260), (260, 340), (340, 430)),
)  # fmt: skip
"""The same of spherical roller bearings with a cylindrical bore."""
SELF_ALIGNING = (
    (6, (1, 8), (5, 15), (10, 20), (15, 25), (21, 33)), (10, (2, 9), (6, 17), (12, 25), (19, 33), (27, 42)),
    (14, (2, 10), (6, 19), (13, 26), (21, 35), (30, 48)), (18, (3, 12), (8, 21), (15, 28), (23, 37), (32, 50)),
    (24, (4, 14), (10, 23), (17, 30), (25, 39), (34, 52)), (30, (5, 16), (11, 24), (19, 35), (29, 46), (40, 58)),
    (40, (6, 18), (13, 29), (23, 40), (34, 53), (46, 66)), (50, (6, 19), (14, 31), (25, 44), (37, 57), (50, 71)),
    (65, (7, 21), (16, 36), (30, 50), (45, 69), (62, 88)), (80, (8, 24), (18, 40), (35, 60), (54, 83), (76, 108)),
    (100, (9, 27), (22, 48), (42, 70), (64, 96), (89, 124)),
    (120, (10, 31), (25, 56), (50, 83), (75, 114), (105, 145)),
    (140, (10, 38), (30, 68), (60, 100), (90, 135), (125, 175)),
    (160, (15, 44), (35, 80), (70, 120), (110, 161), (150, 210)),
)  # fmt: skip
"""The same of self-aligning ball bearings with a cylindrical bore."""
TABLES = {"balls": CLEARANCES, "rollers": ROLLER_CLEARANCES, "spherical": SPHERICAL, "self-aligning": SELF_ALIGNING}
"""Tables by the name that kinds of bearings have them by."""


def named_class(designation: str, suffixes: str, changes: dict[str, object]) -> str | None:
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


def mean_clearance(named: str | None, bore: float | None, table: str) -> dict[str, float]:
    """Return the mean clearance of a class, or of its upper or lower half, as a field; empty without one.

    Parameters
    ----------
    named : str, optional
        Class.
    bore : float, optional
        m.
    table : str
        One of `TABLES`.
    """
    if named is None or bore is None:
        return {}
    share = {"H": 0.75, "L": 0.25}.get(named[-1], 0.5)
    for top, *limits in TABLES[table]:
        if 1e3 * bore <= top + 1e-6:
            low, high = limits[TABULATED.index(named.rstrip("HL"))]
            return {"clearance": 1e-6 * (low + share * (high - low))}
    return {}
