"""Shafts by sections and diameters, with discs and seats, and their finite elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from gearmbs._display import Written
from gearmbs.flexible.beam import (
    DOFS,
    GAUSS_W,
    GAUSS_X,
    BeamSection,
    Slices,
    element_stiffness,
    geometric_stiffness,
    section_shapes,
)
from gearmbs.flexible.fe_model import FiniteElementModel
from gearmbs.flexible.interfaces import outline_of
from gearmbs.flexible.material import STEEL, ElasticMaterial, FlexibleError
from gearmbs.flexible.stress import ShaftStresses
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.schema.described import Described
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity

if TYPE_CHECKING:
    from gearmbs.flexible.modal_model import ModalModel

THINNEST = 1e-3
"""Excess of a polar moment over twice the diametral one that digits of a catalogue leave."""
ELEMENTS = 24
"""Least number of elements of a shaft unless told otherwise."""


MOST_SHEAR = 1e6
"""Shear coefficients are below one; great ones make a beam without shear of Euler and Bernoulli."""


def _is_count(value: Any) -> bool:
    return not isinstance(value, bool) and isinstance(value, int | np.integer) and bool(value >= 1)


Length = Annotated[Quantity, Measure("length", 0)]
# the longest shafts, of ships, have half of the length, the thickest drums half of the diameter, and the rotors of the
# largest generators are 19 m across: beyond, mm are meant
ShaftLength = Annotated[Quantity, Measure("length", above=0, below=200)]
ShaftDiameter = Annotated[Quantity, Measure("length", 0, below=10)]
DiscSize = Annotated[Quantity, Measure("length", 0, below=20)]
Inertia = Annotated[Quantity, Measure("inertia", 0)]


@dataclass(frozen=True)
class ShaftSection(Described):
    """A length of shaft, a cylinder or a cone.

    Parameters
    ----------
    length, outer : float or str
        Length and outer diameter, m.
    inner : float or str
        Diameter of the bore, m.
    outer_end, inner_end : float or str, optional
        Diameters at the end of a cone, m; default: as at its beginning.
    material : ElasticMaterial, optional
        Default: that of the shaft.
    """

    error: ClassVar[type[ValueError]] = FlexibleError

    length: ShaftLength
    outer: ShaftDiameter
    inner: ShaftDiameter = 0.0
    outer_end: ShaftDiameter = None
    inner_end: ShaftDiameter = None
    material: ElasticMaterial | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("outer", "inner"):
            if getattr(self, f"{name}_end") is None:
                object.__setattr__(self, f"{name}_end", getattr(self, name))
        for outer, inner in ((self.outer, self.inner), (self.outer_end, self.inner_end)):
            if not 0.0 <= inner < outer:
                raise FlexibleError(f"ShaftSection: bore {inner} m in {outer} m; give diameters 0 <= inner < outer")


@dataclass(frozen=True)
class Disc(Described):
    """A rigid disc on a shaft: a wheel, a coupling half, a rotor.

    Give ``outer`` and ``width``, or ``mass``, ``polar`` and ``diametral``.

    Parameters
    ----------
    at : float or str
        Position along the shaft, m.
    outer, width, inner : float or str, optional
        Diameters and width of a plain disc, m; ``inner`` is the shaft's diameter.
    mass, polar, diametral : float or str, optional
        kg, and moments of inertia about the axis and about a diameter through the disc's centre, kg m^2.
    material : ElasticMaterial, optional
    name : str
    """

    error: ClassVar[type[ValueError]] = FlexibleError

    at: Length
    outer: DiscSize = None
    width: DiscSize = None
    inner: DiscSize = 0.0
    mass: Annotated[Quantity, Measure("mass", 0)] = None
    polar: Inertia = None
    diametral: Inertia = None
    material: ElasticMaterial | None = None
    name: str = "disc"

    @property
    def place(self) -> str:
        """What messages put in front of a field's name."""
        return f"Disc '{self.name}': "

    def __post_init__(self) -> None:
        super().__post_init__()
        label = f"Disc '{self.name}'"
        by_size = self.outer is not None and self.width is not None
        by_mass = None not in (self.mass, self.polar, self.diametral)
        if by_size == by_mass:
            raise FlexibleError(f"{label}: give outer and width, or mass, polar and diametral")
        if by_size and not (self.inner < self.outer and self.width > 0.0):
            raise FlexibleError(
                f"{label}: a bore of {self.inner} m in {self.outer} m, {self.width} m wide; give diameters "
                "0 <= inner < outer and a positive width"
            )
        # each moment of a body is at most the sum of the others; a thin disc has just polar = 2 diametral
        if not by_size and self.polar > 2.0 * self.diametral * (1.0 + THINNEST):
            raise FlexibleError(
                f"{label}: polar = {self.polar:g} kg m^2 exceeds twice diametral = {self.diametral:g} kg m^2, which no "
                "body has; a thin disc has polar = 2 diametral"
            )
        if not by_size and self.mass == 0.0 and self.polar > 0.0:
            raise FlexibleError(f"{label}: it has moments of inertia and no mass; give its mass")

    def properties(self, material: ElasticMaterial) -> tuple[float, float, float]:
        """Return mass, polar and diametral moment of inertia."""
        if self.mass is not None:
            return self.mass, self.polar, self.diametral
        m = (self.material or material).density * np.pi / 4 * (self.outer**2 - self.inner**2) * self.width
        round_part = self.outer**2 + self.inner**2
        return m, m * round_part / 8, m * (3 * round_part + 4 * self.width**2) / 48

    def plain_size(self, material: ElasticMaterial) -> tuple[float, float]:
        """Return radius and width, m; of the plain disc with its moments if it was given by them."""
        if self.outer is not None and self.width is not None:
            return self.outer / 2, self.width
        mass, polar, diametral = self.properties(material)
        if not mass > 0.0:
            return 0.0, 0.0
        square = 2.0 * polar / mass
        return float(np.sqrt(square)), float(np.sqrt(max(12.0 * diametral / mass - 3.0 * square, 0.0)))


