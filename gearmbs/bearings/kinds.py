"""The table of kinds of rolling bearings: one row each, with all by which kinds differ; and the error of bearings.

Checks, contacts, ratings, equivalent loads, designations and messages follow from it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from gearmbs.bearings.designations.boundary import size_of


class BearingError(ValueError):
    """A bearing cannot be what is meant: a field, a name or a value is wrong; the message says what would do."""


Loads = float | np.ndarray
"""One load or some, N."""
Factors = tuple[Loads, ...]
"""e, X and Y of loads, each one number for all or one for each."""


def require(condition: bool, message: str) -> None:
    """Raise BearingError with the message unless the condition holds."""
    if not condition:
        raise BearingError(message)


LOOSEST = 0.2
"""Clearance, of the diameter of an element, that is no longer one: a number was given in another unit."""

# Bearings are those of `bearing`, which knows this table.
Bearing = Any


@dataclass(frozen=True)
class Usual:
    """What elements usually are in bearings of a kind; see `gearmbs.bearings.designations.estimate`.

    Attributes
    ----------
    size : float
        Diameter of an element over D - d.
    fill : float
        Share of the circle of the centres that the elements take.
    length : float
        Effective length of rollers over the width; zero of balls.
    angle : float
        Contact angle where the designation tells none and no maker prints its e, rad.
    apart : float
        Distance of two rows over the width.
    """

    size: float
    fill: float
    length: float = 0.0
    angle: float = 0.0
    apart: float = 0.0


@dataclass(frozen=True)
class Known:
    """What a designation fixes.

    Attributes
    ----------
    fields : dict
        Fields of the bearing.
    asked : tuple of str
        Those to be counted or measured.
    rated : str
        Series of the ratings in `gearmbs.bearings.designations.boundary`, if it is another than that of dimensions.
    usual : Usual, optional
        Elements as they usually are, if others than those of the kind.
    raceway : float, optional
        Diameter of the inner raceway, m, from which size and place of the elements then follow.
    """

    fields: dict[str, Any]
    asked: tuple[str, ...]
    rated: str = ""
    usual: Usual | None = None
    raceway: float | None = None


@dataclass(frozen=True, kw_only=True)
class Kind:
    """One kind of bearings.

    Parameters
    ----------
    rollers : bool
        Whether the elements are rollers, in line contact; else balls in grooves.
    angle : {"free", "needed", "none"}
        Whether a bearing may, must or cannot have a contact angle.
    rows : {"one", "parallel", "back to back", "self-aligning"}
        How the rows of elements stand: "parallel" two press radially, "back to back" their lines of contact part
        towards the axis, "self-aligning" they meet in the bearing's middle. Elements of two rows are in phase.
    both_ways : bool
        Balls touch each groove at two points, one for each sense of the axial load.
    one_shoulder : bool
        Grooves have one shoulder, across which an axial load against the bearing's sense would be carried.
    axial : bool
        Whether it carries axial loads alone: C and C_0 are then C_a and C_0a, and the contact angle is 90 degrees.
    preloaded : bool
        Whether a preload is set by moving a ring along the axis; else by a negative clearance.
    reduction : float
        Factor of the dynamic rating by ISO 281.
    steel : float
        b_m of ISO 281 by 1.3 for balls and by 1.1 for rollers.
    rated_rows : int
        Rows i that ratings count: makers count the two paths of a four-point bearing so.
    load_factors : callable
        ``load_factors(bearing, radial, axial)`` returns e, X and Y of ISO 281, and Y below e where that is not zero, of
        one pair of loads or of as many as there are.
    designation : re.Pattern, optional
        Beginning of designations: its letters and digits of the series, code of the bore.
    series : dict
        Series by these, as of `gearmbs.bearings.designations.boundary`.
    known : callable, optional
        ``known(found, boundary)`` returns what such a designation fixes.
    usual : Usual
        Elements where makers do not publish them: means of bearings whose elements are known, of cylindrical ones of
        standardised raceways; cages of the other kinds leave as much room as these shares say.
    unclassed : str
        Why a class of radial clearance says nothing of such bearings; empty if it does.
    classes : str
        Table of the classes of radial clearance, see `gearmbs.bearings.designations.classes`.
    tapers : bool
        Whether a K among the suffixes is a tapered bore, whose classes have limits of their own.
    """

    rollers: bool = False
    angle: Literal["free", "needed", "none"]
    rows: Literal["one", "parallel", "back to back", "self-aligning"] = "one"
    both_ways: bool = False
    one_shoulder: bool = False
    axial: bool = False
    preloaded: bool = False
    reduction: float
    steel: float = 1.0
    rated_rows: int = 1
    load_factors: Callable[[Bearing, Loads, Loads], Factors]
    designation: re.Pattern[str] | None = None
    series: dict[str, str] = field(default_factory=dict)
    tapers: bool = False
    known: Callable[[re.Match[str], dict[str, Any]], Known] | None = None
    unclassed: str = ""
    classes: str = "balls"
    usual: Usual

    @property
    def thrust(self) -> Literal["both ways", "one way", "none"]:
        """How it carries axial loads: one way if moving a ring along the axis preloads it; rollers need an angle."""
        if self.preloaded:
            return "one way"
        return "none" if self.rollers and self.angle == "none" else "both ways"


# Factors of the equivalent load by ISO 281.


DEEP_GROOVE = (
    (0.172, 0.19, 2.30), (0.345, 0.22, 1.99), (0.689, 0.26, 1.71), (1.03, 0.28, 1.55), (1.38, 0.30, 1.45),
    (2.07, 0.34, 1.31), (3.45, 0.38, 1.15), (5.17, 0.42, 1.04), (6.89, 0.44, 1.00),
)  # fmt: skip
"""f_0 F_a/C_0, e, Y of single-row deep groove bearings; X = 0.56."""
# By contact angle in degrees, at the same nine levels of F_a/(i Z d^2): e, X, Y. f_0 F_a/C_0 of the standard's table
# are these levels over cos(a), as C_0 = f_0 i Z d^2 cos(a). Single rows up to 5 degrees are those of deep groove
# bearings. At F_a = e F_r X + e Y is 1, but for rounding, which tables of makers have alike.
_LEVELS = tuple(level for level, _, _ in DEEP_GROOVE)
_RADIAL = tuple((e, 0.56, y) for _, e, y in DEEP_GROOVE)
_TEN = tuple(zip((0.29, 0.32, 0.36, 0.38, 0.40, 0.44, 0.49, 0.54, 0.54), (0.46,) * 9,
                 (1.88, 1.71, 1.52, 1.41, 1.34, 1.23, 1.10, 1.01, 1.00)))  # fmt: skip
_FIFTEEN = tuple(zip((0.38, 0.40, 0.43, 0.46, 0.47, 0.50, 0.55, 0.56, 0.56), (0.44,) * 9,
                     (1.47, 1.40, 1.30, 1.23, 1.19, 1.12, 1.02, 1.00, 1.00)))  # fmt: skip
ANGULAR: dict[float, tuple[tuple[float, ...], ...]] = {
    0.0: _RADIAL, 5.0: _RADIAL, 10.0: _TEN, 15.0: _FIFTEEN, 20.0: ((0.57, 0.43, 1.00),) * 9,
    25.0: ((0.68, 0.41, 0.87),) * 9, 30.0: ((0.80, 0.39, 0.76),) * 9, 35.0: ((0.95, 0.37, 0.66),) * 9,
    40.0: ((1.14, 0.35, 0.57),) * 9, 45.0: ((1.34, 0.33, 0.50),) * 9,
}  # fmt: skip
"""e, X, Y of single rows by contact angle in degrees and level."""

_BELOW_FIVE = (2.78, 2.40, 2.07, 1.87, 1.75, 1.58, 1.39, 1.26, 1.21)
_BELOW_TEN = (2.18, 1.98, 1.76, 1.63, 1.55, 1.42, 1.27, 1.17, 1.16)
_BELOW_FIFTEEN = (1.65, 1.57, 1.46, 1.38, 1.34, 1.26, 1.14, 1.12, 1.12)
DOUBLE_ANGULAR: dict[float, tuple[tuple[float, ...], ...]] = {
    5.0: tuple(zip((0.23, 0.26, 0.30, 0.34, 0.36, 0.40, 0.45, 0.50, 0.52), (0.78,) * 9,
                   (3.74, 3.23, 2.78, 2.52, 2.36, 2.13, 1.87, 1.69, 1.63), _BELOW_FIVE)),
    10.0: tuple(zip((e for e, _, _ in _TEN), (0.75,) * 9,
                    (3.06, 2.78, 2.47, 2.29, 2.18, 2.00, 1.79, 1.64, 1.63), _BELOW_TEN)),
    15.0: tuple(zip((e for e, _, _ in _FIFTEEN), (0.72,) * 9,
                    (2.39, 2.28, 2.11, 2.00, 1.93, 1.82, 1.66, 1.63, 1.63), _BELOW_FIFTEEN)),
    20.0: ((0.57, 0.70, 1.63, 1.09),) * 9, 25.0: ((0.68, 0.67, 1.41, 0.92),) * 9,
    30.0: ((0.80, 0.63, 1.24, 0.78),) * 9, 35.0: ((0.95, 0.60, 1.07, 0.66),) * 9,
    40.0: ((1.14, 0.57, 0.93, 0.55),) * 9, 45.0: ((1.34, 0.54, 0.81, 0.47),) * 9,
}  # fmt: skip
"""e, X, Y above it, Y below it of double row angular contact bearings, and of four-point bearings, whose ratings count
two rows, by contact angle in degrees and level."""


def _refuse_first(refused: Any, radial: Loads, axial: Loads, message: str, kind: str) -> None:
    """Raise BearingError with the first of some loads that a bearing does not carry."""
    found = np.flatnonzero(refused)
    if found.size:
        across, along = (float(np.atleast_1d(load)[found[0]]) for load in (radial, axial))
        raise BearingError(message.format(radial=across, axial=along, kind=kind))


def _by_angle(bearing: Bearing, axial: Loads, table: dict[float, tuple[tuple[float, ...], ...]]) -> Factors:
    """Return the row of a table for a bearing's contact angle and axial loads, between its rows on straight lines."""
    degrees, angles = math.degrees(bearing.contact_angle), list(table)
    require(
        angles[0] <= degrees <= angles[-1],
        f"Bearing.contact_angle is {degrees:.4g} deg; the standard's factors of the equivalent load are for "
        f"{angles[0]:g} to {angles[-1]:g} deg; give the angle of the catalogue",
    )
    count = KINDS[bearing.kind].rated_rows * bearing.elements
    level = axial / (count * (1e3 * bearing.element_diameter) ** 2)
    k = min(int(np.searchsorted(angles, degrees, side="right")) - 1, len(angles) - 2)
    share = (degrees - angles[k]) / (angles[k + 1] - angles[k])
    ends = [[np.interp(level, _LEVELS, column) for column in zip(*table[angles[j]])] for j in (k, k + 1)]
    return tuple((1.0 - share) * low + share * high for low, high in zip(*ends))


