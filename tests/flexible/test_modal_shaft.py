"""Shafts reduced to modal bodies: the integrals against the rotor at rest, reduction errors, the DAE."""

import warnings

import numpy as np
import pytest
import scipy.linalg

from gearmbs.flexible import (
    Disc,
    ElasticMaterial,
    FlexibleError,
    Rotor,
    Shaft,
    ShaftSection,
    Support,
    damping_ratios,
    reduce_model,
)
from gearmbs.mechanism import Mechanism, ModelError, ShapeIntegrals, linear_modes
from tests.says import says

MATERIAL = ElasticMaterial(2.11e11, 2.11 / (2 * 0.812) - 1, 7810, shear_modulus=8.12e10)


def shaft(elements: int = 12) -> Shaft:
    """Friswell's example 5.9.1."""
    discs = [Disc(0.5, outer=0.28, width=0.07, inner=0.05), Disc(1.0, outer=0.35, width=0.07, inner=0.05)]
    return Shaft([ShaftSection(1.5, 0.05)], discs, {"A": 0.0, "B": 1.5}, MATERIAL, elements)


@pytest.mark.slow
def test_reduction_is_that_of_a_free_body():
    model = shaft().model()
    reduced = reduce_model(model, modes=40).slowest(10)
    n = reduced.modes
    exact = np.sqrt(np.maximum(scipy.linalg.eigh(model.stiffness.toarray(), model.mass.toarray())[0], 0))[6 : 6 + n]
    np.testing.assert_allclose(reduced.frequencies, exact / (2 * np.pi), rtol=3e-5)
    assert np.all(reduced.frequencies > exact / (2 * np.pi) * (1 - 1e-9))
    i = reduced.integrals
    np.testing.assert_allclose(i.mass, np.eye(n), atol=1e-9)
    np.testing.assert_allclose(i.momentum, 0, atol=1e-9)
    np.testing.assert_allclose(i.angular_momentum, 0, atol=1e-9)


@pytest.mark.slow
def test_bending_pairs_stay_whole():
    """A shaft that is the same in all directions must not get an axis of preference from the choice of modes."""
    for count in range(4, 12):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            frequencies = shaft().modal_model().slowest(count).frequencies
        assert frequencies.size in (count, count - 1)
        assert len(said) == count - frequencies.size
        assert all("modes are kept" in str(one.message) for one in said)
        lateral = [f for f in frequencies if np.sum(np.abs(frequencies / f - 1) < 1e-7) == 2]
        assert frequencies.size - len(lateral) <= 3


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:shaft. . modes are kept")
def test_equal_spans_do_not_part_pairs_either():
    """Held modes of two equal spans come in fours."""
    even = Shaft([ShaftSection(0.2, 0.03)], [Disc(0.1, outer=0.1, width=0.02)], {"A": 0.0, "W": 0.1, "B": 0.2})
    for count in (5, 6, 7, 8):
        frequencies = even.modal_model().slowest(count).frequencies
        single = [f for f in frequencies if np.sum(np.abs(frequencies / f - 1) < 1e-7) != 2]
        assert len(single) <= 2


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.0, 4000 * np.pi / 30])
def test_integrals_of_the_turning_frame_give_the_whirl_seen_from_rest(speed):
    """In a frame that turns with the shaft w -+ speed, by Coriolis and centrifugal terms of the integrals only."""
    rotor = Rotor(shaft(), [Support("A", 1e6), Support("B", 1e6)])
    expected = rotor.modes(speed, 5).frequencies
    model = reduce_model(shaft().model(), modes=60)
    p, i = model.properties, model.integrals
    own = i.about_centre_of_mass(p.mass)
    n, z = model.modes, np.array([0, 0, 1.0])
    # coordinates: translation of the centre of mass, small rotation of the frame, modal coordinates; lagrangian to 2nd
    # order
    mass = scipy.linalg.block_diag(p.mass * np.eye(3), p.inertia, own.mass)
    mass[3:6, 6:], mass[6:, 3:6] = own.angular_momentum.T, own.angular_momentum
    gyro, spring = np.zeros_like(mass), np.zeros_like(mass)
    skew = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0.0]])
    gyro[:3, :3] = 2 * speed * p.mass * skew
    spring[:3, :3] = speed**2 * p.mass * skew @ skew
    jd, jz = p.inertia[0, 0], p.inertia[2, 2]
    # a body that spins about z with a small tilt, in axes that turn with it
    gyro[3:5, 3:5] = speed * (2 * jd - jz) * skew[:2, :2]
    spring[3:5, 3:5] = speed**2 * (jz - jd) * np.eye(2)
    c1z = own.cross @ z
    gyro[6:, 6:] = speed * (c1z.T - c1z)
    spring[6:, 6:] = np.diag((2 * np.pi * model.frequencies) ** 2) - 0.5 * speed**2 * own.second[:, :, 2, 2]
    # tilt and deformation are coupled by b_k = J1_k z: W a' . b q - W^2 (a x z) . b q in the Lagrangian
    b = own.first @ z
    gyro[3:6, 6:], gyro[6:, 3:6] = speed * b.T, -speed * b
    spring[3:6, 6:] = speed**2 * np.cross(z, b).T
    spring[6:, 3:6] = spring[3:6, 6:].T
    assert np.abs(own.angular_momentum).max() < 1e-9
    for seat in ("A", "B"):
        place = model.seats[seat]
        arm = place.position - p.com
        motion = np.hstack([np.eye(3), np.column_stack([np.cross(e, arm) for e in np.eye(3)]), place.moved.T])
        spring += 1e6 * motion[:2].T @ motion[:2]
    a = np.block([[np.zeros_like(mass), np.eye(6 + n)], [-np.linalg.solve(mass, spring), -np.linalg.solve(mass, gyro)]])
    seen = np.abs(np.linalg.eigvals(a).imag)
    for w in expected:
        assert min(np.abs(seen - abs(w - speed)).min(), np.abs(seen - (w + speed)).min()) < 2e-4 * w


