"""From the objects of a model to the statements of a deck: forces, contacts and the solids that touch."""

from __future__ import annotations

import math
from collections.abc import Callable

from gearmbs.adams.view.deckmaker import JOINTS, Deckmaker
from gearmbs.adams.view.geometry.masses import bodies_of
from gearmbs.adams.view.geometry.solids import extrusion_outline, link_outline, plate_outline
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import PARTS, Item
from gearmbs.adams.view.statements import refuse
from gearmbs.adams.view.values import fixed
from gearmbs.adams.write.text import listed, number
from gearmbs.solids.bodies import PART_NUMBER


def make_gravity(m: Deckmaker, item: Item) -> None:
    """ACCGRAV."""
    arguments = [m.real(item, f"{c}_component_gravity", f"{k}GRAV") for c, k in zip("xyz", "IJK")]
    m.add(item, "ACCGRAV/", *arguments)


def make_sforce(m: Deckmaker, item: Item) -> None:
    """SFORCE."""
    turning = m.values.word(item, "type_of_freedom", "translational").startswith("rot")
    only = "ACTIONONLY" if m.yes(item, "action_only") else None
    function = m.user(item) or [m.expression(item, "function", "FUNCTION", "0")]
    m.add(item, f"SFORCE/{m.id(item)}", "ROTATIONAL" if turning else "TRANSLATIONAL", *m.pair(item), only, *function)


COMPONENTS: dict[str, tuple[tuple[str, str], ...]] = {
    "vforce": (("x_force_function", "FX"), ("y_force_function", "FY"), ("z_force_function", "FZ")),
    "vtorque": (("x_torque_function", "TX"), ("y_torque_function", "TY"), ("z_torque_function", "TZ")),
}
COMPONENTS["gforce"] = COMPONENTS["vforce"] + COMPONENTS["vtorque"]


def make_load(m: Deckmaker, item: Item) -> None:
    """VFORCE, VTORQUE or GFORCE."""
    floating = m.ref(item, "j_floating_marker_name", "JFLOAT", ("floating_marker", "marker"))
    part = m.values.ref(item, "j_part_name", PARTS)
    if floating is None and part is not None:
        made = m.fresh("MARKER")
        m.add(item, f"MARKER/{made}", m.owner_argument(part), "FLOATING")
        floating = f"JFLOAT = {made}"
    user = m.user(item)
    functions = user or [m.expression(item, key, keyword, "0") for key, keyword in COMPONENTS[item.kind]]
    if user is not None:
        item.used |= {key for key, _ in COMPONENTS[item.kind]}
    m.add(
        item,
        f"{item.kind.upper()}/{m.id(item)}",
        m.ref(item, "i_marker_name", "I", ("marker",)),
        floating,
        m.ref(item, "ref_marker_name", "RM", ("marker",)),
        *functions,
    )


TRANSLATIONAL = (0, 1, 2, 6, 7, 11)
"""Of the 21 numbers of a symmetric matrix, by columns from the diagonal on, those of forces and velocities alone."""


def make_beam(m: Deckmaker, item: Item) -> None:
    """BEAM."""
    damping = m.values.numbers(item, "matrix_of_damping_terms", 21) or []
    if m.radian != 1.0 and any(x for k, x in enumerate(damping) if k not in TRANSLATIONAL):
        raise ViewError(
            "matrix_of_damping_terms: whether those of rotations are of degrees or radians is not known; give "
            "damping_ratio, or choose radians",
            item.line,
        )
    m.add(
        item,
        f"BEAM/{m.id(item)}",
        *m.pair(item),
        *(
            m.real(item, key, keyword)
            for key, keyword in (
                ("length", "LENGTH"),
                ("ixx", "IXX"),
                ("iyy", "IYY"),
                ("izz", "IZZ"),
                ("area_of_cross_section", "AREA"),
                ("y_shear_area_ratio", "ASY"),
                ("z_shear_area_ratio", "ASZ"),
                ("youngs_modulus", "EMODULUS"),
                ("shear_modulus", "GMODULUS"),
                ("damping_ratio", "CRATIO"),
            )
        ),
        m.reals(item, "matrix_of_damping_terms", "CMATRIX", 21),
        f"FORMULATION = {m.values.word(item, 'formulation').upper()}" if "formulation" in item.fields else None,
    )


