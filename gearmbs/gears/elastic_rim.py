"""The rim of a ring gear that bends: its modes, and the meshes of planets on it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gearmbs.dae.equations.loads.forces import DISSIPATED, STORED, Diagnostic
from gearmbs.gears.contact_element import law_settings
from gearmbs.gears.ideal_mesh import IdealMesh
from gearmbs.gears.mesh import Mesh
from gearmbs.gears.pair import GearPair
from gearmbs.gears.spec import GearSpec, convert_fields
from gearmbs.gears.tables import pack
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.elements import Compiled, ForceElement, Setting, State
from gearmbs.units import Quantity, to_si

WORK = 1104
"""Places of the kernel's scratch that do not depend on the number of modes, and those a mode."""
WORK_A_MODE = 8
UNIT = 1e-3
"""Radial displacement by one unit of a state, m: the integrator then controls the rim as finely as contacts need."""


@dataclass(frozen=True)
class ElasticRim:
    """The rim of a ring gear as a thin elastic ring that bends in its plane and does not stretch.

    Parameters
    ----------
    thickness : float or str, optional
        Of the rim outside the tooth roots, m; default: the ring's ``rim_thickness``.
    width : float or str, optional
        m; default: the ring's face width.
    waves : int
        Modes have 2, 3 .. ``waves`` lobes, two modes each.
    youngs_modulus, density : float or str, optional
        Pa and kg/m^3; default: those of steel, the density that of the ring.
    damping_ratio : float
        Of critical damping of each mode of the free rim.
    bolts : sequence of (float or str), optional
        Angles at which the rim is held by springs to the ring's body, rad or text.
    bolt_stiffness : (float, float)
        Radial and tangential, of each bolt, N/m.

    Raises
    ------
    ValueError
        For values that no rim has.
    """

    thickness: Quantity = None
    width: Quantity = None
    waves: int = 6
    youngs_modulus: Quantity = 2.1e11
    density: Quantity = None
    damping_ratio: float = 0.02
    bolts: Sequence[float] = ()
    bolt_stiffness: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        units = {"thickness": "length", "width": "length", "youngs_modulus": "Pa", "density": "kg/m^3"}
        convert_fields(self, {k: u for k, u in units.items() if getattr(self, k) is not None}, "ElasticRim")
        for name in units:
            value = getattr(self, name)
            known = value is None or (math.isfinite(value) and value > 0)
            if not known:
                raise ValueError(f"ElasticRim.{name} is {value}; give more than 0")
        if not (isinstance(self.waves, int) and 2 <= self.waves <= 30):
            raise ValueError(f"ElasticRim.waves is {self.waves!r}; give a whole number from 2 to 30")
        if not (math.isfinite(self.damping_ratio) and self.damping_ratio >= 0):
            raise ValueError(f"ElasticRim.damping_ratio is {self.damping_ratio}; give 0 or more")
        if not (len(self.bolt_stiffness) == 2 and min(self.bolt_stiffness) >= 0):
            raise ValueError(
                f"ElasticRim.bolt_stiffness is {self.bolt_stiffness!r}; give two numbers of 0 or more, radial, "
                "tangential"
            )
        object.__setattr__(self, "bolts", tuple(to_si(angle, "angle", "ElasticRim.bolts") for angle in self.bolts))


@dataclass(frozen=True, eq=False)
class RimModes:
    """Modes of a rim: amplitudes are the largest radial displacements, m.

    Attributes
    ----------
    radius : float
        Of the mid-line, m.
    waves, phase : ndarray, shape (modes,)
        Lobes n; 0 for cos(n theta), 1 for sin(n theta), theta in the ring's axes.
    mass : ndarray, shape (modes,)
        rho A pi R (1 + 1/n^2), kg.
    stiffness, damping : ndarray, shape (modes, modes)
        pi E I (n^2 - 1)^2 / R^3 and the bolts' springs, N/m; N s/m.
    """

    radius: float
    waves: np.ndarray
    phase: np.ndarray
    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray

    @classmethod
    def of(cls, rim: ElasticRim, ring: GearSpec) -> RimModes:
        """Return the modes of the rim of a ring gear."""
        thickness = float(ring.rim_thickness if rim.thickness is None else rim.thickness)  # type: ignore[arg-type]
        width = float(ring.face_width if rim.width is None else rim.width)  # type: ignore[arg-type]
        density = ring.material.density if rim.density is None else float(rim.density)
        radius = ring.root_radius + 0.5 * thickness
        n = np.repeat(np.arange(2.0, rim.waves + 1), 2)
        phase = np.tile([0.0, 1.0], rim.waves - 1)
        mass = density * thickness * width * math.pi * radius * (1 + 1 / n**2)
        bending = float(rim.youngs_modulus) * width * thickness**3 / 12
        free = math.pi * bending * (n**2 - 1) ** 2 / radius**3
        modes = cls(radius, n, phase, mass, np.diag(free), np.diag(2 * rim.damping_ratio * np.sqrt(free * mass)))
        radial, tangential = rim.bolt_stiffness
        for angle in rim.bolts:
            w, v = modes.shapes(angle)
            modes.stiffness[:] += radial * np.outer(w, w) + tangential * np.outer(v, v)
        return modes

    def shapes(self, angle: float) -> tuple[np.ndarray, np.ndarray]:
        """Return radial and tangential displacement at an angle (rad) by one unit of each mode."""
        turned = self.waves * angle - 0.5 * np.pi * self.phase
        return np.cos(turned), -np.sin(turned) / self.waves

    @property
    def frequencies(self) -> np.ndarray:
        """Frequencies of the rim with its bolts, without teeth in contact, Hz, ascending."""
        scale = 1 / np.sqrt(self.mass)
        return np.sqrt(np.linalg.eigvalsh(scale[:, None] * self.stiffness * scale)) / (2 * np.pi)


