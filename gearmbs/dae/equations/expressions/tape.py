"""The tape as a value, and the builder that writes it instruction by instruction."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.integrals import integral_table, time_value
from gearmbs.dae.equations.expressions.measure_hessians import SECOND_WORK
from gearmbs.dae.equations.expressions.measures import LEAF_WORK
from gearmbs.dae.equations.expressions.opcodes import ExpressionError
from gearmbs.dae.equations.expressions.scalar import binary_python, unary_python
from gearmbs.dae.equations.expressions.splines import SplineData, spline_table

_LEAF_LEVEL = {
    op.CONST: op.LEVEL_CONSTANT,
    op.TIME: op.LEVEL_TIME,
    op.DISPLACEMENT: op.LEVEL_POSITION,
    op.COSINE: op.LEVEL_POSITION,
    op.EULER_PARAMETER: op.LEVEL_POSITION,
    op.VELOCITY: op.LEVEL_VELOCITY,
    op.ANGULAR_VELOCITY: op.LEVEL_VELOCITY,
    op.RADIAL_VELOCITY: op.LEVEL_VELOCITY,
    op.ALGEBRAIC: op.LEVEL_ALGEBRAIC,
    op.FORCE: op.LEVEL_ALGEBRAIC,
    op.ACCELERATION: op.LEVEL_ACCELERATION,
    op.ANGULAR_ACCELERATION: op.LEVEL_ACCELERATION,
}

UNPLACED = (op.CONST, op.TIME, op.ALGEBRAIC, op.FORCE)
"""Leaves that do not begin with a marker."""

AlgebraicKey = tuple[Hashable, ...]
"""Name of an algebraic unknown, for instance ("joint", 1, 3) or ("diff", 2)."""

AngleKey = tuple[str, int, int]
"""Name of a counted angle: function and indices of the markers I and J."""

NumberKey = tuple[str, int, int]
"""A named number: its name, its place among the floats, the coefficients behind it."""


@dataclass(frozen=True)
class Tape:
    """A compiled expression: the flat tables the kernels read, and what it depends on.

    Attributes
    ----------
    ints, floats : ndarray
        Tables for the kernels in ``gearmbs.dae.equations.expressions``.
    bodies : tuple of int
        Rows of the kinematics table in the order of the gradient's blocks of twelve.
    algebraic : tuple of AlgebraicKey
        Algebraic unknowns in the order of the gradient's tail; ``bind`` gives them indices into y.
    n_angles : int
        Entries of the array of reference angles.
    level : int
        The highest of the LEVEL_ constants among the leaves the value depends on.
    second_order : bool
        Whether ``eval_second`` may be used: only TIME and position-level leaves with a Hessian.
    text : str
        The source.
    integrates : bool
        Whether the value holds an integral over time.
    angles : tuple
        Names of the counted angles, in the order of the array of reference angles.
    numbers : tuple
        Named numbers that it depends on: name, place among ``floats``, how many coefficients stand behind it.
    """

    ints: np.ndarray
    floats: np.ndarray
    bodies: tuple[int, ...]
    algebraic: tuple[AlgebraicKey, ...]
    n_angles: int
    level: int
    second_order: bool
    text: str = ""
    integrates: bool = False
    angles: tuple[AngleKey, ...] = ()
    numbers: tuple[NumberKey, ...] = ()

    @property
    def length(self) -> int:
        """Number of instructions."""
        return int(self.ints[op.HEAD_COUNT])

    @property
    def first_marker(self) -> int:
        """Index of the first marker that a measure names, -1 without one: where a constraint's reaction is told."""
        code = self.ints[self.ints[op.HEAD_CODE] :][: op.WIDTH * self.length].reshape(-1, op.WIDTH)
        named = [int(c[1]) for c in code if c[0] <= op.LAST_LEAF and c[0] not in UNPLACED and c[1] >= 0]
        return named[0] if named else -1

    @property
    def gradient_size(self) -> int:
        """Length of ``eval_gradient``'s result: 12 a body and one an algebraic unknown."""
        return 12 * len(self.bodies) + len(self.algebraic)

    @property
    def second_size(self) -> int:
        """Number n of coordinates of ``eval_second``: 6 a body, and time."""
        return 6 * len(self.bodies) + 1

    @property
    def work_size(self) -> int:
        """Scratch that suffices for every evaluator the tape may be used with."""
        n = self.length
        size = 4 * n + LEAF_WORK
        external = int(self.ints[op.HEAD_EXTERNAL])
        if self.second_order:
            c = self.second_size
            size = max(size, 7 * n + n * c + SECOND_WORK)
        return size + external + (n if self.integrates else 0)

    @property
    def constant(self) -> float | None:
        """The value when the expression is a constant, else None."""
        if self.level != op.LEVEL_CONSTANT or self.numbers:
            return None
        at = self.ints[op.HEAD_CODE] + op.WIDTH * self.ints[op.HEAD_RESULT]
        return float(self.floats[self.ints[at + 1]])

    def bind(self, index_of: Callable[[AlgebraicKey], int]) -> Tape:
        """Return the tape with the algebraic unknowns' indices into y filled in."""
        ints = self.ints.copy()
        at = ints[op.HEAD_ALGEBRAIC_LIST]
        for q, key in enumerate(self.algebraic):
            ints[at + q] = index_of(key)
        return replace(self, ints=ints)


