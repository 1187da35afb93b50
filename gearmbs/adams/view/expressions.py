"""Expressions of View that are evaluated when a model is made: read into trees, and evaluated.

``LOC_RELATIVE_TO({0, 0, .m.DV_1 / 2}, .m.ground.MARKER_1)[2] + 3.0cm``: numbers with units, texts, arrays in braces,
objects and their attributes by name, operators and functions. Trees are tuples; nothing of Python can be reached from
them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Item, Units, unit_named

DEEPEST = 60
"""Brackets within brackets: an expression of people has a few; each costs frames of the interpreter's stack."""
LARGEST_ARRAY = 100_000
LARGEST_TEXT = 1_000_000

_TOKEN = re.compile(
    r"""\s*(?:
    (?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)
  | (?P<text>"(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*')
  | (?P<name>\.?[A-Za-z_$][A-Za-z0-9_$]*(?:\.[A-Za-z0-9_$]+)*)
  | (?P<operator>\*\*|//|==|!=|<=|>=|&&|\|\||[-+*/%^<>!(){}\[\],])
    )""",
    re.VERBOSE,
)
_UNIT = re.compile(r"[A-Za-z_]+")
_UNITS = re.compile(r"\(\s*([A-Za-z_][A-Za-z_0-9\s*/^-]*)\)")
_LEVELS = (("||",), ("&&",), ("==", "!="), ("<", ">", "<=", ">="), ("+", "-", "//"), ("*", "/", "%"))
_BINDS = {operator: k for k, level in enumerate(_LEVELS) for operator in level}
"""How tightly operators bind."""

Tree = tuple[Any, ...]
"""("number", value), ("text", value), ("name", name), ("call", name, trees), ("array", trees), ("index", tree, trees),
("attribute", tree, name), ("unary", operator, tree), ("binary", operator, tree, tree), ("value", anything)."""


def parse(text: str, units: Units, line: int = 0) -> Tree:
    """Return the tree of an expression.

    Raises
    ------
    ViewError
        If it has no such form.
    """
    try:
        tree, converted = _parsed(text, tuple(units.names.items()))
    except ViewError as error:
        raise ViewError(str(error), line) from error
    units.converted |= converted
    return tree


@lru_cache(maxsize=1024)
def _parsed(text: str, units: tuple[tuple[str, str], ...]) -> tuple[Tree, frozenset[str]]:
    """Return the tree of an expression and the quantities of its units; loops ask for the same ones again and again."""
    parser = _Parser(text, Units(dict(units)))
    tree = parser.level(0)
    if parser.kind:
        raise parser.error(f"{parser.token!r} is not expected")
    return tree, frozenset(parser.units.converted)


ALL: Tree = ("text", "*")
"""An index that stands for every member."""


