"""Modes of Nastran's op2 files, with masses of their grid points, as the content of a modal neutral file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from gearmbs.flexible.material import FlexibleError
from gearmbs.flexible.matrix_files import FileUnits, Path_
from gearmbs.flexible.mnf_content import SI, ModalNeutralFile
from gearmbs.flexible.nastran import GridTable, block_records, op2_tables, pyyeti_module, word_kinds
from gearmbs.flexible.nastran_masses import bulk_table, element_masses
from gearmbs.flexible.reduction import nodal_lumps
from gearmbs.flexible.stress import COMPONENTS, StressModes
from gearmbs.units import Quantity
from gearmbs.wording import warn

# Stresses of the modes of Nastran's op2 files, at the grid points of solid elements.


BLOCKS = ("OES1X1", "OES1X", "OES1")
"""Data blocks of stresses, in which each mode and kind of element has an identification and a record."""
SOLIDS = {39: ("CTETRA", 4), 67: ("CHEXA", 8), 68: ("CPENTA", 6), 255: ("CPYRAM", 5)}
"""Names and corners of elements by their number in a data block."""
STRESS_IDENTIFICATION = 146
"""Words of an identification."""
ELEMENT, PLACE = 4, 21
"""Words of an element (number, coordinate system, kind, corners) and of each of its places: the centre, the corners."""
NUMBERS = [1, 9, 15, 2, 10, 16]
"""Words of a place that hold the stresses xx, yy, zz, xy, yz, zx; the first word is the grid point."""


def read_op2_stresses(path: Path_, *, length: Quantity = 1.0, force: Quantity = 1.0) -> StressModes:
    """Return the stresses of the modes of a Nastran op2 file, as ``STRESS(PLOT)=ALL`` writes them in SOL 103.

    They are those at the corners of solid elements (CHEXA, CPENTA, CPYRAM, CTETRA) in the basic coordinate system. A
    grid point has the mean of its elements. :func:`read_op2_modes` puts them on the body (``stresses=True``).

    Parameters
    ----------
    path : str or Path
        With grid points, as for :func:`read_op2_modes`, and stresses (OES1X1 or OES1).
    length, force : float or str
        The file's units: SI values, or names as ``"mm"``.

    Returns
    -------
    StressModes
        By one unit of each mode of the file, at the grid points that solid elements have at their corners.

    Warns
    -----
    UserWarning
        If there are stresses of other elements, which are left out.

    Raises
    ------
    FlexibleError
        If pyyeti is not installed, the file is cut off, has no such stresses, or they are in other coordinate systems.
    """
    file = Path(path)
    length, force, _ = FileUnits.of(length, force)
    return grid_stresses(file, op2_tables(file, [])["grids"], length, force)


def grid_stresses(file: Path, table: GridTable, length: float, force: float) -> StressModes:
    """Return the stresses of a file whose grid points are known, SI."""
    modes: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
    others: dict[int, int] = {}
    for kind, mode, words in _records(file):
        if kind in SOLIDS:
            modes.setdefault(mode, []).append(_places(file, kind, mode, words))
        else:
            others[kind] = mode
    if not modes:
        raise FlexibleError(
            f"{file.name}: it has no stresses of solid elements ({', '.join(BLOCKS)}); ask for STRESS(PLOT)=ALL"
        )
    for kind, mode in others.items():
        if mode not in modes:
            raise FlexibleError(f"{file.name}: mode {mode} has stresses of elements of type {kind} and none of solids")
    if others:
        kinds = ", ".join(str(kind) for kind in sorted(others))
        warn(
            f"{file.name}: stresses of elements that are no solids (types {kinds} of Nastran) are left out",
        )
    grids = [np.concatenate([g for g, _ in parts]) for parts in modes.values()]
    for mode, own in zip(modes, grids):
        if not np.array_equal(own, grids[0]):
            raise FlexibleError(
                f"{file.name}: mode {mode} has stresses of other elements than mode {next(iter(modes))}; ask for all"
            )
    ids, place, shared = np.unique(grids[0], return_inverse=True, return_counts=True)
    rows = {int(number): k for k, number in enumerate(table.ids)}
    unknown = [int(k) for k in ids if int(k) not in rows]
    if unknown:
        raise FlexibleError(f"{file.name}: stresses are at grid point {unknown[0]}, which GEOM1 does not have")
    values = np.zeros((len(modes), len(ids), len(COMPONENTS)))
    for k, parts in enumerate(modes.values()):
        np.add.at(values[k], place, np.concatenate([stress for _, stress in parts]))
    values *= (force / length**2) / shared[:, None]
    if not np.all(np.isfinite(values)):
        raise FlexibleError(f"{file.name}: stresses at {ids[~np.isfinite(values).all(axis=(0, 2))][0]} are not finite")
    return StressModes(table.positions[[rows[int(k)] for k in ids]] * length, values)


def _records(file: Path) -> list[tuple[int, int, np.ndarray]]:
    """Return kind of element, mode and words, as whole numbers by elements, of each record of stresses."""
    out: list[tuple[int, int, np.ndarray]] = []
    op2 = pyyeti_module("op2", "op2")
    with op2.OP2(str(file)) as opened:
        for name in (name for name in BLOCKS if name in opened.dbnames):
            if len(opened.dbnames[name]) > 1:
                raise FlexibleError(f"{file.name}: {name} is there more than once; write one subcase")
            opened.set_position(name)
            opened.rdop2nt()
            while (head := opened.rdop2record("bytes")) is not None:
                data = opened.rdop2record("bytes")
                out.append(_record(file, name, head, data))
    seen = [record[:2] for record in out]
    for record in seen:
        if seen.count(record) > 1:
            raise FlexibleError(f"{file.name}: mode {record[1]} has its stresses twice; write one subcase")
    return out


def _record(file: Path, name: str, head: bytes, data: bytes | None) -> tuple[int, int, np.ndarray]:
    """Return kind of element, mode and words of one record, checked against its identification."""
    word = len(head) // STRESS_IDENTIFICATION
    if len(head) != STRESS_IDENTIFICATION * word or word not in (4, 8) or data is None:
        raise FlexibleError(f"{file.name}: {name} has an identification of {len(head)} bytes, or no stresses after it")
    # the table's code is small in the right order only
    order = min("<>", key=lambda o: abs(int(np.frombuffer(head, f"{o}i{word}", 2)[1])))
    words = np.frombuffer(head, f"{order}i{word}")
    code, kind, mode, real, wide = (int(words[k]) for k in (1, 2, 4, 8, 9))
    if code != 5 or real != 1 or kind < 1:
        raise FlexibleError(
            f"{file.name}: {name} has a table of code {code}, format {real}, where 5 and 1 are stresses of real modes, "
            "mode by mode; ask for STRESS(PLOT,SORT1,REAL)=ALL in SOL 103"
        )
    if wide < 1 or len(data) % (wide * word):
        raise FlexibleError(f"{file.name}: {name}: {len(data)} bytes are no elements of {wide} words")
    return kind, mode, np.frombuffer(data, f"{order}i{word}").reshape(-1, wide)


def _places(file: Path, kind: int, mode: int, words: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return grid points and stresses at the corners of elements of one kind."""
    name, corners = SOLIDS[kind]
    if words.shape[1] != ELEMENT + PLACE * (corners + 1):
        raise FlexibleError(
            f"{file.name}: mode {mode}: {name} has {words.shape[1]} words, {ELEMENT + PLACE * (corners + 1)} hold the "
            "stresses at centre and corners"
        )
    skew = np.flatnonzero(words[:, 1] != 0)
    if skew.size:
        raise FlexibleError(
            f"{file.name}: stresses of {name} {words[skew[0], 0] // 10} are in coordinate system {words[skew[0], 1]}; "
            "leave CORDM of its PSOLID blank, or 0, for the basic one"
        )
    places = words[:, ELEMENT:].reshape(len(words), corners + 1, PLACE)[:, 1:]
    stress = places.view(places.dtype.str.replace("i", "f"))[..., NUMBERS]
    return places[..., 0].ravel(), stress.reshape(-1, len(COMPONENTS)).astype(float)


