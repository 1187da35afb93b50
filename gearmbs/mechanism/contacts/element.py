"""Contact between solids of two bodies as a force element."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from gearmbs.dae.equations.loads.forces import Diagnostic
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.contacts import fields, kernel
from gearmbs.mechanism.contacts.boxes import MOST
from gearmbs.mechanism.contacts.edges import NODES, ROOM
from gearmbs.mechanism.contacts.facets import Facets, sagitta
from gearmbs.mechanism.contacts.loads import IMPACT, LAW_REALS, POISSON
from gearmbs.mechanism.contacts.meshes import COLUMNS
from gearmbs.mechanism.contacts.overlaps import reduced
from gearmbs.mechanism.contacts.shapes import Box, Cylinder, Ellipsoid, Frustum, HalfSpace, Mesh, Shape, Sphere, Torus
from gearmbs.mechanism.parts.elements import Compiled, ForceElement
from gearmbs.mechanism.parts.quantities import quantity

REVERSAL = 1e-3
"""Speed, m/s, about which the penalty goes over from compression to restitution."""
LONG = 0.25
"""Edges this long over half the thickness of another solid are looked at between their vertices: below it, a ball of
this thickness is 0.4 % of it deep when the first vertex meets it."""
ROUND = (Ellipsoid, Cylinder, Frustum)
"""Convex solids that roll."""
ANALYTIC = (Sphere, Ellipsoid, Box, Cylinder, Frustum, Torus, HalfSpace)


def dimensionless(value: Any, field: str) -> float:
    """Return a number that has no unit to be given with it."""
    return quantity(value, "dimensionless", field)


@dataclass(frozen=True)
class Impact:
    """f = k d^e + c STEP(d, 0, 0, d_max, 1) d', never negative: ADAMS's IMPACT.

    Attributes
    ----------
    stiffness, exponent : float
        k, N/m^e, and e, at least 1.
    damping : float or text with a unit
        c, N s/m.
    full_depth : float or text with a unit
        d_max, m, from which on damping acts in full.
    """

    stiffness: float
    exponent: float = 1.5
    damping: Any = 0.0
    full_depth: Any = 1e-4

    def reals(self) -> list[float]:
        """Return the law's part of the table."""
        k, e = (
            dimensionless(self.stiffness, "impact: stiffness, N/m^exponent"),
            dimensionless(self.exponent, "impact: exponent"),
        )
        c = quantity(self.damping, "N*s/m", "impact: damping")
        full = quantity(self.full_depth, "length", "impact: full_depth")
        if not (0.0 < k < np.inf and 1.0 <= e < np.inf and 0.0 <= c < np.inf and 0.0 < full < np.inf):
            raise ModelError(
                f"impact: stiffness {k} and full_depth {full} must be positive, damping {c} not negative, exponent {e} "
                "at least 1, and all finite"
            )
        return [float(IMPACT), k, e, c, full, 0.0, 0.0, 1.0]


@dataclass(frozen=True)
class Poisson:
    """f = p d in compression and r^2 p d in restitution: POISSON, with r of the impulse given back.

    Attributes
    ----------
    penalty : float or text with a unit
        p, N/m.
    restitution : float
        r, from 0 to 1.
    """

    penalty: Any
    restitution: float

    def reals(self) -> list[float]:
        """Return the law's part of the table."""
        p, r = (
            quantity(self.penalty, "N/m", "poisson: penalty"),
            dimensionless(self.restitution, "poisson: restitution"),
        )
        if not 0.0 < p < np.inf or not 0.0 <= r <= 1.0:
            raise ModelError(f"poisson: penalty {p} must be positive and finite, and restitution {r} from 0 to 1")
        return [float(POISSON), 0.0, 1.0, 0.0, 1.0, p, r, REVERSAL]


