"""Placement, senses, flanks and torques of drivetrains, and what is refused."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from gearmbs.drivetrain import (
    ClearanceBearing,
    ControlledDrive,
    CurveMotor,
    Drag,
    Drivetrain,
    DrivetrainError,
    ElasticBearing,
    ElasticClutch,
    ElementBearing,
    GearMesh,
    Housing,
    HousingMode,
    IdealBearing,
    InductionMotor,
    Mount,
    Shaft,
    SpeedDrive,
    TorqueDrive,
    TorqueLoad,
    TorsionalShaft,
    Wheel,
)
from gearmbs.gears import GearSpec, Material
from gearmbs.kernels.jit import Kernel
from gearmbs.mechanism import linear_modes, static_equilibrium
from tests.drivetrain.support import chain_frequencies, evaluate, frame, rotation, stage
from tests.says import says

QUIET = {"backlash": "0.1 mm", "contact": {"kind": "linear", "stiffness": 376.6e6}, "friction": False}
NAMES = ("motor", "one", "two", "three", "four", "pump")


def wheel(name, shaft, teeth=29, module=95e-3 / 31, **others):
    where = {key: others.pop(key) for key in ("station", "angle") if key in others}
    return Wheel(name=name, shaft=shaft, gear=GearSpec(teeth, module, name=name, **others), **where)


def bench(inertias=(0.03, *(9.6156e-4,) * 4, 0.004), ratio=29, springs=(3000.0, 2e4, 2e4)):
    """Motor, clutch, two pairs, shafts between them, pump: six inertias that only turn."""
    wheels = []
    for k, teeth in enumerate((29, ratio, 29, ratio), 1):
        plain = GearSpec(teeth, 95e-3 / 31)
        # short teeth: one pair carries at almost all angles
        material = Material(2.07e11, 0.29, 7850.0 * inertias[k] / plain.inertia[2])
        wheels.append(wheel(f"z{k}", NAMES[k], teeth, material=material, addendum=0.65 * 95e-3 / 31))
    light = {"density": 1e-3, "length": 0.2}
    return Drivetrain(
        "bench",
        shafts=[
            Shaft(name="motor", inertia=inertias[0]),
            *(Shaft(name=n, **light) for n in NAMES[1:5]),
            Shaft(name="pump", inertia=inertias[5]),
        ],
        wheels=wheels,
        meshes=[
            GearMesh(
                name=f"stage {k}",
                driver=f"z{2 * k - 1}",
                driven=f"z{2 * k}",
                phase=0.0,
                direction="180 deg" if k == 2 else 0.0,
                settings=QUIET,
            )
            for k in (1, 2)
        ],
        couplings=[
            ElasticClutch(name="clutch", first="motor", second="one", stiffness=springs[0]),
            TorsionalShaft(name="middle", first="two", second="three", stiffness=springs[1]),
            TorsionalShaft(name="end", first="four", second="pump", stiffness=springs[2]),
        ],
        bearings=[IdealBearing(name=f"b {n}", shaft=n) for n in NAMES],
        drives=[TorqueDrive(name="drive", shaft="motor", speed="1000 rpm", torque=100.0 * (29 / ratio) ** 2)],
        loads=[TorqueLoad(name="load", shaft="pump", torque=100.0)],
    )


@pytest.mark.parametrize(
    ("ratio", "inertias"),
    [
        (29, (0.03, *(9.6156e-4,) * 4, 0.004)),
        (41, (0.05, 1.1e-3, 4e-3, 0.9e-3, 5e-3, 0.01)),
    ],
)
def test_torsional_modes_of_the_bench(ratio, inertias):
    """The linearised multibody model with one tooth pair in contact, against a matrix of six inertias."""
    train = bench(inertias, ratio)
    m = train.build()
    static_equilibrium(m, t=1.0, move=True)
    pairs = [m.elements[name].pair.geometry for name in ("stage 1", "stage 2")]
    r1, r2 = pairs[0].driver.base_radius, pairs[0].driven.base_radius
    exact = chain_frequencies(
        inertias,
        [
            (0, 1, 1, -1, 3000.0),
            (1, 2, r1, r2, 376.6e6),
            (2, 3, 1, -1, 2e4),
            (3, 4, r1, r2, 376.6e6),
            (4, 5, 1, -1, 2e4),
        ],
    )
    found = linear_modes(m, t=1.0)
    assert found.kinds[0] == "rigid"
    np.testing.assert_allclose(found.frequencies[1:], exact[1:], rtol=1e-6)
    if ratio == 29:
        np.testing.assert_allclose(exact[1:], (103.65, 452.95, 858.29, 5892.77, 5941.39), rtol=5e-5)
    # the package's own chain, with the mesh's stiffness over the cycle
    share = pairs[0].contact_ratio
    model = chain_frequencies(
        inertias,
        [
            (0, 1, 1, -1, 3000.0),
            (1, 2, r1, r2, share * 376.6e6),
            (2, 3, 1, -1, 2e4),
            (3, 4, r1, r2, share * 376.6e6),
            (4, 5, 1, -1, 2e4),
        ],
    )
    # the shafts weigh next to nothing, but not nothing
    np.testing.assert_allclose(train.torsional().frequencies()[1:], model[1:], rtol=1e-6)


def test_forced_response_of_the_chain():
    """At its natural frequency an undamped free mode is excited in its shape."""
    model = bench().torsional()
    frequencies, shapes = model.modes()
    near = model.response(np.array([frequencies[1] * (1 + 1e-7)]), {"pump": 1.0})[0].real
    top = np.argmax(np.abs(near))
    np.testing.assert_allclose(near / near[top], shapes[:, 1] / shapes[top, 1], atol=1e-4)
    with pytest.raises(DrivetrainError, match="no shaft 'moon'"):
        model.response(np.array([1.0]), {"moon": 1.0})


def test_speeds_senses_and_torques():
    train = bench(ratio=41)
    w = 1000 * np.pi / 30
    speeds = (w, w, -w * 29 / 41, -w * 29 / 41, w * (29 / 41) ** 2, w * (29 / 41) ** 2)
    assert list(train.speeds.values()) == pytest.approx(speeds, rel=1e-15)
    assert train.power.torques["stage 2"] == pytest.approx((100.0 * 29 / 41, 100.0))
    assert train.power.drive["drive"] == pytest.approx(100.0 * (29 / 41) ** 2)
    assert [train.pairs[f"stage {k}"].rotation for k in (1, 2)] == [1, -1]
    assert [train.pairs[f"stage {k}"].torque for k in (1, 2)] == pytest.approx((100.0 * 29 / 41, 100.0))


def test_a_train_that_is_driven_from_its_other_end_uses_the_other_flanks():
    """A torque that pushes the load along: the driven wheel pushes."""
    assert stage().pairs["mesh"].rotation == 1
    pushed = stage(loads=[TorqueLoad(name="brake", shaft="out", torque=-300.0)])
    assert pushed.power.pushing["mesh"] == "out"
    assert pushed.pairs["mesh"].rotation == -1
    from_behind = stage(
        drives=[SpeedDrive(name="motor", shaft="out", speed="-500 rpm")],
        loads=[TorqueLoad(name="brake", shaft="in", torque="100 N m")],
    )
    assert from_behind.speeds["in"] == pytest.approx(1500 * np.pi / 30)
    assert from_behind.pairs["mesh"].rotation == -1


@pytest.mark.parametrize("direction", [0.0, "73 deg", "-140 deg"])
def test_wheels_just_touch_at_the_start(direction):
    """At rest no force; a push of a micrometre further makes one, on the drive flank."""
    train = stage().changed("mesh", direction=direction, settings={"friction": False})
    train = train.changed("in", angle=0.3)
    m = train.build()
    pair = train.pairs["mesh"]
    assert m.bodies["out"].position @ m.bodies["out"].position == pytest.approx(pair.geometry.centre_distance**2)
    element = m.elements["mesh"]
    names = [d.name for d in element.diagnostics]
    for off, depth in ((-1e-7, 0.0), (1e-6, 1e-6)):
        turned = (
            element.i.global_orientation() @ rotation((0, 0, off / pair.driver.base_radius)),
            element.j.global_orientation(),
        )
        places = (element.i.global_position(), element.j.global_position())
        frames = [frame(p, a, np.zeros(3), np.zeros(3)) for p, a in zip(places, turned, strict=True)]
        told = dict(zip(names, evaluate(element, frames)[3], strict=True))
        assert told["penetration_drive"] == pytest.approx(depth, abs=1e-12)
        assert told["penetration_back"] == 0.0


def test_phase_of_a_mesh_and_assembly_angles():
    train = bench().changed("stage 2", phase=0.5)
    layout = train.layout
    assert layout.wheels["z1"] == pytest.approx(0.0)
    # tooth 0 from x of the shaft's frame that does not turn
    angle = layout.angles[train.part("z3").shaft] + layout.wheels["z3"] - np.pi
    assert (angle / (2 * np.pi / 29)) % 1.0 == pytest.approx(0.5)
    with pytest.raises(DrivetrainError, match="phase turns wheel 'z3'"):
        _ = train.changed("z3", angle=0.1).layout


def test_closed_chain_of_four_wheels_turns_its_last_wheel():
    """A lay shaft that splits the power: two meshes between the same shafts, the second closes the chain."""
    given = {
        "shafts": [Shaft(name="a"), Shaft(name="b")],
        "bearings": [IdealBearing(name="ba", shaft="a"), IdealBearing(name="bb", shaft="b")],
        "drives": [SpeedDrive(name="d", shaft="a", speed=10.0)],
        "loads": [TorqueLoad(name="l", shaft="b", torque=10.0)],
    }
    wheels = [
        wheel("a1", "a", 20, "3 mm", station=0.05),
        wheel("a2", "a", 20, "3 mm", station=0.15, angle=0.1),
        wheel("b1", "b", 30, "3 mm", station=0.05),
        wheel("b2", "b", 30, "3 mm", station=0.15),
    ]
    meshes = [GearMesh(name=f"m{k}", driver=f"a{k}", driven=f"b{k}", settings=QUIET) for k in (1, 2)]
    train = Drivetrain("twin", wheels=wheels, meshes=meshes, **given)
    assert abs(train.layout.wheels["b2"] - (np.pi - 0.1 * 20 / 30 - np.pi)) % (2 * np.pi / 30) == pytest.approx(
        0.0, abs=2 * np.pi / 30
    )
    found = train.build().simulate(1e-6, rate=2e6).contact("m2")
    assert found["penetration_drive"].max() < 1e-9
    # an angle that makes them overlap is refused where those of all others are given, too
    turned = train.changed("b2", angle=train.layout.wheels["b2"] + 0.05)
    wrong = turned.changed("a1", angle=0.0).changed("b1", angle=0.0)
    with pytest.raises(DrivetrainError, match=says("angle", "wheel 'b2'", "leave out")):
        _ = wrong.layout
    # otherwise another wheel is turned
    assert turned.layout.wheels["b1"] == pytest.approx(0.05, abs=1e-12)
    # other teeth between the same shafts: two speeds, or another centre distance
    with pytest.raises(DrivetrainError, match=says("shaft 'b'")):
        Drivetrain("x", wheels=[*wheels[:3], wheel("b2", "b", 31, "3 mm", station=0.15)], meshes=meshes, **given)
    other = [
        wheels[0],
        wheel("a2", "a", 20, "3.1 mm", station=0.15),
        wheels[2],
        wheel("b2", "b", 30, "3.1 mm", station=0.15),
    ]
    with pytest.raises(DrivetrainError, match=says("'m2'", "2.5 mm", "chain")):
        Drivetrain("x", wheels=other, meshes=meshes, **given)


def test_loose_wheel_on_a_turning_shaft():
    """A loose gear is a shaft of its own, carried by another; its angle and speed follow from its mesh."""
    train = stage(
        shafts=[
            Shaft(name="in", length=0.1),
            Shaft(name="out", length=0.1),
            Shaft(name="loose", length=0.02, radius=0.03),
        ],
        wheels=[
            wheel("p", "in", 20, "3 mm"),
            wheel("g", "out", 60, "3 mm"),
            wheel("q", "in", 30, "3 mm", station=0.08),
            wheel("l", "loose", 50, "3 mm"),
        ],
        meshes=[
            GearMesh(name="mesh", driver="p", driven="g", settings=QUIET),
            GearMesh(name="loose mesh", driver="q", driven="l", settings=QUIET),
        ],
        bearings=[
            IdealBearing(name="a", shaft="in"),
            IdealBearing(name="b", shaft="out"),
            IdealBearing(name="c", shaft="loose", on="out", on_station=0.08),
        ],
    )
    assert train.speeds["loose"] / train.speeds["out"] == pytest.approx(30 / 50 * 3)
    solution = train.build().simulate(0.01, rate=1000, rate_scale=train.rate_scale)
    assert solution.success
    assert solution.constraint_violation.max() < 1e-6


def test_bearings_of_all_kinds_carry_the_load():
    """The same mesh force at the same stations: reactions by the lever rule, whatever kind carries them."""
    force = 300.0 / (0.03 * 3 * np.cos(np.deg2rad(20)))
    found = {}
    for kind in ("ideal", "elastic", "clearance", "element"):
        bearings = [IdealBearing(name="a", shaft="in")]
        for name, station in (("left", 0.02), ("right", 0.08)):
            where = {"name": name, "shaft": "out", "station": station}
            bearings.append(
                {
                    "ideal": lambda w=where: IdealBearing(**w),
                    "elastic": lambda w=where: ElasticBearing(**w, stiffness=(2e8, 2e8, 1e8), damping_time=1e-4),
                    "clearance": lambda w=where: ClearanceBearing(
                        **w, clearance="10 um", stiffness=2e8, damping=2e4, axial=w["name"] == "left"
                    ),
                    "element": lambda w=where: ElementBearing(**w, element=spring),
                }[kind]()
            )
        out = wheel("gear", "out", 60, "3 mm", station=0.035)
        into = wheel("pinion", "in", 20, "3 mm", station=0.035)
        train = (
            stage(bearings=bearings, wheels=[into, out], run_up=0.005)
            .changed("mesh", settings=QUIET)
            .changed("motor", speed="60 rpm")
        )
        solution = train.build().simulate(0.03, rate=20000, tol=1e-7, rate_scale=train.rate_scale)
        assert solution.success, (kind, solution.message)
        loads = []
        for name in ("left", "right"):
            f = solution.reaction(name)[0] if kind == "ideal" else solution.load(name)[0]
            loads.append(np.linalg.norm(f[-200:].mean(axis=0)))
        found[kind] = loads
    exact = (force * 0.045 / 0.06, force * 0.015 / 0.06)
    for kind, loads in found.items():
        # the mean over part of a mesh cycle of a rotating, vibrating train
        assert loads == pytest.approx(exact, rel=0.02), kind


def spring(name, shaft, seat):
    """Return a bearing made elsewhere: any force element between the two markers."""
    from gearmbs.mechanism.forces.springs import Bushing

    k = np.diag([2e8, 2e8, 1e8, 0.0, 0.0, 0.0])
    return Bushing(name, shaft, seat, k, 1e-4 * k, np.zeros(6), np.zeros(6), {})


def test_housing_on_mounts_with_a_mode():
    """Modes of a housing: rigid on its mounts, and its own at the frequency its mass and stiffness say."""
    mode = HousingMode(
        name="panel", mass=5.0, stiffness=5.0 * (2 * np.pi * 700) ** 2, damping_ratio=0.01, shape={"b": (0.0, 0.0, 0.0)}
    )
    mounts = [
        Mount(name=f"mount {k}", at=(x, y, -0.1), stiffness=(1e7, 1e7, 2e7))
        for k, (x, y) in enumerate(((-0.2, -0.1), (0.2, -0.1), (-0.2, 0.1), (0.2, 0.1)))
    ]
    housing = Housing(name="box", mass=40.0, inertia=(0.6, 0.8, 1.0), at=(0.1, 0.0, 0.0), mounts=mounts, modes=[mode])
    train = stage(housings=[housing])
    assert train.carrier(train.part("b")) == "box"
    found = linear_modes(train.build(), t=0.0).frequencies
    assert np.abs(found - 700.0).min() < 0.01
    heavy = housing.mass + sum(b.mass for name, b in train.build().bodies.items() if name != "box")
    vertical = np.sqrt(4 * 2e7 / heavy) / (2 * np.pi)
    assert np.abs(found / vertical - 1).min() < 0.05


REFUSED = {
    "a wheel without a shaft": (lambda: stage(wheels=[wheel("p", "inn", 20)]), "no shaft 'inn'; did you mean 'in'"),
    "a name twice": (lambda: stage(loads=[TorqueLoad(name="motor", shaft="out", torque=1)]), "the name is in use"),
    "another base pitch": (
        lambda: stage(wheels=[wheel("pinion", "in", 20, "3 mm"), wheel("gear", "out", 60, "3.1 mm")]),
        "mesh 'mesh': .*base pitches differ",
    ),
    "two speeds": (
        lambda: stage(
            drives=[SpeedDrive(name="m", shaft="in", speed=10.0), TorqueDrive(name="n", shaft="out", speed=5.0)]
        ),
        "shaft 'out' would have two speeds",
    ),
    "two prescribed speeds": (
        lambda: stage(
            drives=[SpeedDrive(name="m", shaft="in", speed=9.0), SpeedDrive(name="n", shaft="out", speed=-3.0)]
        ),
        "drive 'm' prescribes the speed of shaft 'out' too",
    ),
    "nothing to carry the torque": (
        lambda: stage(meshes=[], shafts=[Shaft(name="in"), Shaft(name="out", position=(0.5, 0, 0))]),
        "load 'brake': nothing carries its torque: shaft 'out' is joined to no drive",
    ),
    "an open chain": (
        lambda: stage(meshes=[], loads=[]),
        "shafts 'in', 'out' are not joined: the chain is open",
    ),
    "no bearing": (lambda: stage(bearings=[IdealBearing(name="a", shaft="in")]), "shaft 'out': nothing holds it"),
    "a bearing that lets it tilt": (
        lambda: stage(bearings=[IdealBearing(name="a", shaft="in"), ElasticBearing(name="b", shaft="out")]),
        "leave it free to tilt",
    ),
    "three ideal bearings": (
        lambda: stage(
            bearings=[
                *(IdealBearing(name=f"a{k}", shaft="in", station=0.02 * k) for k in range(3)),
                IdealBearing(name="b", shaft="out"),
            ]
        ),
        "3 ideal bearings hold it more than once",
    ),
    "a wheel through a shaft": (
        lambda: stage(
            shafts=[Shaft(name="in"), Shaft(name="out"), Shaft(name="lay")],
            wheels=[
                wheel("p", "in", 20, "3 mm"),
                wheel("g", "out", 80, "3 mm"),
                wheel("q", "out", 20, "3 mm", station=0.16),
                wheel("l", "lay", 30, "3 mm", station=0.16),
            ],
            meshes=[GearMesh(name="m", driver="p", driven="g"), GearMesh(name="n", driver="q", driven="l")],
            bearings=[IdealBearing(name=f"b{s}", shaft=s) for s in ("in", "out", "lay")],
        ),
        "wheel 'g': it runs through shaft 'lay'",
    ),
    "a station off the shaft": (
        lambda: stage(wheels=[wheel("pinion", "in", 20, station=0.3), wheel("gear", "out", 60)]),
        "station 300 mm is not on",
    ),
    "centre distances": (
        lambda: stage(shafts=[Shaft(name="in", position=(0, 0, 0)), Shaft(name="out", position=(0.13, 0, 0))]),
        "the chain does not close: the axes are 10 mm away from the centre distance of 120 mm",
    ),
    "no shafts": (lambda: Drivetrain("x"), "there are no shafts"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_is_refused_in_one_line(what, monkeypatch):
    monkeypatch.setattr(Kernel, "ready", lambda self: pytest.fail("compiled something"), raising=False)
    make, words = REFUSED[what]
    with pytest.raises(DrivetrainError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_speeds_in_the_mean_over_a_common_period():
    """Two stages of other teeth: the mean ratio is (z1/z2)(z3/z4)."""
    w = 300 * np.pi / 30
    train = Drivetrain(
        "two stages",
        shafts=[Shaft(name=n, length=0.3) for n in ("in", "lay", "out")],
        wheels=[
            wheel("z1", "in", 12, "4 mm", station=0.05, profile_shift=0.4),
            wheel("z2", "lay", 18, "4 mm", station=0.05),
            wheel("z3", "lay", 16, "4 mm", station=0.25, profile_shift=0.2),
            wheel("z4", "out", 24, "4 mm", station=0.25),
        ],
        meshes=[
            GearMesh(name="m1", driver="z1", driven="z2", settings={"backlash": "0.1 mm"}),
            GearMesh(name="m2", driver="z3", driven="z4", direction="90 deg", settings={"backlash": "0.1 mm"}),
        ],
        bearings=[IdealBearing(name=f"b{n}", shaft=n) for n in ("in", "lay", "out")],
        drives=[SpeedDrive(name="d", shaft="in", speed=w)],
        loads=[TorqueLoad(name="l", shaft="out", torque=50.0)],
        running=True,
        run_up=0.02,
    )
    period = train.kinematics.common_period()
    # 9 turns of the first, 6 of the second, 4 of the third
    assert period == pytest.approx(9 * 2 * np.pi / w)
    start = 0.3
    solution = train.build().simulate(
        start + period,
        t_eval=np.array([0.0, *np.linspace(start, start + period, 4001)]),
        tol=1e-9,
        rate_scale=train.rate_scale,
    )
    turned = solution.joint_angle("bout")
    mean = (turned[-1] - turned[1]) / period
    assert mean / w == pytest.approx((12 / 18) * (16 / 24), rel=1e-8)


@pytest.mark.parametrize(("drive", "running", "words"), [
    (CurveMotor(name="m", shaft="in", speed=150.0, speeds=(0.0, 300.0), torques=(90.0, 60.0)), True,
     "the largest torque is 90 N m, but the loads need 100 N m on shaft 'in' at 1432.4 rpm"),
    (ControlledDrive(name="m", shaft="in", speed=-150.0, proportional=1.0, integral=1.0, largest=98.0), True,
     "the largest torque is 98 N m, but the loads need 100 N m"),
    (InductionMotor(name="m", shaft="in", speed="1450 rpm", power="16 kW"), False,
     "its torque at standstill is 82.051 N m, but the loads need 100 N m on shaft 'in': it will not start"),
    (InductionMotor(name="m", shaft="in", speed="1450 rpm", power="16 kW"), True, None),
    (TorqueDrive(name="m", shaft="in", speed=150.0, torque=100.0), False, None),
    (TorqueDrive(name="m", shaft="in", speed=150.0, torque="STEP(TIME, 0, 0, 1, 50)"), False, None),
])  # fmt: skip
def test_drives_too_weak_for_their_loads_are_warned_of(drive, running, words):
    """300 N m on the wheel are 100 N m on the pinion; what can carry them, or changes over time, is left alone."""
    train = stage(drives=[drive], running=running)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        warnings.filterwarnings("ignore", ".*counted twice")
        train.build()
    found = [str(one.message) for one in said]
    assert len(found) == (words is not None)
    assert words is None or words in found[0]


def test_drives_carry_a_load_together():
    """Two torques at the ends of a train add at the ratio of their shafts."""
    weak = TorqueDrive(name="m", shaft="in", speed="1500 rpm", torque=60.0)

    def both(torque):
        return stage(drives=[weak, TorqueDrive(name="n", shaft="out", speed="-500 rpm", torque=torque)])

    with pytest.warns(UserWarning, match=says("'n'", "torque", "80 N m", "loads", "100 N m")):
        both(60.0).build()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".*counted twice")
        both(120.0).build()
        stage(drives=[weak, SpeedDrive(name="n", shaft="out", speed="-500 rpm")], loads=[]).build()


@pytest.mark.parametrize(("parts", "words"), [
    ([TorqueLoad(name="l", shaft="in", torque=30.0)],
     "load 'l': its torque of 30 N m is on shaft 'in', whose speed drive 'motor' prescribes"),
    ([TorqueDrive(name="t", shaft="in", speed="1500 rpm", torque=30.0)], "drive 't': its torque of 30 N m is on"),
    ([Drag(name="d", shaft="in", torque=1.0), TorqueDrive(name="t", shaft="out", speed="-500 rpm", torque=30.0)], None),
])  # fmt: skip
def test_torques_that_nothing_feels_are_warned_of(parts, words):
    """On the shaft whose speed is prescribed; behind the mesh, and as drag, they are at their place."""
    train = stage().with_parts(*parts)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        warnings.filterwarnings("ignore", ".*counted twice")
        train.build()
    found = [str(one.message) for one in said]
    assert len(found) == (words is not None)
    assert words is None or words in found[0]


def test_a_shaft_through_solid_wheels_is_counted_twice():
    """Two thirds of a wheel's disc are where a thick shaft is: said with masses; a bore, or a thin shaft, is silent."""
    thick, other = Shaft(name="in", length=0.1, diameter="48 mm"), Shaft(name="out", length=0.1)
    words = says("shaft 'in'", "0.2841 kg", "1.864 kg", "15.2", "wheel 'pinion'")
    with pytest.warns(UserWarning, match=words):
        stage(shafts=[thick, other]).build()
    bored = Wheel(name="pinion", shaft="in", gear=GearSpec(20, "3 mm", name="pinion", bore_radius="24 mm"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mass = stage(shafts=[thick, other]).with_parts(bored).build().bodies["in"].mass
        stage(shafts=[Shaft(name="in", length=0.1, diameter="20 mm"), other]).build()
        stage(shafts=[replace(thick, mass="1.2 kg"), other]).build()
    disc = np.pi * (0.03**2 - 0.024**2) * 0.02
    assert mass == pytest.approx(7850.0 * (np.pi * 0.024**2 * 0.1 + disc))
