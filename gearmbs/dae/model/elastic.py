"""Motion of elastic frames from that of their bodies and the modal coordinates, at times of a record."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.expressions.opcodes import ACC_A, ACC_ALPHA
from gearmbs.dae.equations.rotation import KIN_A, KIN_R, KIN_V, KIN_W
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, types

_VEC = float64[::1]
_MAT = float64[:, ::1]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _add_cross(a, b, factor, out):
    """Add ``factor`` a x b."""
    out[0] += factor * (a[1] * b[2] - a[2] * b[1])
    out[1] += factor * (a[2] * b[0] - a[0] * b[2])
    out[2] += factor * (a[0] * b[1] - a[1] * b[0])


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _shaped(axes, start, modes, shapes, out):
    """Write, in global components, ``start`` and what modal coordinates make of shapes."""
    for c in range(3):
        out[c] = 0.0
    for j in range(3):
        local = start[j]
        for m in range(modes.shape[0]):
            local += modes[m] * shapes[m, j]
        for c in range(3):
            out[c] += axes[3 * c + j] * local


@njit(
    types.void(_MAT, _MAT, float64[:, :, ::1], _VEC, _MAT, _MAT, _MAT, _MAT),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def elastic_frames(kin, acc, modal, s0, phi, psi, frame, acceleration):
    """Write motion and accelerations of an elastic frame from those of its body.

    The equations are those of `gearmbs.dae.equations.bodies.frames`.

    Parameters
    ----------
    kin, acc : ndarray, shapes (m, 27 or more) and (m, 6)
        Of the body.
    modal : ndarray, shape (3, m, n)
        q_f, v_f and their accelerations.
    s0 : ndarray, shape (3,)
        Place of the frame in the undeformed body, from the centre of mass.
    phi, psi : ndarray, shape (n, 3)
        Displacements and rotations of the frame by the modes.
    frame, acceleration : ndarray, as ``kin`` and ``acc``
        Written.
    """
    arm, rate, push, spin, nothing = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.zeros(3)
    axes, axis = np.empty(9), np.empty(3)
    for k in range(kin.shape[0]):
        for c in range(9):
            axes[c] = kin[k, KIN_A + c]
        w, alpha = kin[k, KIN_W : KIN_W + 3], acc[k, ACC_ALPHA : ACC_ALPHA + 3]
        _shaped(axes, s0, modal[0, k], phi, arm)
        _shaped(axes, nothing, modal[1, k], phi, rate)
        _shaped(axes, nothing, modal[2, k], phi, push)
        for c in range(3):
            spin[c] = 0.0
        _add_cross(w, arm, 1.0, spin)
        own, spun = acceleration[k, ACC_A : ACC_A + 3], frame[k, KIN_W : KIN_W + 3]
        spun_up = acceleration[k, ACC_ALPHA : ACC_ALPHA + 3]
        for c in range(3):
            frame[k, KIN_R + c] = kin[k, KIN_R + c] + arm[c]
            frame[k, KIN_V + c] = kin[k, KIN_V + c] + spin[c] + rate[c]
            own[c] = acc[k, ACC_A + c] + push[c]
            spin[c] += 2.0 * rate[c]
            spun[c], spun_up[c] = w[c], alpha[c]
        _add_cross(alpha, arm, 1.0, own)
        _add_cross(w, spin, 1.0, own)
        # rotations one after the other about the frame's own axes
        for c in range(3):
            turn, turning, faster = 0.0, 0.0, 0.0
            for m in range(psi.shape[0]):
                turn += modal[0, k, m] * psi[m, c]
                turning += modal[1, k, m] * psi[m, c]
                faster += modal[2, k, m] * psi[m, c]
            for j in range(3):
                axis[j] = axes[3 * j + c]
                spun_up[j] += axis[j] * faster
            _add_cross(spun, axis, turning, spun_up)
            for j in range(3):
                spun[j] += axis[j] * turning
            a, b, cosine, sine = (c + 1) % 3, (c + 2) % 3, np.cos(turn), np.sin(turn)
            for j in range(3):
                x, y = axes[3 * j + a], axes[3 * j + b]
                axes[3 * j + a], axes[3 * j + b] = cosine * x + sine * y, cosine * y - sine * x
        for c in range(9):
            frame[k, KIN_A + c] = axes[c]
