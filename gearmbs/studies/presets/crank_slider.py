"""A crank-slider driven through a gear pair: healthy, with a chipped or an eccentric wheel.

The slider's inertia alternates the torque on the crank, so that without another load the flanks change where the torque
changes its sign.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gearmbs.drivetrain import Drivetrain
from gearmbs.mechanism import Mechanism
from gearmbs.studies.presets.files import preset_train, with_values


@dataclass(frozen=True)
class CrankSlider:
    """Crank, massless rod and slider behind a gear pair.

    Parameters
    ----------
    radius, rod : float
        Of the crank and length of the rod, m.
    slider : float
        Mass, kg.
    speed : float
        Of the crank, rad/s.
    teeth : tuple of int
    backlash : float
        m.
    load : float
        Constant torque that resists on the crank, N m; above the slider's largest the flanks never change.
    settings : tuple of (str, object)
        Further keywords of the pair, such as ``("faults", (...))``.
    """

    radius: float = 0.05
    rod: float = 0.20
    slider: float = 1.0
    speed: float = 100.0 * math.pi / 30.0
    teeth: tuple[int, int] = (20, 60)
    backlash: float = 1e-4
    load: float = 0.0
    settings: tuple[tuple[str, Any], ...] = ()

    def torque(self, angle: np.ndarray | float) -> np.ndarray:
        """Return the slider's inertia torque on a crank that turns evenly, N m.

        With the slider at s(angle) and s' = ds/dangle: T = -m w^2 s' s''.
        """
        r, rod = self.radius, self.rod
        angle = np.asarray(angle, dtype=float)
        sine, cosine = np.sin(angle), np.cos(angle)
        root = np.sqrt(rod * rod - r * r * sine * sine)
        first = -r * sine - r * r * sine * cosine / root
        second = -r * cosine - r * r * (cosine**2 - sine**2) / root - r**4 * sine**2 * cosine**2 / root**3
        return -self.slider * self.speed**2 * first * second

    def flank_changes(self) -> np.ndarray:
        """Return the crank's angles in a turn at which the torque on the unloaded pair changes its sign, rad."""
        from scipy.optimize import brentq

        angles = np.linspace(-0.5, 2.0 * np.pi - 0.5, 721)
        values = self.torque(angles) - self.load
        places = np.flatnonzero(values[1:] * values[:-1] < 0.0)
        return np.array([brentq(lambda a: float(self.torque(a)) - self.load, angles[k], angles[k + 1]) for k in places])

    def train(self) -> Drivetrain:
        """Return the pair with its shafts: the crank's turns with ``speed``."""
        z1, z2 = self.teeth
        train = preset_train("crank_slider")
        # the fillet that fits is that of the number of teeth
        wheels = [
            replace(wheel, gear=replace(wheel.gear, teeth=z, fillet_radius=None))
            for wheel, z in zip(train.wheels, self.teeth, strict=True)
        ]
        return with_values(train, {
            **{wheel.name: wheel for wheel in wheels},
            "mesh": {"settings": {"backlash": self.backlash, **dict(self.settings)}},
            "drive": {"speed": -self.speed * z2 / z1},
            "load": {"torque": self.load},
        })  # fmt: skip

    def build(self) -> Mechanism:
        """Return the mechanism: the train, the slider and the rod, which keeps their distance.

        The crank is at its angle zero, with the slider farthest away along the crank's x axis.
        """
        train = self.train()
        m = train.build()
        crank = m.bodies["crank"]
        middle = crank.position + 0.02 * crank.orientation[:, 2]
        pin = crank.marker_at(middle + np.array([self.radius, 0.0, 0.0]), np.eye(3), name="pin")
        place = middle + np.array([self.radius + self.rod, 0.0, 0.0])
        i = 1e-3 * self.slider
        slider = m.body("slider", mass=self.slider, inertia=(i, i, i), position=place)
        m.translational("guide", slider, m.ground, at=place, axis=(1.0, 0.0, 0.0))
        m.distance("rod", pin, slider.marker(name="eye"), self.rod)
        return m
