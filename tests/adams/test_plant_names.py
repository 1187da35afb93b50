"""Inputs and outputs of mechanisms in decks: as VARIABLEs that something uses, PINPUT and POUTPUT, and back."""

import re

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.adams import build_mechanism, parse_deck
from gearmbs.flexible import Shaft, ShaftSection
from gearmbs.mechanism import Mechanism, make_input
from gearmbs.mechanism.language.syntax import Units
from tests.drivetrain.support import stage
from tests.says import says

DECK = """a cart
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
MARKER/11, PART=1, ZP=1,0,0
PART/2, MASS=2, CM=20, IP=1,1,1
MARKER/20, PART=2
MARKER/21, PART=2, ZP=1,0,0
JOINT/1, TRANSLATIONAL, I=21, J=11
! adams_view_name='push'
VARIABLE/1, FUNCTION=3
VARIABLE/2, FUNCTION=DX(20,1)
VARIABLE/3, FUNCTION=-VX(20,1)
PINPUT/1, VARIABLES=1
PINPUT/2, VARIABLES=3
POUTPUT/1, VARIABLES=2
SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY, FUNCTION=VARVAL(1)+VARVAL(3)
END
"""


def model(units=None):
    """A disc under a torque, and one whose speed is given; angles, speeds and accelerations are told."""
    m = Mechanism("discs")
    if units is not None:
        m.units = units
    for name in "ab":
        body = m.body(name, mass=1.0, inertia=(2.0, 2.0, 2.0))
        m.revolute(f"pin {name}", body, m.ground, axis=(0, 0, 1))
    m.torque("drive", m.bodies["a"], m.input("load", "N m", 4.0))
    m.rotation("motor", m.joints["pin b"], m.input("speed", "rad/s", 2.0), level="velocity", start=0.3)
    m.output("w", ("angular_velocity", "a", "z"))
    m.output("bent", ("angular_acceleration", "a", "z"))
    m.output("power", '0.5*load*WZ("pin a.I")')
    m.output("energy", ("kinetic_energy",))
    return m


def led(m, factor=1.0):
    """Return the outputs, and the angle of the second disc, after the inputs have been set."""
    sim = gm.Simulator(m, 1.0, tol=1e-8)
    sim.advance(0.1)
    sim.set("load", 8.0 * factor)
    sim.set("speed", 5.0, hold=1)
    sim.advance(0.3)
    return [sim.get("output", name) for name in ("w", "bent", "power")] + [sim.get("joint_angle", "pin b")]


@pytest.mark.parametrize("units", [None, Units(length=1e-3, time=1e-3)])
def test_inputs_are_those_of_the_deck_and_back(units):
    """w = (4 0.1 + 8 0.2) / 2, its rate 8 / 2, and the angle 0.3 + 2 0.1 + (2 + 5) / 2 0.2; written, read, written."""
    m = model(units)
    torque = 1.0 if units is None else units.factor("torque")
    markers = [len(body.markers) for body in m.bodies.values()]
    text = gm.write_deck(m, output=False)
    assert [len(body.markers) for body in m.bodies.values()] == markers
    assert re.search(r"TZ = .*VARVAL\(1\)", text)
    assert re.search(r"MOTION/1[^!]*FUNCTION = VARVAL\(2\)", text)
    assert "! output 'energy' is left out" in text
    deck = parse_deck(text)
    again = build_mechanism(deck)
    assert not deck.diagnostics
    assert (list(again.inputs), list(again.outputs)) == (["load", "speed"], ["w", "bent", "power"])
    turning = 1.0 if units is None else units.factor("angular_velocity")
    given = led(m)
    assert given[0] == pytest.approx(1.0, rel=1e-6)
    assert given[3] == pytest.approx(0.3 + 0.2 + 0.7, abs=1e-6)
    read = led(again, 1.0 / torque)
    assert read[3] == pytest.approx(given[3], abs=1e-6)
    assert read[0] * turning == pytest.approx(1.0, rel=1e-6)
    assert read[1] * (1.0 if units is None else units.factor("angular_acceleration")) == pytest.approx(4.0, rel=1e-6)
    third = gm.write_deck(again, output=False)
    assert third.count("VARIABLE/") == text.count("VARIABLE/")
    back = build_mechanism(parse_deck(third))
    np.testing.assert_allclose(led(back, 1.0 / torque), read, rtol=1e-6)


