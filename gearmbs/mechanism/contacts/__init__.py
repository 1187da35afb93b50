"""Contact between solids: shapes, where they touch, what presses them apart and what rubs."""

from gearmbs._lazy import late

__all__ = late(__name__)
