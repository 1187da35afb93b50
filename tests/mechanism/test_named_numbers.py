"""Numbers of elements by name, outputs by name, and runs whose inputs are given over time."""

from dataclasses import replace

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.bearings import Bearing, RollingBearing
from gearmbs.drivetrain import ClearanceBearing, TorqueLoad
from gearmbs.gears import ContactLaw, planetary_mechanism
from gearmbs.mechanism import Mechanism, ModelError, make_input, polyline
from gearmbs.studies.run.simulation import case_mechanism
from tests.drivetrain.support import stage
from tests.gears.test_elastic_ring import BOLTED, GEARS
from tests.mechanism.test_setting import two_discs
from tests.says import says

PAIR = {"tol": 1e-7, "rate_scale": 3000.0}


def oscillator(stiffness=400.0):
    """A mass of 4 kg on a spring along x, pulled by an input."""
    m = Mechanism("oscillator")
    block = m.body("block", mass=4.0, inertia=(1.0, 1.0, 1.0), position=(1.0, 0, 0))
    m.translational("guide", block, m.ground, at=(1.0, 0, 0), axis=(1, 0, 0))
    i, j = block.marker(name="i"), m.ground.marker(name="j")
    m.spring_damper("spring", i, j, stiffness=stiffness, length=1.0)
    m.load("pull", i, j, fx=str(m.input("load", "N", 2.0).name))
    m.output("place", ("com_position", "block", "x"))
    m.output("force", ("load", "pull", "fx"))
    m.output("spring energy", "200*(DX(i, j) - 1)**2")
    return m


def test_a_stiffness_is_set():
    """x'' = (F - k x)/m: half a swing with k, then about another place with 4 k and twice the frequency."""
    sim = gm.Simulator(oscillator(), 2.0, tol=1e-9)
    sim.advance(np.pi / 10.0)
    assert sim.get("output", "place") == pytest.approx(1.01, abs=1e-8)
    sim.set("spring.stiffness", "1.6 N/mm")
    assert sim.get("input", "spring.stiffness") == 1600.0
    sim.advance(np.pi / 10.0 + np.pi / 20.0)
    assert sim.get("output", "place") == pytest.approx(1.0 + 0.00125 - (0.01 - 0.00125), abs=1e-8)
    np.testing.assert_allclose(sim.solution().input("spring.stiffness"), [400.0, 400.0, 1600.0])


def test_a_bushing_is_set_axis_by_axis():
    """The same as one made with these numbers; what is zero has no name."""

    def held(stiffness, torsional_stiffness, damping):
        m = Mechanism("block on a bushing")
        block = m.body("block", mass=4.0, inertia=(1.0, 2.0, 3.0), velocity=(0.1, 0.2, 0.3))
        block.angular_velocity = (0.0, 0.02, 0.01)
        i, j = block.marker(name="i"), m.ground.marker(name="j")
        m.bushing("bush", i, j, stiffness=stiffness, torsional_stiffness=torsional_stiffness, damping=damping)
        return m

    sim = gm.Simulator(held((100.0, 200.0, 300.0), (50.0, 60.0, 70.0), (0.0, 5.0, 0.0)), 0.5, tol=1e-9)
    sim.set("bush.stiffness_z", "1 N/mm")
    sim.set("bush.torsional_stiffness_y", 600.0)
    sim.set("bush.damping_y", 50.0)
    sim.advance(0.5)
    other = held((100.0, 200.0, 1000.0), (50.0, 600.0, 70.0), (0.0, 50.0, 0.0)).simulate(0.5, tol=1e-9)
    np.testing.assert_allclose(sim.get("com_position", "block"), other.com_position("block")[-1], atol=1e-9)
    np.testing.assert_allclose(sim.get("orientation", "block"), other.orientation("block")[-1], atol=1e-9)
    with pytest.raises(ModelError, match=says("bush.damping_x", "bush.damping_y")):
        sim.set("bush.damping_x", 1.0)


def test_a_mesh_is_that_of_a_pair_with_the_same_numbers():
    """What stands in the tables for a stiffness that is set is what a pair made with it has there."""
    m = case_mechanism(gm.Case())
    problem = m.compile().problem()
    law = m.elements["mesh"].pair.contact_model.law
    table = problem.rdata.copy()
    for name, value in (("stiffness", law.stiffness), ("damping", law.damping)):
        number = problem.numbers[f"mesh.{name}"]
        assert number.value(table, 0.0) == pytest.approx(value, rel=1e-14)
        number.write(table, 0.0, 1.5 * value)
    made = m.elements["mesh"]
    made.pair = made.pair.with_changes(contact=replace(law, stiffness=1.5 * law.stiffness, damping=1.5 * law.damping))
    np.testing.assert_allclose(table, m.compile().problem().rdata, rtol=1e-14)
    assert problem.numbers["load.torque"].value(table, 0.0) == 100.0


