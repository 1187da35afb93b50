"""Values of a sampled record between its samples: doubled in rate by a FIR filter, then quintic B-splines.

The spline's relative error at frequency f is about (f / (2 rate - f))^6 on the doubled rate: 3e-5 at a quarter, 2e-4 at
0.4 of the sampling rate. Work proceeds in blocks, so scratch memory does not grow with the record.
"""

from __future__ import annotations

import numpy as np
import scipy.ndimage
import scipy.signal as ss

from .filters import kaiser_taps

BLOCK = 1 << 16
MARGIN = 96
DEGREE = 5
DOUBLING = kaiser_taps(0.5, 0.1, 2.0, "lowpass", 100.0)


def interpolate(column: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Values at increasing fractional sample `positions`, 0 <= position <= n - 1.

    Parameters
    ----------
    column : ndarray of shape (n,)
    positions : ndarray of shape (m,), increasing

    Returns
    -------
    ndarray of shape (m,)
    """
    n = column.size
    out = np.empty(positions.size)
    start = 0
    while start < positions.size:
        first = int(positions[start])
        stop = int(np.searchsorted(positions, first + BLOCK, side="left"))
        stop = max(stop, start + 1)
        last = int(np.ceil(positions[stop - 1]))
        low, high = first - MARGIN, last + MARGIN + 1
        piece = column[max(low, 0) : min(high, n)]
        before, after = min(max(-low, 0), piece.size - 1), min(max(high - n, 0), piece.size - 1)
        piece = np.concatenate((2 * piece[0] - piece[before:0:-1], piece, 2 * piece[-1] - piece[-2 : -after - 2 : -1]))
        fine = ss.resample_poly(piece, 2, 1, window=DOUBLING, padtype="line")
        origin = max(low, 0) - before
        at = 2.0 * (positions[start:stop] - origin)
        out[start:stop] = scipy.ndimage.map_coordinates(fine, at[None, :], order=DEGREE, mode="mirror")
        start = stop
    return out
