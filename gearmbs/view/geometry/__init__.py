"""Wheels and bodies as profiles, meshes and solids, and their files."""
