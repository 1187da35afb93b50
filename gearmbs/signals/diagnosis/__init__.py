"""Diagnosis of rolling bearings and of planetary sets from recordings."""
