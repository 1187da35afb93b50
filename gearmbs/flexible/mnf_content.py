"""What a modal neutral file holds, in its own units: invariants, whether its numbers fit, the modal body made of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gearmbs.flexible.fe_model import MassProperties
from gearmbs.flexible.material import FlexibleError
from gearmbs.flexible.modal_model import ModalModel, Seat
from gearmbs.flexible.stress import KnownStresses, StressModes
from gearmbs.mechanism import ShapeIntegrals
from gearmbs.units import to_si
from gearmbs.wording import warn

UNITS = {
    "KILOGRAM": "kg", "KG": "kg", "GRAM": "g", "MEGAGRAM": "1000 kg", "TONNE": "1000 kg",
    "KPOUND_MASS": "1000 lb", "POUND_MASS": "lb", "SLUG": "slug", "OUNCE_MASS": "oz", "METER": "m",
    "CENTIMETER": "cm", "MILLIMETER": "mm", "MICROMETER": "um", "KILOMETER": "km", "INCH": "inch",
    "FOOT": "foot", "YARD": "yard", "MILE": "mile", "SECOND": "s", "MILLISECOND": "ms", "MINUTE": "minute",
    "HOUR": "hour", "NEWTON": "N", "KILONEWTON": "kN", "MILLINEWTON": "mN", "CENTINEWTON": "cN",
    "MEGANEWTON": "MN", "KILOGRAM_FORCE": "kgf", "POUND_FORCE": "lbf", "DYNE": "dyn",
    "KPOUND_FORCE": "1000 lbf", "OUNCE_FORCE": "0.0625 lbf",
}  # fmt: skip
KINDS = ("mass", "length", "time", "force")
SYMBOLS = {"mass": "kg", "length": "m", "time": "s", "force": "N"}
SI = ("KILOGRAM", "METER", "SECOND", "NEWTON")


@dataclass(frozen=True, eq=False)
class ModalNeutralFile:
    """The content of a modal neutral file, in its own units.

    Attributes
    ----------
    ids, positions : ndarray, shapes (N,), (N, 3)
    mass : float
    centre : ndarray, shape (3,)
    inertia : ndarray, shape (3, 3)
        About the origin; some writers give the products of inertia the other sign.
    mode_ids : ndarray, shape (n,)
    eigenvalues : ndarray, shape (n, 5)
        Eigenvalue, frequency (1/time and rad/time), generalised mass and stiffness.
    shapes : ndarray, shape (n, N, 6)
        Displacements and rotations.
    nodal_masses : ndarray, shape (N,)
    nodal_inertias : ndarray, shape (entries, 4), or None
        Rows of node, row, column (4 to 6), value.
    units : tuple of str
        Names of the units of mass, length, time and force.
    faces : list of ndarray
        Rows of the nodes of each face.
    transformation : ndarray, shape (n, n), or None
    interfaces : ndarray of int
        Numbers of the interface nodes.
    header, unit_bytes, tail : bytes
        What is not looked at, and the units as they are filled up: kept for writing.
    stresses : StressModes, optional
        By one unit of each shape, SI; of an op2 file. They are not written.
    """

    ids: np.ndarray
    positions: np.ndarray
    mass: float
    centre: np.ndarray
    inertia: np.ndarray
    mode_ids: np.ndarray
    eigenvalues: np.ndarray
    shapes: np.ndarray
    nodal_masses: np.ndarray
    nodal_inertias: np.ndarray | None
    units: tuple[str, str, str, str]
    faces: list[np.ndarray] = field(default_factory=list)
    transformation: np.ndarray | None = None
    interfaces: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    header: bytes = b""
    unit_bytes: bytes = b""
    tail: bytes = b""
    stresses: StressModes | None = None

    def inertias(self) -> np.ndarray:
        """Return the inertia of each node, shape (N, 3, 3); zero where the file has none."""
        out = np.zeros((len(self.ids), 3, 3))
        if self.nodal_inertias is not None:
            place = {int(k): i for i, k in enumerate(self.ids)}
            for node, row, column, value in self.nodal_inertias:
                i, r, c = place[int(node)], int(row) - 4, int(column) - 4
                out[i, r, c] = out[i, c, r] = value
        return out

    def invariants(self) -> dict[str, np.ndarray]:
        """Return ADAMS's invariants about the origin of the nodes, all modes, in the file's units.

        Returns
        -------
        dict
            I1 (mass), I2 (3,), I3 (n, 3), I4 (n, 3), I5 (n, n, 3), I6 (n, n), I7 (3, 3), I8 (n, 3, 3), I9 (n, n, 3, 3).
        """
        m, s, j = self.nodal_masses, self.positions, self.inertias()
        phi, psi = self.shapes[:, :, :3], self.shapes[:, :, 3:]
        skew_s, skew_phi = _skew(s), _skew(phi)
        spun = np.einsum("pij,npj->npi", j, psi)
        weighted = m[:, None, None] * skew_phi
        mass = np.einsum("p,kpi,lpi->kl", m, phi, phi, optimize=True) + np.einsum(
            "kpi,lpi->kl", psi, spun, optimize=True
        )
        arms = np.einsum("p,pi,pj->ij", m, s, s)
        return {
            "I1": np.array(m.sum()),
            "I2": m @ s,
            "I3": np.einsum("p,npi->ni", m, phi),
            "I4": np.einsum("p,npi->ni", m, np.cross(s, phi)) + spun.sum(axis=1),
            "I5": np.array([np.einsum("p,npi->ni", m, np.cross(one, phi)) for one in phi]),
            "I6": mass,
            "I7": np.trace(arms) * np.eye(3) - arms + j.sum(axis=0),
            "I8": np.einsum("p,pij,npjk->nik", m, skew_s, skew_phi, optimize=True),
            "I9": np.einsum("lpij,kpjm->klim", weighted, skew_phi, optimize=True),
        }

    @property
    def elastic(self) -> np.ndarray:
        """Places of the shapes that are no rigid motions, among all."""
        masses = self.nodal_masses
        arm = self.positions - masses @ self.positions / masses.sum()
        return np.flatnonzero(~_rigid(masses, arm, self.shapes[:, :, :3]))

    def modal_model(self, name: str = "body", modes: int | None = None) -> ModalModel:
        """Return the modal body, in SI, without the shapes that are rigid motions: the frame carries them.

        Parameters
        ----------
        name : str
        modes : int, optional
            How many elastic modes are kept, the slowest; default: all.

        Raises
        ------
        FlexibleError
            If there are none, or fewer than asked for.
        """
        unit = self.in_si()
        mass, length, time = unit["mass"], unit["length"], unit["time"]
        position, masses = self.positions * length, self.nodal_masses * mass
        inertias = self.inertias() * mass * length**2
        # products of inertia have either sign in the file, by its writer; ADAMS takes those of the nodes, too
        total = float(masses.sum())
        com = masses @ position / total
        arm = position - com
        about = np.einsum(
            "p,pij->ij", masses, (arm**2).sum(axis=1)[:, None, None] * np.eye(3) - arm[:, :, None] * arm[:, None, :]
        )
        about += inertias.sum(axis=0)
        # a unit of a mode moves the nodes by the numbers of the file, in its length; rotations are numbers
        moved, turned = self.shapes[:, :, :3] * length, self.shapes[:, :, 3:]
        recovery = None if self.stresses is None else KnownStresses(moved, self.stresses)
        kept = self.elastic
        if modes is not None and modes > kept.size > 0:
            raise FlexibleError(f"{name}: modes = {modes}, but the file has {kept.size} elastic ones")
        if modes is not None:
            kept = kept[np.argsort(self.eigenvalues[kept, 1], kind="stable")][:modes]
        if kept.size == 0:
            raise FlexibleError(f"{name}: all {len(self.mode_ids)} shapes of the file are rigid motions")
        moved, turned = moved[kept], turned[kept]
        general = self.eigenvalues[kept, 3] * mass * length**2
        points = ShapeIntegrals.of_points(masses, position - com, moved, inertias=inertias, rotations=turned)
        integrals = ShapeIntegrals(
            np.diag(general), points.momentum, points.angular_momentum, points.cross, points.first, points.second
        )
        seats = {}
        for k in self.interfaces:
            row = int(np.flatnonzero(self.ids == k)[0])
            seats[f"node {k}"] = Seat(position[row], moved[:, row], turned[:, row])
        corners = [f for f in self.faces if 3 <= len(f) <= 8]
        return ModalModel(
            name=name,
            properties=MassProperties(total, com, about),
            frequencies=self.eigenvalues[kept, 1] / time,
            integrals=integrals,
            ids=self.ids,
            positions=position,
            moved=moved,
            turned=turned,
            seats=seats,
            faces=np.array([_corners(f) for f in corners]) if corners else None,
            masses=masses,
            inertias=inertias,
            recovery=recovery,
        )

    def in_si(self) -> dict[str, float]:
        """Return the SI values of the units, after a look whether they are those of one system.

        Raises
        ------
        FlexibleError
            For names of units that are not known.
        """
        out = {}
        for kind, unit in zip(KINDS, self.units):
            if unit not in UNITS:
                raise FlexibleError(f"unit of {kind} {unit!r} is not known; known: {', '.join(sorted(UNITS))}")
            text = UNITS[unit]
            out[kind] = to_si(text if text[0].isdigit() else f"1 {text}", SYMBOLS[kind], f"unit of {kind}")
        return out


def _corners(face: np.ndarray) -> tuple[int, int, int, int]:
    """Return four corners of a face, a triangle's last one twice; nodes between corners are left out."""
    half = face[::2] if face.size in (6, 8) else face
    four = half if half.size >= 4 else np.append(half, half[-1])
    return tuple(int(k) for k in four[:4])  # type: ignore[return-value]


