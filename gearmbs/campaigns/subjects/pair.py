"""Cases of the gear pair as the subject of a campaign: one a point, or six for the paper's claims."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearmbs.campaigns.settings import CampaignError
from gearmbs.campaigns.subjects.base import (
    ABOUT_RECORD,
    FAILED,
    Kept,
    Outcome,
    SignalSpec,
    Subject,
    kept_by_functions,
    tooth_fault_unit,
)
from gearmbs.schema.described import chosen
from gearmbs.signals import COMPONENTS
from gearmbs.studies.case.case import Case, make_case
from gearmbs.studies.case.sections import units_of_fields
from gearmbs.units import to_si

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.studies.run.record import PlainRecord

FIRST_ORDERS = 3
PERIODIC = {"harmonics", "contact"}
"""What a motion that repeats itself is known by. Signals of all cases have one length, indicators look at what is left
beside the lines of the mesh, and nobody knows what a function of one's own looks at."""
PLAIN = {"name", "title"}
NEEDED = {
    "harmonics": ("gmf_rms",),
    "indicators": ("acceleration",),
    "contact": ("normal_force", "transmission_error", "penetration_drive", "pairs_back"),
}
"""Variables of a record from which the numbers that are kept are made."""

SETTINGS = {
    "depth": ("m", 1e-4),
    "damping": ("N s/m", 298520.0),
    "stiffness": ("1", 2.9852e5),
    "exponent": ("1", 1.3),
    "friction": ("1", 0.1),
    "backlash": ("m", 1e-4),
    "plane": ("1", "skew"),
    "speed": ("rad/s", 104.71975511965977),
    "face_width": ("m", 0.02),
    "shaft_radius": ("m", 0.015),
    "torque": ("N m", 100.0),
}
"""What the paper leaves open: SI unit and the preset's value; the stiffness is in N/mm^exponent, as the paper gives
it, and the
dynamic friction is half the static one."""

RESULT_UNITS = {
    **dict.fromkeys(("band", "orders", "rms", "peak_to_peak", "sideband_index"), "m/s^2"),
    **dict.fromkeys(("penetration", "error"), "m"),
    "force": "N",
}
"""Units of numbers that are kept, by the beginnings of their names."""

PERIODS = 40
"""Least length of a record in mesh periods, for the band-pass filters."""

SHORTEST = 0.1
"""Least length of a record, s: 48 mesh periods at the preset's speed."""
RUN_UP = 0.03
"""Seconds of run-up, and as many of settling, before a record: less than the 0.05 of a case, for there are thousands of
them."""


