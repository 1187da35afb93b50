"""What a gear person looks at, without dynamics: contact pattern over the face, load sharing between pairs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.gears.transmission import StaticMesh

if TYPE_CHECKING:
    from gearmbs.gears.pair import GearPair

SIDE, TOOTH_1, STATION, GAP, STRING_1, SOFT = 0, 1, 3, 4, 6, 11


@dataclass(frozen=True)
class ContactPattern:
    """Load on one driver tooth flank over its whole engagement.

    Attributes
    ----------
    roll_angle : ndarray, shape (n,)
        Driver angle from where the tooth touches at the pitch point, rad, positive towards recess.
    station : ndarray, shape (m,)
        Along the mean axis, from mid-way between the wheels, m.
    pressure : ndarray, shape (n, m)
        Load per unit face width, N/m.
    string : ndarray, shape (n, m)
        Where on the driver's profile, string length, m; NaN without load.
    force : ndarray, shape (n,)
        Load of the tooth, N.
    total : ndarray, shape (n,)
        Load of all teeth on the same side, N.
    """

    roll_angle: np.ndarray
    station: np.ndarray
    pressure: np.ndarray
    string: np.ndarray
    force: np.ndarray
    total: np.ndarray

    @property
    def share(self) -> np.ndarray:
        """Load sharing: the tooth's part of the total."""
        return np.divide(self.force, self.total, out=np.zeros_like(self.force), where=self.total > 0)

    @property
    def face_load_factor(self) -> float:
        """K_Hbeta: largest load per unit width of the engagement over the mean of that moment."""
        return float(self.pressure.max() / self.pressure[self.pressure.max(axis=1).argmax()].mean())


def contact_pattern(
    pair: GearPair, torque: float | None = None, points: int = 81, stations: int = 41, side: str = "drive"
) -> ContactPattern:
    """Follow tooth 0 of the driver through the mesh at rest under load.

    Parameters
    ----------
    pair : GearPair
    torque : float, optional
        On the driven wheel, N m; default the pair's.
    points : int
        Positions over the engagement.
    stations : int
        Along the face.
    side : {"drive", "back"}
        Flank to look at; the back flanks are loaded when misalignment jams the teeth.

    Returns
    -------
    ContactPattern
    """
    if side not in ("drive", "back"):
        raise ValueError(f"side is {side!r}; choose 'drive' or 'back'")
    load = pair.torque if torque is None else torque
    mesh = StaticMesh(pair)
    low, high = pair.common_face
    width = (high - low) / stations
    station = low + (np.arange(stations) + 0.5) * width
    law = pair.contact
    flank = pair.rotation * (1 if side == "drive" else -1)
    gear = pair.wheels[0]
    alpha = pair.working_pressure_angle
    middle = gear.base_radius * math.tan(alpha)
    # tooth 0 touches at string s when the driver stands at s / r_b - psi - alpha, on the side that turns with the drive
    offset = pair.rotation * (math.tan(alpha) - gear.base_half_angle - alpha)
    reach = 0.5 * gear.base_pitch
    begin = pair.line_of_action - pair.wheels[1].tip_string - middle - reach
    end = gear.tip_string - middle + reach
    roll = np.linspace(begin, end, points) / gear.base_radius
    pressure = np.zeros((points, stations))
    string = np.full((points, stations), np.nan)
    total = np.zeros(points)
    lag = pair.penetration(load) * pair.rotation / pair.driven.base_radius
    for k, turn in enumerate(roll):
        angle = offset + pair.rotation * turn
        ideal = mesh.ideal_angle(angle)
        driven = mesh.loaded_angle(angle, load, ideal + lag)
        lag = driven - ideal
        rows = mesh.gaps(angle, driven, station)
        rows = rows[(rows[:, SIDE] == flank) & (rows[:, GAP] < 0)]
        loads = law.stiffness / pair.common_face_width * rows[:, SOFT] * (-rows[:, GAP]) ** law.exponent
        total[k] = loads.sum() * width
        mine = rows[:, TOOTH_1] == 0
        at = np.rint((rows[mine, STATION] - station[0]) / width).astype(int)
        pressure[k, at] = loads[mine]
        string[k, at] = rows[mine, STRING_1]
    return ContactPattern(roll, station, pressure, string, pressure.sum(axis=1) * width, total)
