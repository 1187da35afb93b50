"""Bodies with modal coordinates: exact derivatives, conservation, closed forms, limits."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from gearmbs.dae.equations import jacobian as exact
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.residual import residual
from gearmbs.dae.equations.unknowns import FORMULATIONS
from gearmbs.dae.model.model import Configuration
from gearmbs.mechanism import Mechanism, Mode, ModelError, ShapeIntegrals, linear_modes, static_equilibrium
from tests.says import says

POINTS = np.array(
    [[0.3, 0.0, 0.0], [-0.3, 0.05, 0.0], [0.0, 0.2, 0.1], [0.0, -0.2, 0.05], [0.05, 0.0, -0.2], [-0.05, -0.05, 0.05]]
)
MASSES = np.array([0.7, 0.8, 0.5, 0.6, 0.4, 0.3])
RNG = np.random.default_rng(5)
BENT = RNG.standard_normal((2, 6, 3))


def cloud(shift: bool = True) -> dict:
    """A body of six mass points with two arbitrary shapes."""
    com = MASSES @ POINTS / MASSES.sum()
    arms = POINTS - com
    inertia = sum(m * ((s @ s) * np.eye(3) - np.outer(s, s)) for m, s in zip(MASSES, arms))
    return {
        "mass": MASSES.sum(),
        "inertia": inertia,
        "com": com,
        "integrals": ShapeIntegrals.of_points(MASSES, arms, BENT),
    }


def shapes(point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shapes at any point: those of the nearest mass point, with some rotation."""
    k = int(np.argmin(np.linalg.norm(POINTS - point, axis=1)))
    turned = np.cross(BENT[:, k], [0.3, -0.5, 0.8])
    return BENT[:, k], turned


def with_cloud(name: str = "cloud", modes: int = 2, **where):
    """A mechanism with the body of mass points alone."""
    m = Mechanism(name)
    given = cloud()
    body = m.modal_body(
        "cloud", given["mass"], given["inertia"],
        [Mode(stiffness=300.0 * (k + 1), start=0.03, rate=-0.2) for k in range(modes)], shapes,
        com=given["com"], integrals=given["integrals"], **where,
    )  # fmt: skip
    return m, body


def joined(kind: str) -> Mechanism:
    """The body of mass points, joined to a rigid one or to the ground by one thing of each kind."""
    m, body = with_cloud(position=(0.1, 0.2, -0.1))
    other = m.body("block", 2.0, [0.02, 0.03, 0.04], position=(0.5, 0.1, 0.2))
    i, j = body.marker(POINTS[0], [0.3, 0.7, -0.2], name="I"), other.marker((0.1, 0.05, 0.2), [0.1, 0.4, 0.3], name="J")
    k = body.marker(POINTS[2], [1.0, 0.5, 0.3], name="K")
    g = m.ground.marker((0.3, 0.3, 0.3), name="G")
    if kind == "spring":
        m.spring_damper("s", i, j, stiffness=50.0, damping=3.0)
        m.spring_damper("own", k, g, stiffness=20.0, damping=1.0)
        m.spring_damper("inside", i, k, stiffness=20.0, damping=1.0)
    elif kind == "bushing":
        m.bushing("b", j, i, stiffness=(10.0, 20.0, 30.0), damping=(1.0, 2.0, 3.0))
    elif kind == "load":
        m.load("l", i, j, rm=k, fx="3*DX(I,J,K)*TIME", fy="VM(I,J)", tz="2*AZ(I,J)+WY(I,J,J)")
        m.load("back", j, i, fz="DM(I,J)")
    elif kind == "load along a marker that it does not ask for":
        m.load("l", i, j, rm=k, fx="3*TIME", tz="DM(J,G)")
        m.line_force("line", k, g, "2*TIME")
    elif kind == "reaction":
        m.joint("inline", "slide", i, j)
        m.distance("rod", k, g)
        m.load("l", j, g, fx="JOINT(slide,0,2,0)", fy="GCON(rod,0,2,0)")
    elif kind == "expression":
        m.general_constraint("g", "DX(I,J)*DM(I,G)-0.3*DY(K,G)+SIN(TIME)")
        m.differential_state("w", "DM(I,K)+VZ(K,G)")
    elif kind == "distance":
        m.distance("d", i, j)
    elif kind == "rotation":
        m.rotation("turn", m.revolute("r", i, j), "2*TIME")
    elif kind == "screw":
        m.screw("sc", i, j, pitch=0.03)

    elif kind == "both ends":
        m.spherical("a", i, g)
        m.planar("u", k, j)
    else:
        m.joint(kind, "j", i, j)
    return m


