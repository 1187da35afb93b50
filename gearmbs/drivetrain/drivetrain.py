"""The drivetrain: shafts, wheels, meshes, bearings, couplings, housings, drives, loads and sensors by name.

Files and nested tables that describe one are read by `gearmbs.drivetrain.description`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, TypeVar, Unpack

from gearmbs._lazy import Guessed
from gearmbs.drivetrain.connections import Bearing
from gearmbs.drivetrain.couplings.aligned import Coupling
from gearmbs.drivetrain.drives import Drive, SpeedDrive
from gearmbs.drivetrain.housing import Housing
from gearmbs.drivetrain.loads import Load
from gearmbs.drivetrain.on_shafts import unfolded
from gearmbs.drivetrain.part import DrivetrainError, Part, parts_html, require
from gearmbs.drivetrain.parts import GearMesh, Sensor, Wheel
from gearmbs.drivetrain.planetary import (
    Meshing,
    PlanetaryStage,
    meshings,
    stage_pairs,
)
from gearmbs.drivetrain.shaft import Shaft
from gearmbs.gears.spec import GearSpec
from gearmbs.wording import did_you_mean

if TYPE_CHECKING:
    from gearmbs.drivetrain.kinematics import KinematicTable
    from gearmbs.drivetrain.placement import Layout
    from gearmbs.drivetrain.static.flow import PowerFlow
    from gearmbs.drivetrain.static.rest import Rest
    from gearmbs.drivetrain.torsional import MeshDynamics, TorsionalModel, TorsionalSpring
    from gearmbs.flexible import ModalModel
    from gearmbs.gears.spec import GearSpec
    from gearmbs.mechanism.mechanism import Mechanism
    from gearmbs.mechanism.solve.plants import LinearPlant

P = TypeVar("P", bound=Part)

KINDS: dict[str, type[Part]] = {
    "shafts": Shaft, "wheels": Wheel, "meshes": GearMesh, "bearings": Bearing, "couplings": Coupling,
    "housings": Housing, "drives": Drive, "loads": Load, "sensors": Sensor, "planetary_stages": PlanetaryStage,
}  # fmt: skip
"""What each group holds."""


class DrivetrainKeywords(TypedDict, total=False):
    """Fields of a `Drivetrain`, for type checkers."""

    name: str
    shafts: Sequence[Shaft]
    wheels: Sequence[Wheel]
    meshes: Sequence[GearMesh]
    bearings: Sequence[Bearing]
    couplings: Sequence[Coupling]
    housings: Sequence[Housing]
    drives: Sequence[Drive]
    loads: Sequence[Load]
    sensors: Sequence[Sensor]
    planetary_stages: Sequence[PlanetaryStage]
    gravity: tuple[float, float, float]
    run_up: float
    running: bool


@dataclass(frozen=True)
class Drivetrain(Guessed):
    """Shafts, the wheels on them, and all that holds, turns and loads them; see `gearmbs.drivetrain`.

    Every part has a name. Where shafts are, how wheels are turned at the start, which way and how fast everything
    turns and which flanks drive follows from the meshes, couplings, drives and loads. All of it is checked when the
    drivetrain is made, before anything is compiled.

    Parameters
    ----------
    name : str
    shafts, wheels, meshes, bearings, couplings, housings, drives, loads, sensors, planetary_stages : sequence
        The parts.
    gravity : sequence of 3 floats
        m/s^2, global components.
    run_up : float
        Duration of the STEP over which speeds and loads come on, s; fans and drag are what the speed makes them.
    running : bool
        Whether the shafts turn at their operating speeds from the start; else from rest.

    Raises
    ------
    DrivetrainError
        For a part of an unknown or doubtful name, chains that do not close, wheels that do not mesh or run through
        shafts or other wheels, two speeds for one shaft, loads that nothing drives, shafts that nothing holds.

    Examples
    --------
    >>> from gearmbs.drivetrain import (
    ...     Drivetrain, GearMesh, IdealBearing, Shaft, SpeedDrive, TorqueLoad, Wheel,
    ... )
    >>> from gearmbs.gears import GearSpec
    >>> train = Drivetrain(
    ...     "one stage",
    ...     shafts=[Shaft(name="in"), Shaft(name="out")],
    ...     wheels=[
    ...         Wheel(name="pinion", shaft="in", gear=GearSpec(20, "3 mm")),
    ...         Wheel(name="gear", shaft="out", gear=GearSpec(60, "3 mm")),
    ...     ],
    ...     meshes=[GearMesh(name="stage", driver="pinion", driven="gear", settings={"backlash": "0.1 mm"})],
    ...     bearings=[IdealBearing(name="a", shaft="in"), IdealBearing(name="b", shaft="out")],
    ...     drives=[SpeedDrive(name="motor", shaft="in", speed="1500 rpm")],
    ...     loads=[TorqueLoad(name="brake", shaft="out", torque="300 N m")],
    ... )
    >>> round(train.kinematics.mesh_frequency("stage"), 6)
    500.0
    """

    name: str = "drivetrain"
    shafts: Sequence[Shaft] = ()
    wheels: Sequence[Wheel] = ()
    meshes: Sequence[GearMesh] = ()
    bearings: Sequence[Bearing] = ()
    couplings: Sequence[Coupling] = ()
    housings: Sequence[Housing] = ()
    drives: Sequence[Drive] = ()
    loads: Sequence[Load] = ()
    sensors: Sequence[Sensor] = ()
    planetary_stages: Sequence[PlanetaryStage] = ()
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    run_up: float = 0.05
    running: bool = False
    parts: Mapping[str, Part] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for group, found in unfolded(self).items():
            object.__setattr__(self, group, found)
        known: dict[str, Part] = {}
        for group, kind in KINDS.items():
            object.__setattr__(self, group, tuple(getattr(self, group)))
            for part in getattr(self, group):
                require(isinstance(part, kind), f"{self.name}: {group} holds {part!r}; give objects of {kind.__name__}")
                require(
                    part.name not in known and part.name != "ground",
                    f"{part.label}: the name is in use; choose another",
                )
                known[part.name] = part
        object.__setattr__(self, "parts", known)
        require(self.run_up > 0.0, f"{self.name}: run_up is {self.run_up:g} s; it must be positive")
        from gearmbs.drivetrain.build import check

        check(self)

    def with_parts(self, *parts: Part) -> Drivetrain:
        """Return a drivetrain with these parts; parts whose names are there take the place of those."""
        groups: dict[str, Any] = {group: list(getattr(self, group)) for group in KINDS}
        for part in parts:
            group = next((g for g, kind in KINDS.items() if isinstance(part, kind)), None)
            require(group is not None, f"{part!r} is no part of a drivetrain")
            assert group is not None
            names = [p.name for p in groups[group]]
            if part.name in names:
                groups[group][names.index(part.name)] = part
            else:
                groups[group].append(part)
        return replace(self, **groups)

    # of which kind the part is, and so which fields it has, follows from its name
    def changed(self, name: str, **fields: Any) -> Drivetrain:
        """Return a drivetrain with fields of one part changed; of a mesh, ``settings`` are merged.

        Sections of a shaft take the place of its length and diameter, and the other way.
        """
        part: Part = self.part(name)
        if isinstance(part, GearMesh) and "settings" in fields:
            fields["settings"] = {**part.settings, **fields["settings"]}
        if isinstance(part, Shaft):
            fields = part.changed_fields(fields)
        return self.with_parts(replace(part, **fields))

    # --- access by name -----------------------------------------------------------------------------

    def part(self, name: str, kind: type[P] | None = None, asked_by: str = "") -> P:
        """Return the part of a name.

        Raises
        ------
        DrivetrainError
            If there is none, or it is of another kind.
        """
        found = self.parts.get(name)
        if found is None or (kind is not None and not isinstance(found, kind)):
            names = [n for n, p in self.parts.items() if kind is None or isinstance(p, kind)]
            hint = did_you_mean(name, names, shown=repr, otherwise=f"known ones are {', '.join(names) or 'none'}")
            what = "part" if kind is None else kind.title
            raise DrivetrainError(f"{asked_by or self.name}: there is no {what} '{name}'; {hint}")
        return found  # type: ignore[return-value]

    def wheels_of(self, mesh: str | GearMesh) -> tuple[Wheel, Wheel]:
        """Return driver and driven wheel of a mesh."""
        one = self.part(mesh, GearMesh) if isinstance(mesh, str) else mesh
        return self.part(one.driver, Wheel, one.label), self.part(one.driven, Wheel, one.label)

    @cached_property
    def meshings(self) -> tuple[Meshing, ...]:
        """All pairs of wheels in mesh, those of planetary stages among them; see `gearmbs.drivetrain.planetary`."""
        return meshings(self)

    @property
    def planets(self) -> dict[str, PlanetaryStage]:
        """The bodies of all planets, by name, with their stage."""
        stages = self.planetary_stages
        return {stage.planet(k): stage for stage in stages for k in range(1, stage.gears.planets + 1)}

    @property
    def pins(self) -> dict[str, tuple[PlanetaryStage, float]]:
        """Stage and angle on the carrier (rad) of the pin of each planet, by the pin's name."""
        return {
            stage.pin(k): (stage, float(angle))
            for stage in self.planetary_stages
            for k, angle in enumerate(stage.gears.angles or (), start=1)
        }

    def station(self, part: Any, default: Literal["left", "middle", "right"] = "middle") -> float:
        """Return the station of a part on its shaft, m."""
        if part.station is not None:
            return part.station
        length = self.part(part.shaft, Shaft, part.label).length
        return {"left": 0.0, "middle": 0.5 * length, "right": length}[default]

    def carrier(self, part: Any, default: str | None = None) -> str:
        """Return the name of what carries a bearing or takes a reaction: a housing, a shaft or "ground"."""
        if part.on is not None:
            return part.on
        if default is not None:
            return default
        return self.housings[0].name if len(self.housings) == 1 else "ground"

    # --- what follows -------------------------------------------------------------------------------

    @cached_property
    def speeds(self) -> dict[str, float]:
        """Operating speed of each shaft about its own z axis, rad/s; zero for those that nothing drives."""
        from gearmbs.drivetrain.kinematics import operating_speeds

        return operating_speeds(self)

    @cached_property
    def nominal_power(self) -> PowerFlow:
        """Torques at the operating point, branches of closed chains sharing as equal teeth do; picks drive flanks."""
        from gearmbs.drivetrain.static.flow import power_flow

        return power_flow(self)

    @cached_property
    def at_rest(self) -> Rest:
        """Torques of meshes, forces of bearings and tilts of wheels in the loaded position of rest."""
        from gearmbs.drivetrain.static.rest import position_of_rest

        return position_of_rest(self)

    @cached_property
    def power(self) -> PowerFlow:
        """Torques that the meshes and couplings transmit at the operating point, and who pushes.

        Branches of closed chains share as in the loaded position of rest.

        Warns
        -----
        UserWarning
            Where a closed chain has none, so that its branches share as equal teeth do.
        """
        from gearmbs.drivetrain.static.flow import loaded_flow

        return loaded_flow(self)

    @cached_property
    def pairs(self) -> dict[str, Any]:
        """The pair of each mesh, by name, with its drive flank and torque; those of planetary stages, too."""
        out = {}
        for mesh in self.meshes:
            driver, driven = self.wheels_of(mesh)
            sense = self.nominal_power.rotation(mesh.name)
            out[mesh.name] = mesh.make(driver.gear, driven.gear, sense, self.nominal_power.on_driven(mesh.name))
        return out | stage_pairs(self)

    @cached_property
    def turning(self) -> dict[str, float]:
        """Operating speed of each shaft and planet about its axis, rad/s."""
        planets = {name: stage.speeds(self)["planet"] for name, stage in self.planets.items()}
        return {**self.speeds, **planets}

    def against_carrier(self, meshing: Meshing, end: int = 0) -> float:
        """Return the speed of the driver (0) or the driven wheel (1) of a mesh against what carries the axes, rad/s."""
        return self.turning.get(meshing.bodies[end], 0.0) - self.turning.get(meshing.carrier, 0.0)

    @cached_property
    def senses(self) -> dict[str, int]:
        """Sense of each tapered roller and angular contact bearing, by name; see `gearmbs.drivetrain.on_shafts`."""
        from gearmbs.drivetrain.on_shafts import senses

        return senses(self)

    @cached_property
    def modal_models(self) -> dict[str, ModalModel]:
        """Bodies with modes of the shafts and housings that deform, by name; see `gearmbs.drivetrain.bodies`."""
        from gearmbs.drivetrain.bodies import modal_models

        return modal_models(self)

    def of_same_bodies(self, **changes: Unpack[DrivetrainKeywords]) -> Drivetrain:
        """Return a drivetrain with other drives, loads or meshes, whose bodies that deform are not made again."""
        out = replace(self, **changes)
        if "modal_models" in self.__dict__:
            out.__dict__["modal_models"] = self.modal_models
        return out

    @cached_property
    def layout(self) -> Layout:
        """Where the shafts are and how they are turned at the start, flanks touching."""
        from gearmbs.drivetrain.placement import assembled

        return assembled(self)

    @cached_property
    def kinematics(self) -> KinematicTable:
        """Speeds, mesh, shaft, hunting-tooth and bearing frequencies, and expected sidebands."""
        from gearmbs.drivetrain.kinematics import KinematicTable

        return KinematicTable(self)

    def torsional(self) -> TorsionalModel:
        """Return the chain of inertias and torsional springs of this drivetrain: rigid bodies that only turn.

        Warns
        -----
        UserWarning
            Of meshes that are damped above critical, of misaligned ones without load, and of those that carry nothing
            by a law that has no stiffness then.
        """
        from gearmbs.drivetrain.torsional import torsional_model, warn_of_idle_meshes, warn_of_overdamped_meshes

        warn_of_overdamped_meshes(self)
        warn_of_idle_meshes(self)
        return torsional_model(self)

    @cached_property
    def mesh_springs(self) -> dict[str, TorsionalSpring]:
        """Each mesh as a spring of the torsional chain, by name; see `gearmbs.drivetrain.torsional`."""
        from gearmbs.drivetrain.torsional import mesh_springs

        return mesh_springs(self)

    def _laws(self) -> dict[str, str]:
        """Contact law of each mesh in words, by name; tells without the springs, which may need compiled contacts."""
        from gearmbs.drivetrain.torsional import mesh_law

        return {mesh.group: mesh_law(self, mesh.name) for mesh in reversed(self.meshings)}

    @cached_property
    def mesh_dynamics(self) -> dict[str, MeshDynamics]:
        """Contact law, mean stiffness and damping, reduced mass, frequency and damping ratio of each mesh, by name."""
        from gearmbs.drivetrain.torsional import mesh_dynamics

        return mesh_dynamics(self)

    def build(self) -> Mechanism:
        """Return the drivetrain as an ordinary mechanism, to which anything may be added.

        Returns
        -------
        Mechanism
            A body for each shaft (with its wheels) and housing, under its name; a marker for each wheel; joints and
            force elements under the names of bearings, couplings, meshes, drives and loads.

        Warns
        -----
        UserWarning
            Of drives that cannot carry the loads, of loads by points whose curve leaves them by far or is asked beyond
            them, of torques on shafts whose speed is prescribed, of torques of a running train that do not begin
            together, of shafts that are counted twice in wheels without a bore, of sizes that do not fit each other,
            and of numbers whose units were hardly meant.
        """
        from gearmbs.drivetrain.build import build
        from gearmbs.drivetrain.kinematics import warn_of_lost_torques, warn_of_tables, warn_of_weak_drives
        from gearmbs.drivetrain.loads import warn_of_drift
        from gearmbs.drivetrain.static.doubts import warn_of_doubts

        warn_of_doubts(self)
        warn_of_tables(self)
        if self.running:
            warn_of_drift(self.drives, self.loads, self.run_up)
        warn_of_weak_drives(self)
        warn_of_lost_torques(self)
        return build(self)

    def linearize(
        self, inputs: Sequence[Any], outputs: Sequence[Any], *, at: Any = "loaded", t: float | None = None
    ) -> LinearPlant:
        """Return the linear plant x' = A x + B u, y = C x + D u of this drivetrain.

        Parameters
        ----------
        inputs : sequence
            As of `gearmbs.mechanism.linearize`, and ``("torque", shaft)`` about the shaft's own axis. Of the inputs
            in drives and loads, "loaded" keeps those that are their torque.
        outputs : sequence
            As of `gearmbs.mechanism.linearize`, the names of sensors, and ``("speed", shaft)``, ``("angle", shaft)``
            about its own axis. Directions of sensors are those of the operating point.
        at : {"loaded", "initial", "equilibrium"}, StaticResult, State or Solution
            Operating point; "loaded": at rest under the torques of the operating point, as its modes are, friction and
            the slopes of motors and loads over their speeds left out. A solution, or its state, has all of them.
        t : float, optional
            As of `gearmbs.mechanism.linearize`.

        Raises
        ------
        ModelError, DrivetrainError
            As of `gearmbs.mechanism.linearize`, and for unknown shafts.
        """
        from gearmbs.drivetrain.plants import linearize

        return linearize(self, inputs, outputs, at, t)

    @classmethod
    def from_file(cls, path: str | Path) -> Drivetrain:
        """Read a drivetrain from a TOML file; see `gearmbs.drivetrain.description`."""
        from gearmbs.drivetrain.description import read_description

        return read_description(path).train

    @property
    def start_share(self) -> float:
        """Speed of the shafts at the start over the operating speed: 0 from rest, 1 of a train that runs already."""
        if not self.running:
            return 0.0
        return min((d.start_share for d in self.drives if isinstance(d, SpeedDrive)), default=1.0)

    @property
    def changes_speed(self) -> bool:
        """Whether a drive follows a curve: a run-up or coast-down."""
        return any(isinstance(d, SpeedDrive) and d.curve is not None for d in self.drives)

    @property
    def rate_scale(self) -> float:
        """Angular frequency of interest, the fastest mesh or else shaft, rad/s: for ``simulate(rate_scale=...)``."""
        teeth: list[tuple[str, GearSpec]] = [(w.shaft, w.gear) for w in self.wheels]
        fastest = [abs(self.speeds[shaft]) * gear.teeth for shaft, gear in teeth]
        fastest += [abs(self.against_carrier(m)) * m.gears[0].teeth for m in self.meshings if m.stage]
        return max([1.0, *(fastest or map(abs, self.speeds.values()))])

    def _repr_html_(self) -> str:
        parts = (part for group in KINDS for part in getattr(self, group))
        return parts_html(self.name, parts, self._laws()) + self.kinematics.to_html()

    def __repr__(self) -> str:
        counts = [(len(getattr(self, g)), g) for g in KINDS if getattr(self, g)]
        said = [f"{n} {KINDS[g].title if n == 1 else g}" for n, g in counts]
        by_law: dict[str, list[str]] = {}
        for name, law in self._laws().items():
            by_law.setdefault(law, []).append(name)
        said += [f"{', '.join(names)}: {law}" for law, names in by_law.items()]
        return f"Drivetrain({self.name!r}: {'; '.join([', '.join(said[: len(counts)]), *said[len(counts) :]])})"
