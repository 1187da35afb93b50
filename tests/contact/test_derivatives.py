"""Exact derivatives of the contact wrench against differences; those of gaps by formulas: `test_gap_definitions.py`."""

import numpy as np
import pytest

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