KINDS = [
    "spring", "bushing", "load", "load along a marker that it does not ask for", "expression", "reaction", "distance",
    "rotation", "screw", "both ends", "fixed", "revolute", "spherical", "cylindrical", "translational", "planar",
]  # fmt: skip


@pytest.mark.parametrize("formulation", list(FORMULATIONS))
@pytest.mark.parametrize("kind", KINDS)
def test_jacobian_equals_central_differences(kind, formulation):
    model = joined(kind).compile().model
    form = FORMULATIONS[formulation]
    idata, rdata, size = model.pack(form)
    indptr, indices, slots = exact.pattern(idata, rdata, size, 0.0, np.zeros(int(idata[T.H_UNKNOWNS])))
    idata, rdata, size = model.pack(form, slots)
    n = int(idata[T.H_UNKNOWNS])
    rng = np.random.default_rng(7)
    y, yp, work = rng.standard_normal(n), rng.standard_normal(n), np.zeros(size)
    y[int(idata[T.H_QF]) : int(idata[T.H_LAMBDA])] *= 0.2
    cj, t = 2.7, 0.31
    vals = np.zeros(indices.size)
    exact.jacobian(t, y, yp, cj, vals, idata, rdata, work)
    found = csc_array((vals, indices, indptr), shape=(n, n)).toarray()

    def evaluate(dy):
        out = np.zeros(n)
        residual(t, y + dy, yp + cj * dy, out, idata, rdata, work)
        return out

    h, columns = 1e-3, []
    for k in range(n):
        e = np.zeros(n)
        e[k] = h
        columns.append((8 * (evaluate(e) - evaluate(-e)) - (evaluate(2 * e) - evaluate(-2 * e))) / (12 * h))
    np.testing.assert_allclose(found, np.array(columns).T, atol=5e-8 * max(1.0, np.abs(found).max()))


@pytest.mark.parametrize("kind", KINDS[4:])
def test_quadratic_part_is_the_second_derivative_along_a_motion(kind):
    """d2(phi)/dt2 along a motion without accelerations of the coordinates, by differences of phi."""
    system = joined(kind).compile()
    rng = np.random.default_rng(3)
    pose = system.pose.copy()
    pose[:, 12:] = rng.standard_normal((2, 6))
    place = Configuration(pose, 0.2 * rng.standard_normal(2), rng.standard_normal(2))

    def at(s):
        found = system.assembler.at(place.displaced(s * place.velocities), 0.3 + s, None, system.state_start)
        return found.phi[0::3], found.phi[1::3], found.rhs[place.coordinates :]

    h = 1e-3
    values = [at(k * h) for k in (-2, -1, 0, 1, 2)]
    first = (8 * (values[3][0] - values[1][0]) - (values[4][0] - values[0][0])) / (12 * h)
    second = (8 * (values[3][1] - values[1][1]) - (values[4][1] - values[0][1])) / (12 * h)
    np.testing.assert_allclose(values[2][1], first, atol=1e-8)
    np.testing.assert_allclose(-values[2][2], second, atol=1e-7)


