"""Values, derivatives and products of them from one definition of a law, written as kernels.

A law is a plain Python function of numbers. Called with `Value` objects it is traced: each operation becomes a node of
a graph in which no node is there twice, so that what derivatives have in common is computed once. `derivative` adds
nodes, `given` says how a number moves that somebody else computes, or that has a shorter rule than the chain's, and
`Function.source` writes nodes as a kernel.

A module ``definitions.py`` has a function ``functions()`` that returns `Function` objects; ``derived.py`` beside it is
what they become, with the compiler's options ``COMPILED`` if it has any:

    python -m gearmbs.kernels.derive

writes all such files anew. Behind a line stands what the definitions call its value, or of what by what it is the
derivative. Of branches only `choose` is traced, both sides computed: whether bodies touch is asked by whoever calls it.
"""

from __future__ import annotations

import functools
import importlib
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.kernels.named import names_in, told_names

WIDTH = 110
"""Characters of an expression beyond which a part of it gets a line of its own."""
BRANCH = "a branch cannot be traced; use gm.choose(a, b, x, y), x where a > b and else y, np.maximum or np.minimum"
FLOAT = "it is no float, but written down; for functions of math write those of numpy"
_nodes: dict[tuple, Value] = {}
_slopes: dict[tuple[Value, Value], Value] = {}
_watched: list[bool] = []
_called: dict[Value, str] = {}


