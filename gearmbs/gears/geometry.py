"""Two wheels in space, as values: centre distance, backlash, misalignment and all that follows from them alone.

Sums over the two wheels are signed as in ISO 21771: the radii of an external wheel count positive, those of an internal
one negative, and with them centre distance and line of action of the pair. One set of formulas then holds for both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, overload

import numpy as np

from gearmbs._display import Written
from gearmbs.gears.spec import GearSpec, convert_fields, involute
from gearmbs.units import Quantity
from gearmbs.wording import warn

JAM_ROUNDING = 1e-12
"""Overlap of parallel wheels, m, that is taken for rounding: standard teeth at their nominal distance have none."""

BASE_CIRCLES_APART = 1.0005
"""Least centre distance over the sum of the base radii; below it the pressure angle vanishes."""

PRESSED_IN = 0.05
"""Overlap of a tip with the mate's root, in modules, that is a place wheels can be pressed into."""

LARGEST_MISALIGNMENT = math.radians(10)

SHORTEST_FACE = 1e-6
"""Common face width, m, from which on wheels are side by side: the contact blends the ends of faces over as much."""

MM = 1e3
"""Millimetres a metre, for messages, axes and files."""


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

    @property
    def frames(self) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """Origin and axes of the driver, and of the driven wheel."""
        return (self.origin_1, self.axes_1), (self.origin_2, self.axes_2)


