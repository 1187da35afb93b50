"""Forces of one strip of the face: pressure, ends of the face, stiffness that varies along the path of contact."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.face import end_roll, limit_slopes
from gearmbs.contact.jit import kernel
from gearmbs.contact.slices import (
    Cut,
    end_force,
    moving_end,
    node_forces,
    node_slopes,
    slice_forces,
    slice_slopes,
    touching_parts,
)


@kernel
def strip_forces(wheels, scratch, law, strip, node, low, high, share, totals, want):
    """Integrate the pressure over the slices of a strip, to nodal forces in ``scratch.loads``.

    Parameters
    ----------
    wheels, scratch : record
        The face's limits are those of ``scratch.pair``.
    law : Law
    strip : record
        Sections with gaps and rates.
    node : float
        The strip's first node.
    low, high : float
        First and last node of the strip that count.
    share : float
        1, or -1 for forces to be taken away.
    totals : record
        Diagnostics.
    want : int
        Nonzero to fill derivatives.

    Returns
    -------
    float
        Largest penetration; 0 if nothing touches.
    """
    side, pair, loads = scratch.side, scratch.pair, scratch.loads
    cut = Cut(pair.low - node, pair.high - node, low, high, -node, side.slices - 1.0 - node)
    touching_parts(strip, loads, L.LANES, cut)
    touching = False
    for i in range(L.LANES):
        touching = touching or loads.depth[i] > 0.0
    if not touching:
        return 0.0
    slice_forces(law, strip, loads, L.LANES, share * side.step, want)
    depth = node_forces(loads, L.LANES, totals)
    if want != 0:
        slice_slopes(strip, loads, L.LANES)
    first = int(min(max(np.floor(cut.low), cut.begin), cut.end))
    if 0 <= first < L.LANES and loads.depth[first] > 0.0:
        face_end(wheels, scratch, law, strip, first, cut.low - first, -1.0, share, want)
    last = int(min(max(np.ceil(cut.high) - 1.0, cut.begin), cut.end))
    if 0 <= last < L.LANES and loads.depth[last] > 0.0:
        face_end(wheels, scratch, law, strip, last, cut.high - last, 1.0, share, want)
    if want != 0:
        node_slopes(loads, L.LANES)
    return depth


@kernel
def face_end(wheels, scratch, law, strip, i, u, end, share, want):
    """Add what an end of the face that cuts slice ``i`` does: its own force, and its motion in the derivatives.

    Parameters
    ----------
    wheels, scratch : record
    law : Law
    strip : record
    i : int
        Slice of the strip that the face ends in.
    u : float
        Where in it, as a fraction.
    end : float
        -1 at the lower end, +1 at the higher.
    share : float
        1, or -1 for forces to be taken away.
    want : int
        Nonzero to add derivatives.
    """
    side, pair, loads = scratch.side, scratch.pair, scratch.loads
    limit = scratch.low if end < 0.0 else scratch.high
    roll = end_roll(side, wheels, end, pair.roll)
    limit_slopes(side, wheels, end, roll, limit, scratch.end_1, scratch.end_2, want)
    end_force(law, strip, i, side.step, u, end * share, limit, pair, scratch.sums, want)
    clipped = loads.clip_low[i] if end < 0.0 else loads.clip_high[i]
    if want != 0 and clipped == 0.0:
        moving_end(loads, i, end < 0.0, limit, side.step)


@kernel
def add_softness(sums, pair, strip, loads, n, want):
    """Complete the derivatives of nodal forces for a stiffness that varies along the path of contact."""
    if want == 0:
        return
    inverse = 1.0 / pair.soft
    for k in range(6):
        soft_x = pair.soft_x[k] * inverse
        for j in range(n):
            loads.force_x[k, j] += loads.force[j] * soft_x
    for j in range(n):
        elastic = loads.elastic[j] * inverse
        for k in range(6):
            for i in range(6):
                sums.q_x[i, k] += elastic * strip.grad[k, j] * pair.soft_x[i]


@kernel
def finish_softness(sums, pair, energy, want):
    """Add the force of a stiffness that varies along the path, from the pair's elastic energy."""
    ratio = energy / pair.soft
    for i in range(6):
        sums.q[i] -= ratio * pair.soft_x[i]
    if want == 0:
        return
    for i in range(6):
        for k in range(6):
            moved = pair.moved[k] / pair.soft
            sums.q_x[i, k] -= ratio * pair.soft_xx[i, k] + moved * pair.soft_x[i]
