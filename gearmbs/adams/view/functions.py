"""Functions of View's design-time expressions: a table of names, numbers of arguments, and what they do.

Nothing here reads a file, starts a program or asks the system.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from gearmbs.adams.view import frames
from gearmbs.adams.view.expressions import LARGEST_TEXT, Evaluator, text_of
from gearmbs.adams.view.model import Database, Item
from gearmbs.adams.view.vocabulary import kinds_of


class Values(Protocol):
    """What functions ask of a model: its objects, and where they are."""

    db: Database

    def point(self, item: Item) -> np.ndarray:
        """Return an object's position in the global frame."""

    def pose(self, item: Item | None) -> tuple[np.ndarray, np.ndarray]:
        """Return the rotation and the position of an object's frame in the global one."""


Run = Callable[[Values, Evaluator, list[Any], Item | None], Any]


@dataclass(frozen=True)
class Function:
    """A function: how many arguments it has, what it does, and whether it is one of places.

    ``placing`` says that its arguments are evaluated in the global frame.
    """

    least: int
    most: int
    run: Run
    placing: bool = False


FUNCTIONS: dict[str, Function] = {}


def _numeric(name: str, function: Callable[..., float], count: int = 1) -> None:
    FUNCTIONS[name] = Function(count, count, lambda values, ev, args, frame: ev.each(function, *args))


for _name, _math in {
    "ABS": abs, "SQRT": math.sqrt, "EXP": math.exp, "LOG": math.log, "LOG10": math.log10, "SINH": math.sinh,
    "COSH": math.cosh, "TANH": math.tanh, "INT": lambda x: int(x), "AINT": lambda x: float(int(x)),
    "NINT": lambda x: math.floor(abs(x) + 0.5) * (1 if x >= 0 else -1), "RTOI": lambda x: int(x),
    "ANINT": lambda x: float(math.floor(abs(x) + 0.5) * (1 if x >= 0 else -1)), "CEIL": math.ceil, "FLOOR": math.floor,
    "DTOR": math.radians, "RTOD": math.degrees,
}.items():  # fmt: skip
    _numeric(_name, _math)  # type: ignore[arg-type]
_numeric("MOD", math.fmod, 2)
_numeric("SIGN", lambda a, b: math.copysign(abs(a), b), 2)
_numeric("DIM", lambda a, b: max(a - b, 0.0), 2)


