"""The gear pair as users define it: wheels and their placement, contact, operating point and faults in one object."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import InitVar, dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypedDict, Unpack

import numpy as np

from gearmbs._display import Shown
from gearmbs.gears.geometry import PairGeometry, Placement
from gearmbs.gears.iso6336 import iso_mesh_stiffness, iso_single_stiffness
from gearmbs.gears.mesh import (
    DAMPING_RATIO,
    RATIO_DEPTH,
    ContactLaw,
    ContactModel,
    FlankFriction,
    OperatingPoint,
    pair_html,
    pair_table,
    varying_along_face,
)
from gearmbs.gears.modifications import Fault
from gearmbs.gears.spec import GearSpec
from gearmbs.gears.stiffness import compliance_roll_lengths, pair_stiffness
from gearmbs.gears.tables import fillet_clearance, pack
from gearmbs.units import Quantity, QuantityLike, shown, to_si
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.gears.contact_element import GearContact
    from gearmbs.mechanism.parts.bodies import Marker


_OF_GEOMETRY = {item.name for item in fields(PairGeometry)} | {
    name for name, item in vars(PairGeometry).items() if isinstance(item, cached_property) and name != "_name"
}
"""Fields of a pair and what follows from them that its geometry has, too."""


class PairKeywords(TypedDict, total=False):
    """Fields of a `GearPair`, as they are given, for type checkers."""

    driver: GearSpec
    driven: GearSpec
    centre_distance_error: QuantityLike
    misalignment: QuantityLike
    plane: Literal["skew", "inclination"]
    pivot: QuantityLike
    axial_shift: QuantityLike
    backlash: QuantityLike
    contact: ContactLaw
    friction: FlankFriction
    rotation: Literal[1, -1]
    torque: QuantityLike | None
    slices: int | None
    load: Literal["slices", "adams"]
    root_contact: bool | None
    stiffness_curve: Literal["constant", "potential-energy"]
    faults: Sequence[Fault]
    input_torque: QuantityLike | None


class PaperKeywords(PairKeywords, total=False):
    """What may be changed of the paper's pair: its fields, and the face width of both wheels."""

    face_width: QuantityLike


