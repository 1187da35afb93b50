"""Harmonics of the gear mesh frequency (GMF): RMS by band-pass and by orders, as in section 4 of the paper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Integral
from typing import TYPE_CHECKING, NamedTuple, TypedDict

import numpy as np

from gearmbs.signals.errors import SignalError
from gearmbs.signals.filters import bandpass_taps, filtered_mean_squares, kaiser_order
from gearmbs.signals.signal.signal import check_teeth, common_unit, mesh_frequency, rate_of, units_of

if TYPE_CHECKING:
    import xarray as xr

HALF_WIDTH = 0.25
"""Half width of the band about a mesh harmonic, in mesh frequencies: sidebands belong to it, the next harmonic's do
not."""
TRANSITION = 0.25
"""Over which the band falls, in mesh frequencies: with the half width it ends in the middle between two harmonics."""
ATTENUATION_DB = 100.0
"""Attenuation of what lies beyond the band: a line a hundred thousand times larger than the band's own counts as
much."""
MIN_PERIODS = 4
RAMP = 4.0
"""Samples beyond one period from which its ends are joined by ramps: they lower what folds to 1e-4, straight joints to
1e-2 where lines reach 0.4 of the rate."""
BLOCK = 1 << 16


def whole_period_count(count: int, rate: float, frequency: float) -> int:
    """Number of samples, at most `count`, nearest to the largest whole number of periods that fits."""
    periods = math.floor(count * frequency / rate)
    if periods < 1:
        raise SignalError(f"signal: {count} samples at {rate:g} Hz hold no whole period of {frequency:g} Hz")
    return min(count, round(periods * rate / frequency))


def rms(values: np.ndarray) -> np.ndarray:
    """Root mean square along axis 0, mean included."""
    return np.sqrt(np.einsum("i...,i...->...", values, values) / values.shape[0])


def band_rms(
    signal: xr.DataArray, frequency: float, *, half_width: float, transition: float, period: float | None = None
) -> xr.DataArray:
    """RMS of what a zero-phase band-pass around `frequency` lets through.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    frequency : float
        Centre of the band in Hz.
    half_width, transition : float
        The band is flat over frequency +- half_width and 100 dB down beyond a further `transition`, in Hz.
    period : float, optional
        The RMS is taken over the largest whole number of these periods (s) inside the filter's valid range;
        default 1 / frequency.

    Returns
    -------
    xarray.DataArray of dimension (channel,)
    """
    fundamental = 1.0 / period if period else frequency
    levels = _band_levels(signal.values, rate_of(signal), [frequency], half_width, transition, fundamental)
    return _per_channel(signal, levels[0])


def _band_levels(
    values: np.ndarray,
    rate: float,
    centres: Sequence[float],
    half_width: float,
    transition: float,
    fundamental: float,
) -> np.ndarray:
    """RMS of each channel of (n, channels), sampled at ``rate``, in bands about ``centres``, over whole periods, in Hz.

    See `band_rms`. Shape (bands, channels).
    """
    n = len(values)
    filters = []
    for centre in centres:
        filters.append(bandpass_taps(rate, centre - half_width, centre + half_width, transition, ATTENUATION_DB))
        if n < filters[-1].size:
            raise SignalError(
                f"signal: has {n} samples, the band-pass at {centre:g} Hz needs at least {filters[-1].size}; "
                "give a longer record or a wider transition band"
            )
    # all of one length, which the transition decides
    bank = np.stack(filters)
    count = whole_period_count(n - bank.shape[1] + 1, rate, fundamental)
    return np.sqrt(filtered_mean_squares(values.T, bank, count))


def order_rms(
    signal: xr.DataArray, fundamental: float, orders: Sequence[float], *, least: int = MIN_PERIODS
) -> xr.DataArray:
    """RMS of the lines at multiples of `fundamental` (Hz), by the transform over whole periods.

    Records of fewer than ``least`` periods are refused.

    Returns
    -------
    xarray.DataArray of dimensions (order, channel)

    See Also
    --------
    gearmbs.signals.analysis.bands.harmonic_amplitudes
    """
    import xarray as xr

    orders = [float(k) for k in orders]
    return xr.DataArray(
        line_levels(signal.values, rate_of(signal), fundamental, np.asarray(orders), least),
        dims=("order", "channel"),
        coords={"order": orders, **_channel_coords(signal)},
        attrs={"units": common_unit(signal), "long_name": "RMS"},
    )


def line_levels(
    values: np.ndarray, rate: float, fundamental: float, orders: np.ndarray, least: int = MIN_PERIODS
) -> np.ndarray:
    """RMS of the lines at multiples of a fundamental, (m, channels); see `order_rms`."""
    return np.abs(harmonic_amplitudes(values, rate, fundamental, orders, least)) / math.sqrt(2.0)


class MeshLevels(NamedTuple):
    """RMS of mesh harmonics by both ways, (harmonics, channels), and the whole turns they are of; see `gmf_rms`."""

    band: np.ndarray
    orders: np.ndarray
    turns: tuple[int, int]


def mesh_levels(
    values: np.ndarray,
    rate: float,
    gmf: float,
    per_turn: int = 1,
    harmonics: int = 3,
    half_width: float = HALF_WIDTH,
) -> MeshLevels:
    """RMS of the first harmonics of a mesh frequency by `gmf_rms`, of plain arrays.

    Parameters
    ----------
    values : ndarray, shape (n, channels)
    rate, gmf : float
        Hz.
    per_turn : int
        Mesh periods of a turn.
    harmonics, half_width
        As for `gmf_rms`.
    """
    multiples = np.arange(1, harmonics + 1)
    turn, count = gmf / per_turn, len(values)
    taps = kaiser_order(ATTENUATION_DB, TRANSITION * gmf / (0.5 * rate))[0] | 1
    turns = max(0, math.floor((count - taps + 1) * turn / rate)), _whole_periods(count, turn / rate)
    in_band, in_orders = (per_turn if whole else 1 for whole in turns)
    by_band = _band_levels(values, rate, list(multiples * gmf), half_width * gmf, TRANSITION * gmf, gmf / in_band)
    least = math.ceil(MIN_PERIODS / in_orders)
    return MeshLevels(by_band, line_levels(values, rate, gmf / in_orders, multiples * in_orders, least), turns)


def check_harmonics(harmonics: object) -> None:
    """Refuse a number of harmonics that is not whole and positive."""
    if isinstance(harmonics, bool) or not isinstance(harmonics, Integral) or harmonics < 1:
        raise SignalError(f"harmonics: must be at least 1, a whole number, got {harmonics!r}")


class MeshKeywords(TypedDict, total=False):
    """What is known of a mesh: keywords of `gmf_rms`, for type checkers."""

    gmf: float | None
    speed: float | None
    teeth: int | Sequence[int] | None


def gmf_rms(
    signal: xr.DataArray,
    gmf: float | None = None,
    *,
    harmonics: int = 3,
    half_width: float = HALF_WIDTH,
    speed: float | None = None,
    teeth: int | Sequence[int] | None = None,
) -> xr.Dataset:
    """RMS of the first GMF harmonics by two independent ways.

    `band`: zero-phase FIR band-pass, flat over k GMF +- half_width GMF and 100 dB down from a further GMF / 4; RMS over
    whole mesh periods inside the filter's valid range. Sidebands inside the band count.
    `orders`: amplitude at exactly k GMF over whole mesh periods, divided by sqrt(2). Sidebands do not count.
    For a signal periodic in the mesh the two agree to 1e-3. Where the tooth count is known, whole revolutions of the
    first wheel take the place of whole mesh periods, so that its sidebands count in full and are kept apart exactly;
    for `band` one must fit into the filter's valid range, for `orders` into the record. The attributes `band_turns`
    and `orders_turns` say how many did; at 0 the levels depend on where in a revolution the record begins.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), at constant speed.
    gmf : float, optional
        Gear mesh frequency in Hz; default from `speed` (rad/s) and `teeth`, given here or in the signal.
    harmonics : int
        How many harmonics.
    half_width : float
        Half width of the pass band as a fraction of GMF, below 0.75.
    speed, teeth : optional
        Override the signal's metadata.

    Returns
    -------
    xarray.Dataset
        `band` and `orders` of dimensions (harmonic, channel), in the signal's units; coordinate `frequency` (Hz).

    Raises
    ------
    MissingMetadataError
        If GMF is not given and speed or teeth are unknown.
    SignalError
        If a harmonic's band does not fit below half the sampling rate, or the record is too short.

    Examples
    --------
    >>> import numpy as np
    >>> from gearmbs.signals import make_signal
    >>> t = np.arange(12800) / 12800.0
    >>> signal = make_signal(np.cos(2 * np.pi * 480 * t) + 0.5 * np.cos(2 * np.pi * 960 * t), 12800.0, units="m/s^2")
    >>> gmf_rms(signal, 480.0)["orders"].values.round(4).ravel().tolist()
    [0.7071, 0.3536, 0.0]
    """
    import xarray as xr

    gmf = mesh_frequency(signal, speed, teeth) if gmf is None else float(gmf)
    if not (math.isfinite(gmf) and gmf > 0.0):
        raise SignalError(f"gmf: must be a positive frequency in Hz, got {gmf!r}")
    check_harmonics(harmonics)
    if not 0.0 < half_width < 1.0 - TRANSITION:
        raise SignalError(f"half_width: must lie between 0 and {1.0 - TRANSITION:g} of the GMF, got {half_width!r}")
    multiples = np.arange(1, harmonics + 1)
    rate = rate_of(signal)
    known = teeth if teeth is not None else signal.attrs.get("teeth")
    per_turn = 1 if known is None else check_teeth(known)[0]
    by_band, by_orders, turns = mesh_levels(signal.values, rate, gmf, per_turn, harmonics, half_width)
    units = common_unit(signal)
    dims = ("harmonic", "channel")
    return xr.Dataset(
        {
            "band": (dims, by_band, {"units": units, "long_name": "RMS in the band around the GMF harmonic"}),
            "orders": (dims, by_orders, {"units": units, "long_name": "RMS of the line at the GMF harmonic"}),
        },
        coords={
            "harmonic": multiples,
            "frequency": ("harmonic", multiples * gmf, {"units": "Hz"}),
            **_channel_coords(signal),
        },
        attrs={
            "gmf": gmf,
            "half_width": half_width,
            "transition": TRANSITION,
            "stop_band_db": ATTENUATION_DB,
            **({} if known is None else {"band_turns": turns[0], "orders_turns": turns[1]}),
        },
    )


def _whole_periods(count: int, per_sample: float) -> int:
    """Number of periods in ``count`` samples; the end of the first may lie between the last sample and the next."""
    held = count * per_sample + 1e-9
    return math.floor(held) or math.floor(held + per_sample)


def _channel_coords(signal: xr.DataArray) -> dict:
    return {
        "channel": signal["channel"].values,
        "channel_units": ("channel", np.asarray(units_of(signal), dtype=str)),
    }


def _per_channel(signal: xr.DataArray, values: np.ndarray) -> xr.DataArray:
    import xarray as xr

    return xr.DataArray(
        values,
        dims=("channel",),
        coords=_channel_coords(signal),
        attrs={"units": common_unit(signal), "long_name": "RMS"},
    )


def harmonic_amplitudes(
    values: np.ndarray, rate: float, fundamental: float, multiples: np.ndarray, least: int = MIN_PERIODS
) -> np.ndarray:
    """Complex amplitudes of `values` at given multiples of `fundamental`.

    The transform runs over the largest whole number P of fundamental periods, N = P rate / fundamental samples (not
    a whole number in general), with the Hann weight w = 1 - cos(2 pi n / N):

        c_k = (2 / sum w) sum_n w_n (x_n - mean) exp(-2 pi i k n fundamental / rate)

    The weight vanishes with its slope at both ends, so the broken last sample costs only O(P^-3), and every other
    multiple falls on a zero of its spectrum: a periodic signal gives its Fourier coefficients. Of one period the
    multiples beside would fall into its spectrum; its weight is even instead, and rises and falls over what the record
    has beyond the period, so that both ends together count as one.

    Parameters
    ----------
    values : ndarray of shape (n, channels)
    rate : float
        Sampling rate in Hz.
    fundamental : float
        Frequency in Hz.
    multiples : ndarray of shape (m,)
        Multiples of the fundamental (orders); need not be whole. Those at fractions p/q are exact if P covers q.
    least : int
        Periods that the record must have.

    Returns
    -------
    ndarray of shape (m, channels), complex
        x(t) contains Re[c_k exp(2 pi i k f t)], t from the first sample; |c_k| is the peak amplitude.

    Raises
    ------
    SignalError
        If the record is shorter than that or a multiple lies at or above half the sampling rate.
    """
    multiples = np.atleast_1d(np.asarray(multiples, dtype=float))
    if not (math.isfinite(fundamental) and fundamental > 0.0):
        raise SignalError(f"fundamental: must be a positive frequency in Hz, got {fundamental!r}")
    top = float(multiples.max(initial=0.0)) * fundamental
    if multiples.size == 0 or multiples.min() <= 0.0:
        raise SignalError(f"multiples: must be positive and at least one, got {multiples.tolist()}")
    if top >= rate / 2:
        raise SignalError(
            f"harmonics: {top:g} Hz is not below half the sampling rate ({rate / 2:g} Hz); "
            "ask for fewer or sample faster"
        )
    periods = _whole_periods(values.shape[0], fundamental / rate)
    if periods < least:
        raise SignalError(
            f"signal: holds {values.shape[0] * fundamental / rate:.2f} periods of {fundamental:g} Hz, "
            f"at least {least} are needed; give a longer record"
        )
    span = periods * rate / fundamental
    count = values.shape[0] if periods == 1 else min(values.shape[0], math.ceil(span - 1e-9))
    weight_sum = 0.0
    mean_sum = np.zeros(values.shape[1])
    raw = np.zeros((multiples.size, values.shape[1]), dtype=complex)
    leak = np.zeros(multiples.size, dtype=complex)
    for start in range(0, count, BLOCK):
        n = np.arange(start, min(start + BLOCK, count))
        weight = _even_weight(n, span, count) if periods == 1 else 1.0 - np.cos((2.0 * np.pi / span) * n)
        block = values[n[0] : n[-1] + 1]
        weight_sum += weight.sum()
        mean_sum += weight @ block
        for i, k in enumerate(multiples):
            turn = weight * np.exp((-2j * np.pi * k * fundamental / rate) * n)
            raw[i] += turn @ block
            leak[i] += turn.sum()
    return (2.0 / weight_sum) * (raw - np.outer(leak, mean_sum / weight_sum))


def _even_weight(n: np.ndarray, span: float, count: int) -> np.ndarray:
    """Weights of samples ``n`` of ``count`` that add to one with those a period of ``span`` samples later."""
    ramp = min(count - 1.0 - span, span)
    if ramp >= RAMP:
        rise, fall = np.clip(n / ramp, 0.0, 1.0), np.clip((span + ramp - n) / ramp, 0.0, 1.0)
        return 0.25 * (1.0 - np.cos(np.pi * rise)) * (1.0 - np.cos(np.pi * fall))
    # the trapezoidal rule over the circle that the period is, whose last interval has a length of its own
    last = min(count, math.floor(span) + 1) - 1
    return np.where((n == 0) | (n == last), 0.5 * (1.0 + span - last), np.where(n < last, 1.0, 0.0))
