"""Exact derivatives of the contact wrench against differences, support functions against complex step."""

import numpy as np
import pytest

from gearmbs.contact.support import profiles as sup
from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec
from gearmbs.gears.faults import (
    BrokenTooth,
    ChippedCorner,
    Crowning,
    Eccentricity,
    GradedFlanks,
    RootCrack,
    TipRelief,
    Wobble,
)

from .probe_tools import Contact, differences, shaken

SHAPED = (
    TipRelief(amount="15 um", length="6 mm", power=2.0),
    Crowning(wheel="driven", amount="8 um"),
    Eccentricity(amount="12 um", phase="50 deg"),
    Wobble(wheel="driven", angle="0.02 deg", phase="20 deg"),
    GradedFlanks(wheel="driven", grade=5, seed=3),
)
CASES = {
    "parallel": ({}, 1),
    "parallel, no friction": ({"friction": FlankFriction.none()}, 1),
    "one plane, tilted": ({"misalignment": "0.5 deg"}, 1),
    "skew": ({"misalignment": "1 deg"}, 12),
    "inclination": ({"misalignment": "1 deg", "plane": "inclination"}, 12),
    "slightly skew": ({"misalignment": "0.02 deg"}, 7),
    "parallel, sliced": ({}, 5),
    "far apart": ({"centre_distance_error": "3 mm"}, 1),
    "smooth friction": ({"friction": FlankFriction(kind="smooth")}, 4),
    "Hunt-Crossley": ({"contact": ContactLaw.hunt_crossley(), "misalignment": "0.3 deg"}, 5),
    "Kuwabara-Kono": (
        {"contact": ContactLaw("kuwabara-kono", 1.1e9, 1.3, "20 us"), "misalignment": "0.3 deg"},
        5,
    ),
    "linear": ({"contact": ContactLaw.linear("1.3e8 N/m"), "misalignment": "0.3 deg"}, 5),
    "centroid load": ({"misalignment": "1 deg", "load": "adams"}, 9),
    "centroid load, parallel": ({"load": "adams"}, 4),
    "shaped flanks": ({"faults": SHAPED, "misalignment": "0.2 deg"}, 9),
    "shaped flanks, one plane": ({"faults": SHAPED}, 1),
    "chipped and broken": (
        {"faults": [ChippedCorner(tooth=k, length="9 mm") for k in range(0, 29, 2)] + [BrokenTooth(tooth=1, lost=0.3)]},
        12,
    ),
    "varying stiffness": ({"faults": [RootCrack(tooth=k) for k in range(0, 29, 2)], "misalignment": "0.1 deg"}, 6),
    "rounded tips": (
        {
            "driver": GearSpec(29, 95e-3 / 31, tip_rounding="0.3 mm"),
            "driven": GearSpec(29, 95e-3 / 31, tip_rounding="0.3 mm"),
            "centre_distance_error": "2.5 mm",
        },
        3,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_jacobian_against_differences(name):
    changes, slices = CASES[name]
    defaults = {"backlash": "0.02 mm", "centre_distance_error": "0.1 mm"} | changes
    contact = Contact(GearPair.paper(**defaults), slices)
    rng = np.random.default_rng(sum(map(ord, name)))
    checked = 0
    for _ in range(8):
        state = contact.state(rng.uniform(0, 6.28), rng.uniform(10e-6, 60e-6), 100.0)
        state = shaken(state, rng)
        contact(state, 1)
        if contact.diag[7] == 0:
            continue
        exact = contact.jac.copy()
        near = differences(contact, state)
        checked += 1
        for rows, blocks in ((slice(0, 3), range(8)), (slice(3, 6), range(8))):
            for b in blocks:
                columns = slice(3 * b, 3 * b + 3)
                scale = abs(near[rows, columns]).max()
                assert exact[rows, columns] == pytest.approx(near[rows, columns], abs=2e-7 * scale), (name, b)
    assert checked >= 4


def involute_support(alpha, p, q, spin, rb=0.04):
    a, b = p * np.sin(alpha) + q * np.cos(alpha), p * np.cos(alpha) - q * np.sin(alpha)
    w = np.sqrt(1 - p * p - q * q)
    turn = np.arctan(a * b / (w * (1 + w) + a * a))
    return np.sqrt(1 - b * b) / w * rb * (spin + 0.3 + alpha + turn)


def corner_support(alpha, p, q, eta, r=0.0475, rt=0.0003):
    a, b = p * np.sin(alpha) + q * np.cos(alpha), p * np.cos(alpha) - q * np.sin(alpha)
    w = np.sqrt(1 - p * p - q * q)
    lean = p * np.cos(eta) + q * np.sin(eta)
    return r * (np.sin(alpha + eta) + a * lean / (w * (1 + w))) + rt * np.sqrt(1 - b * b) / w


def kernel_support(function, y):
    """Value, gradient and Hessian by (alpha, p, q, spin) from the kernel's, which are in the frame of the normal."""
    alpha, p, q, spin = y
    sa, ca = np.sin(alpha), np.cos(alpha)
    a, b = p * sa + q * ca, p * ca - q * sa
    w = np.sqrt(1 - p * p - q * q)
    kap = np.sqrt(1 - b * b)
    one = 1 / (1 + w)
    m = one / w
    m_w, m_ww = -(1 + 2 * w) * m**2, 2 * m * m * ((1 + 2 * w) ** 2 * m - 1)
    tilt = sup.Tilt(p, q, w, 1 / w, w**-3, w**-5, one, m, m_w, m_ww, 0.0)
    if function is involute_support:
        args = (a, b, kap, 0.04 * (spin + 0.3 + alpha + sup.normal_turn(a, b, tilt)), 0.04, tilt)
        first, second = sup.involute_slopes(*args), sup.involute_curvatures(*args)
    else:
        args = (a, b, kap, np.sin(alpha + spin), np.cos(alpha + spin), 0.0475, 0.0003, tilt)
        first, second = sup.corner_slopes(*args), sup.corner_curvatures(*args)
    turn = np.array([[sa, ca], [ca, -sa]])
    grad = np.array([first.alpha, *(turn @ [first.A, first.B]), first.F])
    hess = np.zeros((4, 4))
    hess[0, 0] = second.alpha_alpha
    hess[0, 1:3] = turn @ [second.alpha_A, second.alpha_B]
    hess[0, 3] = second.alpha_F
    hess[1:3, 1:3] = turn @ [[second.AA, second.AB], [second.AB, second.BB]] @ turn.T
    hess[1:3, 3] = turn @ [second.AF, second.BF]
    hess[3, 3] = second.FF
    return first.h, grad, np.triu(hess)


@pytest.mark.slow
@pytest.mark.parametrize("function", [involute_support, corner_support])
def test_support_functions_against_complex_step(function):
    def gradient(y):
        parts = np.eye(4) * 1e-30j
        return np.array([function(*(y + part)).imag for part in parts]) / 1e-30

    rng = np.random.default_rng(5)
    for _ in range(20):
        y = np.array([rng.uniform(0.2, 0.5), *rng.uniform(-0.4, 0.4, 2), rng.uniform(-0.3, 0.3)])
        value, grad, hess = kernel_support(function, y)
        assert value == pytest.approx(function(*y), rel=1e-14)
        assert grad == pytest.approx(gradient(y), abs=1e-15)
        h = 1e-4 * np.eye(4)
        near = [
            (8 * (gradient(y + e) - gradient(y - e)) - (gradient(y + 2 * e) - gradient(y - 2 * e))) / 12e-4 for e in h
        ]
        assert hess == pytest.approx(np.triu(near), abs=1e-11)
