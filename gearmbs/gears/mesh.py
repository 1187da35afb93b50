"""How two wheels mesh: law of a tooth pair, friction, slices along the face, load; what analyses and tables ask."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Iterable
from dataclasses import InitVar, dataclass, field
from functools import partial
from numbers import Integral
from typing import TYPE_CHECKING, Any, Literal, Protocol

from gearmbs._display import Written, html_table
from gearmbs.contact.law_kinds import LAW_KINDS
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.modifications import STEPS_A_DETAIL, Fault
from gearmbs.gears.spec import WIDEST_FACE, Material
from gearmbs.units import Given, Quantity, shown, to_si, truth
from gearmbs.wording import any_of, warn

if TYPE_CHECKING:
    from rich.table import Table

    from gearmbs.gears.spec import GearSpec

# Contact and friction laws as users define them; the compiled forms are in ``gearmbs.contact.laws``.


DAMPING_RATIO = 0.07
"""Damping ratio of a mesh where none is given: the geometric mean of 0.03 and 0.17, a range that is quoted for meshes
of steel gears without the measurement behind it, which has not been found; 0.07 itself is what models of gears in the
literature take. It is a convention, no measurement of the gears at hand: their own ratio, if known, is the one to
give, and amplitudes at a resonance are in inverse proportion to it."""
DEEPEST = 0.02
"""Penetration of full damping, m, at most: a tenth of the largest module, and 200 times ADAMS's 0.1 mm."""
RATIO_DEPTH = 2e-6
"""Penetration, m, at which the damping by a ratio is fully on: what a tooth pair yields under 25 to 30 N/mm, less than
gears carry; below it damping falls to nothing, so that flanks meet without a blow."""


