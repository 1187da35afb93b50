"""Bodies, markers, and what all parts of a mechanism share: they have the attributes they are made with.

Whoever assigns to an attribute of what has been made is told if nothing would come of it, as of a slip in a name, and
has the value read as it is where the object is made.
"""

from __future__ import annotations

from abc import ABCMeta
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from gearmbs.dae.equations.bodies import RIGID, BodyKind
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.quantities import (
    Reader,
    Vector,
    cross,
    frame_along,
    has_quantity,
    inertia_matrix,
    mass_of,
    reader,
    rotation_matrix,
    vector,
)
from gearmbs.units import QuantityLike, shown
from gearmbs.wording import did_you_mean


class Made(ABCMeta):
    """Metaclass that reads texts and marks an object when its whole ``__init__`` has run, also of a user's class."""

    def __call__(cls, *args: Any, **options: Any) -> Any:
        made = super().__call__(*args, **options)
        own = vars(made)
        for key, read in cls.reads.items():  # type: ignore[attr-defined]
            value = own.get(key)
            if isinstance(value, str) or (isinstance(value, Sequence) and has_quantity(value)):
                own[key] = read(value, f"{cls.__name__} '{own.get('name', '')}': {key}")
        own["_made"] = True
        return made


class OwnAttributes(metaclass=Made):
    """What a mechanism and its parts share: they take values of the attributes they have, and refuse others by name."""

    reads: ClassVar[Mapping[str, Reader]] = {}
    """How values are read that are assigned, and texts that an object is made with, by attribute."""
    settled: ClassVar[tuple[str, ...]] = ()
    """Attributes from which other parts have been made already: another value would leave those as they are."""

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute that there is; names with a leading underscore are a class's own affair.

        Raises
        ------
        ModelError
            For a name that is none, an attribute that is settled, and a value that cannot be one.
        """
        own, kind = vars(self), type(self)
        if "_made" in own and name[0] != "_":
            label = f"{kind.__name__} '{own.get('name', '')}'"
            if name not in own and not hasattr(kind, name):
                known = [key for key in own if key[0] != "_" and key not in kind.settled]
                raise ModelError(
                    f"{label}: it has no attribute '{name}', so that {name} = {value!r} would do nothing; "
                    + did_you_mean(name, known, otherwise=f"it has {', '.join(known)}")
                )
            if name in kind.settled:
                raise ModelError(
                    f"{label}: {name} = {value!r} would not reach what was made from it; make another one with it"
                )
            if name in kind.reads:
                value = kind.reads[name](value, f"{label}: {name}")
        super().__setattr__(name, value)


@dataclass(eq=False)
class Marker(OwnAttributes):
    """A frame fixed in a body.

    Attributes
    ----------
    name : str
    body : Body
    position : ndarray, shape (3,)
        Origin in the body's frame, m.
    orientation : ndarray, shape (3, 3)
        Columns are the marker's axes in the body's frame.
    number : int, optional
        Its id in an ADAMS deck; expressions may use it.
    """

    name: str
    body: Body
    position: np.ndarray
    orientation: np.ndarray
    number: int | None = None

    reads: ClassVar = {
        "position": reader("length", vector),
        "orientation": rotation_matrix,
    }
    settled = ("name", "body")

    def global_position(self) -> np.ndarray:
        """Return the origin at the initial position, global components, m."""
        return self.body.position + self.body.orientation @ self.position

    def global_orientation(self) -> np.ndarray:
        """Return the axes (columns) at the initial position, global components."""
        return self.body.orientation @ self.orientation

    def velocity_at(self, place: np.ndarray) -> np.ndarray:
        """Return the velocity at the start of the point of the marker's body that is at a global place, m/s."""
        body = self.body
        return body.velocity + cross(body.angular_velocity, place - body.position)

    def __repr__(self) -> str:
        return f"Marker({self.name!r} on {self.body.name!r} at {np.array2string(self.position, precision=6)})"


