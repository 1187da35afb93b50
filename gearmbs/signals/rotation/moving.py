"""Whether what moves in a record is the shaft whose speed is told, or something beside it.

A line of something else, an inverter, a resonance that grows warm, a neighbour, may move while the shaft is steady.
The shaft is steady where its orders stand still, lines at whole orders of the told speed from the beginning to the end.
But so do those of another machine of the same nominal speed beside a shaft that runs up. What moves tells the two
apart: the strongest moving line is followed, and the record resampled by its phase. There what moves with it stands, at
the ratio of the orders. Two lines and more that are whole orders of the told speed at one moment are the shaft's; a
line alone is, where it passes a whole order (or the mesh's) and hardly moves enough to pass one by chance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.fft
import scipy.interpolate
import scipy.ndimage
import scipy.stats
import xarray as xr

from gearmbs.signals.rotation.angular import interpolate
from gearmbs.signals.rotation.speed import MAINS, MAINS_LINES, MAINS_SHARE, prominence
from gearmbs.signals.signal.signal import rate_of

STANDS_DB = 12.0
"""Height over the floor from which a line of the whole record is looked at."""
MOST_LINES = 24
"""Lines of the record that are looked at, the strongest."""
EIGHTHS, STEADY, WEAKEST = 8, 0.35, 0.2
"""Parts of the record in each of which a line that stands still is there, by so much of its median and largest
amplitude at least:
a line whose frequency is off by half a turn in a part is 0 there, one with a load that varies by half remains."""
EDGE = 2.0
"""Lines of the spectrum by which two frequencies may be off and be one."""
SAME_SPEED = 0.01
"""Share by which the told speed may be off."""
FEWEST_STILL = 3
"""Orders of the shaft that must stand still: two are at whole orders of something by chance."""
CHANCE = 1e-3
"""Probability that so many of the lines that stand still lie on whole orders by chance, for all speeds tried."""
BY_CHANCE = 1.0 / 3.0
"""Turns of the shaft by which a line alone may move, at most, for a whole order that it passes to say that it is the
shaft's: of other lines a third passes one."""
PIECES = 32
"""Pieces of a stretch in which a line is followed."""
FOLLOWED = 6e-3
"""Share of its frequency within which a moving line is followed: three steps of the track."""
LINES_OFF = 1.5
"""The same in lines of the spectra of pieces."""
MIN_QUALITY = 0.2
"""Fifth percentile of the height of a line that is followed, by its RMS."""
ON_ORDER = 0.1
"""Part of an order by which moving lines may miss it."""
MESHES, LOW_ORDERS = 3, 12
"""Mesh harmonics that a line alone may be; and orders below which it is doubted where it passes one that stands."""
ITSELF, SPREAD = 2e-3, 16.0
"""Difference from one up to which a line is the followed one; and the power that a line of one spreads over n has in
the largest of them, by 1/n of it."""
LEAST, SAMPLED = 2.5e-3, 256
"""Part of the moving line's power from which others are looked at, -26 dB; and points at which its speed is taken."""


class Moving(NamedTuple):
    """The strongest moving line, Hz from the least to the largest, and by it what moves with it, itself included.

    In a stretch, a part of the record.
    """

    low: float
    high: float
    ratios: tuple[float, ...]


