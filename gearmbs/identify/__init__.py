"""Identification: parameters from measurements, with what can be known of them and what cannot."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.identify.cases import CaseProblem, compare_models, identify
    from gearmbs.identify.experiments import rank_experiments
    from gearmbs.identify.fit import fit
    from gearmbs.identify.identifiability import Identifiability, Surrogate, posterior
    from gearmbs.identify.measured import harmonic_table
    from gearmbs.identify.parameters import Free, IdentifyError
    from gearmbs.identify.result import Fit

__all__ = [
    "CaseProblem",
    "Fit",
    "Free",
    "Identifiability",
    "IdentifyError",
    "Surrogate",
    "compare_models",
    "fit",
    "harmonic_table",
    "identify",
    "posterior",
    "rank_experiments",
]

late(
    __name__,
    {
        "CaseProblem": ".cases",
        "Fit": ".result",
        "Free": ".parameters",
        "Identifiability": ".identifiability",
        "IdentifyError": ".parameters",
        "Surrogate": ".identifiability",
        "compare_models": ".cases",
        "fit": ".fit:fit",
        "harmonic_table": ".measured",
        "identify": ".cases",
        "posterior": ".identifiability:posterior",
        "rank_experiments": ".experiments",
    },
)
