"""ISO 6336, method B, for all cylindrical wheels: tooth stiffness (part 1), stresses of flank and root (2 and 3, 2006).

In the stresses numbers of teeth, diameters and ratio of an internal wheel are negative, as in the
standard. Load factors (application,
dynamic, face and transverse load) are the user's: multiply the nominal stresses by them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.mesh import Mesh
from gearmbs.gears.spec import GearSpec, involute
from gearmbs.units import Quantity, to_si

ITERATIONS = 60
LARGEST_HELIX_FACTOR = math.radians(30)
ISO_STEEL_MODULUS = 206e9
"""Young's modulus, Pa, that the formulae of ISO 6336-1 are stated for."""


def iso_mesh_stiffness(pair: PairGeometry) -> float:
    """Mesh stiffness c_gamma of ISO 6336-1, (0.75 epsilon_alpha + 0.25) c', N/(m of face width * m)."""
    return iso_single_stiffness(pair) * (0.75 * pair.contact_ratio + 0.25)


def iso_single_stiffness(pair: PairGeometry, web: tuple[Quantity, Quantity] | None = None) -> float:
    """Single stiffness c' of ISO 6336-1 (method B, high load), N/(m of face width * m).

    Parameters
    ----------
    pair : PairGeometry
    web : (float or str, float or str), optional
        Thickness of the web and of the rim, m, of a wheel that is no solid disc: the factor
        ``C_R = 1 + ln(b_s / b) / (5 exp(s_R / (5 m_n)))``, within the standard's limits 0.2 <= b_s / b <= 1.2 and
        s_R >= m_n.

    Notes
    -----
    c' = c'_th C_M C_R C_B cos beta with C_M = 0.8 and C_B = (1 + 0.5 (1.2 - h_fP / m_n)) (1 - 0.02 (20 - alpha_n)),
    where h_fP is the dedendum of the basic rack.

    Raises
    ------
    ValueError
        For a web or a rim that is not positive, or thicker than the larger wheel is.
    """
    one, two = pair.driver, pair.driven
    depth = 0.5 * (one.dedendum / one.module + one.profile_shift + two.dedendum / two.module + two.profile_shift)
    blank = 1.0
    if web is not None:
        thick, rim = (to_si(value, "length", "web") for value in web)
        most = max(one.outer_radius, two.outer_radius)
        if not (0.0 < thick <= most and 0.0 < rim <= most):
            raise ValueError(
                f"web is {web!r}, {thick * 1e3:g} and {rim * 1e3:g} mm; give the thickness of the web and of the "
                f"rim, up to {most * 1e3:.4g} mm (plain numbers are in m: write '30 mm')"
            )
        share = min(max(thick / pair.narrower_face_width, 0.2), 1.2)
        blank = 1 + math.log(share) / (5 * math.exp(max(rim / one.module, 1.0) / 5))
    rack = (1 + 0.5 * (1.2 - depth)) * (1 - 0.02 * (20 - math.degrees(one.pressure_angle)))
    moduli = [w.material.youngs_modulus for w in (one, two)]
    material = 2 * moduli[0] * moduli[1] / sum(moduli) / ISO_STEEL_MODULUS
    return 0.8 * rack * material * blank * math.cos(one.helix_angle) * iso_theoretical_stiffness(pair)


def iso_theoretical_stiffness(pair: PairGeometry) -> float:
    """Theoretical single stiffness c'_th = 1 / q' of ISO 6336-1, N/(m of face width * m).

    Teeth count as those of the equivalent spur wheels; an internal wheel as a rack. The standard's wheel 1 is the
    pinion, whichever wheel drives.
    """
    one, two = pair.driver, pair.driven
    if one.teeth > two.teeth:
        one, two = two, one
    x1, x2 = one.profile_shift, two.profile_shift
    z1, z2 = one.virtual_teeth, math.inf if two.internal else two.virtual_teeth
    q = 0.04723 + 0.15551 / z1 + 0.25791 / z2 - 0.00635 * x1 - 0.11654 * x1 / z1 - 0.00193 * x2
    q += -0.24188 * x2 / z2 + 0.00529 * x1**2 + 0.00182 * x2**2
    return 1e9 / q


@dataclass(frozen=True)
class ToothStresses:
    """Factors and nominal stresses of a pair; pairs of numbers are of driver and driven wheel.

    Attributes
    ----------
    tangential_force : float
        F_t at the reference circle, N.
    zone, elasticity, overlap, helix : float
        Z_H, Z_E (sqrt(Pa)), Z_epsilon and Z_beta.
    single_pair : tuple of float
        Z_B and Z_D.
    nominal_contact : float
        sigma_H0 at the pitch point, Pa.
    form, notch, rim : tuple of float
        Y_F, Y_S and Y_B.
    helix_root : float
        Y_beta.
    nominal_root : tuple of float
        sigma_F0, Pa.
    """

    tangential_force: float
    zone: float
    elasticity: float
    overlap: float
    helix: float
    single_pair: tuple[float, float]
    nominal_contact: float
    form: tuple[float, float]
    notch: tuple[float, float]
    rim: tuple[float, float]
    helix_root: float
    nominal_root: tuple[float, float]

    def contact(self, load_factor: float = 1.0) -> tuple[float, float]:
        """Contact stress of either wheel, sigma_H = Z_B,D sigma_H0 sqrt(K), Pa; ``load_factor`` is the product K."""
        base = self.nominal_contact * math.sqrt(load_factor)
        return self.single_pair[0] * base, self.single_pair[1] * base

    def root(self, load_factor: float = 1.0) -> tuple[float, float]:
        """Root stress of either wheel, sigma_F = sigma_F0 K, Pa."""
        return self.nominal_root[0] * load_factor, self.nominal_root[1] * load_factor


