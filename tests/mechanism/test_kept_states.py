"""States that a run keeps on its way, and runs that take the equations of an earlier one."""

import numpy as np
import pytest

from gearmbs.dae.problem import ModelError
from gearmbs.studies import Case, case_mechanism
from tests.says import says

CASE = Case(operation={"run_up": 0.004, "settling": 0.0, "duration": 0.02, "speed": "1000 rpm", "torque": 50.0})
SETTINGS = {"tol": 1e-8, "rate_scale": 3000.0}


def streamed(mechanism, t_end, **options):
    """Return the times of the steps of a run whose steps are handed on, and its solution."""
    times = []
    found = mechanism.simulate(
        t_end, every_step=True, consumer=lambda part: times.extend(part.t.tolist()), **SETTINGS, **options
    )
    return np.array(times), found


@pytest.mark.parametrize("lump", [True, False])
def test_a_kept_state_changes_no_step_and_leads_to_the_same_end(lump):
    mechanism = case_mechanism(CASE)
    plain, end = streamed(mechanism, 0.01, lump=lump)
    times, found = streamed(mechanism, 0.01, lump=lump, keep_at=0.005)
    np.testing.assert_array_equal(times, plain)
    np.testing.assert_array_equal(found.result.y, end.result.y)
    kept = found.result.kept
    # the end of the first step there
    assert kept.t == times[times >= 0.005][0]
    assert end.result.kept is None
    again = mechanism.simulate(0.01, t_eval=[0.01], initial=found.state_at(kept.t), lump=lump, **SETTINGS)
    told = again.angular_velocity("gear 2")[-1]
    reference = mechanism.simulate(0.01, t_eval=[0.0, 0.01], lump=lump, **SETTINGS).angular_velocity("gear 2")[-1]
    np.testing.assert_allclose(told, reference, atol=1e-5 * np.abs(reference).max())
    assert len(kept.y) == found.problem.n


def test_a_run_pauses_as_without_a_state_that_is_kept():
    mechanism, seen = case_mechanism(CASE), {}

    def run(**options):
        pauses = []

        def pause(t):
            pauses.append(t)
            return None if t > 0.008 else t + 0.003

        _, found = streamed(mechanism, 0.01, lump=True, pause=pause, **options)
        return pauses, found

    seen["plain"], _ = run()
    seen["kept"], found = run(keep_at=0.0045)
    assert seen["plain"] == seen["kept"]
    assert found.result.kept.t < 0.006
    # the run ends before
    assert run(keep_at=1.0)[1].result.kept is None


@pytest.mark.parametrize("lump", [True, False])
def test_equations_of_an_earlier_run_are_the_same(lump):
    mechanism = case_mechanism(CASE)
    _, first = streamed(mechanism, 0.006, lump=lump, keep_at=0.005)
    state = first.state_at(first.result.kept.t)
    one, two = (
        mechanism.simulate(0.008, t_eval=[0.008], initial=state, lump=lump, **SETTINGS, **options)
        for options in ({}, {"assembled": first})
    )
    np.testing.assert_array_equal(one.result.y, two.result.y)
    np.testing.assert_array_equal(one.contact("mesh")["normal_force"], two.contact("mesh")["normal_force"])
    with pytest.raises(ModelError, match=says("assembled", "in a state")):
        mechanism.simulate(0.01, assembled=two, lump=lump, **SETTINGS)


def test_equations_of_another_mechanism_or_set_up_otherwise_are_refused():
    mechanism = case_mechanism(CASE)
    _, first = streamed(mechanism, 0.002, lump=False)
    with pytest.raises(ModelError, match=says("assembled", "another mechanism")):
        case_mechanism(CASE.changed(operation={"torque": 100.0})).simulate(
            0.002, assembled=first, lump=False, **SETTINGS
        )
    for name, value in {"formulation": "SI1", "rate_scale": 1000.0, "lump": True}.items():
        with pytest.raises(ModelError, match=says("assembled", name)):
            mechanism.simulate(0.002, assembled=first, **{**SETTINGS, "lump": False, name: value})
    again = mechanism.simulate(0.002, every_step=True, assembled=first, lump=False, **SETTINGS)
    np.testing.assert_array_equal(again.result.y[-1], first.result.y[-1])


@pytest.mark.parametrize("lump", [True, False])
def test_a_state_is_one_of_wheels_with_other_slices_too(lump):
    """Slices are a number in the tables: unknowns and places are the same."""
    tilted = CASE.changed(fault={"misalignment": "0.5 deg"})
    _, first = streamed(case_mechanism(tilted.changed(contact={"slices": 9})), 0.006, lump=lump, keep_at=0.005)
    other = case_mechanism(tilted.changed(contact={"slices": 5}))
    state = first.state_at(first.result.kept.t)
    found = other.simulate(0.008, t_eval=[0.008], initial=state, lump=lump, **SETTINGS)
    straight = other.simulate(0.008, t_eval=[0.0, 0.008], lump=lump, **SETTINGS)
    speed = straight.angular_velocity("gear 2")[-1]
    np.testing.assert_allclose(found.angular_velocity("gear 2")[-1], speed, atol=1e-3 * np.abs(speed).max())