def _single_row_factors(bearing: Bearing, radial: Loads, axial: Loads) -> Factors:
    return _by_angle(bearing, axial, ANGULAR)


def _double_angular_factors(bearing: Bearing, radial: Loads, axial: Loads) -> Factors:
    return _by_angle(bearing, axial, DOUBLE_ANGULAR)


def _self_aligning_factors(bearing: Bearing, radial: Loads, axial: Loads) -> Factors:
    slope = math.tan(bearing.contact_angle)
    return 1.5 * slope, 0.65, 0.65 / slope, 0.42 / slope


def _spherical_factors(bearing: Bearing, radial: Loads, axial: Loads) -> Factors:
    slope = math.tan(bearing.contact_angle)
    return 1.5 * slope, 0.67, 0.67 / slope, 0.45 / slope


TILTED = math.radians(4.0 / 60.0)
"""Axial load by the radial one that is a tilt of the axis along which it is measured: the 4 minutes that makers let
cylindrical roller bearings lean."""


def _cylindrical_factors(bearing: Bearing, radial: Loads, axial: Loads) -> Factors:
    _refuse_first(
        axial > TILTED * np.maximum(radial, 1.0), radial, axial,
        "F_a is {axial:.4g} N beside F_r of {radial:.4g} N, and a {kind} bearing carries no axial load: let another "
        "bearing locate the shaft, with axial stiffness 0 here, or take a kind that does", bearing.kind,
    )  # fmt: skip
    return math.inf, 1.0, 0.0


