"""Long files piece by piece: the same samples, the same features, in memory for one piece."""

import tracemalloc

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.signals import (
    MissingMetadataError,
    SignalError,
    SignalFileError,
    analyse,
    make_signal,
    read_signal,
    sections,
    trend,
    trend_table,
    write_signal,
)
from tests.says import says

RATE, TEETH = 12800.0, 32
NAMES = {
    "csv": "x.csv",
    "csv.gz": "x.csv.gz",
    "mat5": "x.mat",
    "uff58": "x.uff",
    "wav": "x.wav",
    "netcdf": "x.nc",
    "hdf5": "x.h5",
    "tdms": "x.tdms",
}


def record(seconds=25.0, rate=RATE, channels=2, seed=5):
    """Two channels whose mesh at 960 Hz doubles after half of the time."""
    t = np.arange(round(seconds * rate)) / rate
    rng = np.random.default_rng(seed)
    grown = 1.0 + (t >= seconds / 2)
    angle = 2 * np.pi * 30.0 * t
    mesh = sum(np.cos(k * TEETH * angle + k) / k for k in (1, 2, 3))
    data = {f"a{c}": grown * (c + 1) * mesh + 0.1 * rng.standard_normal(t.size) for c in range(channels)}
    return make_signal(data, rate, units="m/s^2", teeth=TEETH, t0=2.0)


def test_texts_keep_all_digits_in_the_legacy_print_mode(tmp_path):
    with np.printoptions(legacy="1.13"):
        path = write_signal(record(1.0), tmp_path / "x.csv")
    np.testing.assert_array_equal(read_signal(path).values, record(1.0).values)


@pytest.mark.parametrize("format", NAMES)
@pytest.mark.slow
def test_sections_put_together_are_the_record(tmp_path, format):
    whole = record()
    path = write_signal(whole, tmp_path / NAMES[format], format=format)
    parts = list(sections(path, 7.0))
    # 25 s are three sections of 7 s and 4 s, which is more than half
    assert [part.sizes["time"] for part in parts] == [89600, 89600, 89600, 51200]
    np.testing.assert_array_equal(np.concatenate([part.values for part in parts]), whole.values)
    np.testing.assert_allclose(np.concatenate([part["time"].values for part in parts]), whole["time"].values, atol=1e-9)
    for part in parts:
        assert part.attrs["teeth"] == (TEETH,)
        assert part.attrs["sampling_rate"] == RATE
        assert part["units"].values.tolist() == ["m/s^2", "m/s^2"]


def test_a_short_rest_is_left_out_and_a_short_file_is_not(tmp_path):
    path = write_signal(record(5.0), tmp_path / "x.nc")
    assert [part.sizes["time"] for part in sections(path, 2.0)] == [25600, 25600, 12800]
    assert len(list(sections(path, 3.5))) == 1
    assert [part.sizes["time"] for part in sections(path, 60.0)] == [64000]


@pytest.mark.slow
def test_files_of_others_with_a_time_column(tmp_path):
    t = np.arange(300_000) / 10_000.0
    pd.DataFrame({"time [ms]": 1e3 * t, "a [V]": np.sin(t)}).to_csv(tmp_path / "x.csv", index=False)
    parts = list(sections(tmp_path / "x.csv", 8.0))
    assert [part.sizes["time"] for part in parts] == [80_000, 80_000, 80_000, 60_000]
    assert parts[2]["time"].values[0] == pytest.approx(16.0)
    np.testing.assert_array_equal(np.concatenate([p.values[:, 0] for p in parts]), np.sin(t))
    # a gap of 50 ms between the blocks that are read at a time
    t[131_072:] += 0.05
    pd.DataFrame({"time": t, "a": np.sin(t)}).to_csv(tmp_path / "y.csv", index=False)
    with pytest.raises(SignalFileError, match=says("500", "131072", "samples after row")):
        list(sections(tmp_path / "y.csv", 8.0))