@dataclass(frozen=True)
class RootSection:
    """Critical section of a tooth's root in the normal section, over the normal module.

    Attributes
    ----------
    chord : float
        Thickness s_Fn.
    radius : float
        Of the fillet there, rho_F.
    arm : float
        Bending lever arm h_Fe of a load at the outer point of single pair contact.
    angle : float
        Of that load, alpha_Fen, rad.
    """

    chord: float
    radius: float
    arm: float
    angle: float


def iso_stresses(pair: Mesh, torque: Quantity = None, cutter: tuple[int, float] | None = None) -> ToothStresses:
    """Factors and nominal stresses of a pair by ISO 6336-2 and ISO 6336-3, method B.

    Parameters
    ----------
    pair : GearPair or Mesh
    torque : float or str, optional
        On the driven wheel, N m; default that of the pair's operating point.
    cutter : (int, float), optional
        Teeth and profile shift of the pinion-type cutter of an internal wheel, whose tip radius is then the wheel's
        ``fillet_radius``; without it that is the radius of the root as it is.

    Notes
    -----
    sigma_H0 = Z_H Z_E Z_eps Z_beta sqrt(F_t (u + 1) / (d_1 b u)) and sigma_F0 = F_t / (b m_n) Y_F Y_S Y_beta Y_B. The
    factor of deep teeth Y_DT is 1, as for contact ratios up to 2.05 or accuracy grades above 4. Y_B of an external
    wheel is 1: whether its bore holds a shaft or leaves a thin rim, the wheel does not say.

    Raises
    ------
    ValueError
        For a torque that is not positive, or a rim too thin for the standard.
    """
    geometry = pair.geometry
    load = to_si(pair.operating_point.torque if torque is None else torque, "torque", "torque")
    if not 0.0 < load < math.inf:
        raise ValueError(f"torque is {load} N m; give a positive load")
    one, two = geometry.driver, geometry.driven
    force = load / two.pitch_radius
    width = geometry.common_face_width
    zone, elasticity = zone_factor(geometry), elasticity_factor(geometry)
    overlap, helix = contact_ratio_factor(geometry), 1 / math.sqrt(math.cos(one.helix_angle))
    ratio = two.sign * two.teeth / one.teeth
    pressure = force / (2 * one.pitch_radius * width) * (ratio + 1) / ratio
    sections = [root_section(wheel, geometry, cutter) for wheel in (one, two)]
    form = tuple(form_factor(wheel, section) for wheel, section in zip((one, two), sections))
    notch = tuple(notch_factor(section) for section in sections)
    rim = (1.0, rim_factor(two) if two.internal else 1.0)
    lean = 1 - min(geometry.overlap_ratio, 1.0) * min(one.helix_angle, LARGEST_HELIX_FACTOR) / math.radians(120)
    nominal = [force / (width * one.module) * form[k] * notch[k] * lean * rim[k] for k in (0, 1)]
    return ToothStresses(
        tangential_force=force,
        zone=zone,
        elasticity=elasticity,
        overlap=overlap,
        helix=helix,
        single_pair=single_pair_factors(geometry),
        nominal_contact=zone * elasticity * overlap * helix * math.sqrt(pressure),
        form=(form[0], form[1]),
        notch=(notch[0], notch[1]),
        rim=rim,
        helix_root=lean,
        nominal_root=(nominal[0], nominal[1]),
    )


def zone_factor(pair: PairGeometry) -> float:
    """Z_H: curvature of the flanks at the pitch point, and the normal force from the tangential one there."""
    alpha, working = pair.driver.transverse_pressure_angle, pair.working_pressure_angle
    top = 2 * math.cos(pair.driver.base_helix_angle) * math.cos(working)
    return math.sqrt(top / (math.cos(alpha) ** 2 * math.sin(working)))


def elasticity_factor(pair: PairGeometry) -> float:
    """Z_E, sqrt(Pa)."""
    soft = sum((1 - w.material.poisson_ratio**2) / w.material.youngs_modulus for w in (pair.driver, pair.driven))
    return 1 / math.sqrt(math.pi * soft)


def contact_ratio_factor(pair: PairGeometry) -> float:
    """Z_epsilon: how many contact lines share the load."""
    alpha, beta = pair.contact_ratio, min(pair.overlap_ratio, 1.0)
    return math.sqrt((4 - alpha) / 3 * (1 - beta) + beta / alpha)


