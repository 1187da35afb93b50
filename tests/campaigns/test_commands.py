"""``gearmbs campaign``."""

from __future__ import annotations

import re

import numpy as np
import pytest
import scipy.signal as ss
import typer
from typer.testing import CliRunner

from gearmbs.campaigns.commands import _given_rate
from gearmbs.cli import app
from tests.says import says

PLAN = """
design = "sobol"
n = 8
unit = 4
keep = ["numbers"]

[subject]
kind = "function"
function = "tests.campaigns.models:ishigami"
parameters = { x1 = 0.0, x2 = 0.0, x3 = 0.0 }

[[factor]]
path = "x1"
low = -3.14
high = 3.14
"""


def call(*words: object, code: int = 0) -> str:
    result = CliRunner().invoke(app, ["campaign", *(str(w) for w in words)])
    assert result.exit_code == code, result.output
    return result.output


@pytest.mark.slow
def test_from_plan_to_end(tmp_path):
    (tmp_path / "p.toml").write_text(PLAN)
    folder = tmp_path / "p.campaign"
    assert "8 cases in 2 units" in call("plan", tmp_path / "p.toml")
    assert "0 of 8" in call("status", folder)
    call("work", folder, "--part", "2/2")
    assert "8 of 8" in call("run", folder, "--workers", 1)
    assert call("failed", folder) == ""
    assert "x1" in call("show", folder, 3)
    assert "8 of 16" in call("extend", folder, "--to", 16)
    assert "all is as" in call("check", folder)
    assert "wrote" in call("figure", folder, "tornado", "--result", "y", "--out", tmp_path / "t.svg")
    assert "<svg" in (tmp_path / "t.svg").read_text()
    assert "result 'z'" in call("figure", folder, "--result", "z", code=1)
    assert "--part $SLURM_ARRAY_TASK_ID/50" in call("slurm", folder, "--elements", 50)


def test_errors_are_one_line(tmp_path):
    assert "no campaign here" in call("status", tmp_path, code=1)
    (tmp_path / "p.toml").write_text(PLAN.replace("x1 = 0.0, ", ""))
    assert "no such parameter" in call("plan", tmp_path / "p.toml", code=1)


@pytest.mark.slow
def test_the_path_of_a_recording(tmp_path):
    x, y = np.random.default_rng(0).standard_normal((2, 1 << 14))
    heard = ss.lfilter([1.0], [1.0, -1.2, 0.97], x) + ss.lfilter([1.0], [1.0, 0.8, 0.97], y)
    np.savetxt(tmp_path / "r.csv", heard, header="a1", comments="")
    *_, low, high = call("path", tmp_path / "r.csv", "--rate", 12800, "--modes", 2).splitlines()
    frequencies = [float(line.split("|")[2]) for line in (low, high)]
    assert frequencies == pytest.approx([1865.0, 4053.0], rel=0.02)
    np.savetxt(tmp_path / "w.csv", x, header="a1", comments="")
    assert "no resonance" in call("path", tmp_path / "w.csv", "--rate", 12800, code=1)


def test_data_sets_that_cannot_be_split_are_refused_before_they_are_simulated(tmp_path):
    told = call("dataset", tmp_path / "d", "--signals", 96, "--specimens", 2, code=1)
    assert "2 groups are too few" in told
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", ["12800", "12800.0", "1.28e4", "12.8 kHz", "12800 Hz"])
def test_rates_as_they_are_written(text):
    assert _given_rate(text) == {"rate": 12800.0}


@pytest.mark.parametrize("text", ["0", "-5", "nan", "0 Hz", "inf"])
def test_rates_that_are_none(text, capsys):
    assert _given_rate(None) == {}
    with pytest.raises(typer.Exit):
        _given_rate(text)
    assert re.search(says("--rate", "12800", "12.8 kHz"), capsys.readouterr().err)