MODES = ("OUGV1", "OUGV1PAT", "OUG1", "OPHIG")
"""Data blocks of mode shapes, in displacement coordinate systems."""
BASIC_MODES = ("BOUGV1", "BOPHIG")
"""The same in the basic coordinate system."""
IDENTIFICATION, GRID_POINT = 146, 1
"""Words before the shapes of a mode, and the kind of point that has six displacements; scalar points are 2."""
REAL_MODES = 2
EIGENVALUE = 5
"""Word of an identification that holds it."""
ANALYSES = {
    1: "statics", 5: "frequency responses", 6: "a transient", 7: "prebuckling", 8: "buckling", 9: "complex modes",
    10: "nonlinear statics",
}  # fmt: skip
"""Approach code, tenths of the first word of an identification (DMAP guide)."""
OTHER_EIGENVALUES = (("CLAMA", "complex modes"), ("BLAMA", "buckling"))
ORTHOGONAL = 1e-3
"""Largest deviation of modes from orthogonality in the mass matrix, whose numbers have 4 bytes."""
RESTING = 1.0
"""Eigenvalue below zero, rad^2/s^2, up to which it is the rounding of a rigid motion: 0.16 Hz."""
SLOWEST = 10
"""Modes whose generalised mass is compared with that of the elements: faster ones live in rotations without a mass."""
LUMPED = 2.0
"""Factor between the first generalised mass and that of lumped masses, where elements have consistent ones."""
SAME_MASS = 1e-3
"""Relative difference of the masses given from the mass that the file prints."""


