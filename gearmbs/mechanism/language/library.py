"""The functions of ADAMS's function language, written as operations of the tape."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import NoReturn

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.opcodes import ExpressionError, NotEvaluatedError
from gearmbs.dae.equations.expressions.tape import Tape, TapeBuilder
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
EULER_SEQUENCES = ("123", "231", "312", "132", "213", "321", "121", "131", "212", "232", "313", "323")
"""Body-fixed sequences of ORIENT's systems 1 to 12."""
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
        factor = 1.0 / self.scope.units.factor(dimension)
        return self.builder.binary(op.MUL, self.builder.constant(factor), register)

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


# ADAMS functions of several arguments: each is a function of the lowering and the call.


def _vector(code: int, dimension: str, axis: int, low: Lowering, call: Call) -> int:
    """DX, VX, WX, ACCX, WDTX (i, j, k, l) and their lengths DM, WM (i, j) and VM, ACCM, WDTM (i, j, l)."""
    last = 2 if axis == op.MAGNITUDE else 3
    i, j = low.marker(call, 0), low.marker(call, 1)
    k = op.GLOBAL if axis == op.MAGNITUDE else low.marker(call, 2)
    l = low.marker(call, last) if dimension in ("velocity", "acceleration") or code == op.ANGULAR_ACCELERATION else -1
    return low.scaled(low.builder.vector(code, i, j, l, k, axis), dimension)


def _radial_velocity(low: Lowering, call: Call) -> int:
    low.marker(call, 2)
    return low.scaled(low.builder.radial_velocity(low.marker(call, 0), low.marker(call, 1)), "velocity")


def _euler(low: Lowering, sequence: str, component: int, i: int, j: int) -> int:
    """Return an angle of a body-fixed sequence from the cosines R[r][c] = axis r of j . axis c of i."""
    b = low.builder
    a, m, c = (int(ch) - 1 for ch in sequence)

    def cosine(row: int, column: int) -> int:
        return b.cosine(i, column, j, row)

    def signed(positive: bool, register: int) -> int:
        return register if positive else b.unary(op.NEG, register)

    third = c if c != a else 3 - a - m
    even = (a, m, third) in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    if c != a:
        if component == 1:
            return b.binary(op.ATAN2, signed(not even, cosine(m, c)), cosine(c, c))
        if component == 2:
            length = b.binary(op.HYPOT, cosine(a, a), cosine(a, m))
            return b.binary(op.ATAN2, signed(even, cosine(a, c)), length)
        return b.binary(op.ATAN2, signed(not even, cosine(a, m)), cosine(a, a))
    if component == 1:
        return b.binary(op.ATAN2, cosine(m, a), signed(not even, cosine(third, a)))
    if component == 2:
        return b.binary(op.ATAN2, b.binary(op.HYPOT, cosine(m, a), cosine(third, a)), cosine(a, a))
    return b.binary(op.ATAN2, cosine(a, m), signed(even, cosine(a, third)))


def _sequence_angle(sequence: str, component: int, sign: int, low: Lowering, call: Call) -> int:
    """PSI, THETA, PHI (3-1-3) and YAW, PITCH, ROLL (3-2-1, pitch about the negative y axis)."""
    angle = _euler(low, sequence, component, low.marker(call, 0), low.marker(call, 1))
    return angle if sign > 0 else low.builder.unary(op.NEG, angle)


def _axis_angle(axis: int, low: Lowering, call: Call) -> int:
    """AX, AY, AZ: the turn of marker i about an axis of marker j, counted through full turns."""
    b = low.builder
    i, j = low.marker(call, 0), low.marker(call, 1)
    if axis == 0:
        angle = b.binary(op.ATAN2, b.unary(op.NEG, b.cosine(i, 2, j, 1)), b.cosine(i, 2, j, 2))
    elif axis == 1:
        angle = b.binary(op.ATAN2, b.cosine(i, 2, j, 0), b.cosine(i, 2, j, 2))
    else:
        angle = b.binary(op.ATAN2, b.cosine(i, 0, j, 1), b.cosine(i, 0, j, 0))
    return b.wound(angle, ("AXAYAZ"[2 * axis : 2 * axis + 2], i, j))


