"""Drivetrains: shafts, wheels, meshes, bearings, drives, loads, housings and sensors by name, as one mechanism."""

from gearmbs._lazy import late

__all__ = late(__name__)
