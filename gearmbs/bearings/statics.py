"""A bearing at rest: what it carries at a displacement, where a load puts it, and its stiffness there.

The rings' displacement has five components, x, y, z of the inner ring's middle and its tilts about x and y, in the axes
of the outer ring; loads are those that act on the inner ring from outside, with moments about its middle.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import numpy.typing as npt

from gearmbs.bearings import layout as B
from gearmbs.bearings.bearing import Bearing
from gearmbs.bearings.equilibrium import Equilibrium, free_direction
from gearmbs.bearings.kinds import KINDS, BearingError, require
from gearmbs.bearings.settings import BearingKeywords, BearingTables, bearing_settings, pack
from gearmbs.units import QuantityLike, to_si
from gearmbs.wording import warn

if TYPE_CHECKING:
    import xarray as xr

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

    def to_dataset(self) -> xr.Dataset:
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
            If an angular contact or thrust ball bearing carries an axial load against its sense, on the other shoulder
            of its grooves.
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

    def deflection_curve(
        self, direction: npt.ArrayLike, loads: npt.ArrayLike, *, cage_angle: float | None = None
    ) -> xr.Dataset:
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
