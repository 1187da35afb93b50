"""What a script's mistakes cost: most show before anything is run, and what was computed is kept."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck
from gearmbs.cli import app
from tests.says import says

from .decks import PENDULUM
from .test_run import model

FREE = "PART/2,MASS=1,CM=20,IP=1,1,1\nMARKER/20,PART=2\nACCGRAV/KGRAV=-10\nREQUEST/1,F2=DZ(20)\n"
"""A body that falls; it has no equilibrium."""


@pytest.mark.slow
def test_an_error_in_a_later_command_keeps_what_ran(tmp_path):
    script = parse_script(
        "SIM/DYN, END=0.1, STEPS=10\nDEACT/ACCGRAV\nACT/ACCGRAV\nSIM/STATICS\nSIM/DYN, END=1, STEPS=2\n"
    )
    with pytest.raises(DeckError) as caught:
        run_deck(parse_deck(model(FREE)), script, tmp_path / "run")
    assert str(caught.value).endswith("(in <script>:4)")
    result = caught.value.result
    assert len(result.segments) == 1
    assert not result.success
    # the fall from rest
    np.testing.assert_allclose(result.request(1)[:, 1], -5 * result.t**2, atol=1e-9)
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        assert data.sizes["time"] == 11
    assert {p.suffix for p in tmp_path.iterdir()} == {".req", ".res", ".msg", ".nc"}
    message = (tmp_path / "run.msg").read_text()
    assert message.index("command: DEACT/ACCGRAV") < message.index("command: SIM/STATICS") < message.index("ERROR")
    assert str(caught.value.diagnostics[0]) in message


def test_interrupted_scripts_keep_what_ran(tmp_path, monkeypatch):
    def stop(*_, **__):
        raise KeyboardInterrupt("stopped by hand")

    monkeypatch.setattr("gearmbs.adams.analysis.linear_modes", stop)
    script = parse_script("SIM/DYN, END=0.1, STEPS=10\nLINEAR/EIGENSOL\n")
    with pytest.raises(KeyboardInterrupt, match="stopped by hand"):
        run_deck(parse_deck(model(FREE)), script, tmp_path / "run")
    message = (tmp_path / "run.msg").read_text()
    assert "was interrupted at TIME = 0.1, in command LINEAR/EIGENSOL" in message
    with xr.open_dataset(tmp_path / "run.partial.nc", engine="h5netcdf") as data:
        assert data.sizes["time"] == 11


@pytest.mark.parametrize(
    ("commands", "message"),
    [
        ("SIM/DYN, END=0.1, STEPS=1\nSIM/DYN, END=0.05, STEPS=1", says("script", "2", "END = 0.05", "model")),
        (
            "SIM/DYN, END=0.1, STEPS=1\nDEACT/JOINT, ID=9\nSIM/DYN, END=1, STEPS=1",
            says("script", "2", "JOINT/9"),
        ),
        (
            "SIM/DYN, END=0.1, STEPS=1\nREQUEST/1, F2=DX(77)\nSIM/DYN, END=1, STEPS=1",
            says("script", "2", "REQUEST/1", "F2", "MARKER 77"),
        ),
    ],
)
def test_mistakes_show_before_anything_is_run(tmp_path, commands, message):
    with pytest.raises(DeckError, match=message) as caught:
        run_deck(parse_deck(model(FREE)), parse_script(commands), tmp_path / "run")
    assert not caught.value.result.segments
    assert [p.name for p in tmp_path.iterdir()] == ["run.msg"]
    assert str(caught.value.diagnostics[0]) in (tmp_path / "run.msg").read_text()


def test_all_wrong_expressions_are_named_at_once_with_their_lines():
    body = FREE + (
        "SFORCE/1,TRANS,I=20,J=10,FUNCTION=DX(20,99)\nMARKER/21,PART=2\nJOINT/1,REV,I=21,J=10\nMOTION/2,JOINT=1,FUN=TIM*2\n"
        "MOTION/3,JOINT=1,VEL,\n, FUNCTION=DX(20,10)\nGCON/1,I=20,FUNCTION=VX(20,10)\nVARIABLE/1,FUNCTION=FOO(1)\n"
        "DIFF/1,FUNCTION=DIF(7)\nREQUEST/2,F3=JOINT(8,0,2)\n"
    )
    deck = parse_deck(model(body))
    with pytest.raises(DeckError) as caught:
        run_deck(deck, end=1.0)
    found = {(d.line, d.message.split(":")[0]) for d in caught.value.diagnostics}
    # four lines of the model and four of the body stand above
    first = 9
    expected = {
        (first, "SFORCE/1"), (first + 3, "MOTION/2"), (first + 5, "MOTION/3"), (first + 6, "GCON/1"),
        (first + 7, "VARIABLE/1"), (first + 8, "DIFF/1"), (first + 9, "REQUEST/2"),
    }  # fmt: skip
    assert found == expected
    text = str(caught.value)
    assert "MOTION/2: FUNCTION: TIM is not TIME" in text
    assert "'DX(20,10)' must be a function of TIME alone" in text
    assert ":0:" not in text


def test_what_only_a_run_finds_has_its_line():
    """The repr of the load in the message names its markers, too, which stand before it in the deck."""
    body = FREE + "SFORCE/1,TRANS,ACTION,I=20,J=10,FUNCTION=1/TIME\n"
    with pytest.raises(DeckError, match="SFORCE_1") as caught:
        run_deck(parse_deck(model(body)), end=1.0)
    assert caught.value.diagnostics[0].line == 9
    with pytest.raises(DeckError, match="<deck>: error: no PART moves"):
        run_deck(parse_deck(model("")), end=1.0)


def test_statics_and_linear_of_a_motion_by_its_velocity():
    """A crank turned at 2 rad/s; an analysis at one time needs no span of it."""
    body = (
        "PART/2,MASS=1,CM=20,IP=1,1,1\nMARKER/20,PART=2\nMARKER/21,PART=2\nJOINT/1,REV,I=21,J=10\nACCGRAV/JGRAV=-10\n"
    )
    body += "MOTION/1,JOINT=1,VEL,FUNCTION=2\nREQUEST/1,F2=AZ(21,10)\\F3=WZ(21,10)\n"
    script = parse_script("SIM/STAT\nSIM/INITIAL\nSIM/DYN, END=1, STEPS=2\nSIM/STAT\n")
    result = run_deck(parse_deck(model(body)), script)
    angle, rate = result.request(1)[:, 1], result.request(1)[:, 2]
    np.testing.assert_allclose(angle, [0, 0, 0, 1, 2, 2], atol=1e-9)
    np.testing.assert_allclose(rate, [0, 2, 2, 2, 2, 0], atol=1e-9)


def test_parts_that_do_not_fit_are_named_with_units(tmp_path):
    """The centre of mass is at x = 2; the pin turns it by 30 degrees to where the motion starts: 4 sin(15 deg) m."""
    deck = parse_deck(PENDULUM.replace("ACCGRAV/", "MOTION/1, JOINT=1, FUNCTION=30D\nACCGRAV/"))
    result = run_deck(deck, end=0.1, steps=1, out=tmp_path / "run")
    expected = "at TIME = 0 the parts did not fit their joints and motions and were moved: PART/2 by 1.035 meter"
    assert any(m.startswith(expected) and "PART/2 by 30 degrees" in m for m in result.messages)
    message = (tmp_path / "run.msg").read_text()
    assert "largest corrections 1.035E+00 meter (PART/2) and 3.000E+01 degrees (PART/2)." in message
    assert expected in message


def test_message_file_tells_what_statics_found(tmp_path):
    script = parse_script("SIM/STAT\nDEACT/JOINT, ID=1\nSIM/DYN, END=0.1, STEPS=1\n")
    deck = parse_deck(PENDULUM.replace("QP = 2, 0, 0", "QP = 0, 0, 2"))
    result = run_deck(deck, script, tmp_path / "run")
    message = (tmp_path / "run.msg").read_text()
    # an upright pendulum is balanced and falls
    assert "The equilibrium is unstable." in message
    assert any("the equilibrium at TIME = 0 is unstable" in m for m in result.messages)
    statics = message[message.index("Performing Static") : message.index("command: DEACT/JOINT, ID=1")]
    assert "DAEs" not in statics
    assert "Equilibrium found in" in statics


@pytest.mark.slow
def test_names_and_units_in_netcdf(tmp_path):
    run_deck(parse_deck(PENDULUM), end=0.1, steps=2, out=tmp_path / "run")
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        assert data["part_2"].sel(part_column="VZ").part_unit == "meter/sec"
        np.testing.assert_allclose(data["request_1"].sel(request_1_column="DX")[0], 2.0)
        force = data["joint_1"].sel(force_column="FZ")
        assert force.force_unit == "newton"
        np.testing.assert_allclose(force, data["request_5"].sel(request_5_column="F4"), atol=1e-9)


@pytest.mark.slow
def test_files_are_named_by_the_script(tmp_path):
    (tmp_path / "pend.adm").write_text(PENDULUM)
    (tmp_path / "go.acf").write_text("pend\nfirst\nSIM/DYN, END=0.1, STEPS=2\n")
    runner = CliRunner()
    outcome = runner.invoke(app, ["adams", str(tmp_path / "pend.adm"), str(tmp_path / "go.acf")])
    assert outcome.exit_code == 0, outcome.output
    assert (tmp_path / "first.req").is_file()
    (tmp_path / "go.acf").write_text(
        "file/model=pend, output_prefix=second\nSIM/DYN, END=0.1, STEPS=2\nSIM/STAT, END=0.05\n"
    )
    outcome = runner.invoke(app, ["adams", str(tmp_path / "pend.adm"), str(tmp_path / "go.acf")])
    assert outcome.exit_code == 1
    assert "END = 0.05" in outcome.output
    assert (tmp_path / "second.msg").is_file()
    outcome = runner.invoke(app, ["adams", str(tmp_path / "pend.adm")])
    assert outcome.exit_code == 1
    assert "or --end and --steps" in outcome.output.replace("\n", " ")
    outcome = runner.invoke(app, ["adams", str(tmp_path / "missing.adm")])
    assert outcome.exit_code == 1
    assert "there is no file" in outcome.output.replace("\n", " ")
    outcome = runner.invoke(app, ["adams", str(tmp_path / "pend.adm"), str(tmp_path / "go.acf"), "--end", "1"])
    assert outcome.exit_code == 1
    assert "a script has its own end times" in outcome.output.replace("\n", " ")
