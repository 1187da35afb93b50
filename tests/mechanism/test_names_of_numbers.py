"""Names of inputs and parameters that would mean something else, and values an element could not be made with."""

from dataclasses import replace

import pytest

import gearmbs as gm
from gearmbs.bearings import Bearing, RollingBearing
from gearmbs.drivetrain import ClearanceBearing
from gearmbs.mechanism import Mechanism, ModelError, make_input
from gearmbs.studies.run.simulation import case_mechanism
from tests.drivetrain.support import stage
from tests.says import says


def disc():
    """A disc of 2 kg m^2 with a torque that is called brake."""
    m = Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    pin = m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torque("brake", body, 0.0)
    return m, body, pin


@pytest.mark.parametrize(
    ("add", "words"),
    [
        (lambda m, b: m.input("brake.torque", "N m"), ("'brake.torque'", "'brake'", "choose")),
        (lambda m, b: m.parameter("Brake.Torque", "N m", 1.0), ("'Brake.Torque'", "'brake'", "choose")),
        (lambda m, b: m.input("pin.i", "N m"), ("'pin.i'", "marker", "choose")),
        (lambda m, b: (m.variable("u", "3"), m.input("u", "N m")), ("'u'", "variable", "choose")),
        (lambda m, b: (m.input("u", "N m"), m.algebraic_state("U", "3")), ("'u'", "state", "choose")),
        (lambda m, b: m.input("load-2", "N m"), ("'load-2'", "call", "'load_2'")),
        (lambda m, b: m.parameter("3", "N m", 1.0), ("'3'", "call", "'u_3'")),
        (lambda m, b: m.input("f(x)", "N m"), ("'f(x)'", "call", "'f_x'")),
        (lambda m, b: m.input(" load", "N m"), ("' load'", "blank", "leave")),
        (lambda m, b: [m.torque(n, b, make_input("u", "N m", k)) for k, n in enumerate("ab")], ("'u'", "1", "0")),
        (lambda m, b: [m.torque(n, b, make_input(n, "N m")) for n in "aA"], ("'A'", "'a'", "choose")),
    ],
)
def test_names_that_mean_something_else_are_refused(add, words):
    m, body, _ = disc()
    with pytest.raises(ModelError, match=says(*words)) as error:
        (add(m, body), m.compile())
    assert "\n" not in str(error.value)


def test_a_name_of_a_case_is_its_own():
    m = case_mechanism(gm.Case())
    with pytest.raises(ModelError, match=says("'operation.torque'", "'load.torque'", "choose")):
        m.input("operation.torque", "N m")


@pytest.mark.parametrize("name", ["load_2", "load.2", "load 2", "Last", "WZ", "disc", "mean:2"])
def test_names_that_work(name):
    """As a torque, and in an expression in quotation marks: 2 w' = 1 + 1."""
    m, body, pin = disc()
    m.torque("drive", body, m.input(name, "N m"))
    m.axis_torque("more", pin.i, pin.j, f'"{name}"')
    sim = gm.Simulator(m, 1.0)
    sim.set(name, 1.0)
    sim.advance(0.5)
    assert sim.get("angular_velocity", "disc")[2] == pytest.approx(0.5)


def test_a_torque_may_be_the_input_of_its_own_name():
    m, body, _ = disc()
    m.torque("drive", body, m.input("drive.torque", "N m"))
    sim = gm.Simulator(m, 1.0)
    sim.set("drive.torque", 2.0)
    sim.advance(0.5)
    assert sim.get("angular_velocity", "disc")[2] == pytest.approx(0.5)


def loose():
    whole = stage()
    bearing = ClearanceBearing(name="loose", shaft=whole.bearings[0].shaft, clearance="20 um")
    return replace(whole, bearings=[*whole.bearings, bearing]).build()


def meshed():
    return case_mechanism(gm.Case())


def ideal():
    m = meshed()
    element = m.elements["mesh"]
    m.elements["mesh"] = gm.IdealMesh(gm.GearPair.paper(), 4e8, 2e3).contact_element("mesh", element.i, element.j)
    return m


def rolling():
    m = Mechanism("shaft")
    shaft = m.body("shaft", mass=1.0, inertia=(1e-3, 1e-3, 1e-3))
    bearing = Bearing(kind="deep groove", elements=9, element_diameter="8 mm", pitch_diameter="40 mm")
    m.add(RollingBearing.between("A", shaft, m.ground, bearing, at=(0, 0, 0)))
    return m


@pytest.mark.parametrize(
    ("model", "name", "wrong", "right"),
    [
        (loose, "loose.clearance", (-1e-6, 0.0), 1e-6),
        (loose, "loose.stiffness", (0.0,), 1e7),
        (loose, "loose.damping", (-1.0,), 0.0),
        (meshed, "mesh.stiffness", (-1e8, 0.0), 1e8),
        (meshed, "mesh.damping", (-1.0,), 0.0),
        (ideal, "mesh.stiffness", (0.0,), 1e8),
        (ideal, "mesh.damping", (-1.0,), 0.0),
        (rolling, "A.clearance", (-2e-3, 2e-3), -1e-6),
    ],
)
def test_what_an_element_could_not_be_made_with_is_not_set(model, name, wrong, right):
    """Also by a controller, and before a run."""
    m = model()
    sim = gm.Simulator(m, 0.01)
    before = sim.get("input", name)
    for value in wrong:
        told = says(name, f"{value:g}", "must")
        with pytest.raises(ModelError, match=told) as error:
            sim.set(name, value)
        assert "\n" not in str(error.value)
        with pytest.raises(ModelError, match=told):
            m.simulate(0.01, inputs={name: value})
        assert sim.get("input", name) == before
    sim.set(name, right)
    assert sim.get("input", name) == right


def test_springs_may_be_negative():
    """As they can be made."""
    m, _, pin = disc()
    m.torsion_spring("s", pin.i, pin.j, stiffness=-1.0)
    sim = gm.Simulator(m, 1.0)
    sim.set("s.stiffness", -2.0)
    assert sim.get("input", "s.stiffness") == -2.0


def test_two_names_of_one_number_are_one():
    """Two controllers or two inputs are refused under them as under one; two numbers are not."""
    m = case_mechanism(gm.Case())
    names = "operation.torque", "load.torque"
    for first, second in (names, names[::-1]):
        sim = gm.Simulator(m, 0.01)
        sim.control(first, lambda t, _: 60.0, sample_time=1e-3)
        with pytest.raises(ModelError, match=says(repr(first), repr(second), "controller")):
            sim.control(second, lambda t, _: 50.0, sample_time=1e-3)
        with pytest.raises(ModelError, match=says(repr(first), repr(second), "inputs")):
            m.simulate(0.001, inputs={first: 60.0, second: 50.0})
    m, body, _ = disc()
    one, other = m.input("one", "N m"), m.input("other", "N m")
    m.torque("drive", body, one)
    m.torque("load", body, other)
    sim = gm.Simulator(m, 1.0)
    for number in (one, other):
        sim.control(number, lambda t, _: 1.0, sample_time=0.1)
    with pytest.raises(ModelError, match=says("'one'", "controller")):
        sim.control("one", lambda t, _: 1.0, sample_time=0.1)
    sim.advance(1.0)
    solution = m.simulate(1.0, rate=1.0, inputs={"one": 1.0, "other": 1.0})
    for found in (sim.get("angular_velocity", "disc"), solution.angular_velocity("disc")[-1]):
        assert found[2] == pytest.approx(1.0)
