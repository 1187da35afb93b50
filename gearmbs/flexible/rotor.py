"""Rotors: a shaft on linear supports, seen from a frame at rest.

    M q'' + (C + W G) q' + K q = f,    W the spin about z

with all degrees of freedom of the finite elements. Whirl, critical speeds, Campbell diagram and unbalance response
follow from it (Friswell, Penny, Garvey, Lees, *Dynamics of Rotating Machines*, chapters 5 and 6). It is the check of
the modal body of the same shaft, which turns with its frame and needs no G.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Number

import numpy as np
import scipy.linalg

from gearmbs._display import Written
from gearmbs.flexible.beam import DOFS
from gearmbs.flexible.material import FlexibleError
from gearmbs.flexible.shaft import Shaft
from gearmbs.mechanism.parts.quantities import quantities, quantity
from gearmbs.progress import waiting
from gearmbs.units import Quantity
from gearmbs.wording import warn

DIRECTIONS = {"lateral": (0, 1, 3, 4), "torsional": (5,), "axial": (2,), "all": (0, 1, 2, 3, 4, 5)}
"""Degrees of freedom of each kind of vibration; those of round shafts do not know each other."""


SAME = 1e-7
"""Relative distance below which eigenvalues are equal."""
AT_REST = 3e-7
"""Frequency of a motion, by that of a node between its own elements, that is rounding of none: rigid motions of shafts
have up to 2e-8, on supports of 1e15 N/m, too."""
SHIFT = 1e-8
"""Shift below zero from which critical speeds are looked for, by the square of that frequency: rigid motions have no
stiffness to divide by."""


@dataclass(frozen=True)
class Support(Written):
    """A linear bearing at a seat of a shaft.

    Parameters
    ----------
    seat : str
    stiffness : float, str or array_like
        Radial, N/m: one number, (kx, ky), or a 2x2 matrix.
    damping : float, str or array_like
        N s/m, likewise.
    axial, torsional : float or str
        Stiffness along the axis, N/m, and about it, N m.
    rotational : float or str
        Stiffness against tilting, N m.
    """

    seat: str
    stiffness: Quantity = 0.0
    damping: Quantity = 0.0
    axial: Quantity = 0.0
    torsional: Quantity = 0.0
    rotational: Quantity = 0.0

    def __post_init__(self) -> None:
        self.matrices()

    def matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffness and damping of the six degrees of freedom of the node."""
        label = f"support at '{self.seat}'"
        k, c = np.zeros((6, 6)), np.zeros((6, 6))
        for matrix, value, unit, what in (
            (k, self.stiffness, "N/m", "stiffness"), (c, self.damping, "N*s/m", "damping")
        ):  # fmt: skip
            part = np.asarray(quantities(value, unit, f"{label}: {what}") if not isinstance(value, str)
                              else quantity(value, unit, f"{label}: {what}"))  # fmt: skip
            if part.shape not in ((), (2,), (2, 2)):
                raise FlexibleError(f"{label}: {what} has shape {part.shape}; give one number, two, or a 2x2 matrix")
            if not np.all(np.isfinite(part)):
                raise FlexibleError(f"{label}: {what} is {value!r}; give finite numbers, in {unit}")
            matrix[:2, :2] = part if part.ndim == 2 else np.diag(np.broadcast_to(part, 2))
        k[2, 2] = quantity(self.axial, "N/m", f"{label}: axial")
        k[3, 3] = k[4, 4] = quantity(self.rotational, "N*m", f"{label}: rotational")
        k[5, 5] = quantity(self.torsional, "N*m", f"{label}: torsional")
        return k, c


