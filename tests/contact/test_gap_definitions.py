"""Gaps, places of contacts and lengths of roll: first and second derivatives by the pose against jets of the formulas.

The formulas are those of docs/theory/contact.md, with angles for what the definitions have rules of, and without the
frame of the normal. Angles that equations fix, the normal and the polar angle of a tip edge, are found by Newton's
method in floats, and two steps of it on jets.
"""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.contact.formulas import derived as F
from gearmbs.contact.gaps import derived as D
from tests.jets import jets

X = np.array([0.0899, 1.3e-3, 0.021, -0.034, 0.11, -0.16])
RB1, RB2, ZETA, ROUNDING, HELIX = 0.0402, 0.0476, 4e-3, 3e-4, 0.2
TIPS, CORNERS, FLANKS = (0.042, 0.049), (-0.03, 0.18), (-0.14, 0.1)
"""Of both wheels: radius of the tip corner, its polar angle, and the angle where the flank's involute begins."""


def tilted(x, alpha):
    """Return A, B, w and kappa of a normal."""
    p, q = x[2], x[3]
    A, B = p * np.sin(alpha) + q * np.cos(alpha), p * np.cos(alpha) - q * np.sin(alpha)
    return A, B, np.sqrt(1.0 - p * p - q * q), np.sqrt(1.0 - B * B)


def turn(x, alpha):
    A, B, w, _ = tilted(x, alpha)
    return np.arctan2(A * B, w * (1.0 + w) + A * A)


def roll(x, alpha, rb, spin, t=0.0):
    """Return s of an involute, or of a helicoid; the spin is that of the flank."""
    _, B, _, kap = tilted(x, alpha)
    lean = t * B / kap
    return rb * (spin + alpha + turn(x, alpha) - np.arctan2(lean, np.sqrt(1.0 - lean * lean)))


def involute(x, alpha, rb, spin):
    _, _, w, kap = tilted(x, alpha)
    return kap / w * roll(x, alpha, rb, spin)


def corner(x, alpha, eta, radius):
    A, _, w, kap = tilted(x, alpha)
    leaning = x[2] * np.cos(eta) + x[3] * np.sin(eta)
    return radius * (np.sin(alpha + eta) + A * leaning / (w * (1.0 + w))) + ROUNDING * kap / w


def helicoid(x, alpha, rb, spin, t, Z):
    A, B, w, _ = tilted(x, alpha)
    c = 1.0 + t * t
    K = np.sqrt(1.0 - c * B * B)
    s = roll(x, alpha, rb, spin, t)
    return ((w * K - t * A) * s + (c * w * A - t * K) * Z) / (1.0 - c * (A * A + B * B))


def edge_angle(x, start, k, Z, radius):
    """Return the polar angle of a helical tip edge."""
    p, q = x[2], x[3]
    w = np.sqrt(1.0 - p * p - q * q)

    def step(p, q, w, Z, start, eta):
        behind = w * (eta - start) + k * (Z + radius * (p * np.cos(eta) + q * np.sin(eta)))
        return behind / (w + k * radius * (q * np.cos(eta) - p * np.sin(eta)))

    eta, numbers = start.value, [number.value for number in (p, q, w, Z, start)]
    for _ in range(20):
        eta -= step(*numbers, eta)
    eta = eta - step(p, q, w, Z, start, eta)
    return eta - step(p, q, w, Z, start, eta)


def edge(x, alpha, eta, Z, radius):
    A, _, w, _ = tilted(x, alpha)
    return corner(x, alpha, eta, radius) + Z * A / w