def read_op2_modes(
    path: Path_,
    masses: Any = None,
    *,
    bulk: Path_ | None = None,
    inertias: npt.ArrayLike | None = None,
    length: Quantity = 1.0,
    mass_unit: Quantity = 1.0,
    stresses: bool = False,
) -> ModalNeutralFile:
    """Return the modes of a Nastran op2 file as the content of a modal neutral file, in SI.

    Eigenvalues and shapes alone do not tell what a body weighs where: masses of the nodes come from the mass matrix of
    the g-set in the file (MGG), from its elements (GEOM2, EPT, MPT), or are given. That modes are orthogonal in them,
    and that they sum to what the grid point weight generator printed, is checked.

    Parameters
    ----------
    path : str or Path
        With grid points (GEOM1, BGPDT) and shapes (OUGV1), as ``PARAM,POST,-1`` writes them. Without the table of
        eigenvalues (LAMA) those of the shapes are taken, and their generalised masses in the masses of the nodes.
    masses : array_like of float, shape (N,), or matrix, shape (d, d), optional
        At the grid points in the order of their numbers, in the file's unit; or the mass matrix of the g-set in the
        basic coordinate system. Default: MGG of the file; without it those of its elements, lumped at their corners.
    bulk : str or Path, optional
        Bulk data of the analysis (.bdf, .dat, with what they include), where the op2 file is without them, as of
        ``PARAM,OGEOM,NO``: grid points and elements are read from there.
    inertias : array_like, shape (N, 3, 3), optional
        Of the grid points.
    length, mass_unit : float or str
        The file's units: SI values, or names as ``"mm"``. Time is in seconds.
    stresses : bool
        Whether the stresses of the modes are read, too, as :func:`read_op2_stresses` does: the body then has
        :meth:`~gearmbs.flexible.ModalModel.stress_modes`.

    Returns
    -------
    ModalNeutralFile
        For ``modal_model``, ``invariants`` and :func:`write_mnf`. Supports that the analysis had stay in its modes.

    Raises
    ------
    FlexibleError
        If pyyeti is not installed, the file is cut off or lacks a block, or masses and modes do not fit.
    """
    length, _, mass_unit = FileUnits.of(length, 1.0, mass_unit)
    file = Path(path)
    cards = None if bulk is None else Path(bulk)
    grids = None if cards is None else bulk_table(cards)
    blocks = op2_tables(file, ["MGG"] if masses is None else [], grids)
    table = blocks["grids"]
    lama = blocks.get("lama")
    if lama is not None and not len(lama):
        lama = None
    other = next((f"; its {name} is of {what}" for name, what in OTHER_EIGENVALUES if name in blocks["names"]), "")
    if lama is None and other:
        raise FlexibleError(
            f"{file.name}: it has no table of eigenvalues (LAMA){other}; run SOL 103 with PARAM,POST,-1"
        )
    factor, elements = 1.0, masses is None and "mgg" not in blocks
    if elements:
        masses, inertias, factor = element_masses(file, table, cards)
    elif masses is None:
        masses = table.in_basic(blocks["mgg"])
    lumped, turning = _nodal_masses(masses, inertias, table, file)
    heavy = np.flatnonzero((lumped > 0.0) | turning.any(axis=(1, 2)))
    needed = np.arange(len(table.ids)) if np.ndim(masses) == 2 or sp.issparse(masses) else heavy
    shapes, eigenvalues, moved = _shapes(file, table, None if lama is None else len(lama), needed)
    if lama is None:
        lama = _table_of(eigenvalues, shapes, lumped, turning)
    weight = blocks.get("ogpwg")
    printed = None if not weight else factor * float(weight["m66"][0, 0])
    if printed is not None and abs(lumped.sum() - printed) > SAME_MASS * printed:
        raise FlexibleError(
            f"{file.name}: the masses sum to {lumped.sum():.6g}, its grid point weight generator says {printed:.6g}; "
            "they belong to other nodes or units"
        )
    _check_orthogonal(file, lama[:, 5], _gram(shapes, masses, lumped, turning, table))
    if elements:
        _check_elements(file, lama, shapes, lumped, turning)
    kept = np.flatnonzero(moved)
    left = GridTable(table.ids[kept], table.positions[kept], table.axes[kept], table.dofs)
    found = _as_mnf(left, lama, shapes[:, kept], lumped[kept], turning[kept], (length, mass_unit))
    if not stresses:
        return found
    own = grid_stresses(file, table, length, mass_unit * length)
    if len(own.values) != len(lama):
        raise FlexibleError(f"{file.name}: stresses of {len(own.values)} modes, LAMA has {len(lama)}; ask for all")
    return replace(found, stresses=own)


