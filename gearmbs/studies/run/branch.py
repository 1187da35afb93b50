"""Branches of steady motions: response curves over speed, load or any number, through their turning points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.continuation import AtValue, Branch, follow_branch
from gearmbs.dae.orbits import check_repeats
from gearmbs.dae.problem import ModelError
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.mechanism.solve.accuracy import chosen_accuracy
from gearmbs.mechanism.solve.orbits import Posed, SteadyMotion, check_along, orbit_tolerance
from gearmbs.studies.case.case import Case
from gearmbs.studies.run.steady import posed_case
from gearmbs.wording import warn

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class SteadyBranch:
    """Steady motions along a curve.

    Attributes
    ----------
    values : ndarray, shape (m,)
        Of the parameter, in the order of the curve.
    motions : list of SteadyMotion
    """

    values: np.ndarray
    motions: list[SteadyMotion]
    branch: Branch

    @property
    def stable(self) -> np.ndarray:
        """Whether each motion is stable, shape (m,)."""
        return self.branch.stable

    @property
    def turns(self) -> np.ndarray:
        """Values at which the curve turns back, where a slow sweep jumps, shape (k,)."""
        return self.branch.turns

    def levels(self, result: str | Callable[[Solution], Any], harmonic: int = 1) -> np.ndarray:
        """Return the peak amplitude of a harmonic of a result over the curve, see `SteadyMotion.harmonics`."""
        return np.array([abs(motion.harmonics(result, harmonic)[harmonic]) for motion in self.motions])

    def figure(self, levels: np.ndarray, xlabel: str = "parameter", ylabel: str = "peak amplitude") -> Figure:
        """Return levels over the parameter: stable motions drawn through, others dashed, turning points marked."""
        from gearmbs.view.figures.style import look, new_figure

        with look():
            figure = new_figure(7.0, 4.0)
            axes = figure.subplots()
            changes = np.flatnonzero(np.diff(self.stable.astype(int))) + 1
            for part in np.split(np.arange(len(self.values)), changes):
                # each part begins where the one before ends
                drawn = np.append(part[0] - 1, part) if part[0] else part
                axes.plot(self.values[drawn], levels[drawn], color="C0", ls="-" if self.stable[part[0]] else "--")
            for turn in self.turns:
                axes.axvline(turn, color="0.6", lw=0.8)
            axes.set(xlabel=xlabel, ylabel=ylabel)
        return figure

    def __repr__(self) -> str:
        turns = ", ".join(f"{turn:.5g}" for turn in self.turns) or "none"
        return (
            f"SteadyBranch({len(self.values)} motions, {int(self.stable.sum())} of them stable, from "
            f"{self.values[0]:.5g} to {self.values[-1]:.5g}, turning points: {turns})"
        )


def steady_branch(
    build: Callable[[float], Case | tuple[Mechanism, float]],
    start: float,
    stop: float,
    *,
    tol: float | None = None,
    step: float = 0.02,
    largest: float = 0.05,
    most: int = 400,
) -> SteadyBranch:
    """Follow steady motions from one value of a parameter to another, through turning points.

    At a resonance with separating flanks, as of any nonlinear oscillator, three motions may exist at one speed: two
    stable ones, and between them one that is not. The curve that joins them turns back twice, where slow sweeps jump.

    Parameters
    ----------
    build : callable
        ``build(value)`` returns the case, or the mechanism and its period, s, at a value of the parameter.
    start, stop : float
        Values; the curve is left where it leaves their span.
    tol : float, optional
        Of the runs; default that of `steady`.
    step, largest : float
        First and largest step along the curve, as parts of the span of values and of the size of the motion: 0 to 1.
    most : int
        Motions.

    Returns
    -------
    SteadyBranch

    Raises
    ------
    NoOrbit
        If no motion at the start repeats itself.
    ModelError
        For a span of no length, and where the equations do not repeat themselves.

    Examples
    --------
    >>> def case(rpm):
    ...     return Case(operation={"speed": f"{rpm!r} rpm", "torque": "100 N m"})
    >>> branch = steady_branch(case, 1000.0, 1100.0, largest=0.5)
    >>> bool(branch.stable.all()), len(branch.turns)
    (True, 0)
    """
    first, last = (quantity(value, "number", name) for value, name in ((start, "start"), (stop, "stop")))
    if not (np.isfinite([first, last]).all() and first != last):
        raise ModelError(f"steady_branch: start is {start!r}, stop {stop!r}; give two different numbers")

    for name, share in (("step", step), ("largest", largest)):
        if not 0.0 < share <= 1.0:
            raise ModelError(f"steady_branch: {name} is {share!r}; it is a part of the span of values: give 0 to 1")

    @lru_cache(4)
    def made(value: float) -> tuple[Posed, AtValue, float]:
        found = build(value)
        if isinstance(found, Case):
            return posed_case(found)[1:]
        if not (isinstance(found, tuple) and len(found) == 2 and isinstance(found[0], Mechanism)):
            raise ModelError(f"build: it returned {found!r}; it has to return a Case, or a Mechanism and its period")
        mechanism, period = found[0], quantity(found[1], "time", "period")
        usual, scale = chosen_accuracy(mechanism, (0.0, period), tol, None)
        own = orbit_tolerance(usual) if tol is None else usual
        posed = Posed.of(mechanism, 0.0, None, True, "SI2", scale, own)
        advance = posed.advance(mechanism, period, None, own, "WSTIFF")
        check_repeats(posed.problem, period, advance)
        return posed, AtValue(posed.problem, period, advance, np.zeros(posed.problem.n)), own

    used = made(first)[2] if tol is None else tol
    branch = follow_branch(lambda value: made(value)[1], first, last, tol=used, step=step, largest=largest, most=most)
    if branch.why != "left the span":
        warn(
            f"steady_branch: the curve ends at {branch.values[-1]:.6g}, not beyond {first:g} or {last:g}: "
            + (f"{branch.why}; raise most" if branch.why != "lost" else "no step along it was short enough"),
        )
    motions = []
    for value, orbit in zip(branch.values, branch.orbits, strict=True):
        posed = made(float(value))[0]
        if not isinstance(found := build(float(value)), Case):
            at = made(float(value))[1]
            check_along(found[0], orbit, at.period, at.advance)
        motions.append(SteadyMotion(posed.solution(orbit), orbit, posed.state(orbit)))
    return SteadyBranch(branch.values, motions, branch)
