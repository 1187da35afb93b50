"""Runners: they move units to where they are worked on, and know nothing of what is in them.

A runner is called with the folder's path and an iterator of units and yields a `UnitReport` of each as it ends, in any
order. It takes from the iterator only as many units as it can have on the way.
"""

from gearmbs._lazy import late

__all__ = late(__name__)
