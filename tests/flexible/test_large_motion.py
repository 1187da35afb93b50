"""Beams of large motion and geometric stiffening: derivatives, published large deflections, the spin-up of a beam."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.flexible import (
    BeamSection,
    ElasticMaterial,
    FlexibleError,
    LargeBeam,
    Shaft,
    ShaftSection,
    add_beam,
    reduce_model,
)
from gearmbs.flexible.large_beam import node_shares
from gearmbs.mechanism import Mechanism, linear_modes, quasi_static
from tests.says import says

SPEED, TIME = 6.0, 15.0
DRIVE = f"{SPEED / TIME}*(TIME**2/2+{(TIME / (2 * np.pi)) ** 2}*(COS({2 * np.pi / TIME}*TIME)-1))"
"""Spin-up of Kane, Ryan and Banerjee (1987); Simo and Vu-Quoc (1986)."""


@pytest.mark.parametrize("turn", [1.3, 0.05, 1e-6])
def test_derivatives_of_the_element(turn):
    from gearmbs.flexible.large_beam import WORK, large_beam

    section = BeamSection(3e4, 20.0, (7.0, 11.0), (2e3, 3e3), 1.0, (1e-3, 1e-3, 2e-3))
    reals = np.array(LargeBeam("e", None, None, 0.4, section, 0.03).compiled().reals)
    rng = np.random.default_rng(0)
    first = Rotation.random(random_state=3)
    second = first * Rotation.from_rotvec(turn * np.array([0.5, -0.7, 0.5]))
    frames = rng.standard_normal((2, 18))
    frames[1, :3] = frames[0, :3] + first.apply([0.02, 0.01, 0.42])
    for k, a in enumerate((first, second)):
        frames[k, 3:12] = a.as_matrix().ravel()

    def call(given, want=0):
        wrench, jac, told = np.zeros((1, 6)), np.zeros((6, 24)), np.zeros(2)
        large_beam(np.zeros(0, dtype=np.int64), reals, 0.0, given, np.zeros(0), np.zeros(0), want, np.zeros(WORK),
        wrench,
                   np.zeros(0), jac, told)  # fmt: skip
        return wrench[0], jac, told

    _, exact, _ = call(frames, 1)
    h, found = 1e-4, np.zeros((6, 24))

    def moved(column, step):
        out, k, q = frames.copy(), column // 12, column % 12
        if 3 <= q < 6:
            change = Rotation.from_rotvec(step * np.eye(3)[q - 3]).as_matrix()
            out[k, 3:12] = (change @ frames[k, 3:12].reshape(3, 3)).ravel()
        else:
            out[k, q if q < 3 else 12 + q - 6] += step
        return call(out)[0]

    for c in range(24):
        found[:, c] = (8 * (moved(c, h) - moved(c, -h)) - (moved(c, 2 * h) - moved(c, -2 * h))) / (12 * h)
    np.testing.assert_allclose(exact, found, atol=1e-10 * np.abs(exact).max())


PRINCETON = {
    # force, N: tip displacements along the stiff and the soft axis at 0, 15 .. 90 deg, m
    8.896: (
        (1.071417630e-2, 1.061328706e-2, 1.011169630e-2, 8.837226265e-3, 6.604665004e-3, 3.538889001e-3, 0.0),
        (0.0, 4.208232124e-2, 7.939482948e-2, 0.108987937, 0.129887616, 0.142194370, 0.146245978),
    ),
    13.345: (
        (1.606423724e-2, 1.645825752e-2, 1.665873206e-2, 1.518618440e-2, 1.157837500e-2, 6.248967384e-3, 0.0),
        (0.0, 6.435812858e-2, 0.117735994, 0.156467239, 0.181861627, 0.196097131, 0.200677707),
    ),
}
"""Beam elements of ANSYS, L. Obrezkov and others as kept with Exudyn; 8.896 N and 13.345 N."""

SECTION_OF_FOUR_CELLS = 1.17183286e-10
"""Torsion constant, m^4, that a mesh of 2 x 2 biquadratic cells gives the rectangle, as the published beams have it.

ANSYS meshes a rectangle with two cells along each side unless told otherwise (its manual, command SECDATA, RECT: Nb and
Nh are 2), so that the constant follows from the program that the rows are of, and from none of the rows.

