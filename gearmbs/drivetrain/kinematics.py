"""The kinematic table of a drivetrain: speeds, and all frequencies that a record of it can be expected to hold."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict

from gearmbs.drivetrain.couplings.misaligned import UniversalJoint
from gearmbs.drivetrain.drives import Drive, SpeedDrive
from gearmbs.drivetrain.loads import RPM, Drag, Load, TableLoad
from gearmbs.drivetrain.part import DrivetrainError, require
from gearmbs.drivetrain.parts import GearMesh
from gearmbs.drivetrain.planetary import (
    Meshing,
    PlanetaryStage,
    held_ratio,
    with_differentials,
)
from gearmbs.drivetrain.shaft import Shaft
from gearmbs.units import Quantity, to_si
from gearmbs.wording import warn

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.drivetrain.drivetrain import Drivetrain

HZ = 2.0 * math.pi


class BearingsAndShafts(TypedDict):
    """What `gearmbs.signals.diagnose_bearing` takes: bearings with ratios, rad/s of the reference, other ratios."""

    bearing: dict[str, tuple[Any, float]]
    speed: float
    shafts: list[float]


class KinematicTable:
    """Speeds and frequencies of a drivetrain at its operating speed.

    With the wheels' teeth z_1, z_2 and the shafts' speeds relative to the axes' carrier (here fixed), f_m = z_1 f_1 =
    z_2 f_2; the same two teeth meet f_m gcd(z_1, z_2) / (z_1 z_2) times a second (hunting-tooth frequency). A deviation
    of a wheel on shaft i modulates its meshes: sidebands h f_m +- k f_i. Bearings: see
    `gearmbs.bearings.Bearing.multiples`, times the speed of the shaft against what carries it.

    Parameters
    ----------
    train : Drivetrain
    """

    def __init__(self, train: Drivetrain) -> None:
        self.train = train

    @property
    def speeds(self) -> dict[str, float]:
        """Speed of each shaft about its own z axis, rad/s."""
        return self.train.speeds

    def shaft_frequency(self, shaft: str) -> float:
        """Return the turns of a shaft a second, Hz, not negative."""
        return abs(self.speeds[shaft]) / HZ

    def ratio(self, first: str, second: str) -> float:
        """Return the speed of one shaft over that of another, with its sign."""
        return self.speeds[first] / self.speeds[second]

    def mesh_frequency(self, mesh: str) -> float:
        """Return the mesh frequency of a mesh, Hz; of a planetary stage that of the sun's, against the carrier."""
        one = self._meshing(mesh)
        return one.gears[0].teeth * abs(self.train.against_carrier(one)) / HZ

    def _meshing(self, mesh: str) -> Meshing:
        """Return the mesh of a name; of a stage, or its side, that of planet 1."""
        for one in self.train.meshings:
            if mesh in (one.name, one.group, one.stage):
                return one
        known = ", ".join(dict.fromkeys(one.group for one in self.train.meshings))
        raise DrivetrainError(f"{self.train.name}: there is no mesh '{mesh}'; known ones are {known or 'none'}")

    def _modulations(self, mesh: str) -> list[tuple[str, float]]:
        """Return what modulates a mesh, with its turns a second: both shafts; of a stage all turns between members."""
        one = self._meshing(mesh)
        if not one.stage:
            return [(shaft, self.shaft_frequency(shaft)) for shaft in one.bodies]
        turns = self._stage_frequencies(self.train.part(one.stage, PlanetaryStage))
        names = {"carrier": "ring_fault", "sun": "sun_fault", "planet": "planet_fault"}
        planets = self.train.part(one.stage, PlanetaryStage).gears.planets
        return [
            (f"{member} of {one.stage}", turns[line] / (1 if member == "planet" else planets))
            for member, line in names.items()
        ]

    def _stage_frequencies(self, stage: PlanetaryStage) -> dict[str, float]:
        """Return `PlanetarySet.frequencies` of a stage at its operating speeds, Hz."""
        speeds = stage.speeds(self.train)
        return stage.gears.frequencies(sun=speeds["sun"], carrier=speeds["carrier"])

    def _stage_lines(self, stage: PlanetaryStage) -> Iterator[tuple[str, str, str, float]]:
        """Yield the lines of a planetary stage: kind, of, name, frequency."""
        turns = self._stage_frequencies(stage)
        yield "mesh", stage.name, "GMF", turns["mesh"]
        if stage.gears.planet_at_ring is not None:
            yield "mesh", f"{stage.name} ring", "GMF", turns["mesh_ring"]
        for side in ("sun", "ring"):
            yield "mesh", f"{stage.name} {side}", "hunting tooth", self.hunting_frequency(f"{stage.name} {side}")
        for line in ("planet_pass", "sun_fault", "planet_fault", "ring_fault"):
            yield "planetary stage", stage.name, line.replace("_", " "), turns[line]
        rolling = getattr(stage.on_pins, "rolling", None)
        if rolling is not None:
            for name, multiple in rolling.multiples.items():
                if name == "FTF":
                    # forces are felt by the pin, and the outer ring turns about it: it sees the cage turn the faster
                    name, multiple = "cage at the pin", 1.0 - multiple
                yield "bearing", f"{stage.name} pins", name, multiple * turns["planet"]

    def hunting_frequency(self, mesh: str) -> float:
        """Return how often a second the same two teeth of a mesh meet, Hz."""
        one, two = (gear.teeth for gear in self._meshing(mesh).gears)
        return self.mesh_frequency(mesh) * math.gcd(one, two) / (one * two)

    def sidebands(self, mesh: str, harmonics: int = 3, order: int = 2) -> pd.DataFrame:
        """Return the expected sidebands of a mesh: columns harmonic, shaft, order, frequency (Hz)."""
        import pandas as pd

        gmf = self.mesh_frequency(mesh)
        rows = [
            (h, name, k, h * gmf + k * turns)
            for h in range(1, harmonics + 1)
            for name, turns in self._modulations(mesh)
            for k in range(-order, order + 1)
            if k
        ]
        return pd.DataFrame(rows, columns=["harmonic", "shaft", "order", "frequency"])

    def bearing_frequencies(self, bearing: str) -> dict[str, float]:
        """Return FTF, BPFO, BPFI and BSF of a bearing with ``rolling``, Hz."""
        part = next((b for b in self.train.bearings if b.name == bearing), None)
        if part is None or part.rolling is None:
            known = [b.name for b in self.train.bearings if b.rolling is not None]
            raise DrivetrainError(
                f"bearing '{bearing}': no rolling geometry is known of it; known of {known or 'none'}"
            )
        carrier = self.speeds.get(self.train.carrier(part), 0.0)
        turns = abs(self.speeds[part.shaft] - carrier) / HZ
        return {name: multiple * turns for name, multiple in part.rolling.multiples.items()}

    def common_period(self) -> float:
        """Return the time after which all teeth of all meshes stand as before, s; infinite without meshes."""
        from fractions import Fraction

        meshing = {body for one in self.train.meshings for body in (*one.bodies, one.carrier)}
        meshing |= {wheel.shaft for wheel in self.train.wheels}
        turning = [abs(w) for body, w in self.train.turning.items() if w != 0.0 and body in meshing]
        if not turning:
            return math.inf
        turns = 1
        for speed in turning:
            turns = math.lcm(turns, Fraction(speed / turning[0]).limit_denominator(10**7).denominator)
        return turns / (turning[0] / HZ)

    @cached_property
    def lines(self) -> pd.DataFrame:
        """All frequencies: columns kind, of, name, frequency (Hz), multiple (of the first drive's shaft)."""
        import pandas as pd

        rows: list[tuple[str, str, str, float]] = []
        for shaft in self.train.shafts:
            rows.append(("shaft", shaft.name, "1x", self.shaft_frequency(shaft.name)))
        for mesh in self.train.meshes:
            rows.append(("mesh", mesh.name, "GMF", self.mesh_frequency(mesh.name)))
            rows.append(("mesh", mesh.name, "hunting tooth", self.hunting_frequency(mesh.name)))
        for coupling in self.train.couplings:
            if isinstance(coupling, UniversalJoint) and coupling.angle:
                rows.append(("coupling", coupling.name, "2x", 2.0 * self.shaft_frequency(coupling.first)))
        for stage in self.train.planetary_stages:
            rows += self._stage_lines(stage)
        for bearing in self.train.bearings:
            if bearing.rolling is not None:
                for name, frequency in self.bearing_frequencies(bearing.name).items():
                    rows.append(("bearing", bearing.name, name, frequency))
        for load in self.train.loads:
            teeth = getattr(load, "teeth", 0)
            if teeth:
                rows.append(("load", load.name, "displacement", teeth * self.shaft_frequency(load.shaft)))
        table = pd.DataFrame(rows, columns=["kind", "of", "name", "frequency"])
        reference = self.shaft_frequency(self.train.drives[0].shaft) if self.train.drives else 0.0
        table["multiple"] = table.frequency / reference if reference else float("nan")
        return table

    def nearest(self, frequency: Quantity, harmonics: int | None = None, order: int = 2) -> tuple[str, float]:
        """Return what a line of a spectrum comes from: its name, and how far it is from there, Hz.

        Parameters
        ----------
        frequency : float or str
            Hz.
        harmonics : int, optional
            Highest harmonic of all lines; default: of meshes, bearings and pumps as many as reach the frequency, of
            shafts, hunting teeth and what passes in planetary stages, whose harmonics lie close everywhere, three.
        order : int
            Sidebands on either side of each mesh harmonic.

        Raises
        ------
        DrivetrainError
            For a frequency that is not finite, and where nothing turns.
        """
        frequency = to_si(frequency, "frequency", "nearest: frequency")
        if not math.isfinite(frequency):
            raise DrivetrainError(f"nearest: frequency is {frequency} Hz; give a finite one")
        known = self.known_lines(harmonics or 3, order) if len(self.lines) else {}
        if harmonics is None:
            for row in self.lines.itertuples():
                line = float(row.frequency)  # type: ignore[arg-type]
                if row.kind in ("shaft", "coupling", "planetary stage") or row.name == "hunting tooth" or line <= 0.0:
                    continue
                # the harmonics on either side; sidebands reach as far as their order
                for h in {max(1, math.floor(frequency / line)), max(1, math.ceil(frequency / line))}:
                    known[f"{h} x {row.name} of {row.of}"] = h * line
                    if row.name == "GMF":
                        known |= self._sidebands(str(row.of), h, order)
        if not any(known.values()):
            raise DrivetrainError(f"drivetrain '{self.train.name}': nothing turns, so that it has no lines")
        name = min(known, key=lambda one: abs(known[one] - frequency))
        return name, frequency - known[name]

    def known_lines(self, harmonics: int = 3, order: int = 2) -> dict[str, float]:
        """Return the frequencies (Hz) of all lines and their harmonics, and of the sidebands of all meshes, by name."""
        return {name: at for lines in self.lines_by_part(harmonics, order).values() for name, at in lines.items()}

    def lines_by_part(self, harmonics: int = 3, order: int = 2) -> dict[str, dict[str, float]]:
        """Return the same by what they come from: "shaft <name>", "mesh <name>", "sidebands of <mesh>", and so on."""
        known: dict[str, dict[str, float]] = {}
        for row in self.lines.itertuples():
            part = f"hunting teeth of {row.of}" if row.name == "hunting tooth" else f"{row.kind} {row.of}"
            for h in range(1, harmonics + 1):
                name = f"{h} x {row.name} of {row.of}"
                known.setdefault(part, {})[name] = h * float(row.frequency)  # type: ignore[arg-type]
            if row.name == "GMF":
                sidebands = known.setdefault(f"sidebands of {row.of}", {})
                for h in range(1, harmonics + 1):
                    sidebands |= self._sidebands(str(row.of), h, order)
        return known

    def _sidebands(self, mesh: str, harmonic: int, order: int) -> dict[str, float]:
        """Return the sidebands of one mesh harmonic, Hz, by name."""
        gmf = harmonic * self.mesh_frequency(mesh)
        return {
            f"{harmonic} x GMF of {mesh} {k:+d} x {name}": gmf + k * turns
            for name, turns in self._modulations(mesh)
            for k in range(-order, order + 1)
            if k
        }

    def for_analysis(self, mesh: str | GearMesh) -> dict[str, object]:
        """Return ``speed`` (rad/s) and ``teeth`` of a mesh, as `gearmbs.signals.make_signal` takes them."""
        one = self._meshing(mesh if isinstance(mesh, str) else mesh.name)
        return {"speed": abs(self.train.against_carrier(one)), "teeth": tuple(gear.teeth for gear in one.gears)}

    def for_bearings(self, shaft: str | None = None) -> BearingsAndShafts:
        """Return ``bearing``, ``speed`` (rad/s) and ``shafts`` as `gearmbs.signals.diagnose_bearing` takes them.

        Parameters
        ----------
        shaft : str, optional
            Whose speed is the reference; default: the first drive's.

        Raises
        ------
        DrivetrainError
            If no bearing has ``rolling``, or the reference shaft stands still.
        """
        reference = self.train.drives[0].shaft if shaft is None and self.train.drives else shaft
        turns = abs(self.speeds.get(reference, 0.0)) if reference is not None else 0.0
        if turns == 0.0:
            raise DrivetrainError(
                f"shaft '{reference}': is none of the drivetrain's or stands still; give a shaft that turns"
            )
        found = {}
        for part in self.train.bearings:
            if part.rolling is not None:
                own = abs(self.speeds[part.shaft] - self.speeds.get(self.train.carrier(part), 0.0))
                found[part.name] = (part.rolling, own / turns)
        if not found:
            raise DrivetrainError(f"drivetrain '{self.train.name}': no bearing has rolling; give a designation")
        others = sorted({abs(speed) / turns for name, speed in self.speeds.items() if name != reference and speed})
        return {"bearing": found, "speed": turns, "shafts": others}

    def to_markdown(self) -> str:
        """Return the table of frequencies in Markdown."""
        parts = ["| kind | of | line | frequency, Hz | multiple |", "|---|---|---|---|---|"]
        for row in self.lines.itertuples():
            parts.append(f"| {row.kind} | {row.of} | {row.name} | {row.frequency:.6g} | {row.multiple:.6g} |")
        return "\n".join(parts)

    def to_html(self) -> str:
        """Return the table as HTML."""
        shown = self.lines.to_html(index=False, float_format="{:.6g}".format)
        return f"<p><b>{self.train.name}</b></p>{shown}"

    _repr_html_ = to_html

    def __repr__(self) -> str:
        return f"KinematicTable of {self.train.name!r}\n{self.lines.to_string(index=False)}"


