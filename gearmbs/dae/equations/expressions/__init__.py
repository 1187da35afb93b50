"""Function expressions as flat tapes evaluated by one compiled, data-driven kernel."""

from gearmbs._lazy import late

__all__ = late(__name__)
