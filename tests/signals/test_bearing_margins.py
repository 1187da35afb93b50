"""Verdicts on bearings when the told speed is off, on sound bearings that move, and of several records together."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from gearmbs.bearings import Bearing, Spall
from gearmbs.signals import SignalError, bearing_lines, combine_bearings, convert, diagnose_bearing, make_signal
from gearmbs.signals.diagnosis.bearing_judgement import Evidence, Judged, chances_at, find_lines
from gearmbs.signals.diagnosis.bearing_margins import agreed, answers_at, own_level, verdicts_of
from gearmbs.signals.diagnosis.bearing_speed import ShaftSpeed, far_shaft, find_shaft
from gearmbs.signals.diagnosis.bearings import channel_spectrum
from gearmbs.studies import bearing_rig, housing_signal
from tests.says import says
from tests.signals.test_bearing_diagnosis import LINES, RATE, SHAFT, TIME, pulses, record

SIX203 = bearing_lines({"name": "6203", "FTF": 0.3817, "BSF": 1.9937, "BPFO": 3.053, "BPFI": 4.9469})
RUNNING = sum(0.05 * np.cos(2 * np.pi * k * SHAFT * TIME + k) for k in range(1, 13))
"""Twelve orders of the shaft, each 14 dB below noise of unit variance, as an unbalanced machine has them."""


def spectrum_of(*parts, noise=0.3):
    values = record(*parts, noise=noise).values[:, 0]
    return [channel_spectrum(values, RATE, SHAFT)]


def rpm(share):
    return f"{60.0 * SHAFT * (1.0 + share)} rpm"


@pytest.mark.parametrize("share", [-0.008, -0.005, 0.0, 0.002, 0.007])
def test_the_shafts_line_is_found_near_a_told_speed(share):
    mains = sum(2.0 * np.cos(2 * np.pi * k * 1.003 * SHAFT * TIME) for k in (2, 4, 8))
    found = find_shaft(spectrum_of(RUNNING, mains), SHAFT * (1.0 + share))
    assert found.found
    assert found.turns == pytest.approx(SHAFT, rel=2e-4)
    assert found.deviation == pytest.approx(1.0 / (1.0 + share) - 1.0, abs=2e-4)


@pytest.mark.parametrize(
    "parts",
    [
        (),
        (0.5 * np.cos(2 * np.pi * 2.0 * SHAFT * TIME),),
        (pulses(3.0 * SHAFT),),
        (RUNNING, sum(0.05 * np.cos(2 * np.pi * k * 1.004 * SHAFT * TIME) for k in range(1, 13))),
    ],
    ids=["noise", "one line", "every third", "two shafts"],
)
def test_no_shaft_is_found_where_none_or_two_are(parts):
    found = find_shaft(spectrum_of(*parts), SHAFT * 1.002)
    assert not found.found
    assert found.turns == found.told


def turning(turns, orders=12, amplitude=0.05):
    return sum(amplitude * np.cos(2 * np.pi * k * turns * TIME + k) for k in range(1, orders + 1))


@pytest.mark.parametrize("amplitude", [0.05, 1.0, 100.0])
@pytest.mark.parametrize("orders", [3, 5, 12])
def test_the_shafts_line_is_found_weak_or_strong(orders, amplitude):
    found = find_shaft(spectrum_of(turning(SHAFT, orders, amplitude)), SHAFT * 1.003)
    assert found.found
    assert found.turns == pytest.approx(SHAFT, abs=found.doubt)


@pytest.mark.parametrize(("turns", "others", "is_found"), [
    (49.5, (), True), (50.0, (), False), (49.5, (49.5 / 48.5,), False), (46.0, (), True),
])  # fmt: skip
def test_far_from_the_told_speed_neither_the_mains_nor_a_known_shaft_count(turns, others, is_found):
    found = far_shaft(spectrum_of(turning(turns)), 48.5, 0.005, others)
    assert found.found is is_found
    assert found.turns == pytest.approx(turns if is_found else 48.5, rel=2e-4)


@pytest.mark.parametrize("share", [-0.05, -0.03, 0.02, 0.05])
@pytest.mark.parametrize("part", ["outer race", "inner race"])
def test_where_the_shaft_turns_faster_or_slower_than_told_it_is_judged_there(part, share):
    order = LINES.orders[part]
    report = diagnose_bearing(record(pulses(order * SHAFT, 0.002), RUNNING), "6205", rpm(share), shafts=())
    assert report.fault == part
    assert report.shaft == pytest.approx(SHAFT, rel=2e-4)
    assert "CHECK THE SPEED" in report.verdict
    assert f"{60 * SHAFT * (1 + share):.1f} rpm" in report.verdict


@pytest.mark.parametrize("share", [-0.05, -0.03, 0.03, 0.05])
@pytest.mark.slow
def test_without_the_shafts_line_a_wrong_speed_acquits_nobody(share):
    report = diagnose_bearing(record(pulses(LINES.bpfo * SHAFT)), "6205", rpm(share), shafts=())
    assert report.fault is None
    (doubted,) = [finding for finding in report.findings if finding.grade == "shifted"]
    assert doubted.part == "outer race"
    assert doubted.slip == pytest.approx(1.0 / (1.0 + share) - 1.0, abs=1e-3)
    for words in ("CHECK THE SPEED", "Not certain", "slower" if share > 0.0 else "faster", "+-0.5 % of the told one"):
        assert words in report.verdict
    assert combine_bearings([report]).fault is None


@pytest.mark.parametrize("share", [-0.05, -0.03, 0.03, 0.05])
@pytest.mark.slow
def test_a_wrong_speed_acquits_no_cage(share):
    cage = record(3.0 * pulses(LINES.ftf * SHAFT))
    report = diagnose_bearing(cage, "6205", rpm(share), shafts=())
    assert report.fault is None
    (doubted,) = [finding for finding in report.findings if finding.grade == "shifted"]
    assert doubted.part == "cage"
    assert doubted.slip == pytest.approx(1.0 / (1.0 + share) - 1.0, abs=1e-3)
    assert "CHECK THE SPEED" in report.verdict
    # another shaft may turn as fast, where shafts are not known
    assert "CHECK THE SPEED" not in diagnose_bearing(cage, "6205", rpm(share)).verdict


@pytest.mark.parametrize("factor", [2.0, 0.5, 4.0, 0.25])
@pytest.mark.parametrize("part", ["outer race", "inner race", "rolling element"])
@pytest.mark.parametrize("running", [RUNNING, 0.0 * RUNNING], ids=["orders", "quiet"])
@pytest.mark.slow
def test_a_wrong_sampling_rate_acquits_nobody(part, factor, running):
    """Where another rate is told all lines stand elsewhere, those of the shaft and of the mesh, too."""
    heard = record(pulses(LINES.orders[part] * SHAFT, 0.002), running)
    told = make_signal(heard.values, factor * RATE, units="m/s^2")
    report = diagnose_bearing(told, "6205", rpm(0.0), shafts=())
    assert report.fault is None
    (doubted,) = [finding for finding in report.findings if finding.grade == "shifted"]
    assert doubted.part == part
    assert doubted.found / doubted.kinematic == pytest.approx(factor, rel=5e-3)
    for words in ("CHECK THE RATE", f"{doubted.found / doubted.kinematic:.3g} times", "Not certain"):
        assert words in report.verdict


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("parts", [(), (RUNNING,), (0.3 * np.cos(2 * np.pi * 36.0 * SHAFT * TIME),)])
@pytest.mark.slow
def test_a_right_rate_is_not_doubted(seed, parts):
    """Of a sound bearing, among noise, orders of the shaft, and a mesh; nor another, of which nothing tells then."""
    heard = record(*parts, seed=seed)
    for factor in (1.0, 2.0):
        told = make_signal(heard.values, factor * RATE, units="m/s^2")
        assert "CHECK THE RATE" not in diagnose_bearing(told, "6205", rpm(0.0), shafts=()).verdict


def test_looseness_near_a_shifted_cage_is_none():
    """All multiples of 2/5 of the turns, 2.6 % beside the cage of this bearing."""
    lines = bearing_lines({"name": "loose", "FTF": 0.41, "BSF": 2.3, "BPFO": 3.69, "BPFI": 5.31})
    step = record(3.0 * pulses(0.4 * SHAFT, jitter=0.0))
    report = diagnose_bearing(step, lines, rpm(0.0), shafts=())
    assert report.fault is None
    assert not [finding for finding in report.findings if finding.grade == "shifted"]


@pytest.mark.slow
def test_a_sound_record_is_acquitted_within_the_tolerance_unless_its_speed_is_found():
    sound = diagnose_bearing(record(), "6205", rpm(0.0), shafts=())
    assert "this holds for speeds of 1731.3 to 1748.7 rpm" in sound.verdict
    assert "CHECK" not in sound.verdict
    turning_too = diagnose_bearing(record(RUNNING), "6205", rpm(0.0), shafts=())
    exact = diagnose_bearing(record(), "6205", rpm(0.0), shafts=(), tolerance=0.0)
    assert not any("this holds for" in report.verdict for report in (turning_too, exact))


@pytest.mark.slow
def test_a_clear_part_stays_named_beside_another_machines_shaft():
    other = turning(1.03 * SHAFT)
    report = diagnose_bearing(record(pulses(LINES.bpfo * SHAFT), other), "6205", rpm(0.0), shafts=())
    assert report.fault == "outer race"
    assert "CHECK THE SPEED" in report.verdict
    apart = diagnose_bearing(record(pulses(LINES.bpfo * SHAFT), other), "6205", rpm(0.0), shafts=(1.03,))
    assert apart.fault == "outer race"
    assert "CHECK THE SPEED" not in apart.verdict


def test_many_families_at_once_have_the_chances_of_each():
    (spectrum,) = spectrum_of(pulses(LINES.bpfo * SHAFT))
    places = 10.0 * np.exp(0.05 * np.arange(140))
    one_by_one = [find_lines(spectrum, float(f), slip=0.015, harmonics=4).log_chance for f in places]
    np.testing.assert_allclose(chances_at(spectrum, places, slip=0.015, harmonics=4), one_by_one, rtol=1e-12)
    assert min(one_by_one) < -15.0
    assert places[-1] > spectrum.top


@pytest.mark.parametrize("share", [-0.005, -0.002, 0.0, 0.002, 0.005])
def test_an_answer_does_not_depend_on_the_told_speed(share):
    report = diagnose_bearing(record(pulses(LINES.bpfo * SHAFT, 0.002), RUNNING), "6205", rpm(share), shafts=())
    assert report.fault == "outer race"
    assert report.clear
    assert report.shaft == pytest.approx(SHAFT, rel=2e-4)
    assert report.accused[0].slip == pytest.approx(0.002, abs=5e-4)
    assert set(report.stability["part"]) == {"outer race"}
    assert "from a family of its orders" in report.to_markdown()
    assert "the answer is the same" in report.to_markdown()


@pytest.mark.parametrize("share", [-0.004, 0.0, 0.004])
def test_lines_in_step_with_the_shaft_name_no_part_at_any_told_speed(share):
    """All multiples of a fifth of the turns, 18/5 being 0.4 % from an outer race of 6205."""
    step = pulses(SHAFT / 5.0, jitter=0.0)
    report = diagnose_bearing(record(step, RUNNING, noise=0.1), "6205", rpm(share), shafts=())
    assert report.fault is None


@pytest.mark.parametrize("share", [-0.005, 0.0, 0.005])
@pytest.mark.slow
def test_the_jaws_of_a_coupling_are_no_outer_race(share):
    """Three jaws, or blades, lie 1.7 % from the outer race of a 6203, within its slip if the speed is off."""
    jaws = record(pulses(3.0 * SHAFT, jitter=0.0), RUNNING)
    report = diagnose_bearing(jaws, SIX203, rpm(share), shafts=())
    assert report.fault is None
    spalled = diagnose_bearing(record(pulses(SIX203.bpfo * SHAFT), RUNNING), SIX203, rpm(share), shafts=())
    assert spalled.fault == "outer race"


def test_blades_within_slip_of_a_race_are_told_as_what_they_are():
    near = bearing_lines({"name": "near", "FTF": 0.4, "BSF": 2.3, "BPFO": 3.03, "BPFI": 4.9})
    report = diagnose_bearing(record(pulses(3.0 * SHAFT, jitter=0.0), RUNNING), near, rpm(0.0), shafts=())
    assert report.fault is None
    assert any("3 times the shaft's turns" in remark and "blades" in remark for remark in report.remarks)


def verdict(**grades):
    """One channel: the parts of a 6205 with these grades, clearer the earlier they are given."""
    parts = ("outer race", "inner race", "rolling element", "cage")
    order = list(grades)
    return (
        tuple(
            Judged(LINES, part, Evidence(100.0, 100.0, (50.0,), -30.0 + order.index(key)), grades[key], 0, 90)
            if (key := part.split()[0]) in grades
            else Judged(LINES, part, Evidence(100.0, 100.0, (1.0,), 0.0), "none", 9, 90)
            for part in parts
        ),
    )


NOTHING, OUTER_CLEAR = verdict(), verdict(outer="clear")


@pytest.mark.parametrize(
    ("verdicts", "outer"),
    [
        ([OUTER_CLEAR] * 3, "clear"),
        ([NOTHING, OUTER_CLEAR, OUTER_CLEAR], "clear"),
        ([verdict(outer="signs"), OUTER_CLEAR, verdict(outer="signs")], "signs"),
        ([NOTHING, OUTER_CLEAR, NOTHING], "uncertain"),
        ([OUTER_CLEAR, NOTHING, NOTHING], "uncertain"),
        ([verdict(cage="signs"), OUTER_CLEAR, OUTER_CLEAR], "uncertain"),
        ([verdict(inner="clear", outer="clear"), OUTER_CLEAR, OUTER_CLEAR], "uncertain"),
        ([verdict(outer="clear", inner="clear")] * 3, "clear"),
        ([NOTHING] * 3, "none"),
    ],
)
def test_what_stands_at_several_speeds(verdicts, outer):
    assert agreed(verdicts)[0][0].grade == outer


def test_lines_in_step_at_one_speed_are_not_certain():
    ((own, *others),) = NOTHING
    in_step = ((replace(own, fraction=(18, 5), beside=True), *others),)
    (judged, *_), *_ = agreed([OUTER_CLEAR, OUTER_CLEAR, in_step])
    assert judged.grade == "uncertain"


def test_a_speed_that_was_found_is_judged_at_what_it_may_be_off():
    asked = []

    def judge_at(turns):
        asked.append(turns)
        yield OUTER_CLEAR[0] if turns >= SHAFT else NOTHING[0]

    found = ShaftSpeed(1.002 * SHAFT, SHAFT, -20.0, True, 0.004)
    answers = answers_at([found, replace(found, told=SHAFT), replace(found, told=0.99 * SHAFT)], judge_at, 3e-4)
    assert asked == pytest.approx([SHAFT - 0.004, SHAFT, SHAFT + 0.004])
    assert verdicts_of(answers)[0][0].grade == "clear"
    assert [answer.speed.told for answer in answers] == pytest.approx([1.002 * SHAFT, SHAFT, 0.99 * SHAFT])


@pytest.mark.slow
def test_quiet_lines_accuse_nothing_unless_asked_to():
    loud = record(pulses(LINES.bpfo * SHAFT, jitter=0.0), noise=1e-4)
    quiet = loud.copy(data=1e-3 * loud.values)
    assert diagnose_bearing(loud, "6205", rpm(0.0)).fault == "outer race"
    report = diagnose_bearing(quiet, "6205", rpm(0.0))
    assert report.fault is None
    assert "quiet" in report.verdict
    assert "stiffness that varies" in report.verdict
    assert report.tables()["bearing_evidence"]["modulated"].max() < 0.03
    assert diagnose_bearing(quiet, "6205", rpm(0.0), level=0.0).fault == "outer race"
    volts = diagnose_bearing(make_signal(quiet.values, RATE, channels=["case"], units="V"), "6205", rpm(0.0))
    assert volts.fault == "outer race"
    assert any(re.search(says("CHECK THE LEVEL", "'case'", "in V"), note) for note in volts.notes)


@pytest.mark.slow
@pytest.mark.parametrize("quantity", ["velocity", "displacement"])
def test_velocities_and_displacements_have_the_level_of_their_acceleration(quantity):
    """That of quiet lines does not accuse, that of loud ones does, also in the noise of an instrument."""
    loud = record(pulses(LINES.bpfo * SHAFT, jitter=0.0), noise=1e-4)
    before = diagnose_bearing(loud, "6205", rpm(0.0)).accused[0].modulated
    moved = convert(loud, quantity, band=(10.0, 0.45 * RATE))
    report = diagnose_bearing(moved, "6205", rpm(0.0))
    assert report.fault == "outer race"
    assert report.accused[0].modulated == pytest.approx(before, rel=0.1)
    assert not any("LEVEL" in note for note in report.notes)
    quiet = diagnose_bearing(moved.copy(data=1e-3 * moved.values), "6205", rpm(0.0))
    assert quiet.fault is None
    assert "quiet" in quiet.verdict
    noise = 1e-3 * moved.values.std() * np.random.default_rng(0).standard_normal(moved.shape)
    assert diagnose_bearing(moved.copy(data=moved.values + noise), "6205", rpm(0.0)).fault == "outer race"
    hidden = diagnose_bearing(moved.copy(data=1e-3 * (moved.values + noise)), "6205", rpm(0.0))
    assert hidden.fault is None


@pytest.mark.slow
def test_a_level_counts_carriers_far_above_the_line():
    """A modulated carrier of 1 m/s^2 amplitude: RMS 0.71, of which the depth of a full modulation counts."""
    wave = np.sqrt(2.0) * (1.0 + np.cos(2 * np.pi * LINES.bpfo * SHAFT * TIME)) * np.cos(2 * np.pi * 4000.0 * TIME)
    high = diagnose_bearing(record(wave, noise=0.01), "6205", rpm(0.0))
    assert high.accused[0].modulated == pytest.approx(np.sqrt(1.5), rel=0.1)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"tolerance": -0.1}, ("tolerance", "-0.1", "0.05")),
        ({"tolerance": 0.5}, ("tolerance", "0.5", "share")),
        ({"level": -1.0}, ("level", "-1.0", "m/s^2")),
    ],
)
def test_says_what_is_wrong_with_margins(settings, words):
    with pytest.raises(SignalError, match=says(*words)):
        diagnose_bearing(record(), "6205", rpm(0.0), **settings)


@pytest.mark.slow
def test_faint_lines_of_several_records_add_up():
    reports = {
        f"load {k}": diagnose_bearing(
            record(1.2 * pulses(LINES.bpfo * SHAFT, 0.004, seed=k), noise=1.0, seed=k), "6205", rpm(0.0), tolerance=0.0
        )
        for k in range(4)
    }
    together = combine_bearings(reports)
    assert together.fault == "outer race"
    assert together.table.loc[0, "slip_percent"] == pytest.approx(0.4, abs=0.1)
    assert sum(report.fault is None for report in reports.values()) == 2
    assert "heard in 3 of 4 records" in together.verdict
    assert "load 3" in together.to_markdown()


@pytest.mark.slow
def test_records_of_noise_name_nothing_together_and_bearings_must_be_the_same():
    noise = [diagnose_bearing(record(seed=k), "6205", rpm(0.0)) for k in range(3)]
    assert combine_bearings(noise).fault is None
    with pytest.raises(SignalError, match=says("reports", "none", "give")):
        combine_bearings([])
    other = diagnose_bearing(record(), SIX203, rpm(0.0))
    with pytest.raises(SignalError, match=says("record 2", "other bearings", "combine")):
        combine_bearings([noise[0], other])


@pytest.mark.slow
def test_a_record_is_one_witness():
    first, second = (diagnose_bearing(record(seed=k), "6205", rpm(0.0)) for k in range(2))
    with pytest.raises(SignalError, match=says("record 1", "record 3", "one witness")):
        combine_bearings([first, second, first])
    again = diagnose_bearing(record(seed=1), "6205", rpm(0.002))
    with pytest.raises(SignalError, match=says("'load'", "'again'", "once")):
        combine_bearings({"load": second, "again": again})
    assert combine_bearings([first, second]).verdict.endswith("by 2 records together.")
    assert combine_bearings([first]).verdict.endswith("by one record alone.")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("defect", "part"),
    [
        (None, None),
        (Spall(part="outer", width="0.3 mm"), "outer race"),
        (Spall(part="element", width="0.5 mm"), "ball"),
    ],
    ids=["sound", "outer", "ball"],
)
def test_a_simulated_bearing_without_noise(defect, part):
    """The stiffness of a sound one varies and is told as such; a ball's sidebands are no outer race."""
    from gearmbs.studies import bearing_rig, housing_signal

    bearing = Bearing.from_designation("6205/CN")
    rig = bearing_rig(
        bearing, speed="1800 rpm", radial_load="2500 N", cage_slip=0.005, defects=[] if defect is None else [defect]
    )
    signal = housing_signal(rig.simulate(1.2, rate=12800), start=0.2).sel(channel=["x"])
    report = diagnose_bearing(signal, bearing, "1800 rpm", shafts=())
    named = {finding.part for finding in report.accused}
    if part is None:
        assert not named
        assert "quiet" in report.verdict
    elif part == "ball":
        assert named <= {"rolling element", "cage"}
        assert named
    else:
        assert named == {part}


