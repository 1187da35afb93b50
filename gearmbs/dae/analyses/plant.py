"""A linear plant x' = A x + B u, y = C x + D u from a DAE linearised about one of its states.

All of it comes from one linearisation, see `gearmbs.dae.analyses.linearisation`:

    M q'' + C q' + K q + H z + U0 u + U1 u' + U2 u'' = 0,    z' = P q + Q q' + S z + V0 u + V1 u' + V2 u''.

`gearmbs.dae.analyses.realisation` makes the matrices of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm, hessenberg, matrix_balance, schur, solve_sylvester

from gearmbs.dae.analyses.coordinates import JointCoordinate
from gearmbs.dae.analyses.eigenvalues import spectrum
from gearmbs.dae.analyses.kinematics import Instant
from gearmbs.dae.analyses.linearisation import Reduced, reduce, warn_of_varying
from gearmbs.dae.analyses.realisation import IMPROPER, Asked, lowered, realised
from gearmbs.dae.analyses.response import Response, response_of
from gearmbs.dae.problem import ModelError
from gearmbs.dae.state import path_of
from gearmbs.units import to_si
from gearmbs.wording import did_you_mean

if TYPE_CHECKING:
    from scipy.signal import TransferFunction

    from gearmbs.dae.model.system import System
    from gearmbs.dae.state import State

FORMATS = (".mat", ".npz")

STANDING = 1e-7
"""Magnitude of a pole, of the fastest one, up to which it is an integrator: the error of a double pole is the root of
rounding, 1.5e-8 of the fastest."""
SHOWN = 1e-9
"""Least entry by which an output sees an integrator, relative to its row and column: rounding is 1e-13 of them."""


@dataclass(frozen=True)
class OperatingPoint:
    """What a plant's changes are counted from.

    Attributes
    ----------
    t : float
        Time at which functions of time are frozen, s.
    inputs, outputs : ndarray
        Values u0 and y0 there.
    state : State or None
        The state it was asked for, if it was one.
    """

    t: float
    inputs: np.ndarray
    outputs: np.ndarray
    state: State | None = None


@dataclass(repr=False)
class LinearPlant:
    """x' = A x + B u, y = C x + D u about an operating point, in changes from it.

    It unpacks as (A, B, C, D): ``scipy.signal.StateSpace(*plant)``, ``control.ss(*plant)``.

    Attributes
    ----------
    A : ndarray, shape (n, n)
    B : ndarray, shape (n, inputs)
    C : ndarray, shape (outputs, n)
    D : ndarray, shape (outputs, inputs)
    states, inputs, outputs : list of str
        Displacements are in m and rad, velocities and rates by ``time_unit``.
    state_units, input_units, output_units : list of str
        "" where they are not known, as of expressions.
    time_unit : float
        Unit of time, s.
    point : OperatingPoint or None
    own_poles : ndarray or None
        Eigenvalues of A as the linearisation has them, in which motions that nothing resists are zeros.
    own_response : Response or None
        Where there are such motions, what answers at a frequency in place of the matrices.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: list[str]
    inputs: list[str]
    outputs: list[str]
    time_unit: float = 1.0
    state_units: list[str] = field(default_factory=list)
    input_units: list[str] = field(default_factory=list)
    output_units: list[str] = field(default_factory=list)
    point: OperatingPoint | None = None
    own_poles: np.ndarray | None = None
    own_response: Response | None = None

    def __post_init__(self) -> None:
        for names, units in (
            (self.states, self.state_units),
            (self.inputs, self.input_units),
            (self.outputs, self.output_units),
        ):
            units += [""] * (len(names) - len(units))

    def __iter__(self) -> Iterator[np.ndarray]:
        return iter((self.A, self.B, self.C, self.D))

    @property
    def poles(self) -> np.ndarray:
        """Eigenvalues of A, shape (n,); exactly zero of what nothing resists, by magnitude.

        The matrix itself tells a double zero from the root of its rounding only, 1e-4 rad/s beside 1e4.
        """
        if self.own_poles is not None:
            return self.own_poles.copy()
        return np.linalg.eigvals(self.A) if self.A.size else np.zeros(0, dtype=complex)

    def place(self, name: str | int | Sequence[Any], kind: str = "input") -> int:
        """Return the number of an input, output or state, given by its name, its number or what it was asked for by.

        Raises
        ------
        ModelError
            If there is none.
        """
        names = {"input": self.inputs, "output": self.outputs, "state": self.states}[kind]
        if isinstance(name, tuple | list):
            # as it was asked for; the level of a position is not in the name
            parts = [str(getattr(part, "name", part)) for part in name]
            name = " ".join(parts[:-1] if parts[-1:] == ["position"] else parts)
        if isinstance(name, str) and name in names:
            return names.index(name)
        if isinstance(name, int | np.integer) and -len(names) <= name < len(names):
            return int(name) % len(names)
        hint = did_you_mean(str(name), names, shown=repr, otherwise=f"they are {', '.join(map(repr, names)) or 'none'}")
        raise ModelError(f"plant: there is no {kind} {name!r}; {hint}")

    def transfer(self, s: complex) -> np.ndarray:
        """Return C (s - A)^-1 B + D, shape (outputs, inputs); s is by the plant's unit of time."""
        n = len(self.A)
        if s == 0.0:
            # a shaft that turns freely is an integrator, seen or not: what rounding leaves of it is no number
            return self.dc_gain.astype(complex)
        if self.own_response is not None:
            return self.own_response.at(s)
        return self.C @ np.linalg.solve(s * np.eye(n) - self.A, self.B.astype(complex)) + self.D

    def frequency_response(self, f: npt.ArrayLike) -> np.ndarray:
        """Return C (2 pi i f - A)^-1 B + D.

        Parameters
        ----------
        f : ndarray, shape (m,)
            Frequencies, Hz.

        Returns
        -------
        ndarray of complex, shape (m, outputs, inputs)
            Amplitude and phase lead of each output over each input; infinite at a pole. Motions that nothing resists
            are those of the equations, however low the frequency: A has rounding in place of their zeros.
        """
        # A = Q H Q^T once: each frequency is then a solution with a matrix that has one diagonal below its main one
        points = 2j * np.pi * self.time_unit * np.atleast_1d(_read(f, "frequency", "f"))
        out = np.zeros((points.size, len(self.outputs), len(self.inputs)), dtype=complex)
        out += self.D
        if not len(self.A) or not out.size:
            return out
        if self.own_response is not None:
            for k, s in enumerate(points):
                out[k] = self.dc_gain if s == 0.0 else self.own_response.at(s)
            return out
        # displacements and rates in units in which they are alike: turned as they are, half of the digits are lost
        alike, (size, _) = matrix_balance(self.A, permute=False, separate=True)
        reduced, turned = hessenberg(alike, calc_q=True)
        left, right = self.C * size @ turned, turned.T @ (self.B / size[:, None]).astype(complex)
        for row, s in zip(out, points, strict=True):
            if s == 0.0:
                row[:] = self.dc_gain
                continue
            try:
                row += left @ np.linalg.solve(s * np.eye(len(reduced)) - reduced, right)
            except np.linalg.LinAlgError:
                row[:] = np.inf
        return out

    def transfer_function(
        self, which: str | int | Sequence[Any] = 0, output: str | int | Sequence[Any] = 0
    ) -> TransferFunction:
        """Return the transfer function from one input to one output as polynomials in s.

        Parameters
        ----------
        which, output : str, int or tuple
            Input and output, by name or number, or as they were asked for, ``("torque", "pin")``.

        Returns
        -------
        scipy.signal.TransferFunction
            Poles that the output does not show are in numerator and denominator, as far as rounding leaves them; those
            at zero exactly. Coefficients are known to rounding of the largest: where poles differ by many powers of ten
            only :meth:`frequency_response` is right at all of them.

        Raises
        ------
        ModelError
            If there is no such input or output, and where coefficients, products of up to all poles, exceed what a
            number holds.
        """
        from scipy.signal import TransferFunction

        k, j = self.place(output, "output"), self.place(which)
        poles = self.poles
        with np.errstate(over="ignore", invalid="ignore"):
            denominator = np.real(np.poly(poles)) if poles.size else np.ones(1)
            # det(s - A + b c) = (1 + c (s - A)^-1 b) det(s - A)
            loop = self.A - np.outer(self.B[:, j], self.C[k])
            closed = np.real(np.poly(np.linalg.eigvals(loop))) if poles.size else 1.0
            numerator = np.atleast_1d(closed - denominator + self.D[k, j] * denominator)
        if not (np.isfinite(denominator).all() and np.isfinite(numerator).all()):
            raise ModelError(
                f"plant: of {poles.size} poles up to {np.abs(poles).max():.3g} the coefficients of a transfer function "
                "exceed 1e308; take frequency_response(), or the matrices as scipy.signal.StateSpace(*plant)"
            )
        # the first coefficients are D, C B, C A B ..: zero as long as these are rounding
        row, zeros = self.C[k], int(self.D[k, j] == 0.0)
        while 0 < zeros < numerator.size:
            if abs(row @ self.B[:, j]) > IMPROPER * (np.abs(row) @ np.abs(self.B[:, j])):
                break
            row, zeros = row @ self.A, zeros + 1
        numerator = numerator[min(zeros, numerator.size - 1) :]
        if self.own_response is not None:
            # the last ones are zero where the output grows less towards rest than there are poles at 0
            power = int(self.own_response.towards_rest(self._slowest)[0][k, j])
            numerator[max(numerator.size - max(int(np.sum(poles == 0.0)) - power, 0), 0) :] = 0.0
        return TransferFunction(numerator, denominator)

    @property
    def _slowest(self) -> float:
        """The magnitude of the slowest pole that is not zero, 1 if all are."""
        sizes = np.abs(self.poles)
        return float(sizes[sizes > 0.0].min(initial=np.inf)) if (sizes > 0.0).any() else 1.0

    @property
    def dc_gain(self) -> np.ndarray:
        """The gain at rest, D - C A^-1 B, shape (outputs, inputs); infinite where an integrator stands between.

        Integrators that an output does not show, or an input does not move, are left out.
        """
        if not len(self.A):
            return self.D.copy()
        if self.own_response is not None:
            power, left = self.own_response.towards_rest(self._slowest)
            return np.where(power > 0, np.inf, np.where(power == 0, left, 0.0))
        fastest = float(np.abs(self.poles).max())
        # displacements and rates in units in which they are alike: a speed's share of an angle that drifts is else 1e-8
        alike, (size, _) = matrix_balance(self.A, permute=False, separate=True)
        seen, given = self.C * size, self.B / size[:, None]
        schur_form, vectors, standing = schur(alike.astype(complex), sort=lambda s: abs(s) <= STANDING * fastest)
        b, c = vectors.conj().T @ given, seen @ vectors
        slow, fast = slice(0, standing), slice(standing, None)
        slow_part, fast_part, between = schur_form[slow, slow], schur_form[fast, fast], schur_form[slow, fast]
        # [1 X; 0 1] parts them: slow X - X fast = -between
        parting = solve_sylvester(slow_part, -fast_part, -between) if standing and between.size else between
        c_fast, b_slow = c[:, fast] + c[:, slow] @ parting, b[slow] - parting @ b[fast]
        gain = self.D - (c_fast @ np.linalg.solve(fast_part, b[fast]) if fast_part.size else 0.0)
        gain = gain.real
        # what no input moves, or one integrator hands to another, is rounding of its terms
        terms = np.abs(b[slow]) + np.abs(parting) @ np.abs(b[fast]) if fast_part.size else np.abs(b[slow])
        largest = np.linalg.norm(terms, axis=0)
        moved = np.where(np.linalg.norm(b_slow, axis=0) > SHOWN * largest, b_slow, 0.0)
        handed = np.triu(slow_part, 1)
        handed[np.abs(handed) <= SHOWN * fastest] = 0.0
        # the terms C A^k B / s^(k+1) of the integrators
        for _ in range(standing):
            sizes = np.outer(np.linalg.norm(seen, axis=1), np.linalg.norm(moved, axis=0))
            gain[np.abs(c[:, slow] @ moved) > SHOWN * sizes] = np.inf
            moved = handed @ moved
        return gain

    def step(self, times: np.ndarray, which: str | int | Sequence[Any] = 0) -> np.ndarray:
        """Return the outputs after a unit step of one input from rest.

        Parameters
        ----------
        times : ndarray, shape (m,)
            In the unit of time of the plant.
        which : str, int or tuple
            The input, as of :meth:`transfer_function`.

        Returns
        -------
        ndarray, shape (m, outputs)
        """
        n, j = len(self.A), self.place(which)
        held = np.zeros((n + 1, n + 1))
        held[:n, :n], held[:n, n] = self.A, self.B[:, j]
        instants = np.atleast_1d(_read(times, "time", "times", self.time_unit))
        if (instants < 0.0).any():
            raise ModelError(f"times: {instants.min():g} lies before the step, which is at 0")
        out = [self.C @ expm(held * float(t))[:n, n] + self.D[:, j] for t in instants]
        return np.array(out).reshape(-1, len(self.outputs))

    def save(self, path: str | Path) -> Path:
        """Write the matrices, names and units to a .mat file for MATLAB or a .npz file for NumPy.

        Raises
        ------
        ModelError
            If the file name ends otherwise.
        """
        path = check_format(path)
        content: dict[str, Any] = dict(zip("ABCD", self, strict=True)) | {"time_unit": self.time_unit}
        labels = {"states": self.states, "inputs": self.inputs, "outputs": self.outputs}
        labels |= {"state_units": self.state_units, "input_units": self.input_units, "output_units": self.output_units}
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(f".{path.stem}.part{path.suffix}")
        if path.suffix == ".mat":
            from scipy.io import savemat

            # cell arrays of names
            savemat(part, content | {key: np.array(names, dtype=object) for key, names in labels.items()})
        else:
            content |= {key: np.array(names, dtype=str) for key, names in labels.items()}
            np.savez(part, **content)
        part.replace(path)
        return path

    def table(self) -> str:
        """Return sizes, names, poles and matrices as text."""
        kinds = (("states", self.states, self.state_units), ("inputs", self.inputs, self.input_units))
        lines = [repr(self)]
        for title, names, units in (*kinds, ("outputs", self.outputs, self.output_units)):
            labels = [f"{name} ({unit})" if unit else name for name, unit in zip(names, units, strict=True)]
            lines.append(f"  {title:<8} {', '.join(labels) or 'none'}")
        for name, matrix in zip("ABCD", self, strict=True):
            rows = [" ".join(f"{v:13.6g}" for v in row) for row in matrix]
            lines += [f"  {name} ({matrix.shape[0]} by {matrix.shape[1]})", *(f"    {row}" for row in rows)]
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        return f"LinearPlant({len(self.A)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs)"


