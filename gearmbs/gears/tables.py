"""Pack a gear pair into the flat tables of the contact kernel, with how far its tip corners reach.

Corners bear beyond the path of contact and pass close by the mate's tip and root. They are followed here for parallel
axes, with signs as in `gearmbs.contact.layout.WHEEL`: radii, lengths of roll and centre distance of an internal pair
are negative.
"""

from __future__ import annotations

import functools
import math
import operator
from typing import NamedTuple

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.law_kinds import LAW_KINDS
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.mesh import ContactModel, Mesh
from gearmbs.gears.modifications import COMPLIANCE_POINTS, PROFILE_POINTS, ToothDeviations, face_sections
from gearmbs.gears.spec import GearSpec
from gearmbs.gears.stiffness import compliance_roll_lengths, pair_stiffness

FRICTIONS = {"none": L.FRICTION_NONE, "adams": L.FRICTION_ADAMS, "smooth": L.FRICTION_SMOOTH}
END_BLEND = 1e-6
"""Length over which the ends of two faces are blended where they tie, m."""

EDGE = 0.1
"""Radius, in modules, of the edge by which a flank ends behind a tip drawn sharp: that of a usual chamfer. A corner
that leaves its mate's tip 60 um deep gives its force up over 0.15 mm of a 2 mm module."""

MOST_OF_PARABOLA = 0.45
"""Share of a corner's parabola that bounds its gap at poses near the drawing's, where gaps grow no slower than it."""

SHARE_KEPT = 0.6
"""Part of the share found for the drawing that is counted on at other poses."""

MOVED = 0.05
"""Change of the centre distance, in modules, over which the passing gap's slope is taken."""


def _pack_wheel(gear: GearSpec, table: np.void) -> None:
    sign = gear.sign
    table["base_radius"] = sign * gear.base_radius
    table["half_angle"] = sign * gear.base_half_angle
    table["tip_roll"] = sign * gear.tip_roll_length
    table["corner_radius"] = sign * gear.corner_radius
    table["corner_angle"] = sign * gear.corner_half_angle
    table["tip_rounding"] = gear.tip_rounding
    table["tip_radius"] = sign * gear.tip_radius
    table["root_radius"] = sign * gear.root_radius
    table["face_width"] = gear.face_width
    table["form_roll"] = sign * gear.form_roll_length
    table["fillet_radius"] = gear.fillet_radius
    table["fillet_centre_radius"] = sign * gear.fillet_centre_radius
    table["fillet_angle"] = sign * gear.fillet_half_angle
    table["twist"] = -sign * gear.twist_tangent


class _Asked:
    """A mesh whose tables are asked for: equal to those of the same key and these very faults.

    What cannot be hashed is compared with all that are kept.
    """

    def __init__(self, pair: Mesh, slices: int | None) -> None:
        self.pair, self.slices = pair, slices
        self._key = (pair.geometry, pair.contact_model, pair.operating_point.rotation, slices)
        try:
            self._hash = hash(self._key)
        except TypeError:
            self._hash = 0

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, _Asked):
            return NotImplemented
        one, two = self.pair.faults, other.pair.faults
        return len(one) == len(two) and all(map(operator.is_, one, two)) and self._key == other._key


MESHES = 64
"""Meshes whose tables are kept, some 10 kB each: all of a train of thirty stages, twice."""


@functools.lru_cache(maxsize=MESHES)
def _kept(asked: _Asked) -> tuple[np.ndarray, np.ndarray, int]:
    """Return tables, not to be written to: setting a simulation up asks for them several times, a series for many."""
    return _pack(asked.pair, asked.slices)


def pack(pair: Mesh, slices: int | None = None) -> tuple[np.ndarray, np.ndarray, int]:
    """Tables ``gi``, ``gr`` and the length of the work array for ``gear_contact``.

    Parameters
    ----------
    pair : Mesh
    slices : int, optional
        Slices along the face, default the pair's own.
    """
    parameters = getattr(type(pair), "__dataclass_params__", None)
    if parameters is None or not parameters.frozen:
        # it may change
        return _pack(pair, slices)
    integers, reals, size = _kept(_Asked(pair, slices))
    return integers.copy(), reals.copy(), size


