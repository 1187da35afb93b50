"""What is not supported is left out with all that reads it, each with its reason, or refused all at once."""

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck

PENDULUM = """a pendulum
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/11, PART=1, REULER=0D,90D,0D
PART/2, MASS=1, CM=22, IP=0.1,0.1,0.1, QG=0.5,0,0
MARKER/21, PART=2, QP=-0.5,0,0, REULER=0D,90D,0D
MARKER/22, PART=2
JOINT/1, REVOLUTE, I=21, J=11
ACCGRAV/KGRAV=-9.81
REQUEST/9, F2=DZ(22)
"""
CASES = {
    "by a routine": (
        "SFORCE/1, ROTATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=USER(1)\n"
        "REQUEST/1, F2=DZ(22)\\F3=SFORCE(1,0,8,1)\nVARIABLE/1, FUNCTION=SFORCE(1,0,8,11)\n"
        "SENSOR/1, FUNCTION=VARVAL(1), GE, VALUE=1, HALT\n",
        {"SFORCE/1": "SFOSUB is missing", "REQUEST/1": "SFORCE/1", "VARIABLE/1": "SFORCE/1", "SENSOR/1": "VARIABLE/1"},
    ),
    "by a function": (
        "VARIABLE/1, FUNCTION=DELAY(DZ(22), 0.1, 0)\nVARIABLE/2, FUNCTION=VARVAL(1)+1\n"
        "SFORCE/1, ROTATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=-VARVAL(2)\nREQUEST/1, F3=VARVAL(2)\n",
        {"VARIABLE/1": "DELAY", "VARIABLE/2": "VARIABLE/1", "SFORCE/1": "VARIABLE/2", "REQUEST/1": "VARIABLE/2"},
    ),
    "constraints": (
        "MOTION/1, JOINT=1, ROTATIONAL, FUNCTION=RANDOM(1,TIME,5)\nGCON/1, FUNCTION=INTERP(DZ(22),1,3)\n"
        "REQUEST/1, F2=MOTION(1,0,2,1)\\F3=GCON(1,0,2,1)\n",
        {"MOTION/1": "RANDOM", "GCON/1": "INTERP", "REQUEST/1": "MOTION/1"},
    ),
    "through a system of states": (
        "VARIABLE/1, FUNCTION=WXYZ(22)\nARRAY/1, U, VARIABLES=1\nARRAY/2, X\nARRAY/3, Y\n"
        "ARRAY/4, NUMBERS=1\nARRAY/5, NUMBERS=1,1\n"
        "TFSISO/1, X=2, U=1, Y=3, NUMERATOR=4, DENOMINATOR=5\nREQUEST/1, F2=ARYVAL(3,1)\n",
        {"VARIABLE/1": "WXYZ", "ARRAY/1": "VARIABLE/1", "TFSISO/1": "ARRAY/1", "REQUEST/1": "ARRAY/3"},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_what_reads_the_unsupported_goes_with_it(case, tmp_path):
    lines, reasons = CASES[case]
    result = run_deck(
        parse_deck(PENDULUM + lines + "END\n"), end=0.1, steps=5, allow_unsupported=True, out=tmp_path / "out"
    )
    told = {str(d.message).split(":")[0]: d.message for d in result.deck.unsupported}
    assert set(told) == set(reasons)
    for label, reason in reasons.items():
        assert reason in told[label]
    bare = run_deck(parse_deck(PENDULUM + "END\n"), end=0.1, steps=5)
    np.testing.assert_array_equal(result.request(9), bare.request(9))
    head = (tmp_path / "out.msg").read_text().split("---- END")[0]
    moving = [label for label in reasons if label.split("/")[0] not in ("REQUEST", "VARIABLE", "ARRAY")]
    assert "its motion is not that of the deck" in head
    assert all(label in head for label in moving)
    assert "REQUEST" not in head


def test_without_the_switch_all_is_refused_in_one_round_and_once():
    lines = (
        "UCON/1, FUNCTION=USER(1)\nVARIABLE/1, FUNCTION=DELAY(DZ(22), 0.1, 0)\n"
        "SFORCE/1, ROTATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=-VARVAL(1)\nREQUEST/1, F2=VARVAL(1)\\F3=DZZ(22)\n"
    )
    with pytest.raises(DeckError) as caught:
        run_deck(parse_deck(PENDULUM + lines + "END\n"), end=0.1)
    assert [d.message.split(":")[0].split(" ")[0] for d in caught.value.diagnostics] == ["UCON/1", "VARIABLE/1"]
    text = str(caught.value)
    assert "a TFSISO that approximates the delay" in text
    assert "--skip-unsupported" in text


def test_routines_that_are_missing_are_refused_with_the_rest():
    lines = "UCON/1, FUNCTION=USER(1)\nDIFF/1, FUNCTION=USER(2)\nGCON/1, FUNCTION=INTERP(DZ(22),1,3)\n"
    with pytest.raises(DeckError) as caught:
        run_deck(parse_deck(PENDULUM + lines + "END\n"), end=0.1)
    assert [d.line for d in caught.value.diagnostics] == [11, 12, 13]


def test_commands_to_what_is_left_out_change_nothing():
    deck = PENDULUM + "SFORCE/1, ROTATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=DELAY(TIME,0.1,0)\nEND\n"
    script = "a\nb\nDEACTIVATE/SFORCE, ID=1\nSFORCE/1, FUNCTION=2\nSIMULATE/DYNAMICS, END=0.1, STEPS=5\n"
    result = run_deck(parse_deck(deck), parse_script(script), allow_unsupported=True)
    assert result.success


def test_a_command_with_a_function_that_is_refused_leaves_the_old_one():
    deck = PENDULUM + "SFORCE/1, ROTATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=0.1\nEND\n"
    script = parse_script("a\nb\nSFORCE/1, FUNCTION=DELAY(TIME,0.1,0)\nSIMULATE/DYNAMICS, END=0.1, STEPS=5\n")
    with pytest.raises(DeckError, match="<script>:3: unsupported: SFORCE/1: FUNCTION: the function DELAY"):
        run_deck(parse_deck(deck), script)
    left = run_deck(parse_deck(deck), script, allow_unsupported=True)
    assert any("the command is left out" in message for message in left.messages)
    np.testing.assert_array_equal(left.request(9), run_deck(parse_deck(deck), end=0.1, steps=5).request(9))
