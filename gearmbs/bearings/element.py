"""A rolling bearing between a shaft and a housing as a force element of a mechanism."""

from __future__ import annotations

from typing import Any

from gearmbs.bearings.defects import Defect
from gearmbs.bearings.errors import BearingError, require_fields
from gearmbs.bearings.geometry import Bearing
from gearmbs.bearings.settings import BearingSettings
from gearmbs.bearings.tables import pack
from gearmbs.dae.equations.force_elements import COUNT, DISSIPATED, STORED, Diagnostic
from gearmbs.mechanism.elements import Compiled, ForceElement, State
from gearmbs.mechanism.geometry import Vector, frame_along
from gearmbs.mechanism.parts import Body


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
        Let the elements' own centrifugal load press them outward; of balls both contact angles then differ.
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
        Or tables of a file, see `gearmbs.bearings.defect_tables.as_defects`.

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
    diagnostics = (
        Diagnostic("elastic_energy", "J", STORED),
        Diagnostic("damping_power", "W", DISSIPATED),
        Diagnostic("friction_power", "W", DISSIPATED),
        Diagnostic("normal_force", "N"),
        Diagnostic("largest_element_force", "N"),
        Diagnostic("largest_deflection", "m"),
        Diagnostic("loaded_elements", "1", COUNT),
    )

    def __init__(self, name: str, i: Any, j: Any, bearing: Bearing, **settings: Any) -> None:
        super().__init__(name, i, j)
        require_fields(settings, BearingSettings, "RollingBearing")
        try:
            self.settings = BearingSettings(bearing=bearing, **settings)
        except TypeError as error:
            raise BearingError(f"RollingBearing: {error}") from None
        self.tables = pack(self.settings)
        angle = self.settings.cage_angle
        self._states = (State(f"{name}.cage", start=angle),) + tuple(
            State(f"{name}.spin {k}") for k in self.tables.spinning
        )

    @classmethod
    def between(
        cls, name: str, inner: Body, outer: Body, bearing: Bearing, *, at: Vector, axis: Vector = (0.0, 0.0, 1.0),
        x: Vector | None = None, **settings: Any,
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
        from gearmbs.bearings.layout import scratch

        tables = self.tables
        return Compiled(bearing_force, tables.integers, tables.reals, scratch=scratch(len(tables.spinning)))

    def __repr__(self) -> str:
        name = self.bearing.designation or self.bearing.kind
        return f"RollingBearing({self.name!r}, {name}, {self.i.body.name!r} in {self.j.body.name!r})"
