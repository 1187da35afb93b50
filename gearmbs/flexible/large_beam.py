"""Beams of large motion: rigid nodes joined by elements of small strain that turn as far as they like."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np
import numpy.typing as npt

from gearmbs.dae.equations.force_elements import DISSIPATED, STORED
from gearmbs.flexible.beam import BeamSection
from gearmbs.flexible.errors import FlexibleError
from gearmbs.mechanism import Body, Compiled, Diagnostic, ForceElement, Marker, Mechanism
from gearmbs.mechanism.geometry import frame_along, vector
from gearmbs.mechanism.quantities import quantity
from gearmbs.units import Quantity


@dataclass(eq=False, repr=False)
class LargeBeam(ForceElement):
    """A beam from marker I to marker J, along z of both: see `gearmbs.flexible.beam_kernel`.

    Attributes
    ----------
    length : float
        Unstrained, m.
    section : BeamSection
    damping_time : float
        Damping stress by strain rate over stress by strain, s: modes of circular frequency w are damped by w tau / 2.
    """

    length: float
    section: BeamSection
    damping_time: float = 0.0

    kind = "large_beam"
    has_force = True
    diagnostics = (Diagnostic("strain_energy", "J", STORED), Diagnostic("damping_power", "W", DISSIPATED))

    def compiled(self) -> Compiled:
        """Return kernel and tables."""
        from gearmbs.flexible.beam_kernel import WORK, large_beam

        b, g = self.section.bending, self.section.shear
        shear = [1.0 / (1.0 / g[p] + self.length**2 / (12.0 * b[p])) for p in range(2)]
        reals = (self.length, *shear, self.section.axial, b[1], b[0], self.section.torsion, self.damping_time)
        return Compiled(large_beam, reals=reals, scratch=WORK)


@dataclass(frozen=True, eq=False)
class BeamChain:
    """A beam of large motion in a mechanism.

    Attributes
    ----------
    bodies : list of Body
        The nodes, rigid, from the first end on.
    markers : list of Marker
        At the nodes, z along the beam, x as asked for.
    elements : list of LargeBeam
    """

    bodies: list[Body]
    markers: list[Marker]
    elements: list[LargeBeam]

    @property
    def first(self) -> Marker:
        """Marker at the beginning."""
        return self.markers[0]

    @property
    def last(self) -> Marker:
        """Marker at the end."""
        return self.markers[-1]


def node_shares(elements: int) -> np.ndarray:
    """Return the share of each node in the mass of a beam, in elements: weights of a rule of quadrature, all positive.

    A load of inertia m u'' dx that varies smoothly is replaced by forces at the nodes. Half of each element at either
    end (the trapezoidal rule) makes errors of h^2 at the ends of the beam: its moment of inertia is too large by the
    share 2/n^2. Gregory's rule of third order (K. Atkinson, *An Introduction to Numerical Analysis*, 2nd ed., section
    5.4) has them right up to h^4, as Newton's and Cotes's of few points; inside all weights are 1.

    Parameters
    ----------
    elements : int
        n.

    Returns
    -------
    ndarray, shape (n + 1,)
        Their sum is n; mass, centre and, from two elements on, moments of inertia of a straight beam are exact.
    """
    few = {1: (1 / 2,) * 2, 2: (1 / 3, 4 / 3, 1 / 3), 3: (3 / 8, 9 / 8, 9 / 8, 3 / 8),
           4: (14 / 45, 64 / 45, 24 / 45, 64 / 45, 14 / 45)}  # fmt: skip
    if elements in few:
        return np.array(few[elements])
    ends = np.array([9.0, 28.0, 23.0]) / 24.0
    return np.concatenate([ends, np.ones(elements - 5), ends[::-1]])


def add_beam(
    mechanism: Mechanism,
    name: str,
    section: BeamSection,
    start: npt.ArrayLike,
    end: npt.ArrayLike,
    elements: int = 16,
    *,
    x_axis: npt.ArrayLike | None = None,
    damping_time: Quantity = 0.0,
    **motion: Any,
) -> BeamChain:
    """Add a straight beam that may bend, twist and turn as far as it likes.

    Its nodes are rigid bodies with the mass and rotary inertia that `node_shares` gives them. Bending frequencies are
    then wrong by terms of h^4; those of stretching and torsion fall short by (k h)^2/24 of a wave of number k.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
        Bodies are ``name.0``, ``name.1`` ..., elements ``name.beam1`` ...
    section : BeamSection
    start, end : array_like of 3 floats
        Its ends at the start, global components, m.
    elements : int
    x_axis : array_like of 3 floats, optional
        Direction of the section's x, at right angles to the beam; default: the global axis that fits best.
    damping_time : float or str
        See `LargeBeam`, s.
    **motion
        ``velocity`` and ``angular_velocity`` of the beam at the start as of one rigid body, velocity that of ``start``.

    Returns
    -------
    BeamChain

    Raises
    ------
    FlexibleError
        For a beam without length or elements, and a damping time that is negative.
    """
    a, b = vector(start, f"beam '{name}': start", "length"), vector(end, f"beam '{name}': end", "length")
    length = float(np.linalg.norm(b - a))
    whole = isinstance(elements, Integral) and not isinstance(elements, bool)
    if not length > 0.0 or not whole or elements < 1:
        raise FlexibleError(
            f"beam '{name}': length {length} m, {elements!r} elements; both must be positive, and elements a whole "
            "number"
        )
    tau = quantity(damping_time, "time", f"beam '{name}': damping_time")
    if not 0.0 <= tau < math.inf:
        raise FlexibleError(f"beam '{name}': damping_time is {tau} s; give a time from 0 up, negative damping drives")
    axes = frame_along(b - a, f"beam '{name}'", None if x_axis is None else x_axis)
    u = vector(motion.pop("velocity", (0, 0, 0)), f"beam '{name}': velocity", "speed")
    w = vector(motion.pop("angular_velocity", (0, 0, 0)), f"beam '{name}': angular_velocity", "angular speed")
    if motion:
        raise FlexibleError(f"beam '{name}': {', '.join(motion)} is no setting; velocity and angular_velocity are")
    step = length / elements
    bodies, markers, parts = [], [], []
    for k, share in enumerate(step * node_shares(elements)):
        place = a + (b - a) * k / elements
        body = mechanism.body(
            f"{name}.{k}", section.mass * share, tuple(share * j for j in section.inertia), position=place,
            orientation=axes, velocity=u + np.cross(w, place - a), angular_velocity=w,
        )  # fmt: skip
        bodies.append(body)
        markers.append(body.marker(name=f"{name}.node{k}"))
    for k in range(elements):
        element = LargeBeam(f"{name}.beam{k + 1}", markers[k], markers[k + 1], step, section, tau)
        parts.append(mechanism.add(element))
    return BeamChain(bodies, markers, parts)