DEPTHS = {"penetration_drive": "m", "penetration_back": "m", "pairs_drive": "1", "pairs_back": "1"}
"""What is told of each mesh beside its normal force, with units."""


@dataclass(eq=False, repr=False)
class RingMeshes(ForceElement):
    """Meshes of all planets with a ring whose rim bends: see `gearmbs.contact.ring.kernel`.

    Attributes
    ----------
    planets : tuple of Marker
        Frames of the planets' wheels.
    pairs : tuple of GearPair
        Of each planet with the ring.
    modes : RimModes
    """

    planets: tuple[Marker, ...] = ()
    pairs: tuple[GearPair, ...] = ()
    modes: RimModes = field(default=None)  # type: ignore[assignment]

    kind = "ring meshes"

    @property
    def markers(self) -> tuple[Marker, ...]:
        """The planets' markers, then the ring's."""
        return (*self.planets, self.j)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:  # type: ignore[override]
        """Energy of contacts and rim, powers lost, the normal force of each mesh, and how deep its teeth are."""
        meshes = range(1, len(self.planets) + 1)
        forces = (Diagnostic(f"normal_force_{k}", "N") for k in meshes)
        depths = (Diagnostic(f"{name}_{k}", unit) for k in meshes for name, unit in DEPTHS.items())
        return (
            Diagnostic("elastic_energy", "J", STORED),
            Diagnostic("damping_power", "W", DISSIPATED),
            Diagnostic("friction_power", "W", DISSIPATED),
            *forces,
            *depths,
        )

    @property
    def states(self) -> tuple[State, ...]:
        """Amplitudes of the rim's modes, and their rates, in units of `UNIT`."""
        labels = [f"{int(n)}{'cs'[int(p)]}" for n, p in zip(self.modes.waves, self.modes.phase)]
        return tuple(State(f"{self.name}.{kind}{label}") for kind in ("q", "v") for label in labels)

    def compiled(self) -> Compiled:
        """Return kernel and tables."""
        from gearmbs.contact import GEAR_CONTACT_SIG, gear_contact
        from gearmbs.contact.ring.kernel import ring_meshes

        modes, tables = self.modes, [pack(pair) for pair in self.pairs]
        m = modes.mass.size
        unit, square = np.full(m, UNIT), UNIT**2
        reals = [modes.waves, modes.phase, square * modes.mass, unit, square * modes.stiffness.ravel()]
        reals += [square * modes.damping.ravel(), np.array([modes.radius])]
        head: list[int] = [len(self.planets), m]
        # the address of the contact goes before the integers
        at_i, at_r = 3 + 4 * len(tables), 4 * m + 2 * m * m + 1
        found: list[dict[str, Setting]] = []
        for pair, (integers, numbers, _) in zip(self.pairs, tables, strict=True):
            found.append({what: one._replace(at=at_r + one.at) for what, one in law_settings(pair).items()})
            head += [at_i, integers.size, at_r, numbers.size]
            at_i, at_r = at_i + integers.size, at_r + numbers.size
        room = WORK + WORK_A_MODE * m + max(work for _, _, work in tables)
        return Compiled(
            ring_meshes,
            np.concatenate([head, *(i for i, _, _ in tables)]).astype(np.int64),
            np.concatenate([*reals, *(r for _, r, _ in tables)]),
            ((gear_contact, GEAR_CONTACT_SIG),),
            scratch=room,
            settings={
                what: one._replace(others=tuple((other[what].at, other[what].factor, 0.0) for other in found[1:]))
                for what, one in found[0].items()
            },
        )

    def rim_motion(self, solution: Any, angle: float) -> dict[str, np.ndarray]:
        """Return how the rim moves at an angle of the ring, as a sensor that is fixed there sees it.

        Parameters
        ----------
        solution : Solution
        angle : float
            rad, in the ring's axes.

        Returns
        -------
        dict
            ``"radial"`` and ``"tangential"`` displacement, m, ``"radial_velocity"`` and ``"tangential_velocity"``, m/s,
            each of shape (m,).
        """
        count = self.modes.mass.size
        values = UNIT * np.column_stack([solution.state(state.name) for state in self.states])
        w, v = self.modes.shapes(angle)
        q, rates = values[:, :count], values[:, count:]
        return {"radial": q @ w, "tangential": q @ v, "radial_velocity": rates @ w, "tangential_velocity": rates @ v}

    def __repr__(self) -> str:
        return f"RingMeshes({self.name!r}, {len(self.planets)} planets, {self.modes.mass.size} modes of the rim)"


def ring_meshes(
    name: str,
    planets: Sequence[Marker],
    ring: Marker,
    meshes: Sequence[Mesh | IdealMesh],
    rim: ElasticRim,
    spec: GearSpec,
) -> RingMeshes:
    """Return the element of all meshes of planets with a ring whose rim bends.

    Raises
    ------
    ValueError
        For meshes that are no tooth contact.
    """
    pairs = tuple(mesh for mesh in meshes if isinstance(mesh, GearPair))
    if not len(pairs) == len(planets) > 0:
        raise ValueError(
            f"{name}: a rim that bends needs tooth contact with every planet; leave ideal meshes or the rim out"
        )
    return RingMeshes(name, planets[0], ring, tuple(planets), pairs, RimModes.of(rim, spec))
