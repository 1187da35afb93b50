"""Bodies of a deck that deform: FLEX_BODY as a modal body with markers on its nodes, FE_PART as a chain of beams."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.adams.builders.builder import Builder, LeftOutError, Maker, hold, marker_orientation, part_orientation
from gearmbs.adams.builders.scopes import Beam, BodyState
from gearmbs.adams.errors import WARNING
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.data import matrix_values
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.files import named_file
from gearmbs.dae.equations.rotation import matrix_from_euler
from gearmbs.mechanism.language.library import compile_expression
from gearmbs.mechanism.language.syntax import Call, Scope, parse, walk

if TYPE_CHECKING:
    from gearmbs.flexible import BeamSection, ModalModel, ModalNeutralFile
    from gearmbs.flexible.material import Damping
    from gearmbs.mechanism.parts.bodies import Body

COUPLINGS = {"T" * 9: "full", "TTTTFTTTF": "partial", "TTTTFTTFF": "constant", "TTFFFTTFF": "constant"}
"""Levels of coupling by the inertia invariants that are kept; without a choice it is the second. The last one also
leaves out the third and the fourth, which vanish where the modes have neither momentum nor angular momentum."""
MOMENTUM = 1e-6
"""Share of its bound by Schwarz up to which the momentum of a mode vanishes."""
FREQUENCY, NUMBER = (re.compile(rf"\b{name}\b(\s*\(\s*\w*\s*\))?", re.IGNORECASE) for name in ("FXFREQ", "FXMODE"))
"""What CRATIO may ask for: the frequency of a mode in Hz, and its number."""
ON_NODE = 1e-6
"""Distance from its node, in sizes of the body, up to which a marker is on it."""

SELECTED, LOADS = "SELMOD", "MODLOAD"


def add_flex_body(b: Builder, s: st.FlexBody) -> None:
    """FLEX_BODY: a modal body from its MNF, with the damping and the coupling of the statement."""
    flexible = flexible_body(b.deck, s)
    model = flexible.model
    name = b.claim(s, "flex_body")
    level = _coupling(s, model)
    ratios: Damping = "adams"
    if s.cratio is not None:
        ratios = modal_ratios(s.cratio, model.frequencies, flexible.numbers).tolist()
    start = b.state.get(("FLEX_BODY", s.id))
    if start is None:
        start = _start(b, s, model)
    body = model.add_to(
        b.mechanism, name, damping=ratios, coupling=level, start=start.q_f.tolist() or None,
        position=start.position, orientation=start.orientation, velocity=start.velocity,
        angular_velocity=start.angular_velocity,
    )  # fmt: skip
    if start.v_f.size:
        body.rate[:] = start.v_f
    b.model.sources[body.name] = s
    b.flexible[s.id] = model
    if flexible.remark:
        b.remark(WARNING, s, flexible.remark)


def add_flexible_marker(b: Builder, statement: st.Marker) -> None:
    """MARKER with FLEX_BODY: at a node, by NODE_ID or by QP."""
    model = b.flexible.get(statement.flex_body or 0)
    if model is None:
        # its body could not be built, which is reported
        return
    body = b.mechanism.bodies[b.model.names["flex_body", statement.flex_body or 0]]
    given = b.units.length * np.array(statement.qp)
    node = statement.node_id
    if node is None:
        node = int(model.ids[np.argmin(np.linalg.norm(model.positions - given, axis=1))])
    place = model.place(node)
    off = float(np.linalg.norm(given - place))
    if (statement.node_id is None or "qp" in statement.given) and off > ON_NODE * model.size:
        raise ValueError(
            f"QP is {off / b.units.length:.4g} from node {node}; put the marker on a node, or on a PART fixed to one"
        )
    b.put_marker(statement, body, place, marker_orientation(statement))


def modal_ratios(text: str, frequencies: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Return the damping ratio that CRATIO gives each mode.

    Parameters
    ----------
    text : str
        An expression in FXFREQ (Hz) and FXMODE, the number of the mode in its file.
    frequencies, numbers : ndarray, shape (n,)
        Of the modes.

    Raises
    ------
    ValueError
        If it asks for anything else.
    """
    out = []
    for frequency, number in zip(frequencies, numbers):
        of_mode = FREQUENCY.sub(f"({float(frequency)!r})", text)
        value = compile_expression(NUMBER.sub(f"({float(number)!r})", of_mode), Scope()).constant
        if value is None:
            raise ValueError(f"CRATIO = {text} changes with time; it may depend on FXFREQ and FXMODE alone")
        out.append(value)
    return np.array(out)


