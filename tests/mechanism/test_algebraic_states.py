"""Algebraic states of mechanisms at outputs: with turns that are counted, smooth or with a pulse no step has seen."""

import re
import warnings

import numpy as np
import pytest

from gearmbs.mechanism import Mechanism
from tests.generators import cases, seed
from tests.says import says

INTEGRATORS = ("WSTIFF", "GSTIFF", "IDA")


def wheel():
    """A wheel of 5 turns with its angle as a state."""
    m = Mechanism("wheel")
    body = m.body("wheel", mass=1.0, inertia=(0.1, 0.1, 0.1), angular_velocity=(0.0, 0.0, 10.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torsion_spring("coil", m.joints["pin"].i, m.joints["pin"].j, stiffness=0.01, damping=0.001)
    m.algebraic_state("angle", "AZ(pin.I, pin.J)")
    return m


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_state_of_an_angle_counts_its_turns(integrator):
    """At outputs, and in the dense output in any order."""
    times = np.linspace(0.0, 3.0, 31)
    options = {} if integrator == "IDA" else {"dense_output": True}
    solution = wheel().simulate(3.0, t_eval=times, integrator=integrator, **options)
    angle = solution.joint_angle("pin")
    assert angle.max() > 8.0 * np.pi
    np.testing.assert_allclose(solution.state("angle"), angle, atol=1e-12)
    if not options:
        return
    column = solution.problem.names.index("z(angle)")
    sol = solution.result.sol
    np.testing.assert_allclose(sol(times)[:, column], angle, atol=1e-9)
    np.testing.assert_allclose(sol(times[::-1])[::-1, column], angle, atol=1e-9)
    for k in (29, 3, 17, 30):
        assert sol(times[k])[column] == pytest.approx(angle[k], abs=1e-9)


def test_turns_are_counted_through_changes_of_coordinates():
    """A body that tumbles about a spinning one: Euler angles change their reference, the angle goes on."""
    m = Mechanism("tumbling", gravity=(0.0, 0.0, -9.81))
    body = m.body("top", mass=1.0, inertia=(0.02, 0.03, 0.045), angular_velocity=(9.0, 2.0, 4.0))
    m.spherical("foot", body, m.ground, at=(0, 0, 0))
    disc = m.body("disc", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(1, 0, 0), angular_velocity=(0, 0, 30.0))
    m.revolute("pin", disc, m.ground, at=(1, 0, 0), axis=(0, 0, 1))
    m.algebraic_state("angle", "AZ(pin.I, pin.J)")
    solution = m.simulate(1.0, rate=50.0, dense_output=True)
    assert len(solution.result.epochs) > 1
    rng = np.random.default_rng(seed())
    times = rng.permutation(solution.t)
    column = solution.problem.names.index("z(angle)")
    np.testing.assert_allclose(solution.result.sol(times)[:, column], 30.0 * times, atol=1e-6)


def smooth(rng, pulse=""):
    """A pendulum, a slider crank or a wheel with algebraic states; ``pulse`` is added to a torque given by one."""
    m = Mechanism("smooth", gravity=(0.0, -9.81, 0.0))
    kind, arm, length = int(rng.integers(3)), rng.uniform(0.05, 0.15), rng.uniform(0.3, 0.6)
    crank = m.body("crank", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(0.5 * arm, 0, 0))
    m.revolute("main", crank, m.ground, axis=(0, 0, 1))
    main = "main.I, main.J"
    if kind > 0:
        rod = m.body("rod", mass=0.5, inertia=(0.01, 0.01, 0.01), position=(arm + 0.5 * length, 0, 0))
        m.revolute("pin", rod, crank, at=(arm, 0, 0), axis=(0, 0, 1))
    if kind > 1:
        block = m.body("block", mass=2.0, inertia=(0.01, 0.01, 0.01), position=(arm + length, 0, 0))
        m.spherical("wrist", rod, block, at=(arm + length, 0, 0))
        m.translational("guide", block, m.ground, at=(arm + length, 0, 0), axis=(1, 0, 0))
        m.differential_state("lag", "20*(DX(guide.I, guide.J) - DIF(lag))")
        m.algebraic_state(
            "squeeze", f"{rng.uniform(10, 80)}*TANH({rng.uniform(5, 60)}*VX(guide.I, guide.J)) + DIF(lag)"
        )
    m.torsion_spring("coil", m.joints["main"].i, m.joints["main"].j, stiffness=rng.uniform(0.05, 0.5), damping=0.001)
    teeth = int(rng.integers(1, 9))
    m.algebraic_state("ratchet", f"{rng.uniform(1, 9)}*TANH({rng.uniform(3, 30)}*SIN({teeth}*AZ({main})))")
    m.algebraic_state("push", f"{rng.uniform(2, 12)} - 0.1*WZ({main}){pulse}")
    m.axis_torque("drive", m.joints["main"].i, m.joints["main"].j, "VARVAL(push)")
    return m


@pytest.mark.slow
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_only_what_no_step_has_seen_is_told(integrator):
    """Pulses of 1 us to 100 us with an output at their top, which the steps pass, and the same without."""
    for k in range(cases(6)):
        rng = np.random.default_rng((seed(), k))
        tol, width, at = 10.0 ** rng.uniform(-7, -4), 10.0 ** rng.uniform(-6, -4), rng.uniform(0.1, 0.25)
        chosen = rng.integers(1 << 30)
        times = np.sort(np.append(np.linspace(0.0, 0.3, 301), at))
        options = {"t_eval": times, "tol": tol, "integrator": integrator}
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            solution = smooth(np.random.default_rng(chosen)).simulate(0.3, **options)
        assert solution.success, solution.message
        pulse = f" + {1.0 / width:.6g}*EXP(-((TIME - {at})/{width})**2)"
        right = smooth(np.random.default_rng(chosen), pulse).simulate(
            0.3, t_eval=times, tol=1e-7, breakpoints=[at - 6.0 * width, at, at + 6.0 * width]
        )
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            passed = smooth(np.random.default_rng(chosen), pulse).simulate(0.3, **options)
        # at the top of the pulse the state is what its expression says, whether the steps have seen it or not
        assert passed.state("push")[times == at] > 0.9 / width
        if caught:
            assert re.search(says("lies within a step", "push", "breakpoints", "max_step"), str(caught[0].message))
        else:
            angle = passed.joint_angle("main")[-1]
            assert angle == pytest.approx(right.joint_angle("main")[-1], rel=1e-2)
