"""A rolling bearing: the numbers a drawing or a catalogue gives, checked, and what follows: ratings and life, too.

Ball bearings, with g = d cos(a)/D, lengths in mm and f the groove radii by the ball diameter,

    C = 1.3 f_c (i cos(a))^0.7 Z^(2/3) d^1.8    (d^1.4 3.647 above 25.4 mm),
    f_c = 39.9 lambda g^0.3 (1 - g)^1.39/(1 + g)^(1/3) (2 f_i/(2 f_i - 1))^0.41 (1 + u^(10/3))^(-3/10),
    u = 1.04 ((1 - g)/(1 + g))^1.72 (f_i (2 f_o - 1)/(f_o (2 f_i - 1)))^0.41;

roller bearings C = 1.1 f_c (i L cos(a))^(7/9) Z^(3/4) d^(29/27) with

    f_c = 207.9 lambda g^(2/9) (1 - g)^(29/27)/(1 + g)^(1/4) (1 + u^(9/2))^(-2/9),
    u = 1.04 ((1 - g)/(1 + g))^(143/108).

1.1 is 1.15 of spherical roller bearings. i counts rows; makers count the two paths of four-point bearings as two. The
standard fixes f_i = f_o = 0.52, of self-aligning ball bearings f_i = 0.53 and the sphere, f_o = (1/g + 1)/2, and the
reduction factors lambda, whatever the grooves are. Static: of balls the load at which the most loaded one,
5 F/(i Z cos a), presses its groove with 4200 MPa, or the sphere with 4600 MPa; of rollers 44 (1 - g) i Z L d cos(a).

References
----------
.. [1] ISO 281:2007, Rolling bearings: dynamic load ratings and rating life. ISO/TR 1281-1:2008 derives the factors.
.. [2] ISO 76:2006, Rolling bearings: static load ratings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from numbers import Real
from typing import Annotated, Any, ClassVar, TypedDict, Unpack

import numpy as np

from gearmbs.bearings.catalogue import look_up
from gearmbs.bearings.kinds import KINDS, LOOSEST, BearingError, require
from gearmbs.bearings.laws_kernel import (
    BALL_EXPONENT,
    ROLLER_EXPONENT,
    STEEL,
    PointContact,
    groove_contact,
    in_series,
    line_contact,
)
from gearmbs.schema.described import Described, check_keys
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity, QuantityLike, doubt_of_material, to_si
from gearmbs.wording import warn

Length = Annotated[Quantity, Measure("length", above=0)]
Boundary = Annotated[Quantity, Measure("length", above=0, below=10)]
Force = Annotated[Quantity, Measure("force", above=0)]
GROOVE = Measure(above=0.5, below=1, remedy="a groove is wider than its ball: give 0.505 to 0.6")
ELEMENT_SIZE = Measure("length", above=0, below=1)
TOUCHING = 1e-9
"""Rounding of the diameters of bearings without a ring, whose needles run on the shaft or in the housing."""


class BearingFields(TypedDict, total=False):
    """Fields of a `Bearing` but for its designation, as they are given, for type checkers."""

    elements: int
    element_diameter: QuantityLike
    pitch_diameter: QuantityLike
    contact_angle: QuantityLike
    kind: str
    inner_curvature: QuantityLike
    outer_curvature: QuantityLike
    clearance: QuantityLike
    roller_length: QuantityLike | None
    row_distance: QuantityLike | None
    bore: QuantityLike | None
    outside_diameter: QuantityLike | None
    width: QuantityLike | None
    dynamic_rating: QuantityLike | None
    static_rating: QuantityLike | None
    youngs_modulus: QuantityLike
    poisson_ratio: QuantityLike
    density: QuantityLike
    rating_source: str
    estimated: Sequence[str]


class ChangedFields(BearingFields, total=False):
    """All fields of a `Bearing`, as they are given."""

    designation: str


@dataclass(frozen=True, kw_only=True)
class Bearing(Described):
    """A rolling bearing.

    Parameters
    ----------
    kind : str
        One of `gearmbs.bearings.kinds.KINDS`.
    elements : int
        Rolling elements in one row, Z.
    element_diameter, pitch_diameter : float or str
        d and D, m. Of tapered rollers the mean diameter.
    contact_angle : float or str
        Nominal contact angle a, rad; of four-point bearings the angle of each of the two lines of contact.
    inner_curvature, outer_curvature : float
        Groove radius by ball diameter, f_i and f_o.
    clearance : float or str
        Diametral (catalogue) radial internal clearance, m; negative is interference. Each ring has half of it.
    roller_length : float or str, optional
        Effective length of rollers, m; needed for rollers.
    row_distance : float or str, optional
        Of the middles of two rows, m; needed of kinds with two that do not meet in the middle.
    bore, outside_diameter, width : float or str, optional
        Boundary dimensions, m.
    dynamic_rating, static_rating : float or str, optional
        C and C_0 from a catalogue, N; default: by the formulas of ISO 281 and ISO 76, see `gearmbs.bearings.bearing`.
    youngs_modulus, poisson_ratio, density
        Of elements and rings, Pa and kg/m^3.
    designation : str
    rating_source : str
        Maker whose catalogue the ratings are of, where they follow from the designation; others differ.
    estimated : tuple of str
        Names of the fields that are what is usual, and not this bearing's own; see `gearmbs.bearings.estimate`.

    Raises
    ------
    BearingError
        When the numbers do not make a bearing; the message names the field, its value and a remedy.

    Examples
    --------
    >>> bearing = Bearing(elements=9, element_diameter="7.94 mm", pitch_diameter="39.04 mm")
    >>> round(bearing.bpfo, 4), round(bearing.bpfi, 4), round(bearing.bsf, 4), round(bearing.ftf, 4)
    (3.5848, 5.4152, 2.3567, 0.3983)
    """

    error: ClassVar[type[ValueError]] = BearingError

    elements: Annotated[int, Measure(low=3, whole=True)]
    element_diameter: Annotated[Quantity, ELEMENT_SIZE]
    pitch_diameter: Annotated[Quantity, Measure("length")]
    contact_angle: Annotated[Quantity, Measure("angle", low=0, below=90, shown="deg")] = 0.0
    kind: str = "deep groove"
    inner_curvature: Annotated[Quantity, GROOVE] = 0.515
    outer_curvature: Annotated[Quantity, GROOVE] = 0.525
    clearance: Annotated[Quantity, Measure("length")] = 0.0
    roller_length: Length = None
    row_distance: Length = None
    bore: Boundary = None
    outside_diameter: Boundary = None
    width: Boundary = None
    dynamic_rating: Force = None
    static_rating: Force = None
    youngs_modulus: Annotated[Quantity, Measure("pressure", above=0)] = STEEL[0]
    poisson_ratio: Annotated[Quantity, Measure(low=0, below=0.5)] = STEEL[1]
    density: Annotated[Quantity, Measure("density", above=0)] = 7800.0
    designation: str = ""
    rating_source: str = ""
    estimated: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check()
        doubt = doubt_of_material(self.youngs_modulus, self.density)
        if doubt:
            warn(f"Bearing: {doubt}")

    def _check(self) -> None:
        z, d, pitch = self.elements, self.element_diameter, self.pitch_diameter
        require(self.kind in KINDS, f"Bearing.kind is {self.kind!r}; choose {', '.join(KINDS)}")
        require(
            d < pitch < 10.0,
            f"Bearing.pitch_diameter is {pitch:g} m, the elements measure {d:g} m; give the diameter of their centres",
        )
        room = pitch * math.sin(math.pi / z)
        require(
            d < room,
            f"Bearing.elements is {z}: that many of {1e3 * d:.4g} mm do not fit on a pitch diameter of "
            f"{1e3 * pitch:.4g} mm, where {math.floor(math.pi / math.asin(d / pitch))} do",
        )
        angle = self.contact_angle
        within, beyond = (pitch + side * d * math.cos(angle) for side in (-1.0, 1.0))
        require(
            self.bore is None or self.bore <= within * (1.0 + TOUCHING),
            f"Bearing.bore is {1e3 * (self.bore or 0.0):.4g} mm, and the elements run on {1e3 * within:.4g} mm; a bore "
            "is smaller than its inner race",
        )
        require(
            self.outside_diameter is None or self.outside_diameter >= beyond * (1.0 - TOUCHING),
            f"Bearing.outside_diameter is {1e3 * (self.outside_diameter or 0.0):.4g} mm, and the elements run in "
            f"{1e3 * beyond:.4g} mm; an outer ring is larger than its race",
        )
        require(abs(self.clearance) < LOOSEST * d, f"Bearing.clearance is {self.clearance:g} m; give it in '... um'")
        if self.rollers:
            require(
                self.roller_length is not None,
                f"Bearing.roller_length is missing; a {self.kind} bearing needs the effective length of its rollers",
            )
        if KINDS[self.kind].angle == "needed":
            require(
                angle > 0.0, f"Bearing.contact_angle is 0; a bearing of kind '{self.kind}' needs one, such as '25 deg'"
            )
        if KINDS[self.kind].angle == "none":
            require(angle == 0.0, f"Bearing.contact_angle is {angle:g} rad; of {self.kind}s it is 0")
        if KINDS[self.kind].rows in ("parallel", "back to back"):
            require(
                self.row_distance is not None,
                f"Bearing.row_distance is missing; a {self.kind} bearing needs the distance of the middles of its rows",
            )
        for name, given, usual in (
            ("dynamic_rating", self.dynamic_rating, dynamic_rating),
            ("static_rating", self.static_rating, static_rating),
        ):
            if given is not None:
                own = usual(self)
                require(
                    own / OFF_RATING <= given <= own * OFF_RATING,
                    f"Bearing.{name} is {given:g} N, and elements like these carry about {own:.3g} N; a plain number "
                    f"is in N, write '{given:g} kN' if that is meant",
                )

    @classmethod
    def from_designation(cls, designation: str, *, estimate: bool = False, **changes: Unpack[BearingFields]) -> Bearing:
        """Return a bearing by its designation, such as "6205" or "NU206"; see `gearmbs.bearings.catalogue`.

        Parameters
        ----------
        designation : str
            Suffixes are understood, "6205-2RS/C3" and "6205ZZC3"; a class of clearance, CN or C2 to C5, sets the
            clearance to the middle of its range (C3H and C3L: of its upper and lower half), without one it is 0.
            Those known that say nothing of it: seals and shields (2RS, 2Z, ZZ, LLU, DDU, ...), cages (TVH, TN9, M,
            J, ...), snap rings (N, NR), precision (P4 to P6), grease and heat treatment.
            Fields may stand behind it, with commas:
            "6305, elements=7, element_diameter=13.49 mm".
        estimate : bool
            Whether number and size of elements that makers do not publish are taken as is usual, see
            `gearmbs.bearings.estimate`; the field ``estimated`` then names them. C and C_0 are those of a maker's
            catalogue where they are tabulated.
        **changes
            Fields that differ, or that the catalogue does not know.

        Raises
        ------
        BearingError
            If the designation is unknown or its elements are not certain; the message asks for what is missing. For
            a class of clearance that is not the standard's.

        Warns
        -----
        UserWarning
            Of suffixes that are not known, and of what is estimated.
        """

        def rating(own: dict[str, Any]) -> float:
            return dynamic_rating(cls(**{**own, "dynamic_rating": None}))

        names = [item.name for item in fields(cls)]
        found = look_up(designation, {**changes}, names, rating if estimate else None)
        rollers = found.get("kind") in KINDS and KINDS[found["kind"]].rollers
        if rollers and found.get("roller_length") is None and {"designation", "dynamic_rating"} <= found.keys():
            return roller_length_for(cls(**{**found, "roller_length": found["element_diameter"]}))
        return cls(**found)

    def changed(self, **changes: Unpack[ChangedFields]) -> Bearing:
        """Return the bearing with other values of some fields."""
        check_keys(changes, [item.name for item in fields(self)], "Bearing", BearingError)
        given: dict[str, Any] = {**changes}
        return replace(self, **given)

    @property
    def rollers(self) -> bool:
        """Whether the elements are rollers."""
        return KINDS[self.kind].rollers

    @property
    def rows(self) -> int:
        """Number of rows of elements, which are in phase."""
        return 1 if KINDS[self.kind].rows == "one" else 2

    @property
    def offset(self) -> float:
        """Distance of each row's middle from the bearing's, m: D/2 tan(a) where the lines of contact meet there."""
        if KINDS[self.kind].rows == "self-aligning":
            return 0.5 * self.pitch_diameter * math.tan(self.contact_angle)
        return 0.0 if self.rows == 1 or self.row_distance is None else 0.5 * self.row_distance

    @property
    def on_sphere(self) -> bool:
        """Whether balls roll on the sphere of a self-aligning outer ring."""
        return KINDS[self.kind].rows == "self-aligning" and not self.rollers

    @property
    def fixed_normals(self) -> bool:
        """Whether contacts press in directions that no displacement turns: of rollers, and on a sphere."""
        return self.rollers or self.on_sphere

    @property
    def ratio(self) -> float:
        """gamma = d cos(a)/D."""
        return self.element_diameter * math.cos(self.contact_angle) / self.pitch_diameter

    @property
    def ftf(self) -> float:
        """Cage turns per turn of the inner ring, outer ring at rest: (1 - gamma)/2."""
        return 0.5 * (1.0 - self.ratio)

    @property
    def bpfo(self) -> float:
        """Elements that pass a point of the outer ring per turn of the inner ring: Z (1 - gamma)/2."""
        return self.elements * self.ftf

    @property
    def bpfi(self) -> float:
        """Elements that pass a point of the inner ring per turn: Z (1 + gamma)/2."""
        return self.elements - self.bpfo

    @property
    def bsf(self) -> float:
        """Turns of an element about its own axis per turn of the inner ring: D/(2 d) (1 - gamma^2)."""
        return 0.5 * self.pitch_diameter / self.element_diameter * (1.0 - self.ratio**2)

    @property
    def multiples(self) -> dict[str, float]:
        """The four kinematic frequencies by turns of the inner ring, by name; see `ftf` and the others."""
        return {"FTF": self.ftf, "BSF": self.bsf, "BPFO": self.bpfo, "BPFI": self.bpfi}

    def frequencies(self, speed: Quantity) -> dict[str, float]:
        """Return the kinematic frequencies in Hz at a speed of the inner ring, rad/s or text such as "1000 rpm"."""
        turns = to_si(speed, "angular speed", "speed") / math.tau
        return {name: value * turns for name, value in self.multiples.items()}

    @property
    def exponent(self) -> float:
        """n of Q = K delta^n."""
        return ROLLER_EXPONENT if self.rollers else BALL_EXPONENT

    @cached_property
    def inner_contact(self) -> PointContact:
        """Contact of a ball with the inner ring."""
        return self._groove(self.inner_curvature, self.ratio / (1.0 - self.ratio))

    @cached_property
    def outer_contact(self) -> PointContact:
        """Contact of a ball with the outer ring."""
        curvature = sphere_curvature(self.ratio) if self.on_sphere else self.outer_curvature
        return self._groove(curvature, -self.ratio / (1.0 + self.ratio))

    def _groove(self, curvature: float, slope: float) -> PointContact:
        require(not self.rollers, f"a {self.kind} bearing has no point contacts")
        return groove_contact(self.element_diameter, curvature, slope, self.youngs_modulus, self.poisson_ratio)

    @cached_property
    def contact_stiffness(self) -> tuple[float, float]:
        """K of one contact with the inner and with the outer ring, N/m^n."""
        if self.rollers:
            one = line_contact(self.roller_length, self.youngs_modulus, self.poisson_ratio)
            return one, one
        return self.inner_contact.stiffness, self.outer_contact.stiffness

    @property
    def stiffness(self) -> float:
        """K of both contacts of an element in series, N/m^n."""
        return in_series(*self.contact_stiffness, self.exponent)

    @property
    def groove_distance(self) -> float:
        """A_0 = (f_i + f_o - 1) d, distance of the groove centres when a ball just touches both."""
        return (self.inner_curvature + self.outer_curvature - 1.0) * self.element_diameter

    @property
    def element_mass(self) -> float:
        """Mass of one element, kg."""
        d = self.element_diameter
        volume = math.pi * d**3 / 6.0 if not self.rollers else 0.25 * math.pi * d**2 * self.roller_length
        return float(self.density * volume)

    @property
    def rating(self) -> float:
        """Basic dynamic load rating C, N: the catalogue's, or by ISO 281."""
        return self.dynamic_rating if self.dynamic_rating is not None else dynamic_rating(self)

    @property
    def rating_at_rest(self) -> float:
        """Basic static load rating C_0, N: the catalogue's, or by ISO 76."""
        return self.static_rating if self.static_rating is not None else static_rating(self)

    def _repr_html_(self) -> str:
        rows = {
            "kind": self.kind, "elements": f"{self.elements}", "d": f"{1e3 * self.element_diameter:.4g} mm",
            "D": f"{1e3 * self.pitch_diameter:.4g} mm", "contact angle": f"{math.degrees(self.contact_angle):.4g} deg",
            **({"estimated": ", ".join(self.estimated)} if self.estimated else {}),
            **{name: f"{value:.4f}" for name, value in self.multiples.items()},
            "C": f"{1e-3 * self.rating:.3g} kN", "C0": f"{1e-3 * self.rating_at_rest:.3g} kN",
            **({"C and C0 of": self.rating_source} if self.rating_source else {}),
        }  # fmt: skip
        cells = "".join(f"<tr><th>{key}</th><td>{value}</td></tr>" for key, value in rows.items())
        return f"<table><caption>{self.designation or 'bearing'}</caption>{cells}</table>"


