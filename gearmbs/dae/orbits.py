"""Periodic orbits: motions that repeat themselves after a period, by shooting with the variational equations.

Let x be the independent ones among the unknowns of a DAE, and P(x) what they are a period T after x, less what they
advance by in each period (what turns, by an angle after which it is as before). An orbit is a fixed point of P.
Newton's method,

    x <- x + (I - M)^{-1} (P(x) - x),    M = dP/dx,

needs M, the monodromy matrix: the solution of the variational equations over the period, from all directions in which x
can start (`gearmbs.dae.tangents`). Its eigenvalues are the Floquet multipliers: what is left of a small disturbance
after a period. If one is larger than 1 the orbit is unstable, and no simulation stays on it.

Differences of two runs would not do: each chooses its own steps. `follow` differentiates the steps that were taken.

References
----------
.. [1] A. H. Nayfeh, B. Balachandran, "Applied Nonlinear Dynamics", Wiley 1995, chapters 3 and 6.
.. [2] R. Seydel, "Practical Bifurcation and Stability Analysis", Springer 2010, chapters 5 and 7.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.linalg

from gearmbs.dae.integrators.options import Options
from gearmbs.dae.methods import INTEGRATORS, those_that
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.result import DAEResult
from gearmbs.dae.tangents import Direction, follow
from gearmbs.wording import any_of

INDEPENDENT = 1e-8
"""Singular value, of the largest, from which directions count: rounding leaves 1e-12 of the coefficients of a scaled
Jacobian, and a body that moves a millionth of another still counts."""
ALIKE = 1e-7
"""Change of an equation over a period, of its terms, that counts as none: angles of a thousand turns are rounded to
1e-13, and a stiffness of 1e9 N/m at an arm of 0.1 m makes 1e-8 of a load of that."""


@dataclass(frozen=True)
class Directions:
    """In which directions consistent states of a DAE can lie beside one of them.

    Attributes
    ----------
    places : ndarray of int, shape (m,)
        Independent unknowns: positions and velocities of the degrees of freedom, and states.
    basis : ndarray, shape (n, m)
        How all unknowns with rates, or under error control, change with them; 0 for the others.
    """

    places: np.ndarray
    basis: np.ndarray


def directions_at(problem: DAEProblem, places: np.ndarray | None = None) -> Directions:
    """Return in which directions the initial values of a problem may be moved.

    Equations without rates hold at each instant, those of velocities with those of positions as in the stabilised form
    of index two: what they leave free of the unknowns with rates is the tangent space. Its independent unknowns are
    chosen by pivots.

    Parameters
    ----------
    problem : DAEProblem
        At consistent values; of index one, or two with all constraints among its equations.
    places : ndarray of int, optional
        Independent unknowns that were chosen at other values; default by pivots here.
    """
    n = problem.n
    scale = np.asarray(problem.scale, dtype=float)
    differential = np.flatnonzero(problem.differential)
    algebraic, rows, _ = algebraic_rows(problem)
    if not algebraic.size:
        return Directions(differential, np.eye(n)[:, differential])
    null = scipy.linalg.null_space(rows, rcond=INDEPENDENT)
    if places is None:
        left, sizes, _ = np.linalg.svd(null[differential], full_matrices=False)
        left = left[:, sizes > INDEPENDENT * sizes.max(initial=0.0)]
        _, _, order = scipy.linalg.qr(left.T, pivoting=True, mode="economic")
        places = np.sort(differential[order[: left.shape[1]]])
    # of what does not change with them, as multipliers, the least is taken
    basis = scale[:, None] * (null @ np.linalg.pinv(null[places], rcond=INDEPENDENT)) / scale[places]
    return Directions(places, np.where(moved_at_start(problem)[:, None], basis, 0.0))


def algebraic_rows(problem: DAEProblem) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the equations without rates, dG_a/dy in units of the unknowns' magnitudes, rows of size one, and sizes.

    Returns
    -------
    places : ndarray of int, shape (a,)
    rows : ndarray, shape (a, n)
    sizes : ndarray, shape (a,)
        By which the equations are divided.
    """
    whole, rates = (_dense(problem, cj) for cj in (0.0, 1.0))
    rates -= whole
    places = np.flatnonzero(~(rates != 0.0).any(axis=1))
    rows = whole[places] * np.asarray(problem.scale, dtype=float)
    sizes = np.maximum(np.abs(rows).max(axis=1, initial=0.0), np.finfo(float).tiny)
    return places, rows / sizes[:, None], sizes


