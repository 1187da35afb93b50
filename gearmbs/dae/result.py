"""What an integration returns: outputs, how it ended, what it cost, and the interpolant between."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types

# Dense output: the BDF polynomials of all steps, evaluated anywhere in the span.


_VEC = float64[::1]
_MAT = float64[:, ::1]
_IVEC = int64[::1]


@njit(types.void(float64, _VEC, int64, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def lagrange_weights(t, nodes, count, value, slope):
    """Weights of the polynomial through ``count`` nodes, for its value and its slope at ``t``.

    Parameters
    ----------
    t : float
        Where the polynomial is wanted.
    nodes : ndarray
        Distinct times; the first ``count`` are used.
    count : int
        Number of nodes, one more than the degree.
    value, slope : ndarray
        Written in the first ``count`` places.
    """
    for j in range(count):
        # value and derivative of prod_m (t - t_m)/(t_j - t_m) by the product rule
        v = 1.0
        d = 0.0
        tj = nodes[j]
        for m in range(count):
            if m != j:
                q = 1.0 / (tj - nodes[m])
                d = (d * (t - nodes[m]) + v) * q
                v *= (t - nodes[m]) * q
        value[j] = v
        slope[j] = d


@njit(types.void(_VEC, _VEC, int64, _MAT, int64, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def combine(value, slope, count, rows, first, y, yp):
    """Write ``y = sum value[j] rows[first + j]`` and ``yp`` likewise with ``slope``."""
    n = y.shape[0]
    for i in range(n):
        y[i] = value[0] * rows[first, i]
        yp[i] = slope[0] * rows[first, i]
    for j in range(1, count):
        a = value[j]
        b = slope[j]
        for i in range(n):
            y[i] += a * rows[first + j, i]
            yp[i] += b * rows[first + j, i]


@njit(types.void(_VEC, _IVEC, _IVEC, _VEC, _MAT, _MAT, _MAT), cache=True, nogil=True, error_model="numpy")
def evaluate_many(times, ends, orders, nodes, rows, y, yp):
    """Write value and slope at each of ``times``, on the polynomial of the step that ends in row ``ends[i]``."""
    value = np.empty(8)
    slope = np.empty(8)
    for i in range(times.shape[0]):
        k = orders[ends[i]]
        lagrange_weights(times[i], nodes[ends[i] - k : ends[i] + 1], k + 1, value, slope)
        combine(value, slope, k + 1, rows, ends[i] - k, y[i], yp[i])


DENSE_LEVELS = 24
"""Halvings of a step at most: a kink is placed within 1e-7 of it, beyond which a table would not be worth its room."""


class Settles(Protocol):
    """What solves for unknowns that the polynomials say nothing about."""

    unknowns: np.ndarray
    atol: np.ndarray
    rtol: float

    def __call__(self, times, ends, orders, nodes, rows, y, yp) -> None:
        """Write y and y' at ``times``; arguments are those of `evaluate_many`."""
        ...


class Table:
    """Cubic polynomials over intervals that are as short as the tolerance asks for, for some unknowns.

    Parameters
    ----------
    unknowns : ndarray of int, shape (a,)
    t : ndarray, shape (m,)
        Ends of intervals, increasing.
    left, right : ndarray, shape (m - 1, 2, a)
        Values and slopes just inside both ends of each interval.
    """

    def __init__(self, unknowns: np.ndarray, t: np.ndarray, left: np.ndarray, right: np.ndarray) -> None:
        self.unknowns, self.t, self.left, self.right = unknowns, t, left, right

    def write(self, times: np.ndarray, y: np.ndarray, yp: np.ndarray) -> None:
        """Write values and slopes of the unknowns at ``times``."""
        k = np.clip(np.searchsorted(self.t, times, side="left") - 1, 0, len(self.t) - 2)
        y[:, self.unknowns], yp[:, self.unknowns] = hermite(
            times, self.t[k], self.t[k + 1], self.left[k], self.right[k]
        )


def hermite(t: np.ndarray, a: np.ndarray, b: np.ndarray, left: np.ndarray, right: np.ndarray) -> tuple[Any, Any]:
    """Return value and slope of the cubic with values and slopes ``left`` at a, ``right`` at b, shape (m, 2, unknowns).

    Returns
    -------
    y, yp : ndarray, shape (m, unknowns)
    """
    h = (b - a)[:, None]
    s = (t - a)[:, None] / h
    d = right[:, 0] - left[:, 0]
    p, q = left[:, 1] * h - d, d - right[:, 1] * h
    # Hermite's form: the chord, and s (1 - s) times what the slopes at both ends leave of it
    y = left[:, 0] + s * d + s * (1.0 - s) * ((1.0 - s) * p + s * q)
    yp = (d + (1.0 - 2.0 * s) * ((1.0 - s) * p + s * q) + s * (1.0 - s) * (q - p)) / h
    return y, yp


