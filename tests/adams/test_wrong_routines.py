"""Routines of the user that return or raise what they should not, and those of motions by their rates."""

from __future__ import annotations

import math
import re
import sys

import numpy as np
import pytest
from numba import njit

from gearmbs.adams import DeckError, load_routines, parse_deck, parse_script, run_deck

REHEARSED = f"{__file__}, line "
HEAD = """routines
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
MARKER/10, PART=1, FLOATING
PART/2, MASS=2, CM=20, IP=0.3,0.4,0.5, QG=0.1,0.2,0.3, WX=1, WY=0.2, VX=0.1
MARKER/20, PART=2
"""
STATEMENTS = {
    "sfosub": ("SFORCE/1, TRANSLATIONAL, I=20, J=1, ACTIONONLY, FUNCTION=USER(1)", 1),
    "vfosub": ("VFORCE/1, I=20, JFLOAT=10, RM=1, FUNCTION=USER(1)", 3),
    "vtosub": ("VTORQUE/1, I=20, JFLOAT=10, RM=1, FUNCTION=USER(1)", 3),
    "gfosub": ("GFORCE/1, I=20, JFLOAT=10, RM=1, FUNCTION=USER(1)", 6),
    "fiesub": ("FIELD/1, I=20, J=1, FUNCTION=USER(1)", 6),
    "varsub": ("VARIABLE/1, FUNCTION=USER(1)", 1),
    "difsub": ("DIFF/1, IC=0, FUNCTION=USER(1)", 1),
    "reqsub": ("REQUEST/1, FUNCTION=USER(1)", 8),
    "sensub": ("SENSOR/1, GE, VALUE=9, FUNCTION=USER(1), PRINT", 1),
}


def run(text, routines, script="m\no\nSIMULATE/DYNAMICS, END=1, STEPS=10\n", head=HEAD):
    return run_deck(parse_deck(head + text + "\nEND\n"), parse_script(script), tol=1e-9, routines=routines)


def message(text, routines, **more):
    with pytest.raises(DeckError) as caught:
        run(text, routines, **more)
    (only,) = caught.value.diagnostics
    return only.line, only.message


@pytest.mark.parametrize("name", STATEMENTS)
def test_what_is_no_result_is_named_before_anything_is_run(name):
    text, count = STATEMENTS[name]
    label = text.split(",")[0]
    many = "one number" if count == 1 else f"{count} numbers"

    def asked(call):
        return call.sysfnc("DX", 20, 1)

    for routine, told in (
        (lambda call: (asked(call),) * (count + 1), f"returns {count + 1} numbers, it must return {count}"),
        (lambda call: asked(call) and None, f"returns None, it must return {many}"),
        (lambda call: "none", f"returns 'none', it must return {many}"),
        (lambda call: {}[asked(call) < 0.0], f"fails: KeyError: False ({REHEARSED}"),
        (3, "is 3, which cannot be called"),
    ):
        line, found = message(text, {name: routine})
        assert line == 8
        assert re.sub(r"\d+; in a rehearsal.*", "", found) == f"{label}: its routine {told}"


@pytest.mark.parametrize("name", ["varsub", "reqsub"])
def test_what_fails_only_in_results_is_named(name):
    """The motion does not need it, but a column of it must not end as NaN with success."""
    text, count = STATEMENTS[name]

    def late(call):
        value = call.sysfnc("DX", 20, 1)
        if call.time > 0.5 and not call.rehearsal:
            raise KeyError("table")
        return (value,) * count

    line, told = message(text, {name: late})
    assert line == 8
    assert told.startswith(f"function '{text.split(',')[0]}: USER': KeyError: 'table'")


def test_what_a_sensor_evaluates_may_fail():
    text = "SENSOR/1, GE, VALUE=0.7, FUNCTION=TIME, EVALUATE=USER(1), RETURN"

    def evaluated(call):
        return 1.0 / (1.0 if call.rehearsal else 0.0)

    line, told = message(text, {"sevsub": evaluated})
    assert (line, "ZeroDivisionError" in told) == (8, True)


@pytest.mark.parametrize(
    ("routine", "told"),
    [
        (lambda call: {}[1], "fails at alpha = 0: KeyError: 1"),
        (lambda call: None, "returns nan; it must return x, y and z"),
        (lambda call: (call.alpha, 0.0), "returns [0. 0.]; it must return x, y and z"),
    ],
)
def test_curves_by_routines_that_fail_are_named(routine, told):
    text = "CURVE/1, OPEN, MINPAR=0, MAXPAR=1, FUNCTION=USER(1)\nPTCV/1, I=20, CURVE=1, RM=1"
    assert message(text, {"cursub": routine}) == (8, f"CURVE/1: its routine {told}")


