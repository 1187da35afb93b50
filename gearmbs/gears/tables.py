"""Pack a gear pair into the flat tables of the contact kernel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.contact import layout as L

if TYPE_CHECKING:
    from gearmbs.gears.pair import GearPair
    from gearmbs.gears.spec import GearSpec

LAWS = {
    "impact": L.LAW_IMPACT,
    "hunt-crossley": L.LAW_HUNT_CROSSLEY,
    "linear": L.LAW_IMPACT,
    "hertz": L.LAW_IMPACT,
}
FRICTIONS = {"none": L.FRICTION_NONE, "adams": L.FRICTION_ADAMS, "smooth": L.FRICTION_SMOOTH}
EDGE_BLEND = 1e-6


def _pack_wheel(gear: GearSpec, gr: np.ndarray, base: int) -> None:
    gr[base + L.RB] = gear.base_radius
    gr[base + L.PSI] = gear.base_half_angle
    gr[base + L.S_TIP] = gear.tip_string
    gr[base + L.R_CORNER] = gear.corner_radius
    gr[base + L.PSI_CORNER] = gear.corner_half_angle
    gr[base + L.R_ROUND] = gear.tip_rounding
    gr[base + L.R_TIP] = gear.tip_radius
    gr[base + L.R_ROOT] = gear.root_radius
    gr[base + L.FACE] = gear.face_width
    gr[base + L.S_FORM] = gear.form_string
    gr[base + L.R_FILLET] = gear.fillet_radius
    gr[base + L.R_FILLET_CENTRE] = gear.fillet_centre_radius
    gr[base + L.PSI_FILLET] = gear.fillet_half_angle


def pack(pair: GearPair, slices: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Tables ``gi``, ``gr`` and the length of the scratch array for ``gear_contact``."""
    gi = np.zeros(L.GI_HEADER, dtype=np.int64)
    gr = np.zeros(L.GR_HEADER)
    first, second = pair.wheels
    gi[L.Z1] = first.teeth
    gi[L.Z2] = second.teeth
    gi[L.N_SLICES] = slices
    gi[L.LAW] = LAWS[pair.contact.kind]
    gi[L.FRICTION] = FRICTIONS[pair.friction.kind]
    gi[L.DRIVE] = pair.rotation
    gi[L.LOAD] = L.LOAD_ADAMS if pair.load == "adams" else L.LOAD_SLICES
    _pack_wheel(first, gr, 0)
    _pack_wheel(second, gr, L.WHEEL)
    gr[L.PITCH] = first.base_pitch
    width = pair.common_face_width
    law = pair.contact
    gr[L.LAW_K] = law.stiffness / width
    gr[L.LAW_E] = law.exponent
    gr[L.LAW_C] = law.damping if law.kind == "hunt-crossley" else law.damping / width
    gr[L.LAW_D] = law.depth
    gr[L.MU_S] = pair.friction.static
    gr[L.MU_D] = pair.friction.dynamic
    gr[L.V_S] = pair.friction.static_speed
    gr[L.V_D] = pair.friction.dynamic_speed
    gr[L.WIDTH] = width
    gr[L.EDGE_BLEND] = EDGE_BLEND
    low, high = pair.common_face
    gr[L.ZETA_LO] = low
    gr[L.ZETA_HI] = high
    return gi, gr, L.work_size(slices)
