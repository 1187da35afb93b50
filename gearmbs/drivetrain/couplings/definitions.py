"""The torque of a coupling by twist and tilt, stated once: `gearmbs.kernels.derive` makes ``derived.py``.

The law is that of `gearmbs.drivetrain.couplings.even_twist`.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.loads.traced import Frame, changed, cross, dot, kernels
from gearmbs.kernels.derive import Function, given, inputs


def twist_of(one, two):
    """Return the twist of the axes of one frame against those of another: atan2(s, c)."""
    return np.arctan2(dot(one[0], two[1]) - dot(one[1], two[0]), dot(one[0], two[0]) + dot(one[1], two[1]))


def mean_axis(one, two):
    """Return n = (z_I + z_J) / (1 + z_I . z_J), along which turns change the twist, and 1 + z_I . z_J."""
    along = 1.0 + dot(one, two)
    return [(a + b) / along for a, b in zip(one, two)], along


def torque(twist, n, along, w, tilt, p):
    """Return N, and a' and the part of w across the mean axis; b b = n n (1 + z_I . z_J) / 2."""
    stiffness, damping, tilt_stiffness, tilt_damping = p
    rate = dot(n, w)
    across = [x - 0.5 * along * rate * axis for x, axis in zip(w, n)]
    size = stiffness * twist + damping * rate
    return [tilt_stiffness * x - size * a - tilt_damping * b for x, a, b in zip(tilt, n, across)], rate, across


def functions() -> list[Function]:
    one, two = Frame("one", "i"), Frame("two", "j")
    law = inputs("stiffness damping tilt_stiffness tilt_damping", "law")
    n, along = mean_axis(one.axes[2], two.axes[2])
    (twist,) = inputs("twist")
    # a turn of I adds n . dpi, whatever the axes are; one of J takes it away
    given(twist, dict(zip(one.variations[3:6] + two.variations[3:6], [*n, *(-x for x in n)])))
    load, rate, across = torque(twist, n, along, one.minus(two)[2], cross(one.axes[2], two.axes[2]), law)
    energy = 0.5 * law[0] * twist * twist + law[2] * (2.0 - along)
    lost = law[1] * rate * rate + law[3] * dot(across, across)
    return [
        Function("twist", "one, two", "Return the twist.", [twist_of(one.axes, two.axes)]),
        *kernels("even", "the torque of a coupling", load, 3, one.variations + two.variations, "twist"),
        Function("even_energies", "one, two, law, twist", "Return the energy stored, and the power dissipated.",
                 [energy, lost]),
        changed("even", "one, two, law, twist", load, 3, law),
    ]  # fmt: skip
