"""Long records as one meeting: averages over what two wheels do until they meet again.

All that recurs with either shaft or the mesh recurs after as many turns as it takes the wheels to meet again. The mean
of the pulses at the same place of all meetings has the same lines as the record, in as many points as one meeting has,
so that the time that lines take does not grow with the record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np

from gearmbs.signals.encoders.orders import (
    MOST_SCATTER,
    WHOLE,
    Deviations,
    Line,
    Window,
    bridged,
    lines,
    multiples,
    scatter,
    taken_out,
    turn_by_turn,
)
from gearmbs.signals.encoders.pulses import TURN

FEWEST_MEETINGS = 4
"""Meetings of a record from which they are averaged: what is left beside the mean of fewer is little of the noise."""


def averaged(window: Window, period: Fraction) -> bool:
    """Return whether a record has so many turns, and meetings, that these are averaged."""
    meetings = window.turns / float(period)
    return window.turns > MOST_SCATTER and meetings >= FEWEST_MEETINGS and abs(meetings - round(meetings)) < WHOLE


def lines_by_meetings(
    found: Sequence[Deviations],
    orders: Sequence[Fraction],
    steps: Sequence[Fraction],
    window: Window,
    signs: Sequence[float],
    mesh: Fraction | None = None,
    *,
    period: Fraction,
    counts: Sequence[int],
    hidden: Sequence[Sequence[Fraction]] = (),
) -> dict[Fraction, Line]:
    """Return what `gearmbs.signals.encoders.orders.lines` does, of long records by the mean of all meetings.

    Parameters
    ----------
    found, orders, steps, window, signs, mesh, hidden
        As there; a pulse that is missing in all meetings is bridged in their mean.
    period : Fraction
        Turns of the common angle after which all recurs.
    counts : sequence of int
        Pulses of each encoder in it.
    """
    hidden = hidden or [()] * len(found)
    # orders on whose lines a missing pulse lies
    known = [] if mesh is None else [float(o) for o in orders if (o / mesh).denominator == 1]
    if not averaged(window, period):
        whole = [bridged(one, known, window) for one in found]
        return lines(whole, orders, steps, window, signs, mesh, hidden)
    meetings = window.turns / float(period)
    wanted = multiples(orders, steps)
    values = dict.fromkeys(orders, 0.0j)
    turns: dict[Fraction, np.ndarray] = {}
    for one, sign, count, beyond in zip(found, signs, counts, hidden, strict=True):
        mean, left = _mean_meeting(one, count, float(period), window)
        closed = Window(float(mean.phi[0]), float(period), 0.0)
        own, _ = taken_out(bridged(mean, known, closed), orders, wanted, closed, mesh, beyond)
        for order, by_turn in turn_by_turn(one, left, wanted, window).items():
            turns[order] = turns.get(order, 0.0) + sign * by_turn
        for order, value in own.items():
            values[order] += sign * value
    # a mean of n has 1/n of the noise, which what is left lacks
    lost = meetings / (meetings - 1.0)
    variances = scatter(turns, wanted, window)
    return {order: Line(values[order], lost * variances.get(order, 0.0)) for order in orders}


def _mean_meeting(one: Deviations, count: int, period: float, window: Window) -> tuple[Deviations, np.ndarray]:
    """Return the mean of all meetings, and by how much each pulse is beside it, zero where it is missing.

    The flanks of the window add to one where they fall upon each other.
    """
    meeting, place = np.divmod(one.numbers - one.numbers[0], count)
    fade = window.fade(one.phi)
    seen = np.where(one.there, fade, 0.0)
    total, measured = np.bincount(place, fade, count), np.bincount(place, seen, count)
    phi = np.bincount(place, fade * (one.phi - TURN * period * meeting), count) / total
    there = measured > 0.0
    values = np.divide(np.bincount(place, seen * one.values, count), measured, out=np.zeros(count), where=there)
    left = np.where(one.there, one.values - values[place], 0.0)
    around = np.concatenate(([phi[-1] - TURN * period], phi, [phi[0] + TURN * period]))
    spacing = 0.5 * (around[2:] - around[:-2])
    values -= float(spacing[there] @ values[there]) / float(spacing[there].sum())
    numbers = one.numbers[0] + np.arange(count)
    return replace(one, phi=phi, values=values, spacing=spacing, numbers=numbers, there=there), left