@dataclass(frozen=True, eq=False)
class WhirlModes:
    """Modes of a rotor at one speed, by rising frequency.

    Attributes
    ----------
    speed : float
        rad/s.
    frequencies : ndarray, shape (n,)
        Damped natural frequencies, rad/s.
    damping_ratios : ndarray, shape (n,)
    directions : list of str
        "forward", "backward" or "planar" whirl of the station that moves most; planar, too, where two modes are equal.
    shapes : ndarray, shape (n, stations, 6)
        Complex displacements and rotations of the stations.
    """

    speed: float
    frequencies: np.ndarray
    damping_ratios: np.ndarray
    directions: list[str]
    shapes: np.ndarray

    def __repr__(self) -> str:
        damping = np.round(self.damping_ratios, 5) + 0.0  # never minus zero
        rows = "\n".join(
            f"{k + 1:3d} {w / (2 * np.pi):14.4f} Hz {w * 30 / np.pi:14.2f} rpm  {z:9.5f}  {d}"
            for k, (w, z, d) in enumerate(zip(self.frequencies, damping, self.directions))
        )
        return f"modes at {self.speed * 30 / np.pi:.6g} rpm: frequency, damping ratio, whirl\n{rows}"


@dataclass(frozen=True, eq=False)
class Campbell:
    """Natural frequencies of a rotor over its speed.

    Attributes
    ----------
    speeds : ndarray, shape (s,)
        rad/s.
    frequencies, damping_ratios : ndarray, shape (s, n)
        rad/s; by rising frequency at each speed.
    directions : ndarray of str, shape (s, n)
    """

    speeds: np.ndarray
    frequencies: np.ndarray
    damping_ratios: np.ndarray
    directions: np.ndarray

    def __repr__(self) -> str:
        rows = [
            f"{w * 30 / np.pi:10.6g}  " + " ".join(f"{f / (2 * np.pi):12.4f} {d[0]}" for f, d in zip(row, ways))
            for w, row, ways in zip(self.speeds, self.frequencies, self.directions)
        ]
        return "\n".join(["speed, rpm; frequencies, Hz; f forward, b backward, p planar", *rows])


@dataclass(frozen=True, eq=False)
class UnbalanceResponse:
    """Steady whirl under unbalance.

    Attributes
    ----------
    speeds : ndarray, shape (s,)
        rad/s.
    positions : ndarray, shape (stations,)
        Along the shaft, m.
    displacements : ndarray, shape (s, stations, 6)
        Complex amplitudes of exp(i speed t): the real part is the motion.
    shaft : Shaft
    """

    speeds: np.ndarray
    positions: np.ndarray
    displacements: np.ndarray
    shaft: Shaft

    def at(self, position: Quantity) -> np.ndarray:
        """Return the complex displacements and rotations of the section at a place, m, over the speeds: (s, 6)."""
        places, moved, turned = self.shaft.section_motion(quantity(position, "length", "position"))
        ends = self.displacements.reshape(len(self.speeds), -1)[:, places]
        return np.asarray(ends @ np.vstack([moved, turned]).T)

    def major_axis(self, at: Quantity) -> np.ndarray:
        """Return the largest radial displacement at a place along the shaft over the speeds, m."""
        x, y = self.at(at)[:, :2].T
        return 0.5 * (np.abs(x - 1j * y) + np.abs(x + 1j * y))


