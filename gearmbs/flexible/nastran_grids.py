"""Grid points from the bulk data of an op2 file: GEOM1 with its coordinate systems, scalar points from GEOM2.

Where EQEXIN is missing, or does not fit the other tables, GEOM1 is enough: its records hold grid points and coordinate
systems as they stand in the input. A record begins with three words that name its entry. Numbers with a point have 4
bytes, or 8 in GEOM1N and in records of the third word above a million.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.flexible.errors import FlexibleError
from gearmbs.flexible.nastran_files import GridTable, axes_at, block_records, check_end, pyyeti_module, word_kinds

GRID_BLOCKS = ("GEOM1", "BGPDT", "EQEXIN")
SAME_PLACE = 1e-4
"""Distance of a point's places in two blocks against the size of the model: words of 4 bytes, angles in degrees."""
BLOCKS = ("GEOM1S", "GEOM1", "GEOM1N")
GRID, SEQUENCE, SCALAR = (4501, 45), (5301, 53), (5551, 49)
BY_POINTS = {(2101, 21): 1, (2001, 20): 2, (2201, 22): 3}
"""CORD2R, CORD2C, CORD2S and their kinds: 1 rectangular, 2 cylindrical, 3 spherical."""
BY_GRIDS = {(1801, 18): 1, (1701, 17): 2, (1901, 19): 3}
"""CORD1R, CORD1C, CORD1S."""
BASIC = (1, np.zeros(3), np.eye(3))

System = tuple[int, np.ndarray, np.ndarray]
"""Kind, origin and axes (columns) of a coordinate system in the basic one."""


def op2_tables(file: Path, matrices: list[str]) -> dict[str, Any]:
    """Return matrices, eigenvalues (``lama``), weights (``ogpwg``), grid points and names of blocks of an op2 file.

    Grid points are those of EQEXIN, BGPDT and GEOM1; where one of these is missing or they do not fit each other, those
    of GEOM1 alone (:func:`bulk_grids`).

    Raises
    ------
    FlexibleError
        If the records are not whole, or there are no grid points.
    """
    op2 = pyyeti_module("op2", "op2")
    check_end(file, "op2")
    try:
        with op2.OP2(str(file)) as opened:
            names = [str(name) for name in opened.dbnames]
            lacking = [block for block in GRID_BLOCKS if not any(name.startswith(block) for name in names)]
            found = None
            if not lacking:
                try:
                    found = opened.rdparampost(get_mats=matrices or False, get_dr_tables=False)
                    found["grids"] = GridTable.of(found["uset"])
                except (ValueError, KeyError, IndexError):
                    # EQEXINS beside BGPDTS of another superelement, tables of other lengths
                    found = None
            if found is not None:
                _check_places(file, found["grids"])
                return found | {"names": names}
            grids = bulk_grids(file)
            if grids is None:
                missing = f"{', '.join(lacking)} {'is' if len(lacking) == 1 else 'are'} missing"
                raise FlexibleError(
                    f"{file.name}: it has no grid points ({missing if lacking else 'GEOM1 is without'}; GEOM1 alone "
                    "would do); write it with PARAM,POST,-1 and without PARAM,OGEOM,NO. Data blocks: "
                    f"{', '.join(names) or 'none'}"
                )
            out = {"names": names, "grids": grids, "lama": _eigenvalues(opened, names), "ogpwg": opened.rdop2gpwg()}
            return out | opened.rdop2mats(names=matrices, lower=True) if matrices else out
    except FlexibleError:
        raise
    except Exception as error:
        text = str(error).splitlines()[0] if str(error) else ""
        raise FlexibleError(f"{file.name}: it cannot be read as op2 ({type(error).__name__}: {text})") from None


