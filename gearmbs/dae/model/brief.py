"""Times at which something given as a function of time changes so briefly that a step could pass it unseen.

A step is judged by its ends. A bump in a table, or a pulse of two STEPs, that lies between them leaves no trace, and
the run ends with success. So tables and steps of TIME, or of what is linear in it, are looked at beforehand: where they
leave the chord over a thousandth of the run by far more than around, the first, the furthest and the last of these
points become breakpoints.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.loads import time_functions as tf

if TYPE_CHECKING:
    from gearmbs.dae.model.model import Model

BRIEF = 1e-3
"""Part of the run below which a change is brief: runs take hundreds of steps and more."""
LONG = 0.5
"""The same of steps, jumps and tables of few points: what is at rest takes steps of a fifth of the run."""
FEW = 16
"""Points of such a table: landing on each costs no more steps than a run takes anyway."""
BLOCKS, SAMPLES = 40, 100
"""Blocks of the run, in each of which the usual distance from chords is the median over so many times. A block is 25
chords long, so that a brief change is the lesser part of one."""
UNUSUAL = 20.0
"""Distance from the chord, in units of the usual one in the block or the next ones, from which on it is a brief change.
Of a sine the largest is 1.4 medians."""
BENT = 0.05
"""Bend of a table at a point of a change, in units of the largest one in it, from which on the change has begun."""
ROUNDED = 1e-9
"""The same as part of the largest value: differences of rounded numbers."""
MOST = 200
"""Changes that become breakpoints, the largest: no run passes all of more than that."""

Table = tuple[np.ndarray, np.ndarray]
"""Times, and values there."""


def brief_changes(model: Model, start: float, end: float) -> list[float]:
    """Return the times between which what a model gives as functions of time changes briefly.

    Parameters
    ----------
    model : Model
    start, end : float
        The run, s.
    """
    width = BRIEF * (end - start)
    found: list[tuple[float, float, float, float]] = []
    changes: list[np.ndarray] = []
    for times, values in _tables(model):
        if len(times) <= FEW:
            changes.append(times)
        else:
            found += _bumps(times, values, start, end, width)
    within = [times[(times > start) & (times <= end)] for times in changes]
    # one step or jump alone stays, and is seen
    alone = sum(len(times) > 0 for times in within) == 1 and max(map(len, within)) <= 2
    edges = sorted({float(t) for times in within for t in times})
    near = np.diff(edges) < (BRIEF if alone else LONG) * (end - start)
    paired = np.append(near, False) | np.append(False, near) if edges else ()
    largest = sorted(found, reverse=True)[:MOST]
    return sorted({*(t for t, pair in zip(edges, paired) if pair), *(t for _, *ends in largest for t in ends)})


def _bumps(
    times: np.ndarray, values: np.ndarray, start: float, end: float, width: float
) -> list[tuple[float, float, float, float]]:
    """Return size and first, largest and last point in time of each brief change of a table."""
    first, last = times[0] + width, times[-1] - width

    def off(at: np.ndarray) -> np.ndarray:
        before, here, after = (np.interp(at + d, times, values) for d in (-width, 0.0, width))
        return np.where((at >= first) & (at <= last), np.abs(here - 0.5 * (before + after)), 0.0)

    grid = start + (end - start) * (np.arange(BLOCKS * SAMPLES) + 0.5) / (BLOCKS * SAMPLES)
    usual = np.median(off(grid).reshape(BLOCKS, SAMPLES), axis=1)
    usual = np.max([np.roll(usual, -1), usual, np.roll(usual, 1)], axis=0)
    bend = np.zeros(len(times))
    bend[1:-1] = np.abs(np.diff(np.diff(values) / np.diff(times)))
    inside = np.flatnonzero((times > start) & (times <= end))
    at, bend, distance = times[inside], bend[inside], off(times[inside])
    block = np.minimum((BLOCKS * (at - start) / (end - start)).astype(int), BLOCKS - 1)
    unusual = np.flatnonzero(distance > UNUSUAL * usual[block] + ROUNDED * np.abs(values).max(initial=0.0))
    found = []
    for group in np.split(unusual, np.flatnonzero(np.diff(at[unusual]) > width) + 1):
        if not len(group):
            continue
        # chords that end in the change are left from points beside it, too, where the table itself does not bend
        group = np.arange(max(group[0] - 1, 0), min(group[-1] + 2, len(at)))
        bent = group[bend[group] >= BENT * bend[group].max(initial=0.0)]
        # a corner alone, or a level that stays, is seen from both sides
        if len(bent) > 2:
            top = bent[np.argmax(distance[bent])]
            found.append((float(distance[top]), float(at[bent[0]]), float(at[top]), float(at[bent[-1]])))
    return found


def _tables(model: Model) -> Iterator[Table]:
    """Yield all functions of time of a model, and of each expression what is a table or a step of TIME.

    Steps have two times, jumps one.
    """
    for kind, at in model.functions[:, :2]:
        numbers = model.function_r[at:]
        if kind in (tf.STEP, tf.STEP5, tf.STEP_INTEGRAL, tf.STEP5_INTEGRAL):
            yield np.array([numbers[0], numbers[2]]), np.array([0.0, 1.0])
        elif kind == tf.PIECEWISE:
            count = int(numbers[0])
            times = numbers[1:count]
            pieces = numbers[count : count + tf.PIECE_SIZE * count].reshape(count, tf.PIECE_SIZE)[1:]
            if count > 3:
                # what a bump of a slope leaves behind stays, and is seen
                yield times, pieces[:, 1]
    for tape in model.tapes:
        yield from _of_tape(tape.ints, tape.floats)


def _of_tape(ints: np.ndarray, floats: np.ndarray) -> Iterator[Table]:
    """Yield the tables, steps and jumps of TIME of one expression."""
    first, count = int(ints[op.HEAD_CODE]), int(ints[op.HEAD_COUNT])
    linear: list[tuple[float, float] | None] = []
    for code, a, b, c, *_ in ints[first : first + op.WIDTH * count].reshape(count, op.WIDTH).tolist():
        x = linear[a] if op.FIRST_UNARY <= code and code != op.EXTERNAL and a < len(linear) else None
        linear.append(_linear(code, a, b, linear, floats))
        if x is None or x[0] == 0.0:
            continue
        slope, level = x
        if code in (op.STEP01, op.STEP5_01, op.HAVERSINE01):
            yield np.sort((np.array([0.0, 1.0]) - level) / slope), np.array([0.0, 1.0])
        elif code in (op.UNIT_STEP, op.SELECT):
            yield np.array([-level / slope]), np.zeros(1)
        elif code == op.SPLINE:
            points, curves = int(floats[c]), int(floats[c + 1])
            knots = (floats[c + 3 : c + 3 + points] - level) / slope
            cubics = floats[c + 3 + points + curves :][: 4 * curves * (points - 1)].reshape(curves, points - 1, 4)
            order = np.argsort(knots[:-1])
            for curve in cubics:
                yield knots[:-1][order], curve[order, 0]


def _linear(code: int, a: int, b: int, linear: list, floats: np.ndarray) -> tuple[float, float] | None:
    """Return slope and level of a register that is linear in TIME, else None."""
    if code == op.TIME:
        return 1.0, 0.0
    if code == op.CONST:
        return 0.0, float(floats[a])
    x = linear[a] if op.FIRST_UNARY <= code <= op.LAST_BINARY else None
    y = linear[b] if op.FIRST_BINARY <= code <= op.LAST_BINARY else None
    if x is not None and code == op.NEG:
        return -x[0], -x[1]
    if x is None or y is None:
        return None
    if code in (op.ADD, op.SUB):
        sign = 1.0 if code == op.ADD else -1.0
        return x[0] + sign * y[0], x[1] + sign * y[1]
    if code == op.MUL and 0.0 in (x[0], y[0]):
        return x[0] * y[1] + y[0] * x[1], x[1] * y[1]
    if code == op.DIV and y[0] == 0.0 and y[1] != 0.0:
        return x[0] / y[1], x[1] / y[1]
    return None
