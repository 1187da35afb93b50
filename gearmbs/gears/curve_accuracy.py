"""Transmission error and mesh stiffness over a mesh cycle that are as accurate as asked, and tell how accurate.

A curve at rest has two numerical errors. Slices: the integral along the face is a sum over n of them, whose error falls
with 1/n^2; a curve with half as many, of ratio r, bounds it by r^2 / (1 - r^2) of the difference. Points: mean and
harmonics are sums over the points of a cycle, which err with 1/n^2 where the curve has kinks, as an error has, and with
1/n where it jumps, as a stiffness does; extremes lie between points. Both halves of the points, the even and the odd
ones, are curves of their own: what they differ by is what half as many points are good for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from gearmbs.schema.quantities import accuracy_part
from gearmbs.units import QuantityLike
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.gears.mesh import Mesh

Curve = TypeVar("Curve", bound=Any)
"""A `gearmbs.gears.transmission.TransmissionError`, of the functions there."""

SMALLEST = 1e-6
"""Least accuracy that can be asked for: angles are found to 1e-12 of the load, differences of curves to 1e-6."""
SHARE = 0.5
"""Part of a difference that is taken as the error at least: of halved points 1/3 where the curve has kinks."""
FEWEST_SLICES = 2
"""Slices of the curve that is compared, at least."""
ATTEMPTS = 6
"""Curves at most, each with twice the slices or points of the one before."""
MOST_POINTS = 12_800
"""Points of a cycle at most: a path of contact of 20 mm in steps of a micrometre and a half."""
COUNT = 5
"""Harmonics that are judged."""
NOTHING = 1e-11
"""Peak to peak below which a curve is a straight line, m: angles are found to 1e-15 m at the base circle."""


@dataclass(frozen=True)
class CurveErrors:
    """Numerical errors of what a curve tells.

    Attributes
    ----------
    error : float
        Of each value of the transmission error, m: by the slices.
    mean, peak_to_peak, harmonics : float
        Of the transmission error's, m; of harmonics that of the largest among the first five.
    stiffness : float
        Of the mean stiffness, N/m.
    asked, found : float
        Accuracy, as a part of the peak to peak and of the mean stiffness.
    slices, points : int
        Along the face, and of a mesh cycle.
    """

    error: float
    mean: float
    peak_to_peak: float
    harmonics: float
    stiffness: float
    asked: float
    found: float
    slices: int
    points: int

    def __str__(self) -> str:
        return (
            f"peak to peak known to {1e6 * self.peak_to_peak:.2g} um, mean to {1e6 * self.mean:.2g} um, harmonics to "
            f"{1e6 * self.harmonics:.2g} um, mean stiffness to {1e-6 * self.stiffness:.2g} N/um, that is to "
            f"{100 * self.found:.2g} %, by {self.points} points and {self.slices} slices"
        )


def accurate_curve(
    curve: Callable[[int, int], Curve], pair: Mesh, accuracy: QuantityLike, points: int, slices: int | None
) -> Curve:
    """Return a curve whose mean, extremes, harmonics and mean stiffness are as accurate as asked.

    Parameters
    ----------
    curve : callable
        ``curve(points, slices)`` computes one.
    pair : Mesh
    accuracy : float or str
        As a part of the peak to peak; of the stiffness as a part of its mean.
    points : int
        To begin with.
    slices : int, optional
        Given ones stay, and their error is told; one slice where flanks vary along the face cannot be judged.

    Raises
    ------
    ValueError
        For what is no accuracy; for a single slice, or an odd number of points.

    Warns
    -----
    UserWarning
        If the accuracy is not reached.
    """
    wanted = accuracy_part(accuracy, "the peak to peak", SMALLEST)
    own = pair.contact_model.slices
    given = slices if slices is not None else own
    sliced = _slices(pair)
    if given == 1 and sliced > 1:
        raise ValueError(
            f"accuracy = {accuracy!r}: what one slice is good for cannot be told where flanks vary along the face; "
            "give two slices or more, or leave slices out"
        )
    if points % 2:
        raise ValueError(
            f"points is {points}: accuracy = {accuracy!r} holds even and odd points against each other; give an even "
            "number"
        )
    count = sliced if given is None else given
    coarse: tuple[int, Any] | None = None
    for attempt in range(ATTEMPTS):
        found = curve(points, count)
        by_slices = np.zeros(4)
        if count > 1:
            if coarse is None or coarse[1].phase.size != found.phase.size:
                half = max(FEWEST_SLICES, count // 2) if count > FEWEST_SLICES else 1
                coarse = half, curve(points, half)
            by_slices = _by_slices(found, count, coarse[1], coarse[0])
        errors = _judged(found, by_slices, _by_points(found), wanted, points, count)
        unit = _units(found)
        if errors.found <= wanted or attempt == ATTEMPTS - 1:
            break
        of_slices, of_points = float((by_slices / unit).max()), float((_by_points(found) / unit).max())
        more_slices = of_slices > 0.5 * wanted and given is None and count > 1
        more_points = of_points > 0.5 * wanted and 2 * points <= MOST_POINTS
        if not (more_slices or more_points):
            break
        coarse = None if more_points else (count, found)
        points, count = points * (2 if more_points else 1), 2 * count - 1 if more_slices else count
    if errors.found > wanted:
        warn(f"transmission error: {errors}; {100 * wanted:.2g} % was asked for")
    return replace(found, errors=errors)


def _slices(pair: Mesh) -> int:
    """Return as many slices as the pair takes by itself."""
    from gearmbs.contact import layout
    from gearmbs.gears.tables import pack

    return int(pack(pair, None)[0][layout.SLICES])


def _numbers(found: Any) -> np.ndarray:
    """Return mean, peak to peak, and mean stiffness of a curve; harmonics are held apart."""
    return np.array([found.mean, found.peak_to_peak, float(found.stiffness.mean())])


def _by_slices(found: Any, count: int, other: Any, fewer: int) -> np.ndarray:
    """Return the errors of mean, peak to peak, harmonics and stiffness by the slices."""
    ratio = fewer / count
    share = max(SHARE, ratio**2 / (1.0 - ratio**2))
    mean, peaks, stiffness = np.abs(_numbers(found) - _numbers(other))
    # single numbers may agree by chance: of a curve the largest difference counts, but for a shift of all of it
    shape = found.error - other.error
    shape = float(np.ptp(shape))
    lines = float(np.abs(found.harmonics(COUNT) - other.harmonics(COUNT)).max())
    return share * np.array([max(mean, 0.5 * shape), max(peaks, 0.5 * shape), max(lines, 0.1 * shape), stiffness])


def _by_points(found: Any) -> np.ndarray:
    """Return the same by the points of a cycle."""
    parts = [
        replace(found, error=found.error[k::2], stiffness=found.stiffness[k::2], extremes=found.extremes)
        for k in (0, 1)
    ]
    mean, _, stiffness = np.abs(_numbers(parts[0]) - _numbers(parts[1]))
    peaks = 0.0
    if found.extremes is None:
        peaks = max(found.peak_to_peak - min(part.peak_to_peak for part in parts), _beyond(found.error))
    lines = max(float(np.abs(found.harmonics(COUNT) - part.harmonics(COUNT)).max()) for part in parts)
    # each half is off from the whole by half of what they differ by, and the whole by less than that; where a jump, or
    # steep flank, lies between two points both may agree by chance: of a rise and a fall the sum is off by up to half a
    # step of each
    steps = found.phase.size
    steep, jump = (float(np.abs(np.diff(v)).max(initial=0.0)) / steps for v in (found.error, found.stiffness))
    return np.array([max(0.5 * mean, steep), peaks, max(SHARE * lines, steep), max(0.5 * stiffness, jump)])


def _beyond(error: np.ndarray) -> float:
    """Return by how much a cycle's extremes may lie beyond its points.

    There the lines through both sides of a kink would meet, or the parabola through three points has its vertex.
    """
    total = 0.0
    for k in (int(np.argmin(error)), int(np.argmax(error))):
        one, two = abs(error[k] - error[k - 1]), abs(error[k] - error[(k + 1) % error.size])
        if one + two > 0.0:
            total += max(one * two, 0.125 * (one - two) ** 2) / (one + two)
    return total


def _units(found: Any) -> np.ndarray:
    """Return of what errors are parts."""
    peaks = max(found.peak_to_peak, NOTHING)
    return np.array([peaks, peaks, peaks, max(float(found.stiffness.mean()), np.finfo(float).tiny)])


def _judged(
    found: Any, by_slices: np.ndarray, by_points: np.ndarray, wanted: float, points: int, count: int
) -> CurveErrors:
    """Return what a curve is known to."""
    whole = np.hypot(by_slices, by_points)
    mean, peaks, lines, stiffness = map(float, whole)
    part = float((whole / _units(found)).max())
    return CurveErrors(float(by_slices[:2].max()), mean, peaks, lines, stiffness, wanted, part, count, points)
