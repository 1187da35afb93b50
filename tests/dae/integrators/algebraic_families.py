"""Random DAEs with algebraic unknowns and closed-form solutions.

Each is made of x' = f(t, x, z) and 0 = g(t, x, z) of a family, then mixed: unknowns of other units, permuted; equations
of other scales, permuted, and in some families added to each other, so that rates stand in all of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Solution = Callable[[np.ndarray], np.ndarray]


@dataclass
class Case:
    """A DAE and its solution.

    Attributes
    ----------
    name : str
    residual : callable
        ``residual(t, y, yp, out)``.
    t_end : float
        The start is at zero.
    solution, slope : callable
        y and y' at times of shape (m,), shapes (m, n).
    algebraic : ndarray of bool, shape (n,)
    size : ndarray, shape (n,)
        Largest value of each unknown over the span.
    reach : callable
        At times of shape (m,) what errors of the differential unknowns of their size do to each unknown, sum_j of
        |dz_i/dx_j| times the size of x_j, and for differential ones their size, shape (m, n).
    """

    name: str
    residual: Callable
    t_end: float
    solution: Solution
    slope: Solution
    algebraic: np.ndarray
    size: np.ndarray
    reach: Solution


def _waves(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return mean, amplitude, frequency and phase of n solutions c + a sin(w t + p)."""
    return rng.uniform(-1, 1, n), rng.uniform(0.3, 1, n), rng.uniform(0.5, 4.0, n), rng.uniform(0, 6.28, n)


def _decaying(rng: np.random.Generator, n: int, slowest: float, fastest: float) -> tuple[Callable, Solution, Solution]:
    """Return the rates of n unknowns that go after waves, their solution on these and its slope.

    x' = w' - k (x - w) has the solution w; k spreads over decades, 10^slowest to 10^fastest.
    """
    c, a, w, p = _waves(rng, n)
    k = 10.0 ** rng.uniform(slowest, fastest, n)

    def wave(t):
        return c + a * np.sin(w * np.atleast_1d(t)[:, None] + p)

    def slope(t):
        return a * w * np.cos(w * np.atleast_1d(t)[:, None] + p)

    def rates(t, x, _z):
        return slope(t)[0] - k * (x - wave(t)[0])

    rates.k = k  # type: ignore[attr-defined]
    return rates, wave, slope


def _read_outs(rng: np.random.Generator, family: str, n: int, m: int) -> tuple[Callable, Callable]:
    """Return m functions of n unknowns, and their derivatives by these, shape (times, m, n)."""
    mix = rng.normal(size=(m, n))
    mix /= np.abs(mix).sum(axis=1)[:, None]
    if family == "oscillating":
        w, p = rng.uniform(10, 80, m), rng.uniform(0, 6.28, m)
        return (
            lambda x: np.sin(w * (x @ mix.T) + p),
            lambda x: (w * np.cos(w * (x @ mix.T) + p))[:, :, None] * mix,
        )
    if family == "kinked":
        at, e, size = rng.uniform(-0.5, 0.5, m), rng.uniform(1.0, 2.0, m), 10.0 ** rng.uniform(0, 3, m)
        return (
            lambda x: size * np.maximum(0.0, x @ mix.T - at) ** e,
            lambda x: (size * e * np.maximum(1e-300, x @ mix.T - at) ** (e - 1) * (x @ mix.T > at))[:, :, None] * mix,
        )
    b = rng.uniform(0.2, 1.0, m)
    return lambda x: np.exp(b * (x @ mix.T)), lambda x: (b * np.exp(b * (x @ mix.T)))[:, :, None] * mix


def _read_out(rng: np.random.Generator, family: str) -> tuple:
    """z = h(x): the read-outs do not come back."""
    n, m = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    rates, wave, slope = _decaying(rng, n, -1.0, 4.0 if family == "time scales" else 1.0)
    h, h_x = _read_outs(rng, family, n, m)
    return (
        rates,
        lambda t, x, z: z - h(x[None])[0],
        wave,
        slope,
        lambda t: h(wave(t)),
        lambda t: np.einsum("tmn,tn->tm", h_x(wave(t)), slope(t)),
        lambda t: h_x(wave(t)),
    )


