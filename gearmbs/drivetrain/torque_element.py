"""Torques about a shaft's axis as force elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gearmbs.dae.equations.force_elements import DISSIPATED, STORED, Diagnostic
from gearmbs.mechanism.elements import Compiled, ForceElement, State
from gearmbs.mechanism.functions import TimeFunction

FROM_STORED, FROM_LOST, FROM_OWN = 4, 5, 6
"""Values of ``first_told``: all three, without the energy, the law's own quantity alone."""
ACCOUNTS = (Diagnostic("elastic_energy", "J", STORED), Diagnostic("damping_power", "W", DISSIPATED))
"""What a passive element stores and dissipates."""


@dataclass(eq=False, repr=False)
class ShaftTorque(ForceElement):
    """Torque T(t, angle, speed, state) on I's body about z of J, its reaction on J's body.

    Attributes
    ----------
    law : str
        Module and name of the compiled law in `gearmbs.drivetrain.laws`, as "motors.kloss".
    parameters : sequence of float
    times : tuple of TimeFunction
        Functions of time that the law is given.
    counts_angle : bool
        Whether the law looks at the angle of I about J.
    own_states : tuple of State
        At most one.
    told : tuple of Diagnostic
        Some that follow one another of: energy stored, power dissipated, one quantity of the law's own.
    first_told : int
        Place of the first of them in what the law writes.
    what : str
        What messages call it.
    """

    law: str
    parameters: Sequence[float] | np.ndarray
    times: tuple[TimeFunction, ...] = ()
    counts_angle: bool = False
    own_states: tuple[State, ...] = ()
    told: tuple[Diagnostic, ...] = field(default=())
    first_told: int = FROM_STORED
    what: str = "shaft torque"

    has_force = False

    @property
    def kind(self) -> str:  # type: ignore[override]
        """What messages call it."""
        return self.what

    @property
    def states(self) -> tuple[State, ...]:
        """Its state, if it has one."""
        return self.own_states

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:  # type: ignore[override]
        """What it tells beside its torque."""
        return self.told

    def compiled(self) -> Compiled:
        from importlib import import_module

        from gearmbs.drivetrain.torque_kernel import LAW_SIG, WORK, shaft_torque

        module, _, name = self.law.partition(".")
        law: Any = getattr(import_module(f"gearmbs.drivetrain.laws.{module}"), name)
        return Compiled(
            shaft_torque,
            (len(self.times), int(self.counts_angle), self.first_told),
            self.parameters,
            ((law, LAW_SIG),),
            times=self.times,
            angles=((2, self.i, self.j),) if self.counts_angle else (),
            scratch=WORK,
        )

    def __repr__(self) -> str:
        return f"ShaftTorque({self.name!r}, {self.kind} on {self.i.body.name!r} about z of {self.j.name!r})"
