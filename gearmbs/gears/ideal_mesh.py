"""A pair of wheels whose mesh is one spring along the line of action: for modes, fast models and comparison."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, TypedDict, Unpack

import numpy as np

from gearmbs._display import Written
from gearmbs.dae.equations.loads.forces import DISSIPATED, STORED, Diagnostic
from gearmbs.gears.geometry import PairGeometry, Placement
from gearmbs.gears.mesh import DAMPING_RATIO, ContactLaw, ContactModel, FlankFriction, OperatingPoint
from gearmbs.gears.modifications import Fault
from gearmbs.gears.pair import GearPair
from gearmbs.gears.spec import convert_fields
from gearmbs.gears.tables import pack
from gearmbs.mechanism.parts.elements import NOT_NEGATIVE, POSITIVE, Compiled, ForceElement, Setting
from gearmbs.units import Quantity, QuantityLike, shown, to_si
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.mechanism.parts.bodies import Marker

SOFTEST = 0.1
"""Deflection under the pair's torque, by the module, that no teeth have: steel yields at some thousandths of it."""
POINTS = 64
"""Least number of points of the tables over a mesh cycle."""


class PartingKeywords(TypedDict, total=False):
    """Fields of an `IdealMesh` about its backlash, as they are given, for type checkers."""

    backlash: bool
    depth: QuantityLike


class DampedKeywords(PartingKeywords, total=False):
    """Further fields of an `IdealMesh` whose curves are known."""

    damping: QuantityLike


class CurveKeywords(PartingKeywords, total=False):
    """Further fields of an `IdealMesh` whose damping is known."""

    stiffness_curve: Sequence[float] | None
    error: Sequence[float] | None


