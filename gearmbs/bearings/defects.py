"""Defects of rolling bearings: what is missing, or too much, on rings and elements.

Every defect says where it is, how large, and what it is called; several are combined by giving several. Random ones
draw from their own seed.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from gearmbs.bearings.kinds import BearingError, require
from gearmbs.bearings.layout import angles, drop, node_count, rounded
from gearmbs.schema.described import Described, chosen, make, measures_of
from gearmbs.schema.quantities import Measure, OneOf
from gearmbs.units import Quantity

if TYPE_CHECKING:
    from gearmbs.bearings.bearing import Bearing

OUTER, INNER, ELEMENT = "outer", "inner", "element"
PARTS = (OUTER, INNER, ELEMENT)
SMALL = 0.05
"""Deviation of size or form, of the diameter of an element, at most."""


Part = Annotated[str, OneOf(PARTS)]
Whole = Annotated[int, Measure(low=0, whole=True)]
Length = Annotated[Quantity, Measure("length")]
PositiveLength = Annotated[Quantity, Measure("length", above=0)]
Angle = Annotated[Quantity, Measure("angle")]


@dataclass(frozen=True, kw_only=True)
class Defect(Described):
    """What all defects share: a label, a severity, checked settings in SI."""

    label: ClassVar[str] = "defect"
    error: ClassVar[type[ValueError]] = BearingError

    @property
    def severity(self) -> float:
        """Size of the defect, by its own main parameter."""
        return float(getattr(self, next(name for name, one in measures_of(type(self)).items() if not one.whole)))

    @property
    def description(self) -> dict[str, object]:
        """Label, severity and all parameters, for storing beside results."""
        return {"label": self.label, "severity": self.severity, **asdict(self)}

    def check(self, bearing: Bearing) -> None:
        """Raise BearingError if the defect does not fit the bearing."""

    def check_small(self, name: str, value: float, bearing: Bearing) -> None:
        """Raise BearingError for a deviation that is no small one beside the elements: another unit is meant."""
        most = SMALL * bearing.element_diameter
        require(
            abs(value) <= most,
            f"{type(self).__name__}.{name} is {1e3 * value:.4g} mm; give at most {1e3 * most:.3g} mm, a twentieth of "
            "an element's diameter (a plain number is in m)",
        )


@dataclass(frozen=True, kw_only=True)
class SurfaceDefect(Defect, ABC):
    """Missing material over the angle of a ring or an element."""

    part: Part = OUTER
    element: Whole = 0

    def check(self, bearing: Bearing) -> None:
        if self.part == ELEMENT:
            require(
                self.element < bearing.elements,
                f"{type(self).__name__}.element is {self.element}; the bearing has 0 to {bearing.elements - 1}",
            )

    @abstractmethod
    def finest(self, bearing: Bearing) -> float:
        """Return the length over which the profile changes fastest, m."""

    @abstractmethod
    def missing(self, angle: np.ndarray, bearing: Bearing, height: float) -> np.ndarray:
        """Return the missing material as the element's centre feels it.

        Parameters
        ----------
        angle : ndarray
            Even angles over one turn of the part, rad.
        bearing : Bearing
        height : float
            Place along a roller from its middle, m; 0 for balls.
        """


@dataclass(frozen=True, kw_only=True)
class Spall(SurfaceDefect):
    """A gap in a surface, as deep as it is worn and at most as deep as the element can follow.

    Parameters
    ----------
    part : {"outer", "inner", "element"}
    element : int
        Which element, if it is on one.
    width : float or str
        Along the rolling direction, m.
    depth : float or str
        Of the bottom, m.
    angle : float or str
        Of its middle: about z from the x axis of the ring's marker, of an element from where the inner ring touches.
        On a ring that stands still it is heard only in the load zone, which on the outer ring is about the direction
        opposite to the force on the shaft (`Solution.load` of the bearing).
    edge : float or str, optional
        Width over which edges are rounded, m; default a tenth of the width, at most 0.1 mm.
    roughness : float or str
        Standard deviation of the bottom, m, drawn with ``seed``.
    seed : int
    """

    label: ClassVar[str] = "spall"
    width: PositiveLength = "1 mm"
    depth: PositiveLength = "0.1 mm"
    angle: Angle = 0.0
    edge: Length = None
    roughness: Annotated[Quantity, Measure("length", 0)] = 0.0
    seed: Whole = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.edge is None:
            object.__setattr__(self, "edge", min(0.1 * self.width, 1e-4))
        require(0.0 < self.edge <= self.width, f"{self.place}edge is {self.edge:g} m; give a part of the width")

    def check(self, bearing: Bearing) -> None:
        super().check(bearing)
        around = 2.0 * np.pi * surface_radius(bearing, self.part)
        require(
            self.width < 0.5 * around,
            f"{type(self).__name__}.width is {1e3 * self.width:g} mm, the surface is {1e3 * around:.4g} mm around; "
            "give less than half of it",
        )

    def finest(self, bearing: Bearing) -> float:
        return self.edge

    def missing(self, angle: np.ndarray, bearing: Bearing, height: float) -> np.ndarray:
        radius = surface_radius(bearing, self.part)
        inside = self.inside(radius * wrapped(angle - self.angle), height)
        bottom = self.depth
        if self.roughness:
            rng = np.random.default_rng(self.seed)
            bottom = np.clip(self.depth + self.roughness * rng.standard_normal(angle.size), 0.0, None)
        return rounded(drop(inside, 0.5 * bearing.element_diameter, bottom), self.edge / radius)

    def inside(self, along: np.ndarray, height: float) -> np.ndarray:
        """Return the distance from the nearer edge, positive inside, of places along the rolling direction, m."""
        return 0.5 * self.width - np.abs(along)


@dataclass(frozen=True, kw_only=True)
class Line(Spall):
    """A fine groove across the whole path, such as an indentation at standstill or a cut by spark erosion."""

    label: ClassVar[str] = "line"
    width: PositiveLength = "0.2 mm"
    depth: PositiveLength = "0.2 mm"


@dataclass(frozen=True, kw_only=True)
class Pit(Spall):
    """A round hole.

    Parameters
    ----------
    width : float or str
        Its diameter, m.
    offset : float or str
        Of its middle from the track of a ball, or from the middle of a roller, along the axis, m.
    """

    label: ClassVar[str] = "pit"
    width: PositiveLength = "0.5 mm"
    offset: Length = 0.0

    def inside(self, along: np.ndarray, height: float) -> np.ndarray:
        return 0.5 * self.width - np.hypot(along, height - self.offset)


@dataclass(frozen=True, kw_only=True)
class Waviness(SurfaceDefect):
    """Waves round a ring or an element: h(t) = amplitude cos(order (t - angle)), or drawn orders of a spectrum.

    Parameters
    ----------
    amplitude : float or str
        Of the order, or of the lowest of several, m.
    order : int
        Waves a turn.
    highest : int, optional
        Draw all orders up to this one, amplitudes falling as order^-slope, with phases from ``seed``.
    slope : float
    angle : float or str
        Of a crest of missing material, rad.
    seed : int
    """

    label: ClassVar[str] = "waviness"
    amplitude: Length = "1 um"
    order: Annotated[int, Measure(low=1, whole=True)] = 2
    highest: int | None = None
    slope: float = 1.0
    angle: Angle = 0.0
    seed: Whole = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        top = self.order if self.highest is None else self.highest
        require(self.order <= top <= 500, f"Waviness.highest is {top}; give one from the order up to 500")

    def check(self, bearing: Bearing) -> None:
        super().check(bearing)
        self.check_small("amplitude", self.amplitude, bearing)

    def finest(self, bearing: Bearing) -> float:
        top = self.highest or self.order
        return 0.5 * np.pi * surface_radius(bearing, self.part) / top

    def missing(self, angle: np.ndarray, bearing: Bearing, height: float) -> np.ndarray:
        if self.highest is None:
            return self.amplitude * np.cos(self.order * (angle - self.angle))
        rng = np.random.default_rng(self.seed)
        total = np.zeros_like(angle)
        for k in range(self.order, self.highest + 1):
            size = self.amplitude * (k / self.order) ** -self.slope
            total += size * np.cos(k * angle + rng.uniform(0.0, 2.0 * np.pi))
        return total


@dataclass(frozen=True, kw_only=True)
class OffSize(Defect):
    """One element larger (or smaller) than the others, or all drawn with a standard deviation.

    Parameters
    ----------
    amount : float or str
        Excess of the diameter, or its standard deviation over all elements if ``element`` is None, m.
    element : int, optional
    seed : int
    """

    label: ClassVar[str] = "off-size element"
    amount: Length = "2 um"
    element: Whole | None = 0
    seed: Whole = 0

    def check(self, bearing: Bearing) -> None:
        self.check_small("amount", self.amount, bearing)
        if self.element is not None:
            require(
                self.element < bearing.elements,
                f"OffSize.element is {self.element}; the bearing has elements 0 to {bearing.elements - 1}",
            )

    def oversize(self, bearing: Bearing) -> np.ndarray:
        """Return the excess of each diameter, shape (Z,), m."""
        excess = np.zeros(bearing.elements)
        if self.element is None:
            return np.random.default_rng(self.seed).normal(0.0, self.amount, bearing.elements)
        excess[self.element] = self.amount
        return excess


@dataclass(frozen=True, kw_only=True)
class Misalignment(Defect):
    """A ring that sits askew on its seat: its axis leans by ``tilt`` towards ``angle`` from x of the ring's marker."""

    label: ClassVar[str] = "misaligned ring"
    part: Part = OUTER
    tilt: Angle = "0.1 deg"
    angle: Angle = 0.0

    def check(self, bearing: Bearing) -> None:
        require(self.part != ELEMENT, "Misalignment.part is 'element'; choose outer or inner")
        require(abs(self.tilt) < 0.1, f"Misalignment.tilt is {self.tilt:g} rad; give less than 0.1 rad")


