"""Solid finite elements of simple bodies, meshed and assembled by scikit-fem: no file is needed to try one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from gearmbs.flexible.fe_model import FiniteElementModel
from gearmbs.flexible.interfaces import Interface
from gearmbs.flexible.material import STEEL, ElasticMaterial, FlexibleError
from gearmbs.flexible.matrix_files import from_matrices
from gearmbs.flexible.modal_model import ModalModel
from gearmbs.flexible.reduction import reduce_model
from gearmbs.flexible.stress import SolidStresses
from gearmbs.mechanism.parts.quantities import quantities, quantity
from gearmbs.units import Quantity

if TYPE_CHECKING:
    import skfem

CORNERS = ((0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 0), (1, 1, 1))
"""Corners of scikit-fem's hexahedron in its order."""


def _skfem() -> Any:
    try:
        import skfem
    except ImportError:
        raise FlexibleError(
            "meshes of solids are assembled by scikit-fem; install it with 'pip install gearmbs[fem]'"
        ) from None
    return skfem


ORDER = 5
"""Degree of polynomials that are integrated exactly: products of slopes of elements of second order without skew."""

AT_ONCE = 64
"""Elements whose matrices are made at once: some megabytes, which stay in the cache."""


def solid_model(
    mesh: skfem.Mesh, material: ElasticMaterial = STEEL, *, name: str = "solid", quadratic: bool = True
) -> FiniteElementModel:
    """Return the finite elements of any mesh of hexahedra or tetrahedra, with consistent mass.

    Parameters
    ----------
    mesh : skfem.MeshHex or skfem.MeshTet
        In metres; meshio reads what other programs write.
    material : ElasticMaterial
    name : str
    quadratic : bool
        Elements of second order. Those of first order are much too stiff in bending.

    Raises
    ------
    FlexibleError
        If scikit-fem is not installed, or for another mesh.
    """
    fem = _skfem()
    kinds = {
        "MeshHex1": (fem.ElementHex1, fem.ElementHex2), "MeshTet1": (fem.ElementTetP1, fem.ElementTetP2),
        "MeshHex2": (fem.ElementHex1, fem.ElementHex2), "MeshTet2": (fem.ElementTetP1, fem.ElementTetP2),
    }  # fmt: skip
    if type(mesh).__name__ not in kinds:
        raise FlexibleError(f"{name}: a mesh of {type(mesh).__name__}; give one of hexahedra or tetrahedra")
    element = kinds[type(mesh).__name__][int(quadratic)]()
    basis = fem.Basis(mesh, fem.ElementVector(element), intorder=ORDER)
    k, m = _matrices(basis, fem.Basis(mesh, element, intorder=ORDER), material)
    # degrees of freedom come in threes, one for each direction at one place
    places = basis.doflocs[:, ::3].T
    dofs = np.column_stack([np.repeat(np.arange(1, len(places) + 1), 3), np.tile([1, 2, 3], len(places))])
    facets = mesh.facets[:, mesh.boundary_facets()].T
    found = from_matrices(k, m, places, dofs=dofs, name=name, faces=facets)
    return replace(found, recovery=SolidStresses(basis, element, material))