class PairSubject(Subject):
    """Cases of the gear pair on two shafts.

    Keeps ``harmonics`` (RMS of the mesh harmonics of every component, by band and by orders; with ``record.at_limit``,
    ``record.deviation`` and ``record.apart`` where records are as long as their motion takes), ``indicators``
    (condition indicators of the synchronous averages), ``contact`` (force, penetration and transmission error),
    ``signal:NAME`` of ``acceleration``, a component of it, ``transmission_error``, ``force_1`` or ``force_2``, and
    ``record``, the whole record as NetCDF.

    Parameters
    ----------
    case : Case, optional
        Holds everything that no factor changes. Without a duration of its own records are as long as harmonics and
        contact need ("auto"), and as long as a case's default where anything else is kept.
    """

    kind: ClassVar[str] = "pair"
    keeps: ClassVar[tuple[str, ...]] = ("harmonics", "indicators", "contact", "record")

    def __init__(self, case: Case | None = None) -> None:
        self.case = (case or Case()).as_one_of_many()

    def settings(self) -> dict[str, Any]:
        """Return the base case."""
        return {"case": json.loads(json.dumps(self.case.settings()))}

    @classmethod
    def from_settings(cls, settings: dict[str, Any]) -> PairSubject:
        """Return the subject with the base case of a plan."""
        return cls(make_case(settings.get("case", {}), "base case"))

    def base(self) -> dict[str, Any]:
        """Return the base case as nested data."""
        return self.case.settings()

    def unit_of(self, path: str) -> str:
        """Return the SI unit of a field of a case, as "operation.torque"."""
        section, _, name = path.partition(".")
        fields = type(self.case).model_fields
        if section not in fields or section in PLAIN:
            raise CampaignError(f"{path}: a case has no section {section!r}; choose one of {', '.join(fields)}")
        holder = getattr(self.case, section)
        known = type(holder).model_fields
        if name not in known:
            raise CampaignError(f"{path}: unknown; fields of {section} are {', '.join(known)}")
        return units_of_fields(holder).get(name, "1")

    def is_section(self, path: str) -> bool:
        """Return whether a path is that of a section of a case."""
        return path in type(self.case).model_fields and path not in PLAIN

    def unit_follows(self, path: str) -> str:
        """Return the exponent, by which the unit of the stiffness goes."""
        return "contact.exponent" if path == "contact.stiffness" else ""

    def table_unit(self, path: str, table: Mapping[str, Any], key: str) -> str:
        """Return the SI unit of a parameter of a fault of a tooth."""
        return tooth_fault_unit(table, key) if path == "fault.teeth" else "1"

    def unit_of_result(self, name: str) -> str:
        """Return the unit of a number that is kept."""
        kind = name.partition(".")[0]
        return RESULT_UNITS.get(kind, "")

    def check(self, data: dict[str, Any], name: str) -> Case:
        """Return the validated case, whose record can be evaluated."""
        from gearmbs.studies.case.limits import check_record

        case = make_case({**data, "name": name}, name)
        check_record(case, name)
        return case

    def as_simulated(self, thing: Case, keep: Sequence[str]) -> Case:
        """Return the case with the length of its record where that is not as its motion takes."""
        if thing.is_auto and not PERIODIC.issuperset(keep):
            return thing.changed(operation={"duration": thing.operation.longest})
        return thing

    def canonical(self, thing: Case) -> dict[str, Any]:
        """Return the content of a case; see `canonical_case`."""
        return canonical_case(thing)

    def run(self, thing: Case, progress: Callable[[float], None], keep: Sequence[str]) -> PlainRecord | xr.Dataset:
        """Return the record of a case: plain arrays where numbers alone are kept that are made of them."""
        from gearmbs.studies.run.simulation import plain_record

        thing = self.as_simulated(thing, keep)
        operation = thing.operation
        span = operation.run_up + operation.settling + operation.longest
        record = plain_record(thing, lambda t: progress(t / span), variables=variables_for(keep))
        return record if PERIODIC.issuperset(keep) else record.dataset()

    def reduce(self, thing: Case, record: Any, keep: Sequence[str]) -> Kept:
        """Return of a record what is kept."""
        kept = kept_by_functions(keep, record)
        if "harmonics" in keep:
            kept.add(harmonics(record), "harmonics")
        if "contact" in keep:
            kept.add(contact_numbers(thing, record), "contact")
        kept.add(record_numbers(record), ABOUT_RECORD)
        if "indicators" in keep:
            kept.add(indicators(record), "indicators")
        for name, channels in _arrays(keep).items():
            kept.signals[name] = _signal(record, name, channels)
        return kept

    def signals(self, keep: Sequence[str], things: Sequence[Case]) -> list[SignalSpec]:
        """Return the arrays of the signals, as long as the longest corner's."""
        specs = []
        for name, channels in _arrays(keep).items():
            slow = name == "acceleration"
            rates = {float(thing.signal_rate if slow else thing.output_rate) for thing in things}
            if len(rates) > 1:
                several = ", ".join(f"{rate:g}" for rate in sorted(rates))
                raise CampaignError(
                    f"keep: 'signal:{name}' would have the sampling rates {several} Hz, since they follow the mesh "
                    "frequency; give solver.signal_rate and solver.output_rate of the base case"
                )
            rate = rates.pop()
            longest = max(thing.operation.longest for thing in things)
            units = {"acceleration": "m/s^2", "transmission_error": "m"}.get(name, "N")
            specs.append(SignalSpec(name, channels, int(np.ceil(longest * rate - 1e-6)), rate, units))
        return specs

    def explain(self, error: Exception) -> Outcome:
        """Return the integrator's status, its message and what the settings of a case offer against it."""
        from gearmbs.studies.run.simulation import ADVICE, SimulationFailed

        if isinstance(error, SimulationFailed):
            slipped = "Raise contact.stiffness or make operation.run_up longer."
            advice = slipped if error.solution is None else ADVICE.get(error.solution.status, slipped)
            return Outcome(FAILED, str(error)[:2000], advice)
        return super().explain(error)

    def partial(self, error: Exception) -> xr.Dataset | None:
        """Return the record up to where the integrator stopped."""
        from gearmbs.studies.run.simulation import SimulationFailed

        return error.partial() if isinstance(error, SimulationFailed) else None

    def tightened(self, thing: Case) -> Case | None:
        """Return the case with a tenth of its tolerance."""
        tolerance = 0.1 * thing.tolerance
        return thing.changed(solver={"tolerance": tolerance}) if tolerance >= 1e-12 else None


