"""From a function expression to a tape: ``compile_expression``."""

from __future__ import annotations

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.errors import NotEvaluatedError
from gearmbs.dae.equations.expressions.tape import Tape, TapeBuilder
from gearmbs.mechanism.expression_functions import Lowering
from gearmbs.mechanism.expression_library import FUNCTIONS
from gearmbs.mechanism.expression_syntax import Scope, parse, shown


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
    result = lowering.node(parse(text))
    result = builder.binary(op.MUL, builder.constant(scope.units.factor(dimension)), result)
    tape = builder.finish(result, text)
    if tape.level == op.LEVEL_ACCELERATION and not accelerations:
        raise NotEvaluatedError(
            f"accelerations can be measured, and forces and equations of a deck may ask for them, not {shown(text)}"
        )
    return tape
