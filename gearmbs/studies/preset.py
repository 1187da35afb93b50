"""The paper's six cases: healthy, misaligned and +3 mm, at 100 and 200 N m."""

from __future__ import annotations

import numpy as np

from gearmbs.studies.case import Case, CaseError, make_case

STATES = ("healthy", "misaligned", "distance")
LOADS = (100.0, 200.0)
LOAD_NAMES = ("low", "high")
DEFAULT_COMPONENT = "line_of_action"
MISALIGNMENT = np.deg2rad(1.0)
DISTANCE = 3e-3
RATES = {"signal_rate": 12800.0, "output_rate": 51200.0}
"""Sampling rates, Hz: that of the paper's measurements, and four times as much for forces and contact."""


def paper_cases(
    *, base: Case | None = None, torques: tuple[float, float] = LOADS, misalignment: float = MISALIGNMENT
) -> list[Case]:
    """Return the six cases of the paper, built on a base case that holds everything else.

    Raises
    ------
    CaseError
        If one of them is impossible.
    """
    data = (base or Case()).model_dump()
    if data["solver"]["signal_rate"] is None and data["solver"]["output_rate"] is None:
        data["solver"] |= RATES
    faults = {
        "healthy": {"misalignment": 0.0, "centre_distance_error": 0.0},
        "misaligned": {"misalignment": misalignment, "centre_distance_error": 0.0},
        "distance": {"misalignment": 0.0, "centre_distance_error": DISTANCE},
    }
    if len(torques) != 2 or not 0.0 < torques[0] < torques[1]:
        raise CaseError(f"torques {torques}: give a low and a high torque, both positive")
    return [
        make_case(
            {
                **data,
                "name": f"{state}, {load} load",
                "operation": {**data["operation"], "torque": torque},
                "fault": {**data["fault"], **faults[state]},
            },
            f"{state}, {load} load",
        )
        for torque, load in zip(torques, LOAD_NAMES)
        for state in STATES
    ]
