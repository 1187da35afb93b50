"""Simulate a case and record what the paper recorded."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

import gearmbs
from gearmbs.dae.solution import Solution
from gearmbs.mechanism.simulate import simulate
from gearmbs.signals import (
    decimate,
    even_signal,
    force_components,
    force_to_acceleration,
    gmf_rms,
    make_signal,
    trim,
)
from gearmbs.studies import rig
from gearmbs.studies.case import Case

EDGE = 0.01
"""Simulated beyond both ends of the record, s, for the filters to settle."""


class SimulationFailed(RuntimeError):
    """The integrator stopped early.

    Attributes
    ----------
    solution : Solution
        What was computed until then.
    """

    def __init__(self, message: str, solution: Solution) -> None:
        super().__init__(message)
        self.solution = solution


def simulate_case(
    case: Case, progress: bool | Callable[[float], None] = False, *, every_step: bool = False, **options
) -> Solution:
    """Integrate the mechanism of a case from rest to the end of its record.

    Returns
    -------
    Solution
        Sampled at the case's output rate, or at the integrator's own steps, from which :func:`record` makes signals
        without aliases; see its ``status``.
    """
    mechanism = case_mechanism(case)
    operation, solver = case.operation, case.solver
    t_end = operation.run_up + operation.settling + operation.duration + EDGE
    return simulate(
        mechanism,
        t_end,
        rate=None if every_step else solver.output_rate,
        every_step=every_step,
        integrator=solver.integrator,
        formulation=solver.formulation,
        tol=solver.used_tolerance,
        rate_scale=operation.speed * case.gears.teeth[0],
        progress=progress,
        **options,
    )


def case_mechanism(case: Case):
    """Return the mechanism of a case."""
    operation, shafts = case.operation, case.shafts
    return rig.gear_rig(
        case.pair(),
        speed=operation.speed,
        torque=operation.torque,
        run_up=operation.run_up,
        shaft_radius=shafts.radius,
        shaft_length=shafts.length,
        shaft_density=shafts.density,
    )


def run_case(case: Case, progress: bool | Callable[[float], None] = False) -> xr.Dataset:
    """Simulate a case and return its record: a pure function of the case.

    Returns
    -------
    Dataset
        ``force_1``, ``force_2``: force of the shaft on each gear at its seat, N, over ``time`` at the output rate;
        ``acceleration``: force on the driven gear over its mass, decimated to the signal rate, by component;
        ``gmf_rms``: RMS of the first three mesh harmonics by component, by band-pass and by orders; transmission
        error, contact forces and penetrations; parameters, versions and solver statistics in the attributes.

    Raises
    ------
    SimulationFailed
        If the integrator stops early; the exception carries the solution so far.
    """
    solution = simulate_case(case, progress, every_step=True)
    if not solution.success:
        raise SimulationFailed(f"case '{case.name}': {solution.message}", solution)
    return record(case, solution)


def record(case: Case, solution: Solution) -> xr.Dataset:
    """Return the record of a simulated case; see :func:`run_case`.

    Forces at uneven times are brought to the output rate through an anti-alias filter, the other series interpolated.
    """
    pair = case.pair()
    operation, solver = case.operation, case.solver
    start = operation.run_up + operation.settling
    stop = start + operation.duration
    rate = solver.output_rate
    labels: dict[str, Any] = {"units": "N", "speed": operation.speed, "teeth": case.gears.teeth}
    both = np.concatenate([solution.reaction(seat)[0] for seat in rig.SEATS], axis=1)
    names = [f"{k}{axis}" for k in (1, 2) for axis in "xyz"]
    known = solution.t
    if _is_even(known, rate):
        keep = known >= start - EDGE - 0.5 / rate
        forces = make_signal(both[keep], rate, channels=names, t0=float(known[keep][0]), **labels)
    else:
        forces = even_signal(known, both, rate, start=start - EDGE, stop=stop + EDGE, channels=names, **labels)
    t = forces["time"].values
    signal = forces.isel(channel=slice(3, 6)).assign_coords(channel=["x", "y", "z"])
    components = force_components(signal, pressure_angle=pair.working_pressure_angle, sense=pair.rotation)
    acceleration = force_to_acceleration(components, pair.wheels[1].mass)
    if solver.signal_rate < solver.output_rate:
        acceleration = decimate(acceleration, solver.signal_rate)
    acceleration = trim(acceleration, start, stop)
    levels = gmf_rms(acceleration)
    contact = solution.contact(rig.MESH)
    inside = (t >= start - 0.5 / rate) & (t < stop - 0.5 / rate)
    t = t[inside]
    each = [forces.values[inside, k : k + 3] for k in (0, 3)]
    data: dict[str, Any] = {
        "force_1": (("time", "xyz"), each[0], {"units": "N", "long_name": "force of shaft 1 on gear 1"}),
        "force_2": (("time", "xyz"), each[1], {"units": "N", "long_name": "force of shaft 2 on gear 2"}),
        "transmission_error": (
            "time",
            PchipInterpolator(known, transmission_error(case, solution))(t),
            {"units": "m", "long_name": "lag of the driven wheel at its base circle"},
        ),
    }
    for name, unit in (("normal_force", "N"), ("penetration_drive", "m"), ("penetration_back", "m")):
        data[name] = ("time", np.interp(t, known, contact[name]), {"units": unit, "long_name": name.replace("_", " ")})
    latest = np.clip(np.searchsorted(known, t, side="right") - 1, 0, known.size - 1)
    for name in ("pairs_drive", "pairs_back"):
        data[name] = ("time", contact[name][latest], {"units": "1", "long_name": name.replace("_", " ")})
    dataset = xr.Dataset(data, coords={"time": ("time", t, {"units": "s"}), "xyz": ["x", "y", "z"]})
    plain = acceleration.drop_vars(["channel_units", "units"], errors="ignore")
    dataset["acceleration"] = plain.rename(time="signal_time", channel="component")
    dataset["acceleration"].attrs.update(
        units="m/s^2", long_name="force on the driven gear over its mass (Newton's second law)"
    )
    ways = xr.concat([levels["band"], levels["orders"]], dim="way").assign_coords(way=["band", "orders"])
    dataset["gmf_rms"] = ways.drop_vars(["channel_units", "units"], errors="ignore").rename(channel="component")
    dataset["gmf_rms"].attrs = {"units": "m/s^2", "long_name": "RMS of the gear mesh frequency harmonics"}
    dataset.attrs = attributes_of(case, solution)
    return dataset


def _is_even(t: np.ndarray, rate: float) -> bool:
    return bool(np.allclose(np.diff(t) * rate, 1.0, atol=1e-6))


def transmission_error(case: Case, solution: Solution) -> np.ndarray:
    """Return the lag of the driven wheel behind the driver at the driven base circle, m, shape (m,)."""
    pair = case.pair()
    place = pair.placement(0.0)
    angles = []
    for gear, axes in zip(rig.GEARS, (place.axes_1, place.axes_2)):
        x_axis = solution.orientation(gear)[:, :, 0] @ axes
        angles.append(np.unwrap(np.arctan2(x_axis[:, 1], x_axis[:, 0])))
    ratio = case.gears.teeth[0] / case.gears.teeth[1]
    return pair.rotation * pair.wheels[1].base_radius * (angles[0] * ratio + angles[1])


def attributes_of(case: Case, solution: Solution | None = None) -> dict[str, Any]:
    """Return every parameter of a case, the versions and the solver's statistics as flat attributes."""
    out: dict[str, Any] = {"title": f"gear pair: {case.name}", "case": case.name}
    for section, values in case.model_dump().items():
        if isinstance(values, dict):
            for key, value in values.items():
                name = f"{section}_{key}"
                if value is None:
                    out[name] = "default"
                elif name == "fault_teeth":
                    out[name] = json.dumps(value)
                elif isinstance(value, bool):
                    out[name] = int(value)
                else:
                    out[name] = list(value) if isinstance(value, tuple) else value
    out["solver_tolerance"] = case.solver.used_tolerance
    out["mesh_frequency"] = case.mesh_frequency
    out["case_json"] = case.model_dump_json()
    out["gearmbs_version"] = gearmbs.__version__
    for package in ("numpy", "scipy", "numba", "scikit-sundae", "xarray"):
        out[f"{package.replace('-', '_')}_version"] = version(package)
    out["python_version"] = platform.python_version()
    if solution is not None:
        out.update({f"solver_{key}": value for key, value in solution.stats.as_dict().items()})
    return out
