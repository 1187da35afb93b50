"""The record of a case from what was measured of its solution."""

from __future__ import annotations

import functools
import json
import platform
import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import gearmbs
from gearmbs._lazy import spare_duck_arrays, uncollected
from gearmbs.dae.results.solution import Solution
from gearmbs.signals import even_signal, make_signal
from gearmbs.signals.conversion import COMPONENTS, component_values
from gearmbs.signals.filters import apply_zero_phase, decimation_taps
from gearmbs.signals.resampling import monotone_cubic
from gearmbs.signals.signal.signal import check_finite, check_rate, check_speed, check_teeth
from gearmbs.studies.case.case import Case, CaseError
from gearmbs.studies.case.limits import remarks
from gearmbs.studies.case.sections import units_of_fields
from gearmbs.studies.run.levels import LEVELS, level_parts, levels_of, tracked_levels
from gearmbs.studies.run.recorder import COUNTS, SMOOTH, Measured, Span, span_of, to_mesh

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.gears import GearPair
    from gearmbs.mechanism import Mechanism


# From what was measured of a solution to the variables of a record; only those that are asked for.


FORCES = ("force_1", "force_2")
RESULTANT = COMPONENTS[-1]
SERIES = (*FORCES, "transmission_error", *SMOOTH, *COUNTS)
VARIABLES = (*SERIES, "acceleration", *LEVELS)
"""Variables of a record."""


def check_variables(variables: Collection[str] | None) -> None:
    """Refuse names that are no variables of a record.

    Raises
    ------
    CaseError
    """
    for name in variables or ():
        if name not in VARIABLES:
            raise CaseError(f"variables: {name!r} is unknown; choose of {', '.join(VARIABLES)}")


Parts = tuple[dict[str, Any], dict[str, Any]]
"""Variables and coordinates of a dataset, as it takes them: dimensions, values and attributes."""


@dataclass
class PlainRecord:
    """What a record holds, as plain arrays: whoever asks for a number of it loads no xarray, but of a run-up.

    Attributes
    ----------
    data, coords : dict
        Variables and coordinates, as `xarray.Dataset` takes them.
    told : dict
        What the run says of the record, besides what its case and its solver do.
    """

    case: Case
    solution: Solution
    data: dict[str, Any]
    coords: dict[str, Any]
    told: dict[str, Any] = field(default_factory=dict)

    def __contains__(self, name: str) -> bool:
        return name in self.data

    def values(self, name: str) -> np.ndarray:
        """Return the values of a variable or of a coordinate."""
        found = self.data[name] if name in self.data else self.coords[name]
        return np.asarray(found[1] if isinstance(found, tuple) else found)

    def dataset(self) -> xr.Dataset:
        """Return the record of `gearmbs.studies.run_case`."""
        # the first one loads xarray and what xarray loads
        with uncollected():
            dataset = _dataset(self.data, self.coords)
        dataset.attrs = attributes_of(self.case, self.solution) | self.told
        return dataset


def values_of(record: PlainRecord | xr.Dataset, name: str) -> np.ndarray:
    """Return the values of a variable or of a coordinate of a record, with dimensions in the order of `evaluate`."""
    return record.values(name) if isinstance(record, PlainRecord) else record[name].values


def dims_of(record: PlainRecord | xr.Dataset, name: str) -> tuple[str, ...]:
    """Return the dimensions of a variable of a record."""
    found = record.data[name] if isinstance(record, PlainRecord) else record[name]
    return tuple(found[0] if isinstance(found, tuple) else map(str, found.dims))


def told_of(record: PlainRecord | xr.Dataset) -> Mapping[Any, Any]:
    """Return what a run says of its record; of a dataset all attributes."""
    return record.told if isinstance(record, PlainRecord) else record.attrs


def _dataset(data: dict[str, Any], coords: dict[str, Any]) -> xr.Dataset:
    import pandas as pd
    import xarray as xr

    spare_duck_arrays()
    if "time" in coords:
        # the times as they are, not a copy of them
        dims, t, attributes = coords["time"]
        coords = coords | {"time": (dims, pd.Index(t, copy=False), attributes)}
    return xr.Dataset(data, coords=coords)


