"""What a state leaves out: scratch of the equations, which each evaluation writes before it reads it."""

from __future__ import annotations

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.contacts import Box, Coulomb, Cylinder, HalfSpace, Impact
from gearmbs.studies.run.simulation import case_mechanism
from tests.mechanism.test_convex_contacts import ROLLERS
from tests.mechanism.test_own_forces import magnets
from tests.mechanism.test_stepping import PAIR, flexible_pair, planets, rolling_train, slider_crank, top


def pair():
    """The pair of the paper."""
    return case_mechanism(gm.Case()), PAIR


def misaligned():
    """With slices along its flanks, whose deflections are iterated for."""
    return case_mechanism(gm.Case(fault={"misalignment": "0.2 deg"})), PAIR


def rollers():
    """A cylinder and an ellipsoid on a box, with friction: closest points are searched for."""
    m = Mechanism("rollers", gravity=(0.0, 0.0, -9.81))
    law, grip = Impact(1e5, 1.5, 1e2, 1e-4), Coulomb(0.3, 0.3, 1e-2, 2e-2)
    for k, (solid, inertia) in enumerate(ROLLERS.values()):
        at = (0.0, 0.3 * k, 0.05)
        body = m.body(f"roller {k}", 2.0, inertia, position=at, velocity=(1, 0, 0), angular_velocity=(0, 18.0, 0))
        floor = Box((10, 2, 1), offset=(0, 0, -0.5)) if k < 2 else HalfSpace()
        m.contact(f"floor {k}", body.marker(), solid, m.ground.marker(), floor, law, grip)
    wheel = m.body("wheel", 1.0, (0.01, 0.01, 0.01), position=(0, -0.4, 0.12), velocity=(0.2, 0, 0))
    m.contact("fall", wheel.marker(), Cylinder(0.1, 0.1), m.ground.marker(), HalfSpace(), law, grip)
    return m, {}


def attracted():
    """A force of one's own."""
    return magnets(), {}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "end"),
    [
        (pair, 0.06),
        (misaligned, 0.03),
        (planets, 0.03),
        (rolling_train, 0.03),
        (flexible_pair, 0.06),
        (rollers, 0.5),
        (attracted, 1.0),
        (lambda: (slider_crank(), {}), 1.0),
        (lambda: (top(), {}), 1.0),
    ],
)
def test_nothing_is_read_that_a_state_leaves_out(model, end):
    """Gone on from a state with NaN in all scratch: bit for bit the same, points within steps and jumps, too."""
    m, options = model()
    sim = gm.Simulator(m, end, **options)
    for k in range(4):
        sim.advance(sim.t + 0.0437 * (k + 1) * end)
        state, times = sim.state(), np.linspace(sim.t, sim.t + 0.1 * end, 18)[1:]
        gone = []
        for poisoned in (False, True):
            sim.restore(state)
            if poisoned:
                run = sim._run.state
                run.work[:] = np.nan
                # and rows of the window that are not in use
                n, behind = run.y.size, run.newest + run.n_past
                run.window_y[: run.newest * n] = run.window_y[behind * n :] = np.nan
            points = []
            for t in times.tolist():
                sim.advance(t)
                points += [sim._point.y.copy(), sim._point.yp.copy()]
            gone.append(points)
        np.testing.assert_array_equal(*gone)
        # the table of integers that outputs go by is the one that the run goes by
        np.testing.assert_array_equal(sim._run.state.idata, sim._run.last_records.table)
