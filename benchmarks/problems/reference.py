"""Reference solutions: exact, published, or computed by a method that shares nothing with the integrators.

* pendulum: Jacobi elliptic functions
* slider crank: the one-degree-of-freedom equation of motion by DOP853
* car axis, Andrews: published end values [1]_
* heavy top: Euler's equations with a quaternion by DOP853
* four-bar chain: the equivalent physical pendulum by DOP853

References
----------
.. [1] F. Mazzia, C. Magherini, "Test Set for Initial Value Problem Solvers", release 2.4, University of Bari (2008).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

from benchmarks.problems.andrews import andrews
from benchmarks.problems.chain import chain_reference, four_bar_chain
from benchmarks.problems.small import GRAVITY, car_axis, heavy_top, pendulum, slider_crank
from gearmbs.dae.problem import DAEProblem

TIGHT = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}
PENDULUM_PERIOD = 4.0 / np.sqrt(GRAVITY) * float(ellipk(0.5))

CAR_AXIS_END = np.array(
    [
        0.493455784275402809122e-1,
        0.496989460230171153861,
        0.104174252488542151681e1,
        0.373911027265361256927,
        -0.770583684040972357970e-1,
        0.744686658723778553466e-2,
        0.175568157537232222276e-1,
        0.770341043779251976443,
    ]
)

ANDREWS_END = np.array(
    [
        0.1581077119629904e2,
        -0.1575637105984298e2,
        0.4082224013073101e-1,
        -0.5347301163226948,
        0.5244099658805304,
        0.5347301163226948,
        0.1048080741042263e1,
        0.1139920302151208e4,
        -0.1424379294994111e4,
        0.1103291221937134e2,
        0.1929337464421385e2,
        0.5735699284790808,
        -0.1929337464421385e2,
        0.3231791658026955,
    ]
)


@dataclass(frozen=True)
class ReferenceProblem:
    """A standard problem with a trustworthy solution.

    Attributes
    ----------
    name, source : str
        What it is and where its reference comes from.
    make : callable
        ``make(formulation)`` returns the `DAEProblem`.
    times : ndarray
        Where the reference is given; the first is the start.
    reference : ndarray, shape (m, k)
        Positions and velocities there.
    columns : ndarray of int, shape (k,)
        Which unknowns these are.
    """

    name: str
    source: str
    make: Callable[[str], DAEProblem]
    times: np.ndarray
    reference: np.ndarray
    columns: np.ndarray

    def error(self, t: np.ndarray, y: np.ndarray) -> float:
        """Return the largest error over times and unknowns, relative to the larger of one and the reference."""
        rows = np.searchsorted(self.times, t)
        exact = self.reference[rows]
        return float(np.max(np.abs(y[:, self.columns] - exact) / np.maximum(1.0, np.abs(exact))))


def _pendulum_solution(times: np.ndarray) -> np.ndarray:
    """Angle from the vertical with sin(theta/2) = k sn(K - omega t), k = sin(45 deg); q = (sin, -cos)."""
    omega = np.sqrt(GRAVITY)
    sn, cn, dn, _ = ellipj(ellipk(0.5) - omega * times, 0.5)
    k = np.sqrt(0.5)
    theta = 2.0 * np.arcsin(k * sn)
    rate = -2.0 * k * omega * cn * dn / np.sqrt(1.0 - (k * sn) ** 2)
    return np.column_stack((np.sin(theta), -np.cos(theta), rate * np.cos(theta), rate * np.sin(theta)))


def _slider_crank_rates(t: float, s: np.ndarray) -> tuple[float, float]:
    """One equation of motion in the crank angle: kinetic energy I(q) q'^2/2, power of spring, damper and load."""
    a, j1, m2, j2, k, c, l0, load = 0.5, 1.0, 1.0, 2.0, 1.0, 1.0, 1.0, 1.0
    q, w = s
    r = -np.arcsin(a * np.sin(q))
    r1 = -a * np.cos(q) / np.cos(r)
    r2 = (a * np.sin(q) + np.sin(r) * r1**2) / np.cos(r)
    x1 = -a * np.sin(q) - np.sin(r) * r1
    x2 = -a * np.cos(q) - np.cos(r) * r1**2 - np.sin(r) * r2
    x = a * np.cos(q) + np.cos(r)
    crank = np.array([0.5 * a * np.cos(q), 0.5 * a * np.sin(q)])
    rod = np.array([x - 0.5 * np.cos(r), -0.5 * np.sin(r)])
    crank1 = np.array([-0.5 * a * np.sin(q), 0.5 * a * np.cos(q)])
    rod1 = np.array([x1 + 0.5 * np.sin(r) * r1, -0.5 * np.cos(r) * r1])
    span, span1 = rod - crank, rod1 - crank1
    length = np.hypot(*span)
    length1 = span @ span1 / length
    inertia = j1 + m2 * x1**2 + j2 * r1**2
    inertia1 = 2.0 * (m2 * x1 * x2 + j2 * r1 * r2)
    spring = k * (length - l0) + c * length1 * w
    generalised = -spring * length1 + load * x1 - load * np.sin(r) * r1
    return w, (generalised - 0.5 * inertia1 * w * w) / inertia