def gap_of(kind, own):
    """Return the gap by the pose and alpha, the support function of wheel 1, and the corner's polar angle."""
    base = (RB1, RB2)

    def gap(a, h, p, q, f1, f2, alpha):
        x, places = (a, h, p, q), (ZETA + 0.5 * h, ZETA - 0.5 * h)
        spins = [f + start for f, start in zip((f1, f2), FLANKS)]
        A, _, w, _ = tilted(x, alpha)
        h1 = [None, None]
        mate = 1 - own
        radius, eta = TIPS[own], (f1, f2)[own] + CORNERS[own]
        if kind == "flanks":
            h1 = [involute(x, alpha, base[k], spins[k]) for k in (0, 1)]
        elif kind == "corner":
            h1[own], h1[mate] = corner(x, alpha, eta, radius), involute(x, alpha, base[mate], spins[mate])
        else:
            helices = (HELIX, -HELIX)
            h1 = [helicoid(x, alpha, base[k], spins[k], helices[k], places[k]) for k in (0, 1)]
            if kind == "edge":
                eta = edge_angle(x, eta, helices[own] / base[own], places[own], radius)
                h1[own] = edge(x, alpha, eta, places[own], radius)
        along = 2.0 * A / w * ZETA if kind in ("flanks", "corner") else 0.0
        place = h1[0] + (A / w * places[0] if kind in ("flanks", "corner") else 0.0)
        return a * np.sin(alpha) - along - h1[0] - h1[1], place, eta

    return gap


def settled(gap):
    """Return alpha, the jets there of gap and place, and the polar angle: variables are the pose and alpha."""
    alpha = 0.23
    for _ in range(30):
        at, place, eta = gap(*jets([*X, alpha]))
        alpha -= at.gradient[6] / at.hessian[6, 6]
    return alpha, at, place, eta


def numbers(kind, own, alpha, eta):
    """Return the arguments of the kernels of a gap but the arrays, and the tilt."""
    a, h, p, q, f1, f2 = X
    w = np.sqrt(1.0 - p * p - q * q)
    one = 1.0 / (1.0 + w)
    m = one / w
    m_w = -(1.0 + 2.0 * w) * m * m
    tilt = (p, q, w, 1.0 / w, one, m, m_w, 2.0 * m * m * ((1.0 + 2.0 * w) ** 2 * m - 1.0))
    sa, ca = np.sin(alpha), np.cos(alpha)
    corner_of = (np.sin(eta), np.cos(eta), TIPS[own], ROUNDING)
    base, helices = (RB1, RB2), (HELIX, -HELIX)
    spins = [f + start for f, start in zip((f1, f2), FLANKS)]
    mate, sign = 1 - own, 1.0 - 2.0 * own
    rolls = [float(roll(X, alpha, base[k], spins[k])) for k in (0, 1)]
    if kind == "flanks":
        return (a, ZETA, sa, ca, sum(rolls), RB1, RB2), tilt
    if kind == "corner":
        return (a, ZETA, sa, ca, rolls[mate], base[mate], *corner_of, sign), tilt
    rolls = [float(roll(X, alpha, base[k], spins[k], helices[k])) for k in (0, 1)]
    helix = (a, ZETA, h, sa, ca, HELIX if kind == "helicoids" else helices[mate], 1.0 + HELIX**2)
    if kind == "helicoids":
        return (*helix, *rolls, RB1, RB2), tilt
    return (*helix, rolls[mate], base[mate], *corner_of, helices[own] / base[own], sign), tilt


def compared(found, exact):
    assert found == pytest.approx(exact, rel=1e-10, abs=1e-13 * np.max(np.abs(exact)))


def filled(upper):
    return upper + np.triu(upper, 1).T


CASES = [("flanks", 0), ("corner", 0), ("corner", 1), ("helicoids", 0), ("edge", 0), ("edge", 1)]


