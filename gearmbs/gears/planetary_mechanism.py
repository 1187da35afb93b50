"""A planetary set as a mechanism: bodies, supports, pins, meshes, drives and loads; its ring gear's rim may bend."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from gearmbs._display import Written
from gearmbs.dae.equations.loads.forces import DISSIPATED, STORED, Diagnostic
from gearmbs.gears.contact_element import law_settings
from gearmbs.gears.geometry import turn_z
from gearmbs.gears.ideal_mesh import IdealMesh
from gearmbs.gears.mesh import Mesh
from gearmbs.gears.pair import GearPair
from gearmbs.gears.planetary_set import MEMBERS, PlanetarySet
from gearmbs.gears.spec import GearSpec, convert_fields
from gearmbs.gears.tables import pack
from gearmbs.mechanism import Mechanism, ramp, step
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.elements import Compiled, ForceElement, Setting, State
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


WORK = 340
"""Places of the kernel's scratch that do not depend on the number of modes, and those a mode."""
WORK_A_MODE = 9
UNIT = 1e-3
"""Radial displacement by one unit of a state, m: the integrator then controls the rim as finely as contacts need."""


@dataclass(frozen=True)
class ElasticRim:
    """The rim of a ring gear as a thin elastic ring that bends in its plane and does not stretch.

    Parameters
    ----------
    thickness : float or str, optional
        Of the rim outside the tooth roots, m; default: the ring's ``rim_thickness``.
    width : float or str, optional
        m; default: the ring's face width.
    waves : int
        Modes have 2, 3 .. ``waves`` lobes, two modes each.
    youngs_modulus, density : float or str, optional
        Pa and kg/m^3; default: those of steel, the density that of the ring.
    damping_ratio : float
        Of critical damping of each mode of the free rim.
    bolts : sequence of (float or str), optional
        Angles at which the rim is held by springs to the ring's body, rad or text.
    bolt_stiffness : (float, float)
        Radial and tangential, of each bolt, N/m.

    Raises
    ------
    ValueError
        For values that no rim has.
    """

    thickness: Quantity = None
    width: Quantity = None
    waves: int = 6
    youngs_modulus: Quantity = 2.1e11
    density: Quantity = None
    damping_ratio: float = 0.02
    bolts: Sequence[float] = ()
    bolt_stiffness: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        units = {"thickness": "length", "width": "length", "youngs_modulus": "Pa", "density": "kg/m^3"}
        convert_fields(self, {k: u for k, u in units.items() if getattr(self, k) is not None}, "ElasticRim")
        for name in units:
            value = getattr(self, name)
            known = value is None or (math.isfinite(value) and value > 0)
            if not known:
                raise ValueError(f"ElasticRim.{name} is {value}; give more than 0")
        if not (isinstance(self.waves, int) and 2 <= self.waves <= 30):
            raise ValueError(f"ElasticRim.waves is {self.waves!r}; give a whole number from 2 to 30")
        if not (math.isfinite(self.damping_ratio) and self.damping_ratio >= 0):
            raise ValueError(f"ElasticRim.damping_ratio is {self.damping_ratio}; give 0 or more")
        if not (len(self.bolt_stiffness) == 2 and min(self.bolt_stiffness) >= 0):
            raise ValueError(
                f"ElasticRim.bolt_stiffness is {self.bolt_stiffness!r}; give two numbers of 0 or more, radial, "
                "tangential"
            )
        object.__setattr__(self, "bolts", tuple(to_si(angle, "angle", "ElasticRim.bolts") for angle in self.bolts))


@dataclass(frozen=True, eq=False)
class RimModes:
    """Modes of a rim: amplitudes are the largest radial displacements, m.

    Attributes
    ----------
    radius : float
        Of the mid-line, m.
    waves, phase : ndarray, shape (modes,)
        Lobes n; 0 for cos(n theta), 1 for sin(n theta), theta in the ring's axes.
    mass : ndarray, shape (modes,)
        rho A pi R (1 + 1/n^2), kg.
    stiffness, damping : ndarray, shape (modes, modes)
        pi E I (n^2 - 1)^2 / R^3 and the bolts' springs, N/m; N s/m.
    """

    radius: float
    waves: np.ndarray
    phase: np.ndarray
    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray

    @classmethod
    def of(cls, rim: ElasticRim, ring: GearSpec) -> RimModes:
        """Return the modes of the rim of a ring gear."""
        thickness = float(ring.rim_thickness if rim.thickness is None else rim.thickness)  # type: ignore[arg-type]
        width = float(ring.face_width if rim.width is None else rim.width)  # type: ignore[arg-type]
        density = ring.material.density if rim.density is None else float(rim.density)
        radius = ring.root_radius + 0.5 * thickness
        n = np.repeat(np.arange(2.0, rim.waves + 1), 2)
        phase = np.tile([0.0, 1.0], rim.waves - 1)
        mass = density * thickness * width * math.pi * radius * (1 + 1 / n**2)
        bending = float(rim.youngs_modulus) * width * thickness**3 / 12
        free = math.pi * bending * (n**2 - 1) ** 2 / radius**3
        modes = cls(radius, n, phase, mass, np.diag(free), np.diag(2 * rim.damping_ratio * np.sqrt(free * mass)))
        radial, tangential = rim.bolt_stiffness
        for angle in rim.bolts:
            w, v = modes.shapes(angle)
            modes.stiffness[:] += radial * np.outer(w, w) + tangential * np.outer(v, v)
        return modes

    def shapes(self, angle: float) -> tuple[np.ndarray, np.ndarray]:
        """Return radial and tangential displacement at an angle (rad) by one unit of each mode."""
        turned = self.waves * angle - 0.5 * np.pi * self.phase
        return np.cos(turned), -np.sin(turned) / self.waves

    @property
    def frequencies(self) -> np.ndarray:
        """Frequencies of the rim with its bolts, without teeth in contact, Hz, ascending."""
        scale = 1 / np.sqrt(self.mass)
        return np.sqrt(np.linalg.eigvalsh(scale[:, None] * self.stiffness * scale)) / (2 * np.pi)


