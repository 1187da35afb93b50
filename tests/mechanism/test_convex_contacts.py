"""Cylinders, frustums and ellipsoids on boxes and on each other: they roll for ever, and no edge gives energy away."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.contacts import (
    Box,
    Coulomb,
    Cylinder,
    Ellipsoid,
    Frustum,
    HalfSpace,
    Impact,
    Mesh,
    SolidContact,
    Sphere,
    Torus,
)
from tests.mechanism.test_contact_balances import CUBE, ELASTIC, LINEAR, fall_of_what_is_stored, frame, loads

G = 9.81
LAW, GRIP = Impact(1e7, 1.5, 1e4, 1e-5), Coulomb(0.3, 0.3, 1e-3, 2e-3)
FLOOR = Box((10, 2, 1), offset=(0, 0, -0.5))
ACROSS = Rotation.from_rotvec([np.pi / 2, 0, 0])
ROLLERS = {
    "cylinder": (Cylinder(0.05, 0.2, axes=ACROSS.as_matrix()), (0.0079, 0.0025, 0.0079)),
    "ellipsoid": (Ellipsoid((0.05, 0.06, 0.05)), (0.002, 0.002, 0.002)),
    "ellipsoid that is a ball": (Ellipsoid((0.05, 0.05, 0.05)), (0.002, 0.002, 0.002)),
}


def rolls(solid, inertia, floor, law=LAW, friction=GRIP, x=0.0, speed=1.0, end=1.0):
    m = Mechanism("roller", gravity=(0, 0, -G))
    body = m.body(
        "roller", 2.0, inertia, position=(x, 0, 0.05), velocity=(speed, 0, 0), angular_velocity=(0, 20.0 * speed, 0)
    )
    m.contact("floor", body.marker(), solid, m.ground.marker(), floor, law, friction)
    return m.simulate(end, rate=200, tol=1e-9)


@pytest.mark.parametrize("name", ROLLERS)
def test_what_rolls_on_a_box_rolls_for_ever(name):
    solid, inertia = ROLLERS[name]
    on_box, on_plane = (rolls(solid, inertia, floor) for floor in (FLOOR, HalfSpace()))
    speed = on_box.com_velocity("roller")[:, 0]
    # it sinks by 0.16 mm first, and rolls on the radius that this leaves
    assert np.abs(speed - 1.0).max() < 1e-3
    assert np.ptp(speed[150:]) < 1e-7
    assert on_box.contact("floor")["normal_force"][150:] == pytest.approx(2.0 * G, rel=1e-6)
    assert speed == pytest.approx(on_plane.com_velocity("roller")[:, 0], abs=1e-8)


@pytest.mark.parametrize("solid", [ROLLERS["cylinder"][0], Frustum(0.05, 0.03, 0.2), Ellipsoid((0.05, 0.06, 0.07))])
def test_within_a_face_a_box_is_a_plane(solid):
    on_box, on_plane = (loads(solid, floor, LAW, GRIP) for floor in (FLOOR, HalfSpace()))
    rng, touched = np.random.default_rng(4), 0
    while touched < 12:
        turn = Rotation.random(random_state=rng) if touched % 2 else Rotation.from_rotvec([0, 0, rng.normal()])
        place = (*rng.uniform(-0.5, 0.5, 2), rng.uniform(0.03, 0.12))
        moving = [frame(place, turn, *0.1 * rng.normal(size=(2, 3))), frame((0, 0, 0), Rotation.identity())]
        (one, told), (other, _) = on_box(np.array(moving)), on_plane(np.array(moving))
        if 0.0 < told[4] < 0.01:
            touched += 1
            np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-11 * np.abs(other).max())


@pytest.mark.parametrize("friction", [None, GRIP])
def test_a_cylinder_that_rolls_off_an_edge_keeps_its_energy(friction):
    solid, inertia = ROLLERS["cylinder"]
    off = rolls(solid, inertia, FLOOR, Impact(1e7, 1.5), friction, x=4.98, speed=0.1, end=0.4)
    energy = off.energy_balance()
    total = (energy.kinetic + energy.gravity + energy.elastic).values
    # past the edge, and turned around it
    assert off.com_position("roller")[-1, 0] > 5.03
    assert off.com_position("roller")[-1, 2] < 0.035
    if friction is None:
        assert np.ptp(total) < 1e-6
    else:
        # it sticks until it slips from the edge, and gains nothing
        assert np.diff(total).max() < 1e-6
        upright = off.com_position("roller")[:, 0] < 5.005
        assert np.ptp(total[upright]) < 1e-4


BARREL = Cylinder(0.3, 1, axes=ACROSS.as_matrix(), offset=(0, 0, -0.3))
PATHS = {
    "cylinder over an edge": (ROLLERS["cylinder"][0], FLOOR, (5.0, 0.0)),
    "ellipsoid over an edge": (Ellipsoid((0.05, 0.06, 0.05)), FLOOR, (5.0, 0.0)),
    "cylinder over a corner": (ROLLERS["cylinder"][0], FLOOR, (5.0, 1.05)),
    "frustum over an edge": (Frustum(0.05, 0.03, 0.2, axes=ACROSS.as_matrix()), FLOOR, (5.0, 0.0)),
    "cylinder on a cylinder": (Cylinder(0.05, 0.2), BARREL, (0, 0)),
    "ellipsoid on a frustum": (Ellipsoid((0.05, 0.06, 0.05)), Frustum(0.2, 0.1, 0.2, offset=(0, 0, -0.1)), (0.1, 0.0)),
}  # fmt: skip


@pytest.mark.parametrize("name", PATHS)
def test_a_closed_path_over_edges_takes_no_work(name):
    solid, floor, middle = PATHS[name]
    load = loads(solid, floor, LINEAR)
    # the third leg passes the edge in a corner of its own, where the slope of the force changes
    corners = [
        (-0.04, 0.0495, 0.0),
        (0.0, 0.0495, 0.1),
        (0.02, 0.044, 0.2),
        (0.0, 0.136 / 3.0, 0.15),
        (-0.04, 0.048, 0.05),
    ]
    part, weight = np.polynomial.legendre.leggauss(150)
    legs = []
    for one, other in zip(corners, [*corners[1:], corners[0]], strict=True):
        way, leg = np.subtract(other, one), 0.0
        for u, w in zip(0.5 * (part + 1.0), 0.5 * weight, strict=True):
            x, z, angle = one + u * way
            turn = Rotation.from_rotvec([0.0, angle, 0.0])
            at = np.array([frame((middle[0] + x, middle[1], z), turn), frame((0, 0, 0), Rotation.identity())])
            wrench, _ = load(at)
            leg += w * (wrench[0] * way[0] + wrench[2] * way[1] + wrench[4] * way[2])
        legs.append(leg)
    assert max(np.abs(legs)) > 1e-2
    assert abs(sum(legs)) < 1e-5 * max(np.abs(legs))


def test_a_cylinder_rolls_down_another():
    solid, inertia = ROLLERS["cylinder"]
    below = Cylinder(1.0, 2.0, axes=ACROSS.as_matrix(), offset=(0, 0, -1.0))
    solution = rolls(solid, inertia, below, speed=0.2, end=0.5)
    place, velocity = solution.com_position("roller"), solution.com_velocity("roller")
    # from when it has sunk in: 3/4 m v^2, of a cylinder that rolls
    gained = 0.75 * (np.sum(velocity[-1] ** 2) - np.sum(velocity[40] ** 2))
    assert gained == pytest.approx(G * (place[40, 2] - place[-1, 2]), rel=2e-3)
    assert np.hypot(place[-1, 0], place[-1, 2] + 1.0) == pytest.approx(1.05, abs=3e-4)
    assert place[-1, 0] > 0.1


@pytest.mark.parametrize("other", [Box((0.2, 0.3, 0.4)), Ellipsoid((0.1, 0.2, 0.3)), Sphere(0.1)], ids=lambda s: s.kind)
def test_an_ellipsoid_that_is_a_ball_touches_as_a_ball_does(other):
    one, ball = loads(Ellipsoid((0.1, 0.1, 0.1)), other, LAW, GRIP), loads(Sphere(0.1), other, LAW, GRIP)
    rng, touched = np.random.default_rng(2), 0
    while touched < 30:
        frames = np.array(
            [frame(0.2 * rng.normal(size=3), Rotation.random(random_state=rng), *rng.normal(size=(2, 3))) for _ in "ij"]
        )
        wrench, told = ball(frames)
        if not 0.0 < told[4] < 0.02:
            continue
        touched += 1
        np.testing.assert_allclose(one(frames)[0], wrench, rtol=0.0, atol=1e-8 * np.abs(wrench).max())


SOLIDS = (Cylinder(0.1, 0.3), Cylinder(0.2, 0.05), Frustum(0.1, 0.2, 0.2), Frustum(0.1, 0, 0.3),
          Ellipsoid((0.1, 0.2, 0.3)), Box((0.2, 0.3, 0.4)), Cylinder(0.02, 1.0))  # fmt: skip


def reach(solid, w):
    """How far a solid with sharp edges reaches in directions of its own frame, shape (n, 3)."""
    if isinstance(solid, Box):
        return np.abs(w) @ (0.5 * solid.edges)
    if isinstance(solid, Ellipsoid):
        return np.linalg.norm(w * solid.semi_axes, axis=1)
    bottom, top = (solid.radius, solid.radius) if isinstance(solid, Cylinder) else (solid.bottom, solid.top)
    across, up = np.hypot(w[:, 0], w[:, 1]), 0.5 * solid.length * w[:, 2]
    return np.maximum(bottom * across - up, top * across + up)


def test_along_no_direction_do_two_solids_overlap_less():
    rng, touched = np.random.default_rng(1), 0
    everywhere = rng.normal(size=(20000, 3))
    everywhere /= np.linalg.norm(everywhere, axis=1)[:, None]
    while touched < 60:
        a, b = (SOLIDS[k] for k in rng.choice(len(SOLIDS), 2))
        if isinstance(a, Box) and isinstance(b, Box):
            continue
        turns = Rotation.random(2, random_state=rng)
        if touched % 3 == 0:
            near = Rotation.from_rotvec(rng.choice([0.0, np.pi / 2], 3) + 1e-3 * rng.normal(size=3))
            turns = Rotation.concatenate([turns[1] * near, turns[1]])
        towards = rng.normal(size=3)
        towards /= np.linalg.norm(towards)
        turned = [everywhere @ turn.as_matrix() for turn in turns]
        together = reach(a, -turned[0]) + reach(b, turned[1])
        # apart by what leaves an overlap of up to 20 mm in the sampled directions
        ahead = everywhere @ towards > 0.05
        apart = np.min(together[ahead] / (everywhere[ahead] @ towards)) - 10.0 ** rng.uniform(-3.0, -1.7)
        least = np.min(together - apart * everywhere @ towards)
        if apart <= 0.0 or least <= 0.0:
            continue
        touched += 1
        _, told = loads(a, b, ELASTIC)(np.array([frame(apart * towards, turns[0]), frame((0, 0, 0), turns[1])]))
        # edges are rounded by 1e-4 of the sizes
        assert told[4] <= least + 2e-4
        assert told[4] >= 0.2 * least - 4e-3


@pytest.mark.slow
def test_the_load_is_the_gradient_of_what_is_stored():
    rng, touched = np.random.default_rng(6), 0
    while touched < 25:
        a, b = (SOLIDS[k] for k in rng.choice(len(SOLIDS), 2))
        if isinstance(a, Box) and isinstance(b, Box):
            continue
        load, turns = loads(a, b, ELASTIC), Rotation.random(2, random_state=rng)
        frames = np.array([frame(0.2 * rng.normal(size=3), turns[0]), frame((0, 0, 0), turns[1])])
        wrench, told = load(frames)
        if not 1e-5 < told[4] < 0.01:
            continue
        touched += 1
        falls = fall_of_what_is_stored(load, frames, 1e-7)
        np.testing.assert_allclose(falls, wrench[:6], rtol=0.0, atol=1e-4 * np.linalg.norm(wrench[:3]))


def test_a_box_that_slides_on_a_plane_does_not_rock():
    m = Mechanism("slide", gravity=(4.145885147676262, 0, -8.890879390829536))
    body = m.body("box", 2.0, (0.01,) * 3, position=(0, 0, 0.05))
    m.contact("floor", body.marker(), Box((0.2, 0.2, 0.1)), m.ground.marker(), HalfSpace(), LAW, GRIP)
    solution = m.simulate(0.5, rate=200, tol=1e-8)
    assert np.abs(solution.angular_velocity("box")[50:]).max() < 1e-6
    assert solution.contact("floor")["normal_force"][50:] == pytest.approx(2.0 * 8.890879390829536, rel=1e-4)


KINDS = {
    "sphere": Sphere(0.1),
    "plane": HalfSpace(),
    "box": Box((1, 1, 1)),
    "cylinder": Cylinder(0.1, 0.2),
    "frustum": Frustum(0.1, 0.2, 0.3),
    "torus": Torus(0.2, 0.1),
    "ellipsoid": Ellipsoid((0.1, 0.2, 0.3)),
}


def told_exact() -> set[frozenset[str]]:
    """Return the pairs that the page on contacts calls exact: "A, B with C or D; E with F" in a row of its table."""
    page = (Path(__file__).parents[2] / "docs" / "theory" / "solids.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([^|]+ with [^|]+) \| exact[^|]*\|$", page, flags=re.MULTILINE)
    found = set()
    for pairs in ";".join(rows).split(";"):
        one, other = (re.split(r", | or ", side.strip()) for side in pairs.split(" with "))
        found |= {frozenset(pair) for pair in product(one, other)}
    return found


def test_the_page_names_the_pairs_whose_geometry_is_exact():
    m = Mechanism("pairs")
    i, j = m.body("body", 1.0, (1, 1, 1)).marker(), m.ground.marker()
    exact = set()
    for one, other in product(KINDS, KINDS):
        if (one, other) != ("plane", "plane"):
            if SolidContact("c", i, j, (KINDS[one],), (KINDS[other],), LAW).exact():
                exact.add(frozenset((one, other)))
            assert not SolidContact("c", i, j, (KINDS[one],), (Mesh(*CUBE),), LAW).exact()
    assert told_exact() == exact
