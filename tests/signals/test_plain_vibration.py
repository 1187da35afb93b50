"""Reports without teeth, and remarks on speeds and rates that cannot be right."""

import math
import re

import numpy as np
import pandas as pd
import pytest

from gearmbs.signals import SignalError, VibrationReport, analyse, compare, make_signal
from gearmbs.signals.rotation.shaft import refined_speed
from tests.generators import seed
from tests.says import says

RATE = 12800.0
SHAFT = 25.0
KNOCKS = 87.3


def machine(seconds=4.0, g=True):
    """Orders 1 and 3 of a shaft at 25.1 Hz, a bearing that knocks at 87.3 Hz around 3 kHz, and noise."""
    t = np.arange(round(seconds * RATE)) / RATE
    rng = np.random.default_rng(1)
    turn = 2 * np.pi * 25.1 * t
    x = 0.2 * np.cos(turn) + 0.1 * np.cos(3 * turn) + 0.02 * rng.standard_normal(t.size)
    since = np.mod(t, 1 / KNOCKS)
    x = x + 1.5 * np.exp(-since * 800) * np.sin(2 * np.pi * 3000 * since)
    return make_signal({"housing": x}, RATE, units="g" if g else None)


@pytest.mark.slow
def test_levels_lines_orders_and_envelope():
    report = analyse(machine(), speed="1500 rpm")
    assert isinstance(report, VibrationReport)
    # found beside the 1500 rpm that were given
    assert report.speed / (2 * np.pi) == pytest.approx(25.1, abs=0.02)
    orders = report.orders.set_index("order")["rms"]
    assert orders[1.0] == pytest.approx(0.2 / math.sqrt(2), rel=0.03)
    assert orders[3.0] == pytest.approx(0.1 / math.sqrt(2), rel=0.06)
    assert report.envelope_lines["frequency"][0] == pytest.approx(KNOCKS, abs=0.5)
    assert report.envelope_lines["order"][0] == pytest.approx(KNOCKS / 25.1, rel=0.01)
    x = machine().values[:, 0]
    assert float(report.levels["peak"][0]) == pytest.approx(np.abs(x - x.mean()).max())
    # 0.2 g at 25.1 Hz and 0.1 g at 75.3 Hz, mostly
    expected = 9.80665 / (2 * np.pi) * math.hypot(0.2 / 25.1, 0.1 / 75.3) / math.sqrt(2)
    assert float(report.levels["velocity_rms"][0]) == pytest.approx(expected, rel=0.1)
    assert report.missing == {}
    assert set(report.tables()) == {"levels", "lines", "spectrum", "orders", "impulsive", "envelope_lines"}
    text = report.to_markdown()
    assert "## Orders of the shaft, RMS" in text
    assert "1500.0 rpm were given: orders are taken at the former" in text
    assert "None" not in text


def test_nothing_is_missing_without_a_reason():
    report = analyse(machine(0.1, g=False))
    for name in ("orders", "impulsive", "envelope", "envelope_lines"):
        assert getattr(report, name) is None
        assert report.missing[name]
    assert "give units=" in report.missing["velocity_rms"]
    row = report.to_frame().iloc[0]
    assert np.isnan(row["speed_rpm"])
    assert "orders: the speed is not known" in row["notes"]
    assert len(report.to_frame(by="channel")) == 1


def test_short_records_of_channels_with_different_bands():
    rng = np.random.default_rng(4)
    x = rng.standard_normal((3000, 3))
    x[::200, 1] += 20.0
    report = analyse(x, rate=2000.0)
    assert report.envelope.sizes["channel"] == 3
    assert np.all(report.envelope["high"].values > report.envelope["low"].values)


def pair(rate=RATE, shaft=SHAFT, teeth=32):
    t = np.arange(round(6 * rate)) / rate
    turn = 2 * np.pi * shaft * t
    x = (1 + 0.4 * np.cos(turn)) * (np.cos(teeth * turn) + 0.5 * np.cos(2 * teeth * turn)) + 0.2 * np.cos(turn)
    return x + 0.1 * np.random.default_rng(0).standard_normal(t.size)


def checks(report):
    return [note for note in report.notes if note.startswith("CHECK")]


@pytest.mark.slow
def test_half_or_double_the_speed_is_remarked():
    assert checks(analyse(pair(), 32, rate=RATE, speed="1500 rpm")) == []
    assert checks(analyse(pair(), 32, rate=RATE)) == []
    for wrong in ("750 rpm", "3000 rpm", "1000 rpm"):
        said = checks(analyse(pair(), 32, rate=RATE, speed=wrong))
        assert any("CHECK THE SPEED" in note and "1500.0 rpm" in note for note in said), (wrong, said)
        assert said[0] in analyse(pair(), 32, rate=RATE, speed=wrong).to_markdown()


