"""Kinematic lines of a planetary set whose ring is at rest: what a measurement needs to know of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from .errors import SignalError
from .planetary import planet_angles

SUN, PLANET, RING = "sun", "planet", "ring"
PARTS = (SUN, PLANET, RING)


@dataclass(frozen=True)
class PlanetaryLines:
    """Orders of a planetary set by turns of its carrier, the ring at rest.

    Attributes
    ----------
    teeth : (int, int, int)
        Of sun, planet and ring.
    angles : tuple of float
        Of the planets on the carrier, rad.
    """

    teeth: tuple[int, int, int]
    angles: tuple[float, ...]

    @property
    def planets(self) -> int:
        """Number of planets N."""
        return len(self.angles)

    @property
    def mesh(self) -> int:
        """Order of the mesh, z_r."""
        return self.teeth[2]

    @property
    def orders(self) -> dict[str, float]:
        """Order of one faulty tooth of each part: sun N z_r/z_s, planet z_r/z_p (one set of flanks), ring N."""
        sun, own, ring = self.teeth
        return {SUN: self.planets * ring / sun, PLANET: ring / own, RING: float(self.planets)}

    def carrier(self, speed: float, member: str = "carrier") -> float:
        """Return the carrier's speed from that of a member.

        Raises
        ------
        SignalError
            For other members than "carrier" and "sun".
        """
        if member == "carrier":
            return speed
        if member == "sun":
            return speed * self.teeth[0] / (self.teeth[0] + self.teeth[2])
        raise SignalError(f"member: must be 'carrier' or 'sun', got {member!r}")

    def table(self, carrier: float, harmonics: int = 3) -> pd.DataFrame:
        """Return the kinematic lines at a frequency of the carrier in Hz: part, harmonic, order, frequency."""
        orders = {"carrier": 1.0, "sun shaft": 1.0 + self.teeth[2] / self.teeth[0], "mesh": float(self.mesh)}
        orders |= {f"{part} fault": order for part, order in self.orders.items()}
        rows = [(name, k, k * n, k * n * carrier) for name, n in orders.items() for k in range(1, harmonics + 1)]
        return pd.DataFrame(rows, columns=["part", "harmonic", "order", "frequency"])


def planetary_lines(given: Any, planets: int | Sequence[float] = 3) -> PlanetaryLines:
    """Return the lines of a planetary set.

    Parameters
    ----------
    given : PlanetarySet, PlanetaryLines or (int, int, int)
        A `gearmbs.gears.PlanetarySet`, or the teeth of sun, planet and ring.
    planets : int or sequence of float
        How many, equally spaced, or their angles; of teeth only.

    Raises
    ------
    SignalError
        If these are no three whole numbers.
    """
    if isinstance(given, PlanetaryLines):
        return given
    if hasattr(given, "ring") and hasattr(given, "angles"):
        teeth, planets = (given.sun.teeth, given.planet.teeth, given.ring.teeth), [float(a) for a in given.angles]
        if given.planet_at_ring is not None:
            raise SignalError("planetary: planets are stepped; lines are known of plain planets only")
    else:
        try:
            teeth = tuple(int(z) for z in given)  # type: ignore[assignment]
        except (TypeError, ValueError):
            teeth = ()  # type: ignore[assignment]
        if len(teeth) != 3 or min(teeth) < 1:
            raise SignalError(
                f"planetary: give the teeth of sun, planet and ring, for instance (24, 30, 84); got {given!r}"
            )
    if teeth[2] <= teeth[0] or teeth[2] <= teeth[1]:
        raise SignalError(f"planetary: of {teeth} the ring, the last, must have the most teeth")
    angles = planet_angles(planets)
    return PlanetaryLines(teeth, tuple(float(a) % math.tau for a in angles))