OFF_RATING = 20.0
"""Rating of a catalogue by that of the standard's formula, or the reverse, that no steel and no second row explains."""
STANDARD_GROOVE = 0.52
"""Radius of the inner ring's groove, in ball diameters, that ISO 281 and ISO 76 state their ratings for."""
PRESSURE = 4.2e9
"""Contact pressure of the static rating of ball bearings, Pa (ISO 76)."""
SPHERE_GROOVE = 0.53
"""The same radius of self-aligning ball bearings, and their pressure, Pa; their outer ring is a sphere."""
SPHERE_PRESSURE = 4.6e9  # ISO 76, of self-aligning ball bearings


def sphere_curvature(ratio: float) -> float:
    """Return the radius of a self-aligning outer ring by the ball's diameter: (1/g + 1)/2, g = d cos(a)/D."""
    return 0.5 * (1.0 / ratio + 1.0)


def dynamic_rating(bearing: Bearing) -> float:
    """Return the basic dynamic radial load rating C by ISO 281, N."""
    g, z, cosine = bearing.ratio, bearing.elements, math.cos(bearing.contact_angle)
    d, factor, i = 1e3 * bearing.element_diameter, KINDS[bearing.kind].reduction, KINDS[bearing.kind].rated_rows
    if bearing.rollers:
        u = 1.04 * ((1 - g) / (1 + g)) ** (143 / 108)
        f_c = 207.9 * factor * g ** (2 / 9) * (1 - g) ** (29 / 27) / (1 + g) ** 0.25 * (1 + u**4.5) ** (-2 / 9)
        return (
            1.1
            * KINDS[bearing.kind].steel
            * f_c
            * (i * 1e3 * bearing.roller_length * cosine) ** (7 / 9)
            * z**0.75
            * d ** (29 / 27)
        )
    f = SPHERE_GROOVE if bearing.on_sphere else STANDARD_GROOVE
    f_o = sphere_curvature(g) if bearing.on_sphere else f
    u = 1.04 * ((1 - g) / (1 + g)) ** 1.72 * (f * (2 * f_o - 1) / (f_o * (2 * f - 1))) ** 0.41
    f_c = 39.9 * factor * g**0.3 * (1 - g) ** 1.39 / (1 + g) ** (1 / 3) * (2 * f / (2 * f - 1)) ** 0.41
    f_c *= (1 + u ** (10 / 3)) ** -0.3
    size = d**1.8 if d <= 25.4 else 3.647 * d**1.4
    return 1.3 * f_c * (i * cosine) ** 0.7 * z ** (2 / 3) * size