def _included_angle(low: Lowering, call: Call) -> int:
    """INCANG(i, j, k): the angle at marker j between the lines to i and to k, 0 to pi."""
    b = low.builder
    i, j, k = (low.marker(call, n) for n in range(3))
    if i == j or k == j:
        low.fail("INCANG needs a vertex apart from the two other markers", call.at)

    def line(end: int) -> list[int]:
        return [b.vector(op.DISPLACEMENT, end, j, -1, op.GLOBAL, axis) for axis in range(3)]

    def product(x: int, y: int) -> int:
        return b.binary(op.MUL, x, y)

    u, v = line(i), line(k)
    dot = b.binary(op.ADD, b.binary(op.ADD, product(u[0], v[0]), product(u[1], v[1])), product(u[2], v[2]))
    cross = [b.binary(op.SUB, product(u[a], v[c]), product(u[c], v[a])) for a, c in ((1, 2), (2, 0), (0, 1))]
    return b.binary(op.ATAN2, b.binary(op.HYPOT, b.binary(op.HYPOT, cross[0], cross[1]), cross[2]), dot)


def _orient(low: Lowering, call: Call) -> int:
    system = low.literal(call, 0, 1, 27)
    i, j = low.marker(call, 2), low.marker(call, 3)
    if system == 27:
        return low.builder.euler_parameter(i, j, low.literal(call, 1, 1, 4) - 1)
    if system > 12:
        low.fail(f"ORIENT's system {system} is not supported; 1 to 12 and 27 are", call.at)
    return _euler(low, EULER_SEQUENCES[system - 1], low.literal(call, 1, 1, 3), i, j)


def _ramp(low: Lowering, call: Call, x: int, x0: int, x1: int) -> int:
    """Return (x - x0)/(x1 - x0)."""
    b = low.builder
    width = b.binary(op.SUB, x1, x0)
    if b.value_of(width) == 0.0:
        low.fail(f"{call.name} needs x1 different from x0", call.at)
    return b.binary(op.DIV, b.binary(op.SUB, x, x0), width)


def _smooth(code: int, low: Lowering, call: Call) -> int:
    """STEP, STEP5, HAVSIN (x, x0, h0, x1, h1) = h0 + (h1 - h0) S((x - x0)/(x1 - x0))."""
    b = low.builder
    x, x0, h0, x1, h1 = low.values(call)
    s = b.unary(code, _ramp(low, call, x, x0, x1))
    return b.binary(op.ADD, h0, b.binary(op.MUL, b.binary(op.SUB, h1, h0), s))


def _contact(low: Lowering, penetration: int, rate: int, k: int, e: int, c: int, d: int) -> int:
    """Return max(0, k p^e + c p' S(p/d)) for p > 0, else 0, with ``rate`` = p'."""
    b = low.builder
    elastic = b.binary(op.MUL, k, b.binary(op.POSITIVE_POWER, penetration, e))
    if b.value_of(d) == 0.0:
        step = b.unary(op.UNIT_STEP, penetration)
    else:
        step = b.unary(op.STEP01, b.binary(op.DIV, penetration, d))
    damping = b.binary(op.MUL, b.binary(op.MUL, c, rate), step)
    return b.unary(op.POSITIVE_PART, b.binary(op.ADD, elastic, damping))


def _impact(low: Lowering, call: Call) -> int:
    """IMPACT(q, q', q1, k, e, cmax, d): a one-sided stop for q < q1."""
    q, rate, q1, k, e, c, d = low.values(call)
    b = low.builder
    return _contact(low, b.binary(op.SUB, q1, q), b.unary(op.NEG, rate), k, e, c, d)


def _bistop(low: Lowering, call: Call) -> int:
    """BISTOP(q, q', q1, q2, k, e, cmax, d): free between q1 and q2."""
    q, rate, q1, q2, k, e, c, d = low.values(call)
    b = low.builder
    lower = _contact(low, b.binary(op.SUB, q1, q), b.unary(op.NEG, rate), k, e, c, d)
    upper = _contact(low, b.binary(op.SUB, q, q2), rate, k, e, c, d)
    return b.binary(op.SUB, lower, upper)


def _if(low: Lowering, call: Call) -> int:
    return low.builder.select(*low.values(call))


