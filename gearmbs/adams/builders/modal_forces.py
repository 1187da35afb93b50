"""MFORCE: distributions of forces on a FLEX_BODY, from its load cases or from a routine."""

from __future__ import annotations

import numpy as np

from gearmbs.adams.builders.builder import Builder
from gearmbs.adams.builders.modal_loads import load_case, load_cases, no_cases
from gearmbs.adams.parse import statements as st
from gearmbs.mechanism.forces.modal_force import add_modal_force
from gearmbs.mechanism.modal import ModalBody


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
