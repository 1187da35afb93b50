"""USER(...) bound to Python functions: forces, motions, variables and requests as their expressions would have them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from typer.testing import CliRunner

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck
from gearmbs.cli import app
from tests.says import says

DECK = """spring
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
MARKER/10, PART=1, FLOATING
PART/2, MASS=2, CM=20, IP=1e4,1e4,1e4, QG=100,0,0
MARKER/20, PART=2
JOINT/1, TRANSLATIONAL, I=21, J=11
MARKER/21, PART=2, ZP=101,0,0
MARKER/11, PART=1, ZP=1,0,0
{force}
REQUEST/1, F2=DX(20,1)\\F3=VX(20,1)
END
"""
WRITTEN = "-0.3*DX(20,1,1) - 0.01*VX(20,1,1) + 2*SIN(5*TIME)"
SCRIPT = "m\no\nSIMULATE/DYNAMICS, END=1, STEPS=50\n"


def run(force, routines=None, script=SCRIPT, **more):
    return run_deck(parse_deck(DECK.format(force=force)), parse_script(script), tol=1e-9, routines=routines, **more)


def pull(call):
    k, c, amplitude = call.parameters
    x, v = call.sysfnc("DX", 20, 1, 1), call.sysfnc("VX", 20, 1, 1)
    return -k * x - c * v + amplitude * math.sin(5 * call.time)


PULLED = "SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION={}"
EXPECTED = PULLED.format(WRITTEN)


@pytest.mark.parametrize(
    ("force", "name"),
    [
        ("USER(0.3, 0.01, 2)", "sfosub"),
        ("USER(0.3, 0.01, 2)", "SFORCE/1"),
        ("USER(0.3, 1E-2, 2)\\ROUTINE=library::PULL", "pull"),
        ("USER(0.3, 1E-2, 2)\\ROUTINE=..\\bin\\library::PULL", "pull"),
    ],
)
@pytest.mark.slow
def test_a_force_by_a_routine_is_that_of_the_expression(force, name):
    expected = run(EXPECTED).request(1)
    found = run(PULLED.format(force), {name: pull})
    assert found.success
    np.testing.assert_allclose(found.request(1)[:, 1:3], expected[:, 1:3], atol=2e-7)


def test_values_are_those_of_the_expression_to_the_last_digit():
    deck = DECK.format(force=EXPECTED + "\nREQUEST/2, F2=SFORCE(1,0,4,1)")
    found = run_deck(
        parse_deck(DECK.format(force=PULLED.format("USER(0.3, 0.01, 2)") + "\nREQUEST/2, F2=SFORCE(1,0,4,1)")),
        parse_script("m\no\nSIMULATE/DYNAMICS, END=1E-6, STEPS=1\n"),
        routines={"sfosub": pull},
    )
    expected = run_deck(parse_deck(deck), parse_script("m\no\nSIMULATE/DYNAMICS, END=1E-6, STEPS=1\n"))
    assert found.request(2)[0, 1] == expected.request(2)[0, 1]


def test_values_are_those_of_the_expression_to_the_last_digit_at_all_times():
    """On one motion the routine's force and the written one differ in no digit."""
    text = EXPECTED + f"\nREQUEST/2, F2={WRITTEN}\nREQUEST/3, FUNCTION=USER(0.3, 0.01, 2)"
    found = run(text, {"REQUEST/3": lambda call: (0, pull(call), 0, 0, 0, 0, 0, 0)})
    assert np.ptp(found.request(2)[:, 1]) > 1.0
    np.testing.assert_array_equal(found.request(3)[:, 1], found.request(2)[:, 1])


@pytest.mark.slow
def test_forces_of_several_components():
    def both(call):
        x, y, z = call.sysary("TDISP", 20, 1, 1)
        vx, *_ = call.sysary("VEL", (20, 1, 1))
        return -0.3 * x - 0.01 * vx + 2 * math.sin(5 * call.time), -y, -z

    expected = run(EXPECTED).request(1)
    text = "VFORCE/1, I=20, JFLOAT=10, RM=1, FUNCTION=USER(1)"
    np.testing.assert_allclose(run(text, {"vfosub": both}).request(1)[:, 1:3], expected[:, 1:3], atol=2e-7)
    text = "GFORCE/1, I=20, JFLOAT=10, RM=1, FUNCTION=USER(1)"
    found = run(text, {"gfosub": lambda call: (*both(call), 0, 0, 0)})
    np.testing.assert_allclose(found.request(1)[:, 1:3], expected[:, 1:3], atol=2e-7)


