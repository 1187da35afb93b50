"""Settings of a rolling bearing in a mechanism, and its kernel's tables: filled from geometry, settings and defects."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, ClassVar, TypedDict

import numpy as np

from gearmbs.bearings import defects as df
from gearmbs.bearings import layout as B
from gearmbs.bearings.bearing import Bearing
from gearmbs.bearings.defects import LooseFit, as_defects
from gearmbs.bearings.kinds import KINDS, BearingError, require
from gearmbs.bearings.layout import MARGIN, spline_coefficients
from gearmbs.schema.described import Described, make
from gearmbs.schema.quantities import Measure, OneOf
from gearmbs.units import Quantity, QuantityLike

SHARE = "give a share such as 0.01"
Share = Annotated[Quantity, Measure(low=0)]


@dataclass(eq=False, repr=False, kw_only=True)
class BearingSettings(Described):
    """Settings of a rolling bearing in a mechanism; see `gearmbs.bearings.RollingBearing`."""

    error: ClassVar[type[ValueError]] = BearingError
    section: ClassVar[str] = "RollingBearing"

    bearing: Bearing
    damping: Annotated[Quantity, Measure("time", 0)] = 1e-5
    cage_slip: Annotated[Quantity, Measure(above=-0.5, below=0.5, remedy=SHARE)] = 0.0
    slip_scatter: Annotated[Quantity, Measure(low=0, below=0.2, remedy=SHARE)] = 0.0
    slip_memory: Annotated[Quantity, Measure(low=0.01, high=100, remedy="give turns of the cage, 0.01 to 100")] = 0.25
    slip_seed: Annotated[int, Measure(low=0, whole=True)] = 0
    cage_angle: Annotated[Quantity, Measure("angle")] = 0.0
    preload: Annotated[Quantity, Measure("force", 0)] = 0.0
    sense: Annotated[int, OneOf((1, -1))] = 1
    centrifugal: bool = False
    smooth: Annotated[Quantity, Measure("length", 0, below=1e-3, remedy="give 0 or some um, such as '2 um'")] = 0.0
    rolling_friction: Annotated[Quantity, Measure(low=0, below=0.5, remedy="give a share such as 0.0015")] = 0.0
    viscous_friction: Share = 0.0
    slow_speed: Annotated[Quantity, Measure("angular speed", above=0)] = 1.0
    slices: Annotated[int, Measure(low=1, high=99, whole=True)] = 15
    stiffness: Annotated[Quantity, Measure(above=0)] = None
    defects: Any = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.centrifugal:
            require(self.smooth == 0.0, "RollingBearing.smooth: not together with the centrifugal load; leave it 0")
            require(self.stiffness is None, "RollingBearing.stiffness: with centrifugal load each contact has its own")
            require(
                self.bearing.rows == 1,
                f"RollingBearing.centrifugal: of two rows, as of a {self.bearing.kind} bearing, it is not known; "
                "leave it off",
            )
        self.defects = as_defects(self.defects)
        for defect in self.defects:
            require(
                not isinstance(defect, LooseFit),
                "RollingBearing.defects holds a LooseFit: such a ring is a body; use gearmbs.bearings.add_bearing",
            )
            require(
                self.bearing.rows == 1 or not isinstance(defect, df.SurfaceDefect) or defect.part != df.ELEMENT,
                f"RollingBearing.defects: a defect of an element is in one row only, and a {self.bearing.kind} bearing "
                "has two; give it of a ring, or take a bearing with one row",
            )
            defect.check(self.bearing)


class BearingKeywords(TypedDict, total=False):
    """Fields of `BearingSettings` but for the bearing, as they are given, for type checkers."""

    damping: QuantityLike
    cage_slip: QuantityLike
    slip_scatter: QuantityLike
    slip_memory: QuantityLike
    slip_seed: int
    cage_angle: QuantityLike
    preload: QuantityLike
    sense: int
    centrifugal: bool
    smooth: QuantityLike
    rolling_friction: QuantityLike
    viscous_friction: QuantityLike
    slow_speed: QuantityLike
    slices: int
    stiffness: QuantityLike | None
    defects: Any


def bearing_settings(bearing: Bearing, options: Mapping[str, Any], label: str) -> BearingSettings:
    """Return the settings of a bearing; ``label`` is what messages about their names begin with."""
    return make(BearingSettings, options, label, BearingError, "{!r} is unknown", bearing=bearing)


TYPICAL_LOAD = 0.025
"""Share of the dynamic rating at which damping is given."""

SLIP_TURNS = 1024.0
"""Turns of the cage after which its random slip repeats."""


@dataclass(frozen=True, eq=False)
class BearingTables:
    """What the kernel is given.

    Attributes
    ----------
    integers, reals : ndarray
    spinning : tuple of int
        Elements whose spin is a state.
    """

    integers: np.ndarray
    reals: np.ndarray
    spinning: tuple[int, ...]


def pack(settings: BearingSettings) -> BearingTables:
    """Fill the tables of a bearing."""
    bearing = settings.bearing
    paths, heights = _paths(settings)
    elements = _elements(settings)
    surfaces = [d for d in settings.defects if isinstance(d, df.SurfaceDefect)]
    rings = [df.profile_rows(surfaces, bearing, part, heights) for part in (df.OUTER, df.INNER)]
    spinning = tuple(sorted({d.element for d in surfaces if d.part == df.ELEMENT}))
    integers = np.zeros(B.INTEGERS + 2 * len(paths) + bearing.elements, dtype=np.int64)
    integers[B.ELEMENTS], integers[B.PATHS], integers[B.ROWS] = bearing.elements, len(paths), bearing.rows
    integers[B.KIND] = B.ROLLER if bearing.fixed_normals else B.BALL
    integers[B.SPINS], integers[B.CENTRIFUGAL] = len(spinning), settings.centrifugal
    parts = [_scalars(settings), paths.ravel(), elements.ravel()]
    integers[B.AT_PATHS] = B.REALS
    integers[B.AT_ELEMENTS] = B.REALS + paths.size
    at = B.REALS + paths.size + elements.size
    integers[B.INTEGERS :] = -1
    for k, ring in enumerate(rings):
        integers[(B.AT_OUTER, B.AT_INNER)[k]] = at
        if ring is not None:
            rows, of_path = ring
            integers[(B.OUTER_NODES, B.INNER_NODES)[k]] = rows.shape[1]
            first = B.INTEGERS + k * len(paths)
            # of two rows the first has the defects
            integers[first : first + len(paths) // bearing.rows] = of_path[: len(paths) // bearing.rows]
            parts += [spline_coefficients(row) for row in rows]
            at += sum(part.size for part in parts[-len(rows) :])
    integers[B.AT_SPIN] = at
    if spinning:
        profiles = _spin_profiles(settings, surfaces, spinning)
        integers[B.SPIN_NODES] = profiles[0].size
        parts += [spline_coefficients(profile) for profile in profiles]
        for k, element in enumerate(spinning):
            integers[B.INTEGERS + 2 * len(paths) + element] = k
    if settings.slip_scatter:
        integers[B.AT_SLIP] = sum(part.size for part in parts)
        parts.append(_random_slip(settings))
        integers[B.SLIP_NODES] = parts[-1].size - MARGIN
    return BearingTables(integers, np.concatenate(parts), spinning)


STEP = 1e-3
"""Step of differences of tables by the parameter's size: what is left off and rounding are 1e-13 of what is found."""
LEAST_STEP = 1e-6
"""The step where a parameter is zero, SI."""