@contextmanager
def before_own_law() -> Iterator[None]:
    """Leave out how far the flanks of a pair yield by the law that it has before `GearPair.with_own_stiffness`."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*the flanks yield")
        yield


@dataclass(frozen=True)
class GearPair(PairGeometry, Shown):
    """A driver and a driven wheel, placed in space, with their contact, operating point and faults.

    The geometry is that of `PairGeometry`; everything else is composed: `contact_model`, `operating_point`, ``faults``.
    The driver is at the global origin with its axis along global z; the driven wheel at +x, the working centre
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
        Backlash made by thinning both wheels' teeth equally, m, at the nominal centre distance: play along the
        transverse line of action. Of spur wheels that is the normal backlash; between the flanks of helical ones it
        is ``backlash cos(beta_b)``, `PairGeometry.flank_backlash`, so divide a drawing's j_bn by cos(beta_b).
    contact : ContactLaw
    friction : FlankFriction
    rotation : {1, -1}
        Sense in which the driver turns about +z.
    torque : float or str, optional
        Load torque on the **driven** wheel, N m, of the static analyses and, if it is given none, of the test stand;
        default 100 N m.
    input_torque : float or str, optional
        Instead, the torque on the driver, N m: ``torque`` is then z_2 / z_1 of it, as without losses.
    slices : int, optional
        Slices along the face; default by `ContactModel.face_slices`: 1 for parallel axes without axial shift, 11 for
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

    contact: ContactLaw = field(default_factory=ContactLaw.impact)
    friction: FlankFriction = field(default_factory=FlankFriction)
    rotation: Literal[1, -1] = 1
    torque: Quantity = None
    slices: int | None = None
    load: Literal["slices", "adams"] = "slices"
    root_contact: bool | None = None
    stiffness_curve: Literal["constant", "potential-energy"] = "constant"
    faults: tuple[Fault, ...] = ()
    input_torque: InitVar[Quantity] = None

    _input_torque: ClassVar[Quantity] = None  # of an instance, where it was given

    # mypy may lose InitVar among modules that import each other for types
    def __post_init__(self, input_torque: Quantity) -> None:  # type: ignore[override]
        if input_torque is not None:
            if self.torque is not None:
                raise ValueError(
                    f"GearPair.torque is {self.torque!r}, on the driven wheel, and input_torque {input_torque!r}, on "
                    "the driver; give one of them"
                )
            torque = to_si(input_torque, "torque", "GearPair.input_torque")
            object.__setattr__(self, "torque", torque * self.driven.teeth / self.driver.teeth)
            object.__setattr__(self, "_input_torque", input_torque)
        elif self.torque is None:
            object.__setattr__(self, "torque", OperatingPoint.torque)
        object.__setattr__(self, "faults", tuple(self.faults))
        # both check what they are made of
        point, _ = self.operating_point, self.contact_model
        object.__setattr__(self, "torque", point.torque)
        for fault in self.faults:
            if not isinstance(fault, Fault):
                raise ValueError(f"GearPair.faults holds {fault!r}; give faults of gearmbs.gears.faults")
        super().__post_init__()
        for fault in self.faults:
            gear = self.wheels[fault.wheel == "driven"]
            fault.check_teeth(gear.teeth)
            fault.check_sizes(gear)
        if self.root_contact and self.driver.helix_angle:
            raise ValueError(
                "GearPair.root_contact is True: tips meet roots of spur wheels only; leave it away for helical ones"
            )
        if not self.root_contact:
            self._check_clearance(0.0)
        self._remark_on_tips()
        self._remark_on_slices()

    def _remark_on_slices(self) -> None:
        """Warn of what varies along the face where the flanks are looked at in one section only."""
        if self.slices != 1:
            return
        varying = varying_along_face(self, self.faults)
        if varying:
            warn(
                f"GearPair.slices is 1: the flanks are looked at in the middle of the face only, and how they vary "
                f"along it is not seen ({', '.join(varying)}); leave slices out for as many as that needs",
            )

    def _remark_on_tips(self) -> None:
        """Warn of tips that reach the mate where the contact does not look for them, once the flanks yield to the load.

        At an end of the path of contact one pair more than the whole contact ratio carries, and where tips of an
        internal pair pass each other as many as that.
        """
        names = f"the driver ({self.driver.name})", f"the driven wheel ({self.driven.name})"
        whole = math.floor(self.contact_ratio)
        if not self.tips_may_bottom:
            yielding = self.penetration(pairs=whole + 1)
            fouls = [
                f"the tips of {names[k]} foul the root arcs of {names[1 - k]} by {-clearance * 1e3:.3g} mm"
                for k in (0, 1)
                if (clearance := fillet_clearance(self, k, yielding)) < 0.0
            ]
            if fouls:
                counted = "" if self.driver.helix_angle else ", or give root_contact=True, which counts the force there"
                warn(
                    f"GearPair: under {shown(self.torque, 'N*m', '.4g')} the flanks yield {yielding * 1e3:.3g} mm, and "
                    f"{', '.join(fouls)}, unseen; reduce fillet_radius there or the addendum{counted}",
                )
        if self.sign < 0:
            needed, free = self.fouling_angles
            passing = (free - needed) * self.driven.base_radius
            yielding = self.penetration(pairs=max(whole, 1))
            if passing < yielding:
                warn(
                    f"GearPair: the tips of {names[0]} and {names[1]} pass each other {passing * 1e3:.3g} mm apart, "
                    f"and under {shown(self.torque, 'N*m', '.4g')} the flanks yield {yielding * 1e3:.3g} mm: they "
                    "touch there; use lower addenda or a greater difference of teeth",
                )

    @cached_property
    def geometry(self) -> PairGeometry:
        """The wheels and their places alone."""
        # as checked already, and remarked on, with what was found then
        geometry = object.__new__(PairGeometry)
        geometry.__dict__.update((name, value) for name, value in vars(self).items() if name in _OF_GEOMETRY)
        return geometry

    @cached_property
    def contact_model(self) -> ContactModel:
        """How the wheels touch."""
        return ContactModel(  # type: ignore[call-arg]
            self.contact, self.friction, self.slices, self.load, self.root_contact, self.stiffness_curve, "GearPair"
        )

    @cached_property
    def operating_point(self) -> OperatingPoint:
        """How they are driven and loaded."""
        return OperatingPoint(self.torque, self.rotation, "GearPair")  # type: ignore[call-arg]

    @classmethod
    def paper(cls, **changes: Unpack[PaperKeywords]) -> GearPair:
        """The paper's pair: z = 29/29, m = 95/31 mm, alpha = 20 deg, face width 20 mm, IMPACT and ADAMS friction.

        The printed module 3.065 mm is 95/31 = 3.064516 mm rounded: with r_a = 47.5 mm = (29/2 + 1) m exactly, the
        printed pitch, base and root radii all follow; from 3.065 they miss in the last digit. The paper gives no face
        width, friction, backlash or penetration depth; see the attributes for what is assumed.

        Parameters
        ----------
        **changes
            Any field of `GearPair`, and ``face_width``.
        """
        given: dict[str, Any] = {**changes}
        width = given.pop("face_width", "20 mm")
        module = 95e-3 / 31
        for name in ("driver", "driven"):
            given.setdefault(name, GearSpec(29, module, face_width=width, name=name))
        return cls(**given)

    def with_changes(self, **changes: Unpack[PairKeywords]) -> GearPair:
        """A copy with some fields changed, or with another ``input_torque``.

        A pair that was given its ``input_torque`` keeps that, whatever its wheels change to.
        """
        given: dict[str, Any] = {**changes}
        if given.get("torque") is None:
            given.setdefault("input_torque", self._input_torque)
        if given.get("input_torque") is not None:
            given.setdefault("torque", None)
        return replace(self, **given)

    def with_faults(self, *faults: Fault) -> GearPair:
        """A copy with these faults added to those it has."""
        return self.with_changes(faults=self.faults + faults)

    def with_potential_energy_stiffness(
        self, damping: Quantity = None, depth: Quantity = None, *, damping_ratio: float | None = None
    ) -> GearPair:
        """A copy with linear tooth pairs whose stiffness varies along the path by the potential-energy method.

        The contact flattens as under 300 N/mm, see `gearmbs.gears.stiffness.pair_stiffness`.

        Parameters
        ----------
        damping, depth, damping_ratio
            See `with_linear_stiffness`.
        """
        geometry = self.geometry
        largest = float(pair_stiffness(geometry, compliance_roll_lengths(geometry)).max()) / self._face_share
        made = self.with_linear_stiffness(largest, damping, depth, damping_ratio=damping_ratio)
        return made.with_changes(stiffness_curve="potential-energy")

    def with_iso_stiffness(
        self, kind: Literal["single", "mesh"] = "single", damping: Quantity = None, depth: Quantity = None, *,
        damping_ratio: float | None = None,
    ) -> GearPair:  # fmt: skip
        """A copy with linear tooth pairs of ISO 6336-1's stiffness, constant along the path.

        Parameters
        ----------
        kind : {"single", "mesh"}
            ``single``: each pair has c' times the common face width. ``mesh``: the mean over a mesh cycle, in the
            transverse plane along the line of action, is c_gamma times that width: each pair has
            c_gamma b / (epsilon_alpha cos beta_b), since the line of contact is longer by 1 / cos beta_b and the normal
            out of the plane, in gap and in force. ``contact.stiffness`` is that of faces that stand opposite, of which
            the contact counts the part in mesh.
        damping, depth, damping_ratio
            See `with_linear_stiffness`.

        Examples
        --------
        >>> pair = GearPair.paper().with_iso_stiffness()
        >>> round(pair.contact.stiffness / 1e6, 1)
        254.9
        """
        if kind not in ("single", "mesh"):
            raise ValueError(f"kind is {kind!r}; choose 'single' or 'mesh'")
        if kind == "single":
            stiffness = iso_single_stiffness(self.geometry)
        else:
            stiffness = iso_mesh_stiffness(self.geometry) / self._pairs_in_mesh
        width = self.common_face_width / self._face_share
        return self.with_linear_stiffness(stiffness * width, damping, depth, damping_ratio=damping_ratio)

    def with_linear_stiffness(
        self, stiffness: Quantity, damping: Quantity = None, depth: Quantity = None, *,
        damping_ratio: float | None = None,
    ) -> GearPair:  # fmt: skip
        """A copy with linear tooth pairs.

        Parameters
        ----------
        stiffness : float or str
            Of a tooth pair over its whole face, N/m.
        damping : float or str, optional
            Of a tooth pair over its whole face, N s/m; default none.
        depth : float or str, optional
            Penetration at which the damping is fully on; default 0.1 mm, and 2 um with a ratio.
        damping_ratio : float, optional
            Instead of ``damping``: zeta of the bare wheels on their mesh. With the mean stiffness
            k = epsilon_alpha cos(beta_b) K of the mesh and `reduced_mass`, its damping is 2 zeta sqrt(k m), a tooth
            pair's that over epsilon_alpha cos(beta_b). Of faces that stand opposite in part, K and the mesh's damping
            are those of this part.

        Raises
        ------
        ValueError
            If damping and ratio are both given, or the ratio is negative.
        """
        law = ContactLaw.linear(stiffness)
        if damping_ratio is None:
            damping, depth = 0.0 if damping is None else damping, "0.1 mm" if depth is None else depth
        else:
            if damping is not None:
                raise ValueError(f"damping is {damping!r} and damping_ratio {damping_ratio!r}; give one of them")
            real = isinstance(damping_ratio, (int, float)) and not isinstance(damping_ratio, bool)
            if not (real and 0.0 <= damping_ratio < math.inf):
                raise ValueError(f"damping_ratio is {damping_ratio!r}; give a number that is not negative")
            if damping_ratio > 1.0:
                raise ValueError(
                    f"damping_ratio is {damping_ratio!r}, more than critical; give up to 1, such as 0.07 for 7 %"
                )
            share = self._pairs_in_mesh * self._face_share
            damping = 2.0 * damping_ratio * math.sqrt(law.stiffness * self.reduced_mass / share)
            depth = RATIO_DEPTH if depth is None else depth
        return self.with_changes(contact=ContactLaw.linear(stiffness, damping, depth), stiffness_curve="constant")

    def with_own_stiffness(self, stiffness: Quantity = "iso", damping_ratio: float | None = None) -> GearPair:
        """A copy with the stiffness of its own wheels and a damping ratio: the default of drivetrains.

        Parameters
        ----------
        stiffness : {"iso", "iso single", "potential-energy"} or float or str
            ``iso``: the mean over a mesh cycle is ISO 6336-1's c_gamma. ``iso single``: each tooth pair has c'.
            ``potential-energy``: it varies along the path. Or a number: of a tooth pair, N/m.
        damping_ratio : float, optional
            See `with_linear_stiffness`; default `gearmbs.gears.mesh.DAMPING_RATIO`, 0.07.

        Raises
        ------
        ValueError
            For another word.

        Examples
        --------
        >>> pair = GearPair.paper().with_own_stiffness()
        >>> print(pair.contact)
        linear, 2.2994e+05 N/mm a tooth pair, damping 0.8689 N s/mm, fully on at 2 um
        """
        ratio = DAMPING_RATIO if damping_ratio is None else damping_ratio
        if stiffness in ("iso", "iso single"):
            return self.with_iso_stiffness("mesh" if stiffness == "iso" else "single", damping_ratio=ratio)
        if stiffness == "potential-energy":
            return self.with_potential_energy_stiffness(damping_ratio=ratio)
        is_number = not isinstance(stiffness, str) or stiffness.strip()[:1].isdigit()
        if not is_number:
            raise ValueError(
                f"stiffness is {stiffness!r}; choose 'iso', 'iso single' or 'potential-energy', give that of a tooth "
                "pair in N/m, or give contact"
            )
        return self.with_linear_stiffness(stiffness, damping_ratio=ratio)

    @property
    def _pairs_in_mesh(self) -> float:
        """Stiffness of the mesh in the transverse plane over that of a tooth pair: epsilon_alpha cos beta_b."""
        return max(1.0, self.contact_ratio) * math.cos(self.driver.base_helix_angle)

    @cached_property
    def _face_share(self) -> float:
        """Share of the law's stiffness that the faces have as they stand."""
        return self.contact_model.face_share(self)

    @property
    def mean_mesh_stiffness(self) -> float:
        """Mean over a mesh cycle of linear tooth pairs, along the normal, N/m: epsilon_alpha K / cos(beta_b).

        K is that of the part of the faces in mesh; the axes count as parallel.
        """
        along = math.cos(self.driver.base_helix_angle)
        return float(self.contact.stiffness) * self._face_share * self._pairs_in_mesh / along**2

    @property
    def reduced_mass(self) -> float:
        """Mass of the bare wheels along the line of action, 1 / (r_b1^2 / J_1 + r_b2^2 / J_2), kg."""
        return 1.0 / sum(wheel.base_radius**2 / wheel.inertia[2] for wheel in self.wheels)

    # --- contact and load ---------------------------------------------------------------------------

    @property
    def tips_may_bottom(self) -> bool:
        """Whether contact of tips with roots is looked for."""
        return self.contact_model.tips_may_bottom(self)

    @property
    def face_slices(self) -> int:
        """Slices along the face in use; see `ContactModel.face_slices`."""
        return self.contact_model.face_slices(self, self.faults)

    @property
    def normal_force(self) -> float:
        """Sum of normal forces that carries the load torque, N: F_n = T / (r_b2 cos beta_b)."""
        return self.operating_point.normal_force(self)

    @cached_property
    def _own_force(self) -> float:
        """Normal force at the operating point, N."""
        return self.operating_point.normal_force(self)

    def _force(self, torque: Quantity) -> float:
        if torque is None:
            return self._own_force
        return replace(self.operating_point, torque=torque, owner="GearPair").normal_force(self)

    def penetration(self, torque: Quantity = None, pairs: int = 1) -> float:
        """Static penetration when ``pairs`` tooth pairs share a torque on the driven wheel (N m) equally, m."""
        return self.contact_model.penetration(self._force(torque), pairs, self._face_share)

    def mesh_stiffness(self, torque: Quantity = None, pairs: int = 1) -> float:
        """Tangent stiffness of that many pairs along the line of action under a torque on the driven wheel, N/m."""
        return self.contact_model.tangent_stiffness(self._force(torque), pairs, self._face_share)

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
            Length of the work array ``gear_contact`` needs.
        """
        return pack(self, slices)

    def contact_element(self, name: str, i: Marker, j: Marker) -> GearContact:
        """Return the contact of this pair as a force element between the frames of the driver and the driven wheel.

        Raises
        ------
        ModelError
            If the wheels overlap. Wheels that cannot reach each other give a warning.
        """
        from gearmbs.gears.contact_element import GearContact

        element = GearContact(name, i, j, self)
        element.check()
        return element

    def placement(self, driver_angle: float = 0.0) -> Placement:
        """Frames at which the drive flanks just touch, for a given driver angle (rad).

        With misalignment beyond the backlash the coast flanks overlap there; see `jams`.
        """
        return self.frames(driver_angle, self.driven_angle(driver_angle))

    def driven_angle(self, driver_angle: float = 0.0) -> float:
        """Angle of the driven wheel at which the drive flanks just touch (kinematic contact, no load), rad."""
        if driver_angle not in self._driven_angles:
            # the contact kernels are compiled for this only
            from gearmbs.gears.transmission import touching_angle

            self._driven_angles[driver_angle] = touching_angle(self, driver_angle)
        return self._driven_angles[driver_angle]

    @cached_property
    def _driven_angles(self) -> dict[float, float]:
        """Angles of the driven wheel found so far, by that of the driver, rad."""
        return {}

    def _backlash_shown(self) -> str:
        """The backlash as it was given where nothing else has changed it."""
        same = abs(self.normal_backlash - self.backlash) < 1e-9
        return shown(self.backlash if same else self.normal_backlash, "mm", ".4g")

    def __repr__(self) -> str:
        one, two = self.driver, self.driven
        parts = [
            f"{one.teeth}/{two.teeth} teeth",
            f"module {shown(one.module, 'mm', '.4g')}",
            f"centre distance {1e3 * self.centre_distance:.4f} mm",
            f"backlash {self._backlash_shown()}",
            f"{shown(self.torque, 'N m', '.6g')} on the driven wheel",
        ]
        if self.misalignment:
            parts.append(f"{self.plane} {shown(self.misalignment, 'deg', '.4g')}")
        parts += [str(self.contact)]
        if self.stiffness_curve != "constant":
            parts.append(f"stiffness by {self.stiffness_curve} along the path")
        parts += [fault.label for fault in self.faults]
        return f"GearPair({', '.join(parts)})"

    def _repr_html_(self) -> str:
        return pair_html(self)

    def __rich__(self) -> object:
        return pair_table(self)