@dataclass(frozen=True)
class Coulomb:
    """mu(v): rises by STEP to ``static`` at ``stiction``, falls to ``dynamic`` at ``transition``: ADAMS's contacts.

    Attributes
    ----------
    static, dynamic : float
    stiction, transition : float or text with a unit
        Slip speeds, m/s.
    """

    static: float
    dynamic: float
    stiction: Any = 0.1
    transition: Any = 1.0

    def reals(self) -> list[float]:
        """Return the law's part of the table."""
        stick = quantity(self.stiction, "speed", "coulomb: stiction")
        slip = quantity(self.transition, "speed", "coulomb: transition")
        static, dynamic = dimensionless(self.static, "coulomb: static"), dimensionless(self.dynamic, "coulomb: dynamic")
        if not (0.0 <= static < np.inf and 0.0 <= dynamic < np.inf and 0.0 < stick <= slip < np.inf):
            raise ModelError(
                f"coulomb: static {static} and dynamic {dynamic} must not be negative, stiction {stick} m/s "
                f"positive and no larger than transition {slip} m/s, and all finite"
            )
        return [static, dynamic, stick, max(slip, stick * (1.0 + 1e-9))]


@dataclass(eq=False, repr=False)
class SolidContact(ForceElement):
    """Solids of I's body touch solids of J's body.

    Attributes
    ----------
    solids_i, solids_j : tuple of Shape
        In the frames of markers I and J; every one of the first may touch every one of the second.
    law : Impact or Poisson
    friction : Coulomb, optional
    """

    solids_i: tuple[Shape, ...]
    solids_j: tuple[Shape, ...]
    law: Impact | Poisson
    friction: Coulomb | None = None

    kind = "contact"
    diagnostics = (
        Diagnostic("elastic_energy", "J", "stored"),
        Diagnostic("damping_power", "W", "dissipated"),
        Diagnostic("friction_power", "W", "dissipated"),
        Diagnostic("patches", "1", "count"),
        Diagnostic("penetration", "m"),
        Diagnostic("normal_force", "N"),
    )

    def __post_init__(self) -> None:
        for side in (self.solids_i, self.solids_j):
            for shape in side:
                if not isinstance(shape, Shape):
                    raise ModelError(f"contact '{self.name}': {shape!r} is not a shape such as Sphere(0.1)")
        if not self.solids_i or not self.solids_j:
            raise ModelError(f"contact '{self.name}': give a shape on either side")
        if self.i.body is self.j.body:
            raise ModelError(f"contact '{self.name}': both sides are on body '{self.i.body.name}'")
        for a, b in product(self.solids_i, self.solids_j):
            pair_family(self.name, a, b)
        if not isinstance(self.law, Impact | Poisson):
            raise ModelError(f"contact '{self.name}': law = {self.law!r}; give Impact(...) or Poisson(...)")
        if not isinstance(self.friction, Coulomb | None):
            raise ModelError(f"contact '{self.name}': friction = {self.friction!r}; give Coulomb(...) or None")
        self.law.reals()
        if self.friction is not None:
            self.friction.reals()

    def compiled(self) -> Compiled:
        friction = [0.0, 0.0, 1.0, 2.0] if self.friction is None else self.friction.reals()
        table = _Tables([*self.law.reals(), *friction])
        for _, a, b in self.pairs():
            table.add_pair(self.name, a, b)
        integers, reals, most = table.finished()
        return Compiled(kernel.contact_of_solids, integers, reals, scratch=kernel.ROWS + most * COLUMNS)

    def pairs(self) -> list[tuple[tuple[int, int], Shape, Shape]]:
        """Return the numbers of the solids of each pair, and the two; separate solids of one mesh are apart."""
        found: list[tuple[tuple[int, int], Shape, Shape]] = []
        for (k, a), (m, b) in product(enumerate(self.solids_i), enumerate(self.solids_j)):
            sides = [shape.shells() if isinstance(shape, Mesh) else (shape,) for shape in (a, b)]
            found += [((k, m), one, other) for one, other in product(*sides)]
        return found

    def triangles(self) -> int:
        """Return how many triangles the solids of faceted pairs have; those of a solid count in each of its pairs."""
        faceted = [pair for _, *pair in self.pairs() if pair_family(self.name, *pair)[0] == kernel.FACETS]
        return sum(len(shape.facets()[1]) for pair in faceted for shape in pair)

    def round_facets(self) -> list[tuple[tuple[int, int], int, float]]:
        """Return of faceted pairs with a round solid the numbers of both, their triangles and largest sagitta, m."""
        found = []
        for numbers, a, b in self.pairs():
            if pair_family(self.name, a, b)[0] == kernel.FACETS:
                cut = [facets for facets in (a.facets(), b.facets()) if len(facets[1])]
                most = max(sagitta(*facets) for facets in cut)
                if most > 0.0:
                    found.append((numbers, sum(len(facets[1]) for facets in cut), most))
        return found

    def exact(self) -> bool:
        """Whether the geometry of all pairs is exact; else one is faceted."""
        pairs = product(self.solids_i, self.solids_j)
        return all(pair_family(self.name, a, b)[0] != kernel.FACETS for a, b in pairs)

    def __repr__(self) -> str:
        kinds = " and ".join(", ".join(s.kind for s in side) for side in (self.solids_i, self.solids_j))
        return f"SolidContact({self.name!r}, {kinds}, I={self.i.name!r}, J={self.j.name!r})"


