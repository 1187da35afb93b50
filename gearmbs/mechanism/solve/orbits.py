"""The steady motion of a mechanism: what repeats itself after a period, found without waiting for it."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.integrators.options import Options
from gearmbs.dae.methods import DEFAULT, INTEGRATORS
from gearmbs.dae.orbits import Orbit, attracting_orbit, check_repeats, find_orbit
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.results.solution import Solution
from gearmbs.dae.state import State
from gearmbs.mechanism.mechanism import Mechanism
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.mechanism.solve.accuracy import JOINED, chosen_accuracy
from gearmbs.mechanism.solve.simulate import just_inside, prepared, start_time
from gearmbs.mechanism.solve.simulator import Simulator
from gearmbs.units import QuantityLike

if TYPE_CHECKING:
    from gearmbs.dae.model.members import Members
    from gearmbs.dae.model.system import System

ANGLE = re.compile(r"(?:phi|theta_(?:psi|theta|phi))\((.*)\)$")
"""Names of the angles by which bodies have turned about fixed axes, and of Euler angles."""
STILL = 1e-3
"""Change, rad, of an Euler angle up to which it is not the one by which a body turns: teeth are 1e-2 apart at least."""
BEYOND = 1e-3
"""Part of the time to the start by which a run could go beyond it, so that it does not end there."""
FULL = 2.0 * np.pi
TIGHTER = 0.1
"""Part of the usual tolerance at which an orbit is looked for: of one period no errors average out, as those of the
many that a simulation takes do."""
SHARING = 0.1
"""Part of that where several meshes share their load, or wheels stand on bodies that deform: lines of one mesh are held
against the largest of all, and hang on where Newton's method ends within the tolerance. Of planets on axes that stand,
found from five starts, lines were up to 2.5e-3 of it off at a third, and are up to 1.5e-3 so."""
LATER = 8
"""Periods over which loads and motions are compared at least."""
SAMPLES = 4096
"""Samples of a period from which harmonics are taken: eight of the shortest contacts, a five-hundredth of it."""


def orbit_tolerance(usual: float) -> float:
    """Return the tolerance at which an orbit is looked for, of the usual one of its mechanism."""
    return TIGHTER * usual * (SHARING if usual <= JOINED else 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class SteadyMotion:
    """A motion that repeats itself after a period.

    Attributes
    ----------
    solution : Solution
        One period, at the integrator's own steps.
    period : float
        s.
    multipliers : ndarray of complex, shape (m,)
        Floquet multipliers: what is left of small disturbances after a period, the slowest to decay first.
    stable : bool
        Whether all of them decay.
    error : float
        Distance of the start from the orbit, as part of the orbit's size, by Newton's method; beside it stands what the
        tolerance leaves.
    periods : int
        Periods that were integrated to find it.
    orbit : Orbit
        All of it, in the unknowns that were integrated.
    state : State
        At the start: a simulation from it goes on along the orbit.
    """

    solution: Solution
    orbit: Orbit
    state: State

    @property
    def period(self) -> float:
        """Period, s."""
        return self.orbit.period

    @property
    def multipliers(self) -> np.ndarray:
        """Floquet multipliers, the slowest to decay first, complex."""
        return self.orbit.multipliers

    @property
    def stable(self) -> bool:
        """Whether small disturbances die out."""
        return self.orbit.stable

    @property
    def error(self) -> float:
        """Distance of the start from the orbit, as part of the orbit's size."""
        return self.orbit.error

    @property
    def periods(self) -> int:
        """Periods that were integrated to find it."""
        return self.orbit.periods

    def harmonics(self, result: str | Callable[[Solution], Any], count: int = 3, every: int = 1) -> np.ndarray:
        """Return complex peak amplitudes of the harmonics of a result; their RMS is the amount by sqrt(2).

        Parameters
        ----------
        result : str or callable
            An expression in the function language of ADAMS, or what makes numbers of a solution, as
            ``lambda s: s.diagnostics("mesh")["normal_force"]``, shape (m, ...).
        count : int
            How many.
        every : int
            Of a motion whose period are several meshes their number: harmonics are those of the mesh then.

        Returns
        -------
        ndarray of complex, shape (count + 1, ...)
            c_k of sum Re(c_k exp(2 pi i k every t / T)), t from the start; c_0 is the mean.
        """
        return harmonics_of(self.solution, self.period, result, count, every)

    def __repr__(self) -> str:
        first = abs(self.orbit.largest)
        kind = "stable" if self.stable else "unstable"
        return (
            f"SteadyMotion(period {self.period:.6g} s, {kind}: largest multiplier {first:.3g}, off by "
            f"{self.error:.1e} of its size, {self.periods} periods integrated)"
        )