@pytest.mark.parametrize(
    ("formulation", "integrator"), [("I3", "WSTIFF"), ("SI2", "WSTIFF"), ("SI1", "WSTIFF"), ("SI2", "IDA")]
)
def test_free_flight_conserves_momentum_angular_momentum_and_energy(formulation, integrator):
    """Summed over the mass points, which are markers: nothing of the body's own equations enters the sums."""
    m, body = with_cloud(velocity=(0.3, -0.2, 0.5), angular_velocity=(2.0, -3.0, 1.5))
    points = [body.marker(point, name=f"P{k}") for k, point in enumerate(POINTS)]
    solution = m.simulate(0.5, rate=100, formulation=formulation, integrator=integrator, tol=1e-9)
    assert solution.success
    place = np.array([solution.marker_position(p) for p in points])
    speed = np.array([solution.marker_velocity(p) for p in points])
    momentum = np.einsum("p,pti->ti", MASSES, speed)
    angular = np.einsum("p,pti->ti", MASSES, np.cross(place, speed))
    kinetic = 0.5 * np.einsum("p,pti,pti->t", MASSES, speed, speed)
    q_f = solution.modal_coordinates("cloud")
    strain = 0.5 * q_f**2 @ [300.0, 600.0]
    assert np.ptp(q_f) > 0.05
    np.testing.assert_allclose(momentum, np.tile(momentum[0], (51, 1)), atol=1e-11)
    np.testing.assert_allclose(angular, np.tile(angular[0], (51, 1)), atol=2e-6)
    np.testing.assert_allclose(kinetic + strain, kinetic[0] + strain[0], rtol=2e-6)
    np.testing.assert_allclose(solution.kinetic_energy, kinetic, rtol=1e-12)
    np.testing.assert_allclose(solution.energy_balance().elastic, strain, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("integrator", "tolerances", "factor"),
    [("WSTIFF", (1e-9, 1e-10), 100), pytest.param("IDA", (1e-6, 1e-8), 4000, marks=pytest.mark.slow)],
)
def test_tumbling_for_a_hundred_seconds(integrator, tolerances, factor):
    """No damping: energy and angular momentum about the centre of mass, summed over the mass points.

    What they stray is error of the integrator alone, so it falls with the tolerance: 15 times the tolerance are
    measured of WSTIFF, 1000 times of IDA, whose momentum at one tolerance strays five times more on one processor than
    on another: it is judged over two decades. The tolerances are far above where rounding collapses the steps (IDA:
    1e-12, with some libraries).
    """
    m, body = with_cloud(velocity=(0.3, -0.2, 0.5), angular_velocity=(2.0, -3.0, 1.5))
    points = [body.marker(point, name=f"P{k}") for k, point in enumerate(POINTS)]
    strays = []
    for tol in tolerances:
        solution = m.simulate(100.0, rate=2, integrator=integrator, tol=tol)
        assert solution.success
        place = np.array([solution.marker_position(p) for p in points])
        speed = np.array([solution.marker_velocity(p) for p in points])
        place = place - np.average(place, axis=0, weights=MASSES)
        drift = np.average(speed, axis=0, weights=MASSES)
        angular = np.einsum("p,pti->ti", MASSES, np.cross(place, speed - drift))
        strain = 0.5 * solution.modal_coordinates("cloud") ** 2 @ [300.0, 600.0]
        energy = 0.5 * np.einsum("p,pti,pti->t", MASSES, speed, speed) + strain
        turned = np.abs(angular - angular[0]).max() / np.linalg.norm(angular[0])
        strays.append([np.abs(energy / energy[0] - 1).max(), turned])
    assert np.all(np.array(strays) < factor * np.array(tolerances)[:, None])
    assert np.all(np.array(strays[1]) < 0.4 * np.array(strays[0]))


def test_two_masses_on_a_spring_vibrate_at_their_reduced_mass():
    """The mode moves one mass only, as of a body held at the other; free, both move: k (m1 + m2) / (m1 m2)."""
    m1, m2, k = 2.0, 0.5, 800.0
    arms = np.array([[-0.2, 0, 0], [0.8, 0, 0]])
    mode = np.array([[[0, 0, 0], [1.0, 0, 0]]])
    for integrals, mode_mass in ((ShapeIntegrals.of_points([m1, m2], arms, mode), 1.0), (None, m2)):
        m = Mechanism("two masses")
        modes = [Mode(stiffness=k, mass=mode_mass, momentum=(m2, 0, 0))]
        m.modal_body("rod", m1 + m2, (0.01, 0.41, 0.41), modes, lambda p: (np.zeros((1, 3)),) * 2, integrals=integrals)
        found = linear_modes(m)
        moving = found.frequencies[np.array(found.kinds) == "oscillating"]
        np.testing.assert_allclose(moving, [np.sqrt(k * (m1 + m2) / (m1 * m2)) / (2 * np.pi)], rtol=1e-12)
        assert found.kinds.count("rigid") == 6


