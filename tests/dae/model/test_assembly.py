"""Which constraint rows are removed, and assembly from a pose where others are redundant than in the end."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array

from gearmbs.dae.model import initial
from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.studies.iftomm import models


def scaled_jacobian(mechanism: Mechanism) -> csc_array:
    """Rows of length 1."""
    system = mechanism.compile()
    jacobian, _, _ = system.constraint_jacobian(system.pose, 0.0)
    scaled = csc_array(jacobian @ diags_array(1.0 / np.sqrt(system.coordinate_weights())))
    norms = np.sqrt(np.asarray(scaled.multiply(scaled).sum(axis=1)).ravel())
    return csc_array(diags_array(1.0 / norms) @ scaled)


@pytest.mark.parametrize("mechanism", [models.four_bars(12), models.andrews(), models.bricard()], ids=lambda m: m.name)
def test_sparse_and_dense_search_agree(mechanism):
    """Gram-Schmidt through the rows in order is what the sparse search must find."""
    scaled = scaled_jacobian(mechanism)
    dense = scaled.toarray()
    rank = np.linalg.matrix_rank(dense, tol=1e-6)
    np.testing.assert_array_equal(initial._sparse_rows(scaled), initial._greedy_rows(dense, rank))


def test_pivots_that_rounding_has_blurred_are_looked_at_again(monkeypatch):
    """Where rows lie close together rounding lifts pivots of dependent rows: to 3e-5 in a robot of 566 rows."""
    scaled = scaled_jacobian(models.four_bars(12))
    expected = initial._sparse_rows(scaled)
    pivots = initial._pivots
    dependent = np.setdiff1d(np.arange(scaled.shape[0]), expected)[[3, 20]]

    def blurred(gram, order):
        found = pivots(gram, order)
        if order == "NATURAL":
            found[dependent] = 3e-5
        return found

    monkeypatch.setattr(initial, "_pivots", blurred)
    np.testing.assert_array_equal(initial._sparse_rows(scaled), expected)


def test_long_chain_has_no_redundant_rows():
    """A squared distance between rows falls with the cube of the length; it is not taken for zero."""
    m = Mechanism("chain", gravity=(0, 0, -9.81))
    last, count = m.ground, 2500
    for k in range(count):
        link = m.body(f"link {k}", 1.0, (0.01, 0.1, 0.1), position=(k + 0.5, 0, 0))
        m.revolute(f"pin {k}", link, last, at=(k, 0, 0), axis=(0, 1, 0))
        last = link
    report = m.compile().initialise()
    assert report.degrees_of_freedom == count
    assert not report.redundant


def test_hundreds_of_redundant_rows():
    report = models.four_bars(120).compile().initialise()
    assert report.degrees_of_freedom == 1
    assert len(report.redundant) == 360


def test_other_rows_are_redundant_where_the_bar_ends_up():
    """Welded 0.3 rad away from where it can be: at the start x is needed to close it, at the end it is redundant."""
    m = Mechanism("welded bar")
    axes = np.array([[np.cos(0.3), 0, -np.sin(0.3)], [0, 1, 0], [np.sin(0.3), 0, np.cos(0.3)]])
    bar = m.body("bar", 1.0, (0.1, 0.1, 0.1), orientation=axes)
    m.revolute("pin", bar, m.ground, axis=(0, 1, 0))
    tip, place = bar.marker((1, 0, 0)), m.ground.marker((1, 0, 0))
    m.joint("fixed", "weld", tip, place)
    system = m.compile()
    report = system.initialise()
    assert report.degrees_of_freedom == 0
    assert report.violation < 1e-9
    np.testing.assert_allclose(system.pose[0, 3:12].reshape(3, 3), np.eye(3), atol=1e-7)
    place.position[2] = 0.01
    with pytest.raises(ModelError, match="conflicting constraints: weld"):
        m.compile().initialise()
