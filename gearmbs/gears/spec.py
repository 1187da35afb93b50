"""One wheel: the numbers a gear drawing gives, checked, and what follows from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any

from gearmbs.units import Quantity, to_si

UNDERCUT_TOLERANCE = 0.8  # share of the cutter height that must clear the base circle's normal (14 teeth at 20 deg)


def involute(angle: float) -> float:
    """Involute function, tan(angle) - angle."""
    return math.tan(angle) - angle


def convert_fields(obj: object, units: dict[str, str], owner: str) -> None:
    """Replace text by SI numbers in the named fields of a frozen dataclass."""
    for name, unit in units.items():
        value = getattr(obj, name)
        if value is not None:
            object.__setattr__(obj, name, to_si(value, unit, f"{owner}.{name}"))


LARGEST_MODULE = 0.2
"""m; the largest gears made have a third of it, and a forgotten unit is far above."""


def require(condition: bool, message: str) -> None:
    """Raise ValueError with the message unless the condition holds."""
    if not condition:
        raise ValueError(message)


@dataclass(frozen=True)
class Material:
    """Elastic material of a wheel.

    Parameters
    ----------
    youngs_modulus, density : float or str
        In Pa and kg/m^3, or text with a unit.
    poisson_ratio : float
        Between 0 and 0.5.
    """

    youngs_modulus: Quantity = "2.07e5 MPa"
    poisson_ratio: float = 0.29
    density: Quantity = "7850 kg/m^3"
    name: str = "steel"

    def __post_init__(self) -> None:
        convert_fields(self, {"youngs_modulus": "Pa", "density": "kg/m^3"}, "Material")
        require(self.youngs_modulus > 0, f"Material.youngs_modulus is {self.youngs_modulus} Pa; it must be positive")
        require(self.density > 0, f"Material.density is {self.density} kg/m^3; it must be positive")
        require(0 <= self.poisson_ratio < 0.5, f"Material.poisson_ratio is {self.poisson_ratio}; give 0 up to 0.5")


@dataclass(frozen=True)
class GearSpec:
    """An external spur wheel.

    Parameters
    ----------
    teeth : int
        Number of teeth.
    module : float or str
        Module, m.
    pressure_angle : float or str
        Of the basic rack, rad or text.
    face_width : float or str
    addendum, dedendum : float or str, optional
        From the pitch circle; default ``(1 + profile_shift) m`` and ``(1.25 - profile_shift) m``.
    fillet_radius : float or str, optional
        Radius of the concave root arc; default 0.38 m.
    profile_shift : float
        Coefficient x; the tooth is thickened by ``2 x m tan(alpha)``.
    thinning : float or str
        Reduction of the tooth thickness at the pitch circle, to make backlash.
    tip_rounding : float or str
        Radius of the rounded tip edge; 0 is a sharp corner.
    bore_radius : float or str
    material : Material
    name : str

    Raises
    ------
    ValueError
        When the numbers do not make a wheel; the message names the field, its value and a remedy.

    Examples
    --------
    >>> gear = GearSpec(teeth=29, module="3.064516129 mm")
    >>> round(gear.tip_radius * 1e3, 3), round(gear.base_radius * 1e3, 3)
    (47.5, 41.756)
    """

    teeth: int
    module: Quantity
    pressure_angle: Quantity = "20 deg"
    face_width: Quantity = "20 mm"
    addendum: Quantity = None
    dedendum: Quantity = None
    fillet_radius: Quantity = None
    profile_shift: float = 0.0
    thinning: Quantity = 0.0
    tip_rounding: Quantity = 0.0
    bore_radius: Quantity = 0.0
    material: Material = field(default_factory=Material)
    name: str = "gear"

    def __post_init__(self) -> None:
        lengths = ("module", "face_width", "addendum", "dedendum", "fillet_radius", "thinning", "tip_rounding")
        units = {name: "length" for name in (*lengths, "bore_radius")} | {"pressure_angle": "angle"}
        convert_fields(self, units, self.name)
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, float) and not math.isfinite(value):
                raise ValueError(f"{self.name}.{item.name} is {value}; give a finite number")
        require(self.module > 0, f"{self.name}.module is {self.module} m; it must be positive")
        require(
            self.module <= LARGEST_MODULE,
            f"{self.name}.module is {self.module:g} m; a plain number is in m, write '{self.module:g} mm'",
        )
        defaults = {
            "addendum": (1.0 + self.profile_shift) * self.module,
            "dedendum": (1.25 - self.profile_shift) * self.module,
            "fillet_radius": 0.38 * self.module,
        }
        for name, value in defaults.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)
        self._check()

    @classmethod
    def from_radii(
        cls,
        teeth: int,
        module: Quantity,
        tip_radius: Quantity,
        root_radius: Quantity,
        **others: Any,
    ) -> GearSpec:
        """Wheel from its tip and root radii instead of addendum and dedendum."""
        name = str(others.get("name", "gear"))
        pitch = 0.5 * teeth * to_si(module, "length", f"{name}.module")
        tip = to_si(tip_radius, "length", f"{name}.tip_radius")
        root = to_si(root_radius, "length", f"{name}.root_radius")
        require(tip > pitch, f"{name}.tip_radius is {tip * 1e3:.4f} mm, inside the pitch circle {pitch * 1e3:.4f} mm")
        require(
            root < pitch, f"{name}.root_radius is {root * 1e3:.4f} mm, outside the pitch circle {pitch * 1e3:.4f} mm"
        )
        return cls(teeth, module, addendum=tip - pitch, dedendum=pitch - root, **others)

    def _check(self) -> None:
        n = self.name
        mm = 1e3
        require(
            isinstance(self.teeth, int) and self.teeth >= 5,
            f"{n}.teeth is {self.teeth!r}; give an integer of 5 or more",
        )
        require(
            math.radians(5) <= self.pressure_angle <= math.radians(40),
            f"{n}.pressure_angle is {math.degrees(self.pressure_angle):.3f} deg; give 5 to 40 deg (text needs a unit)",
        )
        for name in ("face_width", "addendum", "dedendum", "fillet_radius"):
            value = getattr(self, name)
            require(value > 0, f"{n}.{name} is {value * mm:.6g} mm; it must be positive")
        for name in ("tip_rounding", "bore_radius"):
            value = getattr(self, name)
            require(value >= 0, f"{n}.{name} is {value * mm:.6g} mm; it must not be negative")
        require(
            self.thinning >= 0,
            f"{n}.thinning is {self.thinning * mm:.6g} mm: negative backlash; "
            "thicken teeth with profile_shift and a larger centre distance instead",
        )
        require(self.root_radius > 0, f"{n}.dedendum is {self.dedendum * mm:.4f} mm, larger than the pitch radius")
        require(
            self.bore_radius < self.root_radius,
            f"{n}.bore_radius is {self.bore_radius * mm:.4f} mm, not inside the root circle "
            f"{self.root_radius * mm:.4f} mm; make the bore smaller",
        )
        require(
            self.tip_radius > self.base_radius,
            f"{n}.addendum is {self.addendum * mm:.4f} mm: the tip circle {self.tip_radius * mm:.4f} mm lies inside "
            f"the base circle {self.base_radius * mm:.4f} mm and no involute is left",
        )
        require(
            self.tooth_thickness > 0,
            f"{n}.thinning is {self.thinning * mm:.4f} mm and leaves no tooth thickness at the pitch circle",
        )
        cutter = self.dedendum - self.fillet_radius * (1 - math.sin(self.pressure_angle))
        clear = self.pitch_radius * math.sin(self.pressure_angle) ** 2
        require(
            clear >= UNDERCUT_TOLERANCE * cutter,
            f"{n} is undercut: with {self.teeth} teeth the cutter reaches {cutter * mm:.3f} mm below the pitch circle "
            f"where {clear * mm:.3f} mm is free; use more teeth, a larger profile_shift or a smaller dedendum",
        )
        require(
            self.tip_thickness > 0,
            f"{n} has pointed teeth: the flanks meet inside the tip circle {self.tip_radius * mm:.4f} mm; "
            "reduce addendum or profile_shift",
        )
        require(
            2 * self.tip_rounding < self.tip_thickness and self.tip_rounding < 0.5 * self.addendum,
            f"{n}.tip_rounding is {self.tip_rounding * mm:.4f} mm, too large for a tip "
            f"{self.tip_thickness * mm:.4f} mm thick",
        )
        require(
            self.form_radius < self.tip_radius and self.form_radius < self.pitch_radius,
            f"{n}: root circle {self.root_radius * mm:.4f} mm and fillet_radius {self.fillet_radius * mm:.4f} mm leave "
            f"no involute below the pitch circle (base circle {self.base_radius * mm:.4f} mm); increase dedendum or "
            "reduce fillet_radius",
        )
        require(
            self.fillet_half_angle < math.pi / self.teeth,
            f"{n}.fillet_radius is {self.fillet_radius * mm:.4f} mm: the root arcs of neighbouring flanks overlap; "
            "reduce it",
        )

    @property
    def pitch_radius(self) -> float:
        """Pitch circle radius, m."""
        return 0.5 * self.teeth * self.module

    @property
    def base_radius(self) -> float:
        """Base circle radius, m."""
        return self.pitch_radius * math.cos(self.pressure_angle)

    @property
    def tip_radius(self) -> float:
        """Tip (outer) circle radius, m."""
        return self.pitch_radius + self.addendum

    @property
    def root_radius(self) -> float:
        """Root circle radius, m."""
        return self.pitch_radius - self.dedendum

    @property
    def base_pitch(self) -> float:
        """Distance of neighbouring flanks along the base tangent, m."""
        return 2 * math.pi * self.base_radius / self.teeth

    @property
    def tooth_thickness(self) -> float:
        """Arc thickness at the pitch circle, m."""
        half_pitch = 0.5 * math.pi * self.module
        return half_pitch + 2 * self.profile_shift * self.module * math.tan(self.pressure_angle) - self.thinning

    @property
    def base_half_angle(self) -> float:
        """Half angle of the tooth on the base circle, rad."""
        return self.tooth_thickness / (2 * self.pitch_radius) + involute(self.pressure_angle)

    def half_angle(self, radius: float) -> float:
        """Half angle of the tooth at a radius between base and tip circle, rad."""
        return self.base_half_angle - involute(math.acos(min(1.0, self.base_radius / radius)))

    @property
    def sign(self) -> int:
        """Sign of the wheel's radii in the sums over a pair (DIN 3960): 1, since its teeth point outwards."""
        return 1

    @property
    def tip_thickness(self) -> float:
        """Arc thickness at the tip circle, m."""
        return 2 * self.tip_radius * self.half_angle(self.tip_radius)

    @property
    def tip_roll_length(self) -> float:
        """Length of roll (along the base tangent) where the involute ends at the tip, m."""
        centre = self.tip_radius - self.tip_rounding
        return math.sqrt(centre**2 - self.base_radius**2) + self.tip_rounding

    @property
    def corner_radius(self) -> float:
        """Radius of the tip corner, or of the centre of its rounding, m."""
        return self.tip_radius - self.tip_rounding

    @property
    def corner_half_angle(self) -> float:
        """Half angle of the tip corner (or its rounding's centre) from the tooth's middle, rad."""
        return self.half_angle(self.corner_radius) - self.tip_rounding / self.base_radius

    @property
    def fillet_centre_radius(self) -> float:
        """Radius of the centre of the root arc, which touches the root circle, m."""
        return self.root_radius + self.fillet_radius

    @property
    def form_radius(self) -> float:
        """Radius where the root arc stands radially, and the involute begins if that is outside the base circle, m."""
        return math.sqrt(self.fillet_centre_radius**2 - self.fillet_radius**2)

    @property
    def form_roll_length(self) -> float:
        """Length of roll where the involute begins, m."""
        return math.sqrt(max(0.0, self.form_radius**2 - self.base_radius**2))

    @property
    def fillet_half_angle(self) -> float:
        """Angle of the centre of the root arc from the tooth's middle, rad."""
        start = self.half_angle(max(self.form_radius, self.base_radius))
        return start + math.asin(self.fillet_radius / self.fillet_centre_radius)

    @property
    def mass(self) -> float:
        """Mass of a disc of the pitch radius with the bore removed, kg."""
        area = math.pi * (self.pitch_radius**2 - self.bore_radius**2)
        return self.material.density * area * self.face_width

    @property
    def inertia(self) -> tuple[float, float, float]:
        """Principal moments of inertia (Ixx, Iyy, Izz) of that disc about its centre, z the axis, kg m^2."""
        squares = self.pitch_radius**2 + self.bore_radius**2
        across = self.mass * (3 * squares + self.face_width**2) / 12
        return across, across, 0.5 * self.mass * squares
