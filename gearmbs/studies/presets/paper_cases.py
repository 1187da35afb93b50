"""The paper's six cases: healthy, misaligned and +3 mm, at 100 and 200 N m, and its three claims."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from gearmbs.studies.case.case import Case, CaseError, make_case

STATES = ("healthy", "misaligned", "distance")
LOADS = (100.0, 200.0)
LOAD_NAMES = ("low", "high")
DEFAULT_COMPONENT = "line_of_action"
MISALIGNMENT = np.deg2rad(1.0)
DISTANCE = 3e-3
"""Error of the centre distance in the paper's widened cases, m: +3 mm."""
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


# The three claims of the paper, judged on a table of mesh harmonics.


MUCH = 1.5
"""Ratio of amplitudes at high and low load from which the latter count as "much smaller"; the paper gives none."""


@dataclass(frozen=True)
class Claim:
    """One claim of the paper, judged for one force component.

    Attributes
    ----------
    name : str
        What the paper says.
    component : str
        Force component the acceleration is made of.
    held : bool
    numbers : str
        What it was judged on.
    rule : str
        When it counts as held.
    """

    name: str
    component: str
    held: bool
    numbers: str
    rule: str


def judge(table: xr.DataArray, component: str) -> list[Claim]:
    """Judge the three claims on a table of dims (load, state, harmonic)."""
    healthy, tilted, apart = (table.sel(state=state) for state in STATES)
    ratio_2 = (tilted / healthy).sel(harmonic=2)
    rises = apart / healthy
    high_low = table.sel(load="high") / table.sel(load="low")

    def numbers(values: xr.DataArray) -> str:
        return ", ".join(f"{float(v):.3g}" for v in np.ravel(values.values))

    return [
        Claim(
            "misalignment raises the 2nd GMF harmonic",
            component,
            bool((ratio_2 > 1.0).all()),
            f"misaligned / healthy at 2 x GMF: {numbers(ratio_2)} (low, high load); "
            f"at 1 x: {numbers((tilted / healthy).sel(harmonic=1))}; "
            f"at 3 x: {numbers((tilted / healthy).sel(harmonic=3))}",
            "above 1 at both loads",
        ),
        Claim(
            "+3 mm centre distance raises all three harmonics",
            component,
            bool((rises > 1.0).all()),
            "distance / healthy at 1, 2, 3 x GMF: "
            f"{numbers(rises.sel(load='low'))} (low); {numbers(rises.sel(load='high'))} (high)",
            "above 1 for every harmonic at both loads",
        ),
        Claim(
            "amplitudes at low load are much smaller than at high load",
            component,
            bool((high_low >= MUCH).all()),
            "high / low at 1, 2, 3 x GMF: "
            + "; ".join(f"{numbers(high_low.sel(state=state))} ({state})" for state in STATES)
            + f"; {int((high_low > 1.0).sum())} of {high_low.size} amplitudes are smaller at low load, "
            f"{int((high_low >= MUCH).sum())} by {MUCH:g} times or more",
            f"at least {MUCH:g} for every state and harmonic",
        ),
    ]