def table_at(train: Drivetrain, speeds: Mapping[str, float]) -> KinematicTable:
    """Return the kinematic table of a drivetrain whose shafts turn at other speeds, rad/s: motors slip each its way."""
    turned = copy(train)
    for name in ("speeds", "turning", "kinematics"):
        turned.__dict__.pop(name, None)
    turned.__dict__["speeds"] = {**train.speeds, **speeds}
    return turned.kinematics


# Speeds of all shafts from the drives, and drives that are too weak for the loads.


SAME_SPEED = 1e-9
"""Relative difference of speeds that are one."""
BALANCED = 0.99
"""Part of the load's torque that a drive must reach: a drive that just balances its load is given in round numbers."""


class Link(NamedTuple):
    """A mesh, coupling or stage with a held member between two shafts: the second turns ``ratio`` times as fast."""

    name: str
    first: str
    second: str
    ratio: float

    def reversed(self) -> Link:
        """The same seen from the second shaft."""
        return Link(self.name, self.second, self.first, 1.0 / self.ratio)


def links(train: Drivetrain) -> list[Link]:
    """Return what ties the speeds of shafts together."""
    out = []
    for coupling in train.couplings:
        for shaft in (coupling.first, coupling.second):
            train.part(shaft, Shaft, coupling.label)
        out.append(Link(coupling.name, coupling.first, coupling.second, 1.0))
    for mesh in train.meshes:
        driver, driven = train.wheels_of(mesh)
        sign = driver.gear.sign * driven.gear.sign
        out.append(Link(mesh.name, driver.shaft, driven.shaft, -sign * driver.gear.teeth / driven.gear.teeth))
    for stage in train.planetary_stages:
        found = held_ratio(train, stage)
        if found is not None:
            out.append(Link(stage.name, *found))
    return out


