"""The DAE as integrators see it: four compiled functions over flat tables.

Every problem, a mechanism's or a user's own, has the same signatures, so that one compiled
integrator serves all of them through typed function pointers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from gearmbs.kernels.kinds import types

Table = Any
"""An array of numbers, or a list of them, which Python reads and writes one by one in a third of the time."""

INPUT = "input"
"""A number that is set while a run goes on, held or led along a line."""
PARAMETER = "parameter"
"""One that is constant until it is set, of the mechanism or of one of its elements."""


@dataclass(frozen=True)
class Place:
    """Where a number stands in a table of numbers.

    Attributes
    ----------
    at : int
        The number itself, or the time t_0 before its coefficients.
    size : int
        Number of coefficients; 0: the number alone stands there.
    order : int
        How often it is integrated there.
    factor, offset : float
        What stands there for a unit of the number, and for none of it; of places without coefficients.
    table : int
        Which part of the table ``at`` counts in, as whoever makes the table knows; -1: the whole one.
    """

    at: int
    size: int = 0
    order: int = 0
    factor: float = 1.0
    table: int = -1
    offset: float = 0.0
    bent: bool = False
    """Whether what stands there may act otherwise than in proportion to the number, or by a factor of the time."""

    def polynomial(self, table: Table, t: float) -> tuple[float, ...]:
        """Return the value at a time and all derivatives."""
        if self.size == 0:
            return ((float(table[self.at]) - self.offset) / self.factor,)
        c = list(map(float, table[self.at + 1 : self.at + 1 + self.size]))
        x = t - float(table[self.at])
        found = []
        for order in range(self.size):
            value = 0.0
            for k in range(self.size - 1, order - 1, -1):
                value = value * x + c[k] * math.perm(k, order)
            found.append(value)
        return tuple(found)

    def write(self, table: Table, t: float, value: float, slope: float) -> None:
        """Let the number be ``value + slope (t' - t)`` from ``t`` on; its integrals go on from where they are."""
        if self.order == 0:
            # the coefficients behind stay zero
            table[self.at : self.at + 1 + min(self.size, 2)] = (
                (t, value, slope) if self.size else (self.offset + self.factor * value,)
            )
            return
        known = self.polynomial(table, t)[: self.order]
        derivatives = [*known, value, slope]
        table[self.at] = t
        table[self.at + 1 : self.at + 1 + self.size] = [0.0] * self.size
        for k, derivative in enumerate(derivatives):
            table[self.at + 1 + k] = derivative / math.factorial(k)


class Allowed(NamedTuple):
    """Values that a number may have: from one to another, the first of which may be left out."""

    least: float = -math.inf
    most: float = math.inf
    above: bool = False

    def wrong(self, value: float) -> str:
        """Return what a value that is not allowed must be, "" of others."""
        if self.least < value <= self.most or (value == self.least and not self.above):
            return ""
        if self.most < math.inf:
            return f"it must lie between {self.least:g} and {self.most:g}"
        if self.least == 0.0:
            return "it must be positive" if self.above else "it must not be negative"
        return f"it must be {'above' if self.above else 'at least'} {self.least:g}"


ANY, POSITIVE, NOT_NEGATIVE = Allowed(), Allowed(0.0, above=True), Allowed(0.0)


@dataclass(frozen=True)
class Number:
    """A number of a model that can be changed by its name.

    Attributes
    ----------
    name : str
    unit : str
        Of SI.
    kind : {"input", "parameter"}
    places : tuple of Place
        An input's first place is its own, whatever uses it.
    prescribes : tuple of (str, int)
        Constraint rows whose function it is, and how often it is integrated there: 0 where it is a position itself.
    """

    name: str
    unit: str
    kind: str
    places: tuple[Place, ...]
    prescribes: tuple[tuple[str, int], ...] = ()
    loads: bool = False
    """Whether equations change with it as with a load, and derivatives by the unknowns do not."""
    allowed: Allowed = ANY
    """What it may be set to: what the element that it is of could be made with."""

    def value(self, table: Table, t: float) -> float:
        """Return the value at a time."""
        place = self.places[0]
        at = place.at
        if self.kind == INPUT:
            return float(table[at + 1] + table[at + 2] * (t - table[at]))
        return (float(table[at]) - place.offset) / place.factor

    def line(self, table: Table, t: float) -> tuple[float, float]:
        """Return value and rate at a time."""
        if self.kind != INPUT:
            return self.value(table, t), 0.0
        at = self.places[0].at
        slope = float(table[at + 2])
        return float(table[at + 1]) + slope * (t - float(table[at])), slope

    def slope(self, table: Table) -> float:
        """Return the rate, zero of what is held."""
        return float(table[self.places[0].at + 2]) if self.kind == INPUT else 0.0

    def write(self, table: Table, t: float, value: float, slope: float = 0.0) -> None:
        """Let it be ``value + slope (t' - t)`` from ``t`` on, in all its places."""
        for place in self.places:
            place.write(table, t, value, slope)

    def placed(self, header: np.ndarray) -> Number:
        """Return the number with all places counted in the whole table, whose parts begin at ``header[part]``."""
        return replace(self, places=tuple(replace(p, at=p.at + int(header[p.table]), table=-1) for p in self.places))

    def moved_to(self, cells: np.ndarray) -> Number:
        """Return the number with its places in a table that holds those in ``cells``, which increase, alone."""
        return replace(self, places=tuple(replace(p, at=int(np.searchsorted(cells, p.at))) for p in self.places))

    def cells(self) -> np.ndarray:
        """Return all places in the table that :meth:`write` may write to."""
        return np.concatenate([np.arange(place.at, place.at + 1 + place.size) for place in self.places])


def cells_of(numbers: Mapping[str, Number]) -> np.ndarray:
    """Return all places in the table that any of some numbers may be written to, in their order."""
    return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *(n.cells() for n in numbers.values())]))


