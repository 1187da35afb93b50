"""Studies: pure functions from a validated case to a result."""

from gearmbs.studies.case import Case, CaseError, load_case, make_case
from gearmbs.studies.exchange import record_signal
from gearmbs.studies.paper import Claim, PaperStudy, paper_cases, run_paper
from gearmbs.studies.parallel import run_cases
from gearmbs.studies.rig import gear_rig
from gearmbs.studies.run import SimulationFailed, run_case, simulate_case

__all__ = [
    "Case",
    "CaseError",
    "Claim",
    "PaperStudy",
    "SimulationFailed",
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
