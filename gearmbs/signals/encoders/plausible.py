"""Whether what stands out of a record is at the mesh orders that the told teeth and lines say.

A pair of equal wheels turns with one ratio whatever its teeth are, and two discs of one count show that ratio whatever
the count is told to be. The mesh itself knows better: where it stands out of marks and noise it does so at an order and
at multiples of it. If these are others than the told ones, one of the numbers is wrong. Where the marks hide it, they
know themselves: those of a disc that is told for twice its lines repeat after half a turn of the told ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy.fft

from gearmbs.signals.encoders.marks import ECCENTRIC, SIDEBANDS, encoder_marks
from gearmbs.signals.encoders.orders import Deviations, Gearing, folded
from gearmbs.signals.encoders.pulses import TURN, PulseTrain

STANDS = 4.0
"""Times the median of the largest lines beside it, one for each order, from which a line is the mesh's: of chance, with
marks or without, one in some thousands is."""
BESIDE, MODULATED = 8, 2
"""Orders to either side that say what is usual, and those next to a line that its modulation by the shafts may have."""
FEWEST_TEETH = 5
"""Orders below are the shafts' own."""
SEEN = 0.4
"""Share of the lines up to which straight lines between the pulses show an order."""
MULTIPLES = 3
CANDIDATES = 12
WIDTH = 1.5
"""Lines of the spectrum by which an order may seem to be off."""
TIMES = (2, 3, 4)
"""Counts that are told for so many times the true one: both edges of a pulse, or of two tracks, are counted so."""
REPEATED, FEWEST_ORDERS = 0.1, 16
"""Share of the errors' power between the multiples of an order, by that at them, from which on marks repeat: medians of
sixteen orders each, exponentially distributed, are so far apart by chance once in some hundred thousand discs."""


def doubted_numbers(
    first: Deviations, second: Deviations, begin: float, end: float, gearing: Gearing, lines: Sequence[int]
) -> str | None:
    """Return what is wrong with the told teeth and lines, or None.

    Parameters
    ----------
    first, second : Deviations
        Of both shafts, as angles of the first.
    begin, end : float
        Stretch of the common angle, rad.
    gearing : Gearing
    lines : (int, int)
    """
    turns = (end - begin) / TURN
    limit = SEEN * min(lines[0], lines[1] / float(gearing.ratio))
    told = float(gearing.mesh)
    if limit < 2.0 * FEWEST_TEETH or told > limit:
        return None
    amplitude = _spectrum(first, second, begin, turns, limit)
    width = WIDTH / turns

    def line(order: float) -> int:
        low, high = (max(0, round((order + side) * turns)) for side in (-width, width))
        return low + int(np.argmax(amplitude[low : high + 1]))

    usual = _usual(amplitude, turns)

    def stands(order: float) -> bool:
        at = round(order)
        return order <= limit and at < usual.size and amplitude[line(order)] > STANDS * usual[at]

    inner = amplitude[1:-1]
    peaks = 1 + np.flatnonzero((inner > amplitude[:-2]) & (inner >= amplitude[2:]))
    peaks = peaks[(peaks >= FEWEST_TEETH * turns) & (peaks <= 0.5 * limit * turns)]
    peaks = peaks[np.argsort(amplitude[peaks])[::-1][:CANDIDATES]]
    families = []
    for peak in peaks / turns:
        own = [k for k in range(1, MULTIPLES + 1) if stands(k * peak)]
        if own[:1] == [1] and len(own) > 1:
            exact = line(own[-1] * peak) / turns / own[-1]
            families.append((sum(amplitude[line(k * peak)] for k in own), exact, own[-1]))
    if not families:
        return None
    _, found, count = max(families)
    times, part = found / told, told / found
    # the highest multiple tells it best
    if abs(found - told) <= width / count:
        return None
    # the mesh beyond half the lines is seen where it is folded to
    if any(
        abs(found - folded(k * told, n)) <= width for n in lines for k in range(1, 2 * MULTIPLES) if k * told > n / 2
    ):
        return None
    if stands(told) and abs(found - told) > 2.0 * width and not _whole(part, width / found):
        return None
    if _whole(times, width / told) and (
        count < MULTIPLES or any(stands(k * told) for k in (1, 3, 5) if k % round(times))
    ):
        return None
    return _words(found, told, gearing, lines, turns * count)


