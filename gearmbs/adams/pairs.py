"""Gear pairs in decks: as comments, from which the very pair is built again, and as the laws of a CONTACT.

The comments stand before the CONTACT of the pair's wheels. Other programs pass over them.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.gears import FlankFriction, GearPair
from gearmbs.mechanism.contacts import Coulomb, Impact

MARK = "gearmbs pair:"
"""What such a comment begins with."""
WIDTH = 100
KIND = "kind of object"


@cache
def known() -> dict[str, type]:
    """Return the classes that a pair is made of, by name."""
    import gearmbs.gears as gears
    from gearmbs.gears import faults, modifications

    found: dict[str, type] = {}
    for module in (gears, faults, modifications):
        names = getattr(module, "__all__", None) or dir(module)
        things = (getattr(module, name) for name in names)
        found |= {t.__name__: t for t in things if isinstance(t, type) and is_dataclass(t)}
    return found


def pair_comments(pair: GearPair) -> list[str]:
    """Return a pair as the texts of comments.

    Raises
    ------
    ValueError
        If it holds an object of a class that is not the package's own.
    """
    # blanks at the end of a line would not survive every editor
    text = json.dumps(_held(pair), separators=(",", ":")).replace(" ", "\\u0020")
    return [f"{MARK}{text[k : k + WIDTH]}" for k in range(0, len(text), WIDTH)]


def pair_of(text: str) -> GearPair:
    """Return the pair that comments describe; ``text`` is what they hold behind their marks.

    Raises
    ------
    ValueError
        If they are not whole.
    """
    try:
        pair = _built(json.loads(text))
    except (ValueError, TypeError, KeyError) as error:
        raise ValueError(f"the gear pair in the comments before it is not whole: {error}") from error
    if not isinstance(pair, GearPair):
        raise ValueError(f"the comments before it describe a {type(pair).__name__}, not a gear pair")
    return pair


def _held(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        name = type(value).__name__
        if known().get(name) is not type(value):
            raise ValueError(f"{name} is a class of your own, which a deck cannot hold")
        return {KIND: name} | {f.name: _held(getattr(value, f.name)) for f in fields(value) if f.init}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (tuple, list)):
        return [_held(one) for one in value]
    if isinstance(value, (bool, int, str)) or value is None:
        return value
    return float(value)


def _built(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_built(one) for one in value)
    if not isinstance(value, dict):
        return value
    name = value.pop(KIND)
    if name not in known():
        raise ValueError(f"{name} is not known")
    return known()[name](**{key: _built(one) for key, one in value.items()})


def normal_law_of(name: str, pair: GearPair) -> Impact:
    """Return the normal law of a pair of teeth as that of solids.

    Raises
    ------
    ModelError
    """
    law = pair.contact
    if law.kind == "hunt-crossley":
        raise ModelError(f"gear contact '{name}': the law {law.kind!r} has no form in ADAMS; use ContactLaw.impact")
    return Impact(float(law.stiffness), law.exponent, float(law.damping), float(law.depth))


def friction_of(friction: FlankFriction) -> Coulomb | None:
    """Return the friction of flanks as that of solids; the smooth law by its coefficient and speed."""
    if friction.kind == "none":
        return None
    if friction.kind == "smooth":
        return Coulomb(friction.dynamic, friction.dynamic, friction.static_speed, friction.static_speed)
    return Coulomb(friction.static, friction.dynamic, friction.static_speed, friction.dynamic_speed)


def with_laws(pair: GearPair, normal: Impact, friction: Coulomb | None) -> GearPair:
    """Return a pair with the laws of a CONTACT where they are no longer those that were written."""
    written = normal_law_of("", pair)
    if not _alike(dataclasses.astuple(written), dataclasses.astuple(normal)):
        law = dataclasses.replace(
            pair.contact, kind="impact", stiffness=normal.stiffness, exponent=normal.exponent, damping=normal.damping,
            depth=normal.full_depth,
        )  # fmt: skip
        pair = pair.with_changes(contact=law)
    old = friction_of(pair.friction)
    same = (old is None) == (friction is None)
    if same and old is not None and friction is not None:
        same = _alike(tuple(old.reals()), tuple(friction.reals()))
    if not same:
        changed = FlankFriction.none()
        if friction is not None:
            static, dynamic, stick, slip = friction.reals()
            changed = FlankFriction(static, dynamic, stick, slip)
        pair = pair.with_changes(friction=changed)
    return pair


def _alike(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    """Whether numbers differ by no more than their way through the deck's units makes them."""
    return all(abs(x - y) <= 1e-12 * max(abs(x), abs(y)) for x, y in zip(a, b))
