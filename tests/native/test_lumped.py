"""Exported models whose bodies are integrated as one, or by their angles alone: what a simulator tells, bit for bit."""

import shutil

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.native import export
from gearmbs.studies.presets.bench import bench_train
from gearmbs.studies.run.simulation import case_mechanism
from tests.native.support import Instance, Library
from tests.native.test_library import expected

COMPILER = shutil.which("cc") or shutil.which("gcc")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(COMPILER is None, reason="no C compiler is installed")]


def pair():
    """The pair of the paper: each wheel with its shaft by one angle."""
    return case_mechanism(gm.Case()), 0.01, {}


def misaligned():
    return case_mechanism(gm.make_case({"fault": {"misalignment": "1 deg"}})), 0.005, {}


def bench():
    train = bench_train("5 MPa")
    return train.build(), 0.02, {"tol": 1e-6, "rate_scale": train.rate_scale}


def driven():
    """An angle with an equation of its own and counted turns, beside one that a motion prescribes."""
    m = gm.Mechanism("driven", gravity=(0.0, -9.81, 0.0))
    arm = m.body("arm", mass=2.0, inertia=(0.1, 0.1, 0.2), position=(0.3, 0.0, 0.0))
    weight = m.body("weight", mass=1.0, inertia=(0.01, 0.02, 0.03), position=(0.6, 0.1, 0.0))
    wheel = m.body("wheel", mass=1.0, inertia=(0.02, 0.02, 0.04), position=(1.0, 0.0, 0.0))
    m.fixed("weld", arm, weight, at=(0.6, 0.0, 0.0))
    pin = m.revolute("pin", arm, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    turn = m.revolute("turn", wheel, m.ground, at=(1, 0, 0), axis=(0, 0, 1))
    m.rotation("motor", turn, "3*SIN(5*TIME)")
    m.torque("drive", arm, m.input("load", "N m", 4.0))
    m.differential_state("lag", "WZ(pin.I, pin.J) - DIF(lag)")
    m.axis_torque("damper", pin.i, pin.j, "-0.05*WZ(pin.I, pin.J) - 0.02*AZ(pin.I, pin.J) + 0.1*DIF(lag)")
    return m, 2.0, {"tol": 1e-7}


def test_motions_of_lumped_models_are_held(tmp_path):
    m, end, options = driven()
    other = m.body("other", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(2.0, 0.0, 0.0))
    pin = m.revolute("other pin", other, m.ground, at=(2, 0, 0), axis=(0, 0, 1))
    m.rotation("turning", pin, m.input("rate", "rad/s", 1.0), level="velocity")
    assert export(m, tmp_path, t_end=end, lump=True, **options).held == ["rate"]
    assert export(m, tmp_path, t_end=end, **options).held == []


def tumbling():
    """Two bodies as one that is free: outputs follow from the six coordinates of the whole."""
    m = gm.Mechanism("tumbling", gravity=(0.0, 0.0, -9.81))
    body = m.body("body", mass=1.0, inertia=(0.02, 0.05, 0.06), angular_velocity=(0.3, 8.0, 0.1))
    other = m.body("other", mass=0.5, inertia=(0.01, 0.01, 0.02), position=(0.1, 0.2, 0.0))
    m.fixed("weld", body, other, at=(0.1, 0.0, 0.0))
    m.torque("drive", body, m.input("load", "N m", 0.1))
    return m, 2.0, {"tol": 1e-7}


@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("model", [pair, misaligned, bench, driven, tumbling])
def test_lumped_models(model, fixed, tmp_path):
    """With torques set on the way, and a state that another instance goes on from."""
    m, end, options = model()
    settings = {**options, "lump": True, "fixed_pivots": fixed}
    made = export(m, tmp_path, t_end=end, processor="native", outputs="all", **settings)
    assert not made.left_out
    assert gm.Simulator(m, end, **settings).begun().by_axes == (model in (pair, misaligned, driven))
    library = Library(made.library)
    instance, sim = Instance(library), gm.Simulator(m, end, **settings)
    loads = [name for name in made.numbers if "load" in name]
    points = 200
    for k, t in enumerate(np.linspace(0.0, end, points + 1)[1:-1].tolist()):
        if loads and k in (50, 51, 120):
            value = instance.number(loads[0]) * 1.1 + 0.1
            instance.set(loads[0], value)
            sim.set(loads[0], value)
        if k == 100:
            state = instance.save()
        instance.advance(t)
        sim.advance(t)
        np.testing.assert_array_equal(instance.unknowns()[0], sim._point.y)
        if k % 20 == 19 or k == 101:
            told = instance.outputs()
            wanted = [expected(m, sim, name) for name in library.output_names]
            np.testing.assert_array_equal(told, wanted)
        if k == 101:
            kept = told
    assert len({told.tobytes() for told in (told, kept)}) == 2
    other = Instance(library)
    other.restore(state)
    other.advance(np.linspace(0.0, end, points + 1)[102])
    np.testing.assert_array_equal(other.outputs(), kept)
