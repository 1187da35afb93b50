"""Pairs of reduced and exact modes: where planes are alike, where the order differs, where a mode is lacking."""

from dataclasses import replace

import numpy as np
import pytest

from gearmbs.flexible import (
    ElasticMaterial,
    Interface,
    Shaft,
    ShaftSection,
    block_mesh,
    check_reduction,
    nodes_where,
    reduce_model,
    solid_model,
)
from gearmbs.flexible.reduction import free_modes

STEEL = ElasticMaterial(youngs_modulus=2.1e11, shear_modulus=8e10, density=7850.0)


def round_shaft():
    seats = {"left": 0.0, "wheel": 0.1, "right": 0.2}
    return Shaft([ShaftSection(0.2, 0.025)], seats=seats, material=STEEL)


def kinds(moved, turned):
    """Return b, t or a: which of bending, torsion and stretching a shape mostly is."""
    sizes = np.array(
        [(moved[:, :, :2] ** 2).sum((1, 2)), 1e-4 * (turned[:, :, 2] ** 2).sum(1), (moved[:, :, 2] ** 2).sum(1)]
    )
    return ["bta"[k] for k in np.argmax(sizes, axis=0)]


@pytest.mark.slow
@pytest.mark.parametrize("modes", [4, 8, 12, 15])
def test_modes_of_a_round_shaft_are_paired_with_their_own_kind(modes):
    shaft = round_shaft()
    model, reduced = shaft.model(), shaft.modal_model().slowest(modes)
    report = check_reduction(model, reduced)
    squared, vectors = free_modes(model.stiffness, model.mass, model.rigid_motion(), modes + 12)
    exact = dict(zip(np.round(np.sqrt(squared) / (2 * np.pi), 3), kinds(*model.field(vectors))))
    assert [exact[round(f, 3)] for f in report.exact] == kinds(reduced.moved, reduced.turned)
    # Rayleigh's quotients come from above; both planes of bending are alike
    assert np.all(report.errors > -1e-9)
    bending = np.array([kind == "b" for kind in kinds(reduced.moved, reduced.turned)])
    np.testing.assert_allclose(report.exact[bending][::2], report.exact[bending][1::2], rtol=1e-6)
    np.testing.assert_allclose(report.errors[bending][::2], report.errors[bending][1::2], atol=1e-6)
    torsion = [kind == "t" for kind in kinds(reduced.moved, reduced.turned)]
    number = 1 + np.arange(sum(torsion))
    np.testing.assert_allclose(
        report.exact[torsion], number * np.sqrt(8e10 / 7850.0) / (2 * 0.2), rtol=1e-2 * number.max(initial=1)
    )
    assert report.similarity.min() > 0.9


@pytest.mark.slow
def test_pairs_do_not_depend_on_how_a_common_space_is_spanned():
    shaft = round_shaft()
    model, reduced = shaft.model(), shaft.modal_model().slowest(8)
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.eye(8)
    turn[:2, :2] = [[c, -s], [s, c]]
    turned = replace(
        reduced,
        moved=np.einsum("kl,lni->kni", turn, reduced.moved),
        turned=np.einsum("kl,lni->kni", turn, reduced.turned),
    )
    one, other = check_reduction(model, reduced), check_reduction(model, turned)
    np.testing.assert_allclose(other.exact, one.exact, rtol=1e-12)
    np.testing.assert_allclose(other.similarity, one.similarity, atol=1e-9)


def test_a_mode_that_is_left_out_is_named_and_shifts_no_pair():
    shaft = round_shaft()
    model, whole = shaft.model(), shaft.modal_model().slowest(12)
    full = check_reduction(model, whole)
    report = check_reduction(model, whole.selected([0, 1, 4, 5, 6, 7]))
    np.testing.assert_allclose(report.exact, full.exact[[0, 1, 4, 5, 6, 7]], rtol=1e-9)
    np.testing.assert_allclose(report.missing, full.exact[2:4], rtol=1e-6)
    assert report.converged_up_to(0.1) == whole.frequencies[1]
    assert "not in the reduction" in repr(report)


def test_shapes_that_are_no_mode_have_no_pair():
    shaft = round_shaft()
    report = check_reduction(shaft.model(), shaft.modal_model())
    alone = np.isnan(report.exact)
    assert alone.any()
    assert not alone[:20].any()
    assert report.similarity[alone].max() <= 0.5
    assert "none" in repr(report)
    assert report.converged_up_to() < report.frequencies[alone][0]


def square_plate():
    pytest.importorskip("skfem")
    plate = solid_model(block_mesh((0.2, 0.2, 0.01), (4, 4, 1)), name="plate")
    seat = Interface(
        "seat", nodes_where(plate, lambda x, y, z: (abs(x - 0.1) < 0.06) & (abs(y - 0.1) < 0.06)), "average"
    )
    return plate, seat


def ring():
    pytest.importorskip("skfem")
    from gearmbs.flexible import ring_mesh

    model = solid_model(ring_mesh(0.16, 0.2, 0.02, (1, 16, 1)), name="ring")
    return model, Interface("rim", list(model.ids), "average")


@pytest.mark.slow
@pytest.mark.parametrize("body", [square_plate, ring])
def test_meshes_that_are_alike_in_several_planes(body):
    model, seat = body()
    report = check_reduction(model, reduce_model(model, [seat], modes=14).slowest(9), [seat])
    squared, _ = free_modes(model.stiffness, model.mass, model.rigid_motion(), 21)
    exact = np.sqrt(squared) / (2 * np.pi)
    twice = exact[:-1][np.diff(exact) < 1e-6 * exact[:-1]]
    found = report.exact[report.frequencies < report.converged_up_to(0.05)]
    pairs = 0
    for frequency in twice:
        same = np.abs(found / frequency - 1) < 1e-6
        assert same.sum() in (0, 2) or np.abs(report.exact[-1] / frequency - 1) < 1e-6
        pairs += same.sum() == 2
    assert pairs >= 1
    assert np.all(report.errors > -1e-8)
    assert report.similarity[:6].min() > 0.9
