"""Cases whose wheels are helical or internal, and whose shafts bend or stand in rolling bearings."""

import math

import numpy as np
import pytest

from gearmbs.gears import GearPair, GearSpec
from gearmbs.signals.analysis.bands import harmonic_amplitudes
from gearmbs.studies import (
    Case,
    CaseError,
    case_mechanism,
    case_train,
    gear_rig,
    load_case,
    run_case,
    run_train,
    steady,
)
from gearmbs.studies.case.texts import write_case
from gearmbs.studies.case.train import mechanism_of_parts
from tests.says import says

BRIEF = {"speed": "1500 rpm", "torque": "80 N m", "run_up": 0.02, "settling": 0.02, "duration": 0.02}
HELICAL = {"teeth": (21, 52), "module": "3 mm", "helix_angle": "15 deg"}
RING = {"teeth": (21, 70), "module": "3 mm", "internal": True}


def test_parts_are_those_of_the_rig():
    case = Case(fault={"misalignment": "1 deg", "teeth": "broken tooth"}, operation=BRIEF)
    rig, made = case_mechanism(case), mechanism_of_parts(case, {}, None)
    for name, body in rig.bodies.items():
        other = made.bodies[name]
        middles = [b.position + b.orientation @ b.com for b in (body, other)]
        np.testing.assert_allclose(*middles, atol=1e-15)
        np.testing.assert_allclose(body.orientation, other.orientation, atol=1e-15)
        np.testing.assert_allclose(np.ravel(body.inertia), np.ravel(other.inertia), rtol=1e-12)
        assert math.isclose(body.mass, other.mass, rel_tol=1e-12)
    assert made.elements["mesh"].pair == case.pair()
    # the same unknowns, whose rounding differs: steps of a run part by what its tolerance allows
    one, two = (run_case(case, mechanism=m, variables=["normal_force"]).normal_force.mean() for m in (rig, made))
    assert math.isclose(one, two, rel_tol=1e-4)


@pytest.mark.parametrize("gears", [HELICAL, RING, {**RING, "helix_angle": "10 deg", "hand": "left"}], ids=str)
def test_other_wheels_carry_the_torque_on_their_drive_flanks(gears):
    case = Case(gears=gears, operation=BRIEF, friction={"enabled": False})
    record = run_case(case, variables=["normal_force", "pairs_back", "transmission_error", "force_2", "acceleration"])
    driven = case.gears.wheels[1]
    expected = 80.0 / (driven.base_radius * math.cos(driven.base_helix_angle))
    assert math.isclose(record.normal_force.mean(), expected, rel_tol=0.01)
    assert record.pairs_back.max() == 0
    # the driven wheel is behind
    assert record.transmission_error.mean() > 0.0
    # along the line of action the shaft holds what the teeth press
    along = record.acceleration.sel(component="line_of_action").mean() * driven.mass
    assert math.isclose(along, -expected * math.cos(driven.base_helix_angle), rel_tol=0.02)


def test_a_torque_on_the_ring_of_a_rig_resists():
    pair = GearPair(GearSpec(21, "3 mm"), GearSpec.ring(70, "3 mm"), backlash="0.1 mm", torque=80.0)
    rig = gear_rig(pair, speed="1500 rpm", run_up=0.02)
    assert rig.elements["load"].function(1.0) == -80.0
    contact = rig.simulate(0.04, rate=2000).contact("mesh")
    assert contact["pairs_drive"][-10:].min() > 0.0
    assert contact["pairs_back"].max() == 0.0


def test_what_is_said_of_shafts():
    seated = {"modes": 2, "bearings": ["6206", "6208"], "bearing_distance": "160 mm"}
    made = case_mechanism(Case(shafts=seated), each={"bearing 2 b": {"cage_slip": 0.01}})
    assert [made.elements[f"bearing {k} {e}"].bearing.designation for k in (1, 2) for e in "ab"] == [
        "6206", "6206", "6208", "6208"
    ]  # fmt: skip
    places = [made.elements[f"bearing 1 {end}"].i.global_position()[2] for end in "ab"]
    np.testing.assert_allclose(places, [-0.08, 0.08], atol=1e-12)
    assert made.joints["seat 1"].kind == "fixed"
    joints = case_mechanism(Case(shafts={"modes": 1})).joints
    assert [joints[f"bearing 1 {end}"].kind for end in "ab"] == ["spherical", "inline"]


