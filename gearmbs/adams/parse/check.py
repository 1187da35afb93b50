"""Checks that a deck holds together: references, required arguments, units."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from gearmbs.adams.errors import ERROR, UNSUPPORTED, WARNING, Diagnostic, labels_of
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.data import spline_data
from gearmbs.adams.parse.deck import Deck, measured_markers
from gearmbs.adams.parse.grammar import CHOICE, EXPRESSION, Spec, specs_of
from gearmbs.mechanism.forces.friction import KINDS


class Arguments(NamedTuple):
    """Arguments of a class of statements of which something holds, see `Spec`."""

    required: list[str]
    positive: list[str]
    unsigned: list[str]
    refused: list[str]
    idle: list[str]


_ARGUMENTS: dict[type, Arguments] = {}


def arguments_of(cls: type) -> Arguments:
    """Return what is asked of the arguments of a class of statements, which is found once."""
    if cls in _ARGUMENTS:
        return _ARGUMENTS[cls]
    specs = specs_of(cls).items()

    def those(fact: Callable[[Spec], object]) -> list[str]:
        return [name for name, spec in specs if fact(spec)]

    _ARGUMENTS[cls] = Arguments(
        required=those(lambda spec: spec.required),
        positive=those(lambda spec: spec.positive),
        unsigned=those(lambda spec: spec.unsigned),
        refused=those(lambda spec: spec.instead is not None),
        idle=those(lambda spec: spec.idle),
    )
    return _ARGUMENTS[cls]


MARKER_FIELDS = ("i", "j", "rm", "jfloat", "cm", "im", "vm", "wm", "cv", "corner", "icm", "irm", "jrm", "iicm", "jicm")
TWO_PARTS = (st.Joint, st.Jprim)
MESH_FILES = (".stl", ".obj", ".shl", ".slp")


def check(deck: Deck) -> list[Diagnostic]:
    """Return everything that makes a deck unusable; add warnings to the deck.

    Parameters
    ----------
    deck : Deck

    Returns
    -------
    list of Diagnostic
    """
    errors: list[Diagnostic] = []

    def fail(statement: st.Statement, message: str, argument: str = "") -> None:
        line = statement.given.get(argument, statement.line)
        errors.append(Diagnostic(ERROR, f"{statement.label()}: {message}", deck.file, line))

    _check_units(deck, errors)
    _check_ground(deck, errors)
    for statement in deck:
        cls = type(statement)
        asked = arguments_of(cls)
        required = asked.required
        if cls is st.Marker and (statement.flex_body or statement.point_mass or statement.fe_part):  # type: ignore[attr-defined]
            required = []
        if getattr(statement, "data_file", None) or _by_routine(statement):
            # the file has them, or a routine of the user
            required = []
        for name in required:
            if getattr(statement, name) in (None, ()):
                keyword = _choices(cls, name) if specs_of(cls)[name].kind == CHOICE else name.upper()
                fail(statement, f"{keyword} is missing")
        for name in refused_arguments(statement):
            message = refused_message(statement, name)
            deck.diagnostics.append(Diagnostic(UNSUPPORTED, message, deck.file, statement.given[name]))
        for name in asked.positive:
            value = getattr(statement, name)
            if value is not None and not value > 0.0:
                fail(statement, f"{specs_of(cls)[name].keyword} = {value}; it must be positive", name)
        for name in asked.unsigned:
            value = getattr(statement, name)
            if value is not None and value < 0.0:
                fail(statement, f"{specs_of(cls)[name].keyword} = {value}; it must not be negative", name)
        _check_markers(deck, statement, fail)
    _remark_idle(deck)
    for part in deck.of(st.Part).values():
        _check_part(deck, part, fail)
    for point in deck.of(st.PointMass).values():
        _check_point_mass(deck, point, fail)
    for marker in deck.of(st.Marker).values():
        if marker.part is not None and marker.part not in deck.of(st.Part):
            fail(marker, f"there is no PART/{marker.part}", "part")
        if marker.flex_body is not None and marker.flex_body not in deck.of(st.FlexBody):
            fail(marker, f"there is no FLEX_BODY/{marker.flex_body}", "flex_body")
        if marker.point_mass is not None and marker.point_mass not in deck.of(st.PointMass):
            fail(marker, f"there is no POINT_MASS/{marker.point_mass}", "point_mass")
        if marker.flex_body is None and marker.node_id is not None:
            fail(marker, "NODE_ID is for markers of a FLEX_BODY", "node_id")
        if marker.fe_part is not None and marker.fe_part not in deck.of(st.FePart):
            fail(marker, f"there is no FE_PART/{marker.fe_part}", "fe_part")
    for load in deck.of(st.FeLoad).values():
        if load.fe_part is not None and load.fe_part not in deck.of(st.FePart):
            fail(load, f"there is no FE_PART/{load.fe_part}", "fe_part")
    for force in deck.of(st.Mforce).values():
        if force.flex_body is not None and force.flex_body not in deck.of(st.FlexBody):
            fail(force, f"there is no FLEX_BODY/{force.flex_body}", "flex_body")
    _check_constraints(deck, fail)
    _check_forces(deck, fail)
    _check_contacts(deck, fail)
    _check_curves(deck, fail)
    _check_data(deck, fail)
    _check_floating(deck, fail)
    return errors


def _by_routine(statement: st.Statement) -> bool:
    """Whether a statement takes from a routine of the user what others give by arguments."""
    if isinstance(statement, st.CurveStatement):
        return "function" in statement.given
    return bool(statement.subroutine) and "function" in statement.given and getattr(statement, "function", "") is None


def refused_arguments(statement: st.Statement) -> list[str]:
    """Return the arguments of a statement that are not supported, but for those that switch something off."""
    return [
        name
        for name in arguments_of(type(statement)).refused
        if name in statement.given and getattr(statement, name) != "OFF"
    ]


Fail = Callable[..., None]


def _remark_idle(deck: Deck) -> None:
    """Remark on arguments without effect: once for each reason, and all statements that have the same ones."""
    found: dict[tuple[type, tuple[str, ...], str], list[st.Statement]] = {}
    for statement in deck:
        reasons: dict[str, list[str]] = {}
        if isinstance(statement, st.CurveStatement) and _by_routine(statement):
            # its routine gives the points from MINPAR to MAXPAR
            continue
        for name in arguments_of(type(statement)).idle:
            # a CURVE's routine is asked from MINPAR to MAXPAR
            ranges = isinstance(statement, st.CurveStatement) and _by_routine(statement)
            if name in statement.given and not ranges:
                reasons.setdefault(_why(statement, name), []).append(name)
        for why, idle in reasons.items():
            found.setdefault((type(statement), tuple(idle), why), []).append(statement)
    for (cls, without, why), group in found.items():
        names = ", ".join(specs_of(cls)[name].keyword for name in without)
        message = f"{_labels(group)}: {names} without effect: {why}"
        deck.diagnostics.append(Diagnostic(WARNING, message, deck.file, group[0].given[without[0]]))
    bent = [b for b in deck.of(st.Beam).values() if b.formulation != "LINEAR"]
    if bent:
        message = (
            f"{_labels(bent)}: FORMULATION = {bent[0].formulation} is computed as LINEAR: true while deflections stay "
            "small against the length"
        )
        deck.diagnostics.append(Diagnostic(WARNING, message, deck.file, bent[0].given["formulation"]))


def _why(statement: st.Statement, name: str) -> str:
    """Return why an argument of a statement has no effect."""
    why = specs_of(type(statement))[name].idle
    if not isinstance(statement, st.Graphics):
        return why
    if name != "faceting":
        return "a plane that bodies touch has no edges" if statement.type == "PLANE" else why
    if statement.type != "EXTERNAL":
        return why
    if (statement.data_file or "").lower().endswith(MESH_FILES):
        return "a mesh is as fine as its file"
    return "a body of a Parasolid file is exact, or is cut within 0.001 of its diagonal"


def _labels(group: Sequence[st.Statement]) -> str:
    return labels_of([s.label() for s in group])


def _choices(cls: type, name: str) -> str:
    return f"its {name} (" + ", ".join(specs_of(cls)[name].choices) + ")"


def _check_units(deck: Deck, errors: list[Diagnostic]) -> None:
    statement = deck.only(st.Units)
    try:
        _ = deck.units
    except ValueError as error:
        errors.append(Diagnostic(ERROR, f"UNITS: {error}", deck.file, statement.line if statement else 0))
    if statement is None:
        message = "UNITS is missing; numbers are taken as kg, m, s and N"
        deck.diagnostics.append(Diagnostic(WARNING, message, deck.file, 0))


def _check_ground(deck: Deck, errors: list[Diagnostic]) -> None:
    grounds = [p for p in deck.of(st.Part).values() if p.ground]
    if not grounds:
        errors.append(Diagnostic(ERROR, "no PART is the GROUND; add PART/1, GROUND", deck.file, 0))
    for extra in grounds[1:]:
        message = f"{extra.label()}: PART/{grounds[0].id} is the GROUND already"
        errors.append(Diagnostic(ERROR, message, deck.file, extra.line))


def _check_markers(deck: Deck, statement: st.Statement, fail: Fail) -> None:
    markers = deck.of(st.Marker)
    for name in MARKER_FIELDS:
        ref = getattr(statement, name, None)
        if ref is None or (ref == 0 and isinstance(statement, st.Request)):
            continue
        if ref not in markers:
            fail(statement, f"there is no MARKER/{ref} for {name.upper()}", name)
    if isinstance(statement, TWO_PARTS) and statement.i in markers and statement.j in markers:
        i, j = markers[statement.i], markers[statement.j]
        if i.owner() == j.owner():
            fail(statement, f"I and J are both on {'/'.join(map(str, i.owner()))}; it must join two parts")


def _check_part(deck: Deck, part: st.Part, fail: Fail) -> None:
    if part.mass < 0.0:
        fail(part, f"MASS = {part.mass}; it cannot be negative", "mass")
    if part.ground:
        return
    if (part.mass > 0.0 or part.ip) and part.cm is None:
        fail(part, "CM is missing; a part with mass needs the id of its centre-of-mass marker")
    for name in ("cm", "im"):
        marker = deck.of(st.Marker).get(getattr(part, name) or -1)
        if marker is not None and marker.part != part.id:
            fail(part, f"{name.upper()} = {marker.id}, but MARKER/{marker.id} is on PART/{marker.part}", name)
    if part.reuler is not None and (part.zg or part.xg):
        fail(part, "give either REULER or ZG and XG, not both", "reuler")


def _check_point_mass(deck: Deck, point: st.PointMass, fail: Fail) -> None:
    marker = deck.of(st.Marker).get(point.cm or -1)
    if marker is not None and marker.point_mass != point.id:
        fail(point, f"CM = {marker.id}, but MARKER/{marker.id} is on {'/'.join(map(str, marker.owner()))}", "cm")


def _check_constraints(deck: Deck, fail: Fail) -> None:
    joints = deck.of(st.Joint)
    for joint in joints.values():
        if joint.type == "SCREW" and joint.pitch is None:
            fail(joint, "a SCREW joint needs PITCH")
        if joint.type == "RACKPIN" and not joint.pd:
            fail(joint, "a RACKPIN joint needs PD, the pitch diameter")
    for gear in deck.of(st.Gear).values():
        for ref in gear.joints:
            if ref not in joints:
                fail(gear, f"there is no JOINT/{ref}", "joints")
    for coupler in deck.of(st.Coupler).values():
        for ref in coupler.joints:
            if ref not in joints:
                fail(coupler, f"there is no JOINT/{ref}", "joints")
        n = len(coupler.joints)
        given = coupler.function is not None or _by_routine(coupler)
        if coupler.joints and not given and len(coupler.scales) not in (n - 1, n):
            fail(coupler, f"SCALES needs {n - 1} or {n} values for {n} joints, got {len(coupler.scales)}", "scales")
        if coupler.type and len(coupler.type) != n:
            fail(coupler, f"TYPE needs {n} letters, got {len(coupler.type)}", "type")
    for motion in deck.of(st.Motion).values():
        if motion.joint is not None:
            if motion.joint not in joints:
                fail(motion, f"there is no JOINT/{motion.joint}", "joint")
        elif motion.i is None or motion.j is None or motion.direction is None:
            fail(motion, "give JOINT, or I, J and one of X, Y, Z, B1, B2, B3")


def _check_forces(deck: Deck, fail: Fail) -> None:
    for force in deck.each(st.Acting):
        if force.function is None and all(getattr(force, name) is None for name in force.results):
            fail(force, f"give at least one of {', '.join(force.results).upper()}")
    for friction in deck.of(st.Friction).values():
        if friction.joint is not None and friction.joint not in deck.of(st.Joint):
            fail(friction, f"there is no JOINT/{friction.joint}", "joint")
    for field in deck.of(st.Field).values():
        given = field.kmatrix or field.cmatrix or field.function or _by_routine(field)
        if not given:
            fail(field, "give KMATRIX or CMATRIX")


def _check_contacts(deck: Deck, fail: Fail) -> None:
    graphics = deck.of(st.Graphics)
    for solid in graphics.values():
        if solid.marker is None:
            fail(solid, "CM, RM or CORNER is missing: a solid that touches needs a marker")
    for contact in deck.of(st.Contact).values():
        for name, refs in (("igeom", contact.igeom), ("jgeom", contact.jgeom)):
            for ref in refs:
                if ref not in graphics:
                    fail(contact, f"there is no GRAPHICS/{ref} for {name.upper()}", name)
        law = {"IMPACT": ("stiffness", "dmax"), "POISSON": ("penalty", "restitution")}.get(contact.law or "", ())
        for name in law:
            if getattr(contact, name) is None:
                fail(contact, f"{specs_of(st.Contact)[name].keyword} is missing for {contact.law}")
        rubs = contact.coulomb != "OFF" and not contact.no_friction
        for name in ("stiction", "transition") if contact.coulomb == "ON" else ("transition",):
            if rubs and not (getattr(contact, name) or 0.0) > 0.0:
                fail(contact, f"{specs_of(st.Contact)[name].keyword} is missing or not positive")


def _check_curves(deck: Deck, fail: Fail) -> None:
    for curve in deck.of(st.CurveStatement).values():
        if curve.matrix is not None and curve.matrix not in deck.of(st.Matrix):
            fail(curve, f"there is no MATRIX/{curve.matrix}", "matrix")
    users = [(p, "curve") for p in deck.of(st.Ptcv).values()]
    users += [(g, "curve") for g in deck.of(st.Graphics).values()]  # type: ignore[misc]
    users += [(c, name) for c in deck.of(st.Cvcv).values() for name in ("icurve", "jcurve")]  # type: ignore[misc]
    for statement, name in users:
        ref = getattr(statement, name)
        if ref is not None and ref not in deck.of(st.CurveStatement):
            fail(statement, f"there is no CURVE/{ref} for {name.upper()}", name)
    for matrix in deck.of(st.Matrix).values():
        if not matrix.sparse and (matrix.rows or 0) * (matrix.columns or 0) != len(matrix.values) and matrix.values:
            fail(
                matrix, f"{matrix.rows} rows and {matrix.columns} columns need as many values, got {len(matrix.values)}"
            )


def _check_data(deck: Deck, fail: Fail) -> None:
    for spline in deck.of(st.Spline).values():
        if spline.data_file is None:
            try:
                spline_data(spline)
            except ValueError as error:
                fail(spline, str(error), "x")
    for plant in deck.each(st.Plant):
        for ref in plant.variables:
            if ref not in deck.of(st.Variable):
                fail(plant, f"there is no VARIABLE/{ref}", "variables")
    for request in deck.of(st.Request).values():
        if request.type is None and not any(request.functions()) and request.function is None:
            *others, last = st.REQUEST_TYPES
            fail(request, f"give {', '.join(others)} or {last}, or F1 to F8")
        if request.type is not None and request.i is None:
            fail(request, "I is missing")


def _check_floating(deck: Deck, fail: Fail) -> None:
    """Refuse measures of floating markers: they follow a force's I marker, which is not tracked."""
    floating = {m.id for m in deck.of(st.Marker).values() if m.floating}
    if not floating:
        return
    for statement in deck:
        for name, spec in specs_of(type(statement)).items():
            text = getattr(statement, name)
            if spec.kind != EXPRESSION or text is None:
                continue
            for ref in measured_markers(text):
                if ref in floating:
                    fail(statement, f"MARKER/{ref} is FLOATING; measure at the force's I marker instead", name)