class Value:
    """A number that is being written down: an operation on other numbers.

    ``numpy.sqrt(value)`` and other functions of numpy call the method of that name; arrays of numbers are arrays of
    objects, with the products of numpy.
    """

    __slots__ = ("_partials", "name", "operands", "operation", "place")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **keywords: Any) -> Any:
        own = {"maximum": larger, "minimum": smaller}.get(ufunc.__name__)
        if method != "__call__" or keywords:
            return NotImplemented
        if own and not any(isinstance(x, np.ndarray) for x in inputs):
            return own(*inputs)
        return ufunc(*(_boxed(x) if isinstance(x, Value) else x for x in inputs))

    def __bool__(self) -> bool:
        raise TypeError(BRANCH)

    def _refused(self, other: Any) -> Any:
        raise TypeError(BRANCH)

    __lt__ = __le__ = __gt__ = __ge__ = _refused

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Value) and not _watched:
            return self is other
        raise TypeError(BRANCH)

    def __hash__(self) -> int:
        # a number that is looked up in a mapping or a set is a branch as well
        if _watched:
            raise TypeError(BRANCH)
        return object.__hash__(self)

    def __init__(self, operation: str, operands: tuple, name: str = "") -> None:
        self.operation, self.operands, self.name = operation, operands, name
        self.place = len(_nodes)
        self._partials: Mapping[Value, Value] = {}

    def __add__(self, other: Any) -> Value:
        other = value_of(other)
        if other.operation == "-x":
            return self - other.operands[0]
        if self.operation == "-x":
            return other - self.operands[0]
        if self is ZERO or other is ZERO:
            return other if self is ZERO else self
        if self is other:
            return 2.0 * self
        return _commuting("+", self, other, lambda a, b: a + b)

    def __sub__(self, other: Any) -> Value:
        other = value_of(other)
        if self is other:
            return ZERO
        if self is ZERO or other is ZERO:
            return -other if self is ZERO else self
        if other.operation == "-x":
            return self + other.operands[0]
        if self.operation == "-x":
            return -(self.operands[0] + other)
        if self.operation == other.operation == "number":
            return _number(self.operands[0] - other.operands[0])
        return _node("-", self, other)

    def __mul__(self, other: Any) -> Value:
        other = value_of(other)
        if self is ZERO or other is ZERO:
            return ZERO
        if self is ONE or other is ONE:
            return other if self is ONE else self
        for a, b in ((self, other), (other, self)):
            if a.operation == "-x":
                return -(a.operands[0] * b)
            if a.operation == "number" and a.operands[0] < 0.0:
                return -(-a * b)
            if a.operation == "number" and b.operation == "*" and b.operands[0].operation == "number":
                return (a * b.operands[0]) * b.operands[1]
            if a.operation != "number" and b.operation == "*" and b.operands[0].operation == "number":
                return b.operands[0] * (a * b.operands[1])
        return _commuting("*", self, other, lambda a, b: a * b)

    def __truediv__(self, other: Any) -> Value:
        other = value_of(other)
        if other.operation == "number":
            return self * (1.0 / other.operands[0])
        if self.operation == "-x":
            return -(self.operands[0] / other)
        return self * _node("1/x", other)

    def __neg__(self) -> Value:
        if self.operation == "number":
            return _number(-self.operands[0])
        return self.operands[0] if self.operation == "-x" else _node("-x", self)

    def __pow__(self, exponent: Any) -> Value:
        exponent = value_of(exponent)
        if self is ZERO and (exponent.operation != "number" or exponent.operands[0] > 0.0):
            return ZERO if exponent.operation == "number" else _node("**", self, exponent)
        if exponent.operation != "number" or 0.0 < exponent.operands[0] < 1.0:
            # the slope at zero is infinite: chosen before, not multiplied by zero after
            sides = _sides(self)
            if sides:
                return choose(*sides[:2], *(side**exponent for side in sides[2:]))
        if exponent.operation != "number":
            # written as a product, whose second factor its slope has, too
            return _node("power", self, _node("**", self, exponent - 1.0), exponent)
        n = exponent.operands[0]
        if n in (0.5, 1.0):
            return self.sqrt() if n == 0.5 else self
        if n == 0.0:
            return ONE
        if n == 2.0:
            return self * self
        if n > 1.0:
            return _node("power", self, self ** (n - 1.0), exponent)
        return _node("**", self, exponent)

    def __radd__(self, other: Any) -> Value:
        return self + other

    def __rsub__(self, other: Any) -> Value:
        return value_of(other) - self

    def __rmul__(self, other: Any) -> Value:
        return self * other

    def __rtruediv__(self, other: Any) -> Value:
        return value_of(other) / self

    def sqrt(self) -> Value:
        if self is ZERO or _sides(self):
            return self**0.5
        squares = _squares(self)
        return _node("norm", *squares) if squares else _node("sqrt", self)

    def __rpow__(self, base: Any) -> Value:
        return value_of(base) ** self

    def __float__(self) -> float:
        raise TypeError(FLOAT)

    def hypot(self, other: Any) -> Value:
        return (self * self + value_of(other) * other).sqrt()

    def arcsin(self) -> Value:
        return self.arctan2((1.0 - self * self).sqrt())

    def arccos(self) -> Value:
        return (1.0 - self * self).sqrt().arctan2(self)

    def sinh(self) -> Value:
        return 0.5 * (self.exp() - (-self).exp())

    def cosh(self) -> Value:
        return 0.5 * (self.exp() + (-self).exp())

    def __abs__(self) -> Value:
        return choose(self, 0.0, self, -self)

    def sin(self) -> Value:
        return _node("sin", self)

    def cos(self) -> Value:
        return _node("cos", self)

    def tan(self) -> Value:
        return _node("tan", self)

    def tanh(self) -> Value:
        return _node("tanh", self)

    def exp(self) -> Value:
        return _node("exp", self)

    def log(self) -> Value:
        return _node("log", self)

    def arctan(self) -> Value:
        return _node("arctan", self)

    def arctan2(self, other: Any) -> Value:
        return _node("arctan2", self, value_of(other))

    def partials(self) -> Iterable[tuple[Value, Value]]:
        """Yield the operands and the derivatives by them."""
        kind, (a, b) = self.operation, (*self.operands, None, None)[:2]
        if kind == "given" or self._partials:
            yield from self._partials.items()
        elif kind in "+-":
            yield from ((a, ONE), (b, ONE if kind == "+" else -ONE))
        elif kind == "*":
            yield from ((a, b), (b, a))
        elif kind == "norm":
            yield from ((operand, operand / self) for operand in self.operands)
        elif kind == "arctan2":
            length = (a * a + b * b).sqrt()
            yield from ((a, b / length / length), (b, -(a / length / length)))
        elif kind == "power":
            exponent = self.operands[2]
            yield a, exponent * b
            if exponent.operation != "number":
                yield exponent, self * a.log()
        elif kind == "**" and a is not ZERO:
            yield a, b * (self / a)
            if b.operation != "number":
                yield b, self * a.log()
        elif kind in ONE_OPERAND:
            yield a, ONE_OPERAND[kind](a, self)


