"""Static analyses of the loaded mesh: contact pattern over the face and load sharing between tooth pairs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.contact import GAP_COLUMNS, gear_contact, layout
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.mesh import Mesh
from gearmbs.gears.modifications import COAST_ALIASES
from gearmbs.gears.tables import pack
from gearmbs.gears.transmission import StaticMesh, first_mate, load_of, static_lag, warn_of_unseen
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.units import Quantity

SIDE, SECTION, GAP, ROLL_LENGTH_1, SOFT = (
    GAP_COLUMNS.index(name) for name in ("side", "section", "gap", "roll_1", "stiffness")
)
TEETH = [GAP_COLUMNS.index(name) for name in ("tooth_1", "tooth_2")]
FINE = 8
MAX_SECTIONS = 300


@dataclass(frozen=True)
class ContactPattern:
    """Load on one driver tooth flank over its whole engagement.

    Attributes
    ----------
    roll_angle : ndarray, shape (n,)
        Driver angle from where the tooth touches at the pitch point, rad, positive towards recess.
    section : ndarray, shape (m,)
        Along the mean axis, from mid-way between the wheels, m.
    pressure : ndarray, shape (n, m)
        Load per unit face width, N/m.
    roll_length : ndarray, shape (n, m)
        Where on the driver's profile, length of roll, m; NaN without load.
    force : ndarray, shape (n,)
        Load of the tooth, N.
    total : ndarray, shape (n,)
        Load of all teeth on the same side, N.
    """

    roll_angle: np.ndarray
    section: np.ndarray
    pressure: np.ndarray
    roll_length: np.ndarray
    force: np.ndarray
    total: np.ndarray

    @property
    def share(self) -> np.ndarray:
        """Load sharing: the tooth's part of the total."""
        return np.divide(self.force, self.total, out=np.zeros_like(self.force), where=self.total > 0)

    @property
    def face_load_factor(self) -> float:
        """K_Hbeta: largest load per unit width over its mean, each section's summed over the engagement.

        So each section counts while it is in contact, a helical tooth's first and last ones as others do: 1 for aligned
        wheels without modifications. The sum over one tooth's engagement is that of all teeth over a mesh, to which
        the mesh stiffness c_gamma of ISO 6336-1 belongs. NaN where nothing is carried.
        """
        carried = self.pressure.sum(axis=0)
        return float(carried.max() / carried.mean()) if carried.any() else math.nan


def contact_pattern(
    pair: Mesh,
    torque: Quantity = None,
    points: int = 81,
    sections: int = 41,
    side: str = "drive",
    tooth: int = 0,
    mate: int | None = None,
) -> ContactPattern:
    """Follow a tooth of the driver through the mesh at rest under load.

    Parameters
    ----------
    pair : GearPair or Mesh
    torque : float or str, optional
        On the driven wheel, N m; default that of the pair's operating point.
    points : int
        Positions over the engagement.
    sections : int
        Along the face, up to 300.
    side : {"drive", "coast"}
        Flank to analyse; the coast flanks are loaded when misalignment jams the teeth.
    tooth : int
        Of the driver, in its first turn; numbers wrap around the wheel.
    mate : int, optional
        Tooth of the driven wheel that is followed instead, with the tooth of the driver that it meets first.

    Returns
    -------
    ContactPattern

    Warns
    -----
    UserWarning
        If faults sit on teeth that do not pass the mesh meanwhile.

    Notes
    -----
    The load of a pair of teeth is integrated between the ends of its own common face by the midpoint rule, eight points
    to a section, over gaps that are straight between the sections. With ``load="adams"`` it is the one force of the
    overlap, spread as its cross-section, depth^1.5. The total of the drive flanks less that of the coast flanks, times
    r_b cos(beta_b), is the torque within 0.2 % while involutes touch. A corner in contact has another arm than r_b:
    deviations of 1.3 % were seen and, for jammed teeth, which carry much more on both sides, 3 % of the drive flanks'
    load.
    """
    side = COAST_ALIASES.get(side, side)
    if side not in ("drive", "coast"):
        raise ValueError(f"side is {side!r}; choose 'drive' or 'coast'")
    if not 1 <= sections <= MAX_SECTIONS:
        raise ValueError(f"sections is {sections!r}; give 1 up to {MAX_SECTIONS}")
    load = load_of(pair, torque)
    mesh = StaticMesh(pair)
    geometry, rotation = mesh.geometry, mesh.rotation
    tooth %= geometry.driver.teeth
    if mate is not None:
        # teeth of the driver pass one after the other, and those of the mate with them
        pitches = mesh.turning * (mate - first_mate(mesh)) % geometry.driven.teeth
        tooth = -rotation * pitches
    low, high = geometry.common_face
    width = (high - low) / sections
    section = low + (np.arange(sections) + 0.5) * width
    flank = rotation * (1 if side == "drive" else -1)
    offset, first, last = _engagement(geometry, rotation, tooth)
    roll = np.linspace(first, last, points)
    pitch_angle = 2 * math.pi / geometry.driver.teeth
    passed = [(rotation * offset + turn) / pitch_angle for turn in (roll[0], roll[-1])]
    warn_of_unseen(pair, passed[0], passed[1], "give the number of another driver tooth to follow, tooth=...")
    pressure = np.zeros((points, sections))
    roll_length = np.full((points, sections), np.nan)
    total = np.zeros(points)
    lag = mesh.turning * static_lag(pair, load)
    face_ends = np.zeros(1 if mesh.gi[layout.SLICES] == 1 else 0)
    for k, turn in enumerate(roll):
        angle = offset + rotation * turn
        ideal = mesh.ideal_angle(angle)
        driven = mesh.loaded_angle(angle, load, ideal + lag)
        lag = driven - ideal
        rows = mesh.gaps(angle, driven, section).copy()
        ends = mesh.gaps(angle, driven, face_ends)
        rows, ends = (found[found[:, SIDE] == flank] for found in (rows, ends))
        both = np.concatenate([rows, ends])
        for one in np.unique(both[both[:, GAP] < 0][:, TEETH], axis=0):
            mine, limits = (found[(found[:, TEETH] == one).all(axis=1)] for found in (rows, ends))
            loads = _pair_load(pair, mine, limits, low, width)
            total[k] += loads.sum() * width
            if one[0] == tooth % geometry.driver.teeth:
                pressure[k] += loads
                roll_length[k] = np.where(loads > 0, mine[:, ROLL_LENGTH_1], roll_length[k])
    return ContactPattern(roll, section, pressure, roll_length, pressure.sum(axis=1) * width, total)


