"""Command files of View."""
