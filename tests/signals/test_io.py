"""Files: round trips keep samples, rate and units; what is damaged, empty or mislabelled says so."""

import gzip
import re
import struct
import warnings

import h5py
import numpy as np
import pytest
import scipy.io
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import wavfile

from gearmbs.signals import (
    MissingMetadataError,
    SignalError,
    SignalFileError,
    make_signal,
    read_signal,
    sections,
    units_of,
    write_signal,
)
from gearmbs.signals.files.formats import written_endings
from gearmbs.signals.files.table import TABLE, format_of
from tests.generators import cases, seed
from tests.says import says


def file_name(format: str) -> str:
    """Return a name of a file of a format; of one without an ending that of another whose files may hold the same."""
    own, held = TABLE[format].endings, {*format_of(format).also}
    others = [row.endings for name, row in TABLE.items() if held & {*format_of(name).also}]
    return "x" + next(ending for ending in (own or " ".join(others)).split() if ending in written_endings())


NAMES = {format: file_name(format) for format in TABLE if format_of(format).write}
KEEPS_ATTRS = {format for format in NAMES if format_of(format).keeps_attributes}
EXTRAS = {"tdms": "nptdms", "uff58": "pyuff", "parquet": "pyarrow", "feather": "pyarrow"}
"""Libraries that are optional."""


@pytest.fixture(autouse=True)
def _skip_without_its_library(request):
    """The libraries for TDMS and UFF are optional extras."""
    wanted = getattr(request.node, "callspec", None)
    for value in wanted.params.values() if wanted else ():
        if isinstance(value, str) and value in EXTRAS:
            pytest.importorskip(EXTRAS[value])


def example(n=257, rate=51200.0, seed=0):
    rng = np.random.default_rng(seed)
    data = {"laser": rng.standard_normal(n) * 1e-3, "force, y": 1e6 * rng.standard_normal(n), "aux": rng.random(n) / 3}
    return make_signal(
        data,
        rate,
        units=["m/s", "N", "m/s^2"],
        t0=0.25,
        speed=104.71975511965977,
        teeth=(29, 31),
        attrs={"place": "shaft 2", "load": 1.5, "tags": ["a", "b"]},
    )


def assert_same(back, signal, attrs=True):
    np.testing.assert_array_equal(back.values, signal.values)
    assert back.attrs["sampling_rate"] == signal.attrs["sampling_rate"]
    assert units_of(back) == units_of(signal)
    assert back["channel"].values.tolist() == signal["channel"].values.tolist()
    np.testing.assert_allclose(back["time"], signal["time"], rtol=0, atol=1e-12)
    assert back.attrs.get("speed") == signal.attrs.get("speed")
    assert back.attrs.get("teeth") == signal.attrs.get("teeth")
    if attrs:
        for key in ("place", "load", "tags"):
            assert back.attrs.get(key) == signal.attrs.get(key)


@pytest.mark.parametrize("format", NAMES)
@pytest.mark.parametrize("rate", [51200.0, 44100.0, 12345.678])
def test_round_trip(tmp_path, format, rate):
    signal = example(rate=rate)
    path = write_signal(signal, tmp_path / NAMES[format], format=format)
    back = read_signal(path)
    assert_same(back, signal, format in KEEPS_ATTRS)
    assert [p.name for p in tmp_path.iterdir()] == [NAMES[format]]


@pytest.mark.parametrize("format", NAMES)
def test_bare_single_channel_round_trip(tmp_path, format):
    signal = make_signal([0.1, -0.2, 0.3], 8.0)
    back = read_signal(write_signal(signal, tmp_path / NAMES[format], format=format))
    np.testing.assert_array_equal(back.values, signal.values)
    assert back.attrs["sampling_rate"] == 8.0
    assert units_of(back) == ["unknown"]
    assert "speed" not in back.attrs
    assert "teeth" not in back.attrs


