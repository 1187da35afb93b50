"""What is read of the integrator's own steps against the same evaluated anew, which is right to rounding."""

import numpy as np
import pytest

from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.studies import Case, simulate_case
from gearmbs.studies.run.recorder import WATCHED
from gearmbs.studies.run.simulation import case_mechanism
from tests.says import says

SHORT = {"run_up": 0.004, "settling": 0.001, "duration": 0.003}
MESH = ("diagnostics", "mesh")


def taken(part):
    """Return copies of what a record watches, by method and name."""
    found = {key: getattr(part, key[0])(key[1]) for key in WATCHED}
    return {
        key: np.stack([*one.values()], axis=1) if isinstance(one, dict) else one.copy() for key, one in found.items()
    }


def read_and_evaluated(case, mechanism=None):
    """Return what parts told and what is evaluated at the same steps, and which of it was read."""
    parts, read = [], set()

    def take(part):
        read.update(part.at_steps)
        parts.append(taken(part))

    simulate_case(case, every_step=True, mechanism=mechanism, consumer=take, watch=WATCHED)
    whole = taken(simulate_case(case, every_step=True, mechanism=mechanism))
    return {key: np.concatenate([part[key] for part in parts]) for key in WATCHED}, whole, read


@pytest.mark.slow
@pytest.mark.parametrize("lump", [False, True], ids=["all bodies", "angles alone"])
@pytest.mark.parametrize("misalignment", ["0 deg", "1 deg"])
def test_a_pair_is_read(lump, misalignment):
    off = []
    for tolerance in (1e-6, 1e-7):
        solver = {"lump": lump, "tolerance": tolerance}
        case = Case(operation=SHORT, fault={"misalignment": misalignment}, solver=solver)
        read, right, keys = read_and_evaluated(case)
        assert keys == set(WATCHED)
        for key in WATCHED:
            if key[0] == "orientation":
                # outputs that are evaluated are moved onto the constraints first
                np.testing.assert_allclose(read[key], right[key], atol=tolerance)
        error = [np.abs(read[key] - right[key]).max(axis=0) / np.abs(right[key]).max(initial=1e-300) for key in WATCHED]
        off.append([error[0].max(), error[1].max(), (np.abs(read[MESH] - right[MESH]).mean(axis=0))[3]])
    # forces to a thousandth, penetrations to tenths of a tolerance; both with the tolerance
    assert max(off[1][:2]) < 2e-3
    assert off[1][2] < 1e-8
    assert all(fine < 0.5 * coarse for coarse, fine in zip(*off))


@pytest.mark.slow
def test_what_is_not_at_hand_is_evaluated():
    """Bearings among bodies that are lumped but do not turn about fixed axes; a wheel off its axis; another method."""
    case = Case(operation=SHORT, solver={"lump": True})
    rolling = case_mechanism(case, "6206/CN")
    read, right, keys = read_and_evaluated(case, rolling)
    assert keys == {MESH, *(key for key in WATCHED if key[0] == "orientation")}
    for key in set(WATCHED) - keys:
        np.testing.assert_array_equal(read[key], right[key])
    for key in keys - {MESH}:
        np.testing.assert_allclose(read[key], right[key], atol=case.tolerance)
    heavy = case_mechanism(case)
    heavy.bodies["gear 2"].com[:] = (0.001, 0.0, 0.0)
    read, right, keys = read_and_evaluated(case, heavy)
    assert set(WATCHED) - keys == {("reaction_force", "seat 2")}
    np.testing.assert_array_equal(read["reaction_force", "seat 2"], right["reaction_force", "seat 2"])
    _, _, keys = read_and_evaluated(Case(operation=SHORT, solver={"formulation": "I3"}))
    assert not keys & {("reaction_force", "seat 1")}


def pendulum():
    m = Mechanism("pendulum", gravity=(0.0, 0.0, -9.81))
    bob = m.body("bob", 1.0, (0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0))
    m.revolute("pin", bob, m.ground, at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0))
    return m


