"""Members of planetary stages: carriers that deform, and pins."""
