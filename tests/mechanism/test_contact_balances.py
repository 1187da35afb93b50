"""Contact between solids: no energy out of nothing, the same load from either side, meshes that are not quite whole."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.contacts import (
    Box,
    Coulomb,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Impact,
    Mesh,
    Poisson,
    SolidContact,
    Sphere,
    Torus,
    extruded,
)
from gearmbs.mechanism.contacts.shapes import volume
from tests.says import says

ELASTIC = Impact(1e7, 1.5, 0.0, 1e-4)
CUBE = Box((0.1, 0.1, 0.1)).facets()
ANGLE = Mesh(*extruded(0.01 * np.array([[0, 0], [10, 0], [10, 4], [4, 4], [4, 10], [0, 10]]) - 0.04, 0.06))


def loads(first, second, law, friction=None):
    """Return the load on the first of two solids and the diagnostics as functions of the frames of both."""
    m = Mechanism("pair")
    i, j = (m.body(name, 1.0, (1, 1, 1)).marker() for name in "ij")
    made = SolidContact("c", i, j, (first,), (second,), law, friction).compiled()
    tables = np.array(made.integers, dtype=np.int64), np.array(made.reals, dtype=float)
    work, none = np.zeros(made.scratch), np.zeros(0)

    def load(frames):
        wrench, told = np.zeros((1, 6)), np.zeros(6)
        made.kernel(*tables, 0.0, frames, none, none, 2, work, wrench, none, np.zeros((6, 24)), told)
        return wrench[0], told

    return load


def frame(place, turn, velocity=(0, 0, 0), spin=(0, 0, 0)):
    return np.r_[place, turn.as_matrix().ravel(), velocity, spin]


def work_around(load, corners, steps=400):
    """Return the work of the load on a body on its way around corners of heights and tilts, and the most of one leg."""
    part, weight = np.polynomial.legendre.leggauss(steps)
    legs = []
    for (z0, a0), (z1, a1) in zip(corners, [*corners[1:], corners[0]], strict=True):
        leg = 0.0
        for u, w in zip(0.5 * (part + 1.0), 0.5 * weight, strict=True):
            turn = Rotation.from_rotvec([0.0, a0 + (a1 - a0) * u, 0.0])
            frames = np.array([frame((0, 0, z0 + (z1 - z0) * u), turn), frame((0, 0, 0), Rotation.identity())])
            wrench, _ = load(frames)
            leg += w * (wrench[2] * (z1 - z0) + wrench[4] * (a1 - a0))
        legs.append(leg)
    return sum(legs), max(np.abs(legs))


@pytest.mark.parametrize("tilt", [1e-2, 1e-1])
@pytest.mark.parametrize("floor", [Box((0.3, 0.3, 0.1), offset=(0, 0, -0.05)), HalfSpace()])
def test_a_box_gains_no_energy_around_a_loop(floor, tilt):
    load = loads(Box((0.1, 0.1, 0.1)), floor, ELASTIC)
    total, leg = work_around(load, [(0.0501, 0.0), (0.049, 0.0), (0.049, tilt), (0.0501, tilt)])
    assert abs(total) < 1e-6 * leg


@pytest.mark.slow
@pytest.mark.parametrize(
    ("solid", "floor"),
    [
        (Box((0.1, 0.1, 0.1)), Box((1, 1, 0.2), offset=(0, 0, -0.1))),
        (Mesh(*CUBE), Box((1, 1, 0.2), offset=(0, 0, -0.1))),
        (ANGLE, Mesh(*Box((1, 1, 0.2)).facets(), offset=(0, 0, -0.1))),
        (Cylinder(0.05, 0.1), HalfSpace()),
        (Torus(0.04, 0.02), HalfSpace()),
    ],
    ids=lambda solid: solid.kind,
)
@pytest.mark.parametrize("tilt", [(0.002, 0.001, 0.0), (0.3, 0.2, 0.1)])
def test_an_elastic_body_that_rocks_keeps_its_energy(solid, floor, tilt):
    m = Mechanism("rocking", gravity=(0, 0, -9.81))
    turn = Rotation.from_rotvec(tilt)
    low = (turn.apply(solid.facets()[0]))[:, 2].min()
    body = m.body("body", 1.0, (2e-3, 2.5e-3, 3e-3), position=(0, 0, 2e-3 - low), orientation=turn.as_matrix())
    m.contact("floor", body.marker(), solid, m.ground.marker(), floor, ELASTIC)
    energy = m.simulate(0.3, rate=1000, tol=1e-8).energy_balance()
    total = (energy.kinetic + energy.gravity + energy.elastic).values
    assert energy.elastic.values.max() > 1e-3
    # the whole fall is 2 mm: 0.02 J
    assert np.ptp(total) < 2e-4


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (Box((0.1, 0.06, 0.08)), Box((0.08, 0.1, 0.06))),
        (Ellipsoid((0.05, 0.03, 0.04)), Sphere(0.04)),
        (ANGLE, Torus(0.05, 0.015)),
        (ANGLE, Sphere(0.0)),
    ],
    ids=lambda solid: solid.kind,
)
def test_the_load_is_the_same_from_either_side_and_in_a_turned_world(first, second):
    law, friction = Impact(1e6, 1.5, 300.0, 1e-3), Coulomb(0.4, 0.3, 0.01, 0.05)
    load, other = loads(first, second, law, friction), loads(second, first, law, friction)
    rng = np.random.default_rng(5)
    found = 0
    while found < 12:
        turns = Rotation.random(2, random_state=rng)
        frames = np.array(
            [frame(0.05 * rng.normal(size=3), turns[k], *0.1 * rng.normal(size=(2, 3))) for k in range(2)]
        )
        wrench, told = load(frames)
        if told[3] == 0 or told[4] > 0.01:
            continue
        found += 1
        size = np.linalg.norm(wrench[:3])
        assert size <= told[5] * np.hypot(1.0, 0.4) * (1.0 + 1e-9)
        back, _ = other(frames[::-1].copy())
        arm = frames[0, :3] - frames[1, :3]
        np.testing.assert_allclose(back[:3], -wrench[:3], atol=1e-9 * size)
        np.testing.assert_allclose(back[3:], -wrench[3:] - np.cross(arm, wrench[:3]), atol=1e-9 * size)
        world, shift = Rotation.random(random_state=rng), rng.normal(size=3)
        moved = np.array(
            [frame(world.apply(f[:3]) + shift, world * turn, world.apply(f[12:15]), world.apply(f[15:]))
             for f, turn in zip(frames, turns, strict=True)]
        )  # fmt: skip
        there, _ = load(moved)
        np.testing.assert_allclose(there, world.apply(wrench.reshape(2, 3)).ravel(), atol=1e-7 * size)


def test_vertices_of_no_triangle_touch_nothing():
    vertices, triangles = CUBE
    whole = Mesh(np.r_[vertices, [[0.0, 0.0, -0.2]]], triangles)
    load = loads(whole, HalfSpace(), ELASTIC)
    at = np.array([frame((0, 0, 0.0499), Rotation.identity()), frame((0, 0, 0), Rotation.identity())])
    wrench, told = load(at)
    assert wrench[2] == pytest.approx(1e7 * 1e-4**1.5, rel=1e-9)
    assert told[4] == pytest.approx(1e-4)


@pytest.mark.parametrize("solid", [Torus(0.05, 0.01), Box((1, 2, 3))], ids=lambda solid: solid.kind)
def test_triangles_seen_from_inside_are_turned_round(solid):
    vertices, triangles = solid.facets()
    some = np.random.default_rng(3).random(len(triangles)) < 0.3
    mixed = np.where(some[:, None], triangles[:, ::-1], triangles)
    whole, mended = Mesh(vertices, triangles), Mesh(vertices, mixed)
    assert volume(mended.vertices, mended.triangles) == pytest.approx(volume(whole.vertices, whole.triangles))


@pytest.mark.parametrize(
    ("vertices", "triangles", "says"),
    [
        (CUBE[0] * (1, 1, 0), CUBE[1], "its surface encloses"),
        (np.zeros((8, 3)), CUBE[1], says("0 triangles")),
        (CUBE[0][:, :2], CUBE[1], says("vertices", "8", "2", "give rows")),
        (CUBE[0], CUBE[1] + 0.5, says("mesh", "triangles", "whole numbers", "float64")),
        ("points", CUBE[1], says("mesh", "rows of three")),
        (CUBE[0], CUBE[1][1:], says("mesh", "triangle only")),
    ],
)
def test_what_is_no_solid_is_refused(vertices, triangles, says):
    with pytest.raises(ModelError, match=says):
        Mesh(vertices, triangles)


BAR, KNIFE = Mesh(*Box((0.2, 0.02, 0.02)).facets()), 0.02 / np.sqrt(2.0)
ROD = Cylinder(0.01, 0.2)
LINEAR = Impact(1e6, 1.0, 0.0, 1e-4)


def bar_or_rod(solid, turn, edge_on):
    """Return the attitude that lays a bar or rod along x, turned about z, on a face or on an edge."""
    lying = Rotation.from_rotvec([np.pi / 4 if edge_on else 0.0, 0, 0])
    if isinstance(solid, Cylinder):
        lying = Rotation.from_rotvec([0, np.pi / 2, 0])
    return Rotation.from_rotvec([0, 0, turn]) * lying


@pytest.mark.parametrize(
    ("first", "edge_first", "second", "edge_second", "apart", "part"),
    [
        (BAR, False, BAR, False, 0.02, 1.0),
        (Box((0.2, 0.02, 0.02)), False, BAR, False, 0.02, 1.0),
        (ROD, False, ROD, False, 0.02, 1.0),
        (BAR, True, ROD, False, 0.01 + KNIFE, 1.0),
        # the faces at an edge stand at 45 degrees to the way: both the depth and the load are 1/sqrt(2) of it
        (BAR, True, BAR, True, 2.0 * KNIFE, 0.5),
    ],
    ids=["bars", "box and bar", "rods", "edge on rod", "edge on edge"],
)
def test_what_crosses_without_a_vertex_inside_touches_from_the_first(
    first, edge_first, second, edge_second, apart, part
):
    load = loads(first, second, LINEAR)
    rng = np.random.default_rng(2)
    for _ in range(6):
        turn, place = np.pi / 2 + rng.uniform(-0.4, 0.4), 0.03 * rng.uniform(-1, 1, 2)
        if first is ROD and second is ROD:
            # they are rounded by 1e-4 of their half length and meet in their middles from the first
            place[:] = 0.0
        for depth in (1e-7, 1e-5, 1e-3):
            frames = np.array(
                [
                    frame((*place, apart - depth), bar_or_rod(first, 0.0, edge_first)),
                    frame((0, 0, 0), bar_or_rod(second, turn, edge_second)),
                ]
            )
            wrench, told = load(frames)
            assert wrench[2] == pytest.approx(part * 1e6 * depth, rel=0.1)
            assert told[3] >= 1
            assert np.abs(wrench[:2]).max() < 0.02 * wrench[2]


def fall_of_what_is_stored(load, frames: np.ndarray, step: float) -> np.ndarray:
    """Return by how much the stored energy falls with displacements (J/m) and rotations (J/rad) of the first solid."""
    falls, turned = np.zeros(6), Rotation.from_matrix(frames[0, 3:12].reshape(3, 3))
    for k in range(6):
        stored = []
        for change in (-step, step):
            moved = frames.copy()
            if k < 3:
                moved[0, k] += change
            else:
                moved[0, 3:12] = (Rotation.from_rotvec(change * np.eye(3)[k - 3]) * turned).as_matrix().ravel()
            stored.append(load(moved)[1][0])
        falls[k] = -(stored[1] - stored[0]) / (2.0 * step)
    return falls


@pytest.mark.parametrize("solid", [BAR, ROD], ids=["bars", "rods"])
def test_the_load_of_edges_is_the_gradient_of_what_they_store(solid):
    load = loads(solid, solid, ELASTIC)
    rng = np.random.default_rng(9)
    found = 0
    while found < 10:
        turns = [Rotation.random(random_state=rng), Rotation.identity()]
        frames = np.array([frame(0.02 * rng.normal(size=3), turns[0]), frame((0, 0, 0), turns[1])])
        wrench, told = load(frames)
        if told[3] == 0 or told[4] > 1e-3:
            continue
        found += 1
        size = np.linalg.norm(wrench[:3])
        falls = fall_of_what_is_stored(load, frames, 1e-8)
        np.testing.assert_allclose(falls[:3], wrench[:3], rtol=0.0, atol=2e-3 * size)
        np.testing.assert_allclose(falls[3:], wrench[3:6], rtol=0.0, atol=2e-4 * size)


def test_a_stack_of_turned_blocks_stands():
    law, friction = Impact(1e7, 1.5, 1e4, 1e-5), Coulomb(0.4, 0.3, 1e-3, 5e-3)
    m = Mechanism("stack", gravity=(0, 0, -9.81))
    low = m.body("low", 1.0, (1 / 600,) * 3, position=(0, 0, 0.0501))
    turn = Rotation.from_rotvec([0, 0, 0.3]).as_matrix()
    top = m.body("top", 1.0, (1 / 600,) * 3, position=(0.02, 0.01, 0.1503), orientation=turn)
    block = Mesh(*CUBE)
    m.contact("floor", low.marker(), block, m.ground.marker(), Box((1, 1, 0.2), offset=(0, 0, -0.1)), law, friction)
    m.contact("blocks", top.marker(), block, low.marker(), block, law, friction)
    solution = m.simulate(1.0, rate=200, tol=1e-6)
    assert solution.com_position("top")[-1] == pytest.approx([0.02, 0.01, 0.15], abs=1e-3)
    assert solution.contact("blocks")["normal_force"][-1] == pytest.approx(9.81, rel=1e-4)
    assert solution.contact("floor")["normal_force"][-1] == pytest.approx(2 * 9.81, rel=1e-4)


def test_laws_read_texts_with_units():
    assert Coulomb(0.2, 0.1, "1 mm/s", "5 mm/s").reals() == pytest.approx([0.2, 0.1, 1e-3, 5e-3])
    assert Impact(1e6, 1.5, "0.5 N*s/mm", "0.1 mm").reals()[1:5] == pytest.approx([1e6, 1.5, 500.0, 1e-4])
    assert Poisson("1 N/mm", 0.5).reals()[5:7] == pytest.approx([1e3, 0.5])
    assert Sphere("1 mm", offset=("2 mm", 0, 0)).offset == pytest.approx([2e-3, 0, 0])


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"law": Impact("1e6 N/m")}, "impact: stiffness"),
        ({"law": Impact(np.inf)}, "all finite"),
        ({"law": Impact(1e6, 0.5)}, "exponent 0.5 at least 1"),
        ({"law": Poisson(1e6, "much")}, "poisson: restitution"),
        ({"law": 1e6}, r"law = 1000000.0; give Impact\(...\) or Poisson"),
        ({"friction": 0.3}, r"friction = 0.3; give Coulomb"),
        ({"friction": Coulomb(0.1, 0.1, "2 kg")}, "coulomb: stiction: '2 kg'"),
        ({"friction": Coulomb(0.1, 0.1, 2.0, 1.0)}, says("coulomb", "larger than transition")),
        ({"solid": Sphere}, "is not a shape"),
    ],
)
def test_what_is_no_contact_is_refused_where_it_is_given(given, says):
    m = Mechanism("wrong")
    law, friction = given.get("law", ELASTIC), given.get("friction")
    i, j = m.body("ball", 1.0, (1, 1, 1)).marker(), m.ground.marker()
    with pytest.raises(ModelError, match=says):
        m.contact("floor", i, given.get("solid", Sphere(0.1)), j, HalfSpace(), law, friction)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Sphere(0.1, offset=(1, 2)), "three finite lengths"),
        (lambda: Sphere(0.1, offset=(0, 0, np.nan)), "three finite lengths"),
        (lambda: Sphere(0.1, axes="z"), "sphere: axes"),
        (lambda: Sphere(np.inf), says("sphere", "radius", "inf", "positive", "finite")),
        (lambda: extruded(np.zeros((4, 3)), 1.0), says("x", "y", "least three rows")),
        (lambda: extruded(np.array([[0, 0], [1, 0.0]]), 1.0), says("x", "y", "least three rows")),
    ],
)
def test_what_is_no_shape_is_refused(make, says):
    with pytest.raises(ModelError, match=says):
        make()
