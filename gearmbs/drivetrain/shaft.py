"""Shafts of a drivetrain: rigid or bending, of sections, with what stands on them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from gearmbs.drivetrain.members.shaft_body import cylinders_of, placed_model
from gearmbs.drivetrain.members.sources import ALL, axes_of, body_source
from gearmbs.drivetrain.part import DrivetrainError, Part, errors_named, require
from gearmbs.flexible import ElasticMaterial, FiniteElementModel, ModalModel, ShaftSection
from gearmbs.flexible.shaft import ELEMENTS
from gearmbs.schema.described import chosen
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

FROM_MODEL = (
    "radius", "diameter", "sections", "mass", "inertia", "density", "youngs_modulus", "poisson_ratio", "elements",
)  # fmt: skip
"""What a shaft with a model is not told."""

GAUSS = np.polynomial.legendre.leggauss(3)
"""Places and weights: exact to the fifth power, and moments of cones have the fourth."""

Length = Annotated[Quantity, Measure("length", above=0)]
Three = tuple[Quantity, Quantity, Quantity]


@dataclass(frozen=True, kw_only=True)
class Shaft(Part):
    """A shaft: a cylinder, sections, a finite-element model, or a rotor by its numbers; rigid unless it has modes.

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
        None: it is rigid. With a ``model``: how many beside the static ones, default 20, of a body with modes all.
    damping : float, sequence or bands
        Of its modes, see `gearmbs.flexible.damping_ratios`.
    youngs_modulus, poisson_ratio : float or str
        Pa; of steel if they are not given.
    elements : int
        Least number of its finite elements; parts and changes of section begin new ones anyway.
    model : FiniteElementModel, ModalModel or mapping, optional
        Instead of a cylinder or sections: of `gearmbs.flexible`, or a table with ``program``, ``files`` and keywords of
        its reader, as of a housing. Its parts are carried by the nodes at their stations: a wheel by those within its
        face, a rolling bearing by those within its bore and width, anything else by those within an eighth of the
        diameter there, or up to all of it where they are few.
    at : sequence of 3 floats, optional
        With a model: the origin of its nodes' frame in the shaft's, whose z is the axis from the left end, m;
        default: on the axis, the leftmost nodes at station 0.
    axes : sequence of 3 by 3 floats, optional
        Columns: the axes of the nodes' frame in that of the shaft; default: the same.
    seats : mapping of str, optional
        With a model, by part: diameter and width within which nodes carry it, m. Of a body with modes: name of the
        seat, or number of the node, else the one nearest to the station.
    faces : {"average", "rigid"}
        How nodes follow their seat, see `gearmbs.flexible.Interface`.
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
    model: Any = None
    at: Annotated[Three | None, Measure("length", several=3)] = None
    axes: Any = None
    seats: Mapping[str, Any] | None = None
    faces: str = "average"
    wheels: Mapping[str, Any] | None = None
    bearings: Mapping[str, Any] | None = None
    told: Any = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.model is not None:
            self._read_model()
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
        elif self.length is None and self.model is None:
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
        if fields.get("model") is not None:
            return {"length": None, "radius": None, "diameter": None, "sections": None, **fields}
        if fields.get("sections") is not None:
            return {"length": None, "radius": None, "diameter": None, **fields}
        room = {"sections": None} if fields.keys() & {"length", "radius", "diameter"} else {}
        for one, other in (("radius", "diameter"), ("diameter", "radius")):
            room |= {other: None} if one in fields else {}
        return {**room, **fields}

    def _read_model(self) -> None:
        usual = {one.name: one.default for one in fields(self)}
        for name in FROM_MODEL:
            require(getattr(self, name) == usual[name], f"{self.label}: {name} follows from model; leave it out")
        if isinstance(self.model, Mapping):
            # for a file
            object.__setattr__(self, "told", dict(self.model))
        object.__setattr__(self, "axes", axes_of(self.axes, self.label))
        chosen(("average", "rigid"), self.faces, f"{self.label}: ", DrivetrainError, "faces")
        with errors_named(f"{self.label}: model"):
            object.__setattr__(self, "model", body_source(self.model))
        require(
            self.faces == usual["faces"] or not isinstance(self.model, ModalModel),
            f"{self.label}: faces is {self.faces!r}, and its model a body with modes, whose seats know how they move; "
            "leave faces out",
        )
        with errors_named(self.label):
            low, high = (
                float(z) for z in (self.body_model.positions[:, 2].min(), self.body_model.positions[:, 2].max())
            )
        require(
            abs(low) <= 1e-3 * (high - low),
            f"{self.label}: nodes of its model reach from {1e3 * low:.6g} to {1e3 * high:.6g} mm along the axis, and "
            "stations are from its left end, 0; change at, or leave it out",
        )
        require(
            self.length is None or math.isclose(self.length, high, rel_tol=1e-6),
            f"{self.label}: length is {self.length} m, that of its model {high:g} m; leave length out",
        )
        object.__setattr__(self, "length", high)

    @property
    def bends(self) -> bool:
        """Whether it is a body with modes."""
        return self.modes is not None or self.model is not None

    @cached_property
    def body_model(self) -> FiniteElementModel | ModalModel:
        """Its finite elements, or its body with modes, in the frame of the shaft."""
        return placed_model(self)

    def _check_modes(self) -> None:
        for name in ("at", "axes"):
            told = getattr(self, name) is not None and self.model is None
            require(not told, f"{self.label}: {name} is given without model, whose nodes it places; leave it out")
        require(
            not (self.seats and self.model is None),
            f"{self.label}: seats is given without model, whose nodes they are; leave it out",
        )
        if not self.bends:
            return
        with errors_named(f"{self.label}: damping"):
            damping_of(self.damping)
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
        if self.model is not None:
            return cylinders_of(self.body_model.positions)
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
        if self.model is not None:
            model = self.body_model
            found = model.properties if isinstance(model, ModalModel) else model.mass_properties()
            x, y, polar = (float(value) for value in np.diag(found.inertia))
            return float(found.mass), float(found.com[2]), polar, 0.5 * (x + y)
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
