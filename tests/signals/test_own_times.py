"""Channels with times of their own: read with these, interpolated to those of others, or refused by name."""

from __future__ import annotations

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io

from gearmbs.signals import SignalError, SignalFileError, read_signal, to_signal
from tests.says import says

RATE, COUNT, LINE = 10000.0, 600, 500.0
TIME = np.arange(COUNT) / RATE
A = np.cos(2 * np.pi * LINE * TIME)
CASES = {"rate": 2.0 * TIME, "start": 0.5 + TIME}
"""Times of a second channel, of half the rate or half a second later."""
WRONG = {"rate": ("A 10000 Hz", "B 5000 Hz", "channels=[...]"), "start": ("A at 0 s", "B at 0.5 s", "channels=[...]")}


def groups(path, times, second):
    with h5py.File(path, "w") as file:
        for group, own, values in (("A", TIME, A), ("B", times, second)):
            file[f"{group}/data"], file[f"{group}/time"] = values, own


def structs(path, times, second):
    scipy.io.savemat(path, {"A": {"t": TIME, "x": A}, "B": {"t": times, "x": second}})


def variables(path, times, second):
    scipy.io.savemat(path, {"t_A": TIME, "A": A, "t_B": times, "B": second})


def matrices(path, times, second):
    """A matrix for each channel, times in its first column."""
    scipy.io.savemat(path, {"A": np.stack([TIME, A], axis=1), "B": np.stack([times, second], axis=1)})


def columns(path, times, second):
    table = pd.DataFrame({"Time 1 [s]": TIME, "A [g]": A, "Time 2 [ms]": 1e3 * times, "B [g]": second})
    table.to_csv(path, index=False)


def numbered_columns(path, times, second):
    """Behind a column that counts the rows, the times behind what they are of."""
    pd.DataFrame({"A": A, "t_A [s]": TIME, "B": second, "t_B [us]": 1e6 * times}).to_csv(path, index_label="Nr")


def frames(path, times, second):
    pytest.importorskip("pyarrow")
    pd.DataFrame({"t_A": TIME, "A [g]": A, "t_B": times, "B [g]": second}).to_parquet(path)


WAYS = {
    groups: "g.h5", structs: "s.mat", variables: "v.mat", columns: "c.csv", numbered_columns: "n.csv",
    frames: "f.parquet", matrices: "m.mat",
}  # fmt: skip


def line(signal):
    """Frequency of the largest line of the last channel."""
    spectrum = np.abs(np.fft.rfft(signal.values[:, -1]))
    return int(np.argmax(spectrum)) * signal.attrs["sampling_rate"] / signal.sizes["time"]


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("way", WAYS)
def test_channels_with_times_of_their_own_are_refused_and_read_one_by_one(way, case, tmp_path):
    times = CASES[case]
    way(tmp_path / WAYS[way], times, np.cos(2 * np.pi * LINE * times))
    names = WRONG[case]
    if way is structs:
        names = tuple(name.replace("A ", "A.x ").replace("B ", "B.x ") for name in names)
    if way is matrices:
        names = tuple(name.replace("A ", "A_2 ").replace("B ", "B_2 ") for name in names)
    for given in ({}, {"rate": RATE}, {"gaps": "interpolate"}):
        with pytest.raises(SignalFileError, match=says(*names)):
            read_signal(tmp_path / WAYS[way], **given)
    alone = read_signal(tmp_path / WAYS[way], channels=[{structs: "B.x", matrices: "B_2"}.get(way, "B")])
    assert alone.attrs["sampling_rate"] == pytest.approx((COUNT - 1) / (times[-1] - times[0]))
    assert float(alone["time"][0]) == pytest.approx(times[0])
    assert line(alone) == pytest.approx(LINE)


@pytest.mark.parametrize("way", WAYS)
def test_channels_whose_times_are_the_same_make_one_record(way, tmp_path):
    way(tmp_path / WAYS[way], TIME, -A)
    signal = read_signal(tmp_path / WAYS[way])
    assert signal.sizes["channel"] == 2
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    np.testing.assert_allclose(signal.values, np.stack([A, -A], axis=1), atol=1e-12)


