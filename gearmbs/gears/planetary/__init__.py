"""Planetary sets: wheels, rims, and the mechanism they make."""
