"""Compiled laws of torques about a shaft's axis; see `gearmbs.drivetrain.torque_element` for their arguments."""
