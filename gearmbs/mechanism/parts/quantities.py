"""Numbers a modeller gives: SI, or texts with a unit, each with the name of its element and field."""

from __future__ import annotations

import functools
import inspect
import math
import re
from collections.abc import Callable, Sequence
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from gearmbs.dae.equations.expressions import ExpressionError
from gearmbs.dae.equations.rotation import matrix_from_euler
from gearmbs.dae.problem import ModelError
from gearmbs.units import NUMBER, Given, to_si
from gearmbs.wording import warn

# What a modeller wrote with units, kept by the names of bodies, joints and forces, for showing it again.


F = TypeVar("F", bound=Callable)
Vector = npt.ArrayLike
Reader = Callable[[Any, str], Any]
"""From a value that is given, and the name of its field for messages, to the one that is kept, or a ModelError."""

QUANTITY = re.compile(rf"\s*(?>{NUMBER.pattern})(?:\s*[A-Za-zµμ°]|\s+1\s*/)")
"""Beginning of a number with a unit, as ``2 N/mm`` or ``3 1/s``; an expression such as ``10*TIME`` has an operator
there."""


class NoNumber:
    """What has a name that expressions calculate with, and no value that Python could."""

    name: str

    def _calculate(self, *_: Any) -> Any:
        raise ModelError(
            f"{self.name!r} has a value in the equations alone; calculate in an expression, such as '2*{self.name}'"
        )

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = _calculate
    __truediv__ = __rtruediv__ = __pow__ = __rpow__ = __neg__ = __pos__ = __abs__ = __float__ = _calculate


def keeps_given(method: F) -> F:
    """Let a method that adds something by name note in ``self.given`` which settings were texts with units."""
    signature = inspect.signature(method)

    @functools.wraps(method)
    def called(self: Any, *args: Any, **settings: Any) -> Any:
        some = any(has_quantity(value) for value in (*args, *settings.values()))
        made = method(self, *args, **settings)
        if not some:
            return made
        arguments = dict(signature.bind(self, *args, **settings).arguments)
        arguments |= arguments.pop("where", {})
        texts = {key: value for key, value in arguments.items() if key not in ("self", "name") and has_quantity(value)}
        if texts:
            self.given[str(arguments["name"])] = texts
        return made

    return cast(F, called)


def has_quantity(value: Any) -> bool:
    """Whether a setting is a number with a unit, or a vector that holds one."""
    if isinstance(value, str):
        return QUANTITY.match(value) is not None
    return isinstance(value, Sequence) and any(has_quantity(item) for item in value)


VALUES = (
    "angle", "length", "angular speed", "speed", "rad/s^2", "acceleration", "torque", "force", "dimensionless",
)  # fmt: skip
"""Dimensions of the values of functions of time, tried in turn where nothing else says which."""


def quantity(value: Any, unit: str, field: str, factor: float = 1.0) -> float:
    """Return a number: as it is, or from a text with a unit.

    Parameters
    ----------
    value : float or str
        ``2.5`` or ``"10 N/mm"``.
    unit : str
        SI unit or dimension of :mod:`gearmbs.units`.
    field : str
        Element and field, for messages.
    factor : float
        SI value of the unit the result is wanted in; plain numbers are in that unit already.

    Raises
    ------
    ModelError
        For anything else, text of another dimension, and NaN.
    """
    # numbers, and texts that have been read, are in SI already
    if type(value) in (float, Given) and not math.isnan(value):
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, NoNumber):
        raise ModelError(
            f"{field}: {value!r} has a value in the equations alone; give a number or a text with a unit, and let it "
            f"stand in an expression, such as '2*{value.name}'. Numbers of elements are set by names of their own"
        )
    try:
        number = to_si(value, unit, field)
    except OverflowError:
        digits = len(str(abs(value)))
        raise ModelError(f"{field}: an integer of {digits} digits is beyond all floats; give less") from None
    except (TypeError, ValueError) as error:
        raise ModelError(str(error)) from None
    return number / factor if isinstance(value, str) and factor != 1.0 else number


