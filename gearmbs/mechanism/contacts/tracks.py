"""What happened at the points of contact of two solids over time: tracks.

Points that share one load, as the corners of a box on a face, are one incident. An incident that goes on from one
output time to the next is a track; of several that end or begin, those nearest to each other are taken for the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.equations.loads.forces import FRAME_A, FRAME_COLUMNS, FRAME_P, FRAME_V, FRAME_W
from gearmbs.dae.equations.rotation import KIN_A, KIN_R, KIN_V, KIN_W
from gearmbs.dae.results.frames import frame_motion
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.pointers import IVEC, MAT, VEC
from gearmbs.kernels.structs import matrix_at, vector_at
from gearmbs.mechanism.contacts import kernel
from gearmbs.mechanism.contacts import meshes as pt
from gearmbs.mechanism.contacts.loads import LAW_REALS, friction_factor, normal_force, share_out, slip
from gearmbs.mechanism.contacts.meshes import dot

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism.contacts.element import SolidContact
    from gearmbs.mechanism.parts.bodies import Marker

PAIR, PLACE, NORMAL, PRESSED, RUBBED, SLIP, DEPTH = 0, 1, 4, 7, 10, 13, 16
"""Columns of an incident: number of the pair, place, unit normal from J to I, forces on I, slip of I, depth."""
WIDTH = 17


@njit(types.int64(IVEC, VEC, MAT, MAT, VEC), cache=True, nogil=True, error_model="numpy")
def incidents(ints, reals, frames, out, work):
    """Write the incidents of all pairs of solids at one time; return how many there are.

    Parameters
    ----------
    ints, reals : ndarray
        Tables of the element.
    frames : ndarray, shape (2, 18)
        Of markers I and J.
    out : ndarray, shape (points, WIDTH)
    work : ndarray
        The element's scratch.
    """
    law = vector_at(reals, 0, LAW_REALS)
    rows = matrix_at(work, kernel.ROWS, (work.size - kernel.ROWS) // pt.COLUMNS, pt.COLUMNS)
    scratch = vector_at(work, kernel.GEOMETRY, 36)
    n, u = scratch[6:9], scratch[9:12]
    found = 0
    for pair in range(ints[0]):
        count = kernel.points_of(ints, reals, 1 + kernel.PAIR * pair, frames, rows, False, True, work)
        share_out(rows, count, False)
        for first in range(count):
            pool = rows[first, pt.POOL]
            seen = pool < 0.0
            for k in range(first):
                seen = seen or rows[k, pt.POOL] == pool
            if seen:
                continue
            row = out[found]
            row[:] = 0.0
            row[PAIR] = pair
            total = size = 0.0
            for k in range(first, count):
                if rows[k, pt.POOL] != pool:
                    continue
                sign = -1.0 if rows[k, pt.SWAPPED] != 0.0 else 1.0
                for q in range(3):
                    n[q] = sign * rows[k, pt.NORMAL + q]
                slip(frames, rows[k, pt.PLACE : pt.PLACE + 3], u, scratch)
                rate = -dot(n, u)
                for q in range(3):
                    u[q] += rate * n[q]
                f = rows[k, pt.SHARE] * rows[k, pt.GAIN] * normal_force(law, rows[k, pt.LEVEL], rate)[0]
                m = friction_factor(law, np.sqrt(dot(u, u)))[0]
                for q in range(3):
                    row[PLACE + q] += rows[k, pt.SHARE] * rows[k, pt.PLACE + q]
                    row[NORMAL + q] += rows[k, pt.SHARE] * n[q]
                    row[SLIP + q] += rows[k, pt.SHARE] * u[q]
                    row[PRESSED + q] += f * n[q]
                    row[RUBBED + q] -= f * m * u[q]
                row[DEPTH] = max(row[DEPTH], rows[k, pt.DEPTH])
                total += rows[k, pt.SHARE]
            for q in range(3):
                size += row[NORMAL + q] ** 2
            for q in range(3):
                row[NORMAL + q] /= max(np.sqrt(size), 1e-300)
                row[PLACE + q] /= max(total, 1e-300)
                row[SLIP + q] /= max(total, 1e-300)
            found += 1
    return found


@dataclass(frozen=True)
class ContactTracks:
    """The tracks of a contact over m times, SI, global components; zero where and while a track does not touch.

    Attributes
    ----------
    t : ndarray, shape (m,)
        s.
    pairs : tuple of (int, int)
        Of each track: which solid of I touches which solid of J.
    touching : ndarray of bool, shape (m, tracks)
    i_point, j_point : ndarray, shape (m, tracks, 3)
        The deepest points on the surfaces of I's and J's solid, m; of several that share a load, their mean by share.
    i_normal : ndarray, shape (m, tracks, 3)
        Unit vector from J to I.
    i_normal_force, i_friction_force : ndarray, shape (m, tracks, 3)
        On I's body, N; J's body feels the opposite.
    slip_velocity : ndarray, shape (m, tracks, 3)
        Of I's surface against J's, m/s.
    penetration : ndarray, shape (m, tracks)
        Largest, m.
    """

    t: np.ndarray
    pairs: tuple[tuple[int, int], ...]
    touching: np.ndarray
    i_point: np.ndarray
    j_point: np.ndarray
    i_normal: np.ndarray
    i_normal_force: np.ndarray
    i_friction_force: np.ndarray
    slip_velocity: np.ndarray
    penetration: np.ndarray

    def __len__(self) -> int:
        return len(self.pairs)


def contact_tracks(solution: Solution, contact: SolidContact) -> ContactTracks:
    """Return where two bodies touched over the output times, and what acted there.

    Parameters
    ----------
    solution : Solution
    contact : SolidContact
        As `Mechanism.contact` returned it.

    Returns
    -------
    ContactTracks
    """
    made = contact.compiled()
    ints, reals = np.array(made.integers, dtype=np.int64), np.array(made.reals, dtype=float)
    work = np.zeros(made.scratch)
    most = max(1, (work.size - kernel.ROWS) // pt.COLUMNS) * int(ints[0])
    frames = marker_frames(solution, (contact.i, contact.j))
    out = np.zeros((most, WIDTH))
    tracker = _Tracker()
    at: Any = incidents
    for k in range(solution.t.size):
        tracker.take(k, out[: at(ints, reals, frames[k], out, work)])
    table, touching = tracker.table(solution.t.size)
    pairs = [numbers for numbers, _, _ in contact.pairs()]
    half = 0.5 * table[:, :, DEPTH, None] * table[:, :, NORMAL : NORMAL + 3]
    place = table[:, :, PLACE : PLACE + 3]
    return ContactTracks(
        solution.t,
        tuple(pairs[pair] for pair in tracker.pairs),
        touching,
        place - half,
        place + half,
        table[:, :, NORMAL : NORMAL + 3],
        table[:, :, PRESSED : PRESSED + 3],
        table[:, :, RUBBED : RUBBED + 3],
        table[:, :, SLIP : SLIP + 3],
        table[:, :, DEPTH],
    )


def marker_frames(solution: Solution, markers: tuple[Marker, ...]) -> np.ndarray:
    """Return the frames of markers over time as kernels of force elements are given them, shape (m, markers, 18)."""
    kin, _ = frame_motion(solution.evaluated)
    model, index = solution.system.model, solution.system.marker_index  # type: ignore[attr-defined]
    frames = np.zeros((solution.t.size, len(markers), FRAME_COLUMNS))
    for q, marker in enumerate(markers):
        at = index[id(marker)]
        body, own = kin[:, model.marker_body[at]], model.marker_frame[at]
        axes, spin = body[:, KIN_A : KIN_A + 9].reshape(-1, 3, 3), body[:, KIN_W : KIN_W + 3]
        arm = axes @ own[:3]
        frames[:, q, FRAME_P : FRAME_P + 3] = body[:, KIN_R : KIN_R + 3] + arm
        frames[:, q, FRAME_A : FRAME_A + 9] = (axes @ own[3:12].reshape(3, 3)).reshape(-1, 9)
        frames[:, q, FRAME_V : FRAME_V + 3] = body[:, KIN_V : KIN_V + 3] + np.cross(spin, arm)
        frames[:, q, FRAME_W : FRAME_W + 3] = spin
    return frames


class _Tracker:
    """Gives incidents to tracks, time after time."""

    def __init__(self) -> None:
        self.pairs: list[int] = []
        self.entries: list[tuple[int, int, np.ndarray]] = []
        self.last: dict[int, np.ndarray] = {}

    def take(self, time: int, found: np.ndarray) -> None:
        """Give the incidents of a time to the tracks of their pairs, the nearest first, then to idle or new ones."""
        now: dict[int, np.ndarray] = {}
        waiting = [row.copy() for row in found]
        near = [
            (float(np.sum((row[PLACE : PLACE + 3] - old[PLACE : PLACE + 3]) ** 2)), k, track)
            for k, row in enumerate(waiting)
            for track, old in self.last.items()
            if self.pairs[track] == row[PAIR]
        ]
        given: set[int] = set()
        for _, k, track in sorted(near):
            if k not in given and track not in now:
                now[track] = waiting[k]
                given.add(k)
        for k, row in enumerate(waiting):
            if k in given:
                continue
            idle = (n for n, pair in enumerate(self.pairs) if pair == row[PAIR] and n not in now)
            track = next(idle, len(self.pairs))
            if track == len(self.pairs):
                self.pairs.append(int(row[PAIR]))
            now[track] = row
        self.entries += [(time, track, row) for track, row in now.items()]
        self.last = now

    def table(self, times: int) -> tuple[np.ndarray, np.ndarray]:
        """Return all tracks over time, shape (times, tracks, WIDTH), and whether they touch."""
        table = np.zeros((times, len(self.pairs), WIDTH))
        touching = np.zeros(table.shape[:2], dtype=bool)
        for time, track, row in self.entries:
            table[time, track], touching[time, track] = row, True
        return table, touching
