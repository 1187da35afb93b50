"""How compiled code is made, kept, shipped and found: all that knows more of numba than its decorators."""
