"""Forces of a slice of the face, and friction in a section, each stated once; see `gearmbs.kernels.derive`.

Derivation in docs/theory/contact.md, "Along the face" and "Laws". Laws of pressure and friction are handed in, with
their slopes.
"""

from __future__ import annotations

from gearmbs.contact.layout import POINTS
from gearmbs.kernels.derive import Function, along, choose, derivative, given, inputs, product

COMPILED = 'error_model="numpy", fastmath={"contract": True, "arcp": True}'
"""As all kernels of contact, see `gearmbs.contact.records`."""


def shares(places, span, weights):
    """Return what Gauss's points weigh, and their shares on the left and right node of a slice, as 1 - u and u."""
    masses = [span * weight for weight in weights]
    return masses, [m * (1.0 - u) for m, u in zip(masses, places)], [m * u for m, u in zip(masses, places)]


def slices() -> list[Function]:
    """Return the kernels of a slice: its touching part goes from low to high, fractions of its width.

    Gauss's points weigh ``m``. Between the nodes depth and rate are linear. A bound where the touch ends is where the
    depth vanishes, at ``g_0 / (g_0 - g_1)``, and moves with the gaps; ``clip_low`` and ``clip_high`` are 1 for such.
    """
    g0, g1, r0, r1 = inputs("g0 g1 r0 r1")
    low, high, clip_low, clip_high = inputs("low high clip_low clip_high")
    span = high - low
    places = [low + span * t for t in POINTS]
    pressures, elastic, energy = (inputs(f"{x}0 {x}1 {x}2") for x in "pew")
    depth_slopes, rate_slopes = (inputs(f"{x}0 {x}1 {x}2") for x in "dv")
    rates = [-(r0 + u * (r1 - r0)) for u in places]
    for p, by_depth, by_rate, u, rate in zip(pressures, depth_slopes, rate_slopes, places, rates):
        given(p, {-(g0 + u * (g1 - g0)): by_depth, rate: by_rate})
    masses, on_left, on_right = shares(places, span, inputs("m0 m1 m2"))
    left, right = product(on_left, pressures), product(on_right, pressures)
    power = product(masses, ((p - e) * x for p, e, x in zip(pressures, elastic, rates)))
    by_bounds = [derivative(side, x) for x in (low, high) for side in (left, right)]
    across = 1.0 / ((g0 - g1) * (g0 - g1))
    ends = [[choose(clipped, 0.0, x, 0.0) for x in (-(g1 * across), g0 * across)] for clipped in (clip_low, clip_high)]
    by_gaps = [
        -(derivative(side, x) + by_bounds[n] * ends[0][k] + by_bounds[2 + n] * ends[1][k])
        for n, side in enumerate((left, right)) for k, x in enumerate((g0, g1))
    ]  # fmt: skip
    by_rates = [-derivative(left, r0), -derivative(left, r1), -derivative(right, r1)]
    numbers = "low, high, m0, m1, m2, p0, p1, p2"
    return [
        Function("slice_forces", f"r0, r1, {numbers}, e0, e1, e2, w0, w1, w2",
                 "Return forces and their elastic parts on both nodes, the energy and the damping power of a slice.",
                 [left, right, product(on_left, elastic), product(on_right, elastic), product(masses, energy), power]),
        Function("slice_slopes", f"g0, g1, r0, r1, {numbers}, d0, d1, d2, v0, v1, v2, clip_low, clip_high",
                 "Return minus the derivatives of its forces by gaps and rates, and those by low and high.",
                 [*by_gaps, *by_rates, *by_bounds]),
    ]  # fmt: skip


def unit_wrenches(sin, cos, normal, tangent, place, lean, across):
    """Return the wrenches on wheel 1 of unit forces along the profile and along the contact line.

    The point is ``normal n + tangent t + place z`` from wheel 1, n = (sin, cos) and t = (cos, -sin). The contact line
    leans against the axis by the base helix angle, ``lean`` and ``across`` being its cosine and sine.
    """
    profile = [cos, -sin, 0.0, place * sin, place * cos, -normal]
    x, y = normal * cos - tangent * sin, -(normal * sin) - tangent * cos
    line = [-(across * sin), -(across * cos), lean, lean * x + across * (place * cos),
            lean * y - across * (place * sin), -(across * tangent)]  # fmt: skip
    return profile, line


def friction() -> list[Function]:
    """Return the kernels of friction in a section, ``F = -(mu(v) / v) f v`` along both directions."""
    twist = inputs("twist_0 twist_1 twist_2 twist_3 twist_4 twist_5")
    sin, cos, normal, across_n, place, lean, across = inputs("sin cos normal tangent place lean across")
    alpha, force, ratio, slope = inputs("_alpha force ratio slope")
    given(sin, {alpha: cos})
    given(cos, {alpha: -sin})
    profile, line = unit_wrenches(sin, cos, normal, across_n, place, lean, across)
    speeds = v_profile, v_line = product(twist, profile), product(twist, line)
    # the slope of the ratio is handed in over the speed
    given(ratio, {v: slope * v for v in speeds})
    scale = -(ratio * force)
    wrench = [scale * v_profile * x + scale * v_line * y for x, y in zip(profile, line)]
    turn, by_normal, by_tangent, by_place, by_force = inputs("turn by_normal by_tangent by_place by_force")
    moves = {alpha: turn, normal: by_normal, across_n: by_tangent, place: by_place, force: by_force}
    # F goes along P with the speed P . t, so that its derivatives by the twist t are symmetric
    by_twist = [[derivative(wrench[i], v) for v in twist[i:]] for i in range(6)]
    symmetric = {f"moved[{i}, {k}, j]": by_twist[min(i, k)][abs(i - k)] for i in range(6) for k in range(6)}
    told = "twist_0, twist_1, twist_2, twist_3, twist_4, twist_5, sin, cos, normal, tangent, place, lean, across"
    laws = f"{told}, ratio, force"
    return [
        Function("sliding", told, "Return the sliding velocity along the profile and the contact line.", speeds),
        Function("friction_wrench", laws, "Return the wrench of friction on wheel 1, and its power.",
                 [*wrench, scale * (v_profile * v_profile + v_line * v_line)]),
        Function("friction_along", f"{laws}, slope, turn, by_normal, by_tangent, by_place, by_force, moved, k, j",
                 "Write how the wrench moves with one pose number.",
                 sets={f"moved[{i}, k, j]": along(one, moves) for i, one in enumerate(wrench)}),
        Function("friction_by_twist", f"{laws}, slope, moved, by_force, j",
                 "Write the derivatives of the wrench by the twist, and by the normal force.",
                 sets=symmetric | {f"by_force[{i}, j]": derivative(one, force) for i, one in enumerate(wrench)}),
    ]  # fmt: skip


def functions() -> list[Function]:
    return [*slices(), *friction()]