def reals_by(settings: BearingSettings, name: str) -> np.ndarray:
    """Return the derivatives of the kernel's reals by a number of the settings or of the bearing, by its name.

    The tables are smooth functions of it, of which differences of sixth order are taken, to one side of a zero.

    Raises
    ------
    BearingError
        For a name that is no number of either, and for one with which the tables change their shape.
    """
    own, ring = (
        {item.name: getattr(owner, item.name) for item in fields(owner)} for owner in (settings, settings.bearing)
    )
    numbers = {key: value for key, value in (ring | own).items() if isinstance(value, float)}
    numbers["stiffness"] = series_stiffness(settings)
    require(name in numbers, f"RollingBearing: {name!r} is no number of it; give one of {', '.join(sorted(numbers))}")
    value = numbers[name]

    def table(there: float) -> np.ndarray:
        change: dict[str, Any] = {name: there}
        if name in own:
            return pack(replace(settings, **change)).reals
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return pack(replace(settings, bearing=settings.bearing.changed(**change))).reals

    step = STEP * abs(value) or LEAST_STEP
    places = np.arange(-3, 4) if value else np.arange(7)
    # of the polynomial through all of them, the slope at the middle or at zero
    weights = np.linalg.solve(np.vander(places, increasing=True).T, np.eye(7)[1])
    tables = [table(value + step * k) for k in places]
    require(
        len({one.size for one in tables}) == 1,
        f"RollingBearing.{name} is {value:g}; the tables near it differ in their number of nodes: it has no derivative",
    )
    # what does not change has no rounding either
    return np.tensordot(weights / step, np.array(tables) - pack(settings).reals, 1)


