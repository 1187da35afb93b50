"""A million random poses and speeds: finite, never pulling, and no jump beyond what the law allows."""

import pytest

from benchmarks.random_poses import KINDS, pair_of, sweep
from gearmbs.gears import ContactLaw, GearPair
from gearmbs.gears.faults import BrokenTooth, GradedFlanks


def run(pair, slices, count, seed=2):
    found = sweep(pair, slices, count, seed)
    assert found["touching"] > 0.5 * count
    assert found["not_finite"] == found["pulling"] == 0
    # tips millimetres deep in a root arc: what is taken away for the arc may outweigh it
    assert pair.root_contact or found["pulling_deep"] == 0
    assert found["jump"] <= 1


@pytest.mark.slow
@pytest.mark.parametrize("slices", [1, 11])
def test_fifty_thousand(slices):
    run(GearPair.paper(), slices, 50_000, 1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(KINDS)[1:])
def test_other_kinds_of_wheels(kind):
    run(*pair_of(kind), 20_000 if "helical" not in kind else 8_000)


@pytest.mark.slow
@pytest.mark.parametrize("slices", [1, 11])
@pytest.mark.hunt
def test_a_million(slices):
    run(GearPair.paper(), slices, 1_000_000)


@pytest.mark.slow
def test_faulty_wheels():
    pair = GearPair.paper(faults=[GradedFlanks(grade=7), BrokenTooth(tooth=5)], contact=ContactLaw.hunt_crossley())
    run(pair, 9, 200_000, 3)
