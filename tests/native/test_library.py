"""Exported models against the same models in Python: what they do is the same, bit for bit."""

import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.drivetrain import RollingContactBearing, Shaft, Wheel
from gearmbs.gears import GearSpec, PlanetarySet, planetary_mechanism
from gearmbs.mechanism import ModelError
from gearmbs.native import export, memory
from gearmbs.studies.presets.bench import bench_train
from gearmbs.studies.run.simulation import case_mechanism
from tests.drivetrain.support import stage
from tests.mechanism.test_stepping import flexible_pair, rolling_train, slider_crank, top
from tests.native.support import Instance, Library
from tests.says import says

COMPILER = shutil.which("cc") or shutil.which("gcc")
CPP = shutil.which("c++") or shutil.which("g++")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(COMPILER is None, reason="no C compiler is installed")]

PAIR_END = 0.02
TOLD = {
    "com_position": "xyz", "com_velocity": "xyz", "angular_velocity": "xyz", "com_acceleration": "xyz",
    "angular_acceleration": "xyz",
}  # fmt: skip


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """The pair of the paper as a library, and the mechanism."""
    m = case_mechanism(gm.Case())
    made = export(m, tmp_path_factory.mktemp("pair"), t_end=PAIR_END, processor="native")
    return m, made, Library(made.library)


