"""A body reduced to modes: what a mechanism needs of it, and how it is added to one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple, Unpack

import numpy as np
import numpy.typing as npt

from gearmbs.flexible.fe_model import MassProperties
from gearmbs.flexible.interfaces import BodySurface, faceted_surface, hull_surface, revolved_surface
from gearmbs.flexible.material import Damping, FlexibleError, damping_ratios
from gearmbs.flexible.stress import KnownStresses, StressModes, StressRecovery
from gearmbs.mechanism import Mechanism, ModalBody, Mode, ShapeIntegrals
from gearmbs.mechanism.parts.modal import COUPLING, ShapedMarker
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.mechanism.parts.keywords import PlaceKeywords

# Named places of a modal body.


REACH = 1e-4
"""Largest distance of a marker from a node, as a share of the body's size."""


@dataclass(frozen=True, eq=False)
class Seat:
    """A named place of a modal body.

    Attributes
    ----------
    position : ndarray, shape (3,)
        m, in the frame of the nodes.
    moved, turned : ndarray, shape (n, 3)
        Displacement and rotation by one unit of each mode.
    turns : bool
        Whether its rotation is known.
    flexibility : ndarray, shape (6, 6), optional
        Displacement and rotation by unit forces and torques there, of the finite elements free in space, m/N and rad/(N
        m); NaN in directions that the seat lacks.
    """

    position: np.ndarray
    moved: np.ndarray
    turned: np.ndarray
    turns: bool = True
    flexibility: np.ndarray | None = None


# How a point of a modal body moves by one unit of each mode: at a seat, a node, or a section of a beam.