def test_outputs_are_those_of_the_solution():
    """All of them at each point, of bodies as one and of all."""
    m = case_mechanism(gm.Case())
    wheel = next(iter(m.bodies))
    m.output("force", ("load", "mesh", "fx"))
    m.output("error", ("transmission_error", "mesh"))
    m.output("speed", ("angular_velocity", wheel, "z"))
    m.output("turned", f'AZ("{m.elements["mesh"].i.name}")')
    m.output("pose", ("com_position", wheel))
    for lump in (True, False):
        sim, told = gm.Simulator(m, 0.01, lump=lump, **PAIR), []
        for t in np.linspace(0.0, 0.004, 9)[1:]:
            sim.advance(t)
            told.append({name: sim.get("output", name) for name in m.outputs})
        solution = sim.solution()
        for name in m.outputs:
            np.testing.assert_array_equal([row[name] for row in told], solution.output(name)[1:])
        assert np.abs(solution.output("error")).max() < 1e-3


def test_the_transmission_error_is_the_lag_under_load():
    """Two wheels on fixed axes, in steady mesh: the compression along the line of action, within the mesh's own."""
    m = case_mechanism(gm.Case())
    m.output("error", ("transmission_error", "mesh"))
    solution = m.simulate(0.06, lump=True, **PAIR)
    late = solution.t > 0.055
    depth = solution.diagnostics("mesh")["penetration_drive"][late]
    error = np.abs(solution.output("error")[late])
    assert 0.3 * depth.mean() < error.mean() < 10.0 * depth.mean()


def test_inputs_over_time():
    times, values = [0.0, 0.1, 0.3, 1.0], [1.0, 5.0, -3.0, 2.0]
    m = two_discs()
    led = m.simulate(0.5, tol=1e-9, inputs={"load": (times, values, 1)})
    m.elements["drive"].function = polyline(times, values, rounding=0.0)
    wanted = m.simulate(0.5, tol=1e-9, breakpoints=[0.1, 0.3])
    np.testing.assert_allclose(led.angular_velocity("b"), wanted.angular_velocity("b"), rtol=0, atol=2e-7)
    np.testing.assert_allclose(led.input("load"), np.interp(led.t, times, values), atol=1e-12)
    assert led.success


def test_inputs_that_hold_or_are_asked():
    """A table, a function at its sample times and one value: the same run."""
    grid = np.array([0.0, 0.1, 0.2, 0.3, 0.4])
    table = two_discs().simulate(0.5, tol=1e-9, inputs={"load": (grid, 3.0 - 10.0 * grid)})
    asked = two_discs().simulate(0.5, tol=1e-9, inputs={"load": (lambda t: 3.0 - 10.0 * t, "0.1 s")})
    for body in "ab":
        np.testing.assert_allclose(table.angular_velocity(body), asked.angular_velocity(body), rtol=0, atol=1e-8)
    held = two_discs().simulate(0.5, inputs={"load": "3 N m"})
    mean = (2.0 * held.angular_velocity("a")[:, 2] + held.angular_velocity("b")[:, 2]) / 3.0
    np.testing.assert_allclose(mean, held.t, rtol=0, atol=1e-5)


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        ({"lod": 3.0}, ("lod", "load")),
        ({"load": ([0.0, 1.0], [1.0])}, ("load", "(2,)", "(1,)")),
        ({"load": ([0.0, 1.0, 0.5], [1.0, 1.0, 1.0])}, ("load", "0.5", "increase")),
        ({"load": ([0.2, 1.0], [1.0, 1.0])}, ("load", "0.2", "begin")),
        ({"load": ([0.0, 1.0], [1.0, 1.0], 2)}, ("load", "2")),
        ({"load": lambda t: 1.0}, ("load", "sample_time")),
        ({"load": ([0.0, 1.0], ["3 rpm", 1.0])}, ("load", "3 rpm")),
        ([3.0], ("inputs", "mapping")),
    ],
)
def test_inputs_that_cannot_be_are_refused(inputs, words):
    with pytest.raises(ModelError, match=says(*words)) as error:
        two_discs().simulate(0.5, inputs=inputs)
    assert "\n" not in str(error.value)


def test_what_cannot_be_set_says_so():
    sim = gm.Simulator(oscillator(), 1.0)
    for name in ("block.mass", "spring.name"):
        with pytest.raises(ModelError, match=says(name, "initial=")):
            sim.set(name, 1.0)
    with pytest.raises(ModelError, match=says("spring.stifness", "spring.stiffness")):
        sim.set("spring.stifness", 1.0)


@pytest.mark.parametrize(
    ("name", "what", "words"),
    [
        ("load", "1", ("load", "choose")),
        ("new", "2*(3", ("new",)),
        ("new", 3.0, ("new", "3.0", "give")),
        ("new", [], ("new", "give")),
    ],
)
def test_outputs_that_cannot_be_are_refused(name, what, words):
    with pytest.raises(ModelError, match=says(*words)):
        oscillator().output(name, what)


