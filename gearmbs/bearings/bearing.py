"""A rolling bearing: the numbers that a drawing or a catalogue gives, checked, and the geometry that follows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar, TypedDict, Unpack

from gearmbs.bearings.designations.catalogue import look_up
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
from gearmbs.bearings.rating import OFF_RATING, dynamic_rating, roller_length_for, sphere_curvature, static_rating
from gearmbs.schema.described import Described, check_keys
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity, QuantityLike, doubt_of_material, to_si
from gearmbs.wording import warn

Length = Annotated[Quantity, Measure("length", above=0)]
Boundary = Annotated[Quantity, Measure("length", above=0, below=10)]
Force = Annotated[Quantity, Measure("force", above=0)]
GROOVE = Measure(above=0.5, below=1, remedy="a groove is wider than its ball: give 0.505 to 0.6")
ELEMENT_SIZE = Measure("length", above=0, below=1)
RIGHT = 1e-9
"""Distance from a right angle, rad, that is rounding."""
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
        C and C_0 from a catalogue, N; default: by the formulas of ISO 281 and ISO 76, see `gearmbs.bearings.rating`.
    youngs_modulus, poisson_ratio, density
        Of elements and rings, Pa and kg/m^3.
    designation : str
    rating_source : str
        Maker whose catalogue the ratings are of, where they follow from the designation; others differ.
    estimated : tuple of str
        Names of the fields that are what is usual, and not this bearing's own; see
        `gearmbs.bearings.designations.estimate`.

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
    contact_angle: Annotated[Quantity, Measure("angle", low=0, high=90, shown="deg")] = 0.0
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
        right = abs(angle - 0.5 * math.pi) <= RIGHT
        require(
            right if KINDS[self.kind].axial else not right,
            f"Bearing.contact_angle is {math.degrees(angle):.4g} deg; of {self.kind} bearings it is "
            f"{'90 deg' if KINDS[self.kind].axial else 'less than 90 deg'}",
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
        """Return a bearing by its designation, such as "6205"; see `gearmbs.bearings.designations.catalogue`.

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
            `gearmbs.bearings.designations.estimate`; the field ``estimated`` then names them. C and C_0 are those of
            a maker's catalogue where they are tabulated.
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
