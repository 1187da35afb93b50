"""Descriptions in Python and TOML: how files are read and written, fields stated and checked, mistakes told."""
