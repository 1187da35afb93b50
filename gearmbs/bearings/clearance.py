"""A journal with clearance in a bore: of a plain bearing, or of a ring that is loose on its seat."""

from __future__ import annotations

from dataclasses import dataclass

from gearmbs.bearings import derived as D
from gearmbs.dae.equations.loads.forces import CHANGED_SIG, DERIVATIVES, DISSIPATED, FORCE_SIG, STORED, Diagnostic
from gearmbs.kernels.jit import njit
from gearmbs.mechanism.parts.elements import NOT_NEGATIVE, POSITIVE, Compiled, ForceElement, Setting


@dataclass(eq=False, repr=False)
class ClearanceForce(ForceElement):
    """The force of a bore, marker J, on a journal, marker I; ``reals`` are `CLEARANCE` to `DEPTH` below."""

    reals: tuple[float, ...]

    kind = "clearance bearing"
    has_torque = False
    diagnostics = (
        Diagnostic("elastic_energy", "J", STORED),
        Diagnostic("damping_power", "W", DISSIPATED),
        Diagnostic("penetration", "m"),
    )

    def compiled(self) -> Compiled:
        settings = {
            "stiffness": Setting(STIFFNESS, f"N/m^{self.reals[EXPONENT]:g}", allowed=POSITIVE),
            "damping": Setting(DAMPING, "N*s/m", allowed=NOT_NEGATIVE),
            "clearance": Setting(CLEARANCE, "m", allowed=POSITIVE),
        }
        return Compiled(clearance_bearing, reals=self.reals, settings=settings, changed=clearance_bearing_changed)

    def __repr__(self) -> str:
        return f"ClearanceForce({self.name!r}, {self.i.body.name!r} in {self.j.body.name!r})"


# The kernel of a bearing with radial clearance: a round journal in a round bore.
#
# With r = P_I - P_J, the radial part rho of r across z_J, e = |rho|, n = rho/e and u = v_I - v_J - w_J x r,
#
#     delta = e - c,    delta' = n . u,    f = max(0, K delta^m + C S(delta) delta'),    F = -f n,
#
# S being the STEP of the damping over a depth, as in IMPACT ("Bearings" in the theory of drivetrains); all is in
# `gearmbs.bearings.definitions`.


CLEARANCE, STIFFNESS, EXPONENT, DAMPING, DEPTH = range(5)
"""Reals: c (m, half the diametral clearance), K (N/m^m), m, C (N s/m), depth of full damping (m)."""


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def clearance_bearing(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the force of a bore on its journal, at the origin of I on both bodies; nothing inside the clearance.

    Through the journal's middle it has no moment about its axis: there is no friction.

    Arguments as in `gearmbs.dae.equations.loads.forces`; there are no inputs. Diagnostics: elastic energy, power
    dissipated, penetration.
    """
    one, two = frames[0], frames[1]
    depth = D.bore_depth(one, two, reals)
    if depth <= 0.0:
        return
    D.bore_load(one, two, reals, wrench)
    diagnostics[0], diagnostics[1] = D.bore_energies(one, two, reals)
    diagnostics[2] = depth
    if want & DERIVATIVES:
        D.bore_slopes(one, two, reals, jac)


@njit(CHANGED_SIG, cache=True, nogil=True, error_model="numpy")
def clearance_bearing_changed(ints, reals, changed, frames, states, inputs, work, out):
    """Write the derivatives of the force along a change of the reals.

    Arguments as of `CHANGED_SIG` in `gearmbs.dae.equations.loads.forces`.
    """
    if D.bore_depth(frames[0], frames[1], reals) > 0.0:
        D.bore_changed(frames[0], frames[1], reals, changed, out)
