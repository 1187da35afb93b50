"""Couplings with an angle or an offset between their shafts, against closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gearmbs as gm
from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    FlexibleCoupling,
    GearMesh,
    IdealBearing,
    PlanetaryStage,
    RigidCoupling,
    Shaft,
    SpeedDrive,
    TorqueLoad,
    UniversalJoint,
    Wheel,
)
from gearmbs.drivetrain.couplings.even_twist import EvenTwist
from gearmbs.gears import GearSpec, planetary
from gearmbs.mechanism import Mechanism
from gearmbs.studies import train_campbell
from tests.drivetrain.support import differences, evaluate, frame
from tests.says import says

SPEED = 40.0


def line(*couplings, shafts=("one", "two"), bearings=None, torque=5.0, **changes):
    """Shafts end to end, those with bearings on ideal ones; the first is driven, the last braked."""
    held = shafts if bearings is None else bearings
    train = Drivetrain(
        "line",
        shafts=[Shaft(name=name, length="300 mm", diameter="20 mm") for name in shafts],
        couplings=couplings,
        bearings=[IdealBearing(name=f"at {name}", shaft=name) for name in held],
        drives=[SpeedDrive(name="motor", shaft=shafts[0], speed=SPEED)],
        loads=[TorqueLoad(name="brake", shaft=shafts[-1], torque=torque)],
        running=True,
        **{"run_up": 0.01, **changes},
    )
    return train


def speeds(train, turns=2.0):
    """Return times, and the angle and the speed of each shaft about its own axis over some turns of the first."""
    solution = train.build().simulate(2.0 * np.pi * turns / SPEED, rate=4000, tol=1e-9)
    found = {}
    for name, seat in train.layout.seats.items():
        about = seat.axes.T @ solution.orientation(name)
        angle = np.unwrap(np.arctan2(about[:, 1, 0], about[:, 0, 0]))
        found[name] = angle, solution.angular_velocity(name) @ seat.axes[:, 2]
    return solution, found


@pytest.mark.parametrize(("angle", "direction", "phase"), [(30.0, 0.0, 0.0), (12.0, 70.0, 25.0), (5.0, -40.0, 90.0)])
def test_a_universal_joint_turns_as_cardan_says(angle, direction, phase):
    """tan p = tan q cos beta, with both angles from the plane of the axes; the mean speeds are one."""
    joint = UniversalJoint(
        name="j", first="one", second="two", angle=f"{angle} deg", direction=f"{direction} deg", phase=f"{phase} deg"
    )
    train = line(joint)
    _, found = speeds(train)
    beta, off = np.deg2rad(angle), np.deg2rad(phase - direction)
    p = found["one"][0] + off
    # the classical form, its angles counted from a quarter of a turn further
    tangent = np.tan(found["two"][0] + off - 0.5 * np.pi) - np.tan(p - 0.5 * np.pi) * np.cos(beta)
    size = 1.0 + np.tan(p - 0.5 * np.pi) ** 2
    np.testing.assert_allclose(tangent / size, 0.0, atol=1e-7)
    exact = SPEED * np.cos(beta) / (1.0 - np.sin(beta) ** 2 * np.cos(p) ** 2)
    np.testing.assert_allclose(found["two"][1], exact, rtol=1e-6)
    # from cos beta to 1 / cos beta, at twice the speed of the shaft
    lines = np.abs(np.fft.rfft(found["two"][1][:-1] / SPEED)) / (found["two"][1].size - 1)
    assert int(np.argmax(lines[1:])) + 1 == 4
    assert train.speeds["two"] == train.speeds["one"]
    row = train.kinematics.lines.set_index("of").loc["j"]
    assert (row["name"], row.frequency) == ("2x", pytest.approx(2.0 * SPEED / (2.0 * np.pi)))


def test_a_universal_joint_bends_its_shafts():
    """The moment on the second shaft is T tan beta |sin p| across its axis, as the cross passes none about its arms."""
    beta = np.deg2rad(20.0)
    train = line(UniversalJoint(name="j", first="one", second="two", angle="20 deg"), torque=30.0)
    # so slow that nothing is accelerated by much
    train = train.changed("motor", speed=0.5)
    solution = train.build().simulate(2.0 * np.pi / 0.5, rate=50, tol=1e-8)
    axes = train.layout.seats["two"].axes
    _, moment = solution.reaction("at two")
    late = solution.t > 0.05
    across = np.linalg.norm((moment @ axes)[late, :2], axis=1)
    p = 0.5 * solution.t[late]
    # normal to both arms: across the first fork, at right angles to the second
    fork = np.stack([np.cos(p), np.sin(p), 0.0 * p], axis=1)
    arm = np.cross(axes[:, 2], fork)
    normal = np.cross(fork, arm)
    on_two = normal / (normal @ axes[:, 2])[:, None]
    expected = 30.0 * np.linalg.norm(on_two - np.outer(np.ones(p.size), axes[:, 2]), axis=1)
    assert expected.max() == pytest.approx(30.0 * np.tan(beta), rel=1e-3)
    np.testing.assert_allclose(across, expected, atol=2e-2)


def test_two_joints_at_equal_angles_pass_the_rotation_evenly():
    """With both forks of the shaft between in one plane; a quarter of a turn off they add up."""

    def last(phase):
        joints = [
            UniversalJoint(name="a", first="one", second="mid", angle="20 deg"),
            UniversalJoint(name="b", first="mid", second="two", angle="20 deg", direction="180 deg", phase=phase),
        ]
        train = line(*joints, shafts=("one", "mid", "two"), bearings=("one", "two"))
        assert np.allclose(train.layout.seats["two"].axes, np.eye(3), atol=1e-12)
        return speeds(train, 1.0)[1]

    even = last("90 deg")
    np.testing.assert_allclose(even["two"][1], SPEED, rtol=1e-7)
    assert np.ptp(even["mid"][1]) / SPEED == pytest.approx(
        1.0 / np.cos(np.deg2rad(20)) - np.cos(np.deg2rad(20)), rel=1e-3
    )
    uneven = last("0 deg")["two"][1]
    assert uneven.max() / SPEED == pytest.approx(1.0 / np.cos(np.deg2rad(20)) ** 2, rel=1e-3)


def test_the_second_shaft_may_stand_as_it_is_told():
    joint = UniversalJoint(name="j", first="one", second="two", angle="25 deg", direction="30 deg")
    train = line(joint).changed("two", angle="50 deg")
    _, found = speeds(train, 1.0)
    gone = found["two"][0] - found["two"][0][0]
    free, same = speeds(line(joint), 1.0)
    np.testing.assert_allclose(gone, same["two"][0] - same["two"][0][0], atol=1e-7)
    assert free.t.size == gone.size


def flexible(**fields):
    given = {"stiffness": "2e4 N m/rad", "damping_time": "0.1 ms", **fields}
    return FlexibleCoupling(name="c", first="one", second="two", **given)


def test_what_a_flexible_coupling_exerts_stands_in_space():
    """Forces of stiffness times offset and moments of stiffness times angle; the rotation is passed evenly."""
    offset, angle, direction = 0.4e-3, np.deg2rad(0.8), np.deg2rad(35.0)
    coupling = flexible(radial="2e6 N/m", angular="900 N m/rad", offset=offset, angle=angle, direction=direction,
                        damping_time=0.0)  # fmt: skip
    train = line(coupling, torque=0.0)
    solution, found = speeds(train, 1.0)
    towards = np.array([np.cos(direction), np.sin(direction), 0.0])
    force, _ = solution.load("c seat")
    np.testing.assert_allclose(force, np.tile(-2e6 * offset * towards, (solution.t.size, 1)), atol=1e-4)
    _, moment = solution.load("c")
    # a moment that turns the second axis back
    turned = np.cross([0.0, 0.0, 1.0], towards)
    np.testing.assert_allclose(moment, np.outer(np.ones(solution.t.size), -900.0 * np.sin(angle) * turned), atol=1e-3)
    # an uneven one would have beta^2 / 2 of the speed twice a turn
    assert np.ptp(found["two"][1]) / SPEED < 1e-3 * 0.5 * angle**2


def test_tilts_cost_what_the_coupling_damps_them():
    """A tilt turns against the coupling: the drive works c_t w^2 beta^2 for it, and without a load nothing else."""
    angle, time = np.deg2rad(1.0), 1e-4
    train = line(flexible(angular="900 N m/rad", angle=angle, damping_time=time), torque=0.0)
    solution, _ = speeds(train, 0.5)
    lost = solution.diagnostics("c")["damping_power"]
    np.testing.assert_allclose(lost, time * 900.0 * (2.0 * SPEED * np.sin(0.5 * angle)) ** 2, rtol=1e-4)
    # the second shaft is on its way to a steady twist at first
    torque = solution.reaction("motor")[1][5:, 2]
    np.testing.assert_allclose(torque * SPEED, lost[5:], rtol=1e-3)


def test_the_twist_of_a_coupling_has_exact_derivatives():
    m = Mechanism("two")
    a, b = m.body("a", 1.0, (1, 1, 1)), m.body("b", 1.0, (1, 1, 1))
    element = EvenTwist("x", a.marker(), b.marker(), (3e3, 4.0, 700.0, 2.0))
    base = Rotation.from_rotvec((0.3, -0.4, 0.2)).as_matrix()
    tilted = base @ Rotation.from_rotvec((0.2, -0.1, 0.0)).as_matrix() @ Rotation.from_rotvec((0, 0, 0.3)).as_matrix()
    frames = np.array([
        frame((0, 0, 0), tilted, (0, 0, 0), (2.0, -1.0, 23.0)), frame((0, 0, 0), base, (0, 0, 0), (0.5, 0.4, 20.0))
    ])  # fmt: skip
    _, _, exact, told = evaluate(element, frames)
    rough = differences(element, frames, (), ())
    np.testing.assert_allclose(exact, rough, atol=2e-7 * np.abs(rough).max())
    assert told[2] == pytest.approx(0.3, abs=0.02)


def test_an_even_twist_is_none_of_tilts():
    """Tilted by any rotation about an axis across, nothing is twisted: the angle about the other's z would be."""
    m = Mechanism("two")
    a, b = m.body("a", 1.0, (1, 1, 1)), m.body("b", 1.0, (1, 1, 1))
    element = EvenTwist("x", a.marker(), b.marker(), (3e3, 0.0, 0.0, 0.0))
    still = (0.0, 0.0, 0.0)
    tilted = Rotation.from_rotvec((0.15, 0.2, 0.0)).as_matrix()
    told = evaluate(element, np.array([frame(still, tilted, still, still), frame(still, np.eye(3), still, still)]))[3]
    assert told[2] == pytest.approx(0.0, abs=1e-15)
    assert abs(np.arctan2(tilted[1, 0], tilted[0, 0])) > 0.01


