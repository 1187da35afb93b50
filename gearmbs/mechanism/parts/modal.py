"""Bodies with modal coordinates: modes, integrals of shapes, and the body made of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from gearmbs.dae.equations.bodies import MODAL
from gearmbs.dae.equations.bodies.inertia import ModalInertia
from gearmbs.dae.equations.bodies.lane_lists import ROUNDING
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.quantities import Vector
from gearmbs.units import shown

Shapes = Callable[[np.ndarray], tuple[npt.ArrayLike, npt.ArrayLike]]
"""From a point of the body's frame, m, to displacements and rotations there by one unit of each mode, each (n, 3)."""


COUPLING = ("full", "partial", "constant")
"""How much of the coupling between deformation and motion of the frame is kept, see `ShapeIntegrals.coupled`."""


SHAPE_ROUNDING = 1e-12
"""Share of the largest below which shapes at a marker are rounding errors."""

TURN = np.array([np.cross(axis, np.eye(3)).T for axis in np.eye(3)])
"""Matrices of the cross product with the unit vectors, [m, i, j]: e_m~ v = e_m x v."""

_EARLIER = np.arange(3)[:, None] < np.arange(3)
_ORDERED = np.where(_EARLIER[:, :, None, None], np.einsum("mij,njk->mnik", TURN, TURN), 0.0)
_ORDERED += np.swapaxes(_ORDERED, 0, 1) + np.einsum("mn,mij,njk->mnik", np.eye(3), TURN, TURN)
_LATER = np.where(_EARLIER.T[None], np.einsum("mjn->jmn", TURN), 0.0)
_AXES = np.einsum("mia,bn->mnabi", TURN, np.eye(3)) - np.einsum("ai,bmn->mnabi", np.eye(3), _LATER)
"""What the angular momentum of the turning of a point has, for each J_ab psi_l,m psi_k,n, about axis i."""
_SQUARES = 0.5 * (np.einsum("mnia,bj->mnabij", _ORDERED, np.eye(3)) - np.einsum("mia,nbj->mnabij", TURN, TURN))
"""What B J B^T has of each, a quarter: that of modes l and k is that of k and l, and equals its transpose."""


@dataclass(frozen=True)
class Mode:
    """One mode of a body.

    Parameters
    ----------
    frequency : float, optional
        Of the body held in its frame, Hz; or give
    stiffness : float, optional
        Modal stiffness, N m (of a coordinate without a unit).
    mass : float
        Modal mass, the sum of mass times displacement squared, kg m^2.
    damping_ratio : float
        Of critical damping of the mode in the frame.
    momentum : array_like of 3 floats
        Sum of mass times displacement, kg m, body components.
    angular_momentum : array_like of 3 floats
        Sum of mass times arm from the centre of mass cross displacement, kg m^2, body components.
    start, rate : float
        Modal coordinate and its rate (1/s) at the start.
    """

    frequency: float | None = None
    stiffness: float | None = None
    mass: float = 1.0
    damping_ratio: float = 0.0
    momentum: Vector = (0.0, 0.0, 0.0)
    angular_momentum: Vector = (0.0, 0.0, 0.0)
    start: float = 0.0
    rate: float = 0.0


