"""Where the two wheels of a pair stand, instant by instant: from a simulation, or at rest under load."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.gears import GearPair
from gearmbs.gears.pair import Placement
from gearmbs.progress import waiting

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism.parts import Marker


@dataclass(frozen=True)
class PairMotion:
    """Frames of both wheels over n instants.

    Attributes
    ----------
    pair : GearPair
    label, unit : str
        What ``value`` counts, and its unit.
    value : ndarray, shape (n,)
        Time or position of each instant.
    origins, axes : ndarray, shape (2, n, 3) and (2, n, 3, 3)
        Of driver and driven, global components, m.
    velocities, spins : ndarray, shape (2, n, 3)
        Of the origins (m/s) and of the wheels (rad/s); zero at rest.
    """

    pair: GearPair
    label: str
    unit: str
    value: np.ndarray
    origins: np.ndarray
    axes: np.ndarray
    velocities: np.ndarray
    spins: np.ndarray

    def __len__(self) -> int:
        return self.value.size

    def placement(self, k: int) -> Placement:
        """Return the frames at instant ``k``."""
        return Placement(self.origins[0, k], self.axes[0, k], self.origins[1, k], self.axes[1, k])


@waiting("finding contacts")
def static_motion(pair: GearPair, *, torque: float | None = None, pitches: float = 1.0, frames: int = 60) -> PairMotion:
    """Return the wheels rolling through the mesh at rest under load.

    Parameters
    ----------
    pair : GearPair
    torque : float, optional
        On the driven wheel, N m; default the pair's, 0 for touching without load.
    pitches : float
        How many pitches the driver turns.
    frames : int
        Instants.

    Raises
    ------
    ValueError
        If ``frames`` is below 1 or the torque negative.
    """
    from gearmbs.gears.transmission import StaticMesh

    load = float(pair.torque if torque is None else torque)
    if frames < 1:
        raise ValueError(f"frames is {frames}; give 1 or more")
    if not load >= 0.0:
        raise ValueError(f"torque is {load} N m; give 0 (touching) or a positive load")
    mesh = StaticMesh(pair)
    rb = pair.driven.base_radius
    lag = mesh.turning * pair.penetration(load) / rb if load > 0.0 else 0.0
    phase = pitches * np.arange(frames) / frames
    places = []
    for step in phase:
        angle = pair.rotation * step * 2.0 * math.pi / pair.driver.teeth
        if load > 0.0:
            ideal = mesh.ideal_angle(angle)
            driven = mesh.loaded_angle(angle, load, ideal + lag)
            lag = driven - ideal
        else:
            driven = mesh.touching_angle(angle)
        places.append(pair.frames(angle, driven))
    origins = np.array([[p.origin_1 for p in places], [p.origin_2 for p in places]])
    axes = np.array([[p.axes_1 for p in places], [p.axes_2 for p in places]])
    still = np.zeros_like(origins)
    return PairMotion(pair, "driver angle over pitch angle", "", phase, origins, axes, still, still)


def solution_motion(
    solution: Solution,
    *,
    element: str | None = None,
    start: float | None = None,
    stop: float | None = None,
    frames: int = 120,
) -> PairMotion:
    """Return the motion of a gear pair in a simulation, at output times spread evenly over a span.

    Parameters
    ----------
    solution : Solution
    element : str, optional
        Name of the gear contact; needed when there are several.
    start, stop : float, optional
        Span, s; default the last tenth of the simulation.
    frames : int
        At most so many instants.

    Raises
    ------
    ValueError
        If the mechanism has no such contact, or the span holds no output.
    """
    contact = gear_contact_of(solution, element)
    if not isinstance(contact.pair, GearPair):
        raise ValueError(f"element {contact.name!r} carries a {type(contact.pair).__name__}, not a GearPair to draw")
    chosen = chosen_times(solution.t, start, stop, frames)
    poses = [marker_motion(solution, marker, chosen) for marker in (contact.i, contact.j)]
    origins, axes, velocities, spins = (np.array(parts) for parts in zip(*poses))
    return PairMotion(contact.pair, "time", "s", solution.t[chosen], origins, axes, velocities, spins)


def chosen_times(t: np.ndarray, start: float | None, stop: float | None, frames: int) -> np.ndarray:
    """Return numbers of at most ``frames`` output times spread over a span."""
    low = t[0] + 0.9 * (t[-1] - t[0]) if start is None else start
    high = t[-1] if stop is None else stop
    inside = np.flatnonzero((t >= low - 1e-12) & (t <= high + 1e-12))
    if inside.size == 0 or frames < 1:
        raise ValueError(
            f"start, stop, frames: no output in {low:g} to {high:g} s; the outputs span {t[0]:g} to {t[-1]:g}"
        )
    return inside[np.unique(np.linspace(0, inside.size - 1, min(frames, inside.size)).round().astype(int))]


def gear_contact_of(solution: Solution, element: str | None = None) -> Any:
    """Return the gear contact of a simulated mechanism by name, or its only one."""
    from gearmbs.gears.contact_element import GearContact

    found = {n: e for n, e in mechanism_of(solution).elements.items() if isinstance(e, GearContact)}
    if element is not None and element not in found:
        raise ValueError(f"element {element!r} is no gear contact; there are {', '.join(found) or 'none'}")
    if element is None and len(found) != 1:
        raise ValueError(
            f"element: the mechanism has {len(found)} gear contacts ({', '.join(found) or 'none'}); name one"
        )
    return found[element] if element is not None else next(iter(found.values()))


def mechanism_of(solution: Solution) -> Any:
    """Return the mechanism a solution belongs to."""
    mechanism = getattr(solution.system, "mechanism", None)
    if mechanism is None:
        raise ValueError("solution: its system was not made from a Mechanism, so there is nothing to draw")
    return mechanism


def marker_motion(
    solution: Solution, marker: Marker, chosen: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return origin, axes, velocity of the origin and angular velocity of a marker at the chosen outputs."""
    body = marker.body
    if body.is_ground:
        n = chosen.size
        still = np.zeros((n, 3))
        return np.tile(marker.position, (n, 1)), np.tile(marker.orientation, (n, 1, 1)), still, still
    turned = solution.orientation(body.name)[chosen]
    spin = solution.angular_velocity(body.name)[chosen]
    arm = turned @ (marker.position - body.com)
    origin = solution.com_position(body.name)[chosen] + arm
    velocity = solution.com_velocity(body.name)[chosen] + np.cross(spin, arm)
    return origin, turned @ marker.orientation, velocity, spin