@dataclass(frozen=True)
class ContactLaw(Written):
    """Normal force of one tooth pair over its face, against penetration and its rate.

    Use the class methods; each states its own formula. Kinds without one are made by the class. ``stiffness`` and
    ``damping`` refer to the whole face of a pair of parallel wheels whose faces stand opposite, that of the narrower
    one, and are distributed evenly over it: what an axial shift takes out of mesh is missing.

    Attributes
    ----------
    kind : str
        One of `gearmbs.contact.law_kinds.LAW_KINDS`.
    stiffness : float or str
        K, N/m^exponent.
    exponent : float
    damping : float or str
        C, N s/m; for Hunt-Crossley the factor on the penetration rate, s/m; of others in the unit of their row.
    depth : float or str
        Penetration at which the damping is fully on, m; of laws whose damping is a factor on the elastic force, any.
    """

    kind: str
    stiffness: Quantity
    exponent: float
    damping: Quantity
    depth: Quantity = 1.0

    def __post_init__(self) -> None:
        if self.kind not in LAW_KINDS:
            raise ValueError(f"ContactLaw.kind is {self.kind!r}; choose {any_of(map(repr, LAW_KINDS))}")
        units = f"N/m^{self.exponent!r}", LAW_KINDS[self.kind].damping_unit, "length"
        for name, unit in zip(("stiffness", "damping", "depth"), units):
            object.__setattr__(self, name, to_si(getattr(self, name), unit, f"ContactLaw.{name}"))
        for name, low in (("stiffness", 0.0), ("exponent", 0.0), ("depth", 0.0)):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > low):
                raise ValueError(f"ContactLaw.{name} is {value}; it must be positive and finite")
        if not (math.isfinite(self.damping) and self.damping >= 0):
            raise ValueError(f"ContactLaw.damping is {self.damping}; it must not be negative")
        if self.damping > 0.0 and not LAW_KINDS[self.kind].damps_by_factor and self.depth > DEEPEST:
            raise ValueError(
                f"ContactLaw.depth is {shown(self.depth, 'mm', '.4g')}, which no teeth yield, so that nothing would be "
                f"damped; give up to {shown(DEEPEST, 'mm')} (a plain number is in m: write '{self.depth:g} mm')"
            )
        if self.exponent < 1:
            raise ValueError(
                f"ContactLaw.exponent is {self.exponent}; below 1 the stiffness is infinite at first touch"
            )

    def __str__(self) -> str:
        """Law, stiffness and damping in a line, in the units of a drawing."""
        if self.damping == 0.0:
            damping = "no damping"
        elif LAW_KINDS[self.kind].damps_by_factor:
            damping = f"damping factor {self.damping:.4g} {LAW_KINDS[self.kind].damping_unit}"
        else:
            damping = f"damping {1e-3 * self.damping:.4g} N s/mm, fully on at {1e6 * self.depth:.4g} um"
        unit = "N/mm" if self.exponent == 1.0 else f"N/mm^{self.exponent:.4g}"
        return f"{self.kind}, {self.stiffness * 1e-3**self.exponent:.5g} {unit} a tooth pair, {damping}"

    @property
    def is_impact(self) -> bool:
        """Whether it is ADAMS's IMPACT, with some stiffness and exponent."""
        return LAW_KINDS[self.kind].is_impact

    @classmethod
    def makers(cls) -> dict[str, Callable[..., ContactLaw]]:
        """Return by kind what makes a law from its settings."""
        return {kind: getattr(cls, row.maker, partial(cls, kind)) for kind, row in LAW_KINDS.items()}

    @classmethod
    def impact(
        cls,
        stiffness: Quantity = "2.9852e5 N/mm^1.3",
        exponent: float = 1.3,
        damping: Quantity = None,
        depth: Quantity = "0.1 mm",
    ) -> ContactLaw:
        """ADAMS's IMPACT, the paper's eq. (10)-(11): ``max(0, K x^e + C STEP(x, 0, 0, d, 1) dx/dt)``.

        Parameters
        ----------
        stiffness : float or str
            K in N/m^e, or text such as ``"2.9852e5 N/mm^1.3"``.
        exponent : float
            e.
        damping : float or str, optional
            C; default 0.001 of the stiffness, taken as the paper and ADAMS do: the number of K in N/mm^e times 0.001
            is the number of C in N s/mm.
        depth : float or str
            d, the penetration of full damping.
        """
        k = to_si(stiffness, f"N/m^{exponent!r}", "ContactLaw.stiffness")
        c = 0.001 * k * 1e-3**exponent * 1e3 if damping is None else to_si(damping, "N*s/m", "ContactLaw.damping")
        return cls("impact", k, float(exponent), c, to_si(depth, "length", "ContactLaw.depth"))

    @classmethod
    def hunt_crossley(
        cls, stiffness: Quantity = "2.9852e5 N/mm^1.3", exponent: float = 1.3, factor: Quantity = "0.5 s/m"
    ) -> ContactLaw:
        """Hunt and Crossley's law ``max(0, K x^e (1 + c dx/dt))``; c is about 1.5 (1 - restitution) / impact speed."""
        k = to_si(stiffness, f"N/m^{exponent!r}", "ContactLaw.stiffness")
        return cls("hunt-crossley", k, float(exponent), to_si(factor, "s/m", "ContactLaw.factor"), 1.0)

    @classmethod
    def linear(cls, stiffness: Quantity, damping: Quantity = 0.0, depth: Quantity = "0.1 mm") -> ContactLaw:
        """A linear spring per tooth pair with IMPACT's damping."""
        k = to_si(stiffness, "N/m", "ContactLaw.stiffness")
        c = to_si(damping, "N*s/m", "ContactLaw.damping")
        return cls("linear", k, 1.0, c, to_si(depth, "length", "ContactLaw.depth"))

    @classmethod
    def hertz_line(
        cls,
        face_width: Quantity = "20 mm",
        youngs_modulus: Quantity = "2.07e5 MPa",
        poisson_ratio: float = 0.29,
        damping: Quantity = 0.0,
        depth: Quantity = "0.1 mm",
    ) -> ContactLaw:
        """Line contact of two cylinders by Palmgren's formula, with IMPACT's damping.

        ``x = 3.84e-5 F^0.9 / b^0.8`` (mm, N) for steel of 206 GPa and 0.3, scaled by the reduced modulus to the power
        -0.9: F = K x^(10/9), independent of the flanks' curvature.
        """
        width = to_si(face_width, "length", "ContactLaw.face_width")
        if not 0.0 < width <= WIDEST_FACE:
            raise ValueError(
                f"ContactLaw.face_width is {width:g} m; give that of a wheel (a plain number is in m: write "
                f"'{width:g} mm')"
            )
        solid = Material(youngs_modulus, poisson_ratio)
        modulus = solid.youngs_modulus / (1 - solid.poisson_ratio**2)
        relative = modulus / (206e9 / (1 - 0.3**2))
        k = ((width * 1e3) ** 0.8 / 3.84e-5) ** (10 / 9) * relative * 1e3 ** (10 / 9)
        c = to_si(damping, "N*s/m", "ContactLaw.damping")
        return cls("hertz", k, 10 / 9, c, to_si(depth, "length", "ContactLaw.depth"))