That is 3.3 % more than the exact one, and moves the rows along the stiff axis by up to 1.3 %; see
`test_torsion_constant_of_few_cells_is_too_large`.
"""


def test_torsion_constant_of_few_cells_is_too_large():
    """Warping of the rectangle by finite elements: coarse meshes twist less, fine ones as Saint-Venant's series.

    Public values for this section, of another program (section-properties, triangles), fall alike: 118e-12 m^4 with 24
    nodes, 114e-12 with 65, 113e-12 from 204 on.
    """
    fem = pytest.importorskip("skfem")
    h, t = 12.3777e-3, 3.2024e-3

    @fem.BilinearForm
    def stiffness(u, v, _):
        return u.grad[0] * v.grad[0] + u.grad[1] * v.grad[1]

    @fem.LinearForm
    def shear(v, w):
        return w.x[1] * v.grad[0] - w.x[0] * v.grad[1]

    found = []
    for cells in (2, 4, 8, 16):
        sides = [np.linspace(-size / 2, size / 2, cells + 1) for size in (h, t)]
        basis = fem.Basis(fem.MeshQuad.init_tensor(*sides), fem.ElementQuad2())
        matrix, load = stiffness.assemble(basis), shear.assemble(basis)
        warping = fem.solve(*fem.condense(matrix, load, D=np.array([0])))
        found.append(h * t * (h * h + t * t) / 12 - warping @ matrix @ warping)
    assert np.all(np.diff(found) < 0)
    np.testing.assert_allclose(found[0], SECTION_OF_FOUR_CELLS, rtol=1e-8)
    section = BeamSection.rectangle(ElasticMaterial(71.7e9, 0.31, 2700.0), h, t, shear=5 / 6)
    np.testing.assert_allclose(section.torsion / (71.7e9 / 2.62), found[-1], rtol=1e-4)


def princeton(force, angle, elements, torsion):
    """Displacements of the tip along the section's stiff and soft axis, m."""
    length, h, t = 0.508, 12.3777e-3, 3.2024e-3
    material = ElasticMaterial(71.7e9, 0.31, 2700.0)
    section = BeamSection.rectangle(material, h, t, shear=5 / 6)
    np.testing.assert_allclose(section.torsion / material.shear_modulus, 1.13407e-10, rtol=1e-5)
    section = replace(section, torsion=material.shear_modulus * torsion)
    c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    m = Mechanism("princeton")
    beam = add_beam(m, "b", section, (0, 0, 0), (length, 0, 0), elements, x_axis=(0, s, c))
    m.fixed("clamp", beam.bodies[0], m.ground, at=(0, 0, 0))
    m.load("tip", beam.last, m.ground.marker((length, 0, 0)), rm=m.ground.marker(), fz=f"-{force}*TIME")
    # elements are stiff and light: a share of the weight is less than the rounding of their forces
    found = quasi_static(m, np.linspace(0.0, 1.0, 9), tol=3e-6)
    moved = found.marker_position(beam.last)[-1] - np.array([length, 0, 0])
    return np.abs([moved @ [0, s, c], moved @ [0, c, -s]])


@pytest.mark.slow
@pytest.mark.parametrize("row", range(7))
@pytest.mark.parametrize("force", PRINCETON)
def test_princeton_beam(force, row):
    published = [column[row] for column in PRINCETON[force]]
    found = princeton(force, 15 * row, 24, SECTION_OF_FOUR_CELLS)
    np.testing.assert_allclose(found, published, rtol=2e-4, atol=1e-9)


@pytest.mark.parametrize(("angle", "published"), [(30, (0.0169316, 0.1179818)), (60, (0.0118996, 0.1817173))])
@pytest.mark.slow
def test_princeton_beam_with_the_torsion_constant_of_another_program(angle, published):
    """Exudyn's own beams (16 elements, 13.345 N) with its constant 0.198 (I_y + I_z): 9 % less than that of ANSYS.

    Across the soft axis alone, where torsion has no part, they are 0.15 % stiffer than elastica; the constant moves the
    first column by 2 %.
    """
    h, t = 12.3777e-3, 3.2024e-3
    found = princeton(13.345, angle, 24, 0.198 * (h * t**3 + t * h**3) / 12)
    np.testing.assert_allclose(found, published, rtol=6e-3)