def _gram(shapes: np.ndarray, masses: Any, lumped: np.ndarray, turning: np.ndarray, table: GridTable) -> np.ndarray:
    """Return products of shapes in a mass matrix, (n, n), or of the first in masses of the nodes, (1, 1)."""
    if sp.issparse(masses) or np.ndim(masses) == 2:
        row = {int(number): k for k, number in enumerate(table.ids)}
        vectors = np.array([shapes[:, row[int(n)], d - 1] if n != 0 else np.zeros(len(shapes)) for n, d in table.dofs])
        return vectors.T @ (masses @ vectors)
    return _generalised(shapes[:1], lumped, turning)[:, None]


def _check_orthogonal(file: Path, general: np.ndarray, gram: np.ndarray) -> None:
    """Refuse masses in which modes are not orthogonal, or the first not as heavy as the file says.

    Masses lumped at the nodes are those of the elements only for the slowest modes, so that the first is looked at.
    """
    general = general[: len(gram)]
    off = np.abs(gram - np.diag(general)) / np.sqrt(np.maximum(np.outer(general, general), 1e-300))
    i, j = np.unravel_index(int(np.argmax(off)), off.shape)
    lumped = len(gram) == 1
    if off[i, j] > ORTHOGONAL and not (lumped and 1.0 / LUMPED < gram[0, 0] / max(general[0], 1e-300) < LUMPED):
        what = f"mode {i + 1} has the generalised mass" if i == j else f"modes {i + 1} and {j + 1} have the product"
        raise FlexibleError(
            f"{file.name}: {what} {general[i] if i == j else 0.0:.6g} in the file and {gram[i, j]:.6g} with these "
            "masses; they belong to other nodes, another order or other units"
        )


def _check_elements(file: Path, lama: np.ndarray, shapes: np.ndarray, masses: np.ndarray, inertias: np.ndarray) -> None:
    """Refuse masses of elements that are not those of the modes, as of one superelement of several."""
    first = np.flatnonzero(lama[:, 2] > 0.0)[:SLOWEST]
    share = _generalised(shapes[first], masses, inertias) / np.maximum(lama[first, 5], 1e-300)
    if share.size and not 1.0 / LUMPED < share.min() <= share.max() < LUMPED:
        far = first[int(np.argmax(np.abs(np.log(np.maximum(share, 1e-300)))))]
        raise FlexibleError(
            f"{file.name}: mode {far + 1} has the generalised mass {lama[far, 5]:.6g} in the file and "
            f"{share[list(first).index(far)] * lama[far, 5]:.6g} with the masses of its elements; some of what moves "
            "is not in this file, as another superelement: give masses"
        )
    below = -float(lama[:, 2].min(initial=0.0))
    elastic = lama[lama[:, 2] > below, 2]
    if below > RESTING and elastic.size and below > ORTHOGONAL * elastic.min():
        raise FlexibleError(
            f"{file.name}: mode {int(np.argmin(lama[:, 2])) + 1} has the eigenvalue {-below:.4g}: what is not "
            "stable is no body; mend its materials"
        )


