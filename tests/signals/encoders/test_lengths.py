"""How long records must be: the formula against chance and its inverse, what a result says; records as one meeting."""

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy import stats

from gearmbs.signals import EncoderPair, SignalError, encoder, transmission_error_from_pulses
from gearmbs.signals.encoders import meetings
from gearmbs.signals.encoders.orders import Window
from tests.generators import seed
from tests.says import says
from tests.signals.encoders.bench import Discs, coupled, free

KNOWN = {"base_radius": "40 mm", "speed": "1500 rpm", "lines": 1024, "jitter": "50 ns", "clock": "50 ns"}


def lag(amplitudes, teeth):
    return lambda turned: sum(a * np.cos(math.tau * (k + 1) * teeth * turned) for k, a in enumerate(amplitudes))


@pytest.mark.slow
@pytest.mark.parametrize("teeth", [(29, 29), (21, 34)])
def test_lines_scatter_as_the_formula_says(teeth):
    exact, turns, draws, lines, speed = np.array([2e-6, 1e-6, 5e-7]), 30.0, 20, 256, 100.0
    seconds = turns * math.tau / speed
    angles = coupled(lag(exact, teeth[0]), teeth, 0.04, turns, speed, rate=20e3)
    ratio, off, told = teeth[1] / teeth[0], [], []
    for k in range(draws):
        discs = Discs(lines, seed=seed(21) + k)
        # at the driver's speed the driven shaft runs longer by the ratio for what its own speed would give
        alone = {
            name: discs.pulses(s, free(speed, 0.0, seconds * (ratio if s else 1.0)), 1)
            for s, name in enumerate(("driver", "driven"))
        }
        mesh = transmission_error_from_pulses(discs.run(angles), teeth, base_radius=0.04, free=alone).harmonics()[:3]
        off.append(mesh["amplitude"] - exact)
        told.append((mesh["high"] - mesh["low"]) / 2 / stats.norm.ppf(0.975))
    expected = EncoderPair(0.04, speed, lines, "50 ns", "50 ns", ratio).uncertainty(seconds)
    assert 0.97 * expected < np.mean(told) < 1.06 * expected
    # of 60 amplitudes, 4 standard deviations of their RMS
    assert abs(np.sqrt(np.mean(np.square(off))) / expected - 1.0) < 4 / math.sqrt(120)


@pytest.mark.parametrize("ratio", [0.4, 1.0, 34 / 21])
@pytest.mark.parametrize("share", [1.0, 0.3])
def test_the_length_that_a_line_needs_resolves_it(ratio, share):
    pair = EncoderPair(**KNOWN, ratio=ratio, free=share)
    for amplitude in (2.5e-8, 1e-6):
        need = pair.needs(amplitude, accuracy=0.02)
        assert pair.resolves(need.seconds, accuracy=0.02) == pytest.approx(amplitude, rel=1e-6)
        assert need.turns == pytest.approx(need.seconds * 25.0)
        assert need.free_seconds == pytest.approx(share * need.seconds)
    # of long records four times as long is half as much, and half the speed in half the time
    assert pair.uncertainty(4000.0) == pytest.approx(0.5 * pair.uncertainty(1000.0), rel=2e-3)
    slow = EncoderPair(**{**KNOWN, "speed": "750 rpm"}, ratio=ratio, free=share)
    assert slow.uncertainty(1000.0) == pytest.approx(pair.uncertainty(2000.0), rel=2e-3)


def test_the_length_needed_is_that_of_the_bound():
    """All pulses count: 1024 lines, 50 ns of jitter and clock, as the page of the theory has the formula."""
    edge = math.hypot(50e-9, 50e-9 / math.sqrt(12.0))
    turns = EncoderPair(**KNOWN).needs("0.06 um").turns
    wanted = 0.02 * 0.06e-6 / stats.norm.ppf(0.975)
    assert turns == pytest.approx(4 * 2 / 1024 * (0.04 * 50 * math.pi * edge / wanted) ** 2, rel=0.02)


def test_unknown_marks_leave_what_no_length_takes_away():
    loose = EncoderPair(**KNOWN, free=0, mark_error=0.01)
    one = 0.01 * math.tau / 1024
    assert loose.floor() == pytest.approx(0.04 * math.sqrt(2 * 2 * one**2 / 1024))
    assert loose.uncertainty(1e6) == pytest.approx(loose.floor(), rel=1e-4)
    assert math.isinf(loose.needs("1 um").seconds)
    assert loose.needs("40 um", accuracy=0.1).seconds < 60.0
    assert EncoderPair(**KNOWN, mark_error=0.01).floor() == 0.0
    # nothing but the ends of a record, of pulses without any error
    assert EncoderPair(0.04, 100.0, 1024).needs(1e-9).turns == pytest.approx(5.0)
    assert math.isinf(EncoderPair(**KNOWN).uncertainty(0.1))