def single_pair_factors(pair: PairGeometry) -> tuple[float, float]:
    """Z_B and Z_D: from the pitch point to the inner points of single pair contact; 1 for whole overlap ratios."""
    one, two = pair.driver, pair.driven
    top = math.tan(pair.working_pressure_angle)
    beta = min(pair.overlap_ratio, 1.0)
    pitches = [2 * math.pi / w.teeth for w in (one, two)]
    # lengths of roll over base radii; those of an internal wheel count negative
    tips = [w.sign * math.sqrt((w.tip_radius / w.base_radius) ** 2 - 1) for w in (one, two)]
    factors = []
    for k in (0, 1):
        below = (tips[k] - pitches[k]) * (tips[1 - k] - (pair.contact_ratio - 1) * pitches[1 - k])
        whole = top / math.sqrt(abs(below)) if below != 0 else 1.0
        whole = max(whole - beta * (whole - 1), 1.0)
        factors.append(1.0 if (two.internal and k == 1) else whole)
    return factors[0], factors[1]


def root_section(gear: GearSpec, pair: PairGeometry, cutter: tuple[int, float] | None = None) -> RootSection:
    """Return the critical root section, at the 30 degree tangent of an external tooth or the 60 degree one.

    Parameters
    ----------
    gear : GearSpec
        One of the pair's wheels.
    pair : PairGeometry
        For where single pair contact ends.
    cutter : (int, float), optional
        As for `iso_stresses`.
    """
    m, alpha, x = gear.module, gear.pressure_angle, gear.profile_shift
    z = gear.sign * gear.virtual_teeth
    depth, tip = gear.dedendum / m + x, gear.fillet_radius / m
    radius = tip
    if gear.internal and cutter is not None:
        radius += max(cutter[1] + depth - tip, 0.0) ** 1.95 / (3.156 * 1.036 ** cutter[0])
    middle = math.pi / 4 - depth * math.tan(alpha) - (1 - math.sin(alpha)) * radius / math.cos(alpha)
    lift = radius - depth + x
    tangent, first = (math.pi / 6, math.pi / 3) if gear.internal else (math.pi / 3, math.pi / 6)
    turn = 2 / z * (math.pi / 2 - middle) - tangent
    theta = first
    for _ in range(ITERATIONS):
        theta -= (theta - 2 * lift / z * math.tan(theta) + turn) / (1 - 2 * lift / (z * math.cos(theta) ** 2))
    along, across = (1.0, math.sqrt(3)) if gear.internal else (math.sqrt(3), 1.0)
    reach = lift / math.cos(theta) - radius
    chord = z * math.sin(tangent - theta) + along * reach
    fillet = radius + 2 * lift**2 / (math.cos(theta) * (z * math.cos(theta) ** 2 - 2 * lift))
    outer, load_angle, lean = _outer_point(gear, pair, z)
    arm = 0.5 * (
        (math.cos(lean) - math.sin(lean) * math.tan(load_angle)) * outer
        - z * math.cos(tangent - theta)
        - across * reach
    )
    return RootSection(chord, fillet, arm, load_angle)


def _outer_point(gear: GearSpec, pair: PairGeometry, z: float) -> tuple[float, float, float]:
    """Diameter of the outer point of single pair contact, load angle alpha_Fen, gamma_e; equivalent wheel, over m_n."""
    m, alpha = gear.module, gear.pressure_angle
    base = z * math.cos(alpha)
    tip = z + 2 * gear.sign * (gear.tip_radius - gear.pitch_radius) / m
    ratio = pair.contact_ratio / math.cos(gear.base_helix_angle) ** 2
    pitch = math.pi * math.cos(alpha) * (ratio - 1)
    rolled = math.sqrt((tip / 2) ** 2 - (base / 2) ** 2) - gear.sign * pitch
    outer = 2 * gear.sign * math.hypot(rolled, base / 2)
    at = math.acos(base / outer)
    lean = (0.5 * math.pi + 2 * math.tan(alpha) * gear.profile_shift) / z + involute(alpha) - involute(at)
    return outer, at - lean, lean


def form_factor(gear: GearSpec, section: RootSection) -> float:
    """Y_F: bending stress of the root by the lever arm of the load and the thickness of the section."""
    return 6 * section.arm * math.cos(section.angle) / (section.chord**2 * math.cos(gear.pressure_angle))


def notch_factor(section: RootSection) -> float:
    """Y_S: stress concentration in the fillet, for notch parameters from 1 to 8."""
    slender = section.chord / section.arm
    sharp = section.chord / (2 * section.radius)
    return (1.2 + 0.13 * slender) * sharp ** (1 / (1.21 + 2.3 / slender))


def rim_factor(gear: GearSpec) -> float:
    """Y_B of an internal wheel with its rim: 1 from 3.5 modules on."""
    thick = gear.rim_thickness / gear.module
    if thick >= 3.5:
        return 1.0
    if not thick > 1.75:
        raise ValueError(
            f"{gear.name}.rim_thickness is {gear.rim_thickness * 1e3:.4g} mm, {thick:.3g} modules; ISO 6336-3 needs "
            "more than 1.75"
        )
    return 1.15 * math.log(8.324 / thick)
