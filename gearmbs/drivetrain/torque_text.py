"""The torques of a drivetrain in the function language: the laws of `gearmbs.drivetrain.torque_element` as texts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.language.syntax import Units
from gearmbs.mechanism.parts.elements import AXIS_TORQUE, Load
from gearmbs.mechanism.parts.inputs import text_of

LINEAR_SHARE = 0.8
"""Part of the largest torque up to which a controller's torque is what it asks for."""
STATE_UNIT = 1e6
"""Pa in a unit of the state z of a pump, which is in MPa: errors of states are controlled absolutely."""


@dataclass(frozen=True)
class Seen:
    """What a law sees, as texts with SI values.

    Attributes
    ----------
    p : sequence of float
        Its parameters.
    angle, speed : str
        Of I about z_J.
    times : tuple of str
        Functions of time.
    state : str
        Its state, "" without one.
    """

    p: Sequence[float]
    angle: str
    speed: str
    times: tuple[str, ...]
    state: str


Written = tuple[str, str]
"""The torque on I, N m, and the rate of the state, 1/s, "" without one."""


def torque_text(element: Any, units: Units) -> tuple[Load, dict[str, tuple[str, float]]]:
    """Return the load by expressions that a `ShaftTorque` is, and of its states rate and start by name.

    Raises
    ------
    ModelError
        For a table over the angle, which the language cannot repeat turn by turn.
    """
    i, j = element.i.name, element.j.name
    turn = units.factor("angular_velocity")
    seen = Seen(
        [float(v) for v in element.parameters],
        f'AZ("{i}", "{j}")',
        _scaled(f'WZ("{i}", "{j}", "{j}")', turn),
        tuple(f"({text_of(function, units, 1.0)})" for function in element.times),
        f'DIF("{element.states[0].name}")' if element.states else "",
    )
    if element.law == "table" and seen.p[1] > 0.0:
        raise ModelError(
            f"{element.kind} '{element.name}': its table over the angle has no form in an ADAMS deck; give a table "
            "over speed or time, or a torque load whose torque is an expression"
        )
    torque, rate = WRITERS[element.law](seen)
    text = _scaled(f"({torque})", 1.0 / units.factor("torque"))
    load = Load(element.name, "sforce", element.i, element.j, element.j, AXIS_TORQUE, (text,))
    return load, {s.name: (_scaled(f"({rate})", units.time), float(s.start)) for s in element.states}


def _scaled(text: str, factor: float) -> str:
    return text if factor == 1.0 else f"{factor!r}*{text}"


def _n(value: float) -> str:
    """Return a number that may stand behind any operator."""
    return f"({value!r})" if value < 0.0 else repr(value)


def _induction(seen: Seen, value: str) -> Written:
    sense, lag = seen.p[0], seen.p[2]
    if seen.state:
        return f"{_n(sense)}*{seen.state}", f"({seen.times[0]}*{value} - {seen.state})/{_n(lag)}"
    return f"{_n(sense)}*{seen.times[0]}*{value}", ""


def _slip(seen: Seen) -> str:
    return f"(1 - {_n(seen.p[0] / seen.p[1])}*{seen.speed})"


def _kloss(seen: Seen) -> Written:
    s, (torque, slip) = _slip(seen), seen.p[3:5]
    return _induction(seen, f"({_n(2.0 * torque * slip)}*{s}/({s}**2 + {_n(slip**2)}))")


def _circuit(seen: Seen) -> Written:
    s, (gain, r1, r2, x) = _slip(seen), seen.p[3:7]
    return _induction(seen, f"({_n(gain * r2)}*{s}/(({_n(r1)}*{s} + {_n(r2)})**2 + ({_n(x)}*{s})**2))")


def _controller(seen: Seen) -> Written:
    sense, k_p, k_i, largest = seen.p[:4]
    free = LINEAR_SHARE * largest
    rest = largest - free
    error = f"({seen.times[0]} - {_n(sense)}*{seen.speed})"
    wanted = f"({_n(k_p)}*{error} + {_n(k_i)}*{seen.state})"
    bent = f"SIGN(1, {wanted})*({free!r} + {rest!r}*TANH((ABS({wanted}) - {free!r})/{rest!r}))"
    torque = f"IF(ABS({wanted}) - {free!r}: {wanted}, {wanted}, {bent})"
    return f"{_n(sense)}*{torque}", f"{error} + ({torque} - {wanted})/{_n(k_p)}"


