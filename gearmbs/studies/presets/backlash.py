"""The classical model of one degree of freedom for a pair of wheels with backlash.

With x the approach of the flanks along the line of action (penetration of the drive flank), m the mass that both wheels
are at their base circles, and the load F_0,

    m x'' + [c_0 + c g'(y)] x' + k(phi) g(y) = F_0 + m a(t),    y = x - e(phi),
    a(t) = a_0 + a_1 sin(theta),    theta' = w(t),

g(y) = y for y > 0 (drive flank), 0 for -b <= y <= 0 (free), y + b for y < -b (coast flank). The stiffness k and the
error e are tables over the mesh phase phi, which turns with theta; c_0 damps the free motion, too. Steps are the
classical Runge-Kutta method's, of fixed length.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gearmbs.drivetrain.part import require
from gearmbs.kernels.jit import njit

STEPS_PER_PERIOD = 60
"""Steps in a period of the natural vibration, or of the excitation where that is faster."""


@njit("float64(float64, float64[::1])", cache=True, nogil=True, error_model="numpy")
def _at_phase(phase, table):
    """Return a periodic table's value at a phase (1 is a period), linearly between its entries."""
    place = (phase - np.floor(phase)) * table.size
    k = int(place)
    share = place - k
    return table[k % table.size] * (1.0 - share) + table[(k + 1) % table.size] * share


@njit(
    "UniTuple(float64, 2)(float64, float64, float64, float64, float64[::1], float64[::1], float64[::1])",
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def _force(x, v, phase, backlash, stiffness, error, numbers):
    """Return force and damping force of the flanks; ``numbers``: m, c, F_0, a_0, a_1, c_0."""
    y = x - _at_phase(phase, error)
    g = 0.0
    if y > 0.0:
        g = y
    elif y < -backlash:
        g = y + backlash
    if g == 0.0:
        return 0.0, numbers[5] * v
    return _at_phase(phase, stiffness) * g, (numbers[1] + numbers[5]) * v


@njit(
    "void(float64[::1], float64[::1], float64[::1], float64[::1], float64, float64, float64, float64, float64[:, ::1], "
    "int64)",
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def oscillate(state, numbers, stiffness, error, backlash, step, start_speed, end_speed, out, every):
    """Integrate the model of one degree of freedom.

    Parameters
    ----------
    state : ndarray, shape (3,)
        x (m), x' (m/s), theta (rad); in and out.
    numbers : ndarray, shape (6,)
        m (kg), c (N s/m), F_0 (N), a_0, a_1 (m/s^2), c_0 (N s/m).
    stiffness, error : ndarray
        k (N/m) and e (m) over one turn of theta, evenly spaced.
    backlash : float
        m.
    step : float
        s.
    start_speed, end_speed : float
        w at the first and after the last step, rad/s; linear between.
    out : ndarray, shape (n, 4)
        Out: theta, x, x', force of the flanks, one row each ``every`` steps.
    every : int
    """
    total = out.shape[0] * every
    k = np.zeros(8)
    for n in range(total):
        speed = start_speed + (end_speed - start_speed) * n / total
        for stage in range(4):
            part = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            x, v = state[0], state[1]
            if stage:
                x += part * step * k[stage - 1]
                v += part * step * k[4 + stage - 1]
            theta = state[2] + part * step * speed
            elastic, damping = _force(x, v, theta / (2.0 * np.pi), backlash, stiffness, error, numbers)
            k[stage] = v
            pushed = numbers[2] - elastic - damping
            k[4 + stage] = pushed / numbers[0] + numbers[3] + numbers[4] * np.sin(theta)
        state[0] += step * (k[0] + 2.0 * k[1] + 2.0 * k[2] + k[3]) / 6.0
        state[1] += step * (k[4] + 2.0 * k[5] + 2.0 * k[6] + k[7]) / 6.0
        state[2] += step * speed
        if (n + 1) % every == 0:
            row = (n + 1) // every - 1
            elastic, damping = _force(state[0], state[1], state[2] / (2.0 * np.pi), backlash, stiffness, error, numbers)
            out[row, 0], out[row, 1], out[row, 2], out[row, 3] = state[2], state[0], state[1], elastic + damping


@dataclass(frozen=True)
class BacklashOscillator:
    """A pair as one mass on its mesh with backlash; see `gearmbs.studies.presets.backlash` for the equation.

    Parameters
    ----------
    mass : float
        m, kg.
    stiffness : ndarray or float
        k over one turn of theta, N/m.
    backlash : float
        b, m.
    load : float
        F_0, N.
    damping : float
        c, N s/m.
    acceleration : tuple of float
        a_0 and a_1, m/s^2.
    error : ndarray or float
        e over one turn of theta, m.
    film : float
        c_0, N s/m.
    """

    mass: float
    stiffness: np.ndarray | float
    backlash: float
    load: float = 0.0
    damping: float = 0.0
    acceleration: tuple[float, float] = (0.0, 0.0)
    error: np.ndarray | float = 0.0
    film: float = 0.0

    @property
    def mean_stiffness(self) -> float:
        """Mean of k, N/m."""
        return float(np.mean(self.stiffness))

    @property
    def frequency(self) -> float:
        """Natural frequency with the mean stiffness, without separation, Hz."""
        return float(np.sqrt(self.mean_stiffness / self.mass) / (2.0 * np.pi))

    def run(
        self, frequencies: tuple[float, float], duration: float, start: np.ndarray | None = None, samples: int = 32
    ) -> tuple[np.ndarray, np.ndarray]:
        """Integrate with the frequency of theta going from one value to another.

        Parameters
        ----------
        frequencies : tuple of float
            Hz.
        duration : float
            s.
        start : ndarray, shape (3,), optional
            x, x', theta; default at rest under the load.
        samples : int
            Rows in a period of the first frequency.

        Returns
        -------
        rows : ndarray, shape (n, 4)
            theta, x, x', force.
        state : ndarray, shape (3,)
            At the end, to go on from.
        """
        low = max(self.frequency, *frequencies)
        every = max(1, int(np.ceil(STEPS_PER_PERIOD * low / (frequencies[0] * samples))))
        step = 1.0 / (frequencies[0] * samples * every)
        count = int(np.ceil(duration / (step * every)))
        require(count > 0, f"duration is {duration:g} s; it must be positive")
        if start is None:
            still = (self.load + self.mass * self.acceleration[0]) / self.mean_stiffness
            start = np.array([still, 0.0, 0.0])
        state = np.array(start, dtype=float)
        numbers = np.array([self.mass, self.damping, self.load, *self.acceleration, self.film])
        table, error = (
            np.ascontiguousarray(np.atleast_1d(np.asarray(given, dtype=float)))
            for given in (self.stiffness, self.error)
        )
        rows = np.empty((count, 4))
        first, last = (2.0 * np.pi * f for f in frequencies)
        oscillate(state, numbers, table, error, self.backlash, step, first, last, rows, every)
        return rows, state

    def changed(self, **fields: object) -> BacklashOscillator:
        """Return the model with some fields changed."""
        return replace(self, **fields)  # type: ignore[arg-type]
