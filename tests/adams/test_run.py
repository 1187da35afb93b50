"""Decks run against ADAMS's own tables and against independently written equations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gearmbs.adams import DeckError, parse_deck, parse_script
from gearmbs.adams.runner import run_deck
from tests.says import says

from .decks import PENDULUM

G = 9.80665


def run(text: str, end: float, steps: int = 50, **options):
    result = run_deck(parse_deck(text), end=end, steps=steps, **options)
    assert result.success, result.messages
    return result


def model(body: str, units: str = "MKS") -> str:
    return f"test\nUNITS/SYSTEM={units}\nPART/1,GROUND\nMARKER/10,PART=1\n{body}\nEND\n"


def test_pendulum_against_adams_table():
    """MSC ADAMS's printed table of Project Chrono's Revolute_Case01 (BSD-3) at 0.5 and 1 s."""
    result = run(PENDULUM, 1.0, 10)
    # row: e0, e2, Fx, Fz
    table = {5: (0.6764620, 0.2059100, 13.27970, -9.149250), 10: (0.3720920, 0.6012880, -11.46120, -23.22730)}
    for row, (e0, e2, fx, fz) in table.items():
        quaternion = result.request(4)[row, [1, 2, 3, 5]]
        np.testing.assert_allclose(quaternion, [e0, -e0, e2, e2], atol=1e-6)
        np.testing.assert_allclose(result.request(5)[row, [1, 3]], [fx, fz], atol=1e-3)


def test_pendulum_against_its_equation():
    # (I + m L^2) a'' = m g L cos a, a from the horizontal: I = 0.1, m = 1, L = 2
    result = run(PENDULUM, 5.0, 100)
    exact = solve_ivp(
        lambda t, y: [y[1], G * 2 * np.cos(y[0]) / 4.1], (0, 5), [0, 0], t_eval=result.t, method="DOP853",
        rtol=1e-12, atol=1e-12,
    ).y  # fmt: skip
    np.testing.assert_allclose(result.request(1)[:, 1], 2 * np.cos(exact[0]), atol=1e-6)
    np.testing.assert_allclose(result.request(1)[:, 3], -2 * np.sin(exact[0]), atol=1e-6)
    np.testing.assert_allclose(result.request(2)[:, 6], exact[1], atol=1e-6)
    alpha = G * 2 * np.cos(exact[0]) / 4.1
    acceleration = 2 * np.sin(exact[0]) * exact[1] ** 2 - 2 * np.cos(exact[0]) * alpha
    np.testing.assert_allclose(result.request(3)[:, 3], acceleration, atol=1e-5)
    assert np.abs(result.request(2)[:, 2]).max() < 1e-12


def test_distance_constraint_reports_its_force_on_i():
    """ADAMS's table of Distance_Case01 at 0.5 and 1 s: a GCON DM - 2, force on the ground's marker."""
    text = model(
        "PART/2,MASS=1,CM=20,IP=0.04,0.1,0.1\nMARKER/20,PART=2,QP=0,2,0\nACCGRAV/KGRAV=-9.80665\n"
        "GCON/1,I=10,FUNCTION=DM(20,10)-2\nREQUEST/1,F,I=10,J=20,RM=10\nREQUEST/2,F,I=20,J=10,RM=10"
    )
    result = run(text, 1.0, 10)
    np.testing.assert_allclose(result.request(1)[5, 1:4], [0, 13.76685, -9.527573], atol=1e-3)
    np.testing.assert_allclose(result.request(1)[10, 1:4], [0, -12.35703, -22.69017], atol=1e-3)
    np.testing.assert_allclose(result.request(2), result.request(1) * [1, -1, -1, -1, 1, -1, -1, -1], atol=1e-12)


def test_spring_from_an_expression_against_its_equation():
    """A point mass on SFORCE -100 (DM - 2) - VR, the spring of Project Chrono's TransSpring deck."""
    text = model(
        "PART/2,MASS=1,CM=20,IP=0.04,0.1,0.1\nMARKER/20,PART=2,QP=0,2,0\nACCGRAV/KGRAV=-9.80665\n"
        "SFORCE/1,TRANSLATIONAL,I=10,J=20,FUNCTION=-100.0*(dm(10,20)-2.0)\n,-1.0*vr(10,20)\n,+0.0\n"
        "REQUEST/1,D,I=20,J=10\nREQUEST/2,F2=FX(10,20)\\F3=FY(10,20)\\F4=FZ(10,20)\n"
        "VARIABLE/1,FUNCTION=(DX(10,20)*FX(10,20)+\n,DY(10,20)*FY(10,20)+\n,DZ(10,20)*FZ(10,20))/\n,DM(10,20)\n"
        "REQUEST/3,F1=VARVAL(1)"
    )
    result = run(text, 5.0, 100)

    def force(y):
        r = np.hypot(y[0], y[1])
        rate = (y[0] * y[2] + y[1] * y[3]) / r
        return (-100 * (r - 2) - rate), r

    def equation(t, y):
        f, r = force(y)
        return [y[2], y[3], f * y[0] / r, f * y[1] / r - G]

    exact = solve_ivp(equation, (0, 5), [2, 0, 0, 0], t_eval=result.t, method="DOP853", rtol=1e-12, atol=1e-12).y
    np.testing.assert_allclose(result.request(1)[:, 2], exact[0], atol=1e-6)
    np.testing.assert_allclose(result.request(1)[:, 3], exact[1], atol=1e-6)
    f, r = force(exact)
    np.testing.assert_allclose(result.request(2)[:, 2], -f * exact[0] / r, atol=1e-4)
    np.testing.assert_allclose(result.request(3)[:, 0], f, atol=1e-4)


