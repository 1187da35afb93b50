"""A mechanism at rest at one or several times, as a solution: reactions and loads are those of the equilibrium."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearmbs.dae.analyses.instant import Instant
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations import output_records
from gearmbs.dae.equations.counted_angles import AXES
from gearmbs.dae.model.evaluator import Records
from gearmbs.dae.model.system import System
from gearmbs.dae.problem import DAEProblem
from gearmbs.dae.result import DAEResult, SolverStats, Status
from gearmbs.dae.results.solution import Solution


@dataclass(frozen=True)
class Snapshot:
    """The unknowns y at one time with their tables."""

    system: System
    problem: DAEProblem
    t: float
    y: np.ndarray
    idata: np.ndarray
    rdata: np.ndarray

    @classmethod
    def of(cls, instant: Instant) -> Snapshot:
        """Return a copy of an instant's present state."""
        copies = (instant.y.copy(), instant.idata.copy(), instant.rdata.copy())
        return cls(instant.system, instant.problem, instant.t, *copies)

    @staticmethod
    def result(message: str, iterations: int, rows: Sequence[Snapshot]) -> DAEResult:
        """Return snapshots as what an integrator would have stored."""
        y = np.array([row.y for row in rows])
        return DAEResult(
            t=np.array([row.t for row in rows]),
            y=y,
            yp=np.zeros_like(y),
            status=Status.SUCCESS,
            message=message,
            stats=SolverStats(steps=iterations),
            epochs=[(k, row.idata) for k, row in enumerate(rows)],
            t_last=rows[-1].t,
        )


class EquilibriumSolution(Solution):
    """Equilibria over time: nothing moves, whatever the rates of motions and constraints.

    Make one with :meth:`of`.
    """

    def __init__(self, rows: Sequence[Snapshot], result: DAEResult) -> None:
        self._rows = rows
        super().__init__(rows[0].system, rows[0].problem, result)
        # at once, for a part of it is none
        self._records = self._evaluate()

    @classmethod
    def of(cls, rows: Sequence[Snapshot], message: str, iterations: int) -> EquilibriumSolution:
        """Return the solution of snapshots of equilibria."""
        return cls(rows, Snapshot.result(message, iterations, rows))

    def counted(self, row: int = 0) -> dict[tuple[str, int, int], float]:
        """Return all counted angles at one time, rad, by function and markers I and J."""
        snapshot, model = self._rows[row], self.system.model
        first = int(snapshot.idata[T.H_R_EXTRA])
        found: dict[tuple[str, int, int], float] = {}
        for tape, where in zip(model.tapes, model.tape_rows):
            at = first + int(where[T.TAPE_REFERENCE]) + tape.n_angles
            found.update(zip(tape.angles, snapshot.rdata[at : at + tape.n_angles].tolist()))
        for axis, i, j, at in model.angles:
            found[AXES[axis], i, j] = float(snapshot.rdata[first + at + 1])
        return found

    def _evaluate(self) -> Records:
        """Take multipliers and loads from the unknowns; the diagnostics of contacts as in a motion."""
        records = super()._evaluate()
        records.by_body[:, :, 12:18] = 0.0
        records.accelerations[:] = 0.0
        rows = len(self.system.row_names)
        multipliers = np.zeros((2, max(rows, 1)))
        for k, row in enumerate(self._rows):
            y, idata = row.y, row.idata
            out, work = np.zeros(y.size), np.zeros(row.problem.work_size)
            row.problem.residual(row.t, y, np.zeros(y.size), out, idata, row.rdata, work)
            lam = int(idata[T.H_LAMBDA])
            multipliers[0, :rows] = y[lam : lam + rows]
            multipliers[1, 0] = row.t
            records.multipliers[k] = y[lam : lam + rows]
            records.phi[k] = 0.0
            records.by_row[k, :, 0] = out[lam : lam + rows]
            output_records.joint_loads(y, idata, row.rdata, work, multipliers, records.force[k], records.moment[k])
            table = idata[int(idata[T.H_I_FORCE]) : int(idata[T.H_I_FUNCTION])].reshape(-1, T.FORCE_COLUMNS)
            for f, force in enumerate(table):
                for column, first in ((T.FORCE_F, 0), (T.FORCE_N, 3)):
                    at = int(force[column])
                    records.loads[k, f, first : first + 3] = y[at : at + 3] if at >= 0 else 0.0
        return records
