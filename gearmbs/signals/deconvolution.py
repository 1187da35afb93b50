"""Blows behind a long path: filters that undo it by the shape of what they leave.

Minimum entropy deconvolution looks for the filter whose output has the highest kurtosis: a few sharp blows. It needs to
know nothing, and likes a single blow best. Maximum correlated kurtosis deconvolution looks for blows that come again
after a known period.

References
----------
.. [1] H. Endo, R. B. Randall, Enhancement of autoregressive model based gear tooth fault detection technique by the
   use of minimum entropy deconvolution filter, Mechanical Systems and Signal Processing 21 (2007) 906-919.
.. [2] G. L. McDonald, Q. Zhao, M. J. Zuo, Maximum correlated kurtosis deconvolution and application on gear tooth chip
   fault detection, Mechanical Systems and Signal Processing 33 (2012) 237-255.
"""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
import scipy.linalg
import scipy.signal as ss
import xarray as xr

from gearmbs.signals.errors import SignalError
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.signal import like, rate_of
from gearmbs.signals.signal.units import Given

LENGTH, ROUNDS = 64, 30
ENOUGH = 1e-4
"""Relative rise of the measure from which on another round is worth it."""
LOADING = 1e-9
"""Part of the power that is added to the diagonal of the autocorrelation: a record of few lines has a singular one."""


@takes_data()
def minimum_entropy(
    signal: Any, *, length: int = LENGTH, rounds: int = ROUNDS, **_data: Unpack[DataKeywords]
) -> xr.DataArray:
    """Return each channel through the filter that makes its kurtosis highest (Endo and Randall).

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    length : int
        Samples of the filter: as long as the path rings.
    rounds : int
        Iterations at most.

    Returns
    -------
    xarray.DataArray
        Of the same length and RMS, the first ``length`` samples without their past; attribute ``kurtosis``, of each
        channel after every round.

    Examples
    --------
    >>> import numpy as np
    >>> blows = np.zeros(4000)
    >>> blows[::250] = 1.0
    >>> heard = np.convolve(blows, np.exp(-np.arange(60) / 15) * np.cos(np.arange(60)))[:4000]
    >>> found = minimum_entropy(heard, rate=4000)
    >>> found.attrs["kurtosis"][0][-1] > 5 * found.attrs["kurtosis"][0][0]
    True
    """
    return _deconvolved(signal, length, rounds, 0, 0)


@takes_data(period="time")
def maximum_correlated_kurtosis(
    signal: Any,
    period: Given,
    *,
    shifts: int = 1,
    length: int = LENGTH,
    rounds: int = ROUNDS,
    **_data: Unpack[DataKeywords],
) -> xr.DataArray:
    """Return each channel through the filter that makes its correlated kurtosis at a period highest (McDonald et al.).

    Parameters
    ----------
    signal : xarray.DataArray
        As for `minimum_entropy`.
    period : float or str
        Time from one blow to the next, s: one by the line of a bearing's part, rounded to samples here. Resample a
        record whose samples are too wide for that.
    shifts : int
        How many blows that follow count; more ask for steadier periods.
    length, rounds
        As for `minimum_entropy`.

    Returns
    -------
    xarray.DataArray
        As of `minimum_entropy`, with the correlated kurtosis as ``kurtosis``.

    Raises
    ------
    SignalError
        If the period is shorter than two samples, or the record than all shifts.
    """
    period = float(period)
    samples = round(period * rate_of(signal))
    if samples < 2 or shifts < 1 or (shifts + 1) * samples >= signal.sizes["time"]:
        raise SignalError(
            f"period: {period:g} s are {samples} samples; with shifts={shifts} give one of two samples or more of "
            f"which {shifts + 2} fit into the record of {signal.sizes['time']}"
        )
    return _deconvolved(signal, length, rounds, samples, shifts)


def _deconvolved(signal: xr.DataArray, length: int, rounds: int, period: int, shifts: int) -> xr.DataArray:
    if not 2 <= length <= signal.sizes["time"] // 4:
        raise SignalError(f"length: must lie between 2 and a quarter of the record, got {length!r}")
    if rounds < 1:
        raise SignalError(f"rounds: must be 1 or more, got {rounds!r}")
    found = [_one(values - values.mean(), length, rounds, period, shifts) for values in signal.values.T]
    out = like(signal, np.stack([values for values, _ in found], axis=1))
    return out.assign_attrs(kurtosis=[measures for _, measures in found])


def _one(x: np.ndarray, length: int, rounds: int, period: int, shifts: int) -> tuple[np.ndarray, list[float]]:
    """Return one channel through the filter, and the measure before and after each round."""
    if not x.any():
        return x, [np.nan]
    auto = ss.correlate(x, x, method="fft")[x.size - 1 : x.size - 1 + length]
    auto[0] *= 1.0 + LOADING
    taps = np.zeros(length)
    # both publications begin with a pulse
    taps[length // 2] = 1.0
    best, measures = x, [_measure(x, period, shifts)]
    for _ in range(rounds):
        y = ss.lfilter(taps, 1.0, x)
        gradient = _correlated(x, y, length, period, shifts)
        new = scipy.linalg.solve_toeplitz(auto, gradient)
        new /= np.linalg.norm(new)
        y = ss.lfilter(new, 1.0, x)
        measure = _measure(y, period, shifts)
        if not np.isfinite(measure) or measure <= measures[-1] * (1.0 + ENOUGH):
            break
        taps, best = new, y
        measures.append(measure)
    return best * (x.std() / max(best.std(), 1e-300)), measures


def _shifted(y: np.ndarray, by: int) -> np.ndarray:
    return y if by == 0 else np.concatenate((np.zeros(by), y[:-by]))


def _measure(y: np.ndarray, period: int, shifts: int) -> float:
    """Return the kurtosis, or sum (prod_m y(n - m T))^2 / (sum y^2)^(M + 1) times the number of samples^M."""
    power = float((y**2).sum())
    if shifts == 0:
        return float(y.size * (y**4).sum()) / power**2
    product = np.prod([_shifted(y, m * period) for m in range(shifts + 1)], axis=0)
    return float(y.size**shifts * (product**2).sum()) / power ** (shifts + 1)


def _correlated(x: np.ndarray, y: np.ndarray, length: int, period: int, shifts: int) -> np.ndarray:
    """Return the right-hand side of the equations of the next filter, sum_n a(n) x(n - l) over all shifts."""
    if shifts == 0:
        weights = [(0, y**3)]
    else:
        moved = [_shifted(y, m * period) for m in range(shifts + 1)]
        weights = []
        for m in range(shifts + 1):
            others = np.prod([v**2 for k, v in enumerate(moved) if k != m], axis=0)
            weights.append((m * period, moved[m] * others))
    total = np.zeros(length)
    for by, weight in weights:
        total += ss.correlate(weight, _shifted(x, by), method="fft")[x.size - 1 : x.size - 1 + length]
    return total
