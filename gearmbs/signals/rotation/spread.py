"""Mesh lines that a speed over time does not hold together, as one that is late, drifts or has an offset."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

NEAR, END = 0.35, 0.5
"""Orders beside the mesh within which its line may be spread, and where a filter ends: sidebands of the shaft itself
are a whole one away."""
HELD = 0.5
"""Part of the power near the line that stands in it, below which it counts as lost: 3 dB."""
STEADY = 0.9
"""Square of the mean amplitude by the mean square from which what is near the line is one line whose phase wanders: 1
of such a line, 0.81 of two equal ones that beat, pi/4 of noise."""


def remark_spread(over: xr.DataArray, speed: float, teeth: int, origin: str) -> list[str]:
    """Say so where the mesh is a line whose phase wanders by the angle that is taken.

    Parameters
    ----------
    over : xarray.DataArray
        The record over that angle, as if the shaft turned at its mean speed.
    speed : float
        The mean one, rad/s.
    origin : str
        Where the speed is from.
    """
    rate = 1.0 / float(over["time"].values[1] - over["time"].values[0])
    frequencies = np.fft.fftfreq(over.sizes["time"], 1.0 / rate)
    orders = frequencies * (math.tau / speed) - teeth
    taper = np.cos(0.5 * math.pi * np.clip((np.abs(orders) - NEAR) / (END - NEAR), 0.0, 1.0)) ** 2
    turning = np.exp(-1j * teeth * speed / rate * np.arange(over.sizes["time"]))
    shares, steadiness = [], []
    for x in over.values.T:
        near = np.fft.ifft(np.fft.fft(x) * taper) * turning
        power = float(np.mean(np.abs(near) ** 2))
        if power > 0.0:
            shares.append(float(abs(near.mean()) ** 2) / power)
            steadiness.append(float(np.abs(near).mean() ** 2) / power)
    if not shares:
        return []
    clearest = int(np.argmax(steadiness))
    if steadiness[clearest] < STEADY or shares[clearest] > HELD:
        return []
    return [
        f"CHECK THE SPEED: {100.0 * math.sqrt(shares[clearest]):.0f} % of the mesh line stands at its order, the rest "
        f"is spread beside it: by the speed {origin} its phase wanders, as by one that is late, drifts or has an "
        "offset. Averages, orders and sidebands lose the rest; a tacho, or the record without this speed, may not."
    ]
