"""Times of samples in s, whatever their unit: numbers with a unit, in parts of s since 1970, dates and differences."""

from __future__ import annotations

import re

import numpy as np

WORDS: dict[float, str] = {
    1.0: "s sec secs second seconds sekunde sekunden",
    1e-3: "ms msec msecs millis millisec milliseconds millisecond",
    1e-6: "us usec µs μs microsec microseconds microsecond",
    1e-9: "ns nsec nanosec nanoseconds nanosecond",
    60.0: "min mins minute minutes minuten",
    3600.0: "h hr hrs hour hours stunden",
    86400.0: "d day days tage",
}
SECONDS = {word: factor for factor, words in WORDS.items() for word in words.split()}
"""s of the units of times, in lower case."""
SUFFIX = re.compile(r"(?:[_\s]|(?<=time)|(?<=temps))(s|sec|ms|us|µs|μs|ns|min)$", re.IGNORECASE)
"""Unit at the end of a name, as in t_ms and timeMs."""
EPOCHS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))
"""Numbers this large are not seconds since 1970 but parts of them."""
LARGEST = 1e8
"""s that leave too few digits for the fraction."""


def unit_in_name(name: str) -> str:
    """Return the unit at the end of the name of a column of times, "" without one.

    Examples
    --------
    >>> [unit_in_name(name) for name in ("t_ms", "timeUs", "time", "items")]
    ['ms', 'us', '', '']
    """
    found = SUFFIX.search(name)
    return "" if found is None else found.group(1).lower()


def seconds_of(unit: str, name: str = "") -> float | None:
    """Return how many s a unit of times is; without a unit the one in the name, or 1. None of what is no unit of times.

    Examples
    --------
    >>> seconds_of("ms"), seconds_of("", "t_us"), seconds_of("unknown", "time"), seconds_of("mm")
    (0.001, 1e-06, 1.0, None)
    """
    low = unit.strip().lower().partition(" since ")[0]
    if low in ("", "unknown"):
        low = unit_in_name(name) or "s"
    return SECONDS.get(low)


def in_seconds(times: np.ndarray, unit: str = "", name: str = "", origin: float | None = None) -> np.ndarray:
    """Return times in s: dates from the first one on, and numbers by their unit.

    Parameters
    ----------
    times : ndarray of shape (n,)
        Numbers, dates or differences of time.
    unit, name : str, optional
        Those of a column of numbers, see `seconds_of`; s where they tell none. Numbers too large for s since 1970 are
        the parts of s that they must be; such times, and s since 1970, begin at zero.
    origin : float, optional
        Where these begin at instead, in their own unit.

    Returns
    -------
    ndarray of shape (n,)
        s.

    Examples
    --------
    >>> in_seconds(np.array([0.0, 2.0]), "ms").tolist(), in_seconds(np.array([1.7e12, 1.7e12 + 5.0])).tolist()
    ([0.0, 0.002], [0.0, 0.005])
    """
    times = np.asarray(times)
    if times.dtype.kind == "M":
        times = times - times[:1]
    if times.dtype.kind == "m":
        missing = np.isnat(times)
        return np.where(missing, np.nan, times.astype("timedelta64[ns]").astype(float) * 1e-9)
    factor = seconds_of(unit, name) or 1.0
    largest = float(np.nanmax(np.abs(times.astype(float)), initial=0.0))
    if factor == 1.0:
        factor = next((part for limit, part in EPOCHS if largest > limit), 1.0)
    # whole numbers of ns have more digits than a float
    begin = times[:1] if origin is None else origin
    return (times - begin) * factor if largest * factor > LARGEST else times.astype(float) * factor


ROUNDED_STEP = 0.6
"""Steps by which rounded times may be off even ones: half of one, and what the last one is."""


def rate_about_even(clock: np.ndarray) -> float | None:
    """Return the rate (Hz) of times (s) that are even but for rounding, or None of others."""
    span = float(clock[-1] - clock[0])
    even = clock[0] + span * np.linspace(0.0, 1.0, clock.size)
    step = span / max(1, clock.size - 1)
    return 1.0 / step if step > 0.0 and bool(np.abs(clock - even).max() < ROUNDED_STEP * step) else None