def _tapered_factors(bearing: Bearing, radial: Loads, axial: Loads) -> Factors:
    return 1.5 * math.tan(bearing.contact_angle), 0.4, 0.4 / math.tan(bearing.contact_angle)


LEANING = 0.05
"""Force across a thrust bearing by the axial one up to which it is what its grooves hold, whose contacts then lean by 3
degrees: their loads are 0.1 % larger, and the life is that of the axial load."""


def _thrust_factors(bearing: Bearing, radial: Loads, axial: Loads) -> Factors:
    _refuse_first(
        radial > LEANING * np.maximum(axial, 1.0), radial, axial,
        "F_r is {radial:.4g} N beside F_a of {axial:.4g} N, and a {kind} bearing carries no radial load: let another "
        "bearing hold the shaft across its axis", bearing.kind,
    )  # fmt: skip
    return 0.0, 0.0, 1.0


# What a designation fixes of cylindrical and tapered roller, angular contact and four-point bearings.
#
# Boundary dimensions are those of the dimension series (ISO 15, ISO 355). Of cylindrical roller bearings the raceways F
# on the inner ring (types NU, NJ, NUP) and E on the outer ring (type N) are standardised, too, since their rings are
# interchangeable (DIN 5412-1): so the rollers' diameter is (E - F)/2 and their pitch diameter (E + F)/2. Of tapered
# roller bearings the contact angle is (ISO 355), of the others it is part of the designation. Number and length of
# rollers, number and diameter of balls are the maker's.


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
"""Contact angle of four-point contact bearings QJ, degrees."""


