"""How near a curve is to the true one: noise of its lines, harmonics beyond, and orders that encoders do not show.

The sum of harmonics 1 to n, of which each has noise of the variance v_h in each part, has noise of the variance
sum(v_h) everywhere. How often it rises above u of its standard deviations in a cycle follows from its bandwidth
(Rice), f = sqrt(sum(h^2 v_h)/sum(v_h)): f exp(-u^2/2) times, and as often it falls below -u.

A curve with corners, as of pairs of teeth that come and go, has lines that fall as a/h^2. At a corner all beyond n add
up, to a/n at most; so do those that no encoder of its lines shows.

Few lines fold mesh harmonics onto orders of the shafts, and end at half their number. What stands there is not known;
orders beside it are. A wrong tooth, which all orders of its wheel are made of, is seen in part then, with images of the
rest at other teeth: of 60 lines and 29 teeth a third of it, and nearly as much half a turn away.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
import pandas as pd

from gearmbs.signals.encoders.orders import Gearing

POINTS = 16
"""Half the points of a cycle for the lowest harmonic of an octave: its highest has 16 of its own."""
CLEAR, SURE = 2.0, 0.95
"""Heights of noise from which an octave stands clear of it: then noise is no more than half of what is seen."""


def noise_within(numbers: np.ndarray, variances: np.ndarray, probability: float) -> float:
    """Return below what the noise of a sum of harmonics stays all over a cycle, in their unit.

    Parameters
    ----------
    numbers, variances : ndarray of shape (n,)
        Of the harmonics; the variances of each part.
    probability : float

    Examples
    --------
    >>> numbers = np.arange(1, 65)
    >>> round(noise_within(numbers, np.full(64, 1.0), 0.95), 1)
    30.6
    """
    total = float(variances.sum())
    if total <= 0.0:
        return 0.0
    often = 2.0 * math.sqrt(float(numbers.astype(float) ** 2 @ variances) / total)
    return math.sqrt(2.0 * math.log(often / (1.0 - probability)) * total)


def fall(numbers: np.ndarray, values: np.ndarray, variances: np.ndarray) -> float:
    """Return a of lines that fall as a/h^2 and add up at a corner: by the highest octave that stands clear of noise.

    Its harmonics n + 1 to 2 n come to a/(2 n) there. It is an estimate: lines of a ramp vanish where it is as long as
    they are, and if that is in this octave a is up to five times too small (trapezoids of 0.1 and 0.2 of a cycle); the
    largest of three octaves would hold there, and be twice too large for rounded corners, as the paper's pair has.

    Parameters
    ----------
    numbers, values, variances : ndarray of shape (n,)
        Of the harmonics, their complex amplitudes, and the variances of each part.
    """
    found, n = 0.0, 1
    while n < numbers[-1]:
        octave = (numbers > n) & (numbers <= 2 * n)
        if octave.any():
            lines = np.zeros(POINTS * n + 1, dtype=complex)
            lines[numbers[octave]] = POINTS * n * values[octave]
            height = float(np.abs(np.fft.irfft(lines)).max())
            if found and height < CLEAR * noise_within(numbers[octave], variances[octave], SURE):
                break
            found = 2.0 * n * height
        n *= 2
    return found


def missing_beyond(a: float, highest: int, unseen: np.ndarray) -> float:
    """Return what harmonics above the highest, and unseen ones below it, add up to at most where all fall as a/h^2."""
    below = unseen[unseen <= highest].astype(float)
    return a * (1.0 / max(highest, 1) + float(np.sum(below**-2.0)))


BESIDE = 2
"""Orders to either side of one whose largest says what may be there."""
RUN_OUT = 2
"""Orders of run-out, which say nothing of later ones: eccentricity may be ten times all others."""

OF_OTHERS = 1.5
"""What is missing from a tooth beside the run-out of the others, by that of the tooth alone: they lack as much, and
their median keeps less than half of it."""


class MeasuredOrders(Protocol):
    """Orders of two shafts, as `gearmbs.signals.encoders.result` has them."""

    @property
    def gearing(self) -> Gearing:
        """Ratio and mesh order."""

    @property
    def lines(self) -> Sequence[Any]:
        """Of `OrderLine`."""

    def of_load(self, one: Any, load: str) -> tuple[complex, float]:
        """Return an order's complex amplitude, m, and its variance."""

    def single_flank(self, load: str | None = None) -> pd.DataFrame:
        """Return ranges, m."""


