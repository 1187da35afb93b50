"""Carriers of planetary stages that deform: from finite elements or modes, or by how far their pins give way.

The frame of a carrier has its origin on the axis at mid-face of the planets, z along the axis, and turns with the
carrier; pins are where the set says. The carrier is fixed to its shaft at its hub, a place on the axis.

By stiffness, each pin is joined to the hub by springs along the radius, the circle and the axis, and against
tilting; it has a mass of its own and the hub what is left of the carrier's.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
import scipy.sparse as sp

from gearmbs.drivetrain.members.sources import ALL, MODES, ROUND, body_source
from gearmbs.drivetrain.part import errors_named
from gearmbs.drivetrain.shaft import DAMPING, Shaft, damping_of
from gearmbs.flexible import FiniteElementModel, Interface, ModalModel, Seat, reduce_model
from gearmbs.flexible.modal_model import shapes_at
from gearmbs.gears.geometry import MM, turn_z
from gearmbs.schema.described import Described, chosen
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain
    from gearmbs.drivetrain.planetary import PlanetaryStage
    from gearmbs.gears.planetary_set import PlanetarySet
    from gearmbs.mechanism.mechanism import Mechanism
    from gearmbs.mechanism.parts.bodies import Body

HUB = "hub"
"""Name of the seat at which a carrier is on its shaft."""
PIN_SHARE = 0.05
"""Part of a carrier's mass that moves with one of its pins, where nothing is told: a solid pin and a piece of the
flanges around it."""
PIN_SIZE = 0.1
"""Radius of gyration of a pin, by that of the circle of pins: it only keeps its own tilting above all else."""

Stiffness = Annotated[Quantity, Measure("stiffness", above=0)]
Sizes = Measure("length", above=0, several=2)


def _need(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


@contextmanager
def _named(field: str) -> Iterator[None]:
    """Name the field in errors of what it is made of; the stage names itself."""
    try:
        yield
    except (TypeError, ValueError) as error:
        raise ValueError(f"carrier_body: {field}: {error}") from None


@dataclass(frozen=True, kw_only=True)
class FlexibleCarrier(Described):
    """How the carrier of a planetary stage deforms. Give a ``model``, or how stiff its pins are.

    Parameters
    ----------
    model : FiniteElementModel, ModalModel or mapping, optional
        Of `gearmbs.flexible`; or a table with ``program``, ``files`` and keywords of its reader, as of a housing. Mass
        and inertia of the carrier follow from it.
    hub, pin : sequence of 2 floats, or str
        Of finite elements: diameter and width within whose cylinder nodes are those of the hub, and of a pin, m. Of a
        body with modes: the name of the hub's seat; default: those nearest to the places.
    at : float or str
        Place of the model's origin along the axis, from mid-face, m.
    turned : float or str
        Angle of the model's x axis on the carrier, on which planet 1 is at 0, rad.
    hub_at : float or str
        Place of the hub along the axis, from mid-face, m.
    faces : {"average", "rigid"}
        How nodes follow hub and pins, see `gearmbs.flexible.Interface`.
    modes : int or "all", optional
        Shapes beside the static ones of pins and hub; default 20 of finite elements, all of a body with modes.
    damping : float, sequence or bands
        See `gearmbs.flexible.damping_ratios`.
    radial, tangential : float or str
        Without a model: stiffness of a pin away from the axis and along its circle, N/m.
    axial : float or str, optional
        N/m; default: as radial.
    tilting : float or str, optional
        N m/rad; default: of springs at both ends of the planets' face, radial times a quarter of its square.
    pin_mass : float or str, optional
        kg; default: a twentieth of the carrier's.

    Raises
    ------
    ValueError
    """

    error: ClassVar[type[ValueError]] = ValueError
    section: ClassVar[str] = "carrier_body"

    model: Any = None
    hub: Any = None
    pin: Any = None
    at: Annotated[Quantity, Measure("length")] = 0.0
    turned: Annotated[Quantity, Measure("angle")] = 0.0
    hub_at: Annotated[Quantity, Measure("length")] = 0.0
    faces: str = "average"
    modes: Any = None
    damping: Any = DAMPING
    radial: Stiffness = None
    tangential: Stiffness = None
    axial: Stiffness = None
    tilting: Annotated[Quantity, Measure("N*m/rad", above=0)] = None
    pin_mass: Annotated[Quantity, Measure("mass", above=0)] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        by_pins = {name: getattr(self, name) for name in ("radial", "tangential", "axial", "tilting", "pin_mass")}
        told = [name for name, value in by_pins.items() if value is not None]
        if self.model is None:
            _need(self.hub_at == 0.0, "carrier_body: hub_at is for a model; without one the hub is at mid-face")
            _need(
                self.radial is not None and self.tangential is not None,
                "carrier_body: give model, or radial and tangential, the stiffness of its pins",
            )
        else:
            _need(not told, f"carrier_body: {', '.join(told)} beside model; give one of them")
            with _named("model"):
                object.__setattr__(self, "model", body_source(self.model))
        counted = isinstance(self.modes, int) and not isinstance(self.modes, bool) and self.modes >= 1
        _need(
            counted or self.modes in (None, ALL),
            f"carrier_body: modes is {self.modes!r}; give a whole number from 1 up, or '{ALL}'",
        )
        chosen(("average", "rigid"), self.faces, "carrier_body: ", ValueError, "faces")
        with _named("damping"):
            damping_of(self.damping)

    @classmethod
    def of(cls, given: Any) -> FlexibleCarrier:
        """Return the carrier that is given, or that a table of its fields describes."""
        if isinstance(given, FlexibleCarrier):
            return given
        _need(isinstance(given, Mapping), f"carrier_body is {given!r}; give a table, or a FlexibleCarrier")
        from gearmbs.schema.described import make

        return make(cls, given, "carrier_body", ValueError)

    def places(self, gears: PlanetarySet, sense: int = 1) -> dict[str, np.ndarray]:
        """Return where hub and pins are in the frame of the model, m, by the names of their seats.

        Parameters
        ----------
        gears : PlanetarySet
        sense : int
            Of rotation, in which pins are off tangentially.
        """
        back = turn_z(-self.turned)
        out = {HUB: np.array([0.0, 0.0, self.hub_at - self.at])}
        for k, angle in enumerate(gears.angles or (), start=1):
            radial, ahead = gears.pin_errors.get(k - 1, (0.0, 0.0))
            arm = turn_z(float(angle)) @ [float(gears.carrier_radius) + radial, sense * ahead, 0.0]
            out[pin_seat(k)] = back @ arm - np.array([0.0, 0.0, self.at])
        return out

    def mass(self, own: tuple[float, Any]) -> tuple[float, Any]:
        """Return mass (kg) and moments of inertia about the axis' middle (kg m^2).

        Parameters
        ----------
        own : tuple
            Those of a carrier without a model.
        """
        if self.model is None:
            return own
        found = self.model.properties if isinstance(self.model, ModalModel) else self.model.mass_properties()
        away = np.asarray(found.com, dtype=float) + [0.0, 0.0, self.at]
        moments = np.diag(found.inertia) + found.mass * (away @ away - away**2)
        return float(found.mass), tuple(float(x) for x in moments)

    def body(self, name: str, gears: PlanetarySet, own: tuple[float, Any], sense: int = 1) -> ModalModel:
        """Return the carrier as a body with modes, whose seats are its hub and pins.

        Parameters
        ----------
        name : str
        gears : PlanetarySet
        sense : int
            Of rotation.
        own : tuple
            Mass (kg) and moments of inertia (kg m^2) of a carrier without a model.
        """
        places = self.places(gears, sense)
        if self.model is None:
            made = pins_on_springs(name, places, self._springs(gears), self._lumps(gears, own))
            return reduce_model(made, max_frequency=np.inf, name=name)
        if isinstance(self.model, ModalModel):
            seats = {key: self._seat(self.model, key, place) for key, place in places.items()}
            found = replace(self.model, seats=seats, name=name)
            return found.slowest(self.modes) if isinstance(self.modes, int) else found
        faces = [self._face(self.model, key, place) for key, place in places.items()]
        if self.modes == ALL:
            return reduce_model(self.model, faces, max_frequency=np.inf, name=name)
        return reduce_model(self.model, faces, modes=self.modes or MODES, name=name)

    def _springs(self, gears: PlanetarySet) -> tuple[float, float, float, float]:
        """Return the stiffnesses of a pin: radial, tangential, axial, tilting."""
        tilting = 0.25 * self.radial * gears.planet.face_width**2 if self.tilting is None else self.tilting
        return self.radial, self.tangential, self.radial if self.axial is None else self.axial, tilting

    def _lumps(self, gears: PlanetarySet, own: tuple[float, Any]) -> tuple[float, float, float, np.ndarray]:
        """Return the mass and the moment of inertia of a pin, and the mass and the moments of the hub."""
        mass, moments = own
        radius = float(gears.carrier_radius)
        pin = PIN_SHARE * mass if self.pin_mass is None else self.pin_mass
        turning = pin * (PIN_SIZE * radius) ** 2
        across = gears.planets * (0.5 * pin * radius**2 + turning)
        left = np.asarray(moments) - [across, across, gears.planets * (pin * radius**2 + turning)]
        _need(
            mass > gears.planets * pin and bool(left.min() > 0.0),
            f"carrier_body: {gears.planets} pins of {pin:.4g} kg leave nothing of the carrier's {mass:.4g} kg and "
            f"{moments[2]:.4g} kg m^2; give a smaller pin_mass, or masses of the carrier",
        )
        return pin, turning, mass - gears.planets * pin, left

    def _face(self, model: FiniteElementModel, name: str, place: np.ndarray) -> Interface:
        """Return the nodes of the hub or a pin."""
        label, given = ("hub", self.hub) if name == HUB else ("pin", self.pin)
        _need(
            given is not None and not isinstance(given, str),
            f"carrier_body: {label} is {given!r}; give the diameter and the width within which nodes are its",
        )
        diameter, width = self.read(label, given, Sizes)
        arm = model.positions - place
        across = np.hypot(arm[:, 0], arm[:, 1])
        inside = (across <= 0.5 * ROUND * diameter) & (np.abs(arm[:, 2]) <= 0.5 * ROUND * width)
        apart = MM * np.sort(np.linalg.norm(arm, axis=1))[:3]
        _need(
            int(inside.sum()) >= 3,
            f"carrier_body: {int(inside.sum())} nodes are within {label} = ({MM * diameter:.4g} mm, "
            f"{MM * width:.4g} mm) of '{name}'; the nearest are {', '.join(f'{d:.4g}' for d in apart)} mm away: check "
            "at, turned and hub_at, or give a larger one",
        )
        return Interface(name, [int(k) for k in model.ids[inside]], self.faces, at=tuple(place))

    def _seat(self, model: ModalModel, name: str, place: np.ndarray) -> Seat:
        """Return a seat of a body with modes: the nearest of its own, with a rigid arm."""
        if name == HUB and self.hub is not None:
            position = model.place(self.hub)
        else:
            points = np.vstack([*(seat.position for seat in model.seats.values()), model.positions])
            position = points[int(np.argmin(np.linalg.norm(points - place, axis=1)))]
        moved, turned = shapes_at(model, position)
        arm = place - position
        far = float(np.linalg.norm(arm))
        _need(
            name == HUB or far <= 0.25 * model.size,
            f"carrier_body: the nearest node to '{name}' is {MM * far:.4g} mm away; check at and turned",
        )
        return Seat(place, moved + np.cross(turned, arm), turned)


def pin_seat(number: int) -> str:
    """Return the name of the seat of a planet's pin, counted from 1."""
    return f"pin {number}"