@dataclass(frozen=True)
class FlankFriction(Written):
    """Coulomb friction between flanks, regularised in the sliding speed.

    Parameters
    ----------
    static, dynamic : float
        Coefficients; the static one is usually the larger.
    static_speed, dynamic_speed : float or str
        Speeds of full static and of dynamic friction (ADAMS law); the smooth law uses ``dynamic`` and the first.
    kind : {"adams", "smooth", "none"}

    Warns
    -----
    UserWarning
        If the static coefficient of the ADAMS law is below the dynamic one.
    """

    static: float = 0.1
    dynamic: float = 0.05
    static_speed: Quantity = "100 mm/s"
    dynamic_speed: Quantity = "1000 mm/s"
    kind: Literal["adams", "smooth", "none"] = "adams"

    def __post_init__(self) -> None:
        for name in ("static_speed", "dynamic_speed"):
            object.__setattr__(self, name, to_si(getattr(self, name), "speed", f"FlankFriction.{name}"))
        for name in ("static", "dynamic"):
            value = getattr(self, name)
            if not (math.isfinite(value) and 0 <= value <= 2):
                raise ValueError(f"FlankFriction.{name} is {value}; give 0 to 2")
        if not 0 < self.static_speed < self.dynamic_speed:
            raise ValueError(
                f"FlankFriction.static_speed is {self.static_speed} m/s and dynamic_speed {self.dynamic_speed} m/s; "
                "the first must be positive and below the second"
            )
        if self.kind not in ("adams", "smooth", "none"):
            raise ValueError(f"FlankFriction.kind is {self.kind!r}; choose 'adams', 'smooth' or 'none'")
        if self.kind == "adams" and self.static < self.dynamic:
            warn(
                f"FlankFriction.static is {self.static:g}, below dynamic {self.dynamic:g}: friction would grow where "
                "flanks slide faster; are they exchanged? Give static as much as dynamic, or more",
            )

    @classmethod
    def none(cls) -> FlankFriction:
        """No friction."""
        return cls(kind="none")


TILTED_SLICES = 11
"""Slices along the face where the gap varies linearly along it: tilted axes or faces that are not opposite."""

HELICAL_SLICES = 20
"""Slices of helical wheels, at least."""

SLICES_PER_OVERLAP = 20
"""Slices of helical wheels over an axial pitch: neighbouring sections differ by a twentieth of a mesh cycle."""

FAULTY_SLICES = 41
"""Slices where a fault varies along the face, so that a pit or a chipped corner of a few millimetres has several."""

BOTTOMING_CLEARANCE = 0.1
"""Tip clearance, in modules, below which contact of tips with roots is looked for by default."""


def varying_along_face(geometry: PairGeometry, faults: Iterable[Fault]) -> list[str]:
    """Return in words what makes the flanks' gap vary along the face."""
    return [
        *([f"the misalignment of {shown(geometry.misalignment, 'deg', '.4g')}"] if geometry.misalignment else []),
        *(["the helix"] if geometry.driver.helix_angle else []),
        *(fault.label for fault in faults if fault.along_face),
    ]