def make_bushing(m: Deckmaker, item: Item) -> None:
    """BUSHING; View's rotational constants are for its unit of angle, a deck's for radians."""
    m.add(
        item,
        f"BUSHING/{m.id(item)}",
        *m.pair(item),
        m.reals(item, "stiffness", "K", 3),
        m.reals(item, "tstiffness", "KT", 3, 1.0 / m.radian),
        m.reals(item, "damping", "C", 3),
        m.reals(item, "tdamping", "CT", 3, 1.0 / m.radian),
        m.reals(item, "force_preload", "FORCE", 3),
        m.reals(item, "torque_preload", "TORQUE", 3),
    )


def make_field(m: Deckmaker, item: Item) -> None:
    """FIELD."""
    user = m.user(item)
    if user is not None:
        m.add(item, f"FIELD/{m.id(item)}", *m.pair(item), *user)
        return
    matrices = []
    for key, keyword in (("stiffness_matrix", "KMATRIX"), ("matrix_of_damping_terms", "CMATRIX")):
        values = m.values.numbers(item, key, 36)
        if values is not None:
            # by columns: the last three are for angles
            scaled = [*values[:18], *(x / m.radian for x in values[18:])]
            matrices.append(f"{keyword} = {listed(scaled)}")
    at = [*(m.values.numbers(item, "translation_at_preload", 3) or [0.0] * 3)]
    at += [x * m.radian for x in m.values.numbers(item, "rotation_at_preload", 3) or [0.0] * 3]
    force = [*(m.values.numbers(item, "force_preload", 3) or [0.0] * 3)]
    force += m.values.numbers(item, "torque_preload", 3) or [0.0] * 3
    ratio = m.real(item, "damping_ratio", "CRATIO")
    m.add(
        item, f"FIELD/{m.id(item)}", *m.pair(item), *matrices, ratio,
        f"LENGTH = {listed(at)}" if any(at) else None, f"FORCE = {listed(force)}" if any(force) else None,
    )  # fmt: skip


def make_spring(m: Deckmaker, item: Item) -> None:
    """SPRINGDAMPER along a line or about an axis."""
    turning = item.kind == "rotational_spring"
    names, per = (("KT", "CT", "ANGLE", "TORQUE"), 1.0 / m.radian) if turning else (("K", "C", "LENGTH", "FORCE"), 1.0)
    if not turning and "displacement_at_preload" not in item.fields:
        m.remark(item, "without displacement_at_preload its free length is 0")
    m.add(
        item,
        f"SPRINGDAMPER/{m.id(item)}",
        *m.pair(item),
        "ROTATIONAL" if turning else "TRANSLATIONAL",
        m.real(item, "damping", names[1], per),
        m.real(item, "stiffness", names[0], per),
        m.real(item, "displacement_at_preload", names[2], 1.0 / per),
        m.real(item, "preload", names[3]),
    )


FRICTION = (
    ("mu_static", "MU_STATIC"), ("mu_dynamic", "MU_DYNAMIC"),
    ("stiction_transition_velocity", "STICTION_TRANSITION_VELOCITY"),
    ("max_stiction_deformation", "MAX_STICTION_DEFORMATION"), ("friction_force_preload", "FRICTION_FORCE_PRELOAD"),
    ("friction_torque_preload", "FRICTION_TORQUE_PRELOAD"), ("friction_arm", "FRICTION_ARM"),
    ("bending_reaction_arm", "BENDING_REACTION_ARM"), ("pin_radius", "PIN_RADIUS"), ("reaction_arm", "REACTION_ARM"),
    ("ball_radius", "BALL_RADIUS"), ("initial_overlap", "INITIAL_OVERLAP"),
    ("max_friction_force", "MAX_FRICTION_FORCE"), ("max_friction_torque", "MAX_FRICTION_TORQUE"),
)  # fmt: skip
INPUTS = ("preload", "reaction_force", "bending_moment", "torsional_moment")


