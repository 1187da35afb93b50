"""Every joint, motion and force of a deck against a closed solution of its own."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, parse_script
from gearmbs.adams.runner import run_deck
from tests.says import says

from .test_run import model, run

G = 9.80665
BLOCK = "PART/2,MASS=2,CM=20,IP=0.1,0.2,0.3\nMARKER/20,PART=2\n"
SECOND = "PART/3,MASS=3,CM=30,IP=0.4,0.5,0.6\nMARKER/30,PART=3\n"


def test_translational_joint_on_an_inclined_rail():
    # z of the rail 30 degrees below the horizontal: s = g sin(30) t^2 / 2
    body = BLOCK + "MARKER/21,PART=2,REULER=90D,120D,0\nMARKER/11,PART=1,REULER=90D,120D,0\nACCGRAV/KGRAV=-9.80665\n"
    result = run(model(body + "JOINT/1,TRANSLATIONAL,I=21,J=11\nREQUEST/1,F2=DZ(21,11,11)\\F3=JOINT(1,0,3,11)"), 1.0)
    np.testing.assert_allclose(result.request(1)[:, 1], 0.25 * G * result.t**2, atol=1e-7)
    # the rail carries m g cos(30) on the block, across z
    assert abs(result.request(1)[-1, 2]) == pytest.approx(2 * G * np.cos(np.pi / 6), rel=1e-9)


def test_cylindrical_joint_turns_and_slides():
    body = BLOCK + "JOINT/1,CYLINDRICAL,I=20,J=10\nVFORCE/1,I=20,JFLOAT=12,RM=10,FX=0\\FY=0\\FZ=4\n"
    body += "MARKER/12,PART=1,FLOATING\nVTORQUE/1,I=20,JFLOAT=12,RM=10,TX=0\\TY=0\\TZ=0.6*TIME\n"
    result = run(model(body + "REQUEST/1,F2=DZ(20,10)\\F3=AZ(20,10)\\F4=WZ(20,10)"), 3.0)
    t = result.t
    np.testing.assert_allclose(result.request(1)[:, 1], t**2, atol=1e-6)  # 4/2 t^2/2
    np.testing.assert_allclose(result.request(1)[:, 2], t**3 / 3, atol=1e-6)  # 0.6 t/0.3, counted past pi
    np.testing.assert_allclose(result.request(1)[:, 3], t**2, atol=1e-6)


@pytest.mark.parametrize("kind", ["UNIVERSAL", "HOOKE"])
def test_cross_joint_between_bent_shafts(kind):
    """Driven shaft behind a cross joint bent by b: tan(out) = tan(in)/cos(b), from the driving arm upright."""
    bend = 0.4
    # shaft 2 along z; shaft 3 along (0, -sin b, cos b): turned about x by b
    out = f"QP=0,0,0,REULER=0,{bend},0"
    body = BLOCK + SECOND + f"MARKER/11,PART=1,{out}\nMARKER/31,PART=3,{out}\n"
    body += "JOINT/1,REVOLUTE,I=20,J=10\nJOINT/2,CYLINDRICAL,I=31,J=11\nMOTION/1,JOINT=1,ROTATION,FUNCTION=2*TIME\n"
    if kind == "UNIVERSAL":
        # arms: x on shaft 2; on shaft 3 the direction across x and its own axis, its y
        body += "MARKER/22,PART=2,REULER=90D,90D,0\n"
        body += f"MARKER/32,PART=3,ZP=0,{np.cos(bend):.17g},{np.sin(bend):.17g}\nJOINT/3,UNIVERSAL,I=22,J=32\n"
    else:
        body += "JOINT/3,HOOKE,I=20,J=31\n"
    result = run(model(body + "REQUEST/1,F2=AZ(20,10)\\F3=AZ(31,11)"), 2.0, 40)
    driving, driven = result.request(1)[:, 1], result.request(1)[:, 2]
    np.testing.assert_allclose(driving, 2 * result.t, atol=1e-8)
    expected = np.unwrap(np.arctan2(np.sin(driving) * np.cos(bend), np.cos(driving)))
    other = np.unwrap(np.arctan2(np.sin(driving), np.cos(driving) * np.cos(bend)))
    assert min(np.abs(driven - expected).max(), np.abs(driven - other).max()) < 1e-7
    assert np.abs(driven - driving).max() > 0.02


def test_constant_velocity_joint_between_bent_shafts():
    out = "QP=0,0,0,REULER=0,0.4,0"
    body = BLOCK + SECOND + f"MARKER/11,PART=1,{out}\nMARKER/31,PART=3,{out}\n"
    body += "JOINT/1,REVOLUTE,I=20,J=10\nJOINT/2,CYLINDRICAL,I=31,J=11\nMOTION/1,JOINT=1,FUNCTION=2*TIME\n"
    result = run(model(body + "JOINT/3,CONVEL,I=20,J=31\nREQUEST/1,F2=AZ(20,10)\\F3=AZ(31,11)"), 2.0, 40)
    np.testing.assert_allclose(np.abs(result.request(1)[:, 2]), 2 * result.t, atol=1e-7)


def test_screw_advances_by_its_pitch():
    body = (
        BLOCK + "JOINT/1,SCREW,I=20,J=10,PITCH=0.05\nVTORQUE/1,I=20,JFLOAT=12,RM=10,TZ=0.6\nMARKER/12,PART=1,FLOATING\n"
    )
    result = run(model(body + "REQUEST/1,F2=DZ(20,10)\\F3=AZ(20,10)"), 4.0)
    lead = 0.05 / (2 * np.pi)
    angle = 0.5 * 0.6 / (0.3 + 2 * lead**2) * result.t**2
    np.testing.assert_allclose(result.request(1)[:, 2], angle, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(result.request(1)[:, 1], lead * angle, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("side", [1, -1])
def test_rack_and_pinion_rolls_without_slip(side):
    """Pinion about z, rack along x below or above it: the point of contact moves with -+ r w."""
    height = -0.2 * side
    body = BLOCK + SECOND.replace("MARKER/30,PART=3", f"MARKER/30,PART=3,QP=0,{height},0")
    body += f"MARKER/31,PART=3,QP=0,{height},0,ZP=1,{height},0\nMARKER/11,PART=1,QP=0,{height},0,ZP=1,{height},0\n"
    body += "JOINT/1,REVOLUTE,I=20,J=10\nJOINT/2,TRANSLATIONAL,I=31,J=11\nJOINT/3,RACKPIN,I=20,J=31,PD=0.4\n"
    body += "VTORQUE/1,I=20,JFLOAT=12,RM=10,TZ=1.2\nMARKER/12,PART=1,FLOATING\n"
    result = run(model(body + "REQUEST/1,F2=DX(30,10)\\F3=AZ(20,10)"), 3.0)
    # (I + m r^2) a = T: 0.3 + 3 * 0.04 = 0.42; contact below the axis moves along +x for a turn about z
    angle = 0.5 * 1.2 / 0.42 * result.t**2
    np.testing.assert_allclose(result.request(1)[:, 2], angle, atol=1e-6)
    np.testing.assert_allclose(result.request(1)[:, 1], side * 0.2 * angle, atol=1e-6)


def test_gear_and_coupler_agree():
    """Wheels of radius 0.1 and 0.3 on parallel axes: w2 = -w1/3; effective inertia I1 + I2/9."""
    body = BLOCK + SECOND.replace("MARKER/30,PART=3", "MARKER/30,PART=3,QP=0.4,0,0") + "MARKER/11,PART=1,QP=0.4,0,0\n"
    body += "JOINT/1,REVOLUTE,I=20,J=10\nJOINT/2,REVOLUTE,I=30,J=11\nVTORQUE/1,I=20,JFLOAT=12,RM=10,TZ=1\n"
    body += "MARKER/12,PART=1,FLOATING\nMARKER/13,PART=1,QP=0.1,0,0,ZP=0.1,1,0\nREQUEST/1,F2=AZ(20,10)\\F3=AZ(30,11)\n"
    angle = lambda t: 0.5 / (0.3 + 0.6 / 9) * t**2  # noqa: E731
    for link in (
        "GEAR/1,JOINTS=1,2,CV=13",
        "COUPLER/1,JOINTS=1,2,SCALES=1,3",
        "COUPLER/1,JOINTS=1,2,TYPE=R:R,SCALES=3",
    ):
        result = run(model(body + link), 3.0)
        np.testing.assert_allclose(result.request(1)[:, 1], angle(result.t), atol=1e-6)
        np.testing.assert_allclose(result.request(1)[:, 2], -angle(result.t) / 3, atol=1e-6)


@pytest.mark.parametrize("friction", [0.6, 0.5])
def test_friction_statement_holds_or_lets_slide(friction):
    """Rail 30 degrees down, deck in mm: tan 30 = 0.577 lies between the coefficients."""
    body = "PART/2,MASS=2,CM=20,IP=1000,1000,1000\nMARKER/20,PART=2,REULER=90D,120D,0\nACCGRAV/KGRAV=-9806.65\n"
    body += "MARKER/11,PART=1,REULER=90D,120D,0\nJOINT/1,TRANSLATIONAL,I=20,J=11\n"
    body += f"FRICTION/1, JOINT=1, MU_STATIC={friction}, MU_DYN=0.3, INPUTS=REACTION_FORCE\nREQUEST/1,F2=DZ(20,11,11)"
    text = model(body).replace("UNITS/SYSTEM=MKS", "UNITS/FORCE=NEWTON,MASS=KILOGRAM,LENGTH=MILLIMETER,TIME=SECOND")
    moved = run(text, 1.0).request(1)[-1, 1]
    if friction == 0.6:
        assert 0.0 < moved < 0.1
    else:
        assert moved == pytest.approx(500 * G * (0.5 - 0.3 * np.cos(np.pi / 6)), rel=0.01)


def test_primitives_and_planar_joint():
    """INPLANE plus PARALLEL_AXES is PLANAR: a body pushed off its centre moves in the plane only."""
    push = "MARKER/21,PART=2,QP=0.3,0,0\nMARKER/12,PART=1,FLOATING\n"
    push += "GFORCE/1,I=21,JFLOAT=12,RM=10,FX=1\\FY=2\\FZ=3\\TX=1\\TY=0\\TZ=0\n"
    request = "REQUEST/1,D,I=20,J=10\nREQUEST/2,F2=AZ(20,10)\n"
    one = run(model(BLOCK + push + request + "JOINT/1,PLANAR,I=20,J=10"), 1.0)
    two = run(model(BLOCK + push + request + "JPRIM/1,INPLANE,I=20,J=10\nJPRIM/2,PARALLEL_AXES,I=20,J=10"), 1.0)
    np.testing.assert_allclose(one.request(1)[:, 1:4], two.request(1)[:, 1:4], atol=1e-7)
    np.testing.assert_allclose(one.request(1)[:, 1], 0.25 * one.t**2, atol=1e-7)
    np.testing.assert_allclose(one.request(1)[:, 2], 0.5 * one.t**2, atol=1e-7)
    assert np.abs(one.request(1)[:, 3]).max() < 1e-9
    # torque about the centre: 0.3 (cos a Fy - sin a Fx), early a'' = 0.3 * 2/0.3 = 2
    assert one.request(2)[5, 1] == pytest.approx(one.t[5] ** 2, rel=0.02)


@pytest.mark.parametrize(
    "constraint",
    ["DZ(20,10)-DX(20,10)**2", "DZ(20,10)-DX(20,10)**2+0*JPRIM(1,0,6,0)"],
    ids=["of positions", "with a torque times nothing"],
)
def test_point_motion_and_general_constraint(constraint):
    body = BLOCK + "JPRIM/1,ORIENTATION,I=20,J=10\nMOTION/1,I=20,J=10,X,FUNCTION=0.1*SIN(3*TIME)\n"
    body += f"MOTION/2,I=20,J=10,Y,FUNCTION=0.2*TIME**2\nGCON/1,I=20,FUNCTION={constraint}\n"
    result = run(model(body + "REQUEST/1,D,I=20,J=10\nREQUEST/2,F2=MOTION(2,0,3,0)\\F3=GCON(1,0,4,0)"), 1.0)
    t = result.t
    x = 0.1 * np.sin(3 * t)
    np.testing.assert_allclose(result.request(1)[:, 1:4], np.column_stack([x, 0.2 * t**2, x**2]), atol=1e-8)
    # forces: m y'' = 2 * 0.4; m z'' with z = x^2
    np.testing.assert_allclose(result.request(2)[:, 1], 0.8, atol=1e-6)
    rate, curve = 0.3 * np.cos(3 * t), -0.9 * np.sin(3 * t)
    np.testing.assert_allclose(result.request(2)[:, 2], 2 * (2 * rate**2 + 2 * x * curve), atol=1e-6)


@pytest.mark.parametrize(
    "motion",
    ["FUNCTION=5*TIME+TIME**2", "VELOCITY,FUNCTION=5+2*TIME", "ACCELERATION,ICVEL=5,FUNCTION=2"],
    ids=["angle", "velocity", "acceleration"],
)
@pytest.mark.parametrize("body", ["I=20,J=10", "I=20,J=11"], ids=["from zero", "from a quarter"])
def test_a_third_angle_is_driven_through_whole_turns(body, motion):
    """Both ends of a revolute joint: 14 rad, with the torque I a."""
    given = BLOCK + f"MARKER/11,PART=1,REULER=-90D,0,0\nJOINT/1,REVOLUTE,I=20,J=10\nMOTION/1,B3,{body},{motion}\n"
    moved = given.replace("FUNCTION=5", "FUNCTION=PI/2+5") if "," not in motion and "11" in body else given
    result = run(model(moved + "REQUEST/1,F2=AZ(20,10)\\F3=WZ(20,10)\\F4=MOTION(1,0,8,10)"), 2.0)
    t = result.t
    np.testing.assert_allclose(result.request(1)[:, 1], 5 * t + t**2, atol=1e-7)
    np.testing.assert_allclose(result.request(1)[:, 2], 5 + 2 * t, atol=1e-6)
    np.testing.assert_allclose(result.request(1)[:, 3], 0.6, atol=1e-6)


def test_the_first_two_angles_of_a_free_body_are_driven_by_their_velocities():
    body = BLOCK + "MOTION/1,B1,VELOCITY,I=20,J=10,FUNCTION=4\nMOTION/2,B2,VELOCITY,I=20,J=10,FUNCTION=COS(TIME)\n"
    body += "ACCGRAV/IGRAV=0\nREQUEST/1,F2=ORIENT(1,1,20,10)\\F3=ORIENT(1,2,20,10)\n"
    result = run(model(body), 2.0)
    first = np.unwrap(result.request(1)[:, 1])
    np.testing.assert_allclose(first, 4 * result.t, atol=1e-7)
    np.testing.assert_allclose(result.request(1)[:, 2], np.sin(result.t), atol=1e-7)


@pytest.mark.parametrize("motion", ["JOINT=1,FUNCTION=3*TIME", "I=20,J=10,B3,FUNCTION=3*TIME"])
def test_initial_conditions_of_a_driven_joint_give_way(motion):
    body = BLOCK + f"JOINT/1,REVOLUTE,I=20,J=10,IC=0,6\nMOTION/1,{motion}\nREQUEST/1,F3=WZ(20,10)\n"
    deck = parse_deck(model(body))
    result = run_deck(deck, end=1.0, steps=2)
    np.testing.assert_allclose(result.request(1)[:, 2], 3.0, atol=1e-7)
    assert any("JOINT/1: IC is left out" in str(m) for m in result.messages)
    agreeing = run_deck(parse_deck(model(body.replace("IC=0,6", "IC=0,3"))), end=1.0, steps=2)
    assert not any("left out" in str(m) for m in agreeing.messages)


def test_joint_initial_conditions():
    body = BLOCK + "JOINT/1,REVOLUTE,I=20,J=10,IC=30D,2\nREQUEST/1,F2=AZ(20,10)\\F3=WZ(20,10)\n"
    result = run(model(body + "ACCGRAV/IGRAV=0"), 1.0)
    np.testing.assert_allclose(result.request(1)[:, 1], np.pi / 6 + 2 * result.t, atol=1e-7)
    rail = BLOCK + "JOINT/1,TRANSLATIONAL,I=20,J=10,IC=0.5,-2\nREQUEST/1,F2=DZ(20,10)\n"
    result = run(model(rail), 1.0)
    np.testing.assert_allclose(result.request(1)[:, 1], 0.5 - 2 * result.t, atol=1e-7)


def test_part_velocities_and_inertia_marker():
    """A free body keeps spinning about a principal axis; IP given about another marker must be moved to CM."""
    body = (
        "PART/2,MASS=2,CM=20,IM=21,IP=0.1,0.7,0.8,QG=1,0,0,VX=1,WZ=3\nMARKER/20,PART=2,QP=0.5,0,0\nMARKER/21,PART=2\n"
    )
    result = run(model(body + "REQUEST/1,D,I=20,J=10\nREQUEST/2,V,I=20,J=10"), 1.0)
    np.testing.assert_allclose(result.request(1)[:, 1], 1.5 + result.t, atol=1e-8)
    np.testing.assert_allclose(result.request(2)[:, 7], 3.0, atol=1e-8)
    inertia = result.segments[0].model.mechanism.bodies["PART_2"].inertia
    # shift of 0.5 along x: 2 * 0.25 off yy and zz
    np.testing.assert_allclose(np.diag(inertia), [0.1, 0.2, 0.3], atol=1e-12)


def test_rotational_spring_damper():
    """I a'' = -k (a - a0) - c a': frequency and decay of the damped swing."""
    body = BLOCK + "JOINT/1,REVOLUTE,I=20,J=10\nSPRINGDAMPER/1,ROTATION,I=20,J=10,KT=30,CT=0.6,ANGLE=20D,TORQUE=1.5\n"
    result = run(model(body + "REQUEST/1,F2=AZ(20,10)\\F3=SPDP(1,0,8,0)"), 2.0, 100)
    decay, omega = 0.6 / 0.6, np.sqrt(30 / 0.3 - 1.0)
    rest = np.radians(20) + 1.5 / 30
    swing = np.exp(-decay * result.t) * (np.cos(omega * result.t) + decay / omega * np.sin(omega * result.t))
    np.testing.assert_allclose(result.request(1)[:, 1], rest * (1 - swing), atol=1e-6)
    rate = rest * np.exp(-decay * result.t) * (omega + decay**2 / omega) * np.sin(omega * result.t)
    torque = 1.5 - 30 * (rest * (1 - swing) - np.radians(20)) - 0.6 * rate
    np.testing.assert_allclose(result.request(1)[:, 2], torque, atol=1e-5)


