"""The spectrum of a drivetrain's record with the lines of its kinematic table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import xarray as xr

from gearmbs.drivetrain import Accelerometer, Drivetrain, DrivetrainError
from gearmbs.signals import spectrum
from gearmbs.signals.simulated import held_speed, holds_speed
from gearmbs.studies.trains import train_signal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
