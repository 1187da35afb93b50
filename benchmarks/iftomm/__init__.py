"""Benchmark problems of the IFToMM technical committee for multibody dynamics, as mechanisms.

``python -m benchmarks.iftomm`` runs all of them and prints deviations from independent solutions, from published
numbers, and the energy drift.
"""

from benchmarks.iftomm.benchmark import PROBLEMS, Outcome, Problem, run, table
from benchmarks.iftomm.models import andrews, bricard, four_bars, governor, pendulum, slider_crank
from benchmarks.iftomm.references import PUBLISHED, Published

__all__ = [
    "PROBLEMS",
    "PUBLISHED",
    "Outcome",
    "Problem",
    "Published",
    "andrews",
    "bricard",
    "four_bars",
    "governor",
    "pendulum",
    "run",
    "slider_crank",
    "table",
]
