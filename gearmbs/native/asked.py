"""Outputs of an exported model, and tables of those that are expressions, for `gearmbs.native.series`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from gearmbs.dae.equations.expressions.tape import Tape
from gearmbs.dae.model.model import Names
from gearmbs.mechanism.compile import scope_of
from gearmbs.native.series import KNOWN


class Counted(NamedTuple):
    """The counted angles of an expression.

    Attributes
    ----------
    starts : tuple of float
        Near which they are at the export, rad.
    places : tuple of int
        Of each, where what the run counts of it stands among the numbers that are kept at points, see
        `gearmbs.native.series.KNOWN`.
    further : tuple of float
        By how many full turns each is further than what the run counts, rad.
    """

    starts: tuple[float, ...] = ()
    places: tuple[int, ...] = ()
    further: tuple[float, ...] = ()


class Told(NamedTuple):
    """An output.

    Attributes
    ----------
    name, unit : str
    places : tuple of (int, int)
        Records, and places in them, of the numbers that add up to it.
    tape : Tape, optional
        An expression instead of a sum.
    entries : tuple of tuple of (int, int)
        Of each unknown of the expression the numbers that add up to it.
    counted : Counted
        Its counted angles.
    """

    name: str
    unit: str
    places: tuple[tuple[int, int], ...]
    tape: Tape | None = None
    entries: tuple[tuple[tuple[int, int], ...], ...] = ()
    counted: Counted = Counted()


class Expressions(NamedTuple):
    """The expressions among the outputs of a model, one after the other, and what they look at.

    Attributes
    ----------
    ints, floats : ndarray
        Tables of all tapes.
    bounds : ndarray of int64, shape (7 expressions,)
        See `gearmbs.native.series.REQUEST`.
    first : ndarray of int64
        Where the numbers that add up to each unknown begin in ``kind`` and ``at``, and where the last ends.
    kind, at : ndarray of int64
        As of `gearmbs.native.teller.Teller`.
    marker_body, marker_frame : ndarray, shapes (markers,) and (markers, 12)
    elastic, shapes : ndarray
        Of each elastic frame what `gearmbs.native.series.FRAME` says, and s0, displacements and rotations by its modes.
    starts, counts, further : ndarray
        Of all counted angles, see `Counted`.
    work, gradient, frames : int
        Scratch that suffices for each; rows of the table of frames.
    """

    ints: np.ndarray
    floats: np.ndarray
    bounds: np.ndarray
    first: np.ndarray
    kind: np.ndarray
    at: np.ndarray
    marker_body: np.ndarray
    marker_frame: np.ndarray
    elastic: np.ndarray
    shapes: np.ndarray
    starts: np.ndarray
    counts: np.ndarray
    further: np.ndarray
    work: int
    gradient: int
    frames: int


def expressions_of(system: Any, told: Sequence[Told]) -> Expressions:
    """Return the expressions among some outputs; with markers that they have made."""
    asked: list[tuple[int, Tape, Any, Counted]] = []
    for k, one in enumerate(told):
        if one.tape is not None:
            asked.append((k, one.tape, one.entries, one.counted))
    bounds: list[int] = []
    places: list[tuple[int, int]] = []
    angles: list[Counted] = []
    first, ints, floats, turns = [0], 0, 0, 0
    for k, tape, entries, counted in asked:
        bounds += [k, ints, floats, len(first) - 1, len(entries), turns, tape.n_angles]
        ints, floats, turns = ints + tape.ints.size, floats + tape.floats.size, turns + tape.n_angles
        angles.append(counted)
        for entry in entries:
            places += entry
            first.append(len(places))
    _, builder, _ = scope_of(system.mechanism)
    frames = np.array([np.ravel(m) for m in builder.marker_frame], dtype=float).reshape(-1, 12)
    model = builder.build(Names())
    elastic: list[int] = []
    shapes = [np.zeros(0)]
    for body, at in zip(model.frame_body, model.shape_at, strict=True):
        n = model.modes[body]
        elastic += [body, sum(model.modes[:body]), n, sum(map(len, shapes))]
        own = model.modal[at : at + 3 + 6 * n]
        shapes += [own[:3], *(part.reshape(3, n).T.ravel() for part in (own[3 : 3 + 3 * n], own[3 + 3 * n :]))]
    return Expressions(
        ints=np.concatenate([np.zeros(0, dtype=np.int64), *(tape.ints for _, tape, *_ in asked)]).astype(np.int64),
        floats=np.concatenate([np.zeros(0), *(tape.floats for _, tape, *_ in asked)]),
        bounds=np.array(bounds, dtype=np.int64),
        first=np.array(first, dtype=np.int64),
        kind=np.array([kind for kind, _ in places], dtype=np.int64),
        at=np.array([at for _, at in places], dtype=np.int64),
        marker_body=np.array(builder.marker_body, dtype=np.int64),
        marker_frame=frames,
        elastic=np.array(elastic, dtype=np.int64),
        shapes=np.concatenate(shapes),
        starts=np.array([start for one in angles for start in one.starts]),
        counts=np.array([place for one in angles for place in one.places], dtype=np.int64).reshape(-1, KNOWN).ravel(),
        further=np.array([turn for one in angles for turn in one.further]),
        work=max((tape.work_size for _, tape, *_ in asked), default=0),
        gradient=max((tape.gradient_size for _, tape, *_ in asked), default=0),
        frames=1 + len(system.model.names.bodies) + len(model.frame_body),
    )