@dataclass(frozen=True, kw_only=True)
class LooseFit(Defect):
    """A ring that is loose on its seat; it is a body of its own then, see `gearmbs.bearings.add_bearing`.

    Parameters
    ----------
    part : {"outer", "inner"}
        Ring in the housing, or on the shaft.
    clearance : float or str
        Diametral, between ring and seat, m.
    stiffness : float or str
        Of the ring on its seat, and of the shoulder beside it, N/m.
    damping : float or str
        Damper by spring there, s.
    creep : float
        Viscous torque against turning in the seat, N m s/rad.
    """

    label: ClassVar[str] = "loose fit"
    part: Part = OUTER
    clearance: Length = "20 um"
    stiffness: Annotated[Quantity, Measure("stiffness", above=0)] = 5e8
    damping: Annotated[Quantity, Measure("time", 0)] = 1e-5
    creep: Annotated[Quantity, Measure(low=0)] = 0.05

    def check(self, bearing: Bearing) -> None:
        require(self.part != ELEMENT, "LooseFit.part is 'element'; choose outer or inner")
        require(0.0 < self.clearance < 1e-3, f"LooseFit.clearance is {self.clearance:g} m; give it in '... um'")


@dataclass(frozen=True, kw_only=True)
class UnevenSpacing(Defect):
    """Pockets of the cage that are not evenly spaced: drawn with a standard deviation, or one that is off.

    Parameters
    ----------
    amount : float or str
        Standard deviation of the places, rad, or how far the element is off.
    element : int, optional
        The one that is off; default all are drawn.
    seed : int
    """

    label: ClassVar[str] = "cage"
    amount: Angle = "1 deg"
    element: Whole | None = None
    seed: Whole = 0

    def check(self, bearing: Bearing) -> None:
        if self.element is not None:
            require(
                self.element < bearing.elements,
                f"UnevenSpacing.element is {self.element}; the bearing has elements 0 to {bearing.elements - 1}",
            )
        room = np.pi / bearing.elements
        require(abs(self.amount) < room, f"UnevenSpacing.amount is {self.amount:g} rad; give less than {room:.3g} rad")

    def places(self, bearing: Bearing) -> np.ndarray:
        """Return how far each element is off, shape (Z,), rad."""
        if self.element is None:
            return np.random.default_rng(self.seed).normal(0.0, self.amount, bearing.elements)
        off = np.zeros(bearing.elements)
        off[self.element] = self.amount
        return off


