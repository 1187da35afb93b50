"""Force elements given by a function of one's own, numba's or plain Python."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from weakref import WeakSet

import numpy as np

from gearmbs.dae.equations.loads.forces import (
    DERIVATIVES,
    FORCE_SIG,
    FRAME_A,
    FRAME_COLUMNS,
    FRAME_P,
    FRAME_V,
    FRAME_W,
    ROLES,
    Diagnostic,
)
from gearmbs.dae.problem import EPS, ModelError
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import numba_of, types
from gearmbs.kernels.pointers import F8, MAT, VEC, address, caller
from gearmbs.kernels.structs import matrix_at, vector_at
from gearmbs.mechanism.forces.laws import LAW_DIAGNOSTICS, Derived, ForceLaw, derive_law, refusals
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.elements import Compiled, ForceElement, State

ARGUMENTS = ("t", "frames", "states", "parameters", "wrench", "rates", "diagnostics")
DERIVATIVE_ARGUMENTS = ("t", "frames", "states", "parameters", "jac")

KEPT_OPTIONS = ("fastmath", "inline", "boundscheck")
"""Options of ``numba.njit`` with which a function that has been compiled already is compiled again."""

STEP = 1e-6
"""Steps of differences, of the distances between the markers and of speeds; in rad."""
SMALLEST = {"length": 1e-7, "angle": 1e-6, "speed": 1e-7, "angular_speed": 1e-7}
"""m, rad, m/s and rad/s."""

AWAY = (1e-3, 1e-2, 0.1, 0.1)
"""Distances over the reach of the markers, angles, and speeds over the reach and a second, at which it is tried: at the
start itself, where springs are often at rest, much is zero."""
OFF = 1e-3
"""Part of its block, a force or torque by the three components of a variation, by which a derivative may be off."""
OF_ALL = 1e-9
"""The same of all that the variations of one size do to a force or torque: what cancels in one block is rounding."""
ROUNDED = 100.0 * EPS
"""Part of a force by which differences of it may be off."""
VARIATIONS = tuple(f"{what} {axis}" for what in ("place", "rotation", "velocity", "angular velocity") for axis in "xyz")
COMPONENTS = ("Fx", "Fy", "Fz", "Nx", "Ny", "Nz")

_TRIED: WeakSet = WeakSet()
"""Kernels that have been tried in this process: nothing but time depends on it."""


@dataclass(eq=False, repr=False)
class FunctionForce(ForceElement):
    """A force given by a function; see :meth:`gearmbs.mechanism.Mechanism.force`.

    Attributes
    ----------
    all_markers : tuple of Marker
        On which it acts.
    function, derivatives : compiled function
    parameters : ndarray
    steps : tuple of float
        Of the differences: m, rad, m/s, rad/s.
    own_states : tuple of State
    told : tuple of Diagnostic
    law : Derived, optional
        Of a force law: its kernels.
    """

    all_markers: tuple[Marker, ...]
    function: Any
    derivatives: Any
    parameters: np.ndarray
    steps: tuple[float, ...]
    own_states: tuple[State, ...] = ()
    told: tuple[Diagnostic, ...] = field(default=())
    law: Derived | None = None

    settled = (
        *ForceElement.settled, "all_markers", "function", "derivatives", "parameters", "steps", "own_states", "told",
        "law",
    )  # fmt: skip
    kind = "force"

    @property
    def markers(self) -> tuple[Marker, ...]:
        """Markers on which it acts."""
        return self.all_markers

    @property
    def states(self) -> tuple[State, ...]:
        """Its own states."""
        return self.own_states

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:  # type: ignore[override]
        """What it tells beside its wrench."""
        return self.told

    def compiled(self) -> Compiled:

        functions = [(self.function, FUNCTION_SIG)]
        if self.derivatives is not None:
            functions.append((self.derivatives, DERIVATIVES_SIG))
        n, w = len(self.markers), self.wrenches
        return Compiled(
            by_differences if self.derivatives is None else with_derivatives,
            reals=np.concatenate([self.steps, self.parameters]),
            functions=tuple(functions),
            scratch=FRAME_COLUMNS * n + 2 * len(self.own_states) + len(self.told) + 6 * w,
        )

    def __getstate__(self) -> dict[str, Any]:
        state = dict(self.__dict__)
        if self.law is not None:
            state |= {"function": None, "derivatives": None}
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        if self.law is not None:
            made = self.law.compiled(_compile_both)
            self.__dict__["function"], self.__dict__["derivatives"] = made

    def by_parameter(
        self, name: str, frames: np.ndarray, states: np.ndarray | None = None, inputs: np.ndarray | None = None,
        t: float = 0.0,
    ) -> np.ndarray:  # fmt: skip
        """Return the exact derivatives of wrench and rates by a parameter of a force law.

        Arguments, results and errors are those of `ForceElement.by_parameter`, at a time ``t``, s; there are no inputs.
        """
        if self.law is None:
            raise ModelError(f"force '{self.name}': its parameters stand in a kernel; give a gm.force_law instead")
        names = list(self.law.parameters)
        if name not in names:
            raise ModelError(f"force '{self.name}': it has no parameter '{name}'; it has {', '.join(names) or 'none'}")
        out = np.zeros((6 + len(self.own_states), len(names)))
        own = np.zeros(len(self.own_states)) if states is None else np.asarray(states, dtype=float)
        frames = np.asarray(frames, dtype=float)
        if own.shape != (len(self.own_states),) or frames.shape != (len(self.markers), FRAME_COLUMNS):
            raise ModelError(
                f"force '{self.name}': frames of shape {frames.shape} and states of {own.shape}; give "
                f"({len(self.markers)}, {FRAME_COLUMNS}) and ({len(self.own_states)},)"
            )
        with np.errstate(all="ignore"):
            # of what is not chosen there may be no number
            self.law.by_parameters(t, frames, own, self.parameters, out)
        return out[:, names.index(name)]

    def __repr__(self) -> str:
        on = ", ".join(repr(m.name) for m in self.markers)
        return f"FunctionForce({self.name!r} on {on})"


def function_force(
    name: str,
    kernel: Callable[..., None] | ForceLaw,
    markers: Sequence[Marker],
    parameters: Any,
    states: Any,
    algebraic: Any,
    diagnostics: Sequence[Any],
    derivatives: Callable[..., None] | None,
    steps: Mapping[str, float] | None,
) -> FunctionForce:
    """Return a checked force; the arguments are those of :meth:`gearmbs.mechanism.Mechanism.force`."""

    label = f"force '{name}'"
    law = None
    if isinstance(kernel, ForceLaw):
        if len(diagnostics) or derivatives is not None or steps:
            raise ModelError(f"{label}: a law brings its diagnostics and derivatives along; leave out these, and steps")
        between = len(markers) == 2 and not markers[1].body.is_ground
        start = np.array([frame_of(marker) for marker in markers]) if between else None
        law = derive_law(label, kernel, len(markers), parameters, [*states, *algebraic], len(algebraic), start)
        kernel, derivatives, parameters, diagnostics = law.values, law.derivatives, law.parameters, LAW_DIAGNOSTICS
    numbers = _parameters(label, parameters)
    own = [*_states(label, name, states, False), *_states(label, name, algebraic, True)]
    told = tuple(_diagnostic(label, d) for d in diagnostics)
    for title, given in (("state", [s.name for s in own]), ("diagnostic", [d.name for d in told])):
        for key in given:
            if given.count(key) > 1:
                raise ModelError(
                    f"{label}: {title} '{key.removeprefix(f'{name}.')}' is given twice; choose another name"
                )
    frames = np.array([frame_of(marker) for marker in markers])
    _try(label, kernel, derivatives, frames, numbers, own, told)
    return FunctionForce(
        name,
        markers[0],
        markers[1] if len(markers) > 1 else markers[0],
        tuple(markers),
        *(law.compiled(_compile_both) if law else _compile_both(label, kernel, derivatives)),
        numbers,
        _steps(label, steps, frames),
        tuple(own),
        told,
        law,
    )


def _compile_both(label: str, kernel: Any, derivatives: Any) -> tuple[Any, Any]:
    """Return kernel and derivatives, compiled, or None."""
    return (
        _compiled(label, "kernel", kernel, FUNCTION_SIG, ARGUMENTS),
        None
        if derivatives is None
        else _compiled(label, "derivatives", derivatives, DERIVATIVES_SIG, DERIVATIVE_ARGUMENTS),
    )


def _parameters(label: str, given: Any) -> np.ndarray:
    values = list(given.values()) if isinstance(given, Mapping) else given
    names = list(given) if isinstance(given, Mapping) else None
    try:
        numbers = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise ModelError(
            f"{label}: parameters = {given!r}; give numbers, one a parameter, in SI: a list or a mapping by name"
        ) from None
    if numbers.ndim != 1:
        raise ModelError(f"{label}: parameters have the shape {numbers.shape}; give one row of numbers")
    for k, value in enumerate(numbers):
        if not np.isfinite(value):
            raise ModelError(f"{label}: parameter {names[k] if names else k} = {value}; give a finite number")
    return numbers


def _states(label: str, name: str, given: Any, algebraic: bool) -> list[State]:
    if not isinstance(given, Mapping):
        if len(given) == 0:
            return []
        field_ = "algebraic" if algebraic else "states"
        first = given[0] if not isinstance(given, str) else given
        raise ModelError(f"{label}: state {first!r} has no start; give {field_}={{{first!r}: 0.0}}")
    found = []
    for key, start in given.items():
        try:
            value = float(start)
        except (TypeError, ValueError):
            value = np.nan
        if not np.isfinite(value):
            raise ModelError(f"{label}: state {key!r} starts at {start!r}; give a finite number")
        found.append(State(f"{name}.{key}", start=value, algebraic=algebraic))
    return found


def _diagnostic(label: str, given: Any) -> Diagnostic:
    made = given if isinstance(given, Diagnostic) else None
    if made is None:
        parts = tuple(given) if isinstance(given, Sequence) and not isinstance(given, str) else (given,)
        if not 1 <= len(parts) <= 3 or not all(isinstance(part, str) for part in parts):
            raise ModelError(f"{label}: diagnostic {given!r}; give a name, or (name, unit, role) as texts")
        made = Diagnostic(*parts)
    if made.role not in ROLES:
        raise ModelError(
            f"{label}: diagnostic '{made.name}' has the role {made.role!r}; choose one of {', '.join(ROLES)}"
        )
    return made


def frame_of(marker: Marker) -> np.ndarray:
    """Return a marker's frame at the start, columns ``FRAME_*``."""
    body, axes = marker.body, marker.global_orientation()
    origin = marker.global_position()
    velocity = body.velocity + np.cross(body.angular_velocity, origin - body.position)
    return np.concatenate([origin, axes.ravel(), velocity, body.angular_velocity])


