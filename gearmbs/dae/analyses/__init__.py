"""Static, quasi-static, kinematic, linearised and modal analyses of a mechanism."""