def test_vertical_spring_against_adams_table():
    """ADAMS's table TransSpring_Case01 solves m z'' = -m g - 10 z - 0.5 z'; its last row, at 4.99 s."""
    text = model(
        "PART/2,MASS=1,CM=20,IP=0.04,0.1,0.1\nMARKER/20,PART=2\nACCGRAV/KGRAV=-9.80665\n"
        "SFORCE/1,TRANSLATIONAL,ACTIONONLY,I=20,J=10,FUNCTION=-10*DZ(20,10)-0.5*VZ(20,10)\nREQUEST/1,D,I=20,J=10\n"
        "REQUEST/2,V,I=20,J=10\nREQUEST/3,A,I=20,J=10\nREQUEST/4,F,I=20"
    )
    result = run(text, 4.99, 499)
    row = [result.request(k)[499, 3] for k in (1, 2, 3, 4)]
    np.testing.assert_allclose(row, [-1.262760, 2.002480e-02, 2.810970, 1.261760e01], atol=5e-6, rtol=5e-6)


@pytest.mark.parametrize("units", ["MKS", "CGS", "IPS", "FPS"])
def test_units_do_not_change_the_motion(units):
    """The same spring pendulum written in four systems of units; IPS and FPS need the consistency factor."""
    length = {"MKS": 1.0, "CGS": 0.01, "IPS": 0.0254, "FPS": 0.3048}[units]
    mass = {"MKS": 1.0, "CGS": 1e-3}.get(units, 0.45359237)
    force = {"MKS": 1.0, "CGS": 1e-5}.get(units, 4.4482216152605)
    k, c, inertia = 50 * length / force, 2 * length / force, 0.01 / mass / length**2
    text = model(
        f"PART/2,MASS={1 / mass!r},CM=20,IP={inertia!r},{inertia!r},{inertia!r},VX={1 / length!r}\n"
        f"MARKER/20,PART=2,QP=0,{1 / length!r},0\nMARKER/21,PART=2,QP=0,{0.9 / length!r},0\n"
        f"ACCGRAV/JGRAV={-G / length!r}\n"
        f"SPRINGDAMPER/1,TRANSLATION,I=21,J=10,K={k!r},C={c!r},LENGTH={0.5 / length!r}\n"
        "REQUEST/1,D,I=20,J=10\nREQUEST/2,F,I=21,J=10",
        units,
    )
    result = run(text, 1.0, 10)
    reference = run(
        model(
            "PART/2,MASS=1,CM=20,IP=0.01,0.01,0.01,VX=1\nMARKER/20,PART=2,QP=0,1,0\nMARKER/21,PART=2,QP=0,0.9,0\n"
            "ACCGRAV/JGRAV=-9.80665\nSPRINGDAMPER/1,TRANSLATION,I=21,J=10,K=50,C=2,LENGTH=0.5\n"
            "REQUEST/1,D,I=20,J=10\nREQUEST/2,F,I=21,J=10"
        ),
        1.0,
        10,
    )
    np.testing.assert_allclose(length * result.request(1)[:, 1:4], reference.request(1)[:, 1:4], atol=1e-6)
    np.testing.assert_allclose(force * result.request(2)[:, 1:4], reference.request(2)[:, 1:4], atol=1e-4)


