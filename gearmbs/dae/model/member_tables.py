"""What bodies integrated as one are made of, as tables; see `gearmbs.dae.model.members`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import float64, int64, types

_IVEC = int64[::1]

EDGE_CHILD, EDGE_PARENT, EDGE_I, EDGE_J, EDGE_CHILD_HAS_I = range(5)
EDGE_AXES = 5
"""Of the three rows that keep the orientation: 3 * axis of I + axis of J."""
EDGE_ROWS = 8
"""Six rows in the order of the joint: coincident x, y, z, then the orientation."""
EDGE_COLUMNS = 14
"""Of a fixed joint inside a group; members count from 0, -1 is the ground."""

TURN_I, TURN_J, TURN_SIDE, TURN_ROOT = range(4)
"""Of an axis: markers I and J; 1 where I's body turns and -1 where J's does; 1, or -1 where I starts half a turn off
what the motion says."""
TURN_ROWS = 4
"""Six rows: coincident x, y, z, the two that keep the axis, and that of the motion or -1."""
TURN_COLUMNS = 10
"""Of the revolute joint on the ground in which a group turns about a fixed axis, where that is all it can do."""

PLACE_R, PLACE_A = 0, 3
PLACE_MASS, PLACE_INERTIA = 12, 13
PLACE_COLUMNS = 22
"""Of a member: its centre of mass and axes in the frame of its group, mass, inertia in its own axes."""


class Members(NamedTuple):
    """What bodies integrated as one are made of.

    Attributes
    ----------
    group : ndarray of int, shape (members,)
        Body of the integrated model that each body of the whole one belongs to; 0 is the ground.
    place : ndarray, shape (members, PLACE_COLUMNS)
        Where it is in it, and its inertia.
    of_marker : ndarray of int, shape (markers,)
        Member on which each marker of the integrated model lies, -1 for the ground itself.
    row : ndarray of int, shape (rows,)
        Number among all rows of each row of the integrated model.
    edge : ndarray of int, shape (joints, EDGE_COLUMNS)
        Fixed joints inside groups, outermost first.
    turn : ndarray of int, shape (groups, TURN_COLUMNS)
        Joints of the groups where each is integrated by its angle alone, see `gearmbs.dae.equations.fixed_axes`; else
        no rows.
    """

    group: np.ndarray
    place: np.ndarray
    of_marker: np.ndarray
    row: np.ndarray
    edge: np.ndarray
    turn: np.ndarray


MEMBERS_TYPE = types.NamedTuple((_IVEC, float64[:, ::1], _IVEC, _IVEC, int64[:, ::1], int64[:, ::1]), Members)


def no_turns() -> np.ndarray:
    """Return the table of axes of groups that are integrated by all six coordinates."""
    return np.zeros((0, TURN_COLUMNS), dtype=np.int64)