def evaluate(
    case: Case,
    known: Measured | None,
    *,
    even: bool,
    variables: Collection[str] | None = None,
    span: Span | None = None,
    signal_stop: float | None = None,
    levels: np.ndarray | None = None,
) -> Parts:
    """Return variables of a case's record and their coordinates; see `gearmbs.studies.run_case`.

    Parameters
    ----------
    known : Measured or None
        At the output rate, or at uneven times that are brought to it through an anti-alias filter. None if nothing is
        wanted but levels that are known.
    even : bool
        Which of the two.
    variables : collection of str, optional
        Of `VARIABLES`; default all.
    span : Span, optional
        Start and end of the record; default those of the case.
    signal_stop : float, optional
        End of the acceleration, s, where it is not the record's.
    levels : ndarray, shape (2, harmonics, components), optional
        RMS of the mesh harmonics by band and by orders, if they are known; default from the acceleration.
    """
    level = LEVELS[0 if case.operation.speed_curve is None else 1]
    wanted = set(VARIABLES if variables is None else variables) - (set(LEVELS) - {level})
    start, stop = span or span_of(case)
    signal_stop = stop if signal_stop is None else signal_stop
    made = wanted - {"gmf_rms"} if levels is not None else wanted
    if known is None:
        return _levels_alone(case, levels, wanted)
    if even:
        first = int(np.searchsorted(known.t, start - case.edge - 0.5 / case.output_rate))
        contact = {name: values[first:] for name, values in known.contact.items()}
        known = Measured(known.t[first:], known.forces[first:], known.error[first:], contact)
    forces = _even_forces(case, known, start, signal_stop if made & {"acceleration"} else stop, made, even=even)
    # all at once: a dataset to which one variable after the other is added compares its coordinates each time
    data, coords = _series(case, known, forces, (start, stop), wanted, even=even) if wanted & set(SERIES) else ({}, {})
    of_levels: dict[str, Any] = {}
    if levels is not None and level in wanted:
        data[level], of_levels = level_parts(levels, np.array(COMPONENTS), case.mesh_frequency)
    if made & {"acceleration", *LEVELS}:
        assert forces is not None
        pair = case.pair()
        about = _about_acceleration(case, pair)
        t, acceleration = _acceleration(case, pair, forces, start, signal_stop)
        turning = {} if case.operation.speed_curve is None else _turning(case, t)
        if "acceleration" in wanted:
            told = {
                **about,
                "units": "m/s^2",
                "long_name": "force on the driven gear over its mass (Newton's second law)",
                "teeth_in_mesh": teeth_in_mesh(case, pair, start),
            }
            data["acceleration"] = ("signal_time", "component"), acceleration, told
            coords["signal_time"] = ("signal_time", t, {"units": "s"})
            coords["component"] = np.array(COMPONENTS)
            coords |= turning
        if level in made and level == "gmf_rms":
            data[level], of_levels = level_parts(
                levels_of(case, acceleration), np.array(COMPONENTS), case.mesh_frequency
            )
        elif level in made:
            signal = make_signal(
                acceleration,
                case.signal_rate,
                units="m/s^2",
                channels=COMPONENTS,
                t0=float(t[0]),
                attrs=about,
            )
            data[level] = tracked_levels(case, signal, turning)
    return data, {**coords, **of_levels}


def _levels_alone(case: Case, levels: np.ndarray | None, wanted: Collection[str]) -> Parts:
    """Return the RMS of the mesh harmonics that are known, if they are wanted, and nothing else."""
    if levels is None or "gmf_rms" not in wanted:
        return {}, {}
    variable, coords = level_parts(levels, np.array(COMPONENTS), case.mesh_frequency)
    return {"gmf_rms": variable}, coords


def needs_series(variables: Collection[str]) -> bool:
    """Return whether any of some variables is made from what was measured over time, where levels are known."""
    return bool(set(variables) - set(LEVELS))


