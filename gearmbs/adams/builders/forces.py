"""Force elements of a deck as those of the mechanism, in the deck's units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from gearmbs.adams.builders.builder import Builder
from gearmbs.adams.parse import statements as st
from gearmbs.mechanism.forces.springs import Beam, Bushing, Field, MatrixForce
from gearmbs.mechanism.friction import INPUTS, KINDS
from gearmbs.mechanism.load_methods import beam_stiffness
from gearmbs.mechanism.parts import Marker

COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")


def _reaction(b: Builder, name: str, ref: int | None) -> Marker:
    """Return the marker whose body takes the reaction; the ground's where there is none."""
    return b.markers[ref] if ref is not None else b.ground_marker(f"{name}.reaction")


def add_sforce(b: Builder, s: st.Sforce) -> None:
    """SFORCE: along the line of the markers, or about or along z of J."""
    name = b.model.names["sforce", s.id]
    i, j = b.markers[s.i or 0], b.markers[s.j or 0]
    text = b.text(s.function or "")
    if s.type == "TRANSLATIONAL" and not s.action_only:
        b.mechanism.line_force(name, i, j, text)
        return
    other = b.ground_marker(f"{name}.reaction") if s.action_only else j
    if s.type == "TRANSLATIONAL":
        b.mechanism.load(name, i, other, fz=text, rm=j, kind="sforce")
    else:
        b.mechanism.load(name, i, other, tz=text, rm=j, kind="sforce")


def _components(b: Builder, s: Any, kind: str) -> None:
    name = b.model.names[kind, s.id]
    given = {c: b.text(getattr(s, c)) for c in COMPONENTS if getattr(s, c, None) is not None}
    rm = b.markers[s.rm]
    b.mechanism.load(name, b.markers[s.i], _reaction(b, name, s.jfloat), rm=rm, kind=kind, **given)


def add_vforce(b: Builder, s: st.Vforce) -> None:
    """VFORCE."""
    _components(b, s, "vforce")


def add_vtorque(b: Builder, s: st.Vtorque) -> None:
    """VTORQUE."""
    _components(b, s, "vtorque")


def add_gforce(b: Builder, s: st.Gforce) -> None:
    """GFORCE."""
    _components(b, s, "gforce")


def add_spring_damper(b: Builder, s: st.SpringDamper) -> None:
    """SPRINGDAMPER: F = FORCE - K (DM - LENGTH) - C VR, or the torque about z of J likewise."""
    name = b.model.names["springdamper", s.id]
    i, j = b.markers[s.i or 0], b.markers[s.j or 0]
    if s.type == "TRANSLATIONAL":
        b.mechanism.spring_damper(name, i, j, stiffness=s.k, damping=s.c, length=s.length, preload=s.force)
    else:
        b.mechanism.torsion_spring(name, i, j, stiffness=s.kt, damping=s.ct, angle=s.angle, preload=s.torque)


def _matrix_load(
    b: Builder, kind: type[MatrixForce], name: str, s: Any, stiffness: np.ndarray, damping: np.ndarray,
    free: Sequence[float], preload: Sequence[float], parameters: Mapping[str, Any],
) -> None:  # fmt: skip
    """Add F = preload - K (q - free) - C q' in J's frame, all in the deck's units; nothing if there is no load."""
    if any(np.any(part) for part in (stiffness, damping, preload)):
        i, j = b.markers[s.i], b.markers[s.j]
        b.mechanism.matrix_force(kind, name, i, j, stiffness, damping, parameters, free, preload)


def add_bushing(b: Builder, s: st.Bushing) -> None:
    """BUSHING: diagonal stiffness and damping."""
    k, c = np.diag([*s.k, *s.kt]), np.diag([*s.c, *s.ct])
    name = b.model.names["bushing", s.id]
    preload = [*s.force, *s.torque]
    made = {
        "stiffness": s.k, "damping": s.c, "torsional_stiffness": s.kt, "torsional_damping": s.ct, "preload": preload,
    }  # fmt: skip
    _matrix_load(b, Bushing, name, s, k, c, [0.0] * 6, preload, made)


