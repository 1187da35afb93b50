"""Rate scale and tolerance where nobody gives them: by the fastest mesh."""

import numpy as np
import pytest

from gearmbs.gears import GearPair, planetary, planetary_mechanism
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.solve.accuracy import JOINED, MESHING, TOLERANCE, chosen_accuracy, meshing_rate
from gearmbs.studies import Case
from gearmbs.studies.run.rig import flexible_rig, gear_rig
from gearmbs.studies.run.simulation import case_mechanism, simulate_case

SPAN = (0.0, 0.2)


def chosen(mechanism, tol=None, rate_scale=None):
    return chosen_accuracy(mechanism, SPAN, tol, rate_scale)


def test_the_scale_is_that_of_the_mesh_by_every_door():
    pair = GearPair.paper(backlash="0.1 mm")
    rig = {"speed": "1000 rpm", "torque": "100 N m"}
    mesh = 29 * 1000 * np.pi / 30
    assert chosen(gear_rig(pair, **rig)) == (MESHING, pytest.approx(mesh))
    # the wheels are on bodies that deform
    assert chosen(flexible_rig(pair, **rig)) == (JOINED, pytest.approx(mesh))
    # of a curve the highest speed
    curve = gear_rig(pair, speed=[("0 s", "300 rpm"), ("0.1 s", "1000 rpm")], torque="100 N m", run_up=0.02)
    assert chosen(curve)[1] == pytest.approx(mesh, rel=1e-2)


def test_planets_know_the_frequency_of_their_meshes():
    gears = planetary((24, 30, 84), "1.5 mm", 3)
    driven = planetary_mechanism(gears, speeds={"carrier": 10.0}, torques={"sun": "-11 N m"})
    # the ring is held: its teeth pass the carrier's planets at 84 times its speed, as those of the sun do
    assert chosen(driven) == (JOINED, pytest.approx(840.0))
    free = planetary_mechanism(gears, speeds={"carrier": 10.0}, torques={"sun": "-11 N m"}, held=None)
    assert chosen(free) == (TOLERANCE, 1.0)


def test_what_is_given_holds():
    m = gear_rig(GearPair.paper(backlash="0.1 mm"), speed="1000 rpm", torque="100 N m")
    assert chosen(m, 1e-9, 1.0) == (1e-9, 1.0)
    assert chosen(m, rate_scale=5.0) == (TOLERANCE, 5.0)
    assert chosen(m, 1e-5)[0] == 1e-5
    m.rate_scale = 200.0
    assert chosen(m) == (MESHING, 200.0)


def test_without_meshes_or_speeds_it_is_as_in_adams():
    assert chosen(Mechanism()) == (TOLERANCE, 1.0)
    m = Mechanism("turns")
    wheel = m.body("wheel", 1.0, (1.0, 1.0, 1.0))
    pin = m.revolute("pin", wheel, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.rotation("drive", pin, 30.0, level="velocity")
    assert chosen(m) == (TOLERANCE, 1.0)
    assert meshing_rate(m, *SPAN) == 0.0


def test_initial_speeds_and_speeds_given_by_motions_count():
    m = gear_rig(GearPair.paper(backlash="0.1 mm"), speed="1000 rpm", torque="100 N m")
    m.bodies["gear 2"].angular_velocity = (0.0, 0.0, -200.0)
    assert chosen(m)[1] == pytest.approx(29 * 200.0)


@pytest.mark.slow
def test_a_pair_takes_the_same_steps_by_mechanism_as_by_case():
    case = Case(operation={"duration": 0.01, "settling": 0.0, "run_up": 0.02})
    by_case = simulate_case(case, every_step=True)
    by_mechanism = case_mechanism(case).simulate(float(by_case.t[-1]), every_step=True)
    assert by_mechanism.stats.steps == pytest.approx(by_case.stats.steps, rel=1e-2)