def roller_length_for(bearing: Bearing) -> Bearing:
    """Return a roller bearing with the effective length that gives its ``dynamic_rating`` by ISO 281.

    The rating grows with the length to the 7/9, so the length follows from it, from number and diameter.
    """
    require(bearing.rollers, f"a {bearing.kind} bearing has no rollers whose length could follow from its rating")
    require(bearing.dynamic_rating is not None, "Bearing.dynamic_rating is missing; give the maker's")
    length = bearing.roller_length * (bearing.dynamic_rating / dynamic_rating(bearing)) ** (9.0 / 7.0)
    return bearing.changed(roller_length=length)


def static_rating(bearing: Bearing) -> float:
    """Return the basic static radial load rating C_0 by ISO 76, N."""
    g, z, cosine = bearing.ratio, KINDS[bearing.kind].rated_rows * bearing.elements, math.cos(bearing.contact_angle)
    if bearing.rollers:
        return 44.0 * (1 - g) * z * 1e6 * bearing.roller_length * bearing.element_diameter * cosine
    if bearing.on_sphere:
        sphere = groove_contact(bearing.element_diameter, sphere_curvature(g), -g / (1 + g))
        return sphere.force_at(SPHERE_PRESSURE) * z * cosine / 5.0
    contact = groove_contact(bearing.element_diameter, STANDARD_GROOVE, g / (1 - g))
    return contact.force_at(PRESSURE) * z * cosine / 5.0


