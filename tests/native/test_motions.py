"""Inputs that prescribe motions, in exported models: where they are set a run starts afresh, as it does in Python."""

import shutil

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.native import export
from tests.mechanism.test_stepping import slider_crank
from tests.native.support import Instance, Library

COMPILER = shutil.which("cc") or shutil.which("gcc")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(COMPILER is None, reason="no C compiler is installed")]

STIFFNESS, DAMPING = 50.0, 2.0


def driven(level, start):
    """A disc driven at a speed or an acceleration, and another one behind a spring that it turns."""
    m = gm.Mechanism("driven")
    first = m.body("first", mass=1.0, inertia=(2.0, 2.0, 2.0))
    second = m.body("second", mass=1.0, inertia=(0.5, 0.5, 0.5))
    a, b = (m.revolute(f"{body.name}_pin", body, m.ground, axis=(0, 0, 1)) for body in (first, second))
    m.rotation("motor", a, m.input("turning", "rad/s" if level == "velocity" else "rad/s^2", start), level=level)
    m.axis_torque("spring", b.i, a.i, f"-{STIFFNESS}*AZ({b.i.name}, {a.i.name}) - {DAMPING}*WZ({b.i.name}, {a.i.name})")
    m.torque("brake", second, m.input("load", "N m", 0.0))
    m.output("speed", ("angular_velocity", "first", "z"))
    m.output("follows", ("angular_velocity", "second", "z"))
    m.output("motor", ("reaction", "motor", "tz"))
    m.output("asked", "turning")
    return m


CHANGES = [
    (0.0, "turning", 1.5), (0.1, "turning", 4.0), (0.2, "load", -3.0), (0.25, "turning", 4.0), (0.3, "turning", -2.0),
    (0.3, "load", 1.0), (0.45, "load", 2.0), (0.5, "turning", 0.0),
]  # fmt: skip


@pytest.mark.parametrize(("level", "begun"), [("velocity", 0.0), ("acceleration", 0.0), ("velocity", 0.05)])
def test_motions_are_set_as_in_python(level, begun, tmp_path):
    m = driven(level, 2.0)
    sims = [gm.Simulator(m, 1.0, lump=False) for _ in range(2)]
    for sim in sims:
        sim.advance(begun)
    made = export(sims[0], tmp_path, processor="native")
    assert made.held == []
    instance, sim = Instance(Library(made.library)), sims[1]
    names, told = list(made.outputs), []
    times = np.round(np.arange(begun + 0.01, 1.0, 0.01), 12)
    for t in times.tolist():
        for at, name, value in CHANGES:
            if abs(at - (t - 0.01)) < 1e-9:
                instance.set(name, value)
                sim.set(name, value)
                assert instance.number(name) == value
        instance.advance(t)
        sim.advance(t)
        told.append(instance.unknowns())
        assert instance.outputs().tolist() == [sim.get("output", name) for name in names]
        if level == "velocity" and 0.3 < t <= 0.5:
            assert instance.get("speed") == pytest.approx(-2.0, rel=1e-9)
    result = sim.solution().result
    np.testing.assert_array_equal(told, np.stack([result.y, result.yp], axis=1)[-len(told) :])
    assert instance.library.steps(instance.address) == result.stats.steps


def test_a_mechanism_with_states_and_turns_starts_afresh(tmp_path):
    """A crank at a speed that jumps, with states that equations determine: random numbers, also before the start."""
    m = slider_crank()
    m.rotation("motor", m.joints["main"], m.input("turning", "rad/s", 3.0), level="velocity")
    made = export(m, tmp_path, t_end=1.0, processor="native")
    rng, instance, sim = np.random.default_rng(3), Instance(Library(made.library)), gm.Simulator(m, 1.0, lump=False)
    told = []
    for t in np.cumsum(rng.uniform(1e-3, 0.03, 40)).tolist():
        for name, value in (("turning", rng.normal(3.0, 2.0)), ("coil.stiffness", rng.uniform(0.1, 1.0))):
            if not told or rng.random() < 0.3:
                instance.set(name, value)
                sim.set(name, value)
        instance.advance(t)
        sim.advance(t)
        told.append(instance.unknowns())
    result = sim.solution().result
    np.testing.assert_array_equal(told, np.stack([result.y, result.yp], axis=1)[1:])


def test_states_are_those_of_instances_that_start_afresh(tmp_path):
    """Saved before a jump of the speed and behind one, and gone on with in another instance: all the same."""
    library = Library(export(driven("velocity", 2.0), tmp_path, t_end=1.0, processor="native").library)
    one, other = Instance(library), Instance(library)
    one.advance(0.1)
    one.set("turning", 5.0)
    state = one.save()
    one.advance(0.2)
    later = one.save()
    one.advance(0.4)
    for from_state, before in ((state, 0.2), (later, 0.3)):
        other.restore(from_state)
        other.advance(before)
        other.advance(0.4)
        np.testing.assert_array_equal(other.unknowns(), one.unknowns())
        np.testing.assert_array_equal(other.outputs(), one.outputs())
    assert one.get("speed") == pytest.approx(5.0, rel=1e-9)


@pytest.mark.parametrize("target", ["fmu2", "fmu3"])
def test_fmus_have_speeds_as_inputs(target, tmp_path):
    fmpy = pytest.importorskip("fmpy")
    made = export(driven("velocity", 2.0), tmp_path, t_end=1.0, target=target, processor="native")
    speeds = np.array([(0.0, 1.0), (0.2, 1.0), (0.2, 3.0), (0.5, 3.0)], dtype=[("time", float), ("turning", float)])
    told = fmpy.simulate_fmu(str(made.library), stop_time=0.5, output_interval=0.1, input=speeds, output=["speed"])
    np.testing.assert_allclose(told["speed"][[1, 2, 4, 5]], [1.0, 1.0, 3.0, 3.0], rtol=1e-9)