def test_a_pair_behind_a_joint_is_placed_along_its_axis():
    joint = UniversalJoint(name="j", first="one", second="two", angle="15 deg", direction="90 deg")
    plain = line(joint, torque=0.0)
    train = Drivetrain(
        "behind",
        shafts=[*plain.shafts, Shaft(name="out", length="300 mm")],
        wheels=[
            Wheel(name="pinion", shaft="two", gear=GearSpec(20, "3 mm", bore_radius="10 mm")),
            Wheel(name="gear", shaft="out", gear=GearSpec(40, "3 mm", bore_radius="15 mm")),
        ],
        meshes=[GearMesh(name="mesh", driver="pinion", driven="gear", settings={"backlash": "0.1 mm"})],
        couplings=plain.couplings,
        bearings=[*plain.bearings, IdealBearing(name="at out", shaft="out")],
        drives=plain.drives,
        loads=[TorqueLoad(name="load", shaft="out", torque=20.0)],
        running=True,
    )
    axes = train.layout.seats["out"].axes
    np.testing.assert_allclose(axes[:, 2], [0.0, np.sin(np.deg2rad(15)), np.cos(np.deg2rad(15))], atol=1e-12)
    np.testing.assert_allclose(train.layout.seats["two"].origin, [0.0, 0.0, 0.3], atol=1e-12)
    chain = train.torsional()
    assert chain.names == ("one", "out")