def pins_on_springs(
    name: str, places: Mapping[str, np.ndarray], springs: tuple[float, float, float, float],
    lumps: tuple[float, float, float, np.ndarray],
) -> FiniteElementModel:  # fmt: skip
    """Return a hub with pins on springs as finite elements.

    Parameters
    ----------
    name : str
    places : mapping of str to ndarray
        The hub's and the pins', m.
    springs : tuple of float
        Of each pin: radial, tangential, axial (N/m), tilting (N m/rad).
    lumps : tuple
        Mass and moment of inertia of a pin, mass of the hub and its moments: about its centre, kg and kg m^2.
    """
    positions = np.array(list(places.values()))
    count = len(positions)
    dofs = np.array([(k, c) for k in range(count) for c in range(6)])
    stiffness, mass = np.zeros((6 * count, 6 * count)), np.zeros(6 * count)
    pin, turning, hub, moments = lumps
    mass[:6] = [hub] * 3 + list(moments)
    radial, tangential, axial, tilting = springs
    for k in range(1, count):
        arm = positions[k] - positions[0]
        along = np.array([arm[0], arm[1], 0.0]) / np.hypot(arm[0], arm[1])
        axes = np.column_stack([along, np.cross([0.0, 0.0, 1.0], along), [0.0, 0.0, 1.0]])
        rows = np.zeros((6, 6 * count))
        rows[:3, 6 * k : 6 * k + 3], rows[:3, :3] = axes.T, -axes.T
        # where the hub turns a pin goes along
        rows[:3, 3:6] = axes.T @ _cross(arm)
        rows[3:, 6 * k + 3 : 6 * k + 6], rows[3:, 3:6] = np.eye(3), -np.eye(3)
        stiffness += rows.T @ np.diag([radial, tangential, axial, tilting, tilting, tilting]) @ rows
        mass[6 * k : 6 * k + 6] = [pin] * 3 + [turning] * 3
    seats = {key: k for k, key in enumerate(places)}
    return FiniteElementModel(
        np.arange(1, count + 1), positions, dofs, sp.csc_array(stiffness), sp.csc_array(np.diag(mass)), name, seats
    )


