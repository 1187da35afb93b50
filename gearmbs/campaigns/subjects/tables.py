"""Nested tables, as of a TOML file, as the subject of a campaign: drivetrains, planetary sets, bearings on mounts."""

from __future__ import annotations

import copy
import math
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearmbs.campaigns.plans.paths import set_path
from gearmbs.campaigns.settings import CampaignError, by_name, content_key
from gearmbs.campaigns.subjects.base import (
    FAILED,
    Kept,
    Outcome,
    SignalSpec,
    Subject,
    kept_by_functions,
    tooth_fault_unit,
)
from gearmbs.schema.described import check_keys, chosen, measures_of, read_toml
from gearmbs.units import readings, si_unit, to_si

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.drivetrain.description import Description
    from gearmbs.studies.planetary import PlanetaryRun


class TablesSubject(Subject):
    """Nested tables, as of a TOML file, whose entries factors change: ``"meshes.stage 1.backlash"``.

    A factor has a unit if the table's own entry is a text with one: that in which the part takes plain numbers, rad/s
    for a speed of "25 Hz". Entries that are plain numbers, or not there, take numbers in SI.

    Parameters
    ----------
    tables : mapping
        As the file holds them.
    """

    def __init__(self, tables: Mapping[str, Any]) -> None:
        self.tables = copy.deepcopy(by_name(tables, "tables"))
        self._units: dict[str, str] = {}

    @classmethod
    def from_file(cls, path: str | Path) -> TablesSubject:
        """Return the subject of a TOML file."""
        return cls(read_toml(path, CampaignError))

    def settings(self) -> dict[str, Any]:
        """Return the tables."""
        return {"tables": self.tables}

    @classmethod
    def from_settings(cls, settings: dict[str, Any]) -> TablesSubject:
        """Return the subject of a plan, which holds the tables or names their file."""
        check_keys(settings, ("file", "tables"), "subject", CampaignError)
        if not settings:
            raise CampaignError("subject: give the file that holds its tables, or these")
        return cls.from_file(settings["file"]) if "file" in settings else cls(settings["tables"])

    def base(self) -> dict[str, Any]:
        """Return the tables."""
        return copy.deepcopy(self.tables)

    def unit_of(self, path: str) -> str:
        """Return the SI unit of an entry, "1" for plain numbers and texts."""
        *sections, name = path.split(".")
        place: Any = self.tables
        for k, section in enumerate(sections):
            if not isinstance(place, Mapping) or section not in place:
                where = ".".join(sections[:k]) or "the file"
                known = f"it has {', '.join(map(str, place))}" if isinstance(place, Mapping) else "it is no table"
                raise CampaignError(f"{path}: {where} has no {section!r}; {known}")
            place = place[section]
        if not isinstance(place, Mapping):
            raise CampaignError(f"{path}: {'.'.join(sections)} has no {name!r}; it is no table")
        return self._unit_of_numbers(path, place.get(name))

    def _unit_of_numbers(self, path: str, given: Any) -> str:
        """Return in which unit the part takes plain numbers for an entry that has a text, "1" for others.

        Raises
        ------
        CampaignError
            If the text may be read in several, and the tables cannot tell in which.
        """
        found = readings(given)
        if len(found) < 2:
            return next(iter(found), "1")
        if (name := path.rpartition(".")[2]) in AS_THEY_ARE:
            return AS_THEY_ARE[name]
        if path not in self._units:
            keys, wrong = {}, ""
            for reading, value in {"": given, **found}.items():
                tables = self.base()
                set_path(tables, path, value)
                try:
                    keys[reading] = content_key(self.kind, self.canonical(self.check(tables, "base")))
                except (ValueError, TypeError) as error:
                    wrong = wrong or f": {error}"
            own = keys.pop("", None)
            unit = next((unit for unit, key in keys.items() if key == own), None)
            if unit is None:
                raise CampaignError(
                    f"{path} = {given!r}: may stand for {' or '.join(found)}, and the base does not tell which{wrong}; "
                    "give it a plain number in SI"
                )
            self._units[path] = unit
        return self._units[path]

    def table_unit(self, path: str, table: Mapping[str, Any], key: str) -> str:
        """Return the SI unit of a parameter of a fault of a tooth."""
        return tooth_fault_unit(table, key) if path.rpartition(".")[2] in ("fault", "faults") else "1"

    def check(self, data: dict[str, Any], name: str) -> Any:
        """Return what the tables describe."""
        return self.made({**data, "name": name} if "name" in data else data)

    # a drivetrain, a planetary set, a bearing: each subject's own
    @abstractmethod
    def made(self, tables: dict[str, Any]) -> Any:
        """Return what tables describe.

        Raises
        ------
        ValueError
            Naming the wrong entry.
        """

    @abstractmethod
    def span_and_rate(self, thing: Any) -> tuple[float, float]:
        """Return the length of a record, s, and its sampling rate, Hz."""

    @abstractmethod
    def channels(self, thing: Any) -> dict[str, str]:
        """Return the signals that can be kept and their units."""

    def signals(self, keep: Sequence[str], things: Sequence[Any]) -> list[SignalSpec]:
        """Return the arrays of the signals, as long as the longest corner's."""
        specs = []
        for item in keep:
            if not item.startswith("signal:"):
                continue
            name = item.removeprefix("signal:")
            known = self.channels(things[0])
            chosen(known, name, "keep: ", CampaignError, "signal")
            spans, rates = zip(*(self.span_and_rate(thing) for thing in things))
            if len(set(rates)) > 1:
                several = ", ".join(f"{rate:g}" for rate in sorted(set(rates)))
                raise CampaignError(
                    f"keep: {item!r} would have the sampling rates {several} Hz; give the record's rate"
                )
            specs.append(
                SignalSpec(name, (name,), int(np.ceil(max(spans) * rates[0] - 1e-6)) + 1, rates[0], known[name])
            )
        return specs

    def unit_of_result(self, name: str) -> str:
        """Return the unit of a number that is kept, by the parts of its name."""
        parts = name.split(".")
        return next((unit for part, unit in RESULT_UNITS.items() if part in parts or name.startswith(part)), "")

    def explain(self, error: Exception) -> Outcome:
        """Return how a case that raised has ended."""
        from gearmbs.studies import SimulationFailed

        if isinstance(error, SimulationFailed):
            return Outcome(FAILED, str(error)[:2000], "Loosen the tolerance, or make run_up and settling longer.")
        return super().explain(error)


