"""The three claims of the paper, judged on a table of mesh harmonics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from gearmbs.studies.preset import STATES

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
