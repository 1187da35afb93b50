"""Rates of what constraint terms measure: points fixed in bodies, and products of axes fixed in two bodies.

Vectors are triples of numbers, or of lanes of `gearmbs.dae.compiled.lanes`. Second rates are without the terms in
accelerations; those of points follow from w x (w x r) = (w . r) w - (w . w) r.
"""

from __future__ import annotations

from gearmbs._jit import njit


@njit(cache=True, error_model="numpy", forceinline=True)
def vector(a, k):
    """Return ``a[k : k + 3]`` as a triple."""
    return a[k], a[k + 1], a[k + 2]


@njit(cache=True, error_model="numpy", forceinline=True)
def scalar_product(a, b):
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def vector_product(a, b):
    """Return a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy", forceinline=True)
def point_motion(v, w, r):
    """Return the velocity and the second rate of the point r from the origin of a body that moves with v and w."""
    along, square = scalar_product(w, r), scalar_product(w, w)
    rate = v[0] + w[1] * r[2] - w[2] * r[1], v[1] + w[2] * r[0] - w[0] * r[2], v[2] + w[0] * r[1] - w[1] * r[0]
    return rate, (w[0] * along - square * r[0], w[1] * along - square * r[1], w[2] * along - square * r[2])


@njit(cache=True, error_model="numpy", forceinline=True)
def product_motion(a, b, w_a, w_b):
    """Return a . b, its rate and second rate, and a x b, for vectors fixed in bodies that turn with w_a and w_b.

    a x b is the gradient with respect to the rotation of a's body, and its negative that of b's.
    """
    s = vector_product(a, b)
    phi = scalar_product(a, b)
    rate = scalar_product(s, w_a) - scalar_product(s, w_b)
    aa, ab, bb = scalar_product(w_a, w_a), scalar_product(w_a, w_b), scalar_product(w_b, w_b)
    a_a, a_b, b_a, b_b = (
        scalar_product(w_a, a), scalar_product(w_a, b), scalar_product(w_b, a), scalar_product(w_b, b)
    )  # fmt: skip
    return phi, rate, a_a * a_b + b_a * b_b + 2.0 * (ab * phi - a_b * b_a) - (aa + bb) * phi, s


@njit(cache=True, error_model="numpy", forceinline=True)
def product_with_fixed(a, b, w_a):
    """Return what `product_motion` does for a vector b that does not move."""
    s = vector_product(a, b)
    phi = scalar_product(a, b)
    bent = scalar_product(w_a, a) * scalar_product(w_a, b) - scalar_product(w_a, w_a) * phi
    return phi, scalar_product(s, w_a), bent, s
