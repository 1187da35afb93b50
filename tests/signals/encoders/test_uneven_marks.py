"""Wheels with uneven marks: pulses missing or noted twice are told by the turns beside, and mended."""

from __future__ import annotations

import re

import numpy as np
import pytest

from gearmbs.signals import make_signal, phase_from_tacho, pulse_train, torsional_vibration
from gearmbs.signals.rotation.phase import pulse_faults
from gearmbs.signals.rotation.uneven_marks import uneven_faults
from tests.says import says

SPEED = 2 * np.pi * 25


def passed(lines, errors, turns=40, swing=0.0, rise=0.0, jitter=0.0, seed=0):
    """Return times and numbers of pulses; the angle is w t + rise t^2/2 - swing sin(2 w t)."""
    n = np.arange(3, lines * turns)
    angle = 2 * np.pi * n / lines + errors[n % lines]
    t = angle / SPEED
    for _ in range(40):
        speed = SPEED + rise * t - 2 * swing * SPEED * np.cos(2 * SPEED * t)
        t = t - (SPEED * t + 0.5 * rise * t * t - swing * np.sin(2 * SPEED * t) - angle) / speed
    return np.sort(t + jitter * np.random.default_rng(seed).standard_normal(t.size)), n


def uneven(lines, amount, seed=1):
    return np.random.default_rng(seed).uniform(-amount, amount, lines) * 2 * np.pi / lines


@pytest.mark.parametrize("amount", [0.05, 0.1, 0.2, 0.3])
@pytest.mark.parametrize("lines", [5, 8, 24, 60, 360])
@pytest.mark.parametrize("what", ["lost", "doubled", "none"])
def test_one_pulse_is_mended_and_told(lines, amount, what):
    """In the middle, near the beginning and near the end; all numbers are right but for those that nobody knows."""
    times, n = passed(lines, uneven(lines, amount), jitter=1e-7)
    for at in (lines // 2 + 1, 20 * lines + lines // 3, n.size - lines // 2 - 2):
        seen, numbers = times, n
        if what == "lost":
            seen, numbers = np.delete(times, at), np.delete(n, at)
        elif what == "doubled":
            seen = np.sort(np.append(times, times[at] + 0.2 * (times[at + 1] - times[at])))
        train = pulse_train(seen, lines)
        np.testing.assert_array_equal(train.numbers - train.numbers[0], numbers - numbers[0])
        assert len(train.notes) == (what != "none")
        if what != "none":
            assert re.search(says("1 pulse", {"lost": "missing", "doubled": "too many"}[what]), train.notes[0])


@pytest.mark.parametrize("known", [{"swing": 4e-3}, {"rise": 40.0}, {"rise": -40.0}, {"jitter": 5e-5}])
def test_speeds_that_vary_and_jitter(known):
    times, n = passed(8, uneven(8, 0.2), **known)
    lost = [100, 101, 250]
    train = pulse_train(np.delete(times, lost), 8)
    np.testing.assert_array_equal(train.numbers - train.numbers[0], np.delete(n, lost) - n[0])


@pytest.mark.parametrize("places", [[0, 0.35], [0, 0.45], [0, 0.2, 0.7], [0, 0.22, 0.55, 0.75]])
def test_a_few_reflectors(places):
    lines = len(places)
    errors = 2 * np.pi * (np.array(places) - np.arange(lines) / lines)
    times, n = passed(lines, errors, jitter=1e-6)
    for at in (10, 41, n.size - 9):
        train = pulse_train(np.delete(times, at), lines)
        np.testing.assert_array_equal(train.numbers - train.numbers[0], np.delete(n, at) - n[0])
        assert len(train.notes) == 1


def test_many_faults_in_one_record():
    rng = np.random.default_rng(5)
    times, n = passed(60, uneven(60, 0.2), turns=80, jitter=1e-7)
    lost = np.sort(rng.choice(np.arange(200, n.size - 200), 30, replace=False))
    train = pulse_train(np.delete(times, lost), 60)
    np.testing.assert_array_equal(train.numbers - train.numbers[0], np.delete(n, lost) - n[0])


def test_with_index_pulses_marks_keep_their_errors():
    """As a reader found it: nothing but the errors of marks was in the record, and half a radian came."""
    errors = uneven(8, 0.2)
    times, _ = passed(8, errors, turns=60)
    index = (2 * np.pi * np.arange(1, 60) - np.pi / 8) / SPEED
    train = pulse_train(np.delete(times, 204), 8, index=index)
    assert abs(torsional_vibration(train, errors)).max() < 1e-9


def test_a_sampled_tacho_with_uneven_reflectors():
    rate = 20000.0
    t = np.arange(round(5 * rate)) / rate
    turns = SPEED * t / (2 * np.pi)
    seen = np.zeros(t.size)
    for k, place in enumerate((0, 0.22, 0.55, 0.75)):
        seen[(np.abs(turns % 1 - place - 0.01) < 0.01) & ~((turns // 1 == 50) & (k == 2))] = 5.0
    signal = make_signal({"a": np.cos(29 * SPEED * t), "tacho": seen}, rate)
    phase = phase_from_tacho(signal, "tacho", pulses_per_rev=4)
    span = phase["time"].values[-1] - phase["time"].values[0]
    assert float(phase[-1] - phase[0]) == pytest.approx(SPEED * span, abs=0.2 * np.pi)
    assert any("missing" in note for note in phase.attrs["notes"])


@pytest.mark.parametrize("joint", [0.4, 1.0, 1.6, 2.5])
def test_even_wheels_are_told_from_uneven_ones(joint):
    """One joint of a tape, and a mark that the disc lacks, are no uneven wheel."""
    pitch = 2 * np.pi / (59 + joint)
    times, _ = passed(60, np.arange(60) * (pitch - 2 * np.pi / 60))
    assert uneven_faults(times, 60) is None
    assert pulse_faults(times, 60.0) == []
    lacking = np.delete(times, np.flatnonzero(np.arange(3, 3 + times.size) % 60 == 0))
    assert uneven_faults(lacking, 60) is None
