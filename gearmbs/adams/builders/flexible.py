"""FLEX_BODY of a deck as a modal body, and the markers on its nodes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.adams.builders.builder import Builder
from gearmbs.adams.builders.flexible_data import flexible_body
from gearmbs.adams.builders.frames import marker_orientation, part_orientation
from gearmbs.adams.builders.model import BodyState
from gearmbs.adams.errors import WARNING
from gearmbs.adams.parse import statements as st
from gearmbs.mechanism.expression_compiler import compile_expression
from gearmbs.mechanism.expression_syntax import Scope

if TYPE_CHECKING:
    from gearmbs.flexible import ModalModel
    from gearmbs.flexible.damping import Damping

COUPLINGS = {"T" * 9: "full", "TTTTFTTTF": "partial", "TTTTFTTFF": "constant", "TTFFFTTFF": "constant"}
"""Levels of coupling by the inertia invariants that are kept; without a choice it is the second. The last one also
leaves out the third and the fourth, which vanish where the modes have neither momentum nor angular momentum."""
MOMENTUM = 1e-6
"""Share of its bound by Schwarz up to which the momentum of a mode vanishes."""
FREQUENCY, NUMBER = (re.compile(rf"\b{name}\b(\s*\(\s*\w*\s*\))?", re.IGNORECASE) for name in ("FXFREQ", "FXMODE"))
"""What CRATIO may ask for: the frequency of a mode in Hz, and its number."""
ON_NODE = 1e-6
"""Distance from its node, in sizes of the body, up to which a marker is on it."""


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
