"""Files as loggers of three languages write them: rate, channels and speed right, and no time or speed as vibration."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pytest

import gearmbs as gm
from gearmbs.signals import MissingMetadataError, SignalError, SignalFileError, read_signal
from gearmbs.signals.signal.labels import measured, name_and_unit, rises_evenly, role_of
from tests.says import says

RATE, COUNT, RPM = 12800.0, 3200, 1500.0
TIME = np.arange(COUNT) / RATE
RNG = np.random.default_rng(4)
A1 = np.round(np.cos(2 * np.pi * 800 * TIME) + 0.1 * RNG.standard_normal(COUNT), 6)
A2 = np.round(0.5 * np.sin(2 * np.pi * 1600 * TIME) + 0.1 * RNG.standard_normal(COUNT), 6)
SPEED = np.round(RPM + 0.5 * np.sin(2 * np.pi * 3.0 * TIME), 3)
OIL = np.round(61.0 + 0.2 * TIME, 3)
LOAD = np.round(120.0 + 2.0 * np.sin(2 * np.pi * 5.0 * TIME), 3)
SLOW = slice(None, None, 64)
"""Samples of loggers that write speed and temperature less often."""


class Language(NamedTuple):
    """How a laboratory writes: words, separator, decimal sign, encoding of its programs."""

    time: str
    case: str
    lid: str
    speed: str
    rpm: str
    oil: str
    rate: str
    row: str
    torque: str
    state: str
    preposition: str
    separator: str
    decimal: str
    encoding: str


LANGUAGES = {
    "English": Language(
        "Time", "Case", "Lid", "Shaft speed", "rpm", "Oil temperature", "Sampling frequency", "Sample", "Input torque",
        "State", "in", ",", ".", "utf-8",
    ),
    "German": Language(
        "Zeit", "Gehäuse", "Deckel", "Drehzahl", "1/min", "Öltemperatur", "Abtastrate", "Nr", "Drehmoment", "Zustand",
        "in", ";", ",", "cp1252",
    ),
    "Czech": Language(
        "Čas", "Skříň", "Víko", "Otáčky", "ot/min", "Teplota oleje", "Vzorkovací frekvence", "Nr",
        "Kroutící moment", "Stav", "v", ";", ",", "cp1250",
    ),
    "French": Language(
        "Temps", "Carter", "Couvercle", "Vitesse de rotation", "tr/min", "Température d'huile",
        "Fréquence d'échantillonnage", "Nr", "Couple", "État", "en", "\t", ",", "utf-8-sig",
    ),
}  # fmt: skip


def text(of: Language, head: list[str], *columns: np.ndarray | list[str]) -> bytes:
    """A table in the language's signs, below the lines of a head."""
    cells = [
        [value if isinstance(value, str) else f"{value:.6f}".replace(".", of.decimal) for value in column]
        for column in columns
    ]
    lines = [*head, *(of.separator.join(row) for row in zip(*cells))]
    return ("\r\n".join(lines) + "\r\n").encode(of.encoding)


def labels(of: Language, form: str, *pairs: tuple[str, str]) -> str:
    return of.separator.join(form.format(name, unit) if unit else name for name, unit in pairs)


def named(of: Language) -> list[tuple[str, str]]:
    return [(of.time, "s"), (of.case, "m/s2"), (of.lid, "m/s2"), (of.speed, of.rpm), (of.oil, "°C")]


def brackets(of: Language) -> bytes:
    return text(of, [labels(of, "{} [{}]", *named(of))], TIME, A1, A2, SPEED, OIL)


def quotients(of: Language) -> bytes:
    pairs = [(of.time, "ms"), *named(of)[1:3], (of.speed, f"({of.rpm})"), (of.oil, "°C")]
    return text(of, [labels(of, "{} / {}", *pairs)], 1e3 * TIME, A1, A2, SPEED, OIL)


def in_words(of: Language) -> bytes:
    pairs = [(of.time, "ms"), *named(of)[1:]]
    return text(of, [labels(of, "{} " + of.preposition + " {}", *pairs)], 1e3 * TIME, A1, A2, SPEED, OIL)