def _angular(name: str, function: Callable[..., float], count: int, inverse: bool) -> None:
    """Enter a trigonometric function: angles are in the model's unit of angle."""

    def run(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
        radian = values.db.units.radian
        if inverse:
            return ev.each(lambda *x: function(*x) / radian, *args)
        return ev.each(lambda *x: function(*(one * radian for one in x)), *args)

    FUNCTIONS[name] = Function(count, count, run)


for _name in ("SIN", "COS", "TAN"):
    _angular(_name, getattr(math, _name.lower()), 1, inverse=False)
for _name in ("ASIN", "ACOS", "ATAN"):
    _angular(_name, getattr(math, _name.lower()), 1, inverse=True)
_angular("ATAN2", math.atan2, 2, inverse=True)


def _fold(names: str, fold: Callable[[list[float]], float]) -> None:
    def run(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
        return ev.each(lambda: fold(_some(ev, ev.numbers(args))))

    for name in names.split():
        FUNCTIONS[name] = Function(1, 50, run)


def _some(ev: Evaluator, numbers: list[float]) -> list[float]:
    if not numbers:
        raise ev.error("an empty list")
    return numbers


_fold("MIN", min)
_fold("MAX", max)
_fold("SUM", math.fsum)
_fold("PROD", math.prod)
_fold("MEAN", lambda x: math.fsum(x) / len(x))
_fold("NORM MAG", lambda x: math.sqrt(math.fsum(a * a for a in x)))
_fold("SSQ", lambda x: math.fsum(a * a for a in x))
_fold("RMS", lambda x: math.sqrt(math.fsum(a * a for a in x) / len(x)))


def _rows(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return len(args[0]) if isinstance(args[0], list) else 1


def _cols(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    first = args[0][0] if isinstance(args[0], list) and args[0] else args[0]
    return len(first) if isinstance(first, list) else 1


def _first(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    return ev.member(args[0], [1])


def _last(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    return ev.member(args[0], [len(args[0]) if isinstance(args[0], list) else 0])


def _stack(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[Any]:
    return [one for part in args for one in (part if isinstance(part, list) else [part])]


def _series(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    start, step, count = (ev.number(one) for one in args)
    if not 0 <= count <= 10_000:
        raise ev.error(f"SERIES of {count} members")
    return [start + k * step for k in range(int(count))]


# Texts.


def _stoi(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return int(_read(ev, args[0]))


def _stor(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> float:
    return _read(ev, args[0])


def _read(ev: Evaluator, text: Any) -> float:
    try:
        value = float(text_of(text)[:100])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ev.error(f"{text_of(text)[:40]!r} is no number")
    return value


def _stoo(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    found = values.db.find(text_of(args[0]))
    if found is None:
        raise ev.error(f"there is no object {text_of(args[0])[:60]}")
    return found


def _length(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return len(text_of(args[0]))


def _blank(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return int(not text_of(args[0]).strip())


def _case(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    text, how = text_of(args[0]), int(ev.number(args[1]))
    return {1: text.upper(), 2: text.lower(), 3: text.title(), 4: text.capitalize()}.get(how, text)


def _compare(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    one, other = text_of(args[0]), text_of(args[1])
    return (one > other) - (one < other)


def _find(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return text_of(args[0]).find(text_of(args[1])) + 1


def _substr(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    start = max(int(ev.number(args[1])), 1) - 1
    count = max(int(ev.number(args[2])), 0) if len(args) > 2 else LARGEST_TEXT
    return text_of(args[0])[start : start + count]


def _split(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[str]:
    return text_of(args[0]).split(text_of(args[1])[:1] or None)


def _stripped(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    return "".join(text_of(args[0]).split())


def _printed(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    return text_of(args[0])


def _unset(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    """Return what an environment variable holds that is not set: the system is not asked."""
    return ""


# The database.


def _exists(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return int(isinstance(args[0], Item) or values.db.find(text_of(args[0])) is not None)


def _type(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    return _item(values, ev, args[0]).kind


def _default(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    what = text_of(args[1]).lower()
    found = {"model": values.db.model, "part": values.db.part}.get(what)
    if found is None:
        raise ev.error(f"there is no default {what[:40]}")
    return found


def _children(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[Item]:
    kinds = kinds_of(text_of(args[1]), ev.line)
    return [one for one in _item(values, ev, args[0]).children.values() if one.kind in kinds]


def _counted(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return len(args[0]) if isinstance(args[0], list) else 1


def _ancestor(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    kinds = kinds_of(text_of(args[1]), ev.line)
    one = values.db.items.get(_item(values, ev, args[0]).parent.lower())
    while one is not None and one.kind not in kinds:
        one = values.db.items.get(one.parent.lower())
    return "" if one is None else one


def _unique(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    stem, k = text_of(args[0]), 1
    while values.db.find(f"{stem}_{k}") is not None:
        k += 1
    return f"{stem}_{k}"


# Places and orientations.


def _item(values: Values, ev: Evaluator, value: Any) -> Item:
    found = value if isinstance(value, Item) else values.db.find(text_of(value)) if isinstance(value, str) else None
    if found is None:
        raise ev.error(f"an object is wanted, not {text_of(value)[:60]}")
    return found


def _triple(ev: Evaluator, value: Any) -> np.ndarray:
    numbers = ev.numbers(value)
    if len(numbers) != 3:
        raise ev.error(f"{len(numbers)} coordinates; give three")
    return np.array(numbers, float)


def _point(values: Values, ev: Evaluator, value: Any) -> np.ndarray:
    """Return the global position of an object, or of three coordinates."""
    if isinstance(value, Item) or isinstance(value, str):
        return values.point(_item(values, ev, value))
    return _triple(ev, value)


def _given(values: Values, point: np.ndarray, frame: Item | None) -> list[float]:
    """Return a global place in the frame that it is asked in."""
    a, r = values.pose(frame)
    return [float(x) for x in a.T @ (point - r)]


def _turned(values: Values, a: np.ndarray, frame: Item | None) -> list[float]:
    """Return a global rotation in the frame that it is asked in, as 313 angles."""
    return [x / values.db.units.radian for x in frames.angles_313(values.pose(frame)[0].T @ a)]


def _pose(values: Values, ev: Evaluator, value: Any) -> tuple[np.ndarray, np.ndarray]:
    return values.pose(_item(values, ev, value))


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
        return _given(values, values.point(_item(values, ev, args[1])), frame)
    a, r = _pose(values, ev, args[1])
    return _given(values, a @ offset + r, frame)


def _local(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    a, r = _pose(values, ev, args[1])
    return [float(x) for x in a.T @ (_triple(ev, args[0]) - r)]


def _loc_loc(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    a, r = _pose(values, ev, args[1])
    into = _item(values, ev, args[2]) if isinstance(args[2], (Item, str)) and args[2] else None
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
        return [float(x) for x in _pose(values, ev, args[0])[0][:, k]]

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
    return _turned(values, _pose(values, ev, args[1])[0] @ _rotation(values, ev, args[0]), frame)


def _ori_local(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    return _turned(values, _pose(values, ev, args[1])[0].T @ _rotation(values, ev, args[0]), None)


def _ori_ori(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    into = _item(values, ev, args[2]) if isinstance(args[2], (Item, str)) and args[2] else None
    return _turned(values, _pose(values, ev, args[1])[0] @ _rotation(values, ev, args[0]), into)


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
    a = _rotation(values, ev, args[0]) if isinstance(args[0], list) else _pose(values, ev, args[0])[0]
    named = text_of(args[1]).strip().lower()
    if not (len(named) in (2, 3) and named[0] in "xyz" and named[-1] in "xyz" and named[1:-1] in ("", "+", "-")):
        raise ev.error(f"ORI_ALIGN_AXIS: {named[:20]!r}; give two axes, such as zx or z-x")
    return _turned(values, frames.aligned(a, named[0], -1.0 if "-" in named else 1.0, named[-1]), frame)


def _ori_mirror(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    a = _pose(values, ev, args[1])[0]
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
        axes = _pose(values, ev, args[2])[0] if len(args) > 2 else frames.IDENTITY
        return float(axes[:, k] @ (_point(values, ev, args[0]) - start))

    return run


for _k, _name in enumerate(("DX", "DY", "DZ")):
    FUNCTIONS[_name] = Function(1, 3, _component(_k), placing=True)


def _angle_about(k: int, c: np.ndarray) -> float:
    """Angle of a frame about axis k of another: of its next axis but one, as the solver's AX, AY and AZ."""
    i, j = (k + 1) % 3, (k + 2) % 3
    # AX, AY: of the z axis and the x axis; AZ: of the x axis
    return math.atan2(-c[i, j], c[j, j]) if k < 2 else math.atan2(c[1, 0], c[0, 0])


def _turn(angle: Callable[[np.ndarray], float]) -> Run:
    """One angle of a frame to another, or to the global one."""

    def run(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> float:
        a = _pose(values, ev, args[0])[0]
        b = _pose(values, ev, args[1])[0] if len(args) > 1 else frames.IDENTITY
        return angle(b.T @ a) / values.db.units.radian

    return run


def _euler(k: int, c: np.ndarray) -> float:
    return frames.angles_313(c)[k]


for _names, _angle in (("AX AY AZ", _angle_about), ("PSI THETA PHI", _euler)):
    for _k, _name in enumerate(_names.split()):
        FUNCTIONS[_name] = Function(1, 2, _turn(partial(_angle, _k)), placing=True)


FUNCTIONS |= {
    "ROWS": Function(1, 1, _rows),
    "COUNT": Function(1, 1, _rows),
    "COLS": Function(1, 1, _cols),
    "FIRST": Function(1, 1, _first),
    "LAST": Function(1, 1, _last),
    "STACK": Function(2, 2, _stack),
    "APPEND": Function(2, 2, _stack),
    "SERIES": Function(3, 3, _series),
    "STOI": Function(1, 1, _stoi),
    "STOR": Function(1, 1, _stor),
    "VAL": Function(1, 1, _stor),
    "STOO": Function(1, 1, _stoo),
    "STR_LENGTH": Function(1, 1, _length),
    "STR_IS_SPACE": Function(1, 1, _blank),
    "STR_CASE": Function(2, 2, _case),
    "STR_COMPARE": Function(2, 2, _compare),
    "STR_FIND": Function(2, 2, _find),
    "STR_SUBSTR": Function(2, 3, _substr),
    "STR_SPLIT": Function(2, 2, _split),
    "STR_REMOVE_WHITESPACE": Function(1, 1, _stripped),
    "STR_PRINT": Function(1, 1, _printed),
    "STATUS_PRINT": Function(1, 1, _printed),
    "GETENV": Function(1, 1, _unset),
    "DB_EXISTS": Function(1, 1, _exists),
    "DB_TYPE": Function(1, 1, _type),
    "DB_DEFAULT": Function(2, 2, _default),
    "DB_CHILDREN": Function(2, 2, _children),
    "DB_IMMEDIATE_CHILDREN": Function(2, 2, _children),
    "DB_COUNT": Function(1, 2, _counted),
    "DB_OBJECT_COUNT": Function(1, 2, _counted),
    "DB_ANCESTOR": Function(2, 2, _ancestor),
    "DB_OLDEST_ANCESTOR": Function(2, 2, _ancestor),
    "UNIQUE_NAME": Function(1, 1, _unique),
    "UNIQUE_LOCAL_NAME": Function(1, 1, _unique),
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