def moved_at_start(problem: DAEProblem) -> np.ndarray:
    """Return which unknowns have a direction at the start; the first step finds the others, ndarray of bool."""
    return np.asarray(problem.error_mask) | np.asarray(problem.differential)


def check_repeats(
    problem: DAEProblem, period: float, advance: np.ndarray, along: DAEResult | None = None, periods: int = 1
) -> None:
    """Refuse equations that are others after a period, or some.

    Parameters
    ----------
    problem, period, advance
        As of `find_orbit`.
    along : DAEResult, optional
        A run over the period: it is looked at some instants of it, and else at its start.
    periods : int
        Over how many periods: parts of what turns that differ are seen once their turn has come.

    Raises
    ------
    ModelError
        That names the equation that changes most.
    """
    rows = np.zeros(1, dtype=np.int64)
    t, y, yp = np.array([problem.t0]), problem.y0[None, :], problem.yp0[None, :]
    if along is not None and along.yp.size:
        rows = np.unique(np.linspace(0, along.t.size - 1, INSTANTS + 2).astype(np.int64)[1:-1])
        t, y, yp = along.t, along.y, along.yp
    tables, work = (problem.idata.copy(), problem.rdata.copy()), np.zeros(problem.work_size)
    terms = np.abs(_dense(problem, 0.0)) @ np.asarray(problem.scale, dtype=float)
    out, later = np.zeros(problem.n), np.zeros(problem.n)
    for row in rows:
        problem.residual(t[row], y[row], yp[row], out, *tables, work)
        # each equation beside what unknowns of their typical magnitude do in it
        size = terms + np.abs(out)
        for k in range(1, periods + 1):
            problem.residual(t[row] + k * period, y[row] + k * advance, yp[row], later, *tables, work)
            change = np.abs(later - out) / np.where(size > 0.0, size, 1.0)
            worst = int(np.argmax(change))
            if change[worst] > ALIKE * k:
                after = "it" if k == 1 else f"{k} of it"
                raise ModelError(
                    f"period = {period:.9g} s: the equation of {problem.names[worst]} is another one after {after}, by "
                    f"{change[worst]:.1e} of its terms; give the period of all motions and loads, after which "
                    "all that turns stands as before, counted from a time behind all run-ups (t_start)"
                )


def _dense(problem: DAEProblem, cj: float) -> np.ndarray:
    """Return dG/dy + cj dG/dy' at the start."""
    vals = np.zeros(len(problem.indices))
    problem.jacobian(
        problem.t0, problem.y0, problem.yp0, cj, vals, problem.idata.copy(), problem.rdata.copy(),
        np.zeros(problem.work_size),
    )  # fmt: skip
    columns = np.repeat(np.arange(problem.n), np.diff(problem.indptr))
    matrix = np.zeros((problem.n, problem.n))
    matrix[problem.indices, columns] = vals
    return matrix


class NoOrbit(ModelError):
    """No motion that repeats itself was found.

    Attributes
    ----------
    orbit : Orbit or None
        The last one tried, which does not close.
    """

    orbit: Orbit | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Orbit:
    """A period of a motion that repeats itself.

    Attributes
    ----------
    problem : DAEProblem
        It starts on the orbit.
    period : float
        s.
    advance : ndarray, shape (n,)
        What unknowns advance by in it.
    result : DAEResult
        Over the period, with dense output.
    directions : Directions
    near : ndarray, shape (m, m)
        The monodromy matrix of a motion near it, by which it was found.
    own : bool
        Whether that is its own, looked through for jumps of the equations.
    error : float
        By how much the start is off at most, as part of the orbit's own size: Newton's next correction.
    defect : float
        By how much the end misses the start, in units of the unknowns' tolerances.
    size : float
        Largest distance of an independent unknown from its mean, in units of the unknowns' tolerances.
    periods : int
        Periods integrated to find it.
    """

    problem: DAEProblem
    period: float
    advance: np.ndarray
    result: DAEResult
    directions: Directions
    near: np.ndarray
    own: bool
    error: float
    defect: float
    size: float
    periods: int

    @cached_property
    def monodromy(self) -> np.ndarray:
        """How the independent unknowns at the end change with those at the start, shape (m, m)."""
        if self.own:
            return self.near
        return monodromy_of(self.problem, self.result, self.directions, local_error=KNOWN)

    def looked_through(self) -> Orbit:
        """Return it with its own matrix; raise NoOrbit if its equations jump, so that this is not known."""
        return replace(self, near=self.monodromy, own=True)

    @cached_property
    def multipliers(self) -> np.ndarray:
        """Floquet multipliers, the eigenvalues of the monodromy matrix, the largest first, shape (m,), complex."""
        return _by_size(self.monodromy)

    @property
    def largest(self) -> complex:
        """The largest multiplier, 0 where there is none."""
        return complex(self.multipliers[0]) if self.multipliers.size else 0.0

    @property
    def stable(self) -> bool:
        """Whether small disturbances die out."""
        return abs(self.largest) < 1.0

    @property
    def decay(self) -> float:
        """Size of the largest multiplier by the matrix by which it was found, 0 where there is none."""
        return float(np.abs(_by_size(self.near)[:1]).max(initial=0.0))