def test_a_deck_names_its_variables():
    """Those that are numbers can be set; what closes a loop already is told to be none."""
    deck = parse_deck(DECK)
    m = build_mechanism(deck)
    assert (list(m.inputs), list(m.outputs)) == (["push"], ["VARIABLE_2"])
    (remark,) = [d.message for d in deck.diagnostics]
    assert re.search(says("PINPUT/2", "VARIABLE/3", "number"), remark)
    sim = gm.Simulator(m, 3.0, tol=1e-9)
    sim.set("push", 6.0)
    sim.advance(1.5)
    # 2 v' = 6 - v
    assert sim.get("output", "VARIABLE_2") == pytest.approx(6.0 * (1.5 - 2.0 * (1.0 - np.exp(-0.75))), rel=1e-6)


def test_two_variables_of_one_name_are_two_inputs():
    """The second goes by its number, which is told; apart by name both keep theirs."""
    text = DECK.replace(
        "VARIABLE/2, FUNCTION=DX", "! adams_view_name='{}'\nVARIABLE/4, FUNCTION=5\nVARIABLE/2, FUNCTION=DX"
    )
    text = text.replace("PINPUT/2, VARIABLES=3", "PINPUT/2, VARIABLES=4").replace("+VARVAL(3)", "+2*VARVAL(4)")
    for second, names, remarks in (("push", ["push", "VARIABLE_4"], 1), ("pull", ["push", "pull"], 0)):
        deck = parse_deck(text.format(second))
        m = build_mechanism(deck)
        assert list(m.inputs) == names
        assert len(deck.diagnostics) == remarks
        assert all(re.search(says("VARIABLE_4", "push"), d.message) for d in deck.diagnostics)
        sim = gm.Simulator(m, 1.0)
        sim.set(names[1], 0.5)
        sim.advance(1.0)
        # 2 v' = 3 + 2 x 0.5
        assert sim.get("com_velocity", next(iter(m.bodies)))[0] == pytest.approx(2.0, rel=1e-6)


def test_a_drivetrain_has_its_loads_and_sensors_in_the_deck():
    train = stage()
    old = next(one for one in train.loads)
    m = train.changed(old.name, torque=make_input("braking", "N m", 30.0)).build()
    text = gm.write_deck(m, output=False)
    number = re.search(r"name='braking'\nVARIABLE/(\d+)", text)[1]
    assert re.search(rf"SFORCE[^!]*VARVAL\({number}\)", text)
    assert re.search(rf"PINPUT/\d+\n, VARIABLES = (\d+, )*{number}\b", text)
    assert "braking" in build_mechanism(parse_deck(text)).inputs


def test_the_frame_of_a_body_that_deforms_is_left_out_of_a_deck(tmp_path):
    """A deck has markers at nodes; what is measured at one is there, and so is the rest of the deck."""
    m = gm.Mechanism("bar")
    bar = Shaft([ShaftSection(0.4, 0.01)], seats={"A": 0.0, "B": 0.4}).modal_model().slowest(2).add_to(m)
    seat = (bar.markers or [bar.marker((0.0, 0.0, 0.0), name="end")])[0].name
    m.output("frame", ("angular_velocity", bar.name, "z"))
    m.output("seat", ("marker_velocity", seat, "y"))
    text = gm.save(m, tmp_path / "bar.adm").read_text()
    assert f"output 'frame' is left out: output ('angular_velocity', '{bar.name}', 'z'): '{bar.name}' deforms" in text
    assert "output 'seat'" not in text
    assert "POUTPUT" in text


def test_forces_among_outputs_of_a_deck_are_told_by_its_mechanism():
    """A reaction and the force of an element stand there by their ids, which the mechanism knows by names."""
    m = gm.Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = m.body("rod", mass=1.0, inertia=(0.1, 0.2, 0.2), position=(0.3, 0, 0))
    m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    m.spring_damper("spring", rod.marker(name="tip"), m.ground.marker((0.3, 0, 1.0), name="hook"), stiffness=20.0)
    m.output("carried", ("reaction", "pin", "fz"))
    m.output("pulled", ("load", "spring", "fz"))
    again = build_mechanism(parse_deck(gm.write_deck(m)))
    sims = [gm.Simulator(one, 0.2, tol=1e-8) for one in (m, again)]
    for sim in sims:
        sim.advance(0.1)
    for name in ("carried", "pulled"):
        one, other = (sim.get("output", name) for sim in sims)
        assert other == pytest.approx(one, rel=1e-6)
        assert abs(one) > 0.1
