"""Virtual sensors: from motions and forces to the records a measuring system would give.

Each is a pure function of signals, so what it makes can be treated like a measurement: laser vibrometer, accelerometer
at a bearing support behind a transfer path, joint force; then sampling, noise and quantisation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.fft
import xarray as xr

from gearmbs.signals.errors import SignalError
from gearmbs.signals.filters import decimate, resample
from gearmbs.signals.signal.signal import check_rate, common_unit, like, rate_of

XYZ = ("x", "y", "z")
DECAY_TIMES = 10.0
"""Time constants of a mode after which its start is forgotten: e^-10 is 4.5e-5, 87 dB."""


@dataclass(frozen=True)
class Mode:
    """A mode of a transfer path.

    Attributes
    ----------
    frequency : float
        Undamped natural frequency in Hz.
    damping : float
        Fraction of critical damping.
    mass : float
        Modal mass in kg for the force's and the sensor's points: acceleration per force is 1 / mass far above
        resonance. Negative where the two points move against each other.
    """

    frequency: float
    damping: float
    mass: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.frequency) and self.frequency > 0.0):
            raise SignalError(f"mode: frequency must be a positive number of Hz, got {self.frequency!r}")
        if not 0.0 < self.damping < 1.0:
            raise SignalError(f"mode: damping must lie between 0 and 1 of critical, got {self.damping!r}")
        if not (math.isfinite(self.mass) and self.mass != 0.0):
            raise SignalError(f"mode: mass must be a number of kg other than 0, got {self.mass!r}")


@dataclass(frozen=True)
class ModalPath:
    """A transfer path as a sum of modes; accelerance sum_r -w^2 / (m_r (w_r^2 - w^2 + 2 i d_r w_r w)) in (m/s^2)/N."""

    modes: tuple[Mode, ...]

    def accelerance(self, frequency: np.ndarray) -> np.ndarray:
        """Acceleration per force at the frequencies (Hz), complex."""
        w = 2.0 * np.pi * np.asarray(frequency, dtype=float)
        total = np.zeros(w.shape, dtype=complex)
        for mode in self.modes:
            w0 = 2.0 * np.pi * mode.frequency
            total += -(w**2) / (mode.mass * (w0**2 - w**2 + 2j * mode.damping * w0 * w))
        return total

    @property
    def settling(self) -> float:
        """Seconds after which what happened before has decayed by e^-10."""
        return max(DECAY_TIMES / (2.0 * np.pi * m.frequency * m.damping) for m in self.modes)


@dataclass(frozen=True)
class FrfPath:
    """A transfer path given by a measured accelerance; straight lines between its points, nothing outside its range.

    Attributes
    ----------
    frequency : ndarray of shape (m,), increasing, Hz
    values : ndarray of shape (m,), complex, (m/s^2)/N
    settling : float
        Length of the impulse response in s; at most 1 / the spacing of the frequencies.
    """

    frequency: np.ndarray
    values: np.ndarray
    settling: float

    def __post_init__(self) -> None:
        f, v = np.asarray(self.frequency, dtype=float), np.asarray(self.values)
        if f.ndim != 1 or f.shape != v.shape or f.size < 2 or np.any(np.diff(f) <= 0.0):
            raise SignalError("path: needs as many values as frequencies, at least two, the frequencies increasing")
        if not (np.all(np.isfinite(f)) and np.all(np.isfinite(v)) and self.settling >= 0.0):
            raise SignalError("path: frequencies, values and settling must be finite, settling not negative")

    def accelerance(self, frequency: np.ndarray) -> np.ndarray:
        """Acceleration per force at the frequencies (Hz), complex."""
        f = np.asarray(frequency, dtype=float)
        v = np.asarray(self.values, dtype=complex)
        real = np.interp(f, self.frequency, v.real, left=0.0, right=0.0)
        return real + 1j * np.interp(f, self.frequency, v.imag, left=0.0, right=0.0)


def laser_vibrometer(
    velocity: xr.DataArray,
    direction: Sequence[float],
    *,
    angular_velocity: xr.DataArray | None = None,
    spot: Sequence[float] = (0.0, 0.0, 0.0),
    channels: Sequence[str] = XYZ,
    name: str = "laser",
) -> xr.DataArray:
    """Velocity along a laser's line of the shaft's surface under its spot, (v + w x r) . d.

    The spot stays where it is in space while the shaft turns beneath it. Aimed at the axis (r parallel to d up to a
    part along w), the spin itself does not show.

    Parameters
    ----------
    velocity : xarray.DataArray
        Velocity of a point of the shaft in m/s, three Cartesian channels.
    direction : sequence of 3 floats
        Direction d of positive velocity; need not be of unit length.
    angular_velocity : xarray.DataArray, optional
        Angular velocity w of the shaft in rad/s, same channels and time.
    spot : sequence of 3 floats
        Position r of the spot from that point, in m.
    channels : sequence of 3 str
        Names of the Cartesian channels.
    name : str
        Name of the result's channel.

    Returns
    -------
    xarray.DataArray
        One channel in m/s.
    """
    d = _direction(direction)
    v = _vector(velocity, channels, "velocity")
    r = np.asarray(spot, dtype=float)
    if r.shape != (3,) or not np.all(np.isfinite(r)):
        raise SignalError(f"spot: must be three finite numbers in m, got {spot!r}")
    if angular_velocity is not None:
        w = _vector(angular_velocity, channels, "angular_velocity")
        if w.shape != v.shape or abs(rate_of(angular_velocity) - rate_of(velocity)) > 1e-9 * rate_of(velocity):
            raise SignalError("angular_velocity: must have the samples and the rate of velocity")
        v = v + np.cross(w, r)
    return _one(velocity, v @ d, name, "m/s")


def joint_force(
    force: xr.DataArray, direction: Sequence[float], *, channels: Sequence[str] = XYZ, name: str = "force"
) -> xr.DataArray:
    """Component of a joint's force (N, three Cartesian channels) along a direction, as one channel."""
    return _one(force, _vector(force, channels, "force") @ _direction(direction), name, "N")