def load_factors(bearing: Bearing, radial: float, axial: float) -> tuple[float, float]:
    """Return X and Y of P = X F_r + Y F_a by ISO 281; below F_a = e F_r X is 1, and Y is 0 of single rows.

    Raises
    ------
    BearingError
        For cylindrical rollers under axial load, and contact angles outside the standard's table.
    """
    radial, axial = abs(radial), abs(axial)
    e, x, y, *below = KINDS[bearing.kind].load_factors(bearing, radial, axial)
    return (1.0, below[0] if below else 0.0) if axial <= e * radial else (x, y)


ROUNDS = 8
"""Passes over axial loads that e of small contact angles depends on: it goes with their power 0.2, so to 1e-5."""


def induced_thrust(bearing: Bearing, radial: float, axial: float = 0.0) -> float:
    """Return the axial load that a radial one induces in a bearing that carries one way, N.

    F_r/(2 Y) of tapered rollers, e F_r of balls, as makers' catalogues have it; zero of other kinds.

    Parameters
    ----------
    radial, axial : float
        N; of contact angles below 20 degrees e depends on the axial load.
    """
    if KINDS[bearing.kind].thrust != "one way":
        return 0.0
    e, _, y, *_ = KINDS[bearing.kind].load_factors(bearing, abs(radial), abs(axial))
    return abs(radial) / (2.0 * y) if bearing.rollers else e * abs(radial)


