"""Condition indicators of gears, each a pure function of an array, and all of them at once for an average.

Moments are taken about the mean: m_p = sum (x - mean)^p / N.

References
----------
.. [1] J. J. Zakrajsek, D. P. Townsend, H. J. Decker, An analysis of gear fault detection methods as applied to pitting
   fatigue failure data, NASA TM-105950 (1993): FM0, FM4, NA4, NB4.
.. [2] M. Lebold et al., Review of vibration analysis methods for gearbox diagnostics and prognostics, 54th MFPT (2000).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.fft
import xarray as xr

from gearmbs.signals.errors import SignalError
from gearmbs.signals.rotation.angular import (
    difference_signal,
    regular_signal,
    residual_signal,
    tooth_count,
    whole_revolutions,
)
from gearmbs.signals.rotation.phase import analytic

BLOCK = 1 << 17
CONSTANT = 1e-11
"""Deviation of an envelope, as part of its mean, up to which it is constant: rounding of the filters that make it."""
INDICATORS = (
    "rms",
    "peak_to_peak",
    "crest",
    "kurtosis",
    "fm0",
    "fm4",
    "m6a",
    "m8a",
    "na4",
    "nb4",
    "energy_ratio",
    "sideband_index",
    "sideband_level",
)
"""Names of all condition indicators, in the order of `condition_indicators`."""


def rms(x: np.ndarray) -> float:
    """Root mean square about zero."""
    return float(np.sqrt(np.mean(np.square(x))))


def peak_to_peak(x: np.ndarray) -> float:
    """Largest less smallest value."""
    return float(np.max(x) - np.min(x))


def crest_factor(x: np.ndarray) -> float:
    """Largest |x - mean| over the RMS of x - mean; sqrt(2) for a sine."""
    centred = x - np.mean(x)
    return _ratio(float(np.max(np.abs(centred))), rms(centred))


def normalised_moment(x: np.ndarray, order: int) -> float:
    """m_order / m_2^(order/2), order >= 2; NaN for a constant."""
    x = np.asarray(x, dtype=float)
    mean = float(np.mean(x))
    scale = max(float(np.max(x)) - mean, mean - float(np.min(x)))
    if scale == 0.0:
        return float("nan")
    second = total = 0.0
    for start in range(0, x.size, BLOCK):
        centred = (x[start : start + BLOCK] - mean) / scale
        square = centred * centred
        # Products instead of powers: NumPy's general power is tens of times slower on long records.
        power = square if order % 2 == 0 else centred * square
        for _ in range(order // 2 - 1):
            power = power * square
        second += float(square.sum())
        total += float(power.sum())
    return (total / x.size) / (second / x.size) ** (order / 2)


def kurtosis(x: np.ndarray) -> float:
    """m_4 / m_2^2: 1.5 for a sine, 3 for Gaussian noise."""
    return normalised_moment(x, 4)


def fm0(average: np.ndarray, mesh_amplitudes: np.ndarray) -> float:
    """Peak-to-peak of the average over the sum of the amplitudes of the mesh harmonics."""
    return _ratio(peak_to_peak(average), float(np.sum(mesh_amplitudes)))


def fm4(difference: np.ndarray) -> float:
    """Kurtosis of the difference signal: 1.5 for a sine, 3 for Gaussian noise, more for a local fault."""
    return normalised_moment(difference, 4)


def m6a(difference: np.ndarray) -> float:
    """m_6 / m_2^3 of the difference signal: 2.5 for a sine, 15 for Gaussian noise."""
    return normalised_moment(difference, 6)


def m8a(difference: np.ndarray) -> float:
    """m_8 / m_2^4 of the difference signal: 4.375 for a sine, 105 for Gaussian noise."""
    return normalised_moment(difference, 8)


def na4(residual: np.ndarray, history: Sequence[np.ndarray] = ()) -> float:
    """Fourth moment of the residual over the square of its second moment averaged over the run so far.

    m_4 / (mean of m_2 over `history` and the residual itself)^2. Without a history it is the residual's kurtosis;
    unlike FM4 it keeps growing when the whole signal does.

    Parameters
    ----------
    residual : ndarray
        The present residual signal.
    history : sequence of ndarray
        Earlier residual signals of the same run, in any order.
    """
    present = residual - np.mean(residual)
    variances = [float(np.mean(np.square(r - np.mean(r)))) for r in (*history, residual)]
    return _ratio(float(np.mean(present**4)), float(np.mean(variances)) ** 2)


def mesh_envelope(average: np.ndarray, turns: int, teeth: int, width: int | None = None) -> np.ndarray:
    """Envelope of the average band-passed about the mesh order: the signal behind NB4.

    Parameters
    ----------
    average : ndarray of shape (n,)
        Whole number `turns` of revolutions.
    turns, teeth : int
    width : int, optional
        Orders on either side of the mesh order; default (teeth - 1) // 2, all the sidebands up to half way.
    """
    width = (teeth - 1) // 2 if width is None else width
    line = scipy.fft.rfft(average - np.mean(average))
    orders = np.arange(line.size) / turns
    line[np.abs(orders - teeth) > width + 1e-9] = 0.0
    return np.abs(analytic(scipy.fft.irfft(line, average.size)))


def nb4(envelope: np.ndarray, history: Sequence[np.ndarray] = ()) -> float:
    """As `na4`, of the envelope about the mesh order (`mesh_envelope`); NaN for an envelope constant to rounding."""
    if float(np.std(envelope)) <= CONSTANT * abs(float(np.mean(envelope))):
        return float("nan")
    return na4(envelope, history)


def energy_ratio(difference: np.ndarray, regular: np.ndarray) -> float:
    """Standard deviation of the difference signal over that of the regular signal."""
    return _ratio(float(np.std(difference)), float(np.std(regular)))


def sideband_index(sideband_amplitudes: np.ndarray) -> float:
    """Mean amplitude of the first sidebands on either side of the mesh order, in the signal's unit."""
    return float(np.mean(sideband_amplitudes))