def test_what_leaves_shafts_free_is_refused():
    joints = [UniversalJoint(name=n, first=a, second=b) for n, a, b in (("a", "one", "mid"), ("b", "mid", "two"))]
    three = {"shafts": ("one", "mid", "two"), "bearings": ("one", "two")}
    _ = line(*joints, **three)
    loose = [joints[0], UniversalJoint(name="b", first="mid", second="two", carries="nothing")]
    with pytest.raises(DrivetrainError, match=says("'mid'", "'a'", "tilt")):
        line(*loose, **three)
    with pytest.raises(DrivetrainError, match=says("shaft 'two'", "nothing holds it")):
        line(flexible(), bearings=("one",))
    # an angular, a radial and an axial stiffness hold it in all five ways
    _ = line(flexible(radial=1e6, axial=1e6, angular=1e3), bearings=("one",))
    with pytest.raises(DrivetrainError, match=says("shaft 'two'", "'c'", "tilt")):
        line(flexible(radial=1e6, axial=1e6), bearings=("one",))
    with pytest.raises(DrivetrainError, match=says("'j'", "angle", "1.309 rad")):
        UniversalJoint(name="j", first="one", second="two", angle="75 deg")


def test_places_that_do_not_fit_a_coupling_are_told():
    joint = UniversalJoint(name="j", first="one", second="two", angle="10 deg")
    plain = line(joint)
    with pytest.raises(DrivetrainError, match=says("'j'", "'one'", "'two'", "0 deg", "(0, 0, 300) mm")):
        Drivetrain(
            "apart",
            shafts=[Shaft(name="one", position=(0, 0, 0)), Shaft(name="two", position=(0, 0, 0.5))],
            couplings=[joint], bearings=plain.bearings, drives=plain.drives, loads=plain.loads,
        )  # fmt: skip


