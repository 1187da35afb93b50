"""What a script changes between analyses, and what goes on from one to the next."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, parse_script, read_script
from gearmbs.adams.runner import run_deck
from tests.says import says

from .test_run import model

PENDULUM = """\
PART/2,MASS=1,CM=20,IP=0.04,0.1,0.1,QG=1,0,0
MARKER/20,PART=2
MARKER/21,PART=2,QP=-1,0,0,REULER=0D,90D,0D
MARKER/11,PART=1,REULER=0D,90D,0D
JOINT/1,REVOLUTE,I=21,J=11
"""
"""I = 0.1 + 1 = 1.1 kg m^2 about the pin, whose z axis is the global -y axis."""


def run(body: str, *commands: str, **options):
    return run_deck(parse_deck(model(PENDULUM + body)), parse_script("\n".join(commands)), **options)


@pytest.mark.slow
def test_counted_angles_go_on_in_the_next_analysis():
    """A torsion spring of k = 1.1e-2 wound up at 10 rad/s: AZ = 100 sin(t/10), beyond three turns."""
    body = "SPRINGDAMPER/1,ROTATIONAL,I=21,J=11,KT=1.1E-2\nREQUEST/1,F2=AZ(21,11)\\F3=SPDP(1,0,8,11)\n"
    script = ("PART/2, VZ=10, WY=-10", "SIM/DYN, END=1, STEPS=20", "SIM/DYN, END=2, STEPS=20", "SIM/STATICS")
    result = run(body, *script)
    angle = result.request(1)[:, 1]
    np.testing.assert_allclose(np.abs(angle[:-1]), 100 * np.sin(result.t[:-1] / 10), rtol=1e-6)
    np.testing.assert_allclose(result.request(1)[:, 2], -1.1e-2 * angle, rtol=1e-9, atol=1e-12)
    # the spring unwinds altogether
    assert abs(angle[-1]) < 1e-8


def test_screw_goes_on_in_the_next_analysis():
    """m z'' + I (2 pi/p)^2 z'' = -m g: five turns down, and no jump where the second analysis starts."""
    body = "PART/2,MASS=2,CM=20,IP=1,1,1E-4\nMARKER/20,PART=2\nJOINT/1,SCREW,I=20,J=10,PITCH=0.1\nACCGRAV/KGRAV=-10\n"
    deck = parse_deck(model(body))
    result = run_deck(deck, parse_script("SIM/DYN, END=0.5, STEPS=10\nSIM/DYN, END=1, STEPS=10"))
    fall = 10 / (1 + 1e-4 * (2 * np.pi / 0.1) ** 2 / 2)
    np.testing.assert_allclose(result.part(2)[:, 2], -0.5 * fall * result.t**2, atol=1e-6)


def test_inactive_elements_exert_nothing():
    body = "ACCGRAV/KGRAV=-10\nMOTION/1,JOINT=1,FUNCTION=0\nSFORCE/1,TRANS,ACTION,I=20,J=1,FUNCTION=JOINT(1,0,4,0)\n"
    body += (
        "MARKER/1,PART=1,REULER=0D,90D,0D\nREQUEST/1,F4=JOINT(1,0,4,0)\\F6=MOTION(1,0,5,0)\nREQUEST/2,FORCE,I=21,J=11\n"
    )
    result = run(body, "SIM/DYN, END=1, STEPS=2", "DEACT/JOINT, ID=1", "SIM/DYN, END=2, STEPS=4")
    first, second = result.request(1)[:3], result.request(1)[3:]
    assert np.all(first[:, 3] > 1.0)
    assert np.all(second == 0.0)
    assert np.all(result.request(2)[3:] == 0.0)
    # free from then on
    np.testing.assert_allclose(result.part(2)[3:, 2], -5 * (result.t[3:] - 1) ** 2, atol=1e-6)
    assert any("MOTION/1 rests while JOINT/1 is inactive" in m for m in result.messages)


@pytest.mark.parametrize(
    ("commands", "line", "message"),
    [
        (("DEACT/JOINT, ID=7",), 1, says("JOINT/7")),
        (("JOINT/1, I=99",), 1, says("JOINT/1", "MARKER/99")),
        (("SIM/INITIAL", "MOTION/1, JOINT=9"), 2, "MOTION/1: there is no JOINT/9"),
        (("SIM/INITIAL", "PART/2, VX=3"), 2, says("PART/2", "VX")),
        (("SIM/INITIAL", "JOINT/1, FRICTION=ON"), 2, "FRICTION is not supported"),
        (("FILE/COMMAND=none",), 1, says("COMMAND = none", "file")),
    ],
)
def test_wrong_changes_are_named_with_their_line(commands, line, message):
    with pytest.raises(DeckError, match=message) as caught:
        run("MOTION/1,JOINT=1,FUNCTION=TIME\n", *commands, "SIM/DYN, END=1, STEPS=2")
    assert caught.value.diagnostics[0].line == line
    assert caught.value.diagnostics[0].file == "<script>"


def test_command_files_call_others(tmp_path):
    (tmp_path / "first.acf").write_text(
        "model\nout\nSIM/DYN, END=1, STEPS=2\nFILE/COMMAND=second\nSIM/DYN, END=3, STEPS=2\n"
    )
    (tmp_path / "second.acf").write_text("! twice as far\nSIM/DYN, END=2, STEPS=2\n")
    result = run_deck(parse_deck(model(PENDULUM)), read_script(tmp_path / "first.acf"))
    np.testing.assert_allclose(result.t, [0, 0.5, 1, 1, 1.5, 2, 2, 2.5, 3])
    (tmp_path / "second.acf").write_text("SIM/DYNAMICS, END=2, STEPS=two\n")
    with pytest.raises(DeckError, match=r"second\.acf:1: error: SIMULATE: STEPS"):
        read_script(tmp_path / "first.acf")
    (tmp_path / "second.acf").write_text("FILE/COMMAND=first\n")
    with pytest.raises(DeckError, match=says("10", "files call each")):
        read_script(tmp_path / "first.acf")


def test_every_part_of_the_initial_conditions_can_be_asked_for():
    result = run("ACCGRAV/KGRAV=-10\nREQUEST/1,F2=ACCZ(20)\n", "SIM/DISPLACEMENT", "SIM/VELOCITY", "SIM/ACCELERATION")
    # the rod starts to fall with g m/(m + I)
    np.testing.assert_allclose(result.request(1)[:, 1], -10 / 1.1, rtol=1e-12)


def test_motions_by_their_rate_in_analyses_of_one_instant():
    body = "MOTION/1,JOINT=1,VELOCITY,FUNCTION=3*COS(TIME)\nREQUEST/1,F2=AZ(21,11)\\F3=WZ(21,11,11)\n"
    script = ("SIM/INITIAL", "LINEAR/EIGENSOL", "SIM/STATICS", "SIM/KIN, END=1, STEPS=2")
    result = run(body, *script)
    np.testing.assert_allclose(result.request(1)[2:, 1], 3 * np.sin(result.t[2:]), atol=1e-9)
    assert result.request(1)[0, 2] == pytest.approx(3.0)
    assert len(result.modes[0]) == 0


def test_settings_without_effect_are_remarked_on():
    body = "INTEGRATOR/GSTIFF,MAXIT=3,INTERPOLATE=ON,HRATIO=5,PATTERN=T:F\nEQUILIBRIUM/STABILITY=1E-3\n"
    body += "OUTPUT/DSCALE=1000,1\nRESULTS/NOREQUESTS\nPART/3,MASS=1,CM=30,IP=1,1,1,EXACT=X:Y\nMARKER/30,PART=3\n"
    result = run(body, "SIM/DYN, END=0.1, STEPS=2")
    options = result.segments[0].options
    assert (options["max_iterations"], options["interpolate"]) == (3, True)
    for words in ("HRATIO, PATTERN", "STABILITY", "DSCALE", "NOREQUESTS", "EXACT"):
        assert any(f": {words} without effect" in m for m in result.messages), words


@pytest.mark.parametrize(("argument", "words"), [("", ["does not take part in static"]), (",INACTIVE=STATIC", [])])
def test_static_analyses_of_friction_are_remarked_on(argument, words):
    """A pendulum held aside by a stiff dry pin in a dynamic analysis stays there in a static one."""
    body = f"ACCGRAV/KGRAV=-10\nFRICTION/1,JOINT=1,MU_STATIC=0.9,MU_DYNAMIC=0.9,PIN_RADIUS=1.2{argument}\n"
    script = ("SIM/DYN, END=3, STEPS=3", "SIM/STATICS")
    result = run(body, *script)
    assert [m for m in result.messages if any(w in m for w in words)] or not words
    others = [m for m in result.messages if "MAX_STICTION_DEFORMATION" not in m]
    assert not words or len(others) == 1
    np.testing.assert_allclose(result.part(2)[-1, :3], result.part(2)[-2, :3], atol=1e-6)


def test_yaw_pitch_and_roll_where_asked_for():
    body = "MARKER/22,PART=2,REULER=0D,0.3,0D\nREQUEST/1,DISPLACEMENT,I=22,J=10\nOUTPUT/REQSAVE,YPR\n"
    result = run(body, "SIM/INITIAL")
    np.testing.assert_allclose(result.request(1)[0, 5:], [0, 0, 0.3], atol=1e-12)
    assert result.segments[0].requests[1].names[5:] == ("YAW", "PITCH", "ROLL")


def test_files_hold_beams_and_friction(tmp_path):
    body = "BEAM/4,I=20,J=10,LENGTH=1,IXX=1E-8,IYY=1E-8,IZZ=1E-8,AREA=1E-4,EMODULUS=2E6,GMODULUS=1E6\n"
    body += "FRICTION/5,JOINT=1,MU_STATIC=0.3,MU_DYNAMIC=0.2,PIN_RADIUS=0.02\n"
    result = run(body, "SIM/DYN, END=0.1, STEPS=2", out=tmp_path / "run")
    text = (tmp_path / "run.res").read_text()
    assert 'entType="Beam" objectId="4"' in text
    assert 'entType="Friction" objectId="5"' in text
    assert result.success
