"""Columns of words, winds and pressures, rows of units, slower channels with steps of their own, and dead channels."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import gearmbs as gm
from gearmbs.signals import SignalFileError, make_signal, read_signal
from gearmbs.signals.signal.labels import measured, name_and_unit, role_of
from gearmbs.signals.signal.loads import load_of
from tests.says import says

RATE, COUNT, SLOWER = 12800.0, 6400, 128
TIME = np.arange(COUNT) / RATE
ACC = np.round(np.cos(2 * np.pi * 725 * TIME) + 0.1 * np.random.default_rng(3).standard_normal(COUNT), 6)
SPEED = 1500.0 + 20.0 * np.sin(2 * np.pi * 2.0 * TIME)
"""rpm; a straight line over a step of the slower ones is off by less than 0.04 rpm."""
OIL = 60.0 + TIME


def table(path, head, *columns):
    """Write lines of a head above columns of numbers or words."""
    rows = zip(*([c if isinstance(c, str) else f"{c:.7g}" for c in column] for column in columns), strict=True)
    path.write_text("\n".join([*head, *(",".join(row) for row in rows)]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("above", [[], ["Device,XY", "Start time,03.05.2024 10:11:12"]])
@pytest.mark.parametrize(
    ("names", "units"),
    [
        ("Time,Vib,Speed,Torque,Temp", "s,m/s2,rpm,Nm,degC"), ("Time,Vib", "sec,g"), ("Zeit,Vib", "ms,mm/s"),
        ("Time,Vib,Flow,p", "s,g,l/min,mbar"), ("t,Moment,Weg", "s,kNm,µm"), ("Time,Vib,Trip,Ind", "s,g,km/h,kW"),
        ("Run 5,A,B", "s,g,Nm"),
    ],
)  # fmt: skip
def test_a_row_of_units_below_the_names(tmp_path, above, names, units):
    wanted, factor = units.split(","), 1e3 if units.startswith("ms") else 1.0
    columns = [factor * TIME, ACC, SPEED, SPEED / 15.0, OIL][: len(wanted)]
    signal = read_signal(table(tmp_path / "u.csv", [*above, names, units], *columns))
    assert signal["channel"].values.tolist() == names.split(",")[1:]
    assert signal["units"].values.tolist() == wanted[1:]
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)


@pytest.mark.parametrize(
    ("label", "parts"),
    [("mm/s", ("mm/s", "mm/s")), ("v / mm/s", ("v", "mm/s")), ("km/h", ("km/h", "km/h")), ("s/m", ("s", "m"))],
)
def test_a_unit_alone_is_no_name_with_a_unit(label, parts):
    assert name_and_unit(label) == parts


def tdms(path, *channels):
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(str(path)) as writer:
        writer.write_segment([ChannelObject("G", name, values, properties=told) for name, values, told in channels])
    return path


def uff(path, *channels):
    import pyuff

    for name, values, unit, step, begin in channels:
        one = {
            "type": 58, "binary": 1, "func_type": 1, "id1": name, "rsp_node": 1, "rsp_dir": 1, "ref_node": 0,
            "ref_dir": 0, "abscissa_spacing": 1, "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s",
            "ordinate_spec_data_type": 0, "ordinate_axis_lab": name, "ordinate_axis_units_lab": unit,
            "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0, "data": values,
            "x": begin + step * np.arange(values.size), "abscissa_min": begin, "abscissa_inc": step,
        }  # fmt: skip
        pyuff.UFF(str(path)).write_sets([one], mode="add")
    return path


def hdf5(path, *channels):
    import h5py

    with h5py.File(path, "w") as file:
        for name, values, unit, rate in channels:
            group = file.create_group(name)
            group.create_dataset("data", data=values)
            group.attrs.update(unit=unit, sample_rate=rate)
    return path


def mdf(path, *channels):
    import asammdf

    with asammdf.MDF() as file:
        for name, values, unit, step in channels:
            file.append([asammdf.Signal(values, step * np.arange(values.size), name=name, unit=unit)])
        file.save(path)
    return path


def slower(folder, kind, step=SLOWER):
    """A file with a speed, a temperature and a torque at a slower rate."""
    few, dt = slice(None, None, step), step / RATE
    if kind == "TDMS":
        told = {"wf_increment": dt, "wf_start_offset": 0.0}
        return tdms(
            folder / "x.tdms", ("acc", ACC, {"wf_increment": 1 / RATE, "unit_string": "g"}),
            ("speed", SPEED[few], {**told, "unit_string": "rpm"}), ("oil", OIL[few], {**told, "unit_string": "°C"}),
            ("M", OIL[few], {**told, "unit_string": "N·m"}),
        )  # fmt: skip
    slow = (("speed", SPEED[few], "rpm", dt), ("oil", OIL[few], "degC", dt), ("M", OIL[few], "Nm", dt))
    if kind == "UFF":
        return uff(folder / "x.uff", ("acc", ACC, "g", 1 / RATE, 0.0), *((*each, 0.0) for each in slow))
    if kind == "HDF5":
        return hdf5(folder / "x.h5", ("acc", ACC, "g", RATE), *((*each[:3], 1 / dt) for each in slow))
    if kind == "MDF":
        pytest.importorskip("asammdf")
        return mdf(folder / "x.mf4", ("acc", ACC, "g", 1 / RATE), *slow)
    cells = [[f"{v:.7g}" if i % step == 0 else "" for i, v in enumerate(c)] for c in (SPEED, OIL, OIL)]
    return table(folder / "x.csv", ["t [s],acc [g],speed [rpm],oil [degC],M [Nm]"], TIME, ACC, *cells)


@pytest.mark.parametrize("kind", ["TDMS", "UFF", "HDF5", "MDF", "CSV"])
def test_slower_channels_are_put_at_their_own_times(tmp_path, kind):
    signal = read_signal(slower(tmp_path, kind))
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    known = slice(0, COUNT - SLOWER + 1)
    assert np.abs(signal.sel(channel="speed").values - SPEED)[known].max() < 0.05
    assert np.abs(signal.sel(channel="oil").values - OIL)[known].max() < 1e-4
    report = gm.analyse(signal)
    assert report.levels["channel"].values.tolist() == ["acc"]
    assert report.speed == pytest.approx(SPEED.mean() * np.pi / 30, rel=1e-4)


@pytest.mark.parametrize("kind", ["TDMS", "UFF", "HDF5"])
def test_vibration_at_several_rates_is_listed_by_channel(tmp_path, kind):
    if kind == "TDMS":
        told = [{"wf_increment": k / RATE, "unit_string": "g"} for k in (1, 2)]
        path = tdms(tmp_path / "x.tdms", ("acc", ACC, told[0]), ("slow acc", ACC[::2], told[1]))
    elif kind == "UFF":
        path = uff(tmp_path / "x.uff", ("acc", ACC, "g", 1 / RATE, 0.0), ("slow acc", ACC[::2], "g", 2 / RATE, 0.0))
    else:
        path = hdf5(tmp_path / "x.h5", ("acc", ACC, "g", RATE), ("slow acc", ACC[::2], "g", RATE / 2))
    with pytest.raises(SignalFileError, match=says("acc", "12800 Hz", "slow acc", "6400 Hz", "--channel")):
        read_signal(path)
    assert read_signal(path, channels=["slow acc"]).attrs["sampling_rate"] == pytest.approx(RATE / 2)


def test_a_slower_channel_of_tdms_that_begins_later_and_one_without_a_step(tmp_path):
    fast = ("acc", ACC, {"wf_increment": 1 / RATE, "unit_string": "g"})
    told = {"wf_increment": SLOWER / RATE, "unit_string": "rpm", "wf_start_offset": 4 * SLOWER / RATE}
    path = tdms(tmp_path / "x.tdms", fast, ("speed", SPEED[4 * SLOWER :: SLOWER], told))
    off = np.abs(read_signal(path).sel(channel="speed").values - SPEED)
    assert off[4 * SLOWER : COUNT - SLOWER].max() < 0.05
    # each of its samples is the first of as many as go into one
    path = tdms(tmp_path / "y.tdms", fast, ("speed", SPEED[::SLOWER], {"unit_string": "rpm"}))
    signal = read_signal(path)
    assert np.abs(signal.sel(channel="speed").values - SPEED)[: COUNT - SLOWER].max() < 0.05
    assert any(pd.Series(signal.attrs["notes"]).str.contains(says("speed", f"each {SLOWER}")))


@pytest.mark.parametrize(("name", "factor"), [("Time [ms]", 1e3), ("Zeit / ms", 1e3), ("t_us", 1e6), ("Time", 1.0)])
def test_a_channel_of_times_of_tdms_has_the_unit_of_its_name(tmp_path, name, factor):
    path = tdms(tmp_path / "x.tdms", (name, factor * TIME, {}), ("acc [g]", ACC, {}), ("Drehzahl [1/min]", SPEED, {}))
    signal = read_signal(path)
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    assert signal["channel"].values.tolist() == ["acc", "Drehzahl"]
    assert signal["units"].values.tolist() == ["g", "1/min"]
    assert read_signal(path, channels=["acc"]).sizes["channel"] == 1
    assert read_signal(path, channels=["acc [g]"])["channel"].values.tolist() == ["acc [g]"]


WORDS = ["OK"] * (COUNT - 1) + ["ALARM"]


@pytest.mark.parametrize("place", [1, 2, 3])
def test_a_column_of_words_is_left_out_with_a_word(tmp_path, place):
    columns = {"t [s]": TIME, "acc [g]": ACC, "speed [rpm]": SPEED}
    names, values = list(columns), list(columns.values())
    names.insert(place, "status")
    values.insert(place, WORDS)
    signal = read_signal(table(tmp_path / "w.csv", ["Rate,12800", ",".join(names)], *values))
    assert signal["channel"].values.tolist() == ["acc", "speed"]
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    np.testing.assert_allclose(signal.sel(channel="acc").values, ACC, atol=1e-6)
    assert any(pd.Series(signal.attrs["notes"]).str.contains(says("'status'", "words", "'OK', 'ALARM'")))


def test_words_that_come_later_are_named_with_their_column(tmp_path):
    """A column of remarks that is empty at first; chosen without it the file is read."""
    said = ["" if i < 1000 else "gear 2" for i in range(COUNT)]
    path = table(tmp_path / "w.csv", ["t [s],acc [g],remark,b [g]"], TIME, ACC, said, ACC)
    with pytest.raises(SignalFileError, match=says("line 1002", "'gear 2'", "'remark'", "--channel")):
        read_signal(path, gaps="interpolate")
    with pytest.raises(SignalFileError, match=says("line 2", "nothing", "'remark'", "--channel")):
        read_signal(path)
    signal = read_signal(path, channels=["b", "acc"])
    assert signal["channel"].values.tolist() == ["b", "acc"]
    with pytest.raises(SignalFileError, match=says("'x'", "acc", "remark")):
        read_signal(path, channels=["x"])


def test_gaps_of_a_torque_are_refused_unless_it_is_written_now_and_then(tmp_path):
    cells = [f"{value:.6g}" if i not in (50, 51) else "" for i, value in enumerate(OIL)]
    path = table(tmp_path / "m.csv", ["t [s],acc [g],M [N m]"], TIME, ACC, cells)
    with pytest.raises(SignalFileError, match=says("'M'", "empty in 2", "--gaps", "--channel")):
        read_signal(path)
    assert read_signal(path, channels=["acc"]).sizes["channel"] == 1
    assert np.abs(read_signal(path, gaps="interpolate").sel(channel="M").values - OIL).max() < 1e-3


def test_a_speed_that_is_missing_for_long_hinders_no_channel_without_it(tmp_path):
    cells = ["" if 1000 < i < 4000 else f"{value:.6g}" for i, value in enumerate(SPEED)]
    path = table(tmp_path / "n.csv", ["t [s],acc [g],n [rpm]"], TIME, ACC, cells)
    with pytest.raises(SignalFileError, match=says("'n'", "--gaps", "channels=")):
        read_signal(path)
    assert read_signal(path, channels=["acc"])["channel"].values.tolist() == ["acc"]


def test_tables_of_one_row_a_channel_and_words_alone_are_refused(tmp_path):
    names, values = ["a", "b"] * (COUNT // 2), ACC
    with pytest.raises(SignalFileError, match=says("'channel'", "'a', 'b'", "row to row")):
        read_signal(table(tmp_path / "l.csv", ["channel,value [g]"], names, values), rate=RATE)
    with pytest.raises(SignalFileError, match=says("w.csv", "'channel,state'")):
        read_signal(table(tmp_path / "w.csv", ["channel,state"], names, names), rate=RATE)
    twice = np.repeat(TIME[: COUNT // 2], 2)
    with pytest.raises(SignalFileError, match=says("'channel'", "'a', 'b'", "row to row")):
        read_signal(table(tmp_path / "t.csv", ["t [s],channel,value [g]"], twice, names, values))
    (tmp_path / "b.txt").write_text("t acc state\n" + "\n".join(f"{k} {0.5 * k} OK" for k in range(40)))
    with pytest.raises(SignalFileError, match=says("b.txt", "words", "semicolons")):
        read_signal(tmp_path / "b.txt")


@pytest.mark.parametrize(
    ("name", "unit", "role"),
    [
        ("wind speed", "m/s", "travel"), ("Windgeschwindigkeit", "m/s", "travel"), ("Wind", "m/s", "travel"),
        ("Vehicle speed", "unknown", "travel"), ("Fahrzeuggeschwindigkeit", "km/h", "travel"),
        ("Strömungsgeschw.", "m/s", "travel"), ("belt speed", "m/s", "travel"), ("flow velocity", "m/s", "travel"),
        # near twins: vibration, and shafts
        ("velocity", "mm/s", None), ("speed", "mm/s", None), ("speed", "km/h", "speed"),
        ("Windseite", "mm/s", None), ("vib velocity", "m/s", None),
        ("Schwinggeschwindigkeit Bandlager", "m/s", None), ("wind turbine rotor speed", "rpm", "speed"),
        ("rotor speed", "unknown", "speed"), ("air gap", "mm", None), ("belt side", "m/s", None),
    ],
)  # fmt: skip
def test_speeds_of_winds_and_vehicles_are_no_vibration(name, unit, role):
    assert role_of(name, unit) == role


@pytest.mark.parametrize(
    ("name", "unit", "load"),
    [
        ("p", "bar", "pressure"), ("Öldruck", "mbar", "pressure"), ("oil pressure", "kPa", "pressure"),
        ("Druck", "unknown", "pressure"), ("Pressure", "psi", "pressure"), ("oil pressure", "Pa", "pressure"),
        ("microphone", "Pa", None), ("sound pressure", "Pa", None), ("Schalldruck", "Pa", None), ("p", "Pa", None),
        ("pressure side acc", "unknown", None), ("Druckseite", "g", None), ("Sound pressure", "unknown", None),
    ],
)  # fmt: skip
def test_pressures_of_oil_are_no_vibration_and_sound_is(name, unit, load):
    assert load_of(name, unit) == load


def test_what_is_left_out_says_what_it_holds():
    columns = np.stack([ACC, OIL, np.full(COUNT, 8.0), np.full(COUNT, 3.0)], 1)
    names, units = ["acc", "oil", "wind speed", "p"], ["g", "°C", "m/s", "bar"]
    left, _ = measured(make_signal(columns, RATE, channels=names, units=units))
    notes = pd.Series(left.attrs["notes"])
    assert left["channel"].values.tolist() == ["acc"]
    for words in (says("'oil'", "60 to 60.5 °C"), says("'wind speed'", "8 m/s"), says("'p'", "pressure", "3 bar")):
        assert notes.str.contains(words).any()


def test_temperatures_and_loads_are_columns_of_features(tmp_path):
    path = table(
        tmp_path / "f.csv", ["t [s],acc [g],n [rpm],oil [degC],M [N m],load [%]"], TIME, ACC, SPEED, OIL, OIL, OIL
    )
    wanted = {"oil.mean": OIL.mean(), "M.mean": OIL.mean(), "load.mean": OIL.mean()}
    for settings in ({}, {"teeth": 29}):
        row = gm.signals.series([path], **settings).iloc[0]
        assert {name: row[name] for name in wanted} == pytest.approx(wanted, rel=1e-6)
    alone = gm.analyse(path, channels=["acc"], speed="1500 rpm")
    assert alone.conditions == {}
    assert gm.analyse(path).to_frame("channel")["oil.mean"].tolist() == pytest.approx([OIL.mean()], rel=1e-6)


@pytest.mark.parametrize(("other", "unit"), [(np.full(COUNT, 1.0), "g"), (np.full(COUNT, 1.0), "unknown"), (OIL, "mm")])
def test_a_channel_of_nothing_takes_nothing_from_the_others(other, unit):
    """A dead sensor, a flag, a position: the acceleration keeps its velocity, band, envelope and lines."""
    steps = np.ptp(other) * np.repeat(np.arange(4), COUNT)
    both = np.stack([np.tile(ACC, 4), np.tile(other, 4) + steps], 1)
    signal = make_signal(both, RATE, channels=["acc", "x"], units=["g", unit])
    alone, both = gm.analyse(signal.sel(channel=["acc"])), gm.analyse(signal)
    for name in ("rms", "velocity_rms"):
        assert both.levels[name].sel(channel="acc") == pytest.approx(float(alone.levels[name].sel(channel="acc")))
    assert float(both.impulsive["best_centre"].sel(channel="acc")) == float(
        alone.impulsive["best_centre"].sel(channel="acc")
    )
    of_acc = both.envelope_lines[both.envelope_lines["channel"] == "acc"]
    np.testing.assert_allclose(of_acc["frequency"], alone.envelope_lines["frequency"])
    told = pd.Series([f"{key}: {why}" for key, why in both.missing.items()])
    assert told.str.contains(says("velocity_rms", "'x'")).any() == (unit != "g")
    assert told.str.contains(says("impulsive", "'x'", "does not change")).any() == (np.ptp(other) == 0.0)
    both.to_markdown()
    both.to_frame("channel")
