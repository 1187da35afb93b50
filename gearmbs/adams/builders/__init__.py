"""Statements of a deck to a mechanism."""