@dataclass(frozen=True)
class ContactModel(Written):
    """Contact of two toothed wheels.

    Parameters
    ----------
    law : ContactLaw
        Normal force of one tooth pair over its whole face.
    friction : FlankFriction
    slices : int, optional
        Slices along the face; default by `face_slices`: 1, 11, 41 or more.
    load : {"slices", "adams"}
        How a tooth pair carries its load. ``slices``: pressure distributed over the face. ``adams``: one force at the
        centroid of the overlap with the depth found there, as ADAMS does for solids.
    root_contact : bool, optional
        Whether tips may also meet the mate's root; default when the tip clearance is below a tenth of the module.
    stiffness_curve : {"constant", "potential-energy"}
        How the stiffness of a tooth pair varies along the path of contact; ``law.stiffness`` is its largest value.
    owner : str
        What messages call the fields' owner.

    Raises
    ------
    ValueError
        For a setting that is none of these.
    """

    law: ContactLaw = field(default_factory=ContactLaw.impact)
    friction: FlankFriction = field(default_factory=FlankFriction)
    slices: int | None = None
    load: Literal["slices", "adams"] = "slices"
    root_contact: bool | None = None
    stiffness_curve: Literal["constant", "potential-energy"] = "constant"
    owner: InitVar[str] = "ContactModel"

    # mypy may lose InitVar among modules that import each other for types
    def __post_init__(self, owner: str) -> None:  # type: ignore[override]
        if not isinstance(self.law, ContactLaw):
            raise ValueError(f"{owner}.contact is {self.law!r}; give a ContactLaw, such as ContactLaw.impact()")
        if not isinstance(self.friction, FlankFriction):
            raise ValueError(
                f"{owner}.friction is {self.friction!r}; give a FlankFriction, such as FlankFriction(0.1, 0.05) or "
                "FlankFriction.none()"
            )
        if self.load not in ("slices", "adams"):
            raise ValueError(f"{owner}.load is {self.load!r}; choose 'slices' or 'adams'")
        if self.stiffness_curve not in ("constant", "potential-energy"):
            raise ValueError(
                f"{owner}.stiffness_curve is {self.stiffness_curve!r}; choose 'constant' or 'potential-energy'"
            )
        if self.root_contact is not None:
            truth(self.root_contact, f"{owner}.root_contact")
        counted = isinstance(self.slices, int) and not isinstance(self.slices, bool)
        if self.slices is not None and not (counted and self.slices >= 1):
            raise ValueError(f"{owner}.slices is {self.slices!r}; give an integer of 1 or more")

    def face_slices(self, geometry: PairGeometry, faults: Iterable[Fault] = ()) -> int:
        """Slices along the face in use: those asked for, or else as many as the gap's variation needs.

        One for spur wheels on parallel axes with opposite faces, where every section sees the same gap; `TILTED_SLICES`
        where misalignment or an axial shift make it vary along the face; at least `FAULTY_SLICES` where a fault does,
        and `STEPS_A_DETAIL` over the length in which it changes the flanks; at least `HELICAL_SLICES` and
        `SLICES_PER_OVERLAP` for each whole of the overlap ratio of helical wheels.
        """
        if self.slices is not None:
            return self.slices
        least = 1 if geometry.uniform_along_face else TILTED_SLICES
        if geometry.driver.helix_angle:
            least = max(HELICAL_SLICES, math.ceil(SLICES_PER_OVERLAP * geometry.overlap_ratio))
        for fault in faults:
            if fault.along_face:
                detail = fault.face_detail(geometry.wheels[fault.wheel == "driven"])[1]
                least = max(least, FAULTY_SLICES, math.ceil(STEPS_A_DETAIL * geometry.common_face_width / detail))
        return least

    def tips_may_bottom(self, geometry: PairGeometry) -> bool:
        """Whether contact of tips with roots is looked for."""
        if self.root_contact is not None:
            return self.root_contact
        spur = geometry.driver.helix_angle == 0
        return spur and geometry.tip_clearance < BOTTOMING_CLEARANCE * geometry.driver.module

    def face_share(self, geometry: PairGeometry) -> float:
        """Share of the law's stiffness and damping that the faces have as they stand, `PairGeometry.face_share`.

        The law is that of faces that stand opposite. With ``load="adams"`` one force carries, whatever the face width.
        """
        return 1.0 if self.load == "adams" else geometry.face_share

    def penetration(self, force: float, pairs: int = 1, share: float = 1.0) -> float:
        """Static penetration when ``pairs`` tooth pairs of parallel wheels share a normal force (N) equally, m.

        ``share`` is that of the face in mesh, `face_share`.
        """
        return (force / (pairs * share * self.law.stiffness)) ** (1 / self.law.exponent)

    def tangent_stiffness(self, force: float, pairs: int = 1, share: float = 1.0) -> float:
        """Tangent stiffness along the line of action of that many tooth pairs under a normal force (N), N/m.

        ``share`` is that of the face in mesh, `face_share`.
        """
        return self.law.exponent * force / self.penetration(force, pairs, share)

    def tangent_damping(self, force: float, share: float = 1.0) -> float:
        """Damping along the line of action of one tooth pair under a normal force (N), N s/m.

        ``share`` is that of the face in mesh, `face_share`. Without load it is that of half the depth of full damping.
        """
        from gearmbs.contact.laws import damping_of_share, normal_law

        law, kind = self.law, LAW_KINDS[self.law.kind]
        unloaded = 0.0 if kind.damps_by_factor else 0.5 * law.depth
        depth = self.penetration(force, share=share) if force > 0.0 else unloaded
        damping = damping_of_share(kind.code, law.damping, share)
        return normal_law(kind.code, share * law.stiffness, law.exponent, damping, law.depth, depth, 0.0)[2]


