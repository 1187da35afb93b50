"""Formulas of the contact that are stated once, and what follows from them."""
