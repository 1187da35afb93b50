"""The analysis of a record, simulated or measured, and its report."""

import math
import os
import re
import tracemalloc
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from gearmbs.signals import (
    MissingMetadataError,
    SignalError,
    SignalFileError,
    analyse,
    analyse_file,
    compare_files,
    make_signal,
    read_signal,
    to_signal,
    write_signal,
)
from gearmbs.signals.analysis.report import name_lines
from gearmbs.signals.rotation.mesh_shaft import mesh_shaft
from gearmbs.signals.rotation.shaft import Known
from tests.says import says
from tests.signals.test_measured_lines import LEVELS

RATE = 12800.0
TEETH = 32


def record(seconds=4.0, f=29.75, depth=0.3, amplitudes=(1.0, 0.6, 0.3), noise=0.05, seed=1, **kwargs):
    t = np.arange(round(seconds * RATE)) / RATE
    angle = 2 * np.pi * f * t + 0.02 * np.sin(2 * np.pi * 0.3 * t)
    x = sum(a * np.cos(k * TEETH * angle + k) for k, a in enumerate(amplitudes, 1)) * (1 + depth * np.cos(angle))
    x = x + noise * np.random.default_rng(seed).standard_normal(t.size)
    return make_signal({"acc": x, "tacho": np.sin(angle)}, RATE, units=["m/s^2", "V"], teeth=TEETH, **kwargs)


def test_analysis_finds_speed_harmonics_and_sidebands():
    report = analyse(record()[:, [0]])
    # the mean speed of the wobbling angle over the part that was followed differs by at most its swing over its length
    assert report.gmf == pytest.approx(TEETH * 29.75, abs=0.2)
    assert report.speed == pytest.approx(2 * math.pi * report.gmf / TEETH)
    assert all(report.harmonics[way].attrs["long_name"].startswith("RMS") for way in ("band", "orders"))
    expected = np.array([1.0, 0.6, 0.3]) / math.sqrt(2)
    np.testing.assert_allclose(report.harmonics["orders"][:, 0], expected, rtol=0.01)
    # the band holds the carrier, two sidebands of depth / 2, and noise: 0.05^2 over 6400 Hz, 7 / 12 GMF + of it
    width = 0.5 * report.gmf + 0.25 * report.gmf
    inside = expected**2 * (1 + 0.3**2 / 2) + 0.05**2 * width / 6400
    np.testing.assert_allclose(report.harmonics["band"][:, 0], np.sqrt(inside), rtol=0.01)
    side = report.sidebands.sel(harmonic=1)
    assert float((side.sel(sideband=1) / side.sel(sideband=0)).item()) == pytest.approx(0.15, rel=0.03)
    assert report.indicators["sideband_index"].item() == pytest.approx(0.15, rel=0.03)
    assert report.lines["frequency"].iloc[0] == pytest.approx(report.gmf, abs=0.5)
    assert report.speed_origin == "estimated from the mesh line"


@pytest.mark.slow
def test_analysis_with_given_speed_and_tacho():
    omega = 2 * math.pi * 29.75
    given = analyse(record()[:, [0]], speed=omega * 1.005)
    assert given.gmf == pytest.approx(952.0, abs=0.2)
    assert "off the given speed" in given.speed_origin
    tacho = analyse(record(), tacho="tacho")
    assert tacho.harmonics["channel"].values.tolist() == ["acc"]
    assert tacho.gmf == pytest.approx(952.0, abs=0.2)
    np.testing.assert_allclose(tacho.harmonics["orders"], given.harmonics["orders"], rtol=0.01)


def test_analysis_of_a_noise_free_simulated_second():
    # as a simulation gives it: exact speed, lines at multiples of GMF only
    rpm, teeth = 1000.0, 29
    t = np.arange(12800) / RATE
    gmf = teeth * rpm / 60
    x = sum(a * np.cos(2 * np.pi * k * gmf * t + k) for k, a in enumerate([3.0, 2.0, 1.0, 0.5], 1))
    report = analyse(make_signal(x, RATE, units="m/s^2", speed=2 * math.pi * rpm / 60, teeth=(29, 29)))
    assert report.gmf == pytest.approx(gmf, rel=1e-6)
    expected = np.array([3.0, 2.0, 1.0]) / math.sqrt(2)
    np.testing.assert_allclose(report.harmonics["orders"][:, 0], expected, rtol=1e-3)
    np.testing.assert_allclose(report.harmonics["band"][:, 0], expected, rtol=1e-3)


