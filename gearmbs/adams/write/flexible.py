"""Bodies that deform by modes as FLEX_BODY statements with modal neutral files beside the deck."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.adams.write.text import listed
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.modal import ModalBody, ShapedMarker

if TYPE_CHECKING:
    from gearmbs.adams.write.text import WriterContext
    from gearmbs.flexible import ModalModel

INVARIANTS = {"full": "TTTTTTTTT", "partial": "TTTTFTTTF", "constant": "TTTTFTTFF"}
"""Inertia invariants that a level of coupling keeps; the reader knows the same."""
RIGID = 6
"""Rigid motions, which come first in the neutral files written here."""


def flex_body_arguments(
    writer: WriterContext, body: ModalBody, markers: Sequence[Marker]
) -> tuple[list[str], dict[int, int]]:
    """Write the neutral file of a body and return what its statement says of it, and the nodes of its markers.

    Parameters
    ----------
    writer : WriterContext
    body : ModalBody
        Added by :meth:`gearmbs.flexible.ModalModel.add_to`.
    markers : sequence of Marker
        On it, that are written.

    Returns
    -------
    arguments : list of str
        Without place and velocity; the damping has to stay the last.
    nodes : dict of int to int
        Node of each marker, by ``id(marker)``. A marker that is at no node gets one without mass, which moves like it.

    Raises
    ------
    ModelError
        If the body cannot be in such a file, or the deck is not written to one.
    """
    from gearmbs.flexible.material import FlexibleError
    from gearmbs.flexible.mnf import mnf_of, with_seat_nodes, write_mnf
    from gearmbs.flexible.modal_model import Seat

    label = f"body '{body.name}'"
    origin = body.origin
    if origin is None:
        raise ModelError(
            f"{label}: it deforms by modes without a model behind them, which a modal neutral file needs; add it by "
            "ModalModel.add_to, or put a rigid body in its place (Mechanism.body)"
        )
    if origin.model.stiffened:
        raise ModelError(f"{label}: a modal neutral file has no stiffening by spin; reduce it without spin=")
    if writer.path is None:
        raise ModelError(f"{label}: its modal neutral file stands beside the deck; give the deck's path")
    seats = dict(origin.model.seats)
    for marker in markers:
        if isinstance(marker, ShapedMarker):
            raise ModelError(
                f"{label}: {marker.name} has shapes of its own, as those of modal forces; a deck has markers at nodes"
            )
        seats[_seat(marker)] = Seat(marker.position, *origin.model.shapes(marker.position))
    try:
        model, nodes = with_seat_nodes(replace(origin.model, seats=seats))
        content = mnf_of(model)
    except FlexibleError as error:
        raise ModelError(f"{label}: {error}") from error
    path = Path(writer.path)
    file = path.with_name(f"{path.stem}_{re.sub(r'[^A-Za-z0-9]+', '_', body.name).strip('_')}.mnf")
    write_mnf(file, content)
    arguments = [f"MNF_FILE = {file.name}"]
    words = ("TRUE" if letter == "T" else "FALSE" for letter in INVARIANTS[origin.coupling])
    arguments.append(f"INVARIANTS = {':'.join(words)}")
    if np.any(body.start):
        arguments.append(f"DMODE = {listed(body.start)}")
    if np.any(body.rate):
        arguments.append(f"VMODE = {listed(body.rate * writer.units.time)}")
    arguments.append(f"CRATIO = {damping_text(origin.ratios)}")
    return arguments, {id(marker): nodes[_seat(marker)] for marker in markers}


def nearest_node(model: ModalModel) -> np.ndarray:
    """Return the place of the node nearest to the centre of mass, m."""
    return model.positions[int(np.argmin(np.linalg.norm(model.positions - model.properties.com, axis=1)))].copy()


def damping_text(ratios: np.ndarray) -> str:
    """Return the damping ratios of elastic modes as an expression in FXMODE, the number of the mode in its file."""
    text = repr(float(ratios[-1]))
    for k in range(len(ratios) - 1, 0, -1):
        if ratios[k - 1] != ratios[k]:
            below = repr(float(ratios[k - 1]))
            text = f"IF(FXMODE - {RIGID + k + 0.5}: {below}, {below}, {text})"
    return text


def _seat(marker: Marker) -> str:
    return f"marker {id(marker)}"
