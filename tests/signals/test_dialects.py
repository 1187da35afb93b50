"""Files as other programs write them: small ones made up here, read right or asked about in one line."""

import io
import json
import warnings

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io

from gearmbs.signals import (
    FORMATS,
    MissingMetadataError,
    SignalError,
    SignalFileError,
    analyse,
    diagnose_bearing,
    make_signal,
    read_signal,
    sections,
    to_signal,
    units_of,
    write_signal,
)
from gearmbs.signals.signal.labels import name_and_unit, role_of
from gearmbs.signals.signal.units import unit_dimension
from tests.says import says

RATE = 12800.0
COUNT = 64
X = np.round(np.sin(np.arange(COUNT) * 0.7), 6)
Y = np.round(np.cos(np.arange(COUNT) * 0.3), 6)


def written(folder, text, name="x.csv", encoding="utf-8"):
    path = folder / name
    path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
    return path


def rows(*columns, sign=",", form="{}"):
    return "\n".join(
        sign.join(form.format(v) if isinstance(v, float) else str(v) for v in row) for row in zip(*columns)
    )


def assert_is(signal, *columns, rate=RATE):
    np.testing.assert_allclose(signal.values, np.stack(columns, axis=1), atol=1e-12)
    assert signal.attrs["sampling_rate"] == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize(
    "line",
    [
        "# fs: 12800", "Sampling Frequency:,12800", "Sampling Frequency\t12800 Hz", "SampFreq=12800", "SR;12800",
        "sample rate [kHz]: 12.8", "Sample Rate: 12.8 kHz", "XInc: 7.8125e-05", "dt = 0.078125 ms",
        "Delta_X,78.125e-6,s",
        '"Abtastrate";"12800 Hz"', "Samples per second,12800", "Sampling rate: 12800,12800",
        "Sampling Frequency: 12,800",
    ],
)  # fmt: skip
def test_names_of_the_rate_above_a_table(tmp_path, line):
    path = written(tmp_path, f"Recorder 7\nOperator: N. N.\n{line}\n\na,b\n{rows(X, Y)}\n")
    assert_is(read_signal(path), X, Y)


@pytest.mark.parametrize(
    "name", ["rate", "sr", "fs", "Fs", "SampFreq", "sampling_rate", "SampleRate", "XInc", "dt", "Tinterval"]
)
@pytest.mark.parametrize("form", ["flat", "struct", "hdf5", "npz"])
def test_names_of_the_rate_in_binary_files(tmp_path, name, form):
    value = 1 / RATE if name in ("XInc", "dt", "Tinterval") else RATE
    if form == "flat":
        path = tmp_path / "x.mat"
        scipy.io.savemat(path, {"acc": X, name: value})
    elif form == "struct":
        path = tmp_path / "x.mat"
        scipy.io.savemat(path, {"run": {"acc": X, name: value, "load": 3.0}})
    elif form == "npz":
        path = tmp_path / "x.npz"
        np.savez(path, acc=X, **{name: value})
    else:
        path = tmp_path / "x.h5"
        with h5py.File(path, "w") as file:
            file.create_group("run").create_dataset("acc", data=X).attrs[name] = value
    assert_is(read_signal(path), X)


def test_shaft_rate_beside_a_sampling_rate(tmp_path):
    """As in the files of a society for failure prevention: sr is the sampling rate, rate the shaft's."""
    path = tmp_path / "x.mat"
    scipy.io.savemat(path, {"bearing": {"sr": 48828.0, "gs": X, "load": 270.0, "rate": 25.0}})
    signal = read_signal(path)
    assert_is(signal, X, rate=48828.0)
    assert signal["channel"].values.tolist() == ["bearing.gs"]
    assert "speed='25 Hz'" in signal.attrs["notes"][0]
    assert read_signal(path, rate=48828.0).attrs["sampling_rate"] == 48828.0
    scipy.io.savemat(path, {"bearing": {"gs": X, "load": 270.0, "rate": 25.0}})
    assert read_signal(path, rate="48.828 kHz").attrs["sampling_rate"] == 48828.0


