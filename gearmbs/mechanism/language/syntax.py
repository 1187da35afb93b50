"""ADAMS's function language: from text to a syntax tree, and the names and units its meaning depends on.

``parse`` reads the text (and finds every syntax error without a model); a ``Scope`` holds what names stand for;
``gearmbs.mechanism.language.library`` makes a tape of both.  Case does not matter; angles are radians, ``90D`` is
ninety degrees.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, TypeVar

from gearmbs.dae.equations.expressions.opcodes import ExpressionError
from gearmbs.dae.equations.expressions.splines import SplineData

Ref = int | str
"""An ADAMS id or a name."""


DIMENSIONS = {
    "number": (0, 0, 0, 0),
    "angle": (0, 0, 0, 0),
    "time": (0, 0, 1, 0),
    "rate": (0, 0, -1, 0),
    "mass": (1, 0, 0, 0),
    "inertia": (1, 2, 0, 0),
    "length": (0, 1, 0, 0),
    "velocity": (0, 1, -1, 0),
    "acceleration": (0, 1, -2, 0),
    "angular_velocity": (0, 0, -1, 0),
    "angular_acceleration": (0, 0, -2, 0),
    "force": (0, 0, 0, 1),
    "torque": (0, 1, 0, 1),
    "stiffness": (0, -1, 0, 1),
    "damping": (0, -1, 1, 1),
    "rotational_stiffness": (0, 1, 0, 1),
    "rotational_damping": (0, 1, 1, 1),
}
"""Exponents of mass, length, time and force (angles are numbers)."""


@dataclass(frozen=True)
class Number:
    """A literal; ``integer`` when it can stand for an id."""

    value: float
    at: int
    integer: int | None = None


@dataclass(frozen=True)
class Name:
    """A constant or the name of a model element."""

    text: str
    at: int


@dataclass(frozen=True)
class Call:
    """A function with its arguments."""

    name: str
    args: tuple[Node, ...]
    at: int


@dataclass(frozen=True)
class Chain:
    """Terms joined by operators of one precedence, from left to right."""

    first: Node
    rest: tuple[tuple[str, Node], ...]
    at: int


@dataclass(frozen=True)
class Negative:
    """A sign change."""

    operand: Node
    at: int


@dataclass(frozen=True)
class Power:
    """A power; it binds to the right."""

    base: Node
    exponent: Node
    at: int


Node = Number | Name | Call | Chain | Negative | Power


@dataclass(frozen=True)
class Units:
    """SI values of the units an expression is written in."""

    length: float = 1.0
    time: float = 1.0
    force: float = 1.0
    mass: float = 1.0

    @cached_property
    def factors(self) -> dict[str, float]:
        """SI value of one unit of each of ``DIMENSIONS``."""
        return {
            dimension: self.mass**mass * self.length**length * self.time**time * self.force**force
            for dimension, (mass, length, time, force) in DIMENSIONS.items()
        }

    def factor(self, dimension: str) -> float:
        """Return the SI value of one unit of ``dimension``, a key of ``DIMENSIONS``."""
        if dimension not in DIMENSIONS:
            raise ValueError(f"dimension {dimension!r} is not one of {', '.join(DIMENSIONS)}")
        return self.factors[dimension]


@dataclass(frozen=True)
class NamedNumber:
    """An input or a parameter, as expressions take it.

    Attributes
    ----------
    name : str
    value : float
        SI.
    factor : float
        SI value of its unit in the expression's own units.
    is_input : bool
    known : bool
        Whether its values are given as those of an unknown, ``("number", name)``, as over a solution.
    """

    name: str
    value: float
    factor: float
    is_input: bool
    known: bool = False


@dataclass(frozen=True)
class Scope:
    """What the names and ids in an expression stand for.

    Parameters
    ----------
    markers : mapping of int or str to int
        Marker table index of every id and (upper-case) name.
    several : set of str
        Names, in capitals, that several markers have: an expression cannot name these.
    marker_body : sequence of int
        Row of the kinematics table of every marker.
    variables : mapping
        Expression of every VARIABLE; VARVAL writes it in place.
    states : set
        VARIABLEs that are unknowns of their own: VARVAL becomes ``("variable", ref)``.
    diffs : mapping
        Expression of every DIFF; None for an implicit one.  DIF becomes ``("diff", ref)``.
    modes : mapping of str to int
        Number of modes of each body that has some, by upper-case name.  MODAL becomes ``("mode", name, place)``.
    splines : mapping to SplineData
    arrays : mapping to sequences of float
    numbers : mapping of str
        Inputs and parameters by upper-case name.
    functions : mapping
        Functions of the user by name, see `gearmbs.mechanism.language.user_functions.UserFunction`.
    plants : mapping of ("pinput" | "poutput", ref) to VARIABLE refs
    forces : mapping of (kind, ref) to (I marker ref, J marker ref or None)
        Elements whose forces JOINT, SFORCE, FX ... can ask for.
    absent : set of (kind, ref, 0 or 3)
        Elements without a force (0) or without a torque (3): it is zero.
    aliases : set of (kind, ref)
        Further names of forces that have another one: FX ... TM, sums between two markers, take each force once.
    units : Units
    one_sided : bool
        Only what elements exert at their I markers are unknowns; the J side follows from action and reaction at one
        point.
    """

    markers: Mapping[Ref, int] = field(default_factory=dict)
    several: frozenset[str] = frozenset()
    marker_body: Sequence[int] = ()
    variables: Mapping[Ref, str] = field(default_factory=dict)
    states: frozenset[Ref] = frozenset()
    diffs: Mapping[Ref, str | None] = field(default_factory=dict)
    modes: Mapping[Ref, int] = field(default_factory=dict)
    splines: Mapping[Ref, SplineData] = field(default_factory=dict)
    arrays: Mapping[Ref, Sequence[float]] = field(default_factory=dict)
    numbers: Mapping[str, NamedNumber] = field(default_factory=dict)
    functions: Mapping[str, Any] = field(default_factory=dict)
    plants: Mapping[tuple[str, Ref], Sequence[Ref]] = field(default_factory=dict)
    forces: Mapping[tuple[str, Ref], tuple[Ref, Ref | None]] = field(default_factory=dict)
    absent: frozenset[tuple[str, Ref, int]] = frozenset()
    aliases: frozenset[tuple[str, Ref]] = frozenset()
    units: Units = Units()
    one_sided: bool = False


_TOKEN = re.compile(
    r"""\s*(?:
      (?P<number>(?:\d+\.?\d*|\.\d+)(?:[Ee][+-]?\d+|[Dd]\d+)?)(?P<degree>[Dd](?![A-Za-z0-9_]))?
    | (?P<name>[A-Za-z_.$][A-Za-z0-9_.$]*|"[^"]*"|'[^']*')
    | (?P<op>\*\*|[-+*/(),:])
    )""",
    re.VERBOSE,
)


_EXPONENT = re.compile(r"[+-]\d+(?![\d.A-Za-z_])")
"""What may be an exponent behind a D: a signed integer that does not go on as a number or name."""


T = TypeVar("T")
Steps = Generator["Steps[T]", T, T]
"""What yields others of its kind, is sent what they return, and returns as much itself."""
Rule = Steps[Node]


def unrolled(steps: Steps[T]) -> T:
    """Return what nested steps return: a recursion as a loop, as deep as memory allows."""
    open_ones = [steps]
    found: Any = None
    while open_ones:
        try:
            open_ones.append(open_ones[-1].send(found))
            found = None
        except StopIteration as end:
            open_ones.pop()
            found = end.value
    return found


class _Parser:
    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens: list[tuple[str, str, int, bool]] = []
        at = 0
        while at < len(text):
            match = _TOKEN.match(text, at)
            if match is None:
                if not text[at:].strip():
                    break
                at += len(text[at:]) - len(text[at:].lstrip())
                raise self.error(f"unexpected character {text[at]!r}", at)
            exponent = _EXPONENT.match(text, match.end()) if match["degree"] else None
            if exponent is not None:
                number, sign, digits = match["number"], exponent[0][0], exponent[0][1:]
                raise self.error(
                    f"{number}D{sign}{digits} may be {number} degrees {sign} {digits} or a number with an exponent; "
                    f"write {number}D {sign} {digits} or {number}E{sign}{digits}",
                    match.start("number"),
                )
            kind = match.lastgroup if match.lastgroup != "degree" else "number"
            self.tokens.append((str(kind), match.group(str(kind)), match.start(str(kind)), bool(match.group("degree"))))
            at = match.end()
        self.tokens.append(("end", "", len(text), False))
        self.next = 0

    def error(self, message: str, at: int) -> ExpressionError:
        return ExpressionError(f"{message} at column {at + 1} of {shown(self.text)}")

    def accept(self, *symbols: str) -> str | None:
        kind, value, _, _ = self.tokens[self.next]
        if kind == "op" and value in symbols:
            self.next += 1
            return value
        return None

    def expect(self, symbol: str, where: str) -> None:
        if self.accept(symbol) is None:
            kind, value, at, _ = self.tokens[self.next]
            found = "the end" if kind == "end" else repr(value)
            raise self.error(f"expected {symbol!r} {where}, found {found}{self.hint()}", at)

    def hint(self) -> str:
        """Return what to do about a name behind another one."""
        several = self.next > 0 and self.tokens[self.next][0] == self.tokens[self.next - 1][0] == "name"
        return " (a name of several words stands in quotation marks)" if several else ""

    def whole(self) -> Node:
        node = unrolled(self.sum())
        kind, value, at, _ = self.tokens[self.next]
        if kind != "end":
            raise self.error(f"unexpected {value!r} after the expression{self.hint()}", at)
        return node

    # each rule yields the rules within it and is sent their nodes, see `unrolled`

    def sum(self) -> Rule:
        return self.chain(("+", "-"), self.product)

    def product(self) -> Rule:
        return self.chain(("*", "/"), self.signed)

    def chain(self, symbols: tuple[str, ...], operand: Callable[[], Rule]) -> Rule:
        at = self.tokens[self.next][2]
        first = yield operand()
        rest = []
        while symbol := self.accept(*symbols):
            rest.append((symbol, (yield operand())))
        return Chain(first, tuple(rest), at) if rest else first

    def signed(self) -> Rule:
        at = self.tokens[self.next][2]
        sign = self.accept("+", "-")
        operand = yield (self.signed() if sign else self.power())
        return Negative(operand, at) if sign == "-" else operand

    def power(self) -> Rule:
        base = yield self.atom()
        at = self.tokens[self.next][2]
        if self.accept("**") is None:
            return base
        return Power(base, (yield self.signed()), at)

    def atom(self) -> Rule:
        kind, value, at, degree = self.tokens[self.next]
        if kind == "number":
            self.next += 1
            return self.number(value, at, degree)
        if kind == "name":
            self.next += 1
            if value[0] not in "\"'" and self.accept("(") is not None:
                return (yield self.call(value.upper(), at))
            return Name(value.strip("\"'").upper(), at)
        if self.accept("(") is not None:
            node = yield self.sum()
            self.expect(")", "to close the bracket")
            return node
        found = "the end" if kind == "end" else repr(value)
        raise self.error(f"expected a number, a function or a bracket, found {found}", at)

    def number(self, text: str, at: int, degree: bool) -> Number:
        value = float(re.sub("[dD]", "E", text))
        if abs(value) > 1e300:
            raise self.error(f"the number {text} is too large", at)
        if degree:
            return Number(value * 0.017453292519943295, at)
        return Number(value, at, int(text) if text.isdigit() and len(text) < 19 else None)

    def call(self, name: str, at: int) -> Rule:
        args: list[Node] = []
        if self.accept(")") is None:
            args.append((yield self.sum()))
            while self.accept(",", ":") is not None:
                args.append((yield self.sum()))
            self.expect(")", f"to close {name}")
        return Call(name, tuple(args), at)


def shown(text: str) -> str:
    """Return an expression for a message, shortened when it is long."""
    flat = " ".join(text.split())
    return repr(flat if len(flat) <= 90 else flat[:87] + "...")


@lru_cache(maxsize=1024)
def parse(text: str) -> Node:
    """Read a function expression into its syntax tree.

    Parameters
    ----------
    text : str

    Returns
    -------
    Node

    Raises
    ------
    ExpressionError
        With the column and what was expected there.
    """
    if not isinstance(text, str):
        raise ExpressionError(f"the expression is {text!r}; give it as text")
    if not text.strip():
        raise ExpressionError("the expression is empty; give at least a number")
    return _Parser(text).whole()


def unparse(node: Node, rename: Callable[[Call], Node] = lambda call: call) -> str:
    """Write a syntax tree as text again.

    Parameters
    ----------
    node : Node
    rename : callable
        Given every function call before it is written; returns what to write instead.
    """
    out: list[str] = []
    unrolled(_written(node, rename, out))
    return "".join(out)


def _written(node: Node, rename: Callable[[Call], Node], out: list[str]) -> Steps[None]:
    """Append the pieces of a node's text."""
    if isinstance(node, Call):
        call = rename(node)
        if not isinstance(call, Call):
            yield _written(call, rename, out)
            return
        node = call
        before, between, after = f"{node.name}(", [", "] * len(node.args), ")"
    elif isinstance(node, Negative):
        before, between, after = "(-", [], ")"
    elif isinstance(node, Power):
        before, between, after = "(", [")**("], ")"
    elif isinstance(node, Chain):
        before, between, after = "(", [f" {symbol} " for symbol, _ in node.rest], ")"
    elif isinstance(node, Number):
        out.append(str(node.integer) if node.integer is not None else repr(node.value))
        return
    else:
        out.append(node.text if re.fullmatch(r"[A-Z_.$][A-Z0-9_.$]*", node.text) else f'"{node.text}"')
        return
    out.append(before)
    for k, child in enumerate(children(node)):
        if k:
            out.append(between[k - 1])
        yield _written(child, rename, out)
    out.append(after)


