"""Springs, bushings, fields and beams as force elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gearmbs.mechanism.parts.elements import Compiled, ForceElement, Setting
from gearmbs.mechanism.parts.quantities import Reader, reader
from gearmbs.units import shown

SI_UNITS = {
    "force": "N", "torque": "N*m", "length": "m", "angle": "rad", "time": "s", "stiffness": "N/m", "damping": "N*s/m",
    "rotational_stiffness": "N*m/rad", "rotational_damping": "N*m*s/rad",
}  # fmt: skip
"""SI unit of each dimension of the function language that loads have."""


def readers(dimensions: Mapping[str, str]) -> dict[str, Reader]:
    """Return what reads the numbers of attributes, SI or texts with a unit, from their dimensions."""
    return {name: reader(SI_UNITS[dimension]) for name, dimension in dimensions.items()}


def _settings(units: Mapping[str, str]) -> dict[str, Setting]:
    """Return the reals of a spring by their names, as they stand there."""
    return {name: Setting(k, unit) for k, (name, unit) in enumerate(units.items())}


@dataclass(eq=False, repr=False)
class LineSpring(ForceElement):
    """Spring and damper along the line between two markers, SPRINGDAMPER.

    Attributes
    ----------
    stiffness, damping, length, preload : float
        N/m, N s/m, m, N; the force is ``preload`` at the length.
    parameters : mapping
        The same as it was given, in the mechanism's units, for writing decks.
    """

    stiffness: float
    damping: float
    length: float
    preload: float
    parameters: Mapping[str, Any]

    dimensions: ClassVar = {"stiffness": "stiffness", "damping": "damping", "length": "length", "preload": "force"}
    reads = readers(dimensions)
    settled = (*ForceElement.settled, "parameters")
    kind = "springdamper"
    has_torque = False

    def compiled(self) -> Compiled:
        from gearmbs.mechanism.forces.spring_kernel import line_spring, line_spring_changed

        reals = (self.stiffness, self.damping, self.length, self.preload)
        units = {"stiffness": "N/m", "damping": "N*s/m", "length": "m", "preload": "N"}
        return Compiled(line_spring, reals=reals, scratch=6, settings=_settings(units), changed=line_spring_changed)

    def __repr__(self) -> str:
        return (
            f"LineSpring({self.name!r}, {self.i.name!r} to {self.j.name!r}, {shown(self.stiffness, 'N/m', 'g')}, "
            f"{shown(self.damping, 'N s/m', 'g')}, {shown(self.preload, 'N', 'g')} at {shown(self.length, 'm', 'g')})"
        )


@dataclass(eq=False, repr=False)
class AxisSpring(ForceElement):
    """Spring and damper about the z axis of J, the rotational SPRINGDAMPER.

    Attributes
    ----------
    stiffness, damping, angle, preload : float
        N m/rad, N m s/rad, rad, N m; the torque is ``preload`` at the angle, which is counted through full turns.
    parameters : mapping
        The same as it was given, in the mechanism's units, for writing decks.
    """

    stiffness: float
    damping: float
    angle: float
    preload: float
    parameters: Mapping[str, Any]

    dimensions: ClassVar = {
        "stiffness": "rotational_stiffness", "damping": "rotational_damping", "angle": "angle", "preload": "torque",
    }  # fmt: skip
    reads = readers(dimensions)
    settled = (*ForceElement.settled, "parameters")
    kind = "springdamper"
    has_force = False

    def compiled(self) -> Compiled:
        from gearmbs.mechanism.forces.spring_kernel import axis_spring, axis_spring_changed

        reals = (self.stiffness, self.damping, self.angle, self.preload)
        units = {"stiffness": "N*m/rad", "damping": "N*m*s/rad", "angle": "rad", "preload": "N*m"}
        return Compiled(
            axis_spring, reals=reals, angles=((2, self.i, self.j),), scratch=9, settings=_settings(units),
            changed=axis_spring_changed,
        )  # fmt: skip

    def __repr__(self) -> str:
        return (
            f"AxisSpring({self.name!r}, {self.i.name!r} about z of {self.j.name!r}, "
            f"{shown(self.stiffness, 'N m/rad', 'g')}, "
            f"{shown(self.damping, 'N m s/rad', 'g')}, {shown(self.preload, 'N m', 'g')} at "
            f"{shown(self.angle, 'rad', 'g')})"
        )


@dataclass(eq=False, repr=False)
class MatrixForce(ForceElement):
    """F = preload - K (q - free) - C q' in the axes of J.

    Attributes
    ----------
    stiffness, damping : ndarray, shape (6, 6)
    free, preload : ndarray, shape (6,)
        SI; displacements and rotations of I in J's frame without load, and the load there.
    parameters : mapping
        What it was made from, in the mechanism's units, for writing decks.
    """

    stiffness: np.ndarray
    damping: np.ndarray
    free: np.ndarray
    preload: np.ndarray
    parameters: Mapping[str, Any]

    settled = (*ForceElement.settled, "stiffness", "damping", "free", "preload", "parameters")
    kind = "field"

    @property
    def has_force(self) -> bool:  # type: ignore[override]
        """Whether F is an unknown."""
        return self._loaded(slice(0, 3))

    @property
    def has_torque(self) -> bool:  # type: ignore[override]
        """Whether N is an unknown."""
        return self._loaded(slice(3, 6))

    def _loaded(self, rows: slice) -> bool:
        return any(np.any(part[rows]) for part in (self.stiffness, self.damping, self.preload))

    def compiled(self) -> Compiled:
        from gearmbs.mechanism.forces.spring_kernel import WORK, matrix_force, matrix_force_changed

        # an angle without stiffness is not looked at: it may be undetermined, as AX is when z_I stands across
        used = [axis for axis in range(3) if np.any(self.stiffness[:, 3 + axis])]
        places = [used.index(axis) if axis in used else -1 for axis in range(3)]
        reals = np.concatenate([self.stiffness.ravel(), self.damping.ravel(), self.free, self.preload])
        angles = tuple((axis, self.i, self.j) for axis in used)
        return Compiled(
            matrix_force, places, reals, angles=angles, scratch=WORK, settings=self._settings(),
            changed=matrix_force_changed,
        )  # fmt: skip

    def _settings(self) -> dict[str, Setting]:
        """Return the numbers that have a name of their own."""
        return {}

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r}, {self.i.name!r} in the axes of {self.j.name!r})"


class Field(MatrixForce):
    """Full matrices between two markers, FIELD."""


class Bushing(MatrixForce):
    """Springs and dampers along and about the axes of J, BUSHING.

    Its numbers that are not zero are set as ``stiffness_x`` to ``torsional_damping_z``.
    """

    kind = "bushing"

    def _settings(self) -> dict[str, Setting]:
        units = {
            "stiffness": "N/m", "torsional_stiffness": "N*m/rad", "damping": "N*s/m", "torsional_damping": "N*m*s/rad",
        }  # fmt: skip
        found = {}
        for k, (name, unit) in enumerate(units.items()):
            matrix, first = ((self.stiffness, 0), (self.damping, self.stiffness.size))[k // 2]
            for axis in range(3):
                place = 3 * (k % 2) + axis
                if matrix[place, place] != 0.0:
                    # the diagonal of a matrix of six rows
                    found[f"{name}_{'xyz'[axis]}"] = Setting(first + 7 * place, unit)
        return found


class Beam(MatrixForce):
    """A massless beam from J to I along x of J, BEAM."""

    kind = "beam"


def in_si(matrix: np.ndarray, units: Any, rates: bool) -> np.ndarray:
    """Return a stiffness or, for ``rates``, damping matrix given in a mechanism's units in SI."""
    load = np.repeat([units.factor("force"), units.factor("torque")], 3)
    shift = np.repeat([units.factor("length"), 1.0], 3) / (units.factor("time") if rates else 1.0)
    return np.asarray(matrix, dtype=float) * load[:, None] / shift