@pytest.mark.slow
def test_princeton_beam_converges_with_the_square_of_the_elements():
    coarse, middle, fine = (princeton(13.345, 45, n, SECTION_OF_FOUR_CELLS) for n in (8, 16, 32))
    np.testing.assert_allclose((coarse - middle) / (middle - fine), 4.0, rtol=0.15)
    # elastica with shear, across the soft axis alone
    ends = [princeton(13.345, 90, n, SECTION_OF_FOUR_CELLS)[1] for n in (12, 24)]
    np.testing.assert_allclose(ends[1] + (ends[1] - ends[0]) / 3, 0.2006840, rtol=5e-5)


PENDULUM = {
    0.25: (-0.250638, 0.463599, -0.800301),
    0.5: (-0.373086, -0.690261, -0.0921098),
    0.75: (-0.0863421, -0.382946, 0.904623),
    1.0: (-0.109519, 0.650688, 0.668971),
}
"""Time, s: height of the middle, x and z of the end, m, of the spatial cable pendulum of J. Gerstmayr and
A. A. Shabana, Nonlinear Dynamics 45 (2006), figures 4 and 5, as Project Chrono keeps it for its unit test of
cables: 4 elements, implicit Euler of the first order with steps of 0.1 ms.
"""


@pytest.mark.slow
def test_a_very_flexible_pendulum_follows_the_published_one():
    """Hinged at one end, it falls and turns about the vertical; 48 elements instead of 24 change it by 2 mm in 1 s."""
    share, length, elements = 5.0, 1.0, 24
    diameter = 2.0 * share * np.sqrt(1e-6 / np.pi)
    material = ElasticMaterial(1e9 / share**4, 0.3, 8000.0 / share**2)
    m = Mechanism("pendulum", gravity=(0, -9.8, 0))
    beam = add_beam(m, "b", BeamSection.ring(material, diameter), (0, 0, 0), (length, 0, 0), elements, x_axis=(0, 1, 0))
    for k, body in enumerate(beam.bodies):
        body.velocity[:], body.angular_velocity[:] = (0.0, 0.0, -4.0 * k / elements), (0.0, 4.0, 0.0)
    m.spherical("hook", beam.bodies[0], m.ground, at=(0, 0, 0))
    solution = m.simulate(1.0, t_eval=[0.0, *PENDULUM], tol=1e-6)
    middle, end = (solution.marker_position(beam.markers[k])[1:] for k in (elements // 2, elements))
    found = np.column_stack([middle[:, 1], end[:, 0], end[:, 2]])
    np.testing.assert_allclose(found[:3], list(PENDULUM.values())[:3], atol=0.01)
    np.testing.assert_allclose(found[3], PENDULUM[1.0], atol=0.02)
    assert abs(solution.energy_balance().attrs["relative_imbalance"]) < 1e-5


def beam_section():
    return BeamSection(2.8e7, 2.8e4, (1.4e4, 1.4e4), (1e7, 1e7), 1.2, (6e-4, 6e-4, 1.2e-3))


def lag_of(solution, marker):
    place, angle = solution.marker_position(marker), solution.joint_angle("pin")
    return -np.sin(angle) * place[:, 0] + np.cos(angle) * place[:, 1]


def spun_beam(elements):
    m = Mechanism("spin-up")
    beam = add_beam(m, "b", beam_section(), (0, 0, 0), (10, 0, 0), elements, x_axis=(0, 1, 0), damping_time=1e-3)
    m.rotation("drive", m.revolute("pin", beam.bodies[0], m.ground, at=(0, 0, 0), axis=(0, 0, 1)), DRIVE)
    solution = m.simulate(9.0, rate=200, tol=1e-5)
    assert solution.success
    return lag_of(solution, beam.last), solution.t


@pytest.mark.slow
def test_spin_up_of_nodal_beams_converges_to_the_published_lag():
    """-0.5737 m at 6.765 s; errors fall with the square of the element's length."""
    coarse, fine = (spun_beam(n) for n in (8, 16))
    deepest = [lag.min() for lag, _ in (coarse, fine)]
    assert abs(fine[1][np.argmin(fine[0])] - 6.765) < 0.02
    np.testing.assert_allclose(deepest[1] + (deepest[1] - deepest[0]) / 3, -0.5737, atol=5e-4)


def spun_modes(spin, coupling="full"):
    """The same beam as a round modal body of equal stiffness and mass."""
    diameter = 4 * np.sqrt(1.4e4 / 2.8e7)
    area = np.pi / 4 * diameter**2
    material = ElasticMaterial(2.8e7 / area, 0.0, 1.2 / area)
    shaft = Shaft([ShaftSection(10.0, diameter)], seats={"root": 0.0, "tip": 10.0}, material=material, elements=12)
    stiffening = None if spin is None else shaft.spin_stiffness(spin)
    model = reduce_model(shaft.model(), modes=4, spin_stiffness=stiffening)
    m = Mechanism("spin-up")
    body = model.add_to(m, "b", orientation=[[0, 0, 1], [1, 0, 0], [0, 1, 0]], damping=0.05, coupling=coupling)
    root = body.marker(model.place("root"), [[0, 1, 0], [0, 0, 1], [1, 0, 0]], name="root")
    tip = body.marker(model.place("tip"), name="tip")
    place, axes = root.global_position(), root.global_orientation()
    m.rotation("drive", m.revolute("pin", root, m.ground.marker(place, axes, name="ground")), DRIVE)
    return m, tip


@pytest.mark.slow
def test_spin_up_of_a_modal_body_needs_its_stiffening():
    m, tip = spun_modes("root")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        solution = m.simulate(9.0, rate=100, tol=1e-6)
    assert solution.success
    axes = m.bodies["b"].markers[0].global_orientation()
    np.testing.assert_allclose(np.abs(axes[2, 2]), 1.0, atol=1e-12)
    lag = lag_of(solution, tip)
    np.testing.assert_allclose(lag.min(), -0.5737, atol=1e-3)
    m, tip = spun_modes(None)
    with pytest.warns(UserWarning, match=says("stiffening by centrifugal")):
        soft = m.simulate(9.0, rate=20, tol=1e-6)
    assert np.abs(lag_of(soft, tip)).max() > 1.15 * np.abs(lag).max()


def supported(m, seats):
    for name, marker, z in seats:
        m.bushing(name, marker, m.ground.marker((0, 0, z)), stiffness=(2e7, 2e7, 1e7), torsional_stiffness=(0, 0, 1e4))
    found = linear_modes(m)
    return np.sort(found.frequencies[np.array(found.kinds) == "oscillating"])[:8]


@pytest.mark.slow
def test_modes_and_beams_agree_in_small_motion():
    """A round bar on springs: reduced finite elements against nodes and beams, extrapolated to short elements."""
    diameter, length = 0.05, 1.0

    def beams(elements):
        m = Mechanism("beams")
        bar = add_beam(m, "b", BeamSection.ring(ElasticMaterial(), diameter), (0, 0, 0), (0, 0, length), elements)
        return supported(m, [("A", bar.first, 0.0), ("B", bar.last, length)])

    shaft = Shaft([ShaftSection(length, diameter)], seats={"A": 0.0, "B": length}, elements=48)
    model = reduce_model(shaft.model(), modes=40)
    m = Mechanism("modes")
    body = model.add_to(m, damping=0.0)
    modal = supported(m, [(key, body.marker(model.place(key)), z) for key, z in (("A", 0.0), ("B", length))])
    coarse, fine = beams(24), beams(48)
    np.testing.assert_allclose(fine + (fine - coarse) / 3, modal, rtol=1e-4)


def test_a_preload_raises_the_frequencies_as_a_string():
    """Tension N on a bar: w^2 = w_0^2 (1 + N l^2 / (pi^2 E I)) between pins; here against the free bar's integral."""
    from gearmbs.flexible.beam import GAUSS_W, GAUSS_X, geometric_stiffness

    shaft = Shaft([ShaftSection(1.0, 0.02)], seats={"A": 0.0, "B": 1.0}, elements=10)
    model, z = shaft.model(), shaft.stations()
    tension, matrix = 2e4, np.zeros((66, 66))
    for k in range(10):
        part = geometric_stiffness(z[k + 1] - z[k], shaft.element_section(z[k], z[k + 1]), GAUSS_X, tension * GAUSS_W)
        matrix[6 * k : 6 * k + 12, 6 * k : 6 * k + 12] += part
    plain, pulled = (reduce_model(model, modes=8, preload=p) for p in (None, matrix))
    bending = plain.moved[0]
    slope = np.gradient(np.linalg.norm(bending, axis=1) * np.sign(bending.sum(axis=1)), z)
    shift = tension * np.trapezoid(slope**2, z)
    change = (2 * np.pi) ** 2 * (pulled.frequencies[0] ** 2 - plain.frequencies[0] ** 2)
    np.testing.assert_allclose(change, shift, rtol=0.1)
    with pytest.raises(FlexibleError, match="buckle"):
        reduce_model(model, modes=8, preload=-100 * matrix)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (dict(start=(0, 0, 0), end=(0, 0, 0)), "length 0.0 m"),
        (dict(start=(0, 0, 0), end=(1, 0, 0), elements=0), "0 elements"),
        (dict(start=(0, 0, 0), end=(1, 0, 0), spin=3.0), "spin is no setting"),
    ],
)
def test_wrong_beams_are_named(arguments, message):
    with pytest.raises(FlexibleError, match=message):
        add_beam(Mechanism("m"), "b", beam_section(), **arguments)


