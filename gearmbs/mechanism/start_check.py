"""Whether what touches at the start stands no deeper in each other than the loads there press it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.elements import ForceElement

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System
    from gearmbs.mechanism.parts import Marker

MOST_EXCESS = 2.0
"""Unbalanced part of a contact's force, over the part that the loads balance: a load that comes at once presses to
twice its static force, and some play is left to who estimates the deflection."""

SHOWN = 1e-3
"""Share of a force below which nothing is said to press against it."""


def refuse_overlaps(elements: Mapping[str, Any], compiled: Callable[[Collection[str]], System]) -> None:
    """Refuse a mechanism of which parts start deep in each other, though nothing presses them together.

    With the accelerations A of a mechanism as it is, B without the contacts in question and a contact's wrench W on
    its two bodies, ``-W B`` is the rate at which the loads press the parts together, and ``W (A - B)`` that at which
    the contact drives them apart. A start under load has ``W A`` near zero.

    Parameters
    ----------
    elements : mapping
        Of the mechanism, by name.
    compiled : callable
        Returns the mechanism compiled without the elements named.

    Raises
    ------
    ModelError
        Naming the first of the elements whose parts the loads do not press together so much.
    """
    forces = [e for e in elements.values() if isinstance(e, ForceElement)]
    deep = {e.name: found for e in forces if (found := e.start_overlap()) is not None}
    if not deep:
        return
    try:
        moving = _accelerations(compiled(())), _accelerations(compiled(deep))
    except ModelError:
        # something else depends on the contact, or nothing else holds a body: there is no load to ask for
        moving = None
    for name, overlap in deep.items():
        element = elements[name]
        share = 0.0
        if moving is not None:
            apart, pressed = (_power(overlap.wrench, element.i, element.j, a) for a in moving)
            if pressed < 0.0 and apart <= -MOST_EXCESS * pressed:
                continue
            share = max(0.0, -pressed / (apart - pressed)) if apart > pressed else 0.0
        pressing = f"{100 * share:.2g} % of that" if share > SHOWN else "nothing"
        label = f"{element.kind} '{name}'"
        raise ModelError(f"{label}: at the start {overlap.text}; the loads there explain {pressing}. {overlap.remedy}")


def _accelerations(system: System) -> dict[str, tuple[np.ndarray, ...]]:
    """Return place and acceleration of the centre of mass, and angular acceleration, of each body."""
    system.initialise()
    rows = system.accelerations(system.start, system.t0)[0]
    return {n: (pose[:3], row[:3], row[3:]) for n, pose, row in zip(system.body_names, system.pose, rows)}


def _power(wrench: np.ndarray, i: Marker, j: Marker, moving: dict[str, tuple[np.ndarray, ...]]) -> float:
    """Return the wrench on I's body, and its reaction on J's, times their accelerations."""
    origin = i.global_position()
    total = 0.0
    for sign, marker in ((1.0, i), (-1.0, j)):
        if marker.body.is_ground:
            continue
        place, linear, angular = moving[marker.body.name]
        total += sign * (wrench[:3] @ (linear + np.cross(angular, origin - place)) + wrench[3:] @ angular)
    return float(total)
