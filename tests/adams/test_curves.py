"""CURVE, PTCV, CVCV: an eccentric circle as a cam against its closed form; curves in expressions and solids."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.data import matrix_values
from gearmbs.mechanism import ModelError
from gearmbs.mechanism.parts.curves import Curve
from tests.says import says

RADIUS, OFF, ROLLER, SPEED, MASS, G = 50.0, 20.0, 10.0, 10.0, 0.5, 9810.0
PHI = np.linspace(0.0, 2.0 * np.pi, 73)


def circle(radius, off=0.0):
    return np.column_stack([off + radius * np.cos(PHI), radius * np.sin(PHI), 0.0 * PHI])


def matrix(number, points):
    rows = "\n".join(", " + ", ".join(f"{v:.17g}" for v in row) for row in points)
    return f"MATRIX/{number}, FULL=RORDER, ROWS={len(points)}, COLUMNS=3, VALUES=\n{rows}"


DECK = """cam
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
MARKER/11, PART=1, REULER=0D,90D,0D
PART/2, MASS=1, CM=20, IP=1000,1000,1000
MARKER/20, PART=2
PART/3, MASS={mass}, CM=30, IP=100,100,100, QG=0,{height},0
MARKER/30, PART=3
MARKER/31, PART=3, REULER=0D,90D,0D
MARKER/32, PART=2, FLOATING
MARKER/33, PART=3, FLOATING
JOINT/1, REVOLUTE, I=20, J=10
JOINT/2, TRANSLATIONAL, I=31, J=11
MOTION/1, JOINT=1, ROTATION, FUNCTION={speed}*TIME
{matrices}
{touch}
ACCGRAV/JGRAV=-{g}
REQUEST/1, F2=DY(30)\\F3=VY(30)\\F4=MOTION(1,0,8,0)
END
"""


def deck(touch, height, matrices):
    return parse_deck(DECK.format(touch=touch, height=height, matrices=matrices, mass=MASS, speed=SPEED, g=G))


def lift(angle, reach):
    """Height of the follower's middle, and its first two derivatives by the angle."""
    s, c = np.sin(angle), np.cos(angle)
    root = np.sqrt(reach**2 - (OFF * c) ** 2)
    first = OFF * c + OFF**2 * s * c / root
    second = -OFF * s + OFF**2 * (c * c - s * s) / root - (OFF**2 * s * c) ** 2 / root**3
    return OFF * s + root, first, second


@pytest.mark.slow
def test_a_point_follows_a_cam():
    height = np.sqrt(RADIUS**2 - OFF**2) + 0.1
    cam = "CURVE/1, CLOSED, CURVE_POINTS, MATRIX=1\nPTCV/1, I=30, CURVE=1, RM=20, JFLOAT=32"
    asked = "\nREQUEST/2, F2=PTCV(1,0,2,0)\\F3=PTCV(1,0,3,0)\\F4=PTCV(1,1,3,0)"
    result = run_deck(deck(cam + asked, height, matrix(1, circle(RADIUS, OFF))), end=1.5, steps=300)
    assert result.success
    with pytest.raises(DeckError, match=says("PTCV_1", "force", "REQUEST")):
        run_deck(deck(cam + "\nSFORCE/7, ROTATIONAL, I=20, J=10, FUNCTION=PTCV(1,0,3,0)", height,
                      matrix(1, circle(RADIUS, OFF))), end=0.1, steps=1)  # fmt: skip
    y, first, second = lift(SPEED * result.t, RADIUS)
    assert np.abs(result.request(1)[:, 1] - y).max() < 2e-5
    # the slope of a spline through points every 5 degrees: 2e-5 of it
    assert np.abs(result.request(1)[:, 2] - SPEED * first).max() < 1e-2
    # what the drive delivers is what the follower takes up; torque in N mm
    torque = 1e-3 * MASS * (SPEED**2 * second + G) * first
    assert np.abs(np.abs(result.request(1)[:, 3]) - np.abs(torque)).max() < 1e-3 * np.abs(torque).max()
    # the force on the follower: its vertical part carries it, along the normal of the circle
    force = result.force("ptcv", 1)
    np.testing.assert_allclose(result.request(2)[:, 1:4], force[:, [0, 1, 1]] * [1, 1, -1], atol=1e-12)
    assert np.abs(force[:, 1] - 1e-3 * MASS * (SPEED**2 * second + G)).max() < 1e-2
    centre = OFF * np.column_stack([np.cos(SPEED * result.t), np.sin(SPEED * result.t)])
    normal = np.column_stack([0 * y, y]) - centre
    assert np.abs(force[:, 0] * normal[:, 1] - force[:, 1] * normal[:, 0]).max() < 1e-3 * RADIUS * np.abs(force).max()


