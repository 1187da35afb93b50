"""Which of several constraint rows that say the same are kept.

"declared" keeps what was added first. "adams" keeps, as far as published results show, what ADAMS does: places before
orientations, orientations of planar joints after those of others, what couples joints after these, and motions last, a
later one before an earlier. (A door on two pins with two motions loses all four rows of orientation, one of place
along the axis, and its first motion; a delta robot keeps the orientations of its cylindrical joints and loses those of
its planar ones.)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.equations import constraint_terms as terms
from gearmbs.dae.errors import ModelError

if TYPE_CHECKING:
    from gearmbs.mechanism.joints import Joint, Row
    from gearmbs.mechanism.mechanism import Mechanism

ORDERS = ("declared", "adams")
PLACE, ORIENTATION, PLANAR, COUPLING, MOTION = range(5)
"""Ranks, from what is kept first to what goes first."""
PLACES = (terms.POINT, terms.DOT2, terms.DISTANCE)
MOTIONS = ("rotation", "translation")


def row_order(mechanism: Mechanism) -> np.ndarray | None:
    """Return the numbers of all constraint rows in the order of preference, None for that of the mechanism.

    Raises
    ------
    ModelError
        If the mechanism asks for an order that is not known.
    """
    if mechanism.redundancy not in ORDERS:
        raise ModelError(f"redundancy = {mechanism.redundancy!r}; choose one of {', '.join(ORDERS)}")
    if mechanism.redundancy == "declared":
        return None
    ranks = [_rank(joint, row) for joint in mechanism.joints.values() for row in joint.rows]
    ranks += [COUPLING] * len(mechanism.constraints)
    within = [-k if rank == MOTION else k for k, rank in enumerate(ranks)]
    return np.lexsort((within, ranks))


def _rank(joint: Joint, row: Row) -> int:
    if joint.kind in MOTIONS:
        return MOTION
    if joint.kind == "coupler":
        return COUPLING
    if any(term.kind in PLACES for term in row.terms):
        return PLACE
    return PLANAR if joint.kind == "planar" else ORIENTATION
