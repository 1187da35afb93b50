"""Solid finite elements of simple bodies, meshed and assembled by scikit-fem: no file is needed to try one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gearmbs.flexible.errors import FlexibleError
from gearmbs.flexible.fe_model import FiniteElementModel
from gearmbs.flexible.material import STEEL, ElasticMaterial
from gearmbs.flexible.matrices import from_matrices
from gearmbs.flexible.stress_recovery import SolidStresses
from gearmbs.mechanism.quantities import quantities, quantity
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
    from skfem.helpers import ddot, dot, eye, sym_grad, trace

    shear = material.shear_modulus
    lame = material.youngs_modulus * material.poisson_ratio
    lame = lame / ((1 + material.poisson_ratio) * (1 - 2 * material.poisson_ratio))

    @fem.BilinearForm
    def stiffness(u, v, _):
        strain = sym_grad(u)
        return ddot(2.0 * shear * strain + lame * eye(trace(strain), 3), sym_grad(v))

    @fem.BilinearForm
    def inertia(u, v, _):
        return material.density * dot(u, v)

    element = kinds[type(mesh).__name__][int(quadratic)]()
    basis = fem.Basis(mesh, fem.ElementVector(element), intorder=5)
    k, m = stiffness.assemble(basis), inertia.assemble(basis)
    # degrees of freedom come in threes, one for each direction at one place
    places = basis.doflocs[:, ::3].T
    dofs = np.column_stack([np.repeat(np.arange(1, len(places) + 1), 3), np.tile([1, 2, 3], len(places))])
    facets = mesh.facets[:, mesh.boundary_facets()].T
    found = from_matrices(k, m, places, dofs=dofs, name=name, faces=facets)
    return replace(found, recovery=SolidStresses(basis, element, material))


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


def nodes_where(model: FiniteElementModel, condition) -> list[int]:
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
