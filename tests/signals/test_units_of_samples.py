"""Units of samples as proximity probes, pickups and old instruments write them: right, or refused with the remedy."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest

from gearmbs.signals import (
    SignalError,
    analyse,
    convert,
    make_signal,
    read_signal,
    to_signal,
    vibration_zones,
    with_metadata,
)
from gearmbs.signals.signal.labels import name_and_unit
from gearmbs.signals.signal.units import unit_dimension
from tests.says import says

INCH, GRAVITY = 0.0254, 9.80665
RATE, LINE = 5000.0, 50.0
TIME = np.arange(12500) / RATE
SWING = np.cos(2 * np.pi * LINE * TIME)


@pytest.mark.parametrize(("unit", "dimension", "factor"), [
    ("mil", "displacement", 1e-3 * INCH), ("mils", "displacement", 1e-3 * INCH), ("MIL", "displacement", 1e-3 * INCH),
    ("Mils", "displacement", 1e-3 * INCH), ("thou", "displacement", 1e-3 * INCH), ("mil/s", "velocity", 1e-3 * INCH),
    ("ips", "velocity", INCH), ("IPS", "velocity", INCH), ("in/s", "velocity", INCH), ("IN/S", "velocity", INCH),
    ("in/s2", "acceleration", INCH), ("m/S^2", "acceleration", 1.0), ("m/S2", "acceleration", 1.0),
    ("M/S^2", "acceleration", 1.0), ("M/S2", "acceleration", 1.0), ("M/S\u00b2", "acceleration", 1.0),
    ("MM/S", "velocity", 1e-3), ("mm/S", "velocity", 1e-3), ("UM", "displacement", 1e-6), ("MG", "acceleration",
    1e-3 * GRAVITY), ("\u00b5g", "acceleration", 1e-6 * GRAVITY), ("g's", "acceleration", GRAVITY),
    ("m s-2", "acceleration", 1.0), ("mm s-1", "velocity", 1e-3), ("m s^-2", "acceleration", 1.0),
])  # fmt: skip
def test_units_of_vibration_are_what_instruments_mean(unit, dimension, factor):
    signal = to_signal(SWING, rate=RATE, units=unit)
    assert unit_dimension(signal.attrs["units"]) == (dimension, pytest.approx(factor))
    omega = 2 * np.pi * LINE
    power = {"displacement": 2, "velocity": 1, "acceleration": 0}[dimension]
    middle = slice(5000, 7500)
    found = convert(signal, "acceleration", band=(20.0, 1000.0)).values[middle, 0]
    assert np.ptp(found) / 2.0 == pytest.approx(factor * omega**power, rel=1e-3)


@pytest.mark.parametrize("unit", ["Mg", "mM", "s", "mil*mil", "mils s"])
def test_capitals_that_mean_something_else_are_no_vibration(unit):
    with pytest.raises(SignalError, match=says("units", unit)):
        unit_dimension(unit)


@pytest.mark.parametrize(("unit", "bare"), [
    ("mil pp", "mil"), ("mil p-p", "mil"), ("mils pk-pk", "mils"), ("mil_pp", "mil"), ("g pk", "g"), ("g peak", "g"),
    ("mm/s pk", "mm/s"), ("mm/s RMS", "mm/s"), ("mm/s (rms)", "mm/s"), ("grms", "g"), ("g RMS", "g"), ("gPk", "g"),
    ("ips pk", "ips"), ("in/s 0-p", "in/s"), ("um peak-to-peak", "um"), ("\u00b5m SS", "\u00b5m"),
    ("mm/s eff", "mm/s"), ("m/s\u00b2 rms", "m/s\u00b2"), ("V rms", "V"), ("g true pk", "g"), ("IPS PK", "IPS"),
    ("thou pp", "thou"),
])  # fmt: skip
def test_units_of_levels_are_refused_with_that_of_the_samples(unit, bare):
    with pytest.raises(SignalError, match=says(unit, f"units={bare!r}", "level")):
        to_signal(SWING, rate=RATE, units=unit)
    assert to_signal(SWING, rate=RATE, units=bare).attrs["units"] == bare


def test_zones_of_a_record_in_mil_are_those_of_the_same_one_in_metres():
    """2 mil of amplitude at 50 Hz are 11.3 mm/s, zone D; taken for angles they had been 0.015 mm/s, zone A."""
    wanted = vibration_zones(2.0 * 25.4e-6 * SWING, "3000 rpm", rate=RATE, units="m")
    found = vibration_zones(2.0 * SWING, "3000 rpm", rate=RATE, units="mil")
    assert found["zone"].tolist() == wanted["zone"].tolist() == ["D"]
    np.testing.assert_allclose(found["velocity"], wanted["velocity"], rtol=1e-9)
    np.testing.assert_allclose(found["velocity"], 2.0 * 25.4e-6 * 2 * np.pi * LINE / np.sqrt(2.0), rtol=2e-3)
    with pytest.raises(SignalError, match=says("mil pp", "units='mil'")):
        vibration_zones(2.0 * SWING, "3000 rpm", rate=RATE, units="mil pp")


def test_a_file_whose_unit_is_that_of_a_level_says_so(tmp_path):
    pd.DataFrame({"t [s]": TIME, "v [mm/s RMS]": SWING}).to_csv(tmp_path / "r.csv", index=False)
    signal = read_signal(tmp_path / "r.csv")
    assert any(re.search(says("CHECK THE UNIT", "v", "mm/s RMS", "--units 'v=mm/s'"), n) for n in signal.attrs["notes"])
    assert "level" in analyse(signal, speed="3000 rpm").missing["velocity_rms"]
    with pytest.raises(SignalError, match=says("mm/s RMS", "units='mm/s'")):
        convert(signal, "acceleration", band=(20.0, 1000.0))
    told = read_signal(tmp_path / "r.csv", units={"v": "mm/s"})
    assert "notes" not in told.attrs
    assert "velocity_rms" not in analyse(told, speed="3000 rpm").missing
    again = with_metadata(signal, units="mm/s")
    assert unit_dimension(again.attrs["units"])[0] == "velocity"


def test_headings_may_have_american_units():
    assert name_and_unit("x / mil") == ("x", "mil")
    assert name_and_unit("v in ips") == ("v", "ips")
    assert name_and_unit("a [M/S2]") == ("a", "M/S2")
    assert make_signal([0.0, 1.0], 1.0, units="mils").attrs["units"] == "mils"