def harmonics_of(
    solution: Solution, period: float, result: str | Callable[[Solution], Any], count: int, every: int
) -> np.ndarray:
    """Return complex amplitudes of the harmonics of a result over a period; see `SteadyMotion.harmonics`."""
    from scipy.interpolate import PchipInterpolator

    values = np.asarray(solution.evaluate(result) if isinstance(result, str) else result(solution), dtype=float)
    samples = SAMPLES * every
    times = solution.t[0] + np.arange(samples) * (period / samples)
    at = PchipInterpolator(solution.t, values.reshape(solution.t.size, -1), axis=0)(times)
    # what differs at the two ends, as a force that jumps there, counts half from each side
    at[0] = 0.5 * (values[0] + values[-1]).ravel()
    wanted = np.fft.rfft(at, axis=0)[every * np.arange(count + 1)] / samples
    wanted[1:] *= 2.0
    return wanted.reshape(count + 1, *values.shape[1:])


@dataclass(frozen=True)
class Posed:
    """The equations whose orbit is looked for, with what results are told from.

    Attributes
    ----------
    system : System
    problem : DAEProblem
        At the time, and in the state, from which it is looked for.
    members : Members or None
    assembled : DAEProblem
        As it was assembled: what states of it refer to.
    """

    system: System
    problem: DAEProblem
    members: Members | None
    assembled: DAEProblem

    @classmethod
    def of(
        cls,
        mechanism: Mechanism,
        start: float,
        initial: State | None,
        lump: bool,
        formulation: str,
        rate_scale: float,
        tol: float,
    ) -> Posed:
        """Return the equations of a mechanism in a state, by default that to which it comes by itself."""
        assembled_at = 0.0 if initial is None else initial.t_model
        system, problem, members, _ = prepared(
            mechanism, assembled_at, lump, formulation, rate_scale, initial is not None
        )
        if initial is None and start > 0.0:
            ahead = Simulator(
                mechanism, start * (1.0 + BEYOND), formulation=formulation, tol=tol, rate_scale=rate_scale, lump=lump,
                records=False,
            )  # fmt: skip
            ahead.advance(start)
            initial = ahead.state().without_history()
        return cls(system, problem if initial is None else initial.problem(problem), members, problem)

    def advance(
        self, mechanism: Mechanism, period: float, turned: Mapping[str, float] | None, tol: float, method: str
    ) -> np.ndarray:
        """Return what each unknown advances by in a period.

        Parameters
        ----------
        mechanism : Mechanism
        period : float
            s.
        turned : mapping of str to float, optional
            Angles of bodies that are known.
        tol : float
        method : str
            The integrator by which the rest is measured.
        """
        problem, given = self.problem, dict(turned or {})
        advance = np.zeros(problem.n)
        angles = {k: found[1].split(" + ") for k, name in enumerate(problem.names) if (found := ANGLE.match(name))}
        for name in given:
            if not any(name in bodies for bodies in angles.values()):
                there = ", ".join(dict.fromkeys(name for bodies in angles.values() for name in bodies))
                raise ModelError(f"turned: no angle of {name!r} is integrated; those of {there or 'no body'} are")
        if not angles:
            return advance
        options = Options.gather(method, None, {"corrector": "modified", "tol": tol, "check_start": False})
        run = INTEGRATORS[method].load()(problem, None, options, t_end=problem.t0 + period)
        if not run.success:
            raise ModelError(f"the motion cannot be followed over its period: {run.message}")
        moved = run.y[-1] - problem.y0
        teeth = {
            marker.body.name: count
            for element in mechanism.elements.values()
            for marker, count in zip((element.i, element.j), getattr(element, "periods", (0, 0)), strict=True)
            if count
        }
        known = set()
        for k, bodies in angles.items():
            told = [given[name] for name in bodies if name in given and abs(moved[k]) > STILL]
            steps = [FULL / teeth[name] for name in bodies if name in teeth]
            choices = told or [step * round(moved[k] / step) for step in steps]
            if choices:
                advance[k] = _nearest(choices, moved[k])
                known.add(k)
        # what has no teeth turns with what has some, or by whole turns
        others = [sign * advance[k] for k in known for sign in (1.0, -1.0)]
        for k in angles.keys() - known:
            advance[k] = _nearest([*others, FULL * round(moved[k] / FULL)], moved[k])
        return advance

    def solution(self, orbit: Orbit) -> Solution:
        """Return the solution over a period."""
        found = Solution(self.system, replace(orbit.problem), orbit.result, self.members)
        found.inside = just_inside(orbit.result.t[[0, -1]])
        return found

    def state(self, orbit: Orbit) -> State:
        """Return the state in which the orbit starts."""
        problem = orbit.problem
        return State.of(self.assembled, problem.t0, problem.y0, problem.yp0, (problem.idata, problem.rdata))


