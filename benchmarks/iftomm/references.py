"""Independent solutions of the benchmark problems in minimal coordinates, and what others have published.

None of these equations is shared with `gearmbs.dae`: one angle for a pendulum, a parallelogram or a linkage of one
degree of freedom, three coordinates for the governor, integrated to about twelve digits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.chebyshev import Chebyshev
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from benchmarks.iftomm import models

G = models.GRAVITY


@dataclass(frozen=True)
class Published:
    """A number somebody else has published for a problem.

    Attributes
    ----------
    t : float
        s.
    component : int
        Of the measured quantity.
    value, digits : float
        The number, and how far it can be trusted as printed.
    source : str
    """

    t: float
    component: int
    value: float
    digits: float
    source: str


def _integrated(rates, start, t: np.ndarray) -> np.ndarray:
    return solve_ivp(rates, (0.0, t[-1]), start, method="DOP853", t_eval=t, rtol=1e-12, atol=1e-13).y


def pendulum(t: np.ndarray) -> np.ndarray:
    """A01: x and y of the mass, a'' = -g sin a, a from the downward vertical."""
    a = _integrated(lambda _, y: [y[1], -G * np.sin(y[0])], [-np.pi / 2, 0.0], t)[0]
    return np.column_stack([np.sin(a), -np.cos(a)])


def four_bars(t: np.ndarray, loops: int = 2) -> np.ndarray:
    """A02: x and y of B0 while all cranks stay parallel: ((N+1)/3 + N) a'' = g ((N+1)/2 + N) sin a, a from upright."""
    inertia, weight = (loops + 1) / 3 + loops, (loops + 1) / 2 + loops
    a = _integrated(lambda _, y: [y[1], G * weight / inertia * np.sin(y[0])], [0.0, 1.0], t)[0]
    return np.column_stack([np.sin(a), np.cos(a)])


def governor(t: np.ndarray) -> np.ndarray:
    """A05: height s of the slider; Lagrange's equations of the shaft's turn, the rods' angle and s.

    With a the rods' angle below the horizontal, the shaft feels the inertia J(a), each rod I a'' about its pin. The
    angular momentum J w is kept.
    """
    rod, ball, cube = models.ROD_MASS, models.BALL_MASS, models.SLIDER_MASS
    long, thick = rod * (1 + 0.01**2) / 12, rod * 2 * 0.01**2 / 12
    swing = long + rod / 4 + ball
    fixed = rod * 2 * 0.01**2 / 12 + cube * 2 * 0.1**2 / 12

    def inertia(a: float) -> tuple[float, float]:
        """J and dJ/da: rods turned about z, their masses at 0.05 + x cos a."""
        c, s = np.cos(a), np.sin(a)
        about = thick * s * s + long * c * c
        j = fixed + 2 * (about + rod * (0.05 + 0.5 * c) ** 2 + ball * (0.05 + c) ** 2)
        slope = 2 * (2 * (thick - long) * s * c - rod * (0.05 + 0.5 * c) * s - 2 * ball * (0.05 + c) * s)
        return j, slope

    momentum = 2 * np.pi * inertia(np.pi / 6)[0]

    def rates(_, y):
        a, s, da, ds = y
        # the spring goes from the slider's side, 0.05 off the axis like the pin, to the middle of the rod
        across, up = 0.5 * np.cos(a), 1 - 0.5 * np.sin(a) - s
        length = np.hypot(across, up)
        d_a = (across * -0.5 * np.sin(a) - up * 0.5 * np.cos(a)) / length
        d_s = -up / length
        pull = models.STIFFNESS * (length - models.REST_LENGTH) + models.DAMPING * (d_a * da + d_s * ds)
        j, slope = inertia(a)
        w = momentum / j
        dda = (0.5 * (0.5 * slope) * w * w + (0.5 * rod + ball) * G * np.cos(a) - pull * d_a) / swing
        return [da, ds, dda, -G - 2 * pull * d_s / cube]

    start = [np.pi / 6, 0.5, 0.0, 0.0]
    y = solve_ivp(rates, (0.0, t[-1]), start, method="Radau", t_eval=t, rtol=1e-10, atol=1e-12).y
    return y[1][:, None]


class OneDegree:
    """The motion of a linkage with one degree of freedom, M(q) q'' + M'(q) q'^2 / 2 + V'(q) = 0.

    Parameters
    ----------
    frames : callable
        q -> centres of mass (n, 3) and axes (n, 3, 3) of the bodies.
    span : tuple of float
        Range of q; M and V are interpolated over it by Chebyshev polynomials.
    masses, inertias : ndarray, shapes (n,), (n, 3)
        Moments about the centres of mass along the bodies' axes.
    gravity : ndarray, shape (3,)
    order : int
        Degree of the polynomials.
    """

    def __init__(
        self, frames: Callable[[float], tuple[np.ndarray, np.ndarray]], span: tuple[float, float],
        masses: np.ndarray, inertias: np.ndarray, gravity: np.ndarray, order: int = 120,
    ) -> None:  # fmt: skip
        nodes = np.cos(np.pi * (np.arange(order + 1) + 0.5) / (order + 1))[::-1]
        q = 0.5 * (span[0] + span[1]) + 0.5 * (span[1] - span[0]) * nodes
        places, axes = zip(*(frames(v) for v in q))
        flat = np.concatenate([np.reshape(places, (q.size, -1)), np.reshape(axes, (q.size, -1))], axis=1)
        fits = [Chebyshev.fit(q, column, order, domain=span) for column in flat.T]
        rates = np.array([f.deriv()(q) for f in fits]).T
        n = masses.size
        velocity = rates[:, : 3 * n].reshape(-1, n, 3)
        spin = np.array(axes).transpose(0, 1, 3, 2) @ rates[:, 3 * n :].reshape(-1, n, 3, 3)
        # A^T A' is the skew matrix of the angular velocity in the body's axes
        turn = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)
        inertia = np.einsum("n,qnc->q", masses, velocity**2) + np.einsum("nc,qnc->q", inertias, turn**2)
        potential = -np.einsum("n,qnc,c->q", masses, np.array(places), gravity)
        self.inertia = Chebyshev.fit(q, inertia, order, domain=span)
        self.potential = Chebyshev.fit(q, potential, order, domain=span)

    def motion(self, start: tuple[float, float], t: np.ndarray, period: float = np.inf) -> np.ndarray:
        """Return q over time from q and q' at the start; M and V repeat after ``period``."""
        slope, force, low = self.inertia.deriv(), self.potential.deriv(), self.inertia.domain[0]

        def rates(_, y):
            q = y[0] if not np.isfinite(period) else low + (y[0] - low) % period
            return [y[1], -(0.5 * slope(q) * y[1] ** 2 + force(q)) / self.inertia(q)]

        return _integrated(rates, list(start), t)[0]


