"""A bearing at rest: what it carries at a displacement, where a load puts it, and its stiffness there.

The rings' displacement has five components, x, y, z of the inner ring's middle and its tilts about x and y, in the axes
of the outer ring; loads are those that act on the inner ring from outside, with moments about its middle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Unpack

import numpy as np
import numpy.typing as npt
from scipy.optimize import nnls

from gearmbs.bearings import layout as B
from gearmbs.bearings.bearing import Bearing
from gearmbs.bearings.kinds import KINDS, BearingError, require
from gearmbs.bearings.settings import BearingKeywords, BearingTables, bearing_settings, pack
from gearmbs.units import QuantityLike, to_si
from gearmbs.wording import warn

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


AXES = ("x", "y", "z", "tilt x", "tilt y")

AGAINST = 1e-6
"""Axial load against the sense of an angular contact bearing, by the sum of its elements' forces, that is rounding."""


@dataclass(frozen=True, eq=False)
class BearingState:
    """A loaded bearing.

    Attributes
    ----------
    displacement : ndarray, shape (5,)
        x, y, z (m) and tilts about x and y (rad) of the inner ring.
    load : ndarray, shape (5,)
        Forces (N) and moments (N m) on the inner ring that hold it there.
    stiffness : ndarray, shape (5, 5)
        d load/d displacement.
    element_loads : ndarray, shape (Z,) or (2 Z,)
        Normal force of each element on the inner ring, N; of four points the sum of both vectors, of two rows those of
        the first, at negative z, and then of the second.
    element_angles : ndarray, as many
        Where each element is, rad from x.
    contact_angles : ndarray, as many
        Angle of each normal force against the radial plane, rad; NaN without force.
    """

    displacement: np.ndarray
    load: np.ndarray
    stiffness: np.ndarray
    element_loads: np.ndarray
    element_angles: np.ndarray
    contact_angles: np.ndarray

    @property
    def loaded(self) -> int:
        """Number of loaded elements."""
        return int(np.sum(self.element_loads > 0.0))

    @property
    def largest(self) -> float:
        """Force of the most loaded element, N."""
        return float(self.element_loads.max())

    def to_dataset(self):
        """Return all of it as a labelled `xarray.Dataset`."""
        import xarray as xr

        return xr.Dataset(
            {
                "displacement": ("axis", self.displacement),
                "load": ("axis", self.load),
                "stiffness": (("axis", "by"), self.stiffness),
                "element_load": ("element", self.element_loads, {"units": "N"}),
                "element_angle": ("element", self.element_angles, {"units": "rad"}),
                "contact_angle": ("element", self.contact_angles, {"units": "rad"}),
            },
            {"axis": list(AXES), "by": list(AXES)},
        )


class StaticsKeywords(BearingKeywords, total=False):
    """Keywords of `BearingStatics`, for type checkers."""

    speed: QuantityLike