@pytest.mark.slow
def test_a_roller_follows_a_cam():
    height = np.sqrt((RADIUS + ROLLER) ** 2 - OFF**2) + 0.1
    matrices = matrix(1, circle(RADIUS, OFF)) + "\n" + matrix(2, circle(ROLLER))
    cam = (
        "CURVE/1, CLOSED, MATRIX=1\nCURVE/2, CLOSED, MATRIX=2\n"
        "CVCV/1, ICURVE=2, IRM=30, JCURVE=1, JRM=20, IFLOAT=33, JFLOAT=32"
    )
    result = run_deck(deck(cam, height, matrices), end=0.8, steps=100)
    y, _, second = lift(SPEED * result.t, RADIUS + ROLLER)
    assert np.abs(result.request(1)[:, 1] - y).max() < 2e-5
    assert np.abs(result.force("cvcv", 1)[:, 1] - 1e-3 * MASS * (SPEED**2 * second + G)).max() < 2e-2


@pytest.mark.slow
def test_analyses_go_on_along_the_curve_and_it_may_be_left():
    height = np.sqrt(RADIUS**2 - OFF**2)
    cam = "CURVE/1, CLOSED, MATRIX=1\nPTCV/1, I=30, CURVE=1, RM=20, JFLOAT=32"
    script = parse_script(
        "m\no\nSIMULATE/DYNAMICS, END=0.2, STEPS=20\nSIMULATE/DYNAMICS, END=0.4, STEPS=20\n"
        "DEACTIVATE/PTCV, ID=1\nSIMULATE/DYNAMICS, END=0.42, STEPS=2\n"
    )
    result = run_deck(deck(cam, height, matrix(1, circle(RADIUS, OFF))), script)
    t, y = result.t, result.request(1)[:, 1]
    assert np.abs(y[:42] - lift(SPEED * t[:42], RADIUS)[0]).max() < 2e-5
    fall = lift(SPEED * 0.4, RADIUS)
    assert y[-1] == pytest.approx(fall[0] + SPEED * fall[1] * 0.02 - 0.5 * G * 0.02**2, abs=1e-4)


def test_curves_in_expressions_and_solids():
    x = np.linspace(0.0, 4.0, 9)
    line = np.column_stack([x, x**3 / 64, 0 * x])
    square = np.array([(0, 0, 0), (40, 0, 0), (40, 40, 0), (0, 40, 0), (0, 0, 0)], dtype=float)
    text = DECK.replace("REQUEST/1, F2=DY(30)", "REQUEST/1, F2=CURVE(2*TIME-1,0,1,1)").replace(
        "\\F4=MOTION(1,0,8,0)", "\\F4=CURVE(1,1,1,1)"
    )
    solids = (
        "GRAPHICS/1, EXTRUSION, RM=30, CID=2, LENGTH=20\nGRAPHICS/2, PLANE, RM=11\n"
        "CONTACT/1, IGEOM=1, JGEOM=2, IMPACT, STIFFNESS=1E4, EXPONENT=1.5, DAMPING=10, DMAX=0.1"
    )
    touch = f"CURVE/1, OPEN, MATRIX=1\nCURVE/2, CLOSED, CONTROL_POINTS, ORDER=2, MATRIX=2\n{solids}"
    matrices = matrix(1, line) + "\n" + matrix(2, square)
    parsed = parse_deck(text.format(touch=touch, height=100.0, matrices=matrices, mass=MASS, speed=SPEED, g=G))
    values = run_deck(parsed, end=1.0, steps=10).request(1)
    chords = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))]
    expected = np.interp(chords[-1] * np.linspace(0, 1, 11), chords, x)
    assert np.abs(values[:, 1] - expected).max() < 0.02
    assert values[-1, 1] == pytest.approx(4.0)
    assert values[-1, 3] == pytest.approx(chords[-1] / 2 * 0.8, rel=0.05)


def test_matrices():
    parsed = parse_deck(
        "m\nUNITS/SYSTEM=MKS\nPART/1,GROUND\nMATRIX/1,FULL=CORDER,ROWS=2,COLUMNS=3,VALUES=1,4,2,5,3,6\n"
        "MATRIX/2,SPARSE,ROWS=2,COLUMNS=2,VALUES=1,2,7,2,1,8\nSTRING/1,STRING=hello\nEND\n"
    )
    assert matrix_values(parsed.of(st.Matrix)[1]).tolist() == [[1, 2, 3], [4, 5, 6]]
    assert matrix_values(parsed.of(st.Matrix)[2]).tolist() == [[0, 7], [8, 0]]
    assert parsed.of(st.String)[1].text == "hello"


def test_a_list_of_variables_is_read_by_place():
    text = DECK.replace("F2=DY(30)", "F2=ARYVAL(1,2)").format(
        touch="VARIABLE/1, FUNCTION=3\nVARIABLE/2, FUNCTION=4*TIME\nARRAY/1, U, SIZE=2, VARIABLES=1,2\n"
        "ARRAY/2, IC, NUMBERS=1,2",
        height=0.0, matrices="", mass=MASS, speed=SPEED, g=G,
    )  # fmt: skip
    assert run_deck(parse_deck(text), end=1.0, steps=2).request(1)[-1, 1] == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("touch", "message"),
    [
        ("PTCV/1, I=30, CURVE=1, RM=20", "there is no CURVE/1"),
        ("CURVE/1, CLOSED, MATRIX=7\nPTCV/1, I=30, CURVE=1, RM=20", "there is no MATRIX/7"),
        ("CURVE/1, CLOSED, MATRIX=1\nPTCV/1, I=30, CURVE=1", "RM is missing"),
        ("CURVE/1, CLOSED, MATRIX=1\nPTCV/1, I=30, CURVE=1, RM=31", says("PTCV/1", "'PTCV_1'", "both markers")),
        ("MATRIX/2, FULL=RORDER, ROWS=2, COLUMNS=2, VALUES=1,2,3", says("values", "3")),
        ("CURVE/1, CLOSED, FUNCTION=USER(1)\nPTCV/1, I=30, CURVE=1, RM=20", says("CURSUB")),
    ],
)
def test_mistakes_are_named(touch, message):
    with pytest.raises(DeckError, match=message):
        run_deck(deck(touch, 0.0, matrix(1, circle(RADIUS))), end=0.1, steps=1)