@pytest.mark.parametrize("way", WAYS)
def test_a_rate_that_the_times_contradict_is_refused_naming_both(way, tmp_path):
    way(tmp_path / WAYS[way], TIME, -A)
    with pytest.raises(SignalFileError, match=says("10000", "5000", "rate")):
        read_signal(tmp_path / WAYS[way], rate=5000.0)


def test_times_that_are_only_rounded_take_the_rate_that_is_given(tmp_path):
    """In whole milliseconds, of arrays as of text."""
    scipy.io.savemat(tmp_path / "r.mat", {"t": np.round(TIME, 3), "x": A})
    with pytest.raises(SignalFileError, match=says("time", "rate=")):
        read_signal(tmp_path / "r.mat")
    with pytest.raises(SignalFileError, match=says("time", "8000", "mean rate")):
        read_signal(tmp_path / "r.mat", rate=8000.0)
    assert read_signal(tmp_path / "r.mat", rate=RATE).attrs["sampling_rate"] == RATE


def test_a_column_of_times_behind_the_others_contradicts_a_wrong_rate(tmp_path):
    pd.DataFrame({"acc [g]": A, "Rel time [s]": TIME}).to_csv(tmp_path / "b.csv", index=False)
    with pytest.raises(SignalFileError, match=says("Rel time", "10000", "5000", "--channel")):
        read_signal(tmp_path / "b.csv", rate=5000.0)
    assert read_signal(tmp_path / "b.csv", rate=RATE).attrs["sampling_rate"] == RATE
    assert read_signal(tmp_path / "b.csv", rate=5000.0, channels=["acc"]).attrs["sampling_rate"] == 5000.0


@pytest.mark.parametrize("kind", ["h5", "mat"])
def test_a_speed_with_its_own_times_is_read_at_those_of_the_vibration(kind, tmp_path):
    """As many values as the vibration has samples, or fewer, from before to behind the record."""
    for own in (np.linspace(-0.01, 0.07, COUNT), np.linspace(-0.01, 0.07, 80)):
        rpm, path = 1500.0 + 1000.0 * own, tmp_path / f"slow.{kind}"
        if kind == "h5":
            with h5py.File(path, "w") as file:
                for group, times, values in (("acc", TIME, A), ("rpm", own, rpm)):
                    file[f"{group}/data"], file[f"{group}/time"] = values, times
        else:
            scipy.io.savemat(path, {"acc": A, "time": TIME, "rpm": rpm, "time_rpm": own})
        signal = read_signal(path).sel(channel=["acc", "rpm"])
        assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
        np.testing.assert_allclose(signal.values[:, 1], 1500.0 + 1000.0 * TIME, rtol=1e-12)
        assert any("rpm" in note and "interpolated" in note for note in signal.attrs["notes"])


def test_a_speed_known_over_little_of_the_record_is_refused(tmp_path):
    own = np.linspace(0.0, 0.02, 50)
    table = {"acc": A, "time": TIME, "rpm": 1500.0 + own, "time_rpm": own}
    scipy.io.savemat(tmp_path / "short.mat", table)
    with pytest.raises(SignalFileError, match=says("rpm", "0.02", "0.0599", "--channel")):
        read_signal(tmp_path / "short.mat")
    assert read_signal(tmp_path / "short.mat", channels=["acc"]).attrs["sampling_rate"] == pytest.approx(RATE)
    scipy.io.savemat(tmp_path / "most.mat", table | {"time_rpm": 2.0 * own})
    assert any("ends hold" in note for note in read_signal(tmp_path / "most.mat").attrs["notes"])


def test_times_that_fit_several_arrays_are_asked_for_in_one_line(tmp_path):
    scipy.io.savemat(tmp_path / "m.mat", {"t_left": TIME, "t_right": 2.0 * TIME, "x": A})
    with pytest.raises(SignalFileError, match=says("x", "t_left", "t_right", "10000", "5000", "rate=...")):
        read_signal(tmp_path / "m.mat")
    signal = read_signal(tmp_path / "m.mat", rate=5000.0)
    assert (signal["channel"].values.tolist(), signal.attrs["sampling_rate"]) == (["x"], 5000.0)


