"""What the package logs, and who hears it."""

from __future__ import annotations

import logging
import os
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

import gearmbs as gm
from gearmbs import logs
from gearmbs.cli import app
from gearmbs.dae import solve_dae
from gearmbs.dae.integrators.ida import _Messages
from gearmbs.studies.run.engine import here, run_jobs
from tests.says import says

ROOT = logging.getLogger("gearmbs")


@pytest.fixture
def quiet(monkeypatch):
    """The logger as a program finds it that has not asked for anything, and without pytest's own handlers."""
    monkeypatch.setattr(ROOT, "handlers", [logging.NullHandler()])
    monkeypatch.setattr(ROOT, "level", logging.NOTSET)
    monkeypatch.setattr(ROOT, "propagate", False)
    monkeypatch.delenv(logs.VARIABLE, raising=False)
    ROOT.manager._clear_cache()
    yield
    ROOT.manager._clear_cache()


def half(job: int, report) -> float:
    report(0.5)
    return job / 2


def test_a_run_of_jobs_says_what_each_came_to(caplog):
    with caplog.at_level(logging.INFO, "gearmbs"):
        assert run_jobs(half, [4, 6], where=here) == [2.0, 3.0]
        with pytest.raises(TypeError):
            run_jobs(half, ["case"], where=here)
    assert [record.name for record in caplog.records] == ["gearmbs.studies"] * 3
    said = [record.getMessage() for record in caplog.records]
    assert [line.partition(" after")[0] for line in said] == ["4: done", "6: done", "case: failed"]
    assert "unsupported" in said[2]


def test_runs_of_integrators_and_files_are_told_to_whoever_looks_closer(caplog, tmp_path):
    def decay(t, y, yp, out):
        out[0] = yp[0] + y[0]

    with caplog.at_level(logging.DEBUG, "gearmbs"):
        result = solve_dae(decay, (0.0, 1.0), [1.0], method="IDA")
        path = gm.write_signal(gm.make_signal(np.arange(8.0), 10.0, units="g"), tmp_path / "a b.csv")
        gm.read_signal(path)
        gm.save(gm.read_signal(path), tmp_path / "b.npz")
    said = {record.name: record.getMessage() for record in caplog.records}
    assert f"1 equations by IDA: up to 1 s in {result.stats.steps} steps" in said["gearmbs.dae"]
    assert said["gearmbs.signals"] == f"read {path} as csv: 1 channels of 8 samples"
    caplog.clear()
    gm.read_signal(path)
    assert caplog.records == []


def test_what_sundials_prints_is_logged(caplog, capsys):
    messages = _Messages()
    with caplog.at_level(logging.DEBUG, "gearmbs"):
        messages.write("\n[IDA, Error: -4]  The corrector convergence failed repeatedly")
        messages.write("\n")
    assert [record.getMessage() for record in caplog.records] == [
        "SUNDIALS: The corrector convergence failed repeatedly"
    ]
    assert capsys.readouterr().out == ""


def test_why_a_program_waits_is_told_on_standard_error_where_nobody_listens(quiet, capsys):
    logs.tell("kernels", "compiling")
    assert capsys.readouterr().err == "gearmbs: compiling\n"


def test_it_is_told_to_whoever_listens_and_to_nobody_else(quiet, capsys):
    heard = []
    handler = logging.Handler()
    handler.emit = heard.append
    ROOT.addHandler(handler)
    ROOT.setLevel(logging.INFO)
    logs.tell("kernels", "compiling")
    assert [record.getMessage() for record in heard] == ["compiling"]
    ROOT.setLevel(logging.ERROR)
    logs.tell("kernels", "compiling")
    assert len(heard) == 1
    assert capsys.readouterr().err == ""


def test_a_program_without_standard_error_goes_on(quiet, monkeypatch):
    monkeypatch.setattr(sys, "stderr", None)
    logs.tell("kernels", "compiling")


@pytest.mark.parametrize(("option", "level"), [([], None), (["-v"], "info"), (["--verbose", "-v"], "debug")])
def test_the_command_line_says_more_if_asked(quiet, option, level):
    told = CliRunner().invoke(app, [*option, "--version"])
    assert told.output == f"gearmbs {gm.__version__}\n"
    # processes that it starts do the same
    assert os.environ.pop(logs.VARIABLE, None) == level
    assert ROOT.isEnabledFor(logging.INFO) == (level is not None)
    assert ROOT.isEnabledFor(logging.DEBUG) == (level == "debug")


def test_listening_again_changes_the_level_and_says_nothing_twice(quiet, capsys):
    logs.listen("debug")
    logs.listen("info")
    logs.logger("files").debug("wrote a")
    logs.logger("files").info("took b")
    assert capsys.readouterr().err == "gearmbs: took b\n"
    with pytest.raises(ValueError, match=says(logs.VARIABLE, "loud", "info")):
        logs.listen("loud")


@pytest.mark.slow
def test_the_environment_lets_a_process_speak():
    code = "from gearmbs import logs; logs.logger('files').debug('wrote %s', 'x')"
    for level, said in (("debug", "gearmbs.files"), ("info", ""), ("nonsense", "")):
        environment = {**os.environ, logs.VARIABLE: level, "PYTHONPATH": os.pathsep.join(sys.path)}
        told = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        assert told.stderr.startswith(said)
        assert bool(told.stderr) == bool(said)
