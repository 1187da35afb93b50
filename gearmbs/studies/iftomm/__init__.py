"""Benchmark problems of the IFToMM technical committee for multibody dynamics, as mechanisms.

``python -m gearmbs.studies.iftomm`` runs all of them and prints deviations from independent solutions, from published
numbers, and the energy drift.
"""

from gearmbs._lazy import late

__all__ = late(__name__)
