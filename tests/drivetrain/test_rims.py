"""Rings of planetary stages in a drivetrain whose rims bend, beside finite elements that are assembled here."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    IdealBearing,
    PlanetaryStage,
    RunSettings,
    Shaft,
    SpeedDrive,
    TorqueLoad,
)
from gearmbs.gears import ContactLaw, ElasticRim, FlankFriction, Support, planetary
from gearmbs.studies import (
    load_train,
    mode_table,
    named_modes,
    ranked_crossings,
    run_train,
    train_campbell,
    train_modes,
)
from gearmbs.studies.train_files import write_train
from tests.says import says

TOOTH, PIN, BOLT = 4e8, 1e9, 2e8
"""N/m: of a pair of teeth, of pins, of bolts."""
SIX = [math.radians(60.0 * k) for k in range(6)]
RIM = ElasticRim(thickness="12 mm", waves=10, bolts=SIX, bolt_stiffness=(BOLT, BOLT), damping_ratio=0.01)


def gears(**changes):
    return planetary(
        (21, 39, 99), "3 mm", 3, face_width="40 mm", wheels={"fillet_radius": "0.8 mm"}, backlash_sun="0.05 mm",
        backlash_ring="0.05 mm", contact=ContactLaw.linear(TOOTH), friction=FlankFriction.none(), **changes,
    )  # fmt: skip


def stage(**changes):
    settings = {"pins": Support(radial=PIN, damping="2 us"), "rim": RIM} | changes
    return PlanetaryStage(name="low", gears=gears(), sun="lay", carrier="rotor", ring="ground", **settings)


def train(**changes):
    return Drivetrain(
        "low",
        shafts=[Shaft(name=name) for name in ("rotor", "lay")],
        bearings=[IdealBearing(name=f"{name} bearing", shaft=name) for name in ("rotor", "lay")],
        planetary_stages=[stage(**changes)],
        drives=[SpeedDrive(name="wind", shaft="rotor", speed="100 rpm")],
        loads=[TorqueLoad(name="brake", shaft="lay", torque=70.0)],
        running=True,
        run_up=0.01,
    )


def ring(count, radius, area, bending, density, stretch, modulus=2.1e11):
    """Return mass and stiffness of a closed ring of straight Euler beams over (x, y, turn) of its nodes."""
    mass, stiff = np.zeros((3 * count, 3 * count)), np.zeros((3 * count, 3 * count))
    at = radius * np.array([[math.cos(a), math.sin(a)] for a in 2.0 * math.pi * np.arange(count) / count])
    for k in range(count):
        one, two = at[k], at[(k + 1) % count]
        length = float(np.linalg.norm(two - one))
        c, s = (two - one) / length
        turn = scipy.linalg.block_diag(*[np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])] * 2)
        e, b = stretch * modulus * area / length, modulus * bending / length**3
        own = np.array([[e, 0, 0, -e, 0, 0], [0, 12 * b, 6 * b * length, 0, -12 * b, 6 * b * length],
                        [0, 6 * b * length, 4 * b * length**2, 0, -6 * b * length, 2 * b * length**2],
                        [-e, 0, 0, e, 0, 0], [0, -12 * b, -6 * b * length, 0, 12 * b, -6 * b * length],
                        [0, 6 * b * length, 2 * b * length**2, 0, -6 * b * length, 4 * b * length**2]])  # fmt: skip
        m, l = density * area * length / 420.0, length
        own_mass = m * np.array([[140, 0, 0, 70, 0, 0], [0, 156, 22 * l, 0, 54, -13 * l],
                                 [0, 22 * l, 4 * l**2, 0, 13 * l, -3 * l**2], [70, 0, 0, 140, 0, 0],
                                 [0, 54, 13 * l, 0, 156, -22 * l],
                                 [0, -13 * l, -3 * l**2, 0, -22 * l, 4 * l**2]])  # fmt: skip
        place = np.r_[3 * k : 3 * k + 3, 3 * ((k + 1) % count) : 3 * ((k + 1) % count) + 3]
        stiff[np.ix_(place, place)] += turn.T @ own @ turn
        mass[np.ix_(place, place)] += turn.T @ own_mass @ turn
    return at, mass, stiff


def matrices(made: Drivetrain, rim: ElasticRim, stretch: float, count: int = 120):
    """Return mass and stiffness of the stage with its carrier held, its sun turning alone, and its rim of beams.

    Parameters
    ----------
    made : Drivetrain
    rim : ElasticRim
    """
    part = made.planetary_stages[0]
    found, spec = part.with_rotation(made), part.gears.ring
    radius = spec.root_radius + 0.5 * rim.thickness
    at, ring_mass, ring_stiff = ring(
        count,
        radius,
        rim.thickness * spec.face_width,
        spec.face_width * rim.thickness**3 / 12,
        spec.material.density,
        stretch,
    )
    n = 10 + 3 * count
    mass, stiff = np.zeros((n, n)), np.zeros((n, n))
    mass[10:, 10:], stiff[10:, 10:] = ring_mass, ring_stiff

    def spring(k, row):
        stiff[:] += k * np.outer(row, row)

    def along(row, place, direction, x, first):
        """Add what a body, whose three coordinates begin at ``first``, moves along a line through a point."""
        row[first : first + 2] += direction
        arm = place - x
        row[first + 2] += arm[0] * direction[1] - arm[1] * direction[0]

    mass[0, 0] = made.build().bodies["lay"].inertia[2, 2]
    planet_mass, moments = part.weights["planet"]
    sun, planet, inner = (w.base_radius for w in (found.sun, found.planet, found.ring))
    angle = [float(a) for a in found.angles]
    for k, psi in enumerate(angle):
        out = np.array([math.cos(psi), math.sin(psi)])
        side = np.array([-out[1], out[0]])
        centre = float(found.carrier_radius) * out
        first = 1 + 3 * k
        mass[range(first, first + 3), range(first, first + 3)] = [planet_mass, planet_mass, moments[2]]
        for direction in (out, side):
            row = np.zeros(n)
            row[first : first + 2] = direction
            spring(PIN, row)
        # lines of action touch both base circles: on the sun's side across between the axes, on the ring's alongside
        a = math.acos((sun + planet) / float(found.carrier_radius))
        from_sun = math.cos(a) * out - found.rotation * math.sin(a) * side
        row = np.zeros(n)
        line = np.array([-from_sun[1], from_sun[0]])
        row[0] = sun
        other = np.zeros(n)
        along(other, centre - planet * from_sun, line, centre, first)
        spring(2.0 * TOOTH, row - other)
        a = math.acos((inner - planet) / float(found.carrier_radius))
        from_axis = math.cos(a) * out + found.rotation * math.sin(a) * side
        line = np.array([-from_axis[1], from_axis[0]])
        row, other = np.zeros(n), np.zeros(n)
        along(row, centre + planet * from_axis, line, centre, first)
        node = round(psi * count / (2.0 * math.pi)) % count
        along(other, inner * from_axis, line, at[node], 10 + 3 * node)
        spring(2.0 * TOOTH, row - other)
    for a in SIX:
        node = round(a * count / (2.0 * math.pi)) % count
        for direction in np.eye(2):
            row = np.zeros(n)
            row[10 + 3 * node : 12 + 3 * node] = direction
            spring(rim.bolt_stiffness[0], row)
    # the rim's own modes have two lobes and more: as a whole it stays with what it is bolted to
    held = np.zeros((3, n))
    for k, (x, y) in enumerate(at / radius):
        held[0, 10 + 3 * k], held[1, 11 + 3 * k] = 1.0, 1.0
        held[2, 10 + 3 * k : 12 + 3 * k] = -y, x
    basis = scipy.linalg.null_space(held)
    return basis.T @ mass @ basis, basis.T @ stiff @ basis


@pytest.mark.slow
@pytest.mark.parametrize(("stretch", "within"), [(1e3, 0.007), (1.0, 0.03)], ids=["does not stretch", "steel"])
def test_frequencies_beside_finite_elements(stretch, within):
    made = train(rim=replace(RIM, waves=24))
    found = train_modes(made)
    mass, stiff = matrices(made, RIM, stretch)
    expected = np.sqrt(scipy.linalg.eigh(stiff, mass, eigvals_only=True, subset_by_index=(0, 13))) / (2.0 * math.pi)
    np.testing.assert_allclose(found.frequencies[found.oscillating][:14], expected, rtol=within)


@pytest.mark.slow
def test_shares_of_a_rim_that_moves():
    made = train()
    named = named_modes(made)
    energy = named.energy.sel(mode=slice(1, 14))
    np.testing.assert_allclose(energy.sum("part"), 1.0, atol=2e-4)
    assert named.name.values[0] == "ring 'low ring meshes'"
    # a mode's damping is that of its parts: pins, and the rim's own
    np.testing.assert_allclose(named.damping.sum("part").values[:14], named.damping_ratio.values[:14], rtol=0.01)
    assert mode_table(named).ring.iloc[0] > 0.85
    ranked = ranked_crossings(train_campbell(made, ["50 rpm", "800 rpm"], maximum=1500.0))
    assert (ranked.gain > 0.0).all()
    assert len(ranked) > 0


@pytest.mark.slow
def test_planets_share_the_load_on_a_rim_at_rest():
    made, rigid = train(), train(rim=None)
    for name, force in rigid.at_rest.forces.items():
        assert math.isclose(made.at_rest.forces[name], force, rel_tol=1e-6)


@pytest.mark.slow
def test_the_record_of_a_train_with_a_rim():
    record = run_train(train(rim=replace(RIM, waves=3)), RunSettings(settling=0.02, duration=0.04, tolerance=1e-6))
    force = record.normal_force.mean("time")
    on_ring = [f"low planet {k}-ring" for k in (1, 2, 3)]
    expected = 70.0 / (3.0 * gears().sun.base_radius)
    np.testing.assert_allclose(force.sel(mesh=on_ring), expected, rtol=0.02)
    depth = record.penetration_drive.sel(mesh=on_ring)
    pairs = record.pairs_drive.sel(mesh=on_ring)
    assert pairs.min() >= 1
    # each pair of teeth is a spring
    assert float(abs(depth * pairs * TOOTH / record.normal_force.sel(mesh=on_ring) - 1.0).median()) < 0.01


def test_bolts_are_where_they_are_told():
    made = train()
    element = made.build().elements["low ring meshes"]
    turned = made.layout.wheels["low ring"]
    told = element.modes.stiffness
    radial = [element.modes.shapes(a - turned) for a in SIX]
    free = np.diag(
        math.pi * 2.1e11 * 0.04 * 0.012**3 / 12 * (element.modes.waves**2 - 1) ** 2 / element.modes.radius**3
    )
    expected = free + BOLT * sum(np.outer(w, w) + np.outer(v, v) for w, v in radial)
    np.testing.assert_allclose(told, expected, rtol=1e-9, atol=1e-3 * BOLT)


def test_a_file_of_a_stage_with_a_rim(tmp_path):
    made = train()
    again = load_train(write_train(made, tmp_path / "low.toml")).train
    assert again.part("low").rim == RIM


def test_rims_that_cannot_be():
    turning = PlanetaryStage(name="low", gears=gears(), sun="lay", carrier="ground", ring="rotor", rim=RIM)
    with pytest.raises(DrivetrainError, match=says("rim", "ring", "'rotor'", "ground")):
        replace(train(), planetary_stages=[turning])
    with pytest.raises(DrivetrainError, match=says("low", "rim.bolt", "bolts")):
        stage(rim={"bolt": [0.0]})
    with pytest.raises(DrivetrainError, match=says("low", "rim", "12 mm")):
        stage(rim="12 mm")
    with pytest.raises(DrivetrainError, match=says("low", "ideal", "rim")):
        PlanetaryStage(name="low", gears=gears(ideal=(1e8, 1e8)), sun="lay", carrier="rotor", ring="ground", rim=RIM)