def expected(m, sim, name):
    """Return an output by its name in a library as a simulator tells it."""
    if name == "kinetic_energy":
        return sim.get(name)
    owners = {*m.bodies, *m.elements, *m.joints, *m.state_names}
    for owner in sorted(owners, key=len, reverse=True):
        if name.startswith(f"{owner}."):
            what, _, rest = name[len(owner) + 1 :].partition(".")
            if what == "transmission_error":
                return sim.get(what, owner)
            if what == "state":
                return sim.get("state", owner)
            if what == "diagnostics":
                return sim.get("diagnostics", owner)[rest]
            if what in ("modal_coordinates", "modal_velocities"):
                return sim.get(what, owner)[int(rest)]
            if what in TOLD:
                return sim.get(what, owner)["xyz".index(rest)]
            place = ("fx", "fy", "fz", "tx", "ty", "tz").index(rest)
            return sim.get(what, owner)[place // 3][place % 3]
    return sim.get("output", name)


def compared(m, library, end, points=1000, changes=(), looks=23, **options):
    """Hold a library against a simulator at some points, with numbers set at some of them; return the simulator."""
    instance, sim = Instance(library), gm.Simulator(m, end, lump=False, **options)
    times = np.linspace(0.0, end, points + 1)
    told, told_rates = [], []
    for k, t in enumerate(times[1:].tolist()):
        for at, name, value in changes:
            if at == k:
                instance.set(name, value)
                sim.set(name, value)
                assert instance.number(name) == sim.get("input", name) == value
        instance.advance(t)
        sim.advance(t)
        y, yp = instance.unknowns()
        told.append(y)
        told_rates.append(yp)
        if k % looks == looks - 1 and t < end:
            wanted = [expected(m, sim, name) for name in library.output_names]
            np.testing.assert_array_equal(instance.outputs(), wanted)
    result = sim.solution().result
    np.testing.assert_array_equal(told, result.y[1:])
    np.testing.assert_array_equal(told_rates, result.yp[1:])
    assert library.steps(instance.address) == result.stats.steps
    return sim


CHANGES = [
    (100, "load.torque", 100.0), (200, "mesh.stiffness", 5e9), (300, "load.torque", 120.0), (300, "mesh.damping", 2e3),
    (301, "load.torque", 121.0), (302, "load.torque", 121.0),
]  # fmt: skip


@pytest.mark.parametrize("changes", [[], CHANGES])
def test_pair_of_the_paper(pair, changes):
    m, _, library = pair
    sim = compared(m, library, PAIR_END, changes=changes)
    # not all pivots are those of the export
    assert sim.solution().result.stats.repivots > 0


def misaligned():
    return case_mechanism(gm.make_case({"fault": {"misalignment": "1 deg"}})), 0.01, {}


def planetary():
    wheels = GearSpec(28, "2 mm"), GearSpec(36, "2 mm"), GearSpec.ring(100, "2 mm")
    gears = PlanetarySet(*wheels, planets=4, ideal=(1e8, 1e8))
    m = planetary_mechanism(gears, speeds={"sun": 50.0}, torques={"carrier": -20.0}, run_up=0.01)
    return m, 0.05, {"tol": 1e-6}


def ball_bearings():
    return [
        RollingContactBearing(name=f"{shaft} {k}", shaft=shaft, station=station, rolling="6206", settings={})
        for shaft in ("in", "out")
        for k, station in (("a", 0.02), ("b", 0.08))
    ]


def rolling():
    train = stage(bearings=ball_bearings(), run_up=0.01, running=True)
    return train.build(), 0.004, {"tol": 1e-7, "rate_scale": train.rate_scale}


def flexible():
    """Shafts with modes: entries that the corrector does without, and last pivots that are a full block."""
    m, options = flexible_pair()
    return m, 0.02, options


def flexible_on_rolling_bearings():
    shafts = [Shaft(name=name, length="100 mm", diameter="30 mm", modes=8, elements=6) for name in ("in", "out")]
    wheels = [
        Wheel(name=name, shaft=shaft, station=0.05, gear=GearSpec(teeth, "3 mm", name=name, bore_radius="15 mm"))
        for name, shaft, teeth in (("pinion", "in", 20), ("gear", "out", 60))
    ]
    train = stage(shafts=shafts, wheels=wheels, bearings=ball_bearings(), run_up=0.01, running=True)
    return train.build(), 0.004, {"tol": 1e-7, "rate_scale": train.rate_scale}


def bench():
    """The test bench of the paper's Fig. 2: two pairs, clutch, pump, housing."""
    train = bench_train("5 MPa")
    return train.build(), 0.02, {"tol": 1e-6, "rate_scale": train.rate_scale}


def tumbling():
    """Its Euler angles change their reference on the way."""
    return top(), 2.0, {}


def of_expressions():
    """Expressions, states of its own, and algebraic ones that are solved for at outputs."""
    return slider_crank(), 1.0, {}


def test_outputs_that_are_expressions(tmp_path):
    """Accelerations, reactions, states, turns and what has been set: what Python tells, bit for bit."""
    m = slider_crank()
    m.parameter("gain", "m", 2.0)
    texts = {
        "shaking": "ACCX(guide.I)/9.81 + 3*VX(guide.I, guide.J)**2",
        "pressing": "gain*JOINT(guide, 0, 3, 0) - DIF(lag) + VARVAL(squeeze)",
        "power": "6.0*WZ(main.I, main.J)",
        "place": "DX(guide.I, main.J) + SIN(TIME)",
        "turned": "AZ(main.I, main.J)",
        "rolled": "gain*AZ(main.I, main.J) + 0.1*AY(guide.I, main.J)",
    }
    for name, text in texts.items():
        m.output(name, text)
    m.output("speed", ("angular_velocity", "crank", "z"))
    m.output("rate", ("joint_rate", "main"))
    m.output("moved", ("joint_displacement", "guide"))
    made = export(m, tmp_path, t_end=1.0, processor="native")
    assert not made.left_out
    instance, sim = Instance(Library(made.library)), gm.Simulator(m, 1.0, lump=False)
    exact = (*texts, "speed")
    told = []
    for k, t in enumerate(np.linspace(0.0, 1.0, 51)[1:-1].tolist()):
        if k == 20:
            instance.set("gain", 3.0)
            sim.set("gain", 3.0)
        if k == 30:
            state = instance.save()
        instance.advance(t)
        sim.advance(t)
        if k % 7 == 0 or k > 30:
            told.append(instance.outputs())
            wanted = [sim.get("output", name) for name in made.outputs]
            np.testing.assert_array_equal(told[-1][: len(exact)], wanted[: len(exact)])
            np.testing.assert_allclose(told[-1], wanted, rtol=1e-12, atol=1e-14)
    # full turns are counted, and are of the state
    assert abs(instance.get("turned")) > 2.0 * np.pi
    instance.restore(state)
    instance.advance(t)
    np.testing.assert_array_equal(instance.outputs(), told[-1])


def turning_disc():
    m = gm.Mechanism("disc")
    disc = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
    m.torque("drive", disc, m.input("load", "N m", 4.0))
    m.output("angle", ("joint_angle", "pin"))
    return m


@pytest.mark.parametrize("spring", [False, True])
def test_angles_of_joints(spring, tmp_path):
    """They go on from what a simulator has counted, and from what the run itself counts, where something needs it."""
    m = turning_disc()
    if spring:
        # at some steps of communication the disc turns by more than half a turn
        pin = m.joints["pin"]
        m.axis_torque("soft", pin.i, pin.j, "-0.01*AZ(pin.I, pin.J)")
    sim = gm.Simulator(m, 10.0, lump=False, tol=1e-8)
    for t in np.linspace(0.0, 3.0, 16)[1:].tolist():
        sim.advance(t)
    made = export(sim, tmp_path, processor="native")
    assert made.outputs == {"angle": "rad"}
    instance = Instance(Library(made.library))
    assert instance.get("angle") == pytest.approx(sim.get("output", "angle"), rel=1e-14)
    for t in (3.1, 5.0, 8.0) if spring else np.linspace(3.0, 8.0, 26)[1:].tolist():
        instance.advance(t)
        sim.advance(t)
    assert instance.get("angle") == pytest.approx(sim.get("output", "angle"), rel=1e-14)
    if not spring:
        assert instance.get("angle") == pytest.approx(0.5 * 2.0 * 8.0**2, rel=1e-6)
    silent = gm.Simulator(turning_disc(), 10.0, lump=False, records=False)
    silent.advance(1.0)
    with pytest.warns(UserWarning, match=says("export", "angle", "cannot")):
        assert export(silent, tmp_path / "silent", processor="native").left_out == ["angle"]


def sensed():
    """Sensors, one of them on a housing that deforms."""
    m, options = rolling_train()
    return m, 0.004, options


MODELS = [
    misaligned,
    planetary,
    rolling,
    flexible,
    flexible_on_rolling_bearings,
    bench,
    sensed,
    tumbling,
    of_expressions,
]


@pytest.mark.parametrize("model", MODELS)
def test_other_mechanisms(model, tmp_path):
    m, end, options = model()
    made = export(m, tmp_path, t_end=end, processor="native", **options)
    compared(m, Library(made.library), end, **options)


@pytest.mark.parametrize("model", [misaligned, planetary, flexible_on_rolling_bearings, bench])
def test_random_histories_in_threads(model, tmp_path):
    """Numbers jump at random: no failure, and instances in turn in two threads do what each does alone."""
    m, end, options = model()
    library = Library(export(m, tmp_path, t_end=end, processor="native", **options).library)
    first = Instance(library)
    values = {name: first.number(name) or 1e-4 for name in library.number_names}
    times = np.linspace(0.0, end, 21)[1:]

    def run(seeds):
        generators, instances = [np.random.default_rng(seed) for seed in seeds], [Instance(library) for _ in seeds]
        told = [[] for _ in seeds]
        for t in times:
            for random, instance, one in zip(generators, instances, told, strict=True):
                for name, value in values.items():
                    if random.random() < 0.2:
                        instance.set(name, value * random.uniform(0.5, 1.5))
                instance.advance(t)
                one.append(np.append(instance.unknowns().ravel(), instance.outputs()))
        return told

    with ThreadPoolExecutor(2) as pool:
        together = [one for part in pool.map(run, [[0, 1, 2], [3, 4, 5]]) for one in part]
    np.testing.assert_array_equal(together, [run([seed])[0] for seed in range(6)])
    assert len({np.array(one).tobytes() for one in together}) == len(together)


def test_without_room_for_a_tail(tmp_path, monkeypatch):
    """Its entries are taken one by one: the mesh force differs by less than a finer tolerance makes, twice."""
    m, options = flexible_pair()
    room_for = memory._room_for

    def smaller(name, n, entries, present):
        # the plan at the export has no tail yet
        return 0 if name in memory.OF_TAIL else room_for(name, n, entries, present)

    monkeypatch.setattr(memory, "_room_for", smaller)
    asked = [("load", "mesh", component) for component in ("fx", "fy")]
    instance = Instance(Library(export(m, tmp_path, t_end=0.02, outputs=asked, processor="native", **options).library))
    finer = {**options, "tol": 0.1 * options["tol"]}
    sims = [gm.Simulator(m, 0.02, lump=False, records=False, **given) for given in (options, finer)]
    told = []
    for t in np.linspace(0.0, 0.02, 101)[1:-1].tolist():
        instance.advance(t)
        told.append([instance.outputs()])
        for sim in sims:
            sim.advance(t)
            told[-1].append(sim.get("load", "mesh")[0][:2])
    library, own, fine = np.array(told).swapaxes(0, 1)
    assert (library != own).any()
    assert np.abs(library - own).max() <= 2.0 * np.abs(fine - own).max()
    assert np.abs(fine - own).max() <= 0.02 * np.abs(own).max()


def test_states(pair):
    """What follows from a state is the same in the instance, in another one, and after others have gone on."""
    _, _, library = pair
    times = np.linspace(0.0, PAIR_END, 201)[1:]
    first, second = Instance(library), Instance(library)
    for t in times[:80]:
        first.advance(t)
    first.set("load.torque", 60.0)
    state = first.save()
    rest = []
    for t in times[80:]:
        first.advance(t)
        rest.append(np.append(first.unknowns().ravel(), first.outputs()))
    second.advance(times[3])
    second.outputs()
    for instance in (first, second, Instance(library)):
        instance.restore(state)
        assert instance.t == times[79]
        assert instance.save() == state
        for t, wanted in zip(times[80:], rest, strict=True):
            instance.advance(t)
            np.testing.assert_array_equal(np.append(instance.unknowns().ravel(), instance.outputs()), wanted)


def test_instances_in_threads(pair):
    """Twenty instances in four threads do what each does alone."""
    _, _, library = pair
    times = np.linspace(0.0, 0.25 * PAIR_END, 26)[1:]

    def run(torque):
        instance = Instance(library)
        instance.set("load.torque", torque)
        for t in times:
            instance.advance(t)
        return np.append(instance.unknowns().ravel(), instance.outputs())

    torques = np.linspace(50.0, 150.0, 20)
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(run, torques))
    np.testing.assert_array_equal(together, [run(torque) for torque in torques])


