"""Bearings: what holds shafts in housings, on the ground or on other shafts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from gearmbs.drivetrain.part import Part, errors_named, require
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.elements import ForceElement
from gearmbs.schema.quantities import Measure, OneOf
from gearmbs.units import Quantity

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism


def rolling_bearing(value: Any) -> Any:
    """Return the `gearmbs.bearings.Bearing` that a designation, a table of its fields, or one itself stands for."""
    from gearmbs import bearings

    if isinstance(value, bearings.Bearing):
        return value
    if isinstance(value, str):
        return bearings.Bearing.from_designation(value, estimate=True)
    if isinstance(value, Mapping):
        settings = dict(value)
        designation, estimate = settings.pop("designation", None), settings.pop("estimate", True)
        return (
            bearings.Bearing.from_designation(designation, estimate=estimate, **settings)
            if designation
            else bearings.Bearing(**settings)
        )
    raise TypeError(f"rolling is {value!r}; give a designation such as '6205', a table, or a gearmbs.bearings.Bearing")


@dataclass(frozen=True, kw_only=True)
class Bearing(Part, ABC):
    """What all bearings share.

    Parameters
    ----------
    shaft : str
    station : float or str, optional
        Along the shaft, m; default: its middle.
    on : str, optional
        Housing or shaft that carries it, or "ground"; default: the housing if there is exactly one, else the ground.
    on_station : float or str, optional
        Of a bearing on a shaft, where on that, m; default: its middle.
    rolling : gearmbs.bearings.Bearing, str or mapping, optional
        What rolls in it, for the tables of frequencies and lives: a bearing, its designation, or its fields.
    sense : {1, -1}, optional
        Direction along z in which the inner ring of a one-sided bearing, tapered roller or angular contact, presses;
        default: two of a shaft stand face to face, see `gearmbs.drivetrain.on_shafts.senses`.
    """

    title: ClassVar[str] = "bearing"
    kind: ClassVar[str] = "bearing"

    shaft: str
    station: Annotated[Quantity, Measure("length")] = None
    on: str | None = None
    on_station: Annotated[Quantity, Measure("length")] = None
    rolling: Any = None
    sense: Annotated[int, OneOf((1, -1))] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rolling is not None:
            with errors_named(f"{self.label}: rolling"):
                object.__setattr__(self, "rolling", rolling_bearing(self.rolling))
        what = "nothing that rolls is given" if self.rolling is None else f"a {self.rolling.kind} bearing has none"
        require(
            self.sense is None or self.is_one_sided,
            f"{self.label}: sense is {self.sense}, but {what}; leave it out, or give a tapered roller or angular "
            "contact bearing",
        )

    @property
    def thrust(self) -> str:
        """How what rolls in it carries axial loads: "both ways", "one way" or "none"; empty if nothing is told."""
        from gearmbs.bearings.kinds import KINDS as ROLLING

        return "" if self.rolling is None else ROLLING[self.rolling.kind].thrust

    @property
    def is_one_sided(self) -> bool:
        """Whether it is a tapered roller or angular contact bearing, which carries axial loads one way."""
        return self.thrust == "one way"

    @property
    def told_sense(self) -> int | None:
        """The sense of a one-sided bearing that is given; None if it is left to the shaft."""
        return self.sense if self.is_one_sided else None

    def holds(self, count: int) -> np.ndarray:
        """Return what it holds of its point and the shaft's tilts, rows over (x, y, z, tilt x, tilt y).

        Parameters
        ----------
        count : int
            How many bearings of its kind the shaft has.
        """
        return np.eye(5)[:3]

    @abstractmethod
    def add(self, m: Mechanism, shaft: Marker, seat: Marker, role: str) -> None:
        """Add the bearing to a mechanism.

        Parameters
        ----------
        m : Mechanism
        shaft, seat : Marker
            Coinciding frames on the shaft and on what carries it, z along the axis.
        role : str
            Of an ideal bearing: the joint it is, so that several on a shaft are not redundant.
        """


@dataclass(frozen=True, kw_only=True)
class IdealBearing(Bearing):
    """A joint. One on a shaft is revolute; of two the first is spherical (it locates), the second slides (inline)."""

    kind: ClassVar[str] = "ideal"

    def holds(self, count: int) -> np.ndarray:
        return np.eye(5) if count == 1 else np.eye(5)[:3]

    def add(self, m: Mechanism, shaft: Marker, seat: Marker, role: str) -> None:
        m.joint(role, self.name, shaft, seat)


@dataclass(frozen=True, kw_only=True)
class ElasticBearing(Bearing):
    """Linear springs and dampers in the seat's axes: K and C, 6 x 6, without stiffness against rotation.

    Parameters
    ----------
    stiffness : sequence of 3 or of 6 x 6 floats
        Along x, y, z (N/m), or the whole matrix in SI.
    tilting : sequence of 2 floats
        Stiffness against tilting about x and y, N m/rad.
    damping : sequence of 3 or of 6 x 6 floats
    damping_time : float or str
        Instead of ``damping``: damping over stiffness, s. Rolling bearings have 0.25e-5 to 2.5e-5 s.
    """

    kind: ClassVar[str] = "elastic"

    stiffness: Any = (1e8, 1e8, 1e8)
    tilting: Annotated[tuple[Quantity, Quantity], Measure("N*m/rad", 0, several=2)] = (0.0, 0.0)
    damping: Any = None
    damping_time: Annotated[Quantity, Measure("time", 0)] = 1e-5

    def __post_init__(self) -> None:
        super().__post_init__()
        k = self._matrix("stiffness", self.stiffness, "stiffness")
        k[3, 3], k[4, 4] = k[3, 3] + self.tilting[0], k[4, 4] + self.tilting[1]
        require(not np.any(k[5]) and not np.any(k[:, 5]), f"{self.label}: stiffness resists rotation; leave it zero")
        require(bool(np.any(k)), f"{self.label}: all stiffnesses are zero; give stiffness")
        c = self.damping_time * k if self.damping is None else self._matrix("damping", self.damping, "damping")
        object.__setattr__(self, "_matrices", (k, c))

    def _matrix(self, field: str, value: Any, unit: str) -> np.ndarray:
        if np.shape(value) == (6, 6):
            whole = np.array(value, dtype=float)
            require(bool(np.all(np.isfinite(whole))), f"{self.label}: {field} has entries that are not finite")
            require(
                bool(np.all(np.diag(whole) >= 0.0)),
                f"{self.label}: {field} has {np.diag(whole)} on its diagonal; none may be negative",
            )
            return whole
        require(np.shape(value) == (3,), f"{self.label}: {field} has shape {np.shape(value)}; give 3 numbers or 6 x 6")
        measure = Measure(unit, 0, several=3, remedy="give three values, of which none may be negative")
        return np.diag([*self.read(field, value, measure), 0.0, 0.0, 0.0])

    def holds(self, count: int) -> np.ndarray:
        return self.matrices[0][:5, :5]

    @property
    def matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness and damping, each 6 x 6, SI."""
        return self.__dict__["_matrices"]

    def add(self, m: Mechanism, shaft: Marker, seat: Marker, role: str) -> None:
        k, c = self.matrices
        m.field(self.name, shaft, seat, stiffness=k, damping=c)


