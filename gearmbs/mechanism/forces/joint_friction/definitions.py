"""Friction of joints, stated once: `gearmbs.kernels.derive` makes ``derived.py``.

The law is that of `gearmbs.mechanism.forces.friction`. There are three stages: what is seen of a joint, N that presses
its surfaces together and its slips s_k; the loads L_k = -(l mu_k N + P mu_k) by these and by the deformations z_k; the
wrench, sum L_k e_k. Derivatives are by the variations of both frames, the deformations and the joint's reaction.

Lengths of vectors are rounded off, sqrt(x . x + tiny^2), so that their derivatives exist at zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gearmbs.dae.equations.loads.traced import Frame, dot, matrix, placed, rows, seen_from
from gearmbs.kernels.derive import Function, Value, choose, inputs, tangent
from gearmbs.mechanism.forces.definitions import step
from gearmbs.mechanism.forces.joint_friction import BALL, NAMES, PIN, REALS

Numbers = Sequence[Value]
TINY = 1e-6
"""Part of its own scale, a limit or a transition velocity, below which the length of a vector is rounded off, so that
its derivative exists at zero. A length of that scale is off by 5e-13 of it."""

COUNTED = ("", "one", "two", "three")


def rounded(vector, tiny):
    """Return the length of a vector, rounded off."""
    return np.sqrt(sum((x * x for x in vector), tiny * tiny))


def ramp(speed, transition, low, high):
    """Return STEP(V, V_t, low, 1.5 V_t, high)."""
    return low + (high - low) * step((speed - transition) / (0.5 * transition))


def by_velocity(slips, speed, p):
    """Return mu_k = g(V) s_k / V, below the transition of the cubic g = mu_s r (3 - r^2) / 2 with r = V / V_t."""
    ratio = speed / p["transition"]
    stuck = 0.5 * p["static"] / p["transition"] * (3.0 - ratio * ratio)
    moving = ramp(speed, p["transition"], p["static"], p["dynamic"]) / speed
    factor = choose(speed, p["transition"], moving, stuck)
    return [slip * factor for slip in slips]


def by_deformation(slips, speed, deformations, p):
    """Return the rates z_k' = s_k - mu_s V z_k / (D g(V)) and mu_k = mu_s (z_k + tau z_k') / D, tau fading in slip."""
    stiffness, transition = p["static"] / p["deformation"], p["transition"]
    fading = stiffness * speed / ramp(speed, transition, p["static"], p["dynamic"])
    tau = ramp(speed, transition, p["deformation"] / transition, 0.0)
    rates = [slip - fading * z for slip, z in zip(slips, deformations)]
    return rates, [stiffness * (z + tau * rate) for z, rate in zip(deformations, rates)]


def pressing_a_pin(force, moment, p):
    """Return N r of a pin by the reaction in the axes that it turns in."""
    pressed = p["per_force"] * rounded(force[:2], p["tiny_force"])
    pressed += p["per_axial"] * rounded(force[2:], p["tiny_force"])
    return pressed + p["per_bending"] * rounded(moment[:2], p["tiny_bending"])


def pressing_a_guide(force, moment, along, p):
    """Return N of a guide, whose bending moment is a couple at the ends of the overlap."""
    overlap = p["overlap"] + p["overlap_slope"] * (along - p["start"])
    pressed = p["per_force"] * rounded(force[:2], p["tiny_force"])
    pressed += p["per_bending"] * rounded(moment[:2], p["tiny_bending"]) / overlap
    return pressed + p["per_twist"] * rounded(moment[2:], p["tiny_twist"])


def limited(load, most):
    """Return a load that is at most so large."""
    return np.maximum(np.minimum(load, most), -most)


def shortened(loads, most):
    """Return a vector that is at most so long, in its direction."""
    length = rounded(loads, TINY * most)
    return [choose(length, most, most / length * load, load) for load in loads]


def seen(kind, frames, sense, reaction, p):
    """Return N and the slips; of a pin the first frame is whose z axis it turns about.

    ``sense`` is 1 if that is I's, else -1.
    """
    base, one = frames if kind == PIN else frames[::-1]
    d, v, w = one.minus(base)
    z = base.axes[2]
    force, moment = ([dot(axis, part) for axis in base.axes] for part in (reaction[:3], reaction[3:]))
    if kind == PIN:
        # w is that of the other frame against it
        return pressing_a_pin(force, moment, p), [-sense * (p["lever"] * dot(z, w))]
    if kind == BALL:
        slips = [p["lever"] * dot(axis, w) for axis in base.axes]
        return p["per_force"] * rounded(force, p["tiny_force"]), slips
    slips = [dot(z, seen_from(d, v, base.w)), p["lever"] * dot(z, w)][:kind]
    return pressing_a_guide(force, moment, dot(z, d), p), slips


def loads(pressing, slips, states, p):
    """Return L_k, and the rates of the deformations if there are any."""
    count = len(slips)
    speed = choose(0.0, slips[0], -slips[0], slips[0]) if count == 1 else rounded(slips, TINY * p["transition"])
    rates, mu = by_deformation(slips, speed, states, p) if states else ([], by_velocity(slips, speed, p))
    if count == 3:
        return shortened([-(p["lever"] * x * pressing) - p["kept"] * x for x in mu], p["most"]), rates
    # where there is one, N has its lever already
    made = [limited(-(mu[0] * pressing) - p["kept"] * mu[0], p["most"])]
    if count == 2:
        made.append(limited(-(p["lever"] * mu[1] * pressing) - p["kept_about"] * mu[1], p["most_about"]))
    return made, rates


# The kernels that follow.


def named(names: str, count: int, array: str = "", first: int | str = 0) -> list[Value]:
    """Return arguments of one name, counted."""
    return inputs(" ".join(f"{names}{k}" for k in range(count)), array, first)


def tables() -> tuple[Mapping[str, Value], dict[Value, Value]]:
    """Return the numbers of a joint by name, and their changes."""
    numbers = inputs(" ".join(REALS), "reals")
    return dict(zip(REALS, numbers)), dict(zip(numbers, inputs(" ".join(f"d_{one}" for one in REALS), "changed")))


def law(n: int, sticking: bool) -> list[Function]:
    """Return the kernels of the law of a joint with so many slips."""
    name = f"{COUNTED[n]}_{'sticking' if sticking else 'creeping'}"
    pressing, slips = inputs("pressing", "seen")[0], named("s", n, "seen", 1)
    states = named("z", n, "states") if sticking else []
    p, changes = tables()
    made, rates = loads(pressing, slips, states, p)
    changes |= dict(zip([pressing, *slips], [*inputs("d_pressing", "d_seen"), *named("d_s", n, "d_seen", 1)]))
    changed = [tangent(one, changes) for one in [*made, *rates]]
    return [
        Function(f"{name}_loads", "seen, states, reals, loads, rates", "Write the loads and the deformations' rates.",
                 sets=placed("loads[{}]", 0, made) | placed("rates[{}]", 0, rates)),
        Function(f"{name}_slopes", "seen, states, reals, slopes", "Write their derivatives by all three.",
                 sets=matrix("slopes", [*made, *rates], [pressing, *slips, *states], 0)),
        Function(f"{name}_changed", "seen, states, reals, d_seen, changed, out", "Write their changes.",
                 sets=placed("out[{}]", 0, changed)),
    ]  # fmt: skip


def joint(kind: int) -> list[Function]:
    """Return the kernels of what is seen of a joint."""
    name, pin = NAMES[kind], kind == PIN
    frames = [Frame("frames", mark, f"{row}, ") for mark, row in zip("ij", ("own", "other") if pin else (0, 1))]
    (sense,), reaction, (p, changes) = inputs("sense"), inputs("fx fy fz nx ny nz", "reaction"), tables()
    pressing, slips = seen(kind, frames, sense, reaction, p)
    told = [pressing, *slips]
    moved = [x for frame in frames for x in frame.variations] + reaction
    columns: list[Any] = list(range(len(moved)))
    if pin:
        columns[:24] = [f"{at} + {k}" for at in ("at", "to") for k in range(12)]
    slopes = {f"slopes[{r}, {columns[q]}]": slope for (r, q), slope in rows(told, moved).items()}
    at = f"frames, {'own, other, sense, ' if pin else ''}reaction, reals"
    return [
        Function(f"{name}_seen", f"{at}, seen", "Write N and the slips.", sets=placed("seen[{}]", 0, told)),
        Function(f"{name}_seen_slopes", f"{at}, {'at, to, ' if pin else ''}slopes", "Write their derivatives.",
                 sets=slopes),
        Function(f"{name}_seen_changed", f"{at}, changed, seen", "Write how they change with the numbers of the joint.",
                 sets=placed("seen[{}]", 0, [tangent(one, changes) for one in told])),
    ]  # fmt: skip


def functions() -> list[Function]:
    return [
        *(one for n in (1, 2, 3) for sticking in (False, True) for one in law(n, sticking)),
        *(one for kind in range(4) for one in joint(kind)),
    ]
