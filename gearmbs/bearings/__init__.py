"""Rolling bearings: geometry, catalogue, Hertz contact of every element, defects, statics, ratings and life."""

from gearmbs._lazy import late

__all__ = late(__name__)
