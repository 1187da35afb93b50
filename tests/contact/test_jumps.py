"""Forces do not jump, and the derivatives are theirs, along paths across every change of contact.

Along a path of poses and speeds the force must grow by the integral of its derivative. The path is cut into parts, the
part where that fails most is cut again, and so on: what is left after six rounds, over a ten-millionth of the path, is
a jump of the force or nothing.
"""

import numpy as np
import pytest
from numba import njit

from benchmarks.random_poses import rotations
from gearmbs.contact import gear_contact
from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec
from gearmbs.gears.faults import BrokenTooth, ChippedCorner, Eccentricity, GradedFlanks, Pit, RootCrack

from .probe_tools import Contact

PARTS = 16
ROUNDS = 6
DEEPEST = 1e-4  # paths whose contact gets no deeper than four times what 100 N m need
ELASTIC = {"contact": ContactLaw.impact(damping=0.0), "friction": FlankFriction.none()}


@njit
def turned(vector, t, axes, out):
    """Turn axes by ``t`` times a rotation vector."""
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    x, y, z = vector / (angle + 1e-300)
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    out[:] = axes + np.sin(angle * t) * (k @ axes) + 2 * np.sin(0.5 * angle * t) ** 2 * (k @ (k @ axes))


@njit
def on_path(gi, gr, t, start, axes_1, axes_2, way, force, slope, jac, diag, work, one, two):
    """Wrench and its derivative along the path."""
    turned(way[1], t, axes_1, one)
    turned(way[5], t, axes_2, two)
    gear_contact(
        gi, gr, start[0] + t * way[0], one, start[2] + t * way[2], start[3] + t * way[3],
        start[4] + t * way[4], two, start[6] + t * way[6], start[7] + t * way[7], force, jac, diag, 1, work,
    )  # fmt: skip
    slope[:] = 0.0
    for b in range(8):
        for k in range(3):
            for i in range(6):
                slope[i] += jac[i, 3 * b + k] * way[b, k]


@njit
def hunt(gi, gr, starts, axes_1, axes_2, ways, jac, work, jump, largest, depth):
    """Worst unexplained change of force on each path, largest normal force and depth; returns results that are bad."""
    diag = np.zeros(8)
    one = np.zeros((3, 3))
    two = np.zeros((3, 3))
    force = np.zeros((PARTS + 1, 6))
    slope = np.zeros((PARTS + 1, 6))
    bad = 0
    for n in range(len(starts)):
        low = 0.0
        step = 1.0
        for _ in range(ROUNDS):
            step /= PARTS
            worst = -1.0
            at = 0
            for k in range(PARTS + 1):
                t = low + k * step
                on_path(
                    gi, gr, t, starts[n], axes_1[n], axes_2[n], ways[n], force[k], slope[k], jac, diag, work, one, two
                )  # fmt: skip
                if not (np.isfinite(force[k]).all() and np.isfinite(jac).all() and diag[7] >= 0.0):
                    bad += 1
                largest[n] = max(largest[n], diag[7])
                depth[n] = max(depth[n], diag[3], diag[4])
                if k > 0:
                    miss = force[k] - force[k - 1] - 0.5 * step * (slope[k] + slope[k - 1])
                    size = np.sqrt(miss[0] ** 2 + miss[1] ** 2 + miss[2] ** 2)
                    if size > worst:
                        worst = size
                        at = k - 1
            low += at * step
            jump[n] = worst
            if largest[n] == 0.0:
                break
    return bad


