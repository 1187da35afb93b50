"""Commands for what changes with the speed: analyse of a run-up, waterfall, sweep and Campbell diagram."""

import re

import numpy as np
import pytest
from typer.testing import CliRunner

import gearmbs as gm
from gearmbs.cli import app
from gearmbs.signals import analyse, write_signal
from gearmbs.view import analysis_figures, changing_speed_figures
from gearmbs.view.figures.variable_speed import strongest_orders
from tests.drivetrain.test_description import TEXT
from tests.says import says
from tests.view.looking import assert_readable

RATE = 6400.0
TIME = np.arange(int(4 * RATE)) / RATE
SPEED = 5.0 + 3.0 * TIME
ANGLE = 2 * np.pi * np.cumsum(SPEED) / RATE
NAMES = {"spectrogram", "order map", "waterfall", "orders"}


@pytest.fixture(scope="module")
def run_up():
    """A mesh of 23 teeth and its second harmonic in noise, the speed in a channel of its own."""
    values = 2.0 * np.cos(23 * ANGLE) + np.cos(46 * ANGLE) + 0.02 * np.random.default_rng(1).standard_normal(TIME.size)
    return gm.make_signal({"housing": values, "n": 60.0 * SPEED}, RATE, units={"housing": "m/s^2", "n": "rpm"})