@dataclass(frozen=True, eq=False)
class Rotor:
    """A shaft on supports.

    Parameters
    ----------
    shaft : Shaft
    supports : sequence of Support

    Examples
    --------
    A steel shaft between stiff bearings; its first whirl splits as it turns:

    >>> from gearmbs.flexible import Rotor, Shaft, ShaftSection, Support
    >>> shaft = Shaft([ShaftSection(1.0, 0.1)], seats={"A": 0.0, "B": 1.0})
    >>> rotor = Rotor(shaft, [Support("A", 1e12), Support("B", 1e12)])
    >>> slow, fast = rotor.modes("10000 rpm", count=2).frequencies
    >>> bool(fast > rotor.modes(0.0, count=1).frequencies[0] > slow)
    True
    """

    shaft: Shaft
    supports: Sequence[Support] = ()
    kind: str = "lateral"
    _matrices: tuple = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.kind not in DIRECTIONS:
            raise FlexibleError(f"Rotor.kind is {self.kind!r}; choose one of {', '.join(DIRECTIONS)}")
        model = self.shaft.model()
        k, m = model.stiffness.toarray(), model.mass.toarray()
        assert model.slices is not None
        g, c = model.slices.gyroscopic_matrix(), np.zeros_like(k)
        for support in self.supports:
            if support.seat not in model.seats:
                known = ", ".join(model.seats) or "none"
                raise FlexibleError(f"support at '{support.seat}': the shaft has no such seat; seats: {known}")
            at = slice(DOFS * model.seats[support.seat], DOFS * (model.seats[support.seat] + 1))
            stiffness, damping = support.matrices()
            k[at, at] += stiffness
            c[at, at] += damping
        rows = np.flatnonzero(np.isin(model.dofs[:, 1], DIRECTIONS[self.kind]))
        picked = tuple(matrix[np.ix_(rows, rows)] for matrix in (m, c, g, k))
        object.__setattr__(self, "_matrices", (*picked, rows, model.positions[:, 2]))

    @property
    def stations(self) -> np.ndarray:
        """Positions of the stations, m."""
        return self._matrices[5]

    @property
    def _local(self) -> float:
        """Stiffness by mass of a degree of freedom between its elements, half of them have more, 1/s^2."""
        m, _, _, k, _, _ = self._matrices
        return float(np.median(np.diag(k) / np.diag(m)))

    def modes(self, speed: Quantity = 0.0, count: int = 12) -> WhirlModes:
        """Return the slowest modes at a speed; motions without a frequency are left out.

        Parameters
        ----------
        speed : float or str
            rad/s or text, ``"3000 rpm"``.
        count : int

        Warns
        -----
        UserWarning
            If one of the motions left out grows, as on supports of negative stiffness.
        """
        speed = quantity(speed, "angular speed", "speed")
        m, c, g, k, _, _ = self._matrices
        n = m.shape[0]
        damping = c + speed * g
        a = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(m, k), -np.linalg.solve(m, damping)]])
        values, vectors = scipy.linalg.eig(a)
        floor = AT_REST * np.sqrt(self._local)
        growing = values.real[(np.abs(values.imag) <= floor) & (values.real > floor)]
        if growing.size:
            warn(
                f"the rotor is unstable: {growing.size} motion(s) without a frequency, which are no modes, grow by up "
                f"to exp({growing.max():.4g} t); give its supports a stiffness and damping that are not negative",
            )
        chosen = np.flatnonzero(values.imag > floor)
        chosen = chosen[np.argsort(values[chosen].imag)][:count]
        values = values[chosen]
        shapes = self._at_stations(vectors[:n, chosen].T)
        ways = [_whirl(s) for s in shapes]
        for k in np.flatnonzero(np.abs(np.diff(values)) < SAME * np.abs(values[1:])):
            # of equal modes any combination is one: straight lines as well as circles in either sense
            ways[k] = ways[k + 1] = "planar"
        return WhirlModes(speed, values.imag.copy(), -values.real / np.abs(values), ways, shapes)

    @waiting("modes at each speed")
    def campbell(self, speeds: Sequence[Quantity], count: int = 8) -> Campbell:
        """Return natural frequencies over speeds, rad/s or text."""
        found = [self.modes(speed, count) for speed in speeds]
        least = min(f.frequencies.size for f in found)
        return Campbell(
            np.array([f.speed for f in found]),
            np.array([f.frequencies[:least] for f in found]),
            np.array([f.damping_ratios[:least] for f in found]),
            np.array([f.directions[:least] for f in found]),
        )

    def critical_speeds(self, count: int = 6, order: float = 1.0) -> np.ndarray:
        """Return the speeds at which a natural frequency is ``order`` times the speed, rad/s.

        With q exp(i order W t) they are eigenvalues: K q = W^2 (order^2 M - i order G) q. Damping does not shift them,
        but motions that it lets not oscillate are left out: those whose damping ratio q* C q / (2 order W q* M q) is 1
        or more. So are rigid motions.

        Raises
        ------
        FlexibleError
            For an order that is not positive.
        """
        if not 0.0 < order < np.inf:
            raise FlexibleError(f"order is {order!r}; give a positive number, 1 of unbalance")
        m, c, g, k, _, _ = self._matrices
        inertia, shift = order**2 * m - 1j * order * g, SHIFT * self._local / order**2
        values, vectors = scipy.linalg.eig(np.linalg.solve(k + shift * inertia, inertia))
        whirls = (np.abs(values.imag) < 1e-6 * np.abs(values)) & (values.real > 0.0)
        real, shapes = values.real[whirls], vectors[:, whirls]
        there = real > 1e-12 * real.max(initial=0.0)
        squares, shapes = 1.0 / real[there] - shift, shapes[:, there]
        there = squares > (AT_REST / order) ** 2 * self._local
        speeds, shapes = np.sqrt(squares[there]), shapes[:, there]
        lost, held = (np.einsum("ia,ij,ja->a", shapes.conj(), matrix, shapes).real for matrix in (c, m))
        return np.sort(speeds[lost < 2.0 * order * speeds * held])[:count]

    def unbalance_response(
        self, speeds: Sequence[Quantity], unbalance: Mapping[Quantity, complex | str]
    ) -> UnbalanceResponse:
        """Return the steady response to unbalanced masses.

        Parameters
        ----------
        speeds : sequence of float or str
            rad/s or text.
        unbalance : mapping of float or str to complex or str
            Mass times eccentricity, kg m or text such as "100 g*mm", by position along the shaft, m; a complex number
            has its angle at time 0. Between stations its force is shared by the functions of the element, the same that
            its mass matrix has.

        Raises
        ------
        FlexibleError
            For a place off the shaft, and an unbalance that is no finite number.
        """
        values = np.array([quantity(s, "angular speed", "speeds") for s in speeds])
        m, c, g, k, rows, z = self._matrices
        load = np.zeros(DOFS * z.size, dtype=complex)
        for at, size in unbalance.items():
            places, moved, _ = self.shaft.section_motion(quantity(at, "length", "unbalance"), "unbalance")
            if isinstance(size, str):
                size = quantity(size, "kg*m", f"unbalance at {at}")
            if isinstance(size, bool) or not isinstance(size, Number) or not np.isfinite(complex(size)):  # type: ignore
                raise FlexibleError(f"unbalance at {at} is {size!r}; give a finite mass times eccentricity, kg m")
            load[places] += size * (moved[0] - 1j * moved[1])
        load = load[rows]
        found = [np.linalg.solve(k + 1j * w * (c + w * g) - w**2 * m, w**2 * load) for w in values]
        return UnbalanceResponse(values, z, self._at_stations(np.array(found)), self.shaft)

    def _at_stations(self, vectors: np.ndarray) -> np.ndarray:
        """Return vectors of the degrees of freedom in use by station and direction."""
        rows, z = self._matrices[4], self._matrices[5]
        out = np.zeros((len(vectors), DOFS * z.size), dtype=complex)
        out[:, rows] = vectors
        return out.reshape(len(vectors), z.size, DOFS)


def _whirl(shape: np.ndarray) -> str:
    """Return the sense in which the station that moves most goes round."""
    radial = np.abs(shape[:, 0]) ** 2 + np.abs(shape[:, 1]) ** 2
    x, y = shape[int(np.argmax(radial)), :2]
    size = abs(x) ** 2 + abs(y) ** 2
    # q exp(i w t): x = cos, y = sin needs y = -i x
    turn = (np.conj(x) * y).imag
    if size == 0.0 or abs(turn) < 1e-6 * size:
        return "planar"
    return "forward" if turn < 0 else "backward"