def paired_thrust(first: Bearing, second: Bearing, radial: tuple[float, float], outer: float) -> tuple[float, float]:
    """Return the axial loads of two bearings that hold a shaft one way each, N.

    Each carries at least the thrust S that its own radial load induces, and the other one's with what pushes the shaft
    towards it: F_a1 = max(S_1, S_2 + K), F_a2 = max(S_2, S_1 - K). Only so are both in contact over half of their
    elements, which the factors of the equivalent load presuppose.

    Parameters
    ----------
    first, second : Bearing
    radial : tuple of float
        Radial load of each, N.
    outer : float
        Axial load K on the shaft towards the side that the first one carries, N.
    """
    found = (0.0, 0.0)
    for _ in range(ROUNDS):
        one, two = induced_thrust(first, radial[0], found[0]), induced_thrust(second, radial[1], found[1])
        found = (max(one, two + outer), max(two, one - outer))
    return found


def _newtons(load: Quantity, name: str) -> Quantity:
    """Return a load as a number if it is a text with a unit, and as it is if not."""
    try:
        return to_si(load, "force", name) if isinstance(load, str) else load
    except ValueError as error:
        raise BearingError(str(error)) from None


def equivalent_load(bearing: Bearing, radial: Quantity, axial: Quantity = 0.0) -> float:
    """Return the dynamic equivalent radial load P = max(F_r, X F_r + Y F_a), N; signs of the loads do not count.

    Raises
    ------
    BearingError
        For loads that are not finite, and as `load_factors`.
    """
    radial, axial = _newtons(radial, "radial"), _newtons(axial, "axial")
    for name, value in (("radial", radial), ("axial", axial)):
        require(math.isfinite(value), f"{name} is {float(value)!r} N; give a finite load")
    radial, axial = abs(radial), abs(axial)
    x, y = load_factors(bearing, radial, axial)
    return max(radial, x * radial + y * axial)