def test_bushing_and_field_are_the_same_when_diagonal():
    k, kt, c, ct = (100.0, 200.0, 300.0), (4.0, 5.0, 6.0), (1.0, 2.0, 3.0), (0.1, 0.2, 0.3)
    setup = BLOCK + "MARKER/11,PART=1,QP=0.01,-0.02,0.03,REULER=10D,5D,-8D\nACCGRAV/KGRAV=-9.80665\n"
    setup += "REQUEST/1,D,I=20,J=10\nREQUEST/2,F,I=20,J=11\n"

    def listed(*rows):
        return ",".join(repr(float(v)) for v in np.ravel(rows))

    bushing = f"BUSHING/1,I=20,J=11,K={listed(k)},KT={listed(kt)},C={listed(c)},CT={listed(ct)},FORCE=1,2,3"
    full_k, full_c = np.diag([*k, *kt]), np.diag([*c, *ct])
    field = f"FIELD/1,I=20,J=11,KMATRIX={listed(*full_k)},CMATRIX={listed(*full_c)},FORCE=1,2,3,0,0,0"
    a, b = run(model(setup + bushing), 0.5, 10), run(model(setup + field), 0.5, 10)
    np.testing.assert_allclose(a.request(1), b.request(1), atol=1e-8)
    np.testing.assert_allclose(a.request(2), b.request(2), atol=1e-6)
    assert np.abs(a.request(2)[0, 1:4]).max() > 1.0


