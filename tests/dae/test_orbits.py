"""Periodic orbits against shooting by an independent integrator, and laws that their multipliers obey."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from gearmbs.dae import NoOrbit
from gearmbs.mechanism import Mechanism, ModelError, steady_motion
from tests.says import says

TAU = 2.0 * np.pi


def oscillator(force: str) -> Mechanism:
    """Return a mass of 1 kg on a slide, with all six coordinates and the five constraints of the slide."""
    m = Mechanism("oscillator")
    mass = m.body("mass", mass=1.0, inertia=(1.0, 1.0, 1.0))
    m.translational("slide", mass, m.ground, at=(0, 0, 0), axis=(1, 0, 0))
    m.load("force", mass.marker(name="I"), m.ground.marker(name="J"), fx=force)
    return m


def reference(force, slope, damping, period, start):
    """Return start and monodromy matrix of an orbit of x'' = force(t, x, x'), by shooting with an explicit method."""

    def rates(t, z):
        x, v = z[:2]
        matrix = np.array([[0.0, 1.0], [slope(x), -damping]])
        return np.concatenate([[v, force(t, x, v)], (matrix @ z[2:].reshape(2, 2)).ravel()])

    def end(z):
        whole = np.concatenate([z, np.eye(2).ravel()])
        run = solve_ivp(rates, (0.0, period), whole, "DOP853", rtol=1e-12, atol=1e-13, max_step=period / 400)
        return run.y[:, -1]

    found = fsolve(lambda z: end(z)[:2] - z, start, xtol=1e-12)
    return found, end(found)[2:].reshape(2, 2)


def compared(motion, force, slope, damping):
    """Return by how much start and multipliers are off those of the reference."""
    solution = motion.solution
    start = np.array([solution.com_position("mass")[0, 0], solution.com_velocity("mass")[0, 0]])
    found, matrix = reference(force, slope, damping, motion.period, start)
    wanted = np.linalg.eigvals(matrix)
    wanted = wanted[np.argsort(-np.abs(wanted), kind="stable")]
    return np.abs(start - found).max(), np.abs(np.sort_complex(motion.multipliers) - np.sort_complex(wanted)).max()


@pytest.mark.slow
def test_a_duffing_oscillator_is_that_of_an_independent_shooting():
    motion = steady_motion(oscillator("0.3*COS(1.2*TIME)-0.1*VX(I,J)-DX(I,J)-DX(I,J)**3"), TAU / 1.2, tol=1e-9)
    off = compared(motion, lambda t, x, v: 0.3 * np.cos(1.2 * t) - 0.1 * v - x - x**3, lambda x: -1 - 3 * x * x, 0.1)
    assert motion.stable
    assert max(off) < 1e-6, off


@pytest.mark.slow
def test_a_piecewise_linear_oscillator_is_that_of_an_independent_shooting():
    force = "10+30*COS(6*TIME)-0.5*VX(I,J)-40*DX(I,J)-100*MAX(DX(I,J)-0.3,0)"
    motion = steady_motion(oscillator(force), TAU / 6.0, tol=1e-9)
    meets = motion.solution.com_position("mass")[:, 0] > 0.3
    assert meets.any()
    assert not meets.all()
    off = compared(
        motion,
        lambda t, x, v: 10 + 30 * np.cos(6 * t) - 0.5 * v - 40 * x - 100 * max(x - 0.3, 0),
        lambda x: -40.0 - (100.0 if x > 0.3 else 0.0),
        0.5,
    )
    assert max(off) < 2e-6, off


@pytest.mark.parametrize("damping", [0.05, 0.4])
def test_the_product_of_the_multipliers_is_what_damping_leaves_of_a_volume(damping):
    # Liouville: det M = exp(-damping T / mass), whatever the springs
    motion = steady_motion(oscillator(f"0.2*SIN(TIME)-{damping}*VX(I,J)-2*DX(I,J)-DX(I,J)**3"), TAU, tol=1e-9)
    assert abs(np.prod(motion.multipliers)) == pytest.approx(np.exp(-damping * TAU), rel=1e-6)


def test_harmonics_of_a_linear_oscillator_are_its_frequency_response():
    motion = steady_motion(oscillator("3*COS(2*TIME)-0.3*VX(I,J)-9*DX(I,J)"), TAU / 2.0, tol=1e-9)
    lines = motion.harmonics(lambda s: s.com_position("mass")[:, 0])
    wanted = 3.0 / (9.0 - 4.0 + 0.6j)
    assert lines[1] == pytest.approx(wanted, rel=1e-6)
    assert np.abs(lines[[0, 2, 3]]).max() < 1e-6 * abs(wanted)
    # multipliers of free vibrations are exp(lambda T)
    root = np.exp((-0.15 + 1j * np.sqrt(9.0 - 0.15**2)) * TAU / 2.0)
    assert np.sort_complex(motion.multipliers) == pytest.approx(np.sort_complex([root, root.conj()]), rel=1e-6)


def test_where_an_orbit_is_unstable_it_is_told_and_still_found_when_asked_for():
    # the inverted position of a pendulum is an orbit of any period
    m = oscillator("4*DX(I,J)-0.1*VX(I,J)")
    with pytest.raises(NoOrbit, match=says("orbit", "stable", "disturbances", "grow")):
        steady_motion(m, 1.0)
    found = steady_motion(m, 1.0, attracting=False)
    root = -0.05 + np.sqrt(4.0 + 0.05**2)
    assert not found.stable
    # nothing moves, so that the run's own steps say nothing of those that disturbances need: 64 even ones
    assert found.multipliers[0].real == pytest.approx(np.exp(root), rel=3e-3)


@pytest.mark.slow
def test_an_orbit_that_has_doubled_its_period_is_found_with_the_doubled_one():
    # Duffing with a soft well: the symmetric swing about one side has doubled its period at 0.29
    force = "0.29*COS(TIME)-0.5*VX(I,J)+DX(I,J)-DX(I,J)**3"
    m = oscillator(force)
    m.bodies["mass"].position[0] = 1.0
    try:
        motion = steady_motion(m, TAU, settle=30, most=400)
    except NoOrbit:
        pytest.fail("neither of one nor of two periods")
    assert motion.stable
    long = m.simulate(120 * TAU, t_eval=np.array([0.0, *(118 + np.arange(3)) * TAU]), tol=1e-9)
    x = long.com_position("mass")[1:, 0]
    doubled = abs(x[2] - x[1]) > 1e-3
    assert motion.period == pytest.approx(TAU * (2 if doubled else 1))


@pytest.mark.slow
def test_a_chaotic_motion_has_no_orbit_that_it_goes_to():
    # Ueda: x'' + 0.05 x' + x^3 = 7.5 cos t
    with pytest.raises(NoOrbit) as error:
        steady_motion(oscillator("7.5*COS(TIME)-0.05*VX(I,J)-DX(I,J)**3"), TAU, most=60, tol=1e-7)
    assert str(error.value)


def test_what_differs_between_the_ends_of_a_period_is_seen():
    # a half period of cos 2t and of sin t, and |sin t| in place of sin t: alike at the ends
    for force in ("COS(2*TIME)+0.05*SIN(TIME)-VX(I,J)-4*DX(I,J)", "SIN(TIME)-VX(I,J)-4*DX(I,J)"):
        with pytest.raises(ModelError, match=says("period", "equation", "loads")):
            steady_motion(oscillator(force), np.pi, attracting=False)
        assert steady_motion(oscillator(force), TAU).stable


@pytest.mark.parametrize("attracting", [True, False])
@pytest.mark.slow
def test_where_equations_jump_at_a_state_multipliers_are_not_known(attracting):
    """The jump is looked for in the orbit that was found; one with a width, and one out of reach, have multipliers."""
    settings = {"tol": 1e-8, "attracting": attracting}
    force = "3*COS(6*TIME)-2*VX(I,J)-40*DX(I,J)"
    with pytest.raises(NoOrbit, match=says("equations jump", "STEP")):
        steady_motion(oscillator(f"{force}+IF(DX(I,J): -1,0,1)"), TAU / 6.0, **settings)
    wide = steady_motion(oscillator(f"{force}+STEP(DX(I,J),-0.01,-1,0.01,1)"), TAU / 6.0, **settings)
    assert wide.stable
    # a linear oscillator leaves exp(-c T / 2m) of a disturbance
    away = steady_motion(oscillator(f"{force}+IF(DX(I,J)-0.5: 0,0,1)"), TAU / 6.0, **settings)
    np.testing.assert_allclose(np.abs(away.multipliers), np.exp(-TAU / 6.0), rtol=1e-5)


def test_stability_is_that_of_the_orbit_and_not_of_motions_near_it():
    # a second mass whose stiffness follows the first: Mathieu's equation, unstable by a parametric resonance
    m = oscillator("COS(TIME)-VX(I,J)-4*DX(I,J)")
    other = m.body("other", mass=1.0, inertia=(1.0, 1.0, 1.0))
    m.translational("slide 2", other, m.ground, at=(0, 0, 0), axis=(1, 0, 0))
    i, j = other.marker(name="K"), m.ground.marker(name="L")
    # x = a cos(t + phase), a = 1 / sqrt(10)
    m.load("force 2", i, j, fx="-0.02*VX(K,L)-(0.25+1.5*DX(I,J))*DX(K,L)")
    motion = steady_motion(m, TAU, attracting=False, tol=1e-8)
    assert not motion.stable
    assert not motion.stable
    assert abs(motion.multipliers[0]) > 1.05
    with pytest.raises(NoOrbit):
        steady_motion(m, TAU, most=30, tol=1e-8)


def test_a_period_that_is_none_of_the_loads_is_refused_and_its_multiple_is_not():
    m = oscillator("COS(2*TIME)-0.5*VX(I,J)-9*DX(I,J)")
    with pytest.raises(ModelError, match=says("period", "3 s", "equation", "loads")):
        steady_motion(m, 3.0)
    twice = steady_motion(m, TAU, tol=1e-9)
    assert abs(twice.harmonics(lambda s: s.com_position("mass")[:, 0], every=2)[1]) == pytest.approx(
        abs(1.0 / (5.0 + 1.0j)), rel=1e-5
    )


def test_a_state_of_the_orbit_goes_on_along_it():
    m = oscillator("COS(2*TIME)-0.5*VX(I,J)-9*DX(I,J)-20*DX(I,J)**3")
    motion = steady_motion(m, np.pi, tol=1e-9)
    run = m.simulate(10 * np.pi, t_eval=np.pi * np.arange(11), initial=motion.state, tol=1e-9)
    assert np.ptp(run.com_position("mass")[:, 0]) < 1e-6


@pytest.mark.parametrize(("period", "said"), [(0.0, "positive"), (-1.0, "positive"), (np.nan, "finite")])
def test_a_period_is_positive(period, said):
    with pytest.raises(ModelError, match=says("period", "s", said)):
        steady_motion(oscillator("-DX(I,J)"), period)


@pytest.mark.parametrize("force", ["1", "COS(3*TIME)"])
@pytest.mark.parametrize(("stiffness", "damping"), [(20.0, 0.2), (20.0, -0.02), (200.0, 0.2), (200.0, -0.02)])
def test_multipliers_of_motions_that_hardly_move(force, stiffness, damping):
    """Disturbances swing faster than anything that steps are chosen for; exp(-c T / 2 m) is left of them."""
    m = oscillator(f"{force}-({damping})*VX(I,J)-{stiffness}*DX(I,J)")
    motion = steady_motion(m, TAU / 3.0, attracting=False, settle=0)
    np.testing.assert_allclose(np.abs(motion.multipliers), np.exp(-damping * TAU / 6.0), rtol=4e-3)
    assert motion.stable == (damping > 0.0)
