"""Friction of joints as a force element: its law, stated once, and the kernels that follow from it."""

from __future__ import annotations

REALS = (
    "lever per_force per_axial per_bending per_twist tiny_force tiny_bending tiny_twist overlap "
    "overlap_slope start static dynamic transition deformation kept most kept_about most_about"
).split()
"""Numbers of a joint, by their places: arm of the slip of rotations; factors of the parts of the reaction in N, of the
force of that across the axis, and where their lengths are rounded off; length of the overlap, how it grows with the
displacement, where that begins; coefficients between which g(V) changes at the transition velocity; the largest
deformation, m; P over mu_d and the largest load, of a joint that slides and turns both once for the force and once for
the torque."""
PIN, SLIDE, CYLINDER, BALL = range(4)
"""About the z axis of one of the frames, along z of J, along and about z of J, about all axes of J."""
NAMES = ("pin", "slide", "cylinder", "ball")