FREE = """spun
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
MARKER/10, PART=1, FLOATING
PART/2, MASS=2, CM=20, IP=0.3,0.4,0.5, WX=1, WY=0.2
MARKER/20, PART=2
{torque}
REQUEST/1, F2=WX(20,1,20)\\F3=WY(20,1,20)\\F4=WZ(20,1,20)\\F6=DX(20,1)\\F7=AZ(20,1)
END
"""
TORQUES = "TX={0}*SIN(3*TIME)\\TY=-{0}*WY(20,1,20)\\TZ={0}*DX(20,1)"


@pytest.mark.slow
def test_torques_by_routines():
    """VTORQUE, and the torques of a GFORCE."""

    def torques(call):
        (k,) = call.parameters
        (_, wy, _), (x, *_) = call.sysary("RVEL", 20, 1, 20), call.sysary("DISP", 20, 1)
        return k * math.sin(3 * call.time), -k * wy, k * x

    def both(call):
        return 0.5 * math.cos(call.time), 0.0, 0.0, *torques(call)

    for written, called, routines in (
        ("VTORQUE/1, I=20, JFLOAT=10, RM=20, " + TORQUES.format(0.2),
         "VTORQUE/1, I=20, JFLOAT=10, RM=20, FUNCTION=USER(0.2)", {"vtosub": torques}),
        ("GFORCE/1, I=20, JFLOAT=10, RM=20, FX=0.5*COS(TIME)\\FY=0\\FZ=0\\" + TORQUES.format(0.2),
         "GFORCE/1, I=20, JFLOAT=10, RM=20, FUNCTION=USER(0.2)", {"GFORCE/1": both}),
    ):  # fmt: skip
        expected, found = (
            run_deck(parse_deck(FREE.format(torque=text)), parse_script(SCRIPT), tol=1e-9, routines=routines)
            for text in (written, called)
        )
        assert found.success
        assert np.abs(expected.request(1)[-1, 1:4]).min() > 1e-2
        np.testing.assert_allclose(found.request(1), expected.request(1), atol=2e-8)


@pytest.mark.slow
def test_a_sensor_by_a_routine_and_a_compiled_routine():
    """The analysis ends where SENSUB passes its value; what numba has compiled is called with numbers and arrays."""
    from numba import njit

    @njit
    def pulls(time, x, xd, u, parameters):
        return parameters[0] * np.sin(5.0 * time)

    text = PULLED.format("USER(2)") + "\nSENSOR/1, LE, VALUE=0.25, FUNCTION=USER(100), RETURN"
    found = run(text, {"sfosub": pulls, "sensub": lambda call: 1.0 - call.time - 0.0 * call.sysfnc("DX", 20, 1)})
    plain = run(PULLED.format("2*SIN(5*TIME)") + "\nSENSOR/1, LE, VALUE=0.25, FUNCTION=1-TIME, RETURN")
    assert found.t[-1] == pytest.approx(0.75, abs=1e-9)
    np.testing.assert_allclose(found.request(1), plain.request(1), atol=2e-7)


@pytest.mark.slow
def test_variables_states_motions_and_requests():
    text = """VARIABLE/1, FUNCTION=USER(0.3)
DIFF/1, IC=1, FUNCTION=USER(-2)
SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=VARVAL(1) + DIF(1)
REQUEST/2, FUNCTION=USER(7)"""
    routines = {
        "varsub": lambda call: -call.parameters[0] * call.sysfnc("DX", 20, 1, 1),
        "difsub": lambda call: call.parameters[0] * call.sysfnc("DIF", 1),
        "reqsub": lambda call: (0, call.sysfnc("DX", 20, 1), call.parameters[0], 0, 0, 0, 0, call.time),
    }
    found = run(text, routines)
    plain = run(
        "VARIABLE/1, FUNCTION=-0.3*DX(20,1,1)\nDIFF/1, IC=1, FUNCTION=-2*DIF(1)\n"
        "SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=VARVAL(1) + DIF(1)"
    )
    np.testing.assert_allclose(found.request(1)[:, 1:3], plain.request(1)[:, 1:3], atol=2e-7)
    assert found.request(2)[:, 1] == pytest.approx(found.request(1)[:, 1])
    assert found.request(2)[:, 2] == pytest.approx(7)
    assert found.request(2)[:, 7] == pytest.approx(found.t)
    moved = run(
        "MOTION/1, JOINT=1, FUNCTION=USER(3)", {"motsub": lambda c: 100 + c.parameters[0] * math.sin(2 * c.time)}
    )
    np.testing.assert_allclose(moved.request(1)[:, 1], 100 + 3 * np.sin(2 * moved.t), atol=1e-6)
    np.testing.assert_allclose(moved.request(1)[:, 2], 6 * np.cos(2 * moved.t), atol=1e-5)