@pytest.mark.slow
@settings(max_examples=15, deadline=None, derandomize=True)
@given(
    values=st.lists(st.floats(allow_nan=False, allow_infinity=False, width=64), min_size=2, max_size=20),
    rate=st.floats(0.5, 1e7),
    unit=st.sampled_from(["m/s^2", "µm", "V", "", "deg C"]),
)
def test_csv_round_trip_of_any_doubles(tmp_path_factory, values, rate, unit):
    signal = make_signal(values, rate, units=unit or "unknown")
    back = read_signal(write_signal(signal, tmp_path_factory.mktemp("csv") / "x.csv"))
    np.testing.assert_array_equal(back.values, signal.values)
    assert back.attrs["sampling_rate"] == signal.attrs["sampling_rate"]
    assert units_of(back) == units_of(signal)


@pytest.mark.parametrize("format", NAMES)
def test_empty_file_is_named(tmp_path, format):
    path = tmp_path / NAMES[format]
    path.write_bytes(b"")
    with pytest.raises(SignalFileError, match=re.escape(f"{path}: is empty")) as caught:
        read_signal(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("format", [f for f in NAMES if f != "csv"])
@pytest.mark.parametrize("keep", [0.3, 0.6, 0.95])
def test_cut_files_are_reported(tmp_path, format, keep):
    path = write_signal(example(n=4001), tmp_path / NAMES[format], format=format)
    data = path.read_bytes()
    path.write_bytes(data[: int(keep * len(data))])
    with pytest.raises(SignalFileError, match=path.name):
        read_signal(path)


def test_cut_csv_is_reported_with_its_line(tmp_path):
    path = write_signal(example(n=50), tmp_path / "x.csv")
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:-1]) + "\n" + lines[-1].rsplit(",", 1)[0])
    with pytest.raises(SignalFileError, match=says(f"line {len(lines)}", "2 values")):
        read_signal(path)


@pytest.mark.parametrize("content", NAMES)
def test_mislabelled_files_say_what_they_hold(tmp_path, content):
    data = write_signal(example(), tmp_path / NAMES[content], format=content).read_bytes()
    for wrong in NAMES:
        kin = {"mat7.3", "hdf5", "netcdf", "mat5"}
        if wrong == content or (content in {"mat7.3", "hdf5", "netcdf"} and wrong in kin):
            continue
        path = tmp_path / f"wrong_{NAMES[wrong]}"
        path.write_bytes(data)
        # the remedy is the format that reads it; of text, and of HDF5, several may
        remedy = content if content not in {"csv", "csv.gz", *kin} else "format"
        with pytest.raises(SignalFileError, match=says("named", "holds", remedy)):
            read_signal(path, format=wrong)


@pytest.mark.parametrize("suffix", [".csv", ".wav", ".mat", ".h5", ".tdms", ".uff", ".nc", ".csv.gz"])
def test_garbage_is_refused(tmp_path, suffix):
    path = tmp_path / f"x{suffix}"
    path.write_bytes(np.random.default_rng(0).integers(0, 256, 5000, dtype=np.uint8).tobytes())
    with pytest.raises(SignalFileError, match=says("binary", "rename", "format=")):
        read_signal(path)


def test_text_of_a_spreadsheet_in_utf_16(tmp_path):
    (tmp_path / "x.csv").write_text("time,a\n0,1\n1,2\n", encoding="utf-16")
    assert read_signal(tmp_path / "x.csv").values[:, 0].tolist() == [1.0, 2.0]


def test_missing_file_unknown_ending_and_missing_folder(tmp_path):
    with pytest.raises(SignalFileError, match="No such file"):
        read_signal(tmp_path / "none.csv")
    (tmp_path / "x.xyz").write_bytes(bytes(range(1, 200)))
    with pytest.raises(SignalFileError, match="determines no format"):
        read_signal(tmp_path / "x.xyz")
    with pytest.raises(SignalFileError, match="no folder"):
        write_signal(example(), tmp_path / "nowhere" / "x.csv")
    with pytest.raises(SignalError, match=r"format: .*one of"):
        read_signal(tmp_path / "x.xyz", format="mp3")


def test_rate_is_asked_for_and_checked(tmp_path):
    path = tmp_path / "bare.csv"
    path.write_text("a1,a2\n1.0,2.0\n3.0,4.0\n")
    with pytest.raises(MissingMetadataError, match=r"rate is missing: .*bare\.csv") as caught:
        read_signal(path)
    assert caught.value.name == "rate"
    signal = read_signal(path, rate=12800.0, units="m/s^2", speed=100.0, teeth=32)
    assert signal.attrs["sampling_rate"] == 12800.0
    assert signal.attrs["teeth"] == (32,)
    assert units_of(signal) == ["m/s^2", "m/s^2"]
    other = write_signal(example(), tmp_path / "x.nc")
    with pytest.raises(SignalFileError, match=says("sampling rate", "51200 Hz", "rate=12800")):
        read_signal(other, rate=12800.0)