@pytest.mark.slow
def test_an_acquittal_says_what_limits_it():
    """Of few turns, of tops cut off; whole records say neither."""
    knocks, sound = record(pulses(LINES.bpfo * SHAFT), RUNNING), record(RUNNING)
    limit = float(np.percentile(np.abs(knocks.values), 97.0))
    cut = make_signal(np.clip(knocks.values, -limit, limit), RATE, units="m/s^2")
    short = sound[: round(22 / SHAFT * RATE)]
    named, clipped, acquitted, hardly = (
        diagnose_bearing(one, "6205", rpm(0.0), shafts=()) for one in (knocks, cut, sound, short)
    )
    assert named.fault == clipped.fault == "outer race"
    assert not named.notes
    assert clipped.notes[0].startswith("CLIPPED")
    assert acquitted.fault is hardly.fault is None
    assert "has 22 turns, in which only strong lines stand out: take 60 or more" in hardly.verdict
    assert "turns, in which" not in acquitted.verdict


@pytest.mark.slow
@pytest.mark.parametrize("off", [-0.02, 0.03])
def test_a_run_up_told_wrongly_does_not_acquit(off):
    """Blows at the outer race's order of a shaft from 15 to 40 turns a second, whose lines stand nowhere."""
    rate, seconds = 12000, 5
    time = np.arange(rate * seconds) / rate
    turned = np.cumsum(np.linspace(15.0, 40.0, time.size)) / rate
    noise = 0.1 * np.random.default_rng(8).standard_normal(time.size)
    blows = np.zeros(time.size)
    blows[np.searchsorted(turned, np.arange(1, int(turned[-1] * LINES.bpfo)) / LINES.bpfo)] = 0.6
    fall = np.arange(200) / rate
    rung = np.convolve(blows, np.exp(-800.0 * fall) * np.sin(2 * np.pi * 3000.0 * fall))[: time.size]

    def told(values, share):
        curve = [(0, f"{900 * (1 + share)} rpm"), (5, f"{2400 * (1 + share)} rpm")]
        return diagnose_bearing(make_signal(values, float(rate), units="m/s^2"), "6205", curve)

    assert told(noise + rung, 0.0).fault == "outer race"
    doubted = told(noise + rung, off)
    assert doubted.fault is None
    assert "CHECK THE SPEED" in doubted.verdict
    assert "Not certain" in doubted.verdict
    assert told(noise, off).remarks == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("designation", "speed", "load"), [("6305", 900, 3500), ("6305", 1200, 4500), ("6305", 900, 1500)]
)
def test_a_sound_bearing_across_its_load_is_not_accused(designation, speed, load):
    """The stiffness that varies moves the housing across the load by more than along it, up to a mode of its own."""
    bearing = Bearing.from_designation(designation, estimate=True)
    rig = bearing_rig(bearing, speed=f"{speed} rpm", radial_load=f"{load} N")
    heard = housing_signal(rig.simulate(1.6, rate=12800), start=0.2).sel(channel=["y"])
    report = diagnose_bearing(heard, bearing, f"{speed} rpm", shafts=())
    assert report.fault is None
    assert re.search(says("outer race", "quiet", "stiffness that varies"), report.verdict)
    assert report.tables()["bearing_evidence"]["modulated"].max() > 0.03
    assert diagnose_bearing(heard, bearing, f"{speed} rpm", shafts=(), level=0.0).fault == "outer race"


