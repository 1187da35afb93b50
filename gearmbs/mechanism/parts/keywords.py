"""What calls that add parts hand on, for editors and type checkers; `tests/mechanism/test_keywords.py` holds each table
to what it stands for.
"""

from __future__ import annotations

from typing import TypedDict

import numpy.typing as npt

from gearmbs.mechanism.parts.quantities import Vector
from gearmbs.units import QuantityLike


class MotionKeywords(TypedDict, total=False):
    """How a body moves at the start: keywords of `gearmbs.mechanism.Mechanism.body`."""

    velocity: Vector
    angular_velocity: Vector


class PlaceKeywords(MotionKeywords, total=False):
    """Where a body is at the start and how it moves: keywords of `gearmbs.mechanism.Mechanism.body`."""

    position: Vector
    orientation: npt.ArrayLike | None


class BodyKeywords(PlaceKeywords, total=False):
    """All keywords of `gearmbs.mechanism.Mechanism.body`."""

    com: Vector


class FrictionKeywords(TypedDict, total=False):
    """Parameters of `gearmbs.mechanism.JointFriction` but for its coefficients; quantities may be texts with units."""

    stiction_transition_velocity: QuantityLike
    max_stiction_deformation: QuantityLike
    effect: str
    inputs: tuple[str, ...]
    preload_force: QuantityLike
    preload_torque: QuantityLike
    pin_radius: QuantityLike
    friction_arm: QuantityLike
    bending_arm: QuantityLike
    reaction_arm: QuantityLike
    overlap: QuantityLike
    overlap_change: str
    ball_radius: QuantityLike
    yoke: str
    max_force: QuantityLike | None
    max_torque: QuantityLike | None
