"""Writes small op2 files of Nastran, record by record, for tests of their reader."""

import numpy as np


class Op2Writer:
    """Data blocks of an op2 file with words of 4 bytes, of either byte order."""

    def __init__(self, order="<"):
        self.order, self.parts = order, []

    def record(self, data: bytes):
        mark = np.array([len(data)], self.order + "i4").tobytes()
        self.parts.append(mark + data + mark)

    def key(self, *values):
        for value in values:
            self.record(self.ints(value))

    def ints(self, *values):
        return np.array(values, self.order + "i4").tobytes()

    def floats(self, values):
        return np.asarray(values, self.order + "f4").tobytes()

    def start(self, name, trailer, kind):
        self.key(2)
        self.record(name.ljust(8).encode())
        self.key(-1, 7)
        self.record(self.ints(*trailer))
        self.key(-2, 1, 0, 2)
        self.record(name.ljust(8).encode())
        self.key(-3, 1, kind)

    def table(self, name, records):
        self.start(name, (101, 0, 0, 0, 0, 0, 0), 0)
        for k, data in enumerate(records):
            self.key(len(data) // 4)
            self.record(data)
            self.key(-4 - k, 1, 0)
        self.key(0)

    def matrix(self, name, values):
        values = np.asarray(values, dtype=float)
        rows, columns = values.shape
        self.start(name, (101, columns, rows, 1, 2, rows, 10000), 1)
        for k in range(columns):
            self.key(1 + 2 * rows)
            self.record(self.ints(1) + values[:, k].astype(self.order + "f8").tobytes())
            self.key(-4 - k, 1, 1 if k + 1 < columns else 0)
        self.key(0)

    def reals(self, values, wide):
        """Numbers of 8 bytes, or 4."""
        return np.asarray(values, self.order + ("f8" if wide else "f4")).tobytes()

    def grids(self, ids, positions, systems=None, without=()):
        """GEOM1, BGPDT and EQEXIN; systems: (id, kind, origin, point on z, point on xz), and the points that use it."""
        used = np.zeros(len(ids), dtype=int)
        geometry = []
        if systems is not None:
            (number, kind, *points), users = systems
            used[np.isin(ids, users)] = number
            code = {1: (2101, 21, 8), 2: (2001, 20, 9), 3: (2201, 22, 10)}[kind]
            geometry.append(self.ints(*code) + self.ints(number, kind, 2, 0) + self.floats(np.ravel(points)))
        rows = b"".join(
            self.ints(i, 0) + self.floats(x) + self.ints(int(c), 0, 0) for i, x, c in zip(ids, positions, used)
        )
        geometry.append(self.ints(4501, 45, 1) + rows)
        tables = {
            "GEOM1": [*geometry, self.ints(65535, 65535, 65535)],
            "BGPDT": [b"".join(self.ints(int(c)) + self.floats(x) for x, c in zip(positions, used))],
        }
        pairs = [(i, k + 1) for k, i in enumerate(ids)]
        sils = [(i, 10 * (6 * k + 1) + 1) for k, i in enumerate(ids)]
        tables["EQEXIN"] = [self.ints(*np.ravel(pairs)), self.ints(*np.ravel(sils))]
        for name, records in tables.items():
            if name not in without:
                self.table(name, records)

    def entries(self, name, entries):
        """A block of the input: by key of two words the rows of an entry, numbers as float and others as int."""
        records = [
            self.ints(*key, 1)
            + b"".join(self.floats([x]) if isinstance(x, float) else self.ints(x) for row in rows for x in row)
            for key, rows in entries.items()
        ]
        self.table(name, [*records, self.ints(65535, 65535, 65535)])

    def modes(self, ids, shapes, eigenvalues, general, listed=True, block="OUGV1"):
        """LAMA, if listed, and OUGV1 of shapes (n, N, 6)."""
        w = np.sqrt(np.maximum(eigenvalues, 0.0))
        rows = b"".join(
            self.ints(k + 1, k + 1) + self.floats([v, w[k], w[k] / (2 * np.pi), g, g * v])
            for k, (v, g) in enumerate(zip(eigenvalues, general))
        )
        if listed:
            self.table("LAMA", [self.ints(*[0] * 146), rows])
        records = []
        for k, shape in enumerate(shapes):
            head = np.zeros(146, self.order + "i4")
            head[:5] = 22, 7, 0, 1, k + 1
            head[9] = 8
            real = head.view(self.order + "f4")
            real[5] = eigenvalues[k]
            records.append(head.tobytes())
            records.append(b"".join(self.ints(10 * i + 1, 1) + self.floats(x) for i, x in zip(ids, shape)))
        self.table(block, records)

    def stresses(self, elements, values, kind=67, name="OES1X1", system=0, **head):
        """OES1X1 of solids: rows of number and corners, stresses (n, elements, corners, 6) xx yy zz xy yz zx."""
        corners = len(elements[0]) - 1
        records = []
        for k, mode in enumerate(values):
            first = np.zeros(146, self.order + "i4")
            words = {0: 23, 1: 5, 2: kind, 3: 1, 4: k + 1, 8: 1, 9: 4 + 21 * (corners + 1), 10: 1}
            for place, value in (words | {int(key[1:]): value for key, value in head.items()}).items():
                first[place] = value
            rows = []
            for (number, *grids), stress in zip(elements, mode):
                rows.append(self.ints(10 * number + 3, system) + b"GRID" + self.ints(corners))
                for grid, s in zip((0, *grids), np.vstack([np.mean(stress, axis=0), stress])):
                    place = np.zeros(20)
                    place[[0, 8, 14, 1, 9, 15]] = s
                    rows.append(self.ints(grid) + self.floats(place))
            records += [first.tobytes(), b"".join(rows)]
        self.table(name, records)

    def weight(self, mass):
        """OGPWG with a mass."""
        data = np.zeros(78, self.order + "f4")
        data[[0, 7, 14]] = mass
        self.table("OGPWG", [self.ints(*[0] * 146), data.tobytes()])

    def write(self, path):
        self.key(0)
        path.write_bytes(b"".join(self.parts))
        return path