@pytest.mark.parametrize("label", ["t_ms", "time [ms]", "Zeit in ms", "Time / ms", "timestamp_ms", "timeMs", "t (us)"])
@pytest.mark.parametrize("index", [False, True])
def test_tables_have_their_times_in_the_unit_that_is_named(label, index, tmp_path):
    table = pd.DataFrame({label: (1e6 if "us" in label else 1e3) * TIME, "acc [g]": A})
    table = table.set_index(label) if index else table
    signal = to_signal(table)
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    assert signal["channel"].values.tolist() == ["acc"]
    table.to_csv(tmp_path / "t.csv", index=index)
    assert read_signal(tmp_path / "t.csv").attrs["sampling_rate"] == pytest.approx(RATE)


@pytest.mark.parametrize(("unit", "factor"), [
    ("s", 1.0), ("ms", 1e3), ("milliseconds", 1e3), ("us", 1e6), ("\u00b5s", 1e6), ("\u03bcs", 1e6), ("ns", 1e9),
    ("min", 1.0 / 60.0), ("", 1.0),
])  # fmt: skip
def test_data_arrays_have_their_times_in_the_unit_of_the_coordinate(unit, factor):
    import xarray as xr

    array = xr.DataArray(A, dims="time", coords={"time": ("time", factor * (1.0 + TIME), {"units": unit})})
    signal = to_signal(array)
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    assert float(signal["time"][0]) == pytest.approx(1.0)
    with pytest.raises(SignalError, match=says("10000", "5000", "rate")):
        to_signal(array, rate=5000.0)


@pytest.mark.parametrize("dates", [False, True])
def test_data_arrays_may_have_dates_or_differences_of_time(dates):
    import xarray as xr

    times = pd.to_timedelta(np.round(1e9 * TIME), unit="ns")
    times = pd.Timestamp("2024-03-12 10:00") + times if dates else times
    signal = to_signal(xr.DataArray(A, dims="time", coords={"time": times}))
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)


def test_a_coordinate_of_something_else_is_no_time():
    import xarray as xr

    with pytest.raises(SignalError, match=says("time", "deg", "attrs['units']")):
        to_signal(xr.DataArray(A, dims="time", coords={"time": ("time", TIME, {"units": "deg"})}))


def test_times_since_1970_begin_together(tmp_path):
    """Of two groups, in whole nanoseconds as loggers count them."""
    stamps = 1_710_237_600_000_000_000 + np.round(1e9 * TIME).astype("i8")
    for shift in (0, 500_000_000):
        with h5py.File(tmp_path / "e.h5", "w") as file:
            for group, own in (("A", stamps), ("B", stamps + shift)):
                file[f"{group}/data"], file[f"{group}/timestamp"] = A, own
        if shift:
            with pytest.raises(SignalFileError, match=says("A at 0 s", "B at 0.5 s")):
                read_signal(tmp_path / "e.h5")
        else:
            assert read_signal(tmp_path / "e.h5").attrs["sampling_rate"] == pytest.approx(RATE)


def test_the_speed_over_a_series_in_ms_is_that_of_the_record():
    speeds = pd.Series(150.0 + 10.0 * np.array([0.0, 1.0, 2.0]), index=pd.Index([0.0, 30.0, 60.0], name="t_ms"))
    signal = to_signal(pd.DataFrame({"acc [g]": A}, index=pd.Index(TIME, name="t")), speed=speeds)
    np.testing.assert_allclose(signal["speed"].values, 150.0 + 10.0 * TIME / 0.03)


