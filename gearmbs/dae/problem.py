"""The DAE as integrators see it: four compiled functions over flat tables.

Every problem, a mechanism's or a user's own, has the same signatures, so that one compiled
integrator serves all of them through typed function pointers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numba import types

from gearmbs.dae.numbers import Number

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
    index_one : ndarray of bool, shape (n,), optional
        Algebraic unknowns that equations without derivatives determine: the corrector satisfies them to their
        tolerance at every step. What others, multipliers of index two and more, do to the rest shrinks with the step,
        and so does what it asks of them. Default: none.
    nonlinear_rates : bool
        Whether G is not linear in y': the corrector then trusts no rate of convergence that it has not seen itself.
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
    jacobian_residuals : int
        Calls of ``residual`` whose time one of ``jacobian`` takes, if they are many: differences, modal bodies.
    small_entries : bool
        Whether many entries of the Jacobian are small beside others, as second derivatives by modal coordinates beside
        the stiffness of the modes, so that a corrector converges without them.
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
    watched : ndarray of int64
        Places in the scratch array: what a step's last evaluation of the residual leaves there is handed to a
        ``consumer`` behind the unknowns. Default: none.
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
    index_one: np.ndarray | None = None
    nonlinear_rates: bool = False
    start_note: str = ""
    names: list[str] = field(default_factory=list)
    hook: Callable | None = None
    events: Callable | None = None
    n_events: int = 0
    hook_interval: Callable[[float, np.ndarray, np.ndarray], float] | None = None
    restart_rates: Callable | None = None
    jacobian_residuals: int = 0
    small_entries: bool = False
    finite_rates: bool = False
    solved_at_outputs: np.ndarray | None = None
    solved_if_needed: np.ndarray | None = None
    advice: Mapping[Any, str] = field(default_factory=dict)
    callbacks: Sequence[Any] = ()
    numbers: Mapping[str, Number] = field(default_factory=dict)
    counted: Counted | None = None
    watched: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
