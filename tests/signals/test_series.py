"""Many files as one series: one table, in memory for one file, taken up again after being killed."""

import builtins
import errno
import json
import os
import signal as signals
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from gearmbs.signals import SignalError, analyse, features, make_signal, series, to_signal, write_signal
from gearmbs.signals.analysis.series import StoreWarning
from tests.says import says

RATE = 8192.0
TEETH = 20


def snapshot(k, name="acc"):
    """Half a second of a shaft at 25 Hz whose bearing knocks the harder the later."""
    rng = np.random.default_rng(k)
    t = np.arange(4096) / RATE
    x = 0.1 * rng.standard_normal(t.size) + np.cos(2 * np.pi * 25 * t) + np.cos(2 * np.pi * 25 * TEETH * t)
    x[::37] += 0.3 * k
    return make_signal({name: x}, RATE, units="g")


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "run"
    place.mkdir()
    for k in range(12):
        write_signal(snapshot(k), place / f"snap_{k}.csv")
    return place


@pytest.mark.slow
def test_a_folder_becomes_one_table_in_the_order_of_its_numbers(folder):
    table = series(folder, speed="1500 rpm")
    assert table["file"].tolist() == [f"snap_{k}.csv" for k in range(12)]
    assert table["acc.kurtosis"].iloc[-1] > 1.5 * table["acc.kurtosis"].iloc[0]
    # half a second is too short for a velocity from 10 Hz on, and the notes say so
    assert table.columns[table.isna().any()].tolist() == ["acc.velocity_rms"]
    assert table["notes"].str.contains("velocity_rms: signal: 0.5 s are too short").all()
    one = analyse(folder / "snap_3.csv", speed="1500 rpm").to_frame()
    pd.testing.assert_frame_equal(table.iloc[[3]].drop(columns=["file", "units"]).reset_index(drop=True), one)
    assert series(str(folder / "snap_1*.csv"))["file"].tolist() == ["snap_1.csv", "snap_10.csv", "snap_11.csv"]


@pytest.mark.slow
def test_labels_sections_teeth_and_channels(folder):
    loads = series({50: folder / "snap_0.csv", 100: folder / "snap_1.csv"}, teeth=TEETH, speed="1500 rpm")
    assert loads["label"].tolist() == [50, 100]
    assert loads["gmf_hz"].to_numpy() == pytest.approx(500.0, rel=1e-3)
    parts = series([folder / "snap_0.csv"], section="0.25 s")
    assert parts["start_s"].tolist() == [0.0, 0.25]
    by_channel = series([folder / "snap_0.csv"], by="channel")
    assert by_channel["channel"].tolist() == ["acc"]


@pytest.mark.slow
def test_a_file_that_cannot_be_read_is_a_row_with_the_reason(folder):
    (folder / "snap_5.csv").write_text("nothing\n")
    table = series(folder)
    assert "holds no row of numbers" in table["notes"][5]
    assert np.isnan(table["acc.rms"][5])
    with pytest.raises(SignalError, match="holds no row of numbers"):
        series(folder, errors="raise")


def test_channels_whose_names_carry_the_number_of_the_file(tmp_path):
    for k in range(3):
        write_signal(snapshot(k, f"X{k}_DE"), tmp_path / f"{k}.csv")
    table = series(tmp_path)
    assert "X0_DE.rms" in table
    assert "X1_DE.rms" not in table
    assert "its channels are called X1_DE" in table["notes"][1]


CODE = """
import sys
from gearmbs.signals import series
def tell(name, fraction):
    if len(sys.argv) > 3 and fraction > 0.4:
        print("here", flush=True)
        sys.stdin.read()
series(sys.argv[1], store=sys.argv[2], speed="1500 rpm", progress=tell)
"""


