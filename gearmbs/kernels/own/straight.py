"""Kernels without branches, from their text to LLVM's instructions without numba's stages.

A kernel that follows from a definition is hundreds of sums and products of floats, and nothing else. Numba infers types
line by line, 3 to 8 ms each; here each operation becomes one instruction. The kernel keeps its text, which Python runs
as well, and is called as any other.

What may stand in one: names, numbers of arrays and tuples, + - * / and powers, functions of `FUNCTIONS`, ``x if a > b
else y`` with both sides computed; assignments to names and to places of arrays, and a return at the end.
"""

from __future__ import annotations

import ast
import functools
import math
from collections.abc import Callable
from typing import Any

from numba import types
from numba.core import cgutils, typing
from numba.extending import intrinsic
from numba.np import arrayobj

from gearmbs.kernels.texts import text_of

FUNCTIONS = {"sqrt": math.sqrt, "sin": math.sin, "cos": math.cos, "tan": math.tan, "arctan2": math.atan2,
             "arctan": math.atan, "exp": math.exp, "log": math.log, "tanh": math.tanh, "abs": math.fabs}  # fmt: skip
"""Functions of numpy by name: what numba has for numbers."""

OPERATIONS = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
"""Instructions of LLVM."""


def straight(function: Callable, fastmath: Any = ()) -> Callable:
    """Return a function that does the same, to be compiled by numba in a few milliseconds.

    Parameters
    ----------
    function : function
        Without branches; see the head of this module.
    fastmath : collection of str
        Liberties of LLVM with floats, such as ``"contract"``.
    """
    tree = text_of(function)
    names = ", ".join(argument.arg for argument in tree.args.args)
    liberties = tuple(sorted(fastmath))

    def typed(*kinds: Any) -> Any:
        last = tree.body[-1]
        returned = last.value if isinstance(last, ast.Return) else None
        count = len(returned.elts) if isinstance(returned, ast.Tuple) else int(returned is not None)
        result = (types.none, types.float64)[count] if count < 2 else types.UniTuple(types.float64, count)
        made = functools.partial(_instructions, tree, liberties)
        return typing.signature(result, *kinds), lambda c, b, signature, args: made(c, b, signature, args)

    # a function of no module is kept with all that it can name, the builtins of the process among that
    space: dict[str, Any] = {"typed": typed, "__name__": function.__module__}
    exec(f"def defined(typingctx, {names}):\n    return typed({names})", space)
    space["called"] = intrinsic(space["defined"])
    exec(compile(f"def {tree.name}({names}):\n    return called({names})", "<straight>", "exec"), space)
    return space[tree.name]


def _instructions(
    tree: ast.FunctionDef, liberties: tuple, context: Any, builder: Any, signature: Any, args: Any
) -> Any:
    writer = _Writer(context, builder, liberties)
    for argument, kind, value in zip(tree.args.args, signature.args, args, strict=True):
        writer.take(argument.arg, kind, value)
    for statement in tree.body:
        if isinstance(statement, ast.Return):
            return writer.result(statement, signature.return_type)
        if not (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)):
            writer.statement(statement)
    return context.get_dummy_value()


class _Writer:
    """Instructions of one kernel: numbers by name, arrays and tuples by name."""

    def __init__(self, context: Any, builder: Any, liberties: tuple) -> None:
        self.context, self.builder, self.liberties = context, builder, liberties
        self.numbers: dict[str, Any] = {}
        self.arrays: dict[str, tuple[Any, Any]] = {}
        self.indices: dict[str, Any] = {}

    def take(self, name: str, kind: Any, value: Any) -> None:
        """Take an argument in."""
        if isinstance(kind, types.Array):
            self.arrays[name] = kind, arrayobj.make_array(kind)(self.context, self.builder, value)
        elif isinstance(kind, types.BaseTuple):
            self.arrays[name] = kind, value
        else:
            if isinstance(kind, types.Integer):
                self.indices[name] = self.context.cast(self.builder, value, kind, types.intp)
            self.numbers[name] = self.context.cast(self.builder, value, kind, types.float64)

    def statement(self, node: Any) -> None:
        """Write an assignment."""
        if isinstance(node, ast.AugAssign):
            operation = OPERATIONS[type(node.op)]
            place, value = self.place(node.target), self.value(node.value)
            new = getattr(self.builder, operation)(self.builder.load(place), value, flags=self.liberties)
            self.builder.store(new, place)
            return
        (target,) = node.targets
        targets, values = [target], [node.value]
        if isinstance(target, ast.Tuple):
            targets, values = target.elts, node.value.elts
        for one, value in zip(targets, [self.value(value) for value in values], strict=True):
            if isinstance(one, ast.Name):
                self.numbers[one.id] = value
            else:
                self.builder.store(value, self.place(one))

    def index(self, node: Any) -> Any:
        """Return an index: a number, a name, or a sum of them."""
        if isinstance(node, ast.Constant):
            return self.context.get_constant(types.intp, node.value)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
            return self.builder.add(self.index(node.left), self.index(node.right))
        return self.indices[node.id]

    def place(self, node: Any) -> Any:
        """Return where a number of an array stands."""
        kind, array = self.arrays[node.value.id]
        nodes = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        shape, strides = (cgutils.unpack_tuple(self.builder, x, kind.ndim) for x in (array.shape, array.strides))
        indices = [self.index(one) for one in nodes]
        # counted from the start, as all indices here
        return cgutils.get_item_pointer2(
            self.context, self.builder, array.data, shape, strides, kind.layout, indices, wraparound=False
        )

    def value(self, node: Any) -> Any:
        """Return the value of an expression."""
        builder, form = self.builder, type(node)
        if form is ast.Name:
            return self.numbers[node.id]
        if form is ast.Constant:
            return self.context.get_constant(types.float64, float(node.value))
        if form is ast.Subscript:
            kind, array = self.arrays[node.value.id]
            if isinstance(kind, types.BaseTuple):
                k = node.slice.value
                return self.context.cast(builder, builder.extract_value(array, k), kind[k], types.float64)
            return self.context.cast(builder, builder.load(self.place(node)), kind.dtype, types.float64)
        if form is ast.UnaryOp:
            return builder.fneg(self.value(node.operand), flags=self.liberties)
        if form is ast.Call:
            return self.call(FUNCTIONS[node.func.attr], [self.value(one) for one in node.args])
        if form is ast.IfExp:
            above = [self.value(one) for one in (node.test.left, node.test.comparators[0])]
            chosen = builder.fcmp_ordered(">", *above, flags=self.liberties)
            return builder.select(chosen, self.value(node.body), self.value(node.orelse))
        left, right = self.value(node.left), self.value(node.right)
        if isinstance(node.op, ast.Pow):
            return self.call(math.pow, [left, right])
        return getattr(builder, OPERATIONS[type(node.op)])(left, right, flags=self.liberties)

    def call(self, function: Any, args: list) -> Any:
        """Return what numba has for a function of numbers."""
        kinds = [types.float64] * len(args)
        made = self.context.get_function(function, typing.signature(types.float64, *kinds))
        return made(self.builder, args)

    def result(self, node: Any, kind: Any) -> Any:
        """Return what the kernel returns."""
        if not isinstance(node.value, ast.Tuple):
            return self.value(node.value)
        values = [self.value(one) for one in node.value.elts]
        return self.context.make_tuple(self.builder, kind, values)
