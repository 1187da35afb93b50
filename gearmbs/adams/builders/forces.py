"""Force elements of a deck as those of the mechanism, in the deck's units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gearmbs.adams.builders.builder import Builder, Maker
from gearmbs.adams.builders.flexible import LOADS, flexible_body
from gearmbs.adams.builders.machinery import add_gears
from gearmbs.adams.builders.routine_calls import Caller, Routine, RoutineCall
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism.forces.friction import INPUTS, KINDS
from gearmbs.mechanism.forces.springs import Beam, Bushing, Field, MatrixForce
from gearmbs.mechanism.load_methods import add_modal_force, beam_stiffness
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.modal import ModalBody

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
    """GFORCE; a gear force becomes the contact of the pair that was given for it."""
    if s.gears is not None:
        add_gears(b, s, s.gears)
        return
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


# Load cases of an MFORCE, and what its routine becomes.


def load_cases(deck: Deck, s: st.Mforce) -> np.ndarray | None:
    """Return the load cases that a statement scales, None if its routine gives the load itself."""
    if s.force is not None or "force" in s.given:
        return None
    return flexible_body(deck, deck.of(st.FlexBody)[s.flex_body or 0]).loads


def load_case(case: int, loads: np.ndarray) -> int:
    """Return a load case's number, which is one of a column."""
    if not 1 <= case <= loads.shape[1]:
        raise ValueError(f"CASE_INDEX = {case}; {LOADS} has {loads.shape[1]} columns")
    return case


def no_cases(s: st.Mforce) -> str:
    """Return what is missing where a body has no load cases."""
    return (
        f"FLEX_BODY/{s.flex_body} has no matrix {LOADS}; load cases inside a modal neutral file are not read, write "
        "them as a MATRIX"
    )


def bind_mforce(deck: Deck, s: st.Mforce, parameters: tuple[float, ...], found: Mapping[str, Routine]) -> st.Mforce:
    """MFORCE by MFOSUB: with FORCE the load itself, with FUNCTION the scale and the number of a load case."""
    if s.flex_body not in deck.of(st.FlexBody):
        raise ValueError(f"acts on FLEX_BODY/{s.flex_body}, which the deck does not have")
    body = flexible_body(deck, deck.of(st.FlexBody)[s.flex_body])
    direct = "force" in s.given
    if not direct and body.loads is None:
        raise ValueError(f"scales a load case, but {no_cases(s)}")
    size = 6 + body.model.modes if direct else body.loads.shape[1]  # type: ignore[union-attr]

    def routine(call: RoutineCall) -> np.ndarray:
        call.loads = np.zeros((size, 0)) if body.loads is None else body.loads
        values = found[""](call)
        if direct:
            return values
        scale, case = np.asarray(values, dtype=float)
        out = np.zeros(size)
        out[load_case(int(case), body.loads) - 1] = scale  # type: ignore[arg-type]
        return out

    caller = Caller(deck, s, parameters, found[""] if hasattr(found[""], "py_func") and direct else routine, size)
    shares = caller.texts(deck.functions, f"USER_MFORCE_{s.id}")
    return replace(s, force=None, function=None, shares=tuple(shares))


# MFORCE: distributions of forces on a FLEX_BODY, from its load cases or from a routine.


def add_mforce(b: Builder, s: st.Mforce) -> None:
    """MFORCE: a load case times SCALE, or shares by a routine."""
    if s.flex_body not in b.flexible:
        # its body could not be built, which is reported
        return
    body = b.mechanism.bodies[b.model.names["flex_body", s.flex_body]]
    assert isinstance(body, ModalBody)
    name = b.claim(s, "mforce")
    reaction = b.markers[s.jfloat] if s.jfloat is not None else None
    loads = load_cases(b.deck, s)
    unit = np.concatenate(
        [np.full(3, b.units.factor("force")), np.full(3 + body.modal.modes, b.units.factor("torque"))]
    )
    if s.shares:
        # a routine gives a number for each component (FORCE) or for each load case (FUNCTION)
        columns = np.eye(6 + body.modal.modes) if loads is None else loads
        for k, (text, column) in enumerate(zip(s.shares, columns.T)):
            add_modal_force(b.mechanism, f"{name}.{k + 1}", body, unit * column, b.text(text), reaction=reaction)
        return
    if s.case_index is None or s.scale is None:
        raise ValueError("CASE_INDEX and SCALE, or FORCE = USER(...), are missing")
    if loads is None:
        raise ValueError(f"CASE_INDEX = {s.case_index}, but {no_cases(s)}")
    column = loads[:, load_case(s.case_index, loads) - 1]
    add_modal_force(b.mechanism, name, body, unit * column, b.text(s.scale), reaction=reaction)


FORCES: dict[type, Maker] = {
    st.Sforce: add_sforce,
    st.Vforce: add_vforce,
    st.Vtorque: add_vtorque,
    st.Gforce: add_gforce,
    st.SpringDamper: add_spring_damper,
    st.Bushing: add_bushing,
    st.Field: add_field,
    st.Beam: add_beam,
    st.Friction: add_friction,
    st.Mforce: add_mforce,
}