@pytest.mark.slow
def test_blows_as_quiet_as_that_accuse_where_their_own_lines_are_not_there():
    """0.1 m/s^2 of blows, with and without the motion at their own rate that the stiffness makes."""
    blows = 0.1 * record(pulses(LINES.bpfo * SHAFT, jitter=0.0), noise=1e-4).values[:, 0]
    found = diagnose_bearing(record(blows, noise=1e-6), "6205", rpm(0.0), level=0.0)
    blows *= 0.1 / found.accused[0].modulated
    slow = sum(0.05 / k * np.cos(2 * np.pi * k * LINES.bpfo * SHAFT * TIME + k) for k in (1, 2, 3))
    assert diagnose_bearing(record(blows, noise=1e-5), "6205", rpm(0.0)).fault == "outer race"
    assert diagnose_bearing(record(blows, slow, noise=1e-5), "6205", rpm(0.0)).fault is None


FIRST = LINES.bpfo * SHAFT
SHORT = TIME[: int(RATE)]


def slow_lines(*amplitudes, places=(1, 2, 3, 4, 5), time=SHORT):
    """Lines at multiples of the outer race's rate, noise far below."""
    noise = 1e-4 * np.random.default_rng(3).standard_normal(time.size)
    lines = (a * np.cos(2 * np.pi * k * FIRST * time + k) for k, a in zip(places, amplitudes, strict=False))
    return noise + sum(lines)