def _pack(pair: Mesh, slices: int | None) -> tuple[np.ndarray, np.ndarray, int]:
    geometry, model, point = pair.geometry, pair.contact_model, pair.operating_point
    slices = model.face_slices(geometry, pair.faults) if slices is None else slices
    options, table = np.zeros(1, L.OPTIONS), np.zeros(1, L.PAIR)
    integers, reals = options[0], table[0]
    first, second = geometry.wheels
    integers["teeth"] = first.teeth, second.teeth
    integers["slices"] = slices
    integers["law"] = LAW_KINDS[model.law.kind].code
    integers["friction"] = FRICTIONS[model.friction.kind]
    integers["drive"] = point.rotation
    integers["load"] = L.LOAD_ADAMS if model.load == "adams" else L.LOAD_SLICES
    integers["root"] = int(model.tips_may_bottom(geometry))
    _pack_wheel(first, reals["wheel_1"])
    _pack_wheel(second, reals["wheel_2"])
    _pack_reach(geometry, reals)
    reals["pitch"] = first.base_pitch
    reals["width"] = geometry.narrower_face_width * model.face_share(geometry)
    _pack_laws(model, geometry.narrower_face_width, math.cos(first.base_helix_angle), reals)
    reals["end_blend"] = END_BLEND
    reals["face_low"], reals["face_high"] = geometry.common_face
    reals["axial_shift"] = geometry.axial_shift
    more_integers, more_reals = np.zeros(0, dtype=np.int64), np.zeros(0)
    if pair.faults or model.stiffness_curve != "constant":
        more_integers, more_reals = _pack_teeth(pair, integers, reals)
    gi = np.concatenate([options.view(np.int64), more_integers])
    gr = np.concatenate([table.view(np.float64), more_reals])
    return gi, gr, L.work_size(slices)


def _pack_reach(geometry: PairGeometry, reals: np.void) -> None:
    """Fill how far tip corners reach; see `gearmbs.contact.search.teeth_in_reach`."""
    module = geometry.driver.module
    # to the side on which the path of contact becomes shorter: on the other tips may come to the line of action's end
    step = min(MOVED * module, 0.5 * (geometry.centre_distance - abs(geometry.base_radius_sum)))
    here, moved = ([corner_reach(geometry, k, change) for k in (0, 1)] for change in (0.0, geometry.sign * step))
    slopes = [abs(m.passing_gap - h.passing_gap) / step for h, m in zip(here, moved)]
    longer = max(abs(m.length - h.length) for h, m in zip(here, moved))
    reals["centre_distance"] = geometry.sign * geometry.centre_distance
    reals["corner_bound"] = min(r.bound for r in here)
    share = reals["corner_bound"] / min(r.curve for r in here)
    reals["corner_share"] = min(MOST_OF_PARABOLA, SHARE_KEPT * share)
    # other poses lengthen the reach a little; a pitch more costs nothing, since gaps decide
    reals["corner_reach"] = max(r.length for r in here) + longer + geometry.driver.base_pitch
    reals["passing_gap"] = min(r.passing_gap for r in here)
    reals["passing_slope"] = 2.0 * max(slopes)
    reals["edge"] = EDGE * module


def _pack_laws(model: ContactModel, width: float, cosine: float, reals: np.void) -> None:
    """Fill the laws; those of helical teeth hold along the normal, the kernel works in the transverse section.

    ``cosine`` is that of the base helix angle: penetration and force along the normal are ``cosine`` times and
    ``1 / cosine`` times theirs in the section, while the contact line is ``1 / cosine`` times the width.
    """
    law, friction = model.law, model.friction
    stiff, damped = law_factors(model, width, cosine)
    reals["stiffness"] = law.stiffness * stiff
    reals["exponent"] = law.exponent
    reals["damping"] = law.damping * damped
    reals["damping_depth"] = law.depth / cosine
    reals["secant"] = 1.0 / cosine
    reals["static_friction"] = friction.static / cosine
    reals["dynamic_friction"] = friction.dynamic / cosine
    reals["static_speed"] = friction.static_speed
    reals["dynamic_speed"] = friction.dynamic_speed


def law_factors(model: ContactModel, width: float, cosine: float) -> tuple[float, float]:
    """Return what stands in the table for a unit of the law's stiffness and damping."""
    law = model.law
    return cosine**law.exponent / width, LAW_KINDS[law.kind].section_damping(cosine, width)


SPARE_PAIRS = 4
"""Tooth pairs of a side by which other poses than the drawing's have more, at most: a pitch and more at either end."""