def test_a_number_that_is_set_at_the_start(pair):
    """Python starts afresh with it, a library goes on from the start: they agree within the tolerance."""
    m, _, library = pair
    instance, sim = Instance(library), gm.Simulator(m, PAIR_END, lump=False)
    for one in (instance, sim):
        one.set("load.torque", 60.0)
        one.advance(0.5 * PAIR_END)
    assert instance.get("mesh.load.ty") == pytest.approx(sim.get("load", "mesh")[1][1], rel=1e-3)


def test_the_portable_target_differs_by_what_rounding_moves(pair, tmp_path):
    """Products are contracted with sums where the processor can: of another target, last digits differ, no more.

    The force of a touching pair is the difference of two flanks times a stiffness: it moves by 1e-7 of itself when
    places of some 0.1 m move by their last digits, for indentations of some micrometres.
    """
    m, _, library = pair
    instances = Instance(library), Instance(Library(export(m, tmp_path, t_end=PAIR_END).library))
    forces = []
    for t in np.linspace(0.0, 0.5 * PAIR_END, 51)[1:].tolist():
        for one in instances:
            one.advance(t)
            forces.append(one.get("mesh.load.fx"))
    native, portable = forces[::2], forces[1::2]
    np.testing.assert_allclose(portable, native, rtol=0.0, atol=1e-4 * np.max(np.abs(native)))


