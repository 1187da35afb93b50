"""Gaps between two flanks in their sections, with derivatives by the pose."""
