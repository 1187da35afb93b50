"""Contact of solids against closed forms: derivatives, geometry, bouncing, rolling, sticking, slipping, tipping."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.mechanism.contacts import (
    Box,
    Coulomb,
    Cylinder,
    Ellipsoid,
    Frustum,
    HalfSpace,
    Impact,
    Mesh,
    Poisson,
    SolidContact,
    Sphere,
    Torus,
    extruded,
    read_mesh,
    revolved,
)
from gearmbs.mechanism.contacts.kernel import SOLID
from gearmbs.mechanism.contacts.shapes import volume
from gearmbs.mechanism.forces.functions import vary
from tests.says import says

G = 9.81


def turned(*vector):
    return Rotation.from_rotvec(vector).as_matrix()


class Pair:
    """A contact's kernel as a function of two frames."""

    def __init__(self, a, b, law=None):
        m = Mechanism("pair")
        body = m.body("body", 1.0, (1, 1, 1))
        law = law or Impact(1e6, 1.5, 1e3, 7e-3)
        element = SolidContact("c", body.marker(), m.ground.marker(), (a,), (b,), law, Coulomb(0.5, 0.3, 0.1, 1.0))
        made = element.compiled()
        self.element = element
        self.kernel = made.kernel
        self.tables = np.array(made.integers, dtype=np.int64), np.array(made.reals, dtype=float)
        self.work = np.zeros(made.scratch)

    def __call__(self, frames, want=3):
        wrench, jac, told, none = np.zeros((1, 6)), np.zeros((6, 24)), np.zeros(6), np.zeros(0)
        self.kernel(*self.tables, 0.0, frames, none, none, want, self.work, wrench, none, jac, told)
        return wrench[0], jac, told

    def differences(self, frames, h=1e-7):
        out, jac = np.zeros_like(frames), np.zeros((6, 24))
        for column in range(24):
            for sign in (1.0, -1.0):
                vary(frames, out, column // 12, column % 12, sign * h)
                jac[:, column] += sign * self(out.copy(), 0)[0] / (2.0 * h)
        return jac


def frames_at(position, axes, rng):
    """Frames of I, given in J's frame, and of J anywhere, with velocities."""
    origin, turn = rng.normal(size=3), turned(*rng.normal(size=3))
    frames = np.zeros((2, 18))
    frames[0, :3], frames[0, 3:12] = origin + turn @ position, (turn @ axes).ravel()
    frames[1, :3], frames[1, 3:12] = origin, turn.ravel()
    frames[:, 12:] = 0.3 * rng.normal(size=(2, 6))
    return frames


SLANTED = turned(0.1, 0.2, 0.3)
PAIRS = {
    "sphere on plane": (Sphere(0.1), HalfSpace(), (0.02, 0.01, 0.096), SLANTED),
    "plane on sphere": (HalfSpace(), Sphere(0.1), (0.02, 0.01, -0.096), SLANTED),
    "two spheres": (Sphere(0.1), Sphere(0.2), (0.1, 0.2, 0.18), SLANTED),
    "sphere on box": (Sphere(0.1), Box((0.4, 0.3, 0.2)), (0.05, 0.0, 0.19), SLANTED),
    "sphere on an edge": (Sphere(0.1), Box((0.4, 0.3, 0.2)), (0.26, 0.0, 0.16), SLANTED),
    "sphere on a corner": (Sphere(0.1), Box((0.4, 0.3, 0.2)), (0.25, 0.2, 0.15), SLANTED),
    "sphere on cylinder": (Sphere(0.1), Cylinder(0.2, 0.4), (0.21, 0.19, 0.1), SLANTED),
    "sphere on a rim": (Sphere(0.1), Cylinder(0.2, 0.4), (0.18, 0.17, 0.25), SLANTED),
    "frustum on sphere": (Frustum(0.2, 0.1, 0.4), Sphere(0.1), (0.15, 0.15, 0.1), SLANTED),
    "sphere on torus": (Sphere(0.1), Torus(0.3, 0.05), (0.3, 0.05, 0.12), SLANTED),
    "sphere on ellipsoid": (Sphere(0.1), Ellipsoid((0.3, 0.2, 0.1)), (0.1, 0.15, 0.12), SLANTED),
    "ellipsoid on plane": (Ellipsoid((0.3, 0.2, 0.1)), HalfSpace(), (0.02, 0.01, 0.13), turned(0.5, 0.2, 0.3)),
    "cylinder lying": (Cylinder(0.1, 0.4), HalfSpace(), (0.02, 0.01, 0.099), turned(np.pi / 2 + 1e-3, 0, 0)),
    "cylinder standing": (Cylinder(0.1, 0.4), HalfSpace(), (0.02, 0.01, 0.199), turned(1e-3, -2e-3, 0)),
    "frustum on plane": (Frustum(0.1, 0.2, 0.4), HalfSpace(), (0.02, 0.01, 0.14), turned(np.pi / 2 + 0.2, 0.1, 0)),
    "torus on plane": (Torus(0.3, 0.05), HalfSpace(), (0.02, 0.01, 0.04), turned(0.01, 0.1, 0)),
    "box on plane": (Box((0.2, 0.3, 0.4)), HalfSpace(), (0.02, 0.01, 0.199), turned(1e-3, 5e-4, 0)),
    "plane on box": (HalfSpace(), Box((0.2, 0.3, 0.4)), (0.02, 0.01, -0.199), turned(1e-3, 5e-4, 0)),
    "box on box": (Box((0.2, 0.2, 0.2)), Box((1, 1, 1)), (0.02, 0.01, 0.598), turned(1e-3, 5e-4, 0.3)),
    "edge on edge": (Box((0.2, 0.2, 1)), Box((1, 0.2, 0.2)), (0.01, 0.0, 0.28), turned(0.8, 0, 0) @ turned(0, 0.75, 0)),
    "cylinder on box": (Cylinder(0.1, 0.3), Box((1, 1, 1)), (0.02, 0.01, 0.648), turned(1e-3, 2e-3, 0.3)),
    "box below cylinder": (Box((1, 1, 1)), Cylinder(0.1, 0.3), (0.02, 0.01, -0.648), turned(1e-3, 2e-3, 0.3)),
    "cylinder on an edge": (Cylinder(0.1, 0.3), Box((1, 1, 1)), (0.53, 0.01, 0.588), turned(np.pi / 2 + 1e-5, 0, 0.3)),
    "rim on an edge": (Cylinder(0.1, 0.3), Box((1, 1, 1)), (0.505, 0.1, 0.635), turned(0.5, 0.4, 0.3)),
    "cylinder on a corner": (Cylinder(0.1, 0.3), Box((1, 1, 1)), (0.53, 0.52, 0.56), turned(1.2, 0.5, 0.3)),
    "corner on a frustum": (Box((0.2, 0.2, 0.2)), Frustum(0.4, 0.2, 0.4), (0.1, 0.15, 0.36), turned(0.6, 0.5, 0.3)),
    "ellipsoid on an edge": (Ellipsoid((0.3, 0.2, 0.1)), Box((1, 1, 1)), (0.52, 0.01, 0.58), turned(0.1, 0.4, 0.3)),
    "parallel cylinders": (Cylinder(0.1, 0.3), Cylinder(0.2, 0.4), (0.18, 0.23, 0.05), turned(2e-5, 1e-5, 0)),
    "crossed cylinders": (Cylinder(0.1, 0.6), Cylinder(0.2, 0.8), (0.29, 0.05, 0.1), turned(1.0, 0.1, 0)),
    "cylinder on cylinder": (Cylinder(0.1, 0.3), Cylinder(0.2, 0.4), (0.02, 0.05, 0.348), turned(1e-4, 2e-4, 0)),
    "frustum on ellipsoid": (Frustum(0.1, 0.2, 0.4), Ellipsoid((0.3, 0.2, 0.1)), (0.0, 0.1, 0.27), turned(0.1, 0.4, 0)),
    "two ellipsoids": (Ellipsoid((0.3, 0.2, 0.1)), Ellipsoid((0.2, 0.3, 0.1)), (0.1, 0.1, 0.18), turned(0.3, 0.2, 0)),
    "mesh on plane": (Mesh(*Box((0.2, 0.3, 0.4)).facets()), HalfSpace(), (0.02, 0.01, 0.198), turned(1e-3, 5e-4, 0)),
    "sphere on mesh": (Sphere(0.1), Mesh(*Box((1, 1, 1)).facets()), (0.02, 0.01, 0.598), turned(1e-3, 5e-4, 0)),
}


@pytest.mark.parametrize("name", PAIRS)
def test_derivatives_are_those_of_the_wrench(name):
    a, b, position, axes = PAIRS[name]
    rng = np.random.default_rng(7)
    pair = Pair(a, b)
    touched = 0
    for _ in range(4):
        frames = frames_at(np.array(position), axes, rng)
        _, jac, told = pair(frames)
        touched += told[3] > 0
        numeric = pair.differences(frames)
        assert np.abs(jac - numeric).max() <= 2e-6 * np.abs(numeric).max() + 1e-9
    assert touched == 4


def test_a_polygon_of_two_boxes_moves_with_both():
    # where a box overhangs, the corners' weights move too, which the Jacobian leaves out: small, and no more
    pair = Pair(Box((0.2, 0.2, 0.2)), Box((1, 1, 1)))
    frames = frames_at(np.array([0.45, 0.48, 0.598]), turned(1e-3, 5e-4, 0.3), np.random.default_rng(7))
    _, jac, told = pair(frames)
    assert told[3] == 1
    assert np.abs(jac - pair.differences(frames)).max() <= 1e-3 * np.abs(jac).max()


@pytest.mark.parametrize("name", PAIRS)
def test_no_frame_of_reference_is_preferred(name):
    """Turned and moved together, both solids feel the same load, and action is minus reaction."""
    a, b, position, axes = PAIRS[name]
    rng = np.random.default_rng(3)
    frames = frames_at(np.array(position), axes, rng)
    frames[:, 12:] = 0.0
    one = Pair(a, b)(frames)[0]
    turn, shift = turned(*rng.normal(size=3)), rng.normal(size=3)
    other = frames.copy()
    for k in range(2):
        other[k, :3] = shift + turn @ frames[k, :3]
        other[k, 3:12] = (turn @ frames[k, 3:12].reshape(3, 3)).ravel()
    again = Pair(a, b)(other)[0]
    size = np.abs(one).max()
    assert size > 0.0
    assert np.allclose(again[:3], turn @ one[:3], atol=1e-8 * size)
    assert np.allclose(again[3:], turn @ one[3:], atol=1e-8 * size)
    swapped = Pair(b, a)(frames[::-1].copy())[0]
    assert np.allclose(swapped[:3], -one[:3], atol=1e-8 * size)
    assert np.allclose(swapped[3:], -one[3:] - np.cross(frames[0, :3] - frames[1, :3], one[:3]), atol=1e-8 * size)


def nearest_by_search(solid, x):
    """Distance of a point outside from the facets' vertices, refined: an upper bound that is close."""
    vertices, _ = solid.facets()
    return np.linalg.norm(vertices - x, axis=1).min()


@pytest.mark.parametrize(
    "solid",
    [Ellipsoid((0.3, 0.2, 0.1)), Frustum(0.2, 0.1, 0.4), Torus(0.3, 0.05), Cylinder(0.2, 0.4), Sphere(0.25)],
    ids=lambda s: s.kind,
)
def test_depth_agrees_with_the_facets(solid):
    rng = np.random.default_rng(5)
    for _ in range(20):
        x = rng.normal(size=3)
        x *= 0.45 / np.linalg.norm(x)
        pair = Pair(Sphere(0.6), solid, Impact(1.0, 1.0))
        frames = np.zeros((2, 18))
        frames[:, 3:12] = np.eye(3).ravel()
        frames[0, :3] = x
        distance = 0.6 - pair(frames)[2][4]
        near = nearest_by_search(solid, x)
        assert distance <= near + 1e-9
        assert near - distance < 0.02


def test_two_boxes_press_like_one_and_share_between_corners():
    law = Impact(1e6, 1.5)
    flat = Pair(Box((0.2, 0.2, 0.2)), Box((1, 1, 1)), law)
    frames = np.zeros((2, 18))
    frames[:, 3:12] = np.eye(3).ravel()
    frames[0, :3] = (0.0, 0.0, 0.599)
    wrench, _, told = flat(frames)
    assert wrench[2] == pytest.approx(1e6 * 1e-3**1.5)
    assert told[3] == 1
    # half over the edge: the load moves to the middle of what bears
    frames[0, :3] = (0.5, 0.0, 0.599)
    wrench = flat(frames)[0]
    assert wrench[2] == pytest.approx(1e6 * 1e-3**1.5)
    assert -wrench[4] / wrench[2] == pytest.approx(-0.05)


def test_a_stool_of_two_legs_has_two_patches():
    leg, triangles = Box((0.1, 0.1, 0.4)).facets()
    stool = Mesh(np.concatenate([leg - (0.3, 0, 0), leg + (0.3, 0, 0)]), np.concatenate([triangles, triangles + 8]))
    frames = np.zeros((2, 18))
    frames[:, 3:12] = np.eye(3).ravel()
    frames[0, :3] = (0.0, 0.0, 0.199)
    wrench, _, told = Pair(stool, HalfSpace(), Impact(1e6, 1.5))(frames)
    assert told[3] == 2
    assert wrench[2] == pytest.approx(2 * 1e6 * 1e-3**1.5)


FAR = {
    "torus and box": (Torus(0.3, 0.05), Box((1, 1, 1))),
    "torus and cylinder": (Torus(0.3, 0.05), Cylinder(0.2, 0.4)),
    "mesh and plane": (Mesh(*Box((0.2, 0.3, 0.4)).facets(), offset=(0.5, 0, 0)), HalfSpace()),
    "mesh and frustum": (Mesh(*Box((0.2, 0.3, 0.4)).facets()), Frustum(0.2, 0.1, 0.4)),
    "ball and mesh": (Sphere(0.1), Mesh(*Box((0.2, 0.3, 0.4)).facets())),
}


@pytest.mark.parametrize("name", FAR)
def test_what_is_passed_over_from_afar_does_not_touch(name):
    """Anywhere: the contact is that of the same solids whose ball reaches everywhere."""
    a, b = FAR[name]
    rng = np.random.default_rng(11)
    culled, whole = Pair(a, b), Pair(a, b)
    for solid in (2, 2 + SOLID):
        whole.tables[1][whole.tables[0][1 + solid + 1] + 15] = 1e9
    touched = 0
    for _ in range(300):
        place = rng.normal(size=3)
        place *= rng.uniform(0.0, 1.2) / np.linalg.norm(place)
        frames = frames_at(place, turned(*rng.normal(size=3)), rng)
        one, other = culled(frames, 0)[0], whole(frames, 0)[0]
        assert np.array_equal(one, other)
        touched += np.any(one != 0.0)
    assert 20 < touched < 280


# --- motion -----------------------------------------------------------------------------------------------------


def ball_on_plane(law, friction=None, height=0.0, speed=0.0, radius=0.02, inertia=1.6e-4, tilt=0.0):
    m = Mechanism("ball", gravity=(G * np.sin(tilt), 0, -G * np.cos(tilt)))
    start = radius + height
    ball = m.body("ball", 1.0, (inertia,) * 3, position=(0, 0, start), velocity=(speed, 0, 0))
    m.contact("floor", ball.marker(), Sphere(radius), m.ground.marker(), HalfSpace(), law, friction)
    return m


@pytest.mark.parametrize("restitution", [0.9, 0.6, 0.3])
def test_poisson_gives_back_what_it_says(restitution):
    drop = 0.5
    s = ball_on_plane(Poisson(1e8, restitution), height=drop).simulate(1.2, every_step=True, tol=1e-9)
    z, v = s.com_position("ball")[:, 2] - 0.02, s.com_velocity("ball")[:, 2]
    first = np.flatnonzero((z[:-1] > 0) & (z[1:] <= 0))[0]
    out = np.flatnonzero((z[:-1] <= 0) & (z[1:] > 0))[0]
    assert v[first] == pytest.approx(-np.sqrt(2 * G * (drop - z[first])), rel=1e-6)
    # the weight works along the depth d, too: p d^2 / 2 = g (h + d), and back up
    depth = (G + np.sqrt(G**2 + 2e8 * G * drop)) / 1e8
    expected = np.sqrt(restitution**2 * 2 * G * (drop + depth) - 2 * G * depth)
    assert v[out + 1] == pytest.approx(expected, rel=1e-3)


def test_bounces_of_a_hertzian_ball_follow_its_energy():
    """Undamped: it comes back to its height, the depth and the duration are those of Hertz's impact."""
    k, drop = 1e8, 0.05
    v = np.sqrt(2 * G * drop)
    depth = 0.0
    for _ in range(20):
        # the weight works along the depth
        depth = (1.25 * (v**2 + 2 * G * depth) / k) ** 0.4
    duration = 2.943275 * depth / v
    s = ball_on_plane(Impact(k, 1.5), height=drop).simulate(0.28, every_step=True, tol=1e-10)
    z = s.com_position("ball")[:, 2] - 0.02
    assert -z.min() == pytest.approx(depth, rel=1e-4)
    first = np.flatnonzero((z[:-1] > 0) & (z[1:] <= 0))[0]
    out = np.flatnonzero((z[:-1] <= 0) & (z[1:] > 0))[0]
    assert s.t[out + 1] - s.t[first] == pytest.approx(duration, rel=0.05)
    height = z + s.com_velocity("ball")[:, 2] ** 2 / (2 * G)
    assert height[out + 1 :] == pytest.approx(drop, rel=1e-5)
    balance = s.energy_balance()
    assert balance.attrs["relative_imbalance"] < 1e-5


def test_a_sliding_ball_comes_to_roll():
    mu, v0, radius, inertia = 0.2, 2.0, 0.02, 1.6e-4
    friction = Coulomb(mu, mu, 1e-4, 2e-4)
    law = Impact(1e6, 1.0, 1e3, 1e-6)
    sink = 1.0 * G / 1e6
    s = ball_on_plane(law, friction, -sink, v0, radius, inertia).simulate(0.5, rate=1000, tol=1e-8)
    ratio = inertia / radius**2
    slipping = v0 * ratio / (mu * G * (1 + ratio))
    v, w = s.com_velocity("ball")[:, 0], s.angular_velocity("ball")[:, 1]
    expected = np.where(s.t < slipping, v0 - mu * G * s.t, v0 / (1 + ratio))
    assert slipping < 0.4
    assert np.abs(v - expected).max() < 1e-3
    assert w[-1] * radius == pytest.approx(v0 / (1 + ratio), abs=5e-4)
    balance = s.energy_balance()
    assert balance.attrs["relative_imbalance"] < 1e-4
    assert balance.dissipated_friction.values[-1] == pytest.approx(0.5 * v0**2 * ratio / (1 + ratio), rel=1e-3)


@pytest.mark.parametrize("slope", [0.2, 0.8], ids=["rolls", "slips"])
def test_a_ball_on_a_slope(slope):
    mu, radius, inertia = 0.15, 0.02, 1.6e-4
    ratio = inertia / radius**2
    law, friction = Impact(1e6, 1.0, 1e3, 1e-6), Coulomb(mu, mu, 1e-4, 2e-4)
    m = ball_on_plane(law, friction, -G * np.cos(slope) / 1e6, tilt=slope)
    s = m.simulate(0.3, rate=1000, tol=1e-8)
    rolls = np.tan(slope) <= mu * (1 + 1 / ratio)
    assert rolls == (slope == 0.2)
    a = G * np.sin(slope) / (1 + ratio) if rolls else G * (np.sin(slope) - mu * np.cos(slope))
    x = s.com_position("ball")[:, 0]
    assert np.abs(x - 0.5 * a * s.t**2).max() < 2e-4


def box_on_slope(slope, friction, edges=(0.1, 0.1, 0.1), table=None, law=None):
    """A box on a slope, gravity turned instead; on a half-space or on a large box."""
    law = law or Impact(1e6, 1.0, 2e3, 1e-6)
    m = Mechanism("slope", gravity=(G * np.sin(slope), 0, -G * np.cos(slope)))
    a, b, c = edges
    inertia = np.array([b * b + c * c, a * a + c * c, a * a + b * b]) / 12.0
    box = m.body("box", 1.0, inertia, position=(0, 0, 0.5 * c - G * np.cos(slope) / 1e6))
    at = (0, 0, 0) if table is None else (0, 0, -0.5)
    m.contact("floor", box.marker(), Box(edges), m.ground.marker(at), table or HalfSpace(), law, friction)
    return m


TABLES = {"plane": None, "box": Box((4.0, 4.0, 1.0)), "mesh": Mesh(*Box((4.0, 4.0, 1.0)).facets())}


@pytest.mark.parametrize("table", TABLES)
def test_a_box_sticks_and_creeps_as_the_law_says(table):
    slope, friction = 0.2, Coulomb(0.3, 0.25, 1e-3, 1.5e-3)
    s = box_on_slope(slope, friction, table=TABLES[table]).simulate(0.5, rate=200, tol=1e-8)
    # mu_s (1.5 x - 0.5 x^3) = tan(slope) at x = v / v_s
    x = brentq(lambda q: 0.3 * (1.5 * q - 0.5 * q**3) - np.tan(slope), 0.0, 1.0)
    assert s.com_velocity("box")[-1, 0] == pytest.approx(1e-3 * x, rel=1e-3)
    assert s.load("floor")[0][-1] == pytest.approx([-G * np.sin(slope), 0.0, G * np.cos(slope)], abs=1e-3)


@pytest.mark.parametrize("table", TABLES)
def test_a_box_slips(table):
    slope, friction = 0.5, Coulomb(0.3, 0.25, 1e-3, 1.5e-3)
    s = box_on_slope(slope, friction, table=TABLES[table]).simulate(0.4, rate=200, tol=1e-8)
    a = G * (np.sin(slope) - 0.25 * np.cos(slope))
    assert np.abs(s.com_position("box")[:, 0] - 0.5 * a * s.t**2).max() < 1e-4
    assert s.orientation("box")[:, 2, 2].min() > np.cos(1e-3)


@pytest.mark.parametrize("table", ["plane", "box"])
@pytest.mark.parametrize("height", [0.095, 0.105])
def test_a_tall_box_tips_where_its_weight_leaves_the_base(height, table):
    """tan(slope) = 1/2 = base / height at the limit."""
    base, slope = 0.05, np.arctan(0.5)
    m = box_on_slope(slope, Coulomb(0.9, 0.9, 1e-3, 2e-3), (base, 0.1, height), TABLES[table])
    s = m.simulate(0.25, rate=200, tol=1e-7)
    tilt = np.arccos(np.clip(s.orientation("box")[-1, 2, 2], -1.0, 1.0))
    if base / height > 0.5:
        assert tilt < 1e-2
    else:
        # the unstable growth from the limit, about the lower edge
        assert tilt > 0.05


def test_a_cylinder_rolls_down():
    m = Mechanism("roller", gravity=(G * np.sin(0.2), 0, -G * np.cos(0.2)))
    roller = m.body("roller", 1.0, (1e-3, 1e-3, 0.5 * 0.05**2), position=(0, 0, 0.05 - 9.6e-6))
    along = roller.marker((0, 0, 0), turned(np.pi / 2, 0, 0))
    roller.orientation = np.eye(3)
    roller.inertia = np.diag([1e-3, 0.5 * 0.05**2, 1e-3])
    law, friction = Impact(1e6, 1.0, 1e3, 1e-6), Coulomb(0.5, 0.5, 1e-4, 2e-4)
    m.contact("floor", along, Cylinder(0.05, 0.2), m.ground.marker(), HalfSpace(), law, friction)
    s = m.simulate(0.3, rate=500, tol=1e-8)
    assert np.abs(s.com_position("roller")[:, 0] - 0.5 * G * np.sin(0.2) / 1.5 * s.t**2).max() < 1e-4


# --- meshes and mistakes ----------------------------------------------------------------------------------------


def test_facets_enclose_the_volume():
    for solid, expected in (
        (Box((1, 2, 3)), 6.0),
        (Cylinder(1.0, 2.0), 2 * np.pi),
        (Frustum(1.0, 0.0, 3.0), np.pi),
        (Torus(2.0, 0.5), 2 * np.pi**2 * 2.0 * 0.25),
        (Ellipsoid((1, 2, 3)), 8 * np.pi),
    ):
        assert volume(*solid.facets()) == pytest.approx(expected, rel=0.02)
    arrow = np.array([(0, 0), (2, 0), (2, 1), (1, 0.5), (0, 1)], dtype=float)
    assert volume(*extruded(arrow, 3.0)) == pytest.approx(3.0 * 1.5)
    assert volume(*revolved(np.array([0.0, 1.0, 1.0, 0.0]), np.array([0.0, 0.0, 2.0, 2.0]))) == pytest.approx(
        2 * np.pi, rel=0.01
    )


def test_meshes_are_read(tmp_path):
    vertices, triangles = Box((1.0, 2.0, 3.0)).facets()
    (tmp_path / "box.obj").write_text(
        "".join(f"v {x} {y} {z}\n" for x, y, z in vertices)
        + "".join(f"f {a + 1}//1 {b + 1} {c + 1}\n" for a, b, c in triangles)
    )
    (tmp_path / "box.shl").write_text(
        "box\n"
        + f"{len(vertices)} {len(triangles)} 0 1.0\n"
        + "".join(f"{x} {y} {z}\n" for x, y, z in vertices)
        + "".join(f"3 {a + 1} {b + 1} {c + 1}\n" for a, b, c in triangles)
    )
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in vertices[t])
        + "endloop\nendfacet\n"
        for t in triangles
    )
    (tmp_path / "text.stl").write_text(f"solid box\n{facets}endsolid box\n")
    binary = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    binary["corners"] = vertices[triangles]
    (tmp_path / "binary.stl").write_bytes(bytes(80) + np.uint32(len(triangles)).tobytes() + binary.tobytes())
    for name in ("box.obj", "box.shl", "text.stl", "binary.stl"):
        mesh = read_mesh(tmp_path / name, 1e-3)
        assert volume(mesh.vertices, mesh.triangles) == pytest.approx(6e-9)
        assert len(mesh.vertices) == 8


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.step", b"", "is read from"),
        ("none.stl", None, says("none.stl", "No such file")),
        ("a.stl", b"solid\nendsolid", "holds no triangles"),
        (
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 2 4 3",
            "one triangle",
        ),
        ("a.obj", b"v 0 0 nonsense", "not a whole .obj"),
        ("a.shl", b"", "not a whole .shl"),
    ],
)
def test_a_mesh_that_is_wrong_says_so(tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(ModelError, match=message):
        read_mesh(tmp_path / name)


def test_meshes_of_another_unit_or_saved_twice(tmp_path):
    vertices, triangles = Box((10.0, 20.0, 30.0)).facets()
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a} {b} {c}" for a, b, c in triangles + 1]
    once, twice = tmp_path / "once.obj", tmp_path / "twice.obj"
    once.write_text("\n".join(lines) + "\n")
    twice.write_text("\n".join([*lines, *lines[len(vertices) :]]) + "\n")
    for unit, side in (("mm", 1e-3), ("25.4 mm", 0.0254), (0.01, 0.01)):
        mesh = read_mesh(once, unit)
        assert volume(mesh.vertices, mesh.triangles) == pytest.approx(6000 * side**3)
    for wrong in (-1e-3, 0.0):
        with pytest.raises(ModelError, match=says("scale", "unit", "mm", "length")):
            read_mesh(once, wrong)
    with pytest.raises(ModelError, match=says("scale", "NaN", "m")):
        read_mesh(once, np.nan)
    with pytest.raises(ModelError, match=says("12", "twice")):
        read_mesh(twice)


