"""Pack a gear pair into the flat tables of the contact kernel."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.gears.contact_model import ContactModel
from gearmbs.gears.mesh import Mesh
from gearmbs.gears.spec import GearSpec
from gearmbs.gears.stiffness import compliance_roll_lengths, pair_stiffness
from gearmbs.gears.tooth_deviations import COMPLIANCE_POINTS, PROFILE_POINTS, ToothDeviations

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
    gr[base + L.S_TIP] = gear.tip_roll_length
    gr[base + L.R_CORNER] = gear.corner_radius
    gr[base + L.PSI_CORNER] = gear.corner_half_angle
    gr[base + L.R_ROUND] = gear.tip_rounding
    gr[base + L.R_TIP] = gear.tip_radius
    gr[base + L.R_ROOT] = gear.root_radius
    gr[base + L.FACE] = gear.face_width
    gr[base + L.S_FORM] = gear.form_roll_length
    gr[base + L.R_FILLET] = gear.fillet_radius
    gr[base + L.R_FILLET_CENTRE] = gear.fillet_centre_radius
    gr[base + L.PSI_FILLET] = gear.fillet_half_angle


def pack(pair: Mesh, slices: int | None = None) -> tuple[np.ndarray, np.ndarray, int]:
    """Tables ``gi``, ``gr`` and the length of the work array for ``gear_contact``.

    Parameters
    ----------
    pair : Mesh
    slices : int, optional
        Slices along the face, default the pair's own.
    """
    geometry, model, point = pair.geometry, pair.contact_model, pair.operating_point
    slices = model.face_slices(geometry, pair.faults) if slices is None else slices
    gi = np.zeros(L.GI_HEADER, dtype=np.int64)
    gr = np.zeros(L.GR_HEADER)
    first, second = geometry.wheels
    gi[L.Z1] = first.teeth
    gi[L.Z2] = second.teeth
    gi[L.N_SLICES] = slices
    gi[L.LAW] = LAWS[model.law.kind]
    gi[L.FRICTION] = FRICTIONS[model.friction.kind]
    gi[L.DRIVE] = point.rotation
    gi[L.LOAD] = L.LOAD_ADAMS if model.load == "adams" else L.LOAD_SLICES
    gi[L.ROOT] = int(model.tips_may_bottom(geometry))
    _pack_wheel(first, gr, 0)
    _pack_wheel(second, gr, L.WHEEL)
    gr[L.PITCH] = first.base_pitch
    width = geometry.common_face_width
    _pack_laws(model, width, gr)
    gr[L.WIDTH] = width
    gr[L.EDGE_BLEND] = EDGE_BLEND
    low, high = geometry.common_face
    gr[L.ZETA_LO] = low
    gr[L.ZETA_HI] = high
    gr[L.AXIAL_SHIFT] = geometry.axial_shift
    if pair.faults or model.stiffness_curve != "constant":
        gi, gr = _pack_teeth(pair, gi, gr)
    return gi, gr, L.work_size(slices)


def _pack_laws(model: ContactModel, width: float, gr: np.ndarray) -> None:
    law, friction = model.law, model.friction
    gr[L.LAW_K] = law.stiffness / width
    gr[L.LAW_E] = law.exponent
    gr[L.LAW_C] = law.damping if law.kind == "hunt-crossley" else law.damping / width
    gr[L.LAW_D] = law.depth
    gr[L.MU_S] = friction.static
    gr[L.MU_D] = friction.dynamic
    gr[L.V_S] = friction.static_speed
    gr[L.V_D] = friction.dynamic_speed


def tooth_deviations(pair: Mesh) -> tuple[ToothDeviations, ToothDeviations]:
    """Deviations of all teeth of both wheels, with every fault applied."""
    geometry, rotation = pair.geometry, pair.operating_point.rotation
    along_face = any(fault.along_face for fault in pair.faults)
    roll_length = compliance_roll_lengths(geometry)
    both = (
        ToothDeviations(geometry.wheels[0], rotation, along_face, roll_length),
        ToothDeviations(geometry.wheels[1], rotation, along_face, geometry.mate_roll_length(0, roll_length)),
    )
    for fault in pair.faults:
        fault.apply(both[fault.wheel == "driven"], geometry)
    return both


def _numbered(rows: np.ndarray, plain: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number of the distinct row for each row, -1 where it is the plain one, and the distinct rows."""
    distinct, number = np.unique(rows, axis=0, return_inverse=True)
    number = number.reshape(-1)
    return np.where((rows == plain).all(axis=1), -1, number), distinct


def _pack_teeth(pair: Mesh, gi: np.ndarray, gr: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    both = tooth_deviations(pair)
    nz = both[0].section.size
    records = [c.offset.size for c in both]
    tooth = np.full((sum(records), L.TOOTH), -1, dtype=np.int64)
    base_curve = np.ones(COMPLIANCE_POINTS)
    if pair.contact_model.stiffness_curve == "potential-energy":
        stiffness = pair_stiffness(pair.geometry, compliance_roll_lengths(pair.geometry))
        base_curve = stiffness.max() / stiffness
    parts: dict[str, list[np.ndarray]] = {"offset": [], "shape": [], "tip": [], "compliance": []}
    counts = {"shape": 0, "tip": 0, "compliance": 0}
    added = 0.0
    start = 0
    for k, deviations in enumerate(both):
        rows = slice(start, start + records[k])
        parts["offset"].append(deviations.offset.ravel())
        kinds = (
            ("shape", deviations.shape.reshape(records[k], -1), 0.0),
            ("tip", deviations.tip.reshape(records[k], -1), deviations.gear.tip_roll_length),
            ("compliance", deviations.compliance.reshape(records[k], -1) * base_curve, 0.0),
        )
        for column, (name, data, plain) in enumerate(kinds):
            number, distinct = _numbered(data, np.full(data.shape[1], plain))
            tooth[rows, column] = np.where(number < 0, -1, number + counts[name])
            counts[name] += len(distinct)
            parts[name].append(distinct.ravel())
        removed = deviations.offset[:, :, None, None] + deviations.shape
        added += max(0.0, -float(removed.min()))
        gr[k * L.WHEEL + L.SHAPE_DS] = deviations.roll_length[1] - deviations.roll_length[0]
        start += records[k]
    gr[L.GAP_MARGIN] = added
    softened = pair.contact_model.stiffness_curve != "constant" or (tooth[:, 2] >= 0).any()
    if softened:
        at = compliance_roll_lengths(pair.geometry)
        gr[L.COMPLIANCE_S0] = at[0]
        gr[L.COMPLIANCE_DS] = at[1] - at[0]
        parts["compliance"].insert(0, base_curve)
    blocks = [gr]
    end = gr.size
    for name, slot in (
        ("offset", L.O_OFFSET),
        ("shape", L.O_SHAPE),
        ("tip", L.O_TIP),
        ("compliance", L.O_COMPLIANCE),
    ):
        if name == "compliance" and not softened:
            continue
        gi[slot] = end
        block = np.concatenate(parts[name])
        blocks.append(block)
        end += block.size
    gi[L.SHAPE_S] = PROFILE_POINTS
    gi[L.SHAPE_Z] = nz
    gi[L.N_COMPLIANCE] = COMPLIANCE_POINTS
    gi[L.O_TOOTH] = gi.size
    return np.concatenate([gi, tooth.ravel()]), np.concatenate(blocks)
