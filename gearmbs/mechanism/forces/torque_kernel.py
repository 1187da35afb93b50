"""Kernel of a single torque: a function of time about an axis."""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.dae.equations.force_elements import DERIVATIVES, FORCE_SIG, FRAME_A


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def axis_torque(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write N = f(t) z, z the axis of the only frame and f the only input; see `gearmbs.dae.equations.force_elements`.

    d(f z) = dpi x f z.
    """
    for c in range(3):
        wrench[0, 3 + c] = inputs[0] * frames[0, FRAME_A + 3 * c + 2]
    if want & DERIVATIVES:
        x, y, z = wrench[0, 3], wrench[0, 4], wrench[0, 5]
        jac[3, 4], jac[3, 5] = z, -y
        jac[4, 3], jac[4, 5] = -z, x
        jac[5, 3], jac[5, 4] = y, -x
