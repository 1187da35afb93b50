"""What the record of a case is made from, taken from the solution while it is being computed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearmbs.dae.results.solution import Solution
from gearmbs.dae.results.watched import some_of
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, void
from gearmbs.signals.resampling import MARGIN, EvenSamples
from gearmbs.studies.case.case import Case
from gearmbs.studies.run import rig

if TYPE_CHECKING:
    from gearmbs.gears.pair import GearPair

SMOOTH = {"normal_force": "N", "penetration_drive": "m", "penetration_back": "m"}
COUNTS = {"pairs_drive": "1", "pairs_back": "1"}
"""Contact quantities of a record, with units; numbers of tooth pairs cannot be interpolated."""

CONTACT = (*SMOOTH, *COUNTS)
FORCES = 7
"""Columns of the forces and of the last one's size, which come first; the transmission error and `CONTACT` follow."""

Taken = tuple[np.ndarray, np.ndarray]
"""Times, and what is recorded at each, shape (m, 13)."""

WATCHED = (
    *(("reaction_force", seat) for seat in rig.SEATS),
    *(("orientation", gear) for gear in rig.GEARS),
    ("diagnostics", rig.MESH),
)
"""What a record takes from the integrator's own steps."""

TURN_BEFORE = 0.02
"""Turns of the faster wheel between the steps that are looked at before the span of a record's filters."""

SLIPPED = 0.5
"""Transmission error, in base pitches, beyond which teeth have passed each other."""


class Span(NamedTuple):
    """Start and end of a record, s."""

    start: float
    stop: float


class Measured(NamedTuple):
    """What a record is made from, at the output times of a solution or some of them.

    Attributes
    ----------
    t : ndarray, shape (m,)
    forces : ndarray, shape (m, 7)
        Force of shaft 1 on gear 1, then of shaft 2 on gear 2, and the size of this one, N. The size is taken ahead of
        the anti-alias filter: where forces vanish and come back that of a filtered one is not its size.
    error : ndarray, shape (m,)
        Lag of the driven wheel behind the driver at the driven base circle, m.
    contact : dict of ndarray
        The quantities of `SMOOTH` and `COUNTS`.
    """

    t: np.ndarray
    forces: np.ndarray
    error: np.ndarray
    contact: dict[str, np.ndarray]


def to_mesh(pair: GearPair) -> tuple[float, float, float]:
    """Return the direction from the driver's axis to its mesh: that of the mate's axis, or away from that of a ring."""
    return (1.0 if pair.geometry.sign > 0 else -1.0), 0.0, 0.0


