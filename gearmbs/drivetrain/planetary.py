"""Planetary stages of a drivetrain: a set whose sun, carrier and ring are shafts, a housing or the ground.

Speeds satisfy w_s - w_c = i_0 (w_r - w_c), and torques stand as 1 : (i_0 - 1) : -i_0 on sun, carrier and ring, with
i_0 of `gearmbs.gears.PlanetarySet`. With one member held a stage ties two shafts as a mesh does; with none held two of
the three speeds give the third, and one torque the others.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

import numpy as np
import scipy.linalg

from gearmbs.drivetrain.housing import Housing
from gearmbs.drivetrain.members.carrier import FlexibleCarrier, add_carrier
from gearmbs.drivetrain.members.pins import pin_bearing
from gearmbs.drivetrain.members.rim import check_rim, placed, rim_of
from gearmbs.drivetrain.part import Part, errors_named, require
from gearmbs.drivetrain.parts import contact_law, flank_friction
from gearmbs.drivetrain.shaft import Shaft
from gearmbs.gears.geometry import turn_z
from gearmbs.gears.planetary import planetary
from gearmbs.gears.planetary_mechanism import Members, PinBearing, Support, add_planets, set_masses
from gearmbs.gears.planetary_set import MEMBERS, PlanetarySet
from gearmbs.gears.spec import GearSpec
from gearmbs.schema.described import check_keys
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity, to_si

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain
    from gearmbs.drivetrain.placement import Layout
    from gearmbs.mechanism.mechanism import Mechanism
    from gearmbs.mechanism.parts.bodies import Marker

Station = Annotated[Quantity, Measure("length")]

FREE = 1e-9
"""Part of a motion without a drive that a shaft takes, from which on its speed is not determined: above rounding."""
AGREE = 1e-9
"""Relative difference of speeds that are one, as of meshes."""


@dataclass(frozen=True, kw_only=True)
class PlanetaryStage(Part):
    """A planetary set in a drivetrain.

    Parameters
    ----------
    gears : PlanetarySet
        Its ``rotation`` follows from the drives and loads.
    sun, carrier, ring : str
        The shaft of each member, or what holds it: a housing or "ground". One of them may be held.
    sun_station, carrier_station, ring_station : float or str, optional
        Mid-face of the planets along that shaft, m; default: its middle.
    pins : Support, mapping, str, gearmbs.bearings.Bearing or callable, optional
        Between planets and carrier: springs, or a table of them; a rolling bearing by its designation, itself, or as
        a table with ``rolling`` and settings of `gearmbs.bearings.RollingBearing`; or as of
        `gearmbs.gears.planetary_mechanism`. Default: revolute joints.
    masses : mapping, optional
        Mass, kg, and moments of inertia (or that about the axis), kg m^2, of the wheels "sun", "planet" and "ring" and
        of the "carrier", which its shaft has beside its own; default: those of `gearmbs.gears.planetary_mechanism`.
    carrier_body : FlexibleCarrier or mapping, optional
        How it deforms: a model of finite elements or modes, or how stiff its pins are, as a table of the fields
        of `gearmbs.drivetrain.FlexibleCarrier`. Default: it is rigid.
    rim : gearmbs.gears.ElasticRim or mapping, optional
        How the rim of a ring bends that is held by the ground or a housing, or a table of its fields, its bolts at
        angles about the axis from where the shaft's x axis is at angle zero. Default: it is rigid.

    Raises
    ------
    DrivetrainError
        For pins, masses and rims that are none.
    """

    title: ClassVar[str] = "planetary stage"

    gears: PlanetarySet
    sun: str
    carrier: str
    ring: str
    sun_station: Station = None
    carrier_station: Station = None
    ring_station: Station = None
    pins: Any = None
    masses: Mapping[str, Any] = field(default_factory=dict)  # type: ignore[assignment]
    carrier_body: Any = None
    rim: Any = None

    def __post_init__(self) -> None:
        super().__post_init__()
        require(isinstance(self.gears, PlanetarySet), f"{self.label}: gears is {self.gears!r}; give a PlanetarySet")
        with errors_named(self.label):
            body = self.flexible_carrier
            require(
                body is None or body.model is None or "carrier" not in self.masses,
                "masses has carrier beside a model of it, from which they follow; leave one of them out",
            )
            _ = self.weights
            if self.rim is not None:
                object.__setattr__(self, "rim", rim_of(self.rim, self.gears))
        with errors_named(f"{self.label}: pins"):
            _ = self.on_pins

    @cached_property
    def weights(self) -> dict[str, tuple[float, Any]]:
        """Mass (kg) and moments of inertia (kg m^2) of "sun", "planet", "ring" and "carrier"."""
        found, body = set_masses(self.gears, self.masses), self.flexible_carrier
        return found if body is None else {**found, "carrier": body.mass(found["carrier"])}

    @cached_property
    def flexible_carrier(self) -> FlexibleCarrier | None:
        """How the carrier deforms; None if it is rigid."""
        return None if self.carrier_body is None else FlexibleCarrier.of(self.carrier_body)

    @property
    def carrier_name(self) -> str:
        """Name of the carrier's body where it is one of its own."""
        return f"{self.name} carrier"

    def carrier_apart(self, train: Drivetrain) -> bool:
        """Return whether the carrier is a body of its own: it deforms, or is on a shaft that bends."""
        on = train.parts.get(self.carrier)
        return self.carrier_body is not None or (isinstance(on, Shaft) and on.bends)

    @cached_property
    def on_pins(self) -> Support | PinBearing | None:
        """What is between planets and carrier."""
        return pin_bearing(self.pins)

    @property
    def holders(self) -> dict[str, str]:
        """What each member is on, by "sun", "carrier" and "ring"."""
        return {member: getattr(self, member) for member in MEMBERS}

    @property
    def stations(self) -> dict[str, Any]:
        """Stations of the members as they were given."""
        return {"sun": self.sun_station, "carrier": self.carrier_station, "ring": self.ring_station}

    def station(self, train: Drivetrain, member: str) -> float:
        """Return the station of a member on its shaft, m."""
        given = self.stations[member]
        return 0.5 * train.part(getattr(self, member), Shaft, self.label).length if given is None else given

    def turning(self, train: Drivetrain) -> dict[str, str]:
        """Return the shafts of the members that are on shafts."""
        return {member: on for member, on in self.holders.items() if isinstance(train.parts.get(on), Shaft)}

    def planet(self, number: int) -> str:
        """Return the name of a planet's body, counted from 1."""
        return f"{self.name} planet {number}"

    def pin(self, number: int) -> str:
        """Return the name of a planet's pin, counted from 1."""
        return f"{self.planet(number)} pin"

    def speeds(self, train: Drivetrain) -> dict[str, float]:
        """Return the operating speeds of sun, carrier, ring and planets, rad/s."""
        known = {member: train.speeds.get(on, 0.0) for member, on in self.holders.items()}
        return self.gears.speeds(sun=known["sun"], carrier=known["carrier"]) | known

    def starting(self, train: Drivetrain) -> dict[str, float]:
        """Return the same at the start of a simulation: behind a universal joint all turn at another pace."""
        share, paces = train.start_share, train.layout.paces
        known = {m: share * paces.get(on, 1.0) * train.speeds.get(on, 0.0) for m, on in self.holders.items()}
        return self.gears.speeds(sun=known["sun"], carrier=known["carrier"]) | known

    def sense(self, train: Drivetrain) -> int:
        """Return the sense of rotation about the axis, see `gearmbs.gears.PlanetarySet.sense`."""
        return self.with_rotation(train).sense(self.speeds(train))

    def with_rotation(self, train: Drivetrain) -> PlanetarySet:
        """Return the set with the drive flanks of the operating point: the sun drives if its planets hold it back."""
        on_sun, known = train.nominal_power.members[self.name]["sun"], self.speeds(train)
        turns = -on_sun if on_sun else known["sun"] - known["carrier"]
        return replace(self.gears, rotation=-1 if turns < 0.0 else 1)


