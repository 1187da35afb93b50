"""Outputs that are expressions: frames of bodies and of markers on those that deform, and angles that are counted.

An expression is evaluated by the function that tells it over time in Python. One with counted angles is told over two
points: the one that was left last, and the present one.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.expressions.opcodes import KIN_A, KIN_R, KIN_V, KIN_W
from gearmbs.dae.equations.rotation import KIN_COLUMNS, POSE_A, POSE_COLUMNS, POSE_R, POSE_V, POSE_W
from gearmbs.dae.model.elastic import elastic_frames
from gearmbs.kernels.jit import njit
from gearmbs.kernels.pointers import caller
from gearmbs.kernels.structs import matrix_at, vector_at
from gearmbs.mechanism.language.series import evaluate_series
from gearmbs.native.setting import value_of

elastic_frames_at = caller(elastic_frames.declared)
series_at = caller(evaluate_series.declared)

UNKNOWN, POSE, SOLUTION, LOADS, FORCE, MOMENT, NUMBER, STRAYED, ENERGY = range(9)
"""Where a number of an output stands: among the unknowns, in which of the records, among what can be set."""
REQUEST = 7
"""Numbers that say where an expression stands: its output, where its tables of integers and of numbers begin, its
unknowns, how many they are, its counted angles, and how many these are."""
FRAME = 4
"""The same of an elastic frame: its body, the first of its modes, their number, where its shapes begin."""
KNOWN = 3
"""The same of an angle that the run counts: where among the numbers that are kept at points the time, the angle and its
rate then stand; -1 for another one."""


@njit(cache=True, error_model="numpy", nogil=True)
def number_of(st, d, q, kind, at):
    """Return a number of an output."""
    if kind == UNKNOWN:
        return st.y_out[d.present, at]
    if kind == POSE:
        return q.pose[0, at]
    if kind == SOLUTION:
        return q.solution[0, at]
    if kind == LOADS:
        return q.loads[at]
    if kind == FORCE:
        return q.force[at]
    if kind == MOMENT:
        return q.moment[at]
    if kind == STRAYED:
        return q.strayed[at]
    if kind == ENERGY:
        return q.energy[at]
    return value_of(d, d.held, at)


@njit(cache=True, error_model="numpy", nogil=True)
def leave_point(d, q):
    """Let what was told at the last point be that of the point before, unless it is the present one."""
    frames = q.kin.shape[0] // 2
    if q.points == 0 or q.times[1] == d.t:
        return
    for f in range(frames):
        for c in range(KIN_COLUMNS):
            q.kin[f, c] = q.kin[frames + f, c]
        for c in range(6):
            q.acc[f, c] = q.acc[frames + f, c]
    half = q.tape_y.shape[0] // 2
    for a in range(half):
        q.tape_y[a] = q.tape_y[half + a]
    half = q.angles.shape[0] // 2
    for a in range(half):
        q.angles[a], q.known[a] = q.angles[half + a], q.known[half + a]
    q.times[0], q.points = q.times[1], 2


@njit(cache=True, error_model="numpy", nogil=True)
def write_frames(q):
    """Write the motion and acceleration of the ground and of all bodies, as `gearmbs.dae.results.frames` does."""
    first = q.kin.shape[0] // 2
    coordinates = q.solution.shape[1] - q.phi.shape[1] // 3
    bodies = (q.pose.shape[1] - 2 * coordinates) // 6
    modes = coordinates - 6 * bodies
    for k in range(3):
        q.kin[first, KIN_A + 4 * k] = 1.0
    for b in range(bodies):
        row, pose = q.kin[first + 1 + b], POSE_COLUMNS * b
        for k in range(3):
            row[KIN_R + k] = q.pose[0, pose + POSE_R + k]
            row[KIN_V + k] = q.pose[0, pose + POSE_V + k]
            row[KIN_W + k] = q.pose[0, pose + POSE_W + k]
        for k in range(9):
            row[KIN_A + k] = q.pose[0, pose + POSE_A + k]
        for k in range(6):
            q.acc[first + 1 + b, k] = q.solution[0, 6 * b + k]
    for e in range(q.elastic.shape[0] // FRAME):
        body, of_modes, n = q.elastic[FRAME * e], q.elastic[FRAME * e + 1], q.elastic[FRAME * e + 2]
        shapes, modal = q.elastic[FRAME * e + 3], np.empty((3, 1, n))
        for m in range(n):
            modal[0, 0, m] = q.pose[0, POSE_COLUMNS * bodies + of_modes + m]
            modal[1, 0, m] = q.pose[0, POSE_COLUMNS * bodies + modes + of_modes + m]
            modal[2, 0, m] = q.solution[0, 6 * bodies + of_modes + m]
        own, its = first + 1 + bodies + e, first + body
        elastic_frames_at(q.elastic_frames)(
            matrix_at(q.kin, KIN_COLUMNS * its, 1, KIN_COLUMNS), matrix_at(q.acc, 6 * its, 1, 6), modal,
            vector_at(q.shapes, shapes, 3), matrix_at(q.shapes, shapes + 3, n, 3),
            matrix_at(q.shapes, shapes + 3 + 3 * n, n, 3), matrix_at(q.kin, KIN_COLUMNS * own, 1, KIN_COLUMNS),
            matrix_at(q.acc, 6 * own, 1, 6),
        )  # fmt: skip


@njit(cache=True, error_model="numpy", nogil=True)
def tell_expression(st, d, q, e):
    """Write an output that is an expression; ``e`` is where it begins in ``q.bounds``."""
    ints, floats, first, count, angle, counted = q.bounds[e + 1 : e + REQUEST]
    half, turns = q.tape_y.shape[0] // 2, q.angles.shape[0] // 2
    for a in range(count):
        value = 0.0
        for p in range(q.own_first[first + a], q.own_first[first + a + 1]):
            value += number_of(st, d, q, q.own_kind[p], q.own_at[p])
        q.tape_y[half + first + a] = value
    for a in range(angle, angle + counted):
        at = KNOWN * a
        if q.counts[at] >= 0:
            kept = st.kept_out[d.present]
            q.known[turns + a] = (
                kept[q.counts[at + 1]] + (d.t - kept[q.counts[at]]) * kept[q.counts[at + 2]] + q.further[a]
            )
    # alone, or behind the point that was left
    rows = 2 if counted > 0 and q.points == 2 else 1
    frames = q.kin.shape[0] // 2
    before = frames * (2 - rows)
    kin = matrix_at(q.kin, KIN_COLUMNS * before, rows * frames, KIN_COLUMNS).reshape((rows, frames, KIN_COLUMNS))
    acc = matrix_at(q.acc, 6 * before, rows * frames, 6).reshape((rows, frames, 6))
    y, angles = np.zeros((rows, max(1, count))), np.zeros((2, rows, max(1, counted)))
    known, out, jumps = np.empty((counted, rows)), np.empty(rows), np.zeros(rows, dtype=np.bool_)
    for k in range(rows):
        there = half * (2 - rows + k) + first
        for a in range(count):
            y[k, a] = q.tape_y[there + a]
        for a in range(counted):
            known[a, k] = q.known[turns * (2 - rows + k) + angle + a]
    for a in range(counted):
        # where the first point is, it starts near the angle that is given
        angles[0, 0, a] = q.angles[angle + a]
    series_at(q.series)(
        vector_at(q.ints, ints, q.ints.shape[0] - ints), vector_at(q.floats, floats, q.floats.shape[0] - floats),
        vector_at(q.times, 2 - rows, rows), jumps, kin, acc, q.marker_body, q.marker_frame, y, angles, known, q.grad,
        q.tape_work, out,
    )  # fmt: skip
    for a in range(counted):
        q.angles[turns + angle + a] = angles[0, rows - 1, a]
    q.out[q.bounds[e]] = out[rows - 1]


@njit(cache=True, error_model="numpy", nogil=True)
def tell_expressions(st, d, q):
    """Write all outputs that are expressions at the present point, of which the records have been evaluated."""
    leave_point(d, q)
    q.times[1] = d.t
    write_frames(q)
    for e in range(q.bounds.shape[0] // REQUEST):
        tell_expression(st, d, q, REQUEST * e)
    q.points = max(q.points, 1)
