"""Samples that are none, as instruments and loggers write them, and numbers of heads with points of thousands."""

import h5py
import numpy as np
import pytest

from gearmbs.signals import SignalError, SignalFileError, analyse, make_signal, read_signal, to_signal
from tests.generators import seed
from tests.says import says

RATE = 2560.0
TIME = np.arange(2560) / RATE
A = 2.0 * np.cos(2 * np.pi * 200.0 * TIME) + 0.1 * np.random.default_rng(seed(2)).standard_normal(TIME.size)


def table(path, cell, row=900):
    rows = [f"{t:.7f},{a:.4f}" for t, a in zip(TIME, A)]
    rows[row] = f"{TIME[row]:.7f},{cell}"
    path.write_text("time [s],a [g]\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("cell", ["9.91E+37", "9.9E+37", "-9.9e37", "inf"])
def test_what_instruments_write_for_no_number_is_a_gap(cell, tmp_path):
    """One such sample makes the RMS 1e35 times as large."""
    path = table(tmp_path / "a.csv", cell)
    with pytest.raises(SignalFileError, match=says("line 902", cell, "--gaps")):
        read_signal(path)
    filled = read_signal(path, gaps="interpolate")
    assert float(np.std(filled)) == pytest.approx(np.std(A), rel=0.01)
    values = A.copy()
    values[3] = float(cell)
    with pytest.raises(SignalError, match=says("row 3", "--gaps")):
        to_signal(values, rate=RATE)
    assert to_signal(np.where(A == A[3], 1e38, A), rate=RATE).max() == 1e38


@pytest.mark.parametrize("value", [-9999.0, 32767.0, -999.25])
def test_a_sample_far_off_all_others_is_named(value, tmp_path):
    said = " ".join(analyse(table(tmp_path / "a.csv", f"{value:g}"), lines=1).notes)
    assert "CHECK THE RECORD" in said
    assert "sample 901" in said
    assert "--gaps interpolate" in said


def test_shocks_and_silence_are_no_such_sample():
    ringing = A * 0.01
    ringing[900:960] += 500.0 * np.exp(-0.1 * np.arange(60)) * np.cos(np.arange(60))
    silence = np.where(np.arange(A.size) == 900, 5.0, 0.0)
    for values in (A, ringing, silence):
        notes = analyse(make_signal({"a": values}, RATE, units="g"), lines=1).notes
        assert not any("CHECK THE RECORD" in note for note in notes)


@pytest.mark.parametrize(
    ("head", "rate", "rpm"),
    [
        ("Abtastrate: 25.600 Hz\n", 25600.0, None),
        ("Abtastrate [Hz];25.600\nDrehzahl [1/min];1.500\n", 25600.0, 1500.0),
        ("fs = 25600\nDrehzahl: 1.500 U/min\n", 25600.0, 1500.0),
        ("fs = 25,6 kHz\nDrehzahl: 1500,5 U/min\n", 25600.0, 1500.5),
        ("Software version: 3.14\nAbtastrate: 25.600 Hz\nFaktor: 1.234\n", 25600.0, None),
        # a prefix, another unit, another decimal point of the head, or what no shaft turns at
        ("fs = 51.200 kHz\n", 51200.0, None),
        ("dt = 1.000 ms\n", 1000.0, None),
        ("fs = 25600\nDrehzahl: 24.985 1/s\n", 25600.0, 24.985 * 60.0),
        ("gain: 0.25\nfs = 25600\nspeed: 25.125 rpm\n", 25600.0, 25.125),
        ("fs = 25600\nDrehzahl: 999.850 rpm\n", 25600.0, 999.85),
    ],
)
def test_points_of_thousands_in_heads_above_decimal_commas(head, rate, rpm, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(head + "a [g]\n" + "\n".join(f"{a:.4f}".replace(".", ",") for a in A) + "\n", encoding="utf-8")
    signal = read_signal(path)
    assert signal.attrs["sampling_rate"] == rate
    assert signal.attrs.get("speed") == (None if rpm is None else pytest.approx(rpm * np.pi / 30.0))
    assert any("thousands" in note for note in signal.attrs.get("notes", ())) == (".6" in head or ".5" in head)


def test_a_matrix_with_its_rate_beside_a_slow_speed_with_another(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        fast = file.create_dataset("Measurement/Fast/data", data=np.stack([A, 2 * A], axis=1))
        fast.attrs["SampleRate"], fast.attrs["ChannelNames"] = RATE, ["acc1", "acc2"]
        slow = file.create_dataset("Measurement/Slow/rpm", data=1500.0 + np.arange(10.0))
        slow.attrs["SampleRate"], slow.attrs["Unit"] = 10.0, "rpm"
    signal = read_signal(path)
    assert signal.attrs["sampling_rate"] == RATE
    assert signal["channel"].values.tolist() == ["acc1", "acc2", "rpm"]
    assert float(signal.sel(channel="rpm")[256]) == pytest.approx(1501.0, abs=0.01)
    assert read_signal(path, channels=["acc2"]).shape == (A.size, 1)
