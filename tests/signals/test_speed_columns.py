"""Columns of speeds as laboratories call them: used with the right factor or asked for, never vibration or time."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest

from gearmbs.signals import SignalError, analyse, read_signal
from gearmbs.signals.rotation.shaft import speed_of_channel
from gearmbs.signals.signal.labels import measured, name_and_unit, role_of
from gearmbs.signals.signal.units import unit_dimension
from tests.says import says

RATE, COUNT = 10000.0, 20000
TIME = np.arange(COUNT) / RATE
RPM = 600.0 + 600.0 * TIME
TURNS = np.cumsum(RPM / 60.0) / RATE
NOISE = np.random.default_rng(0).standard_normal(COUNT)
ACC = np.cos(2 * np.pi * 5 * TURNS) + 0.5 * np.cos(2 * np.pi * 10 * TURNS) + 0.05 * NOISE
RAD = np.pi / 30.0


def written(path, label, values):
    pd.DataFrame({"t [s]": TIME, "a [g]": ACC, label: values}).to_csv(path, index=False, float_format="%.5f")
    return path


@pytest.mark.parametrize(("label", "factor"), [
    ("omega [1/s]", RAD), ("Omega [rad/s]", RAD), ("\u03c9 [rad/s]", RAD), ("\u03a9 in 1/s", RAD),
    ("Winkelgeschwindigkeit [1/s]", RAD), ("Winkelgeschwindigkeit / (rad/s)", RAD), ("angular velocity [s^-1]", RAD),
    ("angular speed [deg/s]", 6.0), ("vitesse angulaire [rad/s]", RAD),
    ("Drehzahl [1/s]", 1.0 / 60.0), ("n [1/s]", 1.0 / 60.0), ("Drehfrequenz [Hz]", 1.0 / 60.0),
    ("f_rot [Hz]", 1.0 / 60.0), ("Wellenfrequenz [Hz]", 1.0 / 60.0), ("rotational frequency [Hz]", 1.0 / 60.0),
    ("n [0.1 rpm]", 10.0), ("n [0,1 1/min]", 10.0), ("speed [rpm x 10]", 0.1), ("Drehzahl [x 0.5 U/min]", 2.0),
    ("n [10^-1 rpm]", 10.0), ("n [rpm]", 1.0), ("n [min\u207b\u00b9]", 1.0), ("n / s\u207b\u00b9", 1.0 / 60.0),
])  # fmt: skip
def test_speeds_are_used_in_the_unit_that_name_and_unit_mean(label, factor, tmp_path):
    signal = read_signal(written(tmp_path / "s.csv", label, factor * RPM))
    left, column = measured(signal)
    assert column is not None
    np.testing.assert_allclose(speed_of_channel(left, column), RAD * RPM, rtol=1e-4)


@pytest.mark.parametrize(("label", "values", "words"), [
    ("n", RPM, ("n", "missing", "--units 'n=rpm'")),
    ("speed", RPM / 60.0, ("speed", "missing", "units={'speed': 'rpm'}")),
    ("n", 1200.0 - 300.0 * (TIME - 2.0) ** 2, ("n", "missing")), ("n", -RPM, ("n", "missing")),
    ("Drehzahl [V]", RPM / 300.0, ("Drehzahl", "'V'")), ("speed [digits]", RPM, ("speed", "'digits'")),
    ("speed [km/h]", RPM / 100.0, ("speed", "'km/h'")), ("omega [Hz]", RPM / 60.0, ("omega", "'Hz'")),
    ("n [100 rpm]", RPM / 100.0, ("n", "'100 rpm'")),
])  # fmt: skip
def test_speeds_whose_unit_is_open_are_asked_for(label, values, words, tmp_path):
    """In the report, and beside what fails without it."""
    path = written(tmp_path / "s.csv", label, values)
    signal = read_signal(path)
    left, column = measured(signal)
    assert (left["channel"].values.tolist(), column) == (["a"], None)
    assert any(pd.Series(left.attrs["notes"]).str.contains(says("unit of the speed", *words)))
    assert not any("tells time" in note for note in left.attrs["notes"])


def test_what_fails_without_the_speed_names_the_column_that_may_hold_it(tmp_path):
    path = written(tmp_path / "s.csv", "n", RPM)
    with pytest.raises(SignalError, match=says("signal", "--units 'n=rpm'")):
        analyse(path, 5)
    report = analyse(path, 5, units={"n": "rpm"})
    assert report.speed * 30.0 / np.pi == pytest.approx(RPM.mean(), rel=1e-3)


def test_an_angular_velocity_in_reciprocal_seconds_is_remarked_on(tmp_path):
    path = written(tmp_path / "s.csv", "omega [1/s]", RAD * RPM)
    report = analyse(path)
    assert report.speed == pytest.approx(RAD * RPM.mean(), rel=1e-3)
    assert any("rad/s" in note and "rps" in note for note in report.notes)
    told = analyse(path, units={"omega": "rps"})
    assert told.speed == pytest.approx(2 * np.pi * RAD * RPM.mean(), rel=1e-3)


@pytest.mark.parametrize(("name", "unit", "values", "role"), [
    ("n", "unknown", np.arange(100.0), "count"), ("n", "unknown", ACC, None), ("f", "Hz", RPM / 60.0, "frequency"),
    ("speed", "mm/s", ACC, None), ("wind speed", "m/s", ACC, "travel"), ("gyro x", "rad/s", ACC, None),
    ("torsion", "deg/s", ACC, None), ("speed pulse", "V", ACC, "tacho"), ("v", "mm/s RMS", ACC, None),
    ("a", "0.001 g", ACC, None), ("speed", "unknown", RPM, "speed"), ("n", "-", RPM, "speed"),
])  # fmt: skip
def test_what_is_a_speed_and_what_is_not(name, unit, values, role):
    assert role_of(name, unit, values) == role


def test_a_frequency_is_no_vibration_and_may_be_the_shafts(tmp_path):
    path = written(tmp_path / "s.csv", "f [Hz]", RPM / 60.0)
    report = analyse(path)
    assert list(report.levels["channel"]) == ["a"]
    assert any("--speed-channel 'f'" in note for note in report.notes)
    assert analyse(path, speed_channel="f").speed == pytest.approx(RAD * RPM.mean(), rel=1e-3)


@pytest.mark.parametrize(("unit", "factor"), [("x0.001 g", 9.80665e-3), ("10^-3 g", 9.80665e-3), ("0.1 mm/s", 1e-4)])
def test_multiples_of_units_are_these(unit, factor):
    assert unit_dimension(unit)[1] == pytest.approx(factor)
    with pytest.raises(SignalError, match=says("50 g")):
        unit_dimension("50 g")
    assert name_and_unit(f"a [{unit}]") == ("a", unit)


@pytest.mark.parametrize("swing", [0.0, 20.0, 90.0])
@pytest.mark.parametrize("share", [0.0, 3e-4, -5e-4, 2e-3])
def test_a_speed_that_is_off_is_calibrated_by_the_mesh_line(swing, share):
    """23 teeth, cosines of 2 and 1: by column and curve the lines have their heights, steady, swaying or varying."""
    t = np.arange(38400) / 12800.0
    rpm = 1500.0 + swing * np.sin(2 * np.pi * 0.4 * t)
    angle = 2 * np.pi * np.cumsum(rpm / 60.0) / 12800.0
    noise = 0.3 * np.random.default_rng(1).standard_normal(t.size)
    table = pd.DataFrame({"time": t, "acc [m/s^2]": 2 * np.cos(23 * angle) + np.cos(46 * angle) + noise})
    report = analyse(table.assign(**{"speed [rpm]": rpm * (1.0 + share)}), 23)
    found = report.harmonics["orders"].values[:2, 0]
    np.testing.assert_allclose(found, [np.sqrt(2.0), np.sqrt(0.5)], rtol=0.02)
    assert any("calibrated" in note for note in report.notes) == (share != 0.0)
    # lines of the record's spectrum by which the mesh is off
    far = abs(share) * 575.0 * 3.0 > 2.0
    assert any(note.startswith("CHECK THE SPEED") for note in report.notes) == far
    assert report.speed == pytest.approx(np.pi / 30 * rpm.mean(), rel=5e-5)


@pytest.mark.parametrize("beside", [0.004, 0.015])
@pytest.mark.parametrize("height", [1.0, 3.0])
def test_a_foreign_line_beside_the_mesh_is_not_taken_for_it(beside, height):
    """The column is right: its lines keep their heights, whatever stands 0.4 or 1.5 % beside them."""
    t = np.arange(64000) / 12800.0
    angle = 2 * np.pi * 25.0 * t
    noise = 0.1 * np.random.default_rng(1).standard_normal(t.size)
    values = 2 * np.cos(23 * angle) + np.cos(46 * angle) + height * 2 * np.cos(23 * (1 + beside) * angle) + noise
    report = analyse(pd.DataFrame({"time": t, "acc [m/s^2]": values, "speed [rpm]": np.full(t.size, 1500.0)}), 23)
    np.testing.assert_allclose(report.harmonics["orders"].values[:2, 0], [np.sqrt(2.0), np.sqrt(0.5)], rtol=0.05)


@pytest.mark.parametrize("beside", [2e-4, -4e-4, 8e-4])
def test_a_stronger_line_that_no_window_tells_from_the_mesh_is_not_taken_for_it(beside):
    """One to four lines of the spectrum away: the sum beats. 1.37 of it had been the mesh's, without a remark."""
    t = np.arange(102400) / 12800.0
    angle = 2 * np.pi * 25.0 * t
    noise = 0.3 * np.random.default_rng(1).standard_normal(t.size)
    values = 0.8 * np.cos(23 * angle) + 2 * np.cos(23 * (1 + beside) * angle + 0.4) + noise
    report = analyse(pd.DataFrame({"time": t, "acc [m/s^2]": values, "speed [rpm]": np.full(t.size, 1500.0)}), 23)
    assert any(re.search(says("CHECK THE SPEED", "one of which"), note) for note in report.notes)
    assert report.speed == pytest.approx(50.0 * np.pi, rel=1e-9)
    assert report.harmonics["orders"].values[0, 0] == pytest.approx(0.8 / np.sqrt(2.0), rel=0.3)