@pytest.mark.parametrize(
    ("shafts", "said"),
    [
        ({"bearings": "62x6"}, ("62x6", "bearing 1 a")),
        ({"bearings": ["6206"]}, ("shafts.bearings", "6206", "driven")),
        ({"bearings": "NU206"}, ("NU206", "along its axis")),
        ({"modes": 0}, ("shafts.modes", "0", "all")),
        ({"bearing_distance": "100 mm"}, ("shafts.bearing_distance", "100", "modes")),
        ({"modes": 3, "bearing_distance": "300 mm"}, ("shafts.bearing_distance", "300", "200")),
    ],
    ids=str,
)
def test_shafts_that_cannot_be(shafts, said):
    with pytest.raises(CaseError, match=says(*said)):
        Case(shafts=shafts)


def test_what_such_a_case_cannot():
    case = Case(shafts={"modes": 2})
    with pytest.raises(CaseError, match=says("steady", "case_train")):
        steady(case)
    with pytest.raises(CaseError, match=says("6206", "shafts", "bearings")):
        case_mechanism(case, "6206")
    with pytest.raises(CaseError, match=says("cage_slip", "shafts.bearings")):
        case_mechanism(case, cage_slip=0.01)
    with pytest.raises(CaseError, match=says("bearing 1 c", "bearing 1 a")):
        case_mechanism(case.changed(shafts={"bearings": "6206"}), each={"bearing 1 c": {}})
    with pytest.raises(CaseError, match=says("operation.torque", "run_case")):
        case_train(case.changed(operation={"torque": [["0 s", "50 N m"], ["1 s", "80 N m"]]}))


def test_a_file_of_such_a_case(tmp_path):
    case = Case(name="small", gears=HELICAL | {"hand": "left"}, shafts={"modes": "all", "bearings": "6206"})
    again = load_case(write_case(case, tmp_path / "small.toml"))
    assert again == case
    assert [wheel.hand for wheel in again.gears.wheels] == ["left", "right"]


@pytest.mark.slow
@pytest.mark.parametrize("shafts", [{"bearings": "6206"}, {"modes": 4, "bearings": "6206"}, {"modes": 4}], ids=str)
def test_its_record_is_that_of_the_drivetrain(shafts):
    from gearmbs.drivetrain import RunSettings

    span = {"run_up": 0.05, "settling": 0.3, "duration": 0.3}
    case = Case(shafts=shafts, operation={"speed": "1000 rpm", "torque": "100 N m", **span}, solver={"tolerance": 1e-7})
    record = run_case(case)
    train = run_train(case_train(case), RunSettings(settling=0.3, duration=0.3, tolerance=1e-7)).sel(mesh="mesh")

    def levels(force, rate):
        return np.abs(harmonic_amplitudes(force.values[:, None], rate, case.mesh_frequency, np.arange(1, 4)))[:, 0]

    found = levels(record.normal_force, case.output_rate)
    expected = levels(train.normal_force, float(train.attrs["run_rate"]))
    # the wheel is a part of the shaft there, whose modes are damped, and a body beside it here
    np.testing.assert_allclose(found, expected, atol=0.01 * expected.max())
    assert math.isclose(record.transmission_error.mean(), train.transmission_error.mean(), rel_tol=1e-4)
    # Newton's second law for the driven wheel over the record: forces of teeth and shaft are in balance on average
    held = np.linalg.norm(record.force_2.mean("time"))
    assert math.isclose(held, np.linalg.norm(record.force_1.mean("time")), rel_tol=1e-3)


@pytest.mark.slow
def test_twice_the_shapes_change_nothing():
    run = {"speed": "1000 rpm", "torque": "100 N m", "settling": 0.2, "duration": 0.1}
    few, many = (
        run_case(Case(shafts={"modes": n, "bearings": "6206"}, operation=run))["gmf_rms"]
        .sel(component="line_of_action", way="orders")
        .values
        for n in (4, 8)
    )
    np.testing.assert_allclose(few, many, atol=0.01 * many.max())