def _matrices(basis: skfem.Basis, shapes: skfem.Basis, material: ElasticMaterial) -> tuple[Any, Any]:
    """Return the matrices of stiffness and mass, for all elements of a part at once.

    With displacements phi_a e_i and phi_b e_j, and B_aibj the integral of d_i phi_a d_j phi_b over an element, the
    entry of its stiffness is lambda B_aibj + mu (B_ajbi + delta_ij sum_k B_akbk), that of its mass
    rho delta_ij times the integral of phi_a phi_b. scikit-fem's own assembly asks for one entry after the other:
    27 nodes make 6561 calls, of which the box of a gearbox takes 3.5 s, and 0.65 so.

    Parameters
    ----------
    basis, shapes : skfem.Basis
        Of displacements, which are the shapes in three directions, node by node, and of the shapes.
    material : ElasticMaterial
    """
    mu = material.shear_modulus
    nu = material.poisson_ratio
    lame = material.youngs_modulus * nu / ((1 + nu) * (1 - 2 * nu))
    count = len(shapes.basis)
    elements, points = shapes.dx.shape
    same = np.eye(3)
    stiffness, mass = (np.empty((elements, 3 * count, 3 * count)) for _ in range(2))
    for first in range(0, elements, AT_ONCE):
        part = slice(first, first + AT_ONCE)
        weights = shapes.dx[part, None, :]
        # shape, direction, element, point
        slopes = np.array([np.broadcast_to(one[0].grad, (3, elements, points))[:, part] for one in shapes.basis])
        values = np.array([np.broadcast_to(np.asarray(one[0]), (elements, points))[part] for one in shapes.basis])
        slopes = np.moveaxis(slopes, 2, 0).reshape(-1, 3 * count, points)
        values = np.moveaxis(values, 1, 0)
        square = (slopes * weights @ slopes.transpose(0, 2, 1)).reshape(-1, count, 3, count, 3)
        both = np.einsum("eakbk->eab", square)
        found = lame * square + mu * np.swapaxes(square, 2, 4) + mu * both[:, :, None, :, None] * same[:, None]
        stiffness[part] = found.reshape(-1, 3 * count, 3 * count)
        heavy = material.density * (values * weights @ values.transpose(0, 2, 1))
        mass[part] = (heavy[:, :, None, :, None] * same[:, None]).reshape(-1, 3 * count, 3 * count)
    places = basis.element_dofs.T
    rows = np.repeat(places, 3 * count, axis=1).ravel()
    columns = np.tile(places, 3 * count).ravel()
    return tuple(sp.coo_array((x.ravel(), (rows, columns)), shape=(basis.N,) * 2).tocsr() for x in (stiffness, mass))


def block_mesh(size: npt.ArrayLike, divisions: tuple[int, int, int] = (4, 4, 4)) -> skfem.MeshHex:
    """Return the mesh of a block from the origin to ``size`` (m, or texts with units)."""
    fem = _skfem()
    lengths = quantities(size, "length", "block_mesh: size")
    if lengths.shape != (3,) or np.any(lengths <= 0.0):
        raise FlexibleError(f"block_mesh: size = {size!r}; give three positive lengths")
    return fem.MeshHex.init_tensor(*(np.linspace(0.0, a, n + 1) for a, n in zip(lengths, divisions)))


def ring_mesh(
    inner: Quantity, outer: Quantity, width: Quantity, divisions: tuple[int, int, int] = (2, 48, 2)
) -> skfem.MeshHex:
    """Return the mesh of a ring about z between two diameters, centred on the origin: a rim, a ring gear's body.

    Parameters
    ----------
    inner, outer, width : float or str
        m.
    divisions : tuple of 3 ints
        Elements over the thickness, round about, and over the width.
    """
    a, b, w = (
        quantity(v, "length", f"ring_mesh: {n}") for v, n in ((inner, "inner"), (outer, "outer"), (width, "width"))
    )
    if not (0.0 < a < b and w > 0.0):
        raise FlexibleError(f"ring_mesh: inner {a}, outer {b}, width {w} m; give 0 < inner < outer and a width")
    radial, around, across = divisions
    return revolved_mesh(np.linspace(a / 2, b / 2, radial + 1), np.linspace(-w / 2, w / 2, across + 1), around)


def revolved_mesh(
    radii: np.ndarray, heights: np.ndarray, around: int, keep: Callable[[float, float], bool] | None = None
) -> skfem.MeshHex:
    """Return the mesh of a body of revolution about z, whose section is made of rectangles.

    Parameters
    ----------
    radii, heights : ndarray
        Rising places of the corners of the elements, m.
    around : int
        Elements round about; their faces are flat, so that the body is a prism.
    keep : callable, optional
        From radius and height of an element's middle to whether it is there; default: all are.
    """
    radial, across = len(radii) - 1, len(heights) - 1
    angle = np.arange(around) * 2 * np.pi / around
    r, t, h = (x.ravel() for x in np.meshgrid(radii, angle, heights, indexing="ij"))
    points = np.vstack([r * np.cos(t), r * np.sin(t), h])

    def number(i, j, k):
        return (i * around + j % around) * (across + 1) + k

    def is_there(i, k):
        return keep is None or keep(0.5 * (radii[i] + radii[i + 1]), 0.5 * (heights[k] + heights[k + 1]))

    cells = [
        [number(i + p, j + q, k + s) for p, q, s in CORNERS]
        for i in range(radial)
        for j in range(around)
        for k in range(across)
        if is_there(i, k)
    ]
    return used_part(points, np.array(cells))


