"""Tooth and mesh stiffness by the potential-energy method along the profile, with the body or rim below the teeth.

Plane finite elements of whole wheels judge both (``benchmarks/tooth_stiffness.py``, table in the theory pages): the
energies of the tooth on an elastic half plane with Weber's and Banaschek's flattening are within a few per cent of
them; Sainsot's body with a constant contact stiffness, usual in the literature, is not.

References
----------
.. [1] Ma, H., Song, R., Pang, X., Wen, B.: Time-varying mesh stiffness calculation of cracked spur gears. Engineering
   Failure Analysis 44 (2014) 179-194. Bending, shear and axial energy of a tooth as a beam with a rack-cut root.
.. [2] Sainsot, P., Velex, P., Duverger, O.: Contribution of gear body to tooth deflections - a new bidimensional
   analytical formula. J. Mech. Design 126 (2004) 748-752. Foundation.
.. [3] Yang, D. C. H., Lin, J. Y.: Hertzian damping, tooth friction and bending elasticity in gear impact dynamics.
   J. Mechanisms, Transmissions and Automation in Design 109 (1987) 189-196. Constant Hertz stiffness.
.. [4] Cornell, R. W.: Compliance and stress sensitivity of spur gear teeth. J. Mech. Design 103 (1981) 447-459.
.. [5] Weber, C., Banaschek, K.: Formaenderung und Profilruecknahme bei gerad- und schraegverzahnten Raedern. Vieweg
   (1953). Flattening of the contact against the tooth's middle line.
.. [6] Chen, Z., Shao, Y.: Mesh stiffness of an internal spur gear pair with ring gear rim deformation. Mechanism and
   Machine Theory 69 (2013) 1-12. The rim as a uniformly curved Timoshenko beam between its supports.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.mesh import Mesh, require_points
from gearmbs.gears.modifications import COMPLIANCE_POINTS
from gearmbs.gears.spec import GearSpec
from gearmbs.units import Quantity, to_si
from gearmbs.wording import warn

POINTS = 200  # stations of the beam from root to tip
FACE_POINTS = 2001
"""Places on the path of contact between which a helical pair's stiffness is summed over the face."""
# Sainsot's fits: coefficients of 1/theta^2, h^2, h/theta, 1/theta, h, 1
SAINSOT = {
    "L": (-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045),
    "M": (60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086),
    "P": (-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236),
    "Q": (-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904),
}
SHEAR = 1.2
"""Shear correction of a rectangular section."""
RIM_STATIONS = 400
"""Stations of the integration along a half of a ring's rim between two bolts."""
SPECIFIC_LOAD = 3e5
"""Load per face width at which the flattening is taken where none is given, N/m: ISO 6336-1 has c'_th at 300 N/mm."""
FLATTEST = 1e-3
"""Least radius of curvature of a flank, and least curvature of a contact, by the base pitch: away from 1/0."""
LEAST_SPECIFIC_LOAD = 1e3
"""Below, N/m, the flattening is that of this load: its compliance grows without bound, as the logarithm, towards 0."""


@dataclass(frozen=True)
class Crack:
    """A straight crack through the whole face, starting in the root.

    Attributes
    ----------
    depth : float
        Length of the crack, m.
    angle : float
        Between crack and the tooth's middle line, rad; above 0 up to 90 deg.

    Raises
    ------
    ValueError
        For a depth that is not positive, and a crack that does not go into the tooth.
    """

    depth: float
    angle: float = math.radians(70)

    def __post_init__(self) -> None:
        check_crack(self.depth, self.angle, "Crack")


def check_crack(depth: float, angle: float, owner: str) -> None:
    """Refuse what is no crack into a tooth; ``owner`` is what the message calls the fields' owner."""
    if not depth > 0:
        raise ValueError(f"{owner}.depth is {depth} m; it must be positive")
    if not 0.0 < angle <= 0.5 * math.pi:
        raise ValueError(
            f"{owner}.angle is {math.degrees(angle):.4g} deg, by which no crack goes into the tooth; give above 0 up "
            "to 90 deg (a plain number is in radians: write '70 deg')"
        )


