"""What has no effect here does not stop a deck; what is not there is named as what it is."""

import math

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, run_deck
from gearmbs.adams.parse.commands import parse_script
from gearmbs.adams.parse.deck import read_variables
from gearmbs.mechanism import Mechanism
from tests.adams.decks import PENDULUM
from tests.says import says

BEAM = (
    "BEAM/{n}, I=0201, J=0101, LENGTH=2, IXX=1, IYY=1, IZZ=1, AREA=1, EMODULUS=1E3, GMODULUS=1E3, FORMULATION={kind}\n"
)


def with_lines(text: str) -> str:
    return PENDULUM.replace("END\n", text + "END\n")


def remarks(deck) -> list[str]:
    return [d.message for d in deck.diagnostics]


def test_formulations_of_beams_are_remarked_once():
    lines = "".join(BEAM.format(n=n, kind="LINEAR" if n == 1 else "NONLINEAR") for n in range(1, 9))
    deck = parse_deck(with_lines(lines))
    (remark,) = [m for m in remarks(deck) if "FORMULATION" in m]
    assert remark.startswith("BEAM/2, BEAM/3, BEAM/4, BEAM/5 and 3 more: FORMULATION = NONLINEAR is computed as LINEAR")


def test_many_arguments_without_effect_are_one_remark():
    lines = "".join(f"VARIABLE/{n}, IC={n}, FUNCTION=TIME\n" for n in range(1, 10)) + "VARIABLE/20, FUNCTION=TIME\n"
    (remark,) = [m for m in remarks(parse_deck(with_lines(lines))) if "IC" in m]
    assert remark.startswith("VARIABLE/1, VARIABLE/2, VARIABLE/3, VARIABLE/4 and 5 more: IC without effect")


def test_friction_may_say_inactive_during_statics():
    line = "FRICTION/1, JOINT=1, MU_STATIC=0.3, MU_DYNAMIC=0.2, PIN_RADIUS=0.01, INACTIVE_DURING=STATIC\n"
    (friction,) = [s for s in parse_deck(with_lines(line)) if s.label() == "FRICTION/1"]
    assert friction.inactive == "STATIC"


@pytest.mark.parametrize("name", ["SURFACE", "NODE", "CLEARANCE"])
def test_statements_of_adams_are_not_taken_for_misspelt_others(name):
    deck = parse_deck(with_lines(f"{name}/1, I=0201\n"))
    assert [d.message.partition("; instead")[0] for d in deck.unsupported] == [
        f"{name}/1 is not supported; it changes the motion"
    ]


def test_libraries_of_subroutines_are_remarked():
    script = parse_script("model\nout\nfile/model=x, users\nsimulate/dynamics, end=1, steps=3\n")
    assert [d.message for d in script.diagnostics] == [
        "FILE: USERS has no effect here: there are no compiled subroutines to load"
    ]
    assert not script.unsupported


def test_a_range_of_elements_is_switched():
    forces = "".join(f"SFORCE/{n}, I=0201, J=0101, ROTATIONAL, ACTIONONLY, FUNCTION={n}\n" for n in (3, 4, 7, 9))
    deck = parse_deck(with_lines(forces))
    script = parse_script("m\no\ndeactivate/sforce, range=4,8\nsimulate/dynamics, end=0.01, steps=1\n")
    model = run_deck(deck, script).segments[-1].model
    assert sorted(n for kind, n in model.names if kind == "sforce") == [3, 9]
    for text, message in (
        ("deactivate/sforce, range=10,20", says("SFORCE", "10", "20", "deck")),
        ("deactivate/sforce, range=1,2", says("SFORCE", "1", "2")),
        ("deactivate/sforce, range=9,3", says("DEACTIVATE", "RANGE", "larger", "first")),
        ("deactivate/sforce, id=3, range=3,9", says("DEACTIVATE", "ID", "RANGE", "not both")),
    ):
        with pytest.raises(DeckError, match=message):
            run_deck(deck, parse_script(f"m\no\n{text}\nsimulate/dynamics, end=0.01, steps=1\n"))


def test_a_sensor_is_switched():
    deck = parse_deck(with_lines("SENSOR/1, GE, FUNCTION=TIME, VALUE=0.005, HALT\n"))
    script = "m\no\n{}simulate/dynamics, end=0.01, steps=1\n"
    assert run_deck(deck, parse_script(script.format(""))).t[-1] == pytest.approx(0.005)
    assert run_deck(deck, parse_script(script.format("deactivate/sensor, id=1\n"))).t[-1] == pytest.approx(0.01)


VARIABLES = """\
VARIABLE/1, FUNCTION=SENVAL(3)
VARIABLE/2, FUNCTION=VARVAL(1)+1
VARIABLE/3, FUNCTION=2*TIME
VARIABLE/4, FUNCTION=VARVAL(3)+1
POUTPUT/1, VARIABLES=1,2
PINPUT/2, VARIABLES=3
"""


