"""Designs have the properties they are named for."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from gearmbs.campaigns import CampaignError, Specimens, make_plan
from gearmbs.campaigns.plans import designs
from tests.campaigns.support import function, ranges


@pytest.mark.parametrize("design", designs.SEQUENCES)
def test_sequences_go_on_where_they_stopped(design):
    long = designs.sequence(design, 1000, 5, seed=4)
    np.testing.assert_array_equal(designs.sequence(design, 300, 5, seed=4), long[:300])
    assert long.min() >= 0.0
    assert long.max() < 1.0
    assert not np.array_equal(designs.sequence(design, 300, 5, seed=5), long[:300])


@pytest.mark.parametrize("make", [designs.saltelli, designs.morris])
def test_designs_of_analyses_go_on(make):
    few, many = make(4, 3, 1), make(16, 3, 1)
    np.testing.assert_array_equal(few, many[: len(few)])


def test_latin_hypercube_has_one_point_a_stratum():
    points = designs.sequence("latin hypercube", 64, 3, seed=0)
    for column in points.T:
        assert sorted(np.floor(column * 64).astype(int)) == list(range(64))


def test_saltelli_changes_one_coordinate_at_a_time():
    points = designs.saltelli(8, 3, 0).reshape(8, 5, 3)
    for a, *mixed, b in points:
        for k, row in enumerate(mixed):
            expected = a.copy()
            expected[k] = b[k]
            np.testing.assert_array_equal(row, expected)


def test_morris_moves_every_coordinate_once():
    for path in designs.morris(10, 4, 0).reshape(10, 5, 4):
        steps = np.diff(path, axis=0)
        assert sorted(np.flatnonzero(np.abs(s) > 1e-12)[0] for s in steps) == [0, 1, 2, 3]
        np.testing.assert_allclose(np.abs(steps).sum(axis=1), 2.0 / 3.0)
        assert path.min() >= 0.0
        assert path.max() <= 1.0 + 1e-12


@pytest.mark.parametrize("factors", [3, 7, 11, 19, 23])
def test_plackett_burman_is_orthogonal(factors):
    runs = designs.plackett_burman(factors)
    np.testing.assert_allclose(runs.T @ runs, len(runs) * np.eye(factors), atol=1e-9)


def test_fractions_of_factorials():
    runs = designs.factorial(4, ["D=ABC"])
    assert runs.shape == (8, 4)
    np.testing.assert_array_equal(runs[:, 3], runs[:, 0] * runs[:, 1] * runs[:, 2])
    with pytest.raises(CampaignError, match="write D="):
        designs.factorial(4, ["E=ABC"])


def test_response_surfaces_determine_their_quadratic():
    """The columns of a full quadratic in three factors are independent over the design's points."""
    for points in (designs.central_composite(3), designs.central_composite(3, faced=False), designs.box_behnken(3)):
        pairs = itertools.combinations_with_replacement(range(3), 2)
        terms = [np.ones(len(points)), *points.T, *(points[:, a] * points[:, b] for a, b in pairs)]
        assert np.linalg.matrix_rank(np.array(terms)) == 10
        assert np.abs(points).max() <= 1.0 + 1e-12


def test_grids_and_single_factors():
    assert designs.grid([2, 3]).shape == (6, 2)
    rows = designs.one_at_a_time([3, 2], [0.5, 0.2])
    assert len(rows) == 6
    assert all(np.sum(row != rows[0]) <= 1 for row in rows)


@pytest.mark.parametrize("design", ["sobol", "halton", "random", "saltelli", "morris"])
def test_points_that_are_drawn_in_blocks_are_the_same(design):
    factors = ranges() if design in designs.ANALYSES else [*ranges(), Specimens(5)]
    plan = make_plan(function(), factors, design, n=37)
    whole = plan.points()
    assert len(whole) == plan.size
    first = 5 * plan.points_a_base
    blocks = list(plan.blocks(37, first, 16))
    assert [start for start, _ in blocks] == [first + sum(len(b) for _, b in blocks[:k]) for k in range(len(blocks))]
    np.testing.assert_array_equal(np.vstack([points for _, points in blocks]), whole[first:])
