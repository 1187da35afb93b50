"""Text tables with rows of types, durations, headers of oscilloscopes beside them, or columns with their own times."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from gearmbs.signals import SignalFileError, analyse, read_signal
from gearmbs.signals.signal.labels import measured
from tests.says import says

RATE, COUNT, RPM = 10000.0, 600, 1482.0
TIME = np.arange(COUNT) / RATE
A = np.round(np.cos(2 * np.pi * 494 * TIME), 5)


def read(tmp_path, head, row, name="t.csv"):
    path = tmp_path / name
    path.write_text("\n".join([*head, *(row(i) for i in range(COUNT))]) + "\n", encoding="utf-8")
    return read_signal(path)


def names(signal):
    return [str(name) for name in signal["channel"].values]


@pytest.mark.parametrize("types", [
    "f8,f8,f8", "<f8,<f8,<f8", "f4,f4,i2", "float64,float64,int32", "Float64,Float64,Float64",
    "datetime64[ns],float64,float64", "object,float64,float64", "duration,double,single", "double,double,double",
    "POSIXct,numeric,numeric", "dbl,dbl,dbl", "num,num,int",
    "TIME,REAL,LREAL", "FLOAT32,REAL,DINT", "DBL,DBL,DBL", "text,text,text", "timestamp,bigint,smallint",
    "DECIMAL(10,3),NUMERIC(8),REAL", "unsigned int,long double,float",
])  # fmt: skip
@pytest.mark.parametrize("above", [False, True])
def test_a_row_of_types_is_no_heading(types, above, tmp_path):
    """Above the headings or below; its commas in brackets are those of quoted cells."""
    types = ",".join(f'"{cell}"' for cell in types.replace("(10,3)", "(10;3)").split(",")).replace(";", ",")
    head = [types, "time,acc,rpm"] if above else ["time,acc,rpm", types]
    signal = read(tmp_path, head, lambda i: f"{TIME[i]:.4f},{A[i]},{RPM}")
    assert names(signal) == ["acc", "rpm"]
    assert signal.attrs["sampling_rate"] == RATE
    assert measured(signal)[1] == "rpm"


@pytest.mark.parametrize("head", ["Time,Real", "Time,Double"])
def test_words_of_types_are_headings_where_no_others_stand(head, tmp_path):
    signal = read(tmp_path, [head], lambda i: f"{TIME[i]:.4f},{A[i]}")
    assert names(signal) == [head.split(",")[1]]
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)


@pytest.mark.parametrize(
    ("written", "unit"), [("{:.6g}", "sec"), ("{:.4g}", "ms"), ("{:.9g}", "min"), ("{:.12g}", "hr")]
)
def test_durations_of_a_timetable_are_times(written, unit, tmp_path):
    parts = TIME / {"sec": 1.0, "ms": 1e-3, "min": 60.0, "hr": 3600.0}[unit]
    signal = read(tmp_path, ["Time,acc,rpm"], lambda i: f"{written.format(parts[i])} {unit},{A[i]},{RPM}")
    assert names(signal) == ["acc", "rpm"]
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE, rel=1e-6)


def test_dates_with_names_of_months_are_times_and_rounded_ones_ask_for_the_rate(tmp_path):
    signal = read(tmp_path, ["Time,acc"], lambda i: f"12-Mar-2024 10:00:{TIME[i]:07.4f},{A[i]}")
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE, rel=1e-6)
    with pytest.raises(SignalFileError, match=says("time", "not uniform", "rate=")):
        read(tmp_path, ["Time,acc"], lambda i: f"12-Mar-2024 10:00:{i // 100:02d},{A[i]}")


def beside(keys, blank):
    """Rows of a header beside the table's, and behind it the rows of the table alone."""
    return lambda i: f"{keys.get(i, blank)}{TIME[i] - 0.01:.6f}, {A[i]:.5f},"