def _slider_crank_solution(times: np.ndarray) -> np.ndarray:
    s = solve_ivp(_slider_crank_rates, (0.0, times[-1]), (0.5 * np.pi, 0.0), t_eval=times, **TIGHT).y
    q, w = s
    r = -np.arcsin(0.5 * np.sin(q))
    rod_rate = -0.5 * np.cos(q) / np.cos(r) * w
    x_rate = -0.5 * np.sin(q) * w - np.sin(r) * rod_rate
    return np.column_stack((q, 0.5 * np.cos(q) + np.cos(r), r, w, x_rate, rod_rate))


def _heavy_top_solution(times: np.ndarray) -> np.ndarray:
    inertia = np.array([0.234375, 0.46875, 0.234375])
    mass, arm = 15.0, np.array([0.0, 1.0, 0.0])
    about_pivot = inertia + mass * np.array([1.0, 0.0, 1.0])

    def rotation(p):
        w, x, y, z = p / np.linalg.norm(p)
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    def rates(t, s):
        p, o = s[:4], s[4:]
        moment = np.cross(arm, rotation(p).T @ np.array([0.0, 0.0, -mass * GRAVITY]))
        turn = 0.5 * np.array(
            [
                -p[1] * o[0] - p[2] * o[1] - p[3] * o[2],
                p[0] * o[0] + p[2] * o[2] - p[3] * o[1],
                p[0] * o[1] + p[3] * o[0] - p[1] * o[2],
                p[0] * o[2] + p[1] * o[1] - p[2] * o[0],
            ]
        )
        return np.concatenate((turn, (moment - np.cross(o, about_pivot * o)) / about_pivot))

    start = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 150.0, -4.61538])
    out = []
    for s in solve_ivp(rates, (0.0, times[-1]), start, t_eval=times, **TIGHT).y.T:
        a = rotation(s[:4])
        spin = np.cross(a @ s[4:], a.T)
        out.append(np.concatenate((a[:, 1], a.T.ravel(), spin[1], spin.ravel())))
    return np.array(out)


def chain_problem(loops: int, t_end: float) -> ReferenceProblem:
    """Return a chain of four-bar linkages with the angle and rate of its first and last upright link."""
    times = np.linspace(0.0, t_end, 5)
    nq = 3 * (2 * loops + 1)
    columns = np.array([[3 * body + 2, nq + 3 * body + 2] for body in (0, 2 * loops)]).ravel()
    return ReferenceProblem(
        f"four-bar chain N={loops}",
        "equivalent physical pendulum, DOP853 at 1e-13",
        lambda formulation: four_bar_chain(loops, formulation),
        times,
        np.tile(chain_reference(loops, times).T, (1, 2)),
        columns,
    )


@cache
def reference_problems() -> dict[str, ReferenceProblem]:
    """Return the standard problems by name."""
    periods = np.array([0.0, 0.25, 0.5, 1.0, 2.3, 5.0]) * PENDULUM_PERIOD
    crank_times = np.linspace(0.0, 10.0, 11)
    top_times = np.linspace(0.0, 0.5, 6)
    problems = (
        ReferenceProblem(
            "pendulum", "exact, elliptic functions", pendulum().problem, periods,
            _pendulum_solution(periods), np.arange(4),
        ),
        ReferenceProblem(
            "slider crank",
            "one-degree-of-freedom equation, DOP853 at 1e-13",
            slider_crank().problem,
            crank_times,
            _slider_crank_solution(crank_times),
            np.arange(6),
        ),
        ReferenceProblem(
            "car axis", "published, Bari test set", car_axis().problem, np.array([0.0, 3.0]),
            np.vstack((np.concatenate((car_axis().q0, car_axis().v0)), CAR_AXIS_END)), np.arange(8),
        ),
        ReferenceProblem(
            "Andrews", "published, Bari test set", andrews().problem, np.array([0.0, 0.03]),
            np.vstack((np.concatenate((andrews().q0, np.zeros(7))), ANDREWS_END)), np.arange(14),
        ),
        ReferenceProblem(
            "heavy top", "Euler's equations with a quaternion, DOP853 at 1e-13", heavy_top().problem, top_times,
            _heavy_top_solution(top_times), np.arange(24),
        ),
        chain_problem(10, 2.0),
    )  # fmt: skip
    return {p.name: p for p in problems}
