"""Samples that are missing or not finite: refused, interpolated, or cut out, and said."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from .errors import SignalError

Gaps = Literal["refuse", "interpolate", "longest"]
CHOICES = get_args(Gaps)
REMEDY = "pass gaps='interpolate' or gaps='longest' (--gaps), or cut or repair the record first"


def checked_gaps(gaps: str | None) -> str:
    """`gaps` as one of the choices; SignalError for any other."""
    if gaps is None:
        return "refuse"
    if gaps not in CHOICES:
        raise SignalError(f"gaps: must be one of {', '.join(CHOICES)}, got {gaps!r}")
    return gaps


def without_gaps(values: np.ndarray, gaps: str | None, rate: float | None = None) -> tuple[np.ndarray, int, list[str]]:
    """Samples without gaps, the index of the first that is kept, and what was done in words.

    Parameters
    ----------
    values : ndarray of shape (n, channels)
    gaps : {"refuse", "interpolate", "longest"} or None
        "refuse" (None): an error. "interpolate": straight lines across each gap, ends without a sample on one side cut
        off. "longest": the longest stretch in which no channel has a gap.
    rate : float, optional
        Sampling rate in Hz, for the words.

    Raises
    ------
    SignalError
        If there are gaps and `gaps` is "refuse", or nothing is left.
    """
    how = checked_gaps(gaps)
    bad = ~np.isfinite(values)
    if not bad.any():
        return values, 0, []
    row, column = (int(i) for i in np.argwhere(bad)[0])
    count = int(bad.any(axis=1).sum())
    if how == "refuse":
        raise SignalError(
            f"data: {int(bad.sum())} samples are not finite, the first at row {row}, channel {column}; {REMEDY}"
        )
    if bad.all(axis=0).any():
        raise SignalError(f"gaps: channel {int(np.argmax(bad.all(axis=0)))} holds no sample at all; leave it out")
    if how == "longest":
        good = np.concatenate(([False], ~bad.any(axis=1), [False]))
        turns = np.flatnonzero(np.diff(good.astype(int)))
        if not turns.size:
            raise SignalError("gaps: no row has a sample in every channel; choose channels")
        starts, stops = turns[::2], turns[1::2]
        k = int(np.argmax(stops - starts))
        first, last = int(starts[k]), int(stops[k])
        words = f"Only the longest stretch without gaps is used: samples {first} to {last - 1} of {len(values)}."
        return values[first:last], first, [words]
    filled = values.copy()
    first = int(max(np.argmin(bad[:, c]) for c in range(values.shape[1])))
    last = int(min(len(values) - np.argmin(bad[::-1, c]) for c in range(values.shape[1])))
    if last <= first:
        raise SignalError("gaps: no time at which every channel has samples; choose channels")
    at = np.arange(len(values))
    longest = 0
    for c in range(values.shape[1]):
        good = ~bad[:, c]
        filled[:, c] = np.interp(at, at[good], values[good, c])
        edges = np.flatnonzero(np.diff(np.concatenate(([0], bad[first:last, c].astype(int), [0]))))
        longest = max(longest, int((edges[1::2] - edges[::2]).max(initial=0)))
    span = "" if rate is None else f" ({longest / rate:.3g} s)"
    words = (
        f"{count} of {len(values)} rows had gaps, filled by straight lines; the longest gap is {longest} samples{span}."
    )
    return filled[first:last], first, [words]
