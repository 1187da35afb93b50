"""Mechanisms written as decks and read again move alike; the files of a run can be read back."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from gearmbs.adams import parse_deck
from gearmbs.adams.results.res import NAMESPACE
from gearmbs.adams.runner import run_deck
from gearmbs.adams.write.deck_writer import write_deck
from gearmbs.adams.write.text import wrapped
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism, curve, curve_integral, harmonic, polynomial, ramp, step
from gearmbs.mechanism.language.syntax import Units
from tests.says import says

from .decks import PENDULUM
from .requests import read_requests


def two_arms() -> Mechanism:
    """A driven arm, a second one on it, springs, a bushing, an expression with a variable and a spline."""
    m = Mechanism("two arms", gravity=(0, 0, -9.81))
    a = m.body("arm a", 1.5, (0.1, 0.2, 0.15, 0.01, 0.0, 0.02), position=(0.1, 0, 0), com=(0.4, 0, 0))
    b = m.body("arm b", 0.7, (0.05, 0.06, 0.07), position=(0.9, 0, 0), orientation=(0.3, 0.2, -0.1))
    pin = m.revolute("pin", a, m.ground, at=(0.1, 0, 0), axis=(0, 1, 0))
    m.spherical("ball", b, a, at=(0.9, 0, 0))
    m.rotation("drive", pin, ramp(3.0, 0.2))
    tip = b.marker((0.5, 0, 0), name="tip")
    post = m.ground.marker((1.5, 0.2, -0.3), axis=(1, 0, 1), name="post")
    m.spring_damper("spring", tip, post, stiffness=20.0, damping=0.5)
    m.bushing("bush", tip, post, stiffness=(1, 2, 3), torsional_damping=(0.01, 0.02, 0.03))
    m.variable("gap", 'DM("tip","post")')
    m.spline("curve", [0.0, 0.5, 1.0, 2.0, 5.0], [0.0, 0.2, 0.1, -0.3, 0.4])
    m.load("push", tip, post, fx="CUBSPL(VARVAL(gap), 0, curve) + DIF(lag)", tz="0.1*SIN(5*TIME)")
    m.differential_state("lag", "-2*DIF(lag) + VARVAL(gap)", 0.3)
    m.torque("twist", b, step(0.1, 0.0, 0.3, 0.05), axis=(0, 0, 1))
    return m


@pytest.mark.parametrize("units", [Units(), Units(length=1e-3, force=1.0)])
def test_written_mechanism_moves_alike(units):
    m = two_arms()
    original = m.simulate(0.5, rate=20, tol=1e-9, corrector="modified")
    if units != Units():
        # expressions of a mechanism are in its units, so only one without any can change them
        m = Mechanism("pendulum", gravity=(0, 0, -9.81))
        body = m.body("rod", 1.0, (0.1, 0.1, 0.01), position=(0.5, 0, 0), velocity=(0, 0.1, 0))
        m.spherical("ball", body, m.ground, at=(0, 0, 0))
        original = m.simulate(0.5, rate=20, tol=1e-9, corrector="modified")
        m.units = units
    deck = parse_deck(write_deck(m))
    assert not deck.diagnostics
    again = deck.to_mechanism()
    solution = again.simulate(0.5, rate=20, tol=1e-9, corrector="modified")
    for name in m.bodies:
        np.testing.assert_allclose(solution.com_position(name), original.com_position(name), atol=1e-7)
        np.testing.assert_allclose(solution.angular_velocity(name), original.angular_velocity(name), atol=1e-5)


@pytest.mark.parametrize(
    "kind", ["fixed", "translational", "cylindrical", "universal", "planar", "constant_velocity", "inline", "inplane",
             "orientation", "parallel_axes", "perpendicular", "at_point"],
)  # fmt: skip
def test_every_joint_is_written_and_read(kind):
    m = Mechanism("one joint")
    body = m.body("b", 1.0, (0.1, 0.2, 0.3))
    i, j = body.marker(axis=(1, 0, 0), name="i"), m.ground.marker(axis=(0, 0, 1), name="j")
    if kind not in ("universal", "perpendicular"):
        j = m.ground.marker(axis=(1, 0, 0), name="j2")
    joint = m.joint(kind, "the joint", i, j)
    again = parse_deck(write_deck(m)).to_mechanism()
    assert again.joints["the joint"].kind == kind
    assert [r.label for r in again.joints["the joint"].rows] == [r.label for r in joint.rows]


@pytest.mark.parametrize(
    "function", [2.5, step(0.1, 1.0, 0.4, 3.0), step(0.1, 1.0, 0.4, 3.0, quintic=True), harmonic(2.0, 5.0, 0.3, 1.0),
                 polynomial([1.0, -2.0, 3.0]), ramp(4.0, 0.3, 0.5), ramp(4.0, 0.3, 0.5, quintic=True),
                 curve([0.1, 0.3, 0.4], [1.0, 3.0, -2.0]), curve_integral([0.1, 0.3, 0.4], [1.0, 3.0, -2.0], 0.5)],
)  # fmt: skip
def test_functions_of_time_are_written_as_expressions(function):
    from gearmbs.mechanism.language.library import compile_expression
    from gearmbs.mechanism.language.syntax import Scope
    from gearmbs.mechanism.parts.functions import as_function, function_text
    from tests.dae.equations.expressions.support import time_series

    f = as_function(function)
    # in milliseconds and tenths
    tape = compile_expression(function_text(f, 1e-3, 0.1) + "+0*TIME+TIME-TIME", Scope(units=Units(time=1e-3)))
    for t in (0.05, 0.2, 0.35, 0.7):
        expected = f.derivatives(t)
        value = time_series(tape, t) if tape.constant is None else (tape.constant, 0.0, 0.0)
        np.testing.assert_allclose(np.array(value) * 0.1, expected, rtol=1e-10, atol=1e-10)


def test_rotation_coupler_screw_and_distance_survive():
    m = Mechanism("coupled")
    a, b = m.body("a", 1, (1, 1, 1)), m.body("b", 1, (1, 1, 1), position=(1, 0, 0))
    pin = m.revolute("pin", a, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    rail = m.translational("rail", b, m.ground, at=(1, 0, 0), axis=(1, 0, 0))
    m.coupler("rack", [(pin, 0.2), (rail, -1.0)])
    c, d = m.body("c", 1, (1, 1, 1)), m.body("d", 1, (1, 1, 1), position=(0, 0, 2))
    m.screw("thread", c, m.ground, pitch=0.05, at=(0, 0, 0), axis=(0, 0, 1))
    m.distance("rod", d.marker(name="d end"), m.ground.marker((0, 0, 1), name="post"))
    again = parse_deck(write_deck(m)).to_mechanism()
    rows = {n: [(t.kind, t.coefficient) for r in j.rows for t in r.terms] for n, j in m.joints.items()}
    for name in ("rack", "thread"):
        other = [(t.kind, t.coefficient) for r in again.joints[name].rows for t in r.terms]
        assert [kind for kind, _ in other] == [kind for kind, _ in rows[name]]
        assert [c for _, c in other] == pytest.approx([c for _, c in rows[name]])
    assert "DM(" in again.constraints["rod"].rows["expression"]


def test_friction_fields_and_loads_of_reactions_survive():
    m = Mechanism("dry", gravity=(0, 0, -9.81))
    bob = m.body("bob", 1.0, (0.01, 0.01, 0.01), position=(0.5, 0, -0.8))
    pin = m.revolute("pin", bob, m.ground, at=(0, 0, 0), axis=(0, -1, 0))
    m.friction("dry", pin, 0.3, 0.2, pin_radius=0.05)
    i, j = bob.marker(name="i"), m.ground.marker((0, 0, -1.2), name="j")
    m.field("pad", i, j, stiffness=np.diag([5, 5, 5, 0.1, 0.1, 0.1]))
    m.axis_torque("brake", pin.i, pin.j, "-0.01*JOINT(pin, 0, 1)")
    again = parse_deck(write_deck(m)).to_mechanism()
    # what is written is equal up to rounding, which may change the choice of steps: as close as the integration
    one, two = (x.simulate(1.0, rate=100, tol=1e-11).com_position("bob") for x in (m, again))
    np.testing.assert_allclose(two, one, atol=1e-9)


def test_arrays_and_plants_survive():
    m = Mechanism("data")
    block = m.body("block", 2.0, (1, 1, 1))
    i, j = block.marker(name="i"), m.ground.marker(axis=(1, 0, 0), name="j")
    m.array("steps", [1.0, 3.0])
    m.variable("input", "ARYVAL(steps, 2)*TIME")
    m.plants["poutput", "out"] = ("input",)
    m.axis_force("push", i, j, "POUVAL(out, 1) + ARYVAL(steps, 1)")
    again = parse_deck(write_deck(m)).to_mechanism()
    solution = again.simulate(1.0, rate=4, tol=1e-9)
    # a = (1 + 3 t)/2
    np.testing.assert_allclose(solution.com_position("block")[:, 0], solution.t**2 / 4 + solution.t**3 / 4, atol=1e-8)


@pytest.mark.parametrize("units", [Units(), Units(length=1e-3, time=1e-3)])
def test_motions_by_their_rates_are_written_as_such(units):
    """ADAMS integrates them itself: MOTION/.., VELOCITY and ACCELERATION, with the values at the start."""
    m = Mechanism("driven")
    wheel, slide = m.body("wheel", 1, (1, 1, 1)), m.body("slide", 1, (1, 1, 1))
    m.rotation("spin", m.revolute("pin", wheel, m.ground), step(0, 0, 1, 2), level="velocity", start=0.3)
    m.translation("push", m.translational("rail", slide, m.ground), 0.5, level="acceleration", start=0.2, rate=-0.1)
    m.units = units
    text = write_deck(m)
    assert "INTEGRAL" not in text
    assert ", VELOCITY" in text
    assert ", ACCELERATION" in text
    deck = parse_deck(text.replace("\nEND", "\nREQUEST/99,F2=AZ(1,2)\nEND"))
    result = run_deck(deck, end=1.0 / units.time, steps=4)
    t = result.t * units.time
    spin = result.segments[0].solution.orientation("wheel")
    np.testing.assert_allclose(np.arctan2(spin[:, 1, 0], spin[:, 0, 0]), 0.3 + 2 * (t**3 - t**4 / 2), atol=1e-8)
    place = result.segments[0].solution.com_position("slide")[:, 2]
    np.testing.assert_allclose(place, 0.2 - 0.1 * t + 0.25 * t**2, atol=1e-8)
    again = write_deck(deck.to_mechanism())
    assert "INTEGRAL" not in again
    assert again.count("ICDISP") == 2
    m.general_constraint("odd", "DX(x) - INTEGRAL(TIME, 0, 1)")
    with pytest.raises(ModelError, match="ADAMS has no function INTEGRAL"):
        write_deck(m)


def test_initial_conditions_of_joints_are_in_the_mechanism():
    text = PENDULUM.replace("REVOLUTE", "REVOLUTE, IC = 0.5, 2")
    assert text != PENDULUM
    deck = parse_deck(text)
    one = run_deck(deck, end=1.0, steps=10)
    two = run_deck(parse_deck(write_deck(deck.to_mechanism())), end=1.0, steps=10)
    np.testing.assert_allclose(two.part(2)[:, :3], one.part(2)[:, :3], atol=1e-9)


def test_gear_contact_becomes_impact_expressions():
    """The deck's gear rig follows the contact kernel: same mesh force while no corner is in contact."""
    from gearmbs.gears import ContactLaw, FlankFriction, GearPair

    pair = GearPair.paper(contact=ContactLaw.impact(depth="0.1 mm"), friction=FlankFriction.none(), backlash="0.1 mm")
    place = pair.placement(0.0)
    m = Mechanism("gears")
    joints = []
    for k, (origin, axes, wheel) in enumerate(
        ((place.origin_1, place.axes_1, pair.driver), (place.origin_2, place.axes_2, pair.driven)), 1
    ):
        body = m.body(f"wheel {k}", wheel.mass, wheel.inertia, position=origin, orientation=axes)
        joints.append(m.revolute(f"axle {k}", body, m.ground, at=origin, axis=(0, 0, 1)))
    m.rotation("drive", joints[0], ramp(20.0, 0.02))
    m.torque("load", m.bodies["wheel 2"], step(0.0, 0.0, 0.01, 100.0))
    m.gear_contact("mesh", m.bodies["wheel 1"], m.bodies["wheel 2"], pair)
    text = write_deck(m)
    assert "IMPACT(" in text
    options = {"rate": 2000, "tol": 1e-8, "corrector": "modified"}
    native = m.simulate(0.04, **options)
    deck = parse_deck(text).to_mechanism()
    written = deck.simulate(0.04, **options)
    assert native.success
    assert written.success, written.message
    late = native.t > 0.03
    for axis in (0, 1):
        a, b = native.load("mesh")[0][late, axis], written.load("mesh")[0][late, axis]
        assert np.mean(b) == pytest.approx(np.mean(a), rel=0.01)
    # the driven wheel lags by the same loaded transmission error, within the corners' share
    lag = native.angular_velocity("wheel 2")[late, 2] - written.angular_velocity("wheel 2")[late, 2]
    assert np.abs(lag).mean() < 0.05 * 20.0
    # F_n = T/r_b: mean of the force along the line of action
    alpha = pair.working_pressure_angle
    force = written.load("mesh")[0][late]
    normal = -(force[:, 0] * np.sin(alpha) + force[:, 1] * np.cos(alpha))
    assert abs(np.mean(normal)) == pytest.approx(100.0 / pair.driven.base_radius, rel=0.05)