def test_a_pendulum_is_read():
    parts = []

    def take(part):
        assert ("reaction_force", "pin") in part.at_steps
        parts.append((part.reaction_force("pin").copy(), part.orientation("bob").copy()))

    watch = [("reaction_force", "pin"), ("orientation", "bob"), ("diagnostics", "nothing")]
    pendulum().simulate(1.0, tol=1e-8, every_step=True, consumer=take, watch=watch)
    force, turned = (np.concatenate(part) for part in zip(*parts, strict=True))
    right = pendulum().simulate(1.0, tol=1e-8, every_step=True)
    # multipliers of a step are off by its error, which the rates of velocities have divided by the step
    np.testing.assert_allclose(force[50:], right.reaction_force("pin")[50:], atol=2e-3)
    np.testing.assert_allclose(turned, right.orientation("bob"), atol=1e-12)


def test_what_cannot_be_watched_is_refused():
    with pytest.raises(ModelError, match=says("watch", "give consumer=")):
        pendulum().simulate(1.0, watch=[("reaction_force", "pin")])
    with pytest.raises(ModelError, match=says("watch", "com_position", "reaction_force")):
        pendulum().simulate(1.0, every_step=True, consumer=print, watch=[("com_position", "bob")])


def test_a_run_tells_where_its_processor_time_went():
    parts = []
    solution = pendulum().simulate(1.0, tol=1e-8, every_step=True, consumer=lambda part: parts.append(part.t.size))
    assert list(solution.stats.processor_times) == ["steps", "pivots", "consumer"]
    assert all(seconds >= 0.0 for seconds in solution.stats.processor_times.values())
    assert sum(parts) == solution.stats.steps + 1


def turning(about):
    """A weight askew on a rotor that turns about a point, or about an axis, and a stand askew on the ground."""
    m = Mechanism("rotor")
    rotor = m.body("rotor", 1.0, (0.1, 0.2, 0.3), position=(0.2, 0.0, 0.0), angular_velocity=(0.0, 0.0, 5.0))
    weight = m.body(
        "weight", 0.5, (0.1, 0.1, 0.1), position=(0.3, 0.0, 0.0), orientation=(0.3, 0.4, 0.5),
        angular_velocity=(0.0, 0.0, 5.0),
    )  # fmt: skip
    stand = m.body("stand", 1.0, (0.1, 0.1, 0.1), orientation=(0.1, 0.7, 0.2))
    m.fixed("on the rotor", weight, rotor, at=(0.25, 0.0, 0.0))
    m.fixed("on the ground", stand, m.ground, at=(0.0, 0.0, 0.0))
    if about == "a point":
        m.spherical("pivot", rotor, m.ground, at=(0.0, 0.0, 0.0))
        return m
    pivot = m.revolute("pivot", rotor, m.ground, at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
    if about == "a driven axis":
        m.rotation("drive", pivot, "5*TIME + 0.1*SIN(3*TIME)")
    return m


@pytest.mark.parametrize("about", ["a point", "an axis", "a driven axis"])
@pytest.mark.parametrize("lump", [False, True], ids=["all bodies", "lumped"])
def test_bodies_that_turn_are_read(about, lump):
    watch = [(method, body) for method in ("orientation", "angular_velocity") for body in ("rotor", "weight", "stand")]
    parts = []

    def take(part):
        assert part.at_steps.keys() == set(watch)
        parts.append([getattr(part, method)(body).copy() for method, body in watch])

    settings = {"tol": 1e-8, "every_step": True, "lump": lump}
    turning(about).simulate(0.1, consumer=take, watch=watch, **settings)
    right = turning(about).simulate(0.1, **settings)
    for key, *read in zip(watch, *parts, strict=True):
        # outputs that are evaluated are moved onto the constraints first
        np.testing.assert_allclose(np.concatenate(read), getattr(right, key[0])(key[1]), atol=1e-7)
