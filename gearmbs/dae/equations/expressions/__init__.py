"""Function expressions as flat tapes evaluated by one compiled, data-driven kernel."""

from gearmbs.dae.equations.expressions.evaluate import (
    angle_rates,
    eval_gradient,
    eval_request,
    eval_second,
    eval_time,
    eval_value,
    update_angles,
)
from gearmbs.dae.equations.expressions.splines import SplineData
from gearmbs.dae.equations.expressions.tape import ExpressionError, Tape, TapeBuilder

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