def _rigid(masses: np.ndarray, arm: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Return which shapes are rigid motions: what is left without their rigid part is less than a thousandth."""
    motion = np.zeros((len(masses), 3, 6))
    for c in range(3):
        motion[:, c, c] = 1.0
        motion[:, :, 3 + c] = np.cross(np.eye(3)[c], arm)
    weight = np.sqrt(masses)[:, None, None]
    basis, _, _ = np.linalg.svd((weight * motion).reshape(-1, 6), full_matrices=False)
    vectors = (weight * moved.transpose(1, 2, 0)).reshape(basis.shape[0], -1)
    rest = vectors - basis @ (basis.T @ vectors)
    return np.linalg.norm(rest, axis=0) < 1e-3 * np.maximum(np.linalg.norm(vectors, axis=0), 1e-300)


def _skew(v: np.ndarray) -> np.ndarray:
    """Return cross product matrices of vectors in the last axis."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return out - np.swapaxes(out, -1, -2)


# Whether the numbers of a modal neutral file fit each other: a file may be whole and yet lie.


SAME_MASS = 1e-3
"""Relative difference of the sum of nodal masses from the body's."""
SAME_CENTRE = 1e-2
"""Distance of their centre from the body's, against its size."""
SAME_NUMBERS = 1e-6
"""Relative differences of numbers that a block has twice, in other units."""
LUMPED = 10.0
"""Factor between a generalised mass and that of the nodal masses: consistent masses, lumped, change that of the
fastest modes; other units or nodes change it by thousands."""


def check_numbers(found: ModalNeutralFile, label: str) -> None:
    """Refuse a file whose blocks contradict each other, and warn if its units hardly are those of its numbers.

    Parameters
    ----------
    found : ModalNeutralFile
    label : str
        Name of the file.

    Raises
    ------
    FlexibleError
        With the block that does not fit, and a remedy.
    """
    unit = found.in_si()
    if not found.mass > 0.0:
        raise FlexibleError(f"{label}: mass = {found.mass}; it must be positive")
    total = found.nodal_masses.sum()
    if abs(total - found.mass) > SAME_MASS * found.mass:
        raise FlexibleError(
            f"{label}: nodal masses sum to {total:.6g}, the body has {found.mass:.6g}; the blocks belong to different "
            "bodies or units, write the file anew"
        )
    centre = found.nodal_masses @ found.positions / total
    size = np.ptp(found.positions, axis=0).max()
    if np.abs(centre - found.centre).max() > SAME_CENTRE * size:
        raise FlexibleError(
            f"{label}: the centre of the nodal masses is {centre}, that of the body {found.centre}; coordinates or "
            "masses are in other units, or in another order"
        )
    _check_eigenvalues(found, label)
    _check_shapes(found, label)
    diagonal = float(np.linalg.norm(np.ptp(found.positions, axis=0))) * unit["length"]
    scaled = MassProperties(found.mass * unit["mass"], found.centre * unit["length"], found.inertia)
    for doubt in scaled.doubts(diagonal):
        warn(f"{label}: {doubt}; the file names {', '.join(found.units)}")


def _check_eigenvalues(found: ModalNeutralFile, label: str) -> None:
    """Refuse frequencies, eigenvalues and generalised stiffness that do not say the same."""
    value, hertz, root, mass, stiffness = found.eigenvalues.T
    turning = 2.0 * np.pi * hertz
    if np.any(np.abs(root - turning) > SAME_NUMBERS * np.maximum(turning, 1.0)):
        raise FlexibleError(f"{label}: frequencies in Hz and rad/s do not agree; the block of eigenvalues is not one")
    # rigid motions have rounding errors of either sign
    small = SAME_NUMBERS * np.abs(value).max(initial=0.0)
    wrong = np.abs(value - root**2) > SAME_NUMBERS * root**2 + small
    wrong |= np.abs(stiffness - mass * value) > 1e3 * SAME_NUMBERS * np.abs(stiffness) + small * np.abs(mass)
    if wrong.any():
        k = int(np.argmax(wrong))
        raise FlexibleError(
            f"{label}: mode {found.mode_ids[k]}: eigenvalue {value[k]:.6g}, frequency {hertz[k]:.6g}, generalised mass "
            f"{mass[k]:.6g} and stiffness {stiffness[k]:.6g} do not fit each other; the block of eigenvalues is damaged"
        )


def _check_shapes(found: ModalNeutralFile, label: str) -> None:
    """Refuse shapes whose mass is far from the generalised one; without nodal inertias it may be less."""
    moved, turned = found.shapes[:, :, :3], found.shapes[:, :, 3:]
    with np.errstate(over="ignore"):
        own = (moved**2).sum(axis=2) @ found.nodal_masses
        own += np.einsum("npi,pij,npj->n", turned, found.inertias(), turned, optimize=True)
    general = found.eigenvalues[:, 3]
    wrong = ~(own <= LUMPED * general)
    if found.nodal_inertias is not None:
        wrong |= own * LUMPED < general
    if wrong.any():
        k = int(np.argmax(wrong))
        raise FlexibleError(
            f"{label}: mode {found.mode_ids[k]}: its shape has the mass {own[k]:.6g} with the nodal masses, its "
            f"generalised mass is {general[k]:.6g}; shapes or masses are in other units, of other nodes, or damaged"
        )