def quantities(value: Any, unit: str, field: str, factor: float = 1.0) -> np.ndarray:
    """Return an array of numbers given as an array, or as nested sequences with texts in them; see :func:`quantity`.

    Raises
    ------
    ModelError
        If an entry is not a number or a text with the unit expected.
    """
    if _holds_truth(value):
        raise ModelError(f"{field}: {value!r} holds true or false; give numbers")
    try:
        return np.array(value, dtype=float)
    except (TypeError, ValueError):
        pass
    if isinstance(value, str) or not isinstance(value, Sequence | np.ndarray):
        raise ModelError(f"{field}: {value!r} is not a vector; give numbers, or texts with units, in brackets")
    rows = [
        quantities(v, unit, field, factor) if isinstance(v, Sequence | np.ndarray) and not isinstance(v, str)
        else quantity(v, unit, field, factor)
        for v in value
    ]  # fmt: skip
    try:
        return np.array(rows, dtype=float)
    except ValueError:
        raise ModelError(f"{field}: {value!r} has rows of different lengths") from None


def _holds_truth(value: Any) -> bool:
    """Whether a number, or one of nested sequences, is true or false, which arrays take for 1 and 0."""
    if isinstance(value, list | tuple):
        return any(map(_holds_truth, value))
    return isinstance(value, bool) or getattr(value, "dtype", None) == np.bool_


def any_quantity(value: Any, field: str, dimensions: Sequence[str] = VALUES) -> float:
    """Return a number given as it is, or as a text with a unit of one of several dimensions.

    Raises
    ------
    ModelError
        If it is neither.
    """
    if not isinstance(value, str):
        return quantity(value, dimensions[0], field)
    for dimension in dimensions:
        try:
            return to_si(value, dimension, field)
        except ValueError:
            continue
    raise ModelError(f"{field}: cannot read {value!r} as a quantity; give a number in SI or one with a unit, '30 deg'")


def expression_text(value: Any, unit: str, field: str, factor: float = 1.0) -> str:
    """Return an expression of the function language: the text itself, or the number a text with a unit stands for.

    Raises
    ------
    ModelError
        If it is neither an expression nor a quantity.
    """
    from gearmbs.mechanism.language.syntax import parse

    if not isinstance(value, str):
        return repr(quantity(value, unit, field, factor))
    try:
        parse(value)
    except ExpressionError as error:
        try:
            return repr(to_si(value, unit, field) / factor)
        except ValueError as other:
            is_quantity = _looks_like_quantity(value)
            raise ModelError(str(other) if is_quantity else f"{field}: {error}") from None
    return value


def _looks_like_quantity(text: str) -> bool:
    """Whether a text that is no expression looks like a number with a unit."""
    head = text.strip().split(" ", 1)
    try:
        float(head[0])
    except ValueError:
        return False
    return len(head) == 2 and not any(c in head[1] for c in "(),")


# Vectors, and frames: rotation matrices from axes, Euler angles or matrices, checked on the way in.


def vector(value: Vector, field: str, unit: str = "dimensionless", factor: float = 1.0) -> np.ndarray:
    """Return three finite floats, given as such or as texts with a unit (see :func:`quantities`).

    Raises
    ------
    ModelError
        If ``value`` is not three finite numbers.
    """
    out = quantities(value, unit, field, factor).reshape(-1)
    if out.size != 3 or not np.all(np.isfinite(out)):
        raise ModelError(f"{field}: {value!r} is not three finite numbers")
    return out


def reader(unit: str, kind: Callable[..., Any] = quantity) -> Reader:
    """Return what reads a number, or with `vector` three, of one unit or dimension."""
    return lambda value, field: kind(value, field=field, unit=unit)