def slider_crank_frames(q: float) -> tuple[np.ndarray, np.ndarray]:
    """Centres and axes of crank, rod and slider; q turns the crank about x from upright."""
    c, s = np.cos(q), np.sin(q)
    arm = np.array([0, -s, c])
    tip = models.CRANK_CENTRE + models.CRANK * arm
    slide = np.array([tip[0] + np.sqrt(models.ROD**2 - tip[1] ** 2 - tip[2] ** 2), 0, 0])
    along = (slide - tip) / models.ROD
    # the cross is normal to the rod and to the slider's arm along x
    cross = np.cross(along, (1, 0, 0))
    cross /= np.linalg.norm(cross)
    turned = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    places = np.array([models.CRANK_CENTRE + models.CRANK / 2 * arm, (tip + slide) / 2, slide])
    return places, np.array([turned, np.column_stack([along, np.cross(cross, along), cross]), np.eye(3)])


def slider_crank(t: np.ndarray) -> np.ndarray:
    """Place of the slider along x."""
    masses = np.array([models.CRANK_MASS, models.CONROD_MASS, models.BLOCK_MASS])
    inertias = np.array([models.CRANK_INERTIA, models.CONROD_INERTIA, (1e-4,) * 3])
    turn = 2 * np.pi
    motion = OneDegree(slider_crank_frames, (-0.2, turn + 0.2), masses, inertias, np.array([0, 0, -G]), 160)
    q = motion.motion((0.0, 6.0), t, turn)
    return np.array([[slider_crank_frames(v)[0][2, 0]] for v in q])


