"""Mesh harmonics of the record of a drivetrain: of the whole of it, and along a run-up."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from gearmbs.drivetrain import Accelerometer, Drivetrain, Laser, RunSettings
from gearmbs.drivetrain.planetary import PlanetaryStage
from gearmbs.signals import make_signal
from gearmbs.signals.analysis.bands import MIN_PERIODS, harmonic_amplitudes
from gearmbs.studies.train_record import (
    TURN,
    WHOLE,
    HeldSpeed,
    TrainColumns,
    by_angle,
    carrier_turns,
    driver_angle,
    sidebands,
)

TRACK_MOMENTS = 60
"""Moments of a run-up at which mesh harmonics are told."""
TRACK_CYCLES = 16.0
"""Mesh cycles in a window around each."""
SET_BACK = 0.1
"""Mesh cycles by which a wheel may swing back on its way, as in a resonance, its angle then resting instead; of one
that swings further the angle is the drive's by their ratio."""


def bearing_names(train: Drivetrain) -> list[str]:
    """Return the names of all bearings, the pins of planets behind the others."""
    return [*(bearing.name for bearing in train.bearings), *train.pins]


def signal_names(train: Drivetrain) -> list[str]:
    """Return the names of all that mesh harmonics are told of."""
    names = [f"force of {m.name}" for m in train.meshings]
    names += [f"{bearing} {axis}" for bearing in bearing_names(train) for axis in "xyz"]
    return [*names, *(s.name for s in train.sensors)]


def signals_of(train: Drivetrain, record: xr.Dataset) -> tuple[list[str], np.ndarray]:
    """Return names and values, shape (m, signals), of all that mesh harmonics are told of."""
    bearings = [record["bearing_force"].values[:, k] for k in range(len(bearing_names(train)))]
    return signal_names(train), np.concatenate(
        [record["normal_force"].values, *bearings, record["measured"].values], axis=1
    )


def mesh_tracks(
    train: Drivetrain, run: RunSettings, record: xr.Dataset, known: TrainColumns
) -> tuple[xr.DataArray, list[str]]:
    """Return the RMS of each signal at the harmonics of each mesh along a run-up or coast-down, and what it lacks.

    Returns
    -------
    DataArray
        Dims (signal, mesh, harmonic, moment); ``track_time`` (s), ``track_speed`` (of the first drive's shaft, rad/s)
        and, by mesh, ``track_frequency`` (Hz) of each moment. A moment is the middle of a window of some mesh cycles,
        see `gearmbs.signals.order_track`; NaN where a mesh does not turn enough for one.
    list of str
        Of each mesh that has none at all why.
    """
    from gearmbs.signals import SignalError, order_track

    names, signals = signals_of(train, record)
    t = record["time"].values
    moments = np.linspace(t[0], t[-1], TRACK_MOMENTS + 2)[1:-1]
    orders = np.arange(1, run.harmonics + 1)
    rms = np.full((len(names), len(train.meshings), run.harmonics, moments.size), np.nan)
    frequency = np.zeros((len(train.meshings), moments.size))
    shafts = list(train.turning)
    lacking: list[str] = []
    for k, mesh in enumerate(train.meshings):
        teeth, turned = mesh.gears[0].teeth, driver_angle(train, known, mesh)
        # the angle in mesh cycles: an order is then a harmonic of the mesh
        cycles = teeth * np.abs(np.interp(t, known.t, turned))
        furthest = np.maximum.accumulate(cycles)
        if (furthest - cycles).max() < SET_BACK * TURN:
            cycles = furthest
        elif not mesh.stage:
            led = train.drives[0].shaft
            ratio = abs(train.speeds[mesh.bodies[0]] / train.speeds[led])
            cycles = teeth * ratio * np.abs(np.interp(t, known.t, known.turned[:, shafts.index(led)]))
        angle = xr.DataArray(cycles, dims="time", coords={"time": t}, attrs={"units": "rad"})
        speed = driver_angle(train, known, mesh, of_speed=True)
        frequency[k] = teeth * np.abs(np.interp(moments, known.t, speed)) / (2.0 * np.pi)
        signal = make_signal(signals, float(run.output_rate(train)), units="1", channels=names, t0=float(t[0]))
        few = (
            f"mesh '{mesh.name}': mesh_track has no levels: the record has {np.ptp(cycles) / TURN:.3g} cycles of it, a "
            f"level takes {TRACK_CYCLES:g}; give a longer run.duration"
        )
        if np.ptp(cycles) < TRACK_CYCLES * TURN:
            lacking.append(few)
            continue
        try:
            found = order_track(signal, orders=orders.tolist(), phase=angle, scaling="rms", revolutions=TRACK_CYCLES)
        except SignalError as error:
            lacking.append(f"mesh '{mesh.name}': mesh_track has no levels: {error}")
            continue
        at = found["time"].values
        inside = (moments >= at[0]) & (moments <= at[-1])
        if not inside.any():
            lacking.append(few)
        for h in range(run.harmonics):
            for n in range(len(names)):
                rms[n, k, h, inside] = np.interp(moments[inside], at, found.values[:, h, n])
    tracks = xr.DataArray(
        rms, dims=("signal", "mesh", "harmonic", "moment"),
        coords={"signal": names, "mesh": [m.name for m in train.meshings], "harmonic": orders,
                "track_time": ("moment", moments, {"units": "s"}),
                "track_speed": ("moment", np.abs(np.interp(moments, known.t, known.speed[:, shafts.index(
                    train.drives[0].shaft)])), {"units": "rad/s"}),
                "track_frequency": (("mesh", "moment"), frequency, {"units": "Hz"})},
        attrs={"long_name": "RMS at the harmonics of the mesh frequencies, in the signals' own units"},
    )  # fmt: skip
    return tracks, lacking