def test_a_bearing_asks_for_the_speed_with_what_the_file_holds(tmp_path):
    path = tmp_path / "shaft.mat"
    scipy.io.savemat(path, {"bearing": {"sr": 48828.0, "gs": X[:, None], "rate": 25.0}})
    with pytest.raises(SignalError, match=says("bearing.rate = 25", "speed='25 Hz'")) as caught:
        diagnose_bearing(path, "6205")
    assert len(str(caught.value).splitlines()) == 1


def test_two_rates_that_disagree_are_asked_about_in_one_line(tmp_path):
    path = tmp_path / "x.mat"
    scipy.io.savemat(path, {"acc": X, "fs": RATE, "SampFreq": 25600.0})
    with pytest.raises(
        SignalFileError, match=r"fs = 12800 Hz and SampFreq = 25600 Hz; say which: rate=\.\.\."
    ) as caught:
        read_signal(path)
    assert "\n" not in str(caught.value)
    assert_is(read_signal(path, rate=25600.0), X, rate=25600.0)
    text = written(tmp_path, f"Fs: 6400\ntime,a\n{rows(np.arange(COUNT) / RATE, X)}\n")
    with pytest.raises(SignalFileError, match=says("Fs = 6400 Hz", "12800 Hz", "column of times")):
        read_signal(text)
    assert_is(read_signal(text, rate=RATE), X)


def test_rates_of_each_channel(tmp_path):
    path = tmp_path / "x.mat"
    scipy.io.savemat(path, {"a": {"data": X, "fs": RATE}, "b": {"data": Y, "fs": 6400.0}})
    with pytest.raises(SignalFileError, match=says("a.data 12800 Hz", "b.data 6400 Hz", "choose")):
        read_signal(path)
    assert_is(read_signal(path, channels=["b.data"]), Y, rate=6400.0)
    header = {"Channel_1_Header": {"SampleFrequency": RATE, "Unit": "g"}, "Channel_1_Data": X}
    scipy.io.savemat(path, header)
    assert_is(read_signal(path), X)


def test_speed_of_a_header(tmp_path):
    path = tmp_path / "x.mat"
    scipy.io.savemat(path, {"X097_DE_time": X, "X097_FE_time": Y, "X097RPM": 1796.0})
    with pytest.raises(MissingMetadataError, match="rate is missing"):
        read_signal(path)
    signal = read_signal(path, rate=12000)
    assert signal.attrs["speed"] == pytest.approx(1796 * np.pi / 30)
    assert signal.attrs["notes"] == ["The speed, 1796 rpm, is the file's X097RPM."]
    assert read_signal(path, rate=12000, speed="20 Hz").attrs["speed"] == pytest.approx(40 * np.pi)
    text = written(tmp_path, f"Fs: 12800\nSpeed: 1500\na,b\n{rows(X, Y)}\n")
    assert "speed" not in read_signal(text).attrs
    assert "pass speed='1500 rpm'" in read_signal(text).attrs["notes"][0]
    assert read_signal(written(tmp_path, f"Fs: 12800\nDrehzahl: 1500 U/min\na\n{rows(X)}\n")).attrs["speed"] > 157


STAMPED = pd.date_range("2024-02-28 23:59:59.998", periods=COUNT, freq="78125ns")


@pytest.mark.parametrize(
    "stamps",
    [
        [t.isoformat(timespec="nanoseconds") for t in STAMPED],
        [t.isoformat(sep=" ", timespec="nanoseconds") for t in STAMPED],
        [t.isoformat(timespec="nanoseconds") + "Z" for t in STAMPED],
        [t.isoformat(timespec="nanoseconds") + "+02:00" for t in STAMPED],
        [t.strftime("%Y/%m/%d,%H:%M:%S.") + f"{t.nanosecond + 1000 * t.microsecond:09d}" for t in STAMPED],
        [t.strftime("%d.%m.%Y %H:%M:%S.") + f"{t.nanosecond + 1000 * t.microsecond:09d}" for t in STAMPED],
        [t.strftime("%H:%M:%S.") + f"{t.nanosecond + 1000 * t.microsecond:09d}" for t in STAMPED],
        [
            f"1 days 00:00:{t.second:02d}.{t.microsecond:06d}{t.nanosecond:03d}"
            for t in pd.date_range("1970-01-01", periods=COUNT, freq="78125ns")
        ],
        [f"{t.value / 1e9:.9f}" for t in pd.date_range("1970-01-01", periods=COUNT, freq="78125ns")],
    ],
)
def test_time_stamps(tmp_path, stamps):
    head = "date,time,a" if "," in stamps[0] else "timestamp,a"
    assert_is(read_signal(written(tmp_path, f"{head}\n{rows(stamps, X)}\n")), X)