class Unseen(NamedTuple):
    """What is not seen: orders of a shaft with heights (m), and what all mesh harmonics come to (m)."""

    orders: dict[int, float]
    mesh: float
    pitch: float
    """Mesh order of the shaft."""

    @property
    def whole(self) -> float:
        """Range that all may add, m."""
        return 2.0 * (sum(height for k, height in self.orders.items() if k < self.pitch) + self.mesh)

    @property
    def long(self) -> float:
        """The same of orders below half the mesh order."""
        return 2.0 * sum(height for k, height in self.orders.items() if k < 0.5 * self.pitch)

    def of_a_tooth(self) -> float:
        """Return what may be missing from the mean over a tooth's pitch beside the others, m."""
        return OF_OTHERS * sum(height * abs(float(np.sinc(k / self.pitch))) for k, height in self.orders.items())


def unseen(result: MeasuredOrders, load: str, shaft: int) -> Unseen:
    """Return what of a shaft is not seen up to twice its mesh order, and of the mesh.

    Orders beyond the mesh order are those of the shape of teeth within their pitch.
    """
    gearing = result.gearing
    pitch = float(gearing.mesh if shaft == 0 else gearing.on_second(gearing.mesh))
    seen = {}
    for one in result.lines:
        order = (one.first, one.second)[shaft]
        if order is not None and not one.harmonic:
            seen[order] = abs(result.of_load(one, load)[0])
    known = np.array(sorted(seen))
    lacking = {}
    for k in range(1, math.ceil(2.0 * pitch)):
        if k not in seen and k % pitch:
            near = known[known > RUN_OUT] if k > RUN_OUT and (known > RUN_OUT).any() else known
            near = np.concatenate((near[near < k][-BESIDE:], near[near > k][:BESIDE]))
            lacking[k] = max((seen[int(n)] for n in near), default=math.inf)
    return Unseen(lacking, unseen_mesh(result, load), pitch)


def unseen_mesh(result: MeasuredOrders, load: str) -> float:
    """Return what mesh harmonics that are not seen come to where all add up, m, as if they fell as the number's square.

    Infinite where none is seen.
    """
    mesh = [one for one in result.lines if one.harmonic]
    if not mesh:
        return math.inf
    numbers = np.array([one.harmonic for one in mesh])
    values, variances = (np.array(part) for part in zip(*(result.of_load(one, load) for one in mesh), strict=True))
    a = fall(numbers, values, variances) if numbers[-1] > 1 else abs(values[0])
    return a * float(math.pi**2 / 6.0 - np.sum(numbers.astype(float) ** -2.0))


def unseen_in_words(result: MeasuredOrders, load: str) -> str | None:
    """Return which orders curves and teeth lack, where these may add more than a twentieth to the range."""
    parts, mesh = [], [one.harmonic for one in result.lines if one.harmonic]
    table = result.single_flank(load).set_index("of")
    for at, name in enumerate(("driver", "driven")):
        of_shaft = unseen(result, load, at)
        lacking = {k: height for k, height in of_shaft.orders.items() if k < of_shaft.pitch}
        scale = np.nanmax(table.loc[name, ["F_i", "f_l"]].astype(float))
        if 2.0 * sum(lacking.values()) > WORTH_SAYING * scale:
            parts.append(f"orders {', '.join(map(str, list(lacking)[:LISTED]))}"
                         f"{' and more' if len(lacking) > LISTED else ''} of the {name}")  # fmt: skip
    if mesh and 2.0 * unseen_mesh(result, load) > WORTH_SAYING * table["F_i"]["pair"]:
        parts.append(f"mesh harmonics beyond {', '.join(map(str, mesh[:LISTED]))}")
    if not parts:
        return None
    return (
        f"Not seen, but part of these values and of errors of teeth: {', and '.join(parts)}. `within` holds what they "
        "may add by the height of those beside; discs of ten lines a tooth and more show them."
    )


WORTH_SAYING = 0.05
"""Part of F_i' from which unseen orders are named."""
LISTED = 12