__all__ = ["ANY", "INPUT", "NOT_NEGATIVE", "PARAMETER", "POSITIVE", "Allowed", "Number", "Place", "cells_of"]


EPS = 2.220446049250313e-16
"""Distance from one to the next larger double, 2^-52."""


# Errors a modeller can act on.


class ModelError(ValueError):
    """The model cannot be what is meant: a field, a name or a value is wrong.

    Attributes
    ----------
    solution : Solution or None
        What an integration computed until a function of the user failed.
    """

    solution: Any = None


class AssemblyError(ModelError):
    """The constraints contradict each other, or no position satisfies them."""


class SingularModelError(ModelError):
    """A body can move without inertia, or the equations have no unique solution."""


F8 = types.float64
I8 = types.int64
VEC = types.float64[::1]
MAT = types.float64[:, ::1]
IVEC = types.int64[::1]

RESIDUAL_SIG = types.void(F8, VEC, VEC, VEC, IVEC, VEC, VEC)
JACOBIAN_SIG = types.void(F8, VEC, VEC, F8, VEC, IVEC, VEC, VEC)
"""jacobian(t, y, yp, cj, vals, idata, rdata, work): write dG/dy + cj dG/dy' at (t, y, y') to ``vals``, in the order of
the CSC pattern; the tables and the scratch array are those of the `DAEProblem`."""
KEPT, HISTORY_CHANGED, MATRIX_OUTDATED = range(3)
"""What a hook tells the integrator."""
HOOK_SIG = types.int64(F8, MAT, I8, IVEC, VEC, VEC)
EVENTS_SIG = types.void(F8, VEC, VEC, VEC, IVEC, VEC, VEC)


SURE = 0.5
"""Angle (rad) by which none has moved, nor its rate would move it, where turns are counted from one output to the next:
an error of half a turn is five times as far."""


