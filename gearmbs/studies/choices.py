"""What the paper leaves open, and what a study chose for it, from the study's own cases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearmbs.studies.case import Case
from gearmbs.studies.preset import DEFAULT_COMPONENT, paper_cases


@dataclass(frozen=True)
class Choice:
    """One thing the paper leaves open.

    Attributes
    ----------
    what : str
    chosen : str
        The study's value, with its unit.
    preset : str
        The preset's value.
    why : str
        Reason of the preset's value.
    """

    what: str
    chosen: str
    preset: str
    why: str

    @property
    def changed(self) -> bool:
        """Whether the study differs from the preset."""
        return self.chosen != self.preset


WHY = {
    "speed": "puts three harmonics far below half the sampling rate",
    "penetration d of full damping": "ADAMS's default; 0.01 mm is stiffer and damps far more",
    "stiffness K": "the exponent is 1.3, so K is per mm^1.3; the printed N/mm^(3/2) contradicts it",
    "damping C": "the paper's C = 0.001 K, read as the number of K times 0.001",
    "normal backlash": "by thinning; the table's standard teeth have none, and no real pair runs without",
    "face width": "a usual ratio to the module",
    "gears": "steel discs of the pitch radius",
    "shafts": "solid steel cylinders",
    "misalignment": "in parallel planes (skew) about the middle of the driven face",
    "centre distance": "the paper's figure",
    "friction": "ADAMS's velocity law with usual coefficients of steel",
    "start": "STEP of speed and torque, then settling, then the record",
    "record": "as the paper's measurements were sampled",
    "which force": "the fixed joint between driven gear and shaft; every component is stored and judged",
    "mean": "removed before scaling; the band-pass removes it anyway",
    "scaling": "keeps states and loads comparable",
    "filter band": "neighbouring harmonics stay apart",
}


def choices(cases: list[Case], component: str) -> list[Choice]:
    """Return what a study of the six cases chose, beside the preset.

    Parameters
    ----------
    cases : list of Case
        As :func:`gearmbs.studies.preset.paper_cases` returns them.
    component : str
        Force component of the figures.
    """
    chosen, preset = _values(cases, component), _values(paper_cases(), DEFAULT_COMPONENT)
    return [Choice(what, chosen[what], preset[what], why) for what, why in WHY.items()]


def _values(cases: list[Case], component: str) -> dict[str, str]:
    case = cases[0]
    pair = case.pair()
    o, f, c, r, s = case.operation, case.fault, case.contact, case.friction, case.shafts
    tilts = [x.fault for x in cases if x.fault.misalignment]
    shifts = [x.fault.centre_distance_error for x in cases if x.fault.centre_distance_error]
    wheels = " and ".join(f"{w.mass:.4g} kg" for w in pair.wheels)
    tilt = "none"
    if tilts:
        pivot = f", pivot {1e3 * tilts[0].pivot:+.4g} mm along the axis" if tilts[0].pivot else ""
        tilt = f"{np.rad2deg(tilts[0].misalignment):.4g} degree, {tilts[0].plane}{pivot}"
    friction = "none"
    if r.enabled:
        friction = (
            f"{r.static:.4g} below {r.static_speed:.4g} m/s, {r.dynamic:.4g} above {r.dynamic_speed:.4g} m/s of sliding"
        )
    return {
        "speed": f"{o.top_speed * 30 / np.pi:.6g} rpm: GMF {case.mesh_frequency:.2f} Hz",
        "penetration d of full damping": f"{1e3 * c.depth:.4g} mm",
        "stiffness K": f"{c.stiffness}, exponent {c.exponent:g}",
        "damping C": str(c.damping),
        "normal backlash": f"{1e3 * f.backlash:.4g} mm",
        "face width": f"{1e3 * pair.narrower_face_width:.4g} mm",
        "gears": wheels,
        "shafts": f"diameter {2e3 * s.radius:.4g} mm, length {1e3 * s.length:.4g} mm",
        "misalignment": tilt,
        "centre distance": f"{1e3 * shifts[0]:+.4g} mm" if shifts else "nominal",
        "friction": friction,
        "start": f"over {o.run_up:.4g} s, settling {o.settling:.4g} s",
        "record": f"{o.duration:.4g} s at {case.signal_rate:.6g} Hz",
        "which force": component.replace("_", " "),
        "mean": "removed",
        "scaling": "one factor from the healthy signal at low load, kept for the other five",
        "filter band": "a quarter of the GMF to both sides of each harmonic, zero phase",
    }
