"""What a simulator tells at a point is what a solution tells there: rows do not depend on those before them."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.studies.run.simulation import case_mechanism
from tests.mechanism.agreement import add_outputs_of_all_kinds, assert_all_names_agree
from tests.mechanism.test_stepping import PAIR, flexible_pair, planets, rolling_train, slider_crank


def controlled():
    """A slider crank whose crank a controller turns, each 7 ms."""
    m = slider_crank()
    m.torque("push", m.bodies["crank"], m.input("push", "N m"), axis=(0, 0, 1))
    m.output("force", ("reaction_force", "pin", "x"))
    m.output("way", "DX(guide.I, guide.J) + push")
    return m


def pair(formulation):
    """The pair of the paper with all its bodies."""
    return case_mechanism(gm.Case()), 0.005, {"formulation": formulation, "lump": False, **PAIR}


def planetary(formulation):
    """A planetary set, of which the constraints turn with the carrier."""
    return planets()[0], 0.02, {"formulation": formulation, "tol": 1e-5}


def crank(formulation):
    """A loose run, which leaves its constraints by 1e-5 rad/s."""
    return controlled(), 0.2, {"formulation": formulation, "tol": 1e-4}


def rolling(formulation):
    """A drivetrain with rolling bearings."""
    m, options = rolling_train()
    return m, 0.001, {"formulation": formulation, **options}


@pytest.mark.filterwarnings("ignore:GearPair", "ignore:shaft 'in'")
@pytest.mark.parametrize("formulation", ["SI2", "I3"])
@pytest.mark.parametrize("model", [pair, planetary, crank, rolling])
@pytest.mark.slow
def test_every_name_at_a_point_is_that_of_the_solution(model, formulation):
    m, end, options = model(formulation)
    if model is not crank:
        # by the name of an output, too
        assert len(add_outputs_of_all_kinds(m)) > 30
    times = np.linspace(0.0, end, 42)
    sim, ahead = (gm.Simulator(m, end, **options) for _ in range(2))
    if "push" in m.elements:
        for each in (sim, ahead):
            each.control("push", lambda t, s: 2.0 - 0.2 * s.get("joint_angle", "main"), 7e-3)
    for t in times[1:]:
        ahead.advance(t)
    solution = ahead.solution()
    for k, t in enumerate(times[1:], start=1):
        sim.advance(t)
        if k in (1, 17, 30):
            told = assert_all_names_agree(m, sim, solution, k)
            assert told["com_acceleration"] == len(m.bodies)
            assert told["output"] == len(m.outputs)


@pytest.mark.filterwarnings("ignore:shaft", "ignore:teeth run")
@pytest.mark.slow
def test_a_plant_tells_of_a_body_that_deforms_what_a_simulator_tells():
    """Its frame, and not the material at its centre, which a torque there turns the other way in the first moment."""
    m, options = flexible_pair()
    wheel = m.bodies["shaft 2"]
    m.torque("push", wheel, m.input("push", "N m"))
    wheel.marker(wheel.com, name="middle")
    m.output("speed", ("angular_velocity", "shaft 2", "z"))
    m.output("place", ("com_position", "shaft 2", "y"))
    sim = gm.Simulator(m, 3e-3, **{**options, "tol": 1e-9})
    sim.advance(2e-3)
    state, told = sim.state(), {}
    plant = m.linearize(["push"], ["speed", "place", "WZ(middle)"], at=state)
    assert isinstance(sim.get("output", "speed"), float)
    assert plant.point.outputs[:2] == pytest.approx([sim.get("output", name) for name in ("speed", "place")])
    for push in (-1.0, 1.0):
        sim.restore(state)
        sim.set("push", push)
        sim.advance(2e-3 + 2e-6)
        told[push] = sim.get("output", "speed")
    first = (plant.C @ plant.B)[:, 0]
    assert (told[1.0] - told[-1.0]) / 4e-6 == pytest.approx(first[0], rel=1e-4)
    assert first[0] * first[2] < 0.0


@pytest.mark.filterwarnings("ignore:crank")
def test_a_plant_takes_the_outputs_by_name():
    m, end, options = crank("SI2")
    sim = gm.Simulator(m, end, **{**options, "tol": 1e-8})
    sim.advance(0.1)
    plant = m.linearize(["push"], list(m.outputs), at=sim.state())
    assert plant.outputs == ["force", "way"]
    assert plant.point.outputs == pytest.approx([sim.get("output", name) for name in m.outputs], rel=1e-6)
