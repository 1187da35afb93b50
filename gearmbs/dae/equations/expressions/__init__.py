"""Function expressions as flat tapes evaluated by one compiled, data-driven kernel."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late
from gearmbs.dae.equations.expressions.tape import ExpressionError, Tape, TapeBuilder

if TYPE_CHECKING:
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

_EVALUATE = "gearmbs.dae.equations.expressions.evaluate"

# the kernels are loaded by those who evaluate something
__getattr__ = late(
    __name__,
    {
        "SplineData": "gearmbs.dae.equations.expressions.splines",
        "angle_rates": _EVALUATE,
        "eval_gradient": _EVALUATE,
        "eval_request": _EVALUATE,
        "eval_second": _EVALUATE,
        "eval_time": _EVALUATE,
        "eval_value": _EVALUATE,
        "update_angles": _EVALUATE,
    },
)