PENDULUM_TIMES = np.linspace(0.0, 0.4, 41)


def falling_rod(stiffness, elements=0):
    """Tip of a rod of 1 m on a pin that falls from the horizontal: six modes, or as many beams of large rotation."""
    material = ElasticMaterial(stiffness, 0.3, 7850.0)
    m = Mechanism("pendulum", gravity=(0, -9.81, 0))
    if elements:
        bar = add_beam(m, "b", BeamSection.ring(material, 0.008), (0, 0, 0), (1.0, 0, 0), elements, damping_time=2e-6)
        m.revolute("pin", bar.first.body, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
        tip = bar.last
    else:
        shaft = Shaft([ShaftSection(1.0, 0.008)], seats={"pin": 0.0, "tip": 1.0}, material=material, elements=16)
        model = reduce_model(shaft.model(), modes=6)
        bands = [(200.0, 0.0), (2000.0, 0.05), (np.inf, 0.5)]
        body = model.add_to(m, "b", orientation=[[0, 0, 1], [1, 0, 0], [0, 1, 0]], damping=bands)
        root = body.marker(model.place("pin"), [[0, 1, 0], [0, 0, 1], [1, 0, 0]], name="root")
        tip = body.marker(model.place("tip"), name="tip")
        m.revolute("pin", root, m.ground.marker(root.global_position(), root.global_orientation(), name="pin"))
    solution = m.simulate(0.4, t_eval=PENDULUM_TIMES, tol=1e-6)
    assert solution.success
    return solution.marker_position(tip)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*lack the stiffening by centrifugal force")
def test_a_flexible_pendulum_parts_from_beams_of_large_rotation_by_the_square_of_its_deflection():
    """Twice as stiff, a rod bends half as far; what modes leave out (foreshortening, stiffening) falls to a quarter."""
    gaps = []
    for stiffness in (2.1e10, 4.2e10):
        coarse, fine = (falling_rod(stiffness, n) for n in (16, 32))
        gaps.append(np.abs(falling_rod(stiffness) - (fine + (fine - coarse) / 3)).max())
    assert gaps[0] < 1.2e-3
    assert 3.4 < gaps[0] / gaps[1] < 5.5


@pytest.mark.parametrize("elements", range(1, 14))
def test_shares_of_the_nodes_carry_mass_centre_and_inertia(elements):
    shares, places = node_shares(elements), np.linspace(0.0, 1.0, elements + 1)
    assert np.all(shares > 0.0)
    for power in range(4 if elements > 1 else 2):
        exact = elements / (power + 1)
        # from five elements on the third moment, too, by symmetry about the middle
        assert shares @ places**power == pytest.approx(exact, rel=1e-12), power


@pytest.mark.slow
def test_bending_frequencies_of_a_chain_converge_like_h_to_the_fourth():
    """Clamped and free: against the roots of cosh x cos x = -+1 of a slender bar."""
    section = BeamSection.ring(ElasticMaterial(), 0.004)
    roots = {True: 1.8751040687119611, False: 4.730040744862704}
    rate = np.sqrt(section.bending[0] / section.mass) / (2.0 * np.pi)
    for clamped, root in roots.items():
        errors = []
        for elements in (4, 8, 16):
            m = Mechanism("bar")
            chain = add_beam(m, "b", section, (0, 0, 0), (0, 0, 1), elements)
            if clamped:
                m.fixed("clamp", chain.bodies[0], m.ground, at=(0, 0, 0))
            found = linear_modes(m).frequencies
            errors.append(abs(found[found > 0.1].min() / (root**2 * rate) - 1.0))
        # what rotary inertia and shear take is 1e-5
        assert errors[1] < (2e-4 if clamped else 1.5e-3)
        assert errors[2] < 5e-5
        assert errors[1] < errors[0] / 8.0
