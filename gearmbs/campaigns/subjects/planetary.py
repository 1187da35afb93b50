"""Planetary sets as the subject of a campaign."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from gearmbs.campaigns.subjects.base import Kept, kept_by_functions
from gearmbs.campaigns.subjects.tables import TablesSubject, in_si, scalars, told
from gearmbs.units import to_si


class PlanetarySubject(TablesSubject):
    """Planetary sets of a TOML file.

    Keeps ``forces`` (mean, RMS, least and largest force of each mesh of sun and ring, share of each planet, and force
    past the sensor on the ring), ``signal:ring_sensor``, and ``record``.
    """

    kind: ClassVar[str] = "planetary"
    keeps: ClassVar[tuple[str, ...]] = ("forces", "record")

    def made(self, tables: dict[str, Any]) -> Any:
        """Return the set and its run, and the table of the pins as it was given."""
        from gearmbs.studies.planetary import planetary_run

        tables.pop("name", None)
        return planetary_run(tables), tables.get("pins")

    def canonical(self, thing: Any) -> Any:
        """Return the set with its defaults and the run in SI; the pins, which become a function, as their table."""
        from gearmbs.studies.trains import plain

        run, pins = thing
        speeds = {member: float(to_si(speed, "angular speed")) for member, speed in run.speeds.items()}
        tree = plain(replace(run, pins=None, speeds=speeds))
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
        from gearmbs.studies.planetary import run_planetary

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
