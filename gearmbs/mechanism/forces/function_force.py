"""Force elements given by a function of one's own, numba's or plain Python."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba.core.errors import NumbaError

from gearmbs._jit import njit
from gearmbs.dae.equations.force_elements import FRAME_COLUMNS, ROLES, Diagnostic
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.elements import Compiled, ForceElement, State
from gearmbs.mechanism.parts import Marker

ARGUMENTS = ("t", "frames", "states", "parameters", "wrench", "rates", "diagnostics")
DERIVATIVE_ARGUMENTS = ("t", "frames", "states", "parameters", "jac")

KEPT_OPTIONS = ("fastmath", "inline", "boundscheck")
"""Options of ``numba.njit`` with which a function that has been compiled already is compiled again."""

STEP = 1e-6
"""Steps of differences, of the distances between the markers and of speeds; in rad."""
SMALLEST = {"length": 1e-7, "angle": 1e-6, "speed": 1e-7, "angular_speed": 1e-7}
"""m, rad, m/s and rad/s."""


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
    """

    all_markers: tuple[Marker, ...]
    function: Any
    derivatives: Any
    parameters: np.ndarray
    steps: tuple[float, ...]
    own_states: tuple[State, ...] = ()
    told: tuple[Diagnostic, ...] = field(default=())

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
        from gearmbs.mechanism.forces import function_kernel as kernels

        functions = [(self.function, kernels.FUNCTION_SIG)]
        if self.derivatives is not None:
            functions.append((self.derivatives, kernels.DERIVATIVES_SIG))
        n, w = len(self.markers), self.wrenches
        return Compiled(
            kernels.by_differences if self.derivatives is None else kernels.with_derivatives,
            reals=np.concatenate([self.steps, self.parameters]),
            functions=tuple(functions),
            scratch=FRAME_COLUMNS * n + 2 * len(self.own_states) + len(self.told) + 6 * w,
        )

    def __repr__(self) -> str:
        on = ", ".join(repr(m.name) for m in self.markers)
        return f"FunctionForce({self.name!r} on {on})"


def function_force(
    name: str,
    kernel: Callable[..., None],
    markers: Sequence[Marker],
    parameters: Any,
    states: Any,
    algebraic: Any,
    diagnostics: Sequence[Any],
    derivatives: Callable[..., None] | None,
    steps: Mapping[str, float] | None,
) -> FunctionForce:
    """Return a checked force; the arguments are those of :meth:`gearmbs.mechanism.Mechanism.force`."""
    from gearmbs.mechanism.forces.function_kernel import DERIVATIVES_SIG, FUNCTION_SIG

    label = f"force '{name}'"
    numbers = _parameters(label, parameters)
    own = [*_states(label, name, states, False), *_states(label, name, algebraic, True)]
    told = tuple(_diagnostic(label, d) for d in diagnostics)
    for title, given in (("state", [s.name for s in own]), ("diagnostic", [d.name for d in told])):
        for key in given:
            if given.count(key) > 1:
                raise ModelError(
                    f"{label}: {title} '{key.removeprefix(f'{name}.')}' is given twice; choose another name"
                )
    frames = np.array([_frame(marker) for marker in markers])
    _try(label, kernel, derivatives, frames, numbers, own, told)
    return FunctionForce(
        name,
        markers[0],
        markers[1] if len(markers) > 1 else markers[0],
        tuple(markers),
        _compiled(label, "kernel", kernel, FUNCTION_SIG, ARGUMENTS),
        None
        if derivatives is None
        else _compiled(label, "derivatives", derivatives, DERIVATIVES_SIG, DERIVATIVE_ARGUMENTS),
        numbers,
        _steps(label, steps, frames),
        tuple(own),
        told,
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


def _frame(marker: Marker) -> np.ndarray:
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
    dispatcher: Any = njit(error_model="numpy", nogil=True, **options)(python)
    try:
        dispatcher.compile(signature.args)
        found = dispatcher.overloads[signature.args].signature.return_type
    except (NumbaError, KeyError, TypeError, RuntimeError) as error:
        lines = [line for line in str(error).splitlines() if line.strip()]
        text = "\n".join(lines[:8])
        raise ModelError(
            f"{label}: numba cannot compile {what}, whose arguments are numbers and arrays of float64 "
            f"({', '.join(expected)}); hand over what else it needs as parameters:\n{text}"
        ) from error
    if found != signature.return_type:
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