@pytest.mark.slow
@pytest.mark.parametrize(("teeth", "told", "both"), [
    (15, 16, False), (16, 15, True), (20, 21, False), (32, 30, True), (20, 19, False), (44, 45, False),
])  # fmt: skip
def test_teeth_that_are_told_off_by_one_are_told_as_such(teeth, told, both):
    """Where a usual sampling rate fits as well (12 kHz told as 12.8 is 15 of 16) both are offered."""
    t = np.arange(round(4 * RATE)) / RATE
    mesh = 2 * np.pi * teeth * SHAFT * t
    x = (1 + 0.2 * np.cos(2 * np.pi * SHAFT * t)) * np.cos(mesh) + 0.4 * np.cos(2 * mesh) + 0.2 * np.cos(3 * mesh)
    x += 0.02 * np.random.default_rng(seed(8)).standard_normal(t.size)
    said = " ".join(analyse(x, told, rate=RATE, speed="1500 rpm").notes)
    assert re.search(rf"wheel (of|has) {teeth} teeth, (told as|not) {told}", said), said
    assert ("sampling rate of" in said) == both
    assert "wheel" not in " ".join(analyse(x, teeth, rate=RATE, speed="1500 rpm").notes)
    # a speed that is off by other shares is no matter of teeth
    other = " ".join(analyse(x, teeth, rate=RATE, speed="1350 rpm").notes)
    assert "CHECK THE SPEED" in other
    assert "wheel of" not in other


@pytest.mark.slow
@pytest.mark.parametrize(("off", "words"), [(2.0, "1500"), (0.5, "1500"), (0.95, "1500.0"), (1.01, "-0.99 %")])
def test_a_speed_column_or_tacho_that_the_mesh_line_contradicts_is_remarked(off, words):
    """Off by a factor or a few per cent; the true ones are taken without a remark."""
    turn = np.arange(round(6 * RATE)) / RATE * SHAFT
    column, pulses = np.full(turn.size, 60.0 * SHAFT), 1.0 * (turn % 1.0 < 0.1)
    noise = 0.3 * np.random.default_rng(seed(2)).standard_normal(turn.size)
    record = pd.DataFrame({"a [g]": pair(), "n [rpm]": column + noise, "tacho [V]": pulses})
    assert checks(analyse(record, 32, rate=RATE)) == []
    assert checks(analyse(record, 32, rate=RATE, tacho="tacho")) == []
    wrong = record.assign(**{"n [rpm]": off * record["n [rpm]"]})
    said = [analyse(wrong, 32, rate=RATE)]
    if off in (0.5, 2.0):
        said.append(analyse(record, 32, rate=RATE, tacho="tacho", pulses_per_rev=1.0 / off))
    for report in said:
        assert any("CHECK THE SPEED" in note and words in note for note in checks(report)), report.notes


@pytest.mark.parametrize("sidebands", [0.0, 0.3])
@pytest.mark.parametrize("second", [0.0, 0.2])
@pytest.mark.slow
def test_half_the_speed_is_remarked_where_it_scores_nearly_as_well(sidebands, second):
    """400 Hz and its second harmonic are every second line of 200 Hz; lines at 200 and 600 Hz make that right."""
    t = np.arange(4 * 12800) / 12800
    x = (1 + sidebands * np.cos(2 * np.pi * 20 * t)) * np.sin(2 * np.pi * 400 * t) + second * np.sin(
        2 * np.pi * 800 * t
    )
    x += 0.05 * np.random.default_rng(0).standard_normal(t.size)
    said = checks(analyse(x, 20, rate=12800, speed="600 rpm"))
    assert len(said) == 1
    assert "2.000 times the given speed" in said[0]
    assert checks(analyse(x, 20, rate=12800, speed="1200 rpm")) == []
    x += 0.3 * np.sin(2 * np.pi * 200 * t) + 0.3 * np.sin(2 * np.pi * 600 * t)
    assert checks(analyse(x, 20, rate=12800, speed="600 rpm")) == []


@pytest.mark.slow
def test_rates_and_speeds_that_no_machine_has_are_remarked():
    said = checks(analyse(pair(), 32, rate=10 * RATE))
    assert any("15000" in note and "sampling rate" in note for note in said)
    assert any("CHECK THE RATE" in note for note in checks(analyse(np.random.default_rng(0).random(500), rate=30.0)))
    assert any("check its unit" in note for note in checks(analyse(machine(), speed="0.5 rpm")))


@pytest.mark.slow
def test_states_as_arrays_and_loads_left_out():
    report = compare({"healthy": pair(), "worn": 2 * pair()}, rate="12.8 kHz", teeth=32, units="m/s^2")
    assert float(report.changes().sel(state="worn").mean()) == pytest.approx(20 * math.log10(2), abs=0.01)
    with pytest.raises(SignalError, match="by state"):
        compare({"healthy": pair(), "low": {"worn": pair()}}, rate=RATE, teeth=32)
    with pytest.raises(TypeError, match=says("'speeed'")):
        analyse(pair(), 32, rate=RATE, speeed=1)


@pytest.mark.parametrize("off", [0.0, 0.005, 0.02, -0.02])
def test_a_line_of_the_shaft_is_found_at_the_told_speed_and_at_the_ends_of_the_reach(off):
    """A line alone has the same height beside it: that its place is the first of several is no reason to lose it."""
    t = np.arange(2 * 12800) / 12800.0
    for k in range(3):
        noise = np.random.default_rng(seed(k)).standard_normal(t.size)
        x = 0.5 * np.cos(2 * np.pi * 25.0 * t) + 0.1 * noise
        found = refined_speed(make_signal(x, 12800.0), 2 * np.pi * 25.0 * (1.0 + off))
        assert found is not None
        assert found[0] == pytest.approx(2 * np.pi * 25.0, rel=1e-3)
        assert found[1] == [1]
        assert refined_speed(make_signal(noise, 12800.0), 2 * np.pi * 25.0) is None
    assert refined_speed(make_signal(x, 12800.0), 2 * np.pi * 25.0 * 1.05) is None
