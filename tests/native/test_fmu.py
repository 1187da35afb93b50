"""FMUs of exported models, judged and driven by FMPy."""

import re
import shutil
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.dae.problem import ANY
from gearmbs.mechanism import ModelError
from gearmbs.native import export
from gearmbs.native.asked import Told
from gearmbs.native.fmu import Description, model_description, variables_of
from gearmbs.native.outputs import OF_BODY
from gearmbs.studies.run.simulation import case_mechanism
from tests.says import says

fmpy = pytest.importorskip("fmpy")
COMPILER = shutil.which("cc") or shutil.which("gcc")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(COMPILER is None, reason="no C compiler is installed")]

END = 0.02
VERSIONS = ("fmu2", "fmu3")


@cache
def mechanism():
    return case_mechanism(gm.Case())


@pytest.fixture(scope="module", params=VERSIONS)
def made(request, tmp_path_factory):
    return export(
        mechanism(), tmp_path_factory.mktemp(request.param), t_end=END, target=request.param, processor="native"
    )


class Driven:
    """An FMU that is driven call by call, in both versions by the same names."""

    def __init__(self, path, folder, **options):
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        told = fmpy.read_model_description(path)
        self.second = told.fmiVersion == "2.0"
        self.references = {v.name: v.valueReference for v in told.modelVariables}
        where = fmpy.extract(path, unzipdir=folder)
        slave = FMU2Slave if self.second else FMU3Slave
        self.fmu = slave(
            guid=told.guid, unzipDirectory=where, instanceName="pair",
            modelIdentifier=told.coSimulation.modelIdentifier,
        )  # fmt: skip
        self.fmu.instantiate(**options)
        self.t = 0.0

    def begin(self, **numbers):
        if self.second:
            self.fmu.setupExperiment(startTime=0.0)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=0.0)
        self.set(**numbers)
        self.fmu.exitInitializationMode()
        return self

    def set(self, **numbers):
        put = self.fmu.setReal if self.second else self.fmu.setFloat64
        for name, value in numbers.items():
            put([self.references[name.replace("__", ".")]], [value])

    def get(self, *names):
        take = self.fmu.getReal if self.second else self.fmu.getFloat64
        return np.array(take([self.references[name] for name in names]))

    def step(self, size):
        self.fmu.doStep(currentCommunicationPoint=self.t, communicationStepSize=size)
        self.t += size

    def derivative(self, unknowns, known, along, rows=None):
        """Derivatives of outputs along a direction of numbers; of arrays as many as they have numbers."""
        from ctypes import c_double, c_uint32

        sizes, count = [len(unknowns), len(known)], rows or len(unknowns)
        rows, columns = ((c_uint32 * len(names))(*(self.references[n] for n in names)) for names in (unknowns, known))
        seed, values = (c_double * sizes[1])(*along), (c_double * count)()
        if self.second:
            self.fmu.fmi2GetDirectionalDerivative(self.fmu.component, rows, sizes[0], columns, sizes[1], seed, values)
        else:
            self.fmu.fmi3GetDirectionalDerivative(
                self.fmu.component, rows, sizes[0], columns, sizes[1], seed, sizes[1], values, count
            )
        return np.array(values)

    def save(self):
        state = self.fmu.getFMUstate() if self.second else self.fmu.getFMUState()
        return state, self.t

    def restore(self, state):
        (self.fmu.setFMUstate if self.second else self.fmu.setFMUState)(state[0])
        self.t = state[1]

    def end(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


NAMES = ("mesh.load.fx", "mesh.load.ty", "load.torque")


def test_fmpy_finds_nothing_wrong(made):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(made.library)) == []
    told = fmpy.read_model_description(str(made.library), validate=True)
    by_name = {variable.name: variable for variable in told.modelVariables}
    assert by_name["load.torque"].unit == "N m"
    assert float(by_name["load.torque"].start) == pytest.approx(100.0)
    assert by_name["mesh.load.fx"].causality == "output"
    assert len(told.initialUnknowns) == len(told.outputs) == len(made.outputs)


def test_an_fmu_does_what_python_does(made, tmp_path):
    """The same points, with a torque set on the way: unknowns are equal, and so are the outputs."""
    driven, sim = Driven(str(made.library), tmp_path).begin(), gm.Simulator(mechanism(), END, lump=False, records=False)
    size = END / 400
    for k in range(399):
        if k in (100, 250):
            driven.set(load__torque=60.0 + k)
            sim.set("load.torque", 60.0 + k)
        t = driven.t
        driven.step(size)
        sim.advance(t + size)
        if k % 20 == 0:
            force, moment = sim.get("load", "mesh")
            np.testing.assert_array_equal(driven.get(*NAMES), [force[0], moment[1], sim.get("input", "load.torque")])
    driven.end()