def test_places_that_a_coupling_holds_along_the_axis_have_to_meet():
    def apart(coupling):
        plain = line(coupling)
        return Drivetrain(
            "gap",
            shafts=[Shaft(name="one", length=0.3, position=(0, 0, 0)), Shaft(name="two", position=(0, 0, 0.31))],
            couplings=[coupling], bearings=plain.bearings, drives=plain.drives, loads=plain.loads,
        )  # fmt: skip

    for coupling in (
        flexible(axial=1e6),
        RigidCoupling(name="c", first="one", second="two"),
        UniversalJoint(name="c", first="one", second="two", carries="all"),
    ):
        with pytest.raises(DrivetrainError, match=says("'c'", "'one'", "'two'", "10 mm")):
            apart(coupling)
    # what slides along it may be shorter than the gap
    for coupling in (flexible(radial=1e6), UniversalJoint(name="c", first="one", second="two")):
        _ = apart(coupling)


@pytest.mark.parametrize("body", [None, {"radial": 1e9, "tangential": 1e9}])
def test_planets_behind_a_joint_start_at_its_pace(body):
    """The joint turns its second shaft by 1 / cos beta of the mean where p is zero; carrier and planets with it."""
    cosine = np.cos(np.deg2rad(25.0))
    plain = line(UniversalJoint(name="j", first="one", second="two", angle="25 deg"), torque=0.0)
    gears = planetary((24, 30, 84), "1.5 mm", 3, carrier_radius="40.5 mm")
    train = Drivetrain(
        "behind",
        shafts=[*plain.shafts, Shaft(name="out", length="100 mm", diameter="20 mm")],
        couplings=plain.couplings,
        bearings=[*plain.bearings, IdealBearing(name="at out", shaft="out")],
        planetary_stages=[PlanetaryStage(name="set", gears=gears, sun="two", carrier="out", ring="ground",
                                         sun_station="250 mm", carrier_body=body)],
        drives=plain.drives,
        loads=[TorqueLoad(name="load", shaft="out", torque=20.0)],
        running=True,
    )  # fmt: skip
    bodies, axis = train.build().bodies, train.layout.seats["out"].axes[:, 2]
    for name in ("two", "out", "set planet 1", *(["set carrier"] if body else [])):
        mean = {**train.turning, "set carrier": train.speeds["out"]}[name]
        assert bodies[name].angular_velocity @ axis == pytest.approx(mean / cosine, rel=1e-12)
    moved = bodies["set planet 1"].velocity
    assert np.linalg.norm(moved) == pytest.approx(40.5e-3 * train.speeds["out"] / cosine, rel=1e-9)


