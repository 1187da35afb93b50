"""The report of a drivetrain's record in Markdown, and its 3-D view."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from gearmbs.drivetrain import Accelerometer, Drivetrain, DrivetrainError
from gearmbs.drivetrain.parts import turn_z
from gearmbs.signals import spectrum
from gearmbs.signals.files.simulated import held_speed, holds_speed
from gearmbs.studies.trains.speed import STRAY
from gearmbs.studies.trains.trains import train_signal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gearmbs.view.geometry.mesh import Mesh
    from gearmbs.view.scenes.scene import Scene

RPM = 30.0 / np.pi
ROUNDEST = 4000.0
"""Radius of the largest wheel over the distance of a chord from its curve: a quarter of a pixel in 1000."""


def train_report(train: Drivetrain, record: xr.Dataset) -> str:
    """Return the report of a record: frequencies, torques, meshes, bearings, sensors, harmonics, cost."""
    sections = (_frequencies, _meshes, _bearings, _sensors, _levels, _cost)
    lines = [f"# {train.name}", ""]
    for section in sections:
        lines += [*section(train, record), ""]
    return "\n".join(lines)


def _frequencies(train: Drivetrain, record: xr.Dataset) -> list[str]:
    lines = ["## Speeds and frequencies", "", "| shaft | nominal, rpm | mean of the record, rpm |", "|---|---|---|"]
    for shaft in train.shafts:
        mean = float(record["speed"].sel(shaft=shaft.name).mean())
        lines.append(f"| {shaft.name} | {train.speeds[shaft.name] * RPM:.6g} | {mean * RPM:.6g} |")
    said = record.attrs.get("remarks", "none")
    remarks = [] if said == "none" else ["", f"**{said}**"]
    return [*lines, *remarks, "", "Frequencies at the nominal speeds:", "", train.kinematics.to_markdown()]


def _meshes(train: Drivetrain, record: xr.Dataset) -> list[str]:
    lines = ["## Meshes", "",
             "| mesh | torque on the driven wheel, N m | torque over base radius, N | mean normal force, N | both "
             "flanks, % of time | no contact, % | transmission error p-p, um |", _rule(6)]  # fmt: skip
    for mesh in train.meshes:
        one = record.sel(mesh=mesh.name)
        drive, back = one["pairs_drive"].values > 0, one["pairs_back"].values > 0
        torque = train.power.on_driven(mesh.name)
        radius = train.pairs[mesh.name].geometry.driven.base_radius
        lines.append(
            f"| {mesh.name} | {torque:.5g} | {torque / radius:.5g} | {float(one['normal_force'].mean()):.5g} "
            f"| {100 * np.mean(drive & back):.3g} | {100 * np.mean(~drive & ~back):.3g} "
            f"| {1e6 * np.ptp(one['transmission_error'].values):.4g} |"
        )
    return [*lines, "", *_laws(train)]


def _laws(train: Drivetrain) -> list[str]:
    """Return the contact laws, and what they make of both shafts of each mesh."""
    lines = ["| mesh | contact law | mean stiffness of the mesh, N/um | damping, N s/mm | natural frequency, Hz | of "
             "critical damping |", _rule(5)]  # fmt: skip
    for name, m in train.mesh_dynamics.items():
        over = ", **over-damped**" if m.damping_ratio > 1.0 else ""
        lines.append(
            f"| {name} | {m.law} | {1e-6 * m.stiffness:.4g} | {1e-3 * m.damping:.4g} | {m.frequency:.5g} "
            f"| {m.damping_ratio:.3g}{over} |"
        )
    return lines


def _bearings(train: Drivetrain, record: xr.Dataset) -> list[str]:
    lines = [
        "## Bearings",
        "",
        "| bearing | mean x, y, z, N | RMS about the mean x, y, z, N | largest, N |",
        "|---|---|---|---|",
    ]
    for bearing in train.bearings:
        force = record["bearing_force"].sel(bearing=bearing.name).values
        mean = ", ".join(f"{v:.4g}" for v in force.mean(axis=0))
        rms = ", ".join(f"{v:.4g}" for v in force.std(axis=0))
        lines.append(f"| {bearing.name} | {mean} | {rms} | {np.linalg.norm(force, axis=1).max():.5g} |")
    return lines


def _sensors(train: Drivetrain, record: xr.Dataset) -> list[str]:
    if not train.sensors:
        return []
    lines = ["## Sensors", "", "| sensor | unit | mean | RMS about the mean | peak to peak |", "|---|---|---|---|---|"]
    for sensor in train.sensors:
        values = record["measured"].sel(sensor=sensor.name).values
        lines.append(
            f"| {sensor.name} | {sensor.unit} | {values.mean():.5g} | {values.std():.5g} | {np.ptp(values):.5g} |"
        )
    return lines


def _levels(train: Drivetrain, record: xr.Dataset) -> list[str]:
    if "mesh_track" in record:
        return _highest(train, record)
    lines = ["## Mesh harmonics, RMS", ""]
    harmonics = record.harmonic.values
    for mesh in train.meshes:
        levels = record["mesh_rms"].sel(mesh=mesh.name)
        lines += [f"### {mesh.name}, {_at(levels)}", "",
                  "| signal | " + " | ".join(f"{h} x" for h in harmonics) + " |", _rule(harmonics.size)]  # fmt: skip
        for signal in record.signal.values:
            row = levels.sel(signal=signal).values
            lines.append(f"| {signal} | " + " | ".join(f"{v:.4g}" for v in row) + " |")
        lines.append("")
    return lines


def _at(levels: xr.DataArray) -> str:
    """Return the mesh frequency of the record, with the nominal one where they differ by what a table shows."""
    found, nominal = float(levels.mesh_frequency), float(levels.nominal_frequency)
    return (
        f"{found:.6g} Hz" if abs(found - nominal) <= STRAY * nominal else f"{found:.6g} Hz (nominal {nominal:.6g} Hz)"
    )


def _highest(train: Drivetrain, record: xr.Dataset) -> list[str]:
    """Return where along a run-up each mesh harmonic of each signal is highest."""
    lines = ["## Mesh harmonics along the run-up: highest RMS, at the speed of the drive, at the mesh frequency", ""]
    tracks = record["mesh_track"]
    speed = tracks["track_speed"].values * RPM
    for mesh in train.meshes:
        lines += [f"### {mesh.name}", "", "| signal | harmonic | RMS | rpm | Hz |", _rule(4)]
        for signal in tracks.signal.values:
            for h in tracks.harmonic.values:
                row = tracks.sel(signal=signal, mesh=mesh.name, harmonic=h)
                if np.isfinite(row.values).any():
                    k = int(np.nanargmax(row.values))
                    at = h * float(row["track_frequency"].values[k])
                    lines.append(f"| {signal} | {h} | {row.values[k]:.4g} | {speed[k]:.5g} | {at:.5g} |")
        lines.append("")
    return lines


def _rule(columns: int) -> str:
    return "|---|" + "---|" * columns


def _cost(train: Drivetrain, record: xr.Dataset) -> list[str]:
    kept = ("steps", "residuals", "jacobians", "wall_time", "time_per_mesh_cycle")
    lines = ["## Integration", "", "| quantity | value |", "|---|---|"]
    for key in kept:
        value = record.attrs.get(f"solver_{key}")
        if value is not None:
            lines.append(f"| {key.replace('_', ' ')} | {value:.6g} |")
    return lines


def train_shapes(train: Drivetrain) -> dict[str, Mesh]:
    """Return the meshes of all shafts with their wheels, in the bodies' frames, for scenes."""
    from gearmbs.view.geometry.mesh import cylinder, joined
    from gearmbs.view.geometry.solid import pair_solids
    from gearmbs.view.scenes.scenes import TOLERANCE

    wheels: dict[str, Mesh] = {}
    # a wheel among many fills a part of the picture; its outline is as round as that of the largest alone
    largest = max((wheel.gear.outer_radius for wheel in train.wheels), default=0.0)
    tolerance = max(TOLERANCE, largest / ROUNDEST)
    for mesh in train.meshes:
        for name, solid in zip((mesh.driver, mesh.driven), pair_solids(train.pairs[mesh.name], tolerance), strict=True):
            wheels.setdefault(name, solid)
    out = {}
    for shaft in train.shafts:
        pieces, z = [], 0.0
        for length, radius in shaft.cylinders:
            pieces.append(cylinder(radius, length, 48).placed(np.array([0.0, 0.0, z + 0.5 * length]), np.eye(3)))
            z += length
        for wheel in train.wheels:
            if wheel.shaft == shaft.name and wheel.name in wheels:
                place = np.array([0.0, 0.0, train.station(wheel)])
                pieces.append(wheels[wheel.name].placed(place, turn_z(train.layout.wheels[wheel.name])))
        out[shaft.name] = joined(pieces)
    return out