def _beside_arrays(operator: Any) -> Any:
    """Return an operator that leaves products with arrays to these."""

    @functools.wraps(operator)
    def beside(self: Value, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else operator(self, other)

    return beside


for _name in ("add", "sub", "mul", "truediv", "radd", "rsub", "rmul", "rtruediv"):
    setattr(Value, f"__{_name}__", _beside_arrays(getattr(Value, f"__{_name}__")))

ONE_OPERAND: dict[str, Any] = {
    "-x": lambda x, f: _number(-1.0),
    "1/x": lambda x, f: -(f * f),
    "sqrt": lambda x, f: 0.5 / f,
    "sin": lambda x, f: x.cos(),
    "cos": lambda x, f: -x.sin(),
    "tan": lambda x, f: 1.0 + f * f,
    "tanh": lambda x, f: 1.0 - f * f,
    "exp": lambda x, f: f,
    "log": lambda x, f: 1.0 / x,
    "arctan": lambda x, f: 1.0 / (1.0 + x * x),
}
"""Derivatives of functions f of x."""


def choose(a: Any, b: Any, x: Any, y: Any) -> Any:
    """Return x where a > b, else y. Both are computed: what is not chosen may be no number.

    Examples
    --------
    >>> choose(1.0, 2.0, 10.0, 20.0)
    20.0
    """
    if not any(isinstance(one, Value) for one in (a, b, x, y)):
        return x if a > b else y
    values = [value_of(one) for one in (a, b, x, y)]
    return values[2] if values[2] is values[3] else _node("choose", *values)


def larger(a: Any, b: Any) -> Any:
    """Return the larger of two numbers."""
    return choose(a, b, a, b)


def smaller(a: Any, b: Any) -> Any:
    """Return the smaller of two numbers."""
    return choose(a, b, b, a)


def _boxed(value: Value) -> Any:
    box = np.empty((), dtype=object)
    box[()] = value
    return box


def _node(operation: str, *operands: Any, name: str = "") -> Value:
    key = (operation, *(id(x) if isinstance(x, Value) else x for x in operands))
    if key not in _nodes:
        _nodes[key] = Value(operation, operands, name)
    return _nodes[key]


def _number(number: float) -> Value:
    if isinstance(number, (str, bytes)):
        raise TypeError(f"{number!r} is text; write a number, in SI")
    if np.isnan(float(number)):
        raise TypeError("a number of it is nan; leave it out")
    return _node("number", float(number))


def value_of(number: Any) -> Value:
    """Return a number as one that is written down."""
    return number if isinstance(number, Value) else _number(number)


def _squares(value: Value) -> list[Value]:
    """Return the numbers whose squares a value is the sum of, if it is."""
    if value.operation == "+":
        first, second = map(_squares, value.operands)
        return first + second if first and second else []
    return [value.operands[0]] if value.operation == "*" and value.operands[0] is value.operands[1] else []


def _sides(value: Value) -> tuple[Any, ...]:
    """Return a, b, x, y if a value is x where a > b, else y, and one of both is zero there, or may be."""
    kind, operands = value.operation, value.operands
    if kind == "choose":
        return operands if any(side is ZERO or _sides(side) for side in operands[2:]) else ()
    if kind == "-x":
        a, b, *ends = _sides(operands[0]) or (None, None)
        return (a, b, *(-end for end in ends)) if ends else ()
    if kind in ("power", "**") and operands[-1].operation == "number" and operands[-1].operands[0] > 0.0:
        a, b, *ends = _sides(operands[0]) or (None, None)
        return (a, b, *(end ** operands[-1] for end in ends)) if ends else ()
    if kind == "*":
        for one, other in (operands, operands[::-1])[: 1 if operands[0] is operands[1] else 2]:
            a, b, *ends = _sides(one) or (None, None)
            if ends:
                return (a, b, *(end * other for end in ends))
    return ()


def _commuting(operation: str, a: Value, b: Value, fold: Any) -> Value:
    if a.operation == b.operation == "number":
        return _number(fold(a.operands[0], b.operands[0]))
    # numbers first, then as they came to be
    order = sorted((a, b), key=lambda x: (x.operation != "number", x.place))
    return _node(operation, *order)


ZERO, ONE = _number(0.0), _number(1.0)


def start() -> None:
    """Forget all nodes, so that what is written does not depend on what was traced before."""
    _nodes.clear()
    _slopes.clear()
    _called.clear()
    for number in (ZERO, ONE):
        _nodes["number", number.operands[0]] = number


@contextmanager
def watched() -> Iterator[None]:
    """Refuse to compare numbers and to look them up, while a function of somebody else is traced."""
    _watched.append(True)
    try:
        yield
    finally:
        _watched.pop()


def inputs(names: str, array: str = "", first: int | str = 0) -> list[Value]:
    """Return arguments of a kernel: each for itself, or as numbers of an array from one on, a number or a name."""
    at = [first + k if isinstance(first, int) else f"{first} + {k}" if k else first for k in range(len(names.split()))]
    places = [f"{array}[{k}]" if array else name for k, name in zip(at, names.split())]
    # of one name there may be several, one for each law
    return [_node("given", place, len(_nodes), name=name) for place, name in zip(places, names.split())]


def given(value: Value, partials: Mapping[Value, Any]) -> Value:
    """Say what derivatives a number has by others; all else is taken for constant. Return it."""
    value._partials = {by: value_of(slope) for by, slope in partials.items()}
    return value


def derivative(value: Value, by: Value) -> Value:
    """Return the derivative of a value by another one that it was made of."""
    if value is by:
        return ONE
    if (value, by) not in _slopes:
        _slopes[value, by] = ZERO  # stands before those of its operands, which are named after it
        _slopes[value, by] = _chained(value, lambda one: derivative(one, by))
    return _slopes[value, by]


def _chained(value: Value, rate: Callable[[Value], Value]) -> Value:
    """Return how a value moves, from how its operands do."""
    if value.operation == "choose":
        return choose(*value.operands[:2], *map(rate, value.operands[2:]))
    return sum((slope * rate(one) for one, slope in value.partials()), ZERO)


def slopes(value: Value, by: Iterable[Value]) -> list[Value]:
    """Return the derivatives of a value by several others."""
    return [derivative(value, one) for one in by]


def tangent(value: Value, rates: Mapping[Value, Any]) -> Value:
    """Return the derivative of a value along rates of what it is made of: by time, or by a parameter."""
    return product((derivative(value, by) for by in rates), map(value_of, rates.values()))


def along(value: Value, rates: Mapping[Value, Any]) -> Value:
    """Return what `tangent` does, from one pass: shorter where many numbers move."""
    moved = {one: value_of(rate) for one, rate in rates.items()}

    def rate(x: Value) -> Value:
        moved[x] = moved[x] if x in moved else _chained(x, rate)
        return moved[x]

    return rate(value)


def product(first: Iterable[Value], second: Iterable[Value]) -> Value:
    """Return the sum of the products of two rows of numbers."""
    return sum((a * b for a, b in zip(first, second, strict=True)), ZERO)


@dataclass
class Function:
    """A kernel to be written.

    Attributes
    ----------
    name : str
    arguments : str
        Their names, with commas: arrays or numbers.
    text : str
        Docstring.
    returns : sequence of Value
        What it returns, as a tuple.
    sets, adds : mapping of str to Value
        What it writes, and adds, to places of arrays, such as ``"sums[3]"``.
    """

    name: str
    arguments: str
    text: str
    returns: Sequence[Any] = ()
    sets: Mapping[str, Any] = field(default_factory=dict)
    adds: Mapping[str, Any] = field(default_factory=dict)

    def source(self, compiled: str = 'error_model="numpy"') -> str:
        """Return the kernel as text, to be compiled with some options."""
        head = f"@njit(cache=True, straight=True, {compiled}, forceinline=True)"
        return f"{head}\n{self.undecorated()}"

    def undecorated(self) -> str:
        """Return the kernel as text without the decorator."""
        lines = _Lines([value_of(value) for value in (*self.returns, *self.sets.values(), *self.adds.values())])
        body = [f'    """{self.text}"""', *lines.inputs()]
        returned = [lines.told(value_of(value)) for value in self.returns]
        written = [f"{place} = {lines.told(value_of(value))}" for place, value in self.sets.items()]
        for place, value in self.adds.items():
            if value.operation == "-x":
                written.append(f"{place} -= {lines.told(value.operands[0])}")
            elif value is not ZERO:
                written.append(f"{place} += {lines.told(value)}")
        body += lines.written + ["    " + line for line in written]
        if returned:
            body.append(f"    return {', '.join(returned)}")
        return "\n".join([f"def {self.name}({self.arguments}):", *body]) + "\n"


class _Lines:
    """Lines of a kernel: a name for each value that is used more than once, in the order in which they are needed."""

    def __init__(self, ends: Iterable[Value]) -> None:
        self.uses: dict[Value, int] = {}
        self.names: dict[Value, str] = {}
        self.written: list[str] = []
        for value in ends:
            self._count(value)

    def _count(self, value: Value) -> None:
        self.uses[value] = self.uses.get(value, 0) + 1
        if self.uses[value] == 1 and value.operation not in ("given", "number"):
            for operand in value.operands * (2 if value.operation == "norm" else 1):
                self._count(operand)

    def inputs(self) -> list[str]:
        """Return the lines that take numbers out of arrays, eight in one."""
        taken = [value for value in self.uses if value.operation == "given" and value.operands[0] != value.name]
        taken.sort(key=lambda value: value.place)
        rows = [taken[k : k + 8] for k in range(0, len(taken), 8)]
        return [
            f"    {', '.join(value.name for value in row)} = {', '.join(value.operands[0] for value in row)}"
            for row in rows
        ]

    def told(self, value: Value) -> str:
        """Return the text of a value, after the lines that it needs."""
        kind = value.operation
        if value in self.names or kind in ("given", "number"):
            return self.names.get(value) or value.name or _digits(value.operands[0])
        parts = [self.told(operand) for operand in value.operands]
        closed = [f"({p})" if re.search(r" [-+*/] |^-", p) and not _whole(p) else p for p in parts]
        if kind == "choose":
            text = f"({closed[2]} if {closed[0]} > {closed[1]} else {closed[3]})"
        elif kind in "+-":
            text = f"{parts[0]} {kind} {parts[1] if kind == '+' and parts[1][0] != '-' else closed[1]}"
        elif kind in ("*", "**", "power"):
            sign = "**" if kind == "**" else "*"
            base = f"({parts[0]})" if " ** " in parts[0] and closed[0] == parts[0] else closed[0]
            text = f"{_factor(parts[0], closed[0]) if sign == '*' else base} {sign} {closed[1]}"
        elif kind == "-x":
            text = f"-{closed[0]}"
        elif kind == "1/x":
            text = f"1.0 / {closed[0]}"
        elif kind == "norm":
            text = f"np.sqrt({' + '.join(f'{p} * {p}' for p in closed)})"
        else:
            text = f"np.{kind}({', '.join(parts)})"
        if (self.uses[value] > 1 and kind != "-x") or len(text) > WIDTH:
            name = f"_{len(self.names)}"
            called = f"  # {_called[value]}" if value in _called else ""
            self.written.append(f"    {name} = {text}{called}")
            self.names[value] = name
            return name
        return text


def _digits(number: float) -> str:
    """Return a number as text; infinite ones have no name that every compiler knows."""
    return repr(number).replace("inf", "1e999")


def _whole(text: str) -> bool:
    """Whether a text is one call."""
    return text.startswith("np.") and text.endswith(")") and text.count("(") == 1


def _factor(text: str, closed: str) -> str:
    """Return the first factor of a product: without brackets if it is a product of products itself."""
    return text if not re.search(r" [-+/] |^-", text) else closed


def derived(module: str) -> str:
    """Return the text of the kernels that follow from a module of definitions."""
    start()
    home = importlib.import_module(module)
    with names_in(str(home.__file__), Value) as (single, items):
        made = home.functions()
    _called.update(told_names(single, items, _slopes))
    options = {"compiled": home.COMPILED} if hasattr(home, "COMPILED") else {}
    return "\n\n".join([
        f'"""Generated by ``python -m gearmbs.kernels.derive`` from `{module}`: change that, and make it again."""\n\n'
        "# ruff: noqa\n# fmt: off\n\nimport numpy as np\n\nfrom gearmbs.kernels.jit import njit\n",
        *(function.source(**options) for function in made),
    ])  # fmt: skip


def definitions() -> list[tuple[str, Path]]:
    """Return the names of all modules of definitions of the package, and the files of what follows from them."""
    package = Path(__file__).parent.parent
    found = sorted(package.rglob("definitions.py"))
    return [
        (".".join(path.relative_to(package.parent).with_suffix("").parts), path.with_name("derived.py"))
        for path in found
    ]


def main() -> None:
    """Write the kernels of all definitions."""
    for module, path in definitions():
        path.write_text(derived(module), encoding="utf-8")
        print(path)


if __name__ == "__main__":
    # definitions know this module by its name
    importlib.import_module("gearmbs.kernels.derive").main()