def test_routines_act_at_an_equilibrium():
    text = "SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=USER()".replace("USER()", "USER(0)")
    found = run(text, {"sfosub": lambda c: 6 - 0.3 * c.sysfnc("DX", 20, 1, 1)}, script="m\no\nSIMULATE/STATICS\n")
    assert found.request(1)[-1, 1] == pytest.approx(20, abs=1e-6)


def test_missing_routines_are_named_all_at_once():
    text = PULLED.format("USER(1)\\ROUTINE=lib::own") + "\nVARIABLE/3, FUNCTION=USER(2)\nDIFF/4, IC=0, FUNCTION=USER(3)"
    with pytest.raises(DeckError) as caught:
        run(text, {"varsub": lambda call: 1.0})
    message = str(caught.value)
    assert "SFORCE/1: its routine OWN is missing" in message
    assert "DIFF/4: its routine DIFSUB is missing" in message
    assert "VARIABLE/3" not in message
    left = run(text, allow_unsupported=True)
    assert left.success
    assert left.request(1)[:, 1] == pytest.approx(100)


def test_missing_routines_of_all_statements_are_named_at_once():
    text = """VFORCE/1, I=20, JFLOAT=10, RM=1, FUNCTION=USER(1)
VTORQUE/2, I=20, JFLOAT=10, RM=1, FUNCTION=USER(1)
GFORCE/3, I=20, JFLOAT=10, RM=1, FUNCTION=USER(1)
MOTION/4, JOINT=1, FUNCTION=USER(1)
VARIABLE/5, FUNCTION=USER(1)
DIFF/6, IC=0, FUNCTION=USER(1)
REQUEST/7, FUNCTION=USER(1)
SENSOR/8, EQ, VALUE=1, FUNCTION=USER(1), EVALUATE=USER(2)
COUPLER/9, JOINTS=1,1, FUNCTION=USER(1)
FIELD/10, I=20, J=1, FUNCTION=USER(1)
CURVE/11, OPEN, FUNCTION=USER(1)
GSE/12, NS=1, NO=1, X=1, Y=2, FUNCTION=USER(1)
ARRAY/1, X, SIZE=1
ARRAY/2, Y, SIZE=1
"""
    with pytest.raises(DeckError) as caught:
        run(PULLED.format("USER(1)") + "\n" + text)
    told = [d.message for d in caught.value.diagnostics]
    words = """SFORCE/1: SFOSUB VFORCE/1: VFOSUB VTORQUE/2: VTOSUB GFORCE/3: GFOSUB MOTION/4: MOTSUB
    VARIABLE/5: VARSUB DIFF/6: DIFSUB REQUEST/7: REQSUB SENSOR/8: SENSUB SENSOR/8: SEVSUB COUPLER/9: COUSUB
    FIELD/10: FIESUB CURVE/11: CURSUB GSE/12: GSE_DERIV"""
    pairs = words.split()
    for label, name in zip(pairs[::2], pairs[1::2]):
        assert any(one.startswith(label) and name in one and "missing" in one for one in told), (label, told)


@pytest.mark.parametrize(
    ("routine", "words"),
    [
        (lambda call: (1, 2), says("2", "1", "returns")),
        (lambda call: call.sysary("PLACE", 1), "SYSARY has no 'PLACE'"),
        (lambda call: call.sysfnc("DX", 99), "MARKER 99"),
        (lambda call: call.nothing, "has no attribute 'nothing'"),
    ],
)
def test_what_a_routine_does_wrong_is_said(routine, words):
    with pytest.raises((DeckError, AttributeError), match=words):
        run(PULLED.format("USER(1)"), {"sfosub": routine})


def test_a_late_wish_is_said():
    def late(call):
        x = call.sysfnc("DX", 20, 1, 1)
        return call.sysfnc("VX", 20, 1, 1) if x > 50 else -x

    with pytest.raises(Exception, match=says("SFORCE/1", "USER", "VX", "20")):
        run(PULLED.format("USER(1)"), {"sfosub": late})