def bulk_grids(file: Path) -> GridTable | None:
    """Return the grid points of the last GEOM1 of an op2 file, six degrees of freedom each, or None if it has none.

    Scalar points have one. Rows are in the order of their numbers, as Nastran's without resequencing.

    Raises
    ------
    FlexibleError
        If records are none of grid points, coordinate systems lean on such that are missing, or points are resequenced.
    """
    op2 = pyyeti_module("op2", "op2")
    with op2.OP2(str(file)) as opened:
        block = next((name for name in BLOCKS if name in opened.dbnames), None)
        if block is None:
            return None
        integer, _ = word_kinds(opened)
        records = _records(opened, block)
        scalar = next((r for name in ("GEOM2S", "GEOM2", "GEOM2N") if name in opened.dbnames
                       for key, r in _records(opened, name) if key[:2] == SCALAR), b"")  # fmt: skip
    whole = {key[:2]: data for key, data in records}
    if GRID not in whole:
        return None
    if SEQUENCE in whole:
        raise FlexibleError(f"{file.name}: {block} resequences its points (SEQGP); write it without, or with EQEXIN")
    wide = {key[:2]: key[2] > 1_000_000 for key, _ in records}
    grids = _rows(file, whole[GRID], integer, 5, 3, wide[GRID], lambda g: (g["i"][:, 0] > 0) & (g["i"][:, 1] >= 0))
    number, place, after = grids["i"][:, 0], grids["x"].astype(float), grids["after"]
    ids, first = np.unique(number, return_index=True)
    if ids.size != number.size:
        raise FlexibleError(f"{file.name}: {block} has grid points twice; write one superelement a file")
    place, given, shown = place[first], grids["i"][first, 1], after[first, 0]
    if np.any(shown < 0):
        raise FlexibleError(
            f"{file.name}: grid point {ids[np.argmin(shown)]} is one of a fluid (CD = -1); write the structure alone"
        )
    systems = _systems(file, whole, wide, integer, (ids, place, given))
    used = np.unique(np.concatenate([given, shown]))
    lacking = [int(k) for k in used if int(k) not in systems]
    if lacking:
        raise FlexibleError(f"{file.name}: coordinate system {lacking[0]} of its grid points is not in {block}")
    points = np.array([_in_basic(systems[int(c)], x) for c, x in zip(given, place)]).reshape(-1, 3)
    axes = np.array([_axes(systems[int(c)], x) for c, x in zip(shown, points)]).reshape(-1, 3, 3)
    if not np.all(np.isfinite(points)):
        raise FlexibleError(f"{file.name}: grid point {ids[~np.isfinite(points).all(axis=1)][0]} is nowhere")
    scalars = np.frombuffer(scalar, integer)
    rows = [(int(k), d) for k in ids for d in range(1, 7)]
    dofs = [(0, 1, int(k)) for k in scalars] + [(n, d, n) for n, d in rows]
    dofs.sort(key=lambda row: (row[2], row[1]))
    return GridTable(ids.astype(int), points, axes, np.array([row[:2] for row in dofs], dtype=int))


def _records(opened: Any, block: str) -> list[tuple[tuple[int, ...], bytes]]:
    """Return key and content of each record of a block's last occurrence."""
    integer, _ = word_kinds(opened)
    head = 3 * int(integer[-1])
    return [
        (tuple(int(k) for k in np.frombuffer(data[:head], integer)), data[head:])
        for data in block_records(opened, block)
    ]


def _rows(file: Path, data: bytes, integer: str, before: int, numbers: int, wide: bool, fits: Any) -> np.ndarray:
    """Return rows of whole numbers, numbers and whole numbers of a record; numbers as wide as its length allows."""
    word = int(integer[-1])
    counts = {5: (2, 3), 13: (4, 0)}[before]
    for size in dict.fromkeys((8, word) if wide else (word, 8)):
        kind = np.dtype([("i", integer, (counts[0],)), ("x", f"{integer[0]}f{size}", (numbers,)),
                         ("after", integer, (counts[1],))])  # fmt: skip
        if data and len(data) % kind.itemsize == 0:
            rows = np.frombuffer(data, kind)
            if np.all(fits(rows)) and np.all(np.isfinite(rows["x"])):
                return rows
    raise FlexibleError(f"{file.name}: a record of {len(data)} bytes holds no grid points or coordinate systems")


