"""Force laws of one's own, written as a formula: derivatives, parameters and the energy balance follow.

A law is called once, with numbers that write down what is done to them (`gearmbs.kernels.derive`), and three kernels
are made of the graph: wrench, rates and diagnostics; their derivatives by the variations of the frames and by the
states; those by the parameters.
"""

from __future__ import annotations

import inspect
import itertools
import linecache
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gearmbs.dae.equations.loads.forces import Diagnostic
from gearmbs.dae.problem import ModelError
from gearmbs.kernels import PLAIN, derive
from gearmbs.kernels.derive import ONE, ZERO, Function, Value, derivative, inputs, product, tangent
from gearmbs.mechanism.forces.definitions import Frame

_tracing = threading.Lock()
_numbers = itertools.count()
LAW_DIAGNOSTICS = (Diagnostic("energy", "J", "stored"), Diagnostic("loss", "W", "dissipated"))


@dataclass(frozen=True)
class Wrench:
    """What a law says: force and torque on the first marker's body, N and N m, global components.

    Attributes
    ----------
    force, torque : sequence of 3 numbers, optional
        Default: what the energy asks for, or nothing.
    energy : number
        What is stored, J. Of a law that gives neither force nor torque, both follow from it.
    rates : mapping
        Of the states by name: the derivatives of differential ones, the values of algebraic ones.
    """

    force: Sequence[Any] | None = None
    torque: Sequence[Any] | None = None
    energy: Any = 0.0
    rates: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Seen:
    """A marker as a law sees it, global components.

    Attributes
    ----------
    origin, velocity, angular_velocity : ndarray, shape (3,)
        m, m/s, rad/s.
    axes : ndarray, shape (3, 3)
        Columns are its axes.
    """

    origin: np.ndarray
    axes: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray


@dataclass(frozen=True, eq=False)
class ForceLaw:
    """A law of a force, see `force_law`; it may be called with numbers as well.

    Attributes
    ----------
    function : callable
    """

    function: Callable[..., Wrench]
    _made: dict = field(default_factory=dict, repr=False)

    def __call__(self, *args: Any, **keywords: Any) -> Wrench:
        """Evaluate it."""
        return self.function(*args, **keywords)

    @property
    def __name__(self) -> str:
        return self.function.__name__


def force_law(function: Callable[..., Wrench]) -> ForceLaw:
    """Make a force law of a function, for :meth:`gearmbs.mechanism.Mechanism.force`.

    Parameters
    ----------
    function : callable
        ``function(i, j, ...)`` takes the markers that it acts between, or one of them, which is pushed from the ground;
        then by name ``t``, its states and its parameters, defaults allowed. Markers have ``origin``, ``axes``,
        ``velocity`` and ``angular_velocity``. It returns a :class:`Wrench`. It is written with arithmetic, powers,
        products of arrays, functions of numpy (roots, exponential, trigonometric and hyperbolic ones and their
        inverses, ``maximum``, ``minimum``, ``abs``, ``hypot``, ``cross``, ``linalg.norm``) and `choose` for branches.

    Returns
    -------
    ForceLaw

    Notes
    -----
    Derivatives by all that it depends on are exact. Where it gives an energy, what is lost follows: the power that is
    put in, less the rate of the energy.

    Examples
    --------
    >>> import numpy as np
    >>> import gearmbs as gm
    >>> @gm.force_law
    ... def magnet(i, j, strength):
    ...     apart = i.origin - j.origin
    ...     return gm.Wrench(energy=-strength / np.sqrt(apart @ apart))
    >>> m = gm.Mechanism("magnets")
    >>> ball = m.body("ball", mass=0.1, inertia=(1e-5, 1e-5, 1e-5), position=(0.1, 0, 0))
    >>> m.force("magnet", magnet, ball.marker(), m.ground.marker(), parameters={"strength": 4e-3})
    FunctionForce('magnet' on 'ball.marker1', 'ground.marker1')
    """
    return ForceLaw(function)