@dataclass(frozen=True, eq=False)
class ShapeIntegrals:
    """Integrals of the shapes phi_k over a body, about its centre of mass, body components.

    Attributes
    ----------
    mass : ndarray, shape (n, n)
        Sum of phi_k . phi_l dm, kg m^2.
    momentum, angular_momentum : ndarray, shape (n, 3)
        Sums of phi_k dm and s x phi_k dm.
    cross : ndarray, shape (n, n, 3)
        Sum of phi_k x phi_l dm.
    first, second : ndarray, shapes (n, 3, 3), (n, n, 3, 3)
        Derivatives of the inertia by the modal coordinates.
    """

    mass: np.ndarray
    momentum: np.ndarray
    angular_momentum: np.ndarray
    cross: np.ndarray
    first: np.ndarray
    second: np.ndarray

    @classmethod
    def of_modes(cls, modes: Sequence[Mode]) -> ShapeIntegrals:
        """Return what modes know: all integrals of first order; those that change the inertia are left out."""
        n = len(modes)
        return cls(
            np.diag([m.mass for m in modes]).astype(float).reshape(n, n),
            np.array([m.momentum for m in modes], dtype=float).reshape(n, 3),
            np.array([m.angular_momentum for m in modes], dtype=float).reshape(n, 3),
            np.zeros((n, n, 3)),
            np.zeros((n, 3, 3)),
            np.zeros((n, n, 3, 3)),
        )

    @classmethod
    def of_points(
        cls,
        masses: npt.ArrayLike,
        positions: npt.ArrayLike,
        displacements: npt.ArrayLike,
        *,
        inertias: npt.ArrayLike | None = None,
        rotations: npt.ArrayLike | None = None,
    ) -> ShapeIntegrals:
        """Return all integrals of a body made of mass points, or of small rigid bodies if they have inertias.

        Parameters
        ----------
        masses : array_like, shape (p,)
            kg.
        positions : array_like, shape (p, 3)
            From the centre of mass, m.
        displacements : array_like, shape (n, p, 3)
            By one unit of each mode, m.
        inertias : array_like, shape (p, 3, 3), optional
            About the points, kg m^2.
        rotations : array_like, shape (n, p, 3), optional
            By one unit of each mode, rad; needed with ``inertias``.
        """
        m, s = np.asarray(masses, dtype=float), np.asarray(positions, dtype=float)
        phi = np.asarray(displacements, dtype=float)
        one = np.eye(3)
        along = np.einsum("p,pi,kpi->k", m, s, phi)
        mixed = np.einsum("p,pi,kpj->kij", m, s, phi)
        products = np.einsum("p,kpi,lpj->klij", m, phi, phi)
        mass = np.einsum("klii->kl", products)
        moment = products - np.swapaxes(products, 2, 3)
        points = cls(
            mass,
            np.einsum("p,kpi->ki", m, phi),
            np.einsum("p,kpi->ki", m, np.cross(s, phi)),
            np.stack([moment[..., 1, 2], moment[..., 2, 0], moment[..., 0, 1]], axis=-1),
            2.0 * along[:, None, None] * one - mixed - np.swapaxes(mixed, 1, 2),
            2.0 * mass[:, :, None, None] * one - products - np.swapaxes(products, 2, 3),
        )
        return points if inertias is None else points + cls._of_turning(inertias, rotations)

    @classmethod
    def _of_turning(cls, inertias: npt.ArrayLike, rotations: npt.ArrayLike | None) -> ShapeIntegrals:
        """Return what the inertias of points add, whose rotations about x, y and z are successive as those of markers.

        To second order the rotations make B = 1 + theta~ + 1/2 sum_kl q_k q_l sum_mn psi_k,m psi_l,n e_min~ e_max~
        (~: cross product matrix, min: the axis that comes first), the inertia B J B^T, and the angular velocity
        sum_k (psi_k + sum_l q_l sum_(m<n) psi_l,m psi_k,n e_m x e_n) v_k.
        """
        if rotations is None:
            raise ModelError("ShapeIntegrals.of_points: inertias need the rotations of their points; give rotations=")
        j, psi = np.asarray(inertias, dtype=float), np.asarray(rotations, dtype=float)
        n = psi.shape[0]
        spun = np.einsum("pij,kpj->kpi", j, psi)
        first = np.einsum("mia,paj,kpm->kij", TURN, j, psi, optimize=True)
        # sums over the points of J_ab psi_l,m psi_k,n, of which all of second order is made
        flat = np.swapaxes(psi, 0, 1).reshape(-1, 3 * n)
        products = (np.einsum("pab,lpm->ablmp", j, psi) @ flat).reshape(3, 3, n, 3, n, 3)
        cross = np.tensordot(products, _AXES, ((3, 5, 0, 1), (0, 1, 2, 3)))
        second = np.tensordot(products, _SQUARES, ((3, 5, 0, 1), (0, 1, 2, 3)))
        second = second + np.swapaxes(second, 0, 1)
        mass = np.einsum("kpi,lpi->kl", psi, spun)
        return cls(
            mass, np.zeros((n, 3)), spun.sum(axis=1), cross, first + np.swapaxes(first, 1, 2),
            second + np.swapaxes(second, 2, 3),
        )  # fmt: skip

    def without_rounding(self, inertia: np.ndarray) -> ShapeIntegrals:
        """Return the integrals with zeros where nothing but rounding is, by Schwarz's bounds: fewer terms to carry."""
        size = np.sqrt(np.maximum(np.diag(self.mass), 0.0))
        pairs = size[:, None] * size
        turning = size * np.sqrt(max(float(np.trace(inertia)), 0.0))
        bounds = (pairs, size[:, None] * 0.0, turning[:, None], pairs[..., None], turning[:, None, None],
                  pairs[..., None, None])  # fmt: skip
        parts = (getattr(self, key) for key in self.__dataclass_fields__)
        return ShapeIntegrals(*(np.where(np.abs(x) > ROUNDING * bound, x, 0.0) for x, bound in zip(parts, bounds)))

    def __add__(self, other: ShapeIntegrals) -> ShapeIntegrals:
        """Return the integrals of two sets of points with the same modes together."""
        return ShapeIntegrals(*(getattr(self, key) + getattr(other, key) for key in self.__dataclass_fields__))

    def coupled(self, level: str) -> ShapeIntegrals:
        """Return the integrals that a level of coupling keeps.

        Parameters
        ----------
        level : {"full", "partial", "constant"}
            All; without those of second order in the modal coordinates (``cross`` and ``second``); without the change
            of the inertia as well. A shaft that turns fast needs ``"full"``: its gyroscopic moments are of second
            order.

        Raises
        ------
        ModelError
            For another level.
        """
        if level not in COUPLING:
            raise ModelError(f"coupling = {level!r}; choose one of {', '.join(COUPLING)}")
        dropped = {"full": (), "partial": ("cross", "second"), "constant": ("cross", "second", "first")}[level]
        return ShapeIntegrals(
            *(np.zeros_like(getattr(self, k)) if k in dropped else getattr(self, k) for k in self.__dataclass_fields__)
        )

    def about_centre_of_mass(self, mass: float) -> ShapeIntegrals:
        """Return the integrals of the same shapes less their mean displacements, for a body of ``mass``.

        What the deformation moves the centre of mass by is then no longer in the shapes: R follows it instead.
        """
        p = self.momentum
        products = np.einsum("ki,lj->klij", p, p) / mass
        squares = np.einsum("klii->kl", products)
        return ShapeIntegrals(
            self.mass - squares,
            np.zeros_like(p),
            self.angular_momentum,
            self.cross - np.cross(p[:, None], p[None, :]) / mass,
            self.first,
            self.second - (2.0 * squares[:, :, None, None] * np.eye(3) - products - np.swapaxes(products, 2, 3)),
        )


