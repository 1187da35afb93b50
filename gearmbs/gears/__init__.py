"""Wheels and pairs: geometry, mass, placement in space, faults, and analyses that need no dynamics."""

from gearmbs._lazy import late

__all__ = late(__name__)
