"""Stresses of deformed bodies against the strength of materials."""

import numpy as np
import pytest

from gearmbs.flexible import (
    ElasticMaterial,
    FlexibleError,
    Interface,
    Shaft,
    ShaftSection,
    StressModes,
    block_mesh,
    from_matrices,
    nodes_where,
    reduce_model,
    solid_model,
)
from tests.says import says

RADIUS = 0.02
AREA = np.pi * RADIUS**2
SECOND = np.pi / 4 * RADIUS**4
BAR = Shaft([ShaftSection(0.8, 2 * RADIUS)], seats={"left": 0, "middle": 0.4, "right": 0.8})


def deflected(model, loads):
    """Return the coordinates of a free body under balanced loads: each q_k = f_k / (2 pi f_k)^2."""
    force = np.zeros(model.modes)
    for seat, (f, t) in loads.items():
        force += model.seats[seat].moved @ np.asarray(f) + model.seats[seat].turned @ np.asarray(t)
    return force / (2 * np.pi * model.frequencies) ** 2


def test_a_simply_supported_shaft_has_bending_and_shear():
    model = BAR.modal_model()
    f = 1000.0
    q = deflected(model, {"left": ((-f / 2, 0, 0), (0, 0, 0)), "middle": ((f, 0, 0), (0, 0, 0)),
                          "right": ((-f / 2, 0, 0), (0, 0, 0))})  # fmt: skip
    modes = model.stress_modes()
    peak = modes.peak(q[None])
    # M = F l / 4 under the load; the side away from the force is drawn longer
    np.testing.assert_allclose(peak.stress, f * 0.8 / 4 * RADIUS / SECOND, rtol=1e-9)
    np.testing.assert_allclose(np.abs(peak.position), [RADIUS, 0.0, 0.4], atol=1e-9)
    stress = modes.at(q)
    worst = np.argmax(stress[:, 2])
    assert modes.positions[worst, 0] > 0.0
    neutral = np.abs(modes.positions[:, 0]) < 1e-9
    np.testing.assert_allclose(np.abs(stress[neutral, 5]), 4 / 3 * (f / 2) / AREA, rtol=1e-9)
    # from the left end to the load the shear force on the face towards +z is +F/2
    left = neutral & (modes.positions[:, 2] < 0.39)
    assert np.all(stress[left, 5] > 0.0)


def test_torsion_and_tension():
    model = BAR.modal_model()
    torque, tension = 100.0, 1e4
    zero = (0.0, 0.0, 0.0)
    twisted = model.stress_modes().at(
        deflected(model, {"left": (zero, (0, 0, -torque)), "right": (zero, (0, 0, torque))})
    )
    shear = np.hypot(twisted[:, 4], twisted[:, 5])
    np.testing.assert_allclose(shear, torque * RADIUS / (2 * SECOND), rtol=1e-9)
    pulled = deflected(model, {"left": ((0, 0, -tension), zero), "right": ((0, 0, tension), zero)})
    np.testing.assert_allclose(model.stress_modes().at(pulled)[:, 2], tension / AREA, rtol=1e-9)
    np.testing.assert_allclose(model.stress_modes().principal(pulled)[0], [tension / AREA, 0, 0], atol=1e-3)
    # fewer modes: the same stresses of those that are left
    some = model.selected([0, 3])
    np.testing.assert_array_equal(some.stress_modes().values, model.stress_modes().values[[0, 3]])


def test_step_of_a_tube_has_both_nominal_stresses():
    shaft = Shaft([ShaftSection(0.3, 0.04, 0.01), ShaftSection(0.3, 0.02)], seats={"left": 0, "right": 0.6})
    model = shaft.modal_model()
    zero = (0.0, 0.0, 0.0)
    modes = model.stress_modes()
    q = deflected(model, {"left": (zero, (-50, 0, 0)), "right": (zero, (50, 0, 0))})
    largest = {
        r: np.abs(modes.at(q)[np.isclose(np.hypot(*modes.positions[:, :2].T), r), 2]).max() for r in (0.02, 0.01)
    }
    np.testing.assert_allclose(largest[0.02], 50 * 0.02 / (np.pi / 4 * (0.02**4 - 0.005**4)), rtol=1e-8)
    np.testing.assert_allclose(largest[0.01], 50 * 0.01 / (np.pi / 4 * 0.01**4), rtol=1e-8)


