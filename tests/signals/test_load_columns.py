"""Columns of torques, forces, currents and powers beside vibration: left out with a word, and places called so stay."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from gearmbs.signals import analyse, make_signal, read_signal
from gearmbs.signals.analysis.series import series
from gearmbs.signals.signal.labels import measured, name_and_unit
from gearmbs.signals.signal.loads import load_of
from tests.says import says

RATE, COUNT = 5000.0, 5000
TIME = np.arange(COUNT) / RATE
ACC = np.cos(2 * np.pi * 100 * TIME)
SLOW = 40.0 + np.cos(2 * np.pi * 3 * TIME)


@pytest.mark.parametrize(("label", "load"), [
    ("torque [N m]", "torque"), ("torque [N*m]", "torque"), ("M / Nm", "torque"), ("Md in kNm", "torque"),
    ("Drehmoment [N·m]", "torque"), ("Couple [daN.m]", "torque"), ("T2 [lbf-ft]", "torque"), ("T2 [in-lb]", "torque"),
    ("x (ft-lbs)", "torque"), ("Input torque", "torque"), ("torque_out", "torque"), ("MotorTorque", "torque"),
    ("Drehmoment Abtrieb 2", "torque"), ("Kroutící moment [V]", "torque"), ("torque [%]", None),
    ("F / kN", "force"), ("Fx [N]", "force"), ("Kraft", "force"), ("load cell [mV]", "force"), ("brake force", "force"),
    ("I / A", "current"), ("Ia [mA]", "current"), ("Motorstrom", "current"), ("motor current U", "current"),
    ("Courant moteur", "current"), ("P [kW]", "power"), ("electric power [W]", "power"), ("Leistung", "power"),
    # what is called by a place, or has a unit of vibration, is vibration
    ("Torque side acc", None), ("Torque side acc [V]", None), ("torque [m/s^2]", None), ("torque [g]", None),
    ("Torque arm X", None), ("Kraftseite [mm/s]", None), ("Stromseite", None), ("Current side", None), ("a [g]", None),
    ("power end [mV]", None), ("momentary [g]", None), ("F", None), ("M", None), ("displacement [nm]", None),
    ("acc torque", None), ("a [V]", None), ("ch1", None), ("load side", None), ("moment", "torque"),
    ("microphone [Pa]", None), ("s [mm]", None),
])  # fmt: skip
def test_what_holds_a_load(label, load):
    assert load_of(*name_and_unit(label)) == load


@pytest.mark.parametrize(("label", "word"), [
    ("Torque [N m]", "torque"), ("M / Nm", "torque"), ("Kraft [kN]", "force"), ("Strom [A]", "current"),
    ("P [kW]", "power"), ("Input torque", "torque"), ("Motor current [V]", "current"),
])  # fmt: skip
def test_a_load_beside_vibration_is_left_out_with_a_word(label, word, tmp_path):
    path = tmp_path / "rig.csv"
    pd.DataFrame({"t [s]": TIME, "a [g]": ACC, label: SLOW}).to_csv(path, index=False)
    name = name_and_unit(label)[0]
    report = analyse(path)
    assert report.levels["channel"].values.tolist() == ["a"]
    assert any(pd.Series(report.notes).str.contains(says(name, word, "vibration")))
    assert read_signal(path)["channel"].values.tolist() == ["a", name]
    both = analyse(path, channels=["a", name])
    assert both.levels["channel"].values.tolist() == ["a", name]
    table = series([path], channels=["a", name])
    assert {"a.rms", f"{name}.rms"} <= set(table.columns)


def test_places_called_so_and_units_of_vibration_stay():
    names = ["Torque side acc", "Force plate", "Stromseite"]
    signal = make_signal(np.stack([ACC, ACC, ACC], 1), RATE, channels=names, units=["unknown", "g", "mm/s"])
    assert measured(signal)[0]["channel"].values.tolist() == names
    assert not any("vibration" in note for note in measured(signal)[0].attrs.get("notes", ()))


def test_a_place_without_a_unit_that_may_be_a_load_stays_with_a_word():
    signal = make_signal(np.stack([ACC, ACC], 1), RATE, channels=["a", "Torque arm X"], units=["g", "unknown"])
    left, _ = measured(signal)
    assert left["channel"].values.tolist() == ["a", "Torque arm X"]
    assert any(pd.Series(left.attrs["notes"]).str.contains(says("Torque arm X", "torque", "units=")))


@pytest.mark.parametrize("named", [("torque", "N m", "torque"), ("I", "A", "current"), ("T1", "degC", "temperature")])
def test_alone_or_beside_a_speed_they_are_analysed_with_a_word(named):
    name, unit, word = named
    alone = make_signal(SLOW[:, None], RATE, channels=[name], units=[unit])
    report = analyse(alone)
    assert report.levels["channel"].values.tolist() == [name]
    assert any(pd.Series(report.notes).str.contains(says(name, word, "vibration")))
    if word != "temperature":
        beside = make_signal(np.stack([SLOW, 1500 + SLOW], 1), RATE, channels=[name, "n"], units=[unit, "rpm"])
        report = analyse(beside)
        assert report.levels["channel"].values.tolist() == [name]
        assert report.speed == pytest.approx((1500 + SLOW.mean()) * np.pi / 30, rel=1e-3)
        assert any(pd.Series(report.notes).str.contains(says(name, word, "vibration")))


def test_forces_alone_are_the_measured_quantity():
    """Of what dynamometers and simulations give nothing is said."""
    signal = make_signal(np.stack([SLOW, ACC], 1), RATE, channels=["Fx", "Fy"], units=["N", "N"])
    assert measured(signal) == (signal, None)