def used_part(points: np.ndarray, cells: np.ndarray) -> skfem.MeshHex:
    """Return the mesh of hexahedra, shape (m, 8), with those of the points, shape (3, n), that they use."""
    used, numbers = np.unique(cells, return_inverse=True)
    return _skfem().MeshHex(points[:, used], numbers.reshape(cells.shape).T)


def nodes_where(model: FiniteElementModel, condition: Callable[..., np.ndarray]) -> list[int]:
    """Return the numbers of the nodes at which a condition on x, y and z (arrays, m) holds: the face of an interface.

    Raises
    ------
    FlexibleError
        If it holds nowhere.
    """
    chosen = np.flatnonzero(np.asarray(condition(*model.positions.T), dtype=bool))
    if chosen.size == 0:
        low, high = model.positions.min(axis=0), model.positions.max(axis=0)
        raise FlexibleError(f"{model.name}: no node meets the condition; nodes are between {low} and {high} m")
    return [int(k) for k in model.ids[chosen]]


# Wheels, carriers and housings of few dimensions, meshed, assembled and reduced: no file is needed to try them.


TOUCHES = 1e-6
"""Distance from a face, in sizes of the body, up to which a node is on it."""


def thin_rimmed_wheel(
    bore: Quantity,
    hub: Quantity,
    rim: Quantity,
    outer: Quantity,
    width: Quantity,
    web: Quantity,
    *,
    modes: int | None = None,
    around: int = 24,
    material: ElasticMaterial = STEEL,
    name: str = "wheel",
) -> ModalModel:
    """Return a wheel with a web that is thinner than hub and rim, about z, centred on the origin.

    Its seats are ``"bore"``, whose face moves as a rigid body, and ``"rim"``, which follows the outer face on average:
    the place of the teeth; both are at the origin, so that markers are made by :meth:`ModalModel.seat_marker`. A rim
    that turns and shifts against its hub is what a thin web adds to a rigid wheel; modes with two and more waves round
    about are in the model, but a single seat does not feel them.

    Parameters
    ----------
    bore, hub, rim, outer : float or str
        Diameters, m: of the bore, of the hub, inside the rim, and outside (the root circle of the teeth).
    width, web : float or str
        Of hub and rim, and the thickness of the web in their middle, m.
    modes : int, optional
        Shapes with held seats that are kept beside the static ones, see `reduce_model`; default 20.
    around : int
        Elements round about.
    material : ElasticMaterial
    name : str

    Raises
    ------
    FlexibleError
        If the diameters do not rise or the web is not thinner than the rim is wide; if scikit-fem is not installed.
    """
    a, b, c, d = _rising("thin_rimmed_wheel", bore=bore, hub=hub, rim=rim, outer=outer)
    w = quantity(width, "length", "thin_rimmed_wheel: width")
    t = quantity(web, "length", "thin_rimmed_wheel: web")
    if not 0.0 < t < w:
        raise FlexibleError(f"thin_rimmed_wheel: web = {t} m, width = {w} m; a web is thinner than its rim is wide")
    radii = np.array([a, b, 0.5 * (b + c), c, d]) / 2
    mesh = revolved_mesh(radii, np.array([-w, -t, t, w]) / 2, around, lambda r, z: abs(z) < t / 2 or not b < 2 * r < c)
    model = solid_model(mesh, material, name=name)
    seats = [
        Interface("bore", _on_cylinder(model, a / 2, around), at=(0.0, 0.0, 0.0)),
        Interface("rim", _on_cylinder(model, d / 2, around), "average", at=(0.0, 0.0, 0.0)),
    ]
    return reduce_model(model, seats, modes=modes)


