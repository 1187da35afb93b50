"""A journal with clearance in a bore: of a plain bearing, or of a ring that is loose on its seat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearmbs.dae.equations.loads.forces import (
    DERIVATIVES,
    DISSIPATED,
    FORCE_SIG,
    FRAME_A,
    FRAME_P,
    FRAME_V,
    FRAME_W,
    STORED,
    Diagnostic,
    impact,
    stored_energy,
)
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
        return Compiled(clearance_bearing, reals=self.reals, scratch=WORK, settings=settings)

    def __repr__(self) -> str:
        return f"ClearanceForce({self.name!r}, {self.i.body.name!r} in {self.j.body.name!r})"


# The kernel of a bearing with radial clearance: a round journal in a round bore.
#
# With r = P_I - P_J, the radial part rho of r across z_J, e = |rho|, n = rho/e and u = v_I - v_J - w_J x r,
#
#     delta = e - c,    delta' = n . u,    f = max(0, K delta^m + C S(delta) delta'),    F = -f n,
#
# S being the STEP of the damping over a depth, as in IMPACT ("Bearings" in the theory of drivetrains). Variations:
#
#     d delta = n . (dr - (r . z) dz),    dn = (d rho - n d delta) / e,    dF = -(f_d d delta + f_v d delta') n - f dn.


CLEARANCE, STIFFNESS, EXPONENT, DAMPING, DEPTH = range(5)
"""Reals: c (m, half the diametral clearance), K (N/m^m), m, C (N s/m), depth of full damping (m)."""
WORK = 27


@njit("void(float64[::1], int64, float64[::1], int64, float64[::1], int64)", cache=True, error_model="numpy")
def _cross(a, i, b, j, out, k):
    """Write the cross product of three entries of ``a`` from i on with those of ``b`` from j on to ``out[k:]``."""
    for q in range(3):
        q1, q2 = (q + 1) % 3, (q + 2) % 3
        out[k + q] = a[i + q1] * b[j + q2] - a[i + q2] * b[j + q1]


@njit(
    "void(float64[::1], float64[::1], float64[::1], float64[::1], float64, float64, float64[::1], float64[::1], "
    "float64[::1], float64, float64, float64, float64[:, ::1], int64)",
    cache=True,
    error_model="numpy",
)
def _write_column(r, z, n, u, along, e, dr, dz, du, by_depth, by_speed, force, jac, column):
    """Write the derivative of F by one variation to a column of ``jac``.

    Parameters
    ----------
    r, z, n, u : ndarray, shape (3,)
        Arm, axis of the bore, radial direction, relative velocity.
    along, e : float
        r . z and the eccentricity, m.
    dr, dz, du : ndarray, shape (3,)
        Their variations.
    by_depth, by_speed : float
        Derivatives of the size of the force.
    force : float
        Its size, N.
    jac : ndarray
        Out.
    column : int
    """
    d_depth, shift = 0.0, 0.0
    for k in range(3):
        d_depth += n[k] * (dr[k] - along * dz[k])
        shift += z[k] * dr[k] + r[k] * dz[k]
    d_speed = 0.0
    for k in range(3):
        d_rho = dr[k] - shift * z[k] - along * dz[k]
        d_speed += (d_rho - n[k] * d_depth) / e * u[k] + n[k] * du[k]
    d_force = by_depth * d_depth + by_speed * d_speed
    for k in range(3):
        d_rho = dr[k] - shift * z[k] - along * dz[k]
        jac[k, column] = -d_force * n[k] - force * (d_rho - n[k] * d_depth) / e


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def clearance_bearing(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the force of a bore on its journal, at the origin of I on both bodies; nothing inside the clearance.

    Through the journal's middle it has no moment about its axis: there is no friction.

    Arguments as in `gearmbs.dae.equations.loads.forces`; there are no inputs. Diagnostics: elastic energy, power
    dissipated, penetration.
    """
    r, z, n, u, spin = work[0:3], work[3:6], work[6:9], work[9:12], work[12:15]
    along = 0.0
    for q in range(3):
        r[q] = frames[0, FRAME_P + q] - frames[1, FRAME_P + q]
        z[q] = frames[1, FRAME_A + 3 * q + 2]
        spin[q] = frames[1, FRAME_W + q]
        along += r[q] * z[q]
    size = 0.0
    for q in range(3):
        # rho, until it is divided by e below
        n[q] = r[q] - along * z[q]
        size += n[q] * n[q]
    e = np.sqrt(size)
    depth = e - reals[CLEARANCE]
    if depth <= 0.0:
        return
    _cross(spin, 0, r, 0, u, 0)
    speed = 0.0
    for q in range(3):
        n[q] /= e
        u[q] = frames[0, FRAME_V + q] - frames[1, FRAME_V + q] - u[q]
        speed += n[q] * u[q]
    elastic = reals[STIFFNESS] * depth ** reals[EXPONENT]
    stiffness = reals[EXPONENT] * elastic / depth
    force, by_depth, by_speed = impact(elastic, stiffness, reals[DAMPING], reals[DEPTH], depth, speed)
    diagnostics[0] = stored_energy(elastic, reals[EXPONENT], depth)
    diagnostics[1] = (force - elastic) * speed
    diagnostics[2] = depth
    if force == 0.0:
        return
    for q in range(3):
        wrench[0, q] = -force * n[q]
    if not want & DERIVATIVES:
        return
    unit, dr, dz, du = work[15:18], work[18:21], work[21:24], work[24:27]
    # by the variations [dR, dpi, dv, dw] of I, then of J; kinds 0 to 3 are dR, dpi, dv, dw, of which q is a component
    for column in range(24):
        kind, q = (column % 12) // 3, column % 3
        of_j = column >= 12
        # the force is at I's origin, where neither I's orientation nor its angular velocity count
        if not of_j and kind % 2 == 1:
            continue
        for k in range(3):
            unit[k] = 1.0 if k == q else 0.0
            dr[k] = dz[k] = du[k] = 0.0
        sign = -1.0 if of_j else 1.0
        if kind == 0:
            # u has -w_J x r in it
            dr[q] = sign
            _cross(spin, 0, unit, 0, du, 0)
            for k in range(3):
                du[k] *= -sign
        elif kind == 1:
            # J turns: dz = dpi x z; r is held, and w_J with it
            _cross(unit, 0, z, 0, dz, 0)
        elif kind == 2:
            du[q] = sign
        else:
            _cross(unit, 0, r, 0, du, 0)
            for k in range(3):
                du[k] = -du[k]
        _write_column(r, z, n, u, along, e, dr, dz, du, by_depth, by_speed, force, jac, column)