def planetary_set(
    table: Mapping[str, Any],
    fault: Callable[[Any], Any] | None,
    *,
    place: str = "planetary",
    contact: str = "kind",
) -> PlanetarySet:
    """Return the set that a table of a file describes: keys of `gearmbs.gears.planetary`.

    Parameters
    ----------
    table : mapping
        ``pin_errors`` by planet from 1; ``faults`` as tables with ``at``; ``contact`` and ``friction`` as tables.
    fault : callable, optional
        Makes a fault of a table; without it there cannot be faults.
    place : str
        What messages call the table.
    contact : str
        Key that names the law in the table of the contact.

    Raises
    ------
    ValueError
        For unknown keys, and values that do not make a set.
    """
    table = dict(table)
    check_keys(table, SET_KEYS, "", ValueError, form=f"unknown key {place}.{{}}")
    for name in ("teeth", "module"):
        if name not in table:
            raise ValueError(f"{place}.{name} is missing")
    if "pin_errors" in table:
        # a planet's number, from 1, and how far its pin is off
        table["pin_errors"] = {
            int(k) - 1: tuple(to_si(v, "length", f"{place}.pin_errors.{k}") for v in pair)
            for k, pair in table["pin_errors"].items()
        }
    for name in ("ideal", "teeth", "profile_shifts"):
        if name in table:
            table[name] = tuple(table[name])
    if "contact" in table:
        table["contact"] = contact_law(table["contact"], contact)
    if "friction" in table:
        table["friction"] = flank_friction(table["friction"])
    if isinstance(table.get("planet_at_ring"), Mapping):
        table["planet_at_ring"] = GearSpec(**{"name": "planet at ring", **table["planet_at_ring"]})
    places = []
    for one in table.pop("faults", ()):
        require(fault is not None, f"{place}: faults cannot be read here; run the file with gearmbs run")
        assert fault is not None
        one = dict(one)
        where = str(one.pop("at", ""))
        places.append((where, fault(one)))
    return planetary(faults=tuple(places), **table)


