"""Trains of pulses: numbered and mended, in and out of files, and what one shaft says alone."""

import math

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.signals import (
    MissingMetadataError,
    SignalError,
    SignalFileError,
    angle_of_pulses,
    encoder,
    encoder_marks,
    instantaneous_speed,
    make_signal,
    mark_errors,
    order_spectrum,
    pulse_train,
    read_pulses,
    shaft_angles,
    torsional_vibration,
    write_pulses,
    write_signal,
)
from tests.generators import seed
from tests.says import says
from tests.signals.encoders.bench import Discs, angle, coupled, free


def steady(turns=6.0, speed=50.0, rate=20e3):
    times = np.arange(round(turns * math.tau / speed * rate)) / rate
    return angle(speed * times, times)


@pytest.mark.parametrize("lines", [1, 4, 60, 1024])
def test_pulses_come_when_the_marks_pass(lines):
    train = encoder(steady(), lines, mounted=0.2, index=True)
    off = train.times * 50.0 - 0.2 - math.tau / lines * train.numbers
    assert np.allclose(off, math.tau * round(off[0] / math.tau), atol=1e-9)
    assert math.isclose(train.mean_speed, 50.0, rel_tol=1e-9)
    assert train.referenced
    assert not encoder(steady(), lines).referenced


@pytest.mark.parametrize("lines", [60, 1024])
def test_lost_and_doubled_pulses_are_mended_and_told(lines):
    rng = np.random.default_rng(seed(7) + lines)
    lost, doubled = (int(p) for p in rng.choice(np.arange(20, 4 * lines, 7), 2, replace=False))
    sound = encoder(steady(), lines, index=True)
    mended = encoder(steady(), lines, index=True, lost=[lost], doubled=[doubled])
    assert mended.times.size == sound.times.size - 1
    assert np.isin(mended.numbers, sound.numbers).all()
    assert np.allclose(mended.times, np.interp(mended.numbers, sound.numbers, sound.times), atol=1e-12)
    assert [w for w in ("missing", "too many") if any(w in note for note in mended.notes)] == ["missing", "too many"]
    with pytest.raises(SignalError, match=says("faults", "missing", "mend")):
        pulse_train(np.delete(sound.times, lost), lines, faults="refuse")


@pytest.mark.parametrize("lost", [98, 99, 100, 101, 198, 199])
def test_a_pulse_lost_a_turn_after_a_missing_mark_is_no_uneven_mark(lost):
    """Of a disc that lacks one of 100 marks an interval 100 pulses after the gap is doubled by chance, by no wheel."""
    angles = steady(turns=8.0)
    sound, mended = (encoder(angles, 100, lacking=[0], lost=gone) for gone in ([], [lost]))
    assert mended.referenced
    # pulses between two gaps are left out
    assert sound.times.size - mended.times.size in (1, 2, 3)
    assert np.array_equal(mended.times, sound.times[np.isin(sound.numbers, mended.numbers)])


def test_a_mark_that_the_disc_lacks_numbers_the_others():
    whole, lacking = encoder(steady(), 60, index=True), encoder(steady(), 60, lacking=[0])
    assert lacking.referenced
    assert set(lacking.numbers % 60) == set(range(1, 60))
    assert np.allclose(lacking.times, np.interp(lacking.numbers, whole.numbers, whole.times))
    assert "lacks 1 of 60" in lacking.notes[0]


@pytest.mark.parametrize(("whole", "lacking"), [(60, [10, 11]), (60, [59]), (36, [7, 8, 25, 26])])
def test_the_teeth_of_a_trigger_wheel_with_gaps_are_no_lines(whole, lacking):
    """Whoever counts them counts 58 of a wheel of 60-2: a gap of three pitches would be 3.8 deg at order 1."""
    train = encoder(steady(12.0), whole, lacking=lacking)
    counted = whole - len(lacking)
    with pytest.raises(SignalError, match=says("lines", str(counted), f"lines={whole}", "keep")):
        pulse_train(train.times, counted)
    assert pulse_train(train.times, counted, faults="keep").lines == counted
    assert pulse_train(train.times, whole).lines == whole