# What to write instead of arguments that are refused.


FRICTION_OF_JOINTS = (
    (("mu_stat_rot", "mu_stat_trans"), "MU_STATIC"),
    (("mu_dyn_rot", "mu_dyn_trans"), "MU_DYNAMIC"),
    (("delta_v",), "STICTION_TRANSITION_VELOCITY"),
    (("max_deformation",), "MAX_STICTION_DEFORMATION"),
)
"""Arguments of a JOINT with friction, the first given one of each counts, and those of a FRICTION statement."""


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


# Remarks on defaults of ADAMS that depend on the deck's units.


VISIBLE = 1e-3
"""Displacement of a joint that sticks, m, from which on a default is remarked."""


def remark_defaults(deck: Deck) -> None:
    """Remark on FRICTION whose stiction yields visibly, since MAX_STICTION_DEFORMATION is a number of length units."""
    found = [
        f
        for f in deck.of(st.Friction).values()
        if "deformation" not in f.given and f.effect != "SLIDING" and f.deformation * deck.units.length >= VISIBLE
    ]
    if found:
        yields = f"{found[0].deformation:g} units of length, here {1e3 * found[0].deformation * deck.units.length:g} mm"
        message = (
            f"{labels_of([f.label() for f in found])}: MAX_STICTION_DEFORMATION is not given; its default is {yields}, "
            "by which surfaces that stick still yield until the friction is whole: give a smaller one"
        )
        deck.diagnostics.append(Diagnostic(WARNING, message, deck.file, found[0].line))
