"""What is shown of a drivetrain: report, spectrum, 3-D view and Campbell diagram."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gearmbs.drivetrain import Accelerometer, Drivetrain, DrivetrainError, UniversalJoint
from gearmbs.drivetrain.kinematics import RPM
from gearmbs.drivetrain.members.rim import ring_meshes_of
from gearmbs.drivetrain.planetary import Meshing, PlanetaryStage
from gearmbs.gears.geometry import turn_z
from gearmbs.signals import spectrum
from gearmbs.signals.analysis.report import markdown_table
from gearmbs.signals.files.simulated import holds_speed
from gearmbs.studies.mode_names import train_modes, whirl_senses, with_gains
from gearmbs.studies.run.record import flank_shares
from gearmbs.studies.same_train import check_record_of
from gearmbs.studies.train_record import STRAY, recorded_table
from gearmbs.studies.trains import train_signal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gearmbs.dae.analyses.modes import Modes
    from gearmbs.view.mesh import Mesh
    from gearmbs.view.scene import Scene

ROUNDEST = 4000.0
"""Radius of the largest wheel over the distance of a chord from its curve: a quarter of a pixel in 1000."""


def train_report(train: Drivetrain, record: xr.Dataset) -> str:
    """Return the report of a record: frequencies, torques, meshes, bearings, sensors, harmonics, cost.

    What the drivetrain has none of has no section.

    Raises
    ------
    DrivetrainError
        For the record of another drivetrain.
    """
    check_record_of(train, record)
    sections = [_frequencies, _bearings, _sensors, _cost]
    if train.meshings:
        sections = [_frequencies, _meshes, _bearings, _sensors, _levels, _cost]
    lines = [f"# {train.name}", ""]
    for section in sections:
        lines += [*section(train, record), ""]
    return "\n".join(lines)


def _frequencies(train: Drivetrain, record: xr.Dataset) -> list[str]:
    rows = []
    for name in (shaft.name for shaft in train.shafts):
        mean = float(record["speed"].sel(shaft=name).mean())
        rows.append([name, f"{train.speeds[name] * RPM:.6g}", f"{mean * RPM:.6g}"])
    lines = ["## Speeds and frequencies", ""]
    lines.append(markdown_table(["shaft", "nominal, rpm", "mean of the record, rpm"], rows))
    said = record.attrs.get("remarks", "none")
    remarks = [] if said == "none" else ["", f"**{said}**"]
    return [*lines, *remarks, "", "Frequencies at the nominal speeds:", "", train.kinematics.to_markdown()]


def _meshes(train: Drivetrain, record: xr.Dataset) -> list[str]:
    header = ["mesh", "torque on the driven wheel, N m", "torque over base radius, N", "mean normal force, N",
              "both flanks, % of time", "no contact, %", "transmission error p-p, um"]  # fmt: skip
    rows = []
    for mesh in train.meshings:
        one = record.sel(mesh=mesh.name)
        radius = train.pairs[mesh.name].geometry.driven.base_radius
        torque = radius * train.mesh_springs[mesh.name].preload
        force, error = float(one["normal_force"].mean()), 1e6 * np.ptp(one["transmission_error"].values)
        rows.append(
            [mesh.name, *(f"{v:.5g}" for v in (torque, torque / radius, force)), *flank_shares(one), f"{error:.4g}"]
        )
    return ["## Meshes", "", markdown_table(header, rows), "", _laws(train), *_shares(train, record)]


def _shares(train: Drivetrain, record: xr.Dataset) -> list[str]:
    """Return how the planets of each stage share its load: of each the mean force over that of all, times all."""
    rows = []
    for stage in train.planetary_stages:
        members = train.power.members[stage.name]
        for side in ("sun", "ring"):
            names = [one.name for one in train.meshings if one.group == f"{stage.name} {side}"]
            mean = record["normal_force"].sel(mesh=names).mean("time").values
            shares = mean * mean.size / mean.sum() if mean.sum() > 0.0 else mean
            told = ", ".join(f"{share:.4g}" for share in shares)
            rows.append([stage.name, side, f"{members[side]:.5g}", told, f"{shares.max():.4g}"])
    if not rows:
        return []
    header = ["planetary stage", "meshes with", "torque of the planets on it, N m", "shares of planets 1, 2, ...",
              "largest"]  # fmt: skip
    return ["", "Shares of the load, 1 of equal planets:", "", markdown_table(header, rows)]


def _laws(train: Drivetrain) -> str:
    """Return the contact laws, and what they make of both shafts of each mesh."""
    header = ["mesh", "contact law", "mean stiffness of the mesh, N/um", "damping, N s/mm", "natural frequency, Hz",
              "of critical damping"]  # fmt: skip
    rows = []
    for name, m in train.mesh_dynamics.items():
        if m.stiffness == 0.0:
            # by a law that has no stiffness without load
            rows.append([name, m.law, "0, carries nothing", "0", "-", "-"])
            continue
        over = ", **over-damped**" if m.damping_ratio > 1.0 else ""
        rows.append([name, m.law, f"{1e-6 * m.stiffness:.4g}", f"{1e-3 * m.damping:.4g}", f"{m.frequency:.5g}",
                     f"{m.damping_ratio:.3g}{over}"])  # fmt: skip
    return markdown_table(header, rows)


def _bearings(train: Drivetrain, record: xr.Dataset) -> list[str]:
    rows = []
    for bearing in record.bearing.values:
        force = record["bearing_force"].sel(bearing=bearing).values
        mean = ", ".join(f"{v:.4g}" for v in force.mean(axis=0))
        rms = ", ".join(f"{v:.4g}" for v in force.std(axis=0))
        rows.append([bearing, mean, rms, f"{np.linalg.norm(force, axis=1).max():.5g}"])
    header = ["bearing", "mean x, y, z, N", "RMS about the mean x, y, z, N", "largest, N"]
    return ["## Bearings", "", markdown_table(header, rows)]


def _sensors(train: Drivetrain, record: xr.Dataset) -> list[str]:
    if not train.sensors:
        return []
    rows = []
    for sensor in train.sensors:
        values = record["measured"].sel(sensor=sensor.name).values
        rows.append([sensor.name, sensor.unit, *(f"{v:.5g}" for v in (values.mean(), values.std(), np.ptp(values)))])
    return ["## Sensors", "", markdown_table(["sensor", "unit", "mean", "RMS about the mean", "peak to peak"], rows)]


def _levels(train: Drivetrain, record: xr.Dataset) -> list[str]:
    if "mesh_track" in record:
        return _highest(train, record)
    lines = ["## Mesh harmonics, RMS", ""]
    harmonics = record.harmonic.values
    for mesh in one_a_group(train):
        levels = record["mesh_rms"].sel(mesh=mesh.name)
        rows = [[signal, *(f"{v:.4g}" for v in levels.sel(signal=signal).values)] for signal in record.signal.values]
        table = markdown_table(["signal", *(f"{h} x" for h in harmonics)], rows)
        lines += [f"### {mesh.group}, {_at(levels)}", "", table, ""]
    return lines


def one_a_group(train: Drivetrain) -> list[Meshing]:
    """Return the meshes whose harmonics are told: planets of a stage mesh at one frequency."""
    return list({mesh.group: mesh for mesh in reversed(train.meshings)}.values())[::-1]


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
    for mesh in one_a_group(train):
        rows = []
        for signal in tracks.signal.values:
            for h in tracks.harmonic.values:
                row = tracks.sel(signal=signal, mesh=mesh.name, harmonic=h)
                if np.isfinite(row.values).any():
                    k = int(np.nanargmax(row.values))
                    at = h * float(row["track_frequency"].values[k])
                    rows.append([signal, h, f"{row.values[k]:.4g}", f"{speed[k]:.5g}", f"{at:.5g}"])
        table = markdown_table(["signal", "harmonic", "RMS", "rpm", "Hz"], rows)
        lines += [f"### {mesh.group}", "", table, ""]
    return lines


def _cost(train: Drivetrain, record: xr.Dataset) -> list[str]:
    kept = ("steps", "residuals", "jacobians", "wall_time", "time_per_mesh_cycle")
    told = {key.replace("_", " "): record.attrs.get(f"solver_{key}") for key in kept}
    rows = [[key, f"{value:.6g}"] for key, value in told.items() if value is not None]
    return ["## Integration", "", markdown_table(["quantity", "value"], rows)]


def train_shapes(train: Drivetrain) -> dict[str, Mesh]:
    """Return the meshes of all shafts with their wheels, in the bodies' frames, for scenes."""
    from gearmbs.view.mesh import cylinder, joined
    from gearmbs.view.scenes import TOLERANCE
    from gearmbs.view.solid import pair_solids

    wheels: dict[str, Mesh] = {}
    # a wheel among many fills a part of the picture; its outline is as round as that of the largest alone
    largest = max((wheel.gear.outer_radius for wheel in train.wheels), default=0.0)
    tolerance = max(TOLERANCE, largest / ROUNDEST)
    for mesh in train.meshes:
        for name, solid in zip((mesh.driver, mesh.driven), pair_solids(train.pairs[mesh.name], tolerance), strict=True):
            wheels.setdefault(name, solid)
    out: dict[str, Mesh] = {}
    members: dict[str, list[Mesh]] = {shaft.name: [] for shaft in train.shafts}
    for stage in train.planetary_stages:
        for name, on, shape in _stage_shapes(train, stage, tolerance):
            if on in members:
                members[on].append(shape)
            elif on == name:
                out[name] = shape
    for shaft in train.shafts:
        pieces, z = members[shaft.name], 0.0
        for length, radius in shaft.cylinders:
            pieces.append(cylinder(radius, length, 48).placed(np.array([0.0, 0.0, z + 0.5 * length]), np.eye(3)))
            z += length
        for wheel in train.wheels:
            if wheel.shaft != shaft.name or wheel.name not in wheels:
                continue
            if wheel.flexible is not None or (shaft.model is not None and wheel.body is None):
                # a body of its own
                out[wheel.name] = wheels[wheel.name]
            else:
                place = np.array([0.0, 0.0, train.station(wheel)])
                pieces.append(wheels[wheel.name].placed(place, turn_z(train.layout.wheels[wheel.name])))
        out[shaft.name] = joined(pieces)
    return out