def shapes_at(model: ModalModel, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements and rotations at a point by one unit of each mode, each (n, 3).

    A seat there comes first; then the nodes: of a beam the section there, else the nearest, with its own rotation
    or that of its neighbours.

    Raises
    ------
    FlexibleError
        If no node is near, or seats are there that move differently.
    """
    point = np.asarray(point, dtype=float)
    here = {
        key: seat
        for key, seat in model.seats.items()
        if seat.turns and np.linalg.norm(seat.position - point) <= REACH * model.size
    }
    if here:
        first, *others = here.values()
        if any(not np.array_equal(first.moved, s.moved) or not np.array_equal(first.turned, s.turned) for s in others):
            raise FlexibleError(
                f"{model.name}: the seats {', '.join(here)} are at one place and move differently; "
                "make the marker by its seat's name: seat_marker(body, name)"
            )
        return first.moved, first.turned
    if model.line:
        return _on_line(model, point)
    distance = np.linalg.norm(model.positions - point, axis=1)
    k = int(np.argmin(distance))
    if distance[k] > REACH * model.size:
        raise FlexibleError(
            f"{model.name}: there is no node at {np.array2string(point, precision=6)} m; the nearest, "
            f"{model.ids[k]}, is {distance[k]:.4g} m away. Put the marker on a node, place(number), or "
            f"reduce with an interface there"
        )
    # nodes of solids among those of shells and beams have no rotation of their own: files hold zeros there
    if model.turned is not None and (model.turned[:, k].any() or not model.moved[:, k].any()):
        return model.moved[:, k], model.turned[:, k]
    return model.moved[:, k], _fitted(model, k)


def _fitted(model: ModalModel, k: int) -> np.ndarray:
    """Return the rotation of the nearest neighbours of a node by least squares."""
    near = np.argsort(np.linalg.norm(model.positions - model.positions[k], axis=1))[: min(9, len(model.ids))]
    arm = model.positions[near] - model.positions[k]
    if np.linalg.matrix_rank(arm, tol=1e-6 * max(model.size, 1e-300)) < 2:
        return np.zeros((model.modes, 3))
    moved = model.moved[:, near] - model.moved[:, k : k + 1]
    rows = np.zeros((arm.shape[0], 3, 3))
    for c in range(3):
        rows[:, :, c] = np.cross(np.eye(3)[c], arm)
    solved, *_ = np.linalg.lstsq(rows.reshape(-1, 3), moved.reshape(model.modes, -1).T, rcond=None)
    return solved.T


def _on_line(model: ModalModel, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the motion of a point that turns with its section of a beam."""
    moved, turned = section_motion(model, point[2])
    return moved + np.cross(turned, np.array([point[0], point[1], 0.0])), turned


def section_motion(model: ModalModel, at: float) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement of the middle, and rotation, of the section of a beam at z, by each mode, each (n, 3).

    Raises
    ------
    FlexibleError
        Off the shaft.
    """
    z = model.positions[:, 2]
    if not z[0] - REACH * model.size <= at <= z[-1] + REACH * model.size:
        raise FlexibleError(
            f"{model.name}: z = {at:.6g} m is off the shaft, which reaches from {z[0]:.6g} to {z[-1]:.6g} m"
        )
    k = int(np.clip(np.searchsorted(z, at) - 1, 0, z.size - 2))
    length = z[k + 1] - z[k]
    x = np.clip((at - z[k]) / length, 0.0, 1.0)
    a, b = model.moved[:, k], model.moved[:, k + 1]
    assert model.turned is not None
    ta, tb = model.turned[:, k], model.turned[:, k + 1]
    moved, turned = (1 - x) * a + x * b, (1 - x) * ta + x * tb
    h = [1 - 3 * x**2 + 2 * x**3, x - 2 * x**2 + x**3, 3 * x**2 - 2 * x**3, x**3 - x**2]
    g = [6 * x * (x - 1), 1 - 4 * x + 3 * x**2, -6 * x * (x - 1), 3 * x**2 - 2 * x]
    moved, turned = moved.copy(), turned.copy()
    for plane, axis, sign in ((0, 1, 1.0), (1, 0, -1.0)):
        ends = (a[:, plane], sign * length * ta[:, axis], b[:, plane], sign * length * tb[:, axis])
        moved[:, plane] = sum(w * e for w, e in zip(h, ends))
        # slopes with shear differ from rotations: keep the nodes' rotations, the field's change between
        turned[:, axis] = sign / length * sum(w * e for w, e in zip(g, ends))
    return moved, turned


LEVELS = (*COUPLING, "rigid")
"""Levels of coupling between deformation and motion, from all terms to none."""

PAIR = 1e-7
"""Relative distance below which squared frequencies count as a pair."""

SLENDER = 0.2
"""A body whose least moment of inertia is a smaller share of the next has a long axis."""

SPIN_SHARE = 0.3 * 0.157
"""Spin across the long axis, as a share of the first frequency of the free body, above which stiffening is missed.

That is 0.3 of the first frequency of the same bar held at one end, which is 0.157 of its free one."""


class Origin(NamedTuple):
    """What a body of a mechanism was made of: its model, the level of coupling, and the modes' damping ratios."""

    model: ModalModel
    coupling: str
    ratios: np.ndarray


@dataclass(frozen=True, eq=False)
class ModalModel:
    """A free body with orthonormal modes: modal masses are 1, stiffnesses the squared circular frequencies.

    Attributes
    ----------
    name : str
    properties : MassProperties
    frequencies : ndarray, shape (n,)
        Of the free body, Hz.
    integrals : ShapeIntegrals
        About the centre of mass.
    ids, positions : ndarray, shapes (N,), (N, 3)
        Numbers and positions (m) of the nodes.
    moved, turned : ndarray, shape (n, N, 3)
        Displacements, and rotations if nodes have them, by one unit of each mode.
    seats : dict of str to Seat
    faces : ndarray, optional
        Corners of the surface, rows of nodes.
    line : bool
        Whether the nodes are those of a beam along z, between which shapes are interpolated.
    masses, inertias : ndarray, shapes (N,), (N, 3, 3), optional
        Lumped at the nodes, kg and kg m^2.
    outline : ndarray, shape (k, 2), optional
        Of a body of revolution about z: rows of z and radius, m.
    recovery : StressRecovery, optional
        How stresses follow from the shapes; see `stress_modes`.
    stiffened : bool
        Whether the integrals have the stiffening by a spin across the long axis.
    """

    name: str
    properties: MassProperties
    frequencies: np.ndarray
    integrals: ShapeIntegrals
    ids: np.ndarray
    positions: np.ndarray
    moved: np.ndarray
    turned: np.ndarray | None
    seats: dict[str, Seat] = field(default_factory=dict)
    faces: np.ndarray | None = None
    line: bool = False
    masses: np.ndarray | None = None
    inertias: np.ndarray | None = None
    outline: np.ndarray | None = None
    recovery: StressRecovery | None = None
    stiffened: bool = False

    @property
    def modes(self) -> int:
        """Number of modes."""
        return self.frequencies.size

    @property
    def size(self) -> float:
        """Largest extent, m."""
        return float(np.ptp(self.positions, axis=0).max())

    def place(self, seat: str | int) -> np.ndarray:
        """Return the position of a seat by its name, or of a node by its number, m.

        Raises
        ------
        FlexibleError
            If there is none.
        """
        if isinstance(seat, str):
            if seat not in self.seats:
                raise FlexibleError(f"{self.name}: there is no seat '{seat}'; seats: {', '.join(self.seats) or 'none'}")
            return self.seats[seat].position.copy()
        found = np.flatnonzero(self.ids == seat)
        if found.size == 0:
            raise FlexibleError(
                f"{self.name}: there is no node {seat}; numbers go from {self.ids.min()} to {self.ids.max()}"
            )
        return self.positions[found[0]].copy()

    def shapes(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return displacements and rotations at a point by one unit of each mode, each (n, 3).

        A seat there comes first; then the nodes: of a beam the section there, else the nearest, with its own rotation
        or that of its neighbours.

        Raises
        ------
        FlexibleError
            If no node is near, or seats are there that move differently.
        """
        return shapes_at(self, point)

    def section_motion(self, at: float) -> tuple[np.ndarray, np.ndarray]:
        """Return displacement of the middle, and rotation, of the section of a beam at z, by each mode, each (n, 3).

        Raises
        ------
        FlexibleError
            Off the shaft.
        """
        return section_motion(self, at)

    def selected(self, chosen: npt.ArrayLike) -> ModalModel:
        """Return the body with some of its modes, counted from 0, or those of a mask.

        Raises
        ------
        FlexibleError
            If one is not there, or there twice.
        """
        given = np.asarray(chosen)
        masked = given.dtype == bool and given.shape == (self.modes,)
        k = np.flatnonzero(given) if masked else given.astype(int)
        there = np.all((k >= -self.modes) & (k < self.modes))
        if (given.dtype == bool and not masked) or not there or np.unique(k % self.modes).size < k.size:
            raise FlexibleError(f"{self.name}: modes {given.tolist()!r:.60} of {self.modes}; give each once, from 0 on")
        i = self.integrals
        integrals = ShapeIntegrals(
            i.mass[np.ix_(k, k)], i.momentum[k], i.angular_momentum[k], i.cross[np.ix_(k, k)], i.first[k],
            i.second[np.ix_(k, k)],
        )  # fmt: skip
        seats = {key: replace(s, moved=s.moved[k], turned=s.turned[k]) for key, s in self.seats.items()}
        turned = None if self.turned is None else self.turned[k]
        return replace(
            self, frequencies=self.frequencies[k], integrals=integrals, moved=self.moved[k], turned=turned, seats=seats
        )

    def slowest(self, count: int) -> ModalModel:
        """Return the body with its slowest modes only, for a cheap run: static shapes of the seats go with the others.

        More modes are then not always better at the seats: see `check_reduction`, which tells what flexibility is lost.

        Parameters
        ----------
        count : int
            Of a shaft one less where the last would be one half of a bending pair, for the shaft would get an axis of
            preference; a warning says so.

        Raises
        ------
        FlexibleError
            If it is not one of 1 to `modes`.
        """
        if not 1 <= count <= self.modes:
            raise FlexibleError(f"{self.name}: the slowest {count} modes of {self.modes}; give 1 to {self.modes}")
        squares, kept = self.frequencies**2, count
        while self.line and 0 < kept < self.modes and squares[kept] - squares[kept - 1] < PAIR * squares[kept]:
            kept -= 1
        kept = kept or count
        if kept < count:
            warn(
                f"{self.name}: {kept} modes are kept instead of {count}, whose last is one half of a bending pair",
            )
        return self.selected(np.arange(kept))

    def placed(self, axes: np.ndarray, at: np.ndarray) -> ModalModel:
        """Return the body in another frame; its stresses and what is known of it as of a beam are not kept.

        Parameters
        ----------
        axes : ndarray, shape (3, 3)
            Columns: the axes of its own frame in the other one.
        at : ndarray, shape (3,)
            Its own origin there, m.
        """
        i, back = self.integrals, np.transpose(axes)
        integrals = ShapeIntegrals(
            i.mass, i.momentum @ back, i.angular_momentum @ back, i.cross @ back, axes @ i.first @ back,
            axes @ i.second @ back,
        )  # fmt: skip
        both = np.kron(np.eye(2), axes)
        seats = {
            key: Seat(s.position @ back + at, s.moved @ back, s.turned @ back, s.turns,
                      None if s.flexibility is None else both @ s.flexibility @ both.T)
            for key, s in self.seats.items()
        }  # fmt: skip
        p = self.properties
        return replace(
            self, properties=MassProperties(p.mass, p.com @ back + at, axes @ p.inertia @ back), integrals=integrals,
            positions=self.positions @ back + at, moved=self.moved @ back,
            turned=None if self.turned is None else self.turned @ back, seats=seats,
            inertias=None if self.inertias is None else axes @ self.inertias @ back,
            line=False, outline=None, recovery=None,
        )  # fmt: skip

    def participation(self, *, torques: bool = False) -> np.ndarray:
        """Return the share of each mode in the static compliance of the seats, shape (n,).

        The largest share that the mode has of the displacement of any seat under a force there, in its own direction.

        Parameters
        ----------
        torques : bool
            Whether rotations under torques count, too: for joints that hold the direction of a seat.
        """
        stiffness = (2 * np.pi * self.frequencies) ** 2
        shares = [np.zeros(self.modes)]
        for seat in self.seats.values():
            motion = np.hstack([seat.moved, seat.turned]) if torques else seat.moved
            flexibility = motion**2 / stiffness[:, None]
            total = flexibility.sum(axis=0)
            shares.append((flexibility[:, total > 0] / total[total > 0]).max(axis=1, initial=0.0))
        return np.max(shares, axis=0)

    def lost_turning(
        self, point: npt.ArrayLike, axis: npt.ArrayLike, turned: np.ndarray | None = None
    ) -> tuple[str, float]:
        """Return the seat at a point, and the share that the modes lack of its flexibility under a torque.

        Parameters
        ----------
        point : array_like of 3 floats
            m, in the frame of the nodes.
        axis : array_like of 3 floats
            Of the torque, of length 1.
        turned : ndarray, shape (n, 3), optional
            Rotation by one unit of each mode, to tell seats at one place apart.

        Returns
        -------
        str, float
            An empty name and zero where there is no seat, or one whose exact flexibility is not known.
        """
        place, along = np.asarray(point, dtype=float), np.asarray(axis, dtype=float)
        for key, seat in self.seats.items():
            if seat.flexibility is None or np.linalg.norm(seat.position - place) > REACH * self.size:
                continue
            if turned is not None and not np.allclose(turned, seat.turned, atol=1e-9 * np.abs(seat.turned).max()):
                continue
            exact = float(along @ seat.flexibility[3:, 3:] @ along)
            if exact > 0.0:
                kept = ((seat.turned @ along) ** 2 / (2 * np.pi * self.frequencies) ** 2).sum()
                return key, float(1.0 - kept / exact)
        return "", 0.0

    def by_participation(self, least: float = 1e-4, *, torques: bool = False) -> ModalModel:
        """Return the body without the modes whose `participation` is below ``least``."""
        return self.selected(np.flatnonzero(self.participation(torques=torques) >= least))

    def add_to(
        self,
        mechanism: Mechanism,
        name: str | None = None,
        *,
        damping: Damping = 0.01,
        coupling: str = "full",
        start: Sequence[float] | None = None,
        **where: Unpack[PlaceKeywords],
    ) -> ModalBody:
        """Add the body to a mechanism.

        Parameters
        ----------
        mechanism : Mechanism
        name : str, optional
            Of the body; default: that of the model.
        damping : float, sequence, "adams" or bands
            See :func:`~gearmbs.flexible.damping_ratios`.
        coupling : {"full", "partial", "constant", "rigid"}
            See :meth:`gearmbs.mechanism.ShapeIntegrals.coupled`; ``"rigid"`` adds the undeformed body without modes.
        start : sequence of float, optional
            Modal coordinates at the start.
        **where
            ``position``, ``orientation`` of the frame of the nodes, ``velocity``, ``angular_velocity``: as of
            :meth:`gearmbs.mechanism.Mechanism.body`.

        Returns
        -------
        ModalBody
            Its markers are placed by ``body.marker(model.place("seat"))``. With ``coupling="rigid"`` a
            :class:`~gearmbs.mechanism.Body`.
        """
        p = self.properties
        label = name or self.name
        if coupling not in LEVELS:
            raise FlexibleError(f"{label}: coupling = {coupling!r}; choose one of {', '.join(LEVELS)}")
        if coupling == "rigid":
            return mechanism.body(label, p.mass, p.inertia, com=p.com, **where)  # type: ignore[return-value]
        ratios = damping_ratios(self.frequencies, damping)
        values = np.zeros(self.modes) if start is None else np.asarray(start, dtype=float)
        if values.shape != (self.modes,):
            raise FlexibleError(f"{label}: start has {values.size} values for {self.modes} modes")
        mass = np.diag(self.integrals.mass)
        modes = [
            Mode(frequency=float(f), mass=float(m), damping_ratio=float(z), start=float(q))
            for f, m, z, q in zip(self.frequencies, mass, ratios, values)
        ]
        body = mechanism.modal_body(
            label, p.mass, p.inertia, modes, self.shapes, integrals=self.integrals.coupled(coupling), com=p.com, **where
        )
        body.surface = self.surface
        body.lost_turning = self.lost_turning
        body.origin = Origin(self, coupling, ratios)
        values, axes = np.linalg.eigh(p.inertia)
        if values[0] < SLENDER * values[1] and not (self.stiffened and coupling == "full"):
            body.long_axis = axes[:, 0].copy()
            body.spin_limit = SPIN_SHARE * 2 * np.pi * float(self.frequencies.min())
        return body

    def seat_marker(
        self,
        body: ModalBody,
        seat: str,
        orientation: npt.ArrayLike | None = None,
        *,
        axis: npt.ArrayLike | None = None,
        name: str | None = None,
    ) -> ShapedMarker:
        """Add a marker that moves with a seat, also where several seats are at one place, as hub and rim of a wheel.

        Parameters
        ----------
        body : ModalBody
            As `add_to` returned it.
        seat : str
        orientation, axis, name
            As of :meth:`gearmbs.mechanism.Body.marker`.

        Raises
        ------
        FlexibleError
            If there is no such seat, or its rotation is not known.
        """
        place = self.place(seat)
        chosen = self.seats[seat]
        if not chosen.turns:
            raise FlexibleError(f"{self.name}: seat '{seat}' has no rotation; take a seat of more nodes")
        plain = body.marker(place, orientation, axis=axis, name=name or f"{body.name}.{seat}")  # type: ignore[arg-type]
        body.markers.remove(plain)
        marker = ShapedMarker(
            plain.name, body, plain.position, plain.orientation, moved=chosen.moved, turned=chosen.turned
        )
        body.markers.append(marker)
        return marker

    def modal_load(self, forces: Mapping[str | int, tuple[npt.ArrayLike, npt.ArrayLike]]) -> np.ndarray:
        """Return the load that forces and torques at seats and nodes are to the undeformed body.

        Parameters
        ----------
        forces : mapping of str or int to a pair of array_like of 3 floats
            Force (N) and torque (N m) at a seat by its name, or a node by its number, in the body's axes.

        Returns
        -------
        ndarray, shape (6 + n,)
            Force and torque about the origin of the nodes' frame, then the force on each mode: for
            :func:`gearmbs.mechanism.add_modal_force`.
        """
        out = np.zeros(6 + self.modes)
        for where, (force, torque) in forces.items():
            place = self.place(where)
            seat = self.seats.get(where) if isinstance(where, str) else None
            moved, turned = self.shapes(place) if seat is None or not seat.turns else (seat.moved, seat.turned)
            f, t = np.asarray(force, dtype=float), np.asarray(torque, dtype=float)
            out += np.concatenate([f, t + np.cross(place, f), moved @ f + turned @ t])
        return out

    def displaced(self, coordinates: np.ndarray, factor: float = 1.0) -> np.ndarray:
        """Return the nodes moved by modal coordinates of shape (n,), ``factor`` times as far, shape (N, 3), m."""
        return self.positions + factor * np.einsum("n,npi->pi", np.asarray(coordinates, dtype=float), self.moved)

    def surface(self) -> BodySurface | None:
        """Return what is drawn of the body: its outline, its facets, or the hull of its nodes; None if that is flat."""
        if self.outline is not None:
            return revolved_surface(self.outline, self.positions[:, 2], self.section_motion)
        if self.faces is not None:
            return faceted_surface(self.positions, self.faces, self.moved)
        return hull_surface(self.positions, self.moved)

    def stress_modes(self) -> StressModes:
        """Return the stresses by one unit of each mode, where the finite elements are known.

        They are of shafts by sections, of meshes assembled here, of files that have them, or given (`with_stresses`).

        Raises
        ------
        FlexibleError
            If nothing tells how stresses follow from the shapes.
        """
        if self.recovery is None:
            raise FlexibleError(
                f"{self.name}: its stresses are not known, since its elements are not; take the stresses of the modes "
                "from the finite-element program and give them: with_stresses(StressModes(positions, values))"
            )
        return self.recovery(self.moved, self.turned)

    def with_stresses(self, stresses: StressModes) -> ModalModel:
        """Return the body with the stresses that a finite-element program gives for each of its modes.

        They stay with it when modes are selected.

        Raises
        ------
        FlexibleError
            For another number of modes.
        """
        return replace(self, recovery=KnownStresses(self.moved, stresses))

    def strain_energies(self, coordinates: np.ndarray) -> np.ndarray:
        """Return the strain energy in each mode, J, for coordinates of shape (..., n)."""
        return 0.5 * (2 * np.pi * self.frequencies) ** 2 * np.asarray(coordinates, dtype=float) ** 2

    def __repr__(self) -> str:
        first = ", ".join(f"{f:.4g}" for f in self.frequencies[:6])
        return (
            f"ModalModel({self.name!r}, {self.properties.mass:.6g} kg, {len(self.ids)} nodes, {self.modes} modes: "
            f"{first}{' ...' if self.modes > 6 else ''} Hz, seats: {', '.join(self.seats) or 'none'})"
        )