class _Turned:
    """Follows the angles by which the wheels have turned, for the lag of the driven one."""

    def __init__(self, case: Case) -> None:
        self.pair = pair = case.pair()
        place = pair.placement(0.0)
        self._axes = np.array([place.axes_1, place.axes_2])
        # a ring turns as its pinion does
        sign = 1 if pair.geometry.sign > 0 else -1
        self._ratio = sign * case.gears.teeth[0] / case.gears.teeth[1]
        self._lag = sign * pair.rotation * pair.wheels[1].base_radius
        self._last = np.full(2, np.nan)
        self._pitch = pair.driver.base_pitch
        self._whole: float | None = None

    def error(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return the transmission error, m, at the next steps from the orientations of the wheels, each (m, 3, 3)."""
        error = np.empty(len(first))
        _lags(first, second, self._axes, self._last, self._ratio, self._lag, error)
        if self._whole is None:
            # what starts with the wheels turned is counted from the nearest tooth
            self._whole = self._pitch * float(np.round(error[0] / self._pitch))
        error -= self._whole
        return error


@njit(
    void(float64[:, :, :], float64[:, :, :], float64[:, :, :], float64[::1], float64, float64, float64[::1]),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def _lags(first, second, axes, last, ratio, lag, out):
    """Write ``lag (ratio angle_1 + angle_2)`` at each of some steps, and to ``last`` the angles at the last of them.

    Angles are those of the x-axes of two wheels, from matrices of rotation, (m, 3, 3), about the axes that they have at
    rest; they go on from ``last``, if that is a number, and from step to step by less than half a turn.
    """
    turn = 2.0 * np.pi
    for k in range(out.size):
        for wheel in range(2):
            along, across = 0.0, 0.0
            for c in range(3):
                x = first[k, c, 0] if wheel == 0 else second[k, c, 0]
                along += x * axes[wheel, c, 0]
                across += x * axes[wheel, c, 1]
            angle = np.arctan2(across, along)
            if last[wheel] == last[wheel]:
                angle += turn * np.floor((last[wheel] - angle) / turn + 0.5)
            last[wheel] = angle
        out[k] = lag * (ratio * last[0] + last[1])


def _taken(part: Solution, turned: _Turned) -> np.ndarray:
    """Return what is recorded of a part of a solution, shape (m, 13): forces, transmission error, contact.

    Each column is on end in memory, as filters take it.
    """
    forces, wheels, told = map(part.reaction_force, rig.SEATS), map(part.orientation, rig.GEARS), part.contact(rig.MESH)
    columns = np.empty((FORCES + 1 + len(CONTACT), part.t.size)).T
    for k, force in enumerate(forces):
        columns[:, 3 * k : 3 * k + 3] = force
    x, y, z = columns[:, 3 : FORCES - 1].T
    columns[:, FORCES - 1] = np.sqrt(x * x + y * y + z * z)
    columns[:, FORCES] = turned.error(*wheels)
    for k, name in enumerate(CONTACT, FORCES + 1):
        columns[:, k] = told[name]
    return columns


def _joined(parts: Sequence[Taken]) -> Measured:
    """Return times and columns of some parts as one."""
    t, found = zip(*parts, strict=True)
    columns = np.concatenate(found)
    return _named(np.concatenate(t), columns[:, : -len(COUNTS)], columns[:, -len(COUNTS) :])


def _named(t: np.ndarray, columns: np.ndarray, counts: np.ndarray) -> Measured:
    """Return columns of `_taken`, the last of them apart, by their names."""
    contact = {name: columns[:, FORCES + 1 + k] for k, name in enumerate(SMOOTH)}
    contact |= {name: counts[:, k] for k, name in enumerate(COUNTS)}
    return Measured(t, columns[:, :FORCES], columns[:, FORCES], contact)


def measure(case: Case, solution: Solution, rows: np.ndarray | None = None) -> Measured:
    """Return what a record is made from at the output times ``rows`` of a solution, default all."""
    turned = _Turned(case)
    return _joined([(part.t.copy(), _taken(part, turned)) for part in solution.parts(rows)])


def slip(pair: GearPair, t: np.ndarray, transmission_error: np.ndarray) -> str | None:
    """Return a sentence about the first time teeth of a pair passed each other, or None if they never did.

    Parameters
    ----------
    pair : GearPair
    t, transmission_error : ndarray, shape (m,)
        s and m, at the driven base circle.
    """
    limit = SLIPPED * pair.driver.base_pitch
    beyond = np.flatnonzero(~(np.abs(transmission_error) <= limit))
    if beyond.size == 0:
        return None
    first = int(beyond[0])
    return (
        f"the wheels slipped past each other: at t = {t[first]:.6g} s the transmission error passes half a base pitch "
        f"({limit * 1e3:.4g} mm). The contact does not hold the load; raise contact.stiffness, or lower "
        "operation.torque or operation.speed, or make operation.run_up longer"
    )


def rows_of_record(case: Case, t: np.ndarray, begin: float | None = None) -> np.ndarray:
    """Return the numbers of the output times a record is made from.

    Before ``begin``, by default of the span of its filters, only a few are needed, to follow the turning wheels.
    """
    first = int(np.searchsorted(t, span_begin(case) if begin is None else begin))
    teeth = case.gears.teeth
    turn = 2.0 * np.pi / (case.operation.top_speed * max(1.0, teeth[0] / teeth[1]))
    interval = np.floor(t[: first + 1] / (TURN_BEFORE * turn))
    return np.concatenate([np.flatnonzero(np.diff(interval) > 0.0), np.arange(first, t.size)])


def span_of(case: Case) -> Span:
    """Return when the record of a case begins and ends, if it does not depend on the motion."""
    operation = case.operation
    start = operation.run_up + operation.settling
    return Span(start, start + operation.longest)


def span_begin(case: Case) -> float:
    """Return the time at which the span of a record's filters begins, s."""
    return span_of(case).start - case.edge - (MARGIN + 1) / case.output_rate


class Separations:
    """Adds up the time behind the run-up in which no drive flanks touch, where a record does not show all of it.

    Parameters
    ----------
    case : Case
    """

    def __init__(self, case: Case) -> None:
        self._begin = case.operation.run_up
        self._apart = self._whole = 0.0
        self._last = math.nan

    def take(self, part: Solution) -> None:
        """Take the next steps of a run."""
        t = part.t
        later = t > self._begin
        if later.any():
            steps = np.diff(t, prepend=self._last if self._last == self._last else t[0])
            touching = part.contact(rig.MESH)["pairs_drive"] > 0.0
            self._whole += float(steps[later].sum())
            self._apart += float(steps[later & ~touching].sum())
        self._last = float(t[-1]) if t.size else self._last

    @property
    def share(self) -> float:
        """Part of that time."""
        return self._apart / self._whole if self._whole > 0.0 else 0.0


class Recorder:
    """Collects what the record of a case needs from the parts of a solution, as a consumer of `simulate`.

    Of the steps before ``begin`` the unknowns are kept, and evaluated only as far as needed.

    Parameters
    ----------
    case : Case
    begin : float, optional
        Time from which all steps are kept, s. By default the record's span is known, and only its samples at the output
        rate are.

    Attributes
    ----------
    slipped : str or None
        A sentence about the first time teeth passed each other.
    """

    def __init__(self, case: Case, begin: float | None = None) -> None:
        self.case = case
        self.slipped: str | None = None
        self._begin = span_begin(case) if begin is None else begin
        self._early: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self._turned: _Turned | None = None
        self._parts: list[Taken] = []
        self._samples: EvenSamples | None = None
        if begin is None:
            (start, stop), ahead = span_of(case), case.edge
            self._samples = EvenSamples(
                case.output_rate, start - ahead, stop + ahead, smooth=1, linear=len(SMOOTH), held=len(COUNTS)
            )
        self._model: Solution | None = None

    @property
    def is_empty(self) -> bool:
        """Whether nothing has been taken yet."""
        return self._model is None

    @property
    def is_even(self) -> bool:
        """Whether samples at the output rate are kept instead of steps."""
        return self._samples is not None

    def take(self, part: Solution) -> None:
        """Take the next steps of a run."""
        if self._turned is not None:
            self._add(part, self._turned)
            return
        if self._model is None:
            self._model = part.over(np.empty(0), part.result.y[:0], part.result.epochs)
        before = sum(t.size for t, _, _ in self._early)
        self._early.append((part.t.copy(), part.result.y.copy(), part.result.epochs[0][1]))
        if part.t[-1] < self._begin:
            return
        self._turned = _Turned(self.case)
        wanted = rows_of_record(self.case, np.concatenate([t for t, _, _ in self._early]), self._begin)
        # what this part has been read already is not evaluated
        anew = wanted[wanted < before] if {*WATCHED} <= part.at_steps.keys() else wanted
        for piece in self._solution_over(anew).parts() if anew.size else ():
            self._add(piece, self._turned)
        if anew.size < wanted.size:
            self._add(some_of(part, wanted[anew.size :] - before), self._turned)

    def repeat(self, period: Solution, copies: Sequence[tuple[np.ndarray, float]]) -> None:
        """Take steps of a motion that repeats itself more than once, which are evaluated once.

        Parameters
        ----------
        period : Solution
            A period of it.
        copies : sequence of (ndarray, float)
            Which of its steps are taken, and how much later than they were, s.
        """
        self._model, self._turned = period, _Turned(self.case)
        columns = np.concatenate([_taken(part, self._turned) for part in period.parts()])
        self.slipped = slip(self._turned.pair, period.t, columns[:, FORCES])
        self._parts += [(period.t[rows] + later, columns[rows]) for rows, later in copies]

    def _add(self, part: Solution, turned: _Turned) -> None:
        """Keep what is recorded of a part of a solution."""
        t, columns = part.t.copy(), _taken(part, turned)
        self.slipped = self.slipped or slip(turned.pair, t, columns[:, FORCES])
        if self._samples is None:
            self._parts.append((t, columns))
        else:
            self._samples.take(t, columns)

    def measured(self) -> Measured:
        """Return what the record is made from: samples, or all steps inside the span of its filters and some before."""
        if self._samples is not None:
            return _named(self._samples.t, *self._samples.finish())
        return _joined(self._parts)

    def tail(self, after: float) -> Measured:
        """Return what was taken after a time, and a little before."""
        first = next((k for k, (t, _) in enumerate(self._parts) if t[-1] > after), 0)
        return _joined(self._parts[first:])

    def everything(self) -> Measured:
        """Return what was taken from the start on, for a run that failed: samples where steps are not kept."""
        early, turned = self._solution_over(), _Turned(self.case)
        parts = [(part.t.copy(), _taken(part, turned)) for part in early.parts()]
        for t, columns in self._parts if self._samples is None else self._samples.known():
            first = int(np.searchsorted(t, early.t[-1], side="right"))
            parts.append((t[first:], columns[first:]))
        return _joined(parts)

    def _solution_over(self, wanted: np.ndarray | None = None) -> Solution:
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
