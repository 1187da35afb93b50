"""Whether the lines of a record move up or down in it, as those of a run-up or a coast-down do.

The record is cut into pieces. What stands still, structural resonances, the mains, and all lines of a steady machine,
is in the median over the pieces of their spectra and is taken off. Over the logarithm of frequency all orders of a
shaft whose speed changes move by the same amount, so that pieces are correlated with later ones over such shifts. In a
run-up the best shift up is better than the best one down, and than none, in hardly varying measure from pair to pair;
Student's t over the pairs tells it from chance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy.fft
import xarray as xr

from gearmbs.signals.rotation.moving import PIECES, is_the_shafts, moving, still_orders
from gearmbs.signals.rotation.speed import CLIP_DB, FLOOR_BINS, RANGE_DB
from gearmbs.signals.signal.signal import rate_of
from gearmbs.signals.spectra import periodograms

APART = {16: (1, 2), 32: (1, 2, 4, 8)}
"""Numbers of pieces, and how many later those are that each is compared with: fast changes show in neighbours, slow
ones in others. There are 14 pairs at least."""
STRETCHES = ((0, 8), (0, 4), (4, 8), (2, 6), (0, 2), (2, 4), (4, 6), (6, 8))
"""Eighths of the record that are looked at: a machine may run steadily before and after, or down again."""
LEAST_PIECE, LONGEST_PIECE = 512, 1 << 14
"""Samples: a spectrum of some hundred lines; and as many as tell a thousandth at a sixteenth of the rate."""
FIRST_LINE = 8
TOP = 0.9
"""Part of half the rate up to which lines count."""
STEP, FARTHEST = 2e-3, 0.35
"""Step of the logarithm of frequency, and the largest shift from one piece to another: by two fifths."""
STILL = 2
"""Steps up to which a shift is none."""
SURE = 6.0
"""Student's t from which lines move. Of 154 public recordings of bearings and gears at one speed, and 120 made ones
(loads that vary, knocks, speeds that wobble by 0.5 %) one reaches 5.1, all others stay below 4.5. A mesh that runs up
by 4 % in 125 turns reaches 13, eleven orders of a shaft by 10 % in as many 6."""

FOLLOWED, BESIDE = 0.225, 0.4
"""Turns of the shaft: up to the first the phase of a mesh line is followed, filter's slope included; what a speed that
wobbles more throws beside the line is looked for from there to the second, before sidebands of most mates."""
WANDER_TURNS = 50
"""Turns whose spectrum is looked at: a wobble of a fiftieth of a turn's rate and slower fills the lines beside."""
FILLED = 35.0
"""Percentile of the lines beside that counts: the sideband of a mate, with its flanks, fills fewer than half."""
WANDER, CLEAR = 7e-4, 10.0
"""Part of the line's power beside it, and that over the floor, from which the line is not followed. Of 120 made records
(20, 32 and 50 teeth, wobbles of 0 to 1 % at 0.5 to 2 Hz, two levels of noise, sidebands) averages that keep 0.94 and
more of the mesh have at most 5.4e-4, those that keep 0.71 and less 1e-3 and more at 33 times the floor; there are none
between. In noise alone it is 0.8 to 1.5 times the floor, in four measured records at most 3."""
LISTED = 8
"""Orders that stand still, named."""
FEWEST_LINES = 6
"""Lines of a spectrum of which a percentile and a median are taken."""


def moving_lines(signal: xr.DataArray) -> str | None:
    """Return whether lines of a record move "up" or "down" in it or in a part of it; None if they do not.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    """
    found = _best(signal)
    return None if found is None else found[0]


def _best(signal: xr.DataArray) -> tuple[str, np.ndarray] | None:
    """Return the way lines move, and the values of the stretch where it is the surest."""
    eighth = signal.sizes["time"] // 8
    found = [
        (*each, first, last)
        for first, last in STRETCHES
        for pieces in APART
        if (last - first) * eighth // pieces >= LEAST_PIECE
        for each in _shifts(signal.values[first * eighth : last * eighth], pieces)
    ]
    t, way, first, last = max(found, default=(0.0, "", 0, 0))
    return (way, signal.values[first * eighth : last * eighth]) if t >= SURE else None


def _shifts(values: np.ndarray, pieces: int) -> list[tuple[float, str]]:
    """Return Student's t of a shift, the less sure of two, and its way, for each distance of pieces."""
    lines = _lines(values, pieces)
    size = scipy.fft.next_fast_len(2 * lines.shape[1])
    spectra = scipy.fft.rfft(lines, size, axis=1)
    most = round(FARTHEST / STEP)
    shift = np.arange(-most, most + 1)
    found = []
    for apart in APART[pieces]:
        alike = scipy.fft.irfft(spectra[:-apart].conj() * spectra[apart:], size, axis=1)
        alike = np.concatenate((alike[:, -most:], alike[:, : most + 1]), axis=1)
        up, down, none = (
            alike[:, where].max(axis=1) for where in (shift > STILL, shift < -STILL, np.abs(shift) <= STILL)
        )
        moved, back, way = (up, down, "up") if up.sum() > down.sum() else (down, up, "down")
        found.append((min(_student(moved - back), _student(moved - none)), way))
    return found


def _student(values: np.ndarray) -> float:
    """Return Student's t of the mean of some values."""
    return float(values.mean()) * math.sqrt(values.size) / max(float(values.std(ddof=1)), 1e-12)


def _lines(values: np.ndarray, pieces: int) -> np.ndarray:
    """Return heights of what does not stand still over the logarithm of frequency, of length one for each piece."""
    cells = _cells(values, pieces)[0]
    cells = cells - cells.mean(axis=1, keepdims=True)
    return cells / np.maximum(np.linalg.norm(cells, axis=1, keepdims=True), 1e-12)


