"""Files of loggers and recorders: MDF with several rates, cue points of WAV, tables and groups in HDF5."""

from __future__ import annotations

import gc
import struct

import h5py
import numpy as np
import pytest
from scipy.io import wavfile

from gearmbs.signals import (
    SignalFileError,
    analyse,
    phase_from_tacho,
    read_signal,
    sections,
    write_signal,
)
from gearmbs.signals.signal.signal import units_of
from tests.says import says

RATE, SECONDS = 5000.0, 2.0
TIME = np.arange(int(RATE * SECONDS)) / RATE
SHAKES = np.cos(2 * np.pi * 240.0 * TIME)


def logged(path, version="4.10", speed_unit="rpm", slow="Drehzahl"):
    """Two vibrations with one time base, a speed and a text with others, as a logger writes them."""
    asammdf = pytest.importorskip("asammdf")
    few = 0.5 + np.arange(0.0, 1.5, 0.1)
    with asammdf.MDF(version=version) as file:
        both = {"case": ("m/s^2", SHAKES), "ring": ("g", 2.0 * SHAKES)}
        file.append([asammdf.Signal(v, TIME + 0.25, unit=unit, name=name) for name, (unit, v) in both.items()])
        file.append([asammdf.Signal(900.0 + 20.0 * few, few, unit=speed_unit, name=slow)])
        file.append([asammdf.Signal(np.array([b"on", b"off"]), np.array([0.3, 0.9]), name="state", encoding="utf-8")])
        return file.save(path, overwrite=True)


@pytest.mark.parametrize(("version", "ending"), [("4.10", ".mf4"), ("4.20", ".mf4"), ("3.30", ".mdf")])
def test_mdf_has_names_units_times_and_a_slower_speed(tmp_path, version, ending):
    signal = read_signal(logged(tmp_path / f"log{ending}", version))
    assert signal["channel"].values.tolist() == ["case", "ring", "Drehzahl"]
    assert units_of(signal) == ["m/s^2", "g", "rpm"]
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    assert float(signal["time"][0]) == pytest.approx(0.25)
    np.testing.assert_allclose(signal.values[:, 1], 2.0 * SHAKES, atol=1e-12)
    inside = (signal["time"] > 0.5) & (signal["time"] < 1.9)
    np.testing.assert_allclose(signal[inside, 2], 900.0 + 20.0 * signal["time"][inside], rtol=1e-9)
    assert any("Drehzahl" in note and "interpolated" in note for note in signal.attrs["notes"])


def test_the_speed_of_an_mdf_file_is_used_and_no_vibration(tmp_path):
    report = analyse(read_signal(logged(tmp_path / "log.mf4")), 16)
    assert report.speed * 30.0 / np.pi == pytest.approx(923.0, abs=8.0)
    assert "Drehzahl" not in list(report.levels["channel"])


def test_mdf_is_told_by_content_and_channels_are_chosen(tmp_path):
    path = logged(tmp_path / "log.mf4", slow="torque", speed_unit="N m").rename(tmp_path / "log.bin")
    with pytest.raises(SignalFileError, match=says("different times", "torque (15 samples)", "channels=")):
        read_signal(path)
    assert read_signal(path, channels=["torque"]).attrs["sampling_rate"] == pytest.approx(10.0)
    assert read_signal(path, channels=["ring"]).sizes == {"time": TIME.size, "channel": 1}
    with pytest.raises(SignalFileError, match=says("no samples", "case", "torque")):
        read_signal(path, channels=["none"])


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_mdf_file_that_is_cut_short_is_named(tmp_path):
    path = logged(tmp_path / "log.mf4")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(SignalFileError, match=says("log.mf4", "mdf")):
        read_signal(path)
    # what the library leaves behind fails when it is collected
    gc.collect()


def with_cues(path, samples, labels=(), order="<"):
    """Add cue points to a WAV file, and labels to the first of them."""
    points = b"".join(
        struct.pack(order + "II4sIII", k + 1, 0, b"data", 0, 0, sample) for k, sample in enumerate(samples)
    )
    cue = struct.pack(order + "I", len(samples)) + points
    texts = b""
    for k, label in enumerate(labels):
        body = struct.pack(order + "I", k + 1) + label.encode() + b"\0"
        texts += b"labl" + struct.pack(order + "I", len(body)) + body + b"\0" * (len(body) % 2)
    chunks = b"cue " + struct.pack(order + "I", len(cue)) + cue
    chunks += b"LIST" + struct.pack(order + "I", 4 + len(texts)) + b"adtl" + texts if labels else b""
    old = path.read_bytes()
    path.write_bytes(old[:4] + struct.pack(order + "I", len(old) - 8 + len(chunks)) + old[8:] + chunks)
    return path


