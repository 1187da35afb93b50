"""Where a deck's parts and markers are: Euler angles, or points on axes, as rotation matrices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearmbs.adams.parse import statements as st
from gearmbs.dae.equations.kinematics.rotation import matrix_from_euler
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.parts.bodies import Body

PARALLEL = 1e-10
"""Sine of the angle between the axis and the second direction below which the two give no plane, as rounding of
points."""


def axes_from_points(
    origin: Sequence[float], z_point: Sequence[float] | None, x_point: Sequence[float] | None, x_first: bool
) -> np.ndarray:
    """Return the axes (columns) of a frame from a point on z and a point in the xz plane.

    With ``x_first`` the x axis passes through ``x_point`` and ``z_point`` lies in the xz plane (USEXP).  A missing
    point leaves that axis along the parent's, or as near to it as the other axis allows.

    Raises
    ------
    ValueError
        If a point coincides with the origin.
    """
    base = np.asarray(origin, dtype=float)
    z = np.array([0.0, 0.0, 1.0]) if z_point is None else np.asarray(z_point) - base
    x = np.array([1.0, 0.0, 0.0]) if x_point is None else np.asarray(x_point) - base
    first, second = (x, z) if x_first else (z, x)
    spare = np.array([0.0, 1.0, 0.0])
    if np.linalg.norm(first) == 0.0:
        raise ValueError("the point on the axis coincides with the origin")
    first = first / np.linalg.norm(first)
    if float(np.linalg.norm(np.cross(first, second))) <= PARALLEL * float(np.linalg.norm(second)):
        second = spare if abs(first @ spare) < 0.9 else np.array([0.0, 0.0, 1.0])
    second = second - first * (first @ second)
    second = second / np.linalg.norm(second)
    x, z = (first, second) if x_first else (second, first)
    return np.column_stack([x, np.cross(z, x), z])


def part_orientation(part: st.Part | st.FlexBody | st.FePart | st.PointMass) -> np.ndarray:
    """Return the axes of a part's frame at the start, global components."""
    if part.zg is not None or part.xg is not None:
        return axes_from_points(part.qg, part.zg, part.xg, False)
    return matrix_from_euler(*(part.reuler or (0.0, 0.0, 0.0)))


def marker_orientation(marker: st.Marker) -> np.ndarray:
    """Return the axes of a marker in its part's frame."""
    if marker.reuler is not None:
        return matrix_from_euler(*marker.reuler)
    if marker.zp is None and marker.xp is None:
        return np.eye(3)
    return axes_from_points(marker.qp, marker.zp, marker.xp, marker.usexp)


def inertia_about_cm(part: st.Part, cm: st.Marker, im: st.Marker) -> np.ndarray:
    """Return the inertia about the centre of mass in the part's axes, in the deck's units.

    IP holds the moments and the products (positive integrals) about the origin of IM along its axes.
    """
    xx, yy, zz, xy, xz, yz = (*(part.ip or (0.0, 0.0, 0.0)), 0.0, 0.0, 0.0)[:6]
    local = np.array([[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]])
    axes = marker_orientation(im)
    tensor = axes @ local @ axes.T
    d = np.array(cm.qp) - np.array(im.qp)
    return tensor - part.mass * ((d @ d) * np.eye(3) - np.outer(d, d))


# PART with PLANAR: it keeps the plane it starts in, parallel to xy of the ground, by a joint.


def hold(mechanism: Mechanism, body: Body, kind: str, normal: int = 2) -> None:
    """Hold a body to the ground by a joint, where the body starts; its z is the given axis of the ground."""
    at = body.centre_of_mass()[0]
    name = f"{body.name}.{kind}"
    axes = np.roll(np.eye(3), 2 - normal, axis=1)
    i, j = (owner.marker_at(at, axes, name=f"{name} {owner.name}") for owner in (body, mechanism.ground))
    mechanism.joint(kind, name, i, j)
