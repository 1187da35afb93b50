"""Averages and diagnosis of planetary sets."""