def test_outputs_that_are_not_there():
    m = oscillator()
    with pytest.raises(ModelError, match=says("odd", "'fx'", "'x', 'y' or 'z'")):
        m.output("odd", ("com_position", "block", "fx"))
    solution = m.simulate(0.01)
    with pytest.raises(KeyError, match=says("plase", "place")):
        solution.output("plase")
    with pytest.raises(KeyError, match=says("lod", "load")):
        solution.input("lod")


def test_the_torque_of_a_case_is_set_by_its_own_name():
    sim = gm.Simulator(case_mechanism(gm.Case()), 0.07, lump=True, **PAIR)
    sim.advance(0.06)
    before = sim.get("input", "operation.torque")
    sim.set("operation.torque", "60 N m")
    sim.advance(0.061)
    # the torque of the load about its shaft
    moment = float(np.linalg.norm(sim.get("load", "load")[1]))
    assert (before, moment, sim.get("input", "load.torque")) == pytest.approx((100.0, 60.0, 60.0))


def test_loads_of_a_drivetrain_are_inputs():
    """A number has the name of its load; an input has its own, and is one of the mechanism that is built."""
    assert "brake.torque" in stage().build().compile().problem().numbers
    load = TorqueLoad(name="brake", shaft="out", torque=make_input("braking", "N m", "0.3 kN m"))
    m = stage(loads=[load]).build()
    assert m.inputs["braking"].start == 300.0
    sim = gm.Simulator(m, 0.02)
    sim.advance(0.001)
    sim.set("braking", 120.0)
    sim.advance(0.002)
    assert np.linalg.norm(sim.get("load", "brake")[1]) == pytest.approx(120.0)


def test_a_clearance_that_is_set_is_that_of_the_part():
    """Radial in both: what stands in the tables is what a part made with it has there."""

    def problem(clearance):
        whole = stage()
        bearing = ClearanceBearing(name="loose", shaft=whole.bearings[0].shaft, clearance=clearance)
        return replace(whole, bearings=[*whole.bearings, bearing]).build().compile().problem()

    small, large = problem("20 um"), problem("80 um")
    number, table = small.numbers["loose.clearance"], small.rdata.copy()
    assert number.value(table, 0.0) == pytest.approx(20e-6)
    number.write(table, 0.0, 80e-6)
    np.testing.assert_allclose(table, large.rdata, rtol=1e-14)


def settles(make, name, values):
    """What stands in the tables for all numbers of a kind that are set is what a mechanism made with them has there."""
    first, other = (make(value).compile().problem() for value in values)
    table = first.rdata.copy()
    for number in (number for known, number in first.numbers.items() if known.endswith(name)):
        assert number.value(table, 0.0) == pytest.approx(values[0], rel=1e-9)
        number.write(table, 0.0, values[1])
    np.testing.assert_allclose(table, other.rdata, rtol=1e-13, atol=1e-300)
    assert (first.rdata != other.rdata).any()


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("deep groove", {}),
        ("four point", {"contact_angle": "35 deg"}),
        ("cylindrical roller", {"roller_length": "10 mm"}),
        ("tapered roller", {"roller_length": "12 mm", "contact_angle": "15 deg"}),
    ],
)
def test_the_clearance_of_rolling_bearings_is_set(kind, options):
    def held(clearance):
        m = Mechanism("shaft")
        shaft = m.body("shaft", mass=1.0, inertia=(1e-3, 1e-3, 1e-3))
        sizes = {"elements": 9, "element_diameter": "8 mm", "pitch_diameter": "40 mm", "clearance": clearance}
        bearing = Bearing(kind=kind, **sizes, **options)
        m.add(RollingBearing.between("A", shaft, m.ground, bearing, at=(0, 0, 0)))
        return m

    settles(held, "A.clearance", (10e-6, 35e-6))


def test_ideal_and_elastic_meshes_are_set():
    pair = gm.GearPair.paper()

    def ideal(stiffness=4e8, damping=2e3):
        m = case_mechanism(gm.Case())
        element = m.elements["mesh"]
        m.elements["mesh"] = gm.IdealMesh(pair, stiffness, damping).contact_element("mesh", element.i, element.j)
        return m

    settles(ideal, "mesh.stiffness", (4e8, 6e8))
    settles(lambda damping: ideal(damping=damping), "mesh.damping", (2e3, 5e3))

    def ring(stiffness):
        gears = replace(GEARS, contact=replace(ContactLaw.impact(), stiffness=stiffness))
        return planetary_mechanism(gears, torques={"carrier": -200.0}, rim=BOLTED)

    settles(ring, ".stiffness", (ContactLaw.impact().stiffness, 1.3 * ContactLaw.impact().stiffness))