class _EvenForces(NamedTuple):
    """Forces at the output rate, N, plain arrays: where they are samples already, no copy is made of them."""

    t: np.ndarray
    values: np.ndarray
    channels: list[str]


def _even_forces(
    case: Case, known: Measured, start: float, stop: float, wanted: set[str], *, even: bool
) -> _EvenForces | None:
    """Return the forces that are needed at the output rate, with the edges that filters use up; None if none are."""
    wheels = [1] if "force_1" in wanted else []
    wheels += [2] if wanted & {"force_2", "acceleration", *LEVELS} else []
    if not wheels:
        return None
    ahead = case.edge
    names = [f"{wheel}{axis}" for wheel in wheels for axis in "xyz"]
    first, last = 3 * (wheels[0] - 1), 3 * wheels[-1]
    if wanted & {"acceleration", *LEVELS}:
        names.append(RESULTANT)
        last += 1
    values = known.forces[:, first:last]
    if even:
        return _EvenForces(known.t, values, names)
    signal = even_signal(known.t, values, case.output_rate, start=start - ahead, stop=stop + ahead)
    # those of an index are not to be written to, as kernels want them
    return _EvenForces(signal["time"].values.copy(), signal.values, names)


def _series(
    case: Case, known: Measured, forces: _EvenForces | None, span: tuple[float, float], wanted: set[str], *, even: bool
) -> Parts:
    """Return the variables over time that are wanted, and their coordinates."""
    rate = case.output_rate
    t = _even_times(case, known, *span, even=even) if forces is None else forces.t
    inside = slice(*np.searchsorted(t, [at - 0.5 / rate for at in span]))
    t = t[inside]
    values: dict[str, np.ndarray] = {}
    for name in FORCES:
        if name in wanted and forces is not None:
            first = forces.channels.index(f"{name[-1]}x")
            values[name] = forces.values[inside, first : first + 3]
    if even:
        told = {"transmission_error": known.error, **known.contact}
        return _parts_over_time(t, values | {name: told[name][inside] for name in told if name in wanted})
    values = {name: force.copy() for name, force in values.items()}
    if "transmission_error" in wanted:
        values["transmission_error"] = monotone_cubic(known.t, known.error, t)
    values |= {name: np.interp(t, known.t, known.contact[name]) for name in SMOOTH if name in wanted}
    if wanted & set(COUNTS):
        latest = np.clip(np.searchsorted(known.t, t, side="right") - 1, 0, known.t.size - 1)
        values |= {name: known.contact[name][latest] for name in COUNTS if name in wanted}
    return _parts_over_time(t, values)


def _even_times(case: Case, known: Measured, start: float, stop: float, *, even: bool) -> np.ndarray:
    """Return the times at which forces would be, to the last digit."""
    rate, ahead = case.output_rate, case.edge
    if even:
        return known.t
    first, last = int(np.ceil((start - ahead) * rate - 1e-6)), int(np.floor((stop + ahead) * rate + 1e-6))
    return first / rate + np.arange(last - first + 1) / rate


def time_series(t: np.ndarray, values: dict[str, np.ndarray]) -> xr.Dataset:
    """Return the dataset of variables over time, whichever of `SERIES` there are; numbers of teeth are integers."""
    return _dataset(*_parts_over_time(t, values))


def _parts_over_time(t: np.ndarray, values: dict[str, np.ndarray]) -> Parts:
    """Return variables and coordinates of `time_series`."""
    units = {**SMOOTH, **COUNTS, "transmission_error": "m"}
    long_names = {"transmission_error": "lag of the driven wheel at its base circle"}
    data: dict[str, Any] = {}
    for name in SERIES:
        if name not in values:
            continue
        if name in FORCES:
            wheel = name[-1]
            text = f"force of shaft {wheel} on gear {wheel}"
            data[name] = (("time", "xyz"), values[name], {"units": "N", "long_name": text})
        else:
            text = long_names.get(name, name.replace("_", " "))
            series = values[name].astype(np.int16, copy=False) if name in COUNTS else values[name]
            data[name] = ("time", series, {"units": units[name], "long_name": text})
    coords: dict[str, Any] = {"time": ("time", t, {"units": "s"})}
    if any(name in data for name in FORCES):
        coords["xyz"] = ["x", "y", "z"]
    return data, coords


