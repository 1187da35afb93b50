"""What is evaluated at output times: accelerations, multipliers and reactions."""
