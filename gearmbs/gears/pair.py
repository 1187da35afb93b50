"""Two wheels in space: centre distance, backlash, misalignment, phase, and what a gear engineer reads from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gearmbs.gears.faults import Fault
from gearmbs.gears.laws import ContactLaw, FlankFriction
from gearmbs.gears.spec import GearSpec, convert_fields, involute, require
from gearmbs.gears.stiffness import iso_mesh_stiffness, iso_single_stiffness, pair_stiffness
from gearmbs.gears.tables import compliance_roll_lengths, pack
from gearmbs.units import Quantity

if TYPE_CHECKING:
    from gearmbs.gears.contact_element import GearContact
    from gearmbs.mechanism.parts import Marker

TILTED_SLICES = 11
FAULTY_SLICES = 41
JAM_ROUNDING = 1e-12
"""Overlap of parallel wheels, m, that is taken for rounding: standard teeth at their nominal distance have none."""


@dataclass(frozen=True)
class Placement:
    """Frames of both wheels: origins at mid-face, z the wheel's axis, x through the middle of tooth 0.

    Attributes
    ----------
    origin_1, origin_2 : ndarray, shape (3,)
    axes_1, axes_2 : ndarray, shape (3, 3)
        Columns are the wheel's axes in global components.
    """

    origin_1: np.ndarray
    axes_1: np.ndarray
    origin_2: np.ndarray
    axes_2: np.ndarray


def _turn_z(angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class GearPair:
    """A driver and a driven wheel, placed in space.

    The driver stands at the global origin with its axis along global z; the driven wheel at +x, the working centre
    distance away, tilted by the misalignment about its pivot.

    Parameters
    ----------
    driver, driven : GearSpec
    centre_distance_error : float or str
        Added to the nominal centre distance, m.
    misalignment : float or str
        Angle between the axes, rad or text such as ``"1 deg"``.
    plane : {"skew", "inclination"}
        Skew: axes in parallel planes (turned about the line of centres). Inclination: axes in one plane.
    pivot : float or str
        Where on the driven wheel's axis the misalignment turns it, from its mid-face, m.
    axial_shift : float or str
        Shift of the driven wheel along global z, m.
    backlash : float or str
        Normal backlash made by thinning both wheels' teeth equally, m; at the nominal centre distance.
    contact : ContactLaw
    friction : FlankFriction
    rotation : {1, -1}
        Sense in which the driver turns about +z.
    torque : float or str
        Load torque on the driven wheel, N m, used by the static analyses.
    slices : int, optional
        Slices along the face; default 1 for parallel axes without axial shift, 11 for
        others, 41 when faults vary along the face.
    load : {"slices", "adams"}
        How a tooth pair carries its load. ``slices``: pressure distributed over the face. ``adams``: one force at the
        centroid of the overlap with the depth found there, as ADAMS does for solids.
    root_contact : bool, optional
        Whether tips may also meet the mate's root; default when the tip clearance is below a tenth of the module.
    stiffness_curve : {"constant", "potential-energy"}
        How the stiffness of a tooth pair varies along the path of contact; ``contact.stiffness`` is its largest value.
    faults : sequence of Fault
        Faults and deviations of teeth, see `gearmbs.gears.faults`; they combine.

    Raises
    ------
    ValueError
        For wheels that do not mesh; the message names the field, its value and a remedy.

    Examples
    --------
    >>> pair = GearPair.paper(centre_distance_error="3 mm")
    >>> round(pair.contact_ratio, 4)
    0.7733
    """

    driver: GearSpec
    driven: GearSpec
    centre_distance_error: Quantity = 0.0
    misalignment: Quantity = 0.0
    plane: Literal["skew", "inclination"] = "skew"
    pivot: Quantity = 0.0
    axial_shift: Quantity = 0.0
    backlash: Quantity = 0.0
    contact: ContactLaw = field(default_factory=ContactLaw.impact)
    friction: FlankFriction = field(default_factory=FlankFriction)
    rotation: Literal[1, -1] = 1
    torque: Quantity = 100.0
    slices: int | None = None
    load: Literal["slices", "adams"] = "slices"
    root_contact: bool | None = None
    stiffness_curve: Literal["constant", "potential-energy"] = "constant"
    faults: tuple[Fault, ...] = ()

    def __post_init__(self) -> None:
        lengths = ("centre_distance_error", "pivot", "axial_shift", "backlash")
        units = {name: "length" for name in lengths} | {"misalignment": "angle", "torque": "torque"}
        convert_fields(self, units, "GearPair")
        object.__setattr__(self, "faults", tuple(self.faults))
        self._check()

    @classmethod
    def paper(cls, **changes: Any) -> GearPair:
        """The paper's pair: z = 29/29, m = 95/31 mm, alpha = 20 deg, face width 20 mm, IMPACT and ADAMS friction.

        The printed module 3.065 mm is 95/31 = 3.064516 mm rounded: with r_a = 47.5 mm = (29/2 + 1) m exactly, the
        printed pitch, base and root radii all follow; from 3.065 they miss in the last digit. The paper gives no face
        width, friction, backlash or penetration depth; see the attributes for what is assumed.

        Parameters
        ----------
        **changes
            Any field of `GearPair`, and ``face_width``.
        """
        width = changes.pop("face_width", "20 mm")
        module = 95e-3 / 31
        for name in ("driver", "driven"):
            changes.setdefault(name, GearSpec(29, module, face_width=width, name=name))
        return cls(**changes)

    def with_changes(self, **changes: Any) -> GearPair:
        """A copy with some fields changed."""
        return replace(self, **changes)

    def with_faults(self, *faults: Fault) -> GearPair:
        """A copy with these faults added to those it has."""
        return replace(self, faults=self.faults + faults)

    def with_potential_energy_stiffness(self, damping: Quantity = 0.0, depth: Quantity = "0.1 mm") -> GearPair:
        """A copy with linear tooth pairs whose stiffness varies along the path by the potential-energy method.

        Parameters
        ----------
        damping, depth : float or str
            See `ContactLaw.linear`.
        """
        largest = float(pair_stiffness(self, compliance_roll_lengths(self)).max())
        law = ContactLaw.linear(largest, damping, depth)
        return replace(self, contact=law, stiffness_curve="potential-energy")

    def with_iso_stiffness(
        self, kind: Literal["single", "mesh"] = "single", damping: Quantity = 0.0, depth: Quantity = "0.1 mm"
    ) -> GearPair:
        """A copy with linear tooth pairs of ISO 6336-1's stiffness, constant along the path.

        Parameters
        ----------
        kind : {"single", "mesh"}
            ``single``: each pair has c' times the common face width. ``mesh``: each has c_gamma times that width over
            the contact ratio, so that the mean over a mesh cycle is c_gamma.
        damping, depth : float or str
            See `ContactLaw.linear`.

        Examples
        --------
        >>> pair = GearPair.paper().with_iso_stiffness()
        >>> round(pair.contact.stiffness / 1e6, 1)
        254.9
        """
        choices = {"single": iso_single_stiffness(self), "mesh": iso_mesh_stiffness(self) / self.contact_ratio}
        require(kind in choices, f"kind is {kind!r}; choose 'single' or 'mesh'")
        law = ContactLaw.linear(choices[kind] * self.common_face_width, damping, depth)
        return replace(self, contact=law, stiffness_curve="constant")

    def _check(self) -> None:
        mm = 1e3
        for name in ("centre_distance_error", "misalignment", "pivot", "axial_shift", "backlash", "torque"):
            value = getattr(self, name)
            require(math.isfinite(value), f"GearPair.{name} is {value}; give a finite number")
        require(
            self.backlash >= 0,
            f"GearPair.backlash is {self.backlash * mm:.6g} mm: negative backlash; give 0 or more, or reduce "
            "centre_distance_error to mesh tighter",
        )
        require(
            self.plane in ("skew", "inclination"), f"GearPair.plane is {self.plane!r}; choose 'skew' or 'inclination'"
        )
        require(self.load in ("slices", "adams"), f"GearPair.load is {self.load!r}; choose 'slices' or 'adams'")
        require(self.rotation in (1, -1), f"GearPair.rotation is {self.rotation!r}; give 1 or -1")
        require(
            self.stiffness_curve in ("constant", "potential-energy"),
            f"GearPair.stiffness_curve is {self.stiffness_curve!r}; choose 'constant' or 'potential-energy'",
        )
        for fault in self.faults:
            require(isinstance(fault, Fault), f"GearPair.faults holds {fault!r}; give faults of gearmbs.gears.faults")
        require(
            abs(self.misalignment) <= math.radians(10),
            f"GearPair.misalignment is {math.degrees(self.misalignment):.3f} deg; spur wheels mesh up to 10 deg "
            "(a plain number is in radians: write '1 deg')",
        )
        require(
            self.slices is None or (isinstance(self.slices, int) and self.slices >= 1),
            f"GearPair.slices is {self.slices!r}; give an integer of 1 or more",
        )
        one, two = self.driver, self.driven
        require(
            abs(one.base_pitch - two.base_pitch) <= 1e-9 * one.base_pitch,
            f"GearPair: base pitches differ ({one.name} {one.base_pitch * mm:.6f} mm, {two.name} "
            f"{two.base_pitch * mm:.6f} mm); give both wheels the same module and pressure_angle",
        )
        a = self.centre_distance
        require(
            a > (one.base_radius + two.base_radius) * 1.0005,
            f"GearPair.centre_distance_error is {self.centre_distance_error * mm:.4f} mm: the base circles meet; "
            "increase it",
        )
        # tips may be placed pressing into roots only when their contact is asked for
        play = 0.05 * one.module if self.root_contact else 0.0
        for near, far in ((one, two), (two, one)):
            require(
                a + play > near.tip_radius + far.root_radius,
                f"GearPair: overlapping wheels: centre distance {a * mm:.4f} mm leaves no clearance between the tip of "
                f"{near.name} ({near.tip_radius * mm:.4f} mm) and the root of {far.name} "
                f"({far.root_radius * mm:.4f} mm); increase centre_distance_error or dedendum",
            )
        require(
            a < one.tip_radius + two.tip_radius,
            f"GearPair: the wheels do not reach each other: centre distance {a * mm:.4f} mm, tip radii sum up to "
            f"{(one.tip_radius + two.tip_radius) * mm:.4f} mm; reduce centre_distance_error",
        )
        for thinned in self.wheels:
            require(
                thinned.tip_thickness > 0, f"GearPair.backlash is {self.backlash * mm:.4f} mm: teeth become pointed"
            )
        low, high = self.common_face
        require(
            high > low, f"GearPair.axial_shift is {self.axial_shift * mm:.4f} mm: the faces do not overlap; reduce it"
        )
        length = self.line_of_action
        for far, near in ((one, two), (two, one)):
            start = length - far.tip_roll_length
            require(
                start > near.form_roll_length - 1e-12 and start > 0,
                f"GearPair: the tip of {far.name} meets {near.name} inside the start of its involute (length of roll "
                f"{start * mm:.4f} mm, involute from {near.form_roll_length * mm:.4f} mm): interference; reduce the "
                f"addendum of {far.name} or increase centre_distance_error",
            )

    @cached_property
    def wheels(self) -> tuple[GearSpec, GearSpec]:
        """Driver and driven with their teeth thinned for the backlash."""
        if self.backlash == 0:
            return self.driver, self.driven
        cut = 0.5 * self.backlash / math.cos(self.driver.pressure_angle)
        return (
            replace(self.driver, thinning=self.driver.thinning + cut),
            replace(self.driven, thinning=self.driven.thinning + cut),
        )

    @property
    def ratio(self) -> float:
        """Speed ratio, driven teeth over driver teeth."""
        return self.driven.teeth / self.driver.teeth

    @property
    def nominal_centre_distance(self) -> float:
        """Centre distance without backlash for unthinned teeth, m."""
        one, two = self.driver, self.driven
        shift = one.profile_shift + two.profile_shift
        if shift == 0:
            return one.pitch_radius + two.pitch_radius
        target = involute(one.pressure_angle) + 2 * shift * math.tan(one.pressure_angle) / (one.teeth + two.teeth)
        alpha = one.pressure_angle
        for _ in range(50):
            alpha -= (involute(alpha) - target) / math.tan(alpha) ** 2
        return (one.base_radius + two.base_radius) / math.cos(alpha)

    @property
    def centre_distance(self) -> float:
        """Working centre distance, m."""
        return self.nominal_centre_distance + self.centre_distance_error

    @property
    def working_pressure_angle(self) -> float:
        """Working pressure angle alpha', rad: cos alpha' = (r_b1 + r_b2) / a'."""
        return math.acos((self.driver.base_radius + self.driven.base_radius) / self.centre_distance)

    @property
    def line_of_action(self) -> float:
        """Length of the line of action between the base circles, m."""
        return self.centre_distance * math.sin(self.working_pressure_angle)

    @property
    def path_of_contact(self) -> float:
        """Length of the path of contact, m."""
        return self.driver.tip_roll_length + self.driven.tip_roll_length - self.line_of_action

    @property
    def contact_ratio(self) -> float:
        """Path of contact over base pitch."""
        return self.path_of_contact / self.driver.base_pitch

    @property
    def start_of_active_profile(self) -> tuple[float, float]:
        """Radii on driver and driven where the mate's tip begins to bear, m."""
        one, two = self.driver, self.driven
        return (
            math.hypot(one.base_radius, self.line_of_action - two.tip_roll_length),
            math.hypot(two.base_radius, self.line_of_action - one.tip_roll_length),
        )

    @property
    def normal_backlash(self) -> float:
        """Backlash j_bn along the line of action at the working centre distance, parallel axes, m."""
        one, two = self.wheels
        rb = one.base_radius + two.base_radius
        angles = one.base_half_angle * one.base_radius + two.base_half_angle * two.base_radius
        return 2 * (rb * involute(self.working_pressure_angle) - angles) + one.base_pitch

    @property
    def circumferential_backlash(self) -> float:
        """Backlash j_wt on the working pitch circles, m."""
        return self.normal_backlash / math.cos(self.working_pressure_angle)

    @property
    def jam_backlash(self) -> float:
        """Normal backlash the misalignment needs, m: b gamma cos(alpha) (skew) or b gamma sin(alpha) (inclination).

        This is the limit for small angles. At 1 deg the exact teeth of the paper's wheels need 0.7 um (skew) and 5 um
        (inclination) less.
        """
        alpha = self.working_pressure_angle
        part = math.cos(alpha) if self.plane == "skew" else math.sin(alpha)
        return self.common_face_width * abs(self.misalignment) * part

    @property
    def jams(self) -> bool:
        """Whether both flanks touch at once for want of backlash, by the centre distance or under the misalignment.

        Under a misalignment by the first-order limit `jam_backlash`, which is a little on the safe side.
        """
        if self.misalignment == 0:
            return self.normal_backlash < -JAM_ROUNDING
        return self.normal_backlash < self.jam_backlash

    @property
    def tip_clearance(self) -> float:
        """Smaller of the two clearances between a tip and the mate's root, m."""
        one, two = self.driver, self.driven
        return self.centre_distance - max(one.tip_radius + two.root_radius, two.tip_radius + one.root_radius)

    @property
    def tips_may_bottom(self) -> bool:
        """Whether contact of tips with roots is looked for."""
        return self.tip_clearance < 0.1 * self.driver.module if self.root_contact is None else self.root_contact

    @property
    def mesh_frequency_per_speed(self) -> float:
        """Mesh frequency over driver speed, Hz per rad/s."""
        return self.driver.teeth / (2 * math.pi)

    @property
    def normal_force(self) -> float:
        """Sum of normal forces that carries the load torque, N: F_n = T / r_b2."""
        return self.torque / self.driven.base_radius

    @property
    def common_face_width(self) -> float:
        """Face width both wheels share when aligned, m."""
        return min(self.driver.face_width, self.driven.face_width)

    @property
    def common_face(self) -> tuple[float, float]:
        """Range along the mean axis, from mid-way between the wheels, that both faces cover, m."""
        half = 0.5 * self.axial_shift
        low = max(-half - 0.5 * self.driver.face_width, half - 0.5 * self.driven.face_width)
        high = min(-half + 0.5 * self.driver.face_width, half + 0.5 * self.driven.face_width)
        return low, high

    @property
    def face_slices(self) -> int:
        """Slices along the face in use."""
        if self.slices is not None:
            return self.slices
        if any(fault.along_face for fault in self.faults):
            return FAULTY_SLICES
        plain = self.misalignment == 0 and self.axial_shift == 0
        return 1 if plain else TILTED_SLICES

    def penetration(self, torque: float | None = None, pairs: int = 1) -> float:
        """Static penetration when ``pairs`` tooth pairs of parallel wheels share the load equally, m."""
        force = self.normal_force if torque is None else torque / self.driven.base_radius
        return (force / (pairs * self.contact.stiffness)) ** (1 / self.contact.exponent)

    def mesh_stiffness(self, torque: float | None = None, pairs: int = 1) -> float:
        """Tangent stiffness along the line of action of that many pairs of parallel wheels, N/m."""
        force = self.normal_force if torque is None else torque / self.driven.base_radius
        return self.contact.exponent * force / self.penetration(torque, pairs)

    @cached_property
    def tilt(self) -> np.ndarray:
        """Rotation of the driven wheel's axis, shape (3, 3)."""
        c, s = math.cos(self.misalignment), math.sin(self.misalignment)
        if self.plane == "skew":
            return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
        return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])

    def contact_tables(self, slices: int | None = None) -> tuple[np.ndarray, np.ndarray, int]:
        """Tables of the contact kernel.

        Parameters
        ----------
        slices : int, optional
            Slices along the face, default `face_slices`.

        Returns
        -------
        gi : ndarray of int64
        gr : ndarray of float64
        work_size : int
            Length of the scratch array ``gear_contact`` needs.
        """
        return pack(self, self.face_slices if slices is None else slices)

    def contact_element(self, name: str, i: Marker, j: Marker) -> GearContact:
        """Return the contact of this pair as a force element between the frames of the driver and the driven wheel.

        Raises
        ------
        ModelError
            If the wheels stand in each other. Wheels out of reach give a warning.
        """
        from gearmbs.gears.contact_element import GearContact

        element = GearContact(name, i, j, self)
        element.check()
        return element

    def frames(self, driver_angle: float, driven_angle: float) -> Placement:
        """Frames with the wheels turned by these angles about their own axes from tooth 0 on global x (rad)."""
        origin = np.array([self.centre_distance, 0.0, self.axial_shift])
        arm = np.array([0.0, 0.0, self.pivot])
        return Placement(
            np.zeros(3),
            _turn_z(driver_angle),
            origin + arm - self.tilt @ arm,
            self.tilt @ _turn_z(driven_angle),
        )

    def placement(self, driver_angle: float = 0.0) -> Placement:
        """Frames at which the drive flanks just touch, for a given driver angle (rad).

        With misalignment beyond the backlash the coast flanks overlap there; see `jams`.
        """
        return self.frames(driver_angle, self.driven_angle(driver_angle))

    def driven_angle(self, driver_angle: float = 0.0) -> float:
        """Angle of the driven wheel at which the drive flanks just touch (kinematic contact, no load), rad."""
        from gearmbs.gears.transmission import touching_angle

        return touching_angle(self, driver_angle)

    def __repr__(self) -> str:
        one, two = self.driver, self.driven
        parts = [
            f"{one.teeth}/{two.teeth} teeth",
            f"module {1e3 * one.module:.4g} mm",
            f"centre distance {1e3 * self.centre_distance:.4f} mm",
            f"backlash {1e3 * self.normal_backlash:.4g} mm",
        ]
        if self.misalignment:
            parts.append(f"{self.plane} {math.degrees(self.misalignment):.4g} deg")
        parts += [fault.label for fault in self.faults]
        return f"GearPair({', '.join(parts)})"

    def _repr_html_(self) -> str:
        from gearmbs.gears.show import pair_html

        return pair_html(self)

    def __rich__(self) -> object:
        from gearmbs.gears.show import pair_table

        return pair_table(self)
