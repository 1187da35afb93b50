"""Mesh stiffness by the potential-energy method and by ISO 6336-1, against an independent code's published numbers."""

import math

import numpy as np
import pytest

from gearmbs.gears import ContactLaw, GearPair, GearSpec, IdealMesh, Material, loaded_transmission_error
from gearmbs.gears.faults import RootCrack
from gearmbs.gears.iso6336 import iso_mesh_stiffness, iso_single_stiffness
from gearmbs.gears.stiffness import (
    Crack,
    compliance_roll_lengths,
    hertz_stiffness,
    mesh_stiffness,
    pair_stiffness,
    rack_root,
    ring_root,
    tooth_compliance,
)
from tests.says import says

ALPHA = math.radians(20)


def ross_pair():
    # the pair of the test-suite of ROSS's GearElementTVMS; its rack tip radius is c m / (1 - sin alpha)
    steel = Material("206 GPa", 0.3, "7810 kg/m^3")
    wheel = GearSpec(
        62, "2 mm", fillet_radius=0.25 * 2e-3 / (1 - math.sin(ALPHA)), bore_radius="17.5 mm", material=steel
    )
    return GearPair(wheel, wheel)


def test_closed_forms_of_ross():
    pair = ross_pair()
    assert pair.contact_ratio == pytest.approx(1.78978, abs=5e-6)
    assert hertz_stiffness(pair) == pytest.approx(3555868607.9093266, rel=1e-12)
    # its "mesh stiffness" of 4.0966e8 N/m is the rule eps b E1 E2 / (9 (E1 + E2)), not the largest value of its curve
    assert pair.contact_ratio * 0.02 * 206e9 / 18 == pytest.approx(4.096607e8, rel=1e-6)


def test_curve_of_ross():
    """Its curve starts at 396622921 N/m when its own contact mapping and root angle are used.

    It lets the pressure angle, not the length of roll, of the driven contact fall as fast as the driver's rises, and
    takes the root half angle with the addendum where the cutter's depth below the pitch line belongs. With the
    geometry as it is, the same tooth energies give a largest value 1.5 % above the 4.0966e8 N/m.
    """
    pair = ross_pair()
    gear = pair.driver
    ratio = gear.fillet_radius / gear.module
    angle = (math.pi / 2 + 2 * math.tan(ALPHA) * (1 - ratio) + 2 * ratio / math.cos(ALPHA)) / 62
    assert angle == pytest.approx(0.0456584787349235, rel=1e-12)
    tooth = tooth_compliance(gear, root_angle=angle, sainsot=True)
    half, height = rack_root(gear)
    low = math.acos(gear.base_radius / math.hypot(half[-1], height[-1]))
    high = math.acos(gear.base_radius / gear.tip_radius)
    assert low == pytest.approx(0.2577380345253824, rel=1e-9)

    def single(turn):
        roll_lengths = gear.base_radius * np.tan([low + turn, high - turn])
        return 1 / (np.interp(roll_lengths, tooth.roll_length, tooth.total).sum() + 1 / hertz_stiffness(pair))

    meshing = (high - low) / pair.contact_ratio
    assert single(0.0) + single(meshing) == pytest.approx(396622921.3581085, rel=3e-6)
    assert mesh_stiffness(pair, sainsot=True).maximum == pytest.approx(4.0966e8, rel=0.02)
    assert mesh_stiffness(pair, root_angles=(angle, angle), sainsot=True).maximum == pytest.approx(4.0966e8, rel=0.011)


# one tooth's compliances from ROSS 2.3.0, m/N, by pressure angle at the contact: bending, shear, axial, foundation
ROSS_TOOTH = {
    0.30: (1.0843316777866684e-11, 2.533469047664536e-10, 6.175956348051072e-12, 1.3438956449833077e-09),
    0.35: (8.998101033081477e-11, 4.5112682379935374e-10, 1.6393151509663975e-11, 1.5790255852626135e-09),
    0.40: (4.633541119489807e-10, 7.375819665610016e-10, 3.8275505037545074e-11, 1.9735815605864512e-09),
}