def _generalised(shapes: np.ndarray, masses: np.ndarray, inertias: np.ndarray) -> np.ndarray:
    """Return the generalised masses of shapes in masses of the nodes, (n,)."""
    moved, turned = shapes[..., :3], shapes[..., 3:]
    return np.einsum("npi,p,npi->n", moved, masses, moved) + np.einsum("npi,pij,npj->n", turned, inertias, turned)


def _as_mnf(
    table: GridTable,
    lama: np.ndarray,
    shapes: np.ndarray,
    masses: np.ndarray,
    inertias: np.ndarray,
    units: tuple[float, float],
) -> ModalNeutralFile:
    """Return modes and masses in SI."""
    length, unit = units
    place, m = table.positions * length, masses * unit
    j = inertias * unit * length**2
    out = shapes.copy()
    out[:, :, :3] *= length
    arms = np.einsum("p,pi,pj->ij", m, place, place)
    general = lama[:, 5] * unit * length**2
    eigen = np.column_stack([lama[:, 2], lama[:, 4], lama[:, 3], general, general * lama[:, 2]])
    rows = [
        (int(number), r + 4, c + 4, j[k, r, c])
        for k, number in enumerate(table.ids)
        for r in range(3)
        for c in range(r, 3)
        if j[k, r, c] != 0.0
    ]
    return ModalNeutralFile(
        table.ids, place, float(m.sum()), m @ place / m.sum(), np.trace(arms) * np.eye(3) - arms + j.sum(axis=0),
        lama[:, 0].astype(int), eigen, out, m, np.array(rows) if rows else None, SI,
    )  # fmt: skip