def test_states_of_an_fmu(made, tmp_path):
    """Rollback, and a state that another instance takes from its bytes."""
    driven = Driven(str(made.library), tmp_path / "a").begin()
    size = END / 200
    for _ in range(50):
        driven.step(size)
    state = driven.save()

    def go_on(one):
        out = []
        for _ in range(60):
            one.step(size)
            out.append(one.get(*NAMES))
        return out

    first = go_on(driven)
    driven.restore(state)
    np.testing.assert_array_equal(go_on(driven), first)
    serial = driven.fmu.serializeFMUstate if driven.second else driven.fmu.serializeFMUState
    bytes_ = serial(state[0])
    other = Driven(str(made.library), tmp_path / "b").begin()
    back = other.fmu.deSerializeFMUstate if other.second else other.fmu.deserializeFMUState
    other.restore((back(bytes_), state[1]))
    np.testing.assert_array_equal(go_on(other), first)
    for one in (driven, other):
        one.end()


def test_outputs_follow_what_is_set(made, tmp_path):
    """A torque that is set is told at once, and the acceleration it gives."""
    driven = Driven(str(made.library), tmp_path).begin()
    driven.step(0.25 * END)
    name = next(n for n in made.outputs if (n.startswith("load.load") and n.endswith("tz")) or n == "load.load.ty")
    before = driven.get(name)[0]
    driven.set(load__torque=2.0 * driven.get("load.torque")[0])
    assert driven.get(name)[0] == pytest.approx(2.0 * before)
    driven.end()


def two_links():
    """Two links under gravity, each driven from the ground, one by a torque that is a curve of its input."""
    m = gm.Mechanism("arm", gravity=(0.0, -9.81, 0.0))
    first = m.body("first", mass=2.0, inertia=(0.1, 0.1, 0.2), position=(0.5, 0.0, 0.0))
    second = m.body("second", mass=1.0, inertia=(0.05, 0.05, 0.1), position=(1.4, 0.3, 0.0))
    shoulder = m.revolute("shoulder", first, m.ground, at=(0.0, 0.0, 0.0), axis=(0, 0, 1))
    elbow = m.revolute("elbow", second, first, at=(1.0, 0.0, 0.0), axis=(0, 0, 1))
    m.torque("drive", shoulder.i, m.input("load", "N m", 4.0))
    m.input("lean", "rad", 0.3)
    m.torque("curved", elbow.i, "7*SIN(lean)")
    m.output("first", ("com_acceleration", "first", "y"))
    m.output("second", ("com_acceleration", "second", "x"))
    m.output("reaction", ("reaction", "shoulder", "fx"))
    for name, body, axis in (
        ("place", "second", "x"),
        ("y2", "second", "y"),
        ("x1", "first", "x"),
        ("y1", "first", "y"),
    ):
        m.output(name, ("com_position", body, axis))
    return m


def rates_of_two_links(place_1, place_2):
    """Derivatives of the accelerations and of the reaction by the torque on each link: J M^-1 in closed form."""
    turned = np.arctan2(place_1[1], place_1[0])
    elbow = np.array([np.cos(turned), np.sin(turned)])

    def across(arm):
        return np.array([-arm[1], arm[0]])

    none = np.zeros(2)
    jacobians = [np.stack([across(0.5 * elbow), none], axis=1),
                 np.stack([across(elbow), across(place_2[:2] - elbow)], axis=1)]  # fmt: skip
    mass = sum(m * j.T @ j for m, j in zip((2.0, 1.0), jacobians, strict=True)) + np.diag([0.2, 0.1])
    # each torque acts on its link from the ground
    rates = np.linalg.inv(mass)
    one, two = (j @ rates for j in jacobians)
    return np.stack([one[1], two[0], 2.0 * one[0] + 1.0 * two[0], np.zeros(2)])


