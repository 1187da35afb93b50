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
    path = logged(tmp_path / "log.mf4", slow="gauge", speed_unit="mm").rename(tmp_path / "log.bin")
    with pytest.raises(SignalFileError, match=says("ring 5000 Hz", "gauge 10 Hz", "channels=")):
        read_signal(path)
    assert read_signal(path, channels=["gauge"]).attrs["sampling_rate"] == pytest.approx(10.0)
    assert read_signal(path, channels=["ring"]).sizes == {"time": TIME.size, "channel": 1}
    with pytest.raises(SignalFileError, match=says("no samples", "case", "gauge")):
        read_signal(path, channels=["none"])


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.slow
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


def stored(path, attrs=(), **datasets):
    """Write datasets, each as values or with attributes, into an HDF5 file."""
    with h5py.File(path, "w") as file:
        for name, given in datasets.items():
            values, own = given if isinstance(given, tuple) else (given, {})
            file.create_dataset(name, data=values).attrs.update({"sampling_rate": RATE, **dict(attrs)} | own)
    return path


def test_counts_in_hdf5_are_scaled_as_netcdf_says_or_told(tmp_path):
    counts = np.round(1000.0 * SHAKES).astype(np.int16)
    scaled = read_signal(stored(tmp_path / "a.h5", acc=(counts, {"scale_factor": 1e-3, "add_offset": 2.0})))
    np.testing.assert_allclose(scaled.values[:, 0], SHAKES + 2.0, atol=5e-4)
    told = read_signal(stored(tmp_path / "b.h5", acc=(counts, {"gain": 1e-3})))
    assert any("CHECK THE SCALE" in note and "gain" in note for note in told.attrs["notes"])
    for gain in (1e-3, [1e-3, 2e-3]):
        plain = read_signal(stored(tmp_path / "c.h5", acc=(SHAKES, {"gain": gain})))
        assert "notes" not in plain.attrs
    for wrong in ("1e-3 g", [1e-3, 2e-3]):
        with pytest.raises(SignalFileError, match=says("scale_factor", "acc", "write one number")):
            read_signal(stored(tmp_path / "d.h5", acc=(counts, {"scale_factor": wrong})))


def test_columns_of_a_matrix_in_hdf5_have_the_names_and_units_that_it_lists(tmp_path):
    both = np.stack([SHAKES, 2.0 * SHAKES])
    path = stored(tmp_path / "a.h5", data=(both, {"channels": ["case", "ring"], "units": ["g", "mm/s"]}))
    signal = read_signal(path)
    assert (signal["channel"].values.tolist(), units_of(signal)) == (["case", "ring"], ["g", "mm/s"])
    np.testing.assert_array_equal(signal.values, both.T)


def test_times_in_hdf5_have_units_and_contradict_other_rates(tmp_path):
    with h5py.File(tmp_path / "ms.h5", "w") as file:
        file.create_dataset("time", data=1e3 * TIME).attrs["units"] = "ms"
        file["acc"] = SHAKES
    assert read_signal(tmp_path / "ms.h5").attrs["sampling_rate"] == pytest.approx(RATE)
    path = stored(tmp_path / "two.h5", acc=(SHAKES, {"sampling_rate": 2.0 * RATE}))
    with h5py.File(path, "a") as file:
        file["time"] = TIME
    with pytest.raises(SignalFileError, match=says("10000 Hz", "5000 Hz", "--rate")):
        read_signal(path)
    assert read_signal(path, rate=RATE).attrs["sampling_rate"] == RATE


def test_a_rate_that_the_times_of_an_mdf_file_contradict_is_refused(tmp_path):
    path = logged(tmp_path / "log.mf4")
    with pytest.raises(SignalFileError, match=says("5000 Hz", "rate=2500")):
        read_signal(path, rate=2500.0)
    assert read_signal(path, rate=RATE).attrs["sampling_rate"] == RATE


def test_samples_that_an_mdf_file_lost_are_told(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(np.delete(SHAKES, 4000), np.delete(TIME, 4000), unit="g", name="case")])
        path = file.save(tmp_path / "lost.mf4", overwrite=True)
    with pytest.raises(SignalFileError, match=says("not uniform", "rate=")):
        read_signal(path)
    assert any("0.0004 s" in note for note in read_signal(path, rate=RATE).attrs["notes"])
    with pytest.raises(SignalFileError, match=says("4999.5 Hz", "rate=2500")):
        read_signal(path, rate=2500.0)


