"""Accelerations in forces, equations and sensors: probes change nothing and show what requests show."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck
from tests.says import says

DECK = """accelerations
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1, REULER=20D,30D,40D
MARKER/11, PART=1, FLOATING
PART/2, MASS=2, CM=20, IP=4000,5000,6000, QG=100,50,0
MARKER/20, PART=2, REULER=10D,20D,30D
MARKER/21, PART=2, QP=-100,-50,0
MARKER/22, PART=2, QP=30,-20,10, REULER=5D,6D,7D
JOINT/1, SPHERICAL, I=21, J=10
SPRINGDAMPER/1, TRANSLATIONAL, I=22, J=10, K=0.5, C=0.01, LENGTH=20
ACCGRAV/IGRAV=1000, JGRAV=-2000, KGRAV=-9000
{extra}
REQUEST/1, F2=ACCX(22,10,20)\\F3=ACCM(20)\\F4=WDTZ(22,0,22)\\F6=ACCY(22)
REQUEST/2, F2=VARVAL(1)\\F3=VARVAL(2)\\F4=VARVAL(3)\\F6=DIF(1)\\F7=VZ(20)\\F8=DZ(20)
END
"""
ASKED = """VARIABLE/1, FUNCTION=ACCX(22,10,20)
VARIABLE/2, FUNCTION=ACCM(20)
VARIABLE/3, FUNCTION=WDTZ(22,0,22)
VARIABLE/4, FUNCTION=ACCZ(20)
DIFF/1, IC=0, FUNCTION=VARVAL(4) + 0*VARVAL(1) + 0*VARVAL(2) + 0*VARVAL(3)
"""


def run(extra, steps=50):
    return run_deck(parse_deck(DECK.format(extra=extra)), end=0.5, steps=steps)


def test_a_probe_changes_nothing():
    plain = run("VARIABLE/1, FUNCTION=1\nVARIABLE/2, FUNCTION=1\nVARIABLE/3, FUNCTION=1\nDIFF/1, IC=0, FUNCTION=0")
    probed = run(ASKED)
    assert probed.success
    for column in (6, 7):
        values, expected = probed.request(2)[:, column], plain.request(2)[:, column]
        assert np.abs(values - expected).max() < 2e-6 * np.abs(expected).max()
    moved, expected = probed.part(2)[:, :12], plain.part(2)[:, :12]
    assert np.abs(moved - expected).max() < 1e-5 * np.abs(expected).max()
    force, expected = (r.force("joint", 1) for r in (probed, plain))
    assert np.abs(force - expected).max() < 1e-4 * np.abs(expected).max()


def test_the_integral_of_an_acceleration_is_the_velocity():
    result = run(ASKED)
    gained, velocity = result.request(2)[:, 5], result.request(2)[:, 6]
    assert np.ptp(velocity) > 100.0
    assert gained == pytest.approx(velocity - velocity[0], abs=1e-5 * np.ptp(velocity))


def test_a_force_by_acceleration_adds_mass():
    """-m a on a free body: it falls as if it had more inertia, with the weight it has."""
    deck = """added mass
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
MARKER/11, PART=1, FLOATING
PART/2, MASS=2, CM=20, IP=1,1,1
MARKER/20, PART=2
ACCGRAV/KGRAV=-9.81
VFORCE/1, I=20, JFLOAT=11, RM=10, FZ=-3*ACCZ(20)
REQUEST/1, F2=DZ(20)\\F3=ACCZ(20)
END
"""
    result = run_deck(parse_deck(deck), end=1.0, steps=10)
    expected = -9.81 * 2.0 / 5.0
    assert result.request(1)[:, 2] == pytest.approx(np.full(11, expected), rel=1e-6)
    assert result.request(1)[-1, 1] == pytest.approx(0.5 * expected, rel=1e-6)


def test_what_is_no_unknown_is_named():
    with pytest.raises(DeckError, match=says("MARKER/20")):
        run("VARIABLE/1, FUNCTION=ACCX(22,10,20,20)\nVARIABLE/2,FUNCTION=1\nVARIABLE/3,FUNCTION=1\n"
            "DIFF/1, IC=0, FUNCTION=VARVAL(1)")  # fmt: skip
    with pytest.raises(DeckError, match=says("GCON/1", "FUNCTION", "'ACCX(22)'")):
        run(ASKED + "GCON/1, FUNCTION=ACCX(22)")


def test_modes_of_a_free_body_whose_torque_follows_its_acceleration():
    """One of the shifts about which the problem is inverted is lost in rounding."""
    text = """free
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
PART/2, MASS=1, CM=20, IP=400,400,400, QG=0,0,20
MARKER/20, PART=2
MARKER/21, PART=2, QP=-10,-20,-30
VTORQUE/1, I=21, RM=21, JFLOAT=9, TX=2.535*WDTZ(21)\\TY=0\\TZ=2.451
MARKER/9, PART=1, FLOATING
END
"""
    modes = run_deck(parse_deck(text), parse_script("a\nb\nLINEAR/EIGENSOL\n")).log[-1][1]
    assert np.isfinite(modes.eigenvalues).all()


LOOP = """PART/2, MASS=2, CM=20, IP=1,1,1, QG=0.1,0,0
MARKER/20, PART=2
MARKER/21, PART=2, ZP=1.1,0,0
MARKER/11, PART=1, ZP=1,0,0
JOINT/1, TRANSLATIONAL, I=21, J=11
VARIABLE/1, FUNCTION=0.5*VARVAL(9)
VARIABLE/9, FUNCTION=2*ACCX(20,1,1)
ARRAY/1, U, VARIABLES=1
ARRAY/2, X, SIZE=1
ARRAY/3, Y, SIZE=1
{system}
SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=-50*DX(20,1)-{output}
REQUEST/1, F2=DX(20,1)\\F3=VX(20,1)
"""
ONE = "MATRIX/{}, FULL=RORDER, ROWS=1, COLUMNS=1, VALUES={}\n"
ROUTINES = {
    "GSE/1": {
        "deriv": lambda call: 4 * (call.u[0] - call.x[0]),
        "output": lambda call: 0.5 * call.x[0] + 0.3 * call.u[0],
    },
    "asked/1": lambda call: 4 * (call.sysfnc("VARVAL", 1) - call.x[0]),
    "shown/1": lambda call: 0.5 * call.x[0] + 0.3 * call.sysary("U", 1)[0],
}


@pytest.mark.parametrize(
    ("system", "output"),
    [
        ("LSE/1, X=2, U=1, Y=3, A=1, B=2, C=3, D=4\n" + ONE.format(1, -4) + ONE.format(2, 4) + ONE.format(3, 0.5)
         + ONE.format(4, 0.3), "ARYVAL(3,1)"),
        ("TFSISO/1, X=2, U=1, Y=3, NUMERATOR=3.2,0.3, DENOMINATOR=4,1", "ARYVAL(3,1)"),
        ("GSE/1, NS=1, NO=1, X=2, U=1, Y=3, FUNCTION=USER(1)", "ARYVAL(3,1)"),
        ("GSE/2, NS=1, NO=1, X=2, Y=3, FUNCTION=USER(1)\\INTERFACE=l::asked/1, l::shown/1", "ARYVAL(3,1)"),
        ("DIFF/1, IC=0, FUNCTION=4*(ARYVAL(1,1)-DIF(1))", "(0.5*DIF(1)+0.3*ARYVAL(1,1))"),
    ],
    ids=["LSE", "TFSISO", "GSE", "GSE that asks", "DIFF"],
)  # fmt: skip
def test_accelerations_go_through_arrays_into_systems(system, output):
    """A filter of an accelerometer whose output acts on the mass that carries it."""
    from scipy.integrate import solve_ivp

    deck = parse_deck("loop\nUNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND\nPART/1, GROUND\n"
                      "MARKER/1, PART=1\n" + LOOP.format(system=system, output=output) + "END\n")  # fmt: skip
    result = run_deck(deck, end=1.0, steps=20, tol=1e-9, routines=ROUTINES)
    assert result.success

    def motion(t, y):
        a = (-50.0 * y[0] - 0.5 * y[2]) / 2.3
        return y[1], a, 4.0 * (a - y[2])

    exact = solve_ivp(motion, (0.0, 1.0), (0.1, 0.0, 0.0), t_eval=result.t, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(result.request(1)[:, 1:3], exact.y[:2].T, atol=2e-9)
