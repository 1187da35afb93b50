"""Inputs and parameters by name: where they stand in the tables, in functions of time and in expressions."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism, ModelError, make_input
from tests.says import says


def disc():
    """A disc of 2 kg m^2 on a pin."""
    m = Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    return m, body, m.revolute("pin", body, m.ground, axis=(0, 0, 1))


def test_an_input_is_a_torque_and_a_name_in_expressions():
    """2 w' = 1.5 u - c w with u = 4, c = 1."""
    m, body, pin = disc()
    m.torque("drive", body, m.input("load", "N m", 4.0))
    m.parameter("drag", "N m s/rad", 1.0)
    m.axis_torque("brake", pin.i, pin.j, "0.5*load - DRAG*WZ(pin.I, pin.J)")
    speed = m.simulate(1.0, tol=1e-9).angular_velocity("disc")[-1, 2]
    assert speed == pytest.approx(6.0 * (1.0 - np.exp(-0.5)), rel=1e-8)


@pytest.mark.parametrize("made", [lambda m: m.input, lambda m: make_input])
@pytest.mark.parametrize(("level", "order", "angle"), [("velocity", 1, 3.0), ("acceleration", 2, 1.5)])
def test_an_input_is_the_rate_of_a_motion(level, order, angle, made):
    m, _, pin = disc()
    unit = "rad/s" if order == 1 else "rad/s^2"
    m.rotation("motion", pin, made(m)("rate", unit, 3.0), level=level)
    assert gm.Simulator(m, 1.0).get("input", "rate") == 3.0
    assert m.simulate(1.0).joint_angle("pin")[-1] == pytest.approx(angle, abs=1e-9)
    assert m.compile().problem().numbers["rate"].prescribes == (("motion: angle", order),)


def test_a_number_is_written_to_all_its_places():
    """The torque from a straight line, its integral and the expressions agree with the table they stand in."""
    m, body, pin = disc()
    m.torque("drive", body, m.input("load", "torque", 4.0))
    m.axis_torque("brake", pin.i, pin.j, "0.5*load")
    problem = m.compile().problem()
    load, table = problem.numbers["load"], problem.rdata.copy()
    assert (load.unit, load.value(table, 7.0), load.slope(table)) == ("N*m", 4.0, 0.0)
    load.write(table, 2.0, 1.0, 0.5)
    assert [p.polynomial(table, 4.0)[:2] for p in load.places] == [(2.0, 0.5)] * 3
    out = np.zeros((2, problem.n))
    for row, numbers in zip(out, (problem.rdata, table), strict=True):
        problem.residual(4.0, problem.y0, problem.yp0, row, problem.idata, numbers, np.zeros(problem.work_size))
    assert np.sort(np.abs(out[1] - out[0]))[-2:] == pytest.approx([1.0, 2.0])


def test_integrals_of_an_input_go_on_from_where_they_are():
    m, _, pin = disc()
    m.rotation("motion", pin, m.input("rate", "rad/s^2", 2.0), level="acceleration", start=0.5, rate=1.0)
    problem = m.compile().problem()
    number, table = problem.numbers["rate"], problem.rdata.copy()
    place = number.places[1]
    before = place.polynomial(table, 3.0)
    assert before[:3] == pytest.approx((0.5 + 3.0 + 9.0, 1.0 + 6.0, 2.0))
    number.write(table, 3.0, -1.0, 6.0)
    assert place.polynomial(table, 3.0)[:4] == pytest.approx((*before[:2], -1.0, 6.0))
    assert place.polynomial(table, 4.0)[0] == pytest.approx(12.5 + 7.0 - 0.5 + 1.0)


def test_expressions_in_units_of_their_own():
    """A deck in mm and kN: the input is in N m, the expression in kN mm."""
    from gearmbs.mechanism.language.syntax import Units

    m, _, pin = disc()
    m.units = Units(length=1e-3, force=1e3)
    m.reads_units = False
    m.input("load", "N m", 4.0)
    m.axis_torque("drive", pin.i, pin.j, "2*load")
    assert m.simulate(1.0).angular_velocity("disc")[-1, 2] == pytest.approx(4.0, rel=1e-5)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m, pin: m.input("load", "N m"), ("load", "choose")),
        (lambda m, pin: m.parameter("LOAD", "N m", 1.0), ("LOAD", "choose")),
        (lambda m, pin: m.input("pi", "N m"), ("pi", "choose")),
        (lambda m, pin: m.input("speed", "rpm"), ("speed", "rpm", "give")),
        (lambda m, pin: m.input("speed", "rad/s", "3 N"), ("speed", "3 N", "rad/s")),
        (lambda m, pin: m.input("a'b", "N"), ("a'b", "give")),
        (lambda m, pin: m.torque("t", pin.i, m.input("speed", "rad/s")), ("speed", "rad/s", "N*m")),
        (lambda m, pin: m.rotation("m", pin, "2*load", level="velocity") and m.compile(), ("load", "state")),
        (lambda m, pin: m.axis_torque("t", pin.i, pin.j, "2*lod") and m.compile(), ("LOD", "load")),
    ],
)
def test_what_is_wrong_is_said_in_a_line(call, words):
    m, _, pin = disc()
    m.input("load", "N m", 4.0)
    with pytest.raises(ModelError, match=says(*words)) as error:
        call(m, pin)
    assert "\n" not in str(error.value)