def invoked(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.mark.slow
@pytest.mark.parametrize("teeth", [None, 23])
def test_a_run_up_is_drawn_over_time_speed_and_order(run_up, teeth):
    report = analyse(run_up, teeth=teeth, speed_channel="n")
    figures = analysis_figures(report, run_up, speed_channel="n")
    assert set(figures) >= NAMES
    assert "spectrum" not in figures
    for name in NAMES:
        assert_readable(figures[name])
    assert [line.get_label() for line in figures["orders"].axes[0].lines][:2] == ["order 23", "order 46"]


@pytest.mark.slow
def test_strongest_orders_are_those_of_the_record(run_up):
    kept = run_up.sel(channel=["housing"])
    phase = gm.signals.shaft_phase(run_up, speed_channel="n")
    found = strongest_orders(gm.order_map(kept, phase=phase), 2)
    np.testing.assert_allclose(found, [23.0, 46.0], atol=0.1)
    assert set(changing_speed_figures(kept, phase=phase)) == NAMES


@pytest.mark.slow
def test_analyse_and_waterfall_draw_a_run_up(run_up, tmp_path):
    record = write_signal(run_up, tmp_path / "up.csv") or tmp_path / "up.csv"
    result = invoked("analyse", record, "--speed-channel", "n", "--figures", tmp_path / "one")
    assert result.exit_code == 0, result.output
    wanted = {f"{name.replace(' ', '_')}.png" for name in NAMES}
    assert wanted <= {path.name for path in (tmp_path / "one").iterdir()}
    result = invoked("waterfall", record, "--speed-channel", "n", "--orders", "23,46", "--steps", "20",
                     "--maximum", "1 kHz", "--out", tmp_path / "two")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "20 spectra from" in result.output
    assert wanted <= {path.name for path in (tmp_path / "two").iterdir()}


@pytest.mark.slow
def test_units_of_single_channels(tmp_path):
    (tmp_path / "up.csv").write_text("t,a [g],n\n" + "\n".join(f"{t:.6f},{v:.5f},{60 * s:.4f}" for t, v, s in zip(
        TIME, np.cos(23 * ANGLE), SPEED)))  # fmt: skip
    plain = ("waterfall", tmp_path / "up.csv", "--speed-channel", "n", "--orders", "23", "--out", tmp_path / "out")
    result = invoked(*plain)
    assert result.exit_code == 1
    assert "--units 'n=rpm'" in result.output
    result = invoked(*plain, "--units", "n=rpm")
    assert result.exit_code == 0, result.output
    assert list(gm.read_signal(tmp_path / "up.csv", units={"n": "rpm"})["units"].values) == ["g", "rpm"]
    assert "names no channel" in invoked(*plain, "--units", "=rpm").output
    (tmp_path / "n.csv").write_text("t,n\n" + "\n".join(f"{t:.6f},{60 * s:.4f}" for t, s in zip(TIME, SPEED)))
    result = invoked(plain[0], plain[1], "--channel", "a", "--speed", tmp_path / "n.csv", "--out", tmp_path / "out")
    assert "write its unit, rpm, Hz or rad/s, into its label, 'n [rpm]'" in result.output


@pytest.mark.slow
def test_waterfall_of_records_of_constant_speed(tmp_path):
    files = []
    for k, turns in enumerate((10.0, 20.0)):
        signal = gm.make_signal(np.cos(2 * np.pi * 23 * turns * TIME), RATE, units="m/s^2", channels=["x"])
        write_signal(signal, tmp_path / f"{k}.csv")
        files.append(tmp_path / f"{k}.csv")
    speeds = ("--speed", "600 rpm", "--speed", "1200 rpm")
    result = invoked("waterfall", *files, *speeds, "--style", "map", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "2 spectra from 600 to 1200 rpm" in result.output
    assert [path.name for path in (tmp_path / "out").iterdir() if path.suffix == ".png"] == ["waterfall.png"]
    result = invoked("waterfall", *files, "--speed", "600 rpm", "--out", tmp_path / "no")
    assert result.exit_code == 1
    assert "--speed is given 1 times for 2 files; give one for each" in result.output
    assert "--orders is '1,x'; give numbers" in invoked("waterfall", files[0], "--orders", "1,x").output
    assert "--steps divides the speed of one run-up" in invoked("waterfall", *files, *speeds, "--steps", "5").output


@pytest.mark.slow
@pytest.mark.parametrize("told", [("--speed-channel", "n"), ("--tacho", "pulse", "--pulses", "2")])
def test_waterfall_of_records_that_hold_their_speed(tmp_path, told):
    files = []
    for k, turns in enumerate((10.0, 20.0)):
        columns = {
            "x": np.cos(2 * np.pi * 23 * turns * TIME),
            "n": np.full(TIME.size, 60.0 * turns),
            "pulse": (np.cos(2 * np.pi * 2.0 * turns * TIME) > 0.0).astype(float),
        }
        units = {"x": "m/s^2", "n": "rpm", "pulse": "V"}
        files.append(tmp_path / f"{k}.csv")
        write_signal(gm.make_signal(columns, RATE, units=units), files[-1])
    result = invoked("waterfall", *files, *told, "--channel", "x", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    found = re.search(r"2 spectra from ([\d.]+) to ([\d.]+) rpm", result.output)
    assert found is not None, result.output
    assert [float(text) for text in found.groups()] == pytest.approx([600.0, 1200.0], rel=1e-3)


@pytest.mark.slow
def test_sweep_writes_records_table_and_figure_and_is_taken_up(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text('name = "one"\n[operation]\nduration = "0.1 s"\nrun_up = "0.02 s"\nsettling = "0 s"\n')
    values = ("900 rpm", "1500 rpm", "--count", 2)
    result = invoked("sweep", case, "operation.speed", *values, "--workers", 1, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    files = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert files == ["figure.png", "figure.svg", "one_speed 1500 rpm.nc", "one_speed 900 rpm.nc", "table.csv"]
    stamp = (tmp_path / "out" / "one_speed 900 rpm.nc").stat().st_mtime_ns
    record = gm.signals.files.simulated.read_any(tmp_path / "out" / "one_speed 900 rpm.nc")
    assert record.attrs["speed"] == pytest.approx(30 * np.pi)
    again = invoked("sweep", case, "operation.speed", "900 rpm", "--workers", 1, "--out", tmp_path / "out")
    assert again.exit_code == 0, again.output
    assert stamp <= (tmp_path / "out" / "one_speed 900 rpm.nc").stat().st_mtime_ns


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("operation.sped", "1 rpm"), "speed"),
        (("operation.speed", "900 rpm", "15 mm"), "value 2 of operation.speed"),
        (("operation.speed", "900 rpm", "--count", "3"), "give two values and a count from 2 up"),
        (("solver.integrator", "WSTIFF", "GSTIFF", "--count", "3"), "give its values one by one"),
    ],
)
def test_sweep_refuses_in_one_line(tmp_path, arguments, words):
    case = tmp_path / "case.toml"
    case.write_text('name = "one"\n')
    result = invoked("sweep", case, *arguments, "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert words in result.output
    assert len(result.output.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_campbell_of_a_drivetrain(tmp_path):
    train = tmp_path / "train.toml"
    train.write_text(TEXT.partition("[housings.box]")[0])
    speeds = ("--speeds", "3000 rpm", "--maximum", "3 kHz", "--harmonics", 1)
    result = invoked("campbell", train, *speeds, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "speed_rpm" in result.output
    assert (tmp_path / "out" / "campbell.png").is_file()
    assert "is in mm where" in invoked("campbell", train, "--speeds", "1 mm").output


ROTOR = """
name = "rotor"
running = true
[shafts.rotor]
length = "600 mm"
radius = "20 mm"
[drives.motor]
kind = "speed"
shaft = "rotor"
speed = "1000 rpm"
[run]
duration = "20 ms"
settling = "5 ms"
""" + "".join(
    f"[bearings.{name}]\nkind = 'elastic'\nshaft = 'rotor'\nstation = '{place} mm'\nstiffness = [1e7, 1e7, 1e7]\n"
    f"damping = [1e2, 1e2, 1e2]\n"
    for name, place in (("left", 50), ("right", 550))
)
"""A rotor in two bearings; along x, y and z its first modes are those of its mass on both springs."""


@pytest.mark.slow
def test_a_train_without_meshes_is_excited_by_its_turning(tmp_path):
    train = tmp_path / "rotor.toml"
    train.write_text(ROTOR)
    result = invoked("campbell", train, "--speeds", "20000 rpm", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    own = np.sqrt(2e7 / (7850.0 * np.pi * 0.02**2 * 0.6)) / (2.0 * np.pi)
    critical = [line.split()[0] for line in result.output.splitlines() if "1 x rotor" in line]
    assert critical == 3 * [f"{60.0 * own:.5g}"]
    assert invoked("run", train, "--out", tmp_path / "rotor.nc").exit_code == 0
    report = (tmp_path / "rotor.md").read_text(encoding="utf-8")
    assert "## Bearings" in report
    assert "Mesh" not in report


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--speeds", "-1000 rpm"], ("--speeds", "-1000 rpm", "give")),
        (["--speeds", "0 rpm"], ("--speeds", "0 rpm", "give")),
        (["--speeds", "9 rpm", "--speeds", "9 rpm"], ("--speeds", "9 rpm", "give")),
        (["--harmonics", "0"], ("harmonics", "0", "give")),
    ],
)
def test_campbell_refuses_ranges_that_are_none(tmp_path, options, words):
    train = tmp_path / "train.toml"
    train.write_text(TEXT.partition("[housings.box]")[0])
    result = invoked("campbell", train, *options, "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert re.search(says(*words), result.output)
    assert not (tmp_path / "out").exists()


def test_one_speed_makes_no_waterfall(tmp_path):
    signal = gm.make_signal({"housing": np.cos(2 * np.pi * 575 * TIME)}, RATE, units="m/s^2", speed=50 * np.pi)
    record = write_signal(signal, tmp_path / "x.csv") or tmp_path / "x.csv"
    wanted = says("1500 rpm", "waterfall")
    for what in (signal, [signal, signal]):
        with pytest.raises(gm.signals.SignalError, match=wanted):
            gm.waterfall(what)
    result = invoked("waterfall", record, "--speed", "1500 rpm", "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert "spectrogram, or `gearmbs analyse --figures`" in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["analyse", "waterfall", "trend", "campbell"])
def test_places_are_looked_at_before_anything_is_read(command, tmp_path):
    (tmp_path / "file").write_text("")
    result = invoked(command, tmp_path / "missing.csv", "--out", tmp_path / "file" / "x" / "y")
    assert result.exit_code == 1
    assert "is a file; write elsewhere (--out)" in " ".join(result.output.split())
    if command == "analyse":
        figures = invoked(command, tmp_path / "missing.csv", "--figures", tmp_path / "file")
        assert "file: is a file; name a folder (--figures)" in " ".join(figures.output.split())


@pytest.mark.parametrize(
    ("words", "text", "said"),
    [
        (["campbell"], "[gears]\nteeth = 23\n", "describes a case, not a drivetrain; `gearmbs run` simulates it"),
        (["sweep", "operation.speed", "900 rpm"], TEXT, "describes a drivetrain, not a case; `gearmbs run`"),
        (["sweep", "operation.speed", "900 rpm"], "[planetary]\n", "describes a planetary set, not a case; `gearmbs"),
        (["analyse"], "[operation]\nspeed = 100.0\n", "describes a case, not a record; `gearmbs run` simulates it"),
        (["trend"], TEXT, "describes a drivetrain, not a record; `gearmbs run` simulates it, `gearmbs campbell`"),
    ],
)
def test_files_of_another_kind_say_what_takes_them(words, text, said, tmp_path):
    (tmp_path / "x.toml").write_text(text)
    result = invoked(words[0], tmp_path / "x.toml", *words[1:])
    assert result.exit_code == 1
    assert f"x.toml: {said}" in " ".join(result.output.split())
