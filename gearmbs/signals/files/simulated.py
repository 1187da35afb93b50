"""Records that this package's simulations wrote, as signals, and the texts that name them on a command line.

Nothing here needs the simulation itself: a record says all that is needed in its variables and attributes.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from gearmbs.signals.errors import SignalError
from gearmbs.signals.files.formats import read_signal
from gearmbs.signals.signal.signal import make_signal, with_metadata

AT_REST = 0.01
"""Part of its highest speed by which a shaft that starts or comes to rest may swing back: no line is told there."""
STILL = 1e-6
"""Part of the fastest speed up to which a mean one is none: what a vibrating shaft keeps over a record."""


def parse_states(items: Sequence[str], what: str = "experiment") -> dict[str, dict[str, Path]]:
    """Read texts ``load:state=path`` into nested dictionaries, in the order given.

    Raises
    ------
    SignalError
        For a text of another form, or a state named twice.
    """
    out: dict[str, dict[str, Path]] = {}
    for item in items:
        name, equals, path = item.partition("=")
        load, colon, state = name.partition(":")
        if not (equals and colon and load and state and path):
            raise SignalError(f"{what} {item!r}: write load:state=path, for instance low:healthy=h0.csv")
        states = out.setdefault(load.strip(), {})
        if state.strip() in states:
            raise SignalError(f"{what} {item!r}: {load}:{state} is given twice")
        states[state.strip()] = Path(path)
    return out


def record_signal(record: xr.Dataset, component: str | None = None) -> xr.DataArray:
    """Return the acceleration of a simulated record as a signal, for everything that measured signals are good for.

    Parameters
    ----------
    record : Dataset
        From `run_case`, or its file.
    component : str, optional
        One component of the force only, such as "line_of_action"; default: each is a channel.

    Returns
    -------
    DataArray
        Dimensions (time, channel), m/s^2, with sampling rate, speed and teeth: the force on the driven gear over its
        mass, with its mean, no reading of an accelerometer (attribute ``quantity``). Of a run-up the coordinates
        ``speed`` (rad/s) and ``angle`` (rad) over time, and no single speed.

    Raises
    ------
    SignalError
        If this is no record of a case, or has no such component.
    """
    attributes = record.attrs
    if "acceleration" not in record or "operation_speed" not in attributes:
        raise SignalError("record: not the record of a case; pass what run_case returned or its file holds")
    names = [str(c) for c in record.component.values]
    if component is not None and component not in names:
        raise SignalError(f"component: there is no {component!r}; choose one of {', '.join(names)}")
    kept = names if component is None else [component]
    turning = [name for name in ("speed", "angle") if name in record.coords and record[name].dims == ("signal_time",)]
    signal = make_signal(
        record["acceleration"].sel(component=kept).transpose("signal_time", "component").values,
        float(attributes["solver_signal_rate"]),
        units="m/s^2",
        channels=kept,
        t0=float(record.signal_time.values[0]),
        speed=None if turning else float(attributes["operation_speed"]),
        teeth=tuple(int(z) for z in attributes["gears_teeth"]),
        attrs={
            "source": str(attributes.get("case", "simulation")),
            "quantity": "force over mass",
            **_numbering(record),
        },
    )
    return signal.assign_coords({name: ("time", record[name].values, record[name].attrs) for name in turning})


def _numbering(record: xr.Dataset) -> dict[str, tuple[float, ...]]:
    """Return the teeth in mesh at the start of a record, where it says them; see `time_synchronous_average`."""
    found = record["acceleration"].attrs.get("teeth_in_mesh")
    return {} if found is None else {"teeth_in_mesh": tuple(float(x) for x in np.ravel(found))}


class MeshOfRecord(NamedTuple):
    """What turns in a mesh of a drivetrain's record: its driver, and where it is planets that mesh their carrier."""

    driver: str
    carrier: str
    teeth: tuple[int, int]


