"""Functions of places, orientations, distances and angles."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from gearmbs.adams.view import frames
from gearmbs.adams.view.expressions import Evaluator, text_of
from gearmbs.adams.view.functions.table import FUNCTIONS, Function, Run, Values, item_of
from gearmbs.adams.view.model import Item


def _triple(ev: Evaluator, value: Any) -> np.ndarray:
    numbers = ev.numbers(value)
    if len(numbers) != 3:
        raise ev.error(f"{len(numbers)} coordinates; give three")
    return np.array(numbers, float)


def _point(values: Values, ev: Evaluator, value: Any) -> np.ndarray:
    """Return the global position of an object, or of three coordinates."""
    if isinstance(value, Item) or isinstance(value, str):
        return values.point(item_of(values, ev, value))
    return _triple(ev, value)


def _given(values: Values, point: np.ndarray, frame: Item | None) -> list[float]:
    """Return a global place in the frame that it is asked in."""
    a, r = values.pose(frame)
    return [float(x) for x in a.T @ (point - r)]


def _turned(values: Values, a: np.ndarray, frame: Item | None) -> list[float]:
    """Return a global rotation in the frame that it is asked in, as 313 angles."""
    return [x / values.db.units.radian for x in frames.angles_313(values.rotation(frame).T @ a)]


def _axes(values: Values, ev: Evaluator, value: Any) -> np.ndarray:
    """Return the axes of an object in the global frame, wherever it is."""
    return values.rotation(item_of(values, ev, value))


def _pose(values: Values, ev: Evaluator, value: Any) -> tuple[np.ndarray, np.ndarray]:
    return values.pose(item_of(values, ev, value))


def _rotation(values: Values, ev: Evaluator, value: Any) -> np.ndarray:
    angles = [float(x) * values.db.units.radian for x in _triple(ev, value)]
    return frames.rotation(angles, line=ev.line)


def _axis(ev: Evaluator, value: Any, among: str = "xyz") -> str:
    axis = text_of(value).strip().lower()
    if axis not in (among.split() if " " in among else list(among)):
        raise ev.error(f"{text_of(value)[:20]!r}: give one of {among}")
    return axis


def _relative(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    offset = _triple(ev, args[0])
    if not offset.any():
        # the orientation of the other may depend on this place
        return _given(values, values.point(item_of(values, ev, args[1])), frame)
    a, r = _pose(values, ev, args[1])
    return _given(values, a @ offset + r, frame)


def _local(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    a, r = _pose(values, ev, args[1])
    return [float(x) for x in a.T @ (_triple(ev, args[0]) - r)]


def _loc_loc(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    a, r = _pose(values, ev, args[1])
    into = item_of(values, ev, args[2]) if isinstance(args[2], (Item, str)) and args[2] else None
    return _given(values, a @ _triple(ev, args[0]) + r, into)


def _along_line(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    start, to = (_point(values, ev, one) for one in args[:2])
    return _given(values, start + ev.number(args[2]) * frames.unit(to - start, "LOC_ALONG_LINE"), frame)


def _on_line(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    numbers = ev.numbers(args[0])
    if len(numbers) != 6:
        raise ev.error("LOC_ON_LINE: give two points of three coordinates")
    start, to = np.array(numbers[:3]), np.array(numbers[3:])
    return _given(values, start + ev.number(args[1]) * frames.unit(to - start, "LOC_ON_LINE"), frame)


def _on_axis(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    a, r = _pose(values, ev, args[0])
    k = "xyz".index(_axis(ev, args[2]))
    return _given(values, r + ev.number(args[1]) * a[:, k], frame)


def _direction(k: int) -> Run:
    """An axis of a frame as a vector in the global one."""

    def run(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
        return [float(x) for x in _axes(values, ev, args[0])[:, k]]

    return run


for _k, _name in enumerate(("LOC_X_AXIS", "LOC_Y_AXIS", "LOC_Z_AXIS")):
    FUNCTIONS[_name] = Function(1, 1, _direction(_k), placing=True)


def _mirror(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    a, r = _pose(values, ev, args[1])
    normal = a[:, 3 - sum("xyz".index(c) for c in _axis(ev, args[2], "xy yx yz zy xz zx"))]
    point = _point(values, ev, args[0])
    return _given(values, point - 2.0 * ((point - r) @ normal) * normal, frame)


def _plane_normal(ev: Evaluator, value: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return a point of a plane through three points, and its normal."""
    numbers = ev.numbers(value)
    if len(numbers) != 9:
        raise ev.error("a plane: give three points of three coordinates")
    p, q, r = np.array(numbers).reshape(3, 3)
    return p, frames.unit(np.cross(q - p, r - p), "the plane")


