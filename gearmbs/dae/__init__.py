"""Differential-algebraic equations G(t, y, y') = 0: a solver for any, and the equations of mechanisms."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.dae.integrators.options import Options
    from gearmbs.dae.integrators.wstiff import resume
    from gearmbs.dae.problem import DAEProblem
    from gearmbs.dae.result import DAEResult, SolverStats, Status
    from gearmbs.dae.solve import solve_dae

__all__ = ["DAEProblem", "DAEResult", "Options", "SolverStats", "Status", "resume", "solve_dae"]

late(
    __name__,
    {
        "DAEProblem": ".problem",
        "DAEResult": ".result",
        "Options": ".integrators.options",
        "SolverStats": ".result",
        "Status": ".result",
        "resume": ".integrators.wstiff",
        "solve_dae": ".solve",
    },
)