def make_friction(m: Deckmaker, item: Item) -> None:
    """FRICTION of a joint."""
    joint = m.ref(item, "joint_name", "JOINT", tuple(JOINTS))
    words = [
        f"{keyword} = {m.values.word(item, key).upper()}"
        for key, keyword in (("effect", "EFFECT"), ("overlap_delta", "OVERLAP_DELTA"), ("yoke", "YOKE"))
        if key in item.fields
    ]
    given = [key for key in INPUTS if key in item.fields]
    if given and not all(m.yes(item, key) for key in given):
        kept = [key.upper() for key in INPUTS if key not in item.fields or m.yes(item, key)]
        words.append(f"INPUTS = {', '.join(kept) or 'NONE'}")
    if m.yes(item, "inactive_during_static"):
        words.append("INACTIVE = STATIC")
    if m.values.word(item, "formulation", "original") != "original":
        raise ViewError(f"formulation = {m.values.word(item, 'formulation')}: one law of friction is computed")
    m.add(item, f"FRICTION/{m.id(item)}", joint, *(m.real(item, key, word) for key, word in FRICTION), *words)


# Contacts.


def _size(m: Deckmaker, shape: Item, *pairs: tuple[str, str]) -> list[str]:
    found = []
    for key, keyword in pairs:
        value = m.values.number(shape, key)
        if value is None:
            raise ViewError(f"{shape.path} has no {key}", shape.line)
        found.append(f"{keyword} = {number(value)}")
    angle = m.values.number(shape, "angle_extent")
    if angle is not None and abs(angle * m.radian - 2.0 * math.pi) > 1e-9:
        found.append(f"RANGLE = {number(angle * m.radian)}")
    return found


def _solid(m: Deckmaker, shape: Item) -> list[str | None]:
    """Return the arguments of the GRAPHICS of a solid that touches others."""
    kind = shape.kind
    if not m.active(shape):
        raise ViewError(f"{shape.path} is not active; take it out of the contact")
    if kind != "csg" and any(m.active(one) for one in shape.children.values()):
        raise ViewError(f"{shape.path} has features, which cannot touch here; leave them out, or give a mesh in a file")
    marker = m.ref(shape, "center_marker", "CM", ("marker",))
    if kind == "block":
        size = m.values.numbers(shape, "diag_corner_coords", 3) or [0.0] * 3
        at = m.ref(shape, "corner_marker", "CORNER", ("marker",))
        return ["BOX", at, *(f"{c} = {number(x)}" for c, x in zip("XYZ", size))]
    if kind == "cylinder":
        return ["CYLINDER", marker, *_size(m, shape, ("length", "LENGTH"), ("radius", "RADIUS"))]
    if kind == "ellipsoid":
        return ["ELLIPSOID", marker, *_size(m, shape, *((f"{c}_scale_factor", f"{c.upper()}SCALE") for c in "xyz"))]
    if kind == "sphere":
        r = m.values.number(shape, "radius") or 0.0
        return ["ELLIPSOID", marker, *(f"{c}SCALE = {number(2.0 * r)}" for c in "XYZ")]
    if kind == "frustum":
        pairs = (("length", "LENGTH"), ("bottom_radius", "BOTTOM"), ("top_radius", "TOP"))
        return ["FRUSTUM", marker, *_size(m, shape, *pairs)]
    if kind == "torus":
        return ["TORUS", marker, *_size(m, shape, ("major_radius", "MAJOR_RADIUS"), ("minor_radius", "MINOR_RADIUS"))]
    if kind == "plane":
        limits = (("x_minimum", "XMIN"), ("x_maximum", "XMAX"), ("y_minimum", "YMIN"), ("y_maximum", "YMAX"))
        return [
            "PLANE", m.ref(shape, "ref_marker_name", "RM", ("marker",)),
            *(m.real(shape, key, keyword) for key, keyword in limits),
        ]  # fmt: skip
    if kind in OUTLINES:
        return _drawn_out(m, shape)
    if kind == "parasolid":
        return _of_file(m, shape)
    if kind == "shell":
        return _facets(m, shape)
    raise ViewError(
        f"{shape.path} is a {kind}, which cannot touch here; give a block, cylinder, frustum, torus, ellipsoid, link, "
        "plate, extrusion or shell"
    )