class _Parser:
    def __init__(self, text: str, units: Units) -> None:
        self.text, self.units = text, units
        self.at = 0
        self.depth = 0
        self.kind = self.token = ""
        self.next()

    def error(self, message: str) -> ViewError:
        return ViewError(f"in the expression {self.text[:80].strip()}: {message}")

    def next(self) -> None:
        match = _TOKEN.match(self.text, self.at)
        if match is None:
            if self.text[self.at :].strip():
                raise self.error(f"{self.text[self.at :].strip()[:20]!r} is not understood")
            self.kind = self.token = ""
            return
        self.at = match.end()
        self.kind = str(match.lastgroup)
        self.token = match.group(self.kind)

    def take(self, operator: str) -> None:
        if self.kind != "operator" or self.token != operator:
            raise self.error(f"{operator!r} is missing" + (f" before {self.token!r}" if self.kind else ""))
        self.next()

    def level(self, least: int) -> Tree:
        """Read operands and the operators between them that bind at least as tightly as ``least``."""
        tree = self.unary()
        while self.kind == "operator" and _BINDS.get(self.token, -1) >= least:
            operator = self.token
            self.next()
            tree = ("binary", operator, tree, self.level(_BINDS[operator] + 1))
        return tree

    def unary(self) -> Tree:
        signs = []
        while self.kind == "operator" and self.token in "+-!":
            signs.append(self.token)
            self.next()
        tree = self.power()
        for sign in reversed(signs):
            tree = ("unary", sign, tree)
        return tree

    def power(self) -> Tree:
        tree = self.postfix()
        if self.kind == "operator" and self.token in ("**", "^"):
            self.next()
            self.deeper()
            tree = ("binary", "**", tree, self.unary())
            self.depth -= 1
        return tree

    def deeper(self) -> None:
        self.depth += 1
        if self.depth > DEEPEST:
            raise self.error(f"brackets are nested deeper than {DEEPEST}")

    def postfix(self) -> Tree:
        self.deeper()
        tree = self.atom()
        while self.kind == "operator" and self.token == "[":
            self.next()
            tree = ("index", tree, self.listed("]"))
        if self.kind == "name" and self.token.startswith(".") and tree[0] == "call":
            tree = ("attribute", tree, self.token[1:])
            self.next()
        if self.kind == "name" and (found := unit_named(self.token)) is not None:
            tree = ("binary", "*", tree, ("number", self.factor(found[0], found[2])))
            self.next()
        self.depth -= 1
        return tree

    def listed(self, closing: str) -> tuple[Tree, ...]:
        trees = []
        while not (self.kind == "operator" and self.token == closing):
            if closing == "]" and self.kind == "operator" and self.token == "*":
                # all of a row or a column
                trees.append(ALL)
                self.next()
            else:
                trees.append(self.level(0))
            if len(trees) > LARGEST_ARRAY:
                raise self.error(f"a list of more than {LARGEST_ARRAY} members")
            if self.kind == "operator" and self.token == ",":
                self.next()
            elif not (self.kind == "operator" and self.token == closing):
                raise self.error(f"{closing!r} is missing")
        self.next()
        return tuple(trees)

    def atom(self) -> Tree:
        kind, token = self.kind, self.token
        if kind == "number":
            value = float(token)
            if math.isinf(value):
                raise self.error(f"{token} is too large")
            factor = self.unit_behind()
            self.next()
            if factor is not None:
                return ("number", value * factor)
            return ("number", int(token) if token.isdigit() and len(token) < 10 else value)
        if kind == "text":
            self.next()
            return ("text", re.sub(r"\\(.)", r"\1", token[1:-1]))
        if kind == "name":
            self.next()
            if self.kind == "operator" and self.token == "(" and "." not in token:
                self.next()
                return ("call", token.upper(), self.listed(")"))
            if self.kind == "operator" and self.token == "(":
                # a name with units behind it
                self.at -= 1
                factor = self.unit_behind()
                self.next()
                return ("name", token) if factor is None else ("binary", "*", ("name", token), ("number", factor))
            return ("name", token)
        if kind == "operator" and token == "(":
            self.next()
            tree = self.level(0)
            self.take(")")
            return tree
        if kind == "operator" and token in ("{", "["):
            self.next()
            return ("array", self.listed("}" if token == "{" else "]"))
        raise self.error(f"{token!r} is not expected" if kind else "it ends too early")

    def unit_behind(self) -> float | None:
        """Return the factor of a unit that stands right behind a number, and go behind it."""
        match = _UNIT.match(self.text, self.at)
        if match is not None:
            found = unit_named(match.group())
            if found is None:
                raise self.error(f"{match.group()} behind a number is no unit")
            self.at = match.end()
            return self.factor(found[0], found[2])
        match = _UNITS.match(self.text, self.at)
        if match is None:
            return None
        self.at = match.end()
        return self.product(match.group(1))

    def product(self, text: str) -> float:
        """Return the factor of units such as newton-mm-sec/deg or kg/meter**3."""
        factor, sign, last = 1.0, 1, 1.0
        for piece in re.findall(r"[A-Za-z_]+|\*\*\s*\d+|\^\s*\d+|[*/-]", text):
            if piece in ("*", "-"):
                continue
            if piece == "/":
                sign = -1
                continue
            if piece[0] in "*^":
                factor *= last ** (sign * (min(int(piece.strip("*^ ")), 9) - 1))
                continue
            found = unit_named(piece)
            if found is None:
                raise self.error(f"{piece} is no unit")
            last = self.factor(found[0], found[2])
            factor *= last**sign
        return factor

    def factor(self, quantity: str, si: float) -> float:
        """Return how many of the model's units a unit is."""
        self.units.converted.add(quantity)
        return si / self.units.si(quantity)


# Evaluation.


Lookup = Callable[[str], Any]
Call = Callable[[str, tuple[Tree, ...], "Evaluator"], Any]


