"""Drivetrains as the subject of a campaign."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from gearmbs.campaigns.subjects.base import Kept, kept_by_functions
from gearmbs.campaigns.subjects.function import TablesSubject, in_si, scalars, told
from gearmbs.units import to_si


class DrivetrainSubject(TablesSubject):
    """Drivetrains of a TOML file, rolling bearings and faults of teeth included.

    Keeps ``harmonics`` (``SIGNAL.MESH.K``: RMS of the mesh harmonics of mesh forces, bearing forces and sensors),
    ``forces`` (mean, RMS, least and largest normal force, transmission error and pairs in contact of each mesh, and
    force of each bearing), ``signal:NAME`` of a sensor, and ``record``.
    """

    kind: ClassVar[str] = "drivetrain"
    keeps: ClassVar[tuple[str, ...]] = ("harmonics", "forces", "record")

    def made(self, tables: dict[str, Any]) -> Any:
        """Return the drivetrain and its run."""
        from gearmbs.drivetrain.drivetrain import make_description
        from gearmbs.studies.case.tooth_faults import tooth_fault
        from gearmbs.studies.trains.trains import check_record

        found = make_description(tables, str(tables.get("name", "drivetrain")), tooth_fault)
        check_record(found.train, found.run)
        return found

    def canonical(self, thing: Any) -> Any:
        """Return the parts and pairs with their defaults and the run in SI, without the name."""
        from gearmbs.studies.trains.trains import described

        train = {key: value for key, value in described(thing.train).items() if key not in ("name", "kind")}
        for mesh in train["meshes"]:
            mesh["settings"] = described(thing.train.pairs[mesh["name"]])
        return in_si({"train": train, "run": described(thing.run)})

    def span_and_rate(self, thing: Any) -> tuple[float, float]:
        """Return the length of a record, s, and its sampling rate, Hz."""
        return float(thing.run.duration), float(thing.run.output_rate(thing.train))

    def channels(self, thing: Any) -> dict[str, str]:
        """Return the sensors and their units."""
        return {sensor.name: sensor.unit for sensor in thing.train.sensors}

    def run(self, thing: Any, progress: Callable[[float], None], keep: Sequence[str]) -> Any:
        """Return the record."""
        from gearmbs.studies.trains.trains import run_train

        span = thing.train.run_up + thing.run.settling + thing.run.duration
        return run_train(thing.train, thing.run, progress=told(progress, span))

    def reduce(self, thing: Any, record: Any, keep: Sequence[str]) -> Kept:
        """Return of a record what is kept."""
        kept = Kept(numbers=kept_by_functions(keep, record))
        if "harmonics" in keep:
            levels = record["mesh_rms"].transpose("signal", "mesh", "harmonic")
            for (i, j, k), value in np.ndenumerate(levels.values):
                kept.numbers[f"{levels.signal.values[i]}.{levels.mesh.values[j]}.{k + 1}"] = float(value)
        if "forces" in keep:
            for mesh in record.mesh.values:
                for name in ("normal_force", "transmission_error", "pairs_back"):
                    kept.numbers |= scalars(f"{mesh}.{name}", record[name].sel(mesh=mesh).values)
            for bearing in record.bearing.values:
                size = np.linalg.norm(record["bearing_force"].sel(bearing=bearing).values, axis=1)
                kept.numbers |= scalars(f"{bearing}.force", size)
        for item in keep:
            if item.startswith("signal:"):
                name = item.removeprefix("signal:")
                kept.signals[name] = np.atleast_2d(record["measured"].sel(sensor=name).values)
        return kept

    def partial(self, error: Exception) -> Any:
        """Return the record up to where the integrator stopped."""
        from gearmbs.studies import SimulationFailed

        return error.partial() if isinstance(error, SimulationFailed) else None


# Planetary sets as the subject of a campaign.


class PlanetarySubject(TablesSubject):
    """Planetary sets of a TOML file.

    Keeps ``forces`` (mean, RMS, least and largest force of each mesh of sun and ring, share of each planet, and force
    past the sensor on the ring), ``signal:ring_sensor``, and ``record``.
    """

    kind: ClassVar[str] = "planetary"
    keeps: ClassVar[tuple[str, ...]] = ("forces", "record")

    def made(self, tables: dict[str, Any]) -> Any:
        """Return the set and its run, and the table of the pins as it was given."""
        from gearmbs.studies.trains.planetary import planetary_run

        tables.pop("name", None)
        return planetary_run(tables), tables.get("pins")

    def canonical(self, thing: Any) -> Any:
        """Return the set with its defaults and the run in SI; the pins, which become a function, as their table."""
        from gearmbs.studies.trains.trains import described

        run, pins = thing
        speeds = {member: float(to_si(speed, "angular speed")) for member, speed in run.speeds.items()}
        tree = described(replace(run, pins=None, speeds=speeds))
        tree["gears"].pop("name", None)
        return in_si({"run": tree, "pins": pins})

    def span_and_rate(self, thing: Any) -> tuple[float, float]:
        """Return the length of a record, s, and its sampling rate, Hz."""
        return float(thing[0].duration), float(thing[0].rate)

    def channels(self, thing: Any) -> dict[str, str]:
        """Return the one signal."""
        return {"ring_sensor": "N"}

    def run(self, thing: Any, progress: Callable[[float], None], keep: Sequence[str]) -> Any:
        """Return the record."""
        from gearmbs.studies.trains.planetary import run_planetary

        run = thing[0]
        return run_planetary(run, told(progress, run.run_up + run.settling + run.duration))

    def reduce(self, thing: Any, record: Any, keep: Sequence[str]) -> Kept:
        """Return of a record what is kept."""
        kept = Kept(numbers=kept_by_functions(keep, record))
        if "forces" in keep:
            for planet in record.planet.values:
                for mesh in record.mesh.values:
                    force = record["force"].sel(mesh=mesh, planet=planet).values
                    kept.numbers |= scalars(f"{mesh}-planet {planet}.force", force)
                kept.numbers |= scalars(f"planet {planet}.share", record["share"].sel(planet=planet).values)
            kept.numbers |= scalars("ring_sensor", record["ring_sensor"].values)
        if "signal:ring_sensor" in keep:
            kept.signals["ring_sensor"] = np.atleast_2d(record["ring_sensor"].values)
        return kept
