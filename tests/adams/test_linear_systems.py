"""LSE and TFSISO: against the matrix exponential, against scipy's step response, and in a closed loop."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.signal import StateSpace, TransferFunction, lsim, step

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck
from tests.says import says

HEAD = """control
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
PART/2, MASS=2, CM=20, IP=1,1,1, QG=0.1,0,0
MARKER/20, PART=2
JOINT/1, TRANSLATIONAL, I=21, J=11
MARKER/21, PART=2, ZP=1,0,0
MARKER/11, PART=1, ZP=1,0,0
"""


def run(text, end=2.0, steps=40):
    deck = parse_deck(HEAD + text + "END\n")
    return run_deck(deck, parse_script(f"m\no\nSIMULATE/DYNAMICS, END={end}, STEPS={steps}\n"), tol=1e-10)


SYSTEM = """VARIABLE/1, FUNCTION=3
ARRAY/1, U, VARIABLES=1
ARRAY/2, X, SIZE=3
ARRAY/3, Y
ARRAY/4, IC, SIZE=3, NUMBERS=1, 0.5, -0.2
MATRIX/1, FULL=RORDER, ROWS=3, COLUMNS=3, VALUES=-0.5, 2, 0, -2, -0.5, 0.3, 0, 0.1, -1
MATRIX/2, FULL=RORDER, ROWS=3, COLUMNS=1, VALUES=0, 1, 0.5
MATRIX/3, FULL=RORDER, ROWS=2, COLUMNS=3, VALUES=1, 0, 0, 0, 1, -1
MATRIX/4, FULL=RORDER, ROWS=2, COLUMNS=1, VALUES=0, 0.25
LSE/1, X=2, U=1, Y=3, A=1, B=2, C=3, D=4, IC=4
REQUEST/1, F2=ARYVAL(2,1)\\F3=ARYVAL(2,3)\\F4=ARYVAL(3,1)\\F6=ARYVAL(3,2)
"""
A = np.array([[-0.5, 2, 0], [-2, -0.5, 0.3], [0, 0.1, -1]])
B = np.array([0, 1, 0.5])
C = np.array([[1, 0, 0], [0, 1, -1.0]])


def test_a_linear_system_is_the_matrix_exponential():
    result = run(SYSTEM)
    assert result.success
    # with x and the constant input in one vector the solution is one exponential
    whole = np.zeros((4, 4))
    whole[:3, :3], whole[:3, 3] = A, 3 * B
    expected = np.array([(expm(whole * t) @ [1, 0.5, -0.2, 1])[:3] for t in result.t])
    found = result.request(1)
    np.testing.assert_allclose(found[:, 1], expected[:, 0], atol=2e-8)
    np.testing.assert_allclose(found[:, 2], expected[:, 2], atol=2e-8)
    outputs = expected @ C.T + 3 * np.array([0, 0.25])
    np.testing.assert_allclose(found[:, 3], outputs[:, 0], atol=2e-8)
    np.testing.assert_allclose(found[:, 5], outputs[:, 1], atol=2e-8)


def test_an_input_over_time_and_other_units():
    text = SYSTEM.replace("FUNCTION=3", "FUNCTION=SIN(4*TIME)")
    expected = None
    for unit, factor in (("SECOND", 1.0), ("MILLISECOND", 1e3)):
        scaled = text.replace("SIN(4*TIME)", f"SIN({4 / factor!r}*TIME)")
        # rates are by the deck's unit of time
        for name, values in (("1", A), ("2", B)):
            listed = ", ".join(repr(float(v) / factor) for v in np.ravel(values))
            rows = {"1": "ROWS=3, COLUMNS=3", "2": "ROWS=3, COLUMNS=1"}[name]
            line = next(x for x in scaled.splitlines() if x.startswith(f"MATRIX/{name},"))
            scaled = scaled.replace(line, f"MATRIX/{name}, FULL=RORDER, {rows}, VALUES={listed}")
        deck = parse_deck(HEAD.replace("TIME=SECOND", f"TIME={unit}") + scaled + "END\n")
        script = parse_script(f"m\no\nSIMULATE/DYNAMICS, END={2 * factor}, STEPS=40\n")
        found = run_deck(deck, script, tol=1e-10).request(1)
        if expected is None:
            t = np.linspace(0, 2, 4001)
            _, _, x = lsim(StateSpace(A, B[:, None], C, np.zeros((2, 1))), np.sin(4 * t), t, X0=[1, 0.5, -0.2])
            expected = x[::100]
        np.testing.assert_allclose(found[:, 1], expected[:, 0], atol=2e-6)
        np.testing.assert_allclose(found[:, 2], expected[:, 2], atol=2e-6)


@pytest.mark.parametrize(
    ("above", "below"),
    [([2.0], [1.0, 0.2]), ([1.0, 0.5], [4.0, 0.4, 2.0]), ([1.0, 2.0, 3.0], [2.0, 1.0, 1.5]), ([3.0], [2.0])],
)
def test_a_transfer_function_has_its_step_response(above, below):
    def listed(values):
        return ", ".join(map(str, values))

    result = run(
        "VARIABLE/1, FUNCTION=1\nARRAY/1, U, VARIABLES=1\nARRAY/2, X\nARRAY/3, Y, SIZE=1\n"
        f"TFSISO/7, X=2, U=1, Y=3, NUMERATOR={listed(above)}, DENOMINATOR={listed(below)}\n"
        "REQUEST/1, F2=ARYVAL(3,1)\n",
        end=5.0,
        steps=50,
    )
    if len(below) == 1:
        expected = np.full(51, above[0] / below[0])
    else:
        _, expected = step(TransferFunction(above[::-1], below[::-1]), T=result.t)
    np.testing.assert_allclose(result.request(1)[:, 1], expected, atol=1e-7)


LOOP = """ARRAY/1, U, VARIABLES=1
ARRAY/2, X
ARRAY/3, Y
VARIABLE/1, FUNCTION=DX(20,1)
TFSISO/1, X=2, U=1, Y=3, NUMERATOR=-100, -10, DENOMINATOR=1, 0.05
SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION={force}
REQUEST/1, F2=DX(20,1)\\F3=VX(20,1)
"""


def test_a_controller_closes_the_loop():
    result = run(LOOP.format(force="ARYVAL(3,1)"))
    # y = (-100 - 10 s)/(1 + 0.05 s) x, mass 2: with w' = x - 20 w as the filter's state
    below, lead = 20.0, -10 / 0.05

    def rates(t, z):
        x, v, w = z
        return [v, ((-100 / 0.05 - lead * below) * w + lead * x) / 2, x - below * w]

    expected = solve_ivp(rates, (0, 2), [0.1, 0, 0], t_eval=result.t, rtol=1e-10, atol=1e-12).y
    np.testing.assert_allclose(result.request(1)[:, 1], expected[0], atol=2e-8)
    np.testing.assert_allclose(result.request(1)[:, 2], expected[1], atol=2e-7)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("A=1", "A=2"), "A is 3 by 1"),
        (("B=2", "B=9"), says("MATRIX/9", "B")),
        (("U=1", "U=2"), says("U = 2", "ARRAY/2", "X")),
        (("SIZE=3, NUMBERS=1, 0.5, -0.2", "NUMBERS=1, 2"), "IC = 4 holds 2 numbers for 3 states"),
        (("ARRAY/2, X, SIZE=3", "ARRAY/2, X, SIZE=4"), "SIZE = 4, it must be 3"),
        (("U=1, ", ""), "B and D need U"),
        (("C=3, D=4, ", ""), "Y needs C or D"),
        (("A=1, ", ""), "A is missing"),
        (("LSE/1, X=2, U=1, Y=3, A=1, B=2, C=3, D=4, IC=4",
          "TFSISO/1, X=2, U=1, Y=3, NUMERATOR=1,2,3, DENOMINATOR=1,2"), "NUMERATOR has 3 coefficients"),
        (("LSE/1, X=2, U=1, Y=3, A=1, B=2, C=3, D=4, IC=4",
          "TFSISO/1, X=2, U=1, Y=3, NUMERATOR=1, DENOMINATOR=1,0"), says("DENOMINATOR", "0")),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_named(change, words):
    with pytest.raises(DeckError, match=words):
        run(SYSTEM.replace(*change))
