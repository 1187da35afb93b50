"""Which orders two encoders show: those below half their lines, and mesh harmonics that their lines fold but part."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from gearmbs.signals.encoders.orders import Gearing, folded, folding, whole_number
from gearmbs.signals.encoders.pulses import PulseTrain
from gearmbs.signals.errors import SignalError

FOLDED_HARMONICS = 20
"""Mesh harmonics that are looked at for where marks fold them to: of contact forces later ones are below a percent."""


class Order(NamedTuple):
    """An order by turns of the first shaft; as a whole order of each shaft, or None; and as mesh harmonic, or None."""

    order: Fraction
    first: int | None
    second: int | None
    harmonic: int | None


def visible_orders(
    gearing: Gearing, trains: Sequence[PulseTrain], harmonics: int | None
) -> tuple[list[Order], list[str], list[str]]:
    """Return the orders that both encoders see, what is refused of those that they do not, and remarks."""
    limits = [Fraction(train.lines, 2) for train in trains]
    top = min(limits[0], limits[1] / gearing.ratio)
    asked: dict[Fraction, None] = {}
    for step in (gearing.mesh, Fraction(1), 1 / gearing.ratio):
        asked |= dict.fromkeys(step * k for k in range(1, math.ceil(top / step)))
    fine = _fine(gearing, trains, harmonics or 0)
    refused = []
    shadows: list[list[tuple[int, float]]] = []
    for name, train, mesh in zip(("driver", "driven"), trains, (gearing.mesh, gearing.on_second(gearing.mesh))):
        cast_by = folding(float(mesh), train.lines, max(FOLDED_HARMONICS, *fine, 0))
        shadows.append([(h, at) for h, at in cast_by if h <= FOLDED_HARMONICS or h in fine])
        if shadows[-1] and harmonics is None:
            first = shadows[-1][0][0]
            refused.append(
                f"Mesh harmonic {first} and later ones: order {float(first * mesh):g} of the {name} is half "
                f"of its {train.lines} lines or more."
            )
    if harmonics is not None:
        beyond = [h for h in range(1, harmonics + 1) if h * gearing.mesh >= top and h not in fine]
        if beyond:
            refused.append(
                f"Mesh harmonics {_shortened([str(h) for h in beyond])}: the lines fold them onto other harmonics, or "
                "onto orders below the mesh order."
            )
        asked = {o: None for o in asked if whole_number(o / gearing.mesh) is None or o / gearing.mesh <= harmonics}
    orders, remarks = [], []
    lost: dict[str, list[tuple[float, int]]] = {"driver": [], "driven": []}
    for order in sorted(asked):
        own = {"driver": float(order), "driven": float(gearing.on_second(order))}
        harmonic = whole_number(order / gearing.mesh)
        cast = [
            (name, h)
            for name, train, shadow in zip(own, trains, shadows)
            for h, at in shadow
            if abs(at - own[name]) < SHADOW / max(train.turns, 1.0)
        ]
        dark = [(name, h) for name, h in cast if harmonic is None or h <= DARK * harmonic]
        if dark:
            lost[dark[0][0]].append((own[dark[0][0]], dark[0][1]))
            continue
        remarks += [
            f"The marks of the {name} fold mesh harmonic {h} onto {harmonic}: lines that are no multiple of the teeth "
            "part them."
            for name, h in cast[:1]
        ]
        orders.append(Order(order, whole_number(order), whole_number(gearing.on_second(order)), harmonic))
    orders += [
        Order(o, whole_number(o), whole_number(gearing.on_second(o)), h) for h in fine for o in (gearing.mesh * h,)
    ]
    for name, places in lost.items():
        if places:
            listed = _shortened([f"{at:g} (harmonic {h})" for at, h in places])
            refused.append(f"Orders of the {name} onto which its marks fold mesh harmonics: {listed}.")
    if not any(o.harmonic for o in orders):
        raise SignalError(
            f"lines: {trains[0].lines} and {trains[1].lines} marks show no mesh harmonic. {' '.join(refused)} Use "
            "discs of more lines, no multiple of the teeth"
        )
    return orders, refused, remarks


def _fine(gearing: Gearing, trains: Sequence[PulseTrain], harmonics: int) -> list[int]:
    """Return the mesh harmonics from half the lines of an encoder on that it sees alone, on orders above the first."""
    fine = set(range(1, harmonics + 1))
    some = set()
    for train, mesh in zip(trains, (gearing.mesh, gearing.on_second(gearing.mesh))):
        seen = np.array([folded(float(k * mesh), train.lines) for k in range(1, DARK * harmonics + 1)])
        for h in range(1, harmonics + 1):
            if h * mesh < Fraction(train.lines, 2):
                continue
            some.add(h)
            apart = np.abs(np.delete(seen[: DARK * h], h - 1) - seen[h - 1])
            if seen[h - 1] < float(mesh) or apart.min() < SHADOW / max(train.turns, 1.0):
                fine.discard(h)
    return sorted(fine & some)


def _shortened(words: Sequence[str]) -> str:
    return ", ".join(words[:LISTED]) + (f" and {len(words) - LISTED} more" if len(words) > LISTED else "")


MOST_HARMONICS = 500
"""Mesh harmonics that may be asked for: of contact forces a later one is below 1/250000 of the first."""
LISTED = 12
DARK = 7
"""A mesh harmonic is refused where one of up to so many times its number is folded onto it, and remarked on where one
beyond is: amplitudes that fall as the number's square are then 2 % of it."""
SHADOW = 2.0
"""Width of a line, at most, by the reciprocal of the turns: nearer orders are not parted."""
