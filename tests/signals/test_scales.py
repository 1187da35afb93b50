"""Factors beside counts, units of times beside them, and channels of times: used, or told."""

from __future__ import annotations

import re

import h5py
import numpy as np
import pytest
import scipy.io

from gearmbs.signals import SignalFileError, read_signal
from tests.says import says

RATE, COUNT = 10000.0, 400
TIME = np.arange(COUNT) / RATE
A = np.cos(2 * np.pi * 500.0 * TIME)
COUNTS = np.round(1000.0 * A)


def told(signal, *words):
    return any(re.search(says(*words), note) for note in signal.attrs.get("notes", ()))


@pytest.mark.parametrize(("beside", "factor"), [
    ({"scale": 0.001}, "scale = 0.001"), ({"gain": 10.0}, "gain = 10"), ({"acc_sens": 0.1}, "acc_sens = 0.1"),
    ({"sensitivity": "100 mV/g"}, "sensitivity = 100 mV/g"), ({"scale_factor": 0.5}, "scale_factor = 0.5"),
])  # fmt: skip
@pytest.mark.parametrize("kind", ["i2", "f8"])
def test_counts_beside_a_factor_are_told_in_files_of_arrays(beside, factor, kind, tmp_path):
    """Also whole numbers that the file holds as doubles, in MATLAB and numpy, at the top and in a struct."""
    arrays = {"acc": COUNTS.astype(kind), "Fs": RATE, **beside}
    scipy.io.savemat(tmp_path / "a.mat", arrays)
    scipy.io.savemat(tmp_path / "s.mat", {"run": arrays})
    np.savez(tmp_path / "a.npz", **arrays)
    for name in ("a.mat", "s.mat", "a.npz"):
        signal = read_signal(tmp_path / name)
        assert signal.attrs["sampling_rate"] == RATE
        np.testing.assert_array_equal(signal.values[:, 0], COUNTS)
        if name != "s.mat":
            assert told(signal, "CHECK THE SCALE", "acc", factor, "units=...")
        else:
            assert told(signal, "CHECK THE SCALE", f"run.{factor}")


@pytest.mark.parametrize("beside", [{}, {"scale": 1.0}, {"offset": 0.0}, {"other_sens": 0.1}, {"vertical_scale": 0.2}])
def test_nothing_is_said_where_no_factor_is_meant(beside, tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"acc": COUNTS.astype("i2"), "Fs": RATE, **beside})
    assert not told(read_signal(tmp_path / "a.mat"), "CHECK THE SCALE")
    scipy.io.savemat(tmp_path / "f.mat", {"acc": A, "Fs": RATE, "scale": 0.001})
    assert not told(read_signal(tmp_path / "f.mat"), "CHECK THE SCALE")


def text(path, head, values):
    path.write_text("\n".join([*head, *(f"{value:.6g}" for value in values)]) + "\n", encoding="utf-8")
    return read_signal(path)


def test_counts_and_volts_beside_a_factor_are_told_in_text(tmp_path):
    rate = "Sample rate: 10000 Hz"
    signal = text(tmp_path / "a.csv", ["Scale: 0.001 g/count", rate, "ch1"], COUNTS)
    assert told(signal, "CHECK THE SCALE", "ch1", "Scale = 0.001 g/count")
    assert told(text(tmp_path / "b.csv", ["# sensitivity = 100 mV/g", f"# {rate}", "vib [mV]"], 0.1 * A), "vib", "mV")
    both = ["# Sensitivity CH1: 100 mV/g", "# Sensitivity CH2: 10 mV/g", f"# {rate}", "CH1 [mV]"]
    alone = text(tmp_path / "s.csv", both, 0.1 * A)
    assert told(alone, "CHECK THE SCALE", "Sensitivity CH1 = 100 mV/g")
    assert not told(alone, "CH2")
    assert told(text(tmp_path / "c.csv", ["Skalierung: 0.001", rate, "a"], COUNTS), "Skalierung")
    assert not told(text(tmp_path / "d.csv", ["Scale: 0.001 g/count", rate, "a [g]"], A), "CHECK THE SCALE")
    assert not told(text(tmp_path / "e.csv", ["Vertical Scale: 0.2", rate, "a"], COUNTS), "CHECK THE SCALE")