def test_a_foreign_line_alone_beside_a_told_speed_is_said_and_not_taken():
    """No mesh line, but one 1.5 % off it: the column is kept, and the line is named."""
    t = np.arange(64000) / 12800.0
    values = np.cos(23 * 1.015 * 2 * np.pi * 25.0 * t) + 0.1 * np.random.default_rng(1).standard_normal(t.size)
    report = analyse(pd.DataFrame({"time": t, "acc [m/s^2]": values, "speed [rpm]": np.full(t.size, 1500.0)}), 23)
    assert report.speed == pytest.approx(50.0 * np.pi, rel=1e-9)
    assert any(note.startswith("CHECK THE SPEED") for note in report.notes)
    assert report.harmonics["orders"].values[0, 0] < 0.05


def analysed(rpm, column):
    """A mesh line of 23 teeth and its second harmonic at a speed (rpm), beside a column that says another."""
    t = np.arange(rpm.size) / 12800.0
    angle = np.cumsum(rpm) * 2 * np.pi / 60.0 / 12800.0
    values = 2 * np.cos(23 * angle) + np.cos(46 * angle) + 0.3 * np.random.default_rng(1).standard_normal(t.size)
    return analyse(pd.DataFrame({"time": t, "acc [m/s^2]": values, "speed [rpm]": column}), 23)


