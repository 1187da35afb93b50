"""The gearboxes of data sets: their files, what is drawn for each specimen, the states of their teeth, the plan."""

from __future__ import annotations

import copy
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.bearings.defects import PARTS
from gearmbs.campaigns.datasets.layers import SensorLayers, checked_layers
from gearmbs.campaigns.datasets.source import check_states, rotation_of
from gearmbs.campaigns.plans.factors import AnyFactor, Choice, Factor, Specimens
from gearmbs.campaigns.plans.given import make_plan
from gearmbs.campaigns.plans.plan import Plan
from gearmbs.campaigns.settings import CampaignError, whole
from gearmbs.campaigns.subjects.tables import DrivetrainSubject
from gearmbs.drivetrain.parts import Accelerometer, SpeedSensor
from gearmbs.schema.described import chosen
from gearmbs.schema.quantities import Measure
from gearmbs.units import to_si

if TYPE_CHECKING:
    from gearmbs.drivetrain import Drivetrain
    from gearmbs.drivetrain.parts import Wheel

FOLDER = Path(__file__).parent

SPREAD = {
    "stiffness": (0.6, 1.6),
    "damping_ratio": (0.6, 1.8),
    "backlash": (0.6, 1.6),
}
"""From which to which part of the file's value a specimen's is drawn: frequencies of modes by a quarter down and up,
and what varies most from one housing to the next, its damping, by a factor of three in all."""

GRADE = 6
"""ISO 1328 grade of the flanks, usual for ground industrial gears."""

RUN_OUT = (0.0, 2e-5)
"""Eccentricity of a wheel, m: run-out of grade 6 of wheels of this size is some 30 um."""


SPALL = {"kind": "spall", "width": [3e-4, 2e-3], "angle": [0.0, 6.283]}
"""A spall in a running surface of a bearing, anywhere: as wide as ten contacts are or as a quarter of a ball, m."""

SOURCE = "source."
"""How columns begin that say what sounds beside the faults of teeth, alike in all states of an operating point."""