def paths(pair, count, rng, lean):
    """Starts and ways of paths with flanks near each other: up to a third of a pitch of rolling, any small motion."""
    contact = Contact(pair)
    state = [contact.state(angle, 0.0) for angle in rng.uniform(0, 2 * np.pi, max(count // 50, 1))]
    pick = rng.integers(len(state), size=count)
    starts, ways = np.zeros((count, 8, 3)), np.zeros((count, 8, 3))
    axes = []
    for wheel in (0, 4):
        rest = np.array([state[k][wheel + 1] for k in pick])
        axes.append(np.ascontiguousarray(rotations(rng.normal(size=(count, 3)) * [lean, lean, 6e-4]) @ rest))
        starts[:, wheel] = np.array([state[k][wheel] for k in pick])
        starts[:, wheel + 2] = rng.normal(size=(count, 3)) * 0.1
        starts[:, wheel + 3] = rng.normal(size=(count, 3)) * 30
        for k, size in enumerate((3e-5, 1e-3, 0.02, 3.0)):
            ways[:, wheel + k] = rng.normal(size=(count, 3)) * size
    starts[:, 4] += rng.normal(size=(count, 3)) * [3e-4, 3e-4, 3e-3]
    roll = rng.normal(size=count) * 0.05
    ways[:, 1, 2] += roll
    ways[:, 5] -= (pair.sign * roll / pair.ratio)[:, None] * axes[1][:, :, 2]
    return starts, axes[0], axes[1], ways


def worst_jump(pair, slices, count, lean=0.01, seed=1):
    """Largest jump over the largest force of the path, among paths that do not go deep, and how many touched."""
    contact = Contact(pair, slices)
    path = paths(pair, count, np.random.default_rng(seed), lean)
    jump, largest, depth = np.zeros(count), np.zeros(count), np.zeros(count)
    bad = hunt(contact.gi, contact.gr, *path, contact.jac, contact.work, jump, largest, depth)
    assert bad == 0
    touched = (largest > 1.0) & (depth < DEEPEST)
    return float((jump[touched] / largest[touched]).max()), int(touched.sum())


def gears(z1, z2, **changes):
    return GearPair(GearSpec(z1, "2 mm"), GearSpec(z2, "2 mm"), **ELASTIC, **changes)


ROUND = GearSpec(29, 95e-3 / 31, tip_rounding="0.3 mm")
PERFECT = {
    "paper": (GearPair.paper(**ELASTIC), 1),
    "sliced": (GearPair.paper(**ELASTIC), 11),
    "far apart": (GearPair.paper(centre_distance_error="3 mm", **ELASTIC), 11),
    "hardly meshing": (GearPair.paper(centre_distance_error="5 mm", **ELASTIC), 1),
    "centroid load": (GearPair.paper(load="adams", **ELASTIC), 11),
    "62/62": (gears(62, 62), 1),
    "rounded tips": (GearPair.paper(driver=ROUND, driven=ROUND, **ELASTIC), 5),
    "wide on narrow, shifted": (
        GearPair.paper(driver=GearSpec(29, 95e-3 / 31, face_width="30 mm"), axial_shift="4 mm", **ELASTIC),
        11,
    ),
    "linear": (GearPair.paper(contact=ContactLaw.linear("1.3e8 N/m"), friction=FlankFriction.none()), 5),
    "varying stiffness": (
        GearPair.paper(friction=FlankFriction.none(), faults=[RootCrack()]).with_potential_energy_stiffness(),
        5,
    ),
    "damped, with friction": (GearPair.paper(), 5),
    "Hunt-Crossley, smooth friction": (
        GearPair.paper(contact=ContactLaw.hunt_crossley(), friction=FlankFriction(kind="smooth")),
        5,
    ),
    "broken teeth": (GearPair.paper(faults=[BrokenTooth(tooth=k, lost=0.4) for k in range(0, 29, 3)], **ELASTIC), 1),
    "chipped teeth": (GearPair.paper(faults=[ChippedCorner(tooth=k) for k in range(0, 29, 3)], **ELASTIC), 11),
}


def cylindrical(internal=False, helix=0.0, **changes):
    kind = {"helix_angle": helix, "tip_rounding": changes.pop("tip_rounding", 0.0)}
    mate = {"hand": "right" if internal else "left", "internal": internal}
    one, two = GearSpec(23, "3 mm", **kind), GearSpec(70 if internal else 37, "3 mm", **mate, **kind)
    return GearPair(one, two, backlash="0.3 mm", **changes)


CYLINDRICAL = {
    "ring": (cylindrical(True, **ELASTIC), 1, 0.01),
    "ring, sliced": (cylindrical(True, **ELASTIC), 11, 0.01),
    "ring, rounded tips, damped, with friction": (cylindrical(True, tip_rounding="0.2 mm"), 5, 0.01),
    "helical, nearly parallel": (cylindrical(False, 0.26, **ELASTIC), 20, 2e-4),
    "helical, leaning": (cylindrical(False, 0.26, **ELASTIC), 9, 0.01),
    "helical, damped, with friction": (cylindrical(False, 0.26), 9, 2e-3),
    "helical ring": (cylindrical(True, 0.26, **ELASTIC), 9, 2e-3),
}
"""Pairs, slices, and how much their axes lean."""


@pytest.mark.slow
@pytest.mark.parametrize("name", CYLINDRICAL)
def test_no_jumps_of_internal_and_helical_wheels(name):
    pair, slices, lean = CYLINDRICAL[name]
    jump, touched = worst_jump(pair, slices, 400, lean)
    assert touched >= 10
    assert jump < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("name", PERFECT)
def test_no_jumps(name):
    pair, slices = PERFECT[name]
    jump, touched = worst_jump(pair, slices, 400)
    assert touched >= 10
    assert jump < 2e-6, (name, jump)


@pytest.mark.slow
@pytest.mark.hunt
@pytest.mark.parametrize("name", PERFECT)
def test_no_jumps_on_many_paths(name):
    pair, slices = PERFECT[name]
    assert worst_jump(pair, slices, 4000, seed=2)[0] < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize(("z1", "z2", "slices"), [(17, 38, 1), (17, 38, 7), (18, 120, 1)])
def test_corners_inside_the_base_circle(z1, z2, slices):
    # at the base circle the flank goes on as a plane, whose normal is off by depth over base radius, 1e-4 / 16 mm
    jump, touched = worst_jump(gears(z1, z2), slices, 1500, seed=2)
    assert touched >= 50
    assert jump < 6e-3


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "slope"), [(Eccentricity(), 1e-3), (GradedFlanks(grade=7), 6e-3), (Pit(), 0.1)])
def test_deviating_flanks_kink_where_a_corner_takes_over(fault, slope):
    # the gap of a flank with a deviation is continuous; its slope steps by that of the deviation along the profile:
    # 20 um of eccentricity over 22 mm, waves of 5 um, the rim of a pit 50 um deep and 2 mm high
    jump, touched = worst_jump(GearPair.paper(faults=[fault], **ELASTIC), 1, 1500, lean=0.003)
    assert touched >= 50
    assert jump < slope


@pytest.mark.slow
@pytest.mark.parametrize(("slices", "bound"), [(1, 1e-4), (9, 5e-2)])
@pytest.mark.parametrize("internal", [False, True])
def test_tips_in_roots(internal, slices, bound):
    # leaning 1.6 degrees, slices hand the tip from land to corner one by one
    settings = {"root_contact": True, "backlash": "1.5 mm", **ELASTIC}
    pair = GearPair.paper(centre_distance_error="-0.7 mm", **settings)
    if internal:
        ring = GearSpec.ring(70, "3 mm", dedendum="3.3 mm", fillet_radius="0.3 mm")
        pair = GearPair(GearSpec(23, "3 mm"), ring, centre_distance_error="0.3 mm", **settings)
    jump, touched = worst_jump(pair, slices, 600)
    assert touched >= 10
    assert jump < bound
