"""A rolling bearing between a shaft and a housing: the force element, and its life under the loads of a run."""

from __future__ import annotations

import math
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from gearmbs.bearings import layout as B
from gearmbs.bearings.bearing import Bearing
from gearmbs.bearings.clearance import ClearanceForce
from gearmbs.bearings.defects import INNER, OUTER, Defect, LooseFit, as_defects
from gearmbs.bearings.kinds import LOOSEST, BearingError, require
from gearmbs.bearings.rating import equivalent_load, mean_load, rating_life
from gearmbs.bearings.settings import BearingSettings, BearingTables, bearing_settings, pack, reals_by
from gearmbs.dae.equations.loads.forces import COUNT, DISSIPATED, STORED, Diagnostic
from gearmbs.mechanism.parts.bodies import Body
from gearmbs.mechanism.parts.elements import Allowed, Compiled, ForceElement, Setting, State
from gearmbs.mechanism.parts.quantities import Vector, frame_along

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.bearings.settings import BearingKeywords
    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism import Mechanism
    from gearmbs.mechanism.parts.bodies import Marker


class RollingBearing(ForceElement):
    """A rolling bearing: inner ring at marker I, outer ring at marker J, z along the axis, origins in its middle.

    Every rolling element presses both rings with its Hertz force; the cage has an angle of its own, a state, seen from
    the outer ring. See the theory page on rolling bearings for the equations.

    Parameters
    ----------
    name : str
    i, j : Marker
        Of the inner and of the outer ring. Either may be the one that turns.
    bearing : Bearing
    damping : float or str
        Damping of the contacts as a time, s: damper by spring under 2.5 % of the dynamic rating; it grows with load,
        so that the range measured on bearings, 0.25e-5 to 2.5e-5 s, is that of 0.3 to 10 % of the rating.
    cage_slip : float
        Share by which the cage is slower than ideal rolling, in the mean.
    slip_scatter : float
        Standard deviation of the slip about its mean: a share, drawn with ``slip_seed``. It makes the lines of defects
        as broad as measured ones, whose blows come at times that are a little random.
    slip_memory : float
        Turns of the cage over which the slip forgets itself.
    slip_seed : int
    cage_angle : float or str
        Angle of element 0 at the start, from x of J, rad.
    preload : float or str
        Axial force with the rings at zero displacement, N, for bearings with a contact angle.
    sense : {1, -1}
        Direction along z in which the inner ring of an angular contact or tapered bearing presses into the outer one.
    centrifugal : bool
        Let the elements' own centrifugal load press them outward; of balls both contact angles then differ. For
        bearings with one row.
    smooth : float or str
        Half width of a smooth transition of contact, m; 0 keeps Hertz's law.
    rolling_friction : float
        mu of the friction torque mu (D/2) sum Q.
    viscous_friction : float
        f_0 nu^(2/3) of Palmgren's speed torque 1e-7 f_0 (nu n)^(2/3) D^3 (N mm, 1/min, nu in mm^2/s).
    slow_speed : float or str
        Speed below which the friction torque falls to zero, rad/s.
    slices : int
        Of a roller, along its length.
    stiffness : float, optional
        K of both contacts of an element in series, N/m^n, instead of Hertz's.
    defects : sequence of Defect
        Or tables of a file, see `gearmbs.bearings.defects.as_defects`.

    Raises
    ------
    BearingError
        If a setting makes no sense; the message names it.

    Examples
    --------
    >>> from gearmbs.mechanism import Mechanism
    >>> m = Mechanism("one shaft")
    >>> shaft = m.body("shaft", mass=1.0, inertia=(1e-3, 1e-3, 1e-3))
    >>> bearing = Bearing.from_designation("6205")
    >>> element = m.add(RollingBearing("A", shaft.marker(), m.ground.marker(), bearing=bearing))
    """

    kind = "rolling bearing"
    instead = "take an elastic bearing of its stiffness (ElasticBearing, Mechanism.bushing), or take it out first"
    diagnostics = (
        Diagnostic("elastic_energy", "J", STORED),
        Diagnostic("damping_power", "W", DISSIPATED),
        Diagnostic("friction_power", "W", DISSIPATED),
        Diagnostic("normal_force", "N"),
        Diagnostic("largest_element_force", "N"),
        Diagnostic("largest_deflection", "m"),
        Diagnostic("loaded_elements", "1", COUNT),
    )

    def __init__(self, name: str, i: Any, j: Any, bearing: Bearing, **settings: Unpack[BearingKeywords]) -> None:
        super().__init__(name, i, j)
        self.settings = bearing_settings(bearing, settings, "RollingBearing")
        self.tables = pack(self.settings)
        angle = self.settings.cage_angle
        self._states = (State(f"{name}.cage", start=angle),) + tuple(
            State(f"{name}.spin {k}") for k in self.tables.spinning
        )

    @classmethod
    def between(
        cls, name: str, inner: Body, outer: Body, bearing: Bearing, *, at: Vector, axis: Vector = (0.0, 0.0, 1.0),
        x: Vector | None = None, **settings: Unpack[BearingKeywords],
    ) -> RollingBearing:  # fmt: skip
        """Return a bearing between two bodies, as they stand now.

        Parameters
        ----------
        inner, outer : Body
            Bodies that hold the rings, usually shaft and housing.
        at : array_like
            Middle of the bearing, global components, m.
        axis, x : array_like
            Directions of z and, roughly, of x, from which angles count, global components.
        **settings
            As of the class.

        Examples
        --------
        >>> from gearmbs.mechanism import Mechanism
        >>> m = Mechanism("one shaft")
        >>> shaft = m.body("shaft", mass=1.0, inertia=(1e-3, 1e-3, 1e-3))
        >>> bearing = Bearing.from_designation("6205")
        >>> element = m.add(RollingBearing.between("A", shaft, m.ground, bearing, at=(0, 0, 0.1)))
        """
        frame = frame_along(axis, f"bearing '{name}': axis", x)
        return cls(
            name, inner.marker_at(at, frame, name=f"{name}.I"), outer.marker_at(at, frame, name=f"{name}.J"), bearing,
            **settings,
        )  # fmt: skip

    @property
    def bearing(self) -> Bearing:
        """The bearing."""
        return self.settings.bearing

    @property
    def defects(self) -> tuple[Defect, ...]:
        """Its defects."""
        return tuple(self.settings.defects)

    @property
    def states(self) -> tuple[State, ...]:
        """Cage angle, then spins of elements with a profile, rad."""
        return self._states

    def compiled(self) -> Compiled:
        from gearmbs.bearings.kernel import bearing_force

        tables = self.tables
        return Compiled(
            bearing_force, tables.integers, tables.reals, scratch=B.scratch(len(tables.spinning)),
            settings=clearance_setting(self.settings, tables),
        )  # fmt: skip

    def by_parameter(
        self, name: str, frames: np.ndarray, states: np.ndarray | None = None, inputs: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the exact derivatives of wrench and rates by a number of the settings or of the bearing.

        Parameters
        ----------
        name : str
            A setting such as ``"stiffness"`` (by default that of Hertz), ``"damping"`` or ``"preload"``, or a field of
            the bearing such as ``"clearance"`` or ``"pitch_diameter"``.
        frames : ndarray, shape (2, 18)
            Of markers I and J as kernels see them: origin, orientation by rows, velocity, angular velocity.
        states, inputs : ndarray, optional
            Of the element, see `states`, by default zeros; there are no inputs.

        Returns
        -------
        ndarray, shape (6 + states,)
            Of force and torque on the inner ring, global components, and of the rates, by the parameter in SI.

        Raises
        ------
        BearingError
            For a name that is no number of either or with which the tables change their shape; with centrifugal load.

        Examples
        --------
        >>> import numpy as np
        >>> from gearmbs.mechanism import Mechanism
        >>> ground = Mechanism("held").ground
        >>> bearing = Bearing.from_designation("6205")
        >>> element = RollingBearing("A", ground.marker(), ground.marker(), bearing=bearing)
        >>> frames = np.zeros((2, 18))
        >>> frames[:, 3:12] = np.eye(3).ravel()
        >>> frames[0, 0] = 2e-5
        >>> bool(element.by_parameter("clearance", frames, np.zeros(1))[0] > 0.0)
        True
        """
        from gearmbs.bearings.layout import scratch
        from gearmbs.bearings.parameters_kernel import bearing_force_changed

        require(
            not self.settings.centrifugal,
            f"bearing '{self.name}': centrifugal is True; derivatives by parameters are known without that load",
        )
        tables, out = self.tables, np.zeros(6 + len(self.states))
        changed, work = reals_by(self.settings, name), np.zeros(scratch(len(tables.spinning)))
        own = np.zeros(len(self.states)) if states is None else states
        bearing_force_changed(tables.integers, tables.reals, changed, frames, own, work, out)
        return out

    def __repr__(self) -> str:
        name = self.bearing.designation or self.bearing.kind
        return f"RollingBearing({self.name!r}, {name}, {self.i.body.name!r} in {self.j.body.name!r})"


def clearance_setting(settings: BearingSettings, tables: BearingTables) -> dict[str, Setting]:
    """Return where the diametral clearance stands among the reals: in each path; of a preloaded bearing all follows."""
    if settings.preload:
        return {}
    bearing, first = settings.bearing, int(tables.integers[B.AT_PATHS])
    column, slope = (
        (B.PATH_GAP, 0.5 * math.cos(bearing.contact_angle)) if bearing.fixed_normals else (B.PATH_RADIAL, -0.5)
    )
    places = first + column + B.PATH_COLUMNS * np.arange(int(tables.integers[B.PATHS]))
    found = [(int(at), slope, float(tables.reals[at]) - slope * bearing.clearance) for at in places]
    (at, factor, offset), *others = found
    most = LOOSEST * bearing.element_diameter
    return {"clearance": Setting(at, "m", factor, offset, tuple(others), Allowed(-most, most, above=True))}


# A rolling bearing in a mechanism, its rings fixed or loose on their seats.


DEPTH = 1e-6
"""Penetration at which the damping of a seat is fully on, m."""
LANDS = 0.4
"""Where a ring sits on its seat: so many widths to either side of its middle."""
STEEL = 7800.0
"""Density of a ring, kg/m^3."""
GROOVE = 0.35
"""Middle radius of a ring's raceway from the pitch radius, in ball diameters."""


def add_bearing(
    m: Mechanism, name: str, inner: Marker, outer: Marker, bearing: Bearing, **settings: Unpack[BearingKeywords]
) -> RollingBearing:
    """Add a rolling bearing between two markers; rings with a `LooseFit` become bodies of their own.

    A loose ring touches its seat at two lands with a clearance, is held along the axis by a spring, and creeps in its
    seat against a viscous drag. Its mass follows from the bearing's boundary dimensions.

    Parameters
    ----------
    m : Mechanism
    name : str
        Of the bearing; a loose ring's body is "<name>.outer ring" or "<name>.inner ring", its seats "<name>.outer seat
        1" and so on.
    inner, outer : Marker
        On shaft and housing, coinciding, z along the axis.
    bearing : Bearing
    **settings
        As of `RollingBearing`; among ``defects`` there may be a `LooseFit` for each ring.

    Returns
    -------
    RollingBearing

    Examples
    --------
    >>> from gearmbs.bearings import LooseFit
    >>> from gearmbs.mechanism import Mechanism
    >>> m = Mechanism("one shaft")
    >>> shaft = m.body("shaft", mass=1.0, inertia=(1e-3, 1e-3, 1e-3))
    >>> bearing = Bearing.from_designation("6205")
    >>> found = add_bearing(m, "A", shaft.marker(), m.ground.marker(), bearing, defects=[LooseFit(clearance="20 um")])
    >>> sorted(m.bodies)
    ['A.outer ring', 'shaft']
    """
    given: dict[str, Any] = {**settings}
    defects = as_defects(given.pop("defects", ()))
    fits = {defect.part: defect for defect in defects if isinstance(defect, LooseFit)}
    rest = [defect for defect in defects if not isinstance(defect, LooseFit)]
    require(
        len(fits) + len(rest) == len(defects), f"bearing '{name}': more than one LooseFit of a ring; give one for each"
    )
    if OUTER in fits:
        outer = _ring(m, name, OUTER, outer, fits[OUTER], bearing)
    if INNER in fits:
        inner = _ring(m, name, INNER, inner, fits[INNER], bearing)
    made = RollingBearing(name, inner, outer, bearing=bearing, defects=rest, **given)
    m.add(made)
    return made


def _ring(m: Mechanism, name: str, part: str, seat: Marker, fit: LooseFit, bearing: Bearing) -> Marker:
    """Add a loose ring as a body on its seat; return its marker for the bearing."""
    fit.check(bearing)
    body, at, frame = seat.body, seat.global_position(), seat.global_orientation()
    mass, moments = ring_inertia(bearing, part)
    velocity = body.velocity + np.cross(body.angular_velocity, at - body.position)
    label = f"{name}.{part} ring"
    ring = m.body(
        label, mass, moments, position=at, orientation=frame, velocity=velocity,
        angular_velocity=body.angular_velocity,
    )  # fmt: skip
    width = bearing.width
    assert width is not None
    reals = (0.5 * fit.clearance, 0.5 * fit.stiffness, 1.0, 0.5 * fit.stiffness * fit.damping, DEPTH)
    for k, side in enumerate((-LANDS, LANDS)):
        where = at + side * width * frame[:, 2]
        own, other = ring.marker_at(where, frame), body.marker_at(where, frame)
        # the ring is the journal in a housing, and the bore on a shaft
        pair = (own, other) if part == OUTER else (other, own)
        m.add(ClearanceForce(f"{name}.{part} seat {k + 1}", *pair, reals))
    stiffness, damping = np.zeros((6, 6)), np.zeros((6, 6))
    stiffness[2, 2], damping[2, 2], damping[5, 5] = fit.stiffness, fit.stiffness * fit.damping, fit.creep
    m.field(f"{name}.{part} shoulder", ring.marker_at(at, frame), seat, stiffness=stiffness, damping=damping)
    return ring.marker_at(at, frame, name=f"{name}.{part}")


def ring_inertia(bearing: Bearing, part: str) -> tuple[float, tuple[float, float, float]]:
    """Return mass (kg) and moments of inertia (kg m^2) of a ring, a tube from its seat to the middle of its raceway.

    Raises
    ------
    BearingError
        Without boundary dimensions.
    """
    seat = bearing.outside_diameter if part == OUTER else bearing.bore
    if seat is None or bearing.width is None:
        field = "outside_diameter" if part == OUTER else "bore"
        raise BearingError(f"LooseFit: the ring's mass needs Bearing.{field} and Bearing.width; give them")
    sign = 1.0 if part == OUTER else -1.0
    race, width = 0.5 * bearing.pitch_diameter + sign * GROOVE * bearing.element_diameter, bearing.width
    mass = STEEL * math.pi * abs((0.5 * seat) ** 2 - race**2) * width
    square = (0.5 * seat) ** 2 + race**2
    across = mass * (3.0 * square + width**2) / 12.0
    return mass, (across, across, 0.5 * mass * square)


# Rolling bearings of a mechanism as plain data, for storing beside results.


def described(mechanism: Mechanism) -> dict[str, dict[str, Any]]:
    """Return of each rolling bearing by name its ``bearing``, ``settings`` other than the defaults and ``defects``."""
    return {
        name: {
            "bearing": asdict(element.bearing),
            "settings": _settings(element.settings),
            "defects": [dict(defect.description) for defect in element.defects],
        }
        for name, element in mechanism.elements.items()
        if isinstance(element, RollingBearing)
    }


def _settings(settings: BearingSettings) -> dict[str, Any]:
    settled = {item.name: (getattr(settings, item.name), item.default) for item in fields(settings)}
    return {name: value for name, (value, default) in settled.items()
            if name not in ("bearing", "defects") and value != default}  # fmt: skip


def bearing_lives(
    m: Mechanism, solution: Solution, *, start: float = 0.0, reliability: float = 0.9, life_factor: float = 1.0
) -> xr.Dataset:
    """Return load and life by ISO 281 of all rolling bearings of a mechanism, from the loads of a run.

    Parameters
    ----------
    m : Mechanism
    solution : Solution
        A run of it, with outputs at even times or at every step.
    start : float
        Time before which loads do not count, such as the end of a run-up, s.
    reliability, life_factor : float
        As of `rating_life`.

    Returns
    -------
    xarray.Dataset
        Over ``bearing``: equivalent load of the same life and the largest one (N), rating C (N), mean speed of
        the rings against each other (rad/s), life in revolutions and in hours, infinite for a bearing without load.

    Raises
    ------
    BearingError
        Without rolling bearings or outputs after ``start``, and for loads that the standard does not know.

    Examples
    --------
    >>> from gearmbs.bearings import Bearing
    >>> from gearmbs.studies import bearing_rig
    >>> rig = bearing_rig(Bearing.from_designation("6205"), speed="1500 rpm", radial_load="1.4 kN")
    >>> lives = bearing_lives(rig, rig.simulate(0.1, rate=4000), start=0.05)
    >>> round(float(lives.life_turns.sel(bearing="bearing")), -8)
    1100000000.0
    """
    import xarray as xr

    elements = [element for element in m.elements.values() if isinstance(element, RollingBearing)]
    require(bool(elements), f"mechanism '{m.name}' has no rolling bearings")
    counts = solution.t >= start
    require(
        int(counts.sum()) > 1,
        f"start is {start:g} s; the run has too few outputs after it, it ends at {solution.t[-1]:g} s",
    )
    lasting = np.gradient(solution.t[counts])
    rows = []
    for element in elements:
        axis = (_orientation(solution, element.j.body) @ element.j.orientation[:, 2])[counts]
        force = solution.load(element.name)[0][counts]
        axial = np.einsum("tc,tc->t", force, axis)
        radial = np.linalg.norm(force - axial[:, None] * axis, axis=1)
        turning = _spin(solution, element.i.body) - _spin(solution, element.j.body)
        speed = np.abs(np.einsum("tc,tc->t", turning[counts], axis))
        bearing = element.bearing
        mean, turns = 0.0, np.inf
        try:
            largest = max(equivalent_load(bearing, r, a) for r, a in zip(radial, axial))
            if largest > 0.0 and np.any(speed > 0.0):
                mean = mean_load(bearing, radial, axial, lasting * speed)
                turns = rating_life(bearing, mean, reliability=reliability, life_factor=life_factor)
        except BearingError as error:
            raise BearingError(f"'{element.name}': {error}") from None
        average = float(np.average(speed, weights=lasting))
        hours = turns * 2.0 * np.pi / average / 3600.0 if average > 0.0 else np.inf
        rows.append((mean, largest, bearing.rating, average, turns, hours))
    columns = {
        "equivalent_load": "N", "largest_load": "N", "rating": "N", "speed": "rad/s", "life_turns": "1",
        "life_hours": "h",
    }  # fmt: skip
    values = np.array(rows).T
    return xr.Dataset(
        {name: ("bearing", values[k], {"units": unit}) for k, (name, unit) in enumerate(columns.items())},
        {"bearing": [element.name for element in elements]},
        {"reliability": reliability, "life_factor": life_factor},
    )


def _orientation(solution: Solution, body: Body) -> np.ndarray:
    if body.is_ground:
        return np.broadcast_to(body.orientation, (solution.t.size, 3, 3))
    return solution.orientation(body.name)


def _spin(solution: Solution, body: Body) -> np.ndarray:
    return np.zeros((solution.t.size, 3)) if body.is_ground else solution.angular_velocity(body.name)
