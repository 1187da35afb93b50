"""A journal with clearance in a bore: of a plain bearing, or of a ring that is loose on its seat."""

from __future__ import annotations

from dataclasses import dataclass

from gearmbs.dae.equations.force_elements import DISSIPATED, STORED, Diagnostic
from gearmbs.mechanism.elements import Compiled, ForceElement


@dataclass(eq=False, repr=False)
class ClearanceForce(ForceElement):
    """The force of a bore, marker J, on a journal, marker I; ``reals`` as in `gearmbs.bearings.clearance_kernel`."""

    reals: tuple[float, ...]

    kind = "clearance bearing"
    has_torque = False
    diagnostics = (
        Diagnostic("elastic_energy", "J", STORED),
        Diagnostic("damping_power", "W", DISSIPATED),
        Diagnostic("penetration", "m"),
    )

    def compiled(self) -> Compiled:
        from gearmbs.bearings.clearance_kernel import WORK, clearance_bearing

        return Compiled(clearance_bearing, reals=self.reals, scratch=WORK)

    def __repr__(self) -> str:
        return f"ClearanceForce({self.name!r}, {self.i.body.name!r} in {self.j.body.name!r})"