KNOWN = 1e-5
"""Local error of a step that is allowed in a matrix whose multipliers are told: steps are those of the motion, and what
hardly moves takes few, with which disturbances that swing fast would die out by the formula."""


def monodromy_of(
    problem: DAEProblem,
    result: DAEResult,
    directions: Directions,
    jumps: bool = True,
    local_error: float | None = None,
) -> np.ndarray:
    """Return how independent unknowns at the end of a run change with those at its start, shape (m, m).

    Where the equations jump it is not known, and refused; without ``jumps`` what they add is missing. For
    ``local_error`` see `gearmbs.dae.tangents.follow`.
    """
    none = np.zeros(0, dtype=np.int64), np.zeros(0)
    columns = zip(directions.places, directions.basis.T, strict=True)
    starts = [Direction(problem.names[i], column, *none) for i, column in columns]
    end = replace(result, t=result.t[-1:], y=result.y[-1:], yp=result.yp[-1:])
    longest = float(result.t[-1] - result.t[0]) / LEAST_STEPS
    try:
        followed = follow(problem, end, starts, longest, jumps, local_error)
    except ModelError as error:
        raise NoOrbit(f"how disturbances go on is not known: {error}") from None
    return np.ascontiguousarray(followed.s[:, -1, directions.places].T)


def _by_size(matrix: np.ndarray) -> np.ndarray:
    found = np.linalg.eigvals(matrix)
    return found[np.argsort(-np.abs(found), kind="stable")]


FAST = 0.1
"""What is left of a defect at most after a step with the matrix of another motion; else it is made anew."""
CLOSED = 1e-7
"""Newton's correction, as part of the orbit's size, below which an orbit is found: multipliers are as good then."""
IN_TOLERANCES = 3.0
"""Correction, or defect, in units of the run's tolerance below which an orbit is found, too: two runs over a period
that start beside each other and choose other steps end as far from each other. Where disturbances hardly decay the
correction is many times the defect."""
HALVINGS = 4
"""How often a Newton step that leaves a larger defect is halved before the motion is followed on instead."""
FOLLOWED = 8
"""Periods that a motion is followed on where Newton's method does not lead nearer."""
FARTHEST = 5.0
"""Newton steps beyond so many sizes of the motion lead to where the equations are others."""
STAYS = 1e-3
"""How far above 1 a multiplier may be of what stays as it is: a wheel that touches nothing, or moves evenly."""
INSTANTS = 16
"""Instants of a period at which equations are compared with those of later ones."""
LEAST_STEPS = 64
"""Steps of a period at least: a motion that hardly moves needs few, disturbances of it need as many as of any."""
REACHED = 0.1
"""Distance of a motion from an orbit, as part of the orbit's size, from which what its multipliers say of a small one
holds: it then decays, if the orbit is stable."""
CLEARLY = 0.9
"""Multiplier below which an orbit is stable, though it is that of a motion beside it, a Newton step away: the two were
less than 1 % apart."""
DOUBLINGS = 2
"""How often a period is doubled where an orbit has given its stability to one of twice the period."""


def find_orbit(
    problem: DAEProblem,
    period: float,
    advance: np.ndarray,
    *,
    tol: float,
    settle: int = 2,
    most: int = 200,
    closed: float = CLOSED,
    method: str = "WSTIFF",
) -> Orbit:
    """Find a motion that repeats itself after a period, stable or not, from initial values near it.

    Parameters
    ----------
    problem : DAEProblem
        Its equations repeat themselves after the period.
    period : float
        s.
    advance : ndarray, shape (n,)
        What unknowns advance by in a period: angles after which what turns is as before; 0 elsewhere.
    tol : float
        Of the runs.
    settle : int
        Periods that the motion is followed at first.
    most : int
        Periods that may be integrated.
    closed : float
        Newton's correction, as part of the orbit's size, below which an orbit is found.
    method : str
        An integrator with dense output.

    Raises
    ------
    NoOrbit
        If none is found within ``most`` periods.
    ModelError
        If a run fails, or the coordinates at the end of a period are others than at its start.
    """
    search = Search(problem, float(period), advance, tol, method, most, closed)
    search.follow(settle)
    return search.found().looked_through()


