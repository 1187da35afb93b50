"""A planetary set from the teeth of its wheels and one module."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, TypedDict, Unpack

from gearmbs.gears.mesh import ContactLaw, FlankFriction
from gearmbs.gears.modifications import Fault
from gearmbs.gears.planetary_set import PlanetarySet
from gearmbs.gears.spec import GearSpec
from gearmbs.units import Quantity, QuantityLike
from gearmbs.wording import did_you_mean

WHEELS = ("sun", "planet", "ring")


class PlanetaryKeywords(TypedDict, total=False):
    """Fields of a `PlanetarySet` but for its wheels and their number, as they are given, for type checkers."""

    angles: Sequence[QuantityLike] | None
    carrier_radius: QuantityLike | None
    planet_at_ring: GearSpec | None
    backlash_sun: QuantityLike
    backlash_ring: QuantityLike
    contact: ContactLaw | None
    friction: FlankFriction
    slices: int | None
    pin_errors: Mapping[int, tuple[Any, Any]]
    faults: Sequence[tuple[str, Fault]]
    rotation: int
    ideal: tuple[float, float] | None
    ideal_damping: float
    ideal_backlash: bool
    stiffness: QuantityLike | None
    damping_ratio: float | None
    name: str


def planetary(
    teeth: tuple[int, int, int],
    module: QuantityLike,
    planets: int = 3,
    *,
    helix_angle: Quantity = 0.0,
    hand: str = "right",
    face_width: Quantity = "20 mm",
    profile_shifts: tuple[float, float, float] = (0.0, 0.0, 0.0),
    pressure_angle: Quantity = "20 deg",
    wheels: Mapping[str, Any] | None = None,
    **settings: Unpack[PlanetaryKeywords],
) -> PlanetarySet:
    """Make a planetary set from the teeth of sun, planet and ring.

    Parameters
    ----------
    teeth : (int, int, int)
        Of sun, planet and ring.
    module : float or str
        Normal module.
    planets : int
    helix_angle : float or str
    hand : {"right", "left"}
        Of the sun.
    face_width : float or str
    profile_shifts : (float, float, float)
        ISO 21771; see `GearSpec`.
    pressure_angle : float or str
    wheels : mapping, optional
        Further fields of `GearSpec`, for all wheels; under "sun", "planet" and "ring" those of one.
    **settings
        Further fields of `PlanetarySet`.

    Examples
    --------
    >>> planetary((19, 17, 56), "2 mm", 3, profile_shifts=(0.617, 0.802, -0.501)).mesh_phases("ring").round(3).tolist()
    [0.0, 0.333, 0.667]
    """
    if len(teeth) != 3:
        raise ValueError(f"planetary: teeth is {teeth!r}; give those of sun, planet and ring")
    known = [item.name for item in fields(PlanetarySet) if item.name not in ("sun", "planet", "ring", "planets")]
    for key in settings:
        if key not in known:
            hint = did_you_mean(key, ["planets", *known], otherwise=f"known ones are {', '.join(known)}")
            raise ValueError(f"planetary: {key!r} is unknown; {hint}")
    other = {"right": "left", "left": "right"}
    if hand not in other:
        raise ValueError(f"planetary: hand is {hand!r}; choose 'right' or 'left'")
    own, common = {}, {"face_width": face_width, **(wheels or {})}
    for name in WHEELS:
        own[name] = common.pop(name, {})
    made = []
    for name, z, x, sense in zip(WHEELS, teeth, profile_shifts, (hand, other[hand], other[hand])):
        made.append(
            GearSpec(
                abs(z),
                module,
                pressure_angle=pressure_angle,
                profile_shift=x,
                helix_angle=helix_angle,
                hand=sense,  # type: ignore[arg-type]
                internal=name == "ring",
                name=name,
                **{**common, **own[name]},
            )
        )
    sun, planet, ring = made
    return PlanetarySet(sun, planet, ring, planets, **settings)