def units_below(of: Language) -> bytes:
    names, units = zip(*named(of), strict=True)
    head = ["catman export", f"{of.rate}: 12800 Hz", of.separator.join(names), of.separator.join(units)]
    return text(of, head, TIME, A1, A2, SPEED, OIL)


def rate_in_the_head(of: Language) -> bytes:
    return text(of, [f"{of.rate}: 12800 Hz", labels(of, "{} [{}]", *named(of)[1:])], A1, A2, SPEED, OIL)


def numbered_rows(of: Language) -> bytes:
    head = [f"# {of.rate}: 12800", labels(of, "{} ({})", (of.row, ""), *named(of)[1:])]
    return text(of, head, [str(i) for i in range(COUNT)], A1, A2, SPEED, OIL)


def slow_columns(of: Language) -> bytes:
    """Speed and temperature every 64 samples, the cells between them empty."""
    slow = [
        [f"{value:.3f}".replace(".", of.decimal) if i % 64 == 0 else "" for i, value in enumerate(column)]
        for column in (SPEED, OIL)
    ]
    pairs = [*named(of)[:2], *named(of)[3:], named(of)[2]]
    return text(of, [labels(of, "{} [{}]", *pairs)], TIME, A1, *slow, A2)


def tacho_beside(of: Language) -> bytes:
    pulses = 5.0 * ((TIME * RPM / 60.0) % 1.0 < 0.05)
    pairs = [*named(of)[:3], ("Tacho", "V"), *named(of)[3:]]
    return text(of, [labels(of, "{} [{}]", *pairs)], TIME, A1, A2, pulses, SPEED, OIL)


def more_units_below(of: Language) -> bytes:
    """Times in ms, a torque, velocities; a line of the device above all."""
    names = [of.time, of.case, of.lid, of.speed, of.torque, of.oil]
    units = ["msec", "mm/s", "mm/s", of.rpm, "Nm", "°C"]
    head = [f"Device{of.separator}X 12", of.separator.join(names), of.separator.join(units)]
    return text(of, head, 1e3 * TIME, A1, A2, SPEED, LOAD, OIL)


def loads_beside(of: Language) -> bytes:
    pairs = [(of.time, "s"), (of.torque, "N·m"), *named(of)[1:4], ("P", "kW"), ("I", "A"), ("p", "bar"), ("v", "km/h")]
    steady = [np.full(COUNT, value) for value in (18.8, 27.5, 2.1, 60.0)]
    return text(of, [labels(of, "{} [{}]", *pairs)], TIME, LOAD, A1, A2, SPEED, *steady)


