"""Diagnosis of rolling bearings from recordings."""