OUTLINES = {"link": link_outline, "plate": plate_outline, "extrusion": extrusion_outline}
"""Solids that are an outline drawn out along z: their marker, the outline, and where it begins and ends."""


def _drawn_out(m: Deckmaker, shape: Item) -> list[str | None]:
    """Return the arguments of an EXTRUSION, and make its curve and, where it begins off the marker, its own marker."""
    marker, points, low, high = OUTLINES[shape.kind](m, shape)
    a, r = m.values.pose(marker)
    part = m.db.owner(marker)
    if part is None:
        raise ViewError(f"{marker.path} belongs to no part")
    at = m.id(marker) if low == 0.0 else m.new_marker(shape, part, a, r + low * a[:, 2])
    matrix, curve = m.fresh("MATRIX"), m.fresh("CURVE")
    closed = [*points, points[0]]
    values = listed(float(x) for p in closed for x in (p[0], p[1], 0.0))
    m.add(shape, f"MATRIX/{matrix}", "FULL = RORDER", f"ROWS = {len(closed)}", "COLUMNS = 3", f"VALUES = {values}")
    m.add(shape, f"CURVE/{curve}", "CLOSED", "CURVE_POINTS", "ORDER = 2", f"MATRIX = {matrix}")
    return ["EXTRUSION", f"RM = {at}", f"CID = {curve}", f"LENGTH = {number(high - low)}"]


def _shapes(m: Deckmaker, item: Item, side: str) -> list[Item]:
    """Return the solids of one side of a contact; those of a Parasolid file are entered under their names.

    Raises
    ------
    ViewError
        If one is neither in the command file nor in such a file.
    """
    key = f"{side}_geometry_name"
    found = []
    for value in m.values.values(item, key) if key in item.fields else ():
        shape = value if isinstance(value, Item) else m.db.find(str(value))
        if shape is None:
            owner, _, name = str(value).rpartition(".")
            part = m.db.find(owner, PARTS)
            body = (
                next((b for b in bodies_of(m, part) if b.name.lower() == name.lower()), None)
                if part is not None
                else None
            )
            if part is None or body is None:
                raise ViewError(f"{key}: there is no {str(value)[:80]}, neither here nor in a Parasolid file beside")
            shape = Item("parasolid", f"{part.path}.{name}", item.line, {"part": fixed(part)})
        found.append(m.solids.setdefault(shape.path.lower(), shape))
    return found


def _facets(m: Deckmaker, shape: Item) -> list[str | None]:
    """Return the arguments of a shell of a file beside the command file, which touches with its facets."""
    name = m.values.text(shape, "file_name") or ""
    path = m.beside(name)
    if path is None:
        raise ViewError(f"{name[:80]} of {shape.path} is not beside the command file", shape.line)
    marker, part = m.values.ref(shape, "reference_marker", ("marker",)), m.db.owner(shape)
    if part is None:
        raise ViewError(f"{shape.path} belongs to no part", shape.line)
    at = m.new_marker(shape, part, *m.values.pose(part)) if marker is None else m.id(marker)
    return ["EXTERNAL", f"RM = {at}", f"FILE = {path.name}"]