@pytest.mark.parametrize("angle", ROSS_TOOTH)
def test_components_of_ross(angle):
    gear = ross_pair().driver
    ratio = gear.fillet_radius / gear.module
    root = (math.pi / 2 + 2 * math.tan(ALPHA) * (1 - ratio) + 2 * ratio / math.cos(ALPHA)) / 62
    tooth, plain = tooth_compliance(gear, root_angle=root, sainsot=True), tooth_compliance(gear, sainsot=True)
    roll_length = gear.base_radius * math.tan(angle)
    parts = [
        np.interp(roll_length, tooth.roll_length, p)
        for p in (tooth.bending, tooth.shear, tooth.axial, tooth.foundation)
    ]
    # 400 trapezoids against its adaptive quadrature
    for ours, theirs, accuracy in zip(parts, ROSS_TOOTH[angle], (1e-4, 3e-6, 1e-5, 1e-6)):
        assert ours == pytest.approx(theirs, rel=accuracy)
    # the root angle of the cutter's depth makes the foundation 2 to 5 % stiffer in this pair
    foundation = np.interp(roll_length, plain.roll_length, plain.foundation)
    assert 0.94 < foundation / ROSS_TOOTH[angle][3] < 0.985


def test_tooth_energies_against_quadrature():
    # a cantilever loaded at the tip: bending energy integrated by brute force over the same outline
    gear = ross_pair().driver
    tooth = tooth_compliance(gear)
    half, height = rack_root(gear, 4000)
    roll_length = np.linspace(tooth.roll_length[0], gear.tip_roll_length, 8000)
    beta = roll_length / gear.base_radius - gear.base_half_angle
    x = gear.base_radius * (roll_length / gear.base_radius * np.cos(beta) - np.sin(beta))
    y = gear.base_radius * (roll_length / gear.base_radius * np.sin(beta) + np.cos(beta))
    outline_x, outline_y = np.concatenate([half, x[1:]]), np.concatenate([height, y[1:]])
    lever = math.cos(beta[-1]) * (y[-1] - outline_y) - x[-1] * math.sin(beta[-1])
    density = lever**2 / (gear.material.youngs_modulus * 2 / 3 * outline_x**3 * gear.face_width)
    assert tooth.bending[-1] == pytest.approx(np.trapezoid(density, outline_y), rel=1e-4)


def test_rack_root_meets_circle_and_flank():
    gear = GearPair.paper().driver
    half, height = rack_root(gear)
    assert math.hypot(half[0], height[0]) == pytest.approx(gear.root_radius, rel=1e-12)
    radius = math.hypot(half[-1], height[-1])
    assert math.atan(half[-1] / height[-1]) == pytest.approx(gear.half_angle(radius), rel=1e-9)


def test_mesh_stiffness_over_the_cycle():
    pair = GearPair.paper()
    curve = mesh_stiffness(pair, 1000)
    double = curve.phase < pair.contact_ratio - 1
    assert curve.stiffness[double].min() > curve.stiffness[~double].max()
    assert curve.mean == pytest.approx(pair.contact_ratio * curve.single.mean(), rel=1e-2)
    # symmetric pair: the single stiffness is the same entering and leaving
    assert curve.single == pytest.approx(curve.single[::-1], rel=1e-6)


def test_helical_sections_pass_the_path_one_after_the_other():
    def pair(helix):
        return GearPair(*(GearSpec(z, "3 mm", helix_angle=helix, face_width="10 mm", hand=hand)
                          for z, hand in ((25, "right"), (40, "left"))))  # fmt: skip

    helical = pair("20 deg")
    curve = mesh_stiffness(helical, 400)
    cosine = math.cos(helical.driver.base_helix_angle)
    begin, path = helical.first_roll_lengths[0], np.linspace(0.0, helical.path_of_contact, 1001)
    alone = np.trapezoid(pair_stiffness(helical, begin + path), path) / helical.driver.base_pitch
    assert curve.mean == pytest.approx(cosine * alone, rel=1e-4)
    assert curve.single_phase[-1] == helical.total_contact_ratio
    assert curve.single[[0, -1]] == pytest.approx(0.0)
    # what the contact itself says of the same energies under next to no load
    found = loaded_transmission_error(helical.with_potential_energy_stiffness(), 1.0, 24).stiffness
    wanted = curve.stiffness.min(), curve.stiffness.max(), curve.mean
    assert (found.min(), found.max(), found.mean()) == pytest.approx(wanted, rel=0.015)
    # of hardly any helix it is the spur pair's
    spur, nearly = mesh_stiffness(pair(0.0), 100), mesh_stiffness(pair("0.001 deg"), 100)
    assert np.median(np.abs(nearly.stiffness / spur.stiffness - 1.0)) < 1e-4


