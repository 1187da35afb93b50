"""Contacts written in decks: every solid and law comes back, a gear pair as the very pair."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from gearmbs import gear_rig
from gearmbs.adams import DeckError, parse_deck, read_deck, run_deck, write_deck
from gearmbs.adams.write.contacts import MARK, pair_comments, pair_of
from gearmbs.adams.write.gear_expressions import HELD, LEFT_OUT, REFUSED
from gearmbs.dae.problem import ModelError
from gearmbs.drivetrain import Drivetrain, GearMesh, IdealBearing, Shaft, SpeedDrive, TorqueLoad, Wheel
from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec, Support, planetary, planetary_mechanism
from gearmbs.gears.faults import BrokenTooth, Crowning, Fault, FlankMap, PitchError, TipRelief
from gearmbs.gears.ideal_mesh import IdealMesh, IdealMeshForce
from gearmbs.mechanism import Mechanism, ramp, step
from gearmbs.mechanism.contacts import (
    Box,
    Coulomb,
    Cylinder,
    Ellipsoid,
    Frustum,
    HalfSpace,
    Impact,
    Mesh,
    Poisson,
    Sphere,
    Torus,
    extruded,
)
from gearmbs.mechanism.language.syntax import Units
from tests.says import says

MM = Units(length=1e-3)
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
PROFILE = np.array([(-0.03, -0.02), (0.03, -0.02), (0.0, 0.02)])
SOLIDS = {
    "sphere": Sphere(0.02, offset=(0.001, 0.002, 0)),
    "point": Sphere(0.0, offset=(0.0, 0.0, -0.02)),
    "ellipsoid": Ellipsoid((0.03, 0.025, 0.02), axes=TURN),
    "box": Box((0.03, 0.05, 0.04), axes=TURN),
    "cylinder": Cylinder(0.015, 0.04),
    "frustum": Frustum(0.015, 0.01, 0.04, offset=(0.002, 0, 0)),
    "torus": Torus(0.03, 0.02),
    "mesh": Mesh(*extruded(PROFILE, 0.04), offset=(0, 0, -0.02)),
}
LAWS = {"impact": Impact(1e6, 1.4, 150.0, 2e-4), "poisson": Poisson(1e6, 0.6)}


def falling(solid, law, friction=None):
    m = Mechanism("falling", gravity=(0.5, 0, -9.81))
    m.units = MM
    body = m.body("body", 1.5, (1e-3, 2e-3, 1.5e-3), position=(0, 0, 0.03), velocity=(0.2, 0, 0))
    m.contact("floor", body.marker((1e-3, 0, 0)), solid, m.ground.marker(), HalfSpace(), law, friction)
    return m


@pytest.mark.parametrize("kind", SOLIDS)
def test_a_solid_comes_back(kind, tmp_path):
    m = falling(SOLIDS[kind], LAWS["impact"], Coulomb(0.3, 0.2, 0.01, 0.05))
    write_deck(m, tmp_path / "d.adm")
    deck = read_deck(tmp_path / "d.adm")
    back = deck.to_mechanism()
    one, two = (x.elements["floor"] for x in (m, back))
    assert dataclasses.astuple(two.law) == pytest.approx(dataclasses.astuple(one.law), rel=1e-14)
    assert two.friction.reals() == pytest.approx(one.friction.reals(), rel=1e-14)
    a, b = (x.simulate(0.1, rate=500, tol=1e-9) for x in (m, back))
    assert np.abs(a.load("floor")[0]).max() > 1.0
    np.testing.assert_allclose(b.com_position("body"), a.com_position("body"), atol=2e-8)


def test_poisson_without_friction_comes_back():
    m = falling(SOLIDS["sphere"], LAWS["poisson"])
    back = parse_deck(write_deck(m)).to_mechanism().elements["floor"]
    assert back.law.penalty == pytest.approx(1e6)
    assert back.law.restitution == 0.6
    assert back.friction is None


def test_many_solids_of_a_body_come_back():
    m = Mechanism("feet", gravity=(0, 0, -9.81))
    body = m.body("body", 1.0, (1, 1, 1), position=(0, 0, 0.1))
    feet = [Sphere(0.05, offset=(x, y, -0.05)) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]
    m.contact(
        "feet", body.marker(), feet, m.ground.marker(), [HalfSpace(), Sphere(0.01, offset=(0, 0, -1))], LAWS["impact"]
    )
    text = write_deck(m)
    assert "IGEOM = 1, 2, 3, 4" in text
    assert "JGEOM = 5, 6" in text
    result = run_deck(parse_deck(text), end=0.3, steps=30)
    assert result.tracks(1).shape[1] == 4
    assert result.force("contact", 1)[-1, 2] == pytest.approx(9.81, rel=1e-4)
    # asked for by the deck itself
    assert any("CONTACT(1, 0, 4, 0)" in line for line in text.splitlines())


def test_a_mesh_needs_a_file():
    with pytest.raises(ModelError, match=says("floor.I", "mesh", "give the deck's")):
        write_deck(falling(SOLIDS["mesh"], LAWS["impact"]))


def rig(pair):
    place = pair.placement(0.0)
    m = Mechanism("gears")
    m.units = MM
    joints = []
    wheels = ((place.origin_1, place.axes_1, pair.driver), (place.origin_2, place.axes_2, pair.driven))
    for k, (origin, axes, wheel) in enumerate(wheels, 1):
        body = m.body(f"wheel {k}", wheel.mass, wheel.inertia, position=origin, orientation=axes)
        joints.append(m.revolute(f"axle {k}", body, m.ground, at=origin, axis=axes[:, 2]))
    m.rotation("drive", joints[0], ramp(20.0, 0.005))
    m.torque("load", m.bodies["wheel 2"], step(0.0, 0.0, 0.005, 100.0))
    m.gear_contact("mesh", m.bodies["wheel 1"], m.bodies["wheel 2"], pair)
    return m


PAIRS = {
    "plain": GearPair.paper(backlash="0.1 mm"),
    "tilted, with faults": GearPair.paper(
        misalignment="0.5 deg", backlash="0.5 mm", contact=ContactLaw.linear("2e8 N/m"), friction=FlankFriction.none(),
        faults=(BrokenTooth(tooth=28), Crowning(), FlankMap(), TipRelief(teeth=(1, 2)), PitchError(wheel="driven")),
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_a_gear_pair_is_the_very_pair_again(name, tmp_path):
    pair = PAIRS[name]
    m = rig(pair)
    text = write_deck(m, tmp_path / "g.adm", gears="solids")
    assert "CONTACT/1" in text
    assert {p.name for p in tmp_path.iterdir()} == {"g.adm", "g_mesh_driver.obj", "g_mesh_driven.obj"}
    deck = read_deck(tmp_path / "g.adm")
    back = deck.to_mechanism()
    assert back.elements["mesh"].pair == pair
    a, b = (x.simulate(0.015, rate=2000, tol=1e-8, rate_scale=1.0) for x in (m, back))
    force = np.abs(a.load("mesh")[0]).max()
    assert force > 100.0
    # the same equations but for the last digits of lengths in mm, at a tolerance of 1e-8
    np.testing.assert_allclose(b.com_position("wheel 2"), a.com_position("wheel 2"), atol=1e-12)
    np.testing.assert_allclose(b.angular_velocity("wheel 2"), a.angular_velocity("wheel 2"), atol=1e-5)
    np.testing.assert_allclose(b.load("mesh")[0], a.load("mesh")[0], atol=1e-4 * force)


def test_gears_of_a_deck_that_start_deep_in_each_other_are_refused(tmp_path):
    m = rig(PAIRS["plain"])
    wheel = m.bodies["wheel 2"]
    turn = 0.4e-3 / PAIRS["plain"].driven.base_radius
    wheel.orientation = wheel.orientation @ np.array(
        [[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]]
    )
    write_deck(m, tmp_path / "g.adm", gears="solids")
    with pytest.raises(ModelError, match=says("'mesh'", "0.4")):
        read_deck(tmp_path / "g.adm").to_mechanism().simulate(1e-4)


@pytest.mark.slow
def test_the_meshes_touch_where_the_teeth_do(tmp_path):
    """Without the comments the deck is what other programs have: two meshes that press each other apart."""
    m = rig(PAIRS["plain"])
    write_deck(m, tmp_path / "g.adm", gears="solids")
    wheels = [read_deck(tmp_path / "g.adm").to_mechanism().elements["mesh"]]
    for name in ("driver", "driven"):
        lines = (tmp_path / f"g_mesh_{name}.obj").read_text().splitlines()
        points = np.array([line.split()[1:] for line in lines if line.startswith("v ")], dtype=float)
        assert np.hypot(points[:, 0], points[:, 1]).max() == pytest.approx(1e3 * wheels[0].pair.driver.tip_radius)
        assert np.ptp(points[:, 2]) == pytest.approx(1e3 * wheels[0].pair.driver.face_width)


def test_changed_laws_are_taken_and_remarked(tmp_path):
    write_deck(rig(PAIRS["plain"]), tmp_path / "g.adm", gears="solids")
    text = (tmp_path / "g.adm").read_text()
    line = next(x for x in text.splitlines() if "EXPONENT" in x)
    deck = parse_deck(text.replace(line, ", EXPONENT = 1.5"))
    changed = deck.to_mechanism().elements["mesh"].pair
    assert changed.contact.exponent == 1.5
    assert changed.driver == PAIRS["plain"].driver
    assert any("no longer those of the pair" in d.message for d in deck.diagnostics)


@pytest.mark.slow
def test_damaged_comments_are_named(tmp_path):
    write_deck(rig(PAIRS["plain"]), tmp_path / "g.adm", gears="solids")
    lines = (tmp_path / "g.adm").read_text().splitlines()
    first = next(k for k, x in enumerate(lines) if MARK in x)
    for text in ("\n".join(lines[:first] + lines[first + 1 :]), "\n".join(lines).replace("GearSpec", "Popen")):
        with pytest.raises(DeckError, match=says("CONTACT/1")):
            parse_deck(text).to_mechanism()


def test_what_has_no_form_is_named(tmp_path):
    @dataclasses.dataclass(frozen=True)
    class Own(Fault):
        def apply(self, deviations, pair):
            """Nothing."""

    for pair, words in (
        (GearPair.paper(backlash="0.1 mm", faults=(Own(),)), says("Own", "own")),
        (GearPair.paper(backlash="0.1 mm", contact=ContactLaw.hunt_crossley()), "no form in ADAMS"),
    ):
        with pytest.raises(ModelError, match=words):
            write_deck(rig(pair), tmp_path / "g.adm", gears="solids")
    with pytest.raises(ModelError, match="gears = 'mesh'; choose 'expressions' or 'solids'"):
        write_deck(rig(PAIRS["plain"]), gears="mesh")


@pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS)
def test_comments_hold_a_whole_pair(pair):
    texts = pair_comments(pair)
    assert max(map(len, texts)) <= 120
    assert pair_of("".join(t.removeprefix(MARK) for t in texts)) == pair


# Gears as expressions.


STIFF = {"contact": ContactLaw.linear("2e8 N/m", "3000 N*s/m", "10 um"), "friction": FlankFriction.none()}


def internal():
    wheels = GearSpec(21, "3 mm", profile_shift=0.2), GearSpec.ring(64, "3 mm", face_width="20 mm")
    return GearPair(*wheels, backlash="0.1 mm", **STIFF)


def written(m):
    return parse_deck(write_deck(m)).to_mechanism()


@pytest.mark.parametrize("sense", [1, -1])
def test_a_ring_as_expressions_turns_and_bears_as_it_does(sense):
    pair = internal()
    m = gear_rig(pair, speed=100.0 * sense, torque=sense * pair.operating_point.torque, run_up=0.01)
    a, b = (x.simulate(0.003, rate=2000, tol=1e-8, rate_scale=2000.0) for x in (m, written(m)))
    turned = a.joint_angle("bearing 2")
    assert sense * turned[-1] > 0.005
    np.testing.assert_allclose(b.joint_angle("bearing 2"), turned, atol=1e-4 * abs(turned[-1]))
    for bearing in ("bearing 1", "bearing 2"):
        force = a.reaction(bearing)[0]
        assert np.abs(force).max() > 100.0
        np.testing.assert_allclose(b.reaction(bearing)[0], force, atol=0.02 * np.abs(force).max())


def planets(driving="sun", loaded="carrier", **changes):
    gears = planetary((20, 22, 64), "1.5 mm", 3, backlash_sun="0.05 mm", backlash_ring="0.05 mm", **STIFF)
    return planetary_mechanism(gears, speeds={driving: 50.0}, torques={loaded: -85.0}, run_up=0.002, **changes)


@pytest.mark.slow
def test_planets_as_expressions_are_seen_from_their_carrier():
    m = planets()
    a, b = (x.simulate(0.003, rate=2000, tol=1e-7, rate_scale=2000.0) for x in (m, written(m)))
    assert a.joint_angle("carrier seat")[-1] > 0.02
    for joint in ("carrier seat", "planet 1 pin"):
        np.testing.assert_allclose(b.joint_angle(joint), a.joint_angle(joint), atol=1e-4)
    # before the first corner meets
    force = a.reaction("planet 2 pin")[0][:3]
    np.testing.assert_allclose(b.reaction("planet 2 pin")[0][:3], force, atol=0.02 * np.abs(force).max())


def test_axes_that_are_carried_about_without_a_common_carrier_are_refused():
    with pytest.raises(ModelError, match=says("'sun-planet 1'", "'carrier seat'", 'gears="solids"')):
        write_deck(planets("carrier", "sun", supports={"sun": Support(1e8)}))


@pytest.mark.parametrize("pair", [GearPair.paper(backlash="0.1 mm", **STIFF), internal()], ids=["external", "internal"])
def test_axes_in_elastic_bearings_move_in_the_expressions_too(pair):
    m = rig(pair)
    del m.joints["axle 2"]
    wheel = m.bodies["wheel 2"]
    m.bushing("seat", wheel.marker(), m.ground.marker_at(wheel.position, wheel.orientation), stiffness=(2e4, 2e4, 1e8),
              damping=(50, 50, 500), torsional_stiffness=(1e5, 1e5, 0), torsional_damping=(10, 10, 0))  # fmt: skip
    a, b = (x.simulate(0.006, rate=2000, tol=1e-8, rate_scale=1000.0) for x in (m, written(m)))
    moved = a.com_position("wheel 2") - wheel.position
    assert np.abs(moved).max() > 2e-5
    np.testing.assert_allclose(b.com_position("wheel 2") - wheel.position, moved, atol=0.02 * np.abs(moved).max())


def test_each_field_of_a_pair_is_held_left_out_or_refused():
    pair = GearPair.paper()
    own = {f"{owner}.{f.name}" for owner, thing in (
        ("GearPair", pair), ("GearSpec", pair.driver), ("ContactLaw", pair.contact),
    ) for f in dataclasses.fields(thing)}  # fmt: skip
    assert own == {*HELD, *LEFT_OUT, *REFUSED}
    assert len(own) == len(HELD) + len(LEFT_OUT) + len(REFUSED)


def helical(hand):
    return GearSpec(29, "3 mm", helix_angle="12 deg", hand=hand)


UNWRITTEN = {
    "GearPair.axial_shift": lambda: GearPair.paper(backlash="0.1 mm", axial_shift="5 mm"),
    "GearPair.root_contact": lambda: GearPair.paper(
        centre_distance_error="-0.8 mm", backlash="0.8 mm", root_contact=True
    ),
    "GearPair.stiffness_curve": lambda: GearPair.paper().with_potential_energy_stiffness(),
    "GearPair.faults": lambda: GearPair.paper(backlash="0.1 mm", faults=(BrokenTooth(), TipRelief())),
    "GearSpec.helix_angle": lambda: GearPair(helical("right"), helical("left"), backlash="0.1 mm"),
    "ContactLaw.kind": lambda: GearPair.paper(contact=ContactLaw.hunt_crossley()),
}


@pytest.mark.parametrize("field", REFUSED)
@pytest.mark.filterwarnings("ignore:GearPair")
def test_what_expressions_cannot_hold_is_refused_by_name(field):
    solids = field not in ("GearPair.stiffness_curve", "ContactLaw.kind")
    with pytest.raises(ModelError, match=says("'mesh'", field, *['gears="solids"'] * solids)):
        write_deck(rig(UNWRITTEN[field]()))


def test_faults_are_refused_by_their_names_and_other_places_too():
    with pytest.raises(ModelError, match=says("BrokenTooth, TipRelief")):
        write_deck(rig(UNWRITTEN["GearPair.faults"]()))
    m = rig(PAIRS["plain"])
    m.elements["mesh"].pair = PAIRS["plain"].with_changes(centre_distance_error="0.2 mm")
    with pytest.raises(ModelError, match=says("mm apart", "centre_distance_error")):
        write_deck(m)


# Drivetrains.


def train(bearings=("40 mm",), loads=()):
    wheels = {name: GearSpec(z, "3 mm", face_width="20 mm") for name, z in (("w1", 21), ("w2", 53))}
    return Drivetrain(
        "t",
        shafts=[Shaft(name=name, length="80 mm", radius="10 mm", mass="1 kg") for name in ("in", "out")],
        wheels=[Wheel(name=n, shaft=s, station="40 mm", gear=wheels[n]) for n, s in (("w1", "in"), ("w2", "out"))],
        meshes=[GearMesh(name="m", driver="w1", driven="w2", direction="130 deg", settings={"backlash": "0.1 mm"})],
        bearings=[IdealBearing(name=f"{s} {k}", shaft=s, station=z) for s in ("in", "out")
                  for k, z in enumerate(bearings)],
        drives=[SpeedDrive(name="dr", shaft="in", speed="-500 rpm")], loads=loads, running=True,
    )  # fmt: skip


def test_the_speed_drive_of_a_shaft_in_one_ideal_bearing_comes_back():
    m = train().build()
    m.torque("load", m.bodies["out"], -20.0)
    back = written(m)
    a, b = (x.simulate(0.002, rate=2000, tol=1e-7, rate_scale=1000.0) for x in (m, back))
    speed = a.angular_velocity("in")[:, 2]
    np.testing.assert_allclose(speed, -500.0 * np.pi / 30.0, rtol=1e-6)
    np.testing.assert_allclose(b.angular_velocity("in")[:, 2], speed, rtol=1e-6)
    np.testing.assert_allclose(b.joint_angle("in 0"), a.joint_angle("in 0"), atol=1e-9)


def test_what_a_deck_has_not_of_a_drivetrain_is_named():
    with pytest.raises(ModelError, match=says("dr.I", "'in'", "IdealBearing")):
        write_deck(train(("10 mm", "70 mm")).build())
    m = train().build()
    m.add(IdealMeshForce("ideal", m.elements["m"].i, m.elements["m"].j, IdealMesh(m.elements["m"].pair, 1e8)))
    with pytest.raises(ModelError, match=says("ideal mesh 'ideal'", "ContactLaw.impact")):
        write_deck(m)
    assert "SFORCE/1" in write_deck(train(loads=[TorqueLoad(name="ld", shaft="out", torque="20 N m")]).build())
