"""What joins shafts end to end: in line, or with an angle or an offset between their axes."""