@dataclass(frozen=True, kw_only=True)
class ClearanceBearing(Bearing):
    """A journal with radial clearance in a bore: F = K delta^m + C S(delta) delta', never pulling.

    Parameters
    ----------
    clearance : float or str
        Radial, m: half the diametral clearance of catalogues.
    stiffness : float or str
        K, N/m^m.
    exponent : float
    damping : float or str
        N s/m.
    depth : float or str
        Penetration at which the damping is fully on, m.
    axial : bool
        Whether the bearing also holds the shaft along the axis, as a joint.
    """

    kind: ClassVar[str] = "clearance"

    clearance: Annotated[Quantity, Measure("length", above=0)]
    stiffness: Quantity = 1e8
    exponent: Annotated[Quantity, Measure(low=1)] = 1.0
    damping: Annotated[Quantity, Measure("damping", 0)] = 1e3
    depth: Annotated[Quantity, Measure("length", above=0)] = 1e-6
    axial: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        unit = f"N/m^{float(self.exponent)!r}" if self.exponent != 1 else "N/m"
        object.__setattr__(self, "stiffness", self.read("stiffness", self.stiffness, Measure(unit, above=0)))

    def holds(self, count: int) -> np.ndarray:
        return np.eye(5)[: 3 if self.axial else 2]

    def add(self, m: Mechanism, shaft: Marker, seat: Marker, role: str) -> None:
        from gearmbs.bearings.clearance import ClearanceForce

        reals = (self.clearance, self.stiffness, self.exponent, self.damping, self.depth)
        m.add(ClearanceForce(self.name, shaft, seat, reals))
        if self.axial:
            m.joint("inplane", f"{self.name} axial", shaft, seat)


