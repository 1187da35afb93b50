"""Positions of encoders over time, counts and angles, give the transmission error as their pulses do."""

import math
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.signals import (
    CoupledRun,
    MissingMetadataError,
    SignalError,
    read_pulses,
    transmission_error_from_pulses,
)
from tests.says import says

TEETH, RADIUS, RATE = (20, 43), 18.794e-3, 20e3
TIME = np.arange(round(2.2 * RATE)) / RATE
DRIVER = 2 * math.pi * 25.0 * TIME + 0.3
DRIVEN = (DRIVER - (3e-6 * np.cos(20 * DRIVER) + 1e-6 * np.cos(40 * DRIVER)) / RADIUS) * TEETH[0] / TEETH[1]
FORMS = {
    "deg": (np.degrees(DRIVER), np.degrees(DRIVEN)),
    "rad": (np.mod(DRIVER, 2 * math.pi), np.mod(-DRIVEN, 2 * math.pi)),
    "rev": (DRIVER / (2 * math.pi), DRIVEN / (2 * math.pi)),
    "counts": tuple(np.floor(4096 * angle / (2 * math.pi)) for angle in (DRIVER, DRIVEN)),
    "": tuple(np.floor(4096 * angle / (2 * math.pi)) % 4096 for angle in (DRIVER, DRIVEN)),
}


def written(path, unit, times="%.9f"):
    head = ",".join(["time [s]", *(name + (f" [{unit}]" if unit else "") for name in ("driver", "driven"))])
    np.savetxt(
        path,
        np.stack([TIME, *FORMS[unit]], axis=1),
        header=head,
        comments="",
        delimiter=",",
        fmt=[times, "%.9g", "%.9g"],
    )
    return path


def harmonics(trains):
    found = transmission_error_from_pulses(
        CoupledRun(trains["driver"], trains["driven"]), TEETH, base_radius=RADIUS, mark_error=1e-6
    )
    table = found.harmonics()
    return table.loc[table["harmonic"].isin([1, 2]), "amplitude"].to_numpy()


@pytest.mark.parametrize("unit", FORMS)
def test_positions_over_time_give_the_transmission_error(unit, tmp_path):
    """Counts of a 4096th of a turn are known to 8 um of the mesh each, over 40000 samples to 0.1."""
    lines = None if unit in ("deg", "rad", "rev") else 4096
    trains = read_pulses(written(tmp_path / "a.csv", unit), lines)
    assert list(trains) == ["driver", "driven"]
    assert trains["driver"].lines <= RATE / 25.0
    assert "samples a turn" in trains["driver"].notes[-1]
    assert harmonics(trains) == pytest.approx([3e-6, 1e-6], abs=0.3e-6 if lines else 5e-9)


def test_times_that_are_rounded_do(tmp_path):
    trains = read_pulses(written(tmp_path / "a.csv", "deg", "%.6g"))
    assert harmonics(trains) == pytest.approx([3e-6, 1e-6], abs=0.05e-6)


def test_what_is_missing_of_positions_is_said(tmp_path):
    path = written(tmp_path / "a.csv", "counts")
    with pytest.raises(MissingMetadataError, match=says("lines", "driver", "pass")):
        read_pulses(path)
    np.savetxt(
        tmp_path / "b.csv",
        np.stack(FORMS["deg"], axis=1),
        header="driver [deg],driven [deg]",
        comments="",
        delimiter=",",
    )
    with pytest.raises(MissingMetadataError, match=says("rate", "deg", "--rate")):
        read_pulses(tmp_path / "b.csv")
    assert harmonics(read_pulses(tmp_path / "b.csv", rate="20 kHz")) == pytest.approx([3e-6, 1e-6], abs=5e-9)
    sway = 30.0 * np.sin(2 * np.pi * 0.7 * TIME)
    np.savetxt(
        tmp_path / "c.csv", np.stack([TIME, sway], axis=1), header="time [s],driver [rad]", comments="", delimiter=","
    )
    with pytest.raises(SignalError, match=says("driver", "turns back")):
        read_pulses(tmp_path / "c.csv")


def test_the_command_takes_positions_and_other_lines_of_each_shaft(tmp_path):
    path = written(tmp_path / "a.csv", "deg")
    words = ["transmission-error", str(path), "--teeth", "20,43", "--base-radius", "18.794 mm"]
    for more in ([], ["--lines", "500,400"]):
        done = CliRunner().invoke(app, [*words, *more, "--mark-error", "1e-6"])
        assert done.exit_code == 0, done.output
        assert re.search(r"harmonic 1 of the transmission error is (3|3\.00\d|2\.99\d) um", done.output), done.output
