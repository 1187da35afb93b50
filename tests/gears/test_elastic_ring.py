"""A ring whose rim bends: derivatives, closed forms, energy, the rigid limit, and what a fixed sensor sees."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.gears import ContactLaw, ElasticRim, GearSpec, PlanetarySet, RimModes, planetary_mechanism
from tests.says import says

GEARS = PlanetarySet(
    GearSpec(28, "2 mm", face_width="20 mm"),
    GearSpec(36, "2 mm", face_width="20 mm"),
    GearSpec.ring(100, "2 mm", face_width="20 mm", rim_thickness="6 mm"),
    planets=4,
    contact=ContactLaw.impact(),
)
BOLTED = ElasticRim(waves=5, bolts=np.arange(6) * np.pi / 3, bolt_stiffness=(3e7, 3e7))
SUN = 1800 * np.pi / 30
CARRIER = SUN * 28 / 128


def mechanism(rim):
    return planetary_mechanism(GEARS, speeds={"sun": SUN}, torques={"carrier": -200.0}, run_up=0.0, rim=rim)


def test_modes_of_a_free_rim():
    modes = RimModes.of(ElasticRim(waves=30, damping_ratio=0.0), GEARS.ring)
    thickness, width, radius = 6e-3, 20e-3, GEARS.ring.root_radius + 3e-3
    area, second = thickness * width, width * thickness**3 / 12
    n = np.arange(2.0, 31)
    closed = np.sqrt(
        2.1e11 * second * n**2 * (n**2 - 1) ** 2 / (GEARS.ring.material.density * area * radius**4 * (n**2 + 1))
    )
    np.testing.assert_allclose(modes.frequencies[::2], closed / (2 * np.pi), rtol=1e-12)
    # a ring pinched across a diameter shortens it by (pi/4 - 2/pi) F R^3 / E I
    (w, _), (other, _) = modes.shapes(0.0), modes.shapes(np.pi)
    q = np.linalg.solve(modes.stiffness, -(w + other))
    found = -(w + other) @ q * 2.1e11 * second / radius**3
    np.testing.assert_allclose(found, np.pi / 4 - 2 / np.pi, rtol=1e-4)


@pytest.mark.parametrize("planets", [1, 4])
def test_derivatives_of_the_element(planets):
    from gearmbs.contact.ring.kernel import ring_meshes as kernel
    from gearmbs.kernels.pointers import address

    gears = PlanetarySet(GEARS.sun, GEARS.planet, GEARS.ring, planets=planets, contact=GEARS.contact)
    element = planetary_mechanism(gears, torques={"carrier": -200.0}, rim=BOLTED).elements["ring meshes"]
    made, n, m = element.compiled(), planets, element.modes.mass.size
    ints = np.concatenate([[address(*made.functions[0])], made.integers]).astype(np.int64)
    rng = np.random.default_rng(1)
    frames, states = np.zeros((n + 1, 18)), 0.004 * rng.standard_normal(2 * m)
    states[m:] *= 50
    wrenches = n + 1 if n > 1 else 1
    for k, marker in enumerate(element.markers):
        turn = Rotation.from_rotvec([0, 0, -3e-4 if k < n else 0.0]).as_matrix()
        frames[k, :3], frames[k, 3:12] = marker.global_position(), (turn @ marker.global_orientation()).ravel()
        frames[k, 12:] = rng.standard_normal(6) * np.repeat([0.1, 2.0], 3)

    def call(given, z, want=0):
        wrench, rates, told = np.zeros((wrenches, 6)), np.zeros(2 * m), np.zeros(len(element.diagnostics))
        jac = np.zeros((6 * wrenches + 2 * m, 12 * (n + 1) + 2 * m))
        kernel(ints, np.array(made.reals), 0.0, given, z, np.zeros(0), want, np.zeros(made.scratch), wrench, rates, jac,
               told)  # fmt: skip
        return np.concatenate([wrench.ravel(), rates]), jac, told

    value, exact, told = call(frames, states, 1)
    assert np.count_nonzero(told[3 : 3 + n]) >= max(1, n - 1)
    found = np.zeros_like(exact)

    def moved(column, step):
        given, z, k, q = frames.copy(), states.copy(), column // 12, column % 12
        if k > n:
            z[column - 12 * (n + 1)] += step
        elif 3 <= q < 6:
            turn = Rotation.from_rotvec(step * np.eye(3)[q - 3]).as_matrix()
            given[k, 3:12] = (turn @ frames[k, 3:12].reshape(3, 3)).ravel()
        else:
            given[k, q if q < 3 else q + 6] += step
        return call(given, z)[0]

    for c in range(exact.shape[1]):
        h = 2e-9 if c < 12 * (n + 1) and c % 12 < 6 else 1e-4
        found[:, c] = (8 * (moved(c, h) - moved(c, -h)) - (moved(c, 2 * h) - moved(c, -2 * h))) / (12 * h)
    scale = np.abs(found).max(axis=1, keepdims=True) + 1e-9
    np.testing.assert_allclose(exact / scale, found / scale, atol=2e-6)
    if n > 1:
        # forces balance, moments about the ring's centre too
        wrench = value[: 6 * wrenches].reshape(-1, 6)
        arms = frames[:, :3] - frames[n, :3]
        np.testing.assert_allclose(wrench[:, :3].sum(axis=0), 0.0, atol=1e-8)
        np.testing.assert_allclose((wrench[:, 3:] + np.cross(arms, wrench[:, :3])).sum(axis=0), 0.0, atol=1e-8)


def lines(x, orders, turns):
    t = turns * np.arange(x.size) / x.size
    return np.array([2 * abs(np.mean((x - x.mean()) * np.exp(-2j * np.pi * order * t))) for order in orders])


@pytest.mark.slow
def test_sidebands_of_the_carrier_at_a_fixed_sensor():
    """The rim's sensor hears orders 96 and 104, those of a rigid ring's seat nothing; energy is kept in both."""
    turns, points, begin = 1, 4096, 0.04
    span = turns * 2 * np.pi / CARRIER
    rigid, elastic = mechanism(None), mechanism(BOLTED)
    heard = {}
    for name, m in (("rigid", rigid), ("elastic", elastic)):
        found = m.simulate(begin + span, rate=points / span, tol=1e-6, rate_scale=1.0)
        assert found.success
        balance = found.energy_balance()
        assert abs(balance["imbalance"]).max() < 1e-4 * abs(balance["work_motion"]).max()
        last = slice(found.t.size - 1 - points, found.t.size - 1)
        heard[name] = found.reaction("ring seat")[0][last, 0]
        if m is elastic:
            motion = elastic.elements["ring meshes"].rim_motion(found, 0.3)["radial_velocity"][last]
    mean = 200.0 / (GEARS.carrier_radius * 4)
    # planets are alike and equally spaced: a rigid ring on a rigid seat carries no radial force
    assert lines(heard["rigid"], (4, 96, 104), turns).max() < 1e-5 * mean
    passing, lower, mesh, upper = lines(motion, (4, 96, 100, 104), turns)
    assert min(passing, lower, upper) > 50 * mesh
    assert 1e-4 < lower < 1e-2
    assert 1e-4 < upper < 1e-2
    others = lines(motion, (95, 97, 98, 99, 101, 102, 103, 105), turns)
    assert others.max() < 0.02 * min(lower, upper)


@pytest.mark.slow
def test_a_stiff_rim_is_a_rigid_ring():
    stiff = ElasticRim(waves=3, youngs_modulus=2.1e15, damping_ratio=1.0)
    forces = []
    for rim in (None, stiff):
        found = mechanism(rim).simulate(0.01, rate=2000, tol=1e-8)
        told = found.diagnostics("planet 1-ring")["normal_force"] if rim is None else (
            found.diagnostics("ring meshes")["normal_force_1"]
        )  # fmt: skip
        forces.append(told)
    np.testing.assert_allclose(forces[1], forces[0], atol=2e-3 * forces[0].max())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(thickness="-1 mm"), says("thickness", "-0.001", "0", "give more")),
        (dict(waves=1), says("waves", "1", "2", "30", "give a whole number")),
        (dict(damping_ratio=-0.1), says("damping_ratio", "-0.1", "give 0")),
        (dict(bolt_stiffness=(1.0,)), "give two numbers"),
    ],
)
def test_wrong_rims_are_named(changes, message):
    with pytest.raises(ValueError, match=message):
        ElasticRim(**changes)


def test_where_a_rim_cannot_bend():
    with pytest.raises(ValueError, match=says("rim", "ring", "held", "bend")):
        planetary_mechanism(GEARS, held="carrier", speeds={"sun": 10.0}, rim=BOLTED)
    ideal = PlanetarySet(GEARS.sun, GEARS.planet, GEARS.ring, planets=4, ideal=(1e8, 1e8))
    with pytest.raises(ValueError, match="needs tooth contact"):
        planetary_mechanism(ideal, rim=BOLTED)