def test_channel_choice(tmp_path):
    path = write_signal(example(), tmp_path / "x.h5")
    assert read_signal(path, channels=["aux"])["channel"].values.tolist() == ["aux"]
    with pytest.raises(SignalFileError, match=says("channel", "'nope'")):
        read_signal(path, channels=["nope"])


@pytest.mark.parametrize(
    ("text", "names", "units", "rate", "first"),
    [
        ("1 2\n3 4\n", ["ch1", "ch2"], ["unknown"] * 2, None, [1.0, 2.0]),
        ("time [s];v [m/s]\n0,0;1,5\n0,1;2,5\n0,2;3,5\n", ["v"], ["m/s"], 10.0, [1.5]),
        ("Time,A,B\n(ms),(mV),(V)\n\n0,1,2\n1,3,4\n2,5,6\n", ["A", "B"], ["mV", "V"], 1000.0, [1.0, 2.0]),
        ("Time;A;B\nms;m/s²;\n0;1;2\n1;3;4\n2;5;6\n", ["A", "B"], ["m/s²", "unknown"], 1000.0, [1.0, 2.0]),
        # names that could be units stay names where no row above calls one column the time
        ("run,of,today\nt,V,A\n0,1,2\n0.5,3,4\n1,5,6\n", ["V", "A"], ["unknown", "unknown"], 2.0, [1.0, 2.0]),
        (
            "# Fs = 2000 Hz\n# teeth: [32, 80]\nx\ty\n1e3\t-2E-3\n4\t5\n",
            ["x", "y"],
            ["unknown"] * 2,
            2000.0,
            [1000.0, -0.002],
        ),
        ('"a, b",c\n1,2\n2,3\n', ["a, b", "c"], ["unknown"] * 2, None, [1.0, 2.0]),
        ("x,x\n1,2\n2,3\n", ["x_1", "x_2"], ["unknown"] * 2, None, [1.0, 2.0]),
        ("x\r\n1\r\n2\r\n\r\n", ["x"], ["unknown"], None, [1.0]),
    ],
)
def test_csv_of_others(tmp_path, text, names, units, rate, first):
    path = tmp_path / "other.csv"
    path.write_bytes(text.encode())
    signal = read_signal(path, rate=100.0 if rate is None else None)
    assert signal["channel"].values.tolist() == names
    assert units_of(signal) == units
    assert signal.attrs["sampling_rate"] == pytest.approx(rate or 100.0)
    assert signal.values[0].tolist() == first


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("a,b\n1,2\n3,oops\n", says("3", "'oops'")),
        ("a,b\n1,2\n3,4,5\n6,7\n", says("line 3", "3 values", "2")),
        ("a,b\n1,2\n3\n", says("3", "1", "2", "expected")),
        ("a,b\n1,2\n3,nan\n", "line 3 holds 'nan'"),
        ("a,b\n1,2\n3,\n", says("line 3", "'b'", "pass gaps=")),
        ("<html>\n<body>not data</body>\n", says("bad.csv", "'<html>'", "row of numbers")),
        ("time,x\n0,1\n1,2\n5,3\n", "time: is not uniform"),
        ("# teeth: many\nx\n1\n2\n", says("bad.csv", "understood", "header")),
    ],
)
def test_bad_csv_names_the_line(tmp_path, text, match):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(SignalFileError, match=match):
        read_signal(path, rate=10.0)


def test_damaged_gzip(tmp_path):
    path = tmp_path / "x.csv.gz"
    body = gzip.compress(b"a\n" + b"1.5\n" * 20000)
    path.write_bytes(body[:-30])
    with pytest.raises(SignalFileError, match=says("x.csv.gz", "gzip", "cut short")):
        read_signal(path, rate=1.0)