def walk(train: Drivetrain, start: str) -> Iterator[tuple[Link, bool]]:
    """Yield the links reachable from a shaft, outwards, and whether each leads to a shaft not met before."""
    around: dict[str, list[Link]] = {shaft.name: [] for shaft in train.shafts}
    for link in links(train):
        around[link.first].append(link)
        around[link.second].append(link.reversed())
    met, used, waiting = {start}, set(), deque([start])
    while waiting:
        for link in around[waiting.popleft()]:
            if link.name in used:
                continue
            used.add(link.name)
            new = link.second not in met
            if new:
                met.add(link.second)
                waiting.append(link.second)
            yield link, new


def joined(train: Drivetrain, starts: Iterable[str]) -> set[str]:
    """Return the shafts that links and planetary stages join to some."""
    reached, size = set(starts), -1
    groups = [set(stage.turning(train).values()) for stage in train.planetary_stages]
    groups += [{link.first, link.second} for link in links(train)]
    while len(reached) > size:
        size = len(reached)
        for group in groups:
            if group & reached:
                reached |= group
    return reached


def operating_speeds(train: Drivetrain) -> dict[str, float]:
    """Return the speed of each shaft, rad/s.

    Raises
    ------
    DrivetrainError
        If drives or closed chains give one shaft two speeds.
    """
    speeds: dict[str, float] = {}
    given_by: dict[str, str] = {}
    prescribed: dict[str, str] = {}
    for drive in train.drives:
        train.part(drive.shaft, Shaft, drive.label)
        _agree(train, drive.shaft, drive.speed, speeds, given_by, drive.label)
        new = drive.shaft not in speeds
        speeds[drive.shaft] = drive.speed
        given_by.setdefault(drive.shaft, drive.label)
        if isinstance(drive, SpeedDrive):
            require(
                drive.shaft not in prescribed,
                f"{drive.label}: {prescribed.get(drive.shaft)} prescribes the speed of shaft '{drive.shaft}' too; "
                "leave one of them out, or make one a motor",
            )
            prescribed[drive.shaft] = drive.label
        for link, first_time in walk(train, drive.shaft):
            speed = speeds[link.first] * link.ratio
            if first_time and (new or link.second not in speeds):
                speeds.setdefault(link.second, speed)
                given_by.setdefault(link.second, drive.label)
            _agree(train, link.second, speed, speeds, given_by, f"'{link.name}'")
            if isinstance(drive, SpeedDrive) and first_time:
                other = prescribed.setdefault(link.second, drive.label)
                require(other == drive.label, f"{drive.label} and {other} both prescribe the speed of one train; "
                        "make one of them a motor")  # fmt: skip
    speeds = with_differentials(train, links(train), speeds)
    return {shaft.name: speeds.get(shaft.name, 0.0) for shaft in train.shafts}