def _read(values: Any, unit: str, field: str, factor: float = 1.0) -> np.ndarray:
    """Return numbers, or texts with a unit in a unit of some factor; refuse what is neither."""
    try:
        if np.iscomplexobj(values):
            # numpy would drop the imaginary part of an array
            raise TypeError
        found = np.asarray(math.nan if values is None else values, dtype=float)
    except (TypeError, ValueError):
        try:
            every = values if isinstance(values, Sequence | np.ndarray) and not isinstance(values, str) else [values]
            found = np.array([to_si(v, unit, field) / (factor if isinstance(v, str) else 1.0) for v in every])
        except (TypeError, ValueError) as error:
            raise ModelError(str(error)) from None
    if found.ndim > 1 or not np.isfinite(found).all():
        raise ModelError(f"{field}: {' '.join(repr(values).split())}; give finite numbers in a row")
    return found


def poles_of(reduced: Reduced, own: np.ndarray, integrators: int = 0) -> np.ndarray:
    """Return the eigenvalues of a linearisation with some of its states, and of what integrates inputs: zeros.

    Parameters
    ----------
    reduced : Reduced
    own : ndarray of int
        Differential states that are states of the plant.
    integrators : int

    Returns
    -------
    ndarray of complex, shape (2 n + own + integrators,)
        By magnitude, of pairs the one with the positive frequency first.
    """
    part = replace(
        reduced, state_force=reduced.state_force[:, own], state_position=reduced.state_position[own],
        state_velocity=reduced.state_velocity[own], state_state=reduced.state_state[np.ix_(own, own)],
    )  # fmt: skip
    values = spectrum(part).values
    values = values[np.lexsort((-values.imag, np.abs(values)))]
    zeros = 2 * len(reduced.mass) + own.size - values.size + integrators
    return np.concatenate([np.zeros(zeros, dtype=complex), values])


