"""Planetary sets: assembly, phases, Willis, modes against a published table, load sharing, faults, bad input."""

import math
import re
import warnings

import numpy as np
import pytest

from gearmbs.gears import ContactLaw, FlankFriction, GearSpec, IdealMesh, PlanetarySet, Support, faults, planetary
from gearmbs.gears import planetary_mechanism as mechanism_of
from gearmbs.mechanism import linear_modes, static_equilibrium
from tests.says import says

TABLE = {
    3: (
        [1475.7, 1930.3, 2658.3, 7462.8, 11775.3],
        [743.2, 1102.4, 1896.0, 2276.4, 6986.3, 9647.9],
        [],
    ),
    5: (
        [1567.4, 2006.1, 2614.8, 8065.4, 14253.1],
        [710.0, 1072.0, 1888.1, 2425.3, 7382.4, 11172.3],
        [1808.2, 5963.8, 6981.7],
    ),
}
"""Lin and Parker, J. Vib. Acoust. 121 (1999) 316: rotational, translational (double) and planet modes, Hz."""


def published_set(count, **settings):
    # only the inertias over the squares of the radii matter, and the pressure angle
    settings.setdefault("ideal", (5e8, 5e8))
    return planetary((60, 30, 120), "2 mm", count, pressure_angle="24.6 deg", wheels={"addendum": "1.6 mm"}, **settings)


def published_mechanism(gears):
    radii = {"sun": gears.sun.base_radius, "planet": gears.planet.base_radius, "ring": gears.ring.base_radius}
    radii["carrier"] = gears.carrier_radius
    masses = {"sun": (0.40, 0.39), "planet": (0.66, 0.61), "ring": (2.35, 3.00), "carrier": (5.43, 6.29)}
    free = Support(radial=1e8)
    return mechanism_of(
        gears,
        held=None,
        supports={"sun": free, "carrier": free, "ring": Support(radial=1e8, torsional=1e9 * radii["ring"] ** 2)},
        pins=free,
        masses={name: (mass, share * radii[name] ** 2) for name, (mass, share) in masses.items()},
    )


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_natural_frequencies(count):
    found = np.sort(linear_modes(published_mechanism(published_set(count))).frequencies)
    assert found.size == 6 + 12 + 3 * (count - 3)
    assert found[0] < 1
    single, double, planets = TABLE.get(count, ([], [], TABLE[5][2]))
    expected = single + 2 * double + (count - 3) * planets
    for value in expected:
        assert np.abs(found - value).min() < 0.1
    if count in TABLE:
        np.testing.assert_allclose(found[1:], np.sort(expected), atol=0.1)
    for value in planets if count > 3 else []:
        assert (np.abs(found - value) < 0.1).sum() == count - 3


def squares_from_springs(angles, stiffness_sun, stiffness_ring):
    """Lin and Parker's lumped model written anew, from the strain of each spring (x, y, turn of each body).

    The squares of the angular frequencies in rising order, and what rounding may move them by: n eps of the largest,
    as it perturbs the matrix by that much.
    """
    gears = published_set(3)
    alpha = math.radians(24.6)
    sun, planet, ring, arm = (
        gears.sun.base_radius, gears.planet.base_radius, gears.ring.base_radius, gears.carrier_radius,
    )  # fmt: skip
    bodies = [(5.43, 6.29 * arm**2), (2.35, 3.00 * ring**2), (0.40, 0.39 * sun**2)]
    bodies += [(0.66, 0.61 * planet**2)] * len(angles)
    weight = np.array([value for mass, inertia in bodies for value in (mass, mass, inertia)])
    total = np.zeros((weight.size, weight.size))

    def spring(stiffness, *parts):
        strain = np.zeros(weight.size)
        for body, values in parts:
            strain[3 * body : 3 * body + 3] += values
        total[:] += stiffness * np.outer(strain, strain)

    for body in range(3):
        spring(1e8, (body, (1, 0, 0)))
        spring(1e8, (body, (0, 1, 0)))
    spring(1e9 * ring**2, (1, (0, 0, 1)))
    for k, psi in enumerate(angles):
        outwards, onwards = np.array([math.cos(psi), math.sin(psi)]), np.array([-math.sin(psi), math.cos(psi)])
        to_planet = math.cos(alpha) * onwards + math.sin(alpha) * outwards
        to_ring = math.cos(alpha) * onwards - math.sin(alpha) * outwards
        spring(stiffness_sun, (2, (*to_planet, sun)), (3 + k, (*-to_planet, planet)))
        spring(stiffness_ring, (3 + k, (*to_ring, planet)), (1, (*-to_ring, -ring)))
        for axis in np.eye(2):
            spring(1e8, (3 + k, (*axis, 0)), (0, (*-axis, -arm * (onwards @ axis))))
    squares = np.linalg.eigvalsh(total / np.sqrt(np.outer(weight, weight)))
    return squares, squares.size * np.finfo(float).eps * squares[-1]


