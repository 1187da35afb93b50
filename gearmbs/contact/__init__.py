"""Compiled kernels of tooth contact: force laws, friction, tooth gaps, slices; values and exact derivatives."""

from gearmbs._lazy import late

__all__ = late(__name__)
