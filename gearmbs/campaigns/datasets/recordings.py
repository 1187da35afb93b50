"""What real recordings tell of sensors: the spectrum and the level of what does not repeat with the shafts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.campaigns.datasets.layers import Noise
from gearmbs.signals import discrete_random, rate_of

if TYPE_CHECKING:
    import xarray as xr

LINES = 64
"""Bands of the identified density: wider than lines and their sidebands, narrower than resonances of a housing."""

SEGMENT = 2048
"""Samples of a periodogram."""


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
