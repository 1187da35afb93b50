"""Forces of rolling elements, each stated once; ``derived.py`` holds the kernels that follow: `gearmbs.kernels.derive`.

In the plane of an element the inner ring is displaced by u along e_r and by w along z, and leans by phi. What touches
at a path of the radius R and the height z is told by (X, Y), from the groove centre of the outer to that of the inner
ring, and by the missing material h, which depends on the angles psi, theta and beta:

    X = A_r + u + z phi,    Y = A_z + w - R phi,    Q = K s(delta)^n,    n = (cos alpha, sin alpha),

of balls delta = |(X, Y)| - A_0 - h and n = (X, Y)/|(X, Y)|, of rollers delta = n . (X, Y) - gap - h with a fixed
normal. A contact that approaches at delta' presses with f = Q (1 + chi delta'), and the generalised force on a
coordinate is -f ddelta/dq at a fixed normal.

Three stages hand numbers on to each other: the law of a contact (Q and alpha by X, Y, h and the centrifugal load), the
path (generalised forces in the plane of the element), the element (generalised forces on q). The sums over the paths of
an element are rows of numbers: forces on each coordinate of the plane and f, their derivatives by the coordinates, by
their rates, and by the centrifugal load.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearmbs.dae.equations.loads.traced import Frame, changed, dot, kernels, seen_from
from gearmbs.kernels.derive import ONE, ZERO, Function, Value, derivative, given, inputs, product, slopes, tangent
from gearmbs.mechanism.forces.definitions import impact_forces

Numbers = Sequence[Value]


def groove_centres(u, w, phi, radial, axial, radius, height):
    """Return X and Y."""
    return radial + u + height * phi, axial + w - radius * phi


def ball_approach(x, y, distance):
    """Return delta + h of a ball: it lies on the line of the groove centres."""
    return np.sqrt(x * x + y * y) - distance


def direction(x, y):
    """Return alpha."""
    return np.arctan2(y, x)


def roller_approach(x, y, nx, ny, gap):
    """Return delta + h of a slice of a roller."""
    return nx * x + ny * y - gap


def hertz(stiffness, exponent, part):
    """Return the force at a deflection."""
    return stiffness * part**exponent


def transition(delta, width):
    """Return s(delta), smooth to the second derivative, between -width and width."""
    up = delta + width
    return up * up * up * (3.0 * width - delta) / (16.0 * width * width * width)


def friction(rolling, viscous, slow, total, speed):
    """Return the friction torque about z by the sum of the normal forces and the speed."""
    square = speed * speed + slow * slow
    return -(rolling * total * speed) / np.sqrt(square) - viscous * speed * square ** (-1.0 / 6.0)


def damped(force, chi, rate):
    """Return f."""
    return force * (1.0 + chi * rate)


def in_plane(d0, d1, d2, a0, a1, c, s):
    """Return u, w and phi of the inner ring at an element in the direction (c, s)."""
    return d0 * c + d1 * s, d2, a0 * c + a1 * s


def in_a_bore(d, u, z):
    """Return eccentricity, its rate and its direction, of a journal at d from the middle of a bore of the axis z."""
    along = dot(d, z)
    rho = [x - along * axis for x, axis in zip(d, z)]
    eccentricity = np.sqrt(dot(rho, rho))
    n = [x / eccentricity for x in rho]
    return eccentricity, dot(n, u), n


# What is made of them. Of a parameter p there is a kernel that finds derivatives along dp: of the law, of a path.


def smooth_part() -> list[Function]:
    delta, width = inputs("delta width")
    part = transition(delta, width)
    return [
        Function("smooth_part", "delta, width", "Return s(delta) and its slope.", [part, derivative(part, delta)]),
        Function("smooth_part_by_width", "delta, width", "Return its slope by the width.", [derivative(part, width)]),
    ]


def friction_torque() -> list[Function]:
    rolling, viscous, slow, total, speed = inputs("rolling viscous slow total speed")
    torque = friction(rolling, viscous, slow, total, speed)
    changed = dict(zip((rolling, viscous, slow), inputs("d_rolling d_viscous d_slow")))
    arguments = "rolling, viscous, slow, total, speed"
    return [
        Function(
            "friction_torque", arguments, "Return the friction torque, its slopes by the sum of forces and the speed.",
            [torque, *slopes(torque, (total, speed))],
        ),
        Function(
            "friction_torque_changed", f"{arguments}, d_rolling, d_viscous, d_slow", "Return its change.",
            [tangent(torque, changed)],
        ),
    ]  # fmt: skip


def law_changed() -> list[Function]:
    stiffness, exponent, part, x, y, nx, ny, gap = inputs("stiffness exponent part x y nx ny gap")
    changed = inputs("d_stiffness d_part d_nx d_ny d_gap")
    force, approach = hertz(stiffness, exponent, part), roller_approach(x, y, nx, ny, gap)
    turned = dict(zip((nx, ny, gap), changed[2:]))
    return [
        Function(
            "hertz_changed", "stiffness, exponent, part, d_stiffness, d_part", "Return the change of Hertz's force.",
            [tangent(force, dict(zip((stiffness, part), changed)))],
        ),
        Function(
            "roller_changed", "x, y, nx, ny, gap, d_nx, d_ny, d_gap",
            "Return the changes of a roller's approach and of the direction of its normal.",
            [tangent(approach, turned), tangent(direction(nx, ny), turned)],
        ),
    ]  # fmt: skip


def ball_contact() -> Function:
    x, y, distance, h, stiffness, part, part_slope = inputs("x y distance h stiffness part part_slope")
    deflection = ball_approach(x, y, distance) - h
    given(part, {deflection: part_slope})
    force, angle = hertz(stiffness, 1.5, part), direction(x, y)
    return Function(
        "ball_contact", "x, y, stiffness, part, part_slope, law",
        "Write the law of a ball's contact, by the smooth part of its deflection and its slope.",
        sets=law(force, angle, slopes(deflection, (x, y)), (x, y, h)),
    )  # fmt: skip


def roller_contact() -> Function:
    nx, ny, x, y, gap, h = inputs("nx ny x y gap h")
    stiffness, exponent, part, part_slope = inputs("stiffness exponent part part_slope")
    deflection = roller_approach(x, y, nx, ny, gap) - h
    given(part, {deflection: part_slope})
    return Function(
        "roller_contact", "nx, ny, stiffness, exponent, part, part_slope, law",
        "Write the law of the contact of a slice of a roller, by the smooth part of its deflection and its slope.",
        sets=law(hertz(stiffness, exponent, part), ZERO, (nx, ny), (x, y, h)),
    )  # fmt: skip


def law(force: Value, angle: Value, normal: Numbers, by: Numbers) -> dict[str, Value]:
    """Return what is told of a contact that knows neither centrifugal load nor a second path, see `layout.LAW`."""
    told = [force, *normal, *slopes(force, by), ZERO, *slopes(angle, by), ZERO, ZERO, ZERO]
    return {f"law[{k}]": value for k, value in enumerate(told)}


def path(plain: bool) -> list[Function]:
    """Return the kernels of one path: the rate of its deflection, its forces in the plane, their derivatives.

    Parameters
    ----------
    plain : bool
        Whether there are neither profiles nor centrifugal load: then u, w and phi are all coordinates.
    """
    place = inputs("u w phi", "plane") + inputs("psi theta beta")
    rates = inputs("u_rate w_rate phi_rate psi_rate theta_rate beta_rate", "plane", 3)
    force, nx, ny, fx, fy, fh, by_load, ax, ay, ah, angle_by_load, f_phi, a_phi = inputs(LAW, "law")
    radial, axial, radius, height, chi, h, load = inputs("radial axial radius height chi h load")
    u, w, phi, psi, theta, beta = place
    x, y = groove_centres(u, w, phi, radial, axial, radius, height)
    own_force, own_angle = inputs("own_force own_angle")
    by_force, by_angle = {x: fx, y: fy, own_force: ONE}, {x: ax, y: ay, own_angle: ONE}
    if plain:
        place, rates, h, load = place[:3], rates[:3], ZERO, ZERO
    else:
        outer, inner, spin, outer_bend, inner_bend, spin_bend = inputs(PROFILES, "profile")
        given(outer, {psi: outer_bend})
        given(inner, {psi: inner_bend, theta: -inner_bend})
        given(spin, {beta: spin_bend})
        given(h, {psi: outer + inner, theta: -inner, beta: spin})
        by_force |= {h: fh, load: by_load, phi: f_phi}
        by_angle |= {h: ah, load: angle_by_load, phi: a_phi}
    given(force, by_force)
    given(nx, {by: -ny * slope for by, slope in by_angle.items()})
    given(ny, {by: nx * slope for by, slope in by_angle.items()})
    # at a fixed normal
    along = [nx * derivative(x, q) + ny * derivative(y, q) - derivative(h, q) for q in place]
    rate = product(along, rates)
    f = damped(force, chi, rate)
    rows = [-f * slope for slope in along] + [f]
    name, arguments = ("plain_contact", "plane, law") if plain else ("contact", "plane, law, profile")
    derivatives = [slope for by in (place, rates) for row in rows for slope in slopes(row, by)]
    if not plain:
        derivatives += [derivative(row, load) for row in rows]
    kernels = [] if plain else [path_changed(rows, [
        radial, axial, radius, height, chi, h, own_force, own_angle, outer, inner, spin
    ])]  # fmt: skip
    return kernels + [
        Function(f"{name}_rate", f"{arguments}, radius, height", "Return the rate of a path's deflection.", [rate]),
        Function(
            f"{name}_forces", f"{arguments}, radius, height, chi, sums", "Add the forces of a path.",
            adds=numbered("sums", rows),
        ),
        Function(
            f"{name}_slopes", f"{arguments}, radius, height, chi, sums", "Add the derivatives of a path's forces.",
            adds=numbered("sums", derivatives, len(rows)),
        ),
    ]  # fmt: skip


def path_changed(rows: Numbers, parameters: Numbers) -> Function:
    changed = dict(zip(parameters, inputs(CHANGES, "changes")))
    return Function(
        "contact_changed", "plane, law, profile, radius, height, chi, changes, sums",
        "Add the change of a path's forces.",
        adds=numbered("sums", [tangent(row, changed) for row in rows]),
    )  # fmt: skip


CHANGES = "d_radial d_axial d_radius d_height d_chi d_h d_force d_angle d_outer d_inner d_spin"
"""Changes of a path's parameters: of its table, of chi, of h less what delta grows by itself, of Q and alpha at a
deflection, and of the slopes of the profiles."""
LAW = "force nx ny force_x force_y force_h force_load angle_x angle_y angle_h angle_load force_phi angle_phi"
PROFILES = "outer inner spin outer_bend inner_bend spin_bend"


def numbered(array: str, values: Numbers, first: int = 0) -> dict[str, Value]:
    return {f"{array}[{first + k}]": value for k, value in enumerate(values)}


def element(plain: bool) -> list[Function]:
    """Return the kernels of one element: from the sums over its paths to forces on q, and their derivatives."""
    q = inputs("d0 d1 d2 a0 a1", "motion") + inputs("psi theta beta")
    rates = inputs("d0_rate d1_rate d2_rate a0_rate a1_rate psi_rate theta_rate beta_rate", "motion", 5)
    (c, s), (d0, d1, d2, a0, a1, psi, theta, beta) = inputs("c s"), q
    given(c, {psi: -s})
    given(s, {psi: c})
    place = [*in_plane(d0, d1, d2, a0, a1, c, s), psi, theta, beta]
    if plain:
        q, rates, place = q[:6], rates[:6], place[:3]
    moves = [product(slopes(x, q), rates) for x in place]
    size, count = len(place), len(place) + 1
    names = " ".join(f"sum{k}" for k in range(count * (2 + 2 * size)))
    sums = inputs(names, "sums")
    forces, by_load = sums[:count], sums[-count:]
    for k, force in enumerate(forces):
        by_place, by_move = (sums[first + size * k :][:size] for first in (count, count + size * count))
        given(force, dict(zip(place + moves, by_place + by_move)))
    turned = [product(forces[:-1], [derivative(x, one) for x in place]) for one in q] + forces[-1:]
    pulled = [product(by_load[:-1], [derivative(x, one) for x in place]) for one in q] + by_load[-1:]
    at = ["0", "1", "2", "3", "4", "5", "6", "spin"][: len(q)]
    name, rows = "plain_element" if plain else "element", [*at, "n"]
    slopes_at = {
        f"{matrix}[{row}, {column}]": derivative(force, one)
        for matrix, by in (("stiff", q), ("damp", rates))
        for row, force in zip(rows, turned)
        for column, one in zip(at, by)
    }
    loads_at = {} if plain else {f"by_load[{row}]": force for row, force in zip(rows, pulled)}
    extra = "" if plain else ", spin"
    return [
        Function(
            f"{name}_rates", "motion, c, s, plane", "Write the rates in the plane of an element.",
            sets=numbered("plane", moves, 3),
        ),
        Function(
            f"{name}_forces", f"motion, c, s, sums, forces, n{extra}",
            "Add the forces of an element on q, and its normal forces.",
            adds={f"forces[{row}]": force for row, force in zip(rows, turned)},
        ),
        Function(
            f"{name}_slopes", f"motion, c, s, sums, stiff, damp, n{extra}" + ("" if plain else ", by_load"),
            "Add the derivatives of the forces of an element, and of its normal forces, by q, its rates and the load.",
            adds=slopes_at | loads_at,
        ),
    ]  # fmt: skip


def bore() -> list[Function]:
    """Return the kernels of a journal with clearance, a round one in a round bore."""
    one, two = Frame("one", "i"), Frame("two", "j")
    d, v, _ = one.minus(two)
    clearance, *numbers = law = inputs("clearance stiffness exponent damping full_depth", "law")
    eccentricity, rate, n = in_a_bore(d, seen_from(d, v, two.w), two.axes[2])
    depth = eccentricity - clearance
    elastic, force = impact_forces(depth, rate, *numbers)
    load = [-(force * x) for x in n]
    told = [elastic * depth / (numbers[1] + 1.0), (force - elastic) * rate]
    return [
        Function("bore_depth", "one, two, law", "Return how deep a journal is in its bore.", [depth]),
        *kernels("bore", "the force of a bore on its journal", load, 0, one.variations + two.variations),
        Function("bore_energies", "one, two, law", "Return the energy stored, and the power dissipated.", told),
        changed("bore", "one, two, law", load, 0, law),
    ]


def functions() -> list[Function]:
    return [
        *smooth_part(), *friction_torque(), *law_changed(), ball_contact(), roller_contact(),
        *path(True), *path(False), *element(True), *element(False), *bore(),
    ]  # fmt: skip
