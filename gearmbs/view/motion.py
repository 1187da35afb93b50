"""Where the two wheels of a pair stand, instant by instant: from a simulation, or at rest under load."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.contact import GAP_COLUMNS, layout, pair_gaps
from gearmbs.contact.laws import normal_law
from gearmbs.gears import GearPair
from gearmbs.gears.pair import Placement
from gearmbs.gears.tables import most_pairs
from gearmbs.progress import waiting

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism.parts.bodies import Marker


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


# Where the teeth touch and how hard, in space, with the kernels and laws of the simulation itself.


COLUMN = {name: k for k, name in enumerate(GAP_COLUMNS)}
SECTIONS = 21


@dataclass(frozen=True)
class ContactPoints:
    """Touching places, k of them: one a tooth pair and section of the face.

    Attributes
    ----------
    side : ndarray of int
        +1 where the driver's anticlockwise flank presses, -1 the other.
    tooth_1, tooth_2 : ndarray of int
    section : ndarray
        Along the face, m.
    depth : ndarray
        Penetration, m.
    kind : ndarray of int
        0 flank on flank, 1 or 2 the wheel whose tip corner bears.
    point : ndarray, shape (k, 3)
        Global, m.
    normal : ndarray, shape (k, 3)
        Direction in which the driver pushes the driven wheel, global.
    force : ndarray
        Normal force of the section's part of the face, N.
    """

    side: np.ndarray
    tooth_1: np.ndarray
    tooth_2: np.ndarray
    section: np.ndarray
    depth: np.ndarray
    kind: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    force: np.ndarray

    def pairs(self) -> list[tuple[int, int, int, np.ndarray, np.ndarray]]:
        """Return each tooth pair: side, teeth, centre of its load (3,), its force vector on the driven wheel (3,)."""
        out = []
        keys = np.stack([self.side, self.tooth_1, self.tooth_2], axis=1)
        for key in np.unique(keys, axis=0):
            mine = (keys == key).all(axis=1) & (self.force > 0.0)
            if mine.any():
                weight = self.force[mine]
                centre = weight @ self.point[mine] / weight.sum()
                out.append((int(key[0]), int(key[1]), int(key[2]), centre, weight @ self.normal[mine]))
        return out


class ContactProbe:
    """Finds the touching places of a pair in any pose."""

    def __init__(self, pair: GearPair, sections: int | None = None) -> None:
        self.pair = pair
        self.gi, self.gr, size = pair.contact_tables()
        self.work = np.zeros(size)
        if sections is not None and sections < 1:
            raise ValueError(f"sections is {sections}; give 1 or more")
        low, high = pair.common_face
        single = pair.face_slices == 1
        count = 1 if single else (SECTIONS if sections is None else sections)
        self.width = pair.common_face_width / count if single else (high - low) / count
        self.sections = np.zeros(1) if single else low + (np.arange(count) + 0.5) * self.width
        self.rows = np.zeros((most_pairs(pair.geometry, self.gr) * max(2, count), len(GAP_COLUMNS)))

    def at(
        self,
        place: Placement,
        velocities: tuple[np.ndarray, np.ndarray] | None = None,
        spins: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> ContactPoints:
        """Return the touching places.

        Parameters
        ----------
        place : Placement
        velocities, spins : pair of ndarray, optional
            Velocities of the wheels' origins and angular velocities, global; default at rest. They enter the damping.
        """
        rows = self._rows(place, self.sections)
        touching = rows[:, COLUMN["gap"]] < 0.0
        width = self._widths(place, rows)[touching]
        rows = rows[touching]
        # the kernel's frame of an internal pair points from the internal wheel to its mate
        mean = mean_frame(place) * [self.pair.sign, self.pair.sign, 1]
        side = rows[:, COLUMN["side"]]
        sine, cosine = np.sin(rows[:, COLUMN["alpha"]]), side * np.cos(rows[:, COLUMN["alpha"]])
        zero = np.zeros(len(rows))
        normal = np.column_stack([sine, cosine, zero])
        tangent = np.column_stack([np.abs(cosine), -side * sine, zero])
        along = rows[:, COLUMN["section"]] + 0.5 * float((place.origin_2 - place.origin_1) @ mean[:, 2])
        local = rows[:, [COLUMN["normal"]]] * normal + rows[:, [COLUMN["tangent"]]] * tangent
        local[:, 2] = along
        point = place.origin_1 + local @ mean.T
        normal = normal @ mean.T
        depth = -rows[:, COLUMN["gap"]]
        rate = np.zeros(len(rows))
        if velocities is not None and spins is not None:
            first = velocities[0] + np.cross(spins[0], point - place.origin_1)
            second = velocities[1] + np.cross(spins[1], point - place.origin_2)
            rate = np.einsum("ij,ij->i", normal, first - second)
        force = width * self._pressure(depth, rate, rows[:, COLUMN["stiffness"]])
        return ContactPoints(
            side=side.astype(int),
            tooth_1=rows[:, COLUMN["tooth_1"]].astype(int),
            tooth_2=rows[:, COLUMN["tooth_2"]].astype(int),
            section=rows[:, COLUMN["section"]],
            depth=depth,
            kind=rows[:, COLUMN["kind"]].astype(int),
            point=point,
            normal=normal,
            force=force,
        )

    def over(self, motion: PairMotion) -> list[ContactPoints]:
        """Return the touching places at every instant of a motion."""
        return [
            self.at(
                motion.placement(k),
                (motion.velocities[0, k], motion.velocities[1, k]),
                (motion.spins[0, k], motion.spins[1, k]),
            )
            for k in range(len(motion))
        ]

    def _rows(self, place: Placement, sections: np.ndarray) -> np.ndarray:
        frames = [np.ascontiguousarray(a) for a in (place.origin_1, place.axes_1, place.origin_2, place.axes_2)]
        count = pair_gaps(self.gi, self.gr, *frames, sections, self.rows, self.work)
        return self.rows[:count].copy()

    def _widths(self, place: Placement, rows: np.ndarray) -> np.ndarray:
        """Return the part of the face each row stands for: tilt moves the ends of the faces along the teeth."""
        count = self.sections.size
        if count == 1 or len(rows) == 0:
            return np.full(len(rows), self.width)
        ends = self._rows(place, np.zeros(0))[:, COLUMN["section"]].reshape(-1, 1, 2)
        low, high = self.sections - 0.5 * self.width, self.sections + 0.5 * self.width
        low = np.where(np.arange(count) == 0, -np.inf, low)
        high = np.where(np.arange(count) == count - 1, np.inf, high)
        return np.maximum(0.0, np.minimum(high, ends[:, :, 1]) - np.maximum(low, ends[:, :, 0])).ravel()

    def _pressure(self, depth: np.ndarray, rate: np.ndarray, factor: np.ndarray) -> np.ndarray:
        law = int(self.gi[layout.LAW])
        table = self.gr[: layout.PAIR.itemsize // self.gr.itemsize].view(layout.PAIR)[0]
        numbers = [float(table[name]) for name in ("stiffness", "exponent", "damping", "damping_depth")]
        values = [f * normal_law(law, *numbers, float(d), float(r))[0] for d, r, f in zip(depth, rate, factor)]
        return np.array(values)


def mean_frame(place: Placement) -> np.ndarray:
    """Return the frame half-way between the wheels: z between the axes, x from driver to driven."""
    z = place.axes_1[:, 2] + place.axes_2[:, 2]
    z = z / np.linalg.norm(z)
    between = place.origin_2 - place.origin_1
    x = between - (between @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