def level_of(values):
    return own_level(values, RATE, FIRST, (SHAFT,))


def test_lines_of_stiffness_count_by_their_rms():
    """A Hann window lowers a line half-way between two of the spectrum by 1.42 dB, to 0.85."""
    falling = (0.3, 0.1, 0.2, 0.05, 0.1)
    true = np.sqrt(0.5 * np.sum(np.square(falling)))
    assert 0.85 * true < level_of(slow_lines(*falling)) < 1.01 * true


@pytest.mark.parametrize("other", [18 * SHAFT, 5 * FIRST + 2.5])
def test_a_line_two_lines_beside_the_fifth_is_no_stiffness(other):
    """A mesh of 18 teeth, 522 Hz, stands 2.2 lines of a second beside five times the outer race."""
    own = slow_lines(0.3, 0.1, 0.2)
    beside = own + 5.0 * np.cos(2 * np.pi * other * SHORT)
    assert level_of(beside) == pytest.approx(level_of(own), rel=0.05)
    assert level_of(beside - own + slow_lines()) == 0.0


def test_one_or_two_lines_are_no_stiffness():
    assert level_of(slow_lines(1.0)) == 0.0
    assert level_of(slow_lines(1.0, 0.5)) == 0.0
    assert level_of(slow_lines(1.0, 0.5, 0.5, places=(2, 3, 4))) == 0.0
    assert level_of(slow_lines(1.0, 0.5, 0.5)) > 0.0


