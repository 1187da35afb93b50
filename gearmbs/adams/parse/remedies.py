"""What to do instead of statements, arguments and functions that are refused."""

from __future__ import annotations

from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.grammar import specs_of
from gearmbs.mechanism.forces.friction import KINDS

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


def instead_of_statement(name: str) -> str:
    """Return a clause on what to do instead of a statement that is refused."""
    return f"; instead: {st.INSTEAD[name]}"


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
    spec = specs_of(type(statement))[name]
    way = f"; instead, use {spec.instead}" if spec.instead else ""
    return f"{statement.label()}: {spec.keyword} is not supported{way}"


def _friction(joint: st.Joint) -> str:
    """Return the FRICTION statement that comes nearest to a joint's own friction."""
    words = [f"FRICTION/{joint.id}", f"JOINT = {joint.id}"]
    for names, word in FRICTION_OF_JOINTS:
        given = [getattr(joint, name) for name in names if getattr(joint, name) is not None]
        if given or word.startswith("MU"):
            words.append(f"{word} = {f'{given[0]:g}' if given else '...'}")
    radius = joint.pin_radius if joint.pin_radius is not None else joint.outer_radius
    kind = KINDS.get((joint.type or "").lower())
    if kind is None or kind.lever:
        word = specs_of(st.Friction)[kind.lever if kind is not None else "pin_radius"].keyword
        words.append(f"{word} = {'...' if radius is None else f'{radius:g}'}")
    if joint.friction == "PRELOAD_ONLY":
        force = "FORCE" if kind is not None and not kind.torque else "TORQUE"
        words += ["INPUTS = PRELOAD", f"FRICTION_{force}_PRELOAD = ..."]
    return ", ".join(words)