def _stage_shapes(train: Drivetrain, stage: PlanetaryStage, tolerance: float) -> Iterator[tuple[str, str, Mesh]]:
    """Yield names and meshes of the members of a planetary stage, and what they are on, in the frames of that."""
    from gearmbs.view.scenes import carrier_mesh
    from gearmbs.view.solid import pair_solids

    sun, _ = pair_solids(train.pairs[f"{stage.name} sun-planet 1"], tolerance)
    planet, ring = pair_solids(train.pairs[f"{stage.planet(1)}-ring"], tolerance)
    for member, mesh in (("sun", sun), ("carrier", carrier_mesh(stage.gears)), ("ring", ring)):
        name, on = f"{stage.name} {member}", getattr(stage, member)
        place = np.zeros(3)
        if member in stage.turning(train):
            place[2] = stage.station(train, member)
        yield name, on, mesh.placed(place, turn_z(train.layout.wheels.get(name) or 0.0))
    for k in range(1, stage.gears.planets + 1):
        yield stage.planet(k), stage.planet(k), planet


def train_scene(train: Drivetrain) -> Scene:
    """Return the 3-D view of a drivetrain at its start: shafts with their wheels, housings as boxes, joints.

    Each shaft has a colour of its own with all that stands on it, while there are colours; housings are seen through.
    """
    from gearmbs.view import mechanism_scene
    from gearmbs.view.figures.style import COLOURS
    from gearmbs.view.scene import Part
    from gearmbs.view.scenes import PART_COLOURS, TOLERANCE
    from gearmbs.view.solid import pair_solids

    housings = [housing.name for housing in train.housings]
    mechanism = train.build()
    scene = mechanism_scene(mechanism, shapes=train_shapes(train), through=housings, title=train.name)
    colours = dict.fromkeys(train.planets, PART_COLOURS["planet"])
    colours |= {shaft.name: COLOURS[k % len(COLOURS)] for k, shaft in enumerate(train.shafts)}
    colours |= {wheel.name: colours[wheel.shaft] for wheel in train.wheels}
    scene.parts = [replace(part, colour=colours.get(part.name, part.colour)) for part in scene.parts]
    for stage in train.planetary_stages:
        # the solids of a ring that is held are on no body of their own
        rim = mechanism.elements.get(ring_meshes_of(stage.name))
        marker = (rim or mechanism.elements[f"{stage.planet(1)}-ring"]).j
        if "ring" not in stage.turning(train):
            _, ring = pair_solids(train.pairs[f"{stage.planet(1)}-ring"], TOLERANCE)
            place, axes = marker.global_position()[None], marker.global_orientation()[None]
            scene.parts.append(Part(f"{stage.name} ring", ring, PART_COLOURS["ring"], place, axes))
    return scene


