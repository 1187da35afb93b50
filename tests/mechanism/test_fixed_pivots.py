"""With `fixed_pivots` the last digit depends neither on where outputs have been looked at nor on what a run has met."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.dae.integrators.driver import Run
from gearmbs.dae.model.evaluator import Evaluator
from gearmbs.mechanism import ModelError
from gearmbs.studies.run.simulation import case_mechanism
from tests.mechanism.test_stepping import slider_crank
from tests.says import says

END = 0.01


def pair():
    return case_mechanism(gm.Case()), END


def crank():
    """At some of its positions the pivots of the start do not serve."""
    return slider_crank(), 1.0


def parts(m, told):
    """What is told at an instant, as one array."""
    found = [np.ravel(part) for name in m.joints for part in told("reaction", name)]
    found += [told("com_acceleration", name) for name in m.bodies]
    return np.concatenate(found)


@pytest.mark.slow
@pytest.mark.parametrize("model", [pair, crank])
def test_where_one_has_looked_makes_no_difference(model):
    """Looks on the way, a state gone back to, and all outputs of one run at once."""
    m, end = model()
    options = {"lump": False, "fixed_pivots": True}
    times = np.linspace(0.0, end, 101)
    solution = m.simulate(t_eval=times, t_end=end, **options)
    once, often = gm.Simulator(m, end, **options), gm.Simulator(m, end, **options)
    for k, t in enumerate(times[1:-1].tolist(), start=1):
        for sim in (once, often):
            sim.advance(t)
        told = parts(m, often.get)
        wanted = parts(m, lambda what, name, k=k: np.array(getattr(solution, what)(name))[..., k, :])
        np.testing.assert_array_equal(told, wanted)
        if k == 40:
            state = often.state()
        if k == 70:
            late = told
    np.testing.assert_array_equal(parts(m, once.get), told)
    once.restore(state)
    once.advance(times[70])
    np.testing.assert_array_equal(parts(m, once.get), late)


@pytest.mark.slow
def test_no_entry_is_left_out(monkeypatch):
    """Pivots follow from the matrix alone, so that it takes fewer choices; the motion is the same within tolerance."""
    m, end = pair()
    chosen = {False: [], True: []}
    repivot = Run.repivot

    def noted(run, stricter=0):
        told = repivot(run, stricter)
        chosen[run.options.fixed_pivots].append(run.plan.left_src.size)
        return told

    monkeypatch.setattr(Run, "repivot", noted)
    force = {}
    for fixed in (False, True):
        found = m.simulate(t_eval=np.linspace(0.0, end, 201), t_end=end, lump=False, fixed_pivots=fixed)
        force[fixed] = found.load("mesh")[0]
    assert max(chosen[False]) > 0
    assert not any(chosen[True])
    assert len(chosen[True]) < len(chosen[False])
    assert np.abs(force[True] - force[False]).max() < 1e-4 * np.abs(force[True]).max()


def test_pivots_of_one_point_are_not_kept(monkeypatch):
    """Where those of the start do not serve a point has its own, and the next one those of the start again."""
    m, end = crank()
    evaluate, used = Evaluator._evaluate_rows, []

    def refused(evaluator, first, *given):
        """Refuse the pivots of the start at the third point."""
        used.append(evaluator.plan)
        return first if len(used) == 3 else evaluate(evaluator, first, *given)

    monkeypatch.setattr(Evaluator, "_evaluate_rows", refused)
    sim = gm.Simulator(m, end, fixed_pivots=True)
    for t in (0.1, 0.2, 0.3, 0.4):
        sim.advance(t)
        sim.get("com_acceleration", "crank")
    assert [k for k, plan in enumerate(used) if plan is not used[0]] == [3]


def test_it_is_true_or_false():
    with pytest.raises((ModelError, ValueError), match=says("fixed_pivots", "True", "False")):
        gm.Simulator(slider_crank(), 1.0, fixed_pivots="yes")
    with pytest.raises(ModelError, match=says("fixed_pivots", "IDA")):
        slider_crank().simulate(t_end=0.1, integrator="IDA", fixed_pivots=True)
