"""Bearing lines in records made of pulses, noise and mesh lines: found where they are, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.signals import (
    BearingLines,
    MissingMetadataError,
    SignalError,
    bearing_lines,
    diagnose_bearing,
    discrete_random,
    edit_cepstrum,
    level_lines,
    make_signal,
    phase_from_speed,
    prewhiten,
    remove_average,
    spectrum,
    with_metadata,
    with_speed,
)
from gearmbs.signals.diagnosis.bearing_judgement import EnvelopeSpectrum, find_lines, judge, log_tail, power_of
from gearmbs.signals.diagnosis.bearing_report import PartFinding
from tests.says import says
from tests.view.looking import assert_readable

RATE, SHAFT, SECONDS = 12000.0, 29.0, 5.0
LINES = bearing_lines("6205")
TIME = np.arange(int(RATE * SECONDS)) / RATE


def pulses(
    frequency: float, slip: float = 0.0, jitter: float = 0.003, modulation: float = 0.0, seed: int = 1
) -> np.ndarray:
    """Decaying resonances at 3 kHz, one a period with a random delay, their size following the shaft."""
    rng = np.random.default_rng(seed)
    period = 1.0 / (frequency * (1.0 + slip))
    out = np.zeros(TIME.size + 400)
    decay = np.arange(400) / RATE
    at = 0.0
    while at < SECONDS:
        first = int(np.ceil(at * RATE))
        size = 1.0 + modulation * np.cos(2.0 * np.pi * SHAFT * at)
        ring = np.exp(-decay * 900.0) * np.sin(2.0 * np.pi * 3000.0 * (decay + first / RATE - at))
        out[first : first + 400] += size * ring
        at += period * (1.0 + jitter * rng.normal())
    return out[: TIME.size]


def record(*parts: np.ndarray, noise: float = 0.3, seed: int = 0):
    rng = np.random.default_rng(seed)
    return make_signal(sum(parts) + noise * rng.standard_normal(TIME.size), RATE, channels=["case"], units="m/s^2")


MESH = 3.0 * np.cos(2 * np.pi * 23 * SHAFT * TIME) * (1 + 0.4 * np.cos(2 * np.pi * SHAFT * TIME))


@pytest.mark.parametrize(
    ("part", "order"), [("outer race", LINES.bpfo), ("inner race", LINES.bpfi), ("rolling element", 2 * LINES.bsf)]
)
@pytest.mark.parametrize("slip", [-0.009, 0.0, 0.004])
@pytest.mark.slow
def test_names_the_part(part, order, slip):
    modulation = 0.6 if part == "inner race" else 0.0
    report = diagnose_bearing(record(pulses(order * SHAFT, slip, modulation=modulation), MESH), "6205", f"{SHAFT} Hz")
    assert report.fault == part
    assert report.clear
    found = report.accused[0]
    assert found.slip == pytest.approx(slip, abs=1e-3)
    assert found.kinematic == pytest.approx(order * SHAFT)
    assert f"{found.found:.2f} Hz" in report.verdict
    if part == "inner race":
        assert "sidebands at the shaft's turns" in report.verdict
    assert report.accused == [f for f in report.accused if f.part == part]


def test_finds_blows_at_perfectly_even_times():
    """As a simulation without random slip makes them: single lines, which prewhitening alone would hide in noise."""
    report = diagnose_bearing(record(3.0 * pulses(LINES.bpfo * SHAFT, jitter=0.0), MESH), "6205", f"{SHAFT} Hz")
    assert report.fault == "outer race"
    assert report.clear


@pytest.mark.parametrize("seed", range(12))
def test_accuses_nothing_in_gears_and_noise(seed):
    report = diagnose_bearing(record(MESH, noise=0.5, seed=seed), "6205", f"{SHAFT} Hz")
    assert report.fault is None
    assert "No lines of a defect of bearing 6205 stand out" in report.verdict


@pytest.mark.parametrize("part", ["outer race", "rolling element"])
@pytest.mark.parametrize("depth", [0.3, 1.0])
def test_a_smooth_modulation_at_the_rate_of_a_part_is_not_certain(part, depth):
    """As a fan or a torque may modulate noise; sharp blows name the part (`test_names_the_part`)."""
    carrier = 5.0 * np.random.default_rng(5).standard_normal(TIME.size)
    modulated = carrier * (1.0 + depth * np.cos(2 * np.pi * LINES.orders[part] * SHAFT * TIME))
    report = diagnose_bearing(record(modulated), "6205", f"{SHAFT} Hz", shafts=[])
    assert report.fault is None
    assert [f.part for f in report.findings if f.grade == "smooth"] == [part]
    assert "Not certain" in report.verdict
    assert "No lines" not in report.verdict


@pytest.mark.slow
def test_blows_in_step_with_the_shaft_name_no_part():
    """Every fifth turn, as of loose parts: 18/5 turns are near an outer race's 3.585, 27/5 near an inner's 5.415."""
    report = diagnose_bearing(record(2.0 * pulses(SHAFT / 5, jitter=0.002), MESH), "6205", f"{SHAFT} Hz", shafts=[])
    outer = next(f for f in report.findings if f.part == "outer race")
    assert outer.found / SHAFT == pytest.approx(18 / 5, abs=2e-3)
    assert outer.log_chance < -20.0
    assert report.fault is None
    assert (outer.beside, outer.fraction) == (True, (18, 5))
    assert "are 18/5 of the shaft's turns" in report.verdict
    # a defect that happens to stand there is named by its strength
    both = record(4.0 * pulses(SHAFT * 18 / 5), 0.3 * pulses(SHAFT / 5, jitter=0.002), MESH)
    assert diagnose_bearing(both, "6205", f"{SHAFT} Hz", shafts=[]).fault == "outer race"


def test_a_faint_line_is_told_and_accuses_nothing():
    report = diagnose_bearing(record(0.35 * pulses(LINES.bpfo * SHAFT)), "6205", f"{SHAFT} Hz", shafts=[])
    outer = next(f for f in report.findings if f.part == "outer race")
    assert outer.grade == "faint"
    assert outer.stronger == 0
    assert outer.slip == pytest.approx(0.0, abs=2e-3)
    assert report.fault is None
    assert f"A faint line at {outer.found:.2f} Hz" in report.verdict


def test_multiples_without_their_line_are_not_faint():
    power = np.random.default_rng(0).exponential(size=6000)
    line = LINES.bpfo * SHAFT
    power[[round(k * line / 0.2) for k in (2, 3, 4)]] *= 300.0
    found = judge([EnvelopeSpectrum.of(power, 0.2, SHAFT)], [LINES], SHAFT, [], slip=0.015, harmonics=4)
    outer = next(one for one in found if one.part == "outer race")
    assert (outer.grade, outer.stronger) == ("multiples", 0)
    assert outer.evidence.log_chance < -100.0
    finding = PartFinding(
        "6205", "outer race", "case", line, outer.evidence.found, outer.evidence.ratios, outer.evidence.log_chance,
        np.nan, "", outer.grade,
    )  # fmt: skip
    assert finding.remark().startswith(f"Multiples of {finding.found:.2f} Hz in channel case stand out")
    assert "faint" not in finding.remark()


def test_chance_is_the_share_of_noise_that_reaches_it():
    """Of envelopes of noise, the share with a chance below p is about p."""
    rng = np.random.default_rng(3)
    chances = []
    for _ in range(150):
        power = power_of(rng.standard_normal(1 << 14) ** 2)
        chances.append(find_lines(EnvelopeSpectrum.of(power, 0.25, 29.0), 103.7).log_chance)
    shares = [np.mean(np.array(chances) < level) for level in (-1.0, -2.0)]
    assert 0.01 < shares[0] < 0.2
    assert shares[1] < 0.05


def test_tail_of_a_gamma_distribution():
    from scipy.stats import gamma

    for count in (1, 3, 4):
        assert log_tail(20.0, count) == pytest.approx(gamma.logsf(20.0, count), rel=1e-9)


@pytest.mark.slow
def test_bearings_with_the_same_lines_are_one():
    data = record(pulses(LINES.bpfo * SHAFT), MESH)
    report = diagnose_bearing(data, {"a": "6205", "b": "6205", "c": ("6205", 0.345)}, f"{SHAFT} Hz")
    assert [lines.name for lines in report.bearings] == ["a or b", "c"]
    assert report.accused[0].bearing == "a or b"
    assert "of bearing a or b makes" in report.verdict


@pytest.mark.slow
def test_several_bearings_and_ratios():
    slow = 0.3
    other = bearing_lines("6206", slow)
    data = record(pulses(other.bpfo * slow * SHAFT), MESH)
    report = diagnose_bearing(data, {"input": "6205", "output": ("6206", slow)}, f"{SHAFT} Hz")
    assert [lines.name for lines in report.bearings] == ["input", "output"]
    assert (report.fault, report.accused[0].bearing) == ("outer race", "output")
    tables = report.tables()
    assert len(tables["bearing_evidence"]) == 8
    assert tables["bearing_lines"].frequency.max() == pytest.approx(3 * LINES.bpfi * SHAFT)
    assert "| output | case | outer race |" in report.to_markdown()


@pytest.mark.slow
def test_speed_that_varies_is_followed_in_angle():
    speed = SHAFT * (1.0 + 0.15 * np.sin(2 * np.pi * 0.3 * TIME))
    turns = np.cumsum(speed) / RATE
    crossings = np.interp(np.arange(0.0, turns[-1] * LINES.bpfo) / LINES.bpfo, turns, TIME)
    signal = np.zeros(TIME.size + 400)
    decay = np.arange(400) / RATE
    for at in crossings:
        first = int(at * RATE)
        signal[first : first + 400] += np.exp(-900.0 * decay) * np.sin(2 * np.pi * 3000.0 * decay)
    data = record(signal[: TIME.size])
    phase = phase_from_speed(data, 1.0).copy(data=2.0 * np.pi * turns)
    report = diagnose_bearing(data, "6205", phase=phase)
    assert report.fault == "outer race"
    assert report.accused[0].slip == pytest.approx(0.0, abs=2e-3)
    assert diagnose_bearing(data, "6205", f"{SHAFT} Hz").fault != "inner race"
    points = [(t, 2.0 * np.pi * s) for t, s in zip(TIME[::200], speed[::200])]
    assert diagnose_bearing(data, "6205", points).fault == "outer race"
    own = diagnose_bearing(with_speed(data, points), "6205")
    assert own.fault == "outer race"
    assert own.shaft == pytest.approx(float(speed.mean()), rel=1e-3)


def test_own_band_and_its_limits():
    data = record(pulses(LINES.bpfo * SHAFT), MESH)
    report = diagnose_bearing(data, "6205", f"{SHAFT} Hz", band=(2000.0, 4000.0))
    assert report.bands == {"case": (2000.0, 4000.0)}
    assert report.fault == "outer race"
    with pytest.raises(SignalError, match=says("band", "0", "6000 Hz")):
        diagnose_bearing(data, "6205", f"{SHAFT} Hz", band=(2000.0, 9000.0))


def test_multiples_by_name():
    given = {"FTF": 0.4, "BSF": 2.3, "BPFO": 3.6, "BPFI": 5.4}
    assert bearing_lines(given) == BearingLines("bearing", 0.4, 2.3, 3.6, 5.4)
    with pytest.raises(SignalError, match="BPFI missing"):
        bearing_lines({"FTF": 0.4, "BSF": 2.3, "BPFO": 3.6})
    with pytest.raises(SignalError, match=says("bearing", "'6305'", "how many balls")):
        bearing_lines("6305")
    with pytest.raises(SignalError, match=says("bearing", "'6205'", "give a designation")):
        bearing_lines(17)


def test_what_is_missing_is_asked_for():
    data = record(MESH)
    with pytest.raises(MissingMetadataError, match=says("speed", "bearing", "pass speed='1500 rpm'")):
        diagnose_bearing(data, "6205")
    assert diagnose_bearing(with_metadata(data, speed=2 * np.pi * SHAFT), "6205").shaft == pytest.approx(SHAFT)
    with pytest.raises(SignalError, match=says("shaft", "give a record")):
        diagnose_bearing(data.isel(time=slice(0, 5000)), "6205", f"{SHAFT} Hz")
    with pytest.raises(SignalError, match=says("sampling rate above")):
        diagnose_bearing(data, "6205", "60000 rpm")


@pytest.mark.slow
def test_a_modulation_at_the_cages_turns_may_be_another_shafts():
    """A wheel with one high tooth on a shaft of 0.4 times the speed: not told from a cage unless shafts are known."""
    ratio = LINES.ftf
    once_a_turn = (1.0 + 0.9 * (np.cos(2 * np.pi * ratio * SHAFT * TIME) > 0.9)) * np.random.default_rng(5).normal(
        size=TIME.size
    )
    data = record(once_a_turn, MESH)
    open_report = diagnose_bearing(data, "6205", f"{SHAFT} Hz")
    assert open_report.fault is None
    assert "so might another shaft" in open_report.verdict
    alone = diagnose_bearing(data, "6205", f"{SHAFT} Hz", shafts=[])
    assert (alone.fault, alone.clear) == ("cage", False)
    known = diagnose_bearing(data, "6205", f"{SHAFT} Hz", shafts=[ratio])
    assert known.fault is None
    assert known.remarks == []
    by_teeth = diagnose_bearing(with_metadata(data, teeth=(19, 48)), "6205", f"{SHAFT} Hz")
    assert by_teeth.shafts == pytest.approx((19 / 48,))
    with pytest.raises(SignalError, match="shafts: give positive ratios"):
        diagnose_bearing(data, "6205", f"{SHAFT} Hz", shafts=[-1.0])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.slow
def test_families_of_other_causes_seldom_accuse(seed):
    """Strong families of lines at random orders: what stands out everywhere accuses nobody."""
    rng = np.random.default_rng(seed)
    orders = rng.uniform(0.7, 6.0, 14)
    far = [o for o in orders if all(abs(np.log(o / line)) > 0.03 for line in LINES.orders.values())]
    data = record(*[pulses(o * SHAFT, jitter=0.002, seed=k) for k, o in enumerate(far)], noise=0.5, seed=seed)
    report = diagnose_bearing(data, "6205", f"{SHAFT} Hz", shafts=[])
    assert report.fault is None


@pytest.mark.slow
def test_two_defects_are_both_named():
    data = record(pulses(LINES.bpfo * SHAFT), pulses(LINES.bpfi * SHAFT, modulation=0.6, seed=2), MESH)
    report = diagnose_bearing(data, "6205", f"{SHAFT} Hz")
    assert {f.part for f in report.accused} == {"outer race", "inner race"}
    assert all(f.stronger <= 2 and f.places > 80 for f in report.accused)


# --- separation of gears and bearings ---------------------------------------------------------------------------


def test_average_removal_parts_gear_and_bearing():
    bearing = pulses(LINES.bpfo * SHAFT)
    data = record(bearing, MESH, noise=0.0)
    repeating, rest = remove_average(data, phase_from_speed(data, 2 * np.pi * SHAFT))
    times = rest["time"].values
    kept = np.interp(times, TIME, bearing)
    np.testing.assert_allclose(repeating.values + rest.values, data.sel(time=times).values, atol=1e-12)
    assert np.corrcoef(rest.values[:, 0], kept)[0, 1] > 0.98
    assert np.std(repeating.values[:, 0] - np.interp(times, TIME, MESH)) < 0.1 * np.std(MESH)


def test_discrete_random_separation():
    """The lines go to one side and the bearing, whose pulses come at random, to the other."""
    bearing = pulses(LINES.bpfo * SHAFT, jitter=0.02)
    data = record(bearing, MESH, noise=0.05)
    discrete, random = discrete_random(data, segment=1024, delay=0.5)
    np.testing.assert_allclose(discrete.values + random.values, data.values, atol=1e-12)
    inner = slice(2000, -2000)
    assert np.std((discrete.values[:, 0] - MESH)[inner]) < 0.25 * np.std(MESH)
    assert np.corrcoef(random.values[inner, 0], bearing[inner])[0, 1] > 0.75


def test_cepstrum_editing_levels_a_family_only():
    family = sum(0.3 * np.cos(2 * np.pi * k * SHAFT * TIME + k * k) for k in range(1, 150))
    data = record(pulses(LINES.bpfo * SHAFT, jitter=0.02), family, noise=0.2)
    edited = edit_cepstrum(data, SHAFT)
    before, after = (
        spectrum(s, scaling="rms").sel(frequency=23 * SHAFT, method="nearest").item() for s in (data, edited)
    )
    assert after < 0.5 * before
    # between the lines the bearing stays
    between = (np.arange(90, 115) + 0.5) * SHAFT
    quiet = [spectrum(s, scaling="power", segment=0.5).sel(frequency=between, method="nearest") for s in (data, edited)]
    assert float(quiet[1].sum()) == pytest.approx(float(quiet[0].sum()), rel=0.3)
    with pytest.raises(SignalError, match=says("frequencies", "above")):
        edit_cepstrum(data, 0.0)


def test_levelled_lines_are_so_much_above_their_neighbourhood():
    level = level_lines(record(MESH), 4 * SHAFT, most=5.0)
    lines = np.abs(np.fft.rfft(level.values[:, 0]))[100:-100]
    assert lines.max() == pytest.approx(5.0 * np.median(lines), rel=0.3)
    with pytest.raises(SignalError, match="width: must lie"):
        level_lines(record(MESH), 0.0)


def test_prewhitened_spectrum_is_flat():
    white = prewhiten(record(MESH))
    lines = np.abs(np.fft.rfft(white.values[:, 0]))[1:-1]
    np.testing.assert_allclose(lines, lines.mean(), rtol=1e-6)
    with pytest.raises(SignalError, match=says("signal", "prewhitened", "channels=")):
        prewhiten(make_signal(np.zeros(1000), RATE))


# --- the command line --------------------------------------------------------------------------------------------


def run(*words):
    from typer.testing import CliRunner

    from gearmbs.cli import app

    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.mark.slow
def test_one_command_names_the_race(tmp_path):
    from gearmbs.signals import write_signal

    path = write_signal(record(pulses(LINES.bpfi * SHAFT, -0.004, modulation=0.6), MESH), tmp_path / "case.nc")
    options = ("--speed", f"{60 * SHAFT} rpm", "--bearing", "6205", "--bearing", "6206@0.345")
    result = run("analyse", path, *options, "--tables", tmp_path / "tables")
    assert result.exit_code == 0, result.output
    assert "Clear lines such as a defect of the inner race of bearing 6205 makes" in result.output
    assert (tmp_path / "tables" / "bearing_evidence.csv").exists()
    banded = run("analyse", path, *options[:4], "--band", "2 kHz, 4 kHz")
    assert "Band for case: 2000 to 4000 Hz" in banded.output


TRAIN = """
[shafts.a]
length = "0.2 m"
radius = "10 mm"
[shafts.b]
length = "0.2 m"
radius = "10 mm"
[wheels.one]
shaft = "a"
module = "2 mm"
teeth = 20
face_width = "20 mm"
[wheels.two]
shaft = "b"
module = "2 mm"
teeth = 70
face_width = "20 mm"
[meshes.m]
driver = "one"
driven = "two"
[bearings.left]
shaft = "a"
rolling = "6205"
[bearings.right]
shaft = "b"
rolling = "6206"
[drives.d]
shaft = "a"
speed = "1740 rpm"
[loads.l]
shaft = "b"
torque = "10 N m"
"""


@pytest.mark.slow
def test_bearings_and_shafts_of_a_drivetrain(tmp_path):
    from gearmbs.signals import write_signal

    path = write_signal(record(pulses(LINES.bpfi * SHAFT, -0.004, modulation=0.6), MESH), tmp_path / "case.nc")
    (tmp_path / "train.toml").write_text(TRAIN)
    result = run("analyse", path, "--train", tmp_path / "train.toml", "--speed", f"{60 * SHAFT} rpm")
    assert result.exit_code == 0, result.output
    assert "Clear lines such as a defect of the inner race of bearing left makes" in result.output
    assert "| right | case | outer race |" in result.output


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--bearing", "6305"), "how many balls it has"),
        (("--bearing", "6205@fast"), "write for example 6205@0.345"),
        (("--bearing", "6205", "--shaft", "slow"), "give ratios such as 0.345, or none"),
        (("--bearing", "6205", "--band", "2000"), "give two frequencies"),
    ],
)
@pytest.mark.slow
def test_says_what_is_wrong(tmp_path, words, message):
    from gearmbs.signals import write_signal

    path = write_signal(record(MESH), tmp_path / "case.nc")
    result = run("analyse", path, "--speed", f"{60 * SHAFT} rpm", *words)
    assert result.exit_code != 0
    assert message in " ".join(result.output.split())


@pytest.mark.slow
def test_the_report_shows_draws_and_saves_itself(tmp_path):
    report = diagnose_bearing(record(3.0 * pulses(LINES.bpfo * SHAFT)), "6205", f"{SHAFT} Hz", shafts=[])
    figure = report.plot()
    assert_readable(figure, overlap=0.4)
    drawn = [line.get_xdata()[0] for line in figure.axes[0].lines if line.get_label() == "outer race"]
    assert drawn == [pytest.approx(report.accused[0].found)]
    with pytest.raises(ValueError, match="there is no 'x'"):
        report.plot(channel="x")
    assert "<table>" in report._repr_html_()
    assert "data:image/svg+xml" in report.save(tmp_path / "bearing.html").read_text()


@pytest.mark.slow
def test_a_level_that_cannot_be_measured_is_left_open_with_the_length_that_is_needed():
    """The outer race's line 1.6 Hz beside a shaft's: told apart from (2.5 + 0.5)/(1.6 - 0.03) s on."""
    order = 3.0 + 1.6 / SHAFT
    lines = {"ftf": order / 9.0, "bsf": 2.33, "bpfo": order, "bpfi": 9.0 - order}
    whole = record(pulses(order * SHAFT))
    needed = 3.0 / (1.6 - 3e-4 * 3 * SHAFT)

    def outer(seconds):
        report = diagnose_bearing(whole.isel(time=slice(0, int(seconds * RATE))), lines, f"{SHAFT} Hz", slip=1e-3)
        return report, next(f for f in report.findings if f.part == "outer race")

    report, found = outer(1.2)
    assert np.isnan(found.level)
    assert found.needed == pytest.approx(needed, rel=1e-6)
    row = next(line for line in report.to_markdown().splitlines() if "| outer race |" in line)
    assert row.split("|")[7].strip() == "-"
    assert "2.0 s are needed" in report.to_markdown()
    longer, found = outer(1.05 * needed)
    assert found.needed is None
    assert found.level > 10.0
    assert "outer race of" not in "".join(longer._unmeasured())