def variables_for(keep: Sequence[str]) -> set[str] | None:
    """Return the variables of a record that are needed for what is kept; None if it may be any."""
    if any(item == "record" or (item not in NEEDED and not item.startswith("signal:")) for item in keep):
        return None
    wanted = {name for item in keep if item in NEEDED for name in NEEDED[item]}
    return wanted | _arrays(keep).keys()


PARTS_OF_SHAFTS = ("modes", "bearings", "bearing_distance")
"""Settings of shafts that bend or stand in rolling bearings."""


def canonical_case(case: Case) -> dict[str, Any]:
    """Return the content of a case: SI, defaults filled in, without its name and without what has no effect.

    Values of wheels stand for both; heights of teeth are those the wheels have, whether given as radius, as height or
    left to the default; the law is in N, m and s; without friction or misalignment their parameters are left out.
    """
    data: dict[str, Any] = case.model_dump(exclude={"name"})
    for section in list(data):
        holder = getattr(case, section)
        for name in data[section] if isinstance(data[section], dict) else ():
            if hasattr(type(holder), f"used_{name}"):
                data[section][name] = getattr(holder, f"used_{name}")
    data["solver"] |= {"signal_rate": case.signal_rate, "output_rate": case.output_rate}
    data["solver"] |= {"tolerance": case.tolerance, "lump": case.lump}
    wheels = case.pair().wheels
    gears = data["gears"]
    # what cases had before spur wheels on rigid shafts were not the only ones keeps its key
    for table, names in ((gears, ("helix_angle", "hand", "internal")), (data["shafts"], PARTS_OF_SHAFTS)):
        if not any(table[name] for name in names if name != "hand"):
            for name in names:
                del table[name]
    for name, value in gears.items():
        gears[name] = list(value) if isinstance(value, (tuple, list)) else [value, value]
    for name in ("module", "pressure_angle"):
        gears[name] = gears[name][0]
    for name in ("addendum", "dedendum", "fillet_radius"):
        gears[name] = [getattr(wheel, name) for wheel in wheels]
    for name in ("tip_radius", "root_radius"):
        del gears[name]
    contact = data["contact"]
    contact["stiffness"] = to_si(case.contact.stiffness, case.contact.stiffness_unit, "stiffness")
    contact["damping"] = to_si(case.contact.damping, "damping", "damping")
    contact["slices"] = case.pair().face_slices
    if not case.friction.enabled:
        data["friction"] = {"enabled": False}
    if case.fault.misalignment == 0.0:
        for name in ("plane", "pivot"):
            del data["fault"][name]
    return data


def harmonics(record: Any) -> dict[str, float]:
    """Return the RMS of the mesh harmonics: ``band.COMPONENT.K`` and ``orders.COMPONENT.K``, m/s^2.

    Nothing for a record of changing speed, which has none.
    """
    if "gmf_rms" not in record:
        return {}
    from gearmbs.studies.run.record import values_of

    levels = values_of(record, "gmf_rms")
    ways, numbers, components = (values_of(record, name) for name in ("way", "harmonic", "component"))
    return {
        f"{way}.{component}.{number}": float(levels[i, k, j])
        for i, way in enumerate(ways)
        for j, component in enumerate(components)
        for k, number in enumerate(numbers)
    }


def record_numbers(record: Any) -> dict[str, float]:
    """Return how a record that is as long as its motion takes came to its end; nothing for one of a given length.

    ``record.at_limit``: 1 if the motion did not repeat itself up to the longest record, or could not be watched, else
    0; ``record.deviation``: by what part of its mesh harmonics it repeats itself, where it was watched;
    ``record.apart``: part of the time behind the run-up in which no drive flanks touch.
    """
    from gearmbs.studies.run.record import told_of

    about = told_of(record)
    if "record_status" not in about:
        return {}
    found = {"at_limit": float(about["record_status"] != "periodic"), "apart": float(about["record_apart"])}
    if math.isfinite(about["record_deviation"]):
        found["deviation"] = float(about["record_deviation"])
    return {f"{ABOUT_RECORD}{name}": value for name, value in found.items()}