def test_iso_6336():
    # q' = 0.04723 + (0.15551 + 0.25791) / 29, c' = 0.8 (1 + 0.5 (1.2 - 1.25)) / q' E / 206 GPa in N/(mm um)
    pair = GearPair.paper()
    c = 0.8 * 0.975 / (0.04723 + 0.41342 / 29) * 207 / 206
    assert iso_single_stiffness(pair) / 1e9 == pytest.approx(c, rel=1e-12)
    assert iso_mesh_stiffness(pair) / iso_single_stiffness(pair) == pytest.approx(0.75 * 1.64594 + 0.25, rel=1e-5)


def test_iso_6336_does_not_ask_which_wheel_drives():
    """The standard's wheel 1 is the pinion: a pair that gears up is as stiff as the same one that gears down."""
    one, two = (GearSpec(z, "3 mm", profile_shift=x) for z, x in ((20, 0.3), (50, -0.1)))
    down, up = (iso_single_stiffness(GearPair(*wheels).geometry) for wheels in ((one, two), (two, one)))
    assert up == pytest.approx(down, rel=1e-12)


@pytest.mark.parametrize("helix", [0.0, "25 deg"])
def test_a_torque_that_is_given_yields_as_the_pairs_own(helix):
    wheels = [GearSpec(z, "3 mm", helix_angle=helix, hand=hand) for z, hand in ((25, "right"), (40, "left"))]
    pair = GearPair(*wheels, torque=150.0)
    assert pair.penetration(150.0, 2) == pair.penetration(pairs=2)
    assert pair.mesh_stiffness("150 N m") == pair.mesh_stiffness()


def test_iso_6336_as_the_stiffness_of_a_pair():
    pair = GearPair.paper()
    single = pair.with_iso_stiffness()
    # one pair alone at the pitch point: F_n = c' b x
    assert single.penetration(100.0) == pytest.approx(pair.normal_force / (iso_single_stiffness(pair) * 20e-3))
    mesh = pair.with_iso_stiffness("mesh")
    # over a cycle a contact ratio of pairs is in touch on average
    assert mesh.contact.stiffness * pair.contact_ratio == pytest.approx(iso_mesh_stiffness(pair) * 20e-3)
    with pytest.raises(ValueError, match="kind is 'both'"):
        pair.with_iso_stiffness("both")