TIMES = np.arange(6 * 12800) / 12800.0
SWAYS, RISES, STAYS = 1500.0 + 100.0 * np.sin(0.6 * np.pi * TIMES), 900.0 + 150.0 * TIMES, np.full(TIMES.size, 1500.0)


@pytest.mark.parametrize(
    ("rpm", "column"),
    [
        (SWAYS, np.interp(TIMES - 0.1, TIMES, SWAYS)),
        (RISES, np.interp(TIMES - 0.02, TIMES, RISES)),
        (RISES, RISES + 3.0),
        (STAYS, STAYS * (1.0 + 3e-4 * TIMES)),
    ],
    ids=["late, swaying", "late, rising", "an offset", "a drift"],
)
def test_a_speed_column_that_no_factor_mends_is_told(rpm, column):
    """The phase of the mesh line wanders, which one factor cannot mend: most of the line is lost, and that is said."""
    report = analysed(rpm, column)
    assert report.harmonics["orders"].values[0, 0] < 1.0
    assert sum("phase wanders" in note for note in report.notes) == 1


@pytest.mark.parametrize("rpm", [SWAYS, RISES, STAYS])
@pytest.mark.parametrize("share", [0.0, 0.003, -0.004])
def test_a_speed_column_that_a_factor_mends_has_its_lines(rpm, share):
    """0.3 % are ten lines of the spectrum; what is beside the line is not told of another."""
    report = analysed(rpm, rpm * (1.0 + share))
    np.testing.assert_allclose(report.harmonics["orders"].values[:2, 0], [np.sqrt(2.0), np.sqrt(0.5)], rtol=0.02)
    assert not any("phase wanders" in note or "something else" in note for note in report.notes)
