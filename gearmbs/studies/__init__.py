"""Studies: pure functions from a validated case to a result."""

from gearmbs._lazy import late

__all__ = late(__name__)
