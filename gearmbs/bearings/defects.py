"""Defects of rolling bearings: what is missing, or too much, on rings and elements.

Every defect says where it is, how large, and what it is called; several are combined by giving several. Random ones
draw from their own seed.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearmbs._shown import Written
from gearmbs.bearings.errors import BearingError, require, require_fields
from gearmbs.bearings.layout import angles, drop, node_count, rounded
from gearmbs.units import Quantity, to_si

if TYPE_CHECKING:
    from gearmbs.bearings.geometry import Bearing

OUTER, INNER, ELEMENT = "outer", "inner", "element"
PARTS = (OUTER, INNER, ELEMENT)


@dataclass(frozen=True, kw_only=True)
class Defect(Written):
    """What all defects share: a label, a severity, checked settings in SI."""

    label: ClassVar[str] = "defect"
    units: ClassVar[dict[str, str]] = {}

    def __post_init__(self) -> None:
        name = type(self).__name__
        for item in fields(self):
            value, place = getattr(self, item.name), f"{name}.{item.name}"
            if item.name in self.units:
                if value is not None:
                    try:
                        object.__setattr__(self, item.name, to_si(value, self.units[item.name], place))
                    except (TypeError, ValueError) as error:
                        raise BearingError(str(error)) from None
                    require(math.isfinite(getattr(self, item.name)), f"{place} is {value}; give a finite number")
            elif item.name == "part":
                require(value in PARTS, f"{place} is {value!r}; choose {', '.join(PARTS)}")
            elif item.name in ("element", "seed"):
                good = isinstance(value, int) and not isinstance(value, bool) and value >= 0
                require(good, f"{place} is {value!r}; give a whole number from 0 up")

    @property
    def severity(self) -> float:
        """Size of the defect, by its own main parameter."""
        return float(getattr(self, next(iter(self.units))))

    @property
    def description(self) -> dict[str, Any]:
        """Label, severity and all parameters, for storing beside results."""
        return {"label": self.label, "severity": self.severity, **asdict(self)}

    def check(self, bearing: Bearing) -> None:
        """Raise BearingError if the defect does not fit the bearing."""


@dataclass(frozen=True, kw_only=True)
class SurfaceDefect(Defect, ABC):
    """Missing material over the angle of a ring or an element."""

    part: str = OUTER
    element: int = 0

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
    units: ClassVar[dict[str, str]] = {"width": "length", "depth": "length", "angle": "angle", "edge": "length",
                                       "roughness": "length"}  # fmt: skip
    width: Quantity = "1 mm"
    depth: Quantity = "0.1 mm"
    angle: Quantity = 0.0
    edge: Quantity = None
    roughness: Quantity = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        name = type(self).__name__
        for field in ("width", "depth"):
            require(getattr(self, field) > 0.0, f"{name}.{field} is {getattr(self, field):g} m; it must be positive")
        require(self.roughness >= 0.0, f"{name}.roughness is {self.roughness:g} m; it must not be negative")
        if self.edge is None:
            object.__setattr__(self, "edge", min(0.1 * self.width, 1e-4))
        require(0.0 < self.edge <= self.width, f"{name}.edge is {self.edge:g} m; give a part of the width")

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
    width: Quantity = "0.2 mm"
    depth: Quantity = "0.2 mm"


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
    units: ClassVar[dict[str, str]] = {**Spall.units, "offset": "length"}
    width: Quantity = "0.5 mm"
    offset: Quantity = 0.0

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
    units: ClassVar[dict[str, str]] = {"amplitude": "length", "angle": "angle"}
    amplitude: Quantity = "1 um"
    order: int = 2
    highest: int | None = None
    slope: float = 1.0
    angle: Quantity = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.order >= 1, f"Waviness.order is {self.order}; give a whole number from 1 up")
        top = self.order if self.highest is None else self.highest
        require(self.order <= top <= 500, f"Waviness.highest is {top}; give one from the order up to 500")

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
    units: ClassVar[dict[str, str]] = {"amount": "length"}
    amount: Quantity = "2 um"
    element: int | None = 0  # type: ignore[assignment]
    seed: int = 0

    def __post_init__(self) -> None:
        if self.element is None:
            object.__setattr__(self, "element", 0)
            super().__post_init__()
            object.__setattr__(self, "element", None)
        else:
            super().__post_init__()

    def check(self, bearing: Bearing) -> None:
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
    units: ClassVar[dict[str, str]] = {"tilt": "angle", "angle": "angle"}
    part: str = OUTER
    tilt: Quantity = "0.1 deg"
    angle: Quantity = 0.0

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
    units: ClassVar[dict[str, str]] = {"clearance": "length", "stiffness": "stiffness", "damping": "time"}
    part: str = OUTER
    clearance: Quantity = "20 um"
    stiffness: Quantity = 5e8
    damping: Quantity = 1e-5
    creep: float = 0.05

    def check(self, bearing: Bearing) -> None:
        require(self.part != ELEMENT, "LooseFit.part is 'element'; choose outer or inner")
        require(0.0 < self.clearance < 1e-3, f"LooseFit.clearance is {self.clearance:g} m; give it in '... um'")
        require(self.stiffness > 0.0, f"LooseFit.stiffness is {self.stiffness:g} N/m; it must be positive")
        require(self.damping >= 0.0 and self.creep >= 0.0, "LooseFit: damping and creep must not be negative")


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
    units: ClassVar[dict[str, str]] = {"amount": "angle"}
    amount: Quantity = "1 deg"
    element: int | None = None  # type: ignore[assignment]
    seed: int = 0

    def __post_init__(self) -> None:
        element = self.element
        if element is None:
            object.__setattr__(self, "element", 0)
        super().__post_init__()
        object.__setattr__(self, "element", element)

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


def as_defects(given: Any) -> tuple[Defect, ...]:
    """Return defects given as one or several objects or tables.

    Parameters
    ----------
    given : Defect, mapping, or sequence of them
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
    single = not isinstance(given, Sequence) or isinstance(given, str)
    return tuple(_one(item) for item in ((given,) if single else given))


def _one(given: Any) -> Defect:
    if isinstance(given, Defect):
        return given
    if not isinstance(given, Mapping):
        raise BearingError(f"defects holds {given!r}; give defects of gearmbs.bearings, or tables with their kind")
    fields = dict(given)
    kind = str(fields.pop("kind", ""))
    if kind not in DEFECTS:
        raise BearingError(f"defects: kind {kind!r} is unknown; choose one of {', '.join(DEFECTS)}")
    require_fields(fields, DEFECTS[kind], f"defects: {kind}")
    try:
        return DEFECTS[kind](**fields)
    except TypeError as error:
        raise BearingError(f"defects: {kind}: {error}") from None
