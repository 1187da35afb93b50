"""The error of identification."""

from __future__ import annotations


class IdentifyError(ValueError):
    """A fit that cannot be made; the message names what is wrong and the remedy."""
