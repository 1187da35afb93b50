"""Tires of ADAMS/Tire: property files, and the Magic Formula as function expressions of a deck."""