@pytest.mark.parametrize("place", [1, 3, 5])
def test_a_stronger_line_at_the_very_place_counts_as_stiffness_may_make_it(place):
    """0.1, 0.05, 0.05: the first is at most three times the next, and none is more than the first."""
    alone = slow_lines(0.1, 0.05, 0.05)
    most = np.sqrt(0.5 * (max(0.1, 3 * 0.05) ** 2 + 2 * max(0.1, 0.05) ** 2))
    assert level_of(alone + 5.0 * np.cos(2 * np.pi * place * FIRST * SHORT)) < 1.01 * most


def test_orders_of_the_shaft_are_no_stiffness():
    """18 turns stand 0.07 turns beside five times the outer race, others up to half a turn beside the first four."""
    orders = slow_lines() + sum(np.cos(2 * np.pi * m * SHAFT * SHORT + m) for m in range(1, 40))
    assert level_of(orders) == 0.0


def blows_of(level, seconds):
    """Blows of an outer race that modulate so much, m/s^2 RMS, with noise of a fifth."""
    keep = slice(round(seconds * RATE))
    blows = pulses(FIRST)[keep]
    blows *= level / np.sqrt(np.mean(blows**2))
    return blows + 0.2 * level * np.random.default_rng(4).standard_normal(blows.size)