def pair_family(name: str, a: Shape, b: Shape) -> tuple[int, bool]:
    """Return how two solids touch, and whether their roles are exchanged.

    Raises
    ------
    ModelError
        For two planes.
    """
    if isinstance(a, Sphere) and isinstance(b, ANALYTIC):
        return kernel.BALL_SOLID, False
    if isinstance(b, Sphere) and isinstance(a, ANALYTIC):
        return kernel.BALL_SOLID, True
    if isinstance(a, HalfSpace) and isinstance(b, HalfSpace):
        raise ModelError(f"contact '{name}': two planes cannot touch; give one side a solid")
    if isinstance(b, HalfSpace) and isinstance(a, (*ROUND, Torus)):
        return kernel.CONVEX_PLANE, False
    if isinstance(a, HalfSpace) and isinstance(b, (*ROUND, Torus)):
        return kernel.CONVEX_PLANE, True
    if isinstance(a, Box) and isinstance(b, Box | HalfSpace):
        return kernel.BOXES, False
    if isinstance(a, HalfSpace) and isinstance(b, Box):
        return kernel.BOXES, True
    if isinstance(a, ROUND) and isinstance(b, (*ROUND, Box)):
        return kernel.CONVEX, False
    if isinstance(a, Box) and isinstance(b, ROUND):
        return kernel.CONVEX, True
    return kernel.FACETS, False


def table_sizes(shape: Shape) -> tuple[int, np.ndarray]:
    """Return the kind and the sizes, shape (4,), of a solid in the tables."""
    if isinstance(shape, Sphere):
        return fields.BALL, np.array([shape.radius, 0.0, 0.0, 0.0])
    if isinstance(shape, Ellipsoid):
        return fields.ELLIPSOID, np.r_[shape.semi_axes, 0.0]
    if isinstance(shape, Box):
        return fields.BOX, np.r_[0.5 * shape.edges, 0.0]
    if isinstance(shape, Cylinder):
        return fields.FRUSTUM, np.array([shape.radius, shape.radius, 0.5 * shape.length, 0.0])
    if isinstance(shape, Frustum):
        return fields.FRUSTUM, np.array([shape.bottom, shape.top, 0.5 * shape.length, 0.0])
    if isinstance(shape, Torus):
        return fields.TORUS, np.array([shape.radius, shape.tube, 0.0, 0.0])
    if isinstance(shape, HalfSpace):
        return fields.HALF_SPACE, np.zeros(4)
    assert isinstance(shape, Mesh)
    return fields.MESH, np.r_[0.5 * np.ptp(shape.vertices, axis=0), 0.0]


