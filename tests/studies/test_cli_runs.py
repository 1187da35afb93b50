"""Runs of the command line that stop early: what they say, what they keep, how they end."""

import contextlib
import signal

import pytest
import xarray as xr
from typer.testing import CliRunner

from gearmbs import cli
from gearmbs.studies import commands
from gearmbs.studies.presets.paper_cases import Claim

CASE = "[operation]\nrun_up = '30 ms'\nsettling = '10 ms'\nduration = '200 ms'\n"


@pytest.fixture
def keep_handlers():
    """The commands take SIGTERM over; give it back."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    # a job in the background starts with it ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def signalled_after(fraction, number):
    """Return a stand-in for the bars that sends this process a signal when a case is so far."""

    @contextlib.contextmanager
    def bars(names):
        sent = []

        def move(name, done):
            if done > fraction and not sent:
                sent.append(name)
                signal.raise_signal(number)

        yield move

    return bars


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "kill"])
@pytest.mark.usefixtures("keep_handlers")
def test_an_interrupted_run_ends_with_130_and_a_partial_file(tmp_path, monkeypatch, integrator, number):
    path = tmp_path / "long.toml"
    path.write_text(CASE + f"[solver]\nintegrator = '{integrator}'\n")
    monkeypatch.setattr(commands, "case_bars", signalled_after(0.3, number))
    result = CliRunner().invoke(cli.app, ["run", str(path)])
    assert result.exit_code == 130
    assert "interrupted at t = 0." in result.output
    assert not (tmp_path / "long.nc").exists()
    with xr.open_dataset(tmp_path / "long.partial.nc", engine="h5netcdf") as part:
        assert part.attrs["status"] == "INTERRUPTED"
        # a third of 0.24 s, and not the whole
        assert 0.05 < float(part.time[-1]) < 0.2
        assert float(part.time[0]) == 0.0
        assert part.force_2.attrs["units"] == "N"


@pytest.mark.slow
@pytest.mark.usefixtures("keep_handlers")
def test_a_failed_run_keeps_what_was_computed(tmp_path, monkeypatch):
    path = tmp_path / "soft.toml"
    path.write_text(CASE)
    monkeypatch.setattr("gearmbs.studies.run.recorder.slip", lambda *a: "the wheels slipped")
    result = CliRunner().invoke(cli.app, ["run", str(path)])
    assert result.exit_code == 1
    assert "case 'soft': the wheels slipped\nWhat was computed until then is in" in result.output
    assert (tmp_path / "soft.partial.nc").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("keep_handlers")
def test_a_failed_case_of_the_study_is_kept(tmp_path, monkeypatch):
    """The case that failed and those finished before it are files, the study is not."""
    monkeypatch.setattr(
        "gearmbs.studies.run.recorder.slip",
        lambda pair, *a: "the wheels slipped" if pair.misalignment else None,
    )
    words = ["paper", "--out", str(tmp_path), "--duration", "80 ms", "--workers", "1"]
    result = CliRunner().invoke(cli.app, words)
    assert result.exit_code == 1
    assert "case 'misaligned, low load': the wheels slipped" in result.output
    assert sorted(p.name for p in tmp_path.rglob("*.*")) == ["healthy_low load.nc", "misaligned_low load.partial.nc"]
    with xr.open_dataset(tmp_path / "cases" / "misaligned_low load.partial.nc", engine="h5netcdf") as part:
        assert part.attrs["fault_misalignment_units"] == "rad"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--torque", "1e9 N m"], "operation.torque = '1e9 N m': this is 1e+09 N m"),
        (["--component", "sideways"], "--component is 'sideways'; choose one of"),
        (["--speed", "9000 rpm"], "solver.signal_rate = 12800 Hz: operation.speed = 942.478 rad/s (9000 rpm)"),
        (["--duration", "0.05 s"], "operation.duration = 0.05 s: the band-pass"),
        (["--integrator", "magic"], "solver.integrator = 'MAGIC'"),
        (["--angle", "1 mm"], "--angle: '1 mm' is in"),
    ],
)
@pytest.mark.usefixtures("keep_handlers")
def test_wrong_options_leave_no_files(tmp_path, options, words):
    result = CliRunner().invoke(cli.app, ["paper", "--out", str(tmp_path / "out"), *options])
    assert result.exit_code == 1
    assert words in result.output
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("keep_handlers")
def test_remarks_on_an_unusual_case(tmp_path):
    path = tmp_path / "apart.toml"
    path.write_text("[operation]\nrun_up = '30 ms'\nduration = '60 ms'\n[fault]\ncentre_distance_error = '3 mm'\n")
    result = CliRunner().invoke(cli.app, ["run", str(path)])
    assert result.exit_code == 0
    assert "note: contact ratio 0.773 is below 1" in result.output
    with xr.open_dataset(tmp_path / "apart.nc", engine="h5netcdf") as record:
        assert record.attrs["contact_ratio"] == pytest.approx(0.7733, abs=1e-4)
        assert record.attrs["operation_speed_units"] == "rad/s"
        assert record.attrs["gears_density"] == 7850.0


class Studied:
    """What a study may be asked for by its command."""

    def save(self, folder):
        return [folder / "report.md"]

    def report(self):
        return "the report"

    def claims(self, sensor):
        return [Claim(f"claim {held}", sensor, held, "1 < 2", "is less") for held in (True, False)]

    def campbell(self):
        return xr.Dataset({"frequency": (("speed", "mode"), [[12.5, 310.0]])})


@pytest.mark.parametrize(
    ("words", "runs", "told"),
    [
        (["bench", "--no-pair"], 6, "held      laser: claim True\n          1 < 2\nNOT HELD  laser: claim False"),
        (["bench"], 12, "held      support: claim True"),
        (["resonance", "--cycles", "400"], 2, "the report"),
        (["gearbox"], 2, "modes, Hz: 12.5, 310"),
    ],
)
@pytest.mark.slow
def test_studies_as_commands(tmp_path, monkeypatch, words, runs, told):
    """Each runs what it names, writes to its folder and prints what came of it; wrong settings run nothing."""
    named, moved = [], []

    @contextlib.contextmanager
    def bars(names):
        named.extend(names)
        yield lambda name, done: moved.append(name)

    def run(*settings, progress, **options):
        progress(named[0], 1.0)
        return Studied()

    module = f"gearmbs.studies.presets.{words[0]}"
    monkeypatch.setattr(f"{module}.run_{words[0]}", run)
    monkeypatch.setattr(commands, "case_bars", bars)
    result = CliRunner().invoke(cli.app, [*words, "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert len(named) == runs
    assert moved == named[:1]
    assert told in result.output
    assert f"wrote {tmp_path / 'report.md'}" in result.output
    wrong = {"bench": ["--motor", "steam"], "resonance": ["--damping", "0"], "gearbox": ["--speed", "5 mm"]}[words[0]]
    result = CliRunner().invoke(cli.app, [*words, *wrong, "--out", str(tmp_path)])
    assert result.exit_code == 1
    assert len(moved) == 1