def test_wide_marks_of_no_whole_number_of_pitches_are_the_disc_s_own():
    """Marks of 2.5 pitches, as of a joint, and discs of few marks are taken as they are told."""
    wide = np.concatenate((np.arange(40.0), [41.5]))
    for places in (wide / 43.0, np.array([0.0, 1.0, 3.0]) / 4.0):
        turns = (np.arange(12)[:, None] + places).ravel()
        assert not pulse_train(0.04 * turns, places.size).notes


def test_uneven_reflectors_are_taken_as_they_are():
    uneven = np.array([0.0, 0.25, -0.1, 0.3])
    train = encoder(steady(40.0), 4, marks=uneven, index=True)
    assert not train.notes
    found = encoder_marks(train)
    assert np.allclose(found.errors, uneven - uneven.mean(), atol=2e-3)


def test_marks_of_a_free_shaft_and_its_torsional_vibration():
    discs = Discs(256, error=0.02)
    found = encoder_marks(discs.free()["driven"])
    true = discs.marks[1] - discs.marks[1].mean()
    assert np.abs(found.errors - true).max() < 5 * found.uncertainty
    assert 0.015 < found.rms < 0.025
    times = np.arange(40_000) / 20e3
    swinging = angle(60.0 * times + 1e-4 * np.cos(29 * 60.0 * times), times)
    train = discs.pulses(1, swinging)
    lines = order_spectrum(torsional_vibration(train, found), segment=8.0, window="hann")
    assert abs(float(lines.sel(order=29)[0]) / 1e-4 - 1.0) < 0.01
    bare = order_spectrum(torsional_vibration(train), segment=8.0)
    assert abs(float(bare.sel(order=29)[0]) / 1e-4 - 1.0) > 0.03
    speed = instantaneous_speed(angle_of_pulses(encoder(swinging, 1024)))
    assert abs(float(speed.max()) - (60.0 + 29 * 60e-4)) < 0.01
    with pytest.raises(SignalError, match=says("marks", "256", "1024")):
        angle_of_pulses(encoder(swinging, 1024), found)


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".csv", ".npz", ".mat", ".nc"])
def test_files_give_the_trains_back(ending, tmp_path):
    discs = Discs(64)
    trains = {"driver": discs.pulses(0, free()), "driven": discs.pulses(1, free(seconds=0.7))}
    found = read_pulses(write_pulses(trains, tmp_path / f"run{ending}"))
    assert list(found) == ["driver", "driven"]
    for name, train in trains.items():
        assert np.array_equal(found[name].times, train.times)
        assert np.array_equal((found[name].numbers - train.numbers) % 64, np.zeros(train.numbers.size))
        assert found[name].referenced


@pytest.mark.parametrize("unit", ["s", "ms", "us"])
def test_pulses_at_a_steady_speed_are_no_clock(unit, tmp_path):
    """Times that rise evenly, in one, two or three columns of text: each is a train of its own."""
    scale = {"s": 1.0, "ms": 1e3, "us": 1e6}[unit]
    even = {f"shaft {k}": 0.01 * k + np.arange(64 * 40) / (64.0 * (20.0 + k)) for k in range(3)}
    for count in (1, 2, 3):
        names = list(even)[:count]
        table = pd.DataFrame({f"{name} [{unit}]": scale * even[name] for name in names})
        table.to_csv(tmp_path / "even.csv", index=False)
        found = read_pulses(tmp_path / "even.csv", 64)
        assert list(found) == names
        for name in names:
            np.testing.assert_allclose(found[name].times, even[name], rtol=1e-12)
    assert len(read_pulses(tmp_path / "even.csv", {"shaft 1": 64})) == 1
    table.columns = list(even)
    table.to_csv(tmp_path / "bare.csv", index=False)
    np.testing.assert_allclose(read_pulses(tmp_path / "bare.csv", 64, unit=unit)["shaft 0"].times, even["shaft 0"])
    with pytest.raises(SignalError, match=says("'ms'", "'20 MHz'", "clock")):
        read_pulses(tmp_path / "bare.csv", 64, unit="ms", clock="20 MHz")