def harmonic_levels(
    train: Drivetrain, run: RunSettings, record: xr.Dataset, rate: float, known: TrainColumns, start: float,
    stop: float, held: dict[str, HeldSpeed],
) -> xr.DataArray:  # fmt: skip
    """Return the RMS of each signal at the harmonics of each mesh, at the mean speed of the record."""
    names, signals = signals_of(train, record)
    rms = np.full((len(names), len(train.meshings), run.harmonics), np.nan)
    frequency = np.zeros(len(train.meshings))
    groups: dict[str, int] = {}
    standing = {f"{bearing.name} {axis}" for bearing in train.bearings for axis in "xyz"}
    standing |= {sensor.name for sensor in train.sensors if isinstance(sensor, Laser | Accelerometer)}
    stands = np.array([name in standing for name in names], dtype=bool)
    for k, mesh in enumerate(train.meshings):
        if (same := groups.setdefault(mesh.group, k)) != k:
            # all planets of a stage mesh at one frequency
            rms[:, k], frequency[k] = rms[:, same], frequency[same]
            continue
        teeth, whole = mesh.gears[0].teeth, driver_angle(train, known, mesh)
        turned = np.interp([start, stop], known.t, whole)
        frequency[k] = teeth * abs(turned[1] - turned[0]) / (2.0 * np.pi * (stop - start))
        orders = np.arange(1, run.harmonics + 1)
        if not held[mesh.name].is_steady:
            continue
        if frequency[k] * (stop - start) >= MIN_PERIODS and orders[-1] * frequency[k] < 0.5 * rate:
            seen, samples, fundamental = signals, rate, float(frequency[k])
            if held[mesh.name].smears(fundamental * (stop - start) * orders[-1]):
                angle = np.interp(record["time"].values, known.t, whole)
                seen, samples, fundamental = by_angle(signals, teeth * np.abs(angle - angle[0]) / TURN)
            rms[:, k] = np.abs(harmonic_amplitudes(seen, samples, fundamental, orders)).T / np.sqrt(2.0)
            turns = carrier_turns(train, known, mesh, start, stop)
            if turns is not None:
                # cycles of the mesh in a turn of the carrier
                cycles = frequency[k] * (stop - start) / max(turns, 1.0) if turns >= WHOLE else math.nan
                planets = train.part(mesh.stage, PlanetaryStage).gears.planets
                rms[stands, k] = _with_sidebands(seen[:, stands], samples, fundamental, cycles, orders, planets)
    return xr.DataArray(
        rms, dims=("signal", "mesh", "harmonic"),
        coords={"signal": names, "mesh": [m.name for m in train.meshings], "harmonic": np.arange(1, run.harmonics + 1),
                "mesh_frequency": ("mesh", frequency, {"units": "Hz"}),
                "nominal_frequency": ("mesh", [train.kinematics.mesh_frequency(m.name) for m in train.meshings],
                                      {"units": "Hz"})},
        attrs={"long_name": "RMS at the harmonics of the mesh frequencies, in the signals' own units"},
    )  # fmt: skip


def _with_sidebands(
    values: np.ndarray, rate: float, fundamental: float, cycles: float, orders: np.ndarray, planets: int
) -> np.ndarray:
    """Return the RMS of mesh harmonics with their `sidebands`, (signals, orders), over whole turns of the carrier.

    Parameters
    ----------
    cycles : float
        Of the mesh in a turn of the carrier; NaN where the record has no whole turn, whose lines it cannot part.
    """
    out = np.full((values.shape[1], orders.size), np.nan)
    if not math.isfinite(cycles):
        return out
    turn = fundamental / cycles
    for n, order in enumerate(orders):
        lines = order * cycles + sidebands(planets)
        lines = lines[(lines > 0.0) & (lines * turn < 0.5 * rate)]
        found = harmonic_amplitudes(values, rate, turn, lines, least=1)
        out[:, n] = np.sqrt(0.5 * np.sum(np.abs(found) ** 2, axis=0))
    return out