SET_KEYS = (
    *list(inspect.signature(planetary).parameters)[:-1],
    *(f.name for f in fields(PlanetarySet) if f.name not in ("sun", "planet", "ring", "planets")),
)
"""Keys of a set in a file."""
STAGE_KEYS = (*MEMBERS, *(f"{member}_station" for member in MEMBERS), "pins", "masses", "carrier_body", "rim")
"""Keys of a stage in a file beside those of its set."""


# Its meshes, among those of the drivetrain.


class Meshing(NamedTuple):
    """Two wheels in mesh, of a `GearMesh` or of a planetary stage.

    Attributes
    ----------
    name : str
        Of the contact in the mechanism.
    bodies : (str, str)
        What carries the driver and the driven wheel: shafts, planets, a housing or "ground".
    gears : (GearSpec, GearSpec)
    carrier : str
        What carries the axes of planets; empty of wheels whose axes stand.
    stage : str
        The planetary stage; empty of others.
    group : str
        The mesh, or all those of a stage with its sun or with its ring.
    """

    name: str
    bodies: tuple[str, str]
    gears: tuple[GearSpec, GearSpec]
    carrier: str = ""
    stage: str = ""
    group: str = ""


def meshings(train: Drivetrain) -> tuple[Meshing, ...]:
    """Return all meshes of a drivetrain, those of its planetary stages behind the others."""
    out = []
    for mesh in train.meshes:
        driver, driven = train.wheels_of(mesh)
        shafts, gears = (driver.shaft, driven.shaft), (driver.gear, driven.gear)
        out.append(Meshing(mesh.name, shafts, gears, group=mesh.name))
    for stage in train.planetary_stages:
        found = stage.gears
        wheels = {"sun": (found.sun, found.planet), "ring": (found.planet_at_ring or found.planet, found.ring)}
        for side, (one, two) in wheels.items():
            for k in range(1, found.planets + 1):
                planet = stage.planet(k)
                name = f"{stage.name} sun-planet {k}" if side == "sun" else f"{planet}-ring"
                bodies = (stage.sun, planet) if side == "sun" else (planet, stage.ring)
                out.append(Meshing(name, bodies, (one, two), stage.carrier, stage.name, f"{stage.name} {side}"))
    return tuple(out)