@dataclass(frozen=True)
class IdealMesh(Written):
    """A gear pair that meshes through one spring and damper along its line of action.

    It takes the place of a `GearPair` in ``Mechanism.gear_contact`` and in planetary sets.
    One line of action has no stiffness against the tilting of wheels, which faces of some width have: two modes of
    shafts that tilt in their bearings are 4 and 5 % lower than with teeth in contact, in a gearbox of 5 MW.

    Parameters
    ----------
    pair : GearPair
        Its wheels and places; contact law, friction, faults and slices are not used.
    stiffness : float or str
        Along the normal, N/m.
    damping : float or str
        N s/m.
    backlash : bool
        Whether teeth can part and touch on the other flank, with the pair's backlash. Otherwise the spring pulls as it
        pushes, and the mesh is linear.
    depth : float or str
        Deflection of full damping where there is backlash, m.
    stiffness_curve : sequence of float, optional
        Stiffness over one mesh cycle of the driver from angle 0 on, relative to ``stiffness``, equally spaced.
    error : sequence of float, optional
        Transmission error over the same, m at the base circles, positive for a driven wheel that lags.

    Raises
    ------
    ValueError
        For a stiffness that is not positive, or a curve of fewer than four points or not positive.

    Examples
    --------
    >>> mesh = IdealMesh(GearPair.paper(), stiffness="4e8 N/m")
    >>> mesh.stiffness
    400000000.0
    """

    pair: GearPair
    stiffness: Quantity
    damping: Quantity = 0.0
    backlash: bool = False
    depth: Quantity = "1 um"
    stiffness_curve: Sequence[float] | None = None
    error: Sequence[float] | None = None

    def __post_init__(self) -> None:
        given = self.stiffness
        convert_fields(self, {"stiffness": "N/m", "damping": "N*s/m", "depth": "length"}, "IdealMesh")
        if not self.stiffness > 0:
            raise ValueError(f"IdealMesh.stiffness is {self.stiffness} N/m; it must be positive")
        deflection = abs(self.pair._force(None)) / self.stiffness
        if isinstance(given, Real) and deflection > SOFTEST * self.pair.driver.module:
            warn(
                f"IdealMesh.stiffness is {given:g}, and so in N/m: {shown(self.pair.torque, 'N*m', '.4g')} deflect it "
                f"by {shown(deflection, 'mm', '.4g')}, as no teeth do; write '{given:g} N/mm' or '{given:g} N/um' if "
                f"that is meant, '{given:g} N/m' if not"
            )
        if not self.damping >= 0:
            raise ValueError(f"IdealMesh.damping is {self.damping} N s/m; it must not be negative")
        if not self.depth > 0:
            raise ValueError(f"IdealMesh.depth is {self.depth} m; it must be positive")
        for name in ("stiffness_curve", "error"):
            curve = getattr(self, name)
            if curve is not None:
                values = np.asarray(curve, dtype=float)
                fine = values.ndim == 1 and values.size >= 4 and np.isfinite(values).all()
                if not fine:
                    raise ValueError(f"IdealMesh.{name} needs four finite numbers or more over a mesh cycle")
                if not (name == "error" or values.min() > 0):
                    raise ValueError(f"IdealMesh.{name} holds {values.min():g}; give positive ones")
                most = self.pair.driver.module
                if name == "error" and np.abs(values).max() > most:
                    raise ValueError(
                        f"IdealMesh.error reaches {np.abs(values).max():g} m; give numbers in m, up to the module of "
                        f"{shown(most, 'mm', '.4g')}"
                    )
                object.__setattr__(self, name, values)

    @classmethod
    def from_contact(
        cls, pair: GearPair, torque: float | None = None, points: int = POINTS, **others: Unpack[DampedKeywords]
    ) -> IdealMesh:
        """Mesh with the stiffness curve and the transmission error that a pair's tooth contact has under a torque.

        Parameters
        ----------
        pair : GearPair
        torque : float, optional
            On the driven wheel, N m; default the pair's.
        points : int
            Over a mesh cycle.
        **others
            Further fields of `IdealMesh`.

        Notes
        -----
        The error is what the loaded transmission error exceeds the deflection of the tangent stiffness by.
        """
        from gearmbs.gears.transmission import loaded_transmission_error

        loaded = loaded_transmission_error(pair, torque, points)
        cosine = math.cos(pair.driver.base_helix_angle)
        along = loaded.stiffness / cosine**2
        mean = float(along.mean())
        error = loaded.error - loaded.load / pair.driven.base_radius / loaded.stiffness
        return cls(pair, mean, stiffness_curve=(along / mean).tolist(), error=error.tolist(), **others)

    @classmethod
    def with_damping_ratio(
        cls, pair: GearPair, stiffness: QuantityLike, ratio: float | None = None, **others: Unpack[CurveKeywords]
    ) -> IdealMesh:
        """Mesh whose damping is a ratio of the critical one of the bare wheels on it.

        In the transverse plane stiffness and damping are cos^2(beta_b) of those along the normal: with the reduced mass
        m of the pair ``c = 2 zeta sqrt(k m) / cos(beta_b)``.

        Parameters
        ----------
        pair : GearPair
        stiffness : float or str
            Along the normal, N/m.
        ratio : float, optional
            zeta; default `gearmbs.gears.mesh.DAMPING_RATIO`, 0.07.
        **others
            Further fields of `IdealMesh`.
        """
        along = to_si(stiffness, "N/m", "IdealMesh.stiffness")
        zeta = DAMPING_RATIO if ratio is None else ratio
        if not zeta >= 0:
            raise ValueError(f"damping_ratio is {zeta!r}; give a number that is not negative")
        cosine = math.cos(pair.driver.base_helix_angle)
        return cls(pair, stiffness, 2.0 * zeta * math.sqrt(along * pair.reduced_mass) / cosine, **others)

    @property
    def law(self) -> str:
        """Stiffness and damping in words, in the units of a drawing."""
        damping = f"damping {1e-3 * self.damping:.4g} N s/mm" if self.damping else "no damping"
        parting = "" if self.backlash else ", teeth do not part"
        return f"ideal, {1e-3 * self.stiffness:.5g} N/mm the mesh, {damping}{parting}"

    @property
    def contact_model(self) -> ContactModel:
        """The mesh as that of `contact_ratio` tooth pairs: what analyses of mean stiffness and damping take."""
        # its stiffness is of the wheels as they stand, that of a law is of faces that stand opposite
        share = max(1.0, self.geometry.contact_ratio) * self.geometry.face_share
        # a tooth pair's flank is longer by 1 / cos beta_b
        cosine = math.cos(self.geometry.driver.base_helix_angle)
        law = ContactLaw.linear(
            self.stiffness * cosine / share, self.damping * cosine / share, self.depth if self.backlash else 1e-12
        )
        return ContactModel(law, FlankFriction.none())

    @property
    def operating_point(self) -> OperatingPoint:
        """Load and sense of rotation of the pair."""
        return self.pair.operating_point

    @property
    def faults(self) -> tuple[Fault, ...]:
        """None: an ideal mesh knows errors only as ``error``."""
        return ()

    @property
    def rotation(self) -> int:
        """Sense in which the driver turns about +z."""
        return self.pair.rotation

    def driven_angle(self, driver_angle: float = 0.0) -> float:
        """Angle of the driven wheel at which the drive flanks just touch, rad."""
        return self.pair.driven_angle(driver_angle)

    @property
    def geometry(self) -> PairGeometry:
        """The wheels and their places."""
        return self.pair.geometry

    def tables(self) -> tuple[np.ndarray, np.ndarray]:
        """Relative stiffness and error over the phase that the kernel counts: length of roll over base pitch."""
        sizes = [len(c) for c in (self.stiffness_curve, self.error) if c is not None]
        n = max([POINTS, *sizes])
        geometry = self.geometry
        gear = geometry.wheels[0]
        start = gear.base_half_angle + geometry.working_pressure_angle - (math.pi if geometry.sign < 0 else 0.0)
        phase = np.arange(n) / n - start * gear.teeth / (2 * math.pi)

        def at(curve: Sequence[float] | None, constant: float) -> np.ndarray:
            if curve is None:
                return np.full(n, constant)
            places = np.arange(len(curve)) / len(curve)
            return np.interp(phase, places, np.asarray(curve), period=1.0)

        return at(self.stiffness_curve, 1.0), at(self.error, 0.0)

    def contact_element(self, name: str, i: Marker, j: Marker) -> IdealMeshForce:
        """Return the mesh as a force element between the frames of the driver and the driven wheel."""
        return IdealMeshForce(name, i, j, self)

    def placement(self, driver_angle: float = 0.0) -> Placement:
        """Frames at which the drive flanks just touch, for a given driver angle (rad)."""
        return self.pair.placement(driver_angle)


