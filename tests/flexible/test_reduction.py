"""Interfaces and reductions of finite elements: rigid and averaging faces, convergence, integrals without slices."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from gearmbs.flexible import (
    Disc,
    ElasticMaterial,
    FlexibleError,
    Interface,
    Shaft,
    ShaftSection,
    block_mesh,
    check_reduction,
    from_matrices,
    nodes_where,
    reduce_model,
    solid_model,
)
from gearmbs.flexible.interfaces import resolve
from gearmbs.flexible.reduction import of_lumps, of_mass_matrix
from gearmbs.flexible.solid import revolved_mesh
from gearmbs.mechanism import Mechanism, ShapeIntegrals, static_equilibrium
from tests.flexible.test_files import cube
from tests.says import says


def tower(floors: int = 6):
    """Square floors of four masses, with springs between all neighbours."""
    corners = np.array([[x, y, 0.5 * z] for z in range(floors) for x in (0, 1) for y in (0, 1)], dtype=float)
    n = len(corners)
    k = np.zeros((3 * n, 3 * n))
    for a in range(n):
        for b in range(a):
            line = corners[a] - corners[b]
            length = np.linalg.norm(line)
            if length > 1.6:
                continue
            part = 1e6 / length * np.outer(line, line) / length**2
            for i, j, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                k[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] += sign * part
    return from_matrices(k, np.eye(3 * n), corners, name="tower")


def ends(kind):
    return [Interface("foot", [1, 2, 3, 4], kind), Interface("head", [21, 22, 23, 24], kind)]


@pytest.mark.parametrize("kind", ["rigid", "average"])
@pytest.mark.parametrize("method", ["craig-bampton", "free"])
def test_reductions_converge_from_above_and_keep_static_flexibility(kind, method):
    model, errors = tower(), []
    for internal in (2, 10, 30):
        report = check_reduction(model, reduce_model(model, ends(kind), modes=internal, method=method), ends(kind))
        assert np.all(report.errors[:4] > -1e-8)
        assert all(-1e-9 < share < (1e-9 if method == "free" else 0.7) for share in report.flexibility.values())
        assert all(-1e-9 < share < (1e-9 if method == "free" else 0.7) for share in report.turning.values())
        errors.append(np.abs(report.errors[:3]).max())
    assert errors[2] < 5e-3
    assert errors[2] <= errors[1] + 1e-9 <= errors[0] + 2e-9
    assert "errors below 1 %" in repr(report)
    assert report.converged_up_to(0.5) > 0.0


@pytest.mark.slow
def test_slow_modes_lack_flexibility_under_torques():
    """A bar clamped at one end and pinned at the other: its mean deflection by weight is w L^4 / (320 EI)."""
    steel = ElasticMaterial(youngs_modulus=2.1e11, shear_modulus=8e10, density=7850.0)
    shaft = Shaft([ShaftSection(1.0, 0.02)], seats={"pinned": 0.0, "clamped": 1.0}, material=steel)
    area, bending = np.pi * 0.02**2 / 4, 2.1e11 * np.pi * 0.02**4 / 64
    exact = 7850.0 * area * 9.81 / (320 * bending)
    sag = {}
    for modes in (8, None):
        model = shaft.modal_model()
        model = model.slowest(modes) if modes else model
        m = Mechanism("bar", gravity=(0, -9.81, 0))
        body = model.add_to(m)
        m.spherical("pin", body.marker(model.place("pinned")), m.ground.marker())
        m.fixed("clamp", body.marker(model.place("clamped")), m.ground.marker((0, 0, 1)))
        # the centre of mass moves by the mean
        sag[modes] = -static_equilibrium(m).com_position(body.name)[1]
        report = check_reduction(shaft.model(), model)
        if modes:
            assert max(report.flexibility.values()) < 0.02
            assert min(report.turning.values()) > 0.2
            assert "% under torques" in repr(report)
        else:
            assert max(report.turning.values()) < 0.01
    np.testing.assert_allclose(sag[None], exact, rtol=0.01)
    assert sag[8] < 0.7 * exact
    whole = shaft.modal_model()
    assert whole.by_participation(1e-2).modes < whole.by_participation(1e-2, torques=True).modes


def test_rigid_faces_stiffen_and_averages_do_not():
    model = tower()
    free = reduce_model(model, [], modes=4, method="free").frequencies
    rigid, average = (
        check_reduction(model, reduce_model(model, ends(kind), modes=10), ends(kind)).exact[:4]
        for kind in ("rigid", "average")
    )
    np.testing.assert_allclose(average, free, rtol=1e-9)
    assert np.all(rigid >= free * (1 - 1e-9))
    assert rigid.max() > 1.0001 * free.max() or np.any(rigid > 1.0001 * free)


def test_average_follows_rigid_motion_and_shares_loads():
    model = tower()
    reduced = reduce_model(model, ends("average"), modes=8)
    seat = reduced.seats["head"]
    nodes = [20, 21, 22, 23]
    np.testing.assert_allclose(seat.moved, reduced.moved[:, nodes].mean(axis=1), atol=1e-9)
    np.testing.assert_allclose(reduced.place("head"), [0.5, 0.5, 2.5])


def test_integrals_from_the_mass_matrix_are_those_of_its_points():
    corners, k, m = cube()
    model = from_matrices(k, m, corners)
    properties = model.mass_properties()
    shapes = np.random.default_rng(2).standard_normal((24, 3))
    own = of_mass_matrix(model, shapes, properties.com)
    moved, _ = model.field(shapes)
    points = ShapeIntegrals.of_points([0.5] * 8, corners - properties.com, moved)
    lumped = of_lumps(model, shapes, properties)
    for key in ShapeIntegrals.__dataclass_fields__:
        np.testing.assert_allclose(getattr(own, key), getattr(points, key), atol=1e-12)
        np.testing.assert_allclose(getattr(lumped, key), getattr(points, key), atol=1e-12)


def test_lumped_integrals_of_a_shaft_are_near_those_of_its_slices():
    shaft = Shaft([ShaftSection(1.0, 0.05)], seats={"A": 0.0, "B": 1.0}, elements=40).model()
    from dataclasses import replace

    exact = reduce_model(shaft, modes=6)
    lumped = reduce_model(replace(shaft, slices=None), modes=6)
    np.testing.assert_allclose(lumped.frequencies, exact.frequencies, rtol=1e-9)
    for a, b in zip(exact.frequencies[:4], range(4)):
        del a
        np.testing.assert_allclose(
            np.trace(lumped.integrals.second[b, b]), np.trace(exact.integrals.second[b, b]), rtol=2e-2
        )


def test_sparse_and_dense_solvers_agree():
    from gearmbs.flexible import reduction

    model = tower(9)
    faces = [Interface("foot", [1, 2, 3, 4]), Interface("head", [33, 34, 35, 36], "average")]
    dense = reduce_model(model, faces, modes=6).frequencies
    before = reduction.DENSE
    try:
        reduction.DENSE = 10
        sparse = reduce_model(model, faces, modes=6).frequencies
    finally:
        reduction.DENSE = before
    np.testing.assert_allclose(sparse, dense, rtol=1e-8)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Interface("f", [1, 2, 3], "soft"), says("rigid", "choose", "average")),
        (lambda: Interface("f", []), "no nodes"),
        (lambda: Interface("f", [1, 2, 3], weights=[1.0]), "1 weights for 3 nodes"),
        (lambda: reduce_model(tower(), [Interface("f", [1, 2])]), "determine no rotation"),
        (lambda: reduce_model(tower(), [Interface("f", [1, 2, 99])]), says("99", "node")),
        (lambda: reduce_model(tower(), ["f"]), says("'f'", "seat")),
        (lambda: reduce_model(tower(), [*ends("rigid"), Interface("x", [4, 5, 6])]), "in the rigid faces"),
        (lambda: reduce_model(tower(), [*ends("rigid"), *ends("rigid")]), "is there twice"),
        (lambda: reduce_model(tower(), []), "needs interfaces"),
        (lambda: reduce_model(tower(), ends("rigid"), modes=0), says("modes", "0", "one", "whole number")),
        (
            lambda: reduce_model(tower(), ends("rigid"), method="guess"),
            says("'guess'", "choose", "craig-bampton"),
        ),
        (lambda: reduce_model(tower(), ends("rigid"), modes=500), says("shapes", "model", "beside its static")),
        (lambda: reduce_model(tower(), ends("rigid"), modes=4).shapes(np.array([0.3, 0.3, 0.3])), "the nearest, "),
        (lambda: reduce_model(tower(), ends("rigid"), modes=4).place("roof"), says("'roof'")),
    ],
)
def test_wrong_interfaces_are_named(make, message):
    with pytest.raises(FlexibleError, match=message):
        make()


def test_mass_differs_by_direction_where_degrees_of_freedom_are_missing():
    from gearmbs.flexible import check_model

    report = check_model(tower())
    np.testing.assert_allclose(report.directional_mass, 24.0)
    assert report.massless == 0


def rotor_body():
    """A stepped shaft with discs and three seats."""
    discs = [Disc(0.5, outer=0.28, width=0.07, inner=0.05), Disc(1.1, outer=0.2, width=0.05, inner=0.06)]
    sections = [ShaftSection(0.8, 0.05), ShaftSection(0.7, 0.06)]
    return Shaft(sections, discs, {"A": 0.1, "W": 0.6, "B": 1.4}).model(), ["A", "W", "B"]


def plate_body():
    """A thin plate with an averaged seat and two edges held rigid."""
    pytest.importorskip("skfem")
    plate = solid_model(block_mesh((0.3, 0.2, 0.01), (5, 4, 1)), quadratic=False, name="plate")
    feet = [nodes_where(plate, lambda x, y, z, x0=x0: abs(x - x0) < 1e-9) for x0 in (0.0, 0.3)]
    seat = nodes_where(plate, lambda x, y, z: (abs(x - 0.15) < 0.07) & (abs(y - 0.1) < 0.07))
    return plate, [Interface("left", feet[0]), Interface("right", feet[1]), Interface("seat", seat, "average")]


def block_body():
    """A block as thick as wide with seats at two faces."""
    pytest.importorskip("skfem")
    block = solid_model(block_mesh((0.2, 0.12, 0.1), (3, 2, 2)), quadratic=False, name="block")
    low, top = (nodes_where(block, lambda x, y, z, x0=x0: abs(x - x0) < 1e-9) for x0 in (0.0, 0.2))
    return block, [Interface("low", low), Interface("top", top, "average")]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "method"),
    [(rotor_body, "craig-bampton"), (rotor_body, "free"), (plate_body, "craig-bampton"), (block_body, "craig-bampton")],
)
def test_more_modes_are_never_worse(body, method):
    """The first six frequencies against all of the finite elements, from above."""
    model, seats = body()
    parts = resolve(model, seats)
    k, m = ((parts.expand.T @ matrix @ parts.expand).toarray() for matrix in (model.stiffness, model.mass))
    exact = np.sqrt(scipy.linalg.eigh(k, m, eigvals_only=True)[6:12]) / (2 * np.pi)
    found = [reduce_model(model, seats, modes=n, method=method) for n in (1, 2, 3, 4, 6, 8, 11, 14, 16, 20, 26, 32)]
    worst = np.array([(body.frequencies[:6] / exact - 1).max() for body in found])
    # below 1e-7 the frequencies of the whole model are rounding
    assert np.all(worst[1:] <= 1.05 * worst[:-1] + 1e-7), worst
    assert worst[-1] < 0.05 * worst[0]


@pytest.mark.slow
def test_what_modes_counts():
    """Shapes with held seats beside the static ones; by frequency likewise; the slowest alone only if asked for."""
    model, seats = rotor_body()
    static = 6 * (len(seats) - 1)
    # the first twists the shaft, then come two planes of bending, which stay together
    assert [reduce_model(model, seats, modes=n).modes - static for n in (1, 2, 3, 4)] == [1, 3, 3, 5]
    sizes = [reduce_model(model, seats, max_frequency=limit).modes for limit in (1.0, 500.0, 2000.0, 2e4)]
    assert sizes[0] == static
    assert sizes == sorted(set(sizes))
    with pytest.warns(UserWarning, match=says("modes", "kept instead")):
        reduce_model(model, seats, modes=4).slowest(1 + static)
    with pytest.raises(FlexibleError, match="give 1 to 17"):
        reduce_model(model, seats, modes=4).slowest(18)


def test_nodes_of_solids_among_shells_turn_with_their_neighbours():
    """A file with both holds zeros as rotations of nodes of solids: a marker there turns as the body around it."""
    solid = reduce_model(tower(), ends("rigid"), modes=4)
    # in no interface, whose own motion comes first
    node, other = (k for k, number in enumerate(solid.ids) if number in (9, 14))
    own = np.zeros_like(solid.moved)
    own[:, node] = 0.1
    mixed = replace(solid, turned=own)
    assert np.array_equal(mixed.shapes(mixed.positions[node])[1], own[:, node])
    moved, turned = mixed.shapes(mixed.positions[other])
    assert np.array_equal(moved, solid.moved[:, other])
    assert np.array_equal(turned, solid.shapes(solid.positions[other])[1])
    assert np.abs(turned).max() > 0.0


def test_a_model_that_lacks_a_direction_is_shifted_and_not_turned():
    whole = solid_model(revolved_mesh(np.array([0.005, 0.02]), np.linspace(0.0, 0.1, 3), 8))
    left = np.arange(1, len(whole.dofs))
    model = replace(
        whole, dofs=whole.dofs[1:], stiffness=whole.stiffness[left][:, left], mass=whole.mass[left][:, left]
    )
    shifted = model.placed(np.eye(3), np.array([0.0, 0.0, 0.3]))
    np.testing.assert_allclose(shifted.positions - model.positions, np.tile([0.0, 0.0, 0.3], (len(model.ids), 1)))
    with pytest.raises(FlexibleError, match=says("lacks", "direction", "axes")):
        model.placed(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.zeros(3))
