"""Rigs and studies that are ready to run."""
