"""Reduction of a finite-element model to a few shapes of a free body.

Craig-Bampton: static shapes of the interfaces and modes with the interfaces held (R. Craig, M. Bampton, AIAA J. 6
(1968) 1313). Free interface: modes of the free body and static shapes of unit loads at the interfaces with inertia
relief. In both cases rigid motions are taken out, since the frame carries them, and the shapes are made orthonormal: M
= 1, K diagonal. Interfaces held are a means; the result is a free body, whichever joints it gets.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property
from numbers import Integral
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from scipy.sparse.csgraph import connected_components

from gearmbs.flexible.beam import Slices
from gearmbs.flexible.fe_model import SYMMETRIC, FiniteElementModel, MassProperties
from gearmbs.flexible.interfaces import Interface, Resolved, resolve
from gearmbs.flexible.material import FlexibleError
from gearmbs.flexible.modal_model import PAIR, ModalModel, Seat
from gearmbs.mechanism.parts.modal import ShapeIntegrals
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.progress import waiting
from gearmbs.units import Quantity
from gearmbs.wording import warn

# Integrals of shapes over a finite-element body, as the floating frame needs them.
#
# From slices (beams) they are exact sums, rotary inertia included. From the mass matrix of elements whose nodes have
# displacements only they are exact too: such a matrix is a matrix of nodes times the unit matrix, so that the velocity
# field w x (s + phi q), given at the nodes, has its kinetic energy (nodal floating frame of reference formulation, A.
# Zwoelfer, J. Gerstmayr, Acta Mech. 232 (2021) 835). With nodal rotations in a matrix that is not of slices,
# first-order integrals are exact, and those of second order are of the masses and inertias lumped at the nodes.


ROUNDING = 1e-12
"""Share of its largest by which a least moment of inertia may be negative."""


def shape_integrals(model: FiniteElementModel, shapes: np.ndarray, properties: MassProperties) -> ShapeIntegrals:
    """Return the integrals of shapes about the centre of mass.

    Parameters
    ----------
    model : FiniteElementModel
    shapes : ndarray, shape (d, n)
        Vectors of the degrees of freedom.
    properties : MassProperties
    """
    if model.slices is not None:
        return of_slices(model.slices, shapes, properties.com)
    if not model.has_rotations and model.dofs[:, 0].min() >= 0:
        return of_mass_matrix(model, shapes, properties.com)
    lumped = of_lumps(model, shapes, properties)
    rigid = model.rigid_motion(properties.com)
    moved = model.mass @ shapes
    first = rigid.T @ moved
    return ShapeIntegrals(
        shapes.T @ moved, first[:3].T.copy(), first[3:].T.copy(), lumped.cross, lumped.first, lumped.second
    )


def of_slices(slices: Slices, shapes: np.ndarray, com: np.ndarray) -> ShapeIntegrals:
    """Return the integrals of a body made of slices."""
    moved = np.einsum("pid,dk->kpi", slices.moved, shapes, optimize=True)
    turned = np.einsum("pid,dk->kpi", slices.turned, shapes, optimize=True)
    return ShapeIntegrals.of_points(
        slices.mass, slices.position - com, moved, inertias=slices.inertia, rotations=turned
    )


def of_mass_matrix(model: FiniteElementModel, shapes: np.ndarray, com: np.ndarray) -> ShapeIntegrals:
    """Return the integrals of a body whose nodes have displacements only, from its mass matrix."""
    n = shapes.shape[1]
    node, direction = model.dofs[:, 0], model.dofs[:, 1]
    moved, _ = model.field(shapes)
    arm = model.positions - com
    one = np.eye(3)
    # e_c x s and e_c x phi_k as vectors of the degrees of freedom
    turns = np.column_stack([np.cross(one[c], arm)[node, direction] for c in range(3)])
    shifts = np.column_stack([one[c][direction] for c in range(3)])
    crossed = np.stack([np.cross(one[c], moved)[:, node, direction] for c in range(3)])
    m_shapes, m_turns = model.mass @ shapes, model.mass @ turns
    mixed = np.einsum("dc,ekd->kce", m_turns, crossed, optimize=True)
    flat = crossed.reshape(3 * n, -1)
    products = (flat @ (model.mass @ flat.T)).reshape(3, n, 3, n)
    second = np.einsum("ckel->klce", products)
    return ShapeIntegrals(
        shapes.T @ m_shapes,
        m_shapes.T @ shifts,
        m_shapes.T @ turns,
        np.einsum("cld,dk->lkc", crossed, m_shapes, optimize=True),
        mixed + np.swapaxes(mixed, 1, 2),
        second + np.swapaxes(second, 2, 3),
    )


def lumps(model: FiniteElementModel) -> tuple[np.ndarray, np.ndarray]:
    """Return masses and inertias at the nodes: row sums of the mass matrix, and those of its rotational blocks.

    So the shares of a shaft's polar moment that couple neighbours are not lost.

    Returns
    -------
    masses : ndarray, shape (N,)
    inertias : ndarray, shape (N, 3, 3)
    """
    return nodal_lumps(len(model.ids), model.dofs, model.mass)


def nodal_lumps(count: int, dofs: np.ndarray, mass: sp.csc_array) -> tuple[np.ndarray, np.ndarray]:
    """Return masses and inertias at nodes from a mass matrix: see `lumps`.

    Parameters
    ----------
    count : int
        Number of nodes.
    dofs : ndarray of int, shape (d, 2)
        Row of the node and direction 0 to 5 of each degree of freedom; row -1 for generalised coordinates.
    mass : sparse matrix, shape (d, d)
    """
    node, direction = dofs[:, 0], dofs[:, 1]
    masses, inertias = np.zeros((3, count)), np.zeros((count, 3, 3))
    for c in range(3):
        chosen = (direction == c) & (node >= 0)
        row = (mass @ (chosen * 1.0)[:, None])[:, 0]
        np.add.at(masses[c], node[chosen], row[chosen])
    entries = mass.tocoo()
    turning = (node >= 0) & (direction > 2)
    both = turning[entries.row] & turning[entries.col]
    row, column, value = entries.row[both], entries.col[both], entries.data[both]
    np.add.at(inertias, (node[row], direction[row] - 3, direction[column] - 3), value)
    inertias = 0.5 * (inertias + np.swapaxes(inertias, 1, 2))
    # a node's own block is the fallback where its row sum is no inertia
    principal = np.linalg.eigvalsh(inertias)
    odd = principal[:, 0] < -ROUNDING * np.abs(principal).max(axis=1)
    own = (node[row] == node[column]) & odd[node[row]]
    inertias[odd] = 0.0
    inertias[node[row[own]], direction[row[own]] - 3, direction[column[own]] - 3] = value[own]
    return masses.mean(axis=0), inertias


def of_lumps(model: FiniteElementModel, shapes: np.ndarray, properties: MassProperties) -> ShapeIntegrals:
    """Return the integrals of the masses and inertias lumped at the nodes."""
    masses, inertias = lumps(model)
    moved, turned = model.field(shapes)
    return ShapeIntegrals.of_points(
        masses, model.positions - properties.com, moved, inertias=inertias, rotations=turned
    )


DENSE = 900
"""Below so many degrees of freedom matrices are treated as dense."""

USUAL = 20
"""Vibration shapes where nothing else is said: a shaft's first four bends are then right to 0.03 %."""