@dataclass(frozen=True)
class Derived:
    """Kernels of a law: plain functions of Python, compiled by whoever takes them.

    Attributes
    ----------
    values, derivatives, by_parameters : function
        ``values(t, frames, states, parameters, wrench, rates, diagnostics)``, the others with one matrix: rows
        are the wrench and the rates, columns variations and states, or parameters.
    parameters : mapping of str to float
        In the order of the columns.
    name, texts : str, tuple of str
        Of the law, and of the three functions.
    """

    values: Callable
    derivatives: Callable
    by_parameters: Callable
    parameters: Mapping[str, float]
    name: str
    texts: tuple[str, ...] = field(repr=False)
    _compiled: list = field(default_factory=list, repr=False)

    def __reduce__(self) -> tuple:
        # functions that were made by a program travel as their texts
        return derived_of, (self.name, self.texts, dict(self.parameters))

    def __deepcopy__(self, memo: dict) -> Derived:
        return self

    def compiled(self, compiler: Callable[[str, Callable, Callable], tuple[Any, Any]]) -> tuple[Any, Any]:
        """Return values and derivatives as a compiler makes them, once for all elements of a law."""
        if not self._compiled:
            self._compiled.extend(compiler("force law", straightened(self.values), straightened(self.derivatives)))
        return self._compiled[0], self._compiled[1]


def derive_law(
    label: str, law: ForceLaw, markers: int, parameters: Any, states: Sequence[str], algebraic: int = 0
) -> Derived:
    """Return the kernels of a law, which are made once for all elements of it.

    Parameters
    ----------
    label : str
        What messages call it.
    law : ForceLaw
    markers : int
    parameters : mapping of str to float
    states : sequence of str
        Names without the element's.
    algebraic : int
        How many of them, the last, are algebraic.

    Raises
    ------
    ModelError
        If the law cannot be traced, or what it takes and gives does not fit.
    """
    numbers = _parameters_of(label, law, markers, parameters, states)
    key = (markers, tuple(numbers), tuple(states), algebraic)
    with _tracing:
        if key not in law._made:
            derive.start()
            law._made[key] = _traced(label, law, markers, list(numbers), list(states), algebraic)
        return replace(law._made[key], parameters=numbers)


def _parameters_of(label: str, law: ForceLaw, markers: int, given: Any, states: Sequence[str]) -> dict[str, float]:
    if markers > 2:
        raise ModelError(f"{label}: a law acts on one marker or between two, not {markers}; give a kernel instead")
    if not isinstance(given, Mapping):
        if len(given):
            raise ModelError(f"{label}: parameters = {given!r}; a law takes them by name, give a mapping")
        given = {}
    taken = list(inspect.signature(law.function).parameters.values())[markers:]
    named = [one for one in taken if one.name != "t" and one.name not in states]
    names = [one.name for one in named]
    unknown, lacking = (
        [name for name in given if name not in names],
        [one.name for one in named if one.name not in given and one.default is inspect.Parameter.empty],
    )
    if unknown:
        raise ModelError(f"{label}: the law has no parameter '{unknown[0]}'; it has {', '.join(names) or 'none'}")
    if lacking:
        raise ModelError(
            f"{label}: parameter '{lacking[0]}' of the law is missing; give parameters={{'{lacking[0]}': ...}}"
        )
    return {one.name: given.get(one.name, one.default) for one in named}


