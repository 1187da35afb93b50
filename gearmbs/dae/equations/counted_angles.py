"""Angles of a marker about an axis of another one, counted through full turns: AX, AY and AZ of the elements.

AZ is the turn of x_I from x_J towards y_J, AX and AY turn z_I likewise. Of the values that differ by full turns the one
nearest to a reference is meant, which the hook moves along with the motion; see `gearmbs.dae.equations.euler_switch`.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.force_elements import FRAME_A

AXES = ("AX", "AY", "AZ")


@njit("float64(float64[::1], int64, float64[::1], int64)", cache=True, error_model="numpy")
def axes_product(first, a, second, b):
    """Return the cosine between axis ``a`` of one frame and axis ``b`` of another (rows of 18)."""
    total = 0.0
    for c in range(FRAME_A, FRAME_A + 9, 3):
        total += first[c + a] * second[c + b]
    return total


@njit("float64(int64, float64[::1], float64[::1], float64)", cache=True, error_model="numpy")
def counted_angle(axis, first, second, reference):
    """Return the turn of frame ``first`` about an axis (0, 1, 2) of ``second``, the value nearest to a reference."""
    if axis == 0:
        angle = np.arctan2(-axes_product(first, 2, second, 1), axes_product(first, 2, second, 2))
    elif axis == 1:
        angle = np.arctan2(axes_product(first, 2, second, 0), axes_product(first, 2, second, 2))
    else:
        angle = np.arctan2(axes_product(first, 0, second, 1), axes_product(first, 0, second, 0))
    return angle + 2.0 * np.pi * np.round((reference - angle) / (2.0 * np.pi))


@njit("void(int64, float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def angle_gradient(axis, first, second, out, k):
    """Write the derivative of `counted_angle` by the rotation of ``first``; that by ``second``'s is its opposite.

    With u the axis of the first frame that is looked at, s and c the cosines of the angle's tangent s/c,
    d(u . p) = (dpi_I - dpi_J) . (u x p).
    """
    turned = 0 if axis == 2 else 2
    up = 1 if axis != 1 else 0
    sign = -1.0 if axis == 0 else 1.0
    along = turned
    s, c = sign * axes_product(first, turned, second, up), axes_product(first, turned, second, along)
    size = s * s + c * c
    for r in range(3):
        r1, r2 = (r + 1) % 3, (r + 2) % 3
        # c s' - s c' is linear in the axis that u is crossed with
        p1 = sign * c * second[FRAME_A + 3 * r1 + up] - s * second[FRAME_A + 3 * r1 + along]
        p2 = sign * c * second[FRAME_A + 3 * r2 + up] - s * second[FRAME_A + 3 * r2 + along]
        out[k + r] = (first[FRAME_A + 3 * r1 + turned] * p2 - first[FRAME_A + 3 * r2 + turned] * p1) / size


@njit(cache=True, error_model="numpy", forceinline=True)
def predict_element_angles(past, angle, extra_r):
    """Set the references to what the last values and rates let expect after a time ``past``."""
    for k in range(angle.shape[0]):
        at = angle[k, T.ANGLE_AT]
        extra_r[at] = extra_r[at + 1] + past * extra_r[at + 2]


@njit(cache=True, error_model="numpy", forceinline=True)
def track_element_angles(angle, extra_r, first, second, gradient, moving):
    """Keep the value of one angle of two frames, and its rate if ``moving``, as the last ones."""
    at = angle[T.ANGLE_AT]
    extra_r[at] = counted_angle(angle[T.ANGLE_AXIS], first, second, extra_r[at])
    extra_r[at + 1] = extra_r[at]
    extra_r[at + 2] = 0.0
    if moving:
        angle_gradient(angle[T.ANGLE_AXIS], first, second, gradient, 0)
        for c in range(3):
            extra_r[at + 2] += gradient[c] * (first[15 + c] - second[15 + c])