# How a pair of wheels is driven and loaded.


def sense_of_rotation(value: Any, field: str) -> int:
    """Return 1 or -1, as an integer; fractions and truth values are none, also where they are equal to one.

    Raises
    ------
    ValueError
        For anything else; the message names the field.
    """
    if isinstance(value, bool) or not isinstance(value, Integral) or value not in (1, -1):
        raise ValueError(f"{field} is {value!r}; give 1 or -1")
    return int(value)


@dataclass(frozen=True)
class OperatingPoint(Written):
    """Load and sense of rotation of a pair.

    Parameters
    ----------
    torque : float or str
        Load torque on the driven wheel, N m.
    rotation : {1, -1}
        Sense in which the driver turns about +z; it decides which flanks drive.
    owner : str
        What messages call the fields' owner.

    Raises
    ------
    ValueError
        For a torque that is not finite or negative, or another sense of rotation.

    Examples
    --------
    >>> OperatingPoint("60 N m", rotation=-1).torque
    60.0
    """

    torque: Quantity = 100.0
    rotation: Literal[1, -1] = 1
    owner: InitVar[str] = "OperatingPoint"

    # mypy may lose InitVar among modules that import each other for types
    def __post_init__(self, owner: str) -> None:  # type: ignore[override]
        object.__setattr__(self, "torque", to_si(self.torque, "torque", f"{owner}.torque"))
        if not math.isfinite(self.torque):
            raise ValueError(f"{owner}.torque is {self.torque}; give a finite number")
        if not self.torque >= 0.0:
            raise ValueError(
                f"{owner}.torque is {self.torque:g} N m; give its size (0 up): it acts against the motion, whose sense "
                "is that of rotation, 1 or -1"
            )
        object.__setattr__(self, "rotation", sense_of_rotation(self.rotation, f"{owner}.rotation"))

    def normal_force(self, geometry: PairGeometry) -> float:
        """Sum of normal forces that carries the load torque, N: F_n = T / (r_b2 cos beta_b)."""
        return self.torque / (geometry.driven.base_radius * math.cos(geometry.driven.base_helix_angle))


def require_points(points: Any) -> None:
    """Refuse what is no number of points over a mesh cycle."""
    if isinstance(points, bool) or not isinstance(points, Integral) or points < 1:
        raise ValueError(f"points is {points!r}; give a whole number from 1 up")


