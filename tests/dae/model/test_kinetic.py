"""Kinetic energy of records, body by body, against the same sums written as products of arrays."""

from types import SimpleNamespace

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.inertia import ModalInertia
from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, POSE_V, POSE_W
from gearmbs.dae.model.kinetic import kinetic_energy


def symmetric(random, *shape):
    found = random.normal(size=shape)
    return found + np.swapaxes(found, -1, -2)


def modal_body(random, n):
    zero = np.zeros((n, n))
    c1, j1, j2 = random.normal(size=(n, n, 3)), symmetric(random, n, 3, 3), symmetric(random, n, n, 3, 3)
    return ModalInertia(symmetric(random, n, n), zero, zero, random.normal(size=(n, 3)), c1, j1, j2)


def test_rigid_bodies_and_bodies_with_modes():
    """Of one without modes between two with different numbers of them, at several instants."""
    random = np.random.default_rng(3)
    modal, times = [None, modal_body(random, 3), None, modal_body(random, 5)], 4
    bodies = np.zeros((4, max(T.BODY_MASS, T.BODY_INERTIA + 8) + 1))
    bodies[1:, T.BODY_MASS] = random.uniform(1.0, 2.0, 3)
    bodies[1:, T.BODY_INERTIA :] = symmetric(random, 3, 3, 3).reshape(3, 9)
    poses = random.normal(size=(times, POSE_COLUMNS * 3 + 2 * 8))
    wanted, first = np.zeros(times), POSE_COLUMNS * 3
    for b in range(3):
        pose, inertia = poses[:, POSE_COLUMNS * b :], bodies[b + 1, T.BODY_INERTIA :].reshape(3, 3)
        v, w = pose[:, POSE_V : POSE_V + 3], pose[:, POSE_W : POSE_W + 3]
        own = np.einsum("tji,tj->ti", pose[:, POSE_A : POSE_A + 9].reshape(-1, 3, 3), w)
        wanted += 0.5 * bodies[b + 1, T.BODY_MASS] * (v**2).sum(axis=1)
        wanted += 0.5 * np.einsum("ti,ij,tj->t", own, inertia, own)
        if modal[b + 1] is not None:
            n = modal[b + 1].modes
            q, rates = poses[:, first : first + n], poses[:, first + 8 : first + 8 + n]
            wanted += modal[b + 1].kinetic_energy(own, q, rates)
            first += n
    model = SimpleNamespace(bodies=bodies, modal_inertia=tuple(modal))
    np.testing.assert_allclose(kinetic_energy(poses, model), wanted, rtol=1e-12)
