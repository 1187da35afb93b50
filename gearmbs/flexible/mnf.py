"""Modal neutral files of ADAMS/Flex: read, checked, turned into a modal body, and written.

A file of version 6 holds big-endian (XDR) numbers: integers of 4 bytes, floats of 8, text one character to 4 bytes. A
header of fixed size ends with flags that tell which blocks follow: nodes, mass properties, eigenvalues, shapes, nodal
masses, nodal inertias, units, faces, transformation of the shapes, interface nodes, stresses at nodes, statistics of
the modes. The last two are followed to the end of the file, so that one that is cut is known, and kept as they are; the
statistics repeat the greatest length of each shape, which is compared. The format has no checksum: files of this
package carry the SHA-256 of their content in the comments of the header. The nine invariants that ADAMS computes follow
from nodal masses, inertias and shapes.
"""

from __future__ import annotations

import hashlib
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from gearmbs.flexible.material import FlexibleError
from gearmbs.flexible.mnf_content import SI, ModalNeutralFile, check_numbers
from gearmbs.flexible.modal_model import ModalModel, Seat
from gearmbs.progress import waiting
from gearmbs.wording import of_adams, warn

SAME = 1e-12
"""Largest difference of two places that move alike, in m and in what a unit of a mode moves and turns them."""
VERSION = b"\x00\x00\x01\x3c"
HEADER = 0xA14
"""Bytes before the number of nodes."""
FLAGS = HEADER - 400
"""First of the flags of content; block b of ADAMS's numbering is number b - 4 up to the nodal inertias."""
F_TOPOLOGY, F_INERTIAS, F_UNITS, F_STIFFNESS, F_MASS = 1, 6, 8, 9, 10
F_FACES, F_DAMPING, F_TRANSFORM, F_INTERFACE, F_STRESS, F_STATISTICS = 12, 13, 14, 15, 16, 28
BLOCK = 2
"""ADAMS's number of a block from the faces on, less the place of its flag."""
COMMENTS = 0x504
"""Byte of the comments in the header; the flags end them."""
MARK = "gearmbs SHA-256 ".encode("utf-32-be")
SAME_LENGTH = 1e-6
"""Relative difference of a shape's greatest length from that of the statistics, whose programs round to 4 bytes."""
NEEDED = {0: "nodes", 2: "global properties", 3: "eigenvalues", 4: "mode shapes", 5: "nodal masses", F_UNITS: "units"}
UNKNOWN = {
    F_TOPOLOGY: "element topology", 7: "block 7", F_STIFFNESS: "generalised stiffness", 11: "block 11",
    F_MASS: "generalised mass", F_DAMPING: "generalised damping",
}  # fmt: skip
LARGEST = 10_000_000
"""A greater number of nodes, modes or entries is none: what is read there is something else."""