@pytest.mark.parametrize(
    ("damping", "expected"),
    [
        (0.02, [0.02, 0.02, 0.02, 0.02]),
        ([0.1, 0.2, 0.3, 0.4], [0.1, 0.2, 0.3, 0.4]),
        ("adams", [0.01, 0.1, 0.1, 1.0]),
        ([(200.0, 0.01), (900.0, 0.05)], [0.01, 0.01, 0.05, 0.05]),
    ],
)
def test_damping_by_number_mode_and_band(damping, expected):
    np.testing.assert_allclose(damping_ratios(np.array([50.0, 150.0, 500.0, 2000.0]), damping), expected)


@pytest.mark.parametrize(
    ("damping", "words"),
    [
        ("weak", says("damping", "'weak'", "give a ratio")),
        ([0.1, 0.2], says("damping", "2 values", "3 modes", "give")),
        (-0.1, says("damping", "-0.1", "give 0 or more")),
        ([(900.0, 0.1), (200.0, 0.2)], says("damping", "[900.0, 200.0] Hz", "rise")),
        (np.nan, says("damping", "nan", "give 0 or more")),
    ],
)
def test_wrong_damping_is_refused(damping, words):
    with pytest.raises(FlexibleError, match=words):
        damping_ratios(np.array([50.0, 150.0, 500.0]), damping)


def test_markers_between_the_stations_and_off_the_axis_follow_the_section():
    """Cantilever held at the left end, loaded at the right: the line w = F (3 l z^2 - z^3) / 6 E I at any point."""
    slim = Shaft([ShaftSection(1.0, 0.01)], seats={"A": 0.0, "B": 1.0}, elements=10)
    model = reduce_model(slim.model(), modes=6)
    m = Mechanism("cantilever")
    body = model.add_to(m, damping=0.0)
    m.fixed("clamp", body.marker(model.place("A")), m.ground.marker())
    tip, z = body.marker(model.place("B"), name="tip"), 0.437
    m.load("push", tip, m.ground.marker((0, 0, 1.0)), rm=m.ground.marker(), fx=1.0)
    on, off = body.marker((0, 0, z), name="on"), body.marker((0.1, 0, z), name="off")
    from gearmbs.mechanism import static_equilibrium

    found = static_equilibrium(m).solution
    ei = 2.1e11 * np.pi / 64 * 0.01**4
    line = (3 * z**2 - z**3) / (6 * ei)
    np.testing.assert_allclose(found.marker_position(tip)[0, 0], 1 / (3 * ei), rtol=2e-4)
    np.testing.assert_allclose(found.marker_position(on)[0, 0], line, rtol=5e-4)
    slope = (6 * z - 3 * z**2) / (6 * ei)
    np.testing.assert_allclose((found.marker_position(off) - found.marker_position(on))[0, 2], -0.1 * slope, rtol=2e-2)
    with pytest.raises(FlexibleError, match="off the shaft"):
        model.shapes(np.array([0, 0, 1.2]))


