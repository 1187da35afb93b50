"""Wheels on fixed parallel axes: a leaner form of their contact, by the angles alone, from definitions."""
