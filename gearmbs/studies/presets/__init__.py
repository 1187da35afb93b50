"""Rigs that are ready to run."""
