"""Force elements of a mechanism."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from gearmbs.dae.equations.loads.forces import DERIVATIVES, FORCE_SIG, FRAME_A, FRAME_COLUMNS, Diagnostic
from gearmbs.dae.problem import ANY, ModelError
from gearmbs.dae.problem import NOT_NEGATIVE as NOT_NEGATIVE
from gearmbs.dae.problem import POSITIVE as POSITIVE
from gearmbs.dae.problem import Allowed as Allowed
from gearmbs.kernels.jit import njit
from gearmbs.mechanism.parts.bodies import Marker, OwnAttributes
from gearmbs.mechanism.parts.functions import TimeFunction, as_function

if TYPE_CHECKING:
    from gearmbs.mechanism.language.syntax import Units


class Setting(NamedTuple):
    """A number x of an element that can be changed, where ``offset + factor x`` stands among the reals."""

    at: int
    unit: str
    factor: float = 1.0
    offset: float = 0.0
    others: tuple[tuple[int, float, float], ...] = ()
    """Further places, factors and offsets."""
    allowed: Allowed = ANY
    """What the element could be made with."""


@dataclass(frozen=True)
class Compiled:
    """What a force element hands to the equations, see `gearmbs.dae.equations.loads.forces`.

    Attributes
    ----------
    kernel : compiled function
        With the signature ``FORCE_SIG``.
    integers, reals : sequence
        The element's own tables, SI.
    functions : tuple of (compiled function, signature)
        Their addresses go before the integers.
    sees : tuple of Marker, optional
        Markers whose frames the kernel is given; default: those on which the element acts.
    reactions : tuple of str
        Names of joints whose reactions, F and N on I's body at marker I, are inputs: six each, before ``times``.
    times : tuple of TimeFunction
        Functions of time whose values are inputs.
    angles : tuple of (int, Marker, Marker)
        Counted angles AX, AY, AZ (0, 1, 2) of one marker about another, whose references are the last inputs.
    scratch : int
    settings : mapping of str to Setting
        Numbers among ``reals`` that can be changed while a simulation goes on, by the name of what they are.
    given : mapping of str to int
        Which of ``times`` can be changed so, N m; of a STEP what it ends at.
    changed : compiled function, optional
        With the signature ``CHANGED_SIG``: derivatives along a change of the reals.
    lean : callable, optional
        Offers a leaner kernel for bodies that turn about fixed axes; see
        `gearmbs.dae.model.builder.TableBuilder.add_element`.
    """

    kernel: Any
    integers: Sequence[int] | np.ndarray = ()
    reals: Sequence[float] | np.ndarray = ()
    functions: tuple[tuple[Any, Any], ...] = ()
    sees: tuple[Marker, ...] | None = None
    reactions: tuple[str, ...] = ()
    times: tuple[TimeFunction, ...] = ()
    angles: tuple[tuple[int, Marker, Marker], ...] = ()
    scratch: int = 0
    settings: Mapping[str, Setting] = field(default_factory=dict)
    given: Mapping[str, int] = field(default_factory=dict)
    changed: Any = None
    lean: Callable[[np.ndarray, np.ndarray], tuple[Any, np.ndarray] | None] | None = None


@dataclass(frozen=True)
class StartOverlap:
    """A force element whose parts stand deep in each other at the start.

    Attributes
    ----------
    text : str
        What stands where and how deep.
    remedy : str
    wrench : ndarray, shape (6,)
        Force, N, and torque about I's origin, N m, on I's body, global components; J's body takes the reaction.
    """

    text: str
    remedy: str
    wrench: np.ndarray


@dataclass(eq=False)
class ForceElement(OwnAttributes):
    """A force element with a kernel of its own. A subclass says how it is compiled.

    Attributes
    ----------
    name : str
    i : Marker
        Marker on whose body F and N act.
    j : Marker
        Marker whose body takes the reaction; see `markers` for elements with fewer or more.
    """

    name: str
    i: Marker
    j: Marker

    settled: ClassVar[tuple[str, ...]] = ("name", "i", "j")
    kind: ClassVar[str] = "force"
    """The element's name in messages and in the function language."""
    diagnostics: ClassVar[tuple[Diagnostic, ...]] = ()
    has_force: ClassVar[bool] = True
    """Whether F is an unknown."""
    has_torque: ClassVar[bool] = True
    """Whether N is an unknown."""
    instead: ClassVar[str] = "describe it by expressions (Mechanism.load) or take it out of the mechanism first"
    """What to take where a deck is written, which has no form for a compiled function."""

    @property
    def markers(self) -> tuple[Marker, ...]:
        """Markers on which the element acts; the ground takes the reaction of a single one."""
        return (self.i, self.j)

    @property
    def periods(self) -> tuple[int, int]:
        """How often it repeats itself in a turn of I's and of J's body, as teeth in mesh do; 0: not."""
        return (0, 0)

    @property
    def wrenches(self) -> int:
        """How many wrenches it has: one a marker if there are more than two markers, else one."""
        return len(self.markers) if len(self.markers) > 2 else 1

    @property
    def states(self) -> tuple[State, ...]:
        """The element's own states."""
        return ()

    def start_overlap(self) -> StartOverlap | None:
        """Return how parts stand in each other at the start, if that is deeper than a small share of their size."""
        return None

    def by_expressions(self, units: Units) -> tuple[Load, dict[str, tuple[str, float]]] | None:
        """Return the same in the function language, for a deck; None where it has no form there.

        Parameters
        ----------
        units : Units
            Of the mechanism, in which the texts are.

        Returns
        -------
        load : Load
        states : dict
            Rate and start of each of its states, by name.
        """
        return None

    @abstractmethod
    def compiled(self) -> Compiled:
        """Return what is handed to the equations; kernels are imported here."""

    def by_parameter(
        self, name: str, frames: np.ndarray, states: np.ndarray | None = None, inputs: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the exact derivatives of its wrench and rates by one of its numbers.

        Parameters
        ----------
        name : str
            One that can be changed while a simulation goes on, such as ``"stiffness"``.
        frames : ndarray, shape (markers, 18)
            Of the markers that it sees, as kernels do: origin, orientation by rows, velocity, angular velocity.
        states, inputs : ndarray, optional
            Its own states; reactions that it sees, references of the angles that it counts. Default: zeros.

        Returns
        -------
        ndarray, shape (6 wrenches + states,)
            By the number in SI, global components.

        Raises
        ------
        ModelError
            For a name that it does not have, elements whose derivatives by their numbers are not known, and arrays of
            another shape.
        """
        made = self.compiled()
        if made.changed is None:
            raise ModelError(
                f"{self.kind} '{self.name}': its derivatives by parameters are not known; take differences of two "
                "elements"
            )
        reals, changed = np.array(made.reals, dtype=float), self._reals_by(name, made)
        counts = (len(self.states), 6 * len(made.reactions) + len(made.times) + len(made.angles))
        own, seen = (
            np.zeros(n) if x is None else np.ascontiguousarray(x, dtype=float) for x, n in zip((states, inputs), counts)
        )
        frames = np.ascontiguousarray(frames, dtype=float)
        shapes = (frames.shape, own.shape, seen.shape)
        wanted = ((len(made.sees or self.markers), FRAME_COLUMNS), *((n,) for n in counts))
        if shapes != wanted:
            raise ModelError(
                f"{self.kind} '{self.name}': frames, states and inputs of the shapes {shapes}; give {wanted}"
            )
        out = np.zeros(6 * self.wrenches + len(own))
        integers = np.array(made.integers, dtype=np.int64)
        made.changed(integers, reals, changed, frames, own, seen, np.zeros(made.scratch), out)
        return out

    def _reals_by(self, name: str, made: Compiled) -> np.ndarray:
        """Return how the reals change with one of its numbers."""
        setting = made.settings.get(name)
        if setting is None:
            there = ", ".join(made.settings) or "none"
            raise ModelError(
                f"{self.kind} '{self.name}': it has no number '{name}' to be differentiated by; there are {there}"
            )
        changed = np.zeros(len(made.reals))
        for at, factor, _ in ((setting.at, setting.factor, 0.0), *setting.others):
            changed[at] = factor
        return changed


@dataclass(eq=False, repr=False)
class Torque(ForceElement):
    """Torque f(t) about the z axis of marker ``axis`` on I's body, its reaction on J's body."""

    axis: Marker
    function: TimeFunction

    reads: ClassVar = {"function": lambda value, field: as_function(value, "torque", field)}
    settled = (*ForceElement.settled, "axis")
    kind = "torque"
    has_force = False

    def compiled(self) -> Compiled:

        return Compiled(axis_torque, sees=(self.axis,), times=(self.function,), given={"torque": 0})

    def __repr__(self) -> str:
        return f"Torque({self.name!r}, {self.function} N m on {self.i.body.name!r} about z of {self.axis.name!r})"


LINE, AXIS_FORCE, AXIS_TORQUE, COMPONENTS = 0, 1, 2, 3


@dataclass(eq=False)
class Load(OwnAttributes):
    """Force and torque given by expressions in the ADAMS function language.

    Attributes
    ----------
    name, kind : str
        The kind is the element's name in the language ("sforce", "gforce", "bushing", ...), for functions that
        ask for its force.
    i, j, rm : Marker
        I feels the load at its origin, J the reaction at the same point; RM gives the directions.
    mode : int
        LINE (along the line from J to I), AXIS_FORCE or AXIS_TORQUE (along z of RM), COMPONENTS (in RM's frame).
    expressions : tuple of str or None
        One expression, or for COMPONENTS six: fx, fy, fz, tx, ty, tz.
    parameters : mapping, optional
        What the expressions were made from, by the names of the method that adds the element and in the mechanism's
        units; for writing the element as what it is.
    """

    name: str
    kind: str
    i: Marker
    j: Marker
    rm: Marker
    mode: int
    expressions: tuple[str | None, ...]
    parameters: Mapping[str, Any] | None = None

    settled = ("name", "kind", "i", "j", "rm", "mode", "expressions", "parameters")
    wrenches: ClassVar[int] = 1

    @property
    def markers(self) -> tuple[Marker, ...]:
        """Markers on which it acts."""
        return (self.i, self.j)

    @property
    def has_force(self) -> bool:
        """Whether F is an unknown."""
        return self.mode in (LINE, AXIS_FORCE) or (self.mode == COMPONENTS and any(self.expressions[:3]))

    @property
    def has_torque(self) -> bool:
        """Whether N is an unknown."""
        return self.mode == AXIS_TORQUE or (self.mode == COMPONENTS and any(self.expressions[3:]))

    def __repr__(self) -> str:
        shown = ", ".join(e for e in self.expressions if e)
        return f"Load({self.name!r}, {self.kind}, I={self.i.name!r}, J={self.j.name!r}, {shown})"


@dataclass(eq=False)
class State(OwnAttributes):
    """A state: z' = expression from ``start``, or z = expression when it is algebraic.

    That of a force element has no expression: its kernel knows it. An ``implicit`` algebraic one stands in its own
    expression; its error is controlled.
    """

    name: str
    expression: str = ""
    start: float = 0.0
    algebraic: bool = False
    implicit: bool = False

    settled = ("name",)


# Kernel of a single torque: a function of time about an axis.


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def axis_torque(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write N = f(t) z, z the axis of the only frame and f the only input; see `gearmbs.dae.equations.loads.forces`.

    d(f z) = dpi x f z.
    """
    for c in range(3):
        wrench[0, 3 + c] = inputs[0] * frames[0, FRAME_A + 3 * c + 2]
    if want & DERIVATIVES:
        x, y, z = wrench[0, 3], wrench[0, 4], wrench[0, 5]
        jac[3, 4], jac[3, 5] = z, -y
        jac[4, 3], jac[4, 5] = -z, x
        jac[5, 3], jac[5, 4] = y, -x
