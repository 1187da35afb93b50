"""Text in UTF-16 without a mark, printed minus signs, separators of thousands, AM and PM: right, or one line asks."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

from gearmbs.signals import SignalFileError, read_signal, sections
from gearmbs.signals.files.encodings import utf16_without_mark
from tests.says import says

RATE, COUNT = 10000.0, 600
TIME = np.arange(COUNT) / RATE
A = np.round(2000.0 * np.cos(2 * np.pi * 500.0 * TIME + 0.3), 2)


def lines(head, *columns, sign=";"):
    return "\r\n".join([head, *(sign.join(row) for row in zip(*columns, strict=True))]) + "\r\n"


def decimal(values, digits=4, comma=False):
    cells = [f"{value:.{digits}f}" for value in values]
    return [cell.replace(".", ",") for cell in cells] if comma else cells


def right(signal, values=A, tolerance=1e-9):
    assert signal.attrs["sampling_rate"] == pytest.approx(RATE)
    np.testing.assert_allclose(signal.values[:, 0], values, atol=tolerance)
    return True


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-16"])
@pytest.mark.parametrize("comma", [False, True])
def test_utf_16_needs_no_mark(encoding, comma, tmp_path):
    text = lines("Zeit [s];a [m/s\u00b2]", decimal(TIME, 4, comma), decimal(A, 2, comma))
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    signal = read_signal(tmp_path / "a.csv")
    assert right(signal)
    assert signal.attrs["units"] == "m/s\u00b2"


def test_bytes_that_are_no_text_are_no_utf_16():
    assert utf16_without_mark(np.arange(1, 500, dtype="<i2").tobytes()) is None
    assert utf16_without_mark(np.full(500, 13, dtype="<i2").tobytes() + b"\x01\x00" * 50) is None
    assert utf16_without_mark(b"a;b\n" * 100) is None


@pytest.mark.parametrize("sign", ["\u2212", "\u2013", "\uff0d"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_printed_minus_signs_are_minus_signs(sign, encoding, tmp_path):
    """Also far behind the head, in exponents, beside decimal commas, in gzip and in sections."""
    values = np.where(np.arange(COUNT) < 450, np.abs(A), A)
    text = lines("t [s];a [g]", decimal(TIME, 4, True), decimal(values, 2, True)).replace("-", sign)
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    assert right(read_signal(tmp_path / "a.csv"), values)
    pieces = list(sections(tmp_path / "a.csv", 0.03))
    np.testing.assert_allclose(np.concatenate([p.values[:, 0] for p in pieces]), values)
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(text.encode(encoding)))
    assert right(read_signal(tmp_path / "a.csv.gz"), values)
    powers = lines("t [s];a [g]", decimal(TIME), [f"{value:.6e}" for value in 1e-6 * A]).replace("-", sign)
    (tmp_path / "e.csv").write_bytes(powers.encode(encoding))
    assert right(read_signal(tmp_path / "e.csv"), 1e-6 * A)


@pytest.mark.parametrize(("group", "point"), [
    (".", ","), (",", "."), (" ", ","), ("\u202f", ","), ("\u00a0", ","), ("'", "."), ("\u2019", "."),
])  # fmt: skip
def test_separators_of_thousands_are_asked_for_and_numbers_without_are_read(group, point, tmp_path):
    def cells(between):
        plain = [f"{value:,.2f}" for value in A]
        return [cell.replace(",", "G").replace(".", point).replace("G", between) for cell in plain]

    times = [cell.replace(".", point) for cell in decimal(TIME)]
    (tmp_path / "a.csv").write_text(lines("t [s];a [g]", times, cells(group)), encoding="utf-8")
    with pytest.raises(SignalFileError, match=says("line", "thousands", "cells")):
        read_signal(tmp_path / "a.csv")
    (tmp_path / "b.csv").write_text(lines("t [s];a [g]", times, cells("")), encoding="utf-8")
    assert right(read_signal(tmp_path / "b.csv"))


@pytest.mark.parametrize(("group", "sign"), [(".", ";"), (",", ";"), (".", "\t"), (",", "\t")])
def test_whole_numbers_whose_thousands_look_like_decimals_are_asked_for(group, sign, tmp_path):
    """-1.165 for -1165 beside 999: taken for decimals they had been a thousandth, in silence."""
    whole = np.round(3.0 * A)
    counts = [f"{value:.0f}" for value in np.arange(COUNT)]
    cells = [f"{value:,.0f}".replace(",", group) for value in whole]
    (tmp_path / "a.csv").write_text(lines(f"t [us]{sign}a [g]", counts, cells, sign=sign), encoding="utf-8")
    with pytest.raises(SignalFileError, match=says("a", "thousands", repr(group))):
        read_signal(tmp_path / "a.csv")
    plain = lines(f"t [us]{sign}a [g]", counts, [f"{value:.0f}" for value in whole], sign=sign)
    (tmp_path / "b.csv").write_text(plain, encoding="utf-8")
    np.testing.assert_array_equal(read_signal(tmp_path / "b.csv").values[:, 0], whole)


@pytest.mark.parametrize("digits", [1, 2, 3, 4])
@pytest.mark.parametrize("comma", [False, True])
def test_decimals_in_threes_are_decimals(digits, comma, tmp_path):
    """Of a fixed format, and with zeros at the end cut off."""
    values = np.round(A / 10.0, digits)
    fixed = decimal(values, digits, comma)
    cut = [cell.rstrip("0").rstrip(".,") for cell in fixed]
    for cells in (fixed, cut):
        path = tmp_path / "a.csv"
        path.write_text(lines("t [s];a [g]", decimal(TIME, 4, comma), cells), encoding="utf-8")
        assert right(read_signal(path), values)


def test_temperatures_in_thousandths_with_zeros_cut_off_are_no_thousands(tmp_path):
    """61, 61.001, 61.002: all have three decimals or none, and none end with a zero."""
    oil = 61.0 + np.repeat(np.arange(6), 100) / 1000.0
    cells = [f"{value:.3f}".rstrip("0").rstrip(".") for value in oil]
    (tmp_path / "a.csv").write_text(lines("t [s];T [degC]", decimal(TIME), cells), encoding="utf-8")
    np.testing.assert_allclose(read_signal(tmp_path / "a.csv").values[:, 0], oil)


@pytest.mark.parametrize("row", [0, 7])
def test_signs_of_infinity_are_gaps_that_are_named(row, tmp_path):
    """As oscilloscopes write values beyond their range; in the first row they had hidden the headings."""
    cells = decimal(A, 2)
    cells[row] = "-\u221e"
    (tmp_path / "a.csv").write_text(lines("Time;A", decimal(TIME), cells), encoding="utf-8")
    with pytest.raises(SignalFileError, match=says("line", "A", "--gaps")):
        read_signal(tmp_path / "a.csv")
    (tmp_path / "b.csv").write_text(lines("t [ms];A [V]", decimal(1e3 * TIME), cells), encoding="utf-8")
    found = read_signal(tmp_path / "b.csv", gaps="interpolate")
    assert found["channel"].values.tolist() == ["A"]
    assert found.attrs["sampling_rate"] == pytest.approx(RATE)


@pytest.mark.parametrize("form", ["{} AM", "{}AM", "{} a.m.", "{} am"])
@pytest.mark.parametrize("date", ["3/12/2024 ", "2024-03-12 ", ""])
def test_times_of_day_with_am_and_pm_are_times(form, date, tmp_path):
    """Over noon: 11:59:59.97 AM to 12:00:00.03 PM."""
    seconds = 43199.97 + TIME
    clocks = [form.format(f"{11 if s < 43200 else 12}:{'59' if s < 43200 else '00'}:{s % 60.0:07.4f}") for s in seconds]
    cells = [
        date + (cell if s < 43200 else cell.replace("AM", "PM").replace("a.m.", "p.m.").replace("am", "pm"))
        for cell, s in zip(clocks, seconds, strict=True)
    ]
    (tmp_path / "a.csv").write_text(lines("Timestamp,a [g]", cells, decimal(A, 2), sign=","), encoding="utf-8")
    assert right(read_signal(tmp_path / "a.csv"))