def planet_carrier(
    bore: Quantity,
    outer: Quantity,
    width: Quantity,
    pins: int,
    pin_circle: Quantity,
    pin: Quantity,
    *,
    modes: int | None = None,
    material: ElasticMaterial = STEEL,
    name: str = "carrier",
) -> ModalModel:
    """Return a disc that carries planets on pins, about z, centred on the origin, the first pin on x.

    Its seats are ``"bore"``, whose face moves as a rigid body, and ``"pin 1"`` and so on, which follow the disc on
    average where the pins are pressed in.

    Parameters
    ----------
    bore, outer, width : float or str
        Diameters and thickness of the disc, m.
    pins : int
        Number of pins.
    pin_circle, pin : float or str
        Diameters of the circle of the pins and of a pin, m.
    modes : int, optional
        Shapes with held seats that are kept beside the static ones, see `reduce_model`; default 20.
    material : ElasticMaterial
    name : str

    Raises
    ------
    FlexibleError
        If the pins do not fit on the disc; if scikit-fem is not installed.
    """
    a, d = _rising("planet_carrier", bore=bore, outer=outer)
    w, circle, p = (
        quantity(v, "length", f"planet_carrier: {n}")
        for n, v in (("width", width), ("pin_circle", pin_circle), ("pin", pin))
    )
    if pins < 1 or not (w > 0.0 and p > 0.0 and circle - p > a and circle + p < d):
        raise FlexibleError(
            f"planet_carrier: {pins} pins of {p} m on a circle of {circle} m do not fit between {a} and {d} m"
        )
    if pins > 1 and circle * np.sin(np.pi / pins) <= p:
        raise FlexibleError(
            f"planet_carrier: {pins} pins of {p} m on a circle of {circle} m overlap; they are "
            f"{circle * np.sin(np.pi / pins):.4g} m apart"
        )
    around = pins * int(np.ceil(24 / pins))
    radii = np.unique(np.array([a, circle - p, circle, circle + p, d]) / 2)
    model = solid_model(revolved_mesh(radii, np.array([-w, w]) / 2, around), material, name=name)
    seats = [Interface("bore", _on_cylinder(model, a / 2, around), at=(0.0, 0.0, 0.0))]
    reach = 0.5 * p * (1 + TOUCHES)
    for k in range(pins):
        turn = 2 * np.pi * k / pins
        x0, y0 = 0.5 * circle * np.cos(turn), 0.5 * circle * np.sin(turn)
        nodes = nodes_where(model, lambda x, y, _, x0=x0, y0=y0: np.hypot(x - x0, y - y0) <= reach)
        seats.append(Interface(f"pin {k + 1}", nodes, "average", at=(x0, y0, 0.0)))
    return reduce_model(model, seats, modes=modes)


def box_housing(
    size: npt.ArrayLike,
    wall: Quantity,
    bearings: Sequence[Sequence[Quantity]],
    bearing: Quantity,
    *,
    divisions: tuple[int, int, int] = (6, 4, 4),
    modes: int | None = 10,
    material: ElasticMaterial = STEEL,
    name: str = "housing",
) -> ModalModel:
    """Return a box, open on top, whose end walls across z carry bearings, on four mounts below.

    Its seats are ``"bearing 1 front"`` (at z = 0) and ``"bearing 1 back"`` and so on, which follow the wall on average
    within the diameter of the bearing, and ``"mount 1"`` to ``"mount 4"`` at the corners of the bottom, likewise.

    Parameters
    ----------
    size : array_like of 3 floats or str
        Outer width (x), height (y) and length (z), m, from the origin.
    wall : float or str
        Thickness of all walls, m.
    bearings : sequence of pairs of float or str
        x and y of the axes, m.
    bearing : float or str
        Outer diameter of the bearings, m.
    divisions : tuple of 3 ints
        Elements between the walls.
    modes : int, optional
        Shapes with held seats that are kept beside the static ones, see `reduce_model`; 20 if None.
    material : ElasticMaterial
    name : str

    Raises
    ------
    FlexibleError
        If walls or bearings do not fit; if scikit-fem is not installed.
    """
    x, y, z, t = _box(size, wall, "box_housing")
    reach = 0.5 * quantity(bearing, "length", "box_housing: bearing")
    axes = quantities(bearings, "length", "box_housing: bearings").reshape(-1, 2)
    for u, v in axes:
        if not (t + reach <= u <= x - t - reach and t + reach <= v <= y - reach):
            raise FlexibleError(f"box_housing: a bearing of {2 * reach} m at ({u}, {v}) m is not inside the end walls")
    for k, (u, v) in enumerate(axes):
        apart = np.hypot(*(axes[:k] - (u, v)).T)
        if apart.size and apart.min() < 2 * reach:
            other = axes[int(np.argmin(apart))]
            raise FlexibleError(
                f"box_housing: bearings of {2 * reach} m at ({u}, {v}) m and ({other[0]}, {other[1]}) m overlap; they "
                f"are {apart.min():.4g} m apart"
            )
    model = box_model((x, y, z), t, divisions=divisions, material=material, name=name)
    return reduce_model(model, _housing_seats(model, (x, z), t, axes, reach), modes=modes)