def stage_pairs(train: Drivetrain) -> dict[str, Any]:
    """Return the pairs of all meshes of planetary stages, by name."""
    out = {}
    for stage in train.planetary_stages:
        with errors_named(stage.label):
            gears = stage.with_rotation(train)
            for k, (to_sun, to_ring) in enumerate(zip(gears.meshes("sun"), gears.meshes("ring")), start=1):
                out[f"{stage.name} sun-planet {k}"] = to_sun
                out[f"{stage.planet(k)}-ring"] = to_ring
    return out


class Carried(NamedTuple):
    """A wheel, or a carrier, on a shaft: station (m), mass (kg), moments about x, y and z (kg m^2)."""

    name: str
    station: float
    mass: float
    inertia: tuple[float, ...]


def carried(train: Drivetrain, shaft: str) -> list[Carried]:
    """Return the masses that a shaft has of what stands on it: not of wheels that deform, which are bodies."""
    own = {wheel.name for wheel in train.wheels if wheel.body is not None}
    return [one for one in standing(train, shaft) if one.name not in own]


def standing(train: Drivetrain, shaft: str) -> list[Carried]:
    """Return what stands on a shaft: wheels, and members of planetary stages."""
    out = [Carried(w.name, train.station(w), w.weight[0], w.weight[1]) for w in train.wheels if w.shaft == shaft]
    for stage in train.planetary_stages:
        for member, on in stage.holders.items():
            # a carrier that deforms, or on a shaft that bends, is a body of its own
            if on == shaft and not (member == "carrier" and stage.carrier_apart(train)):
                mass, moments = stage.weights[member]
                out.append(Carried(f"{stage.name} {member}", stage.station(train, member), mass, tuple(moments)))
    return out


# What is refused.


def check_stage(train: Drivetrain, stage: PlanetaryStage) -> None:
    """Refuse members that nothing can be.

    Raises
    ------
    DrivetrainError
    """
    for member, on in stage.holders.items():
        given = stage.stations[member]
        part: Part | None = None if on == "ground" else train.part(on, None, f"{stage.label}: {member}")
        require(
            isinstance(part, Shaft) or given is None,
            f"{stage.label}: {member}_station is given, but {member} is on no shaft: '{on}'; leave it out",
        )
        if part is None:
            continue
        require(
            isinstance(part, Shaft | Housing),
            f"{stage.label}: {member} is '{on}', a {part.title}; give a shaft, a housing or 'ground'",
        )
        require(
            isinstance(part, Shaft) or member not in stage.masses,
            f"{stage.label}: masses has {member}, which is on {part.label}: add it to the housing's own mass and "
            "inertia, and leave it out here",
        )
        require(
            member == "ring" or not isinstance(part, Housing) or part.model is None,
            f"{stage.label}: {member} is on {part.label}, a model of finite elements or modes, which has a seat for a "
            "ring only; give 'ground', a rigid housing, or a shaft in that housing",
        )
        if isinstance(part, Shaft):
            place = stage.station(train, member)
            require(
                0.0 <= place <= part.length,
                f"{stage.label}: {member}_station {1e3 * place:.6g} mm is not on {part.label}, which is "
                f"{1e3 * part.length:.6g} mm long",
            )
    turning = stage.turning(train)
    held = [member for member in MEMBERS if member not in turning]
    require(
        len(held) < 2,
        f"{stage.label}: {' and '.join(held)} are held, so that nothing can turn; put one of them on a shaft",
    )
    require(
        len(set(turning.values())) == len(turning),
        f"{stage.label}: members are on one shaft ({', '.join(f'{m} on {on!r}' for m, on in turning.items())}); give "
        "each a shaft of its own",
    )
    if stage.rim is not None:
        check_rim(stage.label, stage.ring, turns="ring" in turning)


# Speeds and torques of stages none of whose members is held.


def differentials(train: Drivetrain) -> list[PlanetaryStage]:
    """Return the stages none of whose members is held."""
    return [stage for stage in train.planetary_stages if len(stage.turning(train)) == len(MEMBERS)]