def _try(
    label: str, kernel: Any, derivatives: Any, frames: np.ndarray, parameters: np.ndarray, states: list[State],
    diagnostics: tuple[Diagnostic, ...],
) -> None:  # fmt: skip
    """Call the functions once as plain Python, where places out of range are found, with copies of the frames."""
    start = np.array([state.start for state in states])
    wrench, rates, told = (
        np.zeros((len(frames) if len(frames) > 2 else 1, 6)),
        np.zeros(len(states)),
        np.zeros(len(diagnostics)),
    )
    given = {"frames": frames, "states": start, "parameters": parameters}
    results = {"wrench": wrench, "rates": rates, "diagnostics": told}
    _try_one(label, "kernel", kernel, ARGUMENTS, given, results)
    if derivatives is not None:
        jac = np.zeros((wrench.size + rates.size, 12 * len(frames) + start.size))
        _try_one(label, "derivatives", derivatives, DERIVATIVE_ARGUMENTS, given, {"jac": jac})


def _try_one(
    label: str, what: str, function: Any, expected: tuple[str, ...], given: dict[str, np.ndarray],
    results: dict[str, np.ndarray],
) -> None:  # fmt: skip
    python = getattr(function, "py_func", function)
    _check_arguments(label, what, python, expected)
    try:
        with np.errstate(all="ignore"):
            answer = python(0.0, *(part.copy() for part in given.values()), *results.values())
    except ZeroDivisionError:
        # compiled it gives no number and raises nothing; at the start that may be, for instance of a distance
        return
    except Exception as error:
        shapes = ", ".join(f"{name} {part.shape}" for name, part in {**given, **results}.items())
        reason = f"{type(error).__name__}: {error}"
        raise ModelError(f"{label}: its {what} fails with {reason}; the shapes are {shapes}") from error
    if answer is not None:
        written = ", ".join(results)
        raise ModelError(f"{label}: its {what} returns {answer!r}; let it write to {written} and return nothing")


