"""Recordings in files: a format a module, and the table of formats."""