@pytest.mark.parametrize(
    ("places", "stiffness"),
    [
        ([0, 45, 90, 135], (5e8, 5e8)),
        ([0, 30, 60, 90, 120, 150], (5e8, 5e8)),
        ([0, 44, 90, 134], (5e8, 5e8)),
        ([0, 29, 61, 92, 119, 150], (3e8, 7e8)),
    ],
)
def test_natural_frequencies_against_a_model_written_anew(places, stiffness):
    # 60 + 120 teeth: planets fit at multiples of 2 degrees
    angles = [2 * math.pi * place / 180 for place in places]
    gears = published_set(len(angles), angles=angles, ideal=stiffness)
    found = np.sort(linear_modes(published_mechanism(gears)).frequencies)
    squares, rounding = squares_from_springs(angles, *stiffness)
    # all turn together
    assert found[0] == 0
    assert abs(squares[0]) < rounding < 1e-6 * squares[1]
    np.testing.assert_allclose(found[1:], np.sqrt(squares[1:]) / (2 * math.pi), atol=1e-6)


def test_planet_modes_do_not_know_the_central_members():
    gears = published_set(5)
    expected = [1808.181, 5963.760, 6981.705]
    found = linear_modes(published_mechanism(gears)).frequencies
    for value in expected:
        np.testing.assert_allclose(np.sort(np.abs(found - value))[:2], 0, atol=2e-3)


def test_unequal_spacing_splits_pairs():
    angles = [0, 2 * math.pi * 44 / 180, 2 * math.pi * 90 / 180, 2 * math.pi * 134 / 180]
    found = np.sort(linear_modes(published_mechanism(published_set(4, angles=angles))).frequencies)
    equal = np.sort(linear_modes(published_mechanism(published_set(4))).frequencies)
    assert found.size == equal.size == 21
    assert np.diff(equal[1:3]) < 1e-3
    assert np.diff(found[1:3]) > 0.1


@pytest.mark.parametrize(
    ("teeth", "count", "shifts", "phases"),
    [
        ((30, 20, 70), 4, (0, 0, 0), [0, 0.5, 0, 0.5]),
        ((21, 39, 99), 3, (0, 0, 0), [0, 0, 0]),
        ((28, 36, 100), 4, (0, 0, 0), [0, 0, 0, 0]),
    ],
)
def test_mesh_phases(teeth, count, shifts, phases):
    gears = planetary(teeth, "2 mm", count, profile_shifts=shifts)
    np.testing.assert_allclose(gears.mesh_phases("sun"), phases, atol=1e-9)
    np.testing.assert_allclose(gears.mesh_phases("ring"), -np.array(phases) % 1, atol=1e-9)


def test_phases_of_a_set_that_only_fits_with_shifts():
    sun, planet = (GearSpec(z, "2 mm", profile_shift=0.4, name=n) for z, n in ((18, "sun"), (36, "planet")))
    ring = GearSpec.ring(93, "2 mm", profile_shift=0.45, addendum="1.6 mm")
    gears = PlanetarySet(sun, planet, ring, 3)
    assert not gears.mesh_phases("sun").any()
    assert not gears.mesh_phases("ring").any()


def test_phases_of_the_first_stage_of_a_wind_turbine():
    gears = planetary((19, 17, 56), "45 mm", 3, profile_shifts=(0.617, 0.802, -0.501), carrier_radius="863 mm")
    np.testing.assert_allclose(gears.mesh_phases("ring"), [0, 1 / 3, 2 / 3], atol=1e-9)
    assert gears.speeds(sun=1.0, ring=0.0)["carrier"] == pytest.approx(1 / 3.9473684, rel=1e-7)
    assert [gears.harmonic_action(h) for h in (1, 2, 3)] == ["force", "force", "torque"]


