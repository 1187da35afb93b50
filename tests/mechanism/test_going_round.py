"""Inputs that are set, led and controlled, turns that are counted or not, and states of all simulators, together."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism

PERIOD, POINTS = 1e-3, 60
ANGLES = ("wound", "driven", "free")


def machine():
    """A disc whose turns a spring counts, one that a motion drives at a speed that is set, and a free one."""
    m = Mechanism("machine")
    for k, (name, speed) in enumerate(zip(ANGLES, (90.0, 100.0, -300.0), strict=True)):
        disc = m.body(name, 1.0, (1.0, 1.0, 0.5), position=(0, 0, 0.1 * k), angular_velocity=(0, 0, speed))
        m.revolute(name + " pin", disc, m.ground, axis=(0, 0, 1))
    wound, driven = (m.joints[name + " pin"] for name in ANGLES[:2])
    m.torsion_spring("coil", wound.i, wound.j, stiffness=20.0, damping=0.01)
    m.rotation("drive", driven, m.input("speed", "rad/s", 100.0), level="velocity")
    m.torque("load", m.bodies["wound"], m.input("load", "N m"))
    m.torque("push", m.bodies["free"], m.input("push", "N m"))
    m.torsion_spring("link", m.bodies["free"].marker(name="a"), m.bodies["driven"].marker(name="b"), stiffness=0.0,
                     damping=0.02)  # fmt: skip
    m.output("turned", 'AZ("free pin.I", "free pin.J") + AZ("wound pin.I", "wound pin.J")')
    return m


class Hold:
    """A controller that looks at angles which springs and motions count, and remembers."""

    def __init__(self):
        self.sum = 0.0

    def __call__(self, t, sim):
        self.sum += 1e-3 * (sim.get("joint_angle", "wound pin") + sim.get("joint_angle", "driven pin"))
        return 5.0 * np.sin(300.0 * t) - 0.02 * self.sum

    def state(self):
        return [self.sum]

    def restore(self, numbers):
        (self.sum,) = numbers


def made(m, integrator, **options):
    sim = gm.Simulator(m, 1.0, integrator=integrator, tol=1e-7, **options)
    sim.control("push", Hold(), sample_time=7e-4)
    return sim


def act(sim, k):
    """Set what is set before point k: held and led loads, at times the speed and the spring, and go there."""
    if k % 5 != 4:
        sim.set("load", 30.0 * np.cos(1.7 * k), hold=int(k % 3 == 1))
    if k % 20 == 13:
        sim.set("speed", 100.0 + k)
    if k % 15 == 7:
        sim.set("coil.stiffness", 20.0 + 0.1 * k)
    sim.advance((k + 1) * PERIOD, record=k % 4 != 2)


def told(sim):
    names = [name for name in sim.unknowns if not name.startswith("mu")]
    angles = [sim.get("joint_angle", name + " pin") for name in ANGLES]
    return np.array([*(sim.get("unknown", name) for name in names), *angles, sim.get("output", "turned")])


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF"])
def test_states_go_on_in_any_simulator_whatever_is_set_and_counted(integrator, tmp_path):
    """Back in the same one, on in another that has been elsewhere, in a new one and from a file: the same again."""
    m = machine()
    first = made(m, integrator)
    states, wanted = [], []
    for k in range(POINTS):
        act(first, k)
        wanted.append(told(first))
        states.append(first.state())
    # in turns: 90 rad/s and a spring, 100 rad/s and more, -300 rad/s and what brakes it
    assert [abs(angle) > 0.6 for angle in wanted[-1][-4:-1]] == [True, True, True]
    assert wanted[-1][-2] < -15.0
    other = made(m, integrator)
    rng = np.random.default_rng(3)
    for k in rng.choice(POINTS - 4, 9, replace=False).tolist():
        read = gm.State.load(states[k].save(tmp_path / f"{k}.npz"))
        for sim, state in ((first, states[k]), (other, states[k]), (made(m, integrator, initial=read), None)):
            if state is not None:
                sim.restore(state)
            for later in range(k + 1, k + 4):
                act(sim, later)
                found = told(sim)
                np.testing.assert_array_equal(found[:-4], wanted[later][:-4])
                if state is not None:
                    np.testing.assert_allclose(found[-4:], wanted[later][-4:], atol=1e-9)
                else:
                    # turns that nothing in the model counts begin anew
                    np.testing.assert_allclose(found[-4:-2], wanted[later][-4:-2], atol=1e-6)
