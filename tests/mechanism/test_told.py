"""What a simulator tells at a point is what a solution tells there: rows do not depend on those before them."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.studies.run.simulation import case_mechanism
from tests.mechanism.agreement import assert_all_names_agree
from tests.mechanism.test_stepping import PAIR, planets, rolling_train, slider_crank


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
def test_every_name_at_a_point_is_that_of_the_solution(model, formulation):
    m, end, options = model(formulation)
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