@pytest.mark.parametrize(("kind", "own"), CASES)
def test_gaps_have_exact_gradients_and_hessians(kind, own):
    alpha, exact, _, eta = settled(gap_of(kind, own))
    arguments, tilt = numbers(kind, own, alpha, getattr(eta, "value", eta))
    grad, turns, hess = np.zeros((6, 3)), np.zeros((6, 3)), np.zeros((6, 6, 3))
    found = getattr(D, f"{kind}_gap").py_func(*arguments, grad, 1, *tilt)
    getattr(D, f"{kind}_bend").py_func(*arguments, turns, hess, 1, *tilt)
    slope, bend, _ = getattr(D, f"{kind}_normal").py_func(*arguments, *tilt)
    compared(np.atleast_1d(found)[0], exact.value)
    compared(grad[:, 1], exact.gradient[:6])
    mixed = exact.hessian[:6, 6]
    compared(turns[:, 1], -mixed / exact.hessian[6, 6])
    compared(filled(hess[:, :, 1]), exact.hessian[:6, :6] - np.outer(mixed, mixed) / exact.hessian[6, 6])
    assert slope == pytest.approx(0.0, abs=1e-14)
    compared(bend, exact.hessian[6, 6])


@pytest.mark.parametrize(("kind", "own"), CASES)
def test_normals_are_found_by_exact_slopes(kind, own):
    alpha = 0.31
    at, _, eta = gap_of(kind, own)(*jets([*X, alpha]))
    arguments, tilt = numbers(kind, own, alpha, getattr(eta, "value", eta))
    slope, bend, across = getattr(D, f"{kind}_normal").py_func(*arguments, *tilt)
    compared([slope, bend], [at.gradient[6], at.hessian[6, 6]])
    # as zeta enters, linearly
    further = (arguments[0], ZETA + 1e-3, *arguments[2:])
    if kind != "edge":
        moved = getattr(D, f"{kind}_normal").py_func(*further, *tilt)[0] - slope
        assert moved == pytest.approx(1e-3 * across, rel=1e-9)


@pytest.mark.parametrize(("kind", "own"), [case for case in CASES if case[1] == 0])
def test_places_of_contacts_have_exact_derivatives(kind, own):
    alpha, gap, place, eta = settled(gap_of(kind, own))
    arguments, tilt = numbers(kind, own, alpha, getattr(eta, "value", eta))
    sa, ca, turns = np.sin(alpha), np.cos(alpha), -gap.hessian[:6, 6] / gap.hessian[6, 6]
    profile = {"flanks": "involute", "helicoids": "helicoid"}.get(kind, kind)
    own_roll = float(roll(X, alpha, RB1, X[4] + FLANKS[0], HELIX if profile == "helicoid" else 0.0))
    by_kind = {
        "involute": (own_roll, RB1),
        "corner": arguments[6:10],
        "helicoid": (HELIX, 1.0 + HELIX**2, own_roll, RB1),
        "edge": arguments[9:14],
    }
    given = (ZETA, X[1], sa, ca, *by_kind[profile])
    found = getattr(D, f"{profile}_point").py_func(gap.value, *given, *tilt)
    compared(found, [place.value + 0.5 * gap.value, place.gradient[6]])
    alpha_x, grad, normal_x, tangent_x = (np.zeros((6, 2)) for _ in range(4))
    alpha_x[:, 1], grad[:, 1] = turns, gap.gradient[:6]
    getattr(D, f"{profile}_point_slopes").py_func(*given, alpha_x, grad, normal_x, tangent_x, 1, *tilt)
    compared(normal_x[:, 1], place.gradient[:6] + place.gradient[6] * turns + 0.5 * gap.gradient[:6])
    compared(tangent_x[:, 1], place.hessian[:6, 6] + place.hessian[6, 6] * turns)


