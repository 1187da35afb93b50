"""Columns of pulses as counters and programs write them: which are index pulses, and what is asked of bare numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.signals import MissingMetadataError, SignalFileError, read_pulses
from tests.says import says

LINES, TURNS, CLOCK = 64, 20, 20e6
PULSES = (np.arange(1, TURNS * LINES) + 0.5) / (25.0 * LINES)
ONCE = np.arange(1, TURNS) / 25.0
"""s; of 1500 rpm, the first index pulse after half of a turn's marks more."""


def written(path, **columns):
    pd.DataFrame({name: pd.Series(values) for name, values in columns.items()}).to_csv(path, index=False)
    return path


@pytest.mark.parametrize("pulses", ["driver", "t_driver", "driver time", "Zeit driver"])
@pytest.mark.parametrize("once", ["driver index", "t_driver index", "driver Index"])
def test_index_pulses_are_those_of_the_encoder_called_alike(tmp_path, pulses, once):
    columns = {f"{pulses} [us]": 1e6 * PULSES, f"{once} [us]": 1e6 * ONCE}
    found = read_pulses(written(tmp_path / "x.csv", **columns), LINES)
    assert list(found) == [pulses]
    assert found[pulses].referenced
    assert found[pulses].numbers[0] % LINES == 1


def test_index_pulses_of_no_encoder_or_of_two_are_named(tmp_path):
    path = written(tmp_path / "x.csv", **{"A [s]": PULSES, "B [s]": PULSES, "driver index [s]": ONCE})
    with pytest.raises(SignalFileError, match=says("driver index", "'A index'")):
        read_pulses(path, LINES)
    assert read_pulses(path, {"A": LINES, "driver index": 1})["driver index"].lines == 1
    both = {"t_A [s]": PULSES, "A time [s]": PULSES, "A index [s]": ONCE}
    with pytest.raises(SignalFileError, match=says("A index", "'t_A'", "'A time'")):
        read_pulses(written(tmp_path / "y.csv", **both), LINES)


@pytest.mark.parametrize("begin", [0, 2**32 - 10**6])
def test_of_bare_counts_the_clock_is_asked_for_also_where_they_overflow(tmp_path, begin):
    counts = {
        k: (np.rint(CLOCK * v).astype(np.int64) + begin) % 2**32
        for k, v in (("a", PULSES), ("b", PULSES), ("a index", ONCE))
    }
    path = written(tmp_path / "x.csv", **counts)
    with pytest.raises(MissingMetadataError, match=says("clock", "'a'", "whole numbers", "--clock", "--unit")):
        read_pulses(path, LINES)
    assert read_pulses(path, LINES, clock="20 MHz")["a"].referenced
    said = CliRunner().invoke(
        app,
        ["transmission-error", str(path), "--teeth", "23,67", "--base-radius", "32 mm", "--lines", f"{LINES},{LINES}"],
    )
    assert said.exit_code == 1
    assert "--clock" in said.output


def test_of_bare_times_the_unit_is_asked_for_and_voltages_are_read(tmp_path):
    with pytest.raises(MissingMetadataError, match=says("unit", "'a'", "--unit")):
        read_pulses(written(tmp_path / "x.csv", a=PULSES, b=PULSES), LINES)
    volts = 2.5 + 2.5 * np.sign(np.sin(2 * np.pi * 25.0 * 8 * np.arange(20000) / 20e3))
    found = read_pulses(written(tmp_path / "v.csv", a=volts), 8, rate=20e3)
    assert found["a"].times.size == pytest.approx(8 * 25, abs=2)