def held_ratio(train: Drivetrain, stage: PlanetaryStage) -> tuple[str, str, float] | None:
    """Return two shafts and the speed of the second over that of the first; None if no member is held."""
    turning = stage.turning(train)
    if len(turning) != 2:
        return None
    one, two = turning
    held = next(member for member in MEMBERS if member not in turning)
    return turning[one], turning[two], stage.gears.speeds(**{one: 1.0, held: 0.0})[two]


def _willis(train: Drivetrain, stage: PlanetaryStage, place: Mapping[str, int]) -> np.ndarray:
    """Return the row over the shafts that their speeds make zero; torques on them are in proportion to it."""
    row = np.zeros(len(place))
    for member, torque in stage.gears.torques(sun=1.0).items():
        row[place[getattr(stage, member)]] += torque
    return row


def speed_rows(
    train: Drivetrain, links: list[Any], place: Mapping[str, int], shares: Mapping[str, float] | None = None
) -> list[np.ndarray]:
    """Return rows over the shafts that their speeds make zero, ``shares`` times the ratios of links by name."""
    rows = [_willis(train, stage, place) for stage in differentials(train)]
    for link in links:
        row = np.zeros(len(place))
        row[place[link.second]], row[place[link.first]] = 1.0, -link.ratio * (shares or {}).get(link.name, 1.0)
        rows.append(row)
    return rows


def with_differentials(train: Drivetrain, links: list[Any], speeds: dict[str, float]) -> dict[str, float]:
    """Return the speeds of all shafts, those behind stages without a held member among them.

    Raises
    ------
    DrivetrainError
        If two of three members do not get speeds, or all three do and contradict each other.
    """
    stages = differentials(train)
    if not stages:
        return speeds
    place = {shaft.name: k for k, shaft in enumerate(train.shafts)}
    rows = speed_rows(train, links, place)
    a = np.array(rows)
    known = np.array([name in speeds for name in place])
    turned = np.array([speeds.get(name, 0.0) for name in place])
    turned[~known] = np.linalg.lstsq(a[:, ~known], -a[:, known] @ turned[known], rcond=None)[0]
    loose = np.zeros((len(place), 0))
    if not known.all():
        null = scipy.linalg.null_space(a[:, ~known])
        loose = np.zeros((len(place), null.shape[1]))
        loose[~known] = null
    for stage, row in zip(stages, rows):
        at = [place[on] for on in stage.holders.values()]
        require(
            not np.any(np.abs(loose[at]) > FREE),
            f"{stage.label}: the drives do not say how fast its members turn; drive two of the shafts "
            f"{', '.join(map(repr, stage.holders.values()))}, or hold one of them",
        )
        require(
            abs(row @ turned) <= AGREE * float(np.abs(row * turned).max(initial=0.0)),
            f"{stage.label}: its members would turn at {', '.join(f'{v:.6g}' for v in turned[at])} rad/s (sun, "
            "carrier, ring), which its teeth do not allow; leave a drive out, or change the teeth",
        )
    return {name: float(turned[k]) for name, k in place.items()}


def columns_of(train: Drivetrain, links: list[Any]) -> list[np.ndarray]:
    """Return the torques on all shafts that go with one on the second shaft of each link, and with one of each stage.

    Of stages without a held member, with a unit torque on the sun; each shape (shafts,).
    """
    place = {shaft.name: k for k, shaft in enumerate(train.shafts)}
    columns: list[np.ndarray] = []
    for link in links:
        column = np.zeros(len(place))
        column[place[link.second]] += 1.0
        column[place[link.first]] -= link.ratio
        columns.append(column)
    return columns + [_willis(train, stage, place) for stage in differentials(train)]


