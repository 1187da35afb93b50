"""From the syntax of a function expression to operations of the tape; calls go to a table of functions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NoReturn

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.opcodes import ExpressionError, NotEvaluatedError
from gearmbs.dae.equations.expressions.tape import TapeBuilder
from gearmbs.mechanism.language.syntax import (
    Call,
    Chain,
    Name,
    NamedNumber,
    Negative,
    Node,
    Number,
    Power,
    Ref,
    Scope,
    Steps,
    innermost_first,
    parse,
    shown,
    unrolled,
)
from gearmbs.wording import did_you_mean

CONSTANTS = {"PI": math.pi, "DTOR": math.pi / 180.0, "RTOD": 180.0 / math.pi}

UNARY = {
    "ABS": op.ABS, "SQRT": op.SQRT, "EXP": op.EXP, "LOG": op.LOG, "LOG10": op.LOG10, "SIN": op.SIN, "COS": op.COS,
    "TAN": op.TAN, "ASIN": op.ASIN, "ACOS": op.ACOS, "ATAN": op.ATAN, "SINH": op.SINH, "COSH": op.COSH,
    "TANH": op.TANH, "AINT": op.AINT, "INT": op.AINT, "ANINT": op.ANINT, "NINT": op.ANINT,
}  # fmt: skip
BINARY = {"ATAN2": op.ATAN2, "MOD": op.MOD, "SIGN": op.SIGN, "DIM": op.DIM}
ELEMENT_FORCES = {
    "JOINT": "joint", "JPRIM": "jprim", "MOTION": "motion", "SFORCE": "sforce", "VFORCE": "vforce",
    "VTORQ": "vtorque", "GFORCE": "gforce", "BUSH": "bushing", "FIELD": "field", "SPDP": "springdamper",
    "GCON": "gcon", "COUPLER": "coupler", "GEAR": "gear", "BEAM": "beam", "FRICTION": "friction",
    "CONTACT": "contact", "PTCV": "ptcv", "CVCV": "cvcv",
}  # fmt: skip
ON_CURVES = ("ptcv", "cvcv")
"""Elements of several constraints, whose forces are put together when results are asked for."""
UNSUPPORTED = frozenset(
    "NFORCE CURVE INTERP INVPSD DELAY USER SENVAL MODE FXFREQ FXMODE "
    "UVX UVY UVZ DXYZ VXYZ WXYZ FXYZ TXYZ TRANS ARYSUM RANDOM".split()
)
"""Functions of ADAMS that exist but are not evaluated here."""
DEEPEST = 500
"""Expressions that name each other in a row: each of them is written with all behind it, so that time goes with the
square of their number, and these take some ten seconds."""
LONGEST_RING = 10
"""Expressions that name each other, of which a message names all."""


Function = tuple[Callable[["Lowering", Call], int], int, int]
"""A function of the language: what writes its call to the tape, least and most number of arguments."""


class _NamesError(Exception):
    """A call names another element's expression, which is to be written first."""

    def __init__(self, key: tuple[str, Ref], text: str) -> None:
        self.key, self.text = key, text


