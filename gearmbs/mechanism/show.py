"""A mechanism as tables for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs._shown import html_table

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism


def mechanism_html(mechanism: Mechanism) -> str:
    """Return the bodies, joints and forces of a mechanism as tables."""
    rows = sum(len(joint.rows) for joint in mechanism.joints.values())
    gravity = np.array2string(np.asarray(mechanism.gravity), precision=5, separator=", ")
    head = f"Mechanism {mechanism.name}: {6 * len(mechanism.bodies)} coordinates, {rows} constraint rows"
    bodies = [
        (name, f"{body.mass:.6g}", ", ".join(f"{v:.4g}" for v in np.diag(body.inertia)), _point(body.position))
        for name, body in mechanism.bodies.items()
    ]
    joints = [
        (name, joint.kind.replace("_", " "), joint.i.body.name, joint.j.body.name, len(joint.rows))
        for name, joint in mechanism.joints.items()
    ]
    forces = [
        (name, str(getattr(e, "kind", "force")).replace("_", " "), e.i.body.name, e.j.body.name)
        for name, e in mechanism.elements.items()
        if hasattr(e, "i") and hasattr(e, "j")
    ]
    tables = [
        html_table(head, ("body", "mass, kg", "inertia, kg m^2", "position, m"), bodies, f"gravity {gravity} m/s^2")
    ]
    if joints:
        tables.append(html_table("Joints and motions", ("name", "kind", "I on", "J on", "rows"), joints))
    if forces:
        tables.append(html_table("Forces", ("name", "kind", "I on", "J on"), forces))
    return "".join(tables)


def _point(values: np.ndarray) -> str:
    return ", ".join(f"{v:.4g}" for v in values)
