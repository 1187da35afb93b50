"""Equilibria of what is slender, reached from the given position by releasing its unbalanced forces step by step.

A chain of beams is far stiffer against stretching than against bending. A step that turns its elements stretches them
by the square of the turn, and the forces of this exceed the load long before the step is too long, so that no rule that
wants the forces to fall lets Newton's method take it; left alone it puts the stretch right with its next step. Hence
the unbalanced forces r0 of the start are held against the mechanism and released in parts,

    r(x) = (1 - s) r0,    s from 0 to 1,

with Newton's iterations in each part, whatever the forces do on the way. In a mechanism that is free of forces where it
stands these are steps of its load.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.analyses.eigenvalues import free_motions
from gearmbs.dae.analyses.linearised import reduce
from gearmbs.dae.analyses.relaxation import DENSE_LIMIT, LARGEST_TURN, ROUNDING_STEP, Relaxation
from gearmbs.dae.errors import ModelError, SingularModelError

if TYPE_CHECKING:
    from gearmbs.dae.analyses.instant import Instant

FIRST_SHARES = (1.0, 1.0 / 16.0)
"""Shares of the forces first released: again with the smaller one where the larger led to an unstable position."""
SMALLEST_SHARE = 1.0 / 1024.0
MOST_ITERATIONS = 30
"""Newton's iterations in one part; more hardly ever end well."""
FEW_ITERATIONS = 8
"""Iterations below which the next part is twice as large."""
ROUGHLY = 1e-6
"""Largest unbalanced force, of the typical one, with which a part ends that is not the last."""


def equilibrium(relaxation: Relaxation, max_iterations: int) -> tuple[int, float]:
    """Bring a mechanism to rest, by relaxation or, where that fails, by steps; return iterations and residual.

    Parameters
    ----------
    relaxation : Relaxation
        Its instant is left at the equilibrium.
    max_iterations : int
        Of relaxation; steps may take five times as many.

    Raises
    ------
    SingularModelError, ModelError
        Of the relaxation, if there is no equilibrium by either way.
    """
    before = _kept(relaxation.instant)
    try:
        return relaxation.run(max_iterations)
    except SingularModelError:
        raise
    except ModelError as failure:
        _put_back(relaxation.instant, before)
        found = _release(relaxation, 5 * max_iterations)
        if found is None:
            raise failure from None
        return max_iterations + found[0], found[1]


def _release(relaxation: Relaxation, max_iterations: int) -> tuple[int, float] | None:
    """Seek an equilibrium from the present position; return iterations and residual, None if there is no way.

    An unstable one, as loads beyond buckling have, is taken if small parts lead there, too.

    Parameters
    ----------
    relaxation : Relaxation
        Its instant is left at the equilibrium, or where it was.
    max_iterations : int
        Of all parts together, for each of `FIRST_SHARES`.
    """
    before, found = _kept(relaxation.instant), None
    for share in FIRST_SHARES:
        _put_back(relaxation.instant, before)
        found = _follow(relaxation, share, max_iterations)
        if found is None or _stable(relaxation):
            break
    if found is None:
        _put_back(relaxation.instant, before)
    return found


def _follow(relaxation: Relaxation, share: float, max_iterations: int) -> tuple[int, float] | None:
    """Release the forces in parts, ``share`` of them first."""
    instant, released, total = relaxation.instant, 0.0, 0
    while True:
        before = _kept(instant)
        last = released + share >= 1.0
        # what is left of r0 is the present rest, whichever angles the bodies are described by now
        held = np.zeros(relaxation.rows.size)
        if not last:
            held[: relaxation.coordinates] = (1.0 - share / (1.0 - released)) * relaxation.rest(instant.y)[
                : relaxation.coordinates
            ]
        found = _iterate(relaxation, held, relaxation.tol if last else max(ROUGHLY, relaxation.tol))
        total += MOST_ITERATIONS if found is None else found[0]
        if found is None:
            _put_back(instant, before)
            share *= 0.25
            if share < SMALLEST_SHARE or total > max_iterations:
                return None
            continue
        if last:
            return total, found[1]
        if total > max_iterations:
            return None
        released += share
        if found[0] <= FEW_ITERATIONS:
            share *= 2.0


def _iterate(relaxation: Relaxation, held: np.ndarray, tol: float) -> tuple[int, float] | None:
    """Solve for the position in which the forces are ``held``; return iterations and residual, None if that fails."""
    instant, polished, size = relaxation.instant, False, np.inf
    for iteration in range(1, MOST_ITERATIONS + 1):
        rest, stiffness, mass = relaxation.parts(instant.y)
        rest = rest - held
        size = float(np.abs(rest / relaxation.sizes).max(initial=0.0))
        if not np.isfinite(size):
            return None
        if polished:
            instant.hook()
            return (iteration, size) if size <= ROUGHLY else None
        step = relaxation.solve(stiffness, mass, relaxation.first_sigma(rest, stiffness, mass)[1], rest)
        if step is None:
            return None
        n = relaxation.coordinates
        turned = float(np.abs(step[relaxation.angles : relaxation.modes]).max(initial=0.0)) / LARGEST_TURN
        moved = float(np.abs(step[: relaxation.angles]).max(initial=0.0)) / relaxation.length
        least = float(np.abs(step[:n]).max(initial=0.0)) <= ROUNDING_STEP * max(relaxation.length, 1.0)
        polished = size <= tol or (least and size <= ROUGHLY)
        y = instant.y.copy()
        y[relaxation.columns] += step / max(1.0, turned, moved)
        instant.y = instant.settle(y)
    return None


def _stable(relaxation: Relaxation) -> bool:
    """Return whether small displacements are resisted; taken for granted of what is too large to tell."""
    if relaxation.coordinates > DENSE_LIMIT:
        return True
    return free_motions(reduce(relaxation.instant))[0]


def _kept(instant: Instant) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return instant.y.copy(), instant.idata.copy(), instant.rdata.copy()


def _put_back(instant: Instant, kept: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    instant.y = kept[0].copy()
    instant.idata[:], instant.rdata[:] = kept[1], kept[2]
