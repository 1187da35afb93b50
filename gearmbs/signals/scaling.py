"""Scaling simulated signals to a measured RMS, one factor for the healthy case and its faults (section 4)."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

from .errors import SignalError
from .signal import like


def remove_mean(signal: xr.DataArray) -> xr.DataArray:
    """The signal less each channel's mean over the record."""
    return like(signal, signal.values - signal.values.mean(axis=0))


def dynamic_rms(signal: xr.DataArray) -> xr.DataArray:
    """RMS of each channel with its mean removed, dimension (channel,)."""
    return xr.DataArray(
        signal.values.std(axis=0),
        dims=("channel",),
        coords={"channel": signal["channel"].values},
        attrs={"long_name": "RMS"},
    )


def rms_factor(signal: xr.DataArray, target: float, channel: str | None = None) -> float:
    """Factor that brings the mean-free RMS of one channel to `target`.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    target : float
        Wanted RMS, in the units of the result.
    channel : str, optional
        Which channel; may be left out if there is only one.

    Raises
    ------
    SignalError
        If the target is not positive, the channel is not named or unknown, or the channel does not vary.
    """
    if not (math.isfinite(target) and target > 0.0):
        raise SignalError(f"target: must be a positive RMS, got {target!r}")
    names = [str(c) for c in signal["channel"].values]
    if channel is None and len(names) > 1:
        raise SignalError(f"channel: name the one whose RMS counts, of {names}")
    if channel is not None and channel not in names:
        raise SignalError(f"channel: there is no {channel!r}, only {names}")
    values = signal.values[:, names.index(channel) if channel is not None else 0]
    level = float(values.std())
    if level <= 1e-14 * float(np.abs(values).max(initial=0.0)):
        raise SignalError(f"signal: channel {channel or names[0]!r} does not vary, it cannot be scaled to an RMS")
    return target / level


def scale(signal: xr.DataArray, factor: float) -> xr.DataArray:
    """The mean-free signal times `factor`; the factor is noted in the attributes."""
    return like(signal, factor * (signal.values - signal.values.mean(axis=0)), scale_factor=float(factor))


def scale_states(
    states: Mapping[str, xr.DataArray], target: float, *, reference: str = "healthy", channel: str | None = None
) -> dict[str, xr.DataArray]:
    """Scale the reference state to a target RMS and every other state by the same factor.

    Parameters
    ----------
    states : mapping of name to xarray.DataArray
        Signals of the healthy pair and of the faults.
    target : float
        RMS the reference shall have, mean removed.
    reference : str
        The state whose factor is kept.
    channel : str, optional
        Channel whose RMS counts.

    Returns
    -------
    dict of name to xarray.DataArray
        Mean-free, all multiplied by the same factor (attribute `scale_factor`).

    Raises
    ------
    SignalError
        If the reference is not among the states, or see `rms_factor`.
    """
    if reference not in states:
        raise SignalError(f"reference: there is no state {reference!r}, only {list(states)}")
    factor = rms_factor(states[reference], target, channel)
    return {name: scale(signal, factor) for name, signal in states.items()}