@pytest.mark.parametrize("version", VERSIONS)
def test_derivatives_of_outputs_by_inputs(version, tmp_path):
    """Against the equations of motion of two links, and along a direction the sum."""
    m = two_links()
    made = export(m, tmp_path / "arm", t_end=1.0, target=version)
    driven, other = (Driven(str(made.library), tmp_path / name).begin() for name in "ab")
    for _ in range(7):
        driven.step(0.05)
        other.step(0.05)
    names = ["first", "second", "reaction", "place"]
    before = driven.get(*names)
    places = driven.get("x1", "y1", "place", "y2").reshape(2, 2)
    exact = rates_of_two_links(*places)
    # the reaction on the first link, whichever way it is counted
    exact[2] *= np.sign(exact[2, 0] * driven.derivative(names, ["load"], [1.0])[2])
    by_load, by_lean = exact[:, 0], 7.0 * np.cos(0.3) * exact[:, 1]
    for known, along, wanted in (
        (["load"], [1.0], by_load),
        (["lean"], [1.0], by_lean),
        (["load", "lean"], [2.0, -3.0], 2.0 * by_load - 3.0 * by_lean),
    ):
        np.testing.assert_allclose(driven.derivative(names, known, along), wanted, rtol=1e-6, atol=1e-7)
    # the instance is as it was, and goes on as one that was not asked
    np.testing.assert_array_equal(driven.get(*names), before)
    other.get(*names)
    for one in (driven, other):
        one.step(0.05)
    np.testing.assert_array_equal(driven.get(*names), other.get(*names))
    for one in (driven, other):
        one.end()


@pytest.mark.parametrize("version", VERSIONS)
def test_derivatives_by_numbers_that_are_small_in_their_unit(version, tmp_path):
    """A torque that bends within a thousandth of a unit of some numbers, and over many units of others, in closed form,
    at the start, and after a state is put back."""
    m = gm.Mechanism("bent")
    disc = m.body("disc", mass=1.0, inertia=(1.0, 1.0, 1.0))
    m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
    for name, unit, value in (("wave", "N m", 2e-4), ("gap", "m", 1e-5), ("none", "m", 0.0), ("wide", "N m", 1e6)):
        m.input(name, unit, value)
    m.torque("drive", disc, "SIN(wave/1E-4) + (gap/1E-4)**3 + TANH((none+2E-6)/1E-5) + SQRT(wide)")
    m.output("torque", ("load", "drive", "tz"))
    made = export(m, tmp_path / "bent", t_end=1.0, target=version)
    names = ["wave", "gap", "none", "wide"]
    exact = np.array([np.cos(2.0) / 1e-4, 3.0 * 0.1**2 / 1e-4, (1.0 - np.tanh(0.2) ** 2) / 1e-5, 0.5e-3])
    driven = Driven(str(made.library), tmp_path / "driven")

    def check():
        for name, wanted in zip(names, exact, strict=True):
            assert driven.derivative(["torque"], [name], [1.0])[0] == pytest.approx(wanted, rel=1e-6)
        along = np.array([1e-5, 2e-5, -1e-6, 1e5])
        found = driven.derivative(["torque"], names, along)[0]
        assert found == pytest.approx(along @ exact, rel=1e-6)

    driven.begin()
    check()
    driven.step(0.1)
    state = driven.save()
    driven.step(0.1)
    driven.restore(state)
    check()
    driven.end()


def test_derivatives_are_those_of_outputs(made, tmp_path):
    from fmpy.fmi1 import FMICallException

    driven = Driven(str(made.library), tmp_path).begin()
    driven.step(0.25 * END)
    assert np.isfinite(driven.derivative(["mesh.load.ty"], ["load.torque"], [1.0]))
    with pytest.raises(FMICallException):
        driven.derivative(["load.torque"], ["load.torque"], [1.0])
    with pytest.raises(FMICallException):
        driven.derivative(["mesh.load.ty"], ["mesh.load.fx"], [1.0])
    assert np.isfinite(driven.get(*NAMES)).all()
    driven.end()


def test_a_whole_simulation(made):
    """By the importer's own loop, with start values that are not the model's."""
    result = fmpy.simulate_fmu(
        str(made.library), stop_time=0.5 * END, output_interval=END / 200, start_values={"load.torque": 60.0},
        output=["mesh.load.ty"],
    )  # fmt: skip
    sim = gm.Simulator(mechanism(), END, lump=False)
    sim.set("load.torque", 60.0)
    sim.advance(0.5 * END)
    assert result["mesh.load.ty"][-1] == pytest.approx(sim.get("load", "mesh")[1][1], rel=1e-3)