def rating_life(bearing: Bearing, load: Quantity, *, reliability: float = 0.9, life_factor: float = 1.0) -> float:
    """Return the life in revolutions, L_na = a_1 a_ISO (C/P)^p 10^6, p = 3 for balls and 10/3 for rollers.

    Parameters
    ----------
    load : float or str
        Equivalent load P, N.
    reliability : float
        Share of bearings that reach it, 0.9 to 0.9995; a_1 is the standard's from 95 % up.
    life_factor : float
        a_ISO, for lubrication and cleanliness.

    Raises
    ------
    BearingError
        For a load or life factor that is not positive and finite, and another reliability.
    """
    load = _newtons(load, "load")
    require(0.0 < load < math.inf, f"load is {load!r} N; give a positive equivalent load")
    require(
        0.0 < life_factor < math.inf, f"life_factor is {life_factor!r}; give a positive a_ISO, 1 if it is not known"
    )
    shares = (0.9, 0.95, 0.96, 0.97, 0.98, 0.99, 0.992, 0.994, 0.996, 0.998, 0.999, 0.9992, 0.9994, 0.9995)
    factors = (1.0, 0.64, 0.55, 0.47, 0.37, 0.25, 0.22, 0.19, 0.16, 0.12, 0.093, 0.087, 0.080, 0.077)
    told = isinstance(reliability, Real) and not isinstance(reliability, bool)
    require(told and shares[0] <= reliability <= shares[-1], f"reliability is {reliability!r}; give 0.9 up to 0.9995")
    a_1 = float(np.interp(reliability, shares, factors))
    return a_1 * life_factor * 1e6 * (bearing.rating / load) ** life_exponent(bearing)