def _spin_profiles(settings: BearingSettings, surfaces: list, spinning: tuple[int, ...]) -> list[np.ndarray]:
    """Return the profiles of elements, as both rings together meet them, all with as many nodes."""
    found = [df.profile_rows(surfaces, settings.bearing, df.ELEMENT, np.zeros(1), element) for element in spinning]
    nodes = max(rows.shape[1] for rows, _ in found if rows is not None)  # type: ignore[misc]
    profiles = []
    for element in spinning:
        own = [d for d in surfaces if d.part == df.ELEMENT and d.element == element]
        one = df.profile(own, settings.bearing, nodes, 0.0)
        # the outer ring touches half a turn further on
        profiles.append(one + np.roll(one, nodes // 2))
    return profiles


def _random_slip(settings: BearingSettings) -> np.ndarray:
    """Return the coefficients of the cage's random slip: a cubic spline through the knots of a white sequence."""
    rng = np.random.default_rng(settings.slip_seed)
    inner = rng.standard_normal(max(round(SLIP_TURNS / settings.slip_memory), 8))
    inner -= inner.mean()
    # mean square of the spline by that of its coefficients: the sum of squares of the four weights over an interval
    inner *= settings.slip_scatter / math.sqrt(151.0 / 315.0)
    return np.take(inner, np.arange(inner.size + MARGIN), mode="wrap")


def transition_work(exponent: float) -> float:
    """Return the integral of s(delta)^n over a transition of half width one, see `laws_kernel.positive_part`."""
    x, weights = np.polynomial.legendre.leggauss(40)
    return float(weights @ ((x + 1.0) ** 3 * (3.0 - x) / 16.0) ** exponent)


def _scalars(settings: BearingSettings) -> np.ndarray:
    bearing = settings.bearing
    reals = np.zeros(B.REALS)
    stiffness, n = series_stiffness(settings), bearing.exponent
    reals[B.STIFFNESS], reals[B.EXPONENT] = stiffness, n
    count = bearing.rows * bearing.elements
    typical = (5.0 * TYPICAL_LOAD * bearing.rating / count / stiffness) ** (1.0 / n)
    reals[B.DAMPING] = n * settings.damping / typical
    reals[B.CAGE] = bearing.ftf * (1.0 - settings.cage_slip)
    reals[B.SPIN], reals[B.SLIP_TURNS] = bearing.bsf, SLIP_TURNS
    reals[B.DISTANCE] = 0.0 if bearing.fixed_normals else bearing.groove_distance
    reals[B.SMOOTH], reals[B.SMOOTH_WORK] = settings.smooth, settings.smooth ** (n + 1.0) * transition_work(n)
    reals[B.ROLLING] = settings.rolling_friction * 0.5 * bearing.pitch_diameter
    # 1e-7 f_0 (nu n)^(2/3) D^3 in N mm, 1/min and mm
    reals[B.VISCOUS] = 1e-10 * settings.viscous_friction * (1e3 * bearing.pitch_diameter) ** 3
    reals[B.VISCOUS] *= (60.0 / math.tau) ** (2.0 / 3.0)
    reals[B.SLOW] = settings.slow_speed
    inner, outer = np.array([0.0, 0.0, 1.0]), np.zeros(2)
    for defect in settings.defects:
        if isinstance(defect, df.Misalignment):
            lean = math.tan(defect.tilt) * np.array([math.cos(defect.angle), math.sin(defect.angle)])
            if defect.part == df.INNER:
                inner[:2] += lean
            else:
                outer += lean
    reals[B.INNER_AXIS : B.INNER_AXIS + 3] = inner / np.linalg.norm(inner)
    reals[B.OUTER_TILT : B.OUTER_TILT + 2] = outer / math.sqrt(1.0 + float(outer @ outer))
    reals[B.MASS_RADIUS] = 0.5 * bearing.element_mass * bearing.pitch_diameter
    reals[B.INNER_STIFFNESS], reals[B.OUTER_STIFFNESS] = bearing.contact_stiffness
    if not bearing.fixed_normals:
        d = bearing.element_diameter
        reals[B.INNER_REACH], reals[B.OUTER_REACH] = (
            (bearing.inner_curvature - 0.5) * d,
            (bearing.outer_curvature - 0.5) * d,
        )
        if KINDS[bearing.kind].both_ways:
            reals[B.OUTER_APART] = 2.0 * reals[B.OUTER_REACH] * math.sin(bearing.contact_angle)
    return reals


def series_stiffness(settings: BearingSettings) -> float:
    """Return K of both contacts of an element in series."""
    return settings.bearing.stiffness if settings.stiffness is None else float(settings.stiffness)


def _elements(settings: BearingSettings) -> np.ndarray:
    bearing = settings.bearing
    place = 2.0 * np.pi * np.arange(bearing.elements) / bearing.elements
    oversize = np.zeros(bearing.elements)
    for defect in settings.defects:
        if isinstance(defect, df.UnevenSpacing):
            place = place + defect.places(bearing)
        if isinstance(defect, df.OffSize):
            oversize += defect.oversize(bearing)
    return np.column_stack([np.cos(place), np.sin(place), oversize, place])


def _paths(settings: BearingSettings) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of the paths, and their places along a roller."""
    bearing = settings.bearing
    if KINDS[bearing.kind].rows == "self-aligning":
        require(
            not settings.preload,
            f"RollingBearing.preload: a {bearing.kind} bearing is preloaded by a negative clearance",
        )
        return _rays(bearing), np.zeros(2)
    if bearing.rollers:
        return _roller_paths(settings)
    angle, distance = bearing.contact_angle, bearing.groove_distance
    reach = (bearing.inner_curvature - 0.5) * bearing.element_diameter
    rows = []
    for sign, place in _senses(settings):
        radial = distance * math.cos(angle) - 0.5 * bearing.clearance
        axial = sign * distance * math.sin(angle)
        radius = 0.5 * bearing.pitch_diameter + reach * math.cos(angle)
        rows.append([radial, axial, radius, place + sign * reach * math.sin(angle), 1.0, 0.0])
    if settings.preload:
        _preload_balls(settings, rows)
    return np.array(rows), np.zeros(len(rows))


def _senses(settings: BearingSettings) -> tuple[tuple[float, float], ...]:
    """Return the sense along the axis and the height of each path of a ball."""
    bearing = settings.bearing
    if bearing.rows == 2:
        # back to back: the row below presses upward
        return (1.0, -bearing.offset), (-1.0, bearing.offset)
    return ((1.0, 0.0), (-1.0, 0.0)) if KINDS[bearing.kind].both_ways else ((float(settings.sense), 0.0),)


def _rays(bearing: Bearing) -> np.ndarray:
    """Return the paths of both rows of a self-aligning bearing: their lines of contact meet in its middle.

    The outer raceway is a sphere about it, so that normals are fixed in the outer ring, and at the radius R and the
    height R tan(a) a tilt moves nothing along them.
    """
    rows = np.zeros((2, B.PATH_COLUMNS))
    cosine, radius = math.cos(bearing.contact_angle), 0.5 * bearing.pitch_diameter
    for row, sign in zip(rows, (-1.0, 1.0)):
        height = sign * bearing.offset
        row[B.PATH_RADIUS], row[B.PATH_HEIGHT], row[B.PATH_SHARE] = radius, height, 1.0
        row[B.PATH_RADIAL], row[B.PATH_AXIAL] = cosine, cosine * height / radius
        row[B.PATH_GAP] = 0.5 * bearing.clearance * cosine
    return rows


def _preload_balls(settings: BearingSettings, rows: list[list[float]]) -> None:
    """Shift the inner grooves along the axis until the axial force is the preload."""
    from scipy.optimize import brentq

    bearing = settings.bearing
    require(
        KINDS[bearing.kind].preloaded,
        f"RollingBearing.preload: a {bearing.kind} bearing is preloaded by a negative clearance, or by its neighbour",
    )
    radial, axial = rows[0][0], abs(rows[0][1])

    def missing(shift: float) -> float:
        length = math.hypot(radial, axial + shift)
        delta = max(length - bearing.groove_distance, 0.0)
        force = bearing.elements * series_stiffness(settings) * delta**1.5 * (axial + shift) / length
        return force - settings.preload

    _check_preload(settings, missing(0.0))
    top = 1e-6
    while missing(top) < 0.0:
        top *= 2.0
        if top > bearing.element_diameter:
            raise BearingError(f"RollingBearing.preload is {settings.preload:g} N; the balls cannot carry it")
    rows[0][1] += settings.sense * brentq(missing, 0.0, top, xtol=1e-16, rtol=1e-14)


def _roller_paths(settings: BearingSettings) -> tuple[np.ndarray, np.ndarray]:
    bearing = settings.bearing
    count, length, angle = settings.slices, bearing.roller_length, bearing.contact_angle
    assert length is not None
    place = length * ((np.arange(count) + 0.5) / count - 0.5)
    sense, cosine, sine = float(settings.sense), math.cos(angle), math.sin(angle)
    across = np.zeros(count)
    if bearing.rows == 2:
        place = np.tile(place, 2)
        across = np.repeat([-bearing.offset, bearing.offset], count)
    rows = np.zeros((place.size, B.PATH_COLUMNS))
    rows[:, B.PATH_RADIAL], rows[:, B.PATH_AXIAL] = cosine, sense * sine
    rows[:, B.PATH_RADIUS] = 0.5 * bearing.pitch_diameter - place * sine
    rows[:, B.PATH_HEIGHT] = sense * place * cosine + across
    rows[:, B.PATH_SHARE] = 1.0 / count
    rows[:, B.PATH_GAP] = 0.5 * bearing.clearance * cosine + crown(bearing, place)
    if settings.preload:
        rows[:, B.PATH_GAP] -= _roller_preload(settings, rows)
    return rows, place


def crown(bearing: Bearing, place: np.ndarray) -> np.ndarray:
    """Return the profile of a roller at places along its length: 0.00035 d ln(1/(1 - (2 x/L)^2)), ISO/TS 16281."""
    length = bearing.roller_length
    assert length is not None
    return 0.00035 * bearing.element_diameter * np.log(1.0 / (1.0 - (2.0 * place / length) ** 2))


def _check_preload(settings: BearingSettings, excess: float) -> None:
    """Refuse a preload below what a negative clearance presses already."""
    require(
        excess <= 0.0,
        f"RollingBearing.preload is {settings.preload:g} N, and by its clearance of "
        f"{1e6 * settings.bearing.clearance:g} um the bearing presses with {settings.preload + excess:.4g} N already; "
        "leave one of the two away, or give a larger preload",
    )


def _roller_preload(settings: BearingSettings, rows: np.ndarray) -> float:
    from scipy.optimize import brentq

    bearing = settings.bearing
    require(
        KINDS[bearing.kind].preloaded,
        f"RollingBearing.preload: a {bearing.kind} bearing is preloaded by a negative clearance",
    )
    sine = math.sin(bearing.contact_angle)

    def missing(closer: float) -> float:
        delta = np.maximum(closer - rows[:, B.PATH_GAP], 0.0)
        force = float(np.sum(rows[:, B.PATH_SHARE] * series_stiffness(settings) * delta**bearing.exponent))
        return bearing.elements * force * sine - settings.preload

    _check_preload(settings, missing(0.0))
    top = 1e-6
    while missing(top) < 0.0:
        top *= 2.0
        require(top < bearing.element_diameter, f"RollingBearing.preload is {settings.preload:g} N; too much")
    return float(brentq(missing, 0.0, top, xtol=1e-16, rtol=1e-14))