def test_stamps_rounded_to_milliseconds_need_the_rate(tmp_path):
    stamps = [t.isoformat(timespec="milliseconds") for t in pd.date_range("2024-01-01", periods=1280, freq="78125ns")]
    path = written(tmp_path, f"time;a\n{rows(stamps, np.arange(1280.0), sign=';')}\n")
    with pytest.raises(SignalFileError, match=says("x.csv", "12.2 steps", "pass rate=")):
        read_signal(path)
    assert read_signal(path, rate=RATE).sizes["time"] == 1280
    assert read_signal(written(tmp_path, "Fs: 12800\n" + path.read_text())).attrs["sampling_rate"] == RATE


@pytest.mark.parametrize(
    ("unit", "factor", "name"),
    [("ms", 1e3, "time [ms]"), ("us", 1e6, "t_us"), ("s", 1.0, "Time (s)"), ("ms", 1e3, "Zeit_ms")],
)
def test_units_of_times(tmp_path, unit, factor, name):
    path = written(tmp_path, f"{name},a\n{rows((np.arange(COUNT) / RATE * factor).tolist(), X)}\n")
    assert_is(read_signal(path), X)


def test_index_column_of_pandas(tmp_path):
    frame = pd.DataFrame({"a [g]": X, "b [g]": Y})
    frame.to_csv(tmp_path / "x.csv")
    signal = read_signal(tmp_path / "x.csv", rate=RATE)
    assert_is(signal, X, Y)
    assert units_of(signal) == ["g", "g"]
    assert "only numbers the rows" in signal.attrs["notes"][0]
    frame.index = np.arange(COUNT) / RATE
    frame.to_csv(tmp_path / "x.csv")
    signal = read_signal(tmp_path / "x.csv")
    assert_is(signal, X, Y)
    assert "taken for the time in s" in signal.attrs["notes"][0]
    frame.index = STAMPED
    frame.to_csv(tmp_path / "x.csv")
    assert_is(read_signal(tmp_path / "x.csv"), X, Y)


def test_gaps(tmp_path):
    holes = [str(v) for v in X]
    holes[10], holes[11], holes[40] = "", "NaN", ""
    path = written(tmp_path, f"a,b\n{rows(holes, Y)}\n")
    with pytest.raises(SignalFileError, match=says("12", "'a'", "'interpolate'", "pass gaps=")):
        read_signal(path, rate=RATE)
    filled = read_signal(path, rate=RATE, gaps="interpolate")
    expected = X.copy()
    expected[[10, 11, 40]] = [X[9] + (X[12] - X[9]) / 3, X[9] + 2 * (X[12] - X[9]) / 3, (X[39] + X[41]) / 2]
    assert_is(filled, expected, Y)
    assert "3 of 64 rows had gaps" in filled.attrs["notes"][0]
    assert "the longest gap is 2 samples" in filled.attrs["notes"][0]
    longest = read_signal(path, rate=RATE, gaps="longest")
    assert_is(longest, X[12:40], Y[12:40])
    assert float(longest["time"][0]) == pytest.approx(12 / RATE)
    assert sum(part.sizes["time"] for part in sections(path, 0.001, rate=RATE, gaps="interpolate")) >= COUNT - 6
    with pytest.raises(SignalError, match=r"gaps: .*one of"):
        read_signal(path, rate=RATE, gaps="ignore")


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_encodings_and_marks(tmp_path, encoding):
    path = written(tmp_path, f"Gerät: 1\nfs: 12800\nµ-Weg [µm],b\n{rows(X, Y)}\n", encoding=encoding)
    signal = read_signal(path)
    assert_is(signal, X, Y)
    assert signal["channel"].values[0] == "µ-Weg"
    assert units_of(signal)[0] == "µm"


def test_header_in_another_separator_than_the_table(tmp_path):
    body = rows(X.tolist(), Y.tolist(), sign="\t")
    path = written(tmp_path, f"Title:,run 1\nSampling Frequency:,12800\nPoints:,64\na\tb\n{body}\n", "x.txt")
    signal = read_signal(path)
    assert_is(signal, X, Y)
    assert signal["channel"].values.tolist() == ["a", "b"]


