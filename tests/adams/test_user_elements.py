"""Routines of the user in GSE, COUPLER, FIELD and CURVE against the same equations in closed form or as statements."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit

from gearmbs.adams import DeckError, load_routines, parse_deck, parse_script, run_deck
from gearmbs.adams.parse.statements import String
from tests.says import says

HEAD = "routines\nUNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND\nPART/1, GROUND\nMARKER/1, PART=1\n"
CART = """MARKER/11, PART=1, ZP=1,0,0
PART/2, MASS=2, CM=20, IP=1,1,1, QG=0.1,0,0
MARKER/20, PART=2
MARKER/21, PART=2, ZP=1.1,0,0
JOINT/1, TRANSLATIONAL, I=21, J=11
"""
LOOP = """VARIABLE/1, FUNCTION=DX(20,1)
VARIABLE/2, FUNCTION=VX(20,1)
ARRAY/1, U, VARIABLES=1,2
ARRAY/2, X, SIZE=2
ARRAY/3, Y, SIZE=1
ARRAY/4, IC, NUMBERS=0.3,-0.2
SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=-40*DX(20,1)+ARYVAL(3,1)
REQUEST/1, F2=DX(20,1)\\F3=ARYVAL(2,1)\\F4=ARYVAL(2,2)\\F6=ARYVAL(3,1)
"""
GSE = "GSE/1, NS=2, NO=1, X=2, U=1, Y=3, IC=4, FUNCTION=USER(3, 5)\n"
A = np.array([[0.0, 1.0], [-5.0, -3.0]])
B = np.array([[0.0, 0.0], [2.0, -1.0]])
C = np.array([[4.0, 0.5]])
LSE = """MATRIX/1, FULL=RORDER, ROWS=2, COLUMNS=2, VALUES=0,1,-5,-3
MATRIX/2, FULL=RORDER, ROWS=2, COLUMNS=2, VALUES=0,0,2,-1
MATRIX/3, FULL=RORDER, ROWS=1, COLUMNS=2, VALUES=4,0.5
LSE/1, X=2, U=1, Y=3, IC=4, A=1, B=2, C=3
"""
SCRIPT = "m\no\nSIMULATE/DYNAMICS, END=1, STEPS=40\n"


def run(text, routines=None, script=SCRIPT, **more):
    return run_deck(parse_deck(HEAD + text + "END\n"), parse_script(script), tol=1e-10, routines=routines, **more)


def deriv(call):
    damping, stiffness = call.parameters
    return call.x[1], -stiffness * call.x[0] - damping * call.x[1] + 2 * call.u[0] - call.u[1]


def output(call):
    return 4 * call.x[0] + 0.5 * call.x[1]


@njit
def compiled_deriv(time, x, xd, u, parameters):
    return np.array([x[1], -parameters[1] * x[0] - parameters[0] * x[1] + 2.0 * u[0] - u[1]])


@pytest.mark.slow
@pytest.mark.parametrize(
    "routines",
    [
        {"GSE/1": {"deriv": deriv, "output": output}},
        {"gse_deriv": compiled_deriv, "gse_output": output},
    ],
)
def test_state_equations_are_those_of_a_linear_system(routines):
    found, expected = run(CART + LOOP + GSE, routines), run(CART + LOOP + LSE)
    assert found.success
    np.testing.assert_allclose(found.request(1), expected.request(1), atol=1e-8)


@pytest.mark.slow
def test_names_of_interfaces_are_looked_for():
    text = CART + LOOP + GSE.replace("USER(3, 5)", "USER(3, 5)\\INTERFACE=lib::mine, lib::shown, lib::none, lib::samp")
    found, expected = run(text, {"mine": deriv, "shown": output}), run(CART + LOOP + LSE)
    np.testing.assert_allclose(found.request(1), expected.request(1), atol=1e-8)


def test_states_settle_in_statics_unless_they_are_held():
    script = "m\no\nSIMULATE/STATICS\n"
    routines = {"gse_deriv": deriv, "gse_output": output}
    row = run(CART + LOOP + GSE, routines, script).request(1)[0]
    # x2 = 0, x1 = 2 q / 5, -40 q + 4 x1 = 0
    assert row[[1, 2, 3]] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    held = run(CART + LOOP + GSE.replace("IC=4", "IC=4, STATIC_HOLD"), routines, script).request(1)[0]
    force = 4 * 0.3 - 0.5 * 0.2
    assert held[[1, 2, 3, 5]] == pytest.approx([force / 40, 0.3, -0.2, force], abs=1e-9)


SAMPLED = """ARRAY/1, U, VARIABLES=1
ARRAY/3, Y, SIZE=1
ARRAY/5, X, SIZE=2
ARRAY/6, IC, NUMBERS=0.5,0
VARIABLE/1, FUNCTION=DX(20,1)
GSE/1, ND=2, NO=1, XD=5, U=1, Y=3, ICD=6, SAMPLE_PERIOD=0.05\\FUNCTION=USER(0)
SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=-40*DX(20,1)+ARYVAL(3,1)
REQUEST/1, F2=DX(20,1)\\F3=ARYVAL(5,1)\\F4=ARYVAL(5,2)\\F6=ARYVAL(3,1)\\F7=VX(20,1)
"""


def update(call):
    return 0.6 * call.xd[0] - 3.0 * call.u[0], call.xd[0]


def sampled_output(call):
    return 2.0 * call.xd[0] + call.xd[1]


@pytest.mark.slow
def test_a_discrete_controller_against_its_difference_equation():
    # between samples the force is constant: the cart's motion is known in closed form
    routines = {"gse_update": update, "gse_output": sampled_output}
    script = "m\no\nSIMULATE/DYNAMICS, END=0.375, STEPS=15\nSIMULATE/DYNAMICS, END=1, STEPS=25\n"
    result = run(CART + SAMPLED, routines, script)
    assert result.success
    natural, period = math.sqrt(40.0 / 2.0), 0.05
    q, v, xd = 0.1, 0.0, np.array([0.5, 0.0])
    exact = {}
    for n in range(21):
        rest = (2.0 * xd[0] + xd[1]) / 40.0
        exact[n] = q, xd, v
        following = np.array([0.6 * xd[0] - 3.0 * q, xd[0]])
        c, s = math.cos(natural * period), math.sin(natural * period)
        q, v = rest + (q - rest) * c + v / natural * s, -(q - rest) * natural * s + v * c
        xd = following
    rows = result.request(1)
    for n in range(1, 21):
        at = np.flatnonzero(np.isclose(result.t, n * period, atol=1e-9))
        assert rows[at[0], 1] == pytest.approx(exact[n][0], abs=1e-8)
        assert rows[at[0], 6] == pytest.approx(exact[n][2], abs=1e-7)
        if n < 20:
            # the row before a sample has the old states, the one after it the new ones
            assert rows[at[0], 2:4] == pytest.approx(exact[n - 1][1], abs=1e-8)
            assert rows[at[-1], 2:4] == pytest.approx(exact[n][1], abs=1e-8)


SHAFTS = """PART/2, MASS=1, CM=20, IP=1,1,2, WZ=0.7
MARKER/20, PART=2
PART/3, MASS=1, CM=30, IP=2,2,3, QG=1,0,0{spin}
MARKER/30, PART=3
MARKER/31, PART=1, QP=1,0,0
JOINT/1, REVOLUTE, I=20, J=1
JOINT/2, REVOLUTE, I=30, J=31
SFORCE/1, ROTATIONAL, I=20, J=1, ACTIONONLY, FUNCTION=3-AZ(20,1)
{coupler}
REQUEST/1, F2=AZ(20,1)\\F3=AZ(30,31)\\F4=WZ(30,31)
"""


def test_a_coupler_by_a_routine_is_that_of_its_scales():
    text = SHAFTS.replace("{spin}", ", WZ=1.4")
    linear = run(text.format(coupler="COUPLER/1, JOINTS=1,2, SCALES=2,-1"))
    routine = run(text.format(coupler="COUPLER/1, JOINTS=1,2, FUNCTION=USER(2)"),
                  {"cousub": lambda call: call.parameters[0] * call.q[0] - call.q[1]})  # fmt: skip
    np.testing.assert_allclose(routine.request(1), linear.request(1), atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("mixed", [False, True])
def test_a_coupler_that_is_not_linear(mixed):
    def separate(call):
        return math.sin(call.q[0]) - call.q[1]

    def together(call):
        return math.exp(0.3 * (math.sin(call.q[0]) - call.q[1])) - 1.0

    text = SHAFTS.replace("{spin}", ", WZ=0.7").format(coupler="COUPLER/1, JOINTS=1,2, FUNCTION=USER(1)")
    result = run(text, {"COUPLER/1": together if mixed else separate})
    assert result.success
    rows = result.request(1)
    assert rows[:, 2] == pytest.approx(np.sin(rows[:, 1]), abs=1e-8)
    # one degree of freedom: (2 + 3 cos^2) q'' - 3 sin cos q'^2 = 3 - q
    from scipy.integrate import solve_ivp

    def motion(t, y):
        s, c = math.sin(y[0]), math.cos(y[0])
        return y[1], (3.0 - y[0] + 3.0 * s * c * y[1] ** 2) / (2.0 + 3.0 * c * c)

    exact = solve_ivp(motion, (0.0, 1.0), (0.0, 0.7), t_eval=result.t, rtol=1e-11, atol=1e-12)
    assert rows[:, 1] == pytest.approx(exact.y[0], abs=2e-7)


@pytest.mark.slow
def test_a_coupler_of_three_mixed_displacements():
    """A slide whose place is the product of two angles, one of which turns freely, one is driven by a torque."""
    text = SHAFTS.replace("{spin}", ", WZ=0.5").format(coupler="COUPLER/1, JOINTS=1,2,3, FUNCTION=USER(0.4)")
    text += (
        "PART/4, MASS=1.5, CM=40, IP=1,1,1\nMARKER/40, PART=4\nJOINT/3, TRANSLATIONAL, I=40, J=1\n"
        "REQUEST/2, F2=DZ(40,1)\\F3=VZ(40,1)\n"
    )
    found = run(text, {"cousub": lambda call: call.parameters[0] * call.q[0] * call.q[1] - call.q[2]})
    assert found.success
    from scipy.integrate import solve_ivp

    def motion(t, y):
        # z = k a b: M (a'', b'') + 2 m k^2 a' b' (a b) (1/a, 1/b) = (3 - a, 0)
        a, b, da, db = y
        by = 0.4 * np.array([b, a])
        masses = np.diag([2.0, 3.0]) + 1.5 * np.outer(by, by)
        return da, db, *np.linalg.solve(masses, np.array([3.0 - a, 0.0]) - 1.5 * 2.0 * 0.4 * da * db * by)

    exact = solve_ivp(motion, (0.0, 1.0), (0.0, 0.0, 0.7, 0.5), t_eval=found.t, rtol=1e-11, atol=1e-12).y
    rows, slide = found.request(1), found.request(2)
    np.testing.assert_allclose(rows[:, 1:3].T, exact[:2], atol=1e-7)
    np.testing.assert_allclose(slide[:, 1], 0.4 * exact[0] * exact[1], atol=1e-7)
    np.testing.assert_allclose(slide[:, 2], 0.4 * (exact[2] * exact[1] + exact[0] * exact[3]), atol=1e-6)


FREE = """PART/2, MASS=2, CM=20, IP=0.3,0.4,0.5, QG=0.1,0.02,-0.03, WX=0.2
MARKER/20, PART=2
PART/3, MASS=4, CM=30, IP=0.6,0.7,0.8, QG=-0.2,0,0
MARKER/30, PART=3
MARKER/32, PART=3, QP=0.2,0,0, REULER=20D,10D,30D
{field}
REQUEST/1, F2=DX(20,1)\\F3=DY(20,1)\\F4=DZ(20,1)\\F6=WX(20)\\F7=WY(20)\\F8=WZ(20)
REQUEST/2, FORCE, I=20, J=32, RM=32
"""
STIFF = [300.0, 400.0, 500.0, 20.0, 30.0, 40.0]


@pytest.mark.slow
def test_a_field_by_a_routine_is_a_bushing():
    def field(call):
        return [-k * q - 0.01 * k * v for k, q, v in zip(STIFF, call.displacement, call.velocity)]

    k, c = STIFF, [0.01 * v for v in STIFF]
    text = f"BUSHING/1, I=20, J=32, K={k[0]},{k[1]},{k[2]}, KT={k[3]},{k[4]},{k[5]}, C={c[0]},{c[1]},{c[2]}"
    text += f", CT={c[3]},{c[4]},{c[5]}"
    expected = run(FREE.format(field=text))
    found = run(FREE.format(field="FIELD/1, I=20, J=32, FUNCTION=USER(1)"), {"fiesub": field})
    np.testing.assert_allclose(found.request(1), expected.request(1), atol=1e-7)
    np.testing.assert_allclose(found.request(2), expected.request(2), atol=2e-5)


CAM = """ACCGRAV/JGRAV=-9.81
PART/2, MASS=1, CM=20, IP=1,1,1, QG=1,0,0
MARKER/20, PART=2
CURVE/1, {ends}, MINPAR=0, MAXPAR=6.283185307179586, FUNCTION=USER(1)
PTCV/1, I=20, CURVE=1, RM=1
JPRIM/1, PERPENDICULAR, I=20, J=2
REQUEST/1, F2=DX(20,1)\\F3=DY(20,1)\\F4=CURVE(TIME,0,1,1)\\F6=CURVE(TIME,1,2,1)
MARKER/2, PART=1, REULER=90D,90D,0
"""


def test_a_curve_by_a_routine_guides_a_point_on_a_circle():
    def circle(call):
        return math.cos(call.alpha), math.sin(call.alpha), 0.0

    result = run(CAM.format(ends="CLOSED").replace("JPRIM/1, PERPENDICULAR, I=20, J=2\n", ""), {"cursub": circle},
                 "m\no\nSIMULATE/DYNAMICS, END=0.5, STEPS=20\n")  # fmt: skip
    rows = result.request(1)
    assert np.hypot(rows[:, 1], rows[:, 2]) == pytest.approx(np.ones(21), abs=1e-7)
    from scipy.integrate import solve_ivp

    exact = solve_ivp(lambda t, y: (y[1], -9.81 * math.cos(y[0])), (0, 0.5), (0, 0), t_eval=result.t, rtol=1e-11,
                      atol=1e-12)  # fmt: skip
    assert rows[:, 2] == pytest.approx(np.sin(exact.y[0]), abs=1e-6)
    assert rows[:, 3] == pytest.approx(np.cos(result.t), abs=3e-8)
    assert rows[1:, 5] == pytest.approx(np.cos(result.t[1:]), abs=2e-6)


def test_arrays_and_texts_are_handed_to_routines():
    def force(call):
        assert call.gtstrg(4) == "soft spring"
        stiffness, rest = call.gtaray(7)
        (position,) = call.sysary("U", 8)
        return -stiffness * (position - rest)

    text = CART + ("STRING/4, STRING=soft spring\nARRAY/7, IC, NUMBERS=30,0.05\nARRAY/8, U, VARIABLES=1\n"
                   "VARIABLE/1, FUNCTION=DX(20,1)\nREQUEST/1, F2=DX(20,1)\n"
                   "SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION={}\n")  # fmt: skip
    found = run(text.format("USER(1)"), {"sfosub": force}).request(1)
    expected = run(text.format("-30*(DX(20,1)-0.05)")).request(1)
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize(
    "text", ["..\\wind\\Test14_AD.ipt", "C:\\a b\\PLANAR\\", "", "ES10.3E2, a = b, ROUTINE=c", "'quoted'", "x: (1, 2"]
)
def test_a_string_holds_all_that_follows(text):
    """Paths with backslashes, commas and signs of equality, and nothing at all."""
    deck = parse_deck(f"{HEAD}{CART}STRING/4, STRING = {text}\nSTRING/5, STRING=next\nEND\n")
    assert [deck.items[String][n].text for n in (4, 5)] == [text.strip("'"), "next"]


MANY = CART + LOOP + GSE + (
    "VARIABLE/5, FUNCTION=USER(1)\nVARIABLE/6, FUNCTION=2*VARVAL(5)\nPOUTPUT/1, VARIABLES=1,6\n"
    "SFORCE/3, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=VARVAL(6)\n"
    "SFORCE/4, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=-10*DX(20,1)\nREQUEST/3, F2=DX(20,1)\n"
)  # fmt: skip


def test_all_missing_routines_are_named_at_once_and_the_rest_runs_if_asked():
    with pytest.raises(DeckError) as caught:
        run(MANY)
    assert {d.message for d in caught.value.diagnostics} == {
        "VARIABLE/5: its routine VARSUB is missing; give it in routines",
        "GSE/1: its routines GSE_DERIV, GSE_OUTPUT are missing; give it in routines",
    }
    result = run(MANY, allow_unsupported=True)
    told = "\n".join(result.messages)
    for label, need in (("SFORCE/1", "ARRAY/3"), ("SFORCE/3", "VARIABLE/6"), ("VARIABLE/6", "VARIABLE/5")):
        assert f"{label}: it needs {need}, which is left out" in told
    # the spring of SFORCE/4 alone is left
    expected = 0.1 * np.cos(math.sqrt(5.0) * result.t)
    assert result.request(3)[:, 1] == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SAMPLED.replace("SAMPLE_PERIOD=0.05\\", ""), "GSE/1: SAMPLE_PERIOD is missing"),
        (SAMPLED.replace("0.05\\", "-1\\"), says("GSE/1", "SAMPLE_PERIOD = -1")),
        (SAMPLED.replace("NUMBERS=0.5,0", "NUMBERS=0.5"), "ICD = 6 holds 1 numbers for 2 states"),
        (SAMPLED.replace("X, SIZE=2", "X, SIZE=3"), says("XD = 5", "SIZE = 3", "2")),
        (SAMPLED.replace("ARRAY/1, U, VARIABLES=1", "ARRAY/1, X, SIZE=1"), says("U = 1", "ARRAY/1", "X")),
    ],
)
def test_mistakes_of_state_equations_are_named(text, message):
    with pytest.raises(DeckError, match=message):
        run(CART + text, {"gse_update": lambda call: (0.0, 0.0), "gse_output": lambda call: 0.0})


def test_files_may_hold_compiled_routines(tmp_path):
    path = tmp_path / "own.py"
    path.write_text(
        "from numba import njit\nimport numpy as np\n\n@njit\ndef gse_deriv(time, x, xd, u, parameters):\n"
        "    return np.array([x[1], -5.0 * x[0] - 3.0 * x[1] + 2.0 * u[0] - u[1]])\n\n"
        "def gse_output(call):\n    return 4 * call.x[0] + 0.5 * call.x[1]\n"
    )
    assert sorted(load_routines(path)) == ["gse_deriv", "gse_output"]
