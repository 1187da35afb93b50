"""The error of campaigns."""

from __future__ import annotations


class CampaignError(ValueError):
    """A plan or a campaign that cannot be worked on; the message names what is wrong and the remedy."""
