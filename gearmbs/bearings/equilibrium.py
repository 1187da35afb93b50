"""Where a load puts the inner ring of a bearing: the minimum of a convex potential, and which loads have none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import nnls

from gearmbs.bearings import layout as B
from gearmbs.bearings.kinds import BearingError
from gearmbs.bearings.settings import BearingTables

# Where a load puts the inner ring: the minimum of a convex potential, and which loads have none.
#
# In p = (d_x, d_y, d_z, -a_y, a_x), displacement and lean of the inner ring's axis a, the vector (X, Y) of each path of
# contact is affine, L = |(X, Y)| or n . (X, Y) is convex, and so is the energy K/(n + 1) max(delta, 0)^(n + 1): for
# balls without any linearisation, with a centrifugal load as the minimum over the centres v of a function convex in (p,
# v). Then
#
#     Pi(p) = U(p) - c . p,    c = (F, M/a_z),
#
# is convex, its minimum is the equilibrium, and no other point is stationary. a_z = 1 - O(lean^2) is taken from the
# last iteration, which needs no further proof of convergence for leans below `LEAN`.
#
# A minimum exists unless some direction r lowers Pi for ever: c . r > 0 while no contact closes. Balls in grooves have
# no such direction, because |(X, Y)| grows in any. For rollers with the gradients g_j of their deflections there is one
# if and only if c is not in the cone of the g_j (Farkas), and then it is c less its projection onto that cone.


ITERATIONS = 500
SEARCHES = 80
"""Evaluations along one direction; doubling a step so often bridges 24 decades."""

BALANCED = 1e-11
"""Unbalanced load by the largest one at which the iteration ends."""

NEAR = 1e-8
"""The same where rounding lets no direction lower the potential any more."""

ROUNDING = 64.0 * np.finfo(float).eps
"""Error of the summed load by stiffness times size of the coordinates and by the sum of the normal forces."""

FLAT = 1e-13
"""Curvature by the largest one that is rounding."""

STEEP = 0.1
"""Slope along a direction, by that at its beginning, at which the search ends."""

OUTSIDE = 1e-9
"""Distance of a load from the cone of those that rollers carry, by its size, that is not rounding of `nnls`."""

LEAN = 0.3
"""Lean of the axis, rad, up to which the law of the contacts is meant; sin and tan differ by 5 % there."""


def lean_of(axis: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return the axis, fixed in the inner ring, after a rotation by a vector in the plane, shape (3,)."""
    angle = float(np.hypot(rotation[0], rotation[1]))
    if angle == 0.0:
        return axis
    k = np.array([rotation[0] / angle, rotation[1] / angle, 0.0])
    return np.cos(angle) * axis + np.sin(angle) * np.cross(k, axis) + (1.0 - np.cos(angle)) * (k @ axis) * k


