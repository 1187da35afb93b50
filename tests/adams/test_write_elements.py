"""Written decks keep the kinds of their elements and ask for results."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import parse_deck, read_deck, run_deck, write_deck
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism, Mode
from gearmbs.mechanism.language.syntax import Units
from tests.says import says

from .test_run import model
from .test_writers import ELEMENTS as STATEMENTS
from .test_writers import PARTS


def mechanism() -> tuple[Mechanism, object, object]:
    """A tilted block hung between two markers."""
    m = Mechanism("kept", gravity=(1, 0.5, -9.81))
    block = m.body("block", 2.0, (0.1, 0.2, 0.3), position=(0.4, 0.1, 0), orientation=(0.1, 0.05, -0.1))
    return m, block.marker((0.1, 0, 0), name="here"), m.ground.marker((0.05, 0, 0.1), name="there")


def block(text: str, head: str) -> list[str]:
    """Return the lines of a statement."""
    lines = text.split("\n")
    first = lines.index(head)
    last = next(k for k in range(first + 1, len(lines)) if not lines[k].startswith(","))
    return lines[first:last]


def matrix(seed: int) -> np.ndarray:
    a = np.random.default_rng(seed).normal(size=(6, 6))
    return 20 * np.eye(6) + a + a.T


ELEMENTS = {
    "SPRINGDAMPER/1\n, TRANSLATIONAL": lambda m, i, j: m.spring_damper(
        "e", i, j, stiffness=50, damping=2, length=0.3, preload=4
    ),
    "SPRINGDAMPER/1\n, ROTATIONAL": lambda m, i, j: m.torsion_spring(
        "e", i, j, stiffness=5, damping=0.2, angle=0.3, preload=0.1
    ),
    "BUSHING/1": lambda m, i, j: m.bushing(
        "e", i, j, stiffness=(50, 60, 70), damping=(1, 2, 3), torsional_stiffness=(5, 6, 7)
    ),
    "FIELD/1": lambda m, i, j: m.field(
        "e", i, j, stiffness=matrix(1), damping=0.1 * matrix(2), free=[0.3, 0, 0, 0, 0, 0.1], preload=range(6)
    ),
    "BEAM/1": lambda m, i, j: m.beam(
        "e", i, j, length=0.5, area=1e-4, second_moments=(2e-8, 1e-8, 3e-8), modulus=1e8, shear_modulus=4e7,
        shear_ratios=(1.2, 1.1), damping_ratio=0.01,
    ),
}  # fmt: skip


@pytest.mark.parametrize("statement", ELEMENTS)
def test_elements_keep_their_statements(statement):
    m, i, j = mechanism()
    ELEMENTS[statement](m, i, j)
    text = write_deck(m)
    assert statement in text
    again = parse_deck(text).to_mechanism()
    assert block(write_deck(again), statement.split("\n")[0]) == block(text, statement.split("\n")[0])
    one, two = (x.simulate(0.3, rate=20, tol=1e-9) for x in (m, again))
    np.testing.assert_allclose(two.com_position("block"), one.com_position("block"), atol=1e-8)
    np.testing.assert_allclose(two.load("e")[0], one.load("e")[0], atol=1e-5)


def test_beam_with_its_own_damping_and_bushing_with_preload_survive():
    body = "PART/1,GROUND\nMARKER/10,PART=1\nPART/2,MASS=1,CM=20,IP=1,1,1,QG=100,0,0\nMARKER/20,PART=2\n"
    body += "BEAM/1,I=20,J=10,LENGTH=100,IXX=2,IYY=1,IZZ=1,AREA=3,EMOD=2E5,GMOD=8E4,CMATRIX=" + ",".join(
        str(k) for k in range(21)
    )
    body += "\nBUSHING/1,I=20,J=10,K=1,2,3,KT=4,5,6,C=7,8,9,CT=1,2,3,FORCE=1,0,2,TORQUE=3,0,0\n"
    units = "UNITS/FORCE=NEWTON,MASS=KILOGRAM,LENGTH=MILLIMETER,TIME=SECOND\n"
    text = write_deck(parse_deck(f"deck\n{units}{body}END\n").to_mechanism())
    assert ", CMATRIX = 0, 1, 2, 3" in text
    assert ", FORCE = 1, 0, 2" in text
    assert ", TORQUE = 3, 0, 0" in text
    # the second time all markers have names
    again = write_deck(parse_deck(text).to_mechanism())
    for head in ("BEAM/1", "BUSHING/1", "PART/2"):
        assert block(again, head) == block(text, head)
    assert write_deck(parse_deck(again).to_mechanism()) == again


@pytest.mark.parametrize("kind", ["ptcv", "cvcv"])
def test_curves_are_written_as_the_constraints_that_keep_to_them(kind):
    deck = parse_deck(model(PARTS + STATEMENTS[kind]))
    text = write_deck(deck.to_mechanism())
    assert "\nGCON/1\n" in text
    one, two = (run_deck(d, end=0.1, steps=4, tol=1e-8) for d in (deck, parse_deck(text)))
    for body in ("PART_2", "PART_3"):
        a, b = (r.segments[0].solution.com_position(body) for r in (one, two))
        np.testing.assert_allclose(b, a, atol=1e-8)


@pytest.mark.parametrize("kind", [k for k in STATEMENTS if k not in ("joint", "gear", "ptcv", "cvcv")])
def test_decks_of_every_element_are_written_with_it(kind):
    """A GEAR is a coupler of its joints."""
    deck = parse_deck(model(PARTS + STATEMENTS[kind]))
    text = write_deck(deck.to_mechanism())
    head = STATEMENTS[kind].split("/")[0] + "/1"
    assert f"\n{head}\n" in text
    one, two = (run_deck(d, end=0.1, steps=4, tol=1e-8) for d in (deck, parse_deck(text)))
    # axes go through Euler angles
    for body in ("PART_2", "PART_3"):
        a, b = (r.segments[0].solution.com_position(body) for r in (one, two))
        np.testing.assert_allclose(b, a, atol=1e-8)
    np.testing.assert_allclose(two.force(kind, 1), one.force(kind, 7), atol=1e-5)


JOINTS = {
    "revolute": {"pin_radius": 0.02, "friction_arm": 0.01, "bending_arm": 0.05, "max_torque": 3.0},
    "translational": {"reaction_arm": 0.1, "overlap": 0.3, "overlap_change": "increasing", "preload_force": 0.2},
    "cylindrical": {"pin_radius": 0.02, "overlap": 0.4},
    "spherical": {"ball_radius": 0.02, "max_stiction_deformation": 0.0},
    "universal": {"pin_radius": 0.02, "yoke": "j", "inputs": ("reaction_force",), "effect": "sliding"},
}


@pytest.mark.parametrize("kind", JOINTS)
def test_friction_keeps_its_statement(kind):
    m = Mechanism("dry", gravity=(1, 2, -9.81))
    body = m.body("body", 1.0, (0.1, 0.2, 0.3), position=(0.3, 0, 0), angular_velocity=(0.5, 1, 0.5))
    i, j = body.marker((-0.3, 0, 0), axis=(0, 1, 0), name="i"), m.ground.marker(axis=(0, 1, 0), name="j")
    if kind == "universal":
        j = m.ground.marker(axis=(1, 0, 0), name="j2")
    m.friction("dry", m.joint(kind, "pin", i, j), 0.3, 0.2, **JOINTS[kind])
    text = write_deck(m)
    assert "FRICTION/1" in text
    assert "VARIABLE/" not in text
    assert "DIFF/" not in text
    again = parse_deck(text).to_mechanism()
    one, two = (x.simulate(0.2, rate=50, tol=1e-8) for x in (m, again))
    np.testing.assert_allclose(two.com_position("body"), one.com_position("body"), atol=1e-7)


def test_friction_that_others_look_into_is_written_as_expressions():
    m = Mechanism("dry", gravity=(0, 0, -9.81))
    body = m.body("body", 1.0, (0.1, 0.2, 0.3), position=(0.3, 0, 0))
    pin = m.revolute("pin", body, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    m.friction("dry", pin, 0.3, 0.2, pin_radius=0.02)
    m.axis_torque("heat", pin.i, pin.j, '1E-3*VARVAL("dry.moment")')
    text = write_deck(m)
    assert "FRICTION/" not in text
    assert "SFORCE/1\n, ROTATIONAL" in text
    again = parse_deck(text).to_mechanism()
    one, two = (x.simulate(0.2, rate=50, tol=1e-8) for x in (m, again))
    np.testing.assert_allclose(two.com_position("body"), one.com_position("body"), atol=1e-8)


@pytest.mark.parametrize("units", [Units(), Units(length=1e-3, time=1e-3)])
def test_written_decks_ask_for_results(tmp_path, units):
    m = Mechanism("rod, of steel", gravity=(0, 0, -9.81))
    m.units = units
    rod = m.body("rod=1", 1.0, (0.1, 0.1, 0.01), position=(0.5, 0, 0))
    pin = m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    asked = {"angle": f'AZ("{pin.i.name}", "{pin.j.name}")', "tip": ["DX(tip)", "DZ(tip)"]}
    rod.marker((0.5, 0, 0), name="tip")
    settings = {"integrator": "wstiff", "tol": 1e-9, "max_step": 0.01}
    text = write_deck(m, tmp_path / "rod.adm", title="A rod", requests=asked, **settings)
    assert (tmp_path / "rod.adm").read_text() == text
    assert text.startswith("A rod\n")
    deck = read_deck(tmp_path / "rod.adm")
    assert not deck.diagnostics
    result = run_deck(deck, end=0.2 / units.time, steps=10, out=tmp_path / "out")
    options = result.segments[0].options
    assert (options["integrator"], options["tol"], options["max_step"]) == ("WSTIFF", 1e-9, pytest.approx(0.01))
    # the rod turns by asin(-z_tip)
    np.testing.assert_allclose(
        np.abs(result.request(1)[:, 1]), np.arcsin(-result.request(2)[:, 2] * units.length), atol=1e-8
    )
    # then displacement and velocity of the rod and the force in the pin
    np.testing.assert_allclose(
        result.request(3)[:, 1] * units.length, result.segments[0].solution.com_position("rod=1")[:, 0]
    )
    speed = result.segments[0].solution.com_velocity("rod=1")[:, 2]
    np.testing.assert_allclose(result.request(4)[:, 3] * units.factor("velocity"), speed, atol=1e-12)
    np.testing.assert_allclose(result.request(5)[:, [1, 2, 3]], result.force("joint", 1)[:, :3], atol=1e-9)
    assert len((tmp_path / "out.req").read_text().splitlines()) == 3 + 2 * 5 + 11 * 6


def test_results_need_not_be_asked_for():
    m, *_ = mechanism()
    text = write_deck(m, output=False)
    assert not any(word in text for word in ("REQUEST", "OUTPUT", "RESULTS", "INTEGRATOR"))
    with pytest.raises(ModelError, match="choose one of GSTIFF, WSTIFF"):
        write_deck(m, integrator="IDA")
    with pytest.raises(ModelError, match=says("1", "6", "7", "expressions")):
        write_deck(m, requests={"many": ["TIME"] * 7})


def test_a_body_that_deforms_is_refused_by_name():
    m = Mechanism("flexible")
    m.modal_body("rod", 1.0, (1, 1, 1), [Mode(frequency=10.0)], lambda p: (np.zeros((1, 3)), np.zeros((1, 3))))
    with pytest.raises(ModelError, match=says("body 'rod'", "Mechanism.body")):
        write_deck(m)
