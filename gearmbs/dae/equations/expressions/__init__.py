"""Function expressions as flat tapes evaluated by one compiled, data-driven kernel."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.dae.equations.expressions.evaluate import (
        angle_rates,
        eval_gradient,
        eval_request,
        eval_value,
        update_angles,
    )
    from gearmbs.dae.equations.expressions.opcodes import ExpressionError
    from gearmbs.dae.equations.expressions.second import eval_second, eval_time
    from gearmbs.dae.equations.expressions.splines import SplineData
    from gearmbs.dae.equations.expressions.tape import Tape, TapeBuilder

__all__ = [
    "ExpressionError",
    "SplineData",
    "Tape",
    "TapeBuilder",
    "angle_rates",
    "eval_gradient",
    "eval_request",
    "eval_second",
    "eval_time",
    "eval_value",
    "update_angles",
]

late(
    __name__,
    {
        "ExpressionError": ".opcodes",
        "SplineData": ".splines",
        "Tape": ".tape",
        "TapeBuilder": ".tape",
        "angle_rates": ".evaluate",
        "eval_gradient": ".evaluate",
        "eval_request": ".evaluate",
        "eval_second": ".second",
        "eval_time": ".second",
        "eval_value": ".evaluate",
        "update_angles": ".evaluate",
    },
)