def _agree(
    train: Drivetrain, shaft: str, speed: float, speeds: dict[str, float], given_by: dict[str, str], label: str
) -> None:
    known = speeds.get(shaft)
    if known is None or abs(known - speed) <= SAME_SPEED * max(abs(known), abs(speed)):
        return
    raise DrivetrainError(
        f"{label}: shaft '{shaft}' would have two speeds, {speed * RPM:.6g} rpm and {known * RPM:.6g} rpm from "
        f"{given_by[shaft]}; change the teeth, or leave one of them out"
    )


def warn_of_weak_drives(train: Drivetrain) -> None:
    """Warn of drives whose largest torque is less than that of the loads on their shaft, at speed or from rest.

    Torques are those of the operating point without losses, see `gearmbs.drivetrain.static.flow`. Nothing is said
    where a drive prescribes the speed, or a torque is a function of time.

    Warns
    -----
    UserWarning
        With the drive, both torques and the remedy.
    """
    done: set[str] = set()
    for first in train.drives:
        if first.shaft in done:
            continue
        reached = {first.shaft}
        for link, _ in walk(train, first.shaft):
            reached |= {link.first, link.second}
        done |= reached
        drives = [drive for drive in train.drives if drive.shaft in reached]
        sense = -1.0 if first.speed < 0.0 else 1.0
        needed = sense * train.nominal_power.drive.get(first.name, 0.0)
        message = _too_weak(train, drives, needed) or _never_starts(train, drives, reached)
        if message is not None:
            warn(message)