@pytest.mark.slow
def test_killed_and_taken_up_again_it_is_the_same_table(folder, tmp_path):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    whole, other = tmp_path / "whole.csv", tmp_path / "killed.csv"
    series(folder, store=whole, speed="1500 rpm")
    words = [sys.executable, "-c", CODE, str(folder), str(other), "stop"]
    with subprocess.Popen(words, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"here\n"
        process.send_signal(signals.SIGKILL)
        process.wait(30)
    journal = tmp_path / "killed.rows.jsonl"
    finished = len(journal.read_text().splitlines()) - 1
    assert 0 < finished < 12
    assert not other.exists()
    with open(journal, "a") as file:
        file.write('{"key": "a line that was being writ')
    seen = []
    table = series(folder, store=other, speed="1500 rpm", progress=lambda name, fraction: seen.append(fraction))
    assert other.read_bytes() == whole.read_bytes()
    assert len(journal.read_text().splitlines()) == 13
    pd.testing.assert_frame_equal(table, series(folder, speed="1500 rpm"))
    assert seen[-1] == 1.0
    with pytest.raises(SignalError, match="begun with other settings"):
        series(folder, store=other, speed="1600 rpm")


@pytest.mark.slow
def test_a_disk_that_fills_up_ends_neither_the_work_nor_its_table(folder, tmp_path, monkeypatch):
    """The journal is given up with a remark; a table without room is kept elsewhere, and the error says where."""
    monkeypatch.chdir(tmp_path)
    whole = series(folder, speed="1500 rpm")
    store = tmp_path / "full" / "table.csv"
    real = builtins.open

    def full(file, mode="r", *args, **settings):
        if str(file).startswith(str(store.parent)) and mode[0] in "aw":
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(file, mode, *args, **settings)

    monkeypatch.setattr(builtins, "open", full)
    with (
        pytest.warns(StoreWarning, match="table.rows.jsonl cannot be written"),
        pytest.raises(SignalError, match=says("space left", "device", "gearmbs-kept-")) as told,
    ):
        series(folder, speed="1500 rpm", store=store)
    monkeypatch.undo()
    kept = next(tmp_path.glob("gearmbs-kept-*/table.csv"))
    assert str(kept) in str(told.value)
    pd.testing.assert_frame_equal(pd.read_csv(kept), whole, check_dtype=False)


@pytest.mark.slow
def test_files_that_come_later_or_change_are_analysed_by_calling_again(folder, tmp_path):
    store = tmp_path / "t.csv"
    series(folder, store=store)
    write_signal(snapshot(12), folder / "snap_12.csv")
    write_signal(snapshot(40), folder / "snap_2.csv")
    journal = tmp_path / "t.rows.jsonl"
    before = len(journal.read_text().splitlines())
    table = series(folder, store=store)
    assert len(table) == 13
    assert table["acc.kurtosis"][2] > table["acc.kurtosis"][11]
    assert len(journal.read_text().splitlines()) == before + 2
    assert all(json.loads(line) for line in journal.read_text().splitlines())


def test_features_of_reports_and_reasons_for_what_is_not_there():
    long = analyse(snapshot(3), TEETH)
    short = analyse(to_signal(snapshot(3).values[:600], rate=RATE), TEETH, speed="1500 rpm", harmonics=1)
    table = features([long, short])
    assert long.indicators is not None
    assert short.indicators is None
    assert short.missing["indicators"] == "the record holds 1.83 revolutions, an average needs 3"
    assert "indicators: the record holds 1.83 revolutions" in table["notes"][1]
    assert "Not available" in short.to_markdown()
    assert features([long], by="channel")["fm4"].item() == long.indicators["fm4"].item()
    with pytest.raises(SignalError, match="there are none"):
        features([])
    with pytest.raises(SignalError, match="NoneType is no report"):
        features([long, None])


@pytest.mark.parametrize(
    ("files", "settings", "said"),
    [
        ([], {}, "names no file"),
        ([np.zeros(9)], {}, says("files", "samples in memory")),
        ({"low": np.zeros(9)}, {}, says("files", "samples in memory")),
        ("none/*.csv", {}, "names no file"),
        ("none.csv", {}, "cannot be opened"),
        ("x", {"errors": "drop"}, "errors: must be"),
    ],
)
def test_wrong_calls(files, settings, said):
    with pytest.raises(SignalError, match=said):
        series(files, **settings)
    with pytest.raises(TypeError):
        series(files if files == "none.csv" else "none.csv", no_such=1)


def test_files_of_other_units_are_converted_to_those_of_the_first(tmp_path):
    """A logger that was changed within a run to failure: the same vibration in m/s^2 is 9.8 times as much."""
    one = snapshot(3)
    write_signal(one, tmp_path / "s0.csv")
    write_signal(make_signal({"acc": 9.80665 * one.values[:, 0]}, RATE, units="m/s^2"), tmp_path / "s1.csv")
    write_signal(make_signal({"acc": one.values[:, 0]}, RATE, units="mm/s"), tmp_path / "s2.csv")
    table = series(tmp_path, store=tmp_path / "out" / "table.csv")
    assert table["units"].tolist() == ["g", "g", "mm/s"]
    for level in ("acc.rms", "acc.peak"):
        assert table[level][1] == pytest.approx(table[level][0], rel=1e-9)
    assert "converted to g" in table["notes"][1]
    assert "CHECK THE UNITS" in table["notes"][2]
    # those of the first file are in the journal
    write_signal(make_signal({"acc": 9.80665 * one.values[:, 0]}, RATE, units="m/s^2"), tmp_path / "s3.csv")
    again = series(tmp_path, store=tmp_path / "out" / "table.csv")
    assert again["acc.rms"][3] == pytest.approx(table["acc.rms"][0], rel=1e-9)