PENDULUM = """routines
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
MARKER/12, PART=1, REULER=0,90D,0
PART/2, MASS=2, CM=20, IP=1,1,1, QG=0.5,0,0
MARKER/20, PART=2
MARKER/21, PART=2, QP=-0.5,0,0, REULER=0,90D,0
JOINT/1, REVOLUTE, I=21, J=12
ACCGRAV/KGRAV=-9.81
REQUEST/1, F2=AZ(21,12)\\F3=WZ(21,12,12)\\F4=WDTZ(21,12,12)\\F6=MOTION(1,0,8,12)
"""


@pytest.mark.parametrize(("level", "atol"), [("", 1e-4), ("VELOCITY, ", 1e-5), ("ACCELERATION, ", 1e-9)])
@pytest.mark.slow
def test_motions_by_rates_from_routines(level, atol):
    """Displacement, rate, change and torque are those of the written function; differences are made of the rest."""
    text = "MOTION/1, JOINT=1, " + level + "FUNCTION={}"

    def motion(call):
        return 0.5 * math.sin(call.parameters[0] * call.time) + 0.1 * call.time**2

    written = run(text.format("0.5*SIN(7*TIME)+0.1*TIME**2"), {}, head=PENDULUM)
    found = run(text.format("USER(7)"), {"motsub": motion}, head=PENDULUM)
    assert found.success
    np.testing.assert_allclose(found.request(1), written.request(1), atol=atol)


@njit
def compiled_coupler(time, x, xd, u, parameters):
    return u[0] - parameters[0] * u[1]


@njit
def compiled_field(time, x, xd, u, parameters):
    return -parameters[0] * u[:6] - 0.1 * u[6:]


@njit
def compiled_circle(time, x, xd, u, parameters):
    return np.array([np.cos(u[0]), np.sin(u[0]), 0.0])


SHAFTS = """PART/3, MASS=1, CM=30, IP=2,2,3, QG=1,0,0
MARKER/30, PART=3
MARKER/31, PART=1, QP=1,0,0
JOINT/1, TRANSLATIONAL, I=20, J=1
JOINT/2, REVOLUTE, I=30, J=31
SFORCE/1, ROTATIONAL, I=30, J=31, ACTIONONLY, FUNCTION=3
COUPLER/1, JOINTS=1,2, {}
REQUEST/1, F2=DZ(20,1)\\F3=AZ(30,31)
"""


@pytest.mark.slow
def test_compiled_routines_are_given_what_their_element_gives():
    expected = run(SHAFTS.format("SCALES=1,-0.4"), {})
    found = run(SHAFTS.format("FUNCTION=USER(0.4)"), {"cousub": compiled_coupler})
    assert np.ptp(found.request(1)[:, 1]) > 0.1
    np.testing.assert_allclose(np.diff(found.request(1), axis=0), np.diff(expected.request(1), axis=0), atol=1e-8)

    field = "FIELD/1, I=20, J=1, {}\nREQUEST/1, F2=DX(20,1)\\F3=WX(20,1)\\F4=DZ(20,1)"
    found = run(field.format("FUNCTION=USER(3)"), {"fiesub": compiled_field})
    expected = run(field.format("FUNCTION=USER(3)"),
                   {"fiesub": lambda call: -3.0 * call.displacement - 0.1 * call.velocity})  # fmt: skip
    np.testing.assert_allclose(found.request(1), expected.request(1), atol=1e-9)

    curve = "CURVE/1, CLOSED, MINPAR=0, MAXPAR=6.283185307179586, FUNCTION=USER(1)\nREQUEST/1, F2=CURVE(TIME,0,2,1)"
    found = run(curve, {"cursub": compiled_circle})
    np.testing.assert_allclose(np.sin(found.t), found.request(1)[:, 1], atol=1e-7)
    # MINPAR and MAXPAR have an effect here
    assert not found.messages


def test_a_compiled_routine_that_reads_beyond_its_arrays_is_named():
    """Compiled code would read what stands in memory there."""
    line, told = message(STATEMENTS["varsub"][0], {"varsub": compiled_coupler})
    assert line == 8
    assert told.startswith("VARIABLE/1: its routine fails: index 0 is out of bounds")
    assert told.endswith("a compiled function is given time, x, xd, u and parameters")