def rotation_of(axis: np.ndarray, lean: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return the rotation vector in the plane that leans an axis to given components (a_x, a_y), shape (2,)."""
    if axis[2] == 1.0:
        sine = float(np.hypot(lean[0], lean[1]))
        factor = np.arcsin(sine) / sine if sine > 0.0 else 1.0
        return factor * np.array([-lean[1], lean[0]])
    rotation = near.copy()
    for _ in range(50):
        now = lean_of(axis, rotation)
        miss = lean - now[:2]
        # da = p x a
        rotation = rotation + np.array([-miss[1], miss[0]]) / now[2]
        if float(np.abs(miss).max()) < 1e-16:
            break
    return rotation


def free_direction(tables: BearingTables, cage_angle: float, load: np.ndarray, radius: float) -> np.ndarray | None:
    """Return the direction in which a load moves the inner ring without end, or None if the bearing carries it.

    Parameters
    ----------
    tables : BearingTables
    cage_angle : float
        rad.
    load : ndarray, shape (3,) or (5,)
        Conjugate to displacement and leans (-a_y, a_x).
    radius : float
        Length by which moments are compared with forces, m.

    Returns
    -------
    ndarray, shape (3,) or (5,), or None
        Its rotations times ``radius``, length one.
    """
    if tables.integers[B.KIND] == B.BALL or not np.any(load):
        return None
    size = np.array([1.0, 1.0, 1.0, radius, radius])[: load.size]
    sought = load / size
    length = float(np.linalg.norm(sought))
    rows = _closing(tables, cage_angle)[:, : load.size] / size
    shares, missing = nnls(rows.T, sought / length, maxiter=100 * rows.shape[0])
    if missing <= OUTSIDE:
        return None
    return (sought / length - rows.T @ shares) / missing


def _closing(tables: BearingTables, cage_angle: float) -> np.ndarray:
    """Return how each end slice of each roller closes by (d, -a_y, a_x), shape (2 Z, 5); others lie between them."""
    ints, reals = tables.integers, tables.reals
    paths = reals[ints[B.AT_PATHS] :][: ints[B.PATHS] * B.PATH_COLUMNS].reshape(-1, B.PATH_COLUMNS)
    elements = reals[ints[B.AT_ELEMENTS] :][: ints[B.ELEMENTS] * B.ELEMENT_COLUMNS].reshape(-1, B.ELEMENT_COLUMNS)
    angle = cage_angle + elements[:, B.ELEMENT_PLACE]
    c, s = np.cos(angle), np.sin(angle)
    rows = []
    for path in (paths[0], paths[-1]):
        nx, ny = path[B.PATH_RADIAL], path[B.PATH_AXIAL]
        lever = nx * path[B.PATH_HEIGHT] - ny * path[B.PATH_RADIUS]
        rows.append(np.column_stack([nx * c, nx * s, np.full(c.size, ny), -lever * s, lever * c]))
    return np.vstack(rows)


class Equilibrium:
    """The iteration for one load: Newton's method within a trust radius, each step searched along its direction.

    Parameters
    ----------
    force : callable
        ``force(place)``: load (5,), stiffness (5, 5) by displacement and turns, and the sum of all normal forces.
    axis : ndarray, shape (3,)
        Of the inner ring, in the ring.
    wanted : ndarray, shape (3,) or (5,)
        Load.
    radius, reach : float
        Length that turns are multiplied by, and typical distance of groove centres, m.
    """

    def __init__(self, force: Callable, axis: np.ndarray, wanted: np.ndarray, radius: float, reach: float) -> None:
        self.force, self.axis, self.wanted, self.n = force, axis, wanted, wanted.size
        self.size = np.array([1.0, 1.0, 1.0, radius, radius])[: self.n]
        self.reach = reach
        self.scale = max(float(np.abs(wanted / self.size).max()), 1e-9)

    def solve(self, place: np.ndarray) -> np.ndarray:
        """Return the displacement at which the load is carried, beginning at one; the load has to be one that can be.

        Raises
        ------
        BearingError
            If the axis leans so far that the law does not hold, or the iteration does not end.
        """
        radius = 0.1 * self.reach
        for _ in range(ITERATIONS):
            gradient, hessian, miss, noise = self._at(place)
            worst = float(np.abs(miss).max())
            if worst <= BALANCED * self.scale + noise:
                return place
            step = _within(hessian, gradient, radius, BALANCED * self.scale + noise)
            there, length = self._along(place, step, float(gradient @ step))
            if there is None:
                if worst <= NEAR * self.scale + noise:
                    return place
                # shorter steps lean towards the steepest descent
                radius *= 0.1
                if radius < 1e-18:
                    break
                continue
            place, radius = there, 2.0 * length
        raise BearingError(
            f"the equilibrium under {self.wanted.tolist()} was not found within {ITERATIONS} iterations, {worst:.3g} N "
            "are not balanced; give another start"
        )

    def _at(self, place: np.ndarray, full: bool = True) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Return gradient and Hessian of Pi in metres, the unbalanced load and its rounding, N."""
        load, stiffness, pressed = self.force(place)
        n, a = self.n, lean_of(self.axis, place[3:])
        miss = (self.wanted - load[:n]) / self.size
        upright = np.ones(n)
        upright[3:] = a[2]
        gradient = -miss / upright
        matrix = stiffness[:n, :n] / np.outer(self.size, self.size)
        if n == 5:
            # load_m = a_z dU, da_z = (a_y, -a_x) . turn
            matrix[3:, 3:] -= np.outer(load[3:] / a[2], [a[1], -a[0]]) / np.outer(self.size[3:], self.size[3:])
            matrix = matrix / np.outer(upright, upright)
        matrix = 0.5 * (matrix + matrix.T)
        noise = ROUNDING * (pressed + float(np.abs(matrix).max()) * (self.reach + float(np.abs(place[:3]).max())))
        return gradient, matrix, miss, noise

    def _along(self, place: np.ndarray, step: np.ndarray, slope: float) -> tuple[np.ndarray | None, float]:
        """Return a place along a direction where Pi is about lowest, and its distance, m; None if none is lower."""
        if not slope < 0.0:
            return None, 0.0
        a = lean_of(self.axis, place[3:])[2]
        low, low_slope, high, high_slope = 0.0, slope, np.inf, 0.0
        part, best = 1.0, None
        for _ in range(SEARCHES):
            there = self._moved(place, part * step)
            load, _, _ = self.force(there)
            miss = (self.wanted - load[: self.n]) / self.size
            miss[3:] /= a
            now = -float(miss @ step)
            if now <= 0.0:
                low, low_slope, best = part, now, there
            else:
                high, high_slope = part, now
            if abs(now) <= STEEP * abs(slope):
                best = there
                low = part
                break
            if high == np.inf:
                part *= 2.0
            else:
                # the slope grows along the way: regula falsi, kept off the ends, finds its zero
                share = low_slope / (low_slope - high_slope)
                part = low + min(max(share, 0.05), 0.95) * (high - low)
                if high - low <= 1e-15 * high:
                    break
        return best, low * float(np.linalg.norm(step))

    def _moved(self, place: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return a place moved by a step in metres."""
        way = step / self.size
        there = place.copy()
        there[:3] += way[:3]
        if self.n == 5:
            lean = lean_of(self.axis, place[3:])[:2] + [way[4], -way[3]]
            if float(lean @ lean) > LEAN**2:
                raise BearingError(
                    f"under {self.wanted.tolist()} the inner ring leans by more than {LEAN} rad, where the law of the "
                    "contacts means nothing; reduce the moments, N m, or give three forces, which leave the tilt"
                )
            there[3:] = rotation_of(self.axis, lean, place[3:])
        return there


def _within(hessian: np.ndarray, gradient: np.ndarray, radius: float, rounding: float) -> np.ndarray:
    """Return the step to the minimum of a convex quadratic model within a radius.

    Directions without curvature are followed to the radius if the gradient has more than rounding there.
    """
    values, vectors = np.linalg.eigh(hessian)
    along = vectors.T @ gradient
    curved = values > FLAT * max(float(values[-1]), 0.0)
    values = np.where(curved, values, 0.0)
    along[~curved & (np.abs(along) <= rounding)] = 0.0
    active = along != 0.0
    if not np.any(active):
        return np.zeros_like(gradient)
    if np.all(curved[active]):
        newton = np.where(active, -along / np.where(curved, values, 1.0), 0.0)
        if float(np.linalg.norm(newton)) <= radius:
            return vectors @ newton

    def length(shift: float) -> float:
        return float(np.linalg.norm(along[active] / (values[active] + shift)))

    # |step| falls with the shift; at |g|/radius it is below the radius
    high = float(np.linalg.norm(along)) / radius
    low = 1e-16 * high
    for _ in range(60):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if length(middle) > radius else (low, middle)
        if high < 1.1 * low:
            break
    return vectors @ np.where(active, -along / (values + high), 0.0)
