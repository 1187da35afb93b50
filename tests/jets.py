"""Numbers that carry first and second derivatives: an oracle for kernels, by no rule that writes them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


class Jet:
    """A number, its gradient and its Hessian; functions of numpy call its methods."""

    __array_priority__ = 1.0

    def __init__(self, value: float, gradient: np.ndarray, hessian: np.ndarray) -> None:
        self.value, self.gradient, self.hessian = value, gradient, hessian

    def through(self, value, first, second) -> Jet:
        """Return a function of it by its value and derivatives."""
        outer = np.multiply.outer(self.gradient, self.gradient)
        return Jet(value, first * self.gradient, first * self.hessian + second * outer)

    def __add__(self, other):
        other = self.as_jet(other)
        return Jet(self.value + other.value, self.gradient + other.gradient, self.hessian + other.hessian)

    def __mul__(self, other):
        other = self.as_jet(other)
        cross = np.multiply.outer(self.gradient, other.gradient)
        hessian = self.value * other.hessian + other.value * self.hessian + cross + cross.T
        return Jet(self.value * other.value, self.value * other.gradient + other.value * self.gradient, hessian)

    def __pow__(self, n):
        if isinstance(n, Jet):
            return (n * self.log()).exp()
        x = self.value
        return self.through(x**n, n * x ** (n - 1.0), n * (n - 1.0) * x ** (n - 2.0))

    def __neg__(self):
        return -1.0 * self

    def __sub__(self, other):
        return self + -1.0 * self.as_jet(other)

    def __rsub__(self, other):
        return -1.0 * self + other

    def __truediv__(self, other):
        return self * self.as_jet(other) ** -1.0

    def __rtruediv__(self, other):
        return other * self**-1.0

    __radd__, __rmul__ = __add__, __mul__

    def sqrt(self):
        return self**0.5

    def log(self):
        return self.through(np.log(self.value), 1.0 / self.value, -1.0 / self.value**2)

    def exp(self):
        return self.through(*[np.exp(self.value)] * 3)

    def sin(self):
        return self.through(np.sin(self.value), np.cos(self.value), -np.sin(self.value))

    def cos(self):
        return self.through(np.cos(self.value), -np.sin(self.value), -np.cos(self.value))

    def arctan2(self, other):
        # the angle of (x, y): that of what is left once it is turned back by its value, of second order
        angle = np.arctan2(self.value, other.value)
        c, s = np.cos(angle), np.sin(angle)
        ratio = (c * self - s * other) / (c * other + s * self)
        return Jet(angle, ratio.gradient, ratio.hessian)

    def as_jet(self, number) -> Jet:
        zero = np.zeros_like(self.gradient)
        return number if isinstance(number, Jet) else Jet(number, zero, np.zeros_like(self.hessian))

    def slope(self, k: int) -> Jet:
        """Return the derivative by variable k, itself with a gradient."""
        return Jet(self.gradient[k], self.hessian[k], np.zeros_like(self.hessian))


def jets(values: Sequence[float]) -> list[Jet]:
    """Return variables."""
    n = len(values)
    return [Jet(float(value), row, np.zeros((n, n))) for value, row in zip(values, np.eye(n))]