@dataclass(eq=False, repr=False)
class IdealMeshForce(ForceElement):
    """Spring and damper along the line of action of the wheels whose frames are the markers I and J."""

    mesh: IdealMesh

    kind = "ideal mesh"
    instead = "take a gear contact with ContactLaw.impact, or take it out of the mechanism first"
    diagnostics = (
        Diagnostic("elastic_energy", "J", STORED),
        Diagnostic("damping_power", "W", DISSIPATED),
        Diagnostic("deflection", "m"),
        Diagnostic("normal_force", "N"),
    )

    def compiled(self) -> Compiled:
        from gearmbs.contact.ideal import ideal_mesh

        mesh = self.mesh
        integers, reals, scratch = pack(mesh.pair.with_changes(faults=(), stiffness_curve="constant"), 1)
        stiffness, error = mesh.tables()
        cosine = math.cos(mesh.geometry.driver.base_helix_angle)
        own = [mesh.stiffness, mesh.damping, mesh.depth, cosine, float(mesh.backlash), stiffness.size]
        return Compiled(
            ideal_mesh,
            np.concatenate([[reals.size], integers]),
            np.concatenate([reals, own, stiffness, error]),
            scratch=scratch,
            settings={
                "stiffness": Setting(reals.size, "N/m", allowed=POSITIVE),
                "damping": Setting(reals.size + 1, "N*s/m", allowed=NOT_NEGATIVE),
            },
        )

    def __repr__(self) -> str:
        bodies = f"{self.i.body.name!r} with {self.j.body.name!r}"
        return f"IdealMeshForce({self.name!r}, {bodies}, {self.mesh.stiffness:g} N/m)"
