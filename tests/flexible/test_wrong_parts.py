"""Models that are given almost rightly: in parts, by one triangle, in another unit; near twins run."""

import numpy as np
import pytest
import scipy.sparse as sp

from gearmbs.flexible import FlexibleError, Interface, from_matrices, reduce_model
from tests.flexible.test_files import cube
from tests.says import says

CORNERS, K, M = cube()
ONE, TWO = range(1, 9), range(9, 17)


def two():
    places = np.vstack([CORNERS, CORNERS + [0.0, 0.0, 5.0]])
    return from_matrices(sp.block_diag([K, K]), sp.block_diag([M, M]), places)


def test_a_body_in_two_parts_is_none_unless_a_rigid_face_joins_them():
    top, bottom = [n for n in ONE if CORNERS[n - 1, 2] > 1], [n + 8 for n in ONE if CORNERS[n - 1, 2] < 1]
    for faces, method in (([], "free"), ([Interface("a", top), Interface("b", bottom)], "craig-bampton")):
        with pytest.raises(FlexibleError, match=says("2 parts", "1", "9")):
            reduce_model(two(), faces, modes=4, method=method)
    joined = reduce_model(two(), [Interface("a", top + bottom)], modes=4)
    assert joined.frequencies[0] > 1.0


def test_preloads_are_whole_matrices():
    model = from_matrices(K, M, CORNERS)
    plain, loaded = (reduce_model(model, [], modes=4, method="free", preload=p) for p in (None, 0.21 * K))
    np.testing.assert_allclose(loaded.frequencies, 1.1 * plain.frequencies, rtol=1e-9)
    for wrong in (np.triu(K), np.tril(K), K[:3, :3], K * np.nan):
        with pytest.raises(FlexibleError, match=says("preload", "give")):
            reduce_model(model, [], modes=4, method="free", preload=wrong)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"at": (300, 100, 10)}, ("at", "metres")),
        ({"at": (0.0, 1.0)}, ("at", "three")),
        ({"at": (0.0, 1.0, "2 N")}, ("at", "2 N")),
        ({"nodes": [1, 2, 3, 3]}, ("twice",)),
        ({"weights": [1.0, 1.0, -1.0, 1.0]}, ("weights",)),
        ({"weights": [1.0, 1.0, np.nan, 1.0]}, ("weights",)),
        ({"weights": [1.0, 1.0, 0.0, 0.0]}, ("2", "nodes")),
        ({"at": ("100 mm", 1, "0.3 m"), "weights": [1.0, 1.0, 1.0, 0.0]}, None),
    ],
)
def test_places_and_weights_of_faces(settings, words):
    model, other = from_matrices(K, M, CORNERS), Interface("held", [5, 6, 7, 8])

    def reduced():
        return reduce_model(model, [other, Interface("s", **{"nodes": [1, 2, 3, 4], "kind": "average", **settings})])

    if words is None:
        np.testing.assert_allclose(reduced().place("s"), [0.1, 1.0, 0.3])
    else:
        with pytest.raises(FlexibleError, match=says("s", *words)):
            reduced()


def test_modes_are_chosen_once():
    model = reduce_model(from_matrices(K, M, CORNERS), [], modes=6, method="free")
    mask = np.arange(model.modes) % 2 == 1
    np.testing.assert_array_equal(model.selected(mask).frequencies, model.frequencies[mask])
    for wrong in ([0, 0], [0, 99], mask[:2]):
        with pytest.raises(FlexibleError, match=says("modes", "once")):
            model.selected(wrong)
