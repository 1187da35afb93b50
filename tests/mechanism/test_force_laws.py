"""Force laws written as formulas: derivatives by complex steps of the same formulas, energies, messages."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism, Wrench, choose, force_law
from gearmbs.mechanism.forces.laws import derive_law
from tests.says import says

STEP = 1e-30


@force_law
def magnet(i, j, strength):
    apart = i.origin - j.origin
    return Wrench(energy=-strength / np.sqrt(apart @ apart))


@force_law
def strut(i, j, t, creep, stiffness, damping, exponent=1.5):
    """A spring of any exponent along x of J and a dashpot in a row, that stiffens; a torque about what both see."""
    d = i.origin - j.origin
    stretch = d @ j.axes[:, 0] - creep
    force = stiffness * (1.0 + t) * stretch**exponent
    spin = np.cross(i.axes[:, 1], j.angular_velocity - i.angular_velocity)
    return Wrench(
        force=-force * j.axes[:, 0], torque=damping * spin + np.cross(d, i.velocity), rates={"creep": force / damping}
    )


@force_law
def tether(i, length, stiffness):
    """A rope from the ground's origin."""
    distance = np.sqrt(i.origin @ i.origin)
    slack = np.maximum(distance - length, 0.0)
    return Wrench(force=-stiffness * slack / distance * i.origin, energy=0.5 * stiffness * slack**2)


@force_law
def pad(i, j, stiffness, damping, thickness=0.02):
    """A pad on the plane z = 0 of J, thick as long as nothing touches, that does not pull."""
    z = j.axes[:, 2]
    d = i.origin - j.origin
    depth = np.maximum(thickness - d @ z, 0.0)
    rate = -(i.velocity - j.velocity - np.cross(j.angular_velocity, d)) @ z
    push = np.maximum(stiffness * depth**1.5 + damping * depth * rate, 0.0)
    return Wrench(force=push * z, energy=stiffness * depth**2.5 / 2.5)


LAWS = {
    "magnet": (magnet, 2, {"strength": 0.3}, ()),
    "strut": (strut, 2, {"stiffness": 40.0, "damping": 3.0, "exponent": 1.7}, ("creep",)),
}


def frames(number, seed):
    rng = np.random.default_rng(seed)
    axes = Rotation.random(number, random_state=seed).as_matrix()
    rows = [np.array([*rng.normal(size=3), *a.ravel(), *rng.normal(size=6)]) for a in axes]
    rows[0][:3] = rows[-1][:3] + 2.0 * axes[-1][:, 0]
    return np.array(rows, dtype=complex)


