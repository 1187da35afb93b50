"""The load of faceted solids: continuous as patches join, the gradient of a potential, as large as of exact solids."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.dae.equations.loads.forces import DERIVATIVES, DIAGNOSTICS
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.contacts import Box, Cylinder, HalfSpace, Impact, Mesh, Poisson, SolidContact, Sphere
from gearmbs.mechanism.contacts.facets import vertex_weights

LAWS = {"impact": Impact(1e8, 1.5, 0.0, 1e-4), "poisson": Poisson(1e6, 1.0)}


def two_bumps(n=20, m=10):
    """A block with two bumps of 7.5 mm below, which become one 2.1 mm below their foot."""
    x, y = np.meshgrid(np.linspace(-0.03, 0.03, n), np.linspace(-0.015, 0.015, m), indexing="ij")
    bump = 0.0075 * np.exp(-(((np.abs(x) - 0.01) / 0.008) ** 2)) * np.cos(np.pi * y / 0.03)
    below = np.stack([x, y, -bump], axis=-1).reshape(-1, 3)
    above = below * (1, 1, 0) + (0, 0, 0.03)
    at = np.arange(n * m).reshape(n, m)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    floor = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    rim = np.concatenate([at[:, 0], at[-1, 1:], at[-2::-1, -1], at[0, -2:0:-1]])
    ahead = np.roll(rim, -1)
    sides = [np.stack([rim, ahead, ahead + n * m], axis=1), np.stack([rim, ahead + n * m, rim + n * m], axis=1)]
    return Mesh(np.concatenate([below, above]), np.concatenate([floor, floor[:, ::-1] + n * m, *sides]))


def on_plane(shape, law):
    """Return the load and the diagnostics as functions of the height and the tilt of a solid on a plane."""
    m = Mechanism("pair")
    element = SolidContact(
        "c", m.body("body", 1.0, (1, 1, 1)).marker(), m.ground.marker(), (shape,), (HalfSpace(),), law
    )
    made = element.compiled()
    tables = np.array(made.integers, dtype=np.int64), np.array(made.reals, dtype=float)
    work, none = np.zeros(made.scratch), np.zeros(0)

    def load(z, tilt=0.0, axes=None):
        frames = np.zeros((2, 18))
        frames[:, 3:12] = np.eye(3).ravel()
        turn = Rotation.from_rotvec([0.0, tilt, 0.0]).as_matrix() if axes is None else axes
        frames[0, 2], frames[0, 3:12] = z, turn.ravel()
        wrench, told = np.zeros((1, 6)), np.zeros(6)
        made.kernel(
            *tables, 0.0, frames, none, none, DERIVATIVES | DIAGNOSTICS, work, wrench, none, np.zeros((6, 24)), told
        )
        return wrench[0], told

    return load


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_the_load_does_not_jump_when_patches_join(law):
    load = on_plane(two_bumps(), LAWS[law])
    heights = np.linspace(0.0076, 0.0005, 1421)
    found = [load(z) for z in heights]
    force, patches = np.array([w[2] for w, _ in found]), np.array([t[3] for _, t in found])
    assert {1.0, 2.0} <= set(patches)
    # 5 micrometres at a time: the steepest law rises by 3/2 of the deepest load over 7 mm
    assert np.abs(np.diff(force)).max() < 2.0 * force.max() * 5e-6 / 7e-3
    assert np.all(np.diff(force) >= 0.0)
    work = -np.trapezoid(force, heights)
    assert found[-1][1][0] == pytest.approx(work, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_no_energy_is_gained_around_a_loop(law):
    load = on_plane(two_bumps(), LAWS[law])
    corners = [(0.0080, 0.0), (0.0010, 0.0), (0.0010, 0.15), (0.0100, 0.15)]
    part, weight = np.polynomial.legendre.leggauss(400)
    works = []
    for (z0, a0), (z1, a1) in zip(corners, [*corners[1:], corners[0]], strict=True):
        total = 0.0
        for u, w in zip(0.5 * (part + 1.0), 0.5 * weight, strict=True):
            wrench, _ = load(z0 + (z1 - z0) * u, a0 + (a1 - a0) * u)
            total += w * (wrench[2] * (z1 - z0) + wrench[4] * (a1 - a0))
        works.append(total)
    assert abs(sum(works)) < 1e-5 * max(np.abs(works))


STANDING = np.eye(3)
LYING = Rotation.from_rotvec([np.pi / 2, 0.0, 0.0]).as_matrix()
SINGLE = {
    "box on its face": (Box((0.2, 0.3, 0.4)), 0.2, STANDING, 1.0, 1.0),
    "cylinder standing": (Cylinder(0.1, 0.4), 0.2, STANDING, 1.0, 1.0),
    "cylinder lying": (Cylinder(0.1, 0.4), 0.1, LYING, 0.97, 1.0),
    "ball": (Sphere(0.1), 0.1, STANDING, 0.95, 1.0),
}


@pytest.mark.parametrize("name", SINGLE)
def test_one_convex_patch_bears_about_the_law_of_its_depth(name):
    shape, height, axes, least, most = SINGLE[name]
    load = on_plane(Mesh(*shape.facets()), Impact(1e6, 1.5))
    for depth in (1e-5, 1e-4, 1e-3, 5e-3):
        part = load(height - depth, axes=axes)[0][2] / (1e6 * depth**1.5)
        assert least - 1e-9 < part < most + 1e-9


def test_the_parts_of_a_face_sum_to_one():
    assert vertex_weights(*Box((0.1, 0.2, 0.3)).facets()) == pytest.approx(np.full(8, 0.25))


def test_separate_solids_of_a_mesh_bear_loads_of_their_own_and_cavities_do_not():
    cube, triangles = Box((0.1, 0.1, 0.1)).facets()
    both = np.concatenate([triangles, triangles + 8])
    feet = Mesh(np.concatenate([cube, cube + (0.3, 0, 0)]), both)
    assert [len(shell.vertices) for shell in feet.shells()] == [8, 8]
    hollow = Mesh(np.concatenate([cube, 0.5 * cube]), np.concatenate([triangles, triangles[:, ::-1] + 8]))
    assert hollow.shells() == (hollow,)
    m = Mechanism("pair")
    markers = m.body("body", 1.0, (1, 1, 1)).marker(), m.ground.marker()
    contact = SolidContact("c", *markers, (Sphere(0.1), feet), (HalfSpace(),), Impact(1e6))
    assert [numbers for numbers, _, _ in contact.pairs()] == [(0, 0), (1, 0), (1, 0)]


@pytest.mark.slow
def test_no_vertex_below_is_passed_over():
    """A ball of 1154 facets' corners, anywhere about a block: depths by going through them all."""
    rng = np.random.default_rng(5)
    ball = Mesh(*Sphere(0.1).facets())
    m = Mechanism("pair")
    markers = m.body("body", 1.0, (1, 1, 1)).marker(), m.ground.marker()
    for block in (Box((0.5, 0.4, 0.3)), Mesh(*Box((0.5, 0.4, 0.3)).facets())):
        made = SolidContact("c", *markers, (ball,), (block,), Impact(1e6)).compiled()
        tables = np.array(made.integers, dtype=np.int64), np.array(made.reals, dtype=float)
        touching = 0
        for _ in range(300):
            frames, none = np.zeros((2, 18)), np.zeros(0)
            axes = Rotation.random(2, random_state=rng).as_matrix()
            frames[:, 3:12] = axes.reshape(2, 9)
            side = int(rng.integers(3))
            place = rng.uniform(-0.5, 0.5, 3) * (0.25, 0.15, 0.05)
            place[side] = (0.25, 0.2, 0.15)[side] + rng.uniform(0.09, 0.11)
            frames[0, :3] = axes[1] @ place
            corners = ball.vertices @ axes[0].T @ axes[1] + place
            depth = -np.max(np.abs(corners) - (0.25, 0.2, 0.15), axis=1).min()
            told = np.zeros(6)
            work, wrench, jac = np.zeros(made.scratch), np.zeros((1, 6)), np.zeros((6, 24))
            made.kernel(*tables, 0.0, frames, none, none, DERIVATIVES, work, wrench, none, jac, told)
            assert told[4] == pytest.approx(max(depth, 0.0), abs=1e-14)
            assert (told[5] > 0.0) == (depth > 0.0)
            touching += depth > 0.0
        assert 50 < touching < 250
