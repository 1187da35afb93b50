"""From nodal forces to generalised forces and the friction wrench, and their derivatives."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.jit import kernel
from gearmbs.contact.laws import friction_law

N_GRAD, N_HESS, N_FORCE, N_FX, N_FV = L.N_GRAD, L.N_HESS, L.N_FORCE, L.N_FX, L.N_FV
N_SIN, N_COS, N_PN, N_PT, N_DPN, N_DPT, N_DALPHA = L.N_SIN, L.N_COS, L.N_PN, L.N_PT, L.N_DPN, L.N_DPT, L.N_DALPHA
Q_, H_, B_, F_, FX_, FV_, FR_ = L.Q_, L.H_, L.B_, L.F_, L.FX_, L.FV_, L.FR_
S_V = L.S_V
FRICTION, MU_S, MU_D, V_S, V_D = L.FRICTION, L.MU_S, L.MU_D, L.V_S, L.V_D


@kernel
def add_normal(wk, o, want):
    """Add a node's normal force: Q grows by f dg/dx."""
    f = wk[o + N_FORCE]
    for i in range(6):
        g = wk[o + N_GRAD + i]
        wk[Q_ + i] += f * g
        if want != 0:
            row = 6 * i
            for j in range(6):
                wk[H_ + row + j] += g * wk[o + N_FX + j] + f * wk[o + N_HESS + row + j]
                wk[B_ + row + j] += g * wk[o + N_FV + j]


@kernel
def add_friction(gi, gr, wk, o, zp, diag, want):
    """Add a node's friction on wheel 1 at the contact point ``(N_PN, N_PT)``, ``zp`` along the mean axis.

    The sliding velocity is that of wheel 1 against wheel 2 at the point, without its part along the normal; it has
    a component along the profile and one along the face.
    """
    f = wk[o + N_FORCE]
    sa, ca = wk[o + N_SIN], wk[o + N_COS]
    pn, pt = wk[o + N_PN], wk[o + N_PT]
    # unit wrenches of a force along the profile tangent and along the face
    t = (ca, -sa, 0.0, zp * sa, zp * ca, -pn)
    z = (0.0, 0.0, 1.0, pn * ca - pt * sa, -pn * sa - pt * ca, 0.0)
    vt = 0.0
    vz = 0.0
    for i in range(6):
        vt += t[i] * wk[S_V + i]
        vz += z[i] * wk[S_V + i]
    ratio, ratio_slope = friction_law(gi[FRICTION], gr[MU_S], gr[MU_D], gr[V_S], gr[V_D], np.sqrt(vt * vt + vz * vz))
    ft = -ratio * vt * f
    fz = -ratio * vz * f
    diag[2] -= ft * vt + fz * vz
    for i in range(6):
        wk[F_ + i] += ft * t[i] + fz * z[i]
    if want == 0:
        return
    tt = -f * (ratio + ratio_slope * vt * vt)
    tz = -f * ratio_slope * vt * vz
    zz = -f * (ratio + ratio_slope * vz * vz)
    for j in range(6):
        da = wk[o + N_DALPHA + j]
        dn = wk[o + N_DPN + j]
        dt = wk[o + N_DPT + j]
        dz = 0.5 if j == 1 else 0.0
        # how the unit wrenches turn with the pose
        t0 = -sa * da
        t1 = -ca * da
        t3 = dz * sa + zp * ca * da
        t4 = dz * ca - zp * sa * da
        un = dn - pt * da
        ut = dt + pn * da
        z3 = un * ca - ut * sa
        z4 = -un * sa - ut * ca
        dvt = t0 * wk[S_V] + t1 * wk[S_V + 1] + t3 * wk[S_V + 3] + t4 * wk[S_V + 4] - dn * wk[S_V + 5]
        dvz = z3 * wk[S_V + 3] + z4 * wk[S_V + 4]
        df = wk[o + N_FX + j]
        dft = -ratio * vt * df + tt * dvt + tz * dvz
        dfz = -ratio * vz * df + tz * dvt + zz * dvz
        c = FX_ + j
        wk[c] += dft * t[0] + ft * t0
        wk[c + 6] += dft * t[1] + ft * t1
        wk[c + 12] += dfz
        wk[c + 18] += dft * t[3] + ft * t3 + dfz * z[3] + fz * z3
        wk[c + 24] += dft * t[4] + ft * t4 + dfz * z[4] + fz * z4
        wk[c + 30] += dft * t[5] - ft * dn
        dft = tt * t[j] + tz * z[j]
        dfz = tz * t[j] + zz * z[j]
        c = FV_ + j
        for i in range(6):
            wk[c + 6 * i] += dft * t[i] + dfz * z[i]
        df = -ratio * wk[o + N_FV + j]
        c = FR_ + j
        for i in range(6):
            wk[c + 6 * i] += df * (vt * t[i] + vz * z[i])


@kernel
def mirror(wk):
    """Reflect all sums in the plane of the axes: the other flanks are the same problem seen in a mirror."""
    for i in range(6):
        si = -1.0 if i > 2 else 1.0
        fi = -1.0 if i % 2 == 1 else 1.0
        wk[Q_ + i] *= si
        wk[F_ + i] *= fi
        for j in range(6):
            sj = -1.0 if j > 2 else 1.0
            fj = -1.0 if j % 2 == 1 else 1.0
            k = 6 * i + j
            wk[H_ + k] *= si * sj
            wk[B_ + k] *= si * sj
            wk[FX_ + k] *= fi * sj
            wk[FV_ + k] *= fi * fj
            wk[FR_ + k] *= fi * sj
