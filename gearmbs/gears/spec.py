"""One wheel: the numbers a gear drawing gives, checked, and what follows from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from functools import cached_property
from numbers import Integral, Real
from typing import Literal, TypedDict, Unpack

from gearmbs._display import Shown, Written
from gearmbs.units import Given, Quantity, QuantityLike, doubt_of_material, shown, to_si, truth
from gearmbs.wording import warn

UNDERCUT_TOLERANCE = 0.8  # share of the cutter height that must clear the base circle's normal (14 teeth at 20 deg)

COUNTED_TWICE = 0.1
"""Share of a shaft's mass with its wheels that may be counted twice: it lowers natural frequencies by up to 5 %."""


def involute(angle: float) -> float:
    """Involute function, tan(angle) - angle."""
    return math.tan(angle) - angle


def convert_fields(obj: object, units: dict[str, str], owner: str) -> None:
    """Replace text by SI numbers in the named fields of a frozen dataclass."""
    for name, unit in units.items():
        value = getattr(obj, name)
        # numbers, and texts that have been read, are in SI already
        if value is not None and (type(value) not in (float, Given) or math.isnan(value)):
            object.__setattr__(obj, name, to_si(value, unit, f"{owner}.{name}"))


ROOT_SHARES = (0.9, 0.89, 0.87, 0.86, 0.83, 0.8, 0.75, 0.67, 0.5)
"""Steps in which the default root arc is made smaller, from 0.38 to 0.04 modules."""

OF_THE_ROOT_ARC = ("fillet_centre_radius", "form_radius", "form_roll_length", "fillet_half_angle")
"""What is kept of a wheel and follows from its root arc."""

LARGEST_HELIX = math.radians(45)

LARGEST_MODULE = 0.2
"""m; the largest gears made have a third of it, and a forgotten unit is far above."""


WIDEST_FACE = 5.0
"""m; the widest wheels, of rolling mills and ships, have half of it, and a forgotten unit is above."""
MOST_MODULES = 300.0
"""Face width or rim of a usual wheel, in modules, at most: pump wheels and long pinions have up to 100."""


@dataclass(frozen=True)
class Material(Written):
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
        if not self.youngs_modulus > 0:
            raise ValueError(f"Material.youngs_modulus is {self.youngs_modulus} Pa; it must be positive")
        if not self.density > 0:
            raise ValueError(f"Material.density is {self.density} kg/m^3; it must be positive")
        if not 0 <= self.poisson_ratio < 0.5:
            raise ValueError(f"Material.poisson_ratio is {self.poisson_ratio}; give 0 up to 0.5")
        doubt = doubt_of_material(self.youngs_modulus, self.density)
        if doubt:
            warn(f"Material '{self.name}': {doubt}")


class WheelKeywords(TypedDict, total=False):
    """Fields of `GearSpec` that every way to make one hands on, as they are given, for type checkers."""

    pressure_angle: QuantityLike
    face_width: QuantityLike
    fillet_radius: QuantityLike | None
    profile_shift: float
    thinning: QuantityLike
    tip_rounding: QuantityLike
    bore_radius: QuantityLike
    material: Material
    helix_angle: QuantityLike
    hand: Literal["right", "left"]
    rim_thickness: QuantityLike | None


class OfRadiiKeywords(WheelKeywords, total=False):
    """Further fields of a wheel that is given by its radii."""

    name: str
    internal: bool


class RingKeywords(WheelKeywords, total=False):
    """Further fields of an internal wheel."""

    addendum: QuantityLike | None
    dedendum: QuantityLike | None