def test_an_mdf_file_over_angles_is_no_record(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(SHAKES, TIME, unit="g", name="case")])
        file.groups[0].channels[file.masters_db[0]].sync_type = 2
        path = file.save(tmp_path / "angle.mf4", overwrite=True)
    with pytest.raises(SignalFileError, match=says("no samples over time")):
        read_signal(path)


def waveforms(path, **channels):
    nptdms = pytest.importorskip("nptdms")
    known = {"wf_increment": 1.0 / RATE, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as file:
        file.write_segment([
            nptdms.ChannelObject("g", name, SHAKES, properties=known | own) for name, own in channels.items()
        ])  # fmt: skip
    return path


@pytest.mark.parametrize("late", [{"wf_start_offset": 0.3}, {"wf_start_time": np.datetime64("2024-01-01T00:00:07")}])
def test_channels_of_tdms_begin_together(tmp_path, late):
    first = {"wf_start_time": np.datetime64("2024-01-01T00:00:00")} if "wf_start_time" in late else {}
    with pytest.raises(SignalFileError, match=says("a at 0 s", "channels=")):
        read_signal(waveforms(tmp_path / "a.tdms", a=first, b=late))
    assert read_signal(tmp_path / "a.tdms", channels=["b"]).sizes["time"] == TIME.size
    together = read_signal(waveforms(tmp_path / "b.tdms", a=late, b={"NI_UnitDescription": "m/s^2"} | late))
    assert units_of(together) == ["unknown", "m/s^2"]


def test_a_spectrum_in_tdms_is_no_record(tmp_path):
    with pytest.raises(SignalFileError, match=says("samples over time")):
        read_signal(waveforms(tmp_path / "a.tdms", a={"wf_xunit_string": "Hz"}))


def universal(path, system=None, step=1.0 / RATE, **own):
    """Write one dataset 58 as other programs do, behind a system of units."""
    pyuff = pytest.importorskip("pyuff")
    known = {
        "type": 58,
        "binary": 1,
        "id1": "case",
        "func_type": 1,
        "rsp_node": 1,
        "rsp_dir": 0,
        "ref_node": 0,
        "ref_dir": 0,
        "data": SHAKES,
        "x": step * np.arange(TIME.size),
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": 17,
        "abscissa_axis_lab": "Time",
        "abscissa_axis_units_lab": "s",
        "ordinate_spec_data_type": 12,
        "ordinate_axis_lab": "case",
        "ordinate_axis_units_lab": "NONE",
        "orddenom_spec_data_type": 0,
        "z_axis_spec_data_type": 0,
    }
    units = {
        "type": 164,
        "units_code": system,
        "units_description": "",
        "temp_mode": 1,
        "length": 1.0,
        "force": 1.0,
        "temp": 1.0,
        "temp_offset": 273.15,
    }
    path.write_bytes(b"")
    pyuff.UFF(str(path)).write_sets([*([units] if system else []), known | own], mode="add")
    return path


@pytest.mark.parametrize(
    ("system", "unit"), [(None, "m/s^2"), (1, "m/s^2"), (5, "mm/s^2"), (7, "in/s^2"), (9, "unknown")]
)
@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_samples_of_uff_are_in_the_units_of_its_system(tmp_path, system, unit):
    assert units_of(read_signal(universal(tmp_path / "a.uff", system))) == [unit]


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_the_abscissa_of_uff_has_a_unit_and_is_time(tmp_path):
    path = universal(tmp_path / "a.uff", step=1e3 / RATE, abscissa_axis_units_lab="ms")
    assert read_signal(path).attrs["sampling_rate"] == pytest.approx(RATE)
    other = universal(tmp_path / "b.uff", abscissa_spec_data_type=18, abscissa_axis_units_lab="Hz")
    # a function of the general type, which older writers do not know: the first number of the sixth record behind 58
    lines = other.read_bytes().split(b"\n")
    place = 6 + next(k for k, line in enumerate(lines) if line.startswith(b"    58"))
    assert lines[place].startswith(b"    1 ")
    lines[place] = b"    0" + lines[place][5:]
    other.write_bytes(b"\n".join(lines))
    with pytest.raises(SignalFileError, match=says("no time history")):
        read_signal(other)