def _too_weak(train: Drivetrain, drives: list[Drive], needed: float) -> str | None:
    """Return what is said of drives that cannot hold their loads at the operating speed, as torques on the first."""
    first = drives[0]
    torques = [drive.largest_torque() for drive in drives]
    if first.speed == 0.0 or any(torque is None for torque in torques):
        return None
    # at one power, torques of other shafts are as their speeds
    reached = sum(t * abs(drive.speed / first.speed) for t, drive in zip(torques, drives) if t is not None)
    if reached >= BALANCED * needed:
        return None
    others = "" if len(drives) == 1 else f" and {', '.join(repr(d.name) for d in drives[1:])} together"
    return (
        f"{first.label}{others}: the largest torque is {reached:.5g} N m, but the loads need {needed:.5g} N m on shaft "
        f"'{first.shaft}' at {abs(first.speed) * RPM:.5g} rpm: the speed will fall away; give a stronger drive, or "
        "less load"
    )


def _never_starts(train: Drivetrain, drives: list[Drive], reached: set[str]) -> str | None:
    """Return what is said of a drive whose torque at standstill is less than that of the loads there."""
    first = drives[0]
    torque = first.starting_torque()
    if train.running or len(drives) > 1 or first.speed == 0.0 or torque is None:
        return None
    needed = sum(
        load.nominal(0.0) * abs(train.speeds[load.shaft] / first.speed)
        for load in train.loads
        if load.shaft in reached and load.on not in reached
    )
    if torque >= BALANCED * needed:
        return None
    return (
        f"{first.label}: its torque at standstill is {torque:.5g} N m, but the loads need {needed:.5g} N m on shaft "
        f"'{first.shaft}': it will not start; give running=True, a stronger drive, or a load that grows with the speed"
    )