def contact_numbers(case: Case, record: Any) -> dict[str, float]:
    """Return numbers of contact and transmission error.

    ``force.mean``, ``force.max`` (N), ``penetration.max`` (m), ``two_flanks`` (share of the time with contact on the
    coast flank), ``error.mean``, ``error.peak_to_peak`` and its mesh harmonics' amplitudes ``error.K`` (m), which a
    record of changing speed has not.
    """
    from gearmbs.studies.run.record import values_of

    force, error, depth, back = (values_of(record, name) for name in NEEDED["contact"])
    amplitudes = {} if case.operation.speed_curve else error_harmonics(case, error)
    return {
        "force.mean": float(force.mean()),
        "force.max": float(force.max()),
        "penetration.max": float(depth.max()),
        "two_flanks": float(np.mean(back > 0)),
        "error.mean": float(error.mean()),
        "error.peak_to_peak": float(np.ptp(error)),
        **amplitudes,
    }


def error_harmonics(case: Case, error: np.ndarray) -> dict[str, float]:
    """Return the amplitudes of the mesh harmonics of a transmission error at one speed, m."""
    rate, gmf = case.output_rate, case.mesh_frequency
    # a record of whole periods may be a sample short of the last one
    count = int(np.floor((error.size + 1) * gmf / rate) / gmf * rate)
    t = np.arange(count) / rate
    swing = error[:count] - error[:count].mean()
    return {
        f"error.{k}": float(2.0 * np.abs(np.mean(swing * np.exp(-2j * np.pi * k * gmf * t))))
        for k in range(1, FIRST_ORDERS + 1)
    }


def indicators(record: Any) -> dict[str, float]:
    """Return the condition indicators of the driver's synchronous average: ``NAME.COMPONENT``; NaN if shorter than a
    turn."""
    from gearmbs.signals import INDICATORS, condition_indicators, phase_from_speed, time_synchronous_average
    from gearmbs.signals.files.simulated import record_signal

    signal = record_signal(record)
    try:
        average = time_synchronous_average(signal, phase_from_speed(signal, float(signal.attrs["speed"])))
        found = condition_indicators(average)
    except (KeyError, ValueError):
        names = [str(c) for c in record.component.values]
        return {f"{name}.{c}": float("nan") for name in INDICATORS for c in names}
    return {
        f"{name}.{channel}": float(found[name].values[k])
        for name in INDICATORS
        for k, channel in enumerate(found.channel.values)
    }


