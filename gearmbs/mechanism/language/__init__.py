"""Expressions in the language of ADAMS functions."""
