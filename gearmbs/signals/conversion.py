"""From one kind of quantity to another: displacement, velocity and acceleration, and the force between gear and shaft.

The first three become each other in the frequency domain, within a stated band; the force becomes its components in the
directions of the mesh, and by Newton's second law an acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from gearmbs.signals.errors import SignalError
from gearmbs.signals.filters import BLOCK
from gearmbs.signals.signal.signal import common_unit, like, rate_of, units_of
from gearmbs.signals.signal.units import DIMENSIONS, unit_dimension
from gearmbs.units import to_si

if TYPE_CHECKING:
    import xarray as xr

Dimension = Literal["displacement", "velocity", "acceleration"]
DERIVATIVE = {"displacement": 0, "velocity": 1, "acceleration": 2}
TAPER = 0.25
"""Part of the edge's frequency over which the window falls at either end of the band."""
EDGE_PERIODS = 6.0
"""Periods of the lowest frequency that are lost at either end: the fall there, `TAPER` wide, rings over 1.5 reciprocal
widths."""
TOLD_LOSS = 0.01
"""Share of the RMS from which what a conversion loses below its band is told: a tenth of a decibel is a hundredth."""
COMPONENTS = ("line_of_centres", "tangential", "line_of_action", "resultant")
"""Components of a force between gear and shaft; see `force_components`."""