def _check_arguments(label: str, what: str, function: Any, expected: tuple[str, ...]) -> None:
    if not callable(function):
        raise ModelError(f"{label}: {what} = {function!r} is not a function")
    signature = inspect.signature(function)
    try:
        signature.bind(*expected)
    except TypeError:
        taken = list(signature.parameters)
        raise ModelError(
            f"{label}: {what} has to take {len(expected)} arguments ({', '.join(expected)}), it takes {len(taken)} "
            f"({', '.join(taken)})"
        ) from None


def _compiled(label: str, what: str, function: Any, signature: Any, expected: tuple[str, ...]) -> Any:
    """Return a function compiled for a signature; a division by zero gives no number and raises nothing."""
    python = getattr(function, "py_func", function)
    options = {key: value for key, value in getattr(function, "targetoptions", {}).items() if key in KEPT_OPTIONS}
    wanted = numba_of(signature)
    dispatcher: Any = njit(error_model="numpy", nogil=True, **options)(python)
    try:
        dispatcher.compile(wanted.args)
        found = dispatcher.overloads[wanted.args].signature.return_type
    except refusals() as error:
        lines = [line for line in str(error).splitlines() if line.strip()]
        text = "\n".join(lines[:8])
        outside = inspect.getclosurevars(python)
        plain = [name for name, value in {**outside.globals, **outside.nonlocals}.items() if inspect.isfunction(value)]
        remedy = (
            f"decorate what it calls, {', '.join(plain)}, with numba.njit"
            if plain
            else "hand over what else it needs as parameters"
        )
        raise ModelError(
            f"{label}: numba cannot compile {what}, whose arguments are numbers and arrays of float64 "
            f"({', '.join(expected)}); {remedy}:\n{text}"
        ) from error
    if found != wanted.return_type:
        raise ModelError(f"{label}: {what} returns {found}; let it return nothing")
    return dispatcher