@pytest.mark.slow
def test_encoders_are_taken_by_their_names(tmp_path):
    """Of three columns two have to be named; driver and driven are taken by name, whatever their order."""
    even = {name: np.arange(64 * 60) / (64.0 * speed) for name, speed in (("driven", 15.0), ("driver", 20.0))}
    for extra in ({}, {"far end": even["driven"]}):
        table = pd.DataFrame({f"{name} [s]": column for name, column in {**even, **extra}.items()})
        table.to_csv(tmp_path / "run.csv", index=False)
        words = ["transmission-error", str(tmp_path / "run.csv"), "--teeth", "15,20", "--base-radius", "20 mm"]
        done = CliRunner().invoke(app, [*words, "--lines", "64,64"])
        assert done.exit_code == 0, done.output
        assert "Driver 1200.0 rpm" in done.output
    table.columns = ["a [s]", "b [s]", "c [s]"]
    table.to_csv(tmp_path / "run.csv", index=False)
    done = CliRunner().invoke(app, [*words, "--lines", "64,64"])
    assert done.exit_code != 0
    assert "--columns" in done.output


@pytest.mark.parametrize(("bits", "clock"), [(16, 1e6), (24, 20e6), (32, 20e6)])
def test_counters_that_overflow_are_unwrapped(bits, clock, tmp_path):
    """Counts that begin anew come back, both trains at one time; times that fall are told what to do."""
    trains = {n: encoder(steady(20.0, speed), 64, name=n, index=bits > 16) for n, speed in (("a", 50.0), ("b", 40.0))}
    columns, start = {}, 2.0**32 - 0.5 * clock if bits == 32 else 0.0
    for name, train in trains.items():
        columns[name] = train.times
        if train.referenced:
            columns[f"{name} index"] = np.interp(64.0 * np.arange(1, 19) - 0.5, train.numbers, train.times)
    counts = {f"{n} [ticks]": pd.Series(np.mod(np.floor(c * clock) + start, 2.0**bits)) for n, c in columns.items()}
    pd.DataFrame(counts).to_csv(tmp_path / "counts.csv", index=False)
    found = read_pulses(tmp_path / "counts.csv", 64, clock=clock)
    off = [found[n].times - trains[n].times for n in trains]
    assert max(map(np.ptp, off)) < 2.0 / clock
    assert abs(off[0].mean() - off[1].mean()) < 1.0 / clock
    assert all(found[n].referenced == trains[n].referenced for n in trains)
    assert all(np.all((found[n].numbers - trains[n].numbers) % 64 == 0) for n in trains if bits > 16)
    with pytest.raises(SignalError, match=says("times", "overflows", "unwrap", "clock")):
        pulse_train(np.mod(trains["a"].times, 0.3), 64)


@pytest.mark.parametrize("ending", [".uff", ".parquet"])
def test_files_that_keep_no_count_of_lines_are_not_written(ending, tmp_path):
    with pytest.raises(SignalFileError, match=says(ending, "lines", ".npz")):
        write_pulses([encoder(steady(), 64)], tmp_path / f"run{ending}")
    assert not list(tmp_path.iterdir())
    assert list(read_pulses(write_pulses([encoder(steady(), 64)], tmp_path / "run.npz"))) == ["encoder"]