def test_what_cannot_be_written_is_named():
    from gearmbs.gears import ContactLaw, GearPair

    def rig(pair):
        m = Mechanism("gears")
        place = pair.placement(0.0)
        a = m.body("a", 1, (1, 1, 1), position=place.origin_1, orientation=place.axes_1)
        b = m.body("b", 1, (1, 1, 1), position=place.origin_2, orientation=place.axes_2)
        m.gear_contact("mesh", a, b, pair)
        return m

    with pytest.raises(ModelError, match="tilted axes"):
        write_deck(rig(GearPair.paper(misalignment="1 deg", backlash="0.5 mm")))
    with pytest.raises(ModelError, match="no form in ADAMS"):
        write_deck(rig(GearPair.paper(contact=ContactLaw.hunt_crossley())))
    with pytest.raises(ModelError, match=says("stiffness", "along the path")):
        write_deck(rig(GearPair.paper().with_potential_energy_stiffness()))
    # a linear law is IMPACT with the exponent 1
    assert ", 1.0, 0.0, 0.0001" in write_deck(rig(GearPair.paper(contact=ContactLaw.linear(stiffness="1e8 N/m"))))
    m = Mechanism("odd units")
    m.body("a", 1, (1, 1, 1))
    m.units = Units(length=0.123)
    with pytest.raises(ModelError, match="unit of length"):
        write_deck(m)