def convert(
    signal: xr.DataArray,
    to: Dimension,
    *,
    band: tuple[float | str, float | str],
    edges: Literal["trim", "keep"] = "trim",
) -> xr.DataArray:
    """Integrate or differentiate to displacement, velocity or acceleration, in SI units.

    Each channel's spectrum is multiplied by (2 pi i f)^n, n = -2 ... 2, inside the band; outside, the response falls
    to zero by half a cosine over a quarter of the band's edge frequency: zero below 0.75 low and above 1.25 high.
    Nothing outside remains, the mean least of all: integration does not drift, differentiation adds no noise from
    beyond.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), each channel in a unit of displacement, velocity or acceleration ("g" is gravity).
    to : {"displacement", "velocity", "acceleration"}
        What to convert to: m, m/s or m/s^2.
    band : (float or str, float or str)
        Low and high end of the band in Hz or with units, 0 < low < high, up to half the sampling rate.
    edges : {"trim", "keep"}
        "trim" (default) fades the record in and out and drops 6 / low seconds at either end: what remains is right.
        "keep" keeps the length by reflecting the record at its ends; over those 6 / low seconds the result is
        approximate, the more so the further a component lies above `low` (by integration).

    Returns
    -------
    xarray.DataArray
        In SI units, attributes `band` and `lost_below`: of each channel the share of its RMS, before the conversion,
        that lay below the band and is lost. A line of ``notes`` says so where it is a hundredth or more.

    Raises
    ------
    SignalError
        If the band or a unit does not fit, or nothing remains after trimming.
    """
    rate = rate_of(signal)
    try:
        low, high = (to_si(f, "frequency", "band") for f in band)
    except (TypeError, ValueError) as error:
        raise SignalError(f"{error}; give its low and its high end, as ('10 Hz', '1 kHz')") from None
    if to not in DERIVATIVE:
        raise SignalError(f"to: must be one of {list(DERIVATIVE)}, got {to!r}")
    if not 0.0 < low < high <= rate / 2:
        raise SignalError(
            f"band: must be 0 < low < high with high up to {rate / 2:g} Hz, half the sampling rate, got {band}"
        )
    if edges not in ("keep", "trim"):
        raise SignalError(f"edges: must be 'keep' or 'trim', got {edges!r}")
    n = signal.sizes["time"]
    margin = math.ceil(EDGE_PERIODS * rate / low)
    if edges == "trim" and n <= 2 * margin:
        raise SignalError(
            f"signal: {n / rate:g} s are too short to drop {margin / rate:g} s at either end; "
            "raise band[0] or pass edges='keep'"
        )
    pad = min(n - 1, margin)
    columns, lost = [], []
    for column, unit in zip(signal.values.T, units_of(signal)):
        dimension, factor = unit_dimension(unit)
        if dimension not in DERIVATIVE:
            raise SignalError(f"units: {unit!r} is a unit of {dimension}, which cannot be converted to {to}")
        column = factor * (column - column.mean())
        lost.append(_share_below(column, rate, low))
        power = DERIVATIVE[to] - DERIVATIVE[dimension]
        if edges == "trim":
            fade = _fade(margin // 2)
            column[: fade.size] *= fade
            column[n - fade.size :] *= fade[::-1]
            columns.append(_multiply(column, rate, power, low, high, margin)[margin : n - margin])
        else:
            fade = _fade(pad)
            extended = np.concatenate((fade * column[pad:0:-1], column, fade[::-1] * column[-2 : -pad - 2 : -1]))
            columns.append(_multiply(extended, rate, power, low, high, 0)[pad : pad + n])
    first = margin if edges == "trim" else 0
    result = like(
        signal,
        np.stack(columns, axis=1),
        t0=float(signal["time"].values[first]),
        units=DIMENSIONS[to],
        band=(low, high),
        lost_below=lost,
    )
    told = [
        f"{name}: below {low:g} Hz, where {_percent(share)} % of its RMS in {unit} lay, nothing is left of the {to}."
        for name, share, unit in zip(signal["channel"].values, lost, units_of(signal))
        if share >= TOLD_LOSS
    ]
    return result.assign_attrs(notes=[*signal.attrs.get("notes", ()), *told]) if told else result


def _percent(share: float) -> str:
    """Return a share in percent with two digits, three of nearly all of it."""
    return f"{100.0 * share:.{3 if share >= 0.995 else 2}g}"


def rms_within(column: np.ndarray, rate: float, band: tuple[float, float]) -> float:
    """Return the RMS of what a column has in a band, with the window of `convert` at its ends."""
    low, high = band[0], min(band[1], 0.5 * rate)
    return float(np.std(_multiply(column - column.mean(), rate, 0, low, high, 0)))


def _share_below(column: np.ndarray, rate: float, low: float) -> float:
    """Return the part of the RMS of a column without its mean that lies below a frequency."""
    from scipy.fft import next_fast_len, rfft

    length = next_fast_len(column.size, real=True)
    power = np.abs(rfft(column, length)) ** 2
    return float(np.sqrt(power[: math.ceil(low * length / rate)].sum() / power.sum())) if power.any() else 0.0


def _multiply(column: np.ndarray, rate: float, power: int, low: float, high: float, zeros: int) -> np.ndarray:
    """Apply (2 pi i f)^power times the band's window; `zeros` keeps the ends from wrapping around."""
    from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

    length = next_fast_len(column.size + zeros, real=True)
    frequency = rfftfreq(length, 1.0 / rate)
    line = rfft(column, length)
    line[1:] *= band_window(frequency[1:], low, high) * (2j * np.pi * frequency[1:]) ** power
    line[0] = 0.0
    if length % 2 == 0 and power % 2:
        line[-1] = 0.0
    return irfft(line, length)[: column.size]


def _fade(count: int) -> np.ndarray:
    return 0.5 * (1.0 - np.cos(np.pi * (np.arange(count) + 0.5) / count)) if count else np.empty(0)


def band_window(frequency: np.ndarray, low: float, high: float) -> np.ndarray:
    """One inside [low, high], zero outside [0.75 low, 1.25 high], half a cosine between."""
    rise = np.clip((frequency - (1.0 - TAPER) * low) / (TAPER * low), 0.0, 1.0)
    fall = np.clip(((1.0 + TAPER) * high - frequency) / (TAPER * high), 0.0, 1.0)
    return 0.25 * (1.0 - np.cos(np.pi * rise)) * (1.0 - np.cos(np.pi * fall))


# The force between gear and shaft.


def force_components(
    force: xr.DataArray,
    *,
    pressure_angle: float,
    centre_line: Sequence[float] = (1.0, 0.0, 0.0),
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    sense: int = 1,
    channels: Sequence[str] = ("x", "y", "z"),
) -> xr.DataArray:
    """Project a vector signal on the directions of the mesh.

    With e_c the unit vector from wheel 1's centre to wheel 2's, e_z the axis and e_t = e_z x e_c:
    line_of_centres = F.e_c, tangential = F.e_t, line_of_action = F.(sense cos(alpha') e_t + sin(alpha') e_c),
    resultant = |F|. A driving wheel 1 that turns in the sense +1 about e_z carries the tooth force along minus the
    line of action.

    Parameters
    ----------
    force : xarray.DataArray
        Dimensions (time, channel), three channels with fixed Cartesian components.
    pressure_angle : float
        Working pressure angle alpha' in rad.
    centre_line, axis : sequence of 3 floats
        Need not be of unit length; the part of `centre_line` along `axis` is taken out.
    sense : {1, -1}
        Sense of rotation of wheel 1 about `axis` (of its load, if it is driven).
    channels : sequence of 3 str
        Names of the x, y, z channels.

    Returns
    -------
    xarray.DataArray
        Channels "line_of_centres", "tangential", "line_of_action", "resultant", in the units of `force`.

    Raises
    ------
    SignalError
        If a channel is missing, a direction is degenerate or an argument is out of range.
    """
    names = [str(c) for c in force["channel"].values]
    missing = [c for c in channels if c not in names]
    if missing or len(channels) != 3:
        raise SignalError(
            f"channels: need the names of three Cartesian channels, {missing or channels} not among {names}"
        )
    places = [names.index(c) for c in channels]
    neighbours = places == list(range(places[0], places[0] + 3))
    # neighbours are looked at where they are
    vector = force.values[:, places[0] : places[0] + 3] if neighbours else force.values[:, places]
    result = component_values(vector, pressure_angle, centre_line, axis, sense)
    return like(force, result, channels=COMPONENTS, units=common_unit(force), pressure_angle=pressure_angle)


def component_values(
    vectors: np.ndarray,
    pressure_angle: float,
    centre_line: Sequence[float] = (1.0, 0.0, 0.0),
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    sense: int = 1,
) -> np.ndarray:
    """Return the components of vectors, shape (m, 3), in the directions of the mesh, (m, 4); see `force_components`."""
    if sense not in (1, -1):
        raise SignalError(f"sense: must be 1 or -1, got {sense!r}")
    if not 0.0 <= pressure_angle < math.pi / 2:
        raise SignalError(f"pressure_angle: must lie in [0, pi/2) rad, got {pressure_angle!r}")
    e_z = _unit(axis, "axis")
    along = np.asarray(centre_line, dtype=float)
    e_c = _unit(along - e_z * (along @ e_z), "centre_line")
    e_t = np.cross(e_z, e_c)
    e_a = sense * math.cos(pressure_angle) * e_t + math.sin(pressure_angle) * e_c
    # each component on end, as filters take it, and piece by piece in little memory
    found = np.empty((4, len(vectors)))
    for k in range(0, len(vectors), BLOCK):
        piece = vectors[k : k + BLOCK]
        found[:, k : k + BLOCK] = piece @ e_c, piece @ e_t, piece @ e_a, np.linalg.norm(piece, axis=1)
    return found.T


def force_to_acceleration(force: xr.DataArray, mass: float) -> xr.DataArray:
    """Newton's second law, a = F / m.

    Parameters
    ----------
    force : xarray.DataArray
        In N (every channel).
    mass : float
        Mass in kg of the body the force acts on.

    Returns
    -------
    xarray.DataArray
        In m/s^2.

    Raises
    ------
    SignalError
        If a channel is not in N or the mass is not positive.
    """
    if common_unit(force) != "N":
        raise SignalError(f"force: every channel must be in N, got {common_unit(force)!r}")
    if not (math.isfinite(mass) and mass > 0.0):
        raise SignalError(f"mass: must be a positive number of kg, got {mass!r}")
    return like(force, force.values / mass, units="m/s^2", mass=float(mass))


def _unit(vector: Sequence[float] | np.ndarray, name: str) -> np.ndarray:
    value = np.asarray(vector, dtype=float)
    length = float(np.linalg.norm(value))
    if value.shape != (3,) or not math.isfinite(length) or length < 1e-12:
        raise SignalError(f"{name}: must be a vector of three numbers with a direction of its own, got {vector!r}")
    return value / length
