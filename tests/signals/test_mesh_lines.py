"""The mesh line of made-up records without a speed: found, or doubted aloud."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from gearmbs.signals import SignalError, analyse, estimate_speed, make_signal
from gearmbs.signals.rotation.speed import followed_comb
from tests.says import says

RATE = 12800.0


def record(seed: int):
    """A record, its tooth count, right mesh frequencies, and whether it is fair: two harmonics or a sideband are clear.

    Right is also what all clear harmonics are multiples of: 2 and 4 alone are a first and a second one.
    """
    rng = np.random.default_rng(seed)
    teeth = int(rng.integers(15, 61))
    shaft = rng.uniform(5.0, min(60.0, 0.24 * RATE / teeth))
    gmf, seconds = teeth * shaft, rng.uniform(1.0, 4.0)
    t = np.arange(round(seconds * RATE)) / RATE
    sizes = rng.uniform(0.2, 1.0, min(int(rng.integers(1, 5)), int(0.45 * RATE / gmf)))
    if sizes.size > 1 and rng.random() < 0.25:
        sizes[0] = 0.0
    depth = rng.uniform(0.2, 0.8) if rng.random() < 0.6 else 0.0
    x = sum(a * np.cos(math.tau * k * gmf * t + rng.uniform(0.0, 6.0)) for k, a in enumerate(sizes, 1))
    x = x * (1.0 + depth * np.cos(math.tau * shaft * t + rng.uniform(0.0, 6.0)))
    noise = 10.0 ** rng.uniform(-2.0, -0.3)
    for _ in range(int(rng.integers(0, 4)) if rng.random() < 0.5 else 0):
        foreign = rng.uniform(20.0, 0.45 * RATE)
        x = x + rng.uniform(0.05, 1.0) * sizes.max() * np.cos(math.tau * foreign * t + rng.uniform(0.0, 6.0))
    x = x + noise * rng.standard_normal(t.size)
    # a line of 15 dB over that of the noise behind a Hann window
    clear = 10.0 ** (15.0 / 20.0) * noise * math.sqrt(2.0 * 1.5 * 2.0 / (min(seconds, 2.0) * RATE))
    fair = int((sizes > clear).sum()) >= 2 or sizes[0] * min(1.0, 0.5 * depth) > clear
    common = math.gcd(*(np.flatnonzero(sizes > clear) + 1).tolist())
    return make_signal(x, RATE), teeth, (gmf, common * gmf), fair


@pytest.mark.slow
def test_wrong_mesh_lines_are_doubted():
    fair = right = 0
    for seed in range(80):
        signal, teeth, gmfs, is_fair = record(seed)
        try:
            found = followed_comb(signal, teeth, None)
        except SignalError:
            continue
        finally:
            fair += is_fair
        is_right = any(abs(found.gmf - gmf) < 2e-3 * gmf for gmf in gmfs)
        assert is_right or re.search(says("CHECK THE SPEED", "Give the speed"), found.doubt), seed
        right += is_fair and is_right and not found.doubt
    assert fair >= 60
    # 89 % of six hundred others
    assert right >= 0.8 * fair


def _two_lines(seed: int) -> np.ndarray:
    """460 Hz, its second harmonic and one sideband of 23 teeth in noise, over two seconds."""
    t = np.arange(25600) / RATE
    lines = sum(a * np.sin(math.tau * f * t) for a, f in ((1.0, 460.0), (0.4, 920.0), (0.2, 480.0)))
    return lines + 0.1 * np.random.default_rng(seed).standard_normal(t.size)


@pytest.mark.parametrize("seed", [0, 3, 22])
def test_half_the_mesh_frequency_has_no_line_of_its_own(seed):
    """Seeds for which the comb of 229 Hz is the highest by chance."""
    report = analyse(_two_lines(seed), 23, rate=RATE)
    assert report.gmf == pytest.approx(460.0, abs=0.1)
    assert not any("CHECK" in note for note in report.notes)


def test_a_missing_fundamental_is_found_by_the_others():
    t = np.arange(25600) / RATE
    x = sum(np.sin(math.tau * k * 410.0 * t + k) for k in (2, 3, 4))
    found = estimate_speed(make_signal(x + 0.1 * np.random.default_rng(1).standard_normal(t.size), RATE), 20)
    assert found.gmf == pytest.approx(410.0, abs=0.05)
    assert found.spread < 0.1


def test_two_mesh_lines_alike_are_both_named():
    t = np.arange(25600) / RATE
    x = sum(np.sin(math.tau * k * f * t + k) for f in (410.0, 637.0) for k in (1, 2, 3))
    signal = make_signal(x + 0.1 * np.random.default_rng(1).standard_normal(t.size), RATE)
    report = analyse(signal, 20)
    said = [note for note in report.notes if note.startswith("CHECK")]
    assert len(said) == 1
    assert re.search(says("CHECK THE SPEED", "410.00", "637.00", "1230.0 rpm", "Give", "tacho"), said[0])
    with pytest.warns(UserWarning, match=says("410.00", "637.00", "Give")):
        estimate_speed(signal, 20)


def test_one_line_alone_is_doubted():
    t = np.arange(25600) / RATE
    signal = make_signal(np.sin(math.tau * 800.0 * t) + 0.1 * np.random.default_rng(1).standard_normal(t.size), RATE)
    assert re.search(says("CHECK", "800.00 Hz", "one line", "Give"), " ".join(analyse(signal, 20).notes))
    assert not any("CHECK" in note for note in analyse(signal, 20, speed="2400 rpm").notes)


@pytest.mark.parametrize("rate", [2560.0, 4000.0])
@pytest.mark.parametrize("sway", [0.0, 2.0])
def test_one_line_alone_is_the_first_harmonic_whatever_the_rate(rate, sway):
    """At 2560 Hz its double would lie beyond half the rate, and it had been taken for the double of half of it."""
    t = np.arange(round(4 * rate)) / rate
    x = 3.0 * np.cos(math.tau * 725.0 * t + sway * np.sin(math.tau * 0.3 * t))
    signal = make_signal(x + 0.3 * np.random.default_rng(1).standard_normal(t.size), rate)
    found = followed_comb(signal, 29, None)
    assert found.gmf == pytest.approx(725.0, rel=1e-3)
    assert "one line alone" in found.doubt
    beside = make_signal(signal.values[:, 0] + np.cos(math.tau * 362.5 * t), rate)
    assert followed_comb(beside, 29, None).gmf == pytest.approx(362.5, rel=1e-3)


@pytest.mark.parametrize("teeth", [29, 43])
@pytest.mark.parametrize("off", [0.0, -0.015, 0.03, -0.03])
def test_a_sideband_within_the_tolerance_is_no_mesh_line(teeth, off):
    """Told 3 % off, the first sideband lies where the mesh line should."""
    t, turns = np.arange(3 * 12800) / 12800.0, 16.3
    mesh = sum(a * np.cos(2 * np.pi * k * teeth * turns * t + k) for k, a in enumerate((1.0, 0.6, 0.3), 1))
    values = (1.0 + 0.1 * np.cos(2 * np.pi * turns * t)) * mesh
    values += 0.05 * np.random.default_rng(1).standard_normal(t.size)
    report = analyse(values, teeth, rate=12800, speed=2 * np.pi * turns * (1.0 + off))
    told = any(note.startswith("CHECK THE SPEED") for note in report.notes)
    assert told == (abs(off) > 0.02)
    assert told or report.speed == pytest.approx(2 * np.pi * turns, rel=1e-3)


@pytest.mark.slow
def test_hum_is_doubted_as_a_mesh_line():
    t = np.arange(3 * 12800) / 12800.0
    noise = 0.1 * np.random.default_rng(2).standard_normal(t.size)
    hum = sum(np.cos(2 * np.pi * 50.0 * k * t) / k for k in range(1, 15))
    report = analyse(hum + noise, 29, rate=12800)
    assert any("of the mains" in note for note in report.notes)
    # a mesh at 450 Hz alone is none
    mesh = sum(np.cos(2 * np.pi * 450.0 * k * t) / k for k in range(1, 4))
    assert not any("mains" in note for note in analyse(mesh + noise, 29, rate=12800).notes)


OF_A_RING = {83: 0.5, 84: 0.1, 85: 1.0, 86: 0.3, 168: 0.4, 170: 0.5}
OF_A_PAIR = {82: 0.1, 83: 0.3, 84: 1.0, 85: 0.4, 86: 0.2, 168: 0.5}


@pytest.mark.parametrize(("orders", "off", "right", "words"), [
    (OF_A_RING, 0.0, True, says("1 turns", "sideband", "kept")),
    (OF_A_RING, 0.003, False, says("turns", "If it", "planetary=")),
    (OF_A_PAIR, 0.0, True, None),
    (OF_A_PAIR, 0.003, True, None),
    (OF_A_PAIR, 0.009, True, says("turns", "If it", "planetary=")),
])  # fmt: skip
def test_a_sideband_higher_than_the_mesh_line_moves_no_right_speed(orders, off, right, words):
    """Sidebands stand whole turns beside the mesh frequency, nearer than 2 % where there are more than 50 teeth."""
    rate, turn = 2000.0, 2.0
    t = np.arange(round(20.0 * rate)) / rate
    x = sum(a * np.sin(math.tau * turn * k * t + k) for k, a in orders.items())
    x = x + 0.3 * np.random.default_rng(1).standard_normal(t.size)
    found = analyse(make_signal(x, rate), teeth=84, speed=math.tau * turn * (1.0 + off))
    notes = " ".join(found.notes)
    assert (abs(found.speed / (math.tau * turn) - 1.0) < 2e-4) == right
    assert "turns of the shaft" not in notes if words is None else re.search(words, notes)


@pytest.mark.parametrize("beside", ["constant", "drift", "noise", "hum"])
def test_channels_without_the_mesh_line_do_not_hide_it(beside):
    """A line 20 dB above all else in one channel; the other holds a setting, a dead sensor, or something else."""
    t = np.arange(25600) / RATE
    rng = np.random.default_rng(0)
    acc = np.cos(math.tau * 725.0 * t) + 0.1 * rng.standard_normal(t.size)
    other = {
        "constant": np.full(t.size, 3.0), "drift": 10.0 + t, "noise": rng.standard_normal(t.size),
        "hum": 12.0 + 0.1 * np.sin(math.tau * 50.0 * t),
    }[beside]  # fmt: skip
    alone = estimate_speed(make_signal({"acc": acc}, RATE, teeth=29))
    found = estimate_speed(make_signal({"acc": acc, "x": other}, RATE, teeth=29))
    assert found.gmf == pytest.approx(alone.gmf, rel=1e-4)


def test_lines_that_stand_in_one_channel_each_are_doubted_and_none_in_any_names_them():
    t = np.arange(25600) / RATE
    rng = np.random.default_rng(0)
    columns = {n: np.cos(math.tau * f * t) + 0.1 * rng.standard_normal(t.size) for n, f in (("a", 725.0), ("b", 941.0))}
    assert re.search(says("CHECK THE SPEED", "'a'", "'b'"), estimate_speed(make_signal(columns, RATE, teeth=29)).doubt)
    noise = {n: rng.standard_normal(t.size) for n in "ab"}
    with pytest.raises(SignalError, match=says("'a'", "'b'", "give the speed")):
        estimate_speed(make_signal(noise, RATE, teeth=29))