@pytest.mark.parametrize(("level", "mesh"), [(0.9, 0.5), (0.3, 0.5)])
def test_a_mesh_line_beside_a_line_of_the_outer_race_acquits_none(level, mesh):
    x = blows_of(level, 1.0) + mesh * np.sqrt(2) * np.cos(2 * np.pi * 18 * SHAFT * SHORT + 1.0)
    report = diagnose_bearing(make_signal(x, RATE, units="m/s^2"), "6205", rpm(0.0), shafts=())
    assert report.fault == "outer race"


@pytest.mark.slow
@pytest.mark.parametrize("mains", [1.0, 3.0])
def test_the_mains_at_a_line_of_the_outer_race_acquit_none(mains):
    """Of a speed at which one or three times the outer race is 100 or 300 Hz."""
    x = blows_of(0.3, 5.0) + 0.7 * np.cos(2 * np.pi * mains * FIRST * TIME)
    report = diagnose_bearing(make_signal(x, RATE, units="m/s^2"), "6205", rpm(0.0), shafts=())
    assert report.fault == "outer race"


@pytest.mark.slow
def test_blows_of_nearly_1_accuse_beside_five_lines_of_stiffness():
    """0.9 m/s^2 is five times what any sound bearing was found to make, whatever its own lines are."""
    x = blows_of(0.9, 5.0) + slow_lines(*[0.19] * 5, time=TIME)
    report = diagnose_bearing(make_signal(x, RATE, units="m/s^2"), "6205", rpm(0.0), shafts=())
    assert report.fault == "outer race"