def test_a_simulator_is_exported_as_it_stands(pair, tmp_path):
    m, _, _ = pair
    sim = gm.Simulator(m, PAIR_END, lump=False, records=False)
    sim.set("load.torque", 80.0)
    sim.advance(0.004)
    instance = Instance(Library(export(sim, tmp_path, name="later", processor="native").library))
    assert instance.t == 0.004
    assert instance.number("load.torque") == 80.0
    for t in np.linspace(0.004, 0.006, 41)[1:].tolist():
        instance.advance(t)
        sim.advance(t)
        np.testing.assert_array_equal(instance.unknowns()[0], sim.state().y)


def test_refusals(pair):
    """They change nothing, and what is meant goes on."""
    _, _, library = pair
    instance, refused = Instance(library), -20
    instance.advance(0.001)
    before = instance.save()
    assert library.advance(instance.address, 0.0005) == refused
    assert library.advance(instance.address, PAIR_END * 1.01) == refused
    assert library.advance(instance.address, float("nan")) == refused
    assert library.set(instance.address, library.numbers(), 1.0) == refused
    assert library.set(instance.address, 0, float("inf")) == refused
    assert library.restore(instance.address, before, len(before) - 1) == refused
    assert library.restore(instance.address, b"x" + before[1:], len(before)) == refused
    assert library.number_name(library.numbers()) is None
    assert b"no use" in library.message(refused)
    assert instance.save() == before
    instance.advance(0.001)
    instance.advance(PAIR_END)