@dataclass(frozen=True)
class GearSpec(Shown, Written):
    """A cylindrical involute wheel: external or internal, spur or helical.

    Parameters
    ----------
    teeth : int
        Number of teeth; negative, as in ISO 21771, for an internal wheel.
    module : float or str
        Module, m; the normal module of a helical wheel.
    pressure_angle : float or str
        Of the basic rack (normal section), rad or text.
    face_width : float or str
    addendum, dedendum : float or str, optional
        From the pitch circle; default ``(1 + profile_shift) m`` and ``(1.25 - profile_shift) m``. Those of an internal
        wheel point inwards and outwards.
    fillet_radius : float or str, optional
        Radius of the concave root arc; default 0.38 m, of an internal wheel 0.2 m, or less where a narrow root has no
        room for it, or where an arc of 0.38 m, which stands on the root circle as a half round, would take of the
        involute what a rack with that tip radius leaves: above 60 teeth at 20 degrees without shift.
    profile_shift : float
        Coefficient x of ISO 21771: the tooth is thickened by ``2 x m tan(alpha)`` and moved towards its tip, which
        for an internal wheel is inwards. See `outward_shift` and `ring` for the other convention in use.
    thinning : float or str
        Reduction of the (transverse) tooth thickness at the pitch circle, to make backlash.
    tip_rounding : float or str
        Radius of the rounded tip edge; 0 is a sharp corner.
    bore_radius : float or str
        Of an external wheel. Without a bore the wheel is solid, and a shaft through it is counted besides: give the
        shaft's radius, as rotor programs take a disc's inner diameter from the shaft.
    material : Material
    name : str
    helix_angle : float or str
        At the pitch circle, rad or text; 0 is a spur wheel.
    hand : {"right", "left"}
        Sense of the helix. External wheels mesh with opposite hands, an internal one with its own.
    internal : bool
        Whether the teeth point inwards.
    rim_thickness : float or str, optional
        Material of an internal wheel outside its root circle; default 3 m.

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
    helix_angle: Quantity = 0.0
    hand: Literal["right", "left"] = "right"
    internal: bool = False
    rim_thickness: Quantity = None

    def __post_init__(self) -> None:
        self._read()
        self._check_sizes()
        defaults = {
            "addendum": (1.0 + self.profile_shift) * self.module,
            "dedendum": (1.25 - self.profile_shift) * self.module,
            "fillet_radius": (0.2 if self.internal else 0.38) * self.module,
            "rim_thickness": 3.0 * self.module if self.internal else 0.0,
        }
        fit_root = self.fillet_radius is None
        for name, value in defaults.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)
        self._check_numbers()
        if fit_root:
            self._fit_root()
        self._check()

    def _read(self) -> None:
        """Convert what was written to SI, and refuse what has another type."""
        lengths = ("module", "face_width", "addendum", "dedendum", "fillet_radius", "thinning", "tip_rounding")
        units = {name: "length" for name in (*lengths, "bore_radius", "rim_thickness")}
        convert_fields(self, units | {"pressure_angle": "angle", "helix_angle": "angle"}, self.name)
        if self.module is None:
            raise ValueError(f"{self.name}.module is None; give a length such as '3 mm'")
        shift = self.profile_shift
        if not (isinstance(shift, Real) and not isinstance(shift, bool)):
            raise ValueError(
                f"{self.name}.profile_shift is {shift!r}; give the coefficient x, a number: 0.5 for half a module"
            )
        object.__setattr__(self, "profile_shift", float(shift))
        object.__setattr__(self, "internal", truth(self.internal, f"{self.name}.internal"))
        if not isinstance(self.material, Material):
            raise ValueError(
                f"{self.name}.material is {self.material!r}; give a Material, such as Material('2.1e5 MPa', 0.3, "
                "'7850 kg/m^3')"
            )
        if isinstance(self.teeth, Integral) and not isinstance(self.teeth, bool):
            object.__setattr__(self, "teeth", int(self.teeth))
        if isinstance(self.teeth, int) and self.teeth < 0:
            object.__setattr__(self, "teeth", -self.teeth)
            object.__setattr__(self, "internal", True)

    def _check_sizes(self) -> None:
        """Refuse, or warn of, sizes that are no number or look like one of another unit."""
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, float) and not math.isfinite(value):
                raise ValueError(f"{self.name}.{item.name} is {value}; give a finite number")
        if not self.module > 0:
            raise ValueError(f"{self.name}.module is {self.module} m; it must be positive")
        if not self.module <= LARGEST_MODULE:
            raise ValueError(
                f"{self.name}.module is {self.module:g} m; a plain number is in m, write '{self.module:g} mm'"
            )
        for name in ("face_width", "rim_thickness"):
            value = getattr(self, name) or 0.0
            if not value <= WIDEST_FACE:
                raise ValueError(
                    f"{self.name}.{name} is {value:g} m, and no wheel has that; a plain number is in m, write "
                    f"'{value:g} mm'"
                )
            if value > MOST_MODULES * self.module:
                warn(
                    f"{self.name}.{name} is {shown(value, 'mm')}, {value / self.module:.4g} times the module of "
                    f"{shown(self.module, 'mm')}; is another unit meant?",
                )

    def _fit_root(self) -> None:
        """Reduce the default root arcs where neighbours overlap or flanks lose what a rack leaves them."""
        for share in ROOT_SHARES:
            arc = share * self.fillet_radius
            if arc >= abs(self.root_radius) or self.fillet_centre_radius <= arc:
                return
            overlapping = self.fillet_half_angle >= math.pi / self.teeth
            shortened = not self.internal and self.form_roll_length > self._rack_form_roll
            if not (overlapping or shortened):
                return
            object.__setattr__(self, "fillet_radius", arc)
            for name in OF_THE_ROOT_ARC:
                self.__dict__.pop(name, None)

    @property
    def _rack_form_roll(self) -> float:
        """Length of roll down to which a rack with a tip radius of 0.38 modules cuts an involute, m."""
        depth = self.dedendum - 0.38 * self.module * (1 - math.sin(self.pressure_angle))
        sine = math.sin(self.transverse_pressure_angle)
        return max(0.0, self.pitch_radius * sine - depth / sine)

    @classmethod
    def from_radii(
        cls,
        teeth: int,
        module: QuantityLike,
        tip_radius: QuantityLike,
        root_radius: QuantityLike,
        **others: Unpack[OfRadiiKeywords],
    ) -> GearSpec:
        """Wheel from its tip and root radii instead of addendum and dedendum."""
        name = str(others.get("name", "gear"))
        inwards = teeth < 0 or truth(others.get("internal", False), f"{name}.internal")
        helix = to_si(others.get("helix_angle", 0.0), "angle", f"{name}.helix_angle")
        pitch = 0.5 * abs(teeth) * to_si(module, "length", f"{name}.module") / math.cos(helix)
        tip = to_si(tip_radius, "length", f"{name}.tip_radius")
        root = to_si(root_radius, "length", f"{name}.root_radius")
        sign = -1 if inwards else 1
        words = ("outside", "inside") if inwards else ("inside", "outside")
        if not sign * tip > sign * pitch:
            raise ValueError(
                f"{name}.tip_radius is {tip * 1e3:.4f} mm, {words[0]} the pitch circle {pitch * 1e3:.4f} mm"
            )
        if not sign * root < sign * pitch:
            raise ValueError(
                f"{name}.root_radius is {root * 1e3:.4f} mm, {words[1]} the pitch circle {pitch * 1e3:.4f} mm"
            )
        return cls(teeth, module, addendum=sign * (tip - pitch), dedendum=sign * (pitch - root), **others)

    @classmethod
    def ring(
        cls,
        teeth: int,
        module: QuantityLike,
        *,
        outward_shift: float | None = None,
        name: str = "ring",
        **others: Unpack[RingKeywords],
    ) -> GearSpec:
        """Internal wheel.

        Parameters
        ----------
        teeth : int
        module : float or str
        outward_shift : float, optional
            Profile shift in the convention of catalogues and of sums ``x_ring - x_planet``: positive outwards, that is
            ``-profile_shift``. Give one of the two.
        name : str
        **others
            Further fields of `GearSpec`.

        Examples
        --------
        >>> ring = GearSpec.ring(56, "45 mm", outward_shift=0.501, addendum="45 mm", dedendum="56.25 mm")
        >>> ring.profile_shift
        -0.501
        """
        if outward_shift is not None:
            if "profile_shift" in others:
                raise ValueError(
                    f"{name}: both profile_shift and outward_shift are given; give one (profile_shift = -outward_shift)"
                )
            if not (isinstance(outward_shift, Real) and not isinstance(outward_shift, bool)):
                raise ValueError(
                    f"{name}.outward_shift is {outward_shift!r}; give the coefficient, a number: half a module is 0.5"
                )
            others["profile_shift"] = -outward_shift
        return cls(abs(teeth), module, internal=True, name=name, **others)

    def _check(self) -> None:
        if self.internal:
            self._check_internal()
        else:
            self._check_external()
        self._check_teeth()

    def _check_numbers(self) -> None:
        n, mm = self.name, 1e3
        if not (isinstance(self.teeth, int) and self.teeth >= 5):
            raise ValueError(f"{n}.teeth is {self.teeth!r}; give an integer of 5 or more")
        if not math.radians(5) <= self.pressure_angle <= math.radians(40):
            raise ValueError(
                f"{n}.pressure_angle is {math.degrees(self.pressure_angle):.3f} deg; give 5 to 40 deg (text needs a "
                "unit)"
            )
        if not 0 <= self.helix_angle <= LARGEST_HELIX:
            raise ValueError(
                f"{n}.helix_angle is {math.degrees(self.helix_angle):.3f} deg; give 0 to 45 deg and the sense as hand"
                + (
                    ""
                    if isinstance(self.helix_angle, Given)
                    else f" (plain numbers: rad; write '{self.helix_angle:g} deg')"
                )
            )
        if self.hand not in ("right", "left"):
            raise ValueError(f"{n}.hand is {self.hand!r}; choose 'right' or 'left'")
        for name in ("face_width", "addendum", "dedendum", "fillet_radius"):
            value = getattr(self, name)
            if not value > 0:
                raise ValueError(f"{n}.{name} is {value * mm:.6g} mm; it must be positive")
        for name in ("tip_rounding", "bore_radius", "rim_thickness"):
            value = getattr(self, name)
            if not value >= 0:
                raise ValueError(f"{n}.{name} is {value * mm:.6g} mm; it must not be negative")
        if not self.thinning >= 0:
            raise ValueError(
                f"{n}.thinning is {self.thinning * mm:.6g} mm: negative backlash; "
                "thicken teeth with profile_shift and a larger centre distance instead"
            )

    def _check_internal(self) -> None:
        n, mm = self.name, 1e3
        if self.bore_radius != 0:
            raise ValueError(f"{n}.bore_radius is {self.bore_radius * mm:.4f} mm; an internal wheel has none")
        if not self.rim_thickness > 0:
            raise ValueError(f"{n}.rim_thickness is 0; an internal wheel needs material outside its root circle")

    def _check_external(self) -> None:
        n, mm = self.name, 1e3
        if not self.root_radius > 0:
            raise ValueError(f"{n}.dedendum is {self.dedendum * mm:.4f} mm, larger than the pitch radius")
        if not self.bore_radius < self.root_radius:
            raise ValueError(
                f"{n}.bore_radius is {self.bore_radius * mm:.4f} mm, not inside the root circle "
                f"{self.root_radius * mm:.4f} mm; make the bore smaller"
            )
        if self.rim_thickness != 0:
            raise ValueError(
                f"{n}.rim_thickness is {self.rim_thickness * mm:.4f} mm; only internal wheels have it, give bore_radius"
            )
        cutter = self.dedendum - self.fillet_radius * (1 - math.sin(self.pressure_angle))
        clear = self.pitch_radius * math.sin(self.transverse_pressure_angle) ** 2
        if self.tip_radius > self.base_radius and self.tooth_thickness > 0:
            if not clear >= UNDERCUT_TOLERANCE * cutter:
                raise ValueError(
                    f"{n} is undercut: with {self.teeth} teeth the cutter reaches {cutter * mm:.3f} mm below the pitch "
                    f"circle where {clear * mm:.3f} mm is free; use more teeth, a larger profile_shift or a smaller "
                    "dedendum"
                )

    def _check_teeth(self) -> None:
        n, mm = self.name, 1e3
        if not self.tip_radius > self.base_radius:
            raise ValueError(
                f"{n}.addendum is {self.addendum * mm:.4f} mm: the tip circle {self.tip_radius * mm:.4f} mm lies "
                f"inside the base circle {self.base_radius * mm:.4f} mm and no involute is left"
            )
        if not self.tooth_thickness > 0:
            raise ValueError(
                f"{n}.thinning is {self.thinning * mm:.4f} mm and leaves no tooth thickness at the pitch circle"
            )
        if not self.tip_thickness > 0:
            raise ValueError(
                f"{n} has pointed teeth: the flanks meet inside the tip circle {self.tip_radius * mm:.4f} mm; "
                "reduce addendum or profile_shift"
            )
        if not (2 * self.tip_rounding < self.tip_thickness and self.tip_rounding < 0.5 * self.addendum):
            raise ValueError(
                f"{n}.tip_rounding is {self.tip_rounding * mm:.4f} mm, too large for a tip "
                f"{self.tip_thickness * mm:.4f} mm thick"
            )
        below = "above" if self.internal else "below"
        form = self.sign * self.form_radius
        if not (form < self.sign * self.tip_radius and form < self.sign * self.pitch_radius):
            raise ValueError(
                f"{n}: root circle {self.root_radius * mm:.4f} mm and fillet_radius {self.fillet_radius * mm:.4f} mm "
                f"leave no involute {below} the pitch circle (base circle {self.base_radius * mm:.4f} mm); increase "
                "dedendum or reduce fillet_radius"
            )
        if not self.fillet_half_angle < math.pi / self.teeth:
            raise ValueError(
                f"{n}.fillet_radius is {self.fillet_radius * mm:.4f} mm: the root arcs of neighbouring flanks overlap; "
                "reduce it"
            )

    @cached_property
    def sign(self) -> int:
        """Sign of the wheel's radii in the sums over a pair (ISO 21771): 1 for external wheels, -1 for internal."""
        return -1 if self.internal else 1

    @cached_property
    def outward_shift(self) -> float:
        """Profile shift counted positive outwards, as catalogues and sums ``x_ring - x_planet`` have it."""
        return self.sign * self.profile_shift

    @cached_property
    def transverse_module(self) -> float:
        """Module in the transverse section, m."""
        return self.module / math.cos(self.helix_angle)

    @cached_property
    def transverse_pressure_angle(self) -> float:
        """Pressure angle in the transverse section, rad: tan alpha_t = tan alpha_n / cos beta."""
        if self.helix_angle == 0:
            return self.pressure_angle
        return math.atan(math.tan(self.pressure_angle) / math.cos(self.helix_angle))

    @cached_property
    def base_helix_angle(self) -> float:
        """Helix angle on the base cylinder, rad: sin beta_b = sin beta cos alpha_n."""
        return math.asin(math.sin(self.helix_angle) * math.cos(self.pressure_angle))

    @cached_property
    def twist_tangent(self) -> float:
        """Tangent of the base helix angle, positive for a right hand: the section at z turns by it times z/r_b."""
        return (1.0 if self.hand == "right" else -1.0) * math.tan(self.base_helix_angle)

    @cached_property
    def virtual_teeth(self) -> float:
        """Teeth of the equivalent spur wheel, z / (cos^2 beta_b cos beta)."""
        return self.teeth / (math.cos(self.base_helix_angle) ** 2 * math.cos(self.helix_angle))

    @cached_property
    def pitch_radius(self) -> float:
        """Pitch circle radius, m."""
        return 0.5 * self.teeth * self.transverse_module

    @cached_property
    def base_radius(self) -> float:
        """Base circle radius, m."""
        return self.pitch_radius * math.cos(self.transverse_pressure_angle)

    @cached_property
    def tip_radius(self) -> float:
        """Tip circle radius, m; the smaller one of an internal wheel."""
        return self.pitch_radius + self.sign * self.addendum

    @cached_property
    def root_radius(self) -> float:
        """Root circle radius, m."""
        return self.pitch_radius - self.sign * self.dedendum

    @cached_property
    def outer_radius(self) -> float:
        """Largest radius of the body, m: the tip circle, or the rim of an internal wheel."""
        return self.root_radius + self.rim_thickness if self.internal else self.tip_radius

    @cached_property
    def base_pitch(self) -> float:
        """Transverse distance of neighbouring flanks along the base tangent, m."""
        return 2 * math.pi * self.base_radius / self.teeth

    @cached_property
    def tooth_thickness(self) -> float:
        """Transverse arc thickness at the pitch circle, m."""
        half_pitch = 0.5 * math.pi * self.module
        normal = half_pitch + 2 * self.profile_shift * self.module * math.tan(self.pressure_angle)
        return normal / math.cos(self.helix_angle) - self.thinning

    @cached_property
    def base_half_angle(self) -> float:
        """Half angle of the tooth on the base circle, rad; that of an internal one may be negative."""
        return self.tooth_thickness / (2 * self.pitch_radius) + self.sign * involute(self.transverse_pressure_angle)

    def half_angle(self, radius: float) -> float:
        """Half angle of the tooth at a radius outside the base circle, rad."""
        return self.base_half_angle - self.sign * involute(math.acos(min(1.0, self.base_radius / radius)))

    @cached_property
    def tip_thickness(self) -> float:
        """Arc thickness at the tip circle, m."""
        return 2 * self.tip_radius * self.half_angle(self.tip_radius)

    @cached_property
    def tip_roll_length(self) -> float:
        """Length of roll (along the base tangent) where the involute ends at the tip, m."""
        return math.sqrt(self.corner_radius**2 - self.base_radius**2) + self.sign * self.tip_rounding

    @cached_property
    def corner_radius(self) -> float:
        """Radius of the tip corner, or of the centre of its rounding, m."""
        return self.tip_radius - self.sign * self.tip_rounding

    @cached_property
    def corner_half_angle(self) -> float:
        """Half angle of the tip corner (or its rounding's centre) from the tooth's middle, rad."""
        return self.half_angle(self.corner_radius) - self.tip_rounding / self.base_radius

    @cached_property
    def fillet_centre_radius(self) -> float:
        """Radius of the centre of the root arc, which touches the root circle, m."""
        return self.root_radius + self.sign * self.fillet_radius

    @cached_property
    def form_radius(self) -> float:
        """Radius where the root arc stands radially, and the involute begins if that is outside the base circle, m."""
        return math.sqrt(self.fillet_centre_radius**2 - self.fillet_radius**2)

    @cached_property
    def form_roll_length(self) -> float:
        """Length of roll where the involute begins, m."""
        return math.sqrt(max(0.0, self.form_radius**2 - self.base_radius**2))

    @cached_property
    def fillet_half_angle(self) -> float:
        """Angle of the centre of the root arc from the tooth's middle, rad."""
        start = self.half_angle(max(self.form_radius, self.base_radius))
        return start + math.asin(self.fillet_radius / self.fillet_centre_radius)

    @cached_property
    def _body_radii(self) -> tuple[float, float]:
        return (self.pitch_radius, self.outer_radius) if self.internal else (self.bore_radius, self.pitch_radius)

    @cached_property
    def mass(self) -> float:
        """Mass of a disc of the pitch radius with the bore removed, or of a rim from the pitch radius outwards, kg."""
        inner, outer = self._body_radii
        return self.material.density * (math.pi * (outer**2 - inner**2)) * self.face_width

    def mass_within(self, radius: float, width: float) -> float:
        """Return the mass of that body inside a cylinder about its axis, kg: what a solid shaft there counts again.

        Parameters
        ----------
        radius, width : float
            Of the cylinder; ``width`` is how much of the face it passes, m.
        """
        inner, outer = self._body_radii
        area = math.pi * max(0.0, min(radius, outer) ** 2 - inner**2)
        return self.material.density * area * min(width, self.face_width)

    @cached_property
    def inertia(self) -> tuple[float, float, float]:
        """Principal moments of inertia (Ixx, Iyy, Izz) of that body about its centre, z the axis, kg m^2."""
        inner, outer = self._body_radii
        squares = outer**2 + inner**2
        across = self.mass * (3 * squares + self.face_width**2) / 12
        return across, across, 0.5 * self.mass * squares