def test_a_second_wheel_that_does_not_reach_the_ring_is_refused():
    step = GearSpec(20, "1.5 mm", name="step")
    assert planetary((24, 30, 74), "1.5 mm", 1, planet_at_ring=step).pairs_ring[0].centre_distance == 40.5e-3
    with pytest.raises(ValueError, match=says("step", "ring", "carrier_radius", "40.5000 mm", "48.0000 mm")):
        planetary((24, 30, 84), "1.5 mm", 1, planet_at_ring=step).pairs_ring  # noqa: B018


def test_backlash_beyond_what_was_asked_is_told():
    """A carrier 0.1 mm too wide leaves 2 sin(alpha) of it between sun and planet; the ring is thinned as asked."""
    wide = {"carrier_radius": "40.6 mm", "backlash_sun": "0.05 mm", "backlash_ring": "0.05 mm"}
    said = says("backlash_sun", "0.05 mm", "carrier_radius", "40.6000 mm sun", "0.06904 mm")
    with pytest.warns(UserWarning, match=said):
        gears = planetary((24, 30, 84), "1.5 mm", **wide)
    assert gears.pairs_sun[0].normal_backlash == pytest.approx(2e-4 * np.sin(np.radians(20.0)), rel=0.01)
    assert gears.pairs_ring[0].normal_backlash == pytest.approx(0.05e-3, rel=1e-6)
    # as drawn, or where the backlash is left to the drawing, nothing is to be told
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*backlash_sun")
        for settings in ({**wide, "carrier_radius": "40.5 mm"}, {"carrier_radius": "40.6 mm"}):
            assert planetary((24, 30, 84), "1.5 mm", **settings).pairs_sun


def test_harmonics_of_unequally_spaced_planets():
    """Equal angles leave a torque alone, others torque and force; two opposite pairs act as four equal planets do."""
    equal = planetary((24, 30, 84), "1.5 mm")
    assert [equal.harmonic_action(h, "sun") for h in (0, 1, 2)] == ["torque"] * 3
    uneven = planetary((24, 30, 84), "1.5 mm", angles=["0 deg", "120 deg", "200 deg"])
    # phases 0, 0, 1/3 of a cycle: the sum of the third harmonics is as large as of planets in phase, for torque
    assert [uneven.harmonic_action(h, "sun") for h in (1, 3)] == ["torque and force"] * 2
    pairs = planetary((24, 30, 84), "1.5 mm", planets=4, angles=["0 deg", "80 deg", "180 deg", "260 deg"])
    assert [pairs.harmonic_action(h, "sun") for h in (1, 2, 3)] == ["torque"] * 3
    for wrong in ({"harmonic": 1.5}, {"harmonic": -1}, {"harmonic": 1, "which": "carrier"}):
        with pytest.raises(ValueError, match=r"harmonic is|choose 'sun' or 'ring'"):
            equal.harmonic_action(**wrong)


def test_laws_of_speeds_and_torques():
    gears = planetary((28, 36, 100), "2 mm", 4)
    speeds = gears.speeds(sun=30.0, carrier=2.0)
    left = (speeds["sun"] - speeds["carrier"]) * 28
    assert left == pytest.approx(-(speeds["ring"] - speeds["carrier"]) * 100, abs=1e-12)
    torques = gears.torques(sun=28.0)
    assert torques == pytest.approx({"sun": 28.0, "ring": 100.0, "carrier": -128.0})
    power = sum(torques[m] * speeds[m] for m in torques)
    assert power == pytest.approx(0, abs=1e-9)
    assert gears.efficiency(1.0) == 1.0
    f = gears.frequencies(carrier=2 * math.pi, ring=0.0)
    assert f["mesh"] == pytest.approx(100)
    assert f["mesh_ring"] == pytest.approx(100)
    assert f["planet_fault"] == pytest.approx(100 / 36)
    assert f["sun_fault"] == pytest.approx(4 * 100 / 28)
    assert f["ring_fault"] == pytest.approx(4)


LINEAR = ContactLaw.linear("3e8 N/m", "1500 N*s/m", "10 um")


def small_set(**settings):
    return planetary((24, 30, 84), "1.5 mm", 3, contact=LINEAR, friction=FlankFriction.none(), **settings)


def equilibrium_forces(gears, **more):
    m = mechanism_of(gears, speeds={"sun": 0.0}, torques={"carrier": -90.0}, run_up=0, **more)
    found = static_equilibrium(m)
    names = [f"sun-planet {k + 1}" for k in range(gears.planets)]
    return np.array([float(np.asarray(found.solution.diagnostics(n)["normal_force"])[-1]) for n in names])


