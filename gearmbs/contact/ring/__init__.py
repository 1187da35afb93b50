"""Meshes with a ring whose rim bends: the formulas, stated once, and the force element that they make."""