@pytest.mark.slow
def test_modes_of_the_mechanism_are_those_of_the_rotor():
    """At rest, on springs: linear modes of the modal body against all degrees of freedom."""
    rotor = Rotor(shaft(), [Support("A", 1e6), Support("B", 1e6)])
    model = reduce_model(shaft().model(), modes=30)
    m = Mechanism("rotor")
    body = model.add_to(m, damping=0.0)
    for seat in ("A", "B"):
        place = model.place(seat)
        m.bushing(seat, body.marker(place), m.ground.marker(place), stiffness=(1e6, 1e6, 0.0 if seat == "B" else 1e6))
    found = linear_modes(m)
    moving = 2 * np.pi * found.frequencies[np.array(found.kinds) == "oscillating"]
    for w in rotor.modes(0.0, 6).frequencies[::2]:
        assert np.sum(np.abs(moving / w - 1) < 1e-4) == 2


def test_coupling_levels_and_integrals():
    i = shaft().modal_model().slowest(6).integrals
    assert np.any(i.coupled("full").second)
    assert not np.any(i.coupled("partial").second)
    assert not np.any(i.coupled("constant").first)
    with pytest.raises(ModelError, match="choose one of full, partial, constant"):
        i.coupled("some")
    with pytest.raises(ModelError, match="need the rotations"):
        ShapeIntegrals.of_points([1.0], [[0, 0, 0]], [[[0, 0, 1.0]]], inertias=[np.eye(3)])


def test_modes_are_selected_by_what_they_give_to_the_seats():
    model = reduce_model(shaft().model(), modes=20)
    share = model.participation()
    assert np.all((share >= 0) & (share <= 1))
    kept = model.by_participation(1e-3)
    assert 4 < kept.modes < model.modes
    flexible = [(m.seats["A"].moved[:, 0] ** 2 / (2 * np.pi * m.frequencies) ** 2).sum() for m in (model, kept)]
    np.testing.assert_allclose(flexible[1], flexible[0], rtol=0.02)
    energy = kept.strain_energies(np.eye(kept.modes)[0])
    np.testing.assert_allclose(energy[0], 0.5 * (2 * np.pi * kept.frequencies[0]) ** 2)
    assert (
        np.ptp(kept.displaced(np.eye(kept.modes)[0], 0.1)[:, 0])
        + np.ptp(kept.displaced(np.eye(kept.modes)[0], 0.1)[:, 1])
        > 0
    )


@pytest.mark.slow
@pytest.mark.parametrize("torque", [10.0, 1.0, 0.1])
def test_steps_are_those_of_the_whole_matrix(torque, monkeypatch):
    """A sudden torque on a free bar: what the corrector's matrix leaves out must not reach the estimate of the error.

    With entries up to a hundredth left out the order stayed at one or two, and 1e-10 took a million steps.
    """
    from gearmbs.dae.integrators import driver
    from gearmbs.dae.linalg.left_out import converges_without
    from gearmbs.kernels.pointers import direct

    def refused(*given):
        return False

    bar = Shaft([ShaftSection(0.4, 0.01)], seats={"A": 0.0, "B": 0.4}).modal_model().slowest(4)

    def steps(tol: float) -> int:
        m = Mechanism("free")
        body = bar.add_to(m, "bar", damping=0.0)
        m.load("f", body.marker(bar.place("B")), m.ground.marker(), rm=m.ground.marker(), tx=repr(torque))
        return m.simulate(1e-3, t_eval=np.linspace(0.0, 1e-3, 51), tol=tol).stats.steps

    tolerances = (1e-7, 1e-8, 1e-9, 1e-10)
    taken = [steps(tol) for tol in tolerances]
    monkeypatch.setattr(driver, "direct", lambda kernel: refused if kernel is converges_without else direct(kernel))
    whole = [steps(tol) for tol in tolerances]
    assert max(whole) < 300
    np.testing.assert_allclose(taken, whole, rtol=0.05)


