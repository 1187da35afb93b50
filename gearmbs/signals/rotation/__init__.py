"""Speed, shaft angle, and signals by angle and order."""