def _systems(
    file: Path,
    whole: dict[tuple[int, ...], bytes],
    wide: dict[tuple[int, ...], bool],
    integer: str,
    grids: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> dict[int, System]:
    """Return the coordinate systems by number; each waits for the one that it is given in."""
    ids, place, given = grids
    waiting: list[tuple[int, int, list[int], np.ndarray]] = []
    for key, kind in BY_POINTS.items():
        if whole.get(key):
            rows = _rows(
                file, whole[key], integer, 13, 9, wide[key],
                lambda g, kind=kind: (g["i"][:, 1] == kind) & (g["i"][:, 2] == 2),
            )  # fmt: skip
            waiting += [(int(i[0]), kind, [int(i[3])] * 3, x.astype(float).reshape(3, 3)) for i, x in
                        zip(rows["i"], rows["x"])]  # fmt: skip
    row = {int(k): i for i, k in enumerate(ids)}
    for key, kind in BY_GRIDS.items():
        for number, _, _, *three in np.frombuffer(whole.get(key, b""), integer).reshape(-1, 6):
            if any(int(k) not in row for k in three):
                raise FlexibleError(f"{file.name}: coordinate system {number} leans on a grid point that is not there")
            at = [row[int(k)] for k in three]
            waiting.append((int(number), kind, [int(given[k]) for k in at], place[at]))
    out: dict[int, System] = {0: BASIC}
    while waiting:
        ready = [one for one in waiting if all(k in out for k in one[2])]
        if not ready:
            raise FlexibleError(
                f"{file.name}: coordinate system {waiting[0][0]} leans on {waiting[0][2][0]}, which is not there"
            )
        for number, kind, within, points in ready:
            origin, up, side = (_in_basic(out[k], x) for k, x in zip(within, points))
            # z through the second point, x in the half plane of the third
            z = (up - origin) / np.linalg.norm(up - origin)
            y = np.cross(z, side - origin)
            y /= np.linalg.norm(y)
            out[number] = (kind, origin, np.column_stack([np.cross(y, z), y, z]))
        waiting = [one for one in waiting if one[0] not in out]
    return out


def _in_basic(system: System, x: np.ndarray) -> np.ndarray:
    """Return a place given by coordinates of a system (angles in degrees) in the basic one."""
    kind, origin, axes = system
    if kind == 2:
        turn = np.deg2rad(x[1])
        x = np.array([x[0] * np.cos(turn), x[0] * np.sin(turn), x[2]])
    elif kind == 3:
        down, turn = np.deg2rad(x[1]), np.deg2rad(x[2])
        x = x[0] * np.array([np.sin(down) * np.cos(turn), np.sin(down) * np.sin(turn), np.cos(down)])
    return origin + axes @ x


def _axes(system: System, place: np.ndarray) -> np.ndarray:
    """Return the axes of displacements in a system at a place, as columns."""
    kind, origin, axes = system
    return axes_at(np.vstack([place, [0.0, kind, 0.0], origin, axes]))


def _check_places(file: Path, grids: GridTable) -> None:
    """Refuse grid points whose places in BGPDT are not those of GEOM1, where both hold the same ones."""
    try:
        own = bulk_grids(file)
    except FlexibleError:
        # superelements, resequenced points: EQEXIN and BGPDT say what GEOM1 does not
        return
    if own is None or not np.array_equal(np.sort(grids.ids), own.ids):
        return
    order = np.argsort(grids.ids)
    apart = np.abs(grids.positions[order] - own.positions).max(axis=1)
    size = np.abs(own.positions).max(initial=0.0)
    if apart.max(initial=0.0) > SAME_PLACE * size:
        k = int(np.argmax(apart))
        raise FlexibleError(
            f"{file.name}: grid point {own.ids[k]} is at {own.positions[k]} in GEOM1 and at "
            f"{grids.positions[order][k]} in BGPDT; the file is damaged, or its blocks are of different models"
        )


def _eigenvalues(opened: Any, names: list[str]) -> np.ndarray | None:
    """Return the rows of LAMA: mode, order, eigenvalue, rad/s, Hz, generalised mass and stiffness."""
    name = next((name for name in names if name.startswith("LAMA")), None)
    if name is None:
        return None
    integer, real = word_kinds(opened)
    data = b"".join(block_records(opened, name)[1:])
    kind = np.dtype([("mode", integer, (2,)), ("value", real, (5,))])
    rows = np.frombuffer(data, kind)
    return np.column_stack([rows["mode"].astype(float), rows["value"].astype(float)])
