"""Identification: parameters from measurements, with what can be known of them and what cannot."""

from gearmbs._lazy import late

__all__ = late(__name__)