def _acceleration(
    case: Case, pair: GearPair, forces: _EvenForces, start: float, stop: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return times and the components of the force on the driven gear over its mass, at the signal rate."""
    rate = case.signal_rate
    force, t = forces.values[:, -4:], forces.t
    if rate < case.output_rate:
        ratio = round(case.output_rate / rate)
        force, first = apply_zero_phase(force, decimation_taps(ratio, case.output_rate), "trim", step=ratio)
        t = t[first] + np.arange(len(force)) / rate
    first, last = np.searchsorted(t, [at - 0.5 / rate for at in (start, stop)])
    force = force[first:last]
    values = component_values(force[:, :-1], pair.working_pressure_angle, to_mesh(pair), sense=pair.rotation)
    values[:, -1] = force[:, -1]
    values /= pair.wheels[1].mass
    check_finite(values)
    return t[first] + np.arange(len(values)) / rate, values


def _about_acceleration(case: Case, pair: GearPair) -> dict[str, Any]:
    """Return what is known of the acceleration besides its values."""
    return {
        "pressure_angle": pair.working_pressure_angle,
        "mass": pair.wheels[1].mass,
        "sampling_rate": check_rate(case.signal_rate),
        "speed": check_speed(case.operation.top_speed),
        "teeth": check_teeth(case.gears.teeth),
    }


def teeth_in_mesh(case: Case, pair: GearPair, time: float) -> list[float]:
    """Return which teeth are on the line of centres at a time: ``[time, number, step, number, step]``, driver first.

    A wheel turned by psi from where its tooth 0 points along x has tooth z (mu - psi) / (2 pi) in the direction mu of
    the mesh: pi from the driven wheel, and from a driver inside a ring, else 0. A step is what the number changes by
    for each pitch that passes, 1 or -1; wheels turn against each other unless one is a ring.
    """
    sense = pair.operating_point.rotation
    driver = sense * case.driver_angle(time)
    teeth, external = case.gears.teeth, pair.geometry.sign > 0
    driven = pair.driven_angle(0.0) - (1 if external else -1) * driver * teeth[0] / teeth[1]
    out = [float(time)]
    for count, mesh, angle, step in (
        (teeth[0], pair.geometry.mesh_angle, driver, -sense),
        (teeth[1], np.pi, driven, sense if external else -sense),
    ):
        out += [float((mesh - angle) * count / (2.0 * np.pi) % count), float(step)]
    return out


def _turning(case: Case, t: np.ndarray) -> dict[str, Any]:
    """Return speed and angle of the driver over the times of a signal, as prescribed."""
    operation, function = case.operation, case.driver_angle
    begin = function(operation.run_up + operation.settling)
    angle, speed, _ = np.array([function.derivatives(at) for at in t]).T
    return {
        "speed": ("signal_time", speed, {"units": "rad/s", "long_name": "speed of the driver"}),
        "angle": ("signal_time", angle - begin, {"units": "rad", "long_name": "angle of the driver"}),
    }


# What a record says of itself: every parameter of its case, its bearings, the versions, and what the run cost.


@functools.cache
def _version(package: str) -> str:
    """Return the version of an installed package: its own word, where it has been imported, takes no file to parse."""
    own = getattr(sys.modules.get(package), "__version__", None)
    return version(package) if own is None else own


def title_of(case: Case) -> str:
    """Return the title of a case's record."""
    return f"gear pair: {case.name}"


def attributes_of(case: Case, solution: Solution | None = None) -> dict[str, Any]:
    """Return every parameter of a case, the versions and the solver's statistics as flat attributes.

    The unit of a quantity is beside it: ``operation_speed`` has ``operation_speed_units``. What is unusual about the
    case is said in ``remarks``.
    """
    out: dict[str, Any] = {"title": title_of(case), "case": case.name}
    for section in ("gears", "shafts", "operation", "fault", "contact", "friction", "solver"):
        settings = getattr(case, section)
        units = units_of_fields(settings)
        for key, value in settings.model_dump().items():
            name = f"{section}_{key}"
            if name in ("operation_speed", "operation_torque") and isinstance(value, tuple):
                out[f"{name}_curve"] = json.dumps(value)
                value = max(number for _, number in value)
            if value is None:
                out[name] = "default"
            elif name == "fault_teeth":
                out[name] = json.dumps(value)
            elif isinstance(value, bool):
                out[name] = int(value)
            else:
                out[name] = list(value) if isinstance(value, tuple) else value
                if key in units and not isinstance(value, str):
                    out[f"{name}_units"] = units[key]
    out["solver_tolerance"], out["solver_lump"] = case.tolerance, int(case.lump)
    for name, rate in (("signal_rate", case.signal_rate), ("output_rate", case.output_rate)):
        out[f"solver_{name}"], out[f"solver_{name}_units"] = rate, "Hz"
    pair = case.pair()
    out["operation_torque_of"] = "driven wheel"
    out["contact_law"] = str(pair.contact)
    out["contact_ratio"] = pair.contact_ratio
    out["face_slices"] = pair.face_slices
    out["remarks"] = "; ".join(remarks(case)) or "none"
    out["mesh_frequency"] = case.mesh_frequency
    out["mesh_frequency_units"] = "Hz"
    out["case_json"] = case.model_dump_json()
    out["gearmbs_version"] = gearmbs.__version__
    for package in ("numpy", "scipy", "numba", "scikit-sundae", "xarray"):
        out[f"{package.replace('-', '_')}_version"] = _version(package)
    out["python_version"] = platform.python_version()
    if solution is not None:
        out.update({f"solver_{key}": value for key, value in solution.stats.as_dict().items()})
        out.update(cost(case, solution))
    return out


def cost(case: Case, solution: Solution) -> dict[str, Any]:
    """Return what a run cost: seconds simulated in a second of the solver, and its time for each cycle of the mesh.

    The first falls with the speed of the wheels, the second hardly does.
    """
    end, spent = float(solution.t[-1]), solution.stats.wall_time
    cycles = case.gears.teeth[0] * case.driver_angle(end) / (2.0 * np.pi)
    return {
        "solver_mesh_cycles": cycles,
        "solver_real_time_factor": end / spent if spent > 0.0 else 0.0,
        "solver_time_per_mesh_cycle": spent / cycles if cycles > 0.0 else 0.0,
        "solver_time_per_mesh_cycle_units": "s",
    }


def bearing_attributes(mechanism: Mechanism | None, title: str = "") -> dict[str, Any]:
    """Return what a record says of the rolling bearings of its mechanism, which its case does not know.

    Returns
    -------
    dict
        ``title``; ``bearings`` and ``bearing_defects`` in words; ``bearings_json``: of each by name its bearing, the
        settings other than the defaults and its defects with labels, in SI. Empty without rolling bearings.
    """
    if mechanism is None or not any(e.kind == "rolling bearing" for e in mechanism.elements.values()):
        return {}
    from gearmbs.bearings.element import described

    mounted = described(mechanism)
    words = {name: [d["label"] for d in one["defects"]] for name, one in mounted.items()}
    kinds = {one["bearing"]["designation"] or one["bearing"]["kind"] for one in mounted.values()}
    return {
        "title": f"{title} on rolling bearings",
        "bearings": f"{len(mounted)} rolling bearings {', '.join(sorted(kinds))}",
        "bearing_defects": "; ".join(f"{name}: {', '.join(labels)}" for name, labels in words.items() if labels)
        or "none",
        "bearings_json": json.dumps(mounted),
    }


def flank_shares(record: xr.Dataset) -> tuple[str, str]:
    """Return for how many per cent of the time the record teeth touch with both flanks, and with none, as texts."""
    drive, back = record["pairs_drive"].values > 0, record["pairs_back"].values > 0
    return f"{100 * np.mean(drive & back):.3g}", f"{100 * np.mean(~drive & ~back):.3g}"
