"""Stiffness of a tooth pair by plane finite elements, against ISO 6336-1 and the potential-energy method.

    python -m benchmarks.tooth_stiffness --write docs/data/tooth_stiffness.txt

A wheel is the whole ring from its bore, which is clamped, to the root circle, with four teeth: the loaded ones and
their neighbours, with the root that a rack cuts. Quadratic quadrilaterals, per unit of face width.

* ``resolved``: the flank carries Hertz's pressure on a mesh that resolves it. With the half width
  a^2 = 4 F' R / (pi E*) the approach of two bodies is the sum of their displacements under the load, weighted by its
  pressure, and a^2 / (8 R): the mean over the pressure of what the parabolas are apart.
* ``bending``: tooth and body without the neighbourhood of the contact: the displacement of the tooth's middle line
  where the normal crosses it. The flattening between is Weber's and Banaschek's for a half plane,
  2 (1 - nu^2) F' / (pi E) [ln(2 h / a) - nu / (2 (1 - nu))] for each wheel with the depth h of the middle line.
* A load on one tooth moves the next: of two pairs in contact the stiffness is 1^T C^-1 1 with the compliances C of
  both, not the sum of the two alone.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.markdown import table
from gearmbs.gears import GearPair, GearSpec
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.iso6336 import iso_mesh_stiffness, iso_single_stiffness, iso_theoretical_stiffness
from gearmbs.gears.stiffness import (
    contact_half_width,
    disc_torsion,
    flattening,
    mesh_stiffness,
    pair_stiffness,
    rack_root,
    tooth_compliance,
)

TEETH = (-1, 0, 1, 2)
"""Teeth of the model; 0 carries the load, 1 the next one's."""
SAG = 0.8
"""Depth below the root circle, in modules, to which the lines of the mesh under a tooth reach."""
GROWTH = 0.18
"""Of the size of elements with the distance from a contact."""
SIZE = 0.16
"""Largest elements of a tooth, in modules."""


@dataclass(frozen=True)
class Grid:
    """Fineness of a mesh.

    Attributes
    ----------
    size : float
        Largest elements of a tooth, in modules.
    contact : float, optional
        Smallest elements, at the contact, m; none where the load is not resolved.
    """

    size: float = SIZE
    contact: float | None = None


def stations(length: float, size: float, near: list[tuple[float, float]]) -> np.ndarray:
    """Return places from 0 to a length whose distance is ``size``, and smaller near some places."""
    fine = np.linspace(0.0, length, 20001)
    step = np.full(fine.size, size)
    for place, least in near:
        step = np.minimum(step, least + GROWTH * np.abs(fine - place))
    count = np.concatenate([[0.0], np.cumsum(np.diff(fine) * 0.5 * (1 / step[1:] + 1 / step[:-1]))])
    return np.interp(np.linspace(0.0, count[-1], math.ceil(count[-1]) + 1), count, fine)


