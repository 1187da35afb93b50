"""Simulate a drivetrain and record it: meshes, bearings, sensors, speeds, harmonics of every mesh."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import gearmbs
from gearmbs.dae.methods import INTEGRATORS
from gearmbs.dae.result import Status
from gearmbs.dae.results.solution import Solution
from gearmbs.drivetrain import Drivetrain, DrivetrainError, RunSettings
from gearmbs.drivetrain.description import Description, read_description
from gearmbs.drivetrain.planetary import Meshing, PlanetaryStage, differentials
from gearmbs.drivetrain.torsional import warn_of_overdamped_meshes
from gearmbs.files import json_value
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.solve.accuracy import JOINED
from gearmbs.mechanism.solve.simulate import simulate
from gearmbs.signals import even_signal, make_signal
from gearmbs.signals.analysis.bands import MIN_PERIODS
from gearmbs.signals.files.simulated import holds_speed, mesh_of_record, placed_lines, with_speed_of
from gearmbs.signals.resampling import MARGIN, monotone_cubic
from gearmbs.studies.case.tooth_faults import tooth_fault
from gearmbs.studies.presets.files import FOLDER, PRESETS
from gearmbs.studies.run.accuracy import asked_accuracy
from gearmbs.studies.run.parallel import run_named
from gearmbs.studies.run.refined import LEFT_TO_TWIN, Behind, keeping
from gearmbs.studies.run.simulation import SimulationFailed, SimulationInterrupted
from gearmbs.studies.train_accuracy import SMALLEST, Lines, Precise, accurate_lines, time_apart
from gearmbs.studies.train_bearings import bearing_remarks, equivalent_loads
from gearmbs.studies.train_levels import bearing_names, harmonic_levels, mesh_tracks, signal_names
from gearmbs.studies.train_record import (
    CONTACT,
    TrainColumns,
    TrainRecorder,
    column_of,
    held_speeds,
    on_shafts,
    recorded_table,
    speed_attributes,
    unresolved,
    warn_of_speeds,
)
from gearmbs.units import QuantityLike
from gearmbs.wording import warn

COUNTED = ("pairs_drive", "pairs_back")


def load_train(path: str | Path) -> Description:
    """Read a drivetrain and its run settings from a TOML file, faults of teeth included.

    Parameters
    ----------
    path : path-like
        A file, or the name of a preset: bench, crank_slider, gearbox, grc_750kw, nrel_5mw, rattle or resonance.

    Raises
    ------
    DrivetrainError
        One line that names the file, the part, the key, the value and the remedy.

    Examples
    --------
    >>> load_train("gearbox").train.kinematics.ratio("high", "lay")
    -4.0
    """
    if path in PRESETS and not Path(path).exists():
        path = FOLDER / f"{path}.toml"
    return read_description(path, tooth_fault)


def run_train(
    train: Drivetrain,
    run: RunSettings | None = None,
    *,
    mechanism: Mechanism | None = None,
    progress: bool | Callable[[float], None] | None = None,
    accuracy: QuantityLike | None = None,
) -> xr.Dataset:
    """Simulate a drivetrain and return its record.

    Parameters
    ----------
    train : Drivetrain
    run : RunSettings, optional
    mechanism : Mechanism, optional
        What is simulated instead of ``train.build()``: that, with parts added or changed. Its ``lump`` decides whether
        shafts on fixed axes are integrated by their angles alone, which they are otherwise.
    progress : bool or callable, optional
    accuracy : float or str, optional
        How well the mesh harmonics are to be known, such as "1 %" or 0.01, as a part of the largest of their signal.
        Tolerance and slices of the faces are chosen for it, and ``mesh_rms_error`` tells the numerical error of each
        level, with what the two halves of the record differ by; see `gearmbs.studies.train_accuracy`.

    Returns
    -------
    Dataset
        Over ``time``, evenly sampled behind an anti-alias filter: by ``mesh`` normal force, penetrations, numbers of
        tooth pairs on drive and coast flanks and transmission error; by ``bearing`` the force of the seat on the shaft;
        by ``sensor`` what it measures; by ``shaft`` its speed. ``mesh_rms``: RMS of the mesh harmonics by ``signal``
        (the normal force of each mesh, the bearings' forces, the sensors), mesh and harmonic, at the record's mean
        speed, and NaN where the speed is not steady, see `gearmbs.studies.train_record`. What planets do to bearings,
        lasers and accelerometers has their sidebands by turns of the carrier in it, and is NaN without a whole turn.
        Of a run-up or coast-down (`gearmbs.drivetrain.SpeedDrive` with ``curve``) instead ``mesh_track``, the same at
        60 moments, without sidebands. The attribute ``remarks`` names speeds that are not the nominal ones,
        carriers that make no whole turn, and what else is warned of.

    Raises
    ------
    DrivetrainError
        If the record is too short for its harmonics; with an accuracy, if its halves are, if the settings have a
        tolerance of their own, or speeds follow curves.
    SimulationFailed
        If the integrator stops early; the exception carries the solution so far.

    Warns
    -----
    UserWarning
        Of an accuracy that was not reached, of meshes that are damped above critical by their contact law, of drives
        that cannot carry the loads, of speeds that are not steady or far from the nominal ones, of meshes without force
        though a torque acts, as of a shaft that has left its bearings, and of tapered roller and angular contact
        bearings that carry against their sense.
    """
    run = run or RunSettings()
    warn_of_overdamped_meshes(train)
    if accuracy is not None:
        return _accurate(train, run, mechanism, progress, accuracy)
    check_record(train, run)
    known, made = _simulated(train, run, mechanism, progress)
    solution = made.solution
    return evaluated(train, run, known, solution)


def _accurate(
    train: Drivetrain,
    run: RunSettings,
    mechanism: Mechanism | None,
    progress: bool | Callable[[float], None] | None,
    accuracy: QuantityLike,
) -> xr.Dataset:
    """Return a record whose mesh harmonics are as accurate as asked; see `run_train`."""
    wanted = asked_accuracy(accuracy, smallest=SMALLEST)
    title = f"drivetrain '{train.name}'"
    if run.tolerance != RunSettings().tolerance:
        raise DrivetrainError(
            f"{title}: accuracy = {accuracy!r}: the tolerance is chosen for it, but run.tolerance is "
            f"{run.tolerance:g}; leave one of the two out"
        )
    if train.changes_speed:
        raise DrivetrainError(
            f"{title}: accuracy = {accuracy!r}: mesh harmonics along a run-up have no record that could be halved; "
            "take a constant speed, or compare two tolerances"
        )
    try:
        check_record(train, replace(run, duration=0.5 * run.duration))
    except DrivetrainError as error:
        raise DrivetrainError(f"{title}: accuracy = {accuracy!r} looks at the halves of the record: {error}") from None
    check_record(train, run)
    slices = {mesh.name: train.pairs[mesh.name].face_slices for mesh in train.meshings}
    slices = {name: count for name, count in slices.items() if count > 1}
    fixed = sorted(set(slices) - {mesh.name for mesh in train.meshes})
    if fixed or (slices and mechanism is not None):
        whose = ", ".join(fixed or slices)
        raise DrivetrainError(
            f"{title}: accuracy = {accuracy!r}: what the slices of the faces of {whose} are good for cannot be told, "
            "for they are not changed here; take wheels whose flanks do not vary along the face, or compare two numbers"
        )

    behind: Behind | None = None

    def lines(precise: Precise) -> Lines:
        nonlocal behind
        one = train
        for name, count in precise.slices.items():
            if count != slices[name]:
                one = one.changed(name, settings={"slices": count})
        duration = 0.5 * run.duration if precise.half else run.duration
        settings = replace(run, tolerance=precise.tolerance, duration=duration)
        if precise.half:
            start = {} if behind is None else behind.start(precise.slices)
        else:
            start = keeping(run.integrator, train.run_up + LEFT_TO_TWIN * run.settling)
        known, made = _simulated(one, settings, start.pop("mechanism", mechanism), progress, **start)
        behind, solution = replace(made, slices=precise.slices), made.solution
        record = _even_record(one, settings, known) if precise.half else evaluated(one, settings, known, solution)
        # the drivetrain as it was asked for: slices are those of its accuracy, and told beside it
        record.attrs["train_json"] = _described(train)
        count = record.sizes["time"]
        ends = [0, count] if precise.half else [0, count // 2, count]
        halves = np.stack([_levels(one, settings, known, record, *pair) for pair in pairwise(ends)])
        loads = np.stack([equivalent_loads(one, record, *pair) for pair in pairwise(ends)])
        levels = halves[0] if precise.half else record["mesh_rms"].values
        start = one.run_up + run.settling
        within, whole = (
            time_apart(known.t[inside], known.contact[inside, :, 0])
            for stop in (0.5 * run.duration, duration)
            for inside in [slice(*np.searchsorted(known.t, (start, start + stop)))]
        )
        return Lines(record, signal_names(one), levels, halves, within, whole, loads)

    names = len(train.meshings) + 3 * (len(train.bearings) + len(train.pins))
    groups = np.concatenate([np.zeros(names, dtype=int), 1 + np.arange(len(train.sensors))])
    return accurate_lines(lines, Precise(JOINED, slices), wanted, groups, "mesh_rms", title)


def _levels(
    train: Drivetrain, run: RunSettings, known: TrainColumns, record: xr.Dataset, first: int, stop: int
) -> np.ndarray:
    """Return the mesh harmonics of some samples of a record, (signals, meshes, harmonics)."""
    part, rate = record.isel(time=slice(first, stop)), run.output_rate(train)
    start = float(part["time"][0])
    end = start + (stop - first) / rate
    return harmonic_levels(train, run, part, rate, known, start, end, held_speeds(train, part)).values


def _simulated(
    train: Drivetrain,
    run: RunSettings,
    mechanism: Mechanism | None,
    progress: bool | Callable[[float], None] | None,
    **options: Any,
) -> tuple[TrainColumns, Behind]:
    """Return what was measured of a drivetrain at the integrator's own steps, and of what."""
    rate = run.output_rate(train)
    begin = train.run_up + run.settling
    ahead = (MARGIN + 4) / rate
    if mechanism is None:
        mechanism = train.build()
        # shafts on joints are followed by their angles alone, at a third of the time or less
        mechanism.lump = True
    m = mechanism
    recorder = TrainRecorder(train, m, max(0.0, begin - ahead))
    end = np.ceil((begin + run.duration + ahead) * rate) / rate
    solution = simulate(
        m, float(end), every_step=True, consumer=recorder.take, integrator=run.integrator, tol=run.tolerance,
        rate_scale=train.rate_scale, progress=progress, **options,
    )  # fmt: skip
    if not solution.success:
        kind = SimulationInterrupted if solution.status is Status.INTERRUPTED else SimulationFailed
        partial = None if recorder.is_empty else raw_record(train, recorder.joined(), solution)
        raise kind(f"drivetrain '{train.name}': {solution.message}", solution, None, partial)
    return recorder.joined(), Behind(m, solution)


def run_trains(
    runs: Mapping[str, tuple[Drivetrain, RunSettings]],
    *,
    workers: int | None = None,
    progress: bool | Callable[[str, float], None] | None = None,
    accuracy: QuantityLike | None = None,
) -> dict[str, xr.Dataset]:
    """Simulate drivetrains side by side and return their records by name.

    Parameters
    ----------
    runs : mapping of str to (Drivetrain, RunSettings)
    workers : int, optional
        Runs at a time; default the cores, and one if an integrator holds the interpreter.
    progress : bool or callable, optional
        Bars, see `gearmbs.progress`; a callable is told ``progress(name, fraction)`` from time to time.
    accuracy : float or str, optional
        As of `run_train`.

    Raises
    ------
    SimulationFailed
        If a run fails; the others are stopped.
    """

    def work(name: str, report: Callable[[float], None]) -> xr.Dataset:
        train, run = runs[name]
        span = train.run_up + run.settling + run.duration
        return run_train(train, run, progress=lambda t: report(min(t / span, 1.0)), accuracy=accuracy)

    compiled = all(INTEGRATORS[run.integrator].compiled for _, run in runs.values())
    return run_named(work, list(runs), workers=workers if compiled else 1, progress=progress)


def check_record(train: Drivetrain, run: RunSettings) -> None:
    """Refuse a record that cannot hold the harmonics asked for.

    Raises
    ------
    DrivetrainError
    """
    rate = run.output_rate(train)
    for mesh in train.meshings:
        frequency = train.kinematics.mesh_frequency(mesh.name)
        if frequency == 0.0:
            continue
        if run.harmonics * frequency * 1.05 >= rate / 2:
            raise DrivetrainError(
                f"run.rate is {rate:g} Hz: {run.harmonics} harmonics of mesh '{mesh.name}' reach "
                f"{run.harmonics * frequency:.6g} Hz; give more than {2.1 * run.harmonics * frequency:.6g} Hz, or "
                "fewer harmonics"
            )
        least = (MIN_PERIODS + 1) / frequency
        if run.duration < least:
            raise DrivetrainError(
                f"run.duration is {run.duration:g} s: mesh '{mesh.name}' has {frequency:.4g} mesh cycles a second; "
                f"give at least {least:.3g} s"
            )


def raw_record(train: Drivetrain, known: TrainColumns, solution: Solution) -> xr.Dataset:
    """Return what was computed at the integrator's own steps, for a run that failed."""
    out = _dataset(train, known.t, known.contact, known.bearing_force, known.sensors, known.speed,
                   transmission_error(train, known.turned, known.twisted))  # fmt: skip
    out.attrs = {**attributes(train, None, solution), "status": solution.status.name, "message": solution.message}
    return out


def transmission_error(train: Drivetrain, turned: np.ndarray, twisted: np.ndarray) -> np.ndarray:
    """Return the lag of the driven wheel along the line of action, from the touching start, shape (m, meshes), m."""
    twists = _twists(train, twisted)
    out = np.empty((turned.shape[0], len(train.meshings)))
    for k, mesh in enumerate(train.meshings):
        pair = train.pairs[mesh.name]
        ratio = pair.geometry.sign * mesh.gears[0].teeth / mesh.gears[1].teeth
        sense = pair.rotation * pair.geometry.sign * pair.geometry.driven.base_radius
        bodies = (*mesh.bodies, mesh.carrier)
        one, two, carrier = (column_of(train, mesh, b, turned) + twists(mesh, b) for b in bodies)
        first, second, third = (train.layout.angles.get(b, 0.0) for b in bodies)
        if mesh.stage:
            one, two, first, second = one - carrier, two - carrier, first - third, second - third
        lag = sense * (one * ratio + two)
        start = sense * (first * ratio + second)
        # full turns, counted from wherever the record begins, are no lag
        pitch = abs(pair.geometry.driver.base_pitch)
        out[:, k] = lag - start - pitch * np.round((lag[0] - start) / pitch)
    return out


def _twists(train: Drivetrain, twisted: np.ndarray) -> Callable[[Meshing, str], Any]:
    """Return what tells the angle of the wheel of a mesh on a body against that, rad: shafts that bend also twist."""
    wheels = {name: twisted[:, k] for k, name in enumerate(on_shafts(train))}

    def twist(mesh: Meshing, body: str) -> Any:
        if mesh.stage:
            part = train.part(mesh.stage, PlanetaryStage)
            member = next((m for m, on in part.holders.items() if on == body), None)
            return wheels.get(f"{mesh.stage} {member}", 0.0)
        if not body:
            return 0.0
        driver, driven = train.wheels_of(mesh.name)
        return wheels[(driver if driver.shaft == body else driven).name]

    return twist


def _even_record(train: Drivetrain, run: RunSettings, known: TrainColumns) -> xr.Dataset:
    """Return the variables of a record over time, from what was measured at the integrator's own steps."""
    rate = run.output_rate(train)
    start = train.run_up + run.settling
    stop = start + run.duration
    m = known.t.size
    forces = np.concatenate([known.contact[:, :, 0], known.bearing_force.reshape(m, -1), known.sensors], axis=1)
    channels = [str(k) for k in range(forces.shape[1])]
    even = even_signal(known.t, forces, rate, start=start, stop=stop, channels=channels)
    # compiled code takes no arrays that are read only
    inside = even["time"].values < stop - 0.5 / rate
    t, values = even["time"].values[inside], even.values[inside]
    meshes, bearings = len(train.meshings), len(train.bearings) + len(train.pins)
    contact = np.empty((t.size, meshes, len(CONTACT)))
    latest = np.clip(np.searchsorted(known.t, t, side="right") - 1, 0, m - 1)
    for k in range(meshes):
        for c, name in enumerate(CONTACT):
            column = known.contact[:, k, c]
            contact[:, k, c] = column[latest] if name in COUNTED else np.interp(t, known.t, column)
        contact[:, k, 0] = values[:, k]
    error = transmission_error(train, known.turned, known.twisted)
    error = _interpolated(known.t, error, t)
    speed = _interpolated(known.t, known.speed, t)
    bearing = values[:, meshes : meshes + 3 * bearings].reshape(t.size, bearings, 3)
    return _dataset(train, t, contact, bearing, values[:, meshes + 3 * bearings :], speed, error)


def _described(train: Drivetrain) -> str:
    """Return the parts of a drivetrain as JSON."""
    return json.dumps(described({name: part for name, part in train.parts.items()}))


def evaluated(train: Drivetrain, run: RunSettings, known: TrainColumns, solution: Solution) -> xr.Dataset:
    """Return the record of what was measured at the integrator's own steps; see `run_train`."""
    rate = run.output_rate(train)
    start = train.run_up + run.settling
    stop = start + run.duration
    out = _even_record(train, run, known)
    of_bearings = bearing_remarks(train, out)
    for remark in of_bearings:
        warn(f"drivetrain '{train.name}': {remark}")
    if train.changes_speed:
        out["mesh_track"], lacking = mesh_tracks(train, run, out, known)
        for remark in lacking:
            warn(f"drivetrain '{train.name}': {remark}")
        remarks = "; ".join([*lacking, *of_bearings]) or "none"
        out.attrs = attributes(train, run, solution) | {"remarks": remarks}
        return out
    held = held_speeds(train, out)
    out["mesh_rms"] = harmonic_levels(train, run, out, rate, known, start, stop, held)
    out.attrs = attributes(train, run, solution) | speed_attributes(
        held, [*unresolved(train, known, start, stop), *of_bearings]
    )
    if differentials(train):
        table, factor = recorded_table(train, out)
        out.attrs["placed_lines"] = json.dumps({name: factor * at for name, at in table.known_lines().items()})
    warn_of_speeds(train, held)
    return out


def _interpolated(t: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return columns at other times, by a monotone cubic."""
    out = np.empty((at.size, values.shape[1]))
    for k in range(values.shape[1]):
        out[:, k] = monotone_cubic(t, np.ascontiguousarray(values[:, k]), at)
    return out


def _dataset(
    train: Drivetrain, t: np.ndarray, contact: np.ndarray, bearing: np.ndarray, sensors: np.ndarray, speed: np.ndarray,
    error: np.ndarray,
) -> xr.Dataset:  # fmt: skip
    data: dict[str, Any] = {
        name: (("time", "mesh"), contact[:, :, c], {"units": unit, "long_name": name.replace("_", " ")})
        for c, (name, unit) in enumerate(CONTACT.items())
    }
    data["transmission_error"] = (("time", "mesh"), error, {"units": "m", "long_name": "lag of the driven wheel"})
    data["bearing_force"] = (
        ("time", "bearing", "xyz"), bearing, {"units": "N", "long_name": "force of the seat on the shaft"}
    )  # fmt: skip
    data["measured"] = (("time", "sensor"), sensors, {"long_name": "what the sensors measure"})
    data["speed"] = (
        ("time", "shaft"),
        speed[:, : len(train.turning)],
        {"units": "rad/s", "long_name": "speed about the shaft's axis"},
    )
    coords = {
        "time": ("time", t, {"units": "s"}),
        "mesh": [m.name for m in train.meshings],
        "bearing": bearing_names(train),
        "xyz": ["x", "y", "z"],
        "sensor": [s.name for s in train.sensors],
        "shaft": list(train.turning),
        "sensor_units": ("sensor", [s.unit for s in train.sensors]),
    }
    return xr.Dataset(data, coords=coords)


def attributes(train: Drivetrain, run: RunSettings | None, solution: Solution) -> dict[str, Any]:
    """Return what a record says of its drivetrain, settings and solver."""
    out: dict[str, Any] = {
        "title": f"drivetrain: {train.name}",
        "train_json": _described(train),
        "gearmbs_version": gearmbs.__version__,
    }
    if train.meshings:
        out["mesh_laws"] = json.dumps({
            name: {"law": m.law, "stiffness": m.stiffness, "damping": m.damping, "damping_ratio": m.damping_ratio,
                   "frequency": m.frequency}
            for name, m in train.mesh_dynamics.items()
        })  # fmt: skip
        planets = {
            m.name: (m.bodies[0], m.carrier, [gear.teeth for gear in m.gears]) for m in train.meshings if m.stage
        }
        if planets:
            out["planet_meshes"] = json.dumps(planets)
        out["known_lines"] = json.dumps(train.kinematics.known_lines())
        given = train.kinematics.for_analysis(train.meshings[0].name)
        out |= {"mesh_speed": given["speed"], "mesh_speed_units": "rad/s", "mesh_teeth": list(given["teeth"])}  # type: ignore[call-overload]
    if run is not None:
        out |= {f"run_{f.name}": v for f in fields(run) if (v := getattr(run, f.name)) is not None}
        out["run_rate"] = run.output_rate(train)
    out.update({f"solver_{key}": value for key, value in solution.stats.as_dict().items()})
    cycles = float(solution.t[-1]) * sum(train.kinematics.mesh_frequency(m.name) for m in train.meshings)
    if cycles > 0.0 and "solver_wall_time" in out:
        out["solver_time_per_mesh_cycle"] = out["solver_wall_time"] / cycles
    return out


def described(value: Any) -> Any:
    """Return a description made of tables, lists, numbers and texts; objects become tables with their kind."""
    return json_value(value, _as_table)


def _as_table(value: Any) -> Any:
    if not is_dataclass(value) or isinstance(value, type):
        return repr(value)
    shown = {f.name: described(getattr(value, f.name)) for f in fields(value) if f.init}
    return {"kind": getattr(value, "kind", type(value).__name__), **shown}


def train_signal(record: xr.Dataset, channel: str, mesh: str | None = None) -> xr.DataArray:
    """Return one channel of a drivetrain's record as a signal with speed and teeth, for `analyse` and its like.

    Where the speed of the record is not steady, as in a run-up, the signal has that over time, as the coordinate
    ``speed`` (rad/s), and no known lines.

    Parameters
    ----------
    record : Dataset
        From `run_train`, or its file.
    channel : str
        A sensor; "force of <mesh>"; or "<bearing> x", "<bearing> y", "<bearing> z".
    mesh : str, optional
        Whose driver and teeth the signal names; default the first.

    Raises
    ------
    DrivetrainError
        For an unknown channel or mesh.
    """
    names = [str(s) for s in record.sensor.values]
    bearings = {f"{b} {axis}": (str(b), axis) for b in record.bearing.values for axis in "xyz"}
    meshes = [str(m) for m in record.mesh.values]
    forces = {f"force of {m}": m for m in meshes}
    unit = "N"
    if channel in names:
        values = record["measured"].sel(sensor=channel)
        unit = str(record.sensor_units.sel(sensor=channel).item())
    elif channel in forces:
        values = record["normal_force"].sel(mesh=forces[channel])
    elif channel in bearings:
        bearing, axis = bearings[channel]
        values = record["bearing_force"].sel(bearing=bearing, xyz=axis)
    else:
        known = ", ".join([*names, *forces, *bearings])
        raise DrivetrainError(f"record: there is no channel '{channel}'; known are {known}")
    mesh = mesh or (meshes[0] if meshes else None)
    if mesh not in meshes:
        raise DrivetrainError(f"record: there is no mesh '{mesh}'; known are {', '.join(meshes)}")
    lines = {"known_lines": placed_lines(record)} if holds_speed(record) else {}
    signal = make_signal(
        values.values[:, None], float(record.attrs["run_rate"]), units=unit, channels=[channel],
        t0=float(record.time.values[0]), teeth=mesh_of_record(record, mesh).teeth,
        attrs={"source": record.attrs["title"], **lines},
    )  # fmt: skip
    return with_speed_of(signal, record, mesh)