def _cells(values: np.ndarray, pieces: int) -> tuple[np.ndarray, np.ndarray]:
    """Return heights of what does not stand still in pieces, dB, and the cycles of a sample that they are of."""
    whole = len(values) // pieces
    length = min(whole, LONGEST_PIECE)
    window = np.hanning(length)[:, None]
    first = (whole - length) // 2
    cut = values[: pieces * whole].reshape(pieces, whole, -1)[:, first : first + length]
    power = np.abs(scipy.fft.rfft((cut - cut.mean(axis=1, keepdims=True)) * window, axis=1)) ** 2
    heights = _heights(power)
    moving = np.maximum(heights - np.median(heights, axis=0), 0.0)
    last = int(TOP * (moving.shape[1] - 1))
    place = np.exp(np.arange(math.log(FIRST_LINE), math.log(last), STEP))
    low = np.rint(place * math.exp(-0.5 * STEP)).astype(int)
    high = np.maximum(np.rint(place * math.exp(0.5 * STEP)).astype(int), low + 1)
    return np.maximum.reduceat(moving, np.stack((low, high), axis=1).ravel()[:-1], axis=1)[:, ::2], place / length


def _heights(power: np.ndarray) -> np.ndarray:
    """Return heights in dB over neighbourhoods, mean over channels, of power of shape (pieces, m, channels)."""
    blocks = power.shape[1] // FLOOR_BINS
    least = np.maximum(10.0 ** (-0.1 * RANGE_DB) * power.max(axis=1, keepdims=True), 1e-300)
    level = 10.0 * np.log10(np.maximum(power[:, : blocks * FLOOR_BINS], least))
    level = level.reshape(power.shape[0], blocks, FLOOR_BINS, -1)
    heights = np.clip(level - np.median(level, axis=2, keepdims=True), 0.0, CLIP_DB)
    return heights.mean(axis=3).reshape(power.shape[0], -1)


def remark_sweep(signal: xr.DataArray, speed: float, teeth: Sequence[int] = ()) -> list[str]:
    """Return what is to be said where the lines of a record move and one speed (rad/s) is taken for all of it.

    What moves beside a shaft whose own orders stand still is told as that (`gearmbs.signals.rotation.moving`).
    """
    return [words for words, _ in swept(signal, speed, teeth)]


def swept(signal: xr.DataArray, speed: float, teeth: Sequence[int] = ()) -> list[tuple[str, bool]]:
    """Return the same, with whether the shaft's speed is in doubt by it."""
    found = _best(signal)
    if found is None:
        return []
    way, values = found
    still = still_orders(signal, speed)
    if still and len(values) // PIECES >= LEAST_PIECE:
        rate = rate_of(signal)
        cells, place = _cells(values, PIECES)
        line = moving(values, rate, cells, rate * place, way == "up")
        if line is not None and not is_the_shafts(line, speed, still, teeth, len(values) / signal.sizes["time"]):
            a, b = (line.low, line.high) if way == "up" else (line.high, line.low)
            orders = ", ".join(map(str, still[:LISTED]))
            return [(
                f"A line moves {way} in the record, from {a:.4g} to {b:.4g} Hz, while the shaft's orders {orders} "
                "stand still: something else, as a drive, another machine or what grows warm. If it is the shaft's, "
                "give the speed over time.", False,
            )]  # fmt: skip
    words = (
        f"CHECK THE SPEED: lines of the record move {way} in it, as in a {'run-up' if way == 'up' else 'coast-down'}, "
        f"and one speed is taken for all of it, {speed * 30.0 / math.pi:.1f} rpm. Give the speed over time (speed="
        "[('0 s', '900 rpm'), ...], --speed with a file), a channel of it (speed_channel=, --speed-channel) or a tacho."
    )
    return [(words, True)]


def remark_wander(signal: xr.DataArray, speed: float, count: int) -> list[str]:
    """Return what is to be said where the mesh line by which the angle was followed (rad/s, teeth) wobbles too much.

    The phase of a line is known within a band about it. A speed that wobbles by more spreads the line beyond the band,
    evenly, and the angle loses whole cycles of the mesh without a gap.
    """
    rate, turn = rate_of(signal), speed / math.tau
    length = min(signal.sizes["time"], round(WANDER_TURNS / turn * rate))
    power, _ = periodograms(signal.values, rate, length, "hann", 0.5, True, "power")
    off = np.arange(power.shape[0]) * rate / length / turn - count
    far = (np.abs(off) > 0.6) & (np.abs(off) < 3.4) & (np.abs(off - np.rint(off)) > 0.3)
    if far.sum() < FEWEST_LINES:
        return []
    floor = np.median(power[far], axis=0)
    near = np.abs(off) < 0.6
    above = np.maximum(power[near] - floor, 0.0)
    for channel, weight in enumerate(above.T):
        if not weight.sum() > 0.0:
            continue
        # the speed that was followed may be the wobble's extreme; what is even about the middle shows about the middle
        middle = np.abs(off - weight @ off[near] / weight.sum())
        beside, line = (middle > FOLLOWED) & (middle < BESIDE), power[middle <= FOLLOWED, channel].sum()
        if beside.sum() < FEWEST_LINES:
            return []
        filled = np.percentile(power[beside, channel], FILLED)
        if filled < CLEAR * floor[channel] or filled * beside.sum() < WANDER * line:
            return []
    return [
        f"CHECK THE SPEED: it wobbles by more than the mesh line can be followed by ({100.0 * FOLLOWED / count:.2g} % "
        f"of {speed * 30.0 / math.pi:.1f} rpm), so that averages, orders and what is made of them cannot be trusted. "
        "Give a tacho, or the speed over time."
    ]
