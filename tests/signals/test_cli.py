"""The commands that go from files to reports."""

import errno
import os
import re
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import scipy.io
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.signals import make_signal, write_signal
from gearmbs.signals.command_line import tooth_counts

RATE, SHAFT, TEETH = 12800.0, 30.0, 32


def write(folder, name, second=0.5, **metadata):
    """Write 4 s of a mesh with sidebands and a tacho, all turning at 30 Hz."""
    angle = 2 * np.pi * SHAFT * np.arange(4 * int(RATE)) / RATE
    x = (1 + 0.2 * np.cos(angle)) * (np.cos(TEETH * angle) + second * np.cos(2 * TEETH * angle))
    x = x + 0.05 * np.random.default_rng(3).standard_normal(angle.size)
    signal = make_signal({"housing": x, "pulse": (np.sin(angle) > 0.9) * 5.0}, RATE, units=["m/s^2", "V"], **metadata)
    return write_signal(signal, folder / name)


def run(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.mark.slow
def test_one_command_from_csv_to_a_gmf_table(tmp_path):
    path = write(tmp_path, "x.csv")
    result = run("analyse", path, "--teeth", TEETH, "--channel", "housing")
    assert result.exit_code == 0, result.output
    assert "Gear mesh frequency: 960.0" in result.output
    assert "| 1 x GMF |" in result.output


@pytest.mark.slow
def test_a_report_that_cannot_be_written_names_its_own_path(tmp_path):
    path = write(tmp_path, "x.csv")
    (tmp_path / "report.md").mkdir()
    result = run("analyse", path, "--teeth", TEETH, "--channel", "housing", "--out", tmp_path / "report.md")
    assert result.exit_code == 1
    words = result.output.replace("\n", "")
    assert "Errno" not in words
    assert f"{tmp_path / 'report.md'}: " in words


@pytest.mark.slow
def test_report_tables_and_figures_go_where_they_are_told(tmp_path):
    path = write(tmp_path, "x.mat")
    options = ("--tacho", "pulse", "--tables", tmp_path / "tables", "--figures", tmp_path / "figures")
    result = run("analyse", path, "--teeth", "32,80", "--wheel", 2, *options, "--out", tmp_path / "report.md")
    assert result.exit_code == 0, result.output
    assert "from the tacho 'pulse'" in (tmp_path / "report.md").read_text()
    table = pd.read_csv(tmp_path / "tables" / "harmonics.csv")
    # the tacho is not analysed; its line at 960 Hz has the RMS 1 / sqrt(2)
    assert table["channel"].unique().tolist() == ["housing"]
    assert table["orders"][0] == pytest.approx(1 / np.sqrt(2), rel=0.02)
    assert (tmp_path / "figures" / "spectrum.png").stat().st_size > 10_000
    assert (tmp_path / "figures" / "average.svg").exists()
    assert "wrote" in result.output


@pytest.mark.slow
def test_compare_writes_bars_for_measured_states(tmp_path):
    files = {state: write(tmp_path, f"{state}.csv.gz", second) for state, second in (("healthy", 0.5), ("worn", 1.0))}
    words = [word for state, path in files.items() for word in ("--experiment", f"low:{state}={path}")]
    result = run(
        "compare", *words, "--teeth", TEETH, "--channel", "housing", "--figures", tmp_path, "--tables", tmp_path
    )
    assert result.exit_code == 0, result.output
    assert "worn: at load low 2 x GMF rises on housing (+6.0 dB)" in result.output
    assert (tmp_path / "bars.png").exists()
    assert pd.read_csv(tmp_path / "changes.csv")["change_db"].round(1).tolist() == [0.0, 6.0, 0.0]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["analyse", "none.csv", "--teeth", "32"], "none.csv: cannot be opened"),
        (["analyse", "x.csv", "--teeth", "thirty"], "--teeth is 'thirty'"),
        (["analyse", "x.csv", "--teeth", "32", "--speed", "30 mm"], "--speed"),
        (["analyse", "x.csv", "--teeth", "32", "--channel", "roof"], "has no channel"),
        (["analyse", "x.csv", "--teeth", "32", "--tacho", "roof"], "roof"),
        (["compare", "--experiment", "x.csv", "--teeth", "32"], "load:state=path"),
        (["compare", "--experiment", "a:healthy=x.csv", "--teeth", "32", "--scope", "some"], "scope"),
        (["compare", "--experiment", "a:healthy=x.csv", "--band", "1 kHz, 2 kHz"], "--as"),
        (["compare", "--experiment", "a:healthy=x.csv", "--full-scale", "1 m/s"], "--repair"),
        (["analyse", "x.csv", "--band", "1 kHz, 2 kHz"], "--bearing"),
        (["analyse", "x.csv", "--shaft", "0.4"], "--bearing"),
    ],
)
@pytest.mark.slow
def test_wrong_calls_end_with_one_message(tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    write(tmp_path, "x.csv")
    result = run(*words)
    assert result.exit_code == 1
    assert said in " ".join(result.output.split())
    assert "Traceback" not in result.output


@pytest.mark.slow
def test_commands_for_measurements_need_no_kernels(tmp_path):
    """Whoever has a file and no wish to simulate does not wait for compilers."""
    path = write(tmp_path, "x.csv")
    words = ["analyse", str(path), "--teeth", "32", "--figures", str(tmp_path), "--out", str(tmp_path / "x.md")]
    code = (
        "import sys; from gearmbs.cli import app; app(sys.argv[1:], standalone_mode=False); "
        "print(sorted({'numba', 'gearmbs.contact', 'gearmbs.gears'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=True)
    assert done.stdout.strip().endswith("[]"), done.stdout
    assert (tmp_path / "x.md").exists()


@pytest.mark.slow
@pytest.mark.parametrize("option", ["--out", "--tables", "--figures"])
def test_a_report_that_cannot_be_written_is_printed(tmp_path, monkeypatch, option):
    path = write(tmp_path, "x.csv")

    def full(*_args):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("gearmbs.files.os.replace", full)
    result = run("analyse", path, option, tmp_path / "here")
    assert result.exit_code == 1
    assert "# Vibration of x.csv" in result.output
    said = " ".join(result.output.split())
    assert "No space left on device; choose another place or make room" in said
    assert "Errno" not in said
    assert not [left for left in tmp_path.rglob("*") if left.is_file() and left != path]


def test_tooth_counts():
    assert tooth_counts("32") == (32,)
    assert tooth_counts("32, 80") == (32, 80)


@pytest.mark.slow
def test_a_record_without_teeth_has_a_report(tmp_path):
    path = write(tmp_path, "x.csv")
    result = run("analyse", path, "--speed", "1800 rpm", "--figures", tmp_path / "f", "--tables", tmp_path / "t")
    assert result.exit_code == 0, result.output
    assert "# Vibration of x.csv" in result.output
    assert "| 1 | 30.00 |" in result.output
    assert (tmp_path / "f" / "envelope.png").stat().st_size > 10_000
    assert (tmp_path / "t" / "spectrum.csv").exists()


@pytest.mark.slow
def test_a_folder_is_one_series(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    for k in (1, 2, 10):
        write(folder, f"s{k}.csv")
    options = ("--channel", "housing", "--speed", "1800 rpm", "--out", tmp_path / "t.csv")
    result = run("trend", folder, *options)
    assert result.exit_code == 0, result.output
    table = pd.read_csv(tmp_path / "t.csv")
    assert table["file"].tolist() == ["s1.csv", "s2.csv", "s10.csv"]
    assert table["housing.rms"].nunique() == 1
    # a second call finds everything done, one after a kill what was
    assert run("trend", folder, *options).exit_code == 0
    journal = tmp_path / "t.rows.jsonl"
    journal.write_text("".join(journal.read_text().splitlines(keepends=True)[:3]))
    assert "taking up 2 finished of 3 files from t.rows.jsonl" in run("trend", folder, *options).output
    matched = run("trend", folder / "s1*.csv", "--speed", "1800 rpm", "--channel", "housing")
    assert matched.exit_code == 0, matched.output
    assert "s10.csv" in matched.output
    assert "s2.csv" not in matched.output
    listed = run("trend", folder / "s1.csv", folder / "s2.csv", "--teeth", TEETH, "--channel", "housing")
    assert listed.exit_code == 0, listed.output
    assert "housing.fm4" in listed.output


@pytest.mark.slow
def test_an_option_that_a_message_names_is_not_named_again(tmp_path):
    """A speed that the file may hold is offered with its option; where there is none, the option is all there is."""
    x = np.random.default_rng(0).standard_normal(25600)
    for inside, said in (({"rate": 25.0}, '(--speed "25 Hz")'), ({}, "(on the command line: --speed ...)")):
        scipy.io.savemat(tmp_path / "x.mat", {"bearing": {"sr": RATE, "gs": x, **inside}})
        result = run("analyse", tmp_path / "x.mat", "--bearing", "6205")
        text = " ".join(result.output.split())
        assert result.exit_code == 1
        assert "speed is missing" in text
        assert text.endswith(said)
        assert text.count("--speed") == 1


@pytest.mark.slow
def test_the_command_line_answers_what_is_asked(tmp_path):
    t = np.arange(25600) / RATE
    x = np.cos(2 * np.pi * 960 * t)
    text = "\n".join(f"{v:.6f}" if k != 500 else "" for k, v in enumerate(x))
    path = tmp_path / "x.csv"
    path.write_text(f"fs,12800\nSampFreq,6400\na,b\n{text.replace(chr(10), ',1' + chr(10))},1\n")
    asked = run("analyse", path, "--gaps", "longest")
    assert asked.exit_code == 1
    assert "fs = 12800 Hz and SampFreq = 6400 Hz; say which: rate=... (--rate)" in " ".join(asked.output.split())
    gap = run("analyse", path, "--rate", "12.8 kHz")
    assert "line 504 holds nothing in column 'a'; pass gaps='interpolate'" in " ".join(gap.output.split())
    done = run("analyse", path, "--rate", "12.8 kHz", "--gaps", "interpolate", "--channel", "a")
    assert done.exit_code == 0, done.output
    assert "had gaps, filled by straight lines" in done.output
    curve = tmp_path / "speed.csv"
    curve.write_text("time,temperature,speed [rpm]\n0,20,1800\n1,21,1800\n2,22,1800\n")
    followed = run("analyse", path, "--rate", 12800, "--gaps", "interpolate", "--channel", "a", "--speed", curve)
    assert followed.exit_code == 0, followed.output
    assert "1800.0 rpm" in followed.output
    assert "'mmm' is not a unit; did you mean 'mm'" in run("analyse", path, "--units", "mmm").output


def lines_of_shaft(turns, orders, level=0.3, more=None):
    """Five seconds of noise with some orders of a shaft, Hz, in m/s^2."""
    t = np.arange(5 * 12800) / 12800.0
    values = 0.3 * np.random.default_rng(5).standard_normal(t.size)
    values += sum(level * np.cos(2 * np.pi * k * turns * t + k) for k in orders)
    return make_signal({"a": values if more is None else values + more(t)}, 12800.0, units="m/s^2")


@pytest.mark.parametrize(("off", "orders", "told"), [
    (0.004, (1,), "no family of its orders stands out near it"),
    (0.004, range(1, 13), "from a family of its orders"),
    (0.03, range(1, 13), "from a family of its orders"),
])  # fmt: skip
@pytest.mark.slow
def test_bearings_and_vibration_are_reported_at_one_speed(tmp_path, off, orders, told):
    """A single line says where orders are taken, and is called no speed; a family far off is that of both reports."""
    write_signal(lines_of_shaft(1745.0 / 60.0 * (1.0 + off), orders), tmp_path / "x.csv")
    result = run("analyse", tmp_path / "x.csv", "--bearing", "6205", "--speed", "1745 rpm")
    assert result.exit_code == 0, result.output
    assert told in result.output
    assert "own line" not in result.output
    bearings, vibration = (
        float(re.search(rf"- {word}: ([0-9.]+) rpm", result.output).group(1)) for word in ("Shaft", "Speed")
    )
    # a line is known to some hundredths of the 0.2 Hz between those of a spectrum of 5 s, 12 rpm
    assert vibration == pytest.approx(1745.0 * (1.0 + off), abs=0.5)
    if len(orders) == 1:
        assert bearings == 1745.0
        assert "from the line at order 1, +0.39" in result.output
    else:
        assert bearings == pytest.approx(vibration, abs=0.5)


@pytest.mark.slow
def test_bearings_take_the_speed_of_the_mesh_line_where_no_family_tells_it(tmp_path):
    signal = lines_of_shaft(29.3, (), more=lambda t: np.cos(2 * np.pi * 29.3 * 32 * t))
    write_signal(signal, tmp_path / "x.csv")
    result = run("analyse", tmp_path / "x.csv", "--bearing", "6205", "--speed", "1745 rpm", "--teeth", "32")
    assert result.exit_code == 0, result.output
    assert "Shaft: 1758.0 rpm" in result.output
    result = run("analyse", tmp_path / "x.csv", "--bearing", "6205", "--speed", "29 Hz", "--planetary", "17,19,55")
    assert result.exit_code != 0
    assert "--planetary" in result.output