def attracting_orbit(
    problem: DAEProblem,
    period: float,
    advance: np.ndarray,
    *,
    tol: float,
    settle: int = 2,
    most: int = 200,
    closed: float = CLOSED,
    method: str = "WSTIFF",
    continuous: bool = False,
) -> Orbit:
    """Find the stable orbit that the motion from some initial values goes to; see `find_orbit`.

    Where several motions exist beside each other, as about a resonance, Newton's method may lead to another one than
    the motion itself. So it is followed on until it is near the orbit. An orbit that has become unstable by a
    multiplier below -1 has given its stability to one of twice the period, which is then looked for.

    Parameters
    ----------
    problem, period, advance, tol, settle, most, closed, method
        As of `find_orbit`.
    continuous : bool
        Whether the equations are known to have no jumps. The matrix that closed an orbit then says whether it is
        stable, if clearly, and its own is not made before it is asked for.

    Raises
    ------
    NoOrbit
        If there is none within ``most`` periods: orbits that are found are unstable, or the motion does not go there.
    """
    search = Search(problem, float(period), advance, tol, method, most, closed)
    search.follow(settle)
    for doubling in range(DOUBLINGS + 1):
        orbit = search.found()
        if continuous and orbit.decay < CLEARLY:
            search.approach(orbit)
            return replace(orbit, periods=search.periods)
        first = orbit.largest
        if abs(first) < 1.0:
            search.approach(orbit)
            return replace(orbit.looked_through(), periods=search.periods)
        if not (first.real < -1.0 and first.imag == 0.0) or doubling == DOUBLINGS:
            break
        search.double()
    does = f"grow by a factor of {abs(first):.4g} in each period" if abs(first) > 1.0 + STAYS else "do not die out"
    raise search.none(
        f"the orbit of period {search.period:.6g} s is not stable: disturbances {does}, and the motion is another one"
    )