def test_trailing_separators_and_unknown_endings(tmp_path):
    assert_is(read_signal(written(tmp_path, "a,b,\n" + rows(X, Y, [""] * COUNT)), rate=RATE), X, Y)
    # snapshots of a well-known run to failure are named by their date
    path = written(tmp_path, rows(X.tolist(), Y.tolist(), sign="\t"), "2004.02.12.10.32.39")
    assert_is(read_signal(path, rate=RATE), X, Y)


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t{decimal}
Multi_Headings\tYes
X_Columns\t{columns}
Time_Pref\tRelative
Date\t2024/01/01
Time\t12:00:00
***End_of_Header***\t
"""
SEGMENT = """\t
Channels\t2\t\t
Samples\t{count}\t{count}\t
Y_Unit_Label\tVolts\tg\t
X_Dimension\tTime\tTime\t
X0\t0.0E+0\t0.0E+0\t
Delta_X\t{step}\t{step}\t
***End_of_Header***\t\t\t
X_Value\tVoltage\tAcceleration\tComment
"""


@pytest.mark.parametrize(("decimal", "columns"), [(".", "No"), (",", "One")])
def test_labview_measurements(tmp_path, decimal, columns):
    first = [""] * COUNT if columns == "No" else (np.arange(COUNT) / RATE).tolist()
    body = rows(first, X.tolist(), Y.tolist(), sign="\t").replace(".", decimal) + "\n"
    head = LVM.format(decimal=decimal, columns=columns)
    part = SEGMENT.format(count=COUNT, step="7.8125E-5".replace(".", decimal)) + body
    for name in ("x.lvm", "x.txt"):
        signal = read_signal(written(tmp_path, head + part, name))
        assert_is(signal, X, Y)
        assert signal["channel"].values.tolist() == ["Voltage", "Acceleration"]
        assert units_of(signal) == ["Volts", "g"]
    two = read_signal(written(tmp_path, head + part + part, "x.lvm"))
    assert_is(two, np.tile(X, 2), np.tile(Y, 2))
    assert "2 segments" in two.attrs["notes"][0]
    with pytest.raises(SignalFileError, match=says("lvm", "***End_of_Header***", "pass format='csv'")):
        read_signal(written(tmp_path, "a,b\n1,2\n", "x.lvm"))


def test_arrays_of_numpy(tmp_path):
    for name, array in {"rows": np.stack([X, Y]), "columns": np.stack([X, Y], axis=1)}.items():
        np.save(tmp_path / f"{name}.npy", array)
        signal = read_signal(tmp_path / f"{name}.npy", rate="12.8 kHz", units="g")
        assert_is(signal, X, Y)
        assert signal["channel"].values.tolist() == ["ch1", "ch2"]
    np.save(tmp_path / "f.npy", np.array(list(zip(X, Y)), dtype=[("a", "f8"), ("b", "f4")]))
    assert read_signal(tmp_path / "f.npy", rate=1.0)["channel"].values.tolist() == ["a", "b"]
    np.save(tmp_path / "o.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(SignalFileError, match="Python objects"):
        read_signal(tmp_path / "o.npy", rate=1.0)


@pytest.mark.parametrize("name", ["x.npz", "x.parquet"])
def test_written_arrays_and_tables_read_back(tmp_path, name):
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    signal = make_signal({"a": X, "b": Y}, RATE, units=["g", "V"])
    back = read_signal(write_signal(signal, tmp_path / name))
    assert_is(back, X, Y)
    assert units_of(back) == ["g", "V"]


def test_parquet_of_others(tmp_path):
    pytest.importorskip("pyarrow")
    frame = pd.DataFrame({"time": np.arange(COUNT) / RATE, "a [g]": X, "state": ["run"] * COUNT})
    frame.to_parquet(tmp_path / "x.parquet")
    signal = read_signal(tmp_path / "x.parquet")
    assert_is(signal, X)
    assert signal.attrs["notes"] == ["Left out, because they hold no numbers: state."]
    frame.to_feather(tmp_path / "x.feather")
    assert_is(read_signal(tmp_path / "x.feather"), X)
    (tmp_path / "y.parquet").write_bytes((tmp_path / "x.parquet").read_bytes()[:-20])
    with pytest.raises(SignalFileError, match=says("y.parquet", "damaged or cut")):
        read_signal(tmp_path / "y.parquet")


def test_tdms_groups(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    step = {"wf_increment": 1 / RATE}
    with nptdms.TdmsWriter(tmp_path / "x.tdms") as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("in", "acc", X, properties=step),
                nptdms.ChannelObject("out", "acc", Y, properties=step),
            ]
        )
    signal = read_signal(tmp_path / "x.tdms")
    assert signal["channel"].values.tolist() == ["in/acc", "out/acc"]
    assert_is(signal, X, Y)
    assert_is(read_signal(tmp_path / "x.tdms", channels=["out/acc"]), Y)
    with nptdms.TdmsWriter(tmp_path / "y.tdms") as writer:
        group = nptdms.GroupObject("in", properties={"SampleRate": RATE})
        writer.write_segment([group, nptdms.ChannelObject("in", "acc", X)])
    assert_is(read_signal(tmp_path / "y.tdms"), X)
    assert_is(read_signal(tmp_path / "y.tdms", channels=["in/acc"]), X)


def uff_text(values, promised=None, kind=4, width=80):
    """A universal file of one time history, its lines padded to `width`."""
    count = len(values) if promised is None else promised
    per_line, form = (6, "{:13.5e}") if kind == 2 else (4, "{:20.12e}")
    lines = ["    -1", "    58", "channel 1", "NONE", "01-Jan-24 12:00:00", "NONE", "NONE"]
    lines.append("    1         0    0         0 NONE               1   0 NONE               0   0")
    lines.append(f"{kind:10d}{count:10d}         1{0.0:13.5e}{1 / RATE:13.5e}{0.0:13.5e}")
    lines.append("        17    0    0    0 Time                 s                   ")
    lines.append("        12    0    0    0 Acceleration         m/s^2               ")
    lines += ["         0    0    0    0 NONE                 NONE                "] * 2
    cells = [form.format(v) for v in values]
    lines += ["".join(cells[i : i + per_line]) for i in range(0, len(cells), per_line)]
    lines.append("    -1")
    return "\n".join(line.ljust(width) for line in lines) + "\n"


@pytest.mark.parametrize("width", [0, 40, 80, 100])
@pytest.mark.parametrize(("kind", "count"), [(2, 64), (2, 61), (4, 62)])
def test_universal_files_with_lines_of_any_length(tmp_path, width, kind, count):
    pytest.importorskip("pyuff")
    signal = read_signal(written(tmp_path, uff_text(X[:count], kind=kind, width=width), "x.uff"))
    np.testing.assert_allclose(signal.values[:, 0], X[:count], atol=1e-5)
    assert signal.attrs["sampling_rate"] == RATE
    assert units_of(signal) == ["m/s^2"]


def test_universal_file_filled_in_part(tmp_path):
    pytest.importorskip("pyuff")
    signal = read_signal(written(tmp_path, uff_text(X[:50], promised=64), "x.uff"))
    assert signal.sizes["time"] == 50
    assert "promises 64 samples, 50 are there" in signal.attrs["notes"][0]


def test_blocks_of_one_name(tmp_path):
    """Some recorders append to MATLAB files; SciPy keeps the last block of a name, and warns."""
    first, second = io.BytesIO(), io.BytesIO()
    scipy.io.savemat(first, {"acc": X, "fs": RATE})
    scipy.io.savemat(second, {"acc": Y})
    path = written(tmp_path, first.getvalue() + second.getvalue()[128:], "x.mat")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        signal = read_signal(path)
    assert_is(signal, X, Y)
    assert signal["channel"].values.tolist() == ["acc", "acc_block2"]
    assert "2 blocks named acc" in signal.attrs["notes"][0]


def test_matlab_4(tmp_path):
    scipy.io.savemat(tmp_path / "x.mat", {"acc": X, "fs": RATE}, format="4")
    assert_is(read_signal(tmp_path / "x.mat"), X)


def test_units_are_checked(tmp_path):
    path = written(tmp_path, f"a,b\n{rows(X, Y)}\n")
    for wrong, near in (("mmm", "mm"), ("m/s^^2", "m/s"), ("meters per second squared, peak", "")):
        with pytest.raises(SignalError, match="is not a unit") as caught:
            read_signal(path, rate=RATE, units=wrong)
        assert near in str(caught.value)
    for right in ("m/s²", "g", "µm", "V", "mV", "counts", "inch/s", "bar", "degC", "°", "%", "unknown"):
        assert units_of(read_signal(path, rate=RATE, units=right)) == [right] * 2


@pytest.mark.parametrize(
    ("data", "settings"),
    [
        (np.stack([X, Y], axis=1), {"rate": "12.8 kHz"}),
        (np.stack([X, Y]), {"rate": RATE}),
        ([X.tolist(), Y.tolist()], {"rate": RATE}),
        ({"a": X, "b": Y}, {"rate": RATE}),
        (pd.DataFrame({"a": X, "b": Y}), {"rate": RATE}),
        (pd.DataFrame({"t": np.arange(COUNT) / RATE, "a": X, "b": Y}), {}),
        (pd.DataFrame({"a": X, "b": Y}, index=np.arange(COUNT) / RATE), {}),
        (pd.DataFrame({"a": X, "b": Y}, index=STAMPED), {}),
        (pd.DataFrame({"when": STAMPED, "a": X, "b": Y}), {}),
        (make_signal({"a": X, "b": Y}, RATE), {}),
    ],
)
def test_data_of_any_shape(data, settings):
    assert_is(to_signal(data, **settings), X, Y)


@pytest.mark.parametrize(
    ("data", "settings", "said"),
    [
        (X, {}, "rate is missing"),
        (X, {"rate": "fast"}, "rate: cannot read 'fast'"),
        (X, {"rate": -1}, "rate: must be a positive"),
        ("none.csv", {}, "cannot be opened"),
        (object(), {"rate": 1.0}, "no array of numbers"),
        ({"a": X, "b": Y[:5]}, {"rate": 1.0}, "same length"),
        (pd.DataFrame({"a": ["x", "y"]}), {"rate": 1.0}, says("table", "numbers", "columns", "['a']")),
        (np.r_[X, np.nan], {"rate": 1.0}, "gaps='interpolate'"),
        (np.ones((2, 3, 4)), {"rate": 1.0}, "must have shape"),
        (np.array([]), {"rate": 1.0}, "must have shape"),
        (X + 1j, {"rate": 1.0}, "samples are complex"),
        (pd.Series(X, name="a"), {"rate": 1.0, "channels": ["b"]}, "has no channel"),
    ],
)
def test_data_that_is_none(data, settings, said):
    with pytest.raises(SignalError, match=said):
        to_signal(data, **settings)


WORDS = (
    "fs",
    "rate",
    "XInc",
    "Speed",
    "time",
    "",
    "Unit",
    "a",
    "12800",
    "1e-3",
    "1,5",
    "NaN",
    "2024-01-01",
    "12:00:00.5",
    "#",
    "%",
    "x" * 90,
)
SIGNS = (",", ";", "\t", " ", ":", "=", '"', "\ufeff", "\u00b5", "[", "]", "\r", "0x", "-", "_", "e")


@pytest.mark.slow
def test_headers_made_of_anything_give_a_signal_or_one_line(tmp_path):
    """Headers thrown together from a fixed seed: never another error than the package's own, never a warning."""
    rng = np.random.default_rng(20240229)
    outcomes, lines = {"read": 0, "refused": 0}, set()
    path = tmp_path / "x.csv"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(400):
            head = "\n".join(
                "".join(str(rng.choice(WORDS)) + str(rng.choice(SIGNS)) for _ in range(rng.integers(0, 5)))
                for _ in range(rng.integers(0, 6))
            )
            sign = str(rng.choice([",", ";", "\t", " "]))
            columns = [X[:12].tolist()] * int(rng.integers(1, 4))
            if rng.random() < 0.3:
                columns[0] = (np.arange(12) / RATE).tolist()
            if rng.random() < 0.2:
                columns[-1] = [str(rng.choice(WORDS)) for _ in range(12)]
            path.write_text(f"{head}\n{rows(*columns, sign=sign)}\n", encoding="utf-8")
            try:
                signal = read_signal(path, rate=RATE, gaps=str(rng.choice(["refuse", "interpolate", "longest"])))
            except SignalError as error:
                lines.add(str(error).count("\n"))
                outcomes["refused"] += 1
            else:
                assert np.isfinite(signal.values).all()
                json.dumps(signal.attrs.get("notes", []))
                outcomes["read"] += 1
    assert min(outcomes.values()) > 40, outcomes
    assert lines == {0}