def test_two_simulations_with_a_released_joint():
    """The pendulum runs, then its pin is deactivated and it flies: constant acceleration and spin."""
    script = parse_script(
        "\n\nSIMULATE/DYNAMICS, END=1, DTOUT=0.5\nDEACTIVATE/JOINT, ID=1\nSIM/DYN, DURATION=1, STEPS=4\n"
        "ACCGRAV/KGRAV=0\nSIM/DYN, DURATION=1, STEPS=2\nSTOP\n"
    )
    deck = parse_deck(PENDULUM.replace("F2=JOINT(1,0,2,0)", "F2=DX(201)").replace("F3=JOINT(1,0,3,0)", "F3=DX(201)")
                      .replace("F4=JOINT(1,0,4,0)\n, \\", "F4=DX(201)\\").replace("JOINT(1,0,6,0)", "DX(201)")
                      .replace("JOINT(1,0,7,0)", "DX(201)").replace("JOINT(1,0,8,0)", "DX(201)"))  # fmt: skip
    result = run_deck(deck, script)
    assert result.t.tolist() == [0.0, 0.5, 1.0, 1.0, 1.25, 1.5, 1.75, 2.0, 2.0, 2.5, 3.0]
    x, v, w = result.request(1)[:, 1:4], result.request(2)[:, 1:4], result.request(2)[:, 5:8]
    np.testing.assert_allclose(x[3], x[2], atol=1e-9)
    np.testing.assert_allclose(v[3], v[2], atol=1e-9)
    np.testing.assert_allclose(x[7], x[3] + v[3] + [0, 0, -G / 2], atol=1e-6)
    np.testing.assert_allclose(w[10], w[2], atol=1e-6)
    np.testing.assert_allclose(x[10], x[8] + v[8], atol=1e-6)


def test_messages_name_what_a_modeller_can_mend():
    with pytest.raises(DeckError, match="TIRE/1 is not supported"):
        run(model("PART/2,MASS=1,CM=20,IP=1,1,1\nMARKER/20,PART=2\nTIRE/1,I=20,J=10"), 1.0)
    # two pins at different places of one body
    body = "PART/2,MASS=1,CM=20,IP=1,1,1\nMARKER/20,PART=2\nMARKER/21,PART=2,QP=1,0,0\nMARKER/11,PART=1,QP=5,0,0\n"
    with pytest.raises(DeckError, match=r"JOINT_1|JOINT_2"):
        run(model(body + "JOINT/1,SPHERICAL,I=20,J=10\nJOINT/2,SPHERICAL,I=21,J=11"), 1.0)
    with pytest.raises(DeckError, match="there is no VARIABLE 7"):
        run(model(body + "SFORCE/1,TRANS,ACTION,I=20,J=10,FUNCTION=VARVAL(7)"), 1.0)
    with pytest.raises(DeckError, match="no end time"):
        run_deck(parse_deck(PENDULUM))
    with pytest.raises(DeckError, match=says("END", "0.5", "1.0")):
        run_deck(parse_deck(PENDULUM), parse_script("m\np\nsim/dyn,end=1,steps=2\nsim/dyn,end=0.5,steps=2"))
    with pytest.raises(DeckError, match=says("needs zero degrees")):
        run_deck(parse_deck(PENDULUM), parse_script("m\np\nsim/kin,end=1,steps=2"))


def test_redundant_four_bar_runs_and_names_them():
    """A planar four-bar with four revolutes has three redundant rows and one degree of freedom."""
    bars = [((0, 0), (0, 1)), ((0, 1), (2, 1)), ((2, 1), (2, 0))]
    lines = ["MARKER/11,PART=1,QP=2,0,0"]
    for k, (a, b) in enumerate(bars, 2):
        c = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)
        lines.append(f"PART/{k},MASS=1,CM={k}0,IP=.1,.1,.1")
        lines.append(f"MARKER/{k}0,PART={k},QP={c[0]},{c[1]},0\nMARKER/{k}1,PART={k},QP={a[0]},{a[1]},0")
        lines.append(f"MARKER/{k}2,PART={k},QP={b[0]},{b[1]},0")
    for k, (i, j) in enumerate(((21, 10), (31, 22), (41, 32), (42, 11)), 1):
        lines.append(f"JOINT/{k},REVOLUTE,I={i},J={j}")
    lines.append("ACCGRAV/JGRAV=-9.80665\nREQUEST/1,D,I=20,J=10\nREQUEST/2,V,I=30,J=10")
    result = run(model("\n".join(lines)), 1.0, 20)
    report = result.segments[0].solution.system.report
    assert report.degrees_of_freedom == 1
    assert len(report.redundant) == 3
    from gearmbs.adams.results.result import message_text

    text = message_text(result)
    assert "Degree-of-freedom analysis identified redundant constraints in the model:" in text
    assert text.count("deactivating constraint equation") == 3
    assert np.abs(result.request(1)[:, 3]).max() < 1e-9


