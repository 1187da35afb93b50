"""What the record of a case is made from, taken from the solution while it is being computed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearmbs.dae.results.solution import Solution
from gearmbs.signals.uneven import MARGIN
from gearmbs.studies import rig
from gearmbs.studies.case import Case
from gearmbs.studies.limits import edge

SMOOTH = {"normal_force": "N", "penetration_drive": "m", "penetration_back": "m"}
COUNTS = {"pairs_drive": "1", "pairs_back": "1"}
"""Contact quantities of a record, with units; numbers of tooth pairs cannot be interpolated."""

TURN_BEFORE = 0.02
"""Turns of the faster wheel between the steps that are looked at before the span of a record's filters."""


class Measured(NamedTuple):
    """What a record is made from, at the output times of a solution or some of them.

    Attributes
    ----------
    t : ndarray, shape (m,)
    forces : ndarray, shape (m, 6)
        Force of shaft 1 on gear 1, then of shaft 2 on gear 2, N.
    error : ndarray, shape (m,)
        Lag of the driven wheel behind the driver at the driven base circle, m.
    contact : dict of ndarray
        The quantities of `SMOOTH` and `COUNTS`.
    """

    t: np.ndarray
    forces: np.ndarray
    error: np.ndarray
    contact: dict[str, np.ndarray]


class _Columns(NamedTuple):
    """The quantities of `Measured` for some output times, the wheels' x axes, (m, 2, 3), in place of the error."""

    t: np.ndarray
    forces: np.ndarray
    x_axes: np.ndarray
    contact: np.ndarray


def measure(case: Case, solution: Solution, rows: np.ndarray | None = None) -> Measured:
    """Return what a record is made from at the output times ``rows`` of a solution, default all."""
    recorder = Recorder(case)
    return recorder.joined([recorder.columns(part) for part in solution.parts(rows)])


def rows_of_record(case: Case, t: np.ndarray) -> np.ndarray:
    """Return the numbers of the output times a record is made from.

    Before the span of its filters only a few are needed, to follow the turning wheels.
    """
    first = int(np.searchsorted(t, span_begin(case)))
    teeth = case.gears.teeth
    turn = 2.0 * np.pi / (case.operation.top_speed * max(1.0, teeth[0] / teeth[1]))
    interval = np.floor(t[: first + 1] / (TURN_BEFORE * turn))
    return np.concatenate([np.flatnonzero(np.diff(interval) > 0.0), np.arange(first, t.size)])


def span_begin(case: Case) -> float:
    """Return the time at which the span of a record's filters begins, s."""
    operation = case.operation
    return operation.run_up + operation.settling - edge(case) - (MARGIN + 1) / case.output_rate


class Recorder:
    """Collects what the record of a case needs from the parts of a solution, as a consumer of `simulate`.

    Of the steps before the span of the record's filters the unknowns are kept, and evaluated only as far as needed.
    """

    def __init__(self, case: Case) -> None:
        self.case = case
        pair = case.pair()
        place = pair.placement(0.0)
        self._axes = (place.axes_1, place.axes_2)
        self._ratio = case.gears.teeth[0] / case.gears.teeth[1]
        self._lag = pair.rotation * pair.wheels[1].base_radius
        self._begin = span_begin(case)
        self._early: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self._columns: list[_Columns] = []
        self._model: Solution | None = None

    @property
    def is_empty(self) -> bool:
        """Whether nothing has been taken yet."""
        return self._model is None

    def take(self, part: Solution) -> None:
        """Take the next steps of a run."""
        if self._columns:
            self._columns.append(self.columns(part))
            return
        self._model = part.over(np.empty(0), part.result.y[:0], part.result.epochs)
        self._early.append((part.t.copy(), part.result.y.copy(), part.result.epochs[0][1]))
        if part.t[-1] < self._begin:
            return
        wanted = rows_of_record(self.case, np.concatenate([t for t, _, _ in self._early]))
        self._columns = [self.columns(piece) for piece in self._kept(wanted).parts()]

    def measured(self) -> Measured:
        """Return what the record is made from: all steps inside the span of its filters, some before."""
        return self.joined(self._columns)

    def everything(self) -> Measured:
        """Return the same at all steps from the start on, for a run that failed."""
        early = self._kept()
        columns = [self.columns(part) for part in early.parts()]
        return self.joined([*columns, *(c for c in self._columns if c.t[0] > early.t[-1])])

    def _kept(self, wanted: np.ndarray | None = None) -> Solution:
        """Return the solution over the steps whose unknowns were kept, or over some of them, by increasing numbers."""
        assert self._model is not None
        times, rows, tables = zip(*self._early, strict=True)
        ends = np.cumsum([t.size for t in times])
        wanted = np.arange(ends[-1]) if wanted is None else wanted
        places = np.searchsorted(wanted, [0, *ends])
        inside = [wanted[a:b] - end + t.size for a, b, end, t in zip(places, places[1:], ends, times)]
        epochs = [(int(k), table) for k, table in zip(places, tables)]
        return self._model.over(
            np.concatenate([t[k] for t, k in zip(times, inside)]),
            np.concatenate([y[k] for y, k in zip(rows, inside)]),
            epochs,
        )

    def columns(self, part: Solution) -> _Columns:
        """Return what is recorded of one part of a solution."""
        forces = np.concatenate([part.reaction_force(seat) for seat in rig.SEATS], axis=1)
        x_axes = np.stack([part.orientation(gear)[:, :, 0] for gear in rig.GEARS], axis=1)
        diagnostics = part.contact(rig.MESH)
        return _Columns(part.t.copy(), forces, x_axes, np.stack([diagnostics[n] for n in (*SMOOTH, *COUNTS)], axis=1))

    def joined(self, columns: list[_Columns]) -> Measured:
        """Return the parts as one, with the transmission error from the wheels' angles."""
        whole = _Columns(*(np.concatenate(c) for c in zip(*columns, strict=True)))
        turned = [self._turned(whole.x_axes[:, wheel], axes) for wheel, axes in enumerate(self._axes)]
        error = self._lag * (turned[0] * self._ratio + turned[1])
        contact = {name: whole.contact[:, k] for k, name in enumerate((*SMOOTH, *COUNTS))}
        return Measured(whole.t, whole.forces, error, contact)

    @staticmethod
    def _turned(x_axis: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Return the angle by which a wheel has turned, rad, from its x axis in the frame of its shaft."""
        along, across = (x_axis @ axes[:, k] for k in range(2))
        return np.unwrap(np.arctan2(across, along))