def _coupling(s: st.FlexBody, model: ModalModel) -> str:
    """Return the level of coupling that a pattern of invariants asks for."""
    if not s.invariants:
        return "partial"
    pattern = "".join(word[0] for word in s.invariants)
    if pattern not in COUPLINGS:
        known = ", ".join(f"{':'.join(p)} ({level})" for p, level in COUPLINGS.items())
        raise ValueError(f"INVARIANTS = {':'.join(pattern)} is not supported; choose one of {known}")
    if pattern[2:4] == "FF" and has_momentum(model):
        raise ValueError(
            f"INVARIANTS = {':'.join(pattern)}: the modes have momentum, which cannot be left out; choose "
            "T:T:T:T:F:T:T:F:F (constant)"
        )
    return COUPLINGS[pattern]


def has_momentum(model: ModalModel) -> bool:
    """Return whether the third and fourth invariants of a body's modes do not vanish."""
    i, p = model.integrals, model.properties
    size = np.sqrt(np.diag(i.mass))[:, None]
    turning = np.sqrt(np.trace(p.inertia))
    return bool(
        np.any(np.abs(i.momentum) > MOMENTUM * size * np.sqrt(p.mass))
        or np.any(np.abs(i.angular_momentum) > MOMENTUM * size * turning)
    )


def _start(b: Builder, s: st.FlexBody, model: ModalModel) -> BodyState:
    """Return where the deck puts the body: QG and its angles, velocities of its centre of mass, modal coordinates."""
    units = b.units
    axes = part_orientation(s)
    com = model.properties.com
    own = np.eye(3)
    spin = units.factor("angular_velocity") * (b.direction(s.wm, s, axes, None) @ np.array([s.wx, s.wy, s.wz]))
    push = b.direction(s.vm, s, axes, None) if s.vm is not None else own
    velocity = units.factor("velocity") * (push @ np.array([s.vx, s.vy, s.vz]))
    for given, what in ((s.dmode, "DMODE"), (s.vmode, "VMODE")):
        if given and len(given) != model.modes:
            raise ValueError(f"{what} has {len(given)} values for {model.modes} modes")
    q_f, v_f = np.array(s.dmode), np.array(s.vmode) / units.time
    return BodyState(units.length * np.array(s.qg), axes, velocity - np.cross(spin, axes @ com), spin, q_f, v_f)


# FE_PART of a deck as beams of large motion, its markers, and FE_LOAD.
#
# Nodes become rigid bodies with the mass and the rotary inertia of their share of the beam, joined by elements of small
# strain that turn as far as they like (`gearmbs.flexible.large_beam`). Between two nodes of the deck the beam follows a
# cubic that is tangent to their x axes; it is free of stress there.


ELEMENTS = 4
"""Elements between two nodes of a deck, whose own elements are of higher order; errors fall with their square."""
EVEN = 1e-6
"""Differences of the elements' lengths, by the longest, that are rounding of the deck's numbers."""
STUBBY = 0.01
"""Share of shear in the deflection of a cantilever from which its coefficient, which a deck does not give, matters."""
SHARE = re.compile(r"(?<![A-Za-z0-9_])S(?![A-Za-z0-9_(])", re.IGNORECASE)
"""S in the functions of an FE_LOAD: the share of the length."""
NORMALS = {"3DBEAM": None, "2DBEAMXY": 2, "2DBEAMYZ": 0, "2DBEAMZX": 1}
"""Types, and the axis of the ground that plane ones stay normal to."""
FLAT = 1e-6
"""Share of the length by which nodes of a plane beam may be out of their plane, and sine of their x axes."""
OF_POINTS = frozenset(["SD", "SV", "SA"])
"""Position, velocity and acceleration at S."""


