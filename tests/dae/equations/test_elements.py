"""Equations of single elements and bodies are all that the numbers of these enter; rates enter alike everywhere."""

import numpy as np
import pytest

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.elements import alone
from gearmbs.dae.equations.jacobian import jacobian
from gearmbs.dae.equations.residual import residual
from gearmbs.studies import Case, case_mechanism
from tests.dae.equations.test_jacobian import FRICTIONS, KINDS, LOADS, REACTIONS, build, unassembled_problem
from tests.dae.equations.test_modal_body import joined

WITHOUT_NUMBERS = ("rotation", REACTIONS[0], "general constraint", "axis force")
"""Mechanisms whose force elements, if they have any, have no numbers of their own."""


def geared(formulation):
    problem = case_mechanism(Case()).compile().problem(formulation)
    return problem.idata.copy(), problem.rdata.copy(), problem.work_size, problem.indptr, problem.indices, problem.n


def tables(kind, formulation="SI2"):
    if kind == "pair":
        return geared(formulation)
    return unassembled_problem(joined("bushing") if kind == "modal bodies" else build(kind), formulation)


@pytest.mark.parametrize("kind", [*LOADS, "torque", "rotation", REACTIONS[0], FRICTIONS[0], "pair"])
def test_numbers_of_elements_enter_their_equations_alone(kind):
    idata, rdata, size, _, _, n = tables(kind)
    rng = np.random.default_rng(3)
    y, yp, t = rng.standard_normal(n), rng.standard_normal(n), 0.31
    single = alone(idata)
    elements = set()

    def evaluate(function, numbers, work, out):
        function(t, y, yp, out, idata, numbers, work)
        return out

    whole = evaluate(residual, rdata.copy(), np.zeros(size), np.zeros(n))
    for place in np.flatnonzero(rdata):
        owners = single.owners(np.array([place]))
        if owners is None:
            continue
        moved = rdata.copy()
        moved[place] += 1e-3 * abs(moved[place])
        found, work = evaluate(residual, moved.copy(), np.zeros(size), np.zeros(n)), np.zeros(size)
        evaluate(residual, rdata.copy(), work, np.zeros(n))
        change, rows = np.zeros(n), np.concatenate([rows for _, rows in owners])
        for element, _ in owners:
            elements.add(element)
            idata[single.place] = element
            change += evaluate(single.residual, moved.copy(), work.copy(), np.zeros(n))
            change -= evaluate(single.residual, rdata.copy(), work.copy(), np.zeros(n))
            idata[single.place] = single.rest
        others = np.setdiff1d(np.arange(n), rows)
        np.testing.assert_array_equal(found[others], whole[others])
        np.testing.assert_allclose(change, found - whole, rtol=0.0, atol=1e-13 * np.abs(whole).max() + 1e-300)
    bodies = {e for e in elements if e >= single.sums}
    assert len(bodies) == idata[T.H_BODIES] - 1
    assert (kind in WITHOUT_NUMBERS) == (elements == bodies)


@pytest.mark.parametrize("formulation", ["I3", "SI2"])
@pytest.mark.parametrize("kind", [*KINDS, "modal bodies", "pair"])
def test_rates_enter_the_equations_alike_everywhere(kind, formulation):
    idata, rdata, size, _, indices, n = tables(kind, formulation)
    rng = np.random.default_rng(7)
    found = []
    for _ in range(2):
        y, yp, vals = rng.standard_normal(n), rng.standard_normal(n), np.zeros((2, indices.size))
        for out, cj in zip(vals, (0.0, 1e6), strict=True):
            jacobian(0.31, y, yp, cj, out, idata, rdata.copy(), np.zeros(size))
        found.append((vals[1] - vals[0]) / 1e6)
    np.testing.assert_allclose(found[0], found[1], rtol=0.0, atol=1e-9 * np.abs(found).max())
