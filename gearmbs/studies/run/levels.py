"""RMS of the mesh harmonics of a case's record, by band-passes and by orders."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.signals.analysis.bands import HALF_WIDTH, line_levels, mesh_levels
from gearmbs.studies.case.case import Case
from gearmbs.studies.case.limits import HARMONICS, band_taps, geometric_period, holds_period, least_for_bands

if TYPE_CHECKING:
    import xarray as xr

LEVELS = ("gmf_rms", "order_rms")
"""RMS of the mesh harmonics: at constant speed, and of a run-up. A record has one of them."""

WAYS = ("band", "orders")
"""How the RMS of the mesh harmonics is found."""


def told_way(records: Iterable[xr.Dataset]) -> str:
    """Return the way by which levels of records are compared: bands, or orders if one is too short for them."""
    levels = [record["gmf_rms"] for record in records if "gmf_rms" in record]
    return WAYS[0] if all(np.isfinite(one.sel(way=WAYS[0]).values).all() for one in levels) else WAYS[1]


def levels_of(case: Case, acceleration: np.ndarray) -> np.ndarray:
    """Return the RMS of the mesh harmonics by both ways, shape (2, harmonics, components).

    Bands are NaN of a record that is too short for them.

    Both are those of whole periods of the faulty teeth where the record holds one. A record that is not longer than one
    by as much as the band-passes take is seen as a part of a motion that repeats itself.

    Parameters
    ----------
    case : Case
    acceleration : ndarray, shape (n, components)
        At the signal rate, m/s^2.
    """
    gmf, longest, rate = case.mesh_frequency, case.operation.longest, case.signal_rate
    period = geometric_period(case) if holds_period(case) else 1

    def lines(numbers: np.ndarray) -> np.ndarray:
        return line_levels(acceleration, rate, gmf / period, numbers, least=1)

    if longest >= least_for_bands(case) + (period - 1) / gmf:
        found = mesh_levels(acceleration, rate, gmf, period, HARMONICS)
        return np.stack([found.band, found.orders])
    if period > 1:
        return np.stack([bands_of_lines(case, period, lines), lines(period * np.arange(1, HARMONICS + 1))])
    orders = line_levels(acceleration, rate, gmf, np.arange(1, HARMONICS + 1))
    return np.stack([np.full_like(orders, np.nan), orders])


def bands_of_lines(case: Case, periods: int, lines: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return the RMS of what the band-passes about the mesh harmonics let through, (harmonics, components).

    Parameters
    ----------
    case : Case
    periods : int
        Mesh periods after which the motion repeats itself.
    lines : callable
        RMS of lines by their numbers, in units of the mesh frequency over ``periods``: ``(m,) -> (m, components)``.
    """
    bands = []
    for harmonic, taps in enumerate(band_taps(case), 1):
        # beyond twice the half width the pass is over, in the middle between two harmonics
        low, high = ((harmonic + side * 2.0 * HALF_WIDTH) * periods for side in (-1.0, 1.0))
        numbers = np.arange(math.ceil(low), math.floor(high) + 1)
        shift = np.arange(taps.size) - 0.5 * (taps.size - 1)
        angles = (2.0 * np.pi * case.mesh_frequency / periods / case.signal_rate) * np.outer(numbers, shift)
        passed = np.cos(angles) @ taps
        bands.append(np.sqrt(((passed[:, None] * lines(numbers)) ** 2).sum(axis=0)))
    return np.stack(bands)


def level_parts(values: np.ndarray, components: np.ndarray, mesh_frequency: float) -> tuple[tuple, dict[str, Any]]:
    """Return the RMS of the mesh harmonics, shape (ways, harmonics, components), as a variable, and its coordinates."""
    harmonics = np.arange(1, HARMONICS + 1)
    coords = {
        "harmonic": harmonics,
        "frequency": ("harmonic", harmonics * mesh_frequency, {"units": "Hz"}),
        "component": components,
        "way": list(WAYS),
    }
    told = {"units": "m/s^2", "long_name": "RMS of the gear mesh frequency harmonics"}
    return (("way", "harmonic", "component"), values, told), coords


def tracked_levels(case: Case, acceleration: xr.DataArray, turning: Mapping[str, tuple]) -> xr.DataArray:
    """Return the RMS of the mesh orders along a run-up, by order tracking over four revolutions at a time.

    ``turning`` has values and attributes of the driver's ``speed`` and ``angle`` over the signal's times.
    """
    # what only run-ups need takes longer to load than many a simulation
    from gearmbs.signals import order_track

    over_time = {name: ("time", *turning[name][1:]) for name in ("speed", "angle")}
    orders = [float(case.gears.teeth[0] * k) for k in range(1, HARMONICS + 1)]
    tracks = order_track(acceleration.assign_coords(over_time), orders=orders, scaling="rms")
    found = tracks.rename(time="track_time", speed="track_speed", angle="track_angle", order="harmonic")
    found = found.rename(channel="component").drop_vars(["units", "channel_units"], errors="ignore")
    found = found.assign_coords(harmonic=np.arange(1, HARMONICS + 1))
    found.attrs = {"units": "m/s^2", "long_name": "RMS of the mesh orders along the run-up"}
    return found