def standing_lines(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lines (cycles of a record, shape (n, channels)) that are there all along, and their power."""
    values = values - values.mean(axis=0)
    power = np.abs(scipy.fft.rfft(values * np.hanning(len(values))[:, None], axis=0)) ** 2
    best = power / np.maximum(power.max(axis=0), 1e-300)
    height, level = prominence(power).max(axis=1), best.max(axis=1)
    inner = (level[1:-1] > level[:-2]) & (level[1:-1] >= level[2:]) & (height[1:-1] >= STANDS_DB)
    peaks = 1 + np.flatnonzero(inner)
    peaks = peaks[np.argsort(level[peaks])[::-1][:MOST_LINES]]
    still = [int(at) for at in peaks if _stands_still(values[:, int(np.argmax(best[at]))], int(at))]
    return np.array(still, dtype=float), power.max(axis=1)[still]


def _stands_still(values: np.ndarray, line: int) -> bool:
    length = len(values) // EIGHTHS
    cycles = line / len(values)
    rotating = np.exp(-2j * math.pi * cycles * np.arange(length)) * np.hanning(length)
    parts = np.abs(values[: EIGHTHS * length].reshape(EIGHTHS, length) @ rotating)
    return bool(parts.min() >= max(STEADY * np.median(parts), WEAKEST * parts.max()))


def still_orders(signal: xr.DataArray, speed: float) -> list[int]:
    """Return the orders of a shaft at whose lines a record stands still, if these are no chance; else an empty list.

    Multiples of the mains stand still whatever the shaft does, and count for nothing.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    speed : float
        Told, rad/s.
    """
    rate, n, turn = rate_of(signal), signal.sizes["time"], speed / math.tau
    width = rate / n
    if turn < EIGHTHS * EDGE * width or turn > rate / 8.0:
        return []
    still = standing_lines(signal.values)[0] * width
    still = still[still > 0.5 * turn]
    mains = [
        abs(f / m - round(f / m)) * m <= MAINS_SHARE * f + EDGE * width and f / m < MAINS_LINES + 0.5
        for f in still
        for m in MAINS
    ]
    still = still[~np.array(mains, dtype=bool).reshape(-1, len(MAINS)).any(axis=1)]
    if still.size < FEWEST_STILL:
        return []
    step = width / (still.max() / turn)
    tried = turn + step * np.arange(-math.ceil(SAME_SPEED * turn / step), math.ceil(SAME_SPEED * turn / step) + 1)
    orders = np.rint(still[:, None] / tried)
    on = np.abs(still[:, None] - orders * tried) <= EDGE * width
    k = int(np.argmax(on.sum(axis=0)))
    found = on[:, k].sum()
    part = min(1.0, 2.0 * EDGE * width / turn)
    if found < FEWEST_STILL or tried.size * scipy.stats.binom.sf(found - 1, still.size, part) > CHANCE:
        return []
    return sorted({int(order) for order in orders[on[:, k], k]})


def moving(values: np.ndarray, rate: float, cells: np.ndarray, place: np.ndarray, up: bool) -> Moving | None:
    """Return the strongest line that moves in a stretch, and what moves with it; None where none can be followed.

    Parameters
    ----------
    values : ndarray of shape (n, channels)
        Of the stretch.
    rate : float
        Hz.
    cells : ndarray of shape (pieces, m)
        What moves, over frequency, in pieces of the stretch.
    place : ndarray of shape (m,)
        Frequencies of the cells, Hz, evenly spaced by their logarithms.
    up : bool
        The way it moves.
    """
    track = _track(cells if up else cells[:, ::-1])
    track = track if up else cells.shape[1] - 1 - track
    time = (np.arange(len(cells)) + 0.5) / len(cells) * len(values) / rate
    log = np.log(place[track])
    # rounded to cells
    smooth = np.polynomial.Polynomial.fit(time, log, 3)
    for _ in range(2):
        near = np.abs(log - smooth(time)) <= max(FOLLOWED, 2.0 * float(np.median(np.abs(log - smooth(time)))))
        if near.sum() < len(cells) // 2:
            return None
        smooth = np.polynomial.Polynomial.fit(time[near], log[near], 3)
    course = np.exp(smooth(np.arange(len(values)) / rate))
    if not 0.0 < course.min() <= course.max() < 0.45 * rate:
        return None
    half = max(FOLLOWED * float(course.mean()), LINES_OFF * PIECES * rate / len(values))
    cycles = _followed(values, rate, course, half)
    if cycles is None:
        return None
    step = max(1, len(values) // SAMPLED)
    speed = np.gradient(cycles[::step])[2:-2] * rate / step
    if np.abs(speed - course[::step][2:-2]).max() > 2.0 * half:
        # other lines have taken its phase away
        return None
    low, high = float(speed.min()), float(speed.max())
    ratios, power = _with_it(values, cycles)
    clear = power > LEAST * power[np.abs(ratios - 1.0) < ITSELF].max(initial=0.0)
    # what stands is spread over moving cycles; of few lines, or of much power, it is one there
    standing, height = standing_lines(values)
    spread = standing * (high - low) / (high + low) * 2.0
    standing = standing * rate / len(values)
    inside = (standing > ratios[:, None] * low * (1.0 - SAME_SPEED)) & (
        standing < ratios[:, None] * high * (1.0 + SAME_SPEED)
    )
    left = np.where(inside, SPREAD * height / np.maximum(spread, 1.0), 0.0).max(axis=1, initial=0.0)
    kept = clear & (power > left)
    return Moving(low, high, tuple(float(r) for r in np.sort(ratios[kept])))


def _track(cells: np.ndarray) -> np.ndarray:
    """Return the cell of each piece on the best way up."""
    reach = max(1, cells.shape[1] // len(cells))
    score = np.empty_like(cells)
    score[0] = cells[0]
    for j in range(1, len(cells)):
        # the best of the cells up to `reach` below
        score[j] = cells[j] + scipy.ndimage.maximum_filter1d(score[j - 1], reach + 1, origin=reach // 2)
    at = np.empty(len(cells), dtype=int)
    at[-1] = int(np.argmax(score[-1]))
    for j in range(len(cells) - 2, -1, -1):
        low = max(0, at[j + 1] - reach)
        at[j] = low + int(np.argmax(score[j, low : at[j + 1] + 1]))
    return at


def _followed(values: np.ndarray, rate: float, course: np.ndarray, half: float) -> np.ndarray | None:
    """Return the cycles of a line within so many Hz of a course over the samples, or None where it is lost."""
    cycles = np.cumsum(course) / rate
    block = max(1, int(rate / (8.0 * half)))
    count = len(values) // block
    if count < 4 * EIGHTHS:
        return None
    rotating = np.exp(-2j * math.pi * cycles[: count * block])
    window = np.hanning(9)[1:-1] / np.hanning(9).sum()
    best, phase = 0.0, None
    for column in values.T:
        slow = ((column[: count * block] - column.mean()) * rotating).reshape(count, block).mean(axis=1)
        slow = np.convolve(slow, window, mode="same")
        size = np.abs(slow[4:-4])
        quality = float(np.percentile(size, 5.0) / max(np.sqrt(np.mean(size**2)), 1e-300))
        if quality > best:
            best, phase = quality, np.unwrap(np.angle(slow))
    if phase is None or best < MIN_QUALITY:
        return None
    at = (np.arange(count) + 0.5) * block - 0.5
    found = cycles + np.interp(np.arange(len(values)), at, phase) / (2.0 * math.pi)
    return found if np.all(np.diff(found) > 0.0) else None


def _with_it(values: np.ndarray, cycles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what stands over the cycles of a line, by its frequency, and its power; 1 is the line itself."""
    total = float(cycles[-1] - cycles[0])
    even = np.interp(cycles[0] + total * np.arange(len(values)) / len(values), cycles, np.arange(len(values)))
    even = np.clip(even, 0.0, len(values) - 1.0)
    warped = np.stack([interpolate(np.ascontiguousarray(column), even) for column in values.T], axis=1)
    found, power = standing_lines(warped)
    return found / total, power


def is_the_shafts(
    found: Moving, speed: float, still: Sequence[int], teeth: Sequence[int] = (), part: float = 1.0
) -> bool:
    """Return whether what moves may be the shaft of a told speed (rad/s), orders of which stand still.

    Parameters
    ----------
    found : Moving
    speed : float
    still : sequence of int
    part : float
        Of the record, in which the line was followed; beyond, it is taken to go on as it does there.
    teeth : sequence of int
        Of the wheel on the shaft, where they are known.
    """
    turn = speed / math.tau
    beyond = (found.high - found.low) * (1.0 / part - 1.0) + SAME_SPEED * found.high
    low, high = max(0.0, found.low - beyond) / turn, (found.high + beyond) / turn
    ratios = np.array([1.0, *(r for r in found.ratios if abs(r - 1.0) > ITSELF)])
    if ratios.size > 1:
        # the order of the line itself at one moment
        step = 0.1 * ON_ORDER / max(1.0, float(ratios.max()))
        orders = ratios[:, None] * np.arange(low, high + step, step)
        on = (np.abs(orders - np.rint(orders)) <= ON_ORDER) & (orders > 0.5)
        return bool(on.all(axis=0).any())
    for z in teeth[:1]:
        mesh = [z * h for h in range(1, MESHES + 1)]
        if any(low <= order <= high for order in mesh) and not set(mesh) & set(still):
            return True
    if any(low <= order <= high for order in still if order <= LOW_ORDERS):
        # among lines a turn apart one alone is not followed surely
        return True
    return math.floor(high) >= math.ceil(low) and found.high - found.low <= BY_CHANCE * turn
