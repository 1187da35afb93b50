"""What lines of a record say against its sampling rate, or the teeth: told wrongly, these move all by one factor."""

from __future__ import annotations

import math

import xarray as xr

from gearmbs.signals.signal.signal import rate_of

MULTIPLES = (0.5, 2.0, 0.25, 4.0, 0.1, 10.0)
MIXED = (44.1 / 48.0, 48.0 / 44.1, 48.0 / 51.2, 51.2 / 48.0, 50.0 / 51.2, 51.2 / 50.0, *MULTIPLES)
"""Told rates by true ones: of sound cards, of vibration and of plain numbers, of channels that were decimated."""
CLOCKS = (44100.0, 48000.0, 50000.0, 51200.0)
"""Hz, of converters; other usual rates are these halved or doubled a few times."""
EXACT = 1e-6
"""Octaves by which a rate may be off these: headers round to so many digits."""
ALIKE = 0.01
"""Share by which a ratio may be off, as told speeds are; two of these are 2 % apart at least."""
MISCOUNTED = 2
"""Teeth by which a wheel is counted wrongly, at most: more, and another wheel is meant."""
PART_OF_TOOTH = 0.15
"""How far from a whole number the teeth may come out: of 20 teeth as speeds told off by 0.7 % make them."""


def other_teeth(ratio: float, count: int) -> str:
    """Return which count of teeth, one or two off, would explain that the mesh stands at some times its frequency.

    Parameters
    ----------
    ratio : float
        Mesh frequency in the record by that expected.
    count : int
        Told teeth.
    """
    teeth = round(ratio * count)
    if teeth == count or abs(teeth - count) > MISCOUNTED or abs(ratio * count - teeth) > PART_OF_TOOTH:
        return ""
    return f" A wheel of {teeth} teeth, told as {count}, would make it so at the given speed: count them (--teeth)."


def other_rate(signal: xr.DataArray, ratio: float) -> str:
    """Return which sampling rate would explain that lines stand at some times their frequency; empty if none does.

    Parameters
    ----------
    signal : xarray.DataArray
    ratio : float
        Frequencies in the record by those expected.
    """
    near = min(MIXED, key=lambda mixed: abs(ratio / mixed - 1.0))
    if abs(ratio / near - 1.0) > ALIKE:
        return ""
    rate = rate_of(signal)
    octaves = [math.log2(rate / near / clock) for clock in CLOCKS]
    if near not in MULTIPLES and min(abs(octave - round(octave)) for octave in octaves) > EXACT:
        return ""
    return f" A sampling rate of {rate / near:.6g} Hz, told as {rate:g} Hz, would make it so, too: look it up (--rate)."