class Mesh(Protocol):
    """Wheels in mesh: where they are, how they touch, how they are driven and what is wrong with them.

    `gearmbs.gears.GearPair` is one. The analyses take anything that has these four.

    Attributes
    ----------
    geometry : PairGeometry
    contact_model : ContactModel
    operating_point : OperatingPoint
    faults : tuple of Fault
    """

    @property
    def geometry(self) -> PairGeometry:
        """Wheels and their places."""

    @property
    def contact_model(self) -> ContactModel:
        """Law, friction and discretisation."""

    @property
    def operating_point(self) -> OperatingPoint:
        """Load and sense of rotation."""

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Faults and deviations of teeth."""


SIZES = (
    ("module", "module"),
    ("pitch radius", "pitch_radius"),
    ("tip radius", "tip_radius"),
    ("base radius", "base_radius"),
    ("root radius", "root_radius"),
    ("root arc", "fillet_radius"),
    ("face width", "face_width"),
    ("bore radius", "bore_radius"),
)
"""Lengths of a wheel that its table shows."""


def pair_table(pair: Mesh) -> Table:
    """Table of a gear pair for a terminal or a notebook."""
    from rich.table import Table

    geometry, point = pair.geometry, pair.operating_point
    force, share = point.normal_force(geometry), pair.contact_model.face_share(geometry)
    one, two = geometry.driver, geometry.driven
    tilt = geometry.plane if geometry.misalignment else ""
    table = Table(title=f"Gear pair {one.teeth}/{two.teeth}")
    for column in ("", one.name, two.name):
        table.add_column(column, justify="left" if not column else "right")

    def both(label: str, form: str, attribute: str) -> None:
        table.add_row(label, *(format(getattr(w, attribute), form) for w in geometry.wheels))

    def measures(label: str, attribute: str, unit: str = "mm") -> None:
        table.add_row(label, *(shown(getattr(w, attribute), unit, ".4f") for w in geometry.wheels))

    both("teeth", "d", "teeth")
    for label, attribute in SIZES:
        if attribute != "bore_radius" or any(w.bore_radius for w in geometry.wheels):
            measures(label, attribute)
    if any(w.profile_shift for w in geometry.wheels):
        both("profile shift x (ISO 21771)", "+.4f", "profile_shift")
    if two.internal:
        both("profile shift outwards", "+.4f", "outward_shift")
        measures("outer radius", "outer_radius")
    if one.helix_angle:
        measures("helix angle", "helix_angle", "deg")
        table.add_row("hand", *(w.hand for w in geometry.wheels))
    measures("mass", "mass", "kg")
    table.add_section()
    for label, value in (
        ("centre distance", shown(geometry.centre_distance, "mm", ".4f")),
        ("working pressure angle", shown(geometry.working_pressure_angle, "deg", ".3f")),
        ("contact ratio", f"{geometry.contact_ratio:.4f}"),
        *_overlap(geometry),
        ("path of contact", shown(geometry.path_of_contact, "mm", ".3f")),
        ("normal backlash", shown(geometry.flank_backlash, "mm", ".4f")),
        *((f"{name.replace('_', ' ')}", shown(getattr(geometry, name), unit)) for name, unit in _given(geometry)),
        ("misalignment", f"{shown(geometry.misalignment, 'deg', '.3f')} {tilt}".strip()),
        ("load torque, driven wheel", shown(point.torque, "N m", ".1f")),
        ("normal force", shown(force, "N", ".1f")),
        ("contact law", str(pair.contact_model.law)),
        ("penetration, one pair", shown(pair.contact_model.penetration(force, share=share), "um", ".2f")),
    ):
        table.add_row(label, value, "")
    if geometry.jams:
        table.add_row(
            "jams",
            f"needs {shown(geometry.jam_backlash, 'mm', '.4f')} of normal backlash, has "
            f"{shown(geometry.normal_backlash, 'mm', '.4f')}",
            "",
        )
    return table


def _given(geometry: PairGeometry) -> list[tuple[str, str]]:
    """Settings of the placement that stand beside what follows from them, where they were given."""
    fields = ("centre_distance_error", "axial_shift", "backlash")
    return [(name, "mm") for name in fields if isinstance(getattr(geometry, name), Given)]


def _overlap(geometry: PairGeometry) -> list[tuple[str, str]]:
    """Rows of helical wheels."""
    if geometry.driver.helix_angle == 0:
        return []
    return [
        ("overlap ratio", f"{geometry.overlap_ratio:.4f}"),
        ("total contact ratio", f"{geometry.total_contact_ratio:.4f}"),
    ]


def pair_html(pair: Mesh) -> str:
    """Return the table as HTML for a notebook."""
    table = pair_table(pair)
    columns = [list(column.cells) for column in table.columns]
    head = "".join(f"<th>{html.escape(str(c.header))}</th>" for c in table.columns)
    rows = "".join(
        "<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row) + "</tr>" for row in zip(*columns)
    )
    title = html.escape(str(table.title))
    return f"<table><caption>{title}</caption><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def wheel_html(gear: GearSpec) -> str:
    """Return a wheel as a table for a notebook."""
    material = gear.material
    rows = [
        ("teeth", str(gear.teeth)),
        *((label, shown(getattr(gear, name), "mm", ".4f")) for label, name in SIZES),
        ("pressure angle", shown(gear.pressure_angle, "deg")),
        *([("helix angle", f"{shown(gear.helix_angle, 'deg')}, {gear.hand} hand")] if gear.helix_angle else []),
        ("profile shift", f"{gear.profile_shift:.6g}"),
        ("mass", shown(gear.mass, "kg", ".4f")),
        ("material", f"E = {shown(material.youngs_modulus, 'GPa')}, {shown(material.density, 'kg/m^3')}"),
    ]
    return html_table(f"Wheel {gear.name}", ("", ""), rows)