def mesh_of_record(record: xr.Dataset, mesh: str | None = None) -> MeshOfRecord:
    """Return what turns in a mesh, by default the first, of a drivetrain's record."""
    mesh = str(record.mesh.values[0]) if mesh is None else mesh
    planets = json.loads(record.attrs.get("planet_meshes", "{}"))
    if mesh in planets:
        driver, carrier, teeth = planets[mesh]
        return MeshOfRecord(driver, carrier, tuple(teeth))  # type: ignore[arg-type]
    parts = json.loads(record.attrs["train_json"])
    wheels = [parts[parts[mesh][side]] for side in ("driver", "driven")]
    one, two = (abs(int(wheel["gear"]["teeth"])) for wheel in wheels)
    return MeshOfRecord(wheels[0]["shaft"], "", (one, two))


def driver_speed(record: xr.Dataset, mesh: str | None = None) -> np.ndarray:
    """Return the speed of the driver of a mesh over time, of planets that mesh against their carrier, rad/s."""
    turning, found = set(map(str, record.shaft.values)), mesh_of_record(record, mesh)
    zero = np.zeros(record.sizes["time"])
    one, carrier = (
        record["speed"].sel(shaft=body).values if body in turning else zero for body in (found.driver, found.carrier)
    )
    return one - carrier if found.carrier else one


def held_speed(record: xr.Dataset) -> float:
    """Return the mean speed of a record over the nominal one: lines of a spectrum are where that puts them.

    1 where the first mesh does not turn, as in a planetary stage that turns as a block.
    """
    nominal = float(record.attrs["mesh_speed"])
    return abs(float(driver_speed(record).mean())) / nominal if nominal else 1.0


def holds_speed(record: xr.Dataset) -> bool:
    """Return whether the meshes of a drivetrain's record turn at steady speeds; older records do not say so."""
    return "mesh_track" not in record and bool(record.attrs.get("speed_is_steady", 1))


def with_speed_of(signal: xr.DataArray, record: xr.Dataset, mesh: str | None = None) -> xr.DataArray:
    """Return a signal with the speed of the driver of a mesh, by default the first, that a drivetrain's record holds.

    Where it is steady that is its mean, else the coordinate ``speed`` (rad/s) over time; a shaft that turns back, or
    rests throughout, also against the carrier, has none.
    """
    values = driver_speed(record, mesh)
    if abs(values.mean()) <= STILL * float(np.abs(record["speed"]).max()):
        return signal
    if holds_speed(record):
        return with_metadata(signal, speed=float(np.abs(values).mean()))
    turning = values if values.mean() > 0.0 else -values
    if not turning.any() or turning.min() < -AT_REST * turning.max():
        return signal
    return signal.assign_coords(speed=("time", np.maximum(turning, 0.0), {"units": "rad/s"}))


def placed_lines(record: xr.Dataset) -> str:
    """Return the lines of the kinematic table where the speeds of a drivetrain's record put them, as JSON."""
    if "placed_lines" in record.attrs:
        return str(record.attrs["placed_lines"])
    held = held_speed(record)
    return json.dumps({name: held * at for name, at in json.loads(record.attrs["known_lines"]).items()})


def sensor_signals(record: xr.Dataset, sensor: str | None = None, **settings: Any) -> xr.DataArray:
    """Return what the sensors of a drivetrain's record measured as a signal, with speed and teeth of its first mesh.

    Where the speed of the record is not steady the signal has that over time, as the coordinate ``speed`` (rad/s).

    Parameters
    ----------
    record : Dataset
        From `run_train`, or its file.
    sensor : str, optional
        One of them only; default: each is a channel.
    **settings
        ``channels``; ``teeth`` and ``speed`` of another mesh.

    Raises
    ------
    SignalError
        If there is no such sensor.
    """
    names = [str(s) for s in record.sensor.values]
    kept = [sensor] if sensor is not None else list(settings.get("channels") or names)
    for name in kept:
        if name not in names:
            raise SignalError(f"channel: there is no {name!r}; choose one of {', '.join(names) or 'none'}")
    attributes = record.attrs
    attrs: dict[str, Any] = {"source": str(attributes.get("title", "simulation"))}
    if holds_speed(record) and "known_lines" in attributes:
        attrs["known_lines"] = placed_lines(record)
    signal = make_signal(
        record["measured"].sel(sensor=kept).values,
        float(attributes["run_rate"]),
        units=[str(u) for u in record.sensor_units.sel(sensor=kept).values],
        channels=kept,
        t0=float(record.time.values[0]),
        speed=settings.get("speed"),
        teeth=settings.get("teeth") or tuple(int(z) for z in np.ravel(attributes["mesh_teeth"])),
        attrs=attrs,
    )
    return signal if settings.get("speed") else with_speed_of(signal, record)