def test_cue_points_are_pulses_of_a_shaft(tmp_path):
    """A run-up: marks at whole turns, as a recorder sets them."""
    marks = np.rint(RATE * (np.sqrt(4.0 + 0.5 * np.arange(1, 40)) - 2.0)).astype(int)
    wavfile.write(tmp_path / "run.wav", int(RATE), SHAKES.astype(np.float32))
    path = with_cues(tmp_path / "run.wav", marks)
    signal = read_signal(path)
    assert signal["channel"].values.tolist() == ["ch1", "cue tacho"]
    phase = phase_from_tacho(signal, "cue tacho")
    at = phase["time"].values
    exact = 2 * np.pi * (((at + 2.0) ** 2 - 4.0) / 0.5 - 1.0)
    np.testing.assert_allclose(phase, exact, atol=0.05)
    assert "cue tacho" not in list(analyse(signal, speed="1200 rpm").levels["channel"])
    pieces = np.concatenate([piece.values for piece in sections(path, 0.3)])
    np.testing.assert_array_equal(pieces, signal.values[: len(pieces)])


def test_few_cue_points_are_marks_with_labels(tmp_path):
    wavfile.write(tmp_path / "two.wav", int(RATE), SHAKES.astype(np.float32))
    signal = read_signal(with_cues(tmp_path / "two.wav", [500, 2500, 10**6], ["start", "noise"]))
    assert signal["channel"].values.tolist() == ["ch1"]
    assert signal.attrs["cue"] == [{"time": 0.1, "label": "start"}, {"time": 0.5, "label": "noise"}]
    again = read_signal(write_signal(signal, tmp_path / "again.wav"))
    assert again.attrs["cue"] == signal.attrs["cue"]


def test_cue_points_stand_beside_this_packages_own_comment(tmp_path):
    path = write_signal(read_signal(with_cues(_plain(tmp_path), [100, 200, 300])), tmp_path / "own.wav")
    assert read_signal(path)["channel"].values.tolist() == ["ch1", "cue tacho"]
    more = read_signal(with_cues(write_signal(read_signal(_plain(tmp_path)), tmp_path / "more.wav"), [10, 20, 30]))
    assert more.values[:31, 1].nonzero()[0].tolist() == [*range(10, 15), *range(20, 25), 30]


def _plain(folder):
    wavfile.write(folder / "plain.wav", int(RATE), SHAKES.astype(np.float32))
    return folder / "plain.wav"


@pytest.mark.parametrize("layout", ["fields", "channel by row", "groups"])
def test_channels_in_tables_and_groups_of_hdf5(tmp_path, layout):
    """A table with named fields, one with a row for each channel and time, and a group for each channel."""
    both = {"1": SHAKES, "2": 2.0 * SHAKES}
    with h5py.File(tmp_path / "log.h5", "w") as file:
        if layout == "fields":
            kinds = [("time", "f8"), ("case_1", "f4"), ("case_2", "f4")]
            file["data"] = np.array(list(zip(TIME, *both.values(), strict=True)), dtype=kinds)
        elif layout == "channel by row":
            table = np.zeros(2 * TIME.size, dtype=[("channel", "i4"), ("time", "f8"), ("case", "f8")])
            table["channel"], table["time"] = np.tile([1, 2], TIME.size), np.repeat(TIME, 2)
            table["case"] = np.column_stack(list(both.values())).ravel()
            file["data"] = table
        else:
            for number, values in both.items():
                group = file.create_group(f"channels/case_{number}")
                group.attrs.update({"SampleRate": RATE, "Unit": "m/s^2"})
                group["Data"] = values
    signal = read_signal(tmp_path / "log.h5")
    assert signal["channel"].values.tolist() == ["case_1", "case_2"]
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    np.testing.assert_allclose(signal.values[:, 1], 2.0 * SHAKES, atol=1e-6)
    assert units_of(signal) == ["m/s^2" if layout == "groups" else "unknown"] * 2
