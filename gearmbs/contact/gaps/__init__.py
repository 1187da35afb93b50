"""Gaps of two tooth profiles in a section across two tilted wheels, with all derivatives, from one statement."""
