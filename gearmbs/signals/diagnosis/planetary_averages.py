"""Signals of planetary sets: the sensor on the ring, carrier orders, averages by planet and by sun, a signal model.

A sensor on the ring hears each planet as it passes. That is described by a path function ``w`` of the angle between
planet and sensor; a rigid ring on a rigid housing has none, and its signal no modulation at the carrier's speed. Planet
k stands at ``psi_k`` on the carrier, whose angle is ``theta``. Ring at rest.

References
----------
.. [1] P. D. McFadden, J. D. Smith: An explanation for the asymmetry of the modulation sidebands about the tooth meshing
   frequency in epicyclic gear vibration. Proc. Instn Mech. Engrs 199C (1985) 65-70.
.. [2] P. D. McFadden: A technique for calculating the time domain averages of the vibration of the individual planet
   gears and the sun gear in an epicyclic gearbox. J. Sound Vibr. 144 (1991) 163-172.
.. [3] I. M. Howard: Epicyclic transmission fault detection by vibration analysis. Australian Vibration and Noise
   Conference (1990).
.. [4] Z. Feng, M. J. Zuo: Vibration signal models for fault diagnosis of planetary gearboxes. J. Sound Vibr. 331
   (2012) 4919-4939.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs.signals.analysis.bands import order_rms
from gearmbs.signals.errors import SignalError
from gearmbs.signals.rotation.angular import angular_resample
from gearmbs.signals.signal.signal import make_signal

SHARPNESS = 4.0
"""Exponent of the default path function exp(sharpness (cos - 1)): a planet is heard to a tenth at 65 degrees."""


def path_weight(angle: np.ndarray, sharpness: float = SHARPNESS) -> np.ndarray:
    """Path function ``exp(sharpness (cos(angle) - 1))`` of the angle between planet and sensor, rad."""
    return np.exp(sharpness * (np.cos(angle) - 1.0))


def planet_angles(planets: int | Sequence[float]) -> np.ndarray:
    """Angles of the planets on the carrier, rad, from their number, equally spaced, or from the angles themselves.

    Raises
    ------
    SignalError
        For no planets.
    """
    if isinstance(planets, (int, np.integer)):
        if planets < 1:
            raise SignalError(f"planets: must be 1 or more, or their angles in rad, got {planets!r}")
        return 2 * math.pi * np.arange(planets) / planets
    angles = np.asarray(planets, dtype=float)
    if angles.ndim != 1 or angles.size == 0 or not np.isfinite(angles).all():
        raise SignalError("planets: give how many there are, or their angles in rad")
    return angles


def fixed_sensor(
    sources: np.ndarray,
    carrier_angle: np.ndarray,
    planets: int | Sequence[float],
    *,
    sensor_angle: float = 0.0,
    sharpness: float = SHARPNESS,
) -> np.ndarray:
    """What a sensor on the ring hears of the planets' meshes: their sum, each weighted by its path.

    Parameters
    ----------
    sources : ndarray, shape (n, planets)
        One signal a planet, for instance the force of its mesh with the ring.
    carrier_angle : ndarray, shape (n,)
        rad.
    planets : int or sequence of float
        How many, equally spaced, or their angles on the carrier.
    sensor_angle : float
        Where the sensor is, rad.
    sharpness : float
        Of the path function.

    Raises
    ------
    SignalError
        If the shapes do not fit.
    """
    angles, values = planet_angles(planets), np.asarray(sources, dtype=float)
    theta = np.asarray(carrier_angle, dtype=float)
    if values.shape != (theta.size, angles.size):
        raise SignalError(
            f"sources: shape {values.shape} does not fit {theta.size} angles of the carrier and {angles.size} planets"
        )
    weights = path_weight(theta[:, None] + angles - sensor_angle, sharpness)
    return (weights * values).sum(axis=1)


def carrier_lines(
    ring_teeth: int,
    planets: int | Sequence[float],
    *,
    harmonic: int = 1,
    sidebands: int = 12,
    sharpness: float = SHARPNESS,
) -> dict[int, float]:
    """Amplitudes of the carrier orders around a mesh harmonic at a sensor on the ring, for meshes of amplitude 1.

    The order n = h z_r + m has the amplitude ``W_m |sum_k exp(i n psi_k)|`` with the path function's Fourier
    coefficients ``W_m = exp(-c) I_m(c)``. With equal spacing only multiples of the number of planets are heard; the
    mesh line itself may be none of them.

    Examples
    --------
    >>> {n: round(a, 3) for n, a in carrier_lines(100, 4, sidebands=4).items() if a > 1e-9}
    {96: 0.104, 100: 0.828, 104: 0.104}
    """
    from scipy.special import ive

    angles = planet_angles(planets)
    centre = harmonic * ring_teeth
    lines = {}
    for m in range(-sidebands, sidebands + 1):
        heard = abs(np.exp(1j * (centre + m) * angles).sum())
        lines[centre + m] = float(ive(abs(m), sharpness) * heard)
    return lines


def mesh_band_orders(ring_teeth: int, planets: int, harmonics: int = 3, reach: int = 2) -> list[list[int]]:
    """Carrier orders that belong to each mesh harmonic: the line and those up to ``reach`` planet passes beside it."""
    width = reach * planets
    return [list(range(h * ring_teeth - width, h * ring_teeth + width + 1)) for h in range(1, harmonics + 1)]


def mesh_bands(
    signal: xr.DataArray, carrier_rate: float, ring_teeth: int, planets: int, *, harmonics: int = 3, reach: int = 2
) -> xr.DataArray:
    """RMS of the bands around the mesh harmonics, sidebands of the planets' passing included.

    The mesh line alone may be silent at a sensor on the ring; its band is not.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), at constant speed.
    carrier_rate : float
        Rotation of the carrier, Hz.
    ring_teeth, planets : int
    harmonics : int
    reach : int
        Planet passes on either side that a band covers.

    Returns
    -------
    xarray.DataArray
        Dimensions (harmonic, channel).
    """
    bands = []
    for orders in mesh_band_orders(ring_teeth, planets, harmonics, reach):
        lines = order_rms(signal, carrier_rate, orders)
        bands.append((lines**2).sum("order") ** 0.5)
    return xr.concat(bands, "harmonic").assign_coords(harmonic=np.arange(1, harmonics + 1))


def planetary_average(
    signal: xr.DataArray,
    carrier_phase: xr.DataArray,
    teeth: tuple[int, int, int],
    which: Literal["planet", "sun"] = "planet",
    *,
    planets: int | Sequence[float] = 3,
    planet: int = 0,
    sensor_angle: float = 0.0,
    per_tooth: int = 32,
) -> xr.DataArray:
    """Average over turns of a planet or the sun against the carrier, from windows about the planets' passing.

    Whenever a planet passes the sensor, a piece of two teeth's length is cut out with a Hann window and put where the
    tooth in mesh stands on the wheel; neighbouring windows add up to one (McFadden, Howard). Each tooth has been seen
    after as many turns of the carrier as the wheel has teeth. Where that has a common factor with the teeth of the
    ring, only every so-manieth tooth passes the sensor with the planet, and the pieces are as many times longer.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), from a sensor on the ring.
    carrier_phase : xarray.DataArray
        Angle of the carrier, rad, as for `angular_resample`.
    teeth : (int, int, int)
        Of sun, planet and ring.
    which : {"planet", "sun"}
        Whose average. All planets' passings serve the sun's.
    planets : int or sequence of float
    planet : int
        The planet that is averaged, from 0.
    sensor_angle : float
    per_tooth : int
        Samples a tooth.

    Returns
    -------
    xarray.DataArray
        Dimensions (angle, channel): angle in revolutions of the wheel against the carrier, `samples_per_rev` as the
        averages of `time_synchronous_average`; attribute ``passes``: how often the least seen piece was.

    Raises
    ------
    SignalError
        If the record is too short to see every tooth.
    """
    sun, own, ring = teeth
    if which not in ("planet", "sun"):
        raise SignalError(f"which: must be 'planet' or 'sun', got {which!r}")
    angles = planet_angles(planets)
    if not 0 <= planet < angles.size:
        raise SignalError(f"planet: must be 0 to {angles.size - 1}, got {planet!r}")
    count = own if which == "planet" else sun
    tracked = angular_resample(signal, carrier_phase, samples_per_rev=ring * per_tooth)
    values, first = tracked.values, round(float(tracked["angle"].values[0]) * ring * per_tooth)
    common = math.gcd(count, ring)
    half = common * per_tooth
    window = 0.5 + 0.5 * np.cos(np.pi * np.arange(-half, half) / half)
    total = np.zeros((count * per_tooth, values.shape[1]))
    seen, weight = np.zeros(count // common, dtype=int), np.zeros(count * per_tooth)
    for k in [planet] if which == "planet" else range(angles.size):
        turned = (sensor_angle - angles[k]) / (2 * math.pi)
        begin = math.ceil(first / (ring * per_tooth) - turned)
        for turn in range(begin, begin + math.ceil(len(values) / (ring * per_tooth)) + 1):
            centre = round((turn + turned) * ring * per_tooth) - first
            if centre < half or centre + half > len(values):
                continue
            # teeth that passed: of the planet as many as of the ring, of the sun by where the planet stands, too
            passed = turn * ring if which == "planet" else (turn + turned) * ring - sun * angles[k] / (2 * math.pi)
            place = round(passed * per_tooth) % (count * per_tooth)
            at = (place + np.arange(-half, half)) % (count * per_tooth)
            np.add.at(total, at, window[:, None] * values[centre - half : centre + half])
            np.add.at(weight, at, window)
            seen[place // half % seen.size] += 1
    if (weight < 0.5).any():
        needed = count // common
        raise SignalError(
            f"signal: covers {len(values) / (ring * per_tooth):.1f} turns of the carrier; each tooth of the {which} is "
            f"seen after {needed}, give a longer record"
        )
    average = total / weight[:, None]
    return xr.DataArray(
        average,
        dims=("angle", "channel"),
        coords={"angle": np.arange(count * per_tooth) / (count * per_tooth), "channel": tracked["channel"].values},
        attrs={**tracked.attrs, "samples_per_rev": count * per_tooth, "teeth": (count,), "passes": int(seen.min())},
    )


@dataclass(frozen=True)
class PlanetaryModel:
    """Phenomenological signal of a planetary set with its ring at rest, at a sensor on the ring.

    The meshes of each planet are amplitude and phase modulated by a fault, and weighted by the path (Feng, Zuo):

        x = sum_k w(theta + psi_k) [1 + A cos(phi_k)] sum_h a_h cos(h (z_r (theta + psi_k) + B sin(phi_k)) + alpha_h)

    where phi_k is the angle of the fault: z_r theta / z_p for a planet's tooth, z_r theta / z_s - psi_k for the sun's,
    theta + psi_k for the ring's.

    Parameters
    ----------
    teeth : (int, int, int)
        Of sun, planet and ring.
    planets : int or sequence of float
    amplitudes : sequence of float
        Of the mesh harmonics.
    fault : {"sun", "planet", "ring"}, optional
    planet : int
        The faulty planet.
    modulation, phase_modulation : float
        A, and B in rad.
    sharpness : float
        Of the path function; 0 hears all planets alike.
    noise : float
        Standard deviation of white noise.
    seed : int
    """

    teeth: tuple[int, int, int]
    planets: int | Sequence[float] = 3
    amplitudes: Sequence[float] = (1.0, 0.5, 0.25)
    fault: str | None = None
    planet: int = 0
    modulation: float = 0.5
    phase_modulation: float = 0.0
    sharpness: float = SHARPNESS
    noise: float = 0.0
    seed: int = 0
    attrs: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        angles = planet_angles(self.planets)
        if self.fault not in (None, "sun", "planet", "ring"):
            raise SignalError(f"fault: must be 'sun', 'planet', 'ring' or None, got {self.fault!r}")
        if not 0 <= self.planet < angles.size:
            raise SignalError(f"planet: must be 0 to {angles.size - 1}, got {self.planet!r}")

    def values(self, carrier_angle: np.ndarray) -> np.ndarray:
        """Signal at angles of the carrier, rad, without noise."""
        theta = np.asarray(carrier_angle, dtype=float)
        angles = planet_angles(self.planets)
        sources = np.zeros((theta.size, angles.size))
        for k, psi in enumerate(angles):
            phi, share = self._fault_angle(theta, k, float(psi))
            phase = self.teeth[2] * (theta + psi) + share * self.phase_modulation * np.sin(phi)
            carried = sum(a * np.cos((h + 1) * phase) for h, a in enumerate(self.amplitudes))
            sources[:, k] = (1.0 + share * self.modulation * np.cos(phi)) * carried
        return fixed_sensor(sources, theta, angles.tolist(), sharpness=self.sharpness)

    def _fault_angle(self, theta: np.ndarray, k: int, psi: float) -> tuple[np.ndarray, float]:
        """Return the angle of the fault in the mesh of a planet, and whether it is there."""
        sun, own, ring = self.teeth
        if self.fault == "planet":
            return ring * theta / own, float(k == self.planet)
        if self.fault == "sun":
            return ring * theta / sun - psi, 1.0
        if self.fault == "ring":
            return theta + psi, 1.0
        return theta, 0.0

    def signal(self, duration: float, rate: float, carrier_rate: float) -> xr.DataArray:
        """Record of so many seconds at a constant speed of the carrier, Hz."""
        times = np.arange(round(duration * rate)) / rate
        values = self.values(2 * math.pi * carrier_rate * times)
        if self.noise:
            values = values + np.random.default_rng(self.seed).normal(scale=self.noise, size=values.size)
        return make_signal(values, rate, units="m/s^2", attrs=dict(self.attrs))


# Kinematic lines of a planetary set whose ring is at rest: what a measurement needs to know of it.


SUN, PLANET, RING = "sun", "planet", "ring"


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