def repeating_marks(trains: Sequence[PulseTrain], mesh: Sequence[float]) -> str | None:
    """Return what the marks of some discs say against the told lines: that they repeat after a part of a turn; or None.

    Parameters
    ----------
    trains : sequence of PulseTrain
    mesh : sequence of float
        Told mesh order of each shaft, about whose multiples nothing is taken for marks.
    """
    found = [_repetitions(train, order) for train, order in zip(trains, mesh, strict=True)]
    words = [
        f"marks of the {train.name!r} repeat {times} times in a turn of {train.lines} lines (between, errors have "
        f"{share:.2g} of their power)"
        for train, (times, share) in zip(trains, found, strict=True)
        if times > 1
    ]
    if not words:
        return None
    counts = " and ".join(str(train.lines // times) for train, (times, _) in zip(trains, found, strict=True))
    return f"CHECK THE LINES AND TEETH: {'; '.join(words)}; discs of {counts} lines would explain it."


def _repetitions(train: PulseTrain, mesh: float) -> tuple[int, float]:
    """Return how often marks repeat in a told turn, 1 if they do not, and what share of their power does not.

    Errors of marks have no reason to repeat, so that all orders of their disc have some; where more lines are told than
    there are, orders of the told turn that are none of the true one have noise alone.
    """
    power = np.abs(scipy.fft.rfft(encoder_marks(train).errors)) ** 2
    orders = np.arange(ECCENTRIC + 1, (train.lines + 1) // 2)
    orders = orders[np.abs((orders + 0.5 * mesh) % mesh - 0.5 * mesh) > SIDEBANDS]
    for times in sorted((n for n in TIMES if train.lines % n == 0), reverse=True):
        # those of half as many repetitions stand between, too
        classes = [power[orders[orders % times == k]] for k in range(times)]
        if min(each.size for each in classes) < FEWEST_ORDERS:
            continue
        at, *between = (float(np.median(each)) for each in classes)
        if max(between) < REPEATED * at:
            return times, max(between) / at
    return 1, 1.0


def _spectrum(first: Deviations, second: Deviations, begin: float, turns: float, limit: float) -> np.ndarray:
    """Return the amplitudes of the lag over orders, `turns` lines an order."""
    count = 2 * math.ceil(limit / SEEN * turns)
    phi = begin + TURN * turns * np.arange(count) / count
    lag = np.interp(phi, first.phi, first.values) - np.interp(phi, second.phi, second.values)
    window = 0.5 - 0.5 * np.cos(TURN * np.arange(count) / count)
    seen = np.abs(scipy.fft.rfft(window * (lag - lag.mean()))) * (4.0 / count)
    return seen[: math.ceil((limit + 1.0) * turns)]


def _usual(amplitude: np.ndarray, turns: float) -> np.ndarray:
    """Return for each whole order the median of the largest lines of the orders beside it."""
    edges = np.round((np.arange(math.floor(amplitude.size / turns)) + 0.5) * turns).astype(int)
    largest = np.array([amplitude[a:b].max() for a, b in pairwise(edges) if b > a])
    # the first of them is that of order 1
    out = np.full(largest.size + 1, np.inf)
    for k in range(1, out.size):
        near = np.arange(max(1, k - BESIDE), min(out.size, k + BESIDE + 1))
        near = near[np.abs(near - k) > MODULATED]
        out[k] = float(np.median(largest[near - 1])) if near.size else np.inf
    return out


def _whole(value: float, within: float) -> bool:
    """Return whether a quotient is a whole number above one."""
    return value > 1.5 and abs(value - round(value)) <= within * value


def _words(found: float, told: float, gearing: Gearing, lines: Sequence[int], turns: float) -> str:
    teeth = (found, found * float(gearing.ratio))
    counts = [n * told / found for n in lines]
    known = 1.0 / turns
    remedies = []
    if all(abs(z - round(z)) < known * max(1.0, float(gearing.ratio)) for z in teeth):
        remedies.append(f"teeth of {round(teeth[0])} and {round(teeth[1])}")
    if all(abs(n - round(n)) < 0.25 + n * known / found for n in counts):
        remedies.append(f"discs of {round(counts[0])} and {round(counts[1])} lines")
    would = f"; {' or '.join(remedies)} would explain it" if remedies else ""
    return (
        f"CHECK THE LINES AND TEETH: lines stand out at order {found:.5g} of the driver and its multiples, as a mesh's "
        f"do, and not at the told {told:.5g}{would}."
    )