def test_counts_and_voltages_are_read_as_pulses(tmp_path):
    train = encoder(steady(), 32, index=True)
    counts = pd.DataFrame({"A [ticks]": np.round(train.times * 20e6)})
    counts.to_csv(tmp_path / "counts.csv", index=False)
    found = read_pulses(tmp_path / "counts.csv", 32, clock="20 MHz")["A"]
    assert np.allclose(found.times, train.times, atol=5e-8)
    with pytest.raises(MissingMetadataError, match=says("clock", "MHz")):
        read_pulses(tmp_path / "counts.csv", 32)
    pd.DataFrame({"A": train.times * 1e3}).to_csv(tmp_path / "bare.csv", index=False)
    with pytest.raises(MissingMetadataError, match=says("unit", "A", "clock")):
        read_pulses(tmp_path / "bare.csv", 32)
    assert np.allclose(read_pulses(tmp_path / "bare.csv", 32, unit="ms")["A"].times, train.times)
    with pytest.raises(SignalError, match=says("unit", "min")):
        read_pulses(tmp_path / "bare.csv", 32, unit="min")
    with pytest.raises(MissingMetadataError, match=says("lines", "A")):
        read_pulses(tmp_path / "counts.csv", clock="20 MHz")
    with pytest.raises(SignalFileError, match=says("no column", "B")):
        read_pulses(tmp_path / "counts.csv", {"B": 32}, clock="20 MHz")
    turned = steady()
    volts = make_signal({"tacho": np.sin(32 * turned.values)}, 20e3, units="V")
    write_signal(volts, tmp_path / "volts.csv")
    sampled = read_pulses(tmp_path / "volts.csv", 32)["tacho"]
    assert np.allclose(np.diff(sampled.times), math.tau / 32 / 50.0, rtol=1e-3)


@pytest.mark.slow
def test_the_command_reads_what_virtual_encoders_write(tmp_path):
    discs = Discs(200)
    angles = coupled(lambda turned: 5e-6 * np.cos(math.tau * 29 * turned), (29, 29), 0.04, turns=10)
    run = discs.run(angles)
    write_pulses([run.driver, run.driven], tmp_path / "run.csv")
    for name, train in discs.free().items():
        write_pulses([train], tmp_path / f"{name}.csv")
    words = ["transmission-error", str(tmp_path / "run.csv"), "--teeth", "29,29", "--base-radius", "40 mm"]
    out = CliRunner().invoke(app, words)
    assert out.exit_code == 0
    assert "have the interval that marks leave" in out.output
    alone = ["--free-driver", str(tmp_path / "driver.csv"), "--free-driven", str(tmp_path / "driven.csv")]
    out = CliRunner().invoke(app, [*words, *alone, "--tables", str(tmp_path), "--figures", str(tmp_path)])
    assert out.exit_code == 0
    table = pd.read_csv(tmp_path / "mesh_harmonics.csv")
    assert abs(table["amplitude"][0] / 5e-6 - 1.0) < 0.02
    assert table["calibrated"].all()
    assert (tmp_path / "transmission_error.png").exists()
    # harmonics 4 and 5 are beyond half of 200 lines, on orders of their own; 6 and 7 fall below the mesh order
    out = CliRunner().invoke(app, [*words, *alone, "--tables", str(tmp_path), "--harmonics", "7"])
    assert out.exit_code == 0
    fine = pd.read_csv(tmp_path / "mesh_harmonics.csv")
    assert fine["harmonic"].tolist() == [1, 2, 3, 4, 5]
    assert fine["amplitude"][0] == pytest.approx(table["amplitude"][0], rel=1e-3)
    assert (fine["low"][3:] == 0.0).all()
    assert "Mesh harmonics 6, 7: the lines fold them" in out.output
    assert "--harmonics" in CliRunner().invoke(app, [*words, "--harmonics", "many"]).output
    assert "harmonics: must be a whole number" in CliRunner().invoke(app, [*words, "--harmonics", "0"]).output
    ratio = [*words[:2], "--ratio", "1", "--mesh-order", "29", "--base-radius", "40 mm"]
    assert "Mesh harmonic 1" in CliRunner().invoke(app, ratio).output
    out = CliRunner().invoke(app, [*words, "--columns", "a,b"])
    assert out.exit_code != 0
    assert "--columns" in out.output