def turn_z(angle: float) -> np.ndarray:
    """Return the rotation about z by an angle, shape (3, 3)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class PairGeometry(Written):
    """A driver and a driven wheel, placed in space.

    The driver is at the global origin with its axis along global z; the driven wheel is at +x, the working centre
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

    Raises
    ------
    ValueError
        For wheels that do not mesh; the message names the field, its value and a remedy.
    """

    driver: GearSpec
    driven: GearSpec
    centre_distance_error: Quantity = 0.0
    misalignment: Quantity = 0.0
    plane: Literal["skew", "inclination"] = "skew"
    pivot: Quantity = 0.0
    axial_shift: Quantity = 0.0
    backlash: Quantity = 0.0

    def __post_init__(self) -> None:
        lengths = ("centre_distance_error", "pivot", "axial_shift", "backlash")
        convert_fields(self, {name: "length" for name in lengths} | {"misalignment": "angle"}, self._name)
        for name in (*lengths, "misalignment"):
            value = getattr(self, name)
            if not math.isfinite(value):
                raise ValueError(f"{self._name}.{name} is {value}; give a finite number")
        self._check_settings()
        self._check_distance()
        self._check_engagement()
        self._remark()

    @cached_property
    def _name(self) -> str:
        return type(self).__name__

    # --- checks -------------------------------------------------------------------------------------

    def _check_settings(self) -> None:
        name = self._name
        if not self.backlash >= 0:
            raise ValueError(
                f"{name}.backlash is {self.backlash * MM:.6g} mm: negative backlash; give 0 or more, or reduce "
                "centre_distance_error to mesh tighter"
            )
        if self.plane not in ("skew", "inclination"):
            raise ValueError(f"{name}.plane is {self.plane!r}; choose 'skew' or 'inclination'")
        if not abs(self.misalignment) <= LARGEST_MISALIGNMENT:
            raise ValueError(
                f"{name}.misalignment is {math.degrees(self.misalignment):.3f} deg; wheels mesh up to 10 deg "
                "(a plain number is in radians: write '1 deg')"
            )
        one, two = self.driver, self.driven
        if one.internal:
            raise ValueError(
                f"{name}.driver is internal ({one.name}); make the internal wheel the driven one, whichever drives"
            )
        if not abs(one.helix_angle - two.helix_angle) <= 1e-12:
            raise ValueError(
                f"{name}: helix angles differ ({one.name} {math.degrees(one.helix_angle):.6g} deg, {two.name} "
                f"{math.degrees(two.helix_angle):.6g} deg); wheels on parallel axes need the same helix_angle"
            )
        wanted = "the same hand" if two.internal else "opposite hands"
        if one.helix_angle != 0 and (one.hand == two.hand) != two.internal:
            raise ValueError(
                f"{name}: {one.name} is {one.hand}-handed and {two.name} {two.hand}-handed; "
                f"{'an internal wheel and its mate' if two.internal else 'two external wheels'} need {wanted}"
            )
        if not abs(one.base_pitch - two.base_pitch) <= 1e-9 * one.base_pitch:
            raise ValueError(
                f"{name}: base pitches differ ({one.name} {one.base_pitch * MM:.6f} mm, {two.name} "
                f"{two.base_pitch * MM:.6f} mm); give both wheels the same module and pressure_angle"
            )

    def _check_distance(self) -> None:
        name, a = self._name, self.centre_distance
        if not a > abs(self.base_radius_sum) * BASE_CIRCLES_APART:
            raise ValueError(
                f"{name}.centre_distance_error is {self.centre_distance_error * MM:.4f} mm: the base circles meet; "
                "increase it"
            )
        if self.sign < 0:
            self._check_ring_size()
        self._check_clearance(PRESSED_IN * self.driver.module)
        reach = self.tip_radius_sum
        if not self.sign * a < reach:
            raise ValueError(
                f"{name}: the wheels do not reach each other: centre distance {a * MM:.4f} mm, tip radii sum up to "
                f"{reach * MM:.4f} mm; reduce centre_distance_error"
            )
        path, remedy = self.path_of_contact, "reduce" if self.sign > 0 else "increase"
        if not path > 0:
            raise ValueError(
                f"{name}: the wheels do not mesh: at the centre distance {a * MM:.4f} mm the tips leave "
                f"{path * MM:.4f} mm of a path of contact; {remedy} centre_distance_error or give longer teeth"
            )

    def _check_ring_size(self) -> None:
        one, two = self.driver, self.driven
        if not (one.teeth < two.teeth and one.outer_radius < two.root_radius):
            raise ValueError(
                f"{self._name}: the internal wheel {two.name} ({two.teeth} teeth, root circle "
                f"{two.root_radius * MM:.4f} mm) is no larger than {one.name} ({one.teeth} teeth, tip circle "
                f"{one.tip_radius * MM:.4f} mm); give it more teeth"
            )

    def _check_clearance(self, overlap: float) -> None:
        """Refuse tips that reach into the mate's root by more than ``overlap``, m."""
        for near, far, clearance in zip((self.driver, self.driven), (self.driven, self.driver), self.tip_clearances):
            if not clearance + overlap > 0:
                raise ValueError(
                    f"{self._name}: overlapping wheels: centre distance {self.centre_distance * MM:.4f} mm leaves no "
                    f"clearance between the tip of {near.name} ({near.tip_radius * MM:.4f} mm) and the root of "
                    f"{far.name} ({far.root_radius * MM:.4f} mm); increase centre_distance_error or dedendum"
                )

    def _check_engagement(self) -> None:
        name = self._name
        for thinned in self.wheels:
            if not thinned.tip_thickness > 0:
                raise ValueError(f"{name}.backlash is {self.backlash * MM:.4f} mm: teeth become pointed")
        most = 0.5 * (self.driver.face_width + self.driven.face_width)
        if not self.common_face_width > SHORTEST_FACE:
            raise ValueError(
                f"{name}.axial_shift is {self.axial_shift * MM:.4f} mm: the faces do not overlap, which are "
                f"{self.driver.face_width * MM:.4g} and {self.driven.face_width * MM:.4g} mm wide; give less than "
                f"{most * MM:.4g} mm to either side"
            )
        for near, far, start in zip((self.driver, self.driven), (self.driven, self.driver), self.first_roll_lengths):
            # the involute of an internal wheel ends outwards, at its root
            side, where, to = ("beyond", "end", "to") if near.internal else ("inside", "start", "from")
            within = near.sign * (start - near.form_roll_length) > -1e-12 and start > 0
            remedy = "reduce" if self.sign < 0 else "increase"
            if not within:
                raise ValueError(
                    f"{name}: the tip of {far.name} meets {near.name} {side} the {where} of its involute (length of "
                    f"roll {start * MM:.4f} mm, involute {to} {near.form_roll_length * MM:.4f} mm): interference; "
                    f"reduce the addendum of {far.name} or {remedy} centre_distance_error"
                )
        if self.sign < 0:
            needed, free = self.fouling_angles
            if not free >= needed:
                raise ValueError(
                    f"{name}: the tips of {self.driver.name} and {self.driven.name} foul where they leave each other "
                    f"(angle {free:.5f} rad, {needed:.5f} needed); use a greater difference of teeth or lower addenda"
                )

    def _remark(self) -> None:
        """Warn of what is no mistake by itself and rarely meant."""
        overlap = -self.normal_backlash
        if overlap > JAM_ROUNDING:
            farther = overlap / (2 * math.sin(self.working_pressure_angle))
            warn(
                f"{self._name}: negative backlash: at the centre distance {self.centre_distance * MM:.4f} mm the "
                f"normal backlash is {-overlap * MM:.4g} mm, so that the teeth press on both flanks without load; give "
                f"backlash {(self.backlash + overlap) * MM:.4g} mm or more, or "
                f"{'increase' if self.sign > 0 else 'reduce'} centre_distance_error by {farther * MM:.4g} mm",
            )

    # --- signed sums --------------------------------------------------------------------------------

    @cached_property
    def sign(self) -> int:
        """Sign of the pair's centre distance: 1 for two external wheels, -1 if one is internal."""
        return self.driver.sign * self.driven.sign

    def _sum(self, radius: str) -> float:
        one, two = self.driver, self.driven
        return one.sign * getattr(one, radius) + two.sign * getattr(two, radius)

    @cached_property
    def mesh_angle(self) -> float:
        """Direction from the driver to the mesh, rad: that of the driven wheel, opposite to that of an internal one."""
        return 0.0 if self.sign > 0 else math.pi

    @cached_property
    def base_radius_sum(self) -> float:
        """Signed sum of the base radii r_b1 + r_b2, m."""
        return self._sum("base_radius")

    @cached_property
    def tip_radius_sum(self) -> float:
        """Signed sum of the tip radii r_a1 + r_a2, m."""
        return self._sum("tip_radius")

    @cached_property
    def base_arc_sum(self) -> float:
        """Sum of half the teeth's thickness on the base circles, r_b1 psi_1 + r_b2 psi_2, m, thinned teeth."""
        one, two = self.wheels
        return one.base_radius * one.base_half_angle + two.base_radius * two.base_half_angle

    # --- transverse section -------------------------------------------------------------------------

    @cached_property
    def wheels(self) -> tuple[GearSpec, GearSpec]:
        """Driver and driven with their teeth thinned for the backlash."""
        if self.backlash == 0:
            return self.driver, self.driven
        cut = 0.5 * self.backlash / math.cos(self.driver.transverse_pressure_angle)
        return (
            replace(self.driver, thinning=self.driver.thinning + cut),
            replace(self.driven, thinning=self.driven.thinning + cut),
        )

    @cached_property
    def ratio(self) -> float:
        """Speed ratio, driven teeth over driver teeth; with an internal wheel both turn in the same sense."""
        return self.driven.teeth / self.driver.teeth

    @cached_property
    def nominal_centre_distance(self) -> float:
        """Centre distance without backlash for unthinned teeth, m."""
        shift = self.driver.profile_shift + self.driven.profile_shift
        if shift == 0:
            return abs(self._sum("pitch_radius"))
        alpha = self.driver.transverse_pressure_angle
        target = involute(alpha) + 2 * shift * math.tan(self.driver.pressure_angle) / self._sum("teeth")
        for _ in range(50):
            alpha -= (involute(alpha) - target) / math.tan(alpha) ** 2
        return abs(self.base_radius_sum) / math.cos(alpha)

    @cached_property
    def shift_sum(self) -> float:
        """Sum of the profile shifts x_1 + x_2 (ISO 21771) that the working centre distance needs without backlash."""
        return self.shift_sum_of(self.centre_distance)

    def shift_sum_of(self, centre_distance: float) -> float:
        """Sum of the profile shifts that a centre distance, m, needs without backlash."""
        alpha = self.driver.transverse_pressure_angle
        working = math.acos(self.base_radius_sum / (self.sign * centre_distance))
        return (involute(working) - involute(alpha)) * self._sum("teeth") / (2 * math.tan(self.driver.pressure_angle))

    @cached_property
    def centre_distance(self) -> float:
        """Working centre distance, m."""
        return self.nominal_centre_distance + self.centre_distance_error

    @cached_property
    def working_pressure_angle(self) -> float:
        """Working pressure angle alpha', rad: cos alpha' = (r_b1 + r_b2) / a'."""
        return math.acos(self.base_radius_sum / (self.sign * self.centre_distance))

    @cached_property
    def line_of_action(self) -> float:
        """Length of the line of action between the base circles, m, with the sign of the pair."""
        return self.sign * self.centre_distance * math.sin(self.working_pressure_angle)

    @cached_property
    def path_of_contact(self) -> float:
        """Length of the path of contact, m."""
        return self._sum("tip_roll_length") - self.line_of_action

    @cached_property
    def contact_ratio(self) -> float:
        """Transverse contact ratio eps_alpha: path of contact over base pitch."""
        return self.path_of_contact / self.driver.base_pitch

    @cached_property
    def overlap_ratio(self) -> float:
        """Overlap ratio eps_beta: common face width over axial pitch; 0 for spur wheels."""
        low, high = self.common_face
        return (high - low) * math.sin(self.driver.helix_angle) / (math.pi * self.driver.module)

    @cached_property
    def half_overlap(self) -> float:
        """How far the contact moves along the path from mid-face to an end of the common face, m."""
        low, high = self.common_face
        return 0.5 * (high - low) * math.tan(self.driver.base_helix_angle)

    @cached_property
    def total_contact_ratio(self) -> float:
        """Total contact ratio eps_gamma, transverse plus overlap."""
        return self.contact_ratio + self.overlap_ratio

    def contact_line_length(self, phase: float) -> float:
        """Sum of the lengths of the contact lines, m, parallel axes.

        Parameters
        ----------
        phase : float
            Turn of the wheels in pitches; 0 with the first line about to enter.
        """
        pitch, width = self.driver.base_pitch, self.common_face[1] - self.common_face[0]
        tangent, path = math.tan(self.driver.base_helix_angle), self.path_of_contact
        if tangent == 0:
            first, last = math.ceil(-phase), math.ceil(path / pitch - phase)
            return width * max(0, last - first)
        total = 0.0
        for k in range(-math.ceil(phase) - 1, math.ceil(self.total_contact_ratio - phase) + 1):
            front = (phase + k) * pitch
            total += max(0.0, min(front, path) - max(front - width * tangent, 0.0))
        return total / math.sin(self.driver.base_helix_angle)

    @cached_property
    def fouling_angles(self) -> tuple[float, float]:
        """Angles of an internal pair's tips where they leave each other, rad: needed, and free.

        Tips foul where the free one is smaller.
        """
        one, two, a = self.driver, self.driven, self.centre_distance
        working = involute(self.working_pressure_angle)
        at_tip_1 = involute(math.acos(one.base_radius / one.tip_radius))
        at_tip_2 = involute(math.acos(two.base_radius / two.tip_radius))
        r1, r2 = one.tip_radius, two.tip_radius
        cosine = (r2 * r2 - r1 * r1 - a * a) / (2 * a * r1)
        if cosine >= 1:
            return 0.0, math.inf
        turn_1 = math.acos(cosine) + at_tip_1 - working
        turn_2 = math.acos((a * a + r2 * r2 - r1 * r1) / (2 * a * r2))
        return turn_2, turn_1 * one.teeth / two.teeth + working - at_tip_2

    @cached_property
    def radial_assembly(self) -> bool:
        """Whether the wheels go together radially; an internal pair with too few teeth of difference only axially."""
        if self.sign > 0:
            return True
        one, two = self.driver, self.driven
        cos_1, cos_2 = one.base_radius / one.tip_radius, two.base_radius / two.tip_radius
        ratio, working = two.teeth / one.teeth, involute(self.working_pressure_angle)
        first = (1 - (cos_1 / cos_2) ** 2) / (1 - ratio**-2)
        second = ((cos_2 / cos_1) ** 2 - 1) / (ratio**2 - 1)
        if not (0 <= first <= 1 and 0 <= second <= 1):
            return first > 1
        turn_1 = math.asin(math.sqrt(first)) + involute(math.acos(cos_1)) - working
        turn_2 = math.asin(math.sqrt(second)) + involute(math.acos(cos_2)) - working
        return turn_1 >= ratio * turn_2

    @overload
    def mate_roll_length(self, wheel: int, roll_length: float) -> float: ...

    @overload
    def mate_roll_length(self, wheel: int, roll_length: np.ndarray) -> np.ndarray: ...

    def mate_roll_length(self, wheel: int, roll_length: float | np.ndarray) -> float | np.ndarray:
        """Length of roll on the mate where a wheel touches it, m.

        Parameters
        ----------
        wheel : {0, 1}
            0 for the driver, 1 for the driven wheel.
        roll_length : float or ndarray
            On that wheel, m.
        """
        own, mate = (self.driver, self.driven) if wheel == 0 else (self.driven, self.driver)
        return mate.sign * (self.line_of_action - own.sign * roll_length)

    @cached_property
    def first_roll_lengths(self) -> tuple[float, float]:
        """Lengths of roll on driver and driven where the mate's tip begins to bear, m."""
        return (
            self.mate_roll_length(1, self.driven.tip_roll_length),
            self.mate_roll_length(0, self.driver.tip_roll_length),
        )

    @cached_property
    def start_of_active_profile(self) -> tuple[float, float]:
        """Radii on driver and driven where the mate's tip begins to bear, m."""
        first = self.first_roll_lengths
        return math.hypot(self.driver.base_radius, first[0]), math.hypot(self.driven.base_radius, first[1])

    @cached_property
    def normal_backlash(self) -> float:
        """Play along the transverse line of action at the working centre distance, parallel axes, m.

        Of spur wheels it is j_bn of ISO 21771; between the flanks of helical ones there is `flank_backlash`.
        """
        return self.normal_backlash_of(self.centre_distance)

    @cached_property
    def flank_backlash(self) -> float:
        """Backlash j_bn between the flanks, along their common normal, m: that in the transverse plane cos(beta_b)."""
        return self.normal_backlash * math.cos(self.driver.base_helix_angle)

    def normal_backlash_of(self, centre_distance: float) -> float:
        """Backlash along the line of action at another centre distance, m."""
        alpha = math.acos(self.base_radius_sum / (self.sign * centre_distance))
        return 2 * (self.base_radius_sum * involute(alpha) - self.base_arc_sum) + self.driver.base_pitch

    @cached_property
    def circumferential_backlash(self) -> float:
        """Backlash j_wt on the working pitch circles, m."""
        return self.normal_backlash / math.cos(self.working_pressure_angle)

    @cached_property
    def tip_clearances(self) -> tuple[float, float]:
        """Clearances between the driver's tip and the driven wheel's root, and the reverse, m."""
        one, two = self.driver, self.driven
        a = self.sign * self.centre_distance
        return (
            a - (one.sign * one.tip_radius + two.sign * two.root_radius),
            a - (two.sign * two.tip_radius + one.sign * one.root_radius),
        )

    @cached_property
    def tip_clearance(self) -> float:
        """Smaller of the two clearances between a tip and the mate's root, m."""
        return min(self.tip_clearances)

    # --- along the face -----------------------------------------------------------------------------

    @cached_property
    def jam_backlash(self) -> float:
        """Normal backlash the misalignment needs, m: b gamma cos(alpha) (skew) or b gamma sin(alpha) (inclination).

        This is the limit for small angles. At 1 deg the exact teeth of the paper's wheels need 0.7 um (skew) and 5 um
        (inclination) less.
        """
        alpha = self.working_pressure_angle
        part = math.cos(alpha) if self.plane == "skew" else math.sin(alpha)
        return self.common_face_width * abs(self.misalignment) * part

    @cached_property
    def jams(self) -> bool:
        """Whether both flanks touch at once for want of backlash, by the centre distance or under the misalignment.

        Under a misalignment by the first-order limit `jam_backlash`, which is a little on the safe side.
        """
        if self.misalignment == 0:
            return self.normal_backlash < -JAM_ROUNDING
        return self.normal_backlash < self.jam_backlash

    @cached_property
    def narrower_face_width(self) -> float:
        """Face width of the narrower wheel, m, which is that of faces that stand opposite; contact laws refer to it."""
        return min(self.driver.face_width, self.driven.face_width)

    @cached_property
    def common_face_width(self) -> float:
        """Length along the axis over which both faces stand opposite, m; see `common_face`.

        That of the narrower wheel, until an axial shift is more than the wider one's excess on a side.
        """
        low, high = self.common_face
        return high - low

    @cached_property
    def face_share(self) -> float:
        """Share of the narrower face that stands opposite the mate's: 1 without axial shift."""
        return self.common_face_width / self.narrower_face_width

    @cached_property
    def common_face(self) -> tuple[float, float]:
        """Range along the mean axis, from mid-way between the wheels, that both faces cover, m.

        The overlap of both faces' intervals on the axis as they are drawn: ``axial_shift`` counts along it, and the
        misalignment is left out. An angle gamma between the axes shortens the driven face by 1 - cos(gamma), 1.5 % at
        the most, moves it by the pivot times that, and in the plane of the axes moves its ends at the mesh by
        r_2 sin(gamma); the contact itself knows where they are.
        """
        half = 0.5 * self.axial_shift
        low = max(-half - 0.5 * self.driver.face_width, half - 0.5 * self.driven.face_width)
        high = min(-half + 0.5 * self.driver.face_width, half + 0.5 * self.driven.face_width)
        return low, high

    @cached_property
    def uniform_along_face(self) -> bool:
        """Whether the gap between perfect flanks is the same in all sections: parallel axes, faces opposite."""
        return self.misalignment == 0 and self.axial_shift == 0

    @cached_property
    def tilt(self) -> np.ndarray:
        """Rotation of the driven wheel's axis, shape (3, 3)."""
        c, s = math.cos(self.misalignment), math.sin(self.misalignment)
        if self.plane == "skew":
            return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
        return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])

    def frames(self, driver_angle: float, driven_angle: float) -> Placement:
        """Frames with the wheels turned by these angles about their own axes from tooth 0 on global x (rad)."""
        origin = np.array([self.centre_distance, 0.0, self.axial_shift])
        arm = np.array([0.0, 0.0, self.pivot])
        return Placement(
            np.zeros(3),
            turn_z(driver_angle),
            origin + arm - self.tilt @ arm,
            self.tilt @ turn_z(driven_angle),
        )