def _steps(label: str, given: Mapping[str, float] | None, frames: np.ndarray) -> tuple[float, ...]:
    for key, value in (given or {}).items():
        if key not in SMALLEST:
            raise ModelError(f"{label}: steps has no {key!r}; there are {', '.join(SMALLEST)}")
        if not (np.isfinite(value) and value > 0.0):
            raise ModelError(f"{label}: steps: {key} = {value}; it must be positive")
    reach = float(np.linalg.norm(frames[:, None, :3] - frames[None, :, :3], axis=2).max())
    steps = {**SMALLEST, "length": max(SMALLEST["length"], STEP * reach)} | dict(given or {})
    return tuple(float(steps[key]) for key in SMALLEST)


# Kernels of force elements given by a user's function, whose address comes first among the integers.
#
# The function has the signature `FUNCTION_SIG`; see :meth:`gearmbs.mechanism.Mechanism.force`. Without a second one for
# the derivatives these are central differences, with a small step in each spatial variation of each frame and in each
# state. Both kernels are compiled once, with the package; only the user's function is compiled when it is given.


FUNCTION_SIG = types.void(F8, MAT, VEC, VEC, MAT, VEC, VEC)
"""function(t, frames, states, parameters, wrench, rates, diagnostics)"""
DERIVATIVES_SIG = types.void(F8, MAT, VEC, VEC, MAT)
"""derivatives(t, frames, states, parameters, jac)"""

function_at = caller(FUNCTION_SIG)
derivatives_at = caller(DERIVATIVES_SIG)

