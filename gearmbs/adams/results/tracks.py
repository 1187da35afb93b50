"""What happened at the points of contact of a CONTACT, under the names that ADAMS's postprocessor has for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from gearmbs.adams.builders.model import AdamsModel
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.contacts import ContactTracks, SolidContact, contact_tracks
from gearmbs.mechanism.expression_syntax import Units

VECTORS: dict[str, tuple[str, Callable[[ContactTracks], np.ndarray]]] = {
    "I_Point": ("length", lambda t: t.i_point),
    "J_Point": ("length", lambda t: t.j_point),
    "I_Normal_Unit_Vector": ("number", lambda t: t.i_normal),
    "J_Normal_Unit_Vector": ("number", lambda t: -t.i_normal),
    "I_Normal_Force": ("force", lambda t: t.i_normal_force),
    "J_Normal_Force": ("force", lambda t: -t.i_normal_force),
    "I_Friction_Force": ("force", lambda t: t.i_friction_force),
    "J_Friction_Force": ("force", lambda t: -t.i_friction_force),
    "Slip_Velocity": ("velocity", lambda t: t.slip_velocity),
}
"""Sets of components X, Y and Z: their dimension, their values in SI."""
DEPTH = "Penetration"
TRACK_COLUMNS = tuple(f"{name}.{axis}" for name in VECTORS for axis in "XYZ") + (f"{DEPTH}.Depth",)


def tracks_of(model: AdamsModel, solution: Solution) -> dict[int, ContactTracks]:
    """Return the tracks of all active contacts between solids, by id, SI."""
    found = {}
    for kind, number in model.pairs:
        name = model.names.get((kind, number))
        element = model.mechanism.elements.get(name) if kind == "contact" and name is not None else None
        if isinstance(element, SolidContact):
            found[number] = contact_tracks(solution, element)
    return found


TRACK_DIMENSIONS = tuple(d for d, _ in VECTORS.values() for _ in "XYZ") + ("length",)


def track_table(parts: Sequence[tuple[int, ContactTracks | None]], units: Units) -> np.ndarray:
    """Return the tracks of a contact over analyses, shape (m, tracks, columns), in the deck's units.

    Parameters
    ----------
    parts : sequence of (int, ContactTracks or None)
        Of each analysis the number of output times, and the tracks, which are counted from the first on in each.
    units : Units
    """
    most = max((len(tracks) for _, tracks in parts if tracks is not None), default=0)
    tables = []
    for times, tracks in parts:
        table = np.zeros((times, most, len(TRACK_COLUMNS)))
        if tracks is not None:
            # the sum makes minus nothing nothing
            vectors = [0.0 + values(tracks) / units.factor(dimension) for dimension, values in VECTORS.values()]
            table[:, : len(tracks)] = np.concatenate([*vectors, tracks.penetration[:, :, None] / units.length], axis=2)
        tables.append(table)
    return np.concatenate(tables or [np.zeros((0, 0, len(TRACK_COLUMNS)))])