# The spectrum of a drivetrain's record with the lines of its kinematic table.


HARMONICS, SIDEBANDS = 3, 3
MESH_HARMONICS = 10
"""Harmonics marked of meshes: slow ones have many below the third of the fastest."""
MESHES = ("mesh ", "sidebands ")


def train_spectrum(
    train: Drivetrain, record: xr.Dataset, channel: str | None = None, *, maximum: float | None = None
) -> Figure:
    """Draw the spectrum of one channel of a record with the lines of the kinematic table, and name the strongest.

    Marked are ten harmonics of each mesh frequency with three sidebands on either side, and three of each shaft,
    hunting-tooth, bearing and pump frequency, where the mean speed of the record puts them. A peak is named by a
    bearing only where no line stands that turns with the shafts.

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
    name = channel or (sensors[0].name if sensors else f"force of {train.meshings[0].name}")
    signal = train_signal(record, name)
    table, held = recorded_table(train, record)
    found = spectrum(signal)
    turning = [f for mesh in train.meshings if (f := held * table.mesh_frequency(mesh.name)) > 0.0]
    highest = float(found["frequency"][-1])
    top = maximum or min(highest, 1.08 * HARMONICS * max(turning, default=highest))
    few = table.lines_by_part(HARMONICS, SIDEBANDS)
    many = table.lines_by_part(MESH_HARMONICS, SIDEBANDS)
    known = {
        part: {line: held * at for line, at in (many if part.startswith(MESHES) else few)[part].items()} for part in few
    }
    return named_lines_plot(found, known, maximum=top, title=f"{train.name}: {name}")


# Modes against speed.


def mesh_orders(train: Drivetrain, harmonics: int = 2) -> dict[str, float]:
    """Return the mesh harmonics of a drivetrain as multiples of its first drive's speed, by name.

    Raises
    ------
    ValueError
        For fewer than one harmonic.
    """
    if harmonics < 1:
        raise ValueError(f"harmonics is {harmonics}; give 1 or more")
    turns = train.kinematics.shaft_frequency(train.drives[0].shaft)
    names = [mesh.name for mesh in train.meshes]
    for stage in train.planetary_stages:
        # both sides of plain planets mesh at one frequency, those of stepped ones at two
        plain = stage.gears.planet_at_ring is None
        names += [stage.name] if plain else [f"{stage.name} sun", f"{stage.name} ring"]
    return {
        f"{h} x {name}": h * train.kinematics.mesh_frequency(name) / turns
        for name in names
        for h in range(1, harmonics + 1)
    }


SAME_ORDER = 1e-9
"""Relative difference of orders that are one, as of shafts in a coupling."""


def train_campbell(
    train: Drivetrain, speeds: Sequence[Any] | None = None, *, harmonics: int = 2, maximum: float = 2000.0,
    whirl: bool = False,
) -> xr.Dataset:  # fmt: skip
    """Return the Campbell diagram of a drivetrain: its modes under load against the speed of its first drive.

    The modes are those at rest, where gyroscopic moments count little, or with ``whirl`` those at each speed.

    Parameters
    ----------
    train : Drivetrain
    speeds : sequence, optional
        Of the first drive, rad/s or text; default 0 to 1.2 of the operating speed.
    harmonics : int
        Mesh harmonics that excite; where nothing meshes, the shafts do, once a turn, as unbalances excite them. Shafts
        behind universal joints with an angle do twice a turn.
    maximum : float
        Modes and crossings up to this frequency, Hz.
    whirl : bool
        Modes are those of the shafts that turn at each speed, the teeth standing as at rest: bending modes part into
        whirl forwards and backwards, which ``whirl`` tells over speed and mode, see `gearmbs.studies.whirl_senses`.
        They are followed in the order of their frequencies; names and gains are those at rest.

    Returns
    -------
    Dataset
        See `gearmbs.signals.campbell`; its attribute ``operating_speed`` is that of the first drive, rad/s. Beside it
        the ``mode_name`` of each mode and the ``critical_gain`` of each crossing: how far the excitation moves it, see
        `gearmbs.studies.ranked_crossings`. Draw it by `gearmbs.view.campbell_plot`.
    """
    from gearmbs.signals import campbell

    turned = np.linspace(0.0, 1.2 * abs(train.drives[0].speed), 13) if speeds is None else speeds
    turns = train.kinematics.shaft_frequency
    orders = mesh_orders(train, harmonics) or {
        f"1 x {shaft.name}": turns(shaft.name) / turns(train.drives[0].shaft)
        for shaft in train.shafts
        if turns(shaft.name) > 0.0
    }
    for coupling in train.couplings:
        if isinstance(coupling, UniversalJoint) and coupling.angle and turns(coupling.second) > 0.0:
            orders[f"2 x {coupling.second}"] = 2.0 * turns(coupling.second) / turns(train.drives[0].shaft)
    # of what excites at one order the first is named
    orders = {name: order for k, (name, order) in enumerate(orders.items())
              if not np.isclose(order, list(orders.values())[:k], rtol=SAME_ORDER).any()}  # fmt: skip
    modes = train_modes(train)
    senses: list[dict[float, str]] = []

    def at_speed(speed: float) -> Modes:
        found = train_modes(train, speed=speed)
        told = whirl_senses(train, found) if speed else [""] * len(found)
        senses.append(dict(zip(found.frequencies.tolist(), told)))
        return found

    found = campbell(at_speed if whirl else modes, turned, orders, maximum=maximum)
    found = with_gains(train, found, modes).assign_attrs(operating_speed=abs(train.drives[0].speed))
    if not whirl:
        return found
    told = [[known.get(f, "") for f in row] for known, row in zip(senses, found["frequency"].values.tolist())]
    return found.assign(whirl=(("speed", "mode"), np.asarray(told, dtype=str)))
