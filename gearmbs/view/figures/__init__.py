"""Figures of signals, maps, reports and bodies."""
