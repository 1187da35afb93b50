"""Rotations: direction cosines, their variations and rates, and how a step updates them."""