def cantilever(k: float = 400.0, damping: float = 0.0, start: float = 0.0) -> Mechanism:
    """A bar clamped at the origin whose mode moves the end, at 1 m, along y by 1 and turns it about z by 1.5."""

    def shape(point):
        x = point[0]
        return [[0, 0.5 * (3 * x**2 - x**3), 0]], [[0, 0, 1.5 * (2 * x - x**2)]]

    m = Mechanism("cantilever")
    # integrals of a uniform bar of 1 kg: mass 33/140, momentum 3/8; arm 1/2 off the centre of mass: 11/40 - 3/16
    mode = Mode(stiffness=k, mass=33 / 140, momentum=(0, 3 / 8, 0), angular_momentum=(0, 0, 11 / 40 - 3 / 16),
                damping_ratio=damping, start=start)  # fmt: skip
    bar = m.modal_body("bar", 1.0, (1e-3, 1 / 12, 1 / 12), [mode], shape, com=(0.5, 0, 0))
    bar.marker((1, 0, 0), name="end")
    m.fixed("clamp", bar, m.ground, at=(0, 0, 0))
    return m


def test_cantilever_bends_by_force_over_stiffness():
    m = cantilever()
    end = m.bodies["bar"].markers[0]
    m.load("push", end, m.ground.marker((1, 0, 0)), rm=m.ground.marker(), fy=7.0)
    rest = static_equilibrium(m)
    np.testing.assert_allclose(rest.solution.modal_coordinates("bar"), [[7 / 400]], rtol=1e-9)
    np.testing.assert_allclose(rest.solution.marker_position("end"), [[1, 7 / 400, 0]], atol=1e-12)
    assert rest.stable
    force, moment = rest.solution.reaction("clamp")
    np.testing.assert_allclose(force[0], [0, -7, 0], atol=1e-8)
    np.testing.assert_allclose(moment[0], [0, 0, -7], atol=1e-8)


def test_cantilever_vibrates_at_its_own_frequency():
    """Clamped, the mean displacement that moves the centre of mass must drop out: sqrt(k / m_modal)."""
    found = linear_modes(cantilever())
    assert found.kinds == ["oscillating"]
    omega = np.sqrt(400.0 * 140 / 33)
    np.testing.assert_allclose(found.frequencies, [omega / (2 * np.pi)], rtol=1e-10)
    for integrator in ("WSTIFF", "IDA"):
        solution = cantilever(start=0.01).simulate(0.4, rate=500, tol=1e-9, integrator=integrator)
        np.testing.assert_allclose(solution.marker_position("end")[:, 1], 0.01 * np.cos(omega * solution.t), atol=2e-7)
        solution = cantilever(start=0.01, damping=0.1).simulate(0.4, rate=2000, tol=1e-10, integrator=integrator)
        balance = solution.energy_balance()
        assert balance.dissipated_damping[-1] > 0.5 * balance.elastic[0]
        assert balance.attrs["relative_imbalance"] < 1e-6


def test_rotating_mass_on_a_radial_spring_follows_the_closed_form():
    """m q'' + (k - m w^2) q = m w^2 r at constant speed w: deflection and softening by the centrifugal force."""
    hub, tip, r, k, w = 3.0, 0.4, 0.5, 900.0, 20.0
    com = np.array([tip * r / (hub + tip), 0, 0])
    arms = np.array([[0, 0, 0], [r, 0, 0]]) - com
    mode = np.array([[[0, 0, 0], [1.0, 0, 0]]])
    own = 1e-3 * np.eye(3)
    inertia = own + sum(m * ((s @ s) * np.eye(3) - np.outer(s, s)) for m, s in zip((hub, tip), arms))
    steady = tip * w**2 * r / (k - tip * w**2)

    def run(start):
        m = Mechanism("arm")
        body = m.modal_body(
            "arm", hub + tip, inertia, [Mode(stiffness=k, start=start)],
            lambda p: ([[p[0] / r, 0, 0]], np.zeros((1, 3))), com=com,
            integrals=ShapeIntegrals.of_points([hub, tip], arms, mode), angular_velocity=(0, 0, w),
        )  # fmt: skip
        m.rotation("drive", m.revolute("pin", body, m.ground, at=(0, 0, 0), axis=(0, 0, 1)), f"{w}*TIME")
        return m.simulate(0.5, rate=400, tol=1e-9)

    still = run(steady)
    np.testing.assert_allclose(still.modal_coordinates("arm"), steady, rtol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(still.reaction("pin")[0], axis=1), tip * w**2 * (r + steady), rtol=1e-6)
    moving = run(0.0)
    expected = steady * (1 - np.cos(np.sqrt(k / tip - w**2) * moving.t))
    np.testing.assert_allclose(moving.modal_coordinates("arm")[:, 0], expected, atol=2e-7)
    assert moving.energy_balance().attrs["relative_imbalance"] < 1e-6