def test_the_example(pair, tmp_path):
    """It is compiled against the library and prints an output at a hundred points."""
    _, made, library = pair
    program = tmp_path / "example"
    command = [COMPILER, "-Wall", "-Werror", str(made.folder / "example.c"), str(made.library), "-o", str(program)]
    subprocess.run([*command, f"-Wl,-rpath,{made.folder}"], check=True)
    told = [line.split() for line in subprocess.check_output([program], text=True).splitlines()]
    assert len(told) == 100
    instance = Instance(library)
    for k, (t, value, unit) in enumerate(told, start=1):
        instance.advance(PAIR_END * k / 100.0 if k < 100 else PAIR_END)
        assert float(t) == pytest.approx(instance.t)
        assert float(value) == instance.outputs()[0]
        assert unit == "m"


@pytest.mark.skipif(CPP is None, reason="no C++ compiler is installed")
def test_the_example_in_cpp(pair, tmp_path):
    """Instances of threads go on from one state as one instance does, and print what it holds."""
    _, made, library = pair
    program = tmp_path / "example"
    command = [CPP, "-std=c++17", "-pthread", "-Wall", "-Wextra", "-Werror", str(made.folder / "example.cpp")]
    subprocess.run([*command, str(made.library), "-o", str(program), f"-Wl,-rpath,{made.folder}"], check=True)
    lines = subprocess.check_output([program], text=True).splitlines()
    instance = Instance(library)
    instance.advance(0.5 * PAIR_END)
    instance.advance(PAIR_END)
    values = instance.outputs()
    assert len(lines) == len(made.outputs)
    for name, value, line in zip(made.outputs, values, lines, strict=True):
        assert line.startswith(f"{name} {value:.17g}")


def test_what_cannot_be_exported_is_refused(tmp_path):
    def disc(torque):
        m = gm.Mechanism("disc")
        body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
        pin = m.revolute("pin", body, m.ground, axis=(0, 0, 1))
        m.torque("drive", body, torque(m))
        m.output("pull", ("load", "pin", "fx"))
        m.output("speed", ("angular_velocity", "disc", "z"))
        return m, pin

    constant, _ = disc(lambda m: m.input("load", "N m", 1.0))
    with pytest.raises(ModelError, match=says("t_end", "latest", "exported")):
        export(constant, tmp_path)
    with pytest.raises(ModelError, match=says("compiler", "no-such-command", "install")):
        export(constant, tmp_path, t_end=1.0, compiler="no-such-command")
    with pytest.raises(ModelError, match=says("pull", "force element")):
        export(constant, tmp_path, t_end=1.0, outputs=["pull"])
    with pytest.raises(ModelError, match=says("processor", "x86-64-v9", "did you mean")):
        export(constant, tmp_path, t_end=1.0, processor="x86-64-v9")
    with pytest.raises(ModelError, match=says("processor", "i486", "none")):
        export(constant, tmp_path, t_end=1.0, processor="i486")
    with pytest.raises(ModelError, match=says("load", "pin", "force element")):
        export(constant, tmp_path, t_end=1.0, outputs=[("load", "pin", "fx")])
    held = gm.Simulator(constant, 1.0, lump=False)
    held.control("load", lambda t, sim: 2.0, 0.1)
    with pytest.raises(ModelError, match=says("controllers", "without", "Python")):
        export(held, tmp_path)
    with pytest.warns(UserWarning, match=says("export", "pull", "force element")):
        made = export(constant, tmp_path, t_end=1.0)
    assert made.left_out == ["pull"]
    assert made.outputs == {"speed": "rad/s"}
    assert made.numbers == {"load": "N m"}
    instance = Instance(Library(made.library))
    instance.set("load", 4.0)
    instance.advance(0.5)
    # 2 w' = 4
    assert instance.get("speed") == pytest.approx(1.0, rel=1e-6)


def test_a_constraint_given_by_an_expression(tmp_path):
    """A bead on a hoop of 0.3 m about the origin at 1 m/s: F = -m v^2 / r^2 (x, y)."""
    m = gm.Mechanism("bead")
    ball = m.body("ball", mass=2.0, inertia=(1e-3, 1e-3, 1e-3), position=(0.3, 0.0, 0.0), velocity=(0, 1.0, 0))
    ball.marker(name="I")
    m.ground.marker(name="G")
    m.general_constraint("hoop", "DX(I,G)**2 + DY(I,G)**2 - 0.09")
    asked = [("reaction", "hoop", "fx"), ("reaction", "hoop", "fy"), *(("com_position", "ball", c) for c in "xy")]
    instance = Instance(Library(export(m, tmp_path, t_end=1.0, outputs=asked, processor="native", tol=1e-9).library))
    instance.advance(0.4)
    told = np.array(instance.outputs())
    np.testing.assert_allclose(told[:2], -2.0 / 0.09 * told[2:], atol=1e-6)