def _middle(boundary: dict[str, Any]) -> float:
    return 0.5 * (boundary["bore"] + boundary["outside_diameter"])


def _cylindrical(found: re.Match[str], boundary: dict[str, Any]) -> Known:
    # the wider series have the rings of the narrower ones
    raceways = RACEWAYS.get(found[1][-1], {}).get(round(1e3 * boundary["bore"]))
    full = None if found[1].startswith("N") and not found[1].startswith("NCF") else FULL
    if raceways is None or full:
        fields = {**boundary, "pitch_diameter": _middle(boundary)}
        return Known(fields, ("elements", "element_diameter", "roller_length"), usual=full)
    inner, outer = (1e-3 * value for value in raceways)
    own = {"element_diameter": 0.5 * (outer - inner), "pitch_diameter": 0.5 * (outer + inner)}
    return Known({**boundary, **own}, ("elements", "roller_length"))


def _needle(found: re.Match[str], boundary: dict[str, Any]) -> Known:
    letters = found[1].rstrip("0123456789")
    asked = ("elements", "element_diameter", "roller_length")
    if letters == "K":
        # cages are named by both raceways
        inner, outer = boundary["bore"], boundary["outside_diameter"]
        own = {"element_diameter": 0.5 * (outer - inner), "pitch_diameter": 0.5 * (outer + inner)}
        return Known({**boundary, **own}, ("elements", "roller_length"))
    size = size_of(found[1], found[2])
    raceway = boundary["bore"] if size is None else size.raceway
    return Known(dict(boundary), (*asked, "pitch_diameter"), usual=DRAWN if letters == "HK" else None, raceway=raceway)


def _tapered(found: re.Match[str], boundary: dict[str, Any]) -> Known:
    fields = {**boundary, "pitch_diameter": _middle(boundary)}
    asked: tuple[str, ...] = ("elements", "element_diameter", "roller_length")
    narrow = found[1][0] == "0"
    taper = TAPERS.get(found[1][1], {}).get(round(1e3 * boundary["bore"])) if narrow else None
    if taper is None:
        return Known(fields, (*asked, "contact_angle"))
    width, degrees, minutes, seconds = taper
    angle = math.radians(degrees + minutes / 60.0 + seconds / 3600.0)
    return Known({**fields, "width": 1e-3 * width, "contact_angle": angle}, asked)


def _angular(found: re.Match[str], boundary: dict[str, Any]) -> Known:
    fields = {**boundary, "pitch_diameter": _middle(boundary), "contact_angle": math.radians(ANGLES[found[3]])}
    return Known(fields, ("elements", "element_diameter"), f"7{found[1]}{found[3]}")


def _four_point(found: re.Match[str], boundary: dict[str, Any]) -> Known:
    fields = {**boundary, "pitch_diameter": _middle(boundary), "contact_angle": math.radians(FOUR_POINTS)}
    return Known(fields, ("elements", "element_diameter"))


TWO_ROW_ANGLES = {"": 30.0, "A": 30.0, "B": 25.0, "BD": 30.0, "D": 45.0, "DA": 45.0, "DNR": 40.0, "E": 30.0}
"""Contact angle of double row angular contact bearings by the letters behind the digits, degrees; with a split inner
ring, D, it is larger."""


def _double_angular(found: re.Match[str], boundary: dict[str, Any]) -> Known:
    angle = math.radians(TWO_ROW_ANGLES[found[3] or ""])
    fields = {**boundary, "pitch_diameter": _middle(boundary), "contact_angle": angle}
    return Known(fields, ("elements", "element_diameter", "row_distance"))