def add_fe_part(b: Builder, s: st.FePart) -> None:
    """FE_PART: nodes, and elements between them."""
    from gearmbs.flexible.large_beam import LargeBeam, node_shares

    kind = (s.type or "").upper()
    if kind not in NORMALS:
        raise LeftOutError(f"TYPE = {s.type}")
    places, turns = _line(b, s)
    sections = _sections(b, s)
    name = b.claim(s, "fe_part")
    axes = part_orientation(s)
    normal = NORMALS[kind]
    if normal is not None:
        arms = places - places[0]
        _check_plane(kind, axes[normal] @ arms.T, np.abs(arms).max(), axes[normal] @ turns[:, :, 0].T)
    origin = b.units.length * np.array(s.qg)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    of_element = [_mixed(sections[k // ELEMENTS], sections[k // ELEMENTS + 1], (k % ELEMENTS + 0.5) / ELEMENTS)
                  for k in range(len(steps))]  # fmt: skip
    even = np.ptp(steps) <= EVEN * steps.max() and all(section == sections[0][0] for section, _ in sections)
    halves = np.full(len(places), 1.0)
    halves[[0, -1]] = 0.5
    # the weights of an even chain, over the halves that are summed below
    weights = node_shares(len(steps)) / halves if even else np.ones(len(places))
    bodies = []
    for k, (place, turn) in enumerate(zip(places, turns)):
        mass, inertia = 0.0, np.zeros((3, 3))
        for e in (k - 1, k):
            if 0 <= e < len(steps):
                part, own = of_element[e]
                half = 0.5 * steps[e]
                mass += half * part.mass
                inertia += half * turn @ own @ np.diag(part.inertia) @ own.T @ turn.T
        mass, inertia = weights[k] * mass, weights[k] * inertia
        bodies.append(_node(b, s, name, k, (mass, inertia), (origin + axes @ place, axes)))
        if normal is not None:
            hold(b.mechanism, bodies[-1], "planar", normal)
    for e, (part, own) in enumerate(of_element):
        frame = _element_axes(places[e + 1] - places[e], turns[e] @ own)
        i, j = (
            bodies[k].marker(np.zeros(3), frame, name=f"{name}.beam{e + 1}.{side}")
            for k, side in ((e, "i"), (e + 1, "j"))
        )
        damping = s.cratiok * b.units.time
        b.mechanism.add(LargeBeam(f"{name}.beam{e + 1}", i, j, float(steps[e]), part, damping))
    reach = 0.5 * (np.concatenate([[0.0], steps]) + np.concatenate([steps, [0.0]]))
    labels = {label: ELEMENTS * k for k, label in enumerate(s.node_labels)}
    b.model.beams[s.id] = {label: bodies[k].name for label, k in labels.items()}
    b.beams[s.id] = Beam(bodies, labels, along / along[-1], reach, axes, places)
    part = of_element[0][0]
    if 3.0 * max(part.bending) / (min(part.shear) * along[-1] ** 2) > STUBBY:
        b.remark(WARNING, s, "it is so stubby that shear matters; its coefficient is taken as 1")


def _check_plane(kind: str, heights: np.ndarray, length: float, slopes: np.ndarray) -> None:
    """Refuse a plane beam that is not parallel to its plane of the ground."""
    if np.abs(heights).max() > FLAT * length or np.abs(slopes).max() > FLAT:
        raise ValueError(f"TYPE = {kind}: its nodes and their x axes must be parallel to that plane of the ground")


def _node(
    b: Builder,
    s: st.FePart,
    name: str,
    k: int,
    lump: tuple[float, np.ndarray],
    where: tuple[np.ndarray, np.ndarray],
) -> Body:
    """Add the body of a node, where an earlier analysis left it."""
    source = st.FeNode(id=s.id * st.NODES + k + 1, file=s.file, line=s.line, part=s.label())
    start = b.state.get((source.keyword, source.id))
    if start is None:
        start = BodyState(*where, np.zeros(3), np.zeros(3))
    body = b.mechanism.body(
        f"{name}.{k + 1}", lump[0], lump[1], position=start.position, orientation=start.orientation,
        velocity=start.velocity, angular_velocity=start.angular_velocity,
    )  # fmt: skip
    b.model.sources[body.name] = source
    return body


def _line(b: Builder, s: st.FePart) -> tuple[np.ndarray, np.ndarray]:
    """Return places (m) and axes, x along the beam, of all nodes in the part's frame."""
    from scipy.spatial.transform import Rotation, Slerp

    given = np.array(s.coordinates)
    if len(s.node_labels) < 2 or given.size != 7 * len(s.node_labels):
        raise ValueError(
            f"COORDINATES has {given.size} numbers for {len(s.node_labels)} NODE_LABELS; each of at least two nodes "
            "has its label, x, y, z and three angles"
        )
    rows = {int(row[0]): row[1:] for row in given.reshape(-1, 7)}
    missing = [label for label in s.node_labels if label not in rows]
    if missing:
        raise ValueError(f"COORDINATES has no node {missing[0]}")
    points = b.units.length * np.array([rows[label][:3] for label in s.node_labels])
    turns = np.array([matrix_from_euler(*rows[label][3:]) for label in s.node_labels])
    places, axes = [points[0]], [turns[0]]
    for k in range(len(points) - 1):
        chord = points[k + 1] - points[k]
        length = float(np.linalg.norm(chord))
        if not length > 0.0 or min(turns[k][:, 0] @ chord, turns[k + 1][:, 0] @ chord) <= 0.5 * length:
            raise ValueError(
                f"nodes {s.node_labels[k]} and {s.node_labels[k + 1]}: their x axes must lead from one to the other"
            )
        # as long as the arc of a circle with these tangents
        half = 0.5 * float(np.arccos(np.clip(turns[k][:, 0] @ turns[k + 1][:, 0], -1.0, 1.0)))
        pull = length / np.sinc(half / np.pi)
        between = Slerp([0.0, 1.0], Rotation.from_matrix(turns[k : k + 2]))
        for x in np.arange(1, ELEMENTS + 1) / ELEMENTS:
            weights = (2 * x**3 - 3 * x**2 + 1, pull * (x**3 - 2 * x**2 + x), 3 * x**2 - 2 * x**3, pull * (x**3 - x**2))
            ends = (points[k], turns[k][:, 0], points[k + 1], turns[k + 1][:, 0])
            places.append(sum(w * e for w, e in zip(weights, ends)))  # type: ignore[arg-type]
            axes.append(between(x).as_matrix())
    return np.array(places), np.array(axes)


def _sections(b: Builder, s: st.FePart) -> list[tuple[BeamSection, np.ndarray]]:
    """Return the section at each node of the deck, and its principal axes in the node's, the last one along x."""
    from gearmbs.flexible import BeamSection

    material = b.deck.of(st.Material).get(s.material or 0)
    if material is None:
        raise ValueError(f"there is no MATERIAL/{s.material}")
    if None in (material.density, material.youngs_modulus, material.poissons_ratio):
        what = f"{material.label()}{f' ({material.label_name})' if material.label_name else ''}"
        raise ValueError(f"{what} needs DENSITY, YOUNGS_MODULUS and POISSONS_RATIO")
    given = np.array(s.section)
    if given.size % 6:
        raise ValueError(f"SECTION has {given.size} numbers; each node has its label, A, IYY, IZZ, IYZ and IXX")
    rows = {int(row[0]): row[1:] for row in given.reshape(-1, 6)}
    length = b.units.length
    e = float(material.youngs_modulus or 0.0) * b.units.factor("force") / length**2
    g = e / (2.0 * (1.0 + float(material.poissons_ratio or 0.0)))
    rho = float(material.density or 0.0) * b.units.mass / length**3
    out = []
    for label in s.node_labels:
        if label not in rows:
            raise ValueError(f"SECTION has no node {label}")
        area, iyy, izz, iyz, ixx = rows[label] * length ** np.array([2, 4, 4, 4, 4])
        # moments about principal axes y and z: the eigenvalues of the tensor of the section
        moments, turn = np.linalg.eigh([[iyy, -iyz], [-iyz, izz]])
        if not (area > 0.0 and moments[0] > 0.0 and ixx > 0.0 and e > 0.0 and rho > 0.0 and g > 0.0):
            raise ValueError(f"SECTION of node {label}, or {material.label()}: its numbers must be positive")
        if np.linalg.det(turn) < 0.0:
            turn = turn[:, ::-1] * [1.0, -1.0]
            moments = moments[::-1]
            turn = turn if np.linalg.det(turn) > 0.0 else -turn
        axes = np.zeros((3, 3))
        # the element's x and y are the section's y and z, its z is along the beam
        axes[1:, 0], axes[1:, 1], axes[0, 2] = turn[:, 0], turn[:, 1], 1.0
        y, z = (float(v) for v in moments)
        part = BeamSection(
            e * area, g * ixx, (e * z, e * y), (g * area, g * area), rho * area, (rho * y, rho * z, rho * (y + z))
        )
        out.append((part, axes))
    return out


def _mixed(
    one: tuple[BeamSection, np.ndarray], other: tuple[BeamSection, np.ndarray], x: float
) -> tuple[BeamSection, np.ndarray]:
    """Return the section between two nodes; its principal axes are those of the first."""
    from gearmbs.flexible import BeamSection

    a, b = one[0], other[0]

    def mean(p: float, q: float) -> float:
        return (1 - x) * p + x * q

    bending, shear = ((mean(p[0], q[0]), mean(p[1], q[1])) for p, q in ((a.bending, b.bending), (a.shear, b.shear)))
    u, v, w = (mean(p, q) for p, q in zip(a.inertia, b.inertia))
    section = BeamSection(
        mean(a.axial, b.axial), mean(a.torsion, b.torsion), bending, shear, mean(a.mass, b.mass), (u, v, w)
    )
    return section, one[1]


def _element_axes(chord: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return axes whose z is along a chord, x as near to that of others as can be."""
    z = chord / np.linalg.norm(chord)
    x = axes[:, 0] - z * (z @ axes[:, 0])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def add_node_marker(b: Builder, s: st.Marker) -> None:
    """MARKER with FE_PART: fixed to a node, where QP puts it in the frame of the part."""
    beam = b.beams.get(s.fe_part or 0)
    if beam is None:
        # its part could not be built, which is reported
        return
    if s.node_label not in beam.labels:
        raise ValueError(f"FE_PART/{s.fe_part} has no node {s.node_label}; it has {', '.join(map(str, beam.labels))}")
    k = beam.labels[s.node_label]
    b.put_marker(s, beam.bodies[k], b.units.length * np.array(s.qp) - beam.places[k], marker_orientation(s))


def add_fe_load(b: Builder, s: st.FeLoad) -> None:
    """FE_LOAD: at each node the force and torque of the length that it stands for."""
    beam = b.beams.get(s.fe_part or 0)
    if beam is None:
        return
    given = {c: text for c in ("fx", "fy", "fz", "tx", "ty", "tz") if (text := getattr(s, c)) is not None}
    if not given:
        raise ValueError("give at least one of FX, FY, FZ, TX, TY, TZ")
    asked = {
        n.name for text in given.values() for n in walk(parse(text)) if isinstance(n, Call) and n.name in OF_POINTS
    }
    if asked:
        raise ValueError(f"{min(asked)} of a point of the beam is not read; S and markers at nodes are")
    name = b.claim(s, "fe_load")
    ground = b.ground_marker(f"{name}.reaction")
    for k, body in enumerate(beam.bodies):
        reach = float(beam.reach[k] / b.units.length)
        at = f"({float(beam.share[k])!r})"
        parts = {c: f"({b.text(SHARE.sub(at, text))})*({reach!r})" for c, text in given.items()}
        rm = b.markers[s.rm] if s.rm is not None else ground
        marker = body.marker(name=f"{name}.{k + 1}")
        b.mechanism.load(f"{name}.{k + 1}", marker, ground, rm=rm, kind="fe_load", **parts)  # type: ignore[arg-type]


DEFORMING: dict[type, Maker] = {st.FlexBody: add_flex_body, st.FePart: add_fe_part}
"""What adds bodies that deform."""
ON_NODES: dict[str, Maker] = {"FLEX_BODY": add_flexible_marker, "FE_PART": add_node_marker}
"""What adds their markers."""
LINE_LOADS: dict[type, Maker] = {st.FeLoad: add_fe_load}


# What a FLEX_BODY is made of: its modal neutral file, and what of its MATRICES has a meaning that can be checked.
#
# ADAMS/View writes the matrices from the neutral file. Those that choose modes (SELMOD) and hold load cases (MODLOAD)
# are read. The modes chosen are believed when their frequencies are those of the file.


SAME = 1e-3
"""Relative difference of a frequency of SELMOD from that of the file."""


@dataclass(frozen=True, eq=False)
class FlexibleBody:
    """A FLEX_BODY of a deck.

    Attributes
    ----------
    model : ModalModel
        With the modes that are used.
    numbers : ndarray of int
        Of these modes in their file.
    loads : ndarray, shape (6 + n, cases), or None
        Load cases in the deck's units: force and torque about the body's origin, in its axes, and the forces on modes.
    remark : str
        What was not read, or empty.
    """

    model: ModalModel
    numbers: np.ndarray
    loads: np.ndarray | None
    remark: str


def flexible_body(deck: Deck, s: st.FlexBody) -> FlexibleBody:
    """Return what a FLEX_BODY is made of.

    Raises
    ------
    ValueError
        If it has no file, or the file or its matrices cannot be.
    """
    mnf = _neutral_file(deck, s)
    model = mnf.modal_model(s.name or s.label())
    numbers = mnf.mode_ids[mnf.elastic]
    selected = _matrix(deck, s, SELECTED)
    remark = ""
    if selected is not None:
        chosen = _selected(selected, numbers, model.frequencies * deck.units.time)
        if chosen is not None:
            model, numbers = model.selected(chosen), numbers[chosen]
        else:
            remark = (
                f"{SELECTED} does not hold modes of the MNF with their frequencies; all {model.modes} elastic are taken"
            )
    elif s.matrices:
        remark = f"all {model.modes} elastic modes of the MNF are taken; which of them MATRICES select is not read"
    loads = _matrix(deck, s, LOADS)
    if loads is not None and loads.shape[0] != 6 + model.modes:
        raise ValueError(
            f"{LOADS} has {loads.shape[0]} rows; force, torque and {model.modes} modes that are used make "
            f"{6 + model.modes}"
        )
    return FlexibleBody(model, numbers, loads, remark)


def _neutral_file(deck: Deck, s: st.FlexBody) -> ModalNeutralFile:
    """Read the body's MNF, once a deck."""
    from gearmbs.flexible import FlexibleError, read_mnf

    if s.mnf_file is None:
        raise ValueError(
            "MNF_FILE is missing; bodies from MATRICES alone, whose order and layout are not published, MD DB and BDF "
            "files are not read. Write MNF_FILE = the body's modal neutral file; of matrices with a table of nodes one "
            "is made by gearmbs.flexible: write_mnf(path, mnf_of(reduce_model(from_matrices(k, m, positions), faces)))"
        )
    if "://" in s.mnf_file:
        raise ValueError(f"MNF_FILE = {s.mnf_file}: no database of ADAMS/Car is looked up; give the path of the file")
    path = named_file("MNF_FILE", s.mnf_file, deck.file)
    key = str(path)
    if key not in deck.modal_files:
        if not path.exists():
            raise ValueError(f"MNF_FILE = {s.mnf_file}: No such file or directory; looked for {path}")
        try:
            deck.modal_files[key] = read_mnf(path)
        except FlexibleError as error:
            raise ValueError(str(error)) from error
    return deck.modal_files[key]


def _matrix(deck: Deck, s: st.FlexBody, name: str) -> np.ndarray | None:
    """Return one of the body's matrices by its name, None if it has none that can be read."""
    for ref in s.matrices:
        statement = deck.of(st.Matrix).get(ref)
        if statement is None:
            raise ValueError(f"there is no MATRIX/{ref} for MATRICES")
        given = (statement.matrix_name or statement.name or "").upper()
        if given != name and not given.endswith(f"_{name}"):
            continue
        try:
            return matrix_values(statement)
        except ValueError as error:
            if name == LOADS:
                raise ValueError(f"{LOADS}: {error}") from error
    return None


def _selected(matrix: np.ndarray, numbers: np.ndarray, frequencies: np.ndarray) -> np.ndarray | None:
    """Return the places of the modes that a matrix lists with their frequencies, None if it does not."""
    rows = matrix if matrix.shape[1] == 2 else matrix.T
    if rows.ndim != 2 or rows.shape[1] != 2:
        return None
    place = {int(number): k for k, number in enumerate(numbers)}
    chosen = [place.get(int(number), -1) for number in rows[:, 0]]
    if not chosen or min(chosen) < 0 or len(set(chosen)) != len(chosen):
        return None
    known = frequencies[chosen]
    return np.array(chosen) if np.all(np.abs(rows[:, 1] - known) <= SAME * known) else None