def test_long_arguments_are_broken_after_operators():
    text = "FUNCTION = " + " + ".join(f"STEP(TIME, {k}, 0, {k + 1}, 1)" for k in range(12))
    lines = wrapped(text)
    assert len(lines) > 3
    assert all(len(line) <= 80 for line in lines)
    numbers = wrapped("IP = " + ", ".join(["0.123456789012345678"] * 6))
    assert len(numbers) == 2
    assert not numbers[0].endswith(",")


@pytest.mark.slow
def test_files_of_a_run_can_be_read_back(tmp_path):
    result = run_deck(parse_deck(PENDULUM), end=1.0, steps=10, out=tmp_path / "out")
    times, requests = read_requests((tmp_path / "out.req").read_text())
    np.testing.assert_allclose(times, result.t, atol=1e-12)
    np.testing.assert_allclose(requests[3], result.request(3)[:, [1, 2, 3, 5, 6, 7]], rtol=1e-5, atol=1e-9)
    with pytest.raises(ValueError, match=says("request file", "cut off")):
        read_requests((tmp_path / "out.req").read_text()[:900])

    root = ET.parse(tmp_path / "out.res").getroot()
    tag = {"x": NAMESPACE}
    ids = [int(c.attrib["id"]) for c in root.iterfind(".//x:Component", tag)]
    assert ids == list(range(1, len(ids) + 1))
    steps = root.findall(".//x:Step", tag)
    assert len(steps) == 11
    table = np.array([np.array((s.text or "").split(), dtype=float) for s in steps])
    assert table.shape == (11, len(ids))
    np.testing.assert_allclose(table[:, 0], result.t, rtol=1e-15)
    entities = {e.attrib["name"]: e for e in root.iterfind(".//x:Entity", tag)}
    first = int(entities["pin"][0].attrib["id"])
    np.testing.assert_allclose(table[:, first - 1 : first + 2], result.request(5)[:, 1:4], atol=1e-12)
    assert entities["PART_2_XFORM"].attrib["objectId"] == "2"

    message = (tmp_path / "out.msg").read_text()
    assert "The model has 1 degrees of freedom." in message
    assert "Performing Dynamic Simulation using Wstiff SI2 Integrator" in message

    import xarray as xr

    with xr.open_dataset(tmp_path / "out.nc", engine="h5netcdf") as data:
        np.testing.assert_allclose(data["request_1"].values, result.request(1))
        assert data["time"].attrs["units"] == "sec"
