"""Whether the meshes of a drivetrain's record turn at steady speeds, near the nominal ones.

Harmonics of a mesh are told at the mean speed of the record. Where a motor slips, that is not the nominal speed, and
the record says so. Where the speed changes by up to `STRAY` over the record, levels that it would lower follow the
angle of the driver; where it changes more there are none.
"""

from __future__ import annotations

import math
import warnings
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from gearmbs.drivetrain import Drivetrain
from gearmbs.drivetrain.kinematics import RPM

TURN = 2.0 * math.pi
STRAY = 0.02
"""Difference from the nominal speed that a record remarks on, and change over a record beyond which lines move."""
FAR = 0.1
"""The same that is warned of: motors slip less than that between no load and their rated torque."""
SMEAR = 1.0
"""Largest phase, rad, by which a harmonic may stray from one frequency: it then loses 1 % of its level."""


class HeldSpeed(NamedTuple):
    """How the driver of a mesh turns over a record.

    Attributes
    ----------
    shaft : str
    nominal, mean : float
        Speeds about the shaft's axis, rad/s.
    change : float
        Of the speed from the beginning to the end of the record, rad/s: twice the difference of the means of both
        halves, weighted by a Hann window so that oscillations hardly count.
    """

    shaft: str
    nominal: float
    mean: float
    change: float

    @property
    def is_steady(self) -> bool:
        """Whether there is one mesh frequency: the speed keeps its value, in the sense of the nominal one."""
        return self.nominal == 0.0 or (self.mean * self.nominal > 0.0 and abs(self.change) <= STRAY * abs(self.mean))

    @property
    def stray(self) -> float:
        """Difference from the nominal speed over that."""
        return self.mean / self.nominal - 1.0 if self.nominal else 0.0

    def smears(self, cycles: float) -> bool:
        """Return whether the change of speed lowers a line of so many cycles in the record.

        With f = f_0 (1 + c (t/T - 1/2)) the phase strays by up to pi/4 c f_0 T from that of f_0.
        """
        return 0.25 * math.pi * abs(self.change / self.mean) * cycles > SMEAR


def held_speeds(train: Drivetrain, record: xr.Dataset) -> dict[str, HeldSpeed]:
    """Return how the driver of each mesh turns over a record, by mesh."""
    out = {}
    for mesh in train.meshes:
        driver, _ = train.wheels_of(mesh)
        speed = record["speed"].sel(shaft=driver.shaft).values
        weight = np.hanning(speed.size // 2 + 2)[1:-1]
        first = float(weight @ speed[: weight.size] / weight.sum())
        last = float(weight @ speed[-weight.size :] / weight.sum())
        mean = float(speed.mean())
        out[mesh.name] = HeldSpeed(driver.shaft, train.speeds[driver.shaft], mean, 2.0 * (last - first))
    return out


def by_angle(signals: np.ndarray, cycles: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Return signals at even steps of the angle of a mesh.

    Parameters
    ----------
    signals : ndarray, shape (m, signals)
    cycles : ndarray, shape (m,)
        Mesh cycles at the same samples, from 0.

    Returns
    -------
    even : ndarray, shape (m, signals)
    rate : float
        Samples a cycle.
    fundamental : float
        1: the mesh frequency in cycles a cycle.
    """
    from scipy.interpolate import make_interp_spline

    # where teeth hammer the wheel may turn back within a cycle; of that a mesh harmonic knows nothing
    places = np.maximum.accumulate(cycles)
    even = np.linspace(0.0, places[-1], places.size)
    samples = np.arange(places.size, dtype=float)
    at = np.interp(even, places, samples)
    return make_interp_spline(samples, signals, k=3)(at), (places.size - 1) / places[-1], 1.0


def remarks(held: dict[str, HeldSpeed]) -> list[str]:
    """Return what a record says of its speeds: of each mesh whose speed is not steady or not the nominal one."""
    out = []
    for mesh, one in held.items():
        mean, nominal = one.mean * RPM, one.nominal * RPM
        both = f"shaft '{one.shaft}' turns at {mean:.5g} rpm in the mean, nominal are {nominal:.5g} rpm"
        if not one.is_steady:
            change = abs(one.change) * RPM
            out.append(
                f"mesh '{mesh}': {both}, and its speed is not steady (it changes by about {change:.3g} rpm over the "
                "record): there are no levels of mesh harmonics"
            )
        elif abs(one.stray) > STRAY:
            out.append(f"mesh '{mesh}': {both}: levels are at the mesh frequency of the mean speed")
    return out


def speed_attributes(held: dict[str, HeldSpeed]) -> dict[str, Any]:
    """Return what a record says of its speeds as attributes."""
    return {
        "speed_is_steady": int(all(one.is_steady for one in held.values())),
        "remarks": "; ".join(remarks(held)) or "none",
    }


def warn_of_speeds(train: Drivetrain, held: dict[str, HeldSpeed], stacklevel: int = 4) -> None:
    """Warn of speeds that are not steady, or far from the nominal ones.

    Warns
    -----
    UserWarning
        With the mesh, both speeds and the remedy.
    """
    doubtful = {mesh: one for mesh, one in held.items() if not one.is_steady or abs(one.stray) > FAR}
    for remark in remarks(doubtful):
        warnings.warn(
            f"drivetrain '{train.name}': {remark}; give a drive that carries the load at its speed, longer "
            "run.settling, or a SpeedDrive with curve for a run-up",
            stacklevel=stacklevel,
        )