def test_mistakes_are_named():
    m = Mechanism("m")
    body = m.body("b", 1.0, (1, 1, 1))
    i, j = body.marker(), m.ground.marker()
    for make, message in (
        (lambda: Sphere(-1.0), "sphere: radius = -1.0 m"),
        (lambda: Box((1, 2)), "three lengths"),
        (lambda: Torus(0.1, 0.2), says("torus", "tube", "0.2", "thinner", "0.1")),
        (lambda: Frustum(0.0, 0.0, 1.0), "both radii"),
        (lambda: m.contact("c", i, Sphere(0.1), j, HalfSpace(), Impact(-1.0)), "impact: stiffness"),
        (lambda: m.contact("c", i, Sphere(0.1), j, HalfSpace(), Poisson(1.0, 2.0)), "restitution 2.0"),
        (lambda: m.contact("c", i, HalfSpace(), j, HalfSpace(), Impact(1.0)), "two planes"),
        (lambda: m.contact("c", i, Sphere(0.1), body.marker(), Sphere(0.1), Impact(1.0)), "both sides"),
        (lambda: m.contact("c", i, [], j, Sphere(0.1), Impact(1.0)), "give a shape"),
        (lambda: m.contact("c", i, [1], j, Sphere(0.1), Impact(1.0)), "is not a shape"),
        (lambda: extruded(np.array([(0, 0), (1, 1), (1, 0), (0, 1)]), 1.0), "crosses itself"),
    ):
        with pytest.raises(ModelError, match=message):
            make()