class Bricard:
    """Loop closure of the six revolute joints, solved from the position before."""

    points = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], dtype=float)
    axes = np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)], dtype=float)

    def __init__(self) -> None:
        self.known = [(0.0, np.zeros(4))]

    def chain(self, turns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return joints' places (6, 3) and rods' axes (5, 3, 3) of an open chain turned at its first five joints."""
        places, axes, turned = [self.points[0]], [], np.eye(3)
        for k in range(5):
            turned = turned @ _about(self.axes[k], turns[k])
            axes.append(turned)
            places.append(places[-1] + turned @ (self.points[k + 1] - self.points[k]))
        return np.array(places), np.array(axes)

    def frames(self, q: float) -> tuple[np.ndarray, np.ndarray]:
        """Centres and axes of the rods; q turns the first joint."""
        guess = min(self.known, key=lambda e: abs(e[0] - q))[1]

        def gap(rest: np.ndarray) -> np.ndarray:
            places, axes = self.chain(np.concatenate([[q], rest]))
            return np.concatenate([places[5] - self.points[5], axes[4] @ self.axes[5] - self.axes[5]])

        rest = least_squares(gap, guess, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
        self.known.append((q, rest))
        places, axes = self.chain(np.concatenate([[q], rest]))
        return (places[:-1] + places[1:]) / 2, axes


def _about(axis: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = axis
    return c * np.eye(3) + (1 - c) * np.outer(axis, axis) + s * np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def bricard(t: np.ndarray) -> np.ndarray:
    """A04: x, y and z of P3, the end of the second rod."""
    loop = Bricard()
    # outwards from the known position, so that each closure starts near the one before
    for q in np.concatenate([np.linspace(0, 3.4, 35), np.linspace(0, -0.3, 7)]):
        loop.frames(q)
    thick, long = 2 * 0.1**2 / 12, (1 + 0.1**2) / 12
    inertias = np.array([np.where(np.abs(d) > 0.5, thick, long) for d in np.diff(loop.points, axis=0)])
    motion = OneDegree(loop.frames, (-0.3, 3.4), np.ones(5), inertias, np.array([0, -G, 0]), 60)
    q = motion.motion((0.0, 0.0), t)
    found = []
    for v in q:
        places, axes = loop.frames(v)
        found.append(places[1] + axes[1] @ np.array([0, -0.5, 0]))
    return np.array(found)


OPENSIM = "figure of L. Tagliapietra et al., MBS benchmarks in OpenSim, which shows the library's own curve"
GONZALEZ = "F. Gonzalez's submission to the library, as kept with Exudyn"
MASARATI = "P. Masarati's submission to the library, as kept with Exudyn"
MASOUDI = "R. Masoudi's submission to the library, as kept with Exudyn"
LIBRARY = "the library's own A01_solution_data.txt and A02_solution_data.txt, as kept with S. Acuna's simEngine3D"
BARI = "Test Set for Initial Value Problem Solvers, release 2.4"


def _both(table: dict[float, tuple[float, float]]) -> tuple[Published, ...]:
    """Return x and y of the library's files, which have six digits."""
    return tuple(Published(t, k, v, 1e-6, LIBRARY) for t, row in table.items() for k, v in enumerate(row))


PUBLISHED: dict[str, tuple[Published, ...]] = {
    "A01": _both({1: (0.986292, -0.165011), 5: (-0.942305, -0.334754), 10: (-0.275087, -0.961419)}),
    "A01 long": _both({100: (-0.181513, -0.983388), 1000: (0.683230, -0.730203), 2000: (0.814603, -0.580019)}),
    "A02": (Published(10.0, 0, 0.33, 0.02, OPENSIM),),
    "A02 long": _both({1: (-0.115357, -0.993324), 5: (-0.540191, -0.841543), 10: (0.180513, 0.983573),
                       20: (0.410902, 0.911679)}),
    "A03": (Published(0.03, 0, 15.81077119624904, 1e-9, BARI),),
    "A04": (Published(2.5, 0, -1.0, 0.01, OPENSIM), Published(10.0, 0, 1.0, 0.01, OPENSIM)),
    "A05": (Published(10.0, 0, 0.62, 0.01, OPENSIM),),
    "slider crank": (
        Published(0.5, 0, 0.184952803, 1e-9, GONZALEZ), Published(1.0, 0, 0.211754668, 1e-9, GONZALEZ),
        Published(5.0, 0, 0.240761815, 1e-9, GONZALEZ), Published(0.5, 0, 0.1849586, 1e-7, MASARATI),
        Published(1.0, 0, 0.2124956, 1e-7, MASARATI), Published(5.0, 0, 0.261012849, 1e-9, MASOUDI),
    ),
}  # fmt: skip