def varied(rows, column):
    """Return frames after a complex step along a variation [dP, dpi, dv, dw]."""
    new = rows.copy()
    frame, (kind, axis) = new[column // 12], divmod(column % 12, 3)
    if kind == 1:
        axes = frame[3:12].reshape(3, 3)
        frame[3:12] += 1j * STEP * np.cross(np.eye(3)[axis], axes, axisb=0, axisc=0).ravel()
    else:
        frame[{0: 0, 2: 12, 3: 15}[kind] + axis] += 1j * STEP
    return new


def evaluated(law, rows, numbers, states, t=0.4):
    """Return wrench and rates of a law called with numbers, not traced."""
    seen = [type("Seen", (), {"origin": r[:3], "axes": r[3:12].reshape(3, 3), "velocity": r[12:15],
                              "angular_velocity": r[15:]})() for r in rows]  # fmt: skip
    given = {**numbers, **states, "t": t}
    names = law.function.__code__.co_varnames[len(rows) : law.function.__code__.co_argcount]
    load = law(*seen, **{name: given[name] for name in names})
    return np.array([*load.force, *load.torque, *load.rates.values()])


def compared(found, exact):
    assert found == pytest.approx(exact, rel=1e-10, abs=1e-12 * np.abs(exact).max())


def test_derivatives_by_frames_states_and_parameters_are_exact():
    law, n, numbers, states = LAWS["strut"]
    made = derive_law("force 'x'", law, n, numbers, states)
    rows, own, values = frames(n, 1), np.array([0.3]), np.array(list(numbers.values()))
    wrench, rates, told, jac, by = np.zeros((1, 6)), np.zeros(1), np.zeros(2), np.zeros((7, 25)), np.zeros((7, 3))
    made.values(0.4, rows.real, own, values, wrench, rates, told)
    made.derivatives(0.4, rows.real, own, values, jac)
    made.by_parameters(0.4, rows.real, own, values, by)
    compared(np.concatenate([wrench[0], rates]), evaluated(law, rows, numbers, {"creep": 0.3}).real)
    for column in range(24):
        moved = evaluated(law, varied(rows, column), numbers, {"creep": 0.3})
        compared(jac[:, column], moved.imag / STEP)
    compared(jac[:, 24], evaluated(law, rows, numbers, {"creep": 0.3 + 1j * STEP}).imag / STEP)
    for k, name in enumerate(numbers):
        moved = evaluated(law, rows, {**numbers, name: numbers[name] + 1j * STEP}, {"creep": 0.3})
        compared(by[:, k], moved.imag / STEP)


def test_force_follows_from_the_energy():
    made = derive_law("force 'x'", magnet, 2, {"strength": 0.3}, ())
    rows, wrench, told = frames(2, 2).real, np.zeros((1, 6)), np.zeros(2)
    made.values(0.0, rows, np.zeros(0), np.array([0.3]), wrench, np.zeros(0), told)
    apart = rows[0, :3] - rows[1, :3]
    r = np.linalg.norm(apart)
    compared(wrench[0], np.array([*(-0.3 * apart / r**3), 0.0, 0.0, 0.0]))
    assert told == pytest.approx([-0.3 / r, 0.0], rel=1e-12, abs=1e-15)


def test_what_is_lost_follows_from_the_energy():
    """In contact the damper takes c d d'^2, whatever the frames do; away from the pad, nothing."""
    made = derive_law("force 'x'", pad, 2, {"stiffness": 1e4, "damping": 5e3}, ())
    rows, told = frames(2, 3).real, np.zeros(2)
    z = rows[1, 3:12].reshape(3, 3)[:, 2]
    for height, touches in ((0.015, True), (0.03, False)):
        rows[0, :3] = rows[1, :3] + height * z
        d = rows[0, :3] - rows[1, :3]
        rate = -(rows[0, 12:15] - rows[1, 12:15] - np.cross(rows[1, 15:], d)) @ z
        rows[0, 12:15] += (rate - 0.2) * z
        made.values(0.0, rows, np.zeros(0), np.array([1e4, 5e3, 0.02]), np.zeros((1, 6)), np.zeros(0), told)
        lost = 5e3 * 0.005 * 0.2**2 if touches else 0.0
        assert told == pytest.approx([1e4 * 0.005**2.5 / 2.5 * touches, lost], rel=1e-10, abs=1e-14)


@pytest.mark.slow
def test_energy_is_kept_in_a_run_and_parameters_have_names():
    m = Mechanism("swing", gravity=(0, 0, -9.81))
    bob = m.body("bob", mass=0.5, inertia=(1e-4, 1e-4, 1e-4), position=(0.6, 0, -0.2))
    rope = m.force("rope", tether, bob.marker(), parameters={"length": 0.5, "stiffness": 2e3})
    run = m.simulate(0.5, rate=200, tol=1e-7)
    assert abs(run.energy_balance().attrs["relative_imbalance"]) < 1e-4
    # one marker: pushed from the ground
    place = np.zeros((1, 18))
    place[0, 0] = 0.7
    assert rope.by_parameter("stiffness", place, np.zeros(0))[0] == pytest.approx(-0.2)
    assert rope.by_parameter("length", place, np.zeros(0))[0] == pytest.approx(2e3)
    with pytest.raises(ModelError, match=says("rope", "width", "stiffness")):
        rope.by_parameter("width", place, np.zeros(0))


def branching(i, j):
    return Wrench(force=i.origin if i.origin[0] > 0.0 else j.origin)


def refused_laws():
    yield branching, {}, (), says("pad", "branching", "choose")
    yield lambda i, j, c: Wrench(energy=c * i.origin[0]), {}, (), says("pad", "c", "missing")
    yield lambda i, j, c: Wrench(energy=c * i.origin[0]), {"c": 1.0, "d": 2.0}, (), says("pad", "d", "c")
    yield lambda i, j, c: Wrench(energy=c * i.origin[0]), [1.0], (), says("pad", "mapping")
    yield lambda i, j: 3.0, {}, (), says("pad", "float", "Wrench")
    yield lambda i, j: Wrench(), {}, (), says("pad", "energy", "force")
    yield lambda i, j: Wrench(force=[1.0, 2.0]), {}, (), says("pad", "force", "2", "three")
    yield lambda i, j, z: Wrench(force=z * i.origin), {}, ("z",), says("pad", "rates", "z")
    yield lambda i, j, z: Wrench(energy=z * i.origin[0], rates={"z": z}), {}, ("z",), says("pad", "algebraic", "energy")
    yield lambda i, j, t: Wrench(force=t * i.origin, rates={"t": t}), {}, ("t",), says("pad", "'t'", "name")
    yield lambda i, j: Wrench(energy=i.velocity @ i.velocity), {}, (), says("pad", "energy", "velocities", "masses")
    yield lambda i, j: Wrench(force=np.outer(i.origin, j.origin)), {}, (), says("pad", "force", "(3, 3)", "three")
    yield lambda i, j: Wrench(force=["1 N", 0, 0]), {}, (), says("pad", "force", "1 N", "number")
    yield lambda i, j: Wrench(energy=np.minimum(i.origin[0], np.nan)), {}, (), says("pad", "nan")
    yield (
        lambda i, j: Wrench(force=i.origin * sum(np.sin(k * i.origin[0]) for k in range(1500))),
        {},
        (),
        says("pad", "operations", "parts", "kernel"),
    )


@pytest.mark.parametrize(("function", "numbers", "states", "message"), list(refused_laws()))
def test_what_cannot_be_a_law_is_said(function, numbers, states, message):
    with pytest.raises(ModelError, match=message):
        derive_law("force 'pad'", force_law(function), 2, numbers, states, len(states))


def test_three_markers_and_what_a_law_brings_along_are_refused():
    m = Mechanism("three")
    markers = [m.body(name, mass=1.0, inertia=(1, 1, 1)).marker() for name in "abc"]
    with pytest.raises(ModelError, match=says("far", "3", "kernel")):
        m.force("far", magnet, *markers, parameters={"strength": 1.0})
    with pytest.raises(ModelError, match=says("far", "diagnostics", "law")):
        m.force("far", magnet, *markers[:2], parameters={"strength": 1.0}, diagnostics=["energy"])
    m.body("d", mass=1.0, inertia=(1, 1, 1))
    kernel = m.force("kernel", lambda t, f, z, p, w, r, d: None, markers[0], markers[1])
    with pytest.raises(ModelError, match=says("kernel", "force_law")):
        kernel.by_parameter("strength", np.zeros((2, 18)), np.zeros(0))


def test_names_of_a_law_are_its_own_and_a_mechanism_with_one_travels():
    """Parameters that have the names of what kernels take, and copies in other processes."""

    def law(i, frames, wrench=2.0):
        return Wrench(energy=0.5 * frames * wrench * (i.origin @ i.origin))

    m = Mechanism("one")
    body = m.body("b", mass=1.0, inertia=(1, 1, 1), position=(1, 0, 0))
    made = m.force("pull", force_law(law), body.marker(), parameters={"frames": 3.0})
    place = np.zeros((1, 18))
    place[0, 0] = 0.5
    for element in (made, copy.deepcopy(m).elements["pull"], pickle.loads(pickle.dumps(m)).elements["pull"]):
        wrench = np.zeros((1, 6))
        element.function(0.0, place, np.zeros(0), element.parameters, wrench, np.zeros(0), np.zeros(2))
        assert wrench[0] == pytest.approx([-3.0, 0, 0, 0, 0, 0], rel=1e-14)
        assert element.by_parameter("wrench", place)[0] == pytest.approx(-1.5)


def test_derivatives_by_parameters_at_the_edge_of_slack():
    """Where a base is a literal zero that is chosen: nothing changes, and Python's division by zero is not met."""

    def law(i, k, e=0.8):
        x = i.origin[0]
        return Wrench(force=[-k * np.maximum(np.maximum(x, 0.0) + np.minimum(-x, 0.0), 0.0) ** e, 0.0, 0.0])

    made = derive_law("force 'x'", force_law(law), 1, {"k": 3.0}, ())
    out, place = np.zeros((6, 2)), np.zeros((1, 18))
    for x in (-0.1, 0.0):
        place[0, 0] = x
        with np.errstate(all="ignore"):
            made.by_parameters(0.0, place, np.zeros(0), np.array([3.0, 0.8]), out)
        assert not out.any()


def test_numbers_may_be_chosen_without_tracing():
    assert choose(2.0, 1.0, "a", "b") == "a"