def test_an_unknown_level_of_coupling_is_refused_with_all_that_there_are():
    model = Shaft([ShaftSection(1.0, 0.05)], seats={"A": 0.0, "B": 1.0}).modal_model().slowest(4)
    with pytest.raises(FlexibleError, match=says("coupling = 'half'", "choose")):
        model.add_to(Mechanism("m"), coupling="half")


@pytest.mark.parametrize("case", range(12))
def test_stiffening_by_spin_holds_against_a_rigid_turn_what_the_mass_weighs(case):
    """w = z - c has the slope 1, so that what G holds against it is the integral of the tension, that of m (z - c)^2.

    Between the shaft's ends, beyond them (a hub), and at a seat; with steps, bores and discs.
    """
    rng = np.random.default_rng(100 + case)
    sections = [
        ShaftSection(float(length), float(outer), inner=float(bore))
        for length, outer, bore in zip(rng.uniform(0.05, 0.4, 3), rng.uniform(0.03, 0.06, 3), rng.uniform(0.0, 0.02, 3))
    ]
    total = sum(section.length for section in sections)
    discs = [Disc(float(at), outer=0.2, width=0.02, inner=0.05) for at in rng.uniform(0.0, total, 2)]
    shaft = Shaft(sections, discs, {"a": 0.0, "b": total})
    centre = float(rng.uniform(-0.3, 1.2) * total)
    z = shaft.stations()
    q = np.zeros(6 * z.size)
    q[0::6], q[4::6] = z - centre, 1.0
    held = q @ shaft.spin_stiffness(centre) @ q
    weighed, start, pull = 0.0, 0.0, 0.0
    for section in sections:
        area = np.pi / 4 * (section.outer**2 - section.inner**2)
        ends = np.array([start, start + section.length]) - centre
        weighed += shaft.material.density * area * np.diff(ends**3)[0] / 3
        pull += shaft.material.density * area * np.diff(ends**2)[0] / 2
        start += section.length
    for disc in shaft.discs:
        mass = disc.properties(shaft.material)[0]
        weighed += mass * (disc.at - centre) ** 2
        pull += mass * (disc.at - centre)
    # a hub between axis and shaft holds its part
    weighed -= pull * (min(max(centre, 0.0), total) - centre)
    assert held == pytest.approx(weighed, rel=1e-6)


BLADE = [(3, 4.7973, 23.3203), (6, 7.3604, 26.8091), (12, 13.1702, 37.6031)]
"""Wright, Smith, Thresher and Wang (1982): speed and flapwise frequencies of a uniform blade clamped at the axis, in
units of sqrt(EI/m)/L^2."""


def blade_frequencies(spin):
    """The two lowest flapwise frequencies; the tension is exact for any number of elements."""
    slender = ElasticMaterial(youngs_modulus=210e9, shear_modulus=80e9, density=7800)
    length, width = 1.0, 0.005
    shaft = Shaft([ShaftSection(length, width)], [], {"root": 0.0, "tip": length}, slender)
    model = shaft.model()
    unit = np.sqrt(7800 * np.pi / 4 * width**2 / (210e9 * np.pi / 64 * width**4)) * length**2
    matrix = model.stiffness + (spin / unit) ** 2 * shaft.spin_stiffness("root")
    mass = model.mass.toarray()
    flap = np.array([k for k in range(6, matrix.shape[0]) if k % 6 in (0, 4)])
    both = np.ix_(flap, flap)
    return unit * np.sqrt(scipy.linalg.eigh(matrix[both], mass[both], eigvals_only=True)[:2])


@pytest.mark.parametrize(("spin", "first", "second"), BLADE)
def test_a_turning_blade_has_the_published_frequencies(spin, first, second):
    assert blade_frequencies(spin) == pytest.approx([first, second], rel=2e-4)