@pytest.mark.slow
def test_a_block_bends_as_a_beam():
    pytest.importorskip("skfem")
    side, moment = 0.02, 10.0
    block = solid_model(block_mesh((0.2, side, side), (20, 3, 3)), ElasticMaterial())
    faces = [
        Interface("a", nodes_where(block, lambda x, y, z: x < 1e-9)),
        Interface("b", nodes_where(block, lambda x, y, z: x > 0.2 - 1e-9)),
    ]
    model = reduce_model(block, faces, modes=4)
    zero = (0.0, 0.0, 0.0)
    q = deflected(model, {"a": (zero, (0, 0, -moment)), "b": (zero, (0, 0, moment))})
    modes = model.stress_modes()
    np.testing.assert_allclose(modes.positions, model.positions, atol=1e-12)
    # ends that stay plane disturb the stresses near them; by Saint-Venant not five sides away
    middle = np.abs(modes.positions[:, 0] - 0.1) < 1e-9
    stress = modes.at(q)[middle]
    exact = -moment * (modes.positions[middle, 1] - side / 2) / (side**4 / 12)
    np.testing.assert_allclose(stress[:, 0], exact, atol=1e-6 * np.abs(exact).max())
    np.testing.assert_allclose(stress[:, 1:], 0.0, atol=1e-6 * np.abs(exact).max())


def test_von_mises_and_what_is_refused():
    shear = StressModes(np.zeros((1, 3)), np.array([[[0, 0, 0, 1.0, 0, 0]]]))
    np.testing.assert_allclose(shear.von_mises([2.0]), [2 * np.sqrt(3)])
    np.testing.assert_allclose(shear.principal([2.0]), [[2.0, 0.0, -2.0]], atol=1e-15)
    found = shear.peak([[1.0], [-3.0], [2.0]])
    assert found.instant == 1
    np.testing.assert_allclose(found.stress, 3 * np.sqrt(3))
    with pytest.raises(FlexibleError, match=says("2", "1", "coordinates have shape")):
        shear.at([1.0, 2.0])
    with pytest.raises(FlexibleError, match="no instants"):
        shear.peak(np.zeros((0, 1)))
    with pytest.raises(FlexibleError, match=says("1", "2", "6", "values have shape")):
        StressModes(np.zeros((1, 3)), np.zeros((1, 2, 6)))
    with pytest.raises(FlexibleError, match=says("StressModes", "values", "not finite")):
        StressModes(np.zeros((1, 3)), np.full((1, 1, 6), np.nan))
    chain = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    bare = from_matrices(np.kron(chain, np.eye(3)), np.eye(9), [[0, 0, 0], [1, 0, 0], [1, 1, 0]])
    assert bare.recovery is None


@pytest.mark.slow
def test_given_stresses_follow_the_modes():
    model = BAR.modal_model().slowest(6)
    values = np.random.default_rng(3).normal(size=(6, 2, 6))
    own = model.with_stresses(StressModes([[0, 0, 0.1], [0, 0, 0.2]], values))
    np.testing.assert_allclose(own.stress_modes().values, values, atol=1e-9)
    np.testing.assert_allclose(own.selected([5, 0]).stress_modes().values, values[[5, 0]], atol=1e-9)
    with pytest.raises(FlexibleError, match="stresses of 5 modes for 6 modes"):
        model.with_stresses(StressModes([[0, 0, 0.1], [0, 0, 0.2]], values[:5]))
    with pytest.raises(FlexibleError, match=says("7", "6", "combination")):
        own.recovery(BAR.modal_model().slowest(8).moved, None)
