"""Free parameters of a fit: start, bounds, scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

# The error of identification.


class IdentifyError(ValueError):
    """A fit that cannot be made; the message names what is wrong and the remedy."""


@dataclass(frozen=True)
class Free:
    """A parameter that is to be found.

    Parameters
    ----------
    name : str
        For cases the path of a field, as "contact.depth".
    start : float or str
        Where the search begins; texts with units where the problem knows the unit.
    low, high : float or str, optional
        Bounds; default none, and with ``log`` a hundredth and a hundred times the start.
    log : bool
        Fit the logarithm: for what is positive and known to a factor rather than to an amount.
    also : dict of str to float
        Further fields that go with it, as multiples: ``{"friction.static": 2.0}`` of "friction.dynamic".
    """

    name: str
    start: float
    low: float | None = None
    high: float | None = None
    log: bool = True
    also: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.log and not (isinstance(self.start, str) or self.start > 0.0):
            raise IdentifyError(
                f"{self.name}: start = {self.start:g} has no logarithm; give a positive one or log=False"
            )


@dataclass(frozen=True)
class Scale:
    """The way between parameters p and what the search moves, z = ln p or p.

    Attributes
    ----------
    free : tuple of Free
        With numbers throughout.
    """

    free: tuple[Free, ...]

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return [f.name for f in self.free]

    @property
    def logs(self) -> np.ndarray:
        """Which parameters are fitted by their logarithm."""
        return np.array([f.log for f in self.free])

    def z(self, p: Sequence[float]) -> np.ndarray:
        """Return z of parameters p."""
        return np.array([np.log(v) if f.log else v for f, v in zip(self.free, p)], dtype=float)

    def p(self, z: np.ndarray) -> np.ndarray:
        """Return the parameters p of z."""
        return np.where(self.logs, np.exp(np.where(self.logs, z, 0.0)), z)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the bounds of z.

        Raises
        ------
        IdentifyError
            If a start is outside its bounds.
        """
        low, high = [], []
        for f in self.free:
            a = f.low if f.low is not None else (0.01 * f.start if f.log else -np.inf)
            b = f.high if f.high is not None else (100.0 * f.start if f.log else np.inf)
            if not a < f.start < b:
                raise IdentifyError(f"{f.name}: start = {f.start:g} is not between low = {a:g} and high = {b:g}")
            if f.log and a <= 0.0:
                raise IdentifyError(f"{f.name}: low = {a:g} has no logarithm; give a positive one or log=False")
            low.append(np.log(a) if f.log else a)
            high.append(np.log(b) if f.log else b)
        return np.array(low), np.array(high)
