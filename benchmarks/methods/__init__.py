"""Integrators to compare: ours, and the peers that are installed."""