def flank_point(gear: GearSpec, roll: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the place of a contact on the right flank of tooth 0, m, and the direction of its load."""
    rb = gear.base_radius
    beta = roll / rb - gear.base_half_angle
    place = np.array([roll * math.cos(beta) - rb * math.sin(beta), roll * math.sin(beta) + rb * math.cos(beta)])
    return place, -np.array([math.cos(beta), math.sin(beta)])


def contact_depth(gear: GearSpec, roll: float) -> float:
    """Return the distance of a contact from the tooth's middle line along the normal, m."""
    place, normal = flank_point(gear, roll)
    return float(place[0] / -normal[0])


class WheelModel:
    """Finite elements of a wheel in its plane.

    Parameters
    ----------
    gear : GearSpec
        External, spur, held at its bore.
    grid : Grid
    at : float, optional
        Length of roll around which the mesh is refined, m.
    plane : {"strain", "stress"}
    rigid_teeth : bool
        Whether only the body gives way.
    """

    def __init__(
        self, gear: GearSpec, grid: Grid, at: float | None = None, plane: str = "strain", rigid_teeth: bool = False
    ) -> None:
        self.gear, self.bore, self.grid, self.at = gear, float(gear.bore_radius), grid, at
        self.plane, self.rigid_teeth = plane, rigid_teeth
        self._outline()
        self._mesh()

    def flank(self, roll: float) -> tuple[np.ndarray, np.ndarray]:
        """See `flank_point`."""
        return flank_point(self.gear, roll)

    def _outline(self) -> None:
        """Radius and angle along half a tooth, from the middle of the root to the tip."""
        gear = self.gear
        half, height = rack_root(gear)
        begin = math.sqrt(half[-1] ** 2 + height[-1] ** 2 - gear.base_radius**2)
        rolls = np.linspace(begin, gear.tip_roll_length, 400)
        flank = np.array([self.flank(s)[0] for s in rolls])
        x, y = np.concatenate([half, flank[1:, 0]]), np.concatenate([height, flank[1:, 1]])
        radius, angle = np.hypot(x, y), np.arctan2(x, y)
        land = np.linspace(math.pi / gear.teeth, angle[0], 20)[:-1]
        radius, angle = np.concatenate([np.full(land.size, gear.root_radius), radius]), np.concatenate([land, angle])
        x, y = radius * np.sin(angle), radius * np.cos(angle)
        self._along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
        self._radius, self._angle = radius, angle
        self._flank_from = float(self._along[land.size + half.size - 1])
        self._roll_along = (rolls, self._along[land.size + half.size - 1 :])

    def _tooth_rows(self, number: int) -> np.ndarray:
        m, size = self.gear.module, self.grid.size * self.gear.module
        near = []
        if number == 0 and self.at is not None and self.grid.contact is not None:
            near = [(float(np.interp(self.at, *self._roll_along)), self.grid.contact)]
        # the root as fine as a quarter of the module's share
        near.append((0.5 * self._flank_from, 0.4 * size))
        along = stations(self._along[-1], size if number in (0, 1) else 2 * size, near)
        radius, angle = np.interp(along, self._along, self._radius), np.interp(along, self._along, self._angle)
        sag = SAG * m * np.maximum(0.0, 1 - along / self._flank_from) ** 2
        xi = self._across
        r = radius[:, None] - sag[:, None] * (1 - xi**2)
        turned = angle[:, None] * xi + number * 2 * math.pi / self.gear.teeth
        return np.stack([r * np.sin(turned), r * np.cos(turned)], axis=-1)

    def _mesh(self) -> None:
        from skfem import MeshQuad

        gear = self.gear
        pitch = 2 * math.pi / gear.teeth
        thick = 0.5 * gear.tooth_thickness
        least = self.grid.size * gear.module if self.grid.contact is None else self.grid.contact
        half = stations(1.0, self.grid.size * gear.module / thick, [(1.0, least / thick)])
        self._across = np.concatenate([-half[::-1], half[1:]])
        rows = {n: self._tooth_rows(n) for n in TEETH}
        nx = self._across.size
        # the ring's outer line: below the teeth, and along the root circle elsewhere
        under = [rows[n][0][:-1] for n in TEETH]
        begin, end = (TEETH[-1] + 0.5) * pitch, (TEETH[0] - 0.5) * pitch + 2 * math.pi
        count = max(24, math.ceil(2 * (end - begin) / pitch))
        rest = np.linspace(begin, end, count + 1)[:-1]
        rest_line = gear.root_radius * np.stack([np.sin(rest), np.cos(rest)], axis=-1)
        outer = np.concatenate([*under, rest_line])
        n_outer = outer.shape[0]
        reach = np.hypot(*outer.T)
        depth = gear.root_radius - self.bore
        layers = 1 - stations(1.0, 0.12, [(0.0, self.grid.size * gear.module / depth)])[::-1]
        scale = self.bore + layers[:, None] * (reach - self.bore)
        ring = (outer / reach[:, None])[None] * scale[:, :, None]
        points = [ring.reshape(-1, 2)]
        index = np.arange(ring.shape[0] * n_outer).reshape(-1, n_outer)
        wrapped = np.concatenate([index, index[:, :1]], axis=1)
        quads = [_quads(wrapped)]
        body = quads[0].shape[1]
        top = wrapped[-1]
        size = ring.shape[0] * n_outer
        self._middle: dict[int, np.ndarray] = {}
        self._right: dict[int, np.ndarray] = {}
        for k, n in enumerate(TEETH):
            block = rows[n][1:]
            own = size + np.arange(block.shape[0] * nx).reshape(-1, nx)
            size += own.size
            whole = np.concatenate([top[k * (nx - 1) : k * (nx - 1) + nx][None], own])
            points.append(block.reshape(-1, 2))
            quads.append(_quads(whole))
            self._middle[n], self._right[n] = whole[:, nx // 2], whole[:, -1]
        self.points = np.concatenate(points).T
        self.mesh = MeshQuad(self.points, np.concatenate(quads, axis=1))
        self._body_elements = body

    @cached_property
    def _basis(self):
        from skfem import Basis, ElementQuad2, ElementVector

        return Basis(self.mesh, ElementVector(ElementQuad2()))

    @cached_property
    def _solve(self):
        from scipy.sparse.linalg import splu
        from skfem import BilinearForm
        from skfem.helpers import ddot, sym_grad, trace

        steel = self.gear.material
        young, nu = steel.youngs_modulus, steel.poisson_ratio
        mu, lam = young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))
        if self.plane == "stress":
            lam = 2 * lam * mu / (lam + 2 * mu)
        basis = self._basis
        factor = np.ones(self.mesh.nelements)
        if self.rigid_teeth:
            factor[self._body_elements :] = 1e4
        scale = factor[:, None] * np.ones((1, basis.X.shape[1]))

        @BilinearForm
        def stiffness(u, v, w):
            e, f = sym_grad(u), sym_grad(v)
            return w["scale"] * (lam * trace(e) * trace(f) + 2 * mu * ddot(e, f))

        matrix = stiffness.assemble(basis, scale=scale).tocsc()
        held = basis.get_dofs(lambda x: np.hypot(x[0], x[1]) < self.bore * (1 + 1e-9))
        # chords of the bore's circle: their middles are inside it
        free = np.setdiff1d(np.arange(basis.N), held.all())
        solver = splu(matrix[free][:, free], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True},
                      diag_pivot_thresh=0.0)  # fmt: skip

        def solve(load: np.ndarray) -> np.ndarray:
            out = np.zeros(basis.N)
            out[free] = solver.solve(load[free])
            return out

        return solve

    @cached_property
    def _flank_edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Ends of the edges along the loaded flank, and the unknowns of their first ends, middles and second ends."""
        right = self._right[0]
        known = {tuple(sorted(pair)): i for i, pair in enumerate(self.mesh.facets.T.tolist())}
        facets = [known[tuple(sorted((int(a), int(b))))] for a, b in pairwise(right)]
        nodal, middles = self._basis.nodal_dofs, self._basis.facet_dofs[:, facets]
        return self.points[:, right], np.stack([nodal[:, right[:-1]], middles, nodal[:, right[1:]]], axis=1)

    def load(self, roll: float, half_width: float) -> np.ndarray:
        """Return the load vector of a force of 1 N/m of face width on tooth 0, spread as Hertz's pressure is."""
        place, normal = self.flank(roll)
        along = np.array([normal[1], -normal[0]])
        ends, dofs = self._flank_edges
        length = np.hypot(*np.diff(ends, axis=1))
        off = along @ ends - along @ place
        at, weight = np.polynomial.legendre.leggauss(8)
        # the quadratic functions of an edge, by place from -1 to 1
        shape = np.stack([0.5 * at * (at - 1), 1 - at**2, 0.5 * at * (at + 1)])
        where = 0.5 * (off[:-1, None] * (1 - at) + off[1:, None] * (1 + at))
        pressure = np.sqrt(np.maximum(0.0, 1 - (where / half_width) ** 2)) * weight * length[:, None]
        share = shape @ pressure.T / pressure.sum()
        out = np.zeros(self._basis.N)
        for axis in (0, 1):
            np.add.at(out, dofs[axis], normal[axis] * share)
        return out

    def compliance(self, roll: float, half_width: float) -> float:
        """Return the displacement under the pressure, weighted by it, of a force of 1 N/m, m^2/N."""
        load = self.load(roll, half_width)
        return float(load @ self._solve(load))

    def bending(self, rolls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return by loaded place what the middle lines of tooth 0, and of the next, a base pitch on, move, m^2/N."""
        pitch = 2 * math.pi / self.gear.teeth
        own, next_one = [], []
        for roll in rolls:
            moved = self._solve(self.load(roll, 0.12 * self.gear.module))
            own.append(self._at_middle(moved, 0, roll, 0.0))
            next_one.append(self._at_middle(moved, 1, roll + self.gear.base_pitch, pitch))
        return np.array(own), np.array(next_one)

    def _at_middle(self, moved: np.ndarray, tooth: int, roll: float, turned: float) -> float:
        place, normal = self.flank(roll)
        height = place[1] + place[0] / -normal[0] * normal[1]
        nodes = self._middle[tooth]
        c, s = math.cos(turned), math.sin(turned)
        where = self.points[:, nodes]
        heights = s * where[0] + c * where[1]
        direction = np.array([c * normal[0] + s * normal[1], -s * normal[0] + c * normal[1]])
        dofs = self._basis.nodal_dofs[:, nodes]
        along = direction @ moved[dofs]
        return float(np.interp(height, heights, along))


def _quads(index: np.ndarray) -> np.ndarray:
    return np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]]).reshape(4, -1)


@dataclass(frozen=True)
class Example:
    """A pair, and the part of its root radius that the bores are.

    Attributes
    ----------
    name : str
    pair : GearPair
    bore : float
        Over the root radius; the wheels of the pair have it.
    """

    name: str
    pair: GearPair
    bore: float = 0.5

    @classmethod
    def of(cls, name: str, one: GearSpec, two: GearSpec, bore: float = 0.5) -> Example:
        """Return a pair whose wheels have such a bore."""
        return cls(name, GearPair(*(replace(w, bore_radius=bore * w.root_radius) for w in (one, two))), bore)


EXAMPLES = (
    Example.of("29/29, m 3.065, the paper's", *GearPair.paper().wheels),
    Example.of("20/60, m 3", GearSpec(20, "3 mm"), GearSpec(60, "3 mm")),
    Example.of("18/47, m 4, x 0.35 and 0.2", GearSpec(18, "4 mm", profile_shift=0.35, face_width="30 mm"),
               GearSpec(47, "4 mm", profile_shift=0.2, face_width="30 mm")),
)  # fmt: skip
LOADS = (5e4, 2e5, 6e5)
"""N/m of face width."""
BORES = (0.2, 1 / 3, 0.5, 2 / 3)
"""Over the root radius."""


def rolls_at_pitch(pair: PairGeometry) -> tuple[float, float]:
    """Return the lengths of roll of both wheels where they touch at the pitch point, m."""
    turned = math.tan(pair.working_pressure_angle)
    return pair.driver.base_radius * turned, pair.driven.base_radius * turned


def half_width(pair: PairGeometry, load: float) -> float:
    """Return Hertz's half width at the pitch point, m, in plane strain."""
    return float(contact_half_width(pair, np.array([rolls_at_pitch(pair)[0]]), load)[0])


def resolved(pair: PairGeometry, load: float, size: float = SIZE, over: int = 5) -> float:
    """Secant stiffness of one pair at the pitch point with the contact resolved, N/m^2; ``over`` elements of it."""
    rolls = rolls_at_pitch(pair)
    a = half_width(pair, load)
    total = a**2 / 8 * sum(1 / s for s in rolls)
    for wheel, at in zip(pair.wheels, rolls):
        total += load * WheelModel(wheel, Grid(size, a / over), at).compliance(at, a)
    return load / total


def flattened(wheel: GearSpec, roll: float, a: float) -> float:
    """Weber's and Banaschek's flattening of one flank, m^2/N."""
    depth = contact_depth(wheel, roll)
    return float(flattening(wheel, np.array(depth), np.array(a))) * wheel.face_width


def single(pair: PairGeometry, load: float, size: float = SIZE, plane: str = "strain") -> float:
    """Stiffness of one pair at the pitch point by the middle lines of the teeth and the flattening, N/m^2."""
    a = half_width(pair, load)
    total = 0.0
    for wheel, at in zip(pair.wheels, rolls_at_pitch(pair)):
        moved, _ = WheelModel(wheel, Grid(size), plane=plane).bending(np.array([at]))
        total += float(moved[0]) + flattened(wheel, at, a)
    return 1 / total


def mean_stiffness(pair: PairGeometry, load: float, size: float = SIZE, points: int = 40) -> tuple[float, float]:
    """Mean over the mesh cycle of the stiffness of all pairs in contact, together and as if each were alone, N/m^2."""
    pitch, ratio = pair.driver.base_pitch, pair.contact_ratio
    known = []
    for wheel, first in zip(pair.wheels, pair.first_roll_lengths):
        rolls = np.linspace(first, wheel.tip_roll_length, 9)
        known.append((rolls, *WheelModel(wheel, Grid(size)).bending(rolls)))
    begin = pair.first_roll_lengths[0]
    together, alone = [], []
    for phase in (np.arange(points) + 0.5) / points:
        at = begin + pitch * np.arange(phase, ratio, 1.0)
        compliance = np.zeros((at.size, at.size))
        for k, wheel in enumerate(pair.wheels):
            own = at if k == 0 else pair.mate_roll_length(0, at)
            rolls, self_moved, next_moved = known[k]
            for i, s in enumerate(own):
                a = float(contact_half_width(pair, at[i : i + 1], load)[0])
                compliance[i, i] += np.interp(s, rolls, self_moved) + flattened(wheel, s, a)
            for i in range(at.size - 1):
                # by the tooth with the shorter length of roll; Maxwell: the other way round it is the same
                cross = np.interp(min(own[i], own[i + 1]), rolls, next_moved)
                compliance[i, i + 1] += cross
                compliance[i + 1, i] += cross
        together.append(np.linalg.inv(compliance).sum())
        alone.append((1 / np.diag(compliance)).sum())
    return float(np.mean(together)), float(np.mean(alone))


def pair_row(one: Example, load: float, size: float = SIZE) -> list[float]:
    """Return a row of the first table: stiffnesses of one pair at the pitch point, N/(mm um)."""
    pair = one.pair.geometry
    at, width = np.array([rolls_at_pitch(pair)[0]]), pair.common_face_width
    energies = float(pair_stiffness(pair, at, load=load)[0]) / width
    usual = float(pair_stiffness(pair, at, sainsot=True)[0]) / width
    values = (resolved(pair, load, size), single(pair, load, size), single(pair, load, size, "stress"), energies, usual,
              iso_single_stiffness(pair), iso_theoretical_stiffness(pair))  # fmt: skip
    return [value / 1e9 for value in values]


def mean_row(one: Example, load: float = 2e5, size: float = SIZE) -> list[float]:
    """Return a row of the second table: means over the mesh cycle, N/(mm um)."""
    pair = one.pair.geometry
    width = pair.common_face_width
    together, alone = mean_stiffness(pair, load, size)
    energies, usual = (mesh_stiffness(one.pair, load=load, sainsot=old).mean / width for old in (False, True))
    values = (
        together,
        alone,
        iso_mesh_stiffness(pair),
        iso_single_stiffness(pair) * pair.contact_ratio,
        energies,
        usual,
    )
    return [pair.contact_ratio, *(value / 1e9 for value in values)]


def bore_row(wheel: GearSpec, bore: float, size: float = SIZE) -> list[float]:
    """Return a row of the third table: compliance of tooth and body at the pitch point, um mm/kN, by parts."""
    held = replace(wheel, bore_radius=bore * wheel.root_radius)
    roll = wheel.base_radius * math.tan(wheel.transverse_pressure_angle)
    found = [float(WheelModel(held, Grid(size), rigid_teeth=rigid).bending(np.array([roll]))[0][0])
             for rigid in (False, True)]  # fmt: skip
    width = wheel.face_width
    torsion = disc_torsion(held) * width
    energies = [
        float(np.interp(roll, tooth.roll_length, tooth.total)) * width
        for tooth in (tooth_compliance(held), tooth_compliance(held, sainsot=True))
    ]
    return [1e12 * value for value in (*found, torsion, found[0] - torsion, *energies)]


def tables(size: float = SIZE) -> str:
    """Return all tables in Markdown."""
    digits = "{:.3g}".format
    first = [
        [one.name, digits(load / 1e3), *map(digits, pair_row(one, load, size))] for one in EXAMPLES for load in LOADS
    ]
    second = [[one.name, *map(digits, mean_row(one, size=size))] for one in EXAMPLES]
    wheel = EXAMPLES[0].pair.driver
    third = [[digits(bore), *map(digits, bore_row(wheel, bore, size))] for bore in BORES]
    pair = EXAMPLES[0].pair.geometry
    fourth = []
    for k, part in enumerate((2.0, 1.0, 0.5)):
        moved, _ = WheelModel(wheel, Grid(part * size)).bending(np.array([rolls_at_pitch(pair)[0]]))
        over = (3, 5, 10)[k]
        fine = resolved(pair, LOADS[1], part * size, over) / 1e9
        fourth.append([digits(part * size), f"{1e12 * moved[0]:.4g}", str(over), f"{fine:.4g}"])
    lines = [
        "One pair at the pitch point, N/(mm um):", "",
        table(["pair", "N/mm", "FE, contact resolved", "FE + flattening", "the same in plane stress", "energies",
                "Sainsot, Yang and Lin", "c'", "c'_th"], first), "",
        "Mean over the mesh cycle at 200 N/mm, N/(mm um):", "",
        table(["pair", "contact ratio", "FE", "FE, each pair as if alone", "c_gamma", "contact ratio times c'",
                "energies", "Sainsot, Yang and Lin"], second),
        "Tooth and body of the paper's wheel at the pitch point by its bore over the root radius, um mm/kN:", "",
        table(["bore", "FE", "FE, teeth rigid", "torsion of the disc", "FE without it", "energies", "Sainsot"], third),
        "Convergence at the paper's pair, 200 N/mm:", "",
        table(["largest element, modules", "tooth and body, um mm/kN", "elements over the half width",
                "resolved pair, N/(mm um)"], fourth).rstrip("\n"),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the tables, or write them to a file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--size", type=float, default=SIZE)
    given = parser.parse_args()
    text = tables(given.size)
    if given.write is None:
        print(text)
    else:
        given.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