def life_exponent(bearing: Bearing) -> float:
    """Return p: 3 for balls, 10/3 for rollers."""
    return 10.0 / 3.0 if bearing.rollers else 3.0


def mean_load(bearing: Bearing, radial: np.ndarray, axial: np.ndarray | None = None, speed: np.ndarray | None = None):
    """Return the constant load with the same life as loads over time, N.

    Parameters
    ----------
    radial, axial : ndarray, shape (m,)
        Loads at even instants, as a simulation gives them, N.
    speed : ndarray, shape (m,), optional
        Relative speed of the rings there; default constant.

    Raises
    ------
    BearingError
        For other lengths, none at all, values that are not finite, and speeds that are all zero.
    """
    radial = np.asarray(radial, dtype=float)
    axial = np.zeros_like(radial) if axial is None else np.asarray(axial, dtype=float)
    turns = np.ones_like(radial) if speed is None else np.abs(np.asarray(speed, dtype=float))
    for name, value in (("radial", radial), ("axial", axial), ("speed", turns)):
        require(
            value.ndim == 1 and value.shape == radial.shape and value.size > 0,
            f"{name} has the shape {value.shape} beside radial of {radial.shape}; give as many of each, from one up",
        )
        require(bool(np.isfinite(value).all()), f"{name} has values that are not finite; leave these instants out")
    require(bool(turns.any()), "speed is 0 throughout: a bearing at rest has no life in revolutions; see static_rating")
    p = life_exponent(bearing)
    loads = np.array([equivalent_load(bearing, r, a) for r, a in zip(radial, axial)])
    return float((np.sum(turns * loads**p) / np.sum(turns)) ** (1.0 / p))