@pytest.mark.parametrize("command", ["SIMULATE/STATICS", "LINEAR/EIGENSOL", "SIMULATE/DYNAMICS, END=1, STEPS=1"])
def test_a_bushing_turned_by_a_right_angle_is_named(command):
    bushing = "MARKER/11,PART=1,ZP=1,0,0\nBUSHING/1,I=20,J=11,K=1,1,1,KT=1,2,3\n"
    deck = parse_deck(model(BLOCK + bushing))
    script = parse_script(f"m\no\n{command}\n")
    if "DYN" in command:
        result = run_deck(deck, script)
        told = "" if result.success else result.segments[-1].solution.result.message
    else:
        with pytest.raises(DeckError) as caught:
            run_deck(deck, script)
        told = str(caught.value)
    assert "(BUSHING_1)" in told
    assert "finite" in told


def test_field_matrix_is_stored_by_columns():
    """A lone entry in column 1, row 2 makes Fy = -K21 x."""
    k = np.zeros((6, 6))
    k[0, 1] = 50.0
    listed = ",".join(repr(float(v)) for v in k.ravel())
    body = BLOCK.replace("MARKER/20,PART=2", "MARKER/20,PART=2,QP=0.1,0,0") + f"FIELD/1,I=20,J=10,KMATRIX={listed}\n"
    result = run(model(body + "REQUEST/1,F,I=20,J=10"), 0.01, 1)
    np.testing.assert_allclose(result.request(1)[0, 1:4], [0, -5, 0], atol=1e-12)


