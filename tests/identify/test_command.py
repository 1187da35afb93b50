"""``gearmbs identify``: from files to a report."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.signals import write_signal
from gearmbs.signals.files.simulated import record_signal
from gearmbs.studies import Case, run_case

FIT = """
gains = "channel"
store = "done"
channels = { line_of_action = "line_of_action", line_of_centres = "line_of_centres" }

[recording]
low = "low.nc"
high = "high.csv"

[measured]
teeth = [29, 29]
way = "orders"
sections = 1

[case.all.operation]
speed = "1000 rpm"
duration = "0.08 s"
run_up = "0.02 s"
settling = "0.02 s"

[case.high.operation]
torque = "200 N m"

[[free]]
path = "friction.dynamic"
start = 0.04
low = 0.01
high = 0.2
also = { "friction.static" = 2.0 }
"""


@pytest.mark.slow
def test_from_recordings_to_a_report(tmp_path):
    """A recording of one state and a table of another, both made with a friction that the fit does not know."""
    friction = {"static": 0.12, "dynamic": 0.06}
    short = {"duration": 0.08, "run_up": 0.02, "settling": 0.02}
    records = {
        name: run_case(Case(operation={**short, "torque": torque}, friction=friction), False)
        for name, torque in (("low", 100.0), ("high", 200.0))
    }
    write_signal(record_signal(records["low"]), tmp_path / "low.nc")
    levels = records["high"]["gmf_rms"].sel(way="orders")
    rows = ["case,channel,harmonic,value,sigma"]
    for c in ("line_of_action", "line_of_centres"):
        for k in (1, 2, 3):
            rows.append(f"high,{c},{k},{float(levels.sel(component=c, harmonic=k)):.8g},0.02")
    (tmp_path / "high.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "fit.toml").write_text(FIT)
    result = CliRunner().invoke(app, ["identify", str(tmp_path / "fit.toml"), "-o", str(tmp_path / "report.md")])
    assert result.exit_code == 0, result.output
    text = (tmp_path / "report.md").read_text()
    line = next(row for row in text.partition("# Fit")[2].splitlines() if row.startswith("| friction.dynamic"))
    np.testing.assert_allclose(float(line.split("|")[2]), 0.06, rtol=0.01)
    assert "every parameter is determined" in text
    assert list((tmp_path / "done").glob("*.json"))


def test_wrong_files_are_named(tmp_path):
    (tmp_path / "fit.toml").write_text("[recordings]\n")
    result = CliRunner().invoke(app, ["identify", str(tmp_path / "fit.toml")])
    assert result.exit_code == 1
    assert "unknown key 'recordings'" in result.output
