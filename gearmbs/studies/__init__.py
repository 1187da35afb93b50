"""Studies: pure functions from a validated case to a result."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late
from gearmbs.studies.case import Case, CaseError, load_case, make_case

if TYPE_CHECKING:
    from gearmbs.signals.simulated import record_signal
    from gearmbs.studies.claims import Claim
    from gearmbs.studies.paper import PaperStudy, run_paper
    from gearmbs.studies.parallel import run_cases
    from gearmbs.studies.preset import paper_cases
    from gearmbs.studies.rig import gear_rig
    from gearmbs.studies.simulation import SimulationFailed, SimulationInterrupted, run_case, simulate_case

__all__ = [
    "Case",
    "CaseError",
    "Claim",
    "PaperStudy",
    "SimulationFailed",
    "SimulationInterrupted",
    "gear_rig",
    "load_case",
    "make_case",
    "paper_cases",
    "record_signal",
    "run_case",
    "run_cases",
    "run_paper",
    "simulate_case",
]

# what simulates compiles; a case can be made and checked without
__getattr__ = late(
    __name__,
    {
        "record_signal": "gearmbs.signals.simulated",
        "Claim": "gearmbs.studies.claims",
        "PaperStudy": "gearmbs.studies.paper",
        "paper_cases": "gearmbs.studies.preset",
        "run_paper": "gearmbs.studies.paper",
        "run_cases": "gearmbs.studies.parallel",
        "gear_rig": "gearmbs.studies.rig",
        "SimulationFailed": "gearmbs.studies.simulation",
        "SimulationInterrupted": "gearmbs.studies.simulation",
        "run_case": "gearmbs.studies.simulation",
        "simulate_case": "gearmbs.studies.simulation",
    },
)