DEFECTS: dict[str, type[Defect]] = {
    kind.label: kind for kind in (Spall, Line, Pit, Waviness, OffSize, Misalignment, LooseFit, UnevenSpacing)
}
"""Classes by label, for files and command lines."""


def surface_radius(bearing: Bearing, part: str) -> float:
    """Return the radius on which an element runs on a part, m."""
    if part == ELEMENT:
        return 0.5 * bearing.element_diameter
    sign = 1.0 if part == OUTER else -1.0
    return 0.5 * bearing.pitch_diameter * (1.0 + sign * bearing.ratio)


def wrapped(angle: np.ndarray) -> np.ndarray:
    """Return angles between -pi and pi."""
    return np.mod(angle + np.pi, 2.0 * np.pi) - np.pi


def profile_rows(
    defects: Iterable[Defect], bearing: Bearing, part: str, heights: np.ndarray, element: int | None = None
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return a part's profiles and which of them each path meets; None if it has no defect.

    Returns
    -------
    rows : ndarray, shape (profiles, nodes)
        Missing material, m.
    row_of_path : ndarray of int, shape (paths,)
    """
    own = [d for d in defects if isinstance(d, SurfaceDefect) and d.part == part]
    own = [d for d in own if element is None or d.element == element]
    if not own:
        return None
    radius = surface_radius(bearing, part)
    nodes = node_count(min(d.finest(bearing) for d in own), radius)
    return _distinct(lambda height: profile(own, bearing, nodes, height), heights)


def profile(own: list[SurfaceDefect], bearing: Bearing, nodes: int, height: float) -> np.ndarray:
    """Return the sum of some defects' missing material at even nodes of a turn, m."""
    turn = angles(nodes)
    total = np.zeros(nodes)
    for defect in own:
        total += defect.missing(turn, bearing, height)
    return total


def _distinct(make: Callable[[float], np.ndarray], heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rows: list[np.ndarray] = []
    places = np.zeros(heights.size, dtype=np.int64)
    for k, height in enumerate(heights):
        row = make(float(height))
        same = [m for m, other in enumerate(rows) if np.array_equal(row, other)]
        places[k] = same[0] if same else len(rows)
        if not same:
            rows.append(row)
    return np.stack(rows), places


# Defects as they are given: objects, or tables of files with a kind and its fields.


def as_defects(value: Any) -> tuple[Defect, ...]:
    """Return defects given as one or several objects or tables.

    Parameters
    ----------
    value : Defect, mapping, or sequence of them
        A table has the ``kind`` of `gearmbs.bearings.DEFECTS` and the fields of its class.

    Raises
    ------
    BearingError
        For anything else, an unknown kind, and fields that a kind does not have.

    Examples
    --------
    >>> as_defects({"kind": "spall", "part": "inner", "width": "2 mm"})
    (Spall(part='inner', width='2 mm', edge=0.0001),)
    """
    single = not isinstance(value, Sequence) or isinstance(value, str)
    return tuple(_one(item) for item in ((value,) if single else value))


def _one(value: Any) -> Defect:
    if isinstance(value, Defect):
        return value
    if not isinstance(value, Mapping):
        raise BearingError(f"defects holds {value!r}; give defects of gearmbs.bearings, or tables with their kind")
    table = dict(value)
    kind = str(table.pop("kind", ""))
    return make(chosen(DEFECTS, kind, "defects: ", BearingError), table, f"defects: {kind}", BearingError)
