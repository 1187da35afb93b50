"""Labelled data sets from campaigns: signals, sensors, splits without leaks, cards, a baseline."""

from gearmbs._lazy import late

__all__ = late(__name__)