def test_a_short_record_is_told_from_a_weak_line():
    """What is too short to follow has nothing wrong with its lines."""
    t = np.arange(5120) / 12800.0
    line = np.cos(2 * np.pi * 525.0 * t) + 0.4 * np.cos(2 * np.pi * 1050.0 * t)
    for speed in (None, "1500 rpm"):
        notes = analyse(make_signal(line, 12800.0), teeth=21, speed=speed).notes
        assert [note[:68] for note in notes] == ["The speed is taken as constant: a record of 10 revolutions is too sh"]


@pytest.mark.parametrize(("told", "doubted"), [("1515 rpm", True), ("1503 rpm", False)])
def test_a_speed_beside_the_mesh_of_a_short_record_is_told(told, doubted):
    """25 turns are averaged at the told speed, which loses a mesh that is 1 % off."""
    t = np.arange(12800) / RATE
    noise = 0.1 * np.random.default_rng(1).standard_normal(t.size)
    mesh = np.cos(2 * np.pi * 800.0 * t) + 0.5 * np.cos(2 * np.pi * 1600.0 * t) + noise
    notes = analyse(make_signal(mesh, RATE), teeth=32, speed=told).notes
    found = [note for note in notes if re.search(says("CHECK THE SPEED", "1500.00 rpm", "-0.99 %"), note)]
    assert bool(found) == doubted == any("CHECK" in note for note in notes)


def test_sidebands_of_a_planetary_set_in_a_short_record_do_not_doubt_its_speed():
    t = np.arange(12800) / RATE
    lines = {98: 0.3, 99: 1.0, 102: 0.8, 105: 0.3}
    passing = sum(size * np.cos(2 * np.pi * 10.0 * order * t) for order, size in lines.items())
    passing = passing + 0.3 * np.random.default_rng(2).standard_normal(t.size)
    notes = analyse(make_signal(passing, RATE), teeth=100, speed="600 rpm").notes
    assert not any("CHECK" in note for note in notes)


@pytest.mark.slow
def test_the_right_speed_of_a_weaker_stage_is_not_doubted():
    """A second mesh, six times as strong, of a shaft that turns at 0.37 times the speed; the speed of that one is."""
    t = np.arange(8 * 12800) / 12800.0
    rng = np.random.default_rng(3)

    def mesh(frequency, shaft):
        return sum(
            np.cos(2 * np.pi * k * frequency * t + k) * (1 + 0.3 * np.cos(2 * np.pi * shaft * t)) / k for k in (1, 2, 3)
        )

    record = make_signal(mesh(21 * 25.0, 25.0) + 6 * mesh(37 * 9.25, 9.25) + rng.standard_normal(t.size), 12800.0)
    right = analyse(record, teeth=21, speed="1500 rpm")
    assert right.speed == pytest.approx(50 * np.pi, rel=1e-4)
    assert not [note for note in right.notes if note.startswith("CHECK")]
    half = analyse(record, teeth=21, speed="750 rpm")
    assert [note for note in half.notes if note.startswith("CHECK")]


def _weak(size, seed):
    """Twenty seconds at 1500 rpm that drift by 0.3 %, three harmonics of 21 teeth of this size in noise of RMS 1."""
    rate, seconds = 6000.0, 20.0
    t = np.arange(round(seconds * rate)) / rate
    angle = 50 * math.pi * (t + 0.003 * seconds / math.tau * np.sin(math.tau * t / seconds))
    line = sum(a * np.cos(21 * k * angle + k) for k, a in enumerate((1.0, 0.5, 0.3), 1)) * (1 + 0.3 * np.cos(angle))
    return make_signal(size * line + np.random.default_rng(seed).standard_normal(t.size), rate)


@pytest.mark.parametrize("speed", ["1500 rpm", "1489 rpm", "1512 rpm"])
@pytest.mark.parametrize("size", [0.1, 0.2, 1.0])
@pytest.mark.slow
def test_a_speed_nearly_right_is_followed_in_noise(size, speed):
    shaft, _ = mesh_shaft(_weak(size, 1), (21,), Known(speed=speed), notes := [])
    assert "mesh line" in shaft.origin
    assert shaft.speed == pytest.approx(50 * math.pi, rel=1e-3)
    assert notes == []


@pytest.mark.parametrize("speed", [1575.0, 1695.0, 1065.0])
@pytest.mark.parametrize("size", [0.0, 0.1, 1.0])
@pytest.mark.slow
def test_a_wrong_speed_is_not_followed(size, speed):
    """Noise has lines anywhere, and a true mesh line has sidebands."""
    shaft, _ = mesh_shaft(_weak(size, 2), (21,), Known(speed=speed * math.pi / 30), notes := [])
    assert shaft.origin == "as given"
    assert shaft.speed == pytest.approx(speed * math.pi / 30)
    said = [note for note in notes if "o mesh line was found within 2 % of the given speed" in note]
    assert len(said) == 1
    assert f"{speed:.1f} rpm" in said[0]