@pytest.mark.parametrize("shear", [0.0, 1.2])
def test_beam_bends_like_timoshenko(shear):
    """Cantilever of 1 m with a small load at its end: u = F L^3/(3 E I) + shear F L/(G A), slope F L^2/(2 E I)."""
    body = "PART/2,MASS=1E-9,CM=20,IP=1,1,1\nMARKER/20,PART=2,QP=1,0,0\nMARKER/12,PART=1,FLOATING\n"
    body += "BEAM/1,I=20,J=10,LENGTH=1,IXX=2E-8,IYY=1E-8,IZZ=3E-8,AREA=1E-4,EMODULUS=2E11,GMODULUS=8E10,CRATIO=0.01\n"
    body = body.replace("CRATIO", f"ASY={shear},ASZ={shear},CRATIO")
    body += "GFORCE/1,I=20,JFLOAT=12,RM=10,FX=20\\FY=0.6\\FZ=0.2\\TX=0.01\\TY=0\\TZ=0\n"
    body += "REQUEST/1,D,I=20,J=10\nREQUEST/2,F2=AX(20,10)\\F3=AY(20,10)\\F4=AZ(20,10)\\F6=BEAM(1,0,2,0)\n"
    result = run_deck(parse_deck(model(body)), parse_script("m\np\nsim/statics\n"))
    moved, turned = result.request(1)[0, 1:4] - [1, 0, 0], result.request(2)[0, 1:4]
    slide = shear / (8e10 * 1e-4)
    # the axial force adds F u to the moments: a part in 1e4
    np.testing.assert_allclose(moved, [20 / 2e7, 0.6 / 18000 + 0.6 * slide, 0.2 / 6000 + 0.2 * slide], rtol=1e-3)
    np.testing.assert_allclose(turned, [0.01 / 1600, -0.2 / 4000, 0.6 / 12000], rtol=1e-3)
    assert result.request(2)[0, 5] == pytest.approx(-20.0, rel=1e-6)