def _engagement(geometry: PairGeometry, rotation: int, tooth: int) -> tuple[float, float, float]:
    """Driver angle at which a tooth touches at the pitch point; roll angles half a pitch before and after its path.

    At mid-face; a helix begins at one end of the face before, and ends at the other after it.
    """
    gear = geometry.wheels[0]
    alpha = geometry.working_pressure_angle
    middle, reach = gear.base_radius * math.tan(alpha), 0.5 * gear.base_pitch + geometry.half_overlap
    # tooth 0 touches at length of roll s when the driver is at s / r_b - psi - alpha from the mesh, on the drive flank
    offset = rotation * (math.tan(alpha) - gear.base_half_angle - alpha) + geometry.mesh_angle
    offset -= 2 * math.pi * tooth / gear.teeth
    begin = geometry.first_roll_lengths[0] - middle - reach
    end = gear.tip_roll_length - middle + reach
    return offset, begin / gear.base_radius, end / gear.base_radius


def _pair_load(pair: Mesh, rows: np.ndarray, ends: np.ndarray, low: float, width: float) -> np.ndarray:
    """Load of a pair of teeth per unit face width at the sections of its gap rows, N/m.

    What a face tilted sideways carries beyond the outermost sections counts to these.
    """
    place, gap = rows[:, SECTION], rows[:, GAP]
    bounds = (low, low + rows.shape[0] * width)
    if len(ends) == 2:
        bounds = (ends[0, SECTION], ends[1, SECTION])
        inside = (place > bounds[0]) & (place < bounds[1])
        place = np.concatenate([bounds[:1], place[inside], bounds[1:]])
        gap = np.concatenate([ends[:1, GAP], gap[inside], ends[1:, GAP]])
    edges = low + np.arange(rows.shape[0] * FINE + 1) * width / FINE
    edges[0], edges[-1] = min(edges[0], bounds[0]), max(edges[-1], bounds[1])
    edges = np.clip(edges, *bounds)
    share = np.diff(edges)
    middle = 0.5 * (edges[1:] + edges[:-1])
    depth = np.maximum(0.0, -np.interp(middle, place, gap))
    law, soft = pair.contact_model.law, rows[0, SOFT]
    cosine = math.cos(pair.geometry.driver.base_helix_angle)
    if pair.contact_model.load == "adams":
        section = share * depth**1.5
        if not section.sum() > 0:
            return np.zeros(rows.shape[0])
        centre = (section * middle).sum() / section.sum()
        force = law.stiffness * soft * max(0.0, -float(np.interp(centre, place, gap))) ** law.exponent
        loads = force * section / section.sum()
    else:
        loads = (
            law.stiffness / pair.geometry.narrower_face_width * soft * (cosine * depth) ** law.exponent / cosine * share
        )
    return loads.reshape(-1, FINE).sum(axis=1) / width


