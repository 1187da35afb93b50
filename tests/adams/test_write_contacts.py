"""Contacts written in decks: every solid and law comes back, a gear pair as the very pair."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, read_deck, run_deck, write_deck
from gearmbs.adams.write.contacts import MARK, pair_comments, pair_of
from gearmbs.dae.problem import ModelError
from gearmbs.gears import ContactLaw, FlankFriction, GearPair
from gearmbs.gears.faults import BrokenTooth, Crowning, Fault, FlankMap, PitchError, TipRelief
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
    a, b = (x.simulate(0.015, rate=2000, tol=1e-8) for x in (m, back))
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