@pytest.mark.slow
def test_routines_from_a_file_on_the_command_line(tmp_path):
    (tmp_path / "m.adm").write_text(DECK.format(force=PULLED.format("USER(0.3, 0.01, 2)")))
    (tmp_path / "own.py").write_text(
        "import math\n\ndef sfosub(call):\n    k, c, a = call.parameters\n"
        "    return -k*call.sysfnc('DX', 20, 1, 1) - c*call.sysfnc('VX', 20, 1, 1) + a*math.sin(5*call.time)\n"
    )
    arguments = ["adams", str(tmp_path / "m.adm"), "--end", "0.1", "--steps", "5"]
    refused = CliRunner().invoke(app, arguments)
    assert refused.exit_code == 1
    assert "SFOSUB is missing" in refused.output
    result = CliRunner().invoke(app, [*arguments, "--routines", str(tmp_path / "own.py")])
    assert result.exit_code == 0, result.output
    (tmp_path / "empty.py").write_text("x = 1\n")
    bad = CliRunner().invoke(app, [*arguments, "--routines", str(tmp_path / "empty.py")])
    assert bad.exit_code == 1
    assert "defines no functions" in bad.output


def test_whatever_a_routine_raises_is_told_with_its_statement():
    def broken(call):
        return [1.0][call.id]

    with pytest.raises(DeckError, match=says("SFORCE/1", "IndexError")):
        run(PULLED.format("USER(1)"), {"sfosub": broken})


@pytest.mark.slow
def test_commands_may_change_a_deck_with_routines_of_fields_couplers_and_systems():
    deck = parse_deck("""routines in all places, and a force that changes
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
PART/2, MASS=1, CM=20, IP=1,1,1
MARKER/20, PART=2
PART/3, MASS=1, CM=30, IP=1,1,1
MARKER/30, PART=3
JOINT/1, TRANSLATIONAL, I=20, J=10
JOINT/2, TRANSLATIONAL, I=30, J=10
COUPLER/1, JOINTS=1,2, TYPE=T:T, FUNCTION=USER(1)
FIELD/1, I=20, J=10, FUNCTION=USER(1)
ARRAY/1, X, SIZE=1
GSE/1, NS=1, X=1, FUNCTION=USER(1)
SFORCE/1, TRANSLATIONAL, I=20, J=10, ACTIONONLY, FUNCTION=1
END
""")
    routines = {
        "COUSUB": lambda call: call.q[0] - 2.0 * call.q[1],
        "FIESUB": lambda call: [0.0] * 6,
        "GSE_DERIV": lambda call: [1.0],
    }
    script = parse_script("a\nb\nSIM/DYN, END=0.1, STEPS=5\nSFORCE/1, FUNCTION=0\nSIM/DYN, END=0.2, STEPS=5\n")
    run = run_deck(deck, script, routines=routines)
    assert run.success
    acceleration = 1.0 / 1.25
    assert run.segments[1].solution.com_velocity("PART_2")[-1, 2] == pytest.approx(0.1 * acceleration, rel=1e-6)


TWO = "m\no\nSIM/DYN, END=0.5, STEPS=5\nSFORCE/1, FUNCTION={}\nREQUEST/2, FUNCTION=USER({})\nSIM/DYN, END=1, STEPS=5\n"


def asked(call):
    return [call.parameters[0] * call.sysfnc("DX", 20, 1)] + [0.0] * 7


@pytest.mark.slow
def test_a_command_gives_a_routine_other_parameters():
    """The first analysis is not to be seen with those of the second: commands are gone through before the run."""
    force = PULLED + "\nREQUEST/2, FUNCTION=USER(1)"
    routines = {"sfosub": pull, "reqsub": asked}
    found = run(force.format("USER(0.3, 0.01, 2)"), routines, TWO.format("USER(0.6, 0.02, 3)", 3))
    doubled = "-0.6*DX(20,1,1) - 0.02*VX(20,1,1) + 3*SIN(5*TIME)"
    expected = run(force.format(WRITTEN), routines, TWO.format(doubled, 3))
    np.testing.assert_allclose(found.request(1)[:, 1:3], expected.request(1)[:, 1:3], atol=2e-6)
    factors = found.request(2)[:, 0] / found.request(1)[:, 1]
    np.testing.assert_allclose(factors, [1.0] * 6 + [3.0] * 6, rtol=1e-12)


def test_a_command_whose_routine_is_missing_is_refused_or_left_out():
    force, script = PULLED.format(WRITTEN), TWO.format("USER(1)", 1).replace("REQUEST/2, FUNCTION=USER(1)\n", "")
    with pytest.raises(DeckError, match=says("SFORCE/1", "routine", "SFOSUB")) as caught:
        run(force, None, script)
    assert caught.value.diagnostics[0].line == 4
    found = run(force, None, script, allow_unsupported=True)
    assert found.success
    assert any("SFOSUB" in str(m) and "left out" in str(m) for m in found.messages)
    np.testing.assert_allclose(found.request(1)[-1, 1:3], run(force).request(1)[-1, 1:3], atol=2e-6)