def test_a_function_that_only_an_unread_variable_uses_stops_nothing():
    deck = parse_deck(with_lines(VARIABLES))
    script = "m\no\nsimulate/dynamics, end=0.01, steps=2\n"
    result = run_deck(deck, parse_script(script))
    assert result.success
    told = [m for m in result.messages if "reads it" in str(m)]
    assert len(told) == 1
    assert "VARIABLE/1, VARIABLE/2: FUNCTION" in told[0]
    assert "VARIABLE/1" in str(told[0])
    for reader in ("REQUEST/9, F2=VARVAL(2)\n", "SFORCE/1, I=0201, J=0101, ROTATIONAL, FUNCTION=POUVAL(1,2)\n"):
        deck = parse_deck(with_lines(VARIABLES + reader))
        with pytest.raises(DeckError, match=r"VARIABLE/1: FUNCTION: .*SENVAL"):
            run_deck(deck, parse_script(script))


def test_variables_are_read_through_others_and_through_lists():
    deck = parse_deck(with_lines(VARIABLES + "SFORCE/1, I=0201, J=0101, ROTATIONAL, FUNCTION=VARVAL(4)\n"))
    assert read_variables(deck) == {3, 4}
    deck = parse_deck(with_lines(VARIABLES + "SFORCE/1, I=0201, J=0101, ROTATIONAL, FUNCTION=POUVAL(1,1)\n"))
    assert read_variables(deck) == {1, 2}


def test_included_angle():
    """Between a fixed line along x and a pendulum's rod the angle is the pendulum's own, folded into 0 to pi."""
    m = Mechanism("pendulum", gravity=(0.0, -9.81, 0.0))
    rod = m.body("rod", 1.0, (0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0))
    m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.ground.marker((2.0, 0.0, 0.0), name="ahead")
    m.ground.marker(name="pivot")
    rod.marker((1.0, 0.0, 0.0), name="tip")
    solution = m.simulate(1.5, rate=200, tol=1e-9)
    angle = solution.evaluate("INCANG(ahead, pivot, tip)")
    x, y, _ = solution.com_position("rod").T
    np.testing.assert_allclose(angle, np.abs(np.arctan2(y, x)), atol=1e-12)
    assert angle.max() > 0.9 * math.pi / 2
    with pytest.raises(Exception, match="vertex apart"):
        solution.evaluate("INCANG(pivot, pivot, tip)")


def test_arguments_that_only_say_how_to_draw_or_print_are_read():
    lines = (
        'RESULTS/XRF, NOFLOATINGMARKERS, NOCONTACTS, NOTIRES\nREQUEST/9, F2=TIME\\CNAMES="", "", CLABELS="(s)", ""\n'
    )
    assert not parse_deck(with_lines(lines)).unsupported


@pytest.mark.parametrize("switch", ["", ", FRICTION=OFF"])
def test_the_old_friction_of_joints_is_off_unless_it_is_switched_on(switch):
    """View wrote its sizes for every joint; without them the motion is the same."""
    sizes = ", DELTA_V=0.01, MAXIMUM_DEFORMATION=0.01, MU_DYN_ROT=0.3, MU_STAT_ROT=0.4, INNER_RADIUS=1"
    deck = parse_deck(PENDULUM.replace("REVOLUTE", f"REVOLUTE{switch}{sizes}", 1))
    (remark,) = [m for m in remarks(deck) if "INNER_RADIUS" in m]
    assert "MU_DYN_ROT" in remark
    assert remark.endswith("only where it says FRICTION = ON; for friction write a FRICTION statement")
    assert not deck.unsupported
    rubbing, free = (run_deck(d, end=0.1, steps=2).part(2) for d in (deck, parse_deck(PENDULUM)))
    np.testing.assert_array_equal(rubbing, free)


@pytest.mark.parametrize("value", ["ON", "PRELOAD_ONLY"])
def test_the_old_friction_of_joints_is_refused(value):
    deck = parse_deck(PENDULUM.replace("REVOLUTE", f"REVOLUTE, FRICTION={value}, MU_DYN_ROT=0.3", 1))
    (told,) = [d.message for d in deck.unsupported]
    assert told.startswith(f"JOINT/1: FRICTION = {value} is not supported, as its law is not known; write FRICTION/1, ")
    assert "JOINT = 1, MU_STATIC = ..., MU_DYNAMIC = 0.3, PIN_RADIUS = ..." in told
    assert ("INPUTS = PRELOAD" in told) == (value == "PRELOAD_ONLY")


def test_what_is_refused_has_what_to_write_instead():
    deck = parse_deck(with_lines("SPLINE/9, FILE=a.dat"))
    (told,) = [d.message for d in deck.unsupported]
    assert told == "SPLINE/9: FILE is not supported; instead, use X and Y in the deck"