class Search:
    """Where the search for an orbit stands."""

    def __init__(
        self,
        problem: DAEProblem,
        period: float,
        advance: np.ndarray,
        tol: float,
        method: str,
        most: int,
        closed: float,
    ) -> None:
        if not INTEGRATORS[method].can("dense_output"):
            able = any_of(those_that("dense_output"))
            raise ModelError(f"integrator: {method!r} has no stored steps, by which orbits are closed; choose {able}")
        self.problem, self.period, self.tol, self.most, self.closed = problem, period, tol, most, closed
        self.advance = np.asarray(advance, dtype=float)
        self.options = Options.gather(
            method,
            None,
            {
                "corrector": "modified",
                "tol": tol,
                "dense_output": True,
                "check_start": False,
                "max_step": self.period / LEAST_STEPS,
            },
        )
        self.run = INTEGRATORS[method].load()
        self.directions = directions_at(problem)
        self.tested = np.flatnonzero(problem.error_mask)
        self.weight = 1.0 / np.asarray(problem.atol_scale, dtype=float)[self.tested]
        self.weights = self.directions.basis[self.tested] * self.weight[:, None]
        self.periods = 0
        self.missed = np.inf
        self.last: Orbit | None = None

    def integrate(self, problem: DAEProblem, periods: int = 1) -> DAEResult:
        """Return a run over some periods."""
        result = self.run(problem, None, self.options, t_end=problem.t0 + periods * self.period)
        self.periods += periods
        if not result.success:
            raise ModelError(f"the motion cannot be followed over its period: {result.message}")
        if not np.array_equal(result.epochs[-1][1], problem.idata):
            raise ModelError(
                "at the end of the period bodies are described by other angles than at its start; give a period after "
                "which all have turned by whole turns, or lump=True where bodies turn about fixed axes"
            )
        return result

    def found(self) -> Orbit:
        """Return an orbit, stable or not."""
        while self.periods < self.most:
            orbit = self.newton()
            if orbit is not None:
                return orbit
            self.follow(max(1, min(FOLLOWED, self.most - self.periods)))
        raise self.none(
            f"no motion was found that repeats itself after {self.period:.6g} s: after {self.periods} periods it still "
            f"misses itself by {100.0 * self.missed:.2g} % of its size"
        )

    def none(self, why: str) -> NoOrbit:
        """Return the error that there is no orbit."""
        error = NoOrbit(why)
        error.orbit = self.last
        return error

    def double(self) -> None:
        """Look for orbits of twice the period from here on."""
        self.period, self.advance, self.periods = 2.0 * self.period, 2.0 * self.advance, self.periods // 2

    def approach(self, orbit: Orbit) -> None:
        """Follow the motion until it is near an orbit."""
        there = self.directions.places
        while True:
            away = self.size_of((self.problem.y0 - orbit.problem.y0)[there])
            if away <= REACHED * orbit.size + IN_TOLERANCES * self.tol:
                return
            if self.periods >= self.most:
                raise self.none(
                    f"a stable orbit of period {self.period:.6g} s exists, but the motion does not go there within "
                    f"{self.periods} periods: it is still {100.0 * away / orbit.size:.2g} % of the orbit's size away"
                )
            self.follow(max(1, min(FOLLOWED, self.most - self.periods)))

    def follow(self, periods: int) -> None:
        """Follow the motion for some periods."""
        if periods < 1:
            return
        result = self.integrate(self.problem, periods)
        self.problem = replace(self.problem, y0=result.y[-1] - periods * self.advance, yp0=result.yp[-1].copy())

    def newton(self) -> Orbit | None:
        """Return the orbit that Newton's method leads to, None if it does not lead nearer to one.

        The matrix of an earlier motion serves as long as it leads on fast.
        """
        orbit = self.tried(self.problem, None)
        while True:
            self.last, self.missed = orbit, orbit.error
            allowed = IN_TOLERANCES * self.tol
            if orbit.error * orbit.size <= max(self.closed * orbit.size, allowed) or orbit.defect <= allowed:
                return orbit
            step = self.step(orbit)
            step *= min(1.0, FARTHEST * orbit.size / self.size_of(step))
            for _ in range(HALVINGS + 1):
                start = orbit.result.y[0] + orbit.directions.basis @ step
                moved = replace(self.problem, y0=start, yp0=orbit.result.yp[-1].copy())
                found = self.tried(moved, orbit.near)
                if found.defect < orbit.defect:
                    break
                step *= 0.5
            else:
                return None
            if found.defect > FAST * orbit.defect:
                found = self.with_matrix(found, self.near(found.problem, found.result, found.directions))
            orbit = found

    def tried(self, problem: DAEProblem, matrix: np.ndarray | None) -> Orbit:
        """Return a motion over a period as an orbit, with a matrix that is known or its own."""
        result = self.integrate(problem)
        start = replace(problem, y0=result.y[0].copy(), yp0=result.yp[0].copy())
        # the tangent space is another one at each start
        directions = directions_at(start, self.directions.places)
        if matrix is None:
            matrix = self.near(start, result, directions)
        gone = (result.t - result.t[0])[:, None] / self.period * self.advance[self.tested]
        apart = (result.y[:, self.tested] - gone) * self.weight
        size = 0.5 * float(np.ptp(apart, axis=0).max(initial=0.0)) + np.finfo(float).tiny
        known = self.advance, result, directions, matrix, False
        orbit = Orbit(start, self.period, *known, 0.0, 0.0, size, self.periods)
        return self.with_matrix(replace(orbit, defect=self.size_of(self.missing(orbit))), matrix)

    def near(self, problem: DAEProblem, result: DAEResult, directions: Directions) -> np.ndarray:
        """Return the matrix that Newton's steps take. Jumps are looked for in the orbit alone."""
        return monodromy_of(problem, result, directions, jumps=False)

    def with_matrix(self, orbit: Orbit, matrix: np.ndarray) -> Orbit:
        """Return a motion with another matrix, and what is left to correct by it."""
        orbit = replace(orbit, near=matrix)
        return replace(orbit, error=self.size_of(self.step(orbit)) / orbit.size)

    def size_of(self, change: np.ndarray) -> float:
        """Return the size of a change of the independent unknowns: of what is under error control, by its weights."""
        return float(np.abs(self.weights @ change).max(initial=0.0))

    def missing(self, orbit: Orbit) -> np.ndarray:
        """Return by what the end of a motion misses its start."""
        there, y = self.directions.places, orbit.result.y
        return y[-1, there] - self.advance[there] - y[0, there]

    def step(self, orbit: Orbit) -> np.ndarray:
        """Return Newton's step from a motion."""
        return np.linalg.lstsq(np.eye(len(orbit.near)) - orbit.near, self.missing(orbit), rcond=None)[0]
