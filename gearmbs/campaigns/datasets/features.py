"""Features of vibration windows that any record offers: classical indicators, and the spectrum about the mesh
harmonics."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

HARMONICS = 4
SIDEBANDS = 3
NAMES = (
    "kurtosis",
    "crest",
    "skewness",
    *(f"mesh_{k}" for k in range(1, HARMONICS + 1)),
    *(f"sidebands_{k}" for k in range(1, HARMONICS + 1)),
    "residual_kurtosis",
    "residual_share",
    "envelope_shaft",
    "envelope_shaft_2",
    "tilt",
)
"""Names of the features, none of which changes with the gain of the sensor."""


def features(x: np.ndarray, rate: float, shaft: float, teeth: int) -> np.ndarray:
    """Return the features of a window, shape (len(NAMES),); none depends on the sensor's gain.

    Parameters
    ----------
    x : ndarray, shape (n,)
    rate : float
        Hz.
    shaft : float
        Frequency of the shaft that carries the wheel, Hz.
    teeth : int
    """
    x = np.asarray(x, dtype=float) - np.mean(x)
    rms = float(np.sqrt(np.mean(x**2))) or 1.0
    x = x / rms
    window = np.hanning(x.size)
    power = np.abs(np.fft.rfft(x * window)) ** 2
    frequency = np.fft.rfftfreq(x.size, 1.0 / rate)
    whole = float(power.sum())
    width = 2.5 * rate / x.size

    def band(f: float) -> float:
        return float(power[np.abs(frequency - f) <= width].sum()) / whole

    mesh = [band(k * teeth * shaft) for k in range(1, HARMONICS + 1)]
    sides = [
        sum(band((k * teeth + s * m) * shaft) for m in range(1, SIDEBANDS + 1) for s in (-1, 1))
        for k in range(1, HARMONICS + 1)
    ]
    spectrum = np.fft.rfft(x)
    for k in range(1, int(0.5 * rate / (teeth * shaft)) + 1):
        spectrum[np.abs(frequency - k * teeth * shaft) <= width] = 0.0
    rest = np.fft.irfft(spectrum, x.size)
    share = float(np.mean(rest**2))
    envelope = np.abs(_analytic(rest))
    lines = np.abs(np.fft.rfft((envelope - envelope.mean()) * window))
    total = float(np.sum(lines[frequency < 20.0 * shaft])) or 1.0

    def line(f: float) -> float:
        return float(lines[np.abs(frequency - f) <= width].sum()) / total

    tiny = 1e-12
    return np.array(
        [
            np.log(np.mean(x**4)),
            np.log(np.abs(x).max()),
            float(np.mean(x**3)),
            *np.log(np.array(mesh) + tiny),
            *np.log(np.array(sides) + tiny),
            np.log(float(np.mean(rest**4)) / max(share, tiny) ** 2),
            np.log(share + tiny),
            line(shaft),
            line(2.0 * shaft),
            float(np.sum(frequency * power) / whole / (0.5 * rate)),
        ]
    )


def _analytic(x: np.ndarray) -> np.ndarray:
    spectrum = np.fft.fft(x)
    spectrum[1 : (x.size + 1) // 2] *= 2.0
    spectrum[x.size // 2 + 1 :] = 0.0
    return np.fft.ifft(spectrum)


def windows(x: np.ndarray, size: int) -> np.ndarray:
    """Return the whole windows of signals along the last axis side by side, shape (..., k, size)."""
    count = x.shape[-1] // size
    return x[..., : count * size].reshape(*x.shape[:-1], count, size)


def recording_features(signal: xr.DataArray, *, shaft: float, teeth: int, window: float = 0.25) -> np.ndarray:
    """Return the features of all windows of all channels of a recording, shape (windows, len(NAMES)).

    Parameters
    ----------
    signal : DataArray
        Dimensions (time, channel), with its sampling rate; see `gearmbs.signals.read_signal`.
    shaft : float
        Frequency of the shaft that carries the wheel, Hz.
    teeth : int
    window : float
        s.
    """
    from gearmbs.signals import rate_of

    rate = rate_of(signal)
    size = int(window * rate)
    parts = windows(signal.transpose("channel", "time").values, size).reshape(-1, size)
    return np.array([features(part, rate, shaft, teeth) for part in parts])