def _loop(rng: np.random.Generator) -> tuple:
    """z + b tanh(C z) = h(t, x), coupled and nonlinear, and z enters the rates."""
    n, m = int(rng.integers(1, 4)), int(rng.integers(2, 5))
    rates, wave, slope = _decaying(rng, n, 0.0, 1.0)
    _, a, w, p = _waves(rng, m)
    w *= rng.choice([1.0, 8.0])
    couple = rng.normal(size=(m, m))
    couple *= 0.7 / np.abs(couple).sum(axis=1)[:, None]
    # left' > 0.3, so that errors of x come back 0.5 0.3 / 0.3 times: less than they decay
    by_x, back = rng.normal(size=(m, n)), rng.normal(size=(n, m))
    by_x *= 0.5 / np.abs(by_x).sum(axis=1)[:, None]
    back *= 0.3 / np.abs(back).sum(axis=1)[:, None]

    def z_of(t):
        return a * np.sin(w * np.atleast_1d(t)[:, None] + p)

    def left(z):
        return z + np.tanh(z @ couple.T)

    def z_x(t):
        bent = 1.0 / np.cosh(z_of(t) @ couple.T) ** 2
        return np.linalg.solve(np.eye(m) + bent[:, :, None] * couple, np.broadcast_to(by_x, (len(bent), m, n)))

    return (
        lambda t, x, z: rates(t, x, z) + back @ (z - z_of(t)[0]),
        lambda t, x, z: left(z) - left(z_of(t)[0]) - by_x @ (x - wave(t)[0]),
        wave,
        slope,
        z_of,
        lambda t: a * w * np.cos(w * np.atleast_1d(t)[:, None] + p),
        z_x,
    )


def _index_two(rng: np.random.Generator) -> tuple:
    """x' = f + B z, 0 = C (x - w(t)) with C ~ B^T: z is determined by the derivative of the constraint."""
    n, m = int(rng.integers(2, 5)), 1
    rates, wave, slope = _decaying(rng, n, 0.0, 0.5)
    _, a, w, p = _waves(rng, m)
    push = rng.normal(size=(n, m))
    # what the constraint leaves free decays as without it
    hold = rng.uniform(0.5, 2.0) * push.T

    def z_of(t):
        return a * np.sin(w * np.atleast_1d(t)[:, None] + p)

    return (
        lambda t, x, z: rates(t, x, z) + push @ (z - z_of(t)[0]),
        lambda t, x, z: hold @ (x - wave(t)[0]),
        wave,
        slope,
        z_of,
        lambda t: a * w * np.cos(w * np.atleast_1d(t)[:, None] + p),
        lambda t: np.tile(np.linalg.solve(hold @ push, hold * rates.k), (len(t), 1, 1)),
    )


FAMILIES = ("smooth", "oscillating", "kinked", "loop", "time scales", "implicit", "index two")


def case(rng: np.random.Generator, family: str) -> Case:
    """Return a random problem of a family."""
    if family in ("loop", "implicit"):
        parts = _loop(rng)
    elif family == "index two":
        parts = _index_two(rng)
    else:
        parts = _read_out(rng, family)
    f, g, x_of, x_slope, z_of, z_slope, z_x = parts
    n, m = x_of(0.0).shape[1], z_of(0.0).shape[1]
    total = n + m
    t_end = float(rng.uniform(2, 10))
    order, rows = rng.permutation(total), rng.permutation(total)
    unit = 10.0 ** rng.uniform(-2, 2, total)
    mass = np.eye(n) + (0.4 * rng.uniform(-1, 1, (n, n)) / n if family == "implicit" else 0.0)
    scale = np.diag(10.0 ** rng.uniform(-2, 2, total))
    if family == "implicit":
        # equations added to each other: rates stand in all of them
        scale = scale @ (np.eye(total) + 0.5 * rng.uniform(-1, 1, (total, total)) / total)
    back = np.argsort(order)

    def residual(t, y, yp, out):
        s = (unit * y)[back]
        sp = (unit * yp)[back]
        x, z = s[:n], s[n:]
        body = np.concatenate((mass @ (sp[:n] - f(t, x, z)), g(t, x, z)))
        out[:] = (scale @ body)[rows]

    def of(x: Solution, z: Solution) -> Solution:
        return lambda t: np.concatenate((x(t), z(t)), axis=1)[:, order] / unit

    times = np.linspace(0.0, t_end, 2001)
    solution = of(x_of, z_of)
    size = np.abs(solution(times)).max(axis=0)
    # a contact that is never made
    size[size == 0.0] = 1.0 / unit[size == 0.0]
    x_size = np.abs(x_of(times)).max(axis=0)

    def reach(t):
        return of(lambda _: np.tile(x_size, (len(t), 1)), lambda _: np.abs(z_x(t)) @ x_size)(t)

    return Case(family, residual, t_end, solution, of(x_slope, z_slope), order >= n, size, reach)
