"""From what was measured of a solution to the variables of a record; only those that are asked for."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.signals import (
    decimate,
    even_signal,
    force_components,
    force_to_acceleration,
    gmf_rms,
    make_signal,
    trim,
)
from gearmbs.signals.monotone_cubic import monotone_cubic
from gearmbs.studies.case import Case, CaseError
from gearmbs.studies.drive import drive_angle
from gearmbs.studies.limits import HARMONICS, edge
from gearmbs.studies.measured import COUNTS, SMOOTH, Measured

if TYPE_CHECKING:
    import xarray as xr

FORCES = ("force_1", "force_2")
LEVELS = ("gmf_rms", "order_rms")
"""RMS of the mesh harmonics: at constant speed, and of a run-up. A record has one of them."""

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


def evaluate(case: Case, known: Measured, *, even: bool, variables: Collection[str] | None = None) -> xr.Dataset:
    """Return variables of a case's record, without attributes; see `gearmbs.studies.run_case`.

    Parameters
    ----------
    known : Measured
        At the output rate, or at uneven times that are brought to it through an anti-alias filter.
    even : bool
        Which of the two.
    variables : collection of str, optional
        Of `VARIABLES`; default all.
    """
    import xarray as xr

    level = LEVELS[0 if case.operation.speed_curve is None else 1]
    wanted = set(VARIABLES if variables is None else variables) - (set(LEVELS) - {level})
    start = case.operation.run_up + case.operation.settling
    stop = start + case.operation.duration
    dataset = xr.Dataset()
    forces = _even_forces(case, known, start, stop, wanted, even=even)
    if wanted & set(SERIES):
        dataset = _series(case, known, forces, (start, stop), wanted, even=even)
    if not wanted & {"acceleration", *LEVELS}:
        return dataset
    assert forces is not None
    acceleration = _acceleration(case, forces, start, stop)
    plain = acceleration.drop_vars(["channel_units", "units"], errors="ignore")
    dataset["acceleration"] = plain.rename(time="signal_time", channel="component")
    dataset["acceleration"].attrs.update(
        units="m/s^2",
        long_name="force on the driven gear over its mass (Newton's second law)",
        teeth_in_mesh=teeth_in_mesh(case, start),
    )
    if case.operation.speed_curve is not None:
        dataset = dataset.assign_coords(_turning(case, dataset["signal_time"].values))
    if level in wanted:
        dataset[level] = (
            _mesh_levels(acceleration) if level == "gmf_rms" else _tracked_levels(case, acceleration, dataset)
        )
    if "acceleration" not in wanted:
        dataset = dataset.drop_vars(["acceleration", "signal_time", "speed", "angle"], errors="ignore")
    return dataset


def _even_forces(
    case: Case, known: Measured, start: float, stop: float, wanted: set[str], *, even: bool
) -> xr.DataArray | None:
    """Return the forces that are needed at the output rate, with the edges that filters use up; None if none are."""
    wheels = [1] if "force_1" in wanted else []
    wheels += [2] if wanted & {"force_2", "acceleration", *LEVELS} else []
    if not wheels:
        return None
    rate, ahead = case.output_rate, edge(case)
    labels: dict[str, Any] = {"units": "N", "speed": case.operation.top_speed, "teeth": case.gears.teeth}
    names = [f"{wheel}{axis}" for wheel in wheels for axis in "xyz"]
    columns = [3 * (wheel - 1) + k for wheel in wheels for k in range(3)]
    if even:
        keep = known.t >= start - ahead - 0.5 / rate
        values = known.forces[keep][:, columns]
        return make_signal(values, rate, channels=names, t0=float(known.t[keep][0]), **labels)
    values = known.forces if len(columns) == 6 else known.forces[:, columns]
    return even_signal(known.t, values, rate, start=start - ahead, stop=stop + ahead, channels=names, **labels)


def _series(
    case: Case, known: Measured, forces: xr.DataArray | None, span: tuple[float, float], wanted: set[str], *, even: bool
) -> xr.Dataset:
    """Return the variables over time that are wanted."""
    rate = case.output_rate
    t = _even_times(case, known, *span, even=even) if forces is None else forces["time"].values
    inside = slice(*np.searchsorted(t, [at - 0.5 / rate for at in span]))
    t = t[inside].copy()
    values: dict[str, np.ndarray] = {}
    for name in FORCES:
        if name in wanted and forces is not None:
            first = list(forces["channel"].values).index(f"{name[-1]}x")
            values[name] = forces.values[inside, first : first + 3].copy()
    if "transmission_error" in wanted:
        values["transmission_error"] = monotone_cubic(known.t, known.error, t)
    values |= {name: np.interp(t, known.t, known.contact[name]) for name in SMOOTH if name in wanted}
    if wanted & set(COUNTS):
        latest = np.clip(np.searchsorted(known.t, t, side="right") - 1, 0, known.t.size - 1)
        values |= {name: known.contact[name][latest] for name in COUNTS if name in wanted}
    return time_series(t, values)


def _even_times(case: Case, known: Measured, start: float, stop: float, *, even: bool) -> np.ndarray:
    """Return the times at which forces would be, to the last digit."""
    rate, ahead = case.output_rate, edge(case)
    if even:
        return known.t[known.t >= start - ahead - 0.5 / rate]
    first, last = int(np.ceil((start - ahead) * rate - 1e-6)), int(np.floor((stop + ahead) * rate + 1e-6))
    return first / rate + np.arange(last - first + 1) / rate


def time_series(t: np.ndarray, values: dict[str, np.ndarray]) -> xr.Dataset:
    """Return the dataset of variables over time, whichever of `SERIES` there are."""
    import xarray as xr

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
            data[name] = ("time", values[name], {"units": units[name], "long_name": text})
    coords: dict[str, Any] = {"time": ("time", t, {"units": "s"})}
    if any(name in data for name in FORCES):
        coords["xyz"] = ["x", "y", "z"]
    return xr.Dataset(data, coords=coords)


def _acceleration(case: Case, forces: xr.DataArray, start: float, stop: float) -> xr.DataArray:
    """Return the components of the force on the driven gear over its mass, at the signal rate."""
    pair = case.pair()
    components = force_components(
        forces, pressure_angle=pair.working_pressure_angle, sense=pair.rotation, channels=("2x", "2y", "2z")
    )
    acceleration = force_to_acceleration(components, pair.wheels[1].mass)
    if case.signal_rate < case.output_rate:
        acceleration = decimate(acceleration, case.signal_rate)
    return trim(acceleration, start, stop)


def _mesh_levels(acceleration: xr.DataArray) -> xr.DataArray:
    """Return the RMS of the mesh harmonics by both ways."""
    import xarray as xr

    levels = gmf_rms(acceleration)
    ways = ("band", "orders")
    found = xr.DataArray(
        np.stack([levels[way].values for way in ways]),
        dims=("way", "harmonic", "component"),
        coords={
            "harmonic": levels["harmonic"].variable,
            "frequency": levels["frequency"].variable,
            "component": levels["channel"].values,
            "way": list(ways),
        },
    )
    found.attrs = {"units": "m/s^2", "long_name": "RMS of the gear mesh frequency harmonics"}
    return found


def _tracked_levels(case: Case, acceleration: xr.DataArray, dataset: xr.Dataset) -> xr.DataArray:
    """Return the RMS of the mesh orders along a run-up, by order tracking over four revolutions at a time."""
    # what only run-ups need takes longer to load than many a simulation
    from gearmbs.signals import order_track

    turning = {name: ("time", dataset[name].values, dataset[name].attrs) for name in ("speed", "angle")}
    orders = [float(case.gears.teeth[0] * k) for k in range(1, HARMONICS + 1)]
    tracks = order_track(acceleration.assign_coords(turning), orders=orders, scaling="rms")
    found = tracks.rename(time="track_time", speed="track_speed", angle="track_angle", order="harmonic")
    found = found.rename(channel="component").drop_vars(["units", "channel_units"], errors="ignore")
    found = found.assign_coords(harmonic=np.arange(1, HARMONICS + 1))
    found.attrs = {"units": "m/s^2", "long_name": "RMS of the mesh orders along the run-up"}
    return found


def teeth_in_mesh(case: Case, time: float) -> list[float]:
    """Return which teeth are on the line of centres at a time: ``[time, number, step, number, step]``, driver first.

    A wheel turned by psi from where its tooth 0 points along x has tooth z (mu - psi) / (2 pi) in the direction mu of
    the mesh: pi from the driven wheel, and from a driver inside a ring, else 0. A step is what the number changes by
    for each pitch that passes, 1 or -1; wheels turn against each other unless one is a ring.
    """
    operation, pair = case.operation, case.pair()
    sense = pair.operating_point.rotation
    driver = drive_angle(operation.speed, operation.run_up, operation.run_up + operation.settling, sense)(time)
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
    operation = case.operation
    start = operation.run_up + operation.settling
    function = drive_angle(operation.speed, operation.run_up, start)
    begin = function(start)
    angle, speed, _ = np.array([function.derivatives(at) for at in t]).T
    return {
        "speed": ("signal_time", speed, {"units": "rad/s", "long_name": "speed of the driver"}),
        "angle": ("signal_time", angle - begin, {"units": "rad", "long_name": "angle of the driver"}),
    }
