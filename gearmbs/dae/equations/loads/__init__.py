"""Generalized forces (eq. 5) and their derivatives."""
