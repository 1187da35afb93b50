"""Scenes in space, their pages and pictures."""