def test_what_stands_on_parts_that_are_left_out_is_left_out():
    text = with_lines(
        "FE_PART/9, TYPE=2DXYBEAM, NODE_LABELS=1,2, COORDINATES=0,1, SECTION=1,1, MATERIAL=1\n"
        "MARKER/901, FE_PART=9, NODE_LABEL=1\nJOINT/9, FIXED, I=901, J=0101\n"
        "SFORCE/9, TRANSLATIONAL, I=901, J=0101, FUNCTION=1\nMOTION/9, JOINT=9, FUNCTION=0\n"
    )
    result = run_deck(parse_deck(text), end=0.01, steps=1, allow_unsupported=True)
    told = [str(m) for m in result.messages if "left out" in str(m)]
    assert result.success
    assert sum("at MARKER/901" in text for text in told) == 2
    assert any("with JOINT/9" in text for text in told)


def test_paths_of_windows_are_read_in_scripts():
    script = parse_script("file/model=C:\\Users\\Ben.T\\run 1\\test\nsimulate/dynamic, end=1, steps=2\nstop\n")
    assert script.model == "C:\\Users\\Ben.T\\run 1\\test"
    assert len(script.commands) == 3


@pytest.mark.parametrize(("hold", "rest"), [("", 1.0), (", STATIC_HOLD", 3.0)])
def test_a_state_may_be_held_in_statics(hold, rest):
    deck = parse_deck(
        "held\nUNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND\nPART/1, GROUND\nMARKER/1, PART=1\n"
        "MARKER/11, PART=1, ZP=1,0,0\nPART/2, MASS=2, CM=20, IP=1,1,1, QG=0.1,0,0\nMARKER/20, PART=2\n"
        "MARKER/21, PART=2, ZP=1.1,0,0\nJOINT/1, TRANSLATIONAL, I=21, J=11\n"
        f"DIFF/1, IC=3{hold}, FUNCTION=1-DIF(1)\n"
        "SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=10*DIF(1)-10*DX(20,1)\n"
        "REQUEST/1, F2=DX(20,1)\\F3=DIF(1)\nEND\n"
    )
    result = run_deck(deck, parse_script("a\nb\nSIMULATE/STATICS\nSIMULATE/DYNAMICS, END=1, STEPS=2\n"))
    values = result.request(1)
    assert values[0, 1:3] == pytest.approx([rest, rest], abs=1e-9)
    assert values[-1, 2] == pytest.approx(1.0 + (rest - 1.0) * math.exp(-1.0), abs=1e-7)


def test_what_is_not_modelled_can_be_switched_and_requests_stay():
    deck = parse_deck(PENDULUM)
    script = parse_script("m\no\ndeactivate/tire, id=1\ndeact/request, id=1\nsimulate/dynamics, end=0.01, steps=1\n")
    result = run_deck(deck, script)
    assert result.success
    assert any("DEACTIVATE of REQUEST has no effect here" in m for m in result.messages)
    for kind in ("variable", "lse"):
        lines = f"m\no\nactivate/{kind}, id=1\nsimulate/dynamics, end=0.01, steps=1\n"
        with pytest.raises(DeckError, match=says("ACTIVATE", kind.upper())):
            run_deck(deck, parse_script(lines))
        assert run_deck(deck, parse_script(lines), allow_unsupported=True).success


def test_one_remark_for_many_of_a_kind():
    """Thirty variables that nothing reads, with a function that is not there; thirty markers on curves."""
    lines = "".join(f"VARIABLE/{n}, FUNCTION=RANDOM(1,2,3)\n" for n in range(1, 31))
    found = [m for m in run_deck(parse_deck(with_lines(lines)), end=0.01, steps=1).messages if "RANDOM" in m]
    assert len(found) == 1
    assert "VARIABLE/1, VARIABLE/2, VARIABLE/3, VARIABLE/4 and 26 more: FUNCTION" in found[0]
    lines = "".join(f"MARKER/{n}, PART=01, CURVE=1\n" for n in range(5001, 5031))
    with pytest.raises(DeckError) as refused:
        run_deck(parse_deck(with_lines(lines)), end=0.01, steps=1)
    assert len(refused.value.diagnostics) == 30
    assert len(str(refused.value).splitlines()) == 1
    assert "MARKER/5004 and 26 more: CURVE" in str(refused.value)


def test_friction_takes_any_word_for_when_it_rests():
    for word, remarked in (("STATIC_EQUILIBRIUM", False), ("NEVER", True)):
        line = (
            "FRICTION/1, JOINT=1, MU_STATIC=0.3, MU_DYNAMIC=0.2, PIN_RADIUS=0.01, INPUTS=NONE, "
            f"FRICTION_TORQUE_PRELOAD=1, MAX_STICTION_DEFORMATION=1E-4, INACTIVE_DURING={word}\n"
        )
        result = run_deck(parse_deck(with_lines(line)), parse_script("m\no\nsimulate/statics\n"))
        assert any("friction" in m.lower() for m in result.messages) == remarked