def test_mat_of_others(tmp_path):
    rng = np.random.default_rng(1)
    de, fe = rng.standard_normal((100, 1)), rng.standard_normal((1, 100))
    scipy.io.savemat(tmp_path / "a.mat", {"X097_DE_time": de, "X097_FE_time": fe, "X097RPM": 1796.0, "fs": 12000.0})
    signal = read_signal(tmp_path / "a.mat")
    assert signal["channel"].values.tolist() == ["X097_DE_time", "X097_FE_time"]
    assert signal.attrs["sampling_rate"] == 12000.0
    np.testing.assert_array_equal(signal.values[:, 1], fe[0])
    scipy.io.savemat(tmp_path / "b.mat", {"bearing": {"sr": 97656.0, "gs": rng.standard_normal(50)}, "load": 5.0})
    assert read_signal(tmp_path / "b.mat").attrs["sampling_rate"] == 97656.0
    scipy.io.savemat(tmp_path / "c.mat", {"x": np.ones(5), "y": np.ones(7)})
    with pytest.raises(SignalFileError, match=r"different lengths: x \(5\), y \(7\)"):
        read_signal(tmp_path / "c.mat", rate=1.0)
    assert read_signal(tmp_path / "c.mat", rate=1.0, channels=["y"]).sizes["time"] == 7
    scipy.io.savemat(tmp_path / "d.mat", {"note": "no numbers"})
    with pytest.raises(SignalFileError, match=says("d.mat", "holds no numeric")):
        read_signal(tmp_path / "d.mat", rate=1.0)


