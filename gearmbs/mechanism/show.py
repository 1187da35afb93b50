"""A mechanism as tables for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs._shown import html_table, readable
from gearmbs.units import shown

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism


def mechanism_html(mechanism: Mechanism) -> str:
    """Return the bodies, joints and forces of a mechanism as tables."""
    rows = sum(len(joint.rows) for joint in mechanism.joints.values())
    gravity = np.array2string(np.asarray(mechanism.gravity), precision=5, separator=", ")
    head = f"Mechanism {mechanism.name}: {6 * len(mechanism.bodies)} coordinates, {rows} constraint rows"
    given = mechanism.given
    bodies = [
        (
            name,
            _body_setting(given, name, "mass", shown(body.mass, "kg")),
            _body_setting(given, name, "inertia", ", ".join(f"{v:.4g}" for v in np.diag(body.inertia)) + " kg m^2"),
            _body_setting(given, name, "position", ", ".join(f"{v:.4g}" for v in body.position) + " m"),
        )
        for name, body in mechanism.bodies.items()
    ]
    joints = [
        (
            name,
            joint.kind.replace("_", " "),
            joint.i.body.name,
            joint.j.body.name,
            len(joint.rows),
            _settings(given, name),
        )
        for name, joint in mechanism.joints.items()
    ]
    forces = [
        (name, str(getattr(e, "kind", "force")).replace("_", " "), e.i.body.name, e.j.body.name, _settings(given, name))
        for name, e in mechanism.elements.items()
        if hasattr(e, "i") and hasattr(e, "j")
    ]
    tables = [html_table(head, ("body", "mass", "inertia", "position"), bodies, f"gravity {gravity} m/s^2")]
    if joints:
        tables.append(html_table("Joints and motions", ("name", "kind", "I on", "J on", "rows", "given"), joints))
    if forces:
        tables.append(html_table("Forces", ("name", "kind", "I on", "J on", "given"), forces))
    return "".join(tables)


def _body_setting(given: dict[str, dict[str, Any]], name: str, key: str, otherwise: str) -> str:
    """Return a setting of a body as it was given, or in SI."""
    return readable(given[name][key]) if key in given.get(name, {}) else otherwise


def _settings(given: dict[str, dict[str, Any]], name: str) -> str:
    """Return the settings of a joint or force that were given with units."""
    return "; ".join(f"{key.replace('_', ' ')} {readable(value)}" for key, value in given.get(name, {}).items())
