"""Exact derivatives of the contact wrench against differences, support functions against complex step."""

import numpy as np
import pytest

from gearmbs.contact import layout
from gearmbs.contact import support as sup
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
    """Value, gradient and Hessian by (alpha, p, q, spin) from the kernel's record in the frame of the normal."""
    alpha, p, q, spin = y
    sa, ca = np.sin(alpha), np.cos(alpha)
    a, b = p * sa + q * ca, p * ca - q * sa
    w = np.sqrt(1 - p * p - q * q)
    kap = np.sqrt(1 - b * b)
    wk = np.zeros(layout.work_size(1))
    one = 1 / (1 + w)
    m = one / w
    wk[[layout.S_IW, layout.S_IW3, layout.S_IW5, layout.S_ONE]] = 1 / w, w**-3, w**-5, one
    wk[[layout.S_M, layout.S_MW]] = m, -(1 + 2 * w) * m**2
    wk[layout.S_MWW] = 2 * m * m * ((1 + 2 * w) ** 2 * m - 1)
    wk[[layout.S_SIN, layout.S_COS]] = sa, ca
    o = layout.W_SUP
    if function is involute_support:
        s = 0.04 * (spin + 0.3 + alpha + sup.tilt_turn(a, b, w))
        sup.involute_support(a, b, w, kap, s, 0.04, wk, o, 1)
    else:
        wk[[layout.C_SIN, layout.C_COS, layout.C_R, layout.C_ROUND]] = np.sin(spin), np.cos(spin), 0.0475, 0.0003
        sup.corner_support(a, b, w, kap, wk, o, 1)
    r = wk[o : o + 15]
    turn = np.array([[sa, ca], [ca, -sa]])
    grad = np.array([r[sup.HA_], *(turn @ r[[sup.H_A, sup.H_B]]), r[sup.H_F]])
    hess = np.zeros((4, 4))
    hess[0, 0] = r[sup.HAA_]
    hess[0, 1:3] = turn @ r[[sup.HA_A, sup.HA_B]]
    hess[0, 3] = r[sup.HA_F]
    hess[1:3, 1:3] = turn @ [[r[sup.H_AA], r[sup.H_AB]], [r[sup.H_AB], r[sup.H_BB]]] @ turn.T
    hess[1:3, 3] = turn @ r[[sup.H_AF, sup.H_BF]]
    hess[3, 3] = r[sup.H_FF]
    return r[sup.H], grad, np.triu(hess)


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