def test_every_format_refuses_noise_in_one_line(tmp_path):
    rng = np.random.default_rng(3)
    for format in FORMATS:
        for size in (1, 30, 3000):
            path = written(tmp_path, rng.integers(0, 256, size, dtype=np.uint8).tobytes(), f"x_{size}.bin")
            with pytest.raises(SignalError) as caught:
                read_signal(path, rate=1.0, format=format)
            assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["a.mat", "a.npy", "a.npz", "a.lvm", "a.uff", "a.parquet", "a.feather", "a.tdms"])
def test_damaged_files_give_a_signal_or_one_line(tmp_path, name, capfd):
    """Bytes changed, cut out or cut off, from a fixed seed."""
    needed = {"uff": "pyuff", "parquet": "pyarrow", "feather": "pyarrow", "tdms": "nptdms"}.get(name[2:])
    if needed:
        pytest.importorskip(needed)
    path, other = tmp_path / name, tmp_path / f"other_{name}"
    frame = pd.DataFrame({"time": np.arange(COUNT) / RATE, "a": X})
    {
        "mat": lambda: scipy.io.savemat(path, {"run": {"acc": X, "sr": RATE, "at": "x", "more": [1, "a"]}, "b": Y}),
        "npy": lambda: np.save(path, np.stack([X, Y])),
        "npz": lambda: np.savez(path, acc=X, fs=RATE),
        "lvm": lambda: path.write_text(
            LVM.format(decimal=".", columns="No")
            + SEGMENT.format(count=COUNT, step="7.8125E-5")
            + rows([""] * COUNT, X.tolist(), Y.tolist(), sign="\t")
        ),
        "uff": lambda: path.write_text(uff_text(X, width=40)),
        "parquet": lambda: frame.to_parquet(path),
        "feather": lambda: frame.to_feather(path),
        "tdms": lambda: write_signal(make_signal({"a": X, "b": Y}, RATE, units="g", speed=100.0), path),
    }[name[2:]]()
    data, rng, lines = path.read_bytes(), np.random.default_rng(11), {0}
    for turn in range(40):
        changed = bytearray(data)
        low, high = sorted(int(k) for k in rng.integers(0, len(data), 2))
        if turn % 4 == 0:
            del changed[max(1, low) :]
        elif turn % 4 == 1:
            del changed[low:high]
        else:
            for place in rng.integers(0, min(len(data), 400 if turn % 4 == 2 else len(data)), 4):
                changed[place] = rng.integers(256)
        other.write_bytes(bytes(changed))
        try:
            signal = read_signal(other, rate=RATE)
        except SignalError as error:
            lines.add(str(error).count("\n"))
        else:
            assert np.isfinite(signal.values).all()
    assert lines == {0}
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("units", ["mV/g", "pC/g", "mV/(m/s^2)", "G/V", "m/s^2/V", "mV/um"])
def test_a_sensitivity_is_no_unit_of_samples(units):
    with pytest.raises(SignalError, match=r"scale.* give units='(mV|pC|V)'"):
        to_signal([0.0, 1.0, 2.0], rate=10.0, units=units)


