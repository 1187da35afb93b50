"""What one train says alone: the errors of its marks, whose they are, and the torsional vibration of its shaft."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from gearmbs.signals.encoders.orders import Course, Deviations, deviations, slow_angle, smooth_angle
from gearmbs.signals.encoders.pulses import TURN, PulseTrain, errors_of
from gearmbs.signals.errors import SignalError

ECCENTRIC = 2
"""Orders of a disc that turn with its mounting, which need not be the same in two runs."""
SIDEBANDS = 2
"""Shaft orders beside a mesh order that are left out: modulation by the shaft is there."""
FEWEST_ORDERS = 8
"""Orders from which the scatter of a regression is known to a quarter of itself."""
QUARTERS = 4
"""Turns of which a record of torsional vibration is a multiple: half and quarter orders are lines of its spectrum."""
FEWEST_TURNS = 16
"""Turns from which orders of a half and a quarter are there to 2 %, and leave no more beside them; 12: 5 %, 5: half."""
NEIGHBOURS = 33
"""Orders whose median is the level that a line stands in: as many as `levels.LEVEL_LINES` and its own."""


@dataclass(frozen=True, eq=False)
class EncoderMarks:
    """Errors of the marks of a disc.

    Attributes
    ----------
    errors : ndarray of shape (lines,)
        Angle by which each mark lies behind its place, rad, their mean zero; zero of marks that the disc lacks.
    uncertainty : float
        Standard deviation of each, rad, by the scatter from turn to turn.
    """

    errors: np.ndarray
    uncertainty: float

    @property
    def rms(self) -> float:
        """RMS of the errors as a share of the pitch."""
        return float(np.sqrt(np.mean(self.errors**2))) * self.errors.size / TURN


def encoder_marks(trains: PulseTrain | Sequence[PulseTrain]) -> EncoderMarks:
    """Errors of the marks from a shaft that runs free, its inertia keeping the speed.

    What of its motion is of whole orders of its turn counts as marks: of a torque T sin(k theta) on an inertia J that
    is T/(J k^2 omega^2), so that a fast run down is best, and two at different speeds show what is left of it.

    Parameters
    ----------
    trains : PulseTrain or sequence of PulseTrain
        Of one disc, whose mark 0 is known if there are several.
    """
    trains = [trains] if isinstance(trains, PulseTrain) else list(trains)
    if len(trains) > 1 and not all(train.referenced for train in trains):
        raise SignalError("trains: several need index pulses, by which their marks are the same; give index=...")
    lines = {train.lines for train in trains}
    if len(lines) != 1:
        raise SignalError(f"trains: have {sorted(lines)} lines; give those of one disc")
    numbers, values = [], []
    for train in trains:
        found = _own(train)
        numbers.append(found.numbers[found.there] % train.lines)
        values.append(-found.values[found.there])
    at, off = np.concatenate(numbers), np.concatenate(values)
    count = np.bincount(at, minlength=trains[0].lines)
    total = np.bincount(at, off, trains[0].lines)
    errors = np.divide(total, count, out=np.zeros(count.size), where=count > 0)
    spread = float(np.sqrt(np.sum((off - errors[at]) ** 2) / max(off.size - np.count_nonzero(count), 1)))
    errors -= errors[count > 0].mean()
    return EncoderMarks(np.where(count > 0, errors, 0.0), spread / math.sqrt(off.size / np.count_nonzero(count)))


def share_found(
    known: EncoderMarks, trains: PulseTrain | Sequence[PulseTrain], mesh: float
) -> tuple[float, float] | None:
    """Share of known errors of marks that other trains show, and its standard error: one of the same disc, else zero.

    The regression of the lines of the trains' marks upon the known ones, at the orders of the shaft that are no mesh
    orders nor beside them, each weighted by the level around it: there transmission error and vibration are the least,
    and count as noise.

    Parameters
    ----------
    known : EncoderMarks
    trains : PulseTrain or sequence of PulseTrain
    mesh : float
        Mesh order of the shaft.

    Returns
    -------
    (float, float) or None
        None where the known errors do not stand clear of their own noise, or of too few orders.
    """
    count = known.errors.size
    orders = np.arange(ECCENTRIC + 1, (count + 1) // 2)
    orders = orders[np.abs((orders + 0.5 * mesh) % mesh - 0.5 * mesh) > SIDEBANDS]
    if orders.size < FEWEST_ORDERS:
        return None
    told, seen = (np.fft.rfft(errors)[orders] for errors in (known.errors, encoder_marks(trains).errors))
    power = np.abs(seen) ** 2
    reach = min(NEIGHBOURS, orders.size)
    first = np.clip(np.arange(orders.size) - reach // 2, 0, orders.size - reach)
    level = np.median(np.lib.stride_tricks.sliding_window_view(power, reach), axis=1)[first]
    weight = 1.0 / np.maximum(level, np.finfo(float).tiny)
    noise = count * known.uncertainty**2
    clear = float(weight @ (np.abs(told) ** 2 - noise))
    if clear < 3.0 * noise * math.sqrt(weight @ weight):
        return None
    product = weight * np.real(seen * told.conj())
    share = float(product.sum()) / clear
    # the noise of the known errors is part of the scatter, so that it is told from the terms themselves
    scatter = product - share * weight * (np.abs(told) ** 2 - noise)
    return share, math.sqrt(float(scatter @ scatter)) / clear


def torsional_vibration(train: PulseTrain, marks: Any = None) -> xr.DataArray:
    """Angle by which a shaft is ahead of its slow turning, at even steps of its own angle.

    Slow is what cubic splines with knots four turns apart follow: orders from a quarter on are there whole, to 3 % in
    records of 60 turns, lower ones in part. Without marks, their errors are part of it at all whole orders; orders
    above half the lines are folded down.

    Parameters
    ----------
    train : PulseTrain
    marks : EncoderMarks or array_like of shape (lines,), optional
        Errors of the marks (`encoder_marks`).

    Returns
    -------
    xarray.DataArray
        rad, dimensions (angle, channel), angle in turns from mark 0, `lines` samples a turn: what
        `gearmbs.signals.order_spectrum` takes, over a multiple of four turns, so that quarters of orders are lines of
        it. Attributes: ``highest_order``, and ``notes`` with what the train and the number of lines leave open. The
        speed over time is `instantaneous_speed` of `angle_of_pulses`.
    """
    errors = None if marks is None else errors_of(marks, train)
    found = _own(train, errors, slow_angle(train, errors))
    whole = train.lines * (QUARTERS if train.turns >= 2 * QUARTERS + 1 else 1)
    count = found.numbers.size - found.numbers.size % whole
    top = 0.5 * train.lines
    folded_down = (
        f"{train.name}: {train.lines} lines show orders below {top:g}; what the shaft has from there on is folded "
        f"down, as order {train.lines - 1} onto 1, and nothing tells it from orders below."
    )
    notes = [*train.notes, folded_down]
    if (low := _filled(train)) > 0.0:
        notes.append(
            f"{train.name}: marks that are missing in each turn lie on straight lines between their neighbours: of "
            f"order k {100.0 * low:.2g} k^2 % are lost on average, twice that at most, 1 % of order "
            f"{math.sqrt(0.01 / low):.3g}, and stand at other orders."
        )
    if train.turns < FEWEST_TURNS:
        notes.append(
            f"{train.name}: in {train.turns:.3g} turns orders below 1 are there in part, the rest taken for slow "
            f"turning, and orders beside them have some of it; {FEWEST_TURNS} turns hold halves and quarters."
        )
    return xr.DataArray(
        found.values[:count, None],
        dims=("angle", "channel"),
        coords={"angle": found.numbers[:count] / train.lines, "channel": [train.name], "units": ("channel", ["rad"])},
        attrs={
            "samples_per_rev": train.lines,
            "units": "rad",
            "mean_speed": train.mean_speed,
            "highest_order": top,
            "notes": notes,
        },
    )


def _filled(train: PulseTrain) -> float:
    """Return the share of a wave of order 1 that is lost where marks are missing in each turn; of order k k^2 of it.

    A straight line leaves a wave between two marks by half the square of its angle a pitch, times the distances to
    either mark.
    """
    there = np.unique(train.numbers % train.lines)
    steps = np.diff(there, append=there[0] + train.lines)
    apart = sum(float(np.sum(np.arange(1, n) * np.arange(n - 1, 0, -1))) for n in steps)
    return 0.5 * (TURN / train.lines) ** 2 * apart / train.lines


def _own(train: PulseTrain, errors: np.ndarray | None = None, course: Course | None = None) -> Deviations:
    """Return the deviations of a shaft from a course or its own smooth angle, over whole turns."""
    course = smooth_angle(train) if course is None else course
    begin, end = float(course.angle(course.begin)), float(course.angle(course.end))
    return deviations(train, course, begin, begin + TURN * math.floor((end - begin) / TURN) - 1e-9, 1.0, errors=errors)