def test_angles_of_records_with_speeds_are_their_integrals():
    times = np.arange(4000) / 8000.0
    speed = np.column_stack([100.0 + 5.0 * np.cos(700.0 * times), -np.full(times.size, 25.0)])
    record = xr.Dataset({"speed": (("time", "member"), speed)}, coords={"time": times, "member": ["sun", "carrier"]})
    sun, carrier = shaft_angles(record, "sun", "carrier")
    assert np.allclose(sun, 100.0 * times + np.sin(700.0 * times) / 140.0, atol=1e-8)
    assert np.allclose(carrier, 25.0 * times, atol=1e-10)
    with pytest.raises(SignalError, match=says("shafts", "ring", "sun")):
        shaft_angles(record, "ring")


@pytest.mark.parametrize("told", [500, 256, 1024, 513, 512])
def test_a_count_of_lines_that_index_pulses_or_missing_ones_contradict_is_refused(told):
    """Of 512 lines; the index pulses of some turns may be lost, and two missing pulses are no disc."""
    whole = encoder(steady(8.0), 512, index=True)
    once = np.interp(512.0 * np.arange(1, 7) - 0.5, whole.numbers, whole.times)
    lacking = encoder(steady(8.0), 512, lacking=[0])
    if told != 512:
        with pytest.raises(SignalError, match=says("index", "512", str(told))):
            pulse_train(whole.times, told, index=once)
        if told == 1024:
            # a disc may lack two marks that face each other
            assert not pulse_train(lacking.times, told).referenced
        else:
            with pytest.raises(SignalError, match=says("lines", "512", str(told))):
                pulse_train(lacking.times, told)
        assert pulse_train(lacking.times, told, faults="keep").lines == told
        assert pulse_train(np.delete(whole.times, [700, 1212]), told).lines == told
    else:
        assert pulse_train(whole.times, told, index=np.delete(once, [2, 4])).referenced
        assert pulse_train(lacking.times, told).referenced
        assert pulse_train(encoder(steady(8.0), 512, lacking=[0, 1, 256, 300]).times, told).lines == 512


def test_what_is_no_train_is_refused():
    times = np.arange(300) / 100.0
    with pytest.raises(SignalError, match=says("lines", "2.5")):
        pulse_train(times, 2.5)
    with pytest.raises(SignalError, match=says("times", "increase", "rising edges")):
        pulse_train(times[::-1], 60)
    with pytest.raises(SignalError, match=says("300", "1024", "record")):
        pulse_train(times, 1024)
    with pytest.raises(SignalError, match=says("faults", "guess")):
        pulse_train(times, 60, faults="guess")
    with pytest.raises(SignalError, match=says("index", "lines")):
        pulse_train(times, 60, index=[0.5, 1.3, 2.0])
    with pytest.raises(SignalError, match=says("marks", "3", "60")):
        encoder(steady(), 60, marks=np.zeros(3))
    with pytest.raises(SignalError, match=says("angle", "back")):
        encoder(angle(np.sin(times), times), 4)
    with pytest.raises(SignalError, match=says("record", "encoder")):
        shaft_angles(make_signal(times, 100.0).to_dataset(name="x"))
    assert mark_errors(1000, 0.01, 3).std() * 1000 / math.tau == pytest.approx(0.01, rel=0.1)


def test_times_that_are_no_numbers_are_named():
    times = np.arange(400) / 100.0
    with pytest.raises(SignalError, match=says("pulse 5", "finite")):
        pulse_train(np.where(np.arange(400) == 5, np.nan, times), 60)
    with pytest.raises(SignalError, match=says("times", "numbers", "['a']")):
        pulse_train(["a"], 60)
    assert pulse_train(np.delete(times, 5), 60).turns == pytest.approx(399 / 60)
