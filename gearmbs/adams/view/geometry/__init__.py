"""Solids of command files: their outlines, and the masses that View makes of them."""