class Lowering:
    """Writes the syntax tree of one expression to a tape.

    Parameters
    ----------
    builder : TapeBuilder
    scope : Scope
    text : str
        The source, for messages.
    functions : mapping
        Functions of several arguments by name; see `gearmbs.mechanism.language.library`.
    """

    def __init__(self, builder: TapeBuilder, scope: Scope, text: str, functions: Mapping[str, Function]) -> None:
        self.builder = builder
        self.scope = scope
        self.text = text
        self.functions = functions
        self._open: list[tuple[str, Ref]] = []
        self._inlined: dict[tuple[str, Ref], int] = {}
        self._made: dict[int, int] = {}

    def fail(self, message: str, at: int) -> NoReturn:
        """Raise an ExpressionError that shows the place."""
        raise ExpressionError(f"{message} at column {at + 1} of {shown(self.text)}")

    # syntax tree -> registers

    def whole(self, root: Node) -> int:
        """Return the register of a whole tree, and before it of the expressions that it names, in a loop."""
        return unrolled(self._steps(root))

    def _steps(self, root: Node) -> Steps[int]:
        """Write a tree's functions and operations, from the innermost out."""
        outer, self._made = self._made, {}
        for part in innermost_first(root):
            while not isinstance(part, (Number, Name)) and id(part) not in self._made:
                try:
                    self._made[id(part)] = self._written(part)
                except _NamesError as names:
                    yield self._in_place(names.key, names.text)
        register = self.node(root)
        self._made = outer
        return register

    def _in_place(self, key: tuple[str, Ref], text: str) -> Steps[int]:
        """Write another element's expression."""
        self._open.append(key)
        outer, self.text = self.text, text
        self._inlined[key] = yield self._steps(parse(text))
        self.text = outer
        self._open.pop()
        return self._inlined[key]

    def node(self, node: Node) -> int:
        """Return the register of a node, the parts of which have theirs."""
        return self._made[id(node)] if id(node) in self._made else self._written(node)

    def _written(self, node: Node) -> int:
        if isinstance(node, Number):
            return self.builder.constant(node.value)
        if isinstance(node, Name):
            return self._name(node)
        if isinstance(node, Negative):
            return self.builder.unary(op.NEG, self.node(node.operand))
        if isinstance(node, Power):
            return self.guarded(node.at, lambda: self.builder.binary(op.POW, *self._both(node.base, node.exponent)))
        if isinstance(node, Chain):
            total = self.node(node.first)
            codes = {"+": op.ADD, "-": op.SUB, "*": op.MUL, "/": op.DIV}
            for symbol, operand in node.rest:
                right = self.node(operand)
                if symbol == "/" and self.builder.value_of(right) == 0.0:
                    self.fail("division by zero", node.at)
                total = self.guarded(node.at, self.builder.binary, codes[symbol], total, right)
            return total
        return self._call(node)

    def guarded(self, at: int, function: Callable[..., int], *args: int) -> int:
        """Call a builder method; an error gets the place of the failing part."""
        try:
            return function(*args)
        except ExpressionError as error:
            if "column" in str(error):
                raise
            self.fail(str(error), at)

    def _both(self, a: Node, b: Node) -> tuple[int, int]:
        return self.node(a), self.node(b)

    def _name(self, node: Name) -> int:
        if node.text == "TIME":
            return self.scaled(self.builder.time(), "time")
        if node.text in CONSTANTS:
            return self.builder.constant(CONSTANTS[node.text])
        number = self.scope.numbers.get(node.text)
        if number is not None:
            return self._number(number)
        named = ", ".join(n.name for n in self.scope.numbers.values())
        others = f", nor one of the inputs and parameters {named}," if named else ""
        self.fail(f"{node.text} is not TIME, PI, DTOR or RTOD{others} and stands where a value is expected", node.at)

    def _number(self, number: NamedNumber) -> int:
        """Return the register of an input or a parameter, in the expression's own units."""
        b = self.builder
        if number.known:
            register = b.algebraic(("number", number.name))
        else:
            register = (b.input if number.is_input else b.parameter)(number.name, number.value)
        return b.binary(op.MUL, b.constant(1.0 / number.factor), register)

    def _call(self, node: Call) -> int:
        name = node.name
        if name in UNARY:
            self.count(node, 1, 1)
            return self.guarded(node.at, self.builder.unary, UNARY[name], self.node(node.args[0]))
        if name in BINARY:
            self.count(node, 2, 2)
            return self.guarded(node.at, self.builder.binary, BINARY[name], *self._both(*node.args))
        if name in ELEMENT_FORCES:
            return self._element_force(node)
        if name in self.functions:
            function, low, high = self.functions[name]
            self.count(node, low, high)
            return self.guarded(node.at, lambda: function(self, node))
        if name in self.scope.functions:
            own = self.scope.functions[name]
            self.count(node, own.count, own.count)
            return self.builder.external(own.address, self.values(node))
        if name in UNSUPPORTED:
            message = f"the function {name} is not supported at column {node.at + 1} of {shown(self.text)}"
            raise NotEvaluatedError(message)
        known = [*UNARY, *BINARY, *ELEMENT_FORCES, *self.functions, *self.scope.functions]
        self.fail(f"unknown function {name}{did_you_mean(name, known, before='; ')}", node.at)

    def count(self, node: Call, low: int, high: int) -> None:
        """Check the number of arguments."""
        n = len(node.args)
        if not low <= n <= high:
            wanted = str(low) if low == high else f"{low} to {high}"
            self.fail(f"{node.name} takes {wanted} arguments, got {n}", node.at)

    # arguments

    def scaled(self, register: int, dimension: str) -> int:
        """Return an SI value in the expression's own units."""
        factor = 1.0 / self.scope.units.factors[dimension]
        return register if factor == 1.0 else self.builder.binary(op.MUL, self.builder.constant(factor), register)

    def ref(self, node: Node) -> Ref:
        """Return the id or name an argument stands for."""
        if isinstance(node, Number) and node.integer is not None:
            return node.integer
        if isinstance(node, Name):
            return node.text
        self.fail("expected the id or name of an element", node.at)

    def marker(self, call: Call, position: int) -> int:
        """Return the table index of a marker argument; absent or 0 is the global frame."""
        if position >= len(call.args):
            return op.GLOBAL
        node = call.args[position]
        ref = self.ref(node)
        if ref == 0:
            return op.GLOBAL
        if ref not in self.scope.markers:
            known = [name for name in self.scope.markers if isinstance(name, str)]
            self.fail(f"there is no MARKER {ref}{did_you_mean(ref, known, before='; ')}", node.at)
        if ref in self.scope.several:
            self.fail(f"several markers are called {ref}, in capitals or not; give each a name of its own", node.at)
        return int(self.scope.markers[ref])

    def literal(self, call: Call, position: int, low: int, high: int, default: int | None = None) -> int:
        """Return an integer argument within its range."""
        if position >= len(call.args) and default is not None:
            return default
        node = call.args[position]
        value = node.integer if isinstance(node, Number) else None
        if value is None or not low <= value <= high:
            self.fail(f"argument {position + 1} of {call.name} must be an integer from {low} to {high}", node.at)
        return value

    def values(self, call: Call) -> list[int]:
        """Return the registers of all arguments."""
        return [self.node(a) for a in call.args]

    def inline(self, kind: str, ref: Ref, text: str, at: int) -> int:
        """Write another element's expression in place, once."""
        key = (kind, ref)
        if key in self._inlined:
            return self._inlined[key]
        if key in self._open:
            ring = [f"{k.upper()}/{r}" for k, r in [*self._open[self._open.index(key) :], key]]
            if len(ring) > LONGEST_RING:
                ring[LONGEST_RING // 2 : -LONGEST_RING // 2] = ["..."]
            self.fail(f"{' -> '.join(ring)} depends on itself", at)
        if len(self._open) >= DEEPEST:
            self.fail(f"{kind.upper()} expressions refer to each other more than {DEEPEST} deep; join some of them", at)
        raise _NamesError(key, text)

    # forces of elements

    def force(self, kind: str, ref: Ref, base: int, rm: int, axis: int) -> int:
        """Return a component of an element's force (base 0 or 6) or torque (base 3 or 9)."""
        b = self.builder
        if base >= 6 and self.scope.one_sided:
            if axis == op.MAGNITUDE:
                return self.length([self.force(kind, ref, base, rm, a) for a in range(3)])
            opposite = b.unary(op.NEG, self.force(kind, ref, base - 6, rm, axis))
            return opposite if base == 6 else b.binary(op.SUB, opposite, self.shifted(kind, ref, rm, axis))
        if (kind, ref, base % 6) in self.scope.absent:
            return b.constant(0.0)
        keys = [(kind, ref, base + c) for c in range(3)]
        return self.scaled(b.force(keys, rm, axis), "torque" if base % 6 else "force")

    def shifted(self, kind: str, ref: Ref, rm: int, axis: int) -> int:
        """Return a component of (P_I - P_J) x F, F on the I marker: the torque of -F at P_I about J is its opposite."""
        b = self.builder
        i, j = (op.GLOBAL if m is None else self.scope.markers[m] for m in self.scope.forces[kind, ref])
        if i == j:
            return b.constant(0.0)
        arm = [self.scaled(b.vector(op.DISPLACEMENT, i, j, op.GLOBAL, rm, a), "length") for a in range(3)]
        force = [self.force(kind, ref, 0, rm, a) for a in range(3)]
        m, n = (axis + 1) % 3, (axis + 2) % 3
        return b.binary(op.SUB, b.binary(op.MUL, arm[m], force[n]), b.binary(op.MUL, arm[n], force[m]))

    def length(self, parts: list[int]) -> int:
        """Return the length of a vector of components."""
        result = parts[0]
        for other in parts[1:]:
            result = self.builder.binary(op.HYPOT, result, other)
        return result

    def _element_force(self, node: Call) -> int:
        self.count(node, 3, 4)
        kind = ELEMENT_FORCES[node.name]
        ref = self.ref(node.args[0])
        if (kind, ref) not in self.scope.forces:
            where = " here; it is known to a REQUEST only" if kind in ON_CURVES else ""
            self.fail(f"there is no {kind.upper()} {ref} whose force could be measured{where}", node.args[0].at)
        side = self.literal(node, 1, 0, 1)
        component = self.literal(node, 2, 1, 8)
        rm = self.marker(node, 3)
        base = 6 * side + (3 if component > 4 else 0)
        axis = op.MAGNITUDE if component in (1, 5) else (component - 2) % 4
        return self.force(kind, ref, base, rm, axis)

    def force_between(self, node: Call, torque: bool, axis: int) -> int:
        """Return FX ... TM: all forces on marker i from elements between markers i and j."""
        i, j = self.marker(node, 0), self.marker(node, 1)
        rm = self.marker(node, 2)
        shift = 3 if torque else 0
        found = []
        for (kind, ref), pair in self.scope.forces.items():
            if (kind, ref) in self.scope.aliases:
                continue
            first, second = (op.GLOBAL if m is None else self.scope.markers[m] for m in pair)
            if first == i and second == j:
                found.append((kind, ref, shift))
            elif first == j and second == i:
                found.append((kind, ref, shift + 6))
        if not found:
            refs = " and ".join(f"MARKER {self.ref(a)}" for a in node.args[:2])
            self.fail(f"no force or joint acts between {refs}", node.at)
        axes = (0, 1, 2) if axis == op.MAGNITUDE and len(found) > 1 else (axis,)
        sums = []
        for a in axes:
            total = self.builder.constant(0.0)
            for kind, ref, base in found:
                total = self.builder.binary(op.ADD, total, self.force(kind, ref, base, rm, a))
            sums.append(total)
        return self.length(sums)
