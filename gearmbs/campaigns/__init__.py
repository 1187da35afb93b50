"""Campaigns: from one case to a million, on one machine or a cluster, with what is asked of the results.

A plan says what is simulated, what varies and what is kept; a campaign is the folder in which it is carried out, and
which is
queue, memory and result at once::

    from gearmbs.campaigns import Campaign, Factor, make_plan

    plan = make_plan(case, [Factor("operation.torque", "50 N m", "200 N m")], "sobol", n=256, keep=["harmonics"])
    campaign = Campaign("torque.campaign", plan)
    campaign.run(workers=2)
    campaign.table
"""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.campaigns.campaign import Campaign
    from gearmbs.campaigns.factors import Choice, Factor, Specimens, choose
    from gearmbs.campaigns.plan import Plan, load_plan, make_plan
    from gearmbs.campaigns.runners.dask import dask_client
    from gearmbs.campaigns.sensitivity.bounds import TotalBounds, total_bounds
    from gearmbs.campaigns.sensitivity.indices import SobolIndices, main_effects, morris_effects, sobol_indices
    from gearmbs.campaigns.sensitivity.surrogates import (
        PolynomialChaos,
        ResponseSurface,
        condition_figure,
        condition_map,
        fit_chaos,
        fit_surface,
    )
    from gearmbs.campaigns.settings import CampaignError, canonical, content_key
    from gearmbs.campaigns.status import CampaignStatus
    from gearmbs.campaigns.subjects import (
        BearingSubject,
        DeckSubject,
        DrivetrainSubject,
        FunctionSubject,
        Kept,
        Outcome,
        PairSubject,
        PlanetarySubject,
        Subject,
        make_subject,
        subject_kinds,
    )

__all__ = [
    "BearingSubject",
    "Campaign",
    "CampaignError",
    "CampaignStatus",
    "Choice",
    "DeckSubject",
    "DrivetrainSubject",
    "Factor",
    "FunctionSubject",
    "Kept",
    "Outcome",
    "PairSubject",
    "Plan",
    "PlanetarySubject",
    "PolynomialChaos",
    "ResponseSurface",
    "SobolIndices",
    "Specimens",
    "Subject",
    "TotalBounds",
    "canonical",
    "choose",
    "condition_figure",
    "condition_map",
    "content_key",
    "dask_client",
    "fit_chaos",
    "fit_surface",
    "load_plan",
    "main_effects",
    "make_plan",
    "make_subject",
    "morris_effects",
    "sobol_indices",
    "subject_kinds",
    "total_bounds",
]

late(
    __name__,
    {
        "sobol_indices": ".sensitivity.indices",
        "TotalBounds": ".sensitivity.bounds",
        "total_bounds": ".sensitivity.bounds",
        "morris_effects": ".sensitivity.indices",
        "main_effects": ".sensitivity.indices",
        "SobolIndices": ".sensitivity.indices",
        "PolynomialChaos": ".sensitivity.surrogates",
        "fit_chaos": ".sensitivity.surrogates",
        "fit_surface": ".sensitivity.surrogates",
        "condition_figure": ".sensitivity.surrogates",
        "condition_map": ".sensitivity.surrogates",
        "ResponseSurface": ".sensitivity.surrogates",
        "Campaign": ".campaign",
        "CampaignError": ".settings",
        "CampaignStatus": ".status",
        "Choice": ".factors",
        "BearingSubject": ".subjects",
        "DeckSubject": ".subjects",
        "DrivetrainSubject": ".subjects",
        "Factor": ".factors",
        "FunctionSubject": ".subjects",
        "Kept": ".subjects",
        "Outcome": ".subjects",
        "PairSubject": ".subjects",
        "PlanetarySubject": ".subjects",
        "Plan": ".plan",
        "Specimens": ".factors",
        "Subject": ".subjects",
        "canonical": ".settings:canonical",
        "choose": ".factors",
        "content_key": ".settings",
        "dask_client": ".runners.dask",
        "load_plan": ".plan",
        "make_plan": ".plan",
        "make_subject": ".subjects",
        "subject_kinds": ".subjects",
    },
)