class TapeBuilder:
    """Collect instructions; equal ones are shared and constant ones folded.

    Parameters
    ----------
    marker_body : sequence of int
        Row of the kinematics table of every marker.
    outline : bool
        Leave integrals without their tables; the tape cannot be evaluated then.
    """

    def __init__(self, marker_body: Sequence[int], outline: bool = False) -> None:
        self._outline = outline
        self._marker_body = marker_body
        self._code: list[tuple[int, ...]] = []
        self._known: dict[tuple[int, ...], int] = {}
        self._floats: list[float] = []
        self._constants: dict[tuple[float, float], int] = {}
        self._spline_at: dict[tuple[SplineData, str], int] = {}
        self._algebraic: dict[AlgebraicKey, int] = {}
        self._angles: list[AngleKey] = []
        self._numbers: dict[str, tuple[int, int, int]] = {}

    def _emit(self, *instruction: int) -> int:
        key = tuple(instruction)
        if key in self._known:
            return self._known[key]
        self._code.append(key)
        self._known[key] = len(self._code) - 1
        return self._known[key]

    def constant(self, value: float) -> int:
        """Return the register of a constant."""
        key = (value, math.copysign(1.0, value))
        if key not in self._constants:
            self._constants[key] = len(self._floats)
            self._floats.append(float(value))
        return self._emit(op.CONST, self._constants[key])

    def value_of(self, register: int) -> float | None:
        """Return the value of a constant register, else None: named numbers are constant until they are set."""
        code = self._code[register]
        if code[0] != op.CONST or any(at <= code[1] <= at + size for _, at, size in self._numbers.values()):
            return None
        return self._floats[code[1]]

    def parameter(self, name: str, value: float) -> int:
        """Return the register of a number that is changed by its name."""
        if name not in self._numbers:
            at = len(self._floats)
            self._floats.append(float(value))
            self._numbers[name] = (-1, at, 0)
            self._numbers[name] = (self._emit(op.CONST, at), at, 0)
        return self._numbers[name][0]

    def input(self, name: str, value: float) -> int:
        """Return the register of an input, u_0 + u_1 (t - t_0); see `gearmbs.dae.problem`."""
        if name not in self._numbers:
            at = len(self._floats)
            self._floats.extend([0.0, float(value), 0.0])
            self._numbers[name] = (-1, at, 2)
            origin, level, slope = (self._emit(op.CONST, at + k) for k in range(3))
            passed = self.binary(op.SUB, self.time(), origin)
            register = self.binary(op.ADD, level, self.binary(op.MUL, slope, passed))
            self._numbers[name] = (register, at, 2)
        return self._numbers[name][0]

    def time(self) -> int:
        """Return the register of t."""
        return self._emit(op.TIME)

    def unary(self, code: int, a: int, parameter: int = 0) -> int:
        """Return the register of a one-operand operation."""
        value = self.value_of(a)
        if value is not None and code not in (op.UNWRAP, op.INTEGRAL):
            return self.constant(self._fold(unary_python, code, value, float(parameter)))
        if code == op.NEG and self._code[a][0] == op.NEG:
            return self._code[a][1]
        return self._emit(code, a, parameter)

    def binary(self, code: int, a: int, b: int) -> int:
        """Return the register of a two-operand operation."""
        va, vb = self.value_of(a), self.value_of(b)
        if va is not None and vb is not None:
            return self.constant(self._fold(binary_python, code, va, vb))
        if code == op.MUL:
            if va == 1.0:
                return b
            if vb == 1.0:
                return a
            if va == 0.0 or vb == 0.0:
                return self.constant(0.0)
        if code == op.ADD:
            if va == 0.0:
                return b
            if vb == 0.0:
                return a
        if code == op.SUB:
            if vb == 0.0:
                return a
            if va == 0.0:
                return self.unary(op.NEG, b)
        if code == op.DIV and vb == 1.0:
            return a
        if code == op.POW and vb is not None and vb == math.floor(vb) and abs(vb) <= 64:
            return self.unary(op.POWER_INT, a, int(vb))
        return self._emit(code, a, b)

    def select(self, condition: int, negative: int, zero: int, positive: int) -> int:
        """Return the register of IF(condition: negative, zero, positive)."""
        value = self.value_of(condition)
        if value is not None:
            return negative if value < 0.0 else (positive if value > 0.0 else zero)
        if negative == zero == positive:
            return negative
        return self._emit(op.SELECT, condition, negative, zero, positive)

    def spline(self, data: SplineData, method: str, order: int, x: int, z: int) -> int:
        """Return the register of a spline's value or x derivative."""
        key = (data, method)
        if key not in self._spline_at:
            table = spline_table(data, method)
            if not np.all(np.isfinite(table)):
                raise ExpressionError("a spline's points are too close or too large to interpolate")
            self._spline_at[key] = len(self._floats)
            self._floats.extend(table.tolist())
        return self._emit(op.SPLINE, x, z, self._spline_at[key], order)

    def vector(self, code: int, i: int, j: int, l: int, k: int, axis: int) -> int:
        """Return the register of a vector leaf's component (or its length, ``axis`` 3)."""
        return self._emit(code, i, j, l, k, axis)

    def cosine(self, i: int, a: int, j: int, b: int) -> int:
        """Return the register of the cosine of axis ``a`` of marker i and axis ``b`` of marker j."""
        if (i == op.GLOBAL and j == op.GLOBAL) or i == j:
            return self.constant(1.0 if a == b else 0.0)
        return self._emit(op.COSINE, i, a, j, b)

    def radial_velocity(self, i: int, j: int) -> int:
        """Return the register of VR between two markers."""
        return self._emit(op.RADIAL_VELOCITY, i, j)

    def euler_parameter(self, i: int, j: int, component: int) -> int:
        """Return the register of an Euler parameter of marker i in marker j."""
        return self._emit(op.EULER_PARAMETER, i, j, component)

    def _algebraic_slot(self, key: AlgebraicKey) -> int:
        return self._algebraic.setdefault(key, len(self._algebraic))

    def algebraic(self, key: AlgebraicKey) -> int:
        """Return the register of an algebraic unknown."""
        return self._emit(op.ALGEBRAIC, self._algebraic_slot(key))

    def force(self, keys: Sequence[AlgebraicKey], k: int, axis: int) -> int:
        """Return the register of a component in marker k of the vector of three algebraic unknowns."""
        for key in keys:
            self._algebraic_slot(key)
        slots = [self._algebraic[key] for key in keys]
        if slots != list(range(slots[0], slots[0] + 3)):
            raise ExpressionError(f"the components {keys} are not stored together")
        return self._emit(op.FORCE, slots[0], 0, 0, k, axis)

    def external(self, address: int, arguments: Sequence[int]) -> int:
        """Return the register of a function of the user, called through its address.

        Parameters
        ----------
        address : int
            Of a C function as of `gearmbs.kernels.pointers`, called as f(t, a, a, order, out) with the
            arguments in a; out receives the value, and for order 1 the partials behind it, for order 2 the first and
            second derivative by the first argument, for order 3 the partials and the matrix of second ones.
        arguments : sequence of int
            Registers.
        """
        return self._emit(op.EXTERNAL, address, *arguments)

    def wound(self, a: int, key: AngleKey) -> int:
        """Return the register of an angle continued through full turns; ``key`` goes to ``Tape.angles``."""
        for register, code in enumerate(self._code):
            if code[0] == op.UNWRAP and code[1] == a:
                return register
        self._angles.append(key)
        return self._emit(op.UNWRAP, a, len(self._angles) - 1)

    def integral(self, a: int, start: float, end: float) -> int:
        """Return the register of the integral of a function of time from ``start`` to t.

        Parameters
        ----------
        a : int
            Register of the function.
        start, end : float
            Span over which the integral is tabulated; later times take longer to evaluate.
        """
        tape = self.finish(a)
        if tape.level > op.LEVEL_TIME or tape.integrates:
            raise ExpressionError("only a function of TIME, itself without an integral, can be integrated")
        if tape.numbers:
            raise ExpressionError(
                f"the integral of {tape.numbers[0][0]!r}, which may change, is not known beforehand; add a state with "
                "that rate, or let the input itself be the velocity of a motion"
            )
        if not end > start:
            raise ExpressionError(f"the end {end} of the span must be later than its start {start}")
        if self._outline:
            return self._emit(op.INTEGRAL, a, 0)
        work = np.zeros(tape.work_size)
        register = int(tape.ints[op.HEAD_RESULT])

        def values(times: np.ndarray) -> np.ndarray:
            return np.array([time_value(tape.ints, tape.floats, t, register, work) for t in times])

        table = integral_table(values, start, end)
        if not np.all(np.isfinite(table)):
            raise ExpressionError("the function is not finite over the span")
        at = len(self._floats)
        self._floats.extend(table.tolist())
        return self._emit(op.INTEGRAL, a, at)

    def finish(self, result: int, text: str = "") -> Tape:
        """Return the tape with ``result`` as its value; instructions it does not need are dropped."""
        if len(self._code) > 200_000:
            raise ExpressionError(f"the expression expands to {len(self._code)} operations; simplify it")
        needed = self._needed(result)
        renumber = {old: new for new, old in enumerate(needed)}
        used = [self._code[r] for r in needed]
        angle_slot = {c[2]: s for s, c in enumerate(c for c in used if c[0] == op.UNWRAP)}
        bodies = sorted({b for c in used for b in self._bodies_of(c) if b > 0})
        body_slot = {b: s for s, b in enumerate(bodies)}
        keys = tuple(self._algebraic)
        code = np.zeros((len(used), op.WIDTH), dtype=np.int64)
        listed: list[int] = []
        scratch = 0
        code_at = op.HEAD_SIZE + len(bodies) + len(self._algebraic)
        for row, c in zip(code, used):
            if c[0] == op.EXTERNAL:
                count = len(c) - 2
                row[:5] = op.EXTERNAL, code_at + code.size + len(listed), count, scratch, c[1]
                row[5:] = -1
                listed += [renumber[a] for a in c[2:]]
                scratch += count + op.external_results(count)
                continue
            row[: len(c)] = c
            row[6:] = -1
            if c[0] <= op.LAST_LEAF:
                slots = [body_slot.get(b, -1) for b in self._bodies_of(c)]
                row[6 : 6 + len(slots)] = slots
            else:
                for operand in _operands(c):
                    row[operand] = renumber[c[operand]]
                if c[0] == op.UNWRAP:
                    row[2] = angle_slot[c[2]]
        levels = [_LEAF_LEVEL[c[0]] for c in used if c[0] <= op.LAST_LEAF]
        if any(c[0] == op.INTEGRAL for c in used):
            levels.append(op.LEVEL_TIME)
        smooth = {op.CONST, op.TIME, op.DISPLACEMENT, op.COSINE}
        constants = {c[1] for c in used if c[0] == op.CONST}
        body_at = op.HEAD_SIZE
        algebraic_at = body_at + len(bodies)
        header = [
            len(used), renumber[result], len(bodies), len(keys), body_at, algebraic_at, code_at, len(angle_slot),
            scratch,
        ]  # fmt: skip
        begin = np.array(header + bodies + [-1] * len(keys), dtype=np.int64)
        ints = np.concatenate([begin, code.ravel(), np.array(listed, dtype=np.int64)])
        return Tape(
            ints=ints,
            floats=np.array(self._floats or [0.0]),
            bodies=tuple(bodies),
            algebraic=keys,
            n_angles=len(angle_slot),
            level=max(levels, default=op.LEVEL_CONSTANT),
            second_order=all(c[0] in smooth for c in used if c[0] <= op.LAST_LEAF)
            and all(len(c) - 2 <= op.MOST_SECOND for c in used if c[0] == op.EXTERNAL),
            text=text,
            integrates=any(c[0] == op.INTEGRAL for c in used),
            angles=tuple(self._angles[a] for a in angle_slot),
            numbers=tuple((name, at, size) for name, (_, at, size) in self._numbers.items() if at in constants),
        )

    def _needed(self, result: int) -> list[int]:
        seen = {result}
        stack = [result]
        while stack:
            c = self._code[stack.pop()]
            for operand in _operands(c):
                if c[operand] not in seen:
                    seen.add(c[operand])
                    stack.append(c[operand])
        return sorted(seen)

    def _bodies_of(self, c: tuple[int, ...]) -> list[int]:
        """Return the bodies of a leaf's markers, in the order of its gradient slots; -1 for none."""
        if c[0] in (op.CONST, op.TIME, op.ALGEBRAIC) or c[0] > op.LAST_LEAF:
            return []
        if c[0] == op.FORCE:
            return self._rows((op.GLOBAL, op.GLOBAL, op.GLOBAL, c[4]))
        if c[0] == op.COSINE:
            return self._rows((c[1], c[3]))
        if c[0] in (op.RADIAL_VELOCITY, op.EULER_PARAMETER):
            return self._rows((c[1], c[2]))
        k = op.GLOBAL if c[5] == op.MAGNITUDE else c[4]
        return self._rows((c[1], c[2], c[3], k))

    def _rows(self, markers: Iterable[int]) -> list[int]:
        return [-1 if m < 0 else int(self._marker_body[m]) for m in markers]

    @staticmethod
    def _fold(function: Callable[..., object], *args: float) -> float:
        try:
            value = float(function(*args)[0])  # type: ignore[index]
        except (ArithmeticError, ValueError, TypeError):
            value = math.nan
        if not math.isfinite(value):
            raise ExpressionError("a constant part of the expression is not a finite number")
        return value


def _operands(c: tuple[int, ...]) -> range:
    """Return which of an instruction's entries are registers."""
    code = c[0]
    if code == op.EXTERNAL:
        return range(2, len(c))
    if code <= op.LAST_LEAF:
        return range(0)
    if code <= op.LAST_UNARY:
        return range(1, 2)
    return range(1, 3) if code <= op.LAST_BINARY else range(1, 5)
