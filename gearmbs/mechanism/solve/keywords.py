"""What calls that hand their keywords on take, for editors and type checkers; `tests/mechanism/test_keywords.py` holds
each table to what it stands for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypedDict

import numpy.typing as npt

from gearmbs.units import QuantityLike

if TYPE_CHECKING:
    from gearmbs.dae.result import Status
    from gearmbs.dae.results.solution import Solution
    from gearmbs.dae.state import State


@dataclass(frozen=True)
class StopAt:
    """End where a state passes a value.

    Attributes
    ----------
    state : str
        Name of a state of the mechanism; an algebraic one holds any expression, see `Mechanism.algebraic_state`.
    value : float
    direction : int
        1: rising only, -1: falling only, 0: either.
    """

    state: str
    value: float = 0.0
    direction: int = 0


class IntegratorOptions(TypedDict, total=False):
    """Options of integrators that simulations hand on; see `gearmbs.dae.Options`."""

    rtol: float
    corrector: str
    max_order: int | None
    max_step: float | None
    first_step: float | None
    min_step: float | None
    max_iterations: int | None
    max_steps: int | None
    interpolate: bool
    breakpoints: Sequence[float]
    dense_output: bool
    slopes: bool
    check_start: bool
    repairs: float
    pause: Callable[[float], float | None] | None


class SimulateOptions(IntegratorOptions, total=False):
    """Keywords of `gearmbs.mechanism.simulate`."""

    rate: QuantityLike | None
    t_eval: npt.ArrayLike | None
    every_step: bool
    t_start: QuantityLike
    integrator: str
    formulation: str
    tol: float | None
    rate_scale: float | None
    progress: bool | Callable[[float], None] | None
    advice: Mapping[Status, str] | None
    consumer: Callable[[Solution], None] | None
    watch: Sequence[tuple[str, str]]
    lump: bool | None
    stops: Sequence[StopAt]
    continued: bool
    initial: State | None
    inputs: Mapping[str, Any] | None
