"""Simulation, statics, linear analyses and what is measured in them."""