def test_a_span_that_was_not_exported_is_refused(made, tmp_path):
    """With a word on what was; up to its end it goes, and no further."""
    from fmpy.fmi1 import FMICallException

    refused = Driven(str(made.library), tmp_path / "a")
    span = {"startTime": 0.0, "stopTime": 2.0 * END}
    with pytest.raises(FMICallException):
        (refused.fmu.setupExperiment if refused.second else refused.fmu.enterInitializationMode)(**span)
    driven = Driven(str(made.library), tmp_path / "b").begin()
    driven.step(END)
    with pytest.raises(FMICallException):
        driven.step(0.5 * END)
    for one in (refused, driven):
        one.fmu.freeInstance()


def pendulum():
    m = gm.Mechanism("pendulum", gravity=(0.0, -9.81, 0.0))
    arm = m.body("arm", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.5, 0.0, 0.0))
    m.revolute("pin", arm, m.ground, axis=(0, 0, 1))
    m.torque("drive", arm, m.input("torque", "N m"))
    m.output("speed", ("angular_velocity", "arm", "z"))
    m.output("height", ("com_position", "arm", "y"))
    return m


@pytest.fixture(scope="module")
def swinging(tmp_path_factory):
    return export(pendulum(), tmp_path_factory.mktemp("swinging"), t_end=1.0, target="fmu3", processor="native")


@pytest.mark.parametrize("early", [False, True])
def test_steps_on_the_way_are_told_and_may_be_the_last(swinging, early, tmp_path):
    """Where steps of the integrator end, values are those of a simulator; a run that ended early goes on alike."""
    asked_at, ends_at, seen, flags = 0.2, 0.3, [], []

    def update(environment, t, may_set, may_get, step_ends, may_return, returns, at):
        flags.append((may_set, may_get, step_ends, may_return))
        seen.append((t, *driven.get("speed", "height")))
        if t > asked_at:
            returns[0], at[0] = True, ends_at

    driven = Driven(str(swinging.library), tmp_path, intermediateUpdate=update, earlyReturnAllowed=early).begin()
    told = driven.fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.5)
    end = ends_at if early else 0.5
    assert told == (False, False, early, end)
    times = np.array([t for t, *_ in seen])
    # all but the last are ends of steps
    assert len(times) > 8
    assert (np.diff(times) > 0.0).all()
    assert times[-1] == end
    assert flags == [(False, True, True, early)] * (len(times) - 1) + [(False, True, False, False)]
    sim = gm.Simulator(pendulum(), 1.0, lump=False, records=False)
    for t, *values in seen:
        sim.advance(t)
        assert values == [sim.get("angular_velocity", "arm")[2], sim.get("com_position", "arm")[1]]
    driven.fmu.doStep(currentCommunicationPoint=end, communicationStepSize=1.0 - end)
    sim.advance(1.0)
    assert driven.get("speed")[0] == sim.get("angular_velocity", "arm")[2]
    driven.end()


def test_inputs_jump_in_event_mode(swinging):
    """A torque that jumps by an event acts from it on, as one that is set between two steps."""
    steps = np.array([(0.0, 0.0), (0.25, 0.0), (0.25, 6.0), (1.0, 6.0)], dtype=[("time", float), ("torque", float)])
    results = [
        fmpy.simulate_fmu(str(swinging.library), stop_time=1.0, output_interval=0.05, input=steps, use_event_mode=mode)
        for mode in (False, True)
    ]
    for result in results:
        # w' = (m g l cos - torque) / J alters where it jumps
        assert result["speed"][-1] == pytest.approx(results[0]["speed"][-1], rel=1e-9)
    sim = gm.Simulator(pendulum(), 1.0, lump=False, records=False)
    for t in (*np.arange(1, 6) * 0.05, None, *np.arange(6, 21) * 0.05):
        if t is None:
            sim.set("torque", 6.0)
        else:
            sim.advance(min(t, 1.0))
    assert results[1]["speed"][-1] == pytest.approx(sim.get("angular_velocity", "arm")[2], rel=1e-9)


def test_names_and_targets():
    m = gm.Mechanism("disc")
    disc = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
    m.torque("drive", disc, m.input("load", "N m", 1.0))
    speed = ("angular_velocity", "disc", "z")
    with pytest.raises(ModelError, match=says("angular_velocity.disc.z", "twice", "another")):
        export(m, "nowhere", t_end=1.0, target="fmu2", outputs=[speed, speed])
    with pytest.raises(ModelError, match=says("target", "fmu4", "fmu3")):
        export(m, "nowhere", t_end=1.0, target="fmu4")


