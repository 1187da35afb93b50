"""Compiled laws of torques about a shaft's axis; see `gearmbs.drivetrain.torque_kernel` for their arguments."""