@dataclass(eq=False)
class ShapedMarker(Marker):
    """A marker of a modal body whose shapes are given with it, instead of being those of its place.

    Attributes
    ----------
    moved, turned : ndarray, shape (n, 3)
        Displacement and rotation by one unit of each mode, in the body's frame.
    """

    moved: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    turned: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))


def centre_marker(body: ModalBody, name: str, axes: np.ndarray | None = None) -> ShapedMarker:
    """Return a marker that is the frame of a body at its centre of mass: what is told of the body itself."""
    still = np.zeros_like(body.mean)
    axes = np.eye(3) if axes is None else axes
    found = ShapedMarker(name, body, body.com.copy(), axes, moved=body.mean, turned=still)
    body.markers.append(found)
    return found


@dataclass(eq=False)
class ModalBody(Body):
    """A body with modal coordinates. Made by :meth:`gearmbs.mechanism.Mechanism.modal_body`.

    Attributes
    ----------
    modal : ModalInertia
        Integrals, stiffness and damping of the shapes less their mean displacements.
    shapes : callable
        Shapes in the body's frame, see `Shapes`.
    mean : ndarray, shape (n, 3)
        Mean displacement by one unit of each mode, m.
    start, rate : ndarray, shape (n,)
        Modal coordinates and their rates at the start.
    long_axis : ndarray, shape (3,), optional
        Direction in the body's axes of a slender body.
    spin_limit : float
        Angular speed across it, rad/s, from which :func:`simulate` warns that geometric stiffening is missing.
    surface : callable, optional
        Returns what is drawn of the body, with ``vertices``, ``triangles`` and ``moved`` as of
        :class:`gearmbs.flexible.BodySurface`, or None.
    lost_turning : callable, optional
        ``lost_turning(point, axis, turned)`` returns the seat there whose rotations these are, and the share that the
        modes lack of its flexibility under a torque; :func:`simulate` warns of it.
    origin : Origin, optional
        What :meth:`gearmbs.flexible.ModalModel.add_to` made it of, for those who write it into files.
    """

    modal: ModalInertia = None  # type: ignore[assignment]
    shapes: Shapes = None  # type: ignore[assignment]
    mean: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    start: np.ndarray = field(default_factory=lambda: np.zeros(0))
    rate: np.ndarray = field(default_factory=lambda: np.zeros(0))
    long_axis: np.ndarray | None = None
    spin_limit: float = float("inf")
    surface: Callable[[], Any] | None = None
    lost_turning: Callable[..., tuple[str, float]] | None = None
    origin: Any = None

    kind = MODAL

    @property
    def coordinates(self) -> int:
        """Number of coordinates."""
        return 6 + self.modal.modes

    def shape_at(self, marker: Marker) -> tuple[np.ndarray, np.ndarray]:
        """Return displacements, less the mean, and rotations at a marker by one unit of each mode, each (n, 3).

        Raises
        ------
        ModelError
            If the shapes given have other sizes.
        """
        n = self.modal.modes
        own = isinstance(marker, ShapedMarker)
        given = (marker.moved, marker.turned) if own else self.shapes(marker.position.copy())  # type: ignore[attr-defined]
        moved, turned = (np.asarray(part, dtype=float) for part in given)
        for part, what in ((moved, "displacements"), (turned, "rotations")):
            if part.shape != (n, 3) or not np.all(np.isfinite(part)):
                raise ModelError(
                    f"body '{self.name}': its shapes give {what} of shape {part.shape} at {marker!r}; "
                    f"they must be {n} finite vectors of 3"
                )
        return _rounded(moved - self.mean), _rounded(turned)

    def mode(self, k: int, *, rate: bool = False) -> str:
        """Return what stands for a modal coordinate, or its rate, in expressions of loads, variables and measures.

        Parameters
        ----------
        k : int
            Which one, counted from 1.
        rate : bool

        Raises
        ------
        ModelError
            If there is no such mode.

        Examples
        --------
        >>> shaft.mode(2)  # doctest: +SKIP
        'MODAL("shaft",2)'
        """
        if not 1 <= k <= self.modal.modes:
            raise ModelError(f"body '{self.name}': mode {k}; modes go from 1 to {self.modal.modes}")
        return f'MODAL{"1" if rate else ""}("{self.name}",{k})'

    def centre_of_mass(self) -> tuple[np.ndarray, np.ndarray]:
        """Return position and velocity of the centre of mass at the start, deformation included, global components."""
        arm = self.orientation @ (self.com + self.start @ self.mean)
        push = self.orientation @ (self.rate @ self.mean)
        return self.position + arm, self.velocity + np.cross(self.angular_velocity, arm) + push

    def __repr__(self) -> str:
        mass = shown(self.mass, "kg", "g")
        return f"ModalBody({self.name!r}, mass={mass}, {self.modal.modes} modes, {len(self.markers)} markers)"


