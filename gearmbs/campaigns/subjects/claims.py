"""The paper's three claims as the subject of a campaign: a point is a set of open settings, and six simulations."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np

from gearmbs.campaigns.settings import CampaignError
from gearmbs.campaigns.subjects.base import Kept, Outcome, Subject
from gearmbs.campaigns.subjects.pair import PairSubject, canonical_case
from gearmbs.studies.case.case import Case, make_case

SETTINGS = {
    "depth": ("m", 1e-4),
    "damping": ("N s/m", 298520.0),
    "stiffness": ("1", 2.9852e5),
    "exponent": ("1", 1.3),
    "friction": ("1", 0.1),
    "backlash": ("m", 1e-4),
    "plane": ("1", "skew"),
    "speed": ("rad/s", 104.71975511965977),
    "face_width": ("m", 0.02),
    "shaft_radius": ("m", 0.015),
    "torque": ("N m", 100.0),
}
"""What the paper leaves open: SI unit and the preset's value; the stiffness is in N/mm^exponent, as the paper gives
it, and the
dynamic friction is half the static one."""

PERIODS = 40
"""Least length of a record in mesh periods, for the band-pass filters."""

SHORTEST = 0.1
"""Least length of a record, s: 48 mesh periods at the preset's speed."""
RUN_UP = 0.03
"""Seconds of run-up, and as many of settling, before a record: less than the 0.05 of a case, for there are thousands of
them."""


class ClaimsSubject(Subject):
    """The paper's study at other settings.

    Keeps ``ratios``. For each component of the force: ``misaligned.C``, the least over both loads of misaligned over
    healthy at
    2 x GMF; ``distance.C``, the least over loads and harmonics of shifted over healthy; ``load.C``, the least over
    states and
    harmonics of high over low load, in one scale for all; ``load_each.C``, the same with each load in the scale of
    its own healthy
    state; and ``all.C``, 1 where all three claims hold as `gearmbs.studies.presets.paper_cases.judge` judges them.

    Parameters
    ----------
    settings : dict, optional
        Instead of the preset's `SETTINGS`.
    """

    kind: ClassVar[str] = "paper claims"
    keeps: ClassVar[tuple[str, ...]] = ("ratios",)

    def __init__(self, settings: dict[str, Any] | None = None) -> None:
        self.values = {name: value for name, (_, value) in SETTINGS.items()} | dict(settings or {})
        self._pairs = PairSubject()

    def settings(self) -> dict[str, Any]:
        """Return the settings."""
        return {"settings": json.loads(json.dumps(self.values))}

    @classmethod
    def from_settings(cls, settings: dict[str, Any]) -> ClaimsSubject:
        """Return the subject of a plan."""
        return cls(settings.get("settings"))

    def base(self) -> dict[str, Any]:
        """Return the settings."""
        return dict(self.values)

    def unit_of(self, path: str) -> str:
        """Return the SI unit of a setting."""
        if path not in SETTINGS:
            raise CampaignError(f"{path}: unknown; the open settings are {', '.join(SETTINGS)}")
        return SETTINGS[path][0]

    def check(self, data: dict[str, Any], name: str) -> list[Case]:
        """Return the six cases of a point."""
        from gearmbs.studies.case.limits import check_record
        from gearmbs.studies.presets.paper_cases import paper_cases

        s = data
        friction = (
            {"enabled": False} if s["friction"] <= 0.0 else {"static": s["friction"], "dynamic": 0.5 * s["friction"]}
        )
        mesh = 29 * s["speed"] / (2.0 * math.pi)
        base = make_case(
            {
                "name": name,
                "operation": {
                    "speed": s["speed"],
                    "torque": s["torque"],
                    "run_up": RUN_UP,
                    "settling": RUN_UP,
                    "duration": max(SHORTEST, PERIODS / mesh),
                },
                "contact": {
                    "stiffness": f"{s['stiffness']!r} N/mm^{s['exponent']!r}",
                    "exponent": s["exponent"],
                    "damping": s["damping"],
                    "depth": s["depth"],
                },
                "friction": friction,
                "fault": {"backlash": s["backlash"], "plane": s["plane"]},
                "gears": {"face_width": s["face_width"]},
                "shafts": {"radius": s["shaft_radius"]},
            },
            name,
        )
        cases = paper_cases(base=base, torques=(s["torque"], 2.0 * s["torque"]))
        for case in cases:
            check_record(case, f"{name}, {case.name}")
        return cases

    def canonical(self, thing: list[Case]) -> Any:
        """Return the contents of the six cases."""
        return [canonical_case(case) for case in thing]

    def run(self, thing: list[Case], progress: Callable[[float], None], keep: Sequence[str]) -> Any:
        """Return the harmonics of the six cases: dims (load, state, harmonic), by component."""
        import xarray as xr

        from gearmbs.studies.presets.paper_cases import LOAD_NAMES, STATES

        levels = []
        for k, case in enumerate(thing):
            record = self._pairs.run(
                case,
                lambda fraction, k=k: progress((k + fraction) / len(thing)),  # type: ignore[misc]
                ("harmonics",),
            )
            levels.append(record["gmf_rms"].sel(way="orders").transpose("component", "harmonic"))
        shape = (len(LOAD_NAMES), len(STATES), *levels[0].shape)
        return xr.DataArray(
            np.array([level.values for level in levels]).reshape(shape),
            dims=("load", "state", "component", "harmonic"),
            coords={
                "load": list(LOAD_NAMES),
                "state": list(STATES),
                "component": levels[0].component.values,
                "harmonic": levels[0].harmonic.values,
            },
        )

    def reduce(self, thing: list[Case], record: Any, keep: Sequence[str]) -> Kept:
        """Return the ratios that decide the claims."""
        return Kept(numbers=ratios(record))

    def explain(self, error: Exception) -> Outcome:
        """Return how a point failed of which a case failed."""
        return self._pairs.explain(error)


def ratios(levels: Any) -> dict[str, float]:
    """Return the ratios that decide the claims from harmonics of dims (load, state, component, harmonic)."""
    from gearmbs.studies.presets.paper_cases import judge

    found: dict[str, float] = {}
    for component in levels.component.values:
        table = levels.sel(component=component)
        healthy, tilted, apart = (table.sel(state=state) for state in table.state.values)
        found[f"misaligned.{component}"] = float((tilted / healthy).sel(harmonic=2).min())
        found[f"distance.{component}"] = float((apart / healthy).min())
        found[f"load.{component}"] = float((table.sel(load="high") / table.sel(load="low")).min())
        scaled = table / np.sqrt((healthy**2).sum("harmonic"))
        found[f"load_each.{component}"] = float((scaled.sel(load="high") / scaled.sel(load="low")).min())
        found[f"all.{component}"] = float(all(claim.held for claim in judge(table, str(component))))
    return found