STEPS = 4
"""Reals in front of the parameters: steps of length, angle, speed and angular speed."""
STATE_STEP = 1e-6
"""Step of a state, of its size."""
SMALLEST_STATE_STEP = 1e-9
"""Least step of a state that is zero, or next to it; states have no unit that would give a better one."""


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def with_derivatives(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Call the user's function and, if derivatives are wanted, the function that gives them.

    Arguments as in `gearmbs.dae.equations.loads.forces`; ``ints`` holds the addresses of both.
    """
    parameters = vector_at(reals, STEPS, reals.size - STEPS)
    function_at(ints[0])(t, frames, states, parameters, wrench, rates, diagnostics)
    if want & DERIVATIVES:
        derivatives_at(ints[1])(t, frames, states, parameters, jac)


@njit("void(float64[:, ::1], float64[:, ::1], int64, int64, float64)", cache=True, nogil=True, error_model="numpy")
def vary(frames, out, k, c, h):
    """Write the frames to ``out``, frame k moved by its spatial variation c of size h."""
    for m in range(frames.shape[0]):
        for q in range(FRAME_COLUMNS):
            out[m, q] = frames[m, q]
    if c < 3:
        out[k, FRAME_P + c] += h
    elif c < 6:
        c1, c2 = (c - 2) % 3, (c - 1) % 3
        sine, cosine = np.sin(h), np.cos(h)
        for q in range(3):
            y, z = frames[k, FRAME_A + 3 * c1 + q], frames[k, FRAME_A + 3 * c2 + q]
            out[k, FRAME_A + 3 * c1 + q] = cosine * y - sine * z
            out[k, FRAME_A + 3 * c2 + q] = sine * y + cosine * z
    else:
        # velocity and angular velocity stand behind the orientation
        out[k, c + 6] += h


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def by_differences(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Call the user's function and, if derivatives are wanted, find them by central differences.

    Arguments as in `gearmbs.dae.equations.loads.forces`; ``ints`` holds the address of the function, ``reals``
    begins with the steps.
    """
    parameters = vector_at(reals, STEPS, reals.size - STEPS)
    function_at(ints[0])(t, frames, states, parameters, wrench, rates, diagnostics)
    if not want & DERIVATIVES:
        return
    markers, wrenches = frames.shape[0], wrench.shape[0]
    at = markers * FRAME_COLUMNS
    moved = matrix_at(work, 0, markers, FRAME_COLUMNS)
    moved_states = vector_at(work, at, states.size)
    at += states.size
    told = vector_at(work, at, diagnostics.size)
    at += diagnostics.size
    loads = matrix_at(work, at, wrenches, 6)
    speeds = vector_at(work, at + 6 * wrenches, rates.size)
    for k in range(states.size):
        moved_states[k] = states[k]
    for column in range(12 * markers + states.size):
        k, c = column // 12, column % 12
        of_state = column >= 12 * markers
        z = column - 12 * markers
        h = max(STATE_STEP * abs(states[z]), SMALLEST_STATE_STEP) if of_state else reals[c // 3]
        for side in (1.0, -1.0):
            for q in range(loads.size + speeds.size + told.size):
                work[at - told.size + q] = 0.0
            if of_state:
                vary(frames, moved, 0, 0, 0.0)
                moved_states[z] = states[z] + side * h
            else:
                vary(frames, moved, k, c, side * h)
            function_at(ints[0])(t, moved, moved_states, parameters, loads, speeds, told)
            for w in range(wrenches):
                for q in range(6):
                    jac[6 * w + q, column] += side * loads[w, q] / (2.0 * h)
            for q in range(rates.size):
                jac[6 * wrenches + q, column] += side * speeds[q] / (2.0 * h)
        if of_state:
            moved_states[z] = states[z]


# Derivatives that a user writes by hand, against differences: each family once.


def check_derivatives(element: ForceElement, made: Compiled) -> None:
    """Compare the derivatives that a user has written with differences, those of a kernel or function once.

    Raises
    ------
    ModelError
        See `compare_derivatives`.
    """
    written = element.derivatives if isinstance(element, FunctionForce) else made.kernel
    if written is None or written in _TRIED or getattr(element, "law", None) is not None:
        return
    compare_derivatives(element, made)
    _TRIED.add(written)


def compare_derivatives(element: ForceElement, made: Compiled) -> None:
    """Compare an element's derivatives with one-sided differences of its wrench and rates, near the start.

    Between the two differences on either side any value is right: at a kink, or where a force jumps.

    Raises
    ------
    ModelError
        Where a derivative is outside both; the message names the element, the entry and both values.
    """
    sees = element.markers if made.sees is None else made.sees
    start = np.array([frame_of(marker) for marker in sees])
    reach = float(np.linalg.norm(start[:, None, :3] - start[None, :, :3], axis=2).max(initial=0.0)) or 0.1
    units = np.concatenate([np.tile(np.repeat((reach, 1.0, reach, 1.0), 3), len(sees))])
    rng = np.random.default_rng(0)
    for away in AWAY:
        frames = start.copy()
        for k in range(len(sees)):
            for c, move in enumerate(away * rng.normal(size=12) * units[:12]):
                moved = frames.copy()
                vary(moved, frames, k, c, move)
        frames[:, FRAME_V:] += rng.normal(size=(len(sees), 6)) * np.repeat((reach, 1.0), FRAME_W - FRAME_V)
        own = [state.start for state in element.states]
        states = np.array(own, dtype=float) + away * rng.normal(size=len(element.states))
        times = [rng.normal() if function.is_expression else function(0.0) for function in made.times]
        inputs = np.concatenate([rng.normal(size=6 * len(made.reactions)), times, np.zeros(len(made.angles))])
        _compare(element, made, [marker.name for marker in sees], frames, states, inputs, units)


def _compare(element, made: Compiled, names: list[str], frames, states, inputs, units: np.ndarray) -> None:
    """Compare all derivatives at one place."""
    free = 6 * len(made.reactions)
    columns = len(units) + len(states) + free
    units = np.concatenate([units, np.maximum(np.abs(states), 1.0), np.ones(free)])
    ints = np.array([*(address(*function) for function in made.functions), *made.integers], dtype=np.int64)
    reals = np.array(made.reals, dtype=float)
    work = np.zeros(made.scratch)

    def values(frames, states, inputs, want: int = 0) -> tuple[np.ndarray, np.ndarray]:
        wrench, rates = np.zeros((element.wrenches, 6)), np.zeros(len(states))
        jac = np.zeros((wrench.size + rates.size, columns))
        told = np.zeros(len(element.diagnostics))
        made.kernel(ints, reals, 0.0, frames, states, inputs, want, work, wrench, rates, jac, told)
        return np.concatenate([wrench.ravel(), rates]), jac

    def changed(column: int, size: float) -> np.ndarray:
        moved, own, given = frames.copy(), states.copy(), inputs.copy()
        at = column - 12 * len(frames)
        if at < 0:
            vary(frames, moved, column // 12, column % 12, size)
        elif at < len(states):
            own[at] += size
        else:
            given[at - len(states)] += size
        return values(moved, own, given)[0]

    steps = STEP * units
    try:
        force, jac = values(frames, states, inputs, DERIVATIVES)
        behind = np.array([(force - changed(c, -h)) / STEP for c, h in enumerate(steps)]).T
        ahead = np.array([(changed(c, h) - force) / STEP for c, h in enumerate(steps)]).T
    except ArithmeticError:
        # the force is not defined here
        return
    if not (np.isfinite(force).all() and np.isfinite(ahead).all() and np.isfinite(behind).all()):
        # nothing acts here that could be compared
        return
    low, high, scaled = np.minimum(behind, ahead), np.maximum(behind, ahead), jac * units
    ratio = _over_allowed(element, len(frames), force, low, high, scaled)
    row, column = np.unravel_index(int(np.argmax(np.nan_to_num(ratio, posinf=1e300))), ratio.shape)
    if not ratio[row, column] > 1.0:
        return
    raise ModelError(
        f"{element.kind} '{element.name}': jac[{row}, {column}], its derivative of {_row(element, int(row))} by "
        f"{_column(element, names, int(column))}, is {jac[row, column]:.6g}; differences of "
        f"what the kernel gives make it {0.5 * (low + high)[row, column] / units[column]:.6g}. Correct it, or give the "
        "force to Mechanism.force without derivatives, which takes differences"
    )


def _over_allowed(
    element, frames: int, force: np.ndarray, low: np.ndarray, high: np.ndarray, scaled: np.ndarray
) -> np.ndarray:
    """Return how far each derivative is from between its differences, by what rounding and curvature allow."""
    columns = scaled.shape[1]
    size = np.maximum(np.maximum(np.abs(low), np.abs(high)), np.abs(scaled))
    blocks = np.minimum(np.arange(columns) // 3, frames * 4 + np.arange(columns))
    block = np.array([size[:, blocks == b].max(axis=1) for b in blocks]).T
    allowed = OFF * block + OF_ALL * size.max(axis=1, keepdims=True) + (ROUNDED / STEP) * np.abs(force)[:, None]
    off = np.maximum(low - scaled, scaled - high)
    off[np.isnan(off)] = np.inf
    for k in range(element.wrenches):
        # what is written for a part that is no unknown is ignored
        off[6 * k : 6 * k + 3] *= element.has_force
        off[6 * k + 3 : 6 * k + 6] *= element.has_torque
    return np.divide(off, allowed, out=np.where(off > 0.0, np.inf, 0.0), where=allowed > 0.0)


def _row(element: ForceElement, row: int) -> str:
    if row >= 6 * element.wrenches:
        return f"the rate of state {row - 6 * element.wrenches}"
    return COMPONENTS[row % 6] + (f" of wrench {row // 6}" if element.wrenches > 1 else "")


def _column(element: ForceElement, names: list[str], column: int) -> str:
    at = column - 12 * len(names)
    if at < 0:
        return f"the {VARIATIONS[column % 12]} of marker '{names[column // 12]}'"
    return f"state {at}" if at < len(element.states) else f"input {at - len(element.states)}"