class Counted(NamedTuple):
    """Angles that are counted through full turns, and where the table of numbers has them.

    Attributes
    ----------
    angles : list of (str, str, str)
        Function AX, AY or AZ and names of the markers I and J.
    places : ndarray of int, shape (1 + 2 a,)
        In ``rdata``: of the time they were last counted at, of their values then (rad) and of their rates (rad/s).
    """

    angles: list[tuple[str, str, str]]
    places: np.ndarray

    def values(self, t: np.ndarray, kept: np.ndarray) -> np.ndarray:
        """Return the angles to expect at times by what stood in the places then, shape (m, a), rad."""
        a = len(self.angles)
        return kept[:, 1 : 1 + a] + (t - kept[:, 0])[:, None] * kept[:, 1 + a :]

    def jumps(self, t: np.ndarray, kept: np.ndarray) -> np.ndarray:
        """Return at which times the angles cannot be counted from those at the time before, the first among them."""
        found = np.ones(t.size, dtype=bool)
        moved = np.abs(np.diff(self.values(t, kept), axis=0))
        led = np.abs(kept[:-1, 1 + len(self.angles) :] * np.diff(t)[:, None])
        found[1:] = (np.maximum(moved, led) > SURE).any(axis=1)
        return found


class Alone(NamedTuple):
    """The equations of one element alone, or what it adds to some, for numbers that enter nothing else.

    Attributes
    ----------
    residual : compiled function
        As that of the problem, which has just been called at the same place; it writes the equations of one element.
    place, rest : int
        Where in ``idata`` the number of the element stands, and what stands there otherwise.
    sums : int
        Number from which on the residual is what an element adds to equations in which there is more.
    owners : callable
        ``owners(places)`` returns the elements whose equations alone the numbers at places of ``rdata`` enter, each
        with the places of these equations, or None if they enter others, too.
    """

    residual: Callable
    place: int
    rest: int
    sums: int
    owners: Callable[[np.ndarray], list[tuple[int, np.ndarray]] | None]


class Home(NamedTuple):
    """A time, unknowns there, and the tables of integers and numbers that are valid for them."""

    t: float
    y: np.ndarray
    idata: np.ndarray
    rdata: np.ndarray