def _extreme(code: int, low: Lowering, call: Call) -> int:
    result, *rest = low.values(call)
    for other in rest:
        result = low.builder.binary(code, result, other)
    return result


def _poly(low: Lowering, call: Call) -> int:
    """POLY(x, x0, a0, a1, ...) by Horner's rule."""
    b = low.builder
    x, x0, *coefficients = low.values(call)
    u = b.binary(op.SUB, x, x0)
    total = coefficients[-1]
    for a in reversed(coefficients[:-1]):
        total = b.binary(op.ADD, a, b.binary(op.MUL, u, total))
    return total


def _cheby(low: Lowering, call: Call) -> int:
    """CHEBY(x, x0, a0, a1, ...) = sum a_j T_j(x - x0)."""
    b = low.builder
    x, x0, *coefficients = low.values(call)
    u = b.binary(op.SUB, x, x0)
    twice = b.binary(op.MUL, b.constant(2.0), u)
    previous, current = b.constant(1.0), u
    total = coefficients[0]
    for a in coefficients[1:]:
        total = b.binary(op.ADD, total, b.binary(op.MUL, a, current))
        previous, current = current, b.binary(op.SUB, b.binary(op.MUL, twice, current), previous)
    return total


def _fourier(code: int, low: Lowering, call: Call) -> int:
    """FORCOS, FORSIN(x, x0, w, a0, a1, ...) = a0 + sum a_j cos|sin(j w (x - x0))."""
    b = low.builder
    x, x0, w, *coefficients = low.values(call)
    u = b.binary(op.MUL, w, b.binary(op.SUB, x, x0))
    total = coefficients[0]
    for j, a in enumerate(coefficients[1:], 1):
        wave = b.unary(code, b.binary(op.MUL, b.constant(float(j)), u))
        total = b.binary(op.ADD, total, b.binary(op.MUL, a, wave))
    return total


def _shf(low: Lowering, call: Call) -> int:
    """SHF(x, x0, a, w, phi, b) = a sin(w (x - x0) - phi) + b."""
    b = low.builder
    values = low.values(call) + [b.constant(0.0)]
    x, x0, a, w, phi, offset = values[:6]
    u = b.binary(op.SUB, b.binary(op.MUL, w, b.binary(op.SUB, x, x0)), phi)
    return b.binary(op.ADD, b.binary(op.MUL, a, b.unary(op.SIN, u)), offset)


def _sweep(low: Lowering, call: Call) -> int:
    """SWEEP(x, a, x0, f0, x1, f1, dx): the phase f0 x + (f1 - f0)(<x - x0>^2 - <x - x1>^2)/(2(x1 - x0)) in cycles."""
    b = low.builder
    x, a, x0, f0, x1, f1, dx = low.values(call)
    width = b.binary(op.SUB, x1, x0)
    if b.value_of(width) == 0.0 or b.value_of(dx) == 0.0:
        low.fail("SWEEP needs x1 different from x0 and dx greater than 0", call.at)
    squares = [b.unary(op.POWER_INT, b.unary(op.POSITIVE_PART, b.binary(op.SUB, x, v)), 2) for v in (x0, x1)]
    ramp = b.binary(op.DIV, b.binary(op.SUB, *squares), b.binary(op.MUL, b.constant(2.0), width))
    cycles = b.binary(op.ADD, b.binary(op.MUL, f0, x), b.binary(op.MUL, b.binary(op.SUB, f1, f0), ramp))
    wave = b.unary(op.SIN, b.binary(op.MUL, b.constant(2.0 * math.pi), cycles))
    fade = b.unary(op.STEP5_01, b.binary(op.DIV, b.binary(op.SUB, x, x0), dx))
    return b.binary(op.MUL, b.binary(op.MUL, a, wave), fade)


def _spline(method: str, low: Lowering, call: Call) -> int:
    """CUBSPL, AKISPL(x, z, id, order)."""
    ref = low.ref(call.args[2])
    if ref not in low.scope.splines:
        low.fail(f"there is no SPLINE {ref}", call.args[2].at)
    data = low.scope.splines[ref]
    order = low.literal(call, 3, 0, 2, 0)
    if order and len(data.y) > 1:
        low.fail(f"SPLINE {ref} is a surface; {call.name} gives derivatives of single curves only", call.at)
    return low.builder.spline(data, method, order, low.node(call.args[0]), low.node(call.args[1]))