def check_format(path: str | Path) -> Path:
    """Return a path if a plant can be written to it.

    Raises
    ------
    ModelError
        If its name does not end in .mat or .npz.
    """
    path = path_of(path, "plant: save")
    if path.suffix not in FORMATS:
        raise ModelError(f"path is {str(path)!r}; a plant is written as {' or '.join(FORMATS)}")
    return path


def linear_plant(
    system: System, inputs: Sequence[int], outputs: Sequence[int], names: Sequence[str], time_unit: float = 1.0,
    joints: Sequence[JointCoordinate] = (),
) -> LinearPlant:  # fmt: skip
    """Return the plant between states of a system at its present pose and velocity.

    Parameters
    ----------
    system : System
    inputs : sequence of int
        Differential states, counted from 0, whose rate is zero.
    outputs : sequence of int
        Differential states whose rates are the outputs.
    names : sequence of str
        Of all differential states.
    time_unit : float
        Of the plant, s.
    joints : sequence of JointCoordinate
        See `gearmbs.dae.analyses.linearisation.reduce`.

    Raises
    ------
    SingularModelError
        If a motion left free by the constraints has no inertia.
    """
    instant = Instant(system, "I3")
    instant.released = True
    instant.y = instant.settle(instant.y)
    reduced = reduce(instant, joints=joints, balance=True)
    warn_of_varying(reduced)
    own = np.array([k for k in range(len(names)) if k not in (*inputs, *outputs)], dtype=int)
    u, y = np.array(inputs, dtype=int), np.array(outputs, dtype=int)
    asked = [Asked(names[k], "") for k in u]
    found = realised(reduced, own, y, u)
    a, b, c, d = lowered(found, asked, [names[k] for k in y])
    n = len(reduced.mass)
    # rates by another unit of time; the outputs are rates, too
    scale = np.concatenate([np.ones(n), np.full(n, time_unit), np.ones(own.size)])
    a, b = time_unit * scale[:, None] * a / scale, time_unit * scale[:, None] * b
    c, d = time_unit * c / scale, time_unit * d
    moving = _moving(instant, reduced)
    states = [f"x{k + 1} ({body})" for k, body in enumerate(moving)]
    states += [f"v{k + 1} ({body})" for k, body in enumerate(moving)] + [names[k] for k in own]
    poles = time_unit * poles_of(reduced, own)
    answer = response_of(reduced, own, u, found.outputs, found.chains, [0] * u.size)
    if answer is not None:
        answer = replace(answer, time_unit=time_unit)
    return LinearPlant(
        a, b, c, d, states, [names[k] for k in u], [names[k] for k in y], time_unit, own_poles=poles,
        own_response=answer,
    )  # fmt: skip


def _moving(instant: Instant, reduced: Reduced) -> list[str]:
    """Return the body that each coordinate moves most."""
    if not reduced.basis.shape[1]:
        return []
    moved = np.abs(instant.spatial(reduced.basis)).max(axis=2)
    return [instant.system.body_names[int(k)] for k in moved.argmax(axis=1)]