def most_pairs(geometry: PairGeometry, gr: np.ndarray) -> int:
    """Return how many tooth pairs of both sides `gearmbs.contact.pair_gaps` lists at most, from the pair's table."""
    reals = gr[: L.PAIR.itemsize // gr.itemsize].view(L.PAIR)[0]
    # a helix moves the contact along the path, over the face and as the wheels are shifted; other poses a little more
    along = abs(reals["wheel_1"]["twist"]) * (reals["face_high"] - reals["face_low"] + abs(reals["axial_shift"]))
    span = geometry.path_of_contact + 2.0 * (reals["corner_reach"] + along)
    return 2 * (math.ceil(span / reals["pitch"]) + SPARE_PAIRS)


def tooth_deviations(pair: Mesh) -> tuple[ToothDeviations, ToothDeviations]:
    """Deviations of all teeth of both wheels, with every fault applied."""
    geometry, rotation = pair.geometry, pair.operating_point.rotation
    sections = face_sections(pair.faults, geometry.wheels)
    roll_length = compliance_roll_lengths(geometry)
    both = (
        ToothDeviations(geometry.wheels[0], rotation, sections, roll_length),
        ToothDeviations(geometry.wheels[1], rotation, sections, geometry.mate_roll_length(0, roll_length)),
    )
    for fault in pair.faults:
        fault.apply(both[fault.wheel == "driven"], geometry)
    return both


def _numbered(rows: np.ndarray, unmodified: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number of the distinct row for each row, -1 where it is the plain one, and the distinct rows."""
    # by their bytes: sorting whole rows takes longer than many a simulation's set-up
    known: dict[bytes, int] = {}
    number = np.array([known.setdefault(row.tobytes(), len(known)) for row in rows])
    distinct = rows[np.unique(number, return_index=True)[1]]
    return np.where((rows == unmodified).all(axis=1), -1, number), distinct


def _pack_teeth(pair: Mesh, integers: np.void, reals: np.void) -> tuple[np.ndarray, np.ndarray]:
    """Complete the headers for deviating teeth; return what stands behind them."""
    both = tooth_deviations(pair)
    nz = both[0].section.size
    records = [c.offset.size for c in both]
    tooth = np.full((sum(records), L.FLANK), -1, dtype=np.int64)
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
        sign = deviations.gear.sign
        parts["offset"].append(deviations.offset.ravel())
        kinds = (
            ("shape", deviations.shape.reshape(records[k], -1), 0.0),
            ("tip", sign * deviations.tip.reshape(records[k], -1), sign * deviations.gear.tip_roll_length),
            ("compliance", deviations.compliance.reshape(records[k], -1) * base_curve, 0.0),
        )
        for column, (name, data, unmodified) in enumerate(kinds):
            number, distinct = _numbered(data, np.full(data.shape[1], unmodified))
            tooth[rows, column] = np.where(number < 0, -1, number + counts[name])
            counts[name] += len(distinct)
            parts[name].append(distinct.ravel())
        removed = deviations.offset[:, :, None, None] + deviations.shape
        added += max(0.0, -float(removed.min()))
        reals[f"wheel_{k + 1}"]["shape_start"] = sign * deviations.roll_length[0]
        reals[f"wheel_{k + 1}"]["shape_spacing"] = sign * (deviations.roll_length[1] - deviations.roll_length[0])
        start += records[k]
    reals["added_material"] = added
    softened = pair.contact_model.stiffness_curve != "constant" or (tooth[:, L.FLANK_COMPLIANCE] >= 0).any()
    if softened:
        at = compliance_roll_lengths(pair.geometry)
        reals["compliance_start"] = at[0]
        reals["compliance_spacing"] = at[1] - at[0]
        parts["compliance"].insert(0, base_curve)
    blocks = []
    end = L.PAIR.itemsize // np.dtype(np.float64).itemsize
    for name, field in (("offset", "offsets"), ("shape", "shapes"), ("tip", "tips"), ("compliance", "compliances")):
        if name == "compliance" and not softened:
            continue
        integers[field] = end
        block = np.concatenate(parts[name])
        blocks.append(block)
        end += block.size
    integers["profile_places"] = PROFILE_POINTS
    integers["face_places"] = nz
    integers["compliance_places"] = COMPLIANCE_POINTS
    integers["flanks"] = L.OPTIONS.itemsize // np.dtype(np.int64).itemsize
    return tooth.ravel(), np.concatenate(blocks)


NORMALS = 300
"""Directions of the normal in which a corner is followed: 10 mrad apart, the gap between them is good to 1e-4 of the
module."""

WIDEST_TURN = 3.0
"""rad; a corner that turns its normal by more has left its mate long before."""


class CornerReach(NamedTuple):
    """A tip corner beyond the path of contact.

    Attributes
    ----------
    length : float
        How far beyond it, along the path, the corner still has a foot on the mate's involute, m.
    passing_gap : float
        Gap with which it then leaves the mate's tip, m, while flanks at work just touch; negative if tips foul.
    curve : float
        Curvature with which its gap begins to grow along the path, 1/m: ``curve x^2``.
    bound : float
        Least ratio of its gap, up to the passing gap, to x^2, 1/m.
    """

    length: float
    passing_gap: float
    curve: float
    bound: float


def corner_reach(geometry: PairGeometry, wheel: int, change: float = 0.0) -> CornerReach:
    """Follow the tip corner of a wheel, 0 or 1, from the end of the path of contact to the mate's tip.

    Where the normal stands at alpha, the corner at the radius r bears on the mate's base tangent with the arm
    ``c = a cos(alpha) - r_b2`` about its own wheel, at the length ``t = (r^2 - c^2)^(1/2)`` from the arm's foot. With T
    and alpha' for t and alpha at the end of the path and the length L of the line of action,

        x = r_b1 (atan2(t, c) - atan2(T, r_b1) - alpha + alpha')
        gap = a sin(alpha) - L - (t - T) - r_b2 (alpha - alpha') + x

    and the foot is at ``a sin(alpha) - t - rho`` on the mate, with the tip rounding rho of the corner.

    Parameters
    ----------
    geometry : PairGeometry
    wheel : {0, 1}
    change : float
        Added to the centre distance, m.
    """
    own, mate = geometry.wheels if wheel == 0 else geometry.wheels[::-1]
    rb, mate_rb = own.sign * own.base_radius, mate.sign * mate.base_radius
    radius, end = own.corner_radius, mate.sign * mate.tip_roll_length
    a = geometry.sign * (geometry.centre_distance + change)
    working = math.acos((rb + mate_rb) / a)
    length = a * math.sin(working)
    begin = own.sign * math.sqrt(radius * radius - rb * rb)
    way = math.copysign(1.0, rb * (length - begin) / begin)
    alpha = working + way * np.linspace(0.0, WIDEST_TURN, NORMALS)
    arm = a * np.cos(alpha) - mate_rb
    square = radius * radius - arm * arm
    count = int(np.argmax(square <= 0.0)) or NORMALS
    alpha, arm = alpha[:count], arm[:count]
    t = own.sign * np.sqrt(square[:count])
    turn = np.unwrap(np.arctan2(own.sign * t, own.sign * arm)) - math.atan2(abs(begin), abs(rb))
    x = rb * (turn - alpha + working)
    gap = a * np.sin(alpha) - length - (t - begin) - mate_rb * (alpha - working) + x
    beyond = a * np.sin(alpha) - t - own.tip_rounding - end
    last = int(np.argmax(beyond > 0.0))
    if last == 0:
        # no foot at all where the wheels hardly reach each other; or one until the corner turns back
        last = 1 if beyond[0] > 0.0 else count - 1
    part = float(np.clip(-beyond[last - 1] / (beyond[last] - beyond[last - 1] or 1.0), 0.0, 1.0))
    x_end, passing = ((1.0 - part) * v[last - 1] + part * v[last] for v in (x, gap))
    curve = length * begin / (2.0 * (length - begin) * rb * rb)
    rising = gap[1:last] < max(passing, gap[1])
    count = int(np.argmin(rising)) if not rising.all() else rising.size
    bound = (gap[1 : count + 1] / x[1 : count + 1] ** 2).min(initial=curve)
    return CornerReach(float(x_end), float(passing), curve, float(bound))


TURNS = 80
"""Places of the wheel while its corner goes through the mate's root, and once more around the closest of them: the
distance is good to 1e-5 modules."""


def fillet_clearance(geometry: PairGeometry, wheel: int, depth: float = 0.0) -> float:
    """Least distance of the tip corner of a wheel, 0 or 1, from the mate's root arc while flanks at work touch.

    Infinite if the corner does not come over the arc; negative if it cuts into it. See `gearmbs.contact.root` for
    the arc and where a corner is over it.

    Parameters
    ----------
    geometry : PairGeometry
    wheel : {0, 1}
    depth : float
        How deep the flanks are pressed into each other, m.
    """
    own, mate = geometry.wheels if wheel == 0 else geometry.wheels[::-1]
    rb, mate_rb = own.sign * own.base_radius, mate.sign * mate.base_radius
    a, alpha = geometry.sign * geometry.centre_distance, geometry.working_pressure_angle
    radius, arc = own.sign * own.corner_radius, mate.fillet_radius
    centre, around = mate.sign * mate.fillet_centre_radius, mate.sign * mate.fillet_half_angle
    together = geometry.line_of_action - geometry.base_radius_sum * alpha + depth
    middle, width = 0.0, 4.0 * math.pi / own.teeth
    least = math.inf
    for _ in range(2):
        corner = middle + width * np.linspace(-1.0, 1.0, TURNS)
        f = corner - own.sign * own.corner_half_angle
        at = (
            (together - rb * (f + own.sign * own.base_half_angle)) / mate_rb - mate.sign * mate.base_half_angle + around
        )
        dx = a - radius * np.cos(corner) - centre * np.cos(at)
        dy = -radius * np.sin(corner) - centre * np.sin(at)
        end = at - math.asin(arc / centre)
        over = (dx * np.sin(at) - dy * np.cos(at) >= 0.0) & (dx * np.cos(end) + dy * np.sin(end) < 0.0)
        clearance = np.where(over, arc - own.tip_rounding - np.hypot(dx, dy), math.inf)
        best = int(clearance.argmin())
        least = min(least, float(clearance[best]))
        middle, width = float(corner[best]), 4.0 * width / TURNS
    return least