DEPTHS = {"penetration_drive": "m", "penetration_back": "m", "pairs_drive": "1", "pairs_back": "1"}
"""What is told of each mesh beside its normal force, with units."""


@dataclass(eq=False, repr=False)
class RingMeshes(ForceElement):
    """Meshes of all planets with a ring whose rim bends: see `gearmbs.contact.elastic_ring_kernel`.

    Attributes
    ----------
    planets : tuple of Marker
        Frames of the planets' wheels.
    pairs : tuple of GearPair
        Of each planet with the ring.
    modes : RimModes
    """

    planets: tuple[Marker, ...] = ()
    pairs: tuple[GearPair, ...] = ()
    modes: RimModes = field(default=None)  # type: ignore[assignment]

    kind = "ring meshes"

    @property
    def markers(self) -> tuple[Marker, ...]:
        """The planets' markers, then the ring's."""
        return (*self.planets, self.j)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:  # type: ignore[override]
        """Energy of contacts and rim, powers lost, the normal force of each mesh, and how deep its teeth are."""
        meshes = range(1, len(self.planets) + 1)
        forces = (Diagnostic(f"normal_force_{k}", "N") for k in meshes)
        depths = (Diagnostic(f"{name}_{k}", unit) for k in meshes for name, unit in DEPTHS.items())
        return (
            Diagnostic("elastic_energy", "J", STORED),
            Diagnostic("damping_power", "W", DISSIPATED),
            Diagnostic("friction_power", "W", DISSIPATED),
            *forces,
            *depths,
        )

    @property
    def states(self) -> tuple[State, ...]:
        """Amplitudes of the rim's modes, and their rates, in units of `UNIT`."""
        labels = [f"{int(n)}{'cs'[int(p)]}" for n, p in zip(self.modes.waves, self.modes.phase)]
        return tuple(State(f"{self.name}.{kind}{label}") for kind in ("q", "v") for label in labels)

    def compiled(self) -> Compiled:
        """Return kernel and tables."""
        from gearmbs.contact import GEAR_CONTACT_SIG, gear_contact
        from gearmbs.contact.elastic_ring_kernel import ring_meshes

        modes, tables = self.modes, [pack(pair) for pair in self.pairs]
        m = modes.mass.size
        unit, square = np.full(m, UNIT), UNIT**2
        reals = [modes.waves, modes.phase, square * modes.mass, unit, square * modes.stiffness.ravel()]
        reals += [square * modes.damping.ravel(), np.array([modes.radius])]
        head: list[int] = [len(self.planets), m]
        # the address of the contact goes before the integers
        at_i, at_r = 3 + 4 * len(tables), 4 * m + 2 * m * m + 1
        found: list[dict[str, Setting]] = []
        for pair, (integers, numbers, _) in zip(self.pairs, tables, strict=True):
            found.append({what: one._replace(at=at_r + one.at) for what, one in law_settings(pair).items()})
            head += [at_i, integers.size, at_r, numbers.size]
            at_i, at_r = at_i + integers.size, at_r + numbers.size
        room = WORK + WORK_A_MODE * m + max(work for _, _, work in tables)
        return Compiled(
            ring_meshes,
            np.concatenate([head, *(i for i, _, _ in tables)]).astype(np.int64),
            np.concatenate([*reals, *(r for _, r, _ in tables)]),
            ((gear_contact, GEAR_CONTACT_SIG),),
            scratch=room,
            settings={
                what: one._replace(others=tuple((other[what].at, other[what].factor, 0.0) for other in found[1:]))
                for what, one in found[0].items()
            },
        )

    def rim_motion(self, solution: Any, angle: float) -> dict[str, np.ndarray]:
        """Return how the rim moves at an angle of the ring, as a sensor that is fixed there sees it.

        Parameters
        ----------
        solution : Solution
        angle : float
            rad, in the ring's axes.

        Returns
        -------
        dict
            ``"radial"`` and ``"tangential"`` displacement, m, ``"radial_velocity"`` and ``"tangential_velocity"``, m/s,
            each of shape (m,).
        """
        count = self.modes.mass.size
        values = UNIT * np.column_stack([solution.state(state.name) for state in self.states])
        w, v = self.modes.shapes(angle)
        q, rates = values[:, :count], values[:, count:]
        return {"radial": q @ w, "tangential": q @ v, "radial_velocity": rates @ w, "tangential_velocity": rates @ v}

    def __repr__(self) -> str:
        return f"RingMeshes({self.name!r}, {len(self.planets)} planets, {self.modes.mass.size} modes of the rim)"


def ring_meshes(
    name: str,
    planets: Sequence[Marker],
    ring: Marker,
    meshes: Sequence[Mesh | IdealMesh],
    rim: ElasticRim,
    spec: GearSpec,
) -> RingMeshes:
    """Return the element of all meshes of planets with a ring whose rim bends.

    Raises
    ------
    ValueError
        For meshes that are no tooth contact.
    """
    pairs = tuple(mesh for mesh in meshes if isinstance(mesh, GearPair))
    if not len(pairs) == len(planets) > 0:
        raise ValueError(
            f"{name}: a rim that bends needs tooth contact with every planet; leave ideal meshes or the rim out"
        )
    return RingMeshes(name, planets[0], ring, tuple(planets), pairs, RimModes.of(rim, spec))
