"""A mechanism to a deck (.adm)."""