def accelerometer(
    force: xr.DataArray,
    path: ModalPath | FrfPath,
    *,
    settle: Literal["trim", "keep"] = "trim",
    name: str | None = None,
) -> xr.DataArray:
    """Acceleration at a bearing support, the force (N) through a transfer path.

    The force's spectrum times the path's accelerance, the record padded with the path's settling time so that nothing
    wraps around. The mean force, which accelerates nothing, is taken out first; before the record the force is taken
    as its mean, so the first settling time shows the path's transient.

    Parameters
    ----------
    force : xarray.DataArray
        In N, dimensions (time, channel); every channel goes through the same path.
    path : ModalPath or FrfPath
    settle : {"trim", "keep"}
        Drop the first settling time, or keep it.
    name : str, optional
        New channel name, for a single channel.

    Returns
    -------
    xarray.DataArray
        In m/s^2.
    """
    if common_unit(force) != "N":
        raise SignalError(f"force: every channel must be in N, got {common_unit(force)!r}")
    if settle not in ("trim", "keep"):
        raise SignalError(f"settle: must be 'trim' or 'keep', got {settle!r}")
    rate = rate_of(force)
    n = force.sizes["time"]
    lead = math.ceil(path.settling * rate)
    if settle == "trim" and lead >= n:
        raise SignalError(f"signal: {n / rate:g} s are shorter than the path's settling time of {path.settling:g} s")
    length = scipy.fft.next_fast_len(n + lead, real=True)
    gain = path.accelerance(scipy.fft.rfftfreq(length, 1.0 / rate))
    if length % 2 == 0:
        gain[-1] = gain[-1].real
    columns = [scipy.fft.irfft(scipy.fft.rfft(c - c.mean(), length) * gain, length)[:n] for c in force.values.T]
    first = lead if settle == "trim" else 0
    result = like(force, np.stack(columns, axis=1)[first:], t0=float(force["time"].values[first]), units="m/s^2")
    if name is not None:
        if result.sizes["channel"] != 1:
            raise SignalError(f"name: {name!r} names one channel, the force has {result.sizes['channel']}")
        result = result.assign_coords(channel=np.asarray([name], dtype=str))
    return result