@dataclass(frozen=True)
class Shaft(Written):
    """A shaft along z, from z = 0 on, of sections, with discs on it and named seats.

    Parameters
    ----------
    sections : sequence of ShaftSection
        In their order along z.
    discs : sequence of Disc
        Wheels that belong to the body. A wheel that is a body of its own is joined to a seat instead.
    seats : dict of str to float or str
        Names of places along the shaft where bearings, wheels and couplings are; m.
    material : ElasticMaterial
    elements : int
        Least number of finite elements; sections, discs and seats begin new ones anyway.
    shear : float, optional
        Shear coefficient of all sections in place of Cowper's.
    name : str

    Raises
    ------
    FlexibleError
        For places off the shaft and impossible sizes.

    Examples
    --------
    >>> from gearmbs.flexible import Shaft, ShaftSection
    >>> shaft = Shaft([ShaftSection("200 mm", "30 mm")], seats={"left": 0, "wheel": "100 mm", "right": "200 mm"})
    >>> print(f"{shaft.length:g} m, {shaft.model().mass_properties().mass:.4f} kg")
    0.2 m, 1.1098 kg
    """

    other_words: ClassVar[dict[str, str]] = {
        "reduce": "modal_model(...), which keeps modes and seats",
        "modes": "modal_model(...)",
        "mass": "model().mass_properties().mass",
    }

    sections: Sequence[ShaftSection]
    discs: Sequence[Disc] = ()
    seats: dict[str, Quantity] = field(default_factory=dict)
    material: ElasticMaterial = STEEL
    elements: int = ELEMENTS
    shear: float | None = None
    name: str = "shaft"

    def __post_init__(self) -> None:
        label = f"shaft '{self.name}'"
        if not self.sections:
            raise FlexibleError(f"{label}: it has no sections")
        object.__setattr__(self, "sections", tuple(self.sections))
        object.__setattr__(self, "discs", tuple(self.discs))
        seats = {key: quantity(at, "length", f"{label}: seat '{key}'") for key, at in self.seats.items()}
        object.__setattr__(self, "seats", seats)
        places = {
            **{f"seat '{key}'": at for key, at in seats.items()},
            **{f"disc '{d.name}'": d.at for d in self.discs},
        }
        for what, at in places.items():
            if not -1e-9 * self.length <= at <= self.length * (1 + 1e-9):
                raise FlexibleError(f"{label}: {what} is at {at} m; the shaft reaches from 0 to {self.length:g} m")
        if not _is_count(self.elements):
            raise FlexibleError(f"{label}: elements = {self.elements!r}; give a whole number, one at least")
        shear = self.shear
        if shear is not None and not (0.0 < quantity(shear, "dimensionless", f"{label}: shear") <= MOST_SHEAR):
            raise FlexibleError(f"{label}: shear = {shear!r}; give a coefficient above 0 to {MOST_SHEAR:g}")

    @property
    def length(self) -> float:
        """Length, m."""
        return float(sum(s.length for s in self.sections))

    def stations(self) -> np.ndarray:
        """Return where the nodes are, m: at changes of section, at discs and seats, and between them."""
        ends = np.concatenate([[0.0], np.cumsum([s.length for s in self.sections])])
        fixed = np.concatenate([ends, list(self.seats.values()), [d.at for d in self.discs]])
        fixed = np.unique(np.round(np.clip(fixed, 0.0, self.length) / self.length, 9)) * self.length
        step = self.length / self.elements * (1 + 1e-9)
        parts = [np.linspace(a, b, max(1, int(np.ceil((b - a) / step))) + 1)[:-1] for a, b in pairwise(fixed)]
        return np.concatenate([*parts, [self.length]])

    def element_section(self, a: float, b: float) -> BeamSection:
        """Return the section of the element between two stations; a cone has the one at its middle."""
        section, start = self._section_around(0.5 * (a + b))
        outer, inner = _diameters(section, 0.5 * (a + b) - start)
        return BeamSection.ring(section.material or self.material, outer, inner, self.shear)

    def section_motion(self, at: float, what: str = "section") -> tuple[slice, np.ndarray, np.ndarray]:
        """Return which degrees of freedom move the section at a place, and how, by the element's own functions.

        Parameters
        ----------
        at : float
            m.
        what : str
            What is there, for messages.

        Returns
        -------
        places : slice
            Twelve of the degrees of freedom of `model`.
        moved, turned : ndarray, shape (3, 12)
            Displacement of its middle, and rotation.

        Raises
        ------
        FlexibleError
            Off the shaft.
        """
        if not -1e-9 * self.length <= at <= self.length * (1 + 1e-9):
            raise FlexibleError(
                f"shaft '{self.name}': {what} at {at} m is off the shaft, which reaches from 0 to {self.length:g} m"
            )
        z = self.stations()
        k = int(np.clip(np.searchsorted(z, at) - 1, 0, z.size - 2))
        length = z[k + 1] - z[k]
        x = np.clip((at - z[k]) / length, 0.0, 1.0)
        moved, turned = section_shapes(x, length, self.element_section(z[k], z[k + 1]))
        return slice(DOFS * k, DOFS * (k + 2)), moved[0], turned[0]

    def outline(self) -> np.ndarray:
        """Return the outline with the discs, rows of z and radius, m; steps have two rows at one place."""
        ends = np.concatenate([[0.0], np.cumsum([s.length for s in self.sections])])
        pieces = [(a, b, s.outer / 2, s.outer_end / 2) for (a, b), s in zip(pairwise(ends), self.sections)]
        for disc in self.discs:
            radius, width = disc.plain_size(self.material)
            if radius > 0.0 and width > 0.0:
                pieces.append((disc.at - width / 2, disc.at + width / 2, radius, radius))
        return outline_of(pieces)

    def _stresses(self, stations: np.ndarray) -> ShaftStresses:
        sizes = []
        for a, b in pairwise(stations):
            section, start = self._section_around(0.5 * (a + b))
            sizes.append((_diameters(section, a - start), _diameters(section, b - start)))
        return ShaftStresses(stations, [self.element_section(a, b) for a, b in pairwise(stations)], sizes)

    def _section_around(self, z: float) -> tuple[ShaftSection, float]:
        """Return the section that a place is in, and where it begins, m."""
        starts = np.concatenate([[0.0], np.cumsum([s.length for s in self.sections])])
        k = int(np.clip(np.searchsorted(starts, z, side="right") - 1, 0, len(self.sections) - 1))
        return self.sections[k], float(starts[k])

    def model(self) -> FiniteElementModel:
        """Return the finite-element model: consistent Timoshenko elements with axial motion and torsion."""
        z = self.stations()
        size = DOFS * z.size
        stiffness = np.zeros((size, size))
        rows: list[tuple[Any, ...]] = []
        for k, (a, b) in enumerate(pairwise(z)):
            section, length = self.element_section(a, b), b - a
            places = slice(DOFS * k, DOFS * (k + 2))
            stiffness[places, places] += element_stiffness(length, section)
            moved, turned = section_shapes(GAUSS_X, length, section)
            for g, (x, w) in enumerate(zip(GAUSS_X, GAUSS_W)):
                inertia = w * length * np.diag(section.inertia)
                rows.append((w * length * section.mass, a + x * length, inertia, places, moved[g], turned[g]))
        one = np.eye(DOFS)
        for disc in self.discs:
            mass, polar, diametral = disc.properties(self.material)
            k = int(np.argmin(np.abs(z - disc.at)))
            places = slice(DOFS * k, DOFS * (k + 1))
            rows.append((mass, z[k], np.diag([diametral, diametral, polar]), places, one[:3], one[3:]))
        slices = _slices(rows, size)
        positions = np.column_stack([np.zeros((z.size, 2)), z])
        dofs = np.column_stack([np.repeat(np.arange(z.size), DOFS), np.tile(np.arange(DOFS), z.size)])
        seats = {key: int(np.argmin(np.abs(z - at))) for key, at in self.seats.items()}
        return FiniteElementModel(
            np.arange(1, z.size + 1), positions, dofs, stiffness, slices.mass_matrix(), self.name, seats, slices,
            outline=self.outline(), recovery=self._stresses(z),
        )  # fmt: skip

    def spin_stiffness(self, about: str | Quantity) -> np.ndarray:
        """Return the geometric stiffness by a spin of 1 rad/s across the shaft, about an axis through a place of it.

        What is farther out pulls with its centrifugal force, which stiffens the shaft against bending: at a place p
        beyond the axis at c the tension is the integral of the mass over (z - c) from p to the end, with all discs
        there. At the axis it jumps, so that an element around it is integrated in two parts.

        Parameters
        ----------
        about : str or float
            Seat, or position along the shaft, m, that the spin's axis goes through.
        """
        centre = self.seats[about] if about in self.seats else quantity(about, "length", f"shaft '{self.name}': spin")
        z = self.stations()
        sections = [self.element_section(a, b) for a, b in pairwise(z)]
        masses = np.array([section.mass for section in sections])
        pulls = np.diff((z - centre) ** 2) / 2 * masses
        places_of_discs = np.array([z[np.argmin(np.abs(z - disc.at))] for disc in self.discs])
        pulls_of_discs = np.array([d.properties(self.material)[0] for d in self.discs]) * (places_of_discs - centre)
        out = np.zeros((DOFS * z.size,) * 2)
        for k, ((a, b), section) in enumerate(zip(pairwise(z), sections)):
            parts = [(a, centre), (centre, b)] if a < centre < b else [(a, b)]
            at = np.concatenate([p + GAUSS_X * (q - p) for p, q in parts])
            weights = np.concatenate([GAUSS_W * (q - p) / (b - a) for p, q in parts])
            beyond = at > centre
            ends = np.where(beyond, (b - centre) ** 2, -((a - centre) ** 2))
            within = masses[k] / 2 * (ends - np.where(beyond, 1.0, -1.0) * (at - centre) ** 2)
            outside = np.where(beyond, pulls[k + 1 :].sum(), pulls[:k].sum())
            discs = np.where(
                beyond, pulls_of_discs[places_of_discs >= b].sum(), pulls_of_discs[places_of_discs <= a].sum()
            )
            tension = np.abs(within + outside + discs)
            places = slice(DOFS * k, DOFS * (k + 2))
            out[places, places] += geometric_stiffness(b - a, section, (at - a) / (b - a), weights * tension)
        return out

    def modal_model(
        self,
        modes: int | None = None,
        *,
        max_frequency: Quantity = None,
        seats: Sequence[str] | None = None,
        spin: str | Quantity | None = None,
    ) -> ModalModel:
        """Return the shaft as a modal body: Craig-Bampton with its seats as interface, orthonormalised.

        Parameters
        ----------
        modes : int, optional
            How many shapes with held seats, the slowest, are kept beside the static ones; default 20, or all below
            ``max_frequency``. See :func:`reduce_model`.
        max_frequency : float or str, optional
            Shapes with held seats above are left out, Hz.
        seats : sequence of str, optional
            Which seats are interfaces; default: all.
        spin : str or float, optional
            Seat or place (m) on the axis of a spin across the shaft, as of a rotor blade or a crank: adds
            `spin_stiffness`.
        """
        from gearmbs.flexible.reduction import reduce_model

        return reduce_model(
            self.model(),
            self.seats if seats is None else seats,
            modes=modes,
            max_frequency=max_frequency,
            spin_stiffness=None if spin is None else self.spin_stiffness(spin),
        )


def _diameters(section: ShaftSection, way: float) -> tuple[float, float]:
    """Return outer and inner diameter of a section so far from its beginning, m."""
    x = way / section.length
    return section.outer + x * (section.outer_end - section.outer), section.inner + x * (
        section.inner_end - section.inner
    )


def _slices(rows: list[tuple[Any, ...]], size: int) -> Slices:
    """Return slices from (mass, z, inertia, places, moved, turned)."""
    count = len(rows)
    moved, turned = np.zeros((count, 3, size)), np.zeros((count, 3, size))
    for k, row in enumerate(rows):
        moved[k, :, row[3]], turned[k, :, row[3]] = row[4], row[5]
    position = np.column_stack([np.zeros((count, 2)), [row[1] for row in rows]])
    return Slices(np.array([row[0] for row in rows]), position, np.array([row[2] for row in rows]), moved, turned)
