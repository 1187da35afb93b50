"""Columns of the kinematics table: one row a body, row 0 the ground."""

KIN_R = 0
"""Position of the body frame's origin."""
KIN_V = 3
"""Velocity of the origin."""
KIN_A = 6
"""Orientation, row-major 3x3: columns are the body axes in global components."""
KIN_W = 15
"""Global angular velocity."""
KIN_AXES = 18
"""The three Euler axes a_1, a_2, a_3 in global components; only second derivatives read them."""

ACC_A = 0
"""Columns of the acceleration table: acceleration of the body frame's origin."""
ACC_ALPHA = 3
"""Global angular acceleration."""