@pytest.mark.parametrize(("wrong", "words"), [
    ({"free": 0}, ("mark_error", "free=1")), ({"speed": 0.0}, ("speed", "positive", "0")),
    ({"lines": 0}, ("lines", "positive", "0")), ({"jitter": "-1 ns"}, ("jitter", "zero or more")),
    ({"ratio": -1.0}, ("ratio", "positive", "-1")), ({"mark_error": -0.01}, ("mark_error", "-0.01")),
])  # fmt: skip
def test_pairs_of_encoders_that_cannot_be_are_refused(wrong, words):
    with pytest.raises(SignalError, match=says(*words)):
        EncoderPair(**{**KNOWN, **wrong})
    pair = EncoderPair(**{**KNOWN, "lines": (1024, 500)})
    for call, name in (
        (lambda: pair.needs(0.0), "amplitude"), (lambda: pair.needs(1e-6, accuracy=2.0), "accuracy"),
        (lambda: pair.resolves(9.0, probability=1.0), "probability"),
    ):  # fmt: skip
        with pytest.raises(SignalError, match=says(name)):
            call()


@pytest.mark.slow
def test_a_result_says_how_long_the_lines_take_that_are_not_known():
    """A record as much longer as it says knows the line."""
    exact, seconds = np.array([3e-6, 5e-7]), 12 * math.tau / 100.0

    def found(times, accuracy=0.02):
        angles = coupled(lag(exact, 29), (29, 29), 0.04, 12 * times, rate=15e3)
        discs = Discs(128, seed=seed(22))
        return transmission_error_from_pulses(
            discs.run(angles), (29, 29), base_radius=0.04, free=discs.free(seconds=0.75 * times), accuracy=accuracy
        )

    short = found(1)
    table = short.record_lengths().set_index("harmonic")
    assert table["known"].tolist() == [True, False]
    assert table["seconds"][1] == pytest.approx(seconds, rel=0.02)
    times = table["times"][2]
    assert 3.0 < times < 60.0
    assert table["free_driver"][2] == pytest.approx(0.75 * times, rel=0.02)
    assert "Known to 2 %: 1. Harmonic 2 (to" in short.to_markdown()
    longer = found(round(1.6 * times)).record_lengths().set_index("harmonic")
    assert longer["known"].tolist() == [True, True]
    assert short.record_lengths(accuracy=0.5)["known"].all()
    with pytest.raises(SignalError, match=says("accuracy", "2")):
        short.record_lengths(accuracy=2)
    with pytest.raises(SignalError, match=says("accuracy", "0")):
        found(1, accuracy=0)


@pytest.mark.slow
def test_of_unknown_marks_no_length_is_enough():
    angles = coupled(lag([9e-6], 29), (29, 29), 0.04, 12, rate=15e3)
    found = transmission_error_from_pulses(Discs(128).run(angles), (29, 29), base_radius=0.04)
    assert np.isinf(found.record_lengths()["times"][0])
    assert "No length is enough for 1: the marks are unknown" in found.to_markdown()


@pytest.mark.slow
@pytest.mark.parametrize("teeth", [(29, 29), (7, 10)])
def test_a_long_record_is_the_mean_of_its_meetings(teeth, monkeypatch):
    """The same lines and variances as turn by turn, one mark missing, another lost now and then."""
    exact = [3e-6, 5e-7]
    ratio = teeth[1] / teeth[0]
    curve = lag(exact, teeth[0])
    angles = coupled(
        lambda turned: curve(turned) + 2e-6 * np.cos(math.tau * turned) + 1e-6 * np.sin(2 * math.tau * turned / ratio),
        teeth, 0.04, 160, rate=8e3,
    )  # fmt: skip
    discs = Discs(100, seed=seed(23))
    run, alone = discs.run(angles), discs.free(seconds=9.0)
    lost = range(500, 15000, 371)
    run = type(run)(
        encoder(angles[0], 100, marks=discs.marks[0], lacking=[0], lost=lost, jitter="50 ns", seed=5), run.driven
    )
    long = transmission_error_from_pulses(run, teeth, base_radius=0.04, free=alone)
    monkeypatch.setattr(meetings, "MOST_SCATTER", 10**6)
    plain = transmission_error_from_pulses(run, teeth, base_radius=0.04, free=alone)
    for one, other in ((long.harmonics(), plain.harmonics()), (long.shaft_orders(), plain.shaft_orders())):
        width = np.mean(other["high"] - other["low"])
        assert np.abs(one["amplitude"] - other["amplitude"]).max() < 0.1 * width
        assert np.mean(one["high"] - one["low"]) == pytest.approx(width, rel=0.04)


def test_only_records_of_many_meetings_are_averaged():
    for turns, period, whole in ((140.0, 1, True), (100.0, 1, False), (136.0, 34, True), (136.0, 68, False)):
        assert meetings.averaged(Window(0.0, turns, 4.0), Fraction(period)) == whole