def sample(signal: xr.DataArray, rate: float) -> xr.DataArray:
    """Sample at `rate` Hz behind an anti-alias filter: `decimate` where the rates divide, `resample` elsewhere."""
    old, new = rate_of(signal), check_rate(rate)
    if new > old:
        raise SignalError(f"rate: {new:g} Hz is above the signal's own {old:g} Hz; simulate with finer output")
    ratio = old / new
    return decimate(signal, new) if abs(ratio - round(ratio)) < 1e-9 * ratio else resample(signal, new)


def add_noise(
    signal: xr.DataArray, *, seed: int, rms: float | None = None, density: float | None = None
) -> xr.DataArray:
    """Add white Gaussian noise, the same for the same seed.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    seed : int
        Of the random generator.
    rms, density : float
        One of them: RMS in the signal's unit, or amplitude density in unit / sqrt(Hz) up to half the sampling rate.
    """
    if (rms is None) == (density is None):
        raise SignalError("noise: give one of rms and density")
    level = float(rms) if rms is not None else float(density or 0.0) * math.sqrt(rate_of(signal) / 2.0)
    if not (math.isfinite(level) and level >= 0.0):
        raise SignalError(f"noise: must not be negative, got {rms if rms is not None else density!r}")
    noise = np.random.default_rng(seed).standard_normal(signal.shape)
    return like(signal, signal.values + level * noise, noise_seed=int(seed))


def quantise(signal: xr.DataArray, *, bits: int, full_scale: float) -> xr.DataArray:
    """Round to the steps of a converter and clip at its range.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    bits : int
        2 to 32; the step is 2 full_scale / 2^bits.
    full_scale : float
        Range -full_scale to +full_scale less one step, in the signal's unit.

    Returns
    -------
    xarray.DataArray
        Attribute `clipped` counts the samples outside the range.
    """
    if isinstance(bits, bool) or not 2 <= bits <= 32:
        raise SignalError(f"bits: must lie between 2 and 32, got {bits!r}")
    if isinstance(full_scale, bool) or not (math.isfinite(full_scale) and full_scale > 0.0):
        raise SignalError(f"full_scale: must be positive, got {full_scale!r}")
    step = 2.0 * full_scale / 2.0**bits
    counts = np.rint(signal.values / step)
    low, high = -(2.0 ** (bits - 1)), 2.0 ** (bits - 1) - 1.0
    clipped = int(np.count_nonzero((counts < low) | (counts > high)))
    return like(signal, np.clip(counts, low, high) * step, bits=int(bits), clipped=clipped)


def drop_outs(
    signal: xr.DataArray, *, per_second: float, longest: float = 1e-3, full_scale: float, seed: int
) -> xr.DataArray:
    """Lose a laser's signal now and then, where speckles are dark: to the range, to a spike, or to a value held.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), sampled.
    per_second : float
        How often, on average; at random times.
    longest : float
        Longest, s; lengths are even between one sample and this.
    full_scale : float
        Range, in the signal's unit.
    seed : int

    Returns
    -------
    xarray.DataArray
        Attribute ``lost_truly``: the samples that were lost.
    """
    rng, rate, values = np.random.default_rng(seed), rate_of(signal), signal.values.copy()
    n = values.shape[0]
    lost = np.zeros(n, dtype=bool)
    for start in np.sort(rng.integers(1, n - 1, rng.poisson(per_second * n / rate))):
        stop = min(n, start + 1 + int(rng.integers(0, max(1, round(longest * rate)))))
        sign, kind = rng.choice([-1.0, 1.0]), rng.integers(3)
        ends = (sign * full_scale, sign * full_scale * rng.uniform(0.3, 0.9, (stop - start, 1)), values[start - 1])
        values[start:stop] = ends[kind]
        lost[start:stop] = True
    return like(signal, values, lost_truly=np.flatnonzero(lost).tolist())