def rack_root(gear: GearSpec, points: int = POINTS) -> tuple[np.ndarray, np.ndarray]:
    """Root curve cut by a rack with tip radius ``fillet_radius``: half thickness and height, from root circle upwards.

    The rack's tip circle rolls off on the pitch circle; ``gamma`` is the angle at which it touches the curve.
    """
    if gear.internal:
        raise ValueError(f"{gear.name} is internal: no rack cuts it; its root is the arc of the drawing")
    alpha = gear.transverse_pressure_angle
    radius, depth, across = _rack_tip(gear)
    gamma = np.linspace(math.pi / 2, alpha, points)
    turn = (depth / np.tan(gamma) + across) / gear.pitch_radius
    arm = depth / np.sin(gamma) + radius
    half = gear.pitch_radius * np.sin(turn) - arm * np.cos(gamma - turn)
    height = gear.pitch_radius * np.cos(turn) - arm * np.sin(gamma - turn)
    return half, height


def ring_root(gear: GearSpec, points: int = POINTS) -> tuple[np.ndarray, np.ndarray]:
    """Root arc of an internal wheel: half thickness and height over the axis, from root circle to involute."""
    centre = gear.fillet_half_angle
    middle = gear.fillet_centre_radius * np.array([math.sin(centre), math.cos(centre)])
    # from where the arc touches the root circle to where it stands radially
    begin = math.pi / 2 - centre
    end = begin + math.pi - math.acos(gear.fillet_radius / gear.fillet_centre_radius)
    turn = np.linspace(begin, end, points)
    return middle[0] + gear.fillet_radius * np.cos(turn), middle[1] + gear.fillet_radius * np.sin(turn)


def _rack_tip(gear: GearSpec) -> tuple[float, float, float]:
    """Tip radius of the rack, depth of its centre below the pitch circle and distance from the tooth's middle, m."""
    alpha = gear.transverse_pressure_angle
    radius = gear.fillet_radius
    depth = gear.dedendum - radius
    return radius, depth, 0.5 * gear.tooth_thickness + depth * math.tan(alpha) + radius / math.cos(alpha)


def root_half_angle(gear: GearSpec) -> float:
    """Half angle of the tooth where its rack-cut root meets the root circle, rad."""
    return _rack_tip(gear)[2] / gear.pitch_radius


@dataclass(frozen=True)
class ToothCompliance:
    """Compliance of one tooth for a load normal to its flank, per component, m/N, along the profile.

    Attributes
    ----------
    roll_length : ndarray
        Length of roll of the loaded point, m.
    bending, shear, axial, foundation : ndarray
    rim : ndarray
        Of a ring's rim between its bolts, 0 where it is held all around; see `gearmbs.gears.stiffness`.
    depth : ndarray
        Distance of the loaded point from the tooth's middle line along the normal, m.
    """

    roll_length: np.ndarray
    bending: np.ndarray
    shear: np.ndarray
    axial: np.ndarray
    foundation: np.ndarray
    rim: np.ndarray
    depth: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """Sum of all components, m/N."""
        return self.bending + self.shear + self.axial + self.foundation + self.rim