@pytest.mark.parametrize(
    "element",
    [
        "BEAM/1,I=20,J=10,LENGTH=1,IXX=2,IYY=1,IZZ=1,AREA=1,EMOD=1,GMOD=1",
        f"FIELD/1,I=20,J=10,KMATRIX={','.join(['1'] * 36)}",
    ],
)
def test_damping_that_drives_is_refused(element):
    """A negative CRATIO feeds every vibration; zero damps none, and runs."""
    body = BLOCK.replace("MARKER/20,PART=2", "MARKER/20,PART=2,QP=1,0,0") + element
    with pytest.raises(DeckError, match=says("CRATIO", "-0.01", "negative")):
        parse_deck(model(body + ",CRATIO=-0.01\n"))
    assert parse_deck(model(body + ",CRATIO=0\n"))


def test_single_component_forces():
    """A rotational SFORCE acts and reacts; an action-only one does not react."""
    two = BLOCK + SECOND + "JOINT/1,REVOLUTE,I=20,J=10\nJOINT/2,REVOLUTE,I=30,J=10\nREQUEST/1,F2=WZ(20)\\F3=WZ(30)\n"
    both = run(model(two + "SFORCE/1,ROTATIONAL,I=20,J=30,FUNCTION=1.5"), 1.0)
    np.testing.assert_allclose(both.request(1)[-1, 1:3], [5.0, -2.5], atol=1e-6)
    one = run(model(two + "SFORCE/1,ROTATIONAL,ACTIONONLY,I=20,J=30,FUNCTION=1.5"), 1.0)
    np.testing.assert_allclose(one.request(1)[-1, 1:3], [5.0, 0.0], atol=1e-6)