def coupling(speed, jaws=3, seconds=5.0):
    """Blows of the jaws of a coupling in step with a shaft, its orders, noise."""
    time, turn, rng = np.arange(round(seconds * RATE)) / RATE, speed / 60.0, np.random.default_rng(5)
    x = 0.3 * rng.standard_normal(time.size)
    x += sum(0.4 / k * np.cos(2 * np.pi * k * turn * time + k) for k in range(1, 9))
    for at in np.arange(0.05, seconds - 0.05, 1.0 / (jaws * turn)):
        first = int(np.ceil(at * RATE))
        past = time[first : first + 120] - at
        x[first : first + 120] += (
            30.0 * (1.0 + 0.05 * rng.standard_normal()) * np.exp(-700.0 * past) * np.sin(4400.0 * np.pi * past)
        )
    return make_signal(x, RATE, units="m/s^2")


@pytest.mark.slow
@pytest.mark.parametrize("share", [-0.02, -0.012, -0.01, 0.0, 0.012])
def test_jaws_of_a_coupling_are_no_outer_race_whatever_speed_is_told(share):
    """3 times the shaft found at 1480 rpm, 1.7 % beside the outer race of a 6203."""
    report = diagnose_bearing(coupling(1480.0), ["6203"], f"{1480.0 * (1.0 + share)} rpm")
    assert report.fault is None