@pytest.mark.parametrize("kind", ["iso", "iso single", "potential-energy"])
@pytest.mark.parametrize("load", ["slices", "adams"])
def test_stiffness_of_faces_in_mesh_in_part(kind, load):
    """Shifted wheels are as stiff and as damped as the part of them that is in mesh, by all ways to ask."""
    from gearmbs.gears import loaded_transmission_error

    def made(width, shift=0.0, slices=None):
        wheels = [GearSpec(z, "3 mm", face_width=b, bore_radius="8 mm") for z, b in ((25, width), (40, "24 mm"))]
        given = {"load": load, "slices": slices, "backlash": "0.1 mm", "torque": 5.0}
        return GearPair(*wheels, axial_shift=shift, **given).with_own_stiffness(kind)

    whole = made("20 mm")
    for shift, share in (("2 mm", 1.0), ("-9.5 mm", 0.625), ("17 mm", 0.25)):
        shifted = made("20 mm", shift)
        assert shifted.common_face_width == pytest.approx(share * 0.02)
        assert shifted.mean_mesh_stiffness == pytest.approx(share * whole.mean_mesh_stiffness)
        assert shifted.mesh_stiffness(5.0) == pytest.approx(share * whole.mesh_stiffness(5.0))
        assert shifted.penetration(5.0) == pytest.approx(whole.penetration(5.0) / share)
        energies = [mesh_stiffness(pair, 20).mean for pair in (shifted, whole)]
        assert energies[0] == pytest.approx(share * energies[1])
        assert hertz_stiffness(shifted) == pytest.approx(share * hertz_stiffness(whole))
        # what the contact itself says, in sections and with a single one
        for slices in (None, 1):
            found = loaded_transmission_error(made("20 mm", shift, slices), 5.0 * share, 10).stiffness.mean()
            wanted = share * loaded_transmission_error(whole, 5.0, 10).stiffness.mean()
            # the ends of two faces are blended over a micrometre where they tie
            assert found == pytest.approx(wanted, rel=5e-4)
        # 2 zeta sqrt(k m), with the wheels' masses and what is in mesh
        in_mesh = shifted.contact_model.face_share(shifted.geometry)
        damping = [pair.contact.damping * part for pair, part in ((shifted, in_mesh), (whole, 1.0))]
        assert damping[0] / damping[1] == pytest.approx(math.sqrt(share))


def test_cracks_soften_with_depth():
    pair = GearPair.paper()
    roll_length = np.linspace(9e-3, 20e-3, 30)
    healthy = pair_stiffness(pair, roll_length)
    last = healthy
    for depth in (0.5e-3, 1e-3, 2e-3, 3e-3):
        now = pair_stiffness(pair, roll_length, (Crack(depth), None))
        assert np.all(now <= last)
        last = now
    assert (last / healthy).min() < 0.95
    with pytest.raises(ValueError, match="crack depth"):
        tooth_compliance(pair.driver, Crack(20e-3))


def test_pair_with_potential_energy_stiffness_carries_the_load():
    from gearmbs.gears import loaded_transmission_error

    pair = GearPair.paper().with_potential_energy_stiffness()
    error = loaded_transmission_error(pair, 100.0, 50)
    curve = mesh_stiffness(pair, 50)
    assert error.error.max() == pytest.approx(pair.normal_force / curve.stiffness.min(), rel=0.02)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda pair: Crack(-1e-3), ("Crack.depth", "-0.001 m", "positive")),
        (lambda pair: Crack(1e-3, 70), ("Crack.angle", "4011 deg", "'70 deg'")),
        (lambda pair: mesh_stiffness(pair, 0), ("points", "0", "give")),
        (lambda pair: mesh_stiffness(pair, load=-5.0), ("load", "-5.0", "'300 N/mm'")),
        (lambda pair: loaded_transmission_error(pair, points=2.5), ("points", "2.5", "give")),
        (lambda pair: loaded_transmission_error(pair, start=math.inf), ("start", "inf", "give")),
        (lambda pair: ContactLaw.impact(depth=0.1), ("ContactLaw.depth", "100 mm", "'0.1 mm'")),
        (lambda pair: ContactLaw.hertz_line(face_width=20), ("ContactLaw.face_width", "20 m", "'20 mm'")),
        (lambda pair: ContactLaw.hertz_line(poisson_ratio=1.0), ("poisson_ratio", "1.0", "give")),
        (lambda pair: pair.with_own_stiffness(damping_ratio=7), ("damping_ratio", "7", "0.07")),
        (lambda pair: IdealMesh(pair, 4e8, error=[1, 2, 3, 4]), ("IdealMesh.error", "4 m", "3.065 mm")),
    ],
)
def test_numbers_of_other_units_and_none_are_refused(call, told):
    with pytest.raises(ValueError, match=says(*told)):
        call(GearPair.paper())


