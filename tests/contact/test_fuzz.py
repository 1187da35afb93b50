"""A million random poses and speeds: finite, never pulling, and no jump beyond what the law allows."""

import numpy as np
import pytest
from numba import njit

from gearmbs.contact import gear_contact
from gearmbs.gears import ContactLaw, GearPair
from gearmbs.gears.faults import BrokenTooth, GradedFlanks

from .probe_tools import Contact

BLOCK = 50_000


def rotations(vectors):
    """Rotation matrices of rotation vectors, shape (n, 3, 3)."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None] + 1e-300
    x, y, z = (vectors / angle[:, 0]).T
    zero = np.zeros_like(x)
    k = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), 2, 0)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


@njit
def sweep(gi, gr, R1, A1, v1, w1, R2, A2, v2, w2, turned, force, near, depth, jac, work):
    """Contact at every pose and at a neighbour of it; returns the number of results that are not finite or pull."""
    diag = np.zeros(8)
    zero = np.zeros(3)
    bad = 0
    for k in range(R2.shape[0]):
        gear_contact(gi, gr, R1, A1[k], v1[k], w1[k], R2[k], A2[k], v2[k], w2[k], force[k], jac, diag, 1, work)
        if not (np.isfinite(force[k]).all() and np.isfinite(jac).all() and diag[7] >= 0.0):
            bad += 1
        # neighbours at rest, where the law is Lipschitz
        gear_contact(gi, gr, R1, A1[k], zero, zero, R2[k], A2[k], zero, zero, force[k], jac, diag, 0, work)
        depth[k] = max(diag[3], diag[4])
        gear_contact(gi, gr, R1, A1[k], zero, zero, R2[k], turned[k], zero, zero, near[k], jac, diag, 0, work)
    return bad


def run(pair, slices, count, seed):
    contact = Contact(pair, slices)
    rng = np.random.default_rng(seed)
    base = contact.state(0.0, 0.0)
    law = pair.contact
    for _ in range(count // BLOCK):
        n = BLOCK
        A1 = rotations(rng.normal(size=(n, 3)) * [0.01, 0.01, 3]) @ base[1]
        A2 = rotations(rng.normal(size=(n, 3)) * [0.01, 0.01, 0]) @ rotations(
            rng.normal(size=(n, 3)) * [0, 0, 3]
        )  # the second turn is about the wheel's own axis
        R2 = base[4] + rng.normal(size=(n, 3)) * [5e-4, 5e-4, 3e-3]
        speeds = [rng.normal(size=(n, 3)) * s for s in (0.1, 30.0, 0.1, 30.0)]
        turned = rotations(rng.normal(size=(n, 3)) * 1e-9) @ A2
        force, near, depth = np.zeros((n, 6)), np.zeros((n, 6)), np.zeros(n)
        A1, A2, turned = (np.ascontiguousarray(a) for a in (A1, A2, turned))
        v1, w1, v2, w2 = speeds
        bad = sweep(
            *(contact.gi, contact.gr, base[0], A1, v1, w1, R2, A2, v2, w2),
            *(turned, force, near, depth, contact.jac, contact.work),
        )
        assert bad == 0
        # a turn of 5e-9 rad moves a flank by 0.3 nm at most; up to six pairs, two sides, stiffness of the deepest
        ordinary = depth < 0.5e-3
        stiffness = 12 * law.exponent * law.stiffness * np.maximum(depth, 1e-6) ** (law.exponent - 1)
        jump = np.linalg.norm(near[:, :3] - force[:, :3], axis=1)
        assert np.all(jump[ordinary] <= 3e-10 * stiffness[ordinary])


@pytest.mark.parametrize("slices", [1, 11])
def test_fifty_thousand(slices):
    run(GearPair.paper(), slices, BLOCK, 1)


@pytest.mark.slow
@pytest.mark.parametrize("slices", [1, 11])
def test_a_million(slices):
    run(GearPair.paper(), slices, 1_000_000, 2)


@pytest.mark.slow
def test_faulty_wheels():
    pair = GearPair.paper(faults=[GradedFlanks(grade=7), BrokenTooth(tooth=5)], contact=ContactLaw.hunt_crossley())
    run(pair, 9, 4 * BLOCK, 3)
