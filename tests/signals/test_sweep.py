"""Run-ups for which one speed is told are told to be run-ups; steady records are not."""

import numpy as np
import pytest

from gearmbs.signals import analyse, diagnose_bearing, make_signal
from gearmbs.signals.rotation.sweep import moving_lines

RATE, SECONDS = 12800.0, 5.0
PART = np.arange(int(RATE * SECONDS)) / (RATE * SECONDS)


def record(rpm, teeth=29, seed=0):
    """A mesh with a sideband and the first orders of a shaft, in noise; the speed over the part of the record."""
    turned = 2 * np.pi * np.cumsum(np.broadcast_to(rpm, PART.shape)) / 60.0 / RATE
    mesh = (1 + 0.3 * np.cos(turned)) * np.cos(teeth * turned) + 0.5 * np.cos(2 * teeth * turned)
    noise = 0.3 * np.random.default_rng(seed).standard_normal(PART.size)
    return make_signal(mesh + 0.3 * np.cos(turned) + 0.2 * np.cos(2 * turned) + noise, RATE, units="m/s^2")


@pytest.mark.parametrize(("rpm", "way"), [
    (900 + 1500 * PART, "up"), (2400 * np.exp(-PART), "down"), (1500 + 60 * PART, "up"),
    (900 + 1500 * np.clip(5 * PART - 4, 0, 1), "up"),
])  # fmt: skip
def test_lines_that_move_are_seen(rpm, way):
    assert moving_lines(record(rpm)) == way


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("rpm", [1650.0, 1650 * (1 + 0.005 * np.cos(11 * PART))])
@pytest.mark.slow
def test_steady_lines_do_not_move(rpm, seed):
    """Nor lines that grow, nor knocks that ring down, nor noise."""
    steady = record(rpm, seed=seed)
    grown = make_signal(steady.values[:, 0] * (0.2 + 2 * PART), RATE)
    at = RATE * SECONDS * PART % 17000
    knocks = np.exp(-at / 900) * np.sin(0.3 * at) + 0.05 * np.random.default_rng(seed).standard_normal(at.size)
    assert [moving_lines(one) for one in (steady, grown, make_signal(knocks, RATE))] == [None] * 3
    assert moving_lines(make_signal(knocks[:4000], RATE)) is None


@pytest.mark.parametrize("teeth", [None, 29])
@pytest.mark.slow
def test_a_run_up_with_one_speed_is_told(teeth):
    said = analyse(record(1500 + 300 * PART), teeth, speed="1650 rpm").notes
    assert any(note.startswith("CHECK THE SPEED: lines of the record move up") for note in said)
    steady = analyse(record(1650.0), teeth, speed="1650 rpm").notes
    followed = analyse(record(1500 + 300 * PART), teeth, speed=[(0, "1500 rpm"), (SECONDS, "1800 rpm")]).notes
    assert not any("move" in note for note in (*steady, *followed))


@pytest.mark.parametrize(("wobble", "rate"), [(0.01, 1), (0.01, 2), (0.02, 1), (0.004, 1), (0.0, 1)])
@pytest.mark.slow
def test_a_speed_that_wobbles_by_more_than_is_followed_is_told(wobble, rate):
    """A wobble of 0.15 / 29 is followed; one that is not takes a part of the mesh out of the average."""
    seen = record(1500 * (1 + wobble * np.sin(2 * np.pi * rate * SECONDS * PART)))
    report = analyse(seen, 29, speed="1500 rpm")
    told = any("wobbles" in note for note in report.notes)
    assert told == (wobble > 0.15 / 29)
    # the mesh with its sideband and second harmonic, and the orders: 0.86
    assert (float(report.average.std()) > 0.8) != told


@pytest.mark.parametrize("share", [1.0, 1.02, 0.9, 2.0])
@pytest.mark.slow
def test_a_run_up_whose_mesh_is_elsewhere_is_told(share):
    curve = [(0.0, f"{900 * share} rpm"), (SECONDS, f"{2400 * share} rpm")]
    report = analyse(record(900 + 1500 * PART), 29, speed=curve)
    assert any(note.startswith("CHECK THE SPEED") for note in report.notes) == (share != 1.0)
    assert (report.harmonics["orders"].values[0, 0] > 0.69) == (share == 1.0)


@pytest.mark.slow
def test_a_run_up_with_one_speed_acquits_no_bearing():
    doubted = diagnose_bearing(record(900 + 1500 * PART), "6205", "1650 rpm")
    assert doubted.verdict.startswith("No part of bearing 6205 is named for certain")
    assert "CHECK THE SPEED" in doubted.verdict
    steady = diagnose_bearing(record(1650.0), "6205", "1650 rpm")
    assert "CHECK THE SPEED" not in steady.verdict


@pytest.mark.parametrize("teeth", [None, 29])
@pytest.mark.parametrize(("told", "true"), [(44100.0, "48000 Hz"), (51200.0, "48000 Hz"), (48000.0, None)])
@pytest.mark.slow
def test_mixed_up_rates_are_told_by_a_told_speed(told, true, teeth):
    steady = record(1650.0)
    shaft = sum(0.2 * np.cos(2 * np.pi * 27.5 * k * RATE * SECONDS * PART / RATE + k) for k in (1, 3, 4, 5))
    wrong = make_signal(steady.values[:, 0] + shaft, RATE * told / 48000.0, units="m/s^2")
    said = " ".join(analyse(wrong, teeth, speed="1650 rpm").notes)
    # no clock has the rate that a speed told 8 % low would need
    assert "told as" not in " ".join(analyse(steady, teeth, speed=f"{1650 * 44.1 / 48} rpm").notes)
    if true is None:
        assert "CHECK" not in said
    else:
        assert "CHECK THE SPEED" in said
        assert f"{RATE:g} Hz, told as {wrong.attrs['sampling_rate']:g} Hz" in said