def test_members_of_a_differential_start_as_willis_says():
    """The sun behind a joint, the ring driven on its own: w_c = (z_s w_s + z_r w_r) / (z_s + z_r)."""
    cosine = np.cos(np.deg2rad(25.0))
    plain = line(UniversalJoint(name="j", first="one", second="two", angle="25 deg"), torque=0.0)
    light = {"length": "100 mm", "diameter": "20 mm"}
    train = Drivetrain(
        "differential",
        shafts=[*plain.shafts, *(Shaft(name=name, **light) for name in ("out", "ring"))],
        couplings=plain.couplings,
        bearings=[*plain.bearings, *(IdealBearing(name=f"at {name}", shaft=name) for name in ("out", "ring"))],
        planetary_stages=[PlanetaryStage(name="set", gears=planetary((24, 30, 84), "1.5 mm", 3), sun="two",
                                         carrier="out", ring="ring", sun_station="250 mm")],
        drives=[*plain.drives, SpeedDrive(name="other", shaft="ring", speed=10.0)],
        loads=[TorqueLoad(name="load", shaft="out", torque=20.0)],
        running=True,
    )  # fmt: skip
    bodies, axis = train.build().bodies, train.layout.seats["out"].axes[:, 2]
    sun, ring = SPEED / cosine, 10.0
    speeds = {"two": sun, "ring": ring, "out": (24 * sun + 84 * ring) / 108}
    for name, expected in speeds.items():
        assert bodies[name].angular_velocity @ axis == pytest.approx(expected, rel=1e-9)


def test_shafts_in_line_excite_once_and_behind_a_joint_twice_a_turn():
    soft = {"stiffness": "2e3 N m/rad", "first": "one"}
    plain = line(FlexibleCoupling(name="c", second="two", **soft))
    assert train_campbell(plain, ["0 rpm", "9000 rpm"], maximum=5e3)["order_name"].values.tolist() == ["1 x one"]
    three = line(
        FlexibleCoupling(name="c", second="mid", **soft),
        UniversalJoint(name="j", first="mid", second="two", angle="10 deg"),
        shafts=("one", "mid", "two"),
    )
    diagram = train_campbell(three, ["0 rpm", "9000 rpm"], maximum=5e3)
    assert diagram["order_name"].values.tolist() == ["1 x one", "2 x two"]
    assert diagram["order"].values.tolist() == [1.0, 2.0]


FILE = """
[shafts]
one = { length = "300 mm" }
two = { length = "300 mm" }
three = { length = "300 mm" }
[couplings.j]
kind = "universal"
first = "one"
second = "two"
angle = "8 deg"
direction = "45 deg"
phase = "10 deg"
[couplings.c]
kind = "flexible"
first = "two"
second = "three"
stiffness = "2e4 N m/rad"
radial = "1e6 N/m"
angular = "500 N m/rad"
offset = "0.2 mm"
angle = "0.3 deg"
damping_time = "10 us"
[bearings]
a = { shaft = "one" }
b = { shaft = "two" }
c2 = { shaft = "three" }
[drives.motor]
shaft = "one"
speed = "600 rpm"
[loads.brake]
shaft = "three"
torque = "10 N m"
"""


def test_a_file_says_the_same(tmp_path):
    (tmp_path / "line.toml").write_text(FILE)
    train = Drivetrain.from_file(tmp_path / "line.toml")
    joint, coupling = train.couplings
    assert joint == UniversalJoint(
        name="j", first="one", second="two", angle="8 deg", direction="45 deg", phase="10 deg"
    )
    assert coupling.offset == pytest.approx(2e-4)
    gm.save(train, tmp_path / "again.toml")
    again = Drivetrain.from_file(tmp_path / "again.toml")
    assert again.couplings == train.couplings
    for name, seat in train.layout.seats.items():
        np.testing.assert_allclose(again.layout.seats[name].axes, seat.axes, atol=1e-15)