def speckle(
    signal: xr.DataArray, angle: xr.DataArray, *, rms: float, seed: int, recurring: float = 1.0, orders: int = 200
) -> xr.DataArray:
    """Add a laser's pseudo-vibration: speckles that pass the beam again with each turn of the shaft.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    angle : xarray.DataArray
        Of the shaft, rad, at the signal's times.
    rms : float
        In the signal's unit.
    seed : int
    recurring : float
        Share of the power that recurs with each turn; the rest, from speckles that move sideways, is noise.
    orders : int
        Orders of the shaft over which it is even.
    """
    rng = np.random.default_rng(seed)
    turned = np.asarray(angle.values, dtype=float)
    if turned.shape != (signal.sizes["time"],):
        raise SignalError(f"angle: has the shape {turned.shape}, the signal {signal.sizes['time']} samples")
    pattern = np.zeros(turned.size)
    for k in range(1, orders + 1):
        pattern += rng.standard_normal() * np.cos(k * turned) + rng.standard_normal() * np.sin(k * turned)
    pattern *= rms * math.sqrt(recurring / orders)
    noise = rms * math.sqrt(1.0 - recurring) * rng.standard_normal(signal.shape)
    return like(signal, signal.values + pattern[:, None] + noise)


def camera(
    displacement: xr.DataArray, rate: float, *, scale: float, noise: float = 0.0, exposure: float = 0.5, seed: int = 0
) -> xr.DataArray:
    """Track of a point by a camera, in pixels: the mean over each exposure, with the noise of the tracking.

    Parameters
    ----------
    displacement : xarray.DataArray
        m, dimensions (time, channel).
    rate : float
        Frames a second. There is no filter but the exposure: faster motion is folded down.
    scale : float
        Length of a pixel, m.
    noise : float
        RMS, pixels.
    exposure : float
        Share of the time between frames.
    seed : int
    """
    own = rate_of(displacement)
    if not 0.0 < check_rate(rate) <= own or not 0.0 < exposure <= 1.0:
        raise SignalError(f"rate, exposure: must be positive, up to {own:g} Hz and 1, got {rate!r} and {exposure!r}")
    n = displacement.sizes["time"]
    sums = np.concatenate((np.zeros((1, displacement.sizes["channel"])), np.cumsum(displacement.values, axis=0)))
    open_at = np.arange(0.0, n - exposure * own / rate, own / rate)
    at = np.arange(n + 1)
    seen = np.stack(
        [np.interp(open_at + exposure * own / rate, at, s) - np.interp(open_at, at, s) for s in sums.T], axis=1
    ) / (exposure * own / rate)
    pixels = seen / scale + noise * np.random.default_rng(seed).standard_normal(seen.shape)
    t0 = float(displacement["time"].values[0]) + 0.5 * exposure / rate
    return like(displacement, pixels, t0=t0, rate=rate, units="pixel")


def measure(
    signal: xr.DataArray,
    *,
    rate: float = 12800.0,
    noise_rms: float = 0.0,
    bits: int | None = None,
    full_scale: float | None = None,
    seed: int = 0,
) -> xr.DataArray:
    """The measuring chain: noise of the sensor, anti-alias filter and sampling, quantisation.

    Parameters
    ----------
    signal : xarray.DataArray
        What the sensor sees.
    rate : float
        Sampling rate in Hz; default the paper's.
    noise_rms : float
        RMS of the noise in the sampled record, in the signal's unit.
    bits, full_scale : optional
        The converter (`quantise`); both or neither. `full_scale` in the signal's unit.
    seed : int
        Of the noise.
    """
    result = sample(signal, rate)
    if noise_rms:
        result = add_noise(result, seed=seed, rms=noise_rms)
    if (bits is None) != (full_scale is None):
        raise SignalError("bits, full_scale: give both or neither")
    if bits is not None and full_scale is not None:
        result = quantise(result, bits=bits, full_scale=full_scale)
    return result


def _vector(signal: xr.DataArray, channels: Sequence[str], what: str) -> np.ndarray:
    names = [str(c) for c in signal["channel"].values]
    if len(channels) != 3 or any(c not in names for c in channels):
        raise SignalError(f"{what}: needs the Cartesian channels {list(channels)}, has {names}")
    return signal.values[:, [names.index(c) for c in channels]]


def _direction(direction: Sequence[float]) -> np.ndarray:
    d = np.asarray(direction, dtype=float)
    length = float(np.linalg.norm(d)) if d.shape == (3,) else 0.0
    if not (math.isfinite(length) and length > 0.0):
        raise SignalError(f"direction: must be a vector of three numbers other than zero, got {direction!r}")
    return d / length


def _one(source: xr.DataArray, column: np.ndarray, name: str, unit: str) -> xr.DataArray:
    return like(source, column[:, None], channels=[name], units=unit)
