"""Force elements of a deck as loads of the mechanism, their expressions in the deck's units."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from gearmbs.adams import statements as st
from gearmbs.adams.build import Builder
from gearmbs.mechanism.friction import INPUTS, KINDS
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
        text = _sum((s.force, ""), (-s.k, f"(DM({s.i},{s.j}) - {s.length!r})"), (-s.c, f"VR({s.i},{s.j})"))
        b.mechanism.line_force(name, i, j, text, kind="springdamper")
    else:
        turn = (-s.kt, f"(AZ({s.i},{s.j}) - ({s.angle!r}))")
        text = _sum((s.torque, ""), turn, (-s.ct, f"WZ({s.i},{s.j},{s.j})"))
        b.mechanism.load(name, i, j, tz=text, rm=j, kind="springdamper")


def _sum(*terms: tuple[float, str]) -> str:
    """Return the terms with a factor other than zero, added up."""
    parts = [f"({factor!r})" + (f"*{measure}" if measure else "") for factor, measure in terms if factor != 0.0]
    return " + ".join(parts) if parts else "0"


def _measures(i: int | None, j: int | None) -> tuple[list[str], list[str]]:
    """Return the six displacements and six velocities of I in J."""
    a, c = i, j
    shifts = [f"D{x}({a},{c},{c})" for x in "XYZ"] + [f"A{x}({a},{c})" for x in "XYZ"]
    rates = [f"V{x}({a},{c},{c},{c})" for x in "XYZ"] + [f"W{x}({a},{c},{c})" for x in "XYZ"]
    return shifts, rates


def _matrix_load(
    b: Builder, name: str, kind: str, s: Any, stiffness: np.ndarray, damping: np.ndarray, free: Sequence[float],
    preload: Sequence[float],
) -> None:  # fmt: skip
    """Add F = preload - K (q - free) - C q' in J's frame; every product in the deck's units."""
    shifts, rates = _measures(s.i, s.j)
    texts = {}
    for row, component in enumerate(COMPONENTS):
        terms = [(float(preload[row]), "")]
        for c in range(6):
            shift = shifts[c] if free[c] == 0.0 else f"({shifts[c]} - ({float(free[c])!r}))"
            terms.append((-float(stiffness[row, c]), shift))
            terms.append((-float(damping[row, c]), rates[c]))
        text = _sum(*terms)
        if text != "0":
            texts[component] = text
    if texts:
        i, j = b.markers[s.i], b.markers[s.j]
        b.mechanism.load(name, i, j, rm=j, kind=kind, **texts)  # type: ignore[arg-type]


def add_bushing(b: Builder, s: st.Bushing) -> None:
    """BUSHING: diagonal stiffness and damping."""
    k, c = np.diag([*s.k, *s.kt]), np.diag([*s.c, *s.ct])
    name = b.model.names["bushing", s.id]
    _matrix_load(b, name, "bushing", s, k, c, [0.0] * 6, [*s.force, *s.torque])


def add_field(b: Builder, s: st.Field) -> None:
    """FIELD: full matrices, stored by columns; CRATIO makes the damping proportional to the stiffness."""
    if s.function is not None:
        return
    k = np.zeros((6, 6)) if s.kmatrix is None else np.reshape(s.kmatrix, (6, 6)).T
    c = np.zeros((6, 6)) if s.cmatrix is None else np.reshape(s.cmatrix, (6, 6)).T
    if s.cratio is not None:
        c = s.cratio * k
    name = b.model.names["field", s.id]
    _matrix_load(b, name, "field", s, k, c, s.length or [0.0] * 6, s.force or [0.0] * 6)


def beam_stiffness(s: st.Beam) -> np.ndarray:
    """Return the 6x6 stiffness of the beam's I end with the J end held, Timoshenko's with the shear ratios given."""
    length, e, g, area = s.length or 0.0, s.emodulus or 0.0, s.gmodulus or 0.0, s.area or 0.0
    k = np.zeros((6, 6))
    k[0, 0], k[3, 3] = e * area / length, g * (s.ixx or 0.0) / length
    for shift, turn, inertia, ratio, sign in ((1, 5, s.izz or 0.0, s.asy, -1.0), (2, 4, s.iyy or 0.0, s.asz, 1.0)):
        shear = 12.0 * e * inertia * ratio / (g * area * length**2)
        bending = e * inertia / (1.0 + shear)
        k[shift, shift] = 12.0 * bending / length**3
        k[shift, turn] = k[turn, shift] = sign * 6.0 * bending / length**2
        k[turn, turn] = (4.0 + shear) * bending / length
    return k


def add_beam(b: Builder, s: st.Beam) -> None:
    """BEAM: a FIELD with the stiffness of a beam, free at the length along x of J."""
    k = beam_stiffness(s)
    c = (s.cratio or 0.0) * k
    if s.cmatrix is not None:
        c = np.zeros((6, 6))
        rows, columns = np.triu_indices(6)
        # the lower triangle by columns is the upper one by rows
        c[rows, columns] = c[columns, rows] = s.cmatrix
    free = [s.length or 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    _matrix_load(b, b.model.names["beam", s.id], "beam", s, k, c, free, [0.0] * 6)


def add_friction(b: Builder, s: st.Friction) -> None:
    """FRICTION of a joint; without its joint it is absent."""
    joint = b.joints.get(s.joint or 0)
    if joint is None:
        if ("JOINT", s.joint) in b.inactive:
            return
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
