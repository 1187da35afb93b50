"""Force laws of one's own, written as a formula: derivatives, parameters and the energy balance follow.

A law is called once, with numbers that write down what is done to them (`gearmbs.kernels.derive`), and three kernels
are made of the graph: wrench, rates and diagnostics; their derivatives by the variations of the frames and by the
states; those by the parameters.
"""

from __future__ import annotations

import ast
import inspect
import itertools
import linecache
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gearmbs.dae.equations.loads.forces import Diagnostic
from gearmbs.dae.equations.loads.traced import Frame
from gearmbs.dae.problem import ModelError
from gearmbs.kernels import PLAIN, derive
from gearmbs.kernels.derive import ONE, ZERO, Function, Value, derivative, inputs, product, tangent
from gearmbs.kernels.jit import compilation_error
from gearmbs.mechanism.parts.constraint_laws import tracing

_numbers = itertools.count()
AWAY = (1e-3, 1e-2, 0.1, 1.0)
"""Distances, of that between the markers or of 1 m where there is none, and angles, by which a pose is moved."""
ALIKE = 1e-6
"""Part of its slopes by which an energy may change with a motion of both markers: far above rounding."""
LAW_DIAGNOSTICS = (Diagnostic("energy", "J", "stored"), Diagnostic("loss", "W", "dissipated"))


@dataclass(frozen=True)
class Wrench:
    """What a law says: force and torque on the first marker's body, N and N m, global components.

    Attributes
    ----------
    force, torque : sequence of 3 numbers, optional
        Default, of each for itself: what the energy asks for, -dV/dP and -dV/dpi of the first marker. What is given is
        the whole, with the part of the energy.
    energy : number
        What is stored, J, by places, states and time, not by velocities. Between two bodies it is a function of how
        they stand to each other, as in the axes of the second marker; against the ground any.
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
        Numbers from outside it are those of the moment at which the force is added to a mechanism.

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
    label: str, law: ForceLaw, markers: int, parameters: Any, states: Sequence[str], algebraic: int = 0,
    start: np.ndarray | None = None,
) -> Derived:  # fmt: skip
    """Return the kernels of a law; elements of it share those that have the same texts.

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
    start : ndarray, shape (2, 18), optional
        Frames about which the energy has to stay as it is if both markers move alike.

    Raises
    ------
    ModelError
        If the law cannot be traced, or what it takes and gives does not fit.
    """
    numbers = _parameters_of(label, law, markers, parameters, states)
    for state in states:
        if state == "t" or not state.isidentifier():
            raise ModelError(
                f"{label}: a law takes its states by name, and '{state}' is "
                f"{'the time' if state == 't' else 'none of Python'}; give the state another name"
            )
    with tracing:
        derive.start()
        try:
            texts = _traced(label, law, markers, list(numbers), list(states), algebraic, start, numbers)
        except RecursionError:
            raise ModelError(
                f"{label}: the law '{law.__name__}' has too many operations in a row, some hundred terms of a sum; "
                "add them up in parts, or give a kernel instead"
            ) from None
        # what it reads from outside may be other numbers by now
        if texts not in law._made:
            law._made[texts] = derived_of(law.__name__, texts, {})
        return replace(law._made[texts], parameters=numbers)


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


def _traced(
    label: str, law: ForceLaw, markers: int, numbers: list[str], states: list[str], algebraic: int,
    start: np.ndarray | None, at: Mapping[str, Any],
) -> tuple[str, ...]:  # fmt: skip
    frames = [Frame("frames", f"m{k}", f"{k}, ") for k in range(markers)]
    seen = [Seen(np.array(f.origin), np.array(f.axes).T, np.array(f.v), np.array(f.w)) for f in frames]
    # under names of their own: the kernels' arguments have some, too
    own = dict(zip(states, inputs(" ".join(f"z_{name}" for name in states), "states")))
    values = dict(zip(numbers, inputs(" ".join(f"p_{name}" for name in numbers), "parameters")))
    (t,) = inputs("t")
    by_name = {**own, **values, "t": t}
    taken = list(inspect.signature(law.function).parameters)[markers:]
    try:
        with derive.watched():
            load = law.function(*seen, **{name: by_name[name] for name in taken})
    except RecursionError:
        raise
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
    (energy,) = _numbers_of(label, "energy", [load.energy])
    _check_energy(label, energy, frames, list(own.values())[len(own) - algebraic :])
    if start is not None:
        _try_energy(label, energy, frames, start, len(own), list(at.values()))
    wrench = _wrench(label, load, energy, frames)
    rates = [_numbers_of(label, f"rate of '{name}'", [load.rates[name]])[0] for name in states]
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
    return tuple(one.undecorated() for one in made)


def _numbers_of(label: str, what: str, given: Any) -> list[Value]:
    """Return numbers that a law gives."""
    found = []
    for one in given:
        try:
            found.append(derive.value_of(one.item() if isinstance(one, np.ndarray) else one))
        except (TypeError, ValueError) as error:
            shown = f"an array of shape {one.shape}" if isinstance(one, np.ndarray) else f"{one!r}, {error}"
            raise ModelError(f"{label}: {what} of the law is {shown}; give a number") from None
    return found


def _three(label: str, what: str, given: Any) -> list[Value]:
    try:
        shape = np.shape(np.asarray(given, dtype=object))
    except ValueError:
        shape = ()
    if shape != (3,):
        raise ModelError(f"{label}: {what} of the law has the shape {shape}; give three components")
    return _numbers_of(label, what, given)


def _check_energy(label: str, energy: Value, frames: list[Frame], algebraic: list[Value]) -> None:
    """Refuse energies whose rate is not that of the places, the differential states and the time."""
    if any(derivative(energy, one) is not ZERO for one in algebraic):
        raise ModelError(f"{label}: the energy of the law depends on an algebraic state; write it without")
    if any(derivative(energy, one) is not ZERO for frame in frames for one in frame.variations[6:]):
        raise ModelError(
            f"{label}: the energy of the law depends on velocities, by which it gives no force; leave that part out, "
            "and give masses and inertias to bodies"
        )


def _try_energy(
    label: str, energy: Value, frames: list[Frame], start: np.ndarray, states: int, given: list[Any]
) -> None:
    """Refuse an energy that changes if both markers move alike: its force would not be that of both bodies."""
    from scipy.spatial.transform import Rotation

    by = [derivative(energy, one) for frame in frames for one in frame.variations[:6]]
    try:
        numbers = np.array(given, dtype=float)
    except (TypeError, ValueError):
        # refused with the parameters
        return
    if all(one is ZERO for one in by):
        return
    rng, picked = np.random.default_rng(0), dict[str, bool]()
    space: dict[str, Any] = {"np": np, "pick": lambda test: picked.setdefault(test, rng.random() > 0.5)}
    tree = ast.parse(Function("slopes", "t, frames, states, parameters", "Of it.", returns=by).undecorated())
    exec(compile(tree, "<energy>", "exec"), space)
    as_chosen = space["slopes"]
    # what is chosen far from the start alone is tried as well
    for node in ast.walk(tree):
        if isinstance(node, ast.IfExp):
            node.test = ast.parse(f"pick({ast.unparse(node.test)!r})", mode="eval").body
    exec(compile(tree, "<energy>", "exec"), space)
    reach = np.linalg.norm(start[0, :3] - start[1, :3]) or AWAY[-1]
    for away, of in itertools.product((0.0, *AWAY), (as_chosen, space["slopes"])):
        picked.clear()
        pose = start.copy()
        for frame in pose:
            turn = Rotation.from_rotvec(away * rng.normal(size=3)).as_matrix()
            frame[:3] += away * reach * rng.normal(size=3)
            frame[3:12] = (turn @ frame[3:12].reshape(3, 3)).ravel()
        with np.errstate(all="ignore"):
            try:
                found = of(np.float64(0.0), pose, rng.normal(size=states), numbers)
            except ZeroDivisionError:
                continue
        slopes = np.array(found, dtype=float).reshape(2, 2, 3)
        arm = pose[1, :3] - pose[0, :3]
        shift, turned = slopes[:, 0].sum(axis=0), slopes[:, 1].sum(axis=0) + np.cross(arm, slopes[1, 0])
        force = np.abs(slopes[:, 0]).max()
        torque = max(np.abs(slopes[:, 1]).max(), np.abs(arm).max() * force)
        for what, change, size in (("shifted", shift, force), ("turned", turned, torque)):
            if np.abs(change).max() > ALIKE * size:
                raise ModelError(
                    f"{label}: the energy of the law changes if both markers are {what} alike, so that its force is "
                    "not that of both bodies; write it in the axes of j, as (i.origin - j.origin) @ j.axes, or let "
                    "j be a marker of the ground"
                )


def _wrench(label: str, load: Wrench, energy: Value, frames: list[Frame]) -> list[Value]:
    """Return F and N on the first marker's body: each as given, or as the energy falls."""
    if load.force is None and load.torque is None and energy.operation == "number":
        raise ModelError(f"{label}: the law gives neither force nor torque nor energy; give one of them")
    falls = [-derivative(energy, by) for by in frames[0].variations[:6]]
    force = falls[:3] if load.force is None else _three(label, "force", load.force)
    return [*force, *(falls[3:] if load.torque is None else _three(label, "torque", load.torque))]


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