def test_differential_equation_and_variable():
    body = BLOCK + "DIFF/1,IC=2,FUNCTION=-3*DIF(1)\nVARIABLE/1,FUNCTION=DIF(1)*2\nJOINT/1,TRANSLATIONAL,I=20,J=10\n"
    body += (
        "SFORCE/1,TRANSLATIONAL,ACTIONONLY,I=20,J=10,FUNCTION=VARVAL(1)\nREQUEST/1,F2=DIF(1)\\F3=DZ(20)\\F4=DIF1(1)\n"
    )
    result = run(model(body), 2.0)
    t = result.t
    np.testing.assert_allclose(result.request(1)[:, 1], 2 * np.exp(-3 * t), atol=1e-6)
    # 2 z'' = 4 exp(-3 t)
    np.testing.assert_allclose(result.request(1)[:, 2], 2 * (np.exp(-3 * t) - 1 + 3 * t) / 9, atol=1e-6)
    np.testing.assert_allclose(result.request(1)[:, 3], -6 * np.exp(-3 * t), atol=1e-5)


def test_force_on_an_impact_expression():
    """A ball dropped on a stop without damping returns to its height: energy is kept."""
    body = BLOCK.replace("MARKER/20,PART=2", "MARKER/20,PART=2,QP=0,0,0.1") + "ACCGRAV/KGRAV=-9.80665\n"
    body += "SFORCE/1,TRANS,ACTION,I=20,J=10,FUNCTION=IMPACT(DZ(20,10),VZ(20,10),0.05,1E5,1.5,0,0.001)\n"
    result = run(model(body + "REQUEST/1,F2=DZ(20)\\F3=VZ(20)\\F4=SFORCE(1,0,4,0)"), 0.5, 500)
    z, v = result.request(1)[:, 1], result.request(1)[:, 2]
    elastic = 1e5 * np.maximum(0.05 - z, 0) ** 2.5 / 2.5
    energy = 2 * G * z + v**2 + elastic
    np.testing.assert_allclose(energy, energy[0], rtol=1e-5)
    np.testing.assert_allclose(result.request(1)[:, 3], 1e5 * np.maximum(0.05 - z, 0) ** 1.5, atol=1e-4)
    assert z.min() < 0.05


