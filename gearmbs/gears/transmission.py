"""Transmission error without dynamics: kinematic (no load) and loaded quasi-static, from the contact kernel itself."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.contact import GAP_COLUMNS, gear_contact, layout, pair_gaps

if TYPE_CHECKING:
    from gearmbs.gears.pair import GearPair

MAX_ROWS = 4000
NEWTON_STEPS = 100
PHASE_STEPS = 50
TOUCH_TOLERANCE = 1e-15  # m


@dataclass(frozen=True)
class TransmissionError:
    """Transmission error over one mesh cycle.

    Attributes
    ----------
    phase : ndarray
        Driver angle over the pitch angle, 0 up to 1.
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
    """

    phase: np.ndarray
    error: np.ndarray
    load: float
    forces: np.ndarray
    pairs: np.ndarray
    stiffness: np.ndarray

    @property
    def mean(self) -> float:
        """Mean, m."""
        return float(self.error.mean())

    @property
    def peak_to_peak(self) -> float:
        """Peak to peak, m."""
        return float(np.ptp(self.error))

    def harmonics(self, count: int = 5) -> np.ndarray:
        """Amplitudes of the first mesh harmonics, m."""
        return 2 * np.abs(np.fft.rfft(self.error))[1 : count + 1] / self.error.size


class StaticMesh:
    """The contact kernel at rest with the wheels on their axes: torque on the driven wheel against its angle."""

    def __init__(self, pair: GearPair, slices: int | None = None) -> None:
        self.pair = pair
        self.gi, self.gr, size = pair.contact_tables(slices)
        self.gi[layout.FRICTION] = layout.FRICTION_NONE
        self.work = np.zeros(size)
        self.wrench = np.zeros(6)
        self.jac = np.zeros((6, 24))
        self.diag = np.zeros(8)
        self.rows = np.zeros((MAX_ROWS, len(GAP_COLUMNS)))
        self._zero = np.zeros(3)

    def torque(self, driver_angle: float, driven_angle: float) -> tuple[float, float]:
        """Contact torque on the driven wheel about its axis, N m, and its derivative by the driven angle."""
        place = self.pair.frames(driver_angle, driven_angle)
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

    def gaps(self, driver_angle: float, driven_angle: float, stations: np.ndarray | None = None) -> np.ndarray:
        """Rows of ``gearmbs.contact.pair_gaps`` (by default at the ends of the common face, mid-face for one slice)."""
        place = self.pair.frames(driver_angle, driven_angle)
        if stations is None:
            stations = np.zeros(1 if self.gi[layout.N_SLICES] == 1 else 0)
        count = pair_gaps(
            self.gi, self.gr, place.origin_1, place.axes_1, place.origin_2, place.axes_2, stations, self.rows, self.work
        )
        return self.rows[:count]

    def ideal_angle(self, driver_angle: float) -> float:
        """Driven angle of exact ratio, through kinematic contact of endless perfect flanks on parallel axes."""
        one, two = self.pair.wheels
        alpha = self.pair.working_pressure_angle
        slack = (one.base_radius + two.base_radius) * (math.tan(alpha) - alpha)
        slack -= one.base_radius * one.base_half_angle + two.base_radius * two.base_half_angle
        slack -= round(slack / one.base_pitch) * one.base_pitch
        return math.pi + self.pair.rotation * slack / two.base_radius - driver_angle / self.pair.ratio

    def touching_angle(self, driver_angle: float) -> float:
        """Driven angle at which the drive flanks just touch."""
        side = self.pair.rotation
        rb = self.pair.driven.base_radius
        angle = self.ideal_angle(driver_angle)
        for _ in range(PHASE_STEPS):
            rows = self.gaps(driver_angle, angle)
            gap = rows[rows[:, 0] == side, 4].min()
            angle += side * gap / rb
            if abs(gap) < TOUCH_TOLERANCE:
                break
        return angle

    def loaded_angle(self, driver_angle: float, torque: float, start: float) -> float:
        """Driven angle at which the contact carries ``torque``, by Newton's method kept inside a bracket."""
        side = self.pair.rotation
        lag = side * start
        longest = self.pair.penetration(torque) / self.pair.driven.base_radius
        low, high = -math.inf, math.inf
        for _ in range(NEWTON_STEPS):
            value, slope = self.torque(driver_angle, side * lag)
            miss = -side * value - torque
            if miss > 0:
                high = lag
            else:
                low = lag
            trial = lag + min(max(miss / slope, -longest), longest) if slope < 0 else math.inf
            if not low < trial < high:
                if math.isfinite(low) and math.isfinite(high):
                    trial = 0.5 * (low + high)
                else:
                    trial = low + longest if math.isfinite(low) else high - longest
            if abs(trial - lag) <= 1e-16 or abs(miss) <= 1e-12 * torque:
                break
            lag = trial
        return side * lag


def touching_angle(pair: GearPair, driver_angle: float = 0.0) -> float:
    """Driven angle at which the drive flanks just touch, rad."""
    return StaticMesh(pair).touching_angle(driver_angle)


def kinematic_transmission_error(pair: GearPair, points: int = 400, slices: int | None = None) -> TransmissionError:
    """Transmission error at vanishing load: the wheels touch without pressing.

    Parameters
    ----------
    pair : GearPair
    points : int
        Positions over one mesh cycle.
    slices : int, optional
        Slices along the face, default the pair's own.
    """
    mesh = StaticMesh(pair, slices)
    phase = np.arange(points) / points
    error = np.empty(points)
    pairs = np.empty(points)
    rb = pair.driven.base_radius
    for k, step in enumerate(phase):
        angle = pair.rotation * step * 2 * math.pi / pair.driver.teeth
        error[k] = pair.rotation * (mesh.touching_angle(angle) - mesh.ideal_angle(angle)) * rb
        rows = mesh.gaps(angle, mesh.touching_angle(angle))
        touching = rows[(rows[:, 0] == pair.rotation) & (rows[:, 4] < 1e-9)]
        pairs[k] = np.unique(touching[:, 1]).size
    return TransmissionError(phase, error, 0.0, np.zeros(points), pairs, np.zeros(points))


def loaded_transmission_error(
    pair: GearPair, torque: float | None = None, points: int = 400, slices: int | None = None
) -> TransmissionError:
    """Quasi-static transmission error under load: rigid wheels, contact compliance only, no friction.

    Parameters
    ----------
    pair : GearPair
    torque : float, optional
        On the driven wheel, N m; default the pair's.
    points : int
        Positions over one mesh cycle.
    slices : int, optional
        Slices along the face, default the pair's own.
    """
    load = pair.torque if torque is None else torque
    if not load > 0:
        raise ValueError(f"torque is {load} N m; give a positive load, or use kinematic_transmission_error for none")
    mesh = StaticMesh(pair, slices)
    phase = np.arange(points) / points
    error, forces, pairs, stiffness = (np.empty(points) for _ in range(4))
    rb = pair.driven.base_radius
    lag = pair.penetration(load) * pair.rotation / rb
    for k, step in enumerate(phase):
        angle = pair.rotation * step * 2 * math.pi / pair.driver.teeth
        ideal = mesh.ideal_angle(angle)
        loaded = mesh.loaded_angle(angle, load, ideal + lag)
        lag = loaded - ideal
        _, slope = mesh.torque(angle, loaded)
        error[k] = pair.rotation * lag * rb
        forces[k] = mesh.diag[7]
        pairs[k] = mesh.diag[5]
        stiffness[k] = -slope / rb**2
    return TransmissionError(phase, error, load, forces, pairs, stiffness)
