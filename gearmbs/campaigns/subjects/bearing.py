"""Rolling bearings in a housing on mounts as the subject of a campaign."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gearmbs.campaigns.subjects.base import Kept, kept_by_functions
from gearmbs.campaigns.subjects.function import TablesSubject, in_si, told
from gearmbs.schema.described import measures_of
from gearmbs.schema.messages import check_keys
from gearmbs.units import to_si

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

    def canonical(self, thing: BearingCase) -> Any:
        """Return the bearing's geometry, the defects, and rig and run with their defaults in SI."""
        import inspect

        from gearmbs.studies import bearing_rig
        from gearmbs.studies.trains.trains import described

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

    def channels(self, thing: BearingCase) -> dict[str, str]:
        """Return the directions of the housing's acceleration."""
        return dict.fromkeys(CHANNELS, "m/s^2")

    def run(self, thing: BearingCase, progress: Callable[[float], None], keep: Sequence[str]) -> Any:
        """Return the acceleration of the housing."""
        import xarray as xr

        from gearmbs.studies import housing_signal

        run = thing.run
        end = run["settling"] + run["duration"]
        solution = thing.mechanism().simulate(end, rate=run["rate"], tol=run["tolerance"], progress=told(progress, end))
        if not solution.success:
            raise RuntimeError(solution.message)
        signal = housing_signal(solution, start=run["settling"])
        return xr.Dataset({"acceleration": signal.drop_vars(["channel_units", "units"], errors="ignore")})

    def reduce(self, thing: BearingCase, record: Any, keep: Sequence[str]) -> Kept:
        """Return of a record what is kept."""
        kept = Kept(numbers=kept_by_functions(keep, record))
        for channel in CHANNELS:
            x = np.asarray(record["acceleration"].sel(channel=channel).values, dtype=float)
            if "levels" in keep:
                rest = x - x.mean()
                rms = float(rest.std())
                kept.numbers[f"rms.{channel}"] = rms
                kept.numbers[f"kurtosis.{channel}"] = float(np.mean(rest**4)) / rms**4 if rms > 0.0 else float("nan")
                kept.numbers[f"crest.{channel}"] = float(np.abs(rest).max()) / rms if rms > 0.0 else float("nan")
            if f"signal:{channel}" in keep:
                kept.signals[channel] = np.atleast_2d(x)
        return kept