def _integral(low: Lowering, call: Call) -> int:
    """INTEGRAL(f, start, end): the integral of a function of TIME from ``start``; no function of ADAMS.

    ``end`` says how far it is tabulated beforehand.
    """
    b = low.builder
    value, *span = low.values(call)
    start, end = (b.value_of(r) for r in span)
    if start is None or end is None:
        low.fail("the span of INTEGRAL must be constant", call.at)
    seconds = low.scope.units.time
    return b.binary(op.DIV, b.integral(value, start * seconds, end * seconds), b.constant(seconds))


def _variable(low: Lowering, call: Call, ref: Ref | None = None) -> int:
    ref = low.ref(call.args[0]) if ref is None else ref
    if ref in low.scope.states:
        return low.builder.algebraic(("variable", ref))
    if ref not in low.scope.variables:
        low.fail(f"there is no VARIABLE {ref}", call.args[0].at)
    return low.inline("variable", ref, low.scope.variables[ref], call.at)


def _diff(low: Lowering, call: Call) -> int:
    ref = low.ref(call.args[0])
    if ref not in low.scope.diffs:
        low.fail(f"there is no DIFF {ref}", call.args[0].at)
    return low.builder.algebraic(("diff", ref))


def _diff_rate(low: Lowering, call: Call) -> int:
    ref = low.ref(call.args[0])
    if ref not in low.scope.diffs:
        low.fail(f"there is no DIFF {ref}", call.args[0].at)
    text = low.scope.diffs[ref]
    if text is None:
        return low.scaled(low.builder.algebraic(("diff1", ref)), "rate")
    return low.inline("diff", ref, text, call.at)


def _modal(rate: bool, low: Lowering, call: Call) -> int:
    """MODAL(body, k), MODAL1(body, k): the k-th modal coordinate of a body and its rate; no functions of ADAMS."""
    ref = low.ref(call.args[0])
    if ref not in low.scope.modes:
        known = ", ".join(str(name) for name in low.scope.modes) or "none"
        low.fail(f"there is no body {ref} with modes; those with modes: {known}", call.args[0].at)
    key = ("mode1" if rate else "mode", ref, low.literal(call, 1, 1, low.scope.modes[ref]) - 1)
    found = low.builder.algebraic(key)
    return low.scaled(found, "rate") if rate else found


def _array(low: Lowering, call: Call) -> int:
    ref = low.ref(call.args[0])
    if ref not in low.scope.arrays:
        low.fail(f"there is no ARRAY {ref} of numbers", call.args[0].at)
    values = low.scope.arrays[ref]
    return low.builder.constant(float(values[low.literal(call, 1, 1, len(values)) - 1]))


def _plant(kind: str, low: Lowering, call: Call) -> int:
    ref = low.ref(call.args[0])
    if (kind, ref) not in low.scope.plants:
        low.fail(f"there is no {kind.upper()} {ref}", call.args[0].at)
    members = low.scope.plants[kind, ref]
    return _variable(low, call, members[low.literal(call, 1, 1, len(members)) - 1])


def _between(torque: bool, axis: int, low: Lowering, call: Call) -> int:
    return low.force_between(call, torque, axis)