def least_half(kind: int, sizes: np.ndarray) -> float:
    """Return half of a solid's least extent along its axes, m; infinite for a half-space."""
    a, b, c, _ = sizes
    return {
        fields.BALL: a,
        fields.FRUSTUM: min(max(a, b), c),
        fields.TORUS: b,
        fields.HALF_SPACE: np.inf,
    }.get(kind, min(a, b, c))


def reach_of(kind: int, sizes: np.ndarray) -> float:
    """Return the radius of a ball about a solid's origin that holds it, m; infinite for a half-space."""
    a, b, c, _ = sizes
    return {
        fields.BALL: a,
        fields.ELLIPSOID: max(a, b, c),
        fields.FRUSTUM: float(np.hypot(max(a, b), c)),
        fields.TORUS: a + b,
        fields.HALF_SPACE: np.inf,
    }.get(kind, float(np.linalg.norm(sizes[:3])))


class _Tables:
    """The tables of a contact as they grow."""

    def __init__(self, law: Sequence[float]) -> None:
        assert len(law) == LAW_REALS
        self.pairs: list[list[int]] = []
        self.integers: list[np.ndarray] = []
        self.n_integers = 0
        self.reals: list[np.ndarray] = [np.array(law)]
        self.n_reals = LAW_REALS
        self.most = 1

    def add_pair(self, name: str, a: Shape, b: Shape) -> None:
        family, exchanged = pair_family(name, a, b)
        if exchanged:
            a, b = b, a
        faceted = family == kernel.FACETS
        rounded = family in (kernel.CONVEX_PLANE, kernel.CONVEX)
        first = self._solid(a, faceted, rounded, least_half(*table_sizes(b)))
        second = self._solid(b, faceted, rounded and isinstance(b, ROUND), least_half(*table_sizes(a)))
        self.pairs.append([family, int(exchanged), *first, *second])
        room = min(ROOM, (1 + NODES) * (first[6] + second[6]))
        self.most = max(self.most, first[2] + second[2] + room, MOST if family == kernel.BOXES else 1)

    def _solid(self, shape: Shape, faceted: bool, supported: bool, thin: float) -> list[int]:
        """Append a solid, whose edges count if they are long against another half as thick as ``thin``, m."""
        kind, sizes = table_sizes(shape)
        if supported:
            sizes = reduced(kind, sizes)
        if faceted:
            sizes[3] = reach_of(kind, sizes)
        vertices, triangles = shape.facets() if faceted else (np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
        offset = shape.offset
        if kind == fields.MESH:
            # the origin goes to the middle of the box that holds it
            middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
            offset, vertices = offset + shape.axes @ middle, vertices - middle
        made = Facets.of(vertices, triangles, LONG * thin)
        at, points = self.n_reals, self.n_reals + kernel.SOLID_REALS
        self._append(np.concatenate([shape.axes.ravel(), offset, sizes, made.reals()]))
        faces, borders = self._append_integers(made.triangles), self._append_integers(made.edges)
        return [kind, at, len(vertices), points, len(triangles), faces, len(made.edges), borders]

    def _append_integers(self, values: np.ndarray) -> int:
        """Append integers; return where they begin behind those of the pairs."""
        self.integers.append(values.ravel())
        self.n_integers += values.size
        return self.n_integers - values.size

    def _append(self, values: np.ndarray) -> None:
        self.reals.append(values)
        self.n_reals += values.size

    def finished(self) -> tuple[np.ndarray, np.ndarray, int]:
        """Return integers, reals and the largest number of points of a pair."""
        head = 1 + kernel.PAIR * len(self.pairs)
        table = np.array(self.pairs, dtype=np.int64)
        for solid in (2, 2 + kernel.SOLID):
            table[:, [solid + 5, solid + 7]] += head
        return (
            np.concatenate([[len(self.pairs)], table.ravel(), *self.integers]),
            np.concatenate(self.reals),
            self.most,
        )