AS_THEY_ARE = {"slow_speed": "rad/s", "mount_frequency": "Hz"}
"""Units of plain numbers of entries that the content of a thing may hold as they were given."""

RESULT_UNITS = {
    "transmission_error": "m",
    "normal_force": "N",
    "force": "N",
    "ring_sensor": "N",
}
"""Units of numbers that are kept, by a part of their names or what these begin with."""


def progress_by_time(progress: Callable[[float], None], span: float) -> Callable[[float], None]:
    """Return a progress function of the simulated time."""
    return lambda t: progress(min(1.0, t / span))


def scalars(name: str, values: Any) -> dict[str, float]:
    """Return mean, RMS about it, least and largest value of a series."""
    x = np.asarray(values, dtype=float)
    return {f"{name}.mean": x.mean(), f"{name}.rms": x.std(), f"{name}.min": x.min(), f"{name}.max": x.max()}


def in_si(tree: Any) -> Any:
    """Return a tree whose texts with units are numbers in SI.

    Hertz are left apart: 10 Hz may stand where plain numbers are rad/s.
    """
    if isinstance(tree, dict):
        return {key: in_si(value) for key, value in tree.items()}
    if isinstance(tree, (list, tuple)):
        return [in_si(value) for value in tree]
    unit = si_unit(tree)
    if unit is None:
        return tree
    value = float(to_si(tree, unit))
    return [value, unit] if unit == "Hz" else value


# Drivetrains.