def test_parts_that_cannot_be_built_are_errors_with_their_line():
    """A marker of such a part, and initial conditions that cannot be met, do not end in a traceback."""
    body = "PART/2,MASS=1,CM=20,IP=-1,1,1\nMARKER/20,PART=2\n"
    with pytest.raises(DeckError, match=r":5: error: PART/2: .*principal moments") as caught:
        parse_deck(model(body), "deck.adm").to_mechanism()
    assert len(caught.value.diagnostics) == 1
    body = (
        "PART/2,MASS=1,CM=20,IP=1,1,1\nMARKER/20,PART=2\nJOINT/1,REVOLUTE,I=20,J=10,IC=1,0\nJOINT/2,FIXED,I=20,J=10\n"
    )
    with pytest.raises(DeckError, match=says("7", "JOINT/1")):
        parse_deck(model(body), "deck.adm").to_mechanism()


def test_inertias_beyond_all_rounding_are_an_error_of_the_deck():
    text = """x
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
PART/2, MASS=2, CM=20, IP=4E32,1,1
MARKER/20, PART=2
MARKER/21, PART=2, QP=1,0,0
PART/3, MASS=1, CM=30, IP=1,1,1, QG=1,0,0
MARKER/30, PART=3
JOINT/2, CYLINDRICAL, I=21, J=30
ACCGRAV/KGRAV=-9.8
END
"""
    deck = parse_deck(text)
    with pytest.raises(DeckError, match=says("moments", "singular to rounding")):
        run_deck(deck, parse_script("a\nb\nSIMULATE/DYNAMICS, END=0.1, STEPS=5\n"))
    remark = next(d for d in deck.diagnostics if "principal moments" in d.message)
    assert (remark.severity, remark.line) == ("warning", 5)


def test_turns_are_counted_from_the_ground_on():
    """AZ(0, 21) of a pin that turns on: the angle of the ground in the pin's frame, over two analyses."""
    text = """turning
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
PART/2, MASS=2, CM=20, IP=1,1,1, WZ=20
MARKER/20, PART=2
JOINT/1, REVOLUTE, I=20, J=1
REQUEST/1, F2=AZ(0,20)\\F3=AZ(20)
SFORCE/1, ROTATIONAL, ACTIONONLY, I=20, J=1, FUNCTION=0*AZ(0,20)
END
"""
    script = parse_script("a\nb\nSIM/DYN, END=0.5, STEPS=10\nSIM/DYN, END=1, STEPS=10\n")
    result = run_deck(parse_deck(text), script)
    assert result.request(1)[:, 1] == pytest.approx(-20 * result.t, abs=1e-6)
    assert result.request(1)[:, 2] == pytest.approx(20 * result.t, abs=1e-6)


CRANK = (
    "PART/2,MASS=1,CM=20,IP=1,1,1,QG=.5,0,0\nMARKER/20,PART=2\nMARKER/21,PART=2,QP=-.5,0,0\nMARKER/22,PART=2,QP=.5,0,0\n"
    "MARKER/11,PART=1,QP=1,0,0\nJOINT/1,REVOLUTE,I=21,J=10"
)


def test_parts_that_their_joints_lock_are_named():
    result = run(model(f"{CRANK}\nJOINT/2,REVOLUTE,I=22,J=11\nACCGRAV/JGRAV=-9.81"), 0.1, 2)
    assert [m for m in result.messages if "Body 'PART_2' cannot move: 'JOINT_1' and 'JOINT_2' together" in m]


@pytest.mark.parametrize("direction", ["TRANSLATIONAL", "ROTATIONAL"])
def test_motions_are_along_what_their_joint_allows(direction):
    deck = parse_deck(model(f"{CRANK}\nMOTION/1,JOINT=1,{direction},FUNCTION=TIME"))
    if direction == "ROTATIONAL":
        assert run_deck(deck, end=0.1, steps=2).success
        return
    with pytest.raises(DeckError, match=says("TRANSLATIONAL", "JOINT/1", "write ROTATIONAL")):
        run_deck(deck, end=0.1, steps=2)
