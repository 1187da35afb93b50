"""How large the lines of marks are where nothing else tells: as told, or by the orders of each shaft beside."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np

from gearmbs.signals.encoders.estimate import NOISELESS
from gearmbs.signals.encoders.orders import Gearing, Line, folded
from gearmbs.signals.encoders.pulses import TURN, PulseTrain
from gearmbs.signals.encoders.visible import Order
from gearmbs.signals.errors import SignalError

LEVEL_LINES = 32
"""Orders beside one, at most, by whose median the level of the marks is told."""


class Levels:
    """Variances of the marks' lines: as told, or by the orders of each shaft beside the mesh orders."""

    def __init__(
        self,
        gearing: Gearing,
        orders: Sequence[Order],
        measured: Sequence[Mapping[Fraction, Line]],
        trains: Sequence[PulseTrain],
        told: float | Sequence[float] | None,
        free: Mapping[str, list[dict[Fraction, Line]]],
    ) -> None:
        self.told: dict[str, float] | None = None
        self.gearing, self.calibrated = gearing, {name for name in free if free[name]}
        self.orders: dict[str, np.ndarray] = {}
        self.squares: dict[str, np.ndarray] = {}
        scales = {"driver": 1.0, "driven": float(gearing.ratio)}
        self.noise: dict[str, np.ndarray] = {}
        counted = []
        for shaft, name in enumerate(scales):
            own = [o for o in orders if o.harmonic is None and (o.second if shaft else o.first) is not None]
            alone = [o for o in own if (o.first if shaft else o.second) is None]
            shared = not alone
            used = own if shared else alone
            at = np.array([o.second if shaft else o.first for o in used], dtype=float)
            square = np.array([np.mean([abs(m[o.order].value) ** 2 for m in measured]) for o in used])
            # where both discs are seen at once, each has half, unless the other is known
            part = 0.5 if shared and not self.calibrated else 1.0
            self.orders[name], self.squares[name] = at, part * square / scales[name] ** 2
            self.noise[name] = self._noise(used, name, measured, free.get(name, []), scales[name])
            counted.append(min(LEVEL_LINES, at.size))
        # the median of squares has half the freedom of their mean, two for each
        self.freedom = float(max(2, min(counted, default=2)))
        if told is not None:
            self.freedom = math.inf
            shares = np.broadcast_to(np.asarray(told, dtype=float), (2,))
            if not (np.isfinite(shares).all() and (shares >= 0.0).all()):
                raise SignalError(f"mark_error: must be one or two shares of the pitch of the marks, got {told!r}")
            # a line of L independent errors of variance s^2 has 2 s^2/L in each part
            self.told = {
                name: 2.0 * (share * TURN / train.lines) ** 2 / train.lines
                for name, share, train in zip(scales, shares, trains)
            }

    @staticmethod
    def _noise(
        used: Sequence[Order],
        name: str,
        measured: Sequence[Mapping[Fraction, Line]],
        free: Sequence[dict[Fraction, Line]],
        scale: float,
    ) -> np.ndarray:
        """Return the variances of lines by the scatter from turn to turn, in mesh and free, rad^2 of the shaft."""
        found = []
        for order in used:
            whole = Fraction((order.first if name == "driver" else order.second) or 0)
            coupled = float(np.mean([one[order.order].variance for one in measured]))
            alone = [1.0 / max(lines[whole].variance, NOISELESS) for lines in free]
            found.append(coupled / scale**2 + (1.0 / sum(alone) if alone else 0.0))
        return np.array(found)

    def at(self, order: Order, name: str) -> float | None:
        """Return the variance of a disc's line at an order; None where the order is none of the disc's."""
        whole = order.first if name == "driver" else order.second
        if whole is None:
            return None
        if self.told is not None:
            return self.told[name]
        return self._beside(whole, name)

    def _beside(self, order: float, name: str) -> float:
        near = np.argsort(np.abs(self.orders[name] - order), kind="stable")[:LEVEL_LINES]
        # squares of a line of chance have the median 2 ln 2 times the variance of each part
        return float(np.median(self.squares[name][near])) / (2.0 * math.log(2.0)) if near.size else 0.0

    def _beside_noise(self, order: float, name: str) -> float:
        near = np.argsort(np.abs(self.orders[name] - order), kind="stable")[:LEVEL_LINES]
        return float(np.median(self.noise[name][near])) if near.size else 0.0

    def folded(self, order: Order, trains: Sequence[PulseTrain]) -> float:
        """Return the variance (rad^2 of the first shaft) of what the shafts have where an order is folded to, if it is.

        With marks that are known that is their own vibration, what stands beside above the noise that the line has
        anyway; else the marks are in it already.
        """
        total = 0.0
        for name, own, scale, train in (
            ("driver", order.order, 1.0, trains[0]),
            ("driven", self.gearing.on_second(order.order), float(self.gearing.ratio), trains[1]),
        ):
            if order.harmonic and own >= Fraction(train.lines, 2) and name in self.calibrated:
                at = folded(float(own), train.lines)
                total += scale**2 * max(0.0, self._beside(at, name) - self._beside_noise(at, name))
        return total