@dataclass(frozen=True)
class Gearbox:
    """A gearbox of data sets: a drivetrain's file with what varies.

    Attributes
    ----------
    name : str
        Of the column ``gearbox``, whatever the file calls it.
    file : Path
        Drivetrain in TOML, with accelerometers and one speed sensor, at the shaft of the driver or at another one that
        meshes and couplings tie to it, whose speed is brought to the driver's by the teeth.
    mesh : str
        Whose driver has the faults.
    drive, load : str
        Which set the operating point.
    speed, torque : tuple of str
        Ranges of the drive's speed and of the load's torque.
    """

    name: str
    file: Path
    mesh: str
    drive: str
    load: str
    speed: tuple[str, str]
    torque: tuple[str, str]

    @cached_property
    def tables(self) -> dict[str, Any]:
        """The file's tables.

        Raises
        ------
        CampaignError
            If there is no such mesh, drive or load.
        """
        tables = DrivetrainSubject.from_file(self.file).tables
        for table, name in (("meshes", self.mesh), ("drives", self.drive), ("loads", self.load)):
            chosen(tables.get(table, {}), name, f"gearbox {self.name}: ", CampaignError, table)
        return tables

    @cached_property
    def train(self) -> Drivetrain:
        """What the file describes, with all its defaults.

        Raises
        ------
        ValueError
            If the file is wrong.
        """
        return DrivetrainSubject(self.tables).check(copy.deepcopy(self.tables), self.name).train

    @property
    def accelerometers(self) -> list[str]:
        """Names of the accelerometers.

        Raises
        ------
        CampaignError
            If there is none.
        """
        found = [sensor.name for sensor in self.train.sensors if isinstance(sensor, Accelerometer)]
        if not found:
            raise CampaignError(
                f"gearbox {self.name}: no accelerometers; give the file [sensors] of the kind 'accelerometer'"
            )
        return found

    @property
    def speed_sensor(self) -> str:
        """Name of the speed sensor.

        Raises
        ------
        CampaignError
            If there is none, or several.
        """
        found = [sensor.name for sensor in self.train.sensors if isinstance(sensor, SpeedSensor)]
        if len(found) != 1:
            raise CampaignError(f"gearbox {self.name}: {len(found)} speed sensors; give the file one, for the tacho")
        return found[0]

    @property
    def rate(self) -> float:
        """Sampling rate of its records, Hz."""
        return float(to_si(self.tables.get("run", {}).get("rate", 12800.0), "frequency"))

    @property
    def rolling(self) -> list[str]:
        """Names of the rolling bearings, which may have defects."""
        return [name for name, table in self.tables.get("bearings", {}).items() if table.get("kind") == "rolling"]

    def sources(self) -> list[Choice]:
        """Return for each rolling bearing whether it is sound or where its spall is.

        Raises
        ------
        CampaignError
            If there is no rolling bearing.
        """
        if not self.rolling:
            has = ", ".join(name for name, box in GEARBOXES.items() if box.rolling)
            raise CampaignError(
                f"gearbox {self.name}: bearing_defects = True, but none of its bearings is rolling; leave it out, or "
                f"take {has} or a file with bearings of the kind 'rolling'"
            )
        where = {"sound": [], **{f"{part} spall": {**SPALL, "part": part} for part in PARTS}}
        return [Choice(f"bearings.{name}.settings.defects", where, name=f"{SOURCE}{name}") for name in self.rolling]

    @property
    def driver(self) -> Wheel:
        """The wheel that has the faults."""
        return self.train.wheels_of(self.mesh)[0]

    @property
    def teeth(self) -> tuple[int, int]:
        """Teeth of the mesh with the faults, driver and driven."""
        driver, driven = self.train.wheels_of(self.mesh)
        return driver.gear.teeth, driven.gear.teeth

    def states(self) -> dict[str, Any]:
        """Return the states with the ranges of their sizes in SI, of which the first is the severity.

        Heights and depths go by the module, lengths along the face by its width.
        """
        m, b = float(self.driver.gear.module), float(self.driver.gear.face_width)
        tooth = [0, self.teeth[0] - 1]
        return {
            "healthy": [],
            "broken": {"kind": "broken tooth", "lost": [0.1, 0.9], "tooth": tooth},
            "chipped": {"kind": "chipped corner", "height": [0.1 * m, 1.3 * m], "length": [0.1 * b, 0.5 * b],
                        "tooth": tooth},
            "cracked": {"kind": "root crack", "depth": [0.1 * m, 1.1 * m], "tooth": tooth},
            "pitted": {"kind": "pitting", "depth": [1e-5, 2e-4], "height": [0.3 * m, m], "width": [0.2 * b, 0.75 * b],
                       "tooth": tooth},
            "worn": {"kind": "wear", "depth": [5e-6, 1e-4]},
        }  # fmt: skip

    def specimens(self, count: int, seed: int) -> Specimens:
        """Return the individuals: flanks and run-out of all wheels, backlash, and the housing's modes."""
        errors: dict[str, Any] = {}
        for name, mesh in self.tables["meshes"].items():
            errors |= self._spread(mesh, f"meshes.{name}")
        for name, housing in self.tables.get("housings", {}).items():
            for mode, table in housing.get("modes", {}).items():
                errors |= self._spread(table, f"housings.{name}.modes.{mode}")
        faults = []
        for name in self.tables["meshes"]:
            for wheel in ("driver", "driven"):
                where = {"path": f"meshes.{name}.faults", "wheel": wheel}
                faults.append({**where, "kind": "manufacturing grade", "grade": GRADE, "lead": False, "seed": "drawn"})
                faults.append({**where, "kind": "eccentricity", "amount": RUN_OUT, "phase": (0.0, 6.283)})
        return Specimens(count, errors, tuple(faults), seed=seed)

    def _spread(self, table: Mapping[str, Any], path: str) -> dict[str, tuple[float, float]]:
        """Return the ranges of those entries of a table that vary from specimen to specimen, in SI."""
        found, subject = {}, DrivetrainSubject(self.tables)
        for name, (low, high) in SPREAD.items():
            if name in table:
                field = f"{path}.{name}"
                value = float(to_si(table[name], subject.unit_of(field), field))
                found[field] = (low * value, high * value)
        return found


GEARBOXES = {
    "one stage": Gearbox(
        "one stage", FOLDER / "one_stage.toml", "stage", "drive", "brake", ("800 rpm", "1800 rpm"), ("20 N m", "80 N m")
    ),
    "two stages": Gearbox(
        "two stages", FOLDER / "two_stages.toml", "stage 1", "drive", "brake",
        ("900 rpm", "2100 rpm"), ("5 N m", "40 N m"),
    ),
}  # fmt: skip
"""Gearboxes that come with the package."""

