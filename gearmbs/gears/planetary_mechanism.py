"""A planetary set as a mechanism: bodies, supports, pins, meshes, drives and loads."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gearmbs._display import Written
from gearmbs.gears.elastic_rim import ElasticRim, ring_meshes
from gearmbs.gears.geometry import turn_z
from gearmbs.gears.planetary_set import MEMBERS, PlanetarySet
from gearmbs.mechanism import Mechanism, ramp, step
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.elements import ForceElement
from gearmbs.units import Quantity, to_si

Z = (0.0, 0.0, 1.0)
PinBearing = Callable[[str, Marker, Marker], ForceElement]


@dataclass(frozen=True)
class Support(Written):
    """Springs that carry a member against the ground, or a planet against the carrier.

    Parameters
    ----------
    radial, axial : float or str
        Stiffness, N/m. Without ``axial`` the member stays in its plane. ``radial`` may be a pair: of a pin away from
        the carrier's axis and along its circle, of a member along x and y.
    torsional, tilting : float or str
        About the axis and across it, N m/rad.
    damping : float or str
        Time that times a stiffness is a damping, s.
    """

    radial: Quantity | tuple[Quantity, Quantity] = 0.0
    axial: Quantity = 0.0
    torsional: Quantity = 0.0
    tilting: Quantity = 0.0
    damping: Quantity = 0.0

    def __post_init__(self) -> None:
        units = {"radial": "N/m", "axial": "N/m", "torsional": "N*m/rad", "tilting": "N*m/rad", "damping": "time"}
        for name, unit in units.items():
            given = getattr(self, name)
            several = name == "radial" and isinstance(given, tuple | list)
            values = tuple(to_si(one, unit, f"Support.{name}") for one in (given if several else (given,)))
            if several and len(values) != 2:
                raise ValueError(f"Support.radial is {given!r}; give one stiffness, or a pair")
            for value in values:
                if not (math.isfinite(value) and value >= 0):
                    raise ValueError(f"Support.{name} is {value}; give 0 or more")
            object.__setattr__(self, name, values if several else values[0])

    @property
    def across(self) -> tuple[float, float]:
        """Both stiffnesses across the axis, N/m."""
        return self.radial if isinstance(self.radial, tuple) else (self.radial, self.radial)  # type: ignore[return-value]


def planetary_mechanism(
    gears: PlanetarySet,
    *,
    speeds: Mapping[str, Quantity] | None = None,
    torques: Mapping[str, Quantity] | None = None,
    held: str | None = "ring",
    run_up: Quantity = 0.05,
    supports: Mapping[str, Support] | None = None,
    pins: Support | PinBearing | None = None,
    masses: Mapping[str, tuple[float, Any]] | None = None,
    rim: ElasticRim | None = None,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Mechanism:
    """Return the mechanism of a planetary set, its axis along global z, planet 1 on global x where angles begin with 0.

    Parameters
    ----------
    gears : PlanetarySet
    speeds : mapping, optional
        Prescribed speeds of "sun", "carrier" or "ring", rad/s or text.
    torques : mapping, optional
        Torques on members that are neither held rigidly nor have a speed, N m or text, positive about +z.
    held : str, optional
        Member fixed to the ground; None for a differential set.
    run_up : float or str
        Duration of the STEP of speeds and torques, s; 0 starts at speed, with all bodies turning as they must.
    supports : mapping of str to Support, optional
        Members that are not guided rigidly on the axis. One without any stiffness floats in its plane.
    pins : Support or callable, optional
        Springs between planets and carrier, or a function that makes the force element of a pin's bearing from its name
        and two markers, of the pin and of the planet's bore, z along the axis;
        `gearmbs.studies.planetary.rolling_pins` makes one for rolling bearings. By default planets turn in
        revolute joints.
    masses : mapping, optional
        Mass, kg, and moments of inertia (or that about z), kg m^2, of "sun", "planet", "carrier", "ring".
    rim : ElasticRim, optional
        Lets the rim of a ring that is held or supported bend under the planets that pass: one element ``ring meshes``
        stands for the meshes with the ring.
    gravity : (float, float, float)

    Returns
    -------
    Mechanism
        Bodies ``sun``, ``carrier``, ``ring``, ``planet 1`` ...; joints and supports ``sun seat``, ``planet 1 pin`` ...;
        meshes ``sun-planet 1``, ``planet 1-ring`` ...; ``sun drive``, ``sun load`` ...

    Raises
    ------
    ValueError
        For members that are none, are held and driven, or are over-determined, and for torques on members whose motion
        is given.

    Notes
    -----
    Joints form a tree: meshes are forces, and supports springs. So no constraint is redundant and each reaction has one
    answer, however many planets there are.

    The mechanism's ``lump`` is set: a member that is held is integrated as ground, and results are about all bodies as
    without it.
    """
    supports, speeds, torques = dict(supports or {}), dict(speeds or {}), dict(torques or {})
    _check(held, speeds, torques, supports)
    if rim is not None and "ring" not in (held, *supports):
        raise ValueError(
            "planetary: the rim of a ring that turns is given; a rim can bend on a ring that is held or has a support"
        )
    loads = {m: to_si(v, "torque", f"torques[{m!r}]") for m, v in torques.items()}
    _check_loads(loads, held, speeds, supports)
    drives = {m: to_si(v, "angular speed", f"speeds[{m!r}]") for m, v in speeds.items()}
    over = to_si(run_up, "time", "run_up")
    known = {**drives, **({held: 0.0} if held else {})}
    turning = gears.speeds(**known) if over == 0 and len(known) == 2 else dict.fromkeys((*MEMBERS, "planet"), 0.0)
    m = Mechanism(gears.name, gravity=gravity)
    m.lump = True
    if len(known) == 2:
        frequencies = gears.frequencies(**known)
        m.rate_scale = 2.0 * np.pi * max(frequencies["mesh"], frequencies["mesh_ring"]) or None
    start = gears.start_angles()
    masses = set_masses(gears, masses or {})
    turns = {"sun": 0.0, "carrier": 0.0, "ring": start["ring"]}
    for member in MEMBERS:
        mass, inertia = masses[member]
        spin = (0.0, 0.0, turning[member])
        body = m.body(member, mass, inertia, orientation=turn_z(turns[member]), angular_velocity=spin)
        if member == held and member not in supports:
            m.fixed(f"{member} seat", body, m.ground)
        elif member in supports:
            _support(m, f"{member} seat", body, m.ground, supports[member])
        else:
            seat = m.revolute(f"{member} seat", body, m.ground, at=(0, 0, 0), axis=Z)
            if member in drives:
                value = drives[member]
                if over == 0:
                    m.rotation(f"{member} drive", seat, value, level="velocity")
                else:
                    m.rotation(f"{member} drive", seat, ramp(value, over=over))
        if member in loads:
            load = loads[member] if over == 0 else step(0.0, 0.0, over, loads[member])
            m.torque(f"{member} load", body, load, axis=Z)
    sense = gears.sense(gears.speeds(**known) if len(known) == 2 else known)
    members = Members(m.bodies["sun"], m.bodies["carrier"], m.bodies["ring"], sense=sense)
    add_planets(m, gears, members, start, masses["planet"], turning, pins, rim)
    return m


def _check(held: str | None, speeds: dict, torques: dict, supports: dict) -> None:
    for label, names in (
        ("held", [held] if held else []),
        ("speeds", speeds),
        ("torques", torques),
        ("supports", supports),
    ):
        for name in names:
            if name not in MEMBERS:
                raise ValueError(f"planetary: {label} has {name!r}; choose among sun, carrier and ring")
    for name in speeds:
        if name == held:
            raise ValueError(
                f"planetary: {name} is held and has a speed; give the speed of another, or let none be held "
                "(held=None, in a file held = 'none')"
            )
        if name in supports:
            raise ValueError(
                f"planetary: {name} has a speed and a support; drive it by a torque, or guide it without a support"
            )
    count = len(speeds) + (held is not None)
    if not count <= 2:
        raise ValueError(
            "planetary: the speeds of all three members are given; two of them determine the third: leave one out"
        )


def _check_loads(loads: Mapping[str, float], held: str | None, speeds: Mapping, supports: Mapping) -> None:
    """Refuse torques that only what gives the motion of their member would feel."""
    for name, torque in loads.items():
        fixed = name == held and name not in supports
        given = "is held" if fixed else "has a speed"
        if torque != 0.0 and (fixed or name in speeds):
            raise ValueError(
                f"planetary: torques[{name!r}] is {torque:g} N m, but {name} {given}: the torque would change neither "
                "motion nor meshes; leave it out (the reaction there follows from the torques on the others), or give "
                f"the torque on {' or '.join(m for m in MEMBERS if m != held and m not in speeds) or 'another member'}"
            )


def set_masses(gears: PlanetarySet, given: Mapping[str, tuple[float, Any]]) -> dict[str, tuple[float, Any]]:
    """Masses and moments of inertia of all members; the carrier's default is a disc as far as the planets' axes."""
    unknown = set(given) - {*MEMBERS, "planet"}
    if unknown:
        raise ValueError(f"planetary: masses has {', '.join(sorted(unknown))}; give sun, planet, carrier, ring")
    planet_mass, planet_inertia = gears.planet.mass, np.array(gears.planet.inertia)
    if gears.planet_at_ring is not None:
        planet_mass += gears.planet_at_ring.mass
        planet_inertia = planet_inertia + gears.planet_at_ring.inertia
    radius, width = float(gears.carrier_radius), gears.planet.face_width
    disc = gears.planet.material.density * math.pi * radius**2 * width
    own = {
        "sun": (gears.sun.mass, gears.sun.inertia),
        "planet": (planet_mass, tuple(planet_inertia)),
        "carrier": (disc, (disc * (3 * radius**2 + width**2) / 12,) * 2 + (0.5 * disc * radius**2,)),
        "ring": (gears.ring.mass, gears.ring.inertia),
    }
    for name, (mass, inertia) in given.items():
        moments = np.atleast_1d(np.asarray(inertia, dtype=float))
        # a single one is that about the axis of a flat disc
        own[name] = (mass, tuple(moments) if moments.size > 1 else (0.5 * moments[0], 0.5 * moments[0], moments[0]))
    return own


def _support(
    m: Mechanism, name: str, i: Any, j: Any, support: Support, at: np.ndarray | None = None, axes: Any = None
) -> None:
    """Carry ``i`` by springs against ``j`` at a point; in its plane unless it has an axial stiffness."""
    place, axes = i.position if at is None else at, np.eye(3) if axes is None else axes
    on_i, on_j = i.marker(name=f"{name}.I"), j.marker_at(place, axes, name=f"{name}.J")
    if support.axial == 0.0:
        m.joint("planar", f"{name} plane", on_i, on_j)
    k = (*support.across, support.axial)
    kt = (support.tilting, support.tilting, support.torsional) if support.axial else (0.0, 0.0, support.torsional)
    if any((*k, *kt)):
        # about its axis the member stands as it is: springs count from there
        m.bushing(
            name,
            i.marker_at(i.position, axes, name=f"{name}.K"),
            on_j,
            stiffness=k,
            torsional_stiffness=kt,
            damping=tuple(support.damping * x for x in k),
            torsional_damping=tuple(support.damping * x for x in kt),
        )


class Members(NamedTuple):
    """What the planets of a set mesh with and turn on, in a mechanism.

    Attributes
    ----------
    sun : Body or Marker
        Wheel frame of the sun.
    carrier : Body
    ring : Body or Marker
        Wheel frame of the ring.
    origin : ndarray, shape (3,)
        Point of the axis at mid-face, global components, m.
    axes : ndarray, shape (3, 3)
        Columns: a frame that does not turn, z along the axis.
    angle : float
        Of the carrier from that frame at the start, rad.
    prefix : str
        Before the names of bodies, pins and meshes.
    sense : int
        Of rotation, in which pins are off tangentially: `PlanetarySet.sense`.
    """

    sun: Body | Marker
    carrier: Body
    ring: Body | Marker
    origin: np.ndarray = np.zeros(3)
    axes: np.ndarray = np.eye(3)
    angle: float = 0.0
    prefix: str = ""
    sense: int = 1


def add_planets(
    m: Mechanism,
    gears: PlanetarySet,
    members: Members,
    start: Mapping[str, Any],
    weight: tuple,
    turning: Mapping[str, float],
    pins: Support | PinBearing | None = None,
    rim: ElasticRim | None = None,
) -> None:
    """Add the planets of a set, their pins and their meshes to a mechanism that has its other members.

    Parameters
    ----------
    m : Mechanism
    gears : PlanetarySet
    members : Members
    start : mapping
        As of `PlanetarySet.start_angles`, from the carrier's angle.
    weight : tuple
        Mass (kg) and moments of inertia (kg m^2) of a planet.
    turning : mapping of str to float
        Speeds of "carrier" and "planet" at the start, rad/s.
    pins, rim
        As of `planetary_mechanism`.
    """
    carrier, spin, axes, before = members.carrier, turning["carrier"], members.axes, members.prefix
    to_sun, to_ring = gears.meshes("sun"), gears.meshes("ring")
    wheels: list[Any] = []
    for k in range(gears.planets):
        psi = float(gears.angles[k]) + members.angle  # type: ignore[index]
        radial, ahead = gears.pin_errors.get(k, (0.0, 0.0))
        tangential = members.sense * ahead
        c, s = math.cos(psi), math.sin(psi)
        arm = (gears.carrier_radius + radial) * np.array([c, s, 0.0]) + tangential * np.array([-s, c, 0.0])
        place = members.origin + axes @ arm
        name = f"{before}planet {k + 1}"
        planet = m.body(
            name,
            *weight,
            position=place,
            orientation=axes @ turn_z(members.angle + start["planets"][k]),
            velocity=axes @ np.array([-spin * arm[1], spin * arm[0], 0.0]),
            angular_velocity=turning["planet"] * axes[:, 2],
        )
        if pins is None:
            m.revolute(f"{name} pin", planet, carrier, at=place, axis=axes[:, 2])
        elif isinstance(pins, Support):
            # towards the carrier's axis and along its circle
            _support(m, f"{name} pin", planet, carrier, pins, place, axes @ turn_z(psi))
        else:
            # the bearing's rings keep their plane as a spring without axial stiffness does
            pin = carrier.marker_at(place, axes, name=f"{name} pin.I")
            bore = planet.marker_at(place, axes, name=f"{name} pin.J")
            m.joint("planar", f"{name} pin plane", bore, pin)
            m.add(pins(f"{name} pin", pin, bore))
        m.gear_contact(f"{before}sun-planet {k + 1}", members.sun, planet, to_sun[k], carrier=carrier)
        wheel: Any = planet
        if gears.planet_at_ring is not None:
            wheel = planet.marker((0.0, 0.0, 0.0), turn_z(start["steps"][k]), name=f"{name} step")
        if rim is None:
            m.gear_contact(f"{name}-ring", wheel, members.ring, to_ring[k], carrier=carrier)
        else:
            wheels.append(wheel if isinstance(wheel, Marker) else wheel.marker(name=f"{name}.wheel"))
    if rim is not None:
        ring = members.ring if isinstance(members.ring, Marker) else members.ring.marker(name="ring.wheel")
        m.add(ring_meshes(f"{before}ring meshes", wheels, ring, to_ring, rim, gears.ring))