def _cross(arm: np.ndarray) -> np.ndarray:
    """Return the matrix of the cross product arm x."""
    x, y, z = arm
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def carrier_models(train: Drivetrain) -> dict[str, ModalModel]:
    """Return the bodies with modes of carriers that deform, by name."""
    found = {}
    for stage in train.planetary_stages:
        body = stage.flexible_carrier
        if body is not None:
            with errors_named(stage.label):
                found[stage.carrier_name] = body.body(
                    stage.carrier_name, stage.gears, stage.weights["carrier"], stage.sense(train)
                )
    return found


def add_carrier(
    m: Mechanism, train: Drivetrain, stage: PlanetaryStage, origin: np.ndarray, axes: np.ndarray, angle: float
) -> Body:
    """Return the body that the pins are on: the shaft or housing of the carrier, or one that is fixed to it.

    Parameters
    ----------
    m : Mechanism
    train : Drivetrain
    stage : PlanetaryStage
    origin, axes : ndarray, shape (3,) and (3, 3)
        Middle of the planets' faces on the axis, and axes that do not turn.
    angle : float
        Of the carrier, rad.
    """
    on = m.ground if stage.carrier == "ground" else m.bodies[stage.carrier]
    spin = stage.starting(train)["carrier"]
    name, flexible = stage.carrier_name, stage.flexible_carrier
    if flexible is None:
        shaft = train.parts.get(stage.carrier)
        if not (isinstance(shaft, Shaft) and shaft.bends):
            return on
        hub = origin
        body: Body = m.body(
            name, *stage.weights["carrier"], position=origin, orientation=axes, angular_velocity=spin * axes[:, 2]
        )
    else:
        hub = origin + flexible.hub_at * axes[:, 2]
        body = train.modal_models[name].add_to(
            m, name, damping=flexible.damping, position=origin + flexible.at * axes[:, 2],
            orientation=axes @ turn_z(angle + flexible.turned), angular_velocity=spin * axes[:, 2],
        )  # fmt: skip
    seat = f"{name} seat"
    m.joint("fixed", seat, body.marker_at(hub, axes, name=f"{seat}.I"), on.marker_at(hub, axes, name=name))
    return body