@pytest.mark.slow
@pytest.mark.parametrize("way", ["signal", "file", "call"])
def test_speed_and_teeth_that_contradict_the_record_are_told(tmp_path, way):
    own = record(seconds=2.0)[:, [0]]
    own = make_signal(own.values, RATE, units="m/s^2", speed=2 * math.pi * 29.75, teeth=(TEETH, 45))
    path = tmp_path / "own.csv"
    write_signal(own, path)

    def analysed(**given):
        if way == "call":
            return analyse(own, **given)
        return analyse(to_signal(own, **given) if way == "signal" else read_signal(path, **given))

    with pytest.warns(UserWarning, match=says("teeth=31", "given", "32", "45")):
        report = analysed(teeth=31)
    assert report.teeth == (31,)
    assert any("teeth=31 is given" in note for note in report.notes)
    with pytest.warns(UserWarning, match=says("speed=1700 rpm", "given", "1785 rpm")):
        report = analysed(speed="1700 rpm")
    assert report.speed == pytest.approx(1700 * math.pi / 30, rel=0.02)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # a nominal speed, and the first of both wheels, contradict nothing
        report = analysed(speed="1770 rpm", teeth=TEETH)
    assert report.speed == pytest.approx(2 * math.pi * 29.75, rel=1e-3)
    assert report.notes == []


def test_report_reads_well():
    report = analyse(record()[:, [0]])
    text = report.to_markdown()
    for part in ("# Analysis of", "Gear mesh frequency: 95", "acc [m/s^2]", "1 x GMF", "fm4", "Strongest lines"):
        assert part in text
    assert set(report.tables()) == {"harmonics", "levels", "lines", "sidebands", "indicators", "impulsive"}
    assert report.tables()["harmonics"].columns.tolist() == ["harmonic", "frequency", "channel", "band", "orders"]
    assert "GMF 95" in repr(report)


def test_analysis_notes_what_it_leaves_out():
    # only two harmonics fit below 2 kHz
    t = np.arange(4 * 4000) / 4000.0
    x = np.cos(2 * np.pi * 640 * t) + 0.5 * np.cos(2 * np.pi * 1280 * t)
    report = analyse(make_signal(x, 4000.0, teeth=TEETH), speed=40 * math.pi)
    assert report.harmonics.sizes["harmonic"] == 2
    assert any("Only 2 of 3" in note for note in report.notes)


def test_analysis_errors():
    with pytest.raises(MissingMetadataError, match="rate is missing"):
        analyse(np.ones(10000), TEETH)
    with pytest.raises(SignalError, match="wheel: must be 1 to 1"):
        analyse(record()[:, [0]], wheel=2)
    with pytest.raises(SignalError, match="nothing is left"):
        analyse(record()[:, [1]], tacho="tacho")


@pytest.mark.slow
def test_second_wheel_follows_its_own_shaft():
    t = np.arange(8 * 12800) / RATE
    angle = 2 * np.pi * 30.0 * t
    other = angle * 32 / 80
    x = np.cos(32 * angle) * (1 + 0.3 * np.cos(angle)) * (1 + 0.2 * np.cos(other))
    signal = make_signal(x, RATE, teeth=(32, 80))
    first, second = analyse(signal), analyse(signal, wheel=2)
    assert first.indicators["sideband_index"].item() == pytest.approx(0.15, rel=0.05)
    assert second.indicators["sideband_index"].item() == pytest.approx(0.10, rel=0.05)
    assert second.gmf == pytest.approx(first.gmf)


@pytest.mark.slow
def test_analyse_file_and_its_progress(tmp_path):
    path = write_signal(record()[:, [0]], tmp_path / "x.csv.gz")
    stages = []
    report = analyse_file(path, progress=lambda f, s: stages.append((f, s)))
    assert report.source == "x.csv.gz"
    fractions = [f for f, s in stages if s != "reading"]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    with pytest.raises(SignalFileError, match=r"none\.csv"):
        analyse_file(tmp_path / "none.csv", teeth=32)


@pytest.mark.slow
def test_scratch_memory_stays_below_twice_the_record():
    t = np.arange(10 * 51200) / 51200.0
    angle = 2 * np.pi * 29.75 * t
    rng = np.random.default_rng(0)
    data = np.stack([np.cos(32 * angle + c) + 0.3 * rng.standard_normal(t.size) for c in range(4)], axis=1)
    signal = make_signal(data, 51200.0, teeth=32)
    analyse(signal[: 51200 * 2])
    tracemalloc.start()
    analyse(signal)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # blocks of 2^16 to 2^17 samples and a few columns, whatever the number of channels
    assert peak < 2.0 * data.nbytes + 16e6