@pytest.mark.parametrize("units", ["dB", "dBA", "dB(A)", "dB re 1e-6 m/s^2"])
def test_a_level_is_no_unit_of_samples(units):
    with pytest.raises(SignalError, match=says("'g'", "'mg'", "level")):
        to_signal([0.0, 1.0, 2.0], rate=10.0, units=units)


@pytest.mark.parametrize(
    ("units", "factor"), [("g", 9.80665), ("G", 9.80665), ("mg", 9.80665e-3), ("mm/s^2", 1e-3), ("m/s²", 1.0)]
)
def test_units_of_acceleration(units, factor):
    signal = to_signal([0.0, 1.0, 2.0], rate=10.0, units=units)
    assert unit_dimension(signal.attrs["units"]) == ("acceleration", pytest.approx(factor))


@pytest.mark.parametrize("units", ["V/m", "V/s", "mm/s", "A/m", "N/m", "C", "deg/s", "1/s"])
def test_quotients_that_are_units(units):
    assert to_signal([0.0, 1.0, 2.0], rate=10.0, units=units).attrs["units"] == units


def commas(*columns, sign=","):
    return rows(*columns, sign=sign).replace(".", ",")


@pytest.mark.parametrize("head", ["acc [g]", "# dt = 0,078125 ms\nacc [g]"])
@pytest.mark.parametrize("digits", [1, 3])
def test_one_column_with_decimal_commas_is_one_channel(tmp_path, head, digits):
    values = [f"{v:.{digits}f}" for v in 10.0 * X]
    rate = None if "dt" in head else RATE
    signal = read_signal(written(tmp_path, head + "\n" + "\n".join(values).replace(".", ",")), rate=rate)
    assert_is(signal, np.array(values, dtype=float))
    assert (list(signal["channel"].values), units_of(signal)) == (["acc"], ["g"])


