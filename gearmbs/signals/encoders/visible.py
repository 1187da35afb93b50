"""Which orders two encoders show: those below half their lines, and mesh harmonics that their lines fold but part.

What they do not show is there all the same, folded, and leaks from uneven marks into what they do: `hidden_harmonics`
are taken out with the rest, and `shadow` says how much of a line may be that of one that falls upon it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
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
    refused += _onto(lost)
    if not orders or (harmonics is not None and not any(o.harmonic for o in orders)):
        raise SignalError(
            f"lines: {trains[0].lines} and {trains[1].lines} marks show no mesh harmonic"
            f"{'' if orders else ' nor any order of the shafts'}. {' '.join(refused)} Use discs of more lines, no "
            "multiple of the teeth"
        )
    return orders, refused, remarks


def _fine(gearing: Gearing, trains: Sequence[PulseTrain], harmonics: int) -> list[int]:
    """Return the mesh harmonics from half the lines of an encoder on that no lower one falls upon, above order one."""
    fine = set(range(1, harmonics + 1))
    some = set()
    for train, mesh in zip(trains, (gearing.mesh, gearing.on_second(gearing.mesh))):
        seen = np.array([folded(float(k * mesh), train.lines) for k in range(1, harmonics + 1)])
        for h in range(1, harmonics + 1):
            if h * mesh < Fraction(train.lines, 2):
                continue
            some.add(h)
            apart = np.abs(seen[: h - 1] - seen[h - 1])
            if seen[h - 1] < float(mesh) or apart.min(initial=math.inf) < SHADOW / max(train.turns, 1.0):
                fine.discard(h)
    return sorted(fine & some)


def hidden_harmonics(gearing: Gearing, trains: Sequence[PulseTrain], orders: Sequence[Order]) -> list[list[Fraction]]:
    """Return for each encoder the mesh orders that are not looked for and that it sees somewhere, folded or not.

    Each where no order that is looked for, and no lower harmonic, is seen.

    Parameters
    ----------
    gearing : Gearing
    trains : sequence of PulseTrain
    orders : sequence of Order
        Those that are looked for.
    """
    asked = {o.order for o in orders}
    found = []
    for train, scale in zip(trains, (Fraction(1), gearing.ratio)):
        width = SHADOW / max(train.turns, 1.0)
        taken = np.array([0.0, *(folded(float(o * scale), train.lines) for o in asked), 0.5 * train.lines])
        hidden = []
        for h in range(1, HIDDEN_HARMONICS + 1):
            order = h * gearing.mesh
            seen = folded(float(order * scale), train.lines)
            if order not in asked and np.abs(taken - seen).min() >= width:
                hidden.append(order)
                taken = np.append(taken, seen)
        found.append(hidden)
    return found


def standing_harmonics(
    gearing: Gearing, trains: Sequence[PulseTrain], orders: Sequence[Order], squares: Mapping[Fraction, float]
) -> dict[Fraction, tuple[str, int]]:
    """Return orders of the shafts that are later mesh harmonics by their height: whose marks fold which onto them.

    Neither the shafts' run-out, below the mesh order, nor what modulates a mesh harmonic, next to it, is looked at.

    Parameters
    ----------
    gearing, trains, orders
        As for `hidden_harmonics`.
    squares : mapping
        Of the amplitudes of the orders.
    """
    found: dict[Fraction, tuple[str, int]] = {}
    for name, train, scale in zip(("driver", "driven"), trains, (Fraction(1), gearing.ratio)):
        mesh = gearing.mesh * scale
        own = {o.order * scale: o for o in orders if o.harmonic is None and (o.order * scale).denominator == 1}
        if mesh.denominator != 1 or not own:
            continue
        places = np.array([int(k) for k in own])
        height = np.array([squares[o.order] for o in own.values()])
        mine = {float(o.order * scale) for o in orders if o.harmonic}
        for h in range(1, HIDDEN_HARMONICS + 1):
            at = folded(float(h * mesh), train.lines)
            order = own.get(Fraction(round(at)))
            if order is None or at < mesh or h * mesh < Fraction(train.lines, 2) or order.order in found:
                continue
            if any(abs(at - m) <= MODULATED for m in mine):
                continue
            near = np.argsort(np.abs(places - at), kind="stable")[1 : NEAR + 1]
            # squares of lines of chance are e-distributed: their median is ln 2 times their mean
            level = float(np.median(height[near])) / math.log(2.0) if near.size >= NEAR // 2 else math.inf
            if squares[order.order] > math.log(places.size / CHANCE) * level:
                found[order.order] = name, h
    return found


def shadow(gearing: Gearing, trains: Sequence[PulseTrain], harmonic: int) -> int | None:
    """Return the next mesh harmonic that the marks of either encoder fold onto one; None if that is far beyond."""
    found = []
    for train, mesh in zip(trains, (gearing.mesh, gearing.on_second(gearing.mesh))):
        own = folded(float(harmonic * mesh), train.lines)
        beyond = np.arange(harmonic + 1, FARTHEST_SHADOW * harmonic + 1)
        half = 0.5 * train.lines
        at = np.abs((beyond * float(mesh) + half) % train.lines - half)
        found += list(beyond[np.abs(at - own) < SHADOW / max(train.turns, 1.0)][:1])
    return int(min(found)) if found else None


def folded_onto(standing: Mapping[Fraction, tuple[str, int]], gearing: Gearing) -> list[str]:
    """Return what is refused of the orders that `standing_harmonics` found."""
    lost: dict[str, list[tuple[float, int]]] = {"driver": [], "driven": []}
    for order, (name, h) in standing.items():
        lost[name].append((float(order if name == "driver" else gearing.on_second(order)), h))
    return _onto(lost)


def _onto(lost: Mapping[str, Sequence[tuple[float, int]]]) -> list[str]:
    found = []
    for name, places in lost.items():
        if places:
            listed = _shortened([f"{at:g} (harmonic {h})" for at, h in places])
            found.append(f"Orders of the {name} onto which its marks fold mesh harmonics: {listed}.")
    return found


def _shortened(words: Sequence[str]) -> str:
    return ", ".join(words[:LISTED]) + (f" and {len(words) - LISTED} more" if len(words) > LISTED else "")


MOST_HARMONICS = 500
"""Mesh harmonics that may be asked for: of contact forces a later one is below 1/250000 of the first."""
LISTED = 12
DARK = 7
"""A mesh harmonic is refused where one of up to so many times its number is folded onto it, and remarked on where one
beyond is: amplitudes that fall as the number's square are then 2 % of it."""
NEAR, MODULATED, CHANCE = 32, 2, 0.01
"""Orders by which the level of one is told; those next to a mesh harmonic that the shafts' turns may modulate; and the
probability that chance makes one of all orders stand as high."""
HIDDEN_HARMONICS = 64
"""Mesh harmonics that are taken out where they are not looked for: of contact forces later ones are below 1/4000 of the
first, of which uneven marks of 1 % leak a hundredth into others."""
FARTHEST_SHADOW = 30
"""Times a harmonic's number up to which those that fall upon it are looked for: of amplitudes that fall as the number's
square a later one is below a thousandth."""
SHADOW = 2.0
"""Width of a line, at most, by the reciprocal of the turns: nearer orders are not parted."""
