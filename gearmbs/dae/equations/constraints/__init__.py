"""Constraints (eq. 7) with their first and second derivatives, and the way back onto them."""