TEKTRONIX = {0: "Record Length,600,", 1: "Sample Interval,1.0e-04,", 6: "Source,CH3,", 7: "Vertical Units,V,"}
TOLD = {0: "Record Length,600,Points,", 1: "Sample Interval,1.0e-04,s,"}
TWO = ["X,CH1,CH2,Start,Increment,", "Sequence,Volt,Volt,-1.0e-02,1.0e-04"]


@pytest.mark.parametrize(("head", "row", "channels"), [
    (["X,CH1,Start,Increment,", "Sequence,Volt,-1.0e-02,1.0e-04"], lambda i: f"{i},{A[i]},,", ["CH1"]),
    (["X,CH1,D7-D0,D15-D8,Start,Increment,", "Sequence,Volt,,,-1.0e-02,1.0e-04"], lambda i: f"{i},{A[i]},0x00,0x1F,",
     ["CH1"]),
    (TWO, lambda i: f"{i},{A[i]},{-A[i]},,", ["CH1", "CH2"]),
    (["CH1(V),CH2(V),t0 = -0.01, tInc = 1e-04,"], lambda i: f"{A[i]},{-A[i]},,,", ["CH1", "CH2"]),
    (["Time(s),CH1(V),t0 = -0.01, tInc = 1e-04,"], lambda i: f"{TIME[i] - 0.01:.6e},{A[i]},,", ["CH1"]),
    ([], beside(TEKTRONIX, ",,"), ["CH3"]),
    ([], beside(TOLD, ",,,"), ["CH1"]),
])  # fmt: skip
def test_tables_of_oscilloscopes(head, row, channels, tmp_path):
    signal = read(tmp_path, head, row)
    assert names(signal) == channels
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    assert float(signal["time"][0]) == pytest.approx(-0.01)
    assert np.allclose(signal.values[:, 0], A)


@pytest.mark.parametrize(("head", "scale"), [
    ("time,acc,time_speed,speed_rpm", 1.0), ("t1 [s],acc [g],t2 [ms],rpm [1/min]", 1e3),
    ("Zeit,acc,Zeit_2,Drehzahl [1/min]", 1.0),
])  # fmt: skip
def test_a_slow_speed_with_its_own_times_is_interpolated_to_those_of_the_others(head, scale, tmp_path):
    every = 50

    def row(i):
        slow = f"{scale * TIME[i] * every:.6f},{RPM + i}" if i < COUNT // every else ","
        return f"{TIME[i]:.4f},{A[i]},{slow}"

    signal = read(tmp_path, [head], row)
    assert signal.sizes["channel"] == 2
    assert np.allclose(signal.values[:, 0], A)
    # once each 50 samples one turn a minute more, and the last value to the end
    assert np.allclose(signal.values[:, 1], RPM + np.minimum(np.arange(COUNT) / every, COUNT // every - 1))
    assert any("times of its own" in note for note in signal.attrs["notes"])
    assert "1 channels" in str(analyse(tmp_path / "t.csv"))
    pieces = pd.DataFrame({"t": TIME, "a": A, "t_b": TIME, "b": -A})
    pieces.to_csv(tmp_path / "same.csv", index=False)
    assert names(read_signal(tmp_path / "same.csv")) == ["a", "b"]


def test_vibration_with_its_own_times_is_refused_by_name(tmp_path):
    def row(i):
        return f"{TIME[i]:.4f},{A[i]}," + (f"{2 * TIME[i]:.4f},{A[i]}" if 2 * i < COUNT else ",")

    with pytest.raises(SignalFileError, match=says("a", "b", "10000", "5000", "--channel")):
        read(tmp_path, ["t_a,a,t_b,b"], row)
    alone = read_signal(tmp_path / "t.csv", channels=["b"])
    assert (names(alone), alone.attrs["sampling_rate"], alone.sizes["time"]) == (["b"], RATE / 2, COUNT // 2)


def test_a_dash_is_no_unit_and_no_heading(tmp_path):
    signal = read(tmp_path, ["Nr;t_ms;acc;n", "-;ms;g;1/min"], lambda i: f"{i + 1};{1e3 * TIME[i]:.1f};{A[i]};{RPM}")
    assert names(signal) == ["acc", "n"]
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