def test_planets_share_the_load():
    forces = equilibrium_forces(small_set(backlash_sun="0.05 mm", backlash_ring="0.05 mm"))
    np.testing.assert_allclose(forces / forces.sum(), 1 / 3, atol=1e-8)


def test_a_pin_error_shifts_load_by_the_linear_value():
    error, sun, ring = 2e-6, 3e8, 4e8
    gears = small_set(ideal=(sun, ring), pin_errors={1: (0.0, error)})
    forces = equilibrium_forces(gears)
    alpha = gears.pairs_sun[0].working_pressure_angle
    # a pin that is off by u along its path deflects both meshes: F (1 / k_s + 1 / k_r) = 2 u cos(alpha)
    by_error = 2 * error * math.cos(alpha) / (1 / sun + 1 / ring)
    expected = np.array([-1 / 3, 2 / 3, -1 / 3]) * by_error
    # loads are negative: the carrier is held back, the pin error relieves or loads with the sense of the torque
    shift = forces - forces.mean()
    np.testing.assert_allclose(np.abs(shift), np.abs(expected), rtol=2e-3)
    assert shift[0] == pytest.approx(shift[2], rel=1e-3)


@pytest.mark.slow
def test_willis_in_a_simulation_with_tooth_contact():
    # in the steady state all repeats with the mesh: the mean over whole mesh cycles is exact
    damped = ContactLaw.linear("3e8 N/m", "20000 N*s/m", "10 um")
    gears = planetary(
        (24, 30, 84),
        "1.5 mm",
        contact=damped,
        friction=FlankFriction.none(),
        backlash_sun="0.05 mm",
        backlash_ring="0.05 mm",
    )
    m = mechanism_of(gears, speeds={"sun": "300 rpm"}, torques={"carrier": "-60 N m"}, run_up="0.01 s")
    mesh = (5 - 5 / 4.5) * 24
    solution = m.simulate(20 / mesh, rate=8 * mesh, tol=1e-8)
    carrier, sun = (solution.joint_angle(f"{seat} seat")[[128, 160]] for seat in ("carrier", "sun"))
    # angles are good to the tolerance of a step
    assert np.ptp(carrier) / np.ptp(sun) == pytest.approx(1 / 4.5, rel=1e-8 / np.ptp(carrier))
    force = np.mean([solution.diagnostics(f"sun-planet {k}")["normal_force"][128:160].mean() for k in (1, 2, 3)])
    assert 3 * force * gears.sun.base_radius == pytest.approx(60 / 4.5, rel=0.01)


def test_willis_and_torques_with_ideal_meshes():
    gears = planetary((24, 30, 84), "1.5 mm", ideal=(3e8, 4e8), ideal_damping=3000.0)
    m = mechanism_of(gears, speeds={"sun": "300 rpm"}, torques={"carrier": "-60 N m"}, run_up="0.02 s")
    solution = m.simulate(0.2, rate=1000, tol=1e-10)
    turned = solution.joint_angle("carrier seat"), solution.joint_angle("sun seat")
    assert (turned[0][-1] - turned[0][100]) / (turned[1][-1] - turned[1][100]) == pytest.approx(1 / 4.5, rel=1e-9)
    forces = {mesh: sum(solution.diagnostics(mesh.format(k))["normal_force"][-1] for k in (1, 2, 3))
              for mesh in ("sun-planet {}", "planet {}-ring")}  # fmt: skip
    # T_s : T_r : T_c = z_s : z_r : -(z_s + z_r)
    assert forces["sun-planet {}"] * gears.sun.base_radius == pytest.approx(60 * 24 / 108, rel=1e-6)
    assert forces["planet {}-ring"] * gears.ring.base_radius == pytest.approx(60 * 84 / 108, rel=1e-6)


def test_a_held_ring_is_integrated_as_ground():
    gears = small_set(ideal=(3e8, 4e8), ideal_damping=3000.0)
    m = mechanism_of(gears, speeds={"sun": "300 rpm"}, torques={"carrier": "-60 N m"}, run_up="5 ms")
    own, all_bodies = (m.simulate(0.01, rate=1000, tol=1e-9, **how) for how in ({}, {"lump": False}))
    assert own.problem.n < all_bodies.problem.n
    for body in ("sun", "carrier", "ring", "planet 2"):
        np.testing.assert_allclose(own.angular_velocity(body), all_bodies.angular_velocity(body), atol=1e-5)
    seat, whole = (np.hstack(s.reaction("ring seat")) for s in (own, all_bodies))
    np.testing.assert_allclose(seat, whole, atol=1e-4 * abs(whole).max())