def _pump(seen: Seen) -> Written:
    sense, per_pressure, idle, viscous, smooth, teeth, start, lag, efficiency = seen.p[:9]
    waves = [
        f"{_n(a)}*COS({_n(k * teeth)}*({seen.angle} - {_n(start)}))" for k, a in enumerate(seen.p[9:], 1)
    ]  # fmt: skip
    pressure = f"({STATE_UNIT!r}*{seen.state})" if seen.state else seen.times[0]
    ripple = f"({' + '.join(['1', *waves])})"
    dry = f"{_n(idle)}*TANH({_n(sense / smooth)}*{seen.speed})"
    torque = f"-{_n(sense)}*({_n(per_pressure / efficiency)}*{pressure}*{ripple} + {dry}) - {_n(viscous)}*{seen.speed}"
    return torque, f"({seen.times[0]}/{STATE_UNIT!r} - {seen.state})/{_n(lag)}" if seen.state else ""


def _resistance(seen: Seen) -> Written:
    dry, viscous, square, smooth = seen.p[:4]
    w = seen.speed
    bent = f"{_n(dry)}*{seen.times[0]}*TANH({w}/{_n(smooth)})"
    return f"-({bent} + {_n(viscous)}*{w} + {_n(square)}*{w}*ABS({w}))", ""


def _table(seen: Seen) -> Written:
    """Write the cubic between two points of each pair, and the tangents beyond the ends."""
    sense, n = seen.p[0], int(seen.p[2])
    x, y, m = (list(seen.p[3 + k * n : 3 + (k + 1) * n]) for k in range(3))
    at = f"({_n(sense)}*{seen.speed})"
    pieces = [f"POLY({at}, {x[0]!r}, {y[0]!r}, {m[0]!r})"]
    for k in range(n - 1):
        h = x[k + 1] - x[k]
        rise = (y[k + 1] - y[k]) / h
        bend, jerk = (3.0 * rise - 2.0 * m[k] - m[k + 1]) / h, (m[k] + m[k + 1] - 2.0 * rise) / h**2
        pieces.append(f"POLY({at}, {x[k]!r}, {y[k]!r}, {m[k]!r}, {bend!r}, {jerk!r})")
    pieces.append(f"POLY({at}, {x[-1]!r}, {y[-1]!r}, {m[-1]!r})")
    if len(set(y)) == 1 and not any(m):
        return f"{_n(sense)}*{_n(y[0])}*{seen.times[0]}", ""

    def text(low: int, high: int) -> str:
        # IFs about the middle one of the places, so that few of them enclose each polynomial
        if low == high:
            return pieces[low]
        middle = (low + high) // 2
        after = text(middle + 1, high)
        return f"IF({at} - {_n(x[middle])}: {text(low, middle)}, {after}, {after})"

    return f"{_n(sense)}*{seen.times[0]}*{text(0, n)}", ""


def _clutch(seen: Seen) -> Written:
    free, linear, cubic, damping, band, depth, more, second, width = seen.p[:9]
    twist = f"({seen.angle} - {_n(free)})"
    d = f"(ABS({twist}) - {band!r})"
    elastic = f"({_n(linear)}*{d} + {_n(cubic)}*{d}**3"
    if more:
        beyond = f"({d} - {_n(second)})"
        rounded, straight = f"{beyond}**2/{2.0 * width!r}", f"({beyond} - {0.5 * width!r})"
        part = f"IF({beyond}: 0, 0, IF({beyond} - {width!r}: {rounded}, {straight}, {straight}))"
        elastic += f" + {_n(more)}*{part}"
    elastic += ")"
    side = f"SIGN(1, {twist})"
    if band == 0.0:
        return f"-{side}*{elastic} - {_n(damping)}*{seen.speed}", ""
    damped = f"{_n(damping)}*{side}*{seen.speed}*STEP({d}, 0, 0, {depth!r}, 1)"
    return f"IF({d}: 0, 0, -{side}*MAX(0, {elastic} + {damped}))", ""


WRITERS: dict[str, Callable[[Seen], Written]] = {
    "kloss": _kloss, "circuit": _circuit, "controller": _controller, "pump": _pump, "resistance": _resistance,
    "table": _table, "clutch": _clutch,
}  # fmt: skip
"""Writers of the texts of laws, by law."""