def tooth_compliance(
    gear: GearSpec,
    crack: Crack | None = None,
    root_angle: float | None = None,
    rim_supports: int | None = None,
    sainsot: bool = False,
) -> ToothCompliance:
    """Compliance of one tooth by the potential-energy method, from the start of its involute to its tip.

    Parameters
    ----------
    gear : GearSpec
    crack : Crack, optional
        A crack in the root; sections above it keep the part of the tooth that still carries.
    root_angle : float, optional
        Half angle of the root for Sainsot's foundation, default `root_half_angle`.
    rim_supports : int, optional
        Bolts that hold the rim of an internal wheel; default: it is held all around and does not bend.
    sainsot : bool
        Whether the body of an external wheel is Sainsot's ring instead of Cornell's half plane and the torsion of
        the disc between bore and root circle. It is 0.2 to 0.5 softer; a solid wheel has none in it.

    Returns
    -------
    ToothCompliance

    Raises
    ------
    ValueError
        For a crack that cuts through the tooth, and for Sainsot's ring without a bore.
    """
    rb, b, sign = gear.base_radius, gear.face_width, gear.sign
    E = gear.material.youngs_modulus
    G = E / (2 * (1 + gear.material.poisson_ratio))
    half, height = ring_root(gear) if gear.internal else rack_root(gear)
    start = gear.form_roll_length
    if not gear.internal:
        start = math.sqrt(max(half[-1] ** 2 + height[-1] ** 2 - rb**2, 0.0))
    roll_length = np.linspace(start, gear.tip_roll_length, 2 * POINTS)
    beta = roll_length / rb - sign * gear.base_half_angle
    cos, sin = np.cos(beta), np.sin(beta)
    x_load = sign * (roll_length * cos - rb * sin)
    from_axis = roll_length * sin + rb * cos
    x = np.concatenate([half, x_load[1:]])
    y = sign * (np.concatenate([height, from_axis[1:]]) - height[0])
    y_load = sign * (from_axis - height[0])
    thick = 2 * x
    if crack is not None:
        left = half[0] - crack.depth * math.sin(crack.angle)
        if left <= -half[0]:
            raise ValueError(f"crack depth is {crack.depth * 1e3:.4f} mm: it cuts through the tooth; make it shallower")
        foot = crack.depth * math.cos(crack.angle)
        cracked = (x > left) & (y <= max(foot, y[np.argmin(np.abs(x - abs(left)))]))
        thick = np.where(cracked, x + left, thick)
    area = thick * b
    second = thick**3 * b / 12

    def along(density: np.ndarray) -> np.ndarray:
        steps = 0.5 * (density[1:] + density[:-1]) * np.diff(y)
        return np.concatenate([[0.0], np.cumsum(steps)])[half.size - 1 :]

    lever = cos * y_load - x_load * sin
    bending = (lever**2 * along(1 / second) - 2 * lever * cos * along(y / second) + cos**2 * along(y**2 / second)) / E
    shear = SHEAR * cos**2 * along(1 / area) / G
    axial = sin**2 * along(1 / area) / E
    if sainsot and not gear.internal:
        foundation = _sainsot_foundation(gear, beta, from_axis, root_angle)
    else:
        foundation = half_plane_foundation(gear, beta, lever / cos, 2 * half[0]) + disc_torsion(gear)
    rim = np.zeros_like(beta) if rim_supports is None else rim_compliance(gear, rim_supports, beta, lever / cos)
    parts = (roll_length, bending, shear, axial, foundation, rim, x_load / cos)
    # by rising length of roll, which is from the tip to the root of an internal wheel
    return ToothCompliance(*(part[::sign] for part in parts))


def disc_torsion(gear: GearSpec) -> float:
    """Compliance by the torsion of a wheel's body, held at its bore, m/N; 0 of a wheel without one.

    ``r_b^2 / (4 pi G b) (1 / r_bore^2 - 1 / r_f^2)``: the turn of the root circle against the bore by the shear
    ``T / (2 pi r^2 b)`` of the torque. A solid wheel is one with its shaft, whose torsion is the shaft's.
    """
    if gear.internal or gear.bore_radius == 0:
        return 0.0
    shear = gear.material.youngs_modulus / (2 * (1 + gear.material.poisson_ratio))
    apart = 1 / gear.bore_radius**2 - 1 / gear.root_radius**2
    return gear.base_radius**2 * apart / (4 * math.pi * shear * gear.face_width)


def _sainsot_foundation(
    gear: GearSpec, beta: np.ndarray, from_axis: np.ndarray, root_angle: float | None
) -> np.ndarray:
    """Compliance of the body of an external wheel, a ring fixed at its bore (Sainsot), m/N."""
    theta = root_half_angle(gear) if root_angle is None else root_angle
    if gear.bore_radius == 0:
        raise ValueError(f"{gear.name}.bore_radius is 0: Sainsot's ring is held at its bore; give one")
    ratio = gear.root_radius / gear.bore_radius
    fit = {
        name: c[0] / theta**2 + c[1] * ratio**2 + c[2] * ratio / theta + c[3] / theta + c[4] * ratio + c[5]
        for name, c in SAINSOT.items()
    }
    u = (from_axis - gear.root_radius) / (2 * gear.root_radius * theta)
    stiff = gear.material.youngs_modulus * gear.face_width
    return np.cos(beta) ** 2 / stiff * (fit["L"] * u**2 + fit["M"] * u + fit["P"] * (1 + fit["Q"] * np.tan(beta) ** 2))