@dataclass
class DAEProblem:
    """A DAE G(t, y, y') = 0 with everything an integrator needs to know about it.

    Parameters
    ----------
    n : int
        Number of unknowns.
    residual, jacobian, hook, events : compiled functions
        Numba functions of the signatures in this module; ``hook`` and ``events`` may be None.
    indptr, indices : ndarray of int64
        CSC pattern of the Jacobian dG/dy + cj dG/dy'.
    idata, rdata : ndarray
        Flat tables handed to every call; an integrator works on copies.
    work_size : int
        Length of the scratch array handed to every call.
    y0, yp0 : ndarray, shape (n,)
        Consistent initial values at ``t0``.
    error_mask : ndarray of bool, shape (n,)
        Unknowns under local error control.
    atol_scale : ndarray, shape (n,)
        Weight of each unknown: the absolute tolerance is ``tol * atol_scale``.
    scale : ndarray, shape (n,)
        Typical magnitude of each unknown, for scaling the Newton matrix.
    differential : ndarray of bool, shape (n,)
        Unknowns whose derivative appears in G.
    continuous : ndarray of bool, shape (n,), optional
        Unknowns without a derivative in G that cannot jump all the same, as functions of those with one: velocities
        that follow from momenta. Where a run starts afresh their error is tested as that of the others. Default: none.
    index_one : ndarray of bool, shape (n,), optional
        Algebraic unknowns that equations without derivatives determine: the corrector satisfies them to their
        tolerance at every step. What others, multipliers of index two and more, do to the rest shrinks with the step,
        and so does what it asks of them. Default: none.
    nonlinear_rates : bool
        Whether G is not linear in y': the corrector then trusts no rate of convergence that it has not seen itself.
    constant_slopes : bool
        Whether dG/dy' is the same everywhere.
    alone : Alone, optional
        The equations of single elements.
    start_note : str
        What to say of the initial values in the message of a run that succeeds.
    names : list of str
        Names of the unknowns, for messages; equation i goes by that of unknown i.
    n_events : int
        Number of event functions.
    hook_interval : callable, optional
        ``hook_interval(t, y, yp)`` returns the longest time that may pass until ``hook`` is called again. For
        integrators that do not call it after each step.
    restart_rates : callable, optional
        ``restart_rates(t, y, yp, idata, rdata)`` returns y' consistent with y after ``hook`` has rewritten y.
    own_start : callable, optional
        ``own_start(t, y, yp, idata, rdata)`` returns y and y' where these are of a like problem with other numbers:
        what does not carry over, as momenta with another inertia, follows from what does.
    jacobian_residuals : int
        Calls of ``residual`` whose time one of ``jacobian`` takes, if they are many: differences, modal bodies.
    small_entries : bool
        Whether many entries of the Jacobian are small beside others, as second derivatives by modal coordinates beside
        the stiffness of the modes, so that a corrector converges without them.
    couplings : ndarray of bool, optional
        Entries of the pattern between the modes of a body: small ones of these are left out first.
    modes : ndarray of int64, shape (4 m,), optional
        Of each modal coordinate the places of its momentum, velocity and coordinate, whose equations p' = Q, p = M v
        and v = q' stand in the same places, and the number of its body; body by body.
    finite_rates : bool
        Whether no equation makes a rate infinite: steps are not looked at for poles that they have got over then, which
        costs two evaluations wherever an unknown turns against its prediction.
    solved_at_outputs : ndarray of bool, optional
        Algebraic unknowns that are solved for at outputs, where the rest of the algebraic ones is evaluated elsewhere;
        default all, as far as they are not under error control. See `gearmbs.dae.integrators.algebraic`.
    solved_if_needed : ndarray of bool, optional
        Algebraic unknowns that are solved for together with these where their equations hold them.
    advice : mapping of Status to str
        What to try after a failure, in the words of whoever states the problem; default: in those of `solve_dae`.
    callbacks : sequence
        What has to live as long as the addresses in ``idata``.
    numbers : mapping of str to Number
        Inputs and other numbers that can be changed by their names, with their places in ``rdata``.
    aliases : mapping of str to str
        Further names of ``numbers``, and what each stands for.
    watched : ndarray of int64
        Places in the scratch array: what a step's last evaluation of the residual leaves there is handed to a
        ``consumer`` behind the unknowns. Default: none.
    home : Home, optional
        Where the pivots of accelerations are chosen, wherever outputs are; default: where they are first needed.
    counted : Counted, optional
        Angles whose full turns ``hook`` counts; runs keep what is in its places at their outputs.
    """

    n: int
    residual: Callable
    jacobian: Callable
    indptr: np.ndarray
    indices: np.ndarray
    idata: np.ndarray
    rdata: np.ndarray
    work_size: int
    y0: np.ndarray
    yp0: np.ndarray
    error_mask: np.ndarray
    atol_scale: np.ndarray
    scale: np.ndarray
    differential: np.ndarray
    t0: float = 0.0
    continuous: np.ndarray | None = None
    index_one: np.ndarray | None = None
    nonlinear_rates: bool = False
    constant_slopes: bool = False
    alone: Alone | None = None
    start_note: str = ""
    names: list[str] = field(default_factory=list)
    hook: Callable | None = None
    events: Callable | None = None
    n_events: int = 0
    hook_interval: Callable[[float, np.ndarray, np.ndarray], float] | None = None
    restart_rates: Callable | None = None
    own_start: Callable[..., tuple[np.ndarray, np.ndarray]] | None = None
    jacobian_residuals: int = 0
    small_entries: bool = False
    couplings: np.ndarray | None = None
    modes: np.ndarray | None = None
    finite_rates: bool = False
    solved_at_outputs: np.ndarray | None = None
    solved_if_needed: np.ndarray | None = None
    advice: Mapping[Any, str] = field(default_factory=dict)
    callbacks: Sequence[Any] = ()
    numbers: Mapping[str, Number] = field(default_factory=dict)
    aliases: Mapping[str, str] = field(default_factory=dict)
    home: Home | None = None
    counted: Counted | None = None
    watched: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def with_fixed_pivots(self, fixed: bool) -> DAEProblem:
        """Return the problem with a home at its start, or with none."""
        if not fixed:
            return self if self.home is None else replace(self, home=None)
        return replace(self, home=Home(self.t0, self.y0.copy(), self.idata.copy(), self.rdata.copy()))

    @property
    def goes_on(self) -> np.ndarray:
        """Which unknowns cannot jump, ndarray of bool, shape (n,): ``differential`` and ``continuous`` ones."""
        return self.differential if self.continuous is None else self.differential | self.continuous