def _table() -> dict[str, Function]:
    functions: dict[str, Function] = {}
    vectors = (
        ("D", "", op.DISPLACEMENT, "length", 3),
        ("V", "", op.VELOCITY, "velocity", 4),
        ("W", "", op.ANGULAR_VELOCITY, "angular_velocity", 3),
        ("ACC", "", op.ACCELERATION, "acceleration", 4),
        ("WDT", "", op.ANGULAR_ACCELERATION, "angular_acceleration", 4),
    )
    for prefix, _, code, dimension, most in vectors:
        for axis, letter in enumerate("XYZ"):
            functions[prefix + letter] = (partial(_vector, code, dimension, axis), 1, most)
        functions[prefix + "M"] = (partial(_vector, code, dimension, op.MAGNITUDE), 1, most - 1)
    for axis, letter in enumerate("XYZ"):
        functions["A" + letter] = (partial(_axis_angle, axis), 1, 2)
        functions["F" + letter] = (partial(_between, False, axis), 1, 3)
        functions["T" + letter] = (partial(_between, True, axis), 1, 3)
    functions["FM"] = (partial(_between, False, op.MAGNITUDE), 1, 2)
    functions["TM"] = (partial(_between, True, op.MAGNITUDE), 1, 2)
    for component, (euler, cardan) in enumerate((("PSI", "YAW"), ("THETA", "PITCH"), ("PHI", "ROLL")), 1):
        functions[euler] = (partial(_sequence_angle, "313", component, 1), 1, 2)
        functions[cardan] = (partial(_sequence_angle, "321", component, -1 if component == 2 else 1), 1, 2)
    for name, code in (("STEP", op.STEP01), ("STEP5", op.STEP5_01), ("HAVSIN", op.HAVERSINE01)):
        functions[name] = (partial(_smooth, code), 5, 5)
    for name, method in (("CUBSPL", "cubic"), ("AKISPL", "akima")):
        functions[name] = (partial(_spline, method), 3, 4)
    functions |= {
        "VR": (_radial_velocity, 1, 3),
        "ORIENT": (_orient, 3, 4),
        "INCANG": (_included_angle, 3, 3),
        "IMPACT": (_impact, 7, 7),
        "BISTOP": (_bistop, 8, 8),
        "IF": (_if, 4, 4),
        "MIN": (partial(_extreme, op.MIN), 2, 60),
        "MAX": (partial(_extreme, op.MAX), 2, 60),
        "POLY": (_poly, 3, 33),
        "CHEBY": (_cheby, 3, 33),
        "FORCOS": (partial(_fourier, op.COS), 4, 34),
        "FORSIN": (partial(_fourier, op.SIN), 4, 34),
        "SHF": (_shf, 5, 6),
        "SWEEP": (_sweep, 7, 7),
        "INTEGRAL": (_integral, 3, 3),
        "VARVAL": (_variable, 1, 1),
        "DIF": (_diff, 1, 1),
        "DIF1": (_diff_rate, 1, 1),
        "MODAL": (partial(_modal, False), 2, 2),
        "MODAL1": (partial(_modal, True), 2, 2),
        "ARYVAL": (_array, 2, 2),
        "PINVAL": (partial(_plant, "pinput"), 2, 2),
        "POUVAL": (partial(_plant, "poutput"), 2, 2),
    }
    return functions


FUNCTIONS = _table()
"""Name -> (function, least, most number of arguments)."""


def known_functions() -> frozenset[str]:
    """Return the names of all functions of the language, those that are not evaluated here among them."""
    return frozenset((*UNARY, *BINARY, *ELEMENT_FORCES, *FUNCTIONS, *UNSUPPORTED))


# From a function expression to a tape: ``compile_expression``.


def compile_expression(
    text: str, scope: Scope, dimension: str = "number", accelerations: bool = False, outline: bool = False
) -> Tape:
    """Compile a function expression to a tape that returns SI values.

    Parameters
    ----------
    text : str
        The expression, in the units of ``scope.units``.
    scope : Scope
    dimension : str
        What the value is ("force", "torque", "length", "angle", ...): its unit is converted to SI.
    accelerations : bool
        Allow ACCX, WDTX and their kin: only requests know accelerations.
    outline : bool
        Leave integrals without their tables: the tape shows what the expression depends on and is not to be evaluated.

    Returns
    -------
    Tape

    Raises
    ------
    ExpressionError
        When the text is malformed or names something the scope does not hold.
    """
    builder = TapeBuilder(scope.marker_body, outline)
    lowering = Lowering(builder, scope, text, FUNCTIONS)
    result = lowering.whole(parse(text))
    result = builder.binary(op.MUL, builder.constant(scope.units.factor(dimension)), result)
    tape = builder.finish(result, text)
    if tape.level == op.LEVEL_ACCELERATION and not accelerations:
        raise NotEvaluatedError(
            f"accelerations can be measured, and forces and equations of a deck may ask for them, not {shown(text)}"
        )
    return tape