@pytest.mark.parametrize("tip", [0, 1])
def test_distances_of_tip_and_root_lines_have_exact_derivatives(tip):
    def gap(a, h, p, q, f1, f2):
        tip_angle, root_angle = (f1, f2) if tip == 1 else (f2, f1)
        vx = -0.047 * np.cos(tip_angle + 0.1) - 0.044 * np.cos(root_angle)
        vy = -0.047 * np.sin(tip_angle + 0.1) - 0.044 * np.sin(root_angle)
        w = np.sqrt(1.0 - p * p - q * q)
        along = (p * vx + q * vy) / (w * (1.0 + w)) - 2.0 * ZETA / w
        dx, dy = a + vx + p * along, vy + q * along
        return -1.0 * (np.sqrt(dx * dx + dy * dy - (p * dx + q * dy) ** 2.0) - 2e-3)

    exact = gap(*jets(X))
    _, tilt = numbers("flanks", 0, 0.3, 0.0)
    tip_angle, root_angle = (X[4], X[5]) if tip == 1 else (X[5], X[4])
    tx, ty = 0.047 * np.sin(tip_angle + 0.1), -0.047 * np.cos(tip_angle + 0.1)
    cx, cy = 0.044 * np.sin(root_angle), -0.044 * np.cos(root_angle)
    p, q, _, i_w, _, m, m_w, m_ww = tilt
    first = (X[0], p, q, ZETA, ty + cy, -tx - cx, tx, ty, cx, cy, i_w, m, m_w, m_ww, -1.0, 2e-3, 2.0 * tip - 1.0)
    grad, hess = np.zeros((6, 2)), np.zeros((6, 6, 2))
    compared(D.line_gap.py_func(*first, grad, 1), exact.value)
    D.line_bend.py_func(*first, hess, 1)
    compared(grad[:, 1], exact.gradient)
    compared(filled(hess[:, :, 1]), exact.hessian)


@pytest.mark.parametrize("wheel", [0, 1])
def test_lengths_of_roll_of_flanks_have_exact_derivatives(wheel):
    own, twist, sign = (RB1, HELIX, 1.0) if wheel == 0 else (RB2, -HELIX, -1.0)

    def length(a):
        return np.sqrt(a * a - (RB1 + RB2) ** 2)

    def rolled(a, h, p, q, f1, f2):
        alpha = np.arctan2(length(a), RB1 + RB2 + 0.0 * a)
        apart = RB1 * f1 - RB2 * f2 + (RB1 - RB2) * alpha
        turned = q / a - p * (RB1 + RB2) / (a * length(a))
        return 0.5 * (sign * apart + length(a)) + 2.0 * ZETA * own * turned - twist * (ZETA + 0.5 * sign * h)

    exact, a = rolled(*jets(X)), X[0]
    grad, hess = np.zeros(6), np.zeros((6, 6))
    alpha = np.arctan2(length(a), RB1 + RB2)
    found = F.flanks_roll.py_func(*X, ZETA, own, twist, sign, RB1, RB2, alpha, length(a), grad, hess)
    compared(found, exact.value)
    compared(grad, exact.gradient)
    compared(hess, exact.hessian)


@pytest.mark.parametrize("k", [0.0, HELIX / RB1])
@pytest.mark.parametrize("own", [0, 1])
def test_lengths_of_roll_under_corners_have_exact_derivatives(own, k):
    sign = 1.0 - 2.0 * own

    def square(a, h, p, q, f1, f2):
        eta = edge_angle((a, h, p, q), (f1, f2)[own] + 0.2, k, ZETA + sign * 0.5 * h, 0.0455)
        x, y = a - 0.0455 * np.cos(eta) - 2.0 * p * ZETA, -0.0455 * np.sin(eta) - 2.0 * q * ZETA
        return x * x + y * y - 0.04**2, eta.value

    squared, eta = square(*jets(X))
    exact = np.sqrt(squared)
    a, h, p, q = X[:4]
    w, sine, cosine = np.sqrt(1.0 - p * p - q * q), np.sin(eta), np.cos(eta)
    compared(F.foot_square.py_func(a, p, q, ZETA, 0.0455, sine, cosine, 0.04), squared.value)
    told = (a, h, p, q, ZETA, 0.0455, sine, cosine, sign, exact.value, k, w)
    grad, hess = np.ones(6), np.ones((6, 6))
    F.foot_slopes.py_func(*told, grad)
    F.foot_bends.py_func(*told, hess)
    compared(grad - 1.0, exact.gradient)
    compared(hess - 1.0, exact.hessian)