def _rounded(shape: np.ndarray) -> np.ndarray:
    """Return shapes at a marker with zeros in place of their rounding errors: entries that vanish need no equations."""
    return np.where(np.abs(shape) > SHAPE_ROUNDING * np.abs(shape).max(initial=0.0), shape, 0.0)


def make_modal_body(
    rigid: Body, modes: Sequence[Mode], shapes: Shapes, integrals: ShapeIntegrals | None = None
) -> ModalBody:
    """Return a checked modal body with the mass properties and the place of a rigid one.

    Raises
    ------
    ModelError
        If a mode has no positive mass, frequency or stiffness, or the inertia is not that of any body.
    """
    label = f"body '{rigid.name}'"
    if not modes:
        raise ModelError(f"{label}: a modal body needs modes; add a rigid one with .body(...)")
    given = ShapeIntegrals.of_modes(modes) if integrals is None else integrals
    n = len(modes)
    if given.mass.shape != (n, n):
        raise ModelError(f"{label}: the integrals are those of {given.mass.shape[0]} shapes, there are {n} modes")
    stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
    for k, mode in enumerate(modes):
        stiffness[k, k] = _stiffness(mode, given.mass[k, k], f"{label}: mode {k + 1}")
        damping[k, k] = 2.0 * mode.damping_ratio * np.sqrt(stiffness[k, k] * given.mass[k, k])
    if rigid.mass <= 0.0:
        raise ModelError(f"{label}: a modal body needs a mass")
    own = given.about_centre_of_mass(rigid.mass).without_rounding(rigid.inertia)
    coupled = np.block([[rigid.inertia, own.angular_momentum.T], [own.angular_momentum, own.mass]])
    scale = 1.0 / np.sqrt(np.maximum(np.diag(coupled), 1e-300))
    if np.linalg.eigvalsh(scale[:, None] * coupled * scale)[0] <= 0.0:
        raise ModelError(
            f"{label}: its modes carry more momentum than its mass and inertia allow; check modal masses, momenta and "
            "angular momenta, about the centre of mass and in the units of the shapes"
        )
    modal = ModalInertia(own.mass, stiffness, damping, own.angular_momentum, own.cross, own.first, own.second)
    of_rigid: dict[str, Any] = {part.name: getattr(rigid, part.name) for part in fields(Body)}
    return ModalBody(
        **of_rigid,
        modal=modal,
        shapes=shapes,
        mean=given.momentum / rigid.mass,
        start=np.array([m.start for m in modes], dtype=float),
        rate=np.array([m.rate for m in modes], dtype=float),
    )


def _stiffness(mode: Mode, mass: float, label: str) -> float:
    """Return the modal stiffness of a mode given by frequency or stiffness."""
    if (mode.frequency is None) == (mode.stiffness is None):
        raise ModelError(f"{label}: give either its frequency or its stiffness")
    if not (np.isfinite(mass) and mass > 0.0):
        raise ModelError(f"{label}: modal mass = {mass}; it must be positive")
    if not mode.damping_ratio >= 0.0:
        raise ModelError(f"{label}: damping_ratio = {mode.damping_ratio}; it must not be negative")
    stiffness = mode.stiffness if mode.frequency is None else (2.0 * np.pi * mode.frequency) ** 2 * mass
    if stiffness is None or not (np.isfinite(stiffness) and stiffness >= 0.0):
        raise ModelError(f"{label}: stiffness = {stiffness}; it must not be negative")
    return float(stiffness)