def test_one_heading_above_a_column_that_counts_keeps_two_columns(tmp_path):
    whole = [str(round(100 * v)) for v in np.abs(X)]
    counted = read_signal(written(tmp_path, "acc [g]\n" + rows(range(COUNT), whole)), rate=RATE)
    assert_is(counted, np.array(whole, dtype=float))
    bare = read_signal(written(tmp_path, rows(whole[::-1], whole)), rate=RATE)
    assert_is(bare, np.array(whole[::-1], dtype=float), np.array(whole, dtype=float))
    named = read_signal(written(tmp_path, "a [g],b [g]\n" + rows(whole[::-1], whole)), rate=RATE)
    assert_is(named, np.array(whole[::-1], dtype=float), np.array(whole, dtype=float))


def test_commas_between_columns_and_in_numbers_are_read_by_their_headings(tmp_path):
    times = [f"{k / RATE:.9f}" for k in range(COUNT)]
    values = [f"{v:.2f}" for v in X]
    signal = read_signal(written(tmp_path, "Zeit [s],a [g]\n" + commas(times, values)))
    assert_is(signal, np.array(values, dtype=float))
    assert any("2 headings" in note for note in signal.attrs["notes"])
    whole = [str(round(100 * v)) for v in np.abs(X)]
    with pytest.raises(SignalFileError, match=says("2 headings", "4 fields", "semicolons")):
        read_signal(written(tmp_path, "a [g],b [g]\n" + rows(whole, whole, whole[::-1], whole)))
    with pytest.raises(SignalFileError, match=says("line 4", "6 values")):
        read_signal(written(tmp_path, "Zeit [s],a [g]\n0,01,1,5\n0,02,1,5\n0,03,1,5,7,5\n"))
    quoted = [[f'"{cell}"' for cell in column] for column in (times, values)]
    for text in (commas(times, values, sign=";"), commas(*quoted)):
        sign = ";" if ";" in text else ","
        signal = read_signal(written(tmp_path, f"Zeit [s]{sign}a [g]\n" + text))
        assert_is(signal, np.array(values, dtype=float))


@pytest.mark.parametrize(
    ("head", "speed"),
    [
        ("n [krpm]", 1.5), ("omega [deg/s]", 9000.0), ("U/s", 25.0), ("Speed (RPM x1000)", 1.5), ("n [1/min]", 1500.0),
    ],
)  # fmt: skip
def test_columns_of_speeds_in_other_units_are_the_shafts(tmp_path, head, speed):
    count = 4096
    time = np.arange(count) / RATE
    acc = np.cos(2 * np.pi * 400.0 * time) + 0.01 * np.random.default_rng(0).standard_normal(count)
    table = pd.DataFrame({"Time [s]": time, "acc [g]": acc, head: speed, "Load [%]": 50.0 + acc})
    report = analyse(read_signal(written(tmp_path, table.to_csv(index=False))))
    assert report.speed == pytest.approx(2 * np.pi * 25.0)
    assert list(report.levels["channel"]) == ["acc"]
    assert any("Load" in note and "percents" in note for note in report.notes)


def test_columns_called_like_units_of_turns_may_be_vibration():
    for label in ("v [m/s]", "left/right", "u [mm/s]", "acc x"):
        assert role_of(*name_and_unit(label)) is None
