"""Joint friction from its definition, against complex steps of the law as it is written."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.mechanism.forces.joint_friction import NAMES, PIN, REALS
from gearmbs.mechanism.forces.joint_friction import definitions as law
from tests.says import says

STEP = 1e-30
LENGTHS = {"pin_radius": 0.03, "friction_arm": 0.02, "bending_arm": 0.07}
OVERLAP = {"overlap": 0.4, "overlap_change": "increasing"}
CASES = {
    "revolute": LENGTHS,
    "universal": {**LENGTHS, "yoke": "i"},
    "translational": {**OVERLAP, "reaction_arm": 0.05, "max_force": 1.7},
    "cylindrical": {**OVERLAP, "pin_radius": 0.03, "max_torque": 0.01},
    "spherical": {"ball_radius": 0.03, "max_torque": 0.02},
}
SPEEDS = {"stuck": 3e-5, "falling": 1.2e-3, "sliding": 3e-2}


def element(kind: str, deformation: float):
    m = Mechanism("joint")
    body = m.body("b", mass=1.0, inertia=(1, 1, 1))
    across = Rotation.from_euler("x", 90 if kind == "universal" else 0, degrees=True).as_matrix()
    joint = m.joint(kind, "joint", body.marker(orientation=across), m.ground.marker())
    return m.friction(
        "friction", joint, 0.4, 0.3, max_stiction_deformation=deformation, preload_force=2.0, preload_torque=0.1,
        **CASES[kind],
    )[0]  # fmt: skip


def state(speed: float, seed: int, found):
    """Return frames, deformations and a reaction at which the joint slips with about this speed."""
    rng = np.random.default_rng(seed)
    rows = np.zeros((2, 18), dtype=complex)
    axes = Rotation.random(random_state=seed).as_matrix()
    rows[0, 3:12] = (Rotation.from_rotvec((0.1, -0.2, 0.3)).as_matrix() @ axes).ravel()
    rows[1, 3:12] = axes.ravel()
    rows[:, :3] = rng.normal(scale=0.05, size=(2, 3))
    rows[0, 12:15], rows[0, 15:18] = speed * rng.normal(size=3), 30.0 * speed * rng.normal(size=3)
    states = rng.normal(scale=4e-6, size=len(found.states)).astype(complex)
    reaction = np.concatenate([rng.normal(scale=3.0, size=3), rng.normal(scale=0.2, size=3)]).astype(complex)
    return rows, states, reaction


class Seen(SimpleNamespace):
    """A frame of numbers."""

    def __init__(self, row):
        super().__init__(origin=row[:3], axes=row[3:12].reshape(3, 3).T, v=row[12:15], w=row[15:18])

    def minus(self, other):
        return self.origin - other.origin, self.v - other.v, self.w - other.w


def by_definition(found, numbers, rows, states, reaction):
    """Return wrench and rates by the law as it is written, of complex numbers."""
    name = found.compiled().kernel.py_func.__name__.removesuffix("_friction")
    kind, p = NAMES.index(name), dict(zip(REALS, numbers))
    own = found.compiled().integers[0] if kind == PIN else 1
    frames = [Seen(rows[own]), Seen(rows[1 - own])] if kind == PIN else [Seen(row) for row in rows]
    pressing, slips = law.seen(kind, frames, 1.0 - 2.0 * own, reaction, p)
    loads, rates = law.loads(pressing, slips, list(states), p)
    wrench = np.zeros(6, dtype=complex)
    for k, load in enumerate(loads):
        first = 0 if name == "slide" or (name == "cylinder" and k == 0) else 3
        wrench[first : first + 3] += load * rows[own, 3:12].reshape(3, 3)[:, k if name == "ball" else 2]
    return np.array([*wrench, *rates])


def moved(rows, states, reaction, column):
    """Return the arguments after a complex step along a column of the Jacobian."""
    rows, given = rows.copy(), np.concatenate([states, reaction])
    if column >= 24:
        given[column - 24] += 1j * STEP
        return rows, given[: len(states)], given[len(states) :]
    row, (what, axis) = rows[column // 12], divmod(column % 12, 3)
    if what == 1:
        axes = row[3:12].reshape(3, 3)
        row[3:12] += 1j * STEP * np.cross(np.eye(3)[axis], axes, axisb=0, axisc=0).ravel()
    else:
        row[{0: 0, 2: 12, 3: 15}[what] + axis] += 1j * STEP
    return rows, states, reaction


@pytest.mark.parametrize("deformation", [0.0, 1e-5], ids=["creeping", "sticking"])
@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("kind", CASES)
def test_forces_and_all_derivatives(kind, speed, deformation):
    found = element(kind, deformation)
    made = found.compiled()
    numbers = np.array(made.reals)
    for seed in (1, 2, 3):
        rows, states, reaction = state(SPEEDS[speed], seed, found)
        n = len(states)
        wrench, rates, jac = np.zeros((1, 6)), np.zeros(n), np.zeros((6 + n, 30 + n))
        made.kernel(
            np.array(made.integers), numbers, 0.0, rows.real.copy(), states.real.copy(), reaction.real.copy(), 1,
            np.zeros(made.scratch), wrench, rates, jac, np.zeros(0),
        )  # fmt: skip
        value = by_definition(found, numbers, rows, states, reaction).real
        assert [*wrench[0], *rates] == pytest.approx(value, rel=1e-12, abs=1e-12 * np.abs(value).max())
        slopes = np.array([
            by_definition(found, numbers, *moved(rows, states, reaction, q)).imag / STEP for q in range(30 + n)
        ]).T  # fmt: skip
        assert jac == pytest.approx(slopes, rel=1e-10, abs=1e-12 * np.abs(slopes).max())


@pytest.mark.parametrize("deformation", [0.0, 1e-5], ids=["creeping", "sticking"])
@pytest.mark.parametrize("kind", CASES)
def test_derivatives_by_every_number(kind, deformation):
    found, moving, always = (
        element(kind, deformation),
        set(),
        {"mu_static", "mu_dynamic", "stiction_transition_velocity"},
    )
    for seed, speed in ((1, 3e-5), (2, 1.2e-3), (3, 3e-2)):
        rows, states, reaction = state(speed, seed, found)
        for name in (*always, *(name for name, value in CASES[kind].items() if isinstance(value, float))):
            own = replace(found.friction, **{name: getattr(found.friction, name) + 1j * STEP})
            expected = by_definition(found, found._numbers(own), rows, states, reaction).imag / STEP
            exact = found.by_parameter(name, rows.real.copy(), states.real, reaction.real)
            assert exact == pytest.approx(expected, rel=1e-10, abs=1e-12 * max(1.0, np.abs(expected).max()))
            if np.abs(exact).max() > 0.0:
                moving.add(name)
    assert always <= moving
    with pytest.raises(ModelError, match=says("friction", "radius", "mu_static")):
        found.by_parameter("radius", rows.real.copy(), states.real, reaction.real)