def test_a_deck_has_inputs_as_variables(tmp_path):
    """With their present values, so that the deck moves as the mechanism does."""
    m, body, pin = disc()
    m.torque("drive", body, m.input("load", "N m", 4.0))
    m.parameter("drag", "N m s/rad", 1.0)
    m.axis_torque("brake", pin.i, pin.j, "0.5*load - DRAG*WZ(pin.I, pin.J)")
    gm.write_deck(m, tmp_path / "disc.adm", output=False, requests={"speed": "WZ(pin.I, pin.J)"})
    assert "FUNCTION = 4" in (tmp_path / "disc.adm").read_text()
    result = gm.run_deck(gm.read_deck(tmp_path / "disc.adm"), end=1.0, steps=10)
    speed = m.simulate(1.0).angular_velocity("disc")[-1, 2]
    assert np.abs(result.request(1)[-1] - speed).min() == pytest.approx(0.0, abs=1e-3 * speed)


def test_inputs_and_parameters_stand_in_forces_as_they_are():
    """The object, as the text with its name: 2 w' = 4, then 4 + 6 and -0.5 of the other side; in mm too."""
    m, _, pin = disc()
    m.axis_torque("drive", pin.i, pin.j, m.input("load", "N m", 4.0))
    m.load("more", pin.i, pin.j, tz=m.parameter("extra", "N m", 6.0))
    m.axis_force("push", pin.i, pin.j, make_input("elsewhere", "N"))
    assert list(m.inputs) == ["load", "elsewhere"]
    sim = gm.Simulator(m, 1.0)
    sim.set("elsewhere", 3.0)
    sim.advance(0.2)
    sim.set("extra", -5.0)
    sim.advance(0.4)
    assert sim.get("angular_velocity", "disc")[2] == pytest.approx(0.2 * 5.0 - 0.2 * 0.5, rel=1e-6)
    plant = m.linearize(["load", "elsewhere"], [("joint_rate", "pin"), ("reaction", "pin", "fz")])
    np.testing.assert_allclose(plant.frequency_response(1.0)[0, :, 1], [0.0, -1.0], atol=1e-9)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m, d, p: m.axis_torque("t", p.i, p.j, m.input("u", "N")), ("sforce 't'", "'u'", "N*m")),
        (lambda m, d, p: m.axis_torque("t", p.i, p.j, m.parameter("k", "N", 1.0)), ("sforce 't'", "'k'", "N*m")),
        (lambda m, d, p: m.axis_torque("t", p.i, p.j, Mechanism("o").parameter("k", "N m", 1.0)), ("'k'", "parameter")),
        (lambda m, d, p: m.torsion_spring("s", p.i, p.j, stiffness=m.parameter("k", "N m/rad", 1.0)), ("'s'", "'2*k'")),
        (lambda m, d, p: m.rotation("r", p, m.parameter("k", "rad", 1.0)), ("'r'", "'2*k'")),
        (lambda m, d, p: m.torque("t", d, m.parameter("k", "N", 1.0)), ("'t'", "'k'", "N*m")),
        (lambda m, d, p: m.torque("t", d, lambda t: 3.0), ("'t'", "m.function", "F(TIME)")),
        (lambda m, d, p: m.rotation("r", p, lambda t: 3.0), ("'r'", "m.function", "F(TIME)")),
        (lambda m, d, p: (m.parameter("u", "N", 1.0), m.torque("t", d, make_input("u", "N m"))), ("'u'", "parameters")),
        (lambda m, d, p: m.output("o", ("reaction", "pin", "q")), ("'o'", "'q'", "'fx'", "'tz'")),
        (lambda m, d, p: m.output("o", ("angular_velocity", "disc", "tz")), ("'o'", "'tz'", "'x', 'y' or 'z'")),
        (lambda m, d, p: m.output("o", ("kinetic_energy", "disc")), ("'o'", "'disc'", "leave")),
        (lambda m, d, p: m.output("o", ("joint_angle",)), ("'o'", "'joint_angle'", "joint")),
    ],
)
def test_what_stands_where_it_cannot_is_said_in_a_line(call, words):
    with pytest.raises(ModelError, match=says(*words)) as error:
        call(*disc())
    assert "\n" not in str(error.value)


def test_functions_of_python_are_torques_and_motions_by_a_name():
    """What the refusal of a bare one says: 2 w' = 3 t, and the angle of another disc is t^2."""
    m, _, pin = disc()
    m.function("PUSH", lambda t: 3.0 * t)
    m.axis_torque("drive", pin.i, pin.j, "PUSH(TIME)")
    other = m.body("other", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.function("TURN", lambda t: t**2)
    m.rotation("led", m.revolute("its pin", other, m.ground, axis=(0, 0, 1)), "TURN(TIME)")
    solution = m.simulate(1.0, tol=1e-8)
    assert solution.angular_velocity("disc")[-1, 2] == pytest.approx(0.75, abs=1e-6)
    assert solution.joint_angle("its pin")[-1] == pytest.approx(1.0, abs=1e-6)


def test_a_name_that_is_a_list_is_none_of_an_output():
    m, _, _ = disc()
    m.output("speed", ("angular_velocity", "disc", "z"))
    with pytest.raises(KeyError, match=says("['speed']", "the outputs are speed")):
        gm.Simulator(m, 1.0).get("output", ["speed"])


def test_a_parameter_is_a_torque():
    """2 w' = 3, then -1."""
    m, body, _ = disc()
    m.torque("drive", body, m.parameter("T", "N m", 3.0))
    sim = gm.Simulator(m, 1.0)
    sim.advance(0.2)
    sim.set("T", -1.0)
    sim.advance(0.4)
    assert sim.get("angular_velocity", "disc")[2] == pytest.approx(0.2 * 1.5 - 0.2 * 0.5, rel=1e-6)
    other, disc_of_other, _ = disc()
    with pytest.raises(ModelError, match=says("torque 'drive'", "'T'", "parameter")):
        other.torque("drive", disc_of_other, m.parameters["T"])