def warn_of_tables(train: Drivetrain) -> None:
    """Warn of loads by points whose curve leaves its points by far, or is asked beyond them at the operating speed.

    Warns
    -----
    UserWarning
        With the load, the torque there and the remedy.
    """
    for load in train.loads:
        if isinstance(load, TableLoad):
            for words in load.doubts(abs(train.speeds[load.shaft])):
                warn(words)


def warn_of_lost_torques(train: Drivetrain) -> None:
    """Warn of torques on shafts whose speed is prescribed, which change nothing but the torque of that drive.

    Nothing is said of drag, whose place is there, and of shafts that meshes and elastic couplings lead to.

    Warns
    -----
    UserWarning
        With the drive or load, its torque and the remedy.
    """
    for holder in (drive for drive in train.drives if isinstance(drive, SpeedDrive)):
        fixed = {holder.shaft}
        for link, _ in walk(train, holder.shaft):
            if link.first in fixed and getattr(train.parts[link.name], "kind", "") == "rigid":
                fixed.add(link.second)
        parts: list[tuple[Drive | Load, float | None]] = [
            *((drive, drive.largest_torque()) for drive in train.drives if not isinstance(drive, SpeedDrive)),
            *((load, load.nominal(abs(train.speeds[load.shaft]))) for load in train.loads),
        ]
        for part, torque in parts:
            if part.shaft not in fixed or torque == 0.0 or isinstance(part, Drag):
                continue
            size = "" if torque is None else f" of {torque:.5g} N m"
            warn(
                f"{part.label}: its torque{size} is on shaft '{part.shaft}', whose speed {holder.label} prescribes: no "
                "mesh and no motion feels it; put it on a shaft that meshes or couplings drive, or leave it out"
            )