def test_stiff_modes_tend_to_the_rigid_body():
    """A pendulum of the mass points: the distance from the rigid one falls with the stiffness."""

    def swing(stiffness):
        given = cloud()
        m = Mechanism("pendulum", gravity=(0, -9.81, 0))
        if stiffness is None:
            body = m.body("cloud", given["mass"], given["inertia"], com=given["com"])
        else:
            body = m.modal_body(
                "cloud", given["mass"], given["inertia"], [Mode(stiffness=stiffness, damping_ratio=1.0)] * 2, shapes,
                com=given["com"], integrals=given["integrals"],
            )  # fmt: skip
        m.revolute("pin", body, m.ground, at=(0.3, 0, 0), axis=(0, 0, 1))
        solution = m.simulate(0.5, rate=100, tol=1e-8)
        return solution.com_position("cloud")

    rigid = swing(None)
    far, near = (np.abs(swing(k) - rigid).max() for k in (1e5, 1e7))
    assert near < 1e-4
    assert near < 0.05 * far


def test_measures_and_accelerations_of_elastic_markers():
    """Accelerations of the marker on the end are the derivatives of its velocity."""
    m, body = with_cloud(angular_velocity=(2.0, -3.0, 1.5))
    body.marker(POINTS[0], [0.3, 0.7, -0.2], name="I")
    solution = m.simulate(0.2, rate=2000, tol=1e-10)
    from scipy.interpolate import CubicSpline

    t, inner = solution.t, slice(20, -20)
    for speed, push in (("VX(I)", "ACCX(I)"), ("WY(I)", "WDTY(I)")):
        slope = CubicSpline(t, solution.evaluate(speed))(t, 1)
        np.testing.assert_allclose(solution.evaluate(push)[inner], slope[inner], rtol=1e-5, atol=1e-5 * np.ptp(slope))
    place = solution.marker_position("I")
    np.testing.assert_allclose(solution.evaluate("DX(I)"), place[:, 0], rtol=1e-12)
    data = solution.to_dataset()
    np.testing.assert_array_equal(data.modal_coordinate, solution.modal_coordinates("cloud"))
    names = [u.name for u in solution.system.unknowns()]
    assert [n for n in names if "_f_" in n][:2] == ["p_f_1(cloud)", "p_f_2(cloud)"]


@pytest.mark.parametrize(
    ("modes", "message"),
    [
        ([], "needs modes"),
        ([Mode(mass=1.0)], "frequency or its stiffness"),
        ([Mode(stiffness=1.0, frequency=1.0)], "frequency or its stiffness"),
        ([Mode(stiffness=1.0, mass=0.0)], "modal mass"),
        ([Mode(stiffness=-1.0)], says("body 'b'", "mode 1", "stiffness", "-1.0", "negative")),
        ([Mode(stiffness=1.0, mass=0.1, momentum=(1.0, 0, 0))], "more momentum"),
    ],
)
def test_impossible_modes_are_refused(modes, message):
    with pytest.raises(ModelError, match=message):
        Mechanism("m").modal_body("b", 1.0, (1, 1, 1), modes, shapes)


def test_shapes_of_a_wrong_size_are_refused():
    m = Mechanism("m")
    m.modal_body("b", 1.0, (1, 1, 1), [Mode(stiffness=1.0)], lambda p: (np.zeros((2, 3)), np.zeros((1, 3)))).marker()
    with pytest.raises(ModelError, match=says("1", "3", "finite vectors")):
        m.compile()