def test_arrays_have_one_unit():
    """Names of components alone do not make a vector: numbers of other units stay by themselves."""
    told = [Told(f"disc.{axis}", unit, ()) for axis, unit in (("x", "m"), ("y", "rad/s"), ("z", "N m"))]
    told += [Told(f"s.{k}", unit, ()) for k, unit in enumerate(("rad", "rad", "N"))]
    found = {one.name: (one.unit, one.size) for one in variables_of({}, told, arrays=True)}
    assert found == {"disc.x": ("m", 0), "disc.y": ("rad/s", 0), "disc.z": ("N m", 0), "s": ("rad", 2), "s.2": ("N", 0)}


def test_arrays(tmp_path):
    """Vectors of an FMU 3.0 as arrays are, number for number, what they are one by one; so are derivatives."""
    from fmpy.validation import validate_fmu

    one, other = (
        export(mechanism(), tmp_path / name, t_end=END, target="fmu3", processor="native", arrays=name == "arrays")
        for name in ("scalars", "arrays")
    )
    assert validate_fmu(str(other.library)) == []
    told = {v.name: v for v in fmpy.read_model_description(str(other.library)).modelVariables}
    vectors = {name: int(v.dimensions[0].start) for name, v in told.items() if v.dimensions}
    bodies = list(mechanism().bodies)
    assert vectors == {
        **{f"{body}.{what}": 3 for body in bodies for what in OF_BODY},
        **{f"{element}.load.{part}": 3 for element in mechanism().elements for part in ("force", "moment")},
        **{f"{joint}.reaction.{part}": 3 for joint in mechanism().joints for part in ("force", "moment")},
    }
    assert told["mesh.load.moment"].unit == "N m"
    assert told["load.torque"].dimensions == []
    # a simulation here takes numbers alone
    foreign = gm.native.ForeignFMU(other.library, {})
    assert not vectors.keys() & set(foreign.outputs)
    scalars, arrays = (Driven(str(made.library), tmp_path / f"{k}").begin() for k, made in enumerate((one, other)))
    for driven in (scalars, arrays):
        driven.set(load__torque=60.0)
        driven.step(0.3 * END)
    for name, parts in (("mesh.load.moment", ("tx", "ty", "tz")), (f"{bodies[0]}.com_velocity", "xyz")):
        wanted = scalars.get(*(f"{name.removesuffix('.moment')}.{part}" for part in parts))
        got = arrays.fmu.getFloat64([arrays.references[name], arrays.references["load.torque"]], nValues=4)
        np.testing.assert_array_equal(got, [*wanted, 60.0])
    body = "gear 2.angular_acceleration"
    wanted = scalars.derivative([f"{body}.{axis}" for axis in "xyz"], ["load.torque"], [1.0])
    assert np.abs(wanted).max() > 0.0
    np.testing.assert_array_equal(arrays.derivative([body], ["load.torque"], [1.0], rows=3), wanted)
    with pytest.raises(Exception, match="fmi3GetFloat64"):
        arrays.fmu.getFloat64([arrays.references[body]], nValues=2)
    for driven in (scalars, arrays):
        driven.end()
    with pytest.raises(ModelError, match=says("arrays", "fmu2", "fmu3")):
        export(mechanism(), tmp_path, t_end=END, target="fmu2", arrays=True)


def test_units_of_a_description():
    """By base units where their powers are whole, else by name."""
    variables = variables_of(
        {"k": ("parameter", "N/m^1.3", 2.0, ANY), "u": ("input", "N*m", 1.0, ANY)}, [Told("w", "rad/s", ())]
    )
    told = Description("model", "model", "token", "tool", 0.0, 1.0, variables)
    for version in ("2.0", "3.0"):
        root = ElementTree.fromstring(model_description(told, version))
        units = {unit.get("name"): dict(unit[0].attrib) if len(unit) else None for unit in root.iter("Unit")}
        assert units == {
            "N/m^1.3": None, "N m": {"m": "2", "kg": "1", "s": "-2"}, "rad/s": {"s": "-1", "rad": "1"}
        }  # fmt: skip


def test_the_page_says_what_comes_out(tmp_path, monkeypatch, capsys):
    """A disc of 2 kg m^2 under 4 N m: 1 rad/s after half a second, and 2 rad/s at the end of the importer's run."""
    page = (Path(__file__).parents[2] / "docs" / "howto" / "native.md").read_text()
    monkeypatch.chdir(tmp_path)
    names = {}
    exec("\n".join(re.findall(r"```\{code-cell\} ipython3\n(.*?)```", page, re.DOTALL)), names)
    assert capsys.readouterr().out.splitlines()[-1] == "1.0"
    assert names["result"]["speed"][-1] == pytest.approx(2.0, rel=1e-6)
