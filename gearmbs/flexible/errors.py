"""The error of everything that describes, reads or reduces a body that deforms."""

from __future__ import annotations

from gearmbs.dae.errors import ModelError


class FlexibleError(ModelError):
    """A flexible body, its file or its reduction is wrong; the message names place, value and remedy."""
