"""Bodies that deform: shafts by sections, finite-element models, their reduction, beams of large motion."""

from gearmbs._lazy import late

__all__ = late(__name__)