def add_field(b: Builder, s: st.Field) -> None:
    """FIELD: full matrices, stored by columns; CRATIO makes the damping proportional to the stiffness."""
    if s.components:
        given = {c: b.text(text) for c, text in zip(COMPONENTS, s.components)}
        i, j = b.markers[s.i or 0], b.markers[s.j or 0]
        b.mechanism.load(b.model.names["field", s.id], i, j, rm=j, kind="field", **given)
        return
    if s.function is not None:
        return
    k = np.zeros((6, 6)) if s.kmatrix is None else np.reshape(s.kmatrix, (6, 6)).T
    c = np.zeros((6, 6)) if s.cmatrix is None else np.reshape(s.cmatrix, (6, 6)).T
    if s.cratio is not None:
        c = s.cratio * k
    name = b.model.names["field", s.id]
    free, preload = s.length or [0.0] * 6, s.force or [0.0] * 6
    made = {"stiffness": k, "damping": c, "free": free, "preload": preload}
    _matrix_load(b, Field, name, s, k, c, free, preload, made)


def add_beam(b: Builder, s: st.Beam) -> None:
    """BEAM: a FIELD with the stiffness of a beam, free at the length along x of J."""
    length, area, ixx, iyy, izz = (v or 0.0 for v in (s.length, s.area, s.ixx, s.iyy, s.izz))
    k = beam_stiffness(length, area, ixx, iyy, izz, s.emodulus or 0.0, s.gmodulus or 0.0, (s.asy, s.asz))
    c = (s.cratio or 0.0) * k
    if s.cmatrix is not None:
        c = np.zeros((6, 6))
        rows, columns = np.triu_indices(6)
        # the lower triangle by columns is the upper one by rows
        c[rows, columns] = c[columns, rows] = s.cmatrix
    free = [s.length or 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    made = {
        "length": length, "area": area, "second_moments": (ixx, iyy, izz), "modulus": s.emodulus or 0.0,
        "shear_modulus": s.gmodulus or 0.0, "shear_ratios": (s.asy, s.asz), "damping_ratio": s.cratio or 0.0,
        "damping": c if s.cmatrix is not None else None,
    }  # fmt: skip
    _matrix_load(b, Beam, b.model.names["beam", s.id], s, k, c, free, [0.0] * 6, made)


def add_friction(b: Builder, s: st.Friction) -> None:
    """FRICTION of a joint."""
    joint = b.joints.get(s.joint or 0)
    if joint is None:
        raise ValueError(f"JOINT/{s.joint} has no friction; it must be {', '.join(KINDS)}")
    given = tuple(i.lower() for i in s.inputs)
    inputs = INPUTS if not given or "all" in given else tuple(i for i in given if i != "none")
    b.mechanism.friction(
        b.model.names["friction", s.id],
        joint,
        s.mu_static or 0.0,
        s.mu_dynamic or 0.0,
        stiction_transition_velocity=s.transition,
        max_stiction_deformation=s.deformation,
        effect=s.effect.lower(),
        inputs=inputs,
        preload_force=s.force_preload,
        preload_torque=s.torque_preload,
        pin_radius=s.pin_radius,
        friction_arm=s.friction_arm,
        bending_arm=s.bending_arm,
        reaction_arm=s.reaction_arm,
        ball_radius=s.ball_radius,
        overlap=s.overlap,
        overlap_change=s.overlap_delta.lower(),
        yoke=s.yoke[0].lower(),
        max_force=s.max_force,
        max_torque=s.max_torque,
    )


FORCES: dict[type, Callable[[Builder, Any], None]] = {
    st.Sforce: add_sforce,
    st.Vforce: add_vforce,
    st.Vtorque: add_vtorque,
    st.Gforce: add_gforce,
    st.SpringDamper: add_spring_damper,
    st.Bushing: add_bushing,
    st.Field: add_field,
    st.Beam: add_beam,
    st.Friction: add_friction,
}
