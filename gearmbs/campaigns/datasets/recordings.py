"""What real recordings tell: the spectrum and the level of what does not repeat, and the path to the sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import solve_toeplitz

from gearmbs.campaigns.datasets.layers import STOP, Noise
from gearmbs.campaigns.settings import CampaignError
from gearmbs.signals import ModalPath, Mode, discrete_random, rate_of

if TYPE_CHECKING:
    import xarray as xr

LINES = 64
"""Bands of the identified density: wider than lines and their sidebands, narrower than resonances of a housing."""

SEGMENT = 2048
"""Samples of a periodogram."""

MEMORY = 64
"""Order of the prediction whose poles are the modes: twice as many as a structure shows, the rest takes the noise."""

DAMPED = 0.3
"""Damping ratio above which a pole is the spectrum's slope and no mode."""


def identify_noise(signal: xr.DataArray) -> tuple[Noise, ...]:
    """Return the noise of each channel of a recording.

    The recording is parted into what can be predicted and what cannot, see `gearmbs.signals.discrete_random`; the
    second is noise of the sensor and random vibration of the machine, with its resonances.

    Parameters
    ----------
    signal : DataArray
        Dimensions (time, channel), with its sampling rate. Give recordings of one state only, or of all equally: what
        is taken from them reaches every state of a data set.
    """
    repeating, random = discrete_random(signal)
    rate, window = rate_of(signal), np.hanning(SEGMENT)
    edges = np.linspace(0.0, 0.5, LINES + 1)
    middle = np.r_[0.0, 0.5 * (edges[1:] + edges[:-1]), 0.5]
    frequency = np.fft.rfftfreq(SEGMENT)
    band = np.clip(np.digitize(frequency, edges) - 1, 0, LINES - 1)
    found = []
    for c in range(signal.sizes["channel"]):
        x = random.values[:, c] - random.values[:, c].mean()
        pieces = np.lib.stride_tricks.sliding_window_view(x, SEGMENT)[:: SEGMENT // 2]
        power = np.mean(np.abs(np.fft.rfft(pieces * window, axis=1)) ** 2, axis=0)
        density = np.sqrt(np.bincount(band, power, LINES) / np.bincount(band, minlength=LINES) / rate)
        density = np.r_[density[0], density, density[-1]]
        level = float(np.std(x) / np.std(repeating.values[:, c]))
        found.append(Noise(tuple(map(float, middle)), tuple(map(float, density)), level))
    return tuple(found)


def identify_path(signal: xr.DataArray, modes: int = 6) -> tuple[ModalPath, ...]:
    """Return the transfer path to each channel of a recording, by the resonances of what does not repeat.

    Random vibration of a machine, of rolling and sliding, is taken for white where it arises: then linear prediction of
    what arrives has the poles of the structure and of the sensor's mounting [1]_. Frequencies, dampings and heights of
    the peaks are known by this, but neither the gain nor whether two modes move with or against each other: all are
    taken for with.

    Parameters
    ----------
    signal : DataArray
        Dimensions (time, channel), with its sampling rate, of one state only, or of all equally.
    modes : int
        The strongest so many.

    Raises
    ------
    CampaignError
        If a channel stands still.

    References
    ----------
    .. [1] J. Makhoul, Linear prediction: a tutorial review, Proc. IEEE 63, 1975.
    """
    still = [str(name) for name, x in zip(signal["channel"].values, signal.values.T) if not np.std(x) > 0.0]
    if still:
        raise CampaignError(f"recording: {', '.join(still)} stands still; give one of a machine that runs")
    _, random = discrete_random(signal)
    rate, found = rate_of(signal), []
    for c in range(signal.sizes["channel"]):
        x = random.values[:, c] - random.values[:, c].mean()
        likeness = np.fft.irfft(np.abs(np.fft.rfft(x, 2 * x.size)) ** 2)[: MEMORY + 1]
        taps = np.r_[1.0, -solve_toeplitz(likeness[:-1], likeness[1:])]
        roots = np.roots(taps).astype(complex)
        # of 1/A the parts that belong to the poles, by their peaks
        size = np.abs(roots ** (MEMORY - 1) / np.polyval(np.polyder(taps), roots)) / (1.0 - np.abs(roots))
        poles = np.log(roots) * rate
        shown = (poles.imag > 0.0) & (-poles.real < DAMPED * np.abs(poles)) & (poles.imag < 2.0 * np.pi * STOP * rate)
        poles = poles[shown][np.argsort(-size[shown])[:modes]]
        found.append(ModalPath(tuple(_mode(p, taps, rate) for p in poles)))
    return tuple(found)


def _mode(pole: complex, taps: np.ndarray, rate: float) -> Mode:
    """Return the mode of a pole, rad/s, whose peak is that of the prediction's spectrum there."""
    frequency, damping = float(abs(pole)) / (2.0 * np.pi), float(-pole.real / abs(pole))
    peak = 1.0 / abs(np.exp(-2j * np.pi * frequency / rate * np.arange(taps.size)) @ taps)
    return Mode(frequency, damping, 1.0 / (2.0 * damping * float(peak)))