def half_plane_foundation(gear: GearSpec, beta: np.ndarray, lever: np.ndarray, thickness: float) -> np.ndarray:
    """Compliance of the body under a tooth as that of an elastic half plane (Cornell), m/N.

    ``cos^2 beta / (E b) [5.306 (l / h)^2 + 2 (1 - nu) l / h + 1.534 (1 + 0.4167 tan^2 beta / (1 + nu))]``: a wheel's
    body without its torsion, the rim of an internal one without its own bending.

    Parameters
    ----------
    gear : GearSpec
    beta : ndarray
        Angle of the load against the direction across the tooth, rad.
    lever : ndarray
        Height above the root where the load meets the tooth's middle line, m.
    thickness : float
        Of the tooth at its root, m.
    """
    nu = gear.material.poisson_ratio
    slender = lever / thickness
    shape = 5.306 * slender**2 + 2 * (1 - nu) * slender + 1.534 * (1 + 0.4167 * np.tan(beta) ** 2 / (1 + nu))
    return np.cos(beta) ** 2 * shape / (gear.material.youngs_modulus * gear.face_width)


def rim_compliance(gear: GearSpec, supports: int, beta: np.ndarray, lever: np.ndarray) -> np.ndarray:
    """Compliance of a ring's rim under the load of a tooth half-way between two bolts, by Chen and Shao, m/N.

    Parameters
    ----------
    gear : GearSpec
        Internal wheel.
    supports : int
        Evenly spaced bolts, at which the rim is clamped.
    beta : ndarray
        Angle of the load against the direction across the tooth, rad; it pushes outwards.
    lever : ndarray
        Height above the root where the load meets the tooth's middle line, m.

    Raises
    ------
    ValueError
        For an external wheel, or fewer than two bolts.
    """
    if not gear.internal:
        raise ValueError(f"{gear.name} is external; only the rim of an internal wheel is held by bolts")
    if not (isinstance(supports, int) and supports >= 2):
        raise ValueError(f"rim_supports is {supports!r}; give the number of bolts, 2 or more")
    young = gear.material.youngs_modulus
    moduli = young, young / (2 * (1 + gear.material.poisson_ratio))
    thickness = gear.rim_thickness
    radius = gear.root_radius + 0.5 * thickness
    stiffness = sum(
        np.linalg.inv(arc_flexibility(radius, side * math.pi / supports, thickness, gear.face_width, moduli))
        for side in (1, -1)
    )
    beta = np.asarray(beta)
    inwards = np.asarray(lever) + 0.5 * thickness
    load = np.stack([np.sin(beta), np.cos(beta), -inwards * np.cos(beta)])
    return np.einsum("i...,ij,j...->...", load, np.linalg.inv(stiffness), load)


def arc_flexibility(radius: float, angle: float, thickness: float, width: float, moduli: tuple[float, float]):
    """Return the flexibility of a circular cantilever at its free end.

    Parameters
    ----------
    radius, thickness, width : float
        Of the middle line and of the section, m.
    angle : float
        From the free end, which is on the x axis, to the clamp, rad; its sign tells on which side.
    moduli : (float, float)
        Young's and shear modulus, N/m^2.

    Returns
    -------
    ndarray, shape (3, 3)
        Displacements outwards and along the rim, m, and turn, rad, by forces (N) and moment (N m) in these directions.
    """
    phi = angle * (np.arange(RIM_STATIONS) + 0.5) / RIM_STATIONS
    sin, cos, one = np.sin(phi), np.cos(phi), np.ones(RIM_STATIONS)
    # what a force outwards, one along the rim and a moment at the end make in a section
    moment = np.stack([radius * sin, radius * (1 - cos), one])
    normal = np.stack([-sin, cos, 0 * one])
    shear = np.stack([cos, sin, 0 * one])
    area = width * thickness
    young, rigid = moduli
    per = abs(angle) * radius / RIM_STATIONS
    return per * (
        moment @ moment.T / (young * area * thickness**2 / 12)
        + normal @ normal.T / (young * area)
        + SHEAR * shear @ shear.T / (rigid * area)
    )