def train_scene(train: Drivetrain) -> Scene:
    """Return the 3-D view of a drivetrain at its start: shafts with their wheels, housings as boxes, joints.

    Housings are seen through.
    """
    from gearmbs.view import mechanism_scene

    housings = [housing.name for housing in train.housings]
    return mechanism_scene(train.build(), shapes=train_shapes(train), through=housings, title=train.name)


# The spectrum of a drivetrain's record with the lines of its kinematic table.


HARMONICS, SIDEBANDS = 3, 1
MESH_HARMONICS = 10
"""Harmonics marked of meshes: slow ones have many below the third of the fastest."""
MESHES = ("mesh ", "sidebands ")


def train_spectrum(
    train: Drivetrain, record: xr.Dataset, channel: str | None = None, *, maximum: float | None = None
) -> Figure:
    """Draw the spectrum of one channel of a record with the lines of the kinematic table, and name the strongest.

    Marked are ten harmonics of each mesh frequency with their first sidebands, and three of each shaft, hunting-tooth,
    bearing and pump frequency, where the mean speed of the record puts them.

    Parameters
    ----------
    train : Drivetrain
    record : Dataset
        From `run_train`, at one speed.
    channel : str, optional
        As for `train_signal`; default: the first accelerometer, else the first sensor, else the first mesh's force.
    maximum : float, optional
        Highest frequency shown, Hz; default: a little above the third harmonic of the fastest mesh.

    Raises
    ------
    DrivetrainError
        For an unknown channel, and for records of run-ups and of speeds that are not steady, whose lines move.
    """
    from gearmbs.view import named_lines_plot

    if "mesh_track" in record:
        raise DrivetrainError("record: in a run-up lines move; draw mesh_track, or a spectrogram")
    if not holds_speed(record):
        raise DrivetrainError(f"record: lines move, draw a spectrogram; {record.attrs['remarks']}")
    sensors = sorted(train.sensors, key=lambda sensor: not isinstance(sensor, Accelerometer))
    name = channel or (sensors[0].name if sensors else f"force of {train.meshes[0].name}")
    signal = train_signal(record, name)
    held = held_speed(record)
    found = spectrum(signal)
    turning = [f for mesh in train.meshes if (f := held * train.kinematics.mesh_frequency(mesh.name)) > 0.0]
    highest = float(found["frequency"][-1])
    top = maximum or min(highest, 1.08 * HARMONICS * max(turning, default=highest))
    few = train.kinematics.lines_by_part(HARMONICS, SIDEBANDS)
    many = train.kinematics.lines_by_part(MESH_HARMONICS, SIDEBANDS)
    known = {
        part: {line: held * at for line, at in (many if part.startswith(MESHES) else few)[part].items()} for part in few
    }
    return named_lines_plot(found, known, maximum=top, title=f"{train.name}: {name}")
