"""Transmission error without dynamics: kinematic (no load) and loaded quasi-static, from the contact kernel itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.contact import GAP_COLUMNS, gear_contact, layout, pair_gaps
from gearmbs.gears.mesh import Mesh, require_points, varying_along_face
from gearmbs.gears.modifications import face_sections
from gearmbs.gears.tables import most_pairs, pack
from gearmbs.progress import waiting
from gearmbs.units import Quantity, QuantityLike, to_si
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.gears.curve_accuracy import CurveErrors

SIDE, TOOTH_1, TOOTH_2, GAP = (GAP_COLUMNS.index(name) for name in ("side", "tooth_1", "tooth_2", "gap"))
NORMAL_FORCE, PAIRS_DRIVE = layout.place(layout.TOTALS, "normal_force"), layout.place(layout.TOTALS, "pairs_drive")
NEWTON_STEPS = 100
SHORT_STEPS = 20
"""Steps of at most the deflection of parallel wheels. Tilted ones may touch far from there; then steps grow."""
STEP_OF_PITCH = 0.125
"""Part of a pitch that such steps grow to: a tooth and its gap are half a pitch each."""
PHASE_STEPS = 50
TOUCH_TOLERANCE = 1e-15  # m
SEARCHED_FROM = 1e-11  # m
TOUCHING = 1e-9  # m
UNBALANCED = 1e-6
"""Share of the torque that may be missing where the search for its angle has ended: found are 1e-12 of it."""
LAST_DIGITS = 1e-15
"""Share of an angle that is rounding: a few units of the last place."""
MOST_YIELDING = 0.2
"""Deflection of teeth, in modules, beyond which no tooth is elastic. By Lewis' formula the root's stress is about
2.5 F/(b m), and the deflection F/(b c') with c' = 14 kN/(mm mm) of steel (ISO 6336-1), in proportion to the modulus of
others. At the largest stress that gear materials bear, 1.5 GPa of case-hardened steel and 60 MPa of a plastic of
E = 3 GPa, these are 0.04 and 0.12 m."""


@dataclass(frozen=True)
class TransmissionError:
    """Transmission error over one mesh cycle or several.

    Attributes
    ----------
    phase : ndarray
        Driver angle over the pitch angle, from the start, 0 up to 1 by default.
    error : ndarray
        Lag of the driven wheel behind the ratio, at its base circle, m. Zero is kinematic contact of perfect flanks.
    load : float
        Torque, N m; 0 for kinematic.
    forces : ndarray
        Sum of normal forces, N.
    pairs : ndarray
        Tooth pairs touching on the drive flanks.
    stiffness : ndarray
        Tangent mesh stiffness along the line of action, N/m.
    cycles : int
        Mesh cycles covered.
    extremes : tuple of float, optional
        Smallest and largest error where they are known better than from the points, m.
    errors : CurveErrors, optional
        Numerical errors of these, where an accuracy was asked for.
    """

    phase: np.ndarray
    error: np.ndarray
    load: float
    forces: np.ndarray
    pairs: np.ndarray
    stiffness: np.ndarray
    cycles: int = 1
    extremes: tuple[float, float] | None = None
    errors: CurveErrors | None = None

    @property
    def mean(self) -> float:
        """Mean, m."""
        return float(self.error.mean())

    @property
    def peak_to_peak(self) -> float:
        """Peak to peak, m; between the extremes if they are known."""
        return float(np.ptp(self.error if self.extremes is None else self.extremes))

    def harmonics(self, count: int = 5) -> np.ndarray:
        """Peak amplitudes of the first mesh harmonics, m."""
        lines = 2 * np.abs(np.fft.rfft(self.error)) / self.error.size
        return lines[self.cycles : (count + 1) * self.cycles : self.cycles]


def load_of(pair: Mesh, torque: Quantity) -> float:
    """Return a load torque on the driven wheel, N m, by default that of the pair's operating point.

    Raises
    ------
    ValueError
        For a torque that is not positive or not finite.
    """
    load = to_si(pair.operating_point.torque if torque is None else torque, "torque", "torque")
    if not 0.0 < load < math.inf:
        raise ValueError(f"torque is {load} N m; give a positive load, or use kinematic_transmission_error for none")
    return load


def static_lag(pair: Mesh, torque: float) -> float:
    """Angle by which a torque (N m) on one tooth pair of parallel wheels lets the driven wheel lag, rad."""
    radius = pair.geometry.driven.base_radius
    model = pair.contact_model
    return model.penetration(torque / radius, share=model.face_share(pair.geometry)) / radius


class StaticMesh:
    """The contact kernel at rest with the wheels on their axes: torque on the driven wheel against its angle."""

    def __init__(self, pair: Mesh, slices: int | None = None) -> None:
        self.pair = pair
        self.geometry = pair.geometry
        self.rotation = pair.operating_point.rotation
        # an internal wheel turns with its mate: its angle grows where that of an external one falls
        self.turning = self.rotation * pair.geometry.sign
        self.gi, self.gr, size = pack(pair, slices)
        self.gi[layout.FRICTION] = layout.FRICTION_NONE
        self.work = np.zeros(size)
        self.wrench = np.zeros(6)
        self.jac = np.zeros((6, 24))
        self.diag = np.zeros(8)
        self.pairs = most_pairs(pair.geometry, self.gr)
        self.rows = np.zeros((0, len(GAP_COLUMNS)))
        self._zero = np.zeros(3)
        self.sections = np.zeros(1 if self.gi[layout.SLICES] == 1 else 0)
        if self.geometry.driver.helix_angle and self.gi[layout.SLICES] > 1:
            # a contact line that leans over the flank may begin and end anywhere
            self.sections = np.linspace(*self.geometry.common_face, self.gi[layout.SLICES] + 1)
        self.between = self._faulty_sections() if self.gi[layout.SLICES] > 1 else np.zeros(0)

    def _faulty_sections(self) -> np.ndarray:
        """Sections within the common face where flanks with faults along it may come closest, m.

        Deviations are linear between the sections of their tables, so that the gap of parallel axes is least in one of
        these or at an end of the face.
        """
        if not any(fault.along_face for fault in self.pair.faults):
            return np.zeros(0)
        low, high = self.geometry.common_face
        half, count = 0.5 * self.geometry.axial_shift, face_sections(self.pair.faults, self.geometry.wheels)
        faces = [
            middle + gear.face_width * np.linspace(-0.5, 0.5, count)
            for middle, gear in zip((-half, half), self.geometry.wheels)
        ]
        sections = np.unique(np.concatenate(faces))
        return sections[(sections > low) & (sections < high)]

    def torque(self, driver_angle: float, driven_angle: float) -> tuple[float, float]:
        """Contact torque on the driven wheel about its axis, N m, and its derivative by the driven angle."""
        place = self.geometry.frames(driver_angle, driven_angle)
        zero = self._zero
        gear_contact(
            self.gi, self.gr, place.origin_1, place.axes_1, zero, zero, place.origin_2, place.axes_2, zero, zero,
            self.wrench, self.jac, self.diag, 1, self.work,
        )  # fmt: skip
        axis = place.axes_2[:, 2]
        arm = place.origin_2 - place.origin_1
        on_driven = -self.wrench[3:] + np.cross(arm, self.wrench[:3])
        column = self.jac[:, 15:18] @ axis
        slope = -column[3:] + np.cross(arm, column[:3])
        return float(on_driven @ axis), float(slope @ axis)

    def gaps(self, driver_angle: float, driven_angle: float, sections: np.ndarray | None = None) -> np.ndarray:
        """Rows of ``gearmbs.contact.pair_gaps``.

        By default in the sections where flanks may come closest: at the ends of the common face, mid-face for one
        slice, at the nodes of all slices for helical wheels, and between where faults vary along the face.
        """
        if sections is None:
            rows = self.gaps(driver_angle, driven_angle, self.sections)
            if self.between.size:
                rows = rows.copy()  # the next call fills the same table
                rows = np.concatenate([rows, self.gaps(driver_angle, driven_angle, self.between)])
            return rows
        place = self.geometry.frames(driver_angle, driven_angle)
        needed = self.pairs * max(2, sections.size)
        if len(self.rows) < needed:
            self.rows = np.zeros((needed, len(GAP_COLUMNS)))
        count = pair_gaps(
            self.gi, self.gr, place.origin_1, place.axes_1, place.origin_2, place.axes_2, sections, self.rows, self.work
        )
        return self.rows[:count]

    def ideal_angle(self, driver_angle: float) -> float:
        """Driven angle of exact ratio, through kinematic contact of endless perfect flanks on parallel axes.

        Axially shifted helical wheels meet in other sections, turned by the shift times the twist.
        """
        geometry = self.geometry
        alpha, pitch = geometry.working_pressure_angle, geometry.driver.base_pitch
        slack = geometry.base_radius_sum * (math.tan(alpha) - alpha) - geometry.base_arc_sum
        slack -= self.rotation * geometry.axial_shift * geometry.driver.twist_tangent
        slack -= round(slack / pitch) * pitch
        turned = self.rotation * slack / geometry.driven.base_radius
        if geometry.sign < 0:
            return math.pi - turned + (driver_angle - math.pi) / geometry.ratio
        return math.pi + turned - driver_angle / geometry.ratio

    def touching_angle(self, driver_angle: float) -> float:
        """Driven angle at which the drive flanks just touch.

        Raises
        ------
        ValueError
            If no tooth finds a mate's flank to bear on: the wheels lose each other between one pair and the next.
        """
        side = self.rotation
        rb = self.geometry.driven.base_radius
        angle = self.ideal_angle(driver_angle)
        gap = math.inf
        for _ in range(PHASE_STEPS):
            rows = self.gaps(driver_angle, angle)
            gap = rows[rows[:, SIDE] == side, GAP].min(initial=math.inf)
            if not math.isfinite(gap):
                break
            angle += self.turning * gap / rb
            if abs(gap) < TOUCH_TOLERANCE:
                return angle
        if abs(gap) < SEARCHED_FROM:
            return angle
        raise ValueError(
            f"at the driver angle {driver_angle:.6g} rad no tooth bears on its mate's flank: with a contact ratio of "
            f"{self.geometry.contact_ratio:.3f} the wheels lose each other between two teeth; change the centre "
            "distance or give longer teeth"
        )

    def loaded_angle(self, driver_angle: float, torque: float, start: float) -> float:
        """Driven angle at which the contact carries ``torque``, by Newton's method kept inside a bracket.

        Raises
        ------
        ValueError
            If no angle is found at which it does, or if the teeth yield by more than `MOST_YIELDING` there.
        """
        side = self.turning
        lag = side * start
        longest = static_lag(self.pair, torque)
        # steps that grow must not pass a flank and its mate's free way behind it
        widest = STEP_OF_PITCH * 2.0 * math.pi / self.geometry.driven.teeth
        low, high = -math.inf, math.inf
        for step in range(NEWTON_STEPS):
            if step >= SHORT_STEPS:
                longest = max(longest, min(2.0 * longest, widest))
            value, slope = self.torque(driver_angle, side * lag)
            miss = -side * value - torque
            if miss > 0:
                high = lag
            else:
                low = lag
            trial = lag + min(max(miss / slope, -longest), longest) if slope < 0 else math.inf
            # where the correction is rounding, the angle is found, though it lies at the bracket's end
            if abs(trial - lag) <= LAST_DIGITS * abs(lag) or abs(miss) <= 1e-12 * torque:
                break
            if not low < trial < high:
                if math.isfinite(low) and math.isfinite(high):
                    trial = 0.5 * (low + high)
                else:
                    trial = low + longest if math.isfinite(low) else high - longest
            if trial == lag:
                break
            lag = trial
        self._check_carried(driver_angle, torque, side * lag)
        return side * lag

    def _check_carried(self, driver_angle: float, torque: float, driven_angle: float) -> None:
        """Refuse an angle at which the torque is not carried, or only by teeth that no longer are any."""
        carried = -self.turning * self.torque(driver_angle, driven_angle)[0]
        module, radius = self.geometry.driver.module, self.geometry.driven.base_radius
        most = MOST_YIELDING * module
        behind = self.turning * (driven_angle - self.ideal_angle(driver_angle)) * radius
        remedy = (
            f"give a smaller torque (a plain number is in N m; is '{float(torque):g} N mm' meant?) or a stiffer contact"
        )
        if behind > most:
            # faults may let the driven wheel lag before anything is carried
            behind -= self.turning * (self.touching_angle(driver_angle) - self.ideal_angle(driver_angle)) * radius
            if behind > most:
                raise ValueError(
                    f"torque is {float(torque):g} N m: at the driver angle {driver_angle:.6g} rad the teeth would "
                    f"yield by {behind * 1e3:.4g} mm, more than {MOST_YIELDING:g} of their module of "
                    f"{module * 1e3:.4g} mm, which no tooth survives; {remedy}"
                )
        # of a small torque a step of the angle's last digits is more than its share
        step = self.turning * LAST_DIGITS * max(1.0, abs(driven_angle))
        low, high = (-self.turning * self.torque(driver_angle, driven_angle + s)[0] for s in (-step, step))
        allowed = UNBALANCED * torque + abs(high - low)
        self.torque(driver_angle, driven_angle)
        if not abs(carried - torque) <= allowed:
            raise ValueError(
                f"torque is {float(torque):g} N m: at the driver angle {driver_angle:.6g} rad no position of the "
                f"driven wheel was found that carries it (the last carries {carried:.6g} N m); {remedy}"
            )


def touching_angle(pair: Mesh, driver_angle: float = 0.0) -> float:
    """Driven angle at which the drive flanks just touch, rad."""
    return StaticMesh(pair).touching_angle(driver_angle)


def kinematic_transmission_error(
    pair: Mesh,
    points: int = 400,
    slices: int | None = None,
    *,
    start: float = 0.0,
    cycles: int = 1,
    accuracy: QuantityLike | None = None,
) -> TransmissionError:
    """Transmission error at vanishing load: the wheels touch without pressing.

    Its peaks are cusps where a corner hands over to the next; between the points they are searched for, and
    ``extremes`` holds them.

    Parameters
    ----------
    pair : GearPair or Mesh
    points : int
        Positions over one mesh cycle.
    slices : int, optional
        Slices along the face, default the pair's own.
    start : float
        Driver angle to begin with, in pitch angles of the driver.
    cycles : int
        Mesh cycles; as many as the driver's teeth for a turn of it, to see faults of all teeth.
    accuracy : float or str, optional
        To what part of the peak to peak the curve is to be known, such as "1 %" or 0.01. Points, and slices that are
        not given, are chosen for it, and ``errors`` tells; see `gearmbs.gears.curve_accuracy`.

    Warns
    -----
    UserWarning
        Of an accuracy that is not reached; if faults sit on teeth that do not pass the mesh, if the teeth jam, or if
        one slice stands for flanks that vary along the face.
    """
    phase = _phases(pair, points, slices, start, cycles)
    if accuracy is not None:
        return _accurate(
            lambda n, count: _touching_curve(pair, start + np.arange(n * int(cycles)) / n, n, count, cycles),
            pair, accuracy, points, slices,
        )  # fmt: skip
    return _touching_curve(pair, phase, points, slices, cycles)


def _accurate(
    curve: Callable[[int, int], TransmissionError], pair: Mesh, accuracy: QuantityLike, points: int, slices: int | None
) -> TransmissionError:
    from gearmbs.gears.curve_accuracy import accurate_curve

    return accurate_curve(curve, pair, accuracy, points, slices)


def _touching_curve(pair: Mesh, phase: np.ndarray, points: int, slices: int | None, cycles: int) -> TransmissionError:
    """Return the transmission error at vanishing load at some phases."""
    mesh = StaticMesh(pair, slices)
    side, rb = mesh.rotation, mesh.geometry.driven.base_radius

    def touching(angle: float) -> tuple[float, float]:
        driven = mesh.touching_angle(angle)
        rows = mesh.gaps(angle, driven)
        on_drive = rows[(rows[:, SIDE] == side) & (rows[:, GAP] < TOUCHING)]
        return mesh.turning * (driven - mesh.ideal_angle(angle)) * rb, np.unique(on_drive[:, 1]).size

    error, pairs = _over_phases(mesh, phase, touching)
    none = np.zeros(phase.size)
    extremes = _extremes(lambda step: touching(_driver_angle(mesh, step))[0], phase, error, points)
    return TransmissionError(phase, error, 0.0, none, pairs, none.copy(), cycles, extremes)


def loaded_transmission_error(
    pair: Mesh,
    torque: Quantity = None,
    points: int = 400,
    slices: int | None = None,
    *,
    start: float = 0.0,
    cycles: int = 1,
    accuracy: QuantityLike | None = None,
) -> TransmissionError:
    """Quasi-static transmission error under load: rigid wheels, contact compliance only, no friction.

    Parameters
    ----------
    pair : GearPair or Mesh
    torque : float or str, optional
        On the driven wheel, N m; default that of the pair's operating point.
    points, slices, start, cycles, accuracy
        As for `kinematic_transmission_error`; the accuracy is that of the stiffness, too, as a part of its mean.

    Raises
    ------
    ValueError
        For a torque that is not positive, or that no tooth carries: where the teeth yield by more than
        `MOST_YIELDING` modules, or no position of the wheels balances it.

    Warns
    -----
    UserWarning
        If faults sit on teeth that do not pass the mesh, if the teeth jam, or if one slice stands for flanks that vary
        along the face.
    """
    load = load_of(pair, torque)
    phase = _phases(pair, points, slices, start, cycles)
    if accuracy is not None:
        return _accurate(
            lambda n, count: _loaded_curve(pair, load, start + np.arange(n * int(cycles)) / n, count, cycles),
            pair, accuracy, points, slices,
        )  # fmt: skip
    return _loaded_curve(pair, load, phase, slices, cycles)


def _loaded_curve(pair: Mesh, load: float, phase: np.ndarray, slices: int | None, cycles: int) -> TransmissionError:
    """Return the transmission error under a load (N m) at some phases."""
    mesh = StaticMesh(pair, slices)
    side, rb = mesh.turning, mesh.geometry.driven.base_radius
    lag = side * static_lag(pair, load)

    def loaded(angle: float) -> tuple[float, float, float, float]:
        nonlocal lag
        ideal = mesh.ideal_angle(angle)
        driven = mesh.loaded_angle(angle, load, ideal + lag)
        lag = driven - ideal
        _, slope = mesh.torque(angle, driven)
        return side * lag * rb, mesh.diag[NORMAL_FORCE], mesh.diag[PAIRS_DRIVE], -slope / rb**2

    error, forces, pairs, stiffness = _over_phases(mesh, phase, loaded)
    return TransmissionError(phase, error, load, forces, pairs, stiffness, cycles)


def _driver_angle(mesh: StaticMesh, phase: float) -> float:
    return phase * (mesh.rotation * 2 * math.pi / mesh.geometry.driver.teeth)


@waiting("transmission error")
def _over_phases(mesh: StaticMesh, phase: np.ndarray, at: Callable[[float], tuple[float, ...]]) -> np.ndarray:
    """Columns of what a function of the driver's angle returns, at each phase."""
    return np.array([at(_driver_angle(mesh, step)) for step in phase]).T


def _phases(pair: Mesh, points: int, slices: int | None, start: float, cycles: int) -> np.ndarray:
    require_points(points)
    if not math.isfinite(start):
        raise ValueError(f"start is {start!r}; give a finite driver angle, in its pitch angles")
    if cycles < 1 or cycles != int(cycles):
        raise ValueError(f"cycles is {cycles!r}; give a whole number of mesh cycles from 1 up")
    _check_slices(pair, slices, 4)
    warn_of_jam(pair, 4)
    warn_of_unseen(pair, start, start + cycles, "give cycles={turn} for a whole turn, or another start", 4)
    return start + np.arange(points * int(cycles)) / points


def _check_slices(pair: Mesh, slices: int | None, level: int) -> None:
    """Refuse no slices, and warn of a single one that the pair has not itself, which has been remarked on."""
    if slices is None:
        return
    if isinstance(slices, bool) or not isinstance(slices, Integral) or slices < 1:
        raise ValueError(f"slices is {slices!r}; give an integer of 1 or more, or leave it out for the pair's own")
    varying = varying_along_face(pair.geometry, pair.faults)
    if slices == 1 and varying and pair.contact_model.slices != 1:
        warn(
            f"slices is 1: the flanks are looked at in the middle of the face only, and how they vary along it is not "
            f"seen ({', '.join(varying)}); leave slices out for as many as that needs",
        )


def _extremes(
    lag: Callable[[float], float], phase: np.ndarray, error: np.ndarray, points: int
) -> tuple[float, float] | None:
    """Smallest and largest error, searched for around the extreme points of every mesh cycle."""
    if np.ptp(error) < SEARCHED_FROM:
        return None
    from scipy.optimize import minimize_scalar

    ends = []
    for sign, found in ((1.0, float(error.min())), (-1.0, -float(error.max()))):
        for part in range(0, phase.size, points):
            at = phase[part + int(np.argmin(sign * error[part : part + points]))]
            bounds = (at - 1 / points, at + 1 / points)
            best = minimize_scalar(
                lambda x, sign: sign * lag(x), bounds=bounds, args=(sign,), method="bounded", options={"xatol": 1e-9}
            )
            found = min(found, float(best.fun))
        ends.append(sign * found)
    return ends[0], ends[1]


def warn_of_jam(pair: Mesh, level: int = 3) -> None:
    """Warn of a misalignment beyond the backlash: both flanks touch, and no position is free of load.

    Parallel wheels without backlash have been remarked on when they were made.
    """
    geometry = pair.geometry
    if geometry.misalignment and geometry.jams:
        warn(
            f"the teeth jam: under the misalignment of {math.degrees(geometry.misalignment):.4g} deg they need a "
            f"normal backlash of {geometry.jam_backlash * 1e3:.4g} mm and have {geometry.normal_backlash * 1e3:.4g} "
            "mm, so that the coast flanks are in each other where the drive flanks touch; give more backlash",
        )


def warn_of_unseen(pair: Mesh, begin: float, end: float, remedy: str, level: int = 3) -> None:
    """Warn of faults on teeth that do not pass the mesh between two driver angles, in its pitch angles.

    ``{turn}`` in the remedy stands for the teeth of the faulty wheel, ``level`` for the callers up to the user's line.
    """
    faulty = [fault for fault in pair.faults if located(fault)]
    if not faulty:
        return
    passing = _passing(pair, begin, end)
    for fault in faulty:
        wheel = int(fault.wheel == "driven")
        z = pair.geometry.wheels[wheel].teeth
        unseen = sorted({n % z for n in located(fault)} - passing[wheel])
        if unseen:
            names = ", ".join(map(str, unseen))
            warn(
                f"{fault.label} on tooth {names} of the {fault.wheel} wheel does not pass the mesh in the range looked "
                f"at; {remedy.format(turn=z)}",
            )


def _passing(pair: Mesh, begin: float, end: float) -> tuple[set[int], set[int]]:
    """Numbers of the teeth of both wheels that are on the path of contact at some time in the range."""
    mesh = StaticMesh(pair)
    side, geometry = mesh.rotation, mesh.geometry
    gear, mate = geometry.wheels
    middle = gear.base_radius * math.tan(geometry.working_pressure_angle)
    centre = _pitch_point(mesh)
    first = (geometry.first_roll_lengths[0] - middle - geometry.half_overlap) / gear.base_pitch
    last = (gear.tip_roll_length - middle + geometry.half_overlap) / gear.base_pitch
    met = first_mate(mesh)
    turns = range(math.ceil(begin - centre - last), math.floor(end - centre - first) + 1)
    on = mesh.turning
    return {-side * m % gear.teeth for m in turns}, {(met + on * m) % mate.teeth for m in turns}


def _pitch_point(mesh: StaticMesh) -> float:
    """Driver angle at which its tooth 0 touches at the pitch point, in pitch angles and its sense of rotation."""
    geometry, gear = mesh.geometry, mesh.geometry.driver
    alpha = geometry.working_pressure_angle
    turned = math.tan(alpha) - gear.base_half_angle - alpha + mesh.rotation * geometry.mesh_angle
    return turned * gear.teeth / (2 * math.pi)


def first_mate(mesh: StaticMesh) -> int:
    """Return the tooth of the driven wheel whose drive flank tooth 0 of the driver meets in its first turn."""
    angle = mesh.rotation * _pitch_point(mesh) * 2 * math.pi / mesh.geometry.driver.teeth
    rows = mesh.gaps(angle, mesh.ideal_angle(angle))
    return int(rows[(rows[:, SIDE] == mesh.rotation) & (rows[:, TOOTH_1] == 0)][0, TOOTH_2])


def located(fault: Any) -> list[int]:
    """Return the numbers of the teeth that a fault is on; none where it is on all."""
    tooth = getattr(fault, "tooth", None)
    numbers = getattr(fault, "teeth", "all") if tooth is None else tooth
    return [] if isinstance(numbers, str) else [int(n) for n in np.atleast_1d(numbers)]
