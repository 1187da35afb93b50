"""What to do instead of arguments that are refused."""

from __future__ import annotations

from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.grammar import specs_of

INSTEAD_OF_ARGUMENTS: dict[tuple[str, str], str] = {
    ("CONTACT", "NORMAL_FUNCTION"): "IMPACT or POISSON",
    ("CONTACT", "FRICTION_FUNCTION"): "COULOMB_FRICTION",
    ("CONTACT", "IFLEX"): "a solid on a rigid PART",
    ("CONTACT", "JFLEX"): "a solid on a rigid PART",
    ("CURVE", "FUNCTION"): "USER with a routine, or points in a MATRIX",
    ("COUPLER", "FUNCTION"): "USER with a routine, or SCALES",
    ("FE_LOAD", "FUNCTION"): "FX to TZ with expressions, which may contain S",
    ("FE_PART", "CRATIOM"): "CRATIOK, or forces against the velocity at markers on nodes",
    ("FE_PART", "PRELOAD"): "a GFORCE at its ends",
    ("FIELD", "FUNCTION"): "USER with a routine, or KMATRIX and CMATRIX",
    ("FLEX_BODY", "DB_FILE"): "MNF_FILE, a modal neutral file",
    ("FLEX_BODY", "BDF_FILE"): "MNF_FILE; beams of large motion in Python (`gearmbs.flexible.add_beam`)",
    ("FLEX_BODY", "INDEX_IN_DATABASE"): "MNF_FILE, a modal neutral file",
    ("REQUEST", "FUNCTION"): "USER with a routine, or F1 to F8",
    ("SPLINE", "FILE"): "X and Y in the deck",
    ("JOINT", "FRICTION"): "a FRICTION statement; the law of this one is not known",
}
"""What to do instead of arguments that are refused."""

FRICTION_OF_JOINTS = (
    (("mu_stat_rot", "mu_stat_trans"), "MU_STATIC"),
    (("mu_dyn_rot", "mu_dyn_trans"), "MU_DYNAMIC"),
    (("delta_v",), "STICTION_TRANSITION_VELOCITY"),
    (("max_deformation",), "MAX_STICTION_DEFORMATION"),
)
"""Arguments of a JOINT with friction, the first given one of each counts, and those of a FRICTION statement."""
SIZES = {"SPHERICAL": "BALL_RADIUS", "TRANSLATIONAL": ""}
"""Argument of FRICTION for the radius of a joint, where it is not PIN_RADIUS."""


def refused_message(statement: st.Statement, name: str) -> str:
    """Return that an argument is not supported, and what to write instead."""
    if isinstance(statement, st.Joint):
        return (
            f"{statement.label()}: {name.upper()} = {getattr(statement, name)} is not supported, as its law is not "
            f"known; write {_friction(statement)} instead"
        )
    keyword = specs_of(type(statement))[name].keyword
    instead = INSTEAD_OF_ARGUMENTS.get((st.KEYWORD_OF[type(statement)], keyword))
    return f"{statement.label()}: {keyword} is not supported" + (f"; instead, use {instead}" if instead else "")


def _friction(joint: st.Joint) -> str:
    """Return the FRICTION statement that comes nearest to a joint's own friction."""
    words = [f"FRICTION/{joint.id}", f"JOINT = {joint.id}"]
    for names, word in FRICTION_OF_JOINTS:
        given = [getattr(joint, name) for name in names if getattr(joint, name) is not None]
        if given or word.startswith("MU"):
            words.append(f"{word} = {f'{given[0]:g}' if given else '...'}")
    radius = joint.pin_radius if joint.pin_radius is not None else joint.outer_radius
    word = SIZES.get(joint.type or "", "PIN_RADIUS")
    if word:
        words.append(f"{word} = {'...' if radius is None else f'{radius:g}'}")
    if joint.friction == "PRELOAD_ONLY":
        force = "FORCE" if joint.type == "TRANSLATIONAL" else "TORQUE"
        words += ["INPUTS = PRELOAD", f"FRICTION_{force}_PRELOAD = ..."]
    return ", ".join(words)