@waiting("reading the modes")
def read_mnf(path: str | Path) -> ModalNeutralFile:
    """Read a modal neutral file of version 6.

    Raises
    ------
    FlexibleError
        For another version or byte order, a file that is cut off, numbers that cannot be, nodes that differ between
        blocks: with the block and the byte at which it happens. Nothing is returned of such a file. Also if there is
        no such file.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        what = "there is no such file" if isinstance(error, FileNotFoundError) else f"{error.strerror}"
        raise FlexibleError(
            f"path = '{path}': {what}; give a modal neutral file (.mnf), as finite element programs and "
            "gearmbs.flexible.write_mnf write it"
        ) from None
    label = f"{Path(path).name}"
    if data[:4] == VERSION[::-1]:
        raise FlexibleError(
            f"{label}: byte 0: the numbers are little-endian; write the file platform independent (XDR)"
        )
    if data[:4] != VERSION:
        raise FlexibleError(
            f"{label}: byte 0: {data[:4].hex()} is not the version code of an MNF of version 6 (0000013c)"
            f"{of_adams(path)}"
        )
    r = Reader(data, label)
    r.at = FLAGS
    flags = r.ints(100, "content summary")
    for place, flag in enumerate(flags):
        if flag not in (0, 1):
            r.wrong("content summary", f"flag {place} is {flag}, where 0 and 1 are no and yes", 4 * (100 - place))
    for place, what in NEEDED.items():
        if not flags[place]:
            raise FlexibleError(f"{label}: the file has no {what}; write it with all standard blocks")
    for place, what in UNKNOWN.items():
        if flags[place]:
            raise FlexibleError(f"{label}: the file has {what}, which is not understood; write it without")
    r.at = HEADER
    count, dimension = r.ints(2, "nodes")
    r.count(count, "nodes")
    if dimension != 3:
        raise FlexibleError(f"{label}: byte {HEADER + 4}: nodes of {dimension} coordinates; 3 are understood")
    nodes = r.records([("id", ">i4"), ("x", ">f8", (3,))], count, "nodes")
    ids = nodes["id"].astype(int)
    if np.unique(ids).size != count:
        raise FlexibleError(f"{label}: block of nodes: numbers of nodes are there twice")
    overall = r.floats(13, "global properties")
    n = r.count(r.ints(1, "eigenvalues")[0], "eigenvalues")
    eigen = r.records([("id", ">i4"), ("v", ">f8", (5,))], n, "eigenvalues")
    shapes = _read_shapes(r, n, ids)
    masses = _read_masses(r, ids)
    inertias = _read_inertias(r, ids) if flags[F_INERTIAS] else None
    first_unit = r.at
    units = tuple(r.text(16, "units") for _ in range(4))
    unit_bytes = data[first_unit : r.at]
    faces = _read_faces(r, count) if flags[F_FACES] else []
    transformation, interfaces = None, np.zeros(0, dtype=int)
    if flags[F_TRANSFORM]:
        size = r.count(r.ints(1, "transformation")[0], "transformation")
        if size != n:
            r.wrong("transformation", f"it is of {size} shapes, the file has {n}", 4)
        r.ints(size, "transformation")
        transformation = r.floats(size * size, "transformation").reshape(size, size)
    if flags[F_INTERFACE]:
        rows = np.array(r.ints(r.count(r.ints(1, "interface nodes")[0], "interface nodes"), "interface nodes"))
        if rows.min() < 0 or rows.max() >= count:
            r.wrong("interface nodes", f"row {rows.max()} of {count} nodes", 4 * rows.size)
        interfaces = ids[rows]
    first = r.at
    statistics = _follow_to_end(r, flags, ids, n)
    found = ModalNeutralFile(
        ids, nodes["x"].astype(float), float(overall[0]), overall[1:4].copy(), overall[4:].reshape(3, 3).copy(),
        eigen["id"].astype(int), eigen["v"].astype(float), shapes, masses, inertias, units, faces,  # type: ignore[arg-type]
        transformation, interfaces, data[:HEADER], unit_bytes, data[first:],
    )  # fmt: skip
    check_numbers(found, label)
    if statistics is not None:
        _check_lengths(found, statistics, label)
    if _marked(data) and _stamped(data) != data:
        raise FlexibleError(
            f"{label}: its content is not what was written (SHA-256 in the comments of its header): it is damaged; "
            "write it anew. If another program changed it on purpose, clear those comments"
        )
    return found


def write_mnf(path: str | Path, mnf: ModalNeutralFile) -> None:
    """Write a modal neutral file; it appears under its name when it is whole.

    Parameters
    ----------
    path : str or Path
    mnf : ModalNeutralFile
        As read, or made by :func:`mnf_of`.
    """
    path = Path(path)
    header = bytearray(mnf.header or _header(mnf))
    count, n = len(mnf.ids), len(mnf.mode_ids)
    parts = [
        ints_bytes(count, 3),
        record_bytes([("id", ">i4"), ("x", ">f8", (3,))], (mnf.ids, mnf.positions)),
        floats_bytes(mnf.mass, mnf.centre, mnf.inertia),
        ints_bytes(n),
        record_bytes([("id", ">i4"), ("v", ">f8", (5,))], (mnf.mode_ids, mnf.eigenvalues)),
        ints_bytes(n, count, *mnf.ids),
        record_bytes([("id", ">i4"), ("v", ">f8", (count, 6))], (mnf.mode_ids, mnf.shapes)),
        ints_bytes(count, 1),
        record_bytes([("id", ">i4"), ("m", ">f8")], (mnf.ids, mnf.nodal_masses)),
    ]
    if mnf.nodal_inertias is not None:
        columns = mnf.nodal_inertias.T
        parts += [ints_bytes(columns.shape[1]), record_bytes([(k, ">i4") for k in "nrc"] + [("v", ">f8")], columns)]
    parts.append(mnf.unit_bytes or b"".join(text_bytes(unit, 16) for unit in mnf.units))
    if mnf.faces:
        flat = [k for face in mnf.faces for k in (len(face), *face)]
        parts.append(ints_bytes(4 * len(flat) + 16, 0, len(mnf.faces), len(flat), *flat))
    if mnf.transformation is not None:
        parts += [ints_bytes(n, *mnf.mode_ids), floats_bytes(mnf.transformation)]
    if mnf.interfaces.size:
        place = {int(k): row for row, k in enumerate(mnf.ids)}
        parts += [ints_bytes(mnf.interfaces.size, *(place[int(k)] for k in mnf.interfaces))]
    whole = bytes(header) + b"".join(parts) + mnf.tail
    part = path.with_name(path.name + ".part")
    part.write_bytes(_stamped(whole) if _marked(whole) else whole)
    part.replace(path)


def mnf_of(model: ModalModel, title: str = "") -> ModalNeutralFile:
    """Return the modal neutral file of a modal body: its rigid motions, then its modes, in kg, m, s and N.

    Seats become interface nodes.

    Parameters
    ----------
    model : ModalModel
        With masses at its nodes, as those reduced from finite elements or read from such a file have.
    title : str
        Default: the name of the model.

    Raises
    ------
    FlexibleError
        If the model has no nodal masses.
    """
    if model.masses is None:
        raise FlexibleError(f"{model.name}: it has no masses at its nodes; a modal neutral file needs them")
    model, interfaces = with_seat_nodes(model)
    assert model.masses is not None
    p = model.properties
    arm = model.positions - p.com
    values, axes = np.linalg.eigh(p.inertia)
    count, n = len(model.ids), 6 + model.modes
    shapes = np.zeros((n, count, 6))
    for c in range(3):
        shapes[c, :, c] = 1.0 / np.sqrt(p.mass)
        turn = axes[:, c] / np.sqrt(values[c])
        shapes[3 + c, :, :3], shapes[3 + c, :, 3:] = np.cross(turn, arm), turn
    shapes[6:, :, :3] = model.moved
    if model.turned is not None:
        shapes[6:, :, 3:] = model.turned
    mass = np.concatenate([np.ones(6), np.diag(model.integrals.mass)])
    frequency = np.concatenate([np.zeros(6), model.frequencies])
    root = 2 * np.pi * frequency
    eigenvalues = np.column_stack([root**2, frequency, root, mass, root**2 * mass])
    rows = None
    if model.inertias is not None and np.any(model.inertias):
        rows = np.array(
            [(k, r + 4, c + 4, j[r, c]) for k, j in zip(model.ids, model.inertias) for r in range(3)
             for c in range(r + 1) if r == c or j[r, c] != 0.0]
        )  # fmt: skip
    origin = p.inertia + p.mass * (p.com @ p.com * np.eye(3) - np.outer(p.com, p.com))
    faces = [] if model.faces is None else [np.asarray(f) for f in model.faces]
    found = ModalNeutralFile(
        np.asarray(model.ids), model.positions, p.mass, p.com, origin, np.arange(1, n + 1), eigenvalues, shapes,
        model.masses, rows, SI, faces, np.eye(n),
        np.array(sorted(set(interfaces.values())), dtype=int),
    )  # fmt: skip
    return replace(found, header=_header(found, title or model.name))


def with_seat_nodes(model: ModalModel) -> tuple[ModalModel, dict[str, int]]:
    """Return the body with a node without mass for each seat that no node moves like, and the node of each seat.

    Such seats are the middles of bores, places between nodes, and all whose rotation the nodes do not have.
    """
    nodes: dict[str, int] = {}
    added: list[Seat] = []
    following = int(model.ids.max()) + 1
    for name, seat in model.seats.items():
        row = int(np.argmin(np.linalg.norm(model.positions - seat.position, axis=1)))
        if _moves_like(model, row, seat):
            nodes[name] = int(model.ids[row])
            continue
        same = next((k for k, other in enumerate(added) if _alike(other, seat)), len(added))
        if same == len(added):
            added.append(seat)
        nodes[name] = following + same
    if not added:
        return model, nodes
    turned = np.zeros_like(model.moved) if model.turned is None else model.turned
    count = len(added)
    return replace(
        model,
        ids=np.concatenate([model.ids, following + np.arange(count)]),
        positions=np.vstack([model.positions, [seat.position for seat in added]]),
        moved=np.concatenate([model.moved, np.stack([seat.moved for seat in added], axis=1)], axis=1),
        turned=np.concatenate([turned, np.stack([seat.turned for seat in added], axis=1)], axis=1),
        masses=None if model.masses is None else np.concatenate([model.masses, np.zeros(count)]),
        inertias=None if model.inertias is None else np.concatenate([model.inertias, np.zeros((count, 3, 3))]),
    ), nodes  # fmt: skip


def _moves_like(model: ModalModel, row: int, seat: Seat) -> bool:
    """Return whether a node is where a seat is, and moves as it."""
    turned = np.zeros_like(seat.turned) if model.turned is None else model.turned[:, row]
    return _alike(Seat(model.positions[row], model.moved[:, row], turned), seat)


def _alike(one: Seat, other: Seat) -> bool:
    """Return whether two places are the same and move alike."""
    return all(
        np.allclose(getattr(one, part), getattr(other, part), rtol=SAME, atol=SAME)
        for part in ("position", "moved", "turned")
    )


def _header(mnf: ModalNeutralFile, title: str = "") -> bytes:
    """Return a header with the flags of what a file holds."""
    out = bytearray(HEADER)
    out[:4] = VERSION
    flags = np.zeros(100, dtype=">i4")
    flags[list(NEEDED)] = 1
    present = ((F_INERTIAS, mnf.nodal_inertias is not None), (F_FACES, bool(mnf.faces)),
               (F_TRANSFORM, mnf.transformation is not None), (F_INTERFACE, mnf.interfaces.size > 0))  # fmt: skip
    for place, there in present:
        flags[place] = int(there)
    text = text_bytes(title[:60], 60)
    out[4 : 4 + len(text)] = text
    out[COMMENTS : COMMENTS + len(MARK)] = MARK
    out[FLAGS:HEADER] = flags.tobytes()
    return bytes(out)


def _marked(data: bytes) -> bool:
    """Return whether the comments of a file announce the SHA-256 of its content."""
    return data[COMMENTS : COMMENTS + len(MARK)] == MARK


def _stamped(data: bytes) -> bytes:
    """Return a file with the SHA-256 of all its other bytes in the comments, 64 characters of 4 bytes."""
    first = COMMENTS + len(MARK)
    head, rest = data[:first], data[first + 4 * 64 :]
    return head + text_bytes(hashlib.sha256(head + rest).hexdigest(), 64) + rest


def _follow_to_end(r: Reader, flags: tuple[int, ...], ids: np.ndarray, n: int) -> np.ndarray | None:
    """Follow what comes after the interface nodes to the end of the file, and return the statistics of the modes."""
    if flags[F_STRESS]:
        shapes, nodes = r.ints(2, "nodal stresses")
        _same_nodes(r, np.array(r.ints(r.count(nodes, "nodal stresses"), "nodal stresses")), ids, "nodal stresses")
        r.records([("id", ">i4"), ("v", ">f8", (nodes, 6))], r.count(shapes, "nodal stresses", True), "nodal stresses")
    others = [str(k + BLOCK) for k in range(F_STRESS + 1, len(flags)) if flags[k] and k != F_STATISTICS]
    if others:
        if r.at == len(r.data):
            r.wrong(f"number {others[0]}", "the file ends here, and its summary names this block; it is cut off")
        warn(
            f"{r.label}: of its blocks {', '.join(others)} the length is not known: whether the file is whole after "
            f"byte {r.at} cannot be told. What is read stands before it",
        )
        return None
    statistics = None
    if flags[F_STATISTICS]:
        found = r.ints(1, "modal statistics")[0]
        if found != n:
            r.wrong("modal statistics", f"they are of {found} modes, the file has {n}", 4)
        statistics = r.records([("k", ">i4", (13,)), ("v", ">f8", (13,))], n, "modal statistics")["v"].astype(float)
    if r.at != len(r.data):
        warn(
            f"{r.label}: {len(r.data) - r.at} bytes from byte {r.at} on are of no block that its summary names; they "
            "are not looked at",
        )
    return statistics


def _check_lengths(found: ModalNeutralFile, statistics: np.ndarray, label: str) -> None:
    """Refuse shapes whose greatest displacement or rotation is not that of the statistics."""
    for column, part, what in ((0, found.shapes[:, :, :3], "displacement"), (1, found.shapes[:, :, 3:], "rotation")):
        own = np.linalg.norm(part, axis=2).max(axis=1)
        wrong = np.abs(own - statistics[:, column]) > SAME_LENGTH * np.maximum(own, statistics[:, column])
        if wrong.any():
            k = int(np.argmax(wrong))
            raise FlexibleError(
                f"{label}: mode {found.mode_ids[k]}: its greatest {what} is {own[k]:.6g}, its statistics say "
                f"{statistics[k, column]:.6g}; the shapes are damaged"
            )


def _read_shapes(r: Reader, n: int, ids: np.ndarray) -> np.ndarray:
    found, nodes = r.ints(2, "mode shapes")
    if found != n or nodes != ids.size:
        r.wrong("mode shapes", f"{found} shapes of {nodes} nodes, but {n} eigenvalues and {ids.size} nodes", 8)
    if not np.array_equal(r.ints(nodes, "mode shapes"), ids):
        r.wrong("mode shapes", "the nodes are not those of the block of nodes, or in another order", 4 * nodes)
    return r.records([("id", ">i4"), ("v", ">f8", (nodes, 6))], n, "mode shapes")["v"].astype(float)


def _read_masses(r: Reader, ids: np.ndarray) -> np.ndarray:
    count, _ = r.ints(2, "nodal masses")
    if count != ids.size:
        r.wrong("nodal masses", f"there are {count} for {ids.size} nodes", 8)
    rows = r.records([("id", ">i4"), ("m", ">f8")], count, "nodal masses")
    if not np.array_equal(rows["id"], ids):
        r.wrong("nodal masses", "the nodes are not those of the block of nodes, or in another order", 12 * count)
    if np.any(rows["m"] < 0.0):
        r.wrong("nodal masses", f"node {rows['id'][np.argmin(rows['m'])]} has {rows['m'].min()}", 12 * count)
    return rows["m"].astype(float)


def _read_inertias(r: Reader, ids: np.ndarray) -> np.ndarray:
    rows = r.records([("n", ">i4"), ("r", ">i4"), ("c", ">i4"), ("v", ">f8")], r.count(r.ints(1, "nodal inertias")[0],
                     "nodal inertias"), "nodal inertias")  # fmt: skip
    _same_nodes(r, rows["n"], ids, "nodal inertias")
    places = np.concatenate([rows["r"], rows["c"]])
    if places.size and (places.min() < 4 or places.max() > 6):
        r.wrong("nodal inertias", f"rows and columns are 4 to 6, not {places.min()} to {places.max()}", 20 * rows.size)
    return np.column_stack([rows[k].astype(float) for k in "nrcv"])


def _read_faces(r: Reader, count: int) -> list[np.ndarray]:
    size, _, number, total = r.ints(4, "element faces")
    if size != 4 * total + 16:
        r.wrong("element faces", f"{size} bytes are announced for {total} numbers", 16)
    flat, faces, at = np.array(r.ints(r.count(total, "element faces", True), "element faces")), [], 0
    for _ in range(number):
        if at >= flat.size or at + 1 + flat[at] > flat.size:
            r.wrong("element faces", f"{number} faces do not fit {total} numbers", 4 * total)
        faces.append(flat[at + 1 : at + 1 + flat[at]].astype(int))
        at += 1 + flat[at]
    if any(face.size and (face.min() < 0 or face.max() >= count) for face in faces):
        r.wrong("element faces", "a face names a node that does not exist", 4 * total)
    return faces


def _same_nodes(r: Reader, nodes: np.ndarray, ids: np.ndarray, block: str) -> None:
    wrong = np.setdiff1d(nodes, ids)
    if wrong.size:
        r.wrong(block, f"node {wrong[0]} is not among the nodes", 0)


# Big-endian numbers of a file, read with the block and byte in every complaint, and written.


class Reader:
    """Reads numbers from bytes, one block after the other.

    Parameters
    ----------
    data : bytes
    label : str
        Of the file, for messages.
    """

    def __init__(self, data: bytes, label: str) -> None:
        self.data = data
        self.label = label
        self.at = 0

    def wrong(self, block: str, what: str, back: int = 0) -> NoReturn:
        """Raise the error of a block; ``back`` is how many bytes ago it began."""
        raise FlexibleError(f"{self.label}: byte {self.at - back}, block of {block}: {what}")

    def take(self, size: int, block: str) -> bytes:
        """Return the next bytes."""
        if self.at + size > len(self.data):
            self.wrong(block, f"the file ends after {len(self.data)} bytes, {size} more are needed here; it is cut off")
        part = self.data[self.at : self.at + size]
        self.at += size
        return part

    def ints(self, count: int, block: str) -> tuple[int, ...]:
        """Return whole numbers."""
        return struct.unpack(f">{count}i", self.take(4 * count, block))

    def count(self, number: int, block: str, none: bool = False) -> int:
        """Return a number of things that was just read, if it can be one."""
        if not (0 if none else 1) <= number <= LARGEST:
            self.wrong(block, f"{number} is no number of them; another byte order, or a block before it is longer", 4)
        return number

    def records(self, fields: list[tuple], count: int, block: str) -> np.ndarray:
        """Return rows of named fields; floats must be finite."""
        kind = np.dtype(fields)
        rows = np.frombuffer(self.take(kind.itemsize * count, block), kind)
        for name in kind.names or ():
            if kind[name].base.kind == "f" and not np.all(np.isfinite(rows[name])):
                self.wrong(block, "it has numbers that are not finite", kind.itemsize * count)
        return rows

    def floats(self, count: int, block: str) -> np.ndarray:
        """Return finite floats."""
        return self.records([("v", ">f8")], count, block)["v"].astype(float)

    def text(self, length: int, block: str) -> str:
        """Return a text of so many characters, 4 bytes each, without what fills it up."""
        codes = self.ints(length, block)
        return "".join(chr(c) for c in codes if 32 <= c < 127).strip()


def ints_bytes(*numbers: int) -> bytes:
    """Return whole numbers as bytes."""
    return np.array([int(k) for k in numbers], dtype=">i4").tobytes()


def floats_bytes(*parts: Any) -> bytes:
    """Return floats as bytes."""
    return b"".join(np.asarray(part, dtype=">f8").tobytes() for part in parts)


def record_bytes(fields: list[tuple], columns: Any) -> bytes:
    """Return rows of named fields as bytes."""
    kind = np.dtype(fields)
    rows = np.zeros(len(columns[0]), kind)
    for name, column in zip(kind.names or (), columns):
        rows[name] = column
    return rows.tobytes()


def text_bytes(text: str, length: int) -> bytes:
    """Return a text as so many characters of 4 bytes each, filled up with zeros."""
    return text[:length].encode("utf-32-be", "replace").ljust(4 * length, b"\0")