def test_curves_of_points():
    closed = Curve(circle(1.0), True)
    s = closed.spline()
    for order in (0, 1, 2):
        assert s(0.0, order) == pytest.approx(s(closed.length, order), abs=1e-8)
    angle = 1.2345
    nearest = s(closed.nearest(np.array([3 * np.cos(angle), 3 * np.sin(angle), 0.0])))
    # the normal of the spline is off by its slope's error, of fourth order in the steps of 5 degrees
    assert nearest == pytest.approx([np.cos(angle), np.sin(angle), 0.0], abs=1e-5)
    for points, message in (
        ([(0, 0)], "rows of x, y and z"),
        ([(0, 0, 0), (1, 0, 0)], says("curve", "2 points", "four")),
        ([(0, 0, 0), (1, 0, 0), (1, 0, 0), (2, 0, 0)], "are the same"),
    ):
        with pytest.raises(ModelError, match=message):
            Curve(points)


@pytest.mark.slow
def test_a_bead_on_a_parabola():
    """An open curve that stands: against x'' (1 + f'^2) = -f' (g + f'' x'^2)."""
    x, bend = np.linspace(-300.0, 300.0, 121), 2.0 / 200.0
    points = np.column_stack([x, bend / 2.0 * x**2, 0.0 * x])
    text = BEAD.format(
        markers="PART/2, MASS=1, CM=20, IP=1000,1000,1000, QG=150,112.5,0\nMARKER/12, PART=1, FLOATING",
        matrix=matrix(1, points), guide=10, more=f"ACCGRAV/JGRAV=-{G}\nREQUEST/1, F2=DX(20)\\F3=DY(20)",
    )  # fmt: skip
    result = run_deck(parse_deck(text), end=1.0, steps=100)

    def rates(_, s):
        slope = bend * s[0]
        return [s[1], -slope * (G + bend * s[1] ** 2) / (1.0 + slope**2)]

    exact = solve_ivp(rates, (0.0, 1.0), [150.0, 0.0], t_eval=result.t, rtol=1e-11, atol=1e-9).y
    np.testing.assert_allclose(result.request(1)[:, 1], exact[0], atol=5e-4)
    np.testing.assert_allclose(result.request(1)[:, 2], bend / 2.0 * exact[0] ** 2, atol=5e-4)
    speeding = np.array([rates(0.0, s)[1] for s in exact.T])
    normal = 1e-3 * (G + bend * exact[0] * speeding + bend * exact[1] ** 2)
    assert np.abs(result.force("ptcv", 1)[:, 1] - normal).max() < 1e-3 * normal.max()


@pytest.mark.slow
def test_a_bead_on_a_turning_arm():
    """A straight curve on a part that turns by a motion: r = r0 cosh(w t), and the torque 2 m w r r' of the drive."""
    points = np.column_stack([np.linspace(0.0, 2000.0, 11), np.zeros(11), np.zeros(11)])
    text = BEAD.format(
        markers="PART/2, MASS=1, CM=20, IP=1000,1000,1000, QG=100,0,0, VY=500\nMARKER/12, PART=3, FLOATING",
        matrix=matrix(1, points), guide=30, more="REQUEST/1, F2=DM(20,10)\\F3=MOTION(1,0,8,0)",
    )  # fmt: skip
    result = run_deck(parse_deck(text), end=0.5, steps=50)
    far = 100.0 * np.cosh(5.0 * result.t)
    np.testing.assert_allclose(result.request(1)[:, 1], far, rtol=1e-6)
    torque = 1e-3 * 2.0 * 5.0 * far * 500.0 * np.sinh(5.0 * result.t)
    np.testing.assert_allclose(np.abs(result.request(1)[:, 2]), torque, atol=1e-5 * torque.max())


BEAD = """bead
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
MARKER/11, PART=1
PART/3, MASS=1, CM=30, IP=1000,1000,1000
MARKER/30, PART=3
JOINT/1, REVOLUTE, I=30, J=10
MOTION/1, JOINT=1, ROTATION, FUNCTION=5*TIME
{markers}
MARKER/20, PART=2
JPRIM/1, ORIENTATION, I=20, J=11
{matrix}
CURVE/1, OPEN, CURVE_POINTS, MATRIX=1
PTCV/1, I=20, CURVE=1, RM={guide}, JFLOAT=12
{more}
END
"""
