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

from gearmbs._lazy import late

__all__ = late(__name__)