def _double(found: re.Match[str], boundary: dict[str, Any]) -> Known:
    fields = {**boundary, "pitch_diameter": _middle(boundary)}
    return Known(fields, ("elements", "element_diameter", "row_distance"))


def _double_cylindrical(found: re.Match[str], boundary: dict[str, Any]) -> Known:
    known = _double(found, boundary)
    return replace(known, asked=("elements", "element_diameter", "roller_length", "row_distance"))


def _self_aligning(found: re.Match[str], boundary: dict[str, Any]) -> Known:
    fields = {**boundary, "pitch_diameter": _middle(boundary)}
    return Known(fields, ("elements", "element_diameter", "contact_angle"))


def _spherical(found: re.Match[str], boundary: dict[str, Any]) -> Known:
    fields = {**boundary, "pitch_diameter": _middle(boundary)}
    return Known(fields, ("elements", "element_diameter", "roller_length", "contact_angle"))


def _thrust(found: re.Match[str], boundary: dict[str, Any]) -> Known:
    fields = {**boundary, "pitch_diameter": _middle(boundary), "contact_angle": 0.5 * math.pi}
    rollers = ("roller_length",) if found[1].startswith("8") else ()
    return Known(fields, ("elements", "element_diameter", *rollers))


FULL = Usual(size=0.270, fill=0.97, length=0.60)
"""Cylindrical rollers without a cage, NCF and SL18."""
DRAWN = Usual(size=0.355, fill=0.75, length=0.75)
"""Needle rollers in a drawn cup, HK: its wall is some 1 mm, and the rest of (D - F)/2 the roller's."""


SET_WHEN_MOUNTED = "their clearance is set when they are mounted"