def _of_file(m: Deckmaker, shape: Item) -> list[str | None]:
    """Return the arguments of a solid of a Parasolid file: it is in the frame of its part."""
    part = m.values.ref(shape, "part", PARTS)
    assert part is not None
    for path, bodies in m.bodies.items():
        if any(
            b.name.lower() == shape.name.lower() and b.attributes.get(PART_NUMBER) == m.ids[id(part)] for b in bodies
        ):
            at = m.new_marker(shape, part, *m.values.pose(part))
            return ["EXTERNAL", f"RM = {at}", f"FILE = {path.name}", f"ELEMENT = {shape.name}"]
    raise ViewError(f"{shape.path} is in no Parasolid file")


def _graphics(m: Deckmaker, item: Item, side: str) -> str:
    ids = []
    for shape in _shapes(m, item, side):
        if id(shape) not in m.graphics:
            arguments = _solid(m, shape)
            m.graphics[id(shape)] = m.fresh("GRAPHICS")
            m.add(shape, f"GRAPHICS/{m.graphics[id(shape)]}", *arguments)
        ids.append(str(m.graphics[id(shape)]))
    if not ids:
        raise ViewError(f"{side}_geometry_name is missing")
    return f"{side.upper()}GEOM = {', '.join(ids)}"


LAW = (
    ("stiffness", "STIFFNESS"), ("damping", "DAMPING"), ("exponent", "EXPONENT"), ("dmax", "DMAX"),
    ("penalty", "PENALTY"), ("restitution_coefficient", "RESTITUTION_COEFFICIENT"),
)  # fmt: skip
RUBBING = (
    ("mu_static", "MU_STATIC"), ("mu_dynamic", "MU_DYNAMIC"),
    ("stiction_transition_velocity", "STICTION_TRANSITION_VELOCITY"),
    ("friction_transition_velocity", "FRICTION_TRANSITION_VELOCITY"),
)  # fmt: skip


def make_contact(m: Deckmaker, item: Item) -> None:
    """CONTACT, and the GRAPHICS that it names."""
    before = dict(m.graphics)
    try:
        sides = [_graphics(m, item, side) for side in "ij"]
    except ViewError:
        m.graphics = before
        raise
    law = "POISSON" if "penalty" in item.fields and "stiffness" not in item.fields else "IMPACT"
    coulomb = m.values.word(item, "coulomb_friction", "off").upper()
    if m.yes(item, "no_friction"):
        coulomb = "OFF"
    item.used |= {"max_stiction_deformation"}
    item.used |= {f"{side}_{what}" for side in "ij" for what in ("flip_normal", "flip_geometry_name")}
    rubbing = [m.real(item, key, word) for key, word in RUBBING]
    if m.yes(item, "stiction"):
        rubbing += ["STICTION = ON", m.real(item, "max_stiction_deformation", "MAX_STICTION_DEFORMATION")]
    m.add(
        item,
        f"CONTACT/{m.id(item)}",
        *sides,
        law,
        *(m.real(item, key, word) for key, word in LAW),
        "AUGMENTED_LAGRANGIAN_FORMULATION" if m.yes(item, "augmented_lagrangian_formulation") else None,
        *([f"COULOMB_FRICTION = {coulomb}", *rubbing] if coulomb != "OFF" else []),
    )


MAKERS: dict[str, Callable[[Deckmaker, Item], None]] = {
    "gravity": make_gravity,
    "sforce": make_sforce,
    "vforce": make_load,
    "vtorque": make_load,
    "gforce": make_load,
    "beam": make_beam,
    "bushing": make_bushing,
    "field": make_field,
    "spring": make_spring,
    "rotational_spring": make_spring,
    "friction": make_friction,
    "contact": make_contact,
    "nforce": refuse("a force on many points is not modelled; give beams or fields between neighbouring parts"),
    "fe_load": refuse("loads on FE parts are read in decks; write FE_LOAD into the deck of --to-deck"),
    "modal_force": refuse("a modal force is read in decks; write MFORCE into the deck of --to-deck"),
}