MEASUREMENTS = os.environ.get("GEARMBS_MEASUREMENTS")


@pytest.mark.skipif(not MEASUREMENTS, reason="GEARMBS_MEASUREMENTS names no folder with the measured records")
class TestMeasuredRecords:
    """SpectraQuest gearbox, kokikwbt/predictive-maintenance on GitHub (MIT): 12.8 kHz, 32 teeth, accelerometers."""

    @pytest.mark.parametrize(("name", "gmf"), [("h30hz0", 952.1), ("h30hz90", 948.1)])
    def test_healthy_gear_mesh_frequency(self, name, gmf):
        report = analyse_file(Path(MEASUREMENTS) / f"{name}.csv.gz", teeth=32, rate=12800.0)
        # one line of the record's own spectrum is 0.12 to 0.14 Hz
        assert report.gmf == pytest.approx(gmf, abs=0.1)
        assert report.speed / (2 * math.pi) == pytest.approx(gmf / 32, abs=0.01)

    @pytest.mark.parametrize(("name", "gmf"), [("b30hz0", 952.1), ("b30hz90", 948.0)])
    def test_broken_tooth_gear_mesh_frequency(self, name, gmf):
        report = analyse_file(Path(MEASUREMENTS) / f"{name}.csv.gz", teeth=32, rate=12800.0)
        assert report.gmf == pytest.approx(gmf, abs=0.5)

    @pytest.mark.parametrize(("name", "gmf"), [("h30hz0", 952.16), ("h30hz90", 948.05)])
    def test_each_channel_alone_gives_the_same(self, name, gmf):
        path = Path(MEASUREMENTS) / f"{name}.csv.gz"
        for channel in ("a1", "a2", "a3", "a4"):
            assert analyse_file(path, teeth=32, rate=12800.0, channels=[channel]).gmf == pytest.approx(gmf, abs=0.05)

    def test_comparison_says_what_the_broken_tooth_does(self):
        folder = Path(MEASUREMENTS)
        cases = {
            f"{load} %": {"healthy": folder / f"h30hz{load}.csv.gz", "broken": folder / f"b30hz{load}.csv.gz"}
            for load in (0, 90)
        }
        report = compare_files(cases, teeth=32, rate=12800.0)
        text = report.to_markdown()
        assert "broken against healthy at load 0 %: 1 x GMF" in text
        assert "as expected" in text
        # load raises the healthy pair's harmonics on every channel
        ratio = report.data["experiment"].sel(state="healthy", load="90 %") / report.data["experiment"].sel(
            state="healthy", load="0 %"
        )
        assert float(ratio.min()) > 1.0
        # as in the repository
        for name, levels in LEVELS.items():
            case = {"state": "healthy" if name[0] == "h" else "broken", "load": f"{name[5:]} %"}
            found = report.data["experiment"].sel(case).transpose("harmonic", "channel")
            np.testing.assert_allclose(found, levels, atol=6e-5)


def test_lines_that_cannot_be_told_apart_have_the_simplest_name():
    """A box's 0.3 s: lines of 3.3 Hz hold a slow shaft's sidebands, and harmonics of one mesh beside another's."""
    known = {
        "2 x GMF of stage 2": 261.22, "2 x GMF of stage 2 -1 x output": 259.3,
        "7 x GMF of stage 2": 914.28, "2 x GMF of stage 1 -1 x input": 912.67,
        "2 x GMF of stage 1": 937.3, "2 x GMF of stage 1 +1 x input": 962.0, "38 x input": 937.3,
    }  # fmt: skip
    lines = pd.DataFrame({"frequency": [260.0, 913.3, 936.7, 963.3, 500.0]})
    assert list(name_lines(lines, known, 5.0).of) == [
        "2 x GMF of stage 2", "7 x GMF of stage 2", "2 x GMF of stage 1 or 38 x input",
        "2 x GMF of stage 1 +1 x input", "",
    ]  # fmt: skip
    # resolved, the sideband has its name
    assert name_lines(lines[:1], known, 0.75).of[0] == "2 x GMF of stage 2 -1 x output"
    slipping = known | {"7 x BPFO of a": float(lines.frequency[0]) + 0.1}
    assert name_lines(lines[:1], slipping, 0.75).of[0] == "7 x BPFO of a"
    assert name_lines(lines[:1], slipping, 0.75, known).of[0] == "2 x GMF of stage 2 -1 x output"
