"""Defaults that changed: which trains they reach, and that the former one is given in their place."""

import pytest

from benchmarks.defaults import FORMER, mesh_rows, two_stages, with_former_law
from gearmbs.studies.presets.files import PRESETS, preset_train


def test_the_former_default_takes_the_place_of_any_law():
    train = two_stages()
    for one in (train, with_former_law(train)):
        assert set(one.pairs) == {"stage 1", "stage 2"}
    assert all(pair.contact == FORMER for pair in with_former_law(train).pairs.values())
    assert not any(pair.contact == FORMER for pair in train.pairs.values())


@pytest.mark.slow
def test_presets_that_state_their_law_are_moved_by_no_default():
    reached = {row[0] for name in PRESETS for row in mesh_rows(name, preset_train(name)) if row[2] == "default"}
    # one that is meant to have the law of its own wheels, and two that came after the default
    assert reached == {"crank_slider", "grc_750kw", "nrel_5mw"}
    for name, mesh, stated, before, now in mesh_rows("two stages", two_stages()):
        assert (name, stated) == ("two stages", "default")
        # IMPACT damps with half of the critical and more, the law of the wheels themselves with some hundredths
        ratios = [float(cell.partition("(")[2].rstrip(")")) for cell in (before, now)]
        assert ratios[0] > 0.4 > 0.05 > ratios[1], mesh
