"""Measures between markers against independently written kinematics, and every derivative."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from .support import MARKER_BODY, MARKERS, World, Y

I, J, K, L = 0, 1, 2, 3


@pytest.fixture(scope="module")
def world() -> World:
    return World(3)


def test_displacements(world):
    r = world.position(I) - world.position(J)
    for axis, letter in enumerate("XYZ"):
        assert world.value(world.compile(f"D{letter}(1,2,3)")) == pytest.approx(world.axes(K)[:, axis] @ r, rel=1e-13)
        assert world.value(world.compile(f"D{letter}(1,2)")) == pytest.approx(r[axis], rel=1e-13)
        assert world.value(world.compile(f"D{letter}(1)")) == pytest.approx(world.position(I)[axis], rel=1e-13)
    assert world.value(world.compile("DM(1,2)")) == pytest.approx(np.linalg.norm(r), rel=1e-13)
    assert world.value(world.compile("dm(1, cm)")) == pytest.approx(np.linalg.norm(r), rel=1e-13)


def test_velocities(world):
    r = world.position(I) - world.position(J)
    u = world.velocity(I) - world.velocity(J)
    seen = u - np.cross(world.omega(L), r)
    for axis, letter in enumerate("XYZ"):
        e = world.axes(K)[:, axis]
        assert world.value(world.compile(f"V{letter}(1,2,3)")) == pytest.approx(e @ u, rel=1e-13)
        assert world.value(world.compile(f"V{letter}(1,2,3,4)")) == pytest.approx(e @ seen, rel=1e-13)
        spin = world.omega(I) - world.omega(J)
        assert world.value(world.compile(f"W{letter}(1,2,3)")) == pytest.approx(e @ spin, rel=1e-13)
    assert world.value(world.compile("VM(1,2,4)")) == pytest.approx(np.linalg.norm(seen), rel=1e-13)
    assert world.value(world.compile("WM(1,2)")) == pytest.approx(np.linalg.norm(spin), rel=1e-13)
    assert world.value(world.compile("VR(1,2)")) == pytest.approx(u @ r / np.linalg.norm(r), rel=1e-13)


@pytest.mark.slow
def test_accelerations_are_the_rates_of_velocities(world):
    # d/dt of a relative velocity along axes fixed in frame l is the acceleration seen in l
    w = world.omega(L)
    r = world.position(I) - world.position(J)
    u = world.velocity(I) - world.velocity(J)
    a = world.acceleration(I) - world.acceleration(J)
    v_rel = u - np.cross(w, r)
    a_rel = a - np.cross(world.alpha(L), r) - 2 * np.cross(w, v_rel) - np.cross(w, np.cross(w, r))
    spin = world.omega(I) - world.omega(J)
    alpha_rel = world.alpha(I) - world.alpha(J) - np.cross(w, spin)
    for axis, letter in enumerate("XYZ"):
        e = world.axes(K)[:, axis]
        assert world.request(world.compile(f"ACC{letter}(1,2,3)", True)) == pytest.approx(e @ a, rel=1e-12)
        assert world.request(world.compile(f"ACC{letter}(1,2,3,4)", True)) == pytest.approx(e @ a_rel, rel=1e-12)
        assert world.request(world.compile(f"WDT{letter}(1,2,3,4)", True)) == pytest.approx(e @ alpha_rel, rel=1e-12)
    assert world.request(world.compile("ACCM(1,2,4)", True)) == pytest.approx(np.linalg.norm(a_rel), rel=1e-12)
    assert world.request(world.compile("WDTM(1)", True)) == pytest.approx(np.linalg.norm(world.alpha(I)), rel=1e-12)


def test_small_turns_have_the_sign_of_the_axis(world):
    # marker 10 is on the ground: turn body 1 so that marker 1 is turned by 0.1 about an axis of marker 10
    for axis, letter in enumerate("XYZ"):
        other = World(4)
        turn = np.zeros(3)
        turn[axis] = 0.1
        wanted = other.axes(4) @ Rotation.from_rotvec(turn).as_matrix()
        body = wanted @ other.frames[0, 3:].reshape(3, 3).T
        other.kin[1, 6:15] = body.ravel()
        assert other.value(other.compile(f"A{letter}(1,10)")) == pytest.approx(0.1, abs=1e-14)


@pytest.mark.parametrize("system", range(1, 13))
def test_orient_sequences(world, system):
    sequence = ("XYZ YZX ZXY XZY YXZ ZYX XYX XZX YXY YZY ZXZ ZYZ").split()[system - 1]
    relative = world.axes(J).T @ world.axes(I)
    angles = [world.value(world.compile(f"ORIENT({system},{c},1,2)")) for c in (1, 2, 3)]
    # the angles must rebuild the rotation, with the second in its principal range
    np.testing.assert_allclose(Rotation.from_euler(sequence, angles).as_matrix(), relative, atol=1e-14)


def test_named_angles(world):
    relative = Rotation.from_matrix(world.axes(J).T @ world.axes(I))
    psi, theta, phi = (world.value(world.compile(f"{n}(1,2)")) for n in ("PSI", "THETA", "PHI"))
    np.testing.assert_allclose([psi, theta, phi], relative.as_euler("ZXZ"), atol=1e-13)
    yaw, pitch, roll = (world.value(world.compile(f"{n}(1,2)")) for n in ("YAW", "PITCH", "ROLL"))
    np.testing.assert_allclose([yaw, -pitch, roll], relative.as_euler("ZYX"), atol=1e-13)


@pytest.mark.parametrize("seed", range(12))
def test_euler_parameters(seed):
    world = World(seed)
    x, y, z, w = Rotation.from_matrix(world.axes(J).T @ world.axes(I)).as_quat(canonical=True)
    got = [world.value(world.compile(f"ORIENT(27,{c},1,2)")) for c in (1, 2, 3, 4)]
    np.testing.assert_allclose(got, [w, x, y, z], atol=1e-13)


def test_angles_count_full_turns(world):
    tape = world.compile("AZ(1,10)")
    principal = world.value(tape)
    assert -np.pi < principal <= np.pi
    for turns in (-3, -1, 1, 5):
        ref = np.array([principal + 2 * np.pi * turns + 2.9])
        assert world.value(tape, ref=ref) == pytest.approx(principal + 2 * np.pi * turns, abs=1e-12)


SMOOTH = [
    "DX(1,2,3)", "DY(1)", "DM(1,2)", "DM(1,10)", "AX(1,2)", "AY(1,2)", "AZ(1,10)", "PSI(1,2)", "THETA(1,2)",
    "PHI(1,2)", "YAW(1,2)", "PITCH(1,2)", "ROLL(1,2)", "DZ(1,2,1)", "DZ(1,2,2)",
    "SIN(DX(1,2,3))*DM(2,3)**1.7/(2+COS(AZ(1,2)))+TIME*DY(1,2)**2", "DX(1,4,2)*DX(1,2,3)",
    "IF(DX(1,2)-9: DM(1,2)**3, 1, 2)+MAX(DX(1),DY(1),DZ(1))", "ATAN2(DX(1,2),DY(1,2))*EXP(-DZ(1,2,3)*TIME)",
    "CUBSPL(DX(1,2,3),0,7)*AKISPL(DM(1,2),DZ(1),8)",
]  # fmt: skip
RATES = [
    "VX(1,2,3,4)", "VY(1,2,3)", "VZ(1)", "VM(1,2)", "VM(1,2,4)", "VR(1,2)", "VR(1,10)", "WX(1,2,3)", "WZ(1,10,1)",
    "WM(1,2)", "VX(1,4,2,2)", "VY(1,2,1,1)", "VZ(2,4,2,2)",
    "IMPACT(DX(1,2,3),VX(1,2,3),5,1E3,1.5,20,0.1)", "BISTOP(DX(1,2),VX(1,2),-9,-8,1E3,1.3,20,40)",
    "-100*(DM(1,2)-2)-VR(1,2)*ABS(VR(1,2))+STEP(TIME,0,0,1,WM(1,2))",
]  # fmt: skip
ALGEBRAIC = [
    "DIF(5)*DX(1,2)", "VARVAL(9)**2+SIN(DIF(5))", "JOINT(1,0,2,3)", "JOINT(1,1,7,2)*VX(1,2)", "JOINT(1,0,1)",
    "SFORCE(2,0,5,3)", "FX(1,2,3)", "FM(1,2)",
]  # fmt: skip


def tables(world: World):
    from gearmbs.dae.equations.expressions import SplineData

    x = (-3.0, -1.0, 0.0, 0.5, 2.0, 3.0)
    flat = SplineData(x, ((1.0, 0.2, -0.3, 0.4, 1.5, 0.0),))
    surface = SplineData(x, ((1.0, 0.2, -0.3, 0.4, 1.5, 0.0), (0.0, 1.0, 0.5, 0.25, -1.0, 2.0)), (-2.0, 2.0))
    return {
        "splines": {7: flat, 8: surface},
        "variables": {4: "DX(1,2)"},
        "states": frozenset({9}),
        "diffs": {5: "DX(1,2)"},
        "forces": {("joint", 1): (1, 2), ("sforce", 2): (2, 1)},
    }


def bound(world: World, text: str):
    tape = world.compile(text, **tables(world))
    order = {key: n % len(Y) for n, key in enumerate(tape.algebraic)}
    return tape.bind(lambda key: order[key])


@pytest.mark.parametrize("text", SMOOTH + RATES + ALGEBRAIC)
def test_gradient_against_differences(world, text):
    tape = bound(world, text)
    value, gradient = world.gradient(tape)
    assert value == world.value(tape)
    expected = world.gradient_by_differences(tape)
    np.testing.assert_allclose(gradient, expected, atol=2e-8 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("text", SMOOTH)
def test_hessian_against_differences(world, text):
    """Gradient in (R, theta, t) against the value, Hessian against the gradient."""
    tape = bound(world, text)
    assert tape.second_order
    _, gradient, hessian = world.second(tape)
    n = tape.second_size
    h = 1e-6

    def shifted(q: int, sign: float) -> tuple[float, np.ndarray]:
        other = World(3)
        t = 0.4
        if q == n - 1:
            t += sign * h
        else:
            other.coordinates[tape.bodies[q // 6], q % 6] += sign * h
            other.kin = other.table()
        return other.value(tape, t), other.second(tape, t)[1]

    for q in range(n):
        (f1, g1), (f0, g0) = shifted(q, 1.0), shifted(q, -1.0)
        assert gradient[q] == pytest.approx((f1 - f0) / (2 * h), abs=1e-7 * max(1.0, abs(gradient).max()))
        np.testing.assert_allclose(hessian[q], (g1 - g0) / (2 * h), atol=1e-7 * max(1.0, np.abs(hessian).max()))
    np.testing.assert_allclose(hessian, hessian.T, atol=1e-12 * np.abs(hessian).max())


def test_coincident_points_have_finite_derivatives():
    world = World(1)
    world.frames[1] = world.frames[3]  # markers 2 and 4 coincide on body 2
    for text in ("DM(2,4)", "VR(2,4)", "VM(2,4)", "SQRT(DX(2,4)**2+DY(2,4)**2)"):
        value, gradient = world.gradient(world.compile(text))
        assert value == 0.0
        np.testing.assert_array_equal(gradient, 0.0)


def test_forces_between_markers_add_up(world):
    # joint 1 acts on I = 1 (components 0..2), sforce 2 has I = 2, J = 1: its J side (6..8) is on marker 1
    tape = world.compile("FY(1,2)", **tables(world))
    assert tape.algebraic == tuple((*element, c) for element, base in ((("joint", 1), 0), (("sforce", 2), 6))
                                   for c in range(base, base + 3))  # fmt: skip
    tape = tape.bind(lambda key: tape.algebraic.index(key))
    assert world.value(tape) == pytest.approx(Y[1] + Y[4])


def test_marker_table_is_consistent():
    assert len(set(MARKERS.values())) == len(MARKER_BODY)


def test_rates_of_counted_angles(world):
    """Against differences of the angle along the motion."""
    from gearmbs.dae.equations.expressions import angle_rates

    tape = world.compile("AZ(1,10)*2+SIN(AX(1,2))")
    rates, grad = np.zeros(2), np.zeros(tape.gradient_size)
    ref, work = np.zeros(2), np.zeros(tape.work_size)
    angle_rates(tape.ints, tape.floats, 0.0, world.kin, MARKER_BODY, world.frames, Y, ref, rates, grad, work)
    h = 1e-6
    for text in ("AZ(1,10)", "AX(1,2)"):
        single = world.compile(text)
        ends = []
        for s in (h, -h):
            kin = world.kin.copy()
            for b in (1, 2):
                kin[b, :3] += s * kin[b, 3:6]
                turned = Rotation.from_rotvec(s * kin[b, 15:18]).as_matrix() @ world.rotation(b)
                kin[b, 6:15] = turned.ravel()
            ends.append(world.value(single, kin=kin))
        assert np.abs(rates - (ends[0] - ends[1]) / (2 * h)).min() < 1e-8