def words_beside(of: Language) -> bytes:
    """A state in words, a remark in a few rows."""
    state = ["OK" if i < COUNT // 2 else "ALARM" for i in range(COUNT)]
    remark = ["start" if i == 7 else "" for i in range(COUNT)]
    pairs = [*named(of)[:2], (of.state, ""), *named(of)[2:4], ("Info", ""), named(of)[4]]
    return text(of, [labels(of, "{} [{}]", *pairs)], TIME, A1, state, A2, SPEED, remark, OIL)


def lvm(of: Language) -> bytes:
    rows = [
        "LabVIEW Measurement", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t.", "***End_of_Header***",
        "Channels\t3", f"Samples\t{COUNT}\t{COUNT}\t{COUNT}", f"Y_Unit_Label\tm/s^2\tm/s^2\t{of.rpm}",
        "X0\t0.0\t0.0\t0.0", "Delta_X\t7.8125E-5\t7.8125E-5\t7.8125E-5", "***End_of_Header***",
        f"X_Value\t{of.case}\t{of.lid}\t{of.speed}\tComment",
        *(f"{t:.9f}\t{a}\t{b}\t{n}" for t, a, b, n in zip(TIME, A1, A2, SPEED, strict=True)),
    ]  # fmt: skip
    return ("\r\n".join(rows) + "\r\n").encode("utf-8")


def tdms(of: Language, path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    def channel(name, values, unit, rate):
        told = {"unit_string": unit, "wf_increment": 1.0 / rate, "wf_start_offset": 0.0, "wf_samples": 1}
        return ChannelObject("Log", name, values, properties=told)

    with TdmsWriter(str(path)) as writer:
        writer.write_segment(
            [
                channel(of.case, A1, "m/s^2", RATE),
                channel(of.lid, A2, "m/s^2", RATE),
                channel(of.speed, SPEED[SLOW], of.rpm, RATE / 64),
                channel(of.oil, OIL[SLOW], "°C", RATE / 64),
            ]
        )


def tdms_with_times(of: Language, path: Path) -> None:
    """Units stand in the names alone, times in ms are a channel."""
    from nptdms import ChannelObject, TdmsWriter

    columns = zip([(of.time, "ms"), *named(of)[1:]], (1e3 * TIME, A1, A2, SPEED, OIL), strict=True)
    with TdmsWriter(str(path)) as writer:
        writer.write_segment([ChannelObject("Log", f"{name} [{unit}]", values) for (name, unit), values in columns])


def uff(of: Language, path: Path) -> None:
    import pyuff

    slow = 64 / RATE
    for (name, unit), values, step in zip(
        named(of)[1:], (A1, A2, SPEED[SLOW], OIL[SLOW]), (1 / RATE, 1 / RATE, slow, slow), strict=True
    ):
        one = {
            "type": 58, "binary": 1, "func_type": 1, "id1": name, "rsp_node": 1, "rsp_dir": 1, "ref_node": 0,
            "ref_dir": 0, "abscissa_spacing": 1, "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s",
            "ordinate_spec_data_type": 0, "ordinate_axis_lab": "", "ordinate_axis_units_lab": unit,
            "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0, "data": values,
            "x": step * np.arange(values.size), "abscissa_min": 0.0, "abscissa_inc": step,
        }  # fmt: skip
        pyuff.UFF(str(path)).write_sets([one], mode="add")


def hdf5_groups(of: Language, path: Path) -> None:
    """A group for each channel, with its own rate."""
    import h5py

    with h5py.File(path, "w") as file:
        for (name, unit), values in zip(named(of)[1:], (A1, A2, SPEED[SLOW], OIL[SLOW]), strict=True):
            group = file.create_group(name)
            group.create_dataset("data", data=values)
            group.attrs.update(unit=unit, sample_rate=RATE * values.size / COUNT)


def mdf(of: Language, path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF() as file:
        for (name, unit), values in zip(named(of)[1:], (A1, A2, SPEED[SLOW], OIL[SLOW]), strict=True):
            times = np.arange(values.size) * (COUNT / values.size / RATE)
            file.append([asammdf.Signal(values, times, name=name, unit=unit)])
        file.save(path)


def hdf5(of: Language, path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        group = file.create_group("measurement")
        group.attrs["sampling_rate"] = RATE
        for (name, unit), values in zip(named(of)[1:], (A1, A2, SPEED, OIL), strict=True):
            group.create_dataset(name, data=values).attrs["unit"] = unit


def matlab(of: Language, path: Path) -> None:
    """A matrix without names: times in the first column; the speed beside it."""
    import scipy.io

    scipy.io.savemat(path, {"data": np.stack([TIME, A1, A2], axis=1), "rpm": SPEED[:, None]})


TEXTS: dict[str, Callable[[Language], bytes]] = {
    f.__name__: f
    for f in (
        brackets, quotients, in_words, units_below, rate_in_the_head, numbered_rows, slow_columns, tacho_beside, lvm,
        more_units_below, loads_beside, words_beside,
    )
}  # fmt: skip
BINARIES: dict[str, tuple[str, Callable[[Language, Path], None]]] = {
    "TDMS": (".tdms", tdms),
    "HDF5": (".h5", hdf5),
    "MATLAB": (".mat", matlab),
    "TDMS with times": (".tdms", tdms_with_times),
    "UFF": (".uff", uff),
    "HDF5 by groups": (".h5", hdf5_groups),
    "MDF": (".mf4", mdf),
}
FILES = [
    (logger, language)
    for logger in (*TEXTS, *BINARIES)
    for language in LANGUAGES
    if logger != "MATLAB" or language == "English"
]


def made(folder: Path, logger: str, language: str) -> Path:
    of = LANGUAGES[language]
    if logger in TEXTS:
        path = folder / f"record{'.lvm' if logger == 'lvm' else '.csv'}"
        path.write_bytes(TEXTS[logger](of))
        return path
    ending, write = BINARIES[logger]
    write(of, folder / f"record{ending}")
    return folder / f"record{ending}"


def test_there_are_73_files_of_nineteen_loggers():
    assert len(FILES) == 73
    assert len({logger for logger, _ in FILES}) == 19


@pytest.mark.parametrize(("logger", "language"), FILES)
def test_a_file_is_read_as_its_laboratory_means_it(tmp_path, logger, language):
    of = LANGUAGES[language]
    signal = read_signal(made(tmp_path, logger, language))
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE, rel=1e-6)
    left, speed = measured(signal)
    channels = [str(name) for name in left["channel"].values if name != speed]
    assert len(channels) == 2
    if logger != "MATLAB":
        by_name = {name.rpartition(".")[2].rpartition("/")[2]: name for name in channels}
        channels = [by_name[of.case], by_name[of.lid]]
    np.testing.assert_allclose(left.sel(channel=channels).values, np.stack([A1, A2], axis=1), atol=1e-6)
    told = list(map(str, signal["channel"].values))
    of_speed = next(name for name in told if name not in channels and (logger == "MATLAB" or of.speed in name))
    # also of the loggers that write it less often: it is known up to the last sample of theirs
    off = np.abs(signal.sel(channel=of_speed).values - SPEED)[: COUNT - 64]
    assert off.max() < 2e-3
    report = gm.analyse(signal)
    assert sorted(str(name) for name in report.levels["channel"].values) == sorted(channels)
    assert report.speed == pytest.approx(RPM * np.pi / 30, rel=1e-3)


ANGLE = np.round((6.0 * RPM * TIME) % 360.0, 4)
FORMS: dict[str, tuple[str, str, tuple[np.ndarray, ...], int]] = {
    "a temperature called T beside a speed in front": ("Fs: 12800\nn [1/min];a [g];T [°C]", ";", (SPEED, A1, OIL), 1),
    "a unit of time for a name": ("ms,acc", ",", (1e3 * TIME, A1), 1),
    "units alone below names": ("dt = 7.8125E-05 s\nGehäuse\tDrehzahl\nm/s²\t1/min", "\t", (A1, SPEED), 1),
    "times of each column": ("time[0]\tY[0]\ttime[1]\tY[1]", "\t", (TIME, A1, TIME, A2), 2),
    "turns in Hz": ("t [s],shaft [Hz],acc [g]", ",", (TIME, SPEED / 60.0, A1), 1),
    "the angle of a shaft": ("t [s],Winkel [°],acc [g]", ",", (TIME, ANGLE, A1), 1),
    "vibration in degrees": ("t [s],torsion [deg],acc [g]", ",", (TIME, A2, A1), 2),
    "Italian": ("Tempo [s];Accelerazione [m/s2];Giri [giri/min]", ";", (TIME, A1, SPEED), 1),
    "Polish": ("Czas [s];Drgania [m/s2];Obroty [obr/min]", ";", (TIME, A1, SPEED), 1),
    "types of numbers below units": ("Zeit;a;n\ns;g;1/min\nDouble;DT_FLOAT;Int32", ";", (TIME, A1, np.rint(SPEED)), 1),
    "units above names": ("s\tm/s^2\trpm\nTime\tHSG:+X\tTacho1", "\t", (TIME, A1, SPEED), 1),
    "times behind numbers of rows": ("X-axis unit:\ts\n", "\t", (np.arange(1.0, COUNT + 1.0), TIME, A1), 1),
    "an oscilloscope": ("Time,Channel A,Channel B\n(ms),(mV),(V)\n", ",", (1e3 * TIME, A1, A2), 2),
}
"""What a header says, the sign between columns, the columns, and how many are vibration."""


@pytest.mark.parametrize("form", FORMS)
def test_forms_of_other_programs(tmp_path, form):
    head, sign, columns, count = FORMS[form]
    path = tmp_path / "x.csv"
    path.write_text("\n".join([head, *(sign.join(f"{v:.9g}" for v in row) for row in zip(*columns))]), encoding="utf-8")
    report = gm.analyse(path)
    assert report.rate == pytest.approx(RATE)
    assert report.levels.sizes["channel"] == count
    if any(column is SPEED for column in columns) or "Hz" in form:
        assert report.speed == pytest.approx(RPM * np.pi / 30, rel=1e-3)


def test_a_temperature_called_T_is_no_time_in_tables_and_hdf5(tmp_path):
    import h5py

    report = gm.analyse(pd.DataFrame({"T [°C]": OIL, "t [s]": TIME, "a [g]": A1}))
    assert (report.rate, list(report.levels["channel"].values)) == (pytest.approx(RATE), ["a"])
    with h5py.File(tmp_path / "x.h5", "w") as file:
        for name, values, unit in (("T", OIL, "°C"), ("a", A1, "g"), ("t", TIME, "s")):
            file.create_dataset(name, data=values).attrs["unit"] = unit
    report = gm.analyse(tmp_path / "x.h5")
    assert (report.rate, list(report.levels["channel"].values)) == (pytest.approx(RATE), ["a"])


def test_an_even_first_column_in_another_unit_than_seconds_is_asked_for(tmp_path):
    path = tmp_path / "x.csv"
    np.savetxt(path, np.stack([1e6 * TIME, A1], axis=1), fmt="%.8e", delimiter=",")
    with pytest.raises(MissingMetadataError, match=says("rate", "x.csv")):
        read_signal(path)
    assert read_signal(path, rate=RATE).sizes["channel"] == 1


def test_bare_numbers_with_an_even_first_column(tmp_path):
    path = tmp_path / "bare.txt"
    np.savetxt(path, np.stack([TIME, A1], axis=1), fmt="%.8e")
    signal = read_signal(path)
    assert signal.sizes["channel"] == 1
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    assert any("rises evenly" in note for note in signal.attrs["notes"])
    np.savetxt(path, np.stack([A2, A1], axis=1), fmt="%.8e")
    assert read_signal(path, rate=RATE).sizes["channel"] == 2
    with pytest.raises(MissingMetadataError, match=says("rate", "ch1", "ch2")):
        read_signal(path)


def test_rates_that_differ_are_listed_with_their_channels(tmp_path):
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(str(tmp_path / "two.tdms")) as writer:
        for name, values, step in (("fast", A1, 1 / RATE), ("slow", A2[::4], 4 / RATE)):
            writer.write_segment([ChannelObject("Log", name, values, properties={"wf_increment": step})])
    with pytest.raises(SignalFileError, match=says("fast", "slow", "channel")):
        read_signal(tmp_path / "two.tdms")
    assert read_signal(tmp_path / "two.tdms", channels=["slow"]).attrs["sampling_rate"] == pytest.approx(RATE / 4)


@pytest.mark.parametrize(
    ("label", "name", "unit"),
    [
        ("t / ms", "t", "ms"), ("n / (1/min)", "n", "1/min"), ("a/(m/s²)", "a", "m/s²"), ("p / bar", "p", "bar"),
        ("Zeit in s", "Zeit", "s"), ("Accélération en m/s²", "Accélération", "m/s²"), ("Čas v ms", "Čas", "ms"),
        ("acc [g]", "acc", "g"), ("acc (g)", "acc", "g"), ("left/right", "left/right", "unknown"),
        ("gear in mesh", "gear in mesh", "unknown"), ("a / b", "a / b", "unknown"), ("case", "case", "unknown"),
    ],
)  # fmt: skip
def test_names_and_units_of_labels(label, name, unit):
    assert name_and_unit(label) == (name, unit)


@pytest.mark.parametrize(
    ("name", "unit", "role"),
    [
        ("Drehzahl", "1/min", "speed"), ("Otáčky", "unknown", "speed"), ("x", "tr/min", "speed"),
        ("speed", "Hz", "speed"), ("Fahrzeuggeschwindigkeit", "km/h", "travel"),
        ("velocity", "mm/s", None), ("speed", "mm/s", None),
        ("Vitesse vibratoire", "mm/s", None), ("n", "m/s^2", None),
        ("Lagertemperatur", "K", "temperature"), ("T1", "°C", "temperature"), ("temps", "ms", "time"),
        ("Čas", "s", "time"),
        ("Tacho", "V", "tacho"), ("tacho", "m/s^2", None), ("Keyphasor", "unknown", "tacho"), ("torque", "N*m", None),
        ("acc", "g", None), ("ch1", "unknown", None), ("top", "g", None), ("temporal", "g", None), ("K1", "K", None),
    ],
)  # fmt: skip
def test_what_columns_are(name, unit, role):
    assert role_of(name, unit) == role


def test_values_tell_a_count_and_a_speed_called_n():
    assert rises_evenly(np.arange(100.0))
    assert rises_evenly(np.round(TIME, 4))
    assert not rises_evenly(np.cumsum(RNG.random(3200)) ** 1.3)
    assert not rises_evenly(A1)
    assert role_of("x", "unknown", TIME) == "count"
    assert role_of("ramp", "N", TIME) is None
    assert role_of("n", "unknown", SPEED) == "speed"
    assert role_of("n", "unknown", A1) is None


def test_what_the_caller_asks_for_stays():
    signal = gm.signals.make_signal(np.stack([A1, SPEED], 1), RATE, channels=["a", "n"], units=["m/s^2", "rpm"])
    assert measured(signal, named=["a", "n"]) == (signal, None)
    left, speed = measured(signal, used=["n"])
    assert speed is None
    assert list(left["channel"].values) == ["a", "n"]
    left, speed = measured(signal, speed_known=True)
    assert (list(left["channel"].values), speed) == (["a"], None)
    alone, speed = measured(signal.sel(channel=["n"]))
    assert (list(alone["channel"].values), speed) == (["n"], None)
    assert any(pd.Series(alone.attrs["notes"]).str.contains(says("'n'", "speed", "nothing else")))
    told = gm.analyse(signal, speed="1600 rpm")
    assert told.speed == pytest.approx(1600 * np.pi / 30)
    assert list(told.levels["channel"].values) == ["a"]


def test_of_two_speeds_or_one_without_a_unit_is_asked_in_one_line():
    values = np.stack([A1, SPEED, 0.5 * SPEED], 1)
    two = gm.signals.make_signal(values, RATE, channels=["a", "n1", "n2"], units=["g", "rpm", "rpm"])
    with pytest.raises(MissingMetadataError, match=says("n1", "n2", "--speed-channel")):
        gm.analyse(two)
    assert gm.analyse(two, speed_channel="n2").speed == pytest.approx(0.5 * RPM * np.pi / 30, rel=1e-3)
    bare = gm.signals.make_signal(values[:, :2], RATE, channels=["a", "Drehzahl"], units=["g", "unknown"])
    report = gm.analyse(bare)
    assert list(report.levels["channel"].values) == ["a"]
    assert any("--units 'Drehzahl=rpm'" in note for note in report.notes)
    assert gm.analyse(bare, units={"Drehzahl": "rpm"}).speed == pytest.approx(RPM * np.pi / 30, rel=1e-3)


def test_the_sign_of_a_speed_is_told():
    """Negative throughout: its amount. A few samples: rest. Many: the shaft turns back, and nothing is guessed."""
    for wrong, words in ((-SPEED, "negative"), (np.where(np.arange(COUNT) < 5, -SPEED, SPEED), "5 samples")):
        signal = gm.signals.make_signal(np.stack([A1, wrong], 1), RATE, channels=["a", "n"], units=["g", "rpm"])
        report = gm.analyse(signal)
        assert report.speed == pytest.approx(RPM * np.pi / 30, rel=2e-3)
        assert any(words in note and "'n'" in note for note in report.notes)
    turning = np.where(np.arange(COUNT) < COUNT // 4, -SPEED, SPEED)
    signal = gm.signals.make_signal(np.stack([A1, turning], 1), RATE, channels=["a", "n"], units=["g", "rpm"])
    with pytest.raises(SignalError, match=says("speed_channel", "'n'", "25 %", "cut the record")):
        gm.analyse(signal)


@pytest.mark.parametrize("gap", [1, 40])
def test_a_speed_that_is_missing_in_rows_is_told_and_refused_where_it_is_long(gap, tmp_path):
    path = tmp_path / "record.csv"

    def written(there):
        table = pd.DataFrame({"t [s]": TIME, "a [g]": A1, "n [rpm]": np.where(there, SPEED, np.nan)})
        table.to_csv(path, index=False)
        return path

    rows = np.arange(COUNT)
    for there in (rows % (gap + 1) == 0, (rows < 100) | (rows >= 100 + gap)):
        report = gm.analyse(written(there))
        assert report.speed == pytest.approx(RPM * np.pi / 30, rel=1e-3)
        assert any(f"'n' is empty in {COUNT - int(there.sum())} of {COUNT} rows" in note for note in report.notes)
    half = written((rows < COUNT // 4) | (rows >= COUNT // 4 * 3))
    with pytest.raises(SignalFileError, match=says("record.csv", "'n'", "interpolate")):
        gm.analyse(half)
    assert gm.analyse(half, gaps="interpolate").speed == pytest.approx(RPM * np.pi / 30, rel=1e-3)


def test_a_tacho_beside_a_speed_is_no_vibration_and_alone_is_named():
    pulses = 5.0 * ((TIME * RPM / 60.0) % 1.0 < 0.05)
    signal = gm.signals.make_signal(
        np.stack([A1, pulses, SPEED], 1), RATE, channels=["a", "tacho", "n"], units=["g", "V", "rpm"]
    )
    assert list(gm.analyse(signal, speed_channel="n").levels["channel"].values) == ["a"]
    report = gm.analyse(signal.sel(channel=["a", "tacho"]))
    assert list(report.levels["channel"].values) == ["a"]
    assert any("--tacho" in note for note in report.notes)


def test_a_ramp_with_a_unit_of_its_own_is_no_clock(tmp_path):
    """A torque that rises evenly in the first column: the rate is asked for; without a unit it would be the time."""
    path = tmp_path / "ramp.csv"
    rows = [f"{5.0 * k / COUNT:.6f},{a}" for k, a in enumerate(A1)]
    path.write_text("\n".join(["torque [N m],a [m/s^2]", *rows]))
    with pytest.raises(MissingMetadataError, match=says("rate", "ramp.csv")):
        read_signal(path)
    signal = read_signal(path, rate=RATE)
    assert list(signal["channel"].values) == ["torque", "a"]
    assert signal.attrs["sampling_rate"] == RATE


@pytest.mark.parametrize("heading", ["Index,x [ms],acc [g]", "Nr,angle [deg],acc [g]", "Sample,position [mm],acc [g]"])
def test_a_second_column_with_a_heading_of_its_own_is_no_time_in_seconds(tmp_path, heading):
    """Behind numbers of rows it is time where it has none."""
    k = np.arange(64)
    rows = "\n".join(f"{i},{0.1 * i:.4f},{np.sin(i):.5f}" for i in k)
    (tmp_path / "q.csv").write_text(f"{heading}\n{rows}\n")
    with pytest.raises(MissingMetadataError, match=says("rate", "q.csv")):
        read_signal(tmp_path / "q.csv")