def sideband_level(sideband_amplitudes: np.ndarray, average: np.ndarray) -> float:
    """Sum of the amplitudes of the first sidebands over the RMS of the average (sideband level factor).

    An AM tone (1 + d cos s) cos c has sidebands of d / 2 each, so index d / 2 and level d / sqrt(1/2 + d^2/4).
    """
    return _ratio(float(np.sum(sideband_amplitudes)), float(np.std(average)))


def condition_indicators(
    average: xr.DataArray,
    teeth: int | Sequence[int] | None = None,
    *,
    history: Sequence[xr.DataArray] = (),
    harmonics: int = 3,
) -> xr.Dataset:
    """All indicators of a time-synchronous average.

    Parameters
    ----------
    average : xarray.DataArray
        Dimensions (angle, channel), whole revolutions (`time_synchronous_average`).
    teeth : int or sequence, optional
        Tooth count of the wheel on this shaft (the first counts); default the signal's.
    history : sequence of xarray.DataArray
        Earlier averages of the same run and channels, for NA4 and NB4.
    harmonics : int
        Mesh harmonics that count in FM0.

    Returns
    -------
    xarray.Dataset
        One variable per name in `INDICATORS`, dimension (channel,). What is undefined (a zero denominator) is NaN.

    Raises
    ------
    MissingMetadataError
        If the tooth count is unknown.
    SignalError
        If the average does not reach the mesh order, or a record in the history has other channels.
    """
    count = tooth_count(average, teeth)
    turns = whole_revolutions(average)
    per_rev = int(average.attrs["samples_per_rev"])
    if count + 1 >= per_rev / 2:
        raise SignalError(
            f"average: {per_rev} samples per revolution do not reach the mesh order {count}; "
            "average with more samples_per_rev"
        )
    for old in history:
        if old["channel"].values.tolist() != average["channel"].values.tolist():
            raise SignalError("history: every average must have the channels of the present one")
    residual, difference = residual_signal(average, count), difference_signal(average, count)
    regular = regular_signal(average, count)
    old_residuals = [residual_signal(old, count).values for old in history]
    amplitudes = 2.0 / average.sizes["angle"] * np.abs(scipy.fft.rfft(average.values, axis=0))
    reachable = [k * count for k in range(1, harmonics + 1) if k * count < per_rev / 2]
    rows: dict[str, list[float]] = {name: [] for name in INDICATORS}
    for c in range(average.sizes["channel"]):
        x = average.values[:, c] - average.values[:, c].mean()
        d, r = difference.values[:, c], regular.values[:, c]
        sides = amplitudes[[(count - 1) * turns, (count + 1) * turns], c]
        past_envelopes = [mesh_envelope(old.values[:, c], whole_revolutions(old), count) for old in history]
        found: dict[str, Any] = {
            "rms": rms(x),
            "peak_to_peak": peak_to_peak(x),
            "crest": crest_factor(x),
            "kurtosis": kurtosis(x),
            "fm0": fm0(x, amplitudes[[k * turns for k in reachable], c]),
            "fm4": fm4(d),
            "m6a": m6a(d),
            "m8a": m8a(d),
            "na4": na4(residual.values[:, c], [old[:, c] for old in old_residuals]),
            "nb4": nb4(mesh_envelope(x, turns, count), past_envelopes),
            "energy_ratio": energy_ratio(d, r),
            "sideband_index": sideband_index(sides),
            "sideband_level": sideband_level(sides, x),
        }
        for name, value in found.items():
            rows[name].append(value)
    unit = str(average.attrs.get("units", "unknown"))
    has_unit = {"rms", "peak_to_peak", "sideband_index"}
    variables = {n: ("channel", np.asarray(v), {"units": unit if n in has_unit else "1"}) for n, v in rows.items()}
    coords = {"channel": average["channel"].values}
    attrs = {"teeth": count, "averages": average.attrs.get("averages", 1), "history": len(history)}
    return xr.Dataset(variables, coords=coords, attrs=attrs)


def _ratio(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator > 0.0 else float("nan")