@dataclass(eq=False)
class Body(OwnAttributes):
    """A rigid body. Made by :meth:`gearmbs.mechanism.Mechanism.body`.

    Attributes
    ----------
    name : str
    mass : float
        kg.
    inertia : ndarray, shape (3, 3)
        About the centre of mass, in the body's axes, kg m^2.
    com : ndarray, shape (3,)
        Centre of mass in the body's frame, m.
    position, orientation : ndarray
        The body's frame at the start: origin (m) and axes as columns, global components.
    velocity, angular_velocity : ndarray, shape (3,)
        Of the frame's origin (m/s) and of the body (rad/s), global components.
    """

    name: str
    mass: float = 0.0
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    com: np.ndarray = field(default_factory=lambda: np.zeros(3))
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    orientation: np.ndarray = field(default_factory=lambda: np.eye(3))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    angular_velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    is_ground: bool = False
    markers: list[Marker] = field(default_factory=list)

    kind: ClassVar[BodyKind] = RIGID
    reads: ClassVar = {
        "mass": mass_of,
        "inertia": inertia_matrix,
        "com": reader("length", vector),
        "position": reader("length", vector),
        "orientation": rotation_matrix,
        "velocity": reader("speed", vector),
        "angular_velocity": reader("angular speed", vector),
    }
    settled = ("name", "is_ground", "markers")

    @property
    def coordinates(self) -> int:
        """Number of coordinates."""
        return len(self.kind.directions)

    @property
    def numbers(self) -> list[float]:
        """What the equations know of the body beside mass, inertia and modes."""
        return []

    def shape_at(self, marker: Marker) -> tuple[np.ndarray, np.ndarray] | None:
        """Return displacements and rotations of a marker that is a frame of its own, a row a mode; else None."""
        return None

    def check(self, part: Any) -> None:
        """Raise a ModelError if a joint or load on the body is none that its kind can have; a rigid body has all."""

    def marker(
        self,
        position: Vector = (0.0, 0.0, 0.0),
        orientation: npt.ArrayLike | None = None,
        *,
        axis: Vector | None = None,
        name: str | None = None,
    ) -> Marker:
        """Add a marker given in the body's own frame.

        Parameters
        ----------
        position : array_like of 3 floats
            Origin, m.
        orientation : array_like, optional
            3x3 matrix or 3-1-3 Euler angles in rad; or give
        axis : array_like of 3 floats, optional
            Direction of the marker's z axis.
        """
        label = self._marker_label(name)
        matrix = (
            frame_along(axis, f"marker '{label}': axis")
            if axis is not None
            else rotation_matrix(orientation, f"marker '{label}': orientation")
        )
        marker = Marker(label, self, vector(position, f"marker '{label}': position", "length"), matrix)
        self.markers.append(marker)
        return marker

    def _marker_label(self, name: str | None) -> str:
        """Return the name of the next marker."""
        label = name or f"{self.name}.marker{len(self.markers) + 1}"
        for marker in self.markers:
            if marker.name == label:
                raise ModelError(f"marker '{label}': body '{self.name}' already has a marker of that name")
        return label

    def centre_of_mass(self) -> tuple[np.ndarray, np.ndarray]:
        """Return position and velocity of the centre of mass at the start, global components, m and m/s."""
        arm = self.orientation @ self.com
        # most bodies have their frame at the centre of mass
        velocity = self.velocity + cross(self.angular_velocity, arm) if arm.any() else self.velocity
        return self.position + arm, velocity

    def pose_record(self) -> np.ndarray:
        """Return R, A (row-major), v and omega of the centre of mass at the start, global components."""
        position, velocity = self.centre_of_mass()
        return np.concatenate([position, self.orientation.ravel(), velocity, self.angular_velocity])

    def marker_at(self, point: Vector, matrix: np.ndarray, name: str | None = None) -> Marker:
        """Add a marker given in global components at the initial position of the body."""
        label = self._marker_label(name)
        place = vector(point, f"body '{self.name}': marker position", "length")
        axes = rotation_matrix(self.orientation.T @ matrix, f"marker '{label}': orientation")
        marker = Marker(label, self, self.orientation.T @ (place - self.position), axes)
        self.markers.append(marker)
        return marker

    def placed_marker(self, point: np.ndarray, axes: np.ndarray, name: str) -> Marker:
        """Add a marker as `marker_at` does, of a position in m and a rotation matrix that have been checked."""
        place = self.orientation.T @ (point - self.position)
        marker = Marker(self._marker_label(name), self, place, self.orientation.T @ axes)
        self.markers.append(marker)
        return marker

    def __repr__(self) -> str:
        if self.is_ground:
            return "Body('ground')"
        moments = np.array2string(np.diag(self.inertia), precision=4)
        mass = shown(self.mass, "kg", "g")
        return f"Body({self.name!r}, mass={mass}, inertia={moments} kg m^2, {len(self.markers)} markers)"


def make_body(
    name: str,
    mass: QuantityLike,
    inertia: Any,
    com: Vector,
    position: Vector,
    matrix: npt.ArrayLike | None,
    velocity: Vector,
    angular_velocity: Vector,
) -> Body:
    """Return a checked body; see :class:`Body` for the fields.

    Raises
    ------
    ModelError
        If mass or inertia is negative or not finite, or a vector is malformed.
    """
    given = {
        "mass": mass, "inertia": inertia, "com": com, "position": position, "orientation": matrix,
        "velocity": velocity, "angular_velocity": angular_velocity,
    }  # fmt: skip
    return Body(name, **{key: Body.reads[key](value, f"body '{name}': {key}") for key, value in given.items()})


@contextmanager
def markers_kept(bodies: Iterable[Body]) -> Iterator[None]:
    """Remove the markers that inputs and outputs have needed: states fit a mechanism with the markers it had."""
    kept = [(body, list(body.markers)) for body in bodies]
    try:
        yield
    finally:
        for body, markers in kept:
            body.markers[:] = markers
