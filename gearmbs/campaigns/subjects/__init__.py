"""What a campaign simulates: gear pairs, drivetrains, bearings, decks with parameters, functions."""

from gearmbs._lazy import late

__all__ = late(__name__)