def mass_of(value: Any, field: str) -> float:
    """Return a mass that is not negative, kg."""
    mass = quantity(value, "mass", field)
    if not np.isfinite(mass) or mass < 0.0:
        raise ModelError(f"{field} = {mass} kg; it must be a positive number")
    return mass


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the product a x b of two vectors, to the same digits as `numpy.cross`, which takes ten times as long."""
    ax, ay, az = map(float, a)
    bx, by, bz = map(float, b)
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def frame_along(axis: Vector, field: str = "axis", x_hint: Vector | None = None) -> np.ndarray:
    """Return a rotation matrix whose z column lies along ``axis``.

    The x column is the projection of ``x_hint``, or of the global axis least aligned with ``axis``.
    """
    z = vector(axis, field)
    norm = np.linalg.norm(z)
    if norm == 0.0:
        raise ModelError(f"{field}: the zero vector gives no direction")
    z = z / norm
    hint = np.eye(3)[np.argmin(np.abs(z))] if x_hint is None else vector(x_hint, f"{field} (x direction)")
    x = hint - z * (hint @ z)
    if np.linalg.norm(x) < 1e-12:
        raise ModelError(f"{field}: the x direction is parallel to the axis; choose another")
    x = x / np.linalg.norm(x)
    return np.column_stack([x, cross(z, x), z])


def rotation_matrix(value: npt.ArrayLike | None, field: str) -> np.ndarray:
    """Return a rotation matrix from None (identity), a 3x3 matrix, or three 3-1-3 Euler angles in rad."""
    if value is None:
        return np.eye(3)
    out = quantities(value, "angle", field)
    if out.shape == (3,):
        return matrix_from_euler(*out)
    if out.shape != (3, 3):
        raise ModelError(f"{field}: shape {out.shape}; give a 3x3 rotation matrix or three Euler angles in rad")
    if not np.all(np.isfinite(out)) or np.abs(out @ out.T - np.eye(3)).max() > 1e-6 or np.linalg.det(out) < 0:
        raise ModelError(f"{field}: the matrix is not a rotation (orthonormal, determinant +1)")
    u, _, vt = np.linalg.svd(out)
    return u @ vt


def inertia_matrix(value: float | Sequence[float] | np.ndarray, field: str) -> np.ndarray:
    """Return a symmetric 3x3 inertia matrix from 3 principal moments, 6 entries (xx, yy, zz, xy, xz, yz) or 3x3.

    Off-diagonal entries are those of the matrix, so products of inertia enter with a minus sign.

    Raises
    ------
    ModelError
        If the matrix is not symmetric, not finite or has a negative moment.

    Warns
    -----
    UserWarning
        If a moment exceeds the sum of the other two, which no rigid body can do; the equations can.
    """
    raw = quantities(value, "inertia", field)
    if raw.shape == (3,):
        out = np.diag(raw)
    elif raw.shape == (6,):
        xx, yy, zz, xy, xz, yz = raw
        out = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    elif raw.shape == (3, 3):
        out = raw
    else:
        raise ModelError(f"{field}: shape {raw.shape}; give 3 moments, 6 entries or a 3x3 matrix in kg m^2")
    if not np.all(np.isfinite(out)):
        raise ModelError(f"{field}: {value!r} is not finite")
    if np.abs(out - out.T).max() > 1e-9 * max(np.abs(out).max(), 1e-300):
        raise ModelError(f"{field}: the inertia matrix is not symmetric")
    moments = np.linalg.eigvalsh(out)
    if moments[0] < -1e-9 * max(moments[2], 1e-300):
        raise ModelError(
            f"{field}: principal moments {moments} kg m^2; none may be negative: correct the moments, the signs of "
            "products, or the point they are about"
        )
    if moments[2] > (1.0 + 1e-6) * (moments[0] + moments[1]):
        warn(
            f"{field}: principal moments {moments} kg m^2; the largest exceeds the sum of the others, as in no body: "
            "correct the moments, the signs of products, or the point they are about"
        )
    return 0.5 * (out + out.T)