@pytest.mark.parametrize("first", [738000.0, 45363.42])
def test_days_without_a_unit_are_asked_for_and_with_one_read(first, tmp_path):
    """MATLAB's datenum, whose digits end at 10 us, and dates of spreadsheets, of which the rate had been 1e9 Hz."""
    days = first + TIME / 86400.0
    pd.DataFrame({"Time": days, "a": A}).to_csv(tmp_path / "a.csv", index=False)
    scipy.io.savemat(tmp_path / "a.mat", {"t": days, "a": A})
    for name in ("a.csv", "a.mat"):
        with pytest.raises(SignalFileError, match=says("time", "days", "Time [d]")):
            read_signal(tmp_path / name)
    pd.DataFrame({"Time [d]": days, "a": A}).to_csv(tmp_path / "b.csv", index=False)
    scipy.io.savemat(tmp_path / "b.mat", {"t": days, "a": A, "tUnit": "d"})
    for name in ("b.csv", "b.mat"):
        given = {"rate": RATE} if first > 1e5 else {}
        assert read_signal(tmp_path / name, **given).attrs["sampling_rate"] == pytest.approx(RATE)
    pd.DataFrame({"t": 45363.42 + TIME, "a": A}).to_csv(tmp_path / "s.csv", index=False)
    assert read_signal(tmp_path / "s.csv").attrs["sampling_rate"] == pytest.approx(RATE)


LVM = ["LabVIEW Measurement", "Separator\tTab", "Decimal_Separator\t.", "X_Columns\tMulti", "***End_of_Header***"]


@pytest.mark.parametrize("case", [None, *CASES])
@pytest.mark.parametrize("increment", [False, True])
def test_columns_of_times_in_lvm_are_those_of_the_channels_behind_them(case, increment, tmp_path):
    times = TIME if case is None else CASES[case]
    told = [f"X0\t0.0\t0.0\t{times[0]}", f"Delta_X\t{TIME[1]}\t{TIME[1]}\t{times[1] - times[0]}"] if increment else []
    rows = [f"{t:.6f}\t{a}\t{-a}\t{own:.6f}\t{a}" for t, a, own in zip(TIME, A, times, strict=True)]
    head = ["Channels\t3", *told, "***End_of_Header***", "X_Value\tA\tC\tX_Value\tB\tComment"]
    (tmp_path / "m.lvm").write_text("\n".join([*LVM, *head, *rows]) + "\n")
    if case is None:
        signal = read_signal(tmp_path / "m.lvm")
        assert (signal.sizes["channel"], signal.attrs["sampling_rate"]) == (3, pytest.approx(RATE))
    else:
        with pytest.raises(SignalFileError, match=says(*WRONG[case])):
            read_signal(tmp_path / "m.lvm")
        alone = read_signal(tmp_path / "m.lvm", channels=["B"])
        assert alone.attrs["sampling_rate"] == pytest.approx(1.0 / (times[1] - times[0]))
        assert float(alone["time"][0]) == pytest.approx(times[0])


SLOW = np.arange(0.0, 6.0, 0.01)
SWING = 1500.0 + 100.0 * np.sin(2 * np.pi * 0.3 * SLOW)
SPEEDS = {
    "whole": (SLOW, SWING, False),
    "run-up": (SLOW[::10], 300.0 * SLOW[::10], False),
    "constant, short": (SLOW[:500], 0.0 * SLOW[:500] + 1500.0, False),
    "short": (SLOW[:400], SWING[:400], True),
    "late": (SLOW[50:], SWING[50:], True),
    "coarse": (SLOW[::100], SWING[::100], True),
}


@pytest.mark.parametrize("name", SPEEDS)
def test_a_speed_that_ends_early_or_is_coarse_is_told(tmp_path, name):
    """Lines by it had been a tenth of what they are, with a remark on interpolation alone."""
    times, speed, told = SPEEDS[name]
    base = np.arange(6000) / 1000.0
    scipy.io.savemat(tmp_path / "r.mat", {"t_A": base, "A": np.cos(300.0 * base), "t_speed": times, "speed": speed})
    notes = read_signal(tmp_path / "r.mat").attrs["notes"]
    assert any("CHECK THE SPEED" in note for note in notes) == told
