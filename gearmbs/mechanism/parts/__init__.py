"""What a mechanism is made of: bodies, joints, force elements, functions of time."""