def balanced_torques(
    train: Drivetrain, links: list[Any], applied: Mapping[str, float]
) -> tuple[dict[str, tuple[float, float]], dict[str, dict[str, float]], dict[str, float]]:
    """Return the torques with which every shaft is in equilibrium, where stages have no held member.

    Of what closes a chain, and of drives beyond those that are needed, the last carry nothing.

    Returns
    -------
    links : dict of str to (float, float)
        On the first and the second shaft of each link.
    members : dict of str to dict of str to float
        On sun, carrier and ring of each stage without a held member.
    drives : dict of str to float
    """
    place = {shaft.name: k for k, shaft in enumerate(train.shafts)}
    stages = differentials(train)
    columns = columns_of(train, links)
    for drive in train.drives:
        columns.append(np.eye(len(place))[place[drive.shaft]])
    # a column that follows from those before it is left out
    used: list[int] = []
    for k in range(len(columns)):
        if np.linalg.matrix_rank(np.array([columns[j] for j in (*used, k)])) > len(used):
            used.append(k)
    size = np.zeros(len(columns))
    wanted = -np.array([applied[name] for name in place])
    size[used] = np.linalg.lstsq(np.array([columns[k] for k in used]).T, wanted, rcond=None)[0]
    on_links = {link.name: (float(-link.ratio * x), float(x)) for link, x in zip(links, size)}
    of_stages, of_drives = size[len(links) : len(links) + len(stages)], size[len(links) + len(stages) :]
    members = {
        stage.name: {m: float(x) * t for m, t in stage.gears.torques(sun=1.0).items()}
        for stage, x in zip(stages, of_stages)
    }
    return on_links, members, {drive.name: float(x) for drive, x in zip(train.drives, of_drives)}


def member_torques(train: Drivetrain, torques: Mapping[str, tuple[float, float]]) -> dict[str, dict[str, float]]:
    """Return the torques of the planets on sun, carrier and ring of stages with a held member, N m."""
    out = {}
    for stage in train.planetary_stages:
        turning = list(stage.turning(train))
        if stage.name in torques and len(turning) == 2:
            out[stage.name] = stage.gears.torques(**{turning[1]: torques[stage.name][1]})
    return out


# Places at the start, and the mechanism.


def assemble_stage(
    train: Drivetrain, stage: PlanetaryStage, angles: dict[str, float], wheels: dict[str, float | None]
) -> None:
    """Turn the planets and the ring of a stage so that all drive flanks touch.

    Parameters
    ----------
    angles : dict
        Of shafts about their axes, rad; planets are added.
    wheels : dict
        Angles of wheels against their shafts, rad; the ring is added, its own against the housing or the ground.
    """
    carrier = angles.get(stage.carrier, 0.0)
    found = stage.with_rotation(train).start_angles(angles.get(stage.sun, 0.0) - carrier)
    for k, angle in enumerate(found["planets"], start=1):
        angles[stage.planet(k)] = carrier + float(angle)
    wheels[f"{stage.name} ring"] = carrier + found["ring"] - angles.get(stage.ring, 0.0)
    for k, step in enumerate(found["steps"], start=1):
        wheels[stage.planet(k)] = float(step)


def add_stage(m: Mechanism, train: Drivetrain, layout: Layout, stage: PlanetaryStage) -> None:
    """Add planets, pins and meshes of a stage to the mechanism of its drivetrain."""
    member, shaft = next(iter(stage.turning(train).items()))
    seat = layout.seats[shaft]
    origin, axes = seat.at(stage.station(train, member)), seat.axes
    turns = stage.starting(train)
    carrier_angle = layout.angles.get(stage.carrier, 0.0)

    def wheel(member: str, angle: float) -> Marker:
        on = getattr(stage, member)
        body = m.ground if on == "ground" else m.bodies[on]
        name = f"{stage.name} {member}"
        turned = axes @ turn_z(angle + layout.angles.get(on, 0.0))
        return body.marker_at(origin, turned, name=name)

    planets = [stage.planet(k) for k in range(1, stage.gears.planets + 1)]
    start = {
        "planets": np.array([layout.angles[planet] - carrier_angle for planet in planets]),
        "steps": np.array([layout.wheels[planet] for planet in planets]),
    }
    ring = wheel("ring", layout.wheels[f"{stage.name} ring"])
    rim = placed(stage.rim, layout.wheels[f"{stage.name} ring"] + layout.angles.get(stage.ring, 0.0))
    carrier, sense = add_carrier(m, train, stage, origin, axes, carrier_angle), stage.sense(train)
    members = Members(wheel("sun", 0.0), carrier, ring, origin, axes, carrier_angle, f"{stage.name} ", sense)
    with errors_named(stage.label):
        gears = stage.with_rotation(train)
        add_planets(m, gears, members, start, stage.weights["planet"], turns, stage.on_pins, rim)