def ring_signal(record: xr.Dataset) -> xr.DataArray:
    """Return what the sensor on the ring of a planetary set's record heard as a signal, with the carrier's angle.

    Parameters
    ----------
    record : Dataset
        From `run_planetary`, or its file.

    Returns
    -------
    DataArray
        Dimensions (time, channel), N; coordinate ``angle``, rad, of the carrier; attributes ``planetary`` and
        ``planet_angles`` tell the set to `analyse`.
    """
    attributes = record.attrs
    signal = make_signal(
        record["ring_sensor"].values,
        float(attributes["sampling_rate"]),
        units=str(record["ring_sensor"].attrs["units"]),
        channels=["ring_sensor"],
        t0=float(record.time.values[0]),
        attrs={
            "source": str(attributes.get("title", "simulation")),
            "planetary": tuple(int(z) for z in attributes["teeth"]),
            "planet_angles": tuple(float(a) for a in np.ravel(attributes["planet_angles"])),
        },
    )
    return signal.assign_coords(angle=("time", record["carrier_angle"].values, {"units": "rad"}))


def holds_ring(record: xr.Dataset) -> bool:
    """Return whether this is the record of a planetary set with its ring at rest and plain planets."""
    return {"ring_sensor", "carrier_angle"} <= set(record) and "planet_angles" in record.attrs


def read_any(path: str | Path, component: str | None = None, **settings: Any) -> xr.DataArray:
    """Return a measured file, or the record that ``gearmbs run`` wrote, as a signal.

    Parameters
    ----------
    path : path-like
    component : str, optional
        See `record_signal`; of no meaning for measured files.
    **settings
        For `gearmbs.signals.read_signal`.
    """
    if _may_be_netcdf(Path(path)):
        # of a damaged file read_signal says what is wrong with it
        with contextlib.suppress(OSError, ValueError), xr.open_dataset(path, engine="h5netcdf") as data:
            if "acceleration" in data and "case_json" in data.attrs and "load" not in data.dims:
                return record_signal(data[["acceleration"]].load(), component)
            if holds_ring(data):
                return ring_signal(data[["ring_sensor", "carrier_angle"]].load())
            if "measured" in data and "train_json" in data.attrs:
                return sensor_signals(data, component, **settings)
    return read_signal(path, **settings)


def _may_be_netcdf(path: Path) -> bool:
    """Whether a file is NetCDF by its ending or, without one, by its first bytes."""
    if path.suffix:
        return path.suffix == ".nc"
    try:
        with path.open("rb") as file:
            return file.read(8) == b"\x89HDF\r\n\x1a\n"
    except OSError:
        return False


def model_signals(path: str | Path, component: str) -> dict[str, dict[str, xr.DataArray]]:
    """Return the accelerations of a ``paper.nc`` file by load and state, as signals.

    Raises
    ------
    SignalError
        If the file cannot be read, is not a study, or has no such component.
    """
    try:
        with xr.open_dataset(path, engine="h5netcdf") as data:
            records = data[["acceleration"]].load()
            loads, states = records["load"].values, records.state.values
    except (OSError, KeyError, ValueError, AttributeError) as error:
        raise SignalError(f"{path}: not a result file of the paper's study ({error})") from error
    try:
        return {
            str(load): {str(s): record_signal(records.sel(load=load, state=s), component) for s in states}
            for load in loads
        }
    except SignalError as error:
        raise SignalError(f"{path}: {error}") from error


def parse_models(items: Sequence[str], component: str) -> dict[str, dict[str, xr.DataArray]]:
    """Return models by load and state: of one ``paper.nc``, or of texts ``load:state=path`` of runs or signal files.

    Raises
    ------
    SignalError
        See `parse_states` and `model_signals`.
    """
    if len(items) == 1 and "=" not in items[0]:
        return model_signals(items[0], component)
    return {
        load: {state: read_any(path, component) for state, path in states.items()}
        for load, states in parse_states(items, "model").items()
    }