SETS = {
    "DISP": ("DX(20,30,30)", "DY(20,30,30)", "DZ(20,30,30)", "PSI(20,30)", "THETA(20,30)", "PHI(20,30)"),
    "RDISP": ("PSI(20,30)", "THETA(20,30)", "PHI(20,30)"),
    "VEL": ("VX(20,30,30,30)", "VY(20,30,30,30)", "VZ(20,30,30,30)", "WX(20,30,30)", "WY(20,30,30)", "WZ(20,30,30)"),
    "RVEL": ("WX(20,30,30)", "WY(20,30,30)", "WZ(20,30,30)"),
    "ACC": ("ACCX(20,30,30,30)", "ACCY(20,30,30,30)", "ACCZ(20,30,30,30)", "WDTX(20,30,30,30)", "WDTY(20,30,30,30)",
            "WDTZ(20,30,30,30)"),
}  # fmt: skip


@pytest.mark.parametrize("name", SETS)
def test_sets_of_quantities_take_all_the_markers_of_adams(name):
    """I, J, K and L are given alike to all of a set, as ADAMS does, whose angles and spins take fewer."""
    ids = (20, 30, 30, 30)[: 3 if "DISP" in name else 4]
    text = "PART/3, MASS=1, CM=30, IP=1,1,1, QG=1,0,0, WZ=0.7, VX=0.2\nMARKER/30, PART=3, REULER=10D,20D,30D\n"
    text += "BUSHING/1, I=20, J=30, K=9,8,7, KT=3,2,1, C=0,0,0, CT=0,0,0\nREQUEST/1, FUNCTION=USER(1)\nREQUEST/2"
    for k, function in enumerate(SETS[name], 1):
        text += ("\n, " if k == 1 else "\\\n, ") + f"F{k}={function}"
    found = run(text, {"reqsub": lambda call: (*call.sysary(name, *ids), *[0.0] * (8 - len(SETS[name])))})
    assert np.ptp(found.request(2)[:, : len(SETS[name])], axis=0).min() > 1e-3
    np.testing.assert_array_equal(found.request(1), found.request(2))


FALLING = (
    HEAD.replace("WX=1, WY=0.2, VX=0.1", "VX=0.1")
    + "SFORCE/1, TRANSLATIONAL, I=20, J=1, ACTIONONLY, FUNCTION=USER(1)\n"
)


def test_what_was_computed_until_a_routine_fails_is_kept(tmp_path):
    """Time, the routine's own line, the deck's line; results under their partial name, as those of a whole run."""
    (tmp_path / "table.py").write_text("def ends(t):\n    raise ValueError('table ends')\n")
    (tmp_path / "own.py").write_text(
        "from table import ends\n\ndef sfosub(call):\n    if call.time > 0.3 and not call.rehearsal:\n"
        "        ends(call.time)\n    return 2.0 * call.sysfnc('DX', 20, 1)\n"
    )
    deck = parse_deck(FALLING + "REQUEST/1, F2=DX(20,1)\nEND\n")
    routines = load_routines(tmp_path / "own.py")
    assert str(tmp_path) not in sys.path
    with pytest.raises(DeckError) as caught:
        run_deck(deck, end=1.0, steps=50, tol=1e-9, routines=routines, out=tmp_path / "run")
    (told,) = caught.value.diagnostics
    assert told.line == 8
    assert re.search(r"ValueError: table ends \(.*table\.py, line 2; at TIME = 0\.3\d*\)", told.message)
    assert sorted(p.name for p in tmp_path.glob("run*")) == [
        "run.msg", "run.partial.nc", "run.partial.req", "run.partial.res",
    ]  # fmt: skip
    kept = caught.value.result
    assert 0.2 < kept.t[-1] <= 0.3
    assert not kept.success
    whole = run_deck(deck, end=0.3, steps=15, tol=1e-9, routines=routines)
    np.testing.assert_allclose(kept.request(1), whole.request(1)[: kept.t.size], atol=1e-7)
    assert (tmp_path / "run.msg").read_text().count("table ends") == 1


def test_a_routine_that_fails_in_rehearsal_says_so():
    def sfosub(call):
        raise ValueError("no table")

    line, told = message("SFORCE/1, TRANSLATIONAL, I=20, J=1, ACTIONONLY, FUNCTION=USER(1)", {"sfosub": sfosub})
    assert line == 8
    assert "in a rehearsal, where numbers have no meaning: see call.rehearsal" in told


def test_modules_beside_routines_are_those_of_their_folder_and_of_today(tmp_path):
    """Two folders have modules of one name; one is edited."""

    def loaded(name):
        return load_routines(tmp_path / name / "own.py")["sfosub"](None)

    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "own.py").write_text("from sizes import SIZE\n\n\ndef sfosub(call):\n    return SIZE\n")
        (tmp_path / name / "sizes.py").write_text(f"SIZE = {name!r}\n")
    assert [loaded(name) for name in ("one", "other", "one")] == ["one", "other", "one"]
    (tmp_path / "one" / "sizes.py").write_text("SIZE = 'larger'\n")
    assert [loaded(name) for name in ("one", "other")] == ["larger", "other"]