def test_hdf5_and_netcdf_of_others(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        d = file.create_dataset("run/acc", data=np.arange(20.0).reshape(2, 10))
        d.attrs["units"] = "g"
        d.attrs["sample_rate"] = 500.0
    signal = read_signal(tmp_path / "a.h5")
    assert signal["channel"].values.tolist() == ["acc_1", "acc_2"]
    assert units_of(signal) == ["g", "g"]
    assert signal.attrs["sampling_rate"] == 500.0
    ds = xr.Dataset({"v": ("time", np.ones(8), {"units": "m/s"})}, coords={"time": np.arange(8) / 4.0})
    ds.to_netcdf(tmp_path / "c.nc", engine="scipy")
    assert read_signal(tmp_path / "c.nc").attrs["sampling_rate"] == 4.0
    ds.to_netcdf(tmp_path / "d.nc", engine="h5netcdf")
    assert units_of(read_signal(tmp_path / "d.nc")) == ["m/s"]


def test_netcdf_with_a_wrong_rate_is_mislabelled(tmp_path):
    path = write_signal(example(), tmp_path / "x.nc")
    with h5py.File(path, "a") as file:
        file.attrs["sampling_rate"] = 12800.0
    with pytest.raises(SignalFileError, match=says("51200 Hz", "sampling_rate", "12800 Hz")):
        read_signal(path)


@pytest.mark.parametrize(
    ("dtype", "value", "expected"),
    [(np.int16, -16384, -0.5), (np.uint8, 192, 0.5), (np.int32, 1 << 30, 0.5), (np.float32, 0.25, 0.25)],
)
def test_wav_of_others(tmp_path, dtype, value, expected):
    wavfile.write(tmp_path / "a.wav", 8000, np.array([value, 0 if dtype != np.uint8 else 128], dtype=dtype))
    signal = read_signal(tmp_path / "a.wav")
    assert signal.attrs["sampling_rate"] == 8000.0
    assert signal.values[:, 0].tolist() == [expected, 0.0]


def test_wav_24_bit(tmp_path):
    frames = b"".join(struct.pack("<i", v)[:3] for v in (1 << 22, -(1 << 22)))
    header = (
        b"RIFF" + struct.pack("<I", 36 + len(frames)) + b"WAVEfmt " + struct.pack("<IHHIIHH", 16, 1, 1, 100, 300, 3, 24)
    )
    (tmp_path / "a.wav").write_bytes(header + b"data" + struct.pack("<I", len(frames)) + frames)
    assert read_signal(tmp_path / "a.wav").values[:, 0].tolist() == [0.5, -0.5]


def test_wav_whose_comment_contradicts_its_header(tmp_path):
    path = write_signal(example(), tmp_path / "x.wav")
    data = bytearray(path.read_bytes())
    data[24:28] = struct.pack("<I", 8000)
    path.write_bytes(data)
    with pytest.raises(SignalFileError, match="header says 8000 Hz"):
        read_signal(path)


def test_text_uff_of_others(tmp_path):
    pyuff = pytest.importorskip("pyuff")

    t = np.arange(40) / 51200.0
    data = np.sin(2 * np.pi * 1000 * t)
    common = dict.fromkeys(("rsp_node", "rsp_dir", "ref_node", "ref_dir"), 1)
    kind = {"abscissa_spec_data_type": 17, "ordinate_spec_data_type": 12, "orddenom_spec_data_type": 0}
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets(
        {"type": 58, "binary": 0, "func_type": 1, "data": data, "x": t, "abscissa_spacing": 1, **common, **kind}
    )
    signal = read_signal(tmp_path / "a.uff")
    assert signal.attrs["sampling_rate"] == 51200.0  # its text field says 1.95312e-05 s
    assert units_of(signal) == ["m/s^2"]
    np.testing.assert_allclose(signal.values[:, 0], data, atol=1e-11)


def test_tdms_with_unequal_channels(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    ChannelObject, TdmsWriter = nptdms.ChannelObject, nptdms.TdmsWriter

    with TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment(
            [
                ChannelObject("g", "a", np.ones(4), properties={"wf_increment": 0.01, "unit_string": "g"}),
                ChannelObject("g", "b", np.ones(9), properties={"wf_increment": 0.001}),
            ]
        )
    with pytest.raises(SignalFileError, match=says("a 100 Hz", "b 1000 Hz", "--channel")):
        read_signal(tmp_path / "a.tdms")
    assert read_signal(tmp_path / "a.tdms", channels=["b"]).attrs["sampling_rate"] == 1000.0


def test_failed_writes_leave_nothing(tmp_path):
    pytest.importorskip("pyuff")
    with pytest.raises(SignalFileError, match=r"x\.uff"):
        write_signal(make_signal([1.0, 2.0], 1.0, units="a unit with a very long name"), tmp_path / "x.uff")
    assert list(tmp_path.iterdir()) == []


def test_reading_reports_progress(tmp_path):
    path = write_signal(example(n=1000), tmp_path / "x.csv.gz")
    seen = []
    read_signal(path, progress=lambda fraction, stage: seen.append((fraction, stage)))
    assert seen[-1][1] == "reading"
    assert all(0.0 < f <= 1.0 for f, _ in seen)


@pytest.mark.parametrize("format", NAMES)
@pytest.mark.slow
def test_damage_anywhere_is_named_or_harmless(tmp_path, format):
    """Bytes cut off, taken out or changed, also in the header: a signal, or an error with the file's name."""
    rng = np.random.default_rng(17)
    raw = write_signal(example(2000), tmp_path / NAMES[format], format=format).read_bytes()
    path = tmp_path / f"damaged{''.join((tmp_path / NAMES[format]).suffixes)}"
    said = []
    for k in range(32):
        damaged = bytearray(raw)
        start = int(rng.integers(0, min(len(raw), 700) if k % 2 else len(raw)))
        if k % 4 == 0:
            damaged = damaged[: max(1, start)]
        elif k % 4 == 1:
            damaged[start : start + 100] = b""
        else:
            damaged[start : start + 4] = rng.bytes(4)
        path.write_bytes(damaged)
        for read in (lambda: [read_signal(path, format=format)], lambda: list(sections(path, 0.05, format=format))):
            try:
                read()
            except (MissingMetadataError, SignalFileError) as error:
                said.append(str(error))
    assert said
    assert all(str(path) in text for text in said)


@pytest.mark.slow
def test_rounded_times_are_no_uneven_clock_if_the_rate_is_known(tmp_path):
    """Times in whole milliseconds at 12.8 kHz repeat 12 or 13 times each."""
    t = np.round(np.arange(200_000) / 12800.0, 3)
    x = np.sin(np.arange(t.size))
    np.savetxt(tmp_path / "x.csv", np.column_stack([t, x]), delimiter=",", header="time,a", comments="", fmt="%.17g")
    with pytest.raises(SignalFileError, match=says("file are only")):
        read_signal(tmp_path / "x.csv")
    signal = read_signal(tmp_path / "x.csv", rate=12800.0)
    assert signal.attrs["sampling_rate"] == 12800.0
    np.testing.assert_array_equal(signal.values[:, 0], x)
    # 15.6 s: three sections of 5 s and a rest that is left out
    parts = list(sections(tmp_path / "x.csv", 5.0, rate=12800.0))
    np.testing.assert_array_equal(np.concatenate([p.values[:, 0] for p in parts]), x[:192_000])
    # another rate than the mean of the times is a contradiction, not a rounding
    with pytest.raises(SignalFileError, match=says("time", "12799.9", "10000")):
        read_signal(tmp_path / "x.csv", rate=10000.0)


WHOLE = (".csv", ".txt", ".csv.gz", ".npz", ".mat", ".h5", ".wav", ".uff")


@pytest.mark.parametrize("ending", WHOLE)
def test_a_file_of_ours_cut_anywhere_is_refused(tmp_path, ending):
    values = np.round(np.random.default_rng(0).normal(size=(300, 2)), 6)
    path = tmp_path / f"a{ending}"
    write_signal(make_signal(values, 1000.0, units="m/s^2", speed=100.0, teeth=20), path)
    data = path.read_bytes()
    rng = np.random.default_rng(seed())
    sizes = [*rng.integers(0, len(data), cases(25)), *rng.integers(int(0.97 * len(data)), len(data), 10)]
    rows = [k + 1 for k in range(len(data) - 400, len(data) - 1) if data[k : k + 1] == b"\n"]
    for size in [*sizes, *(rows if ending in (".csv", ".txt") else [])]:
        path.write_bytes(data[:size])
        with pytest.raises(SignalError):
            read_signal(path)
    path.write_bytes(data)
    np.testing.assert_allclose(read_signal(path).values, values, atol=1e-9 if ending != ".wav" else 1e-4)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(
    ("cut", "said"),
    [
        ("", None),
        ("\n", "line 301: The last line has no end"),
        ("34\n", "line 301: The last line has no end, and its last number has fewer digits"),
    ],
)
def test_the_end_of_a_table_of_others_is_looked_at(tmp_path, cut, said, packed):
    """Numbers of four decimals, whole, without the last end of line, and cut; and the same packed."""
    text = "time,acc\n" + "".join(f"{k / 1000:.4f},{k % 7 + 0.1234:.4f}\n" for k in range(300))
    path = tmp_path / ("a.csv.gz" if packed else "a.csv")
    body = text.removesuffix(cut).encode()
    path.write_bytes(gzip.compress(body) if packed else body)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        notes = read_signal(path).attrs.get("notes", [])
    assert len(notes) == (said is not None)
    assert said is None or f"{path.name}, {said}" in notes[0]
    # a writer that ends no last line has lost nothing, as its digits say
    assert [str(w.message) for w in warned] == (notes if cut == "34\n" else [])
    if cut == "34\n":
        path.write_bytes(gzip.compress(body + b"\n") if packed else body + b"\n")
        with pytest.warns(UserWarning, match=f"{path.name}, line 301: The last line's last number has fewer digits"):
            read_signal(path)


@pytest.mark.parametrize("columns", [1, 2, 3])
def test_a_table_of_others_cut_within_a_number_says_so(tmp_path, columns):
    """Refused, remarked on, or whole rows and nothing else: never another last number without a word."""
    values = np.round(np.random.default_rng(columns).normal(size=(200, columns)), 6)
    text = "".join(",".join(repr(float(x)) for x in row) + "\n" for row in values)
    path = tmp_path / "a.csv"
    rng = np.random.default_rng((seed(), columns))
    for size in rng.integers(len(text) // 2, len(text), cases(60)):
        path.write_text(text[:size])
        try:
            found = read_signal(path, rate=1000.0)
        except SignalError:
            continue
        if "The last line has no end" in " ".join(found.attrs.get("notes", ())):
            assert not text[:size].endswith("\n")
            continue
        np.testing.assert_array_equal(found.values, values[: found.sizes["time"]])
    path.write_text(text)
    assert "notes" not in read_signal(path, rate=1000.0).attrs
    path.write_text(text.rstrip("\n"))
    np.testing.assert_array_equal(read_signal(path, rate=1000.0).values, values)


def test_parquet_keeps_speed_and_teeth(tmp_path):
    pytest.importorskip("pyarrow")
    signal = make_signal(np.arange(20.0), 1000.0, speed=12.5, teeth=(23, 41))
    write_signal(signal, tmp_path / "x.parquet")
    found = read_signal(tmp_path / "x.parquet")
    assert found.attrs["speed"] == signal.attrs["speed"]
    assert tuple(found.attrs["teeth"]) == tuple(signal.attrs["teeth"])
    write_signal(make_signal(np.arange(20.0), 1000.0), tmp_path / "y.parquet")
    assert not {"speed", "teeth"} & set(read_signal(tmp_path / "y.parquet").attrs)


# How the shaft turns over time, beside the channels.


def turning(n=600):
    t = 0.25 + np.arange(n) / 12800.0
    signal = example(n, 12800.0)
    signal.attrs.pop("speed")
    angle = 2.0 * np.pi * (30.0 * t + 5.0 * t**2)
    return signal.assign_coords(
        speed=("time", 2.0 * np.pi * (30.0 + 10.0 * t), {"units": "rad/s"}), angle=("time", angle, {"units": "rad"})
    )


@pytest.mark.parametrize("format", NAMES)
def test_speed_and_angle_over_time_read_back(tmp_path, format):
    signal = turning()
    path = write_signal(signal, tmp_path / NAMES[format], format=format)
    for back in (read_signal(path, format=format), read_signal(path, format=format, channels=["force, y"], teeth=29)):
        for name in ("speed", "angle"):
            np.testing.assert_array_equal(back[name], signal[name])
            assert back[name].attrs == signal[name].attrs
        assert "speed" not in back.attrs
    assert_same(read_signal(path, format=format), signal, attrs=format in KEEPS_ATTRS)
    assert back["channel"].values.tolist() == ["force, y"]
    np.testing.assert_array_equal(back.values[:, 0], signal.values[:, 1])
    # section by section, of one channel as of all
    parts = list(sections(path, 0.02, format=format, channels=["aux"]))
    assert len(parts) == 2
    np.testing.assert_array_equal(np.concatenate([part["speed"] for part in parts]), signal["speed"][: 2 * 256])
    # the twin: a constant speed that is given wins, as over one that is written
    steady = read_signal(path, format=format, speed="1500 rpm")
    assert steady.attrs["speed"] == pytest.approx(50.0 * np.pi)
    assert set(steady.coords) == {"time", "channel", "units"}


def test_channels_of_speed_stay_channels(tmp_path):
    """All but one that would be read as the shaft's own, which is refused with its name."""
    data = {"x": [1.0, 2.0], "speed": [3.0, 4.0], "speed over time": [5.0, 6.0]}
    signal = make_signal(data, 100.0, units=["N", "rad/s", "rpm"])
    back = read_signal(write_signal(signal, tmp_path / "x.csv"))
    assert_same(back, signal)
    assert set(back.coords) == {"time", "channel", "units"}
    with pytest.raises(SignalError, match=says("channels", "'speed over time'", "another", "read back")):
        write_signal(make_signal(data, 100.0, units="rad/s"), tmp_path / "y.csv")
    assert not (tmp_path / "y.csv").exists()
    alone = make_signal({"speed over time": [5.0, 6.0]}, 100.0, units="rad/s")
    assert_same(read_signal(write_signal(alone, tmp_path / "z.csv")), alone)


def test_gaps_cut_the_speed_as_the_samples(tmp_path):
    signal = turning()
    path = write_signal(signal, tmp_path / "x.csv")
    lines = path.read_text().splitlines()
    head = len(lines) - 600
    lines[head + 99] = "," + lines[head + 99].partition(",")[2]
    path.write_text("\n".join(lines) + "\n")
    back = read_signal(path, gaps="longest")
    assert back.sizes["time"] == 500
    np.testing.assert_array_equal(back["speed"], signal["speed"][100:])


def test_uff_leaves_no_file_open(tmp_path):
    pytest.importorskip("pyuff")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        write_signal(example(), tmp_path / "x.uff")
    assert not said
