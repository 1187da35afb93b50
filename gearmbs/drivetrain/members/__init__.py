"""Members of planetary stages that deform."""
