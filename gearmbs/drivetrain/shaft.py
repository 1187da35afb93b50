"""Shafts of a drivetrain: rigid or bending, of sections, with what stands on them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from gearmbs.drivetrain.part import Part, errors_named, require
from gearmbs.flexible import ElasticMaterial, ShaftSection
from gearmbs.flexible.shaft import ELEMENTS
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity, doubt_of_density
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.flexible.material import Damping

LONG = 30.0
"""Lengths of a shaft from here on, m, look like millimetres: no gearbox has such; a ship has several."""

DIAMETER = 0.030
"""Diameter of a shaft that gives none, m: the usual one of a gearbox of this size, as in the bench of Fig. 2."""

CONE_PIECES = 8
"""Cylinders that stand for a cone in views and where wheels must pass it: each is a sixteenth of its slope off."""

DAMPING: Damping = ((10e3, 0.01), (50e3, 0.1), (math.inf, 1.0))
"""Damping ratios of modes by bands of frequency, Hz: 1 % where teeth excite, as flexible bodies have where nothing is
said, and more for shapes that carry loads at seats, whose frequencies would hold the step of an integrator down."""

ALL = "all"
"""Number of modes with which nothing of the finite elements is lost."""

GAUSS = np.polynomial.legendre.leggauss(3)
"""Places and weights: exact to the fifth power, and moments of cones have the fourth."""

Length = Annotated[Quantity, Measure("length", above=0)]
Three = tuple[Quantity, Quantity, Quantity]


@dataclass(frozen=True, kw_only=True)
class Shaft(Part):
    """A shaft: a cylinder, sections one after the other, or a rotor given by its numbers; rigid unless it has modes.

    Stations are measured from its left end, along its axis.

    Parameters
    ----------
    length : float or str
        m.
    diameter : float or str, optional
        Of a solid cylinder, m; default 30 mm.
    radius : float or str, optional
        Instead of ``diameter``, m.
    sections : sequence, optional
        Instead: cylinders and cones from left to right, as tables ``{"length": ..., "diameter": ...}`` (or ``radius``;
        with ``bore``, and ``end_diameter`` and ``end_bore`` of cones), as `gearmbs.flexible.ShaftSection`, or as pairs
        (length, radius), m.
    density : float or str
        kg/m^3.
    mass, inertia : float or str, optional
        kg, and moment of inertia about the axis, kg m^2: take the place of the cylinder's. Of rigid shafts only.
    position : sequence of 3 floats, optional
        Left end in global components, m. Only one shaft of each connected group needs a place; those of the others
        follow from meshes, couplings and bearings, and where given they are checked.
    angle : float or str, optional
        At the start, about its axis, rad. Without it a shaft is turned by its mesh so that the drive flanks touch, or
        stands as the one that it is in line with; with it the wheel of that mesh is turned on it instead.
    modes : int or "all", optional
        The shaft bends, twists and stretches: so many of its shapes between the places of its parts, the slowest, are
        kept beside the static ones by loads there; see `gearmbs.flexible.reduce_model`. Its wheels are rigid discs.
        None: it is rigid.
    damping : float, sequence or bands
        Of its modes, see `gearmbs.flexible.damping_ratios`.
    youngs_modulus, poisson_ratio : float or str
        Pa; of steel if they are not given.
    elements : int
        Least number of its finite elements; parts and changes of section begin new ones anyway.
    wheels : mapping, optional
        What stands on it, by name: a pair of station and `gearmbs.gears.GearSpec`, or a table with the fields of
        `Wheel`. In a `Drivetrain` they are parts like others.
    bearings : mapping, optional
        Likewise a pair of station and designation of a rolling bearing, or a table with the fields of a bearing and its
        ``kind``, which is "rolling" if there is ``rolling``, else "ideal".

    Raises
    ------
    DrivetrainError
    """

    title: ClassVar[str] = "shaft"

    length: Length = None
    radius: Length = None
    sections: Any = None
    density: Annotated[Quantity, Measure("density", above=0)] = 7850.0
    mass: Annotated[Quantity, Measure("mass", above=0)] = None
    inertia: Annotated[Quantity, Measure("inertia", above=0)] = None
    position: Annotated[Three | None, Measure("length", several=3)] = None
    angle: Annotated[Quantity, Measure("angle")] = None
    diameter: Length = None
    modes: Any = None
    damping: Any = DAMPING
    youngs_modulus: Annotated[Quantity, Measure("pressure", above=0)] = 2.1e11
    poisson_ratio: Annotated[Quantity, Measure(low=0, below=0.5)] = 0.3
    elements: Annotated[int, Measure(low=1, whole=True, remedy="give a whole number from 1 up")] = ELEMENTS
    wheels: Mapping[str, Any] | None = None
    bearings: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            self.radius is None or self.diameter is None,
            f"{self.label}: radius is {self.radius} m and diameter {self.diameter} m; give one of them",
        )
        if self.sections is not None:
            for name in ("radius", "diameter"):
                require(getattr(self, name) is None, f"{self.label}: give {name} or sections, not both")
            require(len(self.sections) > 0, f"{self.label}: sections is empty; give lengths and diameters")
            cut = tuple(self._section(one) for one in self.sections)
            object.__setattr__(self, "sections", cut)
            whole = math.fsum(one.length for one in self.pieces)
            # a copy of a shaft with sections is told their length, too
            require(
                self.length is None or math.isclose(self.length, whole, rel_tol=1e-9),
                f"{self.label}: length is {self.length} m, its sections come to {whole:g} m; give length or sections",
            )
            object.__setattr__(self, "length", whole)
        elif self.length is None:
            object.__setattr__(self, "length", 0.2)
        doubt = doubt_of_density(self.density)
        largest = max(max(pair) for pair in self.cylinders)
        if largest >= LONG:
            doubt = f"a length or radius of {largest:g} m; are millimetres meant ('{largest:g} mm')?"
        if doubt:
            warn(f"{self.label}: {doubt}")
        self._check_modes()

    def changed_fields(self, fields: dict[str, Any]) -> dict[str, Any]:
        """Return fields to change with those that make room for them: new sections take the place of any length."""
        if fields.get("sections") is not None:
            return {"length": None, "radius": None, "diameter": None, **fields}
        room = {"sections": None} if fields.keys() & {"length", "radius", "diameter"} else {}
        for one, other in (("radius", "diameter"), ("diameter", "radius")):
            room |= {other: None} if one in fields else {}
        return {**room, **fields}

    def _check_modes(self) -> None:
        if self.modes is None:
            return
        counted = isinstance(self.modes, int) and not isinstance(self.modes, bool) and self.modes >= 1
        require(
            counted or self.modes == ALL,
            f"{self.label}: modes is {self.modes!r}; give a whole number from 1 up, or '{ALL}'; leave it out for a "
            "rigid shaft",
        )
        for name in ("mass", "inertia"):
            require(
                getattr(self, name) is None,
                f"{self.label}: {name} is {getattr(self, name)} beside modes: a shaft that bends has the mass of its "
                f"sections; leave {name} out, or modes",
            )
        with errors_named(f"{self.label}: damping"):
            damping_of(self.damping)

    def _section(self, given: Any) -> Any:
        """Return a section as length and radius, m, or as a `ShaftSection` if it has a bore or is a cone."""
        if isinstance(given, ShaftSection):
            is_solid = given.outer == given.outer_end and given.inner == given.inner_end == 0.0
            return (given.length, 0.5 * given.outer) if is_solid and given.material is None else given
        if isinstance(given, Mapping):
            return self._section_table(given)
        found = self.read("sections", given, Measure("length", several=2))
        require(min(found) > 0.0, self._wrong_section(found))
        return found

    def _wrong_section(self, given: Any) -> str:
        return (
            f"{self.label}: sections has {given}; give pairs of a positive length and radius, or tables of length and "
            "diameter"
        )

    def _section_table(self, given: Mapping[str, Any]) -> Any:
        known = {"length", "diameter", "bore", "end_diameter", "end_bore"}
        fits = {"length", "diameter"} <= set(given) <= known or set(given) == {"length", "radius"}
        require(fits, f"{self.label}: sections has {dict(given)}; give length and diameter, or length and radius")
        at = {key: self.read(f"sections.{key}", value, Measure("length")) for key, value in given.items()}
        length, outer = at["length"], at.get("diameter", 2.0 * at.get("radius", 0.0))
        require(min(length, outer) > 0.0, self._wrong_section(dict(given)))
        if set(given) <= {"length", "diameter", "radius"}:
            return length, at.get("radius", 0.5 * outer)
        with errors_named(f"{self.label}: sections"):
            return ShaftSection(length, outer, at.get("bore", 0.0), at.get("end_diameter"), at.get("end_bore"))

    @property
    def pieces(self) -> tuple[ShaftSection, ...]:
        """Sections from left to right."""
        if self.sections is None:
            radius = self.radius
            if radius is None:
                radius = DIAMETER / 2 if self.diameter is None else 0.5 * self.diameter
            return (ShaftSection(self.length, 2.0 * radius),)
        return tuple(s if isinstance(s, ShaftSection) else ShaftSection(s[0], 2.0 * s[1]) for s in self.sections)

    @property
    def cylinders(self) -> tuple[tuple[float, float], ...]:
        """Lengths and outer radii from left to right, m; a cone is some cylinders."""
        out: list[tuple[float, float]] = []
        for one in self.pieces:
            count = 1 if one.outer == one.outer_end else CONE_PIECES
            shares = (np.arange(count) + 0.5) / count
            out += [(one.length / count, 0.5 * float(one.outer + x * (one.outer_end - one.outer))) for x in shares]
        return tuple(out)

    @property
    def material(self) -> ElasticMaterial:
        """Material of sections that have none of their own."""
        return ElasticMaterial(self.youngs_modulus, self.poisson_ratio, self.density)

    def _discs(self) -> Iterator[tuple[float, float, float, float]]:
        """Yield place, inner and outer radius of sections (m) and the density there times its weight, kg/m^2."""
        start = 0.0
        for one in self.pieces:
            density = self.density if one.material is None else one.material.density
            for x, weight in zip(0.5 * (1.0 + GAUSS[0]), 0.5 * GAUSS[1]):
                inner, outer = (
                    0.5 * float(a + x * (b - a)) for a, b in ((one.inner, one.inner_end), (one.outer, one.outer_end))
                )
                yield start + float(x) * one.length, inner, outer, float(weight) * one.length * density
            start += one.length

    def body(self) -> tuple[float, float, float, float]:
        """Return mass (kg), place of the centre of mass along the axis (m), moments along and across the axis."""
        m, moment, polar, across = 0.0, 0.0, 0.0, 0.0
        for z, inner, outer, weight in self._discs():
            area, second = math.pi * (outer**2 - inner**2), 0.25 * math.pi * (outer**4 - inner**4)
            m += weight * area
            moment += weight * area * z
            polar += 2.0 * weight * second
            across += weight * (second + area * z**2)
        centre = moment / m
        across -= m * centre**2
        if self.mass is not None:
            polar, across, m = polar * self.mass / m, across * self.mass / m, self.mass
        if self.inertia is not None:
            # no body has less across than half of what it has along, and a rod adds to it
            across = max(across, 0.5 * self.inertia)
            polar = self.inertia
        return m, centre, polar, across


def damping_of(value: Any) -> Any:
    """Return damping ratios as they were given, checked; the last limit of bands in a file may be left out as "inf"."""
    from gearmbs.flexible import damping_ratios

    if not isinstance(value, str) and not np.isscalar(value):
        value = tuple(
            tuple(float(x) for x in one) if not np.isscalar(one) else float(one)  # type: ignore[arg-type]
            for one in value
        )
    damping_ratios(np.zeros(len(value) if isinstance(value, tuple) and np.isscalar(value[0]) else 1), value)
    return value