@dataclass(frozen=True, kw_only=True)
class ElementBearing(Bearing):
    """Any force element between shaft and seat.

    Parameters
    ----------
    element : callable
        ``element(name, shaft_marker, seat_marker)`` returns a `gearmbs.mechanism.ForceElement`, or a list of them, for
        instance a rolling bearing. The markers coincide at the start, z along the axis.
    """

    kind: ClassVar[str] = "element"

    element: Callable[[str, Marker, Marker], Any]

    def add(self, m: Mechanism, shaft: Marker, seat: Marker, role: str) -> None:
        made = self.element(self.name, shaft, seat)
        for one in made if isinstance(made, list | tuple) else (made,):
            require(isinstance(one, ForceElement), f"{self.label}: element made {one!r}; return a ForceElement")
            m.add(one)


@dataclass(frozen=True, kw_only=True)
class RollingContactBearing(Bearing):
    """A rolling bearing, `gearmbs.bearings.RollingBearing`, whose inner ring is on the shaft.

    Parameters
    ----------
    rolling : gearmbs.bearings.Bearing, str or mapping
    settings : mapping
        Keywords of `gearmbs.bearings.RollingBearing`: damping, preload, sense, defects, ... A `LooseFit` among the
        defects makes the ring a body of its own; in files defects are tables with their ``kind``.
    """

    kind: ClassVar[str] = "rolling"

    settings: Mapping[str, Any] = field(default_factory=dict)  # type: ignore[assignment]

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.rolling is not None, f"{self.label}: rolling is missing; give a designation such as '6205'")
        from gearmbs.bearings import LooseFit
        from gearmbs.bearings.defects import as_defects
        from gearmbs.bearings.settings import bearing_settings

        with errors_named(f"{self.label}: settings"):
            on_rings = [d for d in as_defects(self.settings.get("defects", ())) if not isinstance(d, LooseFit)]
            checked = {**self.settings, "defects": on_rings}
            bearing_settings(self.rolling, checked, "RollingBearing")
        other = self.settings.get("sense")
        require(
            None in (self.sense, other) or self.sense == other,
            f"{self.label}: sense is {self.sense} and in its settings {other}; give one of them",
        )

    @property
    def told_sense(self) -> int | None:
        if not self.is_one_sided:
            return None
        return self.settings.get("sense") if self.sense is None else self.sense

    def holds(self, count: int) -> np.ndarray:
        from gearmbs.bearings.kinds import KINDS as ROLLING

        if ROLLING[self.rolling.kind].axial:
            return np.eye(5)[2:3]
        if ROLLING[self.rolling.kind].rows == "back to back":
            # their lines of contact meet the axis at two places, so that they hold tilts, too
            return np.eye(5)
        return np.eye(5)[: 2 if self.thrust == "none" else 3]

    def add(self, m: Mechanism, shaft: Marker, seat: Marker, role: str) -> None:
        from gearmbs.bearings.element import add_bearing

        settings = dict(self.settings)
        if self.told_sense is not None:
            settings["sense"] = self.told_sense
        add_bearing(m, self.name, shaft, seat, self.rolling, **settings)


BEARINGS: dict[str, type[Bearing]] = {
    kind.kind: kind for kind in (IdealBearing, ElasticBearing, ClearanceBearing, RollingContactBearing, ElementBearing)
}
"""Bearings by their ``kind``; a further kind is one more entry."""