@pytest.mark.slow
def test_what_is_missing_or_damaged_is_named(tmp_path):
    np.savetxt(tmp_path / "x.csv", np.ones((1000, 2)), delimiter=",", header="a,b", comments="")
    with pytest.raises(MissingMetadataError, match="rate is missing"):
        list(sections(tmp_path / "x.csv", 1.0))
    with pytest.raises(SignalError, match=says("positive", "seconds")):
        list(sections(tmp_path / "x.csv", 0.0, rate=100.0))
    with pytest.raises(SignalFileError, match="has no channel"):
        list(sections(tmp_path / "x.csv", 1.0, rate=100.0, channels=["c"]))
    path = write_signal(record(20.0), tmp_path / "x.csv.gz")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(SignalFileError, match=says("x.csv.gz", "gzip", "cut short")):
        list(sections(path, 2.0))
    with open(tmp_path / "x.csv", "a") as file:
        file.write("1,two\n")
    with pytest.raises(SignalFileError, match="line 1002 holds 'two'"):
        list(sections(tmp_path / "x.csv", 1.0, rate=100.0))


@pytest.mark.slow
def test_trend_follows_what_changes(tmp_path):
    whole = record()
    path = write_signal(whole, tmp_path / "x.csv.gz")
    stages = []
    found = trend(path, 5.0, progress=lambda f, s: stages.append((f, s)))
    np.testing.assert_allclose(found["start"], [2.0, 7.0, 12.0, 17.0, 22.0])
    np.testing.assert_allclose(found["gmf"], 960.0, atol=0.05)
    first = analyse(read_signal(path)[:64000])
    np.testing.assert_allclose(found["band"][0], first.harmonics["band"], rtol=1e-9)
    # the amplitude doubles halfway
    ratio = found["band"].sel(section=4) / found["band"].sel(section=0)
    np.testing.assert_allclose(ratio, 2.0, rtol=0.02)
    assert [f for f, _ in stages] == sorted(f for f, _ in stages)
    table = trend_table(found)
    assert len(table) == 5 * 2
    assert {"start_s", "gmf_hz", "channel", "band_1", "level", "fm4", "note"} <= set(table.columns)


@pytest.mark.slow
def test_sections_without_a_mesh_line_are_gaps_with_a_reason(tmp_path):
    whole = record(12.0)
    whole[51200:102400] = np.random.default_rng(0).standard_normal((51200, 2))
    found = trend(write_signal(whole, tmp_path / "x.nc"), 4.0)
    assert np.isnan(found["gmf"].values).tolist() == [False, True, False]
    assert "no gear mesh line stands out" in found["note"].values[1]
    with pytest.raises(SignalError, match=says("section", "could be analysed")):
        trend(write_signal(whole[51200:102400], tmp_path / "y.nc"), 4.0)
    bare = write_signal(make_signal(whole.values, RATE), tmp_path / "z.nc")
    plain = trend(bare, 4.0)
    assert plain["rms"].dims == ("section", "channel")
    assert "the speed is not known" in plain["note"].values[0]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["x.nc", "x.csv", "x.wav"])
def test_memory_does_not_grow_with_the_file(tmp_path, name):
    peaks = []
    for seconds in (40.0, 120.0):
        path = write_signal(record(seconds), tmp_path / name)
        for _ in sections(path, 1.0):
            break
        tracemalloc.start()
        for _ in sections(path, 1.0):
            pass
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]
    # a few blocks of 2^17 samples in 2 or 3 columns, 2 to 3 MB each, of which readers of text hold six to eight
    assert peaks[1] < 0.8 * record(120.0).nbytes


@pytest.mark.slow
def test_command(tmp_path):
    path = write_signal(record(10.0), tmp_path / "x.wav")
    result = CliRunner().invoke(app, ["trend", str(path), "--section", "5 s", "--out", str(tmp_path / "trend.csv")])
    assert result.exit_code == 0, result.output
    assert pd.read_csv(tmp_path / "trend.csv")["start_s"].tolist() == [2.0, 2.0, 7.0, 7.0]
    result = CliRunner().invoke(app, ["trend", str(path), "--section", "5 s", "--channel", "a0"])
    # on a slow machine lines of progress come before
    assert any(line.startswith("start_s,gmf_hz,channel,band_1") for line in result.output.splitlines()), result.output