class DenseOutput:
    """Piecewise polynomial through the stored points of a BDF run.

    Each step of order k is the polynomial through its end point and the k points stored before it. Where the
    stored history was rewritten (a change of coordinates, a restart, a re-interpolation) the new history
    precedes the next step as rows of order 0.

    Parameters
    ----------
    t : ndarray, shape (r,)
        Times of the stored points.
    y : ndarray, shape (r, n)
        Values of the stored points.
    orders : ndarray of int, shape (r,)
        Order of the step that ends in each point, 0 for points that only serve as history.
    between : Settles, optional
        Solves for algebraic unknowns outside error control, about which the polynomials say nothing. It needs the
        functions of the problem, which do not travel: a pickled solution holds a `Table` of these unknowns instead, as
        fine as their tolerances ask for.
    """

    def __init__(self, t: np.ndarray, y: np.ndarray, orders: np.ndarray, between: Settles | None = None):
        self._between = between
        self._table: Table | None = None
        self._t = np.ascontiguousarray(t, dtype=float)
        self._y = np.ascontiguousarray(y, dtype=float)
        self._orders = np.ascontiguousarray(orders, dtype=np.int64)
        self._steps = np.flatnonzero(self._orders > 0)
        self._ends = self._t[self._steps]
        self.t_min = float(self._t[self._steps[0] - 1]) if len(self._steps) else float(self._t[0])
        self.t_max = float(self._ends[-1]) if len(self._steps) else float(self._t[0])

    def evaluate(self, t: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return y and y' at ``t``.

        Parameters
        ----------
        t : float or ndarray, shape (m,)
            Times within ``[t_min, t_max]``.

        Returns
        -------
        y, yp : ndarray, shape (n,) or (m, n)

        Raises
        ------
        ValueError
            If a time lies outside the span of the run.
        """
        times = np.atleast_1d(np.asarray(t, dtype=float))
        slack = 1e-12 * max(abs(self.t_min), abs(self.t_max))
        if times.size and (times.min() < self.t_min - slack or times.max() > self.t_max + slack):
            raise ValueError(
                f"t = {times.min():g} .. {times.max():g} leaves the integrated span {self.t_min:g} .. {self.t_max:g}; "
                "integrate further to evaluate there"
            )
        y = np.empty((times.size, self._y.shape[1]))
        yp = np.empty_like(y)
        if not len(self._steps):
            y[:] = self._y[0]
            yp[:] = 0.0
        else:
            pieces = np.minimum(np.searchsorted(self._ends, times, side="left"), len(self._steps) - 1)
            self._evaluate_on(self._steps[pieces], times, y, yp)
        if np.ndim(t) == 0:
            return y[0], yp[0]
        return y, yp

    def __call__(self, t: float | np.ndarray) -> np.ndarray:
        """Return y at ``t``, shape (n,) or (m, n)."""
        return self.evaluate(t)[0]

    def derivative(self, t: float | np.ndarray) -> np.ndarray:
        """Return y' at ``t``, shape (n,) or (m, n)."""
        return self.evaluate(t)[1]

    def stored(self) -> tuple[np.ndarray, np.ndarray]:
        """Return times of the stored points, and orders of the steps that end there, 0 for history alone."""
        return self._t, self._orders

    def polynomials(self) -> DenseOutput:
        """Return the polynomials alone, without what solves for algebraic unknowns between steps."""
        return DenseOutput(self._t, self._y, self._orders)

    def _evaluate_on(self, ends: np.ndarray, times: np.ndarray, y: np.ndarray, yp: np.ndarray) -> None:
        """Write y and y' at times within the steps that end in the rows ``ends``."""
        if self._between is not None:
            self._between(times, ends, self._orders, self._t, self._y, y, yp)
            return
        evaluate_many(times, ends, self._orders, self._t, self._y, y, yp)
        if self._table is not None:
            self._table.write(times, y, yp)

    def __getstate__(self) -> dict[str, Any]:
        state = self.__dict__.copy()
        if self._between is not None and len(self._steps):
            state["_table"] = self._tabulated(self._between)
        state["_between"] = None
        return state

    def _tabulated(self, between: Settles) -> Table:
        """Return a table of what is solved for: intervals are halved until cubics meet a tenth of the tolerance.

        They are compared where they are the furthest from the values that made them, in the middle, and at a quarter.
        """
        columns, atol, rtol = between.unknowns, between.atol, between.rtol

        def solved(times: np.ndarray, ends: np.ndarray) -> np.ndarray:
            y, yp = np.empty((times.size, self._y.shape[1])), np.empty((times.size, self._y.shape[1]))
            self._evaluate_on(ends, times, y, yp)
            return np.stack((y[:, columns], yp[:, columns]), axis=1)

        ends = self._steps
        a, b = np.append(self.t_min, self._ends[:-1]), self._ends
        left, right = solved(a, ends), solved(b, ends)
        done: list[tuple[np.ndarray, ...]] = []
        for level in range(DENSE_LEVELS + 1):
            middle = 0.5 * (a + b)
            exact = solved(middle, ends)
            off = np.zeros(a.size, dtype=bool)
            for t, value in ((middle, exact), (quarter := a + 0.25 * (b - a), solved(quarter, ends))):
                cubic = hermite(t, a, b, left, right)[0]
                off |= (np.abs(cubic - value[:, 0]) > 0.1 * (atol + rtol * np.abs(value[:, 0]))).any(axis=1)
            if level == DENSE_LEVELS:
                off[:] = False
            done.append((a[~off], b[~off], left[~off], right[~off]))
            if not off.any():
                break
            a, b, middle = a[off], b[off], middle[off]
            left, right, exact = left[off], right[off], exact[off]
            a, b, ends = np.concatenate((a, middle)), np.concatenate((middle, b)), np.tile(ends[off], 2)
            left, right = np.concatenate((left, exact)), np.concatenate((exact, right))
        a, b, left, right = (np.concatenate(parts) for parts in zip(*done, strict=True))
        order = np.argsort(a)
        return Table(columns, np.append(a[order], b.max()), left[order], right[order])


class Status(enum.IntEnum):
    """How an integration ended; every member carries a sentence for the modeller.

    Negative values are failures. ``Status.X.sentence`` is the explanation without run-time details;
    `DAEResult.message` adds the time, the unknown and the remedy.
    """

    sentence: str

    def __new__(cls, value: int, sentence: str) -> Status:
        member = int.__new__(cls, value)
        member._value_ = value
        member.sentence = sentence
        return member

    SUCCESS = 0, "The integration reached the end of the time span."
    TERMINAL_EVENT = 1, "A terminal event stopped the integration."
    INTERRUPTED = -1, "The integration was interrupted; what was computed until then is kept."
    SINGULAR_JACOBIAN = -2, "The Newton matrix is singular: some unknown is not determined by the equations."
    NOT_FINITE = -3, "The equations returned a value that is not finite."
    STEP_TOO_SMALL = -4, "The step size fell to its lower limit before the requested accuracy was reached."
    TOO_MANY_REJECTIONS = -5, "One step was rejected too many times."
    INCONSISTENT_START = -6, "The initial values do not satisfy the equations."
    TOO_MANY_STEPS = -7, "The limit on the number of steps was reached."
    USER_ERROR = -8, "A user function raised an exception."
    NEWTON_FAILURE = -9, "The corrector did not converge even with a fresh Jacobian at the smallest step."
    SOLVER_FAILURE = -10, "The external integrator gave up."
    CONFLICTING_CONSTRAINTS = -11, "A constraint removed as redundant was violated by the motion."
    STALLED = -12, "The steps have become so small that the run would never end."
    BELOW_ROUNDING = -13, "The tolerance is below the rounding of double precision."


@dataclass
class SolverStats:
    """Counts and histories of one integration.

    Attributes
    ----------
    steps : int
        Accepted steps.
    error_rejections, newton_rejections : int
        Steps repeated because the local error was too large, or because the corrector failed.
    residuals, jacobians, factorizations, solves : int
        Evaluations of G, evaluations of the Newton matrix, its factorisations, and triangular solves. Residuals
        spent on a differenced Jacobian are not in ``residuals``.
    repivots : int
        Times the sparse factorisation had to choose new pivots.
    noise_limited : int
        Steps taken at the level of rounding, near singular positions, where no step could satisfy the tolerance.
    wall_time : float
        Seconds spent in the integrator.
    processor_times : dict of float
        Processor seconds of the thread by part: ``"steps"`` in compiled code, ``"pivots"`` chosen anew, ``"consumer"``
        of the steps that are handed over (empty when the integrator does not tell).
    t_steps, h_steps, orders : ndarray, shape (steps,)
        End time, size and order of each accepted step (empty when the integrator does not tell, or a consumer has
        taken the steps).
    """

    steps: int = 0
    error_rejections: int = 0
    newton_rejections: int = 0
    residuals: int = 0
    jacobians: int = 0
    factorizations: int = 0
    solves: int = 0
    repivots: int = 0
    noise_limited: int = 0
    wall_time: float = 0.0
    processor_times: dict[str, float] = field(default_factory=dict)
    t_steps: np.ndarray = field(default_factory=lambda: np.empty(0))
    h_steps: np.ndarray = field(default_factory=lambda: np.empty(0))
    orders: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    def as_dict(self) -> dict[str, float]:
        """Return the scalar counts as a dictionary, for attributes and reports."""
        return {
            name: getattr(self, name)
            for name in (
                "steps",
                "error_rejections",
                "newton_rejections",
                "residuals",
                "jacobians",
                "factorizations",
                "solves",
                "repivots",
                "noise_limited",
                "wall_time",
            )
        }

    def __str__(self) -> str:
        return (
            f"{self.steps} steps ({self.error_rejections} rejected for error, {self.newton_rejections} for the "
            f"corrector), {self.residuals} residuals, {self.jacobians} Jacobians, {self.factorizations} "
            f"factorisations ({self.repivots} re-pivoted), "
            + (f"{self.noise_limited} steps at the level of rounding, " if self.noise_limited else "")
            + f"{self.wall_time:.3g} s"
        )


class Kept(NamedTuple):
    """Where a run was at the end of one of its steps.

    Attributes
    ----------
    t : float
        s.
    y, yp : ndarray, shape (n,)
    idata, rdata : ndarray
        The tables of integers and numbers there.
    """

    t: float
    y: np.ndarray
    yp: np.ndarray
    idata: np.ndarray
    rdata: np.ndarray


@dataclass
class DAEResult:
    """Solution of a DAE G(t, y, y') = 0.

    Attributes
    ----------
    t : ndarray, shape (m,)
        Output times reached. When the run fails these are the ones computed until then.
    y, yp : ndarray, shape (m, n)
        Unknowns and their derivatives at ``t``, one row per time; ``yp`` is empty when it was not wanted. ``y`` is
        within the tolerance; ``yp``, the slope of the interpolating polynomial, is one order less accurate.
    status : Status
        How the run ended.
    message : str
        One or two sentences: what happened, when, which unknown, what to try.
    stats : SolverStats
        Counts and histories.
    sol : DenseOutput or None
        Interpolant over the whole span when dense output was asked for: ``sol(t)``, ``sol.derivative(t)``.
    t_events, y_events : list of ndarray
        For each event function the times of its zero crossings and the unknowns there, shapes (e,) and (e, n).
    epochs : list of (int, ndarray)
        Index of the first output row and the integer table ``idata`` that is valid from there on. A run whose
        coordinates never change has one epoch, ``(0, idata)``.
    held : (ndarray of int, ndarray) or None
        Places in the table of numbers ``rdata`` that were changed on the way, and what stands there up to each output,
        shape (m, places).
    counted : ndarray, shape (m, p), or None
        What stood at each output in the places of the problem's `Counted`; None where outputs are steps.
    t_last : float
        Time the integration reached, which may lie beyond the last output.
    kept : Kept or None
        The state that was asked for by ``keep_at``.
    checkpoint : object or None
        State of an interrupted run, to go on from.
    """

    t: np.ndarray
    y: np.ndarray
    yp: np.ndarray
    status: Status
    message: str
    stats: SolverStats = field(default_factory=SolverStats)
    sol: DenseOutput | None = None
    t_events: list[np.ndarray] = field(default_factory=list)
    y_events: list[np.ndarray] = field(default_factory=list)
    epochs: list[tuple[int, np.ndarray]] = field(default_factory=list)
    held: tuple[np.ndarray, np.ndarray] | None = None
    counted: np.ndarray | None = None
    t_last: float = float("nan")
    kept: Kept | None = None
    checkpoint: Any = None

    @property
    def success(self) -> bool:
        """True when the end of the span or a terminal event was reached."""
        return self.status >= 0

    def epoch_of(self, row: int) -> np.ndarray:
        """Return the integer table that is valid at output ``row``."""
        table = self.epochs[0][1]
        for first, idata in self.epochs:
            if first <= row:
                table = idata
        return table

    def __repr__(self) -> str:
        span = f"t = {self.t[0]:g} .. {self.t[-1]:g}" if len(self.t) else "no output"
        n = self.y.shape[1] if self.y.ndim == 2 else 0
        return f"<DAEResult {self.status.name}: {span}, {len(self.t)} outputs of {n} unknowns; {self.stats}>"
