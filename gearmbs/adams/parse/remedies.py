"""What to do instead of statements, arguments and functions that are refused."""

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

INSTEAD: dict[str, str] = {
    "CLEARANCE": "a REQUEST with DM between two markers; CONTACT tells how deep solids press",
    "EXTERNAL_SYSTEM": "a GSE with routines in Python",
    "MREQUEST": "a REQUEST for each marker",
    "NFORCE": "BEAM or FIELD between neighbouring PARTs",
    "NODE": "it belongs to a FLEX_BODY",
    "NORMAL_MODE_ANALYSIS": "LINEAR/EIGENSOL in the script",
    "PSTATE": "none needed: LINEAR chooses the coordinates",
    "SURFACE": "a mesh in an EXTERNAL solid of GRAPHICS",
    "TIRE": "a GFORCE with a routine in Python",
    "UCON": "a GCON with an expression, or a COUPLER with a routine",
}
"""What to do instead of statements that are refused."""

INSTEAD_OF_FUNCTIONS: dict[str, str] = {
    "ARYSUM": "the sum of ARYVALs",
    "CURVE": "read where a CURVE has its id",
    "DELAY": "a TFSISO that approximates the delay",
    "DXYZ": "DX, DY and DZ",
    "FXFREQ": "read in CRATIO of a FLEX_BODY",
    "FXMODE": "read in CRATIO of a FLEX_BODY",
    "FXYZ": "FX, FY and FZ",
    "INTERP": "CUBSPL or AKISPL of a SPLINE",
    "INVPSD": "a SPLINE of the signal",
    "MODE": "MODE without brackets",
    "NFORCE": "the forces of BEAM or FIELD",
    "RANDOM": "a SPLINE of the signal",
    "SENVAL": "read where a SENSOR has its id",
    "TXYZ": "TX, TY and TZ",
    "USER": "the routine in Python alone in the FUNCTION",
    "UVX": "DX, DY and DZ from the marker to one at 1 of its x axis",
    "UVY": "DX, DY and DZ from the marker to one at 1 of its y axis",
    "UVZ": "DX, DY and DZ from the marker to one at 1 of its z axis",
    "VXYZ": "VX, VY and VZ",
    "WXYZ": "WX, WY and WZ",
}
"""What to do instead of functions that are refused."""

FRICTION_OF_JOINTS = (
    (("mu_stat_rot", "mu_stat_trans"), "MU_STATIC"),
    (("mu_dyn_rot", "mu_dyn_trans"), "MU_DYNAMIC"),
    (("delta_v",), "STICTION_TRANSITION_VELOCITY"),
    (("max_deformation",), "MAX_STICTION_DEFORMATION"),
)
"""Arguments of a JOINT with friction, the first given one of each counts, and those of a FRICTION statement."""
SIZES = {"SPHERICAL": "BALL_RADIUS", "TRANSLATIONAL": ""}
"""Argument of FRICTION for the radius of a joint, where it is not PIN_RADIUS."""


def instead_of_statement(name: str) -> str:
    """Return a clause on what to do instead of a statement that is refused, "" where there is nothing."""
    return f"; instead: {INSTEAD[name]}" if name in INSTEAD else ""


def instead_of_function(name: str) -> str:
    """Return a clause on what to write instead of a function that is refused, "" where there is nothing."""
    return f"; instead: {INSTEAD_OF_FUNCTIONS[name]}" if name in INSTEAD_OF_FUNCTIONS else ""


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