def _traced(label: str, law: ForceLaw, markers: int, numbers: list[str], states: list[str], algebraic: int) -> Derived:
    frames = [Frame("frames", f"m{k}", f"{k}, ") for k in range(markers)]
    seen = [Seen(np.array(f.origin), np.array(f.axes).T, np.array(f.v), np.array(f.w)) for f in frames]
    # under names of their own: the kernels' arguments have some, too
    own = dict(zip(states, inputs(" ".join(f"z_{name}" for name in states), "states")))
    values = dict(zip(numbers, inputs(" ".join(f"p_{name}" for name in numbers), "parameters")))
    (t,) = inputs("t")
    by_name = {**own, **values, "t": t}
    taken = list(inspect.signature(law.function).parameters)[markers:]
    try:
        load = law.function(*seen, **{name: by_name[name] for name in taken})
    except Exception as error:
        raise ModelError(
            f"{label}: the law '{law.__name__}' cannot be traced, {type(error).__name__}: {error}; write it with "
            "arithmetic, functions of numpy and gm.choose"
        ) from error
    if not isinstance(load, Wrench):
        raise ModelError(f"{label}: the law '{law.__name__}' returns {type(load).__name__}; let it return a gm.Wrench")
    if set(load.rates) != set(states):
        raise ModelError(
            f"{label}: the law gives rates of {sorted(load.rates)}, its states are {sorted(states)}; give both alike"
        )
    energy = derive.value_of(load.energy)
    if any(derivative(energy, one) is not ZERO for one in list(own.values())[len(own) - algebraic :]):
        raise ModelError(f"{label}: the energy of the law depends on an algebraic state; write it without")
    wrench = _wrench(label, load, energy, frames)
    rates = [derive.value_of(load.rates[name]) for name in states]
    differential = dict(list(zip(own.values(), rates))[: len(own) - algebraic])
    variations = [v for f in frames for v in f.variations]
    rows = [*wrench, *rates]
    head = "t, frames, states, parameters"
    written = {f"wrench[0, {k}]": x for k, x in enumerate(wrench)} | {f"rates[{k}]": x for k, x in enumerate(rates)}
    written |= {"diagnostics[0]": energy, "diagnostics[1]": _loss(wrench, energy, frames, {t: ONE, **differential})}
    made = [
        Function("values", f"{head}, wrench, rates, diagnostics", f"Write {law.__name__}.", sets=written),
        Function("derivatives", f"{head}, jac", "Write its derivatives.",
                 sets=_matrix("jac", rows, [*variations, *own.values()])),
        Function("by_parameters", f"{head}, out", "Write its derivatives by the parameters.",
                 sets=_matrix("out", rows, list(values.values()))),
    ]  # fmt: skip
    return derived_of(law.__name__, tuple(one.undecorated() for one in made), {})


def _wrench(label: str, load: Wrench, energy: Value, frames: list[Frame]) -> list[Value]:
    """Return F and N on the first marker's body, as given, or as the energy falls."""
    if load.force is None and load.torque is None:
        if energy.operation == "number":
            raise ModelError(f"{label}: the law gives neither force nor torque nor energy; give one of them")
        return [-derivative(energy, by) for by in frames[0].variations[:6]]
    nothing = [0.0] * 3
    wrench = [*(nothing if load.force is None else load.force), *(nothing if load.torque is None else load.torque)]
    if len(wrench) != 6:
        raise ModelError(f"{label}: force and torque have {len(wrench)} components together; give three of each")
    return [derive.value_of(x) for x in wrench]


def _loss(wrench: list[Value], energy: Value, frames: list[Frame], moved: dict[Value, Value]) -> Value:
    """Return the power that the element takes from its bodies, less the rate of its energy.

    The reaction acts on the second body at the same point, so that F does work on the velocity seen from it.
    """
    first = frames[0]
    v, w = list(first.v), list(first.w)
    for frame in frames:
        moved |= dict(zip(frame.variations[:6], [*frame.v, *frame.w]))
    if len(frames) == 2:
        d, u, spin = first.minus(frames[1])
        other = frames[1].w
        v = [u[c] - (other[c - 2] * d[c - 1] - other[c - 1] * d[c - 2]) for c in range(3)]
        w = list(spin)
    return -product(wrench, [*v, *w]) - tangent(energy, moved)


def _matrix(array: str, rows: Sequence[Value], by: Sequence[Value]) -> dict[str, Value]:
    slopes = {f"{array}[{r}, {q}]": derivative(row, x) for r, row in enumerate(rows) for q, x in enumerate(by)}
    return {place: slope for place, slope in slopes.items() if slope is not ZERO}


def derived_of(name: str, texts: tuple[str, ...], parameters: Mapping[str, float]) -> Derived:
    """Return the kernels of a law from their texts, which are found by the names of their files."""
    space: dict[str, Any] = {"np": np}
    for text in texts:
        file = f"<law {name} {next(_numbers)}>"
        linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
        exec(compile(text, file, "exec"), space)
    return Derived(space["values"], space["derivatives"], space["by_parameters"], parameters, name, texts)


def straightened(function: Callable) -> Callable:
    """Return a kernel in the form that compiles in the least time."""
    if PLAIN:
        return function
    from gearmbs.kernels.straight import straight

    return straight(function)
