"""Parts of a time-synchronous average: regular, residual and difference signal.

With z teeth, orders counted in revolutions of the average's shaft:

* regular: shaft orders 1 and 2, mesh orders k z, and their first sidebands k z +- 1
* residual: the average less its mean, shaft orders 1 and 2 and mesh orders (first sidebands stay)
* difference: the average less its mean and the regular part

so residual - difference = the first sidebands. Removal is exact: the average covers whole revolutions, each order is
one bin of its discrete Fourier transform.

References
----------
.. [1] M. Lebold et al., Review of vibration analysis methods for gearbox diagnostics and prognostics, 54th MFPT (2000).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import scipy.fft
import xarray as xr

from .errors import SignalError
from .signal import check_teeth, require

SHAFT_ORDERS = (1, 2)


def regular_signal(
    average: xr.DataArray, teeth: int | Sequence[int] | None = None, *, sidebands: int = 1
) -> xr.DataArray:
    """The regular part: shaft orders, mesh harmonics and `sidebands` sidebands on either side of each.

    Parameters
    ----------
    average : xarray.DataArray
        Dimensions (angle, channel), whole revolutions (`time_synchronous_average`).
    teeth : int or sequence, optional
        Tooth count of the wheel on this shaft (the first counts); default the signal's.
    sidebands : int
        How many sidebands belong to the regular part.

    Returns
    -------
    xarray.DataArray
        Dimensions (angle, channel), mean free.
    """
    return _part(average, teeth, sidebands, keep=True)


def difference_signal(
    average: xr.DataArray, teeth: int | Sequence[int] | None = None, *, sidebands: int = 1
) -> xr.DataArray:
    """The average less its mean and its regular part; see `regular_signal` for the parameters."""
    return _part(average, teeth, sidebands, keep=False)


def residual_signal(average: xr.DataArray, teeth: int | Sequence[int] | None = None) -> xr.DataArray:
    """The average less its mean, shaft orders 1 and 2 and mesh harmonics; see `regular_signal` for the parameters."""
    return _part(average, teeth, 0, keep=False)


def regular_orders(teeth: int, highest: float, sidebands: int) -> list[int]:
    """Whole orders of the regular part up to `highest`."""
    orders = set(SHAFT_ORDERS)
    for mesh in range(teeth, int(highest) + teeth + 1, teeth):
        orders.update(range(mesh - sidebands, mesh + sidebands + 1))
    return sorted(k for k in orders if 0 < k <= highest)


def tooth_count(average: xr.DataArray, teeth: int | Sequence[int] | None) -> int:
    """Tooth count of the wheel on the average's shaft, from the call or the signal; error asking for it by name."""
    return require(average, "teeth", teeth, needed_for="separating the mesh from the rest")[0]


def whole_revolutions(average: xr.DataArray) -> int:
    """Revolutions the average covers; SignalError if it is no average or not whole."""
    per_rev = average.attrs.get("samples_per_rev")
    if per_rev is None or "angle" not in average.dims:
        raise SignalError("average: must come from time_synchronous_average (dimensions angle, channel)")
    turns, rest = divmod(average.sizes["angle"], int(per_rev))
    if rest or turns < 1:
        raise SignalError(f"average: covers {average.sizes['angle'] / per_rev:g} revolutions, must be a whole number")
    return turns


def remove_orders(average: xr.DataArray, orders: Iterable[float], *, keep: bool = False) -> xr.DataArray:
    """The average without its mean and the given orders, or (`keep`) only those orders.

    Raises
    ------
    SignalError
        If an order is not one of the average's bins.
    """
    turns = whole_revolutions(average)
    bins = [round(order * turns) for order in orders]
    for order, index in zip(orders, bins):
        if abs(order * turns - index) > 1e-9 * max(1.0, abs(order)):
            raise SignalError(f"orders: {order!r} is not a multiple of 1 / {turns} revolution, average over more turns")
    line = scipy.fft.rfft(average.values, axis=0)
    mask = np.zeros(line.shape[0], dtype=bool)
    mask[[b for b in bins if b < mask.size]] = True
    line[~mask if keep else mask] = 0.0
    line[0] = 0.0
    return average.copy(data=scipy.fft.irfft(line, average.sizes["angle"], axis=0))


def _part(average: xr.DataArray, teeth: int | Sequence[int] | None, sidebands: int, keep: bool) -> xr.DataArray:
    if sidebands < 0:
        raise SignalError(f"sidebands: must not be negative, got {sidebands!r}")
    count = check_teeth(tooth_count(average, teeth))[0]
    if 2 * sidebands + 1 > count:
        raise SignalError(f"sidebands: {sidebands} on either side overlap between the harmonics of {count} teeth")
    whole_revolutions(average)
    return remove_orders(average, regular_orders(count, average.attrs["samples_per_rev"] / 2, sidebands), keep=keep)
