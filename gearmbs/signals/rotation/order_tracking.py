"""Orders of a shaft whose speed changes: their amplitudes along a run-up, and maps of all orders over time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any, Literal, Unpack

import numpy as np
import scipy.fft
import scipy.signal as ss
import xarray as xr

from gearmbs.progress import waiting
from gearmbs.signals.errors import SignalError
from gearmbs.signals.rotation.angular import angular_resample
from gearmbs.signals.rotation.keywords import ShaftAndDataKeywords
from gearmbs.signals.rotation.shaft import shaft_phase
from gearmbs.signals.signal.arguments import takes_data
from gearmbs.signals.signal.signal import common_unit, rate_of
from gearmbs.signals.spectra import SCALINGS, spectral_unit

TURN = 2.0 * math.pi
KEPT = 0.4
"""Orders up to this part of the samples a revolution are kept without loss."""
LEAST_TURNS = 4.0
"""Revolutions of a window at least: a Hann window tells lines two of its own apart, half an order here."""


class OrderTrackKeywords(ShaftAndDataKeywords, total=False):
    """Keywords of `order_track`, for type checkers."""

    speed: Any
    orders: Sequence[float] | float
    revolutions: float | None
    overlap: float
    scaling: Literal["amplitude", "rms"]


class OrderMapKeywords(ShaftAndDataKeywords, total=False):
    """Keywords of `order_map` but for the highest order, for type checkers."""

    speed: Any
    revolutions: float | None
    overlap: float
    scaling: Literal["amplitude", "rms", "power", "density"]
    window: str | tuple


@takes_data()
def order_track(
    signal: Any,
    speed: Any = None,
    orders: Sequence[float] | float = (1.0,),
    *,
    revolutions: float | None = None,
    overlap: float = 0.75,
    scaling: Literal["amplitude", "rms"] = "amplitude",
    **shaft: Unpack[ShaftAndDataKeywords],
) -> xr.DataArray:
    """Amplitudes of orders over time: the record resampled to steps of angle, and transformed in windows of angle.

    With the shaft's angle theta in revolutions and a Hann window w of `revolutions` turns around theta_c,

        c_k(theta_c) = 2 / sum w  sum_n w_n x(theta_n) exp(-2 pi i k theta_n)

    An order stays one line whatever the speed does; what a window of R revolutions cannot part are orders closer than
    2 / R. Through standstill the windows go on in angle, so that a rest costs nothing.

    Parameters
    ----------
    signal : xarray.DataArray
        Measured or simulated, dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``,
        ``units``, ``channels`` and ``gaps`` as there.
    speed : optional
        Speed of the shaft in any shape that `speed_curve` reads; default what the signal knows of it.
    orders : float or sequence of float
        Multiples of the shaft's frequency; need not be whole.
    revolutions : float, optional
        Length of the window; default 4, or what parts the given orders from each other and from zero.
    overlap : float
        Fraction of overlap of successive windows, 0 <= overlap < 1.
    scaling : {"amplitude", "rms"}
    **shaft
        Instead of `speed`: `phase`, `tacho` with `pulses_per_rev`, or `speed_channel`; see `shaft_phase`.

    Returns
    -------
    xarray.DataArray
        Dimensions (time, order, channel), in the signal's units; coordinates `time` (s) and `angle` (revolutions) of
        the middle of each window, `speed` (rad/s) there.

    Raises
    ------
    MissingMetadataError
        If no speed is known.
    SignalError
        If the record holds fewer revolutions than a window, or an order lies beyond half the sampling rate throughout.
    """
    if isinstance(speed, Sequence) and not isinstance(speed, str) and all(isinstance(v, Real) for v in speed):
        raise SignalError(f"speed: {speed} are plain numbers; orders are given by name, orders={list(speed)}")
    wanted = np.atleast_1d(np.asarray(orders, dtype=float))
    if wanted.ndim != 1 or not wanted.size or not (np.isfinite(wanted).all() and wanted.min() > 0.0):
        raise SignalError(f"orders: must be positive numbers, got {orders!r}")
    if scaling not in ("amplitude", "rms"):
        raise SignalError(f"scaling: must be 'amplitude' or 'rms', got {scaling!r}")
    if revolutions is None:
        gaps = np.diff(np.concatenate(([0.0], np.sort(wanted))))
        gaps = gaps[gaps > 1e-9]
        revolutions = max(LEAST_TURNS, 2.0 / float(gaps.min())) if gaps.size else LEAST_TURNS
    with waiting("tracking orders") as tell:
        windows = _Windows(signal, speed, revolutions, overlap, float(wanted.max()), shaft)
        out = np.empty((windows.starts.size, wanted.size, windows.angular.sizes["channel"]))
        turns = windows.angular["angle"].values
        for k, order in enumerate(wanted):
            carried = np.exp(-2j * np.pi * order * turns)[:, None] * windows.angular.values
            for i, start in enumerate(windows.starts):
                piece = windows.weights @ carried[start : start + windows.length]
                out[i, k] = 2.0 * np.abs(piece) / windows.weights.sum()
            tell((k + 1) / wanted.size)
    if scaling == "rms":
        out /= math.sqrt(2.0)
    return windows.labelled(out, "order", wanted, scaling)


@takes_data()
def order_map(
    signal: Any,
    speed: Any = None,
    *,
    revolutions: float | None = None,
    overlap: float = 0.75,
    maximum: float | None = None,
    scaling: Literal["amplitude", "rms", "power", "density"] = "amplitude",
    window: str | tuple = "hann",
    **shaft: Unpack[ShaftAndDataKeywords],
) -> xr.DataArray:
    """Order spectra along a record of changing speed: what turns with the shaft stays in its column.

    Parameters
    ----------
    signal, speed, overlap, **shaft
        As for `order_track`.
    revolutions : float, optional
        Length of a window: its lines lie 1 / revolutions apart. Default: a twentieth of the record, 4 to 64.
    maximum : float, optional
        Highest order; default as far as the record holds it at its highest speed.
    scaling, window
        As for `spectrum`; "density" is per order.

    Returns
    -------
    xarray.DataArray
        Dimensions (time, order, channel); coordinates as of `order_track`.

    Raises
    ------
    MissingMetadataError, SignalError
        As `order_track`.
    """
    if scaling not in SCALINGS:
        raise SignalError(f"scaling: must be one of {', '.join(SCALINGS)}, got {scaling!r}")
    with waiting("order map") as tell:
        windows = _Windows(signal, speed, revolutions, overlap, maximum, shaft, window)
        power = np.empty((windows.starts.size, windows.length // 2 + 1, windows.angular.sizes["channel"]))
        for i, start in enumerate(windows.starts):
            piece = windows.angular.values[start : start + windows.length]
            line = scipy.fft.rfft((piece - piece.mean(axis=0)) * windows.weights[:, None], axis=0)
            power[i] = line.real**2 + line.imag**2
            tell((i + 1) / windows.starts.size)
    power[:, 1 : (-1 if windows.length % 2 == 0 else None)] *= 2.0
    if scaling == "density":
        values = power / (windows.per_rev * (windows.weights**2).sum())
    else:
        values = power / windows.weights.sum() ** 2
        if scaling in ("amplitude", "rms"):
            values = np.sqrt(values * (2.0 if scaling == "amplitude" else 1.0))
    orders = scipy.fft.rfftfreq(windows.length, 1.0 / windows.per_rev)
    shown = orders <= windows.top + 1e-9
    return windows.labelled(values[:, shown], "order", orders[shown], scaling)


class _Windows:
    """A record in steps of angle, cut into windows."""

    def __init__(
        self,
        signal: xr.DataArray,
        speed: Any,
        revolutions: float | None,
        overlap: float,
        highest: float | None,
        shaft: Mapping[str, Any],
        window: str | tuple = "hann",
    ) -> None:
        if not 0.0 <= overlap < 1.0:
            raise SignalError(f"overlap: must lie in [0, 1), got {overlap!r}")
        phase = shaft_phase(signal, speed, **shaft)
        turns = (phase.values - phase.values[0]) / TURN
        fastest = float(np.percentile(np.gradient(turns, phase["time"].values), 99.0)) if phase.size > 1 else 0.0
        if not fastest > 0.0:
            raise SignalError("speed: the shaft rests throughout; there are no orders")
        reachable = 0.5 * rate_of(signal) / fastest
        if highest is not None and highest > 0.5 * rate_of(signal) / max(turns[-1] / _duration(phase), 1e-12):
            raise SignalError(
                f"orders: order {highest:g} lies beyond half the sampling rate at the mean speed already; "
                f"the record holds orders up to {reachable:.4g}"
            )
        self.top = reachable if highest is None else float(highest)
        per_rev = 1 << max(3, math.ceil(math.log2(self.top / KEPT)))
        self.angular = angular_resample(signal, phase, samples_per_rev=per_rev)
        self.per_rev = per_rev
        total = self.angular.sizes["angle"] / per_rev
        if revolutions is None:
            revolutions = float(min(64.0, max(LEAST_TURNS, total / 20.0)))
        if not (math.isfinite(revolutions) and revolutions > 0.0):
            raise SignalError(f"revolutions: must be positive, got {revolutions!r}")
        self.length = max(8, round(revolutions * per_rev))
        if self.length > self.angular.sizes["angle"]:
            raise SignalError(
                f"revolutions: a window of {revolutions:g} revolutions does not fit, the record holds {total:.2f}; "
                "give fewer"
            )
        step = max(1, round(self.length * (1.0 - overlap)))
        self.starts = np.arange(0, self.angular.sizes["angle"] - self.length + 1, step)
        self.weights = ss.get_window(window, self.length)
        middle = self.angular["angle"].values[0] + (self.starts + 0.5 * self.length) / per_rev
        self.middle, self.signal = middle, signal
        own = phase.values / TURN
        self.times = np.interp(middle, own, phase["time"].values)
        self.speeds = np.interp(self.times, phase["time"].values, np.gradient(phase.values, phase["time"].values))

    def labelled(self, values: np.ndarray, dim: str, axis: np.ndarray, scaling: str) -> xr.DataArray:
        """Return values of shape (windows, axis, channel) with their coordinates."""
        unit = spectral_unit(common_unit(self.signal), scaling, "order")
        return xr.DataArray(
            values,
            dims=("time", dim, "channel"),
            coords={
                "time": ("time", self.times, {"units": "s"}),
                "speed": ("time", self.speeds, {"units": "rad/s", "long_name": "speed"}),
                "angle": ("time", self.middle, {"units": "rev"}),
                dim: axis,
                "channel": self.signal["channel"].values,
            },
            attrs={
                "units": unit,
                "scaling": scaling,
                "revolutions": self.length / self.per_rev,
                "samples_per_rev": self.per_rev,
                "source": str(self.signal.attrs.get("source", self.signal.name or "signal")),
            },
        )


def _duration(phase: xr.DataArray) -> float:
    times = phase["time"].values
    return float(times[-1] - times[0])
