"""Masses of grid points from the elements of a Nastran op2 file: GEOM2, EPT and MPT, or from its bulk data.

Public files of modes have their elements, but hardly ever a mass matrix. Each element's mass, density times volume and
what is not structural, is lumped at its corners: of lines half at each end, of surfaces and solids by the volumes at
the corners. That is what Nastran does without ``PARAM,COUPMASS``, but for points in the middle of edges, which get
none. Which modes are orthogonal in it, and whether the total is the printed one, is checked where it is used.

A record begins with a key of three words that names its entry; rows of whole numbers and numbers of one width follow.
Most entries of bulk data have the same fields in the same order, so that both are read by one set of rules.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.flexible.material import FlexibleError
from gearmbs.flexible.nastran import GridTable, block_records, keyed_records, pyyeti_module, word_kinds
from gearmbs.wording import warn

Key = tuple[int, int]

BLOCKS = ("GEOM2", "EPT", "MPT")
END = (65535, 65535)
"""Key of the record that ends a block."""
PROPERTY = 1
"""Word of an element that holds its property."""


@dataclass(frozen=True)
class Entry:
    """One kind of elements in GEOM2.

    Attributes
    ----------
    name : str
    words : tuple of int
        Widths of a row that programs and versions have.
    corners : int
    thickness : int
        Word at which thicknesses at the corners begin; 0 where it has none.
    first : int
        Word of the first corner.
    """

    name: str
    words: tuple[int, ...]
    corners: int
    thickness: int = 0
    first: int = 2


LINES = {
    (2408, 24): Entry("CBAR", (16,), 2), (5408, 54): Entry("CBEAM", (18, 19), 2), (3001, 30): Entry("CROD", (4,), 2),
    (3701, 37): Entry("CTUBE", (4,), 2),
}  # fmt: skip
SURFACES = {
    (5959, 59): Entry("CTRIA3", (13, 14), 3, 10), (2958, 51): Entry("CQUAD4", (14, 15), 4, 10),
    (4801, 48): Entry("CTRIA6", (14, 13, 15), 3), (4701, 47): Entry("CQUAD8", (17, 18), 4),
    (9200, 92): Entry("CTRIAR", (13, 14), 3), (8009, 80): Entry("CQUADR", (14, 15), 4),
    (3101, 31): Entry("CSHEAR", (6,), 4),
}  # fmt: skip
SOLIDS = {
    (5508, 55): Entry("CTETRA", (12,), 4), (17200, 172): Entry("CPYRAM", (16,), 5),
    (4108, 41): Entry("CPENTA", (17,), 6), (7308, 73): Entry("CHEXA", (22,), 8),
    (7108, 71): Entry("CPENTA of layers", (18,), 6, first=3), (7708, 77): Entry("CHEXA of layers", (23,), 8, first=3),
}  # fmt: skip
ROD, POINT_MASS = (1601, 16), (1501, 15)
"""CONROD and CONM2."""
WEIGHTLESS = {
    (601, 6), (701, 7), (801, 8), (901, 9), (201, 2), (301, 3), (401, 4), (501, 5), (2608, 26), (5608, 56), (3901, 39),
    (1908, 19), (5201, 52), (5551, 49), (3002, 46), (4001, 40), END,
}  # fmt: skip
"""Springs, dampers, bushes, gaps, PLOTEL, scalar points, panels of aerodynamics, points of output along bars."""
CMASS = {(1001, 10): "CMASS1", (1101, 11): "CMASS2", (1201, 12): "CMASS3", (1301, 13): "CMASS4", (1401, 14): "CONM1"}
"""Masses in single directions, which are no mass of a point."""
FOLDED = {3: (0, 1, 2, 2), 4: (0, 1, 2, 3)}
BRICKS = {4: (0, 1, 2, 2, 3, 3, 3, 3), 5: (0, 1, 2, 3, 4, 4, 4, 4), 6: (0, 1, 2, 2, 3, 4, 5, 5), 8: tuple(range(8))}
"""Corners of surfaces as a quadrilateral, of solids as a brick, some of whose corners fall together."""
GAUSS = 3.0**-0.5
"""Place of the two points of a rule on (-1, 1) that is exact for volumes of bricks with straight edges."""
LAYER = 8
"""Words of a layer of PCOMPS, of what comes before the first, and of the end, all -1."""
BASIC_CENTRE = -1
"""Coordinate system of a CONM2 whose centre is given by its place and not by an offset."""

PROPERTIES = {
    "PBAR": ("EPT", (52, 20), 19), "PROD": ("EPT", (902, 9), 6), "PTUBE": ("EPT", (1602, 16), 5),
    "PBEAM": ("EPT", (5402, 54), 197), "PSHELL": ("EPT", (2302, 23), 11), "PSHEAR": ("EPT", (1002, 10), 6),
    "PCOMP": ("EPT", (2706, 27), 0), "PCOMPG": ("EPT", (2706, 27), 0), "PCOMPS": ("EPT", (16006, 160), 0),
    "PSOLID": ("EPT", (2402, 24), 7),
    "MAT1": ("MPT", (103, 1), 12), "MAT2": ("MPT", (203, 2), 17), "MAT8": ("MPT", (2503, 25), 19),
    "MAT9": ("MPT", (2603, 26), 35), "MAT11": ("MPT", (2903, 29), 32),
}  # fmt: skip
"""Block, key and words of the entries of properties and materials; a laminate has as many words as layers need."""
LIGHT = {
    "CBUSH", "CBUSH1D", "CDAMP1", "CDAMP2", "CDAMP3", "CDAMP4", "CDAMP5", "CELAS1", "CELAS2", "CELAS3", "CELAS4",
    "CFAST", "CGAP", "CVISC",
}  # fmt: skip
"""Entries of elements without a mass."""
NO_ELEMENTS = ("CORD", "CSET", "CAERO", "CEND", "CLOAD", "CYAX", "CYJOIN", "CREEP", "CSUPER", "CSSCHD", "CONV")
"""Beginnings of entries that begin as elements do and are none."""
BLANK = 8
"""Field of a CONM2 that is left blank, so that its record has a word less."""
CHARACTERS = 8
"""Of the name of an entry; what is longer is of the executive or the case control."""


def element_masses(file: Path, table: GridTable, cards: Path | None = None) -> tuple[np.ndarray, np.ndarray, float]:
    """Return masses (N,) and inertias (N, 3, 3) at the grid points of a file, in its units, and its WTMASS.

    That factor is in them; the grid point weight generator prints weights without it.

    Parameters
    ----------
    file : Path
    table : GridTable
    cards : Path, optional
        Bulk data that the elements are read from instead.

    Raises
    ------
    FlexibleError
        If the file has no elements, or some whose mass is not known here, with their names.

    Warns
    -----
    UserWarning
        Of point masses beside their grid points, whose offset counts in inertias and not in the centre of mass.
    """
    bulk = _Bulk.of(file, table) if cards is None else _Bulk.of_cards(cards, table)
    masses, inertias = np.zeros(len(table.ids)), np.zeros((len(table.ids), 3, 3))
    strange = [CMASS.get(key, str(key)) for key in bulk.records["GEOM2"] if not _known(key)]
    if strange:
        raise FlexibleError(
            f"{bulk.file.name}: what its elements {', '.join(strange)} weigh is not read; export MGG (OUTPUT2), "
            "or give masses or bulk"
        )
    for places, share in bulk.shares():
        np.add.at(masses, places, share)
    aside = 0.0
    for at, mass, offset, inertia in bulk.points():
        masses[at] += mass
        inertias[at] += inertia + mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        aside = max(aside, mass * float(np.linalg.norm(offset)))
    if not masses.any():
        raise FlexibleError(
            f"{file.name}: modes without masses of the grid points make no body, and neither MGG nor elements with a "
            "mass are in it; export MGG (OUTPUT2), or give masses or bulk"
        )
    if aside > 0.0:
        warn(f"{file.name}: point masses beside their grid points (CONM2 with an offset) are taken at these, with the "
             f"inertia of the offset: {aside:.3g} of mass times length is not in the centre of mass")  # fmt: skip
    return masses * bulk.factor, inertias * bulk.factor, bulk.factor


def _known(key: Key) -> bool:
    return any(key in kinds for kinds in (LINES, SURFACES, SOLIDS, WEIGHTLESS)) or key in (ROD, POINT_MASS)


@dataclass(frozen=True, eq=False)
class _Bulk:
    """Records of a file by block and key, and how its words are read."""

    file: Path
    table: GridTable
    records: dict[str, dict[Key, bytes]]
    integer: str
    real: str
    factor: float

    @classmethod
    def of(cls, file: Path, table: GridTable) -> _Bulk:
        records: dict[str, dict[Key, bytes]] = {}
        with pyyeti_module("op2", "op2").OP2(str(file)) as opened:
            integer, real = word_kinds(opened)
            for block in BLOCKS:
                name = next((name for name in (f"{block}S", block, f"{block}N") if name in opened.dbnames), None)
                records[block] = {} if name is None else {(k[0], k[1]): d for k, d in keyed_records(opened, name)}
            told = b"".join(block_records(opened, "PVT0")) if "PVT0" in opened.dbnames else b""
        return cls(file, table, records, integer, real, _parameter(told, "WTMASS", real))

    @classmethod
    def of_cards(cls, path: Path, table: GridTable) -> _Bulk:
        """Return what bulk data hold, as records whose words have 8 bytes."""
        records: dict[str, dict[Key, bytes]] = {block: {} for block in BLOCKS}
        elements = {entry.name: ("GEOM2", key, entry.words[0]) for kinds in (LINES, SURFACES, SOLIDS)
                    for key, entry in kinds.items()}  # fmt: skip
        elements |= {"CONROD": ("GEOM2", ROD, 8), "CONM2": ("GEOM2", POINT_MASS, 13)}
        elements |= {name: ("GEOM2", key, 0) for key, name in CMASS.items()}
        factor, strange = 1.0, set()
        for name, *fields in read_cards(path):
            if name == "PARAM" and fields[:1] == ["WTMASS"]:
                factor = float(fields[1])
            elif name in elements or name in PROPERTIES:
                block, key, width = elements.get(name) or PROPERTIES[name]
                records[block][key] = records[block].get(key, b"") + _words(name, fields, width)
            elif name[0] == "C" and name not in LIGHT and not name.startswith(NO_ELEMENTS):
                strange.add(name)
        if strange:
            raise FlexibleError(
                f"{path.name}: what its elements {', '.join(sorted(strange))} weigh is not read; give masses"
            )
        return cls(path, table, records, "<i8", "<f8", factor)

    def rows(self, block: str, key: Key, width: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows of a record as whole numbers and as numbers; none if there is no such record."""
        data = self.records[block].get(key, b"")
        if len(data) % (width * int(self.integer[-1])):
            raise FlexibleError(
                f"{self.file.name}: {block} has a record {key} of {len(data)} bytes, no rows of {width} words; "
                "give masses"
            )
        whole, real = (np.frombuffer(data, kind).reshape(-1, width) for kind in (self.integer, self.real))
        return whole, real

    def densities(self) -> dict[int, float]:
        """Return densities by number of the material: MAT1, MAT2, MAT8, MAT9, MAT11."""
        out: dict[int, float] = {}
        for key, width, place in (
            ((103, 1), 12, 4), ((203, 2), 17, 7), ((2503, 25), 19, 7), ((2603, 26), 35, 22), ((2903, 29), 32, 10),
        ):  # fmt: skip
            whole, real = self.rows("MPT", key, width)
            out.update(zip(whole[:, 0].tolist(), real[:, place].astype(float).tolist()))
        return out

    def per_length(self) -> dict[int, float]:
        """Return the mass of lines by length: of PBAR, PROD, PTUBE, and of PBEAM its mean."""
        rho, out = self.densities(), {}
        for key, width, area, more in (((52, 20), 19, 2, 6), ((902, 9), 6, 2, 5)):
            whole, real = self.rows("EPT", key, width)
            for one, numbers in zip(whole, real):
                out[int(one[0])] = self.of_material(rho, one[1]) * float(numbers[area]) + float(numbers[more])
        whole, real = self.rows("EPT", (1602, 16), 5)
        for one, (*_, outer, wall, more) in zip(whole, real):
            across = np.pi * (wall * (outer - wall) if wall > 0.0 else outer**2 / 4.0)
            out[int(one[0])] = self.of_material(rho, one[1]) * float(across) + float(more)
        whole, real = self.rows("EPT", (5402, 54), 197)
        for one, numbers in zip(whole, real):
            stations = numbers[5:181].reshape(11, 16).astype(float)
            # the first is end A; of the others those that are given lie between it and end B
            used = stations[(stations[:, 1] > 0.0) & (stations[:, 2] > 0.0)]
            used = np.vstack([stations[:1], used[np.argsort(used[:, 1])]])
            x = np.append(used[:, 1], 1.0) if used[-1, 1] < 1.0 else used[:, 1]
            mean = [np.trapezoid(np.append(used[:, k], used[-1, k])[: len(x)], x) for k in (2, 7)]
            out[int(one[0])] = self.of_material(rho, one[1]) * float(mean[0]) + float(mean[1])
        return out

    def of_material(self, rho: dict[int, float], number: int) -> float:
        if int(number) not in rho:
            raise FlexibleError(
                f"{self.file.name}: the density of material {int(number)} is not in MPT (MAT1, MAT2, MAT8, MAT9, "
                "MAT11); give masses"
            )
        return rho[int(number)]

    def per_area(self) -> dict[int, tuple[float, float, float]]:
        """Return density, thickness and other mass by area, of PSHELL and PSHEAR; of PCOMP all of it is that."""
        rho, out = self.densities(), {}
        whole, real = self.rows("EPT", (2302, 23), 11)
        for one, numbers in zip(whole, real):
            material = int(one[1]) or int(one[3])
            out[int(one[0])] = (self.of_material(rho, material), float(numbers[2]), float(numbers[7]))
        whole, real = self.rows("EPT", (1002, 10), 6)
        for one, numbers in zip(whole, real):
            out[int(one[0])] = (self.of_material(rho, one[1]), float(numbers[2]), float(numbers[3]))
        data = self.records["EPT"].get((2706, 27), b"")
        whole, real = np.frombuffer(data, self.integer), np.frombuffer(data, self.real)
        at = 0
        while at < len(whole):
            number, layers = int(whole[at]), int(whole[at + 1])
            end = at + 8 + 4 * abs(layers)
            if layers == 0 or end > len(whole):
                raise FlexibleError(f"{self.file.name}: PCOMP {number} has {layers} layers; give masses")
            mass = sum(self.of_material(rho, whole[k]) * float(real[k + 1]) for k in range(at + 8, end, 4))
            # half of a laminate that is symmetric is told, by a number below zero
            out[number] = (0.0, 0.0, (2.0 if layers < 0 else 1.0) * mass + float(real[at + 3]))
            at = end
        return out

    def per_volume(self) -> dict[int, tuple[float, float, float]]:
        """Return densities by number of the property: of PSOLID, and of PCOMPS the mean of its layers."""
        rho = self.densities()
        whole, _ = self.rows("EPT", (2402, 24), 7)
        out = {int(one[0]): (self.of_material(rho, one[1]), 1.0, 0.0) for one in whole}
        whole, real = self.rows("EPT", (16006, 160), LAYER)
        at = 0
        while at < len(whole):
            end = at + 1 + int(np.argmax(whole[at + 1 :, 0] < 0))
            thick = real[at + 1 : end, 2].astype(float)
            if not thick.sum() > 0.0:
                raise FlexibleError(
                    f"{self.file.name}: PCOMPS {whole[at, 0]} has no layers with a thickness; give masses"
                )
            mean = [self.of_material(rho, one[1]) for one in whole[at + 1 : end]] @ thick / thick.sum()
            out[int(whole[at, 0])] = (float(mean), 1.0, 0.0)
            at = end + 1
        return out

    def elements(self, entry: Entry, key: Key, properties: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return properties, rows of the grid points of the corners, and thicknesses of one kind of elements."""
        data, row = self.records["GEOM2"].get(key, b""), {int(k): i for i, k in enumerate(self.table.ids)}
        first = entry.first
        for width in entry.words:
            if len(data) % (width * int(self.integer[-1])):
                continue
            whole, real = self.rows("GEOM2", key, width)
            grids = whole[:, first : first + entry.corners]
            if all(int(g) in row for g in grids.ravel()) and all(int(p) in properties for p in whole[:, PROPERTY]):
                places = np.array([[row[int(g)] for g in one] for one in grids], dtype=int).reshape(-1, entry.corners)
                own = real[:, entry.thickness : entry.thickness + entry.corners] if entry.thickness else real[:, :0]
                return whole[:, PROPERTY], places, own
        raise FlexibleError(
            f"{self.file.name}: {entry.name} in GEOM2: {len(data)} bytes are no rows of {entry.words[0]} words whose "
            "grid points and properties are there; export MGG (OUTPUT2), or give masses"
        )

    def shares(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield rows of grid points and masses there, of all elements with an extent."""
        position, held = self.table.positions, self.records["GEOM2"]
        by_length = self.per_length()
        for key, entry in LINES.items():
            if key in held:
                number, places, _ = self.elements(entry, key, by_length)
                length = np.linalg.norm(position[places[:, 1]] - position[places[:, 0]], axis=1)
                half = 0.5 * length * np.array([by_length[int(p)] for p in number])
                yield places, np.repeat(half[:, None], 2, axis=1)
        if ROD in held:
            rho, row = self.densities(), {int(k): i for i, k in enumerate(self.table.ids)}
            for whole, real in zip(*self.rows("GEOM2", ROD, 8)):
                places = np.array([row[int(g)] for g in whole[1:3]])
                mass = self.of_material(rho, whole[3]) * float(real[4]) + float(real[7])
                yield places, np.full(2, 0.5 * mass * np.linalg.norm(position[places[1]] - position[places[0]]))
        for kinds, found, folds in ((SURFACES, self.per_area(), FOLDED), (SOLIDS, self.per_volume(), BRICKS)):
            for key, entry in kinds.items():
                if key not in held:
                    continue
                number, places, own = self.elements(entry, key, found)
                density, thick, more = np.array([found[int(p)] for p in number]).reshape(-1, 3).T
                if own.size:
                    # thicknesses at the corners, where they are given, take the place of that of the property
                    thick = np.where(np.all(own > 0.0, axis=1), own.mean(axis=1), thick)
                fold = list(folds[entry.corners])
                yield places[:, fold], corner_shares(position[places[:, fold]]) * (density * thick + more)[:, None]

    def points(self) -> Iterator[tuple[int, float, np.ndarray, np.ndarray]]:
        """Yield row of the grid point, mass, offset and inertia about the centre of each CONM2."""
        row = {int(k): i for i, k in enumerate(self.table.ids)}
        for whole, real in zip(*self.rows("GEOM2", POINT_MASS, 13)):
            at, system = row.get(int(whole[1])), int(whole[2])
            if at is None:
                raise FlexibleError(
                    f"{self.file.name}: CONM2 {whole[0]} is at grid point {whole[1]}, which is not there"
                )
            xx, yx, yy, zx, zy, zz = real[7:13].astype(float)
            offset, inertia = real[4:7].astype(float), np.array([[xx, -yx, -zx], [-yx, yy, -zy], [-zx, -zy, zz]])
            if system == BASIC_CENTRE:
                offset = offset - self.table.positions[at]
            elif system != 0 and (offset.any() or inertia.any()):
                raise FlexibleError(
                    f"{self.file.name}: CONM2 {whole[0]} is told in coordinate system {system}; tell it in the "
                    "basic one, or give masses and inertias"
                )
            yield at, float(real[3]), offset, inertia


def read_cards(path: Path) -> list[list[Any]]:
    """Return the entries of bulk data, each its name and its fields; "" where they are blank."""
    try:
        found = pyyeti_module("bulk", "bulk data").rdcards(
            str(path), "[A-Za-z]", regex=True, return_var="list", keep_name=True
        )
    except (OSError, ValueError, IndexError, RuntimeError) as error:
        raise FlexibleError(f"{path.name}: it cannot be read as bulk data ({type(error).__name__}: {error})") from None
    names = [str(card[0]).strip().upper() for card in found or []]
    if any(name.startswith("BEGIN SU") for name in names):
        raise FlexibleError(f"{path.name}: it holds superelements (BEGIN SUPER); give the bulk data of one")
    return [[name.rstrip("*"), *card[1:]] for name, card in zip(names, found or []) if len(name) <= CHARACTERS]


def bulk_table(path: Path) -> GridTable:
    """Return the grid points of bulk data in the order of their numbers.

    Raises
    ------
    FlexibleError
        If there is no such file, or no grid points in it.
    """
    bulk = pyyeti_module("bulk", "bulk data")
    if not path.is_file():
        raise FlexibleError(f"{path.name}: there is no such file")
    try:
        uset = bulk.bulk2uset(str(path))[0]
    except Exception as error:
        raise FlexibleError(f"{path.name}: its grid points cannot be read ({type(error).__name__}: {error})") from None
    if not len(uset):
        raise FlexibleError(f"{path.name}: it has no grid points (GRID); give the file with the bulk data")
    table = GridTable.of(uset)
    order = np.argsort(table.ids, kind="stable")
    rows = np.lexsort((table.dofs[:, 1], table.dofs[:, 0]))
    return GridTable(table.ids[order], table.positions[order], table.axes[order], table.dofs[rows])


def _words(name: str, fields: list[Any], width: int) -> bytes:
    """Return the fields of an entry as words of 8 bytes, as many as a record has of it."""
    if name == "CONM2":
        fields = fields[: BLANK - 1] + fields[BLANK:]
    elif name == "PBEAM":
        fields = _stations(fields)
    elif name in ("PCOMP", "PCOMPG"):
        size, first = (4, 0) if name == "PCOMP" else (8, 1)
        layers = [(fields[k + first : k + size] + [0] * 4)[:4] for k in range(8, len(fields), size)]
        layers = [layer for layer in layers if any(isinstance(x, int | float) for x in layer)]
        # materials and thicknesses that are blank are those of the layer before
        for before, layer in pairwise(layers):
            layer[:2] = [x or y for x, y in zip(layer[:2], before)]
        sign = -1 if "SYM" in fields[:8] else 1
        fields = [fields[0], sign * len(layers), *fields[1:7], *(x for one in layers for x in one)]
        width = len(fields)
    elif name == "PCOMPS":
        width = LAYER * (1 + -(-len(fields) // LAYER))
        fields = [*fields, *[0] * (width - LAYER - len(fields)), *[-1] * LAYER]
    out = np.zeros(width or 1, dtype="<i8")
    for k, value in enumerate(fields[: len(out)]):
        if isinstance(value, float):
            out[k : k + 1].view("<f8")[0] = value
        elif isinstance(value, int):
            out[k] = value
    return out.tobytes()


def _stations(fields: list[Any]) -> list[Any]:
    """Return the fields of PBEAM as its record has them: property, material, and up to eleven stations of 16 words."""
    fields = fields + [""] * 16
    stations = [["", "", *fields[2:16]]]
    at = 16
    while isinstance(fields[at], str) and fields[at].startswith(("YES", "NO")):
        told = fields[at : at + 8] + [""] * 8
        stations.append(told)
        at += 16 if fields[at] == "YES" else 8
        fields += [""] * 16
    # blank at another station is what end A has
    first = stations[0]
    stations = [
        first,
        *([*one[:2], *(x if x != "" else y for x, y in zip(one[2:], first[2:]))] for one in stations[1:]),
    ]
    empty = [[""] * 16] * (11 - len(stations))
    return [*fields[:2], "", "", "", *(x for one in (*stations, *empty) for x in one)]


def corner_shares(corners: np.ndarray) -> np.ndarray:
    """Return the volumes, or areas, at the corners of elements: the integrals of their linear shape functions.

    Parameters
    ----------
    corners : ndarray, shape (n, 4, 3) or (n, 8, 3)
        Of surfaces, around, and of solids, the lower four and then the upper four.
    """
    signs = np.array(
        [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
    )
    count = corners.shape[1]
    signs = signs[:count, : 2 if count == 4 else 3]
    out = np.zeros(corners.shape[:2])
    for point in GAUSS * signs:
        factors = 0.5 * (1.0 + signs * point)
        value = factors.prod(axis=1)
        slopes = np.array(
            [0.5 * signs[:, k] * np.delete(factors, k, axis=1).prod(axis=1) for k in range(signs.shape[1])]
        )
        along = np.einsum("ki,nij->nkj", slopes, corners)
        if count == 4:
            size = np.linalg.norm(np.cross(along[:, 0], along[:, 1]), axis=1)
        else:
            size = np.abs(np.linalg.det(along))
        out += size[:, None] * value
    return out


def _parameter(told: bytes, name: str, real: str) -> float:
    """Return a number of the table of parameters, PVT0: name of two words, kind and value; 1 if it is not there."""
    word = int(real[-1])
    at = told.find(name.ljust(8).encode())
    if word != 4 or at < 0 or len(told) < at + 16:
        return 1.0
    return float(np.frombuffer(told, real, 1, at + 12)[0])
