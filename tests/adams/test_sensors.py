"""SENSOR: a body thrown up, whose passages are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck, sensors
from gearmbs.adams.results.result import message_text
from gearmbs.adams.sensors import in_unit
from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.mechanism.solve.simulate import StopAt
from tests.says import says

DECK = """thrown
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
MARKER/2, PART=1, FLOATING
PART/2, MASS=2, CM=20, IP=1,1,1{start}
MARKER/20, PART=2
ACCGRAV/KGRAV=-10
VFORCE/1, I=20, JFLOAT=2, RM=1, FZ=SENVAL(1)
{sensor}
REQUEST/1, F2=DZ(20)\\F3=VZ(20)\\F4=SENVAL(1)
END
"""
ONE = "SIMULATE/DYNAMICS, END=2, STEPS=20\n"


def run(sensor, commands=ONE, start=", QG=0,0,10"):
    script = parse_script("m\no\n" + commands)
    return run_deck(parse_deck(DECK.format(sensor=sensor, start=start)), script)


def test_return_goes_on_with_the_next_command():
    result = run(
        "SENSOR/1, LE, VALUE=5, FUNCTION=DZ(20), RETURN",
        ONE + "DEACTIVATE/SENSOR, ID=1\nSIMULATE/DYNAMICS, DURATION=0.5, STEPS=5\n",
    )
    assert result.t == pytest.approx(np.r_[np.linspace(0, 1, 11), np.linspace(1, 1.5, 6)], abs=1e-9)
    assert result.request(1)[10, 1] == pytest.approx(5.0, abs=1e-9)
    assert "SENSOR/1: DZ(20) is LE 5 at TIME = 1: RETURN" in message_text(result)


def test_halt_ends_the_script():
    result = run("SENSOR/1, EQ, VALUE=5, FUNCTION=DZ(20), HALT", ONE + "SIMULATE/DYNAMICS, DURATION=1, STEPS=1\n")
    assert result.success
    assert len(result.segments) == 1
    assert result.t[-1] == pytest.approx(1.0, abs=1e-9)


def test_a_force_is_switched_at_the_very_time():
    """50 N from the passage on: the fall turns to a rise at 15 m/s^2."""
    result = run("SENSOR/1, LE, VALUE=5, FUNCTION=DZ(20), EVALUATE=50 + 0*DZ(20)")
    t, z, v, sensed = result.t, *result.request(1)[:, 1:4].T
    late = np.maximum(t - 1.0, 0.0)
    # of the two rows at the passage, both have the place and the speed
    assert np.abs(z - np.where(t < 1.0, 10 - 5 * t**2, 5 - 10 * late + 7.5 * late**2)).max() < 1e-8
    assert np.abs(v - np.where(t < 1.0, -10 * t, -10 + 15 * late)).max() < 1e-8
    assert list(sensed[:11]) == [0.0] * 11
    assert sensed[-1] == 50.0


def test_dt_changes_the_outputs_and_print_adds_one():
    t = run("SENSOR/1, LE, VALUE=5, FUNCTION=DZ(20), DT=0.01", "SIMULATE/DYNAMICS, END=1.2, STEPS=12\n").t
    assert t == pytest.approx(np.r_[np.linspace(0, 1, 11), np.linspace(1, 1.2, 21)], abs=1e-9)
    t = run("SENSOR/1, LE, VALUE=8.75, FUNCTION=DZ(20), PRINT", "SIMULATE/DYNAMICS, END=1.2, STEPS=3\n").t
    assert t == pytest.approx([0.0, 0.4, 0.5, 0.5, 0.8, 1.2], abs=1e-9)


def test_a_sensor_that_fires_at_the_end_leaves_nothing_for_its_dt():
    sensor = "SENSOR/1, GE, VALUE=1, FUNCTION=TIME, DT=0.01, PRINT"
    t = run(sensor, "SIMULATE/DYNAMICS, END=1, STEPS=4\n").t
    assert t[-1] == pytest.approx(1.0, abs=1e-9)
    assert t.size <= 6


def test_eq_fires_at_each_passage_and_ge_when_it_comes_from_below():
    """Thrown up with 10 m/s: at 3.75 m after 0.5 s and 1.5 s."""
    start = ", QG=0,0,0, VZ=10"
    both = run("SENSOR/1, EQ, VALUE=3.75, FUNCTION=DZ(20), PRINT", start=start)
    assert sorted(np.round(both.t, 9)).count(0.5) == 2
    assert sorted(np.round(both.t, 9)).count(1.5) == 2
    assert message_text(both).count("is EQ 3.75") == 2
    rising = run("SENSOR/1, GE, VALUE=3.75, FUNCTION=DZ(20), PRINT", start=start)
    assert message_text(rising).count("is GE 3.75") == 1


def test_other_actions_and_several_sensors():
    result = run(
        "SENSOR/1, LE, VALUE=5, FUNCTION=DZ(20), CODGEN, RESTART, STEPSIZE=1E-5, YYDUMP\n"
        "SENSOR/2, GE, VALUE=0.3, FUNCTION=TIME, RESTART\nSENSOR/3, GE, VALUE=1, FUNCTION=TIME, RESTART"
    )
    text = message_text(result)
    assert "TIME = 1: CODGEN, RESTART, STEPSIZE, YYDUMP" in text
    assert "R_z(PART_2) = 5" in text
    assert "SENSOR/2: TIME is GE 0.3 at TIME = 0.3: RESTART" in text
    assert result.request(1)[-1, 1] == pytest.approx(-10.0, abs=1e-8)


def test_a_condition_that_is_met_at_the_start_fires_there():
    result = run("SENSOR/1, GE, VALUE=5, FUNCTION=DZ(20), RETURN")
    assert list(result.t) == [0.0]


def test_driven_mechanisms_are_watched_too():
    deck = DECK.format(sensor="SENSOR/1, GE, VALUE=0.5, FUNCTION=AZ(20,1), RETURN", start="").replace(
        "ACCGRAV", "JOINT/1, REVOLUTE, I=20, J=1\nMOTION/1, JOINT=1, ROTATION, FUNCTION=TIME**2\nACCGRAV"
    )
    result = run_deck(parse_deck(deck), parse_script("m\no\nSIMULATE/KINEMATICS, END=1, STEPS=10\n"))
    assert result.t[-1] == pytest.approx(np.sqrt(0.5), abs=1e-7)


@pytest.mark.parametrize(
    ("sensor", "message"),
    [
        ("SENSOR/1, VALUE=1", "FUNCTION is missing"),
        ("SENSOR/1, GE, LE, VALUE=1, FUNCTION=TIME", "both GE and LE"),
        ("SENSOR/1, VALUE=1, FUNCTION=DZ(77)", "77"),
        ("SENSOR/1, VALUE=1, FUNCTION=TIME, DT=0", says("SENSOR/1", "DT = 0.0")),
        ("SENSOR/1, VALUE=1, FUNCTION=TIME, STEPSIZE=-1", says("STEPSIZE = -1.0")),
        ("SENSOR/1, VALUE=1, FUNCTION=TIME\nINTEGRATOR/GSTIFF, HMAX=0", says("HMAX = 0.0")),
    ],
)
def test_mistakes_are_named(sensor, message):
    with pytest.raises(DeckError, match=message):
        run(sensor)


def test_stops_of_a_mechanism():
    m = Mechanism("fall", gravity=(0, 0, -10))
    m.body("ball", 1.0, (1, 1, 1), position=(0, 0, 10)).marker(name="ball")
    m.algebraic_state("height", "DZ(ball)")
    s = m.simulate(2.0, rate=10, stops=[StopAt("height", 5.0, 1), StopAt("height", 3.75, -1)], tol=1e-9)
    assert s.result.t_events[0].size == 0
    assert s.result.t_events[1] == pytest.approx([np.sqrt(1.25)], abs=1e-9)
    with pytest.raises(ModelError, match=says("state 'depth'", "mechanism", "height")):
        m.simulate(1.0, stops=[StopAt("depth")])
    with pytest.raises(ModelError, match="WSTIFF or GSTIFF"):
        m.simulate(1.0, stops=[StopAt("height")], integrator="IDA")


@pytest.mark.slow
@pytest.mark.parametrize(("unit", "scale", "g"), [("SECOND", 1.0, "-10"), ("MILLISECOND", 1e-3, "-1E-5")])
def test_a_sensor_fires_where_its_function_jumps(unit, scale, g):
    """A sawtooth passes its value downwards after a quarter of each tooth, and jumps up through it at the end."""
    tooth = 0.003 / scale
    sensor = f"SENSOR/1, GE, VALUE={0.25 * tooth}, FUNCTION={0.5 * tooth}-MOD(TIME,{tooth}), RESTART, DT={tooth / 7}"
    deck = DECK.format(sensor=sensor, start=", QG=0,0,10")
    deck = deck.replace("TIME=SECOND", f"TIME={unit}").replace("KGRAV=-10", f"KGRAV={g}")
    script = parse_script(f"m\no\nSIMULATE/DYNAMICS, END={6.2 * tooth}, STEPS=20\n")
    result = run_deck(parse_deck(deck), script)
    ends = [segment.solution.t[-1] for segment in result.segments]
    # met at the start, too
    expected = 0.003 * np.sort(np.r_[0.0, np.arange(6) + 0.25, np.arange(1, 7), 6.2])
    assert message_text(result).count("is GE") == 7
    np.testing.assert_allclose(ends, expected, rtol=1e-14)


def test_a_sensor_fires_where_a_function_of_the_position_jumps():
    """A body that falls through 5 m after 1 s: the sign of its height jumps there."""
    result = run("SENSOR/1, LE, VALUE=-0.9, FUNCTION=IF(DZ(20)-5:-1,0,1), RETURN")
    assert result.t[-1] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.slow
def test_a_sensor_that_puts_its_function_back_for_ever_is_ended():
    sensor = "SENSOR/1, GE, VALUE=0.5, FUNCTION=TIME-SENVAL(1), EVALUATE=SENVAL(1)+1E-12, ERROR=1E-13"
    with pytest.raises(DeckError, match=says("SENSOR/1", "TIME = 0.5")):
        run(sensor)


def test_times_are_rounded_upwards_to_the_unit():
    times = np.random.default_rng(1).uniform(0.0, 10.0, 300)
    found = np.array([in_unit(t, 1e-3) for t in times])
    assert (found * 1e-3 >= times).all()
    np.testing.assert_allclose(found, 1e3 * times, rtol=1e-15)


SPRING = """pulled
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
MARKER/2, PART=1, FLOATING
PART/2, MASS=2, CM=20, IP=1,1,1
MARKER/20, PART=2
JOINT/1, TRANSLATIONAL, I=20, J=1
SPRINGDAMPER/1, TRANSLATION, I=21, J=3, K=100, C=1, LENGTH=1
MARKER/21, PART=2, QP=0,0,1
MARKER/3, PART=1, QP=0,0,2
VFORCE/1, I=20, JFLOAT=2, RM=1, FZ=10*TIME**2 + SENVAL(1)
{sensor}
REQUEST/1, F2=DZ(20)\\F3=SENVAL(1)
END
"""
"""A body between a wall and a spring of 100 N/m that is free at a length of 1 m; at rest z = (force)/100."""


def pulled(sensor, commands="SIMULATE/STATICS, END=2, STEPS=20\n"):
    return run_deck(parse_deck(SPRING.format(sensor=sensor)), parse_script("m\no\n" + commands))


@pytest.mark.slow
@pytest.mark.parametrize("relation", ["GE", "EQ"])
def test_sequences_of_equilibria_are_watched(relation):
    """z = 0.1 t^2 passes 0.1234 m at t = sqrt(1.234)."""
    result = pulled(f"SENSOR/1, {relation}, VALUE=0.1234, FUNCTION=DZ(20), EVALUATE=-10, PRINT")
    when = np.sqrt(1.234)
    t, z = result.t, result.request(1)[:, 1]
    assert t[12:14] == pytest.approx([when, when], abs=1e-8)
    before = np.arange(t.size) <= 12
    assert z == pytest.approx(np.where(before, 0.1 * t**2, 0.1 * t**2 - 0.1), abs=1e-8)
    assert result.request(1)[:, 2] == pytest.approx(np.where(before, 0.0, -10.0))
    # what it evaluates throws the body back below the value, which it passes once more
    again = np.sqrt(2.234)
    assert np.count_nonzero(np.abs(t - again) < 1e-8) == 2
    assert message_text(result).count(f"is {relation} 0.1234") == 2


@pytest.mark.slow
def test_a_sequence_of_equilibria_returns_and_halts():
    two = "SIMULATE/STATICS, END=2, STEPS=20\nSIM/DYN, DUR=0.1, STEPS=1\n"
    result = pulled("SENSOR/1, GE, VALUE=0.1, FUNCTION=DZ(20), RETURN", two)
    assert len(result.segments) == 2
    assert result.segments[0].solution.t[-1] == pytest.approx(1.0, abs=1e-8)
    halted = pulled("SENSOR/1, LE, VALUE=-1, FUNCTION=-TIME, HALT", two)
    assert len(halted.segments) == 1
    assert halted.t[-1] == pytest.approx(1.0)


def test_a_sensor_that_is_met_at_the_first_equilibrium_fires_there():
    result = pulled("SENSOR/1, LE, VALUE=0.5, FUNCTION=DZ(20), RETURN")
    assert list(result.t) == [0.0]


@pytest.mark.slow
def test_a_sensor_that_chatters_between_outputs_ends_the_run(monkeypatch):
    monkeypatch.setattr(sensors, "CROWD", 20)
    text = "SENSOR/1, LE, VALUE=0.5, FUNCTION=MOD(1E4*TIME,1)+0*DZ(20)"
    with pytest.raises(DeckError, match=says("SENSOR/1", "chatters", "STEPS")):
        run(text, "SIMULATE/DYNAMICS, END=1, STEPS=2\n")
    assert run(text, "SIMULATE/DYNAMICS, END=0.001, STEPS=2\n").success


def test_a_routine_evaluates_what_a_sensor_senses():
    """50 N from the passage on, as by an expression."""
    calls = []

    def sevsub(call):
        calls.append(call.id)
        return call.parameters[0] + 0.0 * call.sysfnc("DZ", 20)

    sensor = "SENSOR/1, LE, VALUE=5, FUNCTION=DZ(20), EVALUATE=USER(50)"
    script = parse_script("m\no\n" + ONE)
    for text, name in (
        (sensor, "sevsub"),
        (f"{sensor}\\EVALUATE_ROUTINE=lib::HOLD", "hold"),
        (sensor, "SENSOR/1/EVALUATE"),
    ):
        deck = parse_deck(DECK.format(sensor=text, start=", QG=0,0,10"))
        result = run_deck(deck, script, routines={name: sevsub})
        assert result.request(1)[-1, 3] == 50.0
        assert result.request(1)[-1, 1] == pytest.approx(5 - 10 + 7.5, abs=1e-8)
        with pytest.raises(DeckError, match=r"SENSOR/1: its routine .* is missing"):
            run_deck(deck, script)
    assert set(calls) == {1}
