"""Scripts carried out: settings, changes between runs, analyses, messages."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, parse_script
from gearmbs.adams.results.result import message_text
from gearmbs.adams.runner import run_deck
from tests.says import says

from .decks import PENDULUM
from .test_run import model

SLIDER = """\
PART/2,MASS=2,CM=20,IP=1,1,1
MARKER/20,PART=2
JOINT/1,TRANSLATIONAL,I=20,J=10
REQUEST/1,F2=DZ(20,10)\\F3=VZ(20,10)
"""


def script(*commands: str):
    return parse_script("model\nout\n" + "\n".join(commands) + "\nSTOP\n")


def test_kinematic_analysis_of_a_driven_mechanism():
    deck = parse_deck(model(SLIDER + "MOTION/1,JOINT=1,TRANSLATION,FUNCTION=0.1*SIN(4*TIME)"))
    result = run_deck(deck, script("SIMULATE/KINEMATICS, END=2, STEPS=40"))
    assert result.success
    np.testing.assert_allclose(result.request(1)[:, 1], 0.1 * np.sin(4 * result.t), atol=1e-9)
    np.testing.assert_allclose(result.request(1)[:, 2], 0.4 * np.cos(4 * result.t), atol=1e-8)
    assert "Performing Kinematic Simulation" in message_text(result)


def test_transient_is_dynamic_where_there_is_freedom():
    deck = parse_deck(model(SLIDER + "ACCGRAV/KGRAV=-2"))
    result = run_deck(deck, script("SIM/TRANSIENT, END=1, DTOUT=0.3"))
    # the last output is the end itself
    np.testing.assert_allclose(result.t, [0, 0.3, 0.6, 0.9, 1.0], atol=1e-12)
    np.testing.assert_allclose(result.request(1)[:, 1], -(result.t**2), atol=1e-7)


def test_changes_of_forces_motions_and_parts():
    body = SLIDER + "SFORCE/1,TRANS,ACTION,I=20,J=10,FUNCTION=4\n"
    result = run_deck(
        parse_deck(model(body)),
        script(
            "SIM/DYN, END=1, STEPS=2",
            "SFORCE/1, FUNCTION=-8",
            "PART/2, MASS=4",
            "SIM/DYN, END=2, STEPS=2",
            "DEACT/SFORCE, ID=1",
            "SIM/DYN, END=3, STEPS=2",
            "ACTIVATE/SFORCE, ID=1",
            "SIM/DYN, END=4, STEPS=2",
        ),
    )
    # a = 2, then -2, then 0, then -2
    speed = result.request(1)[[2, 5, 8, 11], 2]
    np.testing.assert_allclose(speed, [2, 0, 0, -2], atol=1e-7)
    np.testing.assert_allclose(result.request(1)[-1, 1], 1 + 1 + 0 - 1, atol=1e-6)


def test_integrator_settings_are_used_and_named():
    deck = parse_deck(PENDULUM.replace("OUTPUT/", "INTEGRATOR/GSTIFF, I3, ERROR=1E-6, HMAX=0.005, KMAX=3\nOUTPUT/"))
    result = run_deck(deck, end=0.2, steps=4)
    options = result.segments[0].options
    assert options["integrator"] == "GSTIFF"
    assert options["formulation"] == "I3"
    assert (options["tol"], options["max_step"], options["max_order"]) == (1e-6, 0.005, 3)
    assert result.segments[0].solution.stats.as_dict()["steps"] >= 40
    text = message_text(result)
    assert "using Gstiff I3 Integrator" in text
    assert "INDEX-3" in text
    other = run_deck(parse_deck(PENDULUM.replace("OUTPUT/", "INTEGRATOR/HHT, ERROR=1E-5\nOUTPUT/")), end=0.1, steps=2)
    assert any("HHT is not available; WSTIFF is used" in m for m in other.messages)


def test_times_are_in_the_decks_unit():
    text = (
        "test\nUNITS/FORCE=NEWTON,MASS=KILOGRAM,LENGTH=MILLIMETER,TIME=MILLISECOND\nPART/1,GROUND\nMARKER/10,PART=1\n"
    )
    # 9.80665 m/s^2 = 0.00980665 mm/ms^2
    text += SLIDER.replace("IP=1,1,1", "IP=1E6,1E6,1E6") + "ACCGRAV/KGRAV=-0.00980665\nEND\n"
    result = run_deck(parse_deck(text), end=100, dtout=50)
    np.testing.assert_allclose(result.t, [0, 50, 100])
    np.testing.assert_allclose(result.request(1)[:, 1], -0.5 * 0.00980665 * result.t**2, atol=1e-5)
    assert result.segments[0].solution.t[-1] == pytest.approx(0.1)


@pytest.mark.slow
def test_a_sequence_of_equilibria():
    """A pendulum pulled aside by 2 t N hangs at tan a = 2 t/(m g); then the start of a swing is reported."""
    body = "PART/2,MASS=2,CM=20,IP=1,1,1\nMARKER/20,PART=2,QP=0,0,-1\nMARKER/21,PART=2,REULER=0,90D,0\n"
    body += "MARKER/11,PART=1,REULER=0,90D,0\nMARKER/12,PART=1,FLOATING\nJOINT/1,REVOLUTE,I=21,J=11\n"
    body += "VFORCE/1,I=20,JFLOAT=12,RM=10,FX=2*TIME\nACCGRAV/KGRAV=-10\n"
    body += "REQUEST/1,F2=DX(20,10)\\F3=DZ(20,10)\\F4=JOINT(1,0,1)\\F6=ACCX(20)\n"
    result = run_deck(parse_deck(model(body)), script("SIM/STATICS, END=20, STEPS=40", "SIM/INITIAL"))
    assert result.success
    t, values = result.t[:41], result.request(1)
    np.testing.assert_allclose(values[:41, 1] / -values[:41, 2], t / 10, atol=1e-9)
    np.testing.assert_allclose(values[:41, 3], np.hypot(20, 2 * t), rtol=1e-9)
    assert result.t.size == 42
    assert abs(values[41, 5]) < 1e-8
    assert "Performing Static Simulation" in message_text(result)


@pytest.mark.parametrize(
    ("commands", "line", "message"),
    [
        (("SIM/DYN, END=1, STEPS=2", "LINEAR/NOVECTOR"), 4, says("LINEAR", "EIGENSOL", "STATEMAT")),
        (("MOTION/7, FUNCTION=TIME",), 3, says("MOTION/7")),
        (("SIM/DYN, END=1, STEPS=2", "SIM/DYN, END=1, STEPS=2"), 4, says("model", "time 1.0")),
        (("SIM/KIN, END=1, STEPS=2",), 3, says("degrees of freedom", "1")),
    ],
)
def test_what_a_script_cannot_do_is_named_with_its_line(commands, line, message):
    with pytest.raises(DeckError, match=message) as caught:
        run_deck(parse_deck(model(SLIDER)), script(*commands))
    assert caught.value.diagnostics[0].line == line


def test_unsupported_parts_stop_the_run_unless_allowed():
    deck = parse_deck(PENDULUM.replace("OUTPUT/", "TIRE/1, J=1\nCLEARANCE/1, I=1\nOUTPUT/"))
    with pytest.raises(DeckError, match="TIRE/1 is not supported") as caught:
        run_deck(deck, end=0.1)
    assert len(caught.value.diagnostics) == 2
    result = run_deck(deck, end=0.1, steps=2, allow_unsupported=True)
    assert result.success
    assert "TIRE/1 is not supported" in message_text(result)