class DrivetrainSubject(TablesSubject):
    """Drivetrains of a TOML file, rolling bearings and faults of teeth included.

    Keeps ``harmonics`` (``SIGNAL.MESH.K``: RMS of the mesh harmonics of mesh forces, bearing forces and sensors; none
    where the speed changes),
    ``forces`` (mean, RMS, least and largest normal force, transmission error and pairs in contact of each mesh, and
    force of each bearing), ``signal:NAME`` of a sensor, and ``record``.
    """

    kind: ClassVar[str] = "drivetrain"
    keeps: ClassVar[tuple[str, ...]] = ("harmonics", "forces", "record")

    def made(self, tables: dict[str, Any]) -> Description:
        """Return the drivetrain and its run."""
        from gearmbs.drivetrain.description import make_description
        from gearmbs.studies.case.tooth_faults import tooth_fault
        from gearmbs.studies.trains import check_record

        found = make_description(tables, str(tables.get("name", "drivetrain")), tooth_fault)
        check_record(found.train, found.run)
        return found

    def canonical(self, thing: Description) -> dict[str, Any]:
        """Return the parts and pairs with their defaults and the run in SI, without the name."""
        from gearmbs.studies.trains import described

        train = {key: value for key, value in described(thing.train).items() if key not in ("name", "kind")}
        for mesh in train["meshes"]:
            mesh["settings"] = described(thing.train.pairs[mesh["name"]])
        return in_si({"train": train, "run": described(thing.run)})

    def span_and_rate(self, thing: Description) -> tuple[float, float]:
        """Return the length of a record, s, and its sampling rate, Hz."""
        return float(thing.run.duration), float(thing.run.output_rate(thing.train))

    def unit_of_result(self, name: str) -> str:
        """Return the unit of a number that is kept: harmonics of a sensor have its own."""
        from gearmbs.drivetrain.parts import SENSORS

        for sensor, table in self.tables.get("sensors", {}).items():
            if name.startswith(f"{sensor}."):
                return SENSORS[table.get("kind", "speed")].unit
        return super().unit_of_result(name)

    def channels(self, thing: Description) -> dict[str, str]:
        """Return the sensors and their units."""
        return {sensor.name: sensor.unit for sensor in thing.train.sensors}

    def run(self, thing: Description, progress: Callable[[float], None], keep: Sequence[str]) -> xr.Dataset:
        """Return the record."""
        from gearmbs.studies.trains import run_train

        span = thing.train.run_up + thing.run.settling + thing.run.duration
        return run_train(thing.train, thing.run, progress=progress_by_time(progress, span))

    def reduce(self, thing: Description, record: Any, keep: Sequence[str]) -> Kept:
        """Return of a record what is kept."""
        kept = kept_by_functions(keep, record)
        # of changing speed, at which it has no one frequency, a record has other harmonics at each moment
        if "harmonics" in keep and "mesh_rms" in record:
            levels = record["mesh_rms"].transpose("signal", "mesh", "harmonic")
            for (i, j, k), value in np.ndenumerate(levels.values):
                name = f"{levels.signal.values[i]}.{levels.mesh.values[j]}.{k + 1}"
                kept.add({name: float(value)}, "harmonics")
        if "forces" in keep:
            for mesh in record.mesh.values:
                for name in ("normal_force", "transmission_error", "pairs_back"):
                    kept.add(scalars(f"{mesh}.{name}", record[name].sel(mesh=mesh).values), "forces")
            for bearing in record.bearing.values:
                size = np.linalg.norm(record["bearing_force"].sel(bearing=bearing).values, axis=1)
                kept.add(scalars(f"{bearing}.force", size), "forces")
        for item in keep:
            if item.startswith("signal:"):
                name = item.removeprefix("signal:")
                kept.signals[name] = np.atleast_2d(record["measured"].sel(sensor=name).values)
        return kept

    def partial(self, error: Exception) -> xr.Dataset | None:
        """Return the record up to where the integrator stopped."""
        from gearmbs.studies import SimulationFailed

        return error.partial() if isinstance(error, SimulationFailed) else None


# Planetary sets.