def hertz_stiffness(pair: PairGeometry) -> float:
    """Yang's and Lin's constant stiffness of the contact of two flanks, N/m.

    pi E b / (4 (1 - nu^2)) for equal materials, 3 to 4 times that of `flattening`: it leaves out what two thick bodies
    give way below the strip that touches.
    """
    parts = [(1 - w.material.poisson_ratio**2) / w.material.youngs_modulus for w in pair.wheels]
    return math.pi * pair.common_face_width / (2 * sum(parts))


def flattening(gear: GearSpec, depth: np.ndarray, half_width: np.ndarray) -> np.ndarray:
    """Compliance of one flank's contact against the tooth's middle line (Weber and Banaschek), m/N.

    ``2 (1 - nu^2) / (pi E b) [ln(2 h / a) - nu / (2 (1 - nu))]``: what the surface of a half plane under Hertz's
    pressure of half width a moves against its depth h, in plane strain.

    Parameters
    ----------
    gear : GearSpec
    depth : ndarray
        h, of `ToothCompliance`, m.
    half_width : ndarray
        a, m; at most the depth counts.
    """
    nu = gear.material.poisson_ratio
    per = 2 * (1 - nu**2) / (math.pi * gear.material.youngs_modulus * gear.face_width)
    return per * (np.log(2 * depth / np.minimum(half_width, depth)) - nu / (2 * (1 - nu)))


def contact_half_width(pair: PairGeometry, roll_length: np.ndarray, load: Quantity) -> np.ndarray:
    """Half width of Hertz's contact of two flanks, a^2 = 4 F' R / (pi E*), m.

    Parameters
    ----------
    pair : PairGeometry
    roll_length : ndarray
        Contact on wheel 1, m. The lengths of roll are the flanks' radii of curvature: 1/R = 1/s_1 + 1/s_2, or
        1/s_1 - 1/s_2 in an internal wheel 2.
    load : float or str
        F', N/m.
    """
    pressed = to_si(load, "N/m", "load")
    if not 0.0 <= pressed < math.inf:
        raise ValueError(f"load is {load!r}; give a load per face width that is not negative, such as '300 N/mm'")
    soft = sum((1 - w.material.poisson_ratio**2) / w.material.youngs_modulus for w in pair.wheels)
    # flanks that are cut to the base circle begin with no radius at all
    least = FLATTEST * pair.driver.base_pitch
    one, two = (np.maximum(s, least) for s in (roll_length, pair.mate_roll_length(0, roll_length)))
    curvature = np.maximum(1 / one + pair.sign / two, FLATTEST / pair.driver.base_pitch)
    return np.sqrt(4 * max(pressed, LEAST_SPECIFIC_LOAD) * soft / (math.pi * curvature))


def compliance_roll_lengths(pair: PairGeometry) -> np.ndarray:
    """Lengths of roll on wheel 1 at which the compliance of a tooth pair is tabulated, m."""
    return np.linspace(pair.first_roll_lengths[0], pair.wheels[0].tip_roll_length, COMPLIANCE_POINTS)


def pair_stiffness(
    pair: PairGeometry,
    roll_length: np.ndarray,
    cracks: tuple[Crack | None, Crack | None] = (None, None),
    root_angles: tuple[float | None, float | None] = (None, None),
    rim_supports: int | None = None,
    load: Quantity = SPECIFIC_LOAD,
    sainsot: bool = False,
) -> np.ndarray:
    """Stiffness of one tooth pair by the potential-energy method, N/m.

    With an axial shift only the common face is in mesh; what stands beside it is not counted, as in ISO 6336-1.

    Parameters
    ----------
    pair : PairGeometry
    roll_length : ndarray
        Contact on wheel 1, as length of roll, m; beyond the profiles' ends the end values are used.
    cracks, root_angles : tuple
        Per wheel, see `tooth_compliance`.
    rim_supports : int, optional
        Of an internal wheel 2, see `tooth_compliance`.
    load : float or str
        Normal force per face width, N/m, of the flattening.
    sainsot : bool
        Whether the bodies are Sainsot's rings and the contact is Yang's and Lin's constant, as usual in the literature.
    """
    mate = pair.mate_roll_length(0, roll_length)
    # the teeth are those of whole faces, of which a share is in mesh
    total = np.full(np.shape(roll_length), pair.face_share / hertz_stiffness(pair) if sainsot else 0.0)
    half_width = contact_half_width(pair, roll_length, load)
    held = (None, rim_supports)
    for wheel, at, crack, angle, bolts in zip(pair.wheels, (roll_length, mate), cracks, root_angles, held):
        tooth = tooth_compliance(wheel, crack, angle, bolts, sainsot)
        total = total + np.interp(at, tooth.roll_length, tooth.total)
        if not sainsot:
            total = total + flattening(wheel, np.interp(at, tooth.roll_length, tooth.depth), half_width)
    return pair.face_share / total