def _plane_mirror(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    point = _point(values, ev, args[0])
    at, normal = _plane_normal(ev, args[1])
    return _given(values, point - 2.0 * ((point - at) @ normal) * normal, frame)


def _inline(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    # coordinates in one frame as the direction in another
    a, r = _pose(values, ev, args[1])
    b, s = _pose(values, ev, args[2])
    return [float(x) for x in frames.unit(b.T @ (a @ _triple(ev, args[0]) + r - s), "LOC_INLINE")]


def _cylindrical(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    r, theta, z = (ev.number(one) for one in args)
    theta *= values.db.units.radian
    return [r * math.cos(theta), r * math.sin(theta), z]


def _spherical(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    rho, theta, phi = (ev.number(one) for one in args)
    theta, phi = theta * values.db.units.radian, phi * values.db.units.radian
    return [rho * math.sin(phi) * math.cos(theta), rho * math.sin(phi) * math.sin(theta), rho * math.cos(phi)]


def _ori_relative(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    return _turned(values, _axes(values, ev, args[1]) @ _rotation(values, ev, args[0]), frame)


def _ori_local(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    return _turned(values, _axes(values, ev, args[1]).T @ _rotation(values, ev, args[0]), None)


def _ori_ori(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    into = item_of(values, ev, args[2]) if isinstance(args[2], (Item, str)) and args[2] else None
    return _turned(values, _axes(values, ev, args[1]) @ _rotation(values, ev, args[0]), into)


def _ori_along(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    start, to = (_point(values, ev, one) for one in args[:2])
    return _turned(values, frames.along(_axis(ev, args[2]), to - start), frame)


def _ori_one(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    numbers = ev.numbers(args[0])
    if len(numbers) != 6:
        raise ev.error("ORI_ONE_AXIS: give two points of three coordinates")
    return _turned(values, frames.along(_axis(ev, args[1]), np.array(numbers[3:]) - np.array(numbers[:3])), frame)


def _ori_all(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    numbers = ev.numbers(args[0])
    if len(numbers) != 9:
        raise ev.error("ORI_ALL_AXES: give three points of three coordinates")
    p, q, r = np.array(numbers).reshape(3, 3)
    axes = _axis(ev, args[1], "xy yx yz zy xz zx")
    return _turned(values, frames.in_plane(axes[0], axes[1], q - p, r - p), frame)


def _ori_plane(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    p, q, r = (_point(values, ev, one) for one in args[:3])
    named = text_of(args[3]).strip().lower()
    first, _, plane = named.partition("_")
    second = plane.replace(first, "", 1)
    if len(first) != 1 or len(second) != 1 or first not in "xyz" or second not in "xyz" or first == second:
        raise ev.error(f"ORI_IN_PLANE: {named[:20]!r}; give an axis and a plane, such as z_zx")
    return _turned(values, frames.in_plane(first, second, q - p, r - p), frame)


def _ori_align(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    a = _rotation(values, ev, args[0]) if isinstance(args[0], list) else _axes(values, ev, args[0])
    named = text_of(args[1]).strip().lower()
    if not (len(named) in (2, 3) and named[0] in "xyz" and named[-1] in "xyz" and named[1:-1] in ("", "+", "-")):
        raise ev.error(f"ORI_ALIGN_AXIS: {named[:20]!r}; give two axes, such as zx or z-x")
    return _turned(values, frames.aligned(a, named[0], -1.0 if "-" in named else 1.0, named[-1]), frame)


def _ori_mirror(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    a = _axes(values, ev, args[1])
    normal = a[:, 3 - sum("xyz".index(c) for c in _axis(ev, args[2], "xy yx yz zy xz zx"))]
    return _reflected(values, ev, (args[0], args[3]), normal, frame)


def _ori_plane_mirror(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    return _reflected(values, ev, (args[0], args[2]), _plane_normal(ev, args[1])[1], frame)


def _reflected(
    values: Values, ev: Evaluator, given: tuple[Any, Any], normal: np.ndarray, frame: Item | None
) -> list[float]:
    """Return an orientation whose two axes are the mirrored ones of another; the third is as they want it."""
    axes = _axis(ev, given[1], "xy yx yz zy xz zx")
    reflected = _rotation(values, ev, given[0])
    reflected = reflected - 2.0 * np.outer(normal, normal @ reflected)
    i, j = ("xyz".index(c) for c in axes)
    return _turned(values, frames.in_plane(axes[0], axes[1], reflected[:, i], reflected[:, j]), frame)


def _distance(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> float:
    return float(np.linalg.norm(_point(values, ev, args[0]) - _point(values, ev, args[1])))


def _component(k: int) -> Run:
    def run(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> float:
        start = _point(values, ev, args[1]) if len(args) > 1 else frames.ORIGIN
        axes = _axes(values, ev, args[2]) if len(args) > 2 else frames.IDENTITY
        return float(axes[:, k] @ (_point(values, ev, args[0]) - start))

    return run


for _k, _name in enumerate(("DX", "DY", "DZ")):
    FUNCTIONS[_name] = Function(1, 3, _component(_k), placing=True)


def _angle_about(k: int, c: np.ndarray) -> float:
    """Angle of a frame about axis k of another, as the solver's AX, AY and AZ: of its z axis, about z of its x axis."""
    if k == 0:
        return math.atan2(-c[1, 2], c[2, 2])
    return math.atan2(c[0, 2], c[2, 2]) if k == 1 else math.atan2(c[1, 0], c[0, 0])


def _turn(angle: Callable[[np.ndarray], float]) -> Run:
    """One angle of a frame to another, or to the global one."""

    def run(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> float:
        a = _axes(values, ev, args[0])
        b = _axes(values, ev, args[1]) if len(args) > 1 else frames.IDENTITY
        return angle(b.T @ a) / values.db.units.radian

    return run


def _euler(k: int, c: np.ndarray) -> float:
    return frames.angles_313(c)[k]


def _tait_bryan(k: int, c: np.ndarray) -> float:
    """Yaw, pitch and roll: body-fixed 321 angles, of which the pitch is the negative second one."""
    if k == 1:
        return math.atan2(c[2, 0], math.hypot(c[0, 0], c[1, 0]))
    return math.atan2(c[1, 0], c[0, 0]) if k == 0 else math.atan2(c[2, 1], c[2, 2])


for _names, _angle in (
    ("AX AY AZ", _angle_about),
    ("PSI THETA PHI", _euler),
    ("YAW PITCH ROLL", _tait_bryan),
):
    for _k, _name in enumerate(_names.split()):
        FUNCTIONS[_name] = Function(1, 2, _turn(partial(_angle, _k)), placing=True)


FUNCTIONS |= {
    "LOC_RELATIVE_TO": Function(2, 2, _relative, placing=True),
    "LOC_GLOBAL": Function(2, 2, _relative, placing=True),
    "LOC_LOCAL": Function(2, 2, _local, placing=True),
    "LOC_LOC": Function(3, 3, _loc_loc, placing=True),
    "LOC_ALONG_LINE": Function(3, 3, _along_line, placing=True),
    "LOC_ON_LINE": Function(2, 2, _on_line, placing=True),
    "LOC_ON_AXIS": Function(3, 3, _on_axis, placing=True),
    "LOC_MIRROR": Function(3, 3, _mirror, placing=True),
    "LOC_FRAME_MIRROR": Function(3, 3, _mirror, placing=True),
    "LOC_PLANE_MIRROR": Function(2, 2, _plane_mirror, placing=True),
    "LOC_INLINE": Function(3, 3, _inline, placing=True),
    "LOC_CYLINDRICAL": Function(3, 3, _cylindrical),
    "LOC_SPHERICAL": Function(3, 3, _spherical),
    "ORI_RELATIVE_TO": Function(2, 2, _ori_relative, placing=True),
    "ORI_GLOBAL": Function(2, 2, _ori_relative, placing=True),
    "ORI_LOCAL": Function(2, 2, _ori_local, placing=True),
    "ORI_ORI": Function(3, 3, _ori_ori, placing=True),
    "ORI_ALONG_AXIS": Function(3, 3, _ori_along, placing=True),
    "ORI_ONE_AXIS": Function(2, 2, _ori_one, placing=True),
    "ORI_ALL_AXES": Function(2, 2, _ori_all, placing=True),
    "ORI_IN_PLANE": Function(4, 4, _ori_plane, placing=True),
    "ORI_ALIGN_AXIS": Function(2, 2, _ori_align, placing=True),
    "ORI_ALIGN_AXIS_EUL": Function(2, 2, _ori_align, placing=True),
    "ORI_MIRROR": Function(4, 4, _ori_mirror, placing=True),
    "ORI_FRAME_MIRROR": Function(4, 4, _ori_mirror, placing=True),
    "ORI_PLANE_MIRROR": Function(3, 3, _ori_plane_mirror, placing=True),
    "DM": Function(2, 2, _distance, placing=True),
}
