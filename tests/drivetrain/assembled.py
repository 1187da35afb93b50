"""Matrices of a gearbox, assembled from published elements: what flexible drivetrains are compared with.

Timoshenko elements with consistent masses (Friswell, Penny, Garvey, Lees, *Dynamics of Rotating Machines*, section 5.4)
and Cowper's shear coefficient of a solid circle; wheels are rigid discs, a mesh one spring along its normal, a bearing
a spring along each axis. Nothing of the package is used.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

X, Y, Z, RX, RY, RZ = range(6)


def bending(l, phi, ei, mass, inertia):
    """Return stiffness and mass of a plane element over (w, psi, w, psi); mass and inertia are per length."""
    k = np.array([[12, 6 * l, -12, 6 * l], [0, (4 + phi) * l**2, -6 * l, (2 - phi) * l**2], [0, 0, 12, -6 * l],
                  [0, 0, 0, (4 + phi) * l**2]])  # fmt: skip
    a = (312 + 588 * phi + 280 * phi**2, (44 + 77 * phi + 35 * phi**2) * l, 108 + 252 * phi + 140 * phi**2,
         -(26 + 63 * phi + 35 * phi**2) * l, (8 + 14 * phi + 7 * phi**2) * l**2,
         -(6 + 14 * phi + 7 * phi**2) * l**2)  # fmt: skip
    one = np.array([[a[0], a[1], a[2], a[3]], [0, a[4], -a[3], a[5]], [0, 0, a[0], -a[1]], [0, 0, 0, a[4]]])
    b = (36, (3 - 15 * phi) * l, (4 + 5 * phi + 10 * phi**2) * l**2, (-1 - 5 * phi + 5 * phi**2) * l**2)
    two = np.array([[b[0], b[1], -b[0], b[1]], [0, b[2], -b[1], b[3]], [0, 0, b[0], -b[1]], [0, 0, 0, b[2]]])
    m = mass * l / (840 * (1 + phi) ** 2) * one + inertia / (30 * l * (1 + phi) ** 2) * two
    k = ei / (l**3 * (1 + phi)) * k
    return k + np.triu(k, 1).T, m + np.triu(m, 1).T


def element(l, diameter, e=2.1e11, nu=0.3, density=7850.0):
    """Return stiffness and mass, 12 x 12, of a solid round element along z."""
    g, area, second = e / (2 * (1 + nu)), np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
    kappa = 6 * (1 + nu) / (7 + 6 * nu)
    phi = 12 * e * second / (kappa * g * area * l**2)
    k, m = np.zeros((12, 12)), np.zeros((12, 12))
    plane, weight = bending(l, phi, e * second, density * area, density * second)
    for at, sign in (([X, RY, 6 + X, 6 + RY], 1.0), ([Y, RX, 6 + Y, 6 + RX], -1.0)):
        turn = np.diag([1.0, sign, 1.0, sign])
        k[np.ix_(at, at)] += turn @ plane @ turn
        m[np.ix_(at, at)] += turn @ weight @ turn
    for at, stiff, heavy in ((Z, e * area, density * area), (RZ, g * 2 * second, density * 2 * second)):
        k[np.ix_([at, 6 + at], [at, 6 + at])] += stiff / l * np.array([[1, -1], [-1, 1]])
        m[np.ix_([at, 6 + at], [at, 6 + at])] += heavy * l / 6 * np.array([[2, 1], [1, 2]])
    return k, m


class Assembly:
    """Shafts side by side along z, and a body of finite elements, to which discs, springs and dampers are added."""

    def __init__(self, shafts):
        """Take (stations, diameter, place of the axis) of each shaft."""
        self.stations = [np.asarray(z, dtype=float) for z, _, _ in shafts]
        self.axes = [np.asarray(place, dtype=float) for _, _, place in shafts]
        self.starts = np.cumsum([0, *(6 * z.size for z in self.stations)])
        self.k, self.m, self.c = np.zeros((3, self.starts[-1], self.starts[-1]))
        for number, (z, diameter, _) in enumerate(shafts):
            for n, l in enumerate(np.diff(z)):
                k, m = element(l, diameter)
                at = self.starts[number] + 6 * n
                self.k[at : at + 12, at : at + 12] += k
                self.m[at : at + 12, at : at + 12] += m

    def row(self, shaft, z):
        """Return the first degree of freedom of the node at a station."""
        n = int(np.argmin(np.abs(self.stations[shaft] - z)))
        assert abs(self.stations[shaft][n] - z) < 1e-9
        return self.starts[shaft] + 6 * n

    def point(self, shaft, z):
        """Return the place of a station."""
        return np.append(self.axes[shaft], z)

    def disc(self, shaft, z, mass, across, polar):
        """Add a rigid disc."""
        at = self.row(shaft, z)
        self.m[np.arange(at, at + 6), np.arange(at, at + 6)] += [mass] * 3 + [across, across, polar]

    def motion(self, shaft, z, direction, place):
        """Return the row that gives the motion along a direction of a point that turns with the shaft at a station."""
        at, out = self.row(shaft, z), np.zeros(len(self.k))
        out[at : at + 3] = direction
        out[at + 3 : at + 6] = np.cross(place - self.point(shaft, z), direction)
        return out

    def spring(self, change, stiffness, damping=0.0):
        """Add a spring and a damper whose length changes as a row says."""
        self.k += stiffness * np.outer(change, change)
        self.c += damping * np.outer(change, change)

    def bearing(self, shaft, z, stiffness, time=0.0, seat=None):
        """Add springs along x, y and z on the ground, or on three rows of what carries it."""
        for n, one in enumerate(stiffness):
            change = self.motion(shaft, z, np.eye(3)[n], self.point(shaft, z))
            self.spring(change if seat is None else change - seat[n], one, time * one)

    def mesh(self, one, two, normal, place, stiffness):
        """Add a spring along a normal through a place between two wheels, each (shaft, z); return its row."""
        change = self.motion(*one, normal, place) - self.motion(*two, normal, place)
        self.spring(change, stiffness)
        return change

    def body(self, stiffness, mass):
        """Add a body by its matrices; return where it begins."""
        start, size = len(self.k), len(self.k) + len(stiffness)
        for name, block in (("k", stiffness), ("m", mass), ("c", 0.0 * mass)):
            whole = np.zeros((size, size))
            whole[:start, :start], whole[start:, start:] = getattr(self, name), block
            setattr(self, name, whole)
        return start

    def seat(self, start, positions, inside, place):
        """Return three rows: the mean motion, by least squares, of nodes with three displacements at a place."""
        arms = positions[inside] - place
        motions = np.zeros((3 * len(arms), 6))
        motions[:, :3] = np.tile(np.eye(3), (len(arms), 1))
        for n in range(3):
            motions[:, 3 + n] = np.cross(np.eye(3)[n], arms).ravel()
        fitted = np.linalg.pinv(motions)[:3]
        rows = np.zeros((3, len(self.k)))
        columns = start + (3 * np.flatnonzero(inside)[:, None] + np.arange(3)).ravel()
        rows[:, columns] = fitted
        return rows

    def frequencies(self, held=()):
        """Return natural frequencies without damping, Hz, with some degrees of freedom held."""
        free = np.setdiff1d(np.arange(len(self.k)), held)
        k, m = self.k[np.ix_(free, free)], self.m[np.ix_(free, free)]
        return np.sqrt(np.maximum(scipy.linalg.eigh(k, m, eigvals_only=True), 0.0)) / (2 * np.pi)

    def response(self, load, frequency, held=()):
        """Return complex displacements under a load at a frequency, Hz."""
        free, omega = np.setdiff1d(np.arange(len(self.k)), held), 2 * np.pi * frequency
        whole = self.k + 1j * omega * self.c - omega**2 * self.m
        out = np.zeros(len(self.k), dtype=complex)
        out[free] = np.linalg.solve(whole[np.ix_(free, free)], load[free])
        return out


def normal_at_pitch_point(first, second, radii, helix, sense, right):
    """Return normal and pitch point of external wheels with axes along z.

    Parameters
    ----------
    first, second : ndarray
        Centres of the wheels.
    radii : tuple of float
        Base radii.
    helix : float
        Base helix angle, rad.
    sense : int
        Of the first wheel, which pushes.
    right : bool
        Whether its helix is right-handed.
    """
    apart = np.linalg.norm(second - first)
    way = (second - first) / apart
    up = np.cross([0.0, 0.0, 1.0], way)
    alpha = np.arccos(sum(radii) / apart)
    along = np.cos(alpha) * sense * up + np.sin(alpha) * way
    lean = -sense * (1.0 if right else -1.0) * np.sin(helix)
    normal = np.cos(helix) * along + lean * np.array([0.0, 0.0, 1.0])
    return normal, first + way * radii[0] / np.cos(alpha)
