"""Inputs that are set, led and controlled, turns that are counted or not, and states of all simulators, together."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.drivetrain import RollingContactBearing, Shaft, Wheel
from gearmbs.gears import GearSpec
from gearmbs.mechanism import Mechanism
from tests.drivetrain.support import stage

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


def flexible_train():
    """A stage whose shafts bend and stand in ball bearings."""
    shafts = [Shaft(name=name, length="100 mm", radius="15 mm", modes=2) for name in ("in", "out")]
    bearings = [
        RollingContactBearing(name=f"{name} {x}", shaft=name, station=1e-3 * x, rolling="6206", settings={})
        for name in ("in", "out")
        for x in (20, 80)
    ]
    wheels = [
        Wheel(name=name, shaft=shaft, station="50 mm", gear=GearSpec(teeth, "3 mm", name=name))
        for name, shaft, teeth in (("pinion", "in", 20), ("gear", "out", 60))
    ]
    train = stage(shafts=shafts, bearings=bearings, wheels=wheels, run_up=0.005)
    return train.build(), {"tol": 1e-5, "rate_scale": train.rate_scale}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:shaft")
def test_flexible_shafts_on_rolling_bearings_go_on_bit_for_bit(tmp_path):
    """Points of one run, back to the middle, and on from a file in a simulator of another mechanism like it."""
    m, options = flexible_train()
    times = np.linspace(0.0, 1e-3, 21)
    one = m.simulate(times[-1], t_eval=times, **options)
    sim = gm.Simulator(m, times[-1], **options)
    for t in times[1:11]:
        sim.advance(t)
    state = sim.state()
    read = gm.State.load(state.save(tmp_path / "half.npz"))
    others = [sim, gm.Simulator(flexible_train()[0], times[-1], initial=read, **options)]
    for t in times[11:]:
        sim.advance(t)
    sim.restore(state)
    for other in others:
        for t in times[11:]:
            other.advance(t)
        np.testing.assert_array_equal(other.solution().result.y[-10:], one.result.y[11:])
    np.testing.assert_array_equal(sim.solution().result.y, one.result.y)


def test_a_simulator_made_with_a_state_counts_on():
    """Of a free shaft, whose turns nothing in the model counts, as far as the first one has been asked for them."""
    m = machine()
    first = gm.Simulator(m, 1.0)
    for k in range(1, 61):
        first.advance(k * 5e-3)
        before = [first.get("joint_angle", "free pin"), first.get("output", "turned")]
    other = gm.Simulator(m, 1.0, initial=first.state())
    assert abs(before[0]) > 4.0 * np.pi
    for sim in (first, other):
        assert [sim.get("joint_angle", "free pin"), sim.get("output", "turned")] == pytest.approx(before, abs=1e-12)
        sim.advance(0.305)
    after = [[sim.get("joint_angle", "free pin"), sim.get("output", "turned")] for sim in (first, other)]
    assert after[0] == pytest.approx(after[1], abs=1e-9)
