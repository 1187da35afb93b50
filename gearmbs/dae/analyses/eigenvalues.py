"""Eigenvalues of a linearised mechanism whose motions may differ in speed by many powers of ten.

The pencil M x'' + C x' + K x + H z = 0, z' = P x + Q x' + S z is written in coordinates in which the terms of the
stiffness are of size one. What is left of it in a direction is then told from rounding without regard to how stiff
other parts are, and slow motions come from the inverted problem

    w = -s A^-1 (D w + [R^T; 0] v),    v = s R x,    A = [K H; -P -S],  D = [C 0; -Q 1],  M = R^T R,  w = (x, z)

whose largest eigenvalues 1/s are theirs: relative errors grow with the frequency over the slowest one, not over the
fastest. Where motions are so fast that this no longer serves, theirs are taken from the ordinary problem. Directions
with A w = 0 have the eigenvalue zero, which is therefore not computed but counted; the problem is then shifted, so that
it can be inverted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cholesky, eig, qr, solve_triangular

from gearmbs.dae.analyses.kinematics import ROUNDING
from gearmbs.dae.analyses.linearisation import Reduced
from gearmbs.dae.problem import SingularModelError

SLOWEST = 1e-6
"""Angular frequency, rad/s, below which a motion counts as free of stiffness."""

LEAST_INERTIA = 1e-13
"""Eigenvalue of a mass matrix with ones on its diagonal below which a direction has no inertia."""

FAR_APART = 1e3
"""Ratio of fastest to slowest eigenvalue above which they are computed in two ways."""

SHIFTS = (0.71, 0.43, 1.13)
"""Shifts over the slowest rate, tried in turn: an eigenvalue may be one of them."""


@dataclass(frozen=True)
class Balanced:
    """The pencil in coordinates u, x = ``scale`` u, in which the terms of the stiffness are of size one.

    Attributes
    ----------
    scale : ndarray, shape (n,)
    mass, damping, stiffness : ndarray, shape (n, n)
    damping_terms : ndarray, shape (n, n)
        Sums of absolute values of the terms of the damping.
    static : ndarray, shape (n + q, n + q)
        A, the rows of the states scaled.
    first : ndarray, shape (n + q, n + q)
        D, likewise.
    tolerance : float
        Size below which a product of ``static`` with a unit vector is rounding.
    rows, columns : ndarray, shape (q,)
        By which the equations of the states are divided, and by which the states are multiplied.
    """

    scale: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    damping_terms: np.ndarray
    static: np.ndarray
    first: np.ndarray
    tolerance: float
    rows: np.ndarray
    columns: np.ndarray


@dataclass(frozen=True)
class Spectrum:
    """Eigenvalues and directions.

    Attributes
    ----------
    rigid : ndarray, shape (n, r)
        Motions x that nothing resists.
    held : ndarray, shape (n, h)
        Motions that go with states without a rate: their eigenvalue is zero, too.
    values : ndarray of complex, shape (k,)
        The other eigenvalues, by magnitude.
    vectors : ndarray of complex, shape (n, k)
        Their motions x.
    """

    rigid: np.ndarray
    held: np.ndarray
    values: np.ndarray
    vectors: np.ndarray


def balance(reduced: Reduced) -> Balanced:
    """Scale coordinates and states of a linearised mechanism."""
    inertia = np.diag(reduced.mass)
    resisted = _resisted(reduced.stiffness_terms, inertia)
    n, q = inertia.size, reduced.state_state.shape[0]
    rates = np.sqrt(np.divide(resisted, inertia, out=np.full(n, np.inf), where=inertia > 0.0))
    rates[(inertia <= 0.0) & (resisted <= 0.0)] = 0.0
    moving = np.isfinite(rates) & (rates > SLOWEST)
    usual = max(float(rates[moving].min(initial=np.inf)), 1.0) if moving.any() else 1.0
    size = np.where(rates > SLOWEST, resisted, usual**2 * inertia)
    scale = 1.0 / np.sqrt(np.where(size > 0.0, size, 1.0))
    mass, damping, stiffness = (scale[:, None] * m * scale for m in (reduced.mass, reduced.damping, reduced.stiffness))
    force = scale[:, None] * reduced.state_force
    position, velocity = reduced.state_position * scale, reduced.state_velocity * scale
    columns = _sizes(np.abs(force).max(axis=0, initial=0.0), np.abs(reduced.state_state).max(axis=0, initial=0.0))
    force, state = force / columns, reduced.state_state / columns
    rows = _sizes(np.abs(np.hstack([position, state])).max(axis=1, initial=0.0))
    static, first = np.zeros((n + q, n + q)), np.zeros((n + q, n + q))
    static[:n, :n], static[:n, n:] = stiffness, force
    static[n:, :n], static[n:, n:] = -position / rows[:, None], -state / rows[:, None]
    first[:n, :n], first[n:, :n] = damping, -velocity / rows[:, None]
    first[n:, n:] = np.diag(1.0 / (rows * columns))
    terms = scale[:, None] * reduced.damping_terms * scale
    tolerance = max(ROUNDING * np.sqrt(n + q), (SLOWEST / usual) ** 2)
    return Balanced(scale, mass, damping, stiffness, terms, static, first, tolerance, rows, columns)


def _resisted(terms: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Return the size of the terms of each coordinate's stiffness, so large that terms between two are of size one.

    The moment of a spring about its end, which is rounding, has no terms on the diagonal. Of two coordinates the one
    that is resisted less takes what is between them.
    """
    own = np.diag(terms).copy()
    between = np.maximum(terms, terms.T) ** 2
    order = np.argsort(-np.divide(own, inertia, out=np.zeros_like(own), where=inertia > 0.0), kind="stable")
    for k, weaker in enumerate(order):
        stronger = order[:k][own[order[:k]] > 0.0]
        own[weaker] = max(own[weaker], (between[weaker, stronger] / own[stronger]).max(initial=0.0))
    return own