def _nodal_masses(masses: Any, inertias: Any, table: GridTable, file: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return masses and inertias at the grid points, from numbers or from a mass matrix."""
    count = len(table.ids)
    if sp.issparse(masses) or np.ndim(masses) == 2:
        if masses.shape[0] != len(table.dofs):
            raise FlexibleError(
                f"{file.name}: the mass matrix has {masses.shape[0]} rows, the g-set {len(table.dofs)}; give that of "
                "all grid points"
            )
        row = {int(number): k for k, number in enumerate(table.ids)}
        dofs = np.array([(row.get(int(n), -1), d - 1) for n, d in table.dofs])
        return nodal_lumps(count, dofs, sp.csc_array(masses))
    lumped = np.asarray(masses, dtype=float)
    if lumped.shape != (count,) or not np.all(np.isfinite(lumped)) or lumped.min(initial=0.0) < 0.0:
        raise FlexibleError(f"{file.name}: masses have shape {lumped.shape}; they are {count} numbers, none negative")
    turning = np.zeros((count, 3, 3)) if inertias is None else np.asarray(inertias, dtype=float)
    if turning.shape != (count, 3, 3):
        raise FlexibleError(f"{file.name}: inertias have shape {turning.shape} for {count} grid points")
    return lumped, turning


def _table_of(eigenvalues: np.ndarray, shapes: np.ndarray, masses: np.ndarray, inertias: np.ndarray) -> np.ndarray:
    """Return the rows of a table of eigenvalues that a file has not, with the generalised masses of its shapes."""
    numbers, w = np.arange(1.0, len(eigenvalues) + 1), np.sqrt(np.maximum(eigenvalues, 0.0))
    general = _generalised(shapes, masses, inertias)
    return np.column_stack([numbers, numbers, eigenvalues, w, w / (2.0 * np.pi), general, general * eigenvalues])


def _mode_blocks(opened: Any, integer: str, row: dict[int, int]) -> list[tuple[str, list[bytes]]]:
    """Return name and records of the blocks of real modes; if there are none, of the first block of displacements.

    Of several, as of superelements, those that name all grid points and no others.
    """
    there = [
        (name, block_records(opened, name, k))
        for name in (*MODES, *BASIC_MODES)
        if name in opened.dbnames
        for k in range(len(opened.dbnames[name]))
    ]
    size = int(integer[-1])
    real = [
        (name, records)
        for name, records in there
        if records and len(records[0]) == IDENTIFICATION * size
        and np.frombuffer(records[0], integer)[0] // 10 == REAL_MODES
    ]  # fmt: skip
    if len(real) < 2:
        return real or there[:1]

    def points(records: list[bytes]) -> set[int]:
        words = np.frombuffer(records[1] if len(records) > 1 else b"", integer)
        words = words[: len(words) // 8 * 8].reshape(-1, 8)
        return {int(one[0]) // 10 for one in words if one[1] == GRID_POINT}

    return [one for one in real if points(one[1]) == row.keys()] or real


def _shapes(
    file: Path, table: GridTable, count: int | None, needed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the shapes of an op2 file in basic coordinates, shape (n, N, 6), their eigenvalues, and which points move.

    ``count`` is the number of eigenvalues of LAMA; without it as many shapes are taken as there are. ``needed`` are the
    rows of grid points that have to be there: those with a mass.
    """
    op2 = pyyeti_module("op2", "op2")
    with op2.OP2(str(file)) as opened:
        integer, real = word_kinds(opened)
        row = {int(number): k for k, number in enumerate(table.ids)}
        found = _mode_blocks(opened, integer, row)
    if not found:
        raise FlexibleError(
            f"{file.name}: it has no real mode shapes ({', '.join(MODES)}); ask for DISPLACEMENT(PLOT)=ALL"
        )
    name, records = found[0]
    if len(found) > 1:
        raise FlexibleError(f"{file.name}: {name} is there more than once; write one subcase")
    told = count is not None
    count = len(records) // 2 if count is None else count
    out, eigenvalues = np.zeros((count, len(table.ids), 6)), np.zeros(count)
    if len(records) % 2 or any(len(head) != IDENTIFICATION * int(integer[-1]) for head in records[::2]):
        raise FlexibleError(f"{file.name}: {name} has no identification before each of its records")
    modes: list[int] = []
    moved = np.ones(len(table.ids), dtype=bool)
    kind = np.dtype([("grid", integer, (2,)), ("value", real, (6,))])
    for head, data in zip(records[::2], records[1::2]):
        approach, mode, form, width = (int(k) for k in np.frombuffer(head, integer)[[0, 4, 8, 9]])
        if approach // 10 != REAL_MODES or form not in (0, 1) or width != 8:
            what = ANALYSES.get(approach // 10, f"analysis {approach // 10}")
            raise FlexibleError(
                f"{file.name}: {name} holds {what} in {width} words a point and no real modes; run SOL 103 with "
                "DISPLACEMENT(PLOT,SORT1,REAL)=ALL"
            )
        eigenvalue = float(np.frombuffer(head, real)[EIGENVALUE])
        if not told and not np.isfinite(eigenvalue):
            raise FlexibleError(f"{file.name}: {name} has no eigenvalue of mode {mode}, and LAMA is missing; write it")
        if len(data) % kind.itemsize:
            raise FlexibleError(f"{file.name}: {name}: {len(data)} bytes are no points of 8 words")
        if len(modes) == count or mode in modes:
            raise FlexibleError(f"{file.name}: {name} holds {len(records) // 2} shapes, LAMA {count} eigenvalues")
        points = np.frombuffer(data, kind)
        points = points[points["grid"][:, 1] == GRID_POINT]
        numbers = points["grid"][:, 0] // 10
        places = [row.get(int(number), -1) for number in numbers]
        if -1 in places:
            raise FlexibleError(
                f"{file.name}: {name} names grid point {numbers[places.index(-1)]}, which GEOM1 does not have"
            )
        if len(places) > len(set(places)):
            raise FlexibleError(f"{file.name}: {name} has grid points twice; ask for all points")
        absent = np.setdiff1d(needed, places)
        if absent.size:
            raise FlexibleError(
                f"{file.name}: {name} has no shapes of grid point {table.ids[absent[0]]}; ask for all points"
            )
        moved[np.setdiff1d(np.arange(len(table.ids)), places)] = False
        out[len(modes), places], eigenvalues[len(modes)] = points["value"], eigenvalue
        modes.append(mode)
    if not modes:
        raise FlexibleError(f"{file.name}: {name} is empty; ask for DISPLACEMENT(PLOT)=ALL in SOL 103")
    if len(modes) != count:
        raise FlexibleError(f"{file.name}: {name} holds {len(modes)} shapes, LAMA {count} eigenvalues")
    if not np.all(np.isfinite(out)):
        raise FlexibleError(f"{file.name}: {name} has numbers that are not finite")
    if name in MODES:
        for base in (0, 3):
            out[:, :, base : base + 3] = np.einsum("pij,npj->npi", table.axes, out[:, :, base : base + 3])
    return out, eigenvalues, moved