class _Literals(ast.NodeTransformer):
    """Floats of a text become numbers of numpy."""

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        return ast.Call(ast.Name("f8", ast.Load()), [node], []) if isinstance(node.value, float) else node


def derived_of(name: str, texts: tuple[str, ...], parameters: Mapping[str, float]) -> Derived:
    """Return the kernels of a law from their texts, which are found by the names of their files."""
    space: dict[str, Any] = {"np": np}
    for text in texts:
        file = f"<law {name} {next(_numbers)}>"
        linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
        exec(compile(text, file, "exec"), space)
    # the one that nobody compiles: literals divide as numbers of arrays do
    tree, space["f8"] = _Literals().visit(ast.parse(texts[2])), np.float64
    exec(compile(ast.fix_missing_locations(tree), "<law>", "exec"), space)
    return Derived(space["values"], space["derivatives"], space["by_parameters"], parameters, name, texts)


def refusals() -> tuple[type[Exception], ...]:
    """Return what is raised of a function that cannot be compiled."""
    import numba

    # of a statement that numba does not know, as an import: none of its other errors
    return compilation_error(), numba.UnsupportedBytecodeError, KeyError, TypeError, RuntimeError


def straightened(function: Callable) -> Callable:
    """Return a kernel in the form that compiles in the least time."""
    if PLAIN:
        return function
    from gearmbs.kernels.own.straight import straight

    return straight(function)
