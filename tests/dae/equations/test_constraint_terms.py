"""Derivatives of constraint terms from definitions, against jets of the same terms by rotation matrices."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.rotation import KIN_AXES, KIN_COLUMNS, KIN_R, KIN_V, KIN_W
from tests.jets import jets

KINDS = {
    "point": (terms.POINT, 1),
    "product of axes": (terms.DOT1, 5),
    "offset": (terms.DOT2, 2),
    "distance": (terms.DISTANCE, 0),
    "angle": (terms.ANGLE, 0),
    "rotation": (terms.ROTATION, 0),
}


def turn(axis, angle):
    """Return a rotation about an axis of the frame, of a float or a jet."""
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.array(np.eye(3), dtype=object)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix[a, a] = matrix[b, b] = c
    matrix[b, a], matrix[a, b] = s, -1.0 * s
    return matrix


def measured(kind, axes, places, matrices, arms, frames, f):
    """Return a term of two markers, by places and rotation matrices of their bodies."""
    points = [r + a @ s for r, a, s in zip(places, matrices, arms)]
    one, two = (a @ frame for a, frame in zip(matrices, frames))
    apart = points[0] - points[1]
    if kind == terms.POINT:
        return apart[axes]
    if kind == terms.DOT1:
        return one[:, axes // 3] @ two[:, axes % 3]
    if kind == terms.DOT2:
        return two[:, axes % 3] @ apart
    if kind == terms.DISTANCE:
        return np.sqrt(apart @ apart)
    if kind == terms.ANGLE:
        return np.arctan2(one[:, 0] @ two[:, 1], one[:, 0] @ two[:, 0])
    x, y, z = (two[c, 1] * np.cos(f) - two[c, 0] * np.sin(f) for c in range(3))
    return one[0, 0] * x + one[1, 0] * y + one[2, 0] * z


class State:
    """Two bodies with a marker each, at random, and the tables that kernels read of them."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.q = rng.normal(size=12)
        self.q[[4, 10]] = 0.9, 1.4
        self.v, self.w, self.arms = rng.normal(size=(3, 2, 3))
        self.frames = [np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2)]
        self.f = rng.normal(size=3)
        self.kin, self.frame = np.zeros((3, KIN_COLUMNS)), np.zeros((3, 12))
        self.places, self.matrices = self.poses(self.q)
        self.matrices = [a.astype(float) for a in self.matrices]
        for b in range(2):
            row, (psi, theta, _) = self.kin[1 + b], self.q[6 * b + 3 : 6 * b + 6]
            line = turn(2, psi)
            axes = [np.eye(3)[2], line[:, 0], (line @ turn(0, theta))[:, 2]]
            row[KIN_R : KIN_R + 3], row[KIN_V : KIN_V + 3] = self.places[b], self.v[b]
            row[KIN_W : KIN_W + 3], row[KIN_AXES : KIN_AXES + 9] = self.w[b], np.ravel(axes)
            self.frame[1 + b, :3] = self.matrices[b] @ self.arms[b]
            self.frame[1 + b, T.MK_AXES :] = (self.matrices[b] @ self.frames[b]).T.ravel()

    def poses(self, q):
        """Return places and matrices of both bodies from R and the 3-1-3 angles, floats or jets."""
        angles = (q[3:6], q[9:12])
        return [q[0:3], q[6:9]], [turn(2, a) @ turn(0, b) @ turn(2, c) for a, b, c in angles]

    def table(self, kind, axes):
        row = np.zeros((1, T.TERM_COLUMNS), dtype=np.int64)
        row[0, [T.TERM_TYPE, T.TERM_I, T.TERM_J, T.TERM_AXES]] = kind, 1, 2, axes
        return row


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", KINDS)
def test_gradient_and_hessian_of_terms(name, seed):
    (kind, axes), state = KINDS[name], State(seed)
    exact = measured(kind, axes, *state.poses(np.array(jets(state.q))), state.arms, state.frames, state.f[0])
    markers = np.array([0, 1, 2])
    scratch, g, gt, hess = np.zeros(100), np.zeros(12), np.zeros(12), np.zeros((12, 12))
    tables = (state.table(kind, axes), state.f[None])
    phi, rate = terms.gradient(0, *tables, np.zeros(1), markers, state.kin, state.frame, scratch, g, gt)
    terms.hessian(0, *tables, markers, state.kin, state.frame, hess, scratch)
    for b in range(2):
        # from rotations to Euler angles
        axes_of = state.kin[1 + b, KIN_AXES : KIN_AXES + 9].reshape(3, 3)
        for row in (g, gt):
            row[6 * b + 3 : 6 * b + 6] = axes_of @ row[6 * b + 3 : 6 * b + 6]
    assert phi == pytest.approx(exact.value, rel=1e-12, abs=1e-12)
    assert g == pytest.approx(exact.gradient, rel=1e-10, abs=1e-12)
    assert hess == pytest.approx(exact.hessian, rel=1e-10, abs=1e-11)
    if kind == terms.ROTATION:
        quarter = np.array([state.f[0] + 0.5 * np.pi, *state.f[1:]])
        # dn/df is n a quarter turn further
        moved = measured(kind, axes, *state.poses(np.array(jets(state.q))), state.arms, state.frames, quarter[0])
        assert rate == pytest.approx(state.f[1] * moved.value, rel=1e-12)
        assert gt == pytest.approx(state.f[1] * moved.gradient, rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("moving", [True, False])
@pytest.mark.parametrize("name", KINDS)
def test_second_rate_of_terms(name, moving):
    """Bodies that keep their velocities: R + v t and (1 + W t + W W t^2/2) A to second order."""
    (kind, axes), state = KINDS[name], State(3)
    if not moving:
        state.v[1] = state.w[1] = 0.0
        state.kin[2, KIN_V : KIN_V + 3] = state.kin[2, KIN_W : KIN_W + 3] = 0.0
    (t,) = when = np.array(jets([0.0]))
    places = [np.array([r + v * t for r, v in zip(*pair)]) for pair in zip(state.places, state.v)]
    matrices = []
    for a, w in zip(state.matrices, state.w):
        spin = np.cross(w, np.eye(3)).T
        matrices.append(a + when * (spin @ a) + when * when * (0.5 * spin @ spin @ a))
    f = state.f[0] + state.f[1] * t + 0.5 * state.f[2] * t * t
    exact = measured(kind, axes, places, matrices, state.arms, state.frames, f)
    tables = (state.table(kind, axes), state.f[None])
    # the body of J is the ground, or one that moves
    markers, kin = np.array([0, 1, 2 if moving else 0]), state.kin
    if not moving:
        kin[0] = kin[2]
    found = terms.quadratic_part(0, *tables, markers, kin, state.frame, np.zeros(100))
    assert found == pytest.approx(exact.hessian[0, 0], rel=1e-10, abs=1e-12)