def children(node: Node) -> tuple[Node, ...]:
    """Return the nodes right below a node."""
    if isinstance(node, Negative):
        return (node.operand,)
    if isinstance(node, Power):
        return (node.base, node.exponent)
    if isinstance(node, Chain):
        return (node.first, *(operand for _, operand in node.rest))
    return node.args if isinstance(node, Call) else ()


def with_children(node: Node, new: Sequence[Node]) -> Node:
    """Return a node with others in place of those right below it."""
    if isinstance(node, Negative):
        return replace(node, operand=new[0])
    if isinstance(node, Power):
        return replace(node, base=new[0], exponent=new[1])
    if isinstance(node, Chain):
        return replace(node, first=new[0], rest=tuple((symbol, one) for (symbol, _), one in zip(node.rest, new[1:])))
    return replace(node, args=tuple(new)) if isinstance(node, Call) else node


def walk(node: Node) -> Iterator[Node]:
    """Yield a syntax tree's nodes, parents first."""
    waiting = [node]
    while waiting:
        node = waiting.pop()
        yield node
        waiting.extend(reversed(children(node)))


def innermost_first(node: Node) -> Iterator[Node]:
    """Yield a syntax tree's nodes, parents last, from left to right."""
    waiting, found = [node], []
    while waiting:
        node = waiting.pop()
        found.append(node)
        waiting.extend(children(node))
    return reversed(found)


__all__ = ["ExpressionError", "Scope", "SplineData", "Units", "parse", "unparse", "walk"]