class PlanetarySubject(TablesSubject):
    """Planetary sets of a TOML file.

    Keeps ``forces`` (mean, RMS, least and largest force of each mesh of sun and ring, share of each planet, and force
    past the sensor on the ring), ``signal:ring_sensor``, and ``record``.
    """

    kind: ClassVar[str] = "planetary"
    keeps: ClassVar[tuple[str, ...]] = ("forces", "record")

    def made(self, tables: dict[str, Any]) -> tuple[PlanetaryRun, Any]:
        """Return the set and its run, and the table of the pins as it was given."""
        from gearmbs.studies.planetary import planetary_run

        tables.pop("name", None)
        return planetary_run(tables), tables.get("pins")

    def canonical(self, thing: tuple[PlanetaryRun, Any]) -> dict[str, Any]:
        """Return the set with its defaults and the run in SI; the pins, which become a function, as their table."""
        from gearmbs.studies.trains import described

        run, pins = thing
        speeds = {member: float(to_si(speed, "angular speed")) for member, speed in run.speeds.items()}
        tree = described(replace(run, pins=None, speeds=speeds))
        tree["gears"].pop("name", None)
        return in_si({"run": tree, "pins": pins})

    def span_and_rate(self, thing: tuple[PlanetaryRun, Any]) -> tuple[float, float]:
        """Return the length of a record, s, and its sampling rate, Hz."""
        return float(thing[0].duration), float(thing[0].rate)

    def channels(self, thing: tuple[PlanetaryRun, Any]) -> dict[str, str]:
        """Return the one signal."""
        return {"ring_sensor": "N"}

    def run(
        self, thing: tuple[PlanetaryRun, Any], progress: Callable[[float], None], keep: Sequence[str]
    ) -> xr.Dataset:
        """Return the record."""
        from gearmbs.studies.planetary import run_planetary

        run = thing[0]
        return run_planetary(run, progress_by_time(progress, run.run_up + run.settling + run.duration))

    def reduce(self, thing: tuple[PlanetaryRun, Any], record: Any, keep: Sequence[str]) -> Kept:
        """Return of a record what is kept."""
        kept = kept_by_functions(keep, record)
        if "forces" in keep:
            for planet in record.planet.values:
                for mesh in record.mesh.values:
                    force = record["force"].sel(mesh=mesh, planet=planet).values
                    kept.add(scalars(f"{mesh}-planet {planet}.force", force), "forces")
                kept.add(scalars(f"planet {planet}.share", record["share"].sel(planet=planet).values), "forces")
            kept.add(scalars("ring_sensor", record["ring_sensor"].values), "forces")
        if "signal:ring_sensor" in keep:
            kept.signals["ring_sensor"] = np.atleast_2d(record["ring_sensor"].values)
        return kept


# Rolling bearings in a housing on mounts.


RUN = {"settling": 0.05, "duration": 0.5, "rate": 12800.0, "tolerance": 1e-6}
"""How a rig is run: s, s, Hz, and the local error allowed a step."""

UNITS = {"settling": "time", "duration": "time", "rate": "frequency", "tolerance": "dimensionless"}
CHANNELS = ("x", "y", "z")


@dataclass(frozen=True)
class BearingCase:
    """A bearing, its defects, the settings of its rig and of the run."""

    bearing: Any
    defects: tuple[Any, ...]
    rig: dict[str, Any]
    run: dict[str, float]

    def mechanism(self) -> Any:
        """Return the mechanism that is simulated."""
        from gearmbs.studies import bearing_rig

        return bearing_rig(self.bearing, defects=list(self.defects), **self.rig)