def free_motions(reduced: Reduced) -> tuple[bool, np.ndarray]:
    """Return whether all resisted motions are stable, and a basis of the changes of (R, theta) without stiffness."""
    balanced = balance(reduced)
    stiffness = balanced.stiffness
    if not stiffness.size:
        return True, np.zeros((reduced.basis.shape[0], 0))
    stable = bool(np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))[0] >= -10.0 * balanced.tolerance)
    free = _apart(_null(stiffness, balanced.tolerance)[0])
    return stable, reduced.basis @ (balanced.scale[:, None] * free)


def spectrum(reduced: Reduced) -> Spectrum:
    """Return the eigenvalues of a linearised mechanism and its motions.

    Raises
    ------
    SingularModelError
        If a free motion has no inertia.
    """
    balanced = balance(reduced)
    n, total = balanced.mass.shape[0], balanced.static.shape[0]
    if total == 0:
        return Spectrum(*(np.zeros((0, 0)),) * 2, np.zeros(0, dtype=complex), np.zeros((0, 0), dtype=complex))
    root = _mass_root(reduced, balanced)
    null, left, slowest = _null(balanced.static, balanced.tolerance)
    # what is left of it there is rounding, whose root may be faster than motions that are damped only
    rest = left @ (left.T @ balanced.static @ null) @ null.T
    balanced = replace(balanced, static=balanced.static - rest)
    zeros = null.shape[1] + _drifting(balanced, null, left)
    values, vectors = _slow_first(balanced, root, zeros, slowest)
    values, vectors = _with_fast(balanced, root, values, vectors)
    scale = balanced.scale[:, None]
    rigid, held = _rigid(balanced, null[:n])
    return Spectrum(scale * rigid, scale * held, values, scale * vectors)


def _sizes(*choices: np.ndarray) -> np.ndarray:
    """Return the first of the sizes offered that is not zero, or one."""
    out = np.zeros_like(choices[0])
    for choice in choices:
        out = np.where(out == 0.0, choice, out)
    return np.where(out == 0.0, 1.0, out)


