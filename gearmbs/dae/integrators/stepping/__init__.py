"""Runs that are held between calls, taken out as a state and put back."""