@pytest.mark.slow
def test_motions_given_by_velocity_and_acceleration():
    """A turn at 3 cos(t) rad/s from 20 degrees, a slide at 2 t m/s^2 from rest and one with ICVEL."""
    turn = BLOCK.replace("MARKER/20,PART=2", "MARKER/20,PART=2,REULER=20D,0,0") + "JOINT/1,REVOLUTE,I=20,J=10\n"
    turn += "MOTION/1,JOINT=1,ROTATION,VELOCITY,FUNCTION=3*COS(TIME)\n"
    turn += "REQUEST/1,F2=AZ(20,10)\\F3=WZ(20,10)\\F4=WDTZ(20,10)\n"
    result = run(model(turn), 4.0, 80)
    t = result.t
    np.testing.assert_allclose(result.request(1)[:, 1], np.radians(20) + 3 * np.sin(t), atol=1e-9)
    np.testing.assert_allclose(result.request(1)[:, 2], 3 * np.cos(t), atol=1e-9)
    np.testing.assert_allclose(result.request(1)[:, 3], -3 * np.sin(t), atol=1e-7)
    slide = BLOCK + "JOINT/1,TRANSLATIONAL,I=20,J=10\nREQUEST/1,F2=DZ(20,10)\\F3=MOTION(1,0,4,0)\n"
    result = run(model(slide + "MOTION/1,JOINT=1,TRANSLATION,ACCELERATION,FUNCTION=2*TIME"), 3.0)
    np.testing.assert_allclose(result.request(1)[:, 1], result.t**3 / 3, atol=1e-8)
    np.testing.assert_allclose(result.request(1)[:, 2], 4 * result.t, atol=1e-6)
    point = BLOCK + "JPRIM/1,ORIENTATION,I=20,J=10\nREQUEST/1,F2=DX(20,10)\n"
    result = run(model(point + "MOTION/1,I=20,J=10,X,ACCELERATION,ICVEL=-1,ICDISP=0.5,FUNCTION=SIN(TIME)"), 3.0)
    np.testing.assert_allclose(result.request(1)[:, 1], 0.5 - np.sin(result.t), atol=1e-8)