KINDS: dict[str, Kind] = {
    "deep groove": Kind(
        angle="free", reduction=0.95, load_factors=_single_row_factors, usual=Usual(size=0.300, fill=0.595)
    ),
    "angular contact": Kind(
        angle="needed",
        one_shoulder=True,
        preloaded=True,
        reduction=0.95,
        load_factors=_single_row_factors,
        usual=Usual(size=0.300, fill=0.82),
        designation=re.compile(r"^7([023])(\d\d)\s*-?\s*(AC|[ABC])(?:EC?[ABC]?)?(?:G[ABC]?)?(?:JP|[DFJMPY])?(?![A-Z])"),
        series={"0": "70", "2": "72", "3": "73"},
        known=_angular,
        unclassed=SET_WHEN_MOUNTED,
    ),
    "four point": Kind(
        angle="needed",
        both_ways=True,
        reduction=0.95,
        rated_rows=2,
        load_factors=_double_angular_factors,
        usual=Usual(size=0.300, fill=0.80),
        designation=re.compile(r"^QJ\s*([23])(\d\d)(?!\d)"),
        series={"2": "QJ2", "3": "QJ3"},
        known=_four_point,
        unclassed="it is one of axial clearance",
    ),
    "cylindrical roller": Kind(
        tapers=True,
        rollers=True,
        angle="none",
        reduction=0.83,
        load_factors=_cylindrical_factors,
        usual=Usual(size=0.270, fill=0.80, length=0.60),
        designation=re.compile(r"^((?:NU|NJ|NUP|N)(?:10|22|23|[234])|(?:NCF|SL18)(?:22|29|30))(\d\d)(?!\d)"),
        series={
            f"{letters}{digits}": f"{table}{digits}"
            for letters, table in (
                ("NU", "NU"),
                ("NJ", "NU"),
                ("NUP", "NU"),
                ("N", "NU"),
                ("NCF", "NCF"),
                ("SL18", "NCF"),
            )
            for digits in ("10", "2", "3", "4", "22", "23", "29", "30")
        },
        known=_cylindrical,
        classes="rollers",
    ),
    "needle roller": Kind(
        rollers=True,
        angle="none",
        reduction=0.83,
        load_factors=_cylindrical_factors,
        usual=Usual(size=0.220, fill=0.75, length=0.70),
        designation=re.compile(r"^(R?NA(?:49|69)|NKI|HK|K)(\d+(?:/\d+|X\d+X\d+)?)"),
        series={letters: letters for letters in ("NA49", "NA69", "RNA49", "RNA69", "NKI", "HK", "K")},
        known=_needle,
        classes="rollers",
    ),
    "tapered roller": Kind(
        rollers=True,
        angle="needed",
        preloaded=True,
        reduction=0.83,
        load_factors=_tapered_factors,
        usual=Usual(size=0.235, fill=0.90, length=0.62, angle=math.radians(15.5)),
        designation=re.compile(r"^3(20|02|03|13|22|23|29|30|31|32)(\d\d)(?!\d)"),
        series={digits: f"3{digits}" for digits in ("20", "02", "03", "13", "22", "23", "29", "30", "31", "32")},
        known=_tapered,
        unclassed=SET_WHEN_MOUNTED,
    ),
    "double row deep groove": Kind(
        angle="none",
        rows="parallel",
        reduction=0.90,
        rated_rows=2,
        load_factors=_single_row_factors,
        usual=Usual(size=0.250, fill=0.78, apart=0.5),
        designation=re.compile(r"^(4[23])(\d\d)(?!\d)"),
        series={"42": "42", "43": "43"},
        known=_double,
    ),
    "double row angular contact": Kind(
        angle="needed",
        rows="back to back",
        reduction=0.95,
        rated_rows=2,
        load_factors=_double_angular_factors,
        usual=Usual(size=0.250, fill=0.80, apart=0.5),
        designation=re.compile(r"^(3[23])(\d\d)(?!\d)\s*-?\s*(BD|DA|DNR|[ABDE])?"),
        series={"32": "32", "33": "33"},
        known=_double_angular,
        unclassed="it is one of axial clearance",
    ),
    "self-aligning ball": Kind(
        tapers=True,
        angle="needed",
        rows="self-aligning",
        reduction=1.0,
        rated_rows=2,
        load_factors=_self_aligning_factors,
        usual=Usual(size=0.250, fill=0.80, angle=math.radians(10.0)),
        designation=re.compile(r"^(1[23]|2[23])(\d\d)(?!\d)"),
        series={"12": "12", "13": "13", "22": "22", "23": "23"},
        known=_self_aligning,
        classes="self-aligning",
    ),
    "double row cylindrical roller": Kind(
        tapers=True,
        rollers=True,
        angle="none",
        rows="parallel",
        reduction=0.83,
        rated_rows=2,
        load_factors=_cylindrical_factors,
        usual=Usual(size=0.230, fill=0.85, length=0.30, apart=0.45),
        designation=re.compile(r"^(NNU?(?:30|49))(\d\d)(?!\d)"),
        series={"NN30": "NN30", "NNU49": "NNU49"},
        known=_double_cylindrical,
        classes="rollers",
    ),
    "spherical roller": Kind(
        tapers=True,
        rollers=True,
        angle="needed",
        rows="self-aligning",
        reduction=0.83,
        steel=1.15 / 1.1,
        rated_rows=2,
        load_factors=_spherical_factors,
        usual=Usual(size=0.265, fill=0.82, length=0.36, angle=math.radians(10.0)),
        designation=re.compile(r"^(2(?:13|22|23|30|31|32|39|40|41))(\d\d)(?!\d)"),
        series={digits: digits for digits in ("213", "222", "223", "230", "231", "232", "239", "240", "241")},
        known=_spherical,
        classes="spherical",
    ),
    "thrust ball": Kind(
        angle="needed",
        axial=True,
        one_shoulder=True,
        preloaded=True,
        reduction=1.0,
        load_factors=_thrust_factors,
        usual=Usual(size=0.370, fill=0.84),
        designation=re.compile(r"^(51[1-4])(\d\d)(?!\d)"),
        series={digits: digits for digits in ("511", "512", "513", "514")},
        known=_thrust,
        unclassed="it has none",
    ),
    "thrust cylindrical roller": Kind(
        rollers=True,
        angle="needed",
        axial=True,
        preloaded=True,
        reduction=1.0,
        load_factors=_thrust_factors,
        usual=Usual(size=0.300, fill=0.75, length=0.45),
        designation=re.compile(r"^(81[12])(\d\d)(?!\d)"),
        series={"811": "811", "812": "812"},
        known=_thrust,
        unclassed="it has none",
    ),
}


def known_of(designation: str, boundary: dict[str, float]) -> Known | None:
    """Return what a designation fixes, its kind first; None if it begins as that of no kind.

    Parameters
    ----------
    designation : str
        In capitals, without a maker's name.
    boundary : dict
        Bore, outside diameter and width by its dimension series, m; empty if there is none.
    """
    for name, kind in KINDS.items():
        found = kind.designation.match(designation) if kind.designation is not None and boundary else None
        if found is not None and kind.known is not None:
            known = kind.known(found, boundary)
            return replace(known, fields={"kind": name, **known.fields})
    return None