def test_numbers_of_other_units_as_they_are_meant():
    pair = GearPair.paper()
    assert mesh_stiffness(pair, 5, load="300 N/mm").mean == mesh_stiffness(pair, 5).mean
    assert ContactLaw.impact(depth="0.1 mm").depth == ContactLaw.impact().depth
    # undamped, any depth; of steel as its formula has it
    assert ContactLaw.linear("1e5 N/mm", depth=0.1).damping == 0.0
    steel = ContactLaw.hertz_line("20 mm", "206 GPa", 0.3).stiffness
    assert steel * (3.84e-8 * 100**0.9 / 20**0.8) ** (10 / 9) == pytest.approx(100.0)
    assert pair.with_own_stiffness(damping_ratio=1.0).contact.damping > 0.0
    assert IdealMesh(pair, 4e8, error=[1e-6, 2e-6, 0.0, -1e-6]).error[1] == 2e-6


def test_mesh_stiffness_tells_that_it_leaves_cracks_out():
    pair = GearPair.paper()
    with pytest.warns(UserWarning, match=says("mesh_stiffness", "pair_stiffness", "pair's root cracks")):
        curve = mesh_stiffness(pair.with_faults(RootCrack()), 20)
    assert np.array_equal(curve.stiffness, mesh_stiffness(pair, 20).stiffness)


def test_internal_teeth_by_energy():
    one, ring = GearSpec(23, "3 mm"), GearSpec.ring(70, "3 mm")
    tooth = tooth_compliance(ring)
    assert np.all(np.diff(tooth.roll_length) > 0)
    # softest at the tip, which has the shorter length of roll
    assert np.all(np.diff(tooth.total) < 0)
    pair = GearPair(one, ring, backlash="0.1 mm")
    outside = GearPair(one, GearSpec(70, "3 mm"))
    assert mesh_stiffness(pair).mean > mesh_stiffness(outside).mean
    # the outline the beam follows: from the root circle along the arc to the involute
    half, height = ring_root(ring)
    radius = np.hypot(half, height)
    assert (radius[0], radius[-1]) == pytest.approx((ring.root_radius, ring.form_radius), rel=1e-12)
    assert math.atan2(half[-1], height[-1]) == pytest.approx(ring.half_angle(ring.form_radius), rel=1e-12)
    rolls = compliance_roll_lengths(pair.geometry)
    cracked = pair_stiffness(pair.geometry, rolls, (None, Crack(2e-3)))
    assert np.all(cracked < pair_stiffness(pair.geometry, rolls))


def test_a_short_internal_tooth_is_a_beam_of_its_outline():
    # bending alone, by quadrature over the beam's sections
    ring = GearSpec.ring(70, "3 mm")
    tooth = tooth_compliance(ring)
    roll = ring.tip_roll_length
    beta = roll / ring.base_radius + ring.base_half_angle
    load = np.array(
        [
            ring.base_radius * math.sin(beta) - roll * math.cos(beta),
            ring.base_radius * math.cos(beta) + roll * math.sin(beta),
        ]
    )
    assert math.hypot(*load) == pytest.approx(ring.tip_radius)
    half, height = ring_root(ring, 4000)
    radii = np.linspace(ring.form_radius, ring.tip_radius, 8000)
    angle = np.array([ring.half_angle(r) for r in radii])
    x = np.concatenate([half, (radii * np.sin(angle))[1:]])
    y = np.concatenate([height, (radii * np.cos(angle))[1:]])
    moment = math.cos(beta) * (y - load[1]) - math.sin(beta) * load[0]
    density = moment**2 / (ring.material.youngs_modulus * (2 * x) ** 3 * ring.face_width / 12)
    energy = float((0.5 * (density[1:] + density[:-1]) * -np.diff(y)).sum())
    assert tooth.bending[0] == pytest.approx(energy, rel=1e-4)