SLICES = 11
"""Slices along the face: enough for chipped corners and pits of the widths above, at a third of the time of the
default."""


def data_set_plan(
    signals: int,
    *,
    gearbox: str | Gearbox = "two stages",
    specimens: int = 200,
    duration: float | str = 0.25,
    layers: SensorLayers | None = None,
    bearing_defects: bool = False,
    seed: int = 0,
    unit: int = 24,
) -> Plan:
    """Return the plan of a gearbox's part of a data set: every specimen and operating point in all states.

    Parameters
    ----------
    signals : int
        At least so many, up to a multiple of the number of states, of sensors and of specimens.
    gearbox : str or Gearbox
        One of `GEARBOXES` or one of your own.
    specimens : int
        Individuals, all of which are drawn equally often.
    duration : float or str
        Of a record, s, or text such as "0.25 s". What the layers need before and after it is simulated in addition.
    layers : SensorLayers, optional
        What will be put on the clean signals.
    seed : int
        Of individuals, and with the gearbox's name of the points' sequence: of two gearboxes of one seed, points of one
        number have other speeds, torques and severities.
    bearing_defects : bool
        Give rolling bearings a spall at three of four operating points, on outer ring, inner ring or an element: a
        source of vibration beside the teeth, the same in all their states.

    Raises
    ------
    CampaignError
        If no bearing can have a defect, there are fewer points, each of which is simulated in all states, than
        specimens, or the file lacks a sensor.
    """
    box = gearbox if isinstance(gearbox, Gearbox) else chosen(GEARBOXES, gearbox, "", CampaignError, "gearbox")
    layers = checked_layers(layers)
    states = box.states()
    each = len(states) * len(box.accelerometers)
    try:
        duration = float(Measure("time", above=0, below=np.inf).as_given(duration))
    except ValueError as error:
        raise CampaignError(f"data set: duration = {duration!r}; give the length of a record, s: {error}") from None
    signals, specimens, seed = (
        whole(value, f"data set: {name}", least)
        for name, value, least in (("signals", signals, 1), ("specimens", specimens, 1), ("seed", seed, 0))
    )
    points = -(-signals // each)
    if points < specimens:
        raise CampaignError(
            f"data set: {signals} signals of {box.name} are {points} points of {len(states)} states and "
            f"{len(box.accelerometers)} sensors, too few for {specimens} specimens; ask for {each * specimens} signals "
            "of each gearbox or fewer specimens"
        )
    tables = {**box.tables, "name": box.name, "run": dict(box.tables.get("run", {}))}
    rate = box.rate
    before, after = layers.margins(duration, rate)
    tables["run"] |= {"rate": rate, "duration": duration + (before + after) / rate}
    sources = box.sources() if bearing_defects else []
    tables["bearings"] = {
        name: {**table, "settings": dict(table.get("settings", {}))} if sources and name in box.rolling else table
        for name, table in tables.get("bearings", {}).items()
    }
    tables["meshes"] = {name: {**mesh, "slices": SLICES} for name, mesh in tables["meshes"].items()}
    factors: list[AnyFactor] = [
        Factor(f"drives.{box.drive}.speed", low=box.speed[0], high=box.speed[1], name="operation.speed"),
        Factor(f"loads.{box.load}.torque", low=box.torque[0], high=box.torque[1], name="operation.torque"),
        Choice(f"meshes.{box.mesh}.faults", states, crossed=True, name="state"),
        *sources,
        box.specimens(specimens, seed),
    ]
    plan = make_plan(
        DrivetrainSubject(tables),
        factors,
        "sobol",
        n=-(-points // specimens) * specimens,
        seed=point_seed(box.name, seed),
        keep=["forces", *(f"signal:{name}" for name in (*box.accelerometers, box.speed_sensor))],
        unit=unit,
        time_limit=300.0,
    )
    check_states(plan, f"gearbox {box.name}")
    rotation_of(plan, plan.subject.check(plan.subject.base(), box.name), box.mesh, box.speed_sensor, box.name)
    return plan


def point_seed(name: str, seed: int) -> int:
    """Return the seed of the sequence of a gearbox's points: sequences of one seed have the same points."""
    return zlib.crc32(f"{seed} {name}".encode())
