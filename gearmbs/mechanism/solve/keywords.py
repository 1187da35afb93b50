"""What calls that hand their keywords on take, for editors and type checkers; `tests/mechanism/test_keywords.py` holds
each table to what it stands for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypedDict

import numpy.typing as npt

from gearmbs.dae.integrators.options import StepKeywords
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


class IntegratorOptions(StepKeywords, total=False):
    """Options of integrators that simulations hand on; see `gearmbs.dae.Options`."""

    rtol: float
    dense_output: bool


class FollowedOptions(TypedDict, total=False):
    """Those keywords of `gearmbs.mechanism.simulate` that runs to be derived have, too."""

    rate: QuantityLike | None
    t_eval: npt.ArrayLike | None
    integrator: str
    progress: bool | Callable[[float], None] | None
    advice: Mapping[Status, str] | None


class RunOptions(IntegratorOptions, total=False):
    """Those keywords of `gearmbs.mechanism.simulate` that are left where outputs and accuracy are a case's."""

    t_start: QuantityLike
    consumer: Callable[[Solution], None] | None
    watch: Sequence[tuple[str, str]]
    stops: Sequence[StopAt]
    continued: bool
    initial: State | None
    assembled: Solution | None
    inputs: Mapping[str, Any] | None


class SimulateOptions(RunOptions, FollowedOptions, total=False):
    """Keywords of `gearmbs.mechanism.simulate`."""

    every_step: bool
    formulation: str
    tol: float | None
    rate_scale: float | None
    lump: bool | None


class SensitivityOptions(StepKeywords, FollowedOptions, total=False):
    """Keywords of `gearmbs.mechanism.forward_sensitivities` that it hands on to `gearmbs.mechanism.simulate`."""

    rtol: float


class SimulatorOptions(IntegratorOptions, total=False):
    """Keywords of `gearmbs.mechanism.Simulator`, but for whether it keeps records."""

    t_start: QuantityLike
    integrator: str
    formulation: str
    tol: float | None
    rate_scale: float | None
    lump: bool | None
    initial: State | None
    stops: Sequence[StopAt]
    advice: Mapping[Status, str] | None


class OrbitOptions(TypedDict, total=False):
    """How a steady motion is looked for: keywords of `gearmbs.mechanism.solve.orbits.steady_motion`."""

    turned: Mapping[str, float] | None
    settle: int
    most: int
    attracting: bool
    integrator: str


class SteadyOptions(OrbitOptions, total=False):
    """All keywords of `gearmbs.mechanism.solve.orbits.steady_motion`."""

    t_start: QuantityLike
    initial: State | None
    formulation: str
    tol: float | None
    rate_scale: float | None
    lump: bool | None