def test_a_solid_wheel_is_no_ring_on_a_thin_bore():
    # the smaller the bore the more the disc turns against it, which is no compliance of a tooth
    solid, *held = (
        mesh_stiffness(GearPair(*(GearSpec(30, "3 mm", bore_radius=bore),) * 2), 20).mean
        for bore in (0.0, 0.02, 0.01, 0.005)
    )
    assert solid > held[0] > held[1] > held[2]
    wheel = GearSpec(30, "3 mm", bore_radius="10 mm")
    apart = tooth_compliance(wheel).total - tooth_compliance(GearSpec(30, "3 mm")).total
    # r_b^2 / (4 pi G b) (1 / r_bore^2 - 1 / r_f^2)
    shear = wheel.material.youngs_modulus / (2 * (1 + wheel.material.poisson_ratio))
    turn = (1 / 0.01**2 - 1 / wheel.root_radius**2) / (4 * math.pi * shear * wheel.face_width)
    assert apart == pytest.approx(np.full(apart.size, wheel.base_radius**2 * turn), rel=1e-9)
    with pytest.raises(ValueError, match="bore_radius is 0"):
        tooth_compliance(GearSpec(30, "3 mm"), sainsot=True)


def test_flattening_by_quadrature():
    """Against the integral of Flamant's strain along the normal under the pressure of Hertz, in plane strain."""
    from gearmbs.gears.stiffness import contact_half_width, flattening

    wheel, depth, a = GearSpec(30, "3 mm"), 2e-3, 1e-4
    young, nu = wheel.material.youngs_modulus, wheel.material.poisson_ratio
    ratio = nu / (1 - nu)

    def displacement(z):
        # half plane under a line load at x = a sin t, relative to the depth of reference: Timoshenko and Goodier, 36
        t = (np.arange(4000) + 0.5) / 4000 * math.pi - 0.5 * math.pi
        x, weight = a * np.sin(t), 2 / math.pi * np.cos(t) ** 2 * math.pi / 4000
        r2 = x**2 + z**2
        return float(np.sum(weight * (-np.log(r2) + z**2 / r2 * (1 + ratio))) * (1 - nu**2) / (math.pi * young))

    apart = displacement(0.0) - displacement(depth)
    assert float(flattening(wheel, depth, a)) * wheel.face_width == pytest.approx(apart, rel=2e-3)
    pair = GearPair(wheel, GearSpec.ring(80, "3 mm"), backlash="0.1 mm").geometry
    convex = GearPair(wheel, GearSpec(80, "3 mm")).geometry
    roll = np.array([wheel.base_radius * math.tan(ALPHA)])
    # the flank of a ring is hollow: a wider contact
    assert contact_half_width(pair, roll, 1e5) > contact_half_width(convex, roll, 1e5)
    soft = 2 * (1 - nu**2) / young
    curvature = 1 / roll[0] + 1 / convex.mate_roll_length(0, roll)[0]
    wanted = math.sqrt(4 * 1e5 * soft / math.pi / curvature)
    assert contact_half_width(convex, roll, 1e5)[0] == pytest.approx(wanted, rel=1e-12)


@pytest.mark.slow
def test_finite_elements_of_a_pair():
    """Repeat a row of each table of ``docs/data/tooth_stiffness.txt``."""
    pytest.importorskip("skfem")
    from pathlib import Path

    from benchmarks.tooth_stiffness import EXAMPLES, bore_row, mean_row, pair_row

    text = (Path(__file__).parents[2] / "docs" / "data" / "tooth_stiffness.txt").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.strip("|\n ").split("|")] for line in text.splitlines()]

    def stored(*begin):
        return [float(cell) for row in rows if row[: len(begin)] == list(begin) for cell in row[len(begin) :]]

    one = EXAMPLES[1]
    # three digits are kept
    found = pair_row(one, 2e5)
    assert found == pytest.approx(stored(one.name, "200"), rel=5e-3)
    fine, flattened, _, energies, _, iso, theoretical = found
    assert fine == pytest.approx(flattened, rel=0.03)
    assert energies == pytest.approx(fine, rel=0.07)
    assert iso == pytest.approx(fine, rel=0.1)
    assert theoretical > 1.2 * fine
    assert bore_row(EXAMPLES[0].pair.driver, 0.5) == pytest.approx(stored("0.5"), rel=5e-3)
    means = mean_row(one)
    assert means == pytest.approx(
        next([float(c) for c in r[1:]] for r in rows if r[0] == one.name and len(r) == 8), rel=5e-3
    )
    _, together, alone, mesh = means[:4]
    assert mesh == pytest.approx(together, rel=0.1)
    assert alone > 1.1 * together