def _arrays(keep: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the arrays that the entries ``signal:NAME`` mean, and the channels of each: several may share one."""
    channels = {
        "acceleration": COMPONENTS,
        "transmission_error": ("transmission_error",),
        "force_1": ("x", "y", "z"),
        "force_2": ("x", "y", "z"),
    }
    found: dict[str, tuple[str, ...]] = {}
    for item in keep:
        if item.startswith("signal:"):
            name = item.removeprefix("signal:")
            whole = chosen({**dict.fromkeys(COMPONENTS), **channels}, name, "keep: ", CampaignError, "signal")
            array, asked = (name, whole) if whole else ("acceleration", (name,))
            found[array] = tuple(dict.fromkeys((*found.get(array, ()), *asked)))
    return found


def _signal(record: Any, name: str, channels: Sequence[str]) -> np.ndarray:
    """Return the values of a signal, shape (channels, samples)."""
    values = record[name]
    if name == "acceleration":
        values = values.sel(component=list(channels)).transpose("component", "signal_time")
    elif name.startswith("force"):
        values = values.transpose("xyz", "time")
    return np.atleast_2d(values.values)


class ClaimsSubject(Subject):
    """The paper's study at other settings.

    Keeps ``ratios``. For each component of the force: ``misaligned.C``, the least over both loads of misaligned over
    healthy at
    2 x GMF; ``distance.C``, the least over loads and harmonics of shifted over healthy; ``load.C``, the least over
    states and
    harmonics of high over low load, in one scale for all; ``load_each.C``, the same with each load in the scale of
    its own healthy
    state; and ``all.C``, 1 where all three claims hold as `gearmbs.studies.presets.paper_cases.judge` judges them.

    Parameters
    ----------
    settings : dict, optional
        Instead of the preset's `SETTINGS`.
    """

    kind: ClassVar[str] = "paper claims"
    keeps: ClassVar[tuple[str, ...]] = ("ratios",)

    def __init__(self, settings: dict[str, Any] | None = None) -> None:
        self.values = {name: value for name, (_, value) in SETTINGS.items()} | dict(settings or {})
        self._pairs = PairSubject()

    def settings(self) -> dict[str, Any]:
        """Return the settings."""
        return {"settings": json.loads(json.dumps(self.values))}

    @classmethod
    def from_settings(cls, settings: dict[str, Any]) -> ClaimsSubject:
        """Return the subject of a plan."""
        return cls(settings.get("settings"))

    def base(self) -> dict[str, Any]:
        """Return the settings."""
        return dict(self.values)

    def unit_of(self, path: str) -> str:
        """Return the SI unit of a setting."""
        if path not in SETTINGS:
            raise CampaignError(f"{path}: unknown; the open settings are {', '.join(SETTINGS)}")
        return SETTINGS[path][0]

    def check(self, data: dict[str, Any], name: str) -> list[Case]:
        """Return the six cases of a point."""
        from gearmbs.studies.case.limits import check_record
        from gearmbs.studies.presets.paper_cases import paper_cases

        s = data
        friction = (
            {"enabled": False} if s["friction"] <= 0.0 else {"static": s["friction"], "dynamic": 0.5 * s["friction"]}
        )
        mesh = 29 * s["speed"] / (2.0 * math.pi)
        base = make_case(
            {
                "name": name,
                "operation": {
                    "speed": s["speed"],
                    "torque": s["torque"],
                    "run_up": RUN_UP,
                    "settling": RUN_UP,
                    "duration": max(SHORTEST, PERIODS / mesh),
                },
                "contact": {
                    "stiffness": f"{s['stiffness']!r} N/mm^{s['exponent']!r}",
                    "exponent": s["exponent"],
                    "damping": s["damping"],
                    "depth": s["depth"],
                },
                "friction": friction,
                "fault": {"backlash": s["backlash"], "plane": s["plane"]},
                "gears": {"face_width": s["face_width"]},
                "shafts": {"radius": s["shaft_radius"]},
            },
            name,
        )
        cases = paper_cases(base=base, torques=(s["torque"], 2.0 * s["torque"]))
        for case in cases:
            check_record(case, f"{name}, {case.name}")
        return cases

    def canonical(self, thing: list[Case]) -> list[dict[str, Any]]:
        """Return the contents of the six cases."""
        return [canonical_case(case) for case in thing]

    def run(self, thing: list[Case], progress: Callable[[float], None], keep: Sequence[str]) -> xr.DataArray:
        """Return the harmonics of the six cases: dims (load, state, harmonic), by component."""
        import xarray as xr

        from gearmbs.studies.presets.paper_cases import LOAD_NAMES, STATES
        from gearmbs.studies.run.record import values_of

        levels = []
        for k, case in enumerate(thing):
            record = self._pairs.run(
                case,
                lambda fraction, k=k: progress((k + fraction) / len(thing)),  # type: ignore[misc]
                ("harmonics",),
            )
            (found,) = values_of(record, "gmf_rms")[values_of(record, "way") == "orders"]
            levels.append(found.T)
        shape = (len(LOAD_NAMES), len(STATES), *levels[0].shape)
        return xr.DataArray(
            np.array(levels).reshape(shape),
            dims=("load", "state", "component", "harmonic"),
            coords={
                "load": list(LOAD_NAMES),
                "state": list(STATES),
                "component": values_of(record, "component"),
                "harmonic": values_of(record, "harmonic"),
            },
        )

    def reduce(self, thing: list[Case], record: Any, keep: Sequence[str]) -> Kept:
        """Return the ratios that decide the claims."""
        return Kept(numbers=ratios(record))

    def explain(self, error: Exception) -> Outcome:
        """Return how a point failed of which a case failed."""
        return self._pairs.explain(error)


def ratios(levels: Any) -> dict[str, float]:
    """Return the ratios that decide the claims from harmonics of dims (load, state, component, harmonic)."""
    from gearmbs.studies.presets.paper_cases import judge

    found: dict[str, float] = {}
    for component in levels.component.values:
        table = levels.sel(component=component)
        healthy, tilted, apart = (table.sel(state=state) for state in table.state.values)
        found[f"misaligned.{component}"] = float((tilted / healthy).sel(harmonic=2).min())
        found[f"distance.{component}"] = float((apart / healthy).min())
        found[f"load.{component}"] = float((table.sel(load="high") / table.sel(load="low")).min())
        scaled = table / np.sqrt((healthy**2).sum("harmonic"))
        found[f"load_each.{component}"] = float((scaled.sel(load="high") / scaled.sel(load="low")).min())
        found[f"all.{component}"] = float(all(claim.held for claim in judge(table, str(component))))
    return found
