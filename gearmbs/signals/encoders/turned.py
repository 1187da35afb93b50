"""By how many teeth a disc was turned on its shaft: pulses in mesh tell the rest of a tooth, the marks tell the teeth.

The mesh recurs with each tooth, so that half a tooth the one way looks like half a tooth the other way. What a wheel
has at its shaft's own orders does not recur: taken at a wrong place it would have to be made up for by errors of the
marks, larger than those that the disc has at all other orders. So what it costs to explain the runs is compared,

    sum |y - A x|^2/v + sum |E|^2/level,

at the angle that is told and at those some teeth beside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from gearmbs.signals.encoders.estimate import NOISELESS, Row, estimate
from gearmbs.signals.encoders.orders import Gearing
from gearmbs.signals.encoders.pulses import TURN
from gearmbs.signals.encoders.visible import Order
from gearmbs.signals.errors import SignalError

TEETH = (-2, -1, 1, 2)
"""Teeth by which a disc may have been turned otherwise than told: half a tooth with the wrong sense is one."""
SURELY, HARDLY = 30.0, 12.0
"""Cost from which another angle is the right one, and up to which neither is: of chance, twice the logarithm of a
ratio of probabilities, 3e6 and 400."""
NOTHING = 1e-9
"""Part of the cost by which an angle that changes nothing may seem to change it."""
OF_WHEELS = 2.0
"""Times the mesh order up to which wheels have lines of their own; from there on those of the marks say their level."""

Shifts = Sequence[tuple[float, float]]


def check_turned(
    shifts: Shifts,
    orders: Sequence[Order],
    gearing: Gearing,
    rows_of: Callable[[Order, Shifts], list[Row]],
    levels: Mapping[str, float],
) -> list[str]:
    """Refuse angles of discs that the marks contradict, and say so where nothing tells by how many teeth.

    Parameters
    ----------
    shifts : sequence of (float, float)
        Of each run, rad; those of the first are zero.
    orders : sequence of Order
    gearing : Gearing
    rows_of : callable
        Returns the rows at an order for some shifts.
    levels : mapping of str to float
        Variances of the marks' lines, by shaft.

    Returns
    -------
    list of str
        Remarks.
    """
    pitches = (TURN / float(gearing.mesh), TURN / float(gearing.on_second(gearing.mesh)))
    own = [
        o for o in orders
        if o.harmonic is None and o.order <= OF_WHEELS * max(gearing.mesh, gearing.on_second(gearing.mesh))
    ]  # fmt: skip
    if not own:
        return []

    def cost(angles: Shifts) -> float:
        total = 0.0
        for order in own:
            rows = rows_of(order, angles)
            known = {name: levels[name] for row in rows for name in row.factors if name in levels}
            found = estimate(rows, known)
            of = dict(zip(found.names, found.values, strict=True))
            for row in rows:
                off = row.value - sum(factor * of[name] for name, factor in row.factors.items())
                total += abs(off) ** 2 / (row.variance + NOISELESS)
            total += sum(abs(of[name]) ** 2 / (level + NOISELESS) for name, level in known.items())
        return total

    told, remarks = cost(shifts), []
    for run, angles in enumerate(shifts):
        for at, name in enumerate(("driver", "driven")):
            if run == 0 or angles[at] == 0.0:
                continue
            others = {}
            for teeth in TEETH:
                moved = list(angles)
                moved[at] += teeth * pitches[at]
                others[teeth] = cost([*shifts[:run], (moved[0], moved[1]), *shifts[run + 1 :]])
            best = min(others, key=lambda teeth: others[teeth])
            right = math.degrees(angles[at] + best * pitches[at])
            words = f"{math.degrees(angles[at]):+.3f} deg"
            if told - others[best] > SURELY:
                raise SignalError(
                    f"shift: that of the {name}'s disc in run {run + 1} is told as {words}, but errors of the wheels "
                    f"are at one place in all runs if it is {right:+.3f} deg; check its sense (that of rotation is "
                    "positive) and by how many teeth it was turned"
                )
            # of wheels that are alike the angle of the one disc is that of the other's marks, and changes nothing
            if NOTHING * told < abs(others[best] - told) and others[best] - told < HARDLY:
                remarks.append(
                    f"Run {run + 1}: the mesh does not tell whether the disc of the {name} was turned by {words} or by "
                    f"{right:+.3f} deg, a whole number of teeth beside it, nor do errors of the wheels; it is taken as "
                    "told. A quarter of a tooth has no such twin with the wrong sense."
                )
    return remarks


def level_beyond(orders: np.ndarray, squares: np.ndarray, mesh: float) -> float | None:
    """Return the variance of a disc's lines from squares of them beyond the wheels' own orders; None without any."""
    beyond = squares[orders > OF_WHEELS * mesh]
    return float(np.median(beyond)) / (2.0 * math.log(2.0)) if beyond.size else None
