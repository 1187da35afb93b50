"""Numbers of a mechanism as texts with a unit: the same tables as in SI, or an error with element and field."""

from __future__ import annotations

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism, ModelError, constant, harmonic, ramp, step
from gearmbs.mechanism.language.syntax import Units
from tests.says import says


def model(si: bool) -> Mechanism:
    """The same mechanism in SI and in texts with units."""

    def of(number, text):
        return number if si else text

    m = Mechanism("units", gravity=(0, 0, of(-9.81, "-9.81 m/s^2")))
    arm = m.body(
        "arm",
        of(0.5, "500 g"),
        of((1e-3, 2e-3, 2.5e-3), ("10 kg cm^2", "2e-3 kg m^2", 2.5e-3)),
        com=(of(0.1, "100 mm"), 0, 0),
        orientation=of((np.pi / 2, 0.0, 0.0), ("90 deg", 0, 0)),
        angular_velocity=(0, 0, of(np.pi, "30 rpm")),
    )
    block = m.body("block", 2.0, (1, 1, 1), position=(of(0.3, "30 cm"), 0, 0), velocity=(of(0.01, "1 cm/s"), 0, 0))
    pin = m.revolute("pin", arm, m.ground, at=(of(0.02, "20 mm"), 0, 0), axis=(0, 0, 1))
    guide = m.translational("guide", block, m.ground, axis=(1, 0, 0))
    tip, hook = arm.marker((of(0.2, "200 mm"), 0, 0), name="tip"), block.marker(name="hook")
    base = m.ground.marker(name="base")
    m.spring_damper(
        "spring", tip, hook, stiffness=of(1e4, "10 N/mm"), damping=of(20.0, "0.02 N s/mm"), length=of(0.15, "15 cm"),
        preload=of(3.0, "3 N"),
    )  # fmt: skip
    m.torsion_spring("coil", tip, base, stiffness=of(180.0 / np.pi, "1 N m/deg"), preload=of(0.2, "200 N mm"))
    m.bushing("rubber", hook, base, stiffness=(of(1e5, "100 N/mm"), 0, 0), damping=(of(30.0, "30 N s/m"), 0, 0))
    m.line_force("pull", tip, base, of(-5.0, "-5 N"))
    m.load("push", hook, base, fx=of(2.0, "2 N"), tz=of(0.3, "0.3 Nm"))
    m.torque("drive", arm, of(0.1, "100 N mm"))
    m.friction("dry", guide, 0.2, 0.1, preload_force=of(4.0, "4 N"), max_stiction_deformation=of(1e-5, "10 um"))
    m.friction("dry pin", pin, 0.2, 0.1, pin_radius=of(0.01, "1 cm"), preload_torque=of(0.01, "10 N mm"))
    return m


