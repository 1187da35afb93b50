"""Random poses of every kind of wheels in one compiled loop: finite, never pulling, without jumps."""

from __future__ import annotations

import argparse
import time

import numpy as np
from numba import njit

from gearmbs.contact import gear_contact
from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec

POSES = 1_000_000
BLOCK = 20_000
NEIGHBOUR = 1e-9
"""Turn of wheel 2 to a neighbouring pose, rad."""

DEEP = 0.5e-3
"""Penetration beyond which the tooth a flank faces may change, m: no physical state."""

HELIX = {"helix_angle": "15 deg"}
SIZES = {"module": "3 mm"}
SHALLOW = {"dedendum": "3.3 mm", "fillet_radius": "0.3 mm"}
KINDS = {
    "spur": (GearSpec(23, **SIZES), GearSpec(37, **SIZES), 11),
    "internal": (GearSpec(23, **SIZES), GearSpec.ring(70, **SIZES), 11),
    "helical": (GearSpec(23, **SIZES, **HELIX), GearSpec(37, **SIZES, hand="left", **HELIX), 11),
    "internal helical": (GearSpec(23, **SIZES, **HELIX), GearSpec.ring(70, **SIZES, **HELIX), 11),
    "spur, roots": (GearSpec(23, **SIZES, **SHALLOW), GearSpec(37, **SIZES, **SHALLOW), 1),
    "internal, roots": (GearSpec(23, **SIZES, **SHALLOW), GearSpec.ring(70, **SIZES, **SHALLOW), 1),
}
"""Wheels and slices; those called roots let tips meet roots, 0.3 mm off them on average."""


def pair_of(kind: str) -> tuple[GearPair, int]:
    """Return the pair of a kind, with friction and damping, and its slices."""
    one, two, slices = KINDS[kind]
    roots = "roots" in kind
    settings = {"contact": ContactLaw.impact(), "friction": FlankFriction(), "root_contact": roots or None}
    return GearPair(one, two, backlash="1.4 mm" if roots else "0.3 mm", **settings), slices


def rotations(vectors: np.ndarray) -> np.ndarray:
    """Rotation matrices of rotation vectors, shape (n, 3, 3)."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None] + 1e-300
    x, y, z = (vectors / angle[:, 0]).T
    zero = np.zeros_like(x)
    k = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), 2, 0)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


@njit
def _sweep(gi, gr, R1, A1, v1, w1, R2, A2, v2, w2, turned, worst, work):
    """Count results that are not finite, that pull, that touch; ``worst`` is the largest jump over what the law allows.

    Neighbours are compared at rest, where the force is Lipschitz: ``worst[1]`` is the base radius times the turn, times
    the stiffness of a dozen pairs at the depth ``worst[2] + depth``.
    """
    diag = np.zeros(8)
    zero = np.zeros(3)
    force, near = np.zeros(6), np.zeros(6)
    jac = np.zeros((6, 24))
    bad = pulling = pulling_deep = touching = 0
    for k in range(R2.shape[0]):
        gear_contact(gi, gr, R1, A1[k], v1[k], w1[k], R2[k], A2[k], v2[k], w2[k], force, jac, diag, 1, work)
        if not (np.isfinite(force).all() and np.isfinite(jac).all()):
            bad += 1
        if diag[7] < 0.0 or diag[0] < 0.0:
            if max(diag[3], diag[4]) < worst[3]:
                pulling += 1
            else:
                pulling_deep += 1
        if diag[0] > 0.0:
            touching += 1
        gear_contact(gi, gr, R1, A1[k], zero, zero, R2[k], A2[k], zero, zero, force, jac, diag, 0, work)
        depth = max(diag[3], diag[4])
        gear_contact(gi, gr, R1, A1[k], zero, zero, R2[k], turned[k], zero, zero, near, jac, diag, 0, work)
        if depth < worst[3]:
            allowed = worst[1] * max(depth, 1e-6) ** worst[2]
            jump = np.sqrt(((near[:3] - force[:3]) ** 2).sum())
            worst[0] = max(worst[0], jump / allowed)
    return bad, pulling, pulling_deep, touching


def sweep(pair: GearPair, slices: int, count: int, seed: int = 2, lean: float = 0.01) -> dict[str, float]:
    """Evaluate the contact at random poses and speeds.

    Parameters
    ----------
    pair : GearPair
    slices, count, seed : int
    lean : float
        Standard deviation of each wheel's tilt about either transverse axis, rad.

    Returns
    -------
    dict
        ``poses``, ``touching``, ``not_finite``, ``pulling``, ``pulling_deep`` (beyond `DEEP`), and ``jump``, the
        largest change of force between neighbours relative to what the law allows.
    """
    gi, gr, size = pair.contact_tables(slices)
    law, rng, work = pair.contact, np.random.default_rng(seed), np.zeros(size)
    place = pair.placement(0.0)
    moved = NEIGHBOUR * 5 * pair.driven.tip_radius
    worst = np.array([0.0, 12 * moved * law.exponent * law.stiffness, law.exponent - 1, DEEP])
    totals = np.zeros(4, dtype=np.int64)
    for start in range(0, count, BLOCK):
        n = min(BLOCK, count - start)
        A1 = rotations(rng.normal(size=(n, 3)) * [lean, lean, 3]) @ place.axes_1
        A2 = rotations(rng.normal(size=(n, 3)) * [lean, lean, 0]) @ rotations(rng.normal(size=(n, 3)) * [0, 0, 3])
        R2 = place.origin_2 + rng.normal(size=(n, 3)) * [5e-4, 5e-4, 3e-3]
        v1, w1, v2, w2 = (rng.normal(size=(n, 3)) * s for s in (0.1, 30.0, 0.1, 30.0))
        turned = rotations(rng.normal(size=(n, 3)) * NEIGHBOUR) @ A2
        A1, A2, turned = (np.ascontiguousarray(a) for a in (A1, A2, turned))
        totals += _sweep(gi, gr, place.origin_1, A1, v1, w1, R2, A2, v2, w2, turned, worst, work)
    names = ("not_finite", "pulling", "pulling_deep", "touching")
    return {"poses": count, **dict(zip(names, totals.tolist(), strict=True)), "jump": float(worst[0])}


def main() -> None:
    """Print what a million poses of each kind of wheels show: ``python -m benchmarks.random_poses [poses]``."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.random_poses", description=__doc__)
    parser.add_argument("poses", type=int, nargs="?", default=POSES, help="of each kind (%(default)s)")
    count = parser.parse_args().poses
    for kind in KINDS:
        start = time.process_time()
        found = sweep(*pair_of(kind), count)
        print(f"{kind}: {found}, {time.process_time() - start:.0f} processor seconds", flush=True)


if __name__ == "__main__":
    main()