def _box(size: npt.ArrayLike, wall: Quantity, label: str) -> tuple[float, float, float, float]:
    """Return width, height, length and wall of a box, m, checked."""
    x, y, z = (float(v) for v in quantities(size, "length", f"{label}: size"))
    t = quantity(wall, "length", f"{label}: wall")
    if not 0.0 < 2 * t < min(x, z) or not t < y:
        raise FlexibleError(f"{label}: walls of {t} m do not fit into {x} x {y} x {z} m")
    return x, y, z, t


def box_model(
    size: npt.ArrayLike,
    wall: Quantity,
    *,
    divisions: tuple[int, int, int] = (6, 4, 4),
    material: ElasticMaterial = STEEL,
    name: str = "housing",
) -> FiniteElementModel:
    """Return the finite elements of a box, open on top (y), of which `box_housing` makes a body.

    Parameters
    ----------
    size : array_like of 3 floats or str
        Outer width (x), height (y) and length (z), m, from the origin.
    wall : float or str
        Thickness of all walls, m.
    divisions : tuple of 3 ints
        Elements between the walls.
    material : ElasticMaterial
    name : str

    Raises
    ------
    FlexibleError
        If the walls do not fit; if scikit-fem is not installed.
    """
    x, y, z, t = _box(size, wall, "box_model")
    places = [
        np.concatenate([[0.0], np.linspace(t, x - t, divisions[0] + 1), [x]]),
        np.concatenate([[0.0], np.linspace(t, y, divisions[1] + 1)]),
        np.concatenate([[0.0], np.linspace(t, z - t, divisions[2] + 1), [z]]),
    ]
    counts = [len(p) for p in places]
    points = np.vstack([p.ravel() for p in np.meshgrid(*places, indexing="ij")])
    cells = [
        [((i + p) * counts[1] + j + q) * counts[2] + k + s for p, q, s in CORNERS]
        for i in range(counts[0] - 1)
        for j in range(counts[1] - 1)
        for k in range(counts[2] - 1)
        if i in (0, counts[0] - 2) or j == 0 or k in (0, counts[2] - 2)
    ]
    return solid_model(used_part(points, np.array(cells)), material, name=name)


def _housing_seats(
    model: FiniteElementModel, ground: tuple[float, float], wall: float, axes: np.ndarray, reach: float
) -> list[Interface]:
    """Return the interfaces of a box: bearings in both end walls, mounts at the corners of the bottom."""
    width, length = ground
    seats = []
    for number, (u, v) in enumerate(axes, 1):
        for side, middle in (("front", 0.5 * wall), ("back", length - 0.5 * wall)):

            def seated(x, y, z, u=u, v=v, middle=middle):
                return (np.hypot(x - u, y - v) <= reach) & (np.abs(z - middle) <= 0.5 * wall * (1 + TOUCHES))

            seats.append(
                Interface(f"bearing {number} {side}", nodes_where(model, seated), "average", at=(u, v, middle))
            )
    corners = [(u, w) for u in (0.5 * wall, width - 0.5 * wall) for w in (0.5 * wall, length - 0.5 * wall)]
    for number, (u, w) in enumerate(corners, 1):

        def below(x, y, z, u=u, w=w):
            near = 0.5 * wall * (1 + TOUCHES)
            return (np.abs(x - u) <= near) & (np.abs(z - w) <= near) & (y <= TOUCHES * wall)

        seats.append(Interface(f"mount {number}", nodes_where(model, below), "average", at=(u, 0.0, w)))
    return seats


def _rising(label: str, **diameters: Quantity) -> list[float]:
    """Return diameters that have to rise, m."""
    found = [quantity(v, "length", f"{label}: {n}") for n, v in diameters.items()]
    if not all(x < y for x, y in zip([0.0, *found], found)):
        text = ", ".join(f"{n} = {v} m" for n, v in zip(diameters, found))
        raise FlexibleError(f"{label}: {text}; the diameters must rise from a positive one")
    return found


def _on_cylinder(model: FiniteElementModel, radius: float, around: int) -> list[int]:
    """Return the nodes on the flat faces that stand for a cylinder about z."""
    flat = radius * np.cos(np.pi / around)
    return nodes_where(
        model,
        lambda x, y, _: (np.hypot(x, y) <= radius * (1 + TOUCHES)) & (np.hypot(x, y) >= flat * (1 - TOUCHES)),
    )
