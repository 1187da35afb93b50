"""Bodies with fewer than six freedoms: PART with PLANAR, POINT_MASS; constraints of the deck's own kind hold them.

A planar part keeps the plane it starts in, parallel to xy of the ground; a point mass keeps its orientation, so that
its moments of inertia have no effect.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.adams.builders.frames import part_orientation
from gearmbs.adams.builders.model import BodyState
from gearmbs.adams.parse import statements as st
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.parts import Body

if TYPE_CHECKING:
    from gearmbs.adams.builders.builder import Builder


def hold(mechanism: Mechanism, body: Body, kind: str, normal: int = 2) -> None:
    """Hold a body to the ground by a joint, where the body starts; its z is the given axis of the ground."""
    at = body.centre_of_mass()[0]
    name = f"{body.name}.{kind}"
    axes = np.roll(np.eye(3), 2 - normal, axis=1)
    i, j = (owner.marker_at(at, axes, name=f"{name} {owner.name}") for owner in (body, mechanism.ground))
    mechanism.joint(kind, name, i, j)


def add_point_mass(b: Builder, s: st.PointMass) -> None:
    """POINT_MASS: a body of any inertia that does not turn."""
    name = b.claim(s, "point_mass")
    units = b.units
    cm = b.deck.of(st.Marker).get(s.cm or 0)
    com = np.zeros(3) if cm is None else units.length * np.array(cm.qp)
    start = b.state.get(("POINT_MASS", s.id))
    if start is None:
        velocity = units.factor("velocity") * np.array([s.vx, s.vy, s.vz])
        start = BodyState(units.length * np.array(s.qg), part_orientation(s), velocity, np.zeros(3))
    mass = units.mass * s.mass
    body = b.mechanism.body(
        name,
        mass,
        (mass, mass, mass),
        com=com,
        position=start.position,
        orientation=start.orientation,
        velocity=start.velocity,
    )
    b.model.sources[body.name] = s
    hold(b.mechanism, body, "orientation")
