"""Runs of decks that somebody interrupts: what is said, what is kept, how the command ends."""

import signal

import pytest
import xarray as xr
from typer.testing import CliRunner

from gearmbs import cli
from gearmbs.adams import DeckError, parse_deck, parse_script, read_results, run_deck
from gearmbs.adams import analysis as analyses
from gearmbs.dae.integrators import driver
from tests.adams.decks import PENDULUM


@pytest.fixture
def keep_handlers(monkeypatch):
    """The commands take SIGTERM over; give it back."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setattr("gearmbs._command.ended_by", signal.SIGINT)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def signal_at(monkeypatch, time, number, analysis=1):
    """Send this process a signal when an analysis has passed a time."""
    # as often as on a slow machine
    monkeypatch.setattr(driver, "FIRST_CHUNK", 20)
    monkeypatch.setattr(driver, "CHUNK_SECONDS", 0.0)
    original, calls, sent = analyses._solve, [], []

    def solve(session, command, kind, model, times, options, progress, stops=()):
        calls.append(kind)

        def move(done):
            if len(calls) == analysis and done > time and not sent:
                sent.append(done)
                signal.raise_signal(number)

        return original(session, command, kind, model, times, options, move, stops)

    monkeypatch.setattr(analyses, "_solve", solve)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["Ctrl-C", "kill"])
@pytest.mark.usefixtures("keep_handlers")
@pytest.mark.slow
def test_an_interrupted_deck_says_where_and_keeps_what_was_computed(tmp_path, monkeypatch, number, code):
    deck = tmp_path / "pendulum.adm"
    deck.write_text(PENDULUM)
    whole = tmp_path / "pendulum.res"
    whole.write_text("of an earlier run")
    signal_at(monkeypatch, 1.0, number)
    result = CliRunner().invoke(cli.app, ["adams", str(deck), "--end", "20", "--steps", "2000"])
    assert result.exit_code == code
    assert f"the simulation of {deck} was interrupted at TIME = " in result.output
    assert " of 20; what was computed until then is kept" in result.output
    assert "wrote" in result.output
    assert "case" not in result.output
    message = (tmp_path / "pendulum.msg").read_text()
    assert "error" not in message.lower().replace("integration error", "")
    assert message.rstrip().endswith("what was computed until then is kept.")
    assert whole.read_text() == "of an earlier run"
    names = {p.name for p in tmp_path.iterdir()}
    assert names == {"pendulum.adm", "pendulum.msg", "pendulum.res"} | {
        f"pendulum.partial.{ending}" for ending in ("req", "res", "nc")
    }
    with xr.open_dataset(tmp_path / "pendulum.partial.nc", engine="h5netcdf") as part:
        assert 1.0 < float(part.time[-1]) < 19.0
    assert read_results(tmp_path / "pendulum.partial.res")


@pytest.mark.usefixtures("keep_handlers")
def test_an_interrupted_second_solution_ends_the_script_after_the_first(monkeypatch):
    signal_at(monkeypatch, 0.1, signal.SIGINT, analysis=2)
    script = parse_script("a\nb\nSIM/DYN, END=5, STEPS=20\nSIM/DYN, END=6, STEPS=20\n")
    with pytest.raises(KeyboardInterrupt) as caught:
        run_deck(parse_deck(PENDULUM), script, check=True)
    result = caught.value.result
    assert len(result.segments) == 1
    assert result.segments[0].success
    assert result.segments[0].doubt is None
    assert "was interrupted at TIME = 5 of 5" in result.interrupted
    assert not result.success


@pytest.mark.usefixtures("keep_handlers")
def test_an_interruption_before_the_first_output_writes_the_message_file_alone(tmp_path, monkeypatch):
    def interrupted(*_args, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr(analyses, "_model", interrupted)
    deck = tmp_path / "pendulum.adm"
    deck.write_text(PENDULUM)
    result = CliRunner().invoke(cli.app, ["adams", str(deck), "--end", "1"])
    assert result.exit_code == 130
    assert "was interrupted before its first output" in result.output
    assert {p.name for p in tmp_path.iterdir()} == {"pendulum.adm", "pendulum.msg"}
    assert "KeyboardInterrupt" not in (tmp_path / "pendulum.msg").read_text()


def test_files_that_are_being_written_when_it_is_interrupted_are_not_there(tmp_path, monkeypatch):
    result = run_deck(parse_deck(PENDULUM), end=0.1, steps=5)

    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr("gearmbs.adams.results.result.results_text", interrupted)
    with pytest.raises(KeyboardInterrupt):
        result.write(tmp_path / "run")
    assert {p.name for p in tmp_path.iterdir()} == {"run.msg", "run.req"}


def test_errors_still_write_what_was_computed(tmp_path):
    script = parse_script("a\nb\nSIM/DYN, END=0.1, STEPS=5\nSIM/KIN, END=0.2, STEPS=5\n")
    with pytest.raises(DeckError):
        run_deck(parse_deck(PENDULUM), script, tmp_path / "run")
    assert {p.suffix for p in tmp_path.iterdir()} == {".msg", ".req", ".res", ".nc"}