MULTIPLE = 8
"""Most equal modes: two planes of bending times equal spans between seats."""

SHIFTS = (1e-7, 1e-9)
"""Shifts below zero from which free modes are iterated, against the mean stiffness over the mean mass.

Iterations are few where the shift is below the first elastic mode, as the first is of all bodies but thin ones. A shift
far below it costs digits: the unit roundoff times their ratio, which is 1e-11 for the first of them.
"""

RESTARTS = 8
"""Restarts after which the next shift is tried; three do where the shift is below the first elastic mode."""

METHODS = ("craig-bampton", "free")

GROUNDED = 1e-6
"""Largest share of stiffness, against its diagonal, that rigid motions may meet."""


@waiting("reducing the model")
def reduce_model(
    model: FiniteElementModel,
    interfaces: Iterable[str | Interface] | None = None,
    *,
    modes: int | None = None,
    max_frequency: Quantity = None,
    method: str = "craig-bampton",
    name: str | None = None,
    preload: Any = None,
    spin_stiffness: Any = None,
    long_axis: int = 2,
    relief: bool = False,
) -> ModalModel:
    """Return a modal body made of a finite-element model.

    Parameters
    ----------
    model : FiniteElementModel
        Free: without supports.
    interfaces : iterable of str or Interface, optional
        Where the body is joined and loaded; default: its seats.
    modes : int, optional
        How many vibration shapes, the slowest, are kept beside the static ones, which always are: modes with held
        interfaces, or of the free body; default 20, or all below ``max_frequency``. The body has up to 6 (seats - 1)
        modes more. Of a shaft one more where the last would be one half of a bending pair, for the shaft would get
        an axis of preference.
    max_frequency : float or str, optional
        Vibration shapes above are left out, Hz: take 1.5 to 2 times the highest frequency that matters.
    method : {"craig-bampton", "free"}
    name : str, optional
        Default: that of the model.
    preload : matrix, shape (d, d), optional
        Geometric stiffness of a constant preload, N/m; it acts on deformations, not on rigid motions.
    spin_stiffness : matrix, shape (d, d), optional
        Geometric stiffness by a spin of 1 rad/s across the long axis, N s^2/m; see :meth:`Shaft.spin_stiffness`.
    long_axis : int
        Which axis that is: 0, 1 or 2.
    relief : bool
        Whether responses of the held body to inertia are kept, too: loads at seats then deform it as the whole does.

    Raises
    ------
    FlexibleError
        If the model is held somewhere, is not a body's, or has fewer shapes than asked for.
    """
    if method not in METHODS:
        raise FlexibleError(f"method = {method!r}; choose one of {', '.join(METHODS)}")
    whole = isinstance(modes, Integral) and not isinstance(modes, bool)
    if modes is not None and not (whole and modes >= 1):
        raise FlexibleError(f"modes = {modes!r}; a modal body needs one at least, and a whole number")
    limit = None if max_frequency is None else quantity(max_frequency, "frequency", "max_frequency")
    preload, spin_stiffness = (
        None if given is None else _geometric(model, given, label)
        for given, label in ((preload, "preload"), (spin_stiffness, "spin_stiffness"))
    )
    chosen = list(model.seats if interfaces is None else interfaces)
    parts = resolve(model, chosen)
    properties = model.mass_properties()
    _check_free(model)
    _check_whole(model, [i for i in chosen if isinstance(i, Interface) and i.kind == "rigid"])
    doubts = model.unit_doubts(properties)
    if doubts:
        warn(f"{model.name}: {'; '.join(doubts)}")
    k = sp.csc_array(parts.expand.T @ model.stiffness @ parts.expand)
    m = sp.csc_array(parts.expand.T @ model.mass @ parts.expand)
    rigid = _rigid_of(model, parts)
    held = HeldBody(k, parts.constraints)
    found_values, vibrating = _vibrations(held, m, rigid, method, modes, limit)
    if modes is not None and found_values.size < modes and limit is None:
        raise FlexibleError(
            f"{model.name}: modes = {modes}, but beside its static shapes the model has {found_values.size}; "
            "ask for no more"
        )
    static = None
    if method == "free":
        basis = np.hstack([vibrating, attachment_modes(k, m, rigid, parts.constraints)])
    else:
        static = constraint_modes(held)
        basis = np.hstack([static, vibrating, *([held.scale * held.solve(m @ rigid)] if relief else [])])
    if basis.shape[1] == 0:
        raise FlexibleError(
            f"{model.name}: without interfaces there are no static shapes, and no mode of the free body is below "
            f"max_frequency = {limit} Hz; raise it"
        )
    values, shapes = orthonormal(k, m, basis, rigid)
    if preload is not None:
        full = parts.expand @ shapes
        values, turn = np.linalg.eigh(np.diag(values) + full.T @ (preload @ full))
        if values[0] <= 0.0:
            raise FlexibleError(f"{model.name}: the preload makes it buckle; reduce it")
        shapes = shapes @ turn
    if model.slices is not None:
        shapes = _in_planes(model, parts, values, shapes)
    shapes = _signed(parts, shapes)
    exact = {} if preload is not None else static_flexibility(held, m, rigid, parts, static)
    frequencies = np.sqrt(values) / (2 * np.pi)
    found = as_modal_model(model, parts, properties, frequencies, shapes, name or model.name)
    seats = {key: replace(seat, flexibility=exact.get(key)) for key, seat in found.seats.items()}
    found = replace(found, seats=seats)
    return found if spin_stiffness is None else _stiffened(found, parts.expand @ shapes, spin_stiffness, long_axis)