def _null(matrix: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return bases of the right and left null spaces, and the direction of least resistance beside them."""
    left, values, right = np.linalg.svd(matrix)
    rank = int(np.sum(values > tolerance))
    return right[rank:].T, left[:, rank:], right[rank - 1] if rank else np.zeros(0)


def _apart(motions: np.ndarray) -> np.ndarray:
    """Return a basis of the same motions in which each has a coordinate of its own, so that parts move on their own."""
    if not motions.size:
        return motions
    _, order = qr(motions.T, mode="r", pivoting=True)
    basis = np.linalg.solve(motions[order[: motions.shape[1]]].T, motions.T).T
    return basis / np.linalg.norm(basis, axis=0)


def _mass_root(reduced: Reduced, balanced: Balanced) -> np.ndarray:
    """Return R, upper triangular, with M = R^T R."""
    n = balanced.mass.shape[0]
    if n == 0:
        return np.zeros((0, 0))
    inertia = np.diag(balanced.mass)
    own = np.diag(reduced.mass)
    message = "a motion left free by the constraints has no inertia"
    if np.any(own <= 1e-24 * own.max()):
        raise SingularModelError(message)
    unit = 1.0 / np.sqrt(inertia)
    correlation = unit[:, None] * balanced.mass * unit
    correlation = 0.5 * (correlation + correlation.T)
    if np.linalg.eigvalsh(correlation)[0] <= LEAST_INERTIA:
        raise SingularModelError(message)
    return cholesky(correlation) / unit


def _drifting(balanced: Balanced, null: np.ndarray, left: np.ndarray) -> int:
    """Count the motions without resistance that also go on at constant speed: their eigenvalue zero is double."""
    if not null.shape[1]:
        return 0
    resisted = left.T @ balanced.first @ null
    terms = np.abs(balanced.first)
    n = balanced.mass.shape[0]
    terms[:n, :n] = balanced.damping_terms
    turned, sizes, right = np.linalg.svd(resisted)
    ends, starts = np.abs(left @ turned), np.abs(null @ right.T)
    motions = null[:n] @ right.T
    # of the terms, and of the directions: neither null space is known better. Each motion by the terms it meets: what
    # spins fast beside it has larger ones
    rounding = 10.0 * balanced.tolerance * np.einsum("nk,nm,mk->k", ends, terms, starts + 1.0)
    # gyroscopic couples of a spin of rounding size dissipate nothing
    dissipated = np.abs(np.einsum("nk,nm,mk->k", motions, balanced.damping, motions))
    inertia = np.einsum("nk,nm,mk->k", motions, balanced.mass, motions)
    return int(np.sum((sizes <= rounding) | ((sizes <= SLOWEST * inertia) & (dissipated <= rounding.max()))))


def _rigid(balanced: Balanced, motions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split the motions of a null space into those without forces at all and those that states hold."""
    if not motions.size:
        return np.zeros((motions.shape[0], 0)), np.zeros((motions.shape[0], motions.shape[1]))
    _, values, right = np.linalg.svd(balanced.stiffness @ motions)
    rank = int(np.sum(values > 10.0 * balanced.tolerance))
    held, unforced = motions @ right[:rank].T, motions @ right[rank:].T
    basis, sizes, _ = np.linalg.svd(unforced, full_matrices=False)
    there = sizes > 1e-6
    still = np.zeros((motions.shape[0], int(np.sum(~there))))
    return _apart(basis[:, there]), np.hstack([held, still])


def _slow_first(balanced: Balanced, root: np.ndarray, zeros: int, slowest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solve the inverted problem; return eigenvalues by magnitude, without the zeros, and their motions u."""
    n = balanced.mass.shape[0]
    if zeros == n + balanced.static.shape[0]:
        return np.zeros(0, dtype=complex), np.zeros((n, 0), dtype=complex)
    if not zeros:
        values, vectors = _inverted(balanced, root, 0.0)
        order = np.argsort(np.abs(values), kind="stable")
        return values[order], vectors[:, order]
    rate = _least_rate(balanced, slowest)
    found = False
    for k, shift in enumerate(SHIFTS):
        try:
            values, vectors = _inverted(balanced, root, shift * rate)
        except SingularModelError:
            # the shift is an eigenvalue, or lost in rounding beside what was found
            if found:
                break
            if k == len(SHIFTS) - 1:
                raise
            continue
        found = True
        order = np.argsort(np.abs(values), kind="stable")[zeros:]
        values, vectors = values[order], vectors[:, order]
        least = float(np.abs(values).min(initial=np.inf))
        if not np.isfinite(least) or 0.1 * rate <= least <= 1e3 * rate:
            break
        rate = least if least > 0.0 else rate
    return values, vectors[:n]


def _least_rate(balanced: Balanced, slowest: np.ndarray) -> float:
    """Estimate the magnitude of the smallest eigenvalue other than zero."""
    n = balanced.mass.shape[0]
    motion = slowest[:n]
    if motion.size and np.abs(motion).max() > 1e-3:
        stiff = float(np.linalg.norm(balanced.static @ slowest))
        return float(np.sqrt(stiff / (motion @ balanced.mass @ motion)))
    # rates of M s x + C x = 0. Couples of a spin stand beside the diagonal, on which they leave rounding
    damped = np.abs(np.linalg.eigvals(np.linalg.solve(balanced.mass, balanced.damping))) if n else np.ones(1)
    # beside the others the damping of what is free may be rounding, 1e-126
    damped = damped[damped > ROUNDING * damped.max()]
    return float(damped.min()) if damped.size else 1.0


def _inverted(balanced: Balanced, root: np.ndarray, shift: float) -> tuple[np.ndarray, np.ndarray]:
    """Return all eigenvalues and motions u from the problem inverted about a real shift.

    Raises
    ------
    SingularModelError
        If that is singular.
    """
    n, total = root.shape[0], balanced.static.shape[0]
    mass = np.zeros((total, total))
    mass[:n, :n] = balanced.mass
    static = balanced.static + shift * balanced.first + shift**2 * mass
    couples = np.zeros((total, n))
    couples[:n] = root.T
    try:
        inverse = np.linalg.solve(static, np.hstack([balanced.first + 2.0 * shift * mass, couples]))
    except np.linalg.LinAlgError as error:
        raise SingularModelError(
            "the linearised equations are singular: some motion has no eigenvalue, as where a load that follows an "
            "acceleration takes its body's inertia away"
        ) from error
    matrix = np.zeros((total + n, total + n))
    matrix[:total] = -inverse
    matrix[total:, :n] = root
    values, vectors = eig(matrix)
    # all but rounding is finite: mass and the states' own rates are regular
    values = np.where(np.abs(values) > 0.0, values, np.finfo(float).tiny)
    return shift + 1.0 / values, vectors[:n]


def _with_fast(
    balanced: Balanced, root: np.ndarray, values: np.ndarray, vectors: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Take the fastest eigenvalues from the ordinary problem, where it is the more accurate."""
    size = np.abs(values)
    if not size.size or not size[-1] > FAR_APART * size[0]:
        return values, vectors
    others, motions = _direct(balanced, root)
    order = np.argsort(np.abs(others), kind="stable")[-values.size :]
    others, motions = others[order], motions[:, order]
    # errors grow with s / s_min in one and with (s_max / s)^2 in the other; cut in a gap, never between conjugates
    wanted = np.cbrt(size[0] * np.abs(others[-1]) ** 2)
    place = int(np.searchsorted(size, wanted))
    gaps = size[1:] / size[:-1]
    near = np.flatnonzero(gaps > 1.0 + 1e-6) + 1
    if not near.size:
        return values, vectors
    cut = int(near[np.argmin(np.abs(near - place))])
    return np.concatenate([values[:cut], others[cut:]]), np.hstack([vectors[:, :cut], motions[:, cut:]])


def _direct(balanced: Balanced, root: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return all eigenvalues and motions u from the first-order problem in coordinates of unit mass."""
    n, total = root.shape[0], balanced.static.shape[0]

    def left(m: np.ndarray) -> np.ndarray:
        return solve_triangular(root, m, trans="T")

    def right(m: np.ndarray) -> np.ndarray:
        return solve_triangular(root, m.T, trans="T").T

    own = np.diag(balanced.first)[n:, None]
    stiffness, damping = left(right(balanced.stiffness)), left(right(balanced.damping))
    rate = np.sqrt(np.abs(stiffness).max(initial=0.0)) or 1.0
    first = np.zeros((n + total, n + total))
    first[:n, n : 2 * n] = np.eye(n)
    first[n : 2 * n, :n] = -stiffness / rate**2
    first[n : 2 * n, n : 2 * n] = -damping / rate
    first[n : 2 * n, 2 * n :] = -left(balanced.static[:n, n:]) / rate**2
    first[2 * n :, :n] = -right(balanced.static[n:, :n]) / own / rate
    first[2 * n :, n : 2 * n] = -right(balanced.first[n:, :n]) / own
    first[2 * n :, 2 * n :] = -balanced.static[n:, n:] / own / rate
    values, vectors = eig(first)
    return values * rate, solve_triangular(root, vectors[:n].real) + 1j * solve_triangular(root, vectors[:n].imag)
