"""What an integration returns: outputs, how it ended, what it cost, and the interpolant between."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gearmbs.dae.dense_output import DenseOutput


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
    t_steps, h_steps, orders : ndarray, shape (steps,)
        End time, size and order of each accepted step (empty when the integrator does not tell).
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
    t_last : float
        Time the integration reached, which may lie beyond the last output.
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
    t_last: float = float("nan")
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