def test_torques_of_ideal_meshes_are_exact():
    gears = small_set(ideal=(3e8, 4e8))
    m = mechanism_of(gears, speeds={"sun": 0.0}, torques={"carrier": -90.0}, run_up=0)
    found = static_equilibrium(m).solution
    forces = equilibrium_forces(gears)
    assert forces.sum() * gears.sun.base_radius == pytest.approx(90 / 4.5, rel=1e-6)
    ring = [float(np.asarray(found.diagnostics(f"planet {k}-ring")["normal_force"])[-1]) for k in (1, 2, 3)]
    assert sum(ring) * gears.ring.base_radius == pytest.approx(90 * 84 / 108, rel=1e-6)


def test_faults_sit_where_they_belong():
    gears = small_set(
        faults=[
            ("planet 2 sun side", faults.BrokenTooth(tooth=3)),
            ("ring", faults.BrokenTooth(tooth=5)),
            ("planet 3", faults.BrokenTooth(tooth=1)),
        ]
    )
    first, second = (
        [[(f.label, f.wheel) for f in p.faults] for p in pairs] for pairs in (gears.pairs_sun, gears.pairs_ring)
    )
    assert [len(f) for f in first] == [0, 1, 1]
    assert [len(f) for f in second] == [1, 1, 2]
    assert first[1][0][1] == "driven"
    assert {wheel for _, wheel in second[2]} == {"driver", "driven"}


def test_stepped_planets_fit_by_their_own_timing():
    sun, large, small = GearSpec(24, "2 mm"), GearSpec(40, "2 mm"), GearSpec(20, "2 mm", name="small")
    ring = GearSpec.ring(84, "2 mm")
    gears = PlanetarySet(sun, large, ring, 3, planet_at_ring=small)
    assert gears.basic_ratio == pytest.approx(-40 / 24 * 84 / 20)
    start = gears.start_angles()
    assert start["steps"][0] == 0
    for psi, planet, step in zip(gears.angles, start["planets"], start["steps"]):
        pair = gears.pairs_ring[0]
        ring_angle = pair.driven_angle(planet + step - psi - math.pi) + psi + math.pi
        pitch = 2 * math.pi / 84
        assert abs((ring_angle - start["ring"] + 0.5 * pitch) % pitch - 0.5 * pitch) < 1e-9


def test_ideal_mesh_of_a_pair_has_its_stiffness():
    pair = small_set().pairs_sun[0]
    mesh = IdealMesh.from_contact(pair, 20.0, 16)
    stiffness, error = mesh.tables()
    assert stiffness.mean() == pytest.approx(1, abs=0.02)
    assert np.isfinite(error).all()
    assert mesh.stiffness == pytest.approx(3e8 * pair.contact_ratio, rel=0.1)


@pytest.mark.parametrize(("teeth", "planets"), [((24, 30, 84), 5), ((24, 31, 84), 3), ((24, 30, 80), 3)])
def test_the_set_that_is_recommended_fits(teeth, planets):
    with pytest.raises(ValueError) as caught:
        planetary(teeth, "2 mm", planets)
    found = tuple(int(z) for z in re.findall(r"(\d+), (\d+), (\d+) teeth", str(caught.value))[-1])
    assert planetary(found, "2 mm", planets).planets == planets


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: planetary((24, 30, 85), "2 mm", 3), says("nearest", "assembled")),
        (lambda: planetary((24, 30, 84), "2 mm", 5), says("angles", "0.0000", "73.3333", "25", "30", "85")),
        (lambda: planetary((24, 31, 84), "2 mm", 3), "z_r = z_s . 2 z_p = 86 teeth; .* shifts .* 24, 30, 84 teeth"),
        (lambda: planetary((24, 30, 84), "2 mm", 6), "neighbouring planets"),
        (lambda: planetary((24, 30, 28), "2 mm", 2), says("inside the base")),
        (lambda: planetary((24, 60, 50), "2 mm", 3), "ring has 50 teeth and planet 60"),
        (lambda: planetary((24, 30, 84), "2 mm", 3, faults=[("planet 4", faults.BrokenTooth())]), "planet 4"),
        (lambda: planetary((24, 30, 84), "2 mm", 3, angles=[0, 1]), "2 numbers for 3 planets"),
        (lambda: small_set().speeds(sun=1.0), says("speeds", "sun", "give two", "carrier", "ring")),
        (lambda: mechanism_of(small_set(), speeds={"ring": 1.0}), "ring is held"),
        (lambda: mechanism_of(small_set(), speeds={"sun": 1.0, "carrier": 1.0}), "all three members"),
        (lambda: mechanism_of(small_set(), held="planet"), "choose among"),
        (
            lambda: mechanism_of(small_set(), speeds={"sun": 9.0}, torques={"ring": "60 N m"}),
            says("torques", "'ring'", "60 N m", "held", "carrier"),
        ),
        (
            lambda: mechanism_of(small_set(), speeds={"sun": 9.0}, torques={"sun": 5.0}),
            says("torques", "'sun'", "5 N m"),
        ),
    ],
)
def test_bad_sets_are_one_line(build, words):
    with pytest.raises(ValueError, match=words) as caught:
        build()
    assert "\n" not in str(caught.value)


