"""Elastic bodies: frames of their points, inertia, and the integrals that make it."""