class Evaluator:
    """Evaluates trees.

    Parameters
    ----------
    lookup : callable
        From a name to an object, the value of a variable or an attribute.
    call : callable
        From the name of a function, the trees of its arguments and this evaluator to its value.
    line : int
        For messages.
    """

    def __init__(self, lookup: Lookup, call: Call, line: int = 0) -> None:
        self.lookup, self.call, self.line = lookup, call, line

    def error(self, message: str) -> ViewError:
        return ViewError(message, self.line)

    def __call__(self, tree: Tree) -> Any:
        """Return a number, a text, an object or a list of these.

        Raises
        ------
        ViewError
            If a name, a function or an operation has no meaning.
        """
        # what stands in a row is worked off in a loop: sums of thousands of terms do not go deep
        rest = []
        while tree[0] == "binary" and tree[1] not in ("&&", "||"):
            rest.append((tree[1], tree[3]))
            tree = tree[2]
        value = self.one(tree)
        for operator, right in reversed(rest):
            value = self.apply(operator, value, self(right))
        return value

    def one(self, tree: Tree) -> Any:
        kind = tree[0]
        if kind in ("number", "text", "value"):
            return tree[1]
        if kind == "name":
            return self.lookup(tree[1])
        if kind == "call":
            return self.call(tree[1], tree[2], self)
        if kind == "array":
            return [self(one) for one in tree[1]]
        if kind == "index":
            return self.member(self(tree[1]), [self(one) for one in tree[2]])
        if kind == "attribute":
            owner = self(tree[1])
            if not isinstance(owner, Item):
                raise self.error(f"{_shown(owner)} has no {tree[2][:40]}")
            return self.lookup(f"{owner.path}.{tree[2]}")
        if kind == "unary":
            value = self(tree[2])
            return (
                int(not self.truth(value))
                if tree[1] == "!"
                else self.each(lambda x: -x, value)
                if tree[1] == "-"
                else value
            )
        left = self.truth(self(tree[2]))
        return int(left and self.truth(self(tree[3])) if tree[1] == "&&" else left or self.truth(self(tree[3])))

    def number(self, value: Any) -> float:
        """Return a value as a number.

        Raises
        ------
        ViewError
        """
        while isinstance(value, list) and len(value) == 1:
            value = value[0]
        if isinstance(value, (int, float)):
            return value
        raise self.error(f"a number is wanted, not {_shown(value)}")

    def truth(self, value: Any) -> bool:
        """Return whether a value counts as true: a number that is not 0, or an object."""
        if isinstance(value, (str, Item)):
            return bool(value)
        return self.number(value) != 0

    def numbers(self, value: Any) -> list[float]:
        """Return a value as a flat list of numbers."""
        if isinstance(value, list):
            found: list[float] = []
            for one in value:
                found += self.numbers(one)
            return found
        return [self.number(value)]

    def each(self, function: Callable[..., float], *values: Any) -> Any:
        """Apply a function to numbers, or member by member to lists of them."""
        lists = [v for v in values if isinstance(v, list)]
        if not lists:
            try:
                result = function(*(self.number(v) for v in values))
            except (ArithmeticError, ValueError) as error:
                raise self.error(f"{', '.join(_shown(v) for v in values)}: {error}") from error
            if isinstance(result, complex) or not math.isfinite(result):
                raise self.error(f"{', '.join(_shown(v) for v in values)}: the result is no finite number")
            return result
        n = max(len(v) for v in lists)
        if any(len(v) not in (1, n) for v in lists):
            raise self.error(f"lists of {' and '.join(str(len(v)) for v in lists)} members do not go together")
        return [self.each(function, *((v[k % len(v)] if isinstance(v, list) else v) for v in values)) for k in range(n)]

    def member(self, value: Any, index: list[Any]) -> Any:
        """Return a member of a list, counted from 1; ``*`` stands for all of a row or a column."""
        for place, one in enumerate(index):
            if one == "*":
                rest = index[place + 1 :]
                if not isinstance(value, list):
                    raise self.error(f"{_shown(value)} is no list")
                return [self.member(row, rest) for row in value] if rest else value
            k = round(self.number(one))
            if not isinstance(value, list) or not 1 <= k <= len(value):
                raise self.error(f"there is no member {k} of {_shown(value)}")
            value = value[k - 1]
        return value

    def apply(self, operator: str, left: Any, right: Any) -> Any:
        """Return what an operator makes of two values."""
        if operator == "//":
            joined = text_of(left) + text_of(right)
            if len(joined) > LARGEST_TEXT:
                raise self.error(f"a text of more than {LARGEST_TEXT} characters")
            return joined
        if operator in ("==", "!="):
            return int(_same(left, right) == (operator == "=="))
        if isinstance(left, str) and isinstance(right, str) and operator in COMPARISONS:
            return int(COMPARISONS[operator](left, right))
        function = ARITHMETIC.get(operator) or COMPARISONS[operator]
        return self.each(function, left, right)


COMPARISONS: dict[str, Callable[[Any, Any], Any]] = {
    "<": lambda a, b: int(a < b), ">": lambda a, b: int(a > b), "<=": lambda a, b: int(a <= b),
    ">=": lambda a, b: int(a >= b),
}  # fmt: skip
ARITHMETIC: dict[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: float(a) * b if abs(a) > 1e9 or abs(b) > 1e9 else a * b,
    "/": lambda a, b: a / b,
    "%": math.fmod,
    "**": lambda a, b: float(a) ** float(b),
}


def _same(left: Any, right: Any) -> bool:
    if isinstance(left, Item) or isinstance(right, Item):
        names = [one.path if isinstance(one, Item) else one for one in (left, right)]
        return all(isinstance(one, str) for one in names) and names[0].lower() == names[1].lower()
    return bool(left == right)


def text_of(value: Any) -> str:
    """Return a value as a text."""
    if isinstance(value, Item):
        return value.path
    if isinstance(value, list):
        return ", ".join(text_of(one) for one in value)
    return value if isinstance(value, str) else f"{value:.10g}"


def _shown(value: Any) -> str:
    shown = f"a list of {len(value)}" if isinstance(value, list) else text_of(value)
    return shown if len(shown) < 60 else shown[:57] + "..."
