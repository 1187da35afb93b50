"""Columns that are no vibration by the shape of their values, whatever they are called."""

import numpy as np
import pytest

from gearmbs.signals import SignalError, analyse, make_signal
from gearmbs.signals.signal.labels import measured, role_of
from tests.generators import seed
from tests.says import says

RATE = 2048.0
TIME = np.arange(4096) / RATE
RNG = np.random.default_rng(seed(5))
TURNS = 25.0 * TIME
SWAYING = TURNS + 0.1 * np.sin(2 * np.pi * 2.0 * TIME)
VIBRATION = 3.0 * np.cos(2 * np.pi * 400 * TIME) + 0.1 * RNG.standard_normal(TIME.size)
PULSES = 5.0 * (TURNS % 1.0 < 0.1)
SHAPES = {
    "pulses": {
        "two values": PULSES,
        "noise and slopes": np.convolve(PULSES, [0.3, 0.4, 0.3], "same") + 0.02 * RNG.standard_normal(TIME.size),
        "upside down": 5.0 - PULSES,
        "an encoder": np.sign(np.sin(2 * np.pi * 8 * SWAYING)),
        "of one sample": (np.diff(np.floor(SWAYING), prepend=0.0) > 0).astype(float),
    },
    "turns": {
        "0 to 360 deg": 360.0 * (SWAYING % 1.0),
        "0 to 2 pi, falling": 2 * np.pi * (-SWAYING % 1.0),
        "turns": np.floor(SWAYING),
        "counts": np.floor(1024 * SWAYING),
        "counts of a turn": np.floor(1024 * SWAYING) % 1024,
        "a status that changes once": np.floor(0.6 * TIME),
        "status": np.floor(0.7 * TIME**2 * 10),
    },
    None: {
        "vibration": VIBRATION,
        "clipped": np.clip(VIBRATION, -2.0, 2.0),
        "blows": np.exp(-0.4 * (np.arange(TIME.size) % 80)) + 0.01 * VIBRATION,
        "blows of one sample": 20.0 * (np.arange(TIME.size) % 200 == 0) + RNG.standard_normal(TIME.size),
        "half waves": np.maximum(0.0, np.sin(2 * np.pi * TURNS)),
        "a torque that sways": 50.0 + 3.0 * np.sin(2 * np.pi * 0.3 * TIME) + 0.01 * VIBRATION,
        "coarse steps": np.round(1.4 * np.cos(2 * np.pi * 33.7 * TIME)),
        "a decay": np.exp(-TIME) * VIBRATION,
        "a square in noise": np.sign(np.sin(2 * np.pi * TURNS)) + 0.5 * RNG.standard_normal(TIME.size),
        "nothing": np.zeros(TIME.size),
    },
}  # fmt: skip
CASES = [(role, name) for role, each in SHAPES.items() for name in each]


@pytest.mark.parametrize(("role", "name"), CASES, ids=[name for _, name in CASES])
def test_shapes_tell_what_is_no_vibration(role, name):
    values = SHAPES[role][name]
    assert role_of("CH2", "unknown", values) == role
    # of a unit of motion, what goes from zero to some volts
    assert role_of("CH2", "m/s^2", values) == (role if role == "pulses" and name != "an encoder" else None)


@pytest.mark.parametrize("unit", ["um", "m/s^2", "g", "mm/s"])
def test_two_levels_with_a_unit_of_motion_are_vibration(unit):
    """Teeth that rattle between their flanks, an overloaded accelerometer, and one that shows its last digit."""
    rattle = 50.0 * np.sign(np.sin(2 * np.pi * TURNS)) + 2.0 * VIBRATION
    overloaded = np.clip(30.0 * VIBRATION, -1.0, 1.0)
    last_digit = 1e-3 * np.round(0.3 * np.cos(2 * np.pi * 100.0 * TIME) + 0.3)
    for values in (rattle, overloaded, last_digit):
        assert role_of("gap", unit, values) is None
    assert role_of("gap", "um", 2.0 * (rattle + 50.0)) is None
    assert role_of("ref", "V", rattle) == "pulses"


def test_columns_of_pulses_and_angles_are_left_out_and_offered_as_a_tacho():
    columns = {"ch1": VIBRATION, "ch2": PULSES, "ch3": 360.0 * (SWAYING % 1.0)}
    left, speed = measured(make_signal(columns, RATE, units=["m/s^2", "m/s^2", "unknown"]))
    assert left["channel"].values.tolist() == ["ch1"]
    assert speed is None
    notes = " ".join(left.attrs["notes"])
    assert "tacho='ch2'" in notes
    assert "'ch3' rises" in notes
    asked, _ = measured(make_signal(columns, RATE), named=["ch1", "ch2"])
    assert asked["channel"].values.tolist() == ["ch1", "ch2"]


def test_an_encoder_taken_for_one_pulse_a_turn_is_asked_for_its_pulses():
    turns = 60.0 * TIME * 25.0
    # two samples a pulse are few
    record = make_signal({"a": VIBRATION, "enc": np.sign(np.sin(2 * np.pi * turns / 4))}, RATE)
    with pytest.raises(SignalError, match=says("gmf", "22499 rpm", "1", "--pulses")):
        analyse(record, 29, tacho="enc")