def test_texts_with_units_are_the_same_as_si():
    first, second = (model(si) for si in (True, False))
    a, b = (m.compile() for m in (first, second))
    np.testing.assert_allclose(b.pose, a.pose, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(b.model.bodies, a.model.bodies, rtol=1e-12, atol=1e-18)
    acc = [system.accelerations(system.pose, 0.0)[0] for system in (a, b) if system.initialise()]
    np.testing.assert_allclose(acc[1], acc[0], rtol=1e-9, atol=1e-9)
    assert np.abs(acc[0]).max() > 1.0


def test_motions_in_usual_units():
    m = Mechanism("motor")
    wheel = m.body("wheel", "1 kg", (1, 1, 1))
    slide = m.body("slide", 1.0, (1, 1, 1), position=(1, 0, 0))
    hinge = m.revolute("hinge", wheel, m.ground)
    guide = m.translational("guide", slide, m.ground, axis=(1, 0, 0))
    m.rotation("motor", hinge, "60 rpm", level="velocity", start="90 deg")
    m.translation("shift", guide, "2 mm/s^2", level="acceleration", rate="1 cm/s", start="5 mm")
    solution = m.simulate("500 ms", rate="100 Hz")
    # half a turn in half a second; 5 mm + 10 mm/s t + 1 mm/s^2 t^2 further along
    assert solution.t[-1] == 0.5
    assert solution.angular_velocity("wheel")[-1, 2] == pytest.approx(2 * np.pi, rel=1e-9)
    assert solution.com_position("slide")[-1, 0] == pytest.approx(1.01025, rel=1e-6)


def test_functions_of_time_in_usual_units():
    assert ramp("60 rpm", over="20 ms")(1.02) == pytest.approx(2 * np.pi * (1.02 - 0.01), rel=1e-12)
    assert step("10 ms", 0, "20 ms", "90 deg")(0.02) == pytest.approx(np.pi / 2, rel=1e-12)
    assert harmonic("10 mm", "1 Hz", "90 deg")(0.5) == pytest.approx(-0.01, rel=1e-12)
    assert constant("3 kN")(0.0) == pytest.approx(3000.0, rel=1e-12)


@pytest.mark.parametrize(
    ("add", "words"),
    [
        (lambda m, i, j: m.spring_damper("s", i, j, stiffness="10 N"), "spring-damper 's': stiffness: '10 N' is in N"),
        (lambda m, i, j: m.spring_damper("s", i, j, stiffness=[1]), r"spring-damper 's': stiffness: got \[1\]"),
        (lambda m, i, j: m.bushing("b", i, j, stiffness="soft"), "bushing 'b': stiffness: 'soft' is not a vector"),
        (lambda m, i, j: m.line_force("f", i, j, "10 mm"), "sforce 'f': '10 mm' is in mm"),
        (lambda m, i, j: m.line_force("f", i, j, "10*(DM(a,b)"), r"sforce 'f': expected '\)'"),
        (lambda m, i, j: m.rotation("r", m.joints["pin"], "3 m"), says("'r'", "'3 m'", "motion")),
        (lambda m, i, j: m.rotation("r", m.joints["pin"], "2*TIM("), "motion 'r': expected"),
        (lambda m, i, j: m.rotation("r", m.joints["pin"], "5 mm/s", level="velocity"), "motion 'r': '5 mm/s' is in mm"),
        (lambda m, i, j: m.friction("f", m.joints["pin"], 0.2, 0.1, pin_radius="1 s"), "f': pin_radius: '1 s'"),
        (lambda m, i, j: m.field("k", i, j, stiffness="1 N/m"), says("field 'k'", "stiffness", "'1 N/m'")),
        (lambda m, i, j: ramp("5 apples"), "ramp: rate: cannot read '5 apples'"),
        (lambda m, i, j: m.simulate("5 m"), "t_end: '5 m' is in m"),
    ],
)
def test_wrong_quantities_name_element_and_field(add, words):
    m = Mechanism("m")
    body = m.body("b", 1.0, (1, 1, 1))
    m.revolute("pin", body, m.ground)
    i, j = body.marker(name="i"), m.ground.marker((1, 0, 0), name="j")
    with pytest.raises(ModelError, match=words):
        add(m, i, j)


def test_decks_know_no_units_in_texts():
    """There a text is an expression in the deck's own units."""
    from gearmbs.adams import DeckError, parse_deck

    deck = "x\nPART/1,GROUND\nMARKER/10,PART=1\nPART/2,MASS=2,CM=20,IP=1,1,1\nMARKER/20,PART=2\n"
    deck += "SFORCE/1,TRANS,I=20,J=10,FUNCTION=5 N\nEND\n"
    with pytest.raises(DeckError, match="SFORCE/1"):
        parse_deck(deck).to_mechanism()


@pytest.mark.parametrize("unit", ["deg", "rpm", "mm", "mV", "degC", "pump", 3])
def test_an_input_is_in_a_unit_of_si(unit):
    with pytest.raises(ModelError, match=says("'u'", repr(unit), "SI")):
        Mechanism("motor").input("u", unit)


@pytest.mark.parametrize("units", [Units(), Units(length=1e-3)])
def test_a_voltage_drives_a_motor(units):
    """J w' = k (U - k w)/R, of which the speed goes to U/k: units beyond mechanics are in no mechanism's own."""
    m = Mechanism("motor")
    m.units = units
    rotor = m.body("rotor", mass=1.0, inertia=(1e-3, 1e-3, 1e-3))
    pin = m.revolute("pin", rotor, m.ground, axis=(0, 0, 1))
    m.input("voltage", "V", "12 V")
    m.parameter("k", "N m/A", "0.1 N m/A")
    m.parameter("R", "ohm", "2 ohm")
    torque = 1.0 / units.length
    m.axis_torque("drive", pin.i, pin.j, f"{torque}*k*(voltage - k*WZ({pin.i.name}, {pin.j.name}))/R")
    sim = gm.Simulator(m, 1.0, tol=1e-8)
    sim.advance(0.1)
    slowing = np.exp(-0.1 * 0.01 / 2.0 / 1e-3)
    assert sim.get("angular_velocity", "rotor")[2] == pytest.approx(120.0 * (1.0 - slowing), rel=1e-6)
    sim.set("voltage", "24 V")
    with pytest.raises(ModelError, match=says("'voltage'", "N", "V")):
        sim.set("voltage", "24 N")
    with pytest.raises(ModelError, match=says("'voltage'", "torque")):
        m.torque("wrong", rotor, m.inputs["voltage"])