def test_angles_are_counted_between_distant_outputs():
    """100 rad/s seen every 0.25 s: about four turns between outputs."""
    body = BLOCK + "JOINT/1,REVOLUTE,I=20,J=10\nMOTION/1,JOINT=1,FUNCTION=100*TIME\nREQUEST/1,F2=AZ(20,10)\n"
    result = run(model(body), 2.0, 8)
    np.testing.assert_allclose(result.request(1)[:, 1], 100 * result.t, atol=1e-8)


def test_force_functions_on_both_sides():
    """Action and reaction: at I, at J and about J's own origin; a floating J stands where I is."""
    body = BLOCK + SECOND.replace("MARKER/30,PART=3", "MARKER/30,PART=3,QP=1,0,0") + "MARKER/12,PART=3,FLOATING\n"
    body += "GFORCE/1,I=20,JFLOAT=12,RM=10,FX=1\\FY=2\\FZ=3\\TX=4\\TY=5\\TZ=6\n"
    body += "SFORCE/1,TRANS,I=20,J=30,FUNCTION=7\nSFORCE/2,ROT,I=20,J=30,FUNCTION=2\n"
    request = "REQUEST/1,F2=GFORCE(1,0,2,0)\\F3=GFORCE(1,1,3,0)\\F4=GFORCE(1,1,8,0)"
    body += request + "\\F6=GFORCE(1,0,1,0)\\F7=GFORCE(1,0,5,0)\n"
    body += "REQUEST/2,F2=SFORCE(1,0,2,0)\\F3=SFORCE(1,1,2,0)\\F4=FX(20,30)\\F6=TZ(20,30)\\F7=FX(30,20)\n"
    result = run(model(body), 0.001, 1)
    np.testing.assert_allclose(result.request(1)[0, [1, 2, 3, 5, 6]], [1, -2, -6, 14**0.5, 77**0.5], atol=1e-12)
    # the line force pushes the block to the left; FX adds nothing of the torque
    np.testing.assert_allclose(result.request(2)[0, [1, 2, 3, 5, 6]], [-7, 7, -7, 2, 7], atol=1e-12)


def test_joint_force_about_its_other_marker():
    """A fixed joint with markers on one point: equal and opposite; weight and its moment on the wall."""
    body = BLOCK.replace("MARKER/20,PART=2", "MARKER/20,PART=2,QP=0.5,0,0") + "MARKER/21,PART=2\nACCGRAV/KGRAV=-10\n"
    request = "REQUEST/1,F2=JOINT(1,0,4,0)\\F3=JOINT(1,1,4,0)\\F4=JOINT(1,0,7,0)\\F6=JOINT(1,1,7,0)\n"
    body += "JOINT/1,FIXED,I=21,J=10\n" + request
    result = run(model(body), 0.1, 1)
    # 2 kg at 0.5 m: 20 N up and -10 N m about y hold it
    np.testing.assert_allclose(result.request(1)[0, [1, 2, 3, 5]], [20, -20, -10, 10], atol=1e-9)


def test_friction_of_a_joint_can_be_asked_for():
    """A sliding block: mu m g = 0.2 * 2 * 10 against the motion, at the I marker, and its opposite at J."""
    body = BLOCK.replace("PART/2,", "PART/2,VX=5,") + "MARKER/21,PART=2,REULER=90D,90D,0D\n"
    body += "MARKER/11,PART=1,REULER=90D,90D,0D\nJOINT/1,TRANSLATIONAL,I=21,J=11\nACCGRAV/KGRAV=-10\n"
    body += "FRICTION/1,JOINT=1,MU_STATIC=0.2,MU_DYNAMIC=0.2,MAX_STICTION_DEFORMATION=1E-6\n"
    result = run(model(body + "REQUEST/1,F2=FRICTION(1,0,2,0)\\F3=FRICTION(1,1,2,0)\\F4=VX(20)"), 0.5, 5)
    np.testing.assert_allclose(result.request(1)[1:, 1], -4.0, rtol=1e-5)
    np.testing.assert_allclose(result.request(1)[1:, 2], 4.0, rtol=1e-5)
    np.testing.assert_allclose(result.request(1)[:, 3], 5 - 2 * result.t, atol=1e-5)