def _stiffened(found: ModalModel, full: np.ndarray, spin_stiffness: Any, axis: int) -> ModalModel:
    """Return a body whose inertia against spin across an axis falls with its deformation: centrifugal stiffening.

    The Lagrangian has -1/2 w^2 q . G q, and 1/4 w . (J2 q q) w from the second derivative of the inertia.
    """
    geometric = full.T @ (spin_stiffness @ full)
    second = found.integrals.second.copy()
    for across in {0, 1, 2} - {axis}:
        second[:, :, across, across] -= 2.0 * geometric
    return replace(found, integrals=replace(found.integrals, second=second), stiffened=True)


def _signed(parts: Resolved, shapes: np.ndarray) -> np.ndarray:
    """Return shapes whose largest displacement is positive, so that equal models give equal shapes."""
    full = parts.expand @ shapes
    largest = np.argmax(np.abs(full) > 0.999 * np.abs(full).max(axis=0), axis=0)
    return shapes * np.sign(full[largest, np.arange(full.shape[1])])


def _vibrations(
    held: HeldBody, m: sp.csc_array, rigid: np.ndarray, method: str, modes: int | None, limit: float | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return squared circular frequencies and shapes with held interfaces, or of the free body: see `reduce_model`.

    The spaces of more modes hold those of fewer, so that by Rayleigh's quotient no frequency of the body gets worse
    with their number.
    """
    count = modes if modes is not None else USUAL
    while True:
        if method == "free":
            values, shapes = free_modes(held.stiffness, m, rigid, count + MULTIPLE)
        else:
            values, shapes = held_modes(held, m, count + MULTIPLE)
        complete = values.size < count + MULTIPLE
        below = values.size if limit is None else int(np.sum(np.sqrt(values) <= 2 * np.pi * limit))
        if modes is not None or limit is None or below < values.size or complete:
            break
        count *= 2
    if limit is None or modes is not None:
        below = min(below, count)
    while 0 < below < values.size and _same(values, below):
        below += 1
    return values[:below], shapes[:, :below]


def _same(values: np.ndarray, k: int) -> bool:
    """Return whether value k is that before it."""
    return bool(values[k] - values[k - 1] < PAIR * values[k])


def _in_planes(model: FiniteElementModel, parts: Resolved, values: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Turn pairs of equal modes of a shaft so that one bends in the plane xz and the other in yz."""
    lateral = np.asarray(parts.expand @ shapes)[model.dofs[:, 1] == 0]
    out = shapes.copy()
    k = 0
    while k < values.size - 1:
        if values[k + 1] - values[k] < PAIR * values[k + 1]:
            _, _, turn = np.linalg.svd(lateral[:, k : k + 2], full_matrices=False)
            out[:, k : k + 2] = shapes[:, k : k + 2] @ turn.T
            k += 1
        k += 1
    return out


def as_modal_model(
    model: FiniteElementModel, parts: Resolved, properties: MassProperties, frequencies: np.ndarray,
    shapes: np.ndarray, name: str,
) -> ModalModel:  # fmt: skip
    """Return the modal body of orthonormal shapes of the degrees of freedom that the interfaces leave."""
    full = parts.expand @ shapes
    moved, turned = model.field(full)
    held = parts.constraints @ shapes
    seats = {}
    for key, (position, rows) in parts.places.items():
        six = np.zeros((6, shapes.shape[1]))
        six[rows >= 0] = held[rows[rows >= 0]]
        seats[key] = Seat(position, six[:3].T.copy(), six[3:].T.copy(), bool(np.all(rows[3:] >= 0)))
    masses, inertias = lumps(model)
    return ModalModel(
        name=name,
        properties=properties,
        frequencies=frequencies,
        integrals=shape_integrals(model, full, properties),
        ids=model.ids,
        positions=model.positions,
        moved=moved,
        turned=turned if model.has_rotations else None,
        seats=seats,
        faces=model.faces,
        line=model.slices is not None,
        masses=masses,
        inertias=inertias,
        outline=model.outline,
        recovery=model.recovery,
    )


def _check_free(model: FiniteElementModel) -> None:
    """Refuse a model whose rigid motions meet stiffness."""
    about = model.positions.mean(axis=0)
    rigid = model.rigid_motion(about)
    energy = np.abs(np.einsum("dc,dc->c", rigid, model.stiffness @ rigid))
    diagonal = np.abs(model.stiffness.diagonal())
    scale = np.maximum((rigid**2 * diagonal[:, None]).sum(axis=0), 1e-300)
    worst = int(np.argmax(energy / scale))
    if energy[worst] > GROUNDED * scale[worst]:
        motion = ("x", "y", "z", "rotation about x", "rotation about y", "rotation about z")[worst]
        raise FlexibleError(
            f"{model.name}: rigid motion in {motion} meets stiffness ({energy[worst]:.3g} of {scale[worst]:.3g}); a "
            "body in a floating frame must be free: export the matrices without supports, or check node table and units"
        )


def _geometric(model: FiniteElementModel, given: Any, label: str) -> sp.csc_array:
    """Return a geometric stiffness, refused if it is not finite, symmetric and of the model's degrees of freedom."""
    matrix = sp.csc_array(given)
    if matrix.shape != model.stiffness.shape or not np.all(np.isfinite(matrix.data)):
        raise FlexibleError(
            f"{model.name}: {label} has shape {matrix.shape}, or is not finite; give that of the "
            f"{len(model.dofs)} degrees of freedom"
        )
    if abs(matrix - matrix.T).max() > SYMMETRIC * abs(matrix).max():
        raise FlexibleError(f"{model.name}: {label} is not symmetric; give both triangles of the matrix")
    return matrix


def _check_whole(model: FiniteElementModel, faces: list[Interface]) -> None:
    """Refuse a body of several parts that neither elements nor rigid faces join: it has more than six rigid motions."""
    count = len(model.ids)
    node = np.where(model.dofs[:, 0] >= 0, model.dofs[:, 0], count + np.arange(len(model.dofs)))
    rows = [[model.row_of(k) for k in face.nodes] for face in faces]
    tied = [(face[0], k) for face in rows for k in face]
    links = [abs(matrix).tocoo() for matrix in (model.stiffness, model.mass)]
    one = np.concatenate([*(node[c.row] for c in links), [a for a, _ in tied]]).astype(int)
    two = np.concatenate([*(node[c.col] for c in links), [b for _, b in tied]]).astype(int)
    graph = sp.coo_array((np.ones(one.size), (one, two)), shape=(count + len(node),) * 2)
    part = connected_components(graph, directed=False)[1]
    stiff = model.stiffness.diagonal() > 0.0
    parts = np.unique(part[node[stiff & (model.dofs[:, 0] >= 0)]])
    if parts.size > 1:
        first, other = (model.ids[np.flatnonzero(part[:count] == k)[0]] for k in parts[:2])
        raise FlexibleError(
            f"{model.name}: it is in {parts.size} parts, as those of nodes {first} and {other}, which nothing joins; "
            "merge their nodes, join them by one rigid interface, or reduce each by itself"
        )


def _rigid_of(model: FiniteElementModel, parts: Resolved) -> np.ndarray:
    """Return rigid motions in the degrees of freedom that the interfaces leave."""
    gram = sp.csc_matrix(parts.expand.T @ parts.expand)
    return spl.splu(gram).solve(np.asarray(parts.expand.T @ model.rigid_motion()))


class HeldBody:
    """A body with stiffness K (r, r) and interfaces C x, (b, r), that are held: factorised once, when it is asked."""

    def __init__(self, stiffness: sp.csc_array, constraints: sp.csr_array) -> None:
        self.stiffness, self.constraints = stiffness, constraints
        self.scale = float(np.abs(stiffness.diagonal()).mean()) or 1.0

    @cached_property
    def _factor(self) -> Any:
        held = self.scale * self.constraints
        matrix = sp.block_array([[self.stiffness, held.T], [held, None]], format="csc")
        try:
            # of symmetric patterns minimum degree fills less than the default of unsymmetric ones: 0.6 of a housing's
            return spl.splu(sp.csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A")
        except RuntimeError:
            raise FlexibleError(
                "the stiffness with held interfaces is singular: the interfaces leave the body a rigid motion or an "
                "unconnected part; add an interface, or use method='free'"
            ) from None

    def solve(self, loads: npt.ArrayLike, moved: npt.ArrayLike = 0.0) -> np.ndarray:
        """Return the displacements (r, ...) under loads (r, ...) with the interfaces moved by (b, ...)."""
        r, b = self.stiffness.shape[0], self.constraints.shape[0]
        right = np.zeros((r + b, *(np.shape(loads) or np.shape(moved))[1:]))
        right[:r], right[r:] = loads, self.scale * np.asarray(moved)
        return self._factor.solve(right)[:r]


def held_modes(held: HeldBody, m: sp.csc_array, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return squared circular frequencies and shapes with the interfaces held at zero.

    Parameters
    ----------
    held : HeldBody
    m : sparse matrix, shape (r, r)
    count : int
        How many, the slowest.
    """
    k, constraints = held.stiffness, held.constraints
    r, b = k.shape[0], constraints.shape[0]
    if r - b < 1 or count < 1:
        return np.zeros(0), np.zeros((r, 0))
    if b == 0:
        raise FlexibleError("a Craig-Bampton reduction needs interfaces; name them, or use method='free'")
    count = min(count, r - b)
    if r <= DENSE or count > (r - b) // 2:
        z = scipy.linalg.null_space(constraints.toarray()) if b else np.eye(r)
        values, vectors = scipy.linalg.eigh(z.T @ k @ z, z.T @ m @ z, subset_by_index=[0, count - 1])
        return np.maximum(values, 0.0), z @ vectors
    # K^-1 on the space of motions that the constraints allow
    inverse = spl.LinearOperator((r, r), matvec=held.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(r)
    values, vectors = spl.eigsh(k, count, m, sigma=0.0, OPinv=inverse, v0=inverse @ (m @ start))
    order = np.argsort(values)
    return np.maximum(values[order], 0.0), vectors[:, order]


def constraint_modes(held: HeldBody) -> np.ndarray:
    """Return the static shapes in which one interface coordinate is 1 and the others are 0, shape (r, b)."""
    r, b = held.stiffness.shape[0], held.constraints.shape[0]
    return held.solve(0.0, np.eye(b)) if b else np.zeros((r, 0))


def free_modes(k: sp.csc_array, m: sp.csc_array, rigid: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return squared circular frequencies and shapes of the free body, without its rigid motions."""
    r = k.shape[0]
    wanted = min(count + rigid.shape[1], r)
    if r <= DENSE or wanted > r // 2:
        values, vectors = _dense_modes(k.toarray(), m.toarray(), wanted)
    else:
        values, vectors = _shifted_modes(sp.csc_matrix(k), sp.csc_matrix(m), wanted)
    order = np.argsort(values)[rigid.shape[1] :]
    return np.maximum(values[order], 0.0), vectors[:, order]


def _shifted_modes(k: sp.csc_matrix, m: sp.csc_matrix, wanted: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest eigenvalues and vectors, iterated from the first shift below zero that is near enough."""
    stiff = np.abs(k.diagonal()).mean() / max(np.abs(m.diagonal()).mean(), 1e-300)
    start = np.random.default_rng(0).standard_normal(k.shape[0])
    for share in SHIFTS[:-1]:
        with contextlib.suppress(spl.ArpackNoConvergence):
            return spl.eigsh(k, wanted, m, sigma=-share * stiff, v0=start, maxiter=RESTARTS)
    return spl.eigsh(k, wanted, m, sigma=-SHIFTS[-1] * stiff, v0=start)


def _dense_modes(k: np.ndarray, m: np.ndarray, wanted: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest eigenvalues and vectors; of a mass that is only semidefinite those that are finite."""
    try:
        return scipy.linalg.eigh(k, m, subset_by_index=[0, wanted - 1])
    except np.linalg.LinAlgError:
        shift = 1e-4 * np.trace(k) / np.trace(m)
        inverse, vectors = scipy.linalg.eigh(m, k + shift * m)
        kept = np.flatnonzero(inverse > 1e-14 * inverse[-1])[::-1][:wanted]
        return 1.0 / inverse[kept] - shift, vectors[:, kept] / np.sqrt(inverse[kept])


def attachment_modes(k: sp.csc_array, m: sp.csc_array, rigid: np.ndarray, constraints: sp.csr_array) -> np.ndarray:
    """Return static shapes of unit loads at the interfaces, balanced by the inertia of the rigid body."""
    b = constraints.shape[0]
    if b == 0:
        return np.zeros((k.shape[0], 0))
    inertial = m @ rigid
    loads = constraints.T.toarray()
    balanced = loads - inertial @ np.linalg.solve(rigid.T @ inertial, rigid.T @ loads)
    # any solution of the singular system will do: rigid motions are taken out afterwards
    return HeldBody(k, sp.csr_array(inertial.T / np.abs(inertial).max())).solve(balanced)


def static_flexibility(
    held: HeldBody, m: sp.csc_array, rigid: np.ndarray, parts: Resolved, static: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """Return how each seat of the free body moves and turns by unit loads there, (6, 6); NaN where it does not.

    With the static shapes of the interfaces, if they are given, no more is solved than the responses of the held body
    to the inertia of rigid motions: loads at the seats, balanced by inertia, deform the body in the span of both.
    """
    if not parts.places:
        return {}
    k, inertial = held.stiffness, m @ rigid
    if static is None:
        shapes = attachment_modes(k, m, rigid, parts.constraints)
    else:
        span = np.hstack([static, held.solve(inertial)])
        span = span - rigid @ np.linalg.solve(rigid.T @ inertial, inertial.T @ span)
        span /= np.linalg.norm(span, axis=0).clip(min=1e-300)
        loads = parts.constraints @ span
        shapes = span @ np.linalg.lstsq(span.T @ (k @ span), loads.T, rcond=1e-13)[0]
    shapes = shapes - rigid @ np.linalg.solve(rigid.T @ inertial, inertial.T @ shapes)
    whole = parts.constraints @ shapes
    out = {}
    for key, (_, rows) in parts.places.items():
        six, there = np.full((6, 6), np.nan), rows >= 0
        six[np.ix_(there, there)] = whole[np.ix_(rows[there], rows[there])]
        out[key] = six
    return out


def orthonormal(
    k: sp.csc_array, m: sp.csc_array, basis: np.ndarray, rigid: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return squared circular frequencies and shapes of a basis, without rigid motions, orthonormal in the mass.

    Parameters
    ----------
    k, m : sparse matrix, shape (r, r)
    basis : ndarray, shape (r, n)
    rigid : ndarray, shape (r, 6)
    """
    inertial = m @ rigid
    basis = basis - rigid @ np.linalg.solve(rigid.T @ inertial, inertial.T @ basis)
    size = np.sqrt(np.maximum(np.einsum("rn,rn->n", basis, m @ basis), 0.0))
    basis = basis[:, size > 1e-12 * size.max()] / size[size > 1e-12 * size.max()]
    # the basis contains combinations without deformation: drop what has no length
    weight, turn = np.linalg.eigh(basis.T @ (m @ basis))
    good = weight > 1e-10 * weight[-1]
    basis = basis @ (turn[:, good] / np.sqrt(weight[good]))
    values, vectors = scipy.linalg.eigh(basis.T @ (k @ basis))
    shapes = basis @ vectors
    return np.maximum(values, 0.0), shapes