# What the mesh did during a motion: forces, pairs in contact, separations and hits of the coast flanks.


VEC = types.float64[::1]
MAT = types.float64[:, ::1]
BOX = types.float64[:, :, ::1]


@njit(
    types.void(types.int64[::1], VEC, MAT, BOX, MAT, MAT, MAT, BOX, MAT, MAT, MAT, MAT, VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _run(gi, gr, R1, A1, v1, w1, R2, A2, v2, w2, wrench, diag, work):
    """Evaluate the contact of a pair at each instant of a motion.

    Parameters
    ----------
    gi, gr : ndarray
        Tables of the pair.
    R1, A1, v1, w1, R2, A2, v2, w2 : ndarray, first axis of length n
        Position, orientation, velocity and angular velocity of driver and driven wheel.
    wrench : ndarray, shape (n, 6)
        Receives force and torque on the driver.
    diag : ndarray, shape (n, 8)
        Receives the diagnostics.
    work : ndarray
        Scratch of the contact.
    """
    jac = np.zeros((6, 24))
    for k in range(R1.shape[0]):
        gear_contact(
            gi, gr, R1[k], A1[k], v1[k], w1[k], R2[k], A2[k], v2[k], w2[k], wrench[k], jac, diag[k], 0, work
        )  # fmt: skip


@dataclass(frozen=True)
class ContactHistory:
    """Contact quantities at each instant of a motion, n instants.

    Attributes
    ----------
    wrench : ndarray, shape (n, 6)
        Force and torque (about its origin) on the driver, global components.
    elastic_energy, damping_power, friction_power : ndarray
        J, W, W.
    drive_penetration, coast_penetration : ndarray
        Largest, m.
    drive_pairs, coast_pairs : ndarray of int
        Tooth pairs touching.
    normal_force : ndarray
        Sum of all normal forces, N.
    """

    wrench: np.ndarray
    elastic_energy: np.ndarray
    damping_power: np.ndarray
    friction_power: np.ndarray
    drive_penetration: np.ndarray
    coast_penetration: np.ndarray
    drive_pairs: np.ndarray
    coast_pairs: np.ndarray
    normal_force: np.ndarray

    @property
    def separations(self) -> int:
        """How many times the teeth lost all contact."""
        free = (self.drive_pairs + self.coast_pairs) == 0
        return int(np.count_nonzero(free[1:] & ~free[:-1]))

    @property
    def coast_hits(self) -> int:
        """How many times the coast flanks came into contact."""
        touching = self.coast_pairs > 0
        return int(np.count_nonzero(touching[1:] & ~touching[:-1]))


def contact_history(
    pair: Mesh,
    driver: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    driven: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> ContactHistory:
    """Evaluate the contact along a motion of the two wheels.

    Parameters
    ----------
    pair : GearPair or Mesh
    driver, driven : tuple of ndarray
        Per wheel: origins (n, 3), axes (n, 3, 3), velocities of the origins (n, 3), angular velocities (n, 3); global
        components.

    Returns
    -------
    ContactHistory
    """
    shapes = ((-1, 3), (-1, 3, 3), (-1, 3), (-1, 3))
    args = [
        np.ascontiguousarray(a, dtype=float).reshape(s) for wheel in (driver, driven) for a, s in zip(wheel, shapes)
    ]
    n = len(args[0])
    if any(len(a) != n for a in args):
        raise ValueError(f"driver and driven have {[len(a) for a in args]} instants; give as many of each")
    gi, gr, size = pack(pair)
    wrench = np.zeros((n, 6))
    diag = np.zeros((n, layout.DIAGNOSTICS))
    run: Any = _run
    run(gi, gr, *args, wrench, diag, np.zeros(size))
    diagnostics = dict(zip(layout.TOTALS.names or (), diag.T))
    return ContactHistory(
        wrench,
        diagnostics["energy"],
        diagnostics["damping_power"],
        diagnostics["friction_power"],
        diagnostics["depth_drive"],
        diagnostics["depth_coast"],
        diagnostics["pairs_drive"].astype(int),
        diagnostics["pairs_coast"].astype(int),
        diagnostics["normal_force"],
    )