def test_torques_that_something_feels_are_taken():
    """On a member that springs hold, on one that turns as it is pushed, and none at all."""
    soft = {"ring": Support(radial=1e8, torsional=1e6)}
    torques = {"carrier": -60.0, "ring": "45 N m", "sun": 0.0}
    m = mechanism_of(small_set(), speeds={"sun": 9.0}, torques=torques, supports=soft)
    assert {"ring load", "carrier load"} <= set(m.elements)


def test_pins_that_are_stiffer_along_their_circle():
    """Under its weight a planet at the angle psi gives by m g (cos^2 psi / k_r + sin^2 psi / k_t)."""
    weak = planetary((24, 30, 84), "1.5 mm", ideal=(1.0, 1.0))
    pins = Support(radial=("2e6 N/m", 5e6))
    m = mechanism_of(weak, held="carrier", pins=pins, speeds={"sun": 0.0}, run_up=0, gravity=(9.81, 0.0, 0.0))
    rest = static_equilibrium(m).solution
    weight = 9.81 * weak.planet.mass
    for k, psi in enumerate(weak.angles, start=1):
        lower = rest.com_position(f"planet {k}")[-1][0] - m.bodies[f"planet {k}"].position[0]
        expected = weight * (math.cos(psi) ** 2 / 2e6 + math.sin(psi) ** 2 / 5e6)
        assert lower == pytest.approx(expected, rel=1e-4)
    assert Support(radial=3.0).across == (3.0, 3.0)
    with pytest.raises(ValueError, match=says("radial", "pair")):
        Support(radial=(1.0, 2.0, 3.0))


def test_wheels_of_a_set_have_fields_of_their_own():
    gears = planetary(
        (24, 30, 84),
        "1.5 mm",
        wheels={"bore_radius": "4 mm", "planet": {"bore_radius": "8 mm"}, "ring": {"bore_radius": 0.0}},
    )
    assert [w.bore_radius for w in (gears.sun, gears.planet, gears.ring)] == [0.004, 0.008, 0.0]


@pytest.mark.parametrize("name", ["backlash_sun", "backlash_ring"])
def test_negative_backlash_is_refused(name):
    for value in ("-1 mm", -1e-9):
        with pytest.raises(ValueError, match=rf"PlanetarySet.{name} is -.* mm.*give 0"):
            planetary((24, 30, 84), "1.5 mm", **{name: value})
    assert planetary((24, 30, 84), "1.5 mm", **{name: "0.05 mm"})


def test_pin_errors_are_lengths_that_teeth_allow():
    assert small_set(pin_errors={1: ("0 um", "5 um")}).pin_errors == {1: (0.0, pytest.approx(5e-6))}
    module = small_set().planet.module
    assert small_set(pin_errors={0: (0.2 * module, 0.0)}).pin_errors[0][0] == 0.2 * module
    for error, words in (
        ((0.0, 5e-3), ("pin_errors[0]", "5 mm", "roots")),
        ((float("nan"), 0.0), ("pin_errors[0]", "finite")),
        ((1.0,), ("pin_errors", "planet 0", "two lengths")),
    ):
        with pytest.raises(ValueError, match=says(*words)):
            small_set(pin_errors={0: error})