class BearingSubject(TablesSubject):
    """Rolling bearings on the rig of `gearmbs.studies.bearing_rig`.

    The tables are ``bearing`` (a designation), ``rig`` (keywords of `bearing_rig`), ``defects`` (a list of tables with
    the ``kind`` of `gearmbs.bearings.DEFECTS` and its parameters) and ``run`` (`RUN`). Keeps ``levels`` (RMS, kurtosis
    and crest factor of the housing's acceleration), ``signal:x``, ``signal:y``, ``signal:z``, and ``record``.
    """

    kind: ClassVar[str] = "bearing"
    keeps: ClassVar[tuple[str, ...]] = ("levels", "record")

    def table_unit(self, path: str, table: Mapping[str, Any], key: str) -> str:
        """Return the SI unit of a parameter of a defect."""
        from gearmbs.bearings import DEFECTS

        kind = DEFECTS.get(str(table.get("kind")))
        measure = measures_of(kind).get(key) if path == "defects" and kind is not None else None
        return "1" if measure is None else measure.unit

    def made(self, tables: dict[str, Any]) -> BearingCase:
        """Return the bearing and all about it; the rig is built once, which checks it."""
        from gearmbs.bearings import Bearing
        from gearmbs.bearings.defects import as_defects

        check_keys(tables, ("name", "bearing", "rig", "defects", "run"), "the file", ValueError)
        given = tables.get("run", {})
        check_keys(given, RUN, "run", ValueError)
        run = RUN | {key: float(to_si(value, UNITS[key], f"run.{key}")) for key, value in given.items()}
        case = BearingCase(
            Bearing.from_designation(str(tables.get("bearing", ""))),
            as_defects(tables.get("defects", ())),
            dict(tables.get("rig", {})),
            run,
        )
        case.mechanism()
        return case

    def canonical(self, thing: BearingCase) -> dict[str, Any]:
        """Return the bearing's geometry, the defects, and rig and run with their defaults in SI."""
        import inspect

        from gearmbs.studies import bearing_rig
        from gearmbs.studies.trains import described

        defaults = {
            name: p.default for name, p in inspect.signature(bearing_rig).parameters.items() if p.default is not p.empty
        }
        rig = defaults | thing.rig
        rig["speed"] = float(to_si(rig["speed"], "angular speed"))
        return in_si(
            {"bearing": described(thing.bearing), "defects": described(thing.defects), "run": thing.run, "rig": rig}
        )

    def span_and_rate(self, thing: BearingCase) -> tuple[float, float]:
        """Return the length of a record, s, and its sampling rate, Hz."""
        return thing.run["duration"], thing.run["rate"]

    def unit_of_result(self, name: str) -> str:
        """Return the unit of a number that is kept."""
        return "m/s^2" if name.startswith("rms.") else ""

    def channels(self, thing: BearingCase) -> dict[str, str]:
        """Return the directions of the housing's acceleration."""
        return dict.fromkeys(CHANNELS, "m/s^2")

    def run(self, thing: BearingCase, progress: Callable[[float], None], keep: Sequence[str]) -> xr.Dataset:
        """Return the acceleration of the housing."""
        import xarray as xr

        from gearmbs.studies import housing_signal

        run = thing.run
        end = run["settling"] + run["duration"]
        solution = thing.mechanism().simulate(
            end, rate=run["rate"], tol=run["tolerance"], progress=progress_by_time(progress, end)
        )
        if not solution.success:
            raise RuntimeError(solution.message)
        signal = housing_signal(solution, start=run["settling"])
        return xr.Dataset({"acceleration": signal.drop_vars(["channel_units", "units"], errors="ignore")})

    def reduce(self, thing: BearingCase, record: Any, keep: Sequence[str]) -> Kept:
        """Return of a record what is kept."""
        kept = kept_by_functions(keep, record)
        for channel in CHANNELS:
            x = np.asarray(record["acceleration"].sel(channel=channel).values, dtype=float)
            if "levels" in keep:
                rest = x - x.mean()
                rms = float(rest.std())
                still = rms == 0.0
                levels = {
                    f"rms.{channel}": rms,
                    f"kurtosis.{channel}": math.nan if still else float(np.mean(rest**4)) / rms**4,
                    f"crest.{channel}": math.nan if still else float(np.abs(rest).max()) / rms,
                }
                kept.add(levels, "levels")
            if f"signal:{channel}" in keep:
                kept.signals[channel] = np.atleast_2d(x)
        return kept