def check_along(mechanism: Mechanism, orbit: Orbit, period: float, advance: np.ndarray) -> None:
    """Refuse an orbit along which the equations of a mechanism are others after some periods."""
    # each tooth of any wheel comes into mesh once
    teeth = max((max(one.periods) for one in mechanism.elements.values() if hasattr(one, "periods")), default=0)
    check_repeats(orbit.problem, period, advance, orbit.result, max(teeth, LATER))


def _nearest(choices: list[float], value: float) -> float:
    return min(choices, key=lambda choice: abs(choice - value))


def steady_motion(
    mechanism: Mechanism,
    period: QuantityLike,
    *,
    t_start: QuantityLike = 0.0,
    initial: State | None = None,
    turned: Mapping[str, float] | None = None,
    settle: int = 2,
    most: int = 200,
    attracting: bool = True,
    formulation: str = "SI2",
    integrator: str = DEFAULT,
    tol: float | None = None,
    rate_scale: float | None = None,
    lump: bool | None = None,
) -> SteadyMotion:
    """Find the motion of a mechanism that repeats itself after a period.

    The motion is followed for some periods and closed by Newton's method with the variational equations, see
    `gearmbs.dae.orbits`. That takes tens of periods where a simulation until everything has died out takes hundreds.

    Parameters
    ----------
    mechanism : Mechanism
        Driven by motions and loads that repeat themselves after the period, from ``t_start`` on.
    period : float
        s. Wheels whose teeth are alike repeat themselves after a mesh.
    t_start : float
        Time at which the orbit starts, s: behind run-ups. The mechanism is simulated until then.
    initial : State, optional
        Start from this state, at its time, instead.
    turned : mapping of str to float, optional
        Of bodies that turn about fixed axes, by name: their angle of a period, rad. By default it is measured, and
        taken to be a whole number of turns, or of pitches of their wheels in mesh.
    settle : int
        Periods that the motion is followed before it is closed.
    most : int
        Periods that may be integrated.
    attracting : bool
        Whether a stable orbit is wanted that the motion goes to; otherwise any, also unstable.
    formulation, integrator, tol, rate_scale
        As of `gearmbs.mechanism.simulate`; ``tol`` is a tenth of its default.
    lump : bool, optional
        As there; default True where everything turns about fixed axes: whose angles alone may turn by teeth. All others
        have to come back to where they were, but for whole turns.

    Returns
    -------
    SteadyMotion

    Raises
    ------
    NoOrbit
        If there is no such motion: flanks that part, damping that is too light, or a chaotic motion. It tells why.
    ModelError
        If the equations do not repeat themselves after the period, or a run fails.
    """
    period, integrator = quantity(period, "time", "period"), integrator.upper()
    if not (np.isfinite(period) and period > 0.0):
        raise ModelError(f"period = {period} s; it must be positive")
    start = start_time(quantity(t_start, "time", "t_start"), initial)
    usual, rate_scale = chosen_accuracy(mechanism, (start, start + period), tol, rate_scale)
    tol = orbit_tolerance(usual) if tol is None else usual
    lump = True if lump is None else lump
    posed = Posed.of(mechanism, start, initial, lump, formulation, rate_scale, tol)
    advance = posed.advance(mechanism, period, turned, tol, integrator)
    check_repeats(posed.problem, period, advance)
    search = attracting_orbit if attracting else find_orbit
    orbit = search(posed.problem, period, advance, tol=tol, settle=settle, most=most, method=integrator)
    check_along(mechanism, orbit, period, advance)
    return SteadyMotion(posed.solution(orbit), orbit, posed.state(orbit))