@dataclass(frozen=True)
class MeshStiffness:
    """Mesh stiffness over one mesh cycle, all pairs on the path of contact in parallel.

    Attributes
    ----------
    phase : ndarray
        From the entry of a pair, over the base pitch, 0 up to 1.
    stiffness : ndarray
        In the transverse plane along the line of action, N/m.
    single : ndarray
        Of the entering pair alone over its whole engagement, N/m.
    single_phase : ndarray
        Its travel over the base pitch, 0 to the total contact ratio.
    """

    phase: np.ndarray
    stiffness: np.ndarray
    single: np.ndarray
    single_phase: np.ndarray

    @property
    def maximum(self) -> float:
        """Largest mesh stiffness, N/m."""
        return float(self.stiffness.max())

    @property
    def mean(self) -> float:
        """Mean mesh stiffness, N/m."""
        return float(self.stiffness.mean())


def mesh_stiffness(
    pair: Mesh,
    points: int = 400,
    root_angles: tuple[float | None, float | None] = (None, None),
    rim_supports: int | None = None,
    load: Quantity = SPECIFIC_LOAD,
    sainsot: bool = False,
) -> MeshStiffness:
    """Time-varying mesh stiffness of perfect wheels by the potential-energy method.

    Pairs are added as if each were alone. A loaded tooth moves its neighbours, too: by finite elements the mean is 0.10
    to 0.13 lower, which is the 0.75 of `iso_mesh_stiffness`. Helical teeth are `pair_stiffness` along their normal,
    spread evenly over the face, whose sections pass the path of contact one after the other.

    Parameters
    ----------
    pair : Mesh
    points : int
        Over a mesh cycle.
    root_angles, rim_supports, load, sainsot
        See `pair_stiffness`.

    Warns
    -----
    UserWarning
        If teeth of the pair are cracked: that is left out here. `pair_stiffness` takes cracks, and
        ``loaded_transmission_error(...).stiffness`` knows all faults.
    """
    if any(fault.label == "root crack" for fault in pair.faults):
        warn(
            "mesh_stiffness is that of perfect wheels and leaves the pair's root cracks out; use pair_stiffness with a "
            "Crack, or loaded_transmission_error(pair, cycles=...).stiffness",
        )
    require_points(points)
    geometry = pair.geometry
    begin = geometry.first_roll_lengths[0]
    pitch, path, overlap = geometry.driver.base_pitch, geometry.contact_ratio, geometry.overlap_ratio
    cosine = math.cos(geometry.driver.base_helix_angle)
    bodies: dict[str, Any] = {
        "root_angles": root_angles, "rim_supports": rim_supports, "load": load, "sainsot": sainsot,
    }  # fmt: skip
    # the mean over the face, of what the sections that are on the path have there
    fine = np.linspace(0.0, path, FACE_POINTS)
    along = pair_stiffness(geometry, begin + fine * pitch, **bodies)
    sums = np.concatenate(([0.0], np.cumsum(0.5 * (along[1:] + along[:-1]) * np.diff(fine))))

    def pair_alone(travel: np.ndarray) -> np.ndarray:
        if overlap == 0.0:
            return np.where(travel <= path, pair_stiffness(geometry, begin + travel * pitch, **bodies), 0.0)
        first, last = (np.interp(np.clip(at, 0.0, path), fine, sums) for at in (travel - overlap, travel))
        return cosine * (last - first) / overlap

    phase = np.arange(points) / points
    ratio = path + overlap
    stiffness = np.sum([pair_alone(phase + k) for k in range(math.ceil(ratio))], axis=0)
    single_phase = np.linspace(0, ratio, points)
    return MeshStiffness(phase, stiffness, pair_alone(single_phase), single_phase)