class BearingStatics:
    """A bearing between two rings at rest or at a constant speed.

    Parameters
    ----------
    bearing : Bearing
    speed : float or str
        Of the inner ring, rad/s; it counts with centrifugal load only.
    **settings
        As of `gearmbs.bearings.RollingBearing`, such as ``preload``, ``centrifugal``, ``defects`` or ``stiffness``.

    Examples
    --------
    >>> statics = BearingStatics(Bearing.from_designation("6205"))
    >>> state = statics.under([1000.0, 0.0, 0.0])
    >>> round(float(1e6 * state.displacement[0]), 2), state.loaded
    (13.93, 5)
    """

    def __init__(self, bearing: Bearing, *, speed: QuantityLike = 0.0, **settings: Unpack[BearingKeywords]) -> None:
        self.settings = bearing_settings(bearing, settings, "BearingStatics")
        try:
            self.speed = to_si(speed, "angular speed", "speed")
        except TypeError as error:
            raise BearingError(f"BearingStatics: {error}") from None
        self.bearing = bearing
        self.tables = pack(self.settings)

    def at(self, displacement: npt.ArrayLike, cage_angle: float | None = None) -> BearingState:
        """Return the bearing at a displacement of three or five components, m and rad."""
        place = self._five(displacement, "displacement")
        load, stiffness = self._load(place, cage_angle)
        return self._state(place, load, stiffness, cage_angle)

    def under(
        self, load: npt.ArrayLike, *, cage_angle: float | None = None, start: npt.ArrayLike | None = None
    ) -> BearingState:
        """Return the bearing under a load.

        Parameters
        ----------
        load : sequence of 3 or 5 floats or str
            Forces on the inner ring, N; with five also moments, N m. With three the tilt stays as in ``start``, and
            the moments are what that takes.
        cage_angle : float, optional
            Of element 0, rad.
        start : sequence of float, optional
            Displacement to begin with.

        Where a load leaves a direction open, such as the axis of cylindrical rollers, it stays as in ``start``.

        Raises
        ------
        BearingError
            If the bearing cannot carry the load: there is a direction in which it moves the ring without end, see
            `gearmbs.bearings.statics`.

        Warns
        -----
        UserWarning
            If an angular contact bearing carries an axial load against its sense, on the other shoulder of its grooves.
        """
        wanted = _numbers(load, "load", ("force", "torque"))
        place = self._first(wanted) if start is None else self._five(start, "start")
        place = self._carried(place, wanted, cage_angle)
        found, stiffness = self._load(place, cage_angle)
        state = self._state(place, found, stiffness, cage_angle)
        against = -self.settings.sense * float(found[2])
        if KINDS[self.bearing.kind].one_shoulder and against > AGAINST * float(state.element_loads.sum()):
            name = f" {self.bearing.designation}" if self.bearing.designation else ""
            warn(
                f"{self.bearing.kind} bearing{name}: {against:.4g} N along the axis press against its sense "
                f"({self.settings.sense:+d}) and are carried across the groove, on a shoulder that most such bearings "
                "do not have; turn the load or the sense, or add a second bearing",
            )
        return state

    def curve(self, loads: Iterable[npt.ArrayLike], *, cage_angle: float | None = None) -> list[BearingState]:
        """Return the bearing under loads that follow each other, each beginning where the last one ended."""
        found: list[BearingState] = []
        for load in loads:
            start = found[-1].displacement if found else None
            found.append(self.under(load, cage_angle=cage_angle, start=start))
        return found

    def deflection_curve(self, direction: npt.ArrayLike, loads: npt.ArrayLike, *, cage_angle: float | None = None):
        """Return displacement and stiffness along a direction over the size of a load.

        Parameters
        ----------
        direction : sequence of 3 or 5 floats
            Of the load; its first three components are made a unit vector, moments are taken by it.
        loads : sequence of float
            Sizes, N, growing.

        Returns
        -------
        xarray.Dataset
            Over ``load``: ``deflection`` (m) and ``stiffness`` (N/m) along the force, all five components of
            ``displacement``, number of loaded elements and the largest element force.

        Examples
        --------
        >>> curve = BearingStatics(Bearing.from_designation("6205")).deflection_curve([1, 0, 0], [100.0, 1000.0])
        >>> [round(float(1e6 * d), 1) for d in curve.deflection]
        [3.0, 13.9]
        """
        import xarray as xr

        along = np.asarray(direction, dtype=float)
        size = float(np.linalg.norm(along[:3])) if along.shape in ((3,), (5,)) else 0.0
        require(size > 0.0, f"direction is {direction!r}; give 3 or 5 numbers with a force among them")
        along = along / size
        sizes = np.asarray(loads, dtype=float)
        states = self.curve([load * along for load in sizes], cage_angle=cage_angle)
        force = along[:3]
        # by the flexibility: what the load does not hold gives way
        held = [state.stiffness[: along.size, : along.size] for state in states]
        softness = [float(along @ np.linalg.lstsq(matrix, along, rcond=1e-12)[0]) for matrix in held]
        return xr.Dataset(
            {
                "deflection": ("load", [float(force @ state.displacement[:3]) for state in states], {"units": "m"}),
                "stiffness": ("load", 1.0 / np.array(softness), {"units": "N/m"}),
                "displacement": (("load", "axis"), np.stack([state.displacement for state in states])),
                "loaded_elements": ("load", [state.loaded for state in states]),
                "largest_element_force": ("load", [state.largest for state in states], {"units": "N"}),
            },
            {"load": ("load", sizes, {"units": "N"}), "axis": list(AXES)},
        )

    def _carried(self, place: np.ndarray, wanted: np.ndarray, cage_angle: float | None) -> np.ndarray:
        """Return the displacement under a load, or refuse a load that nothing balances."""
        reals, radius = self.tables.reals, 0.5 * self.bearing.pitch_diameter
        angle = self.settings.cage_angle if cage_angle is None else cage_angle
        free = free_direction(self.tables, angle, wanted, radius)
        if free is not None:
            way = ", ".join(f"{part:+.3g} {name}" for part, name in zip(free, AXES) if abs(part) > 1e-3)
            raise BearingError(
                f"no equilibrium under {wanted.tolist()} N: the bearing does not carry it in this direction; nothing "
                f"stops the inner ring along ({way}), tilts times half the pitch diameter (an axial load needs a "
                "contact angle or ball grooves, and the right sense; tapered rollers need one under a radial load)"
            )

        def force(there: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
            return self._pressed(there, cage_angle)

        # X and Y are about as long as the groove centres are apart, those of rollers about as the gap
        bearing = self.bearing
        reach = 1e-2 * bearing.element_diameter if bearing.fixed_normals else bearing.groove_distance
        axis = reals[B.INNER_AXIS : B.INNER_AXIS + 3].copy()
        return Equilibrium(force, axis, wanted, radius, reach).solve(place)

    def _first(self, wanted: np.ndarray) -> np.ndarray:
        """Return a displacement in the direction of the load that closes the clearance."""
        settings, bearing = self.settings, self.bearing
        stiffness = settings.stiffness or bearing.stiffness
        place = np.zeros(5)
        radial, axial = float(np.hypot(*wanted[:2])), float(wanted[2])
        approach = (5.0 * (radial + abs(axial)) / bearing.elements / stiffness) ** (1.0 / bearing.exponent)
        if radial > 0.0:
            gap = max(0.5 * bearing.clearance, 0.0)
            place[:2] = wanted[:2] / radial * (gap + approach)
        if axial:
            free = 0.0
            if not bearing.fixed_normals and bearing.clearance > 0.0:
                radial_distance = bearing.groove_distance * np.cos(bearing.contact_angle) - 0.5 * bearing.clearance
                free = np.sqrt(max(bearing.groove_distance**2 - radial_distance**2, 0.0))
            place[2] = np.sign(axial) * (free + approach)
        return place

    def _five(self, values: npt.ArrayLike, field: str) -> np.ndarray:
        numbers = _numbers(values, field, ("length", "angle"))
        return np.concatenate([numbers, np.zeros(5 - numbers.size)])

    def _load(
        self, place: np.ndarray, cage_angle: float | None, tables: BearingTables | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the load on the inner ring and its derivatives by the displacement."""
        return self._pressed(place, cage_angle, tables)[:2]

    def _pressed(
        self, place: np.ndarray, cage_angle: float | None, tables: BearingTables | None = None
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the load on the inner ring, its derivatives by the displacement, and the sum of all normal forces."""
        from gearmbs.bearings.kernel import bearing_force
        from gearmbs.dae.equations.loads.forces import DERIVATIVES

        tables = self.tables if tables is None else tables
        frames = _frames(place, self.speed)
        states = np.zeros(1 + len(tables.spinning))
        states[0] = self.settings.cage_angle if cage_angle is None else cage_angle
        wrench, rates = np.zeros((1, 6)), np.zeros(states.size)
        jac = np.zeros((6 + states.size, 24 + states.size))
        work = np.zeros(B.scratch(len(tables.spinning)))
        bearing_force(
            tables.integers, tables.reals, 0.0, frames, states, np.zeros(0), DERIVATIVES, work, wrench, rates, jac,
            np.zeros(7),
        )  # fmt: skip
        return -wrench[0, :5], -jac[:5, :5], float(work[B.S_SUMS])

    def _state(
        self, place: np.ndarray, load: np.ndarray, stiffness: np.ndarray, cage_angle: float | None
    ) -> BearingState:
        tables, z, rows = self.tables, self.bearing.elements, self.bearing.rows
        start = self.settings.cage_angle if cage_angle is None else cage_angle
        at = int(tables.integers[B.AT_ELEMENTS])
        places = tables.reals[at + B.ELEMENT_PLACE : at + B.ELEMENT_COLUMNS * z : B.ELEMENT_COLUMNS]
        angles = np.tile(start + places, rows)
        loads, contact = np.zeros(rows * z), np.full(rows * z, np.nan)
        for j in range(rows * z):
            integers = B.one_element(tables.integers, rows, *divmod(j, z))
            one = BearingTables(integers, tables.reals, tables.spinning)
            force, _ = self._load(place, cage_angle, one)
            radial = force[0] * np.cos(angles[j]) + force[1] * np.sin(angles[j])
            loads[j] = np.hypot(radial, force[2])
            if loads[j] > 0.0:
                contact[j] = np.arctan2(force[2], radial)
        return BearingState(place, load, stiffness, loads, angles, contact)


def _numbers(values: Any, field: str, dimensions: tuple[str, str]) -> np.ndarray:
    """Return three or five numbers, given as such or as texts with a unit; the last two have another dimension."""
    asked = f"{field} is {values!r}; give 3 or 5 numbers"
    if isinstance(values, list | tuple) and len(values) in (3, 5) and any(isinstance(value, str) for value in values):
        kinds = (dimensions[0],) * 3 + (dimensions[1],) * 2
        try:
            values = [to_si(value, kind, field) for value, kind in zip(values, kinds)]
        except (TypeError, ValueError) as error:
            raise BearingError(str(error)) from None
    try:
        numbers = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise BearingError(asked) from None
    require(numbers.shape in ((3,), (5,)) and bool(np.all(np.isfinite(numbers))), asked)
    return numbers


def _frames(place: np.ndarray, speed: float) -> np.ndarray:
    """Return the frames of a displaced inner ring and of the outer ring."""
    frames = np.zeros((2, 18))
    frames[:, 3:12] = np.eye(3).ravel()
    frames[0, :3] = place[:3]
    angle = float(np.hypot(place[3], place[4]))
    if angle > 0.0:
        x, y = place[3] / angle, place[4] / angle
        c, s = np.cos(angle), np.sin(angle)
        frames[0, 3:12] = [
            c + x * x * (1 - c), x * y * (1 - c), y * s, x * y * (1 - c), c + y * y * (1 - c), -x * s, -y * s, x * s, c,
        ]  # fmt: skip
    frames[0, 15:18] = speed * frames[0, [5, 8, 11]]
    return frames


def stiffness_matrix(bearing: Bearing, load: npt.ArrayLike, **settings: Unpack[StaticsKeywords]) -> np.ndarray:
    """Return the stiffness of a bearing under a load, shape (5, 5), N/m, N/rad and N m/rad; see `BearingStatics`."""
    return BearingStatics(bearing, **settings).under(load).stiffness