@pytest.mark.parametrize("key", ["TimeUnit", "time_unit", "tUnit", "Time_Units", "XUnit"])
def test_the_unit_of_times_beside_them_is_used(key, tmp_path):
    held = {"Time": 1e3 * TIME, "acc": A, key: "ms"}
    scipy.io.savemat(tmp_path / "a.mat", {"S": held})
    scipy.io.savemat(tmp_path / "b.mat", held)
    for name in ("a.mat", "b.mat"):
        signal = read_signal(tmp_path / name)
        assert (signal.attrs["sampling_rate"], signal.sizes["channel"]) == (pytest.approx(RATE), 1)


def test_the_unit_of_a_struct_is_that_of_its_samples_and_not_of_its_times(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"S": {"time": TIME, "acc": A, "unit": "g"}})
    signal = read_signal(tmp_path / "a.mat")
    assert signal["channel"].values.tolist() == ["S.acc"]
    assert (signal.attrs["units"], signal.attrs["sampling_rate"]) == ("g", pytest.approx(RATE))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["acc"], file["time"] = A, 1e3 * TIME
        file["time"].attrs["units"] = "ms"
    assert read_signal(tmp_path / "a.h5").attrs["sampling_rate"] == pytest.approx(RATE)


def tdms(path, *groups):
    nptdms = pytest.importorskip("nptdms")
    channels = [
        nptdms.ChannelObject(group, name, values, properties=told)
        for group, held in groups
        for name, values, told in held
    ]
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment(channels)


MS = {"unit_string": "ms"}
STAMPS = np.datetime64("2024-03-12T10:00:00", "us") + np.round(1e6 * TIME).astype("timedelta64[us]")


@pytest.mark.parametrize(("name", "values", "unit"), [
    ("Time", TIME, {}), ("Time", 1e3 * TIME, MS), ("time_ms", 1e3 * TIME, {}), ("Zeit", TIME, {}),
    ("Stamps", STAMPS, {}),
])  # fmt: skip
def test_a_channel_of_times_in_tdms_gives_the_rate(name, values, unit, tmp_path):
    tdms(tmp_path / "t.tdms", ("Log", [(name, values, unit), ("acc", A, {"unit_string": "g"})]))
    signal = read_signal(tmp_path / "t.tdms")
    assert signal["channel"].values.tolist() == ["acc"]
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    np.testing.assert_allclose(signal.values[:, 0], A)
    with pytest.raises(SignalFileError, match=says("10000", "5000")):
        read_signal(tmp_path / "t.tdms", rate=5000.0)


def test_groups_of_tdms_with_times_of_their_own_are_refused_and_read_one_by_one(tmp_path):
    groups = [("A", [("Time", TIME, {}), ("a", A, {})]), ("B", [("Time", 2.0 * TIME, {}), ("b", A, {})])]
    tdms(tmp_path / "t.tdms", *groups)
    with pytest.raises(SignalFileError, match=says("a 10000 Hz", "b 5000 Hz", "--channel")):
        read_signal(tmp_path / "t.tdms")
    assert read_signal(tmp_path / "t.tdms", channels=["b"]).attrs["sampling_rate"] == pytest.approx(RATE / 2)
    later = [groups[0], ("B", [("Time", 0.5 + TIME, {}), ("b", A, {})])]
    tdms(tmp_path / "l.tdms", *later)
    with pytest.raises(SignalFileError, match=says("a at 0 s", "b at 0.5 s")):
        read_signal(tmp_path / "l.tdms")
    assert float(read_signal(tmp_path / "l.tdms", channels=["b"])["time"][0]) == pytest.approx(0.5)


def test_times_of_tdms_that_contradict_the_waveform_are_asked_for(tmp_path):
    tdms(tmp_path / "t.tdms", ("A", [("Time", TIME, {}), ("a", A, {"wf_increment": 2e-4})]))
    with pytest.raises(SignalFileError, match=says("10000", "5000", "--rate")):
        read_signal(tmp_path / "t.tdms")
    assert read_signal(tmp_path / "t.tdms", rate=RATE).attrs["sampling_rate"] == RATE
